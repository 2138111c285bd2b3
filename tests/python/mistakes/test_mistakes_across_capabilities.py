"""Mistakes across rigid bodies, smooth contacts, meshes, liquids, masonry, networks, joints and ranks: none is raw or silent."""

import warnings

import cairn as cn
import numpy as np
import pytest
from cairn.post import assessment
from cairn.post.collapse import collapse_multiplier
from cairn.pre import importing, masonry
from cairn.study.sweep import sweep

ROCK = cn.Material("rock", density=2650.0)
METAL = cn.Material("metal", density=7850.0, young=2e11, poisson=0.3, conductivity=50.0, capacity=460.0, resistivity=1.7e-7)
SQUARE = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)
HERTZ = {"young": 1e9, "poisson": 0.3, "restitution": 0.5, "mu": 0.3}
ARCH = {"radius": 5.0, "thickness": 0.9, "voussoirs": 5}


def disk(radius=0.5, at=(0.0, 0.5), material=ROCK, **options):
    return cn.disks([at], radius, material, **options)


def floor(**options):
    return cn.wall((0, 0), (0, 1), ROCK, **options)


def made(*sets, gravity=(0.0, -9.81), law=None, fluid=None, **options):
    scene = cn.Scene(len(gravity), gravity=gravity, **options)
    scene.add(*sets)
    if fluid is not None:
        scene.add(fluid)
    scene.interact("*", "*", law or cn.Coulomb(mu=0.4))
    return scene


def ran(scene, dt=1e-3, strategy=None, steps=12, **options):
    simulation = cn.Simulation(scene, dt, strategy, **options)
    simulation.run(steps=steps, progress=False)
    return simulation


def stopped(simulation):
    stop = lambda s: s.bodies.set(velocity=np.zeros_like(s.bodies.velocity)) if s.steps == 6 else None
    simulation.run(steps=12, callback=stop, progress=False)


def hot(**thermal):
    scene = made(cn.spheres([(0, 0, 0.1)], 0.1, METAL, group="ball"), cn.wall((0, 0, 0), (0, 0, 1), METAL, group="floor"),
                 gravity=(0.0, 0.0, -9.81))  # fmt: skip
    scene.thermal(**thermal)
    return scene


def body(**options):
    return cn.ElasticBody(SQUARE, {"quad": [[0, 1, 2, 3]]}, **({"young": 1e9, "poisson": 0.3, "density": 2400.0} | options))


def solid(**material):
    return cn.SolidBody(SQUARE, {"quad": [[0, 1, 2, 3]]}, cn.J2Plasticity(poisson=0.3, isotropic=0.0, kinematic=0.0, **material),
                        density=7850.0)  # fmt: skip


def clump_swapped():
    found = cn.pre.clump([[-0.25, 0.0], [0.25, 0.0]], [0.3, 0.3], 2650.0)
    return cn.clumps([(0, 1.0)], found.offsets, found.radii, found.inertia, found.mass, ROCK)


def joined(point, **options):
    scene = made(floor())
    ids = scene.add(cn.disks([(0, 0.5), (1, 0.5)], 0.5, ROCK))
    scene.join(*ids, cn.Pivot(point=point, **options))
    return scene


def misspelt_support():
    blocks, scene = masonry.panel(2, 2), cn.Scene(2, gravity=(0.0, -9.81))
    blocks.part[:] = ["suport" if part == "support" else part for part in blocks.part]
    return blocks.add_to(scene, ROCK)


def arch_in_millimetres():
    return masonry.arch(radius=5000.0, thickness=900.0, voussoirs=9).add_to(cn.Scene(2), ROCK)


def written(name, text=""):
    with open(name, "w", encoding="utf-8") as file:
        file.write(text)
    return name


ERRORS = {
    # rigid bodies and walls
    "corners of a wall swapped": (lambda: cn.wall((0, 1), (0, 0), ROCK), "non-zero length, pointing out of the solid"),
    "a force on a wall without free dofs": (lambda: floor(mass=5.0, force=(0, -9.0)), "free names no dof .* give free='vy'"),
    "a wall of space in a plane": (lambda: made(cn.wall((0, 0, 0), (0, 0, 1), ROCK)), "3 dimensions and the scene 2"),
    "strategy before dt": (lambda: cn.Simulation(made(disk(), floor()), cn.NSCD(), 1e-3), "strategy is 0.001"),
    "the class of a strategy": (lambda: cn.Simulation(made(disk()), 1e-3, cn.NSCD), "give cairn.NSCD"),
    "theta in percent": (lambda: cn.NSCD(theta=50), "theta is 50"),
    "a contact angle in degrees": (lambda: cn.Capillary(tension=0.07, volume=1e-9, angle=30, mu=0.3), r"to 1.5708 \[rad\]"),
    "a run into the past": (lambda: ran(made(disk(), floor())).run(until=1e-3, progress=False), "give a later time"),
    "a box by highest, lowest": (lambda: cn.box((1, 1), (0, 0), ROCK), "low below high"),
    "a term of the energy misspelt": (lambda: ran(made(disk(), floor())).energy["kinetik"], "did you mean 'kinetic'"),
    "an array of contacts misspelt": (lambda: ran(made(disk(), floor())).contacts.forces, "did you mean 'force'"),
    "a servo along a held axis": (lambda: floor(mass=1.0, free="vx", force=cn.Servo(1e4, (0, 1), area=2.0)), "free are vx"),
    # smooth contacts
    "a law of NSCD": (lambda: ran(made(disk(), floor()), strategy=cn.SmoothDEM()), "give LinearSpring, HertzMindlin or JKR"),
    "a law of smooth contacts": (lambda: ran(made(disk(), floor(), law=cn.HertzMindlin(**HERTZ))), "give Coulomb, Restitution"),
    "a step too long": (lambda: ran(made(disk(), floor(), law=cn.HertzMindlin(**HERTZ)), 0.1, cn.SmoothDEM()), "stable step"),
    "restitution in percent": (lambda: cn.HertzMindlin(**HERTZ | {"restitution": 50}), "give a value from 0 to 1"),
    # meshes
    "cells numbered from 1": (lambda: cn.ElasticBody(SQUARE, {"quad": [[1, 2, 3, 4]]}, young=1e9, poisson=0.3), "from 0"),
    "cells inside out": (lambda: cn.ElasticBody(SQUARE, {"quad": [[0, 3, 2, 1]]}, young=1e9, poisson=0.3), "other way round"),
    "the boundary misspelt": (lambda: cn.deformable(body(), ROCK, contact="boundry"), "did you mean 'boundary'"),
    "a force in space on a plane": (lambda: ran(made(cn.deformable(body(), ROCK, contact="boundary", force={"boundary": (
        0, 0, -1)}), floor())), "force of 'boundary' has shape"),
    "a dof of bodies for nodes": (lambda: cn.deformable(body(), ROCK, fixed={"boundary": "vx"}), "in 2D give x, y"),
    # liquids
    "a region upside down": (lambda: cn.fluid([(1, 0.4), (0, 0)], 0.05), "lowest corner, then its highest"),
    "a number of particles": (lambda: cn.fluid([(0, 0), (1, 0.4)], 20), "more than a side of the region"),
    "a region behind the floor": (lambda: ran(made(floor(), fluid=cn.fluid([(0, -1), (1, -0.2)], 0.1))), "lies outside bodies"),
    "a slow sound": (lambda: ran(made(floor(), fluid=cn.fluid([(0, 0), (1, 0.4)], 0.1, sound_speed=0.5)), steps=40), "too low"),
    # masonry
    "an arch thicker than it is wide": (lambda: masonry.arch(radius=1.0, thickness=2.5, voussoirs=5), "intrados would vanish"),
    "a push upwards": (lambda: assessment.pushover(masonry.panel(2, 2), displacement=(0.0, 0.1)), "horizontal vector"),
    "a kind of load": (lambda: collapse_multiplier(masonry.panel(2, 2), mu=0.5, load="weight"), '"tilt", "push" or forces'),
    "a drawing of another program": (lambda: importing.read(written("a.dwg")), "give one of .stl"),
    # networks
    "a power for all bodies": (lambda: hot(power=5.0), r"give {group: value}, such as {'\*': 5.0}"),
    "a wire between groups": (lambda: hot(wires=[("ball", "floor", 1.0)]), "numbers of two bodies"),
    "a group misspelt": (lambda: ran(hot(temperature={"flor": 300.0})), "no group and no material 'flor'"),
    "degrees below zero": (lambda: ran(hot(initial=-5.0)), "-5 K: give all bodies one above 0"),
    "no capacity": (lambda: ran(made_of_rock_that_heats()), "conductivity of material 'rock' is not given"),
    # joints
    "a joint of groups": (lambda: made(disk(group="a")).join("a", "b", cn.Pivot(point=(0.5, 0.5))), "give the number of a body"),
    "a motor that brakes": (lambda: cn.Motor(speed=3000.0, effort=-1.0), "effort of Motor is -1.0"),
    # ranks and studies
    "no ranks": (lambda: cn.Simulation(made(disk(), floor()), 1e-3, ranks=0), "ranks is 0"),
    "an option that does not run over ranks": (lambda: cn.Simulation(made(disk(), floor()), 1e-3, cn.NSCD(
        project_positions=True), ranks=2), "project_positions is asked for, which does not run over ranks"),
    "an exchange misspelt": (lambda: cn.Simulation(made(disk()), 1e-3, ranks=2, exchange="colors"), "did you mean 'colour'"),
    "a study that is not there": (lambda: sweep("nope.toml"), "nope.toml"),
}  # fmt: skip


def made_of_rock_that_heats():
    scene = made(disk(), floor())
    scene.thermal(initial=300.0)
    return scene


WARNED = {
    # rigid bodies
    "a weight per volume": (lambda: cn.Simulation(made(disk(material=cn.Material("r", density=26.0)), floor()), 1e-3),
                            "give kg/m3, 2650 for a weight of 26 kN/m3"),
    "mass and inertia swapped": (lambda: cn.Simulation(made(clump_swapped()), 1e-3), "are mass and inertia swapped"),
    "a margin in mm": (lambda: cn.Simulation(made(disk(0.005, (0.0, 0.005)), floor()), 1e-3, cn.NSCD(margin=5.0)),
                       "0.005 for 5 mm"),
    "gravity forgotten": (lambda: ran(made(disk(), floor(), gravity=(0.0, 0.0))),
                          r"nothing has moved in 12 steps.*gravity=\(0, -9.81"),
    "gravity in a cell": (lambda: ran(made(disk(at=(1, 1)), periodic=cn.Periodic((4.0, 4.0)))), "gravity along y, an axis of"),
    "two bodies at one place": (lambda: cn.Simulation(made(disk(), disk()), 1e-3), "pairs overlap"),
    "bodies outside a box": (lambda: cn.Simulation(made(disk(0.1, (5.0, 5.0)), cn.box((0, 0), (1, 1), ROCK)), 1e-3), "behind"),
    # meshes
    "a mesh that touches nothing": (lambda: ran(made(cn.deformable(body(), ROCK), floor())),
                                    "cn.deformable.*contact='boundary'"),
    "edges alone on a floor": (lambda: ran(made(cn.deformable(body(), ROCK, edges="boundary"), floor())),
                               "name nodes by contact="),
    "yield in MPa": (lambda: ran(made(cn.deformable(solid(young=2.1e11, yield_stress=250.0), ROCK, contact="boundary"),
                                        floor()), 1e-5), "yield_stress of mesh 0 is 250 Pa .* 2.5e.08 for 250 MPa"),
    "modulus in MPa": (lambda: cn.Simulation(made(cn.deformable(solid(young=2.1e5, yield_stress=2.5e8), ROCK),
                                                    gravity=(0.0, 0.0)), 1e-3), "yield at a strain of 1.2e.03"),
    "damping in percent": (lambda: cn.Simulation(made(cn.deformable(body(), ROCK, modal_damping=5.0)), 1e-3), "0.05 for 5 %"),
    # liquids
    "a liquid without walls": (lambda: ran(made(fluid=cn.fluid([(0, 0), (1, 0.4)], 0.1))), "'fluid' falls without end"),
    # masonry
    "an arch in mm": (arch_in_millimetres, "blocks are 1900 m long"),
    "an axle in kN": (lambda: assessment.moving_load(masonry.arch(**ARCH), 20.0, positions=2, dt=4e-3, limit=False),
                      "give newtons, 20000 for 20 kN"),
    "a settlement in mm": (lambda: assessment.settlement(masonry.arch(**ARCH), (-120.0, -30.0), speed=50.0, outputs=2, dt=4e-3),
                           "displacement is 123.7 m long, and the structure"),
    "support misspelt": (misspelt_support, "the part that is held is \"support\", and there is 'suport'"),
    # networks
    "degrees Celsius": (lambda: hot(initial=20.0, radiation=[("ball", 0.9, None, 20.0)]), "give kelvins, 293.15 for 20 degrees"),
    "degrees Celsius beside kelvins": (lambda: hot(temperature={"floor": 20.0}), "a temperature is 20 K, and another 293.15 K"),
    # joints
    "a pivot in mm": (lambda: cn.Simulation(joined((500.0, 0.5)), 1e-3), "a joint of body 2 is at 499 m from its centre"),
}  # fmt: skip


@pytest.mark.parametrize("mistake", ERRORS)
def test_mistakes_are_refused(mistake, tmp_path, monkeypatch):
    call, words = ERRORS[mistake]
    monkeypatch.chdir(tmp_path)
    with pytest.raises(Exception, match=words) as caught:
        call()
    assert len(str(caught.value)) < 600


@pytest.mark.parametrize("mistake", WARNED)
def test_mistakes_are_warned_of(mistake, tmp_path, monkeypatch):
    call, words = WARNED[mistake]
    monkeypatch.chdir(tmp_path)
    with pytest.warns(match=words):
        call()


RIGHT = {
    "a mesh that is held": lambda: ran(made(cn.deformable(body(), ROCK, fixed={"boundary": "xy"}), floor())),
    "a cell with a floor": lambda: ran(made(disk(at=(1.0, 0.5)), floor(), periodic=cn.Periodic((4.0, np.inf)))),
    "a liquid in a cell": lambda: ran(made(periodic=cn.Periodic((2.0, 2.0)), gravity=(0.0, 0.0),
                                           fluid=cn.fluid([(0, 0), (2, 2)], 0.1, sound_speed=10.0))),
    "a floor pressed up": lambda: ran(made(disk(), floor(mass=100.0, free="vy", force=(0.0, 2e4)))),
    "a body thrown and stopped": lambda: stopped(cn.Simulation(made(disk(velocity=(1.0, 0.0)), gravity=(0.0, 0.0)), 1e-3)),
    "a body thrown without gravity": lambda: ran(made(disk(velocity=(1.0, 0.0)), gravity=(0.0, 0.0))),
    "boundaries alone": lambda: ran(made(floor(), gravity=(0.0, 0.0))),
    "a pivot between bodies": lambda: cn.Simulation(joined((0.5, 0.5)), 1e-3),
    "kelvins": lambda: hot(initial=300.0, radiation=[("ball", 0.9, None, 280.0)]),
    "a metal": lambda: ran(made(cn.deformable(solid(young=2.1e11, yield_stress=2.5e8), ROCK, contact="boundary"), floor()), 1e-5),
    "an axle": lambda: assessment.moving_load(masonry.arch(**ARCH), 20e3, positions=2, dt=4e-3, limit=False),
}


@pytest.mark.parametrize("scene", RIGHT)
def test_scenes_that_are_meant_are_not_warned_of(scene):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        RIGHT[scene]()
