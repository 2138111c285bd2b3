"""Reshaping, mortar and self-contact of C and Fortran programs against the same scenes made in Python."""

import cairn as cn
import numpy as np
import pytest
from cell_blocks import block
from programs import near, told_by
from test_self_contact import fork

ROCK = cn.Material("rock", density=1000.0)
SQUARE = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])


def mesh(corner):
    x = np.linspace(0.0, 1.0, 5)
    points = np.stack(np.meshgrid(x, x, indexing="ij"), -1).reshape(-1, 2) + corner
    k = np.arange(25).reshape(5, 5)
    cells = {"quad": np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], -1).reshape(-1, 4)}
    return cn.ElasticBody(points, cells, young=1e7, poisson=0.3, density=900.0)


def above_the_ground(dt, *sets, gravity=0.0):
    scene = cn.Scene(dim=2, gravity=(0.0, gravity))
    scene.add(cn.wall((0, 0), (0, 1), ROCK), *sets)
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, dt, cn.NSCD(0.5, cn.NLGS(tol=1e-12, max_iter=50000)))


@pytest.fixture(scope="module")
def struck(tmp_path_factory):
    return told_by("struck", tmp_path_factory.mktemp("struck"))


def test_a_threshold_of_force_is_that_of_python(struck):
    """tests/consumers/fortran/struck.f90: the square of body 1 is watched, that of body 2 is not."""
    sim = above_the_ground(
        5e-4, cn.polygons([SQUARE + (0.0, 0.52), SQUARE + (3.0, 0.52)], ROCK, velocity=(0.0, -2.0, 0.0)), gravity=-10.0
    )
    sim.reshape_when([1], mesh((-0.5, 0.02)), force=1e5, back=1e2)
    kinds = []
    for _ in range(120):
        sim.step()
        kinds.append(len(sim.meshes) - 1)
        if sim.steps == 25:
            near(struck["deforming"], sim.meshes[0].velocity)
    assert max(kinds) == 0 and np.array_equal(struck["kinds"], kinds)
    order = np.argsort(sim.bodies.id)
    assert np.array_equal(struck["id"], [0, 1, 2]) and np.array_equal(sim.bodies.id[order], [0, 1, 2])
    near(struck["position"], sim.bodies.position[order[1:]])
    near(struck["velocity"], sim.bodies.velocity[order[1:]], scale=2.0)  # at rest again, of 2 m/s
    near(struck["lost"], [sim.info["energy"][term] for term in ("dissipated_reshaping", "kinetic")], 1e-11)


def test_a_threshold_of_stress_is_that_of_python(struck):
    sim = above_the_ground(
        1e-3, cn.polygons([SQUARE + (0.0, 0.5)], ROCK), cn.polygons([SQUARE + (0.0, 1.5)], ROCK, force=(0.0, -1e4, 0.0))
    )
    sim.reshape_when([1], mesh((-0.5, 0.0)), stress=0.8e4)
    for _ in range(5):
        sim.step()
    near(struck["pressed"], sim.meshes[0].displacement)


def test_a_mesh_becomes_the_disk_that_it_becomes_in_python(struck):
    sim = above_the_ground(1e-3, cn.polygons([SQUARE], ROCK, position=[[2.0, 5.0]], velocity=(1.0, -2.0, 3.0)))
    for step in range(1, 41):
        if step == 11:
            sim.deform(1, mesh((-0.5, -0.5)))
        if step == 31:
            shape = cn.disks([[0.0, 0.0]], 0.4, ROCK)
            shape.inertia[:] = 0.15 * shape.mass[:]  # as the program has it: 0.3 kg m2 of 2 kg
            disk = sim.rigidify(0, shape)
        sim.step()
    assert struck["disk_id"] == disk and sim.bodies.id[-1] == disk
    for name in ("position", "velocity", "inertia"):
        near(struck[f"disk_{name}"], getattr(sim.bodies, name)[-1])
    near(struck["disk_lost"], sim.info["energy"]["dissipated_reshaping"], 1e-11)


@pytest.fixture(scope="module")
def touched(tmp_path_factory):
    return told_by("touching", tmp_path_factory.mktemp("touching"))


def test_a_mortar_is_that_of_python(touched):
    """tests/consumers/fortran/touching.f90: 2 cells on 3 under a uniform pressure, shares 1/6 1/3 1/3 1/6 of it below. Contacts
    alone hold the upper block, which falls freely by h^2 p/(density height) = 0.02 m before they act. Its displacement of 5e-4 m
    has the rounding of that fall, 40 eps, and the condition 1e2 of the blocks makes it 1e-12."""
    over, under = block((2, 2), (0.0, 0.5)), block((3, 2), (0.0, 0.0))
    force = {}
    for node, share in zip(over.groups["top"], (0.25, 0.5, 0.25)):
        over.groups |= {f"load {node}": [node]}
        force[f"load {node}"] = (0.0, -1e3 * share)
    over.groups["corner"], under.groups["corner"] = over.groups["left"][-1:], under.groups["left"][:1]
    scene = cn.Scene(dim=2)
    on_top = {"contact": "bottom", "edges": "bottom", "mortar": True, "fixed": {"corner": "x"}}
    scene.add(cn.deformable(over, ROCK, force=force, name="over", **on_top))
    scene.add(cn.deformable(under, ROCK, edges="top", fixed={"bottom": "y", "corner": "xy"}, name="under"))
    scene.interact(ROCK, ROCK, cn.GapCoulomb(mu=0.0))
    sim = cn.Simulation(scene, 0.1, cn.NSCD(1.0, cn.NLGS(tol=1e-14, max_iter=50000)), overlap="ignore")
    for _ in range(60):
        sim.step()
    near(touched["share"], np.array([1.0, 2.0, 2.0, 1.0]) / 6)
    near(touched["over"], sim.meshes[0].displacement)
    near(touched["under"], sim.meshes[1].displacement)


def test_self_contact_is_that_of_python(touched):
    body = fork()
    scene = cn.Scene(dim=2)
    given = {"contact": "slot", "edges": "slot", "self_contact": True, "fixed": {"back": "xy"}}
    scene.add(cn.deformable(body, ROCK, force={"tip": (0.0, -800.0)}, **given))
    scene.interact(ROCK, ROCK, cn.GapCoulomb(mu=0.0))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(1.0, cn.NLGS(tol=1e-14, max_iter=50000)))
    for _ in range(150):
        sim.step()
    near(touched["fork"], sim.meshes[0].displacement, 1e-11)
