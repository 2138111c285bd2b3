"""Dense scenes that the benchmarks share, made here: deposits of disks and spheres in a box, settled by a few steps."""

from __future__ import annotations

import dataclasses

import cairn as cn
import numpy as np


def deposit(case, count, tol=1e-4, max_iter=1000, min_iter=1, threads=1, steps=0, seed=1, **strategy):
    """A simulation of `count` disks or spheres in a box about as high as wide, mu 0.4, after some steps."""
    rng = np.random.default_rng(seed)
    radii = rng.uniform(0.005, 0.01, count)
    rock = cn.Material("rock", density=2600.0)
    if case == "disks":
        width = np.sqrt(np.sum(np.pi * radii**2) / 0.8)
        centers = cn.pre.deposit_disks(radii, width)
        scene = cn.Scene(2, gravity=(0, -9.81))
        scene.add(cn.disks(centers, radii, rock), cn.box((0, 0), (width, 2 * width), rock, lid=False))
    else:
        width = np.cbrt(np.sum(4 / 3 * np.pi * radii**3) / 0.55)
        centers = cn.pre.deposit_spheres(radii, (width, width))
        scene = cn.Scene(3, gravity=(0, 0, -9.81))
        scene.add(cn.spheres(centers, radii, rock), cn.box((0, 0, 0), (width, width, 2 * width), rock, lid=False))
    scene.interact(rock, rock, cn.Coulomb(mu=0.4))
    solver = cn.NLGS(tol=tol, max_iter=max_iter, min_iter=min_iter)
    if min_iter > 1 and hasattr(solver, "acceleration"):  # as many plain sweeps in every step, also by earlier versions
        solver = dataclasses.replace(solver, acceleration="none")
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(solver=solver, threads=threads, **strategy), overlap="ignore")
    for _ in range(steps):
        sim.step()
    return sim
