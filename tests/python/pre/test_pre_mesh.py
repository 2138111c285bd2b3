"""Bad meshes are refused by name, good meshes are measured, and faults are repaired where possible."""

import time

import numpy as np
import pytest
from cairn.pre import box_pairs, mesh

CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
SIDES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
TRIANGLES = np.array([t for f in SIDES for t in ([f[0], f[1], f[2]], [f[0], f[2], f[3]])])


def sphere(n, m):
    """A sphere of n meridians and m rings."""
    polar, around = np.linspace(0, np.pi, m + 2)[1:-1], 2 * np.pi * np.arange(n) / n
    rings = np.stack(np.broadcast_arrays(
        np.sin(polar)[:, None] * np.cos(around), np.sin(polar)[:, None] * np.sin(around), np.cos(polar)[:, None]
    ), axis=-1)
    points = np.concatenate([rings.reshape(-1, 3), [[0, 0, 1], [0, 0, -1]]])
    i, j = np.meshgrid(np.arange(m - 1), np.arange(n), indexing="ij")
    a, b, c, d = i * n + j, i * n + (j + 1) % n, (i + 1) * n + j, (i + 1) * n + (j + 1) % n
    k = np.arange(n)
    faces = [np.stack((a, c, b), -1).reshape(-1, 3), np.stack((b, c, d), -1).reshape(-1, 3)]
    faces += [np.stack((k, (k + 1) % n, 0 * k + m * n), -1)]
    faces += [np.stack(((m - 1) * n + (k + 1) % n, (m - 1) * n + k, 0 * k + m * n + 1), -1)]
    return points, np.concatenate(faces)


def fault(vertices, faces):
    with pytest.raises(mesh.MeshError) as error:
        mesh.check(vertices, faces, "stone")
    assert str(error.value).startswith("stone")
    return error.value.fault


def test_good_meshes():
    report = mesh.check(CUBE * 2, TRIANGLES)
    assert report.volume == pytest.approx(8) and report.area == pytest.approx(24)
    assert report.smallest_edge == 2 and report.convex and "closed surface" in str(report)
    assert mesh.check(CUBE, SIDES).volume == pytest.approx(1)
    ring = torus()
    assert mesh.check(*ring).volume == pytest.approx(2 * np.pi**2 * 3 * 1, rel=0.02)
    assert not mesh.check(*ring).convex


def torus(n=60, m=40, big=3.0, small=1.0):
    u, v = np.meshgrid(2 * np.pi * np.arange(n) / n, 2 * np.pi * np.arange(m) / m, indexing="ij")
    r = big + small * np.cos(v)
    points = np.stack((r * np.cos(u), r * np.sin(u), small * np.sin(v)), -1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
    a, b = i * m + j, (i + 1) % n * m + j
    c, d = i * m + (j + 1) % m, (i + 1) % n * m + (j + 1) % m
    return points, np.concatenate([np.stack((a, b, d), -1).reshape(-1, 3), np.stack((a, d, c), -1).reshape(-1, 3)])


def test_every_fault_has_its_name():
    assert fault(CUBE, TRIANGLES[:-1]) == "open"
    assert fault(CUBE, TRIANGLES[:, ::-1]) == "inside out"
    flipped = TRIANGLES.copy()
    flipped[4] = flipped[4, ::-1]
    assert fault(CUBE, flipped) == "folded"
    assert fault(CUBE, np.concatenate([TRIANGLES, [[0, 0, 1]]])) == "flat triangle"
    assert fault(CUBE * (1, 1, 0), TRIANGLES) in ("flat", "flat triangle")
    assert fault(*torus(big=0.5)) == "crossing"
    joined = np.concatenate([TRIANGLES, TRIANGLES + 8])
    both = np.concatenate([CUBE, CUBE - 1.0])
    assert fault(*mesh.weld(both, joined)) == "pinched"
    assert fault(np.concatenate([CUBE, CUBE + 0.5]), joined) == "crossing"
    bad = CUBE.copy()
    bad[3, 1] = np.nan
    with pytest.raises(ValueError, match=r"stone: vertices\[3, 1\] is nan"):
        mesh.check(bad, TRIANGLES, "stone")
    with pytest.raises(ValueError, match="names vertex 9"):
        mesh.check(CUBE, [[0, 1, 9]], "stone")


def test_pentagram_pyramid_crosses_itself():
    """All its volumes are positive and its edges bend inward: only the winding betrays it."""
    angle = 2 * np.pi * 2 * np.arange(5) / 5
    base = np.column_stack((np.cos(angle), np.sin(angle), np.zeros(5)))
    points = np.concatenate([base, [[0, 0, 1], [0, 0, -1]]])
    faces = [[k, (k + 1) % 5, 5] for k in range(5)] + [[(k + 1) % 5, k, 6] for k in range(5)]
    assert fault(points, faces) == "crossing"


def test_polygons():
    square = [[0, 0], [1, 0], [1, 1], [0, 1]]
    assert len(mesh.check_polygon(square)) == 4
    for corners, word in ((square[::-1], "inside out"), ([[0, 0], [2, 0], [2, 2], [1, -1], [0, 2]], "crossing"),
                          ([[0, 0], [1, 1], [2, 2]], "flat"), ([*square, [0, 1]], "flat")):
        with pytest.raises(mesh.MeshError) as error:
            mesh.check_polygon(corners)
        assert error.value.fault == word


def volume_of(vertices, faces):
    x = vertices[faces]
    return float(np.linalg.det(x - vertices[0]).sum() / 6)


def test_repair_closes_holes_and_turns_faces():
    """Missing and turned faces at random, a whole cap of 24 corners, holes that meet at a corner, a cavity."""
    points, faces = sphere(24, 11)
    rng = np.random.default_rng(3)
    whole = volume_of(points, faces)
    for missing in (1, 20, 60):
        kept = np.delete(faces, rng.choice(len(faces), missing, replace=False), axis=0)
        turned = rng.random(len(kept)) < 0.4
        vertices, mended, done = mesh.repair(points, np.where(turned[:, None], kept[:, ::-1], kept))
        assert mesh.check(vertices, mended).volume == pytest.approx(whole, rel=0.02)
        assert any("hole" in words for words in done) and any("turned" in words for words in done)
    cut = faces[(points[faces][:, :, 2] < 0.5 + 1e-12).all(axis=1)]  # above 60 degrees there is nothing
    vertices, mended, done = mesh.repair(points, cut)
    assert done == ["closed 1 hole, the largest of 24 edges"] and mesh.check(vertices, mended).volume < whole
    assert np.all(vertices[mended[len(cut) :]][..., 2] == vertices[:, 2].max())  # the lid is flat
    outer = np.concatenate([CUBE * 4 - 1.5, CUBE]), np.concatenate([TRIANGLES, TRIANGLES + 8])
    vertices, mended, done = mesh.repair(*outer)
    assert mesh.check(vertices, mended).volume == pytest.approx(63) and done == ["turned 12 of 24 faces"]


def test_repair():
    soup, triangles = CUBE[TRIANGLES].reshape(-1, 3), np.arange(36).reshape(-1, 3)
    triangles[5] = triangles[5, ::-1]
    assert fault(soup, triangles) == "open"
    vertices, faces, done = mesh.repair(soup, triangles[1:])
    assert mesh.check(vertices, faces).volume == pytest.approx(1)
    assert any("hole" in word for word in done)
    with pytest.raises(mesh.MeshError):
        mesh.repair(CUBE, TRIANGLES[:4])


def test_a_million_faces_take_seconds():
    points, faces = sphere(1000, 500)
    assert len(faces) == 1_000_000
    start = time.process_time()
    report = mesh.check(points, faces)
    seconds = time.process_time() - start
    print(f"1e6 faces checked in {seconds:.1f} s")
    assert report.convex and report.volume == pytest.approx(4 / 3 * np.pi, rel=1e-4)
    assert fault(points, np.delete(faces, 777_777, axis=0)) == "open"


def test_box_pairs_against_all_pairs():
    rng = np.random.default_rng(4)
    for dim in (2, 3):
        for n in (1, 2, 3, 7, 300):
            low = rng.uniform(size=(n, dim))
            high = low + 10.0 ** rng.uniform(-3, -0.3, (n, 1)) * rng.uniform(size=(n, dim))
            i, j = np.triu_indices(n, 1)
            meet = np.all((low[i] <= high[j]) & (low[j] <= high[i]), axis=1)
            assert np.array_equal(box_pairs.overlapping_pairs(low, high), np.column_stack((i, j))[meet])


def test_weld_and_parts():
    soup, triangles = np.concatenate([CUBE, CUBE + 3])[np.concatenate([TRIANGLES, TRIANGLES + 8])].reshape(-1, 3), np.arange(72)
    vertices, faces = mesh.weld(soup, triangles.reshape(-1, 3))
    assert len(vertices) == 16
    found = mesh.parts(vertices, faces)
    assert len(found) == 2 and all(mesh.check(*p).volume == pytest.approx(1) for p in found)


def test_hull():
    pytest.importorskip("scipy")
    inside = np.random.default_rng(0).uniform(0.1, 0.9, (20, 3))
    vertices, faces = mesh.hull(np.concatenate([CUBE, inside]))
    report = mesh.check(vertices, faces)
    assert len(vertices) == 8 and report.convex and report.volume == pytest.approx(1)
