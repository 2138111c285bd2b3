"""Grain-size distributions: the law wanted, the same bits for the same seed, exact scaling, refusals."""

import math

import numpy as np
import pytest
from cairn.pre import grains

N = 20_000
KOLMOGOROV = 1.95  # sqrt(n) times the distance, exceeded by chance once in a thousand; the seeds are fixed


def distance(values, cumulative, weights=None):
    """Largest distance between the sample's cumulated (weighted) share and the law."""
    order = np.argsort(values)
    weights = np.ones(len(values)) if weights is None else weights[order]
    upper = np.cumsum(weights) / weights.sum()
    lower = np.concatenate(([0.0], upper[:-1]))
    law = cumulative(values[order])
    return max(np.max(np.abs(upper - law)), np.max(np.abs(lower - law)))


def phi(z):
    return 0.5 * np.vectorize(math.erfc)(-z / math.sqrt(2.0))


def test_uniform_by_number():
    radii = grains.uniform(N, 0.42, 0.56, rng=1)
    assert radii.shape == (N,) and radii.min() >= 0.42 and radii.max() <= 0.56
    assert distance(radii, lambda r: (r - 0.42) / 0.14) * math.sqrt(N) < KOLMOGOROV


@pytest.mark.parametrize("dim", [2, 3])
def test_uniform_by_mass(dim):
    radii = grains.uniform(N, 1.0, 4.0, rng=2, by="mass", dim=dim, stratified=True)
    assert distance(radii, lambda r: (r - 1.0) / 3.0, radii**dim) < 20.0 / N


def test_stratified_follows_closer():
    def error(flag):
        return distance(grains.uniform(N, 1.0, 2.0, rng=3, stratified=flag), lambda r: r - 1.0)

    assert error(True) < 1.01 / N < error(False)


def test_normal():
    radii = grains.normal(N, 1.0, 0.2, smallest=0.7, largest=1.5, rng=4)
    low, high = phi(np.array([-1.5, 2.5]))
    assert radii.min() >= 0.7 and radii.max() <= 1.5
    assert distance(radii, lambda r: (phi((r - 1.0) / 0.2) - low) / (high - low)) * math.sqrt(N) < KOLMOGOROV


def test_lognormal_by_number():
    radii = grains.lognormal(N, 0.01, 0.3, rng=5)
    low, high = phi(np.array([-2.5, 2.5]))
    assert distance(radii, lambda r: (phi(np.log(r / 0.01) / 0.3) - low) / (high - low)) * math.sqrt(N) < KOLMOGOROV


@pytest.mark.parametrize("dim", [2, 3])
def test_lognormal_by_mass(dim):
    radii = grains.lognormal(N, 2.0, 0.25, smallest=0.5, largest=8.0, rng=6, by="mass", dim=dim)
    assert distance(radii, lambda r: phi(np.log(r / 2.0) / 0.25), radii**dim) < 0.02


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("scale", ["linear", "log"])
def test_curve_is_met(tmp_path, dim, scale):
    path = tmp_path / "curve.csv"
    path.write_text("diameter,passing\n# sieves\n0.001,0\n0.002,0.3\n\n0.005,0.35\n0.02,1\n")
    radii = grains.from_curve(N, path, rng=7, dim=dim, scale=scale, stratified=True)
    diameter, passing = np.array([0.001, 0.002, 0.005, 0.02]), np.array([0.0, 0.3, 0.35, 1.0])
    axis = np.log if scale == "log" else np.asarray
    law = lambda r: np.interp(axis(2.0 * r), axis(diameter), passing)
    # the last piece in 3D holds few grains of large mass: their share sets the distance
    assert distance(radii, law, radii**dim) < 2.0 * radii.max() ** dim / np.sum(radii**dim) + 2.0 / N


def test_curve_from_array_with_a_gap():
    radii = grains.from_curve(1000, [[1.0, 0.0], [2.0, 0.5], [3.0, 0.5], [4.0, 1.0]], rng=8)
    assert not np.any((radii > 1.0) & (radii < 1.5)) and radii.min() >= 0.5 and radii.max() <= 2.0


MAKERS = {
    "uniform": lambda s, rng: grains.uniform(500, 0.4 * s, 0.9 * s, rng=rng),
    "uniform by mass": lambda s, rng: grains.uniform(500, 0.4 * s, 0.9 * s, rng=rng, by="mass", dim=3),
    "normal": lambda s, rng: grains.normal(500, 0.5 * s, 0.1 * s, rng=rng),
    "lognormal": lambda s, rng: grains.lognormal(500, 0.5 * s, 0.3, rng=rng),
    "curve": lambda s, rng: grains.from_curve(500, np.array([[0.3 * s, 0.0], [0.7 * s, 1.0]]), rng=rng, scale="log"),
}


@pytest.mark.parametrize("maker", MAKERS.values(), ids=MAKERS.keys())
def test_same_seed_same_bits_and_exact_scaling(maker):
    reference = maker(1.0, 11)
    assert np.array_equal(reference, maker(1.0, np.random.default_rng(11)))
    assert not np.array_equal(reference, maker(1.0, 12))
    for power in (-40, 17):
        assert np.array_equal(np.ldexp(reference, power), maker(2.0**power, 11))


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: grains.uniform(-1, 1, 2, rng=0), ["n is -1", ">= 0"]),
        (lambda: grains.uniform(2.5, 1, 2, rng=0), ["n is 2.5", "whole"]),
        (lambda: grains.uniform(5, 0.0, 2, rng=0), ["smallest is 0.0", "> 0"]),
        (lambda: grains.uniform(5, 1, float("nan"), rng=0), ["largest is nan", "finite"]),
        (lambda: grains.uniform(5, 3, 2, rng=0), ["smallest is 3", "exchange"]),
        (lambda: grains.uniform(5, 1, 2, rng=None), ["rng is None", "seed"]),
        (lambda: grains.uniform(5, 1, 2, rng=0, by="volume"), ["by is 'volume'", "mass"]),
        (lambda: grains.uniform(5, 1, 2, rng=0, by="mass", dim=4), ["dim is 4", "2"]),
        (lambda: grains.normal(5, 1, -0.1, rng=0), ["deviation is -0.1", "> 0"]),
        (lambda: grains.normal(5, 1, 0.1, rng=0, smallest=2, largest=3), ["leave", "move"]),
        (lambda: grains.lognormal(5, "x", 0.1, rng=0), ["median is 'x'", "finite"]),
        (lambda: grains.from_curve(5, [[1, 0], [2, 30], [3, 100]], rng=0), ["passing[1] is 30", "per cent"]),
        (lambda: grains.from_curve(5, [[1, 0], [2, 0.9]], rng=0), ["passing[1] is 0.9", "add a row"]),
        (lambda: grains.from_curve(5, [[1, 0.1], [2, 1]], rng=0), ["passing[0] is 0.1", "add a row"]),
        (lambda: grains.from_curve(5, [[1, 0], [1, 0.5], [2, 1]], rng=0), ["diameter[1] is 1.0", "sort"]),
        (lambda: grains.from_curve(5, [[1, 0], [2, 0.5], [3, 0.4], [4, 1]], rng=0), ["passing[2] is 0.4", "sort"]),
        (lambda: grains.from_curve(5, [[1, 0], [np.inf, 1]], rng=0), ["curve[1, 0] is inf", "finite"]),
        (lambda: grains.from_curve(5, [1.0, 2.0], rng=0), ["shape (2,)", "(n, 2)"]),
    ],
)
def test_refusals_name_field_value_and_remedy(call, words):
    with pytest.raises(ValueError) as refusal:
        call()
    for word in words:
        assert word in str(refusal.value)


def test_bad_csv_names_the_line(tmp_path):
    path = tmp_path / "bad.csv"
    path.write_text("diameter,passing\n1,0\n2;1\n")
    with pytest.raises(ValueError, match="line 3 .*'2;1'"):
        grains.from_curve(5, path, rng=0)
    path.write_text("\n")
    with pytest.raises(ValueError, match="holds no row"):
        grains.from_curve(5, path, rng=0)
    with pytest.raises(FileNotFoundError):
        grains.from_curve(5, tmp_path / "none.csv", rng=0)
