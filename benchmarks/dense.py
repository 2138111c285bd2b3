"""Dense scenes of 20,000 disks and spheres: CPU seconds of one step to a true error, by each solver, warm and from nothing.

python benchmarks/dense.py [--count 20000] [--seconds 20]. Both deposits settle for some steps by NLGS first; every row begins
from that state. A solver that is not there after its iterations says how far it came. Writes benchmarks/results/dense.csv.
"""

import argparse
import csv
import tempfile
import time
from pathlib import Path

import cairn as cn
from scenes import deposit

HERE = Path(__file__).resolve().parent
SOLVERS = {  # iterations at most
    "NLGS": 3000, "Auto": 3000, "AndersonNLGS": 300, "AcceleratedGradient": 150, "PPANewton": 12, "ADMM": 20,
}
FACTORISING = ("PPANewton", "ADMM")  # in space the factors of so many bodies take gigabytes


def row_of(sim, path, case, name, tol, warm):
    """One step of a solver from the state in path."""
    sim.restore(path)
    sim.strategy = cn.NSCD(solver=getattr(cn, name)(tol=tol, max_iter=SOLVERS[name]), threads=1, warm_start=warm)
    before = time.process_time()
    info = sim.step()
    return {
        "scene": case, "bodies": len(sim.bodies), "contacts": info["contacts"], "solver": name, "tol": tol, "warm_start": warm,
        "cpu_seconds": f"{time.process_time() - before:.4g}", "status": info["status"], "answered_by": info["solver"],
        "iterations": info["iterations"], "error": f"{info['error']:.3g}",
    }  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=20000)
    parser.add_argument("--cases", nargs="+", default=["disks", "spheres"])
    parser.add_argument("--steps", type=int, default=20, help="to settle")
    parser.add_argument("--solvers", nargs="+", default=list(SOLVERS))
    parser.add_argument("--seconds", type=float, default=20.0, help="a solver that took longer is not asked for more")
    options = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for case in options.cases:
            sim = deposit(case, options.count, steps=options.steps)
            path = Path(folder) / f"{case}.h5"
            sim.checkpoint(path)
            for name in options.solvers:
                slow = case == "spheres" and name in FACTORISING and options.count > 5000
                for warm in (True, False):
                    for tol in (1e-4, 1e-6):
                        if slow:
                            continue
                        rows.append(row_of(sim, path, case, name, tol, warm))
                        slow = float(rows[-1]["cpu_seconds"]) > options.seconds
                        print(*rows[-1].values(), flush=True)
    with open(HERE / "results" / "dense.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
