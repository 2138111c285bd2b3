"""Conductances of contacts against their formulas, written anew from their sources with numbers and loops."""

import numpy as np
import pytest
from conductances import FORMULAS, ROWS, N, contacts, found
from kernels import kernel

RNG = np.random.default_rng(23)
CLOSE = dict(rtol=1e-12, atol=0)


def test_every_conductance_has_a_formula():
    assert set(ROWS) == {*FORMULAS, "given_table"}


@pytest.mark.parametrize("name", FORMULAS)
def test_conductances(name):
    c = contacts()
    params, formula = FORMULAS[name]
    each = [{column: float(values[i]) for column, values in c.items()} for i in range(N)]
    for changed in {tuple(params), tuple(p if k in (0, 1) else p or 0.8 for k, p in enumerate(params))}:
        np.testing.assert_allclose(found(name, c, changed), [formula(one, *changed) for one in each], **CLOSE)


def test_a_table_of_pressures_and_gaps():
    """np.interp along one axis after the other; constant beyond the ends."""
    c = contacts()
    pressures, gaps = np.array([0.2, 0.6, 1.5]), np.array([0.0, 0.1, 0.15, 0.3])
    h = RNG.uniform(1, 2, (len(gaps), len(pressures)))
    pressure = np.maximum(c["force"], 0) / c["area"]
    expected = [a * np.interp(g, gaps, [np.interp(p, pressures, row) for row in h])
                for a, g, p in zip(c["area"], c["gap"], pressure)]  # fmt: skip
    values = [len(pressures), len(gaps), 0.0, *pressures, *gaps, *h.ravel()]
    np.testing.assert_allclose(found("given_table", c, values), expected, **CLOSE)


def test_films():
    clean, broken, out = RNG.uniform(0.5, 2, N), (RNG.random(N) < 0.5).astype(np.int8), np.empty(N)
    clean[3] = 0.0
    broken[3] = 0
    for film in (0.0, 0.4):
        kernel("cairn_film_conductance")(N, film, clean, broken, out)
        through = [c if b else (0.0 if c * film == 0 else c * film / (c + film)) for c, b in zip(clean, broken)]
        np.testing.assert_allclose(out, through, **CLOSE)
    radius, force, current = RNG.uniform(0.5, 2, N), RNG.uniform(-0.5, 2, N), RNG.uniform(0, 3, N)
    switched, before = np.empty(1, np.int64), broken.copy()
    kernel("cairn_film_break")(N, 0.3, 0.8, radius, force, clean, current, broken, switched)
    heat = np.divide(current**2, clean, out=np.zeros(N), where=clean > 0)
    goes = (before == 0) & (clean > 0) & (heat >= 0.3 + 0.8 * radius * np.maximum(force, 0))
    assert 0 < goes.sum() < (before == 0).sum()
    assert np.array_equal(broken != before, goes) and switched[0] == goes.sum()
