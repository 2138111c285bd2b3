"""Cost of ranks in turns in one process: processor time of a step beside that of runs without, by one thread and by two.

    script/bench ranks_cost [--bodies 20000] [--steps 4] [--ranks 1 2] [--scenes disks] [--csv benchmarks/results/ranks_cost.csv]

A row for each scene and number of ranks: processor time a sweep (a step, of smooth balls) over that without ranks, by one thread
and by two; sweeps of a step of both; bytes that the largest rank holds over those of one. Times are the least over the turns,
since all else that runs on the machine adds to them. Smooth balls take 40 steps at a turn, as within a run, in which nobody reads
their state, in ten times as many turns; and once more one by one, each of which gives the state to its reader. Rows of other
scenes in the file stay.
"""

import argparse
import contextlib
import csv
import os
import time
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import cairn as cn
import numpy as np
from cairn.run.views import core_of

ROCK = cn.Material("rock", density=2600.0)


def box(dim, n, law):
    """Balls that lie densely in a box, about n of them."""
    side = round(n ** (1 / dim))
    rng = np.random.default_rng(1)
    x = np.stack(np.meshgrid(*[np.arange(side)] * dim, indexing="ij"), -1).reshape(-1, dim) * 0.97 + 0.5
    x += rng.uniform(-0.02, 0.02, x.shape)
    scene = cn.Scene(dim=dim, gravity=(0.0,) * (dim - 1) + (-9.81,))
    scene.interact(ROCK, ROCK, law)
    scene.add((cn.disks if dim == 2 else cn.spheres)(x, rng.uniform(0.46, 0.49, len(x)), ROCK))
    for axis in range(dim):
        scene.add(cn.wall(np.zeros(dim), np.eye(dim)[axis], ROCK))
        if axis < dim - 1:
            scene.add(cn.wall((0.97 * side + 0.1) * np.eye(dim)[axis], -np.eye(dim)[axis], ROCK))
    return scene


def wall_of_boxes(n):
    """Courses of boxes on a floor, about n of them."""
    side = round(n ** (1 / 3))
    x = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), -1).reshape(-1, 3) * (1.01, 1.01, 0.999) + 0.5
    x[:, 0] += 0.5 * (np.floor(x[:, 2]) % 2)
    scene = cn.Scene(dim=3, gravity=(0.0, 0.0, -9.81))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.4))
    scene.add(cn.boxes(x, [1.0, 1.0, 1.0], ROCK), cn.wall((0, 0, 0), (0, 0, 1), ROCK))
    return scene


def scenes(n, threads=1):
    sweeps = cn.NSCD(solver=cn.NLGS(tol=1e-12, max_iter=60), threads=threads)
    smooth = cn.SmoothDEM(energy=False, threads=threads)
    yield "disks", box(2, n, cn.Coulomb(mu=0.4)), sweeps, 1e-3
    yield "spheres", box(3, n, cn.Coulomb(mu=0.4)), sweeps, 1e-3
    yield "boxes", wall_of_boxes(max(n // 10, 8)), sweeps, 1e-3
    springs = cn.LinearSpring(stiffness=1e7, restitution=0.5, mu=0.4)
    yield "smooth spheres", box(3, n, springs), smooth, 1e-4
    yield "smooth spheres, read", box(3, n, springs), smooth, 1e-4


def timed(sim, steps, run=0):
    """Least processor time of a step, over its sweeps, or of `run` steps that leave the state with the ranks [s]."""
    least = np.inf
    if run:
        with sim.ranks.leaving_state() if hasattr(sim.ranks, "leaving_state") else contextlib.nullcontext():
            start = time.process_time()
            for _ in range(run):
                core_of(sim).step(sim.ready())
            return (time.process_time() - start) / run
    for _ in range(steps):
        start = time.process_time()
        sim.step()
        least = min(least, (time.process_time() - start) / max(sim.info.get("iterations") or 1, 1))
    return least


def rows(options):
    """A row for each scene and number of ranks."""
    of_two = {name: strategy for name, _, strategy, _ in scenes(8, threads=2)}
    for name, scene, strategy, dt in scenes(options.bodies):
        if options.scenes and name not in options.scenes:
            continue
        run = 40 if name == "smooth spheres" else 0
        runs = {ranks: cn.Simulation(scene, dt, strategy, overlap="ignore", ranks=ranks) for ranks in [None, *options.ranks]}
        runs["threads"] = cn.Simulation(scene, dt, of_two[name], overlap="ignore")
        least = {ranks: timed(sim, 1, run) for ranks, sim in runs.items()}
        for _ in range(10 * options.steps if run else options.steps):
            least = {ranks: min(least[ranks], timed(sim, 1, run)) for ranks, sim in runs.items()}
        held = {ranks: runs[ranks].ranks.held_bytes.max() for ranks in options.ranks}
        for ranks in options.ranks:
            yield {
                "scene": name,
                "bodies": len(runs[None].bodies),
                "ranks": ranks,
                "over_one_thread": round(least[ranks] / least[None], 3),
                "over_two_threads": round(least[ranks] / least["threads"], 3),
                "sweeps": runs[ranks].info.get("iterations") or 1,
                "sweeps_without": runs[None].info.get("iterations") or 1,
                "held": round(held[ranks] / held[options.ranks[0]], 3),
            }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bodies", type=int, default=20_000)
    parser.add_argument("--steps", type=int, default=4)
    parser.add_argument("--ranks", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--scenes", nargs="+", help="of the rows that are made anew; all unless given")
    parser.add_argument("--csv", default=str(Path(__file__).parent / "results" / "ranks_cost.csv"))
    options = parser.parse_args()
    kept = []
    if options.scenes and Path(options.csv).exists():
        with open(options.csv, newline="") as file:
            kept = [row for row in csv.DictReader(file) if row["scene"] not in options.scenes]
    made = []
    for row in rows(options):
        made.append(row)
        print(", ".join(f"{name} {value}" for name, value in row.items()), flush=True)
    with open(options.csv, "w", newline="") as file:
        table = csv.DictWriter(file, made[0])
        table.writeheader()
        table.writerows(kept + made)


if __name__ == "__main__":
    main()
