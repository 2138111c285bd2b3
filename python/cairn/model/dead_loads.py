"""Dead loads of deformable bodies, whose direction is fixed in space: surface tractions and body forces."""

from __future__ import annotations

import numpy as np

from .. import _core
from ..base import checks
from .elastic import ELEMENTS
from .mesh_parts import GivenBody, group_nodes
from .pressure import areas, pressed_sides


def dead_loads(body, traction, body_force):
    """[(name, weights of the nodes (n,), load (dim,) or a function of time)] for the arguments of `cairn.deformable`. Weights are
    integrals of the shape functions over the sides [m2] or the volume [m3] of the initial configuration. Raises ValueError for
    loads of another shape, and for bodies without known sides or cells."""
    out = []
    if traction is not None:
        if not isinstance(traction, dict):
            told = f"give {{group: ({body.dim},)}} [Pa], a function of time in the place of ({body.dim},) where it changes"
            raise ValueError(f"traction is {traction!r}: {told}")
        for group, given in traction.items():
            sides = pressed_sides(body, group_nodes(body, group), group, "traction")
            out.append((f"traction on {group!r}", areas(body, sides, body.points), given))
    if body_force is not None:
        out.append(("body_force", volumes(body), body_force))
    for name, _, given in out:
        if not callable(given):
            checks.real_array(name, given, (body.dim,))
    return out


def volumes(body):
    """Integrals of the shape functions of the nodes over a body, (n,) [m3]. Raises ValueError if its cells are not known."""
    cells = getattr(body, "cells", None)
    if isinstance(body, GivenBody) or not isinstance(cells, dict) or any(kind not in ELEMENTS for kind in cells):
        told = f"body_force: the cells of a {type(body).__name__} are not known, and what volume each node has"
        raise ValueError(f"{told}; give an ElasticBody or a SolidBody, or force={{group: total}} [N]")
    out, dim = np.zeros(len(body.points)), body.dim
    for kind, nodes in cells.items():
        x = np.ascontiguousarray(body.points[nodes])
        if getattr(body, "plane", "") == "axisymmetric":
            mass = _core.ring_masses(kind, x, 1.0)
        else:
            mass = _core.element_matrices(kind, x, float(body.thickness), np.eye(3 * dim - 3))[1]
        np.add.at(out, nodes, mass[:, ::dim, ::dim].sum(axis=2))
    return out


def at_time(loads, t, out):
    """Adds the loads at time t [s] to the nodal forces `out` (n, dim) [N]."""
    for name, weights, given in loads:
        out += weights[:, None] * checks.real_array(name, given(t) if callable(given) else given, out.shape[1:])
