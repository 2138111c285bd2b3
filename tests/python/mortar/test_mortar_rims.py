"""Mortar contact that is asked for all round: sides that face each other through both bodies do not meet."""

import cairn as cn
import numpy as np
import pytest
from second_order import CELLS, box

ROCK = cn.Material("rock", density=1000.0)


@pytest.mark.parametrize("both", [False, True])
@pytest.mark.parametrize("kind", ["quad", "triangle6", "hexahedron"])
def test_blocks_that_hit_each_other_with_all_their_sides(kind, both):
    dim = 2 if kind in CELLS[2] else 3
    scene = cn.Scene(dim)
    for k, corner in enumerate(([0.0] * dim, [0.03] * (dim - 1) + [1.002])):
        points, cells = box(kind, (4,) * dim, (1.0,) * dim)
        out = np.flatnonzero(((points == 0) | (points == 1)).any(axis=1))
        body = cn.ElasticBody(points + corner, cells, young=1e6, poisson=0.3, density=1000.0, groups={"out": out})
        velocity = (*[0.0] * (dim - 1), -1.0 * k)
        asks = {"contact": "out", "mortar": True} if both or k else {}
        scene.add(cn.deformable(body, ROCK, velocity=velocity, **{"edges" if dim == 2 else "faces": "out"}, **asks))
    scene.interact("*", "*", cn.Coulomb(mu=0.0))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(solver=cn.PPANewton(tol=1e-10)))
    met = 0
    for _ in range(20):
        sim.step()
        met = max(met, len(sim.contacts))
        assert len(sim.contacts) == 0 or sim.contacts.gap.min() > -0.01
    assert met >= 4
    below, above = (mesh.points if hasattr(mesh, "points") else mesh.body.points + mesh.displacement for mesh in sim.meshes)
    lowest = above[np.isclose(sim.meshes[1].body.points[:, -1], 1.002), -1].min()
    highest = below[np.isclose(sim.meshes[0].body.points[:, -1], 1), -1].max()
    assert highest - lowest < 0.01
