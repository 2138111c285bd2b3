"""A lid that weighs hundreds of the grains under it asks no more of them than the grains of a deep pile give."""

import cairn as cn
import numpy as np
import pytest


def pressed(solver, density, count=1500, width=1.8):
    radii = np.random.default_rng(1).uniform(0.01, 0.02, count)
    centers = cn.pre.deposit_disks(radii, width)
    grain, heavy = cn.Material("grain", density=1000.0), cn.Material("heavy", density=density)
    half, top = width / 2 - 1e-3, (centers[:, 1] + radii).max()
    lid = [np.array([(-half, -0.05), (half, -0.05), (half, 0.05), (-half, 0.05)])]
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.disks(centers, radii, grain), cn.wall((0, 0), (0, 1), grain), cn.wall((0, 0), (1, 0), grain),
              cn.wall((width, 0), (-1, 0), grain))  # fmt: skip
    scene.add(cn.polygons(lid, heavy, position=[[width / 2, top + 0.05]]))
    scene.interact("*", "*", cn.Coulomb(mu=0.4))
    return cn.Simulation(scene, 1e-3, cn.NSCD(solver=solver), overlap="ignore")


@pytest.mark.parametrize(("solver", "density"), [(cn.Default, 900.0), (cn.NLGS, 2200.0)])
def test_a_lid_takes_few_sweeps_more_than_a_pile(solver, density):
    sim = pressed(solver(tol=1e-4, max_iter=1500), density)
    ratio = sim.bodies.mass[np.isfinite(sim.bodies.mass)].max() / sim.bodies.mass.min()
    assert ratio > (900 if solver is cn.NLGS else 100)  # light errors are measured
    told = []
    for _ in range(25):
        sim.step()
        told.append((sim.info["status"] == "converged", sim.info["iterations"], sim.info["light_error"]))
    converged, iterations, light = np.array(told[10:], float).T
    assert converged.all() and iterations.mean() < 700
    assert 0 < light.min() and light.max() <= 1e-4
