"""A step of the strategies that solve a contact problem, on the same disks at the same error, on one core.

    script/bench strategies [--disks 20000] [--steps 60] [--from 20] [--tol 1e-3]

Disks of even sizes on a lattice in a box come to rest under gravity; the steps from --from on count. A line a strategy: CPU
milliseconds of a step and iterations, each over those of NSCD, the largest error and contacts at the end.
"""

import argparse
import csv
import os
import sys
import time

os.environ["OMP_NUM_THREADS"] = "1"

import cairn as cn
import numpy as np

ROCK = cn.Material("rock", density=2000.0)
RADIUS, DT = 0.005, 1e-4


def simulation(strategy, disks):
    """The box with its disks."""
    rng = np.random.default_rng(1)
    columns = int(round(disks**0.5))
    at = np.stack(np.meshgrid(np.arange(columns), np.arange(disks // columns), indexing="ij"), -1).reshape(-1, 2)
    centers = (at + 0.5) * 0.0100 + rng.uniform(-1e-5, 1e-5, at.shape)
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    scene.add(cn.disks(centers, rng.uniform(0.98, 1.0, len(centers)) * RADIUS, ROCK))
    scene.add(*cn.box((0, 0), (columns * 0.0100, 2.0), ROCK, lid=False))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, DT, strategy, overlap="ignore")


def strategies(tol):
    """By name; the stiffness of springs lets a contact ring in about 30 steps."""
    solver = cn.NLGS(tol=tol, max_iter=5000)
    stiffness = 2000.0 * np.pi * RADIUS**2 * (2 * np.pi / (30 * DT)) ** 2 / 2
    return {
        "NSCD": cn.NSCD(solver=solver),
        "Carpenter": cn.Carpenter(solver=solver),
        "Carpenter, penalty": cn.Carpenter(solver=solver, penalty=stiffness),
        "GranularElement": cn.GranularElement(solver=solver, stiffness=stiffness),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--disks", type=int, default=20_000)
    parser.add_argument("--steps", type=int, default=60)
    parser.add_argument("--from", type=int, default=20, dest="first", help="steps before do not count")
    parser.add_argument("--tol", type=float, default=1e-3)
    options = parser.parse_args()
    writer, known = csv.writer(sys.stdout), None
    writer.writerow(("tol", "strategy", "disks", "step_ms", "of_nscd", "iterations", "of_nscd_iterations", "error", "contacts"))
    for name, strategy in strategies(options.tol).items():
        sim, cpu, iterations, error = simulation(strategy, options.disks), 0.0, 0, 0.0
        for k in range(options.steps):
            begin = time.process_time()
            info = sim.step()
            if k >= options.first:
                cpu, iterations, error = (
                    cpu + time.process_time() - begin,
                    iterations + info["iterations"],
                    max(error, info["error"]),
                )
        counted = options.steps - options.first
        figures = 1e3 * cpu / counted, iterations / counted
        known = known or figures
        of = [f"{mine / first:.2f}" for mine, first in zip(figures, known)]
        row = (
            options.tol,
            name,
            options.disks,
            f"{figures[0]:.1f}",
            of[0],
            f"{figures[1]:.1f}",
            of[1],
            f"{error:.1e}",
            info["contacts"],
        )
        writer.writerow(row)
        sys.stdout.flush()


if __name__ == "__main__":
    main()
