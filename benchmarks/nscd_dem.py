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

    plt.rcParams["font.size"] = 11
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 5), layout="constrained")
    for name, mark, told in (("NSCD", "o-", "NSCD: dt, tol"), ("SmoothDEM", "s-", "SmoothDEM: k R/W")):
        mine = [r for r in rows if r["strategy"] == name]
        (line,) = left.loglog([r["cpu_s"] for r in mine], [r["landing"] for r in mine], mark, label=told)
        for r in mine:
            exponent = round(np.log10(r["stiffness"] or 1))
            words = f"$10^{exponent}$" if exponent else r["label"].replace("dt ", "").replace("tol ", "")
            x, y, side = {3: (-4, 6, "right"), 5: (-2, 7, "left"), 6: (9, -4, "left")}.get(exponent, (8, 5, "left"))
            if words == "2 ms, 0.001":  # a label on the other side would lie on the line of springs
                x, y, side = -7, -8, "right"
            left.annotate(
                words, (r["cpu_s"], r["landing"]), xytext=(x, y), ha=side, textcoords="offset points", color=line.get_color()
            )
    left.set(xlabel="CPU time of a run [s]", ylabel="mean distance of a grain from its place [radii]")
    left.set(xlim=(8e-3, 20), ylim=(9e-4, 2e-2))
    left.set_title("a column of 72 disks at its landing", fontsize=11)
    left.legend(loc="upper right")
    springs = [r for r in rows if r["strategy"] == "SmoothDEM"]
    right.loglog([r["stiffness"] for r in springs], [r["settlement"] for r in springs], "C1s-", label="SmoothDEM")
    right.loglog([r["stiffness"] for r in springs], [9.4 / r["stiffness"] for r in springs], "k:", label="one over the stiffness")
    right.set(xlabel="stiffness k R/W: weights W on a radius R [-]", ylabel="settlement of a grain (median) [radii]")
    right.set_title("a heap at rest by NSCD, then given springs", fontsize=11)
    right.legend()
    for axes in (left, right):
        axes.grid(alpha=0.3)
    figure.savefig(path, dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--output", type=Path)
    parser.add_argument("--plot", type=Path)
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--stiffest", type=float, default=1e6)
    parser.add_argument("--draw", type=Path, metavar="CSV", help="draw the rows of this file, without measuring")
    given = parser.parse_args()
    if given.draw:
        with open(given.draw, newline="") as file:
            numbers = ("stiffness", "cpu_s", "landing", "collapse", "settlement")
            plot([{**row, **{name: float(row[name]) for name in numbers}} for row in csv.DictReader(file)], given.plot)
        return
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
