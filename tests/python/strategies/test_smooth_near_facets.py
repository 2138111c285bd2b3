"""Triangles that smooth DEM leaves out before the narrow phase have no contact: all searches find the same ones."""

import cairn as cn
import numpy as np
import pytest


def rough(rng, cells, size):
    """Vertices and triangles of a random surface over a square, slivers among them."""
    x, y = np.meshgrid(np.linspace(0, size, cells + 1), np.linspace(0, size, cells + 1), indexing="ij")
    inner = np.zeros_like(x)
    inner[1:-1, 1:-1] = 1
    x, y = (a + inner * rng.uniform(-0.45, 0.45, a.shape) * size / cells for a in (x, y))
    z = rng.uniform(-0.4, 0.4, x.shape) * size / cells
    vertices = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    n, corner = cells + 1, np.arange((cells + 1) ** 2).reshape(cells + 1, -1)[:-1, :-1].ravel()
    return vertices, np.concatenate([np.column_stack([corner, corner + n, corner + 1]),
                                     np.column_stack([corner + n, corner + n + 1, corner + 1])])  # fmt: skip


def found(scene, strategy, law, radii):
    """(bodies, gaps) of all contacts that touch, in order, less those of centres that are a radius behind a triangle."""
    scene.interact("*", "*", law)
    simulation = cn.Simulation(scene, 1e-9, strategy)
    simulation.step()
    contacts = simulation.contacts
    gap, pairs = np.asarray(contacts.gap), np.asarray(contacts.bodies)
    touch = (gap < 0) & (gap > -1.99 * radii[pairs[:, 0] - 1])
    order = np.lexsort(np.column_stack([pairs[touch], gap[touch]]).T[::-1])
    return pairs[touch][order], gap[touch][order]


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("shift", [0.0, 1e6])
def test_all_searches_find_the_same_contacts_of_balls_and_triangles(seed, shift):
    rng = np.random.default_rng(seed)
    vertices, faces = rough(rng, 8, 1.0)
    centres = np.column_stack([rng.uniform(-0.05, 1.05, (400, 2)), rng.uniform(-0.1, 0.15, 400)])
    radii = rng.uniform(0.005, 0.09, 400)

    def scene():
        made, balls, ground = cn.Scene(3, origin=(shift, 0, 0)), cn.Material("balls", density=1e3), cn.Material("ground")
        made.add(cn.surface(vertices + [shift, 0, 0], faces, ground))
        made.add(cn.spheres(centres + [shift, 0, 0], radii, balls))
        made.interact(balls, balls, None)
        return made

    smooth = found(scene(), cn.SmoothDEM(), cn.LinearSpring(stiffness=1e3, restitution=0.5, mu=0.0), radii)
    rigid = found(scene(), cn.NSCD(), cn.Frictionless(), radii)
    assert len(smooth[0]) > 150
    assert np.array_equal(smooth[0], rigid[0])
    assert np.allclose(smooth[1], rigid[1], rtol=0, atol=1e-7)
