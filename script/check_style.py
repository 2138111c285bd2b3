"""House rules that no linter knows: sizes of files and procedures, the form of a Fortran kernel, words that stay outside."""

import ast
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LONGEST_FILE = 600
LONGEST_PROCEDURE = 100
WIDTHS = {".f90": 132, ".cpp": 120, ".hpp": 120, ".h": 120, ".py": 130}
# places of one machine have no business in the project (a path in a sentence is told by its slash)
FOREIGN = re.compile(r"(?<![\w.$}<])/(?:work|tmp|root|home)/[\w.]")

# Folders of cxx from the ground up: a file includes files of its own folder and of those before it.
LAYERS = re.search(r"set\(CAIRN_LAYERS\n([^)]*)\)", (ROOT / "cxx" / "sources.cmake").read_text(encoding="utf-8"))[1].split()
INCLUDE = re.compile(r'#include "(\.\./[^"]+)"')
# Headers of parts that only the sources of their class include.
PRIVATE = {
    "cxx/contacts/interaction_state.hpp": tuple(
        f"cxx/contacts/{name}.cpp" for name in ("interaction", "contact_views", "law_rows")
    ),
    "cxx/meshes/mortar_work.hpp": tuple(
        f"cxx/meshes/{name}.cpp" for name in ("mesh_mortar", "mesh_mortar_search", "mesh_mortar_sides")
    ),
}


def tracked():
    command = ["git", "ls-files", "-co", "--exclude-standard"]
    names = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\n")
    return sorted({ROOT / name for name in names if name and (ROOT / name).is_file()})


def docstring_lines(lines):
    """Number of lines of the docstrings of a Python source: their sections do not count for the size of a file."""
    count = 0
    for node in ast.walk(ast.parse("\n".join(lines))):
        documented = isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)) and ast.get_docstring(node) is not None
        count += node.body[0].end_lineno - node.body[0].lineno + 1 if documented else 0
    return count


def check_text(path, lines):
    width = WIDTHS.get(path.suffix)
    for number, line in enumerate(lines, 1):
        if width and len(line) > width:
            yield number, f"{len(line)} columns, at most {width}"
        if line != line.rstrip() and path.suffix != ".md":
            yield number, "blanks at the end of the line"
        if "\t" in line and path.suffix in WIDTHS:
            yield number, "a tab"
        if FOREIGN.search(line) and path.name != Path(__file__).name:
            yield number, "a path of one machine"
    if path.parent == ROOT / "tests" / "python" and path.suffix in WIDTHS:
        yield 1, "tests stand in the folder of tests/python that is named by their subject"
    if path.suffix in WIDTHS:
        length = len(lines) - (docstring_lines(lines) if path.suffix == ".py" else 0)
        if length > LONGEST_FILE:
            yield len(lines), f"{length} lines, at most {LONGEST_FILE}"


def check_private(path, lines):
    """Includes of headers that are private to the sources of a class."""
    own = path.relative_to(ROOT).as_posix()
    for number, line in enumerate(lines, 1):
        for private, owners in PRIVATE.items():
            if line.startswith("#include") and f"/{Path(private).name}" in line.replace('"', "/") and own not in owners:
                yield number, f"includes {private}, which is private to {', '.join(owners)}"


def check_layers(path, lines):
    """Includes that point upward, and folders of cxx that stand in no layer."""
    cxx = ROOT / "cxx"
    parts = path.relative_to(cxx).parts if path.is_relative_to(cxx) else ()
    if len(parts) < 2 or parts[0] == "include":
        return
    if parts[0] not in LAYERS:
        yield 1, f"the folder {parts[0]} is none of the layers: {' '.join(LAYERS)}"
        return
    for number, line in enumerate(lines, 1):
        found = INCLUDE.match(line)
        target = (path.parent / found[1]).resolve() if found else None
        if not target or not target.is_relative_to(cxx):
            continue
        folder = target.relative_to(cxx).parts[0]
        if folder in LAYERS and LAYERS.index(folder) > LAYERS.index(parts[0]):
            yield number, f"includes {found[1]}: {folder} stands above {parts[0]}"


def check_fortran(path, lines):
    text = "\n".join(lines).lower()
    modules = re.findall(r"^module +(?!procedure)(\w+)", text, re.M)
    if "core_f90" in path.parts:
        if modules != [path.stem]:
            yield 1, f"holds modules {modules}, not the one module {path.stem}"
        for line, pattern in ((1, r"^ *implicit none"), (1, r"^ *private *$")):
            if not re.search(pattern, text, re.M):
                yield line, f"lacks a line '{pattern.strip('^ *$')}'"
        for number, line in enumerate(lines, 1):
            statement = line.split("!")[0].lower()
            if re.search(r"^\s*(print\b|write *\(|open *\(|stop\b|error stop|allocate *\()", statement):
                yield number, "a kernel does not print, open, stop or allocate"
    open_procedures = []  # (name, first line, last line of its own statements or None)
    for number, line in enumerate(lines, 1):
        statement = line.split("!")[0].strip().lower()
        begins = re.match(r"(?:[\w()]+ +)*?(?:subroutine|function) +(\w+)", statement)
        if re.match(r"end *(?:subroutine|function)\b", statement) and open_procedures:
            name, first, last = open_procedures.pop()
            length = (last or number) - first + 1
            if length > LONGEST_PROCEDURE:
                yield first, f"{name} has {length} lines, at most {LONGEST_PROCEDURE}"
        elif statement == "contains" and open_procedures:
            name, first, _ = open_procedures.pop()
            open_procedures.append((name, first, number))
        elif begins and not statement.startswith("end"):
            open_procedures.append((begins[1], number, None))


def check_python(path, lines):
    for node in ast.walk(ast.parse("\n".join(lines))):
        if not isinstance(node, ast.FunctionDef):
            continue
        body = node.body
        documented = ast.get_docstring(node) is not None
        first = (body[1].lineno if len(body) > 1 else body[0].end_lineno) if documented else body[0].lineno
        length = node.end_lineno - first + 1
        if length > LONGEST_PROCEDURE:
            yield node.lineno, f"{node.name} has {length} lines, at most {LONGEST_PROCEDURE}"


def main():
    found = 0
    for path in tracked():
        try:
            lines = path.read_text(encoding="utf-8").split("\n")
        except UnicodeDecodeError:
            continue
        checks = [check_text(path, lines)]
        if path.suffix in (".cpp", ".hpp"):
            checks += [check_layers(path, lines), check_private(path, lines)]
        if path.suffix == ".f90":
            checks.append(check_fortran(path, lines))
        if path.suffix == ".py":
            checks.append(check_python(path, lines))
        for check in checks:
            for number, what in check:
                print(f"{path.relative_to(ROOT)}:{number}: {what}")
                found += 1
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
