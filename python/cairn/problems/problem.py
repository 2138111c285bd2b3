"""A frictional contact problem: find r with u = W r + q and, for each contact, Coulomb's cone and Signorini's condition."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .. import _core
from ..base import checks
from ..names import listed
from ..options.solvers import MOST_THREADS


def solvers():
    """Names of the solvers of problems, each with a summary of one line: {name: summary}."""
    return {name: summary for name, _, summary in _core.problem_solvers()}


@dataclass(frozen=True)
class Result:
    """How a solve ended, and the best impulses it saw.

    r: (contacts, dim) impulses [N s], contact by contact (N, T) or (N, T1, T2). u: (contacts, dim) W r + q [m/s].
    status: "converged", "iteration limit", "time limit", "diverged", "stalled" or "no solution". solver: that gave the
    answer. error: true error, the natural map in an energy norm, no units. worst_error, worst_contact: of one contact on its
    own scale. penetration_rate: largest -u_N / largest |q|. cone_distance: distance of an impulse outside its cone / impulse.
    energy_created: by contacts, / energy in play. hint: what to do; empty when converged.
    """

    r: np.ndarray
    u: np.ndarray
    status: str
    solver: str
    error: float
    iterations: int
    cpu_seconds: float
    worst_error: float
    worst_contact: int
    penetration_rate: float
    cone_distance: float
    energy_created: float
    hint: str

    @property
    def converged(self):
        """True if the true error is below the requested tolerance."""
        return self.status == "converged"


class Problem:
    """Find r with u = W r + q and, for each contact, r in K, u + (mu |u_T|, 0, 0) in K*, r . (u + (mu |u_T|, 0, 0)) = 0.

    dim: 2 or 3. W: (dim n, dim n) Delassus matrix [1/kg], any scipy.sparse matrix or a dense array; it may be singular and
    slightly unsymmetric, each W_NN > 0. q: (dim n) or (n, dim) relative velocity without impulses [m/s], contact by contact
    (N, T) or (N, T1, T2). mu: (n) friction [-], or one number. Raises cairn.Error or ValueError for arrays of wrong size or
    value.
    """

    def __init__(self, dim, W, q, mu):
        dim = checks.count("dim", dim, 2, 3)
        q = np.ascontiguousarray(checks.reals("q", q)).ravel()
        if q.size % dim:
            raise ValueError(f"q holds {q.size} numbers, which is no multiple of dim = {dim}: give dim for each contact")
        self.dim, self.contacts = dim, q.size // dim
        self.q = q.reshape(-1, dim)
        mu = checks.reals("mu", mu)
        if mu.ndim and mu.size != self.contacts:
            raise ValueError(f"mu holds {mu.size} numbers: q has {self.contacts} contacts; give one each, or one for all")
        self.mu = np.broadcast_to(mu.ravel() if mu.ndim else mu, (self.contacts,)).copy()
        row_start, column, data = _blocks(dim, W, self.contacts)
        self._row_start, self._column, self._data = row_start, column, data
        self._core = _core.FrictionProblem(dim, row_start, column, data, self.q, self.mu)
        self._core.measure(np.zeros_like(self.q))  # refuses input that no solver accepts

    @property
    def W(self):
        """The Delassus matrix, scipy.sparse.bsr_array (dim n, dim n) [1/kg]."""
        from scipy import sparse

        size = self.dim * self.contacts
        return sparse.bsr_array((self._data, self._column, self._row_start), shape=(size, size))

    def solve(self, solver="auto", tol=1e-8, *, max_iter=100000, max_seconds=math.inf, threads=1, seed=0, relaxation=1.0,
              start=None, memory=4e9):
        """Solves to a true error of tol, and returns a Result; failure to converge is a status, never an exception.

        solver: a name of `cairn.problems.solvers()`. max_seconds: of CPU. seed: of solvers that draw an order.
        relaxation: of sweeps, in (0, 2). start: (n, dim) impulses to begin from [N s].
        memory: bytes that factors may take; above them the status is "memory limit", and `auto` sweeps alone.
        """
        r = np.zeros((self.contacts, self.dim))
        if start is not None:
            start = checks.reals("start", start)
            if start.size != r.size:
                raise ValueError(f"start holds {start.size} numbers: {self.contacts} contacts need {r.size}")
            r[:] = start.reshape(r.shape)
        if solver not in solvers():
            raise ValueError(f"there is no solver of problems {solver!r}; there are {listed(solvers(), solver)}")
        report = self._core.solve(
            solver, r, checks.number("tol", tol), checks.count("max_iter", max_iter, 0, checks.INT32),
            checks.number("max_seconds", max_seconds, finite=False), checks.count("threads", threads, 0, MOST_THREADS),
            checks.count("seed", seed, 0, checks.INT32), checks.number("relaxation", relaxation), start is not None,
            checks.number("memory", memory, finite=False),
        )
        return Result(r=r, u=self.velocity(r), **report)

    def velocity(self, r):
        """u = W r + q, (n, dim) [m/s]."""
        return (self.W @ np.asarray(r, dtype=float).ravel()).reshape(-1, self.dim) + self.q if self.contacts else self.q

    def error(self, r):
        """True error of r (n, dim) [N s], without units: natural map with rho = 1/W_NN in an energy norm, relative."""
        return self._core.measure(np.asarray(r, dtype=float))["error"]

    def figures(self, r):
        """Error of r (n, dim), its worst contact and mechanical measures, a dict with the names of Result."""
        report = self._core.measure(np.asarray(r, dtype=float))
        names = ("error", "worst_error", "worst_contact", "penetration_rate", "cone_distance", "energy_created")
        return {name: report[name] for name in names}

    def plain_error(self, r):
        """|natural map with rho = 1| / max(|q|, |r|, |u|), which other codes use; it depends on the units."""
        r = np.asarray(r, dtype=float).reshape(self.contacts, self.dim)
        u = self.velocity(r)
        z = r - u
        z[:, 0] -= self.mu * np.linalg.norm(u[:, 1:], axis=1)
        size = np.linalg.norm(r - _core.project_on_cones(z, self.mu))
        scale = max(np.linalg.norm(self.q), np.linalg.norm(r), np.linalg.norm(u))
        return float(size / scale) if scale > 0 else float(size)

    def rank(self, tol=1e-10):
        """(rank of W, largest / smallest singular value above tol times the largest); dense, for small problems."""
        if not self.contacts:
            return 0, 1.0
        s = np.linalg.svd(self.W.toarray(), compute_uv=False)
        kept = s[s > tol * s[0]]
        return int(kept.size), float(kept[0] / kept[-1])

    def __repr__(self):
        return f"Problem({self.dim}D, {self.contacts} contacts, {self._column.size} blocks)"


def _blocks(dim, W, contacts):
    """Blocks of W by rows, each diagonal block there: (row_start, column, data)."""
    size = dim * contacts
    if np.shape(W) != (size, size):
        raise ValueError(f"W has shape {np.shape(W)}: q has {contacts} contacts in {dim}D, so give ({size}, {size})")
    if contacts == 0:
        return np.zeros(1, dtype=np.int64), np.zeros(0, dtype=np.int32), np.zeros((0, dim, dim))
    from scipy import sparse

    if np.dtype(getattr(W, "dtype", float)).kind not in "fiu":
        raise ValueError(f"W holds numbers of type {W.dtype}: give real numbers")
    W = sparse.bsr_array(sparse.csr_array(W), blocksize=(dim, dim)).copy()
    W.sum_duplicates()
    W.sort_indices()
    return W.indptr.astype(np.int64), W.indices.astype(np.int32), np.ascontiguousarray(W.data, dtype=float)
