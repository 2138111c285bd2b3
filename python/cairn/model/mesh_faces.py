"""Faces of deformable bodies in 3D as antagonists: a triangular facet contactor for every triangle, which moves with its nodes.

A face of four nodes has two facets, which give normal and gap. The velocity of a point on it is interpolated by the bilinear
shape functions of the face, so that the work of a contact equals the work of its nodal forces.
"""

from __future__ import annotations

import numpy as np

from . import bodies
from .mesh_parts import part_set, rows_by_material
from .shapes import Hulls
from .surfaces import with_neighbours


def whole_sides(body, pieces):
    """Nodes (m, 9) of the whole side of a cell to which each flat piece (m, 2 | 4) of the boundary belongs: corners, mid-side
    nodes, middle node, padded by -1. Empty if no cell is of second order."""
    from .elastic import ELEMENTS

    cells = getattr(body, "cells", None)
    second = [kind for kind in cells if ELEMENTS[kind]["order"] > 1] if isinstance(cells, dict) else []
    if not second or not len(pieces):
        return np.zeros((0, 9), int)
    out = np.pad(pieces, ((0, 0), (0, 9 - pieces.shape[1])), constant_values=-1)
    places = {}
    for k, piece in enumerate(np.sort(pieces, axis=1).tolist()):
        places.setdefault(tuple(piece), []).append(k)
    for kind in second:
        for whole, parts in ELEMENTS[kind]["whole_sides"]:
            of_cells = np.pad(cells[kind][:, whole], ((0, 0), (0, 9 - len(whole))), constant_values=-1)
            for part in parts:
                part = np.array(part[: pieces.shape[1]])
                nodes = np.where(part < 0, -1, cells[kind][:, part])
                for cell, key in enumerate(map(tuple, np.sort(nodes, axis=1).tolist())):
                    if key in places:
                        out[places[key]] = of_cells[cell]
    return out


def outwards(body, sides):
    """Sides (m, 2 | 3 | 4) given as arrays, reversed if they are sides of the boundary with the opposite orientation.

    Sides that belong to no known cell, such as those of a body given by matrices, keep the user's order.
    """
    if not len(sides) or not isinstance(getattr(body, "cells", None), dict):
        return sides
    own = body.boundary_edges() if body.dim == 2 else body.boundary_faces()
    known = {tuple(sorted(side)): side for side in map(_nodes_of, own.tolist())}
    out = np.array(sides)
    for k, side in enumerate(map(_nodes_of, out.tolist())):
        as_cells_know = known.get(tuple(sorted(side)))
        if as_cells_know is not None and not _same_way(side, as_cells_know):
            out[k, : len(side)] = side[::-1]
    return out


def _nodes_of(side):
    return [node for node in side if node >= 0]


def _same_way(side, other):
    """True if two sides of the same nodes have the same orientation."""
    if len(side) == 2:
        return side == other
    return other[(other.index(side[0]) + 1) % len(other)] == side[1]


class Faces:
    """Facets of faces. nodes (m, 3): of each facet; faces (m, 4): nodes of its face, -1 for the fourth node of a triangle."""

    def __init__(self, faces):
        faces = np.asarray(faces, int)
        if faces.shape[1] == 3:
            faces = np.pad(faces, ((0, 0), (0, 1)), constant_values=-1)
        wide = faces[:, 3] >= 0
        self.nodes = np.concatenate([faces[:, [0, 1, 2]], faces[wide][:, [0, 2, 3]]])
        self.faces = np.concatenate([faces, faces[wide]])
        self.around = [np.zeros(0, int)] * len(self.nodes)  # nodes of each facet and of its neighbours, its own first

    def __len__(self):
        return len(self.nodes)

    def part_set(self, places, material, d):
        """Set with a contactor for each facet. material: of all, or a list over the faces; both facets of a face share it."""
        corners = places[self.nodes]
        centre = corners.mean(axis=1)
        used, renumbered = np.unique(self.nodes, return_inverse=True)
        hulls, around = with_neighbours(places[used], renumbered.reshape(self.nodes.shape), centre)
        self.around = [used[part] for part in around]
        if isinstance(material, (list, tuple)):
            halved = np.flatnonzero(self.faces[: len(material), 3] >= 0)
            if len(material) + len(halved) != len(self):
                raise ValueError(f"face_material lists {len(material)} materials: give one for all, or one for each face")
            material = [*material, *(material[k] for k in halved)]
        contactors = [
            bodies.ContactorSet("facet", of, rows, np.zeros(len(rows)), None, None, rows, hulls)
            for of, rows in rows_by_material("face_material", material, len(self))
        ]
        return part_set(3, contactors, "faces", d)


# Facets of a single face with three or four corners: _HALVES their corners, _AROUND all corners of the face with those of the
# facet first, _FANS the triangles of the face in that order.
_HALVES = {3: [[0, 1, 2]], 4: [[0, 1, 2], [0, 2, 3]]}
_AROUND = {3: [[0, 1, 2]], 4: [[0, 1, 2, 3], [0, 2, 3, 1]]}
_FANS = {3: [[[0, 1, 2]]], 4: [[[0, 1, 2], [0, 2, 3]], [[0, 3, 1], [0, 1, 2]]]}


class LoneFaces(Faces):
    """Facets of faces (m, 3 | 4) without neighbours; the facets of a face follow each other."""

    def __init__(self, faces):
        self.corners = faces.shape[1]
        halves = len(_HALVES[self.corners])
        self.nodes = faces[:, _HALVES[self.corners]].reshape(-1, 3)
        self.faces = np.repeat(np.pad(faces, ((0, 0), (0, 4 - self.corners)), constant_values=-1), halves, axis=0)
        self.around = faces[:, _AROUND[self.corners]].reshape(-1, self.corners)

    def hulls(self, places):
        """Hulls of the facets for positions of the nodes (n, 3) [m]."""
        x, m = places[self.around] - places[self.nodes].mean(axis=1)[:, None], len(self.nodes)
        fans = np.array(_FANS[self.corners])
        fans = np.tile(fans, (m // len(fans), 1, 1, 1))
        each = fans.shape[1]
        return Hulls(x.reshape(-1, 3), self.corners * np.arange(m + 1), each * np.arange(m + 1), 3 * np.arange(m * each + 1),
                     fans.ravel(), True)  # fmt: skip
