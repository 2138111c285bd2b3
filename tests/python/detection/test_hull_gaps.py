"""Gaps of polygons and polyhedra to round bodies, half spaces and tubes, against plain loops over sides, faces and corners."""

import cairn as cn
import numpy as np
import pytest
from shape_pairs import ROCK, random_polyhedron, random_rotation
from test_polygon_contacts import random_polygon, turned

WALL = cn.Material("wall", density=1000.0)


def contacts(bodies, others, margin=2.0):
    """Contacts between bodies of two materials, k-th with k-th or all with a single body: (gap, normal out of the other,
    point)."""
    dim = 2 if bodies[0].position.shape[1] == 2 else 3
    scene = cn.Scene(dim)
    scene.add(*bodies, *others)
    scene.interact(ROCK, ROCK, None)
    scene.interact(WALL, WALL, None)
    scene.interact(ROCK, WALL, cn.Coulomb(mu=0.0))
    sim = cn.Simulation(scene, dt=1e-12, strategy=cn.NSCD(margin=margin), overlap="ignore")
    sim.step()
    c, count = sim.contacts, len(bodies)
    sign = np.where(c.bodies[:, 0] < count, 1.0, -1.0)[:, None]
    one, two = np.min(c.bodies, axis=1), np.max(c.bodies, axis=1)
    mine = (two == one + count) | (len(others) == 1)
    return [(c.gap[mine & (one == k)], (sign * c.normal)[mine & (one == k)], c.point[mine & (one == k)]) for k in range(count)]


def polygon_distance(x, p):
    """Signed distance of a point from a polygon, negative inside, by all sides."""
    edge = np.roll(p, -1, axis=0) - p
    out = np.stack([edge[:, 1], -edge[:, 0]], axis=1) / np.linalg.norm(edge, axis=1)[:, None]
    height = np.einsum("ij,ij->i", x - p, out)
    along = np.clip(np.einsum("ij,ij->i", x - p, edge) / np.einsum("ij,ij->i", edge, edge), 0, 1)
    return height.max() if height.max() < 0 else np.linalg.norm(x - p - along[:, None] * edge, axis=1).min()


def triangle_distance(x, a, b, c):
    """Distance of a point from a triangle, by least squares within it and within each side."""
    best = np.inf
    for corners in ((a, b, c), (a, b), (b, c), (c, a), (a,), (b,), (c,)):
        base, sides = corners[0], np.array([k - corners[0] for k in corners[1:]]).reshape(-1, 3)
        share = np.linalg.lstsq(sides.T, x - base, rcond=None)[0] if len(sides) else np.zeros(0)
        if np.all(share >= 0) and share.sum() <= 1:
            best = min(best, np.linalg.norm(x - base - share @ sides))
    return best


def polyhedron_distance(x, v, faces):
    """Less than 0 inside: by all faces."""
    a, b, c = (v[faces[:, k]] for k in range(3))
    out = np.cross(b - a, c - a)
    height = np.einsum("ij,ij->i", x - a, out) / np.linalg.norm(out, axis=1)
    return height.max() if height.max() < 0 else min(triangle_distance(x, *v[f]) for f in faces)


def nearest(found, expected, scale=1e-11):
    """Least gaps, where they are within the margin."""
    near = expected < 1.9
    assert near.sum() > 20 and (expected[near] < 0).sum() > 3
    got = np.array([gap.min() if len(gap) else np.inf for gap, _, _ in found])
    np.testing.assert_allclose(got[near], expected[near], rtol=0, atol=scale)


@pytest.mark.parametrize("corners", [3, 7])
def test_disks_and_polygons(corners):
    rng, disks, polygons, expected = np.random.default_rng(corners), [], [], []
    for k in range(40):
        p = turned(random_polygon(rng, corners), rng.uniform(0, 7), (9.0 * k, 0))
        x, r = np.array([9.0 * k, 0]) + rng.uniform(-2, 2, 2), rng.uniform(0.1, 0.6)
        disks.append(cn.disks([x], r, ROCK))
        polygons.append(cn.polygons([p], WALL))
        expected.append(polygon_distance(x, p) - r)
    found = contacts(disks, polygons)
    nearest(found, np.array(expected))
    for (gap, normal, point), disk in zip(found, disks):
        if len(gap):  # the disk's surface is where the normal leads to from its centre
            reach = disk.position[0] - (expected_radius(disk) + gap[0] / 2) * normal[0]
            np.testing.assert_allclose(point[0], reach, rtol=0, atol=1e-10)


def expected_radius(one):
    return one.contactors[0].radius[0]


@pytest.mark.parametrize("dim", [2, 3])
def test_corners_before_a_half_space(dim):
    """The lowest corner has the least gap; all points that are told lie half of their gap before the plane."""
    rng, bodies, least = np.random.default_rng(dim), [], []
    for k in range(40):
        place = np.array([9.0 * k, rng.uniform(-0.5, 2.5), 0])[:dim]
        if dim == 2:
            corners = turned(random_polygon(rng, 5), rng.uniform(0, 7), place)
            bodies.append(cn.polygons([corners], ROCK))
        else:
            v, faces = random_polyhedron(rng)
            corners = v @ random_rotation(rng).T + place
            bodies.append(cn.polyhedra([(corners, faces)], ROCK))
        least.append(corners[:, 1].min())
    up = np.eye(dim)[1]
    found = contacts(bodies, [cn.wall(0 * up, up, WALL)])
    nearest(found, np.array(least))
    for gap, normal, point in found:
        np.testing.assert_allclose(normal, np.broadcast_to(up, normal.shape), rtol=0, atol=1e-14)
        np.testing.assert_allclose(point[:, 1], gap / 2, rtol=0, atol=1e-11)


def test_spheres_and_polyhedra():
    rng, spheres, stones, expected = np.random.default_rng(4), [], [], []
    for k in range(40):
        v, faces = random_polyhedron(rng)
        v = v @ random_rotation(rng).T + [9.0 * k, 0, 0]
        x, r = np.array([9.0 * k, 0, 0]) + rng.uniform(-1.3, 1.3, 3), rng.uniform(0.1, 0.6)
        spheres.append(cn.spheres([x], r, ROCK))
        stones.append(cn.polyhedra([(v, faces)], WALL))
        expected.append(polyhedron_distance(x, v, faces) - r)
    nearest(contacts(spheres, stones), np.array(expected))


def test_polyhedra_in_a_tube():
    """Gap of every corner to the wall, each once."""
    rng, stones, gaps = np.random.default_rng(6), [], []
    for k in range(40):
        v, faces = random_polyhedron(rng)
        v = 0.6 * v @ random_rotation(rng).T + [3.0 * k, *rng.uniform(-1.2, 1.2, 2)]
        stones.append(cn.polyhedra([(v, faces)], ROCK))
        gaps.append(2.0 - np.hypot(v[:, 1], v[:, 2]))
    found = contacts(stones, [cn.tube((0, 0, 0), (1, 0, 0), 2.0, WALL)], margin=0.5)
    seen = 0
    for (gap, normal, point), known in zip(found, gaps):
        seen += len(gap)
        if known.min() < 0.45:
            assert gap.min() == pytest.approx(known.min(), abs=1e-11)
        assert all(np.abs(known - g).min() < 1e-11 for g in gap)
        inward = -point[:, 1:] / np.linalg.norm(point[:, 1:], axis=1)[:, None]
        np.testing.assert_allclose(normal[:, 1:], inward, rtol=0, atol=1e-9)
    assert seen > 20
