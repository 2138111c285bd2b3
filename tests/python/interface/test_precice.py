"""A participant of preCICE against a partner in the same process: explicit and implicit coupling, repeated windows, substeps."""

import sys

import cairn as cn
import dummy_precice
import numpy as np
import pytest

ROCK = cn.Material("rock", density=1000.0)
EULER = cn.NSCD(theta=1.0)


@pytest.fixture
def partner(monkeypatch, tmp_path):
    """A class of participants to be set up, which stands for preCICE's, and a configuration file."""
    kind = type("Participant", (dummy_precice.Participant,), {})
    module = type(sys)("precice")
    module.Participant = kind
    monkeypatch.setitem(sys.modules, "precice", module)
    (tmp_path / "precice-config.xml").write_text("<precice-configuration/>", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return kind


def disk(dim=2, dt=0.01, strategy=EULER, **options):
    scene = cn.Scene(dim)
    make = cn.disks if dim == 2 else cn.spheres
    ids = scene.add(make([(0.0,) * dim], 0.5, ROCK, **options))
    return cn.Simulation(scene, dt, strategy), ids


def spring(k):
    return staticmethod(lambda t, written: {"Force": -k * written.get("Displacement", np.zeros((1, 2)))})


@pytest.mark.parametrize("implicit", [False, True])
def test_a_mass_on_the_spring_of_a_partner(partner, implicit):
    sim, ids = disk(velocity=(1.0, 0.0))
    mass, h, x, v = float(sim.bodies.mass[0]), 0.01, 0.0, 1.0
    k = 40.0 * mass
    partner.partner, partner.implicit, partner.windows = spring(k), implicit, 30
    coupling = cn.precice.Coupling("Grains", "precice-config.xml", sim)
    coupling.bodies("Grains-Mesh", ids, read={"Force": "force"}, write={"Displacement": "displacement", "Speed": "velocity"})
    assert coupling.run() == 30 and sim.time == pytest.approx(0.3)
    for _ in range(30):
        v = (v - h * k / mass * x) / (1 + h * h * k / mass) if implicit else v - h * k / mass * x
        x += h * v
    assert sim.bodies.position[0, 0] == pytest.approx(x, rel=1e-8) and sim.bodies.velocity[0, 0] == pytest.approx(v, rel=1e-8)
    assert (coupling.repeated > 30) == implicit and partner.log == ["initialize", "finalize"]


def test_repeated_windows_with_substeps_find_the_force_at_their_end(partner):
    sim, ids = disk(dt=0.004, velocity=(1.0, 0.0))  # 2.5 steps in a window: the last is shorter
    mass, x, v = float(sim.bodies.mass[0]), 0.0, 1.0
    k = 40.0 * mass
    partner.partner, partner.implicit, partner.windows = spring(k), True, 8
    coupling = cn.precice.Coupling("Grains", "precice-config.xml", sim)
    coupling.bodies("Mesh", ids, read={"Force": "force"}, write={"Displacement": "displacement"})
    rows = []
    coupling.run(
        output="coupled.vtkhdf", every=4, callback=lambda s: rows.append(s.time), probes={"x": lambda s: s.bodies.position[0, 0]}
    )
    for _ in range(8):
        force = 0.0
        for _ in range(200):
            y, w = x, v
            for h in (0.004, 0.004, 0.002):
                w += h * force / mass
                y += h * w
            force = -k * y
        x, v = y, w
    assert sim.bodies.position[0, 0] == pytest.approx(x, rel=1e-8)
    assert np.allclose(rows, 0.01 * np.arange(1, 9))
    run = cn.load("coupled.vtkhdf")
    assert np.allclose(run.times, [0, 0.04, 0.08]) and np.allclose(run.history["time"], rows) and "x" in run.history


def test_repeated_windows_of_a_pile_leave_no_trace(partner):
    """A partner that answers in three iterations with nothing: the bits are those of a run alone."""

    def pile():
        scene = cn.Scene(2, gravity=(0.0, -9.81))
        ids = scene.add(cn.disks([(0.9 * (k % 3) + 0.1 * (k // 3), 0.5 + 0.9 * (k // 3)) for k in range(9)], 0.45, ROCK))
        scene.add(cn.wall((0, 0), (0, 1), ROCK))
        scene.interact("*", "*", cn.Coulomb(mu=0.4))
        return cn.Simulation(scene, 2e-3), ids

    alone, _ = pile()
    alone.run(steps=50, progress=False)
    sim, ids = pile()
    count = [0]

    def answer(t, written):
        count[0] += 1
        return {"Force": np.full((9, 2), 1.0 if count[0] % 3 == 1 else 0.0)}

    partner.partner, partner.implicit, partner.window, partner.windows = staticmethod(answer), True, 2e-3, 50
    coupling = cn.precice.Coupling("Grains", "precice-config.xml", sim)
    coupling.bodies("Mesh", ids, write={"Displacement": "displacement"})
    coupling.run()
    assert coupling.repeated >= 50
    assert np.array_equal(sim.bodies.position, alone.bodies.position) and np.array_equal(
        sim.bodies.velocity, alone.bodies.velocity
    )


@pytest.mark.parametrize("dim", [2, 3])
def test_forces_at_points_turn_bodies_and_points_are_carried_along(partner, dim):
    sim, ids = disk(dim)
    points = np.zeros((2, dim))
    points[0, 0], points[1, 1] = 0.5, 0.5
    force = np.zeros((2, dim))
    force[0, 1] = 100.0  # at (0.5, 0): moment 50 N m about z
    partner.partner, partner.dimensions, partner.windows = staticmethod(lambda t, w: {"Force": force}), dim, 5
    coupling = cn.precice.Coupling("Body", "precice-config.xml", sim)
    coupling.bodies("Mesh", ids, points=points, read={"Force": "force"},
                    write={"Displacement": "displacement", "Speed": "velocity", "Place": "position"})  # fmt: skip
    coupling.run()
    mass, inertia = float(sim.bodies.mass[0]), float(np.ravel(sim.bodies.inertia)[-1])
    assert sim.bodies.velocity[0, 1] == pytest.approx(100.0 / mass * 0.05, rel=1e-9)
    assert sim.bodies.velocity[0, -1] == pytest.approx(50.0 / inertia * 0.05, rel=1e-3), "the arm turns a little"
    part = coupling._parts[0]
    away = part.places() - sim.bodies.position[0]
    assert np.allclose(np.linalg.norm(away, axis=1), 0.5) and away[0, 1] > 0
    spin, written = sim.bodies.velocity[0, -1], coupling._participant.written
    assert np.allclose(written["Speed"][0, :2], sim.bodies.velocity[0, :2] + spin * np.array([-away[0, 1], away[0, 0]]))
    assert np.allclose(written["Place"] - points, written["Displacement"])


def test_forces_on_nodes_of_a_mesh_are_those_of_its_force(partner):
    x, y = np.meshgrid(np.linspace(0, 1, 5), np.linspace(0, 0.2, 3), indexing="ij")
    k = np.arange(15).reshape(5, 3)
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], -1).reshape(-1, 4)

    def beam(**options):
        body = cn.ElasticBody(np.c_[x.ravel(), y.ravel()], {"quad": quads}, young=1e7, poisson=0.3, density=1000.0,
                              groups={"clamp": k[0], "tip": k[-1]})  # fmt: skip
        scene = cn.Scene(2)
        scene.add(cn.deformable(body, ROCK, fixed={"clamp": "xy"}, **options))
        return cn.Simulation(scene, 0.01, EULER)

    alone = beam(force={"tip": (0.0, -300.0)})
    alone.run(steps=20, progress=False)
    sim = beam()
    partner.partner, partner.windows = staticmethod(lambda t, w: {"Force": np.tile([0.0, -100.0], (3, 1))}), 20
    coupling = cn.precice.Coupling("Beam", "precice-config.xml", sim)
    coupling.mesh("Mesh", 0, "tip", read={"Force": "force"}, write={"Displacement": "displacement"})
    coupling.run()
    assert np.allclose(sim.meshes[0].displacement, alone.meshes[0].displacement, rtol=1e-9, atol=0)
    assert np.allclose(coupling._participant.written["Displacement"], sim.meshes[0].displacement[k[-1]])


@pytest.mark.parametrize("dim", [2, 3])
def test_sides_of_a_coupled_mesh_are_given_where_a_mapping_asks(partner, dim):
    x = np.array(np.meshgrid(*[[0.0, 1.0, 2.0]] * dim, indexing="ij")).reshape(dim, -1).T
    k = np.arange(3**dim).reshape((3,) * dim)
    if dim == 2:
        cells = {"quad": np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], -1).reshape(-1, 4)}
    else:
        low = [k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]]
        cells = {"hexahedron": np.stack([a[..., :-1] for a in low] + [a[..., 1:] for a in low], -1).reshape(-1, 8)}
    groups = {"foot": k[..., 0].ravel(), "top": k[..., 2].ravel()}
    body = cn.ElasticBody(x, cells, young=1e7, poisson=0.3, density=1e3, groups=groups)
    scene = cn.Scene(dim)
    scene.add(cn.deformable(body, ROCK, fixed={"foot": "xyz"[:dim]}))
    partner.partner, partner.windows, partner.connected, partner.dimensions = staticmethod(lambda t, w: {}), 1, True, dim
    coupling = cn.precice.Coupling("Block", "precice-config.xml", cn.Simulation(scene, 0.01, EULER))
    coupling.mesh("Mesh", 0, "top", write={"Displacement": "displacement"})
    coupling.run()
    sides = coupling._participant.sides["Mesh"]
    placed = coupling._participant.meshes["Mesh"][sides]
    assert sides.shape == ((2, 2) if dim == 2 else (4, 4)) and np.all(placed[..., -1] == 2.0)
    assert np.allclose(np.ptp(placed[..., :-1], axis=1), 1.0), "each side is that of one cell"


def test_a_run_that_fails_is_finalized(partner):
    sim, ids = disk()
    partner.partner = staticmethod(lambda t, w: {})
    coupling = cn.precice.Coupling("A", "precice-config.xml", sim)
    coupling.bodies("Mesh", ids, write={"Place": "position"})
    with pytest.raises(ZeroDivisionError):
        coupling.run(callback=lambda s: 1 / 0)
    assert partner.log[-1] == "finalize"


def test_mistakes_are_told(partner):
    sim, ids = disk()
    sim.scene.add(cn.disks([(9.0, 0.0)], 0.5, ROCK, driven=("vx", "vy", "w")))
    sim = cn.Simulation(sim.scene, 0.01, EULER)

    def make(**options):
        return cn.precice.Coupling(**{"name": "A", "configuration": "precice-config.xml", "simulation": sim} | options)

    partner.partner = staticmethod(lambda t, w: {"Force": np.full((1, 2), np.nan)})
    used = make()
    used.bodies("Mesh", ids, read={"Force": "force"})
    for call, words in [
        (lambda: make(simulation=sim.scene), "give a cairn.Simulation"),
        (lambda: make(name=""), "name of the participant"),
        (lambda: make(configuration="nope.xml"), "nope.xml: no such file"),
        (lambda: make(configuration=None), "configuration is None"),
        (lambda: make(configuration=__file__ + "c"), "no such file"),
        (lambda: make().bodies("Mesh", [1], read={"F": "force"}), "body 1 is held"),
        (lambda: used.run(probes=[len]), "probes is"),
        (lambda: used.run(callback=3), "callback is 3"),
        (lambda: make().run(), "nothing is coupled"),
        (lambda: make().bodies("Mesh", [99], read={"F": "force"}), "names body 99"),
        (lambda: make().bodies("Mesh", ids), "both missing"),
        (lambda: make().bodies("Mesh", ids, read={"F": "forces"}), "did you mean 'force'"),
        (lambda: make().bodies("Mesh", ids, write={"F": "force"}), "displacement"),
        (lambda: make().bodies("Mesh", ids, read="Force"), "read is 'Force'"),
        (lambda: make().bodies("Mesh", [*ids, *ids], points=np.zeros((3, 2)), read={"F": "force"}), "owner is missing"),
        (lambda: make().mesh("Mesh", 0, read={"F": "force"}), "0 deformable bodies"),
        (lambda: used.bodies("Mesh", ids, read={"F": "force"}), "coupled already"),
        (used.run, "no numbers at t = 0 s"),
        (used.run, "runs once"),
    ]:
        with pytest.raises((ValueError, OSError), match=words):
            call()
    partner.components = {"Force": 1}
    flat = make()
    flat.bodies("Mesh", ids, read={"Force": "force"})
    with pytest.raises(ValueError, match="have 1 components in the configuration, and force has 2: declare them by <data:vector"):
        flat.run()
    partner.dimensions = 3
    other = make()
    other.bodies("Mesh", ids, read={"Force": "force"})
    with pytest.raises(ValueError, match="3 dimensions, and the scene 2"):
        other.run()


def test_missing_or_old_bindings_are_told(monkeypatch, tmp_path):
    sim, _ = disk()
    monkeypatch.setitem(sys.modules, "precice", None)
    with pytest.raises(ImportError, match="pip install pyprecice"):
        cn.precice.Coupling("A", tmp_path / "x.xml", sim)
    monkeypatch.setitem(sys.modules, "precice", type(sys)("precice"))
    with pytest.raises(ImportError, match="older than version 3"):
        cn.precice.Coupling("A", tmp_path / "x.xml", sim)
