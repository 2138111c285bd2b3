"""Overlap does not add up: contacts take it back beyond a share of a body's size, and leave it alone within."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=2000.0)
LAWS = [cn.Coulomb(mu=0.5), cn.Frictionless(), cn.Restitution(mu=0.3), cn.Rolling(mu=0.5, rolling=0.1),
        cn.LimitedSlip(mu=0.5, limit=1.0), cn.Wet(force=1.0, reach=1e-3, mu=0.5)]  # fmt: skip


def pair(depth, law=LAWS[0], dim=3, make=None, strategy=None, unit=1.0, dt=2.0**-10):
    """A body of 1 m on a floor that it overlaps by `depth` of its radius, without gravity."""
    scene = cn.Scene(dim, gravity=(0,) * dim)
    center = [[0.0] * (dim - 1) + [unit * 0.5 * (1 - depth)]]
    make = make or (cn.disks if dim == 2 else cn.spheres)
    scene.add(make(np.array(center), 0.5 * unit, ROCK))
    scene.add(cn.wall((0,) * dim, (0,) * (dim - 1) + (1,), ROCK))
    scene.interact("*", "*", law)
    return cn.Simulation(scene, dt, strategy or cn.NSCD(overlap=0.005), overlap="ignore")


def column(dim, overlap, count=12):
    """Column of balls, solved from zero impulses in each step: residuals at an error of 0.01 have the same sign in all steps."""
    scene = cn.Scene(dim, gravity=(0,) * (dim - 1) + (-9.81,))
    centers = np.zeros((count, dim))
    centers[:, -1] = np.arange(count) + 0.5
    scene.add((cn.disks if dim == 2 else cn.spheres)(centers, 0.5, ROCK))
    scene.add(cn.wall((0,) * dim, (0,) * (dim - 1) + (1,), ROCK))
    scene.interact("*", "*", cn.Coulomb(mu=0.4))
    return cn.Simulation(scene, 5e-3, cn.NSCD(solver=cn.NLGS(tol=1e-2), warm_start=False, overlap=overlap))


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_what_came_in_deep_parts_slowly(law):
    """By an eighth of the limit in a step, down to the limit: 0.03 of a radius, in 0.025 / 0.000625 steps."""
    sim, steps = pair(0.03, law), 0
    while sim.step()["drift"] > 0 and steps < 200:
        steps += 1
        assert abs(sim.bodies.velocity[0, 2]) <= 1.001 * 0.005 / 8 * 0.5 / sim.dt
    assert steps == pytest.approx(40, abs=2)
    assert sim.bodies.position[0, 2] == pytest.approx(0.5 * (1 - 0.005), abs=0.5 * 1e-3)


@pytest.mark.parametrize("dim", [2, 3])
def test_what_is_within_the_limit_stays_to_the_bit(dim):
    """An overlap of 0.004 of a radius, and none at all."""
    for depth in (0.004, 0.0):
        sim = pair(depth, dim=dim)
        start = sim.bodies.position.copy()
        for _ in range(20):
            assert sim.step()["drift"] == 0
        assert np.array_equal(sim.bodies.position, start)


def test_polygons_and_boxes_part_as_well():
    """Flat faces in the plane and in space, at the rate of round bodies."""
    square = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    shapes = [(2, lambda x, r, m: cn.polygons(x[0] + square, m)), (3, lambda x, r, m: cn.boxes(x, [1.0] * 3, m))]
    for dim, make in shapes:
        sim = pair(0.2, dim=dim, make=make)
        first = sim.step()["drift"]
        for _ in range(40):
            last = sim.step()["drift"]
        assert first > 0.1 and last == pytest.approx(first - 40 * 0.005 / 8, abs=1e-3)


def test_overlap_stays_without_a_limit():
    """And who asks for a limit has it."""
    named = [cn.NSCD(solver=cn.NLGS(tol=1e-4)), cn.NSCD(), cn.NSCD(overlap=np.inf)]
    for strategy, moves in [(each, False) for each in named] + [(cn.NSCD(solver=cn.NLGS(tol=1e-8), overlap=0.01), True)]:
        sim = pair(0.2, strategy=strategy)
        for _ in range(3):
            sim.step()
        assert (sim.bodies.position[0, 2] > 0.4) == moves


def test_units_leave_its_bits():
    """Lengths times 2^7."""
    one, other = pair(0.2), pair(0.2, unit=128.0)
    for _ in range(30):
        one.step(), other.step()
    assert np.array_equal(128 * one.bodies.position, other.bodies.position)


@pytest.mark.parametrize("dim", [2, 3])
def test_what_steps_leave_does_not_add_up(dim):
    """Without the limit balls sink into each other, with it they stay above it; the balance of energy closes."""
    deep = []
    for overlap in (np.inf, 1e-3):
        sim, worst = column(dim, overlap), 0.0
        for _ in range(1000):
            worst = max(worst, sim.step()["penetration"])
        deep.append(worst)
        assert abs(sim.energy["closure"]) < 1e-11 * sim.energy["in_play"]
        assert (sim.energy["work_projection"] > 0) == np.isfinite(overlap)
    assert deep[0] > 4 * deep[1] and deep[1] < 4e-3


def test_overlap_is_checked():
    """A share above 0."""
    for wrong in (0.0, -1.0, "much"):
        with pytest.raises(ValueError, match="overlap is"):
            cn.NSCD(overlap=wrong)
