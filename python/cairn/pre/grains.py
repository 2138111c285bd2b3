"""Random grain-size distributions: radii [m] of shape (n,), the same for the same seed.

A distribution is given by number (each grain counts once) or by mass (each grain counts with its volume, as a sieve
does): `by="mass"`, with `dim` saying whether volume goes with the square or the cube of the radius. A law given by
mass is turned into one by number first, exactly: n(r) ~ m(r) / r^dim.

`stratified=True` draws one grain in each of n equal shares of the distribution, then shuffles: the sample follows the
wanted curve to 1/n rather than 1/sqrt(n), which matters for mass curves, where a few large grains weigh most.

All lengths scale: radii for sizes multiplied by a power of two are the same bits multiplied by it.
"""

from __future__ import annotations

import csv
import math
import os

import numpy as np

from ..base import checks

SMALLEST_ACCEPTANCE = 1.0e-3  # a truncation that keeps less of the law than this is taken for a mistake


def uniform(n, smallest, largest, *, rng, by="number", dim=2, stratified=False) -> np.ndarray:
    """Radii spread evenly from `smallest` to `largest` [m], by number or by mass.

    By mass the number density goes as r^-dim (each interval of radius has the same mass), which for disks is the usual
    dense mix without gaps: small grains fill the holes between large ones.
    Returns (n,) [m]. Raises ValueError for sizes that are not finite, not positive or out of order.
    """
    n, dim, rng = checks.count("n", n), checks.dimension(dim), checks.generator(rng)
    low, high = checks.interval("smallest", smallest, "largest", largest)
    share = shares(n, rng, stratified)
    if mode(by) == "number":
        return low + (high - low) * share
    return inverse_power(share, low, high, dim)


def normal(n, mean, deviation, *, rng, smallest=None, largest=None) -> np.ndarray:
    """Normally distributed radii (by number), truncated to [smallest, largest] [m].

    By default the truncation is at mean -+ 2.5 deviations, and below never less than mean / 10, so that no radius comes
    near zero. `mean` and `deviation` are those of the law before truncation.
    Returns (n,) [m]. Raises ValueError when the interval holds less than a thousandth of the law.
    """
    n, rng = checks.count("n", n), checks.generator(rng)
    mean, deviation = checks.positive("mean", mean), checks.positive("deviation", deviation)
    low = max(mean - 2.5 * deviation, mean / 10.0) if smallest is None else smallest
    high = mean + 2.5 * deviation if largest is None else largest
    low, high = checks.interval("smallest", low, "largest", high)
    z = truncated_standard(n, (low - mean) / deviation, (high - mean) / deviation, rng)
    return np.clip(mean + deviation * z, low, high)


def lognormal(n, median, sigma, *, rng, smallest=None, largest=None, by="number", dim=2) -> np.ndarray:
    """Log-normal radii: log(r / median) is normal with standard deviation `sigma` [-], truncated to [smallest, largest].

    By default the truncation is at median exp(-+2.5 sigma). With `by="mass"` the median is that by mass; by number it is
    then median exp(-dim sigma^2) (Hatch & Choate 1929), with the same truncation.
    Returns (n,) [m]. Raises ValueError when the interval holds less than a thousandth of the law.
    """
    n, dim, rng = checks.count("n", n), checks.dimension(dim), checks.generator(rng)
    median, sigma = checks.positive("median", median), checks.positive("sigma", sigma)
    low = median * math.exp(-2.5 * sigma) if smallest is None else smallest
    high = median * math.exp(2.5 * sigma) if largest is None else largest
    low, high = checks.interval("smallest", low, "largest", high)
    shift = dim * sigma if mode(by) == "mass" else 0.0  # of the number law from the mass law, in standard deviations
    z = truncated_standard(n, math.log(low / median) / sigma + shift, math.log(high / median) / sigma + shift, rng)
    return np.clip(median * np.exp(sigma * (z - shift)), low, high)


def from_curve(n, curve, *, rng, dim=2, scale="linear", stratified=False) -> np.ndarray:
    """Radii that follow a grading curve: fraction of the mass that passes a sieve of given diameter.

    curve: path of a CSV file with the columns diameter [m], fraction passing [-] (a header line is allowed), or an array
        (m, 2) of the same. Diameters grow; fractions grow from 0 (nothing is finer) to 1 (everything is finer).
    scale: "linear" or "log", how mass is spread between two points of the curve; a curve drawn straight on the usual
        logarithmic axis of diameters is "log".

    Returns (n,) [m]. Raises ValueError naming the row that is wrong.
    """
    n, dim, rng = checks.count("n", n), checks.dimension(dim), checks.generator(rng)
    if scale not in ("linear", "log"):
        raise ValueError(f'scale is {scale!r}: give "linear" or "log"')
    table = read_curve(curve) if isinstance(curve, (str, os.PathLike)) else curve
    diameter, passing = checked_curve(table)
    low, high = diameter[:-1] / 2.0, diameter[1:] / 2.0
    power = dim if scale == "linear" else dim + 1  # number density inside a piece goes as r^-power
    # grains in a piece: its mass times the mean of 1/r^dim over that mass; the unit is the largest radius
    unit = high[-1]
    grains = np.diff(passing) * mean_inverse_volume(low / unit, high / unit, dim, scale)
    edges = np.concatenate(([0.0], np.cumsum(grains)))
    edges /= edges[-1]
    share = shares(n, rng, stratified)
    piece = np.clip(np.searchsorted(edges, share, side="right") - 1, 0, len(low) - 1)
    width = edges[piece + 1] - edges[piece]
    within = np.clip((share - edges[piece]) / np.where(width > 0.0, width, 1.0), 0.0, 1.0)
    return inverse_power(within, low[piece], high[piece], power)


def read_curve(path) -> np.ndarray:
    """(m, 2) diameter [m] and fraction passing [-] from a CSV file; empty lines and lines from # on are skipped."""
    from ..base.errors import MissingFile, as_file_error

    rows = []
    try:
        file = open(path, newline="", encoding="utf-8-sig")  # noqa: SIM115
    except FileNotFoundError as error:
        raise MissingFile(path) from error
    except OSError as error:
        raise as_file_error(path, error) from error
    with file:
        for number, row in enumerate(csv.reader(file), start=1):
            if not row or not "".join(row).strip() or row[0].lstrip().startswith("#"):
                continue
            try:
                values = [float(cell) for cell in row[:2]]
            except ValueError:
                values = []
            if len(values) == 2:
                rows.append(values)
            elif rows or number > 1:  # only the first line may be a header
                raise ValueError(f"line {number} of {os.fspath(path)} is {','.join(row)!r}: give diameter, fraction passing")
    if not rows:
        raise ValueError(f"{os.fspath(path)} holds no row: give lines of diameter, fraction passing")
    return np.array(rows)


def checked_curve(table) -> tuple[np.ndarray, np.ndarray]:
    """Diameters and fractions of a grading curve, or ValueError."""
    table = checks.real_array("curve", table, (None, 2))
    if len(table) < 2:
        raise ValueError(f"curve has {len(table)} row: give at least two points")
    diameter, passing = table[:, 0], table[:, 1]
    checks.positive_array("curve diameter", diameter)
    if passing.max() > 1.0:
        row = int(np.argmax(passing > 1.0))
        raise ValueError(f"curve fraction passing[{row}] is {passing[row]}: give fractions of 1, not per cent")
    for name, values, flat_is_bad in (("diameter", diameter, True), ("fraction passing", passing, False)):
        step = np.diff(values)
        bad = np.flatnonzero(step <= 0.0 if flat_is_bad else step < 0.0)
        if len(bad):
            row = int(bad[0]) + 1
            raise ValueError(f"curve {name}[{row}] is {values[row]} after {values[row - 1]}: sort the rows so that it grows")
    for row, wanted, what in ((0, 0.0, "the smallest diameter"), (-1, 1.0, "the largest diameter")):
        if passing[row] != wanted:
            raise ValueError(
                f"curve fraction passing[{row % len(table)}] is {passing[row]}: add a row that ends the curve "
                f"with {what} and {wanted:g}"
            )
    return diameter, passing


def mean_inverse_volume(low, high, dim: int, scale: str) -> np.ndarray:
    """Mean of r^-dim over mass spread evenly in r, or in log r, between low and high."""
    if scale == "linear":
        # int r^-dim dr / (high - low), written without the difference of close numbers
        return 1.0 / (low * high) if dim == 2 else 0.5 * (low + high) / (low * high) ** 2
    factors = (low + high) / 2.0 if dim == 2 else (low * low + low * high + high * high) / 3.0
    return factors * (high - low) / np.log(high / low) / (low * high) ** dim


def inverse_power(share, low, high, power: int) -> np.ndarray:
    """Quantile of the number density r^-power, power 2, 3 or 4, between low and high."""
    ratio = low / high
    base = 1.0 - share * (1.0 - ratio ** (power - 1))
    root = base if power == 2 else np.sqrt(base) if power == 3 else np.cbrt(base)
    return np.clip(low / root, low, high)


def truncated_standard(n: int, low: float, high: float, rng: np.random.Generator) -> np.ndarray:
    """n standard normal numbers inside [low, high], by rejection."""
    if low == high:
        return np.full(n, low)
    share = 0.5 * (math.erfc(low / math.sqrt(2.0)) - math.erfc(high / math.sqrt(2.0)))
    if low < 0.0 < high:
        share = 1.0 - 0.5 * (math.erfc(-low / math.sqrt(2.0)) + math.erfc(high / math.sqrt(2.0)))
    if share < SMALLEST_ACCEPTANCE:
        raise ValueError(f"smallest and largest leave {share:.1e} of the distribution: move them to where its grains are")
    kept, missing = [np.empty(0)], n
    while missing > 0:
        z = rng.standard_normal(int(missing / share * 1.05) + 16)
        z = z[(z >= low) & (z <= high)][:missing]
        kept.append(z)
        missing -= len(z)
    return np.concatenate(kept)


def shares(n: int, rng: np.random.Generator, stratified: bool) -> np.ndarray:
    """n numbers in [0, 1): independent, or one in each nth part in random order."""
    if not stratified:
        return rng.random(n)
    return rng.permutation((np.arange(n) + rng.random(n)) / max(n, 1))


def mode(by: str) -> str:
    if by not in ("number", "mass"):
        raise ValueError(f'by is {by!r}: give "number" or "mass"')
    return by
