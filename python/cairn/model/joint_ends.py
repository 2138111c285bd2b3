"""Ends of joints: contactors that are put on bodies and on nodes of meshes where a joint holds them."""

from __future__ import annotations

import numpy as np

from . import bodies

END = 0.1  # radius of the contactor at an end of a joint, over the size of its body


def marks_of_cable(scene, places):
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


def place_of(scene, side, number):
    """(number of the set, row in it) of a body or of a node of a mesh."""
    if isinstance(number, (int, np.integer)) and not isinstance(number, bool):
        for k, s in enumerate(scene.sets):
            row = np.flatnonzero(s.own_ids == number)
            if len(row):
                return k, int(row[0])
    raise ValueError(f"{side} of a joint is {number!r}: give the number of a body or node that Scene.add returned")


def _size_of_mesh(s):
    return float(np.ptp(s.position, axis=0).max())


def check_on_node(scene, place, point):
    """Raises ValueError if the end of a joint is not at the position of its node."""
    k, row = place
    s = scene.sets[k]
    if np.abs(point - s.position[row]).max() > 1e-9 * _size_of_mesh(s):
        raise ValueError(
            f"point of a joint is {point}, and node {s.own_ids[row]} of {s.mesh.name!r} is at {s.position[row]}: "
            "give the place of the node, which is where a mesh is joined"
        )


def put_on_node(scene, place, mark):
    """Adds the end of a joint to a node of a mesh; returns the radius [m] for a contactor on the world at the other end."""
    k, row = place
    s = scene.sets[k]
    s.mesh.joints.append((mark.name, row))
    s.mesh.contact_nodes = np.union1d(s.mesh.contact_nodes, [row])
    scene.sets[k] = bodies.replace(s, contactors=[*s.contactors, end_on_node(scene.dim, mark, row)])
    return END * _size_of_mesh(s)


def end_on_node(dim, mark, row):
    """Makes the contactor of a joint on a node of a mesh.

    Parameters
    ----------
    dim : int
        2 or 3.
    mark : Material
        Material of the joint's own.
    row : int
        Number of the node in its mesh.

    Returns
    -------
    ContactorSet
        The contactor.
    """
    return bodies.ContactorSet("disk" if dim == 2 else "sphere", mark, np.array([row]), np.zeros(1), joint=True)


def put_on_body(scene, place, point, mark, turns):
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
