"""Calls of runs, from Python and from the shell: refusals, ends by signals, messages."""

import contextlib
import os
import re
import signal
import subprocess
import sys

import cairn as cn
import numpy as np
import pytest
from cairn import cli
from small_scenes import heap

SCRIPT = """
import sys
import cairn as cn

rock = cn.Material("rock", density=2800.0)
scene = cn.Scene(2, gravity=(0, -9.81))
scene.add(cn.disks([[0, 0.5]], 0.5, rock), cn.wall((0, 0), (0, 1), rock))
scene.interact(rock, rock, cn.Coulomb(mu=0.4))
sim = cn.Simulation(scene, dt=1e-3)
how, path = sys.argv[1:3]


def told(sim):
    if sim.steps == 20:
        print("20", flush=True)


if how == "runs":
    sim.run(steps=10**9, output=path, every=10**6, callback=told)
    print("after", flush=True)
    sim.run(steps=1)
    print("never", flush=True)
elif how == "steps":
    while True:
        sim.step()
        told(sim)
elif how == "twice":
    sim.run(steps=1, output=path)
elif how == "own":
    {}["x"]
sim.run(steps=1, output=path)
"""


def sim():
    return cn.Simulation(heap(), 1e-3, overlap="ignore")


@pytest.fixture
def script(tmp_path):
    path = tmp_path / "pile.py"
    path.write_text(SCRIPT)
    return path


def call(capsys, *arguments):
    status = cli.main([str(a) for a in arguments])
    captured = capsys.readouterr()
    return status, captured.out, captured.err


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"until": -1}, "until is -1: the simulation is at 0 s already; give a later time"),
        ({"until": True}, "until is True: give a finite number"),
        ({"steps": 1, "every": 2**70}, "every is 1180591620717411303424: give a whole number from 1 to"),
        ({"steps": 1, "callback": 5}, "callback is 5: give a function"),
        ({"steps": 1, "probes": [1]}, r"probes is \[1\]: give {name: function}"),
        ({"steps": 1, "probes": {"p": 1}}, r"probes is {'p': 1}: give {name: function}"),
    ],
)
def test_refused_before_a_step(options, words):
    s = sim()
    with pytest.raises(ValueError, match=words):
        s.run(**options)
    assert s.steps == 0


def test_a_time_that_is_reached_takes_no_step():
    s = sim()
    s.run(until=0.005)
    assert s.steps == 5 and s.run(until=0.005) == 0 and s.run(until=0.005 - 1e-12) == 0
    with pytest.raises(ValueError, match="until is 0.004: the simulation is at 0.005 s already"):
        s.run(until=0.004)


def test_names_of_runs(tmp_path):
    s = sim()
    for name, words in (("a.vtk", "this name ends in .vtk"), ("a.csv", "ends in .csv"), ("a", "has no ending")):
        with pytest.raises(cn.FileError, match=f"{words}; give a name that ends in .vtkhdf"):
            s.run(steps=1, output=tmp_path / name)
    with pytest.raises(cn.FileError, match="a checkpoint is an HDF5 file, and this name ends in .vtk; give a name that ends"):
        s.checkpoint(tmp_path / "a.vtk")
    with pytest.raises(cn.FileError, match="a scene is an HDF5 file, and this name ends in .stl; give a name that ends in .h5"):
        s.scene.save(tmp_path / "a.stl")
    assert s.steps == 0 and not list(tmp_path.iterdir())


def test_probes_give_numbers(tmp_path):
    for probe, words in (
        (lambda s: s.bodies.position[0], r"probe 'p' gave an array of shape \(2,\): a probe gives one real number"),
        (lambda s: None, "probe 'p' gave None: a probe gives one real number"),
        (lambda s: 1j, "probe 'p' gave 1j: a probe gives one real number"),
    ):
        with pytest.raises(ValueError, match=words):
            sim().run(steps=1, output=tmp_path / "a.vtkhdf", probes={"p": probe}, overwrite=True)
    sim().run(steps=1, output=tmp_path / "a.vtkhdf", probes={"p": lambda s: np.float32(2), "n": lambda s: np.nan}, overwrite=True)
    with cn.load(tmp_path / "a.vtkhdf") as run:
        assert run.history["p"] == [2.0] and np.isnan(run.history["n"][0])


# ---------------------------------------------------------------------- from the shell


def test_a_script_that_overwrites(script, tmp_path, capsys):
    path = tmp_path / "a.vtkhdf"
    assert call(capsys, "run", script, "once", path)[0] == 0
    status, _, err = call(capsys, "run", script, "once", path)
    assert status == 1 and err.count("\n") == 1
    assert err.startswith(f"cairn: error: {script}, line ") and "exists already" in err and "--overwrite" in err
    assert call(capsys, "run", script, "once", path, "--overwrite")[0] == 0
    assert call(capsys, "run", "--overwrite", script, "once", path)[0] == 0
    status, _, err = call(capsys, "run", script, "twice", path, "--overwrite")
    assert status == 1 and "exists already" in err  # what this script wrote itself
    script.write_text("import sys\nprint(sys.argv[1:])\n")
    out = call(capsys, "run", script, "a", "--overwrite", "--", "--overwrite", "--", "b")[1]
    assert out == "['a', '--overwrite', '--', 'b']\n"


def test_errors_of_cairn_take_a_line_and_those_of_a_script_are_shown(script, tmp_path, capsys):
    script.write_text("import cairn as cn\n\n\ndef make():\n    return cn.NSCD(tehta=1)\n\n\nmake()\n")
    status, _, err = call(capsys, "run", script)
    assert status == 1 and err.count("\n") == 1
    assert err.startswith(f"cairn: error: {script}, line 5: NSCD has no argument 'tehta'")
    script.write_text("import cairn as cn\n\ncn.Colomb(mu=1)\n")
    assert call(capsys, "run", script)[2].startswith(f"cairn: error: {script}, line 3: module 'cairn' has no attribute 'Colomb'")
    for wrong, kind in (("{}['x']", "KeyError"), ("import cairn\ncairn.Scene(2).add(None, key=len(3))", "TypeError")):
        script.write_text(wrong)
        status, _, err = call(capsys, "run", script)
        assert status == 1 and err.startswith("Traceback") and err.splitlines()[-1].startswith(kind)
    # an unintended error inside Cairn is a defect, and shown as such
    script.write_text("from cairn import names\nnames.telling(None)\n")
    status, _, err = call(capsys, "run", script)
    assert status == 1 and "in telling" in err and err.splitlines()[-1].startswith("TypeError")


@contextlib.contextmanager
def killed_late(process):
    """A process that does not end fails its test, and does not keep it."""
    try:
        yield
    finally:
        process.kill()


def hears():
    """In the child: tests that run in the background inherit that SIGINT is ignored."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.mark.parametrize(("how", "number"), [("runs", signal.SIGINT), ("runs", signal.SIGTERM), ("steps", signal.SIGINT)])
def test_a_signal_says_where(script, tmp_path, how, number):
    command = [sys.executable, "-m", "cairn", "run", script, how, tmp_path / "a.vtkhdf"]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, "env": environment, "preexec_fn": hears}
    with subprocess.Popen(command, **options) as process, killed_late(process):
        assert process.stdout.readline() == "20\n"
        process.send_signal(number)
        out, err = process.communicate(timeout=60)
    name = "Ctrl-C" if number == signal.SIGINT else "SIGTERM"
    assert process.returncode == 128 + number and err.count("\n") == 1
    step = int(err.partition(f"cairn: stopped by {name} at step ")[2].partition(",")[0])
    assert step >= 20
    if how == "runs":
        assert out == "after\n" and f"{tmp_path / 'a.vtkhdf'} holds what was done" in err
        with cn.load(tmp_path / "a.vtkhdf") as run:
            assert run[-1].step == step


def test_a_scene_that_is_stopped_exits_with_130(tmp_path):
    heap().save(tmp_path / "pile.scene.h5")
    command = [sys.executable, "-m", "cairn", "run", tmp_path / "pile.scene.h5", "--dt", "1e-3", "--until", "1e6"]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, "env": environment, "preexec_fn": hears}
    with subprocess.Popen(command, **options) as process, killed_late(process):
        while not (tmp_path / "pile.vtkhdf").exists() and process.poll() is None:
            pass
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
    assert process.returncode == 130 and "cairn: stopped by Ctrl-C at step " in err


def test_misspelt_on_the_command_line(capsys, tmp_path):
    for arguments, words in (
        (["rn", "x"], "'rn' is none of run, import, .*; did you mean 'run'"),
        (["run", "x.h5", "--stpes", "4"], "cairn run: error: there is no option --stpes; did you mean '--steps'"),
        (["run", "x.h5", "--stpes=4"], "there is no option --stpes; did you mean '--steps'"),
        (["run", "x.h5", "--zzz"], "there is no option --zzz; there are --help, --dt, "),
        (["import", "x.stl", "--hold", "flor"], "'flor' is none of support, lowest, floor; did you mean 'floor'"),
        (["info", "x.h5", "y.h5"], "there is no place for y.h5"),
    ):
        with pytest.raises(SystemExit) as end:
            cli.main(arguments)
        assert end.value.code == 2
        assert re.search(words, capsys.readouterr().err.replace("\n", " "))
    heap().save(tmp_path / "pile.scene.h5")
    status, _, err = call(capsys, "run", tmp_path / "pile.scene.h5", "--dt", 1e-3, "--steps", 1, "--solver", "PPANewtn")
    assert status == 1 and "did you mean 'PPANewton'?" in err and err.count("\n") == 1


def test_errors_of_all_commands_take_a_line(capsys, tmp_path):
    heap().save(tmp_path / "heap.scene.h5")
    sim().run(steps=1, output=tmp_path / "a.vtkhdf")
    (tmp_path / "a.txt").write_text("hello")
    for arguments, words in (
        (["plot", tmp_path / "a.vtkhdf", "--what", "energi"], "there is no field 'energi'; .*; did you mean 'energy'"),
        (["plot", tmp_path / "a.vtkhdf", "--every", 0, "-o", tmp_path / "a.gif"], "every is 0: give a whole number >= 1"),
        (["plot", tmp_path / "a.vtkhdf", "--dpi", -4], "dpi is -4: give a whole number >= 1"),
        (["run", tmp_path / "a.txt", "--dt", 1e-3, "--steps", 1], "this is not a scene; give a .scene.h5 file"),
        (["run", tmp_path / "heap.scene.h5", "--dt", 1e-3, "--until", -1], "until is -1.0: the simulation is at 0 s already"),
        (["run", tmp_path / "heap.scene.h5", "--dt", 1e-3, "--steps", 1, "-o", tmp_path / "a.vtk"], "this name ends in .vtk"),
        (["wrap-law", tmp_path / "none.toml"], "none.toml: no such file or folder; check the path"),
        (["solve", tmp_path], "cannot be opened as HDF5"),
    ):
        status, out, err = call(capsys, *arguments)
        assert status == 1 and out == "" and err.startswith("cairn: error: ") and err.count("\n") == 1
        assert re.search(words, err), err
