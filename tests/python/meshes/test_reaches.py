"""The compliance of large meshes is not formed: its factor, along reaches, makes the same steps."""

import cairn as cn
import numpy as np
import pytest
from second_order import grid
from test_compliance_in_turns import STONE

BASE = cn.Material("base", density=2000.0)
LITTLE = 1.0  # bytes that a compliance may take: any is too much


def bricks(count, rows=1):
    """Quadrilaterals of bricks that stand beside each other, and upon each other, without a common node."""
    points, cells = grid((3, 2))
    step = np.array([0.11, 0.08])
    places = [(x, y) for y in range(rows) for x in range(count)]
    all_points = np.concatenate([points * (0.1, 0.08) + step * place for place in places])
    return all_points, {"quad": np.concatenate([cells["quad"] + len(points) * k for k in range(len(places))])}


def floor(dim, body_of):
    """Bodies on the plane: bricks, or a sheet."""
    if dim == 2:
        points, cells = bricks(26)
        height = 0.08
    else:
        points, cells = grid((14, 14, 1))
        points, height = points * (1.0, 1.0, 0.1), 0.1
    body = body_of(points, cells)
    low, high = (np.flatnonzero(np.isclose(points[:, -1], z)) for z in (0.0, height))
    sides = body.boundary_edges() if dim == 2 else body.boundary_faces()
    upper = {("edges" if dim == 2 else "faces"): sides[(np.isin(sides, high) | (sides < 0)).all(axis=1)]}
    return cn.deformable(body, STONE, contact=low, name="floor", storage="sparse", **upper), height


def grains(dim, height, fast=0.0):
    """Some that fall on it, between nodes, and slide."""
    rng = np.random.default_rng(4)
    if dim == 2:
        centres = np.c_[0.05 + 0.11 * np.arange(24), np.full(24, height + 0.0399)]
        return cn.disks(centres, 0.04, STONE, velocity=np.c_[np.full(24, fast), rng.uniform(-0.3, 0.0, 24), np.zeros(24)])
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(0.1, 0.9, 6), np.linspace(0.1, 0.9, 6)))
    velocity = np.c_[np.full(36, fast), np.zeros(36), rng.uniform(-0.3, 0.0, 36), np.zeros((36, 3))]
    return cn.spheres(np.c_[x, y, np.full(36, height + 0.0499)], 0.05, STONE, velocity=velocity)


def elastic(points, cells):
    return cn.ElasticBody(points, cells, young=1e7, poisson=0.3, density=2000.0, rayleigh=(0.0, 1e-3))


def solid(points, cells):
    return cn.SolidBody(points, cells, cn.NeoHookean(young=1e7, poisson=0.3), density=2000.0)


def on_a_plane(dim, body_of, solver, fast=0.0, law=None, threads=0):
    up = np.eye(dim)[-1]
    scene = cn.Scene(dim, gravity=-9.81 * up)
    lies, height = floor(dim, body_of)
    scene.add(lies, cn.wall(np.zeros(dim), up, BASE), grains(dim, height, fast))
    scene.interact(STONE, STONE, law or cn.Coulomb(mu=0.3))
    scene.interact(STONE, BASE, cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, 1e-3, cn.NSCD(solver=solver, threads=threads), overlap="ignore")


def formed(tol=1e-9, max_iter=3000):
    return cn.Auto(tol=tol, max_iter=max_iter)


def reached(tol=1e-9, max_iter=3000):
    return cn.Auto(tol=tol, max_iter=max_iter, memory=LITTLE)


def states(sim):
    mesh = sim.meshes[0]
    return {"position": mesh.position, "velocity": mesh.velocity, "grains": np.array(sim.bodies.velocity)}


def assert_same(one, other, rel):
    for name, of_one in states(one).items():
        of_other = states(other)[name]
        assert np.abs(of_one - of_other).max() <= rel * np.abs(of_one).max(), name


@pytest.mark.parametrize("body_of", [elastic, solid])
@pytest.mark.parametrize("dim", [2, 3])
def test_steps_are_those_by_the_compliance(dim, body_of):
    """On nodes, on edges and on faces of four nodes, sticking and sliding; in less memory."""
    one, two = (on_a_plane(dim, body_of, solver(), fast=0.5) for solver in (formed, reached))
    for _ in range(12):
        one.step()
        two.step()
        assert one.info["status"] == two.info["status"] == "converged"
    assert len(two.contacts) > 100
    assert_same(one, two, 1e-6)
    for sim in (one, two):
        assert abs(sim.energy["closure"]) < 1e-7 * sim.energy["in_play"]
    assert one.held_bytes["bodies"] > 1.2 * two.held_bytes["bodies"]


@pytest.mark.parametrize("dim", [2, 3])
def test_sweeps_are_the_same_sweeps(dim):
    """Results agree to rounding, with equal numbers of sweeps."""
    one, two = (on_a_plane(dim, elastic, solver(1e-4)) for solver in (cn.NLGS, reached))
    for _ in range(5):
        one.step()
        two.step()
        assert one.info["iterations"] == two.info["iterations"]
    assert_same(one, two, 1e-9)


@pytest.mark.parametrize("body_of", [elastic, solid])
@pytest.mark.parametrize("dim", [2, 3])
def test_a_run_that_was_saved_goes_on_to_the_same_bits(tmp_path, dim, body_of):
    """Grains come to new nodes; compliances of earlier nodes are forgotten, or not."""
    one, two = (on_a_plane(dim, body_of, reached(1e-6), fast=4.0) for _ in range(2))
    for _ in range(8):
        one.step()
    one.checkpoint(tmp_path / "state.h5")
    two.restore(tmp_path / "state.h5")
    for _ in range(8):
        one.step()
        two.step()
    for name, of_one in states(one).items():
        assert np.array_equal(of_one, states(two)[name]), name


def test_numbers_do_not_depend_on_threads():
    runs = []
    for threads in (1, 3):
        sim = on_a_plane(3, elastic, reached(1e-6), threads=threads)
        for _ in range(3):
            sim.step()
        runs.append(states(sim))
    for name, of_one in runs[0].items():
        assert np.array_equal(of_one, runs[1][name]), name


def test_a_mesh_that_touches_itself_and_another():
    """Contacts whose sides rest on one body, or on two: the same sweeps."""
    results = []
    for solver in (cn.NLGS(tol=1e-3), reached(1e-3)):
        scene = cn.Scene(2, gravity=(0.0, -9.81))
        for k in range(2):
            points, cells = bricks(12, rows=2)
            body = elastic(points + (0.02 * k, 0.16 * k), cells)
            edges = body.boundary_edges()
            more = {"contact": np.unique(edges[edges >= 0]), "edges": edges, "self_contact": True}
            scene.add(cn.deformable(body, STONE, storage="sparse", name=f"bricks {k}", **more))
        scene.add(cn.wall((0.0, 0.0), (0.0, 1.0), STONE))
        scene.interact(STONE, STONE, cn.Coulomb(mu=0.5))
        sim = cn.Simulation(scene, 1e-3, cn.NSCD(solver=solver), overlap="ignore")
        for _ in range(10):
            assert sim.step()["status"] == "converged"
        results.append(sim)
    one, two = results
    assert one.info["iterations"] == two.info["iterations"] > 1
    assert one.held_bytes["bodies"] > 1.1 * two.held_bytes["bodies"]
    for a, b in zip(one.meshes, two.meshes):
        assert np.abs(a.velocity - b.velocity).max() < 1e-9 * np.abs(a.velocity).max()


def test_what_turns_with_a_face():
    """Balls that roll on the sheet against a moment, which acts as couples on the nodes of its faces."""
    results = []
    for solver in (formed(), reached()):
        sim = on_a_plane(3, elastic, solver, fast=1.0, law=cn.Rolling(mu=0.7, rolling=0.3, twisting=0.2))
        for _ in range(8):
            assert sim.step()["status"] == "converged"
        results.append(sim)
    one, two = results
    assert np.abs(one.bodies.velocity[-36:, 3:]).max() > 0.1
    assert_same(one, two, 1e-6)
    assert one.held_bytes["bodies"] > 1.2 * two.held_bytes["bodies"]


def test_few_nodes_keep_their_columns():
    """Balls that meet nodes that are held, whose columns have no numbers: contacts on at most 24 dofs keep a compliance, however
    little memory there is."""
    points, cells = grid((14, 14, 1))
    body = elastic(points * (1.0, 1.0, 0.1), cells)
    body.groups["low"] = np.flatnonzero(points[:, 2] == 0)
    results = []
    for solver in (formed(), reached()):
        scene = cn.Scene(3, gravity=(0.0, 0.0, -9.81))
        held = {"contact": body.groups["low"][:8], "fixed": {"low": "xyz"}}
        scene.add(cn.deformable(body, STONE, storage="sparse", **held))
        scene.add(cn.spheres(body.points[:3] - (0.0, 0.0, 0.0499), 0.05, STONE, velocity=[0.0, 0.0, 1.0, 0.0, 0.0, 0.0]))
        scene.interact(STONE, STONE, cn.Coulomb(mu=0.3))
        sim = cn.Simulation(scene, 1e-3, cn.NSCD(solver=solver), overlap="ignore")
        for _ in range(5):
            assert sim.step()["status"] == "converged"
        results.append(sim)
    one, two = results
    assert len(two.contacts) > 2 and np.array_equal(one.bodies.velocity, two.bodies.velocity)


def test_solvers_that_want_w_say_so():
    sim = on_a_plane(2, elastic, cn.PPANewton(tol=1e-6, memory=LITTLE))
    sim.step()
    assert sim.info["status"] == "iteration_limit" and "the compliance of a mesh would take more" in sim.info["hint"]
