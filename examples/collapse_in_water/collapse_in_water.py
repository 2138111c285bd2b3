"""A column of gravel collapses in water and in air: slides that enter water run slower, and less far in the same time.

Engineers ask how far a slope runs out below the level of a lake. Water flows among grains that are smaller than its particles:
it lifts them by its pressure and drags them by their porosity, and they push it (cn.GrainDrag). A board that holds the column
until it is at rest is taken away; the same column then falls without water.

Run it:  python collapse_in_water.py              some 200 grains and 900 particles, half a minute
         python collapse_in_water.py --full       half the sizes of grains and particles
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cairn as cn
import numpy as np

NAME = "collapse_in_water"
GRAVITY, WATER, REST = 9.81, 1000.0, 0.3  # [m/s2], [kg/m3], time behind the board [s]


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--radius", type=float, default=0.008, help="of the largest grains [m]")
    parser.add_argument("--spacing", type=float, default=0.0216, help="of the particles of water [m]")
    parser.add_argument("--full", action="store_true", help="half the radius and the spacing")
    parser.add_argument("--wide", type=float, default=0.24, help="the column, as high as wide [m]")
    parser.add_argument("--mu", type=float, default=0.5, help="friction of grains and bed")
    parser.add_argument("--viscosity", type=float, default=1e-3, help="of water [Pa s]")
    parser.add_argument("--seconds", type=float, default=0.8, help="after the board is gone")
    parser.add_argument("--dt", type=float, default=2e-3, help="[s]")
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--output", type=Path, default=Path("."))
    options = parser.parse_args(arguments)
    if options.full:
        options.radius, options.spacing = options.radius / 2, options.spacing / 2
    return options


def build(options, wet):
    """Disks in rows behind a board, in a tank of five widths that water fills to one and a half."""
    rock, sand, wood = (cn.Material(name, density=2600.0) for name in ("rock", "sand", "wood"))
    wide, r = options.wide, options.radius
    end = 5 * wide
    scene = cn.Scene(dim=2, gravity=(0.0, -GRAVITY))
    scene.add(cn.wall((0, 0), (0, 1), rock), cn.wall((0, 0), (1, 0), rock), cn.wall((end, 0), (-1, 0), rock))
    outline = np.array([(-0.05, -1), (0.05, -1), (0.05, 1), (-0.05, 1)]) * wide
    board = scene.add(cn.polygons(outline, wood, position=[(1.05 * wide, wide)], driven=("vx", "vy", "w")))
    high = 1.02 * np.sqrt(3) * r
    rows = [(np.arange(1.02 * r * (1 + k % 2), wide - r, 2.04 * r), 1.02 * r + k * high) for k in range(int(wide / high))]
    at = np.array([(x, y) for xs, y in rows for x in xs])
    sizes = r * np.random.default_rng(1).uniform(0.8, 1.0, len(at))
    grains = scene.add(cn.disks(at, sizes, sand))
    scene.interact("*", "*", cn.Coulomb(mu=options.mu))
    if wet:
        scene.add(cn.fluid([(0, 0), (end, 1.5 * wide)], options.spacing, WATER, options.viscosity, smoothing=2))
        scene.interact("fluid", rock, cn.FreeSlip())
        scene.interact("fluid", wood, None)
        scene.interact("fluid", sand, cn.GrainDrag())
    return cn.Simulation(scene, dt=options.dt), board, grains


def collapse(options, wet, path):
    """Runs one collapse; front and height of the grains over the width of the column at each step after the board."""
    sim, board, grains = build(options, wet)
    seen = []

    def follow(sim):
        place = sim.bodies.position[np.isin(sim.bodies.id, grains)] / options.wide
        seen.append((np.quantile(place[:, 0], 0.95), np.quantile(place[:, 1], 0.95)))

    for _ in range(round(REST / options.dt)):
        sim.step()
    sim.remove(board)
    steps = round(options.seconds / options.dt)
    sim.run(steps, output=path, every=max(steps // options.frames, 1), callback=follow, overwrite=True)
    return sim, np.array(seen)


def main(arguments=None):
    """Lets the column fall in water and in air; prints and draws; returns the figures."""
    options = options_from(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    paths = [options.output / f"{NAME}{ending}.vtkhdf" for ending in ("", "_dry")]
    sim, wet = collapse(options, True, paths[0])
    _, dry = collapse(options, False, paths[1])
    times = options.dt * np.arange(1, len(wet) + 1)
    reached = [times[np.argmax(a[:, 0] > 1.5)] if a[-1, 0] > 1.5 else np.nan for a in (wet, dry)]
    figures = {
        "grains": (int(np.sum(np.isfinite(sim.bodies.mass))), ""),
        "particles": (len(sim.fluid), ""),
        "front at 1.5 widths, in water": (reached[0], "s"),
        "front at 1.5 widths, in air": (reached[1], "s"),
        "front at the end, in water": (wet[-1, 0], "widths"),
        "front at the end, in air": (dry[-1, 0], "widths"),
        "height at the end, in water": (wet[-1, 1], "widths"),
        "height at the end, in air": (dry[-1, 1], "widths"),
        "least porosity": (float(np.min(sim.fluid.porosity)), ""),
    }
    for name, (value, unit) in figures.items():
        print(f"{name:32s} {value:.4g} {unit}".rstrip())
    draw(paths, options)
    return {name: (float(value), unit) for name, (value, unit) in figures.items()}


def draw(paths, options):
    """Three moments, in water and in air, coloured by speed."""
    import matplotlib.pyplot as plt
    from cairn.post.plots import plot_step

    figure, axes = plt.subplots(3, 2, figsize=(11, 6), layout="constrained")
    view = ((-0.02 * options.wide, 4 * options.wide), (-0.02 * options.wide, 1.6 * options.wide))
    for column, path in zip(axes.T, paths):
        with cn.load(path) as run:
            for ax, k in zip(column, np.linspace(len(run) // 4, len(run) - 1, 3).round().astype(int)):
                step = run[int(k)]
                title = f"{'water' if path == paths[0] else 'air'}, {step.time - REST:.2f} s"
                plot_step(step, "velocity", ax=ax, view=view, limits=(0, 1), title=title)
                if path == paths[0]:
                    x, y = step.fluid["position"].T
                    ax.scatter(x, y, s=6, color="#7fb2e5", linewidths=0, zorder=0)
    figure.savefig(options.output / f"{NAME}.png", dpi=100)
    plt.close(figure)


if __name__ == "__main__":
    main()
