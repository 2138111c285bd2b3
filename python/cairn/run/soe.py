"""Systems of linear equations: factorised once, solved many times, in the storage that fits the matrix."""

from __future__ import annotations

import numpy as np

STORAGES = ("diagonal", "banded", "dense", "sparse")


class SOE:
    """A x = b with A symmetric and positive definite, any scipy.sparse matrix (n, n).

    storage: "diagonal"; "banded", Cholesky in LAPACK after Cuthill & McKee's renumbering (1969); "dense", Cholesky in LAPACK;
    "sparse", the simplicial LDL' factors of CHOLMOD if scikit-sparse is installed, else the LU factors of SuperLU on the minimum
    degree order of A' + A; None: diagonal if A is, dense up to 60 unknowns,
    banded while its band is short, else sparse. Raises ValueError for a matrix that is not square, not finite, not
    definite, or not of the storage asked for.
    """

    def __init__(self, matrix, storage=None):
        from scipy import sparse

        a = sparse.csc_array(matrix)
        if a.shape[0] != a.shape[1]:
            raise ValueError(f"the matrix has shape {a.shape}: give a square one")
        if not np.all(np.isfinite(a.data)):
            raise ValueError("the matrix holds a number that is not finite: check stiffness, mass and step")
        if storage is not None and storage not in STORAGES:
            raise ValueError(f"storage is {storage!r}: give {', '.join(STORAGES)} or None")
        a.sum_duplicates()
        a.eliminate_zeros()
        self.size = a.shape[0]
        self.storage = storage or _fitting(a)
        self._factorise(a)

    def _factorise(self, a):
        refusal = f"a matrix of {self.size} unknowns is not positive definite: a mass, a stiffness or a held dof is missing"
        if self.size == 0:
            self._solve = lambda b: b
        elif self.storage == "diagonal":
            diagonal = a.diagonal()
            if a.nnz > np.count_nonzero(diagonal):
                raise ValueError("the matrix has entries off its diagonal: give another storage than 'diagonal'")
            if not np.all(diagonal > 0):
                raise ValueError(refusal)
            self._solve = lambda b: (b.T / diagonal).T
        else:
            try:
                self._solve = {"banded": _banded, "dense": _dense, "sparse": _sparse}[self.storage](a)
            except (np.linalg.LinAlgError, RuntimeError, ZeroDivisionError) as e:
                raise ValueError(refusal) from e

    def solve(self, b):
        """x of A x = b, for b (n,) or (n, m)."""
        b = np.asarray(b, float)
        if b.shape[:1] != (self.size,):
            raise ValueError(f"the right side has shape {b.shape}: {self.size} unknowns need ({self.size},) or ({self.size}, m)")
        return self._solve(b)


def _fitting(a):
    if a.nnz <= np.count_nonzero(a.diagonal()):
        return "diagonal"
    if a.shape[0] <= 60:
        return "dense"
    return "banded" if _half_band(a, _renumbering(a)) <= 24 else "sparse"


def _renumbering(a):
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    return reverse_cuthill_mckee(a.tocsr(), symmetric_mode=True)


def _half_band(a, order):
    place = np.empty(len(order), int)
    place[order] = np.arange(len(order))
    c = a.tocoo()
    return int(np.max(np.abs(place[c.row] - place[c.col]), initial=0))


def _banded(a):
    from scipy.linalg import cho_solve_banded, cholesky_banded

    order = _renumbering(a)
    c = a.tocoo()
    place = np.empty(len(order), int)
    place[order] = np.arange(len(order))
    rows, columns = place[c.row], place[c.col]
    below = rows >= columns
    band = np.zeros((_half_band(a, order) + 1, len(order)))
    band[(rows - columns)[below], columns[below]] = c.data[below]
    factor = cholesky_banded(band, lower=True, check_finite=False)

    def solve(b):
        x = np.empty(b.shape)
        x[order] = cho_solve_banded((factor, True), b[order], check_finite=False)
        return x

    return solve


def _dense(a):
    from scipy.linalg import cho_factor, cho_solve

    factor = cho_factor(a.toarray(), lower=True, check_finite=False)
    return lambda b: cho_solve(factor, b, check_finite=False)


def _sparse(a):
    try:
        from sksparse import cholmod
    except ImportError:
        return _superlu(a)
    from scipy import sparse

    indices = (a.indices.astype(np.int32), a.indptr.astype(np.int32))  # as CHOLMOD takes them
    a = sparse.csc_matrix((a.data, *indices), shape=a.shape)
    try:
        factor = cholmod.cholesky(a, mode="simplicial", use_long=False)
    except cholmod.CholmodNotPositiveDefiniteError:
        raise np.linalg.LinAlgError from None
    if not np.all(factor.D() > 0):
        raise np.linalg.LinAlgError
    return factor


def _superlu(a):
    from scipy.sparse.linalg import splu

    # with its pivots on the diagonal: all are positive exactly when a symmetric matrix is definite
    options = {"SymmetricMode": True}
    lu = splu(a, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    if not np.all(lu.U.diagonal() > 0):
        raise np.linalg.LinAlgError
    return lambda b: lu.solve(np.ascontiguousarray(b))
