"""Files of Simulation.run: every array, after a kill at any instant, a signal, a full disk."""

import contextlib
import errno
import os
import random
import resource
import signal
import subprocess
import sys
import time

import cairn as cn
import numpy as np
import pytest
from cairn.files import container
from cairn.run.loop import snapshot
from small_scenes import ROCK, differing, heap, state

KILLS = 200 if os.environ.get("CAIRN_FULL") else 20


def simulate(dim=2):
    return cn.Simulation(heap(dim), 4e-3, cn.NSCD(solver=cn.NLGS(tol=1e-4)), overlap="ignore")


class Recorded:
    """A callback that keeps copies of the expected content of the file."""

    def __init__(self, sim, every):
        self.every, self.outputs, self.history = every, [(0, 0.0, *snapshot(sim))], []

    def __call__(self, sim):
        self.history.append({**sim.info})
        if sim.steps % self.every == 0:
            self.outputs.append((sim.steps, sim.time, *snapshot(sim)))


@pytest.mark.parametrize("dim", [2, 3])
def test_a_run_read_back_equals_its_arrays(tmp_path, dim):
    path, sim = tmp_path / "run.vtkhdf", simulate(dim)
    kept = Recorded(sim, 5)
    sim.run(steps=60, output=path, every=5, callback=kept, progress=False)
    with cn.load(path) as run:
        assert len(run) == len(kept.outputs) == 13
        for k, (step, at, bodies, contacts) in enumerate(kept.outputs):
            assert (run[k].step, run[k].time) == (step, at)
            for name, value in bodies.items():
                assert np.array_equal(run[k].bodies[name], value), (k, name)
            for name, value in contacts.items():
                assert np.array_equal(run[k].contacts[name], value), (k, name)
        assert np.count_nonzero(run[-1].contacts.impulse) > 10
        h = run.history
        assert list(h["step"]) == list(range(1, 61))
        for name in ("error", "iterations", "contacts", "penetration"):
            assert np.array_equal(h[name], [row[name] for row in kept.history]), name
        assert np.array_equal(h["energy_kinetic"], [row["energy"]["kinetic"] for row in kept.history])


def test_vtk_reads_bodies_and_contacts(tmp_path):
    vtk = pytest.importorskip("vtk", reason="vtk is not installed: that its reader opens the file is not tested here")
    from vtk.util.numpy_support import vtk_to_numpy

    path, sim = tmp_path / "run.vtkhdf", simulate()
    kept = Recorded(sim, 10)
    sim.run(steps=40, output=path, every=10, callback=kept, progress=False)
    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(path))
    for k, (_, _, bodies, contacts) in enumerate(kept.outputs):
        reader.SetStep(k)
        reader.Update()
        blocks = [reader.GetOutputDataObject(0).GetBlock(i) for i in (0, 1)]
        points = [vtk_to_numpy(b.GetPoints().GetData())[:, :2] if b.GetNumberOfPoints() else np.zeros((0, 2)) for b in blocks]
        assert np.array_equal(points[0], bodies["position"])
        assert np.array_equal(points[1], contacts["point"])
        data = blocks[1].GetPointData()
        for name in ("gap", "impulse", "normal", "status"):
            read = vtk_to_numpy(data.GetArray(name)) if len(contacts[name]) else contacts[name]
            assert np.array_equal(read[:, :2] if read.ndim == 2 else read, contacts[name]), (k, name)
        read = vtk_to_numpy(blocks[0].GetPointData().GetArray("radius"))
        assert np.array_equal(read, bodies["radius"])


# ---------------------------------------------------------------------- killed

ENDLESS = """
import os, sys
sys.path[:0] = [sys.argv[1]]
from test_run_outputs import simulate
sim = simulate()
def told(sim):
    os.write(1, b"%d\\n" % sim.steps)
sim.run(steps=10**9, output=sys.argv[2], every=2, checkpoint_every=7, callback=told, progress=False, overwrite=True)
os.write(1, b"closed\\n")
"""


def start(path):
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path), "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-c", ENDLESS, os.path.dirname(__file__), str(path)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, env=environment)


def forked(path, pipe):
    """The same in a copy of this process: no interpreter to start."""
    os.environ["OMP_NUM_THREADS"] = "1"
    sim = simulate()
    told = lambda sim: os.write(pipe, b"%d\n" % sim.steps)
    sim.run(steps=10**9, output=path, every=2, checkpoint_every=7, progress=False, callback=told)


def test_killed_at_random_instants(tmp_path):
    """The file opens and holds every step whose output was flushed; a checkpoint that is there restarts."""
    chance, seen, reference = random.Random(1984), set(), simulate()
    places = {0: reference.bodies.position}
    for trial in range(KILLS):
        path = tmp_path / f"{trial}.vtkhdf"
        read_end, write_end = os.pipe()
        child = os.fork()
        if child == 0:
            os.close(read_end)
            try:
                forked(path, write_end)
            finally:
                os._exit(1)
        os.close(write_end)
        told = os.read(read_end, 64)  # the first step is taken, the first output flushed
        time.sleep(chance.random() * 0.25)
        os.kill(child, signal.SIGKILL)
        assert os.waitpid(child, 0)[1] == signal.SIGKILL
        while data := os.read(read_end, 1 << 16):
            told += data
        os.close(read_end)
        last = int(told.split()[-1])
        seen.add(last)
        while reference.steps < last + 4:
            reference.step()
            places[reference.steps] = reference.bodies.position
        with cn.load(path) as run:
            assert run[0].step == 0
            assert run[-1].step >= last - last % 2
            for k in range(len(run)):
                assert np.array_equal(run[k].bodies.position, places[run[k].step])
        checkpoint = path.with_suffix(".checkpoint.h5")
        assert checkpoint.exists() or last < 7
        if checkpoint.exists():
            again = simulate()
            again.restore(checkpoint)
            assert last - 7 <= again.steps <= last + 1
            assert again.steps % 7 == 0
            assert np.array_equal(again.bodies.position, places[again.steps])
            checkpoint.unlink()
        path.unlink()
    assert len(seen) > 3  # they were killed at different instants, also on a busy machine


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_closes_the_file_and_the_checkpoint_restarts(tmp_path, number):
    path = tmp_path / "run.vtkhdf"
    process = start(path)
    for line in process.stdout:
        if int(line) >= 10:
            break
    process.send_signal(number)
    rest = process.stdout.read().split()
    assert process.wait(timeout=60) == 0
    assert rest.pop() == b"closed"
    last = max([int(line), *map(int, rest)])
    with cn.load(path) as run:
        assert run[-1].step == last
        assert run.history["step"][-1] == last
        end = run[-1].bodies.position[:]
    again = simulate()
    again.restore(tmp_path / "run.checkpoint.h5")
    assert again.steps == last - last % 7
    while again.steps < last:
        again.step()
    assert np.array_equal(again.bodies.position, end)


# ---------------------------------------------------------------------- no room, no permission


def goes_on(sim, twin):
    """The simulation is usable: it goes on to the same bits as one that never wrote."""
    while twin.steps < sim.steps:
        twin.step()
    sim.step()
    twin.step()
    assert not differing(state(sim), state(twin))


def test_full_disk_at_any_output(tmp_path):
    simulate().run(steps=1, output=tmp_path / "one.vtkhdf", progress=False)
    one = (tmp_path / "one.vtkhdf").stat().st_size
    for room in (0, one // 2, 2 * one):
        path, sim, left = tmp_path / f"{room}.vtkhdf", simulate(), [room]

        def full(_, data, left=left):
            left[0] -= len(data)
            return errno.ENOSPC if left[0] < 0 else 0

        container.GrowingFile.watch(full)
        try:
            with pytest.raises(cn.FileError, match=rf"{path.name}: the disk is full; free some space, or write to another disk"):
                sim.run(steps=200, output=path, every=1, progress=False)
        finally:
            container.GrowingFile.watch(None)
        if room > one:
            assert sim.steps > 0
            with cn.load(path) as run:
                assert len(run) >= sim.steps - 1
        goes_on(sim, simulate())
        assert sim.run(steps=2, output=tmp_path / f"{room}b.vtkhdf", progress=False) == 2


def test_a_file_that_may_not_grow(tmp_path):
    """The system itself refuses: a limit on the size of files, in a process of its own."""
    script = (
        "import sys; sys.path[:0] = [sys.argv[1]]\n"
        "import cairn as cn\nfrom test_run_outputs import simulate\nsim = simulate()\n"
        "try:\n    sim.run(steps=500, output=sys.argv[2], every=1, progress=False)\n"
        "except cn.FileError as error:\n    print(sim.steps, error)\nsim.step(); print(sim.steps)\n"
    )
    limit = lambda: (signal.signal(signal.SIGXFSZ, signal.SIG_IGN), resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000)))
    command = [sys.executable, "-B", "-c", script, os.path.dirname(__file__), str(tmp_path / "run.vtkhdf")]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, preexec_fn=limit)
    lines = done.stdout.splitlines()
    assert "may not grow any further; raise the limit on file sizes" in lines[0], done.stderr
    steps = int(lines[0].split()[0])
    assert int(lines[1]) == steps + 1
    with cn.load(tmp_path / "run.vtkhdf") as run:
        assert len(run) >= steps - 1


def test_no_such_folder_no_permission_file_there(tmp_path):
    sim = simulate()
    for path, words in (
        (tmp_path / "none" / "run.vtkhdf", "no such file or folder; check the path, or make the folder first"),
        (tmp_path, "this is a folder|already"),
    ):
        with pytest.raises(cn.FileError, match=words):
            sim.run(steps=3, output=path, progress=False)
        assert sim.steps == 0
    path = tmp_path / "there.vtkhdf"
    path.write_text("mine")
    with pytest.raises(cn.FileError, match="there.vtkhdf: .*overwrite"):
        sim.run(steps=3, output=path, progress=False)
    assert path.read_text() == "mine"
    if os.geteuid():
        locked = tmp_path / "locked"
        locked.mkdir(mode=0o500)
        with pytest.raises(cn.FileError, match="permission denied; choose a folder you may write to"):
            sim.run(steps=3, output=locked / "run.vtkhdf", progress=False)
    goes_on(sim, simulate())


def test_permission_denied(tmp_path):
    """Also for root, who may write everywhere: rights are given up for the while of the run."""
    sim, rights = simulate(), os.geteuid()
    tmp_path.chmod(0o500)
    if rights == 0:
        os.seteuid(65534)
    try:
        with pytest.raises(cn.FileError, match="run.vtkhdf: permission denied; choose a folder you may write to, or change its"):
            sim.run(steps=3, output=tmp_path / "run.vtkhdf", progress=False)
    finally:
        os.seteuid(rights)
        tmp_path.chmod(0o700)
    goes_on(sim, simulate())


def test_a_checkpoint_that_cannot_be_written(tmp_path):
    sim = simulate()
    with pytest.raises(cn.FileError, match="no such file or folder"):
        sim.checkpoint(tmp_path / "none" / "a.h5")
    goes_on(sim, simulate())


def test_a_callback_that_fails_closes_the_file(tmp_path):
    path, sim = tmp_path / "run.vtkhdf", simulate()

    def fail(sim):
        if sim.steps == 5:
            sim.remove([0])
            raise RuntimeError("mine")

    with pytest.raises(RuntimeError, match="mine"):
        sim.run(steps=10, output=path, every=2, callback=fail, progress=False)
    with cn.load(path) as run:
        assert [run[k].step for k in range(len(run))] == [0, 2, 4, 5]
        assert len(run[3].bodies) == len(run[2].bodies) - 1
    sim.add(cn.disks([[0.5, 9.0]], 0.4, ROCK))
    assert sim.run(steps=2, output=path, overwrite=True, progress=False) == 2


def test_a_run_tells_its_periodic_cell(tmp_path):
    rock = cn.Material("rock", density=1000.0)
    scene = cn.Scene(2, periodic=cn.Periodic((4.0, 3.0), corner=(1.0, 2.0), shear_rate=0.5))
    scene.add(cn.disks([[2.0, 3.0]], 0.5, rock))
    scene.interact(rock, rock, cn.Coulomb(mu=0.3))
    path = tmp_path / "sheared.vtkhdf"
    cn.Simulation(scene, 1e-3).run(steps=1, output=path, progress=False)
    with cn.load(path) as run:
        cell = run.periodic
    np.testing.assert_array_equal(cell["periodic"], [1, 1, 0])
    np.testing.assert_array_equal(np.diag(cell["vectors"]), [4.0, 3.0, 0.0])
    np.testing.assert_array_equal(cell["corner"], [1.0, 2.0, 0.0])
    assert cell["velocity_gradient"][0, 1] == 0.5


def test_a_run_without_rights_in_a_home_that_cannot_be_written(tmp_path):
    """A user without rights whose home is read-only makes the run to the same bits, with no other files."""
    home, out = tmp_path / "home", tmp_path / "out"
    home.mkdir(mode=0o555), out.mkdir(mode=0o777)
    out.chmod(0o777)
    child = os.fork()
    if child == 0:
        status = 1
        with contextlib.suppress(BaseException):
            for folder in tmp_path.parents:  # pytest's own folders are of root alone
                if "pytest" in str(folder) and os.getuid() == folder.stat().st_uid == 0:
                    folder.chmod(0o755)
            tmp_path.chmod(0o755)
            os.environ["HOME"] = os.environ["XDG_CACHE_HOME"] = str(home)
            os.chdir(home)
            if os.getuid() == 0:
                os.setgid(65534), os.setuid(65534)
            simulate().run(steps=5, output=out / "run.vtkhdf", checkpoint_every=2, progress=False)
            with cn.load(out / "run.vtkhdf") as run:
                status = 0 if len(run) == 6 else 2
        os._exit(status)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    assert sorted(os.listdir(out)) == ["run.checkpoint.h5", "run.vtkhdf"] and os.listdir(home) == []
    with cn.load(out / "run.vtkhdf") as run:
        sim = simulate()
        sim.run(steps=5, progress=False)
        assert np.array_equal(run[-1].bodies.position, sim.bodies.position)
