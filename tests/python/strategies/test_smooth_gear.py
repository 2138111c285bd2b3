"""Smooth DEM by Gear's prediction and correction: orders on springs, flight, drives, energy, the stable step, restart."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=1000.0)
GEARS = [cn.Gear(values=k) for k in (4, 5, 6)]


def against_a_wall(integrator, dt, gap=0.0, speed=-1.0, stiffness=1e5, **law):
    """A disk of 0.1 m before a wall of springs, in the plane."""
    scene = cn.Scene(2)
    scene.add(cn.disks([[0, 0.1 + gap]], 0.1, ROCK, velocity=(0.3, speed, 0)), cn.wall((0, 0), (0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.LinearSpring(stiffness=stiffness, **{"ratio": 0.5, "restitution": 1.0, "mu": 0.0, **law}))
    return cn.Simulation(scene, dt, cn.SmoothDEM(integrator=integrator), overlap="ignore")


def ring(integrator, steps):
    """Error of place and speed after three quarters of the time that the spring takes, which is pressed as it begins."""
    sim = against_a_wall(integrator, 1.0, gap=-0.01, speed=0.0)
    omega = np.sqrt(1e5 / sim.bodies.mass[0])
    dt = 0.75 * (np.pi / 2) / omega / steps
    sim = against_a_wall(integrator, dt, gap=-0.01, speed=0.0)
    for _ in range(steps):
        sim.step()
    t = omega * dt * steps
    place, speed = 0.1 - 0.01 * np.cos(t), 0.01 * omega * np.sin(t)
    return np.hypot(sim.bodies.position[0, 1] - place, (sim.bodies.velocity[0, 1] - speed) / omega) / 0.01


@pytest.mark.parametrize("integrator, order", [(cn.VelocityVerlet(), 2), (GEARS[0], 3), (GEARS[1], 4), (GEARS[2], 4)], ids=repr)
def test_order_on_a_spring(integrator, order):
    coarse, fine = ring(integrator, 40), ring(integrator, 80)
    assert np.log2(coarse / fine) == pytest.approx(order, abs=0.15) and coarse < 1e-4


@pytest.mark.parametrize("integrator", GEARS, ids=repr)
def test_a_spring_gives_back_the_speed(integrator):
    """A collision, from without and out again."""
    lost = []
    for steps in (100, 200):
        duration = np.pi / np.sqrt(1e5 / (1000 * np.pi * 0.01))
        sim = against_a_wall(integrator, duration / steps, gap=0.3 * duration)
        for _ in range(2 * steps):
            sim.step()
        lost.append(abs(sim.bodies.velocity[0, 1] - 1))
        assert sim.bodies.velocity[0, 0] == pytest.approx(0.3, rel=1e-13)
    assert lost[0] < 1e-7 and lost[1] < lost[0] / 12


@pytest.mark.parametrize("integrator", GEARS, ids=repr)
@pytest.mark.parametrize("dim", [2, 3])
def test_flight_is_a_parabola(integrator, dim):
    scene = cn.Scene(dim, gravity=(0, -10.0, 0)[:dim])
    make = cn.disks if dim == 2 else cn.spheres
    scene.add(make([np.zeros(dim)], 0.1, ROCK, velocity=(1.0, 2.0, 3.0) if dim == 2 else (1.0, 2.0, 0, 0, 0, 3.0)))
    scene.interact(ROCK, ROCK, cn.LinearSpring(stiffness=1e3, ratio=0.5, restitution=1.0, mu=0.0))
    sim = cn.Simulation(scene, 1e-2, cn.SmoothDEM(integrator=integrator))
    for _ in range(100):
        sim.step()
    assert sim.bodies.position[0, :2] == pytest.approx([1.0, 2.0 - 5.0], abs=1e-12)
    assert sim.bodies.velocity[0, [1, -1]] == pytest.approx([-8.0, 3.0], abs=1e-12)
    assert abs(sim.energy["closure"]) < 1e-12 * sim.energy["in_play"]


def heap(integrator, dim=3, dt=2e-5):
    rng = np.random.default_rng(dim)
    at = np.stack(np.meshgrid(*[range(3)] * dim, indexing="ij"), -1).reshape(-1, dim)
    scene = cn.Scene(dim, gravity=(0, -9.81, 0)[:dim])
    make = cn.disks if dim == 2 else cn.spheres
    bodies = make(0.0101 * (at + 0.5), rng.uniform(0.0045, 0.005, len(at)), ROCK, velocity=(0.1, -0.3, 0.02))
    scene.add(bodies, *cn.box((0,) * dim, (0.031,) * dim, ROCK, lid=False))
    scene.interact(ROCK, ROCK, cn.HertzMindlin(young=1e6, poisson=0.3, restitution=0.6, mu=0.4))
    return cn.Simulation(scene, dt, cn.SmoothDEM(integrator=integrator))


@pytest.mark.parametrize("dim", [2, 3])
def test_a_heap_falls_as_by_velocity_verlet(dim):
    """Agreement to the order of collisions: with half of the step both methods are closer, and the balance closes better."""
    apart, closure = [], []
    for dt in (2e-5, 1e-5):
        ends = []
        for integrator in (cn.VelocityVerlet(), cn.Gear(values=5)):
            sim = heap(integrator, dim, dt)
            for _ in range(round(4e-3 / dt)):
                sim.step()
            ends.append(sim.bodies.position)
        apart.append(np.abs(ends[0] - ends[1]).max())
        closure.append(abs(sim.energy["closure"]) / sim.energy["in_play"])
    assert sim.info["contacts"] > 2
    assert apart[1] < 0.3 * apart[0] < 1e-7
    assert closure[1] < 5e-3


@pytest.mark.parametrize("integrator", GEARS, ids=repr)
@pytest.mark.parametrize("dim", [2, 3])
def test_restart_to_the_same_bits(integrator, dim, tmp_path):
    one, other = heap(integrator, dim), heap(integrator, dim)
    for _ in range(150):
        one.step()
    one.checkpoint(tmp_path / "half.h5")
    other.restore(tmp_path / "half.h5")
    for sim in (one, other):
        for _ in range(60):
            sim.step()
    for name in ("position", "velocity", "acceleration"):
        assert np.array_equal(getattr(one.bodies, name), getattr(other.bodies, name))
    assert one.info["contacts"] > 0 and one.energy == other.energy


def test_threads_and_the_skin_leave_every_bit():
    ends = []
    for threads, skin in ((1, None), (2, 2e-3)):
        sim = heap(cn.Gear(), 3)
        sim.strategy = cn.SmoothDEM(integrator=cn.Gear(), threads=threads, skin=skin)
        for _ in range(200):
            sim.step()
        ends.append(sim.bodies.position)
    assert np.array_equal(*ends)


def test_driven_bodies_and_drag():
    """A driven wall follows its motion and gives its impulse; bodies under drag fall at g/c."""
    scene = cn.Scene(2, gravity=(0, -10.0))
    scene.add(
        cn.disks([[0, 5.0]], 0.1, ROCK, damping=20.0), cn.disks([[3, 0]], 0.1, ROCK, driven=("vx", "vy", "w"), drive=(0.5, 0, 1))
    )
    scene.interact(ROCK, ROCK, cn.LinearSpring(stiffness=1e3, ratio=0.5, restitution=1.0, mu=0.0))
    sim = cn.Simulation(scene, 1e-3, cn.SmoothDEM(integrator=cn.Gear()))
    for _ in range(1000):
        sim.step()
    assert sim.bodies.velocity[0, 1] == pytest.approx(-0.5, rel=1e-6)
    assert sim.bodies.position[1] == pytest.approx([3.5, 0.0], abs=1e-12)
    assert abs(sim.energy["closure"]) < 1e-6 * sim.energy["in_play"]


def test_the_stable_step_is_that_of_the_method():
    """Beyond it a step is refused; other integrators are, by name."""
    limit = np.sqrt(1e5 * 2 / (1000 * np.pi * 0.01))  # 2/omega of two equal disks is 2/limit
    for integrator, share in ((None, 2.0), *zip(GEARS, (np.sqrt(2), 1.0, 0.5))):
        against_a_wall(integrator, 0.99 * share / limit).step()
        with pytest.raises(cn.Error, match="beyond the stable step"):
            against_a_wall(integrator, 1.01 * share / limit).step()
    with pytest.raises(ValueError, match=r"integrator is HHT\(alpha=-0.05\): give cairn.VelocityVerlet\(\) or cairn.Gear\(\)"):
        cn.SmoothDEM(integrator=cn.HHT())
