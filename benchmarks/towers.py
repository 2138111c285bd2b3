"""Towers of unit boxes under a heavy top, by default settings: displacement in 1,000 steps, and loads of their levels.

python benchmarks/towers.py [--dims 2 3] [--heights 2 5 20 50 100] [--ratios 1e3 1e6 1e9 1e12] [--mus 0 .5] [--dts 1e-3 .0041667]
[--steps 1000] [--most 3000] [--output towers.csv]. A tower stands on a wall under g = 9.81 m/s2; its boxes measure 1 m and 1 kg,
the top one `ratio` times as much. A row for each: largest displacement of a box [m], and its bound, max(1e-5, 10 u M/m g h T)
with u = 2^-53 and T = steps h: the rounding of the top's weight, as an impulse of each step, given to a light box and added up;
the largest deviation of the reaction of a level from the weight above it, relative, in any step; steps that did not converge; the
largest light_error of those that did; iterations and CPU seconds. --most: CPU seconds of a row, after which it ends and says so.
"""

import argparse
import csv
import itertools
import time
import warnings
from pathlib import Path

import cairn as cn
import numpy as np

HERE = Path(__file__).resolve().parent
G = 9.81
SQUARE = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])


def tower(dim, height, ratio, mu, dt, solver=None):
    """A simulation of the tower and the centres of its boxes (height, dim) [m]."""
    light, heavy = cn.Material("light", density=1.0), cn.Material("heavy", density=ratio)
    centers = np.zeros((height, dim))
    centers[:, -1] = np.arange(height) + 0.5
    up = np.eye(dim)[-1]
    scene = cn.Scene(dim, gravity=-G * up)
    for part, material in ((centers[:-1], light), (centers[-1:], heavy)):
        scene.add(cn.boxes(part, (1.0,) * 3, material) if dim == 3 else cn.polygons([SQUARE + x for x in part], material))
    scene.add(cn.wall(np.zeros(dim), up, light))
    scene.interact("*", "*", cn.Coulomb(mu=mu))
    strategy = cn.NSCD(threads=1) if solver is None else cn.NSCD(threads=1, solver=solver)
    return cn.Simulation(scene, dt, strategy, overlap="ignore"), centers


def carried(sim, height):
    """Vertical force on each level [N]."""
    pairs = np.sort(sim.contacts.bodies, axis=1)
    level = np.where(pairs[:, 1] == height, 0, pairs[:, 1])
    return np.bincount(level, np.abs(sim.contacts.impulse[:, -1]) / sim.dt, height)


def stand(dim, height, ratio, mu, dt, steps, most=np.inf, solver=None):
    """The row of a tower."""
    sim, centers = tower(dim, height, ratio, mu, dt, solver)
    weights = G * (ratio + np.arange(height)[::-1])
    off = light = failed = iterations = done = 0
    begin = time.process_time()
    while done < steps and time.process_time() - begin < most:
        done += 1
        info = sim.step()
        failed += info["status"] != "converged"
        light = max(light, info["light_error"] if info["status"] == "converged" else 0.0)
        iterations += info["iterations"]
        off = max(off, np.abs(carried(sim, height) / weights - 1).max())
    spent = time.process_time() - begin
    moved = np.abs(sim.bodies.position[:height] - centers).max()
    allowed = max(1e-5, 10 * 2.0**-53 * ratio * G * dt * steps * dt)
    return {
        "dim": dim, "height": height, "ratio": f"{ratio:g}", "mu": mu, "dt": f"{dt:.4g}", "steps": done,
        "moved": f"{moved:.2g}", "allowed": f"{allowed:.2g}", "reaction_off": f"{off:.2g}", "not_converged": failed,
        "light_error": f"{light:.2g}", "iterations": iterations, "cpu_seconds": f"{spent:.3g}",
        "holds": "yes" if done == steps and moved <= allowed and off <= 1e-3 else "no",
    }  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--dims", nargs="+", type=int, default=[2, 3])
    parser.add_argument("--heights", nargs="+", type=int, default=[2, 5, 20, 50, 100])
    parser.add_argument("--ratios", nargs="+", type=float, default=[1e3, 1e6, 1e9, 1e12])
    parser.add_argument("--mus", nargs="+", type=float, default=[0.0, 0.5])
    parser.add_argument("--dts", nargs="+", type=float, default=[1e-3, 1 / 240])
    parser.add_argument("--steps", type=int, default=1000)
    parser.add_argument("--most", type=float, default=3000.0)
    parser.add_argument("--output", type=Path, default=HERE / "results" / "towers.csv")
    options = parser.parse_args()
    warnings.simplefilter("ignore", cn.EnergyCreatedWarning)
    cases = itertools.product(options.dims, options.heights, options.ratios, options.mus, options.dts)
    with open(options.output, "w", newline="", encoding="utf-8") as file:
        writer = None
        for case in cases:
            row = stand(*case, options.steps, options.most)
            writer = writer or csv.DictWriter(file, row)
            if file.tell() == 0:
                writer.writeheader()
            writer.writerow(row)
            file.flush()
            print(*row.values(), flush=True)


if __name__ == "__main__":
    main()
