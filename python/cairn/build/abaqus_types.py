"""Names of Abaqus's elements as kinds of cells: meshio knows some of them alone."""

from __future__ import annotations

import contextlib
import re

# families of elements, by how many nodes they have; what letters behind tell (reduced integration, hybrid, modified, ...) changes
# no node
FLAT = {3: "triangle", 4: "quad", 6: "triangle6", 8: "quad8", 9: "quad9"}
SOLID = {4: "tetra", 6: "wedge", 8: "hexahedron", 10: "tetra10", 15: "wedge15", 20: "hexahedron20"}
FAMILIES = {
    **dict.fromkeys(("CPS", "CPE", "CAX", "DC2D", "DCAX", "R3D", "M3D", "SFM3D"), FLAT),
    **dict.fromkeys(("C3D", "DC3D"), SOLID),
    **dict.fromkeys(("R2D", "RAX"), {2: "line"}),
}
NAME = re.compile(rf"({'|'.join(FAMILIES)})(\d+)([A-Z]*)")


class UnknownType(ValueError):
    """An element of which no kind of cells is known."""


class _Kinds:
    """Kinds of cells by names of elements, as meshio asks for them: by the families, else by its own table."""

    def __init__(self, known):
        self._known = known

    def keys(self):
        return self

    def __contains__(self, name):
        return True  # an unknown one is told where it is asked for

    def __getitem__(self, name):
        name = name.upper()
        family, nodes, _ = found.groups() if (found := NAME.fullmatch(name)) else ("", 0, "")
        kind = FAMILIES.get(family, {}).get(int(nodes)) or self._known.get(name)
        if kind is None:
            raise UnknownType(name)
        return kind


@contextlib.contextmanager
def known():
    """Meanwhile meshio reads .inp files with elements of all of these families."""
    from meshio.abaqus import _abaqus

    own = _abaqus.abaqus_to_meshio_type
    _abaqus.abaqus_to_meshio_type = _Kinds(own)
    try:
        yield
    finally:
        _abaqus.abaqus_to_meshio_type = own


def read(path, by):
    """What meshio's `by` reads of an .inp file. Raises UnknownType with a message that names file and element."""
    with known():
        try:
            return by(path)
        except UnknownType as error:
            raise UnknownType(
                f"{path.name} has elements of type {error}, which are no cells that are known: give CPS, CPE or CAX with 3, 4, "
                "6 or 8 nodes, C3D with 4, 8, 10 or 20 (any letters behind, as in CPE4R), and leave others out"
            ) from None
