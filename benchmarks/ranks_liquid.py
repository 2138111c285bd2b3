"""CPU of Cairn's own code in each process of MPI that shares a liquid, over that of one process without ranks.

    python benchmarks/ranks_liquid.py [--processes 2 4] [--spacing 0.05] [--steps 20]

A block of water of 1 m x .5 m x 1 m breaks in a tank of 2 m, with two spheres of wood, one thread a process. CPU is counted by
samples of perf within Cairn's module, without what MPI waits and Python: processes may be more than cores, and other programs
may run. Bytes are those that rank 0 sends in a step. Needs perf and mpirun. Writes benchmarks/results/ranks_liquid.csv.
"""

import argparse
import csv
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = "1"
FORMS = ("weakly compressible", "incompressible")
COLUMNS = ("form", "particles", "processes", "rank", "samples", "over one process", "bytes of a rank and step", "imbalance")


def flow(form, spacing, steps, ranks):
    """Runs the flow, and prints the number of particles, bytes and imbalance on rank 0."""
    import cairn as cn
    import numpy as np

    rock, wood = cn.Material("rock", density=2600.0), cn.Material("wood", density=500.0)
    scene = cn.Scene(dim=3, gravity=(0.0, 0.0, -9.81))
    scene.add(cn.wall((0, 0, 0), (0, 0, 1), rock))
    for way, long in zip(np.eye(3), (2.0, 0.5)):
        scene.add(cn.wall((0, 0, 0), way, rock), cn.wall(long * way, -way, rock))
    scene.add(cn.spheres([(1.4, 0.25, 0.2), (0.5, 0.25, 1.15)], 0.18, wood))
    scene.add(cn.fluid([(0, 0, 0), (1.0, 0.5, 1.0)], spacing, incompressible=form == FORMS[1]))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, dt=4e-3 if form == FORMS[1] else 2e-3, ranks=ranks)
    for _ in range(steps):
        sim.step()
    told = sim.ranks.figures() if ranks else {"message_bytes": 0, "liquid_imbalance": 1.0}
    if not ranks or sim.ranks.first:
        print(len(sim.fluid), told["message_bytes"], told["liquid_imbalance"])


def samples(path):
    """Samples within Cairn's module."""
    told = subprocess.run(["perf", "report", "-i", path, "--no-children", "--sort", "dso", "-n"], capture_output=True, text=True,
                          check=True).stdout  # fmt: skip
    return sum(int(line.split()[1]) for line in told.splitlines() if "_core" in line and not line.startswith("#"))


def measured(form, processes, arguments, folder):
    """Samples of each process, particles and figures."""
    own = [sys.executable, __file__, "--one", form, "--spacing", str(arguments.spacing), "--steps", str(arguments.steps)]
    perf = f'exec perf record -q -e task-clock:u -F 2000 -o {folder}/${{OMPI_COMM_WORLD_RANK:-0}}.data "$@"'
    command = ["sh", "-c", perf, "perf", *own, "--ranks", "mpi" if processes > 1 else ""]
    if processes > 1:
        command = ["mpirun", "--oversubscribe", "-n", str(processes), *command]
    told = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()[-1].split()
    return [samples(f"{folder}/{rank}.data") for rank in range(processes)], int(told[0]), float(told[1]), float(told[2])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--processes", type=int, nargs="*", default=[2, 4])
    parser.add_argument("--spacing", type=float, default=0.05)
    parser.add_argument("--steps", type=int, default=20)
    parser.add_argument("--one", choices=FORMS, help="run the flow alone")
    parser.add_argument("--ranks", default="")
    arguments = parser.parse_args()
    if arguments.one:
        flow(arguments.one, arguments.spacing, arguments.steps, arguments.ranks or None)
        return
    if not (shutil.which("perf") and shutil.which("mpirun")):
        sys.exit("perf and mpirun are needed: install linux-perf and openmpi-bin")
    with open(Path(__file__).parent / "results" / "ranks_liquid.csv", "w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(COLUMNS)
        for form in FORMS:
            alone = 1
            for processes in (1, *arguments.processes):
                with tempfile.TemporaryDirectory() as folder:
                    found, particles, sent, imbalance = measured(form, processes, arguments, folder)
                alone = found[0] if processes == 1 else alone
                for rank, many in enumerate(found):
                    row = [form, particles, processes, rank, many, f"{many / alone:.3f}", int(sent), f"{imbalance:.3f}"]
                    table.writerow(row)
                    print(*row, flush=True)


if __name__ == "__main__":
    main()
