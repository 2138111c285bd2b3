"""The estimate of the error in time by step doubling: its value, and absence of side effects."""

import math

import cairn as cn
import numpy as np
import pytest
from small_scenes import heap

ROCK = cn.Material("rock", density=1000.0)
RUBBER = cn.Material("rubber", density=1200.0)
TIGHT = cn.NLGS(tol=1e-13, max_iter=100_000)


def same(a, b):
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[k], b[k]) for k in a)
    return np.asarray(a).tobytes() == np.asarray(b).tobytes()


def packed(dim, strategy, law=None, dt=1e-3):
    return cn.Simulation(heap(dim, law=law), dt, strategy, overlap="ignore")


def pendulum(dt, dim=2, **options):
    scene = cn.Scene(dim, gravity=-9.81 * np.eye(dim)[-1])
    place = np.eye(dim)[0]
    balls = scene.add((cn.disks if dim == 2 else cn.spheres)([place, 2 * place], 0.1, ROCK))
    scene.interact("*", "*", None)
    scene.join(balls[0], None, (cn.Pivot if dim == 2 else cn.Ball)(point=np.zeros(dim)))
    if dim == 3:
        scene.join(balls[0], balls[1], cn.Distance(points=[place, 2 * place]))
    return cn.Simulation(scene, dt, cn.NSCD(solver=TIGHT, **options))


def spring(dt, **options):
    """A disk on a spring of 1 m, omega = sqrt(k / m), 0.2 m out at rest."""
    scene = cn.Scene(2, gravity=(0.0, 0.0))
    disk = scene.add(cn.disks([[1.2, 0.0]], 0.1, ROCK))
    scene.interact("*", "*", None)
    law = cn.Spring(3000.0, 0.0, -0.2)
    scene.join(disk[0], None, cn.Slider(point=(1.2, 0.0), axis=(1.0, 0.0), spring=law))
    return cn.Simulation(scene, dt, cn.NSCD(solver=TIGHT, **options))


def mesh(strategy, large=False, dt=1e-4):
    x = np.linspace(0.0, 1.0, 4)
    points = np.array([(a, 0.001 + b) for b in x for a in x])
    quads = [(4 * j + i, 4 * j + i + 1, 4 * j + i + 5, 4 * j + i + 4) for j in range(3) for i in range(3)]
    cells = {"quad": np.array(quads)}
    law = cn.NeoHookean(young=1e5, poisson=0.3) if large else None
    body = (cn.SolidBody(points, cells, law, density=1200.0) if large
            else cn.ElasticBody(points, cells, young=1e5, poisson=0.3, density=1200.0))  # fmt: skip
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    scene.add(*cn.deformable(body, RUBBER, contact=range(4)), cn.wall((0.0, 0.0), (0.0, 1.0), ROCK))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, dt, strategy)


SIMULATIONS = {
    "disks": lambda: packed(2, cn.NSCD()),
    "spheres": lambda: packed(3, cn.NSCD(renumber_every=2)),
    "bonded": lambda: packed(2, cn.NSCD(), cn.Bonded(mu=0.4)),
    "gear": lambda: packed(2, cn.NSCD(integrator=cn.Gear())),
    "newmark": lambda: packed(3, cn.NSCD(integrator=cn.Newmark())),
    "central differences": lambda: packed(2, cn.NSCD(integrator=cn.CentralDifference())),
    "carpenter": lambda: packed(2, cn.Carpenter()),
    "granular element": lambda: packed(2, cn.GranularElement(stiffness=1e6)),
    "smooth": lambda: packed(2, cn.SmoothDEM(), cn.LinearSpring(stiffness=1e6, mu=0.3), dt=1e-5),
    "events": lambda: packed(2, cn.EventDriven(), cn.Restitution(normal=0.5)),
    "pendulum": lambda: pendulum(1e-2),
    "balls": lambda: pendulum(1e-2, 3),
    "mesh": lambda: mesh(cn.NSCD()),
    "mesh of rubber": lambda: mesh(cn.NSCD(), large=True),
    "mesh, explicit": lambda: mesh(cn.NSCD(integrator=cn.VelocityVerlet()), dt=1e-5),
}


@pytest.mark.parametrize("name", SIMULATIONS)
def test_it_leaves_no_trace(name):
    sims = [SIMULATIONS[name]() for _ in range(2)]
    for k in range(8):
        if k % 3 == 2:
            found, report = sims[0].time_error(), sims[0].report
            assert set(found) == {"velocity", "position", "order"} and all(map(math.isfinite, found.values()))
            assert same(sims[0].get_state(), sims[1].get_state()) and sims[0].report is report
        [sim.step() for sim in sims]
    assert same(sims[0].get_state(), sims[1].get_state())
    assert same(np.array(sims[0].contacts.impulse), np.array(sims[1].contacts.impulse))


def true_of_spring(sim):
    """Position and velocity at the end of the coming step, by the closed form."""
    omega = math.sqrt(3000.0 / float(sim.bodies.mass[0]))
    x, v, a = float(sim.bodies.position[0, 0]) - 1.0, float(sim.bodies.velocity[0, 0]), omega * sim.dt
    return 1.0 + x * math.cos(a) + v / omega * math.sin(a), v * math.cos(a) - x * omega * math.sin(a)


@pytest.mark.parametrize("options, order", [({}, 2), ({"integrator": cn.Newmark()}, 2), ({"integrator": cn.VelocityVerlet()}, 2)])
def test_a_spring_against_its_closed_form(options, order):
    sim = spring(5e-3, **options)
    for _ in range(2):
        sim.run(steps=12, progress=False)
        found, before = sim.time_error(), (sim.bodies.position[0, 0], sim.bodies.velocity[0, 0])
        x, v = true_of_spring(sim)
        sim.step()
        assert found["order"] == order
        missed = abs(sim.bodies.velocity[0, 0] - v) / max(abs(v), abs(before[1]))
        assert found["velocity"] == pytest.approx(missed, rel=0.2)
        missed = abs(sim.bodies.position[0, 0] - x) / abs(x - before[0])
        assert found["position"] == pytest.approx(missed, rel=0.2)


@pytest.mark.parametrize("theta", [0.5, 0.8])
@pytest.mark.parametrize("dim", [2, 3])
def test_a_pendulum_against_far_smaller_steps(dim, theta):
    sim = pendulum(5e-3, dim, theta=theta)
    sim.run(steps=40, progress=False)
    found, state = sim.time_error(), sim.get_state()
    v0, x0 = np.array(sim.bodies.velocity), np.array(sim.bodies.position)
    sim.step()
    v, x = np.array(sim.bodies.velocity), np.array(sim.bodies.position)
    sim.set_state(state)
    for _ in range(64):
        sim.step(sim.dt / 64)
    assert found["order"] == (2 if theta == 0.5 else 1)
    inertia = np.sqrt(np.column_stack([np.tile(sim.bodies.mass[:2, None], dim), np.reshape(sim.bodies.inertia[:2], (2, -1))]))
    speed = max(np.linalg.norm(inertia * u[:2]) for u in (v0, sim.bodies.velocity))
    assert found["velocity"] == pytest.approx(np.linalg.norm(inertia * (v - sim.bodies.velocity)[:2]) / speed, rel=0.2)
    if dim == 3:  # the balls do not turn
        way = np.linalg.norm(sim.bodies.position - x0)
        assert found["position"] == pytest.approx(np.linalg.norm(x - sim.bodies.position) / way, rel=0.2)


def landing(dt, share):
    """A disk at 1 m/s that meets a floor after a share of the step, and stays there; gravity is none."""
    scene = cn.Scene(2, gravity=(0.0, 0.0))
    scene.add(cn.disks([[0.0, 0.1 + share * dt]], 0.1, ROCK, velocity=(0.0, -1.0)), cn.wall((0.0, 0.0), (0.0, 1.0), ROCK))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, dt, cn.NSCD())


def test_across_an_impact_it_is_of_first_order():
    errors = {}
    for dt in (0.02, 0.01):
        sims = [landing(dt, share) for share in (np.arange(20) + 0.5) / 20]
        found = [sim.time_error() for sim in sims]
        assert {each["order"] for each in found} == {1}
        [sim.step() for sim in sims]
        missed = [abs(sim.bodies.position[0, 1] - 0.1) for sim in sims]
        told = [each["position"] * each_way for each, each_way in zip(found, _ways(dt))]
        errors[dt] = np.mean(missed), np.mean(told)
    assert errors[0.02][0] == pytest.approx(2 * errors[0.01][0]) and errors[0.02][1] == pytest.approx(2 * errors[0.01][1])
    assert errors[0.01][0] < errors[0.01][1] < 2 * errors[0.01][0]  # on the mean over where in the step it lands


def _ways(dt):
    for share in (np.arange(20) + 0.5) / 20:
        sim = landing(dt, share)
        before = sim.bodies.position[0, 1]
        [sim.step(dt / 2) for _ in range(2)]
        yield abs(sim.bodies.position[0, 1] - before)


def test_rest_has_no_error():
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    scene.add(cn.disks([[0.0, 0.1]], 0.1, ROCK), cn.wall((0.0, 0.0), (0.0, 1.0), ROCK))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 1e-2)
    sim.step()
    found = sim.time_error()
    assert found["order"] == 2 and found["velocity"] < 1e-12 and found["position"] < 1e-12


def test_a_run_tells_it_in_its_history(tmp_path):
    path = tmp_path / "run.vtkhdf"
    sims = [packed(2, cn.NSCD()) for _ in range(2)]
    told = []
    sims[0].run(steps=6, output=path, every=3, progress=False, time_error_every=2,
                callback=lambda sim: told.append(sim.info.get("time_error")))  # fmt: skip
    sims[1].run(steps=6, progress=False)
    assert same(sims[0].get_state(), sims[1].get_state())
    with cn.load(path) as run:
        found = run.history["time_error_position"]
        assert told[1::2] == [None] * 3 and np.isnan(found[1::2]).all()  # none between estimates
        assert found[::2].tolist() == [each["position"] for each in told[::2]] and min(found[::2]) > 0
        assert len(run[1].contacts.impulse)  # contacts of the step are those of the whole one
    with pytest.raises(ValueError, match="time_error_every"):
        sims[1].run(steps=1, time_error_every=0)


def test_it_stands_between_steps():
    sim = packed(2, cn.NSCD())
    sim.stages.begin_step()
    with pytest.raises(ValueError, match="time_error stands between steps"):
        sim.time_error()
    with pytest.raises(ValueError, match="dt"):
        packed(2, cn.NSCD()).time_error(-1.0)


@pytest.mark.parametrize("integrator", [cn.CentralDifference(), cn.BetaScheme(beta=0.5)], ids=["central", "beta"])
def test_springs_of_joints_are_of_second_order_where_velocities_stand_half_a_step_before(integrator):
    """From velocities of half a step before the start. Those of the start itself make another swing, of which errors fall as the
    step, and that is no error of the method: the estimate has its order."""
    mass, rate, gravity = 1000.0 * np.pi * 0.05**2, 10.0, 9.81

    def worst(dt):
        scene = cn.Scene(2, gravity=(0.0, -gravity))
        stone = cn.Material("stone", density=1000.0)
        (disk,) = scene.add(cn.disks([(0.0, 0.0)], 0.05, stone, velocity=[[0.0, gravity * dt / 2, 0.0]]))
        scene.interact("*", "*", None)
        scene.join(disk, None, cn.Distance(points=[(0.0, 0.0), (0.0, 1.0)], spring=cn.Spring(mass * rate**2, 0.0)))
        sim, off = cn.Simulation(scene, dt, cn.NSCD(integrator=integrator, solver=cn.NLGS(tol=1e-12))), 0.0
        for k in range(round(0.5 / dt)):
            if k == 5:
                told = sim.time_error()
            sim.step()
            swing = np.cos(rate * (k + 1) * dt) - 1
            off = max(off, abs(sim.bodies.position[0, 1] * rate**2 / gravity - swing))
        return off, told

    (coarse, _), (fine, told) = worst(4e-3), worst(2e-3)
    assert 3.5 < coarse / fine < 4.5 and fine < 1e-3 and told["order"] == 2
