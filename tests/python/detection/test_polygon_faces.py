"""Faces of several corners: cut into triangles whatever their form and whichever corner comes first, or refused by name."""

import struct

import cairn as cn
import numpy as np
import pytest
from cairn.pre import convex_parts, importing, mesh, terrain
from cairn.pre.polygon_faces import triangulated

pytest.importorskip("shapely")

L = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], float)
CROWN = np.array([[0, 0], [3, 0], [3, 2], [2, 1], [1.5, 2], [1, 1], [0, 2]], float)
STAR = np.array([[r * np.cos(a), r * np.sin(a)] for r, a in zip([0.4, 1] * 5, np.arange(10) * np.pi / 5)])
NOTCHED = np.array([[0, 0], [1, 0], [2, 0], [2, 2], [1, 1], [0, 2], [0, 1]], float)  # with corners on straight edges
BOW = np.array([[0, 0], [2, 1], [2, 0], [0, 1]], float)
LOOP = np.array([[0, 0], [2, 0], [2, 2], [1, -1], [0, 2]], float)
PENTAGRAM = np.array([[np.cos(a), np.sin(a)] for a in np.arange(5) * 4 * np.pi / 5])


def prism(outline, start=0, height=0.5):
    """Corners and faces of a prism, its lids from one corner on."""
    n = len(outline)
    points = np.array([(*p, z) for z in (0, height) for p in outline], float)
    lid = [(start + k) % n for k in range(n)]
    return points, [lid[::-1], [k + n for k in lid], *([k, (k + 1) % n, (k + 1) % n + n, k + n] for k in range(n))]


def area(outline):
    x, y = np.asarray(outline).T
    return abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) / 2


def written(path, points, faces, order=None):
    """An OBJ, OFF or PLY file; order: "<" or ">" of a binary one."""
    rows = [" ".join(map(repr, map(float, p))) for p in points]
    if path.suffix == ".obj":
        path.write_text("\n".join([*(f"v {r}" for r in rows), *("f " + " ".join(str(k + 1) for k in f) for f in faces)]))
    elif path.suffix == ".off":
        counted = [f"{len(f)} " + " ".join(map(str, f)) + " 0.5 0.5 0.5" for f in faces]
        path.write_text("\n".join(["OFF", "# a comment", f"{len(points)} {len(faces)} 0", *rows, *counted]))
    else:
        kind = {None: "ascii", "<": "binary_little_endian", ">": "binary_big_endian"}[order]
        head = [f"ply\nformat {kind} 1.0\ncomment made\nelement vertex {len(points)}", *(f"property double {a}" for a in "xyz")]
        head += [f"element face {len(faces)}", "property uchar red", "property list uchar int vertex_indices", "end_header\n"]
        body = "\n".join([*rows, *(f"7 {len(f)} " + " ".join(map(str, f)) for f in faces)]).encode()
        if order:
            body = np.asarray(points, f"{order}f8").tobytes()
            body += b"".join(struct.pack(f"{order}BB{len(f)}i", 7, len(f), *f) for f in faces)
        path.write_bytes("\n".join(head).encode() + body)
    return path


@pytest.mark.filterwarnings("ignore::cairn.pre.importing.BlocksWarning")
@pytest.mark.parametrize("outline,parts", [(L, 2), (CROWN, 4), (NOTCHED, 2)])
@pytest.mark.parametrize("ending,order", [(".obj", None), (".off", None), (".ply", None), (".ply", "<"), (".ply", ">")])
def test_a_concave_face_is_covered_once(tmp_path, outline, parts, ending, order):
    for start in range(len(outline)):
        path = written(tmp_path / f"block{ending}", *prism(outline, start), order)
        found, _, report = importing.bodies(path)
        assert len(found) == 1 and len(found[0]) <= parts and report.closed == 1
        assert report.volume == pytest.approx(area(outline) / 2, rel=1e-12)
        with pytest.raises(mesh.MeshError, match="not convex.*cairn.pre.importing.bodies"):
            importing.read(path)
        assert importing.read(path, convex="hull")[1].hulls == [0]


def test_faces_of_other_formats(tmp_path):
    """COMPAS, polygons of VTK, and a surface that is given."""
    import json

    points, faces = prism(L, 1)
    content = {"vertex": {str(k): dict(zip("xyz", p)) for k, p in enumerate(points.tolist())},
               "face": {str(k): f for k, f in enumerate(faces)}}  # fmt: skip
    (tmp_path / "block.json").write_text(json.dumps(content))
    with pytest.warns(importing.BlocksWarning, match="2 convex parts"):
        assert importing.bodies(tmp_path / "block.json")[2].volume == pytest.approx(1.5, rel=1e-12)
    for start in range(6):
        points, faces = prism(L, start)
        report = mesh.check(points, faces)
        assert report.volume == pytest.approx(1.5) and not report.convex
        assert len(convex_parts(points, faces)) == 2
        assert len(mesh.repair(points, faces[1:])[1]) == len(mesh.triangles(points, faces))


@pytest.mark.parametrize("scale", [1.0, 2.0**-40, 2.0**40])
@pytest.mark.parametrize("outline", [L, CROWN, STAR, NOTCHED, L[::-1]])
def test_triangles_of_a_face(outline, scale):
    """Number by the corners of the face, with its orientation, for any size, place and plane."""
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    for start in range(len(outline)):
        loop = np.roll(np.arange(len(outline)), -start)
        points = scale * (np.column_stack([outline, np.zeros(len(outline))]) @ turn + 3.0)
        found = triangulated(points, [loop])
        assert len(found) == len(outline) - 2
        spans = np.cross(points[found[:, 1]] - points[found[:, 0]], points[found[:, 2]] - points[found[:, 0]])
        x, y = outline.T
        whole = turn[2] * np.linalg.det(turn) * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) * scale**2
        assert np.all(spans @ whole > 0) and np.allclose(spans.sum(axis=0), whole, rtol=1e-9, atol=1e-9 * scale**2)


def test_convex_faces_are_fans_as_ever():
    points, faces = prism([[0, 0], [2, 0], [3, 1], [1, 2], [-1, 1]])
    fans = [(f[0], f[k], f[k + 1]) for f in faces for k in range(1, len(f) - 1)]
    assert np.array_equal(triangulated(points, faces), fans)


def test_a_hole_that_an_edge_joins_to_the_rim():
    outer, inner = [[0, 0], [4, 0], [4, 4], [0, 4]], [[1, 1], [1, 3], [3, 3], [3, 1]]
    points = np.array([(*p, 0.0) for p in outer + inner])
    for start in range(10):
        found = triangulated(points, [np.roll([0, 1, 2, 3, 0, 4, 5, 6, 7, 4], start)])
        spans = np.cross(points[found[:, 1]] - points[found[:, 0]], points[found[:, 2]] - points[found[:, 0]])[:, 2]
        assert len(found) == 8 and np.all(spans > 0) and spans.sum() == pytest.approx(2 * 12)


def test_a_bent_face_of_four_corners_has_its_shorter_diagonal():
    """Whichever corner comes first, and on both of two blocks that share it."""
    points = np.array([[0, 0, 0], [2, 0, 0.1], [2.5, 1, 0], [0, 1, 0.1]])
    for loop in ([0, 1, 2, 3], [3, 2, 1, 0]):
        cuts = {frozenset(map(frozenset, triangulated(points, [np.roll(loop, k)]).tolist())) for k in range(4)}
        assert cuts == {frozenset({frozenset({0, 1, 3}), frozenset({1, 2, 3})})}


@pytest.mark.parametrize("outline", [BOW, LOOP, PENTAGRAM, BOW[:, ::-1] * [2, 1]])
def test_faces_that_cross_themselves_are_refused(tmp_path, outline):
    points, faces = prism(outline)
    for ending in (".obj", ".ply", ".off"):
        for options in ({}, {"repair": True}):
            with pytest.raises(mesh.MeshError, match=rf"b{ending}: face 0 \[.*\] at .* crosses or touches itself"):
                importing.bodies(written(tmp_path / f"b{ending}", points, faces), **options)
    with pytest.raises(mesh.MeshError, match="surface: face 1 .* crosses or touches itself"):
        cn.surface(points, [faces[2], faces[1]], cn.Material("rock"))


def test_faces_out_of_plane_are_refused(tmp_path):
    points, faces = prism(L, 3)
    points[8, 2] += 0.05
    path = written(tmp_path / "bent.obj", points, faces)
    with pytest.raises(mesh.MeshError, match=r"bent.obj: face 1 \[9.* is not plane: a corner stands 0.0\d+ out.*flat="):
        importing.bodies(path)
    assert importing.read(path, convex="hull")[1].blocks == 1  # of which the corners count alone
    with pytest.raises(mesh.MeshError, match="surface: face 1 .* is not plane"):
        cn.surface(points, faces, cn.Material("rock"))
    points[8, 2] = 0.5 + 1e-7  # what digits round
    with pytest.warns(importing.BlocksWarning, match="2 convex parts"):
        assert importing.bodies(written(path, points, faces))[2].volume == pytest.approx(1.5, rel=1e-6)


def test_the_remedy_for_surfaces_that_cross_is_taken(tmp_path):
    """A box whose corner was pulled through the side across: its hull, which the error advises, is read."""
    points, faces = prism([[0, 0], [2, 0], [2, 1], [0, 1]], height=1.0)
    faces = mesh.triangles(points, faces)
    points[0] = (2.2, 0.4, 0.6)
    path = written(tmp_path / "box.obj", points, faces)
    with pytest.raises(mesh.MeshError, match="crosses itself.*convex='hull'") as error:
        importing.read(path)
    assert error.value.fault == "crossing"
    assert importing.read(path, convex="hull")[1].hulls == [0]


def test_ground_with_a_concave_face(tmp_path):
    """A ball in the notch of an L falls through, beside it it lies on the L: from a file and from arrays."""
    stone = cn.Material("stone", density=1000.0)
    points = np.column_stack([L, np.zeros(6)])
    for start in range(6):
        loop = [(start + k) % 6 for k in range(6)]
        for ending in (".obj", ".ply", ".off"):
            vertices, fans = terrain.read_surface(written(tmp_path / f"ground{ending}", points, [loop]))
            spans = np.cross(vertices[fans[:, 1]] - vertices[fans[:, 0]], vertices[fans[:, 2]] - vertices[fans[:, 0]])
            assert len(fans) == 4 and np.all(spans[:, 2] > 0) and spans[:, 2].sum() == pytest.approx(6)
    for start in range(6):
        scene = cn.Scene(3, gravity=(0, 0, -9.81))
        ground = cn.surface(points, [[(start + k) % 6 for k in range(6)]], stone)
        scene.add(ground, cn.spheres([[0.5, 0.5, 0.1], [1.6, 1.6, 0.1]], 0.1, stone))
        scene.interact("*", "*", cn.Coulomb(mu=0.3))
        sim = cn.Simulation(scene, 1e-2)
        sim.run(steps=20, progress=False)
        held, fell = sim.bodies.position[-2:, 2]
        assert held == pytest.approx(0.1, abs=1e-6) and fell < -0.05


def test_without_shapely_the_error_says_what_is_needed(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "shapely", None)
    points, faces = prism(L, 1)
    told = r"l.obj: face 1 .* is not convex, and shapely \(2.1 or later\) is needed .*: pip install shapely"
    with pytest.raises(ImportError, match=told):
        importing.bodies(written(tmp_path / "l.obj", points, faces))
    with pytest.raises(ImportError, match="pip install shapely"):
        cn.surface(points, faces, cn.Material("rock"))


@pytest.mark.parametrize("ending,text,told", [
    (".ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nend_header\n0 0 0", "vertices have x: x, y and z"),
    (".ply", "ply\nformat ascii 1.0\nelement vertex two\n", "line 3|does not end"),
    (".ply", "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0",
     "2 of 'vertex' are not all there"),
    (".off", "OFF\n3 1 0\n0 0 0\n1 0 0\n", "ends before: 2 of 3 vertices, 0 of 1 faces"),
    (".off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1\n", "line 6, '3 0 1': 3 corners are due"),
    (".off", "4OFF\n3 1 0\n", "points of 4OFF have no three coordinates"),
    (".off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n", r"face 0 is \[0, 1, 7\]: vertices go from 0 to 2"),
    (".off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n2 0 1\n", r"face 0 is \[0, 1\]: a face has at least three corners"),
])  # fmt: skip
def test_damaged_files_are_told_by_their_place(tmp_path, ending, text, told):
    path = tmp_path / f"odd{ending}"
    path.write_text(text)
    with pytest.raises(ValueError, match=told) as error:
        importing.bodies(path)
    assert f"odd{ending}" in str(error.value)
