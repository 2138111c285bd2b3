"""Rest of elastic blocks on each other whose meshes match, and edges that stretch with their bodies."""

import cairn as cn
import numpy as np
import pytest

STUFF = cn.Material("stuff", density=1000.0)
LAWS = {"frictionless": cn.Frictionless(), "rough": cn.Coulomb(mu=0.8)}


def block(dim, n, low, young, poisson):
    axis = np.linspace(0, 1, n + 1)
    axes = (*[axis] * (dim - 1), low + axis)
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    of = np.arange(grid[..., 0].size).reshape(grid.shape[:-1])
    if dim == 2:
        cells = {"quad": np.stack([of[:-1, :-1], of[1:, :-1], of[1:, 1:], of[:-1, 1:]], -1).reshape(-1, 4)}
    else:
        a, b = slice(None, -1), slice(1, None)
        corner = [(a, a), (b, a), (b, b), (a, b)]
        cells = {"hexahedron": np.stack([of[x, y, z] for z in (a, b) for x, y in corner], -1).reshape(-1, 8)}
    groups = {"top": of[..., -1].ravel(), "bottom": of[..., 0].ravel(), "left": of[0].ravel(), "front": of[:, 0].ravel()}
    return cn.ElasticBody(grid.reshape(-1, dim), cells, young=young, poisson=poisson, density=1000.0, groups=groups)


def pressed(dim, n, poisson=0.3, pressure=1e6, young=1e9, law="frictionless"):
    scene = cn.Scene(dim)
    up = "y" if dim == 2 else "z"
    held = {"left": "x"} if dim == 2 else {"left": "x", "front": "y"}
    side = {"edges" if dim == 2 else "faces": "top"}
    load = {"top": (0.0,) * (dim - 1) + (-pressure,)}
    scene.add(
        cn.deformable(block(dim, n, 0.0, young, poisson), STUFF, fixed={"bottom": up, **held}, **side),
        cn.deformable(block(dim, n, 1.0, young, poisson), STUFF, contact="bottom", traction=load, fixed=held),
    )
    scene.interact("*", "*", LAWS[law])
    return cn.Simulation(scene, 1e-2, cn.NSCD(theta=1.0))


@pytest.mark.parametrize("law", ["frictionless", "rough"])
@pytest.mark.parametrize("dim, n", [(2, 1), (2, 2), (2, 4), (3, 1), (3, 2)])
def test_blocks_bear_a_uniform_stress(dim, n, law):
    """Both blocks spread alike, so that stresses are those of one block."""
    pressure, young, poisson = 1e6, 1e9, 0.3
    sim = pressed(dim, n, law=law)
    found = cn.find_equilibrium(sim)
    assert found["converged"]
    spread = (poisson * (1 + poisson) if dim == 2 else poisson) * pressure / young
    for mesh in sim.meshes:
        points = mesh.body.points
        assert mesh.displacement[:, 0] == pytest.approx(spread * points[:, 0], abs=1e-4 * spread)
        stress = np.array(next(iter(mesh.stress.values())))
        assert stress[..., dim - 1] == pytest.approx(-pressure, rel=1e-4)
    sim.step()
    assert sim.energy["kinetic"] < 1e-12 * pressure**2 / young
    assert np.abs(sim.contacts.force[:, -1]).sum() == pytest.approx(pressure, rel=1e-4)


@pytest.mark.parametrize("stiffness", [1e2, 1e4, 1e5, 1e7])
def test_the_stiffness_of_the_search_changes_nothing(stiffness):
    sim = pressed(2, 2)
    assert cn.find_equilibrium(sim, stiffness=stiffness)["converged"]
    assert sim.meshes[0].displacement[-1, 0] == pytest.approx(3.9e-4, rel=1e-4)
    assert np.array(sim.meshes[0].stress["quad"])[:, 1] == pytest.approx(-1e6, rel=1e-4)


@pytest.mark.parametrize("pressure", [1e3, 1e5, 1e7])
def test_any_load_is_borne(pressure):
    sim = pressed(2, 2, pressure=pressure)
    assert cn.find_equilibrium(sim)["converged"]
    assert np.array(sim.meshes[0].stress["quad"])[:, 1] == pytest.approx(-pressure, rel=1e-3)


def test_an_edge_is_as_long_as_its_nodes_stand():
    """A ball that rolls over the end of an edge that was stretched by a tenth is borne upright."""
    scene = cn.Scene(2, gravity=(0, -10.0))
    mesh = block(2, 2, 0.0, 1e9, 0.0)
    scene.add(cn.deformable(mesh, STUFF, edges="top", fixed={"bottom": "xy", "top": "xy"}, velocity=(0.0, 0.0)))
    scene.add(cn.disks([[0.56, 1.1]], 0.1, STUFF))
    scene.interact("*", "*", cn.Frictionless())
    sim = cn.Simulation(scene, 1e-3)
    sim.step()
    sim.raw.nodes.position[:, 0] *= 1.1
    for _ in range(20):
        sim.step()
    assert len(sim.contacts.gap) > 0
    assert np.abs(sim.contacts.normal[:, 0]).max() < 1e-6
    assert np.abs(sim.bodies.velocity[0]).max() < 1e-2
