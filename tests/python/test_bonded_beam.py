"""A beam of bonded disks, clamped and loaded at its end: bends as Euler and Bernoulli have it, breaks at its strength."""

import cairn as cn
import numpy as np
import pytest

STONE = cn.Material("stone", density=2500.0)
R, YOUNG, TENSION = 0.01, 1e9, 1e6


def beam(rows, columns, tip, dt=0.05, tension=np.inf):
    """Disks on a square lattice, a little smaller than their places, whose bonds are as wide as these: a full section. The first
    column is held, the last bears a force down [N], a number or a function of time."""
    x, y = np.meshgrid(2 * R * np.arange(columns), 2 * R * (np.arange(rows) - (rows - 1) / 2), indexing="ij")
    places, scene = np.stack([x, y], -1), cn.Scene(dim=2)
    share = 1 - 1e-3
    down = (lambda t: (0.0, -tip(t) / rows, 0.0)) if callable(tip) else (0.0, -tip / rows, 0.0)
    scene.add(cn.disks(places[0], share * R, STONE, driven=("vx", "vy", "w")))
    scene.add(cn.disks(places[1:-1].reshape(-1, 2), share * R, STONE))
    scene.add(cn.disks(places[-1], share * R, STONE, force=down))
    scene.interact(STONE, STONE, cn.ParallelBond(normal_stiffness=YOUNG / (2 * R), tangential_stiffness=YOUNG / (2 * R), mu=0.3,
                                                 tension=tension, radius=1 / share, within=3e-3 * R))  # fmt: skip
    sim = cn.Simulation(scene, dt, cn.NSCD(theta=1.0, solver=cn.Auto(tol=1e-10, max_iter=5000)))
    return sim, places


def section(rows):
    """Second moment of a joint's bonds about its neutral axis, and the distance of the farthest fibre from it. Bonds do not
    shorten: of several rows the pressed one is the axis."""
    y = 2 * R * np.arange(rows)
    return np.sum(2 * R * y**2 + (2 * R) ** 3 / 12), y[-1] + R


@pytest.mark.parametrize("rows", [1, 4])
def test_it_bends_as_euler_and_bernoulli_have_it(rows):
    """P L^3/(3 E I) at rest, E = k_n 2 R; each bond is a hinge in the middle of two disks."""
    columns = 25 if rows == 1 else 61
    length = 2 * R * (columns - 1)
    tip = 3 * YOUNG * section(rows)[0] / length**3 * 1e-3 * length  # bends by a thousandth of its length
    sim, places = beam(rows, columns, tip)
    for _ in range(25):
        sim.step()
        assert sim.info["status"] == "converged"
    sag = -sim.bodies.position[-rows:, 1] + places[-1, :, 1]
    assert np.allclose(sag, 1e-3 * length, rtol=0.02)
    assert sim.info["energy"]["stored"] == pytest.approx(0.5 * tip * 1e-3 * length, rel=0.03)
    middle = sim.bodies.position[(columns // 2) * rows, 1] - places[columns // 2, 0, 1]
    half = places[columns // 2, 0, 0] / length
    assert -middle == pytest.approx(1e-3 * length * (1.5 * half**2 - 0.5 * half**3), rel=0.02)


@pytest.mark.parametrize(("rows", "within"), [(1, 0.011), (4, 0.04)])  # of several rows the outer one bears more where it is held
def test_it_breaks_at_its_strength(rows, within):
    """At the first joint, where M y/I is largest, under a load that grows by a hundredth of that in a step."""
    columns, dt = 13 if rows == 1 else 25, 0.05
    moment, far = section(rows)
    load = TENSION * moment / far / (2 * R * (columns - 1) - R)
    sim, _ = beam(rows, columns, lambda t: load * t / (100 * dt), dt, TENSION)
    sim.step()
    held = sim.contacts.beta > 0
    bonds, places = {tuple(pair) for pair in sim.contacts.bodies[held].tolist()}, sim.contacts.point[held, 0]
    assert len(bonds) == len(places) == (columns - 1) * rows + (columns - 1) * (rows - 1)
    for _ in range(110):
        sim.step()
        left = {tuple(pair) for pair in sim.contacts.bodies[sim.contacts.beta > 0].tolist()}
        if left != bonds:
            break
    assert sim.time / (100 * dt) == pytest.approx(1, abs=within)
    assert all(a < rows <= b < 2 * rows for a, b in bonds - left)  # between the first two columns
