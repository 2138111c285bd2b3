"""The growing HDF5 file, judged by the HDF5 library."""

import os
import resource
import subprocess
import sys

import h5py
import numpy as np
import pytest
from cairn import _core
from cairn.files.container import GrowingFile
from cairn.post import FileError


def test_checksum_is_jenkins_lookup3():
    # known values from the comments of lookup3.c (Jenkins 2006)
    assert _core.lookup3(b"") == 0xDEADBEEF
    assert _core.lookup3(b"Four score and seven years ago") == 0x17770551


def test_arrays_of_many_types_come_back(tmp_path):
    path = tmp_path / "a.h5"
    kinds = {f"{sign}{size}": np.arange(5, dtype=f"{sign}{size}") for sign in "iu" for size in (1, 2, 4, 8)}
    kinds |= {
        "f4": np.array([1.5, np.nan, -0.0], "f4"),
        "f8": np.array([[1e-308, np.inf], [-0.0, np.pi]]),
        "big_endian": np.arange(3, dtype=">i4"),
        "text": "Größe",
        "texts": ["rock", "sand", "größer"],
        "flags": np.array([True, False]),
        "empty": np.zeros((0, 3)),
        "number": 3,
        "long": "x" * 100000,
        "columns": np.arange(6.0).reshape(2, 3).T,
    }
    file = GrowingFile(path)
    group = file.root.group("group")
    for name, value in kinds.items():
        group.array(name, value)
    group.set_attribute("dim", np.int64(3))
    group.set_attribute("words", "zwölf")
    file.close()
    with h5py.File(path, "r") as read:
        for name, value in kinds.items():
            stored = read["group"][name][()]
            if name in ("text", "texts", "long"):
                assert np.array_equal(np.char.decode(stored, "utf-8"), value)
            else:
                assert np.array_equal(stored, value, equal_nan=name.startswith("f") and name != "flags"), name
                assert stored.dtype.itemsize == np.asarray(value).dtype.itemsize
        assert read["group"].attrs["dim"] == 3
        assert read["group"].attrs["words"].decode() == "zwölf"
        assert list(read["group"]) == list(kinds)  # in the order in which they were made
    with pytest.raises(TypeError, match="complex128 cannot be stored"):
        GrowingFile(tmp_path / "b.h5").root.array("z", np.zeros(2, complex))


def test_series_grow_over_several_levels_of_the_index(tmp_path):
    """12,000 rows in chunks of one row: three levels of nodes."""
    path, rng = tmp_path / "a.h5", np.random.default_rng(0)
    file = GrowingFile(path)
    shapes = {"scalars": ((), 7), "vectors": ((3,), 2), "matrices": ((2, 2), 1)}
    series = {name: file.root.series(name, "f8", shape, rows) for name, (shape, rows) in shapes.items()}
    made = {name: [np.empty((0, *shape))] for name, (shape, _) in shapes.items()}
    for k in range(300):
        n = int(rng.integers(0, 80))
        for name, (shape, _) in shapes.items():
            made[name].append(rng.random((n, *shape)))
            assert series[name].append(made[name][-1]) == sum(map(len, made[name][:-1]))
        file.commit()
        if k % 60 == 0 or k == 299:
            with h5py.File(path, "r") as read:
                for name in shapes:
                    assert np.array_equal(read[name][()], np.concatenate(made[name]))
    assert series["matrices"].rows > 64**2
    file.close()
    with h5py.File(path, "r+") as file:  # the library can go on with it
        n = len(file["scalars"])
        file["scalars"].resize((n + 1000,))
        file["scalars"][n:] = 1.0
        file.create_group("more")
    with h5py.File(path, "r") as read:
        assert np.array_equal(read["scalars"][:n], np.concatenate(made["scalars"]))


def test_replaced_headers_do_not_pile_up(tmp_path):
    file = GrowingFile(tmp_path / "a.h5")
    series = file.root.series("x", "f8", (), 100000)
    sizes = []
    for _ in range(60):
        series.append([1.0])
        file.commit(sync=True)
        sizes.append(file.size)
    assert sizes[-1] == sizes[20]
    file.close()


def test_refusals(tmp_path):
    path = tmp_path / "a.h5"
    GrowingFile(path).close()
    with pytest.raises(FileError, match="exists already.*overwrite"):
        GrowingFile(path)
    GrowingFile(path, overwrite=True).close()
    with pytest.raises(FileError, match="no such file or folder.*make the folder"):
        GrowingFile(tmp_path / "none" / "a.h5")
    with pytest.raises(FileError, match="folder"):
        GrowingFile(tmp_path, overwrite=True)
    file = GrowingFile(tmp_path / "b.h5")
    file.root.series("x", "f8", (3,))
    with pytest.raises(ValueError, match="in this group already"):
        file.root.group("x") and file.root.array("x", 1)
    with pytest.raises(ValueError, match=r"rows of shape \(3,\)"):
        file.root["x"].append(np.zeros((2, 2)))
    file.close()
    with pytest.raises(FileError, match="closed"):
        file.root["x"].append(np.zeros((2, 3)))


def test_no_permission(tmp_path):
    """Also for root, who may write everywhere: the attempt is made by a child that has given up its rights."""
    os.chmod(tmp_path, 0o500)
    read_end, write_end = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            if os.geteuid() == 0:
                os.seteuid(65534)
            GrowingFile(tmp_path / "a.h5")
        except FileError as error:
            os.write(write_end, str(error).encode())
        os._exit(0)
    os.waitpid(child, 0)
    os.close(write_end)
    message = os.read(read_end, 10000).decode()
    os.close(read_end)
    os.chmod(tmp_path, 0o700)
    assert "permission denied; choose a folder you may write to" in message


def test_full_disk_keeps_what_was_flushed(tmp_path):
    """A limit on the size of files stands for a disk that fills up."""
    path = tmp_path / "run.vtkhdf"
    script = f"""
import resource
resource.setrlimit(resource.RLIMIT_FSIZE, (600_000, 600_000))
from made_up import write
from cairn import _core
from cairn.post import FileError
try:
    write({str(path)!r}, 1000, after=lambda k: print(k, flush=True))
except FileError as error:
    print("error:", error)
"""
    out = subprocess.run(
        [sys.executable, "-c", script],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        check=True,
    )
    *flushed, message = out.stdout.splitlines()
    assert message.startswith(f"error: {path}: the file may not grow any further; raise the limit")
    from cairn.post import load
    from made_up import check_step

    with load(path) as run:
        assert len(run) == int(flushed[-1]) + 1 > 3
        for k in range(len(run)):
            check_step(run[k], k)
    assert resource.getrlimit(resource.RLIMIT_FSIZE)[0] == resource.RLIM_INFINITY


def test_errors_of_the_system_are_told_in_words(tmp_path):
    import errno

    file = GrowingFile(tmp_path / "a.h5")
    series = file.root.series("x", "f8")
    file.commit()
    GrowingFile.watch(lambda *_: errno.ENOSPC)
    try:
        with pytest.raises(FileError, match="the disk is full; free some space"):
            series.append([1.0])
    finally:
        GrowingFile.watch(None)
    with pytest.raises(FileError, match="the disk is full"):  # it stays closed to writing, so that its content stays whole
        series.append([1.0])
    file.close()
    with h5py.File(tmp_path / "a.h5", "r") as read:
        assert read["x"].shape == (0,)
