"""A disc of bonded disks between two plates splits along the loaded diameter at a share of the strength of its bonds."""

import cairn as cn
import numpy as np

RADIUS, YOUNG, STRENGTH = 1e-3, 1e9, 5e6
GRAIN, PLATE = cn.Material("grain", density=2600.0), cn.Material("plate", density=2600.0)


def packed(across, seed=2):
    """Centres and radii of disks that grew in a periodic cell until they jammed."""
    rng = np.random.default_rng(seed)
    count = int(0.85 * across**2 * 4 / np.pi)
    final = RADIUS * rng.uniform(0.75, 1.25, count)
    length = np.sqrt(np.pi * np.sum(final**2) / 0.845)
    side = int(np.ceil(np.sqrt(count)))
    grid = np.stack(np.meshgrid(np.arange(side), np.arange(side), indexing="ij"), -1).reshape(-1, 2)[:count]
    scene = cn.Scene(2, periodic=cn.Periodic((length, length)))
    velocity = 0.5 * rng.normal(size=(count, 3)) * [1, 1, 0]
    ids = scene.add(cn.disks((grid + 0.5) * length / side, 0.7 * final, GRAIN, velocity=velocity))
    scene.interact("*", "*", cn.LinearSpring(stiffness=YOUNG / 100, restitution=0.3))
    sim = cn.Simulation(scene, "stable", cn.SmoothDEM(), overlap="ignore")
    sim.grow(ids, -np.log(0.7) / (2000 * sim.dt))
    sim.run(steps=2000, progress=False)
    sim.grow(ids, None)
    sim.run(steps=500, progress=False)
    return sim.bodies.position % length - length / 2, sim.radii(), length


def test_a_brazilian_disc_splits():
    """Strength 2 P/(pi D t) over that of a bond: Potyondy & Cundall (2004) have 0.28 in 2D; packs of 20 across 0.17 to 0.4."""
    x, r, length = packed(14)
    inside = np.linalg.norm(x, axis=1) + r < 0.45 * length
    x, r = x[inside], r[inside]
    low, high, speed = (x[:, 1] - r).min(), (x[:, 1] + r).max(), 0.15
    size = high - low
    scene = cn.Scene(2)
    scene.add(cn.disks(x, r, GRAIN))
    foot = int(scene.add(cn.wall((0, low), (0, 1), PLATE, velocity=(0, speed, 0)))[0])
    head = int(scene.add(cn.wall((0, high), (0, -1), PLATE, velocity=(0, -speed, 0)))[0])
    stiffness = YOUNG / (2 * RADIUS)
    bond = dict(normal_stiffness=stiffness, tangential_stiffness=0.4 * stiffness, tension=STRENGTH, shear=STRENGTH, mu=0.5)
    scene.interact(GRAIN, GRAIN, cn.SmoothBond(**bond, radius=1.0, within=0.15 * RADIUS, damping=0.05))
    scene.interact(GRAIN, PLATE, cn.LinearSpring(stiffness=YOUNG, mu=0.3, restitution=0.5))
    sim = cn.Simulation(scene, "stable", cn.SmoothDEM(local_damping=0.3), overlap="ignore")
    sim.step()
    bonds = np.sort(sim.contacts.bodies[np.all(sim.contacts.bodies < foot, axis=1)], axis=1)
    loads = [0.0]
    while 2 * speed * sim.time < 0.05 * size and loads[-1] >= 0.5 * max(loads):
        sim.run(steps=50, progress=False)
        loads.append(0.5 * (sim.bodies.contact_force[head, 1] - sim.bodies.contact_force[foot, 1]))
    peak, half = max(loads), loads[: int(np.argmax(loads))]
    assert 0.12 < 2 * peak / np.pi / size / STRENGTH < 0.45
    assert loads[-1] < 0.5 * peak and len(loads) - len(half) < 0.4 * len(loads)  # it bears until it fails at once
    held = np.abs(np.reshape(sim.contacts.moment, len(sim.contacts.gap))) > 0
    whole = set(map(tuple, np.sort(sim.contacts.bodies[held], axis=1).tolist()))
    middle = np.abs(x[[pair for pair in bonds.tolist() if tuple(pair) not in whole]].mean(axis=1)[:, 0]) < size / 4
    assert len(middle) > 8 and middle.mean() > 0.6
