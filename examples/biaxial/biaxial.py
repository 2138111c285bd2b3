"""Biaxial test: a dense sample between four walls is shortened at constant lateral stress; friction angle and dilatancy.

The test by which soils are measured, in two dimensions and without gravity. The right wall is servo-controlled: it carries
a force that keeps the lateral stress sigma_3 constant. First both moving walls carry the same stress, without
friction so that the sample becomes dense, then with it, until all is at rest; then the lid goes down at a constant speed.
The example follows:

- the mobilised friction, sin phi = (sigma_1 - sigma_3) / (sigma_1 + sigma_3): a dense sample passes a peak, then softens
  to a plateau;
- the volumetric strain: the grains must climb over each other (Reynolds 1885), so that a dense sample swells;
- the rotations of the grains, which show where the strain localises in bands.

The speed keeps the inertial number I = rate x d sqrt(rho / sigma_3) near 1e-3, which is slow: the curves do not depend on it.

Run it:  python biaxial.py            800 disks, half a minute
         python biaxial.py --help
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cairn as cn
import numpy as np
from cairn.post import plots

NAME = "biaxial"
DIAMETER = 0.01  # mean [m]
DENSITY, FRICTION = 2700.0, 0.5
STRESS = 1.0e4  # sigma_3 [Pa]
INERTIAL = 1.0e-3
STEP = 5e-4  # [s]
CALM = 400  # steps at equal stresses


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--disks", type=int, default=800)
    parser.add_argument("--strain", type=float, default=0.12, help="axial (0.12)")
    parser.add_argument("--inertial", type=float, default=INERTIAL, help="inertial number (1e-3)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--output", type=Path, default=Path("."))
    return parser.parse_args(arguments)


class Test:
    """A sample between its walls, and the stresses and strains measured on them."""

    def __init__(self, centers, radii, lengths, law, options):
        sand, plate = cn.Material("sand", density=DENSITY), cn.Material("plate", density=DENSITY)
        scene = cn.Scene(dim=2, gravity=(0.0, 0.0))
        scene.add(cn.disks(centers, radii, sand))
        scene.add(cn.wall((0, 0), (0, 1), plate), cn.wall((0, 0), (1, 0), plate))
        mass = float(DENSITY * np.sum(np.pi * radii**2)) / 20
        self.right, self.lid = right, lid = len(radii) + 2, len(radii) + 3
        for point, normal, free, other, axis in (
            ((lengths[0], 0), (-1, 0), "vx", lid, 1),
            ((0, lengths[1]), (0, -1), "vy", right, 0),
        ):
            # a wall is loaded on the length that the other moving wall leaves it
            area = lambda sim, other=other, axis=axis: sim.bodies.position[other, axis]
            servo = cn.Servo(STRESS, normal, area=area)
            scene.add(cn.wall(point, normal, plate, mass=mass, free=free, force=servo))
        scene.interact(sand, sand, law)
        scene.interact(sand, plate, cn.Frictionless())  # so that the axes of stress are those of the walls
        solver = cn.NLGS(tol=1e-4, max_iter=200)
        self.simulation = cn.Simulation(scene, STEP, cn.NSCD(solver=solver, threads=options.threads))
        self.count, self.size = len(radii), np.zeros(2)

    @classmethod
    def dense(cls, options):
        """A sample compressed without friction, which packs it as densely as disorder allows, then given its friction."""
        radii = cn.pre.grains.uniform(options.disks, 0.35 * DIAMETER, 0.65 * DIAMETER, rng=options.seed)
        width = np.sqrt(np.sum(np.pi * radii**2) / 0.82 / 2.0)  # twice as high as wide
        centers = cn.pre.deposit_disks(radii, width)
        loose = cls(centers, radii, (width, np.max(centers[:, 1] + radii)), cn.Frictionless(), options)
        loose.calm(2 * CALM)
        centers = loose.simulation.bodies.position[: options.disks]
        return cls(centers, radii, loose.lengths(), cn.Coulomb(mu=FRICTION), options)

    def solid_fraction(self):
        """Area of the grains over that between the walls."""
        return float(np.sum(np.pi * self.simulation.radii()[: self.count] ** 2) / np.prod(self.lengths()))

    def lengths(self):
        """Width and height between the walls [m]."""
        position = self.simulation.bodies.position
        return np.array([position[self.right, 0], position[self.lid, 1]])

    def stresses(self):
        """Lateral and axial stress on the moving walls [Pa], from the impulses of the last step."""
        contacts, (width, height) = self.simulation.contacts, self.lengths()
        push = np.abs(contacts.force)
        on = lambda wall: np.any(contacts.bodies == wall, axis=1)
        return push[on(self.right), 0].sum() / height, push[on(self.lid), 1].sum() / width

    def calm(self, steps):
        """Equal stresses on both moving walls, until the sample is at rest."""
        self.simulation.run(steps, progress=False)
        self.size = self.lengths()

    def shear(self, options):
        """Drives the lid down; returns the path of the file."""
        rate = options.inertial / (DIAMETER * np.sqrt(DENSITY / STRESS))
        self.simulation.drive(self.lid, ("vx", "vy", "w"), (0.0, -rate * self.size[1], 0.0))
        steps = max(int(round(options.strain / rate / STEP)), 2)
        options.output.mkdir(parents=True, exist_ok=True)
        path = options.output / f"{NAME}.vtkhdf"
        strain = lambda sim: self.lengths() / self.size - 1.0
        self.simulation.run(
            steps,
            output=path,
            every=max(steps // options.frames, 1),
            probes={
                "axial_strain": lambda sim: -strain(sim)[1],
                "volumetric_strain": lambda sim: np.prod(1.0 + strain(sim)) - 1.0,
                "lateral_stress": lambda sim: self.stresses()[0],
                "axial_stress": lambda sim: self.stresses()[1],
            },
            overwrite=True,
        )
        return path


def smooth(values, share=0.02):
    """Running mean over a share of the curve: the stress of rigid grains jumps as contacts open and close."""
    window = max(int(len(values) * share), 1)
    return np.convolve(values, np.ones(window) / window, mode="valid")


def curves(history):
    """Axial strain, sin phi and volumetric strain, smoothed."""
    axial, lateral = smooth(history["axial_stress"]), smooth(history["lateral_stress"])
    return smooth(history["axial_strain"]), (axial - lateral) / (axial + lateral), smooth(history["volumetric_strain"])


def draw(run, folder):
    """Rotations and forces at the end, and the two curves of the test; the animation of the rotations."""
    import matplotlib.pyplot as plt

    strain, sine, volume = curves(run.history)
    last = run[-1].bodies
    grain = last["radius"] > 0
    reach = np.maximum(last["position"][grain].max(0), run[0].bodies["position"][grain].max(0)) + DIAMETER
    view = ((-DIAMETER, reach[0]), (-DIAMETER, reach[1]))
    figure, axes = plt.subplots(1, 4, figsize=(13.0, 4.6), layout="constrained")
    plots.plot_step(run[-1], "rotation", ax=axes[0], view=view, limits=(-0.6, 0.6), cmap="RdBu", title="Rotation at the end")
    plots.plot_force_chains(run[-1], ax=axes[1], view=view, width=0.8, title="Forces")
    axes[2].plot(100 * strain, sine)
    axes[2].set(xlabel="axial strain [%]", ylabel="mobilised friction, sin phi [-]", ylim=(0, None))
    axes[3].plot(100 * strain, 100 * volume)
    axes[3].set(xlabel="axial strain [%]", ylabel="volumetric strain [%]")
    figure.savefig(folder / f"{NAME}.png", dpi=120)
    plt.close(figure)
    options = {"limits": (-0.6, 0.6), "cmap": "RdBu", "view": view, "figsize": (4.5, 6.5), "dpi": 80}
    run.animate(folder / f"{NAME}.gif", "rotation", **options)


def main(arguments=None):
    """Runs, prints the figures, draws; returns the figures."""
    options = options_from(arguments)
    test = Test.dense(options)
    test.calm(CALM)
    rest, solid = test.stresses(), test.solid_fraction()
    path = test.shear(options)
    with cn.load(path) as run:
        history = run.history
        strain, sine, volume = curves(history)
        plateau = float(np.mean(sine[strain > 0.7 * strain[-1]]))
        figures = {
            "disks": (options.disks, ""),
            "solid fraction before": (solid, ""),
            "stresses before": (rest[0] / STRESS, f"and {rest[1] / STRESS:.4f} of the wanted"),
            "lateral stress, mean": (float(np.mean(history["lateral_stress"])) / STRESS, "of the wanted"),
            "axial strain": (float(history["axial_strain"][-1]), ""),
            "friction angle, peak": (float(np.degrees(np.arcsin(sine.max()))), "degrees"),
            "friction angle, plateau": (float(np.degrees(np.arcsin(plateau))), "degrees"),
            "volumetric strain": (float(volume[-1]), ""),
            "error, median": (float(np.median(history["error"])), ""),
            "iterations, mean": (float(np.mean(history["iterations"])), ""),
            "overlap, deepest": (float(np.max(history["penetration"])), "of a radius"),
        }
        for name, (value, unit) in figures.items():
            print(f"{name:28s} {value:.4g} {unit}".rstrip())
        draw(run, options.output)
    return figures


if __name__ == "__main__":
    main()
