"""Strategies beside NSCD on cases with a closed form: Carpenter's scheme, the granular element method, springs of smooth DEM."""

import cairn as cn
import numpy as np
import pytest
from cairn.model.elastic import ElasticBody
from report import judge
from test_elastic import grid

ROCK = cn.Material("rock", density=2500.0)
SHARP = cn.NLGS(tol=1e-10, max_iter=100000)
G, RADIUS = 10.0, 0.1
WEIGHT = G * 2500 * np.pi * RADIUS**2
STIFF = 1e5 * WEIGHT / RADIUS  # an overlap of 1e-5 radius under the weight of a grain
STRATEGIES = {
    "NSCD": (cn.NSCD(solver=SHARP), 1e-3),
    "Carpenter": (cn.Carpenter(solver=SHARP), 1e-3),
    "Carpenter by penalty": (cn.Carpenter(solver=SHARP, penalty=STIFF), 1e-3),
    "granular element": (cn.GranularElement(solver=SHARP, stiffness=STIFF), 1e-3),
    "smooth DEM": (cn.SmoothDEM(), 3e-5),
}


def pile():
    """One grain on two that lean on walls, without friction; (scene of cones, scene of springs)."""
    apart = 1.2 * RADIUS  # half the distance of the lower centres
    height = np.sqrt((2 * RADIUS) ** 2 - apart**2)
    centres = [[-apart, RADIUS], [apart, RADIUS], [0, RADIUS + height]]
    scenes = []
    for law in (cn.Coulomb(mu=0.0), cn.LinearSpring(stiffness=STIFF, restitution=0.2, mu=0.0)):
        scene = cn.Scene(dim=2, gravity=(0, -G))
        scene.add(cn.disks(centres, RADIUS, ROCK, damping=20.0))
        low, high = (-apart - RADIUS, 0.0), (apart + RADIUS, 1.0)
        scene.add(cn.box(low, high, ROCK, lid=False))
        scene.interact(ROCK, ROCK, law)
        scenes.append(scene)
    return scenes, apart / height


@pytest.mark.parametrize("name", STRATEGIES)
def test_pile_of_three(name):
    """Floors carry 3/2 of a weight, walls tan(a)/2, the contacts between 1/(2 cos a)."""
    strategy, dt = STRATEGIES[name]
    scenes, slope = pile()
    sim = cn.Simulation(scenes[name == "smooth DEM"], dt=dt, strategy=strategy, overlap="ignore")
    while sim.time < 0.6:
        sim.step()
    force, pairs = np.linalg.norm(sim.contacts.impulse, axis=1) / dt, np.sort(sim.contacts.bodies, axis=1)
    found = {tuple(pair): f for pair, f in zip(pairs.tolist(), force) if f > 1e-6 * WEIGHT}
    floor = [found[key] for key in found if np.isclose(found[key], 1.5 * WEIGHT, rtol=0.2) and max(key) > 2]
    walls = [found[key] for key in found if max(key) > 2 and not np.isclose(found[key], 1.5 * WEIGHT, rtol=0.2)]
    between = [found[key] for key in found if max(key) <= 2]
    gate = 1e-8 if name in ("NSCD", "Carpenter") else 1e-4  # springs change the angle by their overlap
    judge("floor", floor, np.full(2, 1.5 * WEIGHT), gate)
    judge("walls", walls, np.full(2, WEIGHT * slope / 2), gate)
    judge("between", between, np.full(2, WEIGHT * np.hypot(1, slope) / 2), gate)


@pytest.mark.parametrize("strategy", [cn.NSCD(theta=1.0, solver=SHARP), cn.Carpenter(solver=SHARP)], ids=["NSCD", "Carpenter"])
def test_stack_of_stiff_blocks(strategy):
    """Three elastic blocks on each other: each face carries the weight above it."""
    scene = cn.Scene(dim=2, gravity=(0, -G))
    weight = 2500 * G
    for k in range(3):
        points, cells = grid(2, (2, 2), (1.0, 1.0))
        points[:, 1] += k
        low, high = (np.flatnonzero(np.isclose(points[:, 1], y)) for y in (k, k + 1))
        body = ElasticBody(points, cells, young=1e3 * weight, poisson=0.2, density=2500.0, lumped=True, rayleigh=(30.0, 0.0))
        scene.add(cn.deformable(body, ROCK, contact=low, edges=high, name=f"block {k}"))
    scene.add(cn.wall((0, 0), (0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, dt=2e-3, strategy=strategy, overlap="ignore")
    while sim.time < 1.6:
        sim.step()
    force, height = sim.contacts.impulse[:, 1] / sim.dt, sim.contacts.point[:, 1]
    for k in range(3):
        judge(f"face {k}", np.abs(force[np.abs(height - k) < 0.1]).sum(), (3 - k) * weight, 1e-6)


@pytest.mark.parametrize("theta, gate", [(0.5, 5e-3), (1.0, 0.5)])
def test_granular_element_on_its_spring(theta, gate):
    """y = -(m g / k) (1 - cos w t); with theta = 1/2 of second order, with theta = 1 damped."""
    mass = 2500 * np.pi * RADIUS**2
    omega = np.sqrt(STIFF / mass)
    scene = cn.Scene(dim=2, gravity=(0, -G))
    scene.add(cn.disks([[0, RADIUS]], RADIUS, ROCK), cn.wall((0, 0), (0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.5))
    errors = []
    for steps in (100, 200):
        strategy = cn.GranularElement(stiffness=STIFF, theta=theta, solver=cn.NLGS(tol=1e-12))
        sim = cn.Simulation(scene, dt=2 * np.pi / omega / steps, strategy=strategy)
        worst = 0.0
        for _ in range(3 * steps):
            sim.step()
            exact = -WEIGHT / STIFF * (1 - np.cos(omega * sim.time))
            worst = max(worst, abs(sim.bodies.position[0, 1] - RADIUS - exact) * STIFF / WEIGHT)
        errors.append(worst)
    judge("path", errors[1], 0.0, gate, scale=1.0)
    judge("order", np.log2(errors[0] / errors[1]), 2.0 if theta == 0.5 else 1.0, 0.3, scale=1.0)


def test_granular_element_slides_with_friction():
    """A disk that may not turn, pushed aside by half of Coulomb's limit, springs back; by twice that, it slides with mu g."""
    for share in (0.5, 2.0):
        scene = cn.Scene(dim=2, gravity=(0, -G))
        mass = 2500 * np.pi * RADIUS**2
        push = share * 0.5 * WEIGHT
        start = RADIUS - WEIGHT / STIFF
        scene.add(cn.disks([[0, start]], RADIUS, ROCK, driven="w", force=(push, 0)), cn.wall((0, 0), (0, 1), ROCK))
        scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.5))
        sim = cn.Simulation(scene, dt=1e-3, strategy=cn.GranularElement(stiffness=STIFF, ratio=0.5, solver=SHARP))
        for _ in range(200):
            sim.step()
        if share < 1:
            judge("spring", sim.bodies.position[0, 0], push / (0.5 * STIFF), 1e-6)
        else:
            judge("speed", sim.bodies.velocity[0, 0], (push - 0.5 * WEIGHT) / mass * sim.time, 1e-2)


def test_what_is_wrong_is_named():
    with pytest.raises(ValueError, match="stiffness is missing"):
        cn.GranularElement()
    with pytest.raises(ValueError, match="Carpenter's scheme is explicit"):
        cn.Carpenter(theta=0.5)
    with pytest.raises(ValueError, match="penalty"):
        cn.Carpenter(penalty=-1.0)
