"""Springs and limits of joints under the integrators that keep derivatives of the motion."""

import cairn as cn
import numpy as np
import pytest

STONE = cn.Material("stone", density=1000.0)
RADIUS, GRAVITY = 0.05, 9.81
MASS = 1000.0 * np.pi * RADIUS**2
KEEPING = {
    "velocity verlet": cn.VelocityVerlet(),
    "gear 4": cn.Gear(values=4),
    "gear 5": cn.Gear(values=5),
    "gear 6": cn.Gear(values=6),
    "newmark": cn.Newmark(beta=0.3025, gamma=0.6),
    "hht": cn.HHT(alpha=-0.1),
    "generalised alpha": cn.GeneralisedAlpha(spectral_radius=0.8),
}


def hung(joint, integrator, dt, height=0.0):
    scene = cn.Scene(2, gravity=(0.0, -GRAVITY))
    disk = scene.add(cn.disks([[0.0, height]], [RADIUS], STONE))[0]
    scene.interact("*", "*", None)
    scene.join(disk, None, joint)
    return cn.Simulation(scene, dt, cn.NSCD(integrator=integrator, solver=cn.NLGS(tol=1e-12)))


def largest_error(integrator, dt, damping):
    """Of the height of a disk let go on a spring with a dashpot, over its sag, in a second."""
    rate = 10.0
    spring = cn.Spring(MASS * rate**2, 2 * damping * MASS * rate)
    sim = hung(cn.Distance(points=[(0.0, 0.0), (0.0, 1.0)], spring=spring), integrator, dt)
    damped, worst = rate * np.sqrt(1 - damping**2), 0.0
    for k in range(round(1.0 / dt)):
        sim.step()
        t = (k + 1) * dt
        swing = np.cos(damped * t) + damping * rate / damped * np.sin(damped * t)
        worst = max(worst, abs(sim.bodies.position[0][1] * rate**2 / GRAVITY + 1 - np.exp(-damping * rate * t) * swing))
    return worst


@pytest.mark.parametrize("damping", [0.0, 0.1])
@pytest.mark.parametrize("name", KEEPING)
def test_springs_of_joints_are_of_second_order(name, damping):
    coarse, fine = (largest_error(KEEPING[name], dt, damping) for dt in (4e-3, 2e-3))
    assert fine < 1e-3 and 3.5 < coarse / fine < 4.5


@pytest.mark.parametrize("name", KEEPING)
@pytest.mark.parametrize("kind", ["rope", "cable", "slider"])
def test_what_falls_into_a_limit_comes_to_rest(name, kind):
    """Under velocity Verlet velocities changed their sign in each step, and the force swung by a third of the weight and more."""
    top = RADIUS
    joints = {
        "rope": cn.Distance(points=[(0.0, top), (0.0, 1.0)], limits=(0.1, 1.0)),
        "cable": cn.Cable(points=[(0.0, top), (0.0, 1.0), (0.5, 0.5)], length=1.0 + np.hypot(0.5, 0.5)),
        "slider": cn.Slider(point=(0.0, top), axis=(0.0, 1.0), limits=(-top, 1.0)),
    }
    sim = hung(joints[kind], KEEPING[name], 1e-3, height=top)
    for _ in range(600):
        sim.step()
    for _ in range(10):
        sim.step()
        assert abs(sim.bodies.velocity[0][1]) < 1e-9 * GRAVITY * sim.dt
        assert np.linalg.norm(sim.contacts.impulse[0]) == pytest.approx(MASS * GRAVITY * sim.dt, rel=1e-9)
