"""Velocities of solids of bonds: errors of contacts say little of a long row, each of whose bonds misses little."""

import cairn as cn
import numpy as np
import pytest

STEP, GRAVITY, RADIUS = 1e-3, 9.81, 0.05


def clamped(place, law, solver, dim=2, **options):
    """Round bodies that touch, held where x is least, under their weight."""
    material, held = cn.Material("stone", density=2000.0), place[:, 0] < RADIUS
    scene = cn.Scene(dim=dim, gravity=[0.0] * (dim - 1) + [-GRAVITY])
    make, dofs = (cn.disks, ("vx", "vy", "w")) if dim == 2 else (cn.spheres, ("vx", "vy", "vz", "wx", "wy", "wz"))
    scene.add(make(place[held], RADIUS, material, driven=dofs), make(place[~held], RADIUS, material))
    scene.interact(material, material, law)
    return cn.Simulation(scene, STEP, cn.NSCD(solver=solver, **options))


def row(count, dim=2):
    return np.column_stack([2 * RADIUS * np.arange(count)] + [np.zeros(count)] * (dim - 1))


def lattice(columns, rows):
    return np.array([[RADIUS * (2 * i + j % 2), np.sqrt(3) * RADIUS * j] for i in range(columns) for j in range(rows)])


def fastest(sim):
    """The largest velocity over that which a step of weight alone makes."""
    return np.abs(sim.bodies.velocity[:, : sim.scene.dim]).max() / (GRAVITY * STEP)


@pytest.mark.parametrize("tol", [1e-3, 1e-4, 1e-8])
@pytest.mark.parametrize("count", [60, 200, 500])
def test_a_clamped_row_stands_by_default(count, tol):
    """By sweeps alone 120 disks fall by 78 % of the free velocity in a step that ends within 1e-4."""
    sim = clamped(row(count), cn.Bonded(mu=0.3), cn.Default(tol=tol))
    for _ in range(20):
        assert sim.step()["status"] == "converged"
        assert fastest(sim) < max(10 * tol, 1e-6)
    # what steps leave of slips and turns does not add up
    assert np.linalg.norm(sim.bodies.position[-1] - row(count)[-1]) < max(20 * tol, 1e-5) * GRAVITY * STEP**2


@pytest.mark.parametrize("columns, rows", [(40, 20), (80, 5)])
def test_a_clamped_lattice_stands_by_default(columns, rows):
    """Its bonds are more than hold it, so that their impulses may be in balance with each other by any amount."""
    sim = clamped(lattice(columns, rows), cn.Bonded(mu=0.3), cn.Default())
    for _ in range(10):
        assert sim.step()["status"] == "converged"
        assert fastest(sim) < 1e-3
    assert sim.info["iterations"] <= 2


def test_a_clamped_row_of_spheres_stands_by_default():
    sim = clamped(row(100, dim=3), cn.Bonded(mu=0.3), cn.Default(), dim=3)
    for _ in range(10):
        assert sim.step()["status"] == "converged"
        assert fastest(sim) < 1e-3


@pytest.mark.parametrize("stiffness, accuracy", [(1e9, None), (1e14, 1e-3), (1e17, 1e-3)])
def test_stiff_springs_move_as_they_do_in_a_step_solved_further(stiffness, accuracy):
    law = cn.ParallelBond(normal_stiffness=stiffness, tangential_stiffness=0.4 * stiffness, within=1e-6)
    sim = clamped(row(100), law, cn.Auto(), accuracy=accuracy)
    exact = clamped(row(100), law, cn.Auto(tol=1e-8, max_iter=10000), accuracy=accuracy and 1e-5)
    for _ in range(4):
        assert sim.step()["status"] == exact.step()["status"] == "converged"
        of = exact.bodies.velocity[:, :2]
        scale = max(np.linalg.norm(of), GRAVITY * STEP * np.sqrt(len(of)))
        assert np.linalg.norm(sim.bodies.velocity[:, :2] - of) <= 1e-3 * scale


@pytest.mark.parametrize("stiffness", [1e15, 1e16, 1e17, 1e20])
@pytest.mark.parametrize("count", [20, 60, 100])
def test_springs_that_hold_fast_in_a_step_do_so_by_default(stiffness, count):
    """Far stiffer than a step sees, of 60 disks they left up to .8 of the free velocity where .02 remain."""
    law = cn.ParallelBond(normal_stiffness=stiffness, tangential_stiffness=0.4 * stiffness, within=1e-6)
    sim = clamped(row(count), law, cn.Auto())
    exact = clamped(row(count), law, cn.Auto(tol=1e-8, max_iter=10000), accuracy=1e-4)
    for _ in range(6):
        assert sim.step()["status"] == exact.step()["status"] == "converged"
        of = exact.bodies.velocity[:, :2]
        scale = max(np.linalg.norm(of), GRAVITY * STEP * np.sqrt(len(of)))
        assert np.linalg.norm(sim.bodies.velocity[:, :2] - of) <= 2e-3 * scale


def test_accuracy_is_reached_where_bonds_are_more_than_hold():
    sim = clamped(lattice(40, 10), cn.Bonded(mu=0.3), cn.Auto(), accuracy=1e-3)
    for _ in range(5):
        info = sim.step()
        assert info["status"] == "converged" and info["velocity_error"] <= 1e-3
        assert fastest(sim) < 1e-3


def test_what_rounding_hides_is_told():
    """Impulses known to 16 digits leave the velocities of 5,000 disks in a row unknown."""
    sim = clamped(row(5000), cn.Bonded(mu=0.3), cn.Default())
    for _ in range(3):
        info = sim.step()
        assert info["status"] == "iteration_limit" and "velocity_error" in info["hint"]
        assert info["velocity_error"] > info["error"] and info["error"] <= 1e-4


def test_lumps_that_fall_restart_to_the_same_bits(tmp_path):
    """The history of passes continues with a restart: passes are made, or skipped after they failed, as before."""
    material = cn.Material("stone", density=2000.0)
    scene = cn.Scene(dim=2, gravity=(0.0, -GRAVITY))
    floor = np.column_stack([0.1 * np.arange(-10, 30), np.full(40, -RADIUS)])
    for turn in (0.3, 1.1):
        c, s = np.cos(turn), np.sin(turn)
        scene.add(cn.disks(lattice(12, 5) @ [[c, s], [-s, c]] + [turn, 0.7 + turn], RADIUS, material))
    scene.add(cn.disks(floor, RADIUS, material, driven=("vx", "vy", "w")))
    scene.interact(material, material, cn.Bonded(mu=0.3))
    sim = cn.Simulation(scene, STEP, cn.NSCD())
    for _ in range(400):
        sim.step()
    sim.checkpoint(tmp_path / "middle.h5")
    again = cn.Simulation(scene, STEP, cn.NSCD())
    again.restore(tmp_path / "middle.h5")
    for _ in range(100):
        sim.step(), again.step()
    np.testing.assert_array_equal(sim.bodies.velocity, again.bodies.velocity)
    np.testing.assert_array_equal(sim.bodies.position, again.bodies.position)
