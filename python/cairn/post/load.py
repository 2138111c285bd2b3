"""Reads a run: `cairn.load(path)` gives its steps as numpy arrays."""

import os

from ..files.reader import Fields, Step, open_run
from ..names import teach
from .joined import JoinedRun
from .runs import Run

__all__ = ["Fields", "Run", "Step", "load", "open_run"]


def load(path):
    """Opens a run that a simulation wrote, also while it is being written.

    Parameters
    ----------
    path : path-like or list
        Name of a .vtkhdf file, or a list of such: one run that went on in several files, in their order; from the first output
        of a file on, this file counts and not those before it.

    Returns
    -------
    Run
        The run: `run[i]` is output i, `run.history` the numbers of every step.

    Raises
    ------
    ValueError
        If the path is no name.
    FileError
        If there is no such file, it is truncated, not a run of Cairn or of a later format.
    """
    if isinstance(path, (list, tuple)):
        return JoinedRun(path)
    if not isinstance(path, (str, bytes, os.PathLike)):
        raise ValueError(f"path is {path!r}: give the name of a .vtkhdf file, or a list of them")
    return Run(path)


teach(globals())
