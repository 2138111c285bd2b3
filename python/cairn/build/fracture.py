"""Meshes that may crack along every side between their cells: each cell a body of its own, each inner side cohesive."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .elastic import ElasticBody
from .meshes import deformable

# Where the points of a side stand: weights of its nodes, one row a point. All points of a side stand for the same part of it.
_G = 0.5 / np.sqrt(3.0)
_EDGE = np.array([[0.5 + _G, 0.5 - _G], [0.5 - _G, 0.5 + _G]])
_TRIANGLE = np.full((3, 3), 1 / 6) + 0.5 * np.eye(3)
_QUAD = np.array([[(0.5 + _G) ** 2, (0.5 + _G) * (0.5 - _G), (0.5 - _G) ** 2, (0.5 + _G) * (0.5 - _G)]])
_QUAD = np.concatenate([np.roll(_QUAD, k, axis=1) for k in range(4)])


@dataclass
class Pieces:
    """The cells of a mesh as bodies: `sets` for Scene.add, `name` of their group. cell: of each, (kind, number)."""

    sets: list
    name: str
    law: object
    cell: list
    sides: str

    def add_to(self, scene):
        """Adds them to a scene, with their law."""
        scene.add(*self.sets)
        scene.interact(f"{self.name} {self.sides}", self.name, self.law)


def split(body, law, material, *, name="pieces", fixed=None, drive=None, velocity=None):
    """Every cell of a body one of its own, joined to its neighbours by a law that keeps pairs.

    body: ElasticBody. law: cairn.MAL(...) or another that joins what touches, on two points of each edge (2D), three of a
    triangle or four of a quadrilateral (3D). material: of the contacts. fixed, drive: as of `deformable`, by groups of the body.
    velocity: (dim,) or (n, dim), of its nodes [m/s]. Returns Pieces. Stiffnesses below some 50 E/size of a cell make the body
    softer and its waves slower, by 1/(1 + E/(stiffness size)). In 2D stiffnesses and works are those of the material times the
    thickness.

    Raises ValueError when there is nothing to join.
    """
    if not isinstance(body, ElasticBody):
        raise ValueError(f"body is a {type(body).__name__}: give an ElasticBody")
    dim, made, sides_of, owner, joined = body.dim, [], [], {}, 0
    made_of = {name: value for name, value in body.given.items() if name not in ("points", "cells", "groups")}
    for kind, cells in body.cells.items():
        for number, nodes in enumerate(cells):
            groups = {group: np.flatnonzero(np.isin(nodes, members)) for group, members in body.groups.items()}
            groups = {group: local for group, local in groups.items() if len(local)}
            one = ElasticBody(body.points[nodes], {kind: [np.arange(len(nodes))]}, groups=groups, **made_of)
            sides = one.boundary_edges() if dim == 2 else one.boundary_faces()
            made.append((kind, number, nodes, one))
            sides_of.append([np.asarray(side)[np.asarray(side) >= 0] for side in sides])
    points, faced = [[] for _ in made], [[] for _ in made]
    for piece, (_, _, nodes, _) in enumerate(made):
        for side in sides_of[piece]:
            key = tuple(np.sort(nodes[side]))
            if key in owner:
                points[owner[key][0]].append(owner[key][1])
                faced[owner[key][0]].append(owner[key][1])  # by which its points know their part of the surface
                faced[piece].append(side)
                joined += 1
            else:
                owner[key] = (piece, side)
    if not joined:
        raise ValueError("no two cells of the body share a side: there is nothing to join")
    start = None if velocity is None else np.broadcast_to(np.asarray(velocity, float), body.points.shape)
    sets = []
    for piece, (_, _, nodes, one) in enumerate(made):
        own = {word: {g: v for g, v in (given or {}).items() if g in one.groups} for word, given in
               (("fixed", fixed), ("drive", drive))}  # fmt: skip
        where = {"edges": np.array(faced[piece]).reshape(-1, 2)} if dim == 2 else {"faces": _padded(faced[piece])}
        speed = None if start is None else start[nodes]
        sets += deformable(one, material, points=_points(points[piece], dim), name=name, velocity=speed, **own, **where)
    return Pieces(sets, name, law, [(kind, number) for kind, number, _, _ in made], "edges" if dim == 2 else "faces")


def _points(sides, dim):
    """Nodes (m, k) and weights (m, k) of the points of some sides."""
    most = max((len(side) for side in sides), default=2)
    nodes, weights = [], []
    for side in sides:
        rule = _EDGE if dim == 2 else _TRIANGLE if len(side) == 3 else _QUAD
        for row in rule:
            nodes.append(np.concatenate([side, np.repeat(side[:1], most - len(side))]))
            weights.append(np.concatenate([row, np.zeros(most - len(side))]))
    return np.array(nodes, int).reshape(-1, most), np.array(weights).reshape(-1, most)


def _padded(sides):
    """Faces (m, 3 | 4), -1 where there is no fourth node."""
    if not sides:
        return ()
    most = max(len(side) for side in sides)
    return np.array([np.concatenate([side, np.full(most - len(side), -1)]) for side in sides], int)
