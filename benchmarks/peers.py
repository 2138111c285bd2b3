"""Runs of other programs beside Cairn: search on the path, CPU time between two marks of an input, and the last state.

LAMMPS (`lmp`), LIGGGHTS (`liggghts`) and YADE (`yade`) are looked for on the path; LMGC90 is the wheel compas_lmgc90, in this
Python or in the one that the variable CAIRN_LMGC90_PYTHON names. What is missing is left out with a word. Times are CPU seconds
of a peer's first thread as Linux counts them, so that programs that run at the same time disturb them little.
"""

import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np

STAMP = """p=$$
while [ "$p" -gt 1 ]; do
  case "$(cat /proc/$p/comm)" in
    lmp*|liggghts*) cut -d' ' -f1 /proc/$p/schedstat > stamp.$1; break ;;
  esac
  p=$(awk '/^PPid/ {print $2}' /proc/$p/status)
done
"""
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


def found(names):
    """Names of the programs on the path; prints a word about the others."""
    there = [name for name in names if shutil.which(name)]
    for name in names:
        if name not in there:
            print(f"{name} is not on the path: left out", flush=True)
    return there


def lmgc90_python():
    """The Python that has compas_lmgc90, or None with a word."""
    if importlib.util.find_spec("compas_lmgc90"):
        return sys.executable
    named = os.environ.get("CAIRN_LMGC90_PYTHON")
    if not named:
        print("compas_lmgc90 is not installed, CAIRN_LMGC90_PYTHON not set: LMGC90 is left out", flush=True)
    return named


def call(command, folder, environment=None):
    """Standard output of a command of one thread; RuntimeError with the ends of its outputs if it fails."""
    own = {**os.environ, **ONE_THREAD, **(environment or {})}
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, env=own, check=False)
    if done.returncode:
        raise RuntimeError(f"{command[0]} ended with {done.returncode}:\n{done.stdout[-800:]}\n{done.stderr[-800:]}")
    return done.stdout


def run_input(program, text, folder):
    """CPU seconds of LAMMPS or LIGGGHTS between the lines `shell sh stamp.sh begin` and `... end` of an input, and the output."""
    folder = Path(folder)
    (folder / "stamp.sh").write_text(STAMP)
    script = folder / f"in.{program}"
    script.write_text(text)
    for mark in ("begin", "end"):
        (folder / f"stamp.{mark}").unlink(missing_ok=True)
    output = call([program, "-in", script.name], folder)
    begin, end = (int((folder / f"stamp.{mark}").read_text()) for mark in ("begin", "end"))
    return 1e-9 * (end - begin), output


def last_dump(path):
    """The last frame of a text dump: a dictionary of columns."""
    lines = Path(path).read_text().splitlines()
    at = max(k for k, line in enumerate(lines) if line.startswith("ITEM: ATOMS"))
    names = lines[at].split()[2:]
    return dict(zip(names, np.array([line.split() for line in lines[at + 1 :]], dtype=float).T, strict=True))


def rows_of(text, word="result"):
    """Numbers behind a word at the beginning of lines, a list for each line."""
    return [[float(x) for x in line.split()[1:]] for line in text.splitlines() if line.split()[:1] == [word]]


def ratio(ours, theirs):
    """Median over rounds of their time over ours of the same round, and the least and the most."""
    shares = np.asarray(theirs, dtype=float) / np.asarray(ours, dtype=float)
    return float(np.median(shares)), float(shares.min()), float(shares.max())
