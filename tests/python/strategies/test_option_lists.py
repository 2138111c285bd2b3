"""Settings of strategies: the core's list and Python's classes say the same."""

import dataclasses
import math

import cairn as cn
import pytest
from cairn import _core
from cairn.options.solvers import NLGS


@pytest.mark.parametrize("name, strategy", [("nscd", cn.NSCD(solver=NLGS())), ("smooth_dem", cn.SmoothDEM())])
def test_defaults_of_the_core_are_those_of_python(name, strategy):
    rows = {row["name"]: row for row in _core.strategy_options(name)}
    given = strategy.settings()
    assert given.pop("strategy") == name
    assert set(given) <= set(rows)
    for key, value in given.items():
        default = rows[key]["default"]
        assert type(default) is type(value)
        assert default == value or (math.isnan(default) and math.isnan(value))
    assert set(rows) - set(given) <= {"memory", "stiffness", "ratio"}  # of solvers that keep factors, of poses


def test_ranges_of_the_core_are_those_of_python():
    for name, ends in {"theta": (0.5, 1.0), "threads": (0, 1024)}.items():
        row = next(r for r in _core.strategy_options("nscd") if r["name"] == name)
        assert (row["smallest"], row["largest"], row["ends"]) == (*ends, "[]")
        for value in ends:
            dataclasses.replace(cn.NSCD(), **{name: value})
        with pytest.raises(ValueError, match=name):
            dataclasses.replace(cn.NSCD(), **{name: ends[1] + 1})


def test_strategies_are_rows_that_python_knows_by_class_and_by_name():
    assert {row[0] for row in _core.strategies()} >= {"nscd", "carpenter", "granular_element", "smooth_dem"}
    for row, python_name, meaning, laws, _ in _core.strategies():
        kind = getattr(cn, python_name)
        assert kind.row == row and meaning and laws
        needed = {"stiffness": 1e5} if row == "granular_element" else {}
        assert cn.strategy(row, **needed) == cn.strategy(python_name, **needed) == kind(**needed)
        assert {o["name"] for o in _core.strategy_options(row)} >= set(kind(**needed).settings()) - {"strategy"}
    with pytest.raises(ValueError, match="nscd.*did you mean"):
        cn.strategy("nscdd")
