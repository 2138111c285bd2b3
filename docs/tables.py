"""Tables of what the lists (.def) declare, written as a page before Sphinx reads the others."""

import re
import runpy
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

# title | what the table tells | list and macro | columns of the page: title and how a row's fields make its cell
LISTS = [
    ("Contact laws",
     "`scene.interact(a, b, cn.Coulomb(mu=0.3))`. The next table has units and ranges. Unknowns are the components of "
     "relative velocity and impulse at a contact. State variables last from step to step; * marks a vector in the tangent plane.",
     "core_f90/contact_laws/laws.def", "CAIRN_LAW",
     (("in Python", 1), ("needed", lambda row: needed(row[4], False)), ("optional", lambda row: optional(row[4], False)),
      ("unknowns in 2D", 2), ("in 3D", 3), ("state", lambda row: state(row[5])), ("file", 0))),
    ("Pairs of shapes", "Shapes that can touch, with the number of contacts that one pair has at most.",
     "core_f90/detection/pairs.def", "CAIRN_PAIR", (("candidate", 1), ("antagonist", 2), ("most contacts", 3), ("file", 0))),
    ("Pairs with polygons and polyhedra", "A facet is a triangle of a surface.",
     "core_f90/detection/pairs.def", "CAIRN_HULL_PAIR", (("candidate", 1), ("antagonist", 2), ("most contacts", 3), ("file", 0))),
    ("Pairs by the kernel of convex shapes", "One kernel, on support functions, serves all of these pairs.",
     "core_f90/detection/pairs.def", "CAIRN_CONVEX_PAIR", (("candidate", 0), ("antagonist", 1), ("most contacts", 2))),
    ("Shapes", "Bounded: of finite extent. Bodies: free bodies can have it, others are boundaries.",
     "core_f90/detection/shapes.def", "CAIRN_SHAPE",
     (("name", 0), ("dimension", 1), ("bounded", lambda row: yes(row[2])),
      ("round", lambda row: {"1": "yes", "0": "no", "-1": "hollow"}[row[3]]), ("axis or normal", lambda row: yes(row[4])),
      ("bodies", lambda row: yes(row[6])), ("flat faces or ends", lambda row: yes(row[7])))),
    ("Kinds of side", "How a contact acts on one of its two bodies: through its centre (radial) or with a lever (rigid).",
     "core_f90/sides/sides.def", "CAIRN_SIDE", (("file", 0), ("dimension", 1), ("numbers of the lever", 2))),
    ("Contact solvers", "`cn.NSCD(solver=cn.NLGS(tol=1e-4))`, `cairn.problems.solve(problem, \"nlgs\")`.",
     "core_f90/solvers/solvers.def", "CAIRN_SOLVER", (("in Python", 1), ("method", 2), ("name in problems", 0))),
    ("Conductances of contacts",
     "`scene.electrical(conductance=cn.networks.Holm())`. Inputs are properties of a contact.",
     "core_f90/networks/networks.def", "CAIRN_CONDUCTANCE",
     (("in Python", 1), ("needed", lambda row: needed(row[2])), ("optional", lambda row: optional(row[2])),
      ("inputs", 3), ("meaning", 4), ("file", 0))),
    ("Finite elements", "Cells by their names in meshio; points of quadrature; order of the shape functions.",
     "core_f90/elements/elements.def", "CAIRN_ELEMENT",
     (("cells", 1), ("dimension", 2), ("nodes", 3), ("points for the mass", 4), ("points for stresses", 5), ("order", 6),
      ("file", 0))),
    ("Materials of solids", "`cn.SolidBody(..., material=cn.NeoHookean(young=1e6))`; meanings and units: [solids](../solids.md).",
     "core_f90/bulk_materials/bulk_materials.def", "CAIRN_BULK_MATERIAL",
     (("in Python", 1), ("needed", lambda row: needed(row[3])), ("optional", lambda row: optional(row[3])),
      ("argument", lambda row: row[2].replace("gradient", "deformation gradient")),
      ("state of a point", lambda row: components(row[4])), ("symmetric tangent", lambda row: yes(row[5])), ("file", 0))),
    *((title, "An array exists where the simulation has the feature in the column `exists`; the stage of the step in the last "
       "column writes it.", "cxx/bodies/fields.def", macro,
       (("name", 0), ("unit", 4), ("in 2D", 2), ("in 3D", 3), ("meaning", 7),
        ("type", lambda row: row[1].removeprefix("std::").removesuffix("_t")), ("exists", 6), ("made by", 5)))
      for title, macro in (("Arrays of bodies", "CAIRN_BODY_FIELD"), ("Arrays of nodes of meshes", "CAIRN_NODE_FIELD"),
                           ("Arrays of contactors", "CAIRN_CONTACTOR_FIELD"))),
    *((title, "Derivatives that integrators of higher order keep.", "cxx/bodies/kept_fields.def", macro,
       (("name", 0), ("unit", 3), ("in 2D", 1), ("in 3D", 2), ("meaning", 6), ("exists", 5), ("made by", 4)))
      for title, macro in (("Further arrays of bodies", "CAIRN_KEPT_BODY_FIELD"),
                           ("Further arrays of nodes of meshes", "CAIRN_KEPT_NODE_FIELD"))),
]  # fmt: skip
FIELD = re.compile(r'"([^"]*)"|([^,"]+)')
NUMBERS = {"inf": "∞", "-inf": "-∞", "1e300": "∞", "-1e300": "-∞", "1e-300": "0", "0.2857142857142857": "2/7",
           "1.5707963267948966": "π/2", "8.885765876316732": "2√2 π", "-0.999999": "-1", "0.499999999": "0.5"}  # fmt: skip


def rows(name, macro):
    """Fields of every row macro(...) of a list, texts without their quotes."""
    text = (ROOT / name).read_text(encoding="utf-8")
    for row in re.findall(rf"^{macro}\((.*)\)$", text, re.M):
        yield [(quoted or bare).strip() for quoted, bare in FIELD.findall(row) if quoted or bare.strip() or not bare]


def number(word):
    """A number of a list as readers write it: bounds that stand for infinity or for anything above 0 by these."""
    return NUMBERS.get(word, word)


def parameters(words):
    """(name, default, smallest, largest) of each parameter "name:default:smallest:largest", numbers as readers write them."""
    return [(word.split(":")[0], *(number(part) for part in word.split(":")[1:])) for word in words.split()]


def interval(low, high):
    """A range in words; empty where it is all numbers from 0 on."""
    return "" if (low, high) == ("0", "∞") else f" ({low} to {high})"


def needed(words, ranges=True):
    """Parameters without a default, with their ranges."""
    kept = [(name, interval(low, high) if ranges else "") for name, default, low, high in parameters(words) if not default]
    return ", ".join(f"`{name}`{told}" for name, told in kept)


def optional(words, ranges=True):
    """Parameters with a default, and their ranges."""
    kept = [(name, default, interval(low, high) if ranges else "") for name, default, low, high in parameters(words) if default]
    return ", ".join(f"`{name}` = {default}{told}" for name, default, told in kept)


def state(words):
    """Names of state variables, without their initial values."""
    return " ".join(word.split(":")[0].replace("*", "\\*") for word in words.split())


def components(words):
    """State variables of a point: a tensor once, with the number of its components."""
    names = [re.sub(r"\d+$", "", word) for word in words.split()]
    return ", ".join(name if names.count(name) == 1 else f"{name} ({names.count(name)})" for name in dict.fromkeys(names))


def yes(word):
    """A flag of a list in words."""
    return "yes" if word == "1" else "no"


def page():
    """The tables as one MyST page."""
    parts = ["# Tables\n\nLaws, shapes, solvers, elements, materials and arrays, written from the lists that the build reads."]
    for title, what, name, macro, columns in LISTS:
        lines = [f"## {title}", what, "", f"Source: `{name}`", ""]
        lines += ["| " + " | ".join(head for head, _ in columns) + " |", "|" + "---|" * len(columns)]
        for row in rows(name, macro):
            row += [""] * 8  # fields left out at the end
            cells = [cell(row) if callable(cell) else row[cell].replace("|", "\\|") for _, cell in columns]
            lines.append("| " + " | ".join(cells) + " |")
        parts.append("\n".join(lines))
        if macro == "CAIRN_LAW":
            parts.append(law_parameters(rows(name, macro)))
    return "\n\n".join(parts) + "\n"


def law_parameters(laws):
    """Each parameter of each contact law with its unit, range, default and meaning, as help() tells them."""
    known = runpy.run_path(str(ROOT / "python/cairn/model/law_parameters.py"))["told"]
    lines = ["## Parameters of contact laws", "A law needs every parameter without a default.", ""]
    lines += ["Source: `python/cairn/model/law_parameters.py`", ""]
    lines += ["| law | parameter | unit | range | default | meaning |", "|" + "---|" * 6]
    for _, law, _, _, words, *_ in laws:
        for name, default, low, high in parameters(words):
            unit, meaning = known(law, name)
            lines.append(f"| {law} | `{name}` | {unit} | {low} to {high} | {default or 'needed'} | {meaning} |")
    return "\n".join(lines)


def calls(text):
    """Public procedures of a Fortran module: comment, head and arguments of each, without the body."""
    public = set(re.findall(r"\w+", " ".join(re.findall(r"^ *public *:: *(.*)$", text, re.M))))
    body = text.partition("\ncontains\n")[2]
    head = re.compile(r"((?:^ *!>.*\n)*)^ *((?:[\w()*]+ )*(?:subroutine|function) (\w+)\b(?:.*&\n)*.*)\n", re.M)
    for found in head.finditer(body):
        comment, first, name = found.groups()
        if name in public and not first.lstrip().startswith("end"):
            lines = []
            for line in body[found.end() :].split("\n"):
                told_on = line.lstrip().startswith("!<") and lines  # a comment on an argument goes on
                if "intent(" not in line and not told_on and not (lines and lines[-1].rstrip().endswith("&")):
                    break
                lines.append(line)
            told = [*comment.rstrip("\n").split("\n"), first, *lines]
            yield "\n".join(line.removeprefix("  ") for line in told if line.strip())


def fortran():
    """The Fortran module as one MyST page."""
    parts = ["# Fortran calls\n\nThe procedures of the module `cairn`, from its sources; `error=` may be left out everywhere."]
    for path in sorted((ROOT / "fortran").glob("cairn_*.f90")):
        found = list(calls(path.read_text(encoding="utf-8")))
        if found and path.stem not in ("cairn_calls", "cairn_signatures"):  # what the others share
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
