"""Plane shear: disks between two rough walls, periodic along the flow; friction and density as functions of the inertial number.

The simplest flow of grains, and the one from which the law mu(I) was read (da Cruz, Emam, Prochnow, Roux & Chevoir 2005).
Without gravity, the upper wall moves at a speed V along the flow and presses with a stress P; it is free to go up and down.
Everything depends on one number, the inertial number I = (V / H) d sqrt(rho / P): the time in which the pressure closes a
gap of one grain, over the time in which a grain is carried past its neighbour. For disks with friction the measured law is

    mu* = T / P  =  0.25 + 1.1 I,       solid fraction = 0.81 - 0.3 I         (about, in two dimensions, 1e-3 < I < 0.2).

The box is periodic along x, so there are no ends: a grain that leaves on the right comes back on the left. Both walls are
rough: rows of disks, the lower held, the upper one rigid body (a clump) driven along x and loaded along y.

Run it:  python shear_cell.py                  I = 0.02, 400 disks
         python shear_cell.py --sweep          five values of I, the law drawn against the measurements
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cairn as cn
import numpy as np
from cairn.post import plots

NAME = "shear_cell"
DIAMETER, SPREAD = 0.01, 0.2  # [m], [-]
DENSITY, FRICTION = 2600.0, 0.4
PRESSURE = 1.0e3  # [Pa]
SWEEP = (0.005, 0.01, 0.03, 0.1, 0.2)
FALL = DIAMETER * np.sqrt(DENSITY / PRESSURE)  # [s] in which the pressure closes a gap of one grain


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--disks", type=int, default=400)
    parser.add_argument("--inertial", type=float, default=0.02, help="wanted inertial number (0.02)")
    parser.add_argument("--sweep", action="store_true", help=f"I = {', '.join(map(str, SWEEP))}")
    parser.add_argument("--strain", type=float, default=4.0, help="shear strain; the first half is not measured (4)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--output", type=Path, default=Path("."))
    return parser.parse_args(arguments)


def rough_row(length, height):
    """Centres of a row of equal touching disks across the cell, and their radius."""
    count = int(round(length / DIAMETER))
    pitch = length / count
    return np.column_stack(((np.arange(count) + 0.5) * pitch, np.full(count, height))), pitch / 2


def build(options, inertial):
    """The simulation, the id of the upper wall, and the speed it is driven at [m/s]."""
    radii = cn.pre.grains.uniform(options.disks, DIAMETER / 2 * (1 - SPREAD), DIAMETER / 2 * (1 + SPREAD), rng=options.seed)
    height = np.sqrt(np.sum(np.pi * radii**2) / 0.8 / 1.2)
    length = float(np.round(1.2 * height / DIAMETER) * DIAMETER)
    # a packing between walls stays free of overlap when its ends are joined
    centers = cn.pre.deposit_disks(radii, length)
    top = float(np.max(centers[:, 1] + radii))
    low, r = rough_row(length, -DIAMETER / 2)
    high, _ = rough_row(length, top + DIAMETER / 2)
    grain, wall = cn.Material("grain", density=DENSITY), cn.Material("wall", density=DENSITY)
    scene = cn.Scene(dim=2, gravity=(0.0, 0.0), periodic=cn.Periodic((length, np.inf)))
    layer = cn.pre.layers(centers, 6)
    for k in range(6):
        here = layer == k
        scene.add(cn.disks(centers[here], radii[here], grain, group=f"layer {k + 1}"))
    scene.add(cn.disks(low, r, wall, driven=("vx", "vy", "w"), drive=(0.0, 0.0, 0.0), group="lower wall"))
    middle = high.mean(axis=0)
    mass = float(DENSITY * np.sum(np.pi * radii**2)) / 4
    speed = inertial / FALL * (top + DIAMETER)
    lid = cn.clumps(middle[None], high - middle, np.full(len(high), r), mass, mass * length**2 / 12, wall, group="upper wall")
    scene.add(lid.with_(driven=("vx", "w"), drive=(speed, 0.0, 0.0), force=(0.0, -PRESSURE * length, 0.0)))
    scene.interact(grain, grain, cn.Coulomb(mu=FRICTION))
    scene.interact(grain, wall, cn.Coulomb(mu=FRICTION))
    scene.interact("lower wall", "upper wall", None)
    scene.interact("lower wall", "lower wall", None)
    step = min(0.02 * DIAMETER / speed, 0.05 * FALL)
    strategy = cn.NSCD(solver=cn.NLGS(tol=1e-3, max_iter=150), threads=options.threads)
    return cn.Simulation(scene, step, strategy), options.disks + len(low), speed, length


def flow(options, inertial, path):
    """Shears at one inertial number; returns the measured I, mu*, solid fraction and height over time."""
    simulation, lid, speed, length = build(options, inertial)
    disks = options.disks
    area = float(np.sum(np.pi * simulation.radii()[:disks] ** 2))

    def height():
        return float(simulation.bodies.position[lid, 1] + DIAMETER / 2)  # from middle to middle of both rows

    def stress(axis):
        contacts = simulation.contacts
        sign = np.where(contacts.bodies[:, 0] == lid, 1.0, 0.0) - np.where(contacts.bodies[:, 1] == lid, 1.0, 0.0)
        return float(sign @ contacts.force[:, axis]) / length

    probes = {"shear_stress": lambda _: -stress(0), "normal_stress": lambda _: stress(1), "height": lambda _: height()}
    steps = int(options.strain * height() / speed / simulation.dt)
    simulation.run(steps, output=path, every=max(steps // options.frames, 1), probes=probes, overwrite=True)
    with cn.load(path) as run:
        history = run.history
    late = slice(len(history["height"]) // 2, None)
    mean_height = float(np.mean(history["height"][late]))
    return {
        "inertial": speed / mean_height * FALL,
        "friction": float(np.mean(history["shear_stress"][late]) / np.mean(history["normal_stress"][late])),
        "pressure": float(np.mean(history["normal_stress"][late])) / PRESSURE,
        "solid": area / (length * (mean_height - DIAMETER)),
        "error": float(np.median(history["error"])),
        "iterations": float(np.mean(history["iterations"])),
    }


def draw(run, results, folder):
    """The flow at the start and at the end, its forces and its velocity profile; mu* against I; the animation."""
    import matplotlib.pyplot as plt

    last = run[-1].bodies
    position, radius = last["position"], last["radius"]
    grain = np.arange(len(radius)) < len(radius) - 1
    length = float(run.scene["periodic"]["lengths"][0]) if "periodic" in run.scene else position[grain, 0].max()
    view = ((-DIAMETER, length + DIAMETER), (-2 * DIAMETER, position[-1, 1] + 3 * DIAMETER))
    figure, axes = plt.subplots(2, 2, figsize=(10.0, 8.0), layout="constrained")
    axes = axes.ravel()
    plots.plot_step(run[0], "material", ax=axes[0], view=view, colorbar=False, title="t = 0 s, coloured by layer")
    plots.plot_step(run[-1], "material", ax=axes[1], view=view, colorbar=False, title=f"t = {run[-1].time:.3g} s")
    late = run[len(run) // 2 :]
    speed = np.mean([step.bodies["velocity"][grain, 0] for step in late], axis=0)
    axes[2].plot(speed, position[grain, 1] / DIAMETER, ".", ms=3)
    axes[2].set(xlabel="mean speed along the flow [m/s]", ylabel="height [diameters]")
    number = np.geomspace(1e-3, 0.3, 50)
    axes[3].semilogx(number, 0.25 + 1.1 * number, color="grey", label="da Cruz et al. 2005: 0.25 + 1.1 I")
    axes[3].semilogx([r["inertial"] for r in results], [r["friction"] for r in results], "o", label="measured")
    axes[3].set(xlabel="inertial number I [-]", ylabel="shear over normal stress [-]", ylim=(0.0, 0.7))
    axes[3].legend(frameon=False)
    figure.savefig(folder / f"{NAME}.png", dpi=110)
    plt.close(figure)
    run.animate(folder / f"{NAME}.gif", "material", view=view, figsize=(6.0, 5.0), dpi=80, colorbar=False)


def main(arguments=None):
    """Runs, prints the figures, draws; returns the figures of the last flow."""
    options = options_from(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    path = options.output / f"{NAME}.vtkhdf"
    results = [flow(options, number, path) for number in (SWEEP if options.sweep else (options.inertial,))]
    units = {"inertial": "I", "friction": "T/P", "pressure": "of the wanted", "error": "median", "iterations": "mean"}
    for result in results:
        law = 0.25 + 1.1 * result["inertial"]
        for name, value in result.items():
            print(f"{name:28s} {value:.4g} {units.get(name, '')}".rstrip())
        print(f"{'law of da Cruz et al.':28s} {law:.4g} T/P\n")
    with cn.load(path) as run:
        draw(run, results, options.output)
    return {name: (value, units.get(name, "")) for name, value in results[-1].items()}


if __name__ == "__main__":
    main()
