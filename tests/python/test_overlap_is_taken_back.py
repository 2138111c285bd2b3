"""Overlap does not add up: contacts take back what is beyond a share of a body's size, and leave what is within."""

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
    return cn.Simulation(scene, dt, strategy, overlap="ignore")


def squeezed(dim=2, strategy=None, count=80, seed=2):
    """Grains under a lid that is pressed down, between walls one of which moves in."""
    rng, wide = np.random.default_rng(seed), 8 if dim == 2 else 4
    grid = np.array([(i % wide, i // wide % wide if dim == 3 else 0, i // wide ** (dim - 1)) for i in range(count)], float)
    centers = np.delete(grid, 1, 1) if dim == 2 else grid
    centers = 1.05 * centers + 0.6 + rng.uniform(-0.02, 0.02, centers.shape)
    scene, top, axes = cn.Scene(dim, gravity=(0,) * dim), centers[:, -1].max() + 0.6, np.eye(dim)
    scene.add((cn.disks if dim == 2 else cn.spheres)(centers, rng.uniform(0.35, 0.5, count), ROCK))
    for axis in range(dim):
        scene.add(cn.wall([0] * dim, axes[axis], ROCK))
    for axis in range(dim - 1):
        inwards = list(-0.6 * axes[axis]) + [0] * (1 if dim == 2 else 3)
        scene.add(cn.wall((1.05 * wide + 0.2) * axes[axis], -axes[axis], ROCK, velocity=inwards if axis == 0 else None))
    push = list(-2e6 * axes[-1]) + [0] * (1 if dim == 2 else 3)
    scene.add(cn.wall(top * axes[-1], -axes[-1], ROCK, mass=2e4, free="vy" if dim == 2 else "vz", force=push))
    scene.interact("*", "*", cn.Coulomb(mu=0.4))
    return cn.Simulation(scene, 2e-3, strategy, overlap="ignore")


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
    """Of any pair of rigid bodies that its law lets alone."""
    square = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    shapes = [(2, lambda x, r, m: cn.polygons(x[0] + square, m)), (3, lambda x, r, m: cn.boxes(x, [1.0] * 3, m))]
    for dim, make in shapes:
        sim = pair(0.2, dim=dim, make=make)
        first = sim.step()["drift"]
        for _ in range(40):
            last = sim.step()["drift"]
        assert first > 0.1 and last == pytest.approx(first - 40 * 0.005 / 8, abs=1e-3)


def test_who_names_a_tolerance_keeps_overlap():
    """And who asks for a limit has it."""
    named = [cn.NSCD(solver=cn.NLGS(tol=1e-4)), cn.NSCD(solver=cn.Default(tol=1e-3)), cn.NSCD(overlap=np.inf)]
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
def test_a_sheared_pack_keeps_its_volume(dim):
    """At an error of 0.1 in each step overlap grows without the limit, and not with it; the balance of energy closes."""
    deep = []
    for overlap in (np.inf, 5e-3):
        sim = squeezed(dim, cn.NSCD(solver=cn.NLGS(tol=0.1), overlap=overlap))
        for _ in range(400):
            info = sim.step()
        deep.append(info["penetration"])
        assert abs(sim.energy["closure"]) < 1e-11 * sim.energy["in_play"]
        assert (sim.energy["work_projection"] > 0) == np.isfinite(overlap)
    assert deep[0] > 2 * deep[1]


def test_overlap_is_checked():
    """A share above 0."""
    for wrong in (0.0, -1.0, "much"):
        with pytest.raises(ValueError, match="overlap is"):
            cn.NSCD(overlap=wrong)
