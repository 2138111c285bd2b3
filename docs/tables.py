"""Tables of what the lists (.def) declare, written as a page before Sphinx reads the others."""

import re
import runpy
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

LISTS = [
    ("Contact laws", "core_f90/contact_laws/laws.def", "CAIRN_LAW",
     ("file", "in Python", "unknowns in 2D", "in 3D", "parameters name:default:smallest:largest", "state")),
    ("Pairs of shapes", "core_f90/detection/pairs.def", "CAIRN_PAIR", ("file", "candidate", "antagonist", "most contacts")),
    ("Pairs with polygons and polyhedra", "core_f90/detection/pairs.def", "CAIRN_HULL_PAIR",
     ("file", "candidate", "antagonist", "most contacts")),
    ("Pairs of all shapes that are convex, by one kernel", "core_f90/detection/pairs.def", "CAIRN_CONVEX_PAIR",
     ("candidate", "antagonist", "most contacts")),
    ("Shapes", "core_f90/detection/shapes.def", "CAIRN_SHAPE",
     ("name", "dimension", "bounded", "round", "directed", "hull", "mover", "faced", "seen by the kernel of convex pairs as")),
    ("Kinds of side", "core_f90/sides/sides.def", "CAIRN_SIDE", ("file", "dimension", "numbers of the lever")),
    ("Contact solvers", "core_f90/solvers/solvers.def", "CAIRN_SOLVER",
     ("file", "in Python", "what it is", "of problems")),
    ("Conductances of contacts", "core_f90/networks/networks.def", "CAIRN_CONDUCTANCE",
     ("file", "in Python", "parameters name:default:smallest:largest", "reads", "what it is")),
    ("Finite elements", "core_f90/elements/elements.def", "CAIRN_ELEMENT",
     ("file", "cells", "dimension", "nodes", "points for mass", "for stresses", "order")),
    ("Materials of solids", "core_f90/bulk_materials/bulk_materials.def", "CAIRN_BULK_MATERIAL",
     ("file", "in Python", "given", "parameters name:default:smallest:largest", "state", "symmetric")),
    ("Arrays of bodies", "cxx/bodies/fields.def", "CAIRN_BODY_FIELD",
     ("name", "type", "in 2D", "in 3D", "unit", "made by", "exists", "meaning")),
    ("Arrays of nodes of meshes", "cxx/bodies/fields.def", "CAIRN_NODE_FIELD",
     ("name", "type", "in 2D", "in 3D", "unit", "made by", "exists", "meaning")),
    ("Further arrays of bodies", "cxx/bodies/kept_fields.def", "CAIRN_KEPT_BODY_FIELD",
     ("name", "in 2D", "in 3D", "unit", "made by", "exists", "meaning")),
    ("Further arrays of nodes of meshes", "cxx/bodies/kept_fields.def", "CAIRN_KEPT_NODE_FIELD",
     ("name", "in 2D", "in 3D", "unit", "made by", "exists", "meaning")),
    ("Arrays of contactors", "cxx/bodies/fields.def", "CAIRN_CONTACTOR_FIELD",
     ("name", "type", "in 2D", "in 3D", "unit", "made by", "exists", "meaning")),
]
FIELD = re.compile(r'"([^"]*)"|([^,"]+)')


def rows(name, macro):
    """Fields of every row macro(...) of a list, texts without their quotes."""
    text = (ROOT / name).read_text(encoding="utf-8")
    for row in re.findall(rf"^{macro}\((.*)\)$", text, re.M):
        yield [(quoted or bare).strip() for quoted, bare in FIELD.findall(row) if quoted or bare.strip() or not bare]


def page():
    """The tables as one MyST page."""
    parts = ["# What there is\n\nWritten from the lists that the build itself reads."]
    for title, name, macro, columns in LISTS:
        lines = [f"## {title}", f"`{name}`", "", "| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
        for row in rows(name, macro):
            cells = [cell.replace("|", "\\|") for cell in row[: len(columns)]]
            lines.append("| " + " | ".join(cells) + " |")
        parts.append("\n".join(lines))
        if macro == "CAIRN_LAW":
            parts.append(law_parameters(rows(name, macro)))
    return "\n\n".join(parts) + "\n"


def law_parameters(laws):
    """Each parameter of each contact law with its unit, range, default and meaning, as help() tells them."""
    known = runpy.run_path(str(ROOT / "python/cairn/model/law_parameters.py"))["told"]
    lines = ["## Parameters of contact laws", "`python/cairn/model/law_parameters.py`", ""]
    lines += ["| law | parameter | unit | from | to | when not given | meaning |", "|" + "---|" * 7]
    for _, law, _, _, parameters, *_ in laws:
        for word in parameters.split():
            name, default, low, high = word.split(":")
            unit, meaning = known(law, name)
            lines.append(f"| {law} | `{name}` | {unit} | {low} | {high} | {default or 'needed'} | {meaning} |")
    return "\n".join(lines)


def calls(text):
    """The public procedures of a Fortran module: comment, head and arguments of each, without what it does."""
    public = set(re.findall(r"\w+", " ".join(re.findall(r"^ *public *:: *(.*)$", text, re.M))))
    body = text.partition("\ncontains\n")[2]
    head = re.compile(r"((?:^ *!>.*\n)*)^ *((?:[\w()*]+ )*(?:subroutine|function) (\w+)\b(?:.*&\n)*.*)\n", re.M)
    for found in head.finditer(body):
        comment, first, name = found.groups()
        if name in public and not first.lstrip().startswith("end"):
            lines = []
            for line in body[found.end() :].split("\n"):
                if "intent(" not in line and not (lines and lines[-1].rstrip().endswith("&")):
                    break
                lines.append(line)
            told = [*comment.rstrip("\n").split("\n"), first, *lines]
            yield "\n".join(line.removeprefix("  ") for line in told if line.strip())


def fortran():
    """The Fortran module as one MyST page."""
    parts = ["# Fortran calls\n\nThe procedures of the module `cairn`, from its sources; `error=` may be left out everywhere."]
    for path in sorted((ROOT / "fortran").glob("cairn_*.f90")):
        found = list(calls(path.read_text(encoding="utf-8")))
        if found and path.stem != "cairn_calls":  # what the others share
            text = "\n\n".join(found)
            parts.append(f"## {path.stem.removeprefix('cairn_').capitalize()}\n\n```fortran\n{text}\n```")
    return "\n\n".join(parts) + "\n"


def write(folder):
    """Writes tables.md and fortran.md into folder; only when they changed, so that Sphinx does not build them anew."""
    for name, text in (("tables.md", page()), ("fortran.md", fortran())):
        target = Path(folder) / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if not target.exists() or target.read_text(encoding="utf-8") != text:
            target.write_text(text, encoding="utf-8")
