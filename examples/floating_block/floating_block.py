"""A block is let go above its draft, bobs and floats: Archimedes' law in a tank.

The block is lighter than water; where it comes to rest, its draft is its height times the ratio of densities.

Run it:  python floating_block.py                 450 particles, half a minute
         python floating_block.py --ratio 0.2
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cairn as cn
import numpy as np

NAME = "floating_block"
GRAVITY, WATER, WIDTH, HEIGHT = 9.81, 1000.0, 1.6, 0.7


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--spacing", type=float, default=0.05, help="of the particles [m]")
    parser.add_argument("--ratio", type=float, default=0.5, help="density of the block over that of water")
    parser.add_argument("--wide", type=float, default=0.5, help="of the block [m]")
    parser.add_argument("--high", type=float, default=0.3, help="of the block [m]")
    parser.add_argument("--seconds", type=float, default=2.5)
    parser.add_argument("--dt", type=float, default=4e-3, help="[s]")
    parser.add_argument("--frames", type=int, default=30)
    parser.add_argument("--output", type=Path, default=Path("."))
    return parser.parse_args(arguments)


def build(options):
    """A tank of water, and a block that touches its surface."""
    ground, wood = cn.Material("ground", density=2600.0), cn.Material("wood", density=options.ratio * WATER)
    scene = cn.Scene(dim=2, gravity=(0.0, -GRAVITY))
    scene.add(cn.wall((0, 0), (0, 1), ground), cn.wall((0, 0), (1, 0), ground), cn.wall((WIDTH, 0), (-1, 0), ground))
    corners = 0.5 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * (options.wide, options.high)
    block = scene.add(cn.polygons(corners, wood, position=[[WIDTH / 2, HEIGHT + 0.2 * options.high]]))[0]
    scene.add(cn.fluid([(0, 0), (WIDTH, HEIGHT)], options.spacing, WATER, artificial=0.05))
    scene.interact("*", "*", cn.Coulomb(mu=0.4))
    return cn.Simulation(scene, dt=options.dt), block


def main(arguments=None):
    """Lets the block go until the time is over; prints and draws; returns the figures."""
    options = options_from(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    sim, block = build(options)
    height, lift = [], []

    def follow(sim):
        height.append(float(sim.bodies.position[sim.bodies.id == block][0, 1]))
        lift.append(sim.fluid.force_on(block)[1])

    steps = round(options.seconds / options.dt)
    path = options.output / f"{NAME}.vtkhdf"
    sim.run(steps, output=path, every=max(steps // options.frames, 1), callback=follow, overwrite=True)
    volume = len(sim.fluid) * options.spacing**2 + options.ratio * options.wide * options.high
    late = slice(2 * steps // 3, None)
    draft = volume / WIDTH - (np.mean(height[late]) - options.high / 2)
    weight = options.ratio * WATER * GRAVITY * options.wide * options.high
    figures = {
        "particles": (len(sim.fluid), ""),
        "draft": (draft, "m"),
        "draft by Archimedes": (options.ratio * options.high, "m"),
        "mean lift over weight": (np.mean(lift[late]) / weight, ""),
        "tilt in the end": (abs(float(sim.bodies.rotation[sim.bodies.id == block][0])), "rad"),
    }
    for name, (value, unit) in figures.items():
        print(f"{name:28s} {value:.4g} {unit}".rstrip())
    draw(path, options.dt * np.arange(1, steps + 1), np.array(height), draft, options)
    return {name: (float(value), unit) for name, (value, unit) in figures.items()}


def draw(path, time, height, draft, options):
    """The end, coloured by pressure, and the height of the block over time."""
    import matplotlib.pyplot as plt
    from cairn.post.fluid_plots import plot_fluid

    figure, axes = plt.subplots(1, 2, figsize=(11, 4), layout="constrained")
    with cn.load(path) as run:
        plot_fluid(run[-1], "pressure", ax=axes[0], view=((-0.05, WIDTH + 0.05), (-0.05, HEIGHT + 0.4)))
    axes[1].plot(time, height, color="#1f5f8b")
    axes[1].axhline(np.mean(height[2 * len(height) // 3 :]), color="#999999", lw=0.8)
    due = options.ratio * options.high
    axes[1].set(xlabel="time [s]", ylabel="height of the centre [m]", title=f"draft {draft:.3f} m, {due:.3f} m due")
    figure.savefig(options.output / f"{NAME}.png", dpi=100)
    plt.close(figure)


if __name__ == "__main__":
    main()
