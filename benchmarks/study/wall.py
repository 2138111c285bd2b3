"""A masonry wall of dry bricks in running bond on a base that shakes: displacement of the bricks and load of the base."""

import cairn as cn
import numpy as np

DT, PREPARE, DURATION = 1e-3, 0.3, 0.3  # [s]


def build(courses=6, columns=5, brick=(0.2, 0.1), friction=0.6, acceleration=4.0, frequency=4.0):
    """brick: length and height [m]. acceleration: greatest of the base [m/s2]. frequency [Hz]."""
    stone = cn.Material("stone", density=1800.0)
    length, height = brick
    bricks = []
    for course in range(courses):
        edges = np.arange(columns + 1) * length
        if course % 2:
            edges = np.concatenate(([0.0], edges[:-1] + length / 2, edges[-1:]))
        low, high = course * height, (course + 1) * height
        bricks += [np.array([(a, low), (b, low), (b, high), (a, high)]) for a, b in zip(edges, edges[1:])]
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.polygons(bricks, stone))
    turn = 2 * np.pi * frequency

    def shaken(t):
        return (acceleration / turn * np.sin(turn * t), 0.0)

    scene.add(cn.wall((0, 0), (0, 1), stone, velocity=shaken, group="base"))
    scene.interact(stone, stone, cn.Coulomb(mu=friction))
    return scene


def figure_top(sim):
    """Height of the highest brick's centre [m]."""
    return float(sim.bodies.position[:, 1].max())
