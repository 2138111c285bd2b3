"""A linear elastic body by finite elements of first and second order; at rest, or in a scene (cairn.deformable).

body = ElasticBody(points, {"quad": cells}, young=200e9, poisson=0.3, density=7800.0)
u = body.solve(fixed={"left": "xy"}, force={"right": (0.0, -1e3)})
"""

from __future__ import annotations

import contextlib
import warnings
from functools import cached_property
from pathlib import Path

import numpy as np

from .. import _core
from ..base import checks
from . import initial_stress as initially
from .mesh_parts import group_nodes

ELEMENTS = {e["cell"]: e for e in _core.elements()}

# Edges or faces of a cell, anticlockwise from outside; sides of second order are cut at their mid-side nodes.
SIDES = {cell: np.array(e["sides"])[:, : 2 * e["dim"] - 2] for cell, e in ELEMENTS.items()}


def _checked_cells(cells):
    if not isinstance(cells, dict):
        raise ValueError(f"cells is {type(cells).__name__}: give {{kind: nodes (m, k)}}, of the kinds {', '.join(ELEMENTS)}")


@contextlib.contextmanager
def told_of_contents(source, points, cells):
    """Turns an error of a body made from a file into a FileError, if the mesh is at fault and not the material.

    Parameters
    ----------
    source : path-like or object
        The file, or the mesh that was given in its place.
    points : ndarray (n, dim)
        Its nodes [m].
    cells : dict
        Its cells {kind: (m, nodes)}.

    Yields
    ------
    None
        Nothing.

    Raises
    ------
    FileError
        If a body of the mesh alone fails, too.
    """
    try:
        yield
    except (ValueError, TypeError, ArithmeticError):
        if isinstance(source, (str, Path)):
            from ..pre.import_report import told_of

            with told_of(Path(source)):
                ElasticBody(points, cells, young=1.0, poisson=0.0, density=1.0)
        raise


class ElasticBody:
    """A linear elastic body: small displacements, isotropic elasticity, consistent or lumped mass, Rayleigh damping.

    Parameters
    ----------
    points : array_like (n, dim)
        Nodes [m].
    cells : dict
        {"triangle" | "quad" | "triangle6" | "quad8" | "quad9" | "tetra" | "hexahedron" | "tetra10" | "hexahedron20" |
        "hexahedron27": (m, nodes) whole numbers, in the order of meshio}.
    young : float
        Young's modulus [Pa].
    poisson : float
        Poisson's ratio [-].
    density : float or dict, default 0
        Density [kg/m3], or {kind: (m,)} of each cell.
    groups : dict, optional
        {name: nodes}.
    plane : {"strain", "stress"}
        State of a body in 2D.
    thickness : float, default 1
        Thickness of a body in 2D [m].
    lumped : bool, default False
        Lumps the mass.
    rayleigh : tuple, default (0, 0)
        Coefficients (a, b) of C = a M + b K [1/s, s].
    initial_stress : array_like (6,), callable or dict, optional
        Stress in the undeformed body [Pa], as for `cairn.deformable`.

    Raises
    ------
    ValueError
        If a value is wrong; the message names the value, the cell and the remedy.

    Examples
    --------
    >>> corners = [[0, 0], [1, 0], [1, 1], [0, 1]]
    >>> square = cn.ElasticBody(corners, {"quad": [[0, 1, 2, 3]]}, young=1e6, poisson=0.3, density=1000.0)
    >>> round(float(square.nodal_mass().sum()), 6)
    1000.0
    """

    #: initial stress {kind: (m, points, 6)}, 11 22 33 12 13 23 [Pa]; its nodal forces (n dofs) [N]; its stored energy [J]
    initial_stress = initial_force = None
    initial_energy = 0.0

    def __init__(
        self, points, cells, *, young, poisson, density=0.0, groups=None, plane="strain", thickness=1.0,
        lumped=False, rayleigh=(0.0, 0.0), initial_stress=None,
    ):  # fmt: skip
        _checked_cells(cells)
        #: arguments of the constructor, which scene files store
        self.given = {name: value for name, value in locals().items() if name != "self"}
        self.points = np.ascontiguousarray(points, float)
        if self.points.ndim != 2 or self.points.shape[1] not in (2, 3):
            raise ValueError(f"points have shape {self.points.shape}: give places (n, 2) or (n, 3) [m]")
        if not np.all(np.isfinite(self.points)):
            at = int(np.argmin(np.isfinite(self.points).all(axis=1)))
            raise ValueError(f"points[{at}] is {self.points[at].tolist()}: give finite places [m]")
        whole = {kind: density for kind in cells} if not isinstance(density, dict) else density
        if set(whole) != set(cells):
            raise ValueError(f"density is of {sorted(whole)}: give one for each kind of cells, {sorted(cells)}")
        if not isinstance(density, dict) and checks.number("density", density) < 0:
            raise ValueError(f"density is {density}: give a number >= 0 [kg/m3]")
        if not sum(len(nodes) for nodes in cells.values()):
            raise ValueError(f"cells holds no cell: give one at least, of {', '.join(ELEMENTS)}")
        self.dim = self.points.shape[1]
        self.groups = checks.node_groups(groups, len(self.points))
        self.elasticity = _elasticity(self.dim, checks.positive("young", young), checks.number("poisson", poisson), plane)
        self.plane, self.poisson = plane, float(poisson)
        self.thickness = checks.positive("thickness", thickness) if self.dim == 2 else 1.0
        self.cells, n = {}, self.points.size
        unknown, stiffness, mass = [], [], []
        for kind, nodes in cells.items():
            nodes = self._checked(kind, np.ascontiguousarray(nodes))
            x = np.ascontiguousarray(self.points[nodes])
            each = np.ndim(whole[kind]) > 0  # a density for each cell
            one = 1.0 if each else float(whole[kind])
            k, m, wrong = _core.element_matrices(kind, x, one * self.thickness, self.elasticity * self.thickness)
            if each:
                own = checks.real_array(f"density of {kind} cells", whole[kind], (len(nodes),))
                if np.any(own < 0):
                    raise ValueError(f"density of {kind} cell {int(np.argmin(own))} is {own.min():g}: give a number >= 0 [kg/m3]")
                m = m * own[:, None, None]
            if np.any(wrong):
                at = int(np.argmax(wrong))
                named = f"{kind} {at} with nodes {nodes[at].tolist()}"
                raise ValueError(f"{named} is flat or inside out: turn its nodes the other way round")
            unknown.append((self.dim * nodes[:, :, None] + np.arange(self.dim)).reshape(len(nodes), -1).astype(np.int32))
            stiffness.append(k)
            mass.append(m)
            self.cells[kind] = nodes
        start, row, (k, m) = _core.assembled(n, unknown, [stiffness, mass])
        self._mass = _row_sums(start, row, m)
        #: True with cells of second order: row sums of their mass may vanish, so that the diagonal is scaled instead
        self.second_order = any(ELEMENTS[kind]["order"] > 1 for kind in self.cells)
        if self.second_order:
            self._mass = self._lumped(mass)
        if checks.flag("lumped", lumped):
            m = np.zeros(len(row))
            m[start[:-1]] = self._mass  # a column begins with its diagonal entry
        #: start, row and values of mass, stiffness and damping: lower triangles by columns, on one pattern
        a, b = checks.rayleigh(rayleigh)
        self.lower = start, row, m, k, a * m + b * k
        if initial_stress is not None:
            self._take_stress(initial_stress)
            self.initial_force, self.initial_energy = initially.forces(self)

    def _take_stress(self, given):
        """Evaluates an initial stress at the integration points, and keeps the values for scene files, which hold no function."""
        self.initial_stress = initially.at_points(given, self.points, self.cells, self.groups)
        self.given["initial_stress"] = self.initial_stress

    @cached_property
    def M(self):
        """Mass (n dofs, n dofs), scipy.sparse [kg]."""
        return self._full(2)

    @cached_property
    def K(self):
        """Stiffness (n dofs, n dofs), scipy.sparse [N/m]."""
        return self._full(3)

    @cached_property
    def C(self):
        """Damping (n dofs, n dofs), scipy.sparse [N s/m]."""
        return self._full(4)

    def _full(self, which):
        from scipy import sparse

        start, row = self.lower[:2]
        below = sparse.csc_array((self.lower[which], row, start), (self.points.size, self.points.size), copy=True)
        below.eliminate_zeros()
        return (below + sparse.tril(below, -1).T).tocsc()

    def _lumped(self, mass):
        """Lumped masses of dofs (n dofs,) [kg]: row sums, or for second order diagonals scaled to the mass of the cell."""
        out = np.zeros(self.points.size)
        for (kind, nodes), m in zip(self.cells.items(), mass):
            second = ELEMENTS[kind]["order"] > 1
            of_nodes = _core.lumped_masses(kind, m) if second else m[:, :: self.dim, :: self.dim].sum(axis=2)
            for axis in range(self.dim):
                np.add.at(out, self.dim * nodes + axis, of_nodes)
        return out

    def nodal_mass(self):
        """Gives the lumped mass of each node.

        It is the row sum; for cells of second order the diagonal of the consistent mass, scaled to the mass of the cell (Hinton,
        Rock & Zienkiewicz 1976).

        Returns
        -------
        ndarray (n,)
            Masses [kg].
        """
        return self._mass.reshape(-1, self.dim)[:, 0]

    @classmethod
    def read(cls, path, **options):
        """Makes a body from a mesh of another program.

        Named sets become groups of nodes: see cairn.pre.mesh_sources.

        Parameters
        ----------
        path : path-like, meshio.Mesh or module gmsh
            A file that meshio reads, or a mesh in memory.
        **options : optional
            Those of the class.

        Returns
        -------
        ElasticBody
            A body of the class.

        Raises
        ------
        FileError
            If the file is missing or holds no such mesh; a ValueError, too.
        """
        from ..pre import mesh_sources

        points, cells, groups = mesh_sources.read(path)
        with told_of_contents(path, points, cells):
            return cls(points, cells, groups=groups, **options)

    def _checked(self, kind, nodes):
        known = ELEMENTS
        if kind not in known or known[kind]["dim"] != self.dim:
            fit = [name for name, e in known.items() if e["dim"] == self.dim]
            raise ValueError(f"cells of kind {kind!r} do not fit {self.dim} dimensions: give {' or '.join(fit)}")
        if nodes.ndim != 2 or nodes.shape[1] != known[kind]["nodes"] or nodes.dtype.kind not in "iu":
            raise ValueError(f"{kind} cells have shape {nodes.shape}: give whole numbers (n, {known[kind]['nodes']})")
        if nodes.size and not (nodes.min() >= 0 and nodes.max() < len(self.points)):
            told = f"{kind} cells name nodes {nodes.min()} to {nodes.max()}, there are {len(self.points)}"
            raise ValueError(f"{told}: number them from 0, by the rows of points")
        return nodes.astype(np.int64)

    def __repr__(self):
        cells = ", ".join(f"{len(nodes)} {kind}" for kind, nodes in self.cells.items())
        groups = f"; groups {', '.join(map(repr, self.groups))}" if self.groups else ""
        return f"<{type(self).__name__}, {self.dim}D: {len(self.points)} nodes, cells: {cells}{groups}>"

    def boundary_edges(self):
        """Gives the boundary edges in 2D: edges of a single cell.

        Returns
        -------
        ndarray (m, 2)
            Nodes, with the body on their left.
        """
        edges = np.concatenate([cells[:, SIDES[kind]].reshape(-1, 2) for kind, cells in self.cells.items()])
        if sum(len(cells) for cells in self.cells.values()) == 1:
            return edges
        _, first, count = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
        return edges[np.sort(first[count == 1])]

    def boundary_faces(self):
        """Gives the boundary faces in 3D: faces of a single cell.

        Returns
        -------
        ndarray (m, 4)
            Nodes, anticlockwise from outside; the fourth node of a triangle is -1.
        """
        parts = [np.where(SIDES[kind] < 0, -1, cells[:, SIDES[kind]]) for kind, cells in self.cells.items()]
        faces = np.concatenate([part.reshape(-1, 4) for part in parts])
        _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
        return faces[np.sort(first[count == 1])]

    def nodal_stress(self, displacement):
        """Gives the mean stress of the cells round each node.

        Parameters
        ----------
        displacement : array_like (n, dim)
            Displacement [m].

        Returns
        -------
        ndarray (n, 3) or (n, 6)
            Stress [Pa].
        """
        return self.nodal_mean(self.stress(displacement))

    def nodal_mean(self, of_cells):
        """Gives the mean over the cells round each node of values of cells.

        Parameters
        ----------
        of_cells : dict
            {kind: (m, k)}.

        Returns
        -------
        ndarray (n, k)
            Means.
        """
        total = np.zeros((len(self.points), next(iter(of_cells.values())).shape[1]))
        count = np.zeros(len(self.points))
        for kind, stress in of_cells.items():
            for corner in self.cells[kind].T:
                np.add.at(total, corner, stress)
                np.add.at(count, corner, 1)
        return total / np.maximum(count, 1)[:, None]

    def nodes(self, group):
        """Gives the nodes of a group.

        Parameters
        ----------
        group : str or array_like of int
            Name of the group, "boundary" for all nodes there, or the numbers themselves.

        Returns
        -------
        ndarray
            Numbers of the nodes.

        Raises
        ------
        ValueError
            If there is no such group or node.
        """
        if not isinstance(group, str):
            return checks.node_numbers("the group", group, len(self.points))
        return group_nodes(self, group)

    def dofs(self, fixed):
        """Gives the numbers of held dofs.

        Parameters
        ----------
        fixed : dict
            {group: "x" | "xy" | ...}.

        Returns
        -------
        ndarray
            Rising numbers of dofs.
        """
        out = [self.dim * self.nodes(g) + k for g, axes in fixed.items() for k in checks.fixed_axes(g, axes, self.dim)]
        return np.unique(np.concatenate(out)) if out else np.zeros(0, int)

    def load(self, force):
        """Spreads total forces evenly over the nodes of groups.

        Parameters
        ----------
        force : dict
            {group: total force (dim,)} [N].

        Returns
        -------
        ndarray (n dofs,)
            Forces of nodes [N].
        """
        out = np.zeros(self.points.size)
        for group, total in force.items():
            nodes = self.nodes(group)
            out.reshape(-1, self.dim)[nodes] += checks.real_array("force", total, (self.dim,)) / len(nodes)
        return out

    def solve(self, fixed, force=None, displacement=None):
        """Solves for static equilibrium.

        Parameters
        ----------
        fixed : dict
            {group: axes} of held dofs.
        force : dict or array_like (n dofs,), optional
            {group: total force (dim,)}, or forces of all dofs [N].
        displacement : array_like (n, dim), optional
            Imposed on the held dofs [m]; zero when not given.

        Returns
        -------
        ndarray (n, dim)
            Displacement [m].

        Raises
        ------
        RuntimeError
            If the stiffness is singular: a rigid motion is not held.
        """
        from scipy.sparse.linalg import spsolve

        held = self.dofs(fixed)
        free = np.setdiff1d(np.arange(self.points.size), held)
        u = np.zeros(self.points.size)
        if displacement is not None:
            u[held] = checks.real_array("displacement", displacement, self.points.shape).ravel()[held]
        f = np.zeros(len(u)) if force is None else self.load(force) if isinstance(force, dict) else np.asarray(force, float)
        if self.initial_force is not None:
            f = f - self.initial_force
        right = (f - self.K @ u)[free]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a singular matrix shows in the residual, which is checked below
            u[free] = spsolve(self.K[free][:, free], right)
        left, size = np.abs((f - self.K @ u)[free]), np.abs(right)
        if not left.max(initial=0) <= 1e-6 * size.max(initial=0):
            node = int(free[np.argmax(left)]) // self.dim
            told = f"no rest: forces of {left.max():g} N are left at node {node}, of {size.max():g} N"
            raise RuntimeError(f"{told}: the body moves as a whole, or a part of it; hold more dofs in `fixed`")
        return u.reshape(-1, self.dim)

    def stress(self, displacement):
        """Gives the stress in the middle of each cell.

        Parameters
        ----------
        displacement : array_like (n, dim)
            Displacement [m].

        Returns
        -------
        dict
            {kind: (m, 3) or (m, 6)} in the order xx yy [zz] xy [yz zx] [Pa], tension positive.
        """
        u = np.asarray(displacement, float).reshape(self.points.shape)
        found = {
            kind: _core.element_stress(kind, self.points[nodes], self.elasticity, np.ascontiguousarray(u[nodes]))
            for kind, nodes in self.cells.items()
        }
        if self.initial_stress is None:
            return found
        return {kind: stress + initially.shown(self, kind) for kind, stress in found.items()}

    def stress_across(self, stress):
        """Gives the out-of-plane stress zz in the middle of each cell of a body in 2D; zero in plane stress.

        Parameters
        ----------
        stress : dict
            As `stress` gave it [Pa].

        Returns
        -------
        dict
            {kind: (m,)} [Pa].
        """
        if self.plane == "stress":
            return {kind: np.zeros(len(found)) for kind, found in stress.items()}
        straight, other = self.elasticity[0, :2]
        poisson = other / (straight + other)
        out = {kind: poisson * (found[:, 0] + found[:, 1]) for kind, found in stress.items()}
        if self.initial_stress is not None:
            for kind, of_points in self.initial_stress.items():
                xx, yy, zz = of_points.mean(axis=1)[:, :3].T
                out[kind] += zz - poisson * (xx + yy)
        return out


def _row_sums(start, row, value):
    """Row sums of a symmetric matrix given by its lower triangle."""
    n = len(start) - 1
    column = np.repeat(np.arange(n), np.diff(start))
    above = np.where(row == column, 0.0, value)
    return np.bincount(row, value, n) + np.bincount(column, above, n)


def _elasticity(dim, young, poisson, plane):
    """Isotropic elasticity matrix for engineering strains [Pa]."""
    if not -1 < poisson < 0.5 and not (plane == "stress" and poisson == 0.5):
        raise ValueError(f"poisson is {poisson}: give a value above -1 and below 1/2")
    shear = young / (2 * (1 + poisson))
    if dim == 2 and plane == "stress":
        out = young / (1 - poisson**2) * np.array([[1, poisson, 0], [poisson, 1, 0], [0, 0, (1 - poisson) / 2]])
        return np.ascontiguousarray(out)
    if dim == 2 and plane == "axisymmetric":
        told = "plane is 'axisymmetric', which an ElasticBody does not know"
        raise ValueError(f"{told}: give cairn.SolidBody(points, cells, cairn.IsotropicElastic(young=..., poisson=...), "
                         'kinematics="small", plane="axisymmetric")')  # fmt: skip
    if plane != "strain":
        raise ValueError(f"plane is {plane!r}: give 'strain' or 'stress'")
    lame = young * poisson / ((1 + poisson) * (1 - 2 * poisson))
    size = 3 * dim - 3
    out = np.zeros((size, size))
    out[:dim, :dim] = lame + 2 * shear * np.eye(dim)
    out[range(dim, size), range(dim, size)] = shear
    return out
