"""A deformable body with forces from another finite element code: a Python callable, or a routine of a library (cairn.plug).

body = CallbackBody(points, mass, forces, groups={"left": nodes}, edges=edges)
scene.add(cn.deformable(body, rubber, contact="right", fixed={"left": "xy"}))
"""

from __future__ import annotations

import gc
import weakref
from typing import NamedTuple

import numpy as np

from .. import _core
from ..base import checks
from ..names import one_of
from .mesh_parts import GivenBody


class BodyStep(NamedTuple):
    """Arguments of an evaluation of the internal forces of a body."""

    displacement: np.ndarray  #: of the nodes (n, dim) [m]
    velocity: np.ndarray  #: of the nodes at that displacement (n, dim) [m/s]
    time: float  #: at that displacement [s]
    step: float  #: length of the current step [s]
    #: derivative of velocities by displacements over the step [1/s]: with viscous forces the tangent is K + rate C
    rate: float
    tangent: bool  #: True if the tangent is needed


class CalledRoutine:
    """A body from a library (cairn.plug(library, body=...)), with its parameters."""

    def __init__(self, name, core, params):
        self.name, self._core, self.params = name, core, params

    def __repr__(self):
        return f"<body {self.name} {self.params}>"


class CallbackBody(GivenBody):
    """A deformable body whose internal forces and tangent come from another code.

    points (n, dim): places of the nodes [m].
    mass: masses of the nodes (n,) [kg], or a symmetric matrix (n dim, n dim); dof `dim i + k` is the displacement of node i along
    axis k.
    forces: a function of a BodyStep `at` that returns (forces, tangent), (forces, tangent, energy) or (forces, tangent, energy,
    dissipated). forces (n, dim) [N]: internal forces, which oppose the displacement; tangent (n dim, n dim) [N/m]: their
    derivative by the displacement, scipy.sparse or dense (only its symmetric part is used); energy: stored energy [J];
    dissipated: energy dissipated in the step [J]. It returns None if it finds no forces; Cairn then tries a smaller change.
    A Python function runs in every iteration of a step; a compiled routine, cairn.plug("libmine.so", body="mine", params=...),
    avoids that.
    Instead of a function, an object with such a method `forces` that keeps a history: `commit()` is called after an accepted
    step, which ended at the last call of `forces`. Optional: `rollback()`, called after a step that is undone; `state()`, which
    returns numbers (k,) for a checkpoint; `restore(numbers)`. Every call of `forces` starts from the last commit.
    pattern: scipy.sparse matrix (n dim, n dim) with an entry wherever the tangent may have one; a routine of a library writes
    its values in this order, column by column. Without it: the pattern of the tangent at rest, with all axes of coupled nodes.
    damping (n dim, n dim) [N s/m], or rayleigh: (a, b) of C = a M + b K at rest [1/s, s].
    groups, edges, faces: as for LinearBody. large: True if rotations may be large, so that rigid parts rotate with them.
    thickness [m], plane ("strain", "stress", "axisymmetric"): in 2D, used for the area of edges under pressure.
    Raises ValueError naming the wrong value and the remedy.
    """

    def __init__(self, points, mass, forces, *, pattern=None, damping=None, rayleigh=(0.0, 0.0), groups=None, edges=None,
                 faces=None, large=True, thickness=1.0, plane="strain"):  # fmt: skip
        from scipy import sparse

        from .triangles_of_matrices import lower_triangles

        self.points = np.ascontiguousarray(points, float)
        if self.points.ndim != 2 or self.points.shape[1] not in (2, 3) or not np.all(np.isfinite(self.points)):
            raise ValueError(f"points have shape {self.points.shape}: give finite places (n, 2) or (n, 3) [m]")
        self.dim, n = self.points.shape[1], self.points.size
        self.groups = checks.node_groups(groups, len(self.points))
        self.edges, self.faces = self._sides("edges", edges, (2,)), self._sides("faces", faces, (3, 4))
        self.kinematics = "total_lagrangian" if large else "small"
        self.thickness = checks.positive("thickness", thickness)
        self.plane = one_of("plane", plane, ("strain", "stress", "axisymmetric"))
        self.M = self._mass(mass)
        self._routine = forces if isinstance(forces, CalledRoutine) else None
        self._caller = None if self._routine else Caller(self, forces)
        if pattern is None and self._routine:
            raise ValueError(
                f"pattern is not given, and {forces!r} needs it: give a sparse matrix with the entries of its tangent"
            )
        pattern = self._caller.pattern() if pattern is None else self._matrix("pattern", pattern)
        pattern.sort_indices()
        self.pattern = pattern
        if self._caller:
            self._caller.take_pattern(pattern)
        given = self._matrix("damping", damping, True) if damping is not None else sparse.csc_array((n, n))
        marks = sparse.csc_array((np.ones(pattern.nnz), pattern.indices, pattern.indptr), (n, n))
        start, row, (m, _, c) = lower_triangles([self.M, marks + marks.T + self._of_sides(), given], n)
        self._lower_pattern = np.ascontiguousarray(start, np.int64), np.ascontiguousarray(row, np.int32)
        self._taken = None
        _, k, *known = self.tangent(np.zeros_like(self.points))
        #: True for each of energy and dissipation that the code returns
        self.tells = tuple(value is not None for value in known)
        a, b = checks.rayleigh(rayleigh)
        self.lower = start, row, m, k, c + a * m + b * k
        self.K, self.C = (self._full(values) for values in self.lower[3:])

    def _mass(self, mass):
        from scipy import sparse

        nodes = len(self.points)
        if np.ndim(mass) == 1 and not hasattr(mass, "tocsc"):
            values = checks.real_array("mass", mass, (nodes,))
            if not np.all(values > 0):
                at = int(np.argmin(values))
                raise ValueError(f"mass[{at}] is {values[at]:g}: give a mass > 0 for each node [kg]")
            return sparse.diags_array(np.repeat(values, self.dim)).tocsc()
        return self._matrix("mass", mass, True)

    def _matrix(self, name, given, symmetric=False):
        from scipy import sparse

        n = self.points.size
        if np.shape(given) != (n, n):
            raise ValueError(f"{name} has shape {np.shape(given)}: {len(self.points)} nodes in {self.dim}D need ({n}, {n})")
        a = sparse.csc_array(given)
        a.sum_duplicates()
        if symmetric and abs(a - a.T).max() > 1e-9 * abs(a).max():
            raise ValueError(f"{name} is not symmetric: give a symmetric matrix")
        if symmetric and not np.all(np.isfinite(a.data)):
            raise ValueError(f"{name} holds a number that is not finite: give finite ones")
        return a

    def _of_sides(self):
        """Pattern of the tangent of a pressure on edges or faces: all pairs of dofs of a side."""
        from scipy import sparse

        n, rows, columns = self.points.size, [], []
        for sides in (part for part in (self.edges, self.faces) if part is not None and len(part)):
            dofs = (self.dim * sides[:, :, None] + np.arange(self.dim)).reshape(len(sides), -1)
            there = np.repeat(sides >= 0, self.dim, axis=1)
            both = there[:, :, None] & there[:, None, :]
            rows.append(np.broadcast_to(dofs[:, :, None], both.shape)[both])
            columns.append(np.broadcast_to(dofs[:, None, :], both.shape)[both])
        if not rows:
            return sparse.csc_array((n, n))
        rows, columns = np.concatenate(rows), np.concatenate(columns)
        return sparse.csc_array((np.ones(len(rows)), (rows, columns)), (n, n))

    def _full(self, values):
        from scipy import sparse

        start, row = self._lower_pattern
        below = sparse.csc_array((values, row, start), (self.points.size, self.points.size))
        return (below + sparse.tril(below, -1).T).tocsc()

    # ------------------------------------------------------------------ calls

    def model(self):
        """A new _core.CalledForces, through which the core calls the code."""
        start, row = np.asarray(self.pattern.indptr, np.int64), np.asarray(self.pattern.indices, np.int32)
        if self._routine:
            params = list(self._routine.params.values())
            made = _core.CalledForces.by_library(self._routine._core, params, self.dim, self.points.ravel(), start, row)
        else:
            c = self._caller
            made = _core.CalledForces.by_object(self.dim, start, row, c, c.keeps, c.tells, *c.gives)
        made.fit(*self._lower_pattern)
        return made

    def model_of(self, simulation, name):
        """The _core.CalledForces for a simulation; name: of the mesh in it. Raises ValueError if the code keeps a history that
        belongs to another simulation."""
        c = self._caller
        if c and c.keeps:
            if self._held_by(simulation):
                gc.collect()  # a reference cycle (a traceback) may keep the other simulation alive
            if self._held_by(simulation):
                text = f"{c.given_by} keeps a history between steps, which is of another simulation"
                raise ValueError(f"{text}: give the mesh {name!r} a CallbackBody with an object of its own")
            if c.went_on and not c.tells:
                text = f"{c.given_by} keeps a history that went on in another simulation"
                raise ValueError(f"{text}: give the mesh {name!r} an object at its start, or one with state and restore")
            if c.tells and self._taken is not None:
                c.load(c.start)
            self._taken = weakref.ref(simulation)
        if c:
            c.name = name
        return self.model()

    def _held_by(self, simulation):
        """True if the history kept by the code belongs to this simulation, or to another that was completely built."""
        holder = None if self._taken is None else self._taken()
        return holder is not None and (holder is simulation or "_made" in vars(holder))

    def tangent(self, displacement, velocity=None, *, time=0.0, step=1.0, rate=0.0, model=None):
        """Forces (n dofs) [N] and the values of the lower triangle of their derivative [N/m] at a displacement (n, dim) [m], then
        stored and dissipated energy [J], None if the code does not return them. Raises ValueError naming the cause."""
        u = np.ascontiguousarray(displacement, float).ravel()
        v = np.zeros_like(u) if velocity is None else np.ascontiguousarray(velocity, float).ravel()
        if u.size != self.points.size or v.size != u.size:
            raise ValueError(
                f"displacement holds {u.size} numbers, velocity {v.size}: give ({len(self.points)}, {self.dim}) each"
            )
        own = model or self.model()
        force, values, wrong, *told = own.evaluate(u, v, time, step, rate, len(self._lower_pattern[1]))
        own.rollback()
        if wrong is not None:
            raise ValueError(wrong)
        return force, values, *told

    def tangent_error(self, displacement=None, *, size=None, seed=0):
        """Error of the tangent against central differences of the forces, relative to their largest entry: at a displacement
        (n, dim) [m], along four random directions. A right tangent has 1e-6 or less, if forces do not depend on velocity.

        size: length of the differences [m]; 1e-6 of the extent of the body when not given. Raises ValueError if that is zero."""
        u = np.zeros_like(self.points) if displacement is None else np.array(displacement, float).reshape(self.points.shape)
        step = 1e-6 * np.ptp(self.points, axis=0).max() if size is None else checks.positive("size", size)
        if not step > 0:
            told = "the nodes are at one place, and differences of the forces have no size by their extent"
            raise ValueError(f"{told}: give size [m]")
        full, rng, worst, largest = self._full(self.tangent(u)[1]), np.random.default_rng(seed), 0.0, 0.0
        for _ in range(4):
            way = rng.standard_normal(u.shape)
            way /= np.abs(way).max()
            change = (self.tangent(u + step * way)[0] - self.tangent(u - step * way)[0]) / (2 * step)
            product = full @ way.ravel()
            worst, largest = max(worst, np.abs(change - product).max()), max(largest, np.abs(product).max(), np.abs(change).max())
        return worst / largest if largest > 0 else 0.0


class Caller:
    """Calls a user's Python function or object for the core: checks shapes and pattern, and names the mesh in exceptions."""

    def __init__(self, body, given):
        call = given if callable(given) else getattr(given, "forces", None)
        if not callable(call):
            raise TypeError(f"forces is {given!r}: give a function of a BodyStep, an object with a method `forces`, or "
                            "cairn.plug(library, body=...)")  # fmt: skip
        self._call, self._given, self.name = call, given, "mesh"
        self._shape, self._pattern, self._places = body.points.shape, None, None
        own = getattr(given, "__qualname__", None) or type(given).__qualname__
        self.given_by = f"{own} (Python)"
        self.keeps = callable(getattr(given, "commit", None))
        both = [callable(getattr(given, word, None)) for word in ("state", "restore")]
        if both[0] != both[1]:
            raise ValueError(
                f"forces has {'state' if both[0] else 'restore'} alone: give state() and restore(numbers), or neither"
            )
        if both[0] and not self.keeps:
            raise ValueError("forces has state() and no commit(): what is kept between steps needs both")
        self.tells = both[0]
        self.start = self.save() if self.tells else None
        self.went_on = False  # a step was committed
        self.gives = None

    def pattern(self):
        """Pattern of the tangent at rest: all axes of nodes that it couples, or all entries if it is dense."""
        from scipy import sparse

        found = self._found(np.zeros(self._shape), np.zeros(self._shape), 0.0, 1.0, 0.0, True)
        if found is None:
            raise ValueError(f"{self.given_by} gives no forces at displacements of zero: give them there")
        tangent, n = found[1], self._shape[0] * self._shape[1]
        if np.shape(tangent) != (n, n):
            raise ValueError(f"the tangent of {self.given_by} has shape {np.shape(tangent)}: give a matrix ({n}, {n}) [N/m]")
        if not hasattr(tangent, "tocsc"):
            return sparse.csc_array(np.ones((n, n)))
        a, dim = tangent.tocoo(), self._shape[1]
        nodes = sparse.csc_array((np.ones(len(a.row)), (a.row // dim, a.col // dim)), (n // dim, n // dim))
        return sparse.csc_array(sparse.kron(nodes, np.ones((dim, dim))))

    def take_pattern(self, pattern):
        """Sets the pattern of later tangents, and finds from a call at rest if energy and dissipation are returned."""
        n = pattern.shape[0]
        self._pattern = pattern
        self._code = np.repeat(np.arange(n, dtype=np.int64) * n, np.diff(pattern.indptr)) + pattern.indices
        found = self._found(np.zeros(self._shape), np.zeros(self._shape), 0.0, 1.0, 0.0, True)
        if found is None:
            raise ValueError(f"{self.given_by} gives no forces at displacements of zero: give them there")
        self.gives = tuple(value is not None for value in found[2:])

    # ------------------------------------------------------------------ calls from the core

    def forces(self, u, v, time, step, rate, wanted):
        """(forces (n dofs) [N], values of the tangent on the pattern or None, energy, dissipation [J] or None each). Returns None
        if the code finds no forces."""
        found = self._found(u.reshape(self._shape), v.reshape(self._shape), time, step, rate, wanted)
        if found is None:
            return None
        force, tangent, *told = found
        for what, value, given in zip(("energy", "dissipation"), told, self.gives):
            if (value is not None) != given:
                text = f"{self.given_by} of the mesh {self.name!r} gives {'its' if value is not None else 'no'} {what} now"
                raise _core.Error(f"{text}, and {'none' if value is not None else 'one'} at rest: give it always, or never")
        return force, self._values(tangent) if wanted else None, *told

    def commit(self):
        """The step was accepted."""
        self.went_on = True
        self._guarded("commit", self._given.commit)

    def rollback(self):
        """The step was undone."""
        if callable(getattr(self._given, "rollback", None)):
            self._guarded("rollback", self._given.rollback)

    def save(self):
        """History of the object, numbers (k,)."""
        kept = self._guarded("state", self._given.state)
        out = np.asarray(kept)
        if out.ndim != 1 or out.dtype.kind not in "fiub":
            raise _core.Error(f"state of {self.given_by} is {type(kept).__name__} of shape {out.shape}: give numbers (k,)")
        return np.ascontiguousarray(out, float)

    def load(self, state):
        """Restores a history that `save` returned."""
        self._guarded("restore", lambda: self._given.restore(np.array(state)))

    def _guarded(self, what, call):
        try:
            return call()
        except Exception as error:
            text = f"the mesh {self.name!r}: {what} of {self.given_by} raised {type(error).__name__}: {error}"
            raise _core.Error(text) from error

    def _found(self, u, v, time, step, rate, wanted):
        at = BodyStep(u, v, time, step, rate, wanted)
        found = self._guarded("forces", lambda: self._call(at))
        if found is None:
            return None
        parts = found if isinstance(found, tuple) else (found,)
        whose = f"{self.given_by} of the mesh {self.name!r}"
        if not 1 <= len(parts) <= 4 or (wanted and (len(parts) < 2 or parts[1] is None)):
            text = f"{whose} gave {len(parts)} values" if len(parts) != 2 else f"{whose} gave no tangent"
            raise _core.Error(f"{text}, and at.tangent is {wanted}: give forces, tangent, and if known energy and dissipation")
        force, tangent, energy, dissipated = [*parts, None, None, None][:4]
        size = self._shape[0] * self._shape[1]
        force = np.asarray(force)
        if force.shape not in (self._shape, (size,)) or force.dtype.kind not in "fiu":
            text = f"{whose} gave forces of shape {force.shape}, dtype {force.dtype}"
            raise _core.Error(f"{text}: give real numbers {self._shape} or ({size},) [N]")
        energy, dissipated = (None if value is None else float(value) for value in (energy, dissipated))
        return np.ascontiguousarray(force, float).ravel(), tangent, energy, dissipated

    def _values(self, tangent):
        """Values of a tangent on the pattern. Raises Error for a non-zero entry outside of it."""
        from scipy import sparse

        n = self._pattern.shape[0]
        if np.shape(tangent) != (n, n):
            text = f"{self.given_by} of the mesh {self.name!r} gave a tangent of shape {np.shape(tangent)}"
            raise _core.Error(f"{text}: give a matrix ({n}, {n}) [N/m]")
        a = tangent.tocsc() if hasattr(tangent, "tocsc") else sparse.csc_array(tangent)
        if not a.has_canonical_format:
            a = a.copy()
            a.sum_duplicates()
        if not (self._places and all(np.array_equal(x, y) for x, y in zip(self._places, (a.indptr, a.indices)))):
            code = np.repeat(np.arange(n, dtype=np.int64) * n, np.diff(a.indptr)) + a.indices
            at = np.minimum(np.searchsorted(self._code, code), len(self._code) - 1)
            self._places, self._at, self._known = (a.indptr, a.indices), at, self._code[at] == code
        beyond = np.flatnonzero(~self._known & (a.data != 0))
        if len(beyond):
            column = int(np.searchsorted(a.indptr, beyond[0], "right")) - 1
            text = f"{self.given_by} of the mesh {self.name!r} gave {a.data[beyond[0]]:g} at ({a.indices[beyond[0]]}, {column})"
            raise _core.Error(f"{text} of its tangent, which its pattern does not hold: give CallbackBody a pattern that does")
        out = np.zeros(len(self._code))
        out[self._at[self._known]] = a.data[self._known]
        return out
