"""Bodies cut into convex parts: all of the body, nothing twice, each part convex; and bodies of a heap of triangles."""

import cairn as cn
import numpy as np
import pytest
from cairn.pre import convex_parts, masonry, mass_properties, mesh
from cairn.pre.block_overlaps import overlaps
from cairn.pre.blocks import Blocks
from cairn.pre.solids import solids
from shape_pairs import ROCK, L, prism, random_rotation

U = [[0, 0], [3, 0], [3, 2], [2, 2], [2, 1], [1, 1], [1, 2], [0, 2]]
T = [[0, 0], [1, 0], [1, 2], [2, 2], [2, 3], [-1, 3], [-1, 2], [0, 2]]
STAR = [[(1.0 if k % 2 else 0.4) * f(np.pi * k / 5) for f in (np.cos, np.sin)] for k in range(10)]


@pytest.mark.parametrize("outline, most", [(L, 2), (U, 3), (T, 2), (STAR, 6), (L[::-1], 2), (L[:3], 1)])
@pytest.mark.parametrize("scale, shift", [(1.0, 0.0), (2.0**-20, 0.0), (1.0, 2.0**20)])
def test_polygons(outline, most, scale, shift):
    corners = scale * (np.array(outline) + shift)
    parts = convex_parts(corners)
    assert len(parts) <= most
    a, b = corners - corners[0], np.roll(corners, -1, axis=0) - corners[0]
    area = abs(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])) / 2
    assert mass_properties.polygons(parts).measure.sum() == pytest.approx(area, rel=1e-12 if shift == 0 else 1e-8)
    cn.Scene(2).add(cn.polygons([parts], ROCK))  # raises for parts that are not convex
    blocks = Blocks(2)
    for p in parts:
        blocks.add(p)
    assert len(parts) == 1 or len(overlaps(blocks)[0]) == 0


@pytest.mark.parametrize("outline, most", [(L, 2), (U, 3), (T, 3), (STAR, 6)])
def test_polyhedra(outline, most):
    vertices, faces = prism(outline, 1.5)
    vertices = vertices @ random_rotation(np.random.default_rng(1)).T + [5, -3, 2]
    parts = convex_parts(vertices, faces)
    assert len(parts) <= most
    whole = mass_properties.polyhedra([vertices], [faces])
    body = cn.polyhedra([parts], ROCK)
    cn.Scene(3).add(body)
    assert body.mass[0] == pytest.approx(1000 * whole.measure[0], rel=1e-12)
    np.testing.assert_allclose(body.position, whole.center, rtol=1e-12)
    np.testing.assert_allclose(np.sort(body.inertia), np.sort(1000 * whole.moments), rtol=1e-12)


def test_a_ring_is_cut_and_a_finer_one_is_too_much():
    trimesh = pytest.importorskip("trimesh")
    ring = trimesh.creation.torus(1, 0.3, major_sections=8, minor_sections=5)
    parts = convex_parts(ring.vertices, ring.faces)
    assert mass_properties.polyhedra(*map(list, zip(*parts))).measure.sum() == pytest.approx(ring.volume, rel=1e-12)
    with pytest.raises(ValueError, match="more than 10 cells"):
        convex_parts(ring.vertices, ring.faces, most=10)
    wavy = trimesh.creation.icosphere(6)
    wavy.vertices *= 1 + 0.05 * np.sin(20 * wavy.vertices[:, :1])
    with pytest.raises(ValueError, match="more than 256 cells"):
        convex_parts(wavy.vertices, wavy.faces)
    with pytest.raises(mesh.MeshError, match="open"):
        convex_parts(ring.vertices, ring.faces[1:])
    with pytest.raises(mesh.MeshError, match="crosses itself"):
        convex_parts([[0, 0], [2, 0], [0, 1], [2, 1.5], [3, 3]])


@pytest.mark.parametrize(
    "blocks",
    [
        masonry.wall(2.2, 6, bond="stack"),
        masonry.dome(3.0, 0.4, 4, 12),
        masonry.voronoi((0, 0, 0), (1, 1, 1), 30, np.random.default_rng(1)),
        masonry.arch(span=4.0, thickness=0.5, voussoirs=9, depth=1.0),
    ],
)
def test_blocks_that_share_corners_come_apart(blocks):
    points, fans, count = [], [], 0
    for v, f in zip(blocks.vertices, blocks.faces):
        points.append(v)
        fans.append(mass_properties.triangles(f, len(v)) + count)
        count += len(v)
    vertices, faces = mesh.weld(np.concatenate(points), np.concatenate(fans))
    assert len(vertices) < count
    for order in (np.arange(len(faces)), np.random.default_rng(1).permutation(len(faces))):  # block after block, or mixed
        found = solids(vertices, faces[order])
        assert len(found) == len(blocks)
        volumes = [mesh.check(*s).volume for s in found]
        np.testing.assert_allclose(np.sort(volumes), np.sort(blocks.properties().measure), rtol=1e-12)
    with pytest.raises(mesh.MeshError, match="inside out"):
        mesh.check(*solids(vertices, faces[:, ::-1])[0])
