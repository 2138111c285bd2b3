"""Bonded disks: contact-iterations a second beside dry friction, and what steps of solids of bonds cost at three sizes.

    script/bench bonds [--rates] [--steps] [--sizes 800 8000 73344]

Clamped lattices of disks under their weight, on one thread. Rates: CPU time of 200 sweeps more in a step of 8,000 disks, all
laws in turns in one process, medians; these steps end where their sweeps do, far from a solution.
Steps: CPU seconds, sweeps and the solver of the first three steps at a true error of
1e-4, Auto and, up to 10,000 disks, NLGS. Writes benchmarks/results/bonds_rates.csv and bonds_steps.csv.
"""

import argparse
import csv
import time
from pathlib import Path

import cairn as cn
import numpy as np

HERE = Path(__file__).resolve().parent
R = 0.01
SPRINGS = dict(normal_stiffness=1e12, tangential_stiffness=5e11, within=1e-6)
STRONG = dict(normal_strength=1e9, tangential_strength=1e9, normal_work=1e7, tangential_work=1e7)
LAWS = {"Coulomb": cn.Coulomb(mu=0.5), "Bonded": cn.Bonded(mu=0.3), "MAL": cn.MAL(**SPRINGS, **STRONG),
        "ParallelBond": cn.ParallelBond(**SPRINGS)}  # fmt: skip


def lattice(law, disks, solver, dt):
    """Twice as long as high, clamped on the left; under Coulomb's law, which would let it fall, at the bottom."""
    rows = max(2, round(np.sqrt(disks / 2)))
    places = np.array([[2 * R * (i + 0.5 * (j % 2)), np.sqrt(3) * R * j] for j in range(rows) for i in range(2 * rows)])
    held = places[:, 1] < R if isinstance(law, cn.Coulomb) else places[:, 0] < 1.5 * R
    stone = cn.Material("stone", density=2500.0)
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.disks(places[held], R, stone, driven=("vx", "vy", "w")), cn.disks(places[~held], R, stone))
    scene.interact(stone, stone, law)
    return cn.Simulation(scene, dt, cn.NSCD(theta=0.6, solver=solver, threads=1), overlap="ignore")


def rates(few=40, more=200, rounds=15):
    laws = {name: [lattice(law, 8000, fixed(sweeps), 1e-4) for sweeps in (few, few + more)] for name, law in LAWS.items()}
    times = {name: [] for name in laws}
    for _ in range(rounds):
        for name, sims in laws.items():
            cost = []
            for sim in sims:
                begin = time.process_time()
                sim.step()
                cost.append(time.process_time() - begin)
            times[name].append((cost[1] - cost[0]) / len(sims[0].contacts.gap) / more)
    coulomb = float(np.median(times["Coulomb"]))
    for name, found in times.items():
        cost = float(np.median(found))
        yield {"law": name, "million_a_second": round(1e-6 / cost, 1), "times_coulomb": round(cost / coulomb, 2)}


def fixed(sweeps):
    return cn.NLGS(tol=1e-12, min_iter=sweeps, max_iter=sweeps, acceleration="none")


def steps(sizes):
    for size in sizes:
        for name in ("ParallelBond", "MAL", "Bonded"):
            for dt in (1e-3, 1e-4):
                # sweeps alone reach their limit in the largest, after minutes a step
                for solver in (cn.Auto(tol=1e-4), *([cn.NLGS(tol=1e-4, max_iter=20000)] if size <= 10000 else [])):
                    sim = lattice(LAWS[name], size, solver, dt)
                    for k in range(3):
                        begin = time.process_time()
                        info = sim.step()
                        yield {"disks": size, "contacts": len(sim.contacts.gap), "law": name, "dt": dt, "solver": solver.name,
                               "step": k + 1, "by": info["solver"], "sweeps": info["iterations"], "error": f"{info['error']:.1e}",
                               "status": info["status"], "cpu_seconds": f"{time.process_time() - begin:.3g}"}  # fmt: skip


def write(name, rows):
    with open(HERE / "results" / name, "w", newline="") as file:
        table = None
        for row in rows:
            if table is None:
                table = csv.DictWriter(file, list(row))
                table.writeheader()
            table.writerow(row)
            file.flush()
            print(row, flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rates", action="store_true")
    parser.add_argument("--steps", action="store_true")
    parser.add_argument("--sizes", type=int, nargs="*", default=[800, 8000, 73344])
    given = parser.parse_args()
    if given.rates or not given.steps:
        write("bonds_rates.csv", rates())
    if given.steps or not given.rates:
        write("bonds_steps.csv", steps(given.sizes))
