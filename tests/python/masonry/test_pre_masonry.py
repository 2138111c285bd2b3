"""Generators: blocks convex, flush, not in each other, with the volume that the drawing gives."""

import numpy as np
import pytest
from cairn.post import limit_analysis
from cairn.pre import block_overlaps, blocks, masonry, mesh


def sound(b, name):
    """Every block closed and convex, none in another; the volume without supports."""
    for k, v in enumerate(b.vertices):
        if b.dim == 3:
            assert mesh.check(v, b.faces[k], f"{name} {k}").convex
        else:
            mesh.check_polygon(v, f"{name} {k}")
    free = b.select(~b.mask("support"))
    pairs, depth = block_overlaps.overlaps(b)
    assert len(pairs) == 0, f"{name}: blocks {pairs[0]} overlap by {depth[0]}"
    return free.properties().measure.sum()


def tied(b):
    """True if the joints connect all blocks."""
    label = np.arange(len(b))
    for i, j in b.joints().blocks:
        label[label == label[i]] = label[j]
    return len(set(label)) == 1


@pytest.mark.parametrize("joints", ["radial", "vertical"])
@pytest.mark.parametrize("kind,size", [
    ("semicircular", {"radius": 5.0}), ("segmental", {"span": 10.0, "rise": 2.0}), ("pointed", {"span": 10.0, "radius": 8.0})
])
def test_arches(kind, size, joints):
    flat = masonry.arch(kind, thickness=1.0, voussoirs=12, joints=joints, **size)
    deep = masonry.arch(kind, thickness=1.0, voussoirs=12, joints=joints, depth=2.0, **size)
    assert sound(deep, kind) == pytest.approx(2 * sound(flat, kind), rel=1e-13)
    assert len(flat.joints().area) == 13 and tied(flat) and tied(deep)
    left, right = flat.vertices[0], flat.vertices[11] * (-1, 1)
    assert {tuple(p) for p in left} == {tuple(p) for p in right}  # mirrors to the bit
    if joints == "vertical":  # the springers stand on beds, all other joints are upright
        bed = [n for n, pair in zip(flat.joints().normal, flat.joints().blocks) if max(pair) >= 12]
        assert len(bed) == 2 and all(abs(n[1]) > 0.2 for n in bed)
        assert sum(abs(n[1]) < 1e-12 for n in flat.joints().normal) == 11
        assert limit_analysis.Assembly(flat, 4.0).stands().status == "optimal"
    if kind == "semicircular" and joints == "radial":
        exact = 12 * (5.5**2 - 4.5**2) / 2 * np.sin(np.pi / 12)
        assert sound(flat, kind) == pytest.approx(exact, rel=1e-13)
        np.testing.assert_allclose(flat.joints().area, 1.0, rtol=1e-13)


@pytest.mark.parametrize("bond", ["running", "stack", "English", "Flemish", "Dutch"])
def test_walls(bond):
    l, w, h = brick = (0.22, 0.11, 0.055)
    thick = w if bond in ("running", "stack") else l
    plain = masonry.wall(2.2, 8, brick, bond)
    assert sound(plain, bond) == pytest.approx(2.2 * 8 * h * thick, rel=1e-12) and tied(plain)
    holed = masonry.wall(2.2, 8, brick, bond, openings=[(0.6, 0.11, 1.2, 0.33)])
    assert sound(holed, bond) == pytest.approx((2.2 * 8 * h - 0.6 * 0.22) * thick, rel=1e-12)
    assert sum(holed.mask("lintel")) == 1 and tied(holed)
    jointed = masonry.wall(10 * 0.23 - 0.01, 6, (0.22, 0.105, 0.055), bond, gap=0.01)
    assert sound(jointed, bond) > 0 and len(jointed.joints().area) == 0
    filled = masonry.wall(2.29, 6, (0.22, 0.105, 0.055), bond, gap=0.01, openings=[(0.69, 0.13, 1.15, 0.26)], filled=True)
    whole = (2.29 * (6 * 0.065 - 0.01) - 0.46 * 0.13) * (0.105 if bond in ("running", "stack") else 0.22)
    assert sound(filled, bond) == pytest.approx(whole, rel=1e-12) and tied(filled)
    if bond != "stack":  # a joint between two bricks of a course has brick above it
        joint = {round(v[:, 0].max(), 9) for v in plain.vertices if v[:, 2].min() == 0.0}
        above = {round(v[:, 0].max(), 9) for v in plain.vertices if abs(v[:, 2].min() - h) < 1e-9}
        assert joint & above <= {2.2}


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: masonry.arch(span=4, thickness=0.3, voussoirs=5, depth=-1), "depth is -1"),
        (lambda: masonry.wall(2.2, 6, openings=[(3, 0, 4, 0.2)]), r"openings\[0\].*outside the wall"),
        (lambda: masonry.wall(2.2, 6, openings=[(1.4, 0.2, 0.7, 0.1)]), r"openings\[0\].*x0 below x1"),
        (lambda: masonry.wall(2.2, 6, openings=[(1, 0, 2, 0.1), (1, 2, 3)]), r"openings\[1\].*give \(x0, z0, x1, z1\)"),
        (lambda: masonry.column(3, 3.0, 0.5, capital=-1), "capital is -1"),
        (lambda: masonry.bridge([]), "tiers is empty"),
        (lambda: masonry.voronoi((0, 0), (1, 1), [[0.5, 0.5], [0.2, 0.2], [0.5, 0.5]]), r"seeds\[0\] is there 2 times"),
    ],
)
def test_what_cannot_be_built_is_refused_by_name(make, words):
    with pytest.raises(ValueError, match=words):
        make()


@pytest.mark.parametrize("tie", [0, 2, 4])
def test_facades(tie):
    w, h = 0.11, 0.055
    for openings in ((), [(0.44, 3 * h, 0.66, 6 * h)]):
        b = masonry.facade(1.1, 0.33, 10, (2 * w, w, h), tie=tie, openings=openings)
        hole = 0.22 * 3 * h if openings else 0.0
        assert sound(b, "facade") == pytest.approx((1.1 * 10 * h - hole) * w + 2 * 0.33 * w * 10 * h, rel=1e-12) and tied(b)
        sides = b.select(b.mask("side"))
        reach = [v[:, 1].min() < w / 2 for v in sides.vertices]  # into the facade
        assert sum(reach) == (2 * len(range(1, 10, tie)) if tie else 0)
        assert {v[:, 0].min() for v in sides.vertices} == {0.0, 9 * w}


@pytest.mark.parametrize("wrong,words", [
    ({"tie": 3}, "tie is 3: give an even"), ({"length": 1.0}, "length is 1.0: give a whole number of bricks, 1.1 say"),
    ({"side": 0.3}, "side is 0.3"), ({"brick": (0.22, 0.1, 0.05)}, "corners need l = 2 w"),
    ({"openings": [(0.4, 0.2, 0.3, 0.3)]}, "openings.0. is .*: give"),
])  # fmt: skip
def test_wrong_facades(wrong, words):
    with pytest.raises(ValueError, match=words):
        masonry.facade(**{"length": 1.1, "side": 0.33, "courses": 4, **wrong})


def test_columns_stairs_panels():
    column = masonry.column(6, 6.0, 0.5, 0.4, capital=0.3)
    assert tied(column)
    area = 12 * np.sin(np.pi / 12)  # of a polygon of 24 sides in the unit circle
    assert sound(column, "column") == pytest.approx(area * 6 / 3 * (0.25 + 0.2 + 0.16) + 0.96**2 * 0.3, rel=1e-13)
    flight = masonry.stairs(5, 0.3, 0.17, 1.0)
    assert sound(flight, "stairs") == pytest.approx(5 * 0.4 * 0.17) and tied(flight)
    assert limit_analysis.Assembly(flight, 0.5).stands().status == "optimal"
    panel = masonry.panel(5, 6)
    assert sound(panel, "panel") == pytest.approx(30) and tied(panel)


def test_a_bridge_has_as_many_blocks_at_any_scale():
    sizes = np.array([6.0, 3.0, 3.0, 4.0, 0.9, 0.4, 1.0, 0.5, 0.8])
    blocks = []
    for unit in (1.0, 2.0**-40):
        span, pier, height, width, ring, cap, course, cornice, block = sizes * unit
        tier = masonry.Tier(2, span, pier, height, width, ring, cap, course=course, cornice=cornice, block=block)
        blocks.append(len(masonry.bridge([tier])))
    assert blocks[0] == blocks[1]


def test_bridge():
    tier = masonry.Tier(2, 6.0, 3.0, 3.0, 4.0, 0.9, 0.4, voussoirs=11, across=2)
    small = masonry.Tier(4, 3.0, 1.5, 1.5, 2.0, 0.5, 0.3, voussoirs=9, across=2)
    b = masonry.bridge((tier, small))
    wall = 0.0
    for t in (tier, small):  # a solid wall less the openings, half polygons inscribed in the intrados
        opening = t.span * t.pier_height + t.voussoirs * (t.span / 2) ** 2 / 2 * np.sin(np.pi / t.voussoirs)
        wall += t.width * ((t.arches * t.pitch + t.pier) * t.height - t.arches * opening)
    assert sound(b, "bridge") == pytest.approx(wall, rel=1e-12)
    assert tied(b) and all(len(v) >= 8 for v in b.vertices)
    with pytest.raises(ValueError, match="twice the ring"):
        masonry.bridge([masonry.Tier(1, 6.0, 1.0, 3.0, 4.0, 0.9, 0.4)])


def test_pont_du_gard():
    b = masonry.pont_du_gard(0.3)
    low, high = b.bounds()
    assert 40 < high[2] < 52 and 600 < len(b) < 1000 and tied(b)


def test_cutting_a_block_leaves_all_of_it():
    rng = np.random.default_rng(0)
    b = blocks.Blocks(3)
    b.add_box((0, 0, 0), (1, 1, 1))
    v, f = b.vertices[0], b.faces[0]
    for k in range(120):
        n = rng.normal(size=3)
        p = v[k % 8] if k % 5 == 0 else rng.uniform(0.2, 0.8, 3)
        if k % 7 == 0:
            n[0] = 0.0
        if k % 11 == 0:
            n, p = np.array([1.0, -1, 0]), v[0]
        halves = [blocks.cut(v, f, p, n), blocks.cut(v, f, p, -n)]
        assert sum(mesh.check(*h).volume for h in halves if h is not None) == pytest.approx(1, rel=1e-12)


def test_joints_and_overlaps_of_known_blocks():
    b = blocks.Blocks(3)
    b.add_box((0, 0, 0), (1, 1, 1))
    b.add_box((0.5, 0.25, 1), (1.5, 0.75, 2))
    j = b.joints()
    assert j.area == pytest.approx([0.25]) and np.array_equal(j.normal[0] * (j.blocks[0, 1] * 2 - 1), [0, 0, -1])
    b.add_box((0.5, 0.5, 1.9), (1, 1, 3))
    pairs, depth = block_overlaps.overlaps(b)
    assert pairs.tolist() == [[1, 2]] and depth == pytest.approx([0.1])
    crossed = blocks.Blocks(3)  # two beams past each other, apart along the normal of two edges alone
    turn = np.array([[1, 0, 0], [0, 1, -1], [0, 1, 1]]) / [[1], [2**0.5], [2**0.5]]
    beam = np.array([[x, y, z] for z in (-0.5, 0.5) for y in (-0.5, 0.5) for x in (-5, 5)]) @ turn.T
    crossed.add(beam)
    crossed.add(beam[:, [1, 0, 2]] + (0, 0, 1.5))
    assert len(block_overlaps.overlaps(crossed)[0]) == 0
    crossed.vertices[1] = crossed.vertices[1] - (0, 0, 0.2)
    assert block_overlaps.overlaps(crossed)[1] == pytest.approx([2**0.5 - 1.3])
