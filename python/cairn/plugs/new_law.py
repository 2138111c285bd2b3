"""`cairn new-law NAME`: writes the template of a contact law that can be built, run and tested at once."""

from __future__ import annotations

import re
import shutil
from importlib.resources import as_file, files
from pathlib import Path

TEMPLATES = {"law.f90": "{}.f90", "CMakeLists.txt": "CMakeLists.txt", "run.py": "run.py", "test_law.py": "test_{}.py"}


def new_law(name, folder=None):
    """Writes the files of a law called `name` into `folder` (default: a new folder of that name); returns their paths.

    Raises ValueError for a name that Fortran cannot have, FileExistsError when the folder holds something.
    """
    if not re.fullmatch(r"[a-z][a-z0-9_]{0,39}", name):
        raise ValueError(f"{name!r} is no name for a law: small letters, digits and _, a letter first, at most 40")
    target = Path(folder or name)
    if target.exists() and any(target.iterdir()):
        raise FileExistsError(f"{target} is there already and holds files: give another name or --folder")
    target.mkdir(parents=True, exist_ok=True)
    source = files("cairn") / "plugs"
    written = []
    for template, pattern in TEMPLATES.items():
        path = target / pattern.format(name)
        path.write_text((source / template).read_text(encoding="utf-8").replace("@NAME@", name), encoding="utf-8")
        written.append(path)
    with as_file(source / "cairn_plug.f90") as plug:
        written.append(Path(shutil.copy(plug, target / "cairn_plug.f90")))
    return written


def build_line(name):
    """The command that builds the law, in its folder."""
    return f"gfortran -O3 -march=native -shared -fPIC cairn_plug.f90 {name}.f90 -o lib{name}.so"
