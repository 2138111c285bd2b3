"""A run that goes on in its file, or in another, reads as one that was never stopped."""

import os
import signal
import subprocess
import sys

import cairn as cn
import h5py
import numpy as np
import pytest
from cairn import cli
from small_scenes import heap


def sim(**options):
    return cn.Simulation(heap(push=cn.Table([0, 1], [[0, 0], [2.0, 0]])), 1e-3, overlap="ignore", **options)


def outputs(run):
    """All that a run holds of its outputs and its history, but for the seconds of the clock."""
    out = {}
    for k, step in enumerate(run):
        out[k] = (step.time, step.time_detection, step.step)
        for kind, fields in (("bodies", step.bodies), ("contacts", step.contacts)):
            out |= {(k, kind, name): np.array(fields[name]).tobytes() for name in fields}
    out |= {name: values.tobytes() for name, values in run.history.items()}
    return out


def same(a, b):
    a, b = (outputs(x) for x in (a, b))
    assert a.keys() == b.keys()
    assert [name for name in a if a[name] != b[name]] == []


@pytest.fixture
def whole(tmp_path):
    s = sim()
    s.run(steps=60, output=tmp_path / "whole.vtkhdf", every=7, probes={"x": lambda s: s.bodies.position[0, 0]})
    with cn.load(tmp_path / "whole.vtkhdf") as run:
        yield run


PROBES = {"x": lambda s: s.bodies.position[0, 0]}


@pytest.mark.parametrize("stop", [20, 28, 35])
def test_append_after_a_restart(tmp_path, whole, stop):
    """The first run went on to step `stop` when it ended without a word; its checkpoint is of step 20."""
    path = tmp_path / "a.vtkhdf"
    first = sim()
    first.run(steps=stop - stop % 7 or 7, output=path, every=7, checkpoint_every=10, probes=PROBES)
    if stop % 7 == 0:
        assert first.steps == stop
    again = sim()
    again.restore(tmp_path / "a.checkpoint.h5")
    assert again.steps < 60
    again.run(steps=60 - again.steps, output=path, every=7, append=True, probes=PROBES)
    with cn.load(path) as run:
        same(run, whole)
    with h5py.File(path) as file:
        assert file["VTKHDF/Steps"].attrs["NSteps"] == len(whole)
        assert file["VTKHDF/bodies/Steps"].attrs["NSteps"] == file["VTKHDF/bodies/Steps/Values"].size == len(whole)
        assert [name for name in file["VTKHDF/Assembly"]] == ["bodies", "contacts"]


def test_append_again_and_again(tmp_path, whole):
    s = sim()
    for _ in range(6):
        s.run(steps=10, output=tmp_path / "a.vtkhdf", every=7, append=True, probes=PROBES)
    with cn.load(tmp_path / "a.vtkhdf") as run:
        assert [step.step for step in run] == sorted({*range(0, 61, 7), *range(10, 61, 10)})
        kept = [k for k, step in enumerate(run) if step.step % 7 == 0 or step.step == 60]
        for k, step in zip(kept, whole, strict=True):
            assert np.array_equal(run[k].bodies.position, step.bodies.position)
            assert np.array_equal(run[k].bodies.material, step.bodies.material)
            assert np.array_equal(run[k].contacts.impulse, step.contacts.impulse)
        assert np.array_equal(run.history["x"], whole.history["x"])
        assert list(run.history["status"]) == list(whole.history["status"])


def test_append_with_bodies_that_come_in_and_many_steps(tmp_path):
    """More rows than a chunk holds, and another number of bodies at each opening."""
    s, counts = cn.Simulation(heap(counts=(2, 2)), 1e-3, overlap="ignore"), []
    for k in range(4):
        s.run(steps=150, output=tmp_path / "a.vtkhdf", append=True)
        counts.append(len(s.bodies))
        s.add(cn.disks([[1.0, 10.0 + k]], 0.4, cn.Material("rock", density=2000.0)))
    with cn.load(tmp_path / "a.vtkhdf") as run:
        assert [step.step for step in run] == list(range(601))
        assert [len(run[k].bodies) for k in (0, 150, 151, 300, 301, 600)] == [counts[i] for i in (0, 0, 1, 1, 2, 3)]
        assert np.array_equal(run[-1].bodies.position, s.bodies.position[: counts[-1]])
        assert np.array_equal(run.history["step"], np.arange(1, 601))
        assert np.array_equal(run[1].bodies.mass, run[0].bodies.mass) and len(run[0].bodies.mass) == counts[0]


def test_what_append_refuses(tmp_path):
    path, s = tmp_path / "a.vtkhdf", sim()
    with pytest.raises(ValueError, match="append and overwrite are both True: give one of them"):
        s.run(steps=1, output=path, append=True, overwrite=True)
    s.run(steps=3, output=path)
    content = path.read_bytes()
    with pytest.raises(cn.FileError, match=r"exists already.*append=True, --append"):
        s.run(steps=1, output=path)
    for other in (cn.Simulation(heap(3), 1e-3, overlap="ignore"), cn.Simulation(heap(counts=(5, 4)), 1e-3, overlap="ignore")):
        with pytest.raises(cn.FileError, match="this run is of another scene"):
            other.run(steps=1, output=path, append=True)
    (tmp_path / "b.h5").write_text("hello")
    with pytest.raises(cn.FileError, match="not an HDF5 file"):
        s.run(steps=1, output=tmp_path / "b.h5", append=True)
    assert path.read_bytes() == content


def refused(simulation, path, match):
    """Going on in a file is refused, by name, and leaves it as it is."""
    content = path.read_bytes()
    with pytest.raises(cn.FileError, match=match) as told:
        simulation.run(steps=2, output=path, append=True, progress=False)
    assert str(path) in str(told.value) and path.read_bytes() == content


def test_a_file_of_another_scene_is_not_gone_on_with(tmp_path):
    """The same grains at other places, with other velocities, under another gravity: each has the radii that the file tells."""
    path = tmp_path / "a.vtkhdf"
    sim().run(steps=6, output=path, every=2, progress=False)
    for steps in (0, 6, 9):
        moved = heap(push=cn.Table([0, 1], [[0, 0], [2.0, 0]]))
        moved.sets[0] = moved.sets[0].with_(position=moved.sets[0].position + [0, 1e-12])
        other = cn.Simulation(moved, 1e-3, overlap="ignore")
        other.run(steps=steps, progress=False)
        refused(other, path, "this run is of another scene")
    for change in ("velocity", "gravity"):
        scene = heap(push=cn.Table([0, 1], [[0, 0], [2.0, 0]]))
        if change == "velocity":
            scene.sets[0] = scene.sets[0].with_(velocity=(0.1, 0, 0))
        else:
            scene.gravity = (0, -1.0)
        other = cn.Simulation(scene, 1e-3, overlap="ignore")
        other.run(steps=6, progress=False)
        refused(other, path, r"its bodies stand elsewhere at step 6 \(t = 0.006 s\)")
        other.checkpoint(tmp_path / "other.h5")
        other.run(steps=3, progress=False)
        refused(other, path, "is at step 9 .* without having come from there; restore a checkpoint of it first")
        other.restore(tmp_path / "other.h5")
        refused(other, path, "its bodies stand elsewhere at step 6")


@pytest.mark.parametrize("every", [1, 4, 100])
def test_a_state_that_is_not_the_end_of_the_file_replaces_nothing(tmp_path, every):
    path = tmp_path / "a.vtkhdf"
    first = sim()
    first.run(steps=5, output=path, every=every, progress=False)
    first.checkpoint(tmp_path / "half.h5")
    state = first.get_state()
    first.run(steps=5, output=path, every=every, append=True, progress=False)
    for steps in (0, 5):
        again = sim()
        again.run(steps=steps, progress=False)
        refused(again, path, rf"reaches step 10 .* is at step {steps} .*: outputs would be lost; restore a checkpoint of it")
    ahead = sim()
    ahead.run(steps=11, progress=False)
    refused(ahead, path, "is at step 11 .* without having come from there")
    first.set_state(state)
    refused(first, path, "is at step 5 .*: outputs would be lost")
    fallen = heap(push=cn.Table([0, 1], [[0, 0], [2.0, 0]]))
    fallen.gravity = (0, -1.0)
    other = cn.Simulation(fallen, 1e-3, overlap="ignore")
    other.run(steps=7, progress=False)
    other.checkpoint(tmp_path / "fallen.h5")
    other.restore(tmp_path / "fallen.h5")
    refused(other, path, "is at step 7 .*, where this run did not pass: outputs would be lost")
    done = sim()
    done.restore(tmp_path / "half.h5")  # which requires it: later outputs are made again
    done.run(steps=5, output=path, every=every, append=True, progress=False)
    whole = sim()
    whole.run(steps=10, progress=False)
    with cn.load(path) as run:
        assert np.array_equal(run[-1].bodies.position, whole.bodies.position) and run[-1].step == 10
        assert np.array_equal(run.history["step"], np.arange(1, 11))


def test_what_wrote_a_file_goes_on_in_it_whatever_was_changed(tmp_path):
    path, s = tmp_path / "a.vtkhdf", sim()
    s.run(steps=3, output=path, progress=False)
    s.bodies.set(position=s.bodies.position + [0.0, 0.01])
    s.run(steps=3, output=path, append=True, progress=False)
    s.run(steps=3, progress=False)  # without the file
    s.run(steps=3, output=path, append=True, progress=False)
    with cn.load(path) as run:
        assert [step.step for step in run] == [*range(7), 10, 11, 12]
    state = s.get_state()
    again = sim()
    again.set_state(state)
    again.run(steps=1, output=path, append=True, progress=False)
    assert len(cn.load(path)) == 11


def test_several_files_as_one(tmp_path, whole):
    names = [tmp_path / f"{k}.vtkhdf" for k in range(3)]
    s = sim()
    for k, steps in enumerate((25, 15, 20)):
        if k == 1:
            s.checkpoint(tmp_path / "c.h5")
            s.run(steps=5, output=tmp_path / "0b.vtkhdf", every=7, probes=PROBES)  # went on, and is done again
            s.restore(tmp_path / "c.h5")
        s.run(steps=steps, output=names[k], every=7, probes=PROBES)
    with cn.load([names[0], tmp_path / "0b.vtkhdf", *names[1:]]) as run:
        assert [step.step for step in run] == [0, 7, 14, 21, 25, 28, 35, 40, 42, 49, 56, 60]
        assert np.array_equal(run.times, [step.time for step in run])
        assert np.array_equal(run.history["x"], whole.history["x"]) and np.array_equal(run.history["step"], np.arange(1, 61))
        assert np.array_equal(run[-1].bodies.position, whole[-1].bodies.position)
        assert run.at(0.028).step == 28 and run[1:3][1].step == 14 and run.dim == 2 and "materials" in run.scene
        assert "12 outputs" in repr(run) and len(run.refresh()) == 12
        assert run.plot(what="velocity") is not None and run.plot_energy() is not None
        with pytest.raises(IndexError, match="output 12 was asked for"):
            run[12]
    with pytest.raises(ValueError, match="path is an empty list: give the files of a run"):
        cn.load([])
    cn.Simulation(heap(3), 1e-3, overlap="ignore").run(steps=1, output=tmp_path / "d.vtkhdf")
    with pytest.raises(cn.FileError, match="this run is in 3D, and .* in 2D; give files of one run"):
        cn.load([names[0], tmp_path / "d.vtkhdf"])


KILLED = """
import sys
import cairn as cn
sim = cn.Simulation(cn.Scene.load(sys.argv[1]), 1e-3, overlap="ignore")
sim.run(steps=30, output=sys.argv[2], every=1, append=True)
sim.run(steps=10**9, output=sys.argv[2], every=1, append=True, callback=lambda s: print(s.steps, flush=True))
"""


def test_killed_while_it_goes_on(tmp_path):
    heap().save(tmp_path / "heap.scene.h5")
    command = [sys.executable, "-c", KILLED, tmp_path / "heap.scene.h5", tmp_path / "a.vtkhdf"]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as process:
        last = 0
        while last < 50:
            last = int(process.stdout.readline())
        process.send_signal(signal.SIGKILL)
    with cn.load(tmp_path / "a.vtkhdf") as run:
        assert [step.step for step in run] == list(range(len(run))) and len(run) > 50
        s = cn.Simulation(heap(), 1e-3, overlap="ignore")
        s.run(steps=45)
        assert np.array_equal(run[45].bodies.position, s.bodies.position)


def test_append_on_the_command_line(tmp_path, capsys):
    scene, out = tmp_path / "heap.scene.h5", tmp_path / "heap.vtkhdf"
    heap().save(scene)

    def call(*options):
        status = cli.main([str(a) for a in ("run", scene, "--dt", 1e-3, "--steps", 10, "--every", 5, "-q", *options)])
        return status, capsys.readouterr().err

    assert call("--checkpoint-every", 10)[0] == 0
    status, err = call("--restart", tmp_path / "heap.checkpoint.h5")
    assert status == 1 and "--append" in err
    assert call("--restart", tmp_path / "heap.checkpoint.h5", "--append")[0] == 0
    with cn.load(out) as run:
        assert [step.step for step in run] == [0, 5, 10, 15, 20]


def test_a_run_goes_on_while_it_is_read(tmp_path):
    """HDF5 returns an open file in its earlier state; outputs written and read meanwhile are those of the file itself."""
    path = tmp_path / "a.vtkhdf"
    simulation = sim()
    simulation.run(steps=4, output=path, every=2, progress=False)
    with cn.load(path) as before:
        for _ in range(2):
            simulation.run(steps=2, output=path, every=2, append=True, progress=False)
        with cn.load(path) as after:
            assert [s.step for s in after] == [0, 2, 4, 6, 8]
        assert [s.step for s in before] == [0, 2, 4]
        assert np.array_equal(before[-1].bodies["position"], cn.load(path)[2].bodies["position"])
