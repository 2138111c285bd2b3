"""The small forms of benchmarks/users_scenes.py: every step converges at default settings, and the figures are right."""

import importlib.util
from pathlib import Path

import pytest

PATH = Path(__file__).resolve().parents[3] / "benchmarks" / "users_scenes.py"
pytestmark = pytest.mark.skipif(not PATH.exists(), reason="benchmarks are not there")


@pytest.fixture(scope="module")
def scenes():
    spec = importlib.util.spec_from_file_location("users_scenes", PATH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.filterwarnings("ignore::cairn.OverlapWarning")
@pytest.mark.parametrize("name", ["box", "slope", "wall", "vault", "arch"])
def test_small_scenes_converge_and_are_right(scenes, name):
    """At least 99 % of the steps. Statics and limit analysis within 5 %."""
    row = scenes.run(name)
    assert row["converged"] >= 0.99 * row["steps"]
    assert float(row["worst_error"]) <= 1e-3 or row["converged"] < row["steps"]
    value = float(row["value"])
    if name == "slope":
        assert float(row["largest_overlap"]) < 0.03
    elif name == "arch":  # bonds of mortar carry a little moment
        assert value == pytest.approx(float(row["right"]), rel=0.15)
    elif name != "box":  # grains that still roll press by more or less than their weight
        assert value == pytest.approx(float(row["right"]), rel=0.05)
