"""A kill at any instant leaves a file that opens, without repair, and holds every step flushed before."""

import os
import random
import signal
import time

import h5py
import numpy as np
import pytest
from cairn.files import container
from cairn.post import load
from made_up import bodies, check_step, contacts, write

FULL = bool(os.environ.get("CAIRN_FULL"))
KILLS, OUTPUTS = (200, 12) if FULL else (20, 3)


def read_by_vtk(path, outputs):
    """Numbers of bodies and contacts of the last of `outputs` steps as VTK's reader sees them, and the positions."""
    vtk = pytest.importorskip("vtk")
    from vtk.util.numpy_support import vtk_to_numpy

    reader = vtk.vtkHDFReader()
    reader.SetFileName(os.fspath(path))
    reader.SetStep(outputs - 1)
    reader.Update()
    blocks = [reader.GetOutputDataObject(0).GetBlock(i) for i in (0, 1)]
    return [b.GetNumberOfPoints() for b in blocks], vtk_to_numpy(blocks[0].GetPoints().GetData())


def check_file(path, flushed):
    """The file opens with h5py, with `load` and with VTK, and holds outputs 0 to `flushed`."""
    with h5py.File(path, "r") as file:
        assert "cairn" in file
    with load(path) as run:
        assert len(run) > flushed
        for k in range(len(run)):
            check_step(run[k], k)
        assert len(run.history["step"]) >= flushed + 1
        outputs = len(run)
    if outputs:
        counts, points = read_by_vtk(path, outputs)
        assert counts == [20, len(contacts(outputs - 1)["gap"])]
        assert np.array_equal(points[:, :2], bodies(outputs - 1)["position"])


def test_killed_at_random_instants(tmp_path):
    # other threads of this process do not matter to the child: it only computes and writes
    chance = random.Random(2007)
    seen = set()
    for trial in range(KILLS):
        path = tmp_path / f"killed{trial}.vtkhdf"
        read_end, write_end = os.pipe()
        child = os.fork()
        if child == 0:
            os.close(read_end)
            write(path, 100000, after=lambda k, end=write_end: os.write(end, b"x"))
            os._exit(0)
        os.close(write_end)
        started = os.read(read_end, 1)  # the first flush is done
        time.sleep(chance.random() * 0.15)
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        marks = started
        while data := os.read(read_end, 1 << 16):
            marks += data
        os.close(read_end)
        check_file(path, len(marks) - 1)
        seen.add(len(marks))
        path.unlink()
    assert len(seen) > 3  # they were killed at different instants, on a busy machine too


def test_killed_between_any_two_writes_and_within_each(tmp_path):
    """Replays every prefix of the writes of a run, and each prefix with half of the next write."""
    log, marks = [], []

    def logged(address, data):
        log.append((address, data))
        return 0

    container.GrowingFile.watch(logged)
    try:
        write(tmp_path / "run.vtkhdf", OUTPUTS, after=lambda k: marks.append(len(log))).close()
    finally:
        container.GrowingFile.watch(None)
    first_commit = next(i for i, (address, _) in enumerate(log) if address == 0) + 1
    replayed = tmp_path / "replayed.vtkhdf"
    with open(replayed, "w+b") as file:
        for i, (address, data) in enumerate(log):
            for part in (data[: len(data) // 2], data) if address else (data,):  # 48 bytes at 0 are written as one
                if address == 0:  # the file is given its full length before the superblock says so
                    file.truncate(max(os.fstat(file.fileno()).st_size, int.from_bytes(data[28:36], "little")))
                os.pwrite(file.fileno(), part, address)
                if i >= first_commit:
                    flushed = sum(mark <= i + (part is data) for mark in marks) - 1
                    _check_quickly(replayed, flushed)


def _check_quickly(path, flushed):
    with load(path) as run:
        assert len(run) > flushed
        for k in {0, len(run) // 2, len(run) - 1} if len(run) else ():
            check_step(run[k], k)


def test_steps_not_flushed_are_not_there(tmp_path):
    path = tmp_path / "run.vtkhdf"
    writer = write(path, 3, flush=False)
    assert len(load(path)) == 0
    writer.flush()
    with load(path) as run:
        assert len(run) == 3
    writer.close()


def test_reader_that_stays_open_keeps_its_view(tmp_path):
    path = tmp_path / "run.vtkhdf"
    writer = write(path, 3)
    with load(path) as run:
        for k in range(3, 6):
            writer.write_step(0.1 * k, 0.1 * k - 0.05, k, bodies(k), contacts(k), None)
            writer.flush()
        assert len(run) == 3
        check_step(run[2], 2)
        assert len(run.refresh()) == 6
        check_step(run[5], 5)
    writer.close()


def test_lost_power_goes_back_to_the_last_durable_commit(tmp_path):
    path = tmp_path / "run.vtkhdf"
    writer = write(path, 3)
    writer.flush(sync=True)
    size = path.stat().st_size
    writer.write_step(0.3, 0.25, 3, bodies(3), contacts(3), None)
    writer.flush(sync=False)
    assert path.stat().st_size > size
    copy = tmp_path / "copy.vtkhdf"
    copy.write_bytes(path.read_bytes()[:size])  # the new superblock reached the disk, the rest did not
    from cairn.post import FileError

    with pytest.raises(FileError, match="truncated"):
        load(copy)
    assert container.restore_superblock(copy)
    with load(copy) as run:
        assert len(run) == 3
        check_step(run[2], 2)
    assert not container.restore_superblock(copy)
    writer.close()
