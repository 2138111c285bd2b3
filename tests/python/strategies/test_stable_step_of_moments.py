"""The stable step of smooth DEM beside laws with moments: that of the stiffest mode of a pair, in 2D and in 3D."""

import cairn as cn
import numpy as np
import pytest

STONE = cn.Material("stone", density=2500.0)
R = 2.0**-7


def pair(dim, law, overlap=0.0):
    """Two like balls that touch."""
    x = np.zeros((2, dim))
    x[1, 0] = (2 - overlap) * R
    scene = cn.Scene(dim)
    scene.add((cn.disks if dim == 2 else cn.spheres)(x, R, STONE))
    scene.interact("*", "*", law)
    sim = cn.Simulation(scene, 1e-12, cn.SmoothDEM(unstable="ignore"), overlap="ignore")
    sim.step()
    return sim, sim.bodies.mass[0], np.ravel(sim.bodies.inertia[0])[0]


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("share", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("ratio", [0.01, 0.4, 1.0])
def test_a_bond_is_as_stiff_as_its_section(dim, share, ratio):
    """Modes of two bonded balls: along the normal, in shear with both spins, in bending and in twist with opposite spins."""
    normal = 1e9
    sim, mass, inertia = pair(dim, cn.SmoothBond(normal_stiffness=normal, tangential_stiffness=ratio * normal, radius=share))
    b = share * R
    area, bending = (2 * b, 2 * b**3 / 3) if dim == 2 else (np.pi * b**2, np.pi * b**4 / 4)
    modes = [2 * normal * area / mass, 2 * ratio * normal * area * (1 / mass + R**2 / inertia), 2 * normal * bending / inertia]
    if dim == 3:
        modes.append(2 * ratio * normal * 2 * bending / inertia)
    stable = 2 / np.sqrt(max(modes))
    assert 0.7 * stable < sim.stable_step <= stable * (1 + 1e-12), (sim.stable_step, stable)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_wall_that_holds_a_ball_by_a_bond_leaves_it_stable(dim):
    """A ball on a wall has the widest bond: pushed and turned, it rings within what it was given at the stable step."""
    scene = cn.Scene(dim)
    x, up = np.zeros((1, dim)), np.eye(dim)[-1]
    x[0, -1] = R
    velocity = [[1e-3, 0, 1.0] if dim == 2 else [1e-3, 0, 0, 0, 1.0, 1.0]]
    scene.add((cn.disks if dim == 2 else cn.spheres)(x, R, STONE, velocity=velocity))
    scene.add(cn.wall(np.zeros(dim), up, STONE))
    scene.interact("*", "*", cn.SmoothBond(normal_stiffness=1e9, tangential_stiffness=4e8, radius=1.0))
    sim = cn.Simulation(scene, 1e-9, cn.SmoothDEM(), overlap="ignore")
    sim.step()
    sim.dt = 0.98 * sim.stable_step
    given = sim.energy["kinetic"]
    for _ in range(2000):
        sim.step()
    assert sim.energy["kinetic"] + sim.energy["stored"] < 4 * given


@pytest.mark.parametrize("dim", [2, 3])
def test_a_spring_against_rolling_counts(dim):
    k, mu_r, ratio = 1e5, 2.0, 2.25
    law = cn.granular("hooke", stiffness=k, mu=0.5, rolling="spring_dashpot", rolling_mu=mu_r, rolling_ratio=ratio)
    sim, mass, inertia = pair(dim, law, overlap=1e-3)
    roll = 2 * ratio * k * (mu_r * R / 2) ** 2 / inertia
    assert roll > 2 * k / mass
    assert 0.7 * 2 / np.sqrt(roll) < sim.stable_step <= 2 / np.sqrt(roll)


def test_springs_of_slip_and_twist_count_as_stiff_as_they_are():
    """Beside Hertz a linear spring has its own ratio, and twist a spring: both shorten the step where they are the stiffest."""
    step = lambda **more: pair(3, cn.granular("hertz", young=1e8, mu=0.5, **more), overlap=1e-2)[0].stable_step
    bare, stiff = (step(tangential="linear", ratio=ratio) for ratio in (1.0, 4.0))
    assert stiff == pytest.approx(bare / 2, rel=1e-12)
    assert step(tangential="linear", ratio=4.0, twisting="marshall") < stiff
