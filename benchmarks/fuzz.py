"""Damaged files of every kind: refused, read, or a crash.

    script/bench fuzz [--inputs 20000] [--kinds NAME ...] [--batch 500] [--log FILE]

A line a kind: inputs, refused (cairn.FileError), read, raw errors, results that are no number, crashes, hangs (over 20 s), CPU
seconds. Each batch runs in a process of its own, so that a crash costs one input: it is counted, and the next begins behind it.
Other outcomes than "refused" and "read" are reported on the standard error with the seed that reproduces the input.
"""

import argparse
import csv
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = "1"
sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
MOST_SECONDS = 20
BAD = ("raw error", "no number", "crash", "hang")


def batch(name, first, last, folder):
    """Lines of JSON on the standard output: before each input its seed, after it its outcome."""
    from fuzz.kinds import KINDS, tried

    kind = next(k for k in KINDS if k.name == name)
    begun = lambda seed, what: print(json.dumps({"begun": seed, "what": what}), flush=True)  # noqa: E731
    for seed, what, outcome, detail in tried(kind, folder, range(first, last), begun):
        print(json.dumps({"seed": seed, "what": what, "outcome": outcome, "detail": detail}), flush=True)


def run_batch(name, first, last, counts, say):
    """Counts the outcomes of seeds first to last; returns the seed to continue with."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-W", "ignore", __file__, "--batch-of", name, str(first), str(last), folder]
        child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        os.set_blocking(child.stdout.fileno(), False)
        text, begun, done, heard = b"", None, first, time.monotonic()
        while True:
            new = child.stdout.read()  # None: nothing yet
            if new:
                heard, text = time.monotonic(), text + new
                *lines, text = text.split(b"\n")
                for line in map(json.loads, filter(None, lines)):
                    if "begun" in line:
                        begun = line
                        continue
                    counts[line["outcome"]] += 1
                    done, begun = line["seed"] + 1, None
                    if line["outcome"] in BAD:
                        say(name, line)
            elif child.poll() is not None:
                break
            elif begun and time.monotonic() - heard > MOST_SECONDS:
                child.kill()
                child.wait()
                counts["hang"] += 1
                say(name, begun | {"outcome": "hang"})
                return begun["begun"] + 1
            else:
                time.sleep(0.005)
        if child.returncode and begun:
            counts["crash"] += 1
            say(name, begun | {"outcome": f"crash, ended with {child.returncode}"})
            return begun["begun"] + 1
        if child.returncode:
            raise SystemExit(f"{name}: the batch from {first} on ended with {child.returncode}")
        return done


def tell(name, line):
    print(name, json.dumps(line), file=sys.stderr, flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--inputs", type=int, default=20000)
    parser.add_argument("--kinds", nargs="*")
    parser.add_argument("--batch", type=int, default=500)
    parser.add_argument("--batch-of", nargs=4, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.batch_of:
        name, first, last, folder = options.batch_of
        return batch(name, int(first), int(last), folder)
    from fuzz.kinds import KINDS

    columns = ["kind", "inputs", "refused", "read", "raw error", "no number", "crash", "hang", "cpu_seconds"]
    table = csv.DictWriter(sys.stdout, columns, lineterminator="\n")
    table.writeheader()
    for kind in KINDS:
        if options.kinds and kind.name not in options.kinds:
            continue
        counts, at, spent = dict.fromkeys(columns[2:8], 0), 0, sum(os.times()[2:4])
        inputs = int(options.inputs * kind.share)
        while at < inputs:
            last = min(at + options.batch, inputs)
            at = run_batch(kind.name, at, last, counts, tell)
        spent = sum(os.times()[2:4]) - spent
        table.writerow({"kind": kind.name, "inputs": inputs, **counts, "cpu_seconds": f"{spent:.1f}"})
        sys.stdout.flush()


if __name__ == "__main__":
    main()
