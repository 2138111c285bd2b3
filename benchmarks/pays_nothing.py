"""Overhead of unused features in scenes of disks, spheres and linear meshes: two commits measured side by side in a run.

    script/bench pays_nothing [--before COMMIT] [--after HEAD] [--count 4000] [--pairs 200] [--builds FOLDER] [--cases CASE ...]

`before` is the last commit before the restructuring; for `meshes`, four blocks of Q4 or two of HEX8 on a plane and on each other,
the last before Newton's method and materials of solids. Both commits are built with the release preset. Then a process of each
takes turns with the other, a few steps at a time on the same scene with a fixed number of sweeps: pairs of CPU times a step that
stand a fraction of a second apart, and seconds of the stages.
`one_sweep` is a step with a single sweep, hence everything but the solver. Bytes are by Cairn's own count (of meshes a
node) and by the growth of the process; `import` is `import cairn`, a process each time.
Writes benchmarks/results/pays_nothing.csv: a row for a scene and quantity, medians of both commits, the median of the ratios of
pairs and its 95 % interval (2,000 samples with replacement).
"""

import argparse
import csv
import json
import os
import random
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SWEEPS = 20
CASES = ("import", "disks", "disks one_sweep", "spheres", "spheres one_sweep", "meshes Q4", "meshes HEX8")
BEFORE, BEFORE_SOLIDS = "91c23ba", "d2d1e4a"


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


def stacked(kind):
    """Linear blocks on a plane and on one another, after five steps; a step has a fixed number of sweeps."""
    import cairn as cn
    import numpy as np
    from meshes import ROCK, block

    dim, nodes, levels = (2, 400, 4) if kind == "Q4" else (3, 343, 2)
    down = np.eye(dim)[-1]
    scene = cn.Scene(dim, gravity=-9.81 * down)
    scene.add(*(block(kind, nodes, float(level), f"block {level}") for level in range(levels)))
    scene.add(cn.wall((0.0,) * dim, tuple(down), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    solver = cn.Default(tol=1e-15, max_iter=SWEEPS, min_iter=SWEEPS)
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(solver=solver), overlap="ignore")
    for _ in range(5):
        sim.step()
    return sim


def serve(case, count, steps):
    """In a process of its own: answers each line of input with a line of JSON."""
    begin, bytes_before = time.process_time(), resident()
    import cairn  # noqa: F401

    result = {"import_seconds": time.process_time() - begin, "import_megabytes": (resident() - bytes_before) / 1e6}
    print(json.dumps(result), flush=True)
    if case == "import":
        return
    scene, _, kind = case.partition(" ")
    before = resident()
    if scene == "meshes":
        sim = stacked(kind)
    else:
        from scenes import deposit

        sweeps = 1 if kind else SWEEPS
        sim = deposit(scene, count, tol=1e-15, max_iter=sweeps, min_iter=sweeps, steps=5)
    bodies, of_contacts = (sim if hasattr(sim, "_core") else sim.raw)._core.bytes()  # where the core stood has changed
    contacts = len(sim.contacts)
    # nodes stood among the bodies once
    carriers = sum(len(mesh.displacement) for mesh in sim.meshes) if scene == "meshes" else len(sim.bodies)
    result = {"contacts": contacts, "bytes_a_body": bodies / carriers, "bytes_a_contact": of_contacts / contacts}
    print(json.dumps(result | {"process_growth_bytes_a_body": (resident() - before) / carriers}), flush=True)
    for _ in sys.stdin:
        stages, begin, solved = dict(sim.info["seconds"]), time.process_time(), 0
        for _ in range(steps):
            solved += sim.step()["contacts"]
        spent = {"step": time.process_time() - begin}
        spent |= {name: seconds - stages.get(name, 0) for name, seconds in sim.info["seconds"].items()}
        print(json.dumps({name: 1e6 * seconds / solved for name, seconds in spent.items()}), flush=True)


def started(python, case, options):
    """The process that serves a case with the package of `python`."""
    command = [sys.executable, str(Path(__file__)), "--serve", case, "--count", str(options.count), "--steps", str(options.steps)]
    environment = os.environ | {"PYTHONPATH": str(python), "OMP_NUM_THREADS": "1"}
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment)


def told(process):
    return json.loads(process.stdout.readline())


def imports(pythons, options):
    """Pairs of what `import cairn` takes."""
    runs = [[], []]
    for _ in range(options.imports):
        for python, mine in zip(pythons, runs, strict=True):
            process = started(python, "import", options)
            mine.append(told(process))
            process.communicate()
    return runs


def turns(pythons, case, options):
    """Pairs of what a few steps take, and of bytes: the two processes take turns, first the one and then the other first."""
    both = [started(python, case, options) for python in pythons]
    for process in both:
        told(process)
    held, runs = [told(process) for process in both], [[], []]
    for pair in range(options.pairs):
        for k in ((0, 1), (1, 0))[pair % 2]:
            both[k].stdin.write("\n")
            both[k].stdin.flush()
            runs[k].append(told(both[k]))
    for process in both:
        process.communicate()
    return [[one] for one in held], runs


def row_of(scene, quantity, before, after, chance):
    """Medians, the median of paired ratios, and its 95 % interval."""
    ratios = [b / a for a, b in zip(before, after, strict=True) if a > 0]
    samples = sorted(statistics.median(chance.choices(ratios, k=len(ratios))) for _ in range(2000))
    return {"scene": scene, "quantity": quantity, "before": statistics.median(before), "after": statistics.median(after),
            "ratio": statistics.median(ratios), "low": samples[49], "high": samples[1950], "pairs": len(ratios)}


def hash_of(commit):
    """Abbreviated hash of a commit."""
    command = ["git", "-C", str(ROOT), "rev-parse", "--short", commit]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--before", help=f"{BEFORE}, of meshes {BEFORE_SOLIDS}, unless another is given")
    parser.add_argument("--after", default="HEAD")
    parser.add_argument("--count", type=int, default=4000)
    parser.add_argument("--steps", type=int, default=5, help="of a turn")
    parser.add_argument("--pairs", type=int, default=200)
    parser.add_argument("--imports", type=int, default=15)
    parser.add_argument("--cases", nargs="+", choices=CASES, default=CASES, help="all, if none is named")
    parser.add_argument("--builds", type=Path, help="where builds are kept, or are found")
    parser.add_argument("--output", type=Path, default=ROOT / "benchmarks" / "results" / "pays_nothing.csv")
    parser.add_argument("--serve", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.serve:
        serve(options.serve, options.count, options.steps)
        return
    rows, chance, after_all = [], random.Random(1), hash_of(options.after)
    with tempfile.TemporaryDirectory() as folder:
        for case in options.cases:
            before = options.before or (BEFORE_SOLIDS if case.startswith("meshes") else BEFORE)
            commits = [hash_of(before), after_all]
            pythons = [build(commit, options.builds or Path(folder)) for commit in commits]
            groups = [imports(pythons, options)] if case == "import" else turns(pythons, case, options)
            for before, after in groups:
                for name in before[0]:
                    if not all(name in one for one in after):
                        continue
                    unit = "_microseconds_a_contact" if before is not groups[0][0] else ""
                    row = row_of(case, name + unit, [r[name] for r in before], [r[name] for r in after], chance)
                    values = {k: v if isinstance(v, (str, int)) else f"{v:.4g}" for k, v in row.items()}
                    rows.append({"commit_before": commits[0], "commit_after": commits[1]} | values)
        with open(options.output, "w", newline="") as file:
            writer = csv.DictWriter(file, list(rows[0]))
            writer.writeheader()
            writer.writerows(rows)
        for row in rows:
            print(*row.values(), sep=",")


if __name__ == "__main__":
    main()
