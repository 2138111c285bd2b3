"""With the library of preCICE, two processes: this one and a partner, in explicit and implicit coupling."""

import subprocess
import sys

import cairn as cn
import numpy as np
import pytest

pytest.importorskip("precice", reason="preCICE is not installed: its library, then pip install pyprecice")

ROCK = cn.Material("rock", density=1000.0)
EULER = cn.NSCD(theta=1.0)
CONFIGURATION = """<?xml version="1.0" encoding="UTF-8" ?>
<precice-configuration>
  <data:vector name="Force" />
  <data:vector name="Displacement" />
  <mesh name="Push-Mesh" dimensions="{dim}"><use-data name="Force" /><use-data name="Displacement" /></mesh>
  <mesh name="Own-Mesh" dimensions="{dim}"><use-data name="Force" /><use-data name="Displacement" /></mesh>
  <participant name="Push">
    <provide-mesh name="Push-Mesh" />
    <write-data name="Force" mesh="Push-Mesh" />
    <read-data name="Displacement" mesh="Push-Mesh" />
  </participant>
  <participant name="Own">
    <receive-mesh name="Push-Mesh" from="Push" />
    <provide-mesh name="Own-Mesh" />
    <read-data name="Force" mesh="Own-Mesh" />
    <write-data name="Displacement" mesh="Own-Mesh" />
    <mapping:nearest-neighbor direction="read" from="Push-Mesh" to="Own-Mesh" constraint="{forces}" />
    <mapping:{mapping} direction="write" from="Own-Mesh" to="Push-Mesh" constraint="consistent" />
  </participant>
  <m2n:sockets acceptor="Push" connector="Own" exchange-directory="." />
  <coupling-scheme:{scheme}>
    <participants first="Push" second="Own" />
    <max-time value="{end}" />
    <time-window-size value="0.01" />
    <exchange data="Force" mesh="Push-Mesh" from="Push" to="Own" />
    <exchange data="Displacement" mesh="Push-Mesh" from="Own" to="Push" />
    {iterations}
  </coupling-scheme:{scheme}>
</precice-configuration>
"""
ITERATIONS = """<max-iterations value="50" />
    <relative-convergence-measure limit="1e-12" data="Displacement" mesh="Push-Mesh" />
    <acceleration:aitken><data name="Displacement" mesh="Push-Mesh" /><initial-relaxation value="1" /></acceleration:aitken>"""
BOTH = """<max-iterations value="50" />
    <relative-convergence-measure limit="1e-12" data="Displacement" mesh="Push-Mesh" />
    <relative-convergence-measure limit="1e-12" data="Force" mesh="Push-Mesh" />
    <acceleration:aitken>
      <data name="Displacement" mesh="Push-Mesh" /><data name="Force" mesh="Push-Mesh" /><initial-relaxation value="1" />
    </acceleration:aitken>"""
PUSH = """import numpy as np, precice
p = precice.Participant("Push", "precice-config.xml", 0, 1)
x = np.array({points}, float)
v = p.set_mesh_vertices("Push-Mesh", x)
p.initialize()
while p.is_coupling_ongoing():
    p.requires_writing_checkpoint()
    h = p.get_max_time_step_size()
    u = p.read_data("Push-Mesh", "Displacement", v, h)
    p.write_data("Push-Mesh", "Force", v, np.array({force}, float) + np.zeros_like(x))
    p.advance(h)
    if not p.requires_reading_checkpoint():
        np.save("seen.npy", p.read_data("Push-Mesh", "Displacement", v, 0.0) if p.is_coupling_ongoing() else u)
p.finalize()
"""


@pytest.fixture
def coupled(tmp_path, monkeypatch):
    """Starts a partner at points [m] that gives a force, an expression of the displacement u, for a simulation."""
    monkeypatch.chdir(tmp_path)
    partners = []

    def start(sim, points, force, scheme="serial-explicit", mapping="nearest-neighbor", end=0.05):
        iterations = {"serial-implicit": ITERATIONS, "parallel-implicit": BOTH}.get(scheme, "")
        forces = "consistent" if len(points) == 1 else "conservative"
        text = CONFIGURATION.format(
            dim=sim.scene.dim, scheme=scheme, mapping=mapping, end=end, forces=forces, iterations=iterations
        )
        (tmp_path / "precice-config.xml").write_text(text, encoding="utf-8")
        partners.append(subprocess.Popen([sys.executable, "-c", PUSH.format(points=points, force=force)], stderr=subprocess.PIPE))
        return cn.precice.Coupling("Own", "precice-config.xml", sim), partners[-1]

    yield start
    for partner in partners:
        partner.kill()
        partner.communicate()


def disk(dt):
    scene = cn.Scene(2)
    ids = scene.add(cn.disks([(0.0, 0.0)], 0.5, ROCK, velocity=(1.0, 0.0)))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, dt, EULER), ids


def test_a_push_in_explicit_coupling(coupled):
    sim, ids = disk(0.01)
    coupling, partner = coupled(sim, [[0.0, 0.0]], [[100.0, 0.0]])
    coupling.bodies("Own-Mesh", ids, read={"Force": "force"}, write={"Displacement": "displacement"})
    assert coupling.run(output="own.vtkhdf") == 5 and partner.wait(timeout=60) == 0 and coupling.repeated == 0
    assert sim.bodies.velocity[0, 0] == pytest.approx(1.0 + 100.0 / float(sim.bodies.mass[0]) * 0.05, rel=1e-9)
    assert len(cn.load("own.vtkhdf")) == 6


@pytest.mark.parametrize("scheme", ["serial-implicit", "parallel-implicit"])
def test_a_spring_in_implicit_coupling_with_steps_within_windows(coupled, scheme):
    """The force is linear in time within a window, as preCICE interpolates it, and right at the end of each window."""
    sim, ids = disk(0.004)  # 2.5 steps a window
    mass, x, v, begin = float(sim.bodies.mass[0]), 0.0, 1.0, 0.0
    k = 40.0 * mass
    coupling, partner = coupled(sim, [[0.0, 0.0]], f"-{k!r} * u", scheme)
    coupling.bodies("Own-Mesh", ids, read={"Force": "force"}, write={"Displacement": "displacement"})
    assert coupling.run() == 5 and partner.wait(timeout=60) == 0 and coupling.repeated >= 5
    for _ in range(5):
        end = 0.0
        for _ in range(100):
            y, w, t = x, v, 0.0
            for h in (0.004, 0.004, 0.002):
                t += h
                w += h * (begin + (end - begin) * t / 0.01) / mass
                y += h * w
            end = -k * y
        x, v, begin = y, w, end
    assert sim.bodies.position[0, 0] == pytest.approx(x, rel=1e-8) and sim.bodies.velocity[0, 0] == pytest.approx(v, rel=1e-8)
    assert sim.steps == 15 and sim.time == pytest.approx(0.05)


@pytest.mark.parametrize("dim", [2, 3])
def test_nearest_projection_on_the_sides_of_a_mesh(coupled, dim):
    """The partner sees the displacement between nodes, and its force acts on nodes."""
    x = np.array(np.meshgrid(*[[0.0, 1.0, 2.0]] * dim, indexing="ij")).reshape(dim, -1).T
    k = np.arange(3**dim).reshape((3,) * dim)
    low = [k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]]
    cells = {"quad": np.stack(low, -1).reshape(-1, 4)} if dim == 2 else {
        "hexahedron": np.stack([a[..., :-1] for a in low] + [a[..., 1:] for a in low], -1).reshape(-1, 8)}  # fmt: skip
    groups = {"foot": k[..., 0].ravel(), "top": k[..., 2].ravel(), "corner": k[(0,) * (dim - 1) + (2,)].ravel()}
    body = cn.ElasticBody(x, cells, young=1e7, poisson=0.3, density=1e3, groups=groups)
    scene = cn.Scene(dim)
    scene.add(cn.deformable(body, ROCK, fixed={"foot": "xyz"[:dim]}, force={"corner": (0.0,) * (dim - 1) + (-1e4,)}))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 0.01, EULER)
    points = [[0.5, 2.0], [1.25, 2.0]] if dim == 2 else [[0.5, 1.0, 2.0], [1.25, 1.0, 2.0]]
    coupling, partner = coupled(sim, points, [50.0] + [0.0] * (dim - 1), mapping="nearest-projection")
    coupling.mesh("Own-Mesh", 0, "top", read={"Force": "force"}, write={"Displacement": "displacement"})
    moved = []
    assert coupling.run(callback=lambda s: moved.append(s.meshes[0].displacement.copy())) == 5 and partner.wait(timeout=60) == 0
    line = k[:, 2] if dim == 2 else k[:, 1, 2]  # nodes along the points
    left, middle, right = moved[-2][line]  # in serial coupling the partner acts first, with displacements of the window before
    seen = np.load("seen.npy")
    assert np.allclose(seen, [(left + middle) / 2, 0.75 * middle + 0.25 * right], rtol=1e-9, atol=0)
    assert np.abs(moved[-1]).max() > 1e-6


def test_data_of_another_name(coupled):
    sim, ids = disk(0.01)
    coupling, _ = coupled(sim, [[0.0, 0.0]], [[100.0, 0.0]])
    coupling.bodies("Own-Mesh", ids, read={"Forse": "force"})
    with pytest.raises(Exception, match="Forse"):  # before it waits for the partner
        coupling.run()
