"""FCLIB and Siconos files: written problems are read back, in every storage; damage is reported."""

import os
import subprocess
import sys
from pathlib import Path

import cairn as cn
import h5py
import numpy as np
import pytest
from cairn import _core, problems
from made_up_problems import plain_true_error, random_problem, resting_box
from scipy import sparse

DATA = Path(os.environ.get("CAIRN_REFERENCE_DATA", Path(__file__).resolve().parents[4] / "shared")) / "problems"
# as Siconos prints them: two contacts in 2D, W unsymmetric, the second contact rests on another body
BLOCKS = """2 2 1 4 4 3 2 2 2 4 2 4 3 3 0 2 3 0 1 1
0
1 3 2 4
1
5 7 6 8
2
9 11 10 12
-1 0.5 -2 0.25 0.3 0.4"""
DENSE = """2 2 0 4 4 4 4
1 3 0 0
2 4 0 0
5 7 9 11
6 8 10 12
-1 0.5 -2 0.25 0.3 0.4"""


def same(p, q):
    assert (p.dim, p.contacts) == (q.dim, q.contacts)
    assert (p.W.toarray() == q.W.toarray()).all() and (p.q == q.q).all() and (p.mu == q.mu).all()


@pytest.mark.parametrize("like", ["rows", "columns", "triplets"])
@pytest.mark.parametrize("dim", [2, 3])
def test_fclib_comes_back(tmp_path, like, dim):
    p = random_problem(dim, contacts=5, seed=2, unsymmetric=0.01)
    path = tmp_path / "p.hdf5"
    result = p.solve("nlgs", tol=1e-9)
    problems.fclib.write(path, p, result, like=like)
    same(p, problems.read(path))
    r, u = problems.read_solution(path)
    assert (r == result.r).all() and (u == result.u).all()


@pytest.mark.parametrize("like", ["rows", "columns", "triplets"])
@pytest.mark.parametrize("dim", [2, 3])
def test_what_programs_in_c_read(tmp_path, like, dim):
    """The same blocks: figures of the same impulses, and the solution to the bit."""
    p = random_problem(dim, contacts=5, seed=2, unsymmetric=0.01)
    path = str(tmp_path / "p.hdf5")
    problems.fclib.write(path, p, like=like)
    read = _core.FrictionProblem.read(path)
    assert (read.dim, read.contacts) == (dim, 5)
    r = np.random.default_rng(3).standard_normal((5, dim))
    assert read.measure(r)["error"] == pytest.approx(p.error(r), rel=1e-13)
    given = dict(tol=1e-9, max_iter=1000, max_seconds=100.0, threads=1, seed=0, relaxation=1.0, warm_start=False, memory=1e9)
    found = np.zeros((5, dim))
    assert read.solve("nlgs", found, *given.values())["status"] == "converged"
    assert np.array_equal(found, p.solve("nlgs", tol=1e-9, max_iter=1000).r)


def test_what_programs_in_c_do_not_read(tmp_path):
    p = random_problem(2, contacts=3, seed=2)
    path = str(tmp_path / "p.hdf5")
    for change, told in (
        (lambda f: f["fclib_local/W/i"].write_direct(np.full_like(f["fclib_local/W/i"][()], 9)), "W has an entry outside of it"),
        (lambda f: f["fclib_local/spacedim"].write_direct(np.full_like(f["fclib_local/spacedim"][()], 5)), "spacedim is 5"),
        (lambda f: f.move("fclib_local/vectors/mu", "fclib_local/vectors/nu"), "lacks vectors/mu"),
        (lambda f: f.move("fclib_local", "else"), "has no fclib_local"),
    ):
        problems.fclib.write(path, p)
        with h5py.File(path, "r+") as file:
            change(file)
        with pytest.raises(cn.FileError, match=told):
            _core.FrictionProblem.read(path)


def test_triplets_have_rows_in_i(tmp_path):
    """An unsymmetric W, written by hand: i is the row, p the column, and only the first nz count."""
    path = tmp_path / "p.hdf5"
    with h5py.File(path, "w") as file:
        g = file.create_group("fclib_local")
        g["spacedim"] = [2]
        for name, value in {
            "m": [2],
            "n": [2],
            "nz": [3],
            "nzmax": [4],
            "i": [0, 1, 0, 1],
            "p": [0, 1, 1, 0],
            "x": [2.0, 3.0, 0.5, 99.0],
        }.items():
            g[f"W/{name}"] = value
        g["vectors/q"], g["vectors/mu"] = [-1.0, 0.5], [0.3]
    assert (problems.read(path).W.toarray() == [[2, 0.5], [0, 3]]).all()


def test_global_is_reduced(tmp_path):
    """Against the whole system solved by elimination: u = H' v + w with M v = H r + G l + f, G' v + b = 0."""
    rng = np.random.default_rng(4)
    n, c, e = 9, 3, 2
    M = np.diag(rng.uniform(1, 2, n)) + 0.1 * np.ones((n, n))
    H, G = rng.normal(size=(n, 3 * c)), rng.normal(size=(n, e))
    f, w, b = rng.normal(size=n), rng.normal(size=3 * c), rng.normal(size=e)
    for equalities in (False, True):
        path = tmp_path / f"global{equalities}.hdf5"
        with h5py.File(path, "w") as file:
            g = file.create_group("fclib_global")
            g["spacedim"] = [3]
            for name, matrix in {"M": M, "H": H, "G": G if equalities else np.zeros((n, 0))}.items():
                problems.fclib._write_matrix(g.create_group(name), sparse.csr_array(matrix), "triplets")
            for name, value in {"f": f, "w": w, "b": b if equalities else np.zeros(0), "mu": np.full(c, 0.4)}.items():
                g[f"vectors/{name}"] = value
        p = problems.read(path)
        r = rng.normal(size=3 * c)
        if equalities:
            whole = np.block([[M, -G], [G.T, np.zeros((e, e))]])
            v = np.linalg.solve(whole, np.concatenate([H @ r + f, -b]))[:n]
        else:
            v = np.linalg.solve(M, H @ r + f)
        assert np.allclose(p.velocity(r).ravel(), H.T @ v + w, rtol=1e-11, atol=1e-11)


def test_text_as_siconos_prints_it(tmp_path):
    for name, text in {"blocks.dat": BLOCKS, "dense.dat": DENSE}.items():
        (tmp_path / name).write_text(text)
    same(problems.read(tmp_path / "blocks.dat"), problems.read(tmp_path / "dense.dat"))
    p = problems.read(tmp_path / "dense.dat")
    assert (p.W.toarray()[0] == [1, 2, 5, 6]).all() and (p.mu == [0.3, 0.4]).all()


@pytest.mark.parametrize("dense", [False, True])
def test_text_comes_back(tmp_path, dense):
    p = random_problem(3, contacts=4, seed=2, unsymmetric=0.01)
    problems.text.write(tmp_path / "p.dat", p, dense=dense)
    same(p, problems.read(tmp_path / "p.dat"))


# M and H of a contact, both 3 x 3: the first matrix has the size of a local W
GLOBAL = """3
1
0
3
3
3 3
2 0 0
0 4 0
0 0 8
0
3
3
3 3
1 0 0
1 1 0
0 0 2
-1 2 0.5
0.25 -3 1
0.7
"""
GLOBAL_BLOCKS = """3 1
1 3 3 2 2 2  2 3  2 3  3 2  0 1 2  0 1
0  2 0 0 4
1  8
1 3 3 4 2 2  1 3  2 3  3 4  0 2 4  0 1 0 1
0  1 1
1  0
2  0 0 1 0
3  0 2
-1 2 0.5
0.25 -3 1
0.7
1
"""


def sparse_text(matrix, origin):
    """A matrix as CSparse prints it: 1 triplets, 2 columns, 3 rows."""
    m, n = matrix.shape
    lines = [str(origin), "CSparse Version 3.2.0, Sept 12, 2017.  Copyright (c) Timothy A. Davis, 2006-2016"]
    if origin == 1:
        coo = sparse.coo_array(matrix)
        lines.append(f"triplet: {m}-by-{n}, nzmax: {coo.nnz + 5} nnz: {coo.nnz}")
        lines += [f"    {i} {j} : {x:g}" for i, j, x in zip(coo.row, coo.col, coo.data)]
    else:
        packed = sparse.csc_array(matrix) if origin == 2 else sparse.csr_array(matrix)
        lines.append(f"{'csr: ' if origin == 3 else ''}{m}-by-{n}, nzmax: {packed.nnz} nnz: {packed.nnz}, 1-norm: 7")
        for k, (a, b) in enumerate(zip(packed.indptr[:-1], packed.indptr[1:])):
            lines.append(f"    {'col' if origin == 2 else 'row'} {k} : locations {a} to {b - 1}")
            lines += [f"      {i} : {x:g}" for i, x in zip(packed.indices[a:b], packed.data[a:b])]
    return f"2\n{m}\n{n}\n" + "\n".join(lines) + "\n"


def test_global_text_of_the_size_of_a_local_one(tmp_path):
    """The first matrix may be M of a global problem as well as W: the following lines decide, and none is left over."""
    M, H = np.diag([2.0, 4.0, 8.0]), np.array([[1.0, 1, 0], [0, 1, 0], [0, 0, 2]])
    q, b, sparse_numbers = [-1, 2, 0.5], [0.25, -3, 1], "-1 2 0.5\n0.25 -3 1\n0.7\n"
    texts = [GLOBAL, GLOBAL_BLOCKS, *(f"3\n1\n{sparse_text(M, a)}{sparse_text(H, a)}{sparse_numbers}" for a in (1, 2, 3))]
    for text in texts:
        (tmp_path / "p.dat").write_text(text)
        p = problems.read(tmp_path / "p.dat")
        assert p.contacts == 1 and (p.mu == [0.7]).all()
        assert np.allclose(p.W.toarray(), H.T @ np.linalg.inv(M) @ H, rtol=1e-15)
        assert np.allclose(p.q.ravel(), H.T @ np.linalg.solve(M, q) + b, rtol=1e-15)


@pytest.mark.parametrize("origin", [1, 2, 3])
def test_sparse_text(tmp_path, origin):
    """Rows and columns that hold nothing have their line, too."""
    (tmp_path / "dense.dat").write_text(DENSE)
    p = problems.read(tmp_path / "dense.dat")
    (tmp_path / "sparse.dat").write_text(f"2\n2\n{sparse_text(p.W.toarray(), origin)}-1 0.5 -2 0.25\n0.3 0.4\n")
    same(problems.read(tmp_path / "sparse.dat"), p)


def test_no_number_is_left_over(tmp_path):
    triplets, columns = (f"2\n1\n{sparse_text(np.eye(2), origin)}1 1 1" for origin in (1, 2))
    for text, words in (
        (DENSE + "\n7", r"line 7: 1 words are left over, from '7' on"),
        (DENSE + "\n1 0", "line 7: 2 words are left over"),
        (GLOBAL + "1 2", "line 20: 2 words are left over"),
        (GLOBAL.replace("0\n3\n3\n3 3\n1 0 0", "0\n3\n4\n3 4\n1 0 0"), "line 13: .* words are left over, from '0.25'|left over"),
        (GLOBAL.replace("-1 2 0.5\n", "-1 2\n"), "line 19: the file ends before mu"),
        (GLOBAL.replace("0 4 0", "0 4,5 0"), r"line 8: '4,5' is no number of the first matrix"),
        (GLOBAL.replace("0 4 0", "0 1_0 0"), r"line 8: '1_0'"),
        (GLOBAL.replace("0 4 0", "0 nan 0"), r"line 8: 'nan'"),
        (GLOBAL.replace("0 4 0", "0 \u00bd 0"), r"line 8: holds the byte"),
        (GLOBAL_BLOCKS.replace("1  8", "2  8"), "line 4: a block of the first matrix has number 2: 1 is due"),
        (GLOBAL_BLOCKS.replace("0 1 2  0 1", "0 1 2  0 7"), "line 2: the columns of the first matrix"),
        ("5 1 0 5 5 5 5", "line 1: dim is 5"),
        ("2\n-1", "line 2: the number of contacts is -1"),
        ("2\n1\n0\n5\n5\n5 5\n" + "1 " * 40, "line 7: the first matrix is 5 x 5: it is no W"),
        (triplets.replace("1 1 : 1", "1 2 : 1"), "line 8: the first matrix has an entry in column 2"),
        (columns.replace("col 1 : locations 1", "col 1 : locations 0"), "line 11: col 1"),
        (columns.replace("nnz: 2", "nnz: 3"), "line 13: .* has 2 entries: 3 were told"),
        ("", "line 1: the file ends before dim"),
    ):
        (tmp_path / "p.dat").write_bytes(text.encode("utf-8"))
        with pytest.raises(problems.ProblemFileError, match=words):
            problems.read(tmp_path / "p.dat")


def test_damaged_files_are_told(tmp_path):
    for name, text, words in (
        ("short.dat", DENSE[:40], "ends before"),
        ("words.dat", "3\n\none", "line 3: 'one'"),
        ("kind.dat", "2 1 3 2 2", "line 1: .* kind 3"),
        ("junk.hdf5", "junk", "cannot be opened"),
    ):
        (tmp_path / name).write_text(text)
        with pytest.raises(problems.ProblemFileError, match=words):
            problems.read(tmp_path / name)
    with pytest.raises(problems.ProblemFileError, match="no such file"):
        problems.read(tmp_path / "absent.hdf5")
    with h5py.File(tmp_path / "empty.hdf5", "w"):
        pass
    with pytest.raises(problems.ProblemFileError, match="neither"):
        problems.read(tmp_path / "empty.hdf5")


def test_command(tmp_path):
    p = random_problem(3, contacts=4, seed=2)
    problems.write(tmp_path / "p.hdf5", p)
    command = [sys.executable, "-m", "cairn.cli", "solve"]
    done = subprocess.run(
        [*command, tmp_path / "p.hdf5", "--tol", "1e-9", "--solver", "nlgs", "--output", tmp_path / "s.hdf5"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert "converged" in done.stdout and "rank 12 of 12" in done.stdout
    r, u = problems.read_solution(tmp_path / "s.hdf5")
    assert plain_true_error(p, r) <= 1.0001e-9
    assert np.allclose(u, p.velocity(r))
    table = subprocess.run(
        [*command, tmp_path / "p.hdf5", tmp_path / "s.hdf5", "--csv", "--solver", "nlgs"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout.splitlines()
    assert len(table) == 3 and table[1].split(",")[6] == "converged"
    problems.write(tmp_path / "p.hdf5", resting_box(8)[0])
    hard = subprocess.run([*command, tmp_path / "p.hdf5", "--max-iter", "1", "--solver", "nlgs"], capture_output=True, text=True)
    assert hard.returncode == 3 and "iteration limit" in hard.stdout


@pytest.mark.skipif(not DATA.is_dir(), reason=f"no reference problems at {DATA}")
def test_reference_problems_are_read():
    for path in sorted(DATA.glob("*.hdf5")):
        p = problems.read(path)
        with h5py.File(path) as file:  # one row, by the layout's words
            W, row = file["fclib_local/W"], 3 * p.dim + 1 if p.contacts > 3 else 0
            assert W["nz"][0] == -2
            lo, hi = W["p"][row], W["p"][row + 1]
            dense = np.zeros(p.dim * p.contacts)
            np.add.at(dense, W["i"][lo:hi], W["x"][lo:hi])
        assert (p.W.toarray()[row] == dense).all()
