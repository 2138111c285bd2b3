"""Kernels against twins in numpy, which say the same in the plainest words: one for each, on small random data."""

import numpy as np
import pytest
from kernels import Context, kernel

RNG = np.random.default_rng(20)
CLOSE = dict(rtol=1e-12, atol=1e-14)


def some(*shape):
    return RNG.standard_normal(shape)


def positive(*shape):
    return RNG.uniform(0.5, 2.0, shape)


def quaternions(n):
    q = some(n, 4)
    return q / np.linalg.norm(q, axis=1)[:, None]


def matrices(q):
    """Body to space, (n, 3, 3), by q v q*."""
    w, v = q[:, 0], q[:, 1:]
    cross = np.zeros((len(q), 3, 3))
    for k in range(3):
        cross[:, :, k] = np.cross(v, np.eye(3)[k])
    return np.eye(3) + 2 * w[:, None, None] * cross + 2 * cross @ cross


def full(six):
    """(n, 3, 3) of xx yy zz xy xz yz."""
    out = np.empty((len(six), 3, 3))
    for k, (i, j) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))):
        out[:, i, j] = out[:, j, i] = six[:, k]
    return out


# ---------------------------------------------------------------------- integrators


@pytest.mark.parametrize("dim", [2, 3])
def test_theta_free_velocity(dim):
    n, nd, h, theta = 7, 3 * dim - 3, 0.01, 0.7
    g, mass, inertia, v = some(dim), positive(n), positive(n, 2 * dim - 3), some(n, nd)
    mass[2] = inertia[2] = np.inf
    force, damping, drive = some(n, nd), positive(n), some(n, nd)
    driven = np.array([0, 1, 0, 2, 5, 0, 2**nd - 1], np.int8)
    free, inverse = np.empty((n, nd)), np.empty((n, nd))
    kernel("cairn_theta_free_velocity")(dim, nd, n, h, theta, g, mass, inertia, v, free, inverse, force, damping, driven, drive)
    m = np.concatenate([np.repeat(mass[:, None], dim, 1), np.repeat(inertia[:, :1], nd - dim, 1)], axis=1)
    push = np.concatenate([g, np.zeros(nd - dim)]) + force / m
    later = 1 + h * theta * damping[:, None]
    expected = ((1 - h * (1 - theta) * damping[:, None]) * v + h * push) / later
    expected[2] = v[2]
    held = (driven[:, None].astype(int) >> np.arange(nd)) & 1 == 1
    np.testing.assert_allclose(free, np.where(held, drive, expected), **CLOSE)
    np.testing.assert_allclose(inverse, np.where(held, 0, 1 / (m * later)), **CLOSE)


@pytest.mark.parametrize("dim", [2, 3])
def test_inverse_masses(dim):
    n, nd = 5, 3 * dim - 3
    mass, inertia, out = positive(n), positive(n, 2 * dim - 3), np.empty((5, nd))
    mass[1] = np.inf
    kernel("cairn_inverse_masses")(dim, nd, n, mass, inertia, out)
    np.testing.assert_allclose(out, 1 / np.concatenate([np.repeat(mass[:, None], dim, 1), inertia], axis=1), **CLOSE)


def test_inverse_inertia():
    n = 6
    inertia, q, out = positive(n, 3), quaternions(n), np.empty((n, 6))
    inertia[3] = 2.0  # of a sphere: as it stands
    inverse = np.repeat(0.5, n * 6).reshape(n, 6)
    driven = np.array([0, 0, 0, 0, 8 + 16, 32], np.int8)
    kernel("cairn_inverse_inertia")(n, inertia, q, inverse, out, driven)
    r = matrices(q)
    j = r @ (inertia[:, :, None] * r.transpose(0, 2, 1))
    expected = np.linalg.inv(j)
    expected[4] = np.diag([0, 0, 1 / j[4, 2, 2]])
    expected[5] = 0
    expected[5, :2, :2] = np.linalg.inv(j[5, :2, :2])
    np.testing.assert_allclose(full(out), expected, **CLOSE)


def test_momentum_and_spin():
    n = 4
    inertia, q, v, begin, momentum = positive(n, 3), quaternions(n), some(n, 6), some(n, 6), some(n, 3)
    r = matrices(q)
    j = r @ (inertia[:, :, None] * r.transpose(0, 2, 1))
    update = kernel("cairn_momentum_update")
    spin, changed, whole = v.copy(), momentum.copy(), momentum.copy()
    update(n, 0, inertia, q, begin, spin, momentum, None)
    np.testing.assert_allclose(spin[:, 3:], np.linalg.solve(j, momentum[:, :, None])[:, :, 0], rtol=1e-11)
    update(n, 1, inertia, q, begin, v, changed, None)
    np.testing.assert_allclose(changed, momentum + np.einsum("nij,nj->ni", j, (v - begin)[:, 3:]), **CLOSE)
    update(n, 2, inertia, q, begin, v, whole, None)
    np.testing.assert_allclose(whole, np.einsum("nij,nj->ni", j, v[:, 3:]), **CLOSE)


def test_free_spin():
    n, h, theta = 4, 0.02, 0.6
    inertia, momentum, v, free, force, damping = positive(n, 3), some(n, 3), some(n, 6), some(n, 6), some(n, 6), positive(n)
    six = np.concatenate([positive(n, 3), 0.1 * some(n, 3)], axis=1)
    given = six.copy()
    kernel("cairn_free_spin")(n, h, theta, inertia, momentum, six, v, free, force, damping, None)
    a, later = full(given), 1 + h * theta * damping
    spin = np.einsum("nij,nj->ni", a, momentum)
    expected = (1 - h * (1 - theta) * damping)[:, None] * spin + h * np.einsum("nij,nj->ni", a, force[:, 3:])
    np.testing.assert_allclose(v[:, 3:], spin, **CLOSE)
    np.testing.assert_allclose(free[:, 3:], expected / later[:, None], **CLOSE)
    np.testing.assert_allclose(six, given / later[:, None], **CLOSE)


@pytest.mark.parametrize("dim", [2, 3])
def test_verlet(dim):
    n, nd, h = 5, 3 * dim - 3, 0.01
    g, inverse, contact, force, damping = some(dim), positive(n, nd), some(n, nd), some(n, nd), positive(n)
    inverse[2] = 0
    v, x, fastest, angle = some(n, nd), some(n, dim), np.empty(2), some(n)
    v0, x0, angle0 = v.copy(), x.copy(), angle.copy()
    turns = angle if dim == 2 else None
    kernel("cairn_verlet_begin")(dim, nd, 0, n, h, g, inverse, contact, v, x, fastest, turns, force, damping, None, None, None)
    weight = np.where(inverse[:, :1] > 0, np.concatenate([g, np.zeros(nd - dim)]), 0)
    moved = inverse > 0
    middle = v0 + h / 2 * (inverse * (contact + force) + weight - np.where(moved, damping[:, None] * v0, 0))
    np.testing.assert_allclose(v, middle, **CLOSE)
    np.testing.assert_allclose(x, x0 + h * middle[:, :dim], **CLOSE)
    np.testing.assert_allclose(fastest, [(middle[:, :dim] ** 2).sum(1).max(), (middle[:, dim:] ** 2).sum(1).max()], **CLOSE)
    if dim == 2:
        np.testing.assert_allclose(angle, angle0 + h * middle[:, 2], **CLOSE)
    wrong, terms = np.array([-1]), np.zeros(5)
    kernel("cairn_verlet_end")(dim, nd, 0, n, h, g, inverse, contact, v, wrong, force, damping, None, None, None, terms)
    end = middle + h / 2 * (inverse * (contact + force) + weight)
    end = np.where(moved, end / (1 + h / 2 * damping[:, None]), end)
    np.testing.assert_allclose(v, end, **CLOSE)
    mass = np.where(moved, 1 / np.where(moved, inverse, 1), 0)
    drag = np.sum(mass * damping[:, None] * h * middle**2)
    expected = [np.sum(mass * end**2) / 2, -np.sum(mass * weight * h * middle), np.sum(force * h * middle * moved), 0, drag]
    np.testing.assert_allclose(terms, expected, **CLOSE)
    assert wrong[0] == -1
    kinetic = kernel("cairn_verlet_kinetic")(nd, 1, n, inverse, v)
    np.testing.assert_allclose(kinetic, np.sum((mass * v**2)[1:]) / 2, **CLOSE)


@pytest.mark.parametrize("dim", [2, 3])
def test_speed_of_bodies_is_bounded_by_the_largest_of_each_component(dim):
    nd = 3 * dim - 3
    for first, last in ((0, 1), (2, 2), (1, 40), (3, 35)):
        v = np.random.default_rng(last).normal(size=(40, nd))
        most = np.abs(v[first:last, :dim]).max(axis=0, initial=0.0)
        found = kernel("cairn_verlet_speed")(dim, nd, first, last, v)
        assert abs(found - np.sqrt((most**2).sum())) <= 1e-15 * found


def test_verlet_turn():
    n, h = 6, 0.3
    v, q = some(n, 6), quaternions(n)
    v[1, 3:] *= 20  # beyond the series
    v[2, 3:] = 0
    before = matrices(q)
    kernel("cairn_verlet_turn")(0, n, h, v, q)
    angle = np.linalg.norm(v[:, 3:], axis=1)
    axis = v[:, 3:] / np.maximum(angle, 1e-300)[:, None]
    turn = matrices(np.concatenate([np.cos(h * angle / 2)[:, None], np.sin(h * angle / 2)[:, None] * axis], axis=1))
    np.testing.assert_allclose(matrices(q), turn @ before, rtol=0, atol=1e-13)


# ---------------------------------------------------------------------- problems


def problem(dim, n=9):
    """Blocks by rows, diagonal blocks definite, and the dense matrix."""
    there = np.eye(n, dtype=bool) | (RNG.random((n, n)) < 0.3)
    there |= there.T
    start = np.concatenate([[0], np.cumsum(there.sum(1))])
    column = np.nonzero(there)[1].astype(np.int32)
    block = some(len(column), dim, dim)  # transposed, as Fortran has them
    dense = np.zeros((n, dim, n, dim))
    for a in range(n):
        for k in range(start[a], start[a + 1]):
            dense[a, :, column[k], :] = block[k].T
    return start, column, block, dense.reshape(n * dim, n * dim)


@pytest.mark.parametrize("dim", [2, 3])
def test_block_product_and_diagonal(dim):
    start, column, block, dense = problem(dim)
    n = len(start) - 1
    q, r, u = some(n, dim), some(n, dim), np.empty((n, dim))
    for threads in (1, 2):
        kernel("cairn_block_product")(dim, n, start, column, block, q, r, u, threads)
        np.testing.assert_allclose(u.ravel(), dense @ r.ravel() + q.ravel(), rtol=1e-12, atol=1e-13)
    place, w_nn = np.empty(n, np.int64), np.empty(n)
    kernel("cairn_block_diagonal")(dim, n, start, column, block, place, w_nn)
    assert np.array_equal(column[place], np.arange(n)) and np.array_equal(w_nn, np.diag(dense)[::dim])


def nearest_in_cone(mu, r):
    """By cases: inside, in the polar cone, on the mantle."""
    normal, along = r[0], np.linalg.norm(r[1:])
    if along <= mu * normal:
        return r
    if mu * along <= -normal:
        return np.zeros_like(r)
    size = (normal + mu * along) / (1 + mu * mu)
    return np.concatenate([[size], mu * size * r[1:] / along])


@pytest.mark.parametrize("dim", [2, 3])
def test_projections(dim):
    n = 40
    mu, r = RNG.uniform(0, 1, n), some(n, dim)
    mu[0] = 0
    cones, disks = r.copy(), r.copy()
    kernel("cairn_project_cones")(dim, n, mu, cones)
    np.testing.assert_allclose(cones, [nearest_in_cone(*pair) for pair in zip(mu, r)], **CLOSE)
    kernel("cairn_project_disks")(dim, n, mu, disks)
    normal, along = np.maximum(r[:, 0], 0), np.linalg.norm(r[:, 1:], axis=1)
    share = np.minimum(1, mu * normal / along)
    np.testing.assert_allclose(disks, np.concatenate([normal[:, None], share[:, None] * r[:, 1:]], axis=1), **CLOSE)


@pytest.mark.parametrize("dim", [2, 3])
def test_derivatives_of_projections(dim):
    n, step = 60, 1e-7
    mu, weight, r = RNG.uniform(0, 3, n), positive(n), some(n, dim)
    mu[:2] = 0, 1e4
    found = np.empty((n, dim, dim))
    kernel("cairn_cone_derivatives")(dim, n, mu, weight, r, found)
    for k, by in enumerate(step * np.eye(dim)):
        ends = [[nearest_in_cone(m, each) for m, each in zip(mu, r + sign * by)] for sign in (1, -1)]
        slope = weight[:, None] * (np.array(ends[0]) - ends[1]) / (2 * step)
        np.testing.assert_allclose(found[:, k], slope, atol=1e-6 * weight.max())


@pytest.mark.parametrize("dim", [2, 3])
def test_problem_error(dim):
    n = 20
    mu, w, r, u = RNG.uniform(0, 1, n), positive(n), some(n, dim), some(n, dim)
    error, size = np.empty(1), np.empty(1)
    kernel("cairn_problem_error")(dim, n, mu, w, r, u, error, size)
    slack = u.copy()
    slack[:, 0] += mu * np.linalg.norm(u[:, 1:], axis=1)
    f = [a - nearest_in_cone(m, a - b / k) for m, k, a, b in zip(mu, w, r, slack)]
    np.testing.assert_allclose(error, np.sum(w * np.sum(np.square(f), axis=1)), rtol=1e-12)
    np.testing.assert_allclose(size, np.sum(w * np.sum(r * r, axis=1)), rtol=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
def test_admm_update(dim):
    n, rho, relaxation = 12, 0.7, 1.4
    mu, r, z, v, s, sums = RNG.uniform(0, 1, n), some(n, dim), some(n, dim), some(n, dim), np.empty(n), np.empty(4)
    z0, v0 = z.copy(), v.copy()
    kernel("cairn_admm_update")(dim, n, rho, relaxation, mu, r, z, v, s, sums)
    w = relaxation * r + (1 - relaxation) * z0
    expected = np.array([nearest_in_cone(*pair) for pair in zip(mu, w + v0)])
    np.testing.assert_allclose(z, expected, **CLOSE)
    np.testing.assert_allclose(v, v0 + w - expected, **CLOSE)
    np.testing.assert_allclose(s, mu * rho * np.linalg.norm(v[:, 1:], axis=1), **CLOSE)
    np.testing.assert_allclose(sums, [np.sum((r - z) ** 2), np.sum((z - z0) ** 2), np.sum(z * z), np.sum(v * v)], **CLOSE)


def test_proximal_velocity():
    r, centre, u, out = some(9), some(9), some(9), np.empty(9)
    kernel("cairn_proximal_velocity")(9, 0.3, r, centre, u, out)
    np.testing.assert_allclose(out, u + 0.3 * (r - centre), **CLOSE)


@pytest.mark.parametrize("dim", [2, 3])
def test_bodies_of_problems(dim):
    n, nb, dofs = 8, 5, 3 * dim - 3
    body = RNG.integers(-1, nb, (n, 2)).astype(np.int32)
    rows, r, q = some(n, 2, dofs, dim), some(n, dim), some(n, dim)
    h = np.zeros((n, dim, nb, dofs))
    for a in range(n):
        for side in range(2):
            if body[a, side] >= 0:
                h[a, :, body[a, side]] += rows[a, side].T
    h = h.reshape(n * dim, nb * dofs)
    p, v, u = np.empty((nb, dofs)), some(nb, dofs), np.empty((n, dim))
    kernel("cairn_body_impulses")(dim, dofs, n, nb, body, rows, r, p)
    np.testing.assert_allclose(p.ravel(), h.T @ r.ravel(), rtol=1e-12, atol=1e-13)
    kernel("cairn_body_velocities")(dim, dofs, n, nb, body, rows, v, q, u)
    np.testing.assert_allclose(u.ravel(), h @ v.ravel() + q.ravel(), rtol=1e-12, atol=1e-13)
    inverse = some(nb, dofs, dofs)
    inverse += inverse.transpose(0, 2, 1)
    kernel("cairn_body_product")(dim, dofs, n, nb, body, rows, inverse, r, q, v, u)
    made = np.einsum("bij,bj->bi", inverse, (h.T @ r.ravel()).reshape(nb, dofs))
    np.testing.assert_allclose(u.ravel(), h @ made.ravel() + q.ravel(), rtol=1e-11, atol=1e-12)


def test_colours_and_shuffles():
    start, column, _, _ = problem(2, 30)
    n = 30
    colour, order, colours, first = np.empty(n, np.int32), np.empty(n, np.int32), np.empty(1, np.int64), np.empty(n + 1, np.int64)
    kernel("cairn_colour_blocks")(n, start, column, colour, order, colours, first)
    rows = np.repeat(np.arange(n), np.diff(start))
    assert not np.any((colour[rows] == colour[column]) & (rows != column))
    assert sorted(order) == list(range(n)) and colours[0] == colour.max() + 1
    for c in range(colours[0]):
        mine = order[first[c] : first[c + 1]]
        assert np.all(colour[mine] == c) and np.all(np.diff(mine) > 0)
    state, dealt = np.array([12345]), np.arange(n, dtype=np.int32)
    kernel("cairn_shuffle")(n, state, dealt)
    expected, x = list(range(n)), 12345
    for i in range(n, 1, -1):
        x = 48271 * x % (2**31 - 1)
        j = x % i
        expected[i - 1], expected[j] = expected[j], expected[i - 1]
    assert list(dealt) == expected and state[0] == x


# ---------------------------------------------------------------------- detection


@pytest.mark.parametrize("largest", [1, 300, 2**20, 2**62])
def test_sort_keys(largest):
    n = 500
    key = RNG.integers(0, largest, n, endpoint=True)
    given, order = key.copy(), np.empty(n, np.int32)
    kernel("cairn_sort_keys")(n, largest, key, order, np.empty(n, np.int64), np.empty(n, np.int32))
    assert np.array_equal(order, np.argsort(given, kind="stable")) and np.array_equal(key, np.sort(given))


@pytest.mark.parametrize("dim", [2, 3])
def test_hilbert_keys(dim):
    """Keys of a lattice: each site once, and neighbours on the curve are neighbours in space."""
    side = 2 ** (4 if dim == 2 else 3)
    places = np.stack(np.meshgrid(*[np.arange(side)] * dim, indexing="ij"), -1).reshape(-1, dim)
    key = np.empty(len(places), np.int64)
    points = np.ascontiguousarray((places + 0.5) / side)
    kernel("cairn_hilbert_keys")(dim, len(places), points, np.zeros(dim), np.ones(dim), key)
    assert len(np.unique(key)) == len(key)
    way = places[np.argsort(key)]
    assert np.all(np.abs(np.diff(way, axis=0)).sum(axis=1) == 1)
    outside = np.ascontiguousarray([np.full(dim, -3.0), np.full(dim, 0.0)])
    two = np.empty(2, np.int64)
    kernel("cairn_hilbert_keys")(dim, 2, outside, np.zeros(dim), np.ones(dim), two)
    assert two[0] == two[1]


def test_grid_cells():
    key = np.sort(RNG.integers(0, 12, 40))
    cell, start, cells = np.zeros(41, np.int64), np.zeros(41, np.int32), np.zeros(1, np.int64)
    kernel("cairn_grid_cells")(40, key, cell, start, cells)
    known, first = np.unique(key, return_index=True)
    assert cells[0] == len(known) and np.array_equal(cell[: len(known)], known)
    assert np.array_equal(start[: len(known) + 1], [*first, 40]) and cell[len(known)] == 2**63 - 1


def test_pairs_by_candidate():
    n, contactors = 60, 7
    kind, a, b, image = (RNG.integers(0, most, n).astype(np.int32) for most in (3, contactors, contactors, 4))
    slot_of_kind = np.array([2, 0, 1], np.int32)
    count = np.zeros(3 * contactors, np.int32)
    kernel("cairn_pair_count")(n, contactors, slot_of_kind, kind, a, count)
    slot = slot_of_kind[kind] * contactors + a
    assert np.array_equal(count, np.bincount(slot, minlength=3 * contactors))
    kernel("cairn_pair_starts")(3 * contactors, count)
    assert np.array_equal(count, np.concatenate([[0], np.cumsum(np.bincount(slot, minlength=3 * contactors))[:-1]]))
    out = [np.empty(n, np.int32) for _ in range(3)]
    kernel("cairn_pair_scatter")(n, contactors, slot_of_kind, kind, a, b, image, count, *out)
    order = np.argsort(slot, kind="stable")
    assert all(np.array_equal(got, given[order]) for got, given in zip(out, (a, b, image)))


def test_pair_movable():
    inverse, movable = positive(5, 6), np.full(5, 7, np.int8)
    inverse[1] = 0
    inverse[2, 0] = 0  # something else moves it
    kernel("cairn_pair_movable")(6, 1, 4, inverse, movable)
    assert movable.tolist() == [7, 0, 1, 1, 7]


def test_a_disk_in_a_ring():
    """Solid outside: the gap between them, with the normal towards the centre."""
    n = 8
    between, one, ring = some(2, n), RNG.uniform(0.1, 0.3, n), RNG.uniform(1, 3, n)
    between[:, 0] = 0
    one[1] = ring[1] + 0.1
    gap, normal, point, status = np.empty(n), np.empty((2, n)), np.empty((2, n)), np.empty(n, np.int32)
    kernel("cairn_pair_disk_ring", "cairn_pair_contact")(n, between, one, ring, np.zeros((3, n)), gap, normal, point, status)
    far = np.linalg.norm(between, axis=0)
    np.testing.assert_allclose(gap, ring - one - far, **CLOSE)
    np.testing.assert_allclose(normal[:, 1:], -between[:, 1:] / far[1:], **CLOSE)
    assert np.abs(normal[:, 0]).tolist() == [1, 0] and (status == 2).tolist() == (one > ring).tolist()
    np.testing.assert_allclose(point, -(one + gap / 2) * normal, **CLOSE)


# ---------------------------------------------------------------------- rules


def test_rules_between_words():
    """The hash table of rules about two words against a dict."""
    words, places = 40, 128
    key, rule, added = np.full((places, 2), -1, np.int32), np.full(places, -1, np.int32), np.zeros(1, np.int32)
    known = {}
    place = kernel("cairn_law_rule_place")
    for number in range(50):
        a, b = (int(k) for k in RNG.integers(0, words, 2))
        place(a, b, number, places, key, rule, added)
        assert added[0] == (tuple(sorted((a, b))) not in known)
        known[tuple(sorted((a, b)))] = number
    word = np.stack([np.full(words, -1), np.arange(words)], axis=1).astype(np.int32)  # materials of no group
    apart, alone, found = np.zeros(words, np.int8), np.full(words, -1, np.int32), np.empty(1, np.int32)
    for a in range(words):
        for b in range(words):
            kernel_between(a, b, word, apart, alone, -1, places, key, rule, found)
            assert found[0] == known.get(tuple(sorted((a, b))), -1)


def kernel_between(*arguments):
    kernel("cairn_law_rule_between")(*arguments)


# ---------------------------------------------------------------------- laws and poses


def prepared(law, c, params, h=0.01, theta=0.5, n=9):
    """gap, velocity at the start, and bias, compliance, friction, all (components, n) as Fortran has them."""
    gap, u, geometry = 1e-3 * some(n), some(c, n), positive(3, n)
    given = np.repeat(np.array(params, float)[:, None], n, 1)
    bias, compliance, mu = np.empty((c, n)), np.empty((c, n)), np.empty(n)
    context = Context(h, theta, geometry.ctypes.data, None)
    kernel(f"cairn_law_{law}_prepare", "cairn_law_prepare")(n, c, context, gap, u, given, np.zeros((1, n)), bias, compliance, mu)
    return gap, u, bias, compliance, mu


@pytest.mark.parametrize("c", [2, 3])
@pytest.mark.parametrize("law, params", [("signorini_coulomb", [0.4]), ("frictionless", [0.0]), ("gap_coulomb", [0.3])])
def test_laws_of_a_gap(law, params, c):
    gap, _, bias, compliance, mu = prepared(law, c, params)
    expected = np.zeros_like(bias)
    expected[0] = (gap if law == "gap_coulomb" else np.maximum(gap, 0)) / 0.01
    np.testing.assert_allclose(bias, expected, **CLOSE)
    assert not compliance.any() and np.all(mu == params[0])


def test_restitution():
    gap, u, bias, _, mu = prepared("newton_restitution", 3, [0.2, 0.6, 0.3, 1.0])
    touch = gap <= 0
    np.testing.assert_allclose(bias[:, touch], (np.array([0.6, 0.3, 0.3])[:, None] * u)[:, touch], **CLOSE)
    assert np.all(bias[0, ~touch] > 1e150) and not bias[1:, ~touch].any() and np.all(mu == 0.2)
    gap, _, bias, _, _ = prepared("newton_restitution", 3, [0.2, 0.0, 0.0, 1.0])
    np.testing.assert_allclose(bias[0], np.maximum(gap, 0) / 0.01, **CLOSE)


@pytest.mark.parametrize("c", [2, 3])
def test_poses(c):
    n, h, theta, k, ratio = 7, 0.02, 0.8, 50.0, 0.4
    gap, u, force, bias, soft, given = some(n), some(c, n), some(c, n), some(c, n), positive(c, n), np.empty((c, n))
    before, softness = bias.copy(), soft.copy()
    kernel("cairn_pose_granular_element", "cairn_pose")(n, c, h, theta, np.array([k, ratio]), gap, u, force, bias, soft, given)
    stiff = np.array([k] + [ratio * k] * (c - 1))[:, None]
    np.testing.assert_allclose(soft, softness + 1 / (h**2 * theta**2 * stiff), **CLOSE)
    expected = before + (1 - theta) / theta * u - force / (h * theta * stiff)
    expected[0] = gap / (h * theta)
    np.testing.assert_allclose(bias, expected, **CLOSE)
    np.testing.assert_allclose(given, h * (1 - theta) * force, **CLOSE)
    soft[:], bias[:] = softness, before
    kernel("cairn_pose_carpenter", "cairn_pose")(n, c, h, 1.0, np.array([np.inf, 0.0]), gap, u, force, bias, soft, given)
    np.testing.assert_allclose(bias, np.concatenate([gap[None] / h, before[1:]]), **CLOSE)
    assert np.array_equal(soft, softness) and not given.any()


# ---------------------------------------------------------------------- gradient methods


@pytest.mark.parametrize("dim", [2, 3])
def test_gradient_methods(dim):
    n, step = 10, 0.3
    mu, rho, y, u, r = RNG.uniform(0, 1, n), positive(n), some(n, dim), some(n, dim), np.empty((n, dim))
    kernel("cairn_gradient_step")(dim, n, mu, rho, step, y, u, r)
    slack = u.copy()
    slack[:, 0] += mu * np.linalg.norm(u[:, 1:], axis=1)
    asked = y - step * rho[:, None] * slack
    np.testing.assert_allclose(r, [nearest_in_cone(*pair) for pair in zip(mu, asked)], **CLOSE)
    p, moved = some(n, dim), r.copy()
    kernel("cairn_disk_step")(dim, n, mu, step, p, moved)
    expected = r + step * p
    kernel("cairn_project_disks")(dim, n, mu, expected)
    np.testing.assert_allclose(moved, expected, **CLOSE)
    start, column, block, _ = problem(dim)
    n = len(start) - 1
    place, rho = np.empty(n, np.int64), np.empty(n)
    block[np.repeat(np.arange(n), np.diff(start)) == column] += 3 * np.eye(dim)
    kernel("cairn_block_diagonal")(dim, n, start, column, block, place, np.empty(n))
    kernel("cairn_contact_scales")(dim, n, block, place, rho)
    own = np.maximum(np.diagonal(block[place], axis1=1, axis2=2), 0)
    np.testing.assert_allclose(rho, dim / own.sum(axis=1), **CLOSE)


def test_extrapolate():
    r, last, y, back = some(8), some(8), some(8), np.empty(1, np.int32)
    turned = np.sum((y - r) * (r - last)) > 0
    kernel("cairn_extrapolate")(8, 0.4, r, last, y, back)
    assert back[0] == turned
    np.testing.assert_allclose(y, r if turned else r + 0.4 * (r - last), **CLOSE)
    kernel("cairn_extrapolate")(8, 0.4, r, last, r - (r - last), back)
    assert back[0] == 0


# ---------------------------------------------------------------------- places


@pytest.mark.parametrize("dim", [2, 3])
def test_contactor_centres(dim):
    n, bodies = 6, 4
    body = RNG.integers(0, bodies, n).astype(np.int32)
    position, offset, centre, wrong = some(bodies, dim), some(n, dim), np.empty((n, dim)), np.empty(1, np.int64)
    rotation = some(bodies, 1) if dim == 2 else quaternions(bodies)
    kernel("cairn_contactor_centres")(dim, 0, n, body, position, 1, offset, 1, rotation, centre, wrong)
    if dim == 2:
        c, s = np.cos(rotation[:, 0]), np.sin(rotation[:, 0])
        r = np.stack([c, -s, s, c], axis=1).reshape(-1, 2, 2)
    else:
        r = matrices(rotation)
    np.testing.assert_allclose(centre, position[body] + np.einsum("nij,nj->ni", r[body], offset), **CLOSE)
    assert wrong[0] == -1
    position[body[2]] = np.nan
    kernel("cairn_contactor_centres")(dim, 0, n, body, position, 0, offset, 0, rotation, centre, wrong)
    assert wrong[0] == np.flatnonzero(body == body[2])[0]


@pytest.mark.parametrize("dim", [2, 3])
def test_plane_search(dim):
    n = 700
    centre, reach, origin, margin = some(n, dim), RNG.uniform(0, 0.1, n), some(dim), 0.05
    normal = some(dim)
    normal /= np.linalg.norm(normal)
    listed, near, found = np.arange(0, n, 2, dtype=np.int32), np.full(n, -1, np.int32), np.empty(1, np.int64)
    kernel("cairn_plane_search")(dim, len(listed), listed, centre, reach, origin, normal, margin, n, near, found)
    expected = listed[((centre - origin) @ normal - reach - margin)[listed] <= 0]
    assert np.array_equal(near[: found[0]], expected)


@pytest.mark.parametrize("dim", [2, 3])
def test_pair_gather(dim):
    n, contactors = 6, 5
    a, b = (RNG.integers(0, contactors, n).astype(np.int32) for _ in range(2))
    steps = RNG.integers(-1, 2, (n, dim))
    image = np.sum((steps + 512) << (10 * np.arange(dim)), axis=1).astype(np.int32)
    centre, radius, direction = some(contactors, dim), positive(contactors), some(contactors, dim + 1)
    vectors = np.zeros((3, 3))  # rows: columns of Fortran
    for k in range(dim):
        vectors[k, : k + 1] = some(k + 1)
    between, one, two, along = np.empty((dim, n)), np.empty(n), np.empty(n), np.empty((dim + 1, n))
    kernel("cairn_pair_gather")(dim, n, a, b, image, centre, radius, 1, direction, 1, vectors, between, one, two, along)
    np.testing.assert_allclose(between.T, centre[a] - centre[b] - steps @ vectors[:dim, :dim], **CLOSE)
    assert np.array_equal(one, radius[a]) and np.array_equal(two, radius[b]) and np.array_equal(along.T, direction[b])


# ---------------------------------------------------------------------- smooth contacts


def test_sums_of_other_tiles():
    n, nd = 9, 6
    body, place = RNG.integers(0, 4, n).astype(np.int32), RNG.permutation(n).astype(np.int32)
    other, force = some(n, nd), some(4, nd)
    expected = force.copy()
    np.add.at(expected, body, other[place])
    kernel("cairn_smooth_add")(nd, n, body, place, other, force)
    np.testing.assert_allclose(force, expected, **CLOSE)


def test_records_of_spheres():
    n = 4
    x, v, r, inverse, record = some(n, 3), some(n, 6), positive(n), positive(n, 6), np.zeros((n, 12))
    kernel("cairn_sphere_records")(1, n, x, v, r, inverse, record)
    zero, r = np.zeros((n, 1)), r[:, None]
    expected = np.concatenate([x, r, v[:, :3], zero, v[:, 3:], inverse[:, :1]], axis=1)
    np.testing.assert_allclose(record[1:], expected[1:], **CLOSE)
    assert not record[0].any()
