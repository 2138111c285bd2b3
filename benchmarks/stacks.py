"""Stacks with the heaviest body on top: cost of a step by sweeps alone and by `Auto`, cold and warm.

python benchmarks/stacks.py [--shapes spheres boxes] [--counts 10 100 1000] [--ratios 1 1e3 1e6 1e12] [--seconds 5]. Writes
benchmarks/results/stacks.csv: CPU seconds of a step, iterations, the true error and the largest deviation of a reaction from the
weight above it, relative. Since the true error hardly sees the heavy body sink, NLGS goes on, a longer run each time, until its
reactions are as good as 1e-4 or its seconds are over: the row says how far it came; `times`: its time / that of Auto.
With --steps it writes stacks_steps.csv: how far stacks of ten blocks move in 100 steps of 2 ms.
"""

import argparse
import csv
import time
import warnings
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
    for part, material in ((centers[:-1], rock), (centers[-1:], lead)):
        if shape == "spheres":
            scene.add(cn.spheres(part, 0.5, material))
        elif shape == "drums":
            scene.add(cn.cylinders(part, 0.5, 1.0, material))
        else:
            scene.add(cn.boxes(part, (1.0, 1.0, 1.0), material))
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


def sweeps_alone(shape, count, ratio, seconds):
    """Row of NLGS: as many sweeps as its reactions take to come within 1e-4, or as fit into the seconds."""
    sweeps = 100
    while True:
        row = next(steps(shape, count, ratio, cn.NLGS(tol=1e-15, max_iter=sweeps), 1))
        spent = float(row["cpu_seconds"])
        if float(row["deviation"]) < 1e-4 or spent > seconds / 2:
            return row | {"status": "reactions to 1e-4" if float(row["deviation"]) < 1e-4 else "out of time"}
        sweeps *= 2


def standing(shape, ratio, solver, count=10, number=100):
    """Row of a stack that should stand still."""
    sim, _ = stack(shape, count, ratio, solver, dt=2e-3)
    before, begin = sim.bodies.position[:count].copy(), time.process_time()
    infos = [sim.step() for _ in range(number)]
    return {
        "shape": shape, "count": count, "ratio": f"{ratio:g}", "solver": type(solver).__name__, "steps": number,
        "not_converged": sum(info["status"] != "converged" for info in infos),
        "iterations": sum(info["iterations"] for info in infos), "cpu_seconds": f"{time.process_time() - begin:.3g}",
        "moved": f"{np.abs(sim.bodies.position[:count] - before).max():.2g}",
    }


def write(rows, name, *more):
    with open(HERE / "results" / name, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [*rows[0], *more])
        writer.writeheader()
        writer.writerows(rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--shapes", nargs="+", default=["spheres", "boxes"])
    parser.add_argument("--counts", nargs="+", type=int, default=[10, 100, 1000])
    parser.add_argument("--ratios", nargs="+", type=float, default=[1, 1e3, 1e6, 1e12])
    parser.add_argument("--tol", type=float, default=1e-6)
    parser.add_argument("--seconds", type=float, default=5.0, help="CPU of NLGS at most, about")
    parser.add_argument("--auto", action="store_true", help="Auto alone; nothing is written")
    parser.add_argument("--steps", action="store_true", help="how far stacks move in 100 steps")
    options = parser.parse_args()
    if options.steps:
        warnings.simplefilter("ignore", cn.EnergyCreatedWarning)
        solvers = (cn.NLGS(), cn.Default())
        cases = [(shape, 10.0**k) for shape in ("boxes", "drums") for k in (1, 3, 4, 5, 6, 12)]
        write([standing(*case, solver) for case in cases for solver in solvers], "stacks_steps.csv")
        return
    rows = []
    for shape in options.shapes:
        for count in options.counts:
            for ratio in options.ratios:
                mine = list(steps(shape, count, ratio, cn.Auto(tol=options.tol, max_iter=10000)))
                if not options.auto:
                    mine.append(sweeps_alone(shape, count, ratio, options.seconds))
                    mine[-1]["times"] = f"{float(mine[-1]['cpu_seconds']) / float(mine[0]['cpu_seconds']):.3g}"
                for row in mine:
                    print(*row.values(), flush=True)
                rows += mine
    if options.auto:
        return
    write(rows, "stacks.csv", "times")


if __name__ == "__main__":
    main()
