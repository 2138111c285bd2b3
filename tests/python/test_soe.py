"""Systems of linear equations in every storage, against a dense solution by elimination."""

import numpy as np
import pytest
from cairn import soe
from cairn.run.soe import SOE, STORAGES
from scipy import sparse


def chain(n, rng):
    """Springs along a chain whose nodes are numbered at random, and some across."""
    order = rng.permutation(n)
    a = sparse.lil_array((n, n))
    for i in range(n):
        a[order[i], order[i]] = 3.0 + rng.random()
        for j in (i + 1, i + 3):
            if j < n:
                a[order[i], order[j]] = a[order[j], order[i]] = -rng.random()
    return a


@pytest.mark.parametrize("storage", STORAGES)
def test_each_storage_solves(storage):
    rng = np.random.default_rng(3)
    a = sparse.diags_array(1 + rng.random(200)) if storage == "diagonal" else chain(200, rng)
    soe = SOE(a, storage)
    assert soe.storage == storage
    for b in (rng.random(200), rng.random((200, 3))):
        x = soe.solve(b)
        expected = np.linalg.solve(a.toarray(), b)
        assert np.max(np.abs(x - expected)) < 1e-13 * np.max(np.abs(expected))


def test_sparse_factors_of_both_libraries_agree():
    pytest.importorskip("sksparse", reason="scikit-sparse is not installed: CHOLMOD is not tried")
    rng = np.random.default_rng(5)
    a = chain(400, rng).tocsc()
    b = rng.random((400, 2))
    one, two = SOE(a, "sparse").solve(b), soe._superlu(a)(b)
    assert "sksparse" in type(SOE(a, "sparse")._solve).__module__
    assert np.max(np.abs(one - two)) < 1e-13 * np.max(np.abs(two))


def test_storage_that_fits_is_chosen():
    rng = np.random.default_rng(3)
    n = 40
    grid = sparse.kron(sparse.eye_array(n), chain(n, rng)) + sparse.kron(chain(n, rng), sparse.eye_array(n))
    assert SOE(sparse.eye_array(5)).storage == "diagonal"
    assert SOE(chain(20, rng)).storage == "dense"
    assert SOE(chain(300, rng)).storage == "banded"
    assert SOE(grid).storage == "sparse"


def test_what_is_wrong_is_named():
    a = sparse.csc_array(np.array([[1.0, 2.0], [2.0, 1.0]]))
    for storage in ("banded", "dense", "sparse"):
        with pytest.raises(ValueError, match="2 unknowns is not positive definite"):
            SOE(a, storage)
    with pytest.raises(ValueError, match="entries off its diagonal"):
        SOE(a, "diagonal")
    with pytest.raises(ValueError, match="storage is 'skyline': give diagonal, banded"):
        SOE(a, "skyline")
    with pytest.raises(ValueError, match="not finite"):
        SOE(a * np.nan)
    with pytest.raises(ValueError, match=r"right side has shape \(3,\)"):
        SOE(a @ a.T + sparse.eye_array(2)).solve(np.ones(3))
