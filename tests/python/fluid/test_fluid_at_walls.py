"""What walls and bodies do to a liquid: still water stays still, free walls rest on it, viscosity turns bodies."""

import cairn as cn
import numpy as np
import pytest

rock = cn.Material("rock", density=2600.0)
FORMS = ["weakly compressible", "incompressible"]


def form_of(form, speed):
    return {"incompressible": True} if form == "incompressible" else {"sound_speed": speed}


def basin(gravity=9.81):
    scene = cn.Scene(dim=2, gravity=(0.0, -gravity))
    floor = scene.add(cn.wall((0, 0), (0, 1), rock), cn.wall((0, 0), (1, 0), rock), cn.wall((1, 0), (-1, 0), rock))[0]
    return scene, floor


def test_a_free_wall_on_the_liquid_does_not_stir_itself():
    """Powers of pressure at both sides of a wall are the same: its vibration by the first step dies out."""
    scene, _ = basin()
    lid = scene.add(cn.wall((0, 0.6), (0, -1), rock, mass=500.0, free="vy"))[0]
    x = 0.05 * (np.stack(np.meshgrid(np.arange(20), np.arange(12)), axis=-1).reshape(-1, 2) + 0.5)
    scene.add(cn.fluid(x, 0.05, 1000.0, pressure=9.81 * (500 + 1000 * (0.6 - x[:, 1]))))
    scene.interact("*", "*", None)
    sim, force = cn.Simulation(scene, dt=1e-3), []
    for _ in range(2500):
        sim.step()
        force.append(sim.fluid.force_on(lid)[1])
    first, last = (np.ptp(force[k : k + 500]) for k in (0, 2000))
    assert last < 0.8 * first < 0.08 * 4905
    assert abs(np.mean(force[2000:]) / 4905 - 1) < 5e-3


def test_water_at_rest_in_a_box_stays_at_rest():
    scene, floor = basin()
    scene.add(cn.fluid([(0, 0), (1, 0.9)], 0.05, 1000.0))
    scene.interact("*", "*", None)
    sim = cn.Simulation(scene, dt=4e-3)
    errors = []
    for k in range(1500):
        sim.step()
        if k > 900 and k % 10 == 0:
            depth = 0.9 - sim.fluid.position[:, 1]
            errors.append(np.sqrt(np.mean((sim.fluid.pressure / 9810 - depth) ** 2)) / 0.9)
    assert max(errors) < 0.012 and sim.fluid.info["speed"] < 0.1
    assert abs(sim.fluid.force_on(floor)[1] / -8829 - 1) < 0.01


@pytest.mark.parametrize("form", FORMS)
def test_torque_on_a_disk_that_turns_in_a_ring(form):
    """4 pi mu w R1^2 R2^2/(R2^2 - R1^2) (Taylor and Couette): Morris' viscosity alone gives half of it."""
    inner, outer = 0.25, 0.75
    scene = cn.Scene(dim=2)
    scene.add(cn.ring((0, 0), outer, rock))
    turned = {"driven": ("vx", "vy", "w"), "drive": lambda t: (0, 0, 1.0)}
    disk = scene.add(cn.disks([[0, 0]], inner, rock, **turned))[0]
    scene.add(cn.fluid([(-outer, -outer), (outer, outer)], 0.05, 1.0, 0.1, **form_of(form, 10.0)))
    scene.interact("*", "*", None)
    sim, torque = cn.Simulation(scene, dt=1e-2), []
    for k in range(300):
        sim.step()
        if k >= 200:
            torque.append(sim.fluid.force_on(disk)[2])
    expected = -4 * np.pi * 0.1 * inner**2 * outer**2 / (outer**2 - inner**2)
    assert abs(np.mean(torque) / expected - 1) < 0.1


@pytest.mark.parametrize("form", FORMS)
def test_spin_of_a_disk_in_a_shear_flow(form):
    """A disk free to turn spins at half the rate of shear, of little weight and in creeping flow."""
    scene = cn.Scene(dim=2, periodic=cn.Periodic((2.0, np.inf)))
    scene.add(cn.wall((0, 0), (0, 1), rock, velocity=(-0.5, 0)), cn.wall((0, 1), (0, -1), rock, velocity=(0.5, 0)))
    disk = scene.add(cn.disks([[1.0, 0.5]], 0.15, cn.Material("wood", density=1.0), driven=("vx", "vy")))[0]
    scene.add(cn.fluid([(0, 0), (2, 1)], 0.05, 1.0, 1.0, **form_of(form, 20.0)))
    scene.interact("*", "*", None)
    sim = cn.Simulation(scene, dt=5e-3)
    for _ in range(240):
        sim.step()
    assert abs(sim.bodies.velocity[sim.bodies.id == disk][0, 2] / -0.5 - 1) < 0.12


@pytest.mark.parametrize("dt", [5e-4, 2e-3])
def test_viscosity_takes_no_weight_from_an_incompressible_liquid_at_rest(dt):
    scene, floor = basin()
    scene.add(cn.fluid([(0, 0), (1, 0.5)], 0.05, 1000.0, 1e4, incompressible=True))
    scene.interact("*", "*", None)
    sim = cn.Simulation(scene, dt=dt)
    sim.run(steps=100, progress=False)
    assert abs(sim.fluid.force_on(floor)[1] / -4905 - 1) < 5e-3
    assert np.sqrt(np.mean((sim.fluid.pressure / 9810 - 0.5 + sim.fluid.position[:, 1]) ** 2)) < 0.015 * 0.5


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("motion", [{"velocity": (1.0, 0.0, 0.0)}, {"surface_velocity": (1.0, 0.0)}])
def test_a_belt_moves_the_liquid_as_a_wall_that_moves_does(form, motion):
    scene = cn.Scene(dim=2, periodic=cn.Periodic((1.0, np.inf)))
    belt = scene.add(cn.wall((0, 0), (0, 1), rock), cn.wall((0, 0.5), (0, -1), rock, **motion))[1]
    scene.add(cn.fluid([(0, 0), (1, 0.5)], 0.05, 1.0, viscosity=1.0, pressure=0.0, **form_of(form, 20.0)))
    scene.interact("*", "*", None)
    sim = cn.Simulation(scene, dt=5e-3)
    sim.run(steps=200, progress=False)
    assert abs(sim.fluid.force_on(belt)[0] / -2 - 1) < 0.01  # Couette


@pytest.mark.parametrize("form", FORMS)
def test_a_surface_that_turns_drags_the_liquid_as_a_disk_that_turns_does(form):
    def torque(**turns):
        scene = cn.Scene(dim=2)
        scene.add(cn.ring((0, 0), 1.0, rock))
        disk = scene.add(cn.disks([[0, 0]], 0.25, rock, driven=("vx", "vy", "w"), **turns))[0]
        scene.add(cn.fluid([(-1, -1), (1, 1)], 0.05, 10.0, viscosity=1.0, pressure=0.0, **form_of(form, 10.0)))
        scene.interact("*", "*", None)
        sim = cn.Simulation(scene, dt=1e-2)
        sim.run(steps=5, progress=False)
        return sim.fluid.force_on(disk)[2]

    assert abs(torque(surface_velocity=(0.0, 0.0, 1.0)) / torque(velocity=[[0, 0, 1.0]]) - 1) < 1e-3  # points turn with the disk


@pytest.mark.parametrize("above", [400.0, 2600.0, 1e7])
def test_light_blocks_under_others_converge(above):
    """A light block carries the liquid about it on its contacts: passes alone would converge slowly, or not."""
    block = 0.5 * np.array([(-0.2, -0.1), (0.2, -0.1), (0.2, 0.1), (-0.2, 0.1)])
    light, heavy = cn.Material("light", density=400.0), cn.Material("heavy", density=above)
    scene, _ = basin()
    scene.add(*(cn.polygons(block, light, position=[(0.5, 0.05 + 0.1 * k)]) for k in range(3)))
    scene.add(cn.polygons(block, heavy, position=[(0.5, 0.35)]))
    scene.add(cn.fluid([(0, 0), (1, 0.6)], 0.05, 1000.0, incompressible=True))
    scene.interact("*", "*", cn.Coulomb(mu=0.4))
    sim = cn.Simulation(scene, dt=2e-3)
    assert all(sim.step()["status"] == "converged" for _ in range(10))
    assert np.abs(sim.fluid.velocity).max() < 0.1


def test_the_last_mesh_may_go():
    square = [(0.4, 0.1), (0.6, 0.1), (0.6, 0.3), (0.4, 0.3)]
    body = cn.SolidBody(square, {"quad": [[0, 1, 2, 3]]}, cn.NeoHookean(young=1e6, poisson=0.3), density=900.0)
    scene, _ = basin()
    scene.add(cn.deformable(body, rock, contact="boundary"))
    scene.add(cn.fluid([(0, 0), (1, 0.5)], 0.05, 1000.0, incompressible=True))
    scene.interact("*", "*", None)
    sim = cn.Simulation(scene, dt=2e-3)
    sim.step()
    sim.remove(sim.meshes[0].all_ids)
    assert sim.step()["status"] == "converged"


@pytest.mark.parametrize("form", [{"incompressible": True}, {}])
def test_a_block_flush_in_the_floor_leaves_the_liquid_at_rest(form):
    # Its points below the floor would take the space of the half-space again: .16 and .12 m/s
    stone = cn.Material("stone", density=2600.0)
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    bed = scene.add(cn.wall((0, 0), (0, 1), stone), cn.wall((0, 0), (1, 0), stone), cn.wall((2, 0), (-1, 0), stone))[0]
    corners = np.array([(0.8, -0.4), (1.2, -0.4), (1.2, 0.0), (0.8, 0.0)])
    block = scene.add(cn.polygons([corners], stone, fixed=True))[0]
    scene.add(cn.fluid([(0, 0), (2, 0.6)], 0.05, **form))
    scene.interact("*", "*", None)
    scene.interact("fluid", stone, cn.FreeSlip())
    sim = cn.Simulation(scene, dt=2e-3)
    force, still = [], np.asarray(sim.fluid.position)
    for _ in range(150):
        sim.step()
        force.append(sim.fluid.force_on(bed)[1])
        assert np.abs(sim.fluid.force_on(block)).max() < 1e-9 * 9810 * 0.4
    assert abs(np.mean(force[50:]) / (-9810 * 1.2) - 1) < 0.02
    assert np.abs(np.asarray(sim.fluid.position) - still).max() < 0.2 * 0.05
    if form:
        assert np.linalg.norm(sim.fluid.velocity, axis=1).max() < 0.02


@pytest.mark.parametrize("form", [{"incompressible": True}, {}])
def test_a_deformable_block_flush_in_the_floor_leaves_the_liquid_at_rest(form):
    scene, bed = basin()
    corners = [(0.3, -0.4), (0.7, -0.4), (0.7, 0.0), (0.3, 0.0)]
    body = cn.ElasticBody(corners, {"quad": [[0, 1, 2, 3]]}, young=1e7, poisson=0.3, density=1200.0, groups={"all": range(4)})
    scene.add(cn.deformable(body, rock, name="block", fixed={"all": "xy"}))
    scene.add(cn.fluid([(0, 0), (1, 0.4)], 0.05, **form))
    scene.interact("*", "*", None)
    scene.interact("fluid", "*", cn.FreeSlip())
    sim, force = cn.Simulation(scene, dt=2e-3), []
    still = np.array(sim.fluid.position)
    for _ in range(100):
        sim.step()
        force.append(sim.fluid.force_on(bed)[1])
        assert np.abs(sim.fluid.forces_on_mesh("block")).max() < 1e-9 * 9810 * 0.4
    assert abs(np.mean(force[50:]) / (-9810 * 0.4) - 1) < 0.02
    assert np.abs(np.asarray(sim.fluid.position) - still).max() < 0.2 * 0.05


@pytest.mark.parametrize("out", [0.3, 0.5, 0.7])
@pytest.mark.parametrize("form", [{"incompressible": True}, {}])
def test_a_block_that_stands_out_of_the_floor_a_little_bears_a_part_of_the_liquid(form, out):
    """Half-space and block share the load above the block, by how far that stands out over the spacing."""
    scene, bed = basin()
    corners = np.array([(0.3, -0.4), (0.7, -0.4), (0.7, 0.0), (0.3, 0.0)]) + (0, 0.05 * out)
    block = scene.add(cn.polygons([corners], rock, fixed=True))[0]
    scene.add(cn.fluid([(0, 0), (1, 0.4)], 0.05, **form))
    scene.interact("*", "*", None)
    scene.interact("fluid", rock, cn.FreeSlip())
    sim, force = cn.Simulation(scene, dt=2e-3), []
    for _ in range(150):
        sim.step()
        force.append([sim.fluid.force_on(k)[1] for k in (bed, block)])
    floor, own = np.mean(force[75:], axis=0) / (-1000 * 9.81 * 0.05**2 * len(sim.fluid))
    assert abs(floor + own - 1) < 0.02
    assert 0.8 < own / (0.4 * out) < 0.95


@pytest.mark.parametrize("viscosity", [3.0, 16.0])
def test_a_viscous_liquid_calms_from_uneven_places(viscosity):
    """At a Reynolds number of the spacing of 52 pressure takes no corrected gradients, at 9.8 it does: both calm."""
    x = 0.05 * (np.stack(np.meshgrid(np.arange(40), np.arange(20)), axis=-1).reshape(-1, 2) + 0.5)
    x = x + 0.01 * (np.random.default_rng(1).random(x.shape) - 0.5)
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.wall((0, 0), (0, 1), rock), cn.wall((0, 0), (1, 0), rock), cn.wall((2, 0), (-1, 0), rock))
    scene.add(cn.fluid(x, 0.05, 1000.0, viscosity, pressure=9810 * (1 - x[:, 1])))
    sim, kinetic = cn.Simulation(scene, dt=0.01), []
    for _ in range(4):
        sim.run(steps=50, progress=False)
        kinetic.append(sim.fluid.energy()["kinetic"])
    assert kinetic[3] < 0.5 * kinetic[0]
