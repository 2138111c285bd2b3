"""What scenes of disks and of spheres pay for all that they do not use: two commits built and measured side by side in one run.

    script/bench pays_nothing [--before d7054eb] [--after HEAD] [--count 10000] [--builds FOLDER]

`before` is the last commit without smooth DEM, elastic bodies and the files of LMGC90. Both commits are built with the release
preset. Then their processes take turns: the same deposits, a fixed number of sweeps, CPU time of a step (least of all chunks of
steps), bytes by Cairn's own count and by the growth of the process, CPU time and bytes of `import cairn`. `step_one_sweep` is a
step with a single sweep: what is left is everything but the solver. Writes benchmarks/results/pays_nothing.csv: a row for a scene
and quantity, both commits, their ratio.
"""

import argparse
import csv
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SWEEPS = 20


def build(commit, folder):
    """The folder to put on PYTHONPATH, with `commit` built in it."""
    source, tree = folder / f"source-{commit}", folder / f"build-{commit}"
    python = tree / "python"
    if not (python / "cairn").exists():
        source.mkdir(parents=True, exist_ok=True)
        archive = subprocess.run(["git", "-C", str(ROOT), "archive", commit], check=True, capture_output=True).stdout
        subprocess.run(["tar", "x", "-C", str(source)], input=archive, check=True)
        launcher = [f"-DCMAKE_CXX_COMPILER_LAUNCHER={os.environ['CCACHE']}"] if "CCACHE" in os.environ else []
        options = ["-DCAIRN_TESTS=OFF", "-DCAIRN_BENCHMARKS=OFF", *launcher]
        commands = [["cmake", "--preset", "release", "-B", str(tree), *options], ["cmake", "--build", str(tree), "-j2"]]
        for command in commands:
            subprocess.run(command, cwd=source, check=True, stdout=sys.stderr)
    return python


def resident():
    """Resident bytes of this process."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096


def measure(case, count, chunks, steps):
    """In a process of its own: seconds a step and bytes."""
    begin, bytes_before = time.process_time(), resident()
    import cairn  # noqa: F401

    result = {"import_seconds": time.process_time() - begin, "import_megabytes": (resident() - bytes_before) / 1e6}
    if case == "import":
        return result
    from scenes import deposit

    before = resident()
    for name, sweeps in (("step", SWEEPS), ("step_one_sweep", 1)):
        sim = deposit(case, count, tol=1e-15, max_iter=sweeps, min_iter=sweeps, steps=5)
        best = float("inf")
        for _ in range(chunks):
            begin = time.process_time()
            for _ in range(steps):
                sim.step()
            best = min(best, (time.process_time() - begin) / steps)
        contacts = len(sim.contacts)
        result[f"{name}_microseconds_a_contact"] = 1e6 * best / contacts
        if name == "step":
            bodies, of_contacts = sim._core.bytes()
            result |= {
                "contacts": contacts,
                "bytes_a_body": bodies / len(sim.bodies),
                "bytes_a_contact": of_contacts / contacts,
                "process_growth_bytes_a_body": (resident() - before) / len(sim.bodies),
            }
    return result


def run(python, case, options):
    """The numbers that a process prints with the package of `python`."""
    command = [sys.executable, str(Path(__file__)), "--measure", case]
    for name in ("count", "chunks", "steps"):
        command += [f"--{name}", str(getattr(options, name))]
    environment = os.environ | {"PYTHONPATH": str(python), "OMP_NUM_THREADS": "1"}
    printed = subprocess.run(command, check=True, capture_output=True, text=True, env=environment).stdout
    return json.loads(printed.splitlines()[-1])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--before", default="d7054eb")
    parser.add_argument("--after", default="HEAD")
    parser.add_argument("--count", type=int, default=10000)
    parser.add_argument("--chunks", type=int, default=6)
    parser.add_argument("--steps", type=int, default=5, help="of a chunk")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--builds", type=Path, help="where builds are kept, or are found")
    parser.add_argument("--output", type=Path, default=ROOT / "benchmarks" / "results" / "pays_nothing.csv")
    parser.add_argument("--measure", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.measure:
        print(json.dumps(measure(options.measure, options.count, options.chunks, options.steps)))
        return
    with tempfile.TemporaryDirectory() as folder:
        short = ["git", "-C", str(ROOT), "rev-parse", "--short"]
        wanted = (options.before, options.after)
        commits = [subprocess.run([*short, c], check=True, capture_output=True, text=True).stdout.strip() for c in wanted]
        pythons = [build(c, options.builds or Path(folder)) for c in commits]
        rows = []
        for case in ("import", "disks", "spheres"):
            runs = [[], []]
            for _ in range(options.rounds):
                for python, mine in zip(pythons, runs, strict=True):
                    mine.append(run(python, case, options))
            for quantity in runs[0][0]:
                if case != "import" and quantity.startswith("import"):
                    continue
                both = [min(r[quantity] for r in mine) for mine in runs]
                paired = statistics.median(b[quantity] / a[quantity] for a, b in zip(*runs, strict=True))
                rows.append({"scene": case, "quantity": quantity, "before": both[0], "after": both[1], "ratio": both[1] / both[0],
                             "median_of_paired_ratios": paired})
        rows = [{"commit_before": commits[0], "commit_after": commits[1]}
                | {k: v if isinstance(v, str) else f"{v:.4g}" for k, v in row.items()} for row in rows]
        with open(options.output, "w", newline="") as file:
            writer = csv.DictWriter(file, list(rows[0]))
            writer.writeheader()
            writer.writerows(rows)
        for row in rows:
            print(*row.values(), sep=",")


if __name__ == "__main__":
    main()
