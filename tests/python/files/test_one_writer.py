"""A single writer for each file: two runs started together, remains of a killed run, links, and folders removed while a run
writes."""

import multiprocessing
import os
import signal
import subprocess
import sys

import cairn as cn
import numpy as np
import pytest
import small_scenes
from cairn import problems
from cairn.files import checkpoint
from cairn.files.container import GrowingFile
from cairn.post import FileError, RunWriter, load
from made_up import write
from small_scenes import heap

RUN = """
import sys
sys.path.insert(0, sys.argv[2])
import cairn as cn
from small_scenes import heap
sim = cn.Simulation(heap(2), 4e-3, overlap="ignore")
print("ready", flush=True)
sys.stdin.readline()
try:
    sim.run(10, output=sys.argv[1], every=2)
    print("wrote")
except cn.FileError as error:
    print("refused:", error)
"""


def test_of_two_runs_started_together_one_writes_and_one_is_refused(tmp_path):
    command = [sys.executable, "-c", RUN, "RUN", os.path.dirname(small_scenes.__file__)]
    for trial in range(3):
        path = tmp_path / f"both{trial}.vtkhdf"
        command[3] = str(path)
        both = [
            subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            for _ in range(2)
        ]
        for each in both:
            each.stdout.readline()
        for each in both:
            each.stdin.write("go\n")
            each.stdin.flush()
        said = sorted(each.communicate(timeout=120)[0].strip() for each in both)
        assert said[1] == "wrote" and said[0].startswith(f"refused: {path}: ")
        with load(path) as run:
            assert len(run) == 6 and len(run.scene) > 2  # whole: its scene can be read
        assert os.listdir(tmp_path) == [path.name]
        path.unlink()


def test_a_second_writer_of_a_file_is_refused_and_the_first_one_unharmed(tmp_path):
    path = tmp_path / "a.h5"
    first = GrowingFile(path)
    with pytest.raises(FileError, match="another run is writing this file; let it end"):
        GrowingFile(path)
    first.root.array("x", np.arange(3))
    first.commit()
    with pytest.raises(FileError, match="exists already"):
        GrowingFile(path)
    with pytest.raises(FileError, match="another run is writing this file"):
        GrowingFile(path, overwrite=True)
    with pytest.raises(FileError, match="another run is writing this file"):
        RunWriter.go_on(path, 0)
    first.close()
    GrowingFile(path, overwrite=True).close()
    assert os.listdir(tmp_path) == ["a.h5"]


def test_what_a_killed_run_left_is_cleaned_by_the_next(tmp_path):
    path = tmp_path / "run.vtkhdf"
    child = multiprocessing.get_context("fork").Process(target=_killed, args=(path,))
    child.start()
    child.join()
    assert child.exitcode == -signal.SIGKILL
    left = sorted(os.listdir(tmp_path))
    assert left[-1] == "run.vtkhdf.part" and left[0].startswith(".run.checkpoint.h5.") and len(left) == 2
    write(path, 2).close()
    checkpoint.save(tmp_path / "run.checkpoint.h5", {"a": 1})
    assert sorted(os.listdir(tmp_path)) == ["run.checkpoint.h5", "run.vtkhdf"]
    with load(path) as run:
        assert len(run) == 2


def _killed(path):
    left = GrowingFile(path)
    left.root.array("x", 1)
    GrowingFile.watch(lambda address, _: os.kill(os.getpid(), signal.SIGKILL) if address == 0 else 0)
    checkpoint.save(path.with_name("run.checkpoint.h5"), {"a": 1})


def test_a_link_is_never_followed(tmp_path):
    precious = tmp_path / "precious.txt"
    precious.write_text("kept")
    problem = problems.Problem(2, np.eye(2), [-1.0, 0.0], [0.3])
    for name, make in (("run.h5", GrowingFile), ("p.hdf5", lambda path: problems.write(path, problem))):
        part = tmp_path / (name + ".part")
        part.symlink_to(precious)
        with pytest.raises(FileError, match="is a link, and is not followed; remove .*part"):
            make(tmp_path / name)
        part.unlink()
        part.mkdir()
        with pytest.raises(FileError, match="is no plain file"):
            make(tmp_path / name)
    assert precious.read_text() == "kept"


@pytest.mark.parametrize("what", ["removed", "replaced", "moved"])
def test_an_output_that_is_gone_is_an_error_at_the_next_flush(tmp_path, what):
    folder = tmp_path / "runs"
    folder.mkdir()
    path, sim = folder / "run.vtkhdf", cn.Simulation(heap(2), 4e-3, overlap="ignore")

    def spoil(_):
        if sim.steps != 3:
            return
        if what == "moved":
            folder.rename(tmp_path / "elsewhere")
            return
        path.unlink()
        if what == "replaced":
            path.write_text("of another")

    with pytest.raises(FileError, match="removed or replaced while it was written"):
        sim.run(100, output=path, every=1, callback=spoil)
    assert sim.steps < 100
    if what == "replaced":
        assert path.read_text() == "of another"
