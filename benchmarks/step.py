"""Cost of a step outside of the solver, in units of a sweep: CSV, rows for dense scenes of disks and spheres, with plain
and with extrapolated sweeps.

    script/bench step [--count 20000] [--steps 30]

Medians of the steps, stage by stage, of seconds over those of one sweep in the same step.
"""

import argparse
import csv
import sys

import cairn as cn
import numpy as np
from scenes import deposit

SWEEPS = {"plain": "none", "extrapolated": "nesterov"}


def measure(case, count, steps):
    """Rows of one scene: from the same state, with each kind of sweeps."""
    sim = deposit(case, count, tol=1e-15, max_iter=100, steps=10)
    state = sim.get_state()
    for sweeps, acceleration in SWEEPS.items():
        sim.set_state(state)
        sim.strategy = cn.NSCD(solver=cn.NLGS(tol=1e-15, max_iter=100, acceleration=acceleration), threads=1)
        sim.step()  # the first one after a restart has lists to make
        before, shares, contacts = sim.info["seconds"], [], 0
        for _ in range(steps):
            info = sim.step()
            now = sim.info["seconds"]
            spent = {stage: seconds - before.get(stage, 0) for stage, seconds in now.items()}
            sweep = spent.pop("solve_contacts") / info["iterations"]
            shares.append({stage: seconds / sweep for stage, seconds in spent.items()})
            contacts += info["contacts"]
            before = now
        row = {"case": case, "sweeps": sweeps, "bodies": len(sim.bodies), "contacts": contacts // steps, "steps": steps,
               "outside_in_sweeps": round(np.median([sum(share.values()) for share in shares]), 2)}
        yield row | {f"{stage}_in_sweeps": round(np.median([share[stage] for share in shares]), 2) for stage in shares[0]}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=20000)
    parser.add_argument("--steps", type=int, default=30)
    options = parser.parse_args()
    writer = None
    for case in ("disks", "spheres"):
        for row in measure(case, options.count, options.steps):
            if writer is None:
                writer = csv.DictWriter(sys.stdout, row)
                writer.writeheader()
            writer.writerow(row)
            sys.stdout.flush()


if __name__ == "__main__":
    main()
