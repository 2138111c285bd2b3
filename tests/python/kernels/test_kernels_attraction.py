"""Kernels of laws that attract, against integrals of their force."""

import numpy as np
import pytest
from kernels import Context, kernel

N, H = 40, 1e-3


def test_energy_of_capillary_bridges():
    """Stored is the work that would break the bridge; its change, and what a bridge that broke released, close the balance."""
    rng = np.random.default_rng(5)
    tension, volume, angle, radius = 0.07, 1e-9, 0.4, rng.uniform(1e-3, 5e-3, N)
    longest = (1 + angle / 2) * volume ** (1 / 3)

    def work(distance, r):  # Gauss' rule of 40 points, from the distance to the break
        x, w = np.polynomial.legendre.leggauss(40)
        d = distance + (longest - distance) * (x + 1) / 2
        force = 4 * np.pi * r * tension * np.cos(angle) * (1 - d / np.sqrt(d**2 + volume / (np.pi * r)))
        return -(longest - distance) / 2 * (w @ force) if distance < longest else 0.0

    begin, gap, u = rng.uniform(0, longest, N), rng.uniform(-0.5, 1.5, N) * longest, rng.uniform(-1, 1, (3, N)) * longest / H
    before, after = np.array([np.arange(N) % 4 > 0, begin], float), np.array([np.arange(N) % 3 > 0, begin], float)
    geometry, energy = np.array([np.ones(N), radius, np.ones(N)]), np.empty((4, N))
    p = np.repeat([[tension], [volume], [angle], [0.3]], N, axis=1)
    context = Context(H, 0.5, geometry.ctypes.data, None)
    kernel("cairn_law_capillary_energy", "cairn_law_energy")(N, 3, context, gap, u, np.zeros((3, N)), p, before, after, energy)
    end = np.maximum(gap + H * u[0], 0.0)
    was = np.array([work(d, r) for d, r in zip(begin, radius)]) * before[0]
    now = np.array([work(d, r) for d, r in zip(end, radius)])
    expected = [now * after[0], now * before[0] - was, np.zeros(N), now * before[0] - now * after[0]]
    np.testing.assert_allclose(energy, expected, rtol=1e-9, atol=1e-12 * np.abs(was).max())


def wet_contacts(c, n, coupled, scale=1.0):
    """Delassus blocks, free velocities, parameters and states of contacts in a liquid; the parts of some of them are coupled."""
    rng = np.random.default_rng(7)
    w = np.zeros((n, c, c))
    for i in range(n):
        w[i] = np.diag([rng.uniform(1, 2)] + (c - 1) * [rng.uniform(2, 4)])
        if coupled[i]:
            rows = rng.standard_normal((c, c))
            w[i] += 0.2 * rows @ rows.T
    q = rng.standard_normal((c, n)) * scale
    params = np.vstack([rng.uniform(0, 1, n) * scale / H, np.full(n, 1.0), rng.choice([0.0, 0.3, 1.5], n), np.full(n, H),
                        np.ones((3, n))])  # fmt: skip
    return w, q, params, rng.integers(0, 2, (1, n)).astype(float)


def solve_wet(w, q, params, state):
    """Impulses (c, n), and their residual by the natural map."""
    c, n = q.shape
    blocks = np.ascontiguousarray(w.transpose(2, 1, 0))
    r, f, weight, status = np.zeros((c, n)), np.empty((c, n)), np.empty((c, n)), np.empty(n, np.int32)
    kernel("cairn_law_wet_solve", "cairn_law_solve")(n, c, blocks, q, 0 * q, params, state, r, status)
    u = q + np.einsum("ikl,li->ki", w, r)
    rho = 1 / w[:, 0, 0]
    context = Context(H, 0.5, None, None)
    kernel("cairn_law_wet_residual", "cairn_law_residual")(
        n, c, context, rho, blocks, u, 0 * q, r, params, state, f, weight, status
    )
    return r, u, f


@pytest.mark.parametrize("c", [2, 3])
def test_wet_contacts_are_solved_side_by_side_as_alone(c):
    """Balls, whose blocks are diagonal, take a closed form in strips of eight. Each contact has the bits of one that is alone,
    meets its cone to rounding, and keeps them in units in which squares of impulses are no numbers any more."""
    n = 29
    for coupled in (np.zeros(n, bool), np.ones(n, bool), np.arange(n) % 5 == 2):
        w, q, params, state = wet_contacts(c, n, coupled)
        r, u, f = solve_wet(w, q, params, state)
        pull = params[0] * H * state[0]
        normal, tangent, slip = r[0] + pull, np.linalg.norm(r[1:], axis=0), np.linalg.norm(u[1:], axis=0)
        assert (normal >= -1e-15).all() and (u[0] >= -1e-13).all() and np.abs(normal * u[0]).max() < 1e-13
        assert (tangent <= params[2] * normal * (1 + 1e-14) + 1e-15).all()
        slides = slip > 1e-12
        along = np.sum(r[1:] * u[1:], axis=0)[slides]
        np.testing.assert_allclose(along, -(params[2] * normal * slip)[slides], rtol=1e-9, atol=1e-15)
        assert slides.any() and not slides.all() and (normal > 0).any() and not (normal > 0).all()
        assert np.abs(f).max() < 1e-13
        for i in range(n):
            alone, _, _ = solve_wet(w[i : i + 1], *(np.ascontiguousarray(x[:, i : i + 1]) for x in (q, params, state)))
            np.testing.assert_array_equal(alone[:, 0], r[:, i])
    small = 2.0**-700
    w, q, params, state = wet_contacts(c, n, np.zeros(n, bool), small)
    np.testing.assert_array_equal(solve_wet(w, q, params, state)[0] / small, solve_wet(*wet_contacts(c, n, np.zeros(n, bool)))[0])
