"""Meshes from files, meshio and gmsh as bodies of a scene, and their data in run files."""

import cairn as cn
import numpy as np
import pytest
from cairn.model.mesh_files import decoded, encoded
from second_order import box

meshio = pytest.importorskip("meshio")

STEEL = {"young": 2e5, "poisson": 0.3}


def written(path, kind, counts=(2, 2), **options):
    """A box of cells in a file, with the groups "left" of nodes and "all" of cells."""
    dim = len(counts)
    points, cells = box(kind, counts, (1.0,) * dim)
    left = np.flatnonzero(points[:, 0] < 1e-9)
    full = np.zeros((len(points), 3))
    full[:, :dim] = points
    nodes = cells[kind]
    mesh = meshio.Mesh(full, [(kind, nodes)], point_sets={"left": left}, cell_sets={"all": [np.arange(len(nodes))]})
    if path.suffix == ".med":
        mesh.point_sets = mesh.cell_sets = {}
        mesh.point_data["point_tags"] = np.where(full[:, 0] < 1e-9, 2, 0)
        mesh.point_tags = {2: ["left"]}
        mesh.cell_data["cell_tags"] = [np.full(len(nodes), -3)]
        mesh.cell_tags = {-3: ["all"]}
    mesh.write(path, **options)
    return left


@pytest.mark.parametrize(("ending", "named"), [(".inp", True), (".med", True), (".vtu", False), (".vtk", False)])
@pytest.mark.parametrize("kind", ["quad", "tetra"])
def test_a_mesh_of_a_file_is_a_body_with_its_groups(tmp_path, ending, named, kind):
    dim = 2 if kind == "quad" else 3
    path = tmp_path / f"part{ending}"
    left = written(path, kind, (2,) * dim)
    rock = cn.Material("rock", density=1200.0)
    body = cn.deformable(path, rock, bulk=cn.NeoHookean(**STEEL), rayleigh=(1.0, 0.0))[0].mesh.body
    assert isinstance(body, cn.SolidBody) and len(body.points) == len(box(kind, (2,) * dim, (1.0,) * dim)[0])
    assert body.nodal_mass().sum() == pytest.approx(1200.0, rel=1e-12)
    if named:
        assert np.array_equal(np.sort(body.groups["left"]), left) and len(body.groups["all"]) == len(body.points)
    linear = cn.deformable(meshio.read(path), rock, bulk=cn.IsotropicElastic(**STEEL), fixed={"left": "x"} if named else None)
    assert type(linear[0].mesh.body) is cn.ElasticBody


def test_a_model_of_gmsh_is_a_body():
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.add("plate")
        gmsh.model.occ.addRectangle(0, 0, 0, 2, 1)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(2, [1], name="plate")
        gmsh.model.addPhysicalGroup(1, [1], name="foot")
        gmsh.model.mesh.generate(2)
        body = cn.deformable(gmsh, cn.Material("m", density=3.0), bulk=cn.IsotropicElastic(**STEEL))[0].mesh.body
    finally:
        gmsh.finalize()
    assert body.nodal_mass().sum() == pytest.approx(6.0, rel=1e-12)
    foot = body.points[body.groups["foot"]]
    assert np.all(foot[:, 1] == 0) and np.ptp(foot[:, 0]) == 2


@pytest.fixture
def gmsh():
    """gmsh with no model, silent."""
    module = pytest.importorskip("gmsh", reason="gmsh is not installed: models of its API are not read")
    module.initialize(interruptible=False)
    module.option.setNumber("General.Terminal", 0)
    yield module
    module.finalize()


def plate(gmsh, name, order=1):
    """A model of triangles and quadrilaterals, in two surfaces, with names for a surface, both, an edge and a point; a third
    surface is in no group."""
    gmsh.model.add(name)
    occ = gmsh.model.occ
    both, _ = occ.fragment([(2, occ.addRectangle(0, 0, 0, 1, 1))], [(2, occ.addRectangle(1, 0, 0, 1, 1))])
    occ.addRectangle(5, 0, 0, 1, 1)
    occ.synchronize()
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.4)
    gmsh.model.mesh.setRecombine(2, both[1][1])
    gmsh.model.addPhysicalGroup(2, [both[0][1]], name="left half")
    gmsh.model.addPhysicalGroup(2, [tag for _, tag in both], name="plate")
    foot = [tag for _, tag in gmsh.model.getEntitiesInBoundingBox(-1, -0.1, -1, 3, 0.1, 1, dim=1)]
    gmsh.model.addPhysicalGroup(1, foot, name="foot")
    gmsh.model.addPhysicalGroup(0, [gmsh.model.getEntitiesInBoundingBox(-1, -1, -1, 0.1, 0.1, 1, dim=0)[0][1]], name="corner")
    gmsh.model.addPhysicalGroup(1, foot[:1])  # without a name
    gmsh.model.mesh.generate(2)
    gmsh.model.mesh.setOrder(order)


def solid(gmsh, name, order=1):
    """A model of hexahedra, or of tetrahedra, with names for it and for a face."""
    gmsh.model.add(name)
    gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
    gmsh.model.occ.synchronize()
    if name == "bricks":
        gmsh.model.mesh.setTransfiniteAutomatic()
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.6)
    low = gmsh.model.getEntitiesInBoundingBox(-1, -1, -0.1, 2, 2, 0.1, dim=2)
    gmsh.model.addPhysicalGroup(2, [low[0][1]], name="low")
    gmsh.model.addPhysicalGroup(3, [1], name="block")
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(order)


@pytest.mark.parametrize("make, name, order, kinds", [
    (plate, "plate", 1, {"triangle", "quad"}), (plate, "plate", 2, {"triangle6", "quad9"}),
    (solid, "bricks", 1, {"hexahedron"}), (solid, "bricks", 2, {"hexahedron27"}),
    (solid, "stone", 1, {"tetra"}), (solid, "stone", 2, {"tetra10"}),
])  # fmt: skip
def test_a_model_of_gmsh_is_the_mesh_of_its_file(tmp_path, gmsh, make, name, order, kinds):
    """The same points, cells and groups, in the same order, from the module, from the name of a model that is not the current
    one, and from the file; and the body of each has the mass of the shape, which cells with nodes in another order have not."""
    make(gmsh, name, order)
    path = tmp_path / "model.msh"
    gmsh.write(str(path))
    here = cn.pre.mesh(gmsh)
    gmsh.model.add("another")
    meshes = [cn.pre.mesh(path), here, cn.pre.mesh(name), cn.pre.mesh(gmsh, model=name)]
    assert gmsh.model.getCurrent() == "another"
    with pytest.raises(ValueError, match="the model 'another' of gmsh has no cells"):
        cn.pre.mesh(gmsh)
    with pytest.raises(ValueError, match="gmsh has no model 'third'; there are"):
        cn.pre.mesh(gmsh, model="third")
    with pytest.raises(cn.FileError, match="third"):
        cn.pre.mesh("third")
    file = meshes[0]
    assert set(file.cells) == kinds
    for mesh in meshes[1:]:
        assert np.abs(mesh.points - file.points).max() < 1e-15 * np.ptp(file.points)  # of 16 digits in the file
        assert list(mesh.cells) == list(file.cells)
        assert all(np.array_equal(mesh.cells[kind], file.cells[kind]) for kind in kinds)
        assert set(mesh.groups) == set(file.groups)
        assert all(np.array_equal(mesh.groups[name], file.groups[name]) for name in file.groups)
        body = cn.ElasticBody.read(mesh, density=3.0, **STEEL)
        assert body.M.sum() / body.dim == pytest.approx(6.0 if make is plate else 3.0, rel=1e-12)
        made = cn.deformable(mesh, cn.Material("m", density=3.0), bulk=cn.NeoHookean(**STEEL))[0].mesh.body
        assert made.nodal_mass().sum() == pytest.approx(6.0 if make is plate else 3.0, rel=1e-12)
    if make is plate:
        assert set(file.groups) == {"left half", "plate", "foot", "corner"} and len(file.groups["corner"]) == 1
        assert file.points[:, 0].max() == 2.0 and len(file.groups["plate"]) == len(file.points)
        assert np.all(file.points[file.groups["foot"], 1] == 0) and file.points[file.groups["left half"], 0].max() == 1.0


def test_cells_that_are_of_no_body_are_told(gmsh):
    """Prisms beside hexahedra were left out without a word."""
    gmsh.model.add("layers")
    gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
    gmsh.model.occ.addRectangle(1, 0, 0, 1, 1)
    gmsh.model.occ.synchronize()
    gmsh.model.mesh.setRecombine(2, 2)
    gmsh.model.occ.extrude([(2, 1), (2, 2)], 0, 0, 1, [2], recombine=True)
    gmsh.model.occ.synchronize()
    gmsh.model.mesh.generate(3)
    with pytest.raises(ValueError, match="cells of kind .* beside hexahedron: give cells of tetra, hexahedron"):
        cn.pre.mesh(gmsh)


def test_what_is_no_mesh_is_told(tmp_path):
    rock = cn.Material("rock", density=1200.0)
    elastic = cn.IsotropicElastic(**STEEL)
    with pytest.raises(cn.FileError, match="none.msh"):
        cn.deformable(tmp_path / "none.msh", rock, bulk=elastic)
    written(tmp_path / "part.inp", "quad")
    with pytest.raises(TypeError, match="bulk is None: give the material of the mesh"):
        cn.deformable(tmp_path / "part.inp", rock)
    body = cn.ElasticBody(*box("quad", (1, 1), (1.0, 1.0)), density=1.0, **STEEL)
    with pytest.raises(TypeError, match="bulk is for a mesh that is read"):
        cn.deformable(body, rock, bulk=elastic)
    line = meshio.Mesh(np.zeros((2, 3)), [("line", [[0, 1]])])
    with pytest.raises(ValueError, match="holds cells of kind line: give cells of triangle"):
        cn.deformable(line, rock, bulk=elastic)
    bent = meshio.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 1.0]], [("triangle", [[0, 1, 2]])])
    with pytest.raises(ValueError, match="surface from z = 0 to 1"):
        cn.deformable(bent, rock, bulk=elastic)


def pressed(dim, bulk, density=1000.0, **options):
    """A block on a plane whose top goes down."""
    kind = "quad" if dim == 2 else "hexahedron"
    points, cells = box(kind, (3,) * dim, (1.0,) * dim)
    up = points[:, -1]
    top, bottom = np.flatnonzero(up > 1 - 1e-9), np.flatnonzero(up < 1e-9)
    groups = {"top": top, "bottom": bottom}
    body = cn.SolidBody(points, cells, bulk, density=density, groups=groups, rayleigh=(50.0, 1e-3), **options)
    rock = cn.Material("rock", density=2500.0)
    scene = cn.Scene(dim=dim, gravity=np.zeros(dim))
    along = "xyz"[dim - 1]
    speed = cn.Table([0.0, 0.05, 0.051], [-1.0, -1.0, 0.0])
    scene.add(cn.deformable(body, rock, contact="bottom", drive={"top": {along: speed}}))
    normal = np.zeros(dim)
    normal[-1] = 1.0
    scene.add(cn.wall(np.zeros(dim), normal, rock))
    scene.interact(rock, rock, cn.Coulomb(mu=0.0))
    return cn.Simulation(scene, dt=1e-3, strategy=cn.NSCD(theta=1.0, solver=cn.NLGS(tol=1e-12)))


@pytest.mark.parametrize("dim", [2, 3])
def test_the_file_holds_stress_strain_plastic_strain_and_contact_pressure(dim, tmp_path):
    """A column that slides on its foot, squeezed beyond yield: all fields are uniform, the pressure is the stress, the reaction
    of the top the sum of it."""
    sim = pressed(dim, cn.FiniteJ2(young=2e6, poisson=0.3, yield_stress=3e4, isotropic=1e5), density=1.0, mean_dilatation=True)
    sim.run(steps=80, output=tmp_path / "press.vtkhdf", every=80, progress=False,
            probes={"pull": lambda s: s.meshes[0].reaction("top")[dim - 1]})  # fmt: skip
    mesh = sim.meshes[0]
    with cn.load(tmp_path / "press.vtkhdf") as run:
        step = run[-1]
        rows = np.arange(len(step.nodes))[mesh.place]
        assert np.array_equal(step.nodes["id"][rows], mesh.ids) and np.array_equal(step.nodes["position"][rows], mesh.position)
        assert np.array_equal(step.nodes["displacement"][rows], mesh.displacement)
        assert step.nodes["velocity"].shape == (len(rows), dim) and len(step.bodies) == len(sim.bodies)
        found = {name: step.nodes[name][rows] for name in
                 ("stress", "strain", "accumulated_plastic_strain", "contact_pressure")}  # fmt: skip
        pull = run.history["pull"][-1]
        at = dim - 1
        stress = found["stress"][:, at]
        height = 1 - 0.05
        assert found["strain"][:, at] == pytest.approx(np.full(len(rows), np.log(height)), rel=2e-3)
        assert np.ptp(stress) < 1e-3 * abs(stress.mean()) and stress.mean() < -3e4
        bottom = mesh.body.groups["bottom"]
        assert found["contact_pressure"][bottom] == pytest.approx(-stress[bottom], rel=2e-3)
        assert np.count_nonzero(found["contact_pressure"]) == len(bottom)
        assert found["accumulated_plastic_strain"].min() > 0.02
        width = np.exp(found["strain"][0, 0]) if dim == 2 else np.exp(found["strain"][0, :2].sum())
        assert pull == pytest.approx(stress.mean() * width, rel=1e-3)
        for what in ("von_mises", "stress_xx", "accumulated_plastic_strain", "contact_pressure"):
            axes = run.plot(-1, what)
            assert axes.images if dim == 3 else any(len(c.get_paths()) == 9 for c in axes.collections)


def test_a_scene_with_a_solid_body_is_saved(tmp_path):
    sim = pressed(2, cn.NeoHookean(**STEEL), mean_dilatation=True)
    sim.scene.save(tmp_path / "solid.scene.h5")
    again = cn.Simulation(cn.Scene.load(tmp_path / "solid.scene.h5"), dt=1e-3, strategy=sim.strategy)
    for _ in range(5):
        sim.step(), again.step()
    assert np.array_equal(sim.meshes[0].displacement, again.meshes[0].displacement) and again.meshes[0].displacement.any()


PLAIN = {
    "isotropic_elastic": {"young": 2e6, "poisson": 0.3},
    "orthotropic_elastic": {
        "young1": 2e6, "young2": 1e6, "young3": 1.5e6, "poisson12": 0.2, "poisson23": 0.2, "poisson13": 0.2,
        "shear12": 5e5, "shear23": 5e5, "shear13": 5e5, "angle": 0.3,
    },
    "kelvin_voigt": {"young": 2e6, "poisson": 0.3, "viscous_young": 2e3},
    "saint_venant_kirchhoff": {"young": 2e6, "poisson": 0.3},
    "neo_hookean": {"young": 2e6, "poisson": 0.3},
    "ogden": {"bulk": 2e6, "shear1": 4e5, "power1": 2.0, "shear2": -1e5, "power2": -2.0},
    "j2_plasticity": {"young": 2e6, "poisson": 0.3, "yield_stress": 3e4, "isotropic": 1e5, "kinematic": 1e5},
    "finite_j2": {"young": 2e6, "poisson": 0.3, "yield_stress": 3e4, "isotropic": 1e5},
    "drucker_prager": {
        "young": 2e6, "poisson": 0.3, "cohesion": 2e4, "friction_angle": 0.4, "dilation_angle": 0.4, "hardening": 1e5,
    },
    "isotropic_damage": {"young": 2e6, "poisson": 0.3, "strength": 3e4, "fracture_energy": 2e3},
}  # fmt: skip


@pytest.mark.parametrize("material", list(cn._core.bulk_materials()), ids=lambda m: m["name"])
def test_a_restart_goes_on_to_the_same_bits(material, tmp_path):
    """Each material of the list restarts to the same bits."""
    if material["umat"]:
        pytest.skip("of a library")
    bulk = getattr(cn, material["python_name"])(**PLAIN[material["name"]])
    whole, first, second = (pressed(2, bulk) for _ in range(3))
    for k in range(12):
        whole.step()
        if k < 6:
            first.step()
    first.checkpoint(tmp_path / "half.checkpoint.h5")
    second.restore(tmp_path / "half.checkpoint.h5")
    for _ in range(6):
        second.step()
    assert np.array_equal(whole.meshes[0].displacement, second.meshes[0].displacement)
    assert np.array_equal(whole.meshes[0].velocity, second.meshes[0].velocity)
    assert np.array_equal(whole.contacts.force, second.contacts.force) and whole.info["energy"] == second.info["energy"]
    for name, state in whole.meshes[0].material_state["quad"].items():
        assert np.array_equal(state, second.meshes[0].material_state["quad"][name])


def test_materials_have_the_name_in_files_that_every_version_reads():
    content = encoded({"material": cn.Material("rock", density=2500.0)})
    assert content["material"]["module"] == "cairn.model.materials"
    assert decoded(content) == {"material": cn.Material("rock", density=2500.0)}
