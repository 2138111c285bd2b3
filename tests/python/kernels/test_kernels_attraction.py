"""Kernels of laws that attract, against integrals of their force."""

import numpy as np
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
