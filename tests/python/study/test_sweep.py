"""Parameter studies: plans, tables, failures, and going on."""

import csv

import pytest
from cairn import cli
from cairn.study import sweep as sweeps

SCRIPT = """
import os, pathlib
def run(p):
    with open(pathlib.Path(__file__).with_name("calls"), "a") as file:
        file.write(f"{p['mu']}\\n")
    if p["mu"] == 0.3 and not pathlib.Path(__file__).with_name("mended").exists():
        raise ValueError("no heap stands\\nat this friction")
    return {"slope": 2 * p["mu"] + p.get("radius", 0), "kind": "heap"}
"""


@pytest.fixture
def study(tmp_path):
    (tmp_path / "heap.py").write_text(SCRIPT)
    path = tmp_path / "study.toml"
    path.write_text('script = "heap.py"\n[parameters]\nmu = [0.1, 0.3, 0.5]\nshape = ["round", "square"]\n')
    return path


def rows(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def test_a_grid_runs_once_and_goes_on_after_what_failed(study, capsys):
    assert cli.main(["sweep", str(study), "-j", "2", "-q"]) == 3
    table = study.with_suffix("") / "results.csv"
    found = rows(table)
    assert len(found) == 6 and {r["mu"] for r in found if r["failed"]} == {"0.3"}
    assert all(r["failed"] == "ValueError: no heap stands at this friction" for r in found if r["mu"] == "0.3")
    assert all(float(r["slope"]) == 2 * float(r["mu"]) for r in found if r["mu"] != "0.3")
    study.with_name("mended").touch()
    assert cli.main(["sweep", str(study), "-j", "1", "-q"]) == 0
    assert len(study.with_name("calls").read_text().split()) == 6 + 2  # only failed points are run again
    assert len(rows(table)) == 6 and not any(r["failed"] for r in rows(table))
    study.with_name("heap.py").write_text(SCRIPT.replace("2 *", "3 *"))  # another script: its results are others
    assert cli.main(["sweep", str(study), "-j", "1", "-q"]) == 0
    assert len(rows(table)) == 6 and all(float(r["slope"]) == 3 * float(r["mu"]) for r in rows(table))


def test_a_hypercube_meets_each_part_of_each_range_once(study):
    study.write_text(
        'script = "heap.py"\nsamples = 16\nseed = 3\n[parameters]\nmu = [0.1, 0.5]\n'
        "radius = { low = 1e-3, high = 10.0, log = true }\n"
    )
    points = sweeps.read(study).points
    import math

    parts = sorted(int(16 * (math.log10(p["radius"]) + 3) / 4) for p in points)
    assert parts == list(range(16)) and [p["mu"] for p in points].count(0.1) == 8
    assert points == sweeps.read(study).points


@pytest.mark.parametrize(
    "text, told",
    (
        ("", "script is missing"),
        ('script = "heap.py"', "[parameters] is missing"),
        ('script = "none.py"\n[parameters]\nmu = [1]', "no such script"),
        ('script = "heap.py"\nsample = 3\n[parameters]\nmu = [1]', "there is no entry 'sample'"),
        ('script = "heap.py"\nsamples = 0\n[parameters]\nmu = [1]', "samples is 0"),
        ('script = "heap.py"\n[parameters]\nmu = []', "parameter 'mu' is []"),
        ('script = "heap.py"\n[parameters]\nmu = [nan]', "not finite"),
        ('script = "heap.py"\n[parameters]\nmu = 3', "give a list of values, or a range"),
        ('script = "heap.py"\n[parameters]\nmu = { low = 1, high = 2 }', "say how many points to draw"),
        ('script = "heap.py"\nsamples = 4\n[parameters]\nmu = { low = 2, high = 1 }', "low must be the smaller"),
        ('script = "heap.py"\nsamples = 4\n[parameters]\nmu = { low = 0, high = 1, log = true }', "needs a low above 0"),
        ('script = "heap.py"\nsamples = 4\n[parameters]\nmu = { low = 0, hi = 1 }', "has no 'hi'"),
        ('script = "heap.py"\n[parameters]\nfailed = [1]', "bears the name of a column"),
        ("script = ", "this is no TOML"),
    ),
)
def test_a_study_that_is_wrong_says_where(study, capsys, text, told):
    study.write_text(text)
    assert cli.main(["sweep", str(study), "--plan"]) == 1
    assert told in capsys.readouterr().err


def test_a_script_that_returns_no_numbers_fails_by_name(study):
    for script, told in (
        ("x = 1", "no function run"),
        ("def run(p): return 3", "return a dict"),
        ("def run(p): return {'mu': 1}", "is a parameter"),
        ("def run(p): return {'a': None}", "TypeError"),
        ("import os\ndef run(p): os._exit(9)", "the process ended"),
    ):
        study.with_name("heap.py").write_text(script)
        study.write_text('script = "heap.py"\n[parameters]\nmu = [0.1]\n')
        assert told in rows(sweeps.sweep(study, processes=1))[0]["failed"]


def test_a_point_that_ends_its_process_fails_alone(study):
    study.with_name("heap.py").write_text("import os\ndef run(p):\n    return {'a': 1} if p['mu'] > 1 else os._exit(9)")
    study.write_text('script = "heap.py"\n[parameters]\nmu = [1, 2, 3, 4, 5, 6]\n')
    found = sorted(rows(sweeps.sweep(study, processes=2)), key=lambda r: r["mu"])
    assert [bool(r["failed"]) for r in found] == [True] + 5 * [False]
