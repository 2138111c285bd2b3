"""Deformable bodies in the step: points of action of impulses, sizes from small to large, named errors."""

import cairn as cn
import numpy as np
import pytest
from cairn.model.elastic import ElasticBody

ROCK = cn.Material("rock", density=2000.0)


def plate(cells=(4, 2), size=(1.0, 0.5), corner=(0.0, 0.0), young=1e7, poisson=0.2, density=2000.0, **more):
    """Quadrilaterals on a lattice; groups top and bottom."""
    x, y = (np.linspace(c, c + s, n + 1) for c, s, n in zip(corner, size, cells))
    points = np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2)
    number = np.arange(len(points)).reshape(cells[0] + 1, cells[1] + 1)
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], -1).reshape(-1, 4)
    groups = {"top": number[:, -1], "bottom": number[:, 0]}
    return ElasticBody(points, {"quad": quads}, young=young, poisson=poisson, density=density, groups=groups, **more)


@pytest.mark.parametrize("contact_point, share", [("surface", 1.0), ("middle", 0.5)])
def test_where_impulses_of_a_disk_on_an_edge_act(contact_point, share):
    """A spinning disk that a step brings down from a gap and friction stops: the point that stands still is on the edge, or in
    the middle of the gap."""
    radius, gap, h = 0.01, 2e-4, 1e-4
    scene = cn.Scene(dim=2)
    body = plate()
    scene.add(cn.deformable(body, ROCK, edges="top", fixed={"top": "xy", "bottom": "xy"}))
    scene.add(cn.disks([[0.4, 0.5 + radius + gap]], radius, ROCK, velocity=(0.0, -10.0, 100.0)))
    scene.interact(ROCK, ROCK, cn.GapCoulomb(mu=5.0))
    sim = cn.Simulation(scene, h, cn.NSCD(1.0, cn.NLGS(tol=1e-12), 1e-3, contact_point=contact_point))
    sim.step()
    x, y, spin = sim.bodies.velocity[np.argmin(np.abs(sim.bodies.position[:, 1] - 0.51))]
    assert y == pytest.approx(-gap / h, rel=1e-12) and spin > 10.0
    assert x + spin * (radius + share * gap) == pytest.approx(0.0, abs=1e-12)


def resting(size=1.0, origin=(0.0, 0.0), h=2e-3, steps=400, density=2000.0, grain=2000.0, poisson=0.2, theta=1.0, cells=(4, 2)):
    """A disk that comes to rest on a plate that is held below. All lengths times `size`, times by its root."""
    body = plate(cells, (size, 0.5 * size), origin, young=1e7 * size, poisson=poisson, density=density)
    rock = cn.Material("rock", density=grain)
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81), origin=origin)
    scene.add(cn.deformable(body, rock, edges="top", fixed={"bottom": "xy"}))
    scene.add(cn.disks([[origin[0] + 0.45 * size, origin[1] + 0.6 * size]], 0.1 * size, rock))
    scene.interact(rock, rock, cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, h * np.sqrt(size), cn.NSCD(theta, cn.Default(tol=1e-8)), overlap="ignore")
    for _ in range(steps):
        info = sim.step()
        assert info["status"] != "converged" or info["error"] <= 1e-8
    return sim, info


def push_on_plate(sim):
    """Push of the disk on the plate over its weight."""
    weight = 9.81 * sim.bodies.mass[np.argmax(sim.radii())]
    return np.sum(sim.contacts.impulse[:, 1]) / sim.dt / weight


def test_sizes_scale():
    """A plate of a nanometre and of a thousand kilometres, by powers of two, to the same bits."""
    base, _ = resting(steps=100)
    for power in (-30, 20):
        sim, info = resting(2.0**power, steps=100)
        assert info["status"] == "converged"
        assert np.array_equal(sim.meshes[0].displacement, 2.0**power * base.meshes[0].displacement)


def test_far_from_the_origin():
    sim, info = resting(origin=(1e9, -1e9))
    assert info["status"] == "converged" and push_on_plate(sim) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("change", [{"grain": 2e15}, {"grain": 2e-9}, {"density": 2e15}, {"density": 2e-9}, {"h": 2.0}])
def test_densities_and_steps_apart(change):
    """Ratios of 1e12 either way, and a step of a thousand times: each right, or said not to be."""
    sim, info = resting(steps=400, **change)
    assert np.all(np.isfinite(sim.meshes[0].displacement))
    assert info["status"] in ("converged", "iteration_limit")
    if info["status"] == "converged" and "grain" in change and change["grain"] < 1:
        assert push_on_plate(sim) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("poisson", [0.0, 0.4999])
def test_ends_of_poisson(poisson):
    sim, info = resting(poisson=poisson)
    assert info["status"] == "converged" and push_on_plate(sim) == pytest.approx(1.0, abs=1e-3)


TRIANGLE = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]


def standing(places, cells=((0, 1, 2),), kind="triangle", steps=40, size=1.0, **more):
    """A mesh on a plane, all its nodes points of contact unless said. All lengths times `size`, times by its root."""
    places = size * np.array(places, float)
    dim = places.shape[1]
    body = ElasticBody(places, {kind: np.array(cells, int)}, young=1e7 * size, poisson=0.2, density=2000.0)
    scene = cn.Scene(dim=dim, gravity=-9.81 * np.eye(dim)[-1])
    scene.add(cn.deformable(body, ROCK, **{"contact": np.arange(len(places)), **more}))
    scene.add(cn.wall((0,) * dim, np.eye(dim)[-1], ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 1e-3 * np.sqrt(size), cn.NSCD(1.0, cn.Default(tol=1e-8)), overlap="ignore")
    for _ in range(steps):
        info = sim.step()
    return sim, info


TETRAHEDRON = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]


@pytest.mark.parametrize(
    "places, kind, size, mass",
    [
        (TRIANGLE, "triangle", 1.0, 1000.0),
        (TRIANGLE, "triangle", 2.0**20, 1000.0 * 2.0**40),
        (TRIANGLE, "triangle", 2.0**-30, 1000.0 * 2.0**-60),
        ([[0.0, 0.0], [1.0, 0.0], [0.5, 1e-4]], "triangle", 1.0, 0.1),
        (TETRAHEDRON, "tetra", 1.0, 2000.0 / 6),
        (TETRAHEDRON, "tetra", 2.0**20, 2000.0 / 6 * 2.0**60),
    ],
)
def test_meshes_of_one_element_stand(places, kind, size, mass):
    sim, info = standing(places, [list(range(len(places)))], kind, 300, size)
    assert info["status"] == "converged"
    assert np.sum(sim.contacts.impulse[:, -1]) / sim.dt == pytest.approx(9.81 * mass, rel=1e-2)


def test_a_node_that_is_there_twice_is_two_nodes():
    """The mesh comes in two parts, which touch each other no more than parts of a mesh do."""
    sim, info = standing([*TRIANGLE, [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], [[0, 1, 2], [3, 4, 5]], steps=10)
    assert info["status"] == "converged" and sim.meshes[0].displacement[5, 1] != sim.meshes[0].displacement[2, 1]


def test_a_mesh_without_a_contactor_falls():
    sim, info = standing(np.array(TRIANGLE) + [0.0, 1.0], contact=[], steps=10)
    assert info["contacts"] == 0
    assert sim.meshes[0].velocity[:, 1] == pytest.approx(np.full(3, -0.0981), rel=1e-9)


@pytest.mark.parametrize(
    "places, cells, more, told",
    [
        ([[0, 0], [1, np.nan], [0, 1]], [[0, 1, 2]], {}, r"points\[1\] is \[1.0, nan\]"),
        ([[0, 0], [1, np.inf], [0, 1]], [[0, 1, 2]], {}, r"points\[1\] is \[1.0, inf\]"),
        ([[0, 0], [1, 0], [0.5, 0]], [[0, 1, 2]], {}, "triangle 0 with nodes .* is flat or inside out"),
        (TRIANGLE, [[0, 1, 3]], {}, "there are 3"),
        (TRIANGLE, np.zeros((0, 3), int), {}, "cells holds no cell"),
        (TRIANGLE, [[0, 1, 2]], {"contact": [7]}, "contact names node 7: the mesh has 3 nodes"),
        (TRIANGLE, [[0, 1, 2]], {"points": ([[0, 4]], [[0.5, 0.5]])}, "points names node 4: the mesh has 3 nodes"),
        (TRIANGLE, [[0, 1, 2]], {"points": ([[0, 1]], [[0.5, np.nan]])}, r"weights \[0.5, nan\] at point 0"),
        (1e-9 * np.array(TRIANGLE), [[0, 1, 2]], {}, "mass of the mesh 'mesh' is lost in rounding at node .*: a step of 0.001 s"),
        ([[0, 0], [1, 0], [0.5, 1e-12]], [[0, 1, 2]], {}, "mass of the mesh 'mesh' is lost in rounding at node"),
    ],
)
def test_what_is_no_mesh_is_named(places, cells, more, told):
    with pytest.raises((ValueError, cn.Error), match=told):
        standing(places, cells, **more)


@pytest.mark.parametrize(
    "field, value", [("young", np.nan), ("young", -1.0), ("density", np.nan), ("density", -1.0), ("poisson", 0.5)]
)
def test_what_is_no_material_is_named(field, value):
    with pytest.raises(ValueError, match=f"{field} is {value}"):
        plate(**{field: value})


def travelling(periodic, width=0.8):
    """A plate that glides with a disk on it over a floor, out of the cell and in again."""
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81), periodic=periodic)
    moving = plate((4, 2), (width, 0.4), (0.6, 0.001))
    scene.add(cn.deformable(moving, ROCK, edges="top", contact="bottom", velocity=(3.0, 0.0)))
    scene.add(cn.disks([[0.9, 0.501]], 0.1, ROCK, velocity=(3.0, 0.0, 0.0)), cn.wall((0, 0), (0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, 5e-3, cn.NSCD(0.5, cn.Default(tol=1e-10)))


def test_a_mesh_leaves_a_periodic_cell_whole():
    """The mesh moves as without a cell, but for its length; its disk leaves before it, and they touch across the boundary."""
    free, caught = travelling(None), travelling(cn.Periodic((2.0, 0.0)))
    for _ in range(200):
        for sim in (free, caught):
            sim.step()
    shift = free.nodes.position - caught.nodes.position
    np.testing.assert_allclose(shift, np.tile([2.0, 0.0], (len(shift), 1)), rtol=0, atol=1e-9)
    np.testing.assert_allclose(free.nodes.velocity, caught.nodes.velocity, rtol=0, atol=1e-8)
    np.testing.assert_allclose(free.bodies.velocity, caught.bodies.velocity, rtol=0, atol=1e-8)
    assert len(caught.contacts) > 0


def test_a_mesh_that_crosses_a_moving_boundary_is_not_strained():
    """All of its nodes take the velocity of the image that it becomes."""
    scene = cn.Scene(dim=2, periodic=cn.Periodic((2.0, 2.0), shear_rate=0.5))
    scene.add(cn.deformable(plate((4, 2), (0.8, 0.4), (0.5, 1.0)), ROCK, edges="top", velocity=(0.0, 3.0)))
    sim = cn.Simulation(scene, 5e-3, cn.NSCD(0.5))
    for _ in range(120):
        sim.step()
    assert np.max(sim.nodes.position[:, 1]) - np.min(sim.nodes.position[:, 1]) == pytest.approx(0.4, rel=1e-9)
    np.testing.assert_allclose(sim.nodes.velocity, np.tile([-1.0, 3.0], (15, 1)), rtol=0, atol=1e-9)
    assert sim.energy["stored"] < 1e-12 * sim.energy["kinetic"]
    assert abs(sim.energy["closure"]) < 1e-12 * sim.energy["in_play"]


def test_a_mesh_wider_than_the_cell_is_refused():
    with pytest.raises(ValueError, match=r"lengths\[0\] of the periodic cell is 0.7 m and the mesh 'mesh' is 0.8 m wide"):
        travelling(cn.Periodic((0.7, 0.0)))


@pytest.mark.parametrize("velocity", [(0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.0, 3.0)])
def test_a_disk_at_a_node_that_two_edges_share_has_one_bond(velocity):
    """A second one at the same point would make W singular, and both run away against each other."""
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.deformable(plate(), ROCK, edges="top", fixed={"bottom": "xy"}))
    scene.add(cn.disks([[0.5, 0.6]], 0.1, ROCK, velocity=velocity))
    scene.interact(ROCK, ROCK, cn.Bonded(mu=0.3))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(1.0, cn.Default(tol=1e-8)), overlap="ignore")
    weight = 9.81 * sim.bodies.mass[0]
    for _ in range(200):
        assert sim.step()["status"] == "converged"
    assert np.sum(sim.contacts.beta > 0) == 1
    assert np.max(np.abs(sim.contacts.impulse)) < 2 * weight * sim.dt
