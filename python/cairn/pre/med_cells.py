"""Cells of MED files: their nodes have the opposite orientation, which meshio does not convert."""

from __future__ import annotations

import numpy as np

# corners of MED cells in our order, and the edges, by corners, in the order of their middle nodes (the same in both)
CORNERS = {"tetra": [0, 2, 1, 3], "hexahedron": [0, 3, 2, 1, 4, 7, 6, 5]}
EDGES = {
    "tetra": [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)],
    "hexahedron": [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)],
}
WITHOUT_MIDDLES = {"tetra": "tetra", "hexahedron": "hexahedron", "tetra10": "tetra", "hexahedron20": "hexahedron"}


def turned(kind):
    """Index of each node of a kind of cells in the order of a MED file."""
    base = WITHOUT_MIDDLES[kind]
    corners, edges = CORNERS[base], EDGES[base]
    if kind == base:
        return corners
    place = {frozenset(edge): len(corners) + k for k, edge in enumerate(edges)}
    return [*corners, *(place[frozenset((corners[a], corners[b]))] for a, b in edges)]


def read(path, by):
    """Mesh of a MED file, by meshio's reader `by`, with the nodes of its cells in our order. Cells with positive volume, as
    meshio writes them, are not changed."""
    from meshio.med import _med

    known = _med.med_to_meshio_type
    _med.med_to_meshio_type = known | {"QU9": "quad9"}
    try:
        mesh = by(path)
    finally:
        _med.med_to_meshio_type = known
    for block in mesh.cells:
        if block.type in WITHOUT_MIDDLES and len(block.data) and np.all(_volumes(mesh.points, block.data, block.type) < 0):
            block.data = block.data[:, turned(block.type)]
    return mesh


def _volumes(points, cells, kind):
    """Six times the signed volume of the tetrahedron at the first corner of each cell (m,) [m3]: negative if inside out."""
    third, fourth = (2, 3) if WITHOUT_MIDDLES[kind] == "tetra" else (3, 4)
    first, second, third, fourth = (np.asarray(points, float)[cells[:, k]] for k in (0, 1, third, fourth))
    return np.einsum("mk,mk->m", np.cross(second - first, third - first), fourth - first)
