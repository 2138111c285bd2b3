"""Bars and beams as deformable bodies: frames, rods, strings of nodes that rigid bodies meet.

frame = cn.beams(points, cells, young=2e11, area=1e-4, inertia=1e-9, density=7800.0, groups={"foot": [0]})
scene.add(cn.deformable(frame, steel, contact="tip", fixed={"foot": "xy"}))
"""

from __future__ import annotations

import numpy as np

from .. import _core
from ..pre import checks
from .meshes import LinearBody


def _cells(points, cells):
    points = np.ascontiguousarray(points, float)
    if points.ndim != 2 or points.shape[1] not in (2, 3) or not np.all(np.isfinite(points)):
        raise ValueError(f"points have shape {points.shape}: give finite places (n, 2) or (n, 3) [m]")
    cells = np.asarray(cells, int)
    if cells.ndim != 2 or cells.shape[1] != 2 or cells.size and not 0 <= cells.min() <= cells.max() < len(points):
        raise ValueError(f"cells have shape {cells.shape}: give pairs (m, 2) of numbers of the {len(points)} points")
    length = np.linalg.norm(points[cells[:, 1]] - points[cells[:, 0]], axis=1)
    if not np.all(length > 0):
        raise ValueError(f"cell {int(np.argmin(length))} has no length")
    return points, cells, length


def _each(name, value, n):
    value = np.broadcast_to(np.asarray(value, float), (n,))
    if not np.all(np.isfinite(value) & (value > 0)):
        raise ValueError(f"{name} is {value[np.argmin(value)]:g}: give finite numbers above 0")
    return np.ascontiguousarray(value)


def _sum(n, dofs, matrices):
    from scipy import sparse

    rows, columns = (np.broadcast_to(d, matrices.shape).ravel() for d in (dofs[:, :, None], dofs[:, None, :]))
    return sparse.csc_array((matrices.ravel(), (rows, columns)), (n, n))


def _masses(points, cells, mass):
    """Half the mass of each cell at each of its nodes, of every axis."""
    from scipy import sparse

    of_nodes = np.bincount(cells.ravel(), np.repeat(mass / 2, 2), len(points))
    return sparse.diags_array(np.repeat(of_nodes, points.shape[1])).tocsc()


def bars(points, cells, *, young, area, density, groups=None, rayleigh=(0.0, 0.0)):
    """A truss: bars (m, 2) between points (n, 2 | 3) [m] that turn freely about their nodes, masses at the nodes.

    young [Pa], area [m2], density [kg/m3]: numbers, or one for each bar. groups: {name: nodes}; rayleigh: (a, b) of
    C = a M + b K [1/s, s]. A LinearBody; raises ValueError naming cell and remedy.
    """
    points, cells, length = _cells(points, cells)
    n, dim = len(cells), points.shape[1]
    area, young = _each("area", area, n), _each("young", young, n)
    k = _core.bar_stiffness(np.ascontiguousarray(points[cells]), young, area)
    dofs = (dim * cells[:, :, None] + np.arange(dim)).reshape(n, -1)
    stiffness = _sum(points.size, dofs, k)
    mass = _masses(points, cells, _each("density", density, n) * area * length)
    damping = rayleigh[0] * mass + rayleigh[1] * stiffness
    return LinearBody(points, mass, (stiffness + stiffness.T) / 2, damping=(damping + damping.T) / 2, groups=groups)


def beams(
    points, cells, *, young, area, inertia, density, poisson=0.3, shear_area=None, torsion=None, up=(0.0, 0.0, 1.0), clamped=None,
    groups=None, rayleigh=(0.0, 0.0),
):  # fmt: skip
    """A frame: beams (m, 2) between points (n, 2 | 3) [m], stiffly joined; masses at the nodes.

    young [Pa], area [m2], density [kg/m3], inertia [m4] (in 3D (m, 2) or a pair: of bending along the second axis of the section,
    which lies in the plane of `up` and the beam, and along the third), torsion [m4], shear_area [m2] (None: Bernoulli's beams,
    which do not shear): numbers, or one for each beam. clamped: group or nodes that do not turn. Rotations have no inertia, and
    follow the displacements (Guyan 1965): the stiffness is full, for frames of some hundred nodes. A LinearBody; raises
    ValueError naming cell and remedy.
    """
    points, cells, length = _cells(points, cells)
    n, dim = len(cells), points.shape[1]
    area, young = _each("area", area, n), _each("young", young, n)
    both = np.asarray(inertia, float)
    both = np.broadcast_to(both[..., None] if both.shape in ((), (n,)) and both.shape != (2,) else both, (n, 2))
    for column in both.T:
        _each("inertia", column, n)
    turn = _each("torsion", both.sum(axis=1) if torsion is None else torsion, n)
    sheared = np.zeros(n) if shear_area is None else _each("shear_area", shear_area, n)
    along = (points[cells[:, 1]] - points[cells[:, 0]]) / length[:, None]
    up = checks.real_array("up", up, (3,))
    if dim == 3 and np.any(np.linalg.norm(np.cross(along, up), axis=1) < 1e-6 * np.linalg.norm(up)):
        raise ValueError(f"up is {up}, along a beam: give another direction")
    k = _core.beam_stiffness(
        np.ascontiguousarray(points[cells]), up, young, young / (2 * (1 + checks.number("poisson", poisson))), area,
        np.ascontiguousarray(both), turn, sheared,
    )  # fmt: skip
    each = 3 * dim - 3  # dofs of a node
    dofs = (each * cells[:, :, None] + np.arange(each)).reshape(n, -1)
    full = _sum(each * len(points), dofs, k).toarray()
    all_dofs = np.arange(each * len(points)).reshape(-1, each)
    groups = {name: np.atleast_1d(np.asarray(nodes, int)) for name, nodes in (groups or {}).items()}
    still = groups.get(clamped, clamped) if isinstance(clamped, str) else clamped
    moved, turned = all_dofs[:, :dim].ravel(), all_dofs[:, dim:]
    if still is not None:
        turned = np.delete(turned, np.atleast_1d(np.asarray(still, int)), axis=0)
    turned = turned.ravel()
    stiffness = full[np.ix_(moved, moved)]
    if len(turned):
        stiffness = stiffness - full[np.ix_(moved, turned)] @ np.linalg.solve(
            full[np.ix_(turned, turned)], full[np.ix_(turned, moved)]
        )
    stiffness = (stiffness + stiffness.T) / 2
    mass = _masses(points, cells, _each("density", density, n) * area * length)
    damping = rayleigh[0] * mass.toarray() + rayleigh[1] * stiffness
    return LinearBody(points, mass, stiffness, damping=damping, groups=groups)
