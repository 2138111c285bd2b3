"""Rotating drum: spheres avalanche in a turning cylinder; the angle of the surface is measured.

A cylinder half full of grains turns slowly about its horizontal axis. Near the wall grains rise with it as a solid; at the
surface they flow down in a thin fast layer. The angle of the surface is steady when the drum is neither so slow that avalanches
are intermittent (Froude number R w^2 / g below about 1e-4) nor so fast that the surface curves into an S and grains are flung
(above about 0.1). For rough spheres with friction it lies between 20 and 35 degrees.

The drum is a tube, a cylinder seen from inside; the scene is periodic along its axis, so that it has no end walls, whose
friction would raise the angle. Friction alone turns the grains with the drum.

Run it:  python drum.py            600 spheres, about a minute
         python drum.py --help
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cairn as cn
import numpy as np
from cairn.post import plots

NAME = "drum"
DIAMETER = 0.01  # mean [m]
DENSITY, FRICTION, GRAVITY = 2500.0, 0.5, 9.81
DEPTH = 5 * DIAMETER  # period along the axis [m]
FROUDE = 5e-3
STEP = 1e-3  # [s]
FILLED = 0.45  # share of the drum that the packing fills


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--spheres", type=int, default=600)
    parser.add_argument("--turns", type=float, default=0.5, help="of the drum; the second half is measured (0.5)")
    parser.add_argument("--froude", type=float, default=FROUDE, help="R w^2 / g (0.005)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--frames", type=int, default=50)
    parser.add_argument("--output", type=Path, default=Path("."))
    return parser.parse_args(arguments)


def build(options):
    """The simulation, the drum's radius [m] and its angular velocity [rad/s]. The axis is y, gravity along -z."""
    radii = cn.pre.grains.uniform(options.spheres, 0.4 * DIAMETER, 0.6 * DIAMETER, rng=options.seed)
    volume = float(np.sum(4 / 3 * np.pi * radii**3))
    radius = np.sqrt(volume / 0.58 / (np.pi * DEPTH * FILLED))
    # a packing in a box of the drum's chord is dropped into it: its corners must lie inside the circle
    width = 1.5 * radius
    centers = cn.pre.deposit_spheres(radii, (width, DEPTH))
    height = float(np.max(centers[:, 2] + radii))
    centers += (-width / 2, 0.0, -np.sqrt(radius**2 - (width / 2) ** 2))
    if np.max(np.hypot(centers[:, 0], centers[:, 2]) + radii) > radius:
        raise ValueError(f"spheres is {options.spheres}: the packing, {height:.3g} m high, does not fit the drum; give more")
    spin = np.sqrt(options.froude * GRAVITY / radius)
    glass, drum = cn.Material("glass", density=DENSITY), cn.Material("drum")
    scene = cn.Scene(dim=3, gravity=(0.0, 0.0, -GRAVITY), periodic=cn.Periodic((np.inf, DEPTH, np.inf)))
    left = centers[:, 0] < 0.0  # two colours, to see the grains mix
    scene.add(cn.spheres(centers[left], radii[left], glass, group="left half"))
    scene.add(cn.spheres(centers[~left], radii[~left], glass, group="right half"))
    scene.add(cn.tube((0, 0, 0), (0, 1, 0), radius, drum, velocity=(0, 0, 0, 0, -spin, 0), group="drum"))
    scene.interact("*", "*", cn.Coulomb(mu=FRICTION))
    strategy = cn.NSCD(solver=cn.NLGS(tol=1e-3, max_iter=100), threads=options.threads)
    return cn.Simulation(scene, STEP, strategy), radius, spin


def surface_angle(position, radius):
    """Slope of the free surface [degrees]: a line through the highest grains of the middle of the drum.

    position (n, 3) [m]. A drum that turns to negative angles about y lifts the grains on the side of positive x.
    """
    width = 1.5 * DIAMETER
    columns = np.floor(position[:, 0] / width).astype(int)
    middle = np.abs((columns + 0.5) * width) < 0.55 * radius
    found = np.unique(columns[middle])
    top = [position[columns == c, 2].max() for c in found]
    slope = np.polyfit((found + 0.5) * width, top, 1)[0] if len(found) > 1 else 0.0
    return float(np.degrees(np.arctan(slope)))


def draw(run, angles, radius, folder):
    """The drum at the start and at the end seen along its axis, speeds, and the angle over time; the animation."""
    import matplotlib.pyplot as plt
    from matplotlib.animation import PillowWriter

    def panel(ax, step, values, **style):
        grain = step.bodies["radius"] > 0
        position, r = step.bodies["position"][grain], step.bodies["radius"][grain]
        order = np.argsort(-position[:, 1])  # nearest last
        disks = plots.draw_disks(ax, position[order][:, [0, 2]], r[order], edgecolor="white", **style)
        disks.set_linewidth(0.3)
        disks.set_array(values[grain][order])
        ax.add_patch(plt.Circle((0, 0), radius, fill=False, lw=1.5))
        ax.set(xlim=(-1.05 * radius, 1.05 * radius), ylim=(-1.05 * radius, 1.05 * radius), aspect="equal")
        ax.axis("off")
        return disks

    figure, axes = plt.subplots(2, 2, figsize=(9.0, 7.6), layout="constrained")
    axes = axes.ravel()
    colours = {"cmap": "coolwarm", "clim": (0, 1)}
    for ax, k in zip(axes, (0, -1)):
        panel(ax, run[k], run[k].bodies["material"], **colours)
        ax.set_title(f"t = {run[k].time:.3g} s, by place at the start", fontsize=11)
    speed = np.linalg.norm(run[-1].bodies["velocity"][:, :3], axis=1)
    shown = panel(axes[2], run[-1], speed, cmap="viridis", clim=(0, float(np.quantile(speed, 0.99)) or 1.0))
    figure.colorbar(shown, ax=axes[2], label="speed [m/s]", shrink=0.8)
    axes[2].set_title(f"t = {run[-1].time:.3g} s, by speed", fontsize=11)
    axes[3].plot(run.history["time"], run.history["angle"], lw=0.8)
    axes[3].set(xlabel="time [s]", ylabel="angle of the surface [degrees]", ylim=(0, None))
    axes[3].set_title(f"{angles[0]:.1f} ± {angles[1]:.1f} degrees in the second half", fontsize=11)
    figure.savefig(folder / f"{NAME}.png", dpi=110)
    plt.close(figure)
    figure, ax = plt.subplots(figsize=(4.5, 4.5), layout="constrained")
    writer = PillowWriter(fps=15)
    with writer.saving(figure, folder / f"{NAME}.gif", 80):
        for step in run:
            ax.clear()
            panel(ax, step, step.bodies["material"], **colours)
            writer.grab_frame()
    plt.close(figure)


def main(arguments=None):
    """Runs, prints the figures, draws; returns the figures."""
    options = options_from(arguments)
    simulation, radius, spin = build(options)
    options.output.mkdir(parents=True, exist_ok=True)
    path = options.output / f"{NAME}.vtkhdf"
    steps = max(int(options.turns * 2 * np.pi / spin / STEP), 2)
    simulation.run(
        steps,
        output=path,
        every=max(steps // options.frames, 1),
        probes={"angle": lambda sim: surface_angle(sim.bodies.position[: options.spheres], radius)},
        overwrite=True,
    )
    with cn.load(path) as run:
        history = run.history
        late = history["angle"][len(history["angle"]) // 2 :]
        angles = float(np.mean(late)), float(np.std(late))
        figures = {
            "spheres": (options.spheres, ""),
            "radius of the drum": (radius / DIAMETER, "diameters"),
            "turns a minute": (spin * 60 / (2 * np.pi), ""),
            "angle of the surface": (angles[0], "degrees"),
            "  its fluctuation": (angles[1], "degrees"),
            "contacts": (float(np.mean(history["contacts"])), "candidates"),
            "error, median": (float(np.median(history["error"])), ""),
            "iterations, mean": (float(np.mean(history["iterations"])), ""),
            "overlap, deepest": (float(np.max(history["penetration"])), "of a radius"),
        }
        for name, (value, unit) in figures.items():
            print(f"{name:28s} {value:.4g} {unit}".rstrip())
        draw(run, angles, radius, options.output)
    return figures


if __name__ == "__main__":
    main()
