"""What a step costs beside the solver, in sweeps of the solver: CSV, one row for a dense scene of disks and one of spheres.

    script/bench step [--count 20000] [--steps 30]
"""

import argparse
import csv
import sys

from scenes import deposit


def measure(case, count, steps):
    """A row: seconds outside the solver over seconds of one sweep, both within one run."""
    sim = deposit(case, count, tol=1e-15, max_iter=100, steps=10)
    before = sim.info["seconds"]
    iterations = contacts = 0
    for _ in range(steps):
        info = sim.step()
        iterations += info["iterations"]
        contacts += info["contacts"]
    spent = {k: v - before.get(k, 0) for k, v in sim.info["seconds"].items()}
    solve = spent.pop("solve_contacts")
    sweep = solve / iterations
    row = {"case": case, "bodies": len(sim.bodies), "contacts": contacts // steps, "steps": steps,
           "outside_in_sweeps": round(sum(spent.values()) / steps / sweep, 2)}
    row |= {f"{stage}_in_sweeps": round(seconds / steps / sweep, 2) for stage, seconds in spent.items()}
    return row


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=20000)
    parser.add_argument("--steps", type=int, default=30)
    options = parser.parse_args()
    rows = [measure(case, options.count, options.steps) for case in ("disks", "spheres")]
    writer = csv.DictWriter(sys.stdout, rows[0])
    writer.writeheader()
    writer.writerows(rows)


if __name__ == "__main__":
    main()
