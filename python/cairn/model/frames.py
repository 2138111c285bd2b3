"""Bars and beams as deformable bodies, whose nodes touch rigid bodies: trusses, frames, strings.

frame = cn.beams(points, cells, young=2e11, area=1e-4, inertia=1e-9, density=7800.0, groups={"foot": [0]})
scene.add(cn.deformable(frame, steel, contact="tip", fixed={"foot": "xy"}))
"""

from __future__ import annotations

import numpy as np

from ..base import checks
from ..names import one_of
from .moving_frames import FrameBody
from .section_forces import LinearFrame, dofs_of, followed, stiffness_of, sum_of_cells


def _cells(points, cells):
    points = np.ascontiguousarray(points, float)
    if points.ndim != 2 or points.shape[1] not in (2, 3) or not np.all(np.isfinite(points)):
        raise ValueError(f"points have shape {points.shape}: give finite places (n, 2) or (n, 3) [m]")
    cells = np.asarray(cells, int)
    if cells.ndim != 2 or cells.shape[1] != 2 or cells.size and not 0 <= cells.min() <= cells.max() < len(points):
        raise ValueError(f"cells have shape {cells.shape}: give pairs (m, 2) of numbers of the {len(points)} points")
    length = np.linalg.norm(points[cells[:, 1]] - points[cells[:, 0]], axis=1)
    if not np.all(length > 0):
        raise ValueError(f"cell {int(np.argmin(length))} has no length: give ends that are apart")
    return points, cells, length


def _each(name, value, n):
    value = checks.spread(name, value, (n,))
    if not np.all(np.isfinite(value) & (value > 0)):
        raise ValueError(f"{name} is {value[np.argmin(value)]:g}: give finite numbers above 0")
    return np.ascontiguousarray(value)


def _masses(points, cells, mass):
    """Lumped mass matrix: half the mass of each cell at each of its nodes, for every axis."""
    from scipy import sparse

    of_nodes = np.bincount(cells.ravel(), np.repeat(mass / 2, 2), len(points))
    return sparse.diags_array(np.repeat(of_nodes, points.shape[1])).tocsc()


def _tension(stress, area, young, length):
    """Axial forces (m,) of an initial stress [N], and their stored energy [J]."""
    given = checks.reals("initial_stress", stress, f"give a number, or one for each of the {len(area)} cells [Pa]")
    if given.shape not in ((), area.shape):
        told = f"initial_stress has shape {given.shape}"
        raise ValueError(f"{told}: give a number, or one for each of the {len(area)} cells, shape ({len(area)},) [Pa]")
    pull = checks.real_array("initial_stress", np.broadcast_to(given, area.shape), area.shape) * area
    return pull, float(np.sum(pull**2 * length / (2 * young * area)))


def _held_apart(points, cells, length, pull):
    """Nodal forces (n, dim) [N] that hold bars under their initial tension."""
    along = (points[cells[:, 1]] - points[cells[:, 0]]) * (pull / length)[:, None]
    out = np.zeros(points.shape)
    np.add.at(out, cells[:, 1], along)
    np.add.at(out, cells[:, 0], -along)
    return out


def bars(
    points, cells, *, young, area, density, groups=None, rayleigh=(0.0, 0.0), initial_stress=None, kinematics="small",
):  # fmt: skip
    """A truss: bars (m, 2) between points (n, 2 | 3) [m], hinged at their nodes, with lumped masses.

    young [Pa], area [m2], density [kg/m3]: numbers, or (m,) of the bars. groups: {name: nodes}; rayleigh: (a, b) of
    C = a M + b K [1/s, s]. initial_stress [Pa], a number or (m,): axial stress in the undeformed truss, tension positive. It adds
    its geometric stiffness across the bar, so that a string vibrates. kinematics: "small" gives a LinearBody; "corotational"
    (forces by the change of length) and "total_lagrangian" (Green's strain, second Piola-Kirchhoff stress) give a FrameBody with
    displacements and rotations of any size. Raises ValueError naming cell and remedy.
    """
    kinematics = one_of("kinematics", kinematics, ("small", "corotational", "total_lagrangian"))
    points, cells, length = _cells(points, cells)
    n, dim = len(cells), points.shape[1]
    area, young = _each("area", area, n), _each("young", young, n)
    pull, force, energy = np.zeros(n), None, 0.0
    if initial_stress is not None:
        pull, energy = _tension(initial_stress, area, young, length)
        force = _held_apart(points, cells, length, pull).ravel()
    sections = {"young": young, "area": area, "pull": np.array(pull)}
    stiffness = sum_of_cells(points.size, dofs_of(cells, dim), stiffness_of(points, cells, sections))
    mass = _masses(points, cells, _each("density", density, n) * area * length)
    a, b = checks.rayleigh(rayleigh)
    damping = a * mass + b * stiffness
    stiffness, damping = (stiffness + stiffness.T) / 2, (damping + damping.T) / 2
    if kinematics != "small":
        return FrameBody(points, cells, kinematics, sections, mass, stiffness, damping, groups)
    return LinearFrame(points, cells, sections, mass, stiffness, damping, groups, force, energy)


def beams(
    points, cells, *, young, area, inertia, density, poisson=0.3, shear_area=None, torsion=None, up=(0.0, 0.0, 1.0), clamped=None,
    groups=None, rayleigh=(0.0, 0.0), initial_stress=None, kinematics="small",
):  # fmt: skip
    """A frame: beams (m, 2) between points (n, 2 | 3) [m], rigidly connected at their nodes, with lumped masses.

    young [Pa], area [m2], density [kg/m3], inertia [m4], torsion [m4], shear_area [m2]: numbers, or (m,) of the beams.
    inertia in 3D: a pair or (m, 2), for deflections along the second axis of the section, which lies in the plane of `up` and the
    beam, and along the third. shear_area None: Bernoulli beams, without shear strain.
    clamped: group or nodes whose rotation is held. Rotations have no inertia and are eliminated by static condensation (Guyan
    1965): the stiffness is a full matrix, suited to frames of some hundred nodes.
    initial_stress [Pa], a number or (m,): mean axial stress in the undeformed frame, tension positive; adds the geometric
    stiffness of Bernoulli's cubic deflections.
    kinematics: "small" gives a LinearBody; "corotational" gives a FrameBody, with displacements and rotations of any size while
    each beam bends little. Raises ValueError naming cell and remedy.
    """
    kinematics = one_of("kinematics", kinematics, ("small", "corotational"))
    points, cells, length = _cells(points, cells)
    n, dim = len(cells), points.shape[1]
    area, young = _each("area", area, n), _each("young", young, n)
    both = np.asarray(inertia, float)
    one = both.shape == () or (both.shape == (n,) and (dim == 2 or n != 2))  # no pair given: same inertia on both axes
    both = np.broadcast_to(both[..., None] if one else both, (n, 2))
    for column in both.T:
        _each("inertia", column, n)
    turn = _each("torsion", both.sum(axis=1) if torsion is None else torsion, n)
    sheared = np.zeros(n) if shear_area is None else _each("shear_area", shear_area, n)
    along = (points[cells[:, 1]] - points[cells[:, 0]]) / length[:, None]
    if not checks.number("poisson", poisson) > -1:
        raise ValueError(f"poisson is {poisson}: give a number above -1")
    up = checks.real_array("up", up, (3,))
    if dim == 3 and np.any(np.linalg.norm(np.cross(along, up), axis=1) < 1e-6 * np.linalg.norm(up)):
        raise ValueError(f"up is {up}, along a beam: give another direction")
    pull, force, energy = np.zeros(n), None, 0.0
    if initial_stress is not None:
        pull, energy = _tension(initial_stress, area, young, length)
        force = _held_apart(points, cells, length, pull).ravel()
    sections = {
        "young": young, "area": area, "pull": np.array(pull), "inertia": np.array(both), "torsion": turn,
        "shear_area": sheared, "shear": young / (2 * (1 + poisson)), "up": up,
    }  # fmt: skip
    each = 3 * dim - 3  # dofs of a node
    full = sum_of_cells(each * len(points), dofs_of(cells, each), stiffness_of(points, cells, sections)).toarray()
    all_dofs = np.arange(each * len(points)).reshape(-1, each)
    groups = checks.node_groups(groups, len(points))
    still = groups.get(clamped, clamped) if isinstance(clamped, str) else clamped
    moved, turned = all_dofs[:, :dim].ravel(), all_dofs[:, dim:]
    if still is not None:
        turned = np.delete(turned, checks.node_numbers("clamped", still, len(points)), axis=0)
    turned = turned.ravel()
    still = np.zeros(0, int) if still is None else checks.node_numbers("clamped", still, len(points))
    stiffness = full[np.ix_(moved, moved)]
    if len(turned):
        stiffness = stiffness - full[np.ix_(moved, turned)] @ followed(full[np.ix_(turned, turned)], full[np.ix_(turned, moved)])
    stiffness = (stiffness + stiffness.T) / 2
    mass = _masses(points, cells, _each("density", density, n) * area * length)
    a, b = checks.rayleigh(rayleigh)
    damping = a * mass.toarray() + b * stiffness
    sections["clamped"] = still.astype(np.int32) % len(points)
    if kinematics != "small":
        return FrameBody(points, cells, kinematics, sections, mass, stiffness, damping, groups)
    return LinearFrame(points, cells, sections, mass, stiffness, damping, groups, force, energy)
