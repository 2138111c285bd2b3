"""Round and light bodies in a liquid: pressure has no moment about their axes, and what flies is told."""

import warnings

import cairn as cn
import numpy as np
import pytest
from cairn.run.fluid_gaps import FluidWarning

rock = cn.Material("rock", density=2600.0)


def basin(dim, high=0.7):
    """Scene of a tank 1.6 m (in space .8 m) wide."""
    width = 1.6 if dim == 2 else 0.8
    scene = cn.Scene(dim=dim, gravity=(*(0.0,) * (dim - 1), -9.81))
    scene.add(cn.wall(np.zeros(dim), np.eye(dim)[-1], rock))
    for k in range(dim - 1):
        way = np.eye(dim)[k]
        scene.add(cn.wall(np.zeros(dim), way, rock), cn.wall(width * way, -way, rock))
    return scene, [np.zeros(dim), [*(width,) * (dim - 1), high]]


def let_go(body, dim, spacing, slip=None, steps=60, dt=4e-3, **options):
    """A simulation after some steps, the row of the body that was let go in the liquid, and the greatest spin and speed
    on the way [rad/s], [m/s]."""
    scene, box = basin(dim)
    made = scene.add(body)[0]
    scene.add(cn.fluid(box, spacing, 1000.0, **options))
    scene.interact("*", "*", cn.Coulomb(mu=0.4))
    if slip is not None:
        scene.interact("fluid", "log", slip)
    sim = cn.Simulation(scene, dt=dt)
    row, most = int(np.flatnonzero(sim.bodies.id == made)[0]), [0.0, 0.0]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FluidWarning)
        for _ in range(steps):
            sim.step()
            v = sim.bodies.velocity[row]
            most = [max(most[0], np.linalg.norm(v[dim:])), max(most[1], np.linalg.norm(v[:dim]))]
    return sim, row, most


@pytest.mark.filterwarnings("ignore::cairn.UnitsWarning")
@pytest.mark.parametrize("incompressible", [False, True])
@pytest.mark.parametrize("share", [1e-3, 0.1, 1.5])
def test_a_liquid_without_friction_turns_no_disk(share, incompressible):
    log = cn.Material("log", density=1000.0 * share)
    form = {"incompressible": True} if incompressible else {}
    sim, row, (spin, speed) = let_go(cn.disks([[0.8, 0.3]], 0.15, log), 2, 0.05, **form)
    assert 0.15 * spin < 1e-9 * speed and 0.02 < speed < 3
    assert 0.15 < sim.bodies.position[row, 1] < 0.9 and sim.info["status"] == "converged"


@pytest.mark.parametrize("incompressible", [False, True])
def test_a_liquid_without_friction_turns_no_sphere_and_no_capsule_about_its_axis(incompressible):
    log = cn.Material("log", density=300.0)
    form = {"incompressible": True} if incompressible else {}
    _, _, (spin, speed) = let_go(cn.spheres([[0.42, 0.4, 0.3]], 0.15, log), 3, 0.1, cn.FreeSlip(), 15, **form)
    assert 0.15 * spin < 1e-9 * speed and speed > 0.02
    capsule = cn.capsules([[0.42, 0.4, 0.35]], 0.12, 0.2, log)
    sim, row, (_, speed) = let_go(capsule, 3, 0.1, cn.FreeSlip(), 15, **form)
    w, x, y, z = sim.bodies.rotation[row]
    axis = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
    assert 0.12 * abs(sim.bodies.velocity[row, 3:] @ axis) < 1e-4 * speed


def test_viscosity_stops_a_disk_that_turns():
    log = cn.Material("log", density=1000.0)
    for slip, stopped in ((cn.NoSlip(), True), (cn.FreeSlip(), False)):
        scene, box = basin(2)
        made = scene.add(cn.disks([[0.8, 0.35]], 0.15, log, velocity=(0.0, 0.0, 2.0)))[0]
        scene.add(cn.fluid(box, 0.05, 1000.0, viscosity=50.0))
        scene.interact("*", "*", cn.Coulomb(mu=0.4))
        scene.interact("fluid", "log", slip)
        sim = cn.Simulation(scene, dt=4e-3)
        sim.run(steps=25, progress=False)
        spin = sim.bodies.velocity[sim.bodies.id == made][0, 2]
        assert 0.0 < spin < 1.8 if stopped else abs(spin / 2 - 1) < 1e-12


def test_a_body_faster_than_sound_is_told():
    log = cn.Material("log", density=1000.0)
    scene, box = basin(2)
    made = scene.add(cn.disks([[0.8, 0.3]], 0.15, log, velocity=(100.0, 0.0, 0.0)))[0]
    scene.add(cn.fluid(box, 0.05, 1000.0))
    scene.interact("*", "*", cn.Coulomb(mu=0.4))
    sim = cn.Simulation(scene, dt=1e-5)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        sim.step()
    assert sim.info["status"] == "diverged" and f"body {made} moves at" in sim.info["hint"]
    with pytest.raises(ValueError, match=f"body {made} moves at .* faster than the sound"):
        for _ in range(100):
            sim.step(4e-3)


def test_numbers_in_errors_can_be_read():
    scene, box = basin(2)
    scene.add(cn.fluid(box, 0.05, 1000.0, viscosity=1e9))
    sim = cn.Simulation(scene, dt=4e-3)
    with pytest.raises(ValueError, match=r"a step of 0.004 s takes the fluid [0-9.]+e\+06 sub-steps of [0-9.]+e-10 s"):
        sim.step()


@pytest.mark.filterwarnings("ignore::cairn.UnitsWarning")
def test_a_light_body_that_costs_sub_steps_is_told():
    log = cn.Material("log", density=1.0)
    scene, box = basin(2)
    made = scene.add(cn.disks([[0.8, 0.3]], 0.15, log))[0]
    scene.add(cn.fluid(box, 0.1, 1000.0))
    scene.interact("*", "*", cn.Coulomb(mu=0.4))
    sim = cn.Simulation(scene, dt=1e-3)
    with pytest.warns(FluidWarning, match=f"body {made} is so much lighter .*incompressible=True"):
        sim.step()


def test_the_liquid_about_a_body_is_as_symmetric_as_the_body():
    log, (scene, box) = cn.Material("log", density=200.0), basin(2)
    block = 0.5 * np.array([(-0.5, -0.3), (0.5, -0.3), (0.5, 0.3), (-0.5, 0.3)])
    made = scene.add(cn.polygons(block, log, position=[[0.8, 0.79]]))[0]  # 1.2 rows of particles below the surface
    scene.add(cn.fluid(box, 0.05, 1000.0, incompressible=True))
    scene.interact("*", "*", cn.Coulomb(mu=0.4))
    sim = cn.Simulation(scene, dt=4e-3)
    x = np.round(sim.fluid.position, 9)
    mirrored = np.round(np.stack([1.6 - x[:, 0], x[:, 1]], axis=1), 9)
    assert np.array_equal(x[np.lexsort(x.T)], mirrored[np.lexsort(mirrored.T)])
    sim.run(steps=50, progress=False)
    row = int(np.flatnonzero(sim.bodies.id == made)[0])
    assert abs(sim.bodies.position[row, 0] - 0.8) < 1e-5 and abs(sim.bodies.rotation[row]) < 1e-5


@pytest.mark.parametrize(("gravity", "within"), [(9.81, 0.05), (30.0, 0.1)])
def test_a_disk_keeps_its_speed_as_it_sinks_slowly(gravity, within):
    """Between walls five diameters apart (Faxen 1946), at a Reynolds number of .3, whatever the pressure of the liquid."""
    radius, width, viscosity, load = 0.12, 1.2, 100.0, 221.9
    ratio = 2 * radius / width
    due = load * (-np.log(ratio) - 0.9157 + 1.7244 * ratio**2 - 1.7302 * ratio**4) / (4 * np.pi * viscosity)
    scene = cn.Scene(dim=2, gravity=(0.0, -gravity))
    scene.add(cn.wall((0, 0), (0, 1), rock), cn.wall((0, 0), (1, 0), rock), cn.wall((width, 0), (-1, 0), rock))
    down = load - 500 * np.pi * radius**2 * gravity  # its weight less that of the liquid has the rest
    iron = cn.Material("iron", density=1500.0)
    made = scene.add(cn.disks([[width / 2, 1.2]], radius, iron, force=(0.0, -down, 0.0)))[0]
    scene.add(cn.fluid([(0, 0), (width, 1.6)], 0.05, 1000.0, viscosity, 56.0))
    scene.interact("*", "*", None)
    sim, heights = cn.Simulation(scene, dt=4e-3), []
    for _ in range(13):
        sim.run(steps=25, progress=False)
        heights.append(sim.bodies.position[sim.bodies.id == made][0, 1])
    speed = -np.diff(heights) / 0.1 / due
    assert 0.9 < speed[5] and np.all(abs(speed[7:] - 1) < within)
