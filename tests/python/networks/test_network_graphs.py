"""Flow through graphs of conductances, against closed forms of lattices, Foster's sum and conservation."""

import cairn as cn
import numpy as np
import pytest

METHODS = ("direct", "multigrid")


def lattice(*counts, periodic=False):
    i = np.arange(np.prod(counts)).reshape(counts)
    pairs = []
    for axis, n in enumerate(counts):
        one, other = (i, np.roll(i, -1, axis)) if periodic else (np.take(i, range(n - 1), axis), np.take(i, range(1, n), axis))
        pairs.append(np.stack([one.ravel(), other.ravel()], axis=1))
    return np.concatenate(pairs)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("counts", "periodic", "ends", "value"),
    [
        ((20, 20), True, (0, 1), (1 - 1 / 400) / 2),
        ((16, 16, 16), True, (0, 1), (1 - 1 / 4096) / 3),
        ((3, 3), False, (0, 8), 1.5),
        ((3, 3), False, (1, 4), 7 / 12),
        ((3, 3), False, (0, 1), 17 / 24),
        ((2, 2, 2), False, (0, 1), 7 / 12),
        ((2, 2, 2), False, (0, 3), 3 / 4),
        ((2, 2, 2), False, (0, 7), 5 / 6),
    ],
)
def test_lattices(counts, periodic, ends, value, method):
    found = cn.networks.resistance(lattice(*counts, periodic=periodic), 1.0, ends, method=method)
    assert found[0] == pytest.approx(value, rel=1e-12)


def test_corners_of_an_open_square():
    assert cn.networks.resistance(lattice(11, 11), 1.0, (0, 120))[0] == pytest.approx(3.132577, abs=5e-7)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("decades", [0, 6, 12, 15])
def test_fosters_sum(decades, method):
    """The sum of C R over all branches is n - 1 (Foster 1949), whatever the conductances."""
    rng = np.random.default_rng(decades)
    pairs = lattice(4, 5)
    c = 10.0 ** (decades * rng.random(len(pairs)))
    total = 0.0
    for k, (a, b) in enumerate(pairs.tolist()):
        flow = cn.networks.solve(pairs, c, source={a: 1.0, b: -1.0}, method=method)
        assert flow.report["status"] == "converged"
        total += flow.current[k]
    assert total == pytest.approx(19, rel=1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_currents_balance_at_every_unknown(method):
    rng = np.random.default_rng(3)
    pairs = lattice(12, 12, 12)
    c = 10.0 ** rng.uniform(*((-6, 6) if method == "direct" else (-2, 2)), len(pairs))
    flow = cn.networks.solve(pairs, c, potential={0: 1.0, 1727: 0.0}, method=method)
    out = np.zeros(1728)
    np.add.at(out, pairs[:, 0], flow.current)
    np.add.at(out, pairs[:, 1], -flow.current)
    assert abs(out[0] + out[-1]) <= 1e-12 * out[0]
    assert np.abs(out[1:-1]).max() <= 1e-12 * np.abs(flow.current).max()


def test_methods_agree():
    rng = np.random.default_rng(4)
    pairs, c = lattice(15, 15, 15), 10.0 ** rng.uniform(-2, 2, 3 * 15 * 15 * 14)
    ends = (0, 3374)
    found = [cn.networks.resistance(pairs, c, ends, method=m)[0] for m in METHODS]
    assert found[0] == pytest.approx(found[1], rel=1e-11)


@pytest.mark.parametrize("method", METHODS)
def test_series_over_twelve_decades(method):
    c = np.array([1e12, 1.0, 1e-3, 1e6])
    pairs = np.stack([np.arange(4), np.arange(1, 5)], axis=1)
    assert cn.networks.resistance(pairs, c, (0, 4), method=method)[0] == pytest.approx(np.sum(1 / c), rel=1e-14)
    flow = cn.networks.solve(pairs, c, source={0: 2.0, 4: -2.0}, method=method)
    assert flow.current == pytest.approx(2.0, rel=1e-12)


def test_infinite_conductances_join_and_carry():
    pairs = [(0, 1), (1, 2), (2, 3), (1, 4), (4, 2)]
    flow = cn.networks.solve(pairs, [1.0, np.inf, 2.0, np.inf, np.inf], source={0: 3.0, 3: -3.0})
    assert flow.potential[1] == flow.potential[2] == flow.potential[4]
    assert flow.potential[0] - flow.potential[3] == pytest.approx(4.5, rel=1e-14)
    assert flow.current == pytest.approx([3, 2, 3, 1, 1], rel=1e-14)


def test_zero_conductances_isolated_unknowns_and_none_at_all():
    flow = cn.networks.solve([(0, 1), (1, 2)], [1.0, 0.0], potential={0: 5.0}, n=4)
    assert flow.potential[:2] == pytest.approx(5.0) and np.isnan(flow.potential[2:]).all()
    assert flow.report["floating"] == 2 and flow.report["status"] == "converged"
    flow = cn.networks.solve(np.zeros((0, 2), int), 1.0, n=1)
    assert np.isnan(flow.potential).all() and flow.report["floating"] == 1
    assert cn.networks.resistance([(0, 1)], 0.0, (0, 1))[0] == np.inf


def test_sources_that_do_not_balance_are_told():
    flow = cn.networks.solve([(0, 1), (2, 3)], 1.0, source={0: 1.0, 1: -1.0, 2: 1.0})
    assert flow.report["open"] == 2 and np.isnan(flow.potential[2:]).all()
    assert flow.potential[0] - flow.potential[1] == 1.0


def test_leaks_anchor():
    flow = cn.networks.solve([(0, 1)], 2.0, source={0: 1.0}, leak=[0.0, 4.0])
    assert flow.potential == pytest.approx([0.75, 0.25], rel=1e-15)


def test_powers_of_two_keep_bits():
    rng = np.random.default_rng(5)
    pairs, c = lattice(6, 7), rng.uniform(0.1, 9, 71)
    one = cn.networks.solve(pairs, c, source={0: 1.0, 41: -1.0})
    two = cn.networks.solve(pairs, 2.0**40 * c, source={0: 2.0**10, 41: -(2.0**10)})
    assert np.array_equal(two.potential * 2.0**30, one.potential)
    assert np.array_equal(two.current, one.current * 2.0**10)


def test_what_is_refused():
    with pytest.raises(ValueError, match="conductance"):
        cn.networks.solve([(0, 1)], -1.0)
    with pytest.raises(ValueError, match="branches"):
        cn.networks.solve([0, 1], 1.0)
    with pytest.raises(ValueError, match="unknown of source"):
        cn.networks.solve([(0, 1)], 1.0, source={7: 1.0})
    with pytest.raises(ValueError, match="method"):
        cn.networks.solve([(0, 1)], 1.0, method="guess")
