"""Initial stress of a deformable body: given as a tensor, by groups or cells, or as a function of position; stored at the
integration points of the cells."""

from __future__ import annotations

from functools import cache

import numpy as np

from .. import _core
from ..base import checks
from ..names import listed

ORDER = "11 22 33 12 13 23"
SHOWN = {2: [0, 1, 3], 3: [0, 1, 2, 3, 5, 4]}  # components in the order of ElasticBody.stress


@cache
def _shapes():
    return {e["cell"]: e["bulk_shapes"] for e in _core.elements()}


def at_points(given, points, cells, groups):
    """{kind: (m, points of a cell, 6)} [Pa] of an initial stress in any form that `cn.deformable` takes; None for None.
    Raises ValueError naming field, value and remedy."""
    if given is None:
        return None
    out = {kind: np.zeros((len(nodes), len(_shapes()[kind]), 6)) for kind, nodes in cells.items()}
    if not isinstance(given, dict):
        for kind, nodes in cells.items():
            out[kind][:] = _of_cells("initial_stress", given, points, kind, nodes)
        return out
    taken = {kind: np.full(len(nodes), -1) for kind, nodes in cells.items()}
    for number, (key, value) in enumerate(given.items()):
        what = f"initial_stress of {key!r}"
        if key not in cells and key not in groups:
            known = listed([*groups, *cells], key) if isinstance(key, str) else ", ".join(map(repr, [*groups, *cells]))
            raise ValueError(f"{what}: there is no such group, nor such a kind of cells; there are {known}")
        found = False
        for kind, nodes in cells.items() if key not in cells else [(key, cells[key])]:
            rows = np.arange(len(nodes)) if key in cells else np.flatnonzero(np.isin(nodes, groups[key]).all(axis=1))
            if not len(rows):
                continue
            found = True
            twice = rows[taken[kind][rows] >= 0]
            if len(twice):
                other = list(given)[taken[kind][twice[0]]]
                raise ValueError(f"{what} and of {other!r} are both of {kind} cell {twice[0]}: give groups that share no cell")
            taken[kind][rows] = number
            out[kind][rows] = _of_cells(what, value, points, kind, nodes[rows])
        if not found:
            raise ValueError(f"{what}: no cell has all its nodes in this group: give a group of cells, or a tensor for all")
    return out


def _of_cells(what, value, points, kind, nodes):
    """Initial stress of cells of a kind, broadcastable to (m, points, 6) [Pa]."""
    shapes = _shapes()[kind]
    if callable(value):
        places = np.einsum("pa,mak->mpk", shapes, points[nodes])
        found = np.asarray(value(places.reshape(-1, places.shape[2])), float)
        if found.shape != (len(nodes) * len(shapes), 6):
            told = f"{what} gave shape {found.shape} at {len(nodes) * len(shapes)} places"
            raise ValueError(f"{told}: give a function of places (n, {places.shape[2]}) [m] that gives (n, 6) [Pa], {ORDER}")
        if not np.all(np.isfinite(found)):
            at = int(np.argmin(np.isfinite(found).all(axis=1)))
            place = places.reshape(-1, places.shape[2])[at]
            raise ValueError(f"{what} is {found[at].tolist()} at {place.tolist()}: give finite numbers [Pa]")
        return found.reshape(len(nodes), len(shapes), 6)
    wide = np.ndim(value)
    if wide not in (1, 2, 3) or np.shape(value) not in ((6,), (len(nodes), 6), (len(nodes), len(shapes), 6)):
        told = f"{what} has shape {np.shape(value)}"
        raise ValueError(f"{told}: give (6,) [Pa], {ORDER}, ({len(nodes)}, 6) of the {kind} cells, or a function of position")
    value = checks.real_array(what, value, np.shape(value))
    return value[:, None, :] if wide == 2 else value


def linear_blocks(part):
    """Blocks of the core's BulkModel for an ElasticBody, a dict for each kind of cells."""
    if part.plane == "stress" and part.dim == 3:
        raise ValueError("plane is 'stress' in 3D: plane stress is for meshes in 2D, leave it out")
    return [
        {
            "cell": kind, "nodes": nodes.astype(np.int32), "material": "isotropic_elastic",
            "params": [float(part.given["young"]), float(part.given["poisson"])], "kinematics": "small", "plane": part.plane,
            "mean_dilatation": False, "thickness": part.thickness, **of_block(part, kind),
        }
        for kind, nodes in part.cells.items()
    ]  # fmt: skip


def of_block(body, kind, rows=slice(None)):
    """Entry of a core block with the initial stress of cells of a kind; an empty dict without stress."""
    found = None if body.initial_stress is None else body.initial_stress[kind][rows]
    return {} if found is None or not np.any(found) else {"initial_stress": np.ascontiguousarray(found)}


def forces(body):
    """Nodal forces (n dofs) [N] of the initial stress of an ElasticBody, and its stored energy [J]."""
    model = _core.BulkModel(body.dim, body.points.ravel(), linear_blocks(body))
    force, _, wrong, energy, _ = model.evaluate(np.zeros(body.points.size), 1.0, 1.0)
    if wrong is not None:
        raise ValueError(wrong)
    return force, energy


def forces_of_cells(body):
    """Forces [N] of the initial stress of an ElasticBody on the corners of its cells: a list of (m, dofs of a cell) by kind."""
    corners = np.concatenate([nodes.ravel() for nodes in body.cells.values()])
    blocks, first = linear_blocks(body), 0
    for block in blocks:
        shape = block["nodes"].shape
        block["nodes"] = (first + np.arange(shape[0] * shape[1])).reshape(shape).astype(np.int32)
        first += shape[0] * shape[1]
    force, _, wrong, _, _ = _core.BulkModel(body.dim, body.points[corners].ravel(), blocks).evaluate(
        np.zeros(corners.size * body.dim), 1.0, 1.0
    )
    if wrong is not None:
        raise ValueError(wrong)
    ends = np.cumsum([nodes.size * body.dim for nodes in body.cells.values()])
    return [part.reshape(len(nodes), -1) for part, nodes in zip(np.split(force, ends[:-1]), body.cells.values())]


def shown(body, kind):
    """Mean initial stress of the cells of a kind, in the order of ElasticBody.stress, (m, 3 | 6) [Pa]."""
    return body.initial_stress[kind].mean(axis=1)[:, SHOWN[body.dim]]


def stressed(body, given):
    """A copy of a body with an initial stress. Raises ValueError for a body without known cells."""
    if not hasattr(type(body), "initial_stress"):
        raise ValueError(
            f"initial_stress is of cells, which a {type(body).__name__} does not tell: give an ElasticBody or a SolidBody; of "
            "bars and beams give cn.bars(..., initial_stress=...)"
        )
    if hasattr(body, "parts"):
        raise ValueError("a tied body takes no initial_stress: give it to its parts, as in ElasticBody(..., initial_stress=...)")
    return type(body)(**{**body.given, "initial_stress": given})
