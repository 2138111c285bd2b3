"""Meshed bodies (MAILx) of a DATBOX: their part of the files, and the deformable bodies they make."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..build.materials import Material
from . import solids
from .text import LegacyError, Reader

CELLS = {
    "T3xxx": "triangle", "Q4xxx": "quad", "T6xxx": "triangle6", "Q8xxx": "quad8", "TE4xx": "tetra", "H8xxx": "hexahedron",
}  # fmt: skip

# Shape functions of a quadrilateral at its two by two Gauss points: the candidate points of CSpx1.
GAUSS = [
    tuple((1 + a * x / 3**0.5) * (1 + b * y / 3**0.5) / 4 for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1)))
    for x in (-1, 1)
    for y in (-1, 1)
]


@dataclass
class Mesh:
    """A body of type MAILx, by its rank in the file. cells: [(element, nodes from 0, model, material)]; points: (m, dim) [m];
    contactors: [(type, colour, nodes from 0, share)] with the share apab of CLxxx; line of the file."""

    number: int
    line: int = 0
    cells: list = field(default_factory=list)
    points: list = field(default_factory=list)
    contactors: list = field(default_factory=list)


def read_mesh(reader, number, line):
    """From the line after the header on."""
    mesh, part = Mesh(number, line), ""
    while True:
        line = reader.next()
        if line[1:6] == "$$$$$":
            _check_nodes(reader, mesh)
            return mesh
        if line[1:6] == "bdyty":
            reader.fail(f"MAILx {number} has no end; the line $$$$$$ was expected")
        if line.startswith("$"):
            part = line.strip()
        elif part == "$blmty":
            nodes = [reader.whole(line, c, c + 6) - 1 for c in range(21, len(line), 7) if line[c - 1 : c + 6].strip()]
            words = reader.next()
            mesh.cells.append((line[1:6].strip(), nodes, words[22:27].strip(), words[36:41].strip()))
        elif part == "$nodty":
            mesh.points.append(reader.values(line, 2 if line[1:6] == "NO2xx" else 3))
        elif part == "$tacty":
            columns = (35, 47, 59, 71)
            words = [line[c - 1 : c + 4] for c in columns if line[c - 6 : c - 2].strip().startswith("nod")]
            if not all(w.strip().isdigit() for w in words):
                reader.fail("nodes of a contactor are no whole numbers")
            share = reader.number(line, 59, 72) if line[53:58] == "apab=" else 0.0
            mesh.contactors.append((line[1:6].strip(), line[22:27].strip(), [int(w) - 1 for w in words], share))
        else:
            reader.fail(f"{line.strip()!r} stands in no block of the body")


def _check_nodes(reader, mesh):
    count = len(mesh.points)
    for what, rows in (("element", mesh.cells), ("contactor", [(c[0], c[2]) for c in mesh.contactors])):
        for kind, nodes, *_ in rows:
            if nodes and not 0 <= min(nodes) <= max(nodes) < count:
                reader.fail(f"MAILx {mesh.number}: {what} {kind} has node {max(nodes) + 1}; there are 1 to {count}")


def read_models(box):
    """{model: (physics, {option: value})} of MODELS.DAT."""
    path = box.folder / "MODELS.DAT"
    models, options = {}, None
    if not path.is_file():
        return models
    reader = Reader(path)
    while not reader.ended:
        line = reader.next()
        if line.startswith("$"):
            continue
        if line[1:6].strip():
            models[line[1:6].strip()] = options = {}
            continue
        if options is None:
            reader.fail("an option stands before the name of its model")
        if line[8:13].strip():
            options["physics"] = line[8:13].strip()
        options[line[22:27].strip()] = line[29:34].strip()
    return models


def read_mesh_drives(box):
    """{mesh: [(node from 0, Drive)]} of DRV_DOF.DAT."""
    from .datbox import read_drive

    found = {}
    path = box.folder / "DRV_DOF.DAT"
    if not path.is_file():
        return found
    reader = Reader(path)
    body, node, wanted = None, 0, False
    while not reader.ended:
        line = reader.next()
        if line[1:6] == "bdyty":
            body, wanted = reader.header(reader.next()), False
        elif line[1:6] == "nodty":
            node, wanted = reader.whole(reader.next(), 7, 13) - 1, False
        elif line[1:6] == "dofty":
            wanted = True
        elif line.startswith("$"):
            wanted = False
        elif wanted and body is not None and body[0] == "MAILx":
            if not 0 <= node < len(box.meshes[body[1] - 1].points):
                reader.fail(f"node {node + 1} is not one of MAILx {body[1]}")
            found.setdefault(body[1], []).append((node, read_drive(box, reader, line)))
    return found


def read_mesh_states(path, meshes):
    """{mesh: (displacement, velocity)}, each (n, dim), of a DOF file; what it does not list is at rest."""
    found = {m.number: tuple(np.zeros((len(m.points), len(m.points[0]))) for _ in range(2)) for m in meshes}
    reader = Reader(path)
    body = None
    while not reader.ended:
        line = reader.next()
        if line[1:6] == "bdyty":
            body = reader.header(reader.next())
        elif not line.startswith("$") and body is not None and body[0] == "MAILx" and line[1:3] == "NO":
            if body[1] not in found:
                reader.fail(f"MAILx {body[1]} is not in BODIES.DAT")
            node, (count, dim) = reader.whole(line, 7, 13) - 1, found[body[1]][0].shape
            if not 0 <= node < count:
                reader.fail(f"node {node + 1} is not one of MAILx {body[1]}, which has {count}")
            if line[29:33] == "X(1)":
                found[body[1]][0][node] = reader.values(line, dim)
                found[body[1]][1][node] = reader.values(reader.next(), dim)
    return found


def deformables(box, materials, origin):
    """Sets of the meshed bodies that map; the others are named in origin.unmapped."""
    models, drives = read_models(box), read_mesh_drives(box)
    path = next((box.folder / n for n in ("DOF.INI", "DOF.DAT") if (box.folder / n).is_file()), None)
    states = read_mesh_states(path, box.meshes) if path else {}
    sets = []
    for mesh in box.meshes:
        why = _why_not(box, mesh, models, drives.get(mesh.number, []))
        if why:
            origin.unmapped.append(f"MAILx {mesh.number}: {why} (BODIES.DAT, line {mesh.line})")
            continue
        try:
            sets += _deformable(box, mesh, models, drives.get(mesh.number, []), states.get(mesh.number), materials, origin)
        except LegacyError:
            raise
        except ValueError as error:
            raise LegacyError(f"{box.folder / 'BODIES.DAT'}, line {mesh.line}: MAILx {mesh.number}: {error}") from error
    return sets


def _why_not(box, mesh, models, drives):
    """What Cairn has nothing to map to, in words, or nothing."""
    if not mesh.cells or not mesh.points:
        return "no elements or no nodes"
    for element, _, model, material in mesh.cells:
        if material not in box.materials:
            raise LegacyError(f"{box.folder / 'BULK_BEHAV.DAT'}: has no material {material!r} of MAILx {mesh.number}")
        options = models.get(model)
        if options is None:
            raise LegacyError(f"{box.folder / 'MODELS.DAT'}: has no model {model!r} of MAILx {mesh.number}")
        heat = options.get("physics") == "THERM"
        if options.get("physics") != "MECAx" and not (heat and box.materials[material].law == "THERMO_ELAS"):
            return f"physics {options.get('physics')} of material {material} ({box.materials[material].law})"
        if element not in CELLS:
            return f"element {element}"
        if heat:
            continue
        why = solids.why_not(model, options, box.materials[material])
        if why:
            return why
    several = {model for _, _, model, _ in mesh.cells}
    alike = {tuple(models[m].get(o, "") for o in ("physics", "kine_", "mstrg")) for m in several}
    if len(alike) > 1 or (len({(model, name) for _, _, model, name in mesh.cells}) > 1 and heat):
        return "models of several physics, kinematics or masses in one body"
    for kind, *_ in mesh.contactors:
        if kind not in ("CLxxx", "ALpxx", "CSpx1", "ASpxx"):
            return f"contactor {kind}"
    if any(kind == "CSpx1" and len(nodes) != 4 for kind, _, nodes, _ in mesh.contactors):
        return "contactor CSpx1 on triangles"
    for _, d in drives:
        if d.kind not in (("temp", "flux") if heat else ("vlocy", "force")):
            return f"dofs driven by {d.kind}"
    return ""


def _heated(box, mesh, models, drives, origin):
    """A body whose nodes hold still and conduct; what heats it stands in origin.heated."""
    from ..build.meshes import deformable
    from .networks import properties

    _, _, model, name = mesh.cells[0]
    body = _body(box, mesh, models)
    body.heat_lumped = models[model].get("cstrg") == "lump_"
    known = {k: v for k, v in properties(box.materials[name]).items() if k in ("conductivity", "capacity")}
    material = Material(f"{name} heat", density=box.materials[name].density, **known)
    path = next((box.folder / n for n in ("DOF.INI", "DOF.DAT") if (box.folder / n).is_file()), None)
    temperatures = read_temperatures(path, mesh.number, len(mesh.points)) if path else np.zeros(len(mesh.points))
    if np.any(temperatures <= 0):
        raise LegacyError(f"{box.folder}: node {int(np.argmin(temperatures)) + 1} of MAILx {mesh.number} has no temperature T(1)")
    named = f"MAILx {mesh.number}"
    origin.heated.append((named, body, drives, temperatures))
    fixed = {f"node {k}": "xyz"[: body.dim] for k in range(len(mesh.points))}
    return deformable(body, material, fixed=fixed, name=named)


def read_temperatures(path, number, count):
    """Temperatures (n,) of the nodes of a mesh in a DOF file; 0 where it names none."""
    out, body, reader = np.zeros(count), None, Reader(path)
    while not reader.ended:
        line = reader.next()
        if line[1:6] == "bdyty":
            body = reader.header(reader.next())
        elif not line.startswith("$") and body == ("MAILx", number) and line[1:3] == "NO" and line[29:33] == "T(1)":
            node = reader.whole(line, 7, 13) - 1
            if not 0 <= node < count:
                reader.fail(f"node {node + 1} is not one of MAILx {number}, which has {count}")
            out[node] = reader.number(line, 35, 48)
    return out


def _body(box, mesh, models):
    from ..build.elastic import ElasticBody
    from ..build.solid import SolidBody

    _, _, model, name = mesh.cells[0]
    material = box.materials[name]
    cells = {}
    for element, nodes, *_ in mesh.cells:
        cells.setdefault(CELLS[element], []).append(nodes)
    points, cells = np.array(mesh.points), {kind: np.array(nodes) for kind, nodes in cells.items()}
    given = {
        "density": material.density, "lumped": models[model].get("mstrg") == "lump_",
        "groups": {f"node {k}": [k] for k in range(len(mesh.points))},
    }  # fmt: skip
    if len({(model, name) for _, _, model, name in mesh.cells}) > 1:
        return _of_several(box, mesh, models, points, cells, given)
    young, poisson = solids.elastic(box, material)
    bulk = None if models[model].get("physics") == "THERM" else solids.solid_material(box, models[model], material)
    if bulk is not None:
        return SolidBody(points, cells, bulk, **given)
    return ElasticBody(points, cells, young=young, poisson=poisson, **given)


def _of_several(box, mesh, models, points, cells, given):
    """A body of several materials: each cell has its own, and their density."""
    from ..build.bulk import BULK_MATERIALS
    from ..build.solid import SolidBody

    made, which, density = {}, {}, {}
    for element, _, model, name in mesh.cells:
        kind, key = CELLS[element], (model, name)
        if key not in made:
            law = solids.solid_material(box, models[model], box.materials[name])
            if law is None:
                young, poisson = solids.elastic(box, box.materials[name])
                law = BULK_MATERIALS["IsotropicElastic"](young=young, poisson=poisson)
            made[key] = law
        which.setdefault(kind, []).append(list(made).index(key))
        density.setdefault(kind, []).append(box.materials[name].density)
    laws = list(made.values())
    material = {kind: (laws, np.array(of)) for kind, of in which.items()}
    return SolidBody(points, cells, material, **{**given, "density": {kind: np.array(of) for kind, of in density.items()}})


def _deformable(box, mesh, models, drives, state, materials, origin):
    from ..build.meshes import deformable
    from .scene import _function

    if models[mesh.cells[0][2]].get("physics") == "THERM":
        return _heated(box, mesh, models, drives, origin)
    body = _body(box, mesh, models)
    if body.dim == 2 and not any("plane strain" in note for note in origin.notes):
        origin.notes.append("meshes in 2D are taken in plane strain: the files do not say")
    drive, pushed = {}, {}
    for node, d in drives:
        target = drive if d.kind == "vlocy" else pushed
        target.setdefault(f"node {node}", {})["xyz"[d.component - 1]] = _function(d)

    def force(t):
        at = {g: {a: v(t) if callable(v) else v for a, v in by.items()} for g, by in pushed.items()}
        return {g: [by.get(a, 0.0) for a in "xyz"[: body.dim]] for g, by in at.items()}

    material = mesh.cells[0][3]
    density = box.materials[material].density
    names = {}
    for kind in ("CLxxx", "ALpxx", "CSpx1", "ASpxx"):
        colors = {c for k, c, *_ in mesh.contactors if k == kind}
        if len(colors) > 1:
            raise LegacyError(f"{box.folder}: MAILx {mesh.number} has {kind} of several colours, which is not mapped")
        for color in colors:
            names[kind] = f"{material} {color} {kind}"
            materials[names[kind]] = ("MAILx", "CSxxx" if kind == "CSpx1" else kind, color)
    points = [(nodes, (1 - share, share)) for kind, _, nodes, share in mesh.contactors if kind == "CLxxx"]
    points += [(nodes, w) for kind, _, nodes, _ in mesh.contactors if kind == "CSpx1" for w in GAUSS]
    faces = [nodes + [-1] * (4 - len(nodes)) for kind, _, nodes, _ in mesh.contactors if kind == "ASpxx"]
    # an antagonist edge has its body on the right, here it is on the left
    edges = np.array([nodes[::-1] for kind, _, nodes, _ in mesh.contactors if kind == "ALpxx"], int).reshape(-1, 2)
    moved, velocity = state if state is not None else (None, None)
    return deformable(
        body, Material(names.get("CLxxx", names.get("CSpx1", material)), density=density), edges=edges, drive=drive,
        faces=np.array(faces, int).reshape(-1, 4), face_material=Material(names.get("ASpxx", material), density=density),
        points=(np.array([p[0] for p in points]), np.array([p[1] for p in points])) if points else None,
        edge_material=Material(names.get("ALpxx", material), density=density), force=force if pushed else None,
        velocity=velocity, displacement=moved, name=f"MAILx {mesh.number}",
    )  # fmt: skip
