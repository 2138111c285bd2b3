"""Account of a DATBOX folder for `cairn convert FOLDER`: contactors, meshes and laws with their counterparts in Cairn."""

from __future__ import annotations

import re
from collections import Counter

from ..model.laws import Law
from .rigid import SHORT
from .text import LegacyError

MOST = 12  # lines of one kind


def account(folder, **options):
    """Reads a DATBOX folder and tells what was read as what.

    Parameters
    ----------
    folder : path-like
        The folder with DATBOX.
    **options : optional
        Options of read_datbox: state, step, plane, light, near, materials, drained.

    Returns
    -------
    tuple
        The scene, with all that cannot be mapped left out, and the lines of the account (list of str).

    Raises
    ------
    LegacyError
        If the files are missing, cut short or not understood.
    """
    import warnings

    from .scene import UnmappedWarning, read_datbox

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnmappedWarning)
        scene = read_datbox(folder, unmapped="skip", **options)
    return scene, lines_of(scene)


def lines_of(scene):
    """Lines of the account of a scene that read_datbox made."""
    origin = getattr(scene, "legacy", None)
    if origin is None:
        raise LegacyError("the scene is of no DATBOX folder: read it by cairn.legacy.read_datbox")
    box = origin.datbox
    lines = [f"{box.folder}: {box.dim}D, {len(box.bodies)} rigid bodies, {len(box.meshes)} meshes, {len(box.see)} see tables", ""]
    lines += _table("contactors", _contactors(box, scene), ("LMGC90", "count", "Cairn"))
    lines += _table("meshes", _meshes(box, scene), ("LMGC90", "count", "Cairn"))
    lines += _table("laws", _laws(box, scene), ("LMGC90", "sees", "Cairn"))
    drives = Counter(type(b).__name__ for s in scene.sets for b in [getattr(s, "drive", None)] if callable(b))
    if drives:
        lines += [f"driven over time: {sum(drives.values())} sets of bodies", ""]
    lines.append(
        f"largest alert distance {origin.alert:g} m: NSCD(margin={origin.alert:g}); a DATBOX holds no time step and no theta"
    )
    for title, told in (("left out", origin.unmapped), ("read otherwise", origin.notes)):
        lines += ["", f"{title}: {len(told) or 'nothing'}"]
        lines += [f"  {' '.join(text.split())}" for text in told[:MOST]]
        lines += [f"  and {len(told) - MOST} more"] if len(told) > MOST else []
    return lines


def _contactors(box, scene):
    """(type of LMGC90, how many, shape of Cairn)."""
    from .scene import _shape

    rows = Counter()
    for body in box.bodies:
        for c in body.contactors:
            shape = _shape(c)
            name = "left out" if shape is None else shape[0]
            if c.type in ("PT2Dx", "PT3Dx"):
                name = "point (a ball without radius)"
            elif len(c.parts) > 1:
                name = "polyhedra, convex parts of one that is not"
            rows[SHORT.get(c.type, c.type), name] += 1
    return [(kind, str(count), name) for (kind, name), count in sorted(rows.items())]


def _meshes(box, scene):
    """(element, model and material, how many, as what)."""
    from .mesh import CELLS

    left = {int(found.group(1)) for text in scene.legacy.unmapped if (found := re.match(r"MAILx (\d+):", text))}
    rows = Counter()
    for mesh in box.meshes:
        for element, _, model, material in mesh.cells:
            ours = "left out" if mesh.number in left else CELLS.get(element, "left out")
            ours = ours if isinstance(ours, str) else str(ours[0])
            rows[f"{element} {model} {material}", ours] += 1
        for kind, *_ in mesh.contactors:
            side = "left out" if mesh.number in left else "points" if kind[:2] in ("CL", "CS") else "edges or faces"
            rows[kind, side] += 1
    return [(kind, str(count), name) for (kind, name), count in sorted(rows.items())]


def _laws(box, scene):
    """(law of the file, see tables that name it, law of Cairn)."""
    made = {}
    for *_, law in scene.rules:
        if isinstance(law, Law):
            made.setdefault(repr(law), law)
    from .contact_laws import law_of

    rows = []
    for name, law in box.laws.items():
        tables = [see for see in box.see if see.law == name]
        if not tables:
            rows.append((f"{name} {law.law}", "0", "not needed: no see table names it"))
            continue
        found, refused, _ = law_of(law, max(see.alert for see in tables), box.dim)
        told = "left out: " + "; ".join(refused) if found is None else repr(found)
        if found is not None and refused:
            told += " (" + "; ".join(refused) + ")"
        elif found is not None and repr(found) not in made:
            told += " (no pair of contactors of this folder obeys it)"
        rows.append((f"{name} {law.law}", str(len(tables)), told))
    return rows


def _table(title, rows, head):
    if not rows:
        return []
    wide = [max(len(row[k]) for row in [head, *rows]) for k in (0, 1)]
    shown = rows[:MOST] + ([(f"and {len(rows) - MOST} more", "", "")] if len(rows) > MOST else [])
    return [f"{title}:", *(f"  {a:<{wide[0]}}  {b:>{wide[1]}}  {c}".rstrip() for a, b, c in [head, *shown]), ""]
