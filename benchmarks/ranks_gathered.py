"""Scenes of heavy bodies on light ones, bonds and joints over ranks: Auto, which gathers contacts, beside sweeps alone.

    python benchmarks/ranks_gathered.py > benchmarks/results/ranks_gathered.csv

A line for each scene of tests/python/ranks/test_gathered_contacts.py and each solver, without ranks and over four ranks in turns:
steps, those that converged, sweeps of all, the largest way of a body beyond a run without ranks by Auto to a hundredth of the
tolerance [m], gatherings, bytes of the last one, processor time of the steps over that of Auto without ranks.
"""

import csv
import sys
import time
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "python" / "ranks"))

import cairn as cn
import numpy as np
import test_gathered_contacts as scenes

STEPS = 60


def timed(scene, ranks, solver):
    """Simulation after the steps, how many converged, sweeps, processor time [s]."""
    sim = cn.Simulation(scene(), 1e-3, cn.NSCD(solver=solver), overlap="ignore", ranks=ranks)
    converged, sweeps, begin = 0, 0, time.process_time()
    for _ in range(STEPS):
        sim.step()
        converged += sim.info["status"] == "converged"
        sweeps += sim.info["iterations"]
    return sim, converged, sweeps, time.process_time() - begin


def main():
    warnings.simplefilter("ignore")
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(["scene", "ranks", "solver", "steps", "converged", "sweeps", "beyond", "gathered", "bytes", "time"])
    towers = [(f"tower {ratio:g}", lambda ratio=ratio: scenes.tower(ratio)) for ratio in (1.0, 1e3, 1e4, 1e6, 1e9, 1e12)]
    for name, scene in towers + [(made.__name__, made) for made in scenes.SCENES[1:]]:
        exact = np.array(timed(scene, None, cn.Auto(tol=1e-6))[0].bodies.position)
        unit = None
        for ranks, solver in ((None, cn.Auto()), (4, cn.Auto()), (4, cn.NLGS())):
            sim, converged, sweeps, took = timed(scene, ranks, solver)
            unit = unit or took
            beyond = np.abs(np.array(sim.bodies.position) - exact).max()
            found = sim.ranks.figures() if ranks else {}
            figures = [found.get("gathered_solves", 0), found.get("gathered_bytes", 0)]
            table.writerow([name, ranks or 0, type(solver).__name__, STEPS, converged, sweeps, f"{beyond:.1e}", *figures,
                            f"{took / unit:.2f}"])  # fmt: skip
            sys.stdout.flush()


if __name__ == "__main__":
    main()
