"""Periodic cells of smooth grains that follow a stress, component by component; inertia scaled for slow loading."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=2600.0)
R = 0.005


def packed(dim, count, law, share=0.2, strategy=None, **driven):
    rng = np.random.default_rng(3)
    x = np.stack(np.meshgrid(*[np.arange(count)] * dim, indexing="ij"), -1).reshape(-1, dim) * 2.1 * R
    x = x + 0.05 * R * rng.uniform(-1, 1, x.shape)
    scene = cn.Scene(dim, periodic=cn.Periodic((count * 2.1 * R,) * dim, **driven))
    scene.add((cn.disks if dim == 2 else cn.spheres)(x, R * rng.uniform(0.8, 1.0, len(x)), ROCK))
    scene.interact("*", "*", law)
    sim = cn.Simulation(scene, 1e-9, strategy or cn.SmoothDEM(), overlap="ignore")
    sim.dt = share * sim.stable_step
    return sim


def test_a_row_bears_the_pressure():
    """Two disks in a cell of a row: the force between them is the pressure times the width, exactly at rest."""
    scene = cn.Scene(2, periodic=cn.Periodic((4 * R, 2 * R), stress={"xx": 50.0, "yy": 50.0}))
    scene.add(cn.disks([(R, R), (3 * R, R)], R, ROCK))
    scene.interact("*", "*", cn.LinearSpring(stiffness=1e4, restitution=0.05))
    sim = cn.Simulation(scene, 1e-9, cn.SmoothDEM(), overlap="ignore")
    sim.dt = 0.2 * sim.stable_step
    for _ in range(6000):
        sim.step()
    assert np.allclose(np.diag(sim.cell["stress"]), 50.0, rtol=1e-4)
    width, height = sim.cell["lengths"][:2]
    force = np.linalg.norm(sim.contacts.force, axis=1)
    across = np.abs(sim.contacts.normal[:, 0]) > 0.5
    assert np.allclose(force[across], 50.0 * height, rtol=1e-4)
    assert np.allclose(force[~across].sum(), 50.0 * width, rtol=1e-4)


@pytest.mark.parametrize("dim", [2, 3])
def test_grains_come_to_rest_under_an_isotropic_stress(dim):
    law = cn.LinearSpring(stiffness=1e5, restitution=0.2, mu=0.3)
    sim = packed(dim, 4, law, stress=500.0)
    for _ in range(4000):
        sim.step()
    stress = np.array(sim.cell["stress"])
    assert np.allclose(np.diag(stress), 500.0, rtol=0.05), stress
    assert abs(sim.energy["closure"]) < 1e-12 * sim.energy["in_play"]


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
