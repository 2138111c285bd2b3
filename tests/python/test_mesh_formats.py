"""What files of meshes hold beside cells: fields of MED, elements of Abaqus by all of their names."""

import cairn as cn
import numpy as np
import pytest
from second_order import box

meshio = pytest.importorskip("meshio")

RUBBER = cn.NeoHookean(young=1e4, poisson=0.3)


def inp(path, kind, element, counts, keyword="*ELEMENT, TYPE={}, ELSET=BULK"):
    """An .inp file of a box of cells, as Abaqus has it."""
    points, cells = box(kind, counts, (1.0,) * len(counts))
    lines = ["*HEADING", "*NODE"]
    lines += [f"{k + 1}, " + ", ".join(map(str, (*x, 0.0)[:3])) for k, x in enumerate(points)]
    lines += [keyword.format(element)]
    lines += [f"{k + 1}, " + ", ".join(str(node + 1) for node in nodes) for k, nodes in enumerate(cells[kind])]
    left = np.flatnonzero(points[:, 0] < 1e-9)
    lines += ["*NSET, NSET=LEFT", ",".join(str(node + 1) for node in left)]
    path.write_text("\n".join(lines) + "\n")
    return points, cells


FLAT = [f"{family}{nodes}{letters}" for family in ("CPE", "CPS", "CAX") for nodes, letters in
        ((3, ""), (4, ""), (4, "R"), (4, "H"), (6, "M"), (8, ""), (8, "R"))]  # fmt: skip
KINDS = {"3": "triangle", "4": "quad", "6": "triangle6", "8": "quad8"}


@pytest.mark.parametrize("element", FLAT)
def test_plane_elements_of_abaqus_are_cells(element, tmp_path):
    kind = KINDS[element[3]]
    points, cells = inp(tmp_path / "part.inp", kind, element, (2, 1))
    plane = {"CPE": "strain", "CPS": "stress", "CAX": "axisymmetric"}[element[:3]]
    body = cn.SolidBody.read(tmp_path / "part.inp", material=RUBBER, density=1.0, plane=plane)
    assert list(body.cells) == [kind] and np.array_equal(body.cells[kind], cells[kind])
    assert np.array_equal(body.points, points) and len(body.groups["BULK"]) == len(points)
    assert np.array_equal(body.groups["LEFT"], np.flatnonzero(points[:, 0] < 1e-9))


SOLID = {"C3D8R": "hexahedron", "C3D8RT": "hexahedron", "C3D4H": "tetra", "C3D10HS": "tetra10", "c3d20r": "hexahedron20"}


@pytest.mark.parametrize(("element", "kind"), SOLID.items())
def test_solid_elements_of_abaqus_are_cells(element, kind, tmp_path):
    points, cells = inp(tmp_path / "part.inp", kind, element, (1, 1, 1), "*Element, type={}")
    body = cn.SolidBody.read(tmp_path / "part.inp", material=RUBBER, density=1.0)
    assert np.array_equal(body.cells[kind], cells[kind])


def test_an_element_that_is_no_solid_is_told(tmp_path):
    inp(tmp_path / "glue.inp", "quad", "COH2D4", (1, 1))
    with pytest.raises(ValueError, match=r"glue.inp has elements of type COH2D4.*give CPS, CPE or CAX") as told:
        cn.SolidBody.read(tmp_path / "glue.inp", material=RUBBER, density=1.0)
    assert "meshio" not in str(told.value) and "UnknownType" not in str(told.value)
    from meshio.abaqus import _abaqus

    assert type(_abaqus.abaqus_to_meshio_type) is dict


@pytest.mark.parametrize("names", [["temperature"], ["temperature", "weight"]])
def test_a_med_file_with_fields_of_nodes_is_read(names, tmp_path):
    pytest.importorskip("h5py")
    points, cells = box("quad", (2, 2), (1.0, 1.0))
    fields = {name: np.arange(len(points), dtype=float) for name in names}
    meshio.Mesh(points, cells, point_data=fields).write(tmp_path / "part.med")
    body = cn.SolidBody.read(tmp_path / "part.med", material=RUBBER, density=1.0)
    assert np.array_equal(body.points, points) and np.array_equal(body.cells["quad"], cells["quad"])


def test_meshes_of_gmsh_in_its_second_format_keep_their_names(tmp_path):
    points, cells = box("quad", (2, 2), (1.0, 1.0))
    data = {"gmsh:physical": [np.full(4, 7)], "gmsh:geometrical": [np.full(4, 1)]}
    mesh = meshio.Mesh(points, cells, cell_data=data, field_data={"plate": np.array([7, 2])})
    mesh.write(tmp_path / "part.msh", file_format="gmsh22")
    assert len(cn.SolidBody.read(tmp_path / "part.msh", material=RUBBER, density=1.0).groups["plate"]) == 9
