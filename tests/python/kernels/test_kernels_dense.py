"""Kernels that factorise, pivot and sweep over blocks of W, against numpy on the dense matrix or what their answers obey."""

import numpy as np
import pytest
from kernels import kernel

RNG = np.random.default_rng(31)
CLOSE = dict(rtol=1e-11, atol=1e-12)


@pytest.fixture(autouse=True)
def same_numbers_in_any_order():
    """Each test draws the same numbers whichever tests ran before it: states that slip have no solution for one draw in seven."""
    RNG.bit_generator.state = np.random.default_rng(31).bit_generator.state


def some(*shape):
    return RNG.standard_normal(shape)


def positive(*shape):
    return RNG.uniform(0.5, 2.0, shape)


def columns(matrices):
    """Small matrices one after the other, each by columns, as Fortran has them."""
    return np.ascontiguousarray(np.swapaxes(matrices, -1, -2))


def chain(dim, n=7):
    """W = H H' of contacts of which each shares a body with its neighbours: rows, columns, blocks, and the dense matrix."""
    h = np.zeros((n * dim, (n + 1) * (dim + 1)))
    for a in range(n):
        h[a * dim : (a + 1) * dim, a * (dim + 1) : (a + 2) * (dim + 1)] = some(dim, 2 * dim + 2)
    dense = h @ h.T
    near = [[b for b in (a - 1, a, a + 1) if 0 <= b < n] for a in range(n)]
    start = np.cumsum([0, *map(len, near)])
    column = np.concatenate(near).astype(np.int32)
    four = dense.reshape(n, dim, n, dim).transpose(0, 2, 1, 3)
    block = columns(np.array([four[a, b] for a in range(n) for b in near[a]]))
    return start, column, block, dense


def natural_map(mu, w, r, u):
    """r less the nearest impulse in the cone to r - (u + mu |u_T| n)/w: nothing where Signorini and Coulomb are obeyed."""
    slack = u.copy()
    slack[0] += mu * np.linalg.norm(u[1:])
    z = r - slack / w
    normal, along = z[0], np.linalg.norm(z[1:])
    if along <= mu * normal:
        return r - z
    if mu * along <= -normal:
        return r
    size = (normal + mu * along) / (1 + mu * mu)
    return r - np.concatenate([[size], mu * size * z[1:] / along])


# ---------------------------------------------------------------------- triangles


@pytest.mark.parametrize("lanes", [1, 8])
def test_triangles_of_a_band(lanes):
    n, half = 9, 3
    dense, band = np.zeros((n, n)), np.full((n, half + 1), 7.0)
    for j in range(n):
        for i in range(j, min(j + half + 1, n)):
            dense[i, j] = band[j, i - j] = some(1)[0] + 3 * (i == j)
    right = some(n, lanes)
    y = right.copy()
    kernel("cairn_band_triangles")(lanes, n, half, band, y)
    np.testing.assert_allclose(y, np.linalg.solve(dense @ dense.T, right), **CLOSE)


@pytest.mark.parametrize("lanes", [1, 8])
def test_triangles_by_columns(lanes):
    n = 8
    there = np.tril(RNG.random((n, n)) < 0.5, -1)
    lower, pivot = np.where(there, some(n, n), 0), positive(n) * np.where(RNG.random(n) < 0.3, -1, 1)
    first = np.concatenate([[0], np.cumsum(there.sum(axis=0))])
    row = np.concatenate([np.flatnonzero(there[:, j]) for j in range(n)]).astype(np.int32)
    value = np.concatenate([lower[there[:, j], j] for j in range(n)])
    dense = (lower + np.eye(n)) @ np.diag(pivot) @ (lower + np.eye(n)).T
    right = some(n, lanes)
    y = right.copy()
    kernel("cairn_column_triangles")(lanes, n, first[:-1].copy(), first[1:].copy(), row, value, pivot, y)
    np.testing.assert_allclose(y, np.linalg.solve(dense, right), rtol=1e-9, atol=1e-10)


@pytest.mark.parametrize("lanes", [1, 8])
def test_triangles_by_fronts(lanes):
    n, widths = 13, [2, 5, 1, 3, 2]
    start = np.cumsum([0, *widths]).astype(np.int32)
    dense, rows, values = np.zeros((n, n)), [], []
    for s, (low, high) in enumerate(zip(start[:-1], start[1:])):
        below = high + np.flatnonzero(RNG.random(n - high) < 0.6)
        rows.append(np.concatenate([np.arange(low, high), below]).astype(np.int32))
        for j in range(low, high):
            dense[rows[s][j - low :], j] = some(len(rows[s]) - j + low)
            dense[j, j] = 3 + RNG.random()
        part = dense[np.ix_(rows[s], range(low, high))].copy()
        part[: high - low][np.triu_indices(high - low, 1)] = np.nan  # above the diagonal: not read
        values.append(columns(part).ravel())
    sizes = [np.cumsum([0, *map(len, x)]).astype(np.int32) for x in (rows, values)]
    given = start, *sizes, np.concatenate(rows), np.concatenate(values)
    right, work = some(n, lanes), np.empty((n, lanes))
    y = right.copy()
    kernel("cairn_front_triangles")(lanes, 5, *given, y, work)
    np.testing.assert_allclose(y, np.linalg.solve(dense @ dense.T, right), rtol=1e-9, atol=1e-10)


def test_factors_by_fronts():
    """Blocks narrower and wider than eight columns, and more rows than go side by side; a pivot that is not positive is named."""
    widths = [2, 19, 1, 150, 8, 3]
    n, start = sum(widths), np.cumsum([0, *widths]).astype(np.int32)
    node = np.repeat(np.arange(6, dtype=np.int32), widths)
    below = [set((high + np.flatnonzero(RNG.random(n - high) < 0.6)).tolist()) for high in start[1:]]
    for s in range(6):  # what a block changes its next one changes too
        if below[s]:
            to = node[min(below[s])]
            below[to] |= {row for row in below[s] if row >= start[to + 1]}
    rows = [np.array([*range(start[s], start[s + 1]), *sorted(below[s])], np.int32) for s in range(6)]
    lower = np.zeros((n, n))
    for s in range(6):
        for j in range(start[s], start[s + 1]):
            lower[rows[s][rows[s] >= j], j] = some((rows[s] >= j).sum())
            lower[j, j] = 20 + RNG.random()
    matrix = lower @ lower.T
    value = np.concatenate([columns(np.tril(matrix)[np.ix_(rows[s], range(start[s], start[s + 1]))]).ravel() for s in range(6)])
    sizes = [np.cumsum([0, *map(len, rows)]).astype(np.int32)]
    sizes.append(np.cumsum([0, *(len(r) * w for r, w in zip(rows, widths))]).astype(np.int32))
    lists, place, work = np.empty((3, 6), np.int32), np.empty(n, np.int32), np.empty(max(map(len, rows)) * max(widths))

    def factors(value):
        failed = np.empty(1, np.int32)
        kernel("cairn_block_cholesky")(n, 6, start, *sizes, np.concatenate(rows), node, value, *lists, place, work, failed)
        return failed[0]

    found = value.copy()
    assert factors(found) == -1
    for s in range(6):
        block = found[sizes[1][s] : sizes[1][s + 1]].reshape(widths[s], len(rows[s])).T
        wanted = lower[np.ix_(rows[s], range(start[s], start[s + 1]))]
        np.testing.assert_allclose(np.tril(block), wanted, rtol=1e-9, atol=1e-10)
    bad = 40  # in the block of 150
    value[sizes[1][3] + (bad - start[3]) * (len(rows[3]) + 1)] = 0.0
    assert factors(value) == bad


# ---------------------------------------------------------------------- sweeps over blocks


@pytest.mark.parametrize("dim", [2, 3])
def test_each_contact_obeys_its_law_after_its_turn(dim):
    start, column, block, dense = chain(dim)
    n = len(start) - 1
    q, mu, r, order = some(n, dim), RNG.uniform(0, 0.8, n), np.zeros((n, dim)), RNG.permutation(n).astype(np.int32)
    beside_column = np.empty(len(column) - n, np.int32)
    beside, local = np.empty((len(column) - n, dim, 2 * dim - 2)), np.empty((n, 16))
    kernel("cairn_nlgs_prepare")(dim, n, start, column, block, beside_column, beside, local)
    assert np.array_equal(beside_column, column[column != np.repeat(np.arange(n), np.diff(start))])
    slip, change = np.zeros(n), np.zeros(n)
    given = dim, n, start, beside_column, beside, local, q, mu
    for turn in [*range(n), *range(n)]:
        a, before = order[turn], r.copy()
        kernel("cairn_nlgs_blocks")(*given, turn, turn + 1, order, 1.0, slip, r, change, 1)
        assert np.array_equal(np.delete(before, a, 0), np.delete(r, a, 0))
        u = (dense @ r.ravel()).reshape(n, dim)[a] + q[a]
        w, size = dense[a * dim, a * dim], 1 + np.abs(r[a]).max()
        assert np.abs(natural_map(mu[a], w, r[a], u)).max() < 1e-6 * size
        goes_on, same, gone = slip.copy(), r.copy(), np.zeros(n)  # from the slip that it found: to rounding
        kernel("cairn_nlgs_blocks")(*given, turn, turn + 1, order, 1.0, goes_on, same, gone, 1)
        u = (dense @ same.ravel()).reshape(n, dim)[a] + q[a]
        assert np.abs(natural_map(mu[a], w, same[a], u)).max() < 1e-12 * size
        assert change[a] == pytest.approx(w * np.sum((r[a] - before[a]) ** 2), rel=1e-12)
    alone, whole = r.copy(), np.zeros((n, dim))
    slip[:] = 0
    for _ in range(2):
        kernel("cairn_nlgs_blocks")(*given, 0, n, order, 1.0, slip, whole, change, 1)
    assert np.array_equal(alone, whole)
    first, half, slip[:] = whole.copy(), whole.copy(), 0
    kernel("cairn_nlgs_blocks")(*given, 0, 1, order, 1.0, slip, first, change, 1)
    kernel("cairn_nlgs_blocks")(*given, 0, 1, order, 0.5, slip, half, change, 1)
    np.testing.assert_allclose(half, (first + whole) / 2, **CLOSE)  # cones are convex: the middle needs no projection


@pytest.mark.parametrize("dim", [2, 3])
def test_states_give_their_impulses(dim):
    """Impulses are zero at open contacts; velocities vanish at sticking contacts; at slipping contacts the normal velocity
    vanishes and friction opposes the sliding velocity."""
    _, _, _, dense = chain(dim, 4)
    n, mu, q = 4, np.array([0.3, 0.2, 0.1, 0.4]), some(4, dim) - [2, *[0] * (dim - 1)]
    state = np.array([0, 1, 2, 2 if dim == 3 else 3], np.int32)
    r, size = np.empty((n, dim)), n * dim
    work = np.empty((size, size)), np.empty(size), np.empty((n, dim - 1))
    kernel("cairn_enumeration_impulses")(dim, n, columns(dense), q, mu, state, 500, *work, r)
    u = (dense @ r.ravel()).reshape(n, dim) + q
    assert not r[0].any()
    np.testing.assert_allclose(u[1], 0, atol=1e-12)
    np.testing.assert_allclose(u[2:, 0], 0, atol=1e-12)
    if dim == 2:
        np.testing.assert_allclose(r[2:, 1], [mu[2] * r[2, 0], -mu[3] * r[3, 0]], **CLOSE)
    else:
        for a in (2, 3):
            np.testing.assert_allclose(r[a, 1:], -mu[a] * r[a, 0] * u[a, 1:] / np.linalg.norm(u[a, 1:]), rtol=1e-9, atol=1e-10)


@pytest.mark.parametrize("dim, facets", [(2, 2), (3, 6)])
def test_lemke(dim, facets):
    """w = q + M z of the formulas at the head of its file, w and z positive and one of each pair nothing."""
    start, column, block, dense = chain(dim, 3)
    n, mu, angle, size = 3, np.array([0.3, 0.0, 0.7]), RNG.uniform(0, 1, 3), 2 + facets
    q, m = some(3, dim) - [1, *[0] * (dim - 1)], 3 * size
    tableau = np.empty((m + 2, m))
    kernel("cairn_lemke_tableau")(dim, n, facets, start, column, block, q, mu, angle, m, tableau)
    if dim == 2:
        d = np.tile([[1.0], [-1.0]], (n, 1, 1))
    else:
        turn = angle[:, None] + 2 * np.pi * np.arange(facets) / facets
        d = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    onto, slide = np.zeros((n * dim, m)), np.zeros((m, m))  # r = onto z
    for a in range(n):
        i = a * size
        onto[a * dim, i] = 1
        onto[a * dim + 1 : (a + 1) * dim, i + 1 : i + 1 + facets] = d[a].T
        slide[i + 1 : i + 1 + facets, i + size - 1] = 1
        slide[i + size - 1, i : i + size - 1] = [mu[a], *[-1] * facets]
    big, right = onto.T @ dense @ onto + slide, onto.T @ q.ravel()
    np.testing.assert_allclose(tableau[:m].T, -big, **CLOSE)
    np.testing.assert_allclose(tableau[m:], [-np.ones(m), right], **CLOSE)
    basis, other, pivots = np.empty(m, np.int64), np.empty(m + 1, np.int64), np.empty(1, np.int64)
    given = tableau.copy()
    assert kernel("cairn_lemke_pivots")(m, 1, given, basis, other, pivots) == 2 and pivots[0] == 1
    assert kernel("cairn_lemke_pivots")(m, 1000, tableau, basis, other, pivots) == 0 and pivots[0] > 1
    assert sorted([*basis, *other]) == list(range(1, 2 * m + 2))
    z = np.zeros(m)
    inside = (basis > m) & (basis <= 2 * m)
    z[basis[inside] - m - 1] = tableau[m + 1, inside]
    w = right + big @ z
    assert z.min() > -1e-12 and w.min() > -1e-12 and np.abs(w * z).max() < 1e-12
    r = np.empty((n, dim))
    kernel("cairn_lemke_impulses")(dim, n, facets, angle, m, tableau, basis, r)
    np.testing.assert_allclose(r.ravel(), onto @ z, **CLOSE)
    u = (dense @ r.ravel()).reshape(n, dim) + q
    if dim == 2:
        assert max(np.abs(natural_map(mu[a], dense[2 * a, 2 * a], r[a], u[a])).max() for a in range(n)) < 1e-12


def test_lemke_tells_a_ray():
    """w = -1 + 0 z has no solution."""
    tableau = np.array([[0.0], [-1.0], [-1.0]])
    basis, other, pivots = (np.empty(size, np.int64) for size in (1, 2, 1))
    assert kernel("cairn_lemke_pivots")(1, 10, tableau, basis, other, pivots) == 1


@pytest.mark.parametrize("dim", [2, 3])
def test_load_of_admm(dim):
    n, rho = 6, 0.7
    q, z, v, s, load = some(n, dim), some(n, dim), some(n, dim), some(n), np.empty((n, dim))
    kernel("cairn_admm_load")(dim, n, rho, q, z, v, s, load)
    np.testing.assert_allclose(load, rho * (z - v) - q - np.outer(s, np.eye(dim)[0]), **CLOSE)


# ---------------------------------------------------------------------- interior points


def inside(dim, mu, dual):
    """Points within the cones mu r_N > |r_T|, or y_N > mu |y_T|."""
    x = some(len(mu), dim)
    x[:, 0] = np.linalg.norm(x[:, 1:], axis=1) * (mu if dual else 1 / mu) * RNG.uniform(1.01, 3, len(mu))
    return x


@pytest.mark.parametrize("dim", [2, 3])
def test_length_to_the_boundary(dim):
    n = 5
    mu = RNG.uniform(0.2, 1, n)
    r, y = inside(dim, mu, False), inside(dim, mu, True)
    for size in (0.1, 1.0, 30.0):
        dr, dy, length = size * some(n, dim), size * some(n, dim), np.empty(2)
        kernel("cairn_interior_length")(dim, n, mu, r, dr, y, dy, length)
        for x, d, factor, found in ((r, dr, mu, length[0]), (y, dy, 1 / mu, length[1])):
            low, high = 0.0, 1.0
            for _ in range(60):
                t = 1.0 if low == 0 and high == 1 and _ == 0 else (low + high) / 2
                z = x + t * d
                within = np.all(factor * z[:, 0] >= np.linalg.norm(z[:, 1:], axis=1))
                low, high = (t, high) if within else (low, t)
            assert found == pytest.approx(low, rel=1e-9)


@pytest.mark.parametrize("dim", [2, 3])
def test_scaling_of_cones(dim):
    """The one symmetric map of the cone onto its dual that takes r to y (Nesterov & Todd 1997); the gradient of log(det)/2."""
    n = 5
    mu = RNG.uniform(0.2, 1, n)
    r, y = inside(dim, mu, False), inside(dim, mu, True)
    theta, inverse = np.empty((n, dim, dim)), np.empty((n, dim))
    kernel("cairn_interior_scaling")(dim, n, mu, r, y, theta, inverse)
    np.testing.assert_allclose(theta, columns(theta), **CLOSE)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", theta, r), y, rtol=1e-9, atol=1e-10)
    for a in range(n):
        for _ in range(4):
            e = some(dim - 1)
            image = theta[a] @ np.concatenate([[1.0], mu[a] * e / np.linalg.norm(e)])
            assert image[0] == pytest.approx(mu[a] * np.linalg.norm(image[1:]), rel=1e-9)

        def barrier(x, m=mu[a]):
            return np.log((m * x[0]) ** 2 - x[1:] @ x[1:]) / 2

        small = 1e-6 * (mu[a] * r[a, 0] - np.linalg.norm(r[a, 1:]))
        slope = [(barrier(r[a] + small * e) - barrier(r[a] - small * e)) / (2 * small) for e in np.eye(dim)]
        np.testing.assert_allclose(inverse[a], slope, rtol=1e-6, atol=1e-6 * np.abs(slope).max())


# ---------------------------------------------------------------------- Newton's method


def linearised(dim, n):
    """Contacts, the second without unknowns and another with a single one: unknowns, and left, basis, own as matrices."""
    unknowns = np.full(n, dim, np.int32)
    unknowns[1] = 0
    left, basis, own = some(n, dim, dim), some(n, dim, dim), some(n, dim, dim) + 4 * np.eye(dim)
    unknowns[2] = 1
    left[2, 1:], basis[2, :, 1:], own[2] = 0, 0, np.eye(dim)
    left[1], basis[1] = 0, 0
    return unknowns, left, basis, own


def diagonal(blocks):
    n, dim, _ = blocks.shape
    out = np.zeros((n, dim, n, dim))
    out[range(n), :, range(n)] = blocks
    return out.reshape(n * dim, n * dim)


@pytest.mark.parametrize("dim", [2, 3])
def test_newton_on_the_pattern_of_w(dim):
    start, column, block, dense = chain(dim)
    n, alpha = len(start) - 1, 0.3
    unknowns, left, basis, own = linearised(dim, n)
    matrix = np.full_like(block, 9.0)
    kernel("cairn_newton_blocks")(
        dim, n, start, column, block, alpha, unknowns, columns(left), columns(basis), columns(own), matrix
    )
    whole = diagonal(left) @ (dense + alpha * np.eye(n * dim)) @ diagonal(basis) + diagonal(own)
    whole = whole.reshape(n, dim, n, dim)
    for a in range(n):
        for k in range(start[a], start[a + 1]):
            expected = whole[a, :, column[k]] if unknowns[a] and unknowns[column[k]] else np.full((dim, dim), 9.0)
            np.testing.assert_allclose(matrix[k].T, expected, **CLOSE)
    step, change, target, rhs = some(n, dim), some(n, dim), some(n, dim), np.full((n, dim), 9.0)
    kernel("cairn_newton_targets")(dim, n, alpha, unknowns, columns(left), step, change, target, rhs)
    expected = target - np.einsum("nij,nj->ni", left, change + alpha * step)
    np.testing.assert_allclose(rhs, np.where(unknowns[:, None] > 0, expected, 9.0), **CLOSE)
    y, moved = some(n, dim), step.copy()
    kernel("cairn_newton_step")(dim, n, unknowns, columns(basis), y, moved)
    np.testing.assert_allclose(moved, step + np.einsum("nij,nj->ni", basis, y), **CLOSE)


@pytest.mark.parametrize("dim", [2, 3])
def test_newton_on_the_pattern_of_bodies(dim):
    """Whatever the velocities change by, the answer obeys the linearised law; the blocks are those of A + H answer H'."""
    n, nb, dofs, alpha = 6, 4, 3 * dim - 3, 0.2
    unknowns, left, basis, own = linearised(dim, n)
    step, target, change = some(n, dim), some(n, dim), some(n, dim)
    target[2, 1:] = 0
    answer, known, moved = np.empty((n, dim, dim)), np.empty((n, dim)), np.empty((n, dim))
    kernel("cairn_newton_answers")(
        dim, n, alpha, unknowns, columns(left), columns(basis), columns(own), step, target, answer, known
    )
    kernel("cairn_newton_body_step")(dim, n, answer, known, change, moved)
    for a in range(n):
        y = np.linalg.lstsq(basis[a], moved[a] - step[a], rcond=None)[0]
        np.testing.assert_allclose(basis[a] @ y, moved[a] - step[a], rtol=1e-8, atol=1e-9)
        if unknowns[a]:
            short = slice(unknowns[a])
            law = left[a] @ (change[a] + alpha * moved[a]) + own[a] @ y - target[a]
            np.testing.assert_allclose(law[short], 0, atol=1e-8)
    body = np.array([[0, 1], [1, 0], [1, 2], [2, 3], [-1, 3], [3, 2]], np.int32)
    sides, mass = some(n, 2, dofs, dim), some(nb, dofs, dofs)
    pairs = {(0, 0): 0, (1, 1): 1, (2, 2): 2, (3, 3): 3, (0, 1): 4, (1, 0): 5, (1, 2): 6, (2, 1): 7, (2, 3): 8, (3, 2): 9}
    place = np.array([[pairs.get((a, b), -1), pairs.get((b, a), -1)] for a, b in body])
    matrix, h = np.empty((len(pairs), dofs, dofs)), np.zeros((n, dim, nb, dofs))
    for a in range(n):
        for s in range(2):
            if body[a, s] >= 0:
                h[a, :, body[a, s]] += sides[a, s].T
    h = h.reshape(n * dim, nb * dofs)
    kernel("cairn_newton_body_blocks")(
        dim, dofs, n, nb, body, sides, answer, columns(mass), np.arange(4), place, len(pairs), matrix
    )
    whole = (diagonal(mass) + h.T @ diagonal(columns(answer)) @ h).reshape(nb, dofs, nb, dofs)
    for (a, b), e in pairs.items():
        np.testing.assert_allclose(matrix[e].T, whole[a, :, b], rtol=1e-9, atol=1e-9)
    kernel("cairn_newton_add_body_blocks")(
        dim, dofs, n, nb, body, sides, -answer, np.arange(4), place, len(pairs), matrix
    )
    np.testing.assert_allclose(matrix[:4], columns(mass), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(matrix[4:], 0, atol=1e-9)
    rows = {(0, 0): 0, (1, 0): 1, (1, 1): 2, (2, 1): 3, (2, 2): 4, (3, 2): 5, (3, 3): 6}  # on and below the diagonal
    on_diagonal = np.array([rows[b, b] for b in range(nb)])
    below, even = np.zeros((7, dofs, dofs)), mass + mass.transpose(0, 2, 1)
    below[on_diagonal] = even
    where = np.array([[rows.get((b, a), -1), rows.get((a, b), -1)] for a, b in body])
    balanced = answer + answer.transpose(0, 2, 1)
    kernel("cairn_newton_add_body_blocks")(dim, dofs, n, nb, body, sides, balanced, on_diagonal, where, 7, below)
    x, y = some(nb, dofs), np.empty((nb, dofs))
    of_column = np.array([0, 0, 1, 1, 2, 2, 3], np.int32)
    kernel("cairn_half_product")(dofs, nb, np.array([0, 1, 3, 5, 7]), of_column, below, x, y)
    product = (diagonal(even) + h.T @ diagonal(balanced) @ h) @ x.ravel()
    np.testing.assert_allclose(y.ravel(), product, rtol=1e-9, atol=1e-8)
    inverse, wanted = some(nb, dofs, dofs), [(a, b) for a in range(n) for b in range(n)]
    block = np.empty((n * n, dim, dim))
    columns_of = np.array([b for _, b in wanted], np.int32)
    kernel("cairn_body_blocks")(dim, dofs, n, nb, body, sides, columns(inverse), n * np.arange(n + 1), columns_of, block)
    w = (h @ diagonal(inverse) @ h.T).reshape(n, dim, n, dim)
    np.testing.assert_allclose(block.reshape(n, n, dim, dim).transpose(0, 3, 1, 2), w, rtol=1e-9, atol=1e-10)
