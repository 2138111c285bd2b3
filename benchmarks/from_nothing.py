"""A pile at rest without known impulses, to 1e-8: solvers continue from where sweeps with the associated start stop.

python benchmarks/from_nothing.py [--count 20000] [--cases disks spheres]. The piles of dense.py; sweeps to each of --tolerances,
then each solver from these impulses, at most so many iterations. CPU seconds of one thread, of that part alone. In space those
that factorise all bodies are left out. Writes benchmarks/results/from_nothing.csv.
"""

import argparse
import csv
import time
from pathlib import Path

import cairn as cn
from dense import at_rest

HERE = Path(__file__).resolve().parent
SWEEPS = 12000
LATER = {"PPANewton": 60, "NewtonAlartCurnier": 60, "Auto": 1000, "AndersonNLGS": 1500, "NLGS": 12000}  # iterations at most
FACTORISING = ("PPANewton", "NewtonAlartCurnier", "Auto", "InteriorPoint")


def solved(sim, path, solver, impulses=None):
    """Report, CPU seconds and impulses of the step from the state in path, without impulses or from these."""
    sim.restore(path)
    if impulses is not None:
        state = sim.get_state()
        state["memory"] = impulses
        sim.set_state(state)
    sim.strategy = cn.NSCD(solver=solver, threads=1, warm_start=impulses is not None)
    before = time.process_time()
    info = sim.step()
    return info, time.process_time() - before, sim.get_state()["memory"]


def rows_of(case, options, path):
    sim = at_rest(case, options.count)
    sim.checkpoint(path)

    def row(sweeps_to, name, found):
        info, seconds, impulses = found
        out = {
            "scene": case, "contacts": info["contacts"], "sweeps_to": sweeps_to, "then": name, "cpu_seconds": f"{seconds:.3g}",
            "iterations": info["iterations"], "error": f"{info['error']:.3g}", "status": info["status"],
        }  # fmt: skip
        print(*out.values(), flush=True)
        return out, impulses

    def sweeps(tol, most):
        return cn.NLGS(tol=tol, max_iter=most, associated_start=True)

    allowed = [name for name in LATER if case == "disks" or name not in FACTORISING]
    if case == "disks":
        yield row("", "InteriorPoint", solved(sim, path, cn.InteriorPoint(tol=1e-8, max_iter=200)))[0]
    for most in (SWEEPS, 3 * SWEEPS):
        yield row("", "NLGS, associated start", solved(sim, path, sweeps(1e-8, most)))[0]
    for tol in options.tolerances:
        first, impulses = row(tol, "", solved(sim, path, sweeps(tol, SWEEPS)))
        yield first
        for name in allowed:
            solver = getattr(cn, name)(tol=1e-8, max_iter=LATER[name])
            yield row(tol, name, solved(sim, path, solver, impulses))[0]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=20000)
    parser.add_argument("--cases", nargs="+", default=["disks", "spheres"])
    parser.add_argument("--tolerances", nargs="+", type=float, default=[1e-4, 1e-6])
    options = parser.parse_args()
    rows = []
    for case in options.cases:
        path = Path(f"from_nothing_{case}.h5")
        try:
            rows.extend(rows_of(case, options, path))
        finally:
            path.unlink(missing_ok=True)
    with open(HERE / "results" / "from_nothing.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
