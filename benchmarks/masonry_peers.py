"""A panel of rigid bricks on zones of mortar, in 3D, by Cairn and by LMGC90: shear force against way, and CPU time.

    python benchmarks/masonry_peers.py [--courses 18] [--columns 5] [--way 4e-4] [--output FILE.csv]

Raijmakers & Vermeltfoort's panel as in masonry_panel.py, whose bricks are .1 m deep here, since compas_lmgc90 (the wheel of
LMGC90) has bodies in 3D alone. Law MAL, IQS_MAL_CZM there. Both take steps of 1 ms: 20 under the load, then the top moves at
1 cm/s. LMGC90 stops its sweeps by a criterion on their change that the wheel fixes, Cairn by its error, at default settings.
Forces at equal ways tell how far either is from the solution: the last rows are Cairn's with a quarter of the step.
"""

import argparse
import csv
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

WIDTH, HEIGHT, DEPTH, PRESSURE, SPEED, REST = 0.21, 0.052, 0.1, 0.3e6, 0.01, 0.02
ZONE = dict(mu=0.75, normal_stiffness=8.2e10, tangential_stiffness=3.6e10, normal_strength=2.5e5, tangential_strength=3.5e5,
            normal_work=18.0, tangential_work=125.0)  # fmt: skip
FACES = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
COLUMNS = ("code", "courses", "columns", "points", "dt_s", "way_mm", "force_over_load", "converged", "steps", "cpu_ms_a_step")


def block(a, b, low, high):
    return np.array([[x, y, z] for z in (low, high) for y in (0.0, DEPTH) for x in (a, b)])


def panel(courses, columns):
    """Vertices of the base, of the bricks in running bond, and of the beam on top."""
    length, bricks = columns * WIDTH, []
    for k in range(courses):
        edges = np.r_[0.0, np.arange(WIDTH / 2 if k % 2 else WIDTH, (columns - 0.25) * WIDTH, WIDTH), length]
        bricks += [block(a, b, k * HEIGHT, (k + 1) * HEIGHT) for a, b in zip(edges[:-1], edges[1:], strict=True)]
    top = courses * HEIGHT
    return [block(-0.2, length + 0.2, -0.1, 0.0), *bricks, block(0.0, length, top, top + 0.1)]


def by_cairn(courses, columns, way, dt):
    """Rows of (way [mm], force over the load), contact points, converged steps, steps, CPU milliseconds a step."""
    import cairn as cn

    base, *bricks, beam = panel(courses, columns)
    load = PRESSURE * columns * WIDTH * DEPTH
    stone, steel = cn.Material("stone", density=1900.0), cn.Material("beam", density=1900.0)
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    scene.add(cn.polyhedra([(base, FACES)], steel, fixed=True))
    top = scene.add(cn.polyhedra([(beam, FACES)], steel, force=(0, 0, -load, 0, 0, 0)))[0]
    scene.add(cn.polyhedra([(v, FACES) for v in bricks], stone))
    scene.interact("*", "*", cn.MAL(**ZONE))
    sim = cn.Simulation(scene, dt)
    for _ in range(round(REST / dt)):
        sim.step()
    sim.drive([top], ("vx", "vy"), (SPEED, 0, 0, 0, 0, 0))
    forces, converged, start, points = [], 0, time.process_time(), 0
    for _ in range(round(way / SPEED / dt)):
        converged += sim.step()["status"] == "converged"
        on = np.any(sim.contacts.bodies == top, axis=1)
        forces.append(abs(sim.contacts.force[on, 0].sum()) / load)
        points = max(points, len(sim.contacts.gap))
    return forces, points, converged, 1e3 * (time.process_time() - start) / len(forces)


def by_lmgc90(courses, columns, way, dt):
    """The same rows from LMGC90; needs a Python environment with compas_lmgc90."""
    from compas_lmgc90.solver import Solver

    blocks = [{"vertices": v.tolist(), "faces": FACES} for v in panel(courses, columns)]
    load, top = PRESSURE * columns * WIDTH * DEPTH, len(blocks) - 1
    solver = Solver(dt=dt, theta=0.5, density=1900.0)
    solver.geometry_from_v_f(blocks)
    for name in ("Vx", "Vy", "Vz", "Rx", "Ry", "Rz"):
        solver.apply_velocity(0, name, 0.0)
    solver.apply_force(top, "Fz", -load)
    solver.apply_velocity(top, "Vy", 0.0)
    solver.apply_velocity(top, "Vx", np.array([[0.0, REST, REST * (1 + 1e-6), 1e3], [0.0, 0.0, SPEED, SPEED]]))
    mu = ZONE["mu"]
    solver.contact_law("IQS_MAL_CZM", [mu, *(ZONE[name] if name != "mu" else mu for name in ZONE)], alert=1e-3)
    solver.preprocess()
    for _ in range(round(REST / dt)):
        solver.lmgc90.compute_one_step()
    forces, start, points = [], time.process_time(), 0
    for _ in range(round(way / SPEED / dt)):
        result = solver.lmgc90.compute_one_step()
        bodies = np.array(result.interaction_bodies).reshape(-1, 2)
        force = np.array(result.interaction_force_global).reshape(-1, 3)
        forces.append(abs(force[(bodies == top + 1).any(1), 0].sum()) / load)
        points = max(points, len(bodies))
    return forces, points, "", 1e3 * (time.process_time() - start) / len(forces)


def rows(code, given, dt, found):
    """A row for each tenth of a millimetre."""
    forces, points, converged, cpu = found
    for at in np.arange(1e-4, given.way * 1.001, 1e-4):
        force = forces[min(len(forces), round(at / SPEED / dt)) - 1]
        yield [
            code,
            given.courses,
            given.columns,
            points,
            dt,
            f"{1e3 * at:.1f}",
            f"{force:.4f}",
            converged,
            len(forces),
            f"{cpu:.1f}",
        ]


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--courses", type=int, default=18)
    parser.add_argument("--columns", type=int, default=5)
    parser.add_argument("--way", type=float, default=4e-4)
    parser.add_argument("--dt", type=float, default=1e-3)
    parser.add_argument("--output", type=Path)
    parser.add_argument("--lmgc90", action="store_true", help="run LMGC90 and print its figures (used by the script itself)")
    given = parser.parse_args(arguments)
    if given.lmgc90:
        forces, points, _, cpu = by_lmgc90(given.courses, given.columns, given.way, given.dt)
        print("result", points, cpu, *forces)
        return []
    import peers

    table = [*rows("cairn", given, given.dt, by_cairn(given.courses, given.columns, given.way, given.dt))]
    python = peers.lmgc90_python()
    if python:
        words = [f"--{name}={getattr(given, name)}" for name in ("courses", "columns", "way", "dt")]
        with tempfile.TemporaryDirectory() as folder:
            text = peers.call([python, str(Path(__file__).resolve()), "--lmgc90", *words], folder)
        points, cpu, *forces = peers.rows_of(text)[0]
        table += rows("lmgc90", given, given.dt, (forces, int(points), "", cpu))
    fine = given.dt / 4
    table += rows("cairn, fine", given, fine, by_cairn(given.courses, given.columns, given.way, fine))
    for row in table:
        print(*row, sep=", ", flush=True)
    if given.output:
        with open(given.output, "w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows([COLUMNS, *table])
    return table


if __name__ == "__main__":
    main(sys.argv[1:])
