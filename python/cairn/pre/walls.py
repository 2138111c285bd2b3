"""Walls of bricks laid in bonds, with openings; columns of drums; stairs.

A bond is the list of the rectangles that a course shows in plan. Bricks are l long, w wide, h high with clear joints of
`gap` between them (0: dry joints that touch); bonds with headers need l = 2 w + gap.
"""

from __future__ import annotations

import numpy as np

from ..base import checks
from ..names import listed
from .blocks import Blocks

BONDS = ("running", "stack", "English", "Flemish", "Dutch")


def wall(
    length,
    courses,
    brick=(0.22, 0.11, 0.055),
    bond="running",
    gap=0.0,
    openings=(),
    lintel=None,
    base=True,
    filled=False,
) -> Blocks:
    """A straight wall along x from x = 0, standing on z = 0, its face at y = 0.

    length [m], a whole number of bricks with their joints; courses; brick: (l, w, h) [m]; bond: "running", "stack" (one
    brick thick, w), "English", "Flemish" or "Dutch" (l thick); gap [m]; openings: list of (x0, z0, x1, z1) [m]; lintel:
    bearing [m] on each side of one block in the course above an opening, l / 2 unless told; base: a support below; filled:
    bricks reach to the middle of their joints, so that mortar of no thickness and the joint's own law is between them (Lourenco &
    Rots 1997), while joints left open close as the wall falls. Parts: "brick", "lintel", "support".
    """
    l, w, h = (checks.positive(f"brick[{k}]", v) for k, v in enumerate(brick))
    length, gap = checks.positive("length", length), checks.number("gap", gap)
    courses = checks.count("courses", courses, 1)
    if bond not in BONDS:
        raise ValueError(f"bond is {bond!r}: give one of {listed(BONDS, bond)}")
    if gap < 0:
        raise ValueError(f"gap is {gap}: give a width >= 0 [m]")
    count = round((length + gap) / (l + gap))
    if count < 1 or abs(count * (l + gap) - gap - length) > 1e-6 * l:
        raise ValueError(f"length is {length}: give a whole number of bricks, {max(count, 1) * (l + gap) - gap:.6g} say")
    thick = bond not in ("running", "stack")
    if thick and abs(l - 2 * w - gap) > 1e-6 * l:
        raise ValueError(f"brick is {brick}: the bond {bond} needs l = 2 w + gap, here {2 * w + gap:.6g}")
    holes = [opening(f"openings[{k}]", hole, length, courses * (h + gap) - gap) for k, hole in enumerate(openings)]
    # x is counted in quarters of a brick with its joint, so that equal joints are equal numbers
    quarter = (l + gap) / 4
    blocks, height, joint = Blocks(3), courses * (h + gap) - gap, 0.0 if filled else gap

    def middle(end):
        return max(end - gap / 2, 0.0)

    for course in range(courses):
        z0 = course * (h + gap)
        for q0, q1, y0, y1 in plan(bond, course, count, w, gap, l):
            rectangle = (q0 * quarter, z0, q1 * quarter - gap, z0 + h)
            if filled:  # the same numbers from both sides
                rectangle = (middle(q0 * quarter), middle(z0), middle(q1 * quarter), middle((course + 1) * (h + gap)))
                rectangle = tuple(min(v, top) for v, top in zip(rectangle, (length, height) * 2))
                y0, y1 = (0.0 if y0 == 0 else l / 2), (l / 2 if thick and y1 < l else y1)
            for x0, a, x1, b in outside(rectangle, holes, joint):
                blocks.add_box((x0, y0, a), (x1, y1, b), "brick")
    thickness = l if thick else w
    blocks = with_lintels(blocks, holes, l / 2 if lintel is None else lintel, thickness, height + gap, joint)
    if base:
        blocks.add_box((-l, -w, -h), (count * (l + gap) + l, thickness + w, -joint), "support")
    return blocks


def opening(name, hole, length, height):
    """An opening (x0, z0, x1, z1) [m] that lies in the wall, at least in part."""
    hole = tuple(checks.number(name, x) for x in np.ravel(hole))
    if len(hole) != 4 or not (hole[0] < hole[2] and hole[1] < hole[3]):
        raise ValueError(f"{name} is {hole}: give (x0, z0, x1, z1) [m], x0 below x1, z0 below z1")
    if hole[0] >= length or hole[2] <= 0 or hole[1] >= height or hole[3] <= 0:
        raise ValueError(f"{name} is {hole}, outside the wall: its face goes from (0, 0) to ({length:g}, {height:g})")
    return hole


def plan(bond, course, count, w, gap, l):
    """Bricks of a course: from, to in quarters of a brick along x, from, to along y [m]."""
    odd, total = course % 2, 4 * count
    if bond in ("running", "stack"):
        offset = 2 if bond == "running" and odd else 0
        return [(a, b, 0.0, w) for a, b in pieces(total, offset, 4)]
    rows = ((0.0, w), (w + gap, l))
    if bond in ("English", "Dutch"):
        if odd:  # headers, begun by a queen closer of a quarter brick
            return [(a, b, 0.0, l) for a, b in pieces(total, 1, 2)]
        offset = 2 if bond == "Dutch" and course % 4 == 2 else 0
        return [(a, b, *row) for row in rows for a, b in pieces(total, offset, 4)]
    # Flemish: stretchers, two side by side, and headers in turn; every other course begins so that headers stand over stretchers
    made, at, header = [], 0, False
    if odd:
        made, at = [(0, 2, 0.0, l), (2, 3, *rows[0]), (2, 3, *rows[1])], 3
    while at < total:
        size = min(2 if header else 4, total - at)
        made += [(at, at + size, 0.0, l)] if header and size == 2 else [(at, at + size, *row) for row in rows]
        at, header = at + size, not header
    return made


def pieces(total, first, size):
    """Cuts of 0 .. total: one at `first`, then every `size`."""
    cuts = sorted({0, total, *range(first, total, size)})
    return list(zip(cuts[:-1], cuts[1:]))


def outside(rectangle, holes, gap):
    """Rectangles (x0, z0, x1, z1) that remain of a rectangle outside the holes; strips no wider than a joint are dropped."""
    left = [rectangle]
    for hx0, hz0, hx1, hz1 in holes:
        new = []
        for x0, z0, x1, z1 in left:
            if x1 <= hx0 or x0 >= hx1 or z1 <= hz0 or z0 >= hz1:
                new.append((x0, z0, x1, z1))
                continue
            a, b = max(z0, hz0), min(z1, hz1)
            around = [(x0, z0, x1, hz0), (x0, hz1, x1, z1), (x0, a, hx0, b), (hx1, a, x1, b)]
            new += [r for r in around if r[2] > r[0] and r[3] > r[1]]
        left = new
    smallest = max(gap, 1e-6 * (rectangle[3] - rectangle[1]))
    return [r for r in left if r[2] - r[0] > smallest and r[3] - r[1] > smallest]


def with_lintels(blocks, holes, bearing, thickness, top, gap):
    """One block over each opening in the place of the bricks there; bricks that reach beyond it are cut."""
    for x0, _, x1, z1 in holes:
        if z1 >= top:
            continue
        above = [v for v in blocks.vertices if v[:, 2].max() > z1 + gap and v[:, 0].max() > x0 and v[:, 0].min() < x1]
        low = min(v[:, 2].min() for v in above)
        high = min(v[:, 2].max() for v in above)
        lintel = (x0 - bearing, low, x1 + bearing, high)
        kept = Blocks(3)
        for v, part in zip(blocks.vertices, blocks.part):
            (a, b, c), (d, e, f) = v.min(axis=0), v.max(axis=0)
            for p, q, r, s in outside((a, c, d, f), [widened(lintel, gap)], gap):
                kept.add_box((p, b, q), (r, e, s), part)
        kept.add_box((lintel[0], 0.0, low), (lintel[2], thickness, high), "lintel")
        blocks = kept
    return blocks


def widened(rectangle, gap):
    return (rectangle[0] - gap, rectangle[1] - gap / 2, rectangle[2] + gap, rectangle[3] + gap / 2)


def panel(columns, courses, brick=(1.0, 1.0), bond="running", base=True, gap=0.0, filled=False) -> Blocks:
    """A wall in 2D: bricks (l, h) [m] in running or stack bond, halves at the ends of every other course. Parts: "brick",
    "support".

    gap: width of the joints [m], 0 for dry ones that touch; filled: bricks reach to the middle of their joints, so that mortar of
    no thickness and the joint's own law is between them, as in `wall`.
    """
    l, h = (checks.positive(f"brick[{k}]", v) for k, v in enumerate(brick))
    columns, courses = checks.count("columns", columns, 1), checks.count("courses", courses, 1)
    if bond not in ("running", "stack"):
        raise ValueError(f'bond is {bond!r}: give "running" or "stack" in 2D')
    gap = checks.number("gap", gap)
    if gap < 0:
        raise ValueError(f"gap is {gap}: give a width >= 0 [m]")
    if gap >= l:
        raise ValueError(f"gap is {gap}, not below the length of a brick, {l}: give a narrower joint [m]")
    half = (l + gap) / 2  # bricks are counted in halves with their joints, so that equal joints are equal numbers
    length, height = 2 * columns * half - gap, courses * (h + gap) - gap
    blocks = Blocks(2)

    def middle(end, last):
        return min(max(end - gap / 2, 0.0), last)

    for course in range(courses):
        for a, b in pieces(2 * columns, 1 if bond == "running" and course % 2 else 0, 2):
            low, high = (a * half, course * (h + gap)), (b * half - gap, (course + 1) * (h + gap) - gap)
            if filled:  # the same numbers from both sides
                low = (middle(a * half, length), middle(course * (h + gap), height))
                high = (middle(b * half, length), middle((course + 1) * (h + gap), height))
            blocks.add_box(low, high, "brick")
    if base:
        blocks.add_box((-l, -h), ((columns + 1) * l + columns * gap, 0.0 if filled else 0.0 - gap), "support")
    return blocks


def column(drums, height, radius, top_radius=None, sides=24, capital=0.0, base=True) -> Blocks:
    """A column of drums, regular polygons in plan, tapering from radius to top_radius [m] over its height [m].

    capital: height of a square slab on top [m], 0 for none. Parts: "drum", "capital", "support".
    """
    drums, sides = checks.count("drums", drums, 1), checks.count("sides", sides, 3)
    height, radius = checks.positive("height", height), checks.positive("radius", radius)
    if checks.number("capital", capital) < 0:
        raise ValueError(f"capital is {capital}: give a height >= 0 [m]")
    top = radius if top_radius is None else checks.positive("top_radius", top_radius)
    levels = height * np.arange(drums + 1) / drums
    radii = radius + (top - radius) * np.arange(drums + 1) / drums
    angle = 2 * np.pi * (np.arange(sides) + 0.5) / sides
    circle = np.column_stack((np.cos(angle), np.sin(angle)))
    rings = [np.column_stack((r * circle, np.full(sides, z))) for r, z in zip(radii, levels)]
    loop = list(range(sides))
    faces = [loop[::-1], [k + sides for k in loop]]
    faces += [[k, (k + 1) % sides, sides + (k + 1) % sides, sides + k] for k in loop]
    blocks = Blocks(3)
    for low, high in zip(rings[:-1], rings[1:]):
        blocks.add(np.concatenate([low, high]), faces, "drum")
    if capital:
        blocks.add_box((-1.2 * top, -1.2 * top, height), (1.2 * top, 1.2 * top, height + capital), "capital")
    if base:
        blocks.add_box((-2 * radius, -2 * radius, -radius), (2 * radius, 2 * radius, 0.0), "support")
    return blocks


def stairs(steps, tread, rise, width, lap=0.1, base=True) -> Blocks:
    """A straight flight of solid steps up along x, each resting with a lap [m] on the one below and built in, with a fifth of its
    width, at the wall behind y = width. Parts: "step", "support"."""
    steps = checks.count("steps", steps, 1)
    tread, rise, width = (checks.positive(n, v) for n, v in (("tread", tread), ("rise", rise), ("width", width)))
    lap = checks.positive("lap", lap)
    if lap >= tread:
        raise ValueError(f"lap is {lap}, not below the tread {tread}: give a smaller lap [m]")
    blocks = Blocks(3)
    for k in range(steps):
        blocks.add_box((k * tread, 0.0, k * rise), ((k + 1) * tread + lap, width, (k + 1) * rise), "step")
    if base:
        blocks.add_box((-tread, -rise, -rise), (tread + lap, width + tread, 0.0), "support")
        for k in range(1, steps):  # the wall holds each step's end from below
            blocks.add_box(
                (k * tread + lap, width * 0.8, 0.0), ((k + 1) * tread + lap, width, k * rise), "support"
            )
        for k in range(steps):  # and from above, or the flight would turn about the wall's edge
            right = (k + 1) * tread + (lap if k == steps - 1 else 0.0)
            blocks.add_box((k * tread, width * 0.8, (k + 1) * rise), (right, width, (k + 2) * rise), "support")
    return blocks
