"""Sets of bodies with flat faces: polygons, polyhedra, boxes. Mass, centre and inertia follow from the shape, exactly.

A body is one convex shape, or several convex parts. Shapes that repeat are stored once.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..base import checks
from ..names import takes
from ..pre import mass_properties as exact
from ..pre import mesh as surface
from ..pre.blocks import MAKERS
from .bodies import DOFS, OPTIONS, BodySet, ContactorSet, checked
from .body_values import density_of, quaternion_product, turned_by, unit_quaternions


class Hulls(NamedTuple):
    """Convex shapes stored together: n of them.

    Parameters
    ----------
    vertex : ndarray (v, dim)
        Vertices from the centre of the contactor, in the axes of the body [m].
    first_vertex : ndarray (n + 1,)
        First vertex of each shape, and their number.
    first_face : ndarray (n + 1,)
        First face of each polyhedron; empty for polygons.
    first_corner : ndarray (f + 1,)
        First corner of each face; empty for polygons.
    corner : ndarray (c,)
        Vertices of each face, numbered from 0 within the shape, anticlockwise from outside; empty for polygons.
    facets : bool, default False
        True if each shape is the triangle (0, 1, 2) of a surface, with its neighbours.
    plane : ndarray (f, 4)
        Rows of normal and offset of round shapes, which have no corners.
    ball : ndarray (n,)
        Radii of the circumscribed balls of round shapes [m].
    """

    vertex: np.ndarray
    first_vertex: np.ndarray
    first_face: np.ndarray
    first_corner: np.ndarray
    corner: np.ndarray
    facets: bool = False  # True: each is triangle (0, 1, 2) of a surface, with its neighbours
    # round shapes, which have no corners: rows of normal and offset (f, 4), and radii of circumscribed balls (n,) [m]
    plane: np.ndarray = np.zeros((0, 4))
    ball: np.ndarray = np.zeros(0)

    def __len__(self):
        return len(self.first_vertex) - 1


@takes(*OPTIONS)
def polygons(vertices, material, *, position=None, rotation=None, fixed=False, density=None, depth=1.0, **options) -> BodySet:
    """Polygons in 2D, in either orientation.

    Their mass is density area depth.

    Parameters
    ----------
    vertices : array_like (m, 2) or list of array_like (m, 2)
        Vertices of each body [m], or one array for all bodies at `position`. A body that is not convex is a list of convex
        arrays, as cairn.pre.convex_parts makes it. Without position, vertices are in space.
    material : Material
        Material of all of them.
    position : array_like (n, 2), optional
        Place of the origin of the coordinates of the vertices [m].
    rotation : array_like (n,), optional
        Angle about it [rad].
    fixed : bool, default False
        True for bodies that do not move.
    density : float, optional
        Mass per volume [kg/m3] in the place of that of the material.
    depth : float, default 1
        Thickness [m].
    **options : array_like, str or callable
        Options of BodySet: velocity, group, driven, drive, force, damping.

    Returns
    -------
    BodySet
        The set, to be added to a scene.

    Raises
    ------
    ValueError
        If a polygon is not convex, flat or crosses itself, or another value is wrong.

    Examples
    --------
    >>> rock = cn.Material("rock", density=2800.0)
    >>> cn.polygons([[0, 0], [1, 0], [0, 1]], rock, position=[[0, 0], [5, 0]]).mass
    array([1400., 1400.])
    """
    bodies, which = _bodies("vertices", vertices, position, _is_outline)
    bodies = [[_polygon(f"vertices[{k}]", x) for x in parts] for k, parts in enumerate(bodies)]
    flat = [x for parts in bodies for x in parts]
    own = exact.polygons(flat)
    owner = np.repeat(np.arange(len(bodies)), [len(parts) for parts in bodies])
    area = np.bincount(owner, own.measure)
    center = np.stack([np.bincount(owner, own.measure * own.center[:, k]) for k in range(2)], axis=1) / area[:, None]
    away = own.center - center[owner]
    moment = np.bincount(owner, own.moments[:, 0] + own.measure * np.sum(away * away, axis=1))
    middles = [_middle(x) for x in flat]
    local = [x - m for x, m in zip(flat, middles)] if len(flat) > len(bodies) else [x - c for x, c in zip(flat, center)]
    offset = np.array(middles) - center[owner] if len(flat) > len(bodies) else None
    mass = density_of(material, density) * checks.positive("depth", depth) * area
    hulls = Hulls(np.concatenate(local), _starts(local), *(np.zeros(0, np.int64),) * 3)
    place, angle = center, None
    if position is not None:
        n = len(which)
        angle = np.zeros(n) if rotation is None else checks.real_array("rotation", rotation, (n,))
        cosine, sine, c = np.cos(angle)[:, None], np.sin(angle)[:, None], center[which]
        place = checks.real_array("position", position, (n, 2)) + cosine * c + sine * np.stack([-c[:, 1], c[:, 0]], axis=1)
    elif rotation is not None:
        raise ValueError("rotation is given without position: give the place about which each polygon turns")
    contactors = _contactors("polygon", material, hulls, owner, which, offset)
    scale = mass / area
    inertia = (moment * scale)[which, None]
    angle = angle if rotation is not None else None
    return _body_set(2, place, mass[which], inertia, contactors, angle, fixed, options, depth=float(depth))


@takes(*OPTIONS)
def polyhedra(meshes, material, *, position=None, rotation=None, fixed=False, density=None, **options) -> BodySet:
    """Convex polyhedra, or bodies of several convex parts, in 3D.

    Parameters
    ----------
    meshes : tuple or list
        Mesh (vertices (m, 3) [m], faces) of each body, or one mesh for all bodies at `position`; objects with `vertices` and
        `faces` are meshes, too. Faces are (k, 3) triangles or lists of vertices, numbered from 0, anticlockwise from outside;
        coplanar triangles are merged to a face. A body that is not convex is a list of convex meshes, as cairn.pre.convex_parts
        makes it. Without position, vertices are in space.
    material : Material
        Material of all of them.
    position : array_like (n, 3), optional
        Place of the origin of the coordinates of the vertices [m].
    rotation : array_like (n, 4), optional
        Quaternion (w, x, y, z) of the rotation about it.
    fixed : bool, default False
        True for bodies that do not move.
    density : float, optional
        Mass per volume [kg/m3] in the place of that of the material.
    **options : array_like, str or callable
        Options of BodySet: velocity, group, driven, drive, force, damping.

    Returns
    -------
    BodySet
        The set, to be added to a scene.

    Raises
    ------
    ValueError
        If a mesh is open or not convex, or another value is wrong.
    """
    bodies, which = _bodies("meshes", meshes, position, _is_mesh)
    bodies = [[_mesh(f"meshes[{k}]", m) for m in parts] for k, parts in enumerate(bodies)]
    owner = np.repeat(np.arange(len(bodies)), [len(parts) for parts in bodies])
    flat = [m for parts in bodies for m in parts]
    _closed(flat, owner)
    own = exact.polyhedra([_joined_points(parts) for parts in bodies], [_joined_faces(parts) for parts in bodies])
    several = len(flat) > len(bodies)
    middles = [_middle(v) if several else own.center[k] for (v, _), k in zip(flat, owner)]
    local = [(v - m) @ own.axes[k] for (v, _), m, k in zip(flat, middles, owner)]
    offset = np.einsum("ni,nij->nj", np.array(middles) - own.center[owner], own.axes[owner]) if several else None
    faces = [f for _, f in flat]
    sizes = np.concatenate([[len(c) for c in f] for f in faces])
    corner = np.concatenate([np.concatenate([np.asarray(c, np.int64) for c in f]) for f in faces])
    hulls = Hulls(np.concatenate(local), _starts(local), _starts(faces), np.concatenate([[0], np.cumsum(sizes)]), corner)
    mass = density_of(material, density) * own.measure
    inertia = own.moments * (mass / own.measure)[:, None]
    turned = rotation is not None or np.any(own.axes != np.eye(3))
    quaternion = exact.quaternions(own.axes)[which] if turned else None
    place = own.center[which]
    if position is not None:
        n = len(which)
        place = checks.real_array("position", position, (n, 3)) + (
            place if rotation is None else turned_by(unit_quaternions("rotation", rotation, n), place)
        )
    if rotation is not None:
        if position is None:
            raise ValueError("rotation is given without position: give the place about which each polyhedron turns")
        quaternion = quaternion_product(unit_quaternions("rotation", rotation, len(which)), quaternion)
    contactors = _contactors("polyhedron", material, hulls, owner, which, offset)
    return _body_set(3, place, mass[which], inertia[which], contactors, quaternion, fixed, options)


def with_corners(blocks, material) -> BodySet:
    """Adds a point at every corner of polyhedra, for contact with the faces of deformable bodies in 3D.

    Call scene.interact(corners, "*", None) first, then give a law between corners and the material of the faces. Give no law
    between the polyhedra and these faces, so that contact is not counted twice; other bodies touch the polyhedra.

    Parameters
    ----------
    blocks : BodySet
        Polyhedra or boxes.
    material : Material
        Material of the points.

    Returns
    -------
    BodySet
        A copy of the set with the points.

    Raises
    ------
    ValueError
        If a contactor of the set is no polyhedron.
    """
    more = []
    for c in blocks.contactors:
        if c.shape != "polyhedron":
            raise ValueError(f"a contactor is a {c.shape}: give a set of polyhedra, or boxes")
        first = c.hulls.first_vertex
        corners = [c.hulls.vertex.reshape(-1, 3)[first[h] : first[h + 1]] for h in c.hull]
        place = np.concatenate(corners) + (0.0 if c.offset is None else np.repeat(c.offset, [len(v) for v in corners], axis=0))
        body = np.repeat(c.body, [len(v) for v in corners])
        more.append(ContactorSet("sphere", material, body, np.zeros(len(body)), place))
    return replace(blocks, contactors=[*blocks.contactors, *more])


_CORNERS = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], float)
_FACES = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])


@takes(*OPTIONS)
def boxes(centers, sizes, material, *, rotation=None, fixed=False, density=None, **options) -> BodySet:
    """Boxes in 3D.

    Boxes of the same sizes share a shape.

    Parameters
    ----------
    centers : array_like (n, 3)
        Centres [m].
    sizes : array_like (3,) or (n, 3)
        Whole edges [m].
    material : Material
        Material of all of them.
    rotation : array_like (n, 4), optional
        Quaternions (w, x, y, z).
    fixed : bool, default False
        True for bodies that do not move.
    density : float, optional
        Mass per volume [kg/m3] in the place of that of the material.
    **options : array_like, str or callable
        Options of BodySet: velocity, group, driven, drive, force, damping.

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
    >>> cn.boxes([[0, 0, 0]], (1, 2, 3), cn.Material("rock", density=1000.0)).mass.tolist()
    [6000.0]
    """
    centers = checks.real_array("centers", centers, (None, 3))
    n = len(centers)
    sizes = checks.spread("sizes", sizes, (n, 3), " [m]")
    if not np.all(sizes > 0):
        at = np.argwhere(~(sizes > 0))[0]
        raise ValueError(f"sizes[{at[0]}] is {sizes[at[0]]}: give lengths > 0 [m]")
    mass = checks.positive_array("mass", density_of(material, density) * np.prod(sizes, axis=1))
    square = sizes * sizes
    inertia = mass[:, None] / 12 * (np.roll(square, 1, axis=1) + np.roll(square, 2, axis=1))
    different, which = np.unique(sizes, axis=0, return_inverse=True)
    which = which.reshape(-1)
    m = len(different)
    vertex = (different[:, None, :] / 2 * _CORNERS).reshape(-1, 3)
    hulls = Hulls(
        vertex, 8 * np.arange(m + 1), 6 * np.arange(m + 1), 4 * np.arange(6 * m + 1), np.tile(_FACES.reshape(-1), m)
    )
    quaternion = None if rotation is None else unit_quaternions("rotation", rotation, n)
    contactors = _contactors("polyhedron", material, hulls, np.arange(m), which, None)
    return _body_set(3, centers, mass, inertia, contactors, quaternion, fixed, options)


# ------------------------------------------------------------------ shared helpers


def _body_set(dim, place, mass, inertia, contactors, rotation, fixed, options, depth=None):
    if checks.flag("fixed", fixed):
        if options.get("driven") or options.get("drive") is not None:
            raise ValueError("fixed is given with driven or drive: give one of them")
        if np.any(options.get("velocity")):
            remedy = f"give driven={DOFS[dim]!r} in place of fixed to move them at it, or leave velocity out"
            raise ValueError(f"velocity is given to bodies that are fixed: {remedy}")
        options = options | {"driven": DOFS[dim]}
    mass = checks.positive_array("mass", mass)
    return checked(BodySet(dim, place, mass, inertia, [contactors], rotation=rotation, depth=depth, **options))


def _bodies(name, given, position, is_shape):
    """(list of convex parts of each different body, number in this list of each body of the set (n,))."""
    if is_shape(given):
        bodies = [[given]]
    else:
        try:
            bodies = [[b] if is_shape(b) else list(b) for b in given]
        except TypeError:
            raise ValueError(f"{name} is {type(given).__name__}: give a list with one item for each body") from None
        for k, parts in enumerate(bodies):
            if not parts or not all(is_shape(p) for p in parts):
                due = "an array of corners (m, 2)" if is_shape is _is_outline else "a mesh, (vertices (m, 3), faces)"
                raise ValueError(f"{name}[{k}] is no shape and no list of shapes: give {due}, or a list of such convex parts")
    if not bodies:
        raise ValueError(f"{name} is empty: give at least one body")
    if position is None:
        return bodies, np.arange(len(bodies))
    n = len(np.atleast_2d(position))
    if len(bodies) not in (1, n):
        raise ValueError(f"position has {n} items and {name} {len(bodies)}: give one place for each body")
    return bodies, np.arange(n) if len(bodies) == n else np.zeros(n, np.int64)


def _is_outline(x):
    try:
        return np.ndim(x) == 2 and np.shape(x)[1] == 2
    except ValueError:  # outlines of several lengths make no array
        return False


def _is_mesh(x):
    return (isinstance(x, tuple) and len(x) == 2) or (hasattr(x, "vertices") and hasattr(x, "faces"))


def _mesh(name, x):
    vertices, faces = x if isinstance(x, tuple) else (x.vertices, x.faces)
    vertices = checks.real_array(f"{name}, vertices", np.asarray(vertices), (None, 3))
    faces = [np.asarray(f, np.int64) for f in faces]
    for k, f in enumerate(faces):
        if f.ndim != 1 or len(f) < 3 or np.any((f < 0) | (f >= len(vertices))):
            raise ValueError(f"{name}, faces[{k}] is {f}: give three or more vertices numbered 0 to {len(vertices) - 1}")
    return vertices, faces


def _closed(flat, owner):
    """Refuses the first mesh that has an edge without two faces: its volume would mean nothing."""
    faces = [(f, k) for k, (_, faces) in enumerate(flat) for f in faces]
    size = np.array([len(f) for f, _ in faces])
    first = np.concatenate([[0], np.cumsum([len(v) for v, _ in flat])])
    start = np.concatenate([f for f, _ in faces]) + np.repeat(first[[k for _, k in faces]], size)
    last = np.cumsum(size) - 1
    stop = np.roll(start, -1)
    stop[last] = start[last - size + 1]
    forward, backward = np.sort(start * first[-1] + stop), np.sort(stop * first[-1] + start)
    odd = np.flatnonzero(forward != backward)
    if len(odd):
        k = int(np.searchsorted(first, min(forward[odd[0]], backward[odd[0]]) // first[-1], side="right")) - 1
        surface.refuse_open(f"meshes[{owner[k]}]", exact.triangles(flat[k][1], len(flat[k][0])))


def _polygon(name, x):
    x = checks.real_array(name, x, (None, 2))
    d = x - x[0]
    follower = np.roll(d, -1, axis=0)
    fans = d[:, 0] * follower[:, 1] - d[:, 1] * follower[:, 0]
    x, fans = (x[::-1], -fans) if np.sum(fans) < 0 else (x, fans)
    # convex: fans from the first corner have positive areas, and every corner turns left. Without this check the kernel would
    # take the hull of a star or a dart
    edge = np.roll(x, -1, axis=0) - x
    turns = edge[:, 0] * np.roll(edge[:, 1], -1) - edge[:, 1] * np.roll(edge[:, 0], -1)
    if len(x) and min(np.min(fans), np.min(turns)) < -1e-7 * np.max(np.abs(d)) ** 2:
        raise ValueError(f"{name} is not convex, or its corners are not in order: give convex parts (cairn.pre.convex_parts)")
    return x


def _joined_points(parts):
    return parts[0][0] if len(parts) == 1 else np.concatenate([v for v, _ in parts])


def _joined_faces(parts):
    first = np.concatenate([[0], np.cumsum([len(v) for v, _ in parts])])
    return [f + first[k] for k, (_, faces) in enumerate(parts) for f in faces]


def _middle(x):
    low, high = x.min(axis=0), x.max(axis=0)
    return low + (high - low) / 2


def _starts(parts):
    return np.concatenate([[0], np.cumsum([len(p) for p in parts])]).astype(np.int64)


def _contactors(shape, material, hulls, owner, which, offset):
    """Contactors of the bodies of a set. which (n,): number of the different body; owner (m,): different body of each part."""
    count = np.bincount(owner)
    first = np.concatenate([[0], np.cumsum(count)[:-1]])
    body = np.repeat(np.arange(len(which)), count[which])
    step = np.arange(len(body)) - np.repeat(np.concatenate([[0], np.cumsum(count[which])[:-1]]), count[which])
    hull = (first[which][body] + step).astype(np.int64)
    reach = np.zeros(len(body))
    return ContactorSet(shape, material, body, reach, None if offset is None else offset[hull], None, hull, hulls)


MAKERS.update(polygons=polygons, polyhedra=polyhedra)
