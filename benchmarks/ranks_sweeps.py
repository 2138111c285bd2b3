"""Sweeps of a step over ranks beside those without, and the numbers by which extrapolation begins again.

    python benchmarks/ranks_sweeps.py [--bodies 5000] [--steps 20] [--after 100 300]

The scenes of ranks_cost.py collapse for some steps of a run without ranks; from each state some steps are made to a tolerance of
1e-4, without ranks and over one rank, whose sweeps are those of any number. A variant runs in a process of its own, where
CAIRN_POLICY gives the numbers: nesterov_first and nesterov_again of the table, each halved and doubled, and the first so large
that the rule never acts; with slow_task_share=0 no tile is swept more often than others. Writes
benchmarks/results/ranks_sweeps.csv: sweeps of all steps, and how many steps converged.
"""

import argparse
import csv
import os
import tempfile
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import cairn as cn
from policy import apart
from ranks_cost import scenes

NEVER = 10**8
# nesterov_first, nesterov_again, slow_task_share
RESTARTS = [(64, 4), (32, 4), (128, 4), (64, 2), (64, 8), (NEVER, 4)]
VARIANTS = [(*pair, 0.25) for pair in RESTARTS] + [(64, 4, 0.0), (NEVER, 4, 0.0)]


def new(scene, dt, ranks=None, tol=1e-4):
    return cn.Simulation(scene, dt, cn.NSCD(solver=cn.NLGS(tol=tol, max_iter=2000), threads=1), overlap="ignore", ranks=ranks)


def prepare(scene, dt, after, path):
    """Writes the states after some steps."""
    sim = new(scene, dt, tol=1e-3)
    for step in range(max(after)):
        sim.step()
        if step + 1 in after:
            sim.checkpoint(path(step + 1))
    return True


def counted(scene, dt, state, ranks, steps):
    """(sweeps of all steps, steps that converged)."""
    sim, sweeps, converged = new(scene, dt, ranks), 0, 0
    sim.restore(state)
    for _ in range(steps):
        sim.step()
        sweeps += sim.info["iterations"]
        converged += sim.info["status"] == "converged"
    return sweeps, converged


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bodies", type=int, default=5000)
    parser.add_argument("--steps", type=int, default=20)
    parser.add_argument("--after", type=int, nargs="+", default=[100, 300])
    options = parser.parse_args()
    table = Path(__file__).parent / "results" / "ranks_sweeps.csv"
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name, scene, _, dt in scenes(options.bodies):
            if name not in ("disks", "spheres"):
                continue

            def path(step, name=name):
                return Path(folder) / f"{name}{step}.h5"

            apart(lambda scene=scene, dt=dt, path=path: prepare(scene, dt, options.after, path))
            for after in options.after:
                for ranks in (None, 1):
                    for first, again, share in VARIANTS:
                        change = f"nesterov_first={first} nesterov_again={again} slow_task_share={share}"
                        given = (scene, dt, path(after), ranks, options.steps)
                        sweeps, converged = apart(lambda given=given: counted(*given), change)
                        rows.append([name, after, ranks or 0, first, again, share, options.steps, sweeps, converged])
                        print(*rows[-1], flush=True)
    with table.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        names = ["nesterov_first", "nesterov_again", "slow_task_share", "steps", "sweeps", "converged"]
        writer.writerow(["scene", "after", "ranks", *names])
        writer.writerows(rows)


if __name__ == "__main__":
    main()
