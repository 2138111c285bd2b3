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


def surface_vectors(body, displacement, force=None):
    """Of each node the part of the surface that it stands for, where that is now: its outward normal by its area, (n, dim) [m2];
    zero inside, and of bodies whose surface is not known. force (n, dim) on the nodes: sides that it does not push on, more than
    60 degrees from its way, are no part of it, so that at an edge of the body only the side counts that is pushed."""
    x = body.points + np.asarray(displacement, float).reshape(body.points.shape)
    out = np.zeros(x.shape)
    try:
        sides = body.boundary_edges() if body.dim == 2 else body.boundary_faces()
    except (ValueError, AttributeError):
        return out
    if body.dim == 2:
        along = x[sides[:, 1]] - x[sides[:, 0]]
        half = np.stack([along[:, 1], -along[:, 0]], axis=1) / 2 * getattr(body, "thickness", 1.0)
        ring = getattr(body, "plane", "") == "axisymmetric"
        for end, other in (sides.T, sides.T[::-1]):  # of a ring the integral of the end's shape function, 2 pi r ds
            _add(out, end, half * (2 * np.pi / 3 * (2 * x[end, :1] + x[other, :1]) if ring else 1.0), force)
        return out
    wide = sides[:, 3] >= 0 if sides.shape[1] == 4 else np.zeros(len(sides), bool)
    for some, corners in ((sides[~wide][:, :3], 3), (sides[wide], 4)):
        if len(some):
            of = x[some]  # (c - a) x (d - b) of the diagonals is twice the area, of a triangle with d = a too
            part = np.cross(of[:, 2] - of[:, 0], of[:, 3 % corners] - of[:, 1]) / 2
            for corner in some.T:
                _add(out, corner, part / corners, force)
    return out


def _add(out, nodes, part, force):
    if force is not None:
        pushed = -np.einsum("nk,nk->n", force[nodes], part)
        part = part * (pushed >= 0.5 * np.linalg.norm(force[nodes], axis=1) * np.linalg.norm(part, axis=1))[:, None]
    np.add.at(out, nodes, part)
