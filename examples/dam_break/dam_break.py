"""A dam breaks against an obstacle: a column of water falls, runs along the bed and strikes a block that may slide.

Engineers ask for the load of a surge on structures in its way. Water is a meshless fluid, in the same step as the contact of the
block with the bed: it pushes the block once its thrust exceeds friction, and piles up in front of it.

Run it:  python dam_break.py              1,600 particles, half a minute
         python dam_break.py --full       6,400 particles
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cairn as cn
import numpy as np

NAME = "dam_break"
GRAVITY, WATER = 9.81, 1000.0


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--spacing", type=float, default=0.025, help="of the particles [m]")
    parser.add_argument("--full", action="store_true", help="half the spacing")
    parser.add_argument("--mu", type=float, default=0.4, help="friction of the block on the bed")
    parser.add_argument("--density", type=float, default=1800.0, help="of the block [kg/m3]")
    parser.add_argument("--seconds", type=float, default=1.0)
    parser.add_argument("--dt", type=float, default=2e-3, help="[s]")
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--output", type=Path, default=Path("."))
    options = parser.parse_args(arguments)
    if options.full:
        options.spacing = 0.0125
    return options


def build(options):
    """A tank of 3 m with a column of water 1 m x 1 m on its left, and a block of 0.2 m in the middle."""
    ground, stone = cn.Material("ground", density=2600.0), cn.Material("stone", density=options.density)
    scene = cn.Scene(dim=2, gravity=(0.0, -GRAVITY))
    scene.add(cn.wall((0, 0), (0, 1), ground), cn.wall((0, 0), (1, 0), ground), cn.wall((3, 0), (-1, 0), ground))
    square = 0.1 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    block = scene.add(cn.polygons(square, stone, position=[[1.7, 0.1]]))[0]
    scene.add(cn.fluid([(0, 0), (1, 1)], options.spacing, WATER))
    scene.interact("*", "*", cn.Coulomb(mu=options.mu))
    return cn.Simulation(scene, dt=options.dt), block


def main(arguments=None):
    """Lets the water go until the time is over; prints and draws; returns the figures."""
    options = options_from(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    sim, block = build(options)
    thrust, front = [], []

    def follow(sim):
        thrust.append(sim.fluid.force_on(block)[0])
        front.append(np.quantile(sim.fluid.position[:, 0], 0.999))

    steps = round(options.seconds / options.dt)
    path = options.output / f"{NAME}.vtkhdf"
    start = float(sim.bodies.position[sim.bodies.id == block][0, 0])
    sim.run(steps, output=path, every=max(steps // options.frames, 1), callback=follow, overwrite=True)
    slid = float(sim.bodies.position[sim.bodies.id == block][0, 0]) - start
    reached = np.flatnonzero(np.array(front) > 1.6)
    figures = {
        "particles": (len(sim.fluid), ""),
        "water reaches the block at": (options.dt * (reached[0] + 1) if len(reached) else np.nan, "s"),
        "greatest thrust": (max(thrust), "N/m"),
        "block slides by": (slid, "m"),
        "greatest compression": (sim.fluid.info["compression"], ""),
        "sub-steps of the last step": (sim.fluid.info["sub_steps"], ""),
    }
    for name, (value, unit) in figures.items():
        print(f"{name:28s} {value:.4g} {unit}".rstrip())
    draw(path, options)
    return {name: (float(value), unit) for name, (value, unit) in figures.items()}


def draw(path, options):
    """Four moments, coloured by speed."""
    import matplotlib.pyplot as plt
    from cairn.post.fluid_plots import plot_fluid

    figure, axes = plt.subplots(4, 1, figsize=(8, 9), layout="constrained")
    with cn.load(path) as run:
        for ax, k in zip(axes, np.linspace(len(run) // 5, len(run) - 1, 4).round().astype(int)):
            step = run[int(k)]
            view = ((-0.05, 3.05), (-0.05, 1.1))
            plot_fluid(step, "speed", ax=ax, view=view, limits=(0, 4), title=f"{step.time:.2f} s")
    figure.savefig(options.output / f"{NAME}.png", dpi=100)
    plt.close(figure)


if __name__ == "__main__":
    main()
