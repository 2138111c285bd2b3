"""The flue wall in elevation: bricks in running bond along a wall, between stiff head walls at both ends.

Bricks are boxes, mortar is in the horizontal joints alone, the vertical ones are dry. The fire heats the middle of the wall more
than its ends and one face more than the other; what the wall cannot grow along its length, with one head wall on springs, it bows
aside. Drawn as figure 9 of Dubois & Renouf (2007): the field of temperature on the left, on the right how far the bricks
stand aside after the cycles.

Run it:  python elevation.py              4 bricks by 4 courses, under a minute
         python elevation.py --full       17 bricks by 10 courses, 5.1 m
         python elevation.py --help
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import cairn as cn
import flue_wall as wall
import numpy as np

NAME = "flue_wall_elevation"
LONG, REACH = 0.3, 0.5  # of a brick, between head wall and abutment [m]


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    parser.add_argument("--bricks", type=int, default=4, help="in a course (4)")
    parser.add_argument("--courses", type=int, default=4)
    parser.add_argument("--cycles", type=int, default=10)
    parser.add_argument("--steps", type=int, default=60, help="in each cycle (60)")
    parser.add_argument("--period", type=float, default=0.4, help="of a cycle [s] (0.4)")
    parser.add_argument("--tol", type=float, default=1e-3, help="true error of each step (1e-3)")
    parser.add_argument("--full", action="store_true", help="17 bricks by 10 courses")
    parser.add_argument("--output", type=Path, default=Path("."))
    options = parser.parse_args(arguments)
    if options.full:
        options.bricks, options.courses = 17, 10
    for name in ("bricks", "courses", "cycles", "steps"):
        if getattr(options, name) < 2:
            parser.error(f"--{name} is {getattr(options, name)}: give at least 2")
    return options


def bonded(options):
    """Middles along the wall, heights and lengths of the bricks (n, 3) [m], and the course of each: every other one begins with
    half a brick."""
    places, courses = [], []
    length = options.bricks * LONG
    for k in range(options.courses):
        edges = np.arange(options.bricks + 1) * LONG
        if k % 2:
            edges = np.r_[0.0, edges[:-1] + LONG / 2, length]
        places += [((a + b) / 2, (k + 0.5) * wall.COURSE, b - a) for a, b in zip(edges[:-1], edges[1:])]
        courses += [k] * (len(edges) - 1)
    return np.array(places), np.array(courses)


def build(options, mortar):
    """The simulation and the bricks of `bonded`, which are its first bodies."""
    places, courses = bonded(options)
    length, height, deep = options.bricks * LONG, options.courses * wall.COURSE, 0.1
    clay = cn.Material("clay", density=wall.DENSITY, expansion=wall.EXPANSION, conductivity=1.5, capacity=1000.0)
    iron = cn.Material("iron", density=wall.DENSITY, conductivity=1.0, capacity=1000.0)
    scene = cn.Scene(dim=3, gravity=(0.0, 0.0, -9.81))
    ids = []
    for (x, z, long), course in zip(places, courses):
        brick = cn.boxes([[x, 0.0, z]], [long, wall.THICK, wall.COURSE], clay, group="odd" if course % 2 else "even")
        ids += list(scene.add(brick))
    scene.add(cn.wall((0, 0, 0), (0, 0, 1), iron, group="floor"))
    held = ("vx", "vy", "vz", "wx", "wy", "wz")
    for group, x, driven in (("head", -deep / 2, held), ("head", length + deep / 2, held[1:]),
                             ("abutment", length + deep + REACH + deep / 2, held)):  # fmt: skip
        head = cn.boxes([[x, 0.0, height / 2]], [deep, 3 * wall.THICK, 1.2 * height], iron, group=group)
        scene.add(head.with_(driven=driven))
    # a wall that is free would grow twice as far as springs let it; four points of two faces: four rods
    spring = wall.THRUST * wall.THICK * height / (wall.EXPANSION * (wall.HOT - wall.COLD) * length / 2)
    damped = 0.02 * options.period
    scene.interact("*", "*", cn.Coulomb(mu=wall.MU))
    scene.interact("even", "floor", mortar)
    scene.interact("even", "odd", mortar)  # courses lie on each other, bricks of one beside each other
    rod = cn.Rod(stiffness=spring * REACH / 4, viscosity=damped * spring * REACH / 4, within=1.01 * REACH)
    scene.interact("head", "abutment", rod)
    along = 2 * places[:, 0] / length - 1
    share, slope = 1 - 0.4 * along**2, -0.4 * 4 / length * along

    def fire(t):
        return 0.5 * (1 - np.cos(2 * np.pi * t / options.period))

    def gradient(t):
        return fire(t) * np.c_[(wall.HOT - wall.COLD) * slope, wall.ACROSS / wall.THICK * share, 0 * share]

    scene.thermal(conductance=cn.networks.Constant(conductance=0.0), initial=wall.COLD, reference=wall.COLD,
                  temperature=[(ids, lambda t: wall.COLD + (wall.HOT - wall.COLD) * fire(t) * share)],
                  gradient=[(ids, gradient)], friction="none")  # fmt: skip
    strategy = cn.NSCD(theta=1.0, solver=cn.Auto(tol=options.tol, max_iter=2000))
    return cn.Simulation(scene, options.period / options.steps, strategy, overlap="ignore"), places


def run(options, mortar):
    """The simulation at its end, the bricks, how far they stand aside at the end of each cycle [m], temperatures when hot, and a
    row a step: cycles, largest deflection, whether the step was solved, its error."""
    sim, places = build(options, mortar)
    n = len(places)
    begin, rows, cold, warm = sim.bodies.position[:n].copy(), [], [], None
    for k in range(1, options.cycles * options.steps + 1):
        report = sim.step()
        aside = sim.bodies.position[:n, 1] - begin[:, 1]
        rows.append((sim.time / options.period, np.abs(aside).max(), report["status"] == "converged", report["error"]))
        if k == options.steps // 2:
            warm = sim.bodies.temperature[:n].copy()
        if k % options.steps == 0:
            cold.append(aside.copy())
    return {"sim": sim, "places": places, "cold": np.array(cold), "warm": warm, "rows": np.array(rows)}


def draw(options, found, folder):
    """Temperature of the bricks when hot on the left; on the right their residual deflection, for each wall."""
    import matplotlib.pyplot as plt
    from matplotlib.collections import PolyCollection

    figure, axes = plt.subplots(len(found), 2, figsize=(11, 2.4 * len(found)), layout="constrained", squeeze=False)
    largest = max(np.abs(of["cold"][-1]).max() for of in found.values()) * 1e3
    for (left, right), (name, of) in zip(axes, found.items()):
        cells = [wall.box((x - w / 2, x + w / 2), (z - wall.COURSE / 2, z + wall.COURSE / 2)) for x, z, w in of["places"]]
        for axis, values, colours, label, limits in (
            (left, of["warm"] - 273.15, "inferno", "temperature, hot [deg C]", (None, None)),
            (right, of["cold"][-1] * 1e3, "coolwarm", "out of the wall, cold [mm]", (-largest, largest)),
        ):
            drawn = PolyCollection(cells, array=values, cmap=colours, edgecolor="0.3", linewidth=0.5)
            drawn.set_clim(*limits)
            axis.add_collection(drawn)
            axis.set(xlim=(0, options.bricks * LONG), ylim=(0, options.courses * wall.COURSE), aspect="equal", title=name)
            axis.set(xlabel="x [m]", ylabel="z [m]")
            figure.colorbar(drawn, ax=axis, label=label, shrink=0.8)
    figure.savefig(folder / f"{NAME}.png", dpi=110)
    plt.close(figure)


def main(arguments=None):
    """Runs the three walls through their cycles, prints the figures, draws; returns the figures."""
    options = options_from(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    start = time.process_time()
    found = {name: run(options, law) for name, law in wall.CASES.items()}
    figures = {"bricks": (len(bonded(options)[0]), ""), "steps": (options.cycles * options.steps, "a case")}
    for name, of in found.items():
        rows, cold, energy = of["rows"], of["cold"], of["sim"].info["energy"]
        hot = rows[: options.steps, 1].max()
        figures[f"{name}: hot"] = (hot * 1e3, "mm aside at most in the first cycle")
        figures[f"{name}: first"] = (np.abs(cold[0]).max() * 1e3, "mm, left after the first cycle")
        figures[f"{name}: last"] = (np.abs(cold[-1]).max() * 1e3, "mm, left after the last")
        figures[f"{name}: solved"] = (rows[:, 2].mean(), f"of the steps, largest error {rows[:, 3].max():.1e}")
        figures[f"{name}: balance"] = (abs(energy["closure"]) / energy["in_play"], "of the energy in play")
    figures["time"] = (time.process_time() - start, "s of CPU")
    for name, (value, unit) in figures.items():
        print(f"{name:32s} {value:.4g} {unit}".rstrip())
    with open(options.output / f"{NAME}.csv", "w", encoding="utf-8") as file:
        file.write("cycle," + ",".join(f"{name} [mm]" for name in found) + "\n")
        for k in range(options.cycles):
            file.write(f"{k + 1}," + ",".join(f"{np.abs(of['cold'][k]).max() * 1e3:.6g}" for of in found.values()) + "\n")
    draw(options, found, options.output)
    return figures


if __name__ == "__main__":
    main()
