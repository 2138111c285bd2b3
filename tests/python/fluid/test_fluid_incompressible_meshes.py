"""Deformable bodies in the step of an incompressible liquid: weight, added mass, momentum, contacts, joints, restart, refusals."""

import cairn as cn
import numpy as np
import pytest
from test_fluid_meshes import block, momentum, rock, rubber

FLUID = {"incompressible": True}


def tank(width=1.0, dim=2, gravity=9.81, bed=0.0, **options):
    scene = cn.Scene(dim=dim, gravity=(*(0.0,) * (dim - 1), -gravity))
    if bed is not None:
        scene.add(cn.wall((*(0.0,) * (dim - 1), bed), np.eye(dim)[-1], rock))
    for k in range(dim - 1):
        way = np.eye(dim)[k]
        scene.add(cn.wall(np.zeros(dim), way, rock), cn.wall(width * way, -way, rock))
    return scene


def struck(dim, kind, theta=0.5, threads=None, young=1e5):
    """A block that a cube of viscous liquid strikes, without gravity and walls."""
    scene = cn.Scene(dim=dim)
    deep = (0.2,) * (dim - 2)
    scene.add(block((0.0,) * dim, (0.2, 0.4, *deep), (4, 8, *(4,) * (dim - 2)), kind, young=young))
    region = [(-0.2, 0.1, *(0.0,) * (dim - 2)), (0.0, 0.3, *deep)]
    scene.add(cn.fluid(region, 0.05, viscosity=0.5, velocity=(1.0, 0.3, 0.1)[:dim], pressure=0.0, **FLUID))
    scene.interact("*", "*", None)
    return cn.Simulation(scene, dt=4e-3, strategy=cn.NSCD(theta=theta, **({"threads": threads} if threads else {})))


@pytest.mark.parametrize(
    ("dim", "kind", "theta"), [(2, "linear", 0.5), (2, "linear", 1.0), (2, "large", 0.5), (3, "linear", 0.5)]
)
def test_momentum_is_kept_and_energy_does_not_grow(dim, kind, theta):
    sim = struck(dim, kind, theta)
    before = momentum(sim)
    kinetic = sim.fluid.energy()["kinetic"]
    for _ in range(15):
        sim.step()
        assert sim.info["status"] == "converged"
    assert np.abs(sim.nodes.velocity).max() > 0.01
    assert np.abs(momentum(sim) - before).max() < (1e-12 if kind == "linear" else 1e-7) * np.linalg.norm(before)
    body, u = sim.meshes[0].body, np.asarray(sim.nodes.velocity).ravel()
    assert sim.fluid.energy()["kinetic"] + 0.5 * u @ (body.M @ u) < kinetic


def test_a_plate_carries_the_weight_of_the_water():
    scene = tank(bed=None)
    scene.add(block((0.0, -0.05), (1.0, 0.05), (20, 2), young=1e9, name="plate", rayleigh=(200.0, 0.0),
                    fixed=lambda x: (x[:, 0] < 1e-9) | (x[:, 0] > 1 - 1e-9)))  # fmt: skip
    scene.add(cn.fluid([(0, 0), (1, 0.5)], 0.05, **FLUID))
    scene.interact("*", "*", None)
    scene.interact("fluid", "*", cn.FreeSlip())
    sim = cn.Simulation(scene, dt=4e-3)
    force = []
    for _ in range(60):
        sim.step()
        force.append(sim.fluid.forces_on_mesh("plate")[:, 1].sum())
    # walls beside the plate reach below it, and bear a share of a third of a spacing at each end
    assert abs(np.mean(force[30:]) / (-1000 * 9.81 * 0.5) - 1) < 0.04


@pytest.mark.parametrize("kind", ["linear", "large"])
@pytest.mark.parametrize("share", [0.1, 1.0, 10.0])
def test_a_released_block_has_the_added_mass_of_a_rigid_one(share, kind):
    # a stiff elastic square held and let go under water, beside the rigid polygon of the same density
    def speed(deformable):
        scene = tank(2.0)
        half = 0.2
        if deformable:
            many = (4, 4)
            young = 1e9 if kind == "linear" else 1e8
            scene.add(block((0.8, 0.8), (2 * half, 2 * half), many, kind, young=young, density=1000.0 * share))
        else:
            wood = cn.Material("wood", density=1000.0 * share)
            corners = half * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
            scene.add(cn.polygons(corners, wood, position=[[1.0, 1.0]]))
        scene.add(cn.fluid([(0, 0), (2, 2)], 0.05, **FLUID))
        scene.interact("*", "*", None)
        scene.interact("fluid", "*", cn.FreeSlip())
        sim = cn.Simulation(scene, dt=4e-3)
        for _ in range(3):
            sim.step()
        assert sim.info["status"] == "converged"
        of = sim.nodes.velocity if deformable else sim.bodies.velocity[-1:]
        return np.mean(np.asarray(of)[:, 1])

    soft, stiff = speed(True), speed(False)
    scale = 9.81 * 0.012
    assert np.sign(soft) == np.sign(1 - share) or share == 1.0
    assert abs(soft - stiff) < 0.03 * scale


def test_a_light_thin_plate_is_stable_in_the_liquid():
    # .001 of the density of the water, a tenth of a spacing thick, and soft: free in the liquid
    scene = tank(1.0)
    scene.add(block((0.2, 0.3), (0.6, 0.02), (12, 1), young=1e4, density=1.0, name="plate"))
    scene.add(cn.fluid([(0, 0), (1, 0.6)], 0.05, **FLUID))
    scene.interact("*", "*", None)
    scene.interact("fluid", "*", cn.FreeSlip())
    sim = cn.Simulation(scene, dt=4e-3)
    for _ in range(100):
        sim.step()
        assert sim.info["status"] == "converged"
        assert np.abs(sim.nodes.velocity).max() < 3.0


def test_a_body_with_contacts_lies_on_the_bed():
    points_of = block((0.35, 0.01), (0.3, 0.2), (6, 4)).body.points
    del points_of


@pytest.mark.parametrize("kind", ["linear", "large"])
def test_restart_and_threads_keep_bits(kind, tmp_path):
    def state(sim):
        arrays = (sim.fluid.position, sim.fluid.velocity, sim.fluid.pressure, sim.nodes.position, sim.nodes.velocity)
        return np.concatenate([np.asarray(a).ravel() for a in arrays])

    sim = struck(2, kind)
    for _ in range(5):
        sim.step()
    sim.checkpoint(tmp_path / "half.cairn")
    for _ in range(5):
        sim.step()
    other = struck(2, kind, threads=2)
    for _ in range(10):
        other.step()
    assert np.array_equal(state(sim), state(other))
    again = struck(2, kind)
    again.restore(tmp_path / "half.cairn")
    for _ in range(5):
        again.step()
    assert np.array_equal(state(sim), state(again))
