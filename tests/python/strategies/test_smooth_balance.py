"""The balance of energy of smooth scenes closes to rounding, term by term; what finite steps lose falls with the step."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=2500.0)
R = 0.005
LAWS = {
    "linear": cn.LinearSpring(stiffness=5e3, restitution=0.5, mu=0.5),
    "hertz": cn.HertzMindlin(young=1e7, poisson=0.3, restitution=0.5, mu=0.5),
    "elastic": cn.HertzMindlin(young=1e7, poisson=0.3, restitution=1.0, mu=0.5),
    "jkr": cn.JKR(young=1e7, poisson=0.3, work=0.1, restitution=0.5, mu=0.5),
    "wet": cn.LiquidBridge(young=1e7, tension=0.07, volume=1e-11, angle=0.2, restitution=0.5, mu=0.5),
    "plastic": cn.PlasticContact(loading=4e3, unloading=8e3, cohesion=1e3, plastic=0.05, mu=0.5),
    "bonded": cn.SmoothBond(normal_stiffness=1e9, tangential_stiffness=5e8, tension=1e4, shear=1e4, within=1e-3),
    "rolling": cn.granular(young=1e7, restitution=0.5, mu=0.5, rolling="spring_dashpot", rolling_mu=0.1),
}


def grains(dim, count, seed=1, speed=1.0, **options):
    rng = np.random.default_rng(seed)
    x = np.stack(np.meshgrid(*[np.arange(count)] * dim, indexing="ij"), -1).reshape(-1, dim) * 2.3 * R + 1.3 * R
    v = np.zeros((len(x), 3 * dim - 3))
    v[:, :dim] = speed * rng.uniform(-1, 1, x.shape)
    x = x + 0.1 * R * rng.uniform(-1, 1, x.shape)
    return (cn.disks if dim == 2 else cn.spheres)(x, R * rng.uniform(0.8, 1.1, len(x)), ROCK, velocity=v, **options)


def box(dim, width, **options):
    axes = np.eye(dim)
    sides = [cn.wall(0 * axes[k], axes[k], ROCK, **options) for k in range(dim)]
    return sides + [cn.wall(width * axes[k], -axes[k], ROCK) for k in range(dim - 1)]


def heap(dim, law, share=0.1, count=3, speed=1.0, strategy=None):
    scene = cn.Scene(dim, gravity=tuple(-9.81 * np.eye(dim)[-1]))
    scene.add(grains(dim, count, speed=speed), *box(dim, 2.3 * R * count + R))
    scene.interact("*", "*", law)
    return settle(scene, share, strategy)


def settle(scene, share=0.1, strategy=None):
    sim = cn.Simulation(scene, 1e-9, strategy or cn.SmoothDEM(), overlap="ignore")
    sim.dt = share * sim.stable_step
    return sim


def run(sim, time):
    for _ in range(int(time / sim.dt)):
        sim.step()
    return sim.energy


def total(e):
    """The sum of all terms, from their names alone: kinetic and stored energies are those of now."""
    gone = sum(v for k, v in e.items() if k.startswith("dissipated_")) + e["released"]
    put_in = e["work_driven"] + e["work_external"]
    return e["kinetic"] + e["potential"] + e["stored"] + gone - put_in


def closes(sim, time, start=None):
    start = total(sim.energy) if start is None else start
    e = run(sim, time)
    assert e["in_play"] > 0
    assert abs(e["closure"]) < 1e-12 * e["in_play"], e
    return e


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("law", LAWS)
def test_a_heap_closes_under_every_law(dim, law):
    sim = heap(dim, LAWS[law])
    sim.step()
    start = total(sim.energy)
    e = closes(sim, 0.03)
    assert abs(total(e) - start) < 1e-12 * e["in_play"]
    assert abs(e["dissipated_integrator"]) < 0.1 * e["in_play"], e


@pytest.mark.parametrize("law", ["linear", "hertz", "elastic"])
def test_what_the_steps_lose_falls_with_them(law):
    lost = []
    for share in (0.2, 0.05):
        e = run(heap(3, LAWS[law], share), 0.02)
        lost.append(abs(e["dissipated_integrator"]) / e["in_play"])
    assert lost[1] < 0.4 * lost[0] or lost[1] < 1e-5, lost


def test_springs_that_change_are_released():
    """Mindlin's stiffness follows the normal force while its spring is stretched: an error of the steps if uncounted."""
    e = closes(heap(3, LAWS["hertz"]), 0.03)
    assert abs(e["released"]) > 1e-6 * e["in_play"]
    e = closes(heap(3, cn.HertzMindlin(young=1e7, poisson=0.3, restitution=0.5, mu=0.0)), 0.03)
    assert e["released"] == 0


@pytest.mark.parametrize("dim", [2, 3])
def test_loads_drags_and_drives_close(dim):
    """Applied forces, viscous drag, a floor that a function drives and a wall that moves on without a drive."""
    scene = cn.Scene(dim, gravity=tuple(-9.81 * np.eye(dim)[-1]))
    up, lift = np.eye(dim)[-1], "vy" if dim == 2 else "vz"
    push = np.zeros((3**dim, 3 * dim - 3))
    push[:, 0] = 1e-2
    scene.add(grains(dim, 3, damping=20.0, force=push), *box(dim, 2.3 * R * 3 + R)[1 - dim :])
    floor = scene.add(cn.wall(0 * up, up, ROCK))
    scene.interact("*", "*", LAWS["linear"])
    sim = settle(scene)
    sim.drive(floor, lift, cn.Expression("0.2*sin(1200*t)"))
    e = closes(sim, 0.03)
    assert abs(e["work_driven"]) > 1e-4 * e["in_play"] and abs(e["work_external"]) > 1e-4 * e["in_play"]
    assert e["dissipated_bulk"] > 0


def test_bodies_of_unequal_moments_close():
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    rng = np.random.default_rng(2)
    x = np.stack(np.meshgrid(*[np.arange(2)] * 3, indexing="ij"), -1).reshape(-1, 3) * 4.5 * R + 3 * R
    v = np.concatenate([rng.uniform(-1, 1, (8, 3)), rng.uniform(-50, 50, (8, 3))], axis=1)
    mass = 2 * 4 / 3 * np.pi * R**3 * 2500
    moments = mass * R**2 * np.array([0.4, 1.4, 1.2])
    scene.add(cn.clumps(x, [[-R, 0, 0], [R, 0, 0]], [R, R], mass, moments, ROCK, velocity=v), *box(3, 13 * R))
    scene.interact("*", "*", LAWS["linear"])
    closes(settle(scene), 0.03)


def test_a_mesh_and_local_damping_close():
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    corners = 0.05 * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    scene.add(grains(3, 3), cn.surface(corners, [[0, 1, 2], [0, 2, 3]], ROCK))
    scene.interact("*", "*", LAWS["linear"])
    closes(settle(scene), 0.02)
    closes(heap(3, LAWS["hertz"], strategy=cn.SmoothDEM(local_damping=0.5)), 0.02)


def test_a_sheared_cell_is_paid_for():
    """The work of a cell that shears a dense packing goes to friction, dashpots and springs, up to the error of the steps."""
    count, pitch = 4, 1.9 * R
    x = np.stack(np.meshgrid(*[np.arange(count)] * 2, indexing="ij"), -1).reshape(-1, 2) * pitch
    scene = cn.Scene(2, periodic=cn.Periodic((count * pitch,) * 2, rate={"xy": 5.0}))
    scene.add(cn.disks(x + 0.02 * R * np.random.default_rng(1).uniform(-1, 1, x.shape), R, ROCK))
    scene.interact("*", "*", LAWS["linear"])
    e = closes(settle(scene, 0.05), 0.05)
    assert e["work_driven"] > 0
    assert abs(e["dissipated_integrator"]) < 0.02 * e["in_play"], e


def test_a_run_goes_on_with_the_same_balance(tmp_path):
    half, whole, second = (heap(3, LAWS["hertz"]) for _ in range(3))
    for _ in range(300):
        half.step()
    half.checkpoint(tmp_path / "half.h5")
    second.restore(tmp_path / "half.h5")
    for _ in range(50):
        second.step()
    for _ in range(350):
        whole.step()
    assert whole.energy == second.energy and whole.energy["released"] != 0
