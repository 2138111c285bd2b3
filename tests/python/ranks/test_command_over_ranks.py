"""`cairn run --ranks`: signals, errors and prints are those of a run without ranks, and told once."""

import os
import signal
import subprocess
import sys
import time

import cairn as cn
import pytest
from over_mpi import alive, needs_mpi, text, waited

pytestmark = needs_mpi

LONG = """
import os, time
with open(f"pid{sim.ranks.rank}", "w") as pid:
    pid.write(str(os.getpid()))
def pause(sim):
    if sim.steps > 20:
        open(f"stepped{sim.ranks.rank}", "w").close()
    time.sleep(0.01)
sim.run(100_000, output="run.vtkhdf", every=10, progress=False, callback=pause)
"""
STEPS = LONG.split("sim.run")[0] + "while True:\n    sim.step()\n    pause(sim)\n"
ALLOWED = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMP_NUM_THREADS": "1"}


def begun(folder, *words):
    """The command in a group of its own, as a shell starts it."""
    return subprocess.Popen(
        [sys.executable, "-m", "cairn", "run", *words], cwd=folder, env={**os.environ, **ALLOWED}, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True,
    )  # fmt: skip


def ended(process):
    try:
        out, errors = process.communicate(timeout=60)
    finally:
        process.kill()
    return process.returncode, out, errors


def pids(folder):
    """Processes of both ranks, once they made twenty steps."""
    assert waited(lambda: all((folder / f"stepped{rank}").exists() for rank in (0, 1)), 60.0)
    return [int((folder / f"pid{rank}").read_text()) for rank in (0, 1)]


def gone(processes):
    return waited(lambda: not any(map(alive, processes)), 10.0)


@pytest.mark.parametrize(
    ("to", "numbers", "status", "name"),
    [
        (os.kill, [signal.SIGTERM], 143, "SIGTERM"),  # as a queue ends a job
        (os.killpg, [signal.SIGINT], 130, "Ctrl-C"),  # as a terminal sends it
        (os.killpg, [signal.SIGINT] * 2, 130, "Ctrl-C"),
    ],
)
def test_a_signal_ends_the_run_of_all_ranks(tmp_path, to, numbers, status, name):
    (tmp_path / "pile.py").write_text(text(None, LONG))
    process = begun(tmp_path, "pile.py", "--ranks", "2")
    ranks = pids(tmp_path)
    for number in numbers:
        to(process.pid, number)
        time.sleep(0.3)
    code, _, errors = ended(process)
    assert code == status and gone(ranks)
    assert errors.count("stopped by") == errors.count(f"cairn: stopped by {name} at step ") == 1, errors
    assert "run.vtkhdf holds what was done" in errors and errors.count("\n") == 1
    assert len(cn.load(tmp_path / "run.vtkhdf")) > 1


def test_ctrl_c_between_runs_is_told_once(tmp_path):
    (tmp_path / "pile.py").write_text(text(None, STEPS))
    process = begun(tmp_path, "pile.py", "--ranks", "2")
    ranks = pids(tmp_path)
    os.killpg(process.pid, signal.SIGINT)
    code, _, errors = ended(process)
    assert code == 130 and gone(ranks)
    assert errors.startswith("cairn: stopped by Ctrl-C at step ") and errors.count("\n") == 1, errors


def test_a_rank_that_is_killed_is_told(tmp_path):
    (tmp_path / "pile.py").write_text(text(None, LONG))
    process = begun(tmp_path, "pile.py", "--ranks", "2")
    ranks = pids(tmp_path)
    os.kill(ranks[1], signal.SIGKILL)
    code, _, errors = ended(process)
    assert code == 137 and "cairn: error: a rank ended by SIGKILL" in errors and gone(ranks)


def test_errors_are_a_line_told_once(tmp_path):
    (tmp_path / "pile.py").write_text(text(None, "sim.run(3, output='run.vtkhdf', progress=False)\n"))
    (tmp_path / "raises.py").write_text(text(None, "sim.step()\nif sim.ranks.rank == 1: raise RuntimeError('out of luck')\n"))
    assert ended(begun(tmp_path, "pile.py", "--ranks", "2"))[0] == 0
    own = ended(begun(tmp_path, "pile.py"))
    assert own[0] == 1 and "exists already" in own[2]
    assert ended(begun(tmp_path, "pile.py", "--ranks", "2")) == own
    code, _, errors = ended(begun(tmp_path, "none.scene.h5", "--ranks", "2"))
    assert code == 1 and errors.startswith("cairn: error: ") and errors.count("\n") == 1, errors
    code, _, errors = ended(begun(tmp_path, "raises.py", "--ranks", "2"))
    assert code == 1 and errors.startswith("rank 1: Traceback") and errors.count("out of luck") == 2, errors
    assert "MPI_ABORT" not in errors


def test_the_run_of_a_scene_is_told_once(tmp_path):
    names = {}
    exec(text(2, ""), names)
    names["scene"].save(tmp_path / "pile.scene.h5")
    words = ("pile.scene.h5", "--dt", "1e-3", "--steps", "3", "--ranks", "2")
    code, out, errors = ended(begun(tmp_path, *words))
    assert code == 0 and out == "3 steps, t = 0.003 s, written to pile.vtkhdf\n", errors
