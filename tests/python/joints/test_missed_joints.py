"""Joints that a step too long for the bodies beside them misses: told, and not called converged."""

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


def spinning(dt, spin):
    """Two bars in line that turn about the end of the first."""
    scene = cn.Scene(2)
    velocity = [[0.0, 0.1 * spin * (1 + 2 * k), spin] for k in range(2)]
    rock = cn.Material("rock", density=1000.0)
    bars = scene.add(cn.polygons([CORNERS + (0.1 + 0.2 * k, 0.0) for k in range(2)], rock, velocity=velocity))
    scene.interact("*", "*", None)
    for k, bar in enumerate(bars):
        scene.join(bar, bars[k - 1] if k else None, cn.Pivot(point=(0.2 * k, 0.0)))
    return cn.Simulation(scene, dt)


def gap(sim, dt, bars):
    """The largest distance of two points that are joined, in the middle of the next step."""
    place = sim.bodies.position[:bars] + dt / 2 * sim.bodies.velocity[:bars, :2]
    angle = np.ravel(sim.bodies.rotation)[:bars] + dt / 2 * sim.bodies.velocity[:bars, 2]
    arm = 0.1 * np.column_stack([np.cos(angle), np.sin(angle)])
    return max(np.linalg.norm(place[0] - arm[0]), *np.linalg.norm((place + arm)[:-1] - (place - arm)[1:], axis=1))


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("spin", [900.0, 1200.0])
def test_a_step_that_misses_a_joint_is_not_converged(spin):
    """Bodies turn by a radian in a step."""
    sim, missed = spinning(DT, spin), 0
    for _ in range(60):
        info = sim.step()
        found = gap(sim, DT, 2)
        if info["status"] == "converged":
            assert found < 2e-5
        else:
            missed += 1
            assert "joint" in info["hint"] and "dt of at most" in info["hint"] and info["joint_error"] > 1e-4
        assert info["joint_gap"] <= found * (1 + 1e-6) + 1e-12 and found <= 1.5 * info["joint_gap"] + 1e-12  # the resultant
        assert info["joint_error"] == pytest.approx(info["joint_gap"] / 0.1, rel=1e-9)
    assert missed > 20


def test_the_warning_names_a_joint_and_a_step_that_holds_it():
    sim = spinning(DT, 1200.0)
    with pytest.warns(cn.JointWarning, match="joint [01].*dt of at most") as kept:
        for _ in range(60):
            sim.step()
    assert sum(each.category is cn.JointWarning for each in kept) == 1
    fine = spinning(1e-4, 1200.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for _ in range(300):
            info = fine.step()
            assert info["status"] == "converged" and info["joint_error"] < 1e-4


@pytest.mark.parametrize("dt", [2e-3, DT, 2.5e-4])
def test_light_bars_under_a_heavy_one_are_held(dt):
    """Bars swing at least 16 times faster than the longest of these steps, in which joints opened by centimetres."""
    sim = pendulum(dt)
    for _ in range(round(0.35 / dt)):
        assert sim.step()["status"] == "converged"
        assert gap(sim, dt, 6) < 2e-5
    assert np.abs(sim.bodies.velocity[5, :2]).max() == pytest.approx(2.8, rel=0.05)


def test_scenes_without_joints_tell_none():
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    scene.add(cn.disks([(0.0, 1.0)], [0.1], cn.Material("stone", density=1.0)))
    assert "joint_error" not in cn.Simulation(scene, DT).step()
