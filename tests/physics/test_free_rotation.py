"""Free top and the Dzhanibekov flip: angular momentum constant to rounding, energy to O(dt^2) or better, Jacobi's solution."""

import cairn as cn
import numpy as np
import pytest
from report import judge
from scipy.special import ellipj, ellipk


def top(inertia, spin, dt, **strategy):
    """One free body of given principal moments and spin."""
    scene = cn.Scene(3)
    rock = cn.Material("rock", density=1.0)
    scene.add(cn.clumps([[0, 0, 0]], [[0, 0, 0]], [0.1], 1.0, inertia, rock, velocity=np.r_[0, 0, 0, spin]))
    return cn.Simulation(scene, dt, cn.NSCD(**strategy))


def body_spin(sim):
    """Spin in the axes of the body."""
    w, x, y, z = sim.bodies.rotation[0]
    r = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                  [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                  [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])
    return r.T @ sim.bodies.velocity[0, 3:]


def jacobi(inertia, spin, t):
    """Euler's equations for I1 < I2 < I3 from a spin without second component (Landau & Lifshitz, Mechanics, 37)."""
    i1, i2, i3 = inertia
    energy = sum(i * w * w for i, w in zip(inertia, spin))  # twice
    square = sum((i * w) ** 2 for i, w in zip(inertia, spin))
    if square < energy * i2:
        first, second, third = jacobi_of((i3, i2, i1), spin[::-1], energy, square, t)
        return np.array([third, second, first])
    return np.array(jacobi_of((i1, i2, i3), spin, energy, square, t))


def jacobi_of(inertia, spin, energy, square, t):
    i1, i2, i3 = inertia
    a1 = np.sqrt((energy * i3 - square) / (i1 * (i3 - i1)))
    a2 = np.sqrt((energy * i3 - square) / (i2 * (i3 - i2)))
    a3 = np.sqrt((square - energy * i1) / (i3 * (i3 - i1)))
    rate = np.sqrt((i3 - i2) * (square - energy * i1) / (i1 * i2 * i3)) if i3 > i1 else -np.sqrt(
        (i2 - i3) * (energy * i1 - square) / (i1 * i2 * i3))
    k2 = (i2 - i1) * (energy * i3 - square) / ((i3 - i2) * (square - energy * i1))
    sn, cn_, dn, _ = ellipj(rate * t, k2)
    s1, s3 = np.sign(spin[0]) or 1, np.sign(spin[2]) or 1
    return a1 * cn_ * s1, a2 * sn * s1 * s3, a3 * dn * s3


def test_the_flip_follows_jacobi_at_second_order():
    inertia, spin = (1.0, 2.0, 3.0), np.array([1e-2, 0.0, 0.0])
    spin = np.array([0.02, 1.0, 0.01])
    reference = None
    errors = []
    for dt in (0.02, 0.01, 0.000625):
        sim = top(inertia, spin, dt)
        momentum = sim._core.scene.body("angular_momentum")[0]
        for _ in range(round(20 / dt)):
            sim.step()
        judge("angular momentum", sim._core.scene.body("angular_momentum")[0], momentum, 1e-15)
        energy = 0.5 * np.dot(inertia, body_spin(sim) ** 2)
        judge("energy", energy, 0.5 * np.dot(inertia, spin**2), 1e-12)
        errors.append(body_spin(sim))
    coarse, fine, reference = errors
    ratio = np.linalg.norm(coarse - reference) / np.linalg.norm(fine - reference)
    print(f"flip: error falls by {ratio:.3f} when the step is halved")
    assert 3.5 < ratio < 4.5
    assert np.linalg.norm(fine - reference) < 0.05


def test_jacobi_solution():
    inertia, spin = (1.0, 2.0, 3.0), np.array([0.4, 0.0, 1.0])
    sim = top(inertia, spin, 1e-3)
    for k in range(5000):
        sim.step()
        if k % 500 == 0:
            judge("spin", body_spin(sim), jacobi(inertia, spin, sim.time), 2e-6)


def test_the_top_flips_at_the_period_of_the_ellipse():
    """The flip repeats with the period 4 K(k2) / rate; half of it turns the middle axis over."""
    inertia, spin = np.array([1.0, 2.0, 3.0]), np.array([1e-3, 1.0, 0.0])
    sim = top(inertia, spin, 2e-3)
    signs, times = [], []
    while sim.time < 60:
        sim.step()
        signs.append(np.sign(body_spin(sim)[1]))
        times.append(sim.time)
    turns = np.array(times)[np.flatnonzero(np.diff(signs))]
    energy, square = np.dot(inertia, spin**2), np.sum((inertia * spin) ** 2)
    i1, i2, i3 = inertia if square >= energy * inertia[1] else inertia[::-1]
    rate = np.sqrt(abs((i3 - i2) * (square - energy * i1) / (i1 * i2 * i3)))
    k2 = (i2 - i1) * (energy * i3 - square) / ((i3 - i2) * (square - energy * i1))
    judge("half period", np.mean(np.diff(turns)), 2 * ellipk(k2) / rate, 2e-3)


@pytest.mark.parametrize("inertia", [(1.0, 1.0 + 1e-14, 1.0), (1.0, 1.0, 1.9999), (1e-20, 1.1e-20, 2e-20), (1e20, 2e20, 2.5e20)])
@pytest.mark.parametrize("dt", [1e-3, 1.0, 1e3])
def test_momentum_and_energy_survive_the_extremes(inertia, dt):
    spin = np.array([0.3, 1.0, 0.2])
    sim = top(inertia, spin, dt)
    momentum = sim._core.scene.body("angular_momentum")[0]
    for _ in range(20):
        sim.step()
    judge("angular momentum", sim._core.scene.body("angular_momentum")[0], momentum, 1e-15)
    judge("energy", np.dot(inertia, body_spin(sim) ** 2), np.dot(inertia, spin**2), 1e-10)
    judge("unit quaternion", np.linalg.norm(sim.bodies.rotation[0]), 1.0, 1e-14)
