"""A heavy ball on a light one, without friction, is unstable: it falls at the rate of the closed form at any ratio of masses."""

import cairn as cn
import numpy as np
import pytest

G, RADIUS, OFFSET = 9.81, 0.5, 1e-6


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("ratio, folds, gate", [(1.0, 6, 1e-3), (1e3, 6, 1e-3), (1e4, 6, 1e-3), (1e6, 4, 1e-3), (1e9, 1, 1e-3)])
def test_balls_on_end_fall_at_their_rate(dim, ratio, folds, gate):
    """The offset d of the upper ball, of mass M, grows as d'' = (M + m) g d / (m D), D the distance of centres: d cosh(lambda t).
    Once its speed exceeds sqrt(g D) the lower ball is shot out sideways, so the test ends earlier for larger ratios."""
    light, heavy = cn.Material("light", density=1000.0), cn.Material("heavy", density=1000.0 * ratio)
    place = (lambda x, z: [x, z]) if dim == 2 else (lambda x, z: [x, 0.0, z])
    balls = cn.disks if dim == 2 else cn.spheres
    scene = cn.Scene(dim, gravity=place(0.0, -G))
    scene.add(balls([place(0.0, RADIUS)], RADIUS, light))
    scene.add(balls([place(OFFSET, RADIUS + np.sqrt(4 * RADIUS**2 - OFFSET**2))], RADIUS, heavy))
    scene.add(cn.wall(place(0.0, 0.0), place(0.0, 1.0), light))
    scene.interact("*", "*", cn.Frictionless())
    rate = np.sqrt(G * (ratio + 1) / (2 * RADIUS))
    steps = 50 * folds
    sim = cn.Simulation(scene, 1 / (50 * rate), overlap="ignore")
    for _ in range(steps):
        assert sim.step()["status"] == "converged"
    x = sim.bodies.position
    found = (x[1, 0] - x[0, 0]) / (OFFSET * np.cosh(rate * sim.dt * steps))
    print(f"{dim}D, masses 1 to {ratio:g}: offset / that of the closed form {found:.6f}")
    assert abs(found - 1) < gate
