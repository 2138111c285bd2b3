"""Compliance of a mesh does not depend on the order in which contacts reach its nodes."""

import cairn as cn
import numpy as np
import pytest
from second_order import grid

STONE = cn.Material("stone", density=2000.0)
CELLS = {2: (40, 40), 3: (9, 9, 9)}  # by columns of factors; by blocks of columns, which only large or solid meshes have


def rolled_over(dim, body_of):
    """A block on a plane, over whose top a ball slides: it comes to new nodes all the time."""
    points, cells = grid(CELLS[dim])
    body, up = body_of(points, cells), np.eye(dim)[-1]
    bottom, top = (np.flatnonzero(np.isclose(points[:, -1], z)) for z in (0.0, 1.0))
    faces = body.boundary_edges() if dim == 2 else body.boundary_faces()
    upper = {("edges" if dim == 2 else "faces"): faces[(np.isin(faces, top) | (faces < 0)).all(axis=1)]}
    scene = cn.Scene(dim, gravity=-9.81 * up)
    scene.add(cn.deformable(body, STONE, contact=bottom, name="block", **upper), cn.wall(np.zeros(dim), up, STONE))
    ball, middle = (cn.disks, [0.1, 1.0795]) if dim == 2 else (cn.spheres, [0.1, 0.5, 1.0795])
    scene.add(ball([middle], 0.08, STONE, velocity=[8.0 * np.eye(dim)[0] - 0.5 * up]))
    scene.interact(STONE, STONE, cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, 1e-3, cn.NSCD(solver=cn.Default(tol=1e-6, max_iter=2000)), overlap="ignore")


def elastic(points, cells):
    return cn.ElasticBody(points, cells, young=1e7, poisson=0.3, density=2000.0, rayleigh=(0.0, 1e-3))


def solid(points, cells):
    return cn.SolidBody(points, cells, cn.IsotropicElastic(young=1e7, poisson=0.3), density=2000.0, kinematics="small")


@pytest.mark.parametrize("body_of", [elastic, solid])
@pytest.mark.parametrize("dim", [2, 3])
def test_a_run_that_was_saved_goes_on_to_the_same_bits(tmp_path, dim, body_of):
    one, two = rolled_over(dim, body_of), rolled_over(dim, body_of)
    for _ in range(30):
        one.step()
    one.checkpoint(tmp_path / "state.h5")
    two.restore(tmp_path / "state.h5")
    for _ in range(30):
        one.step()
        two.step()
    for name in ("position", "velocity"):
        assert np.array_equal(getattr(one.meshes[0], name), getattr(two.meshes[0], name)), name
