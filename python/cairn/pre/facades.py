"""A facade between two side walls, laid dry in stretcher bond: corners tied by bricks that lie in both walls, or not."""

from __future__ import annotations

from ..base import checks
from .blocks import Blocks
from .walls import opening, outside, pieces, with_lintels


def facade(length, side, courses, brick=(0.22, 0.11, 0.055), tie=2, openings=(), lintel=None, base=True) -> Blocks:
    """A wall along x from x = 0, its face at y = 0, with walls that run back along y at its ends, all one brick thick.

    length [m]: a whole number of bricks; side [m]: of the walls behind the facade, a whole number of half bricks; brick:
    (l, w, h) [m], l = 2 w; tie: at every so many courses, an even number, a brick of each side wall reaches into the
    facade (2: a sound corner), 0: walls that only touch; openings, lintel, base: as in `wall`, openings of the facade.
    Parts: "facade", "side", "lintel", "support".
    """
    l, w, h = (checks.positive(f"brick[{k}]", v) for k, v in enumerate(brick))
    courses, tie = checks.count("courses", courses, 1), checks.count("tie", tie)
    if abs(l - 2 * w) > 1e-6 * l:
        raise ValueError(f"brick is {brick}: corners need l = 2 w, here {2 * w:.6g}")
    if tie % 2:
        raise ValueError(f"tie is {tie}: give an even number of courses, or 0 for walls that only touch")
    wide = 2 * whole("length", checks.positive("length", length), l, "bricks")
    deep = whole("side", checks.positive("side", side), w, "half bricks")
    holes = [opening(f"openings[{k}]", hole, length, courses * h) for k, hole in enumerate(openings)]
    front, sides = Blocks(3), Blocks(3)
    for course in range(courses):
        odd = course % 2
        tied = tie > 0 and course % tie == 1
        z = course * h
        along = [(a, b) for a, b in pieces(wide, odd, 2) if not tied or 1 <= a < b <= wide - 1]
        for a, b in along:
            for x0, z0, x1, z1 in outside((a * w, z, b * w, z + h), holes, 0.0):
                front.add_box((x0, 0.0, z0), (x1, w, z1), "facade")
        back = [(0, 2), *((a + 2, b + 2) for a, b in pieces(deep - 1, 0, 2))] if tied else ends(deep, odd)
        for a, b in back:
            for x in (0, wide - 1):
                sides.add_box((x * w, a * w, z), ((x + 1) * w, min(b, deep + 1) * w, z + h), "side")
    front = with_lintels(front, holes, l / 2 if lintel is None else lintel, w, courses * h, 0.0)
    blocks = front + sides
    if base:
        blocks.add_box((-l, -l, -h), (wide * w + l, (deep + 1) * w + l, 0.0), "support")
    return blocks


def whole(name, size, unit, what):
    """How many units a size has."""
    count = round(size / unit)
    if count < 1 or abs(count * unit - size) > 1e-6 * unit:
        raise ValueError(f"{name} is {size}: give a whole number of {what}, {max(count, 1) * unit:.6g} say")
    return count


def ends(deep, odd):
    """Bricks of a side wall that ends at the back of the facade, in half bricks along y."""
    return [(a + 1, b + 1) for a, b in pieces(deep, odd, 2)]
