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
from .laws import BY_NAME

END = 0.1  # radius of the contactor at an end of a joint, over the size of its body
ROWS = _core.joint_kinds()  # rows of cxx/scene/joints.def


@dataclass(frozen=True)
class Motor:
    """Drives the coordinate of a joint at a speed [rad/s, m/s], with a torque or force up to `effort` [N m, N]."""

    speed: float
    effort: float

    def __post_init__(self):
        checks.number("speed of Motor", self.speed)
        checks.positive("effort of Motor", self.effort)


@dataclass(frozen=True)
class Spring:
    """A spring with a dashpot along the coordinate of a joint: stiffness [N/m, N m/rad], damping [N s/m, N m s/rad]; rest:
    coordinate without force [m, rad], None for the initial coordinate."""

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
    """Base of all joints. strength [N]: force at which the joint breaks."""

    strength: float = np.inf

    def __post_init__(self):
        if np.shape(getattr(self, "axis", None)) in ((2,), (3,)):
            self.axis_of(len(self.axis))

    def bits(self, dim):
        """(blocked components as bits: n, t [, s], then rotations; number of the free coordinate from 1, 0 without)."""
        row = ROWS[type(self).__name__]
        if row["blocked"][dim - 2] < 0:
            raise ValueError(f"{type(self).__name__} is a joint of {5 - dim}D: in {dim}D give {row['instead']}")
        return row["blocked"][dim - 2], row["coordinate"][dim - 2]

    def ends(self, dim):
        """Points of both ends (2, dim) [m]; for a Cable (3, dim), with its pulley in the middle."""
        point = checks.real_array(f"point of {type(self).__name__}", self.point, (dim,))
        return np.array([point, point])

    def begins_at(self, dim):
        """Initial value of the coordinate [m, rad]."""
        return 0.0

    def axis_of(self, dim):
        """Unit vector (dim,) of the axis of the joint."""
        if not hasattr(self, "axis"):
            return np.eye(dim)[-1 if dim == 3 else 0]
        axis = checks.real_array(f"axis of {type(self).__name__}", self.axis, (dim,))
        size = np.linalg.norm(axis)
        if not size > 0:
            raise ValueError(f"axis of {type(self).__name__} is {self.axis}: give a direction")
        return axis / size

    def law(self, dim, swapped, on_mesh=False, marks=(0, 0)):
        """Contact law between the ends. swapped: the core takes the second body as the first; on_mesh: an end is a node of a
        mesh; marks: for a Cable, the numbers from 1 of its contactors at the pulley and at the end beyond the contact."""
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
    """Spherical joint in 3D: two points stay together."""

    point: object


@dataclass(frozen=True, kw_only=True)
class Hinge(JointKind):
    """Hinge in 3D: two points and an axis through them stay together. limits: angles from -pi to pi [rad]."""

    point: object
    axis: object
    limits: object = None
    motor: Motor | None = None
    spring: Spring | None = None


@dataclass(frozen=True, kw_only=True)
class Pivot(JointKind):
    """Hinge in 2D: two points stay together. limits: angles, counting whole turns [rad]."""

    point: object
    limits: object = None
    motor: Motor | None = None
    spring: Spring | None = None


@dataclass(frozen=True, kw_only=True)
class Fixed(JointKind):
    """Rigid connection of two bodies; point: where its force is evaluated, against strength."""

    point: object


@dataclass(frozen=True, kw_only=True)
class Slider(JointKind):
    """Prismatic joint: the first body slides along an axis of the second, without relative rotation. limits: displacements from
    the initial position [m]."""

    point: object
    axis: object
    limits: object = None
    motor: Motor | None = None
    spring: Spring | None = None


@dataclass(frozen=True, kw_only=True)
class Distance(JointKind):
    """Keeps the distance of a point of the first body and a point of the second. limits: bounds the distance instead [m]; spring:
    pulls it towards a rest length instead."""

    points: object
    limits: object = None
    spring: Spring | None = None

    def bits(self, dim):
        return super().bits(dim) if self.limits is None and self.spring is None else (0, 1)

    def begins_at(self, dim):
        ends = self.ends(dim)
        return float(np.linalg.norm(ends[1] - ends[0]))

    def ends(self, dim):
        points = checks.real_array("points of Distance", self.points, (2, dim))
        if not np.any(points[0] != points[1]):
            raise ValueError(f"points of Distance are both {points[0]}: give two that differ, or a Pivot or Ball")
        if self.limits is not None and not min(_two("limits of Distance", self.limits)) > 0:
            raise ValueError(f"limits of Distance are {self.limits}: give lengths above 0 [m]")
        return points


@dataclass(frozen=True, kw_only=True)
class Cable(JointKind):
    """An inextensible rope over a pulley without mass or friction: the path from its end on the first body over the pulley to its
    end on the second is at most `length`. Its tension is the same on both sides, pulls the pulley by their sum, and is zero
    while the rope is slack.

    points (3, dim) [m]: on the first body, at the pulley, on the second body; length [m], None: the initial length of the path;
    pulley: number of the body that carries it, None: the world. strength: tension at which it breaks [N]. An end may be a node
    of a mesh, but not both."""

    points: object
    length: float | None = None
    pulley: int | None = None

    def ends(self, dim):
        points = checks.real_array("points of Cable", self.points, (3, dim))
        for k in (0, 2):
            if not np.any(points[k] != points[1]):
                raise ValueError(f"points[{k}] and points[1] of Cable are both {points[1]}: give the pulley's apart from ends")
        return points

    def spanned(self, dim):
        """Length of the rope [m]: as given, or that of the initial path, straight on each side of the pulley."""
        span = float(np.linalg.norm(np.diff(self.ends(dim), axis=0), axis=1).sum())
        if self.length is None:
            return span
        if not checks.positive("length of Cable", self.length) >= span * (1 - 2**-30):
            raise ValueError(f"length of Cable is {self.length:g}: give at least the {span:g} m that it spans")
        return float(self.length)


KINDS = (Ball, Hinge, Pivot, Fixed, Slider, Distance, Cable)


def joined(scene, a, b, kind):
    """Adds a joint to a scene: contactors at its ends and a law between them; b None: the world. Returns its name."""
    if not isinstance(kind, JointKind):
        raise ValueError(f"joint is {kind!r}: give one of {', '.join('cairn.' + k.__name__ for k in KINDS)}")
    dim = scene.dim
    ends = kind.ends(dim)
    places = [_place(scene, "a", a), None if b is None else _place(scene, "b", b)]
    if places[0] == places[1]:
        raise ValueError(f"a and b of a joint are both body {a}: give two bodies, or b=None for the world")
    meshes = [scene.sets[place[0]].mesh for place in places if place is not None]
    if len(meshes) == 2 and meshes[0] is meshes[1] is not None:
        raise ValueError(f"a and b of a joint are {a} and {b}, nodes of one mesh: join nodes of two, or add a cell")
    marks = (0, 0)
    if isinstance(kind, Cable):
        places.insert(1, None if kind.pulley is None else _place(scene, "pulley", kind.pulley))
        marks = _marks_of_cable(scene, places)
    law = kind.law(dim, places[-1] is not None and places[0][0] > places[-1][0], any(mesh is not None for mesh in meshes), marks)
    name = f"joint {sum(law is not None and law.name == 'joint' for _, _, law in scene.rules)}"
    mark = Material(name)
    for place, point in zip(places, ends):  # checks all ends first, so that a refused joint leaves the scene unchanged
        if place is not None and scene.sets[place[0]].mesh is not None:
            _check_on_node(scene, place, point)
    for place, point in zip(places, ends):
        if place is not None:
            if scene.sets[place[0]].mesh is not None:
                size = _put_on_node(scene, place, mark)
            else:
                size = _put(scene, place, point, mark, ROWS[type(kind).__name__]["turns"])
            continue
        end = bodies.ContactorSet("disk" if dim == 2 else "sphere", mark, np.array([0]), np.array([size]), joint=True)
        scene.add(bodies.checked(bodies.BodySet(dim, point[None], np.ones(1), np.ones((1, 1 if dim == 2 else 3)), [end],
                                                driven=bodies.DOFS[dim])))  # fmt: skip
    scene.interact(name, "*", None)
    scene.interact(name, name, law)
    return name


def _marks_of_cable(scene, places):
    """Numbers from 1, in the order of their bodies, of the contactors at the pulley and at the end beyond it. The near end and
    the pulley are the two sides of the contact; at least one of them moves. The end beyond the pulley must be on a rigid body, so
    a node of a mesh is taken as the near end."""
    sets = [None if place is None else scene.sets[place[0]] for place in places]
    nodes = [s is not None and s.mesh is not None for s in sets]
    if nodes[1]:
        number = sets[1].own_ids[places[1][1]]
        raise ValueError(f"pulley of Cable is {number}, a node of a mesh: give a rigid body, or leave it out: the world")
    if nodes[0] and nodes[2]:
        one, other = (sets[k].own_ids[places[k][1]] for k in (0, 2))
        raise ValueError(f"a and b of Cable are {one} and {other}, nodes of meshes: give one end a rigid body, or the world")
    moves = [node or (s is not None and not set(bodies.DOFS[scene.dim]) <= set(s.driven)) for s, node in zip(sets, nodes)]
    if any(x is not None and x == y for x, y in ((places[0], places[1]), (places[1], places[2]))):
        raise ValueError("the pulley of Cable is on a body of one of its ends: give a Distance, or another body")
    if not any(moves):
        raise ValueError("a, b and the pulley of Cable do not move: give one that does")
    far = 0 if nodes[2] or not (moves[0] or moves[1]) else 2
    # contactors on the world are inserted after all others, in this order
    order = sorted(range(3), key=lambda k: (places[k] is None, places[k] or (), k))
    return order.index(1) + 1, order.index(far) + 1


def _place(scene, side, number):
    """(number of the set, row in it) of a body or of a node of a mesh."""
    if isinstance(number, (int, np.integer)) and not isinstance(number, bool):
        for k, s in enumerate(scene.sets):
            row = np.flatnonzero(s.own_ids == number)
            if len(row):
                return k, int(row[0])
    raise ValueError(f"{side} of a joint is {number!r}: give the number of a body or node that Scene.add returned")


def _size_of_mesh(s):
    return float(np.ptp(s.position, axis=0).max())


def _check_on_node(scene, place, point):
    """Raises ValueError if the end of a joint is not at the position of its node."""
    k, row = place
    s = scene.sets[k]
    if np.abs(point - s.position[row]).max() > 1e-9 * _size_of_mesh(s):
        raise ValueError(
            f"point of a joint is {point}, and node {s.own_ids[row]} of {s.mesh.name!r} is at {s.position[row]}: "
            "give the place of the node, which is where a mesh is joined"
        )


def _put_on_node(scene, place, mark):
    """Adds the end of a joint to a node of a mesh; returns the radius [m] for a contactor on the world at the other end."""
    k, row = place
    s = scene.sets[k]
    s.mesh.joints.append((mark.name, row))
    s.mesh.contact_nodes = np.union1d(s.mesh.contact_nodes, [row])
    scene.sets[k] = bodies.replace(s, contactors=[*s.contactors, end_on_node(scene.dim, mark, row)])
    return END * _size_of_mesh(s)


def end_on_node(dim, mark, row):
    """Contactor of a joint on a node of a mesh."""
    return bodies.ContactorSet("disk" if dim == 2 else "sphere", mark, np.array([row]), np.zeros(1), joint=True)


def _put(scene, place, point, mark, turns):
    """Adds the end of a joint to a body; returns the radius of its contactor [m]. turns: the joint needs the rotation of its
    bodies, so that disks and spheres get a rotation as well."""
    k, row = place
    s = scene.sets[k]
    size = 0.0
    for c in s.contactors:
        for m in np.flatnonzero(c.body == row):
            if c.hulls is not None:
                first = c.hulls.first_vertex[c.hull[m] : c.hull[m] + 2]
                size = max(size, float(np.linalg.norm(c.hulls.vertex[first[0] : first[1]], axis=1).max()))
            elif c.radius is not None:
                size = max(size, float(c.radius[m]))
    lever = point - s.position[row]
    if s.rotation is not None:
        lever = _turned_back(s.rotation[row], lever)
    radius = END * size if size > 0 else END
    end = bodies.ContactorSet("disk" if scene.dim == 2 else "sphere", mark, np.array([row]), np.array([radius]),
                              offset=lever[None], joint=True)  # fmt: skip
    rotation = s.rotation
    if turns and rotation is None:
        rotation = np.zeros(len(s.position)) if scene.dim == 2 else np.tile([1.0, 0.0, 0.0, 0.0], (len(s.position), 1))
    scene.sets[k] = bodies.replace(s, contactors=[*s.contactors, end], rotation=rotation)
    return radius


def _turned_back(rotation, x):
    if np.ndim(rotation) == 0:
        c, s = np.cos(rotation), np.sin(rotation)
        return np.array([c * x[0] + s * x[1], c * x[1] - s * x[0]])
    q = rotation / np.linalg.norm(rotation)
    once = np.cross(-q[1:], x)
    return x + 2 * (q[0] * once + np.cross(-q[1:], once))
