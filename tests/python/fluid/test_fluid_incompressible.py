"""The incompressible liquid, whose pressure is solved with the contacts: weight, release, contacts under water, momentum, refusals."""

import cairn as cn
import numpy as np
import pytest

rock = cn.Material("rock", density=2600.0)


def tank(high=0.6, width=1.0, dim=2, gravity=1.0, spacing=0.05, slip=None, **options):
    """Scene of a tank of half-spaces that liquid fills to a height, and the id of its bed."""
    scene = cn.Scene(dim=dim, gravity=(*(0.0,) * (dim - 1), -gravity))
    bed = scene.add(cn.wall(np.zeros(dim), np.eye(dim)[-1], rock))[0]
    for k in range(dim - 1):
        way = np.eye(dim)[k]
        scene.add(cn.wall(np.zeros(dim), way, rock), cn.wall(width * way, -way, rock))
    scene.add(cn.fluid([np.zeros(dim), [*(width,) * (dim - 1), high]], spacing, incompressible=True, **options))
    if slip:
        scene.interact("fluid", "*", slip)
    return scene, bed


@pytest.mark.parametrize("dim", [2, 3])
def test_weight_and_pressure_of_a_liquid_at_rest(dim):
    spacing = 0.05 if dim == 2 else 0.1
    scene, bed = tank(0.6, 1.0, dim, spacing=spacing)
    sim = cn.Simulation(scene, dt=0.4 * spacing)
    force = []
    for _ in range(40 if dim == 2 else 15):
        sim.step()
        force.append(sim.fluid.force_on(bed)[dim - 1])
    assert abs(np.mean(force[len(force) // 2 :]) / -600.0 - 1) < (1e-3 if dim == 2 else 1e-2)
    depth = 0.6 - sim.fluid.position[:, -1]
    assert np.sqrt(np.mean((sim.fluid.pressure - 1000.0 * depth) ** 2)) < 0.02 * 600.0
    assert sim.report.status == "converged"


def released(share, spacing, size=8.0):
    """Acceleration of a cylinder of radius 0.5 m, held, then let go in a tank of some radii, over that in endless liquid."""
    side = 0.5 * size
    scene, _ = tank(side, side, gravity=9.81, spacing=spacing, slip=cn.FreeSlip())
    wood = cn.Material("wood", density=1000.0 * share)
    ball = scene.add(cn.disks([[side / 2, side / 2]], 0.5, wood, driven=("vx", "vy", "w")))[0]
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, dt=1e-3)
    for _ in range(3):
        sim.step()
    held = sim.fluid.force_on(ball)[1] / (9810 * np.pi * 0.25)
    sim.drive([ball], (), (0.0, 0.0, 0.0))
    for _ in range(3):
        sim.step()
    speed = sim.bodies.velocity[sim.bodies.id == ball][0, 1]
    return held, speed / 3e-3 / ((1 - share) / (1 + share) * 9.81)


@pytest.mark.parametrize("share", [0.001, 0.1, 0.5])
def test_light_bodies_rise_as_in_potential_flow(share):
    # Images of the dipole in walls four radii away: added mass 1 + 2 * 2 zeta(2) / 8**2 = 1.103 of the displaced
    held, found = released(share, 0.125)
    expected = (1 + share) / (1.103 + share)
    assert abs(held - 1) < 0.05
    assert abs(found / expected - 1) < 0.12


def test_a_light_block_presses_on_what_holds_it_down():
    # contact and pressure in one step: the contact bears buoyancy less weight
    share = 0.05
    scene, _ = tank(1.2, 1.2, gravity=9.81, slip=cn.FreeSlip())
    wood = cn.Material("wood", density=1000.0 * share)
    square = 0.15 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    scene.add(cn.polygons(square, rock, position=[[0.6, 0.9]], driven=("vx", "vy", "w")))
    block = scene.add(cn.polygons(square, wood, position=[[0.6, 0.6]]))[0]
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    sim = cn.Simulation(scene, dt=5e-3)
    for _ in range(30):
        sim.step()
        assert sim.report.status == "converged"
    assert abs(sim.bodies.velocity[sim.bodies.id == block][0, 1]) < 1e-3
    force = sum(np.array(sim.contacts.impulse)[:, 1]) / 5e-3
    print(force, (1 - share) * 9810 * 0.09)
