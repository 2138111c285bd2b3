"""A panel of bricks on zones of mortar, pressed and sheared at its top: peak force, convergence and cost against the step.

    python benchmarks/masonry_panel.py [--steps DT...] [--tol TOL]      all take about two minutes of one core

Writes benchmarks/results/masonry_panel.csv. 101 rigid bricks in 18 courses of running bond (Raijmakers & Vermeltfoort 1992;
Lourenco 1996), zones of 8.2e10 and 3.6e10 Pa/m, strengths of .25 and .35 MPa, works of 18 and 125 J/m2, under .3 MPa; the top
moves at 1 cm/s for half a millimetre. The last row is the reference: a sixteenth of the step, a hundredth of the tolerance.
"""

import argparse
import csv
import time
from pathlib import Path

import cairn as cn
import numpy as np

WIDTH, HEIGHT, COURSES, COLUMNS, PRESSURE, SPEED, WAY = 0.21, 0.052, 18, 5, 0.3e6, 0.01, 5e-4
ZONE = dict(normal_stiffness=8.2e10, tangential_stiffness=3.6e10, mu=0.75)
BREAKS = dict(normal_strength=2.5e5, tangential_strength=3.5e5, normal_work=18.0, tangential_work=125.0)


def corners(a, b, low, high):
    return np.array([[a, low], [b, low], [b, high], [a, high]])


def bricks():
    """Outlines in running bond, half a brick at both ends of each second course."""
    for k in range(COURSES):
        edges = np.r_[0.0, np.arange(WIDTH / 2 if k % 2 else WIDTH, (COLUMNS - 0.25) * WIDTH, WIDTH), COLUMNS * WIDTH]
        for a, b in zip(edges[:-1], edges[1:], strict=True):
            yield corners(a, b, k * HEIGHT, (k + 1) * HEIGHT)


def run(dt, tol):
    """Row of the table: dt [s], tol, largest force over the load, where [mm], steps, those converged, CPU time of one [ms]."""
    stone, beam = cn.Material("stone", density=1900.0), cn.Material("beam", density=1900.0)
    length, height = COLUMNS * WIDTH, COURSES * HEIGHT
    scene = cn.Scene(2, gravity=(0, -9.81))
    scene.add(cn.polygons([corners(-0.2, length + 0.2, -0.1, 0.0)], beam, fixed=True))
    top = scene.add(cn.polygons([corners(0.0, length, height, height + 0.1)], beam, force=(0.0, -PRESSURE * length)))[0]
    scene.add(cn.polygons(list(bricks()), stone))
    scene.interact("*", "*", cn.MAL(**ZONE, **BREAKS))
    sim = cn.Simulation(scene, dt, cn.NSCD(solver=cn.Auto(tol=tol)))
    sim.run(steps=round(0.02 / dt), progress=False)
    sim.drive([top], "vx", SPEED)
    pulls, converged, start = [], 0, time.process_time()
    for _ in range(round(WAY / (SPEED * dt))):
        sim.step()
        converged += sim.info["status"] == "converged"
        on = np.any(sim.contacts.bodies == top, axis=1)
        pulls.append(abs(sim.contacts.force[on, 0].sum()) / (PRESSURE * length))
    at = int(np.argmax(pulls))
    cpu = 1e3 * (time.process_time() - start) / len(pulls)
    return [dt, tol, f"{pulls[at]:.4f}", f"{1e3 * SPEED * dt * (at + 1):.3f}", len(pulls), converged, f"{cpu:.1f}"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=float, nargs="*", default=[1e-3, 5e-4, 2.5e-4])
    parser.add_argument("--tol", type=float, default=1e-4)
    asked = parser.parse_args()
    cases = [(dt, asked.tol) for dt in asked.steps] + [(min(asked.steps) / 4, asked.tol / 100)]
    path = Path(__file__).parent / "results" / "masonry_panel.csv"
    with open(path, "w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["dt_s", "tol", "peak_over_load", "peak_at_mm", "steps", "converged", "cpu_ms_a_step"])
        for dt, tol in cases:
            row = run(dt, tol)
            table.writerow(row)
            file.flush()
            print(*row, flush=True)


if __name__ == "__main__":
    main()
