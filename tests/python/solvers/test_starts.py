"""Impulses that a step begins from, and those that its solvers find, do not put energy into bodies."""

import cairn as cn
import numpy as np
import pytest


def kinetic(simulation, dim):
    """Kinetic energy of the motion of centres [J]."""
    bodies = simulation.bodies
    return 0.5 * (bodies.mass * (bodies.velocity[:, :dim] ** 2).sum(1)).sum()


def chain(dim, ratio, **options):
    """Ten balls that touch, between two of `ratio` times their density that close on them, under Newton's law."""
    scene, material = cn.Scene(dim), cn.Material("steel", density=2400.0)
    centre, spin = (0.0,) * (dim - 1), (0.0,) * (2 if dim == 2 else 5)
    balls = cn.disks if dim == 2 else cn.spheres
    scene.add(balls([(0.2 * i, *centre) for i in range(10)], [0.1] * 10, material))
    ends = [(-0.2, *centre), (2.0, *centre)]
    scene.add(balls(ends, [0.1, 0.1], material, density=2400.0 * ratio, velocity=[[1.0, *spin], [-0.5, *spin]]))
    scene.interact("*", "*", cn.Restitution(normal=0.5, tangential=0.0, mu=0.0))
    return cn.Simulation(scene, 1e-3, **options)


def run_without_gain(simulation, dim):
    """Runs 50 steps, none of which may add kinetic energy."""
    energy = kinetic(simulation, dim)
    for _ in range(50):
        simulation.step()
        now = kinetic(simulation, dim)
        assert now <= energy * (1 + 1e-3)
        energy = now


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("ratio", [1e3, 1e6, 1e9, 1e12])
def test_a_chain_between_heavy_balls_gains_no_energy_after_the_impact(dim, ratio):
    """Impulses of the impact are some `ratio` times those of the steps after it, in which the heavy balls part.

    Newton's law with a restitution of .5 leaves them half of their relative velocity, 1.5 m/s.
    """
    simulation = chain(dim, ratio)
    run_without_gain(simulation, dim)
    parting = simulation.bodies.velocity[11, 0] - simulation.bodies.velocity[10, 0]
    assert parting == pytest.approx(0.75, rel=0.02)


@pytest.mark.parametrize("dim", [2, 3])
def test_it_gains_none_over_ranks_either_to_the_same_bits(dim):
    """Ranks sweep alone, so that the impact itself ends at the limit of sweeps; the steps after it begin from nothing."""
    found = []
    for ranks in (1, 3):
        simulation = chain(dim, 1e3, ranks=ranks)
        run_without_gain(simulation, dim)
        found.append(np.array(simulation.bodies.velocity))
    assert np.array_equal(*found)


@pytest.mark.parametrize("mu", [0.6, 1.0, 10.0])
def test_spheres_wedged_by_friction_stay_in_their_box(mu):
    """Wedged spheres can carry impulses of any size that balance each other; none may throw them."""
    scene, material = cn.Scene(3, gravity=(0, 0, -9.81)), cn.Material("glass", density=2400.0)
    grid = np.array([(x, y, z) for z in range(4) for x in range(3) for y in range(3)], float)
    scene.add(cn.spheres(grid * 0.024 + 0.013, 0.0105, material))
    scene.add(cn.spheres([(0.0375, 0.0375, 0.13)], 0.018, material))
    scene.add(*cn.box((0, 0, 0), (0.075, 0.075, 0.5), material, lid=False))
    scene.interact("*", "*", cn.Coulomb(mu=mu))
    simulation = cn.Simulation(scene, 1e-3)
    fastest = 0.0
    for _ in range(330):
        simulation.step()
        fastest = max(fastest, np.abs(simulation.bodies.velocity[:37, :3]).max())
    assert fastest < np.sqrt(2 * 9.81 * 0.13)  # of a fall over the whole height
    assert simulation.info["largest_penetration"] < 0.05
