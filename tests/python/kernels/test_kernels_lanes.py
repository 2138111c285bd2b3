"""Laws of smooth contacts take lanes at once: each contact gives the bits that it gives alone."""

import numpy as np
import pytest
from kernels import Context, kernel

RNG = np.random.default_rng(24)
N, H = 16, 1e-3


def some(*shape):
    return RNG.standard_normal(shape)


def positive(*shape):
    return RNG.uniform(0.5, 2.0, shape)


def granular(model, work, slip, roll, twist, limited):
    return [model, 900.0, 0.25, work, 1, 0.7, slip, 0.3, 0.4, roll, 0.1, 2.25, 0.2, twist, 0.05, limited, -1.0]


ALONE = {
    "jkr": ("jkr", [900.0, 0.5, 0.25, 0.7, 0.3], 3, 3),
    "hooke": ("granular_contact", granular(0, 0.0, 1, 2, 1, 0), 6, 10),
    "hertz": ("granular_contact", granular(1, 0.0, 3, 0, 0, 1), 6, 10),
    "dmt": ("granular_contact", granular(2, 0.5, 2, 1, 2, 0), 6, 10),
    "granular_jkr": ("granular_contact", granular(3, 0.5, 2, 2, 2, 0), 6, 10),
}


@pytest.mark.parametrize("name", ALONE)
def test_a_contact_does_not_depend_on_those_beside_it(name):
    """Lanes that take more steps of Newton's method than others, that tear or begin: the bits of each are those alone, and forces
    do not depend on whether energies are asked for."""
    law, p, c, columns = ALONE[name]
    gap, u, geometry = -(10.0 ** RNG.uniform(-9, -0.5, N)), 0.1 * some(c, N), positive(3, N)
    gap[:4] = [0.002, -0.0, 0.3, 1e-9]
    first = 1e-3 * some(columns, N)
    first[0] = RNG.integers(0, 2, N)

    def called(pick, counts=True):
        state, f = np.ascontiguousarray(first[:, pick]), np.empty((c, N))
        energy, shape = np.empty((4, N)) if counts else None, np.ascontiguousarray(geometry[:, pick])
        context = Context(H, 0.5, shape.ctypes.data, None)
        rates = np.ascontiguousarray(u[:, pick])
        kernel(f"cairn_law_{law}_force", "cairn_law_force")(N, c, context, gap[pick].copy(), rates, np.array(p), state, f, energy)
        return f, state, energy

    together, quiet = called(np.arange(N)), called(np.arange(N), counts=False)
    assert all(np.isfinite(x).all() for x in together)
    assert np.array_equal(together[0], quiet[0]) and np.array_equal(together[1], quiet[1])
    for i in range(N):
        for one, two in zip(together, called(np.full(N, i))):
            assert np.array_equal(one[:, i], two[:, 0])
