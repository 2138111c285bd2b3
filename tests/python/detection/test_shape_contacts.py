"""Contacts of polyhedra against an independent library, and against answers known from how the pair was built."""

import numpy as np
import pytest
from shape_pairs import (
    CUBE,
    CUBE_FACES,
    FAMILIES,
    coal_gap,
    detect,
    feature_gap,
    known_pairs,
    random_polyhedron,
    random_rotation,
)

GAPS = [0.0, 1e-15, -1e-15, 1e-12, -1e-12, 1e-7, -1e-7, 1e-3, -1e-3]


def box(sizes):
    return CUBE * sizes, CUBE_FACES


def moved(mesh, rotation=None, by=0.0):
    v, f = mesh
    return (v if rotation is None else v @ rotation.T) + by, f


@pytest.mark.parametrize("corners", [4, 8, 40])
def test_random_pairs_have_the_gaps_of_coal(corners):
    pytest.importorskip("coal")
    rng = np.random.default_rng(corners)
    pairs, expected = [], []
    for _ in range(200):
        a, b = random_polyhedron(rng, corners), random_polyhedron(rng, corners)
        direction = rng.normal(size=3)
        b = moved(b, by=direction / np.linalg.norm(direction) * rng.uniform(0.6, 2.0))
        gap = coal_gap(a, b)
        if gap < 1.9:
            pairs.append((a, b))
            expected.append(gap)
    found = detect(pairs, 2.0, 8.0)
    gap = np.array([g.min() for g, _, _ in found])
    assert np.sum(gap < 0) > 20 and np.sum(gap > 0) > 20
    np.testing.assert_allclose(gap, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("corners", [4, 8])
def test_random_pairs_have_the_gaps_of_all_pairs_of_features(corners):
    """An extended-precision look at every pair of features, in place of the library."""
    rng = np.random.default_rng(50 + corners)
    pairs = []
    for _ in range(100):
        way = rng.normal(size=3)
        b = moved(random_polyhedron(rng, corners), by=way / np.linalg.norm(way) * rng.uniform(0.6, 1.6))
        pairs.append((random_polyhedron(rng, corners), b))
    expected = [feature_gap(*pair) for pair in pairs]
    gap = np.array([g.min() for g, _, _ in detect(pairs, 2.0, 8.0)])
    assert np.sum(gap < 0) > 10 and np.sum(gap > 0) > 10
    np.testing.assert_allclose(gap, expected, rtol=0, atol=1e-13)


@pytest.mark.parametrize("family", FAMILIES)
def test_pairs_with_known_answers(family):
    """None missed, none false, gaps to 1e-13 of the size; benchmarks/polyhedra_gaps.py looks at more of them."""
    pairs, gaps, normals, margin, spacing = known_pairs(family, 280, np.random.default_rng(11))
    assert 10 < np.sum(np.array(gaps) > margin) < 140
    for (found, directions, _), gap, normal in zip(detect(pairs, margin, spacing), gaps, normals):
        assert (len(found) > 0) == (gap <= margin)
        if len(found):
            assert abs(found.min() - gap) < 1e-13 * 2
            np.testing.assert_allclose(directions[np.argmin(found)], normal, atol=1e-9)


@pytest.mark.parametrize("gap", GAPS)
def test_flush_faces(gap):
    """Boxes of any sizes face on face, turned about the normal and shifted: 3 or 4 points in both faces, the normal of the
    face, and a patch that holds the middle of the cut."""
    rng = np.random.default_rng(5)
    pairs, turns = [], []
    for k in range(300):
        lower, upper = rng.uniform(0.5, 2, 3), rng.uniform(0.5, 2, 3)
        angle = [0.0, np.pi / 4, rng.uniform(0, 7)][k % 3]
        about = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        shift = np.append(rng.uniform(-0.2, 0.2, 2) * (k % 2), (lower[2] + upper[2]) / 2 + gap)
        turn = np.eye(3) if k % 5 == 0 else random_rotation(rng)
        turns.append(turn)
        pairs.append((moved(moved(box(upper), about, shift), turn), moved(box(lower), turn)))
    for (gaps, normals, points), turn, (a, b) in zip(detect(pairs, 0.01, 8.0), turns, pairs):
        assert 3 <= len(gaps) <= 4
        np.testing.assert_allclose(gaps, gap, atol=5e-14)
        np.testing.assert_allclose(normals, np.broadcast_to(turn[:, 2], normals.shape), atol=5e-14)
        for v, _ in (a, b):
            local = points @ turn
            w = (v @ turn)[:, :2]
            low, high = w.min(axis=0), w.max(axis=0)
            assert np.all(local[:, :2] > low - 1e-9) and np.all(local[:, :2] < high + 1e-9)
        spread = np.linalg.matrix_rank(points - points.mean(axis=0), tol=1e-3)
        assert spread == 2


@pytest.mark.parametrize("gap", GAPS)
def test_edge_on_edge(gap):
    """Two wedge-edged boxes whose edges cross: one point where they do, the normal across both."""
    rng = np.random.default_rng(6)
    pairs, turns, places = [], [], []
    roof = np.array([[1, 0, 0], [0, np.sqrt(0.5), -np.sqrt(0.5)], [0, np.sqrt(0.5), np.sqrt(0.5)]])
    for _ in range(200):
        lower = moved(box([2, 1, 1]), roof)
        angle = rng.uniform(0.3, np.pi - 0.3)
        about = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        along = rng.uniform(-0.6, 0.6)
        place = np.array([along, 0, np.sqrt(0.5)])
        upper = moved(moved(box([2, 1, 1]), about @ roof), by=place + [0, 0, np.sqrt(0.5) + gap])
        turn = random_rotation(rng)
        turns.append(turn)
        places.append(turn @ (place + [0, 0, gap / 2]))
        pairs.append((moved(upper, turn), moved(lower, turn)))
    for (gaps, normals, points), turn, place in zip(detect(pairs, 0.0011, 8.0), turns, places):
        assert len(gaps) >= 1
        k = np.argmin(gaps)
        assert abs(gaps[k] - gap) < 1e-13
        np.testing.assert_allclose(normals[k], turn[:, 2], atol=1e-12)
        np.testing.assert_allclose(points[k], place, atol=1e-7)


@pytest.mark.parametrize("gap", GAPS)
def test_vertex_on_face(gap):
    rng = np.random.default_rng(7)
    pairs, turns, places = [], [], []
    for _ in range(200):
        while True:
            tip = random_rotation(rng)
            upper = moved(box(rng.uniform(0.5, 2, 3)), tip)
            height = np.sort(upper[0][:, 2])
            if height[1] - height[0] > 0.05:
                break
        lowest = upper[0][np.argmin(upper[0][:, 2])]
        place = np.append(rng.uniform(-0.9, 0.9, 2), 0.5)
        upper = moved(upper, by=place - lowest + [0, 0, gap])
        turn = random_rotation(rng)
        turns.append(turn)
        places.append(turn @ (place + [0, 0, gap / 2]))
        pairs.append((moved(upper, turn), moved(box([2, 2, 1]), turn)))
    for (gaps, normals, points), turn, place in zip(detect(pairs, 0.0011, 8.0), turns, places):
        assert len(gaps) == 1
        assert abs(gaps[0] - gap) < 1e-13
        np.testing.assert_allclose(normals[0], turn[:, 2], atol=1e-12)
        np.testing.assert_allclose(points[0], place, atol=1e-12)


@pytest.mark.parametrize("distance", [0.0, 1e-12, 1e-7, 1e-3, 0.05])
def test_aligned_cubes_that_share_an_edge_or_a_vertex(distance):
    """Corner to corner and edge to edge, along the diagonals: the gap is the distance, whatever the turn."""
    rng = np.random.default_rng(8)
    pairs, expected = [], []
    for k in range(60):
        axes = 3 if k % 2 else 2
        direction = np.array([1, 1, 1.0])
        direction[axes:] = 0
        turn = np.eye(3) if k % 3 == 0 else random_rotation(rng)
        away = direction + distance * direction / np.sqrt(axes)
        pairs.append((moved(moved(box(1.0), by=away), turn), moved(box(1.0), turn)))
        expected.append(2 if axes == 2 else 1)
    for (gaps, normals, _), count in zip(detect(pairs, 0.1, 8.0), expected):
        assert len(gaps) >= count
        assert abs(gaps.min() - distance) < 1e-13
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-14)


def test_units_rescaled_by_powers_of_two_leave_every_bit():
    rng = np.random.default_rng(9)
    pairs = []
    for _ in range(50):
        a, b = random_polyhedron(rng), random_polyhedron(rng)
        pairs.append((a, moved(b, by=np.array([rng.uniform(0.8, 1.8), 0, 0]))))
    flush = [(moved(box(1.0), by=[0.3, 0.1, 1.0]), box(1.0))]
    plain = detect(pairs + flush, 0.5, 8.0)
    for scale in (2.0**-20, 2.0**30):
        scaled = [tuple((v * scale, f) for v, f in pair) for pair in pairs + flush]
        for (g, n, _), (g2, n2, _) in zip(plain, detect(scaled, 0.5 * scale, 8.0 * scale)):
            assert np.array_equal(g * scale, g2) and np.array_equal(n, n2)
