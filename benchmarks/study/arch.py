"""An arch of voussoirs whose right support gives way slowly: its thrust, and how far it comes down."""

import cairn as cn
import numpy as np

DT, PREPARE, DURATION = 1e-3, 0.2, 0.4  # [s]


def build(voussoirs=15, friction=0.7, radius=1.0, thickness=0.2, speed=0.05, span=160.0):
    """radius: mean of the ring [m]. thickness: over the radius. speed: of the right support, outwards [m/s]. span: degrees."""
    stone = cn.Material("stone", density=2400.0)
    joints = np.radians(span) * (np.arange(voussoirs + 1) / voussoirs - 0.5)
    ray = np.column_stack((np.sin(joints), np.cos(joints)))
    inner, outer = radius * (1 - thickness / 2) * ray, radius * (1 + thickness / 2) * ray
    ring = [np.array([a, b, c, d]) for a, b, c, d in zip(inner, inner[1:], outer[1:], outer)]
    held = ("vx", "vy", "w")
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.polygons(ring[:1], stone, driven=held, drive=(0.0, 0.0, 0.0), group="left support"))
    scene.add(cn.polygons(ring[1:-1], stone, group="arch"))
    scene.add(cn.polygons(ring[-1:], stone, driven=held, drive=(speed, 0.0, 0.0), group="right support"))
    scene.interact(stone, stone, cn.Coulomb(mu=friction))
    return scene


def figure_crown(sim):
    """Height of the highest voussoir's centre [m]."""
    return float(sim.bodies.position[:, 1].max())
