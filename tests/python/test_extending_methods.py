"""A new integrator, a new strategy: one file and a row of its list. No other file names those that there are."""

import re
from pathlib import Path

import cairn as cn
import pytest
from cairn import _core

TOP = Path(__file__).parents[2]
SOURCES = [p for folder in ("core_f90", "cxx", "bindings", "fortran") for p in (TOP / folder).rglob("*") if p.is_file()]
KINDS = (".f90", ".cpp", ".hpp", ".h", ".c", ".def", ".cmake", ".txt")
TEXTS = {p: p.read_text(errors="ignore") for p in SOURCES if p.suffix in KINDS}


def rows(path, macro):
    return re.findall(rf"^{macro}\((\w+)", (TOP / path).read_text(), flags=re.M)


def files_with(word):
    return sorted(p.relative_to(TOP).as_posix() for p, text in TEXTS.items() if re.search(rf"\b{word}\b", text))


@pytest.mark.parametrize("name", rows("core_f90/integrators/integrators.def", "CAIRN_INTEGRATOR"))
def test_an_integrator_is_one_file_and_a_row(name):
    """Its kernel is named in its own file alone; the header, the registry, Python, C and Fortran read the row."""
    assert files_with(f"cairn_integrator_{name}") == [f"core_f90/integrators/{name}.f90"]
    assert not re.search(rf"\b{name}\.f90", (TOP / "core_f90/sources.cmake").read_text())
    row = next(row for row in _core.integrators() if row[0] == name)
    made = getattr(cn, row[1])()
    assert made.settings()["integrator"] == name and set(made.values) == {p[0] for p in row[3]}
    assert cn.NSCD(integrator=made).moved_by() == made


@pytest.mark.parametrize("name", rows("cxx/strategies/strategies.def", "CAIRN_STRATEGY"))
def test_a_strategy_is_a_page_and_a_row(name):
    """What makes it is named in its page alone."""
    assert files_with(f"make_{name}") == [f"cxx/strategies/{name}.cpp"]
    assert name in [row[0] for row in _core.strategies()]


def test_the_walks_say_what_it_takes():
    text = (TOP / "docs/extending.md").read_text()
    for title in ("An integrator", "A strategy"):
        walk = text.split(f"## {title}\n")[1].split("\n## ")[0]
        assert "One file and a row" in walk
        for path in re.findall(r"`((?:core_f90|cxx|tests)/[\w./]+)`", walk):
            assert "NAME" in path or (TOP / path).exists(), path
