"""Meshes of deformable bodies from other programs: files that meshio reads (gmsh, MED, VTK, Abaqus's .inp, ...), objects of
meshio, gmsh's API.

Names become groups of nodes: physical groups of gmsh, families of MED, sets of nodes and of elements of Abaqus. Types of Abaqus
elements (CPE4R, CAX8, ...) give the shape of cells only: `plane` of the body selects plane strain, plane stress or axisymmetry.
"""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

from .. import _core
from ..base.errors import MissingFile
from ..base.libraries import by_library, library
from . import abaqus_types, med_cells
from .import_report import told_of

ELEMENTS = {e["cell"]: e for e in _core.elements()}
# Kinds of cells by gmsh's numbers, and indices of our nodes in gmsh's order where the orders differ.
OF_GMSH = {1: "line", 2: "triangle", 3: "quad", 4: "tetra", 5: "hexahedron", 8: "line3", 9: "triangle6", 10: "quad9",
           11: "tetra10", 12: "hexahedron27", 15: "vertex", 16: "quad8", 17: "hexahedron20"}  # fmt: skip
_EDGES = [*range(8), 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15]
ORDER_OF_GMSH = {"tetra10": [*range(8), 9, 8], "hexahedron20": _EDGES, "hexahedron27": [*_EDGES, 22, 23, 21, 24, 20, 25, 26]}


class Mesh(NamedTuple):
    """A mesh that cairn.deformable, ElasticBody.read and SolidBody.read take: points (n, dim) [m], cells {kind: (m, nodes)} by
    meshio's names and order of nodes, groups {name: nodes}."""

    points: np.ndarray
    cells: dict
    groups: dict


def is_source(mesh):
    """True for arguments that `read` takes: a path, a Mesh, the module gmsh or a meshio.Mesh."""
    return isinstance(mesh, (str, Path, Mesh)) or _of_gmsh(mesh) or _of_meshio(mesh)


def _of_meshio(mesh):
    return all(hasattr(mesh, name) for name in ("points", "cells", "cell_sets", "point_sets", "field_data"))


def _of_gmsh(mesh):
    return hasattr(mesh, "write") and hasattr(getattr(mesh, "model", None), "mesh")


def read(mesh, model=None):
    """Mesh (points (n, dim) [m], cells {kind: (m, nodes)}, groups {name: nodes}) of a file, a meshio.Mesh, or the module gmsh
    after meshing: of its current model, or the model named `model`. A path that is no file may be the name of a gmsh model.

    Keeps the cells of the largest dimension and their nodes. Raises FileError (a ValueError) if the file is missing or holds no
    such mesh."""
    if isinstance(mesh, Mesh):
        return mesh
    if _of_gmsh(mesh):
        return _of_model(mesh, model)
    if model is not None:
        raise ValueError(f"model is {model!r}, which is a name among the models of gmsh: give the module gmsh beside it")
    if _of_meshio(mesh):
        return parts(mesh)
    path = Path(mesh)
    if not path.exists():
        gmsh = sys.modules.get("gmsh")
        if gmsh and gmsh.isInitialized() and str(mesh) in gmsh.model.list():
            return _of_model(gmsh, str(mesh))
        raise MissingFile(path)
    with told_of(path):
        meshio, unknown = library("meshio", f"to read {path.suffix} files"), []
        found = by_library(path, lambda file: _by_meshio(file, meshio, unknown))
        if unknown:
            raise unknown[0]
        return parts(found)


def _by_meshio(path, meshio, unknown):
    """Mesh of a file by meshio. An UnknownType, whose message is complete, is appended to `unknown` instead of raised."""
    if path.suffix.lower() == ".med":
        return med_cells.read(path, meshio.read)
    if path.suffix.lower() != ".inp":
        return meshio.read(path)
    try:
        return abaqus_types.read(path, meshio.read)
    except abaqus_types.UnknownType as error:
        unknown.append(error)


def _of_model(gmsh, name):
    """Mesh of a gmsh model, the current one if name is None. Does not change the current model."""
    if not gmsh.isInitialized():
        raise ValueError("gmsh is not initialised, and holds no model: call gmsh.initialize() and make one")
    current = gmsh.model.getCurrent()
    name = current if name is None else name
    if name not in gmsh.model.list():
        raise ValueError(f"gmsh has no model {name!r}; there are {', '.join(map(repr, gmsh.model.list())) or 'none'}")
    try:
        gmsh.model.setCurrent(name)
        found = _blocks(gmsh)
    finally:
        gmsh.model.setCurrent(current)
    if not found.cells:
        raise ValueError(f"the model {name!r} of gmsh has no cells: call gmsh.model.mesh.generate")
    return parts(found)


def _blocks(gmsh):
    """Blocks of cells of gmsh's current model, as meshio would read them from its file: one block for each entity; only entities
    in physical groups, if there are any and Mesh.SaveAll is off; names of the groups as sets of rows."""
    tags, places, _ = gmsh.model.mesh.getNodes()
    place = np.zeros(int(tags.max(initial=0)) + 1, np.int64)
    place[tags] = np.arange(len(tags))
    chosen = gmsh.model.getPhysicalGroups() and not gmsh.option.getNumber("Mesh.SaveAll")
    cells, names = [], []
    for dim, entity in gmsh.model.getEntities():
        groups = [abs(int(tag)) for tag in gmsh.model.getPhysicalGroupsForEntity(dim, entity)]
        if chosen and not groups:
            continue
        for number, _, nodes in zip(*gmsh.model.mesh.getElements(dim, entity)):
            title, _, _, count, *_ = gmsh.model.mesh.getElementProperties(number)
            kind = OF_GMSH.get(int(number), title)
            rows = place[nodes].reshape(-1, count)[:, ORDER_OF_GMSH.get(kind, slice(None))]
            cells.append(SimpleNamespace(type=kind, data=rows, dim=dim))
            names.append({gmsh.model.getPhysicalName(dim, tag) for tag in groups} - {""})
    sets = {
        name: [np.arange(len(c.data)) if name in of else None for c, of in zip(cells, names)]
        for name in sorted(set().union(*names))
    }
    points = places.reshape(-1, 3) * gmsh.option.getNumber("Mesh.ScalingFactor")
    return SimpleNamespace(points=points, cells=cells, cell_sets=sets, point_sets={}, field_data={}, cell_data={})


def parts(mesh):
    """Mesh of a meshio.Mesh, or of an object with its fields."""
    found = {c.type for c in mesh.cells} & set(ELEMENTS)
    if not found:
        there = ", ".join(sorted({c.type for c in mesh.cells})) or "none"
        raise ValueError(f"the mesh holds cells of kind {there}: give cells of {', '.join(ELEMENTS)}")
    dim = max(ELEMENTS[kind]["dim"] for kind in found)
    kinds = [kind for kind in ELEMENTS if kind in found and ELEMENTS[kind]["dim"] == dim]
    lost = sorted({c.type for c in mesh.cells if c.dim >= dim} - set(kinds))
    if lost:
        raise ValueError(f"the mesh holds cells of kind {', '.join(lost)} beside {', '.join(kinds)}: give cells of "
                         f"{', '.join(kind for kind in ELEMENTS if ELEMENTS[kind]['dim'] == dim)}")  # fmt: skip
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
    return Mesh(points[used, :dim], {kind: place[part] for kind, part in cells.items()}, groups)


def _named(mesh):
    """(name, nodes) of all sets that a mesh names, some names more than once."""
    for name, nodes in mesh.point_sets.items():
        yield name, np.asarray(nodes, int)
    per_block = {name: rows for name, rows in mesh.cell_sets.items() if not name.startswith("gmsh:")}
    for name, entry in mesh.field_data.items():  # from gmsh format 2; MED files hold names of fields here
        if np.shape(entry) != (2,) or np.asarray(entry).dtype.kind not in "iu":
            continue
        tag, dim = entry
        tags = zip(mesh.cell_data.get("gmsh:physical", ()), mesh.cells)
        per_block.setdefault(name, [np.flatnonzero((found == tag) & (c.dim == dim)) for found, c in tags])
    families = getattr(mesh, "cell_tags", {})  # from MED: a number may have several names
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
