"""Sets of bodies with round sides: capsules, cylinders, superquadrics. Mass and inertia in closed form.

The axis of a capsule or cylinder is the third axis of its body. Shapes that repeat are stored once.
"""

from __future__ import annotations

import math

import numpy as np

from ..base import checks
from ..names import takes
from .bodies import OPTIONS, BodySet, ContactorSet
from .body_values import density_of, unit_quaternions
from .shapes import Hulls, _body_set

EXPONENTS = (0.05, 1.95)


@takes(*OPTIONS)
def capsules(
    centers, radii, lengths, material, *, axis=None, rotation=None, fixed=False, density=None, **options
) -> BodySet:
    """Capsules in 3D: all points within a radius of a segment.

    Their mass is density (pi r^2 l + 4/3 pi r^3).

    Parameters
    ----------
    centers : array_like (n, 3)
        Centres [m].
    radii : float or array_like (n,)
        Radii [m].
    lengths : float or array_like (n,)
        Lengths of the segments, without the round ends [m]; 0 for a ball.
    material : Material
        Material of all of them.
    axis : array_like (3,) or (n, 3), optional
        Direction of the segment, along z if not given.
    rotation : array_like (n, 4), optional
        Quaternion (w, x, y, z) that turns it from z, in the place of axis.
    fixed : bool, default False
        True for bodies that do not move.
    density : float, optional
        Mass per volume [kg/m3] in the place of that of the material.
    **options : array_like, str or callable
        Options of BodySet: velocity, group, driven, drive, force, damping, surface_velocity, surface_origin.

    Returns
    -------
    BodySet
        The set, to be added to a scene.

    Raises
    ------
    ValueError
        If a value is wrong; the message names field, index, value and remedy.
    """
    centers, n = _centers(centers)
    r, length = _sizes("radii", radii, n), _sizes("lengths", lengths, n, zero=True)
    density = density_of(material, density)
    with np.errstate(over="ignore", under="ignore"):
        middle, ends = density * np.pi * r**2 * length, density * np.pi * 4 / 3 * r**3
        along = middle * r**2 / 2 + ends * 0.4 * r**2
        across = middle * (r**2 / 4 + length**2 / 12) + ends * (0.4 * r**2 + length**2 / 4 + 3 / 8 * length * r)
    hulls, which = _axial(r, length, length / 2 + r)
    moments = np.stack([across, across, along], axis=1)
    return _bodies("capsule", centers, middle + ends, moments, material, hulls, which, axis, rotation, fixed, options)


@takes(*OPTIONS)
def cylinders(
    centers, radii, lengths, material, *, axis=None, rotation=None, fixed=False, density=None, **options
) -> BodySet:
    """Solid cylinders with flat ends in 3D.

    Their mass is density pi r^2 l.

    Parameters
    ----------
    centers : array_like (n, 3)
        Centres [m].
    radii : float or array_like (n,)
        Radii [m].
    lengths : float or array_like (n,)
        Lengths [m].
    material : Material
        Material of all of them.
    axis : array_like (3,) or (n, 3), optional
        Direction of the axis, along z if not given.
    rotation : array_like (n, 4), optional
        Quaternion (w, x, y, z) that turns it from z, in the place of axis.
    fixed : bool, default False
        True for bodies that do not move.
    density : float, optional
        Mass per volume [kg/m3] in the place of that of the material.
    **options : array_like, str or callable
        Options of BodySet: velocity, group, driven, drive, force, damping, surface_velocity, surface_origin.

    Returns
    -------
    BodySet
        The set, to be added to a scene.

    Raises
    ------
    ValueError
        If a value is wrong; the message names field, index, value and remedy.
    """
    centers, n = _centers(centers)
    r, length = _sizes("radii", radii, n), _sizes("lengths", lengths, n)
    with np.errstate(over="ignore", under="ignore"):
        mass = density_of(material, density) * np.pi * r**2 * length
        across, along = mass * (r**2 / 4 + length**2 / 12), mass * r**2 / 2
    hulls, which = _axial(r, length, np.hypot(length / 2, r))
    moments = np.stack([across, across, along], axis=1)
    return _bodies("cylinder", centers, mass, moments, material, hulls, which, axis, rotation, fixed, options)


@takes(*OPTIONS)
def superquadrics(
    centers, half_axes, exponents, material, *, rotation=None, fixed=False, density=None, **options
) -> BodySet:
    """Convex superquadrics in 3D: ((x/a)^(2/e2) + (y/b)^(2/e2))^(e2/e1) + (z/c)^(2/e1) <= 1.

    Parameters
    ----------
    centers : array_like (n, 3)
        Centres [m].
    half_axes : array_like (3,) or (n, 3)
        Half axes a, b, c [m].
    exponents : array_like (2,) or (n, 2)
        Exponents e1 towards z and e2 in the section, from 0.05 (a box with rounded edges) by 1 (an ellipsoid) to 1.95 (an
        octahedron) [-].
    material : Material
        Material of all of them.
    rotation : array_like (n, 4), optional
        Quaternions (w, x, y, z).
    fixed : bool, default False
        True for bodies that do not move.
    density : float, optional
        Mass per volume [kg/m3] in the place of that of the material.
    **options : array_like, str or callable
        Options of BodySet: velocity, group, driven, drive, force, damping, surface_velocity, surface_origin.

    Returns
    -------
    BodySet
        The set, to be added to a scene.

    Raises
    ------
    ValueError
        If a value is wrong; the message names field, index, value and remedy.

    Notes
    -----
    Superquadrics are those of Barr (1981), volume and inertia those of Jaklic & Solina (2003).

    Examples
    --------
    >>> rock = cn.Material("rock", density=1000.0)
    >>> bool(abs(cn.superquadrics([[0, 0, 0]], (1, 2, 3), (1, 1), rock).mass[0] / (8000 * np.pi) - 1) < 1e-9)
    True
    """
    centers, n = _centers(centers)
    half = checks.real_array("half_axes", _rows("half_axes", half_axes, n, 3), (n, 3))
    powers = checks.real_array("exponents", _rows("exponents", exponents, n, 2), (n, 2))
    for name, x, low, high in (("half_axes", half, 0.0, np.inf), ("exponents", powers, *EXPONENTS)):
        wrong = np.argwhere(~((x > 0) & (x >= low) & (x <= high)))
        if len(wrong):
            bounds = "lengths > 0 [m]" if name == "half_axes" else f"numbers from {low} to {high}"
            raise ValueError(f"{name}[{wrong[0][0]}] is {x[wrong[0][0]]}: give {bounds}")
    table, which = np.unique(np.concatenate([half, powers], axis=1), axis=0, return_inverse=True)
    which, m = which.reshape(-1), len(table)
    figures = np.array([_superquadric(*row) for row in table])
    mass = density_of(material, density) * figures[which, 0]
    moments = mass[:, None] * figures[which, 1:4]
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    plane = np.zeros((m, 5, 4))
    plane[:, :3, :3] = np.eye(3)
    plane[:, :, 3] = table
    empty = np.zeros(0, np.int64)
    vertex = (table[:, None, :3] * corners).reshape(-1, 3)
    hulls = Hulls(
        vertex, 8 * np.arange(m + 1), 5 * np.arange(m + 1), empty, empty, False, plane.reshape(-1, 4), figures[:, 4]
    )
    return _bodies("superquadric", centers, mass, moments, material, hulls, which, None, rotation, fixed, options)


def _superquadric(a, b, c, e1, e2):
    """Volume [m3], three moments of inertia over mass [m2], radius of the circumscribed ball [m]."""

    def beta(x, y):
        return math.exp(math.lgamma(x) + math.lgamma(y) - math.lgamma(x + y))

    volume = 2 * a * b * c * e1 * e2 * beta(e1 / 2 + 1, e1) * beta(e2 / 2, e2 / 2)
    section = beta(1.5 * e2, 0.5 * e2) * beta(0.5 * e1, 2 * e1 + 1)
    height = 4 * beta(0.5 * e2, 0.5 * e2 + 1) * beta(1.5 * e1, e1 + 1)
    half = a * b * c * e1 * e2 / 2 / volume
    xx, yy, zz = a * a * section, b * b * section, c * c * height
    return volume, half * (yy + zz), half * (xx + zz), half * (xx + yy), _farthest(a, b, c, e1, e2)


def _farthest(a, b, c, e1, e2):
    """Distance of the farthest point from the centre [m]. With s = x^2, x^2 + y^2 is linear in s, maximised under a norm with
    exponent 1/e."""

    def joined(u, v, e):
        # the largest u s + v t with s^(1/e) + t^(1/e) = 1
        if e >= 1:
            return max(u, v)
        power, high = 1 / (1 - e), max(u, v)
        return high * ((u / high) ** power + (v / high) ** power) ** (1 - e)

    return math.sqrt(joined(joined(a * a, b * b, e2), c * c, e1)) * (1 + 1e-14)


def _axial(r, length, ball, axis=(0.0, 0.0, 1.0)):
    """Hulls of the different capsules or cylinders, and the number of the hull of each body (n,). axis: unit vectors (3,) or
    (n, 3) in the axes of the body."""
    given = np.column_stack([r, length, ball, np.broadcast_to(axis, (len(r), 3))])
    table, which = np.unique(given, axis=0, return_inverse=True)
    m = len(table)
    vertex, plane = np.zeros((m, 2, 3)), np.zeros((m, 4))
    vertex[:, 1] = table[:, 3:] * (table[:, 1] / 2)[:, None]
    vertex[:, 0] = 0.0 - vertex[:, 1]
    plane[:, :3], plane[:, 3] = table[:, 3:], table[:, 0]
    empty = np.zeros(0, np.int64)
    ball = table[:, 2] * (1 + 1e-14)
    hulls = Hulls(vertex.reshape(-1, 3), 2 * np.arange(m + 1), np.arange(m + 1), empty, empty, False, plane, ball)
    return hulls, which.reshape(-1)


def _bodies(shape, centers, mass, moments, material, hulls, which, axis, rotation, fixed, options):
    n = len(centers)
    mass, moments = checks.positive_array("mass", mass), checks.positive_array("inertia", moments.ravel()).reshape(-1, 3)
    if axis is not None:
        if rotation is not None:
            raise ValueError("axis is given with rotation: give one of them")
        rotation = _towards(checks.real_array("axis", _rows("axis", axis, n, 3), (n, 3)))
    quaternion = None if rotation is None else unit_quaternions("rotation", rotation, n)
    contactors = ContactorSet(shape, material, np.arange(n), np.zeros(n), None, None, which.astype(np.int64), hulls)
    return _body_set(3, centers, mass, moments, contactors, quaternion, fixed, options)


def _towards(axis):
    """Quaternions of the smallest rotations from z to the axes."""
    length = np.linalg.norm(axis, axis=1, keepdims=True)
    if not np.all(length > 0):
        raise ValueError(f"axis[{int(np.argmin(length))}] is zero: give a vector of non-zero length")
    x, y, z = (axis / length).T
    square = x * x + y * y
    q = np.stack([np.where(z < 0, square / (1 + np.abs(z)), 1 + z), -y, x, 0 * z], axis=1)
    q[(z < 0) & (square == 0)] = (0, 1, 0, 0)
    return q


def _centers(centers):
    centers = checks.real_array("centers", centers, (None, 3))
    return centers, len(centers)


def _sizes(name, value, n, zero=False):
    if np.ndim(value) == 0:
        value = np.full(n, checks.number(name, value))
    x = checks.real_array(name, value, (n,))
    if not np.all((x > 0) | (zero & (x == 0))):
        at = int(np.argmin((x > 0) | (zero & (x == 0))))
        raise ValueError(f"{name}[{at}] is {x[at]}: give lengths {'>= 0' if zero else '> 0'} [m]")
    return x


def _rows(name, value, n, width):
    try:
        return np.broadcast_to(np.asarray(value, float), (n, width))
    except (TypeError, ValueError):
        raise ValueError(f"{name} has shape {np.shape(value)}: give ({width},) or ({n}, {width})") from None
