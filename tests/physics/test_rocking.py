"""A block that rocks from edge to edge under its weight (Housner 1963): speed after each impact, and its time."""

import cairn as cn
import numpy as np
import pytest
from cairn.pre import masonry
from report import judge

G = 9.81


def released(slenderness, start, dt, dim=2, mu=20.0, height=1.0):
    """A block leaning on one edge by `start` of its slenderness a = atan(b / h), the simulation; and its row."""
    b, h = height / 2 * np.tan(slenderness), height / 2
    if dim == 2:
        blocks = masonry.panel(1, 1, brick=(2 * b, 2 * h), bond="stack")
    else:
        blocks = masonry.wall(2 * b, 1, (2 * b, 0.3, 2 * h), bond="stack")
    scene = cn.Scene(dim=dim, gravity=(0.0,) * (dim - 1) + (-G,))
    ids = blocks.add_to(scene, cn.Material("stone", density=2500.0))
    scene.interact("*", "*", cn.Coulomb(mu=mu))
    solver = cn.NLGS(tol=1e-10, max_iter=10_000)
    sim = cn.Simulation(scene, dt, cn.NSCD(theta=0.5, solver=solver, threads=1))
    row = int(np.flatnonzero(sim.bodies.id == ids[0])[0])
    angle, radius = start * slenderness, np.hypot(b, h)
    position = sim.bodies.position.copy()
    edge = position[row] * 1.0
    edge[0] += b
    edge[-1] -= h
    # about the right edge: the centre goes from a to a - angle from the vertical
    position[row, 0] = edge[0] - radius * np.sin(slenderness - angle)
    position[row, -1] = edge[-1] + radius * np.cos(slenderness - angle)
    rotation = sim.bodies.rotation.copy()
    rotation[row] = -angle if dim == 2 else (np.cos(angle / 2), 0.0, np.sin(angle / 2), 0.0)
    sim.bodies.set(position=position, rotation=rotation)
    return sim, row


def swings(sim, row, steps):
    """Impacts: times [s] at which the block stands upright, and its speed [rad/s] as it comes there, a swing each."""
    axis = 2 if sim.scene.dim == 2 else 4
    w = np.empty(steps)
    for k in range(steps):
        sim.step()
        w[k] = sim.bodies.velocity[row, axis]
    turn = np.concatenate(([0], np.flatnonzero(w[1:] * w[:-1] < 0) + 1))
    # in a swing speed falls, then grows to the impact
    last = [i + int(np.argmax(np.abs(w[i:j]) * (np.arange(i, j) > (i + j) / 4))) for i, j in zip(turn[:-1], turn[1:])]
    return sim.info["dt"] * (1 + np.array(last)), np.abs(w[last])


def housner(slenderness, start, radius, impacts):
    """Times and speeds of the impacts, large angles: 4/3 R^2 th'' = -g R sin(a - th); an impact leaves 1 - 3/2 sin^2 a."""
    from scipy.integrate import solve_ivp

    a, p2, angle, t, out = slenderness, 3 * G / (4 * radius), start * slenderness, 0.0, []

    def upright(_, y):
        return y[0]

    upright.terminal = True
    for k in range(impacts):
        fall = solve_ivp(lambda t, y: (y[1], -p2 * np.sin(a - y[0])), (0, 99), (angle, 0), events=upright, rtol=1e-9, atol=1e-13)
        quarter = fall.t_events[0][0]
        t += quarter if k == 0 else 2 * quarter
        speed = np.sqrt(2 * p2 * (np.cos(a - angle) - np.cos(a)))
        out.append((t, speed))
        left = (1 - 1.5 * np.sin(a) ** 2) * speed
        angle = a - np.arccos(np.cos(a) + left**2 / (2 * p2))
    return np.array(out).T


@pytest.mark.parametrize("slenderness,dim,impacts,dt", [(0.1, 2, 10, 1e-4), (0.25, 2, 10, 5e-5), (0.25, 3, 4, 2e-4)])
def test_rocking_block(slenderness, dim, impacts, dt):
    """Speeds and times of ten impacts to 1 %; the error is that of impacts lasting a step, and falls with it."""
    radius = 0.5 / np.cos(slenderness)
    times, speeds = housner(slenderness, 0.5, radius, impacts)
    sim, row = released(slenderness, 0.5, dt, dim)
    t, w = swings(sim, row, int((1.8 * times[-1] - 0.8 * times[-2]) / dt))
    assert len(t) >= impacts, "the block fell asleep"
    judge(f"times of {impacts} impacts", t[:impacts], times, 0.01, scale=times[-1])
    judge(f"speed at impact {impacts}", w[impacts - 1], speeds[-1], 0.01)


def test_first_period_of_a_slender_block():
    """T = (4 / p) acosh(1 / (1 - start)), p^2 = 3 g / 4 R: a quarter of it to the first impact (Housner 1963)."""
    a, start = 0.05, 0.5
    sim, row = released(a, start, 1e-4)
    t, _ = swings(sim, row, 8000)
    quarter = np.arccosh(1 / (1 - start)) / np.sqrt(3 * G / (4 * 0.5 / np.cos(a)))
    judge("quarter of a period", t[0], quarter, 0.002)


def test_stout_block_does_not_rock():
    """Above asin(sqrt(2 / 3)) = 54.7 degrees the impulse at the new edge alone would turn it back: it stays where it lands."""
    sim, row = released(np.deg2rad(60), 0.3, 2e-4)
    speeds = []
    for _ in range(3000):
        sim.step()
        speeds.append(abs(sim.bodies.velocity[row, 2]))
    hit = int(np.argmax(speeds))
    assert 0 < hit < 2500 and speeds[hit] > 0.5
    assert max(speeds[hit + 3 :]) < 1e-3 * speeds[hit]


def test_thin_block_gains_nothing():
    """At a = 0.01 an impact takes a part in ten thousand: with steps much too large no swing is faster than the one before."""
    sim, row = released(0.01, 0.5, 1e-3)
    _, w = swings(sim, row, 20_000)
    assert len(w) > 5 and np.all(np.diff(w) < 1e-9 * w[0])
