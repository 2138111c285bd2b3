"""Where joints end: each kind breaks at its strength, sliders and distances stop at their limits."""

import cairn as cn
import numpy as np
import pytest
from test_joints import G, scene_of, simulate

MASS = {2: 1000.0 * 0.2 * 0.04, 3: 1000.0 * 0.2 * 0.04 * 0.06}


def hung(dim, kind, strength):
    """A joint that bears the weight of a bar at the origin, at its middle."""
    middle, along, above = np.zeros(dim), np.eye(dim)[0], 0.5 * np.eye(dim)[-1]
    if kind in ("Distance", "Cable"):
        points = [middle, above] if kind == "Distance" else [middle, above, above + along]
        return getattr(cn, kind)(points=points, strength=strength)
    axis = {"Slider": along, "Hinge": np.eye(dim)[1]}
    return getattr(cn, kind)(point=middle, strength=strength, **({"axis": axis[kind]} if kind in axis else {}))


KINDS = [(2, k) for k in ("Pivot", "Fixed", "Slider", "Distance", "Cable")]
KINDS += [(3, k) for k in ("Ball", "Hinge", "Fixed", "Slider", "Distance", "Cable")]


@pytest.mark.parametrize("late", [False, True])
@pytest.mark.parametrize(("dim", "kind"), KINDS)
def test_each_kind_breaks_at_its_strength(dim, kind, late):
    """Loaded by a weight of 1.01 and of 0.99 of it, made in the scene or in the run; broken joints stay broken."""
    for share, holds in ((1.01, True), (0.99, False)):
        scene, ids = scene_of(dim, [np.zeros(dim)])
        joint = hung(dim, kind, share * MASS[dim] * G)
        if not late:
            scene.join(ids[0], None, joint)
        sim = simulate(scene, 1e-3)
        if late:
            sim.join(ids[0], None, joint)
        for _ in range(100):
            sim.step()
        fell, free = -sim.bodies.position[0, -1], 0.5 * G * 0.1**2
        assert (sim.contacts.beta.max(initial=0.0) == 1) == holds
        assert abs(fell) < 1e-9 * free if holds else fell == pytest.approx(free, rel=0.05)
        energy = sim.info["energy"]
        assert abs(energy["closure"]) <= 1e-10 * energy["in_play"]


@pytest.mark.parametrize("dim", [2, 3])
def test_a_slider_stops_at_both_of_its_limits(dim):
    """A bar thrown along its axis, on which it then falls back: it ends at one limit, and at the other."""
    axis = np.eye(dim)[0] + np.eye(dim)[-1]
    axis /= np.linalg.norm(axis)
    for direction, limit in ((1.0, 0.07), (-1.0, -0.04)):
        scene, ids = scene_of(dim, [np.zeros(dim)], velocity=[[*(direction * 2.0 * axis), *np.zeros(2 * dim - 3)]], gravity=False)
        scene.join(ids[0], None, cn.Slider(point=np.zeros(dim), axis=axis, limits=(-0.04, 0.07)))
        sim = simulate(scene, 1e-3)
        way = [0.0]
        for _ in range(80):
            assert sim.step()["status"] == "converged"
            way.append(sim.bodies.position[0] @ axis)
            assert np.linalg.norm(sim.bodies.position[0] - way[-1] * axis) < 1e-12
        way = np.array(way) * direction
        free = np.arange(81) * 2e-3
        moving = free < abs(limit) - 2e-3
        assert np.abs(way[moving] - free[moving]).max() < 1e-10 * abs(limit)
        assert np.abs(way[free > abs(limit) + 4e-3] - abs(limit)).max() < 1e-9 * abs(limit)
        energy = sim.info["energy"]
        assert abs(energy["closure"]) < 1e-10 * energy["in_play"] and energy["kinetic"] < 1e-12 * energy["in_play"]


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_distance_between_two_bodies_stops_at_both_of_its_limits(dim, direction):
    """Bars that fly apart, or at each other, and turn: once at the limit they go on together, momenta are kept."""
    along, spin = np.eye(dim)[0], np.zeros(2 * dim - 3)
    scene, ids = scene_of(
        dim, [np.zeros(dim), 0.5 * along], gravity=False,
        velocity=[[*(-direction * along + np.eye(dim)[-1]), *spin], [*(direction * along), *spin]])  # fmt: skip
    ends = [np.zeros(dim), 0.5 * along]  # at their centres
    scene.join(ids[0], ids[1], cn.Distance(points=ends, limits=(0.42, 0.56)))
    sim = simulate(scene, 1e-3)
    p = sim.bodies.mass @ sim.bodies.velocity[:, :dim]
    apart, limit = [], 0.56 if direction > 0 else 0.42
    for k in range(300):
        assert sim.step()["status"] == "converged"
        apart.append(np.linalg.norm(sim.bodies.position[1] - sim.bodies.position[0]))
        if k == 10:
            relative = sim.bodies.velocity[1, :dim] - sim.bodies.velocity[0, :dim]
            assert relative == pytest.approx(2 * direction * along - np.eye(dim)[-1], abs=1e-9)  # nothing holds yet
    apart = np.array(apart)
    assert apart.max() < 0.56 * (1 + 1e-6) and apart.min() > 0.42 * (1 - 1e-6)
    assert np.abs(apart - limit).min() < 1e-6 * limit
    assert sim.bodies.mass @ sim.bodies.velocity[:, :dim] == pytest.approx(p, abs=1e-10 * np.abs(p).max())
    energy = sim.info["energy"]
    assert abs(energy["closure"]) <= 1e-10 * energy["in_play"]
