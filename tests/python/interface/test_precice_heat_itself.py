"""Heat over the library of preCICE, two processes: this one and a partner, in explicit and implicit coupling."""

import subprocess
import sys

import cairn as cn
import numpy as np
import pytest

pytest.importorskip("precice", reason="preCICE is not installed: its library, then pip install pyprecice")

METAL = cn.Material("metal", density=1000.0, young=1e9, poisson=0.3, conductivity=40.0, capacity=200.0)
EULER = cn.NSCD(theta=1.0)
CONFIGURATION = """<?xml version="1.0" encoding="UTF-8" ?>
<precice-configuration>
  <data:scalar name="Given" />
  <data:scalar name="Taken" />
  <mesh name="Flow-Mesh" dimensions="{dim}"><use-data name="Given" /><use-data name="Taken" /></mesh>
  <mesh name="Own-Mesh" dimensions="{dim}"><use-data name="Given" /><use-data name="Taken" /></mesh>
  <participant name="Flow">
    <provide-mesh name="Flow-Mesh" />
    <write-data name="Given" mesh="Flow-Mesh" />
    <read-data name="Taken" mesh="Flow-Mesh" />
  </participant>
  <participant name="Own">
    <receive-mesh name="Flow-Mesh" from="Flow" />
    <provide-mesh name="Own-Mesh" />
    <read-data name="Given" mesh="Own-Mesh" />
    <write-data name="Taken" mesh="Own-Mesh" />
    <mapping:nearest-neighbor direction="read" from="Flow-Mesh" to="Own-Mesh" constraint="consistent" />
    <mapping:nearest-neighbor direction="write" from="Own-Mesh" to="Flow-Mesh" constraint="consistent" />
  </participant>
  <m2n:sockets acceptor="Flow" connector="Own" exchange-directory="." />
  <coupling-scheme:{scheme}>
    <participants first="Flow" second="Own" />
    <max-time value="{end}" />
    <time-window-size value="0.01" />
    <exchange data="Given" mesh="Flow-Mesh" from="Flow" to="Own" {initial} />
    <exchange data="Taken" mesh="Flow-Mesh" from="Own" to="Flow" initialize="yes" />
    {iterations}
  </coupling-scheme:{scheme}>
</precice-configuration>
"""
ITERATIONS = """<max-iterations value="60" />
    <relative-convergence-measure limit="1e-13" data="Taken" mesh="Flow-Mesh" />
    <relative-convergence-measure limit="1e-13" data="Given" mesh="Flow-Mesh" />"""
FLOW = """import numpy as np, precice
p = precice.Participant("Flow", "precice-config.xml", 0, 1)
x = np.array({points}, float)
v = p.set_mesh_vertices("Flow-Mesh", x)
if p.requires_initial_data():
    p.write_data("Flow-Mesh", "Given", v, np.array({first}, float))
p.initialize()
while p.is_coupling_ongoing():
    p.requires_writing_checkpoint()
    h = p.get_max_time_step_size()
    u = p.read_data("Flow-Mesh", "Taken", v, h)
    p.write_data("Flow-Mesh", "Given", v, np.array({given}, float) + np.zeros(len(v)))
    p.advance(h)
    p.requires_reading_checkpoint()
    if p.is_coupling_ongoing():
        np.save("taken.npy", p.read_data("Flow-Mesh", "Taken", v, 0.0))
p.finalize()
"""


@pytest.fixture
def coupled(tmp_path, monkeypatch):
    """Starts a partner at points [m] that gives an expression of u, the data that it takes; `first` at the start."""
    monkeypatch.chdir(tmp_path)
    partners = []

    def start(sim, points, given, scheme, end, first=None):
        text = CONFIGURATION.format(
            dim=sim.scene.dim, scheme=scheme, end=end, iterations=ITERATIONS * scheme.endswith("implicit"),
            initial="" if first is None else 'initialize="yes"',
        )  # fmt: skip
        (tmp_path / "precice-config.xml").write_text(text, encoding="utf-8")
        script = FLOW.format(points=points, given=given, first=first)
        partners.append(subprocess.Popen([sys.executable, "-c", script], stderr=subprocess.PIPE))
        return cn.precice.Coupling("Own", "precice-config.xml", sim), partners[-1]

    yield start
    for partner in partners:
        partner.kill()
        partner.communicate()


@pytest.mark.parametrize("scheme", ["serial-explicit", "serial-implicit", "parallel-implicit"])
def test_a_ball_that_a_partner_cools(coupled, scheme):
    """Newton's law of cooling, C dT/dt = G (To - T) with G = 2 C: implicit by the temperature at the end, else at the begin."""
    scene = cn.Scene(3)
    ids = scene.add(cn.spheres([(0.0, 0.0, 0.0)], 0.01, METAL))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    scene.thermal(initial=300.0)
    sim = cn.Simulation(scene, 0.01, EULER)
    rate = 2.0 * float(sim.bodies.mass[0]) * 200.0
    first = [rate * -20.0] if scheme == "parallel-implicit" else None
    coupling, partner = coupled(sim, [[0.0, 0.0, 0.0]], f"{rate!r} * (280.0 - u)", scheme, 0.1, first)
    coupling.bodies("Own-Mesh", ids, read={"Given": "power"}, write={"Taken": "temperature"})
    assert coupling.run() == 10 and partner.wait(timeout=60) == 0 and (coupling.repeated >= 10) == scheme.endswith("implicit")
    share = 1 - 0.02 if scheme == "serial-explicit" else 1 / (1 + 0.02)
    assert float(sim.bodies.temperature[0]) == pytest.approx(280.0 + 20.0 * share**10, rel=1e-9)


@pytest.mark.parametrize("scheme", ["serial-explicit", "parallel-explicit"])
def test_walls_at_temperatures_of_a_partner_and_their_heat(coupled, scheme):
    """Three conductances of 0.5 W/K in series between walls of 300 and 360 K: 10 W reach the one and leave the other."""
    scene = cn.Scene(3, gravity=(0.0, 0.0, -10.0))
    scene.add(cn.spheres([(0.0, 0.0, 0.01), (0.0, 0.0, 0.03)], 0.01, METAL))
    low = scene.add(cn.wall((0, 0, 0), (0, 0, 1), METAL))
    high = scene.add(cn.wall((0, 0, 0.04), (0, 0, -1), METAL, mass=5.0, free="vz"))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    scene.thermal(initial=300.0, conductance=cn.networks.Constant(conductance=0.5), steady=True)
    sim = cn.Simulation(scene, 0.01, EULER, overlap="ignore")
    places = np.asarray(sim.bodies.position)[2:].tolist()
    coupling, partner = coupled(sim, places, [300.0, 360.0], scheme, 0.04, [300.0, 360.0])
    coupling.bodies("Own-Mesh", np.r_[low, high], read={"Given": "temperature"}, write={"Taken": "heat"})
    assert coupling.run() == 4 and partner.wait(timeout=60) == 0
    assert np.load("taken.npy") == pytest.approx([10.0, -10.0], rel=1e-9)


def test_nodes_of_a_mesh_in_implicit_coupling(coupled):
    """A bar between 300 K and a partner that gives its end a power, G (To - T) shared by its nodes: series of k A/L and G."""
    x, y = np.meshgrid(np.linspace(0, 1, 6), np.linspace(0, 0.2, 3), indexing="ij")
    k = np.arange(18).reshape(6, 3)
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], -1).reshape(-1, 4)
    body = cn.ElasticBody(np.c_[x.ravel(), y.ravel()], {"quad": quads}, young=1e7, poisson=0.3, density=1000.0,
                          groups={"left": k[0], "right": k[-1]})  # fmt: skip
    scene = cn.Scene(2)
    scene.add(cn.deformable(body, METAL, fixed={"left": "xy"}, name="bar"))
    scene.thermal(initial=300.0, steady=True, temperature={"bar.left": 300.0})
    sim = cn.Simulation(scene, 0.01, EULER)
    weights = [1.0, 2.0, 1.0]  # of a film of 4 W/K over the end
    film = f"np.array({weights}) * (400.0 - u)"
    coupling, partner = coupled(sim, [[1.0, 0.0], [1.0, 0.1], [1.0, 0.2]], film, "serial-implicit", 0.02)
    coupling.mesh("Own-Mesh", 0, "right", read={"Given": "power"}, write={"Taken": "temperature"})
    assert coupling.run() == 2 and partner.wait(timeout=60) == 0 and coupling.repeated > 2
    through = 100.0 / (1 / 8.0 + 1 / 4.0)
    assert np.load("taken.npy") == pytest.approx(np.full(3, 300.0 + through / 8.0), rel=1e-9)
