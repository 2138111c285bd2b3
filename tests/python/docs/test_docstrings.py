"""Docstrings in the sections of numpydoc: modules that have them keep them, and their examples run."""

import doctest
import importlib
import sys
import tomllib
from pathlib import Path

import cairn
import numpy
import pytest

ROOT = Path(__file__).resolve().parents[3]
MODULES = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["cairn"]["docstrings"]["modules"]
FEWEST = 22  # modules of the list, which grows


def test_the_list_of_modules_grows():
    assert len(set(MODULES)) >= FEWEST


@pytest.mark.parametrize("module", MODULES)
def test_examples_of_docstrings_run(module):
    """Examples take cairn as cn and numpy as np for granted."""
    found = doctest.testmod(importlib.import_module(module), globs={"cn": cairn, "np": numpy})
    assert not found.failed


def test_faults_of_docstrings_are_found(tmp_path, monkeypatch):
    """A parameter and a result that the docstring leaves out; private names and sound docstrings pass."""
    pytest.importorskip("numpydoc")
    monkeypatch.syspath_prepend(str(ROOT / "script"))
    monkeypatch.syspath_prepend(str(tmp_path))
    import check_docstrings

    text = '''def speed(h):
    """Gives a speed."""
    return h


def _other(h):
    return h


def stop():
    """Stops."""
'''
    (tmp_path / "with_faults.py").write_text(text)
    told = list(check_docstrings.faults("with_faults"))
    assert [line.split(" ")[:2] for line in told] == [["with_faults.speed:", "PR01"], ["with_faults.speed:", "RT01"]]
    sys.modules.pop("with_faults")
