"""Meshes that may crack along the sides between their cells: every cell a separate body with cohesive sides, or a single body
whose sides open at a threshold of traction."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from ..base import checks
from ..names import listed
from . import bodies, opening_faces
from .elastic import ElasticBody
from .mesh_parts import group_nodes, part_set
from .meshes import deformable

# laws without tensile strength: cells joined by them would be a loose heap
PRESS_ALONE = (
    "Coulomb", "Restitution", "Frictionless", "GapCoulomb", "LinearSpring", "HertzMindlin", "Rolling", "Wear",
    "UnilateralContact", "ElasticContact", "GapRescue", "LimitedSlip", "CriticalVoigt",
)  # fmt: skip


@dataclass
class Pieces:
    """The cells of a mesh as separate bodies, or as a body that may crack: `sets` for Scene.add, `name` of their group. cell:
    (kind, number) of the cell of each body, or of each cell of the body that may crack."""

    sets: list
    name: str
    law: object
    cell: list
    sides: str

    def add_to(self, scene):
        """Adds the bodies and their law to a scene; returns their ids, as Scene.add does."""
        ids = scene.add(*self.sets)
        scene.interact(f"{self.name} {self.sides}", self.name, self.law)
        return ids


def split(body, law, material, *, name="pieces", fixed=None, drive=None, velocity=None, opens=None, threshold=0.7):
    """Splits a mesh for fracture: every cell a separate body, bonded to its neighbours by a cohesive law. With opens="threshold"
    the mesh stays a single body, and a side between two cells opens to a cohesive zone when its traction reaches a threshold.

    body: ElasticBody. law: cairn.MAL(...) or another cohesive law, applied at two points of each edge (2D), three of a triangle
    or four of a quadrilateral (3D). material: of the contacts. fixed, drive: as for `deformable`, by groups of the body.
    velocity: (dim,) or (n, dim), of its nodes [m/s]. Returns Pieces. Bonds in series make the body softer and its waves slower,
    by 1/(1 + E/(stiffness size)): give stiffnesses above some 50 E/size of a cell. In 2D stiffnesses, strengths and works are
    those of the material times the thickness. Points on warped quadrilaterals have an initial gap; `within` of the law is
    raised to bridge it.

    opens: None, or "threshold", for triangle and quad cells, or for tetra or hexahedron cells. threshold: share of the strength
    of the law at which a side opens, from 0 (all sides, after the first step) to inf (none): (t_N+ / s_N)^2 + (t_T / s_T)^2
    >= threshold^2, checked after each step. Tractions follow from nodal forces, and are the nearest to the mean stress of both
    cells (Camacho & Ortiz 1996). Cells share their nodes until then; a node is duplicated once open sides separate the cells
    round it (Pandolfi & Ortiz 2002).

    Raises ValueError if no cells share a side, if a side of a tetrahedron is half of a side of a hexahedron, if sides of
    hexahedra are warped by more than a fifth of their size, for a law without tensile strength, for unknown groups, and for
    cells or laws whose sides cannot open by threshold.
    """
    _check(body, law, {"fixed": fixed, "drive": drive})
    if opens is not None:
        if opens != "threshold":
            raise ValueError(f'opens is {opens!r}: give None, every cell a body of its own, or "threshold"')
        return _opening(body, law, material, name, threshold, {"fixed": fixed, "drive": drive, "velocity": velocity})
    dim, made, sides_of, owner, joined = body.dim, [], [], {}, 0
    of_all = ("points", "cells", "groups", "initial_stress")
    member = {group: np.isin(np.arange(len(body.points)), nodes) for group, nodes in body.groups.items()}
    made_of = {name: value for name, value in body.given.items() if name not in of_all}
    for kind, cells in body.cells.items():
        for number, nodes in enumerate(cells):
            groups = {group: np.flatnonzero(of[nodes]) for group, of in member.items() if of[nodes].any()}
            stress = body.initial_stress and {kind: body.initial_stress[kind][[number]]}
            cell = {kind: [np.arange(len(nodes))]}
            one = ElasticBody(body.points[nodes], cell, groups=groups, initial_stress=stress, **made_of)
            sides = one.boundary_edges() if dim == 2 else one.boundary_faces()
            made.append((kind, number, nodes, one))
            sides_of.append([np.asarray(side)[np.asarray(side) >= 0] for side in sides])
    points, faced = [[] for _ in made], [[] for _ in made]
    for piece, (_, _, nodes, _) in enumerate(made):
        for side in sides_of[piece]:
            key = tuple(np.sort(nodes[side]))
            if key in owner:
                points[owner[key][0]].append(owner[key][1])
                faced[owner[key][0]].append(owner[key][1])  # gives the points on it their tributary area
                faced[piece].append(side)
                joined += 1
            else:
                owner[key] = (piece, side)
    _check_whole_sides(owner)
    if not joined:
        raise ValueError("no two cells of the body share a side, so none can be joined: give cells that share nodes")
    start = None if velocity is None else checks.spread("velocity", velocity, body.points.shape, " [m/s]")
    sets = []
    for piece, (_, _, nodes, one) in enumerate(made):
        own = {word: {g: v for g, v in (given or {}).items() if g in one.groups} for word, given in
               (("fixed", fixed), ("drive", drive))}  # fmt: skip
        where = {"edges": np.array(faced[piece]).reshape(-1, 2)} if dim == 2 else {"faces": _padded(faced[piece])}
        speed = None if start is None else start[nodes]
        sets += deformable(one, material, points=_points(points[piece], dim), name=name, velocity=speed, **own, **where)
    law = _across_warps(law, [made[p][3].points[side] for p, of in enumerate(faced) for side in of if len(side) == 4])
    return Pieces(sets, name, law, [(kind, number) for kind, number, _, _ in made], "edges" if dim == 2 else "faces")


def _check(body, law, given):
    """Raises ValueError for bodies that are not linear, laws without tensile strength, and unknown groups."""
    if not isinstance(body, ElasticBody) or hasattr(body, "blocks") or hasattr(body, "parts"):  # solids, tied bodies
        told = f"body is a {type(body).__name__}, whose cells cannot be parted"
        raise ValueError(f"{told}: give a cairn.ElasticBody, of Hooke's law at small displacements")
    if type(law).__name__ in PRESS_ALONE:
        told = f"law is {law!r}, which joins nothing: the cells would be a loose heap"
        raise ValueError(f"{told}; give a law that holds what touches, such as cairn.MAL, MAC, TH, EXPO or Bonded")
    for field, groups in given.items():
        for group in groups or {}:
            if not isinstance(group, str):
                raise ValueError(f"{field} names {group!r}: give names of groups of the body, {listed(body.groups)}")
            if not len(group_nodes(body, group)):
                raise ValueError(f"{field} names the group {group!r}, which has no node: leave it out, or give it nodes")


def _check_whole_sides(sides):
    """Raises ValueError if a triangle of a cell is half of a quadrilateral of another. sides: keyed by their sorted nodes."""
    halves = {half: quad for quad in sides if len(quad) == 4 for half in itertools.combinations(quad, 3)}
    for side in sides:
        if side in halves:
            raise ValueError(f"the side of nodes {', '.join(map(str, side))} of a cell is half of the side of nodes "
                             f"{', '.join(map(str, halves[side]))} of another, and nothing would join them: give a mesh whose "
                             "cells share whole sides, of hexahedra or of tetra alone")  # fmt: skip


def _across_warps(law, faces):
    """The law with `within` raised so that pairs bridge warped faces (m, 4, 3): points on them are off the two facets across by
    up to a tenth of the warp."""
    warp = opening_faces.warps_of(np.array(faces)).max() if faces else 0.0
    if not warp > 0:
        return law
    if "within" not in law.parameter_names:
        told = f"law is {law!r}, which joins what touches, and sides of cells are warped by up to {warp:.3g} m"
        raise ValueError(f"{told}: give a law with a parameter within, or cells with plane sides")
    given = {name: getattr(law, name) for name in law.parameter_names}
    return type(law)(**given | {"within": max(warp / 8, given["within"])})


def _opening(body, law, material, name, threshold, given):
    """Pieces of a single body whose sides open at a threshold."""
    opening = opening_faces.checked(body, law, threshold)
    nodes, *_ = deformable(body, material, name=name, **given)
    attach(nodes, opening)
    cell = [(kind, number) for kind, cells in body.cells.items() for number in range(len(cells))]
    return Pieces([nodes, sides_of(nodes)], name, law, cell, "edges" if body.dim == 2 else "faces")


def attach(nodes, opening):
    """Lets the faces of the mesh of a set of nodes open."""
    d = nodes.mesh
    d.opening, d.self_contact = opening, True
    none = np.zeros(0)
    nodes.contactors.append(bodies.ContactorSet("disk" if d.body.dim == 2 else "sphere", d.material, none.astype(int), none))


def sides_of(nodes):
    """The set to which the sides of opened faces are added; empty at the start."""
    none, dim = np.zeros(0), nodes.mesh.body.dim
    shape, what = ("segment", "edges") if dim == 2 else ("facet", "faces")
    return part_set(dim, [bodies.ContactorSet(shape, nodes.mesh.material, none.astype(int), none)], what, nodes.mesh)


def _points(sides, dim):
    """Nodes (m, k) and weights (m, k) of the contact points on sides."""
    most = max((len(side) for side in sides), default=2)
    nodes, weights = [], []
    for side in sides:
        for row in opening_faces.POINTS[len(side)]:
            nodes.append(np.concatenate([side, np.repeat(side[:1], most - len(side))]))
            weights.append(np.concatenate([row, np.zeros(most - len(side))]))
    return np.array(nodes, int).reshape(-1, most), np.array(weights).reshape(-1, most)


def _padded(sides):
    """Faces (m, 3 | 4) as an array, -1 for the fourth node of a triangle."""
    if not sides:
        return ()
    most = max(len(side) for side in sides)
    return np.array([np.concatenate([side, np.full(most - len(side), -1)]) for side in sides], int)
