"""Checkpoints: a nested dict of arrays, numbers and text in an HDF5 file, replaced as a whole or not at all.

Bits come back as they were: NaN with their payload, -0.0, subnormal numbers. A checksum over names, types, shapes and
bytes is stored and checked, so that a damaged checkpoint is refused instead of restarted from. The reader and writer are
those of cxx/files/stored_tree.hpp.
"""

import os

from .. import _core
from ..base.errors import named

FORMAT_NAME = "cairn-checkpoint"
STAYS_IN_FILE = 1 << 16  # bytes from which on an array of a file that ranks share stays there


def checkpoint_path(run_path):
    """Path of the checkpoint of a run: beside it, <run>.checkpoint.h5 (run without its .vtkhdf)."""
    stem, extension = os.path.splitext(os.fspath(run_path))
    return (stem if extension == ".vtkhdf" else os.fspath(run_path)) + ".checkpoint.h5"


def save(path, state, what="a checkpoint"):
    """Write `state`, a nested dict of arrays, numbers, text, None and lists of these, to `path`.

    The file is written under another name, brought to the disk, then renamed: at every instant `path` is the old
    checkpoint or the new one. Raises FileError (full disk, no permission ...), TypeError for what cannot be stored.
    """
    _core.save_tree(named(path, what, ".h5"), state)


def load(path, what="a checkpoint", given=".checkpoint.h5", stays_from=None):
    """The state that `save` wrote, bit for bit.

    Arrays of at least `stays_from` bytes stay in the file, which is read where they are looked at, and cannot be written.
    Raises FileError if there is no such file, it is truncated, damaged, something else or of a later format.
    """
    if not isinstance(path, (str, bytes, os.PathLike)):
        raise ValueError(f"path of {what} is {path!r}: give the name of a {given} file")
    return _core.load_tree(os.fspath(path), what, given, stays_from)
