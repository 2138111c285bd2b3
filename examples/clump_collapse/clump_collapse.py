"""Collapse of a column: clumps of three disks stand steeper than disks, since they interlock and cannot roll.

A column of grains is held between two walls, then a wall is removed and the column slumps. Run-out and slope of the heap depend
little on friction between grains and much on their freedom to roll: sand is not made of spheres. A clump, several disks on a
rigid body, is the cheapest grain that is not round: contacts are those of disks, mass, centre and inertia are those of the body,
which `cairn.pre.clump` integrates exactly over the union of its parts.

The same column is made twice, of clumps and of disks of the same area, the same friction and the same law.

Run it:  python clump_collapse.py            250 grains of each kind, half a minute
         python clump_collapse.py --help
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cairn as cn
import numpy as np
from cairn.post import plots

NAME = "clump_collapse"
SIZE = 0.01  # radius of a disk with the area of a grain [m]
DENSITY, FRICTION, GRAVITY = 2500.0, 0.5, 9.81
STEP = 1e-3  # [s]
SETTLING = 0.5  # [s]
WIDE = 14  # width of the column in diameters


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--grains", type=int, default=250)
    parser.add_argument("--steps", type=int, default=2000, help="of 1 ms, 500 of them before the wall goes")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--output", type=Path, default=Path("."))
    return parser.parse_args(arguments)


def trefoil():
    """Three overlapping disks on a triangle, scaled to the area of a disk of radius SIZE."""
    centers, radii = cn.pre.clumps.ring(3, 1.0, 1.25)
    area = cn.pre.clump(centers[:, :2], radii, 1.0).mass
    scale = SIZE * np.sqrt(np.pi / area)
    return cn.pre.clump(centers[:, :2] * scale, radii * scale, DENSITY)


def build(options, kind):
    """The simulation of one column; its last body is the wall that will go."""
    rng = np.random.default_rng(options.seed)
    grain, ground = cn.Material("grain", density=DENSITY), cn.Material("ground", density=DENSITY)
    if kind == "clumps":
        body = trefoil()
        reach = float(np.max(np.linalg.norm(body.offsets, axis=1) + body.radii))
        room = np.full(options.grains, reach)
    else:
        room = cn.pre.grains.uniform(options.grains, 0.8 * SIZE, 1.2 * SIZE, rng=rng)
        room *= SIZE * np.sqrt(options.grains / np.sum(room**2))
    width = WIDE * 2 * SIZE
    # clumps start in the circles around them, each turned at random, and settle into each other before the wall goes
    centers = cn.pre.deposit_disks(room * (1 + 1e-9), width)
    scene = cn.Scene(dim=2, gravity=(0.0, -GRAVITY))
    layer = cn.pre.layers(centers, 6)
    turn = rng.uniform(0.0, 2 * np.pi, options.grains)
    for k in range(6):
        here = layer == k
        name = f"layer {k + 1}"
        if kind == "clumps":
            scene.add(
                cn.clumps(
                    centers[here], body.offsets, body.radii, body.mass, body.inertia, grain, rotation=turn[here], group=name
                )
            )
        else:
            scene.add(cn.disks(centers[here], room[here], grain, group=name))
    scene.add(cn.wall((0, 0), (0, 1), ground), cn.wall((0, 0), (1, 0), ground))
    scene.add(cn.wall((width, 0), (-1, 0), ground))
    scene.interact("*", "*", cn.Coulomb(mu=FRICTION))
    strategy = cn.NSCD(solver=cn.NLGS(tol=1e-3, max_iter=150), threads=options.threads)
    return cn.Simulation(scene, STEP, strategy), width


def collapse(options, kind):
    """Lets a column settle, removes its wall, and follows the slump; returns the measured figures and the file."""
    simulation, width = build(options, kind)
    path = options.output / (f"{NAME}.vtkhdf" if kind == "clumps" else f"{NAME}_disks.vtkhdf")
    wall = int(simulation.bodies.id[-1])
    measured = {}

    def release(sim):
        if sim.steps == max(min(int(SETTLING / STEP), options.steps // 2), 1):
            measured["height"] = float(np.quantile(sim.bodies.position[: options.grains, 1], 0.98))
            sim.remove(wall)

    every = max(options.steps // options.frames, 1)
    simulation.run(options.steps, output=path, every=every, callback=release, overwrite=True)
    position = simulation.bodies.position[: options.grains]
    measured["front"] = float(np.quantile(position[:, 0], 0.98)) - width
    measured["run-out"] = measured["front"] / width
    measured["angle"] = slope(position)
    energy = simulation.energy
    measured["energy lost in friction"] = energy["dissipated_friction"] / (
        energy["dissipated_friction"] + energy["dissipated_normal"]
    )
    return measured, path


def slope(position):
    """Slope of the heap [degrees]: a line through its highest grains, between the wall and the last grains of its foot."""
    width = 3 * SIZE
    columns = np.floor(position[:, 0] / width).astype(int)
    last = int(np.quantile(position[:, 0], 0.95) / width)
    found = np.unique(columns[(columns >= 1) & (columns <= last)])
    if len(found) < 2:
        return 0.0
    top = [position[columns == c, 1].max() for c in found]
    return float(np.degrees(np.arctan(-np.polyfit((found + 0.5) * width, top, 1)[0])))


def draw(paths, folder):
    """Both columns when the wall goes and at the end; the animation of the clumps."""
    import matplotlib.pyplot as plt

    with cn.load(paths["clumps"]) as clumps, cn.load(paths["disks"]) as disks:
        grain = disks[0].bodies["radius"] > 0
        far = max(float(np.quantile(run[-1].bodies["position"][:, 0], 0.97)) for run in (clumps, disks))
        high = float(disks[0].bodies["position"][grain, 1].max()) * 1.25
        view = ((-2 * SIZE, min(far, 6 * high) + 2 * SIZE), (-2 * SIZE, high))
        figure, axes = plt.subplots(2, 2, figsize=(14.0, 7.0), layout="constrained")
        for row, (name, run) in zip(axes, (("clumps", clumps), ("disks", disks))):
            for ax, step in zip(row, (run.at(SETTLING), run[-1])):
                title = f"{name}, t = {step.time:.3g} s"
                plots.plot_step(step, "material", ax=ax, view=view, colorbar=False, title=title)
        figure.savefig(folder / f"{NAME}.png", dpi=110)
        plt.close(figure)
        clumps.animate(folder / f"{NAME}.gif", "material", view=view, figsize=(8.0, 4.2), dpi=80, colorbar=False)


def main(arguments=None):
    """Runs both columns, prints the figures, draws; returns the figures."""
    options = options_from(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    units = {"height": "m", "front": "m", "run-out": "of the width", "angle": "degrees", "energy lost in friction": ""}
    figures, paths = {}, {}
    for kind in ("clumps", "disks"):
        measured, paths[kind] = collapse(options, kind)
        for name, value in measured.items():
            figures[f"{name}, {kind}"] = (value, units[name])
            print(f"{name + ', ' + kind:32s} {value:.4g} {units[name]}".rstrip())
    draw(paths, options.output)
    return figures


if __name__ == "__main__":
    main()
