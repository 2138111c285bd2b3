"""Spheres in a box: a dense packing settles; loads of floor and walls, coordination; then a heavy ball falls on it.

The packing is made by geometry in seconds: each sphere lies where three others, or walls, can carry it. That is balance grain
by grain without friction; under gravity the whole settles in a few tenths of a second. At rest three figures tell what kind
of packing it is:

- the weight: floor and walls together carry it exactly, the walls their share by friction (Janssen 1895: why a silo's floor does
  not bear all the weight poured on top);
- the coordination number, contacts of a sphere that carry force: 6 is the least for spheres without friction, 4 with a lot;
  spheres with fewer than two such contacts (rattlers) are left out;
- the solid fraction.

Then a ball five times as large and of five times the density, inserted between two steps, falls on the bed from a height of
ten grains: rigid bodies of very different masses in one contact problem. The bed stops it in the time of a few steps, at the
depth of a grain or two; that its weight, too, is carried exactly is the last figure.

Run it:  python spheres_in_a_box.py            1,000 spheres, half a minute
         python spheres_in_a_box.py --help
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import cairn as cn
import numpy as np
from cairn.post import plots

NAME = "spheres_in_a_box"
HEIGHTS = (0.0, 1.3)  # of the colours, in heights of the box
MARKS = {"alpha": 0.4, "lw": 0, "color": plots.COMPRESSION}
DIAMETER = 0.01  # mean [m]
DENSITY, FRICTION, GRAVITY = 2500.0, 0.4, 9.81
STEP = 1e-3  # [s]
BALL, HEAVY, FALL = 2.5 * DIAMETER, 5.0, 10 * DIAMETER  # radius [m], density over that of the grains, height [m]


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--spheres", type=int, default=1000)
    parser.add_argument("--steps", type=int, default=400, help="of 1 ms, the first quarter before the ball (400)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--output", type=Path, default=Path("."))
    return parser.parse_args(arguments)


def build(options):
    """The simulation, the lengths of the box [m] and the seconds that the packing took."""
    radii = cn.pre.grains.uniform(options.spheres, 0.4 * DIAMETER, 0.6 * DIAMETER, rng=options.seed)
    side = float(np.cbrt(np.sum(4 / 3 * np.pi * radii**3) / 0.58 / 1.5))  # half as high again as wide
    started = time.perf_counter()
    centers = cn.pre.deposit_spheres(radii, (side, side))
    packed = time.perf_counter() - started
    height = float(np.max(centers[:, 2] + radii))
    glass = cn.Material("glass", density=DENSITY)
    scene = cn.Scene(dim=3, gravity=(0.0, 0.0, -GRAVITY))
    scene.add(cn.spheres(centers, radii, glass))
    scene.add(cn.box((0, 0, 0), (side, side, height), glass, lid=False))
    scene.interact("*", "*", cn.Coulomb(mu=FRICTION))  # the ball, too, which is not there yet
    strategy = cn.NSCD(theta=0.6, solver=cn.NLGS(tol=1e-4, max_iter=200), threads=options.threads)
    return cn.Simulation(scene, STEP, strategy), (side, side, height), packed


def carried(simulation, spheres, floor_only=False):
    """Upward force of the floor, or of floor and walls, on the content of the box [N]. The five walls follow the spheres."""
    pairs, up = simulation.contacts.bodies, simulation.contacts.force[:, 2]
    first = spheres + 4 if floor_only else spheres
    wall = (pairs >= first) & (pairs < spheres + 5)
    return float(np.sum(up[wall[:, 1]]) - np.sum(up[wall[:, 0]]))


def measures(simulation, lengths, spheres):
    """Loads of floor and walls, coordination number, solid fraction: name -> (value, unit)."""
    contacts, bodies = simulation.contacts, simulation.bodies
    weight = float(bodies.mass[:spheres].sum()) * GRAVITY
    floor, everything = carried(simulation, spheres, floor_only=True), carried(simulation, spheres)
    carrying = np.any(contacts.impulse != 0.0, axis=1)
    pairs = contacts.bodies[carrying]
    held = np.append(np.bincount(pairs.ravel(), minlength=spheres + 5)[:spheres] >= 2, np.zeros(5, bool))
    between = np.all(held[pairs], axis=1)
    position, radii = bodies.position[:spheres], simulation.radii()[:spheres]
    top = float(np.quantile(position[:, 2], 0.9))
    return {
        "weight carried": (everything / weight, "of the weight"),
        "  by the floor": (floor / weight, "of the weight"),
        "  by friction on the walls": ((everything - floor) / weight, "of the weight"),
        "coordination number": (float(2 * between.sum() / max(held.sum(), 1)), "between spheres, without rattlers"),
        "rattlers": (float(np.mean(~held[:spheres])), "of the spheres"),
        "solid fraction": (cn.pre.solid_fraction(position, radii, (0, 0, 0), (*lengths[:2], top)), ""),
    }


def drop_ball(simulation, lengths):
    """Inserts the ball just above the bed, at the speed of its fall; returns its id and its height [m]."""
    steel = cn.Material("steel", density=HEAVY * DENSITY)
    height = lengths[2] + BALL * 1.01
    center = (lengths[0] / 2, lengths[1] / 2, height)
    velocity = (0.0, 0.0, -np.sqrt(2 * GRAVITY * FALL))
    return int(simulation.add(cn.spheres([center], BALL, steel, velocity=velocity, group="ball"))[0]), height


def draw(run, lengths, folder):
    """The bed at the start, half-way and at the end with its speeds; forces at the contacts; the animation."""
    import matplotlib.pyplot as plt
    from matplotlib.animation import PillowWriter

    def panel(ax, step):
        height = step.bodies["position"][:, 2] / lengths[2]
        title = f"t = {step.time:.3g} s"
        plots.plot_step(step, height, ax=ax, limits=HEIGHTS, colorbar=False, title=title, cmap="viridis")

    figure, axes = plt.subplots(1, 4, figsize=(13.0, 4.4), layout="constrained")
    for ax, k in zip(axes, (0, len(run) // 3, -1)):
        panel(ax, run[k])
    scale = plt.cm.ScalarMappable(plt.Normalize(*HEIGHTS), "viridis")
    figure.colorbar(scale, ax=list(axes[:3]), label="height of a centre / height of the box [-]", shrink=0.7, pad=0.01)
    point, force = run[-1].contacts["point"], np.linalg.norm(run[-1].contacts["impulse"], axis=1) / run.scene["dt"]
    mean = max(force.mean(), np.finfo(float).tiny)
    axes[3].scatter(point[force > 0, 0], point[force > 0, 2], s=20 * force[force > 0] / mean, **MARKS)
    for times in (1, 5, 20):  # areas go with forces
        axes[3].scatter([], [], s=20 * times, label=f"{times * mean:.2g} N", **MARKS)
    axes[3].legend(fontsize=8, frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    axes[3].set(xlabel="x [m]", ylabel="z [m]", aspect="equal")
    axes[3].set_title("Contact forces, from the side", fontsize=10, loc="left")
    figure.savefig(folder / f"{NAME}.png", dpi=120)
    plt.close(figure)
    figure, ax = plt.subplots(figsize=(4.0, 6.0), layout="constrained")
    writer = PillowWriter(fps=10)
    with writer.saving(figure, folder / f"{NAME}.gif", 80):
        for step in run:
            ax.clear()
            from_the_side(ax, step, lengths)
            writer.grab_frame()
    plt.close(figure)


def from_the_side(ax, step, lengths):
    """Spheres of one output as they are seen along y, the nearest last; coloured by speed."""
    grain = step.bodies["radius"] > 0
    position, radii = step.bodies["position"][grain], step.bodies["radius"][grain]
    speed = np.linalg.norm(step.bodies["velocity"][grain, :3], axis=1)
    order = np.argsort(-position[:, 1])
    style = {"cmap": "viridis", "clim": (0.0, 0.5), "edgecolor": "white"}
    disks = plots.draw_disks(ax, position[order][:, [0, 2]], radii[order], **style)
    disks.set(array=speed[order], linewidth=0.3)
    ax.set(xlim=(0, lengths[0]), ylim=(0, 1.5 * lengths[2]), aspect="equal", xlabel="x [m]", ylabel="z [m]")
    ax.set_title(f"speed (yellow: 0.5 m/s or more), t = {step.time:.3g} s", fontsize=10, loc="left")


def main(arguments=None):
    """Runs, prints the figures, draws; returns the figures."""
    options = options_from(arguments)
    simulation, lengths, packed = build(options)
    options.output.mkdir(parents=True, exist_ok=True)
    path = options.output / f"{NAME}.vtkhdf"
    quiet = max(options.steps // 4, 1)
    simulation.run(quiet, progress=False)
    rest = measures(simulation, lengths, options.spheres)
    ball, height = drop_ball(simulation, lengths)
    simulation.run(options.steps - quiet, output=path, every=max(options.steps // options.frames, 1), overwrite=True)
    position = simulation.bodies.position[ball]
    weight = float(simulation.bodies.mass[: options.spheres].sum() + simulation.bodies.mass[ball]) * GRAVITY
    with cn.load(path) as run:
        history = run.history
        figures = {"spheres": (options.spheres, ""), "time of packing": (packed, "s")}
        figures |= rest
        figures |= {
            "depth of the ball": (float(height - position[2]) / DIAMETER, "grains"),
            "weight carried with the ball": (carried(simulation, options.spheres) / weight, "of the weight"),
            "error, last": (float(history["error"][-1]), ""),
            "iterations, mean": (float(np.mean(history["iterations"])), ""),
            "overlap, deepest": (float(np.max(history["penetration"])), "of a radius"),
        }
        for name, (value, unit) in figures.items():
            print(f"{name:28s} {value:.4g} {unit}".rstrip())
        draw(run, lengths, options.output)
    return figures


if __name__ == "__main__":
    main()
