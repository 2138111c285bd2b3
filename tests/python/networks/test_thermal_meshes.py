"""Heat in deformable bodies and its effects: slabs against series, restrained stress, a bimetal; bodies that grow."""

import cairn as cn
import numpy as np
import pytest

N = cn.networks
E, NU, ALPHA = 200e9, 0.3, 1.2e-5


def grid(nx, ny, lx, ly, corner=(0.0, 0.0)):
    x, y = np.linspace(0, lx, nx + 1) + corner[0], np.linspace(0, ly, ny + 1) + corner[1]
    points = np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2)
    k = np.arange((nx + 1) * (ny + 1)).reshape(nx + 1, ny + 1)
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], -1).reshape(-1, 4)
    groups = {"left": k[0], "right": k[-1], "bottom": k[:, 0], "top": k[:, -1], "all": k.ravel()}
    return points, {"quad": quads}, groups


def body(nx, ny, lx, ly, *, plane="strain", **options):
    points, cells, groups = grid(nx, ny, lx, ly)
    return cn.ElasticBody(points, cells, young=E, poisson=NU, density=7800.0, groups=groups, plane=plane, **options)


STEEL = cn.Material("steel", density=7800.0, conductivity=50.0, capacity=500.0, expansion=ALPHA)


def scene_of(*parts, **thermal):
    scene = cn.Scene(2)
    for part in parts:
        scene.add(part)
    scene.thermal(friction="none", **thermal)
    return scene


def test_a_slab_whose_surface_is_quenched():
    """Centre of a slab after Fo = 0.2 and 0.5: .772312, .370777 of the jump (400 terms of the series)."""
    length, fine = 0.1, 40
    slab = cn.deformable(body(fine, 1, length, length / fine), STEEL, fixed={"all": "xy"}, name="slab")
    scene = scene_of(slab, initial={"*": 400.0, "slab.right": 300.0}, temperature={"slab.right": 300.0}, theta=0.5)
    diffusivity = 50.0 / (7800 * 500)
    dt = 0.01 * length**2 / diffusivity / 10
    sim = cn.Simulation(scene, dt)
    seen = {}
    for k in range(1, 501):
        sim.step()
        if k in (200, 500):
            left = sim.meshes[0].body.groups["left"]
            seen[k] = sim.nodes.temperature[np.searchsorted(sim.nodes.id, sim.meshes[0].ids[left[0]])]
    assert (seen[200] - 300) / 100 == pytest.approx(0.772312, abs=3e-4)
    assert (seen[500] - 300) / 100 == pytest.approx(0.370777, abs=3e-4)
    balance = sim.info["thermal"]["balance"]
    assert abs(balance["closure"]) <= 1e-12 * balance["in_play"]


def test_a_slab_that_convection_cools():
    """Bi = 1: centre and surface after Fo = 0.5 are .772526 and .504522 of the difference at the start."""
    length, fine = 0.1, 40
    high = length / fine
    slab = cn.deformable(body(fine, 1, length, high), STEEL, fixed={"all": "xy"}, name="slab")
    scene = scene_of(slab, initial=400.0, convection=[("slab.right", 50.0 / length, high / 2, 300.0)], theta=0.5)
    sim = cn.Simulation(scene, 0.001 * length**2 * 7800 * 500 / 50.0)
    for _ in range(500):
        sim.step()
    t = (sim.nodes.temperature - 300) / 100
    groups = sim.meshes[0].body.groups
    assert t[groups["left"]] == pytest.approx(0.772526, abs=2e-4) and t[groups["right"]] == pytest.approx(0.504522, abs=2e-4)
    assert abs(sim.info["thermal"]["balance"]["closure"]) <= 1e-12 * sim.info["thermal"]["balance"]["in_play"]


def test_two_slabs_in_contact():
    """k = 50 over 0.1 m, h = 1000, k = 20 over 0.05 m, from 100 to 0 degrees: 18,181.82 W/m2 and a jump of 18.1818 K."""
    brass = cn.Material("brass", density=8500.0, conductivity=20.0, capacity=380.0)
    points, cells, groups = grid(3, 1, 0.05, 0.02, corner=(0.1, 0.0))
    second = cn.ElasticBody(points, cells, young=E, poisson=NU, density=8500.0, groups=groups)
    scene = cn.Scene(2)
    one = scene.add(cn.deformable(body(4, 1, 0.1, 0.02), STEEL, fixed={"all": "xy"}, name="one"))
    other = scene.add(cn.deformable(second, brass, fixed={"all": "xy"}, name="other"))
    wires = [(one[8 + k], other[k], 1000 * 0.01) for k in (0, 1)]
    scene.thermal(temperature={"one.left": 373.15, "other.right": 273.15}, wires=wires, steady=True)
    sim = cn.Simulation(scene, 1.0)
    sim.step()
    t = sim.nodes.temperature - 273.15
    assert [t[one[8]], t[other[0]]] == pytest.approx([63.636364, 45.454545], abs=1e-6)
    assert sim.info["thermal"]["balance"]["in_play"] / 2 / 0.02 == pytest.approx(18181.8182, rel=1e-8)


@pytest.mark.parametrize("kind", ["triangle", "quad"])
def test_steady_conduction_is_linear_and_flows_what_it_must(kind):
    points, cells, groups = grid(4, 3, 0.4, 0.3)
    inside = ((points > 1e-9) & (points < [0.4 - 1e-9, 0.3 - 1e-9])).all(axis=1)
    points = points + 0.01 * np.sin(37 * points[:, ::-1]) * inside[:, None]
    if kind == "triangle":
        q = cells["quad"]
        cells = {"triangle": np.concatenate([q[:, [0, 1, 2]], q[:, [0, 2, 3]]])}
    b = cn.ElasticBody(points, cells, young=E, poisson=NU, density=7800.0, groups=groups)
    part = cn.deformable(b, STEEL, fixed={"all": "xy"}, name="plate")
    sim = cn.Simulation(scene_of(part, temperature={"plate.left": 400.0, "plate.right": 300.0}, steady=True), 1.0)
    sim.step()
    assert sim.nodes.temperature == pytest.approx(400 - 250 * points[:, 0], rel=1e-12)
    assert abs(sim.info["thermal"]["closure"]) <= 1e-12


def test_a_block_in_three_dimensions():
    x = np.stack(np.meshgrid([0, 0.5, 1], [0, 1], [0, 1], indexing="ij"), -1).reshape(-1, 3).astype(float)
    hexes = np.array([[0, 4, 6, 2, 1, 5, 7, 3], [4, 8, 10, 6, 5, 9, 11, 7]])
    b = cn.ElasticBody(x, {"hexahedron": hexes}, young=E, poisson=NU, density=7800.0,
                       groups={"left": np.arange(4), "right": np.arange(8, 12), "all": np.arange(12)})  # fmt: skip
    scene = cn.Scene(3)
    scene.add(cn.deformable(b, STEEL, fixed={"all": "xyz"}, name="block"))
    scene.thermal(temperature={"block.left": 400.0, "block.right": 300.0}, steady=True)
    sim = cn.Simulation(scene, 1.0)
    sim.step()
    assert sim.nodes.temperature == pytest.approx(400 - 100 * x[:, 0], rel=1e-12)
    # restrained in all directions: E alpha dT / (1 - 2 nu) [Pa]
    sim = cn.Simulation(_hot(scene, "block"), 1.0)
    sim.step()
    sim.step()
    stress = sim.meshes[0].stress["hexahedron"]
    assert stress[:, :3] == pytest.approx(-600e6, rel=1e-12)


def _hot(scene, name):
    scene.thermal(temperature={f"{name}.all": 393.15}, initial=293.15, steady=True)
    return scene


@pytest.mark.parametrize(("plane", "fixed", "xx"), [
    ("stress", {"left": "x", "right": "x", "bottom": "y"}, -240e6),
    ("stress", {"all": "xy"}, -342.857142857e6),
    ("strain", {"all": "xy"}, -600e6),
])  # fmt: skip
def test_restrained_expansion(plane, fixed, xx):
    """A hundred kelvin: 240, 342.857 and 600 MPa."""
    part = cn.deformable(body(4, 2, 0.2, 0.1, plane=plane, rayleigh=(2000.0, 0.0)), STEEL, fixed=fixed, name="bar")
    sim = cn.Simulation(_hot(scene_of(part), "bar"), 1.0, cn.NSCD(theta=1.0))
    for _ in range(40):
        sim.step()
    assert sim.meshes[0].stress["quad"][:, 0] == pytest.approx(xx, rel=1e-9)


def test_free_expansion_has_no_stress():
    part = cn.deformable(body(4, 2, 0.2, 0.1, plane="stress", rayleigh=(2000.0, 0.0)), STEEL,
                         fixed={"left": "x", "bottom": "y"}, name="bar")  # fmt: skip
    sim = cn.Simulation(_hot(scene_of(part), "bar"), 1.0, cn.NSCD(theta=1.0))
    for _ in range(40):
        sim.step()
    mesh = sim.meshes[0]
    assert mesh.displacement == pytest.approx(1.2e-3 * mesh.body.points, abs=1e-12)
    assert np.abs(mesh.stress["quad"]).max() <= 1e-9 * E * ALPHA * 100


@pytest.mark.parametrize("profile", ["layers", "gradient"])
def test_a_hot_layer_or_a_gradient_bends(profile):
    """Curvature 12 / t^3 times the moment of the free strain: 3/2 d_alpha dT / t of two equal layers (Timoshenko 1925), of which
    one is as hot as if it alone expanded; alpha dT / t of a linear gradient."""
    points, cells, groups = grid(320, 8, 0.1, 2e-3)
    b = cn.ElasticBody(points, cells, young=E, poisson=0.0, density=7800.0, groups=groups, plane="stress", rayleigh=(3e3, 0.0))
    part = cn.deformable(b, STEEL, fixed={"left": "xy"}, name="strip")
    y = points[:, 1] - 1e-3
    rise = np.where(np.abs(y) < 1e-9, 50.0, 100.0 * (y < 0)) if profile == "layers" else -50.0 * y / 1e-3
    scene = cn.Scene(2)
    ids = scene.add(part)[: len(points)]
    scene.thermal(temperature=[(ids, 293.15 + rise)], steady=True)
    sim = cn.Simulation(scene, 10.0, cn.NSCD(theta=1.0))
    for _ in range(10):
        sim.step()
    of_cells, height = rise[cells["quad"][:8]].mean(axis=1), y[cells["quad"][:8]].mean(axis=1)
    curvature = -12 / (2e-3) ** 3 * ALPHA * np.sum(of_cells * height) * 2e-3 / 8
    assert curvature == pytest.approx(0.9 if profile == "layers" else ALPHA * 100 / 2e-3, rel=0.05)
    tip = sim.meshes[0].displacement[b.groups["right"], 1].mean()
    assert tip == pytest.approx(curvature * 0.1**2 / 2, rel=0.02)


@pytest.mark.parametrize("ratio", [1.0, 3.0, 0.3, 20.0, 0.05])
def test_a_bimetal_of_two_moduli(ratio):
    """Two layers of 1 mm, one of which is warmed as if it alone expanded: curvature of Timoshenko (1925),
    6 d_alpha dT (1 + m)^2 / (t (3 (1 + m)^2 + (1 + m n)(m^2 + 1/(m n)))), m = 1, n the ratio of moduli. Cells at the interface
    are thin: across them the temperature falls, and a stiff layer bends by that as by a gradient of its own."""
    thick, length, thin = 2e-3, 0.05, 2e-6
    levels = np.concatenate([np.linspace(-thick / 2, -thin, 8), [0.0], np.linspace(thin, thick / 2, 8)])
    layers = len(levels) - 1
    points, cells, groups = grid(480, layers, length, thick)
    points = np.c_[points[:, 0], np.tile(levels, 481)]
    y = points[:, 1]
    lower = y[cells["quad"]].mean(axis=1) < 0
    kinds = [cn.IsotropicElastic(young=E * n, poisson=0.0) for n in (1.0, ratio)]
    b = cn.SolidBody(points, {"quad": cells["quad"]}, {"quad": (kinds, lower.astype(int))}, density=7800.0, groups=groups,
                     plane="stress", kinematics="small", rayleigh=(3e3, 0.0))  # fmt: skip
    rise = np.where(y == 0, 50.0, 100.0 * (y < 0))
    scene = cn.Scene(2)
    ids = scene.add(cn.deformable(b, STEEL, fixed={"left": "xy"}, name="strip"))[: len(points)]
    scene.thermal(temperature=[(ids, 293.15 + rise)], steady=True)
    sim = cn.Simulation(scene, 10.0, cn.NSCD(theta=1.0))
    for _ in range(12):
        sim.step()
    tip = sim.meshes[0].displacement[groups["right"], 1].mean()
    timoshenko = 6 * ALPHA * 100 * 4 / (thick * (12 + (1 + ratio) * (1 + 1 / ratio)))
    # the clamp bends the strip by its transverse restraint, over a length of about its thickness
    assert tip == pytest.approx(timoshenko * length**2 / 2, rel=0.01)


SQUARE = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]


def growing(shape):
    rubber = cn.Material("rubber", density=1000.0, conductivity=1.0, capacity=100.0, expansion=1e-3)
    if shape in ("disk", "polygon"):
        scene = cn.Scene(2)
        place = [[0.0, 0.5]]
        made = cn.disks(place, 0.5, rubber) if shape == "disk" else cn.polygons(SQUARE, rubber, position=place)
    else:
        scene = cn.Scene(3)
        place = [[0.0, 0.0, 0.5]]
        made = {
            "sphere": lambda: cn.spheres(place, 0.5, rubber),
            "polyhedron": lambda: cn.boxes(place, [1.0, 1.0, 1.0], rubber),
            "capsule": lambda: cn.capsules(place, 0.5, 1.0, rubber, axis=(1.0, 0, 0)),
            "cylinder": lambda: cn.cylinders(place, 0.5, 1.0, rubber),
            "superquadric": lambda: cn.superquadrics(place, [0.5, 0.5, 0.5], [0.8, 0.8], rubber),
        }[shape]()
    scene.add(made.with_(group="grain"))
    floor = np.eye(scene.dim)[-1]
    scene.add(cn.wall(0 * floor, floor, cn.Material("floor", density=1.0, conductivity=1.0, capacity=1.0)))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    return scene


SHAPES = ["disk", "polygon", "sphere", "polyhedron", "capsule", "cylinder", "superquadric"]


@pytest.mark.parametrize("shape", SHAPES)
def test_bodies_grow_freely_without_a_force(shape):
    """On a floor without gravity: the centre goes up by what the lower half grew, and nothing holds it."""
    scene = growing(shape)
    ramp = cn.Table([0.0, 1.0], [293.15, 393.15])
    scene.thermal(conductance=N.Constant(conductance=0.0), temperature={"grain": ramp}, friction="none")
    sim = cn.Simulation(scene, 0.05)
    height = []
    for _ in range(20):
        sim.step()
        height.append(sim.bodies.position[0, -1])
    assert sim.bodies.temperature[0] == pytest.approx(393.15)
    # each step corrects the growth of the step before, and the first begins from rest: the growth of 1.5 steps is outstanding
    assert 0.5 * (1 + 1e-3 * 92) <= height[-1] <= 0.5 * 1.1 * (1 + 1e-6)
    assert sim.info["penetration"] <= 0.008
    forces = np.abs(sim.contacts.force)
    mass = sim.bodies.mass[0]
    assert np.sum(forces[:, -1]) <= 1e-6 * mass * 0.05 / 0.05**2 + 1e-9  # it goes on at the rate that it has


def test_a_row_between_jaws_is_pressed():
    """F = K n L alpha dT: the jaw's spring takes what the row grows (here springs are the contacts of a Bonded wall)."""
    rubber = cn.Material("rubber", density=1000.0, conductivity=1.0, capacity=100.0, expansion=1e-5)
    scene = cn.Scene(2)
    n = 4
    bricks = cn.polygons(SQUARE, rubber, position=[[k + 0.5, 0.5] for k in range(n)])
    scene.add(bricks.with_(group="row", driven=("vy", "w")))
    stiff = 1e6
    steel = cn.Material("jaw", density=1000.0, conductivity=1.0, capacity=1.0)
    jaw = cn.polygons(SQUARE, steel, position=[[n + 0.5, 0.5]])

    def spring(t, sim):
        return [-stiff * (sim.bodies.position[n, 0] - (n + 0.5)), 0.0, 0.0]

    spring.needs_simulation = True
    scene.add(jaw.with_(group="jaw", driven=("vy", "w"), force=spring, damping=200.0))
    scene.add(cn.wall((0, 0), (1, 0), cn.Material("wall", density=1.0, conductivity=1.0, capacity=1.0)))
    scene.interact("*", "*", cn.Coulomb(mu=0.0))
    ramp = cn.Table([0.0, 1.0], [293.15, 393.15])
    scene.thermal(conductance=N.Constant(conductance=0.0), temperature={"row": ramp}, friction="none")
    sim = cn.Simulation(scene, 0.005, cn.NSCD(theta=1.0))
    for _ in range(300):
        sim.step()
    pushed = sim.bodies.position[n, 0] - (n + 0.5)
    assert pushed == pytest.approx(n * 1e-5 * 100, rel=0.02)


def test_growing_bodies_restart_to_the_same_bits(tmp_path):
    def make():
        scene = growing("polyhedron")
        scene.thermal(conductance=N.Constant(conductance=0.0), temperature={"grain": cn.Harmonic(30.0, 2.0, 320.0)})
        return cn.Simulation(scene, 0.02)

    one, other = make(), make()
    for _ in range(6):
        one.step()
    one.checkpoint(tmp_path / "c.h5")
    other.restore(tmp_path / "c.h5")
    for sim in (one, other):
        for _ in range(6):
            sim.step()
    assert one.bodies.position.tobytes() == other.bodies.position.tobytes()
