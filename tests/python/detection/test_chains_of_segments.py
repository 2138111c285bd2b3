"""Surfaces in 2D: chains of segments on one body, over which bodies slide without catching."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=2600.0)
FLAT = np.column_stack((np.linspace(-1, 5, 25), np.zeros(25)))


def slide(boundary, shape, mu, steps=400, place=(0.03, 0.1), start=2.0):
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    if shape == "disk":
        scene.add(cn.disks([place], 0.1, ROCK, velocity=[[start, 0.0, 0.0]]))
    else:
        corners = np.array([(-0.15, -0.1), (0.15, -0.1), (0.15, 0.1), (-0.15, 0.1)])
        scene.add(cn.polygons(corners, ROCK, position=[place], velocity=[[start, 0.0, 0.0]]))
    scene.add(boundary)
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=mu))
    sim = cn.Simulation(scene, dt=2e-3, strategy=cn.NSCD(solver=cn.NLGS(tol=1e-10, max_iter=20000)))
    for _ in range(steps):
        sim.step()
    return sim


@pytest.mark.parametrize("mu", [0.0, 0.3])
@pytest.mark.parametrize("shape", ["disk", "box"])
def test_flush_joints_have_no_effect(shape, mu):
    plane = slide(cn.wall((0, 0), (0, 1), ROCK), shape, mu)
    shuffled = np.random.default_rng(1).permutation(np.column_stack((np.arange(24), np.arange(1, 25))))
    shuffled[::2] = shuffled[::2, ::-1]
    for faces in (None, shuffled):
        chain = slide(cn.surface(FLAT, faces, ROCK), shape, mu)
        assert np.abs(chain.bodies.velocity[0] - plane.bodies.velocity[0]).max() < 1e-6 * 2
        assert np.abs(chain.bodies.position[0] - plane.bodies.position[0]).max() < 1e-6


def test_a_chain_is_the_body_that_its_segments_are_apart():
    apart = [cn.segment(a, b, ROCK) for a, b in zip(FLAT[:-1], FLAT[1:])]
    ends = []
    for boundary in ([cn.surface(FLAT, None, ROCK)], apart):
        scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
        scene.add(cn.disks([[0.03, 0.1]], 0.1, ROCK, velocity=[[2.0, 0.0, 0.0]]), *boundary)
        scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.2))
        sim = cn.Simulation(scene, dt=2e-3)
        for _ in range(100):
            sim.step()
        ends.append(sim.bodies.velocity[0])
    assert np.array_equal(*ends)


@pytest.mark.parametrize("scale, at", [(1.0, 0.0), (2.0**-30, 0.0), (2.0**20, 0.0), (1.0, 2.0**20)])
def test_a_disk_goes_down_a_slope_and_keeps_its_energy(scale, at):
    # a smooth valley of 400 pieces: without friction the speed is that of the height that was lost
    x = np.linspace(-1.5, 1.5, 401)
    ground = np.column_stack((x + at, 0.25 * x**2)) * [scale, scale] if at == 0 else np.column_stack((x + at, 0.25 * x**2))
    scene = cn.Scene(dim=2, gravity=(0.0, -10.0 * scale), origin=(at, 0.0))
    scene.add(cn.surface(ground, None, ROCK), cn.disks([[(-1.0 * scale) + at, 0.37 * scale]], 0.1 * scale, ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.0))
    sim = cn.Simulation(scene, dt=1e-3)
    low = []
    for _ in range(700):
        sim.step()
        low.append(sim.bodies.position[1, 1])
    height, speed = sim.bodies.position[1, 1] / scale, np.hypot(*sim.bodies.velocity[1, :2]) / scale
    assert min(low) / scale < 0.105  # it went through the bottom
    assert abs(speed**2 / 2 + 10.0 * height - 3.7) < 0.03 * 2.5


def test_a_closed_outline_and_a_moving_one():
    angle = np.linspace(0, 2 * np.pi, 61)[:-1]
    ring = np.column_stack((np.cos(angle), np.sin(angle)))
    pairs = np.column_stack((np.arange(60), np.roll(np.arange(60), -1)))
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.disks([[0.0, -0.88]], 0.1, ROCK), cn.surface(ring, pairs, ROCK, velocity=(0.0, 0.0, 2.0)))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.8))
    sim = cn.Simulation(scene, dt=1e-3)
    for _ in range(300):
        sim.step()
    assert np.hypot(*sim.bodies.position[0]) < 0.905 and sim.bodies.velocity[0, 2] > 10  # it is turned as by gears: 20 rad/s


def test_what_is_no_chain_is_refused():
    with pytest.raises(ValueError, match=r"faces\[1\] is \[1, 25\]: there are 25 vertices"):
        cn.surface(FLAT, [[0, 1], [1, 25]], ROCK)
    with pytest.raises(ValueError, match=r"faces has shape \(1, 3\): give pairs of vertices"):
        cn.surface(FLAT, [[0, 1, 2]], ROCK)
    with pytest.raises(ValueError, match=r"faces\[0\] is \[2, 2\], which are the same point"):
        cn.surface(FLAT, [[2, 2]], ROCK)
    with pytest.raises(ValueError, match=r"faces\[1\] is \[1, 0\], a pair that is there already"):
        cn.surface(FLAT, [[0, 1], [1, 0]], ROCK)
    with pytest.raises(ValueError, match="radius is -1"):
        cn.surface(FLAT, None, ROCK, radius=-1.0)
    with pytest.raises(ValueError, match="finite"):
        cn.surface([[0, 0], [np.nan, 1]], None, ROCK)
