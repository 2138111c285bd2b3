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
# begins of errors that all ranks raise, each with the rank that tells it
_TOLD = re.compile(r"rank (\d+) of \d+(: | makes the call )")
_CALLS = re.compile(r"ranks make unlike calls: ranks? (\d+)")


def _fails_elsewhere(error):
    """True for the error of another rank."""
    told = _TOLD.search(str(error))
    return told is not None and told[2] == ": "


def is_of_all(error):
    """True for an error that all ranks raise."""
    told = str(error)
    alike = getattr(error, "is_of_all_ranks", False) or told.startswith("ranks were given unlike")
    return alike or bool(_TOLD.match(told) or _CALLS.match(told))


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
    if (teller := teller_of(error)) is not None:
        leave_to(teller, number_of_process())
    text = "".join(traceback.format_exception(kind, error, trace)).rstrip()
    sys.stdout.flush()
    named = teller is not None and (teller != number_of_process() or not getattr(error, "is_of_all_ranks", False))
    of_rank = "" if named else f"\n(rank {number_of_process()} of {_exchange.ranks})"
    print(text + of_rank, file=sys.stderr, flush=True)
    end_all()


def teller_of(error):
    """Rank that tells an error that all ranks raise; None for an error of this process alone."""
    if not is_of_all(error):
        return None
    told = _TOLD.search(str(error)) or _CALLS.match(str(error))
    if told is None and getattr(error, "is_of_all_ranks", False):
        return number_of_process()  # the error of this rank, which others name
    return int(told[1]) if told else 0


def leave_to(teller, me, seconds=5.0):
    """Waits on ranks but the teller, which tells an error and ends all meanwhile."""
    sys.stdout.flush()
    if me != teller:
        time.sleep(seconds)


def end_all():
    """Ends all processes of MPI, with status 1; returns if there are none."""
    if _exchange is not None:
        _exchange.abort(1)


def number_of_process():
    """Rank of this process among those of MPI; None before a simulation runs over these."""
    return None if _exchange is None else _exchange.local[0]
