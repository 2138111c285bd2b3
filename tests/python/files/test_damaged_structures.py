"""HDF5 files whose structures are sound and whose contents are not: each ends in cairn.FileError, or is read rightly."""

import cairn as cn
import h5py
import numpy as np
import pytest
from cairn import problems
from cairn.files import hdf5
from cairn.post import RunWriter
from made_up import write
from made_up_problems import random_problem


@pytest.fixture
def run(tmp_path):
    path = tmp_path / "a.vtkhdf"
    write(path, 5).close()
    return path


def lack(name):
    def change(file):
        del file[name]

    return change


def no_columns(file):
    table = file["cairn/scene/contactors"]
    table["offset"] = np.zeros((len(table["radius"]), 0))


def use(path):
    with cn.load(path) as run:
        step = run[-1]
        return [[*step.bodies], [*step.contacts], run.contact_network(), run.measure()]


@pytest.mark.parametrize(
    "change",
    [lack("VTKHDF/bodies/PointData"), lack("VTKHDF/contacts/PointData"), lack("VTKHDF/contacts/PointData/impulse"),
     lack("VTKHDF/contacts/PointData/normal")],
)  # fmt: skip
def test_a_run_that_lacks_what_every_run_holds(run, change):
    use(run)
    with h5py.File(run, "r+") as file:
        change(file)
    with pytest.raises(cn.FileError) as error:
        use(run)
    assert error.value.remedy and str(run) in str(error.value)


def test_normals_that_are_no_numbers(run):
    with h5py.File(run, "r+") as file:
        file["VTKHDF/contacts/PointData/normal"][:] = np.nan
    with cn.load(run) as read:
        assert np.isnan(read[-1].contacts["normal"]).all()
        with pytest.raises(cn.FileError, match="'normal' that are no numbers"):
            read.measure()


def test_contactors_without_columns(tmp_path):
    path = tmp_path / "run.vtkhdf"
    scene = cn.Scene(dim=2)
    scene.add(cn.disks([[0, 0.1], [0.3, 0.1]], 0.1, cn.Material("rock", density=2700.0)))
    scene.interact("rock", "rock", cn.Coulomb(mu=0.5))
    cn.Simulation(scene, dt=1e-3).run(2, output=path, progress=False)
    use(path)
    with h5py.File(path, "r+") as file:
        no_columns(file)
    with pytest.raises(cn.FileError, match="damaged"):
        use(path)


@pytest.mark.parametrize(
    "value", [np.empty(0, "u4"), np.zeros(1, "u2"), np.float64(1.0)], ids=["empty", "of another size", "of another kind"]
)
def test_a_checksum_that_is_none_does_not_stop_a_run_that_goes_on(run, value):
    with h5py.File(run, "r+") as file:
        for path in ("VTKHDF/bodies/Points", "VTKHDF/bodies/PointData/velocity"):
            file[path].attrs["crc32"] = value
    writer = RunWriter.go_on(run, 2)
    writer.close()
    with cn.load(run) as read:
        assert len(read) == 3


def test_names_that_are_no_text(run):
    with h5py.File(run, "r+") as file:
        h5py.h5g.create(file.id, b"a\xff")
        file["cairn"].attrs.create("x", 1)
        file.id.move(b"VTKHDF/bodies/Points", b"VTKHDF/bodies/Points\xff")
    with pytest.raises(cn.FileError) as error:
        RunWriter.go_on(run, 2)
    assert error.value.remedy


def test_texts_of_several_lengths(tmp_path):
    """Many texts in few collections of the heap come back, each."""
    path = tmp_path / "texts.hdf5"
    texts = [f"text {k}" * (k % 7) for k in range(3000)]
    with h5py.File(path, "w") as file:
        file.create_dataset("texts", data=texts, dtype=h5py.string_dtype())
    with hdf5.File(path) as file:
        read = file["texts"][()]
    assert [t.rstrip(b"\0").decode() for t in read] == texts


@pytest.mark.parametrize("libver", ["earliest", "latest"])
def test_compressed_problems(tmp_path, libver):
    p, path, packed = random_problem(3, contacts=5, seed=2), tmp_path / "p.hdf5", tmp_path / "packed.hdf5"
    problems.write(path, p)
    with h5py.File(path, "r") as file, h5py.File(packed, "w", libver=libver) as out:
        def pack(name, member):
            if isinstance(member, h5py.Dataset):
                out.create_dataset(name, data=member[()], compression="gzip" if member.ndim and member.size > 1 else None)

        file.visititems(pack)
    with hdf5.File(packed) as file, pytest.raises(cn.FileError, match="does not read"):
        file["fclib_local/W/x"][()]
    q = problems.read(packed)
    assert (p.W.toarray() == q.W.toarray()).all() and (p.q == q.q).all() and (p.mu == q.mu).all()


def test_a_file_that_the_library_does_not_end_on(tmp_path, monkeypatch):
    path = tmp_path / "p.hdf5"
    with h5py.File(path, "w") as file:
        file.create_dataset("fclib_local/W/x", data=np.zeros(10), compression="gzip")
    monkeypatch.setattr(hdf5, "SECONDS", -1.0)  # no process ends before it begins
    monkeypatch.setattr(hdf5, "BYTES_A_SECOND", 1e12)
    with pytest.raises(cn.FileError, match="does not end on this file") as error:
        hdf5.read_foreign(path, lambda file: file["fclib_local/W/x"][()])
    assert error.value.remedy


@pytest.mark.parametrize("value", [1.0, np.arange(5.0)])
def test_an_array_where_a_group_is_due(tmp_path, value):
    path = tmp_path / "p.hdf5"
    with h5py.File(path, "w") as file:
        file["fclib_local"] = value
    with hdf5.File(path) as file, pytest.raises(TypeError, match="no group"):
        "W" in file["fclib_local"]  # noqa: B015
    with pytest.raises(cn.FileError, match="no group"):
        problems.read(path)


def test_one_value_has_no_rows(tmp_path):
    path = tmp_path / "p.hdf5"
    with h5py.File(path, "w") as file:
        file["one"] = 2.5
    with hdf5.File(path) as file:
        assert file["one"][()] == 2.5
        with pytest.raises(IndexError, match="one value"):
            file["one"][0]
        with pytest.raises(TypeError):
            len(file["one"])
