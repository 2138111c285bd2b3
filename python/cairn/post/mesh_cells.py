"""Cells of bodies that deform where their nodes are at a step, for pictures."""

import numpy as np

from .. import _core
from .errors import told_as_damage

# corners and middles of the edges of a flat cell, once round
AROUND = {e["cell"]: np.array(e["sides"])[:, 0] for e in _core.elements() if e["dim"] == 2}
VTK_CELLS = {
    "triangle": 5, "quad": 9, "tetra": 10, "hexahedron": 12, "triangle6": 22, "quad8": 23, "tetra10": 24, "hexahedron20": 25,
    "quad9": 28, "hexahedron27": 29,
}  # fmt: skip
KINDS = {number: kind for kind, number in VTK_CELLS.items()}


def meshes_of(step):
    """Of each mesh of which all nodes are there: what the scene says of it, and whether its faces may open: then nodes and
    corners of cells are those of the step."""
    ids = np.asarray(step.drawn["id"]) if "id" in step.drawn else np.arange(len(step.drawn))
    now, out = _parted(step), []
    for _, mesh in sorted((step.run.scene.get("meshes") or {}).items()):
        opened = now.get(int(mesh["nodes"][0]), {})
        mesh = mesh | opened
        if np.isin(mesh["nodes"], ids).all():
            out.append((mesh, bool(opened)))
    return out


def meshes_at(step):
    """Of each of these meshes: what is known of it, rows of its nodes among the bodies."""
    return [(mesh, step.rows_of(mesh["nodes"])) for mesh, _ in meshes_of(step)]


def _parted(step):
    """Nodes and cells of each mesh at a step, by the id of its first node; {} of runs in which no faces may open."""
    if "mesh" not in step.nodes.names or not step.cells:
        return {}
    number, ids, mesh = np.asarray(step.nodes["mesh"]), np.asarray(step.nodes["id"]), step.cells["mesh"]
    types, begin, corners = step.corners_of_cells()
    out, first = {}, 0
    with told_as_damage(step.run.path):
        for k in np.unique(number[number >= 0]):
            nodes, cells = np.sort(ids[number == k]), {}
            for kind in np.unique(types[mesh == k]):
                rows = np.flatnonzero((mesh == k) & (types == kind))
                of = corners[begin[rows][:, None] + np.arange(begin[rows[0] + 1] - begin[rows[0]])] - first
                if of.min() < 0 or of.max() >= len(nodes):
                    raise ValueError(f"cells of output {step.index} have corners that are no nodes of their mesh")
                cells[KINDS[kind]] = of
            out[int(nodes[0])] = {"nodes": nodes, "cells": cells}
            first += len(nodes)
    return out


def shown_by_cells(step):
    """Rows of the nodes of meshes, which pictures leave out: their cells are drawn. In older runs points, edges and faces were
    bodies, too, which are `shown` there."""
    parts = [np.asarray(mesh.get(of, ()), np.int64) for mesh, _ in meshes_at(step) for of in ("nodes", "shown")]
    ids = np.asarray(step.drawn["id"]) if "id" in step.drawn else np.arange(len(step.drawn))
    return np.flatnonzero(np.isin(ids, np.concatenate(parts))) if parts else np.zeros(0, int)


def outlines(step):
    """Outlines of the flat cells of a step, a list of (k, 2) [m], and rows (m, k) of the bodies at their corners, an array for
    each kind of cells in that order."""
    corners, rows = [], []
    for mesh, row in meshes_at(step):
        for kind, cells in mesh["cells"].items():
            of = row[np.asarray(cells)[:, AROUND[kind]]]
            rows.append(of)
            corners += list(step.drawn["position"][of])
    return corners, rows


def surfaces(step):
    """Surfaces of the solid meshes of a step: triangles (m, 3), rows of the bodies at their corners."""
    parts = [np.zeros((0, 3), np.int64)]
    for mesh, row in meshes_at(step):
        sides = np.asarray(mesh["sides"])
        parts.append(row[sides[:, :3]])
        if sides.shape[1] == 4:
            parts.append(row[sides[sides[:, 3] >= 0][:, [0, 2, 3]]])
    return np.concatenate(parts)


def with_surfaces(step, mesh, of_bodies, hidden):
    """Points, triangles and rows of a picture (or None) and values of the rows, with the surfaces of meshes in the place of what
    shows them: each triangle has a row of its own, the mean of its corners."""
    corners = surfaces(step)
    if not len(corners):
        return mesh, of_bodies
    points, triangles, rows = mesh or (np.zeros((0, 3)), np.zeros((0, 3), np.int64), np.zeros(0, np.int64))
    kept = ~np.isin(rows, hidden)
    values = np.concatenate([of_bodies, np.asarray(of_bodies, float)[corners].mean(axis=1)])
    triangles = np.concatenate([triangles[kept], corners + len(points)])
    rows = np.concatenate([rows[kept], len(of_bodies) + np.arange(len(corners))])
    return (np.concatenate([points, step.drawn["position"]]), triangles, rows), values
