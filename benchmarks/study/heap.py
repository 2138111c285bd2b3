"""A wall pushed slowly into a settled heap of disks: the thrust of the ground on it."""

import cairn as cn

DT, PREPARE, DURATION = 1e-3, 0.3, 0.2  # [s]
DIAMETER, GRAVITY = 0.02, 9.81


def build(disks=80, seed=1, friction=0.4, spread=0.3, speed=0.1, width=12):
    """width: of the box in diameters. speed: of the wall [m/s]. spread: of the radii."""
    radii = cn.pre.grains.uniform(disks, DIAMETER / 2 * (1 - spread), DIAMETER / 2 * (1 + spread), rng=seed)
    length = width * DIAMETER
    soil = cn.Material("soil", density=2000.0)
    scene = cn.Scene(dim=2, gravity=(0.0, -GRAVITY))
    scene.add(cn.disks(cn.pre.deposit_disks(radii, length), radii, soil))
    scene.add(cn.wall((0, 0), (1, 0), soil, velocity=(speed, 0.0), group="wall"))
    scene.add(cn.wall((length, 0), (-1, 0), soil), cn.wall((0, 0), (0, 1), soil))
    scene.interact(soil, soil, cn.Coulomb(mu=friction))
    return scene
