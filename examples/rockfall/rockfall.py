"""Rockfall: angular blocks break loose at the head of a slope, which is read from an STL file, and run out at its foot.

Engineers ask how far the blocks go and how high they jump, to place a fence. Each block is a convex polyhedron, the ground the
triangles of a surveyed surface; an impact restores a part of the normal speed (Newton's restitution), and friction acts along the
ground. Without a file the example makes a slope of its own, writes it as STL and reads it back: a steep face, a bench, a talus
and a valley floor, with bumps.

The energy line, from the first position of the blocks to the last, tells the friction that a sliding point would need for the
same run: Heim's (1932) Fahrboeschung.

Run it:  python rockfall.py                        12 blocks, half a minute
         python rockfall.py --full                 100 blocks
         python rockfall.py --surface survey.stl   on a surface of your own, upwards along z, blocks above its highest point
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cairn as cn
import numpy as np
from cairn.pre import terrain

NAME = "rockfall"
DENSITY, GRAVITY = 2700.0, 9.81


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--blocks", type=int, default=12)
    parser.add_argument("--full", action="store_true", help="100 blocks")
    parser.add_argument("--size", type=float, default=1.2, help="of a block [m]")
    parser.add_argument("--surface", type=Path, help="STL, OBJ or PLY in metres; without it a slope is made")
    parser.add_argument("--cells", type=int, default=40, help="of the slope that is made, along it")
    parser.add_argument("--mu", type=float, default=0.7)
    parser.add_argument("--restitution", type=float, default=0.2)
    parser.add_argument("--seconds", type=float, default=16.0)
    parser.add_argument("--dt", type=float, default=4e-3, help="[s]")
    parser.add_argument("--frames", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--output", type=Path, default=Path("."))
    options = parser.parse_args(arguments)
    if options.full:
        options.blocks, options.cells, options.seconds = 100, 80, 25.0
    return options


def made_slope(path, cells, rng):
    """A slope along x, 40 m high, as binary STL."""
    import trimesh

    x, y = np.linspace(0, 160, cells + 1), np.linspace(0, 40, max(cells // 4, 2) + 1)
    profile = np.interp(x, [0, 8, 30, 38, 70, 160], [40, 39, 18, 16.5, 0, 2])
    bumps = 0.4 * rng.uniform(-1, 1, (len(x), len(y)))
    gully = 0.006 * (y - 20.0) ** 2  # keeps blocks to the middle
    vertices, faces = terrain.heights(x, y, profile[:, None] + bumps + gully)
    trimesh.Trimesh(vertices, faces, process=False).export(path)


def build(options):
    """The simulation, rows of the blocks, and the surface."""
    rng = np.random.default_rng(options.seed)
    path = options.surface
    if path is None:
        path = options.output / f"{NAME}.stl"
        made_slope(path, options.cells, rng)
    vertices, faces = terrain.read_surface(path)
    ground, rock = cn.Material("ground", density=DENSITY), cn.Material("rock", density=DENSITY)
    scene = cn.Scene(dim=3, gravity=(0.0, 0.0, -GRAVITY))
    scene.add(cn.surface(vertices, faces, ground))
    size = options.size * rng.uniform(0.6, 1.4, options.blocks)
    stones = cn.pre.masonry.random_polyhedra(options.blocks, size, elongation=0.7, angularity=0.8, rng=rng)
    head = vertices[vertices[:, 2] > vertices[:, 2].max() - 3.0]
    low, high = head.min(axis=0), head.max(axis=0)
    across = max(int((0.5 * np.ptp(head[:, 1])) / (2 * options.size)), 1)
    k = np.arange(options.blocks)
    place = np.column_stack(
        (
            low[0] + 2.5 + 2.0 * options.size * (k // across % 2),
            (low[1] + high[1]) / 2 + 2.0 * options.size * (k % across - (across - 1) / 2),
            high[2] + options.size * (1.0 + 2.0 * (k // (2 * across))),
        )
    )
    moved = [(v + p, f) for (v, f), p in zip(stones, place)]
    start = np.tile([3.0, 0.0, 0.0, 0.0, 0.0, 0.0], (options.blocks, 1))
    ids = scene.add(cn.polyhedra(moved, rock, velocity=start))
    law = cn.Restitution(mu=options.mu, normal=options.restitution)
    scene.interact(rock, ground, law)
    scene.interact(rock, rock, law)
    solver = cn.NLGS(tol=1e-4, max_iter=500)
    simulation = cn.Simulation(scene, options.dt, cn.NSCD(theta=0.5, solver=solver, threads=1))
    return simulation, np.asarray(ids), (vertices, faces)


def height_above(points, vertices, faces):
    """Height (n,) of points over the surface, NaN beside it."""
    from matplotlib.tri import LinearTriInterpolator, Triangulation

    ground = LinearTriInterpolator(Triangulation(vertices[:, 0], vertices[:, 1], faces), vertices[:, 2])
    return points[:, 2] - np.ma.filled(ground(*points[:, :2].T), np.nan)


def main(arguments=None):
    """Lets the blocks go until the time is over; prints and draws; returns the figures."""
    options = options_from(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    simulation, ids, surface = build(options)
    rows = np.flatnonzero(np.isin(simulation.bodies.id, ids))
    track = [np.array(simulation.bodies.position[rows])]
    speed = [np.full(len(rows), 3.0)]

    def follow(sim):
        track.append(np.array(sim.bodies.position[rows]))
        speed.append(np.linalg.norm(sim.bodies.velocity[rows, :3], axis=1))

    steps = round(options.seconds / options.dt)
    path = options.output / f"{NAME}.vtkhdf"
    simulation.run(steps, output=path, every=max(steps // options.frames, 1), callback=follow, overwrite=True)
    return report(options, simulation, surface, np.array(track), np.array(speed))


def report(options, simulation, surface, track, speed):
    """Figures of the fall, of places (steps, n, 3) and speeds (steps, n) of the blocks; and its picture."""
    energy = simulation.energy
    above = np.array([height_above(p, *surface) for p in track])
    run, drop = track[-1] - track[0], track[0, :, 2] - track[-1, :, 2]
    line = drop / np.linalg.norm(run[:, :2], axis=1)
    figures = {
        "blocks": (track.shape[1], ""),
        "triangles of the ground": (len(surface[1]), ""),
        "farthest run": (np.linalg.norm(run[:, :2], axis=1).max(), "m"),
        "greatest speed": (speed.max(), "m/s"),
        "highest jump": (np.nanmax(above), "m, centre above ground"),
        "energy line, least slope": (line.min(), ""),
        "at rest in the end": (int(np.sum(speed[-1] < 0.05)), "blocks"),
        "lost through the ground": (int(np.sum(above[-1] < 0)), "blocks"),
        "energy that does not close": (abs(energy["closure"]) / energy["in_play"], "of the energy in play"),
    }
    for name, (value, unit) in figures.items():
        print(f"{name:28s} {value:.4g} {unit}".rstrip())
    draw(track, speed, surface, simulation.info["dt"], options)
    return {name: (float(value), unit) for name, (value, unit) in figures.items()}


def draw(track, speed, surface, dt, options):
    """Paths of the blocks from the side and from above."""
    import matplotlib.pyplot as plt
    from matplotlib.collections import LineCollection

    vertices, faces = surface
    figure, axes = plt.subplots(2, 1, figsize=(11, 8), layout="constrained", sharex=True)
    x = np.linspace(vertices[:, 0].min(), vertices[:, 0].max(), 300)
    middle = np.column_stack((x, np.full_like(x, np.median(track[:, :, 1])), np.zeros_like(x)))
    profile = -height_above(middle, vertices, faces)
    axes[0].fill_between(x, profile, np.nanmin(profile) - 2, color="#cfc8b8")
    axes[1].tricontourf(vertices[:, 0], vertices[:, 1], faces, vertices[:, 2], 14, cmap="Greys", alpha=0.5)
    for ax, (i, j) in zip(axes, ((0, 2), (0, 1))):
        for k in range(track.shape[1]):
            p = track[:, k][:, [i, j]]
            lines = LineCollection(list(np.stack((p[:-1], p[1:]), axis=1)), cmap="plasma", clim=(0, speed.max()), linewidths=1.2)
            lines.set_array(speed[1:, k])
            ax.add_collection(lines)
        ax.plot(*track[-1][:, [i, j]].T, "o", color="#1d2733", markersize=4)
        ax.set(aspect="equal", ylabel=("z [m]", "y [m]")[j == 1])
    axes[1].set(xlabel="x [m]")
    axes[0].set_title(f"{track.shape[1]} blocks on {len(faces)} triangles, {dt * (len(track) - 1):.0f} s")
    figure.colorbar(lines, ax=axes, label="speed [m/s]", shrink=0.6)
    figure.savefig(options.output / f"{NAME}.png", dpi=110)
    plt.close(figure)


if __name__ == "__main__":
    main()
