"""Imports among the modules of the package, those in functions too: no circle, and none of a module that is not there."""

import ast
import graphlib
from pathlib import Path

import pytest

SOURCES = Path(__file__).resolve().parents[3] / "python"


def modules(folder):
    """{name: path} of all modules of the package below a folder."""
    found = {}
    for path in folder.joinpath("cairn").rglob("*.py"):
        parts = path.relative_to(folder).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def for_types_alone(node):
    """True for a block of imports that type checkers read alone."""
    return isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test)


def imported(name, path):
    """Names of the modules and packages of Cairn that a module imports, at any depth of its source. For `from a import b` that is
    a.b, which may be a module or a member of a."""
    package = name.split(".") if path.name == "__init__.py" else name.split(".")[:-1]
    left = [ast.parse(path.read_text(encoding="utf-8"))]
    while left:
        node = left.pop()
        left += [inner for inner in ast.iter_child_nodes(node) if not for_types_alone(inner)]
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) + 1 - node.level] if node.level else []
            origin = ".".join([*above, *([node.module] if node.module else [])])
            yield from (f"{origin}.{alias.name}" for alias in node.names)


def graph(folder):
    """{module: modules that it imports} of the package below a folder. The compiled module is at the bottom, and left out."""
    known = modules(folder)
    edges = {name: set() for name in known}
    for name, path in known.items():
        for target in imported(name, path):
            if target.partition(".")[0] != "cairn" or target.startswith("cairn._core"):
                continue
            origin = target.rpartition(".")[0]
            assert target in known or origin in known, f"{name} imports {target}, which is not there"
            edges[name].add(target if target in known else origin)
    return edges


def circle(edges):
    """Modules that import each other in a circle, in order; empty without any."""
    try:
        list(graphlib.TopologicalSorter(edges).static_order())
    except graphlib.CycleError as error:
        return error.args[1]
    return []


def test_modules_do_not_import_each_other_in_a_circle():
    edges = graph(SOURCES)
    assert len(edges) > 200
    assert not circle(edges), " <- ".join(circle(edges))


@pytest.mark.parametrize(
    "lazy, closed", [("def f():\n    from .b import g\n", True), ("def f():\n    from math import pi\n", False)]
)
def test_a_circle_through_a_function_is_found(tmp_path, lazy, closed):
    package = tmp_path / "cairn"
    package.mkdir()
    for name, text in (("__init__", ""), ("a", lazy), ("b", "from . import a\n")):
        (package / f"{name}.py").write_text(text)
    assert bool(circle(graph(tmp_path))) == closed
    (package / "b.py").write_text("from .gone import f\n")
    with pytest.raises(AssertionError, match=r"cairn.b imports cairn.gone.f, which is not there"):
        graph(tmp_path)
