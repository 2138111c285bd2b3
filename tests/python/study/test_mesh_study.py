"""The scripts of benchmarks/study that sweep mesh, step, integrator and tolerance: a point of each."""

import runpy
from pathlib import Path

import pytest

STUDY = Path(__file__).resolve().parents[3] / "benchmarks" / "study"


def test_finer_is_nearer_in_an_impact():
    run = runpy.run_path(str(STUDY / "impact.py"))["run"]
    at = {"courant": 0.5, "tol": 1e-8, "integrator": "central differences"}
    errors = [run({**at, "cells": cells})["error"] for cells in (10, 40)]
    assert errors[1] < 0.4 * errors[0] < 0.02
    half = [run({**at, "cells": 20, "integrator": name})["error"] for name in ("theta 1/2", "HHT -0.1", "generalised alpha 0.8")]
    assert half[1:] == pytest.approx(2 * [half[0]], rel=0.03)  # a jump of velocity acts for half of the step in all of them
    assert run({**at, "cells": 20, "courant": 1.0, "integrator": "central differences"})["error"] < 1e-11


def test_finer_is_softer_in_a_forming():
    run = runpy.run_path(str(STUDY / "forming.py"))["run"]
    found = [run({"cells": cells, "steps": 10, "theta": 1.0, "tol": 1e-6}) for cells in (2, 4)]
    assert found[1]["work"] < found[0]["work"] and found[0]["bulge"] == pytest.approx(0.28, abs=0.01)
    assert all(one["passes"] >= 10 for one in found)
