"""An HDF5 file that grows, and is a complete HDF5 file at every instant: see cxx/files/growing_file.hpp."""

import os

from .. import _core
from .._core import GrowingFile

__all__ = ["GrowingFile", "restore_superblock"]


def restore_superblock(path):
    """Go back to the last commit that the disk was known to hold; for a file that lost power while it was written.

    Returns True if that changed the file. Raises FileError if there is nothing to go back to.
    """
    return _core.restore_superblock(os.fspath(path))
