"""Scenes of heavy bodies on light ones, bonds and joints over ranks: Auto, which gathers contacts, beside sweeps alone.

    python benchmarks/ranks_gathered.py > benchmarks/results/ranks_gathered.csv
    python benchmarks/ranks_gathered.py "heavier on a mesh"   # lines of these scenes alone

A line for each scene of test_gathered_contacts.py and test_gathered_meshes.py, of the tests of ranks, and each solver, without
ranks and over four ranks in turns: steps, those that converged, sweeps of all, the largest way of a body or a node beyond a run
without ranks by Auto to a hundredth of the tolerance [m], gatherings, bytes of the last one, processor time of the steps over
that of Auto without ranks.
"""

import csv
import sys
import time
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "python" / "ranks"))
sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "helpers"))

import cairn as cn
import numpy as np
import test_gathered_contacts as scenes
import test_gathered_meshes as meshes

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


def places(sim):
    return np.concatenate([np.array(sim.bodies.position), np.array(sim.nodes.position)])


def main(names):
    warnings.simplefilter("ignore")
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(["scene", "ranks", "solver", "steps", "converged", "sweeps", "beyond", "gathered", "bytes", "time"])
    towers = [(f"tower {ratio:g}", lambda ratio=ratio: scenes.tower(ratio)) for ratio in (1.0, 1e3, 1e4, 1e6, 1e9, 1e12)]
    on_meshes = [(f"{name} on a mesh", made) for name, made in meshes.SCENES.items()]
    for name, scene in towers + [(made.__name__, made) for made in scenes.SCENES[1:]] + on_meshes:
        if names and name not in names:
            continue
        exact = places(timed(scene, None, cn.Auto(tol=1e-6))[0])
        unit = None
        for ranks, solver in ((None, cn.Auto()), (4, cn.Auto()), (4, cn.NLGS())):
            sim, converged, sweeps, took = timed(scene, ranks, solver)
            unit = unit or took
            beyond = np.abs(places(sim) - exact).max()
            found = sim.ranks.figures() if ranks else {}
            figures = [found.get("gathered_solves", 0), found.get("gathered_bytes", 0)]
            table.writerow([name, ranks or 0, type(solver).__name__, STEPS, converged, sweeps, f"{beyond:.1e}", *figures,
                            f"{took / unit:.2f}"])  # fmt: skip
            sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1:])
