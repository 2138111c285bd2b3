"""Meshes that begin deep inside others, or move by more than a cell in a step: warnings with a safe step."""

import warnings

import cairn as cn
import numpy as np
import pytest
from cairn import NeoHookean, SolidBody
from second_order import box

ROCK = cn.Material("rock", density=2500.0)
BODIES = {
    "linear": lambda points, cells: cn.ElasticBody(points, cells, young=1e8, poisson=0.3, density=1000.0),
    "neo_hookean": lambda points, cells: SolidBody(points, cells, NeoHookean(young=1e8, poisson=0.3), density=1000.0),
}
CELL = 0.25


def block(kind, body, height, *, name="block", **options):
    """Cells of a quarter, one metre in all."""
    dim = 2 if kind == "quad" else 3
    points, cells = box(kind, (4,) * dim, (1.0,) * dim)
    points[:, -1] += height
    return cn.deformable(BODIES[body](points, cells), ROCK, contact=np.arange(len(points)), name=name, **options)


def over_a_wall(kind, body, height, speed=0.0, *, law=None, dt=1e-4, **options):
    """A block at a height over a wall, which falls at a speed."""
    dim = 2 if kind == "quad" else 3
    scene = cn.Scene(dim=dim, gravity=(0.0,) * dim)
    scene.add(block(kind, body, height, velocity=(0.0,) * (dim - 1) + (-speed,)))
    scene.add(cn.wall((0.0,) * dim, (0.0,) * (dim - 1) + (1.0,), ROCK))
    scene.interact(ROCK, ROCK, law or cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, dt=dt, **options)


def quiet(sim, steps=1, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for _ in range(steps):
            info = sim.step(**options)
    return info


@pytest.mark.parametrize("kind", ["quad", "hexahedron"])
@pytest.mark.parametrize("body", BODIES)
def test_a_mesh_that_begins_deep_is_told_of(kind, body):
    sim = over_a_wall(kind, body, -0.2)
    words = r"node \d+.* of the mesh 'block' and body \d+ overlap by 0.2 m before step 1"
    with pytest.warns(cn.OverlapWarning, match=words) as told:
        info = sim.step()
    assert len(told) == 1 and ("cell" in str(told[0].message).split("overlap")[0]) == (body != "linear")
    assert info["mesh_depth"] == pytest.approx(0.2 / CELL, rel=1e-9)
    assert info["status"] == "converged" and info["hint"] == info["mesh_hint"] == str(told[0].message)
    assert quiet(sim)["mesh_depth"] > 0.5  # once a run


def test_a_law_that_pushes_apart_is_told_of_as_well():
    sim = over_a_wall("quad", "linear", -0.5, law=cn.GapCoulomb(mu=0.3))
    with pytest.warns(cn.OverlapWarning, match="overlap by 0.5 m before step 1, 2 of the size"):
        sim.step()


def test_an_overlap_of_less_than_half_a_cell_is_a_number_alone():
    sim = over_a_wall("quad", "linear", -0.1)
    info = quiet(sim)
    assert info["mesh_depth"] == pytest.approx(0.1 / CELL, rel=1e-9)
    assert "mesh_hint" not in info and info["mesh_way"] == 0 and info["hint"] == ""


@pytest.mark.parametrize("kind", ["quad", "hexahedron"])
@pytest.mark.parametrize("body", BODIES)
def test_a_block_too_fast_for_its_step_is_told_of_with_the_step_that_is_safe(kind, body):
    """Contacts are sought where half of the step leads, which is in the wall; none is as the step begins."""
    sim = over_a_wall(kind, body, 0.3, 2000.0, dt=1e-3)
    words = r"of the mesh 'block' and body \d+ move by 2 m .* give dt <= 0.00013 s"
    with pytest.warns(cn.TunnellingWarning, match=words) as told:
        info = sim.step()
    assert len(told) == 1 and info["mesh_way"] == pytest.approx(2000.0 * 1e-3 / CELL, rel=1e-9)
    assert info["mesh_depth"] == 0 and str(told[0].message) == info["mesh_hint"]
    assert (info["hint"] == info["mesh_hint"]) == (info["status"] == "converged")  # else the hint of the failed solve comes first
    sim = over_a_wall(kind, body, 0.3, 2000.0, dt=1.2e-4)
    with warnings.catch_warnings():
        warnings.simplefilter("error", cn.TunnellingWarning)
        assert sim.step()["mesh_way"] == 0


def on_a_plate(speed, dt, theta=0.5):
    """A block that falls on a plate of cells of a quarter."""
    points, cells = box("quad", (4, 2), (1.0, 0.5))
    groups = {"all": np.arange(len(points))}
    plate = cn.ElasticBody(points, cells, young=1e8, poisson=0.3, density=1000.0, groups=groups)
    points, cells = box("quad", (2, 2), (0.5, 0.5))
    falls = cn.ElasticBody(points + np.array([0.2, 0.52]), cells, young=1e8, poisson=0.3, density=1000.0)
    scene = cn.Scene(2, gravity=(0.0, 0.0))
    scene.add(cn.deformable(plate, ROCK, contact=["all"], edges=["all"], name="plate"))
    scene.add(cn.deformable(falls, ROCK, contact=np.arange(9), velocity=(0.0, -speed), name="block"))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, dt=dt, strategy=cn.NSCD(theta=theta))


def test_what_passes_through_a_side_of_a_mesh_is_told_of():
    """Motion by 0.4 of a cell in half a step: a node above the side ends deep within the plate."""
    sim = on_a_plate(100.0, 2e-3)
    words = r"node \d+ of the mesh 'block' and the side with nodes \d+ \d+ of the mesh 'plate' pass through each other in step 1"
    with pytest.warns(cn.TunnellingWarning, match=words) as told:
        sim.step()
    for _ in range(3):
        sim.step()
    assert sim.meshes[1].position[:, 1].min() < sim.meshes[0].position[:, 1].max() - 0.1  # it did
    safe = float(str(told[0].message).split("<= ")[1].split(" s")[0])
    sim = on_a_plate(100.0, 0.9 * safe)
    with warnings.catch_warnings():
        warnings.simplefilter("error", cn.TunnellingWarning)
        for _ in range(20):
            sim.step()
    assert sim.meshes[1].position[:, 1].min() > sim.meshes[0].position[:, 1].max() - 0.05


def test_what_moves_fast_with_nothing_in_its_way_is_not_told_of():
    sim = over_a_wall("quad", "neo_hookean", 50.0, 2000.0, dt=1e-3)
    assert quiet(sim, 5)["mesh_way"] == 0
    sim = over_a_wall("quad", "neo_hookean", 0.0, 0.0, dt=1e-3)  # along the wall
    v = sim.nodes.velocity.copy()
    v[:, 0] = 2000.0
    sim.nodes.set(position=sim.nodes.position, velocity=v)
    assert quiet(sim)["mesh_way"] == 0


def test_a_grain_that_flies_through_a_plate_is_told_of():
    points, cells = box("quad", (4, 1), (1.0, 0.1))
    plate = cn.ElasticBody(points, cells, young=1e8, poisson=0.3, density=1000.0, groups={"all": np.arange(len(points))})
    scene = cn.Scene(2, gravity=(0.0, 0.0))
    scene.add(cn.deformable(plate, ROCK, contact=["all"], edges=["all"], name="plate"))
    scene.add(cn.disks([[0.4, 0.2]], [0.02], ROCK, velocity=[[0.0, -300.0, 0.0]]))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    with pytest.warns(cn.TunnellingWarning, match=r"body \d+ and the side with nodes .* of the mesh 'plate' (move|pass)"):
        cn.Simulation(scene, dt=1e-3).step()
