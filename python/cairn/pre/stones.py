"""Stones: volumes cut by Voronoi's cells, random polyhedra and polygons of given elongation and angularity."""

from __future__ import annotations

import numpy as np

from ..base import checks
from . import mesh
from .blocks import Blocks


def voronoi(low, high, seeds, rng=None, part="cell") -> Blocks:
    """A box (dim,) to (dim,) [m] cut into the Voronoi cells of points in it: their number (drawn with rng) or places (n, dim).

    Neighbours share corners to the bit. The sides of the box come from mirrored points.
    """
    low, high = (checks.real_array(n, v, (None,)) for n, v in (("low", low), ("high", high)))
    dim = checks.dimension(len(low))
    if low.shape != high.shape or not np.all(low < high):
        raise ValueError(f"low is {low} and high {high}: give two corners, low below high in each coordinate")
    if np.ndim(seeds) == 0:
        seeds = low + (high - low) * checks.generator(rng).uniform(size=(checks.count("seeds", seeds, 1), dim))
    seeds = checks.real_array("seeds", seeds, (None, dim))
    if np.any((seeds <= low) | (seeds >= high)):
        raise ValueError("seeds has points outside the box: give points inside it")
    _, first, count = np.unique(seeds, axis=0, return_index=True, return_counts=True)
    if np.any(count > 1):
        raise ValueError(f"seeds[{first[np.argmax(count)]}] is there {count.max()} times: give places that differ")
    size = np.max(high - low)
    places = (seeds - low) / size
    top = (high - low) / size
    images = [places]
    for axis in range(dim):
        for wall in (0.0, top[axis]):
            mirrored = places.copy()
            mirrored[:, axis] = 2 * wall - mirrored[:, axis]
            images.append(mirrored)
    diagram = mesh.library("scipy.spatial", "for Voronoi's cells").Voronoi(np.concatenate(images))
    corners = diagram.vertices.copy()
    for axis in range(dim):  # on the sides to the bit
        for wall in (0.0, top[axis]):
            corners[np.abs(corners[:, axis] - wall) < 1e-12, axis] = wall
    corners, number = merged_corners(corners)
    faces = [[] for _ in seeds]
    for (a, b), ridge in zip(diagram.ridge_points, diagram.ridge_vertices):
        loop = number[ridge]
        loop = loop[loop != np.roll(loop, 1)]
        if len(loop) < dim or -1 in ridge:
            continue
        for cell in (a, b):
            if cell < len(seeds):
                faces[cell].append(loop)
    blocks = Blocks(dim)
    for k, loops in enumerate(faces):
        used, renumbered = np.unique(np.concatenate(loops), return_inverse=True)
        local = corners[used] * size + low
        if dim == 2:
            angle = np.arctan2(*(local - local.mean(axis=0)).T[::-1])
            blocks.add(local[np.argsort(angle)], part=part)
            continue
        split = np.split(renumbered, np.cumsum([len(f) for f in loops])[:-1])
        blocks.add(local, [outward(local, f.tolist(), seeds[k]) for f in split], part)
    return blocks


def merged_corners(corners, tolerance=1e-10):
    """Corners closer than the tolerance are one: qhull lists those of more than four cells several times."""
    cells = np.round(corners / tolerance)
    _, first, number = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    return corners[first], number.ravel()


def outward(points, loop, inside):
    """The loop turned so that its normal points away from an inner point."""
    p = points[loop]
    normal = np.cross(p - p[0], np.roll(p, -1, axis=0) - p[0]).sum(axis=0)
    return loop if normal @ (p.mean(axis=0) - inside) > 0 else loop[::-1]


def random_polyhedra(count, size, *, elongation=1.0, flatness=1.0, angularity=0.5, rng) -> list:
    """Convex stones: a list of (vertices (m, 3) about the origin, faces).

    size: largest extent, a number or (count,) [m]; elongation: second over largest extent, in (0, 1]; flatness: smallest over
    second, in (0, 1]; angularity: from 0, rounded (80 points on an ellipsoid), to 1, angular (8 points).
    """
    count = checks.count("count", count, 0)
    sizes = checks.positive_array("size", checks.spread("size", size, (count,), " [m]"))
    shares = []
    for name, value in (("elongation", elongation), ("flatness", flatness)):
        if not 0 < checks.number(name, value) <= 1:
            raise ValueError(f"{name} is {value}: give a ratio of extents in (0, 1]")
        shares.append(value)
    points = points_of(angularity, 8, 80)
    rng = checks.generator(rng)
    axes = np.array([1.0, shares[0], shares[0] * shares[1]])
    stones = []
    for s in sizes:
        p = spread(points, 3, rng)
        p = p / np.ptp(p, axis=0) * axes * s
        stones.append(mesh.hull(p))
    return stones


def random_polygons(count, size, *, elongation=1.0, angularity=0.5, rng) -> list:
    """Stones in 2D: a list of corners (m, 2), from 4 (angular) to 24 (rounded)."""
    count = checks.count("count", count, 0)
    sizes = checks.positive_array("size", checks.spread("size", size, (count,), " [m]"))
    if not 0 < checks.number("elongation", elongation) <= 1:
        raise ValueError(f"elongation is {elongation}: give a ratio of extents in (0, 1]")
    points, rng = points_of(angularity, 4, 24), checks.generator(rng)
    made = []
    for s in sizes:
        p = spread(points, 2, rng)
        made.append(p / np.ptp(p, axis=0) * (1.0, elongation) * s)
    return made


def points_of(angularity, few, many):
    if not 0 <= checks.number("angularity", angularity) <= 1:
        raise ValueError(f"angularity is {angularity}: give a number from 0, rounded, to 1, angular")
    return round(many + (few - many) * angularity)


def spread(points, dim, rng):
    """Points on the unit circle or sphere, none much nearer to another than a regular pattern: jittered spirals."""
    k = np.arange(points)
    if dim == 2:
        angle = 2 * np.pi * (k + rng.uniform(-0.35, 0.35, points) + rng.uniform()) / points
        return np.column_stack((np.cos(angle), np.sin(angle)))
    z = 1 - (2 * k + 1 + rng.uniform(-0.7, 0.7, points)) / points
    angle = np.pi * (1 + 5**0.5) * k + rng.normal(0, 0.5 / np.sqrt(points), points)
    p = np.column_stack((np.sqrt(1 - z * z) * np.cos(angle), np.sqrt(1 - z * z) * np.sin(angle), z))
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return p @ q


def loose(stones, low, high, rng):
    """Places (n, 3 | 2) and rotations (n, 4 | -) of stones apart in a box open at the top: a lattice of their spheres, from
    which they fall into a deposit. Returns positions, rotations (None in 2D: angles (n,))."""
    rng = checks.generator(rng)
    low, high = (np.asarray(x, float) for x in (low, high))
    corners = [s[0] if isinstance(s, tuple) else s for s in stones]
    step = 2.02 * max(np.max(np.linalg.norm(c, axis=1)) for c in corners)
    counts = np.floor((high - low) / step).astype(int)[: len(low) - 1]
    if np.any(counts < 1):
        raise ValueError(f"the box is {high - low} wide, below a stone's diameter {step:.3g}: widen it")
    layer = int(np.prod(counts))
    n = np.arange(len(stones))
    flat = np.stack(np.unravel_index(n % layer, counts), axis=1) + 0.5
    height = (n // layer + 0.5)[:, None]
    margin = (high - low)[:-1] / counts
    positions = np.concatenate([low[:-1] + flat * margin, low[-1] + height * step], axis=1)
    if len(low) == 2:
        return positions, rng.uniform(0, 2 * np.pi, len(stones))
    q = rng.normal(size=(len(stones), 4))
    return positions, q / np.linalg.norm(q, axis=1, keepdims=True)
