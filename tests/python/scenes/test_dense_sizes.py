"""benchmarks/dense_sizes.py at 200 and 400 grains: copies of a pack are the pack again, and are sheared as it is."""

import importlib
import sys
from pathlib import Path

import cairn as cn
import numpy as np
import pytest

FOLDER = Path(__file__).resolve().parents[3] / "benchmarks"
pytestmark = [
    pytest.mark.skipif(not FOLDER.exists(), reason="benchmarks are not there"),
    pytest.mark.filterwarnings("ignore::cairn.EnergyCreatedWarning"),
]


@pytest.fixture(scope="module")
def sizes():
    """The module, which imports another one of its folder."""
    sys.path.insert(0, str(FOLDER))
    try:
        yield importlib.import_module("dense_sizes")
    finally:
        sys.path.remove(str(FOLDER))


@pytest.fixture(scope="module")
def pack(sizes):
    return sizes.packed(200)


@pytest.fixture(scope="module")
def ready(sizes, pack):
    """The pack after some steps of shear, in a cell that leans."""
    sim = sizes.sheared(pack, cn.Coulomb(mu=sizes.FRICTION), 30)
    assert sim.cell["vectors"][2, 0] != 0
    return sim


def test_one_copy_that_is_not_moved_is_the_pack(sizes, ready):
    """Places, velocities and the cell, to the bit."""
    copy = sizes.tiled(ready, cn.Coulomb(mu=sizes.FRICTION), 1, moved=0.0)
    assert np.array_equal(copy.cell["vectors"], ready.cell["vectors"])
    for name in ("position", "velocity", "radius", "mass"):
        assert np.array_equal(copy.bodies[name], ready.bodies[name]), name


@pytest.mark.parametrize("copies", [2, 20])
def test_copies_that_are_not_moved_have_the_contacts_of_the_pack(sizes, ready, copies):
    """Copies along x and y fit only by the vectors of the cell: then all contacts and gaps are there again."""
    found = []
    for count in (1, copies):
        sim = sizes.tiled(ready, cn.Coulomb(mu=sizes.FRICTION), count, moved=0.0)
        sim.strategy = cn.NSCD(solver=cn.NLGS(max_iter=1))
        sim.step()
        found.append(np.sort(sim.contacts.gap))
    assert len(found[1]) == copies * len(found[0]) > 0
    assert np.allclose(found[1], np.repeat(found[0], copies), rtol=0, atol=1e-9 * sizes.DIAMETER)


def test_rows_of_200_and_400_grains(sizes, pack):
    """Both laws at both sizes: steps converge once contacts have impulses, under the pressure that is asked."""
    rows = list(sizes.rows(pack, {1: 10, 2: 10}, before=30))
    assert [(row["law"], row["bodies"]) for row in rows] == [("Coulomb", 200), ("Coulomb", 400), ("wet", 200), ("wet", 400)]
    for row, other in zip(rows[::2], rows[1::2], strict=True):
        assert row["sweeps_ratio"] == "1.00" and row["pressure"] == row["pressure_of_smallest"]
        assert other["contacts"] == pytest.approx(2 * row["contacts"], rel=0.02)
        assert float(other["bytes_a_body"]) == pytest.approx(float(row["bytes_a_body"]), rel=0.2)
    for row in rows:
        assert float(row["converged"]) >= 0.9
        assert float(row["largest_error"]) <= 1e-3 or row["converged"] != "1.000"
        assert float(row["pressure"]) == pytest.approx(1, abs=0.1)
        assert 0.1 < float(row["shear_over_pressure"]) < 1
        assert float(row["overlap"]) < 0.02
