"""Memory of a process that shares a scene from a file with others, beside one that has it alone.

    script/bench ranks_memory [--bodies 20000 200000] [--steps 3] [--processes 1 2 4 8] [--csv FILE]

A row for each way to load (whole, or arrays that stay in the file) and number of processes: memory of its own [bytes a body of
the scene] that the largest process has after Scene.load, after Simulation, at most until the end of the run, and at the end; what
Python and MPI take before is left out, and so are pages of the file, which all processes of a machine share.
"""

import argparse
import csv
import json
import os
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

PAGE = os.sysconf("SC_PAGESIZE")
COLUMNS = ("load", "processes", "bodies", "after_load", "after_simulation", "most", "at_end")


def own_bytes():
    """Memory of this process that no file holds [bytes]."""
    resident, shared = Path("/proc/self/statm").read_text().split()[1:3]
    return (int(resident) - int(shared)) * PAGE


class Highest:
    """Most memory that a process has while this watches it, looked at a thousand times a second."""

    def __init__(self):
        self.bytes, self._ended = own_bytes(), threading.Event()
        threading.Thread(target=self._watch, daemon=True).start()

    def _watch(self):
        while not self._ended.wait(1e-3):
            self.bytes = max(self.bytes, own_bytes())


def written(path, n):
    """A box of spheres in a file; returns the number of its bodies."""
    import cairn as cn
    from ranks_cost import box

    scene = box(3, n, cn.Coulomb(mu=0.4))
    scene.save(path)
    return scene.count


def measured(path, way, steps, out):
    """Loads a scene in this process, runs it, and writes the memory of the process to a file."""
    import cairn as cn
    from cairn.base.open_ranks import library

    cn._core.mpi_ranks(library(), None)  # its memory is there before
    before, highest, told = own_bytes(), Highest(), {}
    scene = cn.Scene.load(path, ranks="mpi" if way == "share" else None)
    told["after_load"] = own_bytes() - before
    ranks = None if way == "alone" else "mpi"
    sweeps = cn.NSCD(solver=cn.NLGS(tol=1e-4, max_iter=20), threads=1)
    sim = cn.Simulation(scene, 1e-3, sweeps, overlap="ignore", ranks=ranks)
    told["after_simulation"] = own_bytes() - before
    sim.run(steps, progress=False, callback=lambda s: told.update(at_end=own_bytes() - before))
    told["most"] = highest.bytes - before
    rank = 0 if ranks is None else sim.ranks.rank
    Path(out, f"{rank}.json").write_text(json.dumps(told))


def row(path, way, processes, bodies, steps):
    """Memory of the largest of some processes [bytes a body]."""
    with tempfile.TemporaryDirectory() as out:
        words = [sys.executable, __file__, "--measure", path, way, out, "--steps", str(steps)]
        start = ["mpirun", "--oversubscribe", "-n", str(processes)]
        subprocess.run(start + words, check=True, env={**os.environ, "OMP_NUM_THREADS": "1"})
        told = [json.loads(file.read_text()) for file in Path(out).glob("*.json")]
    most = {name: round(max(of[name] for of in told) / bodies, 1) for name in COLUMNS[3:]}
    return {"load": way, "processes": processes, "bodies": bodies, **most}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bodies", type=int, nargs="+", default=[20_000, 200_000])
    parser.add_argument("--steps", type=int, default=3)
    parser.add_argument("--processes", type=int, nargs="+", default=[1, 2, 4, 8])
    parser.add_argument("--csv", default=str(Path(__file__).parent / "results" / "ranks_memory.csv"))
    parser.add_argument("--measure", nargs=3, metavar=("SCENE", "WAY", "FOLDER"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.measure:
        return measured(options.measure[0], options.measure[1], options.steps, options.measure[2])
    with tempfile.TemporaryDirectory() as folder, open(options.csv, "w", newline="") as file:
        path = str(Path(folder, "box.scene.h5"))
        table = csv.DictWriter(file, COLUMNS)
        table.writeheader()
        for asked in options.bodies:
            bodies = written(path, asked)
            for way, processes in [("alone", 1)] + [(way, p) for p in options.processes for way in ("whole", "share")]:
                of = row(path, way, processes, bodies, options.steps)
                table.writerow(of)
                file.flush()
                print(", ".join(f"{name} {value}" for name, value in of.items()), flush=True)


if __name__ == "__main__":
    main()
