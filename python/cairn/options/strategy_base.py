"""Base of strategies of time stepping, and of those that the core's list defines with their options."""

from __future__ import annotations

from .. import _core
from ..base import checks
from ..names import one_of


class Strategy:
    """Base of strategies of time stepping: a row of the core's list of strategies and its settings."""

    row = ""  # its name in the core
    stages = False  # True if it has the stages of NSCD, see run/stages.py
    pose = "moreau"  # the condition at contacts
    end_share = 0.5  # weight of the end of the step in gravity and forces that change with time; the rest is its start

    def for_scene(self, core, rules=(), meshes=()):
        """Gives this strategy with the solver chosen for a core scene.

        Parameters
        ----------
        core : _core.Scene
            The scene of the core.
        rules : sequence, optional
            (a, b, law) of each rule.
        meshes : sequence, optional
            (mass, mass of a contact) [kg] of each free deformable body.

        Returns
        -------
        Strategy
            This strategy, or a copy with the solver.
        """
        return self

    def settings(self):
        """Gives the settings for the core.

        Returns
        -------
        dict
            Options by name, and the row under `strategy`.
        """
        return {"strategy": self.row}


class Listed(Strategy):
    """Base of strategies defined by the core's list alone, with the options listed there.

    Parameters
    ----------
    **options : float, int, bool or str
        Options by name; those that are not given have the default of the list.

    Raises
    ------
    ValueError
        If an option is unknown or out of its range.
    """

    def __init__(self, **options):
        rows = {row["name"]: row for row in _core.strategy_options(self.row)}
        self._options = {}
        for name, value in options.items():
            row = rows[one_of("option of " + self.row, name, tuple(rows))]
            self._options[name] = _checked_option(row, value)
        for name in rows:
            setattr(self, name, self._options.get(name, rows[name]["default"]))

    def __eq__(self, other):
        return isinstance(other, Listed) and self.settings() == other.settings()

    def __hash__(self):
        return hash(tuple(sorted(self.settings().items())))

    def __repr__(self):
        return f"{type(self).__name__}({', '.join(f'{name}={value!r}' for name, value in self._options.items())})"

    def settings(self):
        """Gives the settings for the core.

        Returns
        -------
        dict
            Options by name, and the row under `strategy`.
        """
        return {"strategy": self.row, **self._options}


def _checked_option(row, value):
    """Value checked against kind and range of a row of the core's options."""
    name = row["name"]
    if row["kind"] == "text":
        return one_of(name, value, tuple(row["texts"]))
    if row["kind"] == "flag":
        return bool(checks.flag(name, value))
    value = int(checks.count(name, value, -checks.INT32, checks.INT32)) if row["kind"] == "whole" else checks.number(name, value)
    low = value >= row["smallest"] if row["ends"][0] == "[" else value > row["smallest"]
    high = value <= row["largest"] if row["ends"][1] == "]" else value < row["largest"]
    if not (low and high):
        ends = f"{row['ends'][0]}{row['smallest']:g}, {row['largest']:g}{row['ends'][1]}"
        raise ValueError(f"{name} is {value}: give a value in {ends}, {row['meaning']}")
    return value
