"""Bridges of arches on piers, in tiers, in the manner of the Pont du Gard.

A tier is drawn in the plane x, z as piers in courses, arches of radial voussoirs, spandrels coursed at the heights of the
voussoirs' corners up to 60 degrees and in upright blocks above, and a cornice. Every block is convex and meets its
neighbours flush. Each piece is cut along y into blocks whose joints shift from course to course; arches are rings side by
side, as in the lower tiers of the Pont du Gard.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base import checks
from .arches import ring
from .blocks import Blocks


@dataclass(frozen=True)
class Tier:
    """arches: how many; span: clear, of the intrados [m]; pier: width of a pier [m]; pier_height: from the tier's foot to
    the springing [m]; width: along y [m]; ring: thickness of the arches [m]; cap: of the masonry over the crown [m];
    voussoirs: of an arch, odd; course: height of the piers' courses [m]; across: blocks along y; along: blocks along x in
    a pier's course; cornice: height of the course that closes the tier [m]; block: length of its blocks [m]."""

    arches: int
    span: float
    pier: float
    pier_height: float
    width: float
    ring: float
    cap: float
    voussoirs: int = 21
    course: float = 1.0
    across: int = 3
    along: int = 2
    cornice: float = 0.6
    block: float = 2.0

    @property
    def pitch(self):
        return self.span + self.pier

    @property
    def height(self):
        """From foot to top [m]."""
        return self.pier_height + self.span / 2 + self.ring + self.cap + self.cornice


def bridge(tiers, abutments=True) -> Blocks:
    """Tiers (a list of `Tier`) one on another, each centred on x = 0 and y = 0, on ground at z = 0 and between abutments.

    A tier that is longer than the one below stands beside it on abutments that reach down to the ground. Parts: "pier",
    "voussoir", "spandrel", "cornice", "support".
    """
    blocks = Blocks(3)
    level = 0.0
    below = 0.0
    tiers = list(tiers)
    if not tiers:
        raise ValueError("tiers is empty: give one Tier or more, the lowest first")
    for k, tier in enumerate(tiers):
        refuse(tier, k)
        piers, arches = pier_axes(tier), arch_axes(tier)
        add_piers(blocks, tier, piers, level)
        add_arches(blocks, tier, arches, level)
        top = level + tier.height - tier.cornice
        add_spandrels(blocks, tier, piers, level, top)
        half = piers[-1] + tier.pier / 2
        reach = max(half, below)
        add_course(blocks, tier, -half, half, top, top + tier.cornice, k)
        if abutments:
            add_abutments(blocks, tier, half, level, top + tier.cornice, tiers, k)
        below, level = reach, top + tier.cornice
    if tiers:
        add_ground(blocks, tiers)
    return blocks


def refuse(tier: Tier, k: int):
    for name in ("span", "pier", "pier_height", "width", "ring", "cap", "course", "cornice", "block"):
        checks.positive(f"tiers[{k}].{name}", getattr(tier, name))
    for name in ("arches", "voussoirs", "across", "along"):
        checks.count(f"tiers[{k}].{name}", getattr(tier, name), 1)
    if tier.pier < 2 * tier.ring:
        raise ValueError(f"tiers[{k}].pier is {tier.pier}: give at least twice the ring {tier.ring}, so that two arches spring")
    if tier.voussoirs < 5 or tier.voussoirs % 2 == 0:
        raise ValueError(f"tiers[{k}].voussoirs is {tier.voussoirs}: give an odd number from 5 on, with a keystone")


def pier_axes(tier):
    return (np.arange(tier.arches + 1) - tier.arches / 2) * tier.pitch


def arch_axes(tier):
    return (np.arange(tier.arches) - (tier.arches - 1) / 2) * tier.pitch


def slices(tier, shifted):
    """Ends (y, y) of the blocks across the width: `across` equal ones; `shifted` by half a block, with a half at both faces."""
    n = tier.across
    cuts = np.linspace(-tier.width / 2, tier.width / 2, n + 1)
    if shifted and n > 1:
        cuts = np.concatenate([cuts[:1], (cuts[1:] + cuts[:-1]) / 2, cuts[-1:]])
    return list(zip(cuts[:-1], cuts[1:]))


def add_prisms(blocks, tier, outline, part, shifted=False):
    for low, high in slices(tier, shifted):
        blocks.add_prism(outline, low, high, part)


def rectangle(x0, x1, z0, z1):
    return [(x0, z0), (x1, z0), (x1, z1), (x0, z1)]


def add_piers(blocks, tier, axes, level):
    count = max(1, round(tier.pier_height / tier.course))
    heights = level + tier.pier_height * np.arange(count + 1) / count
    for x in axes:
        for k in range(count):
            cuts = running(x - tier.pier / 2, x + tier.pier / 2, tier.along, k % 2)
            for a, b in cuts:
                add_prisms(blocks, tier, rectangle(a, b, heights[k], heights[k + 1]), "pier", k % 2 == 1)


def running(low, high, count, shifted):
    """Cuts of a course into `count` blocks, or joints shifted by half a block and halves at the ends."""
    cuts = low + (high - low) * np.arange(count + 1) / count
    cuts[-1] = high
    if shifted and count > 1:
        cuts = np.concatenate([cuts[:1], (cuts[1:] + cuts[:-1]) / 2, cuts[-1:]])
    return list(zip(cuts[:-1], cuts[1:]))


def arch_corners(tier):
    """Intrados and extrados of an arch about its springing's middle, and the number of the last corner, from the left
    springing on, below which the spandrel is coursed."""
    inner, outer = ring(tier.span / 2 + tier.ring / 2, tier.ring, tier.voussoirs)
    # the springing lies on the pier: same numbers there
    angle = np.arctan2(outer[:, 1], -outer[:, 0])
    coursed = int(np.argmax(angle >= np.pi / 3 - 1e-9))
    return inner, outer, coursed


def add_arches(blocks, tier, axes, level):
    inner, outer, _ = arch_corners(tier)
    shift = level + tier.pier_height
    for x in axes:
        a, b = inner + (x, shift), outer + (x, shift)
        for k in range(tier.voussoirs):
            add_prisms(blocks, tier, [a[k], a[k + 1], b[k + 1], b[k]], "voussoir")


def add_spandrels(blocks, tier, axes, level, top):
    """Masonry over the piers and arches, from the springing to the top."""
    _, outer, coursed = arch_corners(tier)
    base = level + tier.pier_height
    arches = arch_axes(tier)
    for k in range(len(outer) - 1):  # upright blocks over the upper part of each arch
        if coursed <= k < len(outer) - 1 - coursed:
            for x in arches:
                a, b = outer[k] + (x, base), outer[k + 1] + (x, base)
                add_prisms(blocks, tier, [a, b, (b[0], top), (a[0], top)], "spandrel", k % 2 == 1)
    heights = [*(base + outer[: coursed + 1, 1])]
    span = top - heights[-1]
    rest = max(1, round(span / tier.course))
    heights += [heights[-1] + span * j / rest for j in range(1, rest)] + [top]
    for n, x in enumerate(axes):
        left = None if n == 0 else arches[n - 1]  # the arch on this side; none at an end: the wall is upright there
        right = None if n == len(axes) - 1 else arches[n]
        for j, (z0, z1) in enumerate(zip(heights[:-1], heights[1:])):
            low = [edge(outer, coursed, left, min(j + i, coursed), 1, x - tier.pier / 2) for i in (0, 1)]
            high = [edge(outer, coursed, right, min(j + i, coursed), -1, x + tier.pier / 2) for i in (0, 1)]
            middle = running(low[0], high[0], max(1, round((high[0] - low[0]) / tier.block)), j % 2)
            for m, (a, b) in enumerate(middle):
                a1, b1 = (low[1] if m == 0 else a), (high[1] if m == len(middle) - 1 else b)
                add_prisms(blocks, tier, [(a, z0), (b, z0), (b1, z1), (a1, z1)], "spandrel", j % 2 == 1)


def edge(outer, coursed, arch, k, side, otherwise):
    """x of corner k of the extrados of an arch, on its left (-1) or right (1) half."""
    if arch is None:
        return otherwise
    corner = outer[k] if side < 0 else outer[len(outer) - 1 - k]
    return corner[0] + arch


def add_course(blocks, tier, low, high, z0, z1, shifted):
    count = max(1, round((high - low) / tier.block))
    for a, b in running(low, high, count, shifted % 2):
        add_prisms(blocks, tier, rectangle(a, b, z0, z1), "cornice", shifted % 2 == 0)


def add_abutments(blocks, tier, half, level, top, tiers, k):
    """Rock at both ends of a tier, and under the part of a longer tier that no tier below carries."""
    widest = max(t.width for t in tiers) / 2
    outermost = max(pier_axes(t)[-1] + t.pier / 2 for t in tiers) + tier.pitch
    for side in (-1, 1):
        x = sorted((side * half, side * outermost))
        blocks.add_box((x[0], -widest, level), (x[1], widest, top), "support")


def add_ground(blocks, tiers):
    widest = max(t.width for t in tiers)
    outermost = max(pier_axes(t)[-1] + t.pier / 2 + t.pitch for t in tiers)
    blocks.add_box((-outermost, -widest, -2.0), (outermost, widest, 0.0), "support")


def pont_du_gard(detail=1.0) -> Blocks:
    """The bridge over the Gardon, 49 m high and 242 m long at its second tier, near enough: 6, 11 and 33 arches.

    detail: blocks' sizes are divided by it; 1 gives about the blocks of 1 m of the original.
    """
    d = checks.positive("detail", detail)

    def odd(x):
        return max(5, 2 * round((x - 1) / 2) + 1)

    def whole(x):
        return max(1, round(x))

    lower = Tier(6, 17.5, 4.5, 10.0, 6.4, 1.6, 0.5, odd(21 * d), 1.0 / d, whole(4 * d), whole(3 * d), 0.6, 2.0 / d)
    middle = Tier(11, 17.5, 4.5, 8.0, 4.6, 1.5, 0.5, odd(21 * d), 1.0 / d, whole(3 * d), whole(3 * d), 0.6, 2.0 / d)
    # three small arches to each arch below
    upper = Tier(33, 4.8, 22.0 / 3 - 4.8, 2.6, 3.1, 0.8, 0.4, odd(11 * d), 0.65 / d, whole(2 * d), whole(2 * d), 0.5, 1.5 / d)
    return bridge((lower, middle, upper))
