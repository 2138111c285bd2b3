"""Docstrings in sections (Parameters, Returns, Raises, Notes, Examples), by numpydoc's own validator, of the modules that
pyproject.toml lists under tool.cairn.docstrings. A module that has them is added to the list and stays there.

    python script/check_docstrings.py [MODULE ...]     modules of the list, or those named
"""

import importlib
import inspect
import sys
import tomllib
from pathlib import Path

from numpydoc.validate import validate

ROOT = Path(__file__).resolve().parents[1]
# Summaries begin behind the quotes, in the third person, and closing quotes end the last line of a short text; See Also and
# examples are left to the writer.
CHECKS = {"GL01", "GL03", "GL05", "GL06", "GL07", "GL08", "GL10", "SS01", "SS02", "SS03", "SS04", "SS06", "PR01", "PR02", "PR03",
          "PR04", "PR05", "PR07", "PR08", "PR09", "PR10", "RT01", "RT03", "RT04", "RT05", "YD01"}  # fmt: skip


def members(module):
    """(name, object) of the public classes, functions and methods that a module defines, also those of its lists of classes."""
    for name, member in list(vars(module).items()):
        if name.startswith("_") or getattr(member, "__module__", None) != module.__name__:
            continue
        if inspect.isfunction(member):
            yield name, member
        elif inspect.isclass(member) and not issubclass(member, BaseException):
            yield name, member
            for own, part in vars(member).items():
                if not own.startswith("_") and (inspect.isfunction(part) or isinstance(part, (classmethod, property))):
                    yield f"{name}.{own}", part


def faults(module):
    """Lines (name, fault) of the docstrings of a module that break a rule."""
    found = importlib.import_module(module)
    for name, _ in members(found):
        for code, text in validate(f"{module}.{name}")["errors"]:
            if code in CHECKS:
                yield f"{module}.{name}: {code} {text}"


def main(names):
    """Prints the faults; returns the exit status."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["cairn"]["docstrings"]
    told = [line for name in names or settings["modules"] for line in faults(name)]
    print("\n".join(told) or "docstrings are in order")
    return 1 if told else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
