"""A simulation over several ranks: in turns in this process, or one a process of MPI."""

from __future__ import annotations

import atexit
import contextlib
import hashlib
import os
import re
import sys
import time
import traceback
from dataclasses import fields, is_dataclass, replace
from pathlib import Path

from .. import _core
from ..options.solvers import NLGS, TOL, Default
from ..options.strategies import NSCD
from .compared import call_of
from .views import core_of


def solved_by_sweeps(strategy):
    """The strategy with NLGS in place of the solver that is chosen by the scene: over ranks sweeps solve contacts."""
    if isinstance(strategy, NSCD) and isinstance(strategy.solver, Default):
        of = strategy.solver
        return replace(strategy, solver=NLGS(tol=of.tol or TOL, min_iter=of.min_iter, max_iter=of.max_iter))
    return strategy


def library():
    """Path of the library cairn_mpi: beside the compiled module, or what the variable CAIRN_MPI names."""
    return os.environ.get("CAIRN_MPI") or str(Path(_core.__file__).with_name("libcairn_mpi.so"))


class Ranks:
    """Ranks that a simulation runs over.

    Attributes
    ----------
    count : int
        Number of ranks.
    rank : int
        The rank of this process; 0 where it has all of them.
    kind : {"serial", "virtual", "mpi"}
        How they run.
    exchange : {"colour", "sweep"}
        When ranks tell each other what contacts changed.
    """

    def __init__(self, simulation, ranks, exchange):
        self._simulation = simulation
        if ranks == "mpi" or hasattr(ranks, "py2f"):
            self._exchange = _core.mpi_ranks(library(), None if ranks == "mpi" else ranks.py2f())
            _end_all_by_errors(self._exchange)
        else:
            self._exchange = _core.virtual_ranks(ranks)
        self.count, self.kind, self.rank = self._exchange.ranks, self._exchange.name, self._exchange.local[0]
        self.exchange = exchange
        simulation._stage.ranks = self._exchange
        self.check_same(
            "simulation",
            {
                "bodies": f"{core_of(simulation).body_count} of mark {simulation._fingerprint()[:12]}",
                "laws": simulation._rules,
                "gravity": "function" if callable(simulation.scene.gravity) else tuple(simulation.scene.gravity),
                "dt": simulation.dt,
                "strategy": _Given(simulation.strategy),
            },
        )
        _core.over_ranks(core_of(simulation), self._exchange, exchange == "sweep")

    @property
    def first(self):
        """True if rank 0 is in this process: it alone writes files and prints."""
        return self.rank == 0

    @property
    def owner(self):
        """Rank of each body, in the order of insertion, (n,); empty before the first step."""
        return _core.owners_of_bodies(core_of(self._simulation))

    @property
    def held_bytes(self):
        """Bytes that each rank of this process holds for its bodies and contacts, (ranks,)."""
        return _core.bytes_of_ranks(core_of(self._simulation))

    def figures(self):
        """Gives figures of the last step.

        Returns
        -------
        dict
            "ranks", "colours"; "ghosts" of the ranks of this process; "messages", "message_bytes" and "sums" that these sent and
            made in the step; "imbalance", the largest counted cost of a rank over the mean; "partitions" and "gathers" of the
            state of all bodies so far.
        """
        found = core_of(self._simulation).figures()
        return {name: value if name == "imbalance" else int(value) for name, value in found.items()}

    def check_same(self, of, told):
        """Compares what ranks were given; all ranks call it.

        Parameters
        ----------
        of : str
            Its name in the message.
        told : dict
            {name: value}.

        Raises
        ------
        ValueError
            On every rank, if ranks have unlike values; it names these and the ranks.
        """
        self._exchange.meet(of)
        digest = [hashlib.blake2b(repr(value).encode(), digest_size=6).digest() for value in told.values()]
        unlike = self._exchange.differ([float(int.from_bytes(d, "big")) for d in digest])
        differing = {name: value for (name, value), differs in zip(told.items(), unlike) if differs}
        if differing:
            self._exchange.meet(call_of(f"the {of}", differing))
            names = ", ".join(differing)  # where their texts are alike
            raise ValueError(f"ranks were given unlike {names} of the {of}: run the same script to the same values on all ranks")

    def check_same_call(self, of, given):
        """Compares the arguments that ranks gave to a call; all ranks call it.

        Parameters
        ----------
        of : str
            Name of the call.
        given : dict
            {name: value}.

        Raises
        ------
        ValueError
            On every rank, if ranks gave unlike ones; it names ranks and values.
        """
        self._exchange.meet(call_of(of, given))

    @contextlib.contextmanager
    def failing_together(self):
        """Makes an error within the `with` block, in what this process does by itself, one of all ranks at their next call."""
        try:
            yield
        except Exception as error:
            if self.kind != "mpi" or _is_of_all(error):
                raise
            try:
                self._exchange.fail(f"{type(error).__name__}: {error}")
            except ValueError as told:
                raise told from error
            raise

    def any(self, value, of="ranks.any"):
        """Gives whether a value is true on any rank. All ranks call it.

        Parameters
        ----------
        value : bool
            That of this process.
        of : str, default "ranks.any"
            Name of the call that asks, for messages.

        Returns
        -------
        bool
            True if it is on one.
        """
        return _core.any_rank(core_of(self._simulation), bool(value), of)

    @contextlib.contextmanager
    def leaving_state(self):
        """Makes steps within the `with` block leave the state of bodies with their ranks until it is read; all ranks have it
        behind the block, unless it ends by an error."""
        core = core_of(self._simulation)
        _core.leave_state_with_ranks(core, True)
        try:
            yield
            _ = core.scene
        finally:
            _core.leave_state_with_ranks(core, False)

    def __repr__(self):
        return f"<Ranks: {self.count}, {self.kind}, rank {self.rank}>"


class _Given:
    """A strategy, which messages show by its options that are not the usual ones; all of its settings are compared."""

    def __init__(self, strategy):
        self._strategy = strategy

    def to_dict(self):
        return self._strategy.settings()

    def __repr__(self):
        mark = hashlib.blake2b(repr(self._strategy.settings()).encode(), digest_size=3).hexdigest()
        return f"{_unusual(self._strategy)} ({mark})"


def _unusual(value):
    """Text of a value; of an option, those of its fields alone that are not as by default."""
    if not is_dataclass(value):
        return repr(value)
    parts = [f"{f.name}={_unusual(of)}" for f in fields(value) if repr(of := getattr(value, f.name)) != repr(f.default)]
    return f"{type(value).__name__}({', '.join(parts)})"


_exchange = None  # of the ranks of MPI that this process is one of
# begins of errors that all ranks raise, each with the rank that tells it
_TOLD = re.compile(r"rank (\d+) of \d+(: | makes the call )")
_CALLS = re.compile(r"ranks make unlike calls: ranks? (\d+)")


def _is_of_all(error):
    """True for an error that all ranks raise."""
    told = str(error)
    return bool(_TOLD.match(told) or _CALLS.match(told)) or told.startswith("ranks were given unlike")


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
    of_rank = "" if teller is not None else f"\n(rank {number_of_process()} of {_exchange.ranks})"
    print(text + of_rank, file=sys.stderr, flush=True)
    end_all()


def teller_of(error):
    """Rank that tells an error that all ranks raise; None for an error of this process alone."""
    told = _TOLD.match(str(error)) or _CALLS.match(str(error))
    return int(told[1]) if told else 0 if _is_of_all(error) else None


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
