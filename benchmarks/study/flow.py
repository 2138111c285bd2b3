"""A dense flow: disks sheared between two rough walls under a pressure, periodic along the flow."""

import cairn as cn
import numpy as np

DIAMETER, DENSITY, PRESSURE = 0.01, 2600.0, 1.0e3
FALL = DIAMETER * np.sqrt(DENSITY / PRESSURE)  # [s] in which the pressure closes a gap of one grain
DT, PREPARE, DURATION = 0.05 * FALL, 20 * FALL, 20 * FALL


def build(disks=60, seed=1, friction=0.4, spread=0.2, inertial=0.1):
    """inertial: number I of the flow, shear rate times FALL."""
    radii = cn.pre.grains.uniform(disks, DIAMETER / 2 * (1 - spread), DIAMETER / 2 * (1 + spread), rng=seed)
    height = np.sqrt(np.sum(np.pi * radii**2) / 0.8)
    length = float(np.round(height / DIAMETER) * DIAMETER)
    centers = cn.pre.deposit_disks(radii, length)
    top = float(np.max(centers[:, 1] + radii))
    grain, wall = cn.Material("grain", density=DENSITY), cn.Material("wall", density=DENSITY)
    count = int(round(length / DIAMETER))
    row = np.column_stack(((np.arange(count) + 0.5) * length / count, np.full(count, -DIAMETER / 2)))
    rough = length / count / 2
    scene = cn.Scene(dim=2, periodic=cn.Periodic((length, np.inf)))
    scene.add(cn.disks(centers, radii, grain))
    scene.add(cn.disks(row, rough, wall, driven=("vx", "vy", "w"), drive=(0.0, 0.0, 0.0), group="lower wall"))
    middle = np.array([length / 2, top + DIAMETER / 2])
    offsets = row - row.mean(axis=0)
    mass = float(DENSITY * np.sum(np.pi * radii**2)) / 4
    lid = cn.clumps(middle[None], offsets, np.full(count, rough), mass, mass * length**2 / 12, wall, group="upper wall")
    speed = inertial / FALL * (top + DIAMETER)
    scene.add(lid.with_(driven=("vx", "w"), drive=(speed, 0.0, 0.0), force=(0.0, -PRESSURE * length, 0.0)))
    scene.interact("*", "*", cn.Coulomb(mu=friction))
    scene.interact("lower wall", "upper wall", None)
    scene.interact("lower wall", "lower wall", None)
    return scene


def figure_shear_stress(sim):
    """Shear stress of the upper wall over the pressure."""
    contacts, lid = sim.contacts, sim.bodies.id[-1]
    sign = (contacts.bodies[:, 0] == lid).astype(float) - (contacts.bodies[:, 1] == lid)
    return -float(sign @ contacts.force[:, 0]) / (PRESSURE * sim.scene.periodic.lengths[0])
