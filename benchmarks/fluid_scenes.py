"""Scenes and runs that cases of a liquid share."""

import time

import cairn as cn
import numpy as np

ROCK = cn.Material("rock", density=2600.0)


def tank(low, high, width, dx, gravity, lid=False, **options):
    scene = cn.Scene(dim=2, gravity=(0.0, -gravity))
    walls = [cn.wall((0, 0), (0, 1), ROCK), cn.wall((0, 0), (1, 0), ROCK), cn.wall((width, 0), (-1, 0), ROCK)]
    bed = scene.add(*walls)[0]
    scene.add(cn.fluid([low, high], dx, **options))
    return scene, bed


def advanced(scene, h, end, look=None):
    """Runs to a time; (simulation, [look(simulation)] of each step, CPU seconds, particles times sub-steps)."""
    sim, seen, work, start = cn.Simulation(scene, dt=h), [], 0, time.process_time()
    while sim.time < end - 0.5 * h:
        sim.step()
        work += len(sim.fluid) * max(1, sim.fluid.info["sub_steps"])
        if look:
            seen.append(look(sim))
    return sim, seen, time.process_time() - start, work


def basin(size):
    """Scene with a floor and walls about a box from the origin on, in space."""
    scene = cn.Scene(dim=3, gravity=(0.0, 0.0, 0.0))
    bed = scene.add(cn.wall((0, 0, 0), (0, 0, 1), ROCK))[0]
    for k in (0, 1):
        way = np.eye(3)[k]
        scene.add(cn.wall((0, 0, 0), way, ROCK), cn.wall(size[k] * way, -way, ROCK))
    return scene, bed


def images_of_walls():
    """Added mass of a cylinder in the middle of a tank of 8 radii over that in endless liquid: images of its dipole in the floor,
    the walls and the free surface. Rows of images above and below add less than 1e-5."""
    return 1 + 2 * np.pi**2 / 3 / 8**2
