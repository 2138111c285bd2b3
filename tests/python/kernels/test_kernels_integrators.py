"""Records of a step by integrators, against the published schemes: M a + C v + K q = F."""

import ctypes
import math

import numpy as np
import pytest
from kernels import kernel, rows

RNG = np.random.default_rng(22)
M, C, K = 1.7, 0.4, 30.0
MOST = 4
FIELDS = [("h", 1), ("impulse", 1), ("end_share", 1), ("implicit", 1), ("damping", 1), ("stiffness", 1), ("share", 1),
          ("elastic_velocity", 1), ("position", MOST), ("velocity", MOST), ("elastic", MOST), ("damping_history", MOST),
          ("update", MOST * MOST), ("gain", MOST), ("largest", 1)]  # fmt: skip
CASES = {
    "theta": [[0.5], [0.7], [1.0]],
    "newmark": [[0.25, 0.5], [0.3, 0.6], [0.1, 0.5]],
    "hht": [[-0.05], [-0.3]],
    "generalised_alpha": [[0.8], [0.0], [1.0]],
    "central_difference": [[0.0]],
    "beta_scheme": [[0.5], [0.8]],
    "velocity_verlet": [[0.0]],
    "gear": [[4.0], [5.0], [6.0]],
    "discrete_gradient": [[0.0]],
}
EACH = [(name, params) for name, cases in CASES.items() for params in cases]


def scheme(name, params, h):
    """The record as it is in memory, and by names."""
    raw = np.zeros(sum(size for _, size in FIELDS) + 1)
    kernel(f"cairn_integrator_{name}", "cairn_integrator")(h, np.array(params), raw)
    record, at = {}, 0
    for field, size in FIELDS:
        record[field] = raw[at] if size == 1 else raw[at : at + size].copy()
        at += size
    record["update"] = record["update"].reshape(MOST, MOST).T  # by columns
    record["histories"], record["by_energy"] = (int(k) for k in np.frombuffer(raw[at:].tobytes(), np.int32))
    return raw, record


def mapped(s, q, v, a, f0, f1, c=C, k=K):
    """The step of the record: see linear_scheme.f90."""
    a = np.concatenate([a, np.zeros(MOST - len(a))])
    force = s["end_share"] * f1 + (1 - s["end_share"]) * f0
    q_f = q + s["elastic_velocity"] * v + s["elastic"] @ a
    v_f = v + s["damping_history"] @ a
    matrix = M + s["damping"] * c + s["stiffness"] * k
    change = (s["impulse"] * (force - c * v_f - k * q_f) - (s["damping"] * c + s["stiffness"] * k) * (s["velocity"] @ a)) / matrix
    v1 = v + s["velocity"] @ a + change
    q1 = q + s["h"] * (1 - s["share"]) * v + s["position"] @ a + s["h"] * s["share"] * v1
    return q1, v1, (s["update"] @ a + s["gain"] * change)[: s["histories"]]


def newmark(h, q, v, a, f0, f1, c, k, beta, gamma, am=0.0, af=0.0):
    """Newmark (1959) with the weights of Chung and Hulbert (1993) in inertia and forces."""

    def at(a1):
        q1 = q + h * v + h * h * ((0.5 - beta) * a[0] + beta * a1)
        v1 = v + h * ((1 - gamma) * a[0] + gamma * a1)
        rest = (1 - af) * (f1 - c * v1 - k * q1) + af * (f0 - c * v - k * q)
        return q1, v1, (1 - am) * M * a1 + am * M * a[0] - rest

    a1 = at(0.0)[2] / (at(0.0)[2] - at(1.0)[2])  # the residual is linear in a1
    return *at(a1)[:2], [a1]


def theta(h, q, v, a, f0, f1, c, k, t):
    """Jean (1999): all forces at the same mean of begin and end."""
    v1 = (M * v + h * (t * f1 + (1 - t) * f0 - c * (1 - t) * v - k * (q + t * h * (1 - t) * v))) / (
        M + h * t * c + (h * t) ** 2 * k
    )
    return q + h * (t * v1 + (1 - t) * v), v1, []


def middle(h, q, v, a, f0, f1, c, k, beta=0.5):
    """Carpenter, Taylor and Katona (1991), q + h w + h^2/2 a, w with the acceleration of the last step."""
    now = (f0 - c * v - k * q) / M
    w = v + h * ((0.5 - beta) * a[0] + (beta - 0.5) * now) if a else v
    q1 = q + h * (w + h * now)
    return q1, (q1 - q) / h, [now] if a else []


def gear(h, q, v, a, f0, f1, c, k, values):
    """Nordsieck's vector, predicted by Pascal's triangle; coefficients of Gear (1971) for forces that know the velocity."""
    correct = {4: [1 / 6, 5 / 6, 1, 1 / 3], 5: [19 / 90, 3 / 4, 1, 1 / 2, 1 / 12],
               6: [3 / 16, 251 / 360, 1, 11 / 18, 1 / 6, 1 / 60]}[values]  # fmt: skip
    scale = np.array([h**j / math.factorial(j) for j in range(int(values))])
    pascal = np.array([[math.comb(j, i) for j in range(int(values))] for i in range(int(values))], float)
    r = pascal @ (scale * [q, v, *a])
    wrong = h * h / 2 * (f1 - c * r[1] / h - k * r[0]) / M - r[2]
    r = (r + np.array(correct) * wrong) / scale
    return r[0], r[1], list(r[2:])


def alpha(h, *state):
    *state, am, af = state
    return newmark(h, *state, (1 - am + af) ** 2 / 4, 0.5 - am + af, am, af)


STEPS = {
    "theta": theta,
    "newmark": newmark,
    "hht": lambda *given: alpha(*given[:-1], 0.0, -given[-1]),
    "generalised_alpha": lambda *given: alpha(*given[:-1], (2 * given[-1] - 1) / (given[-1] + 1), given[-1] / (given[-1] + 1)),
    "central_difference": lambda *given: middle(*given[:-1]),
    "beta_scheme": middle,
    "velocity_verlet": lambda *given: newmark(*given[:-1], 0.0, 0.5),
    "gear": gear,
    "discrete_gradient": lambda *given: theta(*given[:-1], 0.5),  # the midpoint rule where forces are linear
}


def test_every_integrator_is_here():
    assert {row[0] for row in rows("integrators/integrators.def", "CAIRN_INTEGRATOR")} == set(CASES) == set(STEPS)


@pytest.mark.parametrize("name, params", EACH, ids=str)
def test_steps(name, params):
    for h in (0.01, 0.3):
        _, s = scheme(name, params, h)
        q, v, f0, f1, *a = RNG.standard_normal(4 + s["histories"])
        q1, v1, a1 = STEPS[name](h, q, v, a, f0, f1, C, K, *params)
        found = mapped(s, q, v, np.array(a), f0, f1)
        np.testing.assert_allclose([*found[:2], *found[2]], [q1, v1, *a1], rtol=1e-11, atol=1e-12)
        assert s["by_energy"] == (name == "discrete_gradient")
        assert s["h"] == h and (s["end_share"] > 0) == (name not in ("central_difference", "beta_scheme"))
        np.testing.assert_allclose(s["implicit"], s["damping"] / s["impulse"], rtol=1e-14)


def growth(name, params, h):
    """Spectral radius of a step of free motion with frequency 1."""
    _, s = scheme(name, params, h)
    n = 2 + s["histories"]
    columns = []
    for e in np.eye(n):
        q1, v1, a1 = mapped(s, e[0], e[1], e[2:], 0.0, 0.0, 0.0, M)
        columns.append([q1, v1, *a1])
    return np.abs(np.linalg.eigvals(np.array(columns))).max()


@pytest.mark.parametrize("name, params", EACH, ids=str)
def test_the_largest_step(name, params):
    """Below it free motion does not grow, but by what docs/strategies.md says of Gear; without limit, however long the step."""
    largest = scheme(name, params, 0.01)[1]["largest"]
    grows = {5.0: 0.011, 6.0: 0.001}.get(params[0], 0) if name == "gear" else 0
    for share in (0.1, 0.5, 0.99):
        assert growth(name, params, share * largest if largest < np.inf else 1e4 * share) <= 1 + 1e-7 + grows
    if largest < np.inf:
        assert growth(name, params, (1.5 if grows else 1.02) * largest) > 1.001 + grows


# ---------------------------------------------------------------------- what a scheme keeps


def rigid(dim, n=6):
    """Rigid bodies, with a fixed body, a driven body, and a body of three different moments of inertia."""
    nd = 3 * dim - 3
    mass, inertia = RNG.uniform(0.5, 2, n), np.repeat(RNG.uniform(0.5, 2, n)[:, None], 2 * dim - 3, 1)
    mass[1], inertia[1] = np.inf, np.inf
    if dim == 3:
        inertia[2] = [1.0, 2.0, 2.5]
    driven = np.zeros(n, np.int8)
    driven[3] = 1 + 2 ** (nd - 1)
    m = np.concatenate([np.repeat(mass[:, None], dim, 1), inertia], axis=1)
    held = (driven[:, None].astype(int) >> np.arange(nd)) & 1 == 1
    return n, nd, mass, inertia, driven, m, held


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("values", [4.0, 6.0])
def test_histories(dim, values):
    h, kept = 0.02, int(values) - 2
    raw, s = scheme("gear", [values], h)
    n, nd, mass, inertia, driven, m, held = rigid(dim)
    g, v0, v1, force, damping = (RNG.standard_normal(shape) for shape in (dim, (n, nd), (n, nd), (n, nd), n))
    damping = np.abs(damping)
    a = [RNG.standard_normal((n, nd)) if k < kept else None for k in range(MOST)]
    known = np.array([np.zeros((n, nd)) if x is None else x for x in a])
    weighted = {name: np.einsum("k,kij->ij", s[name], known) for name in ("velocity", "damping_history")}
    change, way = np.empty((n, nd)), np.empty((n, nd))
    kernel("cairn_smooth_change")(dim, nd, n, raw, g, mass, inertia, v0, v1, change, *a, force, damping, driven)
    drag = s["impulse"] * (v0 + weighted["damping_history"]) + s["damping"] * (v1 - v0)
    expected = s["impulse"] * (np.concatenate([g, np.zeros(nd - dim)]) + force / m) - damping[:, None] * drag
    expected[1] = 0
    expected = np.where(held, 0, expected)
    np.testing.assert_allclose(change, expected, rtol=1e-12, atol=1e-13)
    kernel("cairn_history_way")(nd, n, raw, v0, v1, change, way, *a)
    jump = v1 - v0 - weighted["velocity"] - expected  # by contacts: half a step of it, less the share of the end velocity
    moved = np.einsum("k,kij->ij", s["position"], known) + (h / 2 - h * s["share"]) * jump
    np.testing.assert_allclose(way, moved, rtol=1e-10, atol=1e-13)
    free, inverse = RNG.standard_normal((n, nd)), np.where(held, 0, 1 / m)
    before = free.copy()
    kernel("cairn_history_velocity")(nd, n, raw, 2, a[1], inverse, free, damping)
    factor = (s["velocity"][1] - s["impulse"] * damping * s["damping_history"][1]) / (1 + s["damping"] * damping)
    np.testing.assert_allclose(free, np.where(inverse > 0, before + factor[:, None] * a[1], before), rtol=1e-12, atol=1e-14)
    given = [None if x is None else x.copy() for x in a]
    kernel("cairn_history_update")(dim, nd, n, raw, change, inertia, *given)
    later = np.einsum("jk,kil->jil", s["update"], known) + s["gain"][:, None, None] * change
    if dim == 3:
        later[:, 2, dim:] = 0  # the spin of a body of three moments follows the midpoint rule
    for k in range(kept):
        np.testing.assert_allclose(given[k], later[k], rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize("dim", [2, 3])
def test_histories_begin_with_the_forces_at_hand(dim):
    n, nd, mass, inertia, driven, m, held = rigid(dim)
    g, v, force, damping = (RNG.standard_normal(shape) for shape in (dim, (n, nd), (n, nd), n))
    known = np.zeros(n, np.int8)
    known[5] = 1
    a = [np.full((n, nd), 7.0) for _ in range(4)]
    kernel("cairn_history_start")(dim, nd, n, known, g, mass, inertia, v, *a, force, damping, driven)
    c = damping[:, None]
    first = np.where(held | np.isinf(m), 0, np.concatenate([g, np.zeros(nd - dim)]) + force / m - c * v)
    if dim == 3:
        first[2, dim:] = 0
    for k in range(4):
        expected = (-c) ** k * first
        expected[5] = 7.0
        np.testing.assert_allclose(a[k], expected, rtol=1e-12, atol=1e-14)


def test_the_record_is_as_long_as_c_has_it():
    assert ctypes.sizeof(ctypes.c_double) * sum(size for _, size in FIELDS) == 45 * 8


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("values", [4.0, 5.0, 6.0])
def test_prediction_and_correction(dim, values):
    """A step of smooth DEM under forces that are known: Gear's own, each dof for itself, but for those that are driven."""
    h, kept = 0.02, int(values) - 2
    raw, _ = scheme("gear", [values], h)
    n, nd, _, _, driven, m, held = rigid(dim)
    g, contact, force, damping = RNG.standard_normal(dim), *RNG.standard_normal((2, n, nd)), RNG.uniform(0, 1, n)
    v, x, drive = RNG.standard_normal((n, nd)), RNG.standard_normal((n, dim)), RNG.standard_normal((n, nd))
    a = [RNG.standard_normal((n, nd)) if k < kept else None for k in range(MOST)]
    for known in a[:kept]:
        known[np.isinf(m) | held] = 0
    angle, reaction, inverse = RNG.standard_normal(n), np.zeros((n, nd)), np.where(np.isinf(m), 0, 1 / m)
    now = v.copy(), x.copy(), angle.copy(), [None if k is None else k.copy() for k in a]
    fastest, farthest, wrong, terms = np.empty(2), np.empty(1), np.array([-1]), np.zeros(5)
    turns = now[2] if dim == 2 else None
    kernel("cairn_gear_predict")(dim, nd, 0, n, raw, now[0], now[1], fastest, *now[3], turns, driven, drive)
    half = v + sum((h / 2) ** (k + 1) / math.factorial(k + 1) * a[k] for k in range(kept))
    np.testing.assert_allclose(now[0], np.where(held, (v + drive) / 2, half), rtol=1e-13, atol=1e-14)
    predicted = now[1].copy()
    np.testing.assert_allclose(fastest[0], np.sum(((predicted - x) / h) ** 2, axis=1).max(), rtol=1e-12)
    kernel("cairn_gear_correct")(
        dim, nd, 0, n, raw, g, inverse, contact, now[0], now[1], wrong, farthest, *now[3], turns, force, damping, driven, drive,
        reaction, terms,
    )  # fmt: skip
    way, q = np.zeros((n, nd)), np.concatenate([x, angle[:, None] if dim == 2 else np.zeros((n, 3))], axis=1)
    for i in range(n):
        for j in range(nd):
            load = inverse[i, j] * (contact + force)[i, j] + (g[j] if j < dim and inverse[i, 0] > 0 else 0)
            c = damping[i] if inverse[i, j] > 0 else 0.0
            state = [known[i, j] for known in a[:kept]]
            q1, v1, a1 = gear(h, q[i, j], v[i, j], state, 0.0, load * M, c * M, 0.0, values)
            if held[i, j]:
                q1, v1, a1 = q[i, j] + h * (v + drive)[i, j] / 2, drive[i, j], [0.0] * kept
            got = [now[0][i, j], *[known[i, j] for known in now[3][:kept]]]
            np.testing.assert_allclose(got, [v1, *a1], rtol=1e-10, atol=1e-11)
            way[i, j] = q1 - q[i, j]
    np.testing.assert_allclose(now[1], x + way[:, :dim], rtol=1e-12, atol=1e-13)
    if dim == 2:
        np.testing.assert_allclose(now[2], angle + way[:, 2], rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(farthest, np.sum((now[1] - predicted) ** 2, axis=1).max(), rtol=1e-6)
    mass = np.where(np.isinf(m), 0, m)
    weight = mass * np.concatenate([g, np.zeros(nd - dim)])
    given = np.where(held, np.where(mass > 0, mass * (drive - v) - h * weight, 0) - h * (contact + force), 0)
    np.testing.assert_allclose(reaction, given, rtol=1e-11, atol=1e-12)
    expected = [
        np.sum(mass * now[0] ** 2) / 2,
        -np.sum(weight * way),
        np.sum(force * way * (mass > 0)),
        np.sum(given * (v + drive) / 2),
    ]
    middle = np.where(held, (v + drive) / 2, half)
    expected.append(np.sum(mass * damping[:, None] * middle * way))
    np.testing.assert_allclose(terms, expected, rtol=1e-10, atol=1e-12)
    assert wrong[0] == -1


def test_bodies_that_turn_side_by_side_turn_as_alone():
    """Bodies of unequal moments of inertia, slow and fast ones, against the rotation of one; in any company, to the bit."""
    n, h = 70, 0.1
    inertia, force = RNG.uniform(0.5, 2.0, (n, 3)), RNG.standard_normal((n, 6))
    rotation, velocity = RNG.standard_normal((n, 4)), RNG.standard_normal((n, 6))
    rotation /= np.linalg.norm(rotation, axis=1)[:, None]
    momentum = RNG.standard_normal((n, 3)) * np.where(np.arange(n) % 7 == 0, 40, np.where(np.arange(n) % 5 == 0, 0, 3))[:, None]

    def begin(body):
        given = velocity.copy(), momentum.copy(), np.empty((len(body), 7)), np.zeros(1), np.full(1, -1)
        v, moved, turned, fastest, unsolved = given
        body = np.array(body, np.int64)
        kernel("cairn_uneven_begin")(
            len(body), body, h, inertia, force, rotation, v, moved, turned, fastest, unsolved, None, None, None
        )
        assert unsolved[0] == -1
        return v, moved, turned, fastest[0]

    v, moved, turned, fastest = begin(range(n))
    np.testing.assert_allclose(moved, momentum + h / 2 * force[:, 3:], rtol=1e-13)
    assert fastest == pytest.approx(np.max(np.sum(moved**2, 1) / inertia.min(1) ** 2), rel=1e-12)
    q, spin, failed = rotation.copy(), velocity.copy(), np.zeros(1, np.int64)
    rotate = kernel("cairn_rotate")
    rotate(n, h / 2, inertia, spin, q, moved, None, failed)
    kernel("cairn_momentum_update")(n, 0, inertia, q, velocity, spin, moved, None)
    rotate(n, h / 2, inertia, spin, q, moved, None, failed)
    np.testing.assert_allclose(turned[:, :4], q, rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(turned[:, 4:], spin[:, 3:], rtol=1e-11, atol=1e-12)
    np.testing.assert_array_equal(v[:, 3:], turned[:, 4:])
    few = [66, 3, 14, 40, 65, 9]
    np.testing.assert_array_equal(begin(few)[2], turned[few])
