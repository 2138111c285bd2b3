"""Joints under the integrators that keep derivatives of the motion: hard ones, springs, limits."""

import cairn as cn
import numpy as np
import pytest
from keeping_integrators import KEEPING

STONE = cn.Material("stone", density=1000.0)
RADIUS, GRAVITY = 0.05, 9.81
MASS = 1000.0 * np.pi * RADIUS**2


def hung(joint, integrator, dt, height=0.0):
    scene = cn.Scene(2, gravity=(0.0, -GRAVITY))
    disk = scene.add(cn.disks([[0.0, height]], [RADIUS], STONE))[0]
    scene.interact("*", "*", None)
    scene.join(disk, None, joint)
    return cn.Simulation(scene, dt, cn.NSCD(integrator=integrator, solver=cn.NLGS(tol=1e-12)))


def largest_error(integrator, dt, damping):
    """Largest error in the height of a disk let go on a spring with a dashpot, over its sag, in a second."""
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


def energy_left(kind, integrator, dt):
    """Energy gained or lost in a swing of 0.3 s, over its largest kinetic energy."""
    scene = cn.Scene(2 if kind == "bars" else 3, gravity=(0.0, -GRAVITY) if kind == "bars" else (0.0, 0.0, -GRAVITY))
    if kind == "bars":
        corners = np.array([[-0.1, -0.02], [0.1, -0.02], [0.1, 0.02], [-0.1, 0.02]])
        ends = scene.add(cn.polygons([corners + (0.1, 0.0), corners + (0.3, 0.0)], STONE))
        joints = [cn.Pivot(point=(0.0, 0.0)), cn.Distance(points=[(0.2, 0.0), (0.3, 0.0)])]
    elif kind == "boxes":
        ends = scene.add(cn.boxes([(0.1, 0.0, 0.0), (0.3, 0.0, 0.0)], [(0.2, 0.04, 0.06)] * 2, STONE))
        joints = [cn.Ball(point=(0.0, 0.0, 0.0)), cn.Hinge(point=(0.2, 0.0, 0.0), axis=(0.0, 1.0, 0.0))]
    else:
        ends = scene.add(cn.spheres([[0.1, 0.0, 0.0], [0.3, 0.0, 0.0]], [0.1, 0.1], STONE))
        joints = [cn.Ball(point=(0.0, 0.0, 0.0)), cn.Fixed(point=(0.2, 0.0, 0.0))]
    scene.interact("*", "*", None)
    scene.join(ends[0], None, joints[0])
    scene.join(ends[0], ends[1], joints[1])
    sim = cn.Simulation(scene, dt, cn.NSCD(integrator=integrator, solver=cn.NLGS(tol=1e-10, max_iter=5000)))
    largest = 0.0
    for _ in range(round(0.3 / dt)):
        sim.step()
        info = sim.info
        largest = max(largest, info["energy"]["kinetic"])
        assert info["status"] == "converged"
    return abs(info["energy"]["kinetic"] + info["energy"]["potential"]) / largest


@pytest.mark.parametrize("kind", ["bars", "boxes", "spheres"])
@pytest.mark.parametrize("name", KEEPING)
def test_hard_joints_keep_the_energy_to_second_order(name, kind):
    """Their impulses acted along the axes of where contacts are detected, which is the middle of the step under no such
    integrator: energy drifted in the first order of the step, by up to a tenth in a second of steps of 1 ms."""
    coarse, fine = (energy_left(kind, KEEPING[name], dt) for dt in (4e-3, 2e-3))
    assert fine < 1e-3 and (coarse > 3.5 * fine or coarse < 1e-5)
