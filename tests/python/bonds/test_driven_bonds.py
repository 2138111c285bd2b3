"""Bonds and joints whose bodies are driven along the normal: forces of springs follow from their opening, even where no free body
moves."""

import cairn as cn
import numpy as np
import pytest

STONE = cn.Material("stone", density=2500.0)
RADIUS, SPEED, STEP = 0.05, 1e-3, 1e-4
SPRINGS = dict(normal_stiffness=1e12, tangential_stiffness=1e12)
MODES = dict(normal_strength=2e6, tangential_strength=3e6, normal_work=10.0, tangential_work=30.0)
ZONES = {"MAC": cn.MAC(**SPRINGS, work=10.0), "MP3": cn.MP3(**SPRINGS, strength=2e6, work=10.0),
         "MAL": cn.MAL(**SPRINGS, **MODES)}  # fmt: skip


def drawn_apart(dim, law, speed=SPEED):
    """Two grains, of which one is held and the other goes away along the normal and is free across it: a simulation, the area."""
    scene, up = cn.Scene(dim), np.eye(dim)[-1]
    names = ("vx", "vy", "w") if dim == 2 else ("vx", "vy", "vz", "wx", "wy", "wz")
    grains = cn.disks if dim == 2 else cn.spheres
    scene.add(grains([0 * up], RADIUS, STONE, driven=names))
    drive = [speed if name == names[dim - 1] else 0.0 for name in names]
    scene.add(grains([2 * RADIUS * up], RADIUS, STONE, driven=names[dim - 1 :], drive=drive))
    scene.interact(STONE, STONE, law)
    area = RADIUS / 2 if dim == 2 else np.pi * (RADIUS / 2) ** 2
    return cn.Simulation(scene, STEP, cn.NSCD(solver=cn.NLGS(tol=1e-10))), area


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("name", ZONES)
def test_zone_that_is_driven_open_bears_its_curve(dim, name):
    sim, area = drawn_apart(dim, ZONES[name])
    work, peak = 0.0, 0.0
    for k in range(1, 200):
        assert sim.step()["status"] == "converged"
        # in the middle of the flight, where the next step detects it
        opening, beta = (k + 0.5) * STEP * SPEED, sim.contacts.beta.max(initial=0)
        stress = (beta**2 if name == "MAC" else beta) * 1e12 * opening
        found = -sim.contacts.impulse[0, -1] / STEP / area if len(sim.contacts) else 0.0
        assert np.isclose(abs(found), stress, rtol=1e-6, atol=1e-9 * 2e6)
        work, peak = work + abs(found) * SPEED * STEP, max(peak, abs(found))
    energy = sim.info["energy"]
    assert np.isclose(peak, 1e6 * np.sqrt(10.0) if name == "MAC" else 2e6, rtol=0.01)
    assert np.isclose(energy["work_driven"], work * area, rtol=0.02)  # of first order in the step
    assert abs(energy["work_driven"] - energy["stored"] - energy["released"]) < 0.02 * work * area
    assert energy["released"] > 0.9 * 10.0 * area


def test_strength_of_what_is_driven_apart():
    """No motion answers a bond without springs: it bears its strength in the step, and is gone behind it."""
    sim, area = drawn_apart(2, cn.MohrCoulomb(tension=1e5, cohesion=1e5))
    sim.step()
    assert np.isclose(np.linalg.norm(sim.contacts.impulse[0]), 1e5 * area * STEP, rtol=1e-9)
    sim.step()
    assert sim.contacts.beta.max(initial=0) == 0


BONDS = {"MAL": ZONES["MAL"], "MohrCoulomb": cn.MohrCoulomb(tension=1e5, cohesion=1e5),
         "ParallelBond": cn.ParallelBond(normal_stiffness=1e10, tangential_stiffness=1e10, tension=1e5, shear=1e5)}  # fmt: skip


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("name", BONDS)
def test_bonds_that_drives_close_or_let_rest_stay(dim, name):
    for speed in (-SPEED, 0.0):
        sim, area = drawn_apart(dim, BONDS[name], speed)
        for _ in range(5):
            assert sim.step()["status"] == "converged"
            assert np.abs(sim.contacts.impulse).max() < 1e-6 * STEP * 1e5 * area
        assert np.all(sim.contacts.beta == 1)
        assert abs(sim.info["energy"]["work_driven"]) < 1e-6 * 1e5 * area * SPEED * STEP


@pytest.mark.parametrize("solver", [cn.NLGS, cn.Auto, cn.NewtonAlartCurnier])
@pytest.mark.parametrize("joint", ["pivot", "fixed", "slider"])
def test_joint_of_what_is_driven_along_its_axis(solver, joint):
    """A disk that is driven to the side, and is held up by a joint whose other conditions the drive has already."""
    scene = cn.Scene(2, gravity=(0.0, -10.0))
    disk = scene.add(cn.disks([(0.1, 0.0)], RADIUS, STONE, driven=("vx", "w")))
    scene.interact("*", "*", None)
    made = {"pivot": cn.Pivot(point=(RADIUS, 0.0)), "fixed": cn.Fixed(point=(RADIUS, 0.0)),
            "slider": cn.Slider(point=(RADIUS, 0.0), axis=(1.0, 0.0))}  # fmt: skip
    scene.join(disk[0], None, made[joint])
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(solver=solver(tol=1e-8)))
    for _ in range(20):
        assert sim.step()["status"] == "converged"
    assert abs(sim.bodies.position[0, 1]) < 1e-9 * RADIUS
    weight = 10.0 * sim.bodies.mass[0]
    assert np.allclose(np.linalg.norm(sim.contacts.impulse, axis=1) / sim.dt, weight, rtol=1e-6)


def slab(dim, cells):
    """A layer of cells on the height of 0.1 m, 0.1 m wide, and the names of its lower nodes."""
    axes = [np.linspace(0.0, 0.1, cells + 1)] * (dim - 1) + [np.array([0.1, 0.2])]
    points = np.array(np.meshgrid(*axes, indexing="ij")).reshape(dim, -1).T
    n = np.arange(len(points)).reshape([cells + 1] * (dim - 1) + [2])
    if dim == 2:
        made = {"quad": np.stack([n[:-1, 0], n[1:, 0], n[1:, 1], n[:-1, 1]], -1)}
    else:
        made = {"hexahedron": np.stack([n[i : cells + i, j : cells + j, k].ravel() for k in (0, 1)
                                        for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))], -1)}  # fmt: skip
    groups = {"all": np.arange(len(points)), "bottom": n[..., 0].ravel()}
    return cn.ElasticBody(points, made, young=1e9, poisson=0.2, density=2500.0, groups=groups)


def block(dim, low, high):
    if dim == 2:
        corners = [[low, 0.0], [high, 0.0], [high, 0.1], [low, 0.1]]
        return cn.polygons([corners], STONE, driven=("vx", "vy", "w"))
    corners = [[x, y, z] for x in (low, high) for y in (low, high) for z in (0.0, 0.1)]
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return cn.polyhedra([(corners, faces)], STONE, driven=("vx", "vy", "vz", "wx", "wy", "wz"))


@pytest.mark.parametrize("dim, cells", [(2, 1), (2, 3), (3, 1), (3, 3)])
@pytest.mark.parametrize("low, high", [(0.0, 0.1), (-0.05, 0.15)])
def test_mesh_on_a_body_with_sides_is_glued_by_its_surface_once(dim, cells, low, high):
    """Nodes share the surface of their mesh: corners and edges of the body that lie on it add nothing."""
    scene = cn.Scene(dim)
    sides = {"edges" if dim == 2 else "faces": "bottom"}
    scene.add(cn.deformable(slab(dim, cells), STONE, contact="bottom", drive={"all": {"xyz"[dim - 1]: SPEED}}, **sides))
    scene.add(block(dim, low, high))
    scene.interact(STONE, STONE, ZONES["MAL"])
    sim = cn.Simulation(scene, STEP, cn.NSCD(solver=cn.NLGS(tol=1e-8)))
    for _ in range(10):
        assert sim.step()["status"] == "converged"
    force = np.linalg.norm(sim.contacts.impulse, axis=1).sum() / STEP
    assert np.isclose(force, 1e12 * 10 * SPEED * STEP * 0.1 ** (dim - 1), rtol=2e-3)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("at", ["node", "between"])
def test_grain_on_a_mesh_is_glued_by_its_own_area_wherever_it_is(dim, at):
    """A node that a grain touches is an end of sides, too: one bond, of no more than the grain's area."""
    scene, radius = cn.Scene(dim), 0.01
    sides = {"edges" if dim == 2 else "faces": "bottom"}
    scene.add(cn.deformable(slab(dim, 2), STONE, contact="bottom", drive={"all": {"xyz"[dim - 1]: SPEED}}, **sides))
    names = ("vx", "vy", "w") if dim == 2 else ("vx", "vy", "vz", "wx", "wy", "wz")
    place = [0.05 if at == "node" else 0.0685] * (dim - 1) + [0.1 - radius]
    scene.add((cn.disks if dim == 2 else cn.spheres)([place], radius, STONE, driven=names))
    scene.interact(STONE, STONE, ZONES["MAL"])
    sim = cn.Simulation(scene, STEP, cn.NSCD(solver=cn.NLGS(tol=1e-8)))
    for _ in range(10):
        assert sim.step()["status"] == "converged"
    area = radius if dim == 2 else np.pi * radius**2
    force = np.linalg.norm(sim.contacts.impulse, axis=1).sum() / STEP
    assert np.isclose(force, 1e12 * 10 * SPEED * STEP * area, rtol=2e-3)
    assert (sim.contacts.beta > 0).sum() == 1


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("upper, lower", [(1, 1), (2, 3), (3, 3)])
@pytest.mark.parametrize("both", [False, True])
def test_meshes_are_glued_once_whichever_has_the_points(dim, upper, lower, both):
    """Matching nodes touch two edges of the other mesh, and with points on both sides each meets those of the other."""
    scene, what = cn.Scene(dim), "edges" if dim == 2 else "faces"
    drive = {"all": {"xyz"[dim - 1]: SPEED}}
    scene.add(cn.deformable(slab(dim, upper), STONE, contact="bottom", drive=drive, **{what: "bottom"}))
    below = slab(dim, lower)
    points = below.points - 0.1 * np.eye(dim)[-1]
    top = {"all": below.groups["all"], "top": below.groups["bottom"] + 1}
    below = cn.ElasticBody(points, below.cells, young=1e9, poisson=0.2, density=2500.0, groups=top)
    scene.add(cn.deformable(below, STONE, fixed={"all": "xyz"[:dim]}, **({"contact": "top"} if both else {}), **{what: "top"}))
    scene.interact(STONE, STONE, ZONES["MAL"])
    sim = cn.Simulation(scene, STEP, cn.NSCD(solver=cn.NLGS(tol=1e-8)))
    for _ in range(10):
        assert sim.step()["status"] == "converged"
    force = np.linalg.norm(sim.contacts.impulse, axis=1).sum() / STEP
    assert np.isclose(force, 1e12 * 10 * SPEED * STEP * 0.1 ** (dim - 1), rtol=2e-3)
