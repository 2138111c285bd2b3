"""Smooth DEM beside LIGGGHTS and YADE: CPU microseconds a particle and step, one thread, same machine, same time, same scene.

Dense spheres in a box (d 10 mm +-10 %, density 2500, E 1e7, nu .3, e .5, mu .5, dt 5e-5 s), at rest or with gravity tilted by 60
degrees. Each round runs the codes one after the other; what a code needs to start is taken away as the time of a short run. Needs
the packings in the folder CAIRN_REFERENCE_DATA, and liggghts and yade on the path; a code that is not there is left out.

    python benchmarks/smooth_dem.py [--rounds 3] [--steps 200] [--output benchmarks/results/smooth_dem.csv]
"""

import argparse
import csv
import gzip
import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

FOLDER = Path(os.environ.get("CAIRN_REFERENCE_DATA", Path(__file__).resolve().parents[1] / ".." / "shared")) / "scenes"
CASES = [("50k settled", "dense50k", 0.0), ("10k settled", "dense10k", 0.0), ("10k flowing", "dense10k", 60.0)]
DT, YOUNG, POISSON, RESTITUTION, FRICTION, DENSITY = 5e-5, 1e7, 0.3, 0.5, 0.5, 2500.0


def packing(name):
    """Centres and radii (n, 4) [m], and the width of their box, whose corner is at the origin."""
    with gzip.open(FOLDER / f"{name}.xyzr.gz") as file:
        grains = np.loadtxt(file)
    width = np.mean([(grains[:, k] - grains[:, 3]).min() + (grains[:, k] + grains[:, 3]).max() for k in (0, 1)])
    return grains, round(float(width), 3)


def gravity(angle):
    return 9.81 * np.array([np.sin(np.radians(angle)), 0.0, -np.cos(np.radians(angle))])


def run_cairn(name, angle, steps, energy):
    """CPU seconds of the steps and their contacts; called in a process of its own."""
    import time

    import cairn as cn

    grains, width = packing(name)
    rock = cn.Material("rock", density=DENSITY)
    scene = cn.Scene(3, gravity=gravity(angle))
    scene.add(cn.spheres(grains[:, :3], grains[:, 3], rock), cn.wall((0, 0, 0), (0, 0, 1), rock))
    for normal in ((1, 0, 0), (0, 1, 0)):
        scene.add(cn.wall((0, 0, 0), normal, rock), cn.wall((width, width, 0), -np.array(normal), rock))
    scene.interact(rock, rock, cn.HertzMindlin(young=YOUNG, poisson=POISSON, restitution=RESTITUTION, mu=FRICTION))
    sim = cn.Simulation(scene, DT, cn.SmoothDEM(threads=1, energy=energy), overlap="ignore")
    for _ in range(20):
        sim.step()
    start = time.process_time()
    for _ in range(steps):
        info = sim.step()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print("result", time.process_time() - start, info["contacts"], info["neighbour_lists"], round(peak))


LIGGGHTS = """atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
units si
read_data {data}
neighbor 0.001 bin
neigh_modify delay 0
fix m1 all property/global youngsModulus peratomtype {young}
fix m2 all property/global poissonsRatio peratomtype {poisson}
fix m3 all property/global coefficientRestitution peratomtypepair 1 {restitution}
fix m4 all property/global coefficientFriction peratomtypepair 1 {friction}
pair_style gran model hertz tangential history
pair_coeff * *
timestep {dt}
fix g all gravity 9.81 vector {gx} 0.0 {gz}
fix x0 all wall/gran model hertz tangential history primitive type 1 xplane 0.0
fix x1 all wall/gran model hertz tangential history primitive type 1 xplane {width}
fix y0 all wall/gran model hertz tangential history primitive type 1 yplane 0.0
fix y1 all wall/gran model hertz tangential history primitive type 1 yplane {width}
fix z0 all wall/gran model hertz tangential history primitive type 1 zplane 0.0
fix integrate all nve/sphere
thermo 1000
run {steps}
"""

YADE = """import gzip, resource, time
import numpy as np
from yade import *
grains = np.loadtxt("{data}")
rock = FrictMat(young={young}, poisson={poisson}, frictionAngle=np.arctan({friction}), density={density})
O.materials.append(rock)
O.bodies.append([utils.sphere(g[:3], g[3]) for g in grains])
O.bodies.append([utils.wall(p, axis=k, sense=0) for k, p in ((0, 0), (0, {width}), (1, 0), (1, {width}), (2, 0))])
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()]),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()],
        [Ip2_FrictMat_FrictMat_MindlinPhys(en={restitution}, es={restitution})],
        [Law2_ScGeom_MindlinPhys_Mindlin()],
    ),
    NewtonIntegrator(damping=0, gravity=({gx}, 0, {gz})),
]
O.dt = {dt}
O.run(20, True)
start = time.process_time()
O.run({steps}, True)
spent = time.process_time() - start
contacts = sum(1 for i in O.interactions if i.isReal)
print("result", spent, contacts, 0, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024, flush=True)
"""


def child(command, **options):
    """Output, CPU seconds and exit of a command on one thread."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        command, capture_output=True, text=True, env={**os.environ, "OMP_NUM_THREADS": "1"}, check=False, **options
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return done.stdout, spent, done


def result(text, done):
    for line in text.splitlines():
        if line.startswith("result"):
            return [float(word) for word in line.split()[1:]]
    raise RuntimeError(f"no result: {text[-500:]} {done.stderr[-500:]}")


def words(width, angle, steps, data):
    pull = gravity(angle)
    return {
        "data": data, "young": YOUNG, "poisson": POISSON, "restitution": RESTITUTION, "friction": FRICTION, "dt": DT,
        "density": DENSITY, "width": width, "steps": steps, "gx": pull[0], "gz": pull[2],
    }  # fmt: skip


def time_cairn(name, angle, steps, folder, energy):
    command = [sys.executable, __file__, "--child", name, str(angle), str(steps), str(int(energy))]
    text, _, done = child(command)
    return result(text, done)


def time_liggghts(name, angle, steps, folder):
    """The short run of 20 steps is taken away."""
    grains, width = packing(name)
    data = folder / f"{name}.data"
    rows = [f"{i + 1} 1 {2 * r} {DENSITY} {x} {y} {z}" for i, (x, y, z, r) in enumerate(grains)]
    top = 2 * grains[:, 2].max()
    box = f"-0.001 {width + 0.001} xlo xhi\n-0.001 {width + 0.001} ylo yhi\n-0.001 {top} zlo zhi"
    data.write_text(f"packing\n\n{len(rows)} atoms\n1 atom types\n{box}\n\nAtoms\n\n" + "\n".join(rows) + "\n")
    spent = []
    for count in (20, 20 + steps):
        script = folder / "in.liggghts"
        script.write_text(LIGGGHTS.format(**words(width, angle, count, data.name)))
        text, seconds, done = child(["liggghts", "-in", script.name], cwd=folder)
        if done.returncode:
            raise RuntimeError(text[-500:] + done.stderr[-500:])
        spent.append(seconds)
    return [spent[1] - spent[0], float("nan"), 0, 0]


def time_yade(name, angle, steps, folder):
    grains, width = packing(name)
    np.savetxt(folder / f"{name}.txt", grains)
    script = folder / "case.py"
    script.write_text(YADE.format(**words(width, angle, steps, f"{name}.txt")))
    text, _, done = child(["yade", "-n", "-x", "-j1", script.name], cwd=folder)
    return result(text, done)


def codes():
    found = {
        "cairn": lambda *a: time_cairn(*a, energy=False),
        "cairn with energies": lambda *a: time_cairn(*a, energy=True),
    }
    if shutil.which("liggghts"):
        found["liggghts 3.8"] = time_liggghts
    if shutil.which("yade"):
        found["yade 2023.02a"] = time_yade
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--steps", type=int, default=200)
    parser.add_argument("--cases", default=",".join(case for case, _, _ in CASES))
    parser.add_argument("--output", type=Path)
    parser.add_argument("--child", nargs=4)
    given = parser.parse_args()
    if given.child:
        name, angle, steps, energy = given.child
        run_cairn(name, float(angle), int(steps), energy == "1")
        return
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for case, name, angle in CASES:
            if case not in given.cases.split(","):
                continue
            count = len(packing(name)[0])
            times = {code: [] for code in codes()}
            for _ in range(given.rounds):
                for code, run in codes().items():
                    steps = given.steps // 4 if code.startswith("yade") else given.steps
                    spent, contacts, lists, peak = run(name, angle, steps, Path(folder))
                    times[code].append((spent / steps / count * 1e6, contacts, lists, peak))
            for code, runs in times.items():
                figures = [t[0] for t in runs]
                rows.append(
                    {
                        "case": case,
                        "code": code,
                        "us_per_particle_step": f"{statistics.median(figures):.4f}",
                        "least": f"{min(figures):.4f}",
                        "most": f"{max(figures):.4f}",
                        "contacts": runs[-1][1],
                        "peak_MB": runs[-1][3],
                    }
                )
                print(rows[-1], flush=True)
    if given.output:
        with open(given.output, "w", newline="") as file:
            writer = csv.DictWriter(file, rows[0])
            writer.writeheader()
            writer.writerows(rows)


if __name__ == "__main__":
    main()
