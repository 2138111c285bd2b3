"""Joints between two bodies, nodes of meshes or the world: `scene.join(a, b, cn.Hinge(point=(0, 0, 1), axis=(0, 1, 0)))`.

Points and axes are given in space, for the positions of the bodies when the joint is made. The joint coordinate is the motion of
the first body relative to the second: an angle about the axis by the right-hand rule [rad], a displacement along it [m], or a
length [m]. Angles and displacements begin at 0. Limits bound the coordinate, a motor drives it with a bounded torque or force, a
spring pulls it towards its rest value. A joint whose force exceeds its strength [N] is removed from the next step on. Nodes of
meshes have no rotation: joints on them hold displacements alone, and a Fixed or a Slider leaves the rotation of the other body
free.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import _core
from ..base import checks
from ..base.materials import Material
from . import bodies
from .joint_ends import check_on_node, marks_of_cable, place_of, put_on_body, put_on_node
from .laws import BY_NAME

ROWS = _core.joint_kinds()  # rows of cxx/scene/joints.def


@dataclass(frozen=True)
class Motor:
    """Drives the coordinate of a joint at a speed, with a bounded torque or force.

    Parameters
    ----------
    speed : float
        Speed of the coordinate [rad/s, m/s].
    effort : float
        Largest torque or force [N m, N].

    Raises
    ------
    ValueError
        If the speed is not finite or the effort not positive.
    """

    speed: float
    effort: float

    def __post_init__(self):
        checks.number("speed of Motor", self.speed)
        checks.positive("effort of Motor", self.effort)


@dataclass(frozen=True)
class Spring:
    """A spring with a dashpot along the coordinate of a joint.

    Parameters
    ----------
    stiffness : float
        Stiffness [N/m, N m/rad].
    damping : float, default 0
        Coefficient of the dashpot [N s/m, N m s/rad].
    rest : float, optional
        Coordinate without force [m, rad]; None: the initial one.

    Raises
    ------
    ValueError
        If stiffness or damping is negative.
    """

    stiffness: float
    damping: float = 0.0
    rest: float | None = None

    def __post_init__(self):
        for name, value in (("stiffness", self.stiffness), ("damping", self.damping)):
            if checks.number(f"{name} of Spring", value) < 0:
                raise ValueError(f"{name} of Spring is {value:g}: give a value from 0 on")
        if self.rest is not None:
            checks.number("rest of Spring", self.rest)


def _two(name, values):
    if not np.iterable(values) or isinstance(values, str) or len(values) != 2:
        raise ValueError(f"{name} is {values!r}: give the lowest and the highest, -inf or inf for none")
    return [checks.number(f"{name.replace(' of', f'[{k}] of', 1)}", x, finite=False) for k, x in enumerate(values)]


@dataclass(frozen=True, kw_only=True)
class JointKind:
    """Base of all joints.

    Parameters
    ----------
    strength : float, default inf
        Force at which the joint breaks [N].
    """

    strength: float = np.inf

    def __post_init__(self):
        if np.shape(getattr(self, "axis", None)) in ((2,), (3,)):
            self.axis_of(len(self.axis))

    def bits(self, dim):
        """Gives the components that the joint blocks.

        Parameters
        ----------
        dim : int
            2 or 3.

        Returns
        -------
        tuple
            Blocked components as bits, n, t [, s], then rotations; and number of the free coordinate from 1, 0 without.

        Raises
        ------
        ValueError
            If there is no such joint in this dimension.
        """
        row = ROWS[type(self).__name__]
        if row["blocked"][dim - 2] < 0:
            raise ValueError(f"{type(self).__name__} is a joint of {5 - dim}D: in {dim}D give {row['instead']}")
        return row["blocked"][dim - 2], row["coordinate"][dim - 2]

    def ends(self, dim):
        """Gives the points of the ends.

        Parameters
        ----------
        dim : int
            2 or 3.

        Returns
        -------
        ndarray (2, dim)
            Points of both ends [m]; for a Cable (3, dim), with its pulley in the middle.
        """
        point = checks.real_array(f"point of {type(self).__name__}", self.point, (dim,))
        return np.array([point, point])

    def begins_at(self, dim):
        """Gives the initial value of the coordinate.

        Parameters
        ----------
        dim : int
            2 or 3.

        Returns
        -------
        float
            The value [m, rad].
        """
        return 0.0

    def axis_of(self, dim):
        """Gives the axis of the joint.

        Parameters
        ----------
        dim : int
            2 or 3.

        Returns
        -------
        ndarray (dim,)
            Unit vector.

        Raises
        ------
        ValueError
            If the axis has no direction.
        """
        if not hasattr(self, "axis"):
            return np.eye(dim)[-1 if dim == 3 else 0]
        axis = checks.real_array(f"axis of {type(self).__name__}", self.axis, (dim,))
        size = np.linalg.norm(axis)
        if not size > 0:
            raise ValueError(f"axis of {type(self).__name__} is {self.axis}: give a direction")
        return axis / size

    def law(self, dim, swapped, on_mesh=False, marks=(0, 0)):
        """Makes the contact law between the ends.

        Parameters
        ----------
        dim : int
            2 or 3.
        swapped : bool
            True if the core takes the second body as the first.
        on_mesh : bool, default False
            True if an end is a node of a mesh.
        marks : tuple, default (0, 0)
            For a Cable, the numbers from 1 of its contactors at the pulley and at the end beyond the contact.

        Returns
        -------
        Law
            The law.

        Raises
        ------
        ValueError
            If limits, motor, spring or strength are wrong, or need a rotation that a node of a mesh has not.
        """
        own = type(self).__name__
        blocked, coordinate = self.bits(dim)
        if on_mesh:
            if coordinate > dim and (self.limits is not None or self.motor is not None or self.spring is not None):
                told = next(name for name in ("limits", "motor", "spring") if getattr(self, name) is not None)
                remedy = "leave it out, or join rigid bodies"
                raise ValueError(f"{told} of {own} is of an angle, and a node of a mesh has none: {remedy}")
            if isinstance(self, Hinge):
                raise ValueError("Hinge holds an axis, and a node of a mesh has none: give a Ball, or hinges at two nodes")
            blocked, coordinate = blocked & (2**dim - 1), coordinate if coordinate <= dim else 0
        low, high = -np.inf, self.spanned(dim) if isinstance(self, Cable) else np.inf
        if (limits := getattr(self, "limits", None)) is not None:
            low, high = _two(f"limits of {own}", limits)
            if not low <= high:
                raise ValueError(f"limits of {own} are {low:g} and {high:g}: give the lower one first")
            if isinstance(self, Hinge) and any(np.isfinite(x) and abs(x) > np.pi for x in (low, high)):
                raise ValueError(f"limits of Hinge are {low:g} and {high:g}: give angles from -pi to pi, or inf [rad]")
        motor = getattr(self, "motor", None)
        if motor is not None and not isinstance(motor, Motor):
            raise ValueError(f"motor of {own} is {motor!r}: give cairn.Motor(speed=..., effort=...)")
        speed, effort = (motor.speed, motor.effort) if motor is not None else (0.0, 0.0)
        spring = getattr(self, "spring", None)
        if spring is not None and not isinstance(spring, Spring):
            raise ValueError(f"spring of {own} is {spring!r}: give cairn.Spring(stiffness=..., damping=..., rest=...)")
        spring = Spring(0.0) if spring is None else spring
        rest = self.begins_at(dim) if spring.rest is None else spring.rest
        axis = np.zeros(3)
        axis[:dim] = self.axis_of(dim) * (-1 if swapped else 1)
        if swapped and dim == 2 and coordinate == 3:
            low, high, speed, rest = -high, -low, -speed, -rest
        strength = checks.number(f"strength of {own}", self.strength, finite=False)
        if not strength > 0:
            raise ValueError(f"strength of {own} is {strength:g}: give a force above 0 [N]")
        return BY_NAME["joint"](blocked=blocked, coordinate=coordinate, axis_x=axis[0], axis_y=axis[1], axis_z=axis[2],
                                lowest=low, highest=high, speed=speed, effort=effort, strength=strength,
                                spans=float(ROWS[own]["points"] > 1), stiffness=spring.stiffness,
                                damping=spring.damping, rest=rest, pulley=marks[0], far=marks[1])  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Ball(JointKind):
    """Spherical joint in 3D: two points stay together.

    Parameters
    ----------
    strength : float, default inf
        Force at which it breaks [N].
    point : array_like (3,)
        The common point [m].
    """

    point: object


@dataclass(frozen=True, kw_only=True)
class Hinge(JointKind):
    """Hinge in 3D: two points and an axis through them stay together.

    Parameters
    ----------
    strength : float, default inf
        Force at which it breaks [N].
    point : array_like (3,)
        The common point [m].
    axis : array_like (3,)
        Direction of the axis.
    limits : array_like (2,), optional
        Lowest and highest angle, from -pi to pi, or inf [rad].
    motor : Motor, optional
        Drives the angle.
    spring : Spring, optional
        Pulls the angle towards its rest.
    """

    point: object
    axis: object
    limits: object = None
    motor: Motor | None = None
    spring: Spring | None = None


@dataclass(frozen=True, kw_only=True)
class Pivot(JointKind):
    """Hinge in 2D: two points stay together.

    Parameters
    ----------
    strength : float, default inf
        Force at which it breaks [N].
    point : array_like (2,)
        The common point [m].
    limits : array_like (2,), optional
        Lowest and highest angle, counting whole turns [rad].
    motor : Motor, optional
        Drives the angle.
    spring : Spring, optional
        Pulls the angle towards its rest.
    """

    point: object
    limits: object = None
    motor: Motor | None = None
    spring: Spring | None = None


@dataclass(frozen=True, kw_only=True)
class Fixed(JointKind):
    """Rigid connection of two bodies.

    Parameters
    ----------
    strength : float, default inf
        Force at which it breaks [N].
    point : array_like (dim,)
        Where its force is evaluated, against strength [m].
    """

    point: object


@dataclass(frozen=True, kw_only=True)
class Slider(JointKind):
    """Prismatic joint: the first body slides along an axis of the second, without relative rotation.

    Parameters
    ----------
    strength : float, default inf
        Force at which it breaks [N].
    point : array_like (dim,)
        The common point at the start [m].
    axis : array_like (dim,)
        Direction of the axis.
    limits : array_like (2,), optional
        Lowest and highest displacement from the initial position [m].
    motor : Motor, optional
        Drives the displacement.
    spring : Spring, optional
        Pulls the displacement towards its rest.
    """

    point: object
    axis: object
    limits: object = None
    motor: Motor | None = None
    spring: Spring | None = None


@dataclass(frozen=True, kw_only=True)
class Distance(JointKind):
    """Keeps the distance of a point of the first body and a point of the second.

    Parameters
    ----------
    strength : float, default inf
        Force at which it breaks [N].
    points : array_like (2, dim)
        The points [m], which differ.
    limits : array_like (2,), optional
        Bounds of the distance [m], in the place of a constant one.
    spring : Spring, optional
        Pulls the distance towards a rest length, in the place of a constant one.
    """

    points: object
    limits: object = None
    spring: Spring | None = None

    def bits(self, dim):
        """Gives the components that the joint blocks: none if it has limits or a spring.

        Parameters
        ----------
        dim : int
            2 or 3.

        Returns
        -------
        tuple
            Blocked components as bits, and number of the free coordinate from 1.
        """
        return super().bits(dim) if self.limits is None and self.spring is None else (0, 1)

    def begins_at(self, dim):
        """Gives the initial distance.

        Parameters
        ----------
        dim : int
            2 or 3.

        Returns
        -------
        float
            The distance [m].
        """
        ends = self.ends(dim)
        return float(np.linalg.norm(ends[1] - ends[0]))

    def ends(self, dim):
        """Gives the points of the ends.

        Parameters
        ----------
        dim : int
            2 or 3.

        Returns
        -------
        ndarray (2, dim)
            The points [m].

        Raises
        ------
        ValueError
            If both points are the same, or a limit is not above 0.
        """
        points = checks.real_array("points of Distance", self.points, (2, dim))
        if not np.any(points[0] != points[1]):
            raise ValueError(f"points of Distance are both {points[0]}: give two that differ, or a Pivot or Ball")
        if self.limits is not None and not min(_two("limits of Distance", self.limits)) > 0:
            raise ValueError(f"limits of Distance are {self.limits}: give lengths above 0 [m]")
        return points


@dataclass(frozen=True, kw_only=True)
class Cable(JointKind):
    """An inextensible rope over a pulley without mass or friction.

    The path from its end on the first body over the pulley to its end on the second is at most `length`. Its tension is the same
    on both sides, pulls the pulley by their sum, and is zero while the rope is slack. An end may be a node of a mesh, but not
    both.

    Parameters
    ----------
    strength : float, default inf
        Tension at which it breaks [N].
    points : array_like (3, dim)
        Points on the first body, at the pulley and on the second body [m].
    length : float, optional
        Length of the rope [m]; None: that of the initial path.
    pulley : int, optional
        Id of the body that carries the pulley; None: the world.
    """

    points: object
    length: float | None = None
    pulley: int | None = None

    def ends(self, dim):
        """Gives the points of the ends and of the pulley.

        Parameters
        ----------
        dim : int
            2 or 3.

        Returns
        -------
        ndarray (3, dim)
            The points [m], the pulley in the middle.

        Raises
        ------
        ValueError
            If an end is at the pulley.
        """
        points = checks.real_array("points of Cable", self.points, (3, dim))
        for k in (0, 2):
            if not np.any(points[k] != points[1]):
                raise ValueError(f"points[{k}] and points[1] of Cable are both {points[1]}: give the pulley's apart from ends")
        return points

    def spanned(self, dim):
        """Gives the length of the rope.

        Parameters
        ----------
        dim : int
            2 or 3.

        Returns
        -------
        float
            Length as given, or that of the initial path, straight on each side of the pulley [m].

        Raises
        ------
        ValueError
            If the given length is less than that of the path.
        """
        span = float(np.linalg.norm(np.diff(self.ends(dim), axis=0), axis=1).sum())
        if self.length is None:
            return span
        if not checks.positive("length of Cable", self.length) >= span * (1 - 2**-30):
            raise ValueError(f"length of Cable is {self.length:g}: give at least the {span:g} m that it spans")
        return float(self.length)


KINDS = (Ball, Hinge, Pivot, Fixed, Slider, Distance, Cable)


def joined(scene, a, b, kind):
    """Adds a joint to a scene: contactors at its ends and a law between them.

    Parameters
    ----------
    scene : Scene
        The scene, or a stand-in with its sets and rules.
    a : int
        Id of a body or node.
    b : int or None
        Id of the other one; None: the world.
    kind : JointKind
        The joint.

    Returns
    -------
    str
        Name of the joint.

    Raises
    ------
    ValueError
        If there is no such body or node, both are the same, or the joint is wrong; the scene is then as it was.
    """
    if not isinstance(kind, JointKind):
        raise ValueError(f"joint is {kind!r}: give one of {', '.join('cairn.' + k.__name__ for k in KINDS)}")
    dim = scene.dim
    ends = kind.ends(dim)
    places = [place_of(scene, "a", a), None if b is None else place_of(scene, "b", b)]
    if places[0] == places[1]:
        raise ValueError(f"a and b of a joint are both body {a}: give two bodies, or b=None for the world")
    meshes = [scene.sets[place[0]].mesh for place in places if place is not None]
    if len(meshes) == 2 and meshes[0] is meshes[1] is not None:
        raise ValueError(f"a and b of a joint are {a} and {b}, nodes of one mesh: join nodes of two, or add a cell")
    marks = (0, 0)
    if isinstance(kind, Cable):
        places.insert(1, None if kind.pulley is None else place_of(scene, "pulley", kind.pulley))
        marks = marks_of_cable(scene, places)
    law = kind.law(dim, places[-1] is not None and places[0][0] > places[-1][0], any(mesh is not None for mesh in meshes), marks)
    name = f"joint {sum(law is not None and law.name == 'joint' for _, _, law in scene.rules)}"
    mark = Material(name)
    for place, point in zip(places, ends):  # checks all ends first, so that a refused joint leaves the scene unchanged
        if place is not None and scene.sets[place[0]].mesh is not None:
            check_on_node(scene, place, point)
    for place, point in zip(places, ends):
        if place is not None:
            if scene.sets[place[0]].mesh is not None:
                size = put_on_node(scene, place, mark)
            else:
                size = put_on_body(scene, place, point, mark, ROWS[type(kind).__name__]["turns"])
            continue
        end = bodies.ContactorSet("disk" if dim == 2 else "sphere", mark, np.array([0]), np.array([size]), joint=True)
        scene.add(bodies.checked(bodies.BodySet(dim, point[None], np.ones(1), np.ones((1, 1 if dim == 2 else 3)), [end],
                                                driven=bodies.DOFS[dim])))  # fmt: skip
    scene.interact(name, "*", None)
    scene.interact(name, name, law)
    return name
