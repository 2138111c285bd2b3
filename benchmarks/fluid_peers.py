"""The same dam break in space by Cairn and SPlisHSPlasH on one thread: CPU time a particle and step, and a second of the flow.

    python benchmarks/fluid_peers.py [--spacing 0.05] [--steps 100]

1 m x .5 m x 1 m of water in a tank 2 m long, 9.81 m/s2. Weakly compressible: the speed of sound is 10 sqrt(2 g H), steps are
.25 h/c with the length h of the kernel of a row. Incompressible: steps of 4 ms; DFSPH has those of its own choice up to 5 ms, and
errors of .1 %. SPlisHSPlasH has single precision, its kernel reaches over 2 spacings, and a wall is one layer of points.
Cairn has double precision and reaches over 3 spacings, or over 2 with smoothing=1. Each program runs --repeats times, in
turns, and the least time counts: other programs on the machine only add to it.

SPlisHSPlasH is the wheel pysplishsplash, in this Python or in the one that the variable CAIRN_SPLISHSPLASH_PYTHON names; without
it its rows are left out with a word. Writes benchmarks/results/fluid_peers.csv.
"""

import argparse
import csv
import importlib.util
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = "1"

RESULTS = Path(__file__).resolve().parent / "results"
LONG, WIDE, HIGH, TANK, GRAVITY, DENSITY = 1.0, 0.5, 1.0, 2.0, 9.81, 1000.0
SOUND = 10 * (2 * GRAVITY * HIGH) ** 0.5
COLUMNS = ("code", "form", "length of the kernel [spacings]", "neighbours in the list", "particles",
           "CPU [us] a particle and step", "steps a second of flow", "CPU [s] a second of flow")  # fmt: skip
FORMS = ("weakly compressible", "incompressible")
IMPLICIT_STEP, METHODS = 4e-3, {"weakly compressible": 0, "incompressible": 4}  # numbers of WCSPH and DFSPH


def cairn(form, spacing, smoothing, steps):
    """Row of a run by Cairn; steps are those of the liquid, sub-steps included."""
    import cairn as cn
    from fluid_scenes import basin

    scene, _ = basin((TANK, WIDE))
    scene.gravity = (0.0, 0.0, -GRAVITY)
    options = {"incompressible": True} if form == "incompressible" else {"sound_speed": SOUND}
    scene.add(cn.fluid([(0, 0, 0), (LONG, WIDE, HIGH)], spacing, DENSITY, smoothing=smoothing, **options))
    scene.interact("fluid", "*", cn.FreeSlip())
    sim = cn.Simulation(scene, dt=IMPLICIT_STEP)
    sim.step()
    done, begin, flow = 0, time.process_time(), sim.time
    while done < steps:
        sim.step()
        done += max(1, sim.fluid.info["sub_steps"])
    cpu, flow, n = time.process_time() - begin, sim.time - flow, len(sim.fluid)
    return "Cairn", form, f"{smoothing:g}", sim.fluid.info["neighbours"], n, 1e6 * cpu / n / done, done / flow, cpu / flow


def write_scene(folder, form, spacing):
    """Writes the tank as a surface, and the scene of SPlisHSPlasH; its path."""
    half = 0.5 * spacing
    corners = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
    sides = ((1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4))
    lines = ["v {} {} {}".format(*corner) for corner in corners]
    lines += [f"f {a} {b} {c}\nf {a} {c} {d}" for a, b, c, d in sides]
    Path(folder, "box.obj").write_text("\n".join(lines) + "\n")
    step = 0.25 * spacing / SOUND if form == "weakly compressible" else IMPLICIT_STEP
    configuration = {
        "particleRadius": half, "simulationMethod": METHODS[form], "gravitation": [0, -GRAVITY, 0], "timeStepSize": step,
        "cflMethod": int(form == "incompressible"), "cflFactor": 1.0, "cflMaxTimeStepSize": 5e-3, "boundaryHandlingMethod": 0,
        "WCSPH": {"stiffness": SOUND**2 * DENSITY / 7, "exponent": 7}, "DFSPH": {"maxError": 0.1, "maxErrorV": 0.1},
    }  # fmt: skip
    walls = {
        "geometryFile": f"{folder}/box.obj", "translation": [TANK / 2, TANK / 2, WIDE / 2], "rotationAxis": [1, 0, 0],
        "rotationAngle": 0, "scale": [TANK + spacing, TANK + spacing, WIDE + spacing], "isDynamic": False, "isWall": True,
        "mapInvert": True,
    }  # fmt: skip
    water = {"id": "Fluid", "denseMode": 0, "start": [-half] * 3, "end": [LONG + half, HIGH + half, WIDE + half]}
    of_water = {"id": "Fluid", "density0": DENSITY, "viscosityMethod": 0}
    scene = {"Configuration": configuration, "Materials": [of_water], "RigidBodies": [walls], "FluidBlocks": [water]}
    path = Path(folder, "scene.json")
    path.write_text(json.dumps(scene))
    return str(path)


def splishsplash(form, spacing, steps):
    """Prints the row of a run by SPlisHSPlasH, in the Python that runs this file."""
    import ctypes

    try:  # the wheel's own copy of this library crashes where the system's one is loaded after it
        ctypes.CDLL("libGL.so.1", mode=ctypes.RTLD_GLOBAL)
    except OSError:
        pass
    import pysplishsplash as splish

    marks, folder = [], tempfile.mkdtemp()
    base = splish.Exec.SimulatorBase()
    base.init(sceneFile=write_scene(folder, form, spacing), useGui=False, useCache=False, outputDir=folder, initialPause=False)
    base.initSimulation()
    sim, clock = splish.Simulation.getCurrent(), splish.TimeManager.getCurrent()
    liquid = sim.getFluidModel(0)

    def mark():
        marks.append((time.process_time(), clock.getTime()))
        if len(marks) == 1:
            near = range(liquid.numActiveParticles())
            marks.append((sum(sim.numberOfNeighbors(0, 0, i) for i in near) / len(near), len(near)))
            marks.append((time.process_time(), clock.getTime()))
        if len(marks) == steps + 3:
            cpu, flow = (marks[-1][k] - marks[2][k] for k in (0, 1))
            neighbours, n = marks[1]
            print("ROW", json.dumps([neighbours, n, 1e6 * cpu / n / steps, steps / flow, cpu / flow]), flush=True)
            base.setValueFloat(base.STOP_AT, 1e-9)

    base.setTimeStepCB(mark)
    base.setValueFloat(base.STOP_AT, 1e9)
    base.runSimulation()


def splishsplash_python():
    """The Python that has pysplishsplash, or None with a word."""
    if importlib.util.find_spec("pysplishsplash"):
        return sys.executable
    named = os.environ.get("CAIRN_SPLISHSPLASH_PYTHON")
    if not named:
        print("pysplishsplash is not installed, CAIRN_SPLISHSPLASH_PYTHON not set: SPlisHSPlasH is left out", flush=True)
    return named


def run_peer(python, form, spacing, steps):
    """Row of a run by SPlisHSPlasH in a process of its own; RuntimeError with the ends of its outputs if there is none."""
    command = [python, __file__, "--peer", form, "--spacing", str(spacing), "--steps", str(steps)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    row = [line[4:] for line in done.stdout.splitlines() if line.startswith("ROW ")]
    if not row:
        raise RuntimeError(f"SPlisHSPlasH ended with {done.returncode}:\n{done.stdout[-800:]}\n{done.stderr[-800:]}")
    return ("SPlisHSPlasH", form, "1", *json.loads(row[0]))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--spacing", type=float, default=0.05, help="[m]")
    parser.add_argument("--steps", type=int, default=100, help="of the explicit form; a fifth of it in the incompressible one")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--peer", choices=FORMS, help=argparse.SUPPRESS)
    parser.add_argument("--output", type=Path, default=RESULTS / "fluid_peers.csv")
    given = parser.parse_args()
    if given.peer:
        splishsplash(given.peer, given.spacing, given.steps)
        return
    python, best = splishsplash_python(), {}
    for _ in range(given.repeats):
        for form in FORMS:
            steps = given.steps if form == "weakly compressible" else max(5, given.steps // 5)
            rows = [cairn(form, given.spacing, smoothing, steps) for smoothing in (1.5, 1.0)]
            rows += [run_peer(python, form, given.spacing, steps)] if python else []
            for row in rows:
                best[row[:3]] = min(best.get(row[:3], row), row, key=lambda r: r[-1])
    with open(given.output, "w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow(COLUMNS)
        for (code, form, smoothing), row in best.items():
            neighbours, n, one, rate, second = row[3:]
            out.writerow([code, form, smoothing, f"{neighbours:.0f}", n, f"{one:.2f}", f"{rate:.0f}", f"{second:.2f}"])
    print(given.output.read_text())


if __name__ == "__main__":
    main()
