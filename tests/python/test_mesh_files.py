"""Meshes from files, meshio and gmsh as bodies of a scene, and what a run file holds of them."""

import cairn as cn
import numpy as np
import pytest
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
    """Of each material of the list."""
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
