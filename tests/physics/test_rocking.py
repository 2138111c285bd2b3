"""A block that rocks from edge to edge under its weight (Housner 1963): what each impact leaves, and when it comes."""

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
        blocks = masonry.wall(2 * b, 1, (2 * b, 0.3, 2 * h), bond="stack", mortar=0.0)
    scene = cn.Scene(dim=dim, gravity=(0.0,) * (dim - 1) + (-G,))
    ids = blocks.add_to(scene, cn.Material("stone", density=2500.0))
    scene.interact("*", "*", cn.Coulomb(mu=mu))
    solver = cn.NLGS(tol=1e-10, max_iter=10_000)
    sim = cn.Simulation(scene, dt, cn.NSCD(theta=0.5, solver=solver, threads=1))
    row = int(np.flatnonzero(sim.bodies.id == ids[0])[0])
    angle, radius = start * slenderness, np.hypot(b, h)
    position = sim.bodies.position
    edge = position[row] * 1.0
    edge[0] += b
    edge[-1] -= h
    # about the right edge: the centre goes from a to a - angle from the vertical
    position[row, 0] = edge[0] - radius * np.sin(slenderness - angle)
    position[row, -1] = edge[-1] + radius * np.cos(slenderness - angle)
    rotation = sim.bodies.rotation
    rotation[row] = -angle if dim == 2 else (np.cos(angle / 2), 0.0, np.sin(angle / 2), 0.0)
    sim.bodies.set(position=position, rotation=rotation)
    return sim, row


def history(sim, row, steps):
    """Times, angular velocities after each step, positive to the right."""
    dim = sim.scene.dim
    sign, axis = (-1.0, 2) if dim == 2 else (1.0, 4)
    w = np.empty(steps)
    for k in range(steps):
        sim.step()
        w[k] = sign * sim.bodies.velocity[row, axis]
    return sim.info["dt"] * np.arange(1, steps + 1), w


def impacts(t, w):
    """Steps after which speed has dropped: |w| grows towards an impact and falls at once there."""
    speed = np.abs(w)
    drop = speed[:-1] - speed[1:]
    typical = np.median(np.abs(np.diff(w)))
    return np.flatnonzero(drop > 0.4 * speed[:-1].max() * 0 + 4 * typical) + 1


def quarter(slenderness, start, radius):
    """Time [s] from rest at `start` of a to upright, the equation not linearised: 4/3 R^2 th'' = -g R sin(a - th)."""
    from scipy.integrate import solve_ivp

    a, p2 = slenderness, 3 * G / (4 * radius)
    down = lambda t, y: y[0]  # noqa: E731
    down.terminal = True
    s = solve_ivp(lambda t, y: (y[1], -p2 * np.sin(a - y[0])), (0, 100), (start * a, 0.0), events=down, rtol=1e-10, atol=1e-13)
    return s.t_events[0][0]
