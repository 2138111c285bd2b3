"""Every parameter of every contact law has a unit and a meaning, in help() and in the tables of the documentation."""

import importlib.util
import re
from pathlib import Path

import cairn as cn
import pytest
from cairn import _core
from cairn.model.law_parameters import ONE_LAW, SHARED, told
from cairn.model.laws import LAWS

ROOT = Path(__file__).resolve().parents[3]
ROWS = [(law["python_name"], parameter[0]) for law in _core.laws() for parameter in law["parameters"]]


def test_each_parameter_has_a_unit_and_a_meaning():
    assert not [row for row in ROWS if told(*row) is None]
    for unit, meaning in [*SHARED.values(), *ONE_LAW.values()]:
        assert re.fullmatch(r"[-\w/ ,()]+", unit) and len(meaning) > 8


def test_nothing_is_told_of_parameters_that_are_not():
    assert set(ONE_LAW) <= set(ROWS)
    assert set(SHARED) <= {name for law, name in ROWS if (law, name) not in ONE_LAW}


@pytest.mark.parametrize("law", LAWS)
def test_help_tells_them(law):
    text = getattr(cn, law).__doc__
    for name in getattr(cn, law).parameter_names:
        unit, meaning = told(law, name)
        assert f"{name} : float" in text and f"    {meaning[0].upper()}{meaning[1:]} [{unit}], from " in text


def test_the_tables_of_the_documentation_tell_them():
    """Each parameter has a row; defaults and ranges are numbers in words, not the fields of the lists."""
    specification = importlib.util.spec_from_file_location("tables", ROOT / "docs/tables.py")
    tables = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(tables)
    page = tables.page()
    for law, name in ROWS:
        unit, meaning = told(law, name)
        begin, end = re.escape(f"| {law} | `{name}` | {unit} | "), re.escape(f" | {meaning} |")
        assert re.search(f"^{begin}.*{end}$", page, re.M), (law, name)
    assert not re.search(r"\w:[-\w.]*:[-\w.]+", page) and "`ratio` = 2/7" in page and "| 0 to ∞ |" in page
