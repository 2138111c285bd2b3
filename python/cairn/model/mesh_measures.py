"""Strains of cells and parts of surfaces of bodies that deform, from the displacements of their nodes."""

from __future__ import annotations

import numpy as np

from .. import _core


def displacement_gradients(body, displacement):
    """Derivatives of the displacement by the place at the start in the middle of each cell, {kind: (m, dim, dim)}."""
    u, dim = np.asarray(displacement, float).reshape(body.points.shape), body.dim
    sizes, out = np.eye(3 * dim - 3), {}
    shear = {(0, 1): 2} if dim == 2 else {(0, 1): 3, (1, 2): 4, (0, 2): 5}  # where strains have twice the shear
    for kind, nodes in body.cells.items():
        h = np.zeros((len(nodes), dim, dim))
        for k in range(dim):  # of one component alone: its derivatives are the strains
            only = np.zeros((len(nodes), nodes.shape[1], dim))
            only[:, :, k] = u[nodes][:, :, k]
            found = _core.element_stress(kind, np.ascontiguousarray(body.points[nodes]), sizes, only)
            for j in range(dim):
                h[:, k, j] = found[:, k if j == k else shear[min(j, k), max(j, k)]]
        out[kind] = h
    return out


def mean_strain(body, displacement, large):
    """Strain in the middle of each cell, {kind: (m, 3 | 6)} in the order xx yy [zz] xy [yz zx], shear halved. large: Hencky's
    ln V = ln(F F') / 2, else the symmetric part of the gradient."""
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
    """Pressure (n,) [Pa] of forces (n, dim) [N] on nodes, over the parts of the surface that they stand for where it is now: the
    integrals of their shape functions. Zero of bodies whose surface is not known.

    Sides that a force does not push on, more than 60 degrees from its way, are no part of it, so that at an edge of the body only
    the side counts that is pushed. Corners of sides of six and eight nodes bear nothing where the pressure is uniform, or pull:
    forces and parts of the surface go from them to the middles beside them, of which they have the mean; so do nodes of
    parabolic edges on an axis of symmetry."""
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


CORNERS = {6: 3, 8: 4}  # of sides whose corners bear nothing, or pull, by their nodes


def surface_vectors(body, displacement):
    """Of each node the integral of its shape function over the surface where that is now, by the outward normal, (n, dim) [m2];
    zero inside, and of bodies whose surface is not known."""
    x = body.points + np.asarray(displacement, float).reshape(body.points.shape)
    out = np.zeros(x.shape)
    for nodes, own in _sides(body, x):
        np.add.at(out, nodes, own)
    return out


def _sides(body, x):
    """Of the sides of the boundary, those of one form together: nodes (m, k), and the integrals of their shape functions by the
    outward normal (m, k, dim) [m2]."""
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
    """[(nodes (m, k), integrals (m, k, dim) [m2])] of the sides that forces push on, zero of nodes that do not push on a side."""
    out = []
    for nodes, own in _sides(body, x):
        corners = CORNERS.get(nodes.shape[1], 0)
        way, of = force[nodes], own
        if corners:  # which may pull: the middles tell for the whole side
            way, of = way[:, corners:].sum(axis=1, keepdims=True), own.sum(axis=1, keepdims=True)
        pushed = -np.einsum("mak,mak->ma", way, of)
        on = (pushed > 0) & (pushed >= 0.5 * np.linalg.norm(way, axis=2) * np.linalg.norm(of, axis=2))
        own *= on[:, :, None]
        out.append((nodes[on.any(axis=1)], own[on.any(axis=1)]))
    return out


def _off_corners(sides, of_nodes):
    """What nodes have (n, dim), that of the corners of sides (nodes, sizes) moved to the middles beside them, by the sizes."""
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
    """(node (m,), one beside it (m,)) of those that have the mean of nodes beside them."""
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
