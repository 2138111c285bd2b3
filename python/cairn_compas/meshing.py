"""Cells of convex blocks: hexahedra where a block has the faces of a cube, tetrahedra about its middle elsewhere."""

from __future__ import annotations

import cairn as cn
import numpy as np
from cairn.model.dead_loads import volumes

FLUSH = 1e-6  # of a block's size: nodes nearer to the plane of a side lie on it
MOST = 24  # cells along an edge of a block

# corners of a hexahedron in the order of meshio, by their coordinates in the unit cube
UNIT = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])


def cells_of(vertices, faces, size=None):
    """Meshes a convex block.

    Parameters
    ----------
    vertices : ndarray (m, 3)
        Corners [m].
    faces : sequence
        Corners of each face, anticlockwise from outside.
    size : float, optional
        Largest edge of a cell [m]; half of the shortest edge of the block when not given.

    Returns
    -------
    tuple
        Nodes (n, 3) [m], and cells {"hexahedron" | "tetra": (c, 8 | 4)}.

    Raises
    ------
    ValueError
        If the size is not above 0, or so small that an edge of the block would have more than 24 cells.
    """
    edges = np.array([vertices[a] - vertices[b] for f in faces for a, b in zip(f, [*f[1:], f[0]])])
    lengths = np.linalg.norm(edges, axis=1)
    if size is None:
        size = 0.5 * lengths.min() if lengths.max() < 0.5 * MOST * lengths.min() else lengths.max() / MOST
    if not size > 0 or lengths.max() > MOST * size * (1 + 1e-9):
        least = lengths.max() / MOST
        raise ValueError(f"size is {size}: give a length of cells above {least:.3g} m, the longest edge over {MOST}")
    corners = _as_cube(faces) if len(vertices) == 8 else None
    return _hexahedra(vertices[corners], size) if corners is not None else _tetrahedra(vertices, faces, size)


def _as_cube(faces):
    """Corners in the order of a hexahedron, or None if the faces are not those of a cube."""
    if len(faces) != 6 or any(len(f) != 4 for f in faces):
        return None
    bottom = list(faces[0])[::-1]  # seen from inside
    above = {}
    for f in faces[1:]:
        for a, b in zip(f, [*f[1:], f[0]]):
            if a in bottom and b not in bottom:
                above[a] = int(b)
    if set(above) != set(bottom) or len(set(above.values())) != 4:
        return None
    return [*map(int, bottom), *(above[k] for k in bottom)]


def _hexahedra(corners, size):
    """A grid of hexahedra in the trilinear map of the cube to the block."""
    count = []
    for axis in range(3):
        low = [k for k in range(8) if UNIT[k, axis] == 0]
        other = [int(np.flatnonzero(np.all(UNIT == UNIT[k] + np.eye(3, dtype=int)[axis], axis=1))[0]) for k in low]
        longest = np.linalg.norm(corners[other] - corners[low], axis=1).max()
        count.append(max(1, int(np.ceil(longest / size * (1 - 1e-9)))))
    grid = np.stack(np.meshgrid(*(np.linspace(0, 1, n + 1) for n in count), indexing="ij"), axis=-1).reshape(-1, 3)
    weight = np.prod(np.where(UNIT[None] == 1, grid[:, None], 1 - grid[:, None]), axis=-1)
    number = np.arange(len(grid)).reshape([n + 1 for n in count])
    part = [slice(None, -1), slice(1, None)]
    cells = np.stack([number[tuple(part[i] for i in u)] for u in UNIT], axis=-1).reshape(-1, 8)
    return weight @ corners, {"hexahedron": cells}


def _tetrahedra(vertices, faces, size):
    """Tetrahedra between the middle and the triangles of the faces, each cut into eight until edges are short enough."""
    points = [*vertices, vertices.mean(axis=0)]
    middle, cells = len(vertices), []
    for f in faces:
        if len(f) == 3:
            cells.append([middle, *f])
            continue
        points.append(vertices[list(f)].mean(axis=0))
        cells += [[middle, len(points) - 1, a, b] for a, b in zip(f, [*f[1:], f[0]])]
    points, cells = np.array(points), np.array(cells, int)
    while _longest(points, cells) > size * (1 + 1e-9):
        points, cells = _halved(points, cells)
    a, b, c, d = (points[cells[:, k]] for k in range(4))
    turned = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) < 0
    cells[turned, 2:] = cells[turned, :1:-1]
    return points, {"tetra": cells}


def _longest(points, cells):
    x = points[cells]
    return max(np.linalg.norm(x[:, i] - x[:, j], axis=1).max() for i in range(4) for j in range(i))


def _halved(points, cells):
    """Each tetrahedron cut into eight by the middles of its edges (Bey 1995)."""
    pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]
    edges = np.sort(np.stack([cells[:, p] for p in pairs], axis=1), axis=2)
    unique, number = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
    m = number.reshape(-1, 6) + len(points)
    new = np.concatenate([points, points[unique].mean(axis=1)])
    v = cells
    a, b, c, d, e, f = (m[:, k] for k in range(6))  # middles of 01 02 03 12 13 23
    out = [(v[:, 0], a, b, c), (a, v[:, 1], d, e), (b, d, v[:, 2], f), (c, e, f, v[:, 3]),
           (a, b, c, e), (a, b, d, e), (b, c, e, f), (b, d, e, f)]  # fmt: skip
    return new, np.concatenate([np.stack(t, axis=1) for t in out])


def elastic_body(block, points, cells, sides=(), rayleigh=None):
    """Makes the elastic body of a block.

    Parameters
    ----------
    block : Block
        The block.
    points : ndarray (n, 3)
        Nodes [m].
    cells : dict
        Cells, as `cells_of` gives them.
    sides : sequence of tuple
        Point (3,) [m] and normal (3,) of each side that is a joint; its nodes become the group "side K".
    rayleigh : tuple of float, optional
        Factors of mass [1/s] and stiffness [s] in its damping.

    Returns
    -------
    tuple
        The cairn.ElasticBody, and {face of the block's mesh: name of the group of its nodes}.
    """
    vertices, faces = block.faces_plane
    size = float(np.max(np.ptp(vertices, axis=0)))

    def on_plane(corners):
        normal = np.cross(corners[1:-1] - corners[0], corners[2:] - corners[0]).sum(axis=0)
        height = (points - corners.mean(axis=0)) @ (normal / np.linalg.norm(normal))
        return np.flatnonzero(np.abs(height) <= 1e-9 * size)

    groups = {"boundary": np.unique(np.concatenate([on_plane(vertices[list(f)]) for f in faces]))}
    named = {}
    for face in block.mesh.faces():
        named[face] = f"face {face}"
        groups[named[face]] = on_plane(np.array(block.mesh.face_coordinates(face), float))
    for k, (point, normal) in enumerate(sides):
        groups[f"side {k}"] = np.flatnonzero(np.abs((points - point) @ normal) <= FLUSH * size)
    groups |= {f"node {i}": np.array([i]) for i in range(len(points))}
    options = {} if rayleigh is None else {"rayleigh": tuple(rayleigh)}
    body = cn.ElasticBody(points, cells, young=block.young, poisson=block.poisson, density=float(block.density), groups=groups,
                          **options)  # fmt: skip
    return body, named


def inertial_forces(body, center, force, moment):
    """Spreads a force and a moment over the nodes, as the inertia of a rigid motion is spread, so that no cell bears it alone.

    Parameters
    ----------
    body : cairn.ElasticBody
        The body.
    center : ndarray (3,)
        Its centre of mass [m].
    force, moment : ndarray (3,)
        Resultant [N] and moment about the centre [N m].

    Returns
    -------
    ndarray (n, 3)
        Nodal forces [N] of exactly these sums.
    """
    weight = volumes(body)
    weight = weight / weight.sum()
    middle = weight @ body.points
    arm = body.points - middle
    moment = moment - np.cross(middle - center, force)  # about the middle of the nodes
    inertia = np.einsum("i,ij,ij->", weight, arm, arm) * np.eye(3) - np.einsum("i,ij,ik->jk", weight, arm, arm)
    return weight[:, None] * (force + np.cross(np.linalg.solve(inertia, moment), arm))
