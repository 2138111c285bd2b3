"""Strains of cells, tributary areas and nodal pressures of deformable bodies, from the displacements of their nodes."""

from __future__ import annotations

import numpy as np

from .. import _core


def displacement_gradients(body, displacement):
    """Displacement gradient du/dX in the middle of each cell, {kind: (m, dim, dim)}; X: initial position."""
    u, dim = np.asarray(displacement, float).reshape(body.points.shape), body.dim
    sizes, out = np.eye(3 * dim - 3), {}
    shear = {(0, 1): 2} if dim == 2 else {(0, 1): 3, (1, 2): 4, (0, 2): 5}  # components that hold twice the shear strain
    for kind, nodes in body.cells.items():
        h = np.zeros((len(nodes), dim, dim))
        for k in range(dim):  # a displacement along axis k alone: its strains are its derivatives
            only = np.zeros((len(nodes), nodes.shape[1], dim))
            only[:, :, k] = u[nodes][:, :, k]
            found = _core.element_stress(kind, np.ascontiguousarray(body.points[nodes]), sizes, only)
            for j in range(dim):
                h[:, k, j] = found[:, k if j == k else shear[min(j, k), max(j, k)]]
        out[kind] = h
    return out


def mean_strain(body, displacement, large):
    """Strain in the middle of each cell, {kind: (m, 3 | 6)} in the order xx yy [zz] xy [yz zx], tensor shear. large: Hencky's
    ln V = ln(F F') / 2; else the symmetric part of the displacement gradient."""
    out, dim = {}, body.dim
    rows, columns = ([0, 1, 0], [0, 1, 1]) if dim == 2 else ([0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2])
    for kind, h in displacement_gradients(body, displacement).items():
        back = h.transpose(0, 2, 1)
        e = (h + back) / 2
        if large:
            x, q = np.linalg.eigh(h + back + h @ back)
            e = (q * np.log1p(x)[:, None, :] / 2) @ q.transpose(0, 2, 1)
        out[kind] = e[:, rows, columns]
    return out


def pressure_of(body, displacement, force):
    """Pressure (n,) [Pa] of nodal forces (n, dim) [N] over the tributary areas of the nodes in the deformed configuration, which
    are integrals of the shape functions. Zero for bodies whose surface is not known.

    Only sides whose inward normal is within 60 degrees of the force count, so that at an edge of the body the loaded side alone
    does. In sides of six and eight nodes a uniform pressure has zero or negative forces at the corners: forces and areas of
    corners are moved to the adjacent mid-side nodes, and corners get the mean pressure of these. The same mean is given to nodes
    of parabolic edges on an axis of symmetry."""
    x = body.points + np.asarray(displacement, float).reshape(body.points.shape)
    sides = _sides_pushed(body, x, force)
    areas = np.zeros(x.shape)
    for nodes, own in sides:
        np.add.at(areas, nodes, own)
    bare = [(nodes, np.linalg.norm(own.sum(axis=1), axis=1)) for nodes, own in sides if nodes.shape[1] in CORNERS]
    force, areas = _off_corners(bare, np.asarray(force, float)), _off_corners(bare, areas)
    size = np.linalg.norm(areas, axis=1)
    pushed = -np.einsum("nk,nk->n", force, areas)
    out = np.divide(pushed, size**2, out=np.zeros(len(size)), where=size > 0)
    total, count = np.zeros(len(size)), np.zeros(len(size))
    for node, beside in _beside(body, sides):
        known = out[beside] > 0
        np.add.at(total, node, np.where(known, out[beside], 0.0))
        np.add.at(count, node, known)
    return np.divide(total, count, out=out, where=count > 0)


CORNERS = {6: 3, 8: 4}  # corners of sides by number of nodes, where the shape functions of corners integrate to <= 0


def surface_vectors(body, displacement):
    """Tributary area vector of each node (n, dim) [m2]: integral of its shape function times the outward normal over the deformed
    surface; zero for inner nodes, and for bodies whose surface is not known."""
    x = body.points + np.asarray(displacement, float).reshape(body.points.shape)
    out = np.zeros(x.shape)
    for nodes, own in _sides(body, x):
        np.add.at(out, nodes, own)
    return out


def _sides(body, x):
    """Yields for each form of boundary sides their nodes (m, k), and the integrals of the shape functions times the outward
    normal (m, k, dim) [m2], at positions x (n, dim) [m]."""
    from .pressure import boundary_sides, samples

    try:
        boundary = boundary_sides(body)
    except (ValueError, AttributeError):
        return
    for part in boundary:
        wide = part[:, -1] >= 0
        for some in (part[wide], part[~wide][:, :-1]):
            if len(some):
                own = np.zeros((*some.shape, body.dim))
                for _, value, inward in samples(body, some, x):
                    own -= value[:, None] * inward[:, None, :]
                yield some, own


def _sides_pushed(body, x, force):
    """[(nodes (m, k), integrals (m, k, dim) [m2])] of the sides under compression by nodal forces (n, dim) [N]; the integrals are
    zero at nodes whose force does not push on the side."""
    out = []
    for nodes, own in _sides(body, x):
        corners = CORNERS.get(nodes.shape[1], 0)
        way, of = force[nodes], own
        if corners:  # forces of corners may pull: the sum over the mid-side nodes decides for the whole side
            way, of = way[:, corners:].sum(axis=1, keepdims=True), own.sum(axis=1, keepdims=True)
        pushed = -np.einsum("mak,mak->ma", way, of)
        on = (pushed > 0) & (pushed >= 0.5 * np.linalg.norm(way, axis=2) * np.linalg.norm(of, axis=2))
        own *= on[:, :, None]
        out.append((nodes[on.any(axis=1)], own[on.any(axis=1)]))
    return out


def _off_corners(sides, of_nodes):
    """Nodal values (n, dim) with those of corners moved to the adjacent mid-side nodes, in proportion to the areas of the sides.
    sides: [(nodes (m, k), areas (m,) [m2])]."""
    weight, out = np.zeros(len(of_nodes)), of_nodes.copy()
    for nodes, size in sides:
        corners = CORNERS[nodes.shape[1]]
        np.add.at(weight, nodes[:, :corners], 2 * size[:, None])
        out[nodes[:, :corners]] = 0.0
    for nodes, size in sides:
        corners = CORNERS[nodes.shape[1]]
        for k in range(corners):
            for corner in (nodes[:, k], nodes[:, (k + 1) % corners]):
                np.add.at(out, nodes[:, corners + k], (size / weight[corner])[:, None] * of_nodes[corner])
    return out


def _beside(body, sides):
    """Yields (nodes (m,), adjacent nodes (m,)) for nodes whose pressure is the mean over adjacent nodes."""
    radius = np.abs(body.points[:, 0]) if getattr(body, "plane", "") == "axisymmetric" else np.ones(len(body.points))
    on_axis = radius <= 1e-12 * radius.max()
    for nodes, _ in sides:
        corners = CORNERS.get(nodes.shape[1], 0)
        for k in range(corners):
            yield nodes[:, k], nodes[:, corners + k]
            yield nodes[:, (k + 1) % corners], nodes[:, corners + k]
        if body.dim == 2 and nodes.shape[1] == 3:
            for k, other in ((0, 1), (1, 0)):
                bare = nodes[on_axis[nodes[:, k]]]
                for beside in (bare[:, other], bare[:, 2]):
                    yield bare[:, k], beside
