"""Pressure on parts of the surface of a body that deforms, which follows their normals as they turn and stretch."""

from __future__ import annotations

import numpy as np

from .elastic import ELEMENTS, SIDES
from .meshes import GivenBody

GAUSS = np.array([-np.sqrt(0.6), 0.0, np.sqrt(0.6)]), np.array([5.0, 8.0, 5.0]) / 9


def pressed_sides(body, nodes, what):
    """Sides of the boundary with all of their nodes among some: edges (m, 2), of second order (m, 3) with the middle last, in 2D,
    faces (m, 3 | 4) in 3D, -1 for the fourth of a triangle. Those of a body whose cells another code knows are the edges and
    faces that it was given, which are flat. Raises ValueError where there is none."""
    if isinstance(body, GivenBody):
        return _pressed(body, [body.boundary_edges() if body.dim == 2 else body.boundary_faces()], nodes, what)
    if not hasattr(body, "cells") or not isinstance(body.cells, dict) or any(kind not in ELEMENTS for kind in body.cells):
        kind = type(body).__name__
        raise ValueError(f"pressure on {what!r}: the cells of a {kind} are not known; give an ElasticBody or a SolidBody")
    second = [kind for kind in body.cells if ELEMENTS[kind]["order"] > 1]
    if body.dim == 3 and second:
        raise ValueError(f"pressure on {what!r} presses faces of first order: these are of {second[0]} cells; give force")
    if body.dim == 3:
        sides = [body.boundary_faces()]
    else:
        sides = [_edges_of_second_order(body.cells[kind], len(SIDES[kind]) // 2) for kind in second]
        first = {kind: cells for kind, cells in body.cells.items() if kind not in second}
        sides += [cells[:, SIDES[kind]].reshape(-1, 2) for kind, cells in first.items()]
    if body.dim == 2:
        ends = np.concatenate([np.sort(part[:, :2], axis=1) for part in sides])
        _, place, count = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
        alone = np.split(count[place.ravel()] == 1, np.cumsum([len(part) for part in sides])[:-1])
        sides = [part[keep] for part, keep in zip(sides, alone)]
    return _pressed(body, sides, nodes, what)


def _pressed(body, sides, nodes, what):
    kept = [part[(np.isin(part, nodes) | (part < 0)).all(axis=1)] for part in sides]
    if not sum(len(part) for part in kept):
        side = "edge" if body.dim == 2 else "face"
        raise ValueError(f"pressure on {what!r}: no {side} of the boundary has all its nodes in it")
    return [part for part in kept if len(part)]


def _edges_of_second_order(cells, corners):
    k = np.arange(corners)
    return cells[:, np.stack([k, (k + 1) % corners, corners + k], axis=1)].reshape(-1, 3)


def forces(body, sides, x):
    """Forces of nodes (n, dim) [N] of a pressure of 1 Pa on sides, at places x (n, dim) [m], from the axis where the body goes
    round one."""
    out = np.zeros(x.shape)
    for part in sides:
        push = _on_edges if body.dim == 2 else _on_faces
        push(body, part, x, out)
    return out


def _on_edges(body, edges, x, out):
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
        for a, column in enumerate(edges.T):
            np.add.at(out, column, value[a] * wide[:, None] * inward)


def _on_faces(body, faces, x, out):
    wide = faces[:, 3] >= 0 if faces.shape[1] == 4 else np.zeros(len(faces), bool)
    of = x[faces[~wide][:, :3]]
    for column in faces[~wide][:, :3].T:
        np.add.at(out, column, -np.cross(of[:, 1] - of[:, 0], of[:, 2] - of[:, 0]) / 6)
    of, corner = x[faces[wide]], np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    for r in (-(3**-0.5), 3**-0.5):
        for s in (-(3**-0.5), 3**-0.5):
            value = (1 + r * corner[:, 0]) * (1 + s * corner[:, 1]) / 4
            by_r, by_s = corner[:, 0] * (1 + s * corner[:, 1]) / 4, corner[:, 1] * (1 + r * corner[:, 0]) / 4
            inward = -np.cross(np.einsum("a,nak->nk", by_r, of), np.einsum("a,nak->nk", by_s, of))
            for a, column in enumerate(faces[wide].T):
                np.add.at(out, column, value[a] * inward)
