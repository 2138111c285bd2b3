"""Joints in scenes with networks of heat and current: they conduct nothing, have no heat, and move with bodies that grow."""

import cairn as cn
import numpy as np
import pytest


def scene_of(dim, joint=None, expansion=None, along=-1):
    """Two balls side by side, apart; `along`: axis of the joint between one and the world."""
    steel = cn.Material("steel", density=1000.0, conductivity=50.0, capacity=800.0, young=1e9, poisson=0.3, resistivity=1e-6,
                        expansion=expansion)  # fmt: skip
    scene = cn.Scene(dim)
    centers = np.zeros((2, dim))
    centers[1, 0] = 0.3
    ids = scene.add((cn.disks if dim == 2 else cn.spheres)(centers, 0.1, steel, group="balls"))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    if joint == "two":
        scene.join(ids[0], ids[1], cn.Distance(points=centers))
    if joint == "world":
        scene.join(ids[1], None, cn.Distance(points=[centers[1], centers[1] + 0.5 * np.eye(dim)[along]]))
    return scene, ids


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("joint", ["two", "world"])
@pytest.mark.parametrize("kind", ["heat", "current"])
@pytest.mark.parametrize("law", [cn.networks.Holm(), cn.networks.Constant(conductance=1.0)])
def test_a_joint_conducts_nothing(dim, joint, kind, law):
    """Under a pull along it, which would press a contact, nothing flows, and no contact is called unfit."""
    scene, _ = scene_of(dim, joint)
    scene.gravity = [1.0, *[0.0] * (dim - 1)]
    if kind == "heat":
        scene.thermal(conductance=law, initial=[([0], 300.0), ([1], 400.0)])
    else:
        scene.electrical(conductance=law, current=[([0], 1.0), ([1], -1.0)])
    sim = cn.Simulation(scene, 1e-3)
    with pytest.warns(cn.networks.NetworkWarning, match="nowhere to go") if kind == "current" else _silent():
        for _ in range(3):
            sim.step()
    if kind == "heat":
        assert sim.bodies.temperature[:2] == pytest.approx([300.0, 400.0], rel=1e-12) and np.all(sim.bodies.temperature > 0)
    assert len(sim.contacts.gap) == 1


def _silent():
    import contextlib
    import warnings

    held = contextlib.ExitStack()
    held.enter_context(warnings.catch_warnings())
    warnings.simplefilter("error")
    return held


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("steady", [False, True])
def test_what_flows_beside_a_joint_is_as_without_it(dim, steady):
    """Balls that lie on a hot floor are heated by it, also with a bar between them, and one to the world."""
    found = []
    for joint in (None, "two", "world"):
        scene, _ = scene_of(dim, joint, along=0)  # level: the floor bears the weight, and not the joint
        scene.gravity = [*[0.0] * (dim - 1), -9.81]
        up = np.eye(dim)[-1]
        floor = scene.add(cn.wall(-0.1 * up, up, scene.sets[0].contactors[0].material))
        scene.thermal(conductance=cn.networks.Constant(conductance=5.0), initial=300.0, steady=steady,
                      temperature=[(floor, 400.0)])  # fmt: skip
        sim = cn.Simulation(scene, 1e-2)
        for _ in range(3):
            sim.step()
        found.append(sim.bodies.temperature[:2])
    assert found[0] == pytest.approx(found[1], rel=1e-12) and found[0] == pytest.approx(found[2], rel=1e-12)
    assert np.all(found[0] == 400.0 if steady else (300.0 < found[0]) & (found[0] < 310.0))


@pytest.mark.parametrize("dim", [2, 3])
def test_a_joint_made_and_let_go_in_a_run(dim):
    scene, ids = scene_of(dim)
    scene.thermal(conductance=cn.networks.Holm(), initial=[("balls", 300.0)])
    sim = cn.Simulation(scene, 1e-3)
    sim.step()
    for other in (ids[1], None):
        ends = [sim.bodies.position[0], sim.bodies.position[1]]
        name = sim.join(ids[0], other, cn.Distance(points=ends))
        sim.step()
        sim.unjoin(name)
        sim.step()
    assert sim.bodies.temperature[:2].tolist() == [300.0, 300.0]


@pytest.mark.parametrize("dim", [2, 3])
def test_words_and_areas_do_not_know_the_ends_of_joints(dim):
    """Temperatures by "*" and convection, whose area follows from the ball, are those without the joint."""
    found = []
    for joint in (None, "two", "world"):
        scene, _ = scene_of(dim, joint)
        scene.thermal(conductance=cn.networks.Holm(), initial=300.0, convection=[("*", 10.0, None, 280.0)])
        sim = cn.Simulation(scene, 1.0)
        sim.step()
        found.append(sim.bodies.temperature[:2].tolist())
    assert found[0] == found[1] == found[2] and found[0][0] < 300.0
    with pytest.raises(ValueError, match="there is no group and no material 'joint 0'; there are balls, steel and"):
        scene, _ = scene_of(dim, "two")
        scene.thermal(conductance=cn.networks.Holm(), initial=[("joint 0", 300.0)])
        cn.Simulation(scene, 1e-3)


def test_ends_of_joints_move_with_a_body_that_grows():
    """A bar on a hinge at its end: heated by 1,000 K it is longer by a hundredth, and so is its way from the hinge."""
    hot = cn.Material("hot", density=1000.0, capacity=800.0, conductivity=50.0, expansion=1e-5)
    scene = cn.Scene(2)
    (bar,) = scene.add(cn.polygons([[0, -0.1], [2, -0.1], [2, 0.1], [0, 0.1]], hot))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    scene.join(bar, None, cn.Pivot(point=[0, 0]))
    scene.thermal(conductance=cn.networks.Constant(conductance=1.0), initial=293.15,
                  temperature=[([int(bar)], cn.Table([0, 1], [293.15, 1293.15]))])  # fmt: skip
    sim = cn.Simulation(scene, 1e-2)
    for _ in range(100):
        sim.step()
    assert sim.bodies.position[0, 0] == pytest.approx(1.01, abs=3e-4) and abs(sim.bodies.position[0, 1]) < 1e-9
