"""Mortars of meshes in a periodic cell: a block that slides on another across the end of the cell goes on as on an open floor."""

import cairn as cn
import numpy as np
import pytest
from second_order import box

ROCK = cn.Material("rock", density=1000.0)


def slid(kind, dim, periodic, steps=60):
    """Displacements and velocities of an upper block that slides on a lower one; both begin near the end of the cell."""
    up, sides = dim - 1, "edges" if dim == 2 else "faces"
    cell = {"periodic": cn.Periodic((1.0, *[np.inf] * (dim - 1)))} if periodic else {}
    scene = cn.Scene(dim, gravity=(0.0,) * up + (-9.81,), **cell)
    scene.add(cn.wall((0.0,) * dim, (0.0,) * up + (1.0,), ROCK))
    for i in range(2):
        count = (4 + i, 2) if dim == 2 else (3 + i, 2, 1)
        points, cells = box(kind, count, (0.3, 0.1) if dim == 2 else (0.3, 0.2, 0.1))
        points = points + [0.84, *[0.0] * (dim - 2), 0.1 * i]
        groups = {"low": np.flatnonzero(np.abs(points[:, up] - 0.1 * i) < 1e-9)}
        groups["high"] = np.flatnonzero(np.abs(points[:, up] - 0.1 * (i + 1)) < 1e-9)
        body = cn.ElasticBody(points, cells, young=1e6, poisson=0.3, density=1000.0, groups=groups, rayleigh=(0.0, 1e-3))
        touches = {sides: ["low", "high"] if i == 0 else "low"}
        scene.add(cn.deformable(body, ROCK, contact="low", mortar=i == 1, velocity=(1.0 * i, *[0.0] * up), **touches))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(solver=cn.Default(tol=1e-12)))
    for _ in range(steps):
        assert sim.step()["status"] == "converged"
    # what crossed the end of the cell stands a cell's length back
    return [np.concatenate([np.sin(2 * np.pi * m.displacement), m.velocity]) for m in sim.meshes]


@pytest.mark.parametrize("kind, dim", [("quad", 2), ("quad9", 2), ("triangle6", 2), ("hexahedron", 3), ("tetra10", 3)])
def test_mortars_go_on_across_the_end_of_a_cell(kind, dim):
    inside, across = slid(kind, dim, False), slid(kind, dim, True)
    for one, other in zip(inside, across):
        assert np.abs(one - other).max() < 1e-8
