"""Tubes and rings, seen from inside: pendulums, and a body in a turning drum."""

import cairn as cn
import numpy as np
import pytest
from small_scenes import ROCK
from test_features import G, close, closes, simulate


def test_sphere_in_a_tube():
    """Without friction it swings as a pendulum of length R - r; angle 0.3: period 4 K(sin(a/2)) sqrt(l/g)."""
    from scipy.special import ellipk

    R, r, angle, dt = 1.0, 0.1, 0.3, 5e-4
    scene = cn.Scene(3, gravity=(0, 0, -G))
    place = (R - r) * np.array([0, np.sin(angle), -np.cos(angle)])
    scene.add(cn.spheres([place], r, ROCK), cn.tube((0, 0, 0), (1, 0, 0), R, ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.0))
    sim = simulate(scene, dt)
    crossings = []
    side = 1.0
    while len(crossings) < 5:
        sim.step()
        y = sim.bodies.position[0, 1]
        if np.sign(y) != side:
            crossings.append(sim.time)
            side = np.sign(y)
        assert abs(np.hypot(*sim.bodies.position[0, 1:]) - (R - r)) < 1e-3
    period = 2 * np.mean(np.diff(crossings))
    close(period, 4 * ellipk(np.sin(angle / 2) ** 2) * np.sqrt((R - r) / G), 2e-3)
    closes(sim)


def test_disk_in_a_ring():
    """The same in 2D; and a ring that turns spins a disk at its bottom to W R / r."""
    from scipy.special import ellipk

    R, r, angle = 1.0, 0.1, 0.3
    scene = cn.Scene(2, gravity=(0, -G))
    scene.add(cn.disks([(R - r) * np.array([np.sin(angle), -np.cos(angle)])], r, ROCK), cn.ring((0, 0), R, ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.0))
    sim = simulate(scene, 5e-4)
    crossings, side = [], 1.0
    while len(crossings) < 5:
        sim.step()
        x = sim.bodies.position[0, 0]
        if np.sign(x) != side:
            crossings.append(sim.time)
            side = np.sign(x)
        assert abs(np.hypot(*sim.bodies.position[0]) - (R - r)) < 1e-3
    close(2 * np.mean(np.diff(crossings)), 4 * ellipk(np.sin(angle / 2) ** 2) * np.sqrt((R - r) / G), 2e-3)
    closes(sim)
    for _ in range(2):  # how deep, and where
        sim.step()
        place = np.array(sim.bodies.position[0])
        close(sim.contacts.normal[0], -place / np.linalg.norm(place), 1e-3)
    drum = cn.Scene(2, gravity=(0, -G))
    drum.add(cn.disks([[0.3, 0.1 - (R - 0.2)]], 0.2, ROCK), cn.ring((0.3, 0.1), R, ROCK, velocity=(0, 0, 0.5)))
    drum.interact(ROCK, ROCK, cn.Coulomb(mu=0.8))
    sim = simulate(drum, 1e-3)
    for _ in range(1500):
        sim.step()
    x, y = sim.bodies.position[0] - [0.3, 0.1]
    v = sim.bodies.velocity[0]
    close(v[:2] @ np.array([-y, x]) / np.hypot(x, y) + 0.2 * v[2], 0.5 * R, 1e-3)
    with pytest.raises(ValueError, match="radius is 0.0: give a number > 0"):
        cn.ring((0, 0), 0.0, ROCK)


def test_rotating_drum_spins_what_lies_in_it():
    """A sphere at rest on the bottom of a drum that turns at W ends with the spin W R / r."""
    R, r, spin = 1.0, 0.2, 0.5
    scene = cn.Scene(3, gravity=(0, 0, -G))
    scene.add(cn.spheres([[0, 0, -(R - r)]], r, ROCK), cn.tube((0, 0, 0), (1, 0, 0), R, ROCK, velocity=(0, 0, 0, spin, 0, 0)))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.8))
    sim = simulate(scene, 1e-3)
    slip = []
    for _ in range(1500):
        sim.step()
        v = sim.bodies.velocity[0]
        slip.append(np.linalg.norm(sim.contacts.relative_velocity[0, 1:]))
    assert slip[0] > 0.1
    assert max(slip[-500:]) < 1e-9  # it rolls in the drum: about the bottom it swings
    y, z = sim.bodies.position[0, 1:]
    along = np.array([0, -z, y]) / np.hypot(y, z)
    surface = v[:3] @ along + r * v[3]
    close(surface, spin * R, 1e-3)
    closes(sim)
