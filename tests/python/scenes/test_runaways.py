"""Steps that give a body more way than the scene can mean are told of, whatever the next steps converge to."""

import warnings

import cairn as cn
import numpy as np
import pytest

STONE = cn.Material("stone", density=2500.0)


def falling(dim, kick=0.0, size=1.0):
    scene = cn.Scene(dim, gravity=[0.0] * (dim - 1) + [-9.81 * size])
    x = size * np.array([[0.3 * k] + [0.0] * (dim - 1) for k in range(4)])
    v = np.zeros((4, 3 * dim - 3))
    v[2, 0] = kick * size
    scene.add((cn.disks if dim == 2 else cn.spheres)(x, 0.1 * size, STONE, velocity=v))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, 1e-3)


@pytest.mark.parametrize("size", [1.0, 2.0**-20])
@pytest.mark.parametrize("dim", [2, 3])
def test_a_body_that_runs_away_is_told_once(dim, size):
    sim = falling(dim, 1e12, size)
    with pytest.warns(cn.RunawayWarning, match=r"moves .* m in step 1, and all bodies reach over"):
        sim.step()
    with warnings.catch_warnings():
        warnings.simplefilter("error", cn.RunawayWarning)
        sim.step()


@pytest.mark.parametrize("dim", [2, 3])
def test_what_is_fast_is_no_runaway(dim):
    """A thousand times the scene in a step is a shot."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", cn.RunawayWarning)
        for kick in (0.0, 1e6):
            sim = falling(dim, kick)
            for _ in range(3):
                sim.step()


@pytest.mark.parametrize("shape", ["sphere", "box"])
def test_a_body_alone_leaves_nothing(shape):
    """A grain of dust flies a million times its size in a long step."""
    scene = cn.Scene(3)
    velocity = np.array([[3.0, 0, 0, 0, 0, 0]])
    if shape == "sphere":
        scene.add(cn.spheres([[0.0, 0, 0]], 1e-6, STONE, velocity=velocity))
    else:
        scene.add(cn.boxes([[0.0, 0, 0]], [[1e-6] * 3], STONE, velocity=velocity))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    with warnings.catch_warnings():
        warnings.simplefilter("error", cn.RunawayWarning)
        sim = cn.Simulation(scene, 10.0)
        for _ in range(3):
            sim.step()
