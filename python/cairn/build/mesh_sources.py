"""Meshes of bodies that deform from elsewhere: files that meshio reads (gmsh, MED, VTK, Abaqus's .inp, ...), meshio's own,
gmsh's API.

Names become groups of nodes: physical groups of gmsh, families of MED, sets of nodes and of elements of Abaqus.
"""

from __future__ import annotations

import contextlib
import tempfile
from pathlib import Path

import numpy as np

from .. import _core

ELEMENTS = {e["cell"]: e for e in _core.elements()}


def is_source(mesh):
    """Whether `read` knows what to do with it."""
    return isinstance(mesh, (str, Path)) or _of_gmsh(mesh) or _of_meshio(mesh)


def _of_meshio(mesh):
    return all(hasattr(mesh, name) for name in ("points", "cells", "cell_sets", "point_sets", "field_data"))


def _of_gmsh(mesh):
    return hasattr(mesh, "write") and hasattr(getattr(mesh, "model", None), "mesh")


def read(mesh):
    """(points (n, dim), {kind: (m, nodes)}, {name: nodes}) of a file, a meshio.Mesh, or the module gmsh with its model meshed.

    Cells of the largest dimension are kept, and the nodes that they have. Raises FileError for a file that is not there or holds
    no such mesh (a ValueError, too)."""
    from ..post.errors import MissingFile
    from ..pre.importing import by_library, told_of
    from ..pre.mesh import library

    if _of_gmsh(mesh):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "model.msh"
            mesh.write(str(path))
            return read(path)
    if _of_meshio(mesh):
        return parts(mesh)
    path = Path(mesh)
    if not path.exists():
        raise MissingFile(path)
    with told_of(path):
        return parts(by_library(path, library("meshio", f"to read {path.suffix} files").read))


@contextlib.contextmanager
def told_of_contents(source, points, cells):
    """Where a body cannot be made of what a file holds, whatever its material, that is a FileError of the file."""
    try:
        yield
    except (ValueError, TypeError, ArithmeticError):
        if isinstance(source, (str, Path)):
            from ..pre.importing import told_of
            from .elastic import ElasticBody

            with told_of(Path(source)):
                ElasticBody(points, cells, young=1.0, poisson=0.0, density=1.0)
        raise


def parts(mesh):
    """The same of a meshio.Mesh."""
    found = {c.type for c in mesh.cells} & set(ELEMENTS)
    if not found:
        there = ", ".join(sorted({c.type for c in mesh.cells})) or "none"
        raise ValueError(f"the mesh holds cells of kind {there}: give cells of {', '.join(ELEMENTS)}")
    dim = max(ELEMENTS[kind]["dim"] for kind in found)
    kinds = [kind for kind in ELEMENTS if kind in found and ELEMENTS[kind]["dim"] == dim]
    cells = {kind: np.concatenate([c.data for c in mesh.cells if c.type == kind]).astype(np.int64) for kind in kinds}
    points = np.asarray(mesh.points, float)
    if dim == 2 and points.shape[1] > 2 and np.ptp(points[:, 2]) > 1e-9 * np.ptp(points, axis=0).max():
        low, high = points[:, 2].min(), points[:, 2].max()
        raise ValueError(f"the mesh is a surface from z = {low:g} to {high:g}: give flat cells at one z, or cells of a solid")
    used = np.unique(np.concatenate([part.ravel() for part in cells.values()]))
    place = np.full(len(points), -1)
    place[used] = np.arange(len(used))
    groups = {}
    for name, nodes in _named(mesh):
        kept = place[np.unique(nodes)]
        if (kept >= 0).any():
            groups[name] = np.union1d(groups.get(name, np.zeros(0, int)), kept[kept >= 0])
    return points[used, :dim], {kind: place[part] for kind, part in cells.items()}, groups


def _named(mesh):
    """(name, nodes) of all sets that a mesh names, some names more than once."""
    for name, nodes in mesh.point_sets.items():
        yield name, np.asarray(nodes, int)
    per_block = {name: rows for name, rows in mesh.cell_sets.items() if not name.startswith("gmsh:")}
    for name, (tag, dim) in mesh.field_data.items():  # as version 2 of gmsh's format has them
        tags = zip(mesh.cell_data.get("gmsh:physical", ()), mesh.cells)
        per_block.setdefault(name, [np.flatnonzero((found == tag) & (c.dim == dim)) for found, c in tags])
    families = getattr(mesh, "cell_tags", {})  # as MED has them: a number may have several names
    for tag, names in families.items():
        rows = [np.flatnonzero(found == tag) for found in mesh.cell_data.get("cell_tags", ())]
        for name in names:
            known = per_block.get(name, [np.zeros(0, int)] * len(rows))
            per_block[name] = [np.concatenate([a, b]) for a, b in zip(known, rows)]
    for name, blocks in per_block.items():
        of = [mesh.cells[b].data[np.asarray(rows, int)] for b, rows in enumerate(blocks) if rows is not None and len(rows)]
        if of:
            yield name, np.concatenate([part.ravel() for part in of])
    for tag, names in getattr(mesh, "point_tags", {}).items():
        nodes = np.flatnonzero(mesh.point_data.get("point_tags", np.zeros(0)) == tag)
        for name in names:
            yield name, nodes
