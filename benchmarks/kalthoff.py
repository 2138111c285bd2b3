"""Kalthoff and Winkler's plate on four meshes: the figures of examples/kalthoff and the CPU time of each run, on one thread.

    script/bench kalthoff [--runs default full 60 turned]

Writes benchmarks/results/kalthoff.csv, a row a run; rows of other runs stay. Pictures and files go to --output, a folder a run.
"""

import argparse
import csv
import os
import sys
import time
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

HERE = Path(__file__).resolve().parent
RUNS = {"default": [], "60": ["--cells", "60"], "turned": ["--turn", "20"], "full": ["--full"]}


def row(name, output):
    sys.path.insert(0, str(HERE.parent / "examples" / "kalthoff"))
    import kalthoff

    begin = time.process_time()
    figures = kalthoff.main([*RUNS[name], "--output", str(output / name)])
    told = {f"{figure} [{unit}]" if unit else figure: f"{value:.5g}" for figure, (value, unit) in figures.items()}
    command = " ".join(["kalthoff.py", *RUNS[name]])
    return {"run": name, "command": command} | told | {"CPU time [s]": f"{time.process_time() - begin:.4g}"}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", nargs="*", choices=RUNS, default=list(RUNS))
    parser.add_argument("--output", type=Path, default=Path("kalthoff_runs"))
    parser.add_argument("--table", type=Path, default=HERE / "results" / "kalthoff.csv")
    given = parser.parse_args()
    for name in given.runs:
        made = row(name, given.output)
        rows = {}
        if given.table.exists():
            with open(given.table, newline="") as file:
                rows = {old["run"]: old for old in csv.DictReader(file)}
        rows[name] = made
        with open(given.table, "w", newline="") as file:
            table = csv.DictWriter(file, list(made))
            table.writeheader()
            table.writerows(rows[run] for run in RUNS if run in rows)
