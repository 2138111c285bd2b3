"""Factors of the matrix over bodies that Newton's method has, M + H D H' with all contacts sticking: our block LU, and the SOE.

    python benchmarks/factors.py [--steps 40]

Deposits of disks and spheres after some steps. CPU seconds, one thread: of CHOLMOD and UMFPACK the first factorisation with its
analysis, and one of other values. Of our own blocks more than that: a whole step of one iteration of PPANewton from nothing, in
which all contacts stick, detection and error with it; and one of the two iterations that follow, in which those that closed count
alone. Writes benchmarks/results/factors.csv.
"""

import argparse
import csv
import time
from pathlib import Path

import cairn as cn
import numpy as np
from cairn.run.contact_problem import problem_of
from scenes import deposit
from scipy import sparse

HERE = Path(__file__).resolve().parent


def seconds(f):
    start = time.process_time()
    f()
    return time.process_time() - start


def matrix(sim):
    """M + H D H' of the current step over the free velocities; D is a thousand times the inverse of the diagonal of W."""
    sim.step()
    found = problem_of(sim)
    inverse = sparse.csr_array(found["inverse"])
    moving = np.flatnonzero(inverse.diagonal() > 0)
    h = sparse.csr_array(found["operator"])[:, moving]
    weights = sparse.diags_array(1e3 / sparse.csr_array(found["problem"].W).diagonal())
    return sparse.csc_array(sparse.diags_array(1 / inverse.diagonal()[moving]) + h.T @ weights @ h), found["problem"]


def of_soe(k, storage):
    """CPU seconds of the first factorisation and of another."""
    a = sparse.csc_array(k if storage == "unsymmetric" else sparse.tril(k))
    a.sort_indices()
    made = []
    first = seconds(lambda: made.append(cn._core.Soe(a.shape[0], a.indptr, a.indices, a.data, storage)))
    return first, seconds(lambda: made[0].factor(2 * a.data))


def of_iterations(sim):
    spent = []
    for most in (1, 3):
        sim.strategy = cn.NSCD(solver=cn.PPANewton(tol=1e-14, max_iter=most), threads=1, warm_start=False)
        sim.checkpoint(path := HERE / "results" / ".factors.h5")
        spent.append(seconds(sim.step))
        sim.restore(path)
        path.unlink()
    return spent[0], (spent[1] - spent[0]) / 2


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=40)
    options = parser.parse_args()
    with open(HERE / "results" / "factors.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(("scene", "bodies", "contacts", "unknowns", "factors", "first_s", "again_s"))
        for case, count in (("disks", 5000), ("disks", 20000), ("spheres", 1000), ("spheres", 2000)):
            sim = deposit(case, count, max_iter=200, steps=options.steps)
            k, problem = matrix(sim)
            rows = {"CHOLMOD": of_soe(k, "sparse"), "UMFPACK": of_soe(k, "unsymmetric"), "own blocks": of_iterations(sim)}
            for name, (first, again) in rows.items():
                row = (case, count, problem.contacts, k.shape[0], name, f"{first:.3g}", f"{again:.3g}")
                writer.writerow(row)
                print(*row, flush=True)
                file.flush()


if __name__ == "__main__":
    main()
