"""Boundaries of a scene: walls, segments, tubes, rings and boxes, which stand, are driven or move freely."""

from __future__ import annotations

import numpy as np

from ..base import checks
from ..names import listed, takes
from .bodies import DOFS, BodySet, ContactorSet, checked
from .body_values import per_body, spread

OF_BOUNDARIES = (
    "velocity", "mass", "inertia", "free", "force", "rotation", "group", "damping", "surface_velocity", "surface_origin",
)  # fmt: skip


def boundary_set(dim, position, contactor, mass, inertia, free, velocity, force, options):
    """Makes the set of one body that is held except for its free dofs.

    Parameters
    ----------
    dim : int
        2 or 3.
    position : array_like (dim,)
        Its place [m].
    contactor : ContactorSet
        Its surface.
    mass : float or None
        Mass [kg]; None: without end, for a boundary without free dofs.
    inertia : float, array_like (3,) or None
        Moments of inertia [kg m2]; None: without end.
    free : str or tuple of str
        Its free dofs.
    velocity : array_like, callable or None
        Velocity of the held dofs, and the first velocity of the free ones [m/s, rad/s].
    force : array_like, callable or None
        Force and torque on it [N, N m].
    options : dict
        Further options of a BodySet.

    Returns
    -------
    BodySet
        The set.

    Raises
    ------
    ValueError
        If a free dof is none, or has no mass.
    """
    names = DOFS[dim]
    free = (free,) if isinstance(free, str) else tuple(free or ())
    for name in free:
        if name not in names:
            raise ValueError(f"free names {name!r}: the dofs of a body are {listed(names, name)}")
    if free and mass is None:
        raise ValueError(f"mass is missing: a boundary that is free to move along {', '.join(free)} needs one [kg]")
    if force is not None and mass is not None and not free and not getattr(force, "needs_simulation", False):
        raise ValueError(f"force is given, and free names no dof along which it moves the boundary: give free={names[dim - 1]!r}")
    held = tuple(name for name in names if name not in free)
    infinite = mass is None
    masses = np.array([np.inf if infinite else checks.positive("mass", mass)])
    moment = np.inf if infinite or inertia is None else inertia
    moments = per_body("inertia", moment, (1, 1 if dim == 2 else 3))
    drive = np.zeros(len(names)) if velocity is None else velocity
    if free and not callable(drive):
        start = spread("velocity", drive, 1, len(names), dim)
        options["velocity"] = np.where(np.isin(names, free), start, 0.0)
    return checked(
        BodySet(
            dim,
            np.asarray(position, float)[None],
            masses,
            moments,
            [contactor],
            driven=held,
            drive=drive,
            force=force,
            **options,
        )
    )


@takes(*OF_BOUNDARIES)
def wall(point, normal, material, *, velocity=None, mass=None, inertia=None, free=(), force=None, **options) -> BodySet:
    """A half-plane (2D) or plane (3D): solid behind, free in front of it, where the normal points.

    It is held, moves at a given velocity, or is pushed by a force: `wall(p, n, m, mass=50, free="vy", force=(0, -300))`.

    Parameters
    ----------
    point : array_like (dim,)
        A point of it [m].
    normal : array_like (dim,)
        Normal out of the solid; its length does not matter.
    material : Material
        Its material.
    velocity : array_like (dofs,) or (dim,), or callable, optional
        Imposed velocity [m/s, rad/s], or a function of time that gives it; zero when not given. It is the initial velocity of
        free dofs as well; if it is a function they begin at rest.
    mass : float, optional
        Mass [kg], needed with free dofs.
    inertia : float or array_like (3,), optional
        Moment of inertia or principal moments [kg m2]; inf when not given.
    free : str or sequence of str
        Names of the dofs that are not held.
    force : array_like (dofs,), callable or Servo, optional
        Applied force and torque [N, N m], a function of time that gives them, or a Servo.
    **options : array_like, str or float
        Options of BodySet: rotation, group, damping, surface_velocity, surface_origin.

    Returns
    -------
    BodySet
        A set of a single body.

    Raises
    ------
    ValueError
        If a value is wrong, a mass is missing beside free dofs, or a Servo has a normal that opposes that of the wall.

    Examples
    --------
    >>> cn.wall((0, 0), (0, 1), cn.Material("rock")).driven
    ('vx', 'vy', 'w')
    """
    point = checks.real_array("point", point, (None,))
    dim = len(point)
    if dim not in (2, 3):
        raise ValueError(f"point has shape {point.shape}: give (2,) or (3,)")
    normal = checks.real_array("normal", normal, (dim,))
    if not np.any(normal):
        raise ValueError(f"normal is {normal}: give a vector of non-zero length, pointing out of the solid")
    contactor = ContactorSet(
        "half_plane" if dim == 2 else "plane",
        material,
        np.zeros(1, int),
        np.zeros(1),
        None,
        np.append(normal / np.max(np.abs(normal)), 0.0)[None],
    )
    if options.get("rotation") is None:  # which turns the wall, not the Servo
        _refuse_opposed(force, normal)
    return boundary_set(dim, point, contactor, mass, inertia, free, velocity, force, options)


def _refuse_opposed(force, normal):
    """Raises ValueError for a Servo whose normal points away from the free side of its wall."""
    pushed = getattr(force, "normal", None)
    if np.shape(pushed) == normal.shape and pushed @ (normal / np.max(np.abs(normal))) < 0:
        kind = type(force).__name__
        raise ValueError(f"normal of the {kind} is {pushed.tolist()}, against that of the wall, {normal.tolist()}: it would push "
                         f"the wall away from the bodies in front of it; give {kind}(stress, normal of the wall)")  # fmt: skip


@takes(*OF_BOUNDARIES)
def segment(
    start, end, material, *, radius=0.0, velocity=None, mass=None, inertia=None, free=(), force=None, **options
) -> BodySet:
    """A straight bar in 2D with round ends.

    Parameters
    ----------
    start : array_like (2,)
        One end of its axis [m].
    end : array_like (2,)
        The other end of its axis [m].
    material : Material
        Its material.
    radius : float, default 0
        Radius of the ends, half its thickness [m].
    velocity : array_like (3,) or (2,), or callable, optional
        As of a wall.
    mass : float, optional
        As of a wall.
    inertia : float, optional
        As of a wall.
    free : str or sequence of str
        As of a wall.
    force : array_like (3,), callable or Servo, optional
        As of a wall.
    **options : array_like, str or float
        Options of BodySet: rotation, group, damping, surface_velocity, surface_origin.

    Returns
    -------
    BodySet
        A set of a single body.

    Raises
    ------
    ValueError
        If a value is wrong, or both ends are the same point.
    """
    start, end = (checks.real_array(n, v, (2,)) for n, v in (("start", start), ("end", end)))
    half = (end - start) / 2
    if not np.any(half):
        raise ValueError(f"end is {end}, the same as start: give two different points")
    radius = checks.number("radius", radius)
    if radius < 0:
        raise ValueError(f"radius is {radius}: give a length >= 0 [m]")
    size = np.max(np.abs(half))
    length = size * np.sqrt(np.sum((half / size) ** 2))
    contactor = ContactorSet(
        "segment", material, np.zeros(1, int), np.array([radius]), None, np.append(half / size, length)[None]
    )
    return boundary_set(2, (start + end) / 2, contactor, mass, inertia, free, velocity, force, options)


@takes(*OF_BOUNDARIES)
def tube(
    point,
    axis,
    radius,
    material,
    *,
    half_length=0.0,
    velocity=None,
    mass=None,
    inertia=None,
    free=(),
    force=None,
    **options,
) -> BodySet:
    """A cylinder seen from inside, in 3D: a drum, a silo.

    Parameters
    ----------
    point : array_like (3,)
        Middle of its axis [m].
    axis : array_like (3,)
        Direction of its axis; its length does not matter.
    radius : float
        Radius [m].
    material : Material
        Its material.
    half_length : float, default 0
        Half its length [m]; 0: it has no end.
    velocity : array_like (6,) or (3,), or callable, optional
        As of a wall.
    mass : float, optional
        As of a wall.
    inertia : float or array_like (3,), optional
        As of a wall.
    free : str or sequence of str
        As of a wall.
    force : array_like (6,), callable or Servo, optional
        As of a wall.
    **options : array_like, str or float
        Options of BodySet: rotation, group, damping, surface_velocity, surface_origin.

    Returns
    -------
    BodySet
        A set of a single body.

    Raises
    ------
    ValueError
        If a value is wrong.
    """
    point = checks.real_array("point", point, (3,))
    axis = checks.real_array("axis", axis, (3,))
    if not np.any(axis):
        raise ValueError(f"axis is {axis}: give a vector of non-zero length")
    half_length = checks.number("half_length", half_length)
    if half_length < 0:
        raise ValueError(f"half_length is {half_length}: give a length > 0 [m], or 0 for no end")
    contactor = ContactorSet(
        "tube",
        material,
        np.zeros(1, int),
        np.array([checks.positive("radius", radius)]),
        None,
        np.append(axis / np.max(np.abs(axis)), half_length or np.inf)[None],
    )
    return boundary_set(3, point, contactor, mass, inertia, free, velocity, force, options)


@takes(*OF_BOUNDARIES)
def ring(center, radius, material, *, velocity=None, mass=None, inertia=None, free=(), force=None, **options) -> BodySet:
    """A circle seen from inside, in 2D: a drum.

    Everything outside is solid.

    Parameters
    ----------
    center : array_like (2,)
        Centre [m].
    radius : float
        Radius [m].
    material : Material
        Its material.
    velocity : array_like (3,) or (2,), or callable, optional
        As of a wall; with its spin [rad/s].
    mass : float, optional
        As of a wall.
    inertia : float, optional
        As of a wall.
    free : str or sequence of str
        As of a wall.
    force : array_like (3,), callable or Servo, optional
        As of a wall.
    **options : array_like, str or float
        Options of BodySet: rotation, group, damping, surface_velocity, surface_origin.

    Returns
    -------
    BodySet
        A set of a single body.

    Raises
    ------
    ValueError
        If a value is wrong.
    """
    center = checks.real_array("center", center, (2,))
    contactor = ContactorSet("ring", material, np.zeros(1, int), np.array([checks.positive("radius", radius)]))
    return boundary_set(2, center, contactor, mass, inertia, free, velocity, force, options)


@takes(*OF_BOUNDARIES)
def box(low, high, material, *, lid=True, **options) -> list[BodySet]:
    """Walls round the inside of a box.

    Parameters
    ----------
    low : array_like (dim,)
        Lowest corner [m].
    high : array_like (dim,)
        Highest corner [m].
    material : Material
        Material of all walls.
    lid : bool, default True
        False leaves out the wall at the high end of the last axis.
    **options : array_like, str or callable
        Options of each wall.

    Returns
    -------
    list of BodySet
        For each axis the wall at its low end, then at its high end.

    Raises
    ------
    ValueError
        If a corner is wrong, or low is not below high in each coordinate.

    Examples
    --------
    >>> len(cn.box((0, 0), (1, 1), cn.Material("rock"), lid=False))
    3
    """
    low, high = (checks.real_array(name, v, (None,)) for name, v in (("low", low), ("high", high)))
    if low.shape != high.shape or low.shape not in ((2,), (3,)) or not np.all(low < high):
        raise ValueError(f"low is {low} and high {high}: give two corners (dim,), low below high in each coordinate")
    walls = []
    for axis in range(len(low)):
        normal = np.zeros(len(low))
        normal[axis] = 1.0
        walls.append(wall(low, normal, material, **options))
        if lid or axis < len(low) - 1:
            walls.append(wall(high, -normal, material, **options))
    return walls
