"""The same heap by NSCD and by smooth DEM of rising stiffness: their difference and CPU time.

A column of disks in two dimensions collapses beside a wall. Three figures, shares of a radius, means over perturbed columns:
deviation of grains from NSCD with a short step while the column lands, before the collapse loses memory of its start; the height
of the centre of mass over the collapse against the same; and, for the heap at rest, the settlement of its grains on springs,
absent for rigid grains. With the CPU time of a run.

    python benchmarks/nscd_dem.py [--output benchmarks/results/nscd_dem.csv] [--plot docs/images/nscd_dem.png]
"""

import argparse
import csv
import time
import warnings
from pathlib import Path

import cairn as cn
import numpy as np

RADIUS, MU, GRAVITY, DURATION = 0.01, 0.4, 9.81, 0.4
LANDED = 0.04  # two of the 21 times on
WIDE, HIGH = 6, 12
ROCK = cn.Material("rock", density=2500.0)
WEIGHT = 2500.0 * np.pi * RADIUS**2 * GRAVITY  # of a disk, a metre deep


def column(seed):
    """Centres of a jittered hexagonal column (n, 2) that does not overlap, and radii (n,)."""
    rng = np.random.default_rng(seed)
    rows = []
    for k in range(HIGH):
        x = (np.arange(WIDE) * 2.06 + 1.05 + 1.03 * (k % 2)) * RADIUS
        rows.append(np.c_[x, np.full(WIDE, (1.02 + k * 1.84) * RADIUS)])
    centres = np.concatenate(rows) + 0.01 * RADIUS * (rng.random((WIDE * HIGH, 2)) - 0.5)
    return centres, RADIUS * (1 - 0.03 * rng.random(len(centres)))


def simulation(centres, radii, law, dt, strategy):
    scene = cn.Scene(2, gravity=(0, -GRAVITY))
    scene.add(cn.disks(centres, radii, ROCK))
    scene.add(cn.wall((0, 0), (0, 1), ROCK), cn.wall((0, 0), (1, 0), ROCK))
    scene.interact(ROCK, ROCK, law)
    return cn.Simulation(scene, dt, strategy, overlap="ignore")


def nscd(dt, tol=1e-6):
    return lambda c, r: simulation(c, r, cn.Coulomb(mu=MU), dt, cn.NSCD(threads=1, solver=cn.NLGS(tol=tol, max_iter=2000)))


def dem(stiffness, share=0.1):
    """Springs of so many weights on a radius; restitution near zero, as NSCD has it; a step of a share of the stable one."""
    k = stiffness * WEIGHT / RADIUS
    law = cn.LinearSpring(stiffness=k, restitution=0.05, mu=MU)
    mass = WEIGHT / GRAVITY * 0.97**2
    dt = share * 2 / np.sqrt(2 * k / mass)
    return lambda c, r: simulation(c, r, law, dt, cn.SmoothDEM(threads=1, energy=False, unstable="ignore"))


def heights(make, seeds):
    """Mean height of the centre of mass at 21 times [radii], places of grains at LANDED, and CPU seconds a run."""
    curves, landed, spent = [], [], 0.0
    times = np.linspace(0, DURATION, 21)
    for seed in seeds:
        sim = make(*column(seed))
        curve = []
        for t in times:
            start = time.process_time()
            while sim.time + sim.dt / 2 < t:
                sim.step()
            spent += time.process_time() - start
            curve.append(sim.bodies.position[: WIDE * HIGH, 1].mean() / RADIUS)
            if abs(t - LANDED) < 1e-9:
                landed.append(sim.bodies.position[: WIDE * HIGH])
        curves.append(curve)
    return np.mean(curves, 0), np.array(landed), spent / len(seeds)


def settled():
    """The heap at rest, by NSCD."""
    sim = nscd(1e-3)(*column(0))
    for _ in range(1500):
        sim.step()
    return sim.bodies.position[: WIDE * HIGH], column(0)[1]


def settlement(make, centres, radii):
    """Median way of the grains in a fifth of a second [radii]; a disk that rolls off counts as one."""
    sim = make(centres, radii)
    while sim.time < 0.2:
        sim.step()
    return np.median(np.linalg.norm(sim.bodies.position[: len(radii)] - centres, axis=1)) / RADIUS


def plot(rows, path):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    for name, mark in (("NSCD", "o-"), ("SmoothDEM", "s-")):
        mine = [r for r in rows if r["strategy"] == name]
        left.loglog([r["cpu_s"] for r in mine], [r["landing"] for r in mine], mark, label=name)
        for r in mine:
            left.annotate(r["label"], (r["cpu_s"], r["landing"]), textcoords="offset points", xytext=(4, 4), fontsize=7)
    left.set(xlabel="CPU seconds a run", ylabel="mean distance of grains [radii]", title="A column lands")
    left.legend()
    springs = [r for r in rows if r["strategy"] == "SmoothDEM"]
    right.loglog([r["stiffness"] for r in springs], [r["settlement"] for r in springs], "s-")
    right.set(xlabel="stiffness x radius / weight", ylabel="settlement [radii]", title="The heap at rest, given springs")
    for axes in (left, right):
        axes.grid(alpha=0.3)
    figure.savefig(path, dpi=130)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--output", type=Path)
    parser.add_argument("--plot", type=Path)
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--stiffest", type=float, default=1e6)
    given = parser.parse_args()
    warnings.simplefilter("ignore", cn.StableStepWarning)
    seeds = range(given.seeds)
    reference, places, _ = heights(nscd(2.5e-4, 1e-8), seeds)
    centres, radii = settled()
    settings = [(4e-3, 1e-2), (4e-3, 1e-3), (2e-3, 1e-3), (1e-3, 1e-4), (5e-4, 1e-5)]
    cases = [("NSCD", f"dt {1e3 * dt:g} ms, tol {tol:g}", 0, nscd(dt, tol)) for dt, tol in settings]
    stiffness = [k for k in (1e3, 1e4, 1e5, 1e6) if k <= given.stiffest]
    cases += [("SmoothDEM", f"k {k:g}", k, dem(k)) for k in stiffness]
    rows = []
    for strategy, label, k, make in cases:
        curve, landed, spent = heights(make, seeds)
        rows.append(
            {
                "strategy": strategy,
                "label": label,
                "stiffness": k,
                "cpu_s": round(spent, 4),
                "landing": float(f"{np.mean(np.linalg.norm(landed - places, axis=2)) / RADIUS:.4g}"),
                "collapse": float(f"{np.max(np.abs(curve - reference)):.4g}"),
                "settlement": float(f"{settlement(make, centres, radii):.4g}"),
            }
        )
        print(rows[-1], flush=True)
    if given.output:
        with open(given.output, "w", newline="") as file:
            writer = csv.DictWriter(file, rows[0])
            writer.writeheader()
            writer.writerows(rows)
    if given.plot:
        plot(rows, given.plot)


if __name__ == "__main__":
    main()
