"""Newton's passes of blocks of solids that a sphere presses, on one core: stages of a pass against the whole, and memory.

    script/bench newton_passes [--most 10000] [--steps 2] [--case KIND LAW NODES]

A line for each case, each in its own process: nodes, contacts and passes of the last step; seconds of the stages of all passes by
`info["newton_seconds"]`, and all of them over assembly, factorisation and contacts; cells that get stresses and tangent in a
second; residual of the balance; the peak of the process less that before set-up.
"""

import argparse
import csv
import os
import resource
import subprocess
import sys

os.environ["OMP_NUM_THREADS"] = "1"

import cairn as cn
import numpy as np
from meshes import grid

LAWS = {
    "hooke": (cn.IsotropicElastic(young=1e7, poisson=0.3), {"kinematics": "small"}),
    "neo_hookean": (cn.NeoHookean(young=1e7, poisson=0.3), {}),
    "finite_j2": (cn.FiniteJ2(young=1e7, poisson=0.3, yield_stress=1e5, isotropic=1e5), {}),
}
COLUMNS = ("kind", "law", "nodes", "contacts", "steps", "passes", "assembly_s", "factorisation_s", "contacts_s", "balance_s",
           "all_s", "ratio", "cells_a_second", "newton_error", "status", "peak_mb")  # fmt: skip


def pressed(kind, law, nodes):
    """A block of side 1 m, held at its foot, and a sphere that comes down on the middle of its top."""
    n = int(round(nodes ** (1 / 3))) - 1
    points, cells = grid(kind, [n] * 3, [1.0] * 3, (0.0, 0.0, 0.0))
    material, options = LAWS[law]
    foot = np.flatnonzero(points[:, 2] == 0)
    body = cn.SolidBody(points, cells, material, density=2000.0, groups={"foot": foot}, **options)
    top = np.flatnonzero((points[:, 2] == 1) & (np.hypot(*(points[:, :2] - 0.5).T) < 0.25))
    rubber, steel = cn.Material("rubber", density=2000.0), cn.Material("steel", density=8000.0)
    scene = cn.Scene(3)
    scene.add(cn.deformable(body, rubber, contact=top, fixed={"foot": "xyz"}))
    drive = (0.0, 0.0, -1.0, 0.0, 0.0, 0.0)
    scene.add(cn.spheres([[0.5, 0.5, 1.5]], 0.5, steel, driven=("vx", "vy", "vz", "wx", "wy", "wz"), drive=drive))
    scene.interact(rubber, steel, cn.Coulomb(mu=0.3))
    strategy = cn.NSCD(theta=1.0, newton_tol=1e-6, solver=cn.Default(tol=1e-6, max_iter=2000))
    return cn.Simulation(scene, 0.01, strategy, overlap="ignore"), sum(map(len, cells.values()))


def measure(kind, law, nodes, steps):
    """A row of COLUMNS."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    sim, cells = pressed(kind, law, nodes)
    passes, worst = 0, 0.0
    for _ in range(steps):
        report = sim.step()
        passes, worst = passes + report["newton_passes"], max(worst, report["newton_error"])
    spent = sim.info["newton_seconds"]
    parts = spent["assembly"] + spent["factorisation"] + spent["contacts"]
    return {
        "kind": kind, "law": law, "nodes": len(sim.meshes[0].ids), "contacts": report["contacts"], "steps": steps,
        "passes": passes, **{f"{name}_s": f"{value:.3g}" for name, value in spent.items()},
        "ratio": f"{spent['all'] / parts:.3g}",
        "cells_a_second": f"{cells * passes / spent['assembly']:.3g}", "newton_error": f"{worst:.2g}", "status": report["status"],
        "peak_mb": round((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1e3),
    }  # fmt: skip


def main():
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--most", type=int, default=10_000, help="nodes of a block")
    parser.add_argument("--steps", type=int, default=2)
    parser.add_argument("--case", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    writer = csv.DictWriter(sys.stdout, COLUMNS)
    if options.case:
        kind, law, nodes = options.case
        writer.writerow(measure(kind, law, int(nodes), options.steps))
        return
    writer.writeheader()
    for kind in ("HEX8", "TET4"):
        for law in LAWS:
            for nodes in (n for n in (1000, 10_000, 100_000) if n <= options.most):
                sys.stdout.flush()
                command = [sys.executable, __file__, "--steps", str(options.steps), "--case", kind, law, str(nodes)]
                subprocess.run(command, check=False)


if __name__ == "__main__":
    main()
