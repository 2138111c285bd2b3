"""Bodies that are not convex, cut into convex parts: exactly, by the planes of their own faces.

The convex hull is cut by the plane of a face that runs through it, each half by those that run through it, and so on (Fuchs,
Kedem & Naylor 1980); cells inside the body are its parts, neighbours whose union is convex are joined again. Suited to bodies
with few re-entrant faces: an L, a stair, a lintel with corbels. A curved hollow needs a part for each facet.
"""

from __future__ import annotations

import numpy as np

from ..base import checks
from . import mass_properties, mesh
from .blocks import cut
from .flatten import plane_faces

OTHERWISE = "take its hull, or nearly convex parts by coacd, near=0.05"
TOO_MUCH = f"the body needs more than {{}} cells to be cut into convex parts: {OTHERWISE}"
ROUNDING = 1e-10  # times the size: a point nearer to a plane lies on it


def convex_parts(vertices, faces=None, *, most=256, near=None) -> list:
    """Convex parts that make up a body, ready for `cairn.polyhedra([parts], ...)`, in 2D `cairn.polygons([parts], ...)`.

    vertices (n, 3) [m] and faces, closed, anticlockwise from outside; or the corners (n, 2) of a polygon. Returns a list of
    (vertices, faces), of corners in 2D: one if the body is convex. most: largest number of cells of the decomposition. near:
    where these do not suffice, approximate parts whose hulls deviate from the body by at most this share of its size, 0.01 to 1
    (CoACD, Wei et al. 2022; needs coacd). Raises MeshError for a surface that bounds no body and ValueError for one that needs
    more cells.

    >>> len(convex_parts([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]]))
    2
    """
    if faces is None:
        vertices = checks.real_array("vertices", vertices, (None, 2))
        return polygon_parts(mesh.check_polygon(anticlockwise(vertices)), most)
    vertices = np.asarray(vertices, float)
    if near is not None and not 0.01 <= checks.number("near", near) <= 1:
        raise ValueError(f"near is {near}: give a share of the size from 0.01 to 1")
    report = mesh.check(vertices, faces)
    if report.convex:
        return [(vertices, faces)]
    try:
        return exact_parts(vertices, faces, most, report.volume)
    except TooMuch:
        if near is None:
            raise
    return near_parts(vertices, mesh.triangles(vertices, faces), near)


class TooMuch(ValueError):
    """A body that cannot be cut exactly into as few parts as are wanted."""


def near_parts(vertices, fans, near):
    """Convex hulls that approximate a body within `near`, by the library CoACD."""
    coacd = mesh.library("coacd", "to cut a body into nearly convex parts")
    coacd.set_log_level("error")
    found = coacd.run_coacd(coacd.Mesh(vertices, fans), threshold=float(near), preprocess_mode="off", seed=1)
    return [mesh.hull(np.asarray(v, float)) for v, _ in found]


def exact_parts(vertices, faces, most, own):
    """Convex parts of a body, cut along the planes of its faces at reentrant edges; own: volume of the body [m3]."""
    fans = mesh.triangles(vertices, faces)
    size = float(np.max(np.ptp(vertices, axis=0)))
    soup = vertices[fans]
    if reentrant(vertices, fans, ROUNDING * size) > 8 * checks.count("most", most, 1):
        raise TooMuch(TOO_MUCH.format(most))  # at once, instead of after minutes
    whole = mesh.hull(vertices)
    try:
        cells = split(whole[0], plane_faces(*whole, ROUNDING), inner(soup, vertices, ROUNDING * size), ROUNDING * size, most)
    except LookupError:
        raise TooMuch(f"a cut does not close, by rounding of faces nearly in one plane: {OTHERWISE}") from None
    parts = joined([c for c in cells if winding(soup, c[0].mean(axis=0)) > 0.5], size)
    volume = sum(mass_properties.polyhedra([v], [f]).measure[0] for v, f in parts)
    if abs(volume - own) > 1e-6 * own:
        raise TooMuch(f"the parts have {volume:.6g} of its {own:.6g} m3: it has slivers that rounding swallows; {OTHERWISE}")
    return parts


def reentrant(vertices, fans, small):
    """How many edges of a closed surface bend inward by more than a height [m]."""
    start, stop, apex = (np.roll(fans, -k, axis=1).ravel() for k in range(3))
    a, b, c = (vertices[fans[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    key = start * len(vertices) + stop
    order = np.argsort(key)
    across = order[np.searchsorted(key[order], stop * len(vertices) + start)]
    height = np.einsum("ij,ij->i", vertices[apex[across]] - vertices[start], np.repeat(normal, 3, axis=0))
    return int(np.sum(height > small)) // 2


def inner(soup, vertices, small):
    """The triangles of which some corner of the body lies in front: the others are of its hull and cut nothing."""
    normal = np.cross(soup[:, 1] - soup[:, 0], soup[:, 2] - soup[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    chunk = max(1, (1 << 22) // len(vertices))
    parts = range(0, len(soup), chunk)
    front = [(vertices @ normal[k : k + chunk].T).max(axis=0) for k in parts]
    offset = np.einsum("ij,ij->i", normal, soup[:, 0])
    return list(soup[np.concatenate(front) - offset > small])


def anticlockwise(corners):
    a, b = corners - corners[:1], np.roll(corners, -1, axis=0) - corners[:1]
    return corners[::-1] if np.sum(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]) < 0 else corners


def polygon_parts(corners, most):
    """Parts of a polygon: those of the prism over it, whose feet they are."""
    size, m = float(np.max(np.ptp(corners, axis=0))), len(corners)
    edges = np.roll(corners, -1, axis=0) - corners
    if np.min(edges[:, 0] * np.roll(edges, -1, axis=0)[:, 1] - edges[:, 1] * np.roll(edges, -1, axis=0)[:, 0]) >= 0:
        return [corners]
    solid = np.concatenate([np.column_stack((corners, np.full(m, z))) for z in (0.0, size)])
    sides = [[k, (k + 1) % m, m + (k + 1) % m, m + k] for k in range(m)]
    lids = [t for k in ears(corners) for t in (k[::-1], [i + m for i in k])]
    parts = []
    for v, _ in convex_parts(solid, [*lids, *sides], most=most):
        foot = v[v[:, 2] < size / 2][:, :2]
        middle = foot.mean(axis=0)
        parts.append(foot[np.argsort(np.arctan2(*(foot - middle).T[::-1]))])
    return parts


def ears(corners):
    """Triangles of a simple polygon, ear by ear (Meisters 1975)."""
    left, found = list(range(len(corners))), []

    def turn(i, j, k):
        (ax, ay), (bx, by) = corners[j] - corners[i], corners[k] - corners[i]
        return ax * by - ay * bx

    while len(left) > 3:
        for at in range(len(left)):
            i, j, k = left[at - 1], left[at], left[(at + 1) % len(left)]
            others = [p for p in left if p not in (i, j, k)]
            if turn(i, j, k) > 0 and not any(min(turn(i, j, p), turn(j, k, p), turn(k, i, p)) >= 0 for p in others):
                found.append([i, j, k])
                break
        else:
            at = min(range(len(left)), key=lambda q: abs(turn(left[q - 1], left[q], left[(q + 1) % len(left)])))
        del left[at]
    return [*found, left]


def split(vertices, faces, walls, small, most):
    """Convex cells (vertices, faces) into which the planes of the walls, a list of polygons (m, 3), cut a convex one."""
    cells, waiting = [], [(vertices, faces, walls)]
    while waiting:
        vertices, faces, walls = waiting.pop()
        if len(cells) + len(waiting) >= most:
            raise TooMuch(TOO_MUCH.format(most))
        if not walls:
            cells.append((vertices, faces))
            continue
        normal, point = best_plane(walls, small)
        sides = []
        for way in (1.0, -1.0):
            half = cut(vertices, faces, point, way * normal)
            kept = [w for w in (behind(w, point, way * normal, small) for w in walls) if w is not None]
            sides.append((half, kept))
        for half, kept in sides:
            if half is not None:
                waiting.append((*half, kept))
    return cells


def best_plane(walls, small):
    """Normal and point of the plane that cuts the fewest of the walls, of those the one with most walls in it."""
    best = None
    normals = [plane(w) for w in walls]
    corners = np.concatenate(walls)
    first = np.cumsum([0] + [len(w) for w in walls[:-1]])
    for n, w in zip(normals, walls):
        area = np.linalg.norm(n)
        height = (corners - w[0]) @ (n / area)
        high, low = np.maximum.reduceat(height, first), np.minimum.reduceat(height, first)
        within = (high <= small) & (low >= -small)
        score = (int(np.sum((high > small) & (low < -small))), -int(np.sum(within)))
        if best is None or score < best[0]:
            best = score, n / area, w[0]
    return best[1:]


def plane(polygon):
    """Newell's normal of a polygon, twice its area long."""
    p = polygon - polygon[0]
    return np.cross(p, np.roll(p, -1, axis=0)).sum(axis=0)


def behind(wall, point, normal, small):
    """Part of a wall behind a plane; None if there is none, or if the wall lies in the plane."""
    height = (wall - point) @ normal
    if np.all(height >= -small):
        return None
    if np.all(height <= small):
        return wall
    kept = []
    for k in range(len(wall)):
        if height[k - 1] * height[k] < 0 and min(abs(height[k - 1]), abs(height[k])) > small:
            kept.append(wall[k - 1] + height[k - 1] / (height[k - 1] - height[k]) * (wall[k] - wall[k - 1]))
        if height[k] <= small:
            kept.append(wall[k])
    found = np.array(kept)
    return found if len(found) > 2 and np.linalg.norm(plane(found)) > small * np.max(np.ptp(found, axis=0)) else None


def winding(triangles, point):
    """How often closed triangles (t, 3, 3) go round a point (van Oosterom & Strackee 1983)."""
    a, b, c = np.moveaxis(triangles - point, 1, 0)
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    dots = [np.einsum("ij,ij->i", x, y) for x, y in ((a, b), (b, c), (c, a))]
    triple = np.einsum("ij,ij->i", a, np.cross(b, c))
    return float(np.sum(2 * np.arctan2(triple, la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb)) / (4 * np.pi))


def joined(parts, size):
    """Neighbours whose union is convex, made one, as long as there are any."""
    volume = [mass_properties.polyhedra([v], [f]).measure[0] for v, f in parts]
    k = 0
    while k < len(parts):
        for j in range(len(parts)):
            if j == k or not touching(parts[j][0], parts[k][0], size):
                continue
            whole = mesh.hull(np.concatenate([parts[j][0], parts[k][0]]))
            total = mass_properties.polyhedra([whole[0]], [whole[1]]).measure[0]
            if total <= (volume[j] + volume[k]) * (1 + 1e-9):
                parts[min(j, k)], volume[min(j, k)] = (whole[0], plane_faces(*whole, ROUNDING)), total
                del parts[max(j, k)], volume[max(j, k)]
                k = -1
                break
        k += 1
    return parts


def touching(a, b, size):
    gap = ROUNDING * size
    return bool(np.all(a.min(axis=0) <= b.max(axis=0) + gap) and np.all(b.min(axis=0) <= a.max(axis=0) + gap))
