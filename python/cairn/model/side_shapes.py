"""Sides of cells of first and second order for the integrals of ties: whole sides with shape functions, cut into flat pieces."""

from __future__ import annotations

import numpy as np

from .mesh_faces import whole_sides

# Parent coordinates of the nodes of a side: edges from -1 to 1, triangles from 0 to 1, quadrilaterals from -1 to 1.
_EDGE = np.array([[-1.0], [1.0], [0.0]])
_TRIANGLE = np.array([[0.0, 0], [1, 0], [0, 1], [0.5, 0], [0.5, 0.5], [0, 0.5]])
_QUADRILATERAL = np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1], [0, -1], [1, 0], [0, 1], [-1, 0], [0, 0]])


def places_of_nodes(dim, count):
    """Parent coordinates (count, dim - 1) of the nodes of a side with `count` nodes."""
    if dim == 2:
        return _EDGE[:count]
    return (_TRIANGLE if count in (3, 6) else _QUADRILATERAL)[:count]


def shape(dim, count, at):
    """Shape functions (m, count) of a side with `count` nodes, corners first, at parent coordinates (m, dim - 1)."""
    if dim == 2:
        s = at[:, 0]
        if count == 2:
            return np.stack([(1 - s) / 2, (1 + s) / 2], 1)
        return np.stack([s * (s - 1) / 2, s * (s + 1) / 2, (1 - s) * (1 + s)], 1)
    r, s = at.T
    if count in (3, 6):
        share = np.stack([1 - r - s, r, s], 1)
        if count == 3:
            return share
        return np.concatenate([share * (2 * share - 1), 4 * share * np.roll(share, -1, axis=1)], axis=1)
    places = _QUADRILATERAL[:count]
    if count == 9:
        one = [[x * (x - 1) / 2, (1 - x) * (1 + x), x * (x + 1) / 2] for x in (r, s)]
        return np.stack([one[0][int(a) + 1] * one[1][int(b) + 1] for a, b in places], 1)
    corners = np.stack([(1 + a * r) * (1 + b * s) / 4 for a, b in places[:4]], 1)
    if count == 4:
        return corners
    middles = np.stack([(1 - r * r) * (1 + b * s) / 2 if a == 0 else (1 - s * s) * (1 + a * r) / 2 for a, b in places[4:]], 1)
    return np.concatenate([corners - (middles + np.roll(middles, 1, axis=1)) / 2, middles], axis=1)


def from_basis(dim, count):
    """U (count, count) of u = U w: nodal values u of a side from coefficients w in the basis B = N U, whose functions have
    positive integrals, as dual functions need (after Popp, Wohlmuth, Gitterle & Wall 2012).

    w = u at a corner; w = 2 u less the mean of the ends at the middle of an edge; w = 4 u less the middles of the edges plus a
    quarter of each corner at the middle node of nine."""
    of = np.eye(count)
    corners = 2 if dim == 2 else 3 if count in (3, 6) else 4
    for k in range(corners, count):
        e = k - corners
        if k == 8:
            of[k, :4], of[k, 4:8], of[k, 8] = 0.25, -1.0, 4.0
        else:
            of[k, k], of[k, [e, (e + 1) % corners]] = 2.0, -0.5
    return np.linalg.inv(of)


def wholes(body, pieces):
    """[(nodes of the whole side, parent coordinates of the corners of the piece on it (corners, dim - 1))] for flat pieces
    (m, 2 | 4) of the boundary, -1 for the fourth node of a triangle."""
    found = whole_sides(body, pieces)
    out = []
    for piece, nodes in zip(pieces, found if len(found) else pieces):
        piece, nodes = piece[piece >= 0], nodes[nodes >= 0]
        places = places_of_nodes(body.dim, len(nodes))
        out.append((nodes, places[[int(np.flatnonzero(nodes == node)[0]) for node in piece]]))
    return out


def dual_rows(dim, common):
    """{slave node: (master nodes, weights)} of mortar ties, from integrals over the overlap of slave and master sides.

    common: {nodes of a whole slave side (tuple): [(nodes of a master side, its shape functions (m, k), parent coordinates of the
    points on the slave side (m, dim - 1), weights of the rule (m,) [m or m2])]}. Dual functions psi = diag(D) (int B B')^-1 B,
    D_j = int B_j, give w_j = M_jl u_l / D_j, M_jl = int psi_j N_l (Wohlmuth 2000); nodal values are u = U w, see from_basis.
    """
    diagonal, rows = {}, {}
    for nodes, samples in common.items():
        mix = from_basis(dim, len(nodes))
        bases = [shape(dim, len(nodes), at) @ mix for _, _, at, _ in samples]
        of = sum(wide @ basis for basis, (_, _, _, wide) in zip(bases, samples))
        both = sum(basis.T @ (wide[:, None] * basis) for basis, (_, _, _, wide) in zip(bases, samples))
        dual = of[:, None] * np.linalg.inv(both)
        for j, node in enumerate(nodes):
            diagonal[node] = diagonal.get(node, 0.0) + of[j]
            row = rows.setdefault(node, {})
            for basis, (leaders, lead, _, wide) in zip(bases, samples):
                for leader, part in zip(leaders, (wide * (basis @ dual[j])) @ lead):
                    row[leader] = row.get(leader, 0.0) + part
    for node, row in rows.items():
        for leader in row:
            row[leader] /= diagonal[node]
    values = {}
    for nodes in common:
        mix = from_basis(dim, len(nodes))
        for k, node in enumerate(nodes):
            if node in values:  # both sides at the middle of an edge give it the same weights
                continue
            value = values[node] = {}
            for j in np.flatnonzero(mix[k]):
                for leader, part in rows[nodes[j]].items():
                    value[leader] = value.get(leader, 0.0) + mix[k, j] * part
    return {node: (list(value), np.array(list(value.values()))) for node, value in values.items()}


def check_nodes(sides, nodes, group):
    """Raises ValueError if a whole slave side has a node outside its group."""
    for whole, _ in sides:
        outside = np.setdiff1d(whole, nodes)
        if len(outside):
            raise ValueError(
                f"ties: the side of nodes {', '.join(map(str, whole))} is of second order, and its node {outside[0]} is "
                f"not in {group!r}, which is to follow: give groups all nodes of their sides"
            )
