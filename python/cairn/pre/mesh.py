"""Surfaces of bodies: closed, turned outward, without holes, folds or slivers; each fault is named with its remedy.

A body needs a closed surface that does not cross itself, or its volume and inertia mean nothing. `check` refuses other surfaces;
`repair` mends them where possible and lists the repairs.

The module itself, called, reads the mesh of a body that deforms: `cairn.pre.mesh(gmsh)`, see `read`.
"""

from __future__ import annotations

import sys
from types import ModuleType

from ..base.libraries import library
from .closed_surfaces import (
    MeshError,
    MeshReport,
    check,
    check_polygon,
    crossing_pairs,
    cycle_labels,
    edge_through,
    hull,
    is_convex,
    is_star_shaped,
    parts,
    place,
    refuse_crossing,
    refuse_open,
    refuse_pinched,
    refuse_slivers,
    triangles,
    weld,
)
from .polygon_faces import SLIVER

__all__ = [
    "MeshError",
    "MeshReport",
    "SLIVER",
    "check",
    "check_polygon",
    "crossing_pairs",
    "cycle_labels",
    "edge_through",
    "hull",
    "is_convex",
    "is_star_shaped",
    "library",
    "parts",
    "place",
    "read",
    "refuse_crossing",
    "refuse_open",
    "refuse_pinched",
    "refuse_slivers",
    "repair",
    "triangles",
    "weld",
]


def read(source, model: str | None = None):
    """Mesh of a body that deforms: points (n, dim) [m], cells {kind: (m, nodes)} and groups {name: nodes}, for cairn.deformable,
    ElasticBody.read or your own use.

    source: a file that meshio reads (gmsh, MED, VTK, Abaqus's .inp), a meshio.Mesh, or the module gmsh, whose current model
    was meshed; model: the name of another of its models. The name alone, in the place of a file, is that model, too. Physical
    groups are groups by their names; where there are any, cells outside them are left out unless Mesh.SaveAll, as in a file
    that gmsh writes. Raises FileError for a file that is not there or holds no such mesh, ValueError for a model that is not
    there or has no cells.
    """
    from . import mesh_sources

    return mesh_sources.read(source, model)


class _Called(ModuleType):
    """This module, which reads when it is called."""

    def __call__(self, source, model: str | None = None):
        return read(source, model)


sys.modules[__name__].__class__ = _Called


def repair(vertices, faces, name: str = "mesh"):
    """A surface mended by cairn.pre.mesh_repair: vertices, triangles, list of repairs. Raises MeshError for remaining faults."""
    from . import mesh_repair

    return mesh_repair.repair(vertices, faces, name)
