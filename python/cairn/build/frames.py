"""Bars and beams as deformable bodies: frames, rods, strings of nodes that rigid bodies meet.

frame = cn.beams(points, cells, young=2e11, area=1e-4, inertia=1e-9, density=7800.0, groups={"foot": [0]})
scene.add(cn.deformable(frame, steel, contact="tip", fixed={"foot": "xy"}))
"""

from __future__ import annotations

import numpy as np

from .. import _core
from ..pre import checks
from ..names import one_of
from .meshes import LinearBody
from .moving_frames import FrameBody


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


def _tension(stress, area, young, length):
    """Forces along bars (m,) of a stress that they have before they move [N], and the energy that they store [J]."""
    given = checks.reals("initial_stress", stress, f"give a number, or one for each of the {len(area)} cells [Pa]")
    if given.shape not in ((), area.shape):
        told = f"initial_stress has shape {given.shape}"
        raise ValueError(f"{told}: give a number, or one for each of the {len(area)} cells, shape ({len(area)},) [Pa]")
    pull = checks.real_array("initial_stress", np.broadcast_to(given, area.shape), area.shape) * area
    return pull, float(np.sum(pull**2 * length / (2 * young * area)))


def _held_apart(points, cells, length, pull):
    """Forces (n, dim) of bars that are pulled, on nodes that hold them so."""
    along = (points[cells[:, 1]] - points[cells[:, 0]]) * (pull / length)[:, None]
    out = np.zeros(points.shape)
    np.add.at(out, cells[:, 1], along)
    np.add.at(out, cells[:, 0], -along)
    return out


def bars(
    points, cells, *, young, area, density, groups=None, rayleigh=(0.0, 0.0), initial_stress=None, kinematics="small",
):  # fmt: skip
    """A truss: bars (m, 2) between points (n, 2 | 3) [m] that turn freely about their nodes, masses at the nodes.

    young [Pa], area [m2], density [kg/m3]: numbers, or one for each bar. groups: {name: nodes}; rayleigh: (a, b) of
    C = a M + b K [1/s, s]. initial_stress [Pa], a number or one for each bar: along it before it moves, tension positive; it
    pulls its nodes back across as well, so that a string sounds by it. kinematics: "small", a LinearBody; "corotational", forces
    by the change of length, or "total_lagrangian", by Green's strain and the second stress of Piola and Kirchhoff, a FrameBody
    whose bars move and turn as far as they like. Raises ValueError naming cell and remedy.
    """
    kinematics = one_of("kinematics", kinematics, ("small", "corotational", "total_lagrangian"))
    points, cells, length = _cells(points, cells)
    n, dim = len(cells), points.shape[1]
    area, young = _each("area", area, n), _each("young", young, n)
    k = _core.bar_stiffness(np.ascontiguousarray(points[cells]), young, area)
    pull, force, energy = np.zeros(n), None, 0.0
    if initial_stress is not None:
        pull, energy = _tension(initial_stress, area, young, length)
        force = _held_apart(points, cells, length, pull).ravel()
        along = (points[cells[:, 1]] - points[cells[:, 0]]) / length[:, None]
        across = (pull / length)[:, None, None] * (np.eye(dim) - along[:, :, None] * along[:, None, :])
        k = k + np.block([[across, -across], [-across, across]])
    dofs = (dim * cells[:, :, None] + np.arange(dim)).reshape(n, -1)
    stiffness = _sum(points.size, dofs, k)
    mass = _masses(points, cells, _each("density", density, n) * area * length)
    a, b = checks.rayleigh(rayleigh)
    damping = a * mass + b * stiffness
    stiffness, damping = (stiffness + stiffness.T) / 2, (damping + damping.T) / 2
    if kinematics != "small":
        sections = {"young": young, "area": area, "pull": np.array(pull)}
        return FrameBody(points, cells, kinematics, sections, mass, stiffness, damping, groups)
    return LinearBody(points, mass, stiffness, damping=damping, groups=groups, initial_force=force, initial_energy=energy)


def _across(points, cells, length, pull, up):
    """What a pull adds to the stiffness of beams: (m, 6 | 12, 6 | 12) by cubic deflections (Przemieniecki 1968)."""
    dim, n = points.shape[1], len(cells)
    one = np.ones(n)
    along = (points[cells[:, 1]] - points[cells[:, 0]]) / length[:, None]
    if dim == 2:
        axes = np.stack([along, np.stack([-along[:, 1], along[:, 0]], 1)], 1)
    else:
        second = up - (along @ up)[:, None] * along
        second /= np.linalg.norm(second, axis=1)[:, None]
        axes = np.stack([along, second, np.cross(along, second)], 1)
    size = length
    bent = (
        np.array(
            [
                [36 * one, 3 * size, -36 * one, 3 * size],
                [3 * size, 4 * size**2, -3 * size, -(size**2)],
                [-36 * one, -3 * size, 36 * one, -3 * size],
                [3 * size, -(size**2), -3 * size, 4 * size**2],
            ]
        ).transpose(2, 0, 1)
        * (pull / (30 * size))[:, None, None]
    )
    each = 3 * dim - 3
    out = np.zeros((n, 2 * each, 2 * each))
    for axis in range(1, dim):
        # rows of the deflection along the axis and the slope that goes with it, of both nodes
        turn = np.zeros((n, 4, 2 * each))
        for node in range(2):
            turn[:, 2 * node, node * each : node * each + dim] = axes[:, axis]
            if dim == 2:
                turn[:, 2 * node + 1, node * each + 2] = 1
            else:  # a slope along the second axis is a turn about the third; along the third one about the second, backwards
                about = axes[:, 2] if axis == 1 else -axes[:, 1]
                turn[:, 2 * node + 1, node * each + 3 : node * each + 6] = about
        out += np.einsum("nij,nik,nkl->njl", turn, bent, turn)
    return out


def _followed(turns, given):
    """Solutions of turns x = given; the least where nothing holds a turn, as of a straight beam in space about itself."""
    try:
        return np.linalg.solve(turns, given)
    except np.linalg.LinAlgError:
        stiffness = np.abs(np.diag(turns))  # each turn on a scale of its own, so that soft beams beside stiff ones stay
        scale = 1 / np.sqrt(np.where(stiffness > 0, stiffness, 1))[:, None]
        return scale * np.linalg.lstsq(scale * turns * scale.T, scale * given, rcond=1e-13)[0]


def beams(
    points, cells, *, young, area, inertia, density, poisson=0.3, shear_area=None, torsion=None, up=(0.0, 0.0, 1.0), clamped=None,
    groups=None, rayleigh=(0.0, 0.0), initial_stress=None, kinematics="small",
):  # fmt: skip
    """A frame: beams (m, 2) between points (n, 2 | 3) [m], stiffly joined; masses at the nodes.

    young [Pa], area [m2], density [kg/m3], inertia [m4] (in 3D (m, 2) or a pair: of bending along the second axis of the section,
    which lies in the plane of `up` and the beam, and along the third), torsion [m4], shear_area [m2] (None: Bernoulli's beams,
    which do not shear): numbers, or one for each beam. clamped: group or nodes that do not turn. Rotations have no inertia, and
    follow the displacements (Guyan 1965): the stiffness is full, for frames of some hundred nodes. initial_stress [Pa], a number
    or one for each beam: the mean along it before it moves, tension positive, which makes it stiffer or softer against bending
    (by Bernoulli's deflections). kinematics: "small", a LinearBody; "corotational", a FrameBody whose beams move and turn as far
    as they like while each bends little. Raises ValueError naming cell and remedy.
    """
    kinematics = one_of("kinematics", kinematics, ("small", "corotational"))
    points, cells, length = _cells(points, cells)
    n, dim = len(cells), points.shape[1]
    area, young = _each("area", area, n), _each("young", young, n)
    both = np.asarray(inertia, float)
    one = both.shape == () or (both.shape == (n,) and (dim == 2 or n != 2))  # each has, in 3D two numbers are a pair
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
    k = _core.beam_stiffness(
        np.ascontiguousarray(points[cells]), up, young, young / (2 * (1 + poisson)), area,
        np.ascontiguousarray(both), turn, sheared,
    )  # fmt: skip
    pull, force, energy = np.zeros(n), None, 0.0
    if initial_stress is not None:
        pull, energy = _tension(initial_stress, area, young, length)
        force = _held_apart(points, cells, length, pull).ravel()
        k = k + _across(points, cells, length, pull, up)
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
    still = np.zeros(0, int) if still is None else np.atleast_1d(np.asarray(still, int))
    stiffness = full[np.ix_(moved, moved)]
    if len(turned):
        stiffness = stiffness - full[np.ix_(moved, turned)] @ _followed(full[np.ix_(turned, turned)], full[np.ix_(turned, moved)])
    stiffness = (stiffness + stiffness.T) / 2
    mass = _masses(points, cells, _each("density", density, n) * area * length)
    a, b = checks.rayleigh(rayleigh)
    damping = a * mass.toarray() + b * stiffness
    if kinematics != "small":
        sections = {
            "young": young, "area": area, "pull": np.array(pull), "inertia": np.array(both), "torsion": turn,
            "shear_area": sheared, "shear": young / (2 * (1 + poisson)), "up": up,
            "clamped": still.astype(np.int32) % len(points),
        }  # fmt: skip
        return FrameBody(points, cells, kinematics, sections, mass, stiffness, damping, groups)
    return LinearBody(points, mass, stiffness, damping=damping, groups=groups, initial_force=force, initial_energy=energy)
