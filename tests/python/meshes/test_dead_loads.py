"""Tractions and forces of the volume on bodies that deform: by shape functions, whatever the cells, constant or in time."""

import cairn as cn
import numpy as np
import pytest
from second_order import CELLS, box

SKIN = cn.Material("skin", density=1.0)
FLAT, SOLID = CELLS[2], CELLS[3]


def graded(kind, sizes):
    """A bar with narrow cells at one end, in points, cells and groups."""
    cells = (3, 2, 2)[: len(sizes)]
    points, kinds = box(kind, cells, (1.0, *sizes[1:]))
    for k, count in enumerate(cells):
        at = np.linspace(0, 1, count + 1) * (1.0 if k == 0 else sizes[k])
        points[:, k] = np.interp(points[:, k], at, at**2 / at[-1])
    points[:, 0] *= sizes[0]
    ends = {f"low {k}": np.isclose(points[:, k], 0) for k in range(len(sizes))}
    return points, kinds, ends | {f"high {k}": np.isclose(points[:, k], sizes[k]) for k in range(len(sizes))}


def loads(body, t=0.0, **given):
    """Forces of nodes (n, dim) [N] that a simulation has of them."""
    scene = cn.Scene(body.dim, gravity=(0.0,) * body.dim)
    scene.add(cn.deformable(body, SKIN, **given))
    return cn.Simulation(scene, 1e-3).meshes[0].load(t)


def made(kind, solid=True, poisson=0.0, shift=0.0, **options):
    dim = 3 if kind in SOLID else 2
    points, kinds, groups = graded(kind, (2.0, 0.5, 0.8)[:dim])
    points[:, 0] += shift
    if solid:
        law = cn.IsotropicElastic(young=1e5, poisson=poisson)
        return cn.SolidBody(points, kinds, law, groups=groups, density=3.0, kinematics="small", **options)
    return cn.ElasticBody(points, kinds, young=1e5, poisson=poisson, groups=groups, density=3.0, **options)


def held(body):
    return {f"low {k}": "xyz"[k] for k in range(body.dim)}


@pytest.mark.parametrize("solid", [False, True])
@pytest.mark.parametrize("kind", FLAT + SOLID)
def test_a_uniform_traction_makes_a_uniform_stress(kind, solid):
    options = {} if kind in SOLID else {"plane": "stress", "thickness": 0.3}
    body = made(kind, solid, 0.3, **options)
    pull = (100.0, 0.0, 0.0)[: body.dim]
    force = loads(body, traction={"high 0": pull})
    area = 0.5 * (0.8 if body.dim == 3 else 0.3)
    assert force.sum(axis=0) == pytest.approx(np.array(pull) * area, rel=1e-12)
    stress = body.stress(body.solve(held(body), force.ravel()))[kind]
    assert stress[:, 0] == pytest.approx(100.0, rel=1e-9)
    assert np.abs(stress[:, 1:]).max() < 1e-9 * 100.0


@pytest.mark.parametrize("kind", FLAT)
def test_round_an_axis_it_is_that_of_the_ring(kind):
    body = made(kind, shift=1.0, plane="axisymmetric")
    push = loads(body, traction={"high 1": (0.0, -100.0)}).sum(axis=0)
    assert push == pytest.approx([0.0, -100.0 * np.pi * (3.0**2 - 1.0**2)], rel=1e-12)
    stress = body.stress(body.solve({"low 1": "y"}, loads(body, traction={"high 1": (0.0, -100.0)}).ravel()))[kind]
    assert stress[:, 1] == pytest.approx(-100.0, rel=1e-9)
    weight = loads(body, body_force=(0.0, -7.0)).sum(axis=0)
    assert weight == pytest.approx([0.0, -7.0 * np.pi * (3.0**2 - 1.0**2) * 0.5], rel=1e-12)


@pytest.mark.parametrize("solid", [False, True])
@pytest.mark.parametrize("kind", FLAT + SOLID)
def test_a_bar_under_its_weight_is_a_parabola(kind, solid):
    """u = f (L x - x2 / 2) / E, which cells of second order have, and those of first order at their nodes if they are boxes."""
    body = made(kind, solid, **({} if kind in SOLID else {"thickness": 0.3}))
    pull = (50.0, 0.0, 0.0)[: body.dim]
    force = loads(body, body_force=pull)
    area = 0.5 * (0.8 if body.dim == 3 else 0.3)
    assert force.sum(axis=0) == pytest.approx(np.array(pull) * 2.0 * area, rel=1e-12)
    assert force == pytest.approx(loads(body, body_force=lambda t: pull), rel=1e-12)
    x = body.points[:, 0]
    if kind not in ("triangle", "tetra"):
        u = body.solve(held(body), force.ravel())
        assert u[:, 0] == pytest.approx(50.0 * (2.0 * x - x**2 / 2) / 1e5, rel=1e-9)


def test_it_is_the_gravity_of_a_density():
    body = made("quad8")
    weight = (body.M @ np.tile([0.0, -9.81], len(body.points))).reshape(-1, 2)
    scale = np.abs(weight).max()
    assert np.abs(loads(body, body_force=(0.0, -9.81 * 3.0)) - weight).max() < 1e-12 * scale


@pytest.mark.parametrize("solid", [False, True])
def test_they_change_with_time_and_live_in_files(solid, tmp_path):
    body = made("quad8", solid)
    rise = cn.Table([0.0, 0.1], [[0.0, 0.0], [10.0, -4.0]])
    scene = cn.Scene(2, gravity=(0.0, 0.0))
    scene.add(cn.deformable(body, SKIN, traction={"high 0": rise}, body_force=cn.Table([0.0, 1.0], [[0.0, 0.0], [0.0, 1.0]])))
    scene.save(tmp_path / "loaded.h5")
    found = []
    for of in (scene, cn.Scene.load(tmp_path / "loaded.h5")):
        sim = cn.Simulation(of, 0.01)
        assert sim.meshes[0].load(0.05).sum(axis=0) == pytest.approx([2.5, -1.0 + 0.05], rel=1e-12)
        sim.run(steps=10, progress=False)
        momentum = (body.M @ sim.meshes[0].velocity.ravel()).reshape(-1, 2).sum(axis=0)
        assert momentum == pytest.approx([0.25, -0.1 + 0.005], rel=1e-9)  # of a load that grows evenly
        found.append(sim.meshes[0].velocity)
    assert np.array_equal(*found)


def test_a_linear_body_with_sides_bears_tractions_and_one_without_cells_no_body_force():
    whole = made("quad", solid=False, thickness=0.3)
    options = {"groups": whole.groups, "edges": whole.boundary_edges()}
    body = cn.LinearBody(whole.points, whole.M, whole.K, **options)
    given = {"traction": {"high 0": (1.0, 2.0)}}
    assert loads(body, **given) * 0.3 == pytest.approx(loads(whole, **given), rel=1e-12)  # no thickness is known of it
    with pytest.raises(ValueError, match="body_force: the cells of a LinearBody are not known"):
        cn.deformable(body, SKIN, body_force=(0.0, 1.0))
    bare = cn.LinearBody(whole.points, whole.M, whole.K, groups=whole.groups)
    with pytest.raises(ValueError, match=r"give edges=\(m, 2\) to LinearBody"):
        cn.deformable(bare, SKIN, **given)


def test_what_cannot_be_loaded_is_told():
    body = made("quad")
    for given, told in (
        ({"traction": {"high 0": 5.0}}, r"traction on 'high 0' has shape \(\)"),
        ({"traction": (1.0, 0.0)}, r"traction is \(1.0, 0.0\): give {group: \(2,\)}"),
        ({"traction": {"low 0": (1.0, np.nan)}}, "traction on 'low 0'"),
        ({"traction": {"nowhere": (1.0, 0.0)}}, "there is no group 'nowhere'"),
        ({"body_force": (1.0, 0.0, 0.0)}, r"body_force has shape \(3,\)"),
    ):
        with pytest.raises(ValueError, match=told):
            cn.deformable(body, SKIN, **given)
    inner = np.flatnonzero((body.points[:, 0] > 0) & (body.points[:, 0] < 2))
    with pytest.raises(ValueError, match="traction on .*: no edge of the boundary has all its nodes in it"):
        cn.deformable(body, SKIN, traction={tuple(inner[:1].tolist()): (1.0, 0.0)})
    frame = cn.bars([[0.0, 0.0], [1.0, 0.0]], [[0, 1]], young=1.0, area=1.0, density=1.0)
    for given, told in (
        ({"traction": {(0, 1): (1.0, 0.0)}}, "of bars or beams has no sides"),
        ({"body_force": (1.0, 0.0)}, "the cells of a .* are not known"),
    ):
        with pytest.raises(ValueError, match=told):
            cn.deformable(frame, SKIN, **given)
