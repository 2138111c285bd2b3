"""Capsules, cylinders, superquadrics: mass and inertia, gaps of an independent library and closed forms, few points that span."""

import warnings

import cairn as cn
import numpy as np
import pytest
from round_pairs import FAMILIES, OTHER, PAIRS, ROUND, Pairs, coal_gaps, judge, known_family, random_pairs
from shape_pairs import CUBE, CUBE_FACES, ROCK, random_polyhedron, random_rotation


def quaternion(turn):
    """Quaternion of a rotation matrix whose angle is not pi."""
    w = np.sqrt(max(1 + np.trace(turn), 1e-30)) / 2
    return np.array([w, *(np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / (4 * w))])


def meet(first, second, margin):
    """Contacts of pairs of one body each, each pair in a place of its own: gaps, normals from the second to the first, points."""
    scene = cn.Scene(3)
    count = len(first)
    side = int(np.ceil(count ** (1 / 3)))
    k = np.arange(count)
    place = 20.0 * np.stack([k % side, k // side % side, k // side**2], axis=1)
    for sets in (first, second):
        for s, p in zip(sets, place):
            scene.add(s.with_(position=s.position + p))
    scene.interact(ROCK, OTHER, cn.Coulomb(mu=0.0))
    scene.interact(ROCK, ROCK, None)
    scene.interact(OTHER, OTHER, None)
    sim = cn.Simulation(scene, dt=1e-12, strategy=cn.NSCD(margin=margin), overlap="ignore")
    sim.step()
    c = sim.contacts
    pair = np.min(c.bodies, axis=1)
    assert np.all(np.max(c.bodies, axis=1) - pair == count)
    sign = np.where(c.bodies[:, 0] < count, 1.0, -1.0)[:, None]
    return [(c.gap[pair == i], (sign * c.normal)[pair == i], c.point[pair == i] - place[i]) for i in range(count)]


@pytest.mark.parametrize("kinds", PAIRS, ids=" ".join)
def test_random_pairs_have_the_gaps_of_coal_and_of_proved_bounds(kinds):
    """Apart and overlapping: the separation along the normal is the gap, so that the distance is no less, and points of both
    bodies are no farther apart; overlaps are those of Coal, or less where its own is not the least."""
    pytest.importorskip("coal")
    pairs = random_pairs(np.random.default_rng(sum(map(ord, "".join(kinds)))), kinds, 200, near=(-0.08, 0.4))
    gap, normal, point = pairs.meet(0.3)
    coal = coal_gaps(pairs)[0]
    known = np.abs(coal) < 1e300  # else it has no answer
    assert known.sum() > 190
    found = np.isfinite(gap)
    assert np.array_equal(found[known], coal[known] < 0.3)
    apart, under = found & (gap > 0), found & (gap < 0)
    assert apart.sum() > 80 and under.sum() >= 4 and (~found).sum() > 5
    low, high = pairs.part(found).bounds(gap[found], normal[found], point[found])
    np.testing.assert_allclose(low, gap[found], rtol=0, atol=1e-13)
    np.testing.assert_allclose(high[gap[found] > 0], gap[apart], rtol=0, atol=1e-12)
    np.testing.assert_allclose(gap[apart & known], coal[apart & known], atol=1e-8)
    # a move along the normal by the depth parts them; of few deep overlaps there is a shorter one on another side
    assert np.sum(gap[under & known] < coal[under & known] - 1e-7) <= 1


@pytest.mark.parametrize("kinds", [k for k in PAIRS if "superquadric" in k], ids=" ".join)
def test_superquadrics_of_any_exponents_have_the_gaps_of_proved_bounds(kinds):
    """From nearly boxes to nearly octahedra; overlaps beside a search from all sides."""
    pairs = random_pairs(np.random.default_rng(4), kinds, 150, near=(-0.05, 0.4), general=True)
    gap, normal, point = pairs.meet(0.3)
    found = np.isfinite(gap)
    part = pairs.part(found)
    low, high = part.bounds(gap[found], normal[found], point[found])
    np.testing.assert_allclose(low, gap[found], rtol=0, atol=1e-13)
    apart = gap[found] > 0
    assert apart.sum() > 60
    # where they are sharp a double tells the normal, and so the points, less well than the gap
    assert np.median(high[apart] - gap[found][apart]) < 1e-13 and np.max(high[apart] - gap[found][apart]) < 1e-5
    some = np.concatenate([np.flatnonzero(~apart)[:4], np.argsort(high - gap[found] * apart)[-4:]])
    least = judge(part.part(some), [normal[found][some]])
    np.testing.assert_allclose(gap[found][some], least, rtol=0, atol=1e-10)
    assert np.all(judge(pairs.part(~found).part(slice(4)), []) > 0.3 - 1e-6)


@pytest.mark.parametrize("kinds", [k for k in PAIRS if "polyhedron" not in k], ids=" ".join)
def test_units_of_powers_of_two_leave_every_bit(kinds):
    unit = 2.0**-20
    pairs = random_pairs(np.random.default_rng(3), kinds, 200, near=(-0.05, 0.3), general=True)
    lengths = [slice(3) if k == "superquadric" else slice(None) for k in kinds]
    small = [np.copy(s) for s in pairs.sizes]
    for s, which in zip(small, lengths):
        s[:, which] *= unit
    found = pairs.meet(0.25, spacing=8.0)
    scaled = Pairs(kinds, small, pairs.turns, pairs.place * unit).meet(0.25 * unit, spacing=8.0 * unit)
    assert np.isfinite(found[0]).sum() > 100
    assert np.array_equal(found[0], scaled[0] / unit)
    assert np.array_equal(found[1], scaled[1], equal_nan=True)


@pytest.mark.parametrize("family", FAMILIES)
def test_built_pairs_have_the_gaps_they_were_built_with(family):
    """Ends, sides, rims, tips; gaps of 0, 1e-15 to 1e-3 either way, and pairs out of reach: none missed and none false."""
    rng = np.random.default_rng(sum(map(ord, family)))
    for _ in range(4):
        pairs, margin = known_family(family, 93, rng)
        gap, normal, _ = pairs.meet(margin)
        found = np.isfinite(gap)
        assert np.array_equal(found, pairs.gap <= margin)
        size = pairs.size()[found]
        assert np.max(np.abs(gap - pairs.gap)[found] / size) < 1e-13
        np.testing.assert_allclose(normal[found], pairs.normal[found], rtol=0, atol=1e-9)


def test_mass_and_inertia_are_those_of_the_shapes():
    """Beside sums over a fine grid of points."""
    grid = (np.arange(160) + 0.5) / 160 * 2 - 1
    x, y, z = np.meshgrid(grid, grid, grid, indexing="ij")
    cases = [
        (cn.capsules([[0, 0, 0]], 0.4, 1.0, ROCK), np.hypot(np.hypot(x, y), np.maximum(np.abs(z) - 0.5, 0)) <= 0.4),
        (cn.cylinders([[0, 0, 0]], 0.7, 1.6, ROCK), (np.hypot(x, y) <= 0.7) & (np.abs(z) <= 0.8)),
    ]
    for e1, e2 in ((1.0, 1.0), (0.3, 0.5), (1.5, 0.7), (0.4, 1.8)):
        inside = (np.abs(x / 0.9) ** (2 / e2) + np.abs(y / 0.6) ** (2 / e2)) ** (e2 / e1) + np.abs(z / 0.8) ** (2 / e1) <= 1
        cases.append((cn.superquadrics([[0, 0, 0]], (0.9, 0.6, 0.8), (e1, e2), ROCK), inside))
    for s, inside in cases:
        cell = 1000.0 * (2 / 160) ** 3
        moments = [cell * np.sum((a * a + b * b)[inside]) for a, b in ((y, z), (x, z), (x, y))]
        assert s.mass[0] == pytest.approx(cell * inside.sum(), rel=4e-3)
        np.testing.assert_allclose(s.inertia[0], moments, rtol=6e-3)
    ball, pole = cn.spheres([[0, 0, 0]], 0.5, ROCK), cn.capsules([[0, 0, 0]], 0.5, 0.0, ROCK)
    even = cn.superquadrics([[0, 0, 0]], 0.5, (1, 1), ROCK)
    for s in (pole, even):
        np.testing.assert_allclose(s.mass, ball.mass, rtol=1e-13)
        np.testing.assert_allclose(s.inertia, ball.inertia, rtol=1e-13)


def one(first, second, margin=0.05):
    (found,) = meet([first], [second], margin)
    return found


@pytest.mark.parametrize("gap", [0.0, 1e-12, -1e-12, 1e-6, -1e-6, 1e-3, -1e-3, -0.05])
def test_lines_and_faces_touch_where_they_end(gap):
    """Flush contacts with known answers: capsules side by side, drums on drums, on boxes and on planes."""
    along = np.array([0.0, 0.0, 1.0])
    turn = random_rotation(np.random.default_rng(7))
    q = [quaternion(turn)]
    axis = turn @ along
    side = turn @ [1.0, 0, 0]

    def far(x):
        return [turn @ np.asarray(x, float)]

    cases = []
    two = (np.array([[0.3 + gap / 2, 0, 0.5], [0.3 + gap / 2, 0, -0.3]]), side)
    capsule = cn.capsules([[0, 0, 0]], 0.3, 1.0, OTHER, axis=axis)
    cases.append((cn.capsules(far([0.6 + gap, 0, 0.2]), 0.3, 1.0, ROCK, axis=axis), capsule, *two))
    cases.append((cn.cylinders(far([0.7 + gap, 0, 0.2]), 0.4, 1.0, ROCK, axis=axis), capsule, *two))
    drum = cn.cylinders([[0, 0, 0]], 0.3, 1.0, OTHER, axis=axis)
    cases.append((cn.cylinders(far([0.7 + gap, 0, 0.2]), 0.4, 1.0, ROCK, axis=axis), drum, *two))
    box = cn.boxes([[0, 0, 0]], (0.6, 2, 1.0), OTHER, rotation=q)
    cases.append((cn.cylinders(far([0.7 + gap, 0, 0.2]), 0.4, 1.0, ROCK, axis=axis), box, *two))
    cases.append((cn.capsules(far([0.7 + gap, 0, 0.2]), 0.4, 1.0, ROCK, axis=axis), box, *two))
    for first, second, points, normal in cases:
        g, n, x = one(first, second)
        np.testing.assert_allclose(g, gap, atol=2e-15)
        np.testing.assert_allclose(n, np.broadcast_to(normal, n.shape), atol=1e-12)
        order = np.argsort(-(x @ axis))
        np.testing.assert_allclose(x[order], points @ turn.T, atol=1e-9 + abs(gap))
    ends = [(cn.cylinders(far([0.1, 0, 0.9 + gap]), 0.4, 0.8, ROCK, axis=axis), drum, 0.3)]
    ends.append((cn.cylinders(far([0.1, 0, 0.9 + gap]), 0.3, 0.8, ROCK, axis=axis), box, 0.2))
    for first, second, least in ends:
        g, n, x = one(first, second)
        assert 3 <= len(g) <= 4
        np.testing.assert_allclose(g, gap, atol=2e-15)
        np.testing.assert_allclose(n, np.broadcast_to(axis, n.shape), atol=1e-12)
        np.testing.assert_allclose(x @ axis, 0.5 + gap / 2, atol=1e-12)
        spread = x - x.mean(axis=0)
        assert np.linalg.svd(spread, compute_uv=False)[1] > least


def settle(bodies, steps, dt=2e-3, mu=0.5, gravity=(0, 0, -9.81), tol=1e-12, ground=None):
    scene = cn.Scene(3, gravity=gravity)
    scene.add(*bodies)
    scene.add(cn.wall((0, 0, 0), (0, 0, 1), OTHER) if ground is None else ground)
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=mu))
    scene.interact(ROCK, OTHER, cn.Coulomb(mu=mu))
    sim = cn.Simulation(scene, dt, cn.NSCD(solver=cn.PPANewton(tol=tol)))
    for _ in range(steps):
        sim.step()
    return sim


def test_a_column_of_drums_stands():
    """Eight drums of different radii: each joint carries the weight above, and nothing moves in 2 s."""
    heights = np.array([0.5, 0.4, 0.6, 0.5, 0.3, 0.5, 0.4, 0.5])
    z = np.cumsum(heights) - heights / 2
    radii = np.array([0.5, 0.45, 0.48, 0.4, 0.42, 0.4, 0.35, 0.35])
    sim = settle([cn.cylinders(np.column_stack((0 * z, 0 * z, z)), radii, heights, ROCK)], 1000)
    assert np.max(np.abs(sim.bodies.position[:8] - np.column_stack((0 * z, 0 * z, z)))) < 1e-9
    assert np.max(np.abs(sim.bodies.velocity)) < 1e-9
    c, weight = sim.contacts, sim.bodies.mass[:8] * 9.81 * 2e-3
    for k in range(1, 8):
        joint = np.any(c.bodies == k, axis=1) & np.any(c.bodies == k - 1, axis=1)
        assert joint.sum() >= 3
        assert np.abs(c.impulse[joint, 2].sum()) == pytest.approx(weight[k:].sum(), rel=1e-9)


@pytest.mark.parametrize("kind", ["capsule", "cylinder", "superquadric"])
def test_they_roll_down_a_slope(kind):
    """a = g sin / (1 + I/(m r^2)), so long as tan(slope) < mu (1 + m r^2/I)."""
    slope, r = 0.3, 0.25
    if kind == "superquadric":  # of revolution about y, long
        s = cn.superquadrics([[0, 0, r]], (r, 0.6, r), (1, 1), ROCK)
        inertia = s.inertia[0, 1]
    else:
        make = cn.capsules if kind == "capsule" else cn.cylinders
        s = make([[0, 0, r]], r, 0.8, ROCK, axis=(0, 1, 0))
        inertia = s.inertia[0, 2]
    gravity = (9.81 * np.sin(slope), 0, -9.81 * np.cos(slope))
    dt, steps = 1e-3, 400
    sim = settle([s], steps, dt=dt, gravity=gravity)
    a = gravity[0] / (1 + inertia / (s.mass[0] * r * r))
    np.testing.assert_allclose(sim.bodies.velocity[0], [a * dt * steps, 0, 0, 0, a * dt * steps / r, 0], atol=1e-6)
    assert abs(sim.bodies.position[0, 2] - r) < 1e-9


def test_they_rest_on_triangles_and_in_tubes():
    """A capsule lies, rolls and slides on a floor of triangles as on a plane; in a tube it comes to rest at the bottom, as a
    cube does."""
    from test_surfaces import GROUND, grid

    assert GROUND.name
    v, f = grid(8, lambda x, y: 0 * x)
    floor = cn.surface(v - [4, 4, 0], f, OTHER)
    s = cn.capsules([[-1, 0.2, 0.2]], 0.2, 0.7, ROCK, axis=(0.3, 1, 0), velocity=[[1.5, 0.1, 0, 0, 0, 3]])
    sims = [settle([s], 200, ground=g) for g in (None, floor)]
    np.testing.assert_allclose(sims[0].bodies.position[0], sims[1].bodies.position[0], atol=1e-9)
    np.testing.assert_allclose(sims[0].bodies.velocity[0], sims[1].bodies.velocity[0], atol=1e-9)
    pipe = cn.tube((0, -5, 0), (0, 5, 0), 1.0, OTHER)
    box = cn.boxes([[0, 0, -0.6]], 0.4, ROCK, velocity=[[0, 0.2, 0, 0, 0, 0]])
    for s, low, points in ((cn.capsules([[0, 0, -0.7]], 0.2, 0.8, ROCK, axis=(0, 1, 0)), -0.8, 2), (box, 0.2 - 0.96**0.5, 4)):
        sim = settle([s], 400, ground=pipe)
        assert len(sim.contacts.gap) == points
        np.testing.assert_allclose(sim.bodies.position[0, [0, 2]], [0, low], atol=1e-4)
        np.testing.assert_allclose(sim.bodies.velocity[0], 0, atol=1e-9)


def test_a_capsule_crosses_an_edge_once():
    """Across a ridge it has one contact, where the axes of both are nearest."""
    ridge = np.array([[-3, 0, 0], [3, 0, 0], [-3, -3, -3], [3, -3, -3], [-3, 3, -3], [3, 3, -3.0]])
    surface = cn.surface(ridge, [[2, 3, 1, 0], [0, 1, 5, 4]], OTHER)
    for x in (0.0, 0.5, 2.99):
        scene = cn.Scene(3)
        scene.add(cn.capsules([[x, 0.1, 0.25]], 0.2, 1.0, ROCK, axis=(0.1, 1, 0)), surface)
        scene.interact(ROCK, OTHER, cn.Coulomb(mu=0.0))
        sim = cn.Simulation(scene, dt=1e-12, strategy=cn.NSCD(margin=0.1))
        sim.step()
        assert len(sim.contacts.gap) == 1
        assert sim.contacts.gap[0] == pytest.approx(0.05, abs=1e-12)
        np.testing.assert_allclose(sim.contacts.point[0], [x - 0.01, 0, 0.025], atol=1e-9)


@pytest.mark.parametrize("scale, far", [(1e-6, 0.0), (1e4, 0.0), (2.0**-20, 0.0), (1.0, 1e8)])
def test_sizes_and_places_do_not_matter(scale, far):
    """Gaps and points in other units, and far from the origin of coordinates, whose scene keeps them near."""
    rng = np.random.default_rng(11)
    turns = [random_rotation(rng) for _ in range(2)]
    for a in ROUND:
        found = []
        for unit, place in ((1.0, 0.0), (scale, far)):
            scene = cn.Scene(3, origin=(place, place, 0))
            for turn, x, material in ((turns[0], (0.7, 0.6, 0.5), ROCK), (turns[1], (0, 0, 0), OTHER)):
                where = {"rotation": [quaternion(turn)]}
                x = unit * np.array([x]) + [place, place, 0]
                if a == "superquadric":
                    s = cn.superquadrics(x, unit * np.array([0.5, 0.3, 0.4]), (0.7, 1.2), material, **where)
                else:
                    s = (cn.capsules if a == "capsule" else cn.cylinders)(x, 0.3 * unit, 0.9 * unit, material, **where)
                scene.add(s)
            scene.interact(ROCK, OTHER, cn.Coulomb(mu=0.0))
            sim = cn.Simulation(scene, dt=1e-12, strategy=cn.NSCD(margin=unit), overlap="ignore")
            sim.step()
            found.append(sim.contacts.gap / unit)
        np.testing.assert_allclose(found[0], found[1], rtol=0, atol=1e-12 if not far else 1e-7)


def test_long_and_deep():
    """Needles of aspect 1e4 crossing and end to end; bodies one inside the other are pushed out the short way."""
    needle = cn.capsules([[0, 0, 0]], 1e-4, 1.0, OTHER)
    g, n, _ = one(cn.capsules([[0, 3e-4, 0.2]], 1e-4, 1.0, ROCK, axis=(1, 0, 0)), needle, 1e-3)
    assert len(g) == 1 and g[0] == pytest.approx(1e-4, rel=1e-9)
    np.testing.assert_allclose(n[0], [0, 1, 0], atol=1e-9)
    g, n, _ = one(cn.cylinders([[0, 0, 1.0 + 2e-4]], 1e-4, 1.0, ROCK), cn.cylinders([[0, 0, 0]], 1e-4, 1.0, OTHER), 1e-3)
    assert len(g) >= 3
    np.testing.assert_allclose(g, 2e-4, rtol=1e-9)
    g, n, _ = one(cn.cylinders([[0, 0, 0.3]], 0.5, 1.0, ROCK), cn.cylinders([[0, 0, 0]], 0.5, 1.0, OTHER))
    np.testing.assert_allclose(g, -0.7, atol=1e-12)
    np.testing.assert_allclose(n, [[0, 0, 1]] * len(g), atol=1e-12)
    g, n, _ = one(cn.spheres([[0.1, 0, 0.0]], 0.2, ROCK), cn.cylinders([[0, 0, 0]], 0.5, 2.0, OTHER))
    assert g[0] == pytest.approx(-0.6, abs=1e-12)
    np.testing.assert_allclose(n[0], [1, 0, 0], atol=1e-12)


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: cn.capsules([[0, 0, 0]], 0.0, 1.0, ROCK), r"radii\[0\] is 0"),
        (lambda: cn.capsules([[0, 0, 0], [1, 0, 0]], 0.1, [1.0, -1.0], ROCK), r"lengths\[1\] is -1"),
        (lambda: cn.cylinders([[0, 0, 0]], 0.1, 0.0, ROCK), r"lengths\[0\] is 0"),
        (lambda: cn.cylinders([[0, 0, np.nan]], 0.1, 1.0, ROCK), "centers"),
        (lambda: cn.cylinders([[0, 0, 0]], 0.1, 1.0, ROCK, axis=(0, 0, 0)), r"axis\[0\] is zero"),
        (lambda: cn.cylinders([[0, 0, 0]], 0.1, 1.0, ROCK, axis=(0, 0, 1), rotation=[[1, 0, 0, 0]]), "axis is given with"),
        (lambda: cn.superquadrics([[0, 0, 0]], (1, 0, 1), (1, 1), ROCK), r"half_axes\[0\]"),
        (lambda: cn.superquadrics([[0, 0, 0]], (1, 1, 1), (1, 2.5), ROCK), r"exponents\[0\].*0.05 to 1.95"),
        (lambda: cn.superquadrics([[0, 0, 0]], (1, 1), (1, 1), ROCK), r"half_axes has shape \(2,\)"),
    ],
)
def test_bad_sizes_are_refused(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def test_files_keep_them_and_they_meet_each_other_and_walls(tmp_path):
    sets = [cn.capsules([[0, 0, 1]], 0.2, 0.5, ROCK), cn.superquadrics([[2, 0, 1]], (0.3, 0.2, 0.4), (0.5, 1.5), ROCK)]
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    scene.add(*sets, cn.cylinders([[4, 0, 1]], 0.3, 0.5, ROCK), cn.wall((0, 0, 0), (0, 0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.5))
    scene.save(tmp_path / "scene.h5")
    sims = [cn.Simulation(s, dt=5e-3) for s in (scene, cn.Scene.load(tmp_path / "scene.h5"))]
    for sim in sims:
        sim.run(steps=100, progress=False)
    assert np.array_equal(sims[0].bodies.position, sims[1].bodies.position)
    sims[0].checkpoint(tmp_path / "state.h5")
    other = cn.Simulation(scene, dt=5e-3)
    other.restore(tmp_path / "state.h5")
    for sim in (sims[1], other):
        sim.run(steps=20, progress=False)
    assert np.array_equal(sims[1].bodies.velocity, other.bodies.velocity)
    scene = cn.Scene(3)
    scene.add(*sets, cn.cylinders([[4, 0, 1]], 0.3, 0.5, ROCK))
    scene.add(cn.surface([[-5, -5, 0], [5, -5, 0], [0, 5, 0.0]], [[0, 1, 2]], ROCK), cn.wall((0, 0, -1), (0, 0, 1), ROCK))
    scene.add(cn.tube((0, 0, 0), (0, 0, 1), 9.0, ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.5))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        cn.Simulation(scene, 1e-3)


def test_polyhedra_meet_round_shapes_as_their_own_kind():
    """A superquadric of small exponents is nearly the box, a capsule of length 0 the sphere."""
    rng = np.random.default_rng(3)
    v, f = random_polyhedron(rng)
    stone = cn.polyhedra([(v + [0, 0, 1.6], f)], ROCK)
    nearly = cn.superquadrics([[0, 0, 0]], 0.5, (0.05, 0.05), OTHER)
    box = cn.polyhedra([(CUBE, CUBE_FACES)], OTHER)
    assert one(stone, nearly, 1.0)[0].min() == pytest.approx(one(stone, box, 1.0)[0].min(), abs=0.05)
    ball, none = cn.spheres([[0, 0, -0.2]], 0.5, OTHER), cn.capsules([[0, 0, -0.2]], 0.5, 0.0, OTHER)
    assert one(stone, ball, 1.0)[0].min() == pytest.approx(one(stone, none, 1.0)[0].min(), abs=1e-14)


@pytest.mark.parametrize("kind", ["waves", "cube"])
def test_capsules_have_the_gap_of_the_nearest_triangle(kind):
    """In front of a rough surface and around a cube, beside Coal over all triangles."""
    coal = pytest.importorskip("coal")
    from test_surfaces import grid, triangles

    rng = np.random.default_rng(12)
    if kind == "waves":
        vertices, faces = grid(6, lambda x, y: 0.5 * np.sin(2.0 * x) * np.cos(1.7 * y))
        places = np.column_stack((rng.uniform(2, 4, (60, 2)), rng.uniform(1.0, 1.8, 60)))
    else:
        vertices, faces = CUBE * 4, triangles(CUBE_FACES)
        places = rng.uniform(-3.5, 3.5, (300, 3))
        places = places[np.max(np.abs(places), axis=1) > 2.4][:60]
    turns = [random_rotation(rng) for _ in places]
    expected = []
    for x, turn in zip(places, turns):
        least = np.inf
        for t in vertices[faces]:
            points, both = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
            for v in t:
                points.append(v)
            for c in ((0, 1, 2), (0, 2, 1)):
                both.append(coal.Triangle(*c))
            request, result = coal.DistanceRequest(), coal.DistanceResult()
            request.gjk_tolerance = 1e-12
            request.gjk_max_iterations = 10000
            frames = coal.Transform3s(turn, x), coal.Transform3s()
            shapes = coal.Capsule(0.2, 0.8), coal.Convex(points, both)
            least = min(least, coal.distance(shapes[0], frames[0], shapes[1], frames[1], request, result))
        expected.append(least)
    scene = cn.Scene(3)
    scene.add(cn.capsules(places, 0.2, 0.8, ROCK, rotation=[quaternion(t) for t in turns]), cn.surface(vertices, faces, OTHER))
    scene.interact(ROCK, ROCK, None)
    scene.interact(ROCK, OTHER, cn.Coulomb(mu=0.0))
    sim = cn.Simulation(scene, dt=1e-12, strategy=cn.NSCD(margin=2.0), overlap="ignore")
    sim.step()
    body = np.min(sim.contacts.bodies, axis=1)
    clear = 0
    for k, e in enumerate(expected):
        if e > 1e-3:
            clear += 1
            assert sim.contacts.gap[body == k].min() == pytest.approx(e, abs=1e-9)
    assert clear > 25
