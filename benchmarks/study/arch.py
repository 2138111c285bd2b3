"""An arch of voussoirs whose right support gives way slowly: its thrust, and how far it comes down.

A voussoir is a rigid body of four disks: two on each face, one within and one without, so that joints open as hinges do.
"""

import cairn as cn
import numpy as np

DT, PREPARE, DURATION = 1e-3, 0.2, 0.4  # [s]


def build(voussoirs=17, friction=0.6, radius=1.0, thickness=0.2, speed=0.05, span=160.0):
    """radius: mean of the ring [m]. thickness: over the radius. speed: of the right support, outwards [m/s]. span: degrees."""
    stone = cn.Material("stone", density=2400.0)
    pitch = np.radians(span) / voussoirs
    inner, outer = radius * (1 - thickness / 2), radius * (1 + thickness / 2)
    sizes = np.repeat([inner, outer], 2) * np.sin(pitch / 4)
    turn = np.tile([-pitch / 4, pitch / 4], 2)
    reach = np.repeat([inner, outer], 2)
    area = np.pi * sizes**2
    local = np.column_stack((reach * np.sin(turn), reach * np.cos(turn)))  # of the voussoir at the crown
    centre = area @ local / area.sum()
    offsets = local - centre
    mass = 2400.0 * area.sum()
    inertia = 2400.0 * float(area @ (np.sum(offsets**2, axis=1) + sizes**2 / 2))
    angle = (np.arange(voussoirs) - (voussoirs - 1) / 2) * pitch
    position = centre[1] * np.column_stack((np.sin(angle), np.cos(angle)))
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    for group, rows, drive in (
        ("left support", [0], (0.0, 0.0, 0.0)), ("arch", slice(1, -1), None), ("right support", [-1], (speed, 0.0, 0.0)),
    ):
        ring = cn.clumps(position[rows], offsets, sizes, mass, inertia, stone, rotation=-angle[rows], group=group)
        scene.add(ring if drive is None else ring.with_(driven=("vx", "vy", "w"), drive=drive))
    scene.interact(stone, stone, cn.Coulomb(mu=friction))
    return scene


def figure_crown(sim):
    """Height of the highest voussoir [m]."""
    return float(sim.bodies.position[:, 1].max())
