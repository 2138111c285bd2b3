"""Blocks from files: OBJ, PLY, OFF, STL (with trimesh), VTK and gmsh (meshio), STEP (gmsh), IFC (ifcopenshell), COMPAS, LMGC90.

Each file becomes cairn.pre.blocks.Blocks with a report: whether each surface is closed, volumes, the
smallest edge, overlaps and joints. Blocks that are not convex are refused, replaced by their hulls, or read as bodies of several
convex parts.
"""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import numpy as np

from ..base import checks
from ..base.errors import MissingFile
from ..base.libraries import by_library
from . import cad_files, mass_properties, mesh
from .block_overlaps import overlaps
from .blocks import FLUSH, Blocks
from .decompose import convex_parts
from .flatten import flattened, plane_groups, rim
from .import_report import BlocksFileError, BlocksWarning, ImportReport, Raw, told_of  # noqa: F401
from .obj_files import kind_of, read_objects
from .polygon_faces import SINGLE, rounding
from .polygon_faces import flat as flat_loops
from .polygon_files import fans_of, in_triangles, read_off, read_ply
from .solids import solids

REFUSED = (
    "{} is not convex{}; take its hull: convex='hull', or read it as a body of several convex parts: cairn.pre.importing.bodies"
)
LARGE, SMALL = 20.0, 0.02  # [m] of the median block: stones are rarely so long, or so short
FEW = 5  # bodies whose parts an error counts
KERNEL = 1e-7  # of a body's size: how far a corner may stand out of a face that the kernels take for plane


def read(path, *, repair=False, convex="refuse", scale=1.0, flat=1e-6) -> tuple[Blocks, ImportReport]:
    """Blocks and report of a file: .stl .obj .ply .off .vtk .vtu .msh .step .stp .ifc .json (COMPAS) .DAT
    (LMGC90 BODIES.DAT). Faces may have any number of corners, and need not be convex (shapely).

    repair: mend surfaces that are not closed (cairn.pre.mesh.repair); convex: "refuse" other blocks, or take their "hull"
    (`bodies` keeps them unchanged); scale: metres in a unit of the file (STEP and IFC tell theirs); flat: allowed distance of
    corners from the planes of their faces, over the extent of all blocks, beyond the rounding of the file's numbers (seven
    digits, if all are such): these corners are moved into the planes. Blocks named "support" (by a COMPAS assembly, a physical
    volume of gmsh, an object of OBJ) are held; others are by blocks.part[k] = "support". Raises cairn.pre.mesh.MeshError or
    ValueError naming the file and each block.
    """
    if convex not in ("refuse", "hull"):
        raise ValueError(f'convex is {convex!r}: give "refuse" or "hull", or take cairn.pre.importing.bodies')
    scale, flat = checks.positive("scale", scale), checks.number("flat", flat)
    with told_of(path):
        found, parts, dim, facts = gathered(path, repair, convex, scale, flat)
        blocks = Blocks(dim)
        several = [(k, body) for k, body in enumerate(found) if len(body) > 1]
        if several:
            corners = [np.concatenate([np.asarray(piece if dim == 2 else piece[0]) for piece in body]) for _, body in several]
            faults = [(k, not_convex(f"{Path(path).name}, block {k}", x)) for (k, _), x in zip(several, corners)]
            raise all_told(Path(path).name, faults, len(found))
        for body, part in zip(found, parts):
            vertices, faces = (body[0], None) if dim == 2 else body[0]
            blocks.add(vertices, faces, part)
        blocks.flush = facts.pop("flush", FLUSH)
        return blocks, report_of(blocks, **facts)


def bodies(path, *, repair=False, scale=1.0, flat=1e-6, near=None) -> tuple[list, list, ImportReport]:
    """Bodies of a file, convex or not: a list with the convex parts of each, for `cairn.polyhedra(bodies, ...)` (polygons in 2D);
    a list of their names; the report. Options: those of `read`; near: as of cairn.pre.convex_parts."""
    scale, flat = checks.positive("scale", scale), checks.number("flat", flat)
    with told_of(path):
        found, parts, dim, facts = gathered(path, repair, "parts", scale, flat, near)
        blocks, owner = Blocks(dim), []
        for k, body in enumerate(found):
            for piece in body:
                vertices, faces = (piece, None) if dim == 2 else piece
                blocks.add(vertices, faces, parts[k])
                owner.append(k)
        blocks.flush = facts.pop("flush", FLUSH)
        return found, parts, report_of(blocks, owner=np.array(owner), **facts)


def gathered(path, repair, convex, scale, flat, near=None):
    """Common part of `read` and `bodies`: convex parts of each body in a file, names, dim and facts for the report."""
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in READERS:
        raise ValueError(f"{path.name} ends in {ending!r}: give one of {', '.join(READERS)}")
    if not path.exists():
        raise MissingFile(path)
    raw = READERS[ending](path)
    notes = {}
    in_triangles(raw, path.name, convex, flat)
    for vertices, faces, part, own in raw.soups:
        first = len(raw.bodies)
        apart(raw, path.name, vertices, faces, part, repair, notes, flat)
        raw.names.update(dict.fromkeys(range(first, len(raw.bodies)), own))
    if not raw.bodies:
        raise ValueError(f"{path.name} holds no surface of any block: give a file of closed surfaces, triangles or polygons")
    if raw.dim == 2:
        found, facts = polygons(raw, path.name, convex, scale)
    else:
        found, facts = assembled(raw, path.name, repair, convex, scale, flat, notes, near)
    facts["names"] = tuple(raw.names.get(k, "") for k in range(len(found)))
    facts["hints"] = tuple(hints_on(path.name, found, scale, raw))
    facts |= {"unit": raw.unit, "scale": scale}
    for hint in facts["hints"]:
        warnings.warn(hint, BlocksWarning, stacklevel=3)
    return found, raw.parts, raw.dim, facts


def hints_on(name, found, scale, raw):
    """Hints from the sizes and the parts of bodies at a wrong unit or at missing joints."""
    corners = [np.concatenate([np.asarray(p if raw.dim == 2 else p[0]) for p in body]) for body in found]
    size = float(np.median([np.max(np.ptp(x, axis=0)) for x in corners]))
    if size >= LARGE and not raw.in_metres:
        finer = "1e-3" if size >= 5 * LARGE else "1e-2"
        yield (
            f"blocks of {name} are {size:.3g} m long (the median): if its unit is the millimetre or the centimetre, "
            f"give scale={finer if scale == 1 else f'{float(finer) * scale:g}'} (1e-3 for mm, 1e-2 for cm)"
        )
    elif size < SMALL:
        if raw.in_metres:
            told = f"the file tells its unit, {raw.unit or 'none, for which the millimetre is taken'}, and comes in metres"
            told += ": leave scale out" if scale < 1 else ": if they were drawn in another, give scale="
        else:
            told = "if its unit is the metre, give scale=1" if scale < 1 else "give scale=, the metres in a unit of the file"
        yield f"blocks of {name} are {size:.3g} m long (the median) at scale={scale:g}: {told}"
    several = [k for k, body in enumerate(found) if len(body) > 1]
    if several:
        most = max(several, key=lambda k: len(found[k]))
        yield (
            f"{len(several)} of {len(found)} blocks of {name} are not convex, each ONE rigid body: {raw.label('', most)[2:]} of "
            f"{len(found[most])} convex parts that never come apart. Where joints are to open, the file must hold block by block"
        )


def polygons(raw: Raw, name, convex, scale):
    """Convex parts of each body in 2D, and facts for the report."""
    found, hulls, faults = [], [], []
    for k, body in enumerate(raw.bodies):
        try:
            corners = [mesh.check_polygon(np.asarray(p[0], float) * scale, f"{name}, block {k}") for p in body]
        except mesh.MeshError as error:
            faults.append((k, error))
            continue
        pieces = [q for c in corners for q in convex_parts(c)]
        if len(pieces) > len(corners) and convex == "refuse":
            faults.append((k, not_convex(f"{name}, block {k}", np.concatenate(corners))))
        if len(pieces) > len(corners) and convex == "hull":
            qhull = mesh.library("scipy.spatial", "for convex hulls").ConvexHull
            pieces = [c[qhull(c).vertices] for c in corners]
            hulls.append(k)
        found.append(pieces)
    if faults:
        raise all_told(name, faults, len(raw.bodies))
    return found, {"closed": len(found), "hulls": hulls}


def not_convex(label, vertices, told=""):
    """Error that refuses a body, with the middle of its bounding box. told: more about it."""
    middle = mesh.place((vertices.min(axis=0) + vertices.max(axis=0)) / 2)
    return mesh.MeshError("not convex", REFUSED.format(f"{label} at {middle}", told))


def _parts_told(vertices, fans):
    """Volume and convex parts of a body, where these are found at once."""
    try:
        parts = convex_parts(vertices, fans, most=32)
    except ValueError:
        return ""
    volume = mass_properties.polyhedra([vertices], [fans]).measure[0]
    return f", of volume {volume:.6g} and {len(parts)} convex parts"


def all_told(name, faults, count, more=""):
    """Single error for all faults, pairs of a block and its MeshError: each fault with the remedy of the first."""
    if len(faults) == 1:
        _, error = faults[0]
        return mesh.MeshError(error.fault, f"{error}{more}", error.items)
    facts, remedies = zip(*(str(error).partition("; ")[::2] for _, error in faults))
    blocks, kinds = list(dict.fromkeys(k for k, _ in faults)), {error.fault for _, error in faults}
    lines = [f"{name}: {len(blocks)} of {count} blocks are refused", *(f"  {fact.removeprefix(name + ', ')}" for fact in facts)]
    lines += [f"what to do: {remedy}{more}" for remedy in dict.fromkeys(remedies)]
    return mesh.MeshError(kinds.pop() if len(kinds) == 1 else "several", "\n".join(lines), blocks)


def apart(raw, name, vertices, faces, part, repair, notes, flat):
    """Adds the bodies that a heap of triangles bounds to raw."""
    vertices = np.asarray(vertices, float)
    finite = np.isfinite(vertices).all(axis=1)
    lost = ~finite[faces].all(axis=1)
    if np.any(lost):
        if not repair:
            k = int(np.argmin(finite))
            raise mesh.MeshError(
                "not finite",
                f"{name}: vertex {k} is {vertices[k]}: give finite numbers ({np.sum(lost)} faces have such a vertex; repair=True "
                "drops them and fills the hole)",
            )
        faces = faces[~lost]
    if not is_closed(faces):  # a format that repeats corners for each face; where it does not, blocks that touch stay apart
        vertices, faces = mesh.weld(np.where(finite[:, None], vertices, 0.0), faces)
    for body in bodies_of(vertices, faces, flat) if len(faces) else []:
        if np.any(lost):
            notes.setdefault(len(raw.bodies), []).append(f"{np.sum(lost)} faces of the file had a vertex that is not finite")
        raw.bodies.append([body])
        raw.parts.append(part)


def bodies_of(vertices, faces, flat):
    """The bodies that triangles bound. Where some are not closed, those that the order of the file tells apart, if these are more
    and no more of them have faults: a face that is turned the wrong way misleads the search round an edge."""
    limit = 4 * rounding([vertices[faces]], flat)
    found = solids(vertices, faces, limit)
    faults = sum(not is_closed(f) for _, f in found)
    if faults:
        others = solids(vertices, faces, limit, in_order=True)
        if len(others) > len(found) and sum(not is_closed(f) for _, f in others) <= faults:
            return others
    return found


def smallest_for(name, pieces, scale):
    """The most by which corners may be moved: a thousandth of the smallest block. Refuses files whose digits are too few."""
    sizes = [float(np.max(np.ptp(v, axis=0))) for _, v, _ in pieces]
    points = np.concatenate([v for _, v, _ in pieces]) / scale
    lost = float(np.max(np.abs(points))) * SINGLE * scale
    if np.array_equal(points.astype(np.float32), points) and lost > 0.1 * min(sizes):
        k = pieces[int(np.argmin(sizes))][0]
        raise ValueError(
            f"{name} keeps seven digits of coordinates up to {np.max(np.abs(points)):.3g}, that is {lost:.2g} m of block {k}, "
            f"which is {min(sizes):.2g} m: move the model near zero before it is written, or write it with more digits"
        )
    return 1e-3 * min(sizes)


def assembled(raw: Raw, name, repair, convex, scale, flat, notes, near=None):
    """Convex parts of each body, and facts for the report."""
    closed, repaired, hulls, pieces, faults, refused = 0, {}, [], [], [], []
    for k, body in enumerate(raw.bodies):
        label = raw.label(name, k)
        for surface in body:
            vertices, faces = np.asarray(surface[0], float) * scale, surface[1]
            try:
                mesh.check(vertices, faces, label)
                closed += surface is body[0] and k not in notes
            except mesh.MeshError as error:
                try:
                    if not repair:
                        raise error
                    vertices, faces, done = mesh.repair(vertices, faces, label)
                    repaired[k] = repaired.get(k, notes.get(k, [])) + done
                except mesh.MeshError as left:
                    if convex != "hull" or left.fault != "crossing":  # corners alone have the same hull
                        faults.append((k, left))
                        continue
            pieces.append((k, vertices, faces))
    if faults:
        raise all_told(name, faults, len(raw.bodies), "" if repair else " (repair=True does so while reading)")
    limit = min(rounding([v / scale for _, v, _ in pieces], flat) * scale, smallest_for(name, pieces, scale))
    grouped = [(v, fans, plane_groups(v, fans, limit)) for _, v, fans in pieces]
    plane, farthest = flattened(grouped, limit)
    found = [[] for _ in raw.bodies]
    for (k, _, fans), vertices, (_, _, groups) in zip(pieces, plane, grouped):
        if mesh.is_convex(vertices, fans, KERNEL):
            found[k].append((vertices, [rim(fans[g]) for g in groups]))
        elif convex == "parts":
            found[k] += convex_parts(vertices, fans, near=near)
        elif convex == "hull":
            vertices, fans = mesh.hull(vertices)
            small = FLUSH * np.max(np.ptp(vertices, axis=0))
            found[k].append((vertices, [rim(fans[g]) for g in plane_groups(vertices, fans, small)]))
            hulls.append(k)
        else:
            told = _parts_told(vertices, fans) if len(refused) < FEW else ""
            refused.append((k, not_convex(raw.label(name, k), vertices, told)))
    if refused:
        raise all_told(name, refused, len(raw.bodies))
    size = min(float(np.max(np.ptp(v, axis=0))) for v in plane)
    flush = max(FLUSH, min(limit / size, 1e-3))
    return found, {"closed": closed, "repaired": repaired, "hulls": hulls, "flattened": farthest, "flush": flush}


def report_of(
    blocks: Blocks, *, closed=None, repaired=None, hulls=None, flattened=0.0, owner=None, names=(), hints=(), unit="", scale=1.0
) -> ImportReport:
    """The report of any assembly, as an import gives it. owner (n,): the body of each block, where bodies have several convex
    parts."""
    edges = []
    for k, v in enumerate(blocks.vertices):
        loops = blocks.faces[k] if blocks.dim == 3 else [range(len(v))]
        edges.append(min(np.linalg.norm(v[list(f)] - v[[*f[1:], f[0]]], axis=1).min() for f in loops))
    owner = np.arange(len(blocks)) if owner is None else owner
    pairs, depth = overlaps(blocks, blocks.flush)
    joints = blocks.joints().blocks
    pairs, joints = owner[pairs], owner[joints]
    foreign = pairs[:, 0] != pairs[:, 1]
    count = int(owner[-1]) + 1
    return ImportReport(
        count,
        count if closed is None else closed,
        repaired or {},
        hulls or [],
        float(blocks.properties().measure.sum()),
        float(min(edges)),
        pairs[foreign],
        depth[foreign],
        int(np.sum(joints[:, 0] != joints[:, 1])),
        flattened,
        len(blocks),
        tuple(names),
        tuple(hints),
        tuple(np.ptp(np.concatenate(blocks.vertices), axis=0).tolist()),
        unit,
        scale,
    )


# ---------------------------------------------------------------------- readers


def read_trimesh(path) -> Raw:
    trimesh = mesh.library("trimesh", f"to read {path.suffix} files")
    loaded = by_library(path, lambda p: trimesh.load(p, process=False))
    raw = Raw()
    for geometry in list(loaded.geometry.values()) if hasattr(loaded, "geometry") else [loaded]:
        if not hasattr(geometry, "faces"):
            continue  # lines and points bound nothing
        raw.soups.append((np.array(geometry.vertices), np.array(geometry.faces), "block", ""))
    return raw


def read_obj(path) -> Raw:
    """The objects of an OBJ file, by their names; as one where these are not closed and the whole is."""
    vertices, objects = read_objects(path)
    if len(objects) > 1:
        whole = [face for _, faces in objects for face in faces]
        alone = all(is_closed(mesh.weld(vertices, fans_of(faces))[1]) for _, faces in objects)
        if not alone and is_closed(mesh.weld(vertices, fans_of(whole))[1]):
            objects = [("", whole)]
    raw = Raw()
    for name, faces in objects:
        sizes, corners = flat_loops(faces)
        used, numbers = np.unique(corners, return_inverse=True)
        raw.soups.append((vertices[used], np.split(numbers.ravel(), np.cumsum(sizes)[:-1]), kind_of(name) or "block", name))
    return raw


def by_polygons(reader):
    """A reader of files that hold corners and faces of one heap."""

    def read(path) -> Raw:
        vertices, faces = reader(path)
        short = next((k for k, f in enumerate(faces) if len(f) < 3), None)
        if short is not None:
            raise ValueError(f"{path.name}: face {short} is {list(map(int, faces[short]))}: a face has at least three corners")
        return Raw(soups=[(vertices, faces, "block", "")])

    return read


def is_closed(faces) -> bool:
    try:
        mesh.refuse_open("mesh", faces)
    except mesh.MeshError:
        return False
    return True


def read_meshio(path) -> Raw:
    """Surfaces of triangles or quadrilaterals, or the skins of volume elements: of each volume that gmsh has tagged, else of each
    connected component. A physical volume gives its name to its blocks."""
    meshio = mesh.library("meshio", f"to read {path.suffix} files")
    m = by_library(path, meshio.read)
    points = np.asarray(m.points, float)
    points = np.column_stack((points, np.zeros(len(points)))) if points.shape[1] == 2 else points
    names = {(int(tag), int(dim)): name for name, (tag, dim) in m.field_data.items()}
    volumes, surface = {}, []
    for k, block in enumerate(m.cells):
        cells = np.asarray(block.data)
        if block.type in SKINS:
            entity, physical = (tags(m, f"gmsh:{kind}", k, len(cells)) for kind in ("geometrical", "physical"))
            for pair in np.unique(np.column_stack((entity, physical)), axis=0).tolist():
                mine = cells[(entity == pair[0]) & (physical == pair[1])]
                volumes.setdefault(tuple(pair), []).extend(row for f in SKINS[block.type] for row in mine[:, list(f)].tolist())
        elif block.type in ("triangle", "quad", "polygon"):
            surface += cells.tolist()
    raw = Raw()
    for (_, physical), faces in volumes.items():
        seen = {}
        for f in faces:  # a face that two elements share lies inside
            seen.setdefault(frozenset(f), []).append(f)
        outer = [f[0] for f in seen.values() if len(f) == 1]
        raw.soups.append((points, outer, names.get((physical, 3), "block"), ""))
    if not volumes and surface:
        raw.soups.append((points, surface, "block", ""))
    if not raw.soups:
        raise ValueError(f"{path.name} holds no triangles, quadrilaterals or volume elements")
    return raw


def tags(m, name, k, count):
    """Numbers of the volumes of the cells of block k, 0 where the file has none."""
    found = m.cell_data.get(name)
    return np.zeros(count, np.int64) if found is None else np.asarray(found[k], np.int64).reshape(count)


SKINS: dict[str, list] = {  # faces of meshio's volume elements, seen from outside anticlockwise
    "tetra": [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)],
    "hexahedron": [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)],
    "wedge": [(0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)],
    "pyramid": [(0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)],
}


def by_solids(reader):
    """A reader of files of CAD, whose solids have names and come in metres."""

    def read(path) -> Raw:
        found, unit = reader(path)
        raw = Raw(in_metres=True, unit=unit)
        for vertices, faces, name in found:
            raw.soups.append((vertices, faces, kind_of(name) or "block", name))
        return raw

    return read


def read_compas(path) -> Raw:
    """Any COMPAS JSON that holds meshes (dictionaries of vertices and faces), of whichever release; supports are marked."""
    try:
        content = json.loads(path.read_text())
    except json.JSONDecodeError as error:
        raise ValueError(f"{path.name} is no JSON: line {error.lineno}, {error.msg}") from None
    raw = Raw()

    def walk(item, support):
        if isinstance(item, list):
            for x in item:
                walk(x, support)
        elif isinstance(item, dict):
            support = bool(item.get("is_support", support)) or bool((item.get("attributes") or {}).get("is_support", False))
            if isinstance(item.get("vertex"), dict) and isinstance(item.get("face"), dict) and item["vertex"]:
                names = {str(name): k for k, name in enumerate(item["vertex"])}
                vertices = [[float(v[axis]) for axis in "xyz"] for v in item["vertex"].values()]
                raw.bodies.append([(vertices, [[names[str(v)] for v in f] for f in item["face"].values()])])
                raw.parts.append("support" if support else "block")
            else:
                for x in item.values():
                    walk(x, support)

    walk(content, False)
    return raw


def read_lmgc90(path) -> Raw:
    """POLYG and POLYR of a BODIES.DAT at their reference positions; columns as LMGC90 writes them. The colour is the part; a body
    of several contactors is a body of several parts."""
    raw, node, lines = Raw(0), None, path.read_text(errors="replace").splitlines()
    k, fresh = 0, True
    while k < len(lines):
        line = lines[k]
        kind = line[1:6].strip()
        fresh = fresh or kind == "bdyty"
        try:
            if kind in ("NO3xx", "NO6xx"):
                dim = 2 if kind == "NO3xx" else 3
                node = np.array([float(line[a : a + 14]) for a in (34, 55, 76)[:dim]])
            elif kind in ("POLYG", "POLYR"):
                dim = 2 if kind == "POLYG" else 3
                if raw.dim not in (0, dim):
                    raise ValueError("polygons (2D) and polyhedra (3D) in one file: write two files")
                raw.dim, count = dim, int(line[39:46])
                starts = (34, 55, 76)[:dim]
                vertices = [[float(x[a : a + 14]) for a in starts] for x in lines[k + 1 : k + 1 + count]]
                faces: list | np.ndarray = []
                if dim == 3:
                    rows = lines[k + 1 + count : k + 1 + count + int(line[59:66])]
                    faces = np.array([[int(x[34:41]), int(x[55:62]), int(x[76:83])] for x in rows]) - 1
                    count += len(rows)
                part = line[22:27].strip() or "block"
                if fresh:
                    raw.bodies.append([])
                    raw.parts.append(part)
                raw.bodies[-1].append((np.array(vertices) + node, faces))
                k, fresh = k + count, False
        except (ValueError, TypeError) as error:
            raise ValueError(f"{path.name}, line {k + 1}, {kind}: {error}") from None
        k += 1
    raw.dim = raw.dim or 3
    return raw


READERS = {
    ".stl": read_trimesh,
    ".obj": read_obj,
    ".ply": by_polygons(read_ply),
    ".off": by_polygons(read_off),
    ".vtk": read_meshio,
    ".vtu": read_meshio,
    ".msh": read_meshio,
    ".json": read_compas,
    ".dat": read_lmgc90,
    ".ifc": by_solids(cad_files.read_ifc),
    ".step": by_solids(cad_files.read_step),
    ".stp": by_solids(cad_files.read_step),
}
