"""A run comes back as it was written: through `load`, h5py and VTK's own reader."""

import os
from pathlib import Path

import h5py
import numpy as np
import pytest
from cairn.post import FileError, RunWriter, load
from made_up import bodies, check_step, contacts, info, write


@pytest.fixture(params=[2, 3])
def run_file(request, tmp_path):
    path = tmp_path / f"run{request.param}.vtkhdf"
    write(path, 12, dim=request.param).close()
    return path, request.param


def test_every_array_comes_back(run_file):
    path, dim = run_file
    with load(path) as run:
        assert len(run) == 12 and run.dim == dim
        for k in range(12):
            check_step(run[k], k, dim)
        check_step(run[-1], 11, dim)
        assert run.at(0.44).step == 4
        assert [s.step for s in run[2:5]] == [2, 3, 4]
        assert run.scene["name"] == "made up" and list(run.scene["materials"]) == ["rock", "sand", "clay"]
        assert run.provenance == {"version": "1"}
        history = run.history
        assert np.array_equal(history["error"], 2.0 ** -np.arange(12))
        assert np.array_equal(history["energy_kinetic"], 1 / (np.arange(12) + 1))
        assert set(history["status"]) == {"converged"}
        with pytest.raises(IndexError, match="holds 12"):
            run[12]
        with pytest.raises(AttributeError, match="no field 'mass'; there are position"):
            run[0].bodies.mass  # noqa: B018


def test_contact_network(run_file):
    path, dim = run_file
    run, made = load(path), contacts(5, dim=dim)
    assert np.array_equal(run.contact_network(5), np.stack([made["body_a"], made["body_b"]], 1))
    step = run[5]
    assert np.array_equal(step.bodies.id[step.rows_of(made["body_a"])], made["body_a"])


def test_vtk_reads_both_blocks_over_time(run_file):
    vtk = pytest.importorskip("vtk")
    from vtk.util.numpy_support import vtk_to_numpy

    path, dim = run_file
    reader = vtk.vtkHDFReader()
    reader.SetFileName(os.fspath(path))
    reader.UpdateInformation()
    key = vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS()
    assert np.array_equal(reader.GetOutputInformation(0).Get(key), 0.1 * np.arange(12))
    for k in (0, 5, 11, 3):  # output 0 has no contact
        reader.UpdateTimeStep(0.1 * k)
        output = reader.GetOutputDataObject(0)
        for block, made, name in ((0, bodies(k, dim=dim), "position"), (1, contacts(k, dim=dim), "point")):
            grid = output.GetBlock(block)
            assert grid.GetNumberOfPoints() == len(made[name])
            if not len(made[name]):
                continue
            assert grid.GetNumberOfCells() == len(made[name])
            assert np.array_equal(vtk_to_numpy(grid.GetCells().GetConnectivityArray()), np.arange(len(made[name])))
            assert np.array_equal(vtk_to_numpy(grid.GetPoints().GetData())[:, :dim], made[name])
            for field in set(made) - {name, "velocity"}:
                value = vtk_to_numpy(grid.GetPointData().GetArray(field))
                assert np.array_equal(value if made[field].ndim == 1 else value[:, : made[field].shape[1]], made[field])


def test_pyvista_opens_it(run_file):
    pyvista = pytest.importorskip("pyvista")
    reader = pyvista.get_reader(os.fspath(run_file[0]))
    reader.reader.SetStep(11)
    blocks = reader.read()
    assert blocks["bodies"].n_points == 20
    assert blocks["contacts"].n_points == 77 % 11


def test_steady_fields_are_written_once(tmp_path):
    writer = write(tmp_path / "a.vtkhdf", 5)
    made = bodies(5)
    made["radius"] = made["radius"] * 2
    writer.write_step(0.5, 0.45, 5, made, contacts(5), info(5))
    writer.close()
    with h5py.File(writer.path, "r") as file:
        data = file["VTKHDF/bodies/PointData"]
        assert len(data["radius"]) == 40 and len(data["material"]) == 20 and len(data["velocity"]) == 120
    with load(writer.path) as run:
        assert np.array_equal(run[5].bodies.radius, made["radius"])
        check_step(run[4], 4)


def test_bodies_come_and_go(tmp_path):
    writer = RunWriter(tmp_path / "a.vtkhdf", dim=2)
    counts = [5, 9, 3, 0, 300, 300]
    for k, n in enumerate(counts):
        writer.write_step(k, k, k, bodies(k, n))
        writer.flush()
    writer.close()
    with load(writer.path) as run:
        for k, n in enumerate(counts):
            for name, value in bodies(k, n).items():
                assert np.array_equal(run[k].bodies[name], value)
            assert len(run[k].contacts) == 0 and run[k].contacts.impulse.shape == (0, 2)
    vtk = pytest.importorskip("vtk")
    reader = vtk.vtkHDFReader()
    reader.SetFileName(writer.path)
    for k, n in enumerate(counts):
        reader.SetStep(k)
        reader.Update()
        assert reader.GetOutputDataObject(0).GetBlock(0).GetNumberOfPoints() == n


def test_history_of_every_step(tmp_path):
    """The history has a row per step taken, columns may come late."""
    writer = RunWriter(tmp_path / "a.vtkhdf", dim=2)
    for k in range(10):
        writer.write_history(
            0.1 * k,
            k,
            {"contacts": 0 if k < 3 else k + 0.5, **({"late": k} if k > 6 else {})}
            | {"status": "limit" if k == 4 else "converged"},
        )
        if k % 5 == 0:
            writer.write_step(0.1 * k, 0.1 * k, k, bodies(k), info={"contacts": -1})
        if k == 5:
            writer.flush()
    writer.close()
    with load(writer.path) as run:
        history = run.history
        assert np.array_equal(history["step"], np.arange(10)) and len(run) == 2
        assert np.array_equal(history["contacts"], [0, 0, 0, *(np.arange(3, 10) + 0.5)])
        assert np.isnan(history["late"][:7]).all() and np.array_equal(history["late"][7:], [7, 8, 9])
        assert list(np.flatnonzero(history["status"] == "limit")) == [4]


def test_wrong_arrays_are_refused_and_leave_no_trace(tmp_path):
    writer = write(tmp_path / "a.vtkhdf", 2)
    with pytest.raises(ValueError, match="those of the first output"):
        writer.write_step(1, 1, 2, {"position": np.zeros((3, 2))}, contacts(2))
    with pytest.raises(ValueError, match=r"bodies radius has shape \(7,\); it must be \(20,\)"):
        writer.write_step(1, 1, 2, bodies(2) | {"radius": np.ones(7)}, contacts(2))
    with pytest.raises(ValueError, match=r"position has shape \(20, 3\); it must be \(n, 2\)"):
        writer.write_step(1, 1, 2, bodies(2) | {"position": np.ones((20, 3))}, contacts(2))
    writer.write_step(0.2, 0.2 - 0.05, 2, bodies(2), contacts(2))
    writer.close()
    with load(writer.path) as run:
        assert len(run) == 3
        assert np.array_equal(run[2].bodies.position, bodies(2)["position"])


def test_files_that_cannot_be_read(tmp_path):
    path = tmp_path / "a.vtkhdf"
    with pytest.raises(FileError, match=r"a.vtkhdf: no such file or folder; check the path"):
        load(path)
    for content, words in ((b"", "the file is empty"), (b"hello, this is text", "not an HDF5 file")):
        path.write_bytes(content)
        with pytest.raises(FileError, match=words):
            load(path)
    with h5py.File(path, "w") as file:
        file["x"] = 1
    with pytest.raises(FileError, match="not a cairn-run file"):
        load(path)
    path.unlink()
    write(path, 3).close()
    whole = path.read_bytes()
    for share in (0.1, 0.5, 0.99):
        path.write_bytes(whole[: int(len(whole) * share)])
        with pytest.raises(FileError, match="truncated.*copy it again"):
            load(path)
    path.write_bytes(whole)
    with h5py.File(path, "r+") as file:
        file["cairn"].attrs["version"] = (2, 1)
    with pytest.raises(FileError, match="format version 2.1, this Cairn reads up to 1.*newer Cairn"):
        load(path)


def test_cost_of_a_flush_does_not_grow(tmp_path):
    """Flushing a thousand outputs: the last hundred write about what the first hundred write."""
    path = tmp_path / "a.vtkhdf"
    writer, sizes = RunWriter(path, dim=2), []
    made, touching = bodies(0), contacts(0, 40)
    for k in range(1000):
        writer.write_step(k, k, k, made, touching)
        writer.flush(sync=False)
        sizes.append(Path(f"{path}.part" if Path(f"{path}.part").exists() else path).stat().st_size)
    writer.close()
    grown = np.diff(sizes)
    assert grown.max() > 0 and grown[-100:].sum() < 3 * grown[10:110].sum()
