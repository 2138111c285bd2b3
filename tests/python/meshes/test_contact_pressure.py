"""Contact pressure of nodes: blocks under a uniform pressure, of cells of first and second order."""

import cairn as cn
import numpy as np
import pytest
from second_order import box

SKIN = cn.Material("skin", density=100.0)
FLAT = [(kind, plane) for kind in ("triangle", "quad", "triangle6", "quad8", "quad9") for plane in ("strain", "axisymmetric")]
SOLID = [(kind, None) for kind in ("tetra", "hexahedron", "tetra10", "hexahedron20", "hexahedron27")]
ROUGH = {"tetra10": 0.02, "hexahedron20": 0.18}  # corners under a wall cannot pull, as those of HEX20 would


def pressed(kind, plane):
    dim = 2 if plane else 3
    points, cells = box(kind, (3, 2, 2)[:dim], (1.0, 0.5, 0.5)[:dim])
    up = points[:, -1]
    groups = {"foot": np.isclose(up, 0), "top": np.isclose(up, 0.5)} | {
        f"side {k}": np.isclose(points[:, k], 0) for k in range(dim - 1)
    }
    options = {"groups": groups, "kinematics": "small", "rayleigh": (50.0, 1e-3)} | ({"plane": plane} if plane else {})
    body = cn.SolidBody(points, cells, cn.IsotropicElastic(young=1e5, poisson=0.0), density=10.0, **options)
    held = {f"side {k}": "xyz"[k] for k in range(dim - 1)}
    scene = cn.Scene(dim, gravity=(0.0,) * dim)
    scene.add(cn.deformable(body, SKIN, contact="foot", pressure={"top": 100.0}, fixed=held))
    scene.add(cn.wall((0.0,) * dim, (0.0,) * (dim - 1) + (1.0,), SKIN))
    scene.interact(SKIN, SKIN, cn.Coulomb(mu=0.0))
    sim = cn.Simulation(scene, 2e-3)
    sim.run(steps=300, progress=False)
    return sim.meshes[0].contact_pressure[body.groups["foot"]], sim.meshes[0]


@pytest.mark.parametrize(("kind", "plane"), FLAT + SOLID)
def test_it_is_uniform_where_the_stress_is(kind, plane):
    found, mesh = pressed(kind, plane)
    assert found == pytest.approx(np.full(len(found), 100.0), rel=ROUGH.get(kind, 2e-3))
    others = np.setdiff1d(np.arange(len(mesh.body.points)), mesh.body.groups["foot"])
    assert not mesh.contact_pressure[others].any()


def graded(kind, cells, foot):
    """A block of unit sides over a foot, its cells narrower at the origin and, in space, sheared."""
    points, cells_of = box(kind, cells, (1.0,) * len(cells))
    at = np.linspace(0, 1, cells[0] + 1)
    points[:, 0] = np.interp(points[:, 0], at, at * (1 + at) / 2)
    if len(cells) == 3:
        points[:, 0] += 0.2 * points[:, 1]
    points[:, -1] += foot
    return points, cells_of


@pytest.mark.parametrize("kind", ["triangle6", "quad8", "quad9", "tetra10", "hexahedron20", "hexahedron27", "hexahedron"])
def test_under_mortar_it_is_uniform_on_both_sides(kind):
    dim = 2 if kind in ("triangle6", "quad8", "quad9") else 3
    low, upper = ((2,) * (dim - 1) + (1,)), ((3, 2, 2)[: dim - 1] + (1,))
    scene, side = cn.Scene(dim, gravity=(0.0,) * dim), "edges" if dim == 2 else "faces"
    axes = "xyz"[:dim]
    for foot, of, options in ((-1.0, low, {}), (0.0, upper, {"contact": "bottom", "mortar": True})):
        points, cells = graded(kind, of, foot)
        height = points[:, -1] - foot
        groups = {"bottom": np.isclose(height, 0), "top": np.isclose(height, 1), "all": np.ones(len(points), bool)}
        body = cn.SolidBody(points, cells, cn.IsotropicElastic(young=100.0, poisson=0.0), density=1e-3, groups=groups)
        held = {"bottom": axes} if foot < 0 else {"all": axes[:-1]}
        options[side] = "top" if foot < 0 else "bottom"
        if foot == 0:
            options["pressure"] = {"top": 1.0}
        scene.add(cn.deformable(body, SKIN, fixed=held, name=f"at {foot:g}", **options))
    scene.interact(SKIN, SKIN, cn.Coulomb(mu=0.0))
    sim = cn.Simulation(scene, 1.0, cn.NSCD(theta=1.0, solver=cn.PPANewton(tol=1e-13)))
    for _ in range(3):
        sim.step()
    for mesh, side in zip(sim.meshes, ("top", "bottom")):
        found = mesh.contact_pressure
        assert found[mesh.body.groups[side]] == pytest.approx(1.0, rel=1e-7)
        assert not found[np.setdiff1d(np.arange(len(found)), mesh.body.groups[side])].any()


@pytest.mark.parametrize("kind", ["tetra10", "hexahedron20", "hexahedron27", "hexahedron"])
def test_what_nodes_stand_for_is_the_surface(kind):
    from cairn.model.mesh_measures import surface_vectors

    points, cells = box(kind, (2, 2, 2), (1.0, 1.0, 1.0))
    body = cn.SolidBody(points, cells, cn.NeoHookean(young=1e5, poisson=0.3), density=1.0)
    found = surface_vectors(body, 0 * points)
    assert np.abs(found.sum(axis=0)).max() < 1e-14
    assert np.einsum("nk,nk->", found, points) == pytest.approx(3.0, rel=1e-12)  # the divergence theorem
