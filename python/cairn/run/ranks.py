"""A simulation over several ranks: in turns in this process, or one a process of MPI."""

from __future__ import annotations

import contextlib
import hashlib
from dataclasses import fields, is_dataclass, replace

from .. import _core
from ..base.open_ranks import failing_alike, is_of_all, opened
from ..options.solvers import TOL, Auto, Default
from ..options.strategies import NSCD
from .compared import call_of, content_of
from .views import core_of


def with_default_solver(strategy):
    """The strategy, with Auto in the place of Default: sweeps of ranks alone do not solve contacts at rest to rounding.

    Steps of dense packs do not end earlier than others, since over ranks nothing takes back the overlap that they would leave."""
    if isinstance(strategy, NSCD) and isinstance(strategy.solver, Default):
        given = strategy.solver
        return replace(strategy, solver=Auto(tol=given.tol or TOL, min_iter=given.min_iter, max_iter=given.max_iter))
    return strategy


# what ranks compare of a liquid, see run/fluid.py
TOLD_OF_LIQUID = (
    "particles", "spacing", "density", "viscosity", "sound_speed", "smoothing", "artificial", "depth", "surface_tension",
    "incompressible", "position", "velocity", "pressure", "rules",
)  # fmt: skip


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
        self._exchange = opened(ranks)
        self.count, self.kind, self.rank = self._exchange.ranks, self._exchange.name, self._exchange.local[0]
        self.exchange = exchange
        simulation._stage.ranks = self._exchange
        liquid = simulation._fluid.told if simulation._fluid else {}
        networks = simulation.scene.networks
        self.check_same(
            "simulation",
            {
                **{f"{name} of the liquid": liquid.get(name) for name in TOLD_OF_LIQUID},
                **{kind: getattr(networks.get(kind), "given", None) for kind in ("electrical", "thermal")},
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
            state of all bodies so far; of NSCD "gathered_solves", the times so far that the contacts of all ranks were gathered
            on one rank, "gathered_rank", the one that solves them, and "gathered_bytes" of them, the last time; beside a liquid
            "liquid_imbalance", that of its sums.
        """
        found = core_of(self._simulation).figures()
        return {name: value if name.endswith("imbalance") else int(value) for name, value in found.items()}

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
        digest = [hashlib.blake2b(content_of(value), digest_size=6).digest() for value in told.values()]
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
            if self.kind != "mpi" or is_of_all(error):
                raise
            try:
                self._exchange.fail(f"{type(error).__name__}: {error}")
            except ValueError as told:
                raise told from error
            raise

    def failing_alike(self, path):
        """Makes an error within the `with` block, in what each process does with a file, one of all ranks; all ranks enter it.

        Parameters
        ----------
        path : path-like
            The file that it reads or writes.

        Raises
        ------
        FileError
            On every rank, if it failed on one: the error of that rank there, and one that names it on the others.
        """
        return failing_alike(self._exchange, path)

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
        """Makes steps within the `with` block leave the state of bodies with their ranks until it is read.

        All ranks have it behind the block, unless it ends by an error, or ranks share the scene from a file: it then stays with
        them until it is read.
        """
        core = core_of(self._simulation)
        _core.leave_state_with_ranks(core, True)
        try:
            yield
            if self._simulation.scene.ranks is None:
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
