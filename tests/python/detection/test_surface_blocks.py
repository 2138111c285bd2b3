"""Polyhedra on surfaces of triangles: as on a plane, the gaps of an independent library, no edge that catches."""

import cairn as cn
import numpy as np
import pytest
from shape_pairs import CUBE, CUBE_FACES, ROCK, coal_gap, random_polyhedron, random_rotation, triangles
from test_surfaces import GROUND, grid

TIGHT = cn.NSCD(solver=cn.PPANewton(tol=1e-13))


def flat(n, turn=None, by=(0, 0, 0)):
    """A flat square of n x n unit squares around 0, each of two triangles."""
    vertices, faces = grid(n, lambda x, y: 0 * x)
    vertices = vertices - [n / 2, n / 2, 0]
    return (vertices if turn is None else vertices @ turn.T) + np.asarray(by), faces


def contacts(stones, surface, margin):
    """Contacts of polyhedra, which do not see each other, with a surface: (gap, normal, point) of each."""
    scene = cn.Scene(3)
    scene.add(cn.polyhedra(stones, ROCK), cn.surface(*surface, GROUND))
    scene.interact(ROCK, ROCK, None)
    scene.interact(ROCK, GROUND, cn.Coulomb(mu=0.0))
    sim = cn.Simulation(scene, dt=1e-12, strategy=cn.NSCD(margin=margin), overlap="ignore")
    sim.step()
    c = sim.contacts
    sign = np.where(c.bodies[:, 0] < len(stones), 1.0, -1.0)[:, None]
    stone = np.min(c.bodies, axis=1)
    return [(c.gap[stone == k], (sign * c.normal)[stone == k], c.point[stone == k]) for k in range(len(stones))]


def run(ground, bodies, steps, dt=2e-3, mu=0.3):
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    scene.add(bodies)
    scene.add(ground)
    scene.interact(ROCK, GROUND, cn.Coulomb(mu=mu))
    sim = cn.Simulation(scene, dt, TIGHT)
    for _ in range(steps):
        sim.step()
    return np.array(sim.bodies.position[0]), np.array(sim.bodies.rotation[0]), np.array(sim.bodies.velocity[0]), sim


@pytest.mark.parametrize("kind", ["flat", "edge", "corner", "turning"])
def test_a_block_slides_on_triangles_as_on_a_plane(kind):
    """Impulses on a flat floor of triangles equal those on a plane: lying, tipped on an edge or a corner, and spinning, with
    corners that pass over edges and vertices of the floor. The spinning body has three corners below, since friction on four
    is not unique. For the same reason a tipped block is compared before it falls on four (after 0.144 s; differences then
    grow to 1e-9)."""
    tip = {"flat": 0.0, "edge": 0.3, "corner": 0.5, "turning": 0.0}[kind]
    axis = np.array([1.0, 0, 0]) if kind == "edge" else np.array([1.0, -0.7, 0.2]) / np.sqrt(1.53)
    q = np.append(np.cos(tip / 2), np.sin(tip / 2) * axis)
    velocity = [4.0 if tip else 2.0, 1.4 if tip else 0.7, 0, 0, 0, 5.0 if kind == "turning" else 0.0]
    box = cn.boxes([[-1.0, -0.5, 0.0]], (0.8, 0.5, 0.3), ROCK, rotation=[q], velocity=[velocity])
    corners = CUBE * (0.8, 0.5, 0.3)
    t = 2 * np.cross(q[1:], corners)
    low = (corners + q[0] * t + np.cross(q[1:], t))[:, 2].min()
    box = box.with_(position=np.array([[-1.0, -0.5, -low]]))
    if kind == "turning":
        base = np.array([[0.5, 0, 0], [-0.25, 0.4, 0], [-0.25, -0.4, 0.0]])
        prism = np.vstack([base, base + [0, 0, 0.3]]), [[0, 2, 1], [3, 4, 5], [0, 1, 4, 3], [1, 2, 5, 4], [2, 0, 3, 5]]
        box = cn.polyhedra([prism], ROCK, velocity=[velocity])
    steps = 60 if tip else 250
    on_plane = run(cn.wall((0, 0, 0), (0, 0, 1), GROUND), box, steps)
    on_surface = run(cn.surface(*flat(8), GROUND), box, steps)
    for a, b in zip(on_plane[:3], on_surface[:3]):
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-11)
    a, b = on_plane[3].contacts, on_surface[3].contacts
    assert len(a.gap) == len(b.gap) and (not tip or np.count_nonzero(a.impulse[:, 2]) <= 2)
    np.testing.assert_allclose(np.sort(a.gap), np.sort(b.gap), rtol=0, atol=1e-12)
    assert np.linalg.norm(on_plane[0][:2] - box.position[0, :2]) > 0.3


def triangle_gap(stone, triangle):
    """Distance of a convex mesh and one triangle by Coal; 0 where they cut each other."""
    import coal

    normal = np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
    points = coal.StdVec_Vec3s()
    corners = coal.StdVec_Triangle()
    for x in stone[0]:
        points.append(x)
    for t in stone[1]:
        corners.append(coal.Triangle(*map(int, t)))
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.gjk_tolerance = 1e-15
    request.gjk_max_iterations = 10000
    assert np.linalg.norm(normal) > 0
    still = coal.Transform3s()
    plate, both = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for x in triangle:
        plate.append(x)
    for t in ((0, 1, 2), (0, 2, 1)):
        both.append(coal.Triangle(*t))
    return coal.distance(coal.Convex(points, corners), still, coal.Convex(plate, both), still, request, result)


@pytest.mark.parametrize("kind", ["waves", "cube", "pit"])
def test_least_gap_is_that_of_all_triangles(kind):
    """Stones in front of a rough surface, around a cube and within one: the least gap is that of the nearest triangle."""
    pytest.importorskip("coal")
    rng = np.random.default_rng(3)
    if kind == "waves":
        vertices, faces = grid(6, lambda x, y: 0.5 * np.sin(2.0 * x) * np.cos(1.7 * y))
        places = np.column_stack((rng.uniform(2, 4, (60, 2)), rng.uniform(0.8, 1.6, 60)))
    else:
        vertices, faces = CUBE * 4, triangles(CUBE_FACES)
        places = rng.uniform(-3.5, 3.5, (300, 3)) if kind == "cube" else rng.uniform(-1.2, 1.2, (60, 3))
        if kind == "cube":
            places = places[np.max(np.abs(places), axis=1) > 2.6][:60]
        else:
            faces = faces[:, ::-1]
    stones = []
    for x in places:
        v, f = random_polyhedron(rng)
        stones.append((0.5 * v @ random_rotation(rng).T + x, f))
    expected = np.array([min(triangle_gap(s, t) for t in vertices[faces]) for s in stones])
    clear = expected > 1e-3
    assert clear.sum() > 25
    for (gap, normal, point), e, s in zip(contacts(stones, (vertices, faces), 2.0), expected, stones):
        if not e > 1e-3:
            continue
        assert abs(gap.min() - e) < 1e-9
        k = np.argmin(gap)
        upper, lower = point[k] + gap[k] / 2 * normal[k], point[k] - gap[k] / 2 * normal[k]
        assert min(triangle_gap(s, t) for t in [lower + 1e-7 * np.eye(3)]) == pytest.approx(e, abs=1e-6)
        assert np.max(np.abs(upper - lower)) <= e + 1e-9


def test_depths_are_those_between_solids():
    """Stones a little inside a cube of triangles: the penetration depth by Coal between the solids, or a shorter way out."""
    pytest.importorskip("coal")
    rng = np.random.default_rng(4)
    cube = (CUBE * 4, triangles(CUBE_FACES))
    stones, expected = [], []
    while len(stones) < 60:
        v, f = random_polyhedron(rng)
        v = 0.5 * v @ random_rotation(rng).T
        d = rng.normal(size=3)
        d /= np.linalg.norm(d)
        low, high = 0.0, 8.0
        for _ in range(40):  # pushed in until it touches, then a little further
            middle = (low + high) / 2
            low, high = (low, middle) if coal_gap((v + middle * d, f), cube) > 0 else (middle, high)
        depth = rng.uniform(0.001, 0.02)
        stone = (v + (low - depth) * d, f)
        gap = coal_gap(stone, cube)
        if gap < -1e-4:
            stones.append(stone)
            expected.append(gap)
    same = 0
    for (gap, normal, _), e, (v, f) in zip(contacts(stones, cube, 0.05), expected, stones):
        k = np.argmin(gap)
        same += abs(gap[k] - e) < 1e-9
        assert gap[k] > e - 1e-9
        assert coal_gap((v - (gap[k] - 1e-9) * normal[k], f), cube) > 0
    assert same >= 57


@pytest.mark.parametrize("place", [1.9, 2.3])
@pytest.mark.parametrize("sunk", [0.0, 1e-9, 1e-4])
def test_a_block_overhanging_an_edge_is_not_caught(sunk, place):
    """A plate on a table of triangles, half or more over its rim, slides in without friction, however little it has sunk."""
    top, cliff = CUBE * (4, 4, 2) - [0, 0, 1], triangles(CUBE_FACES)
    moved = {"velocity": [[-1.0, 0, 0, 0, 0, 0]], "driven": ("wx", "wy", "wz")}
    plate = cn.boxes([[place, 0.2, 0.1 - sunk]], (1.0, 0.6, 0.2), ROCK, **moved)
    _, _, velocity, sim = run(cn.surface(top, cliff, GROUND), plate, 300, mu=0.0)
    np.testing.assert_allclose(velocity, [-1, 0, 0, 0, 0, 0], atol=1e-8)
    assert abs(sim.bodies.position[0, 2] - 0.1) < 1e-8 + sunk


def test_a_block_lies_across_ridges_and_corners():
    """On a small table it hangs over all round: four points at its corners; over a ridge it rocks and does not sink."""
    plate = cn.boxes([[0.02, 0.01, 0.1]], (3.0, 3.0, 0.2), ROCK)
    *_, sim = run(cn.surface(CUBE - [0, 0, 0.5], triangles(CUBE_FACES), GROUND), plate, 50)
    assert abs(sim.bodies.position[0, 2] - 0.1) < 1e-9
    c = sim.contacts
    carrying = c.point[c.impulse[:, 2] > 0]
    np.testing.assert_allclose(np.abs(c.point[:, :2]), 0.5, atol=1e-6)
    assert 3 <= len(carrying)
    ridge = np.array([[-3, 0, 0], [3, 0, 0], [-3, -3, -1], [3, -3, -1], [-3, 3, -1], [3, 3, -1.0]])
    faces = [[2, 3, 1, 0], [0, 1, 5, 4]]
    *_, sim = run(cn.surface(ridge, faces, GROUND), plate, 50)
    assert sim.bodies.position[0, 2] > 0.0999
    assert np.all(np.abs(sim.contacts.point[sim.contacts.gap < 1e-6][:, 1]) < 1e-6)


def test_a_pile_comes_to_rest_in_a_hopper_that_may_rise():
    """Stones in a funnel of triangles stay in it, and it carries their weight."""
    rng = np.random.default_rng(5)
    rim, pit = 2.0, 0.4
    vertices = [[s * x, t * x, z] for x, z in ((rim, 1.5), (pit, 0)) for s, t in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
    faces = [[k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k] for k in range(4)] + [[4, 5, 6, 7]]
    stones = []
    for k in range(6):
        v, f = random_polyhedron(rng)
        stones.append((0.25 * v + [0.5 * (k % 3 - 1), 0.5 * (k // 3 % 2) - 0.25, 1.1], f))
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    scene.add(cn.polyhedra(stones, ROCK), cn.surface(vertices, faces, GROUND, velocity=lambda t: (0, 0, 0.3)))
    for pair in ((ROCK, ROCK), (ROCK, GROUND)):
        scene.interact(*pair, cn.Coulomb(mu=0.5))
    sim = cn.Simulation(scene, 4e-3, cn.NSCD(solver=cn.NLGS(tol=1e-6)))
    sim.run(steps=250, progress=False)
    assert sim.bodies.position[:6, 2].min() > 0.3 * sim.time
    np.testing.assert_allclose(sim.bodies.velocity[:6, 2], 0.3, atol=0.05)
    c, weight = sim.contacts, sim.bodies.mass[:6].sum() * 9.81 * 4e-3
    carried = np.abs(c.impulse[np.any(c.bodies == 6, axis=1), 2]).sum()
    assert carried == pytest.approx(weight, rel=0.1)


@pytest.mark.parametrize(
    "sizes, cell, place, turned",
    [
        ((0.8, 0.5, 0.3), 1.0, 0.0, True),
        ((8e-7, 5e-7, 3e-7), 1e-6, 0.0, True),
        ((8e3, 5e3, 3e3), 1e4, 0.0, True),
        ((1e-6, 2e-6, 1e-6), 1e3, 0.0, False),
        ((5.0, 5.0, 5e-4), 1.0, 0.0, True),
        ((5.0, 5e-4, 5e-4), 1.0, 0.0, True),
        ((0.8, 0.5, 0.3), 1.0, 1e8, False),
    ],
)
@pytest.mark.parametrize("share", [0.0, 1e-9, -1e-9, 1e-3, -1e-3, -0.3])
def test_blocks_of_any_size_lie_on_four_corners(sizes, cell, place, turned, share):
    """Sizes from 1e-6 to 1e4, tiny on huge triangles, plates and needles of aspect 1e4, far away, touching or deep inside."""
    rng = np.random.default_rng(8)
    turn = random_rotation(rng) if turned else np.eye(3)
    sizes = np.array(sizes)
    gap = share * sizes.min()
    about = np.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]])
    centre = np.array([0.13 * cell, 0.21 * cell, sizes[2] / 2 + gap])
    stone = ((CUBE * sizes) @ about.T + centre) @ turn.T
    scene = cn.Scene(3, origin=(place, place, 0))
    shift = np.array([place, place, 0])
    v, f = flat(8)
    scene.add(cn.polyhedra([(stone + shift, CUBE_FACES)], ROCK), cn.surface(cell * v @ turn.T + shift, f, GROUND))
    scene.interact(ROCK, GROUND, cn.Coulomb(mu=0.0))
    sim = cn.Simulation(scene, dt=1e-12, strategy=cn.NSCD(margin=2e-3 * sizes.min()), overlap="ignore")
    sim.step()
    c = sim.contacts
    extent = sizes.max() + cell
    assert len(c.gap) == 4
    np.testing.assert_allclose(c.gap, gap, atol=1e-14 * extent)
    np.testing.assert_allclose(c.normal * np.sign(c.normal @ turn[:, 2])[:, None], [turn[:, 2]] * 4, atol=1e-12)
    corners = (stone[:4] + shift - (gap / 2) * turn[:, 2]) if not place else None
    if corners is not None:
        near = np.linalg.norm(c.point[:, None] - corners[None], axis=2)
        assert np.all(np.sort(near.argmin(axis=1)) == np.arange(4)) and near.min(axis=1).max() < 1e-13 * extent


def test_triangles_that_share_a_corner_and_duplicated_blocks():
    """A fan of 200 triangles round one vertex and a block over it: four corners, whatever the number of triangles."""
    angle = 2 * np.pi * np.arange(200) / 200
    fan = np.vstack([[0, 0, 0], np.column_stack((3 * np.cos(angle), 3 * np.sin(angle), 0 * angle))])
    faces = [[0, 1 + k, 1 + (k + 1) % 200] for k in range(200)]
    stones = [(CUBE * 0.5 + [0, 0, 0.25], CUBE_FACES)] * 2 + [(CUBE * 0.5 + [0.25, 0.25, 0.25], CUBE_FACES)]
    for gap, normal, _ in contacts(stones, (fan, faces), 0.01):
        assert len(gap) == 4
        np.testing.assert_allclose(gap, 0, atol=1e-15)
        np.testing.assert_allclose(normal, [[0, 0, 1]] * 4, atol=1e-14)
