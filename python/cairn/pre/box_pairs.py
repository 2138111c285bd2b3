"""Pairs of axis-aligned boxes that overlap, for meshes and assemblies of any mixture of sizes.

A tree of boxes over the items sorted along a space-filling curve is descended by all pairs of nodes at once, level by
level, in numpy: a million triangles take seconds.
"""

from __future__ import annotations

import numpy as np


def overlapping_pairs(low, high) -> np.ndarray:
    """Pairs i < j, (k, 2), sorted, of boxes low, high (n, dim) that overlap or touch."""
    count, dim = low.shape
    if count < 2:
        return np.empty((0, 2), np.int64)
    order = np.argsort(curve_codes((low + high) / 2), kind="stable")
    levels = [(low[order], high[order])]
    while len(levels[-1][0]) > 1:
        levels.append(tuple(merged(f, x) for f, x in zip((np.minimum, np.maximum), levels[-1])))
    first = second = np.zeros(1, np.int64)
    for lows, highs in reversed(levels[:-1]):
        first, second = children(first, second, len(lows))
        meet = np.ones(len(first), bool)
        for axis in range(dim):
            meet &= lows[first, axis] <= highs[second, axis]
            meet &= lows[second, axis] <= highs[first, axis]
        first, second = first[meet], second[meet]
    apart = first != second
    pairs = np.sort(np.column_stack((order[first[apart]], order[second[apart]])), axis=1)
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]


def merged(extreme, x):
    """Boxes of a level from those of the level below, two by two."""
    if len(x) % 2:
        x = np.concatenate([x, x[-1:]])
    return extreme(x[0::2], x[1::2])


def children(first, second, count):
    """Pairs of children of pairs of nodes, first <= second; a node's own pair gives three."""
    same = first == second
    f, s = first[~same], second[~same]
    pairs = [(2 * f + i, 2 * s + j) for i in (0, 1) for j in (0, 1)]
    own = first[same]
    pairs += [(2 * own, 2 * own), (2 * own + 1, 2 * own + 1), (2 * own, 2 * own + 1)]
    a, b = (np.concatenate(x) for x in zip(*pairs))
    there = (a < count) & (b < count)
    return a[there], b[there]


def curve_codes(points) -> np.ndarray:
    """Position of points along Morton's curve, (n,) uint64."""
    dim = points.shape[1]
    bits = 21 if dim == 3 else 31
    low = points.min(axis=0)
    size = np.max(points.max(axis=0) - low)
    cells = ((points - low) * ((2**bits - 1) / size if size > 0 else 0.0)).astype(np.uint64)
    code = np.zeros(len(points), np.uint64)
    for bit in range(bits):
        for axis in range(dim):
            code |= ((cells[:, axis] >> np.uint64(bit)) & np.uint64(1)) << np.uint64(bit * dim + axis)
    return code
