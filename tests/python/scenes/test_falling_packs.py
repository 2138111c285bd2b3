"""Packs that fall freely: relative velocities of their bodies are rounding, and no solver turns it into motion."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=2500.0)
SOLVERS = (cn.PPANewton, cn.InteriorPoint, cn.ADMM, cn.AcceleratedGradient, cn.AndersonNLGS, cn.NLGS, cn.Auto)


def falling():
    """Grains that touch each other and two walls, and fall between these at one speed but for the last digit."""
    random = np.random.default_rng(1)
    radii = random.uniform(0.005, 0.01, 120)
    scene = cn.Scene(2, gravity=(0, -9.81))
    scene.add(cn.wall((0, 0), (1, 0), ROCK), cn.wall((0.2, 0), (-1, 0), ROCK))
    velocity = np.zeros((len(radii), 3))
    velocity[:, 1] = -0.5 - 2.0**-53 * random.integers(-3, 4, len(radii))
    scene.add(cn.disks(cn.pre.deposit_disks(radii, 0.2), radii, ROCK, velocity=velocity))
    scene.interact("*", "*", cn.Coulomb(mu=0.4))
    return cn.Simulation(scene, 5e-4, cn.NSCD(threads=1), overlap="ignore")


@pytest.mark.parametrize("solver", SOLVERS)
def test_nothing_but_rounding_moves(solver):
    sim = falling()
    sim.strategy = cn.NSCD(solver=solver(tol=1e-6, max_iter=400), threads=1)
    info = sim.step()
    assert info["contacts"] > 100
    assert info["status"] == "converged" and info["iterations"] <= 1
    assert np.abs(sim.bodies.velocity[:, [0, 2]]).max() < 1e-12  # of speeds of 0.5 m/s
