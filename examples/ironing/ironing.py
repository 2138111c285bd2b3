"""A stiff half-disk pressed into a soft block and dragged over it: large strains, large sliding, friction.

The block is neo-Hookean (E = 1 MPa) and a hundred times softer than the disk. The disk is held by its flat upper side, goes
down by `--depth` and then along. Nodes of the block's upper side meet the edges of the disk. Inertia is kept small by the time
that it takes: forces are those of equilibrium. While the disk slides, the force along is more than mu times that down, since it
also pushes a wave of the block ahead of it.

Run it:  python ironing.py              a block of 48 by 10 cells
         python ironing.py --full       96 by 20 cells
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cairn as cn
import matplotlib.pyplot as plt
import numpy as np

NAME = "ironing"
LENGTH, HEIGHT, RADIUS, YOUNG, POISSON = 0.12, 0.03, 0.012, 1e6, 0.4
START = 0.25  # of the length, where the disk goes down


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--cells", type=int, default=48, help="along the block")
    parser.add_argument("--depth", type=float, default=0.006, help="[m]")
    parser.add_argument("--way", type=float, default=0.05, help="along [m]")
    parser.add_argument("--steps", type=int, default=240)
    parser.add_argument("--mu", type=float, default=0.3)
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--output", type=Path, default=Path("."))
    options = parser.parse_args(arguments)
    if options.full:
        options.cells, options.steps = 96, 480
    if not 0 < options.depth < HEIGHT / 2:
        raise ValueError(f"depth is {options.depth}: give a depth between 0 and half of the block's {HEIGHT} m")
    return options


def block(cells):
    """A body of quadrilaterals, the upper side and the lower one as groups."""
    nx, ny = cells, max(2, round(cells * HEIGHT / LENGTH * 0.85))
    x, y = np.meshgrid(np.linspace(0, LENGTH, nx + 1), np.linspace(0, HEIGHT, ny + 1), indexing="ij")
    number = np.arange(x.size).reshape(x.shape)
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], -1).reshape(-1, 4)
    rubber = cn.NeoHookean(young=YOUNG, poisson=POISSON)
    groups = {"top": number[:, -1], "foot": number[:, 0]}
    return cn.SolidBody(np.c_[x.ravel(), y.ravel()], {"quad": quads}, rubber, density=1000.0, groups=groups, mean_dilatation=True)


def half_disk(cells):
    """The lower half of a disk; its round side and its flat one as groups."""
    around, across = max(8, cells // 2), 4
    angle, radius = np.linspace(np.pi, 2 * np.pi, around + 1), np.linspace(0.4, 1.0, across + 1) * RADIUS
    x, y = radius * np.cos(angle[:, None]), radius * np.sin(angle[:, None])
    number = np.arange(x.size).reshape(x.shape)
    quads = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], -1).reshape(-1, 4)
    centre = np.array([START * LENGTH, HEIGHT + RADIUS * 1.001])
    hard = cn.NeoHookean(young=100 * YOUNG, poisson=0.3)
    groups = {"round": number[:, -1], "held": number[:, 0]}
    return cn.SolidBody(np.c_[x.ravel(), y.ravel()] + centre, {"quad": quads}, hard, density=1000.0, groups=groups)


def ironed(options):
    """The simulation at its end, forces on the disk [N/m] step by step, their work [J/m], frames, largest error of the solver."""
    down, along = options.steps // 5, options.steps - options.steps // 5
    dt = 1.0 / options.steps
    skin = cn.Material("skin", density=1000.0)
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(block(options.cells), skin, contact="top", fixed={"foot": "xy"}, name="block"))

    def speed_down(t):
        return -options.depth * 1.04 / (down * dt) if t <= down * dt * (1 + 1e-9) else 0.0

    def speed_along(t):
        return options.way / (along * dt) if t > down * dt * (1 + 1e-9) else 0.0

    drive = {"held": {"x": speed_along, "y": speed_down}}
    scene.add(cn.deformable(half_disk(options.cells), skin, edges="round", drive=drive, name="disk"))
    scene.interact("block", "disk edges", cn.Coulomb(mu=options.mu))
    sim = cn.Simulation(scene, dt=dt, strategy=cn.NSCD(theta=1.0, solver=cn.PPANewton(tol=1e-8)))
    force, frames, errors, way = [], [], [], [np.zeros(2)]
    shown = {down, down + along // 2, options.steps}

    def watch(sim):
        disk = sim.meshes[1]
        force.append(disk.reaction("held"))
        way.append(disk.displacement[disk.body.groups["held"]].mean(axis=0))
        errors.append(sim.info["error"])
        if sim.steps in shown:
            frames.append([(m.body, m.displacement.copy(), next(iter(m.stress.values())).copy()) for m in sim.meshes])

    path = options.output / f"{NAME}.vtkhdf"
    every = max(1, options.steps // 40)
    sim.run(options.steps, output=path, every=every, callback=watch, overwrite=True, progress=False)
    mean = np.array(force) - np.diff(force, axis=0, prepend=[np.zeros(2)]) / 2  # of both ends of each step
    work = (mean * np.diff(way, axis=0)).sum()
    return sim, np.array(force), work, frames, max(errors)


def mises(s):
    """Von Mises stress of true stresses (n, 6)."""
    x, y, z, *shear = s.T
    return np.sqrt(((x - y) ** 2 + (y - z) ** 2 + (z - x) ** 2) / 2 + 3 * sum(t**2 for t in shear))


def draw(force, frames, options):
    """Both bodies at three instants, coloured by Mises' stress, and the forces on the disk."""
    from matplotlib.collections import PolyCollection

    figure, axes = plt.subplots(2, 2, figsize=(12, 5.6), layout="constrained")
    top = max(mises(frame[0][2]).max() for frame in frames) / 1e3
    for axis, frame in zip(axes.flat, frames):
        for body, u, s in frame:
            cells = (body.points + u)[body.cells["quad"]] * 1e3
            drawn = PolyCollection(cells, array=mises(s) / 1e3, cmap="viridis", clim=(0, top), edgecolor="0.4", linewidth=0.2)
            axis.add_collection(drawn)
        axis.set(xlim=(-5, 1e3 * LENGTH + 5), ylim=(-2, 46), aspect="equal", xlabel="mm")
    figure.colorbar(drawn, ax=axes.flat[:3], label="Mises' stress [kPa]", shrink=0.6)
    time = np.arange(1, len(force) + 1) / len(force)
    axes.flat[3].plot(time, -force[:, 1], label="down")
    axes.flat[3].plot(time, force[:, 0], label="along")
    axes.flat[3].set(xlabel="time [s]", ylabel="force on the disk [N/m]")
    axes.flat[3].legend()
    figure.savefig(options.output / f"{NAME}.png", dpi=110)
    plt.close(figure)


def main(arguments=None):
    """Runs, prints the figures, draws; returns the figures."""
    options = options_from(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    sim, force, work, frames, worst = ironed(options)
    terms = sim.info["energy"]
    late = force[-len(force) // 4 :]
    figures = {
        "force down while it slides": (-late[:, 1].mean(), "N/m"),
        "force along": (late[:, 0].mean(), "N/m"),
        "along over down": (late[:, 0].mean() / -late[:, 1].mean(), ""),
        "work of the disk": (work, "J/m"),
        "  lost in friction": (terms["dissipated_friction"] / work, "of it"),
        "  stored": (terms["stored"] / work, "of it"),
        "  lost in the steps": (terms["dissipated_integrator"] / work, "of it"),
        "  lost where nodes meet": (terms["dissipated_normal"] / work, "of it"),
        "closure of the balance": (abs(terms["closure"]) / terms["in_play"], ""),
        "largest error of the solver": (worst, ""),
    }
    for name, (value, unit) in figures.items():
        print(f"{name:30s} {value:.5g} {unit}")
    draw(force, frames, options)
    return figures


if __name__ == "__main__":
    main()
