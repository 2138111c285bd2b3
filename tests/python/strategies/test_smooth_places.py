"""Smooth DEM keeps places and close triangles from step to step: results know nothing of it."""

import cairn as cn
import numpy as np
import pytest

ROCK, WALL = cn.Material("rock", density=2500.0), cn.Material("wall", density=2500.0)
LAW = cn.HertzMindlin(young=1e6, poisson=0.3, restitution=0.6, mu=0.4)


def spheres(count, rng):
    """A loose lattice of spheres in a cube of side 1, with speeds and spins."""
    edge = round(count ** (1 / 3))
    grid = (np.stack(np.meshgrid(*3 * [np.arange(edge)], indexing="ij"), -1).reshape(-1, 3) + 0.5) / edge - 0.5
    radius = rng.uniform(0.42, 0.5, len(grid)) / edge
    turning = np.c_[rng.normal(size=(len(grid), 3)), 5 * rng.normal(size=(len(grid), 3))]
    return cn.spheres(0.8 * grid, 0.8 * radius, ROCK, velocity=turning)


def test_a_held_body_far_away_leaves_the_bits_of_free_ones():
    ends = []
    for walls in (0, 1, 3):
        scene = cn.Scene(3, gravity=(0.3, 0.1, -9.81))
        scene.add(spheres(27, np.random.default_rng(1)))
        for k in range(walls):
            scene.add(cn.wall((0, 0, -50.0 - k), (0, 0, 1), WALL))
        scene.interact(ROCK, ROCK, LAW)
        if walls:
            scene.interact(ROCK, WALL, LAW)
        sim = cn.Simulation(scene, 1e-4, cn.SmoothDEM(skin=0.02), overlap="ignore")
        for _ in range(300):
            sim.step()
        ends.append((sim.bodies.position[:27].tobytes(), sim.bodies.velocity[:27].tobytes()))
    assert ends[0] == ends[1] == ends[2]


def cage(n, velocity):
    """The inside of a cube of side 1, 2 n^2 triangles a face."""
    at = np.linspace(-0.5, 0.5, n + 1)
    x, y = (a.ravel() for a in np.meshgrid(at, at, indexing="ij"))
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    half = np.r_[np.c_[corner, corner + n + 1, corner + 1], np.c_[corner + n + 1, corner + n + 2, corner + 1]]
    points, cells = [], []
    for axis in range(3):
        for side in (-0.5, 0.5):
            face = np.roll(np.c_[x, y, np.full_like(x, side)], axis + 1, axis=1)
            cells.append((half if side < 0 else half[:, ::-1]) + len(points) * len(x))
            points.append(face)
    return cn.surface(np.concatenate(points), np.concatenate(cells), WALL, velocity=velocity)


MOTIONS = {
    "still": None,
    "turns": (0.1, 0, 0, 0, 3.0, 1.0),
    "turns and rests": lambda t: (0.0, 0.0, 0.0, 0.0, 3.0 if np.sin(200 * t) > 0 else 0.0, 0.0),
}


@pytest.mark.parametrize("motion", list(MOTIONS))
def test_bits_do_not_know_how_long_close_triangles_were_kept(motion):
    """A cage of triangles, with a list that is made anew in each step, and one that lasts."""
    ends, lists = [], []
    for skin in (1e-9, 0.03):
        scene = cn.Scene(3, gravity=(0, 0, -9.81))
        scene.add(spheres(27, np.random.default_rng(2)), cage(8, MOTIONS[motion]))
        scene.interact(ROCK, ROCK, LAW)
        scene.interact(ROCK, WALL, LAW)
        sim = cn.Simulation(scene, 2e-4, cn.SmoothDEM(skin=skin), overlap="ignore")
        for _ in range(150):
            sim.step()
        ends.append((sim.bodies.position[:27].tobytes(), sim.bodies.velocity[:27].tobytes()))
        lists.append(sim.info["neighbour_lists"])
        assert np.abs(sim.bodies.position[:27]).max() < 0.9
    assert lists[0] > 4 * lists[1] and ends[0] == ends[1]
