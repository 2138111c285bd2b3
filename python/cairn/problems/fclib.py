"""Frictional contact problems in the FCLIB layout (HDF5), local and global.

Matrices hold m, n, nzmax, nz, p, i, x. nz >= 0: triplets, i the row and p the column of the first nz; nz = -1: compressed
columns, p the starts and i the rows; nz = -2: compressed rows, p the starts and i the columns (Acary et al., FCLIB).
Local: u = W r + q. Global: M v = H r + f, u = H' v + w, and with equalities G' v + b = 0 by multipliers G l.
"""

from __future__ import annotations

import os

import numpy as np

from .. import _core
from ..base.errors import DAMAGE, ContentError, FileError
from ..files.hdf5 import read_foreign
from .problem import Problem

KNOWN = "2 and 3 are known; problems with rolling friction, of 5 unknowns a contact, are not read"


class ProblemFileError(ContentError):
    """A file that holds no frictional contact problem, or one that is damaged."""


def read(path):
    """The Problem of a file in the FCLIB layout; a global one is reduced to its contacts."""
    return _read(path, _problem)


def _problem(file):
    if "fclib_local" in file:
        return _read_local(file["fclib_local"])
    if "fclib_global" in file:
        return _read_global(file["fclib_global"])
    rolling = next((name for name, _ in file.items() if name.startswith("fclib_") and "rolling" in name), None)
    if rolling:
        raise ValueError(f"holds {rolling}, with rolling friction: problems of 2 or 3 unknowns a contact are read")
    what = "has neither fclib_local nor fclib_global: it is no problem in the FCLIB layout"
    raise ValueError(f"{what}; cairn.problems.write makes such files")


def _read(path, what):
    """Result of what(file); errors that the file causes are raised as ProblemFileError."""
    try:
        return read_foreign(path, what)
    except FileError as error:
        missing = error.problem == "no such file or folder"
        told = "there is no such file" if missing else f"cannot be opened as HDF5 ({error.problem})"
        raise ProblemFileError(f"{path}: {told}; {error.remedy}") from error
    except KeyError as error:
        raise ProblemFileError(f"{path}: lacks a part of the FCLIB layout: {error.args[0]}") from error
    except (ValueError, IndexError) as error:
        raise ProblemFileError(f"{path}: {error}") from error
    except (*DAMAGE, OSError) as error:
        raise ProblemFileError(f"{path}: is damaged ({type(error).__name__}: {error}): write it again") from error


def read_solution(path):
    """(r, u) of the group /solution, each (n, dim), or None where the file has none."""
    return _read(path, _solution)


def _solution(file):
    if "solution" not in file:
        return None
    root = file["fclib_local"] if "fclib_local" in file else file["fclib_global"]
    dim = _number(root["spacedim"])
    if dim not in (2, 3):
        raise ValueError(f"spacedim is {dim}: {KNOWN}")
    found = [_reals(file["solution"], name).reshape(-1, dim) for name in ("r", "u") if name in file["solution"]]
    return found[0], found[1] if len(found) > 1 else None


def _reals(group, name):
    values = np.ravel(group[name][()])
    if values.dtype.kind not in "fiu":
        raise ValueError(f"{group.name}/{name} holds {values.dtype}: numbers are due")
    return values


def write(path, problem, result=None, *, title="", description="", like=None):
    """Writes a local problem, and beside it the solution (r, u) of a Result.

    like: "rows" (default), "columns" or "triplets": how W is stored.
    """
    import h5py

    # built in memory: HDF5 does not survive a disk that fills up under it
    with h5py.File("problem", "w", driver="core", backing_store=False) as file:
        _write_local(file, path, problem, result, title, description, like)
        file.flush()
        image = file.id.get_file_image()
    _core.write_whole(path, image, beside=False)


def _write_local(file, path, problem, result, title, description, like):
    local = file.create_group("fclib_local")
    local["spacedim"] = np.array([problem.dim], dtype=np.int32)
    _write_matrix(local.create_group("W"), problem.W, like or "rows")
    vectors = local.create_group("vectors")
    vectors["q"] = problem.q.ravel()
    vectors["mu"] = problem.mu
    info = local.create_group("info")
    info["title"] = title or os.path.basename(str(path))
    info["description"] = description or "frictional contact problem"
    info["math_info"] = "u = W r + q, contact by contact (N, T) or (N, T1, T2)"
    if result is not None:
        solution = file.create_group("solution")
        solution["r"] = np.asarray(result.r).ravel()
        solution["u"] = np.asarray(result.u).ravel()
        solution["v"] = np.zeros(0)
        solution["l"] = np.zeros(0)


def _number(dataset):
    return int(np.asarray(dataset[()]).ravel()[0])


def read_matrix(group):
    """scipy.sparse.csr_array of a matrix group. Raises ValueError for starts, rows or columns that the matrix has not."""
    from scipy import sparse

    shape = tuple(_size(group, name) for name in ("m", "n"))
    nz = _number(group["nz"])
    if nz < -2:
        raise ValueError(f"{group.name} has nz = {nz}: -2 (rows), -1 (columns) and counts of triplets are known")
    x, i, p = _reals(group, "x"), _indices(group, "i"), _indices(group, "p")
    if nz >= 0:
        _told(group, nz, {"x": x, "i": i, "p": p})
        _within(group, "i", i[:nz], shape[0], "row")
        _within(group, "p", p[:nz], shape[1], "column")
        return sparse.coo_array((x[:nz], (i[:nz], p[:nz])), shape=shape).tocsr()
    starts = shape[1] if nz == -1 else shape[0]
    if p.size < starts + 1:
        raise ValueError(f"{group.name} has {p.size} starts: {starts + 1} are needed where nz = {nz}")
    p = p[: starts + 1]
    falls = np.flatnonzero(np.diff(p) < 0)
    if p[0] != 0 or falls.size:
        at = int(falls[0]) + 1 if p[0] == 0 else 0
        raise ValueError(f"{group.name}/p: start {at} is {p[at]}: starts rise from 0")
    entries = int(p[starts])
    _told(group, entries, {"x": x, "i": i})
    _within(group, "i", i[:entries], shape[0] if nz == -1 else shape[1], "row" if nz == -1 else "column")
    made = sparse.csc_array if nz == -1 else sparse.csr_array
    return sparse.csr_array(made((x[:entries], i[:entries], p), shape=shape))


def _size(group, name):
    value = _number(group[name])
    if not 0 <= value < 2**31:
        raise ValueError(f"{group.name}/{name} is {value}: give 0 or more, less than 2**31")
    return value


def _indices(group, name):
    values = np.ravel(group[name][()])
    if values.size and values.dtype.kind not in "iu":
        raise ValueError(f"{group.name}/{name} holds {values.dtype}: whole numbers are due")
    return values.astype(np.int64)


def _told(group, entries, arrays):
    for name, values in arrays.items():
        if values.size < entries:
            raise ValueError(f"{group.name}/{name} holds {values.size} entries: {entries} are told")


def _within(group, name, values, limit, what):
    wrong = np.flatnonzero((values < 0) | (values >= limit))
    if wrong.size:
        k = int(wrong[0])
        raise ValueError(f"{group.name}/{name}: entry {k} is in {what} {values[k]}: it goes from 0 to {limit - 1}")


def _write_matrix(group, matrix, like):
    from scipy import sparse

    if like == "triplets":
        coo = sparse.coo_array(matrix)
        nz, p, i, x = coo.nnz, coo.col, coo.row, coo.data
    elif like == "columns":
        csc = sparse.csc_array(matrix)
        nz, p, i, x = -1, csc.indptr, csc.indices, csc.data
    elif like == "rows":
        csr = sparse.csr_array(matrix)
        nz, p, i, x = -2, csr.indptr, csr.indices, csr.data
    else:
        raise ValueError(f"like is {like!r}: give 'rows', 'columns' or 'triplets'")
    for name, value in (("m", matrix.shape[0]), ("n", matrix.shape[1]), ("nz", nz), ("nzmax", x.size)):
        group[name] = np.array([value], dtype=np.int32)
    group["p"], group["i"] = np.asarray(p, dtype=np.int32), np.asarray(i, dtype=np.int32)
    group["x"] = np.asarray(x, dtype=float)


def _read_local(group):
    if "V" in group and _number(group["V/n"]) > 0:
        raise ValueError("has equality constraints (V, R): write it as a global problem")
    return Problem(_number(group["spacedim"]), read_matrix(group["W"]), group["vectors/q"][()], group["vectors/mu"][()])


def _read_global(group):
    vectors = group["vectors"]
    G = read_matrix(group["G"]) if "G" in group and _number(group["G/n"]) > 0 else None
    return reduce_global(
        _number(group["spacedim"]), read_matrix(group["M"]), read_matrix(group["H"]), vectors["f"][()], vectors["w"][()],
        vectors["mu"][()], G, vectors["b"][()] if G is not None else None,
    )


def reduce_global(dim, M, H, f, w, mu, G=None, b=None):
    """The contacts' own problem of M v = H r + f, u = H' v + w: W = H' M^-1 H, q = H' M^-1 f + w.

    With equalities G' v + b = 0, M v = H r + G l + f, the same by the inverse of the saddle point matrix. M sparse (n, n),
    H (n, dim c), f (n), w (dim c), G (n, e), b (e).
    """
    from scipy import sparse
    from scipy.sparse import linalg

    M, H = sparse.csc_array(M), sparse.csc_array(H)
    f, w = np.asarray(f, dtype=float).ravel(), np.asarray(w, dtype=float).ravel()
    if H.shape != (M.shape[0], w.size) or f.size != M.shape[0]:
        raise ValueError(f"M is {M.shape}, H {H.shape}, f {f.size} and w {w.size} long: they do not fit")
    n = M.shape[0]
    if G is not None:
        G = sparse.csc_array(G)
        M = sparse.csc_array(sparse.block_array([[M, -G], [G.T, None]]))
        f = np.concatenate([f, -np.asarray(b, dtype=float).ravel()])
    try:
        factor = linalg.splu(M)
    except RuntimeError as error:
        told = "the mass matrix, with the equalities, is singular"
        raise ValueError(f"{told}: give each body a mass, and leave out equalities that follow from others") from error
    free = factor.solve(f)[:n]
    columns, blocks = 3 * 256, []
    for first in range(0, H.shape[1], columns):
        some = np.zeros((M.shape[0], min(columns, H.shape[1] - first)))
        some[:n] = H[:, first : first + columns].toarray()
        blocks.append(sparse.csr_array(H.T @ factor.solve(some)[:n]))
    W = sparse.hstack(blocks, format="csr") if blocks else np.zeros((0, 0))
    return Problem(dim, W, H.T @ free + w, mu)
