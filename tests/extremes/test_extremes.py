"""The small cells of the table; script/bench extremes runs them all."""

import math
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import page  # noqa: E402
import table  # noqa: E402

SMALL = [cell for cell in table.cells() if cell.small]


def known(cell):
    """A cell that is known to fail fails here as soon as it is right, so that its reason does not outlive it."""
    return [pytest.mark.xfail(reason=cell.weakness, strict=True)] if cell.weakness else []


@pytest.mark.parametrize("cell", [pytest.param(cell, id=cell.name, marks=known(cell)) for cell in SMALL])
def test_cell(cell):
    for figure in cell.check():
        print(f"{figure.name}: figure {figure.figure:.9g} reference {figure.reference:.9g} error {figure.error:.3g}")
        assert math.isfinite(figure.figure), f"{figure.name} is {figure.figure}"
        assert figure.error <= figure.gate, f"{figure.name}: {figure.figure} for {figure.reference}, gate {figure.gate:g}"


def test_names_are_unique():
    names = [cell.name for cell in table.cells()]
    assert len(names) == len(set(names))


def test_a_wrong_answer_fails():
    """The table can fail: another reference, a number that is none, an exception are no `ok`."""
    wrong = [
        lambda: [table.s.near("reaction", 1.0, 1.001, 1e-9)],
        lambda: [table.s.near("reaction", [1.0, float("nan")], 1.0, 1e-9)],
        lambda: [table.s.near("reaction", [], 1.0, 1e-9)],
        lambda: 1 / 0,
    ]
    for check in wrong:
        assert table.Cell("a", "b", "c", "d", check).outcome()[-1] == "FAIL"
    known_wrong = table.Cell("a", "b", "c", "d", wrong[0], weakness="reason")
    assert known_wrong.outcome()[-1] == "FAIL: reason"
    assert "Of 1 cells 1 fail: a: b." in page.page([(known_wrong, "figure", 1.0, "FAIL: reason")])
