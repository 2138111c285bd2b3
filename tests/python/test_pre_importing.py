"""Files of blocks: written by the libraries of their formats, read back to the same bodies."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from cairn.pre import importing, masonry, mesh

REFERENCE = Path(os.environ.get("CAIRN_REFERENCE_DATA", Path(__file__).resolve().parents[3] / "shared"))


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
    assert all(len(f) == 6 for f in read.faces)  # triangles of one plane are one face again
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
