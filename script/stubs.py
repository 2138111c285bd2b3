"""Writes what type checkers and editors read of names that the build makes: python/cairn/_core.pyi, from the compiled module
(pybind11-stubgen), and python/cairn/__init__.pyi, with a class for each row of the core's lists.

    python script/stubs.py [FOLDER]     into FOLDER in place of python/cairn
"""

import ast
import dataclasses
import math
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import cairn
from cairn import _core
from cairn.options import solvers, strategies

ROOT = Path(__file__).resolve().parents[1]
HEAD = "# written by script/stubs.py from the lists of the core: change those, and run it\n"
# settings of strategies that the core lists are of these kinds
PLAIN = re.compile(r"float|int|bool|str|None|ContactSolver|Integrator|[ |]")


def core(folder):
    """The stub of the compiled module."""
    with tempfile.TemporaryDirectory() as made:
        subprocess.run([sys.executable, "-m", "pybind11_stubgen", "cairn._core", "-o", made, "--exit-code"], check=True)
        text = next(Path(made).rglob("_core.pyi")).read_text(encoding="utf-8")
    text = re.sub(r":\n +\.\.\.", ": ...", text)
    text = re.sub(r"^suitesparse: str = .*$", "suitesparse: str", text, flags=re.M)  # of the build at hand
    (folder / "_core.pyi").write_text(HEAD + text, encoding="utf-8")


def exports(module):
    """Imports of python/cairn/MODULE/__init__.py as exports."""
    tree = ast.parse((ROOT / "python/cairn" / module / "__init__.py").read_text(encoding="utf-8"))
    for node in tree.body:
        if isinstance(node, ast.ImportFrom) and node.names[0].name != "_openmp":
            for item in node.names:
                yield f"from {'.' * node.level}{node.module or ''} import {item.name} as {item.asname or item.name}"


def later():
    """Lazy imports of the package, and its folders."""
    for name, module in cairn._LATER.items():
        if module != "model.bulk":  # classes of a list, below
            yield f"from .{module} import {name} as {name}"
    for name in ("base", "files", "model", "options", "plugs", "post", "run"):
        yield f"from . import {name} as {name}"
    for name, module in cairn._PARTS.items():
        place, _, last = module.rpartition(".")
        yield f"from .{place} import {last} as {name}"


def _told(default):
    """A default in a stub: literals as they are, anything else as `...`."""
    plain = isinstance(default, (float, int, str, type(None))) and default not in (math.inf, -math.inf)
    return repr(default) if plain else "..."


def made(name, base, given):
    """A class that a list makes. given: (name, type, default or None) of its arguments, by name alone."""
    words = [f"{n}: {kind}" + ("" if default is None else f" = {_told(default)}") for n, kind, default in given]
    words = ", ".join(["self", *(["*"] if words else []), *words])
    return f"class {name}({base}):\n    def __init__({words}) -> None: ...\n"


def of_dataclass(cls, base):
    fields = []
    for f in dataclasses.fields(cls):
        kind = f.type if PLAIN.sub("", f.type) == "" else "Any"
        default = f.default if f.default is not dataclasses.MISSING else ...
        fields.append((f.name, kind, default))
    words = ", ".join(f"{n}: {kind} = {_told(d)}" for n, kind, d in fields)
    lines = [f"class {cls.__name__}({base}):", *(f"    {n}: {kind}" for n, kind, _ in fields)]
    return "\n".join([*lines, f"    def __init__(self, {words}) -> None: ..."]) + "\n"


def package(folder):
    """The stub of the package."""
    out = [*sorted({*exports("."), *later()}), "from typing import Any", "from .model.bulk import BulkMaterial"]
    out += ["from .options.integrators import Integrator"]
    out += ["from .options.solvers import ContactSolver, ProblemSolver", "from .options.strategies import Strategy", ""]
    for rows, base in ((_core.laws(), "Law"), (_core.bulk_materials(), "BulkMaterial")):
        out += [made(d["python_name"], base, [(p[0], "float", p[1]) for p in d["parameters"]]) for d in rows]
    out += [made(row[1], "Integrator", [(p[0], "float", p[1]) for p in row[3]]) for row in _core.integrators()]
    out += [of_dataclass(cls, cls.__mro__[1].__name__) for cls in solvers.SOLVERS.values()]
    plain = {"NSCD", "Carpenter", "GranularElement", "SmoothDEM"}  # classes of a module, imported above
    listed = [name for name in strategies.STRATEGIES if name not in plain]
    out += [f"class {name}(Strategy):\n    def __init__(self, **options: Any) -> None: ...\n" for name in listed]
    (folder / "__init__.pyi").write_text("\n".join([HEAD, *out, "__version__: str", "__all__: list[str]", ""]), encoding="utf-8")


def networks(folder):
    """The stub of networks of heat and current."""
    out = [HEAD, *exports("networks"), "from typing import Any", ""]
    for d in _core.conductances():
        if d["python_name"] == "Given":
            tables = [(name, "Any", None) for name in ("pressures", "gaps", "h")]
            out.append(made("Given", "Conductance", [*tables, ("area", "float", None)]))
        else:
            out.append(made(d["python_name"], "Conductance", [(p[0], "float", p[1]) for p in d["parameters"]]))
    (folder / "networks").mkdir(exist_ok=True)
    (folder / "networks/__init__.pyi").write_text("\n".join(out), encoding="utf-8")


folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "python/cairn"
for write in (core, package, networks):
    write(folder)
written = [folder / name for name in ("_core.pyi", "__init__.pyi", "networks/__init__.pyi")]
for command in (["check", "-q", "--select", "I", "--fix"], ["format", "-q"]):
    subprocess.run([sys.executable, "-m", "ruff", *command, "--config", str(ROOT / "pyproject.toml"), *written], check=True)
