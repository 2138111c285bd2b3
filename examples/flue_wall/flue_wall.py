"""A flue wall of a furnace, heated from one side and cooled, cycle by cycle: effect of the mortar in its horizontal joints.

After Dubois & Renouf (2007), 5.5.2, as a section through the wall: bricks on each other between a stiff floor and a stiff head,
which stands on springs that take the expansion. A fire heats the middle more than the ends, and one face more than the other:
bricks expand, and curve under the gradient of temperature. The wall bows and, pressed between floor and head, is bent further;
when it cools, its recovery depends on the mortar. Three walls go through the same cycles: with mortar that damages, with elastic
mortar, and laid dry. The residual at the end of each cycle is the accumulated deflection.

Sizes, temperatures and strengths are chosen here from the range of such walls: the paper does not tell them. Cycles of two weeks
are run in seconds, slowly against what the wall swings with.

Run it:  python flue_wall.py              a wall of 12 courses, under a minute
         python flue_wall.py --full       40 courses, 4 m
         python flue_wall.py --help
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import cairn as cn
import numpy as np

NAME = "flue_wall"
THICK, COURSE = 0.15, 0.1  # of the wall, height of a brick [m]
DENSITY, EXPANSION = 2200.0, 5.5e-6  # [kg/m3], [1/K]
COLD, HOT = 300.0, 1400.0  # [K]
ACROSS = 200.0  # between the faces of the wall where it is hottest [K]
THRUST = 1e5  # pressure of the head on the wall when it is hot [Pa]
MU = 0.6
MORTAR = dict(normal_stiffness=2e9, tangential_stiffness=2e9, normal_strength=3e5, tangential_strength=3e5,
              normal_work=40.0, tangential_work=40.0)  # fmt: skip
STRONG = dict(normal_strength=3e8, tangential_strength=3e8, normal_work=1e8, tangential_work=1e8)
CASES = {
    "mortar that damages": cn.MAL(mu=MU, **MORTAR),
    "elastic mortar": cn.MAL(mu=MU, **{**MORTAR, **STRONG}),
    "no mortar": cn.Coulomb(mu=MU),
}


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    parser.add_argument("--courses", type=int, default=12)
    parser.add_argument("--cycles", type=int, default=10)
    parser.add_argument("--steps", type=int, default=100, help="in each cycle (100)")
    parser.add_argument("--period", type=float, default=0.4, help="of a cycle [s] (0.4)")
    parser.add_argument("--tol", type=float, default=1e-5, help="true error of each step (1e-5)")
    parser.add_argument("--full", action="store_true", help="40 courses")
    parser.add_argument("--output", type=Path, default=Path("."))
    options = parser.parse_args(arguments)
    for name in ("courses", "cycles", "steps"):
        if getattr(options, name) < 2:
            parser.error(f"--{name} is {getattr(options, name)}: give at least 2")
    if options.full:
        options.courses = 40
    return options


def box(x, y):
    """Corners of a rectangle."""
    return np.array([[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]])


def build(options, mortar):
    """The simulation, and the heights of the middles of its bricks as laid [m]; bricks are the first bodies."""
    n, height = options.courses, options.courses * COURSE
    clay = cn.Material("clay", density=DENSITY, expansion=EXPANSION, conductivity=1.5, capacity=1000.0)
    iron = cn.Material("iron", density=DENSITY, conductivity=1.0, capacity=1000.0)
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    half = THICK / 2
    bricks = [box((-half, half), (k * COURSE, (k + 1) * COURSE)) for k in range(n)]
    ids = scene.add(cn.polygons(bricks, clay, group="bricks"))
    wide, thick, reach = 3 * half, 0.1, 0.5
    scene.add(cn.polygons([box((-wide, wide), (-thick, 0.0))], iron, group="floor", fixed=True))
    head = cn.polygons([box((-wide, wide), (height, height + thick))], iron, group="head")
    scene.add(head.with_(driven=("vx", "w")))
    above = height + thick + reach
    scene.add(cn.polygons([box((-wide, wide), (above, above + thick))], iron, group="abutment", fixed=True))
    # a wall that is free would grow twice as far as springs let it; two points of two faces: two rods
    spring = THRUST * THICK / (EXPANSION * (HOT - COLD) * height / 2)
    scene.interact("*", "*", cn.Coulomb(mu=MU))
    scene.interact("bricks", "bricks", mortar)
    scene.interact("bricks", "floor", mortar)
    scene.interact("bricks", "head", mortar)
    damped = 0.02 * options.period
    rod = cn.Rod(stiffness=spring * reach / 2, viscosity=damped * spring * reach / 2, within=1.01 * reach)
    scene.interact("head", "abutment", rod)
    y = (np.arange(n) + 0.5) * COURSE
    share, slope = 1 - 0.4 * (2 * y / height - 1) ** 2, -0.4 * 4 / height * (2 * y / height - 1)

    def fire(t):
        return 0.5 * (1 - np.cos(2 * np.pi * t / options.period))

    scene.thermal(
        conductance=cn.networks.Constant(conductance=0.0),
        initial=COLD,
        reference=COLD,
        temperature=[(ids, lambda t: COLD + (HOT - COLD) * fire(t) * share)],
        gradient=[(ids, lambda t: fire(t) * np.c_[ACROSS / THICK * share, (HOT - COLD) * slope])],
        friction="none",
    )
    strategy = cn.NSCD(theta=1.0, solver=cn.NLGS(tol=options.tol, max_iter=20000))
    return cn.Simulation(scene, options.period / options.steps, strategy, overlap="ignore"), y


def run(options, mortar):
    """The simulation at its end, heights of the bricks; rows a step: cycles, largest deflection, that of the middle, mortar
    left, released, status, error; deflections of the bricks at the end of each cycle, hot ones and temperatures in the first."""
    sim, y = build(options, mortar)
    n = options.courses
    begin = sim.bodies.position[:n].copy()
    rows, cold, hot, warm, bonds = [], [], None, None, None
    for k in range(1, options.cycles * options.steps + 1):
        report = sim.step()
        moved = sim.bodies.position[:n, 0] - begin[:, 0]
        joined = sim.contacts.beta * np.all(sim.contacts.bodies <= n + 1, axis=1) * np.any(sim.contacts.bodies < n, axis=1)
        bonds = joined.sum() if bonds is None else bonds
        rows.append((sim.time / options.period, moved[np.argmax(np.abs(moved))], moved[n // 2], joined.sum() / max(bonds, 1),
                     sim.info["energy"]["released"], report["status"] == "converged", report["error"]))  # fmt: skip
        if k == options.steps // 2:
            hot, warm = moved.copy(), sim.bodies.temperature[:n].copy()
        if k % options.steps == 0:
            cold.append(moved.copy())
    return {"sim": sim, "y": y, "rows": np.array(rows), "cold": np.array(cold), "hot": hot, "warm": warm}


def draw(options, found, folder):
    """The field of temperature when hot, the accumulated deflection of each wall, and deflections against cycles."""
    import matplotlib.pyplot as plt
    from matplotlib.collections import PolyCollection

    figure, axes = plt.subplots(1, 3, figsize=(14, 5), layout="constrained", width_ratios=(0.7, 1.2, 1.4))
    one = found["mortar that damages"]
    height, n, across = options.courses * COURSE, options.courses, 8
    share = (one["warm"] - COLD) / (HOT - COLD)
    x = np.linspace(-THICK / 2, THICK / 2, across + 1)
    cells, values = [], []
    grown = 0.15 * height / max(np.abs(one["hot"]).max(), 1e-12) if np.abs(one["hot"]).max() > 0 else 0.0
    for k in range(n):
        for a, b in zip(x[:-1], x[1:]):
            cells.append(box((a + grown * one["hot"][k], b + grown * one["hot"][k]), (k * COURSE, (k + 1) * COURSE)))
            values.append(one["warm"][k] + share[k] * ACROSS / THICK * (a + b) / 2 - 273.15)
    drawn = PolyCollection(cells, array=np.array(values), cmap="inferno", edgecolor="face")
    axes[0].add_collection(drawn)
    axes[0].set(xlim=(-0.3 * height, 0.3 * height), ylim=(0, 1.02 * height), aspect="equal", xlabel="x [m]", ylabel="y [m]",
                title=f"hot, deflection x {grown:.0f}")  # fmt: skip
    figure.colorbar(drawn, ax=axes[0], label="temperature [deg C]", shrink=0.7)
    for colour, mark, (name, of) in zip(("C3", "C0", "0.4"), "os^", found.items()):
        axes[1].plot(of["cold"][-1] * 1e3, of["y"], f"{mark}-", color=colour, label=name)
        axes[2].plot(of["rows"][:, 0], of["rows"][:, 2] * 1e3, color=colour, lw=0.6, alpha=0.6)
        axes[2].plot(np.arange(1, options.cycles + 1), of["cold"][:, n // 2] * 1e3, f"{mark}-", color=colour, label=name)
    axes[1].set(xlabel=f"deflection left after {options.cycles} cycles [mm]", ylabel="y [m]", title="accumulated deflection")
    axes[1].legend(fontsize=8)
    axes[2].set(xlabel="cycles", ylabel="deflection of the middle [mm]", title="in each cycle, and what is left of it")
    figure.savefig(folder / f"{NAME}.png", dpi=110)
    plt.close(figure)


def main(arguments=None):
    """Runs the three walls through their cycles, prints the figures, draws; returns the figures."""
    options = options_from(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    start = time.perf_counter()
    found = {name: run(options, law) for name, law in CASES.items()}
    figures = {"bricks": (options.courses, ""), "steps": (options.cycles * options.steps, "a case")}
    for name, of in found.items():
        rows, cold, energy = of["rows"], of["cold"], of["sim"].info["energy"]
        figures[f"{name}: hot"] = (np.abs(of["hot"]).max() * 1e3, "mm, largest deflection in the first cycle")
        figures[f"{name}: first"] = (np.abs(cold[0]).max() * 1e3, "mm, left after the first cycle")
        figures[f"{name}: last"] = (np.abs(cold[-1]).max() * 1e3, "mm, left after the last")
        figures[f"{name}: sound"] = (rows[-1, 3], "of the mortar")
        figures[f"{name}: solved"] = (rows[:, 5].mean(), f"of the steps, largest error {rows[:, 6].max():.1e}")
        figures[f"{name}: balance"] = (abs(energy["closure"]) / energy["in_play"], "of the energy in play")
    figures["time"] = (time.perf_counter() - start, "s")
    for name, (value, unit) in figures.items():
        print(f"{name:32s} {value:.4g} {unit}".rstrip())
    with open(options.output / f"{NAME}.csv", "w", encoding="utf-8") as file:
        file.write("cycle," + ",".join(f"{name} [mm]" for name in found) + "\n")
        for k in range(options.cycles):
            file.write(f"{k + 1}," + ",".join(f"{of['cold'][k, options.courses // 2] * 1e3:.6g}" for of in found.values()) + "\n")
    draw(options, found, options.output)
    found["mortar that damages"]["sim"].run(1, output=options.output / f"{NAME}.vtkhdf", overwrite=True, progress=False)
    return figures


if __name__ == "__main__":
    main()
