"""Triangulated surfaces as boundaries: terrain, hoppers, chutes, surfaces from STL files."""

from __future__ import annotations

import numpy as np

from ..base import checks
from ..names import takes
from ..pre import mesh as meshes
from .bodies import BodySet, ContactorSet
from .boundaries import OF_BOUNDARIES, boundary_set
from .shapes import Hulls


@takes(*OF_BOUNDARIES)
def surface(
    vertices, faces, material, *, radius=0.0, velocity=None, mass=None, inertia=None, free=(), force=None, **options
) -> BodySet:
    """A triangulated surface in 3D against spheres, capsules and polyhedra, solid behind: its faces are anticlockwise when seen
    from the free side. In 2D a chain of segments against disks and polygons, such as the outline of a terrain.

    vertices (m, 3) [m]; faces (k, 3) or lists of vertices, numbered from 0; faces of more than four vertices are plane, and no
    face crosses itself. The surface need not be closed. It is held, or moves as a rigid body: velocity, mass, inertia, free,
    force as for a wall. Each triangle is a contactor. Contact at an edge or a vertex is assigned to a single triangle, and edges
    between coplanar triangles have no effect. A closed surface may be thinner than the body that lies on it: its far side has no
    contact there. Contact is not found for a sphere whose centre is deeper behind a triangle than its radius, a corner of a
    polyhedron deeper than the width of the triangle, and a polyhedron whose centre is behind the triangle.

    In 2D: vertices (m, 2) [m] and pairs of vertices (k, 2), or None for those of the polyline in its order. Each pair is a
    segment with round ends of the given radius [m], met from both sides; all are on one body, and bodies slide over flush joints
    and kinks between them without catching.
    """
    if np.ndim(vertices) == 2 and np.shape(vertices)[1] == 2:
        return _chain(vertices, faces, material, radius, velocity, mass, inertia, free, force, options)
    if checks.number("radius", radius) != 0:
        raise ValueError(f"radius is {radius}: a surface of triangles has none, leave it out")
    vertices = checks.real_array("vertices", vertices, (None, 3))
    fans = meshes.triangles(vertices, faces, "surface")
    if not len(fans):
        raise ValueError("faces is empty: give at least one triangle")
    edges = np.linalg.norm(vertices[fans] - vertices[np.roll(fans, -1, axis=1)], axis=2)
    meshes.refuse_slivers("faces", vertices, fans, edges)
    vertices, fans = meshes.weld(vertices, fans)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    place = low + (high - low) / 2
    centre = vertices[fans].mean(axis=1)
    hulls, _ = with_neighbours(vertices, fans, centre)
    count = len(fans)
    contactor = ContactorSet(
        "facet", material, np.zeros(count, int), np.zeros(count), centre - place, None, np.arange(count), hulls
    )
    return boundary_set(3, place, contactor, mass, inertia, free, velocity, force, options)


def _chain(vertices, edges, material, radius, velocity, mass, inertia, free, force, options):
    """Segments between the vertices of a surface in 2D, on one body whose centre is in the middle of their box."""
    vertices = checks.real_array("vertices", vertices, (None, 2))
    if edges is None:
        edges = np.column_stack((np.arange(len(vertices) - 1), np.arange(1, len(vertices))))
    pairs = np.asarray(edges)
    if pairs.ndim != 2 or pairs.shape[1] != 2 or not len(pairs) or pairs.dtype.kind not in "iu":
        raise ValueError(f"faces has shape {pairs.shape}: give pairs of vertices (k, 2), numbered from 0, of a surface in 2D")
    wrong = np.flatnonzero(((pairs < 0) | (pairs >= len(vertices))).any(axis=1))
    if wrong.size:
        raise ValueError(f"faces[{wrong[0]}] is {pairs[wrong[0]].tolist()}: there are {len(vertices)} vertices, from 0")
    radius = checks.number("radius", radius)
    if radius < 0:
        raise ValueError(f"radius is {radius}: give a length >= 0 [m]")
    half = (vertices[pairs[:, 1]] - vertices[pairs[:, 0]]) / 2
    size = np.max(np.abs(half), axis=1)
    if np.any(size == 0):
        at = int(np.flatnonzero(size == 0)[0])
        raise ValueError(f"faces[{at}] is {pairs[at].tolist()}, which are the same point: give two different points")
    _, again = np.unique(np.sort(pairs, axis=1), axis=0, return_index=True)
    if len(again) < len(pairs):
        at = int(np.setdiff1d(np.arange(len(pairs)), again)[0])
        raise ValueError(f"faces[{at}] is {pairs[at].tolist()}, a pair that is there already: give each once")
    unit = half / size[:, None]
    direction = np.column_stack((unit, size * np.sqrt(np.sum(unit**2, axis=1))))
    used = vertices[np.unique(pairs)]
    place = used.min(axis=0) + (used.max(axis=0) - used.min(axis=0)) / 2
    centre = vertices[pairs[:, 0]] + half - place
    count = len(pairs)
    contactor = ContactorSet("segment", material, np.zeros(count, int), np.full(count, radius), centre, direction)
    return boundary_set(2, place, contactor, mass, inertia, free, velocity, force, options)


def with_neighbours(vertices, fans, centre):
    """(Hulls of the facets, each with the triangles that share a vertex with it and its own vertices first; list of the numbers
    of these vertices for each facet)."""
    by_vertex = np.argsort(fans.ravel(), kind="stable") // 3
    first = np.concatenate([[0], np.cumsum(np.bincount(fans.ravel(), minlength=len(vertices)))])
    points, corners, numbers, sizes = [], [], [], []
    for k, own in enumerate(fans):
        around = np.unique(np.concatenate([by_vertex[first[v] : first[v + 1]] for v in own]))
        others = np.setdiff1d(fans[around], own)
        used = np.concatenate([own, others])
        order = np.argsort(used)
        local = order[np.searchsorted(used, fans[around], sorter=order)]
        points.append(vertices[used] - centre[k])
        corners.append(local)
        numbers.append(used)
        sizes.append(len(around))
    total = int(np.sum(sizes))
    hulls = Hulls(
        np.concatenate(points),
        np.concatenate([[0], np.cumsum([len(used) for used in numbers])]).astype(np.int64),
        np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64),
        3 * np.arange(total + 1),
        np.concatenate(corners).ravel().astype(np.int64),
        True,
    )
    return hulls, numbers
