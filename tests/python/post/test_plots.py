"""Pictures are made and show the right data: numbers are read from the collections, not from pixels."""

import cairn as cn
import numpy as np
import pytest
from cairn.post import FileError, RunWriter, load
from cairn.post.convert import convert
from made_up import info

matplotlib = pytest.importorskip("matplotlib")
matplotlib.use("Agg")


@pytest.fixture
def run(tmp_path):
    """Two disks of radius 0.5 on a floor, between a wall with round ends and a thin one; the second disk came late."""
    writer = RunWriter(
        tmp_path / "run.vtkhdf",
        {
            "dt": 0.5,
            "materials": ["rock", "steel"],
            "contactors": {
                "shape": ["disk", "half_plane", "segment", "segment"],
                "body": np.array([10, 11, 12, 13]),
                "radius": np.array([0.5, 0, 0.1, 0]),
                "offset": np.array([[0.1, 0], [0, 0], [0, 0], [0, 0]]),
                "direction": np.array([[0, 0, 0], [0, 1, 0], [0, 2, 1], [0, 1, 1]]),
            },
        },
        dim=2,
    )
    for k in range(3):
        n = 5 if k else 4
        position = np.array([[0, 0.5], [0, 0], [-1, 1], [2, 1], [1 + k, 0.5]])[:n]
        bodies = {
            "position": position,
            "velocity": np.array([[3, 4, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 1, 0]])[:n].astype(float),
            "rotation": np.array([np.pi / 2, 0, 0, 0, 0])[:n],
            "radius": np.array([0.5, 0, 0, 0, 0.25])[:n],
            "material": np.array([0, 1, 1, 1, 0])[:n],
            "id": np.array([10, 11, 12, 13, 20])[:n],
        }
        contacts = {
            "point": np.array([[0.0, 0.0], [0.5, 0.5]]),
            "normal": np.array([[0.0, 1.0], [-1.0, 0.0]]),
            "gap": np.zeros(2),
            "impulse": np.array([[0.5, 2.0], [1.0, 0.0]]),
            "status": np.array([1, 3]),
            "body_a": np.array([10, 10]),
            "body_b": np.array([11, 20 if k else 13]),
        }
        writer.write_step(float(k), k - 0.25, k, bodies, contacts, info(k))
    writer.close()
    yield load(writer.path)
    matplotlib.pyplot.close("all")


def disks_in(ax):
    from matplotlib.collections import EllipseCollection

    return next(c for c in ax.collections if isinstance(c, EllipseCollection))


def test_disks_stand_where_their_contactors_are(run):
    ax = run.plot(1)
    disks = disks_in(ax)
    # the first sits 0.1 off its centre of mass and its body is turned by a right angle
    assert np.allclose(disks.get_offsets(), [[0, 0.6], [2, 0.5]], atol=1e-15)
    assert np.allclose(disks.get_array(), [5, 1])
    assert ax.get_title(loc="left").startswith("t = 1 s")
    assert ax.get_xlabel() == "x [m]"
    assert len(disks_in(run.plot(0)).get_offsets()) == 1


def test_fields_and_classes(run):
    assert np.array_equal(disks_in(run.plot(1, "material")).get_array(), [0, 0])
    assert np.allclose(disks_in(run.plot(1, "rotation")).get_array(), [np.pi / 2, 0])
    assert np.allclose(disks_in(run.plot(1, np.arange(5.0))).get_array(), [0, 4])
    with pytest.raises(KeyError, match="no field 'colour'; there are position"):
        run.plot(1, "colour")
    with pytest.raises(ValueError, match=r"must be \(5,\)"):
        run.plot(1, np.arange(3.0))


def test_walls_are_drawn(run):
    from matplotlib.collections import PolyCollection

    ax = run.plot(1)
    outlines = [p.vertices for c in ax.collections if isinstance(c, PolyCollection) for p in c.get_paths()]
    capsule = next(v for v in outlines if len(v) > 30)
    assert np.allclose([capsule.min(0), capsule.max(0)], [[-1.1, -0.1], [-0.9, 2.1]], atol=1e-12)


def test_force_chains(run):
    from matplotlib.collections import LineCollection

    ax = run.plot_force_chains(1)
    lines = [c for c in ax.collections if isinstance(c, LineCollection)][-1]
    ends = {tuple(np.round(s.ravel(), 12)) for s in lines.get_segments()}
    # to the floor: from the centre to the point; to the disk across the periodic boundary: its radius along the normal
    assert ends == {(0, 0.5, 0, 0), (0, 0.5, 0.75, 0.5)}
    widths = np.sort(lines.get_linewidths())
    assert widths[1] == pytest.approx(2 * widths[0])
    assert "mean normal force 3 N" in ax.get_title(loc="left")  # (2 + 1) N s / 2 / 0.5 s
    assert not ax.texts  # nothing is written over bodies


def test_histories(run):
    ax = run.plot_energy()
    assert [line.get_label() for line in ax.lines] == ["kinetic", "potential"]
    assert run.plot_residual().get_yscale() == "log"


def test_animation(run, tmp_path):
    from PIL import Image

    for what in ("velocity", "forces"):
        path = run.animate(tmp_path / f"{what}.gif", what, dpi=40)
        with Image.open(path) as image:
            assert image.n_frames == 3
    with pytest.raises(FileError, match="a .gif or an .mp4"):
        run.animate(tmp_path / "a.avi")


@pytest.mark.parametrize("with_pyvista", [True, False])
def test_spheres(tmp_path, monkeypatch, with_pyvista):
    if with_pyvista:
        pytest.importorskip("pyvista")
    else:
        monkeypatch.setitem(__import__("sys").modules, "pyvista", None)
    rng = np.random.default_rng(0)
    writer = RunWriter(tmp_path / "run.vtkhdf", dim=3)
    writer.write_step(0, 0, 0, {"position": rng.random((20, 3)), "radius": np.full(20, 0.1), "velocity": rng.random((20, 6))})
    writer.close()
    with load(writer.path) as run:
        image = run.plot().images[0].get_array()
        assert (image < 250).any(axis=2).mean() > 0.05  # something was drawn
        if not with_pyvista:
            with pytest.raises(ImportError, match="forces in space need PyVista: pip install pyvista"):
                run.plot_force_chains()
    matplotlib.pyplot.close("all")


def shapes_run(tmp_path):
    rock = cn.Material("rock", density=1000.0)
    scene = cn.Scene(3)
    turned = {"rotation": [[0.8, 0.6, 0, 0]]}
    scene.add(cn.boxes([[0, 0, 0]], (1, 2, 3), rock, **turned), cn.capsules([[4, 0, 0]], 0.5, 2.0, rock, **turned))
    scene.add(cn.cylinders([[8, 0, 0]], 0.5, 2.0, rock, **turned), cn.superquadrics([[12, 0, 0]], (1, 2, 3), (0.5, 1), rock))
    scene.add(cn.surface([[0, -5, -5], [9, -5, -5], [0, 5, -5.0]], [[0, 1, 2]], rock), cn.spheres([[4, 0, 4]], 0.5, rock))
    scene.interact(rock, rock, cn.Coulomb(mu=0.3))
    cn.Simulation(scene, 1e-3).run(steps=1, output=tmp_path / "run.vtkhdf", progress=False)
    return load(tmp_path / "run.vtkhdf")


@pytest.mark.filterwarnings("ignore:there is no contact")
def test_surfaces_of_shapes_are_closed_and_where_the_bodies_are(tmp_path):
    """Volumes of the triangles, turned outward; points of each body at its place; files for other programs."""
    from cairn.post.shape_meshes import meshes_of, surfaces_of

    with shapes_run(tmp_path) as run:
        step = run[len(run) - 1]
        points, triangles, rows = meshes_of(step)
        assert sorted(set(rows.tolist())) == [0, 1, 2, 3, 4]
        expected = [6.0, np.pi * 0.25 * (2 + 4 / 3 * 0.5), np.pi * 0.5, step.bodies["mass"][3] / 1000]
        for k, volume in enumerate(expected):
            x = points[triangles[rows == k]]
            assert np.linalg.det(x).sum() / 6 == pytest.approx(volume, rel=1e-12 if k == 0 else 0.03)
            np.testing.assert_allclose(x.reshape(-1, 3).mean(axis=0), step.bodies["position"][k], atol=0.05)
        x = points[triangles[rows == 0]].reshape(-1, 3)
        np.testing.assert_allclose(np.ptp(x, axis=0), [1, 0.28 * 2 + 0.96 * 3, 0.96 * 2 + 0.28 * 3], rtol=1e-12)
        np.testing.assert_allclose(points[triangles[rows == 4]][0], [[0, -5, -5], [9, -5, -5], [0, 5, -5]], atol=1e-12)
    vtk = pytest.importorskip("vtkmodules.vtkIOXML")
    paths = convert(tmp_path / "run.vtkhdf", tmp_path / "out.vtp", step=0)
    (path,) = (p for p in paths if "out_surfaces_" in p and p.endswith(".vtp"))
    reader = vtk.vtkXMLPolyDataReader()
    reader.SetFileName(path)
    reader.Update()
    with load(tmp_path / "run.vtkhdf") as run:
        surfaces = surfaces_of(run[0])
    assert reader.GetOutput().GetNumberOfPolys() == len(surfaces[1]) > len(triangles)  # the sphere, too
    x = surfaces[0][surfaces[1][surfaces[2] == 5]]
    assert np.linalg.det(x - x.mean((0, 1))).sum() / 6 == pytest.approx(4 / 3 * np.pi * 0.125, rel=0.05)
    assert reader.GetOutput().GetCellData().HasArray("mass")


@pytest.mark.filterwarnings("ignore:there is no contact")
@pytest.mark.parametrize("with_pyvista", [True, False])
def test_shapes_are_drawn(tmp_path, monkeypatch, with_pyvista):
    if with_pyvista:
        pytest.importorskip("pyvista")
    else:
        monkeypatch.setitem(__import__("sys").modules, "pyvista", None)
    with shapes_run(tmp_path) as run:
        image = run.plot().images[0].get_array()
        assert (image < 250).any(axis=2).mean() > 0.05
    matplotlib.pyplot.close("all")


def test_pictures_without_pyvista_show_what_is_in_front():
    """A triangle and two spheres on one line of sight, in each order of drawing; nothing where nothing is."""
    from cairn.post import plain_render
    from matplotlib.colors import ListedColormap

    red_green_blue = ListedColormap([(1, 0, 0), (0, 1, 0), (0, 0, 1)])
    eye = plain_render.EYE / np.linalg.norm(plain_render.EYE)
    across = np.cross([0, 0, 1], eye)
    for order in ([0, 1], [1, 0]):
        balls = np.array([3 * eye, -9 * eye])[order]
        plate = np.array([-2 * across, 2 * across, [0, 0, 3.0]]), np.array([[0, 1, 2]]), np.array([0])
        radii, values = np.array([0.4, 5.0])[order], np.array([0.0, 1.0])[order]
        image = plain_render.render(balls, radii, values, red_green_blue, (-0.5, 2.5), (200, 160), plate, np.array([2.0])) / 255.0
        middle, above, aside, corner = image[80, 100], image[50, 100], image[80, 160], image[0, 0]
        assert middle.argmax() == 0 and above.argmax() == 2 and aside.argmax() == 1 and (corner == 1).all()
    assert (plain_render.render(np.zeros((0, 3)), np.zeros(0), [], red_green_blue, (0, 1), (20, 10)) == 255).all()


def test_polygons_are_drawn_where_they_are(tmp_path):
    """Outlines, colours, force chains, the view and surfaces for other programs; a body of two parts, disks beside them."""
    from cairn.post.shape_meshes import meshes_of, outlines_of

    rock = cn.Material("rock", density=1000.0)
    scene = cn.Scene(2, gravity=(0, -9.81), origin=(100.0, 50.0))
    box = np.array([[0, 0], [2, 0], [2, 1], [0, 1.0]])
    scene.add(cn.polygons([box + [100, 50], box[:3] + [103, 50]], rock))
    turned = cn.pre.convex_parts([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]])
    scene.add(cn.polygons([turned], rock, position=[[108, 50]], rotation=[np.pi / 2]))
    scene.add(cn.disks([[101.0, 51.5]], [0.5], rock), cn.wall((0, 50), (0, 1), rock))
    scene.interact(rock, rock, cn.Coulomb(mu=0.5))
    cn.Simulation(scene, dt=1e-3).run(steps=2, output=tmp_path / "run.vtkhdf", every=2, progress=False)
    with cn.load(tmp_path / "run.vtkhdf") as run:
        step = run[len(run) - 1]
        outlines, rows = outlines_of(step)
        assert sorted(rows.tolist()) == [0, 1, 2, 2]
        first = outlines[rows.tolist().index(0)]
        assert {tuple(p) for p in np.round(first, 3)} == {tuple(p) for p in box + [100, 50]}
        of_l = np.concatenate([o for o, r in zip(outlines, rows) if r == 2])
        np.testing.assert_allclose([of_l.min(axis=0), of_l.max(axis=0)], [[106, 50], [108, 52]], atol=1e-3)
        points, triangles, owners = meshes_of(step)
        a, b, c = (points[triangles[:, k]] for k in range(3))
        areas = np.bincount(owners, np.cross(b - a, c - a)[:, 2] / 2)
        np.testing.assert_allclose(areas, [2, 1, 3], rtol=1e-12)
        ax = run.plot()
        assert ax.get_xlim()[0] < 100 and ax.get_xlim()[1] > 108 and ax.get_ylim()[1] > 52
        assert sorted(len(c.get_array()) for c in ax.collections if c.get_array() is not None) == [1, 4]
        chains = run.plot_force_chains()
        lines = chains.collections[-1].get_segments()
        assert max(np.ptp(line, axis=0).max() for line in lines) > 0.4  # from the middle of a block to the point
    matplotlib.pyplot.close("all")


def test_many_disks_are_one_drawing(tmp_path):
    """43,000 disks are not 43,000 patches."""
    from cairn.post.plots import draw_disks

    figure, ax = matplotlib.pyplot.subplots()
    rng = np.random.default_rng(0)
    draw_disks(ax, rng.random((43_000, 2)), np.full(43_000, 0.002))
    figure.savefig(tmp_path / "a.png")
    assert len(ax.get_children()) < 50
    matplotlib.pyplot.close("all")


@pytest.mark.parametrize("dim", [2, 3])
def test_rotations_of_round_bodies_are_drawn_in_every_scene(tmp_path, dim):
    """Nothing in a scene of spheres alone, or of disks in a ring, needs the rotation of a body; a picture of it does."""
    cn = pytest.importorskip("cairn")
    rock, path = cn.Material("rock", density=2000.0), tmp_path / "a.vtkhdf"
    scene = cn.Scene(dim)
    velocity = np.eye(3 * dim - 3)[-1] * 2.0
    shape = cn.disks if dim == 2 else cn.spheres
    scene.add(shape(np.eye(dim) * 3, 0.5, rock, velocity=velocity))
    if dim == 2:
        scene.add(cn.ring((0, 0), 9.0, rock))
    scene.interact("*", "*", cn.Frictionless())
    sims = [cn.Simulation(scene, 1e-2) for _ in range(2)]
    sims[0].run(steps=10, output=path, every=10)
    sims[1].run(steps=10)
    assert np.array_equal(sims[0].bodies.position, sims[1].bodies.position)
    with cn.load(path) as run:
        turned = run[-1].bodies.rotation[0]
        assert (turned if dim == 2 else 2 * np.arctan2(turned[3], turned[0])) == pytest.approx(0.2)
        run.plot(what="rotation")
