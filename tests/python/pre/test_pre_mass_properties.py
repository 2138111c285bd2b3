"""Area, volume, centre and inertia against closed forms, sampling-free identities and trimesh."""

import numpy as np
import pytest
from cairn.pre import mass_properties as mp

CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
SIDES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


def rotation(rng):
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


def tensor(p, k=0):
    return p.axes[k] @ np.diag(p.moments[k]) @ p.axes[k].T


def test_box():
    a, b, c = 2.0, 3.0, 5.0
    p = mp.polyhedra([CUBE * (a, b, c) + (7, -8, 9)], [SIDES])
    volume = a * b * c
    assert p.measure[0] == pytest.approx(volume, rel=1e-15)
    np.testing.assert_allclose(p.center[0], (8, -6.5, 11.5), rtol=1e-15)
    exact = volume / 12 * np.array([b * b + c * c, a * a + c * c, a * a + b * b])
    np.testing.assert_allclose(p.moments[0], exact, rtol=4e-15)
    assert np.array_equal(p.axes[0], np.eye(3))  # principal as given: kept


def test_turned_box_and_quaternion():
    rng = np.random.default_rng(3)
    turns = [rotation(rng) for _ in range(50)] + [np.diag([1.0, -1, -1]), np.diag([-1.0, 1, -1]), np.diag([-1.0, -1, 1])]
    edges = np.array([2.0, 3.0, 5.0])
    p = mp.polyhedra([CUBE * edges @ q.T for q in turns], [SIDES] * len(turns))
    exact = 30 / 12 * np.diag([34.0, 29.0, 13.0])
    for k, q in enumerate(turns):
        np.testing.assert_allclose(tensor(p, k), q @ exact @ q.T, atol=1e-13 * 85)
        assert np.linalg.det(p.axes[k]) == pytest.approx(1)
    w, x, y, z = mp.quaternions(p.axes).T
    back = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    ).transpose(2, 0, 1)
    np.testing.assert_allclose(back, p.axes, atol=4e-15)


def test_tetrahedron():
    p = mp.polyhedra([[[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]], [[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]])
    assert p.measure[0] == pytest.approx(1 / 6, rel=1e-15)
    np.testing.assert_allclose(p.center[0], [0.25] * 3, rtol=1e-15)
    # about the centre: integral of x x is 1/60 - 1/96 and of x y 1/120 - 1/96
    exact = np.full((3, 3), -(1 / 120 - 1 / 96)) + np.diag([2 * (1 / 60 - 1 / 96) + (1 / 120 - 1 / 96)] * 3)
    np.testing.assert_allclose(tensor(p), exact, atol=1e-17)


@pytest.mark.parametrize("sides", [3, 4, 7, 1000])
def test_regular_polygon(sides):
    angle = 2 * np.pi * np.arange(sides) / sides
    radius, middle = 2.5, np.array([3.0, -4.0])
    p = mp.polygons([middle + radius * np.column_stack((np.cos(angle), np.sin(angle)))])
    area = sides / 2 * radius**2 * np.sin(2 * np.pi / sides)
    assert p.measure[0] == pytest.approx(area, rel=1e-13)
    np.testing.assert_allclose(p.center[0], middle, rtol=1e-14)
    assert p.moments[0, 0] == pytest.approx(area * radius**2 / 6 * (2 + np.cos(2 * np.pi / sides)), rel=1e-13)


def test_polygon_that_is_not_convex():
    p = mp.polygons([[[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]]])
    assert p.measure[0] == pytest.approx(3, rel=1e-15)
    np.testing.assert_allclose(p.center[0], [5 / 6, 5 / 6], rtol=1e-15)
    # three unit squares, each 1/6 about its centre
    squares = np.array([[0.5, 0.5], [1.5, 0.5], [0.5, 1.5]])
    assert p.moments[0, 0] == pytest.approx(3 / 6 + np.sum((squares - 5 / 6) ** 2), rel=1e-15)


def test_many_bodies_are_as_one_by_one():
    rng = np.random.default_rng(1)
    shapes = [rng.uniform(0.5, 2, 3) * (CUBE if k % 2 else CUBE[:, [1, 2, 0]]) + rng.normal(size=3) for k in range(20)]
    shapes = [s @ rotation(rng).T for s in shapes]
    many = mp.polyhedra(shapes, [SIDES] * 20)
    for k, s in enumerate(shapes):
        one = mp.polyhedra([s], [SIDES])
        for x, y in zip(many, one):
            assert np.array_equal(x[k], y[0])


@pytest.mark.parametrize("power", [-60, 1, 60])
def test_powers_of_two_change_no_bit(power):
    rng = np.random.default_rng(2)
    s = CUBE * (1, 2, 3) @ rotation(rng).T + rng.normal(size=3)
    one, scaled = mp.polyhedra([s], [SIDES]), mp.polyhedra([s * 2.0**power], [SIDES])
    assert np.array_equal(one.measure * 2.0 ** (3 * power), scaled.measure)
    assert np.array_equal(one.moments * 2.0 ** (5 * power), scaled.moments)
    assert np.array_equal(one.axes, scaled.axes)


def test_far_from_the_origin():
    far = np.array([2.0**27, -(2.0**26), 2.0**25])
    here, there = mp.polyhedra([CUBE], [SIDES]), mp.polyhedra([CUBE + far], [SIDES])
    assert here.measure == there.measure and np.array_equal(here.moments, there.moments)


def test_needle_keeps_its_digits():
    p = mp.polyhedra([CUBE * (1e4, 1, 1e-2)], [SIDES])
    np.testing.assert_allclose(p.measure[0], 100, rtol=1e-14)
    np.testing.assert_allclose(p.moments[0], 100 / 12 * np.array([1 + 1e-4, 1e8 + 1e-4, 1e8 + 1]), rtol=1e-13)


def test_against_trimesh():
    trimesh = pytest.importorskip("trimesh")
    rng = np.random.default_rng(5)
    for _ in range(20):
        hull = trimesh.convex.convex_hull(rng.normal(size=(30, 3)) * (1, 2, 4) + (5, 0, 0))
        p = mp.polyhedra([hull.vertices], [hull.faces])
        assert p.measure[0] == pytest.approx(hull.volume, rel=1e-11)
        np.testing.assert_allclose(p.center[0], hull.center_mass, rtol=1e-11, atol=1e-11)
        np.testing.assert_allclose(tensor(p), hull.moment_inertia, rtol=1e-10, atol=1e-10 * hull.volume)


def test_refusals():
    with pytest.raises(ValueError, match=r"faces\[1\] is inside out.*turn the faces round"):
        mp.polyhedra([CUBE, CUBE], [SIDES, [f[::-1] for f in SIDES]])
    with pytest.raises(ValueError, match=r"faces\[0\] is flat"):
        mp.polyhedra([CUBE * (1, 1, 0)], [SIDES])
    with pytest.raises(ValueError, match=r"faces\[0\] names vertex 8"):
        mp.polyhedra([CUBE], [[[0, 1, 8]]])
    with pytest.raises(ValueError, match=r"vertices\[0\]\[3, 1\] is nan"):
        mp.polyhedra([np.where(np.arange(24).reshape(8, 3) == 10, np.nan, CUBE)], [SIDES])
    with pytest.raises(ValueError, match=r"vertices\[0\] is inside out.*anticlockwise"):
        mp.polygons([[[0, 0], [0, 1], [1, 1], [1, 0]]])
    with pytest.raises(ValueError, match="same point"):
        mp.polygons([[[1, 1]] * 3])
