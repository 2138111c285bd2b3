"""Joints that a step too long for the bodies beside them misses: told, and not called converged."""

import re
import warnings

import cairn as cn
import numpy as np
import pytest

DT, CORNERS = 1e-3, np.array([[-0.1, -0.02], [0.1, -0.02], [0.1, 0.02], [-0.1, 0.02]])


def pendulum(dt, tol=1e-4):
    """Five light bars in a row, and one 1e4 times as heavy at their end."""
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    light, heavy = cn.Material("light", density=1.0), cn.Material("heavy", density=1e4)
    bars = list(scene.add(cn.polygons([CORNERS + (0.1 + 0.2 * k, 0.0) for k in range(5)], light)))
    bars.extend(scene.add(cn.polygons([CORNERS + (1.1, 0.0)], heavy)))
    scene.interact("*", "*", None)
    for k, bar in enumerate(bars):
        scene.join(bar, bars[k - 1] if k else None, cn.Pivot(point=(0.2 * k, 0.0)))
    return cn.Simulation(scene, dt, cn.NSCD(solver=cn.Auto(tol=tol)))


def gaps(sim, dt):
    """Distances of two points that are joined, of each joint, in the middle of the next step."""
    place = sim.bodies.position[:6] + dt / 2 * sim.bodies.velocity[:6, :2]
    angle = np.ravel(sim.bodies.rotation)[:6] + dt / 2 * sim.bodies.velocity[:6, 2]
    arm = 0.1 * np.column_stack([np.cos(angle), np.sin(angle)])
    return np.array([np.linalg.norm(place[0] - arm[0]), *np.linalg.norm((place + arm)[:-1] - (place - arm)[1:], axis=1)])


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_a_step_that_misses_a_joint_is_not_converged():
    """Steps of 1 ms missed joints by centimetres, each called converged."""
    sim, missed = pendulum(DT), 0
    for _ in range(400):
        info = sim.step()
        found = gaps(sim, DT).max()
        if info["status"] == "converged":
            assert found < 2e-5
        else:
            missed += 1
            assert "joint" in info["hint"] and "dt of at most" in info["hint"] and info["joint_error"] > 1e-4
        assert info["joint_gap"] <= found * (1 + 1e-6) + 1e-12 and found <= 1.5 * info["joint_gap"] + 1e-12  # of both axes
        assert info["joint_error"] == pytest.approx(info["joint_gap"] / 0.1, rel=1e-9)
    assert missed > 50


def test_the_warning_names_a_joint_and_a_step_that_holds_it():
    """Rounding starts the swings of the light bars and so decides which joint fails first. The warning names the joint with the
    largest gap, to a factor of sqrt(2): the error is measured along two axes."""
    sim = pendulum(DT)
    with warnings.catch_warnings(record=True) as kept:
        warnings.simplefilter("always", cn.JointWarning)
        for _ in range(300):
            sim.step()
            if kept:
                break
        found = gaps(sim, DT)
        told = re.search(r"joint (\d+) will be off by (\S+) m.*dt of at most [1-5]", str(kept[0].message))
        assert told and found[int(told[1])] >= found.max() / np.sqrt(2)
        assert found[int(told[1])] / np.sqrt(2) <= float(told[2]) * 1.01 and float(told[2]) <= found.max() * 1.01
        for _ in range(50):
            sim.step()
    assert [each.category for each in kept] == [cn.JointWarning]
    fine = pendulum(2.5e-4)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for _ in range(2000):
            info = fine.step()
            assert info["status"] == "converged" and info["joint_error"] < 1e-6


def test_scenes_without_joints_tell_none():
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    scene.add(cn.disks([(0.0, 1.0)], [0.1], cn.Material("stone", density=1.0)))
    assert "joint_error" not in cn.Simulation(scene, DT).step()
