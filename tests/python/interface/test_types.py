"""Stubs for type checkers and editors, of all that the build makes, and examples that pass mypy against them."""

import ast
import inspect
import os
import subprocess
import sys
from pathlib import Path

import cairn as cn
import pytest
from cairn import _core
from cairn.model import bulk

ROOT = Path(__file__).resolve().parents[3]
PACKAGE = ROOT / "python/cairn"
REMEDY = "run python script/stubs.py"


def told(stub):
    """Classes of a stub with the arguments of their constructors, functions with none, and its imports."""
    out = {}
    for node in ast.parse((PACKAGE / stub).read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ClassDef):
            own = next((f.args for f in node.body if isinstance(f, ast.FunctionDef) and f.name == "__init__"), None)
            out[node.name] = [] if own is None else [a.arg for a in (*own.args, *own.kwonlyargs)][1:]
        elif isinstance(node, ast.FunctionDef):
            out[node.name] = []
        elif isinstance(node, ast.ImportFrom):
            out |= {alias.asname or alias.name: [] for alias in node.names}
    return out


def test_stubs_tell_all_that_there_is():
    assert (PACKAGE / "py.typed").exists()
    core = told("_core.pyi")
    assert {name for name in vars(_core) if name[0] != "_"} - {"suitesparse"} <= set(core), REMEDY
    package = told("__init__.pyi")
    assert {name for name in dir(cn) if name in cn.__all__} <= set(package), REMEDY
    # Rows behind those that were there at import are of users' libraries, which other tests plug into this process.
    for rows, shipped in ((_core.laws(), cn.laws.LAWS), (_core.bulk_materials(), bulk.BULK_MATERIALS)):
        for row in rows[: len(shipped)]:
            assert set(package[row["python_name"]]) == {p[0] for p in row["parameters"]}, REMEDY
    networks = told("networks/__init__.pyi")
    for row in _core.conductances():
        if row["python_name"] != "Given":
            assert networks[row["python_name"]] == [p[0] for p in row["parameters"]], REMEDY


def test_stubs_are_those_of_this_build(tmp_path):
    pytest.importorskip("pybind11_stubgen")
    subprocess.run([sys.executable, ROOT / "script/stubs.py", tmp_path], check=True, capture_output=True)
    for name in ("_core.pyi", "__init__.pyi", "networks/__init__.pyi"):
        assert (tmp_path / name).read_text(encoding="utf-8") == (PACKAGE / name).read_text(encoding="utf-8"), f"{name}: {REMEDY}"


def test_signatures_are_those_of_the_lists():
    """Signatures in help(), notebooks and the reference."""
    assert str(inspect.signature(cn.Coulomb)) == "(*, mu)"
    assert str(inspect.signature(cn.Restitution)) == "(*, mu=0.0, normal=0.0, tangential=0.0, closing=1.0)"
    assert list(inspect.signature(cn.Newmark).parameters) == ["beta", "gamma"]
    assert "skin" in inspect.signature(cn.SmoothDEM).parameters and inspect.signature(cn.EventDriven).parameters
    for classes in (cn.laws.LAWS, cn.integrators.INTEGRATORS, cn.strategies.SOLVERS, cn.strategies.STRATEGIES):
        for cls in classes.values():
            assert not any(p.kind in (p.VAR_KEYWORD, p.VAR_POSITIONAL) for p in inspect.signature(cls).parameters.values()), cls


def mypy(request, *files):
    pytest.importorskip("mypy")
    command = [sys.executable, "-m", "mypy", "--cache-dir", request.config.cache.mkdir("mypy"), "--explicit-package-bases"]
    command += ["--follow-imports=silent", "--ignore-missing-imports", "--check-untyped-defs"]
    command += ["--disable-error-code=var-annotated", *files]
    env = {**os.environ, "MYPYPATH": str(ROOT / "python")}
    return subprocess.run(command, env=env, capture_output=True, text=True, cwd=ROOT).stdout


def test_examples_pass_the_type_checker(request):
    stubs = [PACKAGE / name for name in ("_core.pyi", "__init__.pyi", "networks/__init__.pyi")]
    out = mypy(request, *stubs, *sorted((ROOT / "examples").glob("*/*.py")))
    assert "Success: no issues found" in out, out


def test_the_type_checker_finds_mistakes(request, tmp_path):
    path = tmp_path / "wrong.py"
    path.write_text(
        "import cairn as cn\n"
        "cn.Coulomb(mew=0.4)\n"
        "cn.NLGS(tol='small')\n"
        "cn.Colomb(mu=0.4)\n"
        "cn.wall((0, 0), (0, 1))\n"
        "cn.networks.Sharvin(fre_path=1e-8)\n"
    )
    out = mypy(request, path)
    for line in range(2, 7):
        assert f"wrong.py:{line}: error" in out, out
