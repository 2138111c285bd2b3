"""Clumps: rigid bodies made of several disks or spheres, and their mass, centre and inertia.

Where parts overlap, mass is that of their union (`overlap="union"`) or the sum over the parts (`overlap="sum"`, so overlaps count
twice). The union of disks is integrated along its outline, exactly; that of spheres by Gauss quadrature over slices whose union
of disks is exact, to about 1e-8 of the mass at the default number of points (`points`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..base import checks
from . import mass_properties
from .deposits import grains_of

ARC_NODES, ARC_WEIGHTS = np.polynomial.legendre.leggauss(32)  # exact to rounding for the moments over a full circle


class Clump(NamedTuple):
    """A clump in the axes in which its parts were given, as cairn.clumps takes it.

    Parameters
    ----------
    offsets : ndarray (m, dim)
        Centres of the parts from the centre of mass [m].
    radii : ndarray (m,)
        Radii of the parts [m].
    mass : float
        Mass [kg].
    inertia : ndarray (1,) or (1, 3, 3)
        Moment of inertia (2D), or the tensor of inertia about the centre of mass (3D) [kg m2].
    center : ndarray (dim,)
        Centre of mass [m].
    axes : ndarray (dim, dim)
        Principal axes as columns, right-handed; those given where the tensor is diagonal in them.
    """

    offsets: np.ndarray
    radii: np.ndarray
    mass: float
    inertia: np.ndarray
    center: np.ndarray
    axes: np.ndarray

    @property
    def moments(self):
        """Principal moments of inertia, (1,) in 2D, (3,) in 3D in the order of `axes` [kg m2]."""
        return self.inertia if len(self.axes) == 2 else np.einsum("ji,jk,ki->i", self.axes, self.inertia[0], self.axes)


def clump(centers, radii, density, *, overlap="union", depth=1.0, points=48) -> Clump:
    """The rigid body that disks (m, 2) or spheres (m, 3) of one density make together.

    It keeps the axes in which the parts are given: `cairn.clumps(places, c.offsets, c.radii, c.mass, c.inertia, material)` puts
    it there as it was given. density [kg/m3]; depth [m] of a 2D body. Raises ValueError for bad sizes.
    """
    centers = np.asarray(centers)
    dim = checks.dimension(centers.shape[-1] if centers.ndim == 2 else 0)
    centers, radii = grains_of(centers, radii, dim)
    if len(radii) == 0:
        raise ValueError("centers is empty: give at least one part")
    density, depth = checks.positive("density", density), checks.positive("depth", depth)
    points = checks.count("points", points, 4)
    if overlap not in ("union", "sum"):
        raise ValueError(f'overlap is {overlap!r}: give "union" or "sum"')
    # moments are taken about the middle of the parts in units of their size, so that far or tiny clumps keep their digits
    middle = centers.mean(axis=0)
    size = float(np.max(np.linalg.norm(centers - middle, axis=1) + radii))
    c, r = (centers - middle) / size, radii / size
    if overlap == "sum" or not parts_overlap(c, r):
        volume, first, second = sum_moments(c, r)
    else:
        volume, first, second = disk_union_moments(c, r) if dim == 2 else sphere_union_moments(c, r, points)
    center = first / volume
    second = second - volume * np.outer(center, center)
    mass = density * volume * size**dim * (depth if dim == 2 else 1.0)
    scale = mass / volume * size**2
    if dim == 2:
        return Clump(
            (c - center) * size, radii.copy(), mass, np.array([np.trace(second) * scale]), middle + center * size, np.eye(2)
        )
    tensor = mass_properties.inertia_of((second + second.T)[None] / 2) * scale
    _, axes = mass_properties.principal(tensor)  # of the very tensor that cairn.clumps takes: signs hang on its last digits
    return Clump((c - center) * size, radii.copy(), mass, tensor, middle + center * size, axes[0])


def parts_overlap(c: np.ndarray, r: np.ndarray) -> bool:
    i, j = np.triu_indices(len(r), 1)
    return bool(np.any(np.linalg.norm(c[i] - c[j], axis=1) < (r[i] + r[j]) * (1.0 - 1.0e-12)))


def sum_moments(c: np.ndarray, r: np.ndarray):
    """Volume, first moment (dim,) and second moment (dim, dim) of parts, each counted for itself."""
    dim = c.shape[1]
    volumes = np.pi * r**2 if dim == 2 else 4.0 / 3.0 * np.pi * r**3
    own = np.sum(volumes * r**2) / (dim + 2)  # disk about a diameter m r^2/4, sphere about a plane m r^2/5
    return volumes.sum(), volumes @ c, (c * volumes[:, None]).T @ c + own * np.eye(dim)


def free_arcs(c: np.ndarray, r: np.ndarray) -> np.ndarray:
    """Arcs of the circles that lie on the outline of their union: rows (number of the disk, angle from, angle to)."""
    arcs = []
    for i in range(len(r)):
        hidden: list[tuple] = []
        inside = False  # disk j; of equal disks the first one stays
        for j in range(len(r)):
            d = c[j] - c[i]
            distance = np.hypot(*d)
            if j == i or distance >= r[i] + r[j]:
                continue
            if distance + r[i] <= r[j] and (distance + r[i] < r[j] or r[i] < r[j] or j < i):
                inside = True
                break
            if distance + r[j] <= r[i]:
                continue
            cosine = (distance**2 + (r[i] - r[j]) * (r[i] + r[j])) / (2.0 * distance * r[i])
            half, towards = np.arccos(np.clip(cosine, -1.0, 1.0)), np.arctan2(d[1], d[0])
            start = (towards - half) % (2.0 * np.pi)
            stop = start + 2.0 * half
            hidden += [(start, min(stop, 2.0 * np.pi)), (0.0, stop - 2.0 * np.pi)]
        if inside:
            continue
        reached = 0.0
        for start, stop in sorted(hidden):
            if start > reached:
                arcs.append((i, reached, start))
            reached = max(reached, stop)
        if reached < 2.0 * np.pi:
            arcs.append((i, reached, 2.0 * np.pi))
    return np.array(arcs, dtype=np.float64).reshape(-1, 3)


def disk_union_moments(c: np.ndarray, r: np.ndarray):
    """Area, first and second moments of the union of disks, by Green's theorem along its outline."""
    arcs = free_arcs(c, r)
    i = arcs[:, 0].astype(np.int64)
    half = (arcs[:, 2] - arcs[:, 1]) / 2.0
    angle = (arcs[:, 1] + half)[:, None] + half[:, None] * ARC_NODES
    nx, ny = np.cos(angle), np.sin(angle)
    x, y = c[i, 0, None] + r[i, None] * nx, c[i, 1, None] + r[i, None] * ny
    ds = half[:, None] * ARC_WEIGHTS * r[i, None]
    area = np.sum((x * nx + y * ny) * ds) / 2.0
    first = np.array([np.sum(x**2 * nx * ds), np.sum(y**2 * ny * ds)]) / 2.0
    xx, yy, xy = np.sum(x**3 * nx * ds) / 3.0, np.sum(y**3 * ny * ds) / 3.0, np.sum(x**2 * y * nx * ds) / 2.0
    return area, first, np.array([[xx, xy], [xy, yy]])


def sphere_union_moments(c: np.ndarray, r: np.ndarray, points: int):
    """Volume, first and second moments of the union of spheres, over slices across z."""
    # between two of these heights the slice changes smoothly but for triple crossings
    levels = [c[:, 2] - r, c[:, 2] + r]
    for i, j in zip(*np.triu_indices(len(r), 1)):
        d = c[j] - c[i]
        square = d @ d
        along = 0.5 * (square + (r[i] - r[j]) * (r[i] + r[j])) / square if square > 0.0 else np.inf
        ring = r[i] ** 2 - along**2 * square if square > 0.0 else -1.0
        if ring > 0.0:  # the highest and lowest points of the circle in which two spheres meet
            rise = np.sqrt(ring * (1.0 - d[2] ** 2 / square))
            levels.append(c[i, 2] + along * d[2] + np.array([-rise, rise]))
    heights = np.unique(np.concatenate(levels))
    nodes, weights = np.polynomial.legendre.leggauss(points)
    angle = (nodes + 1.0) * np.pi / 2.0
    volume, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
    for low, high in zip(heights[:-1], heights[1:]):
        # z = cos takes the square roots at both ends out of the integrand
        heights = (low + high) / 2.0 - (high - low) / 2.0 * np.cos(angle)
        shares = weights * np.pi / 2.0 * np.sin(angle) * (high - low) / 2.0
        for z, share in zip(heights, shares):
            cut = r**2 - (c[:, 2] - z) ** 2
            inside = cut > 0.0
            if not np.any(inside):
                continue
            area, (ax, ay), flat = disk_union_moments(c[inside, :2], np.sqrt(cut[inside]))
            volume += share * area
            first += share * np.array([ax, ay, z * area])
            second[:2, :2] += share * flat
            second[2] += share * z * np.array([ax, ay, z * area])
    second[:2, 2] = second[2, :2]
    return volume, first, second


def row(count, radius, spacing) -> tuple[np.ndarray, np.ndarray]:
    """`count` equal parts in line along x, `spacing` [m] between centres: centres (count, 3) and radii; 2D: take [:, :2]."""
    count, radius = checks.count("count", count, 1), checks.positive("radius", radius)
    spacing = checks.positive("spacing", spacing)
    centers = np.zeros((count, 3))
    centers[:, 0] = (np.arange(count) - (count - 1) / 2.0) * spacing
    return centers, np.full(count, radius)


def ring(count, radius, spacing) -> tuple[np.ndarray, np.ndarray]:
    """`count` equal parts on a regular polygon of side `spacing` [m] in the plane z = 0: centres (count, 3) and radii."""
    count, radius = checks.count("count", count, 2), checks.positive("radius", radius)
    spacing = checks.positive("spacing", spacing)
    angle = 2.0 * np.pi * np.arange(count) / count
    reach = spacing / (2.0 * np.sin(np.pi / count))
    return np.column_stack((reach * np.cos(angle), reach * np.sin(angle), np.zeros(count))), np.full(count, radius)


def tetrahedron(radius, spacing) -> tuple[np.ndarray, np.ndarray]:
    """Four equal spheres, `spacing` [m] between any two centres: centres (4, 3) and radii."""
    radius, spacing = checks.positive("radius", radius), checks.positive("spacing", spacing)
    corners = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    return corners * spacing / np.sqrt(8.0), np.full(4, radius)
