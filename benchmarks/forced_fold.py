"""Error of the forced fold's steps (examples/forced_fold --full) by a fixed number of sweeps, plain and extrapolated.

python benchmarks/forced_fold.py [--ahead 220] [--steps 16]. Every row begins from the state after --ahead steps of 60 sweeps; the
median is that of all but the first six of its steps, in which the error still falls. Writes
benchmarks/results/forced_fold_sweeps.csv.
"""

import argparse
import csv
import sys
import tempfile
import time
from pathlib import Path

import cairn as cn
import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "examples" / "forced_fold"))
import forced_fold  # noqa: E402


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--ahead", type=int, default=220)
    parser.add_argument("--steps", type=int, default=16)
    options = parser.parse_args()
    scene, _, _ = forced_fold.build_scene(forced_fold.options_from(["--full"]))

    def by(sweeps, acceleration):
        solver = cn.NLGS(tol=1e-6, min_iter=sweeps, max_iter=sweeps, acceleration=acceleration)
        return cn.NSCD(theta=0.5, solver=solver, threads=1)

    sim = cn.Simulation(scene, forced_fold.STEP, by(60, "nesterov"))
    for _ in range(options.ahead):
        sim.step()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        sim.checkpoint(path := Path(folder) / "state.h5")
        for sweeps, acceleration in ((100, "none"), (100, "nesterov"), (200, "nesterov")):
            sim.restore(path)
            sim.strategy = by(sweeps, acceleration)
            before, errors = time.process_time(), []
            for _ in range(options.steps):
                errors.append(sim.step()["error"])
            rows.append({
                "sweeps_a_step": sweeps, "acceleration": acceleration, "after_steps": options.ahead, "steps": options.steps,
                "contacts": sim.info["contacts"],
                "median_error": f"{np.median(errors[6:]):.3g}", "last_error": f"{errors[-1]:.3g}",
                "cpu_seconds_a_step": f"{(time.process_time() - before) / options.steps:.3g}",
            })  # fmt: skip
            print(*rows[-1].values(), flush=True)
    with open(HERE / "results" / "forced_fold_sweeps.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
