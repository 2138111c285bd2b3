"""An arch on supports that spread: the thrust falls to its least at once, hinges open, and the arch stands until they pass.

The supports of a semicircular arch of voussoirs move apart. As soon as they do, three hinges form, at the crown and at the
haunches, and the thrust line touches the edges there: of all the thrusts with which the arch could stand, the supports feel
the least (Heyman 1966). The arch then deforms as a mechanism of stable pieces and carries itself for a long way, until the
thrust line leaves it at the springings (Ochsendorf 2006).

The least thrust is also found by a linear programme over all states of equilibrium, `cairn.post.limit_analysis`, to compare.

Run it:  python arch_on_spreading_supports.py            31 voussoirs, half a minute
         python arch_on_spreading_supports.py --full     101 voussoirs
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cairn as cn
import numpy as np
from cairn.post import limit_analysis, masonry_plots
from cairn.post.masonry import Structure
from cairn.pre import loads, masonry

NAME = "arch_on_spreading_supports"
DENSITY, GRAVITY = 2000.0, 9.81


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--voussoirs", type=int, default=31)
    parser.add_argument("--full", action="store_true", help="101 voussoirs, 4000 steps")
    parser.add_argument("--thickness", type=float, default=0.15, help="over the radius, which is 5 m")
    parser.add_argument("--spread", type=float, default=0.3, help="by which the supports move apart, over the radius")
    parser.add_argument("--mu", type=float, default=0.8)
    parser.add_argument("--steps", type=int, default=1500)
    parser.add_argument("--dt", type=float, default=8e-3, help="[s]")
    parser.add_argument("--frames", type=int, default=30)
    parser.add_argument("--output", type=Path, default=Path("."))
    options = parser.parse_args(arguments)
    if options.full:
        options.voussoirs, options.steps, options.dt = 101, 4000, 3e-3
    return options


def build(options):
    """The arch, its supports driven apart from t = 0 on."""
    radius = 5.0
    blocks = masonry.arch(radius=radius, thickness=options.thickness * radius, voussoirs=options.voussoirs)
    scene = cn.Scene(dim=2, gravity=(0.0, -GRAVITY))
    sets, rows = blocks.sets(cn.Material("stone", density=DENSITY))
    duration = options.steps * options.dt
    pull = loads.displaced((options.spread * radius / 2, 0.0, 0.0), duration, ramp=0.05)
    sides = np.array([[-1.0], [1.0]])
    motion = cn.Table(pull.times, pull.values[:, 0])
    ids = scene.add(sets[0], sets[1].with_(drive=lambda t: sides * [motion(t), 0.0, 0.0]))[rows]
    scene.interact("*", "*", cn.Coulomb(mu=options.mu))
    simulation = cn.Simulation(scene, options.dt, cn.NSCD(theta=1.0, solver=cn.NLGS(tol=1e-6, max_iter=5000), threads=1))
    return Structure(blocks, simulation, ids)


def main(arguments=None):
    """Spreads the supports until the arch falls or they are where they go; prints and draws; returns the figures."""
    import matplotlib.pyplot as plt

    options = options_from(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    structure, n = build(options), options.voussoirs
    assembly = limit_analysis.Assembly(structure.blocks, options.mu, DENSITY)
    bounds = sorted(abs(x.multiplier) for x in assembly.force_bounds(n, (1.0, 0.0)))
    weight = assembly.mass[:n].sum() * GRAVITY
    records, fallen, chain = [], [], [n, *range(n), n + 1]
    pictures = {}

    def follow(sim):
        apart = float(np.ptp(structure.places()[0][n:, 0]) - np.ptp(structure.start[0][n:, 0])) / 5.0
        r = structure.resultants()
        thrust = np.abs(r.force[(r.blocks >= n).any(axis=1), 0]).mean() / weight if len(r.force) else np.nan
        speed = structure.balance()["speed"]
        records.append((apart, thrust, len(r.hinges()), speed))
        if not fallen and speed > 1.0:
            fallen.append(apart)
        if sim.steps == max(options.steps // 4, 1):
            axes = plt.subplots(1, 2, figsize=(11.5, 4.4), layout="constrained")[1]
            masonry_plots.draw(structure, ax=axes[0], what=None, thrust=chain, title=f"supports apart by {apart:.3f} R")
            pictures["axes"] = axes

    every = max(options.steps // options.frames, 1)
    path = options.output / f"{NAME}.vtkhdf"
    structure.simulation.run(options.steps, output=path, every=every, callback=follow, overwrite=True)
    table = np.array(records)
    steady = table[(table[:, 0] > 0.01) & (table[:, 0] < 0.03)]
    figures = {
        "voussoirs": (n, ""),
        "least thrust / weight": (bounds[0] / weight, "by limit analysis"),
        "greatest thrust / weight": (bounds[1] / weight, "by limit analysis"),
        "thrust / weight": (float(np.median(steady[:, 1])) if len(steady) else float("nan"), "supports apart by 0.01 to 0.03 R"),
        "hinges": (int(np.median(steady[:, 2])) if len(steady) else 0, "joints"),
        "spread at the fall": (fallen[0] if fallen else float("nan"), "of the radius"),
    }
    for name, (value, unit) in figures.items():
        print(f"{name:26s} {value:.4g} {unit}".rstrip())
    draw(table, bounds, weight, pictures["axes"], options.output)
    return figures


def draw(table, bounds, weight, axes, folder):
    """The deformed arch with its thrust line, and the thrust over the spread; the animation."""
    import matplotlib.pyplot as plt

    ax = axes[1]
    still = table[:, 3] < 1.0
    ax.plot(table[still, 0], table[still, 1], color="#8c1515")
    for bound, name in zip(bounds, ("least", "greatest")):
        ax.axhline(bound / weight, color="#1f4e9c", linestyle="--", linewidth=1, label=f"{name} at the start, limit analysis")
    ax.set(xlabel="spread of the supports over the radius [-]", ylabel="thrust over weight [-]")
    ax.set_ylim(0.8 * bounds[0] / weight, 1.5 * bounds[1] / weight)
    ax.legend()
    ax.figure.savefig(folder / f"{NAME}.png", dpi=110)
    plt.close(ax.figure)


if __name__ == "__main__":
    main()
