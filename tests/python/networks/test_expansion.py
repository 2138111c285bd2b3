"""Thermal expansion: solids that swell, yield and buckle; rigid bodies of every shape that grow, and that bend."""

import cairn as cn
import numpy as np
import pytest

N = cn.networks
E, ALPHA = 200e9, 1.2e-5
STEEL = cn.Material("steel", density=7800.0, conductivity=50.0, capacity=500.0, expansion=ALPHA)


def quads(nx, ny, lx, ly):
    points = np.stack(np.meshgrid(np.linspace(0, lx, nx + 1), np.linspace(0, ly, ny + 1), indexing="ij"), -1).reshape(-1, 2)
    k = np.arange(len(points)).reshape(nx + 1, ny + 1)
    cells = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], -1).reshape(-1, 4)
    return points, {"quad": cells}, {"left": k[0], "right": k[-1], "bottom": k[:, 0], "all": k.ravel()}


def eights(nx, lx, ly):
    """One row of quads of eight nodes."""
    x = np.linspace(0, lx, 2 * nx + 1)
    points = np.concatenate([np.c_[x, 0 * x], np.c_[x, 0 * x + ly], np.c_[x[::2], 0 * x[::2] + ly / 2]])
    low, high, mid = np.arange(len(x)), len(x) + np.arange(len(x)), 2 * len(x) + np.arange(nx + 1)
    k = 2 * np.arange(nx)
    cells = np.stack([low[k], low[k + 2], high[k + 2], high[k], low[k + 1], mid[1:], high[k + 1], mid[:-1]], -1)
    ends = {"left": [low[0], high[0], mid[0]], "right": [low[-1], high[-1], mid[-1]]}
    return points, {"quad8": cells}, {**ends, "middle": [low[nx], high[nx]], "all": np.arange(len(points))}


def heated(body, temperature, fixed, *, dt=1.0, strategy=None, dim=2, **options):
    scene = cn.Scene(dim)
    scene.add(cn.deformable(body, STEEL, fixed=fixed, name="part", **options))
    scene.thermal(temperature={"part.all": temperature}, friction="none", initial=293.15, steady=True)
    return cn.Simulation(scene, dt, strategy or cn.NSCD(theta=1.0))


# ---------------------------------------------------------------------- solids


@pytest.mark.parametrize("kinematics", ["small", "corotational", "total_lagrangian", "logarithmic"])
def test_solids_swell_freely_without_a_stress(kinematics):
    points, cells, groups = quads(3, 2, 0.3, 0.2)
    body = cn.SolidBody(points, cells, cn.IsotropicElastic(young=E, poisson=0.3), density=7800.0, groups=groups,
                        kinematics=kinematics, plane="stress", rayleigh=(3e3, 0.0))  # fmt: skip
    sim = heated(body, 393.15, {"left": "x", "bottom": "y"})
    for _ in range(30):
        sim.step()
    mesh = sim.meshes[0]
    assert mesh.displacement == pytest.approx(1.2e-3 * points, abs=1e-11)
    assert np.abs(mesh.stress["quad"]).max() <= 1e-7 * E * 1.2e-3


@pytest.mark.parametrize(("kinematics", "inside"), [("small", 1.2e-3), ("logarithmic", np.log(1.0012))])
def test_solids_that_are_held_are_pressed(kinematics, inside):
    """Plane strain, all held: 600 MPa at 100 K, and at large strains the law's own stress of ln(1 + a dT)."""
    points, cells, groups = quads(2, 2, 0.2, 0.2)
    body = cn.SolidBody(points, cells, cn.IsotropicElastic(young=E, poisson=0.3), density=7800.0, groups=groups,
                        kinematics=kinematics)  # fmt: skip
    sim = heated(body, 393.15, {"all": "xy"})
    sim.step()
    sim.step()
    true = -E * inside / 0.4
    if kinematics != "small":
        true *= 1.0012**3  # of the law's stress by the volume there is now, J of Fe is 1.0012^-3
    assert sim.meshes[0].stress["quad"][:, :3] == pytest.approx(true, rel=1e-9)


def test_a_bar_that_yields_by_heat_and_is_pulled_when_it_cools():
    """Held along x, 180 K: yields at 104.2 K, then by E H/(E + H); the plastic strain is left as a tension when it has cooled."""
    yields, hardening = 250e6, 10e9
    points, cells, groups = quads(2, 1, 0.2, 0.1)
    metal = cn.J2Plasticity(young=E, poisson=0.3, yield_stress=yields, isotropic=hardening)
    body = cn.SolidBody(points, cells, metal, density=7800.0, groups=groups, plane="stress", rayleigh=(3e3, 0.0))
    times = np.array([0.0, 100.0, 200.0])
    warm = cn.Table(times, 293.15 + np.array([0.0, 180.0, 10.0]))
    sim = heated(body, warm, {"left": "x", "right": "x", "bottom": "y"})
    seen = {}
    for k in range(1, 211):
        sim.step()
        seen[k] = sim.meshes[0].stress["quad"][:, 0].mean(), sim.report["status"]
    assert all(status == "converged" for _, status in seen.values())
    # the step sees the temperatures of its begin
    assert seen[51][0] == pytest.approx(-E * ALPHA * 90, rel=1e-6)
    plastic = (E * ALPHA * 180 - yields) / (E + hardening)
    assert seen[101][0] == pytest.approx(-(yields + hardening * plastic), rel=1e-6)
    left = plastic - ALPHA * 10
    assert seen[210][0] == pytest.approx(E * left, rel=1e-6)
    energy = sim.info["energy"]
    spent = (yields + hardening * plastic / 2) * plastic * 0.2 * 0.1
    assert energy["dissipated_material"] + energy["stored"] == pytest.approx(
        spent + 0.5 * E * left**2 * 0.2 * 0.1, rel=2e-3
    )  # hardening is stored or dissipated: the sum is the work put in


@pytest.mark.parametrize(("ends", "critical"), [("clamped", 109.662), ("pinned", 27.4156)])
def test_a_bar_between_walls_buckles_at_its_temperature(ends, critical):
    """A bar of 1 m, 20 mm by 20 mm: the inverse of its deflection under a small force falls to nothing there (Southwell)."""
    points, cells, groups = eights(16, 1.0, 0.02)
    body = cn.SolidBody(points, cells, cn.SaintVenantKirchhoff(young=E, poisson=0.0), density=7800.0, groups=groups,
                        plane="stress", thickness=0.02, rayleigh=(30.0, 0.0))  # fmt: skip
    fixed = {"left": "xy", "right": "xy"}
    if ends == "pinned":  # the middles of both ends alone are held
        body.groups["left"], body.groups["right"] = body.groups["left"][2:], body.groups["right"][2:]
    deflections, rises = [], critical * np.array([0.90, 0.95])
    for rise in rises:
        sim = heated(body, 293.15 + rise, fixed, dt=10.0, force={"middle": (0.0, -1e-3)})
        for _ in range(12):
            sim.step()
        deflections.append(sim.meshes[0].displacement[groups["middle"], 1].mean())
    stiffness = 1 / np.abs(deflections)
    found = rises[1] + (rises[1] - rises[0]) * stiffness[1] / (stiffness[0] - stiffness[1])
    assert found == pytest.approx(critical, rel=0.01)


def test_a_plate_whose_edges_cannot_turn_under_a_gradient():
    """E a dT / 2 / (1 - nu) at its faces, here of the middles of its layers."""
    n, thick = 8, 0.02
    x = np.stack(np.meshgrid([0, 0.1], [0, 0.1], np.linspace(0, thick, n + 1), indexing="ij"), -1).reshape(-1, 3)
    k = np.arange(len(x)).reshape(2, 2, n + 1)
    low, high = k[:, :, :-1], k[:, :, 1:]
    ring = [(0, 0), (1, 0), (1, 1), (0, 1)]
    cells = np.stack([part[i, j] for part in (low, high) for i, j in ring], -1)
    groups = {"all": k.ravel(), "bottom": k[:, :, 0].ravel()}
    body = cn.ElasticBody(x, {"hexahedron": cells}, young=E, poisson=0.3, density=7800.0, groups=groups, rayleigh=(3e3, 0.0))
    scene = cn.Scene(3)
    ids = scene.add(cn.deformable(body, STEEL, fixed={"all": "xy", "bottom": "z"}, name="plate"))[: len(x)]
    rise = 100 * (x[:, 2] / thick - 0.5)
    scene.thermal(temperature=[(ids, 293.15 + rise)], friction="none", initial=293.15, steady=True)
    sim = cn.Simulation(scene, 1.0, cn.NSCD(theta=1.0))
    for _ in range(30):
        sim.step()
    middle = (np.arange(n) + 0.5) / n - 0.5
    stress = sim.meshes[0].stress["hexahedron"]
    assert stress[:, 0] == pytest.approx(-E * ALPHA * 100 * middle / 0.7, rel=1e-9)
    assert np.abs(stress[:, 2]).max() <= 1e-8 * E * ALPHA * 100


# ---------------------------------------------------------------------- rigid bodies that grow

RUBBER = cn.Material("rubber", density=1000.0, conductivity=1.0, capacity=100.0, expansion=1e-3)
COLD = cn.Material("cold", density=1000.0, conductivity=1.0, capacity=100.0)
RAMP = cn.Table([0.0, 1.0], [293.15, 393.15])


def ramped(scene, names, steps=20, **options):
    scene.thermal(conductance=N.Constant(conductance=0.0), temperature=dict.fromkeys(names, RAMP), friction="none", **options)
    sim = cn.Simulation(scene, 0.05, cn.NSCD(margin=0.5))
    for _ in range(steps):
        sim.step()
    return sim


def cube(left):
    corner = np.stack(np.meshgrid([left, left + 1.0], [-0.5, 0.5], [-0.5, 0.5], indexing="ij"), -1).reshape(-1, 3)
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return corner, faces


def made(shape):
    """A body on a floor, and how far its centre is above it."""
    half = 0.5
    if shape == "clump":
        return 3, 0.5, cn.clumps([[0, 0, 0.5]], [[-0.4, 0, 0], [0.4, 0, 0]], [0.5, 0.5], 800.0, [80.0, 120.0, 120.0], RUBBER)
    if shape == "two discs":
        return 2, 0.5, cn.clumps([[0, 0.5]], [[-0.4, 0], [0.4, 0]], [0.5, 0.5], 800.0, [120.0], RUBBER)
    if shape == "boxes in one":
        cubes = [cube(-1.0), cube(0.0)]
        return 3, half, cn.polyhedra([cubes], RUBBER, position=[[0, 0, half]])
    square = [[-half, -half], [half, -half], [half, half], [-half, half]]
    left, right = (np.add(square, [shift, 0.0]) for shift in (-half, half))
    return 2, half, cn.polygons([[left, right]], RUBBER, position=[[0, half]])


@pytest.mark.parametrize("shape", ["clump", "two discs", "boxes in one", "squares in one"])
def test_bodies_of_several_parts_grow_without_a_force(shape):
    dim, high, body = made(shape)
    scene = cn.Scene(dim)
    scene.add(body.with_(group="grain"))
    up = np.eye(dim)[-1]
    scene.add(cn.wall(0 * up, up, COLD, group="floor"))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = ramped(scene, ["grain"])
    start = float(body.position[0, -1])
    assert start + 0.092 * high <= sim.bodies.position[0, -1] <= start + 0.1 * high * (1 + 1e-6)
    parts = sim.contacts.point
    assert len(parts) >= 2 and np.ptp(parts[:, 0]) == pytest.approx((2.0 if "in one" in shape else 0.8) * 1.1, rel=0.01)
    forces = np.abs(sim.contacts.force)
    mass = sim.bodies.mass[0]
    assert np.sum(forces[:, -1]) <= 1e-6 * mass * 0.05 / 0.05**2 + 1e-9


@pytest.mark.parametrize("shape", ["ring", "tube", "segment"])
def test_what_holds_others_grows(shape):
    """A heated ring or tube does not move its content; a bar gets longer, with larger round ends."""
    if shape == "segment":
        scene = cn.Scene(2)
        scene.add(cn.disks([[1.5, 0.0]], 0.2, COLD, group="grain"))
        scene.add(cn.segment((-1.0, 0.0), (1.0, 0.0), RUBBER, radius=0.1, group="shell"))
        begin, end = 1.5 - 0.2 - 1.1, 1.5 - 0.2 - 1.1 * 1.1
    else:
        scene = cn.Scene(2 if shape == "ring" else 3)
        place = np.zeros((1, scene.dim))
        place[0, 0] = 0.6
        scene.add(cn.disks(place, 0.3, COLD, group="grain") if scene.dim == 2 else cn.spheres(place, 0.3, COLD, group="grain"))
        scene.add(cn.ring((0, 0), 1.0, RUBBER, group="shell") if scene.dim == 2 else
                  cn.tube((0, 0, 0), (0, 0, 1), 1.0, RUBBER, group="shell"))  # fmt: skip
        begin, end = 0.1, 0.2
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = ramped(scene, ["shell"], steps=1)
    assert sim.contacts.gap[0] == pytest.approx(begin, rel=1e-9)
    for _ in range(20):
        sim.step()
    assert sim.contacts.gap[0] == pytest.approx(end, rel=1e-9)
    assert not np.any(sim.contacts.force) and not np.any(sim.bodies.velocity[0])


# ---------------------------------------------------------------------- rigid bodies that bend

FIRE = cn.Material("brick", density=2000.0, conductivity=1.0, capacity=1000.0, expansion=1e-5)


def field(x, rise, gradient):
    """Deformed positions of points x (n, dim)."""
    along = x @ gradient
    return x + 1e-5 * (rise * x + along[:, None] * x - np.outer(np.sum(x**2, axis=1), gradient) / 2)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_brick_bends_by_the_field_of_its_temperature_and_straightens(dim):
    scene = cn.Scene(dim)
    if dim == 2:
        brick = cn.polygons([[-0.3, -0.1], [0.3, -0.1], [0.3, 0.1], [-0.3, 0.1]], FIRE, position=[[1.0, 2.0]])
        top = np.array([200.0, 3000.0])
    else:
        brick = cn.boxes([[1.0, 2.0, 3.0]], [0.6, 0.2, 0.3], FIRE)
        top = np.array([200.0, 3000.0, -500.0])
    scene.add(brick.with_(group="brick"))
    times = [0.0, 1.0, 2.0]

    def gradient(t):
        return top * np.interp(t, times, [0, 1, 0])

    warm = cn.Table(times, 293.15 + np.array([0.0, 400.0, 0.0]))
    scene.thermal(conductance=N.Constant(conductance=0.0), temperature={"brick": warm}, gradient={"brick": gradient})
    sim = cn.Simulation(scene, 0.125)
    start = np.array(sim.contactors.hulls["vertex"]).reshape(-1, dim)
    for _ in range(8):
        sim.step()
    now = np.array(sim.contactors.hulls["vertex"]).reshape(-1, dim)
    assert now == pytest.approx(field(start, 400.0, top), rel=1e-14)
    for _ in range(8):
        sim.step()
    now = np.array(sim.contactors.hulls["vertex"]).reshape(-1, dim)
    assert now == pytest.approx(start, rel=1e-14)
    assert sim.bodies.position[0] == pytest.approx(brick.position[0], rel=1e-15)


def column(n=8, high=0.2, wide=0.1, times=None, rise=200.0):
    """Bricks on a floor under their weight, hot on their left: a column that bows to the right."""
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    shape = np.array([[-wide, -high], [wide, -high], [wide, high], [-wide, high]]) / 2
    bricks = cn.polygons(shape, FIRE, position=[[0.0, high * (k + 0.5)] for k in range(n)])
    scene.add(bricks.with_(group="bricks"))
    scene.add(cn.wall((0, 0), (0, 1), cn.Material("floor", density=1.0, conductivity=1.0, capacity=1.0)))
    scene.interact("*", "*", cn.Coulomb(mu=0.8))
    top = -rise / wide

    def gradient(t):
        return np.array([top * np.interp(t, [0.0, 1.0, 2.0], [0, 1, 0] if times is None else times), 0.0])

    scene.thermal(conductance=N.Constant(conductance=0.0), gradient={"bricks": gradient}, initial=293.15, friction="none")
    return scene


def test_a_column_of_bricks_bows_as_one_bar_would():
    """Curvature a dT/t, by whose circle the top goes aside; when it is cold again the column is straight."""
    n, high, wide = 8, 0.2, 0.1
    sim = cn.Simulation(column(), 0.01, cn.NSCD(theta=1.0, solver=cn.NLGS(tol=1e-9, max_iter=20000)))
    for _ in range(101):
        sim.step()
    curvature = 1e-5 * 200.0 / wide
    heights = high * (np.arange(n) + 0.5)
    # the lowest stands on its bed, which is bent against the floor
    aside = sim.bodies.position[:n, 0]
    bent = curvature / 2 * (heights**2 - heights[0] ** 2) - curvature * high / 2 * (heights - heights[0])
    assert np.ptp(aside) > 0.5 * np.max(np.abs(bent))
    for _ in range(110):
        sim.step()
    assert np.abs(sim.bodies.position[:n, 0]).max() <= 0.02 * np.max(np.abs(bent))


def test_bent_bricks_restart_to_the_same_bits(tmp_path):
    def make():
        return cn.Simulation(column(4), 0.02)

    one, other = make(), make()
    for _ in range(20):
        one.step()
    one.checkpoint(tmp_path / "c.h5")
    other.restore(tmp_path / "c.h5")
    for sim in (one, other):
        for _ in range(20):
            sim.step()
    assert one.bodies.position.tobytes() == other.bodies.position.tobytes()
    assert one.contactors.hulls["vertex"].tobytes() == other.contactors.hulls["vertex"].tobytes()


def test_what_cannot_bend_is_refused():
    scene = cn.Scene(2)
    scene.add(cn.disks([[0, 0]], 0.5, FIRE, group="disk"))
    scene.thermal(conductance=N.Constant(conductance=0.0), gradient={"disk": (1.0, 0.0)})
    with pytest.raises(ValueError, match="give polygons and polyhedra alone"):
        cn.Simulation(scene, 0.1)
    scene = cn.Scene(2)
    scene.add(cn.polygons([[0, 0], [1, 0], [0, 1]], COLD, group="plate"))
    scene.thermal(conductance=N.Constant(conductance=0.0), gradient={"plate": (1.0, 0.0)})
    with pytest.raises(ValueError, match="has no expansion"):
        cn.Simulation(scene, 0.1)


@pytest.mark.parametrize("speed", [1.0, 5.0])
def test_the_first_contact_of_what_grows(speed):
    """Two disks that grow meet for the first time in the run: growth read statuses for places among contacts of before."""
    hot = cn.Material("hot", density=2000.0, conductivity=1.0, capacity=10.0, expansion=3e-4)
    scene = cn.Scene(2)
    velocity = np.array([[speed, 0, 0], [-speed, 0, 0]])
    scene.add(cn.disks([[0.0, 0.0], [0.23, 0.0]], 0.1, hot, group="hot", velocity=velocity))
    scene.interact("*", "*", cn.Coulomb(mu=0.4))
    scene.thermal(conductance=cn.networks.Constant(conductance=1e3), friction="none",
                  temperature={"hot": cn.Table([0, 1.0], [293.15, 693.15])})
    sim = cn.Simulation(scene, 1e-3)
    touched = 0
    for _ in range(30):
        touched += sim.step()["contacts"]
    energy = sim.info["energy"]
    assert touched > 0
    assert abs(energy["closure"]) < 1e-9 * energy["in_play"]
