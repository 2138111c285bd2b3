"""Processes of ranks killed (SIGKILL) at random instants: one of three, or all of them in odd trials.

    script/bench rank_kills [--kills 200]

A line for each kill: processes killed; last step whose output was told as flushed; whole outputs in the file; step of its
checkpoint; bonds after a further step over four ranks in one process; seconds until all processes had ended; 1 if nothing that
was flushed is lost.
"""

import argparse
import csv
import os
import sys
import tempfile
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = "1"
sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "python" / "ranks"))

from test_rank_kills import kill


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--first", type=int, default=0, help="number of the first trial, which draws its instant")
    options = parser.parse_args()
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(["trial", "killed", "flushed", "outputs", "checkpoint", "bonds", "seconds", "kept"])
    for trial in range(options.first, options.first + options.kills):
        with tempfile.TemporaryDirectory() as folder:
            found = kill(Path(folder), trial)
        kept = found["outputs"] >= found["flushed"] // 2 + 1 and found["checkpoint"] >= found["flushed"] - 2
        row = {**found, "seconds": f"{found['seconds']:.2f}", "kept": int(kept and found["bonds"] > 0)}
        table.writerow([trial, *row.values()])
        sys.stdout.flush()


if __name__ == "__main__":
    main()
