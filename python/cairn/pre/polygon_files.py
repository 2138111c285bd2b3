"""Faces of files: from Stanford's PLY and Geomview's OFF with all their corners, from any other format as triangles."""

from __future__ import annotations

import numpy as np

from . import mesh
from .polygon_faces import flat, rounding

TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2", "uint16": "u2",
    "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
    "int64": "i8", "uint64": "u8",
}  # fmt: skip
ORDER = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
INDICES = ("vertex_indices", "vertex_index")


def read_ply(path):
    """(vertices (n, 3), faces: a list of corners each) of a PLY file, text or binary. Raises ValueError that names the file."""
    content = path.read_bytes()
    start = content.find(b"\n", max(content.find(b"end_header"), 0)) + 1
    lines = content[:start].decode(errors="replace").split("\n")
    if not content.startswith(b"ply") or not start or b"end_header" not in content[:start]:
        raise ValueError(f"{path.name} cannot be read as .ply: its first line is not 'ply', or its header does not end")
    order, elements = None, []
    for number, line in enumerate(lines, 1):
        kind, *words = line.split() or [""]
        try:
            if kind == "format":
                order = ORDER[words[0]]
            elif kind == "element":
                elements.append((words[0], int(words[1]), []))
            elif kind == "property":
                *types, name = words[1:] if words[0] == "list" else words
                elements[-1][2].append((name, *(TYPES[word] for word in types)))
        except (KeyError, IndexError, ValueError):
            raise ValueError(f"{path.name}, line {number}, {line.strip()[:60]!r}: no word of a PLY header") from None
    if order is None:
        raise ValueError(f"{path.name} cannot be read as .ply: its header has no format")
    reader = _Words(content[start:]) if order == "=" else _Bytes(content[start:], order)
    vertices, faces = np.zeros((0, 3)), []
    for name, count, properties in elements:
        try:
            columns = reader.element(count, properties)
        except (ValueError, IndexError, OverflowError) as error:
            raise ValueError(f"{path.name} cannot be read as .ply: {count} of {name!r} are not all there ({error})") from None
        if name == "vertex":
            if not all(axis in columns for axis in "xyz"):
                raise ValueError(f"{path.name}: its vertices have {', '.join(columns)}: x, y and z are due")
            vertices = np.column_stack([np.asarray(columns[axis], float) for axis in "xyz"])
        elif name == "face":
            faces = next((columns[word] for word in INDICES if word in columns), [])
    return vertices, faces


class _Words:
    """Elements of a PLY file written as text."""

    def __init__(self, content):
        self._words, self._at = content.split(), 0

    def element(self, count, properties):
        if count == 0:
            return {p[0]: [] for p in properties}
        alike = self._alike(count, properties)
        if alike is not None:
            return alike
        columns = {p[0]: [] for p in properties}
        for _ in range(count):
            for name, *kinds in properties:
                kept = self._take(int(self._take(1)[0])) if len(kinds) > 1 else self._take(1)
                columns[name].append([int(w) for w in kept] if name in INDICES else kept)
        return columns

    def _alike(self, count, properties):
        """Columns of an element whose lists have the length of those of its first one; None if they do not."""
        at, places = self._at, []
        for _, *kinds in properties:
            size = int(self._take(1)[0]) if len(kinds) > 1 else 1
            places.append((self._at - at, size, len(kinds) > 1))
            self._take(size)
        width, self._at = self._at - at, at
        if self._at + count * width > len(self._words):
            return None
        table = np.array(self._words[at : at + count * width], float).reshape(count, width)
        if any(listed and np.any(table[:, first - 1] != size) for first, size, listed in places):
            return None
        self._at += count * width
        found = {}
        for (name, *_), (first, size, listed) in zip(properties, places):
            own = table[:, first : first + size]
            found[name] = (own.astype(np.int64) if name in INDICES else own) if listed else own[:, 0]
        return found

    def _take(self, count):
        if count < 0 or self._at + count > len(self._words):
            raise ValueError("the file ends before")
        self._at += count
        return self._words[self._at - count : self._at]


class _Bytes:
    """Elements of a PLY file written as numbers of the machine."""

    def __init__(self, content, order):
        self._content, self._order, self._at = content, order, 0

    def element(self, count, properties):
        if count == 0:
            return {p[0]: [] for p in properties}
        alike = self._alike(count, properties)
        if alike is not None:
            return alike
        columns = {p[0]: [] for p in properties}
        for _ in range(count):
            for name, *kinds in properties:
                size = int(self._take(1, self._order + kinds[0])[0]) if len(kinds) > 1 else 1
                columns[name].append(self._take(size, self._order + kinds[-1]).tolist())
        return columns

    def _alike(self, count, properties):
        """Columns of an element whose lists have the length of those of its first one; None if they do not."""
        at, kind = self._at, []
        for name, *kinds in properties:
            size = ()
            if len(kinds) > 1:
                size = (int(self._take(1, self._order + kinds[0])[0]),)
                kind.append((f"{name} count", self._order + kinds[0]))
            kind.append((name, self._order + kinds[-1], size))
            self._take(size[0] if size else 1, self._order + kinds[-1])
        self._at = at
        if at + count * np.dtype(kind).itemsize > len(self._content):
            return None
        table = np.frombuffer(self._content, np.dtype(kind), count, at)
        for name, *kinds in properties:
            if len(kinds) > 1 and np.any(table[f"{name} count"] != table[name].shape[1]):
                return None
        self._at += table.nbytes
        return {name: table[name] for name, *_ in properties}

    def _take(self, count, kind):
        kind = np.dtype(kind)
        if count < 0 or self._at + count * kind.itemsize > len(self._content):
            raise ValueError("the file ends before")
        found = np.frombuffer(self._content, kind, count, self._at)
        self._at += count * kind.itemsize
        return found


def read_off(path):
    """Reads an OFF file likewise; colours, normals and further entries behind a vertex or a face are left out."""
    rows = [line.split("#")[0].split() for line in path.read_text(errors="replace").splitlines()]
    rows = [(number, row) for number, row in enumerate(rows, 1) if row]
    if not rows or rows[0][1][0][-3:] not in ("OFF", "off"):
        raise ValueError(f"{path.name} cannot be read as .off: its first word is not OFF")
    kind, *head = rows[0][1]
    if kind[:-3].strip("STCN"):
        raise ValueError(f"{path.name} cannot be read as .off: points of {kind} have no three coordinates, give OFF")
    rows = [(rows[0][0], head), *rows[1:]] if head else rows[1:]
    number, row = rows[0] if rows else (1, [])
    try:
        points, count = int(row[0]), int(row[1])
        vertices, faces = [], []
        for place, (number, row) in enumerate(rows[1 : 1 + points + count]):  # noqa: B007
            if place < points:
                vertices.append([float(word) for word in row[:3]])
            else:
                faces.append([int(word) for word in row[1 : 1 + int(row[0])]])
            if len(vertices[-1]) < 3 or place >= points and len(faces[-1]) < int(row[0]):
                raise ValueError(f"{3 if place < points else row[0]} {'numbers' if place < points else 'corners'} are due")
    except (ValueError, IndexError) as error:
        raise ValueError(f"{path.name}, line {number}, {' '.join(row)[:60]!r}: {error}") from None
    if len(vertices) < points or len(faces) < count:
        raise ValueError(f"{path.name} ends before: {len(vertices)} of {points} vertices, {len(faces)} of {count} faces")
    return np.array(vertices, float).reshape(-1, 3), faces


def in_triangles(raw, name, convex, share):
    """Cuts the faces of a file into triangles. share: of the extent by which corners may stand out of faces. Of hulls the corners
    count alone, so that no face of these is refused."""
    if raw.dim == 2:
        return
    surfaces = [s for body in raw.bodies for s in body]
    limit = 4 * rounding([np.asarray(s[0], float) for s in (*raw.soups, *surfaces)] or [np.zeros((0, 3))], share)

    def cut(vertices, faces, label):
        sizes, corners = flat(faces)
        wrong = np.flatnonzero((corners < 0) | (corners >= len(vertices)))
        if len(wrong):
            k = int(np.searchsorted(np.cumsum(sizes), wrong[0], side="right"))
            raise ValueError(f"{name}: face {k} is {list(map(int, faces[k]))}: vertices go from 0 to {len(vertices) - 1}")
        try:
            return mesh.triangles(np.asarray(vertices, float), faces, label, limit)
        except mesh.MeshError as error:
            if convex == "hull":
                return fans_of(faces)
            more = " in the program it comes from, or give a larger flat=" if error.fault == "not plane" else ""
            raise mesh.MeshError(error.fault, f"{error}{more}", error.items) from None

    raw.soups = [(v, cut(v, f, f"{name}, {own}" if own else name), part, own) for v, f, part, own in raw.soups if len(f)]
    raw.bodies = [[(v, cut(v, f, raw.label(name, k))) for v, f in body] for k, body in enumerate(raw.bodies)]


def fans_of(loops):
    """Triangles (t, 3) by the first corner of each face, whatever its form."""
    return np.array([(f[0], f[k], f[k + 1]) for f in loops for k in range(1, len(f) - 1)], np.int64).reshape(-1, 3)
