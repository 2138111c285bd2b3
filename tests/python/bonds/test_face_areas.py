"""The area by which a joint of bodies with sides holds: that of the face between them, whatever points detection keeps of it."""

import cairn as cn
import numpy as np
import pytest

BED, BODY = cn.Material("bed", density=1e9), cn.Material("body", density=1000.0)
R = 0.05


def law():
    strengths = dict(normal_strength=2e6, tangential_strength=3e6, normal_work=10.0, tangential_work=30.0)
    return cn.MAL(normal_stiffness=1e12, tangential_stiffness=5e11, **strengths)


def prism(n, radius=R, bottom=0.0, height=0.1, turn=0.0):
    angle = turn + 2 * np.pi * np.arange(n) / n
    ring = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    points = np.vstack([np.column_stack([ring, np.full(n, z)]) for z in (bottom, bottom + height)])
    sides = [[k, (k + 1) % n, n + (k + 1) % n, n + k] for k in range(n)]
    return points, [list(range(n))[::-1], list(range(n, 2 * n)), *sides]


def regular(n, radius=R):
    return n / 2 * radius**2 * np.sin(2 * np.pi / n)


def torn_area(lower, upper):
    """Energy dissipated in pulling a body off, over the work of its joint [m2]."""
    scene = cn.Scene(3)
    scene.add(lower)
    drive = [0, 0, 0.1, 0, 0, 0]
    scene.add(upper(driven=("vx", "vy", "vz", "wx", "wy", "wz"), drive=drive))
    scene.interact(BED, BODY, law())
    sim = cn.Simulation(scene, 1e-6, overlap="ignore")
    for _ in range(120):
        sim.step()
    return sim.info["energy"]["released"] / 10.0


FREE = dict(mass=1e9, free="vz")


def wall():
    return cn.wall((0, 0, 0), (0, 0, 1), BED, **FREE)


def slab():
    return cn.boxes([[0, 0, -0.05]], [2, 2, 0.1], BED)


def surface(cells, shift=0.003, half=0.2):
    grid = np.linspace(-half, half, cells + 1) + shift
    x, y = np.meshgrid(grid, grid, indexing="ij")
    number = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    low, right, far, up = (number[a, b].ravel() for a, b in ((np.s_[:-1], np.s_[:-1]), (np.s_[1:], np.s_[:-1]),
                                                            (np.s_[1:], np.s_[1:]), (np.s_[:-1], np.s_[1:])))  # fmt: skip
    triangles = np.vstack([np.column_stack([low, right, far]), np.column_stack([low, far, up])])
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    return cn.surface(points, triangles, BED, inertia=(1e9,) * 3, **FREE)


def cube(**options):
    return cn.boxes([[0, 0, 0.05]], [0.1, 0.1, 0.1], BODY, **options)


def turned_cube(**options):
    return cn.boxes([[0, 0, 0.05]], [0.1, 0.1, 0.1], BODY, rotation=[[np.cos(np.pi / 8), 0, 0, np.sin(np.pi / 8)]], **options)


def cylinder(**options):
    return cn.cylinders([[0, 0, 0.05]], R, 0.1, BODY, **options)


@pytest.mark.parametrize("n", [3, 4, 5, 6, 8, 12, 24])
def test_a_prism_is_joined_by_its_whole_base(n):
    def upper(**options):
        return cn.polyhedra([prism(n)], BODY, **options)

    assert torn_area(wall(), upper) == pytest.approx(regular(n), rel=1e-6)
    assert torn_area(slab(), upper) == pytest.approx(regular(n), rel=1e-6)
    turned = 2 * n * (R * np.cos(np.pi / n)) ** 2 * np.tan(np.pi / (2 * n))
    below = cn.polyhedra([prism(n, bottom=-0.1, turn=np.pi / n)], BED)
    assert torn_area(below, upper) == pytest.approx(turned, rel=1e-6)


def test_turned_boxes_share_an_octagon():
    assert torn_area(cn.boxes([[0, 0, -0.05]], [0.1] * 3, BED), turned_cube) == pytest.approx(0.02 * (2**0.5 - 1), rel=1e-6)


@pytest.mark.parametrize("cells", [1, 3, 12, 29])
def test_bodies_on_a_surface_are_joined_by_what_lies_on_all_its_triangles(cells):
    """Points of contact are counted triangle by triangle, of which most have one, two or none."""
    assert torn_area(surface(cells), cube) == pytest.approx(0.01, rel=1e-6)
    assert torn_area(surface(cells), turned_cube) == pytest.approx(0.01, rel=1e-6)
    assert torn_area(surface(cells), cylinder) == pytest.approx(np.pi * R**2, rel=1e-6)


def test_a_body_over_the_rim_of_a_surface_is_joined_by_what_lies_on_it():
    assert torn_area(surface(8, shift=0.2), cube) == pytest.approx(0.0025, rel=1e-6)


def test_ends_of_cylinders_have_the_area_of_disks():
    assert torn_area(wall(), cylinder) == pytest.approx(np.pi * R**2, rel=1e-6)
    assert torn_area(slab(), cylinder) == pytest.approx(np.pi * R**2, rel=1e-6)
    half = cn.boxes([[0.5, 0, -0.05]], [1, 1, 0.1], BED)
    assert torn_area(half, cylinder) == pytest.approx(np.pi * R**2 / 2, rel=1e-6)
    aside = cn.cylinders([[R, 0, -0.05]], R, 0.1, BED)
    assert torn_area(aside, cylinder) == pytest.approx(R**2 * (2 * np.pi / 3 - 3**0.5 / 2), rel=1e-6)
    within = cn.cylinders([[0.01, 0, -0.05]], 0.03, 0.1, BED)
    assert torn_area(within, cylinder) == pytest.approx(np.pi * 0.03**2, rel=1e-6)


def test_round_ends_have_the_area_of_a_ball_of_their_radius():
    ball = np.pi * R**2

    def standing(**options):
        return cn.capsules([[0, 0, 0.1]], R, 0.1, BODY, **options)

    def lying(**options):
        return cn.capsules([[0, 0, R]], R, 0.1, BODY, axis=(1, 0, 0), **options)

    def egg(**options):
        return cn.superquadrics([[0, 0, 0.04]], (0.05, 0.02, 0.04), (1, 1), BODY, **options)

    for below in (wall, slab, lambda: surface(12)):
        assert torn_area(below(), standing) == pytest.approx(ball, rel=1e-6)
        assert torn_area(below(), lying) == pytest.approx(2 * ball, rel=1e-6)
        assert torn_area(below(), egg) == pytest.approx(np.pi * (0.05 * 0.02 / 0.04) ** 2, rel=1e-5)
    crossed = cn.capsules([[0, 0, -R]], R, 0.1, BED, axis=(0, 1, 0))
    assert torn_area(crossed, lying) == pytest.approx(ball / 4, rel=1e-6)


def hung(body, zone, dim=3):
    scene = cn.Scene(dim, gravity=(0,) * (dim - 1) + (9.81,))
    scene.add(cn.wall((0,) * dim, (0,) * (dim - 1) + (1,), BED))
    scene.add(body)
    scene.interact(BED, BODY, zone)
    return cn.Simulation(scene, 1e-4)


ON_EDGE = dict(rotation=[[np.cos(np.pi / 8), np.sin(np.pi / 8), 0, 0]])


@pytest.mark.parametrize("zone", [law(), cn.MohrCoulomb(tension=1e6, cohesion=1e6)])
def test_what_has_no_area_is_told_of(zone):
    name = type(zone).__name__
    words = rf"law {name} does not join body 1 of 'body' and body 0 of 'bed'.*no area.*Bonded"
    for body in (
        cn.boxes([[0, 0, 0.05 * 2**0.5]], [0.1] * 3, BODY, **ON_EDGE),
        cn.cylinders([[0, 0, R]], R, 0.1, BODY, axis=(1, 0, 0)),
        cn.superquadrics([[0, 0, R]], (R, R, R), (0.5, 0.5), BODY),
    ):
        sim = hung(body, zone)
        with pytest.warns(cn.UnjoinedWarning, match=words):
            sim.step()
        assert "no area" in sim.info["unjoined"]
        sim.step()
        assert "unjoined" not in sim.info
    diamond = cn.polygons([[[0, 0], [0.05, 0.05], [0, 0.1], [-0.05, 0.05]]], BODY)
    with pytest.warns(cn.UnjoinedWarning, match=words):
        hung(diamond, zone, dim=2).step()


@pytest.mark.filterwarnings("error::cairn.UnjoinedWarning")
def test_corners_of_what_is_joined_elsewhere_are_not_told_of():
    hung(cube(), law()).step()
    hung(cn.boxes([[0, 0, 0.05 * 2**0.5]], [0.1] * 3, BODY, **ON_EDGE), cn.Bonded()).step()
    scene = cn.Scene(2)
    squares = [[[x, y], [x + 0.1, y], [x + 0.1, y + 0.1], [x, y + 0.1]] for x in (0, 0.1, 0.2) for y in (0, 0.1)]
    scene.add(cn.polygons(squares, BODY))
    scene.interact(BODY, BODY, law())
    sim = cn.Simulation(scene, 1e-5)
    sim.step()
    assert np.sum(sim.contacts.beta == 1) == 14
