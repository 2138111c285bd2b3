"""Kernels of solvers of problems, of their figures and of motion, against numpy, dense matrices and conserved quantities."""


import numpy as np
import pytest
from kernels import kernel
from scipy.spatial.transform import Rotation

RNG = np.random.default_rng(25)
CLOSE = dict(rtol=1e-11, atol=1e-13)


def some(*shape):
    return RNG.standard_normal(shape)


def positive(*shape):
    return RNG.uniform(0.5, 2.0, shape)


def contacts(dim, n=30):
    """Friction, W_NN, impulses within and on their cones and none, velocities."""
    mu, w, r, u = RNG.uniform(0.1, 1, n), positive(n), some(n, dim), some(n, dim)
    r[:, 0] = np.abs(r[:, 0])
    tangent = np.linalg.norm(r[:, 1:], axis=1)
    share = np.where(np.arange(n) % 3 == 0, 1.0, 0.5) * mu * r[:, 0] / tangent
    r[:, 1:] *= share[:, None]
    r[::5] = 0
    r[5, 0] = -0.1
    return mu, w, r, u


# ---------------------------------------------------------------------- nesterov, extragradient, conjugate gradients


def test_nesterov():
    n, factor = 9, 0.6
    before, r, start = some(n), some(n), np.empty(n)
    old, came = before.copy(), r.copy()
    kernel("cairn_nesterov_lean")(n, factor, before, r, start)
    np.testing.assert_allclose(r, came + factor * (came - old), **CLOSE)
    assert np.array_equal(before, came) and np.array_equal(start, r)
    kernel("cairn_nesterov_lean")(n, 0.0, before, r, start)
    assert np.array_equal(before, r) and np.array_equal(start, r)
    w, one, two, three, along = positive(3), some(3, 3), some(3, 3), some(3, 3), np.empty(1)
    kernel("cairn_nesterov_along")(3, 3, w, one, two, three, along)
    np.testing.assert_allclose(along, np.sum(w[:, None] * (one - three) * (three - two)), **CLOSE)


@pytest.mark.parametrize("dim", [2, 3])
def test_gradient_ratio(dim):
    """How much faster velocities with friction's slack change than impulses, in the norms of rho."""
    mu, w, r, u = contacts(dim)
    s, v, rho = some(*r.shape), some(*u.shape), 1 / w
    slack = [x + np.where(np.arange(dim) == 0, (mu * np.linalg.norm(x[:, 1:], axis=1))[:, None], 0) for x in (u, v)]
    change = np.sum(rho[:, None] * (slack[0] - slack[1]) ** 2) / np.sum((r - s) ** 2 / rho[:, None])
    found = kernel("cairn_gradient_ratio")(dim, len(mu), mu, rho, r, u, s, v)
    assert found == pytest.approx(np.sqrt(change), rel=1e-12)
    assert kernel("cairn_gradient_ratio")(dim, len(mu), mu, rho, r, u, r, v) == 0


@pytest.mark.parametrize("dim", [2, 3])
def test_directions_stay_inside(dim):
    """Nearest direction in the tangent cone of a disk: only the outward part is removed."""
    mu, w, r, u = contacts(dim)
    out, rho = np.empty_like(r), 1 / w
    kernel("cairn_tangent_gradient")(dim, len(mu), mu, rho, r, u, out)
    p, b = some(*r.shape), 0.3
    given = p.copy()
    kernel("cairn_conjugate_direction")(dim, len(mu), mu, r, out, b, p)
    for asked, got in ((-rho[:, None] * u, out), (out + b * given, p)):
        for a in range(len(mu)):
            expected = asked[a].copy()
            size = np.linalg.norm(r[a, 1:])
            if r[a, 0] <= 0:
                expected[0], expected[1:] = max(expected[0], 0), 0
            elif size >= mu[a] * r[a, 0] * (1 - 1e-12):
                away = r[a, 1:] / size
                expected[1:] -= max(0.0, away @ expected[1:]) * away
            np.testing.assert_allclose(got[a], expected, **CLOSE)


# ---------------------------------------------------------------------- Anderson


def test_anderson():
    """The mean of past sweeps whose residual is least, weighted; by a least-squares solution."""
    n, columns = 12, 3
    weight, df, dg, gram, work = positive(n), np.zeros((columns, n)), np.zeros((columns, n)), np.zeros((32, 32)), np.empty(n)
    f, g = [some(n) for _ in range(columns + 1)], [some(n) for _ in range(columns + 1)]
    for k in range(columns):
        kernel("cairn_anderson_store")(n, k + 1, k, weight, f[k + 1], f[k], g[k + 1], g[k], df, dg, gram, work)
    past, after = np.diff(f, axis=0), np.diff(g, axis=0)
    np.testing.assert_allclose(df, past, **CLOSE)
    np.testing.assert_allclose(gram[:columns, :columns], past @ np.diag(weight) @ past.T, rtol=1e-10, atol=1e-12)
    r = np.empty(n)
    kernel("cairn_anderson_mix")(n, columns, weight, f[-1], g[-1], df, dg, gram, r, work)
    root = np.sqrt(weight)
    c = np.linalg.lstsq((root * past).T, root * f[-1], rcond=None)[0]
    np.testing.assert_allclose(r, g[-1] - c @ after, rtol=1e-7, atol=1e-8)


# ---------------------------------------------------------------------- figures


def natural_map(mu, w, r, u):
    """r less the nearest impulse in the cone to r - rho (u + mu |u_T| n)."""
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


@pytest.mark.parametrize("dim", [2, 3])
def test_figures_of_contacts(dim):
    mu, w, r, u = contacts(dim)
    n, q = len(mu), some(len(mu), dim)
    f = np.array([natural_map(*one) for one in zip(mu, w, r, u)])
    speed = np.empty(n)
    kernel("cairn_problem_speeds")(dim, n, mu, w, r, u, speed)
    np.testing.assert_allclose(speed, w * np.linalg.norm(f, axis=1), rtol=1e-11, atol=1e-13)
    figures = np.empty(5)
    kernel("cairn_problem_figures")(dim, n, mu, w, q, r, u, figures)
    none = np.array([natural_map(m, k, 0 * a, b) for m, k, a, b in zip(mu, w, r, q)])
    squares = [np.sum(x**2, axis=1) for x in (f, r, none)]
    each = squares[0] / np.maximum(np.max(squares, axis=0), 1e-300)
    outside = np.maximum(-r[:, 0], np.linalg.norm(r[:, 1:], axis=1) - mu * np.maximum(r[:, 0], 0))
    size = np.linalg.norm(r, axis=1)
    beyond = np.max(np.maximum(outside, 0)[size > 0] / size[size > 0])
    work = np.sum(r * u, axis=1)
    expected = [each.max(), each.argmax(), max(0, -u[:, 0].min()) / np.linalg.norm(q, axis=1).max(), beyond]
    expected += [np.maximum(work, 0).sum() / np.abs(r * q).sum()]
    np.testing.assert_allclose(figures, expected, rtol=1e-11)


@pytest.mark.parametrize("dim", [2, 3])
def test_what_breaks_the_law(dim):
    """Signorini's condition along the normal, Coulomb's along tangents, each with the other as it is; [m/s]."""
    mu, w, r, u = contacts(dim)
    broken = np.empty_like(r)
    kernel("cairn_law_breaks")(dim, len(mu), mu, w, r, u, broken)
    for a in range(len(mu)):
        z = r[a] - u[a] / w[a]
        normal = r[a, 0] - max(z[0], 0)
        limit, size = mu[a] * max(z[0], 0), np.linalg.norm(z[1:])
        held = z[1:] * (limit / size if size > limit else 1)
        np.testing.assert_allclose(broken[a], w[a] * np.concatenate([[normal], r[a, 1:] - held]), rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
def test_newton_weights(dim):
    """1/W_NN, and of the tangential block the inverse of its largest eigenvalue."""
    n = 6
    root = some(n, dim, dim)
    block = root @ root.transpose(0, 2, 1)
    block[2, 1:, 1:] *= 1e-12
    block[2, 0, 1:] = block[2, 1:, 0] = 0
    place, rho = RNG.permutation(n), np.empty((n, 2))
    kernel("cairn_newton_weights")(dim, n, place, block, rho)
    for a in range(n):
        own = block[place[a]]
        largest = np.linalg.eigvalsh(own[1:, 1:]).max()
        second = 1 / largest if largest > 1e-8 * own[0, 0] else 1 / own[0, 0]
        np.testing.assert_allclose(rho[a], [1 / own[0, 0], second], rtol=1e-10)


# ---------------------------------------------------------------------- motion


@pytest.mark.parametrize("dim", [2, 3])
def test_positions_advance(dim):
    n, nd, h = 5, 3 * dim - 3, 0.03
    v, x, angle = some(n, nd), some(n, dim), some(n)
    place, turned = x + h * v[:, :dim], angle + h * v[:, 2]
    kernel("cairn_theta_advance")(dim, nd, n, h, v, x, angle if dim == 2 else None)
    np.testing.assert_allclose(x, place, **CLOSE)
    np.testing.assert_allclose(angle, turned if dim == 2 else angle, **CLOSE)


def test_free_rotation():
    """Spheres turn by their spin; bodies of three moments keep energy, angular momentum, and follow Euler's equations."""
    n = 3
    inertia = np.array([[1.0, 1, 1], [1.0, 2, 3], [0.5, 2, 2]])
    q = Rotation.random(n, random_state=1)
    rotation = np.ascontiguousarray(np.roll(q.as_quat(), 1, axis=1))
    v = np.zeros((n, 6))
    v[:, 3:] = some(n, 3)

    def body(k, r):
        return r.as_matrix() @ np.diag(inertia[k]) @ r.as_matrix().T

    momentum = np.array([body(k, q[k]) @ v[k, 3:] for k in range(n)])
    energy = [momentum[k] @ v[k, 3:] / 2 for k in range(n)]
    unsolved = np.empty(1, np.int64)
    h, steps = 1e-2, 50
    for _ in range(steps):
        kernel("cairn_rotate")(n, h, inertia, v, rotation, momentum, None, unsolved)
        assert unsolved[0] == 0
    now = Rotation.from_quat(np.roll(rotation, -1, axis=1))
    turned = Rotation.from_rotvec(steps * h * v[0, 3:]) * q[0]
    np.testing.assert_allclose(now[0].as_matrix(), turned.as_matrix(), rtol=0, atol=1e-12)
    for k in (1, 2):
        spin = np.linalg.solve(body(k, now[k]), momentum[k])
        assert momentum[k] @ spin / 2 == pytest.approx(energy[k], rel=1e-12)
        r = q[k]
        small = h / 40  # Euler's equations by many small turns about the spin at their middle
        for _ in range(40 * steps):
            half = Rotation.from_rotvec(small / 2 * np.linalg.solve(body(k, r), momentum[k])) * r
            r = Rotation.from_rotvec(small * np.linalg.solve(body(k, half), momentum[k])) * r
        np.testing.assert_allclose(now[k].as_matrix(), r.as_matrix(), rtol=0, atol=2e-4)


@pytest.mark.parametrize("among", [1, 5, 64, 150])
def test_bodies_that_keep_their_spin_turn_alike_in_any_company(among):
    """Side by side with bodies at rest and bodies of other kinds, to the bits of each alone; by Rodrigues' formula."""
    inertia = np.where(RNG.random((among, 1)) < 0.3, positive(among, 3), 1.0)
    v, q = np.zeros((among, 6)), Rotation.random(among, random_state=among)
    v[:, 3:] = some(among, 3) * 10.0 ** RNG.integers(-3, 4, (among, 1))
    v[::7, 3:] = 0
    momentum = some(among, 3)
    begin = np.ascontiguousarray(np.roll(q.as_quat(), 1, axis=1))
    together, alone, unsolved, h = begin.copy(), begin.copy(), np.empty(1, np.int64), 1e-2
    kernel("cairn_rotate")(among, h, inertia, v, together, momentum, None, unsolved)
    for k in range(among):
        kernel("cairn_rotate")(1, h, inertia[k], v[k], alone[k], momentum[k], None, unsolved)
    assert together.tobytes() == alone.tobytes()
    round_ones = np.flatnonzero((inertia == 1).all(axis=1))
    turned = Rotation.from_rotvec(h * v[round_ones, 3:]) * q[round_ones]
    now = Rotation.from_quat(np.roll(together[round_ones], -1, axis=1))
    np.testing.assert_allclose(now.as_matrix(), turned.as_matrix(), rtol=0, atol=1e-12)
    still = np.intersect1d(round_ones, np.arange(0, among, 7))
    assert (together[still] == begin[still]).all()


def test_steps_of_spheres():
    """The kernels that know spheres alone, against those of any body; the records of contacts are made anew."""
    n, h, g = 6, 0.01, some(3)
    inverse, force, radius, v, x = positive(n, 6), some(n, 6), positive(n), some(n, 6), some(n, 3)
    inverse[:, 1], inverse[:, 2] = inverse[:, 0], inverse[:, 0]
    inverse[:, 4], inverse[:, 5] = inverse[:, 3], inverse[:, 3]
    inverse[2] = 0
    one, two = (v.copy(), x.copy()), (v.copy(), x.copy())
    record, fastest, known = np.zeros((n, 12)), np.empty(2), np.empty(2)
    kernel("cairn_verlet_begin_spheres")(0, n, h, g, inverse, force, radius, *one, record, fastest)
    kernel("cairn_verlet_begin")(3, 6, 0, n, h, g, inverse, force, *two, known, None, None, None, None, None, None)
    for a, b in zip(one, two):
        np.testing.assert_allclose(a, b, **CLOSE)
    assert fastest[0] == pytest.approx(known[0], rel=1e-12)
    made = np.zeros((n, 12))
    kernel("cairn_sphere_records")(0, n, one[1], one[0], radius, inverse, made)
    np.testing.assert_allclose(record, made, **CLOSE)
    wrong, terms, sums = np.array([-1]), np.zeros(5), np.zeros(5)
    kernel("cairn_verlet_end_spheres")(0, n, h, g, inverse, force, one[0], wrong, terms)
    kernel("cairn_verlet_end")(3, 6, 0, n, h, g, inverse, force, two[0], wrong, None, None, None, None, None, sums)
    np.testing.assert_allclose(one[0], two[0], **CLOSE)
    np.testing.assert_allclose(terms, sums, **CLOSE)
    assert wrong[0] == -1
    one[0][4, 1] = np.nan
    kernel("cairn_verlet_end_spheres")(0, n, h, g, inverse, force, one[0], wrong, None)
    assert wrong[0] == 4


def test_answers_of_springs_are_their_stiffness():
    """cairn_contact_nudges and cairn_contact_responses: for springs r = -(K u + p), probed by their local solution, K is
    recovered and a wrong impulse corrected; held components respond by 2^20/W; sliding ones, by their normal alone."""
    rng = np.random.default_rng(5)
    n, c, axes = 8, 3, 2
    contacts = 7  # the last lane is a dummy
    a = rng.normal(size=(n, c, c))
    w = np.einsum("nik,njk->nij", a, a) + np.eye(c)
    b = rng.normal(size=(n, c, c))
    stiff = 0.3 * np.einsum("nik,njk->nij", b, b) + 0.1 * np.eye(c)
    preload, q, r = (rng.normal(size=(n, c)) for _ in range(3))

    def solve(q):
        # r = -(K u + p), u = q + W r
        return np.array([-np.linalg.solve(np.eye(c) + stiff[i] @ w[i], stiff[i] @ q[i] + preload[i]) for i in range(n)])

    columns = lambda x: np.ascontiguousarray(np.moveaxis(x, 0, -1))  # noqa: E731  Fortran's (n, c)
    blocks = np.ascontiguousarray(w.transpose(2, 1, 0))
    nudges = np.empty((c, n))
    kernel("cairn_contact_nudges")(n, c, axes, blocks, columns(q), columns(r), 1.0, nudges)
    own = np.maximum(np.abs(q), np.abs(w * r[:, None, :]).max(axis=2))
    share = own[:, :axes].max(axis=1) * 2.0**-16
    np.testing.assert_allclose(nudges[:axes], np.broadcast_to(share, (axes, n)), rtol=1e-14)
    np.testing.assert_allclose(nudges[2], np.maximum(own[:, 2] * 2.0**-16, share * np.sqrt(w[:, 2, 2] / w[:, 0, 0])), rtol=1e-14)
    target = solve(q)
    nudged = np.stack([columns(solve(q + np.eye(c)[k] * nudges[k][:, None])) for k in range(c)])
    answer, known = np.full((n, c, c), np.nan), np.full((n, c), np.nan)
    blocks_of = (blocks, columns(r), columns(target), nudged, nudges, answer, known)
    kernel("cairn_contact_responses")(n, c, contacts, 2.0**-20, np.zeros(n, dtype=np.int32), *blocks_of)
    for i in range(contacts):
        # to the proximal share of 2^-20 and what differences leave
        np.testing.assert_allclose(
            answer[i], stiff[i], rtol=0, atol=2e-5 * np.abs(stiff[i]).max() * (1 + np.abs(stiff[i] @ w[i]).max())
        )
        wanted = (np.eye(c) + stiff[i] @ w[i]) @ (target[i] - r[i])
        np.testing.assert_allclose(
            known[i], wanted, rtol=0, atol=1e-4 * np.abs(wanted).max() * (1 + np.abs(stiff[i] @ w[i]).max())
        )
    assert (answer[contacts:] == 0).all() and (known[contacts:] == 0).all()
    # held fast: r = -W^-1 q; sliding: r_N = -q_N / W_NN, r_T = mu r_N
    w = np.broadcast_to(np.diag([2.0, 3.0]), (2, 2, 2)).copy()
    q = np.array([[-1.0, 0.5], [-1.0, 5.0]])
    make = lambda q: np.array([[-q[0, 0] / 2, -q[0, 1] / 3], [-q[1, 0] / 2, 0.3 * q[1, 0] / 2]])  # noqa: E731
    nudges = np.full((2, 2), 2.0**-16)
    nudged = np.stack([columns(make(q + np.eye(2)[k] * 2.0**-16)) for k in range(2)])
    answer, known, r = np.empty((2, 2, 2)), np.empty((2, 2)), np.zeros((2, 2))
    args = (np.ascontiguousarray(w.transpose(2, 1, 0)), columns(r), columns(make(q)), nudged, nudges, answer, known)
    not_told = np.zeros(2, dtype=np.int32)
    kernel("cairn_contact_responses")(2, 2, 2, 2.0**-20, not_told, *args)
    np.testing.assert_allclose(answer[0], np.diag([2.0**20 / 2, 2.0**20 / 3]), rtol=1e-4)
    np.testing.assert_allclose(answer[1], np.diag([2.0**20 / 2, 0]), rtol=1e-4, atol=1e-12)
    np.testing.assert_allclose(known, [[2.0**19, -(2.0**20) / 6], [2.0**19, 0]], rtol=1e-4)
    # a share below the noise of differences counts as 2^-30, unless held components are given: then it is exact
    kernel("cairn_contact_responses")(2, 2, 2, 2.0**-44, not_told, *args)
    assert (np.abs(answer[:, 0, 0] / 2.0**29 - 1) < 0.2).all()
    told = np.array([1, 0], dtype=np.int32)
    nudged[:, :, 0] = -np.diag([1 / 2.0, 1 / 3.0]) * 2.0**-16  # from rest: r = -W^-1 q of each nudge alone
    kernel("cairn_contact_responses")(2, 2, 2, 2.0**-44, told, *args)
    np.testing.assert_allclose(answer[0], np.diag([2.0**44 / 2, 2.0**44 / 3]), rtol=1e-14)
    np.testing.assert_allclose(known[0], [2.0**43, -(2.0**44) / 6], rtol=1e-14)
    assert abs(answer[1, 0, 0] / 2.0**29 - 1) < 0.2
