"""HDF5 files as they are read: groups and arrays by their paths, attributes, rows. The reader is Cairn's own
(cxx/files/hdf5_node.hpp), which takes nothing in a file on trust."""

import os
import subprocess
import sys
import tempfile

import numpy as np

from .. import _core
from ..base.errors import FileError, UnknownStructure

# time limit of another process that reads a file: base [s], and bytes it must read in a second beyond that
SECONDS, BYTES_A_SECOND = 10, 1e6


class Node:
    """A group or an array."""

    def __init__(self, core):
        self._core = core

    @property
    def name(self):
        """Path within the file."""
        return self._core.name

    @property
    def attrs(self):
        """Attributes: dict of numbers, arrays and texts; those of kinds that are not read are left out."""
        values = {name: self._core.attribute(name) for name in self._core.attribute_names}
        return {name: _plain(value) for name, value in values.items() if value is not None}


class Group(Node):
    """Members by name or path."""

    def __getitem__(self, path):
        if not self._core.contains(path):
            raise KeyError(f"{self.name} has no {path!r}")
        return _node(self._core.at(path))

    def __contains__(self, path):
        return self._core.contains(path)

    def __iter__(self):
        return iter(self._core.names)

    def items(self):
        """(name, member) of all."""
        return [(name, self[name]) for name in self]


class Array(Node):
    """An array: `array[()]`, `array[i]`, `array[first:last]`, further indices behind."""

    def __init__(self, core):
        super().__init__(core)
        self.shape = core.shape

    @property
    def dtype(self):
        """numpy dtype of the values."""
        return self._core.dtype

    def __len__(self):
        if not self.shape:
            raise TypeError(f"{self.name} is one value, and has no rows")
        return self.shape[0]

    def __iter__(self):
        return iter(self._core.read())

    def __contains__(self, name):
        raise TypeError(f"{self.name} is an array, and no group")

    def __getitem__(self, index):
        if isinstance(index, str):
            raise TypeError(f"{self.name} is an array, and no group: it has no {index!r}")
        if index == ():
            return self._core.read()[()]
        if not self.shape:
            raise IndexError(f"{self.name} is one value: index {index} was asked for")
        first, *rest = index if isinstance(index, tuple) else (index,)
        rows = len(self)
        if isinstance(first, slice) and first.step in (None, 1):
            start, stop, _ = first.indices(rows)
            part = self._core.rows(start, max(stop - start, 0))
            return part[(slice(None), *rest)]
        if isinstance(first, slice):
            return self._core.read()[(first, *rest)]
        if not -rows <= first < rows:
            raise IndexError(f"row {first} of {self.name} was asked for; it has {rows}")
        return self._core.rows(int(first) % rows, 1)[(0, *rest)]


def _node(core):
    return Group(core) if core.is_group else Array(core)


def _plain(value):
    """A number or a text for an array of one."""
    if value.dtype.kind == "S":
        value = np.char.decode(value, "utf-8", "replace")
    return value if value.shape else value.item()


class File(Group):
    """A file that Cairn wrote, or another one without compression. Raises FileError."""

    def __init__(self, path):
        super().__init__(_core.Hdf5Node.open(os.fspath(path)))

    def close(self):
        """Let go of the file; arrays that were taken from it keep it open."""
        self._core = None

    def __enter__(self):
        return self

    def __exit__(self, *exc):
        self.close()


def read_foreign(path, read):
    """read(file) of an HDF5 file of another program: by Cairn's reader; one with structures that it does not know (compressed
    arrays, later layouts) is written again in plain ones first, by a process of its own (plain_hdf5.py). Raises FileError."""
    try:
        with File(path) as file:
            return read(file)
    except UnknownStructure as error:
        unknown = error
    with tempfile.TemporaryDirectory() as folder:
        plain = os.path.join(folder, "plain.hdf5")
        limit = SECONDS + os.path.getsize(path) / BYTES_A_SECOND
        program = os.path.join(os.path.dirname(__file__), "plain_hdf5.py")
        # the second limit is for the case that nobody waits any more
        command = [sys.executable, "-E", program, os.path.abspath(path), plain, str(2 * abs(limit))]
        try:
            ended = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=limit)
        except subprocess.TimeoutExpired:
            raise FileError(path, f"the HDF5 library does not end on this file in {limit:.0f} s", unknown.remedy) from None
        if ended.returncode:
            told = ended.stderr.strip().rpartition("\n")[2] or f"ended with {ended.returncode}"
            raise FileError(path, f"HDF5 cannot read the file ({told})", unknown.remedy)
        with File(plain) as file:
            try:
                return read(file)
            except FileError as error:
                raise FileError(path, error.problem, error.remedy) from error
