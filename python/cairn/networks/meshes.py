"""Contributions of meshes to the networks of a scene: conduction of elements, heat capacities, thermal stress."""

from __future__ import annotations

import numpy as np

from .. import _core
from ..base.materials import OfTemperature


def _constant(name, material, value):
    if value is None:
        raise ValueError(f"{name} of material {material.name!r} is not given, and a deformable body is made of it: "
                         f"give cairn.Material({material.name!r}, {name}=...)")  # fmt: skip
    if isinstance(value, OfTemperature):
        raise ValueError(f"{name} of material {material.name!r} depends on temperature: deformable bodies take a number so far")
    return value


def _cells(mesh):
    cells = getattr(mesh.body, "cells", None)
    if not cells:
        raise ValueError(f"the deformable body {mesh.d.name!r} has matrices and no cells: give cairn.ElasticBody to conduct")
    return cells


def branches(mesh, conductivity):
    """Nodes (m, 2) and conductances (m,) of branches equivalent to the conduction of a body's elements.

    A conductance is minus an off-diagonal entry of the integral of grad N . k grad N, whose rows sum to zero; it may be
    negative."""
    body, dim = mesh.body, mesh.dim
    # elasticity acting on the gradient of the first displacement component alone: strain xx and the shears with x
    first = np.zeros((3 * dim - 3, 3 * dim - 3))
    for row in (0, 2) if dim == 2 else (0, 3, 5):
        first[row, row] = conductivity * body.thickness
    keys, values, n = [], [], len(body.points)
    for kind, nodes in _cells(mesh).items():
        k, _, _ = _core.element_matrices(kind, np.ascontiguousarray(body.points[nodes]), 0.0, first)
        k = np.asarray(k).reshape(len(nodes), dim * nodes.shape[1], -1)[:, ::dim, ::dim]
        keys.append((nodes[:, :, None] * n + nodes[:, None, :]).ravel())
        values.append(-k.ravel())
    return _summed(np.concatenate(keys), np.concatenate(values), n)


def capacities(mesh, capacity, lumped):
    """(heat capacity of each node (n,) [J/K], pairs of nodes (m, 2), couplings of the consistent capacity matrix (m,) [J/K])."""
    body, dim = mesh.body, mesh.dim
    own = capacity * body.nodal_mass()
    if lumped is True:
        return own, np.zeros((0, 2), int), np.zeros(0)
    start, row, mass = body.lower[:3]
    column = np.repeat(np.arange(len(start) - 1), np.diff(start))
    kept = (row % dim == 0) & (column % dim == 0) & (row != column) & (mass != 0)
    pairs = np.stack([column[kept], row[kept]], axis=1) // dim
    coupled = -capacity * mass[kept]
    if lumped == "one point":  # integration in the middle of triangles, where N = 1/3
        if set(body.cells) != {"triangle"}:
            raise ValueError(f"lumped is 'one point', and {mesh.d.name!r} has other cells than triangles: leave lumped out")
        coupled *= 4 / 3
    return own, pairs, coupled


def _summed(keys, values, n):
    known, place = np.unique(keys, return_inverse=True)
    total = np.bincount(place, values, len(known))
    i, j = known // n, known % n
    kept = (i < j) & (total != 0)
    return np.stack([i[kept], j[kept]], axis=1), total[kept]


def in_plane(mesh, expansion):
    """Effective in-plane expansion [1/K]: larger by 1 + nu in plane strain, by the held out-of-plane strain."""
    strained = mesh.dim == 2 and mesh.body.plane == "strain"
    return expansion * (1 + mesh.body.poisson) if strained else expansion


def thermal_stress(mesh, which, expansion):
    """Thermal forces on the dofs per nodal temperature [N/K], rows by dofs: stiffness of each cell times its free expansion for
    the mean temperature of its nodes."""
    body, dim = mesh.body, mesh.dim
    if hasattr(body, "materials"):  # the material subtracts the free strain
        none = {"start": np.zeros(0, np.int64), "node": np.zeros(0, np.int32), "value": np.zeros(0)}
        return {"mesh": which, "expansion": expansion, **none}
    dofs, nodes_of, values = [], [], []
    for kind, nodes in _cells(mesh).items():
        x = np.ascontiguousarray(body.points[nodes])
        k, _, _ = _core.element_matrices(kind, x, 0.0, body.elasticity * body.thickness)
        many = nodes.shape[1]
        free = in_plane(mesh, expansion) * (x - x.mean(axis=1, keepdims=True)).reshape(len(nodes), -1)
        force = np.einsum("eij,ej->ei", np.asarray(k).reshape(len(nodes), dim * many, -1), free) / many
        dof = (dim * nodes[:, :, None] + np.arange(dim)).reshape(len(nodes), -1)
        dofs.append(np.repeat(dof, many, axis=1).ravel())
        nodes_of.append(np.tile(nodes, (1, dim * many)).ravel())
        values.append(np.repeat(force, many, axis=1).ravel())
    n = len(body.points)
    known, place = np.unique(np.concatenate(dofs) * n + np.concatenate(nodes_of), return_inverse=True)
    total = np.bincount(place, np.concatenate(values), len(known))
    start = np.searchsorted(known, np.arange(dim * n + 1, dtype=np.int64) * n)
    return {"mesh": which, "expansion": expansion, "start": start, "node": (known % n).astype(np.int32), "value": total}


def stress(mesh, found, temperature, expansion, reference):
    """Stress in the middle of cells (see cairn.elastic) less that of the free expansion for the mean nodal temperature of each
    cell [Pa]."""
    straight = np.zeros(3 * mesh.dim - 3)
    straight[: mesh.dim] = in_plane(mesh, expansion)
    per_kelvin = mesh.body.elasticity @ straight
    return {
        kind: value - np.mean(temperature[mesh.body.cells[kind]] - reference, axis=1)[:, None] * per_kelvin
        for kind, value in found.items()
    }


def stress_across(mesh, stress, temperature, expansion, reference):
    """Out-of-plane stress zz of a body in 2D, {kind: (m,)} [Pa], from the result of `stress`; in plane strain the held expansion
    contributes -young times the free thermal strain."""
    found, body = mesh.body.stress_across(stress), mesh.body
    if body.plane == "stress":
        return found
    young = 2 * (1 + body.poisson) * body.elasticity[2, 2]
    return {
        kind: value - young * expansion * np.mean(temperature[body.cells[kind]] - reference, axis=1)
        for kind, value in found.items()
    }
