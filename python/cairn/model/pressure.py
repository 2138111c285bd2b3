"""Follower pressure on parts of the surface of a deformable body, along the normal and over the area of the deformed surface."""

from __future__ import annotations

import numpy as np

from .elastic import ELEMENTS, SIDES
from .mesh_parts import GivenBody

# Faces of second order, by number of nodes: positions of the nodes in the parent element (_PARENTS), and powers of both parent
# coordinates in the polynomials that their shape functions span (_POWERS).
_QUAD = [(-1, -1), (1, -1), (1, 1), (-1, 1), (0, -1), (1, 0), (0, 1), (-1, 0), (0, 0)]
_POWERS = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (2, 1), (1, 2), (2, 2)]
_PARENTS = {6: [(0, 0), (1, 0), (0, 1), (0.5, 0), (0.5, 0.5), (0, 0.5)], 8: _QUAD[:8], 9: _QUAD}
GAUSS = np.array([-np.sqrt(0.6), 0.0, np.sqrt(0.6)]), np.array([5.0, 8.0, 5.0]) / 9


def pressed_sides(body, nodes, what, load="pressure"):
    """Boundary sides with all nodes among `nodes`: in 2D edges (m, 2), or (m, 3) of second order with the middle last; in 3D
    faces (m, 4), with -1 for the fourth node of a triangle, or (m, 6 | 8 | 9) of second order. A body of another code has the
    flat edges and faces that it was given. what, load: names of the group and the load in messages. Raises ValueError if there
    is no such side."""
    try:
        sides = boundary_sides(body)
    except UnknownCellsError as wrong:
        raise ValueError(f"{load} on {what!r}: {wrong}") from None
    kept = [part[(np.isin(part, nodes) | (part < 0)).all(axis=1)] for part in sides]
    if not sum(len(part) for part in kept):
        side = "edge" if body.dim == 2 else "face"
        raise ValueError(f"{load} on {what!r}: no {side} of the boundary has all its nodes in it")
    return [part for part in kept if len(part)]


class UnknownCellsError(ValueError):
    """Error for bodies whose cells are no finite elements of Cairn, or have no sides."""


def boundary_sides(body):
    """All boundary sides, in the form of pressed_sides. Raises UnknownCellsError for a body whose cells are not known."""
    if hasattr(body, "section_forces"):
        raise UnknownCellsError(f"a {type(body).__name__} of bars or beams has no sides; give force={{group: total}} [N]")
    if isinstance(body, GivenBody):
        return [body.boundary_edges() if body.dim == 2 else body.boundary_faces()]
    if not hasattr(body, "cells") or not isinstance(body.cells, dict) or any(kind not in ELEMENTS for kind in body.cells):
        raise UnknownCellsError(f"the cells of a {type(body).__name__} are not known; give an ElasticBody or a SolidBody")
    second = [kind for kind in body.cells if ELEMENTS[kind]["order"] > 1]
    if not second:
        return [body.boundary_edges() if body.dim == 2 else body.boundary_faces()]
    if body.dim == 3:
        return _whole_faces(body, second)
    sides = [_edges_of_second_order(body.cells[kind], len(SIDES[kind]) // 2) for kind in second]
    first = {kind: cells for kind, cells in body.cells.items() if kind not in second}
    sides += [cells[:, SIDES[kind]].reshape(-1, 2) for kind, cells in first.items()]
    ends = np.concatenate([np.sort(part[:, :2], axis=1) for part in sides])
    _, place, count = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    alone = np.split(count[place.ravel()] == 1, np.cumsum([len(part) for part in sides])[:-1])
    return [part[keep] for part, keep in zip(sides, alone)]


def _whole_faces(body, second):
    """Boundary faces in 3D, whole for cells of second order; an array for each number of nodes."""
    found = {}
    for kind, cells in body.cells.items():
        if kind in second:
            for whole, _ in ELEMENTS[kind]["whole_sides"]:
                found.setdefault(len(whole), []).append(cells[:, whole])
        else:
            faces = np.where(SIDES[kind] < 0, -1, cells[:, SIDES[kind]])
            found.setdefault(4, []).append(faces.reshape(-1, 4))
    out = []
    for parts in found.values():
        faces = np.concatenate(parts)
        _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
        out.append(faces[np.sort(first[count == 1])])
    return out


def _edges_of_second_order(cells, corners):
    k = np.arange(corners)
    return cells[:, np.stack([k, (k + 1) % corners, corners + k], axis=1)].reshape(-1, 3)


def forces(body, sides, x):
    """Nodal forces (n, dim) [N] of a pressure of 1 Pa on sides, for positions of the nodes x (n, dim) [m]; an axisymmetric body
    has its axis at x = 0."""
    out = np.zeros(x.shape)
    for part in sides:
        for nodes, value, inward in samples(body, part, x):
            for a, column in enumerate(nodes.T):
                np.add.at(out, column, value[a] * inward)
    return out


def areas(body, sides, x):
    """Integrals of the shape functions over sides, (n,) [m2], for positions of the nodes x (n, dim) [m]."""
    out = np.zeros(len(x))
    for part in sides:
        for nodes, value, inward in samples(body, part, x):
            size = np.linalg.norm(inward, axis=1)
            for a, column in enumerate(nodes.T):
                np.add.at(out, column, value[a] * size)
    return out


def samples(body, sides, x):
    """Yields for each integration point of sides of the same form: nodes (m, k), shape functions (k,) at the point, and inward
    normals (m, dim) whose length is the weight of the point [m2]."""
    if body.dim == 2:
        yield from _on_edges(body, sides, x)
    elif sides.shape[1] > 4:
        yield from _on_bent_faces(sides, x)
    else:
        yield from _on_faces(sides, x)


def _on_edges(body, edges, x):
    of, ring = x[edges], getattr(body, "plane", "") == "axisymmetric"
    for s, weight in zip(*GAUSS):
        if edges.shape[1] == 2:
            value, slope = np.array([(1 - s) / 2, (1 + s) / 2]), np.array([-0.5, 0.5])
        else:
            value, slope = np.array([s * (s - 1) / 2, s * (s + 1) / 2, 1 - s * s]), np.array([s - 0.5, s + 0.5, -2 * s])
        along = np.einsum("a,nak->nk", slope, of)
        inward = np.stack([-along[:, 1], along[:, 0]], axis=1) * weight  # the body is on the left
        wide = np.full(len(of), getattr(body, "thickness", 1.0))
        if ring:
            wide = 2 * np.pi * np.einsum("a,na->n", value, of[:, :, 0])
        yield edges, value, wide[:, None] * inward


def _on_faces(faces, x):
    wide = faces[:, 3] >= 0 if faces.shape[1] == 4 else np.zeros(len(faces), bool)
    nodes = faces[~wide][:, :3]
    of = x[nodes]
    if len(nodes):
        yield nodes, np.full(3, 1 / 3), -np.cross(of[:, 1] - of[:, 0], of[:, 2] - of[:, 0]) / 2
    if not wide.any():
        return
    nodes, corner = faces[wide], np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    of = x[nodes]
    for r in (-(3**-0.5), 3**-0.5):
        for s in (-(3**-0.5), 3**-0.5):
            value = (1 + r * corner[:, 0]) * (1 + s * corner[:, 1]) / 4
            by_r, by_s = corner[:, 0] * (1 + s * corner[:, 1]) / 4, corner[:, 1] * (1 + r * corner[:, 0]) / 4
            yield nodes, value, -np.cross(np.einsum("a,nak->nk", by_r, of), np.einsum("a,nak->nk", by_s, of))


def _rule(nodes):
    """Points and weights on the parent of a face of second order: for triangles exact to degree four (Dunavant 1985)."""
    if nodes != 6:
        return [((r, s), a * b) for r, a in zip(*GAUSS) for s, b in zip(*GAUSS)]
    out = []
    for a, weight in ((0.4459484909159649, 0.2233815896780115), (0.0915762135097707, 0.1099517436553219)):
        out += [(at, weight / 2) for at in ((a, a), (1 - 2 * a, a), (a, 1 - 2 * a))]
    return out


def _on_bent_faces(faces, x):
    """Integration points of faces of second order; shape functions by inversion of the matrix of monomials at the nodes."""
    nodes = faces.shape[1]
    p, q = np.array(_POWERS[:nodes]).T
    r, s = np.array(_PARENTS[nodes], float).T[:, :, None]
    of, shape = x[faces], np.linalg.inv(r**p * s**q)
    for (r, s), weight in _rule(nodes):
        value = (r**p * s**q) @ shape
        by_r, by_s = (p * r ** np.maximum(p - 1, 0) * s**q) @ shape, (q * r**p * s ** np.maximum(q - 1, 0)) @ shape
        yield faces, value, -weight * np.cross(np.einsum("a,nak->nk", by_r, of), np.einsum("a,nak->nk", by_s, of))
