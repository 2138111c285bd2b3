"""Every DATBOX folder below some folders, read and run for a few steps: python legacy_shelf.py FOLDER [FOLDER ...].

For LMGC90's own examples: its sources (folders `examples` and `test`), after each `gen_sample.py` there was run with LMGC90's
pre-processor. Folders whose BODIES.DAT is larger than --largest are left out and said so; each of the others runs in a process
of its own. Outcomes: `runs`, each step to the tolerance; `ends`, steps that did not; `refused`, by an error of
Cairn or any ValueError, whose text is the reason; `raw`, any other error. Time step and theta are those of the command.py
beside, else 1e-4 s and 0.5. Writes benchmarks/results/legacy_shelf.csv.
"""

import argparse
import csv
import json
import re
import subprocess
import sys
import warnings
from pathlib import Path

NAMES = ["folder", "outcome", "bodies", "meshes", "contacts", "dt", "theta", "worst_error", "reason"]
LIMIT = 300  # time for a folder [s], beyond which it counts as raw


def setting(folder, names, default):
    """The number that the script beside a folder gives to the first of some names."""
    for script in sorted(folder.glob("command*.py")):
        for name in names:
            found = re.search(rf"^\s*{name}\s*=\s*([0-9.]+(?:[eEdD][-+]?\d+)?)", script.read_text(errors="replace"), re.M)
            if found and float(found[1].replace("d", "e").replace("D", "e")) > 0:
                return float(found[1].replace("d", "e").replace("D", "e"))
    return default


def run(folder, steps, light):
    """The row of a folder."""
    import cairn as cn

    warnings.simplefilter("ignore")
    dt, theta = setting(folder, ("dt", "DT"), 1e-4), setting(folder, ("theta", "THETA"), 0.5)
    row = {"dt": dt, "theta": theta}
    try:
        scene = cn.legacy.read_datbox(folder, light=light)
        row |= {"meshes": len(scene.legacy.datbox.meshes), "bodies": sum(len(s) for s in scene.sets if s.mesh is None)}
        nscd = cn.NSCD(max(0.5, min(theta, 1.0)), cn.Auto(), scene.legacy.alert or None)
        try:
            sim = cn.Simulation(scene, dt, nscd, overlap="ignore")
        except ValueError as error:
            if "SmoothDEM" not in str(error):  # laws of forces, as MD_JKRs, run under that alone
                raise
            sim, row["theta"] = cn.Simulation(scene, dt, cn.SmoothDEM(), overlap="ignore"), "SmoothDEM"
        infos = [sim.step() for _ in range(steps)]
    except (ValueError, cn.Error) as error:
        told = " ".join(str(error).replace(str(folder), "").split()).removeprefix("/DATBOX").strip("/: ")
        return row | {"outcome": "refused", "reason": told}
    row |= {"contacts": max(i["contacts"] for i in infos), "worst_error": f"{max(i.get('error', 0.0) for i in infos):.1e}"}
    left = sorted({str(i["status"]) for i in infos} - {"converged", "explicit"})
    return row | {"outcome": "ends" if left else "runs", "reason": " ".join(left)}


def in_a_process(folder, options):
    command = [sys.executable, __file__, str(folder), "--one", "--steps", str(options.steps), "--light", str(options.light)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT)
    except subprocess.TimeoutExpired:
        return {"outcome": "raw", "reason": f"takes more than {LIMIT} s"}
    if done.returncode == 0:
        return json.loads(done.stdout.splitlines()[-1])
    return {"outcome": "raw", "reason": (done.stderr.strip().splitlines() or [f"ended with {done.returncode}"])[-1]}


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path, nargs="+")
    parser.add_argument("--steps", type=int, default=3)
    parser.add_argument("--light", type=float, default=1e-3, help="density of meshes without one [kg/m3]")
    parser.add_argument("--largest", type=float, default=2e6, help="size of a BODIES.DAT beyond which a folder is left out")
    parser.add_argument("--output", type=Path, default=Path(__file__).parent / "results" / "legacy_shelf.csv")
    parser.add_argument("--one", action="store_true", help="one folder, its row as JSON")
    options = parser.parse_args()
    if options.one:
        print(json.dumps(run(options.folder[0], options.steps, options.light)))
        return
    with open(options.output, "w", newline="") as file:
        table = csv.DictWriter(file, NAMES, restval="", lineterminator="\n")
        table.writeheader()
        for top in options.folder:
            for bodies in sorted(top.rglob("DATBOX/BODIES.DAT")):
                folder = bodies.parent.parent
                left_out = bodies.stat().st_size > options.largest
                row = {"outcome": "left out", "reason": "large"} if left_out else in_a_process(folder, options)
                table.writerow({"folder": f"{top.name}/{folder.relative_to(top)}", **row | {"reason": row["reason"][:400]}})
                file.flush()
                print(folder.relative_to(top), row["outcome"], row["reason"][:150], flush=True)


if __name__ == "__main__":
    main()
