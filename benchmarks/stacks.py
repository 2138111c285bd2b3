"""Stacks with the heaviest on top: what one step costs by sweeps alone and by `Auto`, from nothing and warm.

python benchmarks/stacks.py [--shapes spheres boxes] [--counts 10 100 1000] [--ratios 1 1e3 1e6 1e12] [--cap SECONDS]. Writes
benchmarks/results/stacks.csv: CPU seconds of the solver, its iterations, the true error and the largest deviation of a reaction
from the weight above it, relative. NLGS may sweep for --cap CPU seconds; how far it came then is what the row says.
"""

import argparse
import csv
import time
from pathlib import Path

import cairn as cn
import numpy as np

HERE = Path(__file__).resolve().parent


def stack(shape, count, ratio, solver, dt=1e-3):
    """A simulation of `count` spheres or cubes of 1 m, the top one `ratio` times as dense; weights (count,) on each level [N]."""
    rock = cn.Material("rock", density=1000.0)
    lead = cn.Material("lead", density=1000.0 * ratio)
    height = np.arange(count) + 0.5
    centers = np.stack([np.zeros(count), np.zeros(count), height], -1)
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    if shape == "spheres":
        scene.add(cn.spheres(centers[:-1], 0.5, rock), cn.spheres(centers[-1:], 0.5, lead))
    else:
        scene.add(cn.boxes(centers[:-1], (1.0, 1.0, 1.0), rock), cn.boxes(centers[-1:], (1.0, 1.0, 1.0), lead))
    scene.add(cn.wall((0, 0, 0), (0, 0, 1), rock))
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    sim = cn.Simulation(scene, dt, cn.NSCD(solver=solver, threads=1), overlap="ignore")
    mass = np.full(count, 1000.0 * (np.pi / 6 if shape == "spheres" else 1.0))
    mass[-1] *= ratio
    return sim, 9.81 * np.cumsum(mass[::-1])[::-1]


def deviation(sim, weights):
    """Largest |sum of normal impulses on a level - its weight| / its weight."""
    pairs, impulse = sim.contacts.bodies, sim.contacts.impulse[:, 2] / sim.dt
    level = np.sort(pairs, axis=1)
    sums = np.zeros(len(weights))
    count = len(weights)
    for high, value in zip(level[:, 1], impulse, strict=True):
        sums[0 if high == count else high] += abs(value)
    return float(np.max(np.abs(sums - weights) / weights))


def steps(shape, count, ratio, solver, number=2):
    """Rows of the first steps."""
    sim, weights = stack(shape, count, ratio, solver)
    for k in range(number):
        before = time.process_time()
        info = sim.step()
        yield {
            "shape": shape, "count": count, "ratio": f"{ratio:g}", "solver": type(solver).__name__, "tol": solver.tol,
            "step": k + 1,
            "status": info["status"], "iterations": info["iterations"], "cpu_seconds": f"{time.process_time() - before:.4g}",
            "error": f"{info['error']:.3g}", "deviation": f"{deviation(sim, weights):.3g}",
        }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--shapes", nargs="+", default=["spheres", "boxes"])
    parser.add_argument("--counts", nargs="+", type=int, default=[10, 100, 1000])
    parser.add_argument("--ratios", nargs="+", type=float, default=[1, 1e3, 1e6, 1e12])
    parser.add_argument("--tol", type=float, default=1e-6)
    parser.add_argument("--sweeps", type=int, default=200_000, help="of NLGS at most, for stacks of 100; others in proportion")
    parser.add_argument("--auto", action="store_true", help="Auto alone; nothing is written")
    options = parser.parse_args()
    rows = []
    for shape in options.shapes:
        for count in options.counts:
            for ratio in options.ratios:
                most = max(1000, options.sweeps * 100 // count)
                solvers = [cn.Auto(tol=options.tol, max_iter=10000)]
                if not options.auto:
                    solvers.append(cn.NLGS(tol=options.tol, max_iter=most))
                for solver in solvers:
                    for row in steps(shape, count, ratio, solver, 2 if type(solver) is cn.Auto else 1):
                        rows.append(row)
                        print(*row.values(), flush=True)
    if options.auto:
        return
    with open(HERE / "results" / "stacks.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
