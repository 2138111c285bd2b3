"""Parallel bonds of any stiffness that the law takes hold, in forces and in strength, as stiff ones do."""

import cairn as cn
import numpy as np
import pytest

STONE = cn.Material("stone", density=2000.0)
R, G = 0.05, 9.81


def clamped(dim, count, law, theta=0.5, speed=0.0):
    """A row that its first body holds, which may move along."""
    places = np.zeros((count, dim))
    places[:, 0] = 2 * R * np.arange(count)
    scene = cn.Scene(dim, gravity=(0.0,) * (dim - 1) + (-G,))
    dofs = ("vx", "vy", "w") if dim == 2 else ("vx", "vy", "vz", "wx", "wy", "wz")
    round_bodies = cn.disks if dim == 2 else cn.spheres
    scene.add(round_bodies(places[:1], R, STONE, driven=dofs, drive=[speed] + [0.0] * (len(dofs) - 1)))
    scene.add(round_bodies(places[1:], R, STONE, velocity=[[speed] + [0.0] * (len(dofs) - 1)] * (count - 1)))
    scene.interact(STONE, STONE, law)
    return cn.Simulation(scene, 1e-3, cn.NSCD(theta=theta)), places


@pytest.mark.parametrize("theta", [0.5, 1.0])
@pytest.mark.parametrize("speed", [0.0, 1.0])
@pytest.mark.parametrize("stiffness", [1e20, 1e26, 1e30])
@pytest.mark.parametrize("dim", [2, 3])
def test_stiff_bonds_are_rigid(dim, stiffness, speed, theta):
    law = cn.ParallelBond(normal_stiffness=stiffness, tangential_stiffness=stiffness)
    sim, places = clamped(dim, 3, law, theta, speed)
    for _ in range(60):
        assert sim.step()["status"] == "converged"
    places[:, 0] += 60e-3 * speed
    assert np.abs(sim.bodies.position - places).max() < 1e-6 * R
    weight = sim.bodies.mass[1:].sum() * G
    assert np.abs(sim.contacts.impulse[:, dim - 1]).max() / 1e-3 == pytest.approx(weight, rel=3e-3)  # at the default tolerance


@pytest.mark.parametrize("share, holds", [(1.1, True), (0.9, False)])
def test_stiff_bonds_break_at_their_strength(share, holds):
    """The moment m g R of a disk on a strip that is R wide: the largest stress is 6 m g / R."""
    stress = share * 6 * 2000.0 * np.pi * R * G
    law = cn.ParallelBond(normal_stiffness=1e28, tangential_stiffness=1e28, tension=stress)
    sim, _ = clamped(2, 2, law)
    for _ in range(40):
        sim.step()
    assert (sim.bodies.position[1, 1] > -1e-6) == holds
