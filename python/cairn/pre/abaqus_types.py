"""Extends meshio's reader of Abaqus files: names of most elements, several blocks of nodes, and the node sets that these name."""

from __future__ import annotations

import contextlib
import re

import numpy as np

# Kind of cells of each family of elements, by number of nodes. Letters behind the number (reduced integration, hybrid, modified,
# ...) change no node.
FLAT = {3: "triangle", 4: "quad", 6: "triangle6", 8: "quad8", 9: "quad9"}
SOLID = {4: "tetra", 6: "wedge", 8: "hexahedron", 10: "tetra10", 15: "wedge15", 20: "hexahedron20"}
FAMILIES = {
    **dict.fromkeys(("CPS", "CPE", "CAX", "DC2D", "DCAX", "R3D", "M3D", "SFM3D"), FLAT),
    **dict.fromkeys(("C3D", "DC3D"), SOLID),
    **dict.fromkeys(("R2D", "RAX"), {2: "line"}),
}
NAME = re.compile(rf"({'|'.join(FAMILIES)})(\d+)([A-Z]*)")


class UnknownType(ValueError):
    """The name of an element that has no kind of cells here."""


class _Kinds:
    """Kinds of cells by names of elements, in place of meshio's table: looked up in FAMILIES first, then in that table."""

    def __init__(self, known):
        self._known = known

    def keys(self):
        return self

    def __contains__(self, name):
        return True  # an unknown name is refused by __getitem__

    def __getitem__(self, name):
        name = name.upper()
        family, nodes, _ = found.groups() if (found := NAME.fullmatch(name)) else ("", 0, "")
        kind = FAMILIES.get(family, {}).get(int(nodes)) or self._known.get(name)
        if kind is None:
            raise UnknownType(name)
        return kind


class _Nodes:
    """Reads a block of nodes and appends it to the earlier blocks of the file, which meshio would forget."""

    def __init__(self, own):
        self._own, self._before = own, {}

    def __call__(self, file):
        points, places, line = self._own(file)
        if file in self._before:
            first, known = self._before[file]
            points = np.concatenate([first, points])
            places = known | {number: len(first) + place for number, place in places.items()}
        self._before[file] = points, places
        return points, places, line


@contextlib.contextmanager
def known():
    """Lets meshio read all FAMILIES of elements, and all blocks of nodes, of .inp files inside the `with` block."""
    from meshio.abaqus import _abaqus

    own = _abaqus.abaqus_to_meshio_type, _abaqus._read_nodes
    _abaqus.abaqus_to_meshio_type, _abaqus._read_nodes = _Kinds(own[0]), _Nodes(own[1])
    try:
        yield
    finally:
        _abaqus.abaqus_to_meshio_type, _abaqus._read_nodes = own


def sets_of_blocks(path):
    """{name: rows of its nodes} of the sets named by blocks of nodes, such as *NODE, NSET=FOOT."""
    out, count, name, in_nodes = {}, 0, None, False
    with open(path, errors="replace") as file:
        for line in file:
            if line.startswith("**") or not line.strip():
                continue
            if line.startswith("*"):
                keyword, *given = (word.strip() for word in line[1:].split(","))
                in_nodes = keyword.upper() == "NODE"
                options = {key.strip().upper(): value.strip() for key, _, value in (word.partition("=") for word in given)}
                name = options.get("NSET") if in_nodes else None
            elif in_nodes:
                if name:
                    out.setdefault(name, []).append(count)
                count += 1
    return out


def read(path, by):
    """Mesh of an .inp file, by meshio's reader `by`. Raises UnknownType with a message that names file and element."""
    with known():
        try:
            found = by(path)
        except UnknownType as error:
            raise UnknownType(
                f"{path.name} has elements of type {error}, which are no cells that are known: give CPS, CPE or CAX with 3, 4, "
                "6 or 8 nodes, C3D with 4, 8, 10 or 20 (any letters behind, as in CPE4R), and leave others out"
            ) from None
    for name, nodes in sets_of_blocks(path).items():
        found.point_sets[name] = np.union1d(found.point_sets.get(name, np.zeros(0, np.int32)), nodes).astype(np.int32)
    return found
