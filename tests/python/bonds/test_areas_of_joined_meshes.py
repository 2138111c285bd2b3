"""Zones between meshes and flat sides of rigid bodies that end within those of the mesh have the area that both share."""

import cairn as cn
import numpy as np
import pytest

SIDE = 0.1
STRENGTH = 2e6
WORK = 10.0
SOFT, HARD = cn.Material("soft", density=1000.0), cn.Material("hard", density=1000.0)
CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]


def zone():
    own = dict(normal_strength=STRENGTH, tangential_strength=STRENGTH, normal_work=WORK, tangential_work=WORK)
    return cn.MAL(normal_stiffness=1e12, tangential_stiffness=1e12, **own)


def block(dim, cells, young=1e14, **options):
    """A stiff square or cube from 0 to SIDE, held below, whose group "high" is joined."""
    grid = np.stack(np.meshgrid(*[np.linspace(0, SIDE, cells + 1)] * dim, indexing="ij"), -1)
    number = np.arange(grid[..., 0].size).reshape(grid.shape[:dim])
    cell = [number[tuple(slice(c, cells + c) for c in corner[:dim])].ravel() for corner in CORNERS[: 2**dim]]
    groups = {"high": number[..., -1].ravel(), "low": number[..., 0].ravel(), "all": number.ravel()}
    cells = {"quad" if dim == 2 else "hexahedron": np.stack(cell, -1)}
    body = cn.ElasticBody(grid.reshape(-1, dim), cells, young=young, poisson=0.0, density=1000.0, groups=groups)
    return cn.deformable(body, SOFT, **{"contact": "high", "fixed": {"low": "xyz"[:dim]}, **options})


def rigid(dim, low, high, turn=0.0):
    """On the block, from low to high of its side in each direction, lifted at 0.1 m/s."""
    low, high, middle = low * SIDE, high * SIDE, (low + high) / 2 * SIDE
    if dim == 2:
        square = np.array([[low, SIDE], [high, SIDE], [high, 2 * SIDE], [low, 2 * SIDE]])
        return cn.polygons([square], HARD, driven=("vx", "vy", "w"), drive=[0, 0.1, 0])
    size = [high - low, high - low, SIDE]
    rotation = [[np.cos(turn / 2), 0, 0, np.sin(turn / 2)]]
    up = dict(driven=("vx", "vy", "vz", "wx", "wy", "wz"), drive=[0, 0, 0.1, 0, 0, 0])
    return cn.boxes([[middle, middle, 1.5 * SIDE]], [size], HARD, rotation=rotation, **up)


def pulled_off(dim, mesh, *bodies, steps=60):
    """The areas that the strength and the work of the joint tell [m2], which are one."""
    scene = cn.Scene(dim)
    scene.add(mesh)
    for body in bodies:
        scene.add(body)
    scene.interact(SOFT, HARD, zone())
    scene.interact(HARD, HARD, None)
    sim = cn.Simulation(scene, 2e-6, cn.NSCD(theta=1, solver=cn.NLGS(tol=1e-9, max_iter=5000)), overlap="ignore")
    peak = 0
    for _ in range(steps):
        sim.step()
        peak = max(peak, np.linalg.norm(sim.contacts.impulse, axis=1).sum() / sim.dt)
    return peak / STRENGTH, sim.info["energy"]["released"] / WORK


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize(
    "cells, low, high",
    [(3, 0.2, 0.8), (3, 0.05, 0.95), (3, 0.15, 1.0), (3, -0.1, 0.62), (3, 0.4, 0.6)]
    + [(2, 0.2, 0.8), (5, 0.41, 0.57), (3, 0, 1), (3, -0.1, 1.1)],
)
def test_a_body_smaller_than_the_mesh_is_joined_by_what_lies_on_it(dim, cells, low, high):
    sides = {"edges" if dim == 2 else "faces": "high"}
    peak, work = pulled_off(dim, block(dim, cells, **sides), rigid(dim, low, high))
    area = (SIDE * (min(high, 1) - max(low, 0))) ** (dim - 1)
    assert work == pytest.approx(area, rel=1e-6)
    assert peak == pytest.approx(area, rel=2e-3)


@pytest.mark.parametrize("dim", [2, 3])
def test_sides_round_the_corner_are_no_part_of_the_joint(dim):
    sides = {"edges" if dim == 2 else "faces": "all"}
    peak, _ = pulled_off(dim, block(dim, 3, **sides), rigid(dim, 0, 1), steps=20)
    assert peak == pytest.approx(SIDE ** (dim - 1), rel=2e-3)


@pytest.mark.parametrize("low, high", [(0.05, 0.95), (0.2, 0.8), (0.45, 0.55)])
def test_points_between_nodes_share_their_edges(low, high):
    ends = np.array([[3, 7], [7, 11], [11, 15]])  # of the upper edges of 3 x 3 cells
    points = np.vstack([ends, ends]), np.repeat([[0.8, 0.2], [0.2, 0.8]], 3, axis=0)
    peak, work = pulled_off(2, block(2, 3, contact=(), points=points, edges="high"), rigid(2, low, high))
    assert work == pytest.approx((high - low) * SIDE, rel=1e-6)
    assert peak == pytest.approx((high - low) * SIDE, rel=2e-3)


def test_a_turned_box_across_many_cells_is_joined_by_its_base():
    peak, work = pulled_off(3, block(3, 5, faces="high"), rigid(3, 0.25, 0.75, turn=0.4))
    assert work == pytest.approx((0.5 * SIDE) ** 2, rel=1e-6)
    assert peak == pytest.approx((0.5 * SIDE) ** 2, rel=2e-3)


def test_a_bar_between_the_nodes_is_joined_along_all_of_it():
    bar = cn.boxes([[SIDE / 2, SIDE / 2, 1.5 * SIDE]], [[2 * SIDE, 0.1 * SIDE, SIDE]], HARD,
                   driven=("vx", "vy", "vz", "wx", "wy", "wz"), drive=[0, 0, 0.1, 0, 0, 0])  # fmt: skip
    short = cn.boxes([[SIDE / 2, SIDE / 2, 1.5 * SIDE]], [[0.9 * SIDE, 0.1 * SIDE, SIDE]], HARD,
                     driven=("vx", "vy", "vz", "wx", "wy", "wz"), drive=[0, 0, 0.1, 0, 0, 0])  # fmt: skip
    assert pulled_off(3, block(3, 5, faces="high"), short)[1] == pytest.approx(0.09 * SIDE**2, rel=1e-6)
    assert pulled_off(3, block(3, 4, faces="high"), bar)[1] == pytest.approx(0.1 * SIDE**2, rel=1e-6)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("seam", [1 / 3, 0.4, 0.5])
def test_two_bodies_side_by_side_share_the_nodes_at_their_seam(dim, seam):
    """A node below the seam is joined to both, to each by its share of the node's tributary area."""
    sides = {"edges" if dim == 2 else "faces": "high"}
    if dim == 2:
        bodies = rigid(2, -0.2, seam), rigid(2, seam, 1.2)
    else:
        up = dict(driven=("vx", "vy", "vz", "wx", "wy", "wz"), drive=[0, 0, 0.1, 0, 0, 0])
        bodies = [
            cn.boxes([[(one + two) / 2 * SIDE, SIDE / 2, 1.5 * SIDE]], [[(two - one) * SIDE, 1.4 * SIDE, SIDE]], HARD, **up)
            for one, two in ((-0.2, seam), (seam, 1.2))
        ]
    peak, work = pulled_off(dim, block(dim, 3, **sides), *bodies)
    assert work == pytest.approx(SIDE ** (dim - 1), rel=1e-6)
    assert peak == pytest.approx(SIDE ** (dim - 1), rel=2e-3)


@pytest.mark.parametrize("strength, low, high", [(3e6, 30.0 - 1e-6, 30.0 + 1e-6), (2e6, 29.0, 29.5)])
def test_what_opens_and_shears_spends_the_work_of_a_law_of_one_strength(strength, low, high):
    """A soft cube sheared off a box of its size opens at one rim first, where a law of two strengths spends another work."""
    box = cn.boxes([[SIDE / 2, SIDE / 2, 1.5 * SIDE]], [[SIDE] * 3], HARD, driven=("vx", "vy", "vz", "wx", "wy", "wz"),
                   drive=[0.1, 0, 0, 0, 0, 0])  # fmt: skip
    scene = cn.Scene(3)
    scene.add(block(3, 3, young=1e11, faces="high"))
    scene.add(box)
    own = dict(normal_strength=strength, tangential_strength=3e6, normal_work=30.0, tangential_work=30.0)
    scene.interact(SOFT, HARD, cn.MAL(normal_stiffness=1e12, tangential_stiffness=1e12, **own))
    sim = cn.Simulation(scene, 2e-6, cn.NSCD(theta=1, solver=cn.NLGS(tol=1e-9, max_iter=5000)), overlap="ignore")
    for _ in range(220):
        sim.step()
    assert not np.any(sim.contacts.beta > 0)
    assert low < sim.info["energy"]["released"] / SIDE**2 < high
