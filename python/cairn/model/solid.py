"""A finite element body of any material of solids, with small or large strains; at rest, or in a scene (cairn.deformable).

body = SolidBody(points, {"quad": cells}, NeoHookean(young=1e6, poisson=0.3), density=1000.0)
u = body.solve(fixed={"left": "xy"}, force={"right": (0.0, -1e3)}, increments=4)
"""

from __future__ import annotations

import warnings

import numpy as np

from .. import _core
from ..base import checks
from .bulk import BulkMaterial
from .elastic import ElasticBody, _checked_cells
from .initial_stress import of_block

KINEMATICS = ("small", "corotational", "total_lagrangian", "logarithmic")


class SolidBody(ElasticBody):
    """A body with a material of solids at the Gauss points of its cells, for small or large strains.

    Parameters
    ----------
    points : array_like (n, dim)
        Nodes [m].
    cells : dict
        {kind: (m, nodes)}, as for ElasticBody.
    material : BulkMaterial or dict
        NeoHookean(...) or another material of solids; {kind of cells: material}; or, with several materials in a kind,
        {kind: ([materials], number (m,) of the material of each cell)}.
    density : float or dict, default 0
        Density [kg/m3], or {kind: (m,)} of each cell.
    groups : dict, optional
        {name: nodes}.
    kinematics : {"small", "corotational", "total_lagrangian", "logarithmic"}, optional
        Small strains, or the strain measure of the law in axes that rotate with the material: Biot's ("corotational"), Green's
        ("total_lagrangian") or Hencky's ("logarithmic"). Materials that take the deformation gradient allow "total_lagrangian"
        alone, their default; that of others is "small". Users' routines (UMAT) are called as with NLGEOM unless it is "small".
    plane : {"strain", "stress", "axisymmetric"}
        State of a body in 2D; axisymmetric about y, with x the radius.
    thickness : float, default 1
        Thickness of a body in 2D [m].
    mean_dilatation : bool, default False
        Makes the dilatation uniform in each cell, against volumetric locking near nu = 1/2; refused for triangle and tetra cells,
        whose dilatation is uniform anyway.
    lumped : bool, default False
        Lumps the mass.
    rayleigh : tuple, default (0, 0)
        Coefficients (a, b) of C = a M + b K [1/s, s], with the initial stiffness, which damps rotations as well.
    initial_stress : array_like (6,), callable or dict, optional
        Cauchy stress in the initial configuration [Pa], as for `cairn.deformable`; the material starts from the strain of this
        stress, so that it yields at the remaining strength.

    Raises
    ------
    ValueError
        If a value is wrong; the message names the value, the cell and the remedy.
    """

    def __init__(
        self, points, cells, material, *, density=0.0, groups=None, kinematics=None, plane="strain", thickness=1.0,
        mean_dilatation=False, lumped=False, rayleigh=(0.0, 0.0), initial_stress=None,
    ):  # fmt: skip
        made_of = {name: value for name, value in locals().items() if name not in ("self", "__class__")}
        _checked_cells(cells)
        self._layout = _layout(cells, material)
        if kinematics is None:
            kinematics = "total_lagrangian" if any(m.takes_gradient for _, _, m in self._layout) else "small"
        if kinematics not in KINEMATICS:
            raise ValueError(f"kinematics is {kinematics!r}: give one of {', '.join(KINEMATICS)}")
        self.kinematics, self.mean_dilatation = kinematics, checks.flag("mean_dilatation", mean_dilatation)
        if plane not in ("strain", "stress", "axisymmetric"):
            raise ValueError(f"plane is {plane!r}: give 'strain', 'stress' or 'axisymmetric'")
        points = np.ascontiguousarray(points, float)
        if plane != "strain" and points.ndim == 2 and points.shape[1] == 3:
            raise ValueError(f"plane is {plane!r}, and points are of space: leave it out, or give points (n, 2)")
        if plane == "axisymmetric" and points.ndim == 2:
            points = _on_axis(points)
        if plane == "axisymmetric" and points.ndim == 2 and np.any(points[:, 0] < 0):
            at = int(np.argmin(points[:, 0]))
            raise ValueError(f"node {at} has the radius {points[at, 0]:g} m: give x >= 0, the body goes round the axis x = 0")
        # only the mass of this ElasticBody is used; for a ring it is that of the whole circumference
        if plane == "axisymmetric" and isinstance(density, dict):
            raise ValueError("density of an axisymmetric body is one number: tie bodies of several densities by cairn.tied")
        around = 2 * np.pi if plane == "axisymmetric" and points.ndim == 2 and points.shape[1] == 2 else 1.0
        heavy = density if isinstance(density, dict) else density * around
        super().__init__(
            points, cells, young=1.0, poisson=0.0, density=heavy, groups=groups,
            thickness=1.0 if plane == "axisymmetric" else thickness, lumped=lumped,
        )  # fmt: skip
        self.given = made_of  # stored in scene files
        self.plane = plane
        if around > 1:
            self._weigh_rings(lumped, float(density))
        if initial_stress is not None:
            self._take_stress(initial_stress)
        start, row, mass = self.lower[:3]
        stiffness = self.tangent(np.zeros_like(self.points))[1]
        a, b = checks.rayleigh(rayleigh)
        self.lower = start, row, mass, stiffness, a * mass + b * stiffness

    def _weigh_rings(self, lumped, density):
        """Replaces the mass by that of axisymmetric rings, whose radius varies with the nodes."""
        unknown, mass = [], []
        for kind, nodes in self.cells.items():
            m = _core.ring_masses(kind, np.ascontiguousarray(self.points[nodes]), density)
            unknown.append((2 * nodes[:, :, None] + np.arange(2)).reshape(len(nodes), -1).astype(np.int32))
            mass.append(m)
        start, row, (m,) = _core.assembled(self.points.size, unknown, [mass])
        self._mass = self._lumped(mass)
        if lumped:
            m = np.zeros(len(row))
            m[start[:-1]] = self._mass
        self.lower = start, row, m, *self.lower[3:]

    def blocks(self):
        """Gives the blocks of the core's BulkModel.

        Returns
        -------
        list of dict
            One for each kind of cells and material.
        """
        return [
            {
                "cell": kind, "nodes": self.cells[kind][rows].astype(np.int32), "material": material.name,
                "params": list(material.values), "kinematics": self.kinematics, "plane": self.plane,
                "mean_dilatation": self.mean_dilatation, "thickness": self.thickness, **of_block(self, kind, rows),
            }
            for kind, rows, material in self._layout
        ]  # fmt: skip

    def layout(self):
        """Gives kinds, rows and materials of the blocks.

        Returns
        -------
        list of tuple
            (kind of cells, rows in that kind, material) of each block.
        """
        return self._layout

    @property
    def materials(self):
        """{kind of cells: material}, or a list if the cells of a kind have several materials."""
        out = {}
        for kind, _, material in self._layout:
            out.setdefault(kind, []).append(material)
        return {kind: found if len(found) > 1 else found[0] for kind, found in out.items()}

    def model(self):
        """Makes a model that evaluates stresses and keeps the states of the material.

        Returns
        -------
        _core.BulkModel
            The model, in its initial state.
        """
        return _core.BulkModel(self.dim, self.points.ravel(), self.blocks())

    def tangent(self, displacement, model=None, h=np.inf):
        """Gives forces and their derivative at a displacement.

        Parameters
        ----------
        displacement : array_like (n, dim)
            Displacement [m].
        model : _core.BulkModel, optional
            States of the material; those of a new model when not given.
        h : float, default inf
            Time in which it is reached [s], inf in statics; users' routines are told 1 s then.

        Returns
        -------
        force : ndarray (n dofs,)
            Forces [N].
        values : ndarray
            Lower triangle of their derivative [N/m].
        energy : float
            Stored energy [J].
        dissipated : float
            Dissipated energy [J].

        Raises
        ------
        ValueError
            If a cell is inside out or has no finite stress; the message names it.
        """
        model = model or self.model()
        u = np.ascontiguousarray(displacement, float).ravel()
        force, values, wrong, energy, dissipated = model.evaluate(u, h, 1.0, *self.lower[:2])
        if wrong is not None:
            raise ValueError(wrong)
        return force, values, energy, dissipated

    def solve(self, fixed, force=None, displacement=None, *, increments=1, tolerance=1e-10, most=50, start=None, model=None):
        """Solves for static equilibrium, by Newton's method with a line search.

        The load is applied in equal increments; one that does not converge is halved, up to four times.

        Parameters
        ----------
        fixed : dict
            {group: axes} of held dofs.
        force : dict or array_like (n dofs,), optional
            {group: total force (dim,)}, or forces of all dofs [N].
        displacement : array_like (n, dim), optional
            Imposed on the held dofs [m]; zero when not given.
        increments : int, default 1
            Number of increments.
        tolerance : float, default 1e-10
            Largest residual, relative to the forces [-].
        most : int, default 50
            Most iterations of an increment.
        start : array_like (n, dim), optional
            Initial displacement [m].
        model : _core.BulkModel, optional
            Initial states of the material, updated to the final ones.

        Returns
        -------
        ndarray (n, dim)
            Displacement [m].

        Raises
        ------
        RuntimeError
            If an increment does not converge.
        """
        model = model or self.model()
        held = self.dofs(fixed)
        free = np.setdiff1d(np.arange(self.points.size), held)
        u = np.zeros(self.points.size) if start is None else np.array(start, float).ravel()
        first = u[held].copy()
        last = (
            np.zeros(len(held))
            if displacement is None
            else checks.real_array("displacement", displacement, self.points.shape).ravel()[held]
        )
        load = (
            np.zeros(len(u))
            if force is None
            else self.load(force)
            if isinstance(force, dict)
            else np.asarray(force, float).ravel()
        )

        def carried(u, begin, end, halvings):
            """Equilibrium at the share `end` of the load, from that at `begin`; halves the increment if needed."""
            try:
                u = self._at_rest(model, u, free, held, first + end * (last - first), end * load, tolerance, most)
            except RuntimeError:
                if not halvings:
                    raise
                middle = 0.5 * (begin + end)
                return carried(carried(u, begin, middle, halvings - 1), middle, end, halvings - 1)
            model.commit()
            return u

        for k in range(1, checks.count("increments", increments, 1) + 1):
            u = carried(u, (k - 1) / increments, k / increments, 4)
        return u.reshape(-1, self.dim)

    def _at_rest(self, model, u, free, held, at, load, tolerance, most):
        from scipy import sparse
        from scipy.sparse.linalg import spsolve

        start, row = self.lower[:2]
        n = len(u)
        step = np.zeros(n)
        step[held] = at - u[held]  # imposed displacement, applied with the first linear solution
        size = 0.0
        for turn in range(most):
            internal, values, *_ = self.tangent(u, model)
            below = sparse.csc_array((values, row, start), (n, n))
            full = (below + sparse.tril(below, -1).T).tocsc()
            right = load - internal - full @ step
            among = full[free][:, free]
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # a singular matrix shows in the residual `missed`
                step[free] = spsolve(among, right[free])
            missed = np.abs(among @ step[free] - right[free]).max(initial=0)
            if not turn and not missed <= 1e-6 * np.abs(right[free]).max(initial=0):
                raise RuntimeError(
                    f"no rest: forces of {missed:g} N are left by a linear solution: the body moves as a whole, or a part of it, "
                    "or a node belongs to no cell; hold more dofs in `fixed`"
                )
            before = abs(step[free] @ right[free]) if turn else np.inf
            share = 1.0
            while True:
                internal, _, wrong, *_ = model.evaluate(u + share * step, np.inf, 1.0)
                if wrong is None:
                    left = load - internal
                    size = max(size, np.abs(load).max(), np.abs(internal).max())
                    if not turn or abs(step[free] @ left[free]) <= 0.999 * before or np.abs(left[free]).max() <= tolerance * size:
                        break
                share /= 2
                if share < 2.0**-10:
                    if wrong is not None:
                        raise RuntimeError(f"no equilibrium was found: {wrong}: give more increments")
                    break
            u = u + share * step
            if np.abs(left[free]).max(initial=0) <= tolerance * size and share == 1:
                return u
            step[held] = at - u[held]
            step[free] = 0
        raise RuntimeError(
            f"no rest after {most} iterations, forces differ by {np.abs(left[free]).max():g} N: give more increments"
        )

    def stress(self, displacement, model=None):
        """Gives the Cauchy stress, mean of each cell.

        Parameters
        ----------
        displacement : array_like (n, dim)
            Displacement [m].
        model : _core.BulkModel, optional
            States of the material; those of a new model when not given.

        Returns
        -------
        dict
            {kind: (m, 6)} in the order xx yy zz xy yz zx [Pa], tension positive.

        Raises
        ------
        ValueError
            If a cell is inside out or has no finite stress; the message names it.
        """
        model = model or self.model()
        *_, wrong, _, _ = model.evaluate(np.ascontiguousarray(displacement, float).ravel(), np.inf, 1.0)
        if wrong is not None:
            raise ValueError(wrong)
        return by_kinds(self, model.stress())


def _on_axis(points):
    """Points with x set to 0 where it is negative by rounding alone."""
    rounded = (points[:, 0] < 0) & (points[:, 0] >= -(2.0**-40) * np.max(np.abs(points), initial=0.0))
    return np.where(rounded[:, None] & (np.arange(points.shape[1]) == 0), 0.0, points) if np.any(rounded) else points


def _layout(cells, material):
    """[(kind, rows, material)] for each material of each kind of cells."""
    given, out = material if isinstance(material, dict) else dict.fromkeys(cells, material), []
    for kind, nodes in cells.items():
        of = given.get(kind)
        of_each = isinstance(of, (tuple, list)) and len(of) == 2 and isinstance(of[0], (tuple, list))  # lists from files
        several, which = of if of_each else ([of], np.zeros(len(nodes), int))
        which = np.asarray(which)
        for m in several:
            if not isinstance(m, BulkMaterial):
                raise TypeError(f"material of {kind} cells is {m!r}: give a material of solids, such as NeoHookean(...)")
        if which.shape != (len(nodes),) or which.dtype.kind not in "iu" or np.any((which < 0) | (which >= len(several))):
            text = f"material of {kind} cells tells {which.shape} of {len(several)} materials"
            raise ValueError(f"{text}: give (materials, number (m,) of that of each of the {len(nodes)} cells)")
        rows = [np.flatnonzero(which == k) for k in range(len(several))]
        out += [(kind, of, m) for of, m in zip(rows, several) if len(of) or len(several) == 1]
    return out


def by_kinds(body, of_blocks):
    """Collects values of cells by kinds.

    Parameters
    ----------
    body : SolidBody
        The body.
    of_blocks : iterable of ndarray (m, k)
        Values of the cells of each block of the body.

    Returns
    -------
    dict
        {kind: (m, k)}.
    """
    of_blocks = list(of_blocks)
    out = {kind: np.zeros((len(nodes), *of_blocks[0].shape[1:])) for kind, nodes in body.cells.items()}
    for (kind, rows, _), found in zip(body.layout(), of_blocks):
        out[kind][rows] = found
    return out
