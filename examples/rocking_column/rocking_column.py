"""A column of drums in an earthquake: rocking, and how much stronger a shock it takes with friction and size.

A free-standing column does not resonate: it lifts, rocks about its edges and loses energy at each impact (Housner 1963). The
duration of strong pulses overturns it rather than their peak. The ground is driven by a record: any CSV or PEER .AT2 file
(--record), or a synthetic one, filtered noise under an envelope with the frequency content of a near-field shock.

Run it:  python rocking_column.py                        six drums and a capital
         python rocking_column.py --record quake.AT2     a record of your own
         python rocking_column.py --full                 twelve drums of 24 sides, finer steps
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cairn as cn
import numpy as np
from cairn.post import masonry_plots
from cairn.post.masonry import Structure
from cairn.pre import loads, masonry

NAME = "rocking_column"
DENSITY, GRAVITY = 2700.0, 9.81


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--drums", type=int, default=6)
    parser.add_argument("--sides", type=int, default=12)
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--record", type=Path, default=None, help="CSV (time, acceleration) or PEER .AT2")
    parser.add_argument("--peak", type=float, default=0.3, help="ground acceleration, in g; 0 leaves the record as it is")
    parser.add_argument("--mu", type=float, default=0.7)
    parser.add_argument("--seconds", type=float, default=8.0)
    parser.add_argument("--dt", type=float, default=4e-3, help="[s]")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--output", type=Path, default=Path("."))
    options = parser.parse_args(arguments)
    if options.full:
        options.drums, options.sides, options.dt, options.seconds = 12, 24, 1e-3, 20.0
    return options


def synthetic_record(path, seed, seconds=20.0, step=0.01):
    """Writes a shock as CSV: noise through a filter of Kanai and Tajimi at 1.2 Hz, under an envelope that rises in 2 s."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds / step)) * step
    noise = rng.normal(size=len(t))
    omega, damping, x, v = 2 * np.pi * 1.2, 0.35, 0.0, 0.0
    found = []
    for n in noise:
        v += step * (-2 * damping * omega * v - omega**2 * x - n)
        x += step * v
        found.append(omega**2 * x + 2 * damping * omega * v)
    envelope = np.minimum(t / 2, 1) ** 2 * np.exp(-np.maximum(t - 4, 0) / 2)
    a = np.array(found) * envelope
    np.savetxt(path, np.column_stack((t, 3.0 * a / np.abs(a).max())), delimiter=",", header="time [s], acceleration [m/s2]")


def main(arguments=None):
    """Shakes the column; prints its response, draws; returns the figures."""
    options = options_from(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    path = options.record
    if path is None:
        path = options.output / f"{NAME}_record.csv"
        synthetic_record(path, options.seed)
    quake = loads.read_accelerogram(path)
    if options.peak:
        quake = quake.scaled(peak=options.peak * GRAVITY)
    blocks = masonry.column(options.drums, 6.0, 0.45, 0.38, sides=options.sides, capital=0.4)
    scene = cn.Scene(dim=3, gravity=(0.0, 0.0, -GRAVITY))
    sets, rows = blocks.sets(cn.Material("marble", density=DENSITY))
    made = [s.with_(drive=quake.drive((1.0, 0.0, 0.0))) if s.group == "support" else s for s in sets]
    ids = scene.add(*made)[rows]
    scene.interact("*", "*", cn.Coulomb(mu=options.mu))
    strategy = cn.NSCD(theta=0.5, solver=cn.NLGS(tol=1e-5, max_iter=2000), threads=1)
    simulation = cn.Simulation(scene, options.dt, strategy)
    structure = Structure(blocks, simulation, ids)
    top = options.drums  # the capital
    times, drift, lifted = [], [], []

    def follow(sim):
        where = structure.places()[0] - structure.start[0]
        times.append(sim.time)
        drift.append(where[top, 0] - where[-1, 0])
        lifted.append(float(structure.openings()["opening"].max()) if sim.steps % 5 == 0 else np.nan)

    steps = max(int(min(options.seconds, quake.times[-1]) / options.dt), 5)
    every = max(steps // options.frames, 1)
    simulation.run(steps, output=options.output / f"{NAME}.vtkhdf", every=every, callback=follow, overwrite=True)
    where = structure.places()[0] - structure.start[0]
    slid = np.diff(np.linalg.norm((where - where[-1])[: options.drums + 1, :2], axis=1), prepend=0.0)
    figures = {
        "peak of the ground": (quake.peak / GRAVITY, "g"),
        "largest drift of the top": (float(np.max(np.abs(drift))), "m"),
        "widest open joint": (float(np.nanmax(lifted)), "m"),
        "largest slip left at a joint": (float(np.max(np.abs(slid))), "m"),
        "stands": (float(where[top, 2] > -0.5), "1 if it does"),
    }
    for name, (value, unit) in figures.items():
        print(f"{name:30s} {value:.4g} {unit}".rstrip())
    draw(structure, quake, np.array(times), np.array(drift), np.array(lifted), options.output)
    return figures


def draw(structure, quake, times, drift, lifted, folder):
    """The column at the end, the record, and what the top and the joints did."""
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=(13, 6.5), layout="constrained")
    grid = figure.add_gridspec(3, 3)
    left = figure.add_subplot(grid[:, 0])
    masonry_plots.draw(structure, ax=left, what=None, forces=False, title="at the end")
    rows = [figure.add_subplot(grid[k, 1:]) for k in range(3)]
    rows[0].plot(quake.times, quake.acceleration / GRAVITY, color="#3b3b3b", linewidth=0.8)
    rows[1].plot(times, drift, color="#8c1515")
    seen = np.isfinite(lifted)
    rows[2].plot(times[seen], 1e3 * lifted[seen], color="#1f4e9c")
    for ax, label in zip(rows, ("ground [g]", "drift of the top [m]", "widest joint [mm]")):
        ax.set(ylabel=label, xlim=(0, times[-1]))
    rows[-1].set_xlabel("time [s]")
    figure.savefig(folder / f"{NAME}.png", dpi=110)
    plt.close(figure)


if __name__ == "__main__":
    main()
