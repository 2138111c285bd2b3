"""Systems of linear equations in every storage, against a dense solution by elimination."""

import numpy as np
import pytest
from cairn import _core
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
    with pytest.raises(ValueError, match="2 unknowns is not positive definite.*it shows at unknown 1"):
        SOE(np.array([[1.0, 1.0], [1.0, 1.0]]), "dense")
    with pytest.raises(ValueError, match="2 unknowns is singular"):
        SOE(np.array([[1.0, 2.0], [0.0, 0.0]]), "unsymmetric")
    with pytest.raises(ValueError, match=r"right side has shape \(3,\)"):
        SOE(a @ a.T + sparse.eye_array(2)).solve(np.ones(3))


def definite(n, condition, rng):
    """Eigenvalues from 1 down to 1 / condition."""
    q, _ = np.linalg.qr(rng.normal(size=(n, n)))
    a = (q * condition ** -np.linspace(0, 1, n)) @ q.T
    return (a + a.T) / 2


@pytest.mark.parametrize("storage", ["banded", "dense", "sparse", "unsymmetric", None])
@pytest.mark.parametrize("n", [0, 1, 2, 5, 60, 400])
def test_every_size_as_numpy(n, storage):
    rng = np.random.default_rng(n)
    a = chain(n, rng).toarray()
    b = rng.normal(size=(n, 3))
    x = SOE(a, storage).solve(b)
    expected = np.linalg.solve(a, b)
    assert x.shape == b.shape
    assert np.all(np.abs(x - expected) <= 1e-13 * np.max(np.abs(expected), initial=0))
    assert np.array_equal(SOE(a, storage).solve(b[:, 1]), x[:, 1])


@pytest.mark.parametrize("storage", ["banded", "dense", "sparse"])
@pytest.mark.parametrize("condition", [1e0, 1e4, 1e8, 1e12, 1e14])
def test_residual_stays_small_however_ill_conditioned(condition, storage):
    rng = np.random.default_rng(7)
    a = definite(60, condition, rng)
    b = rng.normal(size=60)
    x = SOE(a, storage).solve(b)
    assert np.linalg.norm(a @ x - b) <= 1e-14 * (np.linalg.norm(a) * np.linalg.norm(x) + np.linalg.norm(b))


@pytest.mark.parametrize("storage", ["banded", "dense", "sparse"])
def test_no_scale_is_too_small_or_large(storage):
    rng = np.random.default_rng(8)
    a, b = chain(70, rng).toarray(), rng.normal(size=70)
    x = SOE(a, storage).solve(b)
    for power in (-664, -51, 1, 664):  # 1e-200 to 1e200
        assert np.array_equal(SOE(np.ldexp(a, power), storage).solve(np.ldexp(b, power)), x)
    units = 10.0 ** rng.uniform(-100, 100, 70)  # 200 decades within one matrix
    scaled = SOE(units[:, None] * a * units, storage).solve(units * b)
    assert np.max(np.abs(scaled * units - x)) < 1e-12 * np.max(np.abs(x))


@pytest.mark.parametrize("storage", ["banded", "dense", "sparse"])
def test_springs_without_a_mass_are_singular(storage):
    rng = np.random.default_rng(9)
    k = rng.random(69)
    a = sparse.diags_array([-k, np.r_[k, 0] + np.r_[0, k], -k], offsets=[-1, 0, 1])
    with pytest.raises(ValueError, match="70 unknowns is not positive definite"):
        SOE(a, storage)


@pytest.mark.parametrize("storage", ["banded", "dense", "sparse", "unsymmetric"])
def test_threads_and_columns_leave_bits(storage):
    rng = np.random.default_rng(10)
    system, b = SOE(chain(150, rng), storage), rng.normal(size=(150, 37))
    one = system.solve(b, threads=1)
    assert np.array_equal(system.solve(b, threads=2), one)
    assert np.array_equal(np.column_stack([system.solve(c) for c in b.T]), one)


@pytest.mark.parametrize("held", [False, True])
@pytest.mark.parametrize("storage", ["banded", "dense", "sparse"])
def test_units_are_entries_of_the_inverse(storage, held):
    rng = np.random.default_rng(11)
    a = sparse.csc_array(chain(120, rng))
    lower = sparse.csc_array(sparse.tril(a))
    lower.sort_indices()
    marks = np.zeros(120, bool)
    marks[[3, 50]] = held
    system = _core.Soe(120, lower.indptr, lower.indices, lower.data, storage, held=marks if held else None)
    wanted = np.array([7, 110, 3, 64, 65, 66, 20, 21, 22, 90], np.int32)
    expected = np.zeros((120, 120))
    expected[np.ix_(~marks, ~marks)] = np.linalg.inv(a.toarray()[np.ix_(~marks, ~marks)])
    found = system.solve_units(wanted)
    assert np.array_equal(found, found.T)
    assert np.max(np.abs(found - expected[np.ix_(wanted, wanted)])) < 1e-14 * np.max(expected)
    assert np.array_equal(system.solve_units(wanted, threads=2), found)
