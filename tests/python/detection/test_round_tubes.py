"""Round bodies and blocks in tubes: the farthest points of their surfaces, closed forms of their motion, rims of open ends."""

import cairn as cn
import numpy as np
import pytest
from shape_pairs import ROCK, random_rotation
from test_round_shapes import quaternion

WALL = cn.Material("wall")
PIPE = cn.tube((0, 0, 0), (0, 1, 0), 1.0, WALL)
SHORT = cn.tube((0, 0, 0), (0, 1, 0), 1.0, WALL, half_length=1.0)


def contacts(bodies, tube, margin, origin=(0, 0, 0)):
    """Contacts of bodies, which do not see each other, with a tube: (gap, normal, point) of each."""
    scene = cn.Scene(3, origin=origin)
    scene.add(bodies, tube)
    scene.interact(ROCK, ROCK, None)
    scene.interact(ROCK, WALL, cn.Coulomb(mu=0.0))
    sim = cn.Simulation(scene, dt=1e-12, strategy=cn.NSCD(margin=margin), overlap="ignore")
    sim.step()
    c, count = sim.contacts, len(bodies.position)
    sign = np.where(c.bodies[:, 0] < count, 1.0, -1.0)[:, None]
    body = np.min(c.bodies, axis=1)
    return [(c.gap[body == k], (sign * c.normal)[body == k], c.point[body == k]) for k in range(count)]


def run(tube, bodies, steps, dt=2e-3, mu=0.5):
    """The simulation after every step."""
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    scene.add(bodies)
    scene.add(tube)
    scene.interact(ROCK, WALL, cn.Coulomb(mu=mu))
    sim = cn.Simulation(scene, dt, cn.NSCD(solver=cn.PPANewton(tol=1e-13)))
    for _ in range(steps):
        sim.step()
        yield sim


def end(*args, **options):
    *_, sim = run(*args, **options)
    return sim


def scattered(rng, unit=1.0):
    """A frame whose third axis is a tube's, places in it within 0.9 of the axis, and frames of bodies."""
    frame = random_rotation(rng)
    places = np.column_stack((rng.uniform(-0.8, 0.8, (200, 2)), rng.uniform(-1, 1, 200)))
    places = places[np.hypot(places[:, 0], places[:, 1]) < 0.9]
    return frame, unit * places @ frame.T, [random_rotation(rng) for _ in places]


def test_cylinders_touch_with_the_farthest_points_of_their_rims():
    """Beside the tops of the distance from the axis at 20,000 points of each rim: all of them, one or two of an end."""
    frame, places, turns = scattered(np.random.default_rng(5))
    tube = cn.tube((0, 0, 0), frame[:, 2], 1.0, WALL)
    angle = np.linspace(0, 2 * np.pi, 20001)[:-1]
    bodies = cn.cylinders(places, 0.3, 0.7, ROCK, rotation=[quaternion(t) for t in turns])
    counts = []
    for (gap, normal, point), place, turn in zip(contacts(bodies, tube, 2.0), places, turns):
        expected = []
        for axis in (-0.35, 0.35):
            ring = np.column_stack((0.3 * np.cos(angle), 0.3 * np.sin(angle), 0 * angle + axis)) @ turn.T + place
            clear = 1 - np.linalg.norm(ring @ frame[:, :2], axis=1)
            expected += list(clear[(clear <= np.roll(clear, 1)) & (clear < np.roll(clear, -1))])
        np.testing.assert_allclose(np.sort(gap), np.sort(expected), rtol=0, atol=1e-8)
        counts.append(len(gap))
        touching = (point + gap[:, None] / 2 * normal - place) @ turn
        np.testing.assert_allclose(np.abs(touching[:, 2]), 0.35, atol=1e-14)
        np.testing.assert_allclose(np.hypot(touching[:, 0], touching[:, 1]), 0.3, atol=1e-14)
    assert set(counts) == {2, 3, 4}


@pytest.mark.parametrize("half_axes", [(0.3, 0.2, 0.5), (0.5, 0.5, 0.1), (0.05, 0.6, 0.1)])
@pytest.mark.parametrize("exponents", [(1, 1), (0.2, 0.4), (1.6, 0.7), (0.05, 0.05)])
def test_superquadrics_have_the_clearance_of_their_reach(half_axes, exponents):
    """The least clearance beside 4,000 directions across the tube, whose reach is a norm (Barr 1981's surface, its dual)."""
    frame, places, turns = scattered(np.random.default_rng(6))
    tube = cn.tube((0, 0, 0), frame[:, 2], 1.0, WALL)
    angle = 2 * np.pi * np.arange(4000) / 4000
    across = np.cos(angle)[:, None] * frame[:, 0] + np.sin(angle)[:, None] * frame[:, 1]
    p, q = 2 / (2 - np.array(exponents))
    bodies = cn.superquadrics(places, half_axes, exponents, ROCK, rotation=[quaternion(t) for t in turns])
    for (gap, normal, point), place, turn in zip(contacts(bodies, tube, 2.0), places, turns):
        u = np.abs(across @ turn * half_axes)
        reach = ((u[:, 0] ** q + u[:, 1] ** q) ** (p / q) + u[:, 2] ** p) ** (1 / p) + across @ place
        # a top between two directions is farther by half the square of the angle to the next
        assert -1e-6 < gap.min() - (1 - reach.max()) < 1e-12
        x = np.abs((point + gap[:, None] / 2 * normal - place) @ turn) / half_axes
        e1, e2 = exponents
        form = (x[:, 0] ** (2 / e2) + x[:, 1] ** (2 / e2)) ** (e2 / e1) + x[:, 2] ** (2 / e1)
        np.testing.assert_allclose(form ** (e1 / 2), 1, atol=1e-9)


def test_even_superquadrics_and_short_capsules_are_spheres():
    frame, places, _ = scattered(np.random.default_rng(7))
    for half_length in (0.0, 1.5):
        tube = cn.tube((0, 0, 0), frame[:, 2], 1.0, WALL, half_length=half_length)
        spheres = contacts(cn.spheres(places, 0.3, ROCK), tube, 2.0)
        for bodies in (cn.superquadrics(places, 0.3, (1, 1), ROCK), cn.capsules(places, 0.3, 0.0, ROCK)):
            for a, b in zip(spheres, contacts(bodies, tube, 2.0)):
                assert len(a[0]) == len(b[0]) == 1
                for x, y in zip(a, b):
                    np.testing.assert_allclose(x, y, rtol=0, atol=1e-12)


@pytest.mark.parametrize("gap", [0.0, 1e-12, -1e-12, 1e-3, -1e-3, -0.2])
def test_a_cylinder_along_the_wall_touches_with_two_points(gap):
    frame = random_rotation(np.random.default_rng(3))
    tube = cn.tube((0, 0, 0), frame[:, 1], 1.0, WALL)
    drum = cn.cylinders([frame @ [0, 0.2, -0.7 + gap]], 0.3, 0.8, ROCK, axis=frame[:, 1])
    ((g, n, x),) = contacts(drum, tube, 0.05)
    np.testing.assert_allclose(g, [gap, gap], atol=1e-15)
    np.testing.assert_allclose(n @ frame, [[0, 0, 1]] * 2, atol=1e-14)
    order = np.argsort(x @ frame[:, 1])
    np.testing.assert_allclose(x[order] @ frame, [[0, -0.2, gap / 2 - 1], [0, 0.6, gap / 2 - 1]], atol=1e-12)


@pytest.mark.parametrize("dt, close", [(2e-3, 1e-3), (1e-3, 5e-4), (5e-4, 2.5e-4)])
def test_a_cylinder_rolls_down_the_wall_of_a_tube(dt, close):
    """v^2 = 4/3 g (R - r) (1 - cos) at the bottom; the error goes with the step."""
    start, r = 0.5, 0.3
    drum = cn.cylinders([[0.7 * np.sin(start), 0, -0.7 * np.cos(start)]], r, 0.8, ROCK, axis=(0, 1, 0))
    for sim in run(PIPE, drum, int(0.6 / dt), dt):
        assert len(sim.contacts.gap) == 2
        if sim.bodies.position[0, 0] < 0:
            break
    speed = np.linalg.norm(sim.bodies.velocity[0, :3])
    expected = np.sqrt(4 / 3 * 9.81 * (1 - r) * (1 - np.cos(start)))
    assert abs(speed / expected - 1) < close
    assert abs(sim.bodies.velocity[0, 4] * r + speed) < 3 * close
    assert abs(np.hypot(*sim.bodies.position[0, [0, 2]]) - 0.7) < close


def test_they_rest_in_pipes_and_on_rims():
    """Ellipsoids and boxes span the pipe on two points; bodies longer than a short pipe lie on its end circles."""
    still = {"driven": ("vx", "vy", "wx", "wy", "wz")}
    cases = [
        (PIPE, cn.superquadrics([[0, 0, -0.5]], (0.6, 0.1, 0.2), (1, 1), ROCK), 2),
        (PIPE, cn.superquadrics([[0, 0, -0.7]], (0.3, 0.5, 0.2), (0.2, 0.2), ROCK), 2),
        (SHORT, cn.cylinders([[0, 0, -0.69]], 0.3, 3.0, ROCK, axis=(0, 1, 0)), 2),
        (SHORT, cn.capsules([[0, 0, -0.69]], 0.3, 3.0, ROCK, axis=(0, 1, 0)), 2),
        (SHORT, cn.superquadrics([[0, 1.1, -0.69]], (0.3, 0.6, 0.3), (1, 1), ROCK, **still), 1),
        (SHORT, cn.boxes([[0, 0, -0.7]], (0.3, 0.5, 0.4), ROCK), 4),
    ]
    rests = [None, None, -0.7, -0.7, 0.3 * np.sqrt(1 - 1 / 36) - 1, 0.2 - np.sqrt(1 - 0.15**2)]
    for (tube, body, points), low in zip(cases, rests):
        sim = end(tube, body, 300)
        c = sim.contacts
        assert len(c.gap) == points
        np.testing.assert_allclose(sim.bodies.velocity[0], 0, atol=1e-9)
        carried = np.abs(c.impulse[:, 2].sum())
        assert carried == pytest.approx(sim.bodies.mass[0] * 9.81 * 2e-3, rel=1e-9)
        if low is not None:
            assert sim.bodies.position[0, 2] == pytest.approx(low, abs=1e-4)
        if tube is SHORT and points == 2:
            np.testing.assert_allclose(np.sort(c.point[:, 1]), [-1, 1], atol=1e-9)


def test_a_leaning_cylinder_crosses_the_rim_where_it_is_nearest():
    """Beside 100,000 points of the rim: their least distance from the axis, less the radius."""
    angle = np.linspace(0, 2 * np.pi, 100001)
    rim = np.column_stack((np.cos(angle), 0 * angle + 1, np.sin(angle)))
    compared = 0
    for lean in (0.0, 0.02, 0.1, 0.5):
        for side in (0.0, 0.3):
            axis = np.array([0.1 * side, np.cos(lean), -np.sin(lean)])
            axis /= np.linalg.norm(axis)
            at = np.array([side, 0.9, -0.6])
            drum = cn.cylinders([at], 0.3, 2.0, ROCK, axis=axis)
            ((gap, normal, point),) = contacts(drum, SHORT, 0.5)
            on_rim = np.abs((point - gap[:, None] / 2 * normal)[:, 1] - 1) < 1e-12
            expected = np.linalg.norm(np.cross(rim - at, axis), axis=1).min() - 0.3
            assert gap[on_rim].min() == pytest.approx(expected, abs=1e-8)
            compared += 1
    assert compared == 8


@pytest.mark.parametrize("unit, far", [(1e-9, 0.0), (1e6, 0.0), (1.0, 1e9), (2.0**-30, 0.0), (2.0**20, 0.0)])
def test_sizes_and_places_do_not_matter(unit, far):
    """In other units and far away; by powers of two the bits are the same."""
    rng = np.random.default_rng(9)
    frame, places, turns = scattered(rng)
    turned = {"rotation": [quaternion(t) for t in turns]}
    for kind in ("cylinder", "superquadric", "capsule"):
        found = []
        for scale, place in ((1.0, 0.0), (unit, far)):
            shift = np.array([place, place, 0])
            tube = cn.tube(shift, frame[:, 2], scale, WALL, half_length=1.2 * scale)
            x = scale * places + shift
            if kind == "superquadric":
                bodies = cn.superquadrics(x, scale * np.array([0.5, 0.2, 0.3]), (0.7, 1.2), ROCK, **turned)
            else:
                make = cn.cylinders if kind == "cylinder" else cn.capsules
                bodies = make(x, 0.2 * scale, 0.9 * scale, ROCK, **turned)
            found.append(contacts(bodies, tube, 0.2 * scale, origin=(place, place, 0)))
        exact = np.log2(unit).is_integer() and not far
        for (g, n, _), (gap, normal, _) in zip(*found):
            assert len(g) == len(gap)
            if exact:
                assert np.array_equal(g, gap / unit) and np.array_equal(n, normal)
            else:
                np.testing.assert_allclose(g, gap / unit, rtol=0, atol=1e-12 if not far else 1e-6)
        assert sum(len(g) for g, _, _ in found[0]) > 50


def test_blocks_that_sank_into_the_wall_come_back():
    """A corner behind the wall of a pipe with ends is in the wall, not clear of its outer side."""
    ((gap, _, _),) = contacts(cn.boxes([[0, 0, -0.9]], 0.4, ROCK), SHORT, 0.01)
    np.testing.assert_allclose(gap, 1 - np.hypot(0.2, 1.1), atol=1e-14)
    assert len(gap) == 4
    for body in (cn.boxes([[0, 0, -1.5]], 0.4, ROCK), cn.cylinders([[0, 0, -1.5]], 0.2, 0.4, ROCK)):
        assert len(contacts(body, SHORT, 0.01)[0][0]) == 0  # outside
