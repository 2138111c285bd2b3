"""The dry wall of 1,013 blocks under inclined gravity as LMGC90 ran it: CPU time and true error beside its figures.

    python benchmarks/reference_wall.py [--solver PPANewton] [--tol 1e-5] [--steps 100] [--threads 1]

The scene is read from the folder named by CAIRN_REFERENCE_DATA. CSV on standard output, CPU time of the whole step.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import sys
import time
from pathlib import Path

import cairn as cn
import h5py
import numpy as np

DATA = Path(os.environ.get("CAIRN_REFERENCE_DATA", Path(__file__).resolve().parents[2] / "shared")) / "scenes"
NAME = "wall3d_25x40"


def build(solver, threads=1):
    """A simulation of the wall, its base held."""
    with h5py.File(DATA / f"{NAME}.h5") as file:
        vertices, faces = file["vertices"][:], file["faces"][:]
        first_vertex, first_face = file["vertex_offset"][:], file["face_offset"][:]
        meta = json.loads(file.attrs["meta_json"])
    meshes = []
    for k in range(meta["n"]):
        corners = faces[first_face[k] : first_face[k + 1]]
        if corners.min() >= first_vertex[k] and corners.max() >= first_vertex[k + 1] - first_vertex[k]:
            corners = corners - first_vertex[k]
        meshes.append((vertices[first_vertex[k] : first_vertex[k + 1]], corners))
    rock = cn.Material("rock", density=meta["density"])
    scene = cn.Scene(3, gravity=meta["gravity"])
    held = meta["fixed_bodies"]
    scene.add(cn.polyhedra([meshes[k] for k in held], rock, fixed=True))
    scene.add(cn.polyhedra([m for k, m in enumerate(meshes) if k not in held], rock))
    scene.interact(rock, rock, cn.Coulomb(mu=meta["mu"]))
    strategy = cn.NSCD(theta=meta["theta"], solver=solver, margin=meta["alert"], threads=threads)
    return cn.Simulation(scene, meta["dt"], strategy)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--solver", default="PPANewton", choices=sorted(cn.strategies.SOLVERS))
    parser.add_argument("--max-iter", type=int, default=20000)
    parser.add_argument("--tol", type=float, default=1e-5)
    parser.add_argument("--steps", type=int, default=100)
    parser.add_argument("--threads", type=int, default=1)
    options = parser.parse_args()
    with open(DATA / f"{NAME}_cundall.lmgc90.csv") as file:
        theirs = list(csv.DictReader(file))[: options.steps]
    solver = cn.strategies.SOLVERS[options.solver](tol=options.tol, max_iter=options.max_iter)
    sim = build(solver, options.threads)
    errors, iterations, failed = [], 0, 0
    start = time.process_time()
    for _ in theirs:
        sim.step()
        info = sim.info
        errors.append(info["error"])
        iterations += info["iterations"]
        failed += info["status"] != "converged"
    cpu = time.process_time() - start
    reference = sum(float(row["c_total"]) for row in theirs)
    row = {
        "solver": options.solver,
        "threads": options.threads,
        "steps": len(theirs),
        "tol": options.tol,
        "contacts": info["contacts"],
        "cpu_s": round(cpu, 2),
        "mean_iterations": round(iterations / len(theirs), 1),
        "largest_error": f"{np.max(errors):.2e}",
        "not_converged": failed,
        "lmgc90_cpu_s": round(reference, 2),
        "lmgc90_over_cairn": round(reference / cpu, 2),
    }
    writer = csv.DictWriter(sys.stdout, row, lineterminator="\n")
    writer.writeheader()
    writer.writerow(row)


if __name__ == "__main__":
    main()
