"""Bits of scenes over processes of MPI beside those of one rank in one process.

    mpirun -n 4 --oversubscribe python benchmarks/rank_bits.py > benchmarks/results/rank_bits.csv

A line for each scene of the tests of ranks: processes; steps; contacts at the end; hash of places, velocities, contacts and
energies; 1 if all of it is as one rank has it.
"""

import csv
import os
import sys
import warnings
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "python" / "ranks"))

import test_driven_cell_ranks as cells
import test_features_over_ranks as features
import test_joint_ranks as joints
import test_ranks as shapes
import test_smooth_ranks as smooth

STEPS = 40


def scenes():
    """Names, functions of a number of ranks that run a scene, and hashes of its end."""
    for of in (shapes, features):
        for made in of.SCENES:
            yield made.__name__, lambda ranks, of=of, made=made: of.run(made, ranks, STEPS), of.digest
    for dim in (2, 3):
        yield f"smooth, {dim}D", lambda ranks, dim=dim: smooth.run(smooth.scene(dim), ranks, STEPS), smooth.digest
        yield f"joints, {dim}D", lambda ranks, dim=dim: joints.run(joints.SCENES[dim - 2], ranks, STEPS), joints.digest
    for dim, driven in cells.DRIVEN[:2]:
        made = cells.scene(dim, **driven)
        yield f"cell, {driven}", lambda ranks, made=made: cells.run(made, ranks, STEPS), cells.digest


def main():
    warnings.simplefilter("ignore")
    table = csv.writer(sys.stdout, lineterminator="\n")
    for number, (name, run, digest) in enumerate(scenes()):
        sim = run("mpi")
        first, found, contacts, count = sim.ranks.first, digest(sim), len(sim.contacts), sim.ranks.count
        if not first:
            continue
        if number == 0:
            table.writerow(["scene", "processes", "steps", "contacts", "hash", "same"])
        table.writerow([name, count, STEPS, contacts, found[:16], int(found == digest(run(1)))])
        sys.stdout.flush()


if __name__ == "__main__":
    main()
