"""Ground for bodies to fall on: a surface of triangles, from a file or from heights, as convex prisms below it."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from ..base import checks
from ..base.errors import MissingFile
from .mesh import SLIVER, library, triangles
from .obj_files import read_objects
from .polygon_files import read_off, read_ply


def read_surface(path, scale=1.0):
    """Vertices (m, 3) [m] and triangles (k, 3) of an open or closed surface in a file: OBJ, PLY, OFF, and STL (with trimesh).

    Coincident corners of an STL's triangles are merged; triangles without area, or listed twice, are left out,
    with a warning; faces of more corners are cut into triangles, convex or not. scale: metres of the file's unit. Raises
    FileNotFoundError, and ValueError naming the file that is no surface.
    """
    from .import_report import told_of

    scale, path = checks.positive("scale", scale), Path(path)
    if not path.exists():
        raise MissingFile(path)
    with told_of(path):
        return _surface(path, scale)


def _faces(path):
    """Corners of a file, and its faces with all of theirs."""
    from .importing import by_library

    ending = path.suffix.lower()
    if ending in (".ply", ".off"):
        return (read_ply if ending == ".ply" else read_off)(path)
    if ending == ".obj":
        vertices, objects = read_objects(path)
        return vertices, [face for _, faces in objects for face in faces]
    trimesh = library("trimesh", "to read a surface")
    mesh = by_library(path, lambda p: trimesh.load(p, force="mesh", process=False))
    return np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64)


def _surface(path, scale):
    vertices, faces = _faces(path)
    if not len(faces):
        raise ValueError(f"{path} holds no triangles")
    vertices, faces = scale * vertices, triangles(vertices, faces, path.name)
    bad = np.flatnonzero(~np.all(np.isfinite(vertices), axis=1))
    if len(bad):
        raise ValueError(f"{path}: vertex {bad[0]} is {vertices[bad[0]]}: give finite numbers")
    known, which = np.unique(vertices, axis=0, return_inverse=True)
    faces = which.ravel()[faces]
    a, b, c = (known[faces[:, k]] for k in range(3))
    longest = np.max([np.linalg.norm(p - q, axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    flat = np.linalg.norm(np.cross(b - a, c - a), axis=1) <= SLIVER * longest**2
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    twice = np.ones(len(faces), bool)
    twice[first] = False
    if np.any(flat | twice):
        warnings.warn(
            f"{path.name}: of {len(faces)} triangles {np.sum(flat)} without area and {np.sum(twice & ~flat)} listed twice are "
            "left out",
            stacklevel=3,
        )
    return known, faces[~(flat | twice)]


def heights(x, y, z):
    """The surface z (len(x), len(y)) over a grid: vertices, triangles anticlockwise from above."""
    x, y = (checks.real_array(name, v, (len(v),)) for name, v in (("x", x), ("y", y)))
    z = checks.real_array("z", z, (len(x), len(y)))
    vertices = np.column_stack([v.ravel() for v in (*np.meshgrid(x, y, indexing="ij"), z)])
    corner = np.arange(len(x) * len(y)).reshape(len(x), len(y))
    a, b, c, d = corner[:-1, :-1].ravel(), corner[1:, :-1].ravel(), corner[1:, 1:].ravel(), corner[:-1, 1:].ravel()
    return vertices, np.concatenate((np.column_stack((a, b, c)), np.column_stack((a, c, d))))


def prisms(vertices, faces, depth):
    """An upward surface as a list of convex meshes for `cairn.polyhedra`: the prism below each triangle down to `depth` [m] under
    the lowest vertex. Held fixed, they form a ground without gaps.

    Raises ValueError for triangles that stand upright or look down, of which there is no prism: cut overhangs into blocks.
    """
    vertices = checks.real_array("vertices", vertices, (len(vertices), 3))
    faces = np.asarray(faces, np.int64)
    depth = checks.positive("depth", depth)
    if faces.ndim != 2 or faces.shape[1] != 3 or np.any(faces < 0) or np.any(faces >= len(vertices)):
        raise ValueError(f"faces: give triangles (k, 3) of vertex numbers from 0 to {len(vertices) - 1}")
    corner = vertices[faces]
    ab, ac = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    plan = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]  # twice the area seen from above
    size = np.max(np.abs(corner[:, :, :2] - corner[:, :1, :2]), axis=(1, 2))
    bad = np.flatnonzero(~(plan > 1e-9 * size * size))
    if len(bad):
        k = bad[0]
        how = "has no area seen from above" if abs(plan[k]) <= 1e-9 * size[k] ** 2 else "looks down"
        remedy = "turn all triangles if the surface is upside down, and cut overhangs into blocks of their own"
        raise ValueError(f"faces[{k}] {how} ({len(bad)} of {len(faces)} do): {remedy}")
    floor = vertices[:, 2].min() - depth
    below = corner.copy()
    below[:, :, 2] = floor
    sides = [[0, 1, 2], [3, 5, 4], [0, 3, 4, 1], [1, 4, 5, 2], [2, 5, 3, 0]]
    return [(np.concatenate((top, bottom)), sides) for top, bottom in zip(corner, below)]
