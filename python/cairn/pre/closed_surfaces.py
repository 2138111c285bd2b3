"""Surfaces of bodies: closed, turned outward, without holes, folds or slivers; each fault is named with its remedy.

A body needs a closed surface that does not cross itself, or its volume and inertia mean nothing. `check` refuses other surfaces.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base import checks
from ..base.libraries import library
from . import mass_properties, polygon_faces
from .box_pairs import overlapping_pairs
from .polygon_faces import SLIVER


class MeshError(ValueError):
    """A surface that bounds no body. fault: a word; items: numbers of the faces, edges or vertices concerned."""

    def __init__(self, fault, message, items=()):
        super().__init__(message)
        self.fault, self.items = fault, np.asarray(items)


@dataclass(frozen=True)
class MeshReport:
    """Result of a check. volume [m3]; area [m2]; smallest_edge, largest_edge [m]; convex."""

    vertices: int
    faces: int
    volume: float
    area: float
    smallest_edge: float
    largest_edge: float
    convex: bool

    def __str__(self):
        return (
            f"closed surface of {self.vertices} vertices and {self.faces} triangles, {'' if self.convex else 'not '}convex: "
            f"volume {self.volume:.6g} m3, area {self.area:.6g} m2, edges {self.smallest_edge:.3g} to {self.largest_edge:.3g} m"
        )


def triangles(vertices, faces, name: str = "mesh", limit=None) -> np.ndarray:
    """Faces as triangles (t, 3), turned as they are. vertices (n, 3) [m]; faces (k, 3) or polygons, convex or not. limit [m]: how
    far corners may stand out of a face of more than four, 4e-6 of the extent if not given. Raises MeshError for a face that is
    farther out of plane or crosses itself."""
    fans = mass_properties.triangles(faces, len(vertices))
    if len(fans) == len(faces):
        return fans
    try:
        return polygon_faces.triangulated(vertices, faces, name, limit)
    except polygon_faces.FaceError as error:
        raise MeshError(error.fault, str(error), [error.face]) from None


def check(vertices, faces, name: str = "mesh") -> MeshReport:
    """Refuses (MeshError) a surface that bounds no body: vertices (n, 3) [m], faces (m, 3) or polygons, seen from outside
    anticlockwise. Faults: shape, not finite, not plane, flat triangle, open, folded, inside out, flat, crossing."""
    vertices = checks.real_array(f"{name}: vertices", vertices, (None, 3))
    fans = triangles(vertices, faces, name)
    edges = np.linalg.norm(vertices[fans] - vertices[np.roll(fans, -1, axis=1)], axis=2)
    refuse_slivers(name, vertices, fans, edges)
    refuse_open(name, fans, vertices)
    refuse_pinched(name, fans, vertices)
    try:
        volume = float(mass_properties.polyhedra([vertices], [fans]).measure[0])
    except ValueError as error:
        inverted = "inside out" in str(error)
        remedy = "turn every face round, faces[:, ::-1]" if inverted else "give it a thickness"
        fault = "inside out" if inverted else "flat"
        state = "is inside out: its volume is negative" if inverted else "encloses no volume"
        raise MeshError(fault, f"{name} {state}; {remedy}") from None
    refuse_crossing(name, vertices, fans)
    a, b, c = (vertices[fans[:, k]] for k in range(3))
    area = float(np.sum(np.linalg.norm(np.cross(b - a, c - a), axis=1)) / 2)
    return MeshReport(len(vertices), len(fans), volume, area, float(edges.min()), float(edges.max()), is_convex(vertices, fans))


def refuse_slivers(name, vertices, fans, edges):
    double_area = np.linalg.norm(
        np.cross(vertices[fans[:, 1]] - vertices[fans[:, 0]], vertices[fans[:, 2]] - vertices[fans[:, 0]]), axis=1
    )
    flat = np.flatnonzero(double_area <= SLIVER * edges.max(axis=1) ** 2)
    if len(flat):
        raise MeshError(
            "flat triangle",
            f"{name}: face {flat[0]} {fans[flat[0]].tolist()} at {place(vertices[fans[flat[0]]].mean(axis=0))} has no area "
            f"({len(flat)} of {len(fans)} faces); "
            "merge its vertices and drop it: cairn.pre.mesh.repair",
            flat,
        )


def place(point) -> str:
    """A point as words of an error."""
    return "(" + ", ".join(f"{x:.6g}" for x in point) + ")"


def refuse_open(name, fans, vertices=None):
    """Every edge must be run along once each way. vertices (n, 3): for words on where it is not."""

    def edge(i, j):
        where = f", {place(vertices[i])} to {place(vertices[j])}," if vertices is not None else ""
        return f"the edge from vertex {i} to {j}{where}"

    start, stop = fans.ravel(), np.roll(fans, -1, axis=1).ravel()
    count = int(fans.max()) + 1
    forward, backward = np.sort(start * count + stop), np.sort(stop * count + start)
    twice = forward[1:][forward[1:] == forward[:-1]]
    if np.array_equal(forward, backward) and not len(twice):
        return
    if len(twice):
        i, j = divmod(int(twice[0]), count)
        raise MeshError(
            "folded",
            f"{name}: {edge(i, j)} is run along twice the same way ({len(twice)} edges): some faces are "
            "turned the wrong way or more than two meet at an edge; cairn.pre.mesh.repair turns them alike",
            np.column_stack(np.divmod(twice, count)),
        )
    alone = np.setdiff1d(forward, backward)
    i, j = divmod(int(alone[0]), count)
    raise MeshError(
        "open",
        f"{name} is open: {edge(i, j)} has a face on one side only ({len(alone)} edges); close the holes, "
        "or let cairn.pre.mesh.repair fill them and merge vertices that coincide",
        np.column_stack(np.divmod(alone, count)),
    )


def refuse_pinched(name, fans, vertices):
    """A vertex whose faces make two fans joins two surfaces at a point."""
    corner = fans.ravel()
    # successor of a corner round its vertex: the face across the edge that ends there. A manifold vertex has a single cycle
    start, stop = corner, np.roll(fans, -1, axis=1).ravel()
    before = np.roll(fans, 1, axis=1).ravel()
    size = int(fans.max()) + 1
    by_start = np.argsort(start * size + stop)
    keys = (start * size + stop)[by_start]
    following = by_start[np.searchsorted(keys, corner * size + before)]
    label = cycle_labels(following)
    first = np.full(len(vertices), len(label))
    np.minimum.at(first, corner, label)
    split = np.unique(corner[label != first[corner]])
    if len(split):
        raise MeshError(
            "pinched",
            f"{name}: the surface touches itself at vertex {split[0]}, {place(vertices[split[0]])} ({len(split)} vertices): give "
            "each part a vertex of its own, or split the body into its parts (cairn.pre.mesh.parts)",
            split,
        )


def cycle_labels(following):
    """The smallest member of each item's cycle, by doubling."""
    label, jump = np.arange(len(following)), following.copy()
    while True:
        best = np.minimum(label, label[jump])
        if np.array_equal(best, label) and np.array_equal(label[following], label):
            return label
        label, jump = best, jump[jump]


def refuse_crossing(name, vertices, fans):
    if is_star_shaped(vertices, fans):
        return
    crossing = crossing_pairs(vertices, fans)
    if len(crossing):
        raise MeshError(
            "crossing",
            f"{name} crosses itself: faces {crossing[0, 0]} and {crossing[0, 1]} cut each other near "
            f"{place(vertices[fans[crossing[0, 0]]].mean(axis=0))} ({len(crossing)} pairs); "
            "mend it in the program it comes from, or take its convex hull (convex='hull')",
            crossing,
        )


def is_star_shaped(vertices, fans) -> bool:
    """True if all faces cover the sphere round an inner point once, with one orientation: then no faces cross.

    Solid angles after van Oosterom & Strackee (1983).
    """
    center = mass_properties.polyhedra([vertices], [fans]).center[0]
    a, b, c = (vertices[fans[:, k]] - center for k in range(3))
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    triple = np.einsum("ij,ij->i", a, np.cross(b, c))
    dots = [np.einsum("ij,ij->i", x, y) for x, y in ((a, b), (b, c), (c, a))]
    if np.any(triple <= 64 * np.finfo(float).eps * la * lb * lc):
        return False
    angle = 2 * np.arctan2(triple, la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb)
    return abs(angle.sum() / (4 * np.pi) - 1) < 0.5


def crossing_pairs(vertices, fans, chunk=1 << 20) -> np.ndarray:
    """Pairs of triangles (k, 2) of which an edge of one goes through the inside of the other, or, when they share no
    vertex, touches it."""
    corners = vertices[fans]
    pairs = overlapping_pairs(corners.min(axis=1), corners.max(axis=1))
    found = []
    for k in range(0, len(pairs), chunk):
        i, j = pairs[k : k + chunk].T
        apart = (fans[i][:, :, None] != fans[j][:, None, :]).all(axis=(1, 2))
        cut = edge_through(corners[i], corners[j], apart) | edge_through(corners[j], corners[i], apart)
        found.append(pairs[k : k + chunk][cut])
    return np.concatenate(found) if found else np.empty((0, 2), np.int64)


def edge_through(one, other, touching):
    """Tests whether an edge of the triangles in the first array (n, 3, 3) crosses the inside of those in the second, by signs of
    volumes beyond rounding; where touching (n,), the border counts as well."""
    middle = other.mean(axis=1, keepdims=True)
    one, other = one - middle, other - middle
    a, b, c = (other[:, k] for k in range(3))
    size = np.maximum(np.abs(one).max(axis=(1, 2)), np.abs(other).max(axis=(1, 2)))
    small = 64 * np.finfo(float).eps * size**3

    def side(p, q, r, s):  # sign of the volume of the tetrahedron p q r s, 0 within rounding
        v = np.einsum("ij,ij->i", q - p, np.cross(r - p, s - p))
        return np.where(np.abs(v) <= small, 0, np.sign(v))

    heights = [side(a, b, c, one[:, k]) for k in range(3)]
    through = np.zeros(len(one), bool)
    for k in range(3):
        p, q = one[:, k], one[:, k - 2]
        product = heights[k] * heights[k - 2]
        sides = np.stack((side(p, q, a, b), side(p, q, b, c), side(p, q, c, a)))
        through |= (product < 0) & (np.abs(sides.sum(axis=0)) == 3)
        crossed = (sides >= 0).all(axis=0) | (sides <= 0).all(axis=0)
        through |= touching & (product <= 0) & (heights[k] != heights[k - 2]) & crossed
    return through


def is_convex(vertices, fans, tolerance=1e-9) -> bool:
    """True if no vertex lies outside the plane of a face by more than the tolerance times the size of the body."""
    size = np.max(np.ptp(vertices, axis=0))
    a, b, c = (vertices[fans[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    if len(fans) * len(vertices) <= 1 << 22:
        heights = vertices @ normal.T - np.einsum("ij,ij->i", normal, a)
        return bool(np.max(heights) <= tolerance * size)
    # across each edge of a surface that turns round once the neighbour bends inward
    start, stop = fans.ravel(), np.roll(fans, -1, axis=1).ravel()
    face = np.repeat(np.arange(len(fans)), 3)
    key = start * len(vertices) + stop
    order = np.argsort(key)
    across = order[np.searchsorted(key[order], stop * len(vertices) + start)]
    opposite = vertices[np.roll(fans, 1, axis=1).ravel()][across]
    bend = np.einsum("ij,ij->i", opposite - vertices[start], normal[face])
    return bool(np.max(bend) <= tolerance * size) and is_star_shaped(vertices, fans)


def weld(vertices, faces, tolerance=0.0) -> tuple[np.ndarray, np.ndarray]:
    """Vertices that coincide become one: vertices, faces. tolerance: width of the cells within which they do, over the
    size of the mesh; 0 merges equal ones only. Faces that lose a corner are dropped."""
    vertices, faces = np.asarray(vertices, float), np.asarray(faces)
    cell = tolerance * np.max(np.ptp(vertices, axis=0))
    keys = vertices + 0.0 if cell == 0 else np.round(vertices / cell)  # + 0.0: -0 and 0 are one
    _, first, number = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    faces = rank[number.ravel()][faces]
    whole = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    return vertices[first[order]], faces[whole]


def parts(vertices, faces) -> list[tuple[np.ndarray, np.ndarray]]:
    """The surfaces, not joined by any edge, that a list of triangles holds."""
    vertices, faces = np.asarray(vertices, float), np.asarray(faces)
    label = np.arange(len(vertices))
    while True:
        smallest = label[faces].min(axis=1)
        new = label.copy()
        np.minimum.at(new, faces.ravel(), np.repeat(smallest, 3))
        new = new[new]
        if np.array_equal(new, label):
            break
        label = new
    found = []
    of_face = label[faces[:, 0]]
    for k in np.unique(of_face):
        used, renumbered = np.unique(faces[of_face == k], return_inverse=True)
        found.append((vertices[used], renumbered.reshape(-1, 3)))
    return found


def hull(vertices) -> tuple[np.ndarray, np.ndarray]:
    """Convex hull of points (n, 3): vertices, triangles turned outward."""
    qhull = library("scipy.spatial", "for convex hulls").ConvexHull(np.asarray(vertices, float))
    used, faces = np.unique(qhull.simplices, return_inverse=True)
    points, faces = qhull.points[used], faces.reshape(-1, 3)
    a, b, c = (points[faces[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), qhull.equations[:, :3]) < 0
    faces[inward] = faces[inward, ::-1]
    return points, faces


def check_polygon(vertices, name: str = "polygon") -> np.ndarray:
    """The corners (n, 2) of a simple polygon, anticlockwise; raises MeshError if it crosses itself or is clockwise."""
    p = checks.real_array(f"{name}: vertices", vertices, (None, 2))
    edge = np.roll(p, -1, axis=0) - p
    same = np.flatnonzero(~edge.any(axis=1))
    if len(same):
        raise MeshError("flat", f"{name}: corners {same[0]} and {(same[0] + 1) % len(p)} are the same point; drop one", same)
    try:
        mass_properties.polygons([p])
    except ValueError as error:
        fault = "inside out" if "inside out" in str(error) else "flat"
        raise MeshError(fault, f"{name}: {error}") from None
    i, j = np.triu_indices(len(p), 2)
    i, j = (x[~((i == 0) & (j == len(p) - 1))] for x in (i, j))
    p2 = np.roll(p, -1, axis=0)

    def side(a, b, c):
        return np.sign((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])

    cut = (side(p[i], p2[i], p[j]) * side(p[i], p2[i], p2[j]) < 0) & (side(p[j], p2[j], p[i]) * side(p[j], p2[j], p2[i]) < 0)
    if np.any(cut):
        at = int(np.argmax(cut))
        raise MeshError("crossing", f"{name} crosses itself: edges {i[at]} and {j[at]} cut each other; reorder its corners")
    return p
