"""Checkpoints come back to the bit, are replaced atomically and refused when damaged."""

import os

import h5py
import numpy as np
import pytest
from cairn import _core
from cairn.files import checkpoint as cp
from cairn.post import FileError
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp


def same(a, b):
    if isinstance(a, dict):
        return isinstance(b, dict) and a.keys() == b.keys() and all(same(a[k], b[k]) for k in a)
    if isinstance(a, (np.ndarray, np.generic)):
        return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes() and type(a) is type(b)
    return type(a) is type(b) and (a == b or (a != a and b != b))


STATE = {
    "bodies": {"position": np.array([[1.0, -0.0], [5e-324, np.inf]]), "id": np.arange(4), "empty": np.empty((0, 3))},
    "flags": np.array([True, False]),
    "driven": np.array([3], np.uint8),
    "small": np.float32(0.1),
    "nan": np.array([0x7FF8DEADBEEF0001], np.uint64).view(np.float64),
    "time": 0.1,
    "nothing": None,
    "yes": True,
    "steps": 12345678901234567890,
    "words": ["a", "ü"],
    "name": "Größe",
    "raw": b"\0\1",
    "inf": float("inf"),
    "names": np.array(["rock", "sand"]),
    "nested": {"deep": {"er": [1, [2.5, "x"]]}, "none": {}},
    "scalar": np.array(2.5),
}


def test_round_trip(tmp_path):
    path = tmp_path / "a.checkpoint.h5"
    cp.save(path, STATE)
    assert same(STATE, cp.load(path))
    assert os.listdir(tmp_path) == ["a.checkpoint.h5"]  # nothing else stays


@settings(max_examples=25, deadline=None)
@given(
    st.dictionaries(
        st.sampled_from("abcdef"),
        hnp.arrays(st.sampled_from(["f8", "f4", "i8", "i4", "u1", "?"]), hnp.array_shapes(min_dims=0, min_side=0, max_side=4)),
    )
)
def test_any_arrays_come_back(tmp_path_factory, state):
    path = tmp_path_factory.mktemp("h") / "a.h5"
    cp.save(path, state)
    assert same(state, cp.load(path))


def test_path_beside_the_run():
    assert cp.checkpoint_path("dir/fold.vtkhdf") == "dir/fold.checkpoint.h5"
    assert cp.checkpoint_path("fold") == "fold.checkpoint.h5"


def test_a_failed_write_leaves_the_old_one(tmp_path):
    path = tmp_path / "a.h5"
    cp.save(path, {"a": 1})
    for last in (True, False):  # the write that makes it a file, and the first one
        _core.GrowingFile.watch(lambda address, _, last=last: 28 if not last or address == 0 else 0)
        try:
            with pytest.raises(FileError, match="disk is full"):
                cp.save(path, {"a": 2})
        finally:
            _core.GrowingFile.watch(None)
        assert cp.load(path) == {"a": 1}
    with pytest.raises(TypeError, match=r"/b/c is a complex"):
        cp.save(path, {"b": {"c": 1j}})
    with pytest.raises(FileError, match="no such file or folder"):
        cp.save(tmp_path / "none" / "a.h5", {})
    assert os.listdir(tmp_path) == ["a.h5"]


def test_refusals(tmp_path):
    path = tmp_path / "a.h5"
    with pytest.raises(FileError, match="no such file"):
        cp.load(path)
    path.write_text("hello")
    with pytest.raises(FileError, match="not a checkpoint"):
        cp.load(path)
    cp.save(path, {"x": np.arange(1000.0)})
    whole = path.read_bytes()
    path.write_bytes(whole[:-1000])
    with pytest.raises(FileError, match="truncated or damaged"):
        cp.load(path)
    at = whole.index(np.float64(500.0).tobytes())
    path.write_bytes(whole[:at] + b"\1" + whole[at + 1 :])
    with pytest.raises(FileError, match="checksum does not match.*earlier checkpoint"):
        cp.load(path)
    path.write_bytes(whole)
    with h5py.File(path, "r+") as file:
        file.attrs["version"] = (2, 0)
    with pytest.raises(FileError, match="format version 2.0.*newer Cairn"):
        cp.load(path)
    with h5py.File(path, "w") as file:
        file["x"] = 1
    with pytest.raises(FileError, match="not a checkpoint"):
        cp.load(path)
