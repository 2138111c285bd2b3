"""Systems of linear equations, factorised once and solved many times, in a storage that suits the matrix."""

from __future__ import annotations

import numpy as np

STORAGES = ("diagonal", "banded", "dense", "sparse")


class SOE:
    """A x = b with A symmetric and positive definite, any scipy.sparse matrix (n, n); its lower triangle is read.

    storage: "diagonal"; "banded", Cholesky in LAPACK after reverse Cuthill-McKee renumbering (1969); "dense", Cholesky in
    LAPACK; "sparse", Cholesky by CHOLMOD, simplicial or supernodal, or by Eigen in a build without it; "unsymmetric", LU by
    UMFPACK or Eigen, for any regular matrix; None: diagonal if A is, dense up to 60 unknowns, banded up to a half band of 24,
    else sparse. Raises ValueError for a matrix that is not square, not finite, not positive definite (a pivot below 8 roundings
    of its diagonal entry counts as zero), or not of the given storage. Solutions have the same bits with any number of threads
    or columns, and when A is multiplied by a power of two.
    """

    def __init__(self, matrix, storage=None):
        from scipy import sparse

        from cairn import _core

        a = sparse.csc_array(matrix, dtype=float, copy=True)
        if a.shape[0] != a.shape[1]:
            raise ValueError(f"the matrix has shape {a.shape}: give a square one")
        if not np.all(np.isfinite(a.data)):
            raise ValueError("the matrix holds a number that is not finite: check stiffness, mass and step")
        if storage is not None and storage not in (*STORAGES, "unsymmetric"):
            raise ValueError(f"storage is {storage!r}: give {', '.join(STORAGES)}, unsymmetric or None")
        a.sum_duplicates()
        a.eliminate_zeros()
        if storage == "diagonal" and a.nnz > np.count_nonzero(a.diagonal()):
            raise ValueError("the matrix has entries off its diagonal: give another storage than 'diagonal'")
        if storage != "unsymmetric":
            a = sparse.csc_array(sparse.tril(a))
        a.sort_indices()
        self.size = a.shape[0]
        self._soe = _core.Soe(self.size, a.indptr, a.indices, a.data, storage or "automatic")
        self.storage = self._soe.storage

    def solve(self, b, threads=1):
        """x of A x = b, for b (n,) or (n, m)."""
        b = np.asarray(b, float)
        if b.shape[:1] != (self.size,) or b.ndim > 2:
            raise ValueError(f"the right side has shape {b.shape}: {self.size} unknowns need ({self.size},) or ({self.size}, m)")
        return self._soe.solve(b.T, threads).T
