"""Cells of bodies that deform where their nodes are at a step, for pictures."""

import numpy as np

from .. import _core
from ..base.errors import told_as_damage

# corners and middles of the edges of a flat cell, once round
AROUND = {e["cell"]: np.array(e["sides"])[:, 0] for e in _core.elements() if e["dim"] == 2}
VTK_CELLS = {
    "triangle": 5, "quad": 9, "tetra": 10, "hexahedron": 12, "triangle6": 22, "quad8": 23, "tetra10": 24, "hexahedron20": 25,
    "quad9": 28, "hexahedron27": 29,
}  # fmt: skip
VTK_CELLS["line"] = 3  # bars and beams
KINDS = {number: kind for kind, number in VTK_CELLS.items()}


def cells_of(body):
    """Cells of a deformable body by kind, {kind: (m, k)}, as in files and pictures; {} if it has none."""
    if hasattr(body, "section_forces"):
        return {"line": body.lines}
    return body.cells if hasattr(body, "nodal_stress") and set(body.cells) <= set(VTK_CELLS) else {}


def meshes_of(step):
    """Description of each mesh whose nodes are all present, and whether its faces may open; if so, its nodes and the corners of
    its cells are those of the step."""
    ids = np.asarray(step.drawn["id"]) if "id" in step.drawn else np.arange(len(step.drawn))
    now, out = _parted(step), []
    for _, mesh in sorted((step.run.scene.get("meshes") or {}).items()):
        opened = now.get(int(mesh["nodes"][0]), {})
        mesh = mesh | opened
        if np.isin(mesh["nodes"], ids).all():
            out.append((mesh, bool(opened)))
    return out


def meshes_at(step):
    """Description of each of these meshes with the rows of its nodes among the bodies."""
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
            if kind == "line":
                continue
            of = row[np.asarray(cells)[:, AROUND[kind]]]
            rows.append(of)
            corners += list(step.drawn["position"][of])
    return corners, rows


def lines(step):
    """Bars and beams of a step: rows (m, 2) of the bodies at their ends."""
    if not any("line" in mesh["cells"] for mesh in (step.run.scene.get("meshes") or {}).values()):
        return np.zeros((0, 2), np.int64)  # where each of many meshes is at the step need not be found
    parts = [row[np.asarray(mesh["cells"]["line"])] for mesh, row in meshes_at(step) if "line" in mesh["cells"]]
    return np.concatenate(parts) if parts else np.zeros((0, 2), np.int64)


def values_of_lines(step, what):
    """One number for each of these, of a field of cells that bodies and nodes lack, or None: of several the largest size."""
    if not isinstance(what, str) or what in step.drawn or not len(lines(step)):
        return None
    cells = step.cells
    if what not in cells:
        return None
    values = np.asarray(cells[what])[step.corners_of_cells()[0] == VTK_CELLS["line"]]
    return values if values.ndim == 1 else np.abs(values).max(axis=1)


def surfaces(step):
    """Surfaces of the solid meshes of a step: triangles (m, 3), rows of the bodies at their corners."""
    parts = [np.zeros((0, 3), np.int64)]
    for mesh, row in meshes_at(step):
        sides = np.asarray(mesh["sides"])
        parts.append(row[sides[:, :3]])
        if sides.shape[1] == 4:
            parts.append(row[sides[sides[:, 3] >= 0][:, [0, 2, 3]]])
    return np.concatenate(parts)


def rods(step):
    """Bars and beams as prisms, as thick as a hundredth of all of them at most, and as a tenth of their mean length: points
    (12 m, 3), triangles (12 m, 3); () where there are none."""
    ends = step.drawn["position"][lines(step)]
    if not len(ends):
        return ()
    along = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(along, axis=1, keepdims=True)
    size = np.ptp(ends.reshape(-1, 3), axis=0).max()
    thick = min(0.006 * size, 0.1 * length.mean())
    along /= np.where(length > 0, length, 1.0)
    across = np.cross(along, np.eye(3)[np.abs(along).argmin(axis=1)])
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-300)
    other, angle = np.cross(along, across), 2 * np.pi * np.arange(6) / 6
    round_it = thick * (np.cos(angle)[:, None] * across[:, None] + np.sin(angle)[:, None] * other[:, None])
    points = (ends[:, :, None] + round_it[:, None]).reshape(-1, 3)
    k, after = np.arange(6), (np.arange(6) + 1) % 6
    one = np.concatenate([np.stack([k, after, after + 6], axis=1), np.stack([k, after + 6, k + 6], axis=1)])
    return points, (one + 12 * np.arange(len(ends))[:, None, None]).reshape(-1, 3)


def with_rods(step, what, mesh, of_bodies):
    """Points, triangles and rows of a picture (or None) and values of the rows, with the bars and beams, each with a row of its
    own. what: the field that is drawn; one that only bars and beams have leaves all else without a value."""
    made = rods(step)
    if not made:
        return mesh, of_bodies
    values = values_of_lines(step, what)
    if values is None:
        values = np.asarray(of_bodies, float)[lines(step)].mean(axis=1)
    points, triangles, rows = mesh or (np.zeros((0, 3)), np.zeros((0, 3), np.int64), np.zeros(0, np.int64))
    rows = np.concatenate([rows, np.repeat(len(of_bodies) + np.arange(len(values)), 12)])
    of_bodies = np.concatenate([of_bodies, values])
    return (np.concatenate([points, made[0]]), np.concatenate([triangles, made[1] + len(points)]), rows), of_bodies


def with_surfaces(step, mesh, of_bodies, hidden):
    """Points, triangles and rows of a picture (or None) and values of the rows, with the surfaces of meshes in place of their
    contactors: each triangle has a row of its own, the mean of its corners."""
    corners = surfaces(step)
    if not len(corners):
        return mesh, of_bodies
    points, triangles, rows = mesh or (np.zeros((0, 3)), np.zeros((0, 3), np.int64), np.zeros(0, np.int64))
    kept = ~np.isin(rows, hidden)
    values = np.concatenate([of_bodies, np.asarray(of_bodies, float)[corners].mean(axis=1)])
    triangles = np.concatenate([triangles[kept], corners + len(points)])
    rows = np.concatenate([rows[kept], len(of_bodies) + np.arange(len(corners))])
    return (np.concatenate([points, step.drawn["position"]]), triangles, rows), values
