"""Water rises behind a wall of dry stones until it turns over: level against the balance of moments and forces of each joint.

A plate pushes the water of a basin towards the wall, so that its level rises slowly. Joints bear no tension and let no water
through: the wall turns about the toe of the joint whose stones weigh too little, or slides on it.

Run it:  python wall_under_water.py               250 particles, a quarter of a minute
         python wall_under_water.py --mu 0.3      slides
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cairn as cn
import numpy as np

NAME = "wall_under_water"
GRAVITY, WATER, STONE = 9.81, 1000.0, 2200.0
LENGTH, DEPTH, HIGH = 1.6, 0.9, 0.25  # of the basin at first, height of a course [m]


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--spacing", type=float, default=0.075, help="of the particles [m]")
    parser.add_argument("--wide", type=float, default=0.5, help="of the wall [m]")
    parser.add_argument("--courses", type=int, default=6, help="each a quarter of a metre high")
    parser.add_argument("--mu", type=float, default=0.7, help="friction of stones")
    parser.add_argument("--speed", type=float, default=0.12, help="of the plate [m/s]")
    parser.add_argument("--seconds", type=float, default=6.6)
    parser.add_argument("--dt", type=float, default=2e-3, help="[s]")
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--output", type=Path, default=Path("."))
    return parser.parse_args(arguments)


def build(options):
    """A basin between a plate, which begins to move after half a second, and a wall of stones in running bond."""
    ground, stone = cn.Material("ground", density=2600.0), cn.Material("stone", density=STONE)
    scene = cn.Scene(dim=2, gravity=(0.0, -GRAVITY))
    speed = cn.Table([0.0, 0.5, 1.0], [(0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (options.speed, 0.0, 0.0)])
    scene.add(cn.wall((0, 0), (0, 1), ground))
    plate = scene.add(cn.wall((0, 0), (1, 0), ground, velocity=speed))[0]
    ids = []
    for course in range(options.courses):
        cuts = (0.0, 0.5, 1.0) if course % 2 else (0.0, 1.0)
        for left, right in zip(cuts, cuts[1:]):
            half = 0.5 * np.array([options.wide * (right - left), HIGH])
            place = (LENGTH + options.wide * (left + right) / 2, HIGH * (course + 0.5))
            ids += list(scene.add(cn.polygons(half * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]), stone, position=[place])))
    scene.add(cn.fluid([(0, 0), (LENGTH, DEPTH)], options.spacing, WATER, artificial=0.1, sound_speed=50.0))
    scene.interact("*", "*", cn.Coulomb(mu=options.mu))
    scene.interact("fluid", "*", cn.FreeSlip())
    return cn.Simulation(scene, dt=options.dt), plate, ids


def levels_due(options):
    """Lowest level at which a joint opens at its toe, and at which it slides, by the balance of the stones above it [m]."""
    opens, slides = [], []
    for course in range(options.courses):
        low = HIGH * course
        weight = STONE * GRAVITY * options.wide * (HIGH * options.courses - low)
        opens.append(low + (3 * weight * options.wide / (WATER * GRAVITY)) ** (1 / 3))
        slides.append(low + (2 * options.mu * weight / (WATER * GRAVITY)) ** 0.5)
    return min(opens), min(slides)


def main(arguments=None):
    """Lets the level rise until the time is over; prints and draws; returns the figures."""
    options = options_from(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    sim, plate, ids = build(options)
    volume, levels, ways = len(sim.fluid) * options.spacing**2, [], []
    first = sim.bodies.position[np.isin(sim.bodies.id, ids), 0]

    def follow(sim):
        place = sim.bodies.position
        levels.append(volume / (LENGTH - place[sim.bodies.id == plate][0, 0]))
        ways.append(np.abs(place[np.isin(sim.bodies.id, ids), 0] - first).max())

    steps = round(options.seconds / options.dt)
    path = options.output / f"{NAME}.vtkhdf"
    sim.run(steps, output=path, every=max(steps // options.frames, 1), callback=follow, overwrite=True)
    level, moved = np.array(levels), np.array(ways)
    gives = moved > 2e-3 * options.wide
    opens, slides = levels_due(options)
    figures = {
        "particles": (len(sim.fluid), ""),
        "level at which the wall gives way": (level[np.argmax(gives)] if gives.any() else np.nan, "m"),
        "level that opens a joint": (opens, "m"),
        "level at which a joint slides": (slides, "m"),
        "motion before 95 % of the lower": (moved[level < 0.95 * min(opens, slides)].max(), "m"),
    }
    for name, (value, unit) in figures.items():
        print(f"{name:34s} {value:.4g} {unit}".rstrip())
    draw(path, level, moved, options)
    return {name: (float(value), unit) for name, (value, unit) in figures.items()}


def draw(path, level, moved, options):
    """The wall before and after it gives way, and its motion over the level."""
    import matplotlib.pyplot as plt
    from cairn.post.fluid_plots import plot_fluid

    figure, axes = plt.subplots(1, 3, figsize=(13, 3.6), layout="constrained", width_ratios=(2, 2, 1.5))
    yields = int(np.argmax(moved > 0.2 * options.wide)) if moved.max() > 0.2 * options.wide else len(moved) - 1
    with cn.load(path) as run:
        times = np.array([step.time for step in run])
        for axis, step in zip(axes, (yields // 2, yields)):
            at = int(np.argmin(np.abs(times - options.dt * (step + 1))))
            plot_fluid(run[at], "pressure", ax=axis, view=((-0.05, LENGTH + 1.0), (-0.05, 1.7)))
            axis.text(0.02, 0.92, f"level {level[min(step, len(level) - 1)]:.2f} m", transform=axis.transAxes)
    axes[2].semilogy(level, np.maximum(moved, 1e-9) / options.wide, color="#1f5f8b")
    for due, name in zip(levels_due(options), ("opens", "slides")):
        axes[2].axvline(due, color="#999999", lw=0.8)
        axes[2].text(due, 2e-7, f"{name} ", rotation=90, color="#666666", fontsize=8, ha="right")
    axes[2].set(xlabel="level [m]", ylabel="motion of stones over the width [-]", xlim=(level[0], 1.7))
    figure.savefig(options.output / f"{NAME}.png", dpi=100)
    plt.close(figure)


if __name__ == "__main__":
    main()
