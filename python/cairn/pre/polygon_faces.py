"""Faces of several corners as triangles: fans where these cover them once, else the triangles that shapely finds."""

from __future__ import annotations

import numpy as np

SINGLE, DOUBLE = 2.0**-22, 2.0**-50  # share of the largest coordinate: deviation of corners of a face by rounding
FLAT = 1e-6  # share of the extent: allowed distance of corners from the plane of their face
SLIVER = 1e-12  # double area of a triangle over the square of its longest edge, below which its normal is rounding


class FaceError(ValueError):
    """A face that bounds no part of a plane. fault: a word; face: its number."""

    def __init__(self, fault, message, face):
        super().__init__(message)
        self.fault, self.face = fault, face


def rounding(points, flat):
    """Tolerance of the positions of corners [unit of the points]: flat times their extent, plus the rounding of their digits.
    points: a list of arrays (..., 3)."""
    points = np.concatenate([p.reshape(-1, 3) for p in points])
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return 0.0
    with np.errstate(over="ignore"):
        single = np.array_equal(points.astype(np.float32), points)
    return flat * float(np.max(np.ptp(points, axis=0))) + float(np.max(np.abs(points))) * (SINGLE if single else DOUBLE)


def triangulated(points, loops, name="mesh", limit=None) -> np.ndarray:
    """Triangles (t, 3) of faces, in their order and turned as they are. points (n, 3) [m]; loops (k, m), or lists of corners.

    A convex face is the fan from its first corner. Where that fan would overlap itself or have a triangle without area, shapely
    cuts the face, with any first corner; an edge used in both directions may join a hole to the outline. A face of four corners
    out of plane is cut along its shorter admissible diagonal. limit [m]: allowed distance of corners from the plane of a face of
    more than four, by default 4e-6 of the extent and the rounding of their digits. Raises FaceError for a face that is farther
    out of plane or crosses itself, ImportError where shapely is needed and missing.
    """
    points = np.asarray(points, float)
    limit = 4 * rounding([points], FLAT) if limit is None else limit
    sizes, corners = flat(loops)
    starts = np.concatenate([[0], np.cumsum(sizes)])
    found = [np.zeros((0, 3), np.int64)] * len(sizes)
    for size in np.unique(sizes).tolist():
        which = np.flatnonzero(sizes == size)
        faces = corners[starts[which][:, None] + np.arange(size)]
        fans = np.stack([faces[:, [0, k, k + 1]] for k in range(1, size - 1)], axis=1)
        if size > 3:
            fans = _others_than_fans(points, faces, fans, which, name, limit)
        for k, own in zip(which.tolist(), fans):
            found[k] = own
    return np.concatenate(found) if found else np.zeros((0, 3), np.int64)


def flat(loops):
    """Sizes (k,) of faces and their corners, one after the other."""
    if isinstance(loops, np.ndarray) and loops.ndim == 2:
        return np.full(len(loops), loops.shape[1]), loops.astype(np.int64).ravel()
    sizes = np.array([len(f) for f in loops], np.int64)
    return sizes, np.concatenate([np.asarray(f) for f in loops]).astype(np.int64) if len(sizes) else np.zeros(0, np.int64)


def _others_than_fans(points, faces, fans, which, name, limit):
    """Triangles of faces (k, m) of one size: their fans (k, m - 2, 3) where these cover them once."""
    x = points[faces]
    with np.errstate(invalid="ignore", over="ignore"):
        middle = x.mean(axis=1, keepdims=True)
        size = np.max(np.abs(x - middle), axis=(1, 2))
        unit = (x - middle) / np.where(size > 0, size, 1.0)[:, None, None]
        normal = np.cross(unit, np.roll(unit, -1, axis=1)).sum(axis=1)
        length = np.linalg.norm(normal, axis=1)
        normal /= np.where(length > 0, length, 1.0)[:, None]
        height = np.max(np.abs(np.einsum("kmi,ki->km", unit, normal)), axis=1) * size
        good = covers_once(unit, normal)
    finite = np.isfinite(x).all(axis=(1, 2))  # others are told, or dropped, by who reads the vertices
    out = np.where(finite & (size > 0), height, 0.0)
    warped = out > limit
    if faces.shape[1] > 4 and np.any(warped):
        k = int(np.argmax(warped))
        told = f"{_told(name, which[k], faces[k], x[k])} is not plane: a corner stands {out[k]:.3g} out of it"
        raise FaceError("not plane", f"{told}; move it there, or cut the face into triangles", int(which[k]))
    if faces.shape[1] == 4:
        for k in np.flatnonzero(finite & (warped | ~good)):
            cut = _diagonal(unit[k], normal[k], x[k])
            if cut is not None:
                fans[k], good[k] = faces[k][cut], True
    result = list(fans)
    for k in np.flatnonzero(finite & ~good):
        own = cut_by_shapely(faces[k], unit[k], normal[k], lambda k=k: _told(name, which[k], faces[k], x[k]), int(which[k]))
        result[k] = fans[k] if own is None else own
    return result


def covers_once(unit, normal):
    """True for faces (k, m, 3) with these normals whose fan from the first corner does not overlap itself and has no triangle
    without area."""
    arm = unit[:, 1:] - unit[:, :1]
    a, b = arm[:, :-1], arm[:, 1:]
    area = np.einsum("kmi,ki->km", np.cross(a, b), normal)
    longest = np.max([np.sum(v * v, axis=2) for v in (a, b, b - a)], axis=0)
    angle = np.arctan2(area, np.einsum("kmi,kmi->km", a, b)).sum(axis=1)
    return np.all(area > SLIVER * longest, axis=1) & (angle < 2 * np.pi)


_CUTS = np.array([[[0, 1, 2], [0, 2, 3]], [[1, 2, 3], [1, 3, 0]]])


def _diagonal(unit, normal, x):
    """The two triangles of a face of four corners, by the shorter of the diagonals that cut it into two that look as it does, of
    equal ones that which ends at the least corner; None if neither does."""
    ways = [covers_once(unit[None, start], normal[None])[0] for start in ([0, 1, 2, 3], [1, 2, 3, 0])]
    if not any(ways):
        return None
    if not all(ways):
        return _CUTS[ways.index(True)]
    length = [np.sum((x[i + 2] - x[i]) ** 2) for i in (0, 1)]
    least = [min(x[i].tolist(), x[i + 2].tolist()) for i in (0, 1)]
    return _CUTS[int((length[1], least[1]) < (length[0], least[0]))]


def _told(name, k, face, x):
    middle = ", ".join(f"{c:.6g}" for c in x.mean(axis=0))
    corners = ", ".join(map(str, face[:6].tolist())) + (", ..." if len(face) > 6 else "")
    return f"{name}: face {k} [{corners}] at ({middle})"


def cut_by_shapely(face, unit, normal, told, number):
    """Triangles (t, 3) of a plane face, by the constrained Delaunay triangulation of its outline. None where its corners lie in a
    line, or two of them in one place. told: how errors call it."""
    flat = _in_plane(unit, normal)
    if flat is None:
        return None
    once = face != np.roll(face, 1)
    face, flat = face[once], flat[once]
    place = {}
    for corner, xy in zip(face.tolist(), flat.tolist()):
        if place.setdefault(corner, tuple(xy)) != tuple(xy):
            return None
    corner_at = {xy: corner for corner, xy in place.items()}
    if len(corner_at) != len(place):
        return None
    try:
        from shapely import Polygon, constrained_delaunay_triangles
    except ImportError:
        needed = "shapely (2.1 or later) is needed to cut it into triangles: pip install shapely"
        raise ImportError(f"{told()} is not convex, and {needed}") from None
    rings = [[place[c] for c in ring] for ring in _rings(face.tolist())]
    areas = [_area(ring) for ring in rings]
    outer = int(np.argmax(np.abs(areas))) if rings else -1
    short = any(len(ring) < 3 for ring in rings)
    shape = None if short or not rings else Polygon(rings[outer], [r for k, r in enumerate(rings) if k != outer])
    if shape is None or not shape.is_valid:
        raise FaceError("crossing", f"{told()} crosses or touches itself: order its corners along its rim", number)
    parts = [list(part.exterior.coords)[:3] for part in constrained_delaunay_triangles(shape).geoms]
    found = np.array([[corner_at[xy] for xy in (part if _area(part) > 0 else part[::-1])] for part in parts])
    covered = sum(abs(_area(part)) for part in parts)
    if len(np.unique(found)) != len(place) or abs(covered - shape.area) > 1e-9 * shape.area:
        raise FaceError("crossing", f"{told()} cannot be cut into triangles: drop corners that lie on its other edges", number)
    return found if areas[outer] > 0 else found[:, ::-1]


def _in_plane(unit, normal):
    """Corners (m, 2) in axes of the plane of a face; None if they lie in a line."""
    _, size, axes = np.linalg.svd(unit - unit.mean(axis=0))
    if not size[1] > SLIVER * size[0]:
        return None
    if not np.linalg.norm(np.cross(unit, np.roll(unit, -1, axis=0)).sum(axis=0)) > SLIVER:
        normal = axes[2]  # two loops of opposite sense and equal area have no area vector
    first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    first /= np.linalg.norm(first)
    return np.column_stack([unit @ first, unit @ np.cross(normal, first)])


def _rings(face):
    """Closed rings of corners that remain of a loop when edges that it runs along both ways are left out."""
    edges = list(zip(face, face[1:] + face[:1]))
    there = set(edges)
    left = [(a, b) for a, b in edges if (b, a) not in there]
    following = {}
    for a, b in left:
        following.setdefault(a, []).append(b)
    rings = []
    while following:
        start = next(iter(following))
        ring, at = [], start
        while True:
            ring.append(at)
            ways = following.get(at)
            if not ways:
                break
            step = ways.pop()
            if not ways:
                del following[at]
            at = step
            if at == start:
                break
        rings.append(ring)
    return rings


def _area(ring):
    """Area of a ring of corners (m, 2), positive anticlockwise."""
    x, y = np.array(ring, float).T
    x, y = x - x[0], y - y[0]
    return float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) / 2
