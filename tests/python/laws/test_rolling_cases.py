"""Resistance to rolling where a body turns back and where many come to rest: models A and C of Ai, Chen, Rotter & Ooi (2011)."""

import cairn as cn
import numpy as np
import pytest

STONE = cn.Material("stone", density=2500.0)
R, G, STIFFNESS = 0.01, 9.81, 1e6
WEIGHT = 2500 * np.pi * R**2 * G
MODELS = {
    "A": dict(rolling="constant_torque"),
    "C": dict(rolling="spring_dashpot", rolling_damping=0.3),
}


def law(model, mu_r):
    more = {**MODELS[model], "rolling_mu": mu_r} if model else {}
    return cn.granular("hooke", stiffness=STIFFNESS, restitution=0.5, mu=0.8, **more)


def up_a_slope(model, mu_r, slope, speed, steps, dt=4e-5):
    """Way and velocity of a disk that rolls up a slope, every ten steps."""
    scene = cn.Scene(2, gravity=(-np.sin(slope) * G, -np.cos(slope) * G))
    rests = R - WEIGHT * np.cos(slope) / STIFFNESS
    scene.add(cn.disks([[0, rests]], R, STONE, velocity=[[speed, 0, -speed / R]]), cn.wall((0, 0), (0, 1), STONE))
    scene.interact("*", "*", law(model, mu_r))
    sim = cn.Simulation(scene, dt, cn.SmoothDEM())
    rows = []
    for _ in range(steps // 10):
        sim.run(steps=10, progress=False)
        rows.append((sim.bodies.position[0, 0], sim.bodies.velocity[0, 0]))
    return np.array(rows).T


@pytest.mark.parametrize("model", ["A", "C"])
def test_a_disk_rolls_up_a_slope_and_stays(model):
    """It loses (sin + mu_r cos) g/1.5 on its way, and stays where tan(slope) < mu_r; under A it trembles there."""
    slope, mu_r, speed = 0.15, 0.2, 0.5
    slows = G * (np.sin(slope) + mu_r * np.cos(slope)) / 1.5
    x, v = up_a_slope(model, mu_r, slope, speed, 8000)
    assert (v[50] - v[200]) / (1500 * 4e-5) == pytest.approx(slows, rel=1e-3)
    assert x.max() == pytest.approx(speed**2 / 2 / slows, rel=1e-3)
    assert x.max() - x[-1] < 0.02 * R and np.abs(v[-100:]).max() < 1e-3 * speed


@pytest.mark.parametrize("model", ["A", "C"])
def test_a_disk_rolls_back_down_a_steep_slope(model):
    """tan(slope) > mu_r: it turns, and comes down at (sin - mu_r cos) g/1.5."""
    slope, mu_r, speed = 0.2, 0.1, 0.5
    up, down = (G * (np.sin(slope) + way * mu_r * np.cos(slope)) / 1.5 for way in (1, -1))
    x, v = up_a_slope(model, mu_r, slope, speed, 10000)
    assert x.max() == pytest.approx(speed**2 / 2 / up, rel=1e-3)
    assert (v[800] - v[990]) / (1900 * 4e-5) == pytest.approx(down, rel=0.02)


def heap(model, mu_r=0.3, steps=6000):
    """A column of 70 disks collapses on a plane: its height, the reach of nine tenths of it, energy at the end over m g R."""
    rng = np.random.default_rng(3)
    place = np.stack(np.meshgrid(np.arange(5), np.arange(14), indexing="ij"), -1).reshape(-1, 2)
    radii = R * rng.uniform(0.8, 1, len(place))
    x = (place - [2, 0]) * 2.02 * R + [0, 2.2 * R] + 0.02 * R * rng.uniform(-1, 1, place.shape)
    scene = cn.Scene(2, gravity=(0, -G))
    scene.add(cn.disks(x, radii, STONE), cn.wall((0, 0), (0, 1), STONE))
    scene.interact("*", "*", law(model, mu_r))
    sim = cn.Simulation(scene, 1.6e-4, cn.SmoothDEM(), overlap="ignore")
    sim.run(steps=steps, progress=False)
    kinetic = []
    for _ in range(20):
        sim.run(steps=20, progress=False)
        kinetic.append(sim.energy["kinetic"])
    x = sim.bodies.position[: len(x)]
    return x[:, 1].max() / R, np.percentile(np.abs(x[:, 0]), 90) / R, np.mean(kinetic) / (WEIGHT * R)


def test_a_column_of_disks_leaves_a_heap_where_rolling_is_resisted():
    """Without resistance the disks run away in a flat layer; under A and C a heap stays, at rest under C, trembling under A."""
    (flat, far, _), (a_high, a_far, a_left), (c_high, c_far, c_left) = (
        heap(model, steps=steps) for model, steps in ((None, 6000), ("A", 10000), ("C", 10000))
    )
    assert flat < 5 and far > 30
    for high, reach in ((a_high, a_far), (c_high, c_far)):
        assert 7 < high < 14 and reach < 25
        assert 0.2 < high / reach  # a slope, mean over nine tenths of the width
    assert c_left < 1e-6 and a_left > 3 * c_left
