"""Weights of slave nodes by master nodes for mortar ties of faces in 3D, with dual multipliers on the overlap of the faces."""

from __future__ import annotations

import numpy as np

from . import side_shapes

LEAST = 1e-12  # least overlap over the area of a face
ROUNDING = 1e-9  # share of a side neglected as rounding
# Gauss rules on (0, 1), exact for products of bilinear functions, and of functions of second order, of degree eight.
_RULES = {second: [(x + 1) / 2 if i == 0 else x / 2 for i, x in enumerate(np.polynomial.legendre.leggauss(n))]
          for second, n in ((False, 4), (True, 5))}  # fmt: skip


def dual_weights(points, follow, lead, within, name):
    """{slave node: (master nodes, weights)} of mortar ties, see side_shapes.dual_rows.

    points (n, 3) [m]; follow, lead: slave and master faces (m, 4), -1 for the fourth node of a triangle, and the whole side of
    each, see side_shapes.wholes; within: largest gap between slave and master face over the size of the slave face, and width of
    the strip along its edges that the master may leave uncovered. Integrals extend over the overlap alone, so that the weights of
    a node have the sum 1, and linear fields are reproduced with any strip. name: groups of slave and master, for the error of a
    face that is not covered.
    """
    lead, lead_wholes = lead
    middles, reach = _balls(points, lead)
    sides, common = [], {}
    for face, (nodes, place_of_corners) in zip(*follow):
        own = face[face >= 0]
        x = points[own]
        middle, axes, size = _frame(x)
        flat = ((x - middle) @ axes.T) / size
        near = np.flatnonzero(np.linalg.norm(middles - middle, axis=1) < reach + np.linalg.norm(x - middle, axis=1).max())
        covered, opposite, far = 0.0, 0.0, 0.0
        for k in near:
            other = lead[k][lead[k] >= 0]
            leaders, there = lead_wholes[k]
            y = ((points[other] - middle) @ axes.T) / size
            part = _common(flat, y)
            if part is None:
                continue
            place, wide = _samples(part, max(len(nodes), len(leaders)) > 4)
            share = shapes_at(y[:, :2], place)
            off = np.abs(share @ ((points[other] - middle) @ np.cross(*axes)) / size).max()
            opposite, far = opposite + wide.sum(), max(far, off)
            if off > within:
                continue
            covered += wide.sum()
            samples = common.setdefault(tuple(nodes.tolist()), [])
            at = shapes_at(flat, place) @ place_of_corners
            samples.append((leaders, side_shapes.shape(3, len(leaders), share @ there), at, wide * size**2))
        whole = _area(flat)
        around = float(np.linalg.norm(flat - np.roll(flat, -1, axis=0), axis=1).sum()) / whole
        side = f"face of nodes {', '.join(map(str, own))}"
        sides.append((side, covered / whole, opposite / whole, far, around))
    check_covered(sides, within, name)
    return side_shapes.dual_rows(3, common)


def check_covered(sides, within, name):
    """Raises ValueError, with a remedy, if slave sides are covered by masters twice, or if more of them is uncovered than a strip
    of width `within` along their ends.

    sides: for each its name in messages, the share covered by masters, the share covered at any distance, the largest distance
    over its size, and the length of its ends over its size (2 for an edge); name: groups of slave and master.
    """
    wrong = [s for s in sides if not -ROUNDING <= 1 - s[1] <= max(ROUNDING, min(within * s[4], 0.5))]
    if not wrong:
        return
    side, covered = max(wrong, key=lambda s: abs(1 - s[1]))[:2]
    follower, leader = name
    told = f"ties: {covered:.6g} of the {side} of {follower!r} lies on {leader!r}, within {within:g} of its size"
    if covered > 1:
        raise ValueError(f"{told}, {covered - 1:.3g} more than once: leave one of the layers out of {leader!r}")
    ways = "move it over the other, or let the finer side follow"
    if all(covered < 1 and opposite >= 0.5 for _, covered, opposite, _, _ in wrong):  # a wider strip accepts all
        needed = 1.01 * max(max(far, (1 - opposite) / around) for _, _, opposite, far, around in wrong)
        ways = f"move it over the other, let the finer side follow, or give a larger within, {needed:.3g} or more"
    raise ValueError(f"{told}, {1 - covered:.3g} is missing: {ways}")


def _balls(points, faces):
    """Middles of faces (m, 3) and radii of the balls around them that contain their corners (m,) [m]."""
    there = faces >= 0
    x = points[np.where(there, faces, faces[:, :1])]
    middles = (x * there[..., None]).sum(axis=1) / there.sum(axis=1)[:, None]
    return middles, np.linalg.norm(x - middles[:, None], axis=2).max(axis=1)


def _frame(x):
    """Middle of a face (3,), two unit axes in its plane (2, 3), and its size, the root of its area [m]."""
    middle = x.mean(axis=0)
    one, two = (x[2] - x[0], x[3] - x[1]) if len(x) == 4 else (x[1] - x[0], x[2] - x[0])
    normal = np.cross(one, two)
    first = one / np.linalg.norm(one)
    return middle, np.stack([first, np.cross(normal / np.linalg.norm(normal), first)]), np.sqrt(np.linalg.norm(normal) / 2)


def _area(x):
    a, b = x, np.roll(x, -1, axis=0)
    return 0.5 * float(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]))


def _common(one, other):
    """Intersection of two convex polygons (m, 2), anticlockwise; None if it is empty."""
    part = other if _area(other) > 0 else other[::-1]
    for a, b in zip(one, np.roll(one, -1, axis=0)):
        side = (b[0] - a[0]) * (part[:, 1] - a[1]) - (b[1] - a[1]) * (part[:, 0] - a[0])
        kept = []
        for p, q, s, t in zip(part, np.roll(part, -1, axis=0), side, np.roll(side, -1)):
            if s >= 0:
                kept.append(p)
            if s * t < 0:
                kept.append(p + s / (s - t) * (q - p))
        if len(kept) < 3:
            return None
        part = np.array(kept)
    return part if _area(part) > LEAST * _area(one) else None


def _samples(part, second):
    """Points (m, 2) and weights (m,) of a rule on a convex polygon: triangles from its first corner, each a square with a
    collapsed side. second: exact for functions of second order."""
    places, weights, (at, share) = [], [], _RULES[second]
    u, v = (grid.ravel() for grid in np.meshgrid(at, at, indexing="ij"))
    wide = np.outer(share, share).ravel() * u
    for b, c in zip(part[1:-1], part[2:]):
        a = part[0]
        twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        places.append(a + u[:, None] * ((b - a) + v[:, None] * (c - b)))
        weights.append(wide * twice)
    return np.concatenate(places), np.concatenate(weights)


def shapes_at(corners, places):
    """Shape functions (m, 3 | 4) of a triangle or a quadrilateral in the plane at places (m, 2)."""
    if len(corners) == 3:
        edges = np.stack([corners[1] - corners[0], corners[2] - corners[0]], 1)
        r = np.linalg.solve(edges, (places - corners[0]).T).T
        return np.stack([1 - r.sum(axis=1), r[:, 0], r[:, 1]], 1)
    sign = np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])
    r = np.zeros_like(places)
    for _ in range(20):  # Newton's method on the bilinear map
        along, across = 1 + sign[:, 0] * r[:, :1], 1 + sign[:, 1] * r[:, 1:]
        shape = along * across / 4
        d = np.stack([sign[:, 0] * across / 4, sign[:, 1] * along / 4], 1)  # (m, 2, 4)
        step = np.linalg.solve(np.swapaxes(d @ corners, 1, 2), (places - shape @ corners)[:, :, None])[:, :, 0]
        r = r + step
        if np.abs(step).max() < 1e-14:
            break
    along, across = 1 + sign[:, 0] * r[:, :1], 1 + sign[:, 1] * r[:, 1:]
    return along * across / 4
