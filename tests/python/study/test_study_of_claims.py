"""A study of what steps tell of their own errors: accuracy= and time_error() against the truth."""

import csv
import math
from pathlib import Path

import cairn as cn
import numpy as np
import pytest
from cairn import cli, study
from cairn.study import claims
from cairn.study.settings import scene_settings
from cairn.study.targets import Target
from test_study import PILE

pytest.importorskip("scipy")


@pytest.fixture
def pile(tmp_path):
    path = tmp_path / "pile.py"
    path.write_text(PILE)
    return path


def speed_of(sim, velocity):
    mass, moves = np.ravel(sim.bodies.mass), np.isfinite(np.ravel(sim.bodies.mass))
    inertia = np.ravel(sim.bodies.inertia)
    return math.sqrt(np.sum((mass[:, None] * velocity[:, :2] ** 2)[moves]) + np.sum((inertia * velocity[:, 2] ** 2)[moves]))


@pytest.mark.filterwarnings("ignore:invalid value")
def test_what_steps_tell_is_set_against_the_truth(pile, tmp_path):
    sweep = {"solvers": ["NLGS"], "tolerances": (1e-3,), "warm_start": (True,), "accuracies": (0.0, 1e-2, 1e-5),
             "accelerations": ("nesterov", "none")}  # fmt: skip
    s = study.run(pile, tmp_path / "out", sweep=sweep, states=2, duration=0.0, in_time=True, workers=1, progress=False)
    assert len(s.claims) == 6 and {row.get("acceleration") for row in s.claims} == {"nesterov", "none"}
    for row in s.claims:
        assert row["steps"] == row["converged"] == 2
        if "accuracy" in row:
            assert row["held"] == 2 and row["velocity_true_largest"] <= row["accuracy"]
            assert 0 < row["velocity_told_largest"] <= row["accuracy"]
        else:
            assert "velocity_told_median" not in row  # it is asked for by accuracy= alone
        assert 0.3 < row["time_velocity_told_over_true"] < 3
    plain, extrapolated = ({row["solver"]: row["iterations"] for row in s.claims if row["acceleration"] == a}
                           for a in ("none", "nesterov"))  # fmt: skip
    assert plain != extrapolated
    assert "held it" in str(s) and "in time told" in str(s)
    with open(tmp_path / "out" / "claims.csv", newline="") as file:
        assert len(list(csv.DictReader(file))) == 6

    row = next(row for row in s.rows if row.get("accuracy") == 1e-2 and row["kind"] == "step" and row["role"] == "trial")
    state = sorted(Path(tmp_path / "out" / "states").glob(f"*_{row['state']}.h5"))[0]
    sim, found = Target(pile, {}, None).simulation(), {}
    loose = cn.NLGS(tol=1e-3, max_iter=10_000, acceleration=row["acceleration"])
    tight = cn.Auto(tol=1e-13, max_iter=100_000)
    for name, strategy in (("told", cn.NSCD(solver=loose, accuracy=1e-2)), ("true", cn.NSCD(solver=tight))):
        sim.restore(state)
        sim.strategy = strategy
        info = sim.step()
        found[name] = np.array(sim.bodies.velocity), info
    error = speed_of(sim, found["told"][0] - found["true"][0])
    moves = np.isfinite(np.ravel(sim.bodies.mass))
    scale = max(speed_of(sim, found["true"][0]), 2e-3 * 9.81 * math.sqrt(np.sum(np.ravel(sim.bodies.mass)[moves])))
    assert row["velocity_told"] == pytest.approx(found["told"][1]["velocity_error"], rel=1e-6)
    assert row["velocity_true"] == pytest.approx(error / scale, rel=1e-3, abs=1e-9)


def test_a_claim_that_does_not_hold_is_counted():
    rows = [{"target": "a", "kind": "step", "role": "trial", "setting": "s", "solver": "NLGS", "tol": 1e-4, "accuracy": 1e-3,
             "not_converged": failed, "iterations": 10, "velocity_told": told, "velocity_true": true}
            for failed, told, true in ((0, 5e-4, 1e-4), (0, 5e-4, 2e-3), (1, 5e-3, 4e-3))]  # fmt: skip
    (row,) = claims.table(rows)
    assert (row["steps"], row["converged"], row["held"]) == (3, 2, 1)
    assert row["velocity_true_median"] == 2e-3 and row["velocity_told_largest"] == 5e-3
    assert "2 of 3 steps converged, of which 1 held it" in claims.said([row])[1]


def test_settings_have_what_solvers_know():
    settings = list(scene_settings(["NLGS", "PPANewton"], (1e-3,), warm_start=(True,), accuracies=(0.0, 1e-3),
                                   accelerations=("nesterov", "none")).values())  # fmt: skip
    assert sum(s.solver == "NLGS" for s in settings) == 4 and sum(s.solver == "PPANewton" for s in settings) == 1
    exact = next(s for s in settings if s.accuracy and s.acceleration == "none")
    assert exact.strategy().accuracy == 1e-3 and exact.strategy().solver.acceleration == "none"
    assert "acceleration='none'" in exact.line() and "accuracy=0.001" in exact.line()
    assert eval(exact.line(), {"cn": cn}).accuracy == 1e-3
    with pytest.raises(ValueError, match="accuracy"):
        scene_settings(["NLGS"], accuracies=(2.0,))
    with pytest.raises(ValueError, match="acceleration"):
        scene_settings(["NLGS"], accelerations=("fast",))


def test_the_shell_asks_for_it(pile, tmp_path, capsys):
    call = ["study", str(pile), "-o", str(tmp_path / "out"), "--duration", "0", "--states", "1", "--solvers", "NLGS"]
    call += ["--tolerances", "1e-3", "--warm-start", "on", "--accuracies", "1e-2", "--accelerations", "none", "--in-time"]
    call += ["-q", "-j", "1"]
    assert cli.main(call) == 0
    assert "NLGS none, accuracy 0.01: 1 of 1 steps converged, of which 1 held it" in capsys.readouterr().out
