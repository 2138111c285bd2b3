"""Section forces of bars and beams: axial and shear forces, bending and torsion moments."""

from __future__ import annotations

import numpy as np

from .. import _core
from .meshes import LinearBody


def stiffness_of(points, cells, sections):
    """Stiffness matrices (m, k, k) of undeformed cells, with the geometric stiffness of their tension, on the dofs of both ends:
    displacements, for beams rotations too. sections: "young", "area", "pull" (m,), for beams "inertia" (m, 2), "torsion",
    "shear_area", "shear" (m,) and "up" as well."""
    s, ends = sections, np.ascontiguousarray(points[cells])
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    if "inertia" in s:
        given = (np.ascontiguousarray(s[name], float) for name in ("young", "shear", "area", "inertia", "torsion", "shear_area"))
        k = _core.beam_stiffness(ends, np.asarray(s["up"], float), *given)
        return k + _bent(points, cells, length, s["pull"], s["up"]) if np.any(s["pull"]) else k
    k = _core.bar_stiffness(ends, np.ascontiguousarray(s["young"], float), np.ascontiguousarray(s["area"], float))
    if not np.any(s["pull"]):
        return k
    along = (ends[:, 1] - ends[:, 0]) / length[:, None]
    across = (s["pull"] / length)[:, None, None] * (np.eye(points.shape[1]) - along[:, :, None] * along[:, None, :])
    return k + np.block([[across, -across], [-across, across]])


def axes_of(points, cells, up=None):
    """Axes (m, k, dim) of cells as rows: along the cell; then in 2D across it, for beams in 3D the second and third axis of the
    section; bars in 3D have the first alone."""
    along = points[cells[:, 1]] - points[cells[:, 0]]
    along = along / np.linalg.norm(along, axis=1)[:, None]
    if up is None and points.shape[1] == 3:
        return along[:, None, :]
    if points.shape[1] == 2:
        return np.stack([along, np.stack([-along[:, 1], along[:, 0]], 1)], 1)
    second = up - (along @ up)[:, None] * along
    second /= np.linalg.norm(second, axis=1)[:, None]
    return np.stack([along, second, np.cross(along, second)], 1)


def _bent(points, cells, length, pull, up):
    """Geometric stiffness of beams under tension (m, 6 | 12, 6 | 12), for cubic deflections (Przemieniecki 1968)."""
    dim, n = points.shape[1], len(cells)
    one, size, axes = np.ones(n), length, axes_of(points, cells, up)
    bent = (
        np.array(
            [
                [36 * one, 3 * size, -36 * one, 3 * size],
                [3 * size, 4 * size**2, -3 * size, -(size**2)],
                [-36 * one, -3 * size, 36 * one, -3 * size],
                [3 * size, -(size**2), -3 * size, 4 * size**2],
            ]
        ).transpose(2, 0, 1)
        * (pull / (30 * size))[:, None, None]
    )
    each = 3 * dim - 3
    out = np.zeros((n, 2 * each, 2 * each))
    for axis in range(1, dim):
        # rows for deflection and slope along this axis at both nodes
        turn = np.zeros((n, 4, 2 * each))
        for node in range(2):
            turn[:, 2 * node, node * each : node * each + dim] = axes[:, axis]
            if dim == 2:
                turn[:, 2 * node + 1, node * each + 2] = 1
            else:  # slope along the second axis: rotation about the third; along the third: about the second, negative
                about = axes[:, 2] if axis == 1 else -axes[:, 1]
                turn[:, 2 * node + 1, node * each + 3 : node * each + 6] = about
        out += np.einsum("nij,nik,nkl->njl", turn, bent, turn)
    return out


def sum_of_cells(n, dofs, matrices):
    """Assembles matrices (m, k, k) of cells with dofs (m, k) into a scipy.sparse matrix (n, n)."""
    from scipy import sparse

    rows, columns = (np.broadcast_to(d, matrices.shape).ravel() for d in (dofs[:, :, None], dofs[:, None, :]))
    return sparse.csc_array((matrices.ravel(), (rows, columns)), (n, n))


def dofs_of(cells, each):
    """Dofs of both ends of cells (m, 2 each), for `each` dofs of a node."""
    return (each * cells[:, :, None] + np.arange(each)).reshape(len(cells), -1)


def followed(turns, given):
    """Solves turns x = given; smallest solution if a rotation is not held, as that of a straight beam in 3D about its axis."""
    try:
        return np.linalg.solve(turns, given)
    except np.linalg.LinAlgError:
        stiffness = np.abs(np.diag(turns))  # scaled, so that soft beams beside stiff ones count
        scale = 1 / np.sqrt(np.where(stiffness > 0, stiffness, 1))[:, None]
        return scale * np.linalg.lstsq(scale * turns * scale.T, scale * given, rcond=1e-13)[0]


def told(axes, force, one, other):
    """Section forces {name: values} from the forces at the second end of cells (m, dim) [N] and the moments at the first and the
    second end (m, 1 | 3) [N m], None for bars; axes (m, dim, dim): of the cells, as rows. See MeshView.section_forces."""
    out = {"axial_force": np.einsum("mk,mk->m", force, axes[:, 0])}
    if one is None:
        return out
    dim = axes.shape[1]
    out["shear_force"] = np.einsum("mk,mak->ma", force, axes[:, 1:])
    if dim == 2:
        out["shear_force"] = out["shear_force"][:, 0]
        out["bending_moment"] = np.concatenate([-one, other], axis=1)
        return out
    # bending along the second axis is a moment about the third; along the third axis about the second, negative
    about = np.stack([axes[:, 2], -axes[:, 1]], axis=1)
    ends = [-np.einsum("mk,mak->ma", one, about), np.einsum("mk,mak->ma", other, about)]
    out["bending_moment"] = np.concatenate(ends, axis=1)
    out["torsion_moment"] = np.einsum("mk,mk->m", other, axes[:, 0])
    return out


class LinearFrame(LinearBody):
    """A truss or a frame of bars or beams whose displacements are small; made by cairn.bars and cairn.beams."""

    def __init__(self, points, cells, sections, mass, stiffness, damping, groups=None, initial_force=None, initial_energy=0.0):
        given = {name: value for name, value in locals().items() if name not in ("self", "__class__")}
        super().__init__(
            points, mass, stiffness, damping=damping, groups=groups, initial_force=initial_force, initial_energy=initial_energy
        )
        #: arguments of the constructor, which scene files store
        self.given = given
        self.sections, self.lines = dict(sections), np.asarray(cells, int)

    def section_forces(self, displacement, model=None):
        """Section forces of each cell at a displacement (n, dim) [m], {name: (m, ...)}: see MeshView.section_forces."""
        s, dim = self.sections, self.dim
        u = np.asarray(displacement, float).reshape(-1, dim)
        k = stiffness_of(self.points, self.lines, s)
        axes = axes_of(self.points, self.lines, np.asarray(s["up"], float) if "up" in s else None)
        if "inertia" in s:
            u = np.concatenate([u, self._turned(u, k)], axis=1)
        each = u.shape[1]
        held = np.einsum("mij,mj->mi", k, u[self.lines].reshape(len(self.lines), -1))
        other = held[:, each:]
        out = told(axes, other[:, :dim], *((held[:, dim:each], other[:, dim:]) if each > dim else (None, None)))
        return out | {"axial_force": out["axial_force"] + s["pull"]}

    def _turned(self, u, k):
        """Condensed rotations (n, 1 | 3) [rad] at displacements u, zero at clamped nodes."""
        dim, n = self.dim, len(self.points)
        each = 3 * dim - 3
        full = sum_of_cells(each * n, dofs_of(self.lines, each), k).tocsr()
        dofs = np.arange(each * n).reshape(n, each)
        turned = dofs[np.setdiff1d(np.arange(n), self.sections["clamped"]), dim:].ravel()
        out = np.zeros(each * n)
        if len(turned):
            moments = -(full[turned][:, dofs[:, :dim].ravel()] @ u.ravel())
            out[turned] = followed(full[turned][:, turned].toarray(), moments)
        return out.reshape(n, each)[:, dim:]
