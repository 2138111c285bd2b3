"""Runs at all times in PyVista, small series of .vtp, contact networks in networkx, indices of mixing."""

import os
from pathlib import Path

import cairn as cn
import numpy as np
import pytest
from cairn.post import contact_graphs, measures
from cairn.post.convert import convert

ROCK = cn.Material("rock", density=2600.0)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A clump of two spheres, a sphere and a box that fall on a floor."""
    path = tmp_path_factory.mktemp("series") / "run.vtkhdf"
    scene = cn.Scene(3, gravity=(0.0, 0.0, -9.81))
    mass, inertia, offsets = 5.0, (0.1, 0.2, 0.2), [(-0.2, 0, 0), (0.2, 0, 0)]
    scene.add(cn.clumps([(0, 0, 0.31)], offsets, 0.3, mass, inertia, ROCK), cn.spheres([(2.0, 0, 0.5)], 0.4, ROCK),
              cn.boxes([(0, 3.0, 0.6)], 1.0, ROCK), cn.wall((0, 0, 0), (0, 0, 1), ROCK))  # fmt: skip
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    cn.Simulation(scene, 2e-3).run(steps=30, every=10, output=path, progress=False)
    return path


def test_series_steps_through_all_times_with_clumps_as_their_spheres(run):
    pyvista = pytest.importorskip("pyvista")
    series = cn.open_series(run)
    assert len(series) == series.number_time_points == 4 and np.allclose(series.time_values, [0, 0.02, 0.04, 0.06])
    with cn.load(run) as opened:
        for k, blocks in enumerate(series):
            surface, place = blocks["surfaces"], opened[k].bodies["position"]
            assert isinstance(surface, pyvista.PolyData) and np.allclose(blocks["bodies"].points, place)
            ids = np.asarray(opened[k].bodies["id"])
            clump = surface.extract_cells(surface.cell_data["id"] == ids[0])
            assert clump.bounds[1] - clump.bounds[0] == pytest.approx(1.0, rel=0.01), "two spheres, a metre from end to end"
            assert clump.connectivity().cell_data["RegionId"].max() == 1
    series.set_active_time_value(0.04)
    assert series.active_time_value == pytest.approx(0.04) and "contacts" in series.read().keys()
    assert np.allclose(series.read()["bodies"].points, series[2]["bodies"].points)
    for call, words in (
        (lambda: series.set_active_time_value(0.05), "nearest is at"),
        (lambda: series.set_active_time_point(9), "outputs 0 to 3"),
        (lambda: series.set_active_time_point("last"), "outputs 0 to 3"),
    ):
        with pytest.raises(ValueError, match=words):
            call()
    assert "4 outputs" in repr(series)


def test_globes_of_any_fineness_are_closed_and_turn_outward():
    pyvista = pytest.importorskip("pyvista")
    from cairn.post.shape_meshes import _globe

    for around in (4, 7, 12, 24):
        points, triangles = _globe(around)
        ball = pyvista.PolyData.from_regular_faces(points, triangles)
        a, b, c = (points[triangles[:, k]] for k in range(3))
        volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6
        assert np.allclose(np.linalg.norm(points, axis=1), 1) and 0.3 * 4.19 < abs(volume) < 4.19
        if around != 24:
            assert volume > 0 and ball.n_open_edges == 0


def test_reader_of_pyvista_steps_through_the_times_of_a_file(run):
    pyvista = pytest.importorskip("pyvista", minversion="0.49")
    from cairn.post import pyvista_reader

    project = (Path(__file__).parents[3] / "pyproject.toml").read_text(encoding="utf-8")
    assert '".vtkhdf" = "cairn.post.pyvista_reader:TimedHDFReader"' in project
    from pyvista.core.utilities import reader_registry

    before = reader_registry._save_registry_state()
    try:
        pyvista_reader.register()
        reader = pyvista.get_reader(str(run))
        assert reader.number_time_points == 4 and np.allclose(reader.time_values, [0, 0.02, 0.04, 0.06])
        with pytest.warns(UserWarning, match="holds 4 outputs, and this is the first"):
            reader.read()
        with cn.load(run) as opened:
            for k, t in enumerate(reader.time_values):
                reader.set_active_time_value(t)
                assert np.allclose(reader.read()[0].points, opened[k].bodies["position"])
                assert reader.active_time_value == t
        with pytest.raises(ValueError, match="no such time, the nearest is"):
            reader.set_active_time_value(0.03)
        with pytest.raises(ValueError, match="4 times, 0 to 3"):
            reader.set_active_time_point(4)
    finally:
        reader_registry._restore_registry_state(before)


def test_series_of_vtp_is_a_few_times_the_run(tmp_path):
    pytest.importorskip("vtk")
    scene, rng = cn.Scene(3, gravity=(0.0, 0.0, -9.81)), np.random.default_rng(1)
    grid = np.stack(np.meshgrid(*[np.arange(9)] * 3), axis=-1).reshape(-1, 3) * 1.1
    scene.add(cn.spheres(grid + 0.05 * rng.random(grid.shape) + [0, 0, 1.0], 0.4, ROCK), cn.wall((0, 0, 0), (0, 0, 1), ROCK))
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    path = tmp_path / "many.vtkhdf"
    cn.Simulation(scene, 2e-3).run(steps=20, every=5, output=path, progress=False)
    written = [p for p in convert(path, tmp_path / "many.vtp") if "surfaces" in p and p.endswith(".vtp")]
    bytes_per_body = np.mean([os.path.getsize(p) for p in written]) / len(grid)
    assert bytes_per_body < 1100, "12 faces round, single precision, compressed, no base64: 8,000 before"
    assert b'encoding="raw"' in open(written[0], "rb").read()
    far = cn.Scene(3)
    far.add(cn.spheres([(1e6, 0, 0)], 0.01, ROCK))
    path = tmp_path / "far.vtkhdf"
    cn.Simulation(far, 1e-3).run(steps=1, output=path, progress=False)
    written = [p for p in convert(path, tmp_path / "far.vtp") if "surfaces" in p and p.endswith(".vtp")]
    pyvista = pytest.importorskip("pyvista")
    low, high = np.reshape(pyvista.read(written[0]).bounds, (3, 2)).T
    assert np.allclose(high - low, 0.02, rtol=0.02), "far from the origin in double precision"


def stack(tmp_path, count=5, beside=True):
    """Disks on one another that bear a weight, and a light one beside them."""
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    scene.add(cn.disks([(0.0, 0.5 + k) for k in range(count)], 0.5, ROCK))
    if beside:
        scene.add(cn.disks([(3.0, 0.2)], 0.2, ROCK))
    scene.add(cn.wall((0, 0), (0, 1), ROCK))
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    exact = cn.NSCD(theta=1.0, solver=cn.NLGS(tol=1e-12, max_iter=10_000))
    cn.Simulation(scene, 1e-3, exact).run(steps=5, every=5, output=tmp_path / "stack.vtkhdf", progress=False)
    return cn.load(tmp_path / "stack.vtkhdf")


def test_graph_of_contacts_has_the_forces_of_a_stack(tmp_path):
    nx = pytest.importorskip("networkx")
    with stack(tmp_path) as run:
        graph = run.graph(-1)
        ids = run[-1].bodies["id"].tolist()
        weight = float(run[-1].bodies["mass"][0]) * 9.81
        for k in range(4):
            edge = graph.edges[ids[k], ids[k + 1]]
            assert edge["normal_force"] == pytest.approx((4 - k) * weight, rel=1e-6) and edge["points"] == 1
            assert edge["shear_force"] < 1e-9 * weight and np.allclose(np.abs(edge["normal"]), [0, 1])
        assert nx.number_connected_components(graph) == 1, "by the floor"
        chains = run.force_chains(-1, share=0.5)
        assert len(chains) == 1 and set(chains[0]) <= set(ids[:5]) and len(chains[0]) >= 3
        assert np.allclose(np.abs(chains[0].nodes[ids[0]]["direction"]), [0, 1])
        # a disk of a stack: mean of the forces on it times its diameter
        assert chains[0].nodes[ids[1]]["compression"] == pytest.approx(0.5 * (4 + 3) * weight, rel=1e-6)
        assert run.force_chains(-1, least=7) == [] and run.force_chains(0) == []
        assert contact_graphs.contact_graph(run[-1], dt=2e-3).edges[ids[0], ids[1]]["weight"] == pytest.approx(
            2 * weight, rel=1e-6
        )


def test_mixing_index_is_0_of_layers_and_1_of_a_random_mixture():
    rng = np.random.default_rng(5)
    places = rng.random((20_000, 3))
    mixed = rng.random(len(places)) < 0.3
    assert measures.lacey_index(places, mixed, 0.1) == pytest.approx(1.0, abs=0.01)
    assert measures.lacey_index(places, mixed, (0.1, 0.2, 0.5), weights=rng.random(len(places)) + 0.1) == pytest.approx(
        1.0, abs=0.02
    )
    apart = places[:, 2] < 0.5
    assert measures.lacey_index(places, apart, 0.1, low=(0, 0, 0), high=(1, 1, 1)) == pytest.approx(0.0, abs=1e-12)
    assert np.isnan(measures.lacey_index(places, np.ones(len(places), bool), 0.1))
    assert np.isnan(measures.lacey_index(places[:5], mixed[:5], 1e-3)) or not mixed[:5].any()
    assert measures.segregation(places[:, 2], places[:, 2] > 0.4) == 1
    assert measures.segregation(places[:, 2], apart) == -1
    assert measures.segregation(places[:, 2], mixed) == pytest.approx(0.0, abs=0.03)
    assert measures.segregation([1.0, 1.0, 2.0], np.array([True, False, True]), [1.0, 2.0, 1.0]) == pytest.approx(0.5)
    for call, words in (
        (lambda: measures.lacey_index(places, mixed.astype(int), 0.1), "of bool"),
        (lambda: measures.lacey_index(places, mixed, -0.1), "sample"),
        (lambda: measures.lacey_index(places, mixed, 0.1, weights=[1.0]), "weights"),
        (lambda: measures.segregation(places, mixed), "heights"),
        (lambda: measures.segregation(places[:, 0], mixed[:3]), "marked"),
    ):
        with pytest.raises(ValueError, match=words):
            call()


class Stub:
    """Stub of Blender's objects that keeps its arguments."""

    def __init__(self, name="", data=None):
        self.name, self.data, self.keys, self.materials, self.linked = name, data, [], [], []

    def new(self, name, data=None):
        self.linked.append(Stub(name, data))
        return self.linked[-1]

    def from_pydata(self, points, edges, faces):
        self.points, self.faces = np.array(points), np.array(faces)

    def link(self, thing):
        self.linked.append(thing)

    def keyframe_insert(self, what, frame):
        self.keys.append((frame, what, list(getattr(self, what))))


def test_script_for_blender_carries_bodies_along(run, tmp_path):
    from types import SimpleNamespace as Space

    from cairn.post import blender_import

    convert(run, tmp_path / "run.npz")
    data = np.load(tmp_path / "run.npz")
    collection = Stub()
    bpy = Space(data=Space(meshes=Stub(), objects=Stub(), materials=Stub()),
                context=Space(collection=Space(objects=collection), scene=Space(frame_end=0)))  # fmt: skip
    objects = blender_import.build(bpy, data, rate=50.0)
    assert len(objects) == 3 == len(collection.linked) and bpy.context.scene.frame_end == 4
    box = objects[int(data["00000/bodies/id"][2])]
    assert np.allclose(np.abs(box.data.points), 0.5) and len(box.data.faces) == 12
    places = [value for _, what, value in box.keys if what == "location"]
    assert np.allclose(places, [data[f"{k:05d}/bodies/position"][2] for k in range(4)])
    assert [frame for frame, what, _ in box.keys if what == "location"] == [1, 2, 3, 4]
    clump = objects[int(data["00000/bodies/id"][0])].data.points
    assert np.ptp(clump[:, 0]) == pytest.approx(1.0, rel=0.01)
