"""A leaning wall: a dry wall on a table that is tilted until it falls, with what limit analysis says of the angle.

Tilting is the old test of masonry: turning gravity adds to each block a horizontal force in proportion to its weight, as an
earthquake would in the simplest account. A panel of blocks in running bond does not fall as one: its joints let a part of it
go, bounded by a stair of joints, at a lower angle than that at which a single block of its shape would overturn. The linear
programme of `cairn.post.limit_analysis` finds the angle and the part; the simulation tilts slowly until something moves.

Run it:  python leaning_wall.py              a panel of 6 by 10 blocks
         python leaning_wall.py --full       12 by 20 blocks, tilted four times as slowly
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cairn as cn
import numpy as np
from cairn.post import limit_analysis, masonry_plots
from cairn.post.masonry import Structure
from cairn.pre import masonry

NAME = "leaning_wall"
DENSITY, GRAVITY = 2000.0, 9.81


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--columns", type=int, default=6)
    parser.add_argument("--courses", type=int, default=10)
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--mu", type=float, default=0.65)
    parser.add_argument("--rate", type=float, default=2.0, help="of tilting [degrees/s]")
    parser.add_argument("--dt", type=float, default=5e-3, help="[s]")
    parser.add_argument("--start", type=float, default=0.9, help="share of the angle of limit analysis to begin at")
    parser.add_argument("--frames", type=int, default=30)
    parser.add_argument("--output", type=Path, default=Path("."))
    options = parser.parse_args(arguments)
    if options.full:
        options.columns, options.courses, options.rate = 12, 20, 0.5
    return options


def main(arguments=None):
    """Tilts the wall until it falls; prints angles, draws; returns the figures."""
    options = options_from(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    blocks = masonry.panel(options.columns, options.courses, brick=(0.4, 0.2))
    assembly = limit_analysis.Assembly(blocks, options.mu, DENSITY)
    limit = assembly.collapse(np.column_stack((assembly.mass * GRAVITY, np.zeros(len(blocks)))))
    expected = np.degrees(np.arctan(limit.multiplier))
    first = options.start * expected

    def gravity(t):
        angle = np.radians(first + options.rate * t)
        return GRAVITY * np.array([np.sin(angle), -np.cos(angle)])

    scene = cn.Scene(dim=2, gravity=gravity)
    ids = blocks.add_to(scene, cn.Material("stone", density=DENSITY))
    scene.interact("*", "*", cn.Coulomb(mu=options.mu))
    strategy = cn.NSCD(theta=1.0, solver=cn.NLGS(tol=1e-6, max_iter=5000), threads=1)
    simulation = cn.Simulation(scene, options.dt, strategy)
    structure = Structure(blocks, simulation, ids)
    height = options.courses * 0.2
    fallen = []

    def follow(sim):
        gone = float(structure.displacement().max())
        if not fallen and gone > 1e-3 * height:
            fallen.append(first + options.rate * sim.time)
        return gone > 0.15 * height

    steps = int(0.5 * expected / options.rate / options.dt)
    every = max(steps // options.frames // 4, 1)
    run(simulation, steps, options.output / f"{NAME}.vtkhdf", every, follow)
    sets = structure.moving_sets(0.02)
    figures = {
        "blocks": (len(blocks) - 1, ""),
        "angle by limit analysis": (expected, "degrees"),
        "angle of the fall": (fallen[0] if fallen else float("nan"), "degrees"),
        "blocks left standing": (len(sets[0]) - 1, ""),
        "largest moving set": (max((len(s) for s in sets[1:]), default=0), "blocks"),
    }
    for name, (value, unit) in figures.items():
        print(f"{name:26s} {value:.4g} {unit}".rstrip())
    draw(structure, limit, options.output)
    return figures


def run(simulation, steps, path, every, follow):
    """Runs until `follow` says the wall has fallen."""

    class Fallen(Exception):
        pass

    def watch(sim):
        if follow(sim):
            raise Fallen

    try:
        simulation.run(steps, output=path, every=every, callback=watch, overwrite=True)
    except Fallen:
        pass


def draw(structure, limit, folder):
    """The fallen wall beside the mechanism of limit analysis."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(11, 4.8), layout="constrained")
    speed = np.linalg.norm(limit.mechanism[:, :2], axis=1)
    shown = speed / speed.max()
    now = structure.places
    structure.places = lambda: structure.start
    masonry_plots.draw(structure, ax=axes[0], what=shown, forces=False, largest=1.0, title="mechanism of limit analysis")
    structure.places = now
    masonry_plots.draw(structure, ax=axes[1], what="displacement", forces=False, title="the wall as it falls")
    figure.savefig(folder / f"{NAME}.png", dpi=110)
    plt.close(figure)


if __name__ == "__main__":
    main()
