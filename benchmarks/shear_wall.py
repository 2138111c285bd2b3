"""A shear wall whose joints crack, slide and crush: Raijmakers & Vermeltfoort's J4D, whose peak was 50 kN.

    python benchmarks/shear_wall.py [--full] [--displacement MM] [--plot PNG]      minutes of one core

The first rows are of rigid half bricks, the next of half bricks of 2 x 2 quadrilaterals (16.7 GPa, 0.15).

Writes benchmarks/results/shear_wall.csv. Sixteen courses of bricks of 204 x 98 x 50 mm and joints of 12.5 mm, .99 x 1.00 m,
under .3 MPa; the top then moves along, kept level and at its height (Raijmakers & Vermeltfoort 1992; Lourenco 1996). Rigid
half bricks, joined in the middle by a crack of 2 MPa and 80 J/m2; joints with the parameters of Lourenco & Rots (1997), their
stiffness in series with that of the brick beside them (16.7 GPa). Masses are sixteen times those of bricks: the load is slow,
and joints that soften side by side want steps in which inertia holds them. `--full` also runs the wall without a cap, and
half of the step and of the speed. `--study` writes shear_wall_study.csv instead, whose walls of deformable half bricks each
change one thing: bricks ten times as stiff, no cap, joints of half the stiffness, and none of the vertical restraint (the top
kept level under its load instead of at its height).
"""

import argparse
import csv
import time
from pathlib import Path

import cairn as cn
import numpy as np

YOUNG, POISSON = 1.67e10, 0.15
LENGTH, COURSE, COURSES, HALVES, THICK, PRESSURE = 0.99, 0.0625, 16, 9, 0.1, 0.3e6
JOINT = dict(normal_stiffness=6.58e10, tangential_stiffness=3.0e10, tension=0.25e6, cohesion=0.35e6, normal_work=18.0,
             tangential_work=125.0, friction=0.75, mu=0.75, cap=10.5e6, cap_work=5000.0, cap_shear=9.0, peak=9e-5)  # fmt: skip
CRACK = dict(normal_stiffness=1e12, tangential_stiffness=4.3e11, tension=2e6, cohesion=2.8e6, normal_work=80.0,
             tangential_work=500.0, friction=1.0, mu=0.75)  # fmt: skip
# of bricks that deform themselves: the joint alone, as in the paper, and a crack that hardly gives way before it opens
BARE_JOINT = JOINT | dict(normal_stiffness=8.2e10, tangential_stiffness=3.6e10)
STIFF_CRACK = CRACK | dict(normal_stiffness=1e13, tangential_stiffness=2e12)


def rectangle(a, b, low, high):
    return np.array([[a, low], [b, low], [b, high], [a, high]])


def meshed(box, cells, stone, mute, last, young):
    """Half a brick of cells x cells quadrilaterals. A joint is met from one side alone, by nodes of the brick above it or on its
    right: a second contact at the node across would be none of the joint, and bear the load beside it without yielding."""
    a, b, low, high = box
    x, y = np.meshgrid(np.linspace(a, b, cells + 1), np.linspace(low, high, cells + 1), indexing="ij")
    k = np.arange(x.size).reshape(x.shape)
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], -1).reshape(-1, 4)
    body = cn.ElasticBody(np.c_[x.ravel(), y.ravel()], {"quad": quads}, young=young, poisson=POISSON,
                          density=stone.density, plane="stress")  # fmt: skip
    meets, bears = [k[:, 0], k[0]], [k[:, -1], k[-1]]
    edges = np.concatenate([np.c_[side[:-1], side[1:]] for side in meets + bears])
    materials = [mute] * (2 * cells) + [stone] * (2 * cells)
    nodes = np.unique(np.concatenate(meets + bears[:1] if last else meets))
    return cn.deformable(body, stone, contact=nodes, edges=edges, edge_material=materials)


def build(dt, courses=COURSES, halves=HALVES, joint=JOINT, crack=CRACK, heavier=16.0, cells=0, young=YOUNG):
    """Simulation and id of the beam on top; materials by the parity of course and brick tell joints from cracks of bricks. Half
    bricks are rigid, or meshes of cells x cells."""
    length, height, scene = LENGTH * halves / HALVES, courses * COURSE, cn.Scene(2)
    beam, mute, stones = cn.Material("beam", density=2000.0), cn.Material("mute"), {}
    scene.add(cn.polygons([rectangle(0, length, -0.1, 0)], beam, fixed=True))
    load = dict(force=(0, -PRESSURE * length), driven=("vx", "w"))
    top = scene.add(cn.polygons([rectangle(0, length, height, height + 0.1)], beam, **load))[0]
    ends = np.linspace(0, length, halves + 1)
    for row in range(courses):
        for k in range(halves):
            brick, half = divmod(k + row % 2, 2)
            name = (row % 2, brick % 2, half)
            stone = stones.setdefault(name, cn.Material("stone" + "".join(map(str, name)), density=2000.0 * heavier))
            box = ends[k], ends[k + 1], row * COURSE, (row + 1) * COURSE
            last = row == courses - 1
            scene.add(meshed(box, cells, stone, mute, last, young) if cells else cn.polygons([rectangle(*box)], stone))
    scene.interact("*", "*", cn.CompositeInterface(**joint))
    for row, brick, half in list(stones):
        if half == 0 and (row, brick, 1) in stones:
            scene.interact(stones[row, brick, 0], stones[row, brick, 1], cn.CompositeInterface(**crack))
    if cells:
        leave_corners_free(scene, stones, mute)
    return cn.Simulation(scene, dt, cn.NSCD(theta=1.0, solver=cn.NLGS(tol=1e-4, max_iter=2000))), top


def leave_corners_free(scene, stones, mute):
    """No law where half bricks of two courses touch at a corner alone, and none of sides that do not bear."""
    scene.interact(mute, "*", None)
    scene.interact(mute, mute, None)
    for (row, *upper), one in stones.items():
        for (other, *lower), two in stones.items():
            place = [(2 * brick + half - r) % 4 for r, (brick, half) in ((row, upper), (other, lower))]
            if row < other and place[0] != place[1]:
                scene.interact(one, two, None)


def press(sim, dt, cells=0):
    """The wall under its load, at rest, and its top held at this height: elastic, in long steps."""
    long, steps, tol = (1e-3, 60, 1e-5) if cells else (2e-2, 30, 1e-6)
    sim.dt, sim.strategy = long, cn.NSCD(theta=1.0, solver=cn.Auto(tol=tol, max_iter=2000 if cells else 1000))
    for _ in range(steps):
        sim.step()
    sim.dt, sim.strategy = dt, cn.NSCD(theta=1.0, solver=cn.NLGS(tol=1e-4, max_iter=2000))


def shear(sim, top, speed, displacement, outputs=60, held=True):
    """Rows: displacement of the top [mm], forces along and down [kN], failed steps and CPU time [s] so far.

    held: the top stays at its height.
    """
    sim.drive([top], "vx", speed)
    if held:
        sim.drive([top], "vy", 0.0)
    steps, failed, start = round(displacement / (speed * sim.dt)), 0, time.process_time()
    for k in range(1, steps + 1):
        failed += sim.step()["status"] != "converged"
        if k % max(1, steps // outputs):
            continue
        contacts = sim.contacts
        along, down = np.abs(contacts.force[np.any(contacts.bodies == top, axis=1)].sum(axis=0)) * THICK / 1e3
        yield [1e3 * speed * sim.dt * k, along, down, failed, time.process_time() - start]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--displacement", type=float, default=3.0, help="of the top [mm]")
    parser.add_argument("--plot", type=Path)
    parser.add_argument("--study", action="store_true")
    asked = parser.parse_args()
    as_built = 1e-4, 0.01, 2, YOUNG, True
    cases = [("cap", JOINT, 1e-4, 0.01, 0, YOUNG, True), ("cap, bricks deform", BARE_JOINT, *as_built)]
    if asked.full:
        cases.append(("no cap", JOINT | dict(cap=np.inf), 1e-4, 0.01, 0, YOUNG, True))
        cases.append(("cap, half the step", JOINT, 5e-5, 0.005, 0, YOUNG, True))
    if asked.study:
        half = {name: BARE_JOINT[name] / 2 for name in ("normal_stiffness", "tangential_stiffness")}
        cases = [("no cap", BARE_JOINT | dict(cap=np.inf), *as_built), ("joints half as stiff", BARE_JOINT | half, *as_built)]
        cases.append(("top free to rise", BARE_JOINT, 1e-4, 0.01, 2, YOUNG, False))
        cases.append(("bricks ten times as stiff", BARE_JOINT, 1e-4, 0.01, 2, 10 * YOUNG, True))
    path, curves = Path(__file__).parent / "results" / ("shear_wall_study.csv" if asked.study else "shear_wall.csv"), {}
    with open(path, "w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["case", "displacement_mm", "along_kN", "down_kN", "steps_not_converged", "cpu_s"])
        for name, joint, dt, speed, cells, young, held in cases:
            sim, top = build(dt, joint=joint, crack=STIFF_CRACK if cells else CRACK, cells=cells, young=young)
            press(sim, dt, cells)
            for row in shear(sim, top, speed, 1e-3 * asked.displacement, held=held):
                curves.setdefault(name, []).append(row[:2])
                table.writerow([name, f"{row[0]:.3f}", f"{row[1]:.2f}", f"{row[2]:.2f}", row[3], f"{row[4]:.1f}"])
                file.flush()
                print(name, *(f"{x:.3g}" for x in row), flush=True)
    if asked.plot:
        import matplotlib.pyplot as plt

        figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
        for name, points in curves.items():
            axes.plot(*np.array([(0, 0), *points]).T, label=name)
        axes.axhline(50, color="0.5", linestyle="--", label="peak of the test, J4D")
        axes.set(xlabel="displacement of the top [mm]", ylabel="force along the wall [kN]", xlim=(0, None), ylim=(0, None))
        axes.legend()
        figure.savefig(asked.plot, dpi=120)


if __name__ == "__main__":
    main()
