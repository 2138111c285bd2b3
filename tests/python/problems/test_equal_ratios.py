"""Lemke's pivots where contacts are alike, so that many ratios are equal, and where right-hand sides grow."""

import cairn as cn
import numpy as np
import pytest
from kernels import kernel


@pytest.mark.parametrize(("columns", "rows", "steps"), [(5, 5, 60), (4, 4, 60), (5, 3, 40), (4, 5, 60)])
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


def test_right_hand_sides_that_grow_leave_a_row_to_pivot_in():
    """Right-hand sides of a badly scaled matrix grow to 1e8 times the first ones. Their rounding exceeded the tolerance for equal
    ratios, which knew the first ones alone: no row was tied with the least ratio, and the index of the pivot was not set."""
    rng, m, rays = np.random.default_rng(7), 8, 0
    pivots = kernel("cairn_lemke_pivots")
    for _ in range(1500):
        b, size = rng.standard_normal((m, m)), 10.0 ** rng.uniform(-6, 0, m)
        matrix, q = b @ b.T * np.sqrt(size[:, None] * size), -rng.uniform(0.1, 1, m)
        tableau = np.ascontiguousarray(np.vstack([-matrix.T, -np.ones(m), q]))
        basis, other, count = (np.zeros(k, int) for k in (m, m + 1, 1))
        status = pivots(m, 1000, tableau, basis, other, count)
        rays += status == 1
        if status == 1:
            continue
        assert status == 0
        z = np.zeros(m)
        of_z = basis > m
        z[basis[of_z] - m - 1] = tableau[-1, of_z]
        w = matrix @ z + q
        # the condition of b b' is that of the matrix with rows and columns scaled to the same size
        rounding = 64 * m * np.finfo(float).eps * np.linalg.cond(b) ** 2 * (np.abs(matrix) @ z + np.abs(q))
        assert (z >= 0).all() and (w >= -rounding).all() and (np.abs(w) <= rounding)[z > 0].all()
    assert rays <= 5  # pivots of less than 1e-8 of their column are not taken
