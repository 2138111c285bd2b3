"""Hopper: disks flow out of a flat-bottomed silo, and the rate is set against Beverloo's law.

Sand does not flow as water does. The rate at which it leaves a silo does not depend on how much stands above: grains fall
freely only from a vault about as wide as the opening, so that their speed there goes as sqrt(g D), and the mass per unit of
time in two dimensions as rho phi sqrt(g) D^(3/2). Beverloo (1961) found that the opening counts as if it were smaller by a
few grains, since no centre of a grain passes near its edge:

    Q = C rho phi sqrt(g) (D - k d)^(3/2),      C about 0.6 to 1 in two dimensions, k about 1 to 2.

The silo is packed geometrically, stands on a door for a moment, then the door is removed between two steps; grains that have
fallen out are removed as well. The rate is fitted to the steady part of the discharge and C is printed for k = 1.5.

Run it:  python hopper.py            1,200 disks, half a minute
         python hopper.py --help
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cairn as cn
import numpy as np
from cairn.post import plots

NAME = "hopper"
DIAMETER = 0.01  # mean, of grains [m]
SPREAD = 0.2  # radii from 0.8 to 1.2 of the mean: equal disks would crystallise
DENSITY, FRICTION, GRAVITY = 2500.0, 0.5, 9.81
WIDTH, OPENING = 30 * DIAMETER, 9 * DIAMETER
STEP = 5e-4  # [s]: a grain falling from the vault moves a tenth of its radius
CLOSED = 0.1  # [s] until the door goes
EMPTY = -8 * DIAMETER  # grains below this height are removed
EDGE = 1.5  # k of Beverloo's law


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--disks", type=int, default=1200)
    parser.add_argument("--steps", type=int, default=3000, help="of 0.5 ms")
    parser.add_argument("--opening", type=float, default=OPENING / DIAMETER, help="in grain diameters (9)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--frames", type=int, default=50)
    parser.add_argument("--output", type=Path, default=Path("."))
    return parser.parse_args(arguments)


def build_scene(options):
    """A silo with a door across its opening."""
    radii = cn.pre.grains.uniform(options.disks, DIAMETER / 2 * (1 - SPREAD), DIAMETER / 2 * (1 + SPREAD), rng=options.seed)
    centers = cn.pre.deposit_disks(radii, WIDTH)
    glass = cn.Material("glass", density=DENSITY)
    scene = cn.Scene(dim=2, gravity=(0.0, -GRAVITY))
    layer = cn.pre.layers(centers, 8)
    for k in range(8):  # stripes, to see how the silo empties
        here = layer == k
        scene.add(cn.disks(centers[here], radii[here], glass, group=f"layer {k + 1}"))
    left, right = WIDTH / 2 - options.opening * DIAMETER / 2, WIDTH / 2 + options.opening * DIAMETER / 2
    thick = DIAMETER / 4  # round edges; the upper side of the floor is at height 0
    scene.add(cn.wall((0, 0), (1, 0), glass), cn.wall((WIDTH, 0), (-1, 0), glass))
    scene.add(cn.segment((0, -thick), (left - thick, -thick), glass, radius=thick))
    scene.add(cn.segment((right + thick, -thick), (WIDTH, -thick), glass, radius=thick))
    scene.add(cn.segment((left, -thick), (right, -thick), glass, radius=thick, group="door"))
    scene.interact(glass, glass, cn.Coulomb(mu=FRICTION))
    return scene


class Discharge:
    """Opens the door, removes grains that have fallen out, and records the discharged mass at each step."""

    def __init__(self, simulation, disks):
        self.simulation, self.disks, self.open = simulation, disks, False
        self.door = int(simulation.bodies.id[-1])
        self.time, self.mass, self.gone = [], [], 0.0

    def __call__(self, simulation):
        if not self.open and simulation.time >= CLOSED:
            simulation.remove(self.door)
            self.open = True
        bodies = simulation.bodies
        grain = bodies.id < self.disks
        out = np.flatnonzero(grain & (bodies.position[:, 1] < EMPTY))
        if len(out):
            self.gone += float(bodies.mass[out].sum())
            simulation.remove(bodies.id[out])
        self.time.append(simulation.time)
        self.mass.append(self.gone)
        return grain.sum() > len(out)  # False, once the silo is empty, ends the run

    def rate(self):
        """Mass per unit of time [kg/s]: a line through the middle of the discharge."""
        time, mass = np.array(self.time), np.array(self.mass)
        steady = (mass > 0.15 * mass[-1]) & (mass < 0.85 * mass[-1])
        return float(np.polyfit(time[steady], mass[steady], 1)[0]) if steady.sum() > 2 else 0.0


def simulate(options):
    """Runs; returns the path of the file, the discharge, and the solid fraction in the silo at the start."""
    simulation = cn.Simulation(
        build_scene(options), STEP, cn.NSCD(solver=cn.NLGS(tol=1e-3, max_iter=100), threads=options.threads)
    )
    position, radii = simulation.bodies.position[: options.disks], simulation.radii()[: options.disks]
    solid = cn.pre.solid_fraction(
        position, radii, (0, 2 * DIAMETER), (WIDTH, max(np.quantile(position[:, 1], 0.9), 3 * DIAMETER))
    )
    options.output.mkdir(parents=True, exist_ok=True)
    path = options.output / f"{NAME}.vtkhdf"
    discharge = Discharge(simulation, options.disks)
    simulation.run(
        options.steps,
        output=path,
        every=max(options.steps // options.frames, 1),
        callback=discharge,
        probes={"mass_gone": lambda _: discharge.gone},
        overwrite=True,
    )
    return path, discharge, solid


def draw(run, discharge, folder):
    """The silo full, half-way and at the end with its forces; the discharged mass over time; the animation."""
    import matplotlib.pyplot as plt

    first = run[0].bodies
    top = float(first["position"][first["radius"] > 0, 1].max()) + DIAMETER
    view = ((-DIAMETER, WIDTH + DIAMETER), (EMPTY, top))
    figure, axes = plt.subplots(1, 4, figsize=(13.0, 4.6), layout="constrained")
    half = len(run) // 2
    for ax, k in zip(axes, (0, half)):
        plots.plot_step(run[k], "material", ax=ax, view=view, colorbar=False, title=f"t = {run[k].time:.3g} s")
    plots.plot_force_chains(run[half], ax=axes[2], view=view, width=0.8, title="Forces")
    axes[3].plot(discharge.time, discharge.mass, lw=1.5)
    axes[3].set(xlabel="time [s]", ylabel="mass gone [kg]", title=f"rate {discharge.rate():.3g} kg/s")
    for ax in axes[1:3]:
        ax.set_ylabel("")
    figure.savefig(folder / f"{NAME}.png", dpi=120)
    plt.close(figure)
    run.animate(folder / f"{NAME}.gif", "material", view=view, figsize=(4.5, 6.0), dpi=80, colorbar=False)


def main(arguments=None):
    """Runs, prints the figures, draws; returns the figures."""
    options = options_from(arguments)
    path, discharge, solid = simulate(options)
    opening = options.opening * DIAMETER
    law = DENSITY * solid * np.sqrt(GRAVITY) * (opening - EDGE * DIAMETER) ** 1.5
    with cn.load(path) as run:
        history = run.history
        figures = {
            "disks": (options.disks, ""),
            "opening": (options.opening, "diameters"),
            "solid fraction at the start": (solid, ""),
            "mass gone": (discharge.gone, "kg"),
            "rate": (discharge.rate(), "kg/s"),
            "C of Beverloo's law": (discharge.rate() / law, f"at k = {EDGE}"),
            "error, median": (float(np.median(history["error"])), ""),
            "iterations, mean": (float(np.mean(history["iterations"])), ""),
            "overlap, deepest": (float(np.max(history["penetration"])), "of a radius"),
        }
        for name, (value, unit) in figures.items():
            print(f"{name:28s} {value:.4g} {unit}".rstrip())
        draw(run, discharge, options.output)
    return figures


if __name__ == "__main__":
    main()
