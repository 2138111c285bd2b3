"""Solids of CAD and of building models, in metres; what the exact cut gives up; surfaces that run through each other."""

import signal
from pathlib import Path

import cairn as cn
import numpy as np
import pytest
from cairn.pre import cad_files, decompose, importing, mass_properties, mesh
from optional import reader_of_step

BOX = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
SIDES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


@pytest.fixture
def step(tmp_path):
    """Two boxes that touch and a cylinder, drawn in millimetres."""
    gmsh = reader_of_step()
    path = tmp_path / "a.step"
    gmsh.initialize([], readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.occ.addBox(0, 0, 0, 200, 100, 100)
    gmsh.model.occ.addBox(200, 0, 0, 200, 100, 100)
    gmsh.model.occ.addCylinder(100, 50, 100, 0, 0, 100, 50)
    gmsh.model.occ.synchronize()
    gmsh.write(str(path))
    gmsh.finalize()
    return path


def test_step_comes_in_metres(step):
    with pytest.raises(mesh.MeshError, match="block 2 .* is not convex; take its hull: convex='hull'"):
        importing.read(step)
    blocks, report = importing.read(step, convex="hull")
    assert report.blocks == 3 and len(report.overlaps) == 0 and not report.hints
    volume = blocks.properties().measure
    assert volume[:2] == pytest.approx([0.002, 0.002], rel=1e-12)
    assert volume[2] == pytest.approx(np.pi * 0.05**2 * 0.1, rel=0.02) and volume[2] < np.pi * 0.05**2 * 0.1
    assert len(blocks.vertices[0]) == 8  # the corners of the drawing and no other
    assert np.ptp(blocks.vertices[0], axis=0) == pytest.approx([0.2, 0.1, 0.1])
    blocks, report = importing.read(step, convex="hull", scale=10.0)
    assert blocks.properties().measure[0] == pytest.approx(2.0)


def test_the_unit_of_step_and_the_extent_are_told(step, capsys):
    from cairn import cli

    blocks, report = importing.read(step, convex="hull")
    assert report.unit == "millimetre" and report.extent == pytest.approx((0.4, 0.1, 0.2)) and report.scale == 1.0
    assert "extent 0.4 x 0.1 x 0.2 m; unit millimetre, by the file" in str(report)
    words = "are 0.0002 m long .* at scale=0.001: the file tells its unit, millimetre, and comes in metres: leave scale out"
    with pytest.warns(importing.BlocksWarning, match=words):  # taken for millimetres twice
        _, small = importing.read(step, convex="hull", scale=1e-3)
    assert "unit millimetre, by the file x 0.001" in str(small) and small.extent == pytest.approx((4e-4, 1e-4, 2e-4))
    assert cli.main(["import", str(step), "--hull", "--scale", "1e-3"]) == 0
    out = capsys.readouterr().out
    assert "extent 0.0004 x 0.0001 x 0.0002 m" in out and "look: blocks of a.step are 0.0002 m long" in out
    metres = step.with_name("b.step")  # drawn in metres, and written as millimetres
    metres.write_text(step.read_text().replace("200.", "2.").replace("100.", "1.").replace("50.", ".5"))
    with pytest.warns(importing.BlocksWarning, match="if they were drawn in another, give scale="):
        importing.read(metres, convex="hull")


def test_units_of_step_files():
    head = "#9=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#{},#2,#3))REPRESENTATION_CONTEXT('',''));\n"
    units = (
        "#1=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));\n#2=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));\n"
        "#3=(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT());\n"
        "#4 = ( LENGTH_UNIT ( ) NAMED_UNIT ( * )\n SI_UNIT ( $ , .METRE. ) );\n"
        "#5=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#1);\n"
        "#6=(CONVERSION_BASED_UNIT('INCH',#5)LENGTH_UNIT()NAMED_UNIT(#7));\n"
    )
    found = [cad_files.unit_of_step(units + head.format(k)) for k in (1, 4, 6)]
    assert found == ["millimetre", "metre", "inch"] and cad_files.unit_of_step("DATA; #1=CARTESIAN_POINT('',(0.,0.,0.));") == ""
    assert cad_files.unit_of_step(units + head.format(1) + head.format(6).replace("#9", "#8")) == "millimetre and inch"


def test_a_file_that_is_no_step(tmp_path):
    reader_of_step()
    (tmp_path / "a.stp").write_text("hello")
    with pytest.raises(importing.BlocksFileError, match="a.stp"):
        importing.read(tmp_path / "a.stp")
    with pytest.raises(importing.BlocksFileError, match="a.stp"):
        importing.read(tmp_path / "a.stp")


def test_ifc_comes_in_metres(tmp_path):
    """A wall with an opening, and a footing, drawn in millimetres."""
    ifcopenshell = pytest.importorskip("ifcopenshell")
    api = pytest.importorskip("ifcopenshell.api")
    model = ifcopenshell.file(schema="IFC4")
    run = lambda what, **options: api.run(what, model, **options)
    run("root.create_entity", ifc_class="IfcProject", name="p")
    run("unit.assign_unit")  # millimetres
    context = run("context.add_context", context_type="Model")
    body = run("context.add_context", context_type="Model", context_identifier="Body", target_view="MODEL_VIEW", parent=context)
    for kind, name, size, place in (
        ("IfcWall", "wall", (4.0, 0.3, 2.0), 0.5),
        ("IfcFooting", "support", (5.0, 1.0, 0.5), 0.0),
        ("IfcSpace", "room", (1.0, 1.0, 1.0), 0.0),
    ):
        element = run("root.create_entity", ifc_class=kind, name=name)
        run("geometry.assign_representation", product=element, representation=run(
            "geometry.add_wall_representation", context=body, length=size[0], height=size[2], thickness=size[1]))  # fmt: skip
        matrix = np.eye(4)
        matrix[2, 3] = place
        run("geometry.edit_object_placement", product=element, matrix=matrix)
    model.write(str(tmp_path / "house.ifc"))
    blocks, report = importing.read(tmp_path / "house.ifc")
    assert set(report.names) == {"wall", "support"} and set(blocks.part) == {"wall", "support"}
    sizes = {name: np.ptp(v, axis=0) for name, v in zip(report.names, blocks.vertices)}
    assert sizes["wall"] == pytest.approx([4.0, 0.3, 2.0]) and sizes["support"] == pytest.approx([5.0, 1.0, 0.5])
    assert report.joints == 1 and not report.hints  # the wall stands on its footing
    assert report.unit == "millimetre" and report.extent == pytest.approx((5.0, 1.0, 2.5))
    (tmp_path / "b.ifc").write_text("hello")
    with pytest.raises(importing.BlocksFileError, match="b.ifc"):
        importing.read(tmp_path / "b.ifc")


@pytest.mark.parametrize("name, ending", [("gmsh", "step"), ("ifcopenshell", "ifc")])
def test_a_library_that_is_not_there_is_named(tmp_path, monkeypatch, name, ending):
    monkeypatch.setitem(__import__("sys").modules, name, None)
    (tmp_path / f"a.{ending}").write_text("x")
    with pytest.raises(ImportError, match=f"{name} is needed to read {ending.upper()} files: pip install {name}"):
        importing.read(tmp_path / f"a.{ending}")


def test_a_library_of_the_system_that_is_not_there_is_named(tmp_path, monkeypatch):
    (tmp_path / "gmsh.py").write_text("raise OSError('libGLU.so.1: cannot open shared object file')")
    monkeypatch.delitem(__import__("sys").modules, "gmsh", raising=False)
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "a.step").write_text("x")
    with pytest.raises(ImportError, match="gmsh is needed to read STEP files, and cannot be loaded .libGLU.so.1.*: install"):
        importing.read(tmp_path / "a.step")
    monkeypatch.delitem(__import__("sys").modules, "gmsh", raising=False)


def ring(turns=40, around=24):
    """A torus, whose hollow no exact cut can follow."""
    a, b = (2 * np.pi * np.arange(n) / n for n in (turns, around))
    r = 1.0 + 0.3 * np.cos(b)
    x, y, z = np.outer(np.cos(a), r), np.outer(np.sin(a), r), np.tile(0.3 * np.sin(b), (turns, 1))
    points = np.stack([x, y, z], axis=2).reshape(-1, 3)
    i, j = (k.ravel() for k in np.meshgrid(np.arange(turns), np.arange(around), indexing="ij"))
    p, q = i * around + j, ((i + 1) % turns) * around + j
    s, t = ((i + 1) % turns) * around + (j + 1) % around, i * around + (j + 1) % around
    return points, np.concatenate([np.stack([p, q, s], axis=1), np.stack([p, s, t], axis=1)])


def test_what_the_exact_cut_gives_up_is_cut_nearly():
    pytest.importorskip("coacd")
    vertices, faces = ring()
    with pytest.raises(ValueError, match="more than 256 cells .*: take its hull, or nearly .*, near=0.05"):
        cn.pre.convex_parts(vertices, faces)
    parts = cn.pre.convex_parts(vertices, faces, near=0.05)
    assert 5 < len(parts) < 100
    own = mass_properties.polyhedra([vertices], [faces]).measure[0]
    for v, f in parts:
        assert mesh.check(v, f).convex
    assert mass_properties.polyhedra(*zip(*parts)).measure.sum() == pytest.approx(own, rel=0.15)
    rock = cn.Material("rock", density=2000.0)
    assert cn.polyhedra([parts], rock).mass == pytest.approx(2000 * own, rel=0.15)
    # bodies that can be cut exactly need no library
    assert len(decompose.convex_parts(BOX, SIDES, near=0.05)) == 1
    with pytest.raises(ValueError, match="near is 2.0: give a share of the size from 0.01 to 1"):
        cn.pre.convex_parts(vertices, faces, near=2.0)


def test_a_cut_that_does_not_close_is_told_and_cut_nearly(monkeypatch):
    def no_closed_loop(*given):
        raise KeyError(3)

    monkeypatch.setattr(decompose, "cut", no_closed_loop)
    vertices, faces = ring(6, 4)
    with pytest.raises(ValueError, match="a cut does not close, by rounding .*: take its hull, or nearly .*, near=0.05"):
        cn.pre.convex_parts(vertices, faces)
    pytest.importorskip("coacd")
    assert len(cn.pre.convex_parts(vertices, faces, near=0.05)) > 1


def test_near_parts_need_their_library(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "coacd", None)
    with pytest.raises(ImportError, match="coacd is needed to cut a body into nearly convex parts: pip install coacd"):
        cn.pre.convex_parts(*ring(), near=0.05)


def test_surfaces_that_run_through_each_other_become_one():
    pytest.importorskip("manifold3d")
    both = np.concatenate([BOX, 0.5 * BOX + [0.75, 0.25, 0.25]])
    faces = SIDES + [[8 + i for i in f] for f in SIDES]
    with pytest.raises(mesh.MeshError, match="crosses itself"):
        mesh.check(both, faces)
    vertices, triangles, done = mesh.repair(both, faces)
    assert mass_properties.polyhedra([vertices], [triangles]).measure[0] == pytest.approx(1.0 + 0.5 * 0.5 * 0.25, rel=1e-6)
    assert any("joined 2 surfaces that run through each other" in text for text in done)


def test_joining_needs_its_library(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "manifold3d", None)
    both = np.concatenate([BOX, 0.5 * BOX + [0.75, 0.25, 0.25]])
    with pytest.raises(mesh.MeshError, match="crosses itself.*pip install manifold3d"):
        mesh.repair(both, SIDES + [[8 + i for i in f] for f in SIDES])


def test_a_broken_pipe_stays_an_error(tmp_path):
    """Reading a STEP file leaves the signal of broken pipes as Python has it: ignored."""
    reader_of_step()
    status = Path("/proc/self/status")
    if not status.exists():
        pytest.skip("signals are read from /proc")
    path = tmp_path / "none.step"
    path.write_text("no such drawing")
    with pytest.raises(ValueError):
        importing.read(path)
    ignored = int(next(line.split()[1] for line in status.read_text().splitlines() if line.startswith("SigIgn")), 16)
    assert ignored & 1 << (signal.SIGPIPE - 1)
