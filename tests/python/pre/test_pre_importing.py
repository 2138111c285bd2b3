"""Files of blocks: written by the libraries of their formats, read back to the same bodies."""

import json
import os
from pathlib import Path

import cairn as cn
import numpy as np
import pytest
from cairn.pre import importing, masonry, mesh

REFERENCE = Path(os.environ.get("CAIRN_REFERENCE_DATA", Path(__file__).resolve().parents[4] / "shared"))


def wall():
    return masonry.wall(0.88, 3, (0.22, 0.11, 0.055))


def triangulated(b, shift=0.0):
    """All blocks as one mesh, a gap between them so that none share a vertex."""
    points, faces, count = [], [], 0
    for k, (v, f) in enumerate(zip(b.vertices, b.faces)):
        fans = [(q[0], q[m], q[m + 1]) for q in f for m in range(1, len(q) - 1)]
        points.append(v + shift * k)
        faces.append(np.array(fans) + count)
        count += len(v)
    return np.concatenate(points), np.concatenate(faces)


def obj_of(path, b, faces=None, name="o stone_{}", unit=1.0):
    """Blocks as objects of an OBJ file; faces: of each block, where they are not its own."""
    lines, count = [], 1
    for k, (v, f) in enumerate(zip(b.vertices, faces or b.faces)):
        lines += [name.format(k), *(f"v {x!r} {y!r} {z!r}" for x, y, z in (v / unit).tolist())]
        lines += ["f " + " ".join(f"{i + count}//1" for i in face) for face in f]
        count += len(v)
    path.write_text("\n".join(lines))
    return path


def test_names_of_obj_objects(tmp_path):
    """Objects, groups where there are none, and relative numbers; blocks that share corners; faults are reported by name."""
    b = wall()
    for word in ("o", "g"):
        read, report = importing.read(obj_of(tmp_path / "wall.obj", b, name=word + " stone_{}"))
        assert report.names == tuple(f"stone_{k}" for k in range(len(b))) and set(read.part) == {"stone"}
        assert report.joints == len(b.joints().area) and report.volume == pytest.approx(b.properties().measure.sum())
    path = tmp_path / "one.obj"
    corners = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    lines = [*(f"v {x} {y} {z}" for x, y, z in corners), *("f " + " ".join(str(i - 8) for i in s) for s in sides)]
    path.write_text("\n".join(["o support.001", *lines]))
    read, report = importing.read(path)
    assert report.names == ("support.001",) and read.part == ["support"] and report.volume == pytest.approx(1)
    path.write_text("\n".join([*lines[:8], *(f"g side {k}\n{line}" for k, line in enumerate(lines[8:]))]))
    assert importing.read(path)[1].names == ("",)  # groups that bound nothing alone
    path.write_text("\n".join(lines[:8] + ["f 1 2 9"]))
    with pytest.raises(ValueError, match="one.obj, line 9, 'f 1 2 9': there is no vertex 9 yet"):
        importing.read(path)


def test_each_bad_block_is_told_with_its_place(tmp_path, capsys):
    from cairn import cli

    b = wall()
    faces = [list(f) for f in b.faces]
    faces[3], faces[9] = faces[3][1:], [faces[9][0][::-1], *faces[9][1:]]
    path = obj_of(tmp_path / "wall.obj", b, faces)
    with pytest.raises(mesh.MeshError) as error:
        importing.read(path)
    text = str(error.value)
    assert text.startswith(f"{path}: 2 of 14 blocks are refused") and error.value.items.tolist() == [3, 9]
    for k, fault in ((3, "is open"), (9, "is run along twice")):
        (line,) = (line for line in text.splitlines() if f"block {k} (stone_{k})" in line)
        assert fault in line
        place = np.array(eval(line.split(", (")[1].join("(,").split(" to ")[0].strip(",")))
        assert np.min(np.linalg.norm(b.vertices[k] - place, axis=1)) < 1e-5  # a corner of the block
    assert cli.main(["import", str(path)]) == 1 and "--repair" in capsys.readouterr().err
    _, report = importing.read(path, repair=True)
    assert set(report.repaired) == {3, 9} and report.volume == pytest.approx(b.properties().measure.sum())


def test_faults_in_blocks_that_touch_are_repaired(tmp_path):
    """In a heap of triangles, faces missing and turned in several blocks: each is mended, and none sticks to its neighbours."""
    trimesh = pytest.importorskip("trimesh")
    b = wall()
    points, faces = triangulated(b)
    for missing, turned in (([], [30]), ([40], []), ([40, 100], [30, 31, 90, 5]), ([26, 27], [24, 25, 30])):
        some = faces.copy()
        some[turned] = some[turned][:, ::-1]
        trimesh.Trimesh(points, np.delete(some, missing, axis=0), process=False).export(tmp_path / "wall.stl")
        _, report = importing.read(tmp_path / "wall.stl", repair=True)
        assert report.blocks == len(b) and set(report.repaired) == {k // 12 for k in missing + turned}
        assert report.volume == pytest.approx(b.properties().measure.sum(), rel=1e-5) and len(report.overlaps) == 0


def test_units_that_are_not_metres_are_hinted_at(tmp_path, capsys):
    import warnings

    from cairn import cli

    path = obj_of(tmp_path / "mm.obj", wall(), unit=1e-3)
    with pytest.warns(importing.BlocksWarning, match="220 m long.*millimetre.*scale=1e-3"):
        _, report = importing.read(path)
    assert "look: blocks of mm.obj" in str(report)
    assert cli.main(["import", str(path)]) == 0 and "--scale 1e-3" in capsys.readouterr().out
    with pytest.warns(importing.BlocksWarning, match="unit is the metre, give scale=1"):
        importing.read(obj_of(tmp_path / "m.obj", wall()), scale=1e-3)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert importing.read(path, scale=1e-3)[1].hints == ()
    small = obj_of(tmp_path / "small.obj", wall(), unit=10.0)  # drawn in tens of metres: 22 mm, then 2.2 mm
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        report = importing.read(small)[1]
    assert "unit not told by the file, taken as the metre" in str(report) and len(report.extent) == 3
    with pytest.warns(importing.BlocksWarning, match="0.0022 m long .* at scale=0.1: if its unit is the metre, give scale=1"):
        importing.read(small, scale=0.1)
    with pytest.warns(importing.BlocksWarning, match="0.0022 m long .* at scale=1: give scale=, the metres in a unit"):
        importing.read(obj_of(tmp_path / "tiny.obj", wall(), unit=100.0))


def test_an_arch_in_one_piece_is_told_to_be_one_body(tmp_path):
    b = masonry.arch(span=4, thickness=0.5, voussoirs=9, depth=1.0)
    points = np.concatenate(b.vertices)
    _, number = np.unique(np.round(points, 9), axis=0, return_inverse=True)
    first = np.cumsum([0, *(len(v) for v in b.vertices)])
    loops = [[int(number.ravel()[first[k] + i]) for i in f] for k, faces in enumerate(b.faces) for f in faces]
    outer = [f for f in loops if [sorted(g) for g in loops].count(sorted(f)) == 1]  # not those between voussoirs
    corners = points[np.unique(number.ravel(), return_index=True)[1]]
    path = tmp_path / "arch.obj"
    path.write_text("\n".join([*(f"v {x!r} {y!r} {z!r}" for x, y, z in corners.tolist()),
                               *("f " + " ".join(str(i + 1) for i in f) for f in outer)]))
    with pytest.warns(importing.BlocksWarning, match=r"ONE rigid body: block \d+ of \d+ convex parts that never come apart"):
        found, _, report = importing.bodies(path)
    assert max(map(len, found)) >= 9 and f"look: 1 of {len(found)} blocks" in str(report)


@pytest.mark.parametrize("ending", [".stl", ".ply"])
def test_trimesh_formats(tmp_path, ending):
    trimesh = pytest.importorskip("trimesh")
    b = wall()
    points, faces = triangulated(b, 1.0)
    path = tmp_path / f"wall{ending}"
    trimesh.Trimesh(points, faces, process=False).export(path)
    read, report = importing.read(path)
    assert len(read) == report.blocks == report.closed == len(b)
    assert report.volume == pytest.approx(b.properties().measure.sum(), rel=1e-5)
    assert all(len(f) == 6 for f in read.faces)  # coplanar triangles are merged into a face
    assert "blocks" in str(report)


def test_obj_keeps_blocks_apart_that_touch(tmp_path):
    pytest.importorskip("trimesh")
    b = wall()
    lines, count = [], 1
    for k, (v, f) in enumerate(zip(b.vertices, b.faces)):
        lines += [f"o stone_{k}"] + [f"v {x!r} {y!r} {z!r}" for x, y, z in v.tolist()]
        lines += ["f " + " ".join(str(i + count) for i in face) for face in f]
        count += len(v)
    path = tmp_path / "wall.obj"
    path.write_text("\n".join(lines))
    read, report = importing.read(path)
    assert report.blocks == len(b) and report.joints == len(b.joints().area)
    assert len(report.overlaps) == 0
    assert report.smallest_edge == pytest.approx(0.055)


@pytest.mark.parametrize("ending", [".vtk", ".vtu", ".msh"])
def test_volume_elements_give_their_skin(tmp_path, ending):
    meshio = pytest.importorskip("meshio")
    x = np.array([[i, j, k] for k in (0, 1) for j in (0, 1) for i in (0, 1, 2)], float)
    two = np.array([[0, 1, 4, 3, 6, 7, 10, 9], [1, 2, 5, 4, 7, 8, 11, 10]])
    path = tmp_path / f"brick{ending}"
    options = {"file_format": "gmsh22", "binary": False} if ending == ".msh" else {}
    meshio.Mesh(x, [("hexahedron", two)]).write(path, **options)
    read, report = importing.read(path)
    assert report.blocks == 1 and report.volume == pytest.approx(2)
    assert len(read.faces[0]) == 6


def test_compas(tmp_path):
    b = masonry.arch(radius=1.0, thickness=0.2, voussoirs=5, depth=0.5)
    nodes = {}
    for k, (v, f) in enumerate(zip(b.vertices, b.faces)):
        vertex = {str(i + 7): dict(zip("xyz", row)) for i, row in enumerate(v.tolist())}
        face = {str(i): [j + 7 for j in loop] for i, loop in enumerate(f)}
        block = {"dtype": "compas_assembly.datastructures/Block", "data": {"vertex": vertex, "face": face}}
        nodes[str(k)] = {"block": block, "is_support": b.part[k] == "support"}
    path = tmp_path / "arch.json"
    path.write_text(json.dumps({"dtype": "Assembly", "data": {"graph": {"node": nodes, "edge": {}}}}))
    read, report = importing.read(path)
    assert report.blocks == 7 and report.joints == 6 and read.part.count("support") == 2
    for v, w in zip(read.vertices, b.vertices):
        assert np.array_equal(v, w)
    path.write_text("{")
    with pytest.raises(ValueError, match="is no JSON: line 1"):
        importing.read(path)


def test_lmgc90_block_lists():
    folder = REFERENCE / "legacy"
    if not folder.is_dir():
        pytest.skip("no reference data: set CAIRN_REFERENCE_DATA")
    bricks, report = importing.read(folder / "bricks3d_wall" / "DATBOX" / "BODIES.DAT")
    assert len(bricks) == 35 and report.closed == 35
    assert bricks.properties().measure[0] == pytest.approx(0.4 * 0.2 * 0.2, rel=1e-6)
    assert report.joints > 50
    polygons, report = importing.read(folder / "polygons2d_pile" / "DATBOX" / "BODIES.DAT")
    assert polygons.dim == 2 and len(polygons) == 40
    # LMGC90's own mass and inertia: pi avrd^2 and gyrd^2
    p = polygons.properties()
    assert p.measure[0] == pytest.approx(np.pi * 3.5292127e-02**2, rel=1e-6)
    assert p.moments[0, 0] / p.measure[0] == pytest.approx(2.5066905e-02**2, rel=1e-6)
    np.testing.assert_allclose(p.center[0], (5.25e-2, 6.25e-2), rtol=1e-5)


def test_refusals_and_repairs(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    box = trimesh.creation.box()
    path = tmp_path / "open.ply"
    trimesh.Trimesh(box.vertices, box.faces[1:], process=False).export(path)
    with pytest.raises(mesh.MeshError, match=r"open.ply, block 0 is open.*repair=True"):
        importing.read(path)
    _, report = importing.read(path, repair=True)
    assert report.closed == 0 and list(report.repaired) == [0] and report.volume == pytest.approx(1)
    path = tmp_path / "hollow.ply"
    trimesh.creation.annulus(0.5, 1.0, 1.0).export(path)
    with pytest.raises(mesh.MeshError, match="not convex"):
        importing.read(path)
    _, report = importing.read(path, convex="hull")
    assert report.hulls == [0]
    with pytest.raises(ValueError, match="ends in '.xyz'"):
        importing.read(tmp_path / "a.xyz")


def test_overlaps_are_reported():
    b = wall()
    b.vertices[4] = b.vertices[4] - (0, 0, 0.01)
    report = importing.report_of(b)
    assert len(report.overlaps) and report.overlap_depth.max() == pytest.approx(0.01)
    assert "the deepest 0.01 m" in str(report)


@pytest.mark.parametrize("ending", [".stl", ".obj"])
@pytest.mark.parametrize("shift", [0.0, 300.0])
def test_blocks_that_touch_survive_rounding(tmp_path, ending, shift):
    """Seven digits of each corner: the blocks come apart, faces are plane, joints are found, and the arch stands."""
    trimesh = pytest.importorskip("trimesh")
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    b = masonry.arch(span=4, thickness=0.5, voussoirs=9, depth=1.0).moved((shift, shift / 2, 3), turn)
    points, faces = triangulated(b)
    path = tmp_path / f"arch{ending}"
    trimesh.Trimesh(points, faces, process=False).export(path)
    read, report = importing.read(path)
    assert len(read) == 11 and report.joints == 10 and len(report.overlaps) == 0
    assert len(read.joints().area) == 10  # for limit analysis, loads and openings, too
    assert all(len(f) == 6 for f in read.faces)
    assert report.volume == pytest.approx(b.properties().measure.sum(), rel=1e-4)
    assert 0 < report.flattened < 1e-7 * (shift + 4) and "so that faces are plane" in str(report)
    out = [np.ptp(v[f] @ np.linalg.svd(v[f] - v[f].mean(axis=0))[2][2]) for v, fs in zip(read.vertices, read.faces) for f in fs]
    assert max(out) < 1e-12 * (shift + 4)
    for k in np.argsort([v[:, 2].mean() for v in read.vertices])[:2]:
        read.part[k] = "support"
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    read.add_to(scene, cn.Material("stone", density=2400.0))
    scene.interact("*", "*", cn.Coulomb(mu=0.6))
    sim = cn.Simulation(scene, dt=2e-3)
    sim.run(steps=5, progress=False)
    assert len(sim.contacts.gap) == 40 and np.abs(sim.bodies.velocity).max() < 2e-3


def test_coordinates_of_a_map(tmp_path):
    """5000 km from zero: read with all digits; refused with seven, of which half a metre is left."""
    trimesh = pytest.importorskip("trimesh")
    b = masonry.arch(span=4, thickness=0.5, voussoirs=9, depth=1.0).moved((5e5, 5e6, 100))
    points, faces = triangulated(b)
    path = tmp_path / "arch.obj"
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in points.tolist()]
    path.write_text("\n".join(lines + ["f " + " ".join(str(i + 1) for i in f) for f in faces.tolist()]))
    read, report = importing.read(path)
    assert len(read) == 11 and report.joints == 10 and all(len(f) == 6 for f in read.faces)
    assert report.flattened < 1e-8 and report.volume == pytest.approx(b.properties().measure.sum(), rel=1e-7)
    trimesh.Trimesh(points, faces, process=False).export(path.with_suffix(".stl"))
    with pytest.raises(ValueError, match="arch.stl.*(seven digits|no area|closed|open|twice)"):
        importing.read(path.with_suffix(".stl"))


def test_physical_volumes_are_blocks(tmp_path):
    """Two cubes that share the corners of a face, as gmsh meshes them: one block a volume, named after it."""
    meshio = pytest.importorskip("meshio")
    points = np.array([(x, y, z) for z in (0, 1, 2) for y in (0, 1) for x in (0, 1)], float)
    low = [0, 1, 3, 2, 4, 5, 7, 6]
    cells = [("hexahedron", np.array([low, [k + 4 for k in low]]))]
    data = {"gmsh:physical": [np.array([1, 2])], "gmsh:geometrical": [np.array([1, 2])]}
    path = tmp_path / "two.msh"
    names = {"support": np.array([1, 3]), "stone": np.array([2, 3])}
    meshio.write(path, meshio.Mesh(points, cells, cell_data=data, field_data=names), file_format="gmsh22", binary=False)
    read, report = importing.read(path)
    assert read.part == ["support", "stone"] and report.joints == 1 and report.volume == 2


def test_what_is_not_convex_is_a_body_of_parts(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    path = tmp_path / "L.stl"
    corners = np.array([(x, y, z) for y in (0, 1) for x, z in ((0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2))], float)
    side = [(0, 1, 3), (1, 2, 3), (0, 3, 5), (3, 4, 5)]
    faces = [*side, *([k + 6 for k in t[::-1]] for t in side)]
    faces += [t for k in range(6) for t in ((k, 6 + k, (k + 1) % 6), ((k + 1) % 6, 6 + k, 6 + (k + 1) % 6))]
    trimesh.Trimesh(corners / 3, faces, process=False).export(path)
    with pytest.raises(mesh.MeshError, match="not convex.*importing.bodies"):
        importing.read(path)
    with pytest.warns(importing.BlocksWarning, match="block 0 of 2 convex parts"):
        found, parts, report = importing.bodies(path)
    assert [len(b) for b in found] == [2] and parts == ["block"] and report.parts == 2 and report.blocks == 1
    assert report.joints == 0  # between the parts of one body there is none
    body = cn.polyhedra(found, cn.Material("stone", density=1000.0))
    assert body.mass[0] == pytest.approx(3000 / 27, rel=1e-6)


@pytest.mark.parametrize("ending", [".vtk", ".vtu", ".msh", ".ply", ".stl", ".obj", ".json", ".dat"])
def test_files_of_something_else_are_refused_by_name(tmp_path, ending, capfd):
    """No library may end the program, nor an error come without the file's name."""
    path = tmp_path / f"odd{ending}"
    path.write_text("what is this?\n")
    with pytest.raises(ValueError, match=f"odd{ending}"):
        importing.read(path)
    with pytest.raises(ValueError, match="scale is 0"):
        importing.read(path, scale=0)
    assert capfd.readouterr().out == ""


def test_numbers_that_are_none(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    path = tmp_path / "nan.ply"
    box = trimesh.creation.box()
    points = box.vertices.copy()
    points[3, 1] = np.nan
    trimesh.Trimesh(points, box.faces, process=False).export(path)
    with pytest.raises(mesh.MeshError, match=r"nan.ply: vertex 3 is .*nan"):
        importing.read(path)
