"""Faces inside one mesh that open where their traction is above a threshold: its nodes are shared until then, and stand once for
each part of the cells round them that open faces separate (Pandolfi & Ortiz 2002).
"""

from __future__ import annotations

from copy import copy

import numpy as np

from ..names import listed
from ..pre import checks
from .elastic import ELEMENTS, SIDES, ElasticBody
from .face_forces import FaceForces, cell_matrices

# Where the points of an edge stand, by the weights of its nodes, each for half of it.
_G = 0.5 / np.sqrt(3.0)
EDGE = np.array([[0.5 + _G, 0.5 - _G], [0.5 - _G, 0.5 + _G]])

THICKNESS = 0.05  # of the sides of open faces, over the length of the shortest: as thick as edges of meshes are


def strengths_of(law):
    """Stresses (normal, tangential) [Pa] at which a law of a cohesive zone begins to soften in mode I and in mode II."""
    names = law.parameter_names
    if "normal_strength" in names:
        return law.normal_strength, law.tangential_strength
    if "strength" in names and "normal_stiffness" in names:
        return law.strength, law.strength
    if type(law).__name__ == "MAC":
        return np.sqrt(law.work * law.normal_stiffness), np.sqrt(law.work * law.tangential_stiffness)
    if type(law).__name__ == "MP":
        n, t = law.normal_stiffness, law.tangential_stiffness
        first = np.sqrt(law.work * (1 / n + 1 / t) / (9 - 4 * np.log(4)))
        return n * first, t * first
    raise ValueError(f"law is {law!r}, which has no strength of faces that open by threshold: give MAC, MP, MP3, MAL, TH, ABP or "
                     "EXPO, or leave out opens")  # fmt: skip


class OpeningFaces:
    """What of a mesh may open, and what did.

    body: ElasticBody as it came in; strength: (normal, tangential) [Pa]; threshold: share of it at which a face opens.
    cells (m, 2): of each face, numbers through all kinds; corners (m, 2, 2): of each, by both cells, numbers through all cells'
    corners, in the order of the first; normal (m, 2) out of the first; is_open (m,); node (corners,) that each corner is now;
    former (nodes,) the node that each stands at; shown (k, 2): open faces with a node apart, in the order in which they came.
    """

    def __init__(self, body, strength, threshold):
        self.start, self.strength, self.threshold = body, strength, threshold
        self.body = body
        self.node = np.concatenate([cells.ravel() for cells in body.cells.values()])
        self.former = np.arange(len(body.points))
        self.cells, self.corners = _inner_faces(body)
        a, b = (body.points[self.node[self.corners[:, 0, k]]] for k in (0, 1))
        along = b - a
        self.length = np.linalg.norm(along, axis=1)
        self.normal = np.stack([along[:, 1], -along[:, 0]], 1) / self.length[:, None]
        self.is_open = np.zeros(len(self.cells), bool)
        self.shown = np.zeros(0, int)
        self._links = _bare_links(self.node, self.corners)
        self._matrices = self._forces = None

    @property
    def apart(self):
        """Open faces that have a node on each side, (m,)."""
        return self.is_open & np.any(self.node[self.corners[:, 0]] != self.node[self.corners[:, 1]], axis=1)

    @property
    def forces(self):
        """Tractions by the forces of nodes."""
        if self._forces is None:
            if self._matrices is None:
                self._matrices = cell_matrices(self.start)
            self._forces = FaceForces(self, self._matrices)
        return self._forces

    def mean_traction(self, displacement):
        """On each face, on its first cell, (m, 2), of the mean of the stresses in the middles of both its cells (Camacho & Ortiz
        1996), times the thickness."""
        stress = np.concatenate(list(self.body.stress(displacement).values())) * self.body.thickness
        xx, yy, xy = (0.5 * stress[self.cells].sum(axis=1)).T
        n, m = self.normal.T
        return np.stack([xx * n + xy * m, xy * n + yy * m], 1)

    def above(self, traction):
        """Faces that are still closed and whose traction, linear between its ends (m, 2, 2), is above the threshold at a point
        where a zone would act, (k,): (t_N+ / s_N)^2 + (t_T / s_T)^2 >= threshold^2."""
        at = np.einsum("pe,fec->fpc", EDGE, traction)
        n, m = self.normal.T[:, :, None]
        normal, tangential = at[..., 0] * n + at[..., 1] * m, at[..., 1] * n - at[..., 0] * m
        with np.errstate(over="ignore"):
            size = np.hypot(np.maximum(normal, 0) / self.strength[0], tangential / self.strength[1]).max(axis=1)
        if not np.all(np.isfinite(size)):
            at = int(np.argmin(np.isfinite(size)))
            told = f"the traction on the face between cells {self.cells[at].tolist()} is no finite number"
            raise ValueError(f"{told}: take shorter steps, or look at the loads")
        return np.flatnonzero(~self.is_open & (size >= self.threshold))

    def opened(self, faces):
        """The same with these faces open, too."""
        out = copy(self)
        out.is_open = self.is_open.copy()
        out.is_open[faces] = True
        joined = np.concatenate([_corner_pairs(self.corners[~out.is_open]), self._links])
        out.node, parents = _nodes_apart(self.node, joined, len(self.former))
        out.former = np.concatenate([self.former, self.former[parents]])
        return out.settled()

    def settled(self):
        """Itself, with the body and the faces that follow from open faces and nodes."""
        self._forces = None
        if len(self.former) > len(self.start.points):
            self.body = self._split_body()
        self.shown = np.concatenate([self.shown, np.setdiff1d(np.flatnonzero(self.apart), self.shown)])
        return self

    def parts(self):
        """Number of the part of each node, (nodes,): cells with a node in common are one."""
        cells = [self.node[corners] for corners in _by_cell(self.start)]
        return parts_of(np.concatenate([np.stack([c[:, :-1], c[:, 1:]], -1).reshape(-1, 2) for c in cells]), len(self.former))

    def _split_body(self):
        cells = {kind: self.node[corners] for kind, corners in zip(self.start.cells, _by_cell(self.start))}
        groups = {name: np.flatnonzero(np.isin(self.former, nodes)) for name, nodes in self.start.groups.items()}
        given = {**self.start.given, "points": self.start.points[self.former], "cells": cells, "groups": groups}
        return ElasticBody(**given)

    def points(self):
        """Nodes (2 k, 2) and weights (2 k, 2) of the points of the faces that are apart, on their first cells."""
        nodes = self.node[self.corners[self.shown, 0]]
        return np.repeat(nodes, 2, axis=0), np.tile(EDGE, (len(nodes), 1))

    def edges(self):
        """Nodes (2 k, 2) of the edges on both sides of these faces, the body on their left."""
        first, second = (self.node[self.corners[self.shown, k]] for k in (0, 1))
        return np.stack([first, second[:, ::-1]], 1).reshape(-1, 2)

    def thickness(self):
        """Of these edges [m]."""
        return THICKNESS * self.length.min()

    # ------------------------------------------------------------------ files

    def to_dict(self):
        """What a checkpoint holds of what is open."""
        return {"open": self.is_open, "node": self.node, "former": self.former, "shown": self.shown}

    def from_dict(self, content):
        """The same mesh with what a checkpoint holds open. Raises ValueError for what is of another mesh."""
        out = copy(self)
        out.is_open, out.node = np.asarray(content["open"], bool), np.asarray(content["node"], int)
        out.former, out.shown = np.asarray(content["former"], int), np.asarray(content["shown"], int)
        out.body = self.start
        n = len(out.former)
        if out.is_open.shape != self.is_open.shape or out.node.shape != self.node.shape:
            raise ValueError(f"faces that open are {len(out.is_open)} of {len(out.node)} corners, of another mesh")
        fits = np.array_equal(np.unique(out.node), np.arange(n)) and np.array_equal(out.former[out.node], self.start_node)
        if not fits or not np.array_equal(np.sort(out.shown), np.flatnonzero(out.apart)):
            raise ValueError("nodes of faces that are open stand where no corner of their cells does")
        return out.settled()

    @property
    def start_node(self):
        """Node that each corner was at the start."""
        return np.concatenate([cells.ravel() for cells in self.start.cells.values()])


def checked(body, law, threshold):
    """OpeningFaces of a body, refused where faces cannot open."""
    if body.dim != 2:
        raise ValueError(f"body is of {body.dim} dimensions: faces open by threshold in 2D alone; leave out opens")
    second = [kind for kind in body.cells if ELEMENTS[kind]["order"] > 1]
    if second:
        told = f"cells are {listed(second, second[0])}: faces open by threshold between cells of first order, triangle and quad"
        raise ValueError(f"{told}; leave out opens")
    share = checks.number("threshold", threshold, finite=False)
    if not share >= 0:
        raise ValueError(f"threshold is {threshold}: give a share of the strength of the law, from 0 on")
    out = OpeningFaces(body, strengths_of(law), share)
    if not len(out.cells):
        raise ValueError("no two cells of the body share a side: there is nothing to open")
    return out


def _inner_faces(body):
    """Faces that two cells have in common: numbers of these (m, 2), and of their corners there (m, 2, 2)."""
    cell, corner, node, first_cell, first_corner = [], [], [], 0, 0
    for kind, nodes in body.cells.items():
        sides = SIDES[kind]
        here = np.arange(len(nodes))
        cell.append(np.repeat(first_cell + here, len(sides)))
        corner.append((first_corner + here[:, None, None] * nodes.shape[1] + sides).reshape(-1, 2))
        node.append(nodes[:, sides].reshape(-1, 2))
        first_cell, first_corner = first_cell + len(nodes), first_corner + nodes.size
    cell, corner, node = (np.concatenate(part) for part in (cell, corner, node))
    order = np.lexsort((cell, node.max(axis=1), node.min(axis=1)))
    ends = np.sort(node[order], axis=1)
    same = np.all(ends[1:] == ends[:-1], axis=1)
    if np.any(same[1:] & same[:-1]):
        at = ends[1:-1][same[1:] & same[:-1]][0].tolist()
        raise ValueError(f"more than two cells share the side of nodes {at}: which of them part is not known; leave out opens")
    first, second = order[:-1][same], order[1:][same]
    turned = node[first][:, :1] == node[second][:, 1:]
    across = np.where(turned, corner[second][:, ::-1], corner[second])
    return np.stack([cell[first], cell[second]], 1), np.stack([corner[first], across], 1)


def _by_cell(body):
    """Numbers of the corners of the cells of each kind, (cells, corners)."""
    ends = np.cumsum([cells.size for cells in body.cells.values()])
    return [np.arange(end - cells.size, end).reshape(cells.shape) for end, cells in zip(ends, body.cells.values())]


def _corner_pairs(faces):
    """Pairs of corners (m, 2) that faces join."""
    return faces.transpose(0, 2, 1).reshape(-1, 2)


def parts_of(pairs, n):
    """Number of the part of each of n corners that pairs join."""
    from scipy import sparse
    from scipy.sparse.csgraph import connected_components

    graph = sparse.coo_array((np.ones(len(pairs), np.int8), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    return connected_components(graph, directed=False)[1]


def _nodes_apart(node, pairs, count):
    """Node of each corner where these pairs alone join corners, and the nodes that new ones stood at: of the parts of a node the
    one of its first corner keeps its number."""
    n = len(node)
    part = parts_of(pairs, n)
    first = np.full(part.max() + 1, n)
    np.minimum.at(first, part, np.arange(n))  # corner by which a part is known
    keeps = np.full(count, n)
    np.minimum.at(keeps, node, np.arange(n))
    is_new = np.sort(first[keeps[node[first]] != first])
    number = np.empty(len(first), int)
    number[part] = node
    number[part[is_new]] = count + np.arange(len(is_new))
    return number[part], node[is_new]


def _bare_links(node, faces):
    """Pairs of corners at one node that no face joins: of cells that touch at a point. They stay together."""
    first = np.unique(parts_of(_corner_pairs(faces), len(node)), return_index=True)[1]
    order = first[np.argsort(node[first], kind="stable")]
    same = node[order[1:]] == node[order[:-1]]
    return np.stack([order[:-1][same], order[1:][same]], 1)
