"""Dense scenes of 20,000 disks and spheres at rest: CPU seconds of a step to a true error, by each solver, warm and from nothing.

python benchmarks/dense.py [--count 20000] [--seconds 20]. Both deposits come to rest by NLGS first, at the end by steps to
1e-6: steps to 1e-4 alone keep a pile so deep in motion (see docs/problems.md). Every row begins from that state: warm rows are
means over --steps steps, cold ones a single step. A solver that has not converged after its iterations reports its last error.
Writes benchmarks/results/dense.csv.
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
    "NLGS": 5000, "Auto": 5000, "AndersonNLGS": 1000, "AcceleratedGradient": 300, "PreconditionedConjugateGradient": 1000,
    "ADMM": 100, "PPANewton": 30,
}  # fmt: skip
FACTORISING = ("PPANewton", "ADMM")  # in space the factors of so many bodies take gigabytes
SETTLING = {"disks": ((400, 1e-4, 100), (40, 1e-6, 1000)), "spheres": ((100, 1e-4, 150), (20, 1e-6, 1000))}


def at_rest(case, count):
    """The deposit after (steps, tol, max_iter) of SETTLING."""
    sim = deposit(case, count, max_iter=500, steps=20)
    for steps, tol, max_iter in SETTLING[case]:
        sim.strategy = cn.NSCD(solver=cn.NLGS(tol=tol, max_iter=max_iter), threads=1)
        for _ in range(steps):
            info = sim.step()
    print(f"{case} at rest: error {info['error']:.2e} after {info['iterations']} sweeps", flush=True)
    return sim


def row_of(sim, path, case, name, tol, warm, steps, seconds):
    """Some steps of a solver from the state in path."""
    sim.restore(path)
    sim.strategy = cn.NSCD(solver=getattr(cn, name)(tol=tol, max_iter=SOLVERS[name]), threads=1, warm_start=warm)
    before, infos = time.process_time(), []
    while len(infos) < (steps if warm else 1) and time.process_time() - before < seconds:
        infos.append(sim.step())
    spent = time.process_time() - before
    return {
        "scene": case, "bodies": len(sim.bodies), "contacts": infos[-1]["contacts"], "solver": name, "tol": tol,
        "warm_start": warm, "steps": len(infos), "converged": sum(i["status"] == "converged" for i in infos),
        "cpu_seconds": f"{spent / len(infos):.4g}", "iterations": round(sum(i["iterations"] for i in infos) / len(infos)),
        "largest_error": f"{max(i['error'] for i in infos):.3g}", "answered_by": infos[-1]["solver"],
    }  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=20000)
    parser.add_argument("--cases", nargs="+", default=["disks", "spheres"])
    parser.add_argument("--steps", type=int, default=10, help="of warm rows")
    parser.add_argument("--solvers", nargs="+", default=list(SOLVERS))
    parser.add_argument("--seconds", type=float, default=20.0, help="a solver that took longer is not asked for more")
    options = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for case in options.cases:
            sim = at_rest(case, options.count)
            path = Path(folder) / f"{case}.h5"
            sim.checkpoint(path)
            for name in options.solvers:
                slow = case == "spheres" and name in FACTORISING and options.count > 5000
                for warm in (True, False):
                    for tol in (1e-4, 1e-6):
                        if slow:
                            continue
                        rows.append(row_of(sim, path, case, name, tol, warm, options.steps, options.seconds))
                        slow = float(rows[-1]["cpu_seconds"]) > options.seconds
                        print(*rows[-1].values(), flush=True)
    with open(HERE / "results" / "dense.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
