"""Kernels that entries of an inverse are made of, against dense algebra: the products by Z of E A^-1 E' = Z'Z with L Z = E'."""

import numpy as np
import pytest
from kernels import kernel

RNG = np.random.default_rng(5)
# Columns of a front, of which the first so many are zero in all right sides: fewer and more than go by at once.
FRONTS = [(1, 0), (5, 0), (5, 3), (8, 0), (8, 3), (16, 0), (16, 11), (21, 0), (21, 11), (21, 18), (41, 3), (41, 34)]


def some(*shape):
    return RNG.standard_normal(shape)


@pytest.mark.parametrize("columns,first", FRONTS)
def test_unit_right_sides_of_a_front(columns, first):
    """Rows fewer and more than go by at once, and right sides that begin behind the first column."""
    lanes, leading, rows = 7, 9, columns + 27
    lower = some(rows, columns)
    lower[range(columns), range(columns)] = 3 + RNG.random(columns)
    part = lower.copy()
    part[:columns][np.triu_indices(columns, 1)] = np.nan  # above the diagonal: not read
    right = some(rows, leading)
    right[:first, :lanes] = 0
    own = np.linalg.solve(np.tril(lower[:columns]), right[:columns, :lanes])
    y, whole = right.copy(), right.copy()
    solve = kernel("cairn_unit_front")
    solve(lanes, leading, rows, columns, first, np.ascontiguousarray(part.T), y)
    np.testing.assert_allclose(y[:columns, :lanes], own, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(y[columns:, :lanes], right[columns:, :lanes] - lower[columns:] @ own, rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(y[:, lanes:], right[:, lanes:])
    solve(lanes, leading, rows, columns, 0, np.ascontiguousarray(part.T), whole)  # zeros change no bit
    np.testing.assert_array_equal(y, whole)
    alone = right[:, 2:3].copy()
    solve(1, 1, rows, columns, 0, np.ascontiguousarray(part.T), alone)  # nor do neighbouring columns
    np.testing.assert_array_equal(alone[:, 0], y[:, 2])


def test_unit_right_sides_of_a_column():
    lanes, leading, below = 5, 6, 9
    pivot, lower, right = 2.5, some(below), some(below + 1, leading)
    y = right.copy()
    kernel("cairn_unit_column")(lanes, leading, below, pivot, lower, y)
    np.testing.assert_allclose(y[0, :lanes], right[0, :lanes] / np.sqrt(pivot), rtol=1e-14)
    np.testing.assert_allclose(y[1:, :lanes], right[1:, :lanes] - np.outer(lower, right[0, :lanes]), rtol=1e-13, atol=1e-14)
    np.testing.assert_array_equal(y[:, lanes:], right[:, lanes:])


@pytest.mark.parametrize("columns,first", FRONTS)
def test_products_of_unit_right_sides(columns, first):
    lanes, others, rows = 6, 35, 50
    a, b, out = some(columns, lanes + 2), some(columns, others + 1), some(rows, rows)
    a[:first] = 0
    place, of_others = RNG.permutation(rows)[:lanes].copy(), RNG.permutation(rows)[:others].copy()
    expected = out.copy()  # (column, row), as Fortran has it
    expected[np.ix_(of_others, place)] += b[:, :others].T @ a[:, :lanes]
    multiply, whole = kernel("cairn_unit_products"), out.copy()
    multiply(lanes, lanes + 2, a, others, others + 1, b, columns, first, place, of_others, rows, out)
    np.testing.assert_allclose(out, expected, rtol=1e-12, atol=1e-13)
    multiply(lanes, lanes + 2, a, others, others + 1, b, columns, 0, place, of_others, rows, whole)
    np.testing.assert_array_equal(out, whole)
