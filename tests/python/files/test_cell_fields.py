"""Fields of the cells of meshes in run files: what Cairn reads, and what VTK reads."""

import cairn as cn
import numpy as np
import pytest
from cairn.run.mesh_fields import MeshFields

ROCK = cn.Material("rock", density=1000.0)


def plate(x0=0.0, second=False):
    x, y = np.linspace(0, 1, 4) + x0, np.linspace(0.02, 0.52, 3)
    points = np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2)
    k = np.arange(12).reshape(4, 3)
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], -1).reshape(-1, 4)
    if second:
        cells = {"triangle": quads[:3][:, [0, 1, 2]], "quad": quads[3:]}
        cells["triangle"] = np.concatenate([cells["triangle"], quads[:3][:, [0, 2, 3]]])
        law = cn.J2Plasticity(young=1e6, poisson=0.3, yield_stress=2e2, isotropic=1e4)
        return cn.SolidBody(points, cells, law, density=1000.0, rayleigh=(0.0, 1e-3))
    return cn.ElasticBody(points, {"quad": quads}, young=1e6, poisson=0.3, density=1000.0, rayleigh=(0.0, 1e-3))


def simulation():
    scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
    for k, body in enumerate((plate(), plate(2.0, second=True))):
        scene.add(cn.deformable(body, ROCK, contact=np.arange(len(body.points)), velocity=(0.0, -1.0), name=f"plate {k}"))
    scene.add(cn.wall((0, 0), (0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, 1e-3)


def test_cells_of_a_run_have_the_fields_of_the_meshes(tmp_path):
    sim, path = simulation(), tmp_path / "plates.vtkhdf"
    found = {}
    sim.run(steps=40, output=path, every=20, progress=False,
            callback=lambda s: found.update({s.steps: [m.cell_fields() for m in s.meshes]}))  # fmt: skip
    run = cn.load(path)
    for output, step in zip(run, (0, 20, 40)):
        cells = output.cells
        assert cells["mesh"].tolist() == [0] * 6 + [1] * 9
        if not step:
            continue
        linear, plastic = found[step]
        assert np.array_equal(cells["stress"], np.concatenate([linear["stress"], plastic["stress"]]))
        assert np.array_equal(cells["strain"][6:], plastic["strain"])
        assert np.array_equal(cells["accumulated_plastic_strain"][6:], plastic["accumulated_plastic_strain"])
        assert not cells["accumulated_plastic_strain"][:6].any()
    assert run[-1].cells["accumulated_plastic_strain"].max() > 0 and np.abs(run[-1].cells["stress"]).max() > 100


def test_vtk_reads_the_cells(tmp_path):
    vtk = pytest.importorskip("vtk")
    from vtk.util.numpy_support import vtk_to_numpy

    sim, path = simulation(), tmp_path / "plates.vtkhdf"
    sim.run(steps=40, output=path, every=20, progress=False)
    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(path))
    run = cn.load(path)
    for k in (2, 0, 1):
        reader.SetStep(k)
        reader.Update()
        blocks = reader.GetOutputDataObject(0)
        name = vtk.vtkCompositeDataSet.NAME()
        names = {blocks.GetMetaData(i).Get(name): blocks.GetBlock(i) for i in range(blocks.GetNumberOfBlocks())}
        grid = names["meshes"]
        assert grid.GetNumberOfCells() == 15 and grid.GetNumberOfPoints() == 24
        assert [grid.GetCellType(i) for i in range(15)] == [9] * 6 + [5] * 6 + [9] * 3
        data = grid.GetCellData()
        assert np.array_equal(vtk_to_numpy(data.GetArray("stress")), run[k].cells["stress"])
        x = vtk_to_numpy(grid.GetPoints().GetData())
        ids = np.concatenate([m.ids for m in sim.meshes])
        assert np.abs(x[:, :2] - run[k].nodes.position[np.searchsorted(run[k].nodes.id, ids)]).max() < 1e-14
        assert names["bodies"].GetNumberOfPoints() == len(run[k].bodies)


def test_a_run_goes_on_and_meshes_that_come_and_go_leave_the_file_whole(tmp_path):
    path = tmp_path / "plates.vtkhdf"
    sim = simulation()
    sim.run(steps=20, output=path, every=10, progress=False)
    sim.checkpoint(tmp_path / "half")
    again = simulation()
    again.restore(tmp_path / "half")
    again.run(steps=20, output=path, every=10, progress=False, append=True)
    whole = simulation()
    whole.run(steps=40, output=tmp_path / "whole.vtkhdf", every=10, progress=False)
    one, other = cn.load(path), cn.load(tmp_path / "whole.vtkhdf")
    assert len(one) == len(other) == 5
    for a, b in zip(one, other):
        assert np.array_equal(a.cells["stress"], b.cells["stress"])
    seen = []

    def goes(s):
        if s.steps == 5:
            s.remove(s.meshes[1].all_ids)
        if s.steps == 9:
            s.remove(s.meshes[0].all_ids)
        seen.append(len(s.meshes))

    last = simulation()
    last.run(steps=12, output=tmp_path / "gone.vtkhdf", every=3, progress=False, callback=goes)
    counts = [len(output.cells["mesh"]) for output in cn.load(tmp_path / "gone.vtkhdf")]
    assert counts == [15, 15, 6, 6, 0] or counts == [15, 15, 6, 0, 0]


def test_a_body_that_becomes_deformable_in_a_run_with_a_file(tmp_path):
    scene = cn.Scene(dim=2)
    square = [(0.0, 0.0), (1.0, 0.0), (1.0, 0.5), (0.0, 0.5)]
    scene.add(cn.polygons([square], ROCK, velocity=(1.0, 0.0, 0.0)))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 1e-3)

    def deforms(s):
        if s.steps == 4:
            s.deform(0, plate())

    sim.run(steps=8, output=tmp_path / "body.vtkhdf", every=2, progress=False, callback=deforms)
    run = cn.load(tmp_path / "body.vtkhdf")
    assert [len(output.bodies) for output in run] in ([1, 1, 1, 0, 0], [1, 1, 0, 0, 0])  # its nodes came too late for the file


def test_fields_of_many_bodies_are_those_of_each(tmp_path):
    x = np.linspace(0, 1, 4)
    points = np.stack(np.meshgrid(x, x, indexing="ij"), -1).reshape(-1, 2)
    k = np.arange(16).reshape(4, 4)
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], -1).reshape(-1, 4)
    cells = {"quad": quads[4:], "triangle": np.concatenate([quads[:4][:, [0, 1, 2]], quads[:4][:, [0, 2, 3]]])}
    groups = {"top": np.arange(3, 16, 4)}
    body = cn.ElasticBody(points, cells, young=1e6, poisson=0.3, density=1000.0, thickness=0.7, groups=groups)
    zone = cn.MAL(normal_stiffness=1e8, tangential_stiffness=1e8, mu=0.0, normal_strength=1e6, tangential_strength=1e6,
                  normal_work=1e4, tangential_work=1e4)  # fmt: skip
    scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
    scene.add(cn.deformable(plate(3.0), ROCK, contact=np.arange(12), velocity=(0.0, -1.0), name="plate"))
    cn.fracture.split(body, zone, ROCK, drive={"top": {"y": 2.0}}, velocity=(1.0, 0.5)).add_to(scene)
    scene.add(cn.deformable(plate(6.0, second=True), ROCK, contact=np.arange(12), velocity=(0.0, -1.0), name="last"))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    sim, path, found = cn.Simulation(scene, 1e-4), tmp_path / "many.vtkhdf", {}

    def each(s):
        here = [m.cell_fields() for m in s.meshes]
        corners = [m.position[nodes].reshape(-1, 2) for m in s.meshes for nodes in m.body.cells.values()]
        cells = MeshFields(s).cells()
        assert np.allclose(cells["points"][cells["connectivity"], :2], np.concatenate(corners), rtol=1e-14)
        found[s.steps] = here, [(m.place, m.nodal_fields() | {"displacement": m.displacement}) for m in s.meshes]

    sim.run(steps=4, output=path, every=2, progress=False, callback=each)
    run = cn.load(path)
    for output, step in zip(run, (0, 2, 4)):
        if not step:
            continue
        of_cells, of_nodes = found[step]
        for number, fields in enumerate(of_cells):
            rows = output.cells["mesh"] == number
            assert rows.any() and np.array_equal(output.cells["stress"][rows], fields["stress"])
            assert np.array_equal(output.cells["strain"][rows], fields["strain"])
        for place, fields in of_nodes:
            for name, values in fields.items():
                assert np.array_equal(getattr(output.nodes, name)[place], values), name
        assert np.abs(output.nodes.contact_pressure).max() > 0
