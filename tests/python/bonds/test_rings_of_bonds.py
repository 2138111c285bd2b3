"""Closed loops of bonds carry the impulses that balance their bodies, without self-equilibrated parts (null space of H)."""

import cairn as cn
import numpy as np
import pytest

ROCK, R, DENSITY = cn.Material("rock", density=2000.0), 0.05, 2000.0


def ring(count):
    """Disks that touch round the origin, and how far they are from it."""
    far = R / np.sin(np.pi / count)
    angle = 2 * np.pi * np.arange(count) / count
    return far * np.column_stack([np.cos(angle), np.sin(angle)]), far


def joined(centers, velocity, dt, tol=1e-6, periodic=None):
    dim = np.shape(centers)[1]
    scene = cn.Scene(dim, periodic=periodic)
    scene.add((cn.disks if dim == 2 else cn.spheres)(centers, R, ROCK, velocity=velocity))
    scene.interact(ROCK, ROCK, cn.Bonded())
    return cn.Simulation(scene, dt, cn.NSCD(solver=cn.Auto(tol=tol)), overlap="ignore")


@pytest.mark.parametrize("count", [3, 6])
def test_a_ring_that_spins_is_drawn_by_its_own_inertia(count):
    """Without a load that says so its bonds bore up to 1e9 N against each other."""
    x, far = ring(count)
    spin = 10.0
    sim = joined(x, np.column_stack([-spin * x[:, 1], spin * x[:, 0], np.full(count, spin)]), 1e-3)
    drawn = DENSITY * np.pi * R**2 * spin**2 * far / (2 * np.sin(np.pi / count))
    for step in range(200):
        assert sim.step()["status"] == "converged"
        force = np.linalg.norm(sim.contacts.force, axis=1)
        if step > 2:
            assert force == pytest.approx(np.full(count, drawn), rel=1e-3)


def test_a_push_leaves_no_force_behind():
    """1.7e9 N stayed for ever in a ring of which one disk was pushed at 1 cm/s."""
    x, far = ring(6)
    velocity = np.zeros((6, 3))
    velocity[0, :2] = 0.01, 0.01
    sim = joined(x, velocity, 1e-3)
    for _ in range(50):
        assert sim.step()["status"] == "converged"
    # about the middle: a sixth of the momentum goes to each, and a spin
    mass = DENSITY * np.pi * R**2
    inertia = 6 * mass * (far**2 + R**2 / 2)
    spin = mass * far * 0.01 / inertia
    assert sim.bodies.velocity[:, 2] == pytest.approx(np.full(6, spin), rel=1e-3)
    force = np.linalg.norm(sim.contacts.force, axis=1)
    assert force == pytest.approx(np.full(6, mass * spin**2 * far), rel=1e-3)


def test_spheres_on_each_other_bear_no_more_than_their_inertia_asks():
    """A rotating tetrahedron; regression: bonds carried 1.5e9 N."""
    x = np.array([[0, 0, 0], [1, 0, 0], [0.5, 0.75**0.5, 0], [0.5, 0.5 / 3**0.5, (2 / 3) ** 0.5]]) * 2 * R
    x -= x.mean(0)
    spin = np.array([3.0, -4.0, 9.0])
    velocity = np.hstack([np.cross(spin, x), np.tile(spin, (4, 1))])
    sim = joined(x, velocity, 1e-3)
    most = DENSITY * 4 / 3 * np.pi * R**3 * (spin @ spin) * np.linalg.norm(x[0])
    for _ in range(100):
        assert sim.step()["status"] == "converged"
    assert 0.2 * most < np.linalg.norm(sim.contacts.force, axis=1).max() < most


@pytest.mark.parametrize("tol", [1e-4, 1e-6])
def test_a_row_that_a_cell_closes_has_the_velocity_of_all(tol):
    """Velocities were off by 4e-4, and by 6e-3 of 30 disks, at an error below the tolerance."""
    for count in (4, 30):
        x = np.column_stack([R + 2 * R * np.arange(count), np.full(count, 0.5)])
        velocity = np.random.default_rng(0).normal(size=(count, 3)) * (1, 1, 0)
        sim = joined(x, velocity, 1e-4, tol, cn.Periodic(lengths=(2 * R * count, np.inf)))
        for _ in range(20):
            assert sim.step()["status"] == "converged"
        away = sim.bodies.velocity[:, :2] - velocity[:, :2].mean(0)
        assert np.abs(away).max() < 2e-5
        assert np.abs(sim.contacts.impulse).max() < 1e-6


@pytest.mark.parametrize("size", [1.0, 1e-4, 1e-6, 1e-8])
def test_a_ring_of_any_size_keeps_its_spin(size):
    """Below a micrometre blocks had only rotations left, which are that much lighter in their units: 18.9 rad/s of 20."""
    x, _ = ring(3)
    spin = 20.0
    scene = cn.Scene(2)
    turns = np.column_stack([-spin * size * x[:, 1], spin * size * x[:, 0], np.full(3, spin)])
    scene.add(cn.disks(size * x, size * R, ROCK, velocity=turns))
    scene.interact(ROCK, ROCK, cn.Bonded())
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(solver=cn.Auto(tol=1e-10)), overlap="ignore")
    for _ in range(100):
        assert sim.step()["status"] == "converged"
    assert sim.bodies.velocity[:, 2] == pytest.approx(np.full(3, spin), rel=1e-6)
