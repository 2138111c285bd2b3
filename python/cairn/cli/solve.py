"""`cairn solve`: problems from files, solved and measured from the shell."""

import csv
import os
import sys

from ..names import listed

SMALL = 300  # unknowns up to which rank and conditioning are computed
COLUMNS = (
    "problem", "dim", "contacts", "asked", "solver", "tol", "status", "iterations", "cpu_seconds", "error", "plain_error",
    "worst_contact", "rank", "conditioning",
)


def add_parser(add, commands):
    """The parser of `cairn solve`; add: how the command line makes one."""
    parser = add(
        commands,
        "solve",
        "solve frictional contact problems from files",
        "cairn solve box.hdf5                          to a true error of 1e-8\n"
        "cairn solve *.hdf5 --solver nlgs --tol 1e-4 --csv > table.csv\n"
        "cairn solve step.hdf5 --output solved.hdf5    writes the problem with its solution (r, u)\n"
        "cairn solve --list                            the solvers there are",
    )
    parser.add_argument("files", nargs="*", metavar="PROBLEM", help="FCLIB's HDF5 or Siconos's text (.dat), local or global")
    parser.add_argument("--solver", "-s", default="auto", help="default: auto")
    parser.add_argument("--tol", type=float, default=1e-8, help="true error to reach (default: 1e-8)")
    parser.add_argument("--max-iter", type=int, default=10_000_000, help="iterations at most")
    parser.add_argument("--max-seconds", type=float, default=float("inf"), help="CPU seconds at most for each problem")
    parser.add_argument("--threads", type=int, default=1, help="threads of solvers that use them (default: 1)")
    parser.add_argument("--seed", type=int, default=0, help="seed of solvers that draw an order (default: 0)")
    parser.add_argument("--output", "-o", metavar="FILE", help="write problem and solution in the FCLIB layout (one problem)")
    parser.add_argument("--csv", action="store_true", help="a table for programs")
    parser.add_argument("--list", action="store_true", help="list the solvers and end")


def main(options):
    """Runs the command; 0 if every problem converged, 3 if one did not."""
    from ..problems import ProblemFileError, read, solvers, write

    if options.list:
        for name, summary in solvers().items():
            print(f"{name:24s} {summary}")
        return 0
    if not options.files:
        raise ValueError("say which problem: cairn solve FILE")
    if options.solver not in solvers():
        raise ValueError(f"there is no solver '{options.solver}': give one of {listed(solvers(), options.solver)}")
    if options.output and len(options.files) > 1:
        raise ValueError("--output takes the solution of one problem: solve them one by one")
    writer = csv.DictWriter(sys.stdout, COLUMNS) if options.csv else None
    if writer:
        writer.writeheader()
    code = 0
    for path in options.files:
        try:
            problem = read(path)
        except ProblemFileError as error:
            print(f"cairn: error: {' '.join(str(error).splitlines())}", file=sys.stderr)
            code = 1
            continue
        result = problem.solve(
            options.solver, options.tol, max_iter=options.max_iter, max_seconds=options.max_seconds, threads=options.threads,
            seed=options.seed,
        )
        _show(path, problem, result, options, writer)
        if options.output:
            write(options.output, problem, result)
        if not result.converged:
            code = code or 3
    return code


def _show(path, problem, result, options, writer):
    rank = conditioning = None
    if problem.dim * problem.contacts <= SMALL:
        rank, conditioning = problem.rank()
    row = {
        "problem": os.path.basename(path), "dim": problem.dim, "contacts": problem.contacts, "asked": options.solver,
        "solver": result.solver, "tol": options.tol, "status": result.status, "iterations": result.iterations,
        "cpu_seconds": f"{result.cpu_seconds:.6g}", "error": f"{result.error:.3g}",
        "plain_error": f"{problem.plain_error(result.r):.3g}", "worst_contact": result.worst_contact, "rank": rank,
        "conditioning": None if conditioning is None else f"{conditioning:.3g}",
    }
    if writer:
        writer.writerow(row)
        sys.stdout.flush()
        return
    print(f"{path}: {problem.contacts} contacts, {problem.dim}D")
    if rank is not None:
        print(f"  rank {rank} of {problem.dim * problem.contacts}, conditioning on it {conditioning:.2e}")
    print(f"  {result.status} by {result.solver}: {result.iterations} iterations, {result.cpu_seconds:.4g} CPU s")
    print(f"  true error {result.error:.2e} (tol {options.tol:g}); contact {result.worst_contact} is worst, "
          f"{result.worst_error:.2e} on its own scale")
    print(f"  penetration rate {result.penetration_rate:.2e}, outside the cone {result.cone_distance:.2e}, "
          f"energy made {result.energy_created:.2e}")
    if result.hint:
        print(f"  {result.hint}")
