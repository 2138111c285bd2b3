"""Blocks from files: STL, OBJ, PLY (with trimesh), VTK and gmsh (with meshio), COMPAS assemblies, LMGC90's block lists.

Each file becomes cairn.pre.blocks.Blocks with a report of what was found: whether each surface is closed, volumes, the
smallest edge, overlaps and joints. What is not convex is refused, or replaced by its hull when asked.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from . import mesh
from .block_overlaps import overlaps
from .blocks import Blocks


@dataclass(frozen=True)
class ImportReport:
    """What an import found. closed: blocks whose surface was closed as it came; repaired: what was done, by block; hulls:
    blocks replaced by their convex hulls; volume [m3] (area in 2D); smallest_edge [m]; overlaps (k, 2) blocks and
    overlap_depth (k,) [m]; joints: how many pairs of faces lie on each other."""

    blocks: int
    closed: int
    repaired: dict
    hulls: list
    volume: float
    smallest_edge: float
    overlaps: np.ndarray
    overlap_depth: np.ndarray
    joints: int

    def __str__(self):
        lines = [
            f"{self.blocks} blocks, {self.closed} closed as they came, {len(self.repaired)} repaired, {len(self.hulls)} hulls",
            f"volume {self.volume:.6g}, smallest edge {self.smallest_edge:.3g} m, {self.joints} joints",
            f"{len(self.overlaps)} overlaps"
            + (f", the deepest {self.overlap_depth.max():.3g} m" if len(self.overlaps) else ""),
        ]
        return "\n".join(lines)


@dataclass
class Raw:
    """Blocks as a file holds them: surfaces (vertices, faces), or polygons; parts."""

    dim: int = 3
    bodies: list = field(default_factory=list)
    parts: list = field(default_factory=list)


def read(path, *, repair=False, convex="refuse", scale=1.0) -> tuple[Blocks, ImportReport]:
    """Blocks and report of a file: .stl .obj .ply .vtk .vtu .msh .json (COMPAS) .DAT (LMGC90 BODIES.DAT).

    repair: mend surfaces that are not closed (cairn.pre.mesh.repair); convex: "refuse" what is not, or take its "hull";
    scale: metres in a unit of the file. Raises cairn.pre.mesh.MeshError or ValueError naming file and block.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in READERS:
        raise ValueError(f"{path.name} ends in {ending!r}: give one of {', '.join(READERS)}")
    if convex not in ("refuse", "hull"):
        raise ValueError(f'convex is {convex!r}: give "refuse" or "hull"')
    if not path.exists():
        raise FileNotFoundError(f"{path} does not exist")
    raw = READERS[ending](path)
    if not raw.bodies:
        raise ValueError(f"{path.name} holds no surface of any block")
    return assembled(raw, path.name, repair, convex, scale)


def assembled(raw: Raw, name, repair, convex, scale):
    """Blocks and report from what a reader found."""
    blocks, closed, repaired, hulls = Blocks(raw.dim), 0, {}, []
    for k, body in enumerate(raw.bodies):
        label = f"{name}, block {k}"
        if raw.dim == 2:
            blocks.add(mesh.check_polygon(np.asarray(body[0]) * scale, label), part=raw.parts[k])
            closed += 1
            continue
        vertices, faces = np.asarray(body[0], float) * scale, body[1]
        try:
            report = mesh.check(vertices, faces, label)
            closed += 1
        except mesh.MeshError as error:
            if not repair:
                raise mesh.MeshError(error.fault, f"{error} (repair=True does so while reading)", error.items) from None
            vertices, faces, repaired[k] = mesh.repair(vertices, faces, label)
            report = mesh.check(vertices, faces, label)
        if not report.convex:
            if convex == "refuse":
                raise mesh.MeshError(
                    "not convex", f"{label} is not convex; cut it into convex blocks, or take its hull: convex='hull'"
                )
            vertices, faces = mesh.hull(vertices)
            hulls.append(k)
        blocks.add(vertices, plane_faces(vertices, faces), raw.parts[k])
    return blocks, report_of(blocks, closed, repaired, hulls)


def report_of(blocks: Blocks, closed=None, repaired=None, hulls=None) -> ImportReport:
    """The report of any assembly, as an import gives it."""
    edges = []
    for k, v in enumerate(blocks.vertices):
        loops = blocks.faces[k] if blocks.dim == 3 else [range(len(v))]
        edges.append(min(np.linalg.norm(v[list(f)] - v[[*f[1:], f[0]]], axis=1).min() for f in loops))
    pairs, depth = overlaps(blocks)
    return ImportReport(
        len(blocks),
        len(blocks) if closed is None else closed,
        repaired or {},
        hulls or [],
        float(blocks.properties().measure.sum()),
        float(min(edges)),
        pairs,
        depth,
        len(blocks.joints().area),
    )


def plane_faces(vertices, faces, tolerance=1e-9):
    """Triangles of one plane joined into polygons, so that joints and contacts see whole faces."""
    faces = [list(f) for f in np.asarray(faces).tolist()] if isinstance(faces, np.ndarray) else [list(f) for f in faces]
    size = np.max(np.ptp(vertices, axis=0))
    normals = []
    for f in faces:
        p = vertices[f] - vertices[f[0]]
        n = np.cross(p, np.roll(p, -1, axis=0)).sum(axis=0)
        normals.append(n / np.linalg.norm(n))
    normals = np.array(normals)
    # a convex body's faces of one normal lie in one plane
    left, joined = list(range(len(faces))), []
    while left:
        k = left[0]
        heights = np.array([np.max(np.abs((vertices[faces[m]] - vertices[faces[k][0]]) @ normals[k])) for m in left])
        same = [m for m, h in zip(left, heights) if h <= tolerance * size and normals[m] @ normals[k] > 0]
        left = [m for m in left if m not in same]
        joined.append(rim([faces[m] for m in same]))
    return joined


def rim(faces):
    """The loop of edges that belong to one face only."""
    edges = {(a, b) for f in faces for a, b in zip(f, [*f[1:], f[0]])}
    follow = {a: b for a, b in edges if (b, a) not in edges}
    loop = [next(iter(follow))]
    while follow[loop[-1]] != loop[0]:
        loop.append(follow[loop[-1]])
    return loop


# ---------------------------------------------------------------------- readers


def read_trimesh(path) -> Raw:
    trimesh = mesh.library("trimesh", f"to read {path.suffix} files")
    loaded = trimesh.load(path, process=False)
    geometries = list(loaded.geometry.values()) if hasattr(loaded, "geometry") else [loaded]
    raw = Raw()
    for geometry in geometries:
        vertices, faces = np.array(geometry.vertices), np.array(geometry.faces)
        if not is_closed(faces):  # a format that repeats corners for each face; where it does not, blocks that touch stay apart
            vertices, faces = mesh.weld(vertices, faces)
        raw.bodies += mesh.parts(vertices, faces)
    raw.parts = ["block"] * len(raw.bodies)
    return raw


def is_closed(faces) -> bool:
    try:
        mesh.refuse_open("mesh", faces)
    except mesh.MeshError:
        return False
    return True


def read_meshio(path) -> Raw:
    """Surfaces of triangles or quadrilaterals, or the skin of volume elements; a block for each joined part."""
    meshio = mesh.library("meshio", f"to read {path.suffix} files")
    m = meshio.read(path)
    faces = []
    for block in m.cells:
        table = SKINS.get(block.type)
        if table is not None:
            outer = [block.data[:, list(f)] for f in table]
            faces += [tuple(row) for f in outer for row in f.tolist()]
    if faces:  # a face that two elements share lies inside
        seen = {}
        for f in faces:
            seen.setdefault(frozenset(f), []).append(f)
        faces = [f[0] for f in seen.values() if len(f) == 1]
    else:
        faces = [tuple(row) for b in m.cells if b.type in ("triangle", "quad", "polygon") for row in np.asarray(b.data).tolist()]
    if not faces:
        raise ValueError(f"{path.name} holds no triangles, quadrilaterals or volume elements")
    points = np.asarray(m.points, float)
    points = np.column_stack((points, np.zeros(len(points)))) if points.shape[1] == 2 else points
    triangles = np.array([(f[0], f[k], f[k + 1]) for f in faces for k in range(1, len(f) - 1)])
    raw = Raw()
    for part in mesh.parts(points, triangles):
        raw.bodies.append(part)
        raw.parts.append("block")
    return raw


SKINS = {  # faces of meshio's volume elements, seen from outside anticlockwise
    "tetra": [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)],
    "hexahedron": [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)],
    "wedge": [(0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)],
    "pyramid": [(0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)],
}


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
                raw.bodies.append((vertices, [[names[str(v)] for v in f] for f in item["face"].values()]))
                raw.parts.append("support" if support else "block")
            else:
                for x in item.values():
                    walk(x, support)

    walk(content, False)
    return raw


def read_lmgc90(path) -> Raw:
    """POLYG and POLYR of a BODIES.DAT at their reference positions; columns as LMGC90 writes them. The colour is the part."""
    raw, node, lines = Raw(0), None, path.read_text().splitlines()
    k = 0
    while k < len(lines):
        line = lines[k]
        kind = line[1:6].strip()
        if kind in ("NO3xx", "NO6xx"):
            dim = 2 if kind == "NO3xx" else 3
            node = np.array([float(line[a : a + 14]) for a in (34, 55, 76)[:dim]])
        elif kind in ("POLYG", "POLYR"):
            dim = 2 if kind == "POLYG" else 3
            if raw.dim not in (0, dim):
                raise ValueError(f"{path.name}, line {k + 1}: polygons and polyhedra in one file")
            raw.dim, count = dim, int(line[39:46])
            starts = (34, 55, 76)[:dim]
            vertices = [[float(x[a : a + 14]) for a in starts] for x in lines[k + 1 : k + 1 + count]]
            k += count
            faces = []
            if dim == 3:
                number = int(line[59:66])
                rows = lines[k + 1 : k + 1 + number]
                faces = np.array([[int(x[34:41]), int(x[55:62]), int(x[76:83])] for x in rows]) - 1
                k += number
            raw.bodies.append((np.array(vertices) + node, faces))
            raw.parts.append(line[22:27].strip() or "block")
        k += 1
    raw.dim = raw.dim or 3
    return raw


READERS = {
    ".stl": read_trimesh,
    ".obj": read_trimesh,
    ".ply": read_trimesh,
    ".vtk": read_meshio,
    ".vtu": read_meshio,
    ".msh": read_meshio,
    ".json": read_compas,
    ".dat": read_lmgc90,
}
