"""Reader of a DATBOX folder into plain data, from which a scene is made later."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from .contact_laws import LAW_VALUES
from .drives import read_drive
from .mesh import read_mesh, read_models
from .rigid import DIMENSION, completed, read_body
from .text import REAL, LegacyError, Reader, fortran

# Materials without a density in their first line, or with one that is not used.
NO_DENSITY = ("DISCRETE", "JOINT_ELAS", "JOINT_MC", "JOINT_FCZM")


@dataclass
class BulkMaterial:
    """A material: its law, its line in the file, its density [kg/m3] and (number, text) of the further lines."""

    name: str
    law: str
    line: int = 0
    density: float | None = None
    parts: list = field(default_factory=list)


@dataclass
class ContactLaw:
    """A contact law, its line in the file and, for laws in LAW_VALUES, its parameters."""

    name: str
    law: str
    line: int = 0
    parameters: dict = field(default_factory=dict)


@dataclass
class SeeTable:
    """See table: (body, contactor, colour) of both sides, their law, alert distance and halo [m]; line of the file."""

    candidate: tuple
    antagonist: tuple
    law: str
    alert: float
    halo: float = 0.0
    line: int = 0


@dataclass
class BodyState:
    """Displacement from the coordinates of BODIES.DAT, velocity, in 3D the frame (columns are the principal axes), and the line
    of the file."""

    displacement: np.ndarray
    velocity: np.ndarray
    frame: np.ndarray | None = None
    line: int = 0


@dataclass
class Datbox:
    """Content of a DATBOX folder. notes: texts on parts that were skipped."""

    folder: Path
    dim: int = 0
    gravity: tuple = (0.0, 0.0, 0.0)
    bodies: list = field(default_factory=list)
    meshes: list = field(default_factory=list)  # MAILx, see cairn.legacy.mesh
    materials: dict = field(default_factory=dict)
    laws: dict = field(default_factory=dict)
    see: list = field(default_factory=list)
    drives: dict = field(default_factory=dict)  # (type, number): [Drive]
    states: dict = field(default_factory=dict)  # (type, number): BodyState
    initial_contacts: int = 0
    state_file: str = ""
    plane: str = "strain"  # of meshes in 2D; not in the files
    light: float | None = None  # density of meshes whose material has none [kg/m3]
    near: float | None = None  # tolerance of the hulls of polyhedra that are not cut exactly, over their size
    replaced: dict = field(default_factory=dict)  # {name of a material of meshes: material of solids in its place}
    drained: bool = False  # porous bodies are read as their solid
    notes: list = field(default_factory=list)


def parse(folder, near=None):
    """Datbox of a folder, or of its subfolder DATBOX. near: as for cairn.pre.convex_parts. Raises LegacyError."""
    folder = Path(folder)
    if (folder / "DATBOX").is_dir():
        folder = folder / "DATBOX"
    if not (folder / "BODIES.DAT").is_file():
        raise LegacyError(f"{folder}: there is no BODIES.DAT; give a DATBOX folder, or the folder that holds it")
    box = Datbox(folder, near=near)
    read_bodies(box)
    models = read_models(box) if box.meshes else {}
    for m in box.meshes:
        m.physics = models.get(m.cells[0][2], {}).get("physics", "") if m.cells else ""
    read_bulk(box)
    if (folder / "TACT_BEHAV.DAT").is_file():
        read_contact(box)
    if (folder / "DRV_DOF.DAT").is_file():
        read_drives(box)
    for name in ("DOF.INI", "DOF.DAT"):
        if (folder / name).is_file():
            box.states, box.state_file = read_states(folder / name)[2], name
            break
    if (folder / "Vloc_Rloc.INI").is_file():
        reader = Reader(folder / "Vloc_Rloc.INI")
        box.initial_contacts = sum(line.startswith("$icdan") for _, line in reader.lines)
    return box


def read_bodies(box):
    """Reads BODIES.DAT. Bodies are numbered in the order of the file, whatever their own numbers; lines outside are skipped."""
    reader = Reader(box.folder / "BODIES.DAT")
    stray = []
    while not reader.ended:
        line = reader.next()
        if line[1:6] != "bdyty":
            if line[1:6] != "$$$$$":
                stray.append(reader.number_of_line)
            continue
        kind, first = reader.next()[1:6].strip(), reader.number_of_line
        if kind == "MAILx":
            box.meshes.append(read_mesh(reader, len(box.meshes) + 1, first))
            continue
        if kind not in DIMENSION:
            reader.fail(f"bodies of type {kind} are not known: RBDY2, RBDY3 or MAILx was expected")
        if box.dim not in (0, DIMENSION[kind]):
            reader.fail(f"{kind} in a file of {box.dim}D bodies")
        box.dim = DIMENSION[kind]
        box.bodies.append(completed(reader, read_body(reader, kind, len(box.bodies) + 1, first), box.near))
    if stray:
        box.notes.append(f"BODIES.DAT, line {stray[0]}: {len(stray)} lines outside of all bodies are passed over, as LMGC90 does")
    if not box.bodies and not box.meshes:
        raise LegacyError(f"{reader.path}: holds no body; each starts with $bdyty")
    box.dim = box.dim or _dimension_of_meshes(box)


def _dimension_of_meshes(box):
    text = (box.folder / "BODIES.DAT").read_text(encoding="latin-1")
    return 3 if " NO3xx" in text else 2


def read_bulk(box):
    """Reads BULK_BEHAV.DAT: gravity and materials."""
    reader = Reader(box.folder / "BULK_BEHAV.DAT")
    material, weighed = None, False
    while not reader.ended:
        line = reader.next()
        if line[1:6] == "gravy" and not weighed:
            box.gravity, weighed = tuple(reader.values(reader.next(), 3, (20, 41, 62))), True
        elif line[1:6] == "behav":
            line = reader.next()
            material = BulkMaterial(line[1:6].strip(), line[8:38].strip(), reader.number_of_line)
            box.materials.setdefault(material.name, material)
            if material.law not in NO_DENSITY and line[45:59].strip() not in ("", "field"):
                material.density = reader.number(line, 46, 59)
        elif material is not None:
            material.parts.append((reader.number_of_line, line))
    if not weighed:
        raise LegacyError(f"{reader.path}: has no gravity; a line $gravy and the three values of the next were expected")


def read_contact(box):
    """Reads TACT_BEHAV.DAT: contact laws and see tables. Values are read by columns; labels are ignored."""
    reader, broken = Reader(box.folder / "TACT_BEHAV.DAT"), {}
    while not reader.ended:
        line = reader.next()
        if line[1:6] == "behav":
            line = reader.next()
            law = ContactLaw(line[1:6].strip(), line[8:38].strip(), reader.number_of_line)
            box.laws.setdefault(law.name, law)
            try:
                _read_law(box, reader, line, law)
            except LegacyError as error:  # raised below if a see table uses the law
                broken.setdefault(law.name, error)
        elif line[1:6] == "seety":
            reader.next()
            box.see.append(_see(reader, reader.next()))
            if not reader.ended and reader.line.startswith("+"):
                box.see[-1].halo = reader.number(reader.next(), 55, 68)
    for see in box.see:
        if see.law in broken:
            raise broken[see.law]
        if see.law not in box.laws:
            raise LegacyError(
                f"{reader.path}, line {see.line}: law {see.law!r} is not declared; there are {', '.join(box.laws) or 'none'}"
            )
    for name, wrong in broken.items():
        box.notes.append(f"law {name}, by which nothing touches, is passed over: {wrong}")
        del box.laws[name]


def _read_law(box, reader, line, law):
    """Reads the rows of a law into its parameters."""
    for k, names in enumerate(LAW_VALUES.get(law.law, ())):
        if k and (reader.ended or reader.line.startswith("$")):
            reader.fail(f"law {law.name} ({law.law}) ends here: a line of {', '.join(names)} was expected")
        line = reader.next() if k else line
        values = reader.values(line, len(names), (41, 62))
        law.parameters |= dict(zip(names, values))
        if law.law.endswith("MAL_CZM") and line[40:45] == "visc=":
            strength, work = values
            law.parameters |= {"s1": strength, "s2": strength, "G1": work, "G2": work}
            box.notes.append(
                f"TACT_BEHAV.DAT, line {reader.number_of_line}: law {law.name} ({law.law}) is in the words of an older version: "
                f"visc= {strength:g} is taken as its strength [Pa], dupr= {work:g} as its work [J/m2], both of either mode"
            )
            return


def _see(reader, line):
    sides = [(line[a - 1 : a + 4].strip(), line[b - 1 : b + 4].strip(), line[c - 1 : c + 4].strip())
             for a, b, c in ((2, 9, 16), (30, 37, 44))]  # fmt: skip
    return SeeTable(*sides, line[22:27].strip(), reader.number(line, 55, 68), line=reader.number_of_line)


def read_drives(box):
    """Reads DRV_DOF.DAT with its evolution files. If a body has several blocks the last counts."""
    reader = Reader(box.folder / "DRV_DOF.DAT")
    body, wanted = None, False
    count = {"MAILx": len(box.meshes), "RBDY2": 0, "RBDY3": 0, f"RBDY{box.dim}": len(box.bodies)}
    while not reader.ended:
        line = reader.next()
        if line[1:6] == "bdyty":
            body, wanted = reader.header(reader.next()), False
            if not 1 <= body[1] <= count.get(body[0], 0):
                reader.fail(f"drives {body[0]} {body[1]}, which BODIES.DAT does not have")
            if body[0] != "MAILx" and body in box.drives:
                box.notes.append(f"DRV_DOF.DAT, line {reader.number_of_line}: the last block of {body[0]} {body[1]} counts")
            box.drives[body] = []
        elif line[1:6] == "nodty":
            reader.next()
            wanted = False
        elif line[1:6] == "dofty":
            wanted = True
        elif line.startswith("$"):
            wanted = False
        elif wanted and body is not None:
            box.drives[body].append(read_drive(box, reader, line))
        elif line[1:6] in ("vlocy", "force"):
            reader.fail("a driven dof stands in no block: $bdyty, $nodty and $dofty were expected before it")


def read_states(path):
    """(step, time [s], {(type, number): BodyState} of rigid bodies) from a DOF.INI or DOF.OUT file."""
    reader = Reader(path)
    step, time, states = 0, 0.0, {}
    while not reader.ended:
        line = reader.next()
        if line[1:6] == "steps":
            found = re.match(r".steps\s+(\d+)\s+time=\s*(\S+)", line)
            value = REAL.fullmatch(found[2]) if found else None
            if value is None:
                reader.fail("the number of the step, time= and the time were expected")
            step, time = int(found[1]), fortran(value)
        elif line[1:6] == "bdyty":
            kind, number = reader.header(reader.next())
            first = reader.number_of_line
            if kind not in DIMENSION:
                continue
            if reader.next()[1:6] != "nodty":
                reader.fail("$nodty was expected")
            states[kind, number] = _state(reader, DIMENSION[kind], first)
    return step, time, states


def _state(reader, dim, line):
    if dim == 2:
        return BodyState(*(np.array(reader.values(reader.next(), 3)) for _ in range(2)), line=line)
    rows = [reader.values(reader.next(), 3) for _ in range(7)]
    frame = np.array(rows[4:7]).T
    if np.max(np.abs(frame.T @ frame - np.eye(3))) > 1e-4:
        reader.fail("the rows a, b and g are no axes of length 1 square to each other")
    return BodyState(np.array(rows[0]), np.array(rows[2] + rows[3]), frame, line)
