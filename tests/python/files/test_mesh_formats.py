"""Contents of mesh files beyond cells: fields of MED, elements of Abaqus by all of their names."""

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


@pytest.mark.parametrize("written", [True, False])
@pytest.mark.parametrize("kind", ["tetra", "tetra10", "hexahedron", "hexahedron20"])
def test_solid_cells_of_med_stand_the_right_way_round(kind, written, tmp_path):
    """Orientation as in MED, reversed, and as meshio writes Cairn's cells."""
    pytest.importorskip("h5py")
    from cairn.pre.med_cells import turned

    points, cells = box(kind, (2, 1, 1), (2.0, 1.0, 1.0))
    of_file = cells[kind] if written else cells[kind][:, np.argsort(turned(kind))]
    meshio.Mesh(points, {kind: of_file}).write(tmp_path / "part.med")
    body = cn.SolidBody.read(tmp_path / "part.med", material=RUBBER, density=1.0)
    assert np.array_equal(body.cells[kind], cells[kind]) and body.nodal_mass().sum() == pytest.approx(2.0)


@pytest.mark.parametrize(("dim", "order", "quads"), [(2, 1, 0), (2, 2, 0), (2, 2, 1), (3, 1, 0), (3, 2, 0)])
@pytest.mark.parametrize("ending", [".inp", ".med"])
def test_what_gmsh_writes_is_what_gmsh_has(dim, order, quads, ending, tmp_path):
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.5)
        gmsh.option.setNumber("Mesh.ElementOrder", order)
        gmsh.option.setNumber("Mesh.RecombineAll", quads)
        gmsh.model.add("part")
        part = gmsh.model.occ.addRectangle(0, 0, 0, 1, 1) if dim == 2 else gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(dim, [part], name="bulk")
        gmsh.model.mesh.generate(dim)
        gmsh.write(str(tmp_path / f"part{ending}"))
        body = cn.SolidBody.read(gmsh, material=RUBBER, density=1.0)
    finally:
        gmsh.finalize()
    other = cn.SolidBody.read(tmp_path / f"part{ending}", material=RUBBER, density=1.0)
    assert {kind: len(cells) for kind, cells in other.cells.items()} == {kind: len(cells) for kind, cells in body.cells.items()}
    assert other.nodal_mass().sum() == pytest.approx(1.0, rel=1e-9)
    stretch = np.eye(dim) + 0.1 * np.arange(dim * dim).reshape(dim, dim) / dim
    for part in (body, other):
        for found in part.stress(part.points @ (stretch - np.eye(dim)).T).values():
            assert np.ptp(found, axis=0).max() < 1e-9 * np.abs(found).max()


def test_sets_that_blocks_of_nodes_name_are_groups(tmp_path):
    """*NODE, NSET=...: the nodes of the block, with those that *NSET adds; several blocks hold the nodes of one mesh."""
    (tmp_path / "part.inp").write_text(
        "*HEADING\nof two blocks\n** a comment, NSET=NONE\n*Node, nset=FOOT\n 5, 0., 0., 0.\n15, 1., 0., 0.\n"
        "*NODE, SYSTEM=R, NSET=HEAD\n25, 1., 1., 0.\n35, 0., 1., 0.\n*NODE\n45, 2., 0., 0.\n55, 2., 1., 0.\n"
        "*ELEMENT, TYPE=CPE4\n1, 5, 15, 25, 35\n2, 15, 45, 55, 25\n*NSET, NSET=HEAD\n55\n*NODE PRINT, NSET=PRINTED\nU\n"
    )
    body = cn.SolidBody.read(tmp_path / "part.inp", material=RUBBER, density=1.0)
    assert np.array_equal(body.points, [[0, 0], [1, 0], [1, 1], [0, 1], [2, 0], [2, 1]])
    assert np.array_equal(body.cells["quad"], [[0, 1, 2, 3], [1, 4, 5, 2]])
    assert {name: list(nodes) for name, nodes in body.groups.items()} == {"FOOT": [0, 1], "HEAD": [2, 3, 5]}


def test_a_function_in_place_of_tractions_is_told_where_functions_go():
    points, cells = box("quad", (2, 1), (1.0, 1.0))
    body = cn.SolidBody(points, cells, RUBBER, density=1.0, groups={"top": np.flatnonzero(points[:, 1] > 0.9)})
    skin = cn.Material("skin", density=1.0)
    with pytest.raises(ValueError, match=r"give {group: \(2,\)} \[Pa\], a function of time in the place of \(2,\)"):
        cn.deformable(body, skin, traction=lambda t: {"top": (0.0, t)})
    cn.deformable(body, skin, traction={"top": lambda t: (0.0, t)})
