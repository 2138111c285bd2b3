"""FCLIB and Siconos files: what was written comes back, in every storage; what is damaged is told."""

import os
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from cairn import problems
from made_up_problems import plain_true_error, random_problem, resting_box
from scipy import sparse

DATA = Path(os.environ.get("CAIRN_REFERENCE_DATA", Path(__file__).resolve().parents[3] / "shared")) / "problems"
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


def test_triplets_have_rows_in_i(tmp_path):
    """An unsymmetric W, written by hand: i is the row, p the column, and only the first nz count."""
    path = tmp_path / "p.hdf5"
    with h5py.File(path, "w") as file:
        g = file.create_group("fclib_local")
        g["spacedim"] = [2]
        for name, value in {"m": [2], "n": [2], "nz": [3], "nzmax": [4], "i": [0, 1, 0, 1], "p": [0, 1, 1, 0],
                            "x": [2.0, 3.0, 0.5, 99.0]}.items():
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


def test_damaged_files_are_told(tmp_path):
    for name, text, words in (
        ("short.dat", DENSE[:40], "ends before"),
        ("words.dat", "3 one", "invalid literal"),
        ("sparse.dat", "2 1 2 2 2", "kind 2"),
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
    done = subprocess.run([*command, tmp_path / "p.hdf5", "--tol", "1e-9", "--solver", "nlgs", "--output", tmp_path / "s.hdf5"],
                          capture_output=True, text=True, check=True)
    assert "converged" in done.stdout and "rank 12 of 12" in done.stdout
    r, u = problems.read_solution(tmp_path / "s.hdf5")
    assert plain_true_error(p, r) <= 1.0001e-9
    assert np.allclose(u, p.velocity(r))
    table = subprocess.run([*command, tmp_path / "p.hdf5", tmp_path / "s.hdf5", "--csv", "--solver", "nlgs"],
                           capture_output=True, text=True, check=True).stdout.splitlines()
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
