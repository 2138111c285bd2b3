"""Meshed bodies (MAILx) of a DATBOX: reading of their parts of the files, and conversion to deformable bodies."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..base.materials import Material
from ..base.time_functions import Components
from ..names import listed
from . import solids
from .drives import function_of, read_drive
from .networks import properties
from .remedies import CONTACTORS as MESH_CONTACTORS
from .remedies import ELEMENTS, PHYSICS, after
from .text import LegacyError, Reader

CELLS = {
    "T3xxx": "triangle", "Q4xxx": "quad", "T6xxx": "triangle6", "Q8xxx": "quad8", "Q9xxx": "quad9",
    "TE4xx": "tetra", "H8xxx": "hexahedron", "TE10x": "tetra10", "H20xx": "hexahedron20",
}  # fmt: skip

# Candidate points of a face by type: Gauss points of this order on triangles and quadrilaterals. CSpxx has its nodes, each once,
# or points given by weights in the following lines.
ORDERS = {"CSpx0": 0, "CSpx1": 1, "CSpx2": 2}
MEAN = "Q4P0x"  # quadrilaterals with mean dilatation
# {element of physics POROx: that of its solid}
SOLID_OF_POROUS = {
    "T33xx": "T3xxx", "Q44xx": "Q4xxx", "T63xx": "T6xxx", "Q84xx": "Q8xxx", "TE44x": "TE4xx", "H88xx": "H8xxx", "TE104": "TE10x",
    "H208x": "H20xx",
}  # fmt: skip
CONTACTORS = ("CLxxx", "ALpxx", "CSpxx", *ORDERS, "ASpxx")


def face_points(count, order):
    """Shape functions (k, count) at Gauss points on a triangle (Dunavant 1985) or a quadrilateral. order: 0 for a single point, 1
    for 3 or 4, 2 for 6 or 9."""
    if count == 4:
        along = ((0.0,), (-(3**-0.5), 3**-0.5), (-(0.6**0.5), 0.0, 0.6**0.5))[order]
        corners = ((-1, -1), (1, -1), (1, 1), (-1, 1))
        return [tuple((1 + a * x) * (1 + b * y) / 4 for a, b in corners) for x in along for y in along]
    inner, outer = 0.445948490915965, 0.091576213509771
    apexes = ((1 / 3,), (1 / 6,), (inner, outer))[order]
    points = [(1 - x - y, x, y) for a in apexes for x, y in ((a, a), (1 - 2 * a, a), (a, 1 - 2 * a))]
    return points[:1] if order == 0 else points


@dataclass
class Mesh:
    """A body of type MAILx. number: its rank in the file; cells: [(element, nodes from 0, model, material)]; points (m, dim) [m];
    contactors: [(type, colour, nodes from 0, share)], share: apab of CLxxx, or a list of the weights of a point of a face;
    line of the file."""

    number: int
    line: int = 0
    cells: list = field(default_factory=list)
    points: list = field(default_factory=list)
    contactors: list = field(default_factory=list)
    physics: str = ""  # MECAx or THERM, from its model


def read_mesh(reader, number, line):
    """Reads a Mesh, from the line after its header on."""
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
            nodes, words = _numbers(reader, line), reader.next()
            while not words[:20].strip():  # eight nodes in a line
                nodes, words = nodes + _numbers(reader, words), reader.next()
            element = line[1:6].strip()
            count = _count(element)
            if element in CELLS and len(nodes) != count:
                reader.fail(f"element {element} has {len(nodes)} nodes, not {count}")
            mesh.cells.append((element, nodes, words[22:27].strip(), words[36:41].strip()))
        elif part == "$nodty":
            mesh.points.append(reader.values(line, 2 if line[1:6] == "NO2xx" else 3))
        elif part == "$tacty" and line[29:31] == "w1":
            mesh.contactors[-1] = (*mesh.contactors[-1][:3], _weights(reader, line, len(mesh.contactors[-1][2])))
        elif part == "$tacty":
            columns = (35, 47, 59, 71)
            words = [line[c - 1 : c + 4] for c in columns if line[c - 6 : c - 2].strip().startswith("nod")]
            if not all(w.strip().isdigit() for w in words):
                reader.fail("nodes of a contactor are no whole numbers")
            share = reader.number(line, 59, 72) if line[53:58] == "apab=" else 0.0
            mesh.contactors.append((line[1:6].strip(), line[22:27].strip(), [int(w) - 1 for w in words], share))
        else:
            reader.fail(f"{line.strip()!r} stands in no block of the body")


def _count(element):
    """Number of nodes in the name of an element; 0 without."""
    return int("".join(c for c in element if c.isdigit()) or 0)


def _numbers(reader, line):
    """Nodes (from 0) in a line of an element."""
    return [reader.whole(line, c, c + 6) - 1 for c in range(21, len(line) + 1, 7) if line[c - 1 : c + 6].strip()]


def _weights(reader, line, count):
    """Weights of the nodes of a face at a contact point; three in a line."""
    found = reader.values(line, min(3, count))
    while len(found) < count:
        found = [*found, *reader.values(reader.next(), min(3, count - len(found)))]
    if not abs(sum(found) - 1) <= 1e-6:
        reader.fail(f"the weights of a contactor's nodes sum to {sum(found):g}, not 1")
    return [float(w) / sum(found) for w in found]


def _check_nodes(reader, mesh):
    count = len(mesh.points)
    for what, rows in (("element", mesh.cells), ("contactor", [(c[0], c[2]) for c in mesh.contactors])):
        for kind, nodes, *_ in rows:
            if nodes and not 0 <= min(nodes) <= max(nodes) < count:
                reader.fail(f"MAILx {mesh.number}: {what} {kind} has node {max(nodes) + 1}; there are 1 to {count}")


def read_models(box):
    """{model: {option: value}} of MODELS.DAT, with physics and finel among the options."""
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
            options["physics"], options["finel"] = line[8:13].strip(), line[15:20].strip()
        options[line[22:27].strip()] = line[29:34].strip()
    return models


def read_mesh_drives(box):
    """{mesh: [(node from 0, Drive)]} of DRV_DOF.DAT."""
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


def _numbers_of(path, meshes, label, physics):
    """{number in a DOF file: number in BODIES.DAT} of the meshes whose nodes have a label ("X(1)" or "T(1)") in the DOF file.
    LMGC90 numbers the meshes of each physics (MECAx, THERM) from 1; if a number is larger, those of BODIES.DAT are assumed."""
    reader, body, found = Reader(path), None, set()
    while not reader.ended:
        line = reader.next()
        if line[1:6] == "bdyty":
            body = reader.header(reader.next())
        elif body is not None and body[0] == "MAILx" and line[1:3] == "NO" and line[29:33] == label:
            found.add(body[1])
    own = [m.number for m in meshes if m.physics in (physics, "")]
    if max(found, default=0) > len(own):
        return {number: number for number in found}
    return {number: own[number - 1] for number in found if number > 0}


def read_mesh_states(path, meshes):
    """{mesh: (displacement [m], velocity [m/s])}, each (n, dim), of a DOF file; zero for nodes that it does not list."""
    found = {m.number: tuple(np.zeros((len(m.points), len(m.points[0]))) for _ in range(2)) for m in meshes}
    reader, numbers, body = Reader(path), _numbers_of(path, meshes, "X(1)", "MECAx"), None
    while not reader.ended:
        line = reader.next()
        if line[1:6] == "bdyty":
            body = reader.header(reader.next())
        elif body is not None and body[0] == "MAILx" and line[1:3] == "NO" and line[29:33] == "X(1)":
            number = numbers.get(body[1])
            if number not in found:
                reader.fail(f"MAILx {body[1]} is not in BODIES.DAT")
            node, (count, dim) = reader.whole(line, 7, 13) - 1, found[number][0].shape
            if not 0 <= node < count:
                reader.fail(f"node {node + 1} is not one of MAILx {number}, which has {count}")
            found[number][0][node] = reader.values(line, dim)
            found[number][1][node] = reader.values(reader.next(), dim)
    return found


def replacements(materials):
    """Checked copy of {name: material of solids}. Raises ValueError for other things."""
    from ..model.bulk import BulkMaterial

    if materials is not None and not isinstance(materials, dict):
        raise ValueError(f"materials is {materials!r}: give {{name in BULK_BEHAV.DAT: cn.NeoHookean(...) or another of solids}}")
    for name, material in (materials or {}).items():
        if not isinstance(material, BulkMaterial):
            raise ValueError(f"materials[{name!r}] is {material!r}: give a material of solids such as cn.NeoHookean(...)")
    return dict(materials or {})


def check_replacements(box):
    """Raises LegacyError for replaced materials that no meshed body has."""
    known = sorted({name for mesh in box.meshes for *_, name in mesh.cells})
    for name in box.replaced:
        if name not in known:
            raise LegacyError(f"{box.folder}: materials names {name!r}; meshed bodies have {listed(known, name)}")


def _drain(box, models, drives, origin):
    """Replaces elements and physics of porous bodies by those of a solid, and drops drives of the pressure."""
    porous = {name for name, options in models.items() if options.get("physics") == "POROx"}
    for name in porous:
        models[name]["physics"] = "MECAx"
    for mesh in box.meshes:
        if not any(model in porous for _, _, model, _ in mesh.cells):
            continue
        mesh.cells = [(SOLID_OF_POROUS.get(cell[0], cell[0]), *cell[1:]) for cell in mesh.cells]
        for element, nodes, *_ in mesh.cells:
            if element in CELLS and len(nodes) != _count(element):
                what = f"an element of the porous MAILx {mesh.number} has {len(nodes)} nodes, not {_count(element)}"
                raise LegacyError(f"{box.folder / 'BODIES.DAT'}, line {mesh.line}: {what}")
        dim, given = len(mesh.points[0]), drives.get(mesh.number, [])
        drives[mesh.number] = [(node, d) for node, d in given if d.component <= dim]
        lost = len(given) - len(drives[mesh.number])
        text = f"; {lost} pressures and flows of its nodes are left out" if lost else ""
        origin.notes.append(f"MAILx {mesh.number}: a porous body, read as its drained solid{text}")


def deformables(box, materials, origin):
    """Sets of the meshed bodies that can be mapped; the others are named in origin.unmapped."""
    models, drives = read_models(box), read_mesh_drives(box)
    if box.drained:
        _drain(box, models, drives, origin)
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
    """Text on the part of a mesh that Cairn cannot map; empty if it can."""
    if not mesh.cells or not mesh.points:
        return "no elements or no nodes: leave the body out"
    for element, _, model, material in mesh.cells:
        if material not in box.materials:
            raise LegacyError(f"{box.folder / 'BULK_BEHAV.DAT'}: has no material {material!r} of MAILx {mesh.number}")
        options = models.get(model)
        if options is None:
            raise LegacyError(f"{box.folder / 'MODELS.DAT'}: has no model {model!r} of MAILx {mesh.number}")
        heat = options.get("physics") == "THERM"
        if options.get("physics") != "MECAx" and not (heat and box.materials[material].law == "THERMO_ELAS"):
            text = f"physics {options.get('physics')} of material {material} ({box.materials[material].law})"
            return after(text, (PHYSICS, options.get("physics")), (ELEMENTS, options.get("finel")), (ELEMENTS, element))
        if element not in CELLS:
            return after(f"element {element}", (ELEMENTS, options.get("finel")), (ELEMENTS, element))
        if heat or material in box.replaced:
            continue
        why = solids.why_not(model, options, box.materials[material])
        if why:
            return why
    several = {model for _, _, model, _ in mesh.cells}
    alike = {tuple(models[m].get(o, "") for o in ("physics", "kine_", "mstrg", "finel")) for m in several}
    if (
        len({of[:3] for of in alike}) > 1
        or len({of[3] == MEAN for of in alike}) > 1
        or (len({(model, name) for _, _, model, name in mesh.cells}) > 1 and heat)
    ):
        return "models of several physics, kinematics or masses in one body: give each of them a body of its own"
    for kind, *_ in mesh.contactors:
        if kind not in CONTACTORS:
            return after(f"contactor {kind}", (MESH_CONTACTORS, kind))
    for _, d in drives:
        if d.kind not in (("temp", "flux") if heat else ("vlocy", "force")):
            return f"dofs driven by {d.kind}: give {'temp or flux' if heat else 'vlocy or force'}"
    return ""


def _heated(box, mesh, models, drives, origin):
    """Sets of a thermal mesh, whose nodes are held; its drives and temperatures are added to origin.heated."""
    from ..model.meshes import deformable

    _, _, model, name = mesh.cells[0]
    body = _body(box, mesh, models)
    body.heat_lumped = models[model].get("cstrg") == "lump_"
    known = {k: v for k, v in properties(box.materials[name]).items() if k in ("conductivity", "capacity")}
    material = Material(f"{name} heat", density=box.materials[name].density, **known)
    path = next((box.folder / n for n in ("DOF.INI", "DOF.DAT") if (box.folder / n).is_file()), None)
    temperatures = read_temperatures(path, mesh.number, box.meshes) if path else np.zeros(len(mesh.points))
    if np.any(temperatures <= 0):
        node = int(np.argmin(temperatures)) + 1
        raise LegacyError(f"{box.folder}: node {node} of MAILx {mesh.number} has no temperature T(1): give its nodes one "
                          "above 0 K in DOF.INI")  # fmt: skip
    named = f"MAILx {mesh.number}"
    origin.heated.append((named, body, drives, temperatures))
    fixed = {f"node {k}": "xyz"[: body.dim] for k in range(len(mesh.points))}
    return deformable(body, material, fixed=fixed, name=named)


def read_temperatures(path, number, meshes):
    """Temperatures (n,) [K] of the nodes of a mesh, by its number, in a DOF file; 0 for nodes that it does not list."""
    count = len(next(m for m in meshes if m.number == number).points)
    out, body, reader, numbers = np.zeros(count), None, Reader(path), _numbers_of(path, meshes, "T(1)", "THERM")
    while not reader.ended:
        line = reader.next()
        if line[1:6] == "bdyty":
            body = reader.header(reader.next())
        elif not line.startswith("$") and body is not None and body[0] == "MAILx" and line[1:3] == "NO" and line[29:33] == "T(1)":
            if numbers.get(body[1]) != number:
                continue
            node = reader.whole(line, 7, 13) - 1
            if not 0 <= node < count:
                reader.fail(f"node {node + 1} is not one of MAILx {number}, which has {count}")
            out[node] = reader.number(line, 35, 48)
    return out


def _density(box, mesh, name):
    """Density of a material of a mesh [kg/m3]; box.light for a density of zero. Raises LegacyError without."""
    density = box.materials[name].density
    if density is None or density > 0 or box.light is not None:
        return density if density is None or density > 0 else float(box.light)
    raise LegacyError(
        f"{box.folder / 'BULK_BEHAV.DAT'}, line {box.materials[name].line}: material {name} of MAILx {mesh.number} has the "
        f"density Umas= {density:g}: Cairn moves bodies by their mass; give read_datbox(light=...), a density so "
        "small that it does not count, and NSCD(theta=1.0)"
    )


def _body(box, mesh, models):
    from ..model.bulk import BULK_MATERIALS
    from ..model.elastic import ElasticBody
    from ..model.solid import SolidBody

    _, _, model, name = mesh.cells[0]
    material = box.materials[name]
    cells = {}
    for element, nodes, *_ in mesh.cells:
        cells.setdefault(CELLS[element], []).append(nodes)
    points, cells = np.array(mesh.points), {kind: np.array(nodes) for kind, nodes in cells.items()}
    given = {
        "density": _density(box, mesh, name), "lumped": models[model].get("mstrg") == "lump_",
        "groups": {f"node {k}": [k] for k in range(len(mesh.points))},
        **({"plane": box.plane} if points.shape[1] == 2 else {}),
    }  # fmt: skip
    mean = {"mean_dilatation": True} if models[model].get("finel") == MEAN else {}
    if len({(model, name) for _, _, model, name in mesh.cells}) > 1:
        return _of_several(box, mesh, models, points, cells, given | mean)
    heat = models[model].get("physics") == "THERM"
    bulk = None if heat else solids.solid_material(box, models[model], material)
    young, poisson = (None, None) if bulk is not None else solids.elastic(box, material)
    if bulk is None and (mean or given.get("plane") == "axisymmetric"):
        bulk = BULK_MATERIALS["IsotropicElastic"](young=young, poisson=poisson)
    if bulk is not None:
        return SolidBody(points, cells, bulk, **given, **mean)
    return ElasticBody(points, cells, young=young, poisson=poisson, **given)


def _of_several(box, mesh, models, points, cells, given):
    """SolidBody with several materials: a material and a density for each cell."""
    from ..model.bulk import BULK_MATERIALS
    from ..model.solid import SolidBody

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
        density.setdefault(kind, []).append(_density(box, mesh, name))
    laws = list(made.values())
    material = {kind: (laws, np.array(of)) for kind, of in which.items()}
    return SolidBody(points, cells, material, **{**given, "density": {kind: np.array(of) for kind, of in density.items()}})


def _deformable(box, mesh, models, drives, state, materials, origin):
    from ..model.meshes import deformable

    if models[mesh.cells[0][2]].get("physics") == "THERM":
        return _heated(box, mesh, models, drives, origin)
    body = _body(box, mesh, models)
    note = f"meshes in 2D are taken as plane={box.plane!r}: the files do not say, read_datbox(plane=...) does"
    if body.dim == 2 and note not in origin.notes:
        origin.notes.append(note)
    for _, _, model, name in mesh.cells:
        note = solids.swelling_note(models[model], box.materials[name])
        if name in box.replaced:
            note = f"material {name} ({box.materials[name].law}) is read as {box.replaced[name]!r}, which materials= gives"
        if note and note not in origin.notes:
            origin.notes.append(note)
    drive, pushed = {}, {}
    for node, d in drives:
        target = drive if d.kind == "vlocy" else pushed
        target.setdefault(f"node {node}", {})["xyz"[d.component - 1]] = function_of(d)

    force = {group: Components(by.get(axis, 0.0) for axis in "xyz"[: body.dim]) for group, by in pushed.items()}
    points = _contact_points(mesh)
    faces = _sides(mesh, "ASpxx") + _sides_of_zones(box, mesh, ("CSpxx", *ORDERS))
    edges = _sides(mesh, "ALpxx") + _sides_of_zones(box, mesh, ["CLxxx"])
    density = _density(box, mesh, mesh.cells[0][3])
    if density != box.materials[mesh.cells[0][3]].density:
        origin.notes.append(f"MAILx {mesh.number}: its material has no density, and is read with light={density:g}")

    def named(kind, color):
        name = f"{mesh.cells[0][3]} {color} {kind}"
        materials[name] = ("MAILx", "CSxxx" if kind in ("CSpxx", *ORDERS) else kind, color)
        return Material(name, density=density)

    silent = Material(f"{mesh.cells[0][3]} of zones", density=density)
    moved, velocity = state if state is not None else (None, None)
    return deformable(
        body, Material(mesh.cells[0][3], density=density), drive=drive, force=force or None,
        point_material=[named(kind, color) for kind, color, *_ in points],
        edge_material=[named("ALpxx", color) if color is not None else silent for color, _ in edges],
        face_material=[named("ASpxx", color) if color is not None else silent for color, _ in faces],
        # an antagonist edge has its body on the right, here it is on the left
        edges=np.array([nodes[::-1] for _, nodes in edges], int).reshape(-1, 2),
        faces=np.array([nodes + [-1] * (4 - len(nodes)) for _, nodes in faces], int).reshape(-1, 4),
        points=_padded(points) if points else None, velocity=velocity, displacement=moved, name=f"MAILx {mesh.number}",
    )  # fmt: skip


def _sides(mesh, kind):
    """[(colour, nodes)] of the antagonists of a type."""
    return [(color, nodes) for k, color, nodes, _ in mesh.contactors if k == kind]


def _sides_of_zones(box, mesh, kinds):
    """[(None, nodes)] of the sides with candidate points of cohesive zones, each once: they give these points their tributary
    area and have no contacts themselves."""
    zones = {name for name, law in box.laws.items() if "_CZM" in law.law or "MOHR" in law.law}
    colors = {side[2] for see in box.see if see.law in zones for side in (see.candidate, see.antagonist) if side[0] == "MAILx"}
    found = {tuple(nodes): (None, nodes) for kind, color, nodes, _ in mesh.contactors if kind in kinds and color in colors}
    known = {frozenset(nodes) for _, nodes in _sides(mesh, "ASpxx") + _sides(mesh, "ALpxx")}
    return [side for nodes, side in found.items() if frozenset(nodes) not in known]


def _contact_points(mesh):
    """[(type, colour, nodes, weights)] of the candidate points of a mesh."""
    points, at_nodes = [], set()
    for kind, color, nodes, share in mesh.contactors:
        if kind == "CLxxx":
            points.append((kind, color, nodes, (1 - share, share)))
        elif kind in ORDERS:
            points += [(kind, color, nodes, weights) for weights in face_points(len(nodes), ORDERS[kind])]
        elif kind == "CSpxx" and isinstance(share, list):
            points.append((kind, color, nodes, share))
        elif kind == "CSpxx":
            for node in nodes:
                if (color, node) not in at_nodes:
                    points.append((kind, color, [node], [1.0]))
                at_nodes.add((color, node))
    return points


def _padded(points):
    """Nodes and weights (m, k); shorter rows are padded by their first node with weight 0."""
    most = max(len(nodes) for _, _, nodes, _ in points)
    nodes = [[*nodes, *[nodes[0]] * (most - len(nodes))] for _, _, nodes, _ in points]
    return np.array(nodes), np.array([[*weights, *[0.0] * (most - len(weights))] for *_, weights in points])
