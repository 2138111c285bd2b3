"""Superquadrics with flat faces come to rest on them: corners on a face, a little behind its middle, bear it."""

import warnings

import cairn as cn
import numpy as np
import pytest

STONE = cn.Material("stone", density=1000.0)
HALF = np.array([0.3, 0.2, 0.1])
# about the vertical or the axis that is up: which half axis is up
UP = {2: [1.0, 0, 0, 0], 0: [np.sqrt(0.5), 0, np.sqrt(0.5), 0], 1: [np.sqrt(0.5), np.sqrt(0.5), 0, 0]}


def times(p, q):
    w = p[0] * q[0] - np.dot(p[1:], q[1:])
    return np.array([w, *(p[0] * np.array(q[1:]) + q[0] * np.array(p[1:]) + np.cross(p[1:], q[1:]))])


def ground(kind):
    if kind == "wall":
        return cn.wall((0, 0, 0), (0, 0, 1), STONE)
    if kind == "box":
        return cn.boxes([[0, 0, -0.5]], (4, 4, 1), STONE, fixed=True)
    if kind == "superquadric":
        return cn.superquadrics([[0, 0, -1.0]], (2, 2, 1), (0.1, 0.1), STONE, fixed=True)
    x, y = np.meshgrid(np.linspace(-2, 2, 9), np.linspace(-2, 2, 9), indexing="ij")
    corner = np.array([9 * i + j for i in range(8) for j in range(8)])
    one = np.column_stack((corner, corner + 9, corner + 1))
    other = np.column_stack((corner + 9, corner + 10, corner + 1))
    return cn.surface(np.column_stack((x.ravel(), y.ravel(), 0 * x.ravel())), np.concatenate([one, other]), STONE)


def settle(exponents, kind="wall", up=2, time=1.5, h=1e-3, tilt=0.02, count=1):
    lean = np.array([np.cos(tilt / 2), 0.6 * np.sin(tilt / 2), 0.8 * np.sin(tilt / 2), 0])
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    z = HALF[up] + 0.01 + (2 * HALF[up] + 0.01) * np.arange(count)
    places = np.column_stack((0 * z, 0 * z, z))
    rotation = np.tile(times(lean, UP[up]), (count, 1))
    scene.add(cn.superquadrics(places, HALF, exponents, STONE, rotation=rotation), ground(kind))
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    sim = cn.Simulation(scene, h)
    for _ in range(round(time / h)):
        sim.step()
    wanted = HALF[up] * (1 + 2 * np.arange(count))
    below = 1.0 if kind == "superquadric" else 0.0
    moving = np.abs(sim.bodies.velocity[:count, 3:]).max()
    return (sim.bodies.position[:count, 2] - wanted) / HALF[up], moving, below


@pytest.mark.parametrize("exponent, time", [(0.05, 1.5), (0.1, 1.5), (0.3, 1.5), (0.5, 2.0), (0.7, 5.0)])
def test_a_box_like_superquadric_comes_to_rest(exponent, time):
    """At half its height to 1e-3; it sank through the floor by 0.7 of that in 5 s with exponent 0.05, by 0.03 with 0.5."""
    off, moving, _ = settle((exponent, exponent), time=time)
    assert np.abs(off).max() < 1e-3
    assert moving < 1e-2 or exponent > 0.5  # nearly round shapes rock for long


@pytest.mark.parametrize("up", [0, 1, 2])
@pytest.mark.parametrize("kind", ["wall", "box", "triangles", "superquadric"])
def test_it_rests_on_each_of_its_faces_and_on_any_ground(kind, up):
    off, _, below = settle((0.2, 0.2), kind, up)
    assert np.abs(off).max() < 1e-3 * (1 + below / HALF[up])


@pytest.mark.parametrize("up, exponents", [(2, (0.1, 1.0)), (2, (0.2, 1.5)), (0, (0.1, 0.5)), (1, (0.1, 1.0))])
def test_faces_that_are_round_or_flat_one_way(up, exponents):
    """Ends of drums and of rhombic prisms, prisms and drums on their sides: none sinks."""
    off, _, _ = settle(exponents, up=up)
    assert off.min() > -1e-3


def test_superquadrics_rest_on_each_other():
    off, _, _ = settle((0.1, 0.1), count=3, time=2.0)
    assert np.abs(off).max() < 3e-3


def test_a_drum_rolls_as_a_cylinder_does():
    """Round across its third axis: the corners of the flat part of its side move with the lowest point."""
    ends = []
    for drum in (False, True):
        scene = cn.Scene(3, gravity=(2.0, 0, -9.81))
        turned = [[np.sqrt(0.5), np.sqrt(0.5), 0, 0]]
        if drum:
            scene.add(cn.superquadrics([[0, 0, 0.1]], (0.1, 0.1, 0.2), (0.05, 1.0), STONE, rotation=turned))
        else:
            scene.add(cn.cylinders([[0, 0, 0.1]], 0.1, 0.4, STONE, rotation=turned))
        scene.add(ground("wall"))
        scene.interact("*", "*", cn.Coulomb(mu=0.5))
        sim = cn.Simulation(scene, 1e-3)
        for _ in range(500):
            sim.step()
        mass, inertia = sim.bodies.mass[0], np.ravel(sim.bodies.inertia[0])
        about = inertia[np.argmax(np.abs(inertia - np.median(inertia)))]
        ends.append(sim.bodies.velocity[0, 0] * (1 + about / (mass * 0.01)) / (2.0 * 0.5))
    assert ends[0] == pytest.approx(1, rel=1e-6) and ends[1] == pytest.approx(1, rel=2e-3)


def tumbling(exponent, half, spin, time=0.9, **options):
    """Warnings and the largest overlap, over the least half axis, of a superquadric that rolls over its edges."""
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    velocity = [[0, 0, 0, spin, 0.6 * spin, 0]]
    scene.add(cn.superquadrics([[0, 0, 1.1 * half[2]]], half, (exponent, exponent), STONE, velocity=velocity), ground("wall"))
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(**options))
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        for _ in range(round(time / 1e-3)):
            sim.step()
    return [str(w.message) for w in found if w.category is cn.OverlapWarning], sim.info["largest_penetration"]


def test_one_that_rolls_over_its_edges_and_sinks_is_told():
    words, deepest = tumbling(0.5, HALF, 8.0)
    assert len(words) == 1 and words[0].startswith("superquadric 0 overlaps by 0.01") and deepest > 0.01
    words, deepest = tumbling(0.5, HALF, 8.0, project_positions=True)
    assert not words and deepest < 0.01
    assert not tumbling(0.1, HALF, 0.0)[0]
