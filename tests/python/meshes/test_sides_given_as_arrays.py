"""Edges and faces that are given as arrays of nodes face outwards, however they were counted: the cells know where outside is."""

import cairn as cn
import numpy as np
import pytest
from cairn.model.mesh_faces import outwards
from second_order import box

KINDS = {2: ("triangle", "quad", "quad8"), 3: ("tetra", "hexahedron", "tetra10")}


def bodies(dim):
    for kind in KINDS[dim]:
        points, cells = box(kind, (2,) * dim, (1.0,) * dim)
        yield kind, cn.ElasticBody(points, cells, young=1e7, poisson=0.3, density=1000.0)


@pytest.mark.parametrize("dim", [2, 3])
def test_sides_are_turned_outwards(dim):
    for kind, body in bodies(dim):
        own = body.boundary_edges() if dim == 2 else body.boundary_faces()
        given = own.copy()
        for k in range(0, len(given), 2):
            count = int((given[k] >= 0).sum())
            given[k, :count] = np.roll(given[k, :count][::-1], k)
        assert not np.array_equal(given, own)
        found = outwards(body, given)
        for side, right in zip(found.tolist(), own.tolist(), strict=True):
            side, right = [n for n in side if n >= 0], [n for n in right if n >= 0]
            first = side.index(right[0])
            assert side[first:] + side[:first] == right, kind
        assert np.array_equal(outwards(body, own), own)


def test_sides_that_bound_no_cell_are_left():
    _, body = next(bodies(2))
    inner = np.array([[0, len(body.points) - 1]])
    assert np.array_equal(outwards(body, inner), inner)
    bare = cn.LinearBody(body.points, body.M, body.K)
    own = body.boundary_edges()[:, ::-1]
    assert np.array_equal(outwards(bare, own), own)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("reverse", [False, True])
def test_a_ball_rests_on_sides_counted_either_way(dim, reverse):
    body = dict(bodies(dim))["quad" if dim == 2 else "hexahedron"]
    sides = body.boundary_edges() if dim == 2 else body.boundary_faces()
    top = np.isin(sides, np.flatnonzero(np.isclose(body.points[:, -1], 1))).all(axis=1)
    sides = sides[top][:, ::-1] if reverse else sides[top]
    stone = cn.Material("stone", density=1000.0)
    scene = cn.Scene(dim, gravity=(0,) * (dim - 1) + (-9.81,))
    foot = np.flatnonzero(body.points[:, -1] == 0)
    held = cn.ElasticBody(body.points, body.cells, young=1e7, poisson=0.3, density=1000.0, groups={"foot": foot})
    scene.add(cn.deformable(held, stone, fixed={"foot": "xyz"[:dim]}, **{"edges" if dim == 2 else "faces": sides}))
    place = [0.43] * (dim - 1) + [1.101]
    scene.add(cn.disks([place], 0.1, stone) if dim == 2 else cn.spheres([place], 0.1, stone))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 1e-3)
    for _ in range(100):
        sim.step()
    assert sim.bodies.position[-1, -1] > 1.09
