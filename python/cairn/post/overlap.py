"""Area of disks in a polygon, volume of spheres in a box."""

import numpy as np


def disk_polygon_area(centers, radii, vertices):
    """Area that each disk shares with a simple polygon [m2], shape (n,).

    centers (n, 2), radii (n,) [m]; vertices (k, 2) [m] in either sense. Exact to rounding: the sum over the edges of the
    signed area that the disk shares with the triangle of its centre and the edge.
    """
    centers, radii, vertices = (np.asarray(x, dtype=float) for x in (centers, radii, vertices))
    if vertices.ndim != 2 or vertices.shape[1] != 2 or len(vertices) < 3:
        raise ValueError(f"vertices has shape {vertices.shape}; it must be (k, 2) with k at least 3")
    total = np.zeros(len(centers))
    for start, end in zip(vertices, np.roll(vertices, -1, axis=0), strict=True):
        total += _disk_triangle(start - centers, end - centers, radii)
    return np.minimum(np.abs(total), np.pi * radii**2)


def _disk_triangle(p, q, r):
    """Signed area shared by disks of radius r about 0 and triangles (0, p, q); p, q (n, 2), r (n,)."""
    d = q - p
    length2 = np.sum(d * d, axis=1)
    length2 = np.where(length2 > 0, length2, 1.0)
    # the edge is inside the disk for t in [t0, t1]
    middle = -np.sum(p * d, axis=1) / length2
    distance2 = np.maximum(np.sum((p + middle[:, None] * d) ** 2, axis=1), 0.0)
    half = np.sqrt(np.maximum(r * r - distance2, 0.0) / length2)
    t0, t1 = np.clip(middle - half, 0.0, 1.0), np.clip(middle + half, 0.0, 1.0)
    a, b = p + t0[:, None] * d, p + t1[:, None] * d
    return 0.5 * (_cross(a, b) + r * r * (_angle(p, a) + _angle(b, q)))


def _cross(a, b):
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def _angle(a, b):
    return np.arctan2(_cross(a, b), np.sum(a * b, axis=1))


def box_vertices(low, high):
    """Corners (4, 2) of a rectangle."""
    return np.array([low, (high[0], low[1]), high, (low[0], high[1])], dtype=float)


def sphere_box_volume(centers, radii, low, high):
    """Volume that each sphere shares with a box [m3], shape (n,).

    centers (n, 3), radii (n,), low, high (3,) [m]. In closed form for spheres that at most one face cuts; for the others
    the area of the sections is integrated piece by piece, to about 1e-12 of the volume of the sphere.
    """
    centers, radii = np.asarray(centers, dtype=float), np.asarray(radii, dtype=float)
    low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    inside = np.concatenate([centers - low, high - centers], axis=1)  # distance behind each face, (n, 6)
    whole = 4.0 / 3.0 * np.pi * radii**3
    cut = np.abs(inside) < radii[:, None]
    result = np.where(np.any(inside <= -radii[:, None], axis=1), 0.0, whole)
    within = np.all(inside > -radii[:, None], axis=1)
    one = within & (cut.sum(axis=1) == 1)
    depth = radii[one] + np.take_along_axis(inside[one], np.argmax(cut[one], axis=1)[:, None], 1)[:, 0]
    result[one] = np.pi * depth**2 * (3.0 * radii[one] - depth) / 3.0
    for i in np.flatnonzero(within & (cut.sum(axis=1) > 1)):
        result[i] = _sections(centers[i], radii[i], low, high)
    return result


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)


def _sections(center, radius, low, high):
    """Integral over z of the area that the section of a sphere shares with the section of the box."""
    corners = box_vertices(low[:2], high[:2]) - center[:2]
    bottom, top = max(low[2] - center[2], -radius), min(high[2] - center[2], radius)
    # the section changes its kind where its circle reaches an edge or a corner
    reaches = np.concatenate([np.abs(corners).ravel(), np.linalg.norm(corners, axis=1)])
    turns = np.sqrt(np.maximum(radius**2 - reaches[reaches < radius] ** 2, 0.0))
    bounds = np.unique(np.clip(np.concatenate([[bottom, top], turns, -turns]), bottom, top))
    volume = 0.0
    for a, b in zip(bounds[:-1], bounds[1:], strict=True):
        # z = a + (b - a) s^2 (3 - 2 s) takes the square roots at the ends away
        s = 0.5 * (_NODES + 1.0)
        z = a + (b - a) * s * s * (3.0 - 2.0 * s)
        weight = 0.5 * _WEIGHTS * (b - a) * 6.0 * s * (1.0 - s)
        r = np.sqrt(np.maximum(radius**2 - z * z, 0.0))
        volume += weight @ disk_polygon_area(np.zeros((len(z), 2)), r, corners)
    return volume
