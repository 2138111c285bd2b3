"""Made-up runs for the tests of files: every value follows from the number of the output."""

import numpy as np


def bodies(k, n=20, dim=2):
    rng = np.random.default_rng(k)
    return {
        "position": rng.random((n, dim)),
        "velocity": rng.standard_normal((n, 3 * dim - 3)),
        "rotation": rng.random(n) if dim == 2 else rng.random((n, 4)),
        "radius": np.linspace(0.01, 0.05, n),
        "material": np.arange(n) % 3,
        "id": np.arange(n)[::-1] * 2,
    }


def contacts(k, m=None, n=20, dim=2):
    rng = np.random.default_rng(1000 + k)
    m = (k * 7) % 11 if m is None else m
    normal = rng.standard_normal((m, dim))
    return {
        "point": rng.random((m, dim)),
        "normal": normal / np.linalg.norm(normal, axis=1, keepdims=True),
        "gap": rng.standard_normal(m),
        "impulse": rng.standard_normal((m, dim)),
        "status": rng.integers(0, 3, m),
        "body_a": rng.integers(0, n, m) * 2,
        "body_b": rng.integers(0, n, m) * 2,
    }


def info(k):
    return {
        "contacts": (k * 7) % 11,
        "iterations": 10 + k,
        "error": 2.0**-k,
        "status": "converged",
        "energy": {"kinetic": 1.0 / (k + 1), "potential": float(k)},
    }


def write(path, outputs, dim=2, flush=True, after=None, **options):
    """A run of so many outputs; `after(k)` is called when output k has been flushed."""
    from cairn.files.writer import RunWriter

    writer = RunWriter(path, {"name": "made up", "materials": ["rock", "sand", "clay"]}, {"version": "1"}, dim, **options)
    for k in range(outputs):
        writer.write_step(0.1 * k, 0.1 * k - 0.05, k, bodies(k, dim=dim), contacts(k, dim=dim), info(k))
        if flush:
            writer.flush()
        if after:
            after(k)
    return writer


def check_step(step, k, dim=2):
    """Every array of output k, to the bit."""
    for fields, made in ((step.bodies, bodies(k, dim=dim)), (step.contacts, contacts(k, dim=dim))):
        for name, value in made.items():
            assert np.array_equal(fields[name], value), (k, name)
    assert step.step == k and step.time == 0.1 * k and step.time_detection == 0.1 * k - 0.05
