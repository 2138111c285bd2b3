"""Heat as data of a coupling by preCICE, against a partner in the same process."""

import cairn as cn
import numpy as np
import pytest
from test_precice import EULER, partner  # noqa: F401 (a fixture)

METAL = cn.Material("metal", density=1000.0, young=1e9, poisson=0.3, conductivity=40.0, capacity=200.0)
POWERS = {"Power": "power"}


def coupled(sim):
    return cn.precice.Coupling("Grains", "precice-config.xml", sim)


def ball(**thermal):
    scene = cn.Scene(3)
    ids = scene.add(cn.spheres([(0.0, 0.0, 0.0)], 0.01, METAL))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    scene.thermal(initial=300.0, **thermal)
    return cn.Simulation(scene, 0.01, EULER), ids


def test_a_ball_that_a_partner_cools(partner):  # noqa: F811
    """Newton's law of cooling, implicit: T1 = T0 + h G (To - T1)/C, with C = m c."""
    sim, ids = ball()
    capacity = float(sim.bodies.mass[0]) * 200.0
    partner.partner = staticmethod(lambda t, w: {"Power": 2.0 * capacity * (280.0 - w.get("Temperature", np.array([300.0])))})
    partner.implicit, partner.windows, partner.dimensions = True, 20, 3
    partner.components = {"Power": 1, "Temperature": 1}
    coupling = coupled(sim)
    coupling.bodies("Mesh", ids, read=POWERS, write={"Temperature": "temperature"})
    coupling.run()
    expected = 280.0 + 20.0 / (1 + 2.0 * 0.01) ** 20
    assert float(sim.bodies.temperature[0]) == pytest.approx(expected, rel=1e-9) and coupling.repeated > 20
    balance = sim.info["thermal"]["balance"]
    assert balance["given"] == pytest.approx(capacity * (expected - 300.0), rel=1e-6)


def test_powers_at_points_add_up_beside_those_of_the_scene(partner):  # noqa: F811
    sim, ids = ball(power=[(np.array([0]), 0.5)])
    points = np.array([[0.01, 0, 0], [0, 0.01, 0]])
    partner.partner, partner.dimensions = staticmethod(lambda t, w: {"Power": np.array([1.0, 2.0])}), 3
    partner.components, partner.windows = {"Power": 1, "Temperature": 1}, 10
    coupling = coupled(sim)
    coupling.bodies("Mesh", ids, points=points, read=POWERS, write={"Temperature": "temperature"})
    coupling.run()
    rise = 3.5 * sim.time / (float(sim.bodies.mass[0]) * 200.0)
    assert float(sim.bodies.temperature[0]) == pytest.approx(300.0 + rise, rel=1e-12)
    assert np.allclose(coupling._participant.written["Temperature"], 300.0 + rise)
    assert len(sim.scene.networks["thermal"].flow) == 1, "the scene keeps its own sources"


def column(**options):
    """Two balls pressed between two walls by a lid of weight."""
    scene = cn.Scene(3, gravity=(0.0, 0.0, -10.0))
    scene.add(cn.spheres([(0.0, 0.0, 0.01), (0.0, 0.0, 0.03)], 0.01, METAL))
    low = scene.add(cn.wall((0, 0, 0), (0, 0, 1), METAL))
    high = scene.add(cn.wall((0, 0, 0.04), (0, 0, -1), METAL, mass=5.0, free="vz"))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    scene.thermal(initial=300.0, conductance=cn.networks.Constant(conductance=0.5), **options)
    return cn.Simulation(scene, 0.01, EULER, overlap="ignore"), np.concatenate([low, high])


def test_temperatures_of_a_partner_and_the_heat_that_reaches_it(partner):  # noqa: F811
    """Three conductances of 0.5 W/K in series: 1/6 W/K between both walls."""
    sim, walls = column(steady=True)
    partner.partner = staticmethod(lambda t, w: {"Wall": np.array([300.0, 360.0])})
    partner.dimensions, partner.windows, partner.components = 3, 3, {"Wall": 1, "Heat": 1}
    coupling = coupled(sim)
    coupling.bodies("Mesh", walls, read={"Wall": "temperature"}, write={"Heat": "heat"})
    coupling.run()
    heat = coupling._participant.written["Heat"]
    assert heat == pytest.approx([10.0, -10.0], rel=1e-9) and np.sum(np.abs(sim.contacts.heat_flux)) == pytest.approx(30.0)
    assert sim.info["thermal"]["heat_flow"] == pytest.approx(-np.sum(heat), abs=1e-12 * 10.0)


def test_heat_of_held_bodies_is_that_of_the_balance(partner):  # noqa: F811
    """In time, with friction: a block slides on a floor that a partner holds at a temperature; its half reaches the partner."""
    scene = cn.Scene(2, gravity=(0.0, -10.0))
    square = [(-0.1, 0.0), (0.1, 0.0), (0.1, 0.2), (-0.1, 0.2)]
    scene.add(cn.polygons([square], METAL, velocity=[(2.0, 0.0, 0.0)]))
    floor = scene.add(cn.wall((0, 0), (0, 1), METAL))
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    scene.thermal(initial=300.0, conductance=cn.networks.Constant(conductance=0.0))
    sim = cn.Simulation(scene, 0.01, EULER)
    partner.partner, partner.windows = staticmethod(lambda t, w: {"Floor": np.array([310.0])}), 30
    partner.components, reached = {"Floor": 1, "Heat": 1}, []
    coupling = coupled(sim)
    coupling.bodies("Mesh", floor, read={"Floor": "temperature"}, write={"Heat": "heat"})
    coupling.run(callback=lambda s: reached.append(0.01 * float(coupling._participant.written["Heat"][0])))
    assert sum(reached) == pytest.approx(-sim.info["thermal"]["balance"]["held"], rel=1e-12)
    assert sum(reached) == pytest.approx(0.5 * sim.info["thermal"]["balance"]["friction"], rel=1e-9) and sum(reached) > 1.0


def bar(**options):
    x, y = np.meshgrid(np.linspace(0, 1, 6), np.linspace(0, 0.2, 3), indexing="ij")
    k = np.arange(18).reshape(6, 3)
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], -1).reshape(-1, 4)
    body = cn.ElasticBody(np.c_[x.ravel(), y.ravel()], {"quad": quads}, young=1e7, poisson=0.3, density=1000.0,
                          groups={"left": k[0], "right": k[-1]})  # fmt: skip
    scene = cn.Scene(2)
    scene.add(cn.deformable(body, METAL, fixed={"left": "xy"}, name="bar"))
    scene.thermal(initial=300.0, **options)
    return cn.Simulation(scene, 0.01, EULER)


def test_nodes_of_a_mesh(partner):  # noqa: F811
    """Fourier: k A dT/L through a bar; then powers into its free end."""
    sim = bar(steady=True, temperature={"bar.left": 300.0})
    partner.partner, partner.windows = staticmethod(lambda t, w: {"End": np.full(3, 350.0)}), 2
    partner.components = {"End": 1, "Heat": 1, "Power": 1, "Temperature": 1}
    coupling = coupled(sim)
    coupling.mesh("Mesh", 0, "right", read={"End": "temperature"}, write={"Heat": "heat"})
    coupling.run()
    assert np.sum(coupling._participant.written["Heat"]) == pytest.approx(-40.0 * 0.2 * 50.0, rel=1e-9)
    sim = bar(steady=True, temperature={"bar.left": 300.0})
    partner.partner = staticmethod(lambda t, w: {"Power": np.array([100.0, 200.0, 100.0])})
    coupling = coupled(sim)
    coupling.mesh("Mesh", 0, "right", read=POWERS, write={"Temperature": "temperature"})
    coupling.run()
    assert coupling._participant.written["Temperature"] == pytest.approx(350.0, rel=1e-9)


def test_mistakes_with_heat_are_told(partner):  # noqa: F811
    sim, ids = ball()
    cold = cn.Scene(3)
    cold.add(cn.spheres([(0.0, 0.0, 0.0)], 0.01, METAL))
    without, (pressed, walls) = cn.Simulation(cold, 0.01, EULER), column()
    partner.components, partner.dimensions = {"T": 1, "P": 1}, 3
    partner.partner = staticmethod(lambda t, w: {"T": np.zeros(1)})
    begun = coupled(sim)
    begun.bodies("Mesh", ids, read={"T": "temperature"})
    vector = coupled(sim)
    for call, words in [
        (lambda: coupled(without).bodies("Mesh", ids, read=POWERS), "the scene conducts none: call scene.thermal"),
        (lambda: coupled(without).bodies("Mesh", ids, write={"T": "temperature"}), "the scene conducts none"),
        (lambda: coupled(sim).bodies("Mesh", ids, read={"T": "temperature", "P": "power"}), "give one of both"),
        (lambda: coupled(sim).bodies("Mesh", ids, read={"T": "temperature", "U": "temperature"}), "two data of temperature"),
        (lambda: coupled(pressed).bodies("Mesh", walls, read=POWERS), "keeps its temperature, whatever the power"),
        (lambda: coupled(sim).bodies("Mesh", ids, read={"T": "temperatur"}), "did you mean 'temperature'"),
        (begun.run, 'holds 0 K at t = 0 s: .* initialize="yes"'),
        (lambda: (vector.bodies("Mesh", ids, read={"Q": "power"}), vector.run()), "declare them by <data:scalar"),
    ]:
        with pytest.raises(ValueError, match=words):
            call()


def test_points_of_a_body_have_one_temperature_and_share_its_heat(partner):  # noqa: F811
    """Both walls between the balls, the lower one by three points: 300 K in the mean, 10 W in the sum."""
    sim, walls = column(steady=True)
    points = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.04]])
    partner.partner = staticmethod(lambda t, w: {"Wall": np.array([290.0, 300.0, 310.0, 360.0])})
    partner.dimensions, partner.windows, partner.components = 3, 2, {"Wall": 1, "Heat": 1}
    coupling = coupled(sim)
    coupling.bodies("Mesh", walls, points=points, owner=[0, 0, 0, 1], read={"Wall": "temperature"}, write={"Heat": "heat"})
    coupling.run()
    assert coupling._participant.written["Heat"] == pytest.approx([10 / 3, 10 / 3, 10 / 3, -10.0], rel=1e-9)


REMOVED = [[0], [1], [0, 1, 2]]


@pytest.mark.parametrize("gone", REMOVED)
@pytest.mark.parametrize("what", ["power", "temperature"])
def test_vertices_of_removed_grains_stay_and_their_heat_goes_nowhere(partner, gone, what):  # noqa: F811
    scene = cn.Scene(2)
    ids = scene.add(cn.disks([(0.0, 0.0), (3.0, 0.0), (6.0, 0.0)], 0.5, METAL, velocity=(0.0, 1.0)))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    scene.thermal(initial=300.0)
    sim = cn.Simulation(scene, 0.01, EULER)
    given = {"power": np.full(3, 1e3), "temperature": np.full(3, 350.0)}[what]
    partner.partner, partner.windows = staticmethod(lambda t, w: {"In": given}), 5
    partner.components = {"In": 1, "T": 1, "Heat": 1}
    coupling = coupled(sim)
    written = {"T": "temperature", "Place": "position", "Speed": "velocity"} | ({"Heat": "heat"} if what == "temperature" else {})
    coupling.bodies("Mesh", ids, read={"In": what}, write=written)
    coupling.run(callback=lambda s: s.remove(ids[gone]) if coupling.windows == 2 else None)
    found, count = coupling._participant.written, np.where(np.isin([0, 1, 2], gone), 2, 5)
    rise = 1e3 * 0.01 * count / (250.0 * np.pi * 200.0)
    assert found["T"] == pytest.approx(300.0 + rise if what == "power" else given, rel=1e-12)
    assert np.allclose(found["Place"], np.c_[[0.0, 3.0, 6.0], 0.01 * count], rtol=1e-12)
    assert np.array_equal(found["Speed"], np.c_[np.zeros(3), count == 5])
    assert "Heat" not in found or np.array_equal(found["Heat"], np.zeros(3))
    assert sim.info["thermal"]["status"] == "converged"


def test_a_removed_mesh_keeps_its_vertices(partner):  # noqa: F811
    sim = bar(steady=True, temperature={"bar.left": 300.0})
    partner.partner, partner.windows = staticmethod(lambda t, w: {"End": np.full(3, 350.0)}), 4
    partner.components = {"End": 1, "Heat": 1, "T": 1}
    coupling, heats = coupled(sim), []
    coupling.mesh("Mesh", 0, "right", read={"End": "temperature"}, write={"Heat": "heat", "T": "temperature", "X": "position"})

    def remove(s):
        heats.append(np.sum(coupling._participant.written["Heat"]))
        if coupling.windows == 2:
            s.remove(s.meshes[0].all_ids)

    coupling.run(callback=remove)
    assert heats == pytest.approx([-400.0, -400.0, 0.0, 0.0], rel=1e-9)
    assert np.all(coupling._participant.written["T"] == 350.0) and np.all(coupling._participant.written["X"][:, 0] == 1.0)


def wired(wires, held, written):
    """Three balls in a row, joined by wires; a partner holds some at a temperature and takes their heat."""
    scene = cn.Scene(3)
    ids = scene.add(cn.spheres([(0.1 * k, 0.0, 0.0) for k in range(3)], 0.01, METAL))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    scene.thermal(initial=300.0, steady=True, wires=wires, temperature=[(ids[2:], 300.0)])
    coupling = coupled(cn.Simulation(scene, 0.01, EULER))
    coupling.bodies("Held", ids[held], read={"T": "temperature"})
    coupling.bodies("Written", ids[written], write={"Heat": "heat"})
    return coupling


def test_heat_through_perfect_conductors(partner):  # noqa: F811
    """One held ball answers for those that a perfect conductor joins to it; how two held ones share is undetermined."""
    partner.dimensions, partner.windows, partner.components = 3, 1, {"T": 1, "Heat": 1}
    partner.partner = staticmethod(lambda t, w: {"T": np.array([350.0])})
    one = wired([(0, 1, np.inf), (1, 2, 2.0)], [0], [0, 1, 2])
    one.run()
    assert one._participant.written["Heat"] == pytest.approx([-100.0, 0.0, 100.0], rel=1e-9)
    partner.partner = staticmethod(lambda t, w: {"T": np.array([350.0, 350.0])})
    two = wired([(0, 1, np.inf), (1, 2, 2.0)], [0, 1], [2])
    two.run()
    assert two._participant.written["Heat"] == pytest.approx([100.0], rel=1e-9)
    for written in ([0], [1]):
        with pytest.raises(ValueError, match=f"body or node {written[0]} .* undetermined.* give that contact or wire a finite"):
            wired([(0, 1, np.inf), (1, 2, 2.0)], [0, 1], written).run()
