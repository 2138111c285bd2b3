"""Contact pressure of nodes: blocks under a uniform pressure, of cells of first and second order."""

import cairn as cn
import numpy as np
import pytest
from second_order import box

SKIN = cn.Material("skin", density=100.0)
FLAT = [(kind, plane) for kind in ("triangle", "quad", "triangle6", "quad8", "quad9") for plane in ("strain", "axisymmetric")]
SOLID = [(kind, None) for kind in ("tetra", "hexahedron", "tetra10", "hexahedron27")]


def pressed(kind, plane, rough=False):
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
    assert found == pytest.approx(np.full(len(found), 100.0), rel=0.02 if kind == "tetra10" else 2e-3)
    others = np.setdiff1d(np.arange(len(mesh.body.points)), mesh.body.groups["foot"])
    assert not mesh.contact_pressure[others].any()


@pytest.mark.parametrize("kind", ["tetra10", "hexahedron20", "hexahedron27", "hexahedron"])
def test_what_nodes_stand_for_is_the_surface(kind):
    from cairn.build.mesh_measures import surface_vectors

    points, cells = box(kind, (2, 2, 2), (1.0, 1.0, 1.0))
    body = cn.SolidBody(points, cells, cn.NeoHookean(young=1e5, poisson=0.3), density=1.0)
    found = surface_vectors(body, 0 * points)
    assert np.abs(found.sum(axis=0)).max() < 1e-14
    inner = np.isclose(points[:, 2], 1.0) & (points[:, :2] > 0.01).all(axis=1) & (points[:, :2] < 0.99).all(axis=1)
    assert found[inner, 2].min() >= 0
    assert np.einsum("nk,nk->", found, points) == pytest.approx(3.0, rel=1e-12)  # the divergence theorem
