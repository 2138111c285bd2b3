"""Triangulated surfaces as boundaries: terrain, hoppers, chutes, surfaces from STL files."""

from __future__ import annotations

import numpy as np

from ..base import checks
from ..names import takes
from ..pre import mesh as meshes
from .bodies import OF_BOUNDARIES, BodySet, ContactorSet, _boundary
from .shapes import Hulls


@takes(*OF_BOUNDARIES)
def surface(vertices, faces, material, *, velocity=None, mass=None, inertia=None, free=(), force=None, **options) -> BodySet:
    """A triangulated surface in 3D against spheres, capsules and polyhedra, solid behind: its faces are anticlockwise when seen
    from the free side.

    vertices (m, 3) [m]; faces (k, 3) or lists of vertices, numbered from 0; faces of more than four vertices are plane, and no
    face crosses itself. The surface need not be closed. It is held, or moves as a rigid body: velocity, mass, inertia, free,
    force as for a wall. Each triangle is a contactor. Contact at an edge or a vertex is assigned to a single triangle, and edges
    between coplanar triangles have no effect. A closed surface may be thinner than the body that lies on it: its far side has no
    contact there. Contact is not found for a sphere whose centre is deeper behind a triangle than its radius, a corner of a
    polyhedron deeper than the width of the triangle, and a polyhedron whose centre is behind the triangle.
    """
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
    return _boundary(3, place, contactor, mass, inertia, free, velocity, force, options)


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
