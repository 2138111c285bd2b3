"""Deformable bodies in scenes with rigid ones: a bar on a wall by two strategies, Hertz's line contact, meshes on meshes, grains
on a beam; the balance of energy, restart, matrices from elsewhere."""

import cairn as cn
import h5py
import numpy as np
import pytest
from cairn.model.elastic import ElasticBody
from report import judge
from test_elastic import grid

STEEL = cn.Material("steel", density=1000.0)
SHARP = cn.NLGS(tol=1e-10, max_iter=100000)


def at(points, axis, value):
    return np.flatnonzero(np.isclose(points[:, axis], value))


def scene_of(*sets, dim=2, gravity=None, mu=0.0):
    scene = cn.Scene(dim=dim, gravity=gravity)
    scene.add(*sets)
    scene.interact(STEEL, STEEL, cn.Coulomb(mu=mu))
    return scene


@pytest.mark.parametrize("strategy", [cn.NSCD(solver=SHARP), cn.Carpenter(solver=SHARP)], ids=["NSCD", "Carpenter"])
def test_bar_on_a_wall(strategy):
    """Both leave after 2 L/c, pushed with rho c v0 A, at the speed they came with (Doyen, Ern & Piperno 2011)."""
    young, length, speed, elements = 900.0, 10.0, 10.0, 50
    c = np.sqrt(young)
    points, cells = grid(2, (elements, 1), (length, 1.0))
    body = ElasticBody(points, cells, young=young, poisson=0.0, density=1.0, plane="stress", lumped=True)
    bar = cn.deformable(body, STEEL, contact=at(points, 0, 0.0), velocity=(-speed, 0.0))
    scene = scene_of(bar, cn.wall((0, 0), (1, 0), STEEL))
    transit = length / elements / c
    sim = cn.Simulation(scene, dt=transit / 2, strategy=strategy)
    rows = []
    while sim.time < 0.9:
        sim.step()
        rows.append((sim.time, np.sum(sim.contacts.impulse) / sim.dt))
    time, force = np.array(rows).T
    judge("end of contact", time[force > 1e-9][-1], 2 * length / c, 2 * transit, scale=1.0)
    judge("force", force[(time > 0.1) & (time < 0.55)].mean(), c * speed, 1e-3)
    energy = sim.energy
    mean = (body.M @ sim.meshes[0].velocity.ravel())[::2].sum() / length
    judge("speed restored", mean, speed, 3e-2)
    judge("energy lost", (energy["kinetic"] + energy["stored"]) / 500.0, 1.0, 3.0 / elements)
    assert abs(energy["closure"]) < 1e-12 * energy["in_play"]


def spaced(half, fine, cells, ratio=1.15):
    """Places from 0 to about half: equal at first, then growing."""
    x, step = [0.0], fine
    while x[-1] < half:
        step *= ratio if len(x) > cells else 1
        x.append(x[-1] + step)
    return np.array(x)


def test_hertz_line_contact():
    """A disk pressed into an elastic block: b^2 = 4 P R / (pi E*), p0 = 2 P / (pi b) (Johnson 1985); 8 cells over b."""
    young, poisson, radius, cells = 1e9, 0.3, 1.0, 8
    modulus, wanted = young / (1 - poisson**2), 0.02
    load = np.pi * modulus * wanted**2 / (4 * radius)
    depth = load / (np.pi * modulus) * (2 * np.log(4 / wanted) - 1)
    right = spaced(1.0, wanted / cells, 13)
    x, y = np.concatenate([-right[:0:-1], right]), -spaced(1.0, wanted / cells, cells)[::-1]
    places = np.stack(np.meshgrid(x, y, indexing="ij"), -1)
    number = np.arange(places[..., 0].size).reshape(places.shape[:2])
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], -1).reshape(-1, 4)
    top = number[np.abs(x) < 3 * wanted, -1]
    groups = {"base": number[:, 0]}
    body = ElasticBody(places.reshape(-1, 2), {"quad": quads}, young=young, poisson=poisson, density=1000.0, groups=groups)
    block = cn.deformable(body, STEEL, contact=top, fixed={"base": "xy"})
    disk = cn.disks([[0, radius]], radius, STEEL, driven=("vx", "vy", "w"), drive=(0, -depth / 30, 0))
    sim = cn.Simulation(scene_of(block, disk), dt=10.0, strategy=cn.NSCD(theta=1.0, solver=SHARP))
    for _ in range(3):
        assert sim.step()["status"] == "converged"
    force, where = np.abs(sim.contacts.impulse[:, 1]) / sim.dt, sim.contacts.point[:, 0]
    total = force.sum()
    expected = np.sqrt(4 * total * radius / (np.pi * modulus))
    judge("half width", 2 * np.sqrt(np.sum(force * where**2) / total), expected, 1e-2)
    judge("extent", where[force > 1e-9 * total].max(), expected, 5e-2)
    mesh = sim.meshes[0]
    judge("largest pressure", -body.nodal_stress(mesh.displacement)[:, 1].min(), 2 * total / (np.pi * expected), 3e-2)


@pytest.mark.parametrize("upper, gate", [(4, 1e-11), (6, 5e-2)])
def test_patch_across_contact(upper, gate):
    """Two blocks pressed on each other: exact where nodes face nodes; nodes on edges are known to fail else, by how much."""
    young, squeeze = 1e7, 1e-4
    parts = []
    for cells, low in ((4, 0.0), (upper, 0.5)):
        points, elements = grid(2, (cells, 2), (1.0, 0.5))
        points[:, 1] += low
        body = ElasticBody(points, elements, young=young, poisson=0.0, density=100.0, plane="stress", lumped=True)
        body.groups |= {"low": at(points, 1, low), "high": at(points, 1, low + 0.5), "left": at(points, 0, 0.0)}
        parts.append(body)
    press = {"high": {"y": lambda t: -squeeze / 0.3 if t < 0.35 else 0.0}}
    scene = scene_of(
        cn.deformable(parts[0], STEEL, edges="high", fixed={"low": "y", "left": "x"}, name="lower"),
        cn.deformable(parts[1], STEEL, contact="low", fixed={"left": "x"}, drive=press, name="upper"),
    )
    sim = cn.Simulation(scene, dt=0.1, strategy=cn.NSCD(theta=1.0, solver=cn.NLGS(tol=1e-13, max_iter=100000)))
    for _ in range(8):
        sim.step()
    for mesh in sim.meshes:
        judge("stress", mesh.stress["quad"][:, 1], np.full(len(mesh.stress["quad"]), -young * squeeze), gate)


def beam(strategy, **options):
    """A grain smaller than the cells falls on a beam on two supports."""
    points, cells = grid(2, (20, 4), (2.0, 0.2))
    bottom = at(points, 1, 0.0)
    groups = {"top": at(points, 1, 0.2), "left": bottom[points[bottom, 0] == 0], "right": bottom[points[bottom, 0] == 2]}
    body = ElasticBody(points, cells, young=1e8, poisson=0.2, density=500.0, plane="stress", groups=groups, **options)
    held = {"left": "xy", "right": "y"}
    grain = cn.disks([[1.013, 0.2201]], 0.02, STEEL, driven="w")
    scene = scene_of(cn.deformable(body, STEEL, edges="top", fixed=held), grain, gravity=(0, -9.81), mu=0.3)
    return cn.Simulation(scene, dt=1e-3, strategy=strategy)


@pytest.mark.parametrize("lumped", [True, False])
def test_energy_closes_with_a_beam(lumped):
    sim = beam(cn.NSCD(theta=0.5, solver=SHARP), lumped=lumped, rayleigh=(1.0, 1e-4))
    touched = 0
    for _ in range(150):
        sim.step()
        touched += bool(np.any(sim.contacts.impulse))
    energy = sim.energy
    print(f"closure {energy['closure'] / energy['in_play']:.2g}, steps in contact {touched}")
    assert touched > 0 and abs(energy["closure"]) < 1e-12 * energy["in_play"]
    assert energy["dissipated_bulk"] > 0 and abs(energy["dissipated_integrator"]) < 1e-9 * energy["in_play"]


def test_grain_rests_on_a_beam():
    """The beam carries the grain, and hands its weight to the supports."""
    sim = beam(cn.NSCD(theta=1.0, solver=SHARP), lumped=True, rayleigh=(0.0, 1e-2))
    sim.dt = 1e-2
    for _ in range(300):
        sim.step()
    weight = 9.81 * 1000 * np.pi * 0.02**2
    judge("weight", np.abs(sim.contacts.impulse[:, 1]).sum() / sim.dt, weight, 1e-3)


def test_stresses_are_in_the_file(tmp_path):
    sim = beam(cn.NSCD(solver=SHARP), lumped=True)
    sim.run(steps=10, output=tmp_path / "beam.vtkhdf", every=5, progress=False)
    with h5py.File(tmp_path / "beam.vtkhdf") as file:
        stored = np.array(file["VTKHDF/nodes/PointData/stress"])
    nodes = len(sim.nodes)
    expected = sim.meshes[0].body.nodal_stress(sim.meshes[0].displacement)
    judge("stress", stored[-nodes:], expected, 1e-6)
    assert np.abs(expected).max() > 0


def test_restart_to_the_same_bits(tmp_path):
    def made():
        return beam(cn.NSCD(solver=SHARP), lumped=True)

    one, two = made(), made()
    for _ in range(30):
        one.step()
    one.checkpoint(tmp_path / "half.h5")
    two.restore(tmp_path / "half.h5")
    for sim in (one, two):
        for _ in range(20):
            sim.step()
    assert np.array_equal(one.nodes.position, two.nodes.position)
    assert one.energy == two.energy


@pytest.mark.parametrize("simplices", [False, True])
def test_cube_on_a_plane_under_a_sphere(simplices):
    """HEX8, TET4: a cube carries a rigid sphere, the plane both weights."""
    points, cells = grid(3, (3, 3, 3), (1.0, 1.0, 1.0), simplices)
    body = ElasticBody(points, cells, young=1e7, poisson=0.3, density=1000.0, lumped=True, rayleigh=(0, 5e-3))
    both = np.concatenate([at(points, 2, 0.0), at(points, 2, 1.0)])
    ball = cn.spheres([[0.5, 0.5, 1.5]], 0.5, STEEL, driven=("vx", "vy", "wx", "wy", "wz"))
    scene = scene_of(cn.deformable(body, STEEL, contact=both), ball, cn.wall((0, 0, 0), (0, 0, 1), STEEL), dim=3,
                     gravity=(0, 0, -10.0), mu=0.5)  # fmt: skip
    sim = cn.Simulation(scene, dt=5e-3, strategy=cn.NSCD(theta=1.0, solver=cn.NLGS(tol=1e-8, max_iter=20000)))
    for _ in range(100):
        sim.step()
    low = sim.contacts.normal[:, 2] * np.where(sim.contacts.point[:, 2] < 0.5, 1, 0)
    carried = np.abs(sim.contacts.impulse[:, 2] * (low != 0)).sum() / sim.dt
    judge("weight", carried, 10 * (1000 + 1000 * np.pi / 6), 1e-3)


class Condensed:
    """Another code's solver of A x = b."""

    def __init__(self, body):
        self.body = body

    def __call__(self, h, theta, held):
        from scipy.sparse.linalg import splu

        b = self.body
        free = np.setdiff1d(np.arange(b.points.size), held)
        return splu((b.M + h * theta * b.C + (h * theta) ** 2 * b.K)[free][:, free].tocsc()).solve


@pytest.mark.parametrize("way", ["matrices", "solver"])
def test_body_of_another_code(way):
    """M, C and K given, or K and C as operators with a solver: the same motion as that of the built-in body."""
    from scipy.sparse.linalg import aslinearoperator

    points, cells = grid(2, (6, 2), (3.0, 1.0))
    own = ElasticBody(points, cells, young=1e5, poisson=0.3, density=100.0, rayleigh=(0.1, 1e-3))
    given = (own.K, own.C) if way == "matrices" else (aslinearoperator(own.K), aslinearoperator(own.C))
    solver = None if way == "matrices" else Condensed(own)
    other = cn.LinearBody(points, own.M, given[0], damping=given[1], edges=own.boundary_edges(), solver=solver)
    ends = []
    for body in (own, other):
        falling = cn.deformable(body, STEEL, contact=at(points, 1, 0.0), velocity=(0.5, -1.0))
        scene = scene_of(falling, cn.wall((0, 0), (0, 1), STEEL), gravity=(0, -10.0), mu=0.3)
        sim = cn.Simulation(scene, dt=2e-3, strategy=cn.NSCD(solver=SHARP))
        for _ in range(50):
            sim.step()
        ends.append(sim.meshes[0].displacement)
    judge("displacement", ends[1], ends[0], 1e-9)


def test_friction_where_tangents_are_held():
    """A node dragged sideways over a floor feels mu N, although its tangent cannot move."""
    points, cells = grid(2, (1, 1), (1.0, 1.0))
    body = ElasticBody(points, cells, young=1e6, poisson=0.0, density=100.0, plane="stress", lumped=True)
    body.groups |= {"all": np.arange(4), "low": at(points, 1, 0.0), "high": at(points, 1, 1.0)}
    block = cn.deformable(body, STEEL, contact="low", drive={"all": {"x": 0.1}, "high": {"y": -1e-3}})
    scene = scene_of(block, cn.wall((0, 0), (0, 1), STEEL), mu=0.3)
    sim = cn.Simulation(scene, dt=1e-2, strategy=cn.NSCD(theta=1.0, solver=SHARP))
    for _ in range(20):
        assert sim.step()["status"] == "converged"
    force = sim.contacts.impulse.sum(axis=0) / sim.dt
    assert force[1] > 0
    judge("friction", force[0], -0.3 * force[1], 1e-8)


def test_what_is_wrong_is_named():
    points, cells = grid(2, (2, 1), (2.0, 1.0))
    body = ElasticBody(points, cells, young=1e5, poisson=0.3, density=100.0, groups={"top": at(points, 1, 1.0)})
    with pytest.raises(ValueError, match="there is no group 'roof' in the mesh; there are top"):
        cn.deformable(body, STEEL, contact="roof")
    with pytest.raises(ValueError, match="node 0 has mass 0 kg"):
        cn.deformable(ElasticBody(points, cells, young=1e5, poisson=0.3), STEEL, contact=[0])
    with pytest.raises(ValueError, match="stiffness has shape"):
        cn.LinearBody(points, body.M, body.K[:4, :4])
    scene = scene_of(cn.deformable(body, STEEL, contact="top"), cn.wall((0, 0), (0, 1), STEEL))
    smooth = cn.Scene(dim=2)
    smooth.add(cn.deformable(body, STEEL, contact="top"))
    smooth.interact(STEEL, STEEL, cn.LinearSpring(stiffness=1e5))
    with pytest.raises(ValueError, match="SmoothDEM moves rigid bodies alone"):
        cn.Simulation(smooth, dt=1e-5, strategy=cn.SmoothDEM())
    with pytest.raises(ValueError, match="beyond the stable step .* of the mesh 'mesh'"):
        cn.Simulation(scene, dt=1.0, strategy=cn.Carpenter())
    sim = cn.Simulation(scene, dt=1.0, strategy=cn.NSCD())
    with pytest.raises(ValueError, match="of the mesh 'mesh' would stay of"):
        sim.remove([0])


def square(corner, name="mesh"):
    """A square of side 1 m of four cells, its nodes candidates, its edges antagonists."""
    points, cells = grid(2, (2, 2), (1.0, 1.0))
    body = ElasticBody(points + corner, cells, young=1e7, poisson=0.2, density=1000.0)
    return cn.deformable(body, STEEL, contact=np.arange(9), edges=body.boundary_edges(), name=name)


def test_meshes_of_one_name_meet():
    """Contact is excluded only within the same mesh: meshes of equal names touch like meshes of different names."""
    speeds = []
    for other in ("mesh", "upper"):
        scene = scene_of(square((0.0, 0.0)), square((0.3, 1.0), other), cn.wall((0, 0), (0, 1), STEEL), gravity=(0.0, -9.81))
        sim = cn.Simulation(scene, dt=1e-3, strategy=cn.NSCD(solver=SHARP))
        for _ in range(100):
            assert sim.step()["status"] == "converged"
        assert sim.contacts.gap.min() > -1e-4
        assert sim.meshes[1].displacement[:, 1].min() > -0.01  # free fall: 0.05 m
        speeds.append(sim.meshes[1].velocity)
    assert np.array_equal(*speeds)


def test_a_mesh_does_not_touch_itself():
    """Not even where a rule names its nodes and its edges."""
    scene = scene_of(square((0.0, 0.0)))
    scene.interact("mesh", "mesh edges", cn.Coulomb(mu=0.1))
    sim = cn.Simulation(scene, dt=1e-3)
    assert sim.step()["contacts"] == 0


def test_triangles_that_share_corners():
    """Bodies of one element whose corners all meet, nodes against edges: more contacts than can be told apart, and no speed from
    nowhere."""
    points, sides = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]), np.array([[0, 1], [1, 2], [2, 0]])
    sets = []
    for at in np.ndindex(2, 2):
        for half in ([0, 1, 2], [0, 2, 3]):
            cells = {"triangle": np.array([[0, 1, 2]])}
            body = ElasticBody((points + at)[half], cells, young=1e7, poisson=0.2, density=2000.0)
            sets.append(cn.deformable(body, STEEL, contact=[0, 1, 2], edges=sides))
    scene = scene_of(*sets, cn.wall((0, 0), (0, 1), STEEL), gravity=(0.0, -9.81), mu=0.5)
    sim = cn.Simulation(scene, dt=5e-3, strategy=cn.NSCD(solver=cn.Auto(tol=1e-6)), overlap="ignore")
    for _ in range(8):
        assert sim.step()["status"] == "converged"
        assert np.abs(sim.raw.nodes.velocity).max() < 2 * 9.81 * sim.time  # a corner swings beyond the fall of its triangle
    assert abs(sim.energy["closure"]) < 1e-10 * sim.energy["in_play"]


def test_the_default_solver_looks_at_rigid_bodies_alone():
    """Rigid bodies that represent points and edges of a mesh have negligible mass."""
    disks = cn.disks([[5.0, 5.0], [7.0, 5.0]], 0.5, STEEL)
    sim = cn.Simulation(scene_of(square((0.0, 0.0)), disks), dt=1e-3)
    assert type(sim.strategy.solver) is cn.NLGS
