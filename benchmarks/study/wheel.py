"""A small wheel on a rail of bonded grains: errors of a stroke by time step, tolerance and stiffness of the zone.

    cairn study wheel.py:stiffness=1.4e14 wheel.py wheel.py:stiffness=1.4e16 --figure bonds --figure friction --solvers NLGS \\
        --tolerances 1e-2 1e-3 1e-4 --dt-factors 1 2 --warm-start on --max-iter 500 --no-one-step
"""

import importlib
import sys
from pathlib import Path

import cairn as cn
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "examples" / "wheel_and_rail"))
wheel = importlib.import_module("wheel_and_rail")

PERIOD = 2 * wheel.STROKE / wheel.SPEED
DT = wheel.STEP * 2 * wheel.MEAN * np.sqrt(wheel.DENSITY / wheel.PRESSURE)
PREPARE, DURATION = wheel.PRESSED * PERIOD, 0.5 * PERIOD


def build(stiffness=wheel.STIFFNESS, disks=120, seed=1):
    """Strength and work of a bond are the same at every stiffness."""
    pair = wheel.Pair(wheel.options_from(["--disks", str(disks), "--seed", str(seed)]))
    rail = cn.Material("rail", density=wheel.DENSITY)
    zone = cn.MP3(normal_stiffness=stiffness, tangential_stiffness=stiffness, mu=wheel.FRICTION, strength=wheel.STRENGTH,
                  work=wheel.TOUGH * wheel.STRENGTH**2 / wheel.STIFFNESS, within=0.02 * wheel.SMALLEST)  # fmt: skip
    pair.scene.interact(rail, rail, zone)  # the later rule counts
    return cn.Simulation(pair.scene, pair.dt, cn.NSCD(theta=0.6))


def on_the_wheel(sim):
    """Force of the contacts on the wheel, the last body [N]."""
    contacts, last = sim.contacts, len(sim.bodies.id) - 1
    sign = (contacts.bodies[:, 0] == last).astype(float) - (contacts.bodies[:, 1] == last)
    return sign @ contacts.force


def figure_friction(sim):
    """Tangential over normal force on the wheel."""
    force = on_the_wheel(sim)
    return float(abs(force[0]) / force[1]) if force[1] > 0 else 0.0


def figure_bonds(sim):
    """Bonds that hold."""
    return float((sim.contacts.beta > 0).sum())
