"""Numbers of cxx/solvers/policy.def, each halved and doubled: how far the work of solvers moves.

    python benchmarks/policy.py              all numbers, a row each
    python benchmarks/policy.py NAME...      these alone: rows of others stay
    python benchmarks/policy.py --page       the table of docs/policy.md anew, from the list and the CSV

Cases are steps and problems from common states. A variant runs in a process of its own, where CAIRN_POLICY gives the number.
Cases with the bits of the table's values count as 1; of the others CPU seconds (the least of two runs) are divided by those of
the table's values, and the geometric mean over all cases is written, beside that of iterations, the number of cases that
changed or ended with another status, and the largest ratio of iterations of a case. Writes benchmarks/results/policy.csv, and
policy_cases.csv with a row for each case that changed.
"""

import argparse
import csv
import hashlib
import json
import os
import re
import tempfile
import time
import traceback
import warnings
from pathlib import Path

import cairn as cn
import numpy as np
from policy_scenes import LONG, SCENES, cases

HERE = Path(__file__).resolve().parent
LIST = HERE.parent / "cxx/solvers/policy.def"
PAGE = HERE.parent / "docs/policy.md"
RESULTS = HERE / "results/policy.csv"
ROW = re.compile(r'^CAIRN_POLICY\((.*?), (\w+), (.*?), "(.*?)", "(.*?)", "(.*?)"\)', re.M)
WAYS = {"half": 0.5, "double": 2.0}


def listed():
    """Rows of the list: [(name, value as written, unit, meaning, CSV that fixed the value)]."""
    return [row[1:] for row in ROW.findall(LIST.read_text(encoding="utf-8"))]


def number(text):
    return float.fromhex(text) if text.startswith("0x") else float(text)


def run(sim, state, given):
    """(CPU seconds, iterations, statuses, digest of velocities or impulses) of a case."""
    sim.restore(state)
    digest, ends, iterations = hashlib.sha256(), [], 0
    if len(given) == 2:
        sim.strategy = cn.NSCD(theta=sim.strategy.theta, threads=1, solver=cn.NLGS(max_iter=1))
        sim.step()  # whose contacts are the problem
        problem = sim.problem()
        before = time.process_time()
        found = problem.solve("auto", tol=given[1], max_iter=2000)
        spent = time.process_time() - before
        digest.update(np.ascontiguousarray(found.r).tobytes())
        return spent, int(found.iterations), str(found.status), digest.hexdigest()
    sim.strategy = cn.NSCD(theta=sim.strategy.theta, threads=1, **given[1])
    before = time.process_time()
    for _ in range(given[2]):
        info = sim.step()
        ends.append(info["status"])
        iterations += info["iterations"]
    spent = time.process_time() - before
    digest.update(np.ascontiguousarray(sim.bodies.velocity).tobytes())
    statuses = " ".join(f"{ends.count(status)} {status}" for status in dict.fromkeys(ends))
    return spent, iterations, statuses, digest.hexdigest()


def apart(work, change=""):
    """Result of work() in a forked process, whose solver reads the changed numbers when it first solves."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(read)
        os.environ["CAIRN_POLICY"] = change
        try:
            text = json.dumps(work())
            with os.fdopen(write, "w") as out:
                out.write(text)
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(0)
    os.close(write)
    with os.fdopen(read) as told:
        text = told.read()
    if os.waitpid(child, 0)[1] != 0 or not text:
        raise RuntimeError(f"a run with {change or 'the values of the table'} ended without an answer")
    return json.loads(text)


def prepare(sims, folder):
    for name, (sim, steps) in sims.items():
        for _ in range(steps):
            sim.step()
        sim.checkpoint(folder / f"{name}.h5")
    return True


def measure(sims, folder, change="", same=None, repeats=2):
    """{case: (seconds, iterations, statuses, digest)} of the cases of `same`, all by default; unchanged or long ones run once."""

    def work():
        out = {}
        for name, given in cases().items():
            if same is not None and name not in same:
                continue
            state = folder / f"{given[0]}.h5"
            out[name] = run(sims[given[0]][0], state, given)
            again = (same is None or differs(same[name], out[name])) and out[name][0] < 0.1
            for _ in range(repeats - 1 if again else 0):
                out[name] = min(out[name], run(sims[given[0]][0], state, given))
        return out

    return apart(work, change)


def differs(one, other):
    """True if a case took another number of iterations, ended with another status or with other bits."""
    return one[1:] != list(other[1:])


def compare(base, found):
    """Columns of a row, and the changed cases [(case, CPU ratio, ratio of iterations, statuses before and after)]."""
    changed = [
        (name, found[name][0] / base[name][0], max(found[name][1], 1) / max(base[name][1], 1), base[name][2], found[name][2])
        for name in base
        if differs(base[name], found[name])
    ]
    mean = [float(np.exp(sum(np.log(case[k]) for case in changed) / len(base))) for k in (1, 2)]
    most = max(changed, key=lambda case: abs(np.log(case[2])), default=("none", 1.0, 1.0))
    columns = {
        "CPU": f"{mean[0]:.3f}", "iterations": f"{mean[1]:.3f}", "changed": len(changed),
        "other status": sum(case[3] != case[4] for case in changed), "most iterations": f"{most[2]:.3g}", "most of": most[0],
    }  # fmt: skip
    return columns, changed


def rows(names, folder):
    """(row of a number, its changed cases) for each of the names."""
    sims = {name: (make(), steps) for name, (make, steps) in SCENES.items()}
    missing = {name: sim for name, sim in sims.items() if not (folder / f"{name}.h5").exists()}
    if missing:
        apart(lambda: prepare(missing, folder))
    base = measure(sims, folder, repeats=3)
    values = {name: text for name, text, *_ in listed()}
    for name in names or values:
        text = values[name]
        own = {case: found for case, found in base.items() if name in LONG.get(case, (name,))}
        row, changed = {"name": name, "value": text, "cases": len(own)}, []
        for way, factor in WAYS.items():
            again = measure(sims, folder, f"{name}={float(number(text) * factor)!r}", own)
            columns, cases_of = compare(own, again)
            row |= {f"{key} {way}": value for key, value in columns.items()}
            changed += [(name, way, case[0], f"{case[1]:.3g}", f"{case[2]:.3g}", *case[3:]) for case in cases_of]
        yield row, changed


def known(path=RESULTS):
    if not path.exists():
        return {}
    with path.open(newline="", encoding="utf-8") as file:
        return {row["name"]: row for row in csv.DictReader(file)}


def keep_cases(path, name, changed):
    """Replaces the rows of a number in the CSV of changed cases."""
    lines = []
    if path.exists():
        with path.open(newline="", encoding="utf-8") as file:
            lines = [line for line in list(csv.reader(file))[1:] if line[0] != name]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["name", "way", "case", "CPU", "iterations", "status before", "status after"])
        writer.writerows([*lines, *changed])


def table():
    """The lines of the table of docs/policy.md."""
    rows = known()
    out = ["| name | value | unit | effect | fixed by | half | double |", "|---|---|---|---|---|---|---|"]
    for name, value, unit, steers, source in listed():
        moved = [moved_by(rows[name], way) if name in rows else "not varied" for way in WAYS]
        out.append(f"| `{name}` | {value} | {unit} | {steers} | {source} | {' | '.join(moved)} |")
    return out


def moved_by(row, way):
    """CPU, iterations (changed cases; largest ratio of iterations), as far as the row has them."""
    most = row.get(f"most iterations {way}")
    cases_of = "; ".join(filter(None, (row[f"changed {way}"], most)))
    return f"{row[f'CPU {way}']}, {row[f'iterations {way}']} ({cases_of})"


def write_page():
    text = PAGE.read_text(encoding="utf-8")
    head = text[: text.index("| name | value |")]
    PAGE.write_text(head + "\n".join(table()) + "\n", encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--page", action="store_true")
    parser.add_argument("--results", type=Path, default=RESULTS)
    parser.add_argument("--states", type=Path, help="folder that keeps the states, for further calls")
    options = parser.parse_args()
    if options.page:
        return write_page()
    warnings.simplefilter("ignore")
    found = known(options.results)
    with tempfile.TemporaryDirectory() as folder:
        if options.states:
            options.states.mkdir(parents=True, exist_ok=True)
        for row, changed in rows(options.names, options.states or Path(folder)):
            found[row["name"]] = row
            print(row, flush=True)
            keep_cases(options.results.with_stem(options.results.stem + "_cases"), row["name"], changed)
            with options.results.open("w", newline="", encoding="utf-8") as file:
                writer = csv.DictWriter(file, list(row), restval="", extrasaction="ignore")
                writer.writeheader()
                writer.writerows(found[name] for name, *_ in listed() if name in found)


if __name__ == "__main__":
    main()
