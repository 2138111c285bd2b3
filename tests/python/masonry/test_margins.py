"""Stacks a millionth of a block from their limit, by default: those inside stand, those outside fall."""

import cairn as cn
import numpy as np
import pytest

STONE = cn.Material("stone", 2000.0)


def overhang(height, margin, mu, blocks=5):
    """Blocks of length 1 over the edge of a table, each out as far as those above allow, and by `margin` more."""
    centres = [0.0]
    for _ in range(blocks):
        centres.append(np.mean(centres) - margin - 0.5)
    *stack, table = centres
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    box = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]) * (1.0, height)
    scene.add(cn.polygons(box * (10.0, 1.0), STONE, position=[[table - 4.5, -height / 2]], fixed=True))
    places = [[x, height * (blocks - 0.5 - k)] for k, x in enumerate(stack)]
    scene.add(cn.polygons(box, STONE, position=places))
    scene.interact("*", "*", cn.Coulomb(mu=mu))
    return cn.Simulation(scene, 1e-2)


def moved(height, margin, mu, steps):
    simulation = overhang(height, margin, mu)
    start = np.array(simulation.bodies.position)
    for _ in range(steps):
        assert simulation.step()["status"] == "converged"
    return np.abs(simulation.bodies.position - start).max()


@pytest.mark.parametrize("mu", [0.0, 0.5])
@pytest.mark.parametrize("height", [0.05, 0.25, 1.0])
def test_a_stack_stands_inside_its_limit_and_falls_outside(height, mu):
    assert moved(height, -1e-6, mu, 400) < 1e-9  # it had moved by 1e-2 in 100 to 1000 steps
    inside, outside = moved(height, 1e-6, mu, 100), moved(height, 1e-6, mu, 200)
    assert outside > 3 * inside > 1e-7
