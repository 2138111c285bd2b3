"""Scenes of heavy bodies on light ones, bonds and joints over ranks: Auto, which gathers contacts, beside sweeps alone.

    python benchmarks/ranks_gathered.py > benchmarks/results/ranks_gathered.csv
    python benchmarks/ranks_gathered.py "heavier on a mesh"   # lines of these scenes alone
    python benchmarks/ranks_gathered.py --sweep > benchmarks/results/ranks_gathered_numbers.csv

A line for each scene of test_gathered_contacts.py and test_gathered_meshes.py, of the tests of ranks, and each solver, without
ranks and over four ranks in turns: steps, those that converged, sweeps of all, the largest way of a body or a node beyond a run
without ranks by Auto to a hundredth of the tolerance [m], gatherings, bytes of the last one, processor time of the steps over
that of Auto without ranks.
--sweep: Auto over four ranks with the numbers of cxx/solvers/policy.def that steer gathering, each as it is, halved and doubled,
in processes of their own (CAIRN_POLICY), and larger scenes besides: disks that were thrown into a box, about two contacts each.
"""

import argparse
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
from policy import apart, listed, number

STEPS = 60
SWEPT = ("tower 1", "tower 1e+06", "bonded_wall", "chain", "lid")  # with numbers that change


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


def named_scenes():
    """Functions that make the scenes, by name."""
    towers = {f"tower {ratio:g}": lambda ratio=ratio: scenes.tower(ratio) for ratio in (1.0, 1e3, 1e4, 1e6, 1e9, 1e12)}
    on_meshes = {f"{name} on a mesh": made for name, made in meshes.SCENES.items()}
    return towers | {made.__name__: made for made in scenes.SCENES[1:]} | on_meshes


def thrown(side):
    """side^2 disks in a box, at rest against each other, thrown sideways."""
    rng = np.random.default_rng(1)
    x = np.stack(np.meshgrid(*[np.arange(side)] * 2, indexing="ij"), -1).reshape(-1, 2) * 0.97 + 0.5
    disks = cn.disks(x, rng.uniform(0.48, 0.5, len(x)), scenes.ROCK, velocity=np.tile((2.0, -1.0), (len(x), 1)))
    walls = cn.wall((0, 0), (1, 0), scenes.ROCK), cn.wall((0.97 * side, 0), (-1, 0), scenes.ROCK)
    return scenes.on_floor(disks, *walls)


def sweep_numbers():
    """A line for each number, value and scene: converged, sweeps, gatherings, processor time over that of the table's value."""
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(["number", "value", "scene", "steps", "converged", "sweeps", "gathered", "time"])
    made = {name: scene for name, scene in named_scenes().items() if name in SWEPT}
    made |= {f"thrown {side * side}": lambda side=side: thrown(side) for side in (9, 14, 20)}

    def row(scene):
        sim, converged, sweeps, took = timed(scene, 4, cn.Auto())
        return converged, sweeps, sim.ranks.figures()["gathered_solves"], took

    for name, text, *_ in listed():
        for scene in made if name.startswith("gathered_") else ():
            unit = None
            for factor in (1.0, 0.5, 2.0):
                value = factor * number(text)
                converged, sweeps, gathered, took = apart(lambda scene=scene: row(made[scene]), f"{name}={value:g}")
                unit = unit or took
                table.writerow([name, f"{value:g}", scene, STEPS, converged, sweeps, int(gathered), f"{took / unit:.2f}"])
                sys.stdout.flush()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="of scenes; all without")
    parser.add_argument("--sweep", action="store_true", help="the numbers of gathering at three values each")
    warnings.simplefilter("ignore")
    given = parser.parse_args()
    if given.sweep:
        return sweep_numbers()
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(["scene", "ranks", "solver", "steps", "converged", "sweeps", "beyond", "gathered", "bytes", "time"])
    for name, scene in named_scenes().items():
        if given.names and name not in given.names:
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
    main()
