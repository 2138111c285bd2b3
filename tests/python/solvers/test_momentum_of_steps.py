"""Velocities of a step are those of its impulses, also where heavy bodies lie on light ones and the last digits are refined."""

import cairn as cn
import numpy as np
import pytest


def heap(mu, ratio, seed, count=36):
    """Disks of two densities in a box."""
    rng = np.random.default_rng(seed)
    radius, side = 0.05 * (1 + 0.3 * rng.uniform(-1, 1, count)), int(np.sqrt(count))
    k = np.arange(count)
    center = np.stack([0.15 * (k % side) + 0.02 * (k // side % 2) + 0.2, 0.12 * (k // side) + 0.1], axis=1)
    heavy, rock = rng.uniform(size=count) > 0.5, cn.Material("rock", density=2000.0)
    scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
    scene.add(cn.disks(center[~heavy], radius[~heavy], rock))
    scene.add(cn.disks(center[heavy], radius[heavy], rock, density=2000.0 * ratio))
    for point, normal in (((0, 0), (0, 1)), ((0.05, 0), (1, 0)), ((0.15 * side + 0.25, 0), (-1, 0))):
        scene.add(cn.wall(point, normal, rock))
    scene.interact(rock, rock, cn.Coulomb(mu=mu))
    return scene, count


def missed(sim, before, count, dt):
    """Largest part of the momentum of a body that its impulses and weight do not say, beside the largest sum of the sizes of
    impulses on a body and of its momentum."""
    contacts, bodies = sim.contacts, sim.bodies
    if not len(contacts):
        return 0.0
    given, sizes = np.zeros((len(bodies), 2)), np.zeros((len(bodies), 2))
    for side, sign in ((0, 1.0), (1, -1.0)):
        np.add.at(given, contacts.bodies[:, side], sign * contacts.impulse)
        np.add.at(sizes, contacts.bodies[:, side], np.linalg.norm(contacts.impulse, axis=1)[:, None])
    mass, velocity = bodies.mass[:count, None], bodies.velocity[:count, :2]
    gained = mass * (velocity - before + (0.0, 10.0 * dt))
    sizes = sizes[:count] + np.linalg.norm(gained, axis=1, keepdims=True) + mass * np.linalg.norm(velocity, axis=1, keepdims=True)
    return np.abs(gained - given[:count]).max() / sizes.max()


@pytest.mark.parametrize("mu, ratio, seed", [(0.0, 1e3, 0), (0.5, 1e3, 0), (0.0, 1e6, 1), (0.5, 1e6, 0)])
def test_impulses_say_what_velocities_became(mu, ratio, seed):
    """Steps along what W hardly feels left rounding in velocities that the impulses knew nothing of, in some steps of a fall. The
    gate is that of the refinement of velocities, which refuses more than 2^-32 of the impulses and the momentum of a body."""
    scene, count = heap(mu, ratio, seed)
    sim, worst = cn.Simulation(scene, dt=2e-3, strategy=cn.NSCD()), 0.0
    for _ in range(250):
        before = sim.bodies.velocity[:count, :2].copy()
        sim.step()
        worst = max(worst, missed(sim, before, count, 2e-3))
    assert worst < 2.0**-32
    assert abs(sim.energy["closure"]) < 1e-10 * sim.energy["in_play"]
