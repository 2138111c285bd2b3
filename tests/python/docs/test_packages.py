"""Suggested packages exist under their names, and the extra `all` contains the others."""

import ast
import re
import sys
import tomllib
from pathlib import Path

import pytest
from cairn import cli
from cairn.pre import mesh

ROOT = Path(__file__).resolve().parents[3]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
EXTRAS = PROJECT["optional-dependencies"]
KNOWN = {re.split("[<>= ]", name)[0] for names in (PROJECT["dependencies"], *EXTRAS.values()) for name in names}


def test_all_holds_what_the_other_extras_do():
    apart = ("all", "test", "lint", "docs", "compas", "mpi", "precice")
    others = {name for extra, names in EXTRAS.items() if extra not in apart for name in names}
    assert others == set(EXTRAS["all"]) - {"vtk>=9.4"}  # which pyvista brings, and `cairn convert` takes


def asked_for():
    """Names after `pip install` in the package and its documents, and modules that are imported when they are used."""
    for path in (ROOT / "python").rglob("*.py"):
        text = path.read_text()
        yield from ((name, path) for name in re.findall(r"pip install ([a-z][\w-]*)", text))
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Call) and getattr(node.func, "id", getattr(node.func, "attr", "")) == "library":
                if node.args and isinstance(node.args[0], ast.Constant):
                    yield node.args[0].value.partition(".")[0], path
    for path in [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]:
        yield from ((name, path) for name in re.findall(r"pip install ([a-z][\w-]*)", path.read_text()))


def test_remedies_name_packages_that_are_there():
    found = list(asked_for())
    assert {"scipy", "trimesh", "matplotlib", "pyvista"} <= {name for name, _ in found}
    assert not [(name, path.name) for name, path in found if name not in KNOWN]


def test_a_missing_package_is_told_by_the_name_that_pip_knows(monkeypatch, tmp_path, capsys):
    monkeypatch.setitem(sys.modules, "scipy.spatial", None)
    with pytest.raises(ImportError, match=r"^scipy is needed for convex hulls: pip install scipy$"):
        mesh.library("scipy.spatial", "for convex hulls")
    (tmp_path / "p.dat").write_text("2 1 0 2 2 2 2 1 0 0 1 -1 0 0.5\n")
    monkeypatch.setitem(sys.modules, "scipy", None)
    assert cli.main(["solve", str(tmp_path / "p.dat")]) == 1
    assert capsys.readouterr().err == "cairn: error: scipy is needed for this: pip install scipy\n"
    assert set(cli.errors.PACKAGES.values()) <= KNOWN
