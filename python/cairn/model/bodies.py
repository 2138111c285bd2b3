"""Sets of bodies to add to a scene: disks, spheres, clumps; boundaries.py has walls and the like.

A set is arrays, not objects: a million disks are one set. Dofs are named vx, vy, w in 2D and vx, vy, vz, wx, wy, wz in 3D.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field, replace

import numpy as np

from ..base import checks
from ..base.expressions import texts_of
from ..base.materials import Material
from ..base.time_functions import Components
from ..names import Spelt, listed, takes
from ..pre import mass_properties
from .body_values import density_of, per_body, principal_frames, quaternion_product, spread, unit_quaternions

# options of sets of bodies, and of boundaries, which have a velocity of their own
OPTIONS = ("velocity", "rotation", "group", "driven", "drive", "force", "damping", "surface_velocity", "surface_origin")
DOFS = {2: ("vx", "vy", "w"), 3: ("vx", "vy", "vz", "wx", "wy", "wz")}


@dataclass
class ContactorSet:
    """Contactors of one shape, on the bodies of a set.

    Parameters
    ----------
    shape : str
        Name of the shape in the core.
    material : Material
        Material of all of them.
    body : ndarray (m,)
        Row of the body of each in its set.
    radius : ndarray (m,)
        Radius [m], found from the hull if there is one.
    offset : ndarray (m, dim), optional
        From the centre of mass of the body, in its axes [m].
    direction : ndarray (m, dim + 1), optional
        Unit vector and half length [m].
    hull : ndarray (m,), optional
        Number of each in `hulls`, for polygons, polyhedra and other shapes stored as hulls.
    hulls : Hulls, optional
        The hulls.
    joint : bool, default False
        True for ends of a joint, of its own material.

    Raises
    ------
    ValueError
        If the material is no Material.
    """

    shape: str
    material: Material
    body: np.ndarray
    radius: np.ndarray
    offset: np.ndarray | None = None
    direction: np.ndarray | None = None
    hull: np.ndarray | None = None
    hulls: object = None
    joint: bool = False  # ends of a joint, of its own material

    def __post_init__(self):
        if not isinstance(self.material, Material):
            raise ValueError(f"material is {self.material!r}: give a cairn.Material")

    def species(self, group):
        """Gives the names by which rules know the contactors.

        Parameters
        ----------
        group : str or None
            Group of the set; ends of joints are not in it.

        Returns
        -------
        tuple
            Material and group, the latter "" without one.
        """
        return self.material.name, self.material.name if self.joint else group or ""


@dataclass
class BodySet(Spelt):
    """A set of n bodies: arrays, not objects, as disks(...), wall(...) and others make them.

    Dofs are named vx, vy, w in 2D and vx, vy, vz, wx, wy, wz in 3D.

    Parameters
    ----------
    dim : int
        2 or 3.
    position : ndarray (n, dim)
        Centres of mass [m].
    mass : ndarray (n,)
        Masses [kg], inf for boundaries that are held.
    inertia : ndarray (n, 1) or (n, 3)
        Moment of inertia, or principal moments [kg m2].
    contactors : list of ContactorSet
        Contactors of the bodies.
    velocity : ndarray (n, dofs), optional
        Initial velocities and spins [m/s, rad/s]; those of driven dofs stay when `drive` is not given.
    rotation : ndarray (n,) or (n, 4), optional
        Angle [rad], or quaternion (w, x, y, z).
    group : str, optional
        Name by which rules know the bodies beside their material.
    driven : tuple of str
        Names of dofs whose velocity is imposed.
    drive : ndarray (n, dofs) or callable, optional
        That velocity, or a function of time that gives it; `velocity`, or 0, when not given.
    force : ndarray (n, dofs) or callable, optional
        Applied forces and torques [N, N m], or a function of time that gives them.
    damping : float or ndarray (n,), optional
        Rate of damping of the velocities [1/s].
    surface_velocity : array_like (dofs,) or (n, dofs), or callable, optional
        Velocity of the surface along the body, and its spin, of a belt or a roller [m/s, rad/s], or a function of time that
        gives them: friction sees a surface that moves, and the body stays where it is. In axes of space when the body comes in,
        with which it turns later on. Its part in the tangent plane of a contact acts; translations alone, (dim,), will do.
    surface_origin : array_like (dim,) or (n, dim), optional
        A point of the axis about which the surface turns [m]; the centre of mass when not given.
    ids : ndarray (n + parts,), optional
        Ids, given by Scene.add: bodies first, then parts.
    mesh : Deformable, optional
        The deformable body whose nodes or sides these are.
    depth : float, optional
        Thickness from which the masses in 2D were computed [m]; None if they were given.
    parts : int, default 0
        Number of points, edges or faces of the mesh, which have no mass: their rows follow those of the bodies.
    """

    dim: int
    position: np.ndarray
    mass: np.ndarray
    inertia: np.ndarray
    contactors: list[ContactorSet]
    velocity: np.ndarray | None = None
    rotation: np.ndarray | None = None
    group: str | None = None
    driven: tuple[str, ...] = ()
    drive: object = None
    force: object = None
    damping: float | np.ndarray | None = None
    surface_velocity: object = None
    surface_origin: np.ndarray | None = None
    ids: np.ndarray | None = field(default=None, compare=False)  # given by Scene.add: bodies first, then parts
    mesh: object = field(default=None, compare=False)  # the cairn.meshes.Deformable whose nodes or edges these are
    depth: float | None = None
    parts: int = 0  # points, edges or faces of the mesh, which have no mass: their rows follow those of the bodies

    def __post_init__(self):
        self._made = True

    def __len__(self):
        return len(self.position)

    def __repr__(self):
        from ..base.notebook import line_of_set

        return line_of_set(self)

    @property
    def own_ids(self):
        """Ids of its bodies, or of the nodes of its mesh, (n,)."""
        return self.ids[: len(self)]

    @property
    def mask(self):
        """Driven dofs as bits."""
        return sum(1 << DOFS[self.dim].index(name) for name in self.driven)

    @property
    def imposed(self):
        """Velocity of driven dofs, (n, dofs) or a function. It is `drive`, or `velocity` without it; None stands for zero."""
        if self.drive is not None or self.velocity is None or not self.driven:
            return self.drive
        chosen = np.isin(DOFS[self.dim], self.driven)
        return np.where(chosen, self.velocity, 0.0) if np.any(self.velocity[:, chosen]) else None

    @takes(*OPTIONS, "position", "mass", "inertia", "contactors", "ids", "mesh", "parts")
    def with_(self, **changes):
        """Makes a copy with some of its options changed.

        Parameters
        ----------
        **changes : array_like, str or callable
            Options by name, as in `disks(...).with_(group="layer 1", driven=("w",))`.

        Returns
        -------
        BodySet
            The copy.

        Raises
        ------
        ValueError
            If an option is wrong; the message names option, value and remedy.
        """
        return checked(replace(self, **changes))


def checked(s: BodySet) -> BodySet:
    """Checks the options of a set.

    Parameters
    ----------
    s : BodySet
        The set; its options become arrays of all bodies.

    Returns
    -------
    BodySet
        The set itself.

    Raises
    ------
    ValueError
        If an option is wrong; the message names option, value and remedy.
    """
    names = DOFS[s.dim]
    s.driven = (s.driven,) if isinstance(s.driven, str) else tuple(s.driven)
    for name in s.driven:
        if name not in names:
            raise ValueError(f"driven names {name!r}: the dofs of a body are {listed(names, name)}")
    if s.group is not None and (not isinstance(s.group, str) or not s.group or s.group == "*"):
        raise ValueError(f"group is {s.group!r}: give a non-empty string other than '*'")
    if s.rotation is not None:
        shape: tuple[int, ...] = (len(s),) if s.dim == 2 else (len(s), 4)
        s.rotation = checks.real_array("rotation", s.rotation, shape)
        short = np.flatnonzero(~np.any(s.rotation.reshape(len(s), -1), axis=1)) if s.dim == 3 else np.zeros(0, int)
        if len(short):
            raise ValueError(f"rotation[{short[0]}] is {s.rotation[short[0]]}: give a quaternion (w, x, y, z) of unit length")
    if s.velocity is not None:
        s.velocity = checks.speeds("velocity", spread("velocity", s.velocity, len(s), len(names), s.dim))
    if s.force is not None and s.mass is not None:
        _refuse_force_on_held(s)
    if callable(s.drive) and len(s.driven) == 1 and len(texts_of(s.drive) or ()) == 1:  # of the dof that is driven
        s.drive = Components(tuple(s.drive if name in s.driven else 0.0 for name in names))
    for name in ("drive", "force", "surface_velocity"):
        value = getattr(s, name)
        if name == "surface_velocity" and getattr(value, "needs_simulation", False):
            raise ValueError(f"{name} is a {type(value).__name__}, which is a force: give numbers, or a function of time")
        if name == "drive" and getattr(value, "needs_simulation", False):
            raise ValueError(f"velocity is a {type(value).__name__}, which is a force: give force=, with mass and free dofs")
        if callable(value) and not getattr(value, "needs_simulation", False):
            checks.function_of_time(name, value)
        if value is not None and not callable(value):
            value = spread(name, value, len(s), len(names), s.dim)
            setattr(s, name, value if name == "force" else checks.speeds(name, value))
    _tell_of_idle_drive(s)
    if s.surface_origin is not None:
        origin = checks.reals("surface_origin", s.surface_origin, f"give ({s.dim},) or ({len(s)}, {s.dim})")
        if origin.shape not in ((s.dim,), (len(s), s.dim)):
            raise ValueError(f"surface_origin has shape {origin.shape}: give ({s.dim},) or ({len(s)}, {s.dim})")
        if s.surface_velocity is None:
            raise ValueError("surface_origin is given without surface_velocity, whose spin turns about it: give both or none")
        origin = np.broadcast_to(origin, (len(s), s.dim)).copy()
        s.surface_origin = checks.real_array("surface_origin", origin, (len(s), s.dim))
    if s.damping is not None:
        damping = per_body("damping", s.damping, (len(s),))
        if not np.all((damping >= 0) & np.isfinite(damping)):
            at = int(np.argmin((damping >= 0) & np.isfinite(damping)))
            raise ValueError(f"damping[{at}] is {damping[at]}: give finite numbers >= 0 [1/s]")
        s.damping = damping
    return s


def _tell_of_idle_drive(s):
    """Warns of a drive of bodies whose dofs are all free, but for the initial velocity of a boundary."""
    if s.drive is None or s.driven or s.mass is None or s.mesh is not None:
        return
    if callable(s.drive) or (np.any(s.drive) and not np.array_equal(s.drive, s.velocity)):
        text = f"drive is given to bodies whose dofs are all free, and moves none: name a dof, driven={DOFS[s.dim][0]!r}"
        warnings.warn(text, UserWarning, stacklevel=5)


def _refuse_force_on_held(s):
    """Raises ValueError for a force without effect: on bodies that are held, or by a Servo whose normal has no free dof."""
    names, normal = DOFS[s.dim], getattr(s.force, "normal", None)
    if normal is not None and np.shape(normal) != (s.dim,):
        raise ValueError(f"force is a {type(s.force).__name__} with a normal of {np.size(normal)} components, and the bodies are "
                         f"in {s.dim}D: give its normal ({s.dim},)")  # fmt: skip
    if getattr(s.force, "needs_simulation", False) and np.shape(normal) == (s.dim,):
        free = [name for name in names[: s.dim] if name not in s.driven]
        if not np.any(np.isfinite(s.mass)) or not any(abs(normal[names.index(name)]) > 0 for name in free):
            along = tuple(name for name, x in zip(names, normal) if abs(x) > 0)
            kind, held = type(s.force).__name__, f"free are {', '.join(free)} alone" if free else "the body is held"
            remedy = f"give mass= and free={along[0] if len(along) == 1 else along!r}, or leave it out"
            raise ValueError(f"force is a {kind} along {' and '.join(along)}, and {held}: {remedy}")
    elif set(names) <= set(s.driven) and not np.any(np.isfinite(s.mass)):
        raise ValueError("force is given to a body that is held: give mass= and free= to let it move, or leave the force out")


def rows(name, value, n, dim):
    """Spreads a user's value over n bodies.

    Parameters
    ----------
    name : str
        Name of the value in messages.
    value : array_like
        A row (dofs,) or n rows; translations alone, (dim,), are padded with zero rotations.
    n : int
        Number of bodies.
    dim : int
        2 or 3.

    Returns
    -------
    ndarray (n, dofs)
        The rows.

    Raises
    ------
    ValueError
        If the value has another shape.
    """
    return spread(name, value, n, len(DOFS[dim]), dim)


def driven_at(dofs, velocity, n, dim):
    """Gives the velocities of all dofs from the arguments of Simulation.drive.

    Parameters
    ----------
    dofs : str or sequence of str
        Names of the driven dofs.
    velocity : float, array_like or callable
        A number for a single dof, velocities of all dofs, or a function of time.
    n : int
        Number of bodies.
    dim : int
        2 or 3.

    Returns
    -------
    ndarray, callable or None
        Velocities (dofs,) or (n, dofs), or the function of time; None without any, or for an unknown dof, which the set refuses.

    Raises
    ------
    ValueError
        If one number is given for several dofs, or none.
    """
    named = [dofs] if isinstance(dofs, str) else list(dofs)
    if velocity is None and any(named):
        raise ValueError(
            f"velocity of {', '.join(map(str, named))} is None: give 0.0 to hold, or no dofs, drive(ids, ()), to let go"
        )
    if velocity is None or callable(velocity) or np.ndim(velocity):
        return velocity if velocity is None or callable(velocity) else rows("velocity", velocity, n, dim)
    if len(named) != 1:
        told = f"one number is of one dof, and {len(named)} are named" if named else "no dof is named"
        raise ValueError(f"velocity is {velocity!r}: {told}; give ({len(DOFS[dim])},) of all dofs")
    if named[0] not in DOFS[dim]:
        return None  # the set refuses the unknown name later
    out = np.zeros(len(DOFS[dim]))
    out[DOFS[dim].index(named[0])] = checks.number("velocity", velocity)
    return out


def _points(centers, radii, dim):
    centers = checks.real_array("centers", centers, (None, dim))
    if np.ndim(radii) == 0:
        radii = np.full(len(centers), checks.positive("radii", radii))
    radii = checks.positive_array("radii", radii)
    if len(radii) != len(centers):
        raise ValueError(f"radii has {len(radii)} items and centers {len(centers)}: give one radius for each centre")
    return centers, radii


@takes(*OPTIONS)
def disks(centers, radii, material, *, density=None, depth=1.0, **options) -> BodySet:
    """Disks in 2D.

    Their mass is density pi r^2 depth.

    Parameters
    ----------
    centers : array_like (n, 2)
        Centres [m].
    radii : float or array_like (n,)
        Radii [m].
    material : Material
        Material of all of them.
    density : float, optional
        Mass per volume [kg/m3] in the place of that of the material.
    depth : float, default 1
        Thickness [m].
    **options : array_like, str or callable
        Options of BodySet: velocity, rotation, group, driven, drive, force, damping, surface_velocity, surface_origin.

    Returns
    -------
    BodySet
        The set, to be added to a scene.

    Raises
    ------
    ValueError
        If a value is wrong; the message names field, index, value and remedy.

    Examples
    --------
    >>> rock = cn.Material("rock", density=2800.0)
    >>> len(cn.disks([[0, 0], [1, 0]], 0.5, rock))
    2
    """
    centers, radii = _points(centers, radii, 2)
    with np.errstate(over="ignore"):  # an overflow is refused below, by positive_array
        mass = density_of(material, density) * np.pi * radii**2 * checks.positive("depth", depth)
    mass = checks.positive_array("mass", mass)
    contactors = [ContactorSet("disk", material, np.arange(len(radii)), radii)]
    return checked(BodySet(2, centers, mass, (mass * radii**2 / 2)[:, None], contactors, depth=float(depth), **options))


@takes(*OPTIONS)
def spheres(centers, radii, material, *, density=None, **options) -> BodySet:
    """Spheres in 3D.

    Their mass is 4/3 density pi r^3.

    Parameters
    ----------
    centers : array_like (n, 3)
        Centres [m].
    radii : float or array_like (n,)
        Radii [m].
    material : Material
        Material of all of them.
    density : float, optional
        Mass per volume [kg/m3] in the place of that of the material.
    **options : array_like, str or callable
        Options of BodySet: velocity, rotation, group, driven, drive, force, damping, surface_velocity, surface_origin.

    Returns
    -------
    BodySet
        The set, to be added to a scene.

    Raises
    ------
    ValueError
        If a value is wrong; the message names field, index, value and remedy.

    Examples
    --------
    >>> cn.spheres([[0, 0, 0], [2, 0, 0]], 0.5, cn.Material("rock", density=2800.0)).position.shape
    (2, 3)
    """
    centers, radii = _points(centers, radii, 3)
    with np.errstate(over="ignore"):
        mass = density_of(material, density) * 4 / 3 * np.pi * radii**3
    mass = checks.positive_array("mass", mass)
    inertia = np.repeat((0.4 * mass * radii**2)[:, None], 3, axis=1)
    contactors = [ContactorSet("sphere", material, np.arange(len(radii)), radii)]
    return checked(BodySet(3, centers, mass, inertia, contactors, **options))


@takes(*OPTIONS)
def clumps(positions, offsets, radii, mass, inertia, material, **options) -> BodySet:
    """Rigid bodies each made of the same disks (2D) or spheres (3D).

    cairn.pre.clump finds mass, centre and inertia of a clump from its parts. With a tensor of inertia the parts stand as they are
    given, in any axes. The bodies themselves have principal axes: their rotation is that from principal axes to space.

    Parameters
    ----------
    positions : array_like (n, dim)
        Centres of mass [m].
    offsets : array_like (m, dim)
        Centres of the parts from the centre of mass, in the axes of `inertia` [m].
    radii : float or array_like (m,)
        Radii of the parts [m].
    mass : float or array_like (n,)
        Mass of all or of each body [kg].
    inertia : float or array_like (n,), (3,), (n, 3), (1, 3, 3) or (n, 3, 3)
        Moment of inertia (2D) [kg m2], of all or of each body; in 3D three principal moments, the axes of `offsets` then being
        principal, or the tensor of inertia in the axes of `offsets`.
    material : Material
        Material of all of them.
    **options : array_like, str or callable
        Options of BodySet: velocity, rotation, group, driven, drive, force, damping, surface_velocity, surface_origin.

    Returns
    -------
    BodySet
        The set, to be added to a scene.

    Raises
    ------
    ValueError
        If a value is wrong; the message names field, index, value and remedy.

    Examples
    --------
    >>> cn.clumps([[0, 0]], [[-0.5, 0], [0.5, 0]], 0.5, 10.0, 3.0, cn.Material("rock")).dim
    2
    """
    shape = np.shape(offsets)
    dim = shape[-1] if len(shape) == 2 else 0
    if dim not in (2, 3):
        raise ValueError(f"offsets has shape {shape}: give (m, 2) or (m, 3)")
    offsets, radii = _points(offsets, radii, dim)
    positions = checks.real_array("positions", positions, (None, dim))
    n, m = len(positions), len(radii)
    masses = per_body("mass", mass, (n,))
    given = np.shape(inertia)
    if dim == 3 and given not in ((3,), (n, 3), (1, 3, 3), (n, 3, 3)):
        raise ValueError(f"inertia has shape {given}: a body in 3D has three principal moments, give (3,) of all or ({n}, 3) of "
                         f"each, or a tensor, (1, 3, 3) or ({n}, 3, 3) [kg m2]; cairn.pre.clump(centers, radii, density) finds "
                         "it, and mass and offsets")  # fmt: skip
    places = np.broadcast_to(offsets, (n, m, dim))
    if len(given) == 3:
        moments, axes = principal_frames("inertia", inertia, n)
        places = places @ axes
        if np.any(axes != np.eye(3)):
            options["rotation"] = _followed(options.get("rotation"), axes)
    else:
        moments = per_body("inertia", inertia, (n, 1 if dim == 2 else 3))
    parts = ContactorSet(
        "disk" if dim == 2 else "sphere",
        material,
        np.repeat(np.arange(n), m),
        np.tile(radii, n),
        places.reshape(n * m, dim).copy(),
    )
    return checked(BodySet(dim, positions, masses, moments, [parts], **options))


def _followed(rotation, axes):
    """Quaternions (n, 4) from principal axes (n, 3, 3) to space: to the axes of the user, then the rotation that he gives."""
    own = mass_properties.quaternions(axes)
    return own if rotation is None else quaternion_product(unit_quaternions("rotation", rotation, len(axes)), own)
