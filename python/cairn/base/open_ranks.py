"""Processes of MPI as ranks: opened once, and ended together by errors that nobody catches."""

from __future__ import annotations

import atexit
import contextlib
import os
import re
import sys
import time
import traceback
from pathlib import Path

from .. import _core
from .errors import FileError


def library():
    """Path of the library cairn_mpi: beside the compiled module, or what the variable CAIRN_MPI names."""
    return os.environ.get("CAIRN_MPI") or str(Path(_core.__file__).with_name("libcairn_mpi.so"))


def opened(ranks):
    """Exchange of the ranks that a scene or a simulation runs over.

    Parameters
    ----------
    ranks : int, "mpi" or communicator of mpi4py
        As `given_ranks.asked` gives them.

    Returns
    -------
    _core.Exchange
        That of MPI makes errors that nobody catches end all processes.
    """
    if ranks != "mpi" and not hasattr(ranks, "py2f"):
        return _core.virtual_ranks(ranks)
    exchange = _core.mpi_ranks(library(), None if ranks == "mpi" else ranks.py2f())
    _end_all_by_errors(exchange)
    return exchange


@contextlib.contextmanager
def failing_alike(exchange, path):
    """Makes an error within the `with` block, in what each process does with a file, one of all ranks; all ranks enter it.

    Parameters
    ----------
    exchange : _core.Exchange
        That of the ranks.
    path : path-like
        The file that it reads or writes.

    Raises
    ------
    FileError
        On every rank, if it failed on one: the error of that rank there, and one that names it on the others.
    """
    try:
        yield
    except Exception as error:
        if exchange.name == "mpi" and not is_of_all(error):
            with contextlib.suppress(ValueError):  # the same, as the others raise it
                exchange.fail(f"{type(error).__name__}: {error}")
            error.is_of_all_ranks = True
        raise
    try:
        exchange.meet("the end of its work with a file")  # until then it gives others what they read
    except ValueError as error:
        if _fails_elsewhere(error):
            alike = FileError(path, str(error))
            alike.is_of_all_ranks = True
            raise alike from None
        raise


_exchange = None  # of the ranks of MPI that this process is one of
_TOLD = re.compile(r"rank (\d+) of \d+(:| makes the call)")  # begin of errors that all ranks raise


def _fails_elsewhere(error):
    """True for the error of another rank."""
    told = _TOLD.search(str(error))
    return told is not None and told[2] == ":"


def is_of_all(error):
    """True for an error that all ranks raise."""
    alike = getattr(error, "is_of_all_ranks", False) or str(error).startswith("ranks were given unlike")
    return alike or _TOLD.match(str(error)) is not None


def _end_all_by_errors(exchange):
    """Makes errors that nobody catches end all processes."""
    global _exchange
    if _exchange is None:
        sys.excepthook = ended_by
        atexit.register(_core.end_ranks)  # while simulations still serve what others read
    _exchange = exchange


def ended_by(kind, error, trace):
    """Prints an error with the number of the rank, and ends all processes of MPI; returns if there are none.

    Parameters
    ----------
    kind : type
        Class of the error.
    error : BaseException
        The error.
    trace : traceback
        Where it was raised.
    """
    if _exchange is None:
        return
    me, count = _exchange.local[0], _exchange.ranks
    told_by = _TOLD.search(str(error)) if is_of_all(error) else None
    everywhere = told_by is not None and told_by[2] == ":"
    if everywhere and me != int(told_by[1]):
        time.sleep(5)  # the rank that it names tells it and ends all
    sys.stdout.flush()
    text = "".join(traceback.format_exception(kind, error, trace)).rstrip()
    print(text if everywhere else f"{text}\n(rank {me} of {count})", file=sys.stderr, flush=True)
    _exchange.abort(1)
