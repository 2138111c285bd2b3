"""Bars and ropes collinear with their loads: along the line they constrain, across it they have only a second-order elongation.

The transverse velocity that would correct their length diverges as the line gets straight, and threw weights away at 1e19 m/s in
converged steps. Weights now stay within the fall of a step.
"""

import cairn as cn
import numpy as np
import pytest

steel = cn.Material("steel", density=2000.0)
GRAVITY = 9.81


def place(dim, x, y):
    return (x, y) if dim == 2 else (x, 0.0, y)


def empty(dim):
    scene = cn.Scene(dim, gravity=place(dim, 0.0, -GRAVITY))
    scene.interact("*", "*", None)
    return scene, cn.disks if dim == 2 else cn.spheres


def between(dim, kind):
    """A weight between two bars or ropes in one line."""
    scene, round_bodies = empty(dim)
    (weight,) = scene.add(round_bodies([place(dim, 0.0, 0.0)], 0.1, steel))
    for x in (-1.0, 1.0):
        ends = [place(dim, 0.0, 0.0), place(dim, x, 0.0)]
        scene.join(weight, None, cn.Distance(points=ends) if kind == "bars" else cn.Cable(points=[*ends, place(dim, x, 5.0)]))
    return scene, 0


CASES = {"bars": lambda dim: between(dim, "bars"), "ropes": lambda dim: between(dim, "ropes")}


@pytest.mark.parametrize("dt", [1e-2, 1e-3])
@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("case", CASES)
def test_what_is_in_line_stays_there(case, dim, dt):
    scene, body = CASES[case](dim)
    sim, farthest = cn.Simulation(scene, dt), 0.0
    for _ in range(200):
        sim.step()
        farthest = max(farthest, abs(sim.bodies.position[body, dim - 1]))
    # free, it would be (200 dt)^2 g/2 = 20 or 0.2 m down; a step's fall is 1e-3 or 1e-5 m
    assert farthest < 1e-2
    assert np.isfinite(sim.bodies.velocity).all()
