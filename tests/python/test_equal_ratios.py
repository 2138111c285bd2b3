"""Lemke's pivots where contacts are alike, so that many ratios are equal."""

import cairn as cn
import pytest


@pytest.mark.parametrize(("columns", "rows", "steps"), [(5, 5, 60), (4, 4, 60), (5, 3, 40)])
def test_pivots_solve_packs_of_equal_disks(columns, rows, steps):
    stone = cn.Material("stone", density=2400.0)
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.disks([(i + 0.5 * (j % 2), 0.5 + 0.87 * j) for j in range(rows) for i in range(columns)], 0.5, stone))
    scene.add(cn.wall((0, 0), (0, 1), stone), cn.wall((-0.5, 0), (1, 0), stone), cn.wall((columns, 0), (-1, 0), stone))
    scene.interact(stone, stone, cn.Coulomb(mu=0.5))
    sim = cn.Simulation(scene, dt=1e-3)
    sim.run(steps=steps, progress=False)
    found = sim.problem().solve("lemke", tol=1e-8)
    assert found.status == "converged" and found.error < 1e-11
