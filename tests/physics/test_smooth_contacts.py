"""Smooth contacts against closed forms: Hertz's impact, restitution, three balls, a wave in a chain, JKR's pull-off, sliding."""

import cairn as cn
import numpy as np
import pytest
from report import judge

R, E, NU, RHO = 0.005, 1e9, 0.3, 2500.0
ROCK = cn.Material("rock", density=RHO)
MASS = RHO * 4 / 3 * np.pi * R**3
E_STAR = E / (2 * (1 - NU**2))
HERTZ = 4 / 3 * E_STAR * np.sqrt(R / 2)  # f = HERTZ delta^1.5 of two equal spheres


def row(count, law, dt, velocity, gap=0.0, wall=False, **strategy):
    """Spheres on a line along x that just touch, or gap apart."""
    x, v = np.zeros((count, 3)), np.zeros((count, 3))
    x[:, 0] = (2 * R + gap) * np.arange(count)
    v[0, 0] = velocity
    scene = cn.Scene(3)
    scene.add(cn.spheres(x, R, ROCK, velocity=v))
    if wall:
        scene.add(cn.wall((x[-1, 0] + R, 0, 0), (-1, 0, 0), ROCK))
    scene.interact(ROCK, ROCK, law)
    return cn.Simulation(scene, dt, cn.SmoothDEM(**strategy), overlap="ignore")


def impact_time(speed, mass=MASS / 2, radius=R / 2):
    """Duration 2.9433 d/v of Hertz's impact and its deepest overlap d."""
    deepest = (15 * mass * speed**2 / (16 * E_STAR * np.sqrt(radius))) ** 0.4
    return 2.9432750 * deepest / speed, deepest


@pytest.mark.parametrize("speed", [1e-3, 1.0, 10.0])
def test_duration_and_depth_of_an_impact_by_hertz(speed):
    duration, deepest = impact_time(speed)
    dt = duration / 1000
    sim = row(2, cn.HertzMindlin(young=E), dt, speed)
    touching, depth = 0, 0.0
    for _ in range(1100):
        info = sim.step()
        touching += info["contacts"] > 0
        depth = max(depth, info["penetration"] * R / 2)
    judge("duration", touching * dt, duration, 2e-3)
    judge("overlap", depth, deepest, 1e-5)
    judge("velocities exchanged", sim.bodies.velocity[:, 0], [0, speed], 1e-4, scale=speed)


@pytest.mark.parametrize("e", [0.1, 0.5, 0.9, 1.0])
@pytest.mark.parametrize("wall", [False, True])
@pytest.mark.parametrize("law", [cn.HertzMindlin, cn.LinearSpring])
def test_restitution_is_what_the_law_says(law, e, wall):
    stiffness = {"young": E} if law is cn.HertzMindlin else {"stiffness": 1e6}
    errors = []
    for steps in (100, 400):
        duration = impact_time(1.0)[0] if law is cn.HertzMindlin else np.pi * np.sqrt(MASS / 2 / 1e6)
        sim = row(1 if wall else 2, law(restitution=e, **stiffness), 1.5 * duration / steps, 1.0, wall=wall)
        for _ in range(6 * steps):
            sim.step()
        v = sim.bodies.velocity[:, 0]
        judge("momentum", v[:2].sum() if not wall else 0.0, 0.0 if wall else 1.0, 1e-12, scale=1.0)
        errors.append(abs((v[0] if wall else v[0] - v[1]) / -1.0 - e))
    judge("restitution", errors[-1], 0.0, 2e-3, scale=1.0)
    assert errors[1] < 0.5 * errors[0] or errors[1] < 1e-4


def test_three_balls_with_hertz():
    """Struck at one end they leave with (-.0710, .0764, .9945) of the speed."""
    duration = impact_time(1.0)[0]
    sim = row(3, cn.HertzMindlin(young=E), duration / 4000, 1.0)
    for _ in range(16000):
        sim.step()
    assert sim.info["contacts"] == 0
    judge("velocities", sim.bodies.velocity[:, 0], [-0.0710, 0.0764, 0.9945], 1e-4, scale=1.0)


def test_wave_in_a_chain_without_precompression():
    """Nesterenko's wave travels at V = .9055 D k^(1/3) m^(-1/2) F^(1/6), F its greatest force (Coste et al. 1997)."""
    count, first, last = 60, 30, 50
    dt = impact_time(1.0)[0] / 400
    sim = row(count, cn.HertzMindlin(young=E), dt, 1.0)
    forces = []
    while sim.bodies.velocity[last + 3, 0] < 0.05:
        sim.step()
        x = sim.bodies.position[:, 0]
        forces.append(HERTZ * np.maximum(0, 2 * R - np.diff(x)[[first, last]]) ** 1.5)
    forces, peaks = np.array(forces), []
    for history in forces.T:
        k = np.argmax(history)
        below, top, above = history[k - 1 : k + 2]
        shift = 0.5 * (below - above) / (below - 2 * top + above)
        peaks.append(((k + shift) * dt, top - 0.25 * (below - above) * shift))
    speed = (last - first) * 2 * R / (peaks[1][0] - peaks[0][0])
    judge("the wave keeps its height", peaks[1][1], peaks[0][1], 1e-3)
    judge("speed", speed, 0.9055 * 2 * R * HERTZ ** (1 / 3) * MASS**-0.5 * peaks[1][1] ** (1 / 6), 1e-3)


@pytest.mark.parametrize("work", [1e-3, 1.0, 100.0])
def test_pull_off_by_jkr(work):
    """Led apart slowly, two spheres hold each other with at most 1.5 pi w R, R the effective radius."""
    tear, steps, dt = 0.75 * (np.pi**2 * work**2 * R / 2 / E_STAR**2) ** (1 / 3), 4000, 1e-7
    held = ("vx", "vy", "vz", "wx", "wy", "wz")
    scene = cn.Scene(3)
    scene.add(cn.spheres([[0.0, 0, 0]], R, ROCK, driven=held))
    scene.add(cn.spheres([[2 * R - tear, 0, 0]], R, ROCK, driven=held, drive=(3 * tear / steps / dt, 0, 0, 0, 0, 0)))
    scene.interact(ROCK, ROCK, cn.JKR(young=E, work=work))
    sim = cn.Simulation(scene, dt, cn.SmoothDEM(unstable="ignore"), overlap="ignore")
    pull = []
    for _ in range(steps):
        sim.step()
        pull.append(-sim.bodies.contact_force[1, 0])
    judge("pull-off", max(pull), 1.5 * np.pi * work * R / 2, 1e-4)
    assert pull[-1] == 0.0
    last = np.flatnonzero(pull)[-1] + 1
    judge("gap at which the neck tears", 3 * tear * last / steps - tear, tear, 2e-3)


@pytest.mark.parametrize(
    "law",
    [cn.LinearSpring(stiffness=1e6, mu=0.3, restitution=0.5), cn.HertzMindlin(young=E, mu=0.3, restitution=0.5)],
)
def test_slip_turns_to_rolling(law):
    """A sphere sent sliding rolls at 5/7 of its speed."""
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    depth = 1e-7
    scene.add(cn.spheres([[0, 0, R - depth]], R, ROCK, velocity=(0.1, 0, 0)), cn.wall((0, 0, 0), (0, 0, 1), ROCK))
    scene.interact(ROCK, ROCK, law)
    sim = cn.Simulation(scene, 1e-6, cn.SmoothDEM(), overlap="ignore")
    for _ in range(30000):
        sim.step()
    v = sim.bodies.velocity[0]
    judge("rolling", v[0] - R * v[4], 0.0, 1e-3, scale=0.1)
    judge("speed", v[0], 5 / 7 * 0.1, 1e-3)
    energy = sim.energy
    judge("friction takes 2/7 of the energy", energy["dissipated_friction"], 2 / 7 * MASS * 0.1**2 / 2, 1e-2)
    assert abs(energy["closure"]) < 1e-3 * energy["in_play"]


def test_tangential_spring_turns_with_the_pair():
    """Two spheres that turn together as one solid, about any axis, keep the force they had, turned with them."""
    depth, dt, steps, angle = 1e-5, 1e-5, 4000, 1.0
    axis = np.array([0.0, 0.6, 0.8])
    x = np.array([[-R + depth / 2, 0, 0], [R - depth / 2, 0, 0]])
    shear, begin = np.array([[0, 0.05, 0, 0, 0, 0], [0, -0.05, 0, 0, 0, 0]]), 4 * dt
    rate = angle / (steps * dt)
    start = x + shear[:, :3] * (begin - dt / 2)  # the last step before has the mean of both velocities

    def drive(t):
        if t < begin - dt / 2:
            return shear
        place = rotate(axis, rate * (t - begin + dt / 2), start)
        return np.hstack([np.cross(rate * axis, place), np.tile(rate * axis, (2, 1))])

    scene = cn.Scene(3)
    scene.add(cn.spheres(x, R, ROCK, driven=("vx", "vy", "vz", "wx", "wy", "wz"), drive=drive))
    scene.interact(ROCK, ROCK, cn.LinearSpring(stiffness=1e3, ratio=1.0, mu=10.0))
    sim = cn.Simulation(scene, dt, cn.SmoothDEM(), overlap="ignore")
    for _ in range(6):  # in the fourth the drive turns from one motion to the other
        sim.step()
    before, normal = sim.contacts.force[0], sim.contacts.normal[0]
    tangential = np.linalg.norm(before - normal * (before @ normal))
    assert tangential > 1e-3
    for _ in range(steps):
        sim.step()
    judge("force", sim.contacts.force[0], rotate(axis, angle, before[None])[0], 5e-3, scale=tangential)


def rotate(axis, angle, vectors):
    """Rodrigues' formula."""
    parallel = (vectors @ axis)[:, None] * axis
    return parallel + np.cos(angle) * (vectors - parallel) + np.sin(angle) * np.cross(axis, vectors)
