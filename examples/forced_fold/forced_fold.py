"""Forced fold: a layered deposit of disks shortened by a wall that pushes its left side.

Sand-box models of mountain belts do the same with coloured sand: above a floor with friction, a layered deposit that is
pushed from behind thickens into a wedge; thrusts cut and stack the layers, with folds above them. Here every grain is
a rigid disk, every contact obeys Signorini's condition (no overlap, no adhesion), Coulomb's dry friction and inelastic
impact, and the whole moves by Non-Smooth Contact Dynamics: the scene of section 5.1 of Dubois & Renouf (2007).

The paper gives: radii from 0.42 to 0.56 m, density 2800 kg/m3, friction 0.4, step 0.025 s, 43,000 disks and 20,000
steps with at least 100 iterations a step (96 hours of a 3.6 GHz core then). Choices made here, with reasons:

- The deposit is 8 times as long as it is high and has 10 layers by colour alone: all grains are of one rock.
- The wall shortens it by 35 %, enough for several successive thrusts. In the 500 s of the paper's steps that
  is 0.4 m/s, less than a hundredth of a diameter a step.
- Is that slow? Grains deform a packing quasi-statically while the inertial number I = rate x d sqrt(rho / p) stays below
  about 0.01 (da Cruz et al. 2005): d sqrt(rho / p) is the time in which the pressure p pushes a grain into a hole of its
  size. With the pressure at half depth and all shear in a band ten diameters wide, I is printed with the figures.
- The tolerance on the error is 1e-4, but iterations stop at a fixed number, as in the paper; the error that is left, and the
  overlap that it lets grow, are among the figures: two or three times more iterations make both smaller.
- The first 2 s let the geometric packing settle; then the wall takes 2 s to reach its speed.

Run it:  python forced_fold.py                 2,000 disks, half a minute
         python forced_fold.py --full          43,000 disks, 20,000 steps
         python forced_fold.py --help
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import cairn as cn
import numpy as np
from cairn.base import checks
from cairn.post import histories, plots

NAME = "forced_fold"
SMALLEST, LARGEST = 0.42, 0.56  # radii [m]
DENSITY = 2800.0  # [kg/m3]
FRICTION = 0.4
STEP = 2.5e-2  # [s]
GRAVITY = 9.81  # [m/s2]
LAYERS = 10
LENGTH_TO_HEIGHT = 8.0
SOLID = 0.82  # solid fraction of the geometric packing, to choose its length beforehand
SETTLING, STARTING = 2.0, 2.0  # [s]
BAND = 10.0  # width of a shear band in diameters, for the inertial number


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--full", action="store_true", help="the size of the paper: 43,000 disks, 20,000 steps")
    parser.add_argument("--disks", type=int, help="number of disks (2,000; full 43,000)")
    parser.add_argument("--steps", type=int, help="number of steps (2,500; full 20,000)")
    parser.add_argument("--iterations", type=int, nargs=2, metavar=("LEAST", "MOST"), help="a step (20 100; full 100 100)")
    parser.add_argument("--tolerance", type=float, default=1e-4, help="of the solver's true error (1e-4)")
    parser.add_argument("--shortening", type=float, default=0.35, help="share of the length (0.35)")
    parser.add_argument("--base-friction", type=float, default=FRICTION, help="of the floor (0.4)")
    parser.add_argument("--seed", type=int, default=1, help="of the radii (1)")
    parser.add_argument("--threads", type=int, default=0, help="0: as many as OpenMP decides; results do not depend on it")
    parser.add_argument("--output", type=Path, default=Path("."), help="folder of the file and the pictures (.)")
    parser.add_argument("--frames", type=int, default=50, help="outputs in the file, pictures in the animation (50)")
    parser.add_argument("--restart", type=Path, metavar="CHECKPOINT", help="go on from this checkpoint of the same scene")
    options = parser.parse_args(arguments)
    usual = {"disks": 2_000, "steps": 2_500, "iterations": (20, 100)}
    paper = {"disks": 43_000, "steps": 20_000, "iterations": (100, 100)}
    for name, value in (paper if options.full else usual).items():
        if getattr(options, name) is None:
            setattr(options, name, value)
    for name in ("disks", "steps", "frames"):
        checks.count(name, getattr(options, name), 1)
    return options


def layered_deposit(count, seed):
    """Radii, centres and layer of each disk, and the length of the box [m]."""
    radii = cn.pre.grains.uniform(count, SMALLEST, LARGEST, rng=seed)
    length = np.sqrt(LENGTH_TO_HEIGHT * np.sum(np.pi * radii**2) / SOLID)
    centers = cn.pre.deposit_disks(radii, length)
    return radii, centers, cn.pre.layers(centers, LAYERS), float(length)


def build_scene(options):
    """The scene, and the wall's final speed [m/s]."""
    radii, centers, layer, length = layered_deposit(options.disks, options.seed)
    rock, base = cn.Material("rock", density=DENSITY), cn.Material("base", density=DENSITY)
    scene = cn.Scene(dim=2, gravity=(0.0, -GRAVITY))
    for k in range(LAYERS):  # a group for each layer: it is what colours the picture, here and in ParaView
        here = layer == k
        scene.add(cn.disks(centers[here], radii[here], rock, group=f"layer {k + 1}"))
    pushing = options.steps * STEP - SETTLING - STARTING / 2.0
    speed = options.shortening * length / max(pushing, options.steps * STEP / 2.0)
    push = cn.Table([0.0, SETTLING, SETTLING + STARTING], [[0.0, 0.0], [0.0, 0.0], [speed, 0.0]])
    scene.add(cn.wall((0.0, 0.0), (0.0, 1.0), base, group="floor"))
    scene.add(cn.wall((length, 0.0), (-1.0, 0.0), rock, group="right wall"))
    scene.add(cn.wall((0.0, 0.0), (1.0, 0.0), rock, group="left wall", velocity=push))
    scene.interact(rock, rock, cn.Coulomb(mu=FRICTION))
    scene.interact(rock, base, cn.Coulomb(mu=options.base_friction))
    return scene, length, speed


def surface_height(position, radius):
    """Height of the free surface in columns four largest diameters wide, (m,) [m], and their middles [m]."""
    width = 8.0 * LARGEST
    column = np.floor((position[:, 0] - position[:, 0].min()) / width).astype(int)
    top = np.full(column.max() + 1, -np.inf)
    np.maximum.at(top, column, position[:, 1] + radius)
    middle = position[:, 0].min() + (np.arange(len(top)) + 0.5) * width
    return top, middle


class Probes:
    """Entries of the history beside the solver's report: shortening [-] and height of the fold [m]."""

    def __init__(self, simulation, length, disks):
        self.length, self.disks = length, disks
        self.radius = simulation.radii()[:disks]
        self.first = float(np.median(surface_height(simulation.bodies.position[:disks], self.radius)[0]))

    def shortening(self, simulation):
        return simulation.bodies.position[-1, 0] / self.length  # the left wall is the last body

    def fold_height(self, simulation):
        return surface_height(simulation.bodies.position[: self.disks], self.radius)[0].max() - self.first

    def functions(self):
        return {"shortening": self.shortening, "fold_height": self.fold_height}


def simulate(options):
    """Runs the scene; returns the simulation, the path of its file and what describes the run."""
    started = time.perf_counter()
    scene, length, speed = build_scene(options)
    packed = time.perf_counter() - started
    solver = cn.NLGS(tol=options.tolerance, min_iter=options.iterations[0], max_iter=options.iterations[1])
    simulation = cn.Simulation(scene, STEP, cn.NSCD(theta=0.5, solver=solver, threads=options.threads))
    probes = Probes(simulation, length, options.disks)
    options.output.mkdir(parents=True, exist_ok=True)
    path = options.output / f"{NAME}.vtkhdf"
    if options.restart is not None:
        simulation.restore(options.restart)
        if simulation.steps >= options.steps:
            raise ValueError(f"steps is {options.steps}, and the checkpoint was taken after {simulation.steps}: nothing is left")
        path = options.output / f"{NAME}_from_{simulation.steps}.vtkhdf"
    started = time.perf_counter()
    simulation.run(
        steps=options.steps - simulation.steps,
        output=path,
        every=max(options.steps // options.frames, 1),
        checkpoint_every=max(options.steps // 20, 1),
        probes=probes.functions(),
        overwrite=True,
    )
    about = {"length": length, "height": probes.first, "speed": speed, "packed": packed}
    return simulation, path, about | {"seconds": time.perf_counter() - started}


def figures_of(run, about, options):
    """The figures of the run: name -> (value, unit)."""
    history, last = run.history, run[-1]
    error, energy = history["error"], {n.removeprefix("energy_"): v[-1] for n, v in history.items() if n.startswith("energy_")}
    pressure = SOLID * DENSITY * GRAVITY * about["height"] / 2.0
    inertial = about["speed"] / BAND * np.sqrt(DENSITY / pressure)
    work = energy["work_driven"]
    return {
        "disks": (int(np.sum(last.bodies["radius"] > 0.0)), ""),
        "steps": (int(history["step"][-1]), ""),
        "length, height": ((about["length"], about["height"]), "m"),
        "speed of the wall": (about["speed"], "m/s"),
        "inertial number": (float(inertial), ""),
        "shortening": (float(history["shortening"][-1]), ""),
        "height of the fold": (float(history["fold_height"][-1]), "m"),
        "contacts": (int(np.count_nonzero(np.any(last.contacts["impulse"] != 0.0, axis=1))), f"active of {len(last.contacts)}"),
        "error, median": (float(np.median(error)), ""),
        "error, 90 % of steps below": (float(np.quantile(error, 0.9)), ""),
        "tolerance": (options.tolerance, ""),
        "steps above it": (
            int(np.count_nonzero(history["status"] == "iteration_limit")),
            f"of {len(history['step']):,}, ended at the limit of {options.iterations[1]} iterations",
        ),
        "iterations, mean": (float(np.mean(history["iterations"])), ""),
        "overlap, mean at the end": (float(np.mean(np.maximum(-last.contacts["gap"], 0.0)) / SMALLEST), "of a radius"),
        "overlap, deepest of the run": (float(np.max(history["penetration"])), "of a radius"),
        "work of the wall": (work, "J"),
        "  lifted": (energy["potential"] / work if work else 0.0, "of the work"),
        "  lost in friction": (energy["dissipated_friction"] / work if work else 0.0, "of the work"),
        "  lost in impacts": (energy["dissipated_normal"] / work if work else 0.0, "of the work"),
        "  moving": (energy["kinetic"] / work if work else 0.0, "of the work"),
        "closure of the balance": (abs(energy["closure"]) / (energy["in_play"] or 1.0), "of the energy in play"),
        "time of packing": (about["packed"], "s"),
        "time of the run": (about["seconds"], "s"),
    }


def draw(run, folder):
    """The picture (layers at the start, half-way and at the end, and the forces), the curves, and the animation."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    position, radius = run[-1].bodies["position"], run[-1].bodies["radius"]
    first = run[0].bodies["position"][radius > 0]
    high = max(first[:, 1].max(), position[radius > 0, 1].max()) + 2.0
    view = ((-1.0, first[:, 0].max() + 2.0), (-1.0, high))
    across = view[0][1] - view[0][0]
    panel = 6.0 * (high + 1.0) / across + 0.7
    chosen = [0, len(run) // 2, len(run) - 1]
    figure, axes = plt.subplots(2, 2, figsize=(13.0, 2 * panel), layout="constrained", sharex=True, sharey=True)
    for ax, k in zip(axes.flat, chosen):
        plots.plot_step(run[k], "material", ax=ax, view=view, colorbar=False, title=f"t = {run[k].time:.4g} s")
    plots.plot_force_chains(run[-1], ax=axes[1, 1], view=view, title="Forces at the end")
    for ax in axes.flat:
        ax.label_outer()
    figure.savefig(folder / f"{NAME}.png", dpi=130)
    plt.close(figure)

    history = run.history
    figure, axes = plt.subplots(1, 3, figsize=(15.0, 4.0), layout="constrained")
    axes[0].plot(100.0 * history["shortening"], history["fold_height"], lw=1.5)
    axes[0].set(xlabel="shortening [%]", ylabel="height of the fold [m]")
    histories.plot_energy(history, ax=axes[1])
    histories.plot_residual(history, ax=axes[2])
    figure.savefig(folder / f"{NAME}_curves.png", dpi=110)
    plt.close(figure)
    size = (9.0, 9.0 * (high + 1.0) / across + 0.7)
    run.animate(folder / f"{NAME}.gif", "material", view=view, figsize=size, dpi=80, colorbar=False)


def text_of(value):
    if isinstance(value, tuple):
        return " x ".join(map(text_of, value))
    return f"{value:,}" if isinstance(value, int) else f"{value:.4g}"


def main(arguments=None):
    """Runs, prints the figures, draws; returns the figures."""
    options = options_from(arguments)
    _, path, about = simulate(options)
    with cn.load(path) as run:
        figures = figures_of(run, about, options)
        for name, (value, unit) in figures.items():
            print(f"{name:28s} {text_of(value)} {unit}".rstrip())
        draw(run, options.output)
    return figures


if __name__ == "__main__":
    main()
