"""Kernels of finite elements against what any element owes: polynomials that it reproduces, integrals that are known."""

import math
from itertools import product

import numpy as np
import pytest
from kernels import kernel, rows

RNG = np.random.default_rng(21)
CUBE = [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)]
SQUARE = [corner[:2] for corner in CUBE[:4]]
# corners, then the corners in whose middle each further node stands, as meshio numbers them
EDGES = {3: [(0, 1), (1, 2), (2, 0)], 4: [(0, 1), (1, 2), (2, 3), (3, 0)]}
TETRAHEDRON = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
HEXAHEDRON = [*EDGES[4], (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
FACES = [(0, 3, 7, 4), (1, 2, 6, 5), (0, 1, 5, 4), (3, 2, 6, 7), (0, 1, 2, 3), (4, 5, 6, 7)]


def nodes_of(cell):
    """Places of the nodes in the parent element."""
    corners, middles = {
        "triangle": ([(0, 0), (1, 0), (0, 1)], EDGES[3]),
        "quad": (SQUARE, [*EDGES[4], range(4)]),
        "tetra": ([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], TETRAHEDRON),
        "hexahedron": (CUBE, [*HEXAHEDRON, *FACES, range(8)]),
    }[cell.rstrip("0123456789")]
    corners = np.array(corners, float)
    number = int(cell[len(cell.rstrip("0123456789")) :] or len(corners))
    return np.array([*corners, *(corners[list(of)].mean(axis=0) for of in middles)])[:number]


ELEMENTS = {name: (cell, *map(int, numbers)) for name, cell, *numbers in rows("elements/elements.def", "CAIRN_ELEMENT")}


def integral(simplex, powers):
    """Integral of a monomial over the parent element: the unit simplex, or [-1, 1]^dim."""
    if simplex:
        return math.prod(map(math.factorial, powers)) / math.factorial(sum(powers) + len(powers))
    return math.prod(2 / (p + 1) if p % 2 == 0 else 0 for p in powers)


def monomials(dim, order):
    return [powers for powers in product(range(order + 1), repeat=dim) if sum(powers) <= order]


def shape(name, dim, nodes, place):
    value, gradient = np.empty(nodes), np.empty((nodes, dim))
    kernel(f"cairn_element_{name}_shape", "cairn_element_shape")(np.ascontiguousarray(place), value, gradient)
    return value, gradient


@pytest.mark.parametrize("name", ELEMENTS)
def test_shape_functions(name):
    """One at their own node and nothing at the others; polynomials of their order, and their gradients, from values at nodes."""
    cell, dim, nodes, _, _, order = ELEMENTS[name]
    places = nodes_of(cell)
    assert places.shape == (nodes, dim)
    for k, place in enumerate(places):
        np.testing.assert_allclose(shape(name, dim, nodes, place)[0], np.eye(nodes)[k], rtol=0, atol=1e-14)
    power = np.array(monomials(dim, order))
    factor = RNG.standard_normal(len(power))
    at_nodes = np.prod(places[:, None, :] ** power, axis=2) @ factor
    for _ in range(5):
        place = RNG.uniform(0.05, 0.3, dim)
        value, gradient = shape(name, dim, nodes, place)
        np.testing.assert_allclose(value @ at_nodes, np.prod(place**power, axis=1) @ factor, rtol=1e-12, atol=1e-13)
        for k in range(dim):
            less = power.copy()
            less[:, k] = np.maximum(less[:, k] - 1, 0)
            slope = (power[:, k] * np.prod(place**less, axis=1)) @ factor
            np.testing.assert_allclose(gradient[:, k] @ at_nodes, slope, rtol=1e-12, atol=1e-12)
            ahead, behind = place.copy(), place.copy()
            ahead[k] += 1e-3
            behind[k] -= 1e-3
            slopes = (shape(name, dim, nodes, ahead)[0] - shape(name, dim, nodes, behind)[0]) / 2e-3
            np.testing.assert_allclose(gradient[:, k], slopes, rtol=0, atol=1e-5)


@pytest.mark.parametrize("name", ELEMENTS)
@pytest.mark.parametrize("rule", ["rule", "bulk_rule"])
def test_rules(name, rule):
    """Exact for the products of two shape functions, or of two of their gradients, where the cell has straight sides."""
    cell, dim, _, points, bulk_points, order = ELEMENTS[name]
    simplex = cell.startswith("t")
    count = points if rule == "rule" else bulk_points
    xi, weight = np.empty((count, dim)), np.empty(count)
    kernel(f"cairn_element_{name}_{rule}", "cairn_element_rule")(xi, weight)
    for powers in monomials(dim, 2 * order if rule == "rule" else 2 * order - 2):
        found = weight @ np.prod(xi ** np.array(powers), axis=1)
        np.testing.assert_allclose(found, integral(simplex, powers), rtol=1e-13, atol=1e-14, err_msg=str(powers))
    assert np.all(weight > 0)
