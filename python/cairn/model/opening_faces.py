"""Inner faces of a mesh that open where their traction is above a threshold. Cells share their nodes until then; a node is
duplicated for each part of the cells round it that open faces separate (Pandolfi & Ortiz 2002).
"""

from __future__ import annotations

from copy import copy

import numpy as np

from ..base import checks
from ..names import listed
from .components import parts_of
from .elastic import ELEMENTS, SIDES, ElasticBody
from .face_forces import FaceForces, cell_matrices
from .mesh_faces import LoneFaces

# Contact points of a side by number of corners: weights of the corners, with equal tributary areas. The points of a quadrilateral
# are Gauss points rotated in the square by 15 degrees: still exact for cubics, and off the diagonal between its two facets.
_G = 0.5 / np.sqrt(3.0)
_X, _Y = 0.5 * np.sqrt(1 / 2), 0.5 * np.sqrt(1 / 6)
_QUAD = np.array([(0.5 + _X) * (0.5 + _Y), (0.5 - _X) * (0.5 + _Y), (0.5 - _X) * (0.5 - _Y), (0.5 + _X) * (0.5 - _Y)])
POINTS = {
    2: np.array([[0.5 + _G, 0.5 - _G], [0.5 - _G, 0.5 + _G]]),
    3: np.full((3, 3), 1 / 6) + 0.5 * np.eye(3),
    4: np.stack([np.roll(_QUAD, k) for k in range(4)]),
}

WARP = 0.2  # largest warp of a quadrilateral over its size: beyond, points may touch both facets across, or other sides
THICKNESS = 0.05  # thickness of the edges of open faces over the shortest length, as of other edges of meshes


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
    """Inner faces of a mesh: geometry, and which of the faces are open.

    body: the initial ElasticBody; strength: (normal, tangential) [Pa]; threshold: share of the strength at which a face opens.
    A corner is a node of a cell; corners are numbered through the cells of all kinds, as cells are.
    cells (m, 2): both cells of each face. corners (m, 2, k): corners of each face in both cells, in the order of the first cell;
    k = 2 for edges, 3 for triangles, 4 for quadrilaterals. share (m, k): tributary length [m] or area [m2] of each corner.
    normal (m, dim): out of the first cell. is_open (m,). node (corners,): current node of each corner. former (nodes,): initial
    node of each current node. shown (faces,): open faces with a duplicated node, in the order of opening.
    """

    def __init__(self, body, strength, threshold):
        self.start, self.strength, self.threshold = body, strength, threshold
        self.body = body
        self.node = np.concatenate([cells.ravel() for cells in body.cells.values()])
        self.former = np.arange(len(body.points))
        self.cells, self.corners = _inner_faces(body)
        self.normal, self.share = _normals(body.points[self.node[self.corners[:, 0]]])
        self.rule = POINTS[self.corners.shape[2]]
        self.is_open = np.zeros(len(self.cells), bool)
        self.shown = np.zeros(0, int)
        self._links = _bare_links(self.node, self.corners)
        self._matrices = self._forces = None

    @property
    def apart(self):
        """True for open faces with a duplicated node, (m,)."""
        return self.is_open & np.any(self.node[self.corners[:, 0]] != self.node[self.corners[:, 1]], axis=1)

    @property
    def forces(self):
        """FaceForces for the current nodes, made when first used."""
        if self._forces is None:
            if self._matrices is None:
                self._matrices = cell_matrices(self.start)
            self._forces = FaceForces(self, self._matrices)
        return self._forces

    def mean_traction(self, displacement):
        """Traction on the first cell of each face times the thickness, (m, dim) [Pa, in 2D Pa m], from the mean of the stresses
        in the middles of both cells (Camacho & Ortiz 1996)."""
        stress = np.concatenate(list(self.body.stress(displacement).values())) * self.body.thickness
        mean = 0.5 * stress[self.cells].sum(axis=1)
        full = np.array([[0, 2], [2, 1]] if self.body.dim == 2 else [[0, 3, 5], [3, 1, 4], [5, 4, 2]])
        return np.einsum("fij,fj->fi", mean[:, full], self.normal)

    def above(self, traction):
        """Numbers of closed faces whose traction exceeds the threshold at a contact point of the future cohesive zone:
        (t_N+ / s_N)^2 + (t_T / s_T)^2 >= threshold^2. traction (m, k, dim): at the corners of the faces."""
        at = np.einsum("pe,fec->fpc", self.rule, traction)
        with np.errstate(over="ignore", invalid="ignore"):
            normal = np.einsum("fpc,fc->fp", at, self.normal)
            tangential = np.linalg.norm(at - normal[..., None] * self.normal[:, None], axis=2)
            size = np.hypot(np.maximum(normal, 0) / self.strength[0], tangential / self.strength[1]).max(axis=1)
        if not np.all(np.isfinite(size)):
            at = int(np.argmin(np.isfinite(size)))
            told = f"the traction on the face between cells {self.cells[at].tolist()} is no finite number"
            raise ValueError(f"{told}: take shorter steps, or look at the loads")
        return np.flatnonzero(~self.is_open & (size >= self.threshold))

    def opened(self, faces):
        """A copy with these faces open as well."""
        out = copy(self)
        out.is_open = self.is_open.copy()
        out.is_open[faces] = True
        joined = np.concatenate([_corner_pairs(self.corners[~out.is_open]), self._links])
        out.node, parents = _nodes_apart(self.node, joined, len(self.former))
        out.former = np.concatenate([self.former, self.former[parents]])
        return out.settled()

    def settled(self):
        """Updates body and shown faces after a change of open faces and nodes; returns itself."""
        self._forces = None
        if len(self.former) > len(self.start.points):
            self.body = self._split_body()
        self.shown = np.concatenate([self.shown, np.setdiff1d(np.flatnonzero(self.apart), self.shown)])
        return self

    def parts(self):
        """Number of the fragment of each node, (nodes,): cells that share a node are in the same fragment."""
        cells = [self.node[corners] for corners in _by_cell(self.start)]
        return parts_of(np.concatenate([np.stack([c[:, :-1], c[:, 1:]], -1).reshape(-1, 2) for c in cells]), len(self.former))

    def _split_body(self):
        cells = {kind: self.node[corners] for kind, corners in zip(self.start.cells, _by_cell(self.start))}
        groups = {name: np.flatnonzero(np.isin(self.former, nodes)) for name, nodes in self.start.groups.items()}
        given = {**self.start.given, "points": self.start.points[self.former], "cells": cells, "groups": groups}
        return ElasticBody(**given)

    def points(self):
        """Nodes and weights (points, k) of the contact points of open faces, on their first cells."""
        nodes = self.node[self.corners[self.shown, 0]]
        return np.repeat(nodes, len(self.rule), axis=0), np.tile(self.rule, (len(nodes), 1))

    def sides(self):
        """Nodes (2 faces, k) of both sides of open faces, first cell then second: anticlockwise from outside, or edges with the
        body on their left."""
        first, second = (self.node[self.corners[self.shown, k]] for k in (0, 1))
        return np.stack([first, second[:, ::-1]], 1).reshape(-1, first.shape[1])

    def facets(self, last=None):
        """LoneFaces of the sides in 3D: of the `last` faces that opened, or of all."""
        return LoneFaces(self.sides() if last is None else self.sides()[-2 * last :])

    def thickness(self):
        """Thickness of the edges of open faces [m]."""
        return THICKNESS * self.share.sum(axis=1).min()

    # ------------------------------------------------------------------ files

    def to_dict(self):
        """Content of a checkpoint: open faces and nodes."""
        return {"open": self.is_open, "node": self.node, "former": self.former, "shown": self.shown}

    def from_dict(self, content):
        """A copy with the open faces of a checkpoint. Raises ValueError for a checkpoint of another mesh."""
        out = copy(self)
        out.is_open, out.node = np.asarray(content["open"], bool), np.asarray(content["node"], int)
        out.former, out.shown = np.asarray(content["former"], int), np.asarray(content["shown"], int)
        out.body = self.start
        n = len(out.former)
        if out.is_open.shape != self.is_open.shape or out.node.shape != self.node.shape:
            raise ValueError(f"the state has {len(out.is_open)} faces that open and {len(out.node)} corners, of another mesh")
        fits = np.array_equal(np.unique(out.node), np.arange(n)) and np.array_equal(out.former[out.node], self.start_node)
        if not fits or not np.array_equal(np.sort(out.shown), np.flatnonzero(out.apart)):
            raise ValueError("an open face has a node that is no corner of its cells: the state is damaged, or of another mesh")
        return out.settled()

    @property
    def start_node(self):
        """Initial node of each corner."""
        return np.concatenate([cells.ravel() for cells in self.start.cells.values()])


def checked(body, law, threshold):
    """OpeningFaces of a body. Raises ValueError for cells or laws whose faces cannot open."""
    second = [kind for kind in body.cells if ELEMENTS[kind]["order"] > 1]
    if second:
        kinds = "triangle, quad, tetra and hexahedron"
        told = f"cells are {listed(second, second[0])}: faces open by threshold between cells of first order, {kinds}"
        raise ValueError(f"{told}; leave out opens")
    if body.dim == 3 and len(body.cells) > 1:
        kinds = " and ".join(body.cells)
        raise ValueError(f"cells are {kinds}: in 3D faces open by threshold between cells of one kind; leave out opens")
    share = checks.number("threshold", threshold, finite=False)
    if not share >= 0:
        raise ValueError(f"threshold is {threshold}: give a share of the strength of the law, from 0 on")
    strengths = strengths_of(law)
    if not min(strengths) > 0:
        raise ValueError(f"law is {law!r}, whose strengths {strengths} sides cannot stay below: give strengths above 0")
    out = OpeningFaces(body, strengths, share)
    if not len(out.cells):
        raise ValueError("no two cells of the body share a side, so none can open: give cells that share nodes")
    warps_of(body.points[out.node[out.corners[:, 0]]])
    return out


def warps_of(x):
    """Warp of sides with corners at x (m, k, dim): x0 - x1 + x2 - x3 along the normal (m,) [m]; 0 for edges and triangles. Raises
    ValueError above WARP, where points might touch the side across twice or never."""
    if x.shape[1] < 4:
        return np.zeros(len(x))
    normal = np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])
    size = np.sqrt(np.linalg.norm(normal, axis=1))
    off = np.abs(np.sum((x[:, 0] - x[:, 1] + x[:, 2] - x[:, 3]) * normal, axis=1)) / size**2
    if np.any(off > WARP * size):
        told = f"a side of two cells is warped by {(off / size).max():.2g} of its size"
        raise ValueError(f"{told}: give cells whose sides are plane to {WARP:g}, or tetra")
    return np.where(off > 1e-9 * size, off, 0.0)


def _inner_faces(body):
    """Faces shared by two cells: numbers of the cells (m, 2), and of their corners on the face (m, 2, k)."""
    cell, corner, node, first_cell, first_corner = [], [], [], 0, 0
    for kind, nodes in body.cells.items():
        sides = SIDES[kind][:, (SIDES[kind] >= 0).all(axis=0)]
        here = np.arange(len(nodes))
        cell.append(np.repeat(first_cell + here, len(sides)))
        corner.append((first_corner + here[:, None, None] * nodes.shape[1] + sides).reshape(-1, sides.shape[1]))
        node.append(nodes[:, sides].reshape(-1, sides.shape[1]))
        first_cell, first_corner = first_cell + len(nodes), first_corner + nodes.size
    cell, corner, node = (np.concatenate(part) for part in (cell, corner, node))
    known = np.sort(node, axis=1)
    order = np.lexsort((cell, *known.T[::-1]))
    known = known[order]
    same = np.all(known[1:] == known[:-1], axis=1)
    if np.any(same[1:] & same[:-1]):
        at = known[1:-1][same[1:] & same[:-1]][0].tolist()
        raise ValueError(f"more than two cells share the side of nodes {at}: which of them part is not known; leave out opens")
    first, second = order[:-1][same], order[1:][same]
    across = np.empty_like(corner[first])
    places, others = np.argsort(node[first], axis=1), np.argsort(node[second], axis=1)
    np.put_along_axis(across, places, np.take_along_axis(corner[second], others, 1), 1)
    return np.stack([cell[first], cell[second]], 1), np.stack([corner[first], across], 1)


def _normals(x):
    """Normals (m, dim) of faces with corners at x (m, k, dim), and tributary lengths [m] or areas [m2] of the corners (m, k); for
    a quadrilateral the integrals of the bilinear shape functions."""
    if x.shape[2] == 2:
        along = x[:, 1] - x[:, 0]
        length = np.linalg.norm(along, axis=1)
        return np.stack([along[:, 1], -along[:, 0]], 1) / length[:, None], np.repeat(length[:, None] / 2, 2, axis=1)
    k = x.shape[1]
    whole = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]) if k == 3 else np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])
    size = np.linalg.norm(whole, axis=1)
    if k == 3:
        return whole / size[:, None], np.repeat(size[:, None] / 6, 3, axis=1)
    share = np.zeros(x.shape[:2])
    for weights in POINTS[4]:  # Gauss points, given by bilinear shape functions
        one, two = (weights[0] + weights[1], weights[1] + weights[2])  # weights of edges 0-1 and 1-2 in the tangents a, b
        a = one * (x[:, 1] - x[:, 0]) + (1 - one) * (x[:, 2] - x[:, 3])
        b = two * (x[:, 2] - x[:, 1]) + (1 - two) * (x[:, 3] - x[:, 0])
        share += weights * np.linalg.norm(np.cross(a, b), axis=1)[:, None] / 4
    return whole / size[:, None], share


def _by_cell(body):
    """Numbers of the corners of the cells of each kind, (cells, corners)."""
    ends = np.cumsum([cells.size for cells in body.cells.values()])
    return [np.arange(end - cells.size, end).reshape(cells.shape) for end, cells in zip(ends, body.cells.values())]


def _corner_pairs(faces):
    """Pairs of corners (m, 2) joined by faces."""
    return faces.transpose(0, 2, 1).reshape(-1, 2)


def _nodes_apart(node, pairs, count):
    """New node of each corner if only these pairs join corners, and the former node of each new node.

    A node splits into the connected parts of its corners; the part of its first corner keeps the number."""
    n = len(node)
    part = parts_of(pairs, n)
    first = np.full(part.max() + 1, n)
    np.minimum.at(first, part, np.arange(n))  # lowest corner of each part
    keeps = np.full(count, n)
    np.minimum.at(keeps, node, np.arange(n))
    is_new = np.sort(first[keeps[node[first]] != first])
    number = np.empty(len(first), int)
    number[part] = node
    number[part[is_new]] = count + np.arange(len(is_new))
    return number[part], node[is_new]


def _bare_links(node, faces):
    """Pairs of corners of a node in cells that share that node but no chain of faces; these stay joined for good."""
    first = np.unique(parts_of(_corner_pairs(faces), len(node)), return_index=True)[1]
    order = first[np.argsort(node[first], kind="stable")]
    same = node[order[1:]] == node[order[:-1]]
    return np.stack([order[:-1][same], order[1:][same]], 1)
