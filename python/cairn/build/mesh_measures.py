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


# Of nodes at corners, in the middle of edges and of faces of cells of second order: what each has of a piece of a side, over the
# sum. Of parabolic edges and HEX27 it is the integral of the shape function; corners of six and eight nodes have none.
SHARES = {2: np.array([1.0, 2.0, 2.0]), 3: np.array([0.0, 1.0, 1.0]), 4: np.array([1.0, 2.0, 4.0])}
CORNERS = {"triangle6": 3, "quad8": 4, "quad9": 4, "tetra10": 4, "hexahedron20": 8, "hexahedron27": 8}


def surface_vectors(body, displacement, force=None):
    """Of each node the part of the surface that it stands for, where that is now: its outward normal by its area, (n, dim) [m2];
    zero inside, and of bodies whose surface is not known. force (n, dim) on the nodes: sides that it does not push on, more than
    60 degrees from its way, are no part of it, so that at an edge of the body only the side counts that is pushed."""
    x = body.points + np.asarray(displacement, float).reshape(body.points.shape)
    out, ring = np.zeros(x.shape), getattr(body, "plane", "") == "axisymmetric"
    for nodes, shares in _pieces(body):
        of = x[nodes]
        if body.dim == 2:
            along = of[:, 1] - of[:, 0]
            part = np.stack([along[:, 1], -along[:, 0]], axis=1) * getattr(body, "thickness", 1.0)
        else:  # (c - a) x (d - b) of the diagonals is twice the area, of a triangle with d = a too
            part = np.cross(of[:, 2] - of[:, 0], of[:, 3 % nodes.shape[1]] - of[:, 1]) / 2
        for k, node in enumerate(nodes.T):
            own = shares[:, k, None]
            if ring:  # the integral of the node's shape function, 2 pi r ds
                radius = x[node, :1]
                mean = (2 * radius + x[nodes[:, 1 - k], :1]) / 3
                own = own * 2 * np.pi * np.where(own == 0.5, mean, radius)
            _add(out, node, part * own, force)
    return out


def pressure_of(body, displacement, force):
    """Pressure (n,) [Pa] of forces (n, dim) on nodes. Corners of sides of six and eight nodes, and of parabolic edges on an axis
    of symmetry, bear nothing where the pressure is uniform: they have the mean of the nodes beside them."""
    areas = surface_vectors(body, displacement, force)
    size = np.linalg.norm(areas, axis=1)
    pushed = -np.einsum("nk,nk->n", force, areas)
    out = np.divide(pushed, size**2, out=np.zeros(len(size)), where=size > 0)
    total, count = np.zeros(len(size)), np.zeros(len(size))
    radius = np.abs(body.points[:, 0]) if getattr(body, "plane", "") == "axisymmetric" else np.ones(len(size))
    on_axis = radius <= 1e-12 * radius.max()
    for nodes, shares in _pieces(body):
        bare = (shares == 0) | (on_axis[nodes] & (shares != 0.5))
        beside = ~bare & (out[nodes] > 0)
        mean = np.where(beside, out[nodes], 0.0).sum(axis=1)
        for k, node in enumerate(nodes.T):
            np.add.at(total, node[bare[:, k]], mean[bare[:, k]])
            np.add.at(count, node[bare[:, k]], beside.sum(axis=1)[bare[:, k]])
    return np.divide(total, count, out=out, where=count > 0)


def _pieces(body):
    """[(nodes (m, k), shares (m, k))] of the sides of the boundary, cut along nodes in the middle; [] where none are known."""
    try:
        sides = body.boundary_edges() if body.dim == 2 else body.boundary_faces()
    except (ValueError, AttributeError):
        return []
    role = np.zeros(len(body.points), int)
    for kind, corners in CORNERS.items():
        if kind in getattr(body, "cells", {}):
            cells = body.cells[kind]
            role[cells[:, corners:]] = 1
            if kind == "hexahedron27":
                role[cells[:, 20:]] = 2
    sides = np.asarray(sides)
    wide = sides[:, 3] >= 0 if sides.shape[1] == 4 else np.zeros(len(sides), bool)
    parts = [sides] if body.dim == 2 else [sides[~wide][:, :3], sides[wide]]
    out = []
    for nodes in parts:
        if len(nodes):
            shares = SHARES[nodes.shape[1]][role[nodes]]
            total = shares.sum(axis=1, keepdims=True)
            shares, total = np.where(total > 0, shares, 1.0), np.where(total > 0, total, nodes.shape[1])
            out.append((nodes, shares / total))
    return out


def _add(out, nodes, part, force):
    if force is not None:
        pushed = -np.einsum("nk,nk->n", force[nodes], part)
        part = part * (pushed >= 0.5 * np.linalg.norm(force[nodes], axis=1) * np.linalg.norm(part, axis=1))[:, None]
    np.add.at(out, nodes, part)
