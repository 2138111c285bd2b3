"""Tractions on faces between cells that share their nodes, from the nodal forces of the cells.

Each corner of a cell needs the force K u + C v + M (a - g), plus that of its initial stress; its faces supply it, less the force
of cohesive zones on open faces. Around a boundary node this determines the force of every face. Around an inner node the faces
form a closed ring, whose forces are determined up to a self-equilibrated part: the solution nearest to the mean stress of both
cells is taken, weighted by the lengths of the faces. Uniform stress is reproduced exactly.
"""

from __future__ import annotations

import numpy as np

from .. import _core
from . import initial_stress as initially
from .components import parts_of


def cell_matrices(body):
    """Stiffness, damping and mass (m, dofs, dofs) of the cells of each kind, and forces (m, dofs) [N] of their initial stress,
    0.0 without one."""
    out = []
    forces = [0.0] * len(body.cells) if body.initial_stress is None else initially.forces_of_cells(body)
    for (kind, nodes), initial in zip(body.cells.items(), forces):
        of = body.given["density"]
        density = np.broadcast_to(np.asarray(of[kind] if isinstance(of, dict) else of, float), len(nodes))
        x = np.ascontiguousarray(body.points[nodes])
        k, m, _ = _core.element_matrices(kind, x, body.thickness, body.elasticity * body.thickness)
        m = m * density[:, None, None]
        if body.given.get("lumped"):
            m = m.sum(axis=2)[:, :, None] * np.eye(m.shape[1])
        a, b = body.given.get("rayleigh", (0.0, 0.0))
        out.append((k, a * m + b * k, m, initial))
    return out


class FaceForces:
    """Face tractions for the current nodes of an OpeningFaces; built anew whenever faces open."""

    def __init__(self, opening, matrices):
        from scipy import sparse
        from scipy.sparse.linalg import splu

        self.opening, self._matrices = opening, matrices
        corners, n = opening.corners, len(opening.node)
        self.joined = opening.node[corners[:, 0]] == opening.node[corners[:, 1]]  # corners of faces that are one node, (m, k)
        face, end = np.nonzero(self.joined)
        i, j, size = corners[face, 0, end], corners[face, 1, end], corners.shape[2] * opening.share[face, end]
        self._part = parts_of(np.stack([i, j], 1), n)
        grounded = np.zeros(n)  # one corner of each part is held: forces on a part are self-equilibrated
        grounded[np.unique(self._part, return_index=True)[1]] = size.mean() if len(size) else 1.0
        entries = np.concatenate([size, size, -size, -size, grounded])
        every = np.arange(n)
        rows, columns = np.concatenate([i, j, i, j, every]), np.concatenate([i, j, j, i, every])
        self._springs = splu(sparse.coo_array((entries, (rows, columns)), shape=(n, n)).tocsc())

    def asked(self, u, v, a):
        """Forces that cells need at their corners (corners, dim) [N], for displacements, velocities and accelerations (nodes,
        dim); gravity is subtracted from the accelerations."""
        out = []
        for (k, c, m, initial), nodes in zip(self._matrices, self.opening.body.cells.values()):
            parts = ((k, u), (c, v), (m, a))
            moved = sum(np.einsum("eij,ej->ei", of, w[nodes].reshape(len(nodes), -1)) for of, w in parts)
            out.append((moved + initial).reshape(-1, self.opening.body.dim))
        return np.concatenate(out)

    def tractions(self, asked, mean, held):
        """Tractions (m, k, dim) [Pa, in 2D times the thickness] at the corners of each face, on its first cell.

        asked (corners, dim) [N]: result of `asked`, less the forces of cohesive zones; mean (m, dim): tractions of mean stresses;
        held (nodes, dim): True for dofs of imposed motion, whose corners need no force of a face. The resultant of a part, due to
        loads, is shared evenly by its corners.
        """
        opening, force = self.opening, asked.copy()
        ends = opening.corners.shape[2]
        for end in range(ends):
            joined, (one, two) = self.joined[:, end], opening.corners[:, :, end].T
            part = mean[joined] * opening.share[joined, end, None]
            np.add.at(force, one[joined], -part)
            np.add.at(force, two[joined], part)
        given = held[opening.node]
        force[given] = 0
        count = np.bincount(self._part)
        for axis in range(force.shape[1]):
            force[:, axis] -= (np.bincount(self._part, force[:, axis]) / count)[self._part]
        moved = self._springs.solve(force)
        out = np.repeat(mean[:, None], ends, axis=1)
        for end in range(ends):
            one, two = opening.corners[:, :, end].T
            out[:, end] += np.where(self.joined[:, end, None] & ~given[one], ends * (moved[one] - moved[two]), 0.0)
        return out
