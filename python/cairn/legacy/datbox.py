"""What a DATBOX folder holds, as plain data, before anything of it becomes a scene."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from .mesh import read_mesh
from .text import LegacyError, Reader

DIMENSION = {"RBDY2": 2, "RBDY3": 3}


@dataclass
class Contactor:
    """One contactor of a body, in the frame of the body."""

    type: str
    color: str
    sizes: dict = field(default_factory=dict)  # byrd, axe1, ... [m]
    offset: tuple | None = None  # [m]
    vertices: np.ndarray | None = None
    faces: np.ndarray | None = None  # from 0


@dataclass
class RigidBody:
    """A body of RBDY2 or RBDY3. radius: avrd; moments: gyrd in 2D, (I1, I2, I3) per unit density in 3D."""

    type: str
    number: int
    material: str = ""
    radius: float = 0.0
    moments: tuple = ()
    position: tuple = ()
    contactors: list = field(default_factory=list)


@dataclass
class Drive:
    """A driven dof: kind vlocy or force, component from 1; numbers CT AMP OMEGA PHI RAMPI RAMP, or a table."""

    kind: str
    component: int
    numbers: tuple = ()
    file: str = ""
    table: np.ndarray | None = None


@dataclass
class BulkMaterial:
    """A material: its law and, for rigid ones, its density [kg/m3]."""

    name: str
    law: str
    density: float | None = None
    parts: list = field(default_factory=list)


@dataclass
class ContactLaw:
    """A contact law and its parameters in file order."""

    name: str
    law: str
    parameters: dict = field(default_factory=dict)


@dataclass
class SeeTable:
    """Which contactors see each other: (body, contactor, colour) of both sides."""

    candidate: tuple
    antagonist: tuple
    law: str
    alert: float
    halo: float = 0.0


@dataclass
class BodyState:
    """Displacement or coordinates from BODIES.DAT, velocity, and in 3D the frame (columns are the principal axes)."""

    displacement: np.ndarray
    velocity: np.ndarray
    frame: np.ndarray | None = None


@dataclass
class Datbox:
    """All of a folder. unread: what is there and was not understood, in words."""

    folder: Path
    dim: int = 0
    gravity: tuple = (0.0, 0.0, 0.0)
    bodies: list = field(default_factory=list)
    meshes: list = field(default_factory=list)  # of MAILx, see cairn.legacy.mesh
    materials: dict = field(default_factory=dict)
    laws: dict = field(default_factory=dict)
    see: list = field(default_factory=list)
    drives: dict = field(default_factory=dict)  # (type, number): [Drive]
    states: dict = field(default_factory=dict)  # (type, number): BodyState
    initial_contacts: int = 0
    unread: list = field(default_factory=list)


def parse(folder):
    """The Datbox in a folder, or in its subfolder DATBOX. Raises LegacyError."""
    folder = Path(folder)
    if (folder / "DATBOX").is_dir():
        folder = folder / "DATBOX"
    if not (folder / "BODIES.DAT").is_file():
        raise LegacyError(f"{folder}: there is no BODIES.DAT; give a DATBOX folder, or the folder that holds it")
    box = Datbox(folder)
    read_bodies(box)
    read_bulk(box)
    if (folder / "TACT_BEHAV.DAT").is_file():
        read_contact(box)
    if (folder / "DRV_DOF.DAT").is_file():
        read_drives(box)
    for name in ("DOF.INI", "DOF.DAT"):
        if (folder / name).is_file():
            box.states = read_states(folder / name)[2]
            break
    if (folder / "Vloc_Rloc.INI").is_file():
        reader = Reader(folder / "Vloc_Rloc.INI")
        box.initial_contacts = sum(line.startswith("$icdan") for _, line in reader.lines)
    return box


def read_bodies(box):
    """BODIES.DAT."""
    reader = Reader(box.folder / "BODIES.DAT")
    while not reader.ended:
        if reader.next().strip() != "$bdyty":
            reader.fail("a body starts with $bdyty")
        kind, number = reader.header(reader.next())
        if kind == "MAILx":
            box.meshes.append(read_mesh(reader, number))
            continue
        if kind not in DIMENSION:
            reader.fail(f"bodies of type {kind} are not known: RBDY2, RBDY3 or MAILx was expected")
        if box.dim not in (0, DIMENSION[kind]):
            reader.fail(f"{kind} in a file of {box.dim}D bodies")
        box.dim = DIMENSION[kind]
        box.bodies.append(_body(reader, RigidBody(kind, number)))
    box.dim = box.dim or _dimension_of_meshes(box)
    for k, body in enumerate(box.bodies):
        if body.number != k + 1:
            raise LegacyError(f"{reader.path}: body {k + 1} has the number {body.number}; they count from 1")


def _dimension_of_meshes(box):
    text = (box.folder / "BODIES.DAT").read_text(encoding="latin-1")
    return 3 if " NO3xx" in text else 2


def _body(reader, body):
    part = ""
    while True:
        line = reader.next()
        if line.strip() == "$$$$$$":
            return body
        if line.startswith("$"):
            part = line.strip()
        elif part == "$blmty":
            body.material = line[22:27].strip()
            found = reader.pairs(line)
            body.radius = found.get("avrd", 0.0)
            if body.type == "RBDY2":
                body.moments = (found.get("gyrd", 0.0),)
            else:
                body.moments = tuple(reader.values(reader.next(), 3))
        elif part == "$nodty":
            body.position = tuple(reader.values(line, 3))
            if body.type == "RBDY3":
                reader.next()
        elif part == "$tacty":
            body.contactors.append(_contactor(reader, line, body.type))
        else:
            reader.fail(f"{line.strip()!r} stands in no block of the body")


def _contactor(reader, line, body_type):
    kind, color = line[1:6].strip(), line[22:27].strip()
    c = Contactor(kind, color)
    if kind in ("POLYG", "POLYR"):
        count = reader.whole(line, 40, 46)
        faces = reader.whole(line, 60, 66) if kind == "POLYR" else 0
        dim = 2 if kind == "POLYG" else 3
        c.vertices = np.array([reader.values(reader.next(), dim) for _ in range(count)])
        if faces:
            rows = [reader.next() for _ in range(faces)]
            c.faces = np.array([[reader.whole(r, s, s + 6) for s in (35, 56, 77)] for r in rows]) - 1
        return c
    c.sizes = reader.pairs(line)
    if kind in ("DISKb", "SPHEb"):
        c.type = {"DISKb": "DISKx", "SPHEb": "SPHER"}[kind]
        c.offset = tuple(reader.values(reader.next(), 2 if body_type == "RBDY2" else 3))
    elif reader.line[29:39].strip() == "localframe":
        reader.next()
        c.sizes["localframe"] = np.array([reader.values(reader.next(), 3) for _ in range(3)])
    return c


def read_bulk(box):
    """BULK_BEHAV.DAT."""
    reader = Reader(box.folder / "BULK_BEHAV.DAT")
    material = None
    while not reader.ended:
        line = reader.next()
        if line.startswith("$gravy"):
            box.gravity = tuple(reader.values(reader.next(), 3, (20, 41, 62)))
        elif line.startswith("$behav"):
            line = reader.next()
            material = BulkMaterial(line[1:6].strip(), line[8:38].strip())
            box.materials[material.name] = material
            material.density = reader.pairs(line, (41, 62)).get("Umas")
        elif material is not None:
            material.parts.append(line.strip())


def read_contact(box):
    """TACT_BEHAV.DAT."""
    reader = Reader(box.folder / "TACT_BEHAV.DAT")
    law = None
    while not reader.ended:
        line = reader.next()
        if line.startswith("$behav"):
            line = reader.next()
            law = ContactLaw(line[1:6].strip(), line[8:38].strip(), reader.pairs(line, (41, 62)))
            box.laws[law.name] = law
        elif line.startswith("$seety"):
            law = None
            reader.next()
            line = reader.next()
            sides = [(line[a - 1 : a + 4].strip(), line[b - 1 : b + 4].strip(), line[c - 1 : c + 4].strip())
                     for a, b, c in ((2, 9, 16), (30, 37, 44))]  # fmt: skip
            box.see.append(SeeTable(*sides, line[22:27].strip(), reader.number(line, 55, 68)))
            if box.see[-1].law not in box.laws:
                reader.fail(f"law {box.see[-1].law!r} is not declared; there are {', '.join(box.laws) or 'none'}")
        elif line.startswith("+"):
            box.see[-1].halo = reader.number(line, 55, 68)
        elif law is not None:
            law.parameters |= reader.pairs(line, (41, 62))


def read_drives(box):
    """DRV_DOF.DAT, with its evolution files."""
    reader = Reader(box.folder / "DRV_DOF.DAT")
    body, wanted = None, False
    while not reader.ended:
        line = reader.next()
        if line.startswith("$bdyty"):
            body = reader.header(reader.next())
            box.drives.setdefault(body, [])
        elif line.startswith("$nodty"):
            reader.next()
        elif line.startswith("$dofty"):
            wanted = True
        elif line.startswith("$"):
            wanted = wanted and line.strip() != "$$$$$$"
        elif wanted:
            box.drives[body].append(_drive(box, reader, line))


def _drive(box, reader, line):
    drive = Drive(line[1:6].strip(), reader.whole(line, 7, 13))
    if line[14:23] == "evolution":
        drive.file = line[24:64].strip()
        path = box.folder / drive.file
        inner = Reader(path)
        drive.table = np.array([[inner.number(text, 1, 14), inner.number(text, 16, 29)] for _, text in inner.lines])
        if len(drive.table) == 0 or np.any(np.diff(drive.table[:, 0]) <= 0):
            raise LegacyError(f"{path}: gives no rising times; two columns, time and value, were expected")
    else:
        drive.numbers = tuple(reader.number(line, c, c + 13) for c in (15, 30, 45, 60, 75, 90))
    return drive


def read_states(path):
    """DOF.INI or DOF.OUT: step, time [s], {(type, number): BodyState} of rigid bodies."""
    reader = Reader(path)
    step, time, states = 0, 0.0, {}
    while not reader.ended:
        line = reader.next()
        if line.startswith("$steps"):
            step, time = reader.whole(line, 7, 28), reader.number(line, 35, 48)
        elif line.startswith("$bdyty"):
            kind, number = reader.header(reader.next())
            if kind not in DIMENSION:
                while not reader.ended and reader.line.strip() != "$$$$$$":
                    reader.next()
                continue
            if reader.next().strip() != "$nodty":
                reader.fail("$nodty was expected")
            states[kind, number] = _state(reader, DIMENSION[kind])
    return step, time, states


def _state(reader, dim):
    if dim == 2:
        return BodyState(np.array(reader.values(reader.next(), 3)), np.array(reader.values(reader.next(), 3)))
    rows = [reader.values(reader.next(), 3) for _ in range(7)]
    return BodyState(np.array(rows[0]), np.array(rows[2] + rows[3]), np.array(rows[4:7]).T)
