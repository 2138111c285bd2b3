"""Meshes of boxes of every kind of cell, of first and second order."""

import itertools

import numpy as np

CELLS = {
    2: ["triangle", "quad", "triangle6", "quad8", "quad9"],
    3: ["tetra", "hexahedron", "tetra10", "hexahedron20", "hexahedron27"],
}
SQUARE = [(0, 0), (2, 0), (2, 2), (0, 2)]
CUBE = [(*c, 0) for c in SQUARE] + [(*c, 2) for c in SQUARE]
CUBE_EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
TETRAHEDRA = [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)]


def _middle(a, b):
    return tuple((p + q) // 2 for p, q in zip(a, b))


def _patterns(kind):
    """Places of the nodes of the cells of one block, in half blocks."""
    if kind.startswith("triangle"):
        corners = [[SQUARE[k] for k in way] for way in ((0, 1, 2), (0, 2, 3))]
        edges = [(0, 1), (1, 2), (2, 0)] if kind == "triangle6" else []
    elif kind.startswith("tetra"):
        corners = [[CUBE[k] for k in way] for way in TETRAHEDRA]
        edges = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)] if kind == "tetra10" else []
    elif kind.startswith("quad"):
        corners, edges = [SQUARE], [(0, 1), (1, 2), (2, 3), (3, 0)] if kind != "quad" else []
    else:
        corners, edges = [CUBE], CUBE_EDGES if kind != "hexahedron" else []
    cells = [[*c, *(_middle(c[a], c[b]) for a, b in edges)] for c in corners]
    if kind == "quad9":
        cells[0].append((1, 1))
    if kind == "hexahedron27":
        cells[0] += [(0, 1, 1), (2, 1, 1), (1, 0, 1), (1, 2, 1), (1, 1, 0), (1, 1, 2), (1, 1, 1)]
    return cells


def box(kind, counts, sizes, place=None):
    """Points (n, dim) and {kind: cells} of a box; place(points) moves them."""
    found, cells = {}, []
    for block in itertools.product(*(range(c) for c in counts)):
        for pattern in _patterns(kind):
            at = [tuple(2 * b + p for b, p in zip(block, node)) for node in pattern]
            cells.append([found.setdefault(a, len(found)) for a in at])
    points = np.array(list(found)) / 2 * np.asarray(sizes) / np.asarray(counts)
    return (points if place is None else place(points)), {kind: np.array(cells)}


def grid(cells):
    """A unit square of quadrilaterals or a unit cube of hexahedra: points, cells of first order, counted by rows."""
    axes = [np.linspace(0.0, 1.0, n + 1) for n in cells]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, len(cells))
    number = np.arange(len(points)).reshape([n + 1 for n in cells])
    low, high = slice(None, -1), slice(1, None)
    corners = [(low, low), (high, low), (high, high), (low, high)]
    if len(cells) == 2:
        return points, {"quad": np.stack([number[c] for c in corners], -1).reshape(-1, 4)}
    return points, {"hexahedron": np.stack([number[(*c, z)] for z in (low, high) for c in corners], -1).reshape(-1, 8)}
