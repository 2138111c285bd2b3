"""The trade between speed and accuracy: made-up data with known answers, and small real studies that are cut and go on."""

import csv
import dataclasses
import os
import signal
import subprocess
import sys
import time

import cairn as cn
import h5py
import numpy as np
import pytest
from cairn import cli, study
from cairn.study import measures, store, tasks
from cairn.study.pool import Pool
from cairn.study.profiles import cheapest_costs, performance_profile
from cairn.study.recommend import recommend
from cairn.study.settings import Setting, scene_settings, scene_solvers

scipy = pytest.importorskip("scipy")

PILE = """
import cairn as cn

DT, PREPARE, DURATION = 2e-3, 0.1, 0.03


def build(disks=30, seed=1):
    radii = cn.pre.grains.uniform(disks, 0.08, 0.12, rng=seed)
    rock = cn.Material("rock", density=2000.0)
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.disks(cn.pre.deposit_disks(radii, 1.2), radii, rock))
    walls = cn.box((0, 0), (1.2, 9), rock, lid=False)
    scene.add(cn.wall((0, 0), (1, 0), rock, velocity=(0.5, 0.0)), walls[1:])  # pushes, so that no step is like the last
    scene.interact(rock, rock, cn.Coulomb(mu=0.4))
    return scene


def figure_top(sim):
    return sim.bodies.position[:, 1].max()
"""
SWEEP = {"solvers": ["NLGS"], "tolerances": (1e-1, 1e-3), "warm_start": (True,)}
FIGURES = ["solid_fraction", "top", "boundary_force", "energy"]
SMALL = {"sweep": SWEEP, "states": 2, "workers": 2, "progress": False}


@pytest.fixture
def pile(tmp_path):
    path = tmp_path / "pile.py"
    path.write_text(PILE)
    return path


def made_up(errors, *, floor=1e-6, target="a", figure="f", margin=1.2, cost=None, kind="statistics"):
    """Rows of a table: errors {(solver, tol): error}; cost: 1 / tol unless given {(solver, tol): seconds}."""
    rows = []
    for (solver, tol), error in errors.items():
        setting = Setting(solver, tol)
        seconds = 1e-3 / tol if cost is None else cost[solver, tol]
        rows.append({
            "target": target, "kind": kind, "figure": figure, "setting": setting.key(), **dataclasses.asdict(setting), "dt": 1e-3,
            "cpu_seconds": seconds, "runs": 8, "steps": 80, "not_converged": 0, "error": error, "upper": margin * error,
            "floor": floor,
        })
    return rows


# ------------------------------------------------------------------ statistics


def test_interval_is_students():
    values = np.array([4.1, 3.9, 4.4, 4.0, 3.6, 4.2, 4.3, 3.9])
    mean, half = measures.interval(values)
    assert mean == pytest.approx(4.05, rel=1e-14)
    assert half == pytest.approx(2.364624251592785 * values.std(ddof=1) / np.sqrt(8), rel=1e-12)  # t(0.975, 7) of tables


def test_intervals_hold_as_often_as_they_say():
    """Intervals of many synthetic sets of 8 paired runs: 95% of them contain the true difference."""
    rng, held, above = np.random.default_rng(3), 0, 0
    for _ in range(2000):
        reference = 5 + 0.1 * rng.standard_normal(8)
        values = 5.5 + 0.1 * rng.standard_normal(8)
        error, upper = measures.paired_error(dict(enumerate(values)), dict(enumerate(reference)), 1.0)
        held += error - (upper - error) <= 0.5 <= upper
        twin = 5 + 0.1 * rng.standard_normal(8)
        above += abs(twin.mean() - reference.mean()) > measures.noise_floor(reference, 1.0)
    assert abs(held / 2000 - 0.95) < 0.02
    assert above / 2000 < 0.08  # two sets that do the same differ by more than the floor rarely


def test_pairs_take_out_what_runs_have_in_common():
    rng = np.random.default_rng(4)
    common = rng.standard_normal(8)
    error, upper = measures.paired_error(dict(enumerate(common + 1e-3)), dict(enumerate(common)), 1.0)
    assert error == pytest.approx(1e-3, rel=1e-9) and upper == pytest.approx(1e-3, rel=1e-9)


def test_one_more_error_stays_below_its_bound():
    rng, held = np.random.default_rng(5), 0
    for _ in range(2000):
        errors = 10 ** (-3 + 0.3 * rng.standard_normal(5))
        held += errors[4] <= measures.upper_bound(errors[:4], 1e-12)
    assert abs(held / 2000 - 0.95) < 0.02
    assert measures.upper_bound([1e-9, 1e-9], 1e-4) == pytest.approx(1e-4)  # below the floor counts as the floor
    assert 1e-2 < measures.upper_bound([1e-15, 1e-2, 1e-2, 1e-2], 1e-15) < 0.2  # one that is exact makes the others no worse


# ------------------------------------------------------------------ profiles


def test_profile_by_hand():
    costs = {"a": [1.0, 2.0, np.inf, 4.0], "b": [2.0, 1.0, np.inf, np.inf], "c": [4.0, 2.0, np.inf, 2.0]}
    out = performance_profile(costs)
    assert [list(map(float, x)) for x in out["a"]] == [[1.0, 2.0], [0.25, 0.75]]
    assert [list(map(float, x)) for x in out["b"]] == [[1.0, 2.0], [0.25, 0.5]]
    assert [list(map(float, x)) for x in out["c"]] == [[1.0, 2.0, 4.0], [0.25, 0.5, 0.75]]
    with pytest.raises(ValueError, match="one length, not empty"):
        performance_profile({"a": []})
    with pytest.raises(ValueError, match="zero or negative"):
        performance_profile({"a": [0.0]})


def test_profile_takes_the_cheapest_setting_that_is_accurate():
    table = made_up({("X", 1e-1): 1e-1, ("X", 1e-2): 1e-2, ("X", 1e-3): 1e-3, ("Y", 1e-1): 5e-3}, target="a")
    table += made_up({("X", 1e-3): 2e-2, ("Y", 1e-1): 1e-1}, target="b")
    table += made_up({("X", 1e-3): 1e-3}, target="noisy", floor=0.5)
    costs, known = cheapest_costs(table, "f", 1e-2)
    assert known == ["a", "b"]
    assert costs["X"] == pytest.approx([1e-1, np.inf]) and costs["Y"] == pytest.approx([1e-2, np.inf])


# ------------------------------------------------------------------ recommendation


def test_recommends_the_cheapest_that_attains():
    table = made_up({(s, t): c * t for s, c in (("NLGS", 1.0), ("Other", 0.05)) for t in (1e-1, 1e-2, 1e-3, 1e-4)})
    found = recommend(table, 1e-2, "f", here=True)  # Other at 1e-1 errs by 5e-3, at most 6e-3
    assert found and found.setting == Setting("Other", 1e-1) and found.cpu_seconds == pytest.approx(1e-2)
    assert found.upper == pytest.approx(6e-3) and found.error == pytest.approx(5e-3)
    found = recommend(table, 5.5e-3, "f", here=True)  # 6e-3 may be the error: the margin forbids it, though 5e-3 was measured
    assert found.setting == Setting("Other", 1e-2)


def test_words_say_what_to_type():
    found = recommend(made_up({("NLGS", t): t for t in (1e-1, 1e-2, 1e-3)}), 5e-2, "f")
    assert found.line == "cn.NSCD(solver=cn.NLGS(tol=0.01, min_iter=1, max_iter=10000), warm_start=True)"
    assert found.line in found.words and "dt = 0.001 s for a" in found.words
    assert eval(found.line, {"cn": __import__("cairn")}).solver.tol == 0.01


def test_below_the_noise_floor_nothing_is_recommended():
    table = made_up({("NLGS", t): 1e-9 for t in (1e-1, 1e-3)}, floor=2e-3)
    found = recommend(table, 1e-3, "f")
    assert not found and found.setting is None and found.line == ""
    assert "noise floor of f is 0.002, above the accuracy asked for, 0.001" in found.words and "32 runs" in found.words
    assert found.next in found.words and "--runs 32" in found.next and "ask for 0.0021" in found.next
    assert recommend(table, 3e-3, "f", here=True)


def test_what_is_good_by_luck_is_not_taken():
    table = made_up({("NLGS", 1e-1): 1e-5, ("NLGS", 1e-2): 1e-2, ("NLGS", 1e-3): 1e-3})
    assert recommend(table, 5e-3, "f", here=True).setting.tol == 1e-3


def test_what_to_try_next_follows_from_what_was_measured():
    """Each cause has its option: tolerance, iterations, time step, runs, states, solver, scenes, --here."""
    def next_of(rows, accuracy, here=True, **changes):
        rows = [{**row, **changes} for row in rows]
        found = recommend(rows, accuracy, "f", here)
        assert not found and found.words.endswith(f"Next: {found.next}")
        return found.next

    falling = made_up({("NLGS", 1e-1): 0.3, ("NLGS", 1e-2): 0.03})  # in proportion: 0.03 * 1.2 at 1e-2, so 2.8e-4 for 1e-3
    assert "--tolerances 1e-04 1e-05" in next_of(falling, 1e-3)
    assert "--max-iter 100000" in next_of(falling, 1e-3, not_converged=1)
    flat = made_up({("NLGS", 1e-1): 0.03, ("NLGS", 1e-2): 0.03})
    assert "--dt-factors 0.5 0.25" in next_of(flat, 1e-3)
    assert "--solvers Auto" in next_of(flat, 1e-3, kind="step")
    wide = made_up({("NLGS", 1e-1): 0.3, ("NLGS", 1e-2): 5e-4}, margin=4)  # the mean is good, the interval three times as wide
    assert "--runs 72" in next_of(wide, 1e-3)
    assert "--states 16" in next_of(wide, 1e-3, kind="step")
    lucky = made_up({("NLGS", 1e-1): 1e-5, ("NLGS", 1e-2): 1e-2})
    assert "luck" in next_of(lucky, 1e-3) and "--max-iter" in next_of(lucky, 1e-3, not_converged=1)
    once = made_up({("NLGS", 1e-1): 0.3, ("NLGS", 1e-2): 7e-4})
    assert "or --here" in next_of(once, 1e-3, here=False) and "NLGS at tol = 0.01" in next_of(once, 1e-3, here=False)
    assert "--max-seconds" in next_of(made_up({("NLGS", 1e-1): np.nan}), 1e-3, stopped=1)
    unsure = made_up({("NLGS", 1e-1): 1e-9}, floor=1e-2, kind="step")
    assert "--duration" in next_of(unsure, 1e-3) and "reference_solver" in next_of(unsure, 1e-3, reference_not_converged=1,
                                                                                   reference_error=1e-3, reference_tol=1e-11,
                                                                                   reference_steps=3)
    known = [{**row, "figure": "g", "floor": 1e-9} for row in unsure]
    assert "--of g" in recommend(unsure + known, 1e-3, "f").next


def test_a_loose_reference_is_told_where_it_matters():
    loose = {"reference_tol": 1e-11, "reference_error": 2e-6, "reference_not_converged": 1, "reference_steps": 3}
    rows = [{**row, **loose} for row in made_up({("NLGS", t): t for t in (1e-1, 1e-2)}, kind="step")]
    told = "1 of 3 solves of the reference ended above its tolerance of 1e-11, the worst at 2e-06"
    assert told in recommend(rows, 5e-2, "f", here=True).words and told in recommend(rows, 1e-5, "f").words
    assert told == measures.loose_reference(rows)
    assert measures.loose_reference(made_up({("NLGS", 1e-1): 1e-3})) == ""


def test_nothing_attains():
    found = recommend(made_up({("NLGS", 1e-1): 0.3, ("NLGS", 1e-2): 0.03}), 1e-3, "f", here=True)
    assert not found and "no setting that was tried surely attains 0.001" in found.reason and "0.036" in found.reason
    with pytest.raises(ValueError, match="no figure 'height': it has f"):
        recommend(made_up({("NLGS", 1e-1): 0.3}), 1e-3, "height")


def test_several_targets_must_all_be_served():
    table = made_up({("NLGS", 1e-1): 1e-3, ("NLGS", 1e-2): 1e-4}, target="easy")
    table += made_up({("NLGS", 1e-1): 1e-1, ("NLGS", 1e-2): 2e-3}, target="hard")
    found = recommend(table, 1e-2, "f", here=True)
    assert found.setting.tol == 1e-2 and found.error == pytest.approx(2e-3) and set(found.dt) == {"easy", "hard"}
    missing = made_up({("NLGS", 1e-1): 1e-3}, target="easy") + made_up({("NLGS", 1e-2): 1e-3}, target="hard")
    assert "none was measured on every target" in recommend(missing, 1e-2, "f").reason


def test_margin_for_scenes_that_were_not_studied():
    """One scene: a factor of three. Several: synthetic families, of which a further scene stays within the recommendation."""
    errors = {("NLGS", t): t for t in (1e-1, 1e-2, 1e-3)}
    assert recommend(made_up(errors), 2e-2, "f", here=True).setting.tol == 1e-2
    assert recommend(made_up(errors), 2e-2, "f").setting.tol == 1e-3  # 3 * 1.2e-2 is too much
    rng, kept, count = np.random.default_rng(6), 0, 500
    for _ in range(count):
        harder = 10 ** (0.4 * rng.standard_normal(6))
        table = []
        for i, h in enumerate(harder[:5]):
            table += made_up({("NLGS", 10.0**-k): h * 10.0**-k for k in range(1, 6)}, target=str(i), margin=1)
        found = recommend(table, 1e-2, "f")
        kept += harder[5] * found.setting.tol <= 1e-2
    assert kept / count > 0.95 and "5 scenes differ" in found.words


def test_one_step_does_not_choose_the_time_step():
    rows = made_up({("NLGS", 1e-2): 1e-3}, kind="step")
    large = [{**row, "dt_factor": 4.0, "setting": "large", "cpu_seconds": row["cpu_seconds"] / 9} for row in rows]
    assert recommend(rows + large, 1e-2, "f").setting.dt_factor == 1.0


# ------------------------------------------------------------------ errors of one step


def test_errors_of_one_step_have_no_units():
    rng = np.random.default_rng(1)
    reference = {"velocity": rng.normal(size=(5, 2)), "momentum": rng.normal(size=(5, 2)), "mass": rng.uniform(1, 2, 5),
                 "force": rng.normal(size=(3, 2))}
    state = {**reference, "velocity": reference["velocity"] + 0.1 * reference["momentum"] / reference["mass"][:, None],
             "force": 1.01 * reference["force"]}
    errors = tasks.step_errors(state, reference)
    assert errors["step_velocity"] == pytest.approx(0.1, rel=1e-12)
    assert errors["step_boundary_force"] == pytest.approx(0.01, rel=1e-12)
    units = {"velocity": 2.0**5, "momentum": 2.0**12, "mass": 2.0**7, "force": 2.0**-9}
    scaled = [{name: value * units[name] for name, value in d.items()} for d in (state, reference)]
    assert tasks.step_errors(*scaled) == errors


def task_of(pile, folder, kind, **setting):
    """The first task of a kind of a study of the pile, with changes to its setting."""
    plan = study.study._planned(pile, folder, [], None, None, SWEEP, {"states": 2, "prepare": 0.05})[2]
    (folder / "states").mkdir(parents=True, exist_ok=True)
    task = next(task for task in plan.tasks() if task["kind"] == kind)
    return {**task, "setting": {**task["setting"], **setting}}


def test_reference_of_one_step_is_as_tight_as_asked_or_says_so(pile, tmp_path):
    tasks.run(task_of(pile, tmp_path, "prepare"))
    row = tasks.run(task_of(pile, tmp_path, "step_reference", solver="NLGS", max_iter=40))  # sweeps alone do not come there
    assert row["not_converged"] == 0 and row["error"] <= 1e-11
    row = tasks.run(task_of(pile, tmp_path, "step_reference", solver="NLGS", max_iter=1))  # nor does Newton's method in one
    assert row["not_converged"] == 3 and row["error"] > 1e-11
    assert row["step_velocity"] >= row["error"] and row["step_boundary_force"] >= row["error"]


def test_preparation_goes_on_where_it_was_stopped(pile, tmp_path, monkeypatch):
    calls = iter(range(100))

    def stopped(sim):
        if next(calls) == 14:
            raise KeyboardInterrupt
        return timed(sim)

    whole = task_of(pile, tmp_path / "whole", "prepare")
    wanted = tasks.run(whole)
    cut, timed = task_of(pile, tmp_path / "cut", "prepare"), tasks._timed
    monkeypatch.setattr(tasks, "KEPT_EVERY", 0.0)
    monkeypatch.setattr(tasks, "RUN_OVER_KEEPING", 0)
    monkeypatch.setattr(tasks, "_timed", stopped)
    with pytest.raises(KeyboardInterrupt):
        tasks.run(cut)
    monkeypatch.undo()
    tasks._targets.clear()
    kept = tasks.prepared(cut)
    assert kept["step"] == 14 and len(list((tmp_path / "cut" / "states").glob("*_step*.h5"))) == 1
    said = []
    study.run(pile, tmp_path / "cut", figures=[], say=said.append, duration=0.0, prepare=0.05, **SMALL)
    assert f"the preparation of pile.py goes on from step {kept['step']}" in said
    row = next(row for row in store.read_rows(tmp_path / "cut").values() if row["kind"] == "prepare")
    assert row["steps"] == wanted["steps"] and row["not_converged"] == wanted["not_converged"]
    for one, other in zip(whole["files"], cut["files"]):
        with h5py.File(one) as a, h5py.File(other) as b:
            assert a.attrs["checksum"] == b.attrs["checksum"]  # bits do not know that it was stopped
    assert not [f for f in (tmp_path / "cut" / "states").iterdir() if "_step" in f.name or f.suffix == ".json"]


@pytest.mark.parametrize("value", [float("nan"), 0.0])
def test_a_figure_without_errors_says_why(value, tmp_path):
    common = dict(target="a", kind="statistics", setting="s", tol=1e-4, error=1e-5, not_converged=0, steps=1, cpu_seconds=1.0)
    rows = [dict(common, role=role, seed=seed, f=value) for role in ("reference", "trial") for seed in range(3)]
    with pytest.raises(ValueError, match="figure 'f' has no relative errors, .* found (nan|0), .* finite and not zero"):
        study.Study(tmp_path, rows, ["f"]).recommend(1e-2, of="f")


# ------------------------------------------------------------------ real studies


def test_small_study_goes_from_end_to_end(pile, tmp_path, capsys):
    said = []
    s = study.run(pile, tmp_path / "out", figures=FIGURES, say=said.append, **SMALL)
    assert s.whole and said == ["31 of 31 measurements are to be made"]
    assert set(s.measured) == {"step_velocity", "step_boundary_force", "solid_fraction", "top", "boundary_force", "energy"}
    assert all(row["cpu_seconds"] > 0 and row["upper"] >= row["error"] >= 0 for row in s.table)
    runs = [row for row in s.rows if row["kind"] == "statistics"]
    assert len(runs) == 8 * 3 and len({row["seed"] for row in runs}) == 8
    reference = [row for row in runs if row["role"] == "reference"]
    assert {row["dt"] for row in reference} == {1e-3} and {row["tol"] for row in reference} == {1e-4}
    loose, tight = ([r for r in s.table if r["figure"] == "step_velocity" and r["tol"] == tol][0] for tol in (1e-1, 1e-3))
    assert tight["error"] < loose["error"] and tight["floor"] < 1e-6

    before = (tmp_path / "out" / "rows.csv").read_bytes()
    again = study.run(pile, tmp_path / "out", figures=FIGURES, say=said.append, **SMALL)  # nothing is computed
    assert said[-1].startswith("all ") and "nothing is computed" in said[-1]
    assert (tmp_path / "out" / "rows.csv").read_bytes() == before and again.table == s.table
    with h5py.File(tmp_path / "out" / "study.h5") as file:
        assert list(file["table/error"]) == [row["error"] for row in s.table]
        assert file["table/figure"].asstr()[0] == s.table[0]["figure"]
    with open(tmp_path / "out" / "table.csv") as file:
        assert [float(row["error"]) for row in csv.DictReader(file)] == [row["error"] for row in s.table]

    pytest.importorskip("matplotlib")
    s.plot("solid_fraction", tmp_path / "a.png", accuracy=1e-2)
    assert (tmp_path / "a.png").stat().st_size > 1000

    pile.write_text(PILE.replace("mu=0.4", "mu=0.5"))  # a changed scene starts anew, and says so
    changed = study.run(pile, tmp_path / "out", figures=FIGURES, say=said.append, **SMALL)
    assert any("pile.py has changed" in text and "starts anew" in text for text in said)
    assert not {row["key"] for row in changed.rows} & {row["key"] for row in s.rows}


def test_study_that_was_cut_goes_on(pile, tmp_path):
    """Ctrl-C in the middle, half a row at the end: the next call does the rest, and gives the same results as a single call."""
    folder = tmp_path / "cut"
    arguments = [sys.executable, "-m", "cairn.cli", "study", pile, "-o", folder, "-j", "1", "--tolerances", "1e-1", "1e-3",
                 "--solvers", "NLGS", "--warm-start", "on", "--states", "2", "--figure", "top"]
    hears = lambda: signal.signal(signal.SIGINT, signal.default_int_handler)  # in the background it is ignored
    process = subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, preexec_fn=hears)
    rows = folder / "rows.csv"
    end = time.monotonic() + 120
    while not rows.exists() or rows.read_bytes().count(b"\n") < 8:
        assert process.poll() is None and time.monotonic() < end, process.stdout.read()
        time.sleep(0.005)
    process.send_signal(signal.SIGINT)
    out = process.communicate(timeout=60)[0]
    assert process.returncode == 130 and "goes on from here" in out
    kept = rows.read_bytes()
    done = kept.count(b"\n") - 1
    assert kept.endswith(b"\n") and 7 <= done < 31
    with open(rows, "ab") as file:
        file.write(kept.splitlines()[-1][:40])  # as if the machine had stopped while a row was written
    ended = subprocess.run([*arguments, "--accuracy", "0.1", "--of", "top"], capture_output=True, text=True, timeout=300)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert f"{31 - done} of 31 measurements are to be made" in ended.stdout and "For top to 0.1: solver NLGS" in ended.stdout
    assert rows.read_bytes().startswith(kept)
    whole = study.run(pile, tmp_path / "whole", figures=["top"], say=lambda _: None, **SMALL)
    cut = store.read_rows(folder)
    assert set(cut) == {row["key"] for row in whole.rows}
    for row in whole.rows:
        for name in ("top", "step_velocity", "error", "iterations"):
            assert cut[row["key"]].get(name) == row.get(name), name  # bits do not know that it was cut


def test_study_of_problems(tmp_path, capsys):
    from cairn import problems
    from made_up_problems import random_problem

    for seed in (1, 2):
        problems.write(tmp_path / f"p{seed}.hdf5", random_problem(contacts=8, seed=seed))
    files = [str(tmp_path / f"p{seed}.hdf5") for seed in (1, 2)]
    arguments = ["study", *files, "--solvers", "nlgs", "--tolerances", "1e-2", "1e-6", "-o", str(tmp_path / "out"),
                 "--accuracy", "1e-4", "--of", "velocity", "--plot"]
    assert cli.main(arguments) == 0
    out = capsys.readouterr().out
    assert "cairn solve PROBLEM --solver nlgs --tol 1e-06" in out and (tmp_path / "out" / "profile_velocity.png").exists()
    with open(tmp_path / "out" / "table.csv") as file:
        table = list(csv.DictReader(file))
    assert len(table) == 8 and all(float(row["error"]) <= float(row["tol"]) for row in table if row["figure"] == "true_error")
    assert cli.main([*arguments[:-5], "--accuracy", "1e-15", "--of", "velocity"]) == 3
    assert "noise floor" in capsys.readouterr().out


def test_a_scene_that_fails_says_where(tmp_path):
    path = tmp_path / "bad.py"
    path.write_text(PILE + "\n\ndef figure_wrong(sim):\n    return sim.bodies.colour\n")
    with pytest.raises(study.TaskError, match="bad.py, statistics: AttributeError: bodies have no array 'colour'"):
        study.run(path, tmp_path / "out", figures=["wrong"], say=lambda _: None, **SMALL)


def test_a_worker_that_ends_before_it_reads_its_task():
    process = subprocess.Popen([sys.executable, "-c", ""], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    process.wait()
    process.stdin.write("a task")  # in the buffer of the pipe, which breaks when it is closed
    with Pool(1) as pool:
        pool._processes.append(process)
    assert process.stdin.closed and process.stdout.closed


def test_runs_that_take_too_long_are_told_and_not_recommended(pile, tmp_path):
    s = study.run(pile, tmp_path / "out", figures=["top"], say=lambda _: None, max_seconds=1e-9, one_step=False, **SMALL)
    runs = [row for row in s.rows if row["kind"] == "statistics"]
    assert all(row["stopped"] == (row["role"] == "trial") for row in runs)
    assert "none was measured on every target" in s.recommend(0.5, of="top").reason


def test_states_that_are_gone_are_made_again_only_where_needed(pile, tmp_path):
    import shutil

    said, call = [], {"figures": ["top"], "progress": False, "workers": 2, "states": 2, "duration": 0.0}
    study.run(pile, tmp_path / "out", say=said.append, sweep={**SWEEP, "tolerances": (1e-1,)}, **call)
    shutil.rmtree(tmp_path / "out" / "states")
    study.run(pile, tmp_path / "out", say=said.append, sweep={**SWEEP, "tolerances": (1e-1,)}, **call)
    assert "nothing is computed" in said[-1]
    study.run(pile, tmp_path / "out", say=said.append, sweep=SWEEP, **call)
    assert said[-1] == "5 of 7 measurements are to be made"  # states, two references, two steps


def test_what_is_wrong_is_said(pile, tmp_path, capsys):
    for words, more in (
        ("there is no figure 'colour': .*give one of solid_fraction", {"figures": ["colour"]}),
        ("runs is 3: give at least 8", {"runs": 3}),
        ("there is no solver 'Magic' of simulations: give one of", {"sweep": {"solvers": ["Magic"]}}),
        ("does not take the options", {"options": {"bricks": 3}}),
    ):
        with pytest.raises(ValueError, match=words):
            study.run(pile, tmp_path / "out", **more)
    with pytest.raises(ValueError, match="there is no such file"):
        study.run(tmp_path / "none.py")
    empty = tmp_path / "empty.py"
    empty.write_text("x = 1\n")
    with pytest.raises(ValueError, match="defines no build"):
        study.run(empty)
    assert cli.main(["study", str(pile), "--accuracy", "1e-2"]) == 1 and "go together" in capsys.readouterr().err
    assert cli.main(["study", str(pile), "--plan", "--solvers", "NLGS", "-o", str(tmp_path / "p")]) == 0
    assert "statistics               72, of which 72 are to be made" in capsys.readouterr().out


def test_two_studies_do_not_write_into_one_folder(tmp_path):
    from cairn import FileError

    with store.Store(tmp_path), pytest.raises(FileError, match="another study is writing there"):
        store.Store(tmp_path)


def test_registry_feeds_the_sweep():
    settings = scene_settings(tolerances=(1e-2,)).values()
    assert {s.solver for s in settings} == set(scene_solvers()) >= {"NLGS"}
    for s in settings:
        assert s.strategy().solver.tol == 1e-2 and s.strategy().threads == 1
    assert [s.solver for s in scene_settings(["nlgs"], (1e-2,)).values()] == ["NLGS", "NLGS"]


def test_import_of_cairn_does_not_pay_for_studies():
    code = "import sys, cairn; sys.exit(any(m.startswith(('cairn.study', 'matplotlib', 'scipy')) for m in sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], env=os.environ).returncode == 0
    code = "import cairn as cn; cn.study.run"
    assert subprocess.run([sys.executable, "-c", code], env=os.environ).returncode == 0


HOT = """
import cairn as cn
import numpy as np

DT, DURATION = 0.05, 1.0

def build():
    x = np.linspace(0, 1, 9)
    points = np.stack(np.meshgrid(x, [0.0, 0.1], indexing="ij"), -1).reshape(-1, 2)
    k = np.arange(len(points)).reshape(-1, 2)
    cells = np.stack([k[:-1, 0], k[1:, 0], k[1:, 1], k[:-1, 1]], -1)
    groups = {"left": k[0], "right": k[-1]}
    steel = cn.Material("steel", density=1000.0, conductivity=2e4, capacity=1.0, expansion=1e-5, young=1e9, poisson=0.0)
    body = cn.ElasticBody(points, {"quad": cells}, young=1e9, poisson=0.0, density=1000.0, groups=groups, rayleigh=(30.0, 0.0))
    scene = cn.Scene(2)
    scene.add(cn.deformable(body, steel, fixed={"left": "xy"}, name="bar"))
    scene.thermal(temperature={"bar.left": lambda t: 300.0 + 100.0 * t}, initial=300.0, reference=300.0, friction="none")
    return scene

def figure_tip(sim):
    return sim.meshes[0].displacement[-1, 0]
"""


def test_a_study_sweeps_networks_and_their_coupling(tmp_path):
    """A bar whose end is heated: mechanics with the temperatures of the last step lags by the growth in a step."""
    path = tmp_path / "bar.py"
    path.write_text(HOT)
    sweep = {
        "solvers": ["NLGS"], "tolerances": (1e-6,), "warm_start": (True,), "dt_factors": (1.0,),
        "network_tolerances": (1e-12, 1e-6), "couplings": ("staggered", "1e-8"),
    }  # fmt: skip
    found = study.run(str(path), tmp_path / "bar.study", figures=["tip"], sweep=sweep, one_step=False, workers=1, progress=False)
    rows = {(row["network_tol"], row["coupling"]): row for row in found.table if row["figure"] == "tip"}
    assert len(rows) == 4
    for tol in (1e-12, 1e-6):
        late, repeated = rows[tol, "staggered"], rows[tol, "1e-8"]
        ahead = repeated["value"] / late["value"] - 1  # of a ramp to 1 s, averaged over its second half
        assert ahead == pytest.approx(0.05 / 0.75, rel=0.1) and repeated["iterations"] >= late["iterations"]
    best = found.recommend(0.5, of="tip", here=True)
    assert "networks of the scene: tol=" in str(best) and "coupling=" in str(best)
    found.plot("tip", tmp_path / "tip.png")


def test_networks_that_are_none_are_told(tmp_path):
    with pytest.raises(ValueError, match="a network tolerance is 2"):
        scene_settings(["NLGS"], network_tolerances=(2.0,))
    with pytest.raises(ValueError, match="give 'staggered' or a number"):
        scene_settings(["NLGS"], couplings=("tight",))
    (setting,) = scene_settings(["NLGS"], (1e-2,), warm_start=(True,), couplings=("1e-4",)).values()
    with pytest.raises(ValueError, match="has no network"):
        setting.set_networks(cn.Scene(2))
    plain = scene_settings(["NLGS"], (1e-2,), warm_start=(True,))
    assert not {"network_tol", "coupling"} & next(iter(plain.values())).as_row().keys()
