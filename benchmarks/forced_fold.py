"""Error of the forced fold's steps (examples/forced_fold --full) by a fixed number of sweeps, plain and extrapolated, and from
impulses that go on as they changed from the last step but one to the last, by a share of that.

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


def named(keys):
    """A number of each contact's key, which may be sorted and compared."""
    keys = np.ascontiguousarray(np.reshape(keys, (-1, 4)))
    return keys.view([("", keys.dtype)] * 4).ravel()


def go_on(sim, before, share):
    """Extrapolates impulses, r + share (r - r of the step before), for the next step; returns the present ones by name."""
    state = sim.get_state()
    memory = state["memory"]
    names = named(memory["keys"])
    now = np.array(memory["impulses"]).reshape(len(names), -1)
    if before is not None:
        order = np.argsort(before[0])
        at = order[np.minimum(np.searchsorted(before[0][order], names), len(order) - 1)]
        change = np.where((before[0][at] == names)[:, None], now - before[1][at], 0.0)
        state["memory"] = {**memory, "impulses": (now + share * change).reshape(np.shape(memory["impulses"]))}
        sim.set_state(state)
    return names, now


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
        ways = ((100, "none"), (100, "nesterov"), (200, "nesterov"))
        further = ((60, "nesterov", 0.0), (60, "nesterov", 0.5), (100, "nesterov", 0.5), (100, "nesterov", 1.0))
        for sweeps, acceleration, share in (*((*way, 0.0) for way in ways), *further):
            sim.restore(path)
            sim.strategy = by(sweeps, acceleration)
            before, errors, last = time.process_time(), [], None
            for _ in range(options.steps):
                if share:
                    last = go_on(sim, last, share)
                errors.append(sim.step()["error"])
            rows.append({
                "sweeps_a_step": sweeps, "acceleration": acceleration, "share_of_last_change": share,
                "after_steps": options.ahead, "steps": options.steps,
                "contacts": sim.info["contacts"],
                "median_error": f"{np.median(errors[6:]):.3g}", "last_error": f"{errors[-1]:.3g}",
                # a script that goes on with impulses by itself takes as long as the step
                "cpu_seconds_a_step": "" if share else f"{(time.process_time() - before) / options.steps:.3g}",
            })  # fmt: skip
            print(*rows[-1].values(), flush=True)
    with open(HERE / "results" / "forced_fold_sweeps.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
