"""Scripts of studies, and the modules that stand beside them."""

from __future__ import annotations

import ast
import sys
from pathlib import Path

_folders = []  # of scripts that were run in this process


def see_beside(script):
    """From now on modules in the folder of a script are imported by it, as Python does for a script that it runs itself. One of
    the same name beside an earlier script makes room."""
    folder = str(Path(script).resolve().parent)
    for name, module in list(sys.modules.items()):
        home = getattr(module, "__file__", None)
        own = Path(folder, *name.split("."))
        beside = own.with_suffix(".py").is_file() or (own / "__init__.py").is_file()
        if home and beside and not home.startswith(folder) and any(home.startswith(other) for other in _folders):
            del sys.modules[name]
    if folder in sys.path:
        sys.path.remove(folder)
    sys.path.insert(0, folder)
    if folder not in _folders:
        _folders.append(folder)


def words_of(script) -> bytes:
    """The script, and the modules beside it that it imports, these and those that they import."""
    script = Path(script)
    waiting, seen, words = [script], set(), b""
    while waiting:
        path = waiting.pop(0)
        if path in seen:
            continue
        seen.add(path)
        content = path.read_bytes()
        words += content
        waiting += sorted(_imported(content, script.parent) - seen)
    return words


def _imported(content, folder):
    """Files in the folder that a module imports."""
    try:
        tree = ast.parse(content)
    except (SyntaxError, ValueError):  # told when it is run
        return set()
    names = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            module = node.module or ""
            names += [module, *(f"{module}.{alias.name}".strip(".") for alias in node.names)]
    found = set()
    for name in names:
        parts = name.split(".")
        for k in range(1, len(parts) + 1):
            own = Path(folder, *parts[:k])
            found |= {path for path in (own.with_suffix(".py"), own / "__init__.py") if parts[0] and path.is_file()}
    return found
