"""The brake of examples/disc_brake on a coarse mesh until it has half its spin: errors by network tolerance, coupling and step.

    cairn study brake.py --network-tolerances 1e-12 1e-4 --couplings staggered 1e-2 1e-8 --dt-factors 1 2 4
"""

import importlib
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "examples" / "disc_brake"))
brake = importlib.import_module("disc_brake")

DT, DURATION = 6.75e-4, 0.0864


def build(along=8):
    options = brake.options_from(["--dt", str(DT), "--along", str(along), "--first", "1e-4"])
    return brake.build(options)[0]


def figure_surface(sim):
    """Mean rise of the nodes that touch the rim [K]."""
    mesh = sim.meshes[0]
    return sim.nodes.temperature[mesh.place][rim(sim)].mean() - brake.REFERENCE


def figure_back(sim):
    """How far the back of the pad was pushed out [m]."""
    return sim.meshes[0].displacement[~rim(sim), 1].max()


def rim(sim):
    """Nodes nearest to the disc (n)."""
    away = ((sim.nodes.position[sim.meshes[0].place]) ** 2).sum(axis=1) ** 0.5
    return away < away.min() + 5e-5
