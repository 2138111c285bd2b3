"""Shadows of materials and elements: stresses of cells and nodal forces by a second code, for the same displacements."""

from __future__ import annotations

import math

import numpy as np

from .views import core_of

STAGES = {"stresses": "true stresses of the cells", "element_forces": "forces of the nodes by the stresses of the cells"}

# Corners of the parent cells; then, for each further node, the corners whose mean is its position.
_TRIANGLE = np.array([(0, 0), (1, 0), (0, 1)], float)
_TETRA = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
_QUAD = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], float)
_HEXA = np.array([(*p, z) for z in (-1, 1) for p in _QUAD], float)
_RING = [(0, 1), (1, 2), (2, 3), (3, 0)]
_EDGES = [*_RING, *[(a + 4, b + 4) for a, b in _RING], *[(a, a + 4) for a in range(4)]]
_FACES = [(0, 3, 4, 7), (1, 2, 5, 6), (0, 1, 4, 5), (2, 3, 6, 7), (0, 1, 2, 3), (4, 5, 6, 7), tuple(range(8))]
_CELLS = {
    "triangle": (_TRIANGLE, []), "triangle6": (_TRIANGLE, [(0, 1), (1, 2), (2, 0)]),
    "tetra": (_TETRA, []), "tetra10": (_TETRA, [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]),
    "quad": (_QUAD, []), "quad8": (_QUAD, _RING), "quad9": (_QUAD, [*_RING, (0, 1, 2, 3)]),
    "hexahedron": (_HEXA, []), "hexahedron20": (_HEXA, _EDGES), "hexahedron27": (_HEXA, [*_EDGES, *_FACES]),
}  # fmt: skip


def given_of(simulation, view, h):
    """Input of a kernel on a mesh after a step: initial positions (n, dim) [m], cells by kinds, displacements at both ends of the
    step [m], materials by kinds (class of cairn, parameters, rows), kinematics, plane, thickness [m], states of the cells.
    stress_at: "points", stresses are means over the integration points; "middle", for linear bodies, in 2D xx yy xy."""
    body = view.body
    if getattr(body, "initial_force", None) is not None or getattr(body, "initial_stress", None) is not None:
        raise ValueError(f"{view.name!r} has an initial stress, which shadows of cells are not told: leave initial_stress out")
    solid = hasattr(body, "blocks")
    share = simulation.strategy.moved_by().scheme(1.0)["share"]
    v0 = np.array(simulation.raw.nodes.velocity_begin)[view.rows]
    u1 = view.displacement.copy()
    u0 = u1 - h * (share * view.velocity + (1 - share) * v0)
    return {
        "name": view.name, "h": h, "points": body.points.copy(), "cells": {kind: np.array(c) for kind, c in body.cells.items()},
        "displacement": u1, "displacement_begin": u0, "kinematics": getattr(body, "kinematics", "small"), "plane": body.plane,
        "thickness": body.thickness, "mean_dilatation": getattr(body, "mean_dilatation", False),
        "materials": _materials(body, solid), "state": view.material_state, "stress_at": "points" if solid else "middle",
    }  # fmt: skip


def _materials(body, solid):
    """{kind: [(class of cairn, {name: value}, rows of cells)]}."""
    out = {}
    if not solid:
        values = {"young": float(body.given["young"]), "poisson": float(body.given["poisson"])}
        return {kind: [("IsotropicElastic", values, np.arange(len(cells)))] for kind, cells in body.cells.items()}
    for kind, rows, m in body.layout():
        words = (type(m).__name__, dict(zip(m.parameter_names, m.values)), rows) if m else ("IsotropicElastic", {}, rows)
        out.setdefault(kind, []).append(words)
    return out


def found(simulation, view, stage):
    """Cairn's own result in the step: stresses {kind: (m, 6 | 3)} [Pa], or nodal forces (n, dim) [N]."""
    if stage == "stresses":
        return {kind: np.array(stress) for kind, stress in view.stress.items()}
    if hasattr(view.body, "blocks"):
        return core_of(simulation).mesh_memory(view._mesh.number)[1][:-1].reshape(view.displacement.shape)
    return (view.body.K @ view.displacement.ravel()).reshape(view.displacement.shape)


def difference(simulation, shadow, view, given):
    """(largest difference / largest value, id of a node at that place, result of the kernel)."""
    mine, other = found(simulation, view, shadow.stage), shadow.kernel(given)
    if shadow.stage == "element_forces":
        pairs = [(mine, np.asarray(other, float), None)]
    elif isinstance(other, dict) and set(other) == set(mine):
        pairs = [(mine[kind], np.asarray(other[kind], float), kind) for kind in mine]
    else:
        raise ValueError(f"the shadow of stresses gave {type(other).__name__}: give a dict of arrays, {sorted(mine)}")
    worst, at, scale = 0.0, -1, max((np.abs(one).max(initial=0.0) for one, _, _ in pairs), default=0.0)
    for one, two, kind in pairs:
        if one.shape != two.shape:
            raise ValueError(f"the shadow of {shadow.stage} gave an array of shape {two.shape}: {one.shape} was expected")
        apart = np.abs(one - two).reshape(len(one), -1).max(axis=1, initial=0.0)
        apart = np.where(np.isfinite(two).reshape(len(one), -1).all(axis=1), apart, np.inf)
        if len(apart) and apart.max() > worst:
            worst, row = float(apart.max()), int(np.argmax(apart))
            at = int(view.ids[view.body.cells[kind][row, 0] if kind else row])
    return (0.0 if worst <= 0 else worst / scale if scale > 0 else math.inf), at, other


# ---------------------------------------------------------------------- the plain reference


def plain_stresses(given):
    """Cauchy stresses [Pa]: means over the points of the cells, {kind: (m, 6)}; for linear bodies in the middle, in 2D (m, 3)."""
    out = {}
    middle = given["stress_at"] == "middle"
    shown = [0, 1, 3] if middle and given["points"].shape[1] == 2 else slice(None)
    for kind, cells in given["cells"].items():
        rows = []
        for cell, law in zip(cells, _law_of_each(given, kind)):
            points = list(_points(given, kind, cell, law, middle))
            rows.append(np.mean([cauchy for _, cauchy, _, _ in points], axis=0)[shown])
        out[kind] = np.array(rows)
    return out


def plain_forces(given):
    """Nodal forces (n, dim) [N]: sum over the points of P grad N dV, cell by cell; P: first Piola-Kirchhoff stress."""
    out = np.zeros_like(given["points"])
    for kind, cells in given["cells"].items():
        for cell, law in zip(cells, _law_of_each(given, kind)):
            for first, _, grad, volume in _points(given, kind, cell, law):
                for a, node in enumerate(cell):
                    out[node] += volume * (first[: len(out[0]), : len(out[0])] @ grad[a])
    return out


def _law_of_each(given, kind):
    out = [None] * len(given["cells"][kind])
    for name, values, rows in given["materials"][kind]:
        for row in rows:
            out[row] = name, values
    return out


def _points(given, kind, cell, law, middle=False):
    """Yields for each point of a cell, or its middle: first Piola-Kirchhoff stress (3, 3) and Cauchy stress (6,) [Pa], gradients
    of the shape functions [1/m], volume [m3]."""
    dim = given["points"].shape[1]
    if (dim == 2 and given["plane"] != "strain") or given["mean_dilatation"]:
        raise ValueError("the plain reference knows plane strain and 3D without mean dilatation: give a function")
    x, u = given["points"][cell], given["displacement"][cell]
    for by, weight in _rule(kind, middle):
        jacobian = by.T @ x
        grad = by @ np.linalg.inv(jacobian).T
        f = np.eye(3)
        f[:dim, :dim] += u.T @ grad
        first, true = _stress(*law, given["kinematics"], f)
        volume = weight * np.linalg.det(jacobian) * (given["thickness"] if dim == 2 else 1.0)
        yield first, true[[0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]], grad, volume


def _powers(kind):
    """Exponents (nodes, dim) of the monomials that span the shape functions."""
    corner, between = _CELLS[kind]
    dim, order = corner.shape[1], 2 if between else 1
    powers = np.array(list(np.ndindex(*[order + 1] * dim)))
    if len(corner) == dim + 1:
        return powers[powers.sum(axis=1) <= order]
    whole = len(corner) + len(between) == 3**dim
    return powers if whole or order == 1 else powers[(powers == 2).sum(axis=1) <= 1]  # serendipity elements


def _points_of(kind):
    """Gauss points (k, dim) of a cell and their weights (k,)."""
    corner, between = _CELLS[kind]
    dim = corner.shape[1]
    if len(corner) == dim + 1:
        if not between:
            return np.full((1, dim), 1 / (dim + 1)), np.array([1 / math.factorial(dim)])
        inner = 1 / 6 if dim == 2 else (5 - 5**0.5) / 20
        at = np.full((dim + 1, dim), inner)
        at[1:] += (1 - (dim + 1) * inner) * np.eye(dim)
        return at, np.full(dim + 1, 1 / math.factorial(dim + 1))
    along, weight = np.polynomial.legendre.leggauss(3 if between else 2)
    grid = [g.ravel() for g in np.meshgrid(*[along] * dim, indexing="ij")]
    weights = np.prod(np.meshgrid(*[weight] * dim, indexing="ij"), axis=0)
    return np.stack(grid, axis=1), weights.ravel()


def _rule(kind, middle=False):
    """[(derivatives of the shape functions (nodes, dim), weight)] at the Gauss points, or in the middle with the whole weight.
    Shape functions are found by inversion of the matrix of monomials at the nodes."""
    if kind not in _CELLS:
        raise ValueError(f"the plain reference knows {', '.join(_CELLS)}, not {kind}: give a function")
    corner, between = _CELLS[kind]
    nodes = np.vstack([corner, *[corner[list(of)].mean(axis=0) for of in between]])
    powers = _powers(kind)
    at, weight = _points_of(kind)
    if middle:
        at, weight = corner.mean(axis=0)[None], weight.sum(keepdims=True)
    sums = np.linalg.inv(np.prod(nodes[:, None] ** powers, axis=2))  # (monomials, nodes)
    out = []
    for x, w in zip(at, weight):
        slopes = np.empty((len(powers), len(x)))
        for k in range(len(x)):
            lower = powers - np.eye(len(x), dtype=int)[k]
            slopes[:, k] = powers[:, k] * np.prod(x ** np.maximum(lower, 0), axis=1)
        out.append((sums.T @ slopes, float(w)))
    return out


def _stress(name, values, kinematics, f):
    """First Piola-Kirchhoff and Cauchy stress (3, 3) [Pa] of a law at a deformation gradient f (3, 3)."""
    young, poisson = values.get("young", 0.0), values.get("poisson", 0.0)
    mu, lame = young / (2 * (1 + poisson)), young * poisson / ((1 + poisson) * (1 - 2 * poisson))
    if name == "IsotropicElastic" and kinematics == "small":
        e = (f + f.T) / 2 - np.eye(3)
        s = 2 * mu * e + lame * np.trace(e) * np.eye(3)
        return s, s
    if name == "SaintVenantKirchhoff" or (name == "IsotropicElastic" and kinematics == "total_lagrangian"):
        e = (f.T @ f - np.eye(3)) / 2
        first = f @ (2 * mu * e + lame * np.trace(e) * np.eye(3))
    elif name == "NeoHookean":
        back = np.linalg.inv(f).T
        first = mu * (f - back) + lame * np.log(np.linalg.det(f)) * back
    else:
        known = "IsotropicElastic (small, total_lagrangian), SaintVenantKirchhoff and NeoHookean"
        what = f"kinematics {kinematics!r} of {name}" if name in known else name
        raise ValueError(f"the plain reference knows {known}, not {what}: give a function")
    return first, first @ f.T / np.linalg.det(f)


REFERENCES = {"stresses": plain_stresses, "element_forces": plain_forces}
