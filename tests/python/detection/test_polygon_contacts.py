"""Contacts of polygons in 2D against plain loops over sides and corners, and against answers known from how a pair was built."""

import cairn as cn
import numpy as np
import pytest
from shape_pairs import ROCK


def random_polygon(rng, corners):
    """Corners on a circle, or on one squeezed to a needle."""
    angle = np.sort(rng.uniform(0, 2 * np.pi, corners))
    x = np.column_stack((np.cos(angle), np.sin(angle)))
    return random_polygon(rng, corners) if np.max(np.diff(angle, append=angle[0] + 2 * np.pi)) > 3 else x


def turned(x, angle, by=(0, 0)):
    c, s = np.cos(angle), np.sin(angle)
    return x @ np.array([[c, s], [-s, c]]) + by


def least_overlap(a, b):
    """Largest separation over the normals of all sides, by looking at every corner; and that of the corners where apart."""
    best = -np.inf
    for p, q in ((a, b), (b, a)):
        d = np.roll(p, -1, axis=0) - p
        n = np.column_stack((d[:, 1], -d[:, 0])) / np.linalg.norm(d, axis=1)[:, None]
        best = max(best, np.max(np.min((q[None] - p[:, None]) @ n[:, :, None], axis=1)))
    if best <= 0:
        return best
    near = np.inf
    for p, q in ((a, b), (b, a)):
        for i in range(len(p)):
            d = p[(i + 1) % len(p)] - p[i]
            along = np.clip((q - p[i]) @ d / (d @ d), 0, 1)
            near = min(near, np.min(np.linalg.norm(q - p[i] - along[:, None] * d, axis=1)))
    return near


def detect(pairs, margin, spacing=8.0):
    """Contacts of pairs of polygons, or of a polygon and a bar (start, end, radius), each pair in a place of its own."""
    scene = cn.Scene(2)
    for k, (a, b) in enumerate(pairs):
        scene.add(cn.polygons([a + [spacing * k, 0]], ROCK))
        if isinstance(b, tuple):
            scene.add(cn.segment(b[0] + [spacing * k, 0], b[1] + [spacing * k, 0], ROCK, radius=b[2]))
        else:
            scene.add(cn.polygons([b + [spacing * k, 0]], ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.0))
    sim = cn.Simulation(scene, dt=1e-12, strategy=cn.NSCD(margin=margin), overlap="ignore")
    sim.step()
    c = sim.contacts
    sign = np.where(c.bodies[:, 0] < c.bodies[:, 1], 1.0, -1.0)[:, None]
    pair = c.bodies[:, 0] // 2
    assert np.array_equal(pair, c.bodies[:, 1] // 2)
    return [(c.gap[pair == k], (sign * c.normal)[pair == k], c.point[pair == k] - [spacing * k, 0]) for k in range(len(pairs))]


@pytest.mark.parametrize("corners", [3, 4, 9, 60])
def test_random_pairs_have_the_gaps_of_plain_loops(corners):
    rng = np.random.default_rng(corners)
    pairs = []
    for k in range(120):
        a, b = random_polygon(rng, corners), random_polygon(rng, corners)
        pairs.append((a * [1, 1e-3] if k % 3 == 2 else a, turned(b, rng.uniform(0, 7), rng.uniform(-2, 2, 2))))
    expected = np.array([least_overlap(a, b) for a, b in pairs])
    found = np.array([g.min() if len(g) else np.inf for g, _, _ in detect(pairs, 2.0)])
    assert np.sum(expected < 0) > 20 and np.sum((expected > 0) & (expected < 1.9)) > 20
    near = expected < 1.9
    np.testing.assert_allclose(found[near], expected[near], rtol=0, atol=1e-12 * 8 * 120)  # places lie to 960 from 0


@pytest.mark.parametrize("gap", [0.0, 1e-15, -1e-15, 1e-12, -1e-12, 1e-7, -1e-3, 1e-3])
@pytest.mark.parametrize("second", ["polygon", "bar"])
def test_side_on_side(second, gap):
    """Rectangles and bars face on face at any angle: two points, at the ends of their overlap, and the normal of the sides."""
    rng = np.random.default_rng(3)
    pairs, ends, normals = [], [], []
    for k in range(60):
        angle = k * np.pi / 4 if k % 2 else rng.uniform(0, 7)
        wide, shift = rng.uniform(0.5, 2, 2), rng.uniform(-0.5, 0.5)
        upper = np.array([[-1, 0], [1, 0], [1, 1], [-1, 1]]) * [wide[0], 1] + [shift, gap]
        lower = np.array([[-1, -1], [1, -1], [1, 0], [-1, 0]]) * [wide[1], 1]
        if second == "bar":
            bar = turned(np.array([[-wide[1], -0.25], [wide[1], -0.25]]), angle)
            pairs.append((turned(upper, angle), (bar[k // 2 % 2], bar[1 - k // 2 % 2], 0.25)))
        else:
            pairs.append((turned(upper, angle), turned(lower, angle)))
        low, high = max(shift - wide[0], -wide[1]), min(shift + wide[0], wide[1])
        ends.append(turned(np.array([[low, gap / 2], [high, gap / 2]]), angle))
        normals.append(turned(np.array([[0, 1.0]]), angle))
    for (gaps, normal, point), end, n in zip(detect(pairs, 0.01), ends, normals):
        assert len(gaps) == 2
        np.testing.assert_allclose(gaps, gap, rtol=0, atol=2e-13)
        np.testing.assert_allclose(normal, np.broadcast_to(n, (2, 2)), atol=1e-13)
        order = np.argsort(np.linalg.norm(point - end[0], axis=1))
        np.testing.assert_allclose(point[order], end, atol=1e-7)


def spins(contact_point, *sets):
    """Spins after a corner struck a side across a gap that closes within the step."""
    scene = cn.Scene(dim=2)
    scene.add(*sets)
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.5))
    strategy = cn.NSCD(0.5, cn.NLGS(tol=1e-12), margin=0.05, contact_point=contact_point)
    sim = cn.Simulation(scene, 0.01, strategy)
    assert sim.step()["contacts"] == 1
    assert np.any(sim.contacts.impulse != 0)
    return np.array(sim.bodies.velocity)[:, 2]


def test_impulses_between_polygons_act_in_the_middle_of_the_gap():
    """On surfaces, too, as in LMGC90; that of a disk on a polygon then acts on the surface of each."""
    square = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    low = cn.polygons([square], ROCK)
    high = cn.polygons([turned(square, 0.6, (0.1, 1.22))], ROCK, velocity=[[1.0, -4.0, 0.0]])
    assert np.array_equal(spins("middle", low, high), spins("surface", low, high))
    ball = cn.disks([[0.1, 1.03]], 0.5, ROCK, velocity=[[1.0, -4.0, 0.0]])
    assert np.abs(spins("middle", low, ball) - spins("surface", low, ball)).max() > 1e-3
