"""Siconos on frictional contact problems, run by the Python that has it: python3 problems_siconos.py FOLDER [SECONDS].

FOLDER holds NAME.dat (Siconos text). Writes, beside each, NAME.SOLVER.EXPONENT.npy with [CPU seconds of the solve call, its own
figure of the error, r ...] for a tolerance 10^-EXPONENT of its own error; no file where a run failed, crashed or took longer.
"""

import os
import resource
import sys
import time
from pathlib import Path

import numpy as np
import siconos.numerics as sn

IN_SPACE = {
    "NSGS": (sn.SICONOS_FRICTION_3D_NSGS, None),
    "NSGS-GP": (sn.SICONOS_FRICTION_3D_NSGS, sn.SICONOS_FRICTION_3D_ONECONTACT_NSN_GP),
    "NSGS-PLI": (sn.SICONOS_FRICTION_3D_NSGS, sn.SICONOS_FRICTION_3D_ONECONTACT_ProjectionOnConeWithLocalIteration),
    "NSGS-quartic": (sn.SICONOS_FRICTION_3D_NSGS, sn.SICONOS_FRICTION_3D_ONECONTACT_QUARTIC),
    "PROX": (sn.SICONOS_FRICTION_3D_PROX, None),
    "NSN-AC": (sn.SICONOS_FRICTION_3D_NSN_AC, None),
    "NSN-FB": (sn.SICONOS_FRICTION_3D_NSN_FB, None),
    "ADMM": (sn.SICONOS_FRICTION_3D_ADMM, None),
    "VI-EG": (sn.SICONOS_FRICTION_3D_VI_EG, None),
}
IN_PLANE = {
    "NSGS": (sn.SICONOS_FRICTION_2D_NSGS, None),
    "CPG": (sn.SICONOS_FRICTION_2D_CPG, None),
    "Lemke": (sn.SICONOS_FRICTION_2D_LEMKE, None),
}


def solve(path, solver, local, tol, out):
    problem = sn.frictionContactProblemFromFile(str(path))
    dim, n = problem.dimension, problem.numberOfContacts
    driver = sn.fc3d_driver if dim == 3 else sn.fc2d_driver
    best = None
    for _ in range(50):
        options = sn.SolverOptions(solver)
        if local is not None:
            sn.solver_options_update_internal(options, 0, local)
        options.dparam[sn.SICONOS_DPARAM_TOL] = tol
        options.iparam[sn.SICONOS_IPARAM_MAX_ITER] = 10_000_000
        r, u = np.zeros(dim * n), np.zeros(dim * n)
        begin, wall = time.clock_gettime(time.CLOCK_PROCESS_CPUTIME_ID), time.perf_counter()
        info = driver(problem, r, u, options)
        wall = time.perf_counter() - wall  # where the clock of the CPU is too coarse, the least of many is as good
        seconds = wall if wall < 0.02 else time.clock_gettime(time.CLOCK_PROCESS_CPUTIME_ID) - begin
        best = seconds if best is None else min(best, seconds)
        np.save(out, np.concatenate([[best, options.dparam[1], info], r]))
        if seconds > 0.02:
            break


def main(folder, cap):
    for path in sorted(Path(folder).glob("*.dat")):
        with open(path, encoding="ascii") as file:
            dim = int(file.readline())
        for name, (solver, local) in (IN_SPACE if dim == 3 else IN_PLANE).items():
            for exponent in (4, 5, 8, 9):
                out = f"{path.with_suffix('')}.{name}.{exponent}.npy"
                if Path(out).exists():
                    continue
                child = os.fork()
                if child == 0:
                    resource.setrlimit(resource.RLIMIT_CPU, (cap, cap))
                    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
                    null = os.open(os.devnull, os.O_WRONLY)
                    os.dup2(null, 1)
                    os.dup2(null, 2)
                    try:
                        solve(path, solver, local, 10.0**-exponent, out)
                    finally:
                        os._exit(0)
                _, status = os.waitpid(child, 0)
                if status and not Path(out).exists():
                    break  # tighter ones take longer


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 3)
