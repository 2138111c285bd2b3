"""`cairn sweep`: a script run over many values of its parameters, results in one table."""

import sys

EXAMPLE = """\
cairn sweep study.toml -j 4        goes on where it was stopped
a study.toml:
    script = "heap.py"             it defines run(parameters), which returns {name: number}
    samples = 40                   of a Latin hypercube; without it all combinations of the lists
    [parameters]
    mu = [0.1, 0.3, 0.5]
    radius = { low = 0.01, high = 0.1, log = true }
exit status: 0 all points are done, 3 some failed (the column failed says why), 1 the study cannot be read"""


def add_parser(add, commands):
    """The parser of `cairn sweep`."""
    parser = add(commands, "sweep", "run a script over many values of its parameters, results in one table", EXAMPLE)
    parser.add_argument("study", metavar="STUDY.toml", help="script, parameters, samples, seed")
    parser.add_argument("-o", "--output", metavar="FOLDER", help="where results.csv goes (default: the study's name)")
    parser.add_argument("-j", "--processes", type=int, help="side by side, one thread each (default: as many as cores)")
    parser.add_argument("--dask", metavar="ADDRESS", help="Dask scheduler whose workers run the points: tcp://host:8786")
    parser.add_argument("--plan", action="store_true", help="list the points and end")
    parser.add_argument("-q", "--quiet", action="store_true", help="no progress")


def main(options):
    """`cairn sweep`."""
    import csv

    from ..base import checks
    from ..study import sweep as sweeps

    if options.processes is not None:
        checks.count("processes", options.processes, 1)
    if options.plan:
        for point in sweeps.read(options.study).points:
            print(", ".join(f"{name} = {value}" for name, value in point.items()))
        return 0

    def told(done, total):
        print(f"\r{done} of {total} points", end="" if done < total else "\n", file=sys.stderr, flush=True)

    path = sweeps.sweep(
        options.study, options.output, options.processes, options.dask, progress=None if options.quiet else told
    )
    with open(path, newline="") as file:
        failed = sum(bool(row["failed"]) for row in csv.DictReader(file))
    print(path)
    if failed:
        print(f"cairn: {failed} points failed; the column 'failed' says why", file=sys.stderr)
    return 3 if failed else 0
