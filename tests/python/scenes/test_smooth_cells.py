"""Periodic cells of smooth grains that follow a stress, component by component; inertia scaled for slow loading."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=2600.0)
R = 0.005


def packed(dim, count, law, share=0.2, strategy=None, pitch=2.1, **driven):
    rng = np.random.default_rng(3)
    x = np.stack(np.meshgrid(*[np.arange(count)] * dim, indexing="ij"), -1).reshape(-1, dim) * pitch * R
    x = x + 0.05 * R * rng.uniform(-1, 1, x.shape)
    scene = cn.Scene(dim, periodic=cn.Periodic((count * pitch * R,) * dim, **driven))
    scene.add((cn.disks if dim == 2 else cn.spheres)(x, R * rng.uniform(0.8, 1.0, len(x)), ROCK))
    scene.interact("*", "*", law)
    sim = cn.Simulation(scene, 1e-9, strategy or cn.SmoothDEM(), overlap="ignore")
    sim.dt = share * sim.stable_step
    return sim


def test_a_square_array_bears_the_pressure():
    """Four disks in a square cell, each beside the images of the others: two contacts share the pressure times the width."""
    scene = cn.Scene(2, periodic=cn.Periodic((4 * R, 4 * R), stress={"xx": 50.0, "yy": 80.0}))
    scene.add(cn.disks([(R, R), (3 * R, R), (R, 3 * R), (3 * R, 3 * R)], R, ROCK))
    scene.interact("*", "*", cn.LinearSpring(stiffness=1e4, restitution=0.05))
    sim = cn.Simulation(scene, 1e-9, cn.SmoothDEM(), overlap="ignore")
    sim.dt = 0.2 * sim.stable_step
    for _ in range(3000):
        sim.step()
    assert np.allclose(np.diag(sim.cell["stress"]), [50.0, 80.0], rtol=1e-3)
    force = np.linalg.norm(sim.contacts.force, axis=1)
    along_x = np.abs(sim.contacts.normal[:, 0]) > 0.5
    width = np.array(sim.cell["lengths"])
    assert along_x.sum() == (~along_x).sum() == 4
    assert np.allclose(force[along_x], 50.0 * width[1] / 2, rtol=1e-3)
    assert np.allclose(force[~along_x], 80.0 * width[0] / 2, rtol=1e-3)


@pytest.mark.parametrize("dim", [2, 3])
def test_grains_come_to_rest_under_a_stress(dim):
    """The mean stress is that which is asked, component by component; the balance closes."""
    law = cn.LinearSpring(stiffness=1e5, restitution=0.2, mu=0.3)
    asked = dict(zip(("xx", "yy", "zz"), (2e4, 2.4e4, 2.2e4)[:dim]))
    sim = packed(dim, 6 - dim, law, pitch=1.9, stress=asked)
    stress = []
    for k in range(5000):
        sim.step()
        if k >= 3000:
            stress.append(np.diag(sim.cell["stress"]))
    assert np.allclose(np.mean(stress, axis=0), list(asked.values()), rtol=0.05), np.mean(stress, axis=0)
    assert abs(sim.energy["closure"]) < 1e-12 * sim.energy["in_play"]


def test_a_length_is_driven_while_the_others_follow_stresses():
    law = cn.LinearSpring(stiffness=1e5, restitution=0.2, mu=0.3)
    sim = packed(3, 3, law, rate={"zz": -0.5}, stress={"xx": 400.0, "yy": 400.0})
    height = sim.cell["lengths"][2]
    for _ in range(500):
        sim.step()
    assert sim.cell["lengths"][2] == pytest.approx(height * (1 - 0.5 * sim.dt) ** 500, rel=1e-9)
    assert sim.cell["rate"][0, 0] != 0 and sim.cell["rate"][2, 2] == -0.5


def test_scaled_inertia_keeps_weights_and_warns():
    """A sphere on a floor settles to the same overlap with a step ten times as long, and a fall takes ten times as long."""
    ends = []
    for scale in (1.0, 100.0):
        scene = cn.Scene(3, gravity=(0, 0, -9.81))
        scene.add(cn.spheres([(0, 0, 0.999 * R)], R, ROCK), cn.wall((0, 0, 0), (0, 0, 1), ROCK))
        scene.interact("*", "*", cn.LinearSpring(stiffness=1e3, restitution=0.3))
        sim = cn.Simulation(scene, 1e-9, cn.SmoothDEM(mass_scale=scale), overlap="ignore")
        stable = sim.stable_step
        sim.dt = 0.05 * stable
        if scale > 1:
            with pytest.warns(cn.StableStepWarning, match="100 times the inertia"):
                sim.step()
        for _ in range(3000):
            sim.step()
        assert abs(sim.energy["closure"]) < 1e-12 * sim.energy["in_play"]
        ends.append((stable, sim.bodies.position[0, 2], sim.contacts.force[0, 2]))
    assert ends[1][0] == pytest.approx(10 * ends[0][0], rel=1e-12)
    assert R - ends[1][1] == pytest.approx(R - ends[0][1], rel=1e-6)
    assert ends[1][2] == pytest.approx(2600 * 4 / 3 * np.pi * R**3 * 9.81, rel=1e-6)
    with pytest.raises(ValueError, match="at least 1"):
        cn.SmoothDEM(mass_scale=0.5)
    with pytest.raises(ValueError, match="VelocityVerlet"):
        cn.SmoothDEM(mass_scale=2.0, integrator=cn.Gear())


def test_a_cell_that_is_damped_comes_to_rest_sooner_at_low_pressure():
    """A packed cell rings at a frequency far below that of its contacts, whose dashpots hardly damp it: a share of the force
    against its rate does, and the stress that it ends at is the same."""
    swings = []
    for share in (0.0, 0.25):
        law = cn.LinearSpring(stiffness=1e5, restitution=0.8, mu=0.3)
        sim = packed(3, 4, law, pitch=1.9, strategy=cn.SmoothDEM(cell_damping=share), stress=2e3)
        sim.run(steps=3500, progress=False)
        pressure = []
        for _ in range(25):
            sim.run(steps=20, progress=False)
            pressure.append(np.trace(sim.cell["stress"]) / 3)
        swings.append(np.std(pressure) / 2e3)
    assert swings[1] < 0.2 * swings[0] and abs(np.mean(pressure) / 2e3 - 1) < 0.02, swings
    with pytest.raises(ValueError, match="cell_damping is 1"):
        cn.SmoothDEM(cell_damping=1.0)
