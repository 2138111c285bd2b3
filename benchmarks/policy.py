"""Numbers of cxx/solvers/policy.def, each halved and doubled: how far the work of solvers moves.

    python benchmarks/policy.py              all numbers, a row each
    python benchmarks/policy.py NAME...      these alone: rows of others stay
    python benchmarks/policy.py --page       the table of docs/policy.md anew, from the list and the CSV

Cases are steps and problems from common states. A variant runs in a process of its own, where CAIRN_POLICY gives the number.
Cases with the bits of the table's values count as 1; of the others CPU seconds (the least of two runs) are divided by those of
the table's values, and the geometric mean over all cases is written, beside that of iterations and the number of cases that
changed or ended with another status. Writes benchmarks/results/policy.csv.
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
from auto import cubes, panel, sim_of
from stacks import stack
from sweeps import grains

HERE = Path(__file__).resolve().parent
LIST = HERE.parent / "cxx/solvers/policy.def"
PAGE = HERE.parent / "docs/policy.md"
RESULTS = HERE / "results/policy.csv"
ROW = re.compile(r'^CAIRN_POLICY\((.*?), (\w+), (.*?), "(.*?)", "(.*?)", "(.*?)"\)', re.M)
WAYS = {"half": 0.5, "double": 2.0}


def listed():
    """[(name, value as the list has it, unit, what it steers, source)]."""
    return [row[1:] for row in ROW.findall(LIST.read_text(encoding="utf-8"))]


def number(text):
    return float.fromhex(text) if text.startswith("0x") else float(text)


def bonded(rows=3, columns=24):
    """A cantilever of bonded disks that begins to bend under its weight."""
    stone, r, stiffness = cn.Material("stone", density=2500.0), 0.01, 5e10
    x = np.array([[2 * r * i, 2 * r * j] for i in range(columns) for j in range(rows)])
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.disks(x[:rows], 0.999 * r, stone, driven=("vx", "vy", "w")), cn.disks(x[rows:], 0.999 * r, stone))
    law = cn.ParallelBond(normal_stiffness=stiffness, tangential_stiffness=stiffness, mu=0.3, within=3e-3 * r)
    scene.interact(stone, stone, law)
    return sim_of(scene, 1e-3, 1.0)


def scenes():
    """name -> (a simulation, steps that bring it to its state)."""
    return {
        "disks": (sim_of(grains(2, 200, 1), 5e-4), 40),
        "spheres": (sim_of(grains(3, 150, 1), 5e-4), 40),
        "cubes": (cubes(60, 1), 40),
        "pentagons": (sim_of(grains(2, 60, 1, shape="faced"), 1e-3), 50),
        "disks 1e4": (sim_of(grains(2, 150, 1, ratio=1e4), 5e-4), 30),
        "spheres 1e4": (sim_of(grains(3, 120, 1, ratio=1e4), 5e-4), 30),
        "tower": (stack("boxes", 40, 1.0, cn.Auto())[0], 1),
        "panel": (panel(6, 10, 0.35), 1),
        "bonded disks": (bonded(), 1),
    }


def cases(sims):
    """name -> (scene, settings of its steps, their number), or the tolerance of a problem."""
    cold = {"warm_start": False}
    step = {
        "disks, NLGS 1e-6": ("disks", {"solver": cn.NLGS(tol=1e-6, max_iter=500)}, 2),
        "disks, Auto 1e-6": ("disks", {"solver": cn.Auto(tol=1e-6)}, 2),
        "disks, plain": ("disks", {"solver": cn.NLGS(tol=1e-5, max_iter=500, acceleration="none")} | cold, 1),
        "disks, from nothing": ("disks", {"solver": cn.NLGS(tol=1e-4, associated_start=True)} | cold, 1),
        "disks, accuracy": ("disks", {"solver": cn.NLGS(tol=1e-4, max_iter=400), "accuracy": 1e-2}, 1),
        "spheres, NLGS 1e-5": ("spheres", {"solver": cn.NLGS(tol=1e-5, max_iter=500)} | cold, 1),
        "spheres, Auto 1e-5": ("spheres", {"solver": cn.Auto(tol=1e-5)}, 1),
        "cubes, NLGS 1e-4": ("cubes", {"solver": cn.NLGS(tol=1e-4, max_iter=300)} | cold, 1),
        "cubes, Auto 1e-4": ("cubes", {"solver": cn.Auto(tol=1e-4)} | cold, 1),
        "cubes, Auto 1e-8": ("cubes", {"solver": cn.Auto(tol=1e-8)}, 3),
        "cubes, pack": ("cubes", {"solver": cn.Auto(tol=1e-6, enough=1e-2, patience=20)} | cold, 2),
        "pentagons, Auto 1e-5": ("pentagons", {"solver": cn.Auto(tol=1e-5)}, 3),
        "disks 1e4, Auto 1e-5": ("disks 1e4", {"solver": cn.Auto(tol=1e-5, max_iter=300)} | cold, 1),
        "spheres 1e4, Auto 1e-4": ("spheres 1e4", {"solver": cn.Auto(tol=1e-4, max_iter=40)}, 1),
        "tower, Auto 1e-6": ("tower", {"solver": cn.Auto(tol=1e-6)} | cold, 1),
        "panel, Auto 1e-5": ("panel", {"solver": cn.Auto(tol=1e-5)} | cold, 2),
        "bonded disks, Auto 1e-6": ("bonded disks", {"solver": cn.Auto(tol=1e-6)} | cold, 1),
        "bonded disks, NLGS 1e-4": ("bonded disks", {"solver": cn.NLGS(tol=1e-4, max_iter=300)}, 1),
    }
    problem = {f"problem of {name}": (name, 1e-6) for name in ("cubes", "panel", "disks 1e4")}
    return {**step, **{name: given for name, given in problem.items() if given[0] in sims}}


def run(sim, state, given):
    """(CPU seconds, iterations, statuses, digest of velocities or impulses) of a case."""
    sim.restore(state)
    digest, ends, iterations = hashlib.sha256(), [], 0
    if len(given) == 2:
        sim.strategy = cn.NSCD(theta=sim.strategy.theta, threads=1, solver=cn.NLGS(max_iter=1))
        sim.step()  # whose contacts are the problem
        problem = sim.problem()
        before = time.process_time()
        found = problem.solve("auto", tol=given[1], max_iter=400)
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
    return spent, iterations, " ".join(ends), digest.hexdigest()


def apart(work, change=""):
    """What work() returns, in a process of its own that reads the changed numbers when it first solves."""
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
    """{case: (seconds, iterations, statuses, digest)}; cases with the digests of `same` run once."""

    def work():
        out = {}
        for name, given in cases(sims).items():
            state = folder / f"{given[0]}.h5"
            out[name] = run(sims[given[0]][0], state, given)
            for _ in range(repeats - 1 if same is None or same[name][3] != out[name][3] else 0):
                out[name] = min(out[name], run(sims[given[0]][0], state, given))
        return out

    return apart(work, change)


def compare(base, found):
    """(mean of CPU, mean of iterations, changed cases, cases of another status)."""
    changed = [name for name in base if base[name][3] != found[name][3]]
    cpu = sum(np.log(found[name][0] / base[name][0]) for name in changed)
    iterations = sum(np.log(max(found[name][1], 1) / max(base[name][1], 1)) for name in changed)
    other = sum(base[name][2] != found[name][2] for name in changed)
    return np.exp(cpu / len(base)), np.exp(iterations / len(base)), len(changed), other


def rows(names, folder):
    sims = scenes()
    if not (folder / "panel.h5").exists():
        apart(lambda: prepare(sims, folder))
    base = measure(sims, folder, repeats=3)
    values = {name: text for name, text, *_ in listed()}
    for name in names or values:
        text = values[name]
        row = {"name": name, "value": text, "cases": len(base)}
        for way, factor in WAYS.items():
            again = measure(sims, folder, f"{name}={float(number(text) * factor)!r}", base)
            cpu, iterations, changed, other = compare(base, again)
            row |= {f"CPU {way}": f"{cpu:.3f}", f"iterations {way}": f"{iterations:.3f}", f"changed {way}": changed,
                    f"other status {way}": other}  # fmt: skip
        yield row


def known(path=RESULTS):
    if not path.exists():
        return {}
    with path.open(newline="", encoding="utf-8") as file:
        return {row["name"]: row for row in csv.DictReader(file)}


def table():
    """The lines of the table of docs/policy.md."""
    rows = known()
    out = ["| name | value | unit | what it steers | fixed by | half | double |", "|---|---|---|---|---|---|---|"]
    for name, value, unit, steers, source in listed():
        moved = [
            "{}, {} ({})".format(*(rows[name][f"{what} {way}"] for what in ("CPU", "iterations", "changed")))
            if name in rows
            else "not varied"
            for way in WAYS
        ]
        out.append(f"| `{name}` | {value} | {unit} | {steers} | {source} | {' | '.join(moved)} |")
    return out


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
        for row in rows(options.names, options.states or Path(folder)):
            found[row["name"]] = row
            print(row, flush=True)
            with options.results.open("w", newline="", encoding="utf-8") as file:
                writer = csv.DictWriter(file, list(row))
                writer.writeheader()
                writer.writerows(found[name] for name, *_ in listed() if name in found)


if __name__ == "__main__":
    main()
