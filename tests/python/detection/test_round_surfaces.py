"""Cylinders and superquadrics on surfaces of triangles: as on a plane, an independent library's gaps, no edge that catches."""

import cairn as cn
import numpy as np
import pytest
from shape_pairs import CUBE, CUBE_FACES, ROCK, random_rotation, triangles
from test_round_shapes import quaternion
from test_surfaces import GROUND, grid

TABLE = (CUBE * (4, 4, 2) - [0, 0, 1], triangles(CUBE_FACES))


def floor(n=8):
    """A flat square of n x n unit squares around 0, each of two triangles."""
    vertices, faces = grid(n, lambda x, y: 0 * x)
    return vertices - [n / 2, n / 2, 0], faces


def contacts(bodies, surface, margin, origin=(0, 0, 0)):
    """Contacts of bodies, which do not see each other, with a surface: (gap, normal, point) of each."""
    scene = cn.Scene(3, origin=origin)
    scene.add(bodies, cn.surface(*surface, GROUND))
    scene.interact(ROCK, ROCK, None)
    scene.interact(ROCK, GROUND, cn.Coulomb(mu=0.0))
    sim = cn.Simulation(scene, dt=1e-12, strategy=cn.NSCD(margin=margin), overlap="ignore")
    sim.step()
    c, count = sim.contacts, len(bodies.position)
    sign = np.where(c.bodies[:, 0] < count, 1.0, -1.0)[:, None]
    body = np.min(c.bodies, axis=1)
    return [(c.gap[body == k], (sign * c.normal)[body == k], c.point[body == k]) for k in range(count)]


def run(ground, bodies, steps, mu=0.3, dt=2e-3):
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    scene.add(bodies)
    scene.add(ground)
    scene.interact(ROCK, GROUND, cn.Coulomb(mu=mu))
    sim = cn.Simulation(scene, dt, cn.NSCD(solver=cn.PPANewton(tol=1e-13)))
    for _ in range(steps):
        sim.step()
    return sim


def cylinder(axis, velocity, radius=0.4, length=0.6):
    """On the floor at (-1, -0.5)."""
    up = abs(axis[2]) / np.linalg.norm(axis)
    height = length / 2 * up + radius * np.sqrt(1 - up * up)
    return cn.cylinders([[-1, -0.5, height]], radius, length, ROCK, axis=axis, velocity=[velocity])


def superquadric(half_axes, exponents, velocity):
    return cn.superquadrics([[-1, -0.5, half_axes[2]]], half_axes, exponents, ROCK, velocity=[velocity])


MOVING = {
    "a drum that stands": (cylinder((0, 0, 1), [0, 0, 0, 0, 0, 0]), 250),
    "a drum that slides": (cylinder((0, 0, 1), [2, 0.7, 0, 0, 0, 0]), 250),
    "a drum that rolls": (cylinder((0.3, 1, 0), [1.5, -0.45, 0, 0, 0, 0]), 250),
    "a drum on its rim": (cylinder((0.2, 0.1, 1), [2, 0.7, 0, 0, 0, 0]), 150),
    "a drum that falls": (cylinder((0.8, 0.1, 0.6), [1, 0.7, 0, 0, 0, 0]), 150),
    "an ellipsoid that rolls": (superquadric((0.25, 0.6, 0.25), (1, 1), [1, 0.3, 0, 0, 0, 0]), 250),
    "an ellipsoid that spins": (superquadric((0.25, 0.6, 0.35), (1, 1), [1, 0.3, 0, 0, 0, 3]), 250),
    "nearly a box": (superquadric((0.25, 0.6, 0.35), (0.05, 0.05), [1, 0.3, 0, 0, 0, 0]), 200),
    "nearly an octahedron": (superquadric((0.25, 0.6, 0.35), (1.8, 1.5), [1, 0.3, 0, 0, 0, 1]), 250),
}


@pytest.mark.parametrize("kind", MOVING)
def test_they_move_on_triangles_as_on_a_plane(kind):
    body, steps = MOVING[kind]
    on_plane = run(cn.wall((0, 0, 0), (0, 0, 1), GROUND), body, steps)
    on_surface = run(cn.surface(*floor(), GROUND), body, steps)
    for name in ("position", "rotation", "velocity"):
        a, b = (getattr(s.bodies, name)[0] for s in (on_plane, on_surface))
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-9)
    a, b = on_plane.contacts, on_surface.contacts
    assert len(a.gap) == len(b.gap)
    np.testing.assert_allclose(np.sort(a.gap), np.sort(b.gap), rtol=0, atol=1e-9)
    if kind != "a drum that stands":
        assert np.linalg.norm(on_plane.bodies.position[0, :2] - [-1, -0.5]) > 0.1


def coal_distance(shape, frame, triangle, inside):
    """Distance of a round body from a triangle by Coal; nan if the points that it calls nearest are no points of the two."""
    import coal

    points, both = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for x in triangle:
        points.append(x)
    for c in ((0, 1, 2), (0, 2, 1)):
        both.append(coal.Triangle(*c))
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.gjk_tolerance = 1e-12
    request.gjk_max_iterations = 10000
    gap = coal.distance(shape, coal.Transform3s(*frame), coal.Convex(points, both), coal.Transform3s(), request, result)
    x, y = result.getNearestPoint1(), result.getNearestPoint2()
    share = np.linalg.lstsq((triangle[1:] - triangle[0]).T, y - triangle[0], rcond=None)[0]
    sound = inside((x - frame[1]) @ frame[0]) and share.min() > -1e-6 and share.sum() < 1 + 1e-6
    return gap if sound and abs(np.linalg.norm(x - y) - gap) < 1e-8 else np.nan


SHAPES = [("cylinder", (0.3, 0.3, 0.7)), ("cylinder", (0.5, 0.5, 0.1)), ("ellipsoid", (0.3, 0.2, 0.5))]


@pytest.mark.parametrize("where", ["waves", "cube", "pit"])
@pytest.mark.parametrize("kind, sizes", SHAPES)
def test_least_gap_is_that_of_all_triangles(kind, sizes, where):
    """In front of a rough surface, around a cube and within one, beside Coal over all triangles."""
    coal = pytest.importorskip("coal")
    rng = np.random.default_rng(12)
    if where == "waves":
        vertices, faces = grid(6, lambda x, y: 0.5 * np.sin(2.0 * x) * np.cos(1.7 * y))
        places = np.column_stack((rng.uniform(2, 4, (60, 2)), rng.uniform(0.9, 1.7, 60)))
    else:
        vertices, faces = CUBE * 4, triangles(CUBE_FACES)
        places = rng.uniform(-3.5, 3.5, (300, 3)) if where == "cube" else rng.uniform(-1.4, 1.4, (60, 3))
        if where == "cube":
            places = places[np.max(np.abs(places), axis=1) > 2.3][:60]
        else:
            faces = faces[:, ::-1]
    turns = [random_rotation(rng) for _ in places]
    turned = {"rotation": [quaternion(t) for t in turns]}
    if kind == "cylinder":
        bodies, shape = cn.cylinders(places, sizes[0], sizes[2], ROCK, **turned), coal.Cylinder(sizes[0], sizes[2])

        def inside(x):
            return np.hypot(*x[:2]) < sizes[0] + 1e-6 and abs(x[2]) < sizes[2] / 2 + 1e-6
    else:
        bodies, shape = cn.superquadrics(places, sizes, (1, 1), ROCK, **turned), coal.Ellipsoid(*sizes)

        def inside(x):
            return np.sum((x / sizes) ** 2) < 1 + 1e-6

    compared = 0
    for (gap, normal, point), place, turn in zip(contacts(bodies, (vertices, faces), 2.0), places, turns):
        expected = np.min([coal_distance(shape, (turn, place), t, inside) for t in vertices[faces]])
        if not expected > 1e-3:  # nan too
            continue
        compared += 1
        assert gap.min() == pytest.approx(expected, abs=1e-6)
        k = np.argmin(gap)
        assert inside((point[k] + gap[k] / 2 * normal[k] - place) @ turn)
    assert compared > 50


@pytest.mark.parametrize("where", ["waves", "cube", "pit", "plane"])
def test_an_even_superquadric_is_a_sphere(where):
    """The contacts of spheres in the same places, apart and overlapping, the centre in front of the surface."""
    rng = np.random.default_rng(2)
    faces, radius = triangles(CUBE_FACES), 0.1
    if where == "waves":
        surface = grid(6, lambda x, y: 0.6 * np.sin(2.0 * x) * np.cos(1.7 * y))
        centres = np.column_stack((rng.uniform(1.5, 4.5, (200, 2)), rng.uniform(0.6, 1.2, 200)))
    elif where == "cube":
        surface, centres = (CUBE * 4, faces), rng.uniform(-2.2, 2.2, (1500, 3))
        centres = centres[np.max(np.abs(centres), axis=1) > 2.001]
    elif where == "pit":
        surface, centres = (CUBE * 4, faces[:, ::-1]), rng.uniform(-1.95, 1.95, (200, 3))
    else:
        vertices, faces = grid(8, lambda x, y: 0 * x)
        turn = random_rotation(rng)
        at = [rng.uniform(1, 7, (50, 2)), rng.integers(1, 7, (50, 2)), rng.integers(1, 7, (50, 2)) + [0.5, 0.0]]
        at.append(rng.integers(1, 7, (50, 2)) + rng.normal(size=(50, 2)) * 1e-12)
        surface, centres = (vertices @ turn.T, faces), np.column_stack((np.concatenate(at), rng.uniform(0.05, 0.2, 200))) @ turn.T
    spheres = contacts(cn.spheres(centres, radius, ROCK), surface, 1.0)
    even = contacts(cn.superquadrics(centres, radius, (1, 1), ROCK), surface, 1.0)
    for a, b in zip(spheres, even):
        assert len(a[0]) == len(b[0])
        order = [np.lexsort(np.round(points, 6).T) for _, _, points in (a, b)]
        for x, y in zip(a, b):
            np.testing.assert_allclose(x[order[0]], y[order[1]], rtol=0, atol=1e-13)
    assert sum(len(g) for g, _, _ in even) > 150


@pytest.mark.parametrize("kind", ["standing", "along", "across", "ellipsoid", "box"])
@pytest.mark.parametrize("sunk", [0.0, 1e-9, 1e-4])
def test_nothing_is_caught_by_an_edge(kind, sunk):
    """Half over the rim of a table, it slides in without friction, however little it has sunk."""
    place = 1.9 if kind in ("across", "ellipsoid") else 2.3
    moved = {"velocity": [[-1.0, 0, 0, 0, 0, 0]], "driven": ("wx", "wy", "wz")}
    height = 0.2 if kind in ("standing", "ellipsoid", "box") else 0.3
    at = [[place, 0.2, height - sunk]]
    if kind == "standing":
        body = cn.cylinders(at, 0.6, 0.4, ROCK, **moved)
    elif kind in ("along", "across"):
        body = cn.cylinders(at, 0.3, 0.8, ROCK, axis=(1, 0, 0) if kind == "along" else (0, 1, 0), **moved)
    else:
        body = cn.superquadrics(at, (0.5, 0.3, 0.2), (1, 1) if kind == "ellipsoid" else (0.1, 0.1), ROCK, **moved)
    sim = run(cn.surface(*TABLE, GROUND), body, 300, mu=0.0)
    # the surface of a nearly box-shaped body rises by 2e-6 of its length near its edge
    np.testing.assert_allclose(sim.bodies.velocity[0], [-1, 0, 0, 0, 0, 0], atol=1e-5 if kind == "box" else 1e-8)
    assert abs(sim.bodies.position[0, 2] - height) < 1e-8 + sunk


@pytest.mark.parametrize("share, falls", [(0.45, False), (0.55, True)])
def test_a_drum_over_the_edge_of_a_table(share, falls):
    """The drum stands while its centre is over the table, with contacts where its circle crosses the edge, and falls beyond."""
    drum = cn.cylinders([[2 - 0.6 + 1.2 * share, 0.2, 0.2]], 0.6, 0.4, ROCK)
    sim = run(cn.surface(*TABLE, GROUND), drum, 150, mu=0.5)
    assert (sim.bodies.position[0, 2] < 0.195) == falls
    if not falls:
        np.testing.assert_allclose(sim.bodies.velocity[0], 0, atol=1e-9)
        at_rim = np.abs(sim.contacts.point[:, 0] - 2) < 1e-9
        half_chord = np.sqrt(0.36 - (2 - drum.position[0, 0]) ** 2)
        np.testing.assert_allclose(np.sort(sim.contacts.point[at_rim, 1]), [0.2 - half_chord, 0.2 + half_chord], atol=1e-9)


def test_a_drum_stands_on_a_small_table_and_lies_on_a_ridge():
    drum = cn.cylinders([[0.02, 0.01, 0.1]], 1.5, 0.2, ROCK)
    sim = run(cn.surface(CUBE - [0, 0, 0.5], triangles(CUBE_FACES), GROUND), drum, 50)
    assert abs(sim.bodies.position[0, 2] - 0.1) < 1e-9
    np.testing.assert_allclose(np.abs(sim.contacts.point[:, :2]), 0.5, atol=1e-6)
    assert np.sum(sim.contacts.impulse[:, 2] > 0) >= 3
    ridge = np.array([[-3, 0, 0], [3, 0, 0], [-3, -3, -1], [3, -3, -1], [-3, 3, -1], [3, 3, -1.0]])
    faces = [[2, 3, 1, 0], [0, 1, 5, 4]]
    still = {"driven": ("vx", "vy", "wx", "wy", "wz")}
    along = cn.cylinders([[0.2, 0.0, 0.3]], 0.3, 1.0, ROCK, axis=(1, 0, 0), **still)
    sim = run(cn.surface(ridge, faces, GROUND), along, 20)
    np.testing.assert_allclose(np.sort(sim.contacts.point[:, 0]), [-0.3, 0.7], atol=1e-9)
    across = cn.cylinders([[0.2, 0.1, 0.3]], 0.3, 1.0, ROCK, axis=(0.2, 1, 0), **still)
    sim = run(cn.surface(ridge, faces, GROUND), across, 20)
    np.testing.assert_allclose(sim.contacts.point, [[0.18, 0, 0]], atol=1e-9)
    assert abs(sim.bodies.position[0, 2] - 0.3) < 1e-9


@pytest.mark.parametrize(
    "size, cell, place, turned",
    [(1.0, 1.0, 0.0, True), (1e-9, 1e-9, 0.0, True), (1e6, 1e6, 0.0, True), (1e-6, 1e3, 0.0, False), (1.0, 1.0, 1e9, False)],
)
@pytest.mark.parametrize("share", [0.0, 1e-9, -1e-9, 1e-3, -1e-3, -0.3])
def test_of_any_size_they_lie_as_on_a_plane(size, cell, place, turned, share):
    """Sizes from 1e-9 to 1e6, tiny on huge triangles, far away; touching to the bit or deep inside."""
    turn = random_rotation(np.random.default_rng(8)) if turned else np.eye(3)
    v, f = floor()
    shift = np.array([place, place, 0])
    gap = 0.3 * size * share
    at = [turn @ [0.13 * cell, 0.21 * cell, 0.15 * size + gap] + shift]
    turned = {"rotation": [quaternion(turn)]}
    axes = size * np.array([0.4, 0.3, 0.15])
    sets = [(cn.cylinders(at, 0.4 * size, 0.3 * size, ROCK, **turned), 4)]
    sets.append((cn.cylinders(at, 0.15 * size, 0.7 * size, ROCK, axis=turn @ [1, 0.2, 0]), 2))
    sets += [(cn.superquadrics(at, axes, e, ROCK, **turned), n) for e, n in (((1, 1), 1), ((0.05, 0.05), 5), ((1.5, 0.3), 1))]
    for body, count in sets:
        ((g, n, x),) = contacts(body, (cell * v @ turn.T + shift, f), 6e-4 * size, origin=(place, place, 0))
        lowest = np.argmin(g)
        if count == 5:  # the lowest, and corners a little behind it
            corners = np.delete(g, lowest)
            assert len(corners) == 4 and (corners > gap).all() and (corners < gap + 2**-12 * axes.min()).all()
            g, n, x, count = g[[lowest]], n[[lowest]], x[[lowest]], 1
        assert len(g) == count
        np.testing.assert_allclose(g, gap, rtol=0, atol=1e-14 * (size + cell))
        np.testing.assert_allclose(n, [turn[:, 2]] * count, rtol=0, atol=1e-12)
        np.testing.assert_allclose(x @ turn[:, 2], gap / 2, rtol=0, atol=1e-14 * (size + cell) + 1e-15 * place)


def test_flat_faces_have_one_lowest_point_on_turned_floors():
    """A nearly box-shaped superquadric flush with a floor of triangles whose normals differ by rounding: a single triangle has
    the lowest point, and each corner rests on a triangle."""
    rng = np.random.default_rng(10)
    v, f = floor(12)
    for _ in range(5):
        turn = random_rotation(rng)
        places = np.column_stack((rng.uniform(-4, 4, (60, 2)), np.full(60, 0.3))) @ turn.T
        turned = {"rotation": [quaternion(turn)] * 60}
        bodies = cn.superquadrics(places, (1.4, 0.9, 0.3), (0.05, 0.05), ROCK, **turned)
        for gap, normal, _ in contacts(bodies, (v @ turn.T, f), 0.01):
            touching = np.abs(gap) < 1e-14
            assert touching.sum() == 1 and len(gap) == 5 and (gap[~touching] > 1e-5).all()
            assert (np.abs(normal @ turn[:, 2] - 1) < 1e-14).all()


def test_units_by_powers_of_two_leave_the_bits():
    rng = np.random.default_rng(8)
    v, f = grid(6, lambda x, y: 0.5 * np.sin(2.0 * x) * np.cos(1.7 * y))
    places = np.column_stack((rng.uniform(2, 4, (40, 2)), rng.uniform(0.3, 0.9, 40)))
    turned = {"rotation": [quaternion(random_rotation(rng)) for _ in places]}
    for kind in ("cylinder", "superquadric"):
        found = []
        for unit in (1.0, 2.0**-30, 2.0**20):
            if kind == "cylinder":
                bodies = cn.cylinders(places * unit, 0.3 * unit, 0.7 * unit, ROCK, **turned)
            else:
                bodies = cn.superquadrics(places * unit, unit * np.array([0.3, 0.2, 0.5]), (0.3, 1.4), ROCK, **turned)
            found.append(contacts(bodies, (v * unit, f), 0.1 * unit))
            for (g, n, x), (gap, normal, point) in zip(found[0], found[-1]):
                assert np.array_equal(g, gap / unit) and np.array_equal(n, normal) and np.array_equal(x, point / unit)
        assert sum(len(g) for g, _, _ in found[0]) > 10


@pytest.mark.parametrize("place", [(0.0, 0.0), (0.25, 0.00025), (1e-12, 5e-6)])
def test_slivers_and_fans(place):
    """Strips 1e-5 wide and 6 long, 200 triangles round a vertex: no point twice, none missing."""
    angle = 2 * np.pi * np.arange(200) / 200
    fan = np.vstack([[0, 0, 0], np.column_stack((3 * np.cos(angle), 3 * np.sin(angle), 0 * angle))])
    y = np.concatenate([[-2], np.arange(-50, 50) * 1e-5, [2]])
    strips = np.array([[x, b, 0] for x in (-3, 3) for b in y])
    k, m = np.arange(len(y) - 1), len(y)
    halves = [np.column_stack((k, m + k, k + 1)), np.column_stack((m + k, m + k + 1, k + 1))]
    grounds = [(fan, [[0, 1 + k, 1 + (k + 1) % 200] for k in range(200)]), (strips, np.concatenate(halves))]
    low = [*place, 0.25]
    for ground in grounds:
        bodies = [cn.cylinders([low], 0.25, 0.5, ROCK, axis=a) for a in ((0, 0, 1), (1, 0.3, 0), (1, 0, 0))]
        bodies.append(cn.superquadrics([low], (0.2, 0.4, 0.25), (1, 1), ROCK))
        for body, least, most in zip(bodies, (4, 2, 2, 1), (16, 2, 2, 1)):
            ((gap, normal, point),) = contacts(body, ground, 0.01)
            assert least <= len(gap) <= most
            np.testing.assert_allclose(gap, 0, atol=1e-15)
            np.testing.assert_allclose(normal, [[0, 0, 1]] * len(gap), atol=1e-14)
            apart = np.linalg.norm(point[:, None] - point, axis=2) + np.eye(len(gap))
            assert apart.min() > 0.01


@pytest.mark.parametrize("kind", ["box", "drum"])
def test_impulses_follow_from_triangle_to_triangle(kind, tmp_path):
    """Bodies sliding over many edges need a single sweep in each step after the first, as on a plane; stopped and restarted, the
    same bits."""
    at = {"velocity": [[2, 0.7, 0, 0, 0, 0]]}
    box, drum = cn.boxes([[-1, -0.5, 0.2]], (0.8, 0.5, 0.4), ROCK, **at), cn.cylinders([[-1, -0.5, 0.2]], 0.4, 0.4, ROCK, **at)
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    v, f = floor(40)
    scene.add(box if kind == "box" else drum, cn.surface(v * [0.2, 0.2, 1], f, GROUND))
    scene.interact(ROCK, GROUND, cn.Coulomb(mu=0.3))
    whole, parts = (cn.Simulation(scene, 2e-3, cn.NSCD(solver=cn.NLGS(tol=1e-10))) for _ in range(2))
    for step in range(200):
        whole.step()
        assert step == 0 or whole.info["iterations"] == 1
        assert len(whole.contacts.gap) == 4
    assert np.linalg.norm(whole.bodies.position[0] - [-1, -0.5, 0.2]) > 0.5  # over many edges
    parts.run(steps=100, progress=False)
    parts.checkpoint(tmp_path / "half.h5")
    parts = cn.Simulation(scene, 2e-3, cn.NSCD(solver=cn.NLGS(tol=1e-10), threads=2))
    parts.restore(tmp_path / "half.h5")
    parts.run(steps=100, progress=False)
    assert np.array_equal(parts.bodies.position, whole.bodies.position)
    assert np.array_equal(parts.bodies.velocity, whole.bodies.velocity)


LOWERED = {
    "drum": lambda x, q: cn.cylinders(x, 0.3, 0.7, ROCK, rotation=q),
    "plate": lambda x, q: cn.cylinders(x, 0.5, 0.1, ROCK, rotation=q),
    "pebble": lambda x, q: cn.superquadrics(x, (0.3, 0.2, 0.5), (0.3, 0.3), ROCK, rotation=q),
    "tip": lambda x, q: cn.superquadrics(x, (0.3, 0.2, 0.5), (1.7, 1.7), ROCK, rotation=q),
    "block": lambda x, q: cn.boxes(x, (0.6, 0.4, 1.0), ROCK, rotation=q),
}


@pytest.mark.parametrize("where", ["waves", "cube"])
@pytest.mark.parametrize("kind", LOWERED)
def test_what_is_lowered_a_little_too_far_comes_back_up(kind, where):
    """Lowered by their gaps until they touch, upright and turned, over ridges, valleys, rims and corners; 0.005 farther down all
    are touched, and no depth is more than the 0.005 by which they came."""
    rng, count = np.random.default_rng(7), 70
    waves = grid(6, lambda x, y: 0.5 * np.sin(2.0 * x) * np.cos(1.7 * y))
    surface = waves if where == "waves" else (CUBE * 4, triangles(CUBE_FACES))
    spots = rng.uniform(2, 4, (count, 2)) if where == "waves" else rng.uniform(-2.1, 2.1, (count, 2))
    places = np.column_stack((spots, np.full(count, 3.5)))
    turns = [quaternion(np.eye(3) if k % 2 else random_rotation(rng)) for k in range(count)]
    for _ in range(25):
        gap = np.array([g.min() for g, _, _ in contacts(LOWERED[kind](places, turns), surface, 4.0)])
        places[:, 2] -= np.maximum(gap, 0)
    touching = (np.abs(gap) < 1e-6) & (places[:, 2] > 0)
    assert touching.sum() > 0.9 * count
    found = contacts(LOWERED[kind](places - [0, 0, 0.005], turns), surface, 0.01)
    for k in np.flatnonzero(touching):
        assert len(found[k][0]) > 0
        assert -0.0052 < found[k][0].min() < 0


def test_the_gap_has_no_jumps():
    """A plate that is moved over ridges at a small height, whose rim passes from crossing an edge to passing it by."""
    surface = grid(6, lambda x, y: 0.5 * np.sin(2.0 * x) * np.cos(1.7 * y))
    path = np.linspace([3.53, 3.5, 0.42], [3.44, 3.1, 0.49], 600)
    gap = [g.min() for g, _, _ in contacts(cn.cylinders(path, 0.5, 0.1, ROCK, axis=(-0.1829, -0.45499, 0.87151)), surface, 0.5)]
    assert 0.05 < np.min(gap) < np.max(gap) < 0.4
    assert np.max(np.abs(np.diff(gap))) < np.linalg.norm(path[1] - path[0]) * (1 + 1e-9)


@pytest.mark.parametrize("place", [(2.11023, 1.943), (-2.06673, -2.11105), (-2.17683, 1.41341), (2.1, 2.1)])
def test_over_a_corner_of_a_table_nothing_is_pushed_aside(place):
    """A drum, a plate and a block, sunk by 0.005 with their centres beyond the edge or the corner, have upward normals at all
    contacts."""
    at = [[*place, 1.995]]
    drum, plate = (cn.cylinders(np.add(at, [0, 0, h]), r, 2 * h, ROCK) for r, h in ((0.4, 0.35), (0.5, 0.05)))
    for body in (drum, plate, cn.boxes(np.add(at, [0, 0, 0.5]), (0.6, 0.4, 1.0), ROCK)):
        ((gap, normal, _),) = contacts(body, (CUBE * 4, triangles(CUBE_FACES)), 0.01)
        assert len(gap) >= 3
        np.testing.assert_allclose(gap, -0.005, atol=1e-14)
        np.testing.assert_allclose(normal, [[0, 0, 1]] * len(gap), atol=1e-12)
