"""Cohesive grains between two elastic plates, compacted and sheared: rigid and deformable bodies in the same step.

Disks of 0.5 to 1 mm that attract each other, and both plates, by the non-smooth Lennard-Jones law (Signorini's graph moved by
a constant force within a reach) lie between two plates of Q4 elements as small as the smallest disk. The head of the upper
plate, two rows of nodes that move as a rigid body, is loaded by a pressure and then driven sideways; the base of the lower
plate is held. Frictionless walls at both ends, which incline with the shear of the bed, confine the disks alone, not the plates.
This is the scene of section 5.6 of Dubois & Renouf (2007); the paper tells neither sizes nor stiffness, attraction nor load,
which are chosen here:

- A pressure of 1 MPa on plates of 2 GPa: they give by a thousandth, and carry force chains from grain to base.
- The attraction is 0.2 of the mean force that the pressure gives to a grain of mean size, its reach a
  twentieth of the least radius; a disk that near to two edges of a plate is drawn by both.
- The load comes on in a tenth of the time and the plate starts to move in the next; the inertial number of the shear,
  rate x d sqrt(density / p), is printed: below 0.001 grains deform slowly.

The stress of a grain is the sum of force x lever arm of its contacts over its volume; it is drawn with that of the plates' cells
as equivalent stress, sqrt(xx^2 + yy^2 - xx yy + 3 xy^2), in the same scale. Momentum is checked in each step for bed and plates
separately: its change equals the impulses of contacts, loads and supports.

Run it:  python grains_between_plates.py                 600 disks, a quarter of a minute
         python grains_between_plates.py --full          3,000 disks, plates of 150 mm
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import cairn as cn
import matplotlib.pyplot as plt
import numpy as np
from cairn.base import checks
from cairn.post.measures import body_moments
from matplotlib.collections import EllipseCollection, PolyCollection

NAME = "grains_between_plates"
SMALLEST, LARGEST = 0.5e-3, 1e-3  # radii [m]
GRAIN_DENSITY, PLATE_DENSITY = 2600.0, 1200.0
YOUNG, POISSON = 2e9, 0.3
PRESSURE = 1e6  # [Pa]
FRICTION = 0.3
ATTRACTION = 0.2 * PRESSURE * (SMALLEST + LARGEST)  # [N]
REACH = 0.05 * SMALLEST
CELL = 2 * SMALLEST
SOLID, LENGTH_TO_HEIGHT, PLATE_TO_LENGTH = 0.82, 150 / 44.7, 30 / 150
PLATEN, STEEL, STEEL_DENSITY = 10e-3, 210e9, 7800.0
RATE = 12.0  # of the shear [1/s]


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--disks", type=int, help="number of disks (600; full 3,000)")
    parser.add_argument("--strain", type=float, default=0.2, help="shear strain of the bed (0.2)")
    parser.add_argument("--tolerance", type=float, default=1e-4, help="of the solver's true error")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--full", action="store_true", help="3,000 disks")
    parser.add_argument("--output", type=Path, default=Path("."))
    options = parser.parse_args(arguments)
    if options.disks is None:
        options.disks = 3000 if options.full else 600
    checks.count("disks", options.disks, 20)
    checks.positive("strain", options.strain)
    return options


def plate(left, length, bottom, thickness):
    """A plate of squares of the size of the smallest disk; base and head are its lowest and highest two rows of nodes."""
    across, up = max(4, round(length / CELL)), max(4, round(thickness / CELL))
    x, y = np.meshgrid(np.linspace(0, length, across + 1), np.linspace(0, thickness, up + 1), indexing="ij")
    number = np.arange(x.size).reshape(x.shape)
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], -1).reshape(-1, 4)
    groups = {"bottom": number[:, 0], "top": number[:, -1]}
    points = np.column_stack([x.ravel() + left, y.ravel() + bottom])
    return cn.ElasticBody(points, {"quad": quads}, young=YOUNG, poisson=POISSON, density=PLATE_DENSITY, groups=groups,
                          rayleigh=(0.0, 2e-6))  # fmt: skip


def platen_on(body):
    """One cell of steel along the top of a plate: driven sideways at all of its nodes it hardly tilts."""
    (left, _), (right, top) = body.points.min(axis=0), body.points.max(axis=0)
    points = [[left, top], [right, top], [right, top + PLATEN], [left, top + PLATEN]]
    return cn.ElasticBody(points, {"quad": [[0, 1, 2, 3]]}, young=STEEL, poisson=POISSON, density=STEEL_DENSITY,
                          groups={"under": [0, 1]})  # fmt: skip


class Press:
    """Scene of the bed between two plates, with its measurements."""

    def __init__(self, options):
        self.radii = cn.pre.grains.uniform(options.disks, SMALLEST, LARGEST, rng=options.seed)
        self.length = length = float(np.sqrt(LENGTH_TO_HEIGHT * np.sum(np.pi * self.radii**2) / SOLID))
        centers = cn.pre.deposit_disks(self.radii, length)
        self.height = float((centers[:, 1] + self.radii).max())
        thickness, way = PLATE_TO_LENGTH * length, options.strain * self.height
        self.travel = way / (RATE * self.height)  # [s]
        self.times = np.array([0.1, 0.3, 0.4, 1.4]) * self.travel  # loaded, pressed, at full speed, the end
        self.speed = speed = way / (self.times[3] - 0.5 * (self.times[1] + self.times[2]))
        self.load = cn.Table([0.0, self.times[0]], [0.0, PRESSURE * length])
        shear = cn.Table([0.0, self.times[1], self.times[2]], [0.0, 0.0, speed])
        grain, skin, end = (cn.Material(name, density=GRAIN_DENSITY) for name in ("grain", "skin", "end"))
        lower = plate(-0.1 * way, length + 0.2 * way, -thickness, thickness)
        upper = plate(-1.1 * way, length + 1.2 * way, self.height, thickness)
        self.scene = scene = cn.Scene(dim=2)
        scene.add(cn.disks(centers, self.radii, grain, group="bed"))
        turn = {"velocity": lambda t: (0.0, 0.0, self.spin(t))}
        scene.add(cn.wall((0.0, 0.0), (1.0, 0.0), end, **turn), cn.wall((length, 0.0), (-1.0, 0.0), end, **turn))
        scene.add(cn.deformable(lower, skin, name="lower", edges="top", fixed={"bottom": "xy"}))
        platen = platen_on(upper)
        upper = cn.tied({"plate": upper, "platen": platen}, [("plate.top", "platen.under")])
        scene.add(cn.deformable(upper, skin, name="upper", edges="plate.bottom", drive={"platen.all": {"x": shear}},
                                force=lambda t: {"platen.all": (0.0, -self.load(t))}))  # fmt: skip
        sticky = cn.Wet(force=ATTRACTION, reach=REACH, mu=FRICTION)
        scene.interact(grain, grain, sticky)
        scene.interact(grain, skin, sticky)
        scene.interact(grain, end, cn.Frictionless())
        scene.interact(skin, end, None)
        scene.interact(skin, skin, None)

    def spin(self, t):
        """Spin of the walls, which incline with the shear [rad/s]."""
        begin, full = self.times[1:3]
        rate = self.speed * np.clip((t - begin) / (full - begin), 0.0, 1.0)
        way = self.speed * max(0.0, t - full) + 0.5 * rate * np.clip(t - begin, 0.0, full - begin)
        return -rate * self.height / (self.height**2 + way**2)


class Watch:
    """Momentum of bed and plates in each step, and what the shear takes."""

    def __init__(self, sim, press):
        self.press, self.disks = press, len(press.radii)
        self.masses = [mesh.body.nodal_mass()[:, None] for mesh in sim.meshes]
        self.before, self.errors, self.history, self.worst = self.momentum(sim), [], [], np.zeros(3)

    def momentum(self, sim):
        """Momentum of the disks and of each plate, (3, 2) [N s]."""
        disks = sim.bodies.mass[: self.disks, None] * sim.bodies.velocity[: self.disks, :2]
        plates = [(mass * mesh.velocity).sum(axis=0) for mass, mesh in zip(self.masses, sim.meshes)]
        return np.array([disks.sum(axis=0), *plates])

    def __call__(self, sim):
        h, now, contacts, begin = sim.dt, self.momentum(sim), sim.contacts, sim.time - sim.dt
        of_bed = contacts.bodies < self.disks
        given = np.zeros((3, 2))
        given[0] = ((of_bed[:, 0].astype(float) - of_bed[:, 1])[:, None] * contacts.impulse).sum(axis=0)
        for k, mesh in enumerate(sim.meshes, 1):
            given[k] = h * (mesh.contact_force.sum(axis=0) + mesh.reaction().sum(axis=0))
        theta = sim.strategy.theta
        given[2, 1] -= h * ((1 - theta) * self.press.load(begin) + theta * self.press.load(sim.time))
        scale = max(np.abs(sim.meshes[0].reaction("bottom")).max(), np.abs(sim.meshes[1].contact_force.sum(axis=0)).max()) * h
        if scale > 1e-3 * PRESSURE * self.press.length * h:  # the plates touch
            self.worst = np.maximum(self.worst, np.abs(given - (now - self.before)).max(axis=1) / scale)
        self.before = now
        self.errors.append(sim.info["error"])
        load = self.press.load(sim.time)
        platen = sim.meshes[1].displacement[-4:].mean(axis=0)
        shear = sim.meshes[0].reaction("bottom")
        self.history.append((sim.time, platen[0], platen[1], -shear[0] / load if load else 0.0, shear[1] / load if load else 0.0))


def equivalent(xx, yy, xy):
    """One number of a stress in the plane [Pa]."""
    return np.sqrt(xx**2 + yy**2 - xx * yy + 3 * xy**2)


def stress_of_grains(sim, radii):
    """Sum of force x lever arm over the volume of each disk, (n, 2, 2) [Pa]."""
    n, contacts, position = len(radii), sim.contacts, sim.bodies.position[: len(radii)]
    force, pair = contacts.force, contacts.bodies
    row = np.minimum(pair, n)  # all that is no disk is one body more
    centers = np.vstack([position, np.zeros(2)])
    arms = [contacts.point - centers[row[:, k]] for k in (0, 1)]
    return body_moments(n + 1, row[:, 0], row[:, 1], force, *arms)[:n] / (np.pi * radii**2)[:, None, None]


def draw(sim, press, history, options):
    """Stress of grains and plates in one scale, and the curves of the shear."""
    figure, (scene, curves) = plt.subplots(1, 2, figsize=(13, 5), width_ratios=(1.9, 1), layout="constrained")
    stress = stress_of_grains(sim, press.radii)
    grains = equivalent(stress[:, 0, 0], stress[:, 1, 1], stress[:, 0, 1]) / 1e6
    limits = (0.0, 4 * PRESSURE / 1e6)
    for mesh in sim.meshes:
        body, part = mesh.body, next(iter(getattr(mesh.body, "parts", {"": mesh.body}).values()))
        shape = 1e3 * (body.points + mesh.displacement)[part.cells["quad"]]
        cells = mesh.stress["quad"][: len(shape)]
        painted = PolyCollection(list(shape), array=equivalent(*cells.T) / 1e6, edgecolors="face", linewidths=0.1)
        painted.set(cmap="inferno", clim=limits)
        scene.add_collection(painted)
        for steel in body.cells["quad"][len(shape) :]:
            scene.fill(*(1e3 * (body.points + mesh.displacement)[steel]).T, color="0.6")
    across = 2e3 * press.radii
    centers = 1e3 * sim.bodies.position[: len(across)]
    drawn = EllipseCollection(across, across, 0, units="xy", offsets=centers, offset_transform=scene.transData, array=grains,
                              edgecolors="0.3", linewidths=0.2)  # fmt: skip
    drawn.set(cmap="inferno", clim=limits)
    scene.add_collection(drawn)
    scene.set_facecolor("0.92")
    lean = history[-1, 1] / press.height
    for x in (0.0, press.length):
        scene.plot([1e3 * x, 1e3 * (x + lean * press.height)], [0, 1e3 * press.height], color="0.5", lw=1)
    scene.autoscale_view()
    scene.set(aspect="equal", xlabel="mm", title="equivalent stress of each grain and cell")
    figure.colorbar(drawn, label="MPa", orientation="horizontal", shrink=0.7, extend="max")
    history = history[history[:, 1] > 0]
    strain = history[:, 1] / press.height
    curves.plot(100 * strain, history[:, 3], lw=1, label="shear over pressure, lower plate")
    rise = 10 * (history[:, 2] - history[0, 2]) / press.height
    curves.plot(100 * strain, rise, lw=1, label="10 x rise over height, since the shear began")
    curves.set(xlabel="shear strain [%]")
    curves.legend()
    figure.savefig(options.output / f"{NAME}.png", dpi=110)
    plt.close(figure)


def main(arguments=None):
    """Runs, prints the figures, draws; returns the figures."""
    options = options_from(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    press = Press(options)
    dt = 0.01 * SMALLEST / (RATE * press.height)
    sim = cn.Simulation(press.scene, dt, cn.NSCD(theta=0.55, solver=cn.NLGS(tol=options.tolerance, max_iter=3000)))
    watch = Watch(sim, press)
    steps = int(np.ceil(press.times[3] / dt))
    begun = time.process_time()
    sim.run(steps, output=options.output / f"{NAME}.vtkhdf", every=max(1, steps // 20), callback=watch, overwrite=True,
            progress=options.full)  # fmt: skip
    spent = time.process_time() - begun
    history, errors, terms = np.array(watch.history), np.array(watch.errors), sim.info["energy"]
    sheared = history[:, 1] > 0.5 * history[-1, 1]
    pressed = np.searchsorted(history[:, 0], press.times[1]) - 1
    stress = stress_of_grains(sim, press.radii)
    pressure = -np.trace(stress, axis1=1, axis2=2) / 2
    figures = {
        "disks": (len(press.radii), ""),
        "cells of the plates": (sum(len(mesh.body.cells["quad"]) for mesh in sim.meshes) - 1, ""),
        "steps": (sim.steps, ""),
        "inertial number": (RATE * (SMALLEST + LARGEST) * np.sqrt(GRAIN_DENSITY / PRESSURE), ""),
        "sunk by compaction": (-100 * history[pressed, 2] / press.height, "% of the height"),
        "force below over load": (history[sheared, 4].mean(), ""),
        "shear over pressure, last half": (history[sheared, 3].mean(), ""),
        "  largest": (history[history[:, 1] > 0, 3].max(), ""),
        "pressure of a grain over mean, largest": (pressure.max() / pressure.mean(), ""),
        "grains in tension": (100 * np.mean(pressure < 0), "%"),
        "balance of the bed": (watch.worst[0], "of the load, worst step"),
        "balance of the lower plate": (watch.worst[1], "of the load, worst step"),
        "balance of the upper plate": (watch.worst[2], "of the load, worst step"),
        "closure of the energy": (abs(terms["closure"]) / terms["in_play"], "of the energy in play"),
        "error, worst": (errors.max(), ""),
        "CPU time of the run": (spent, "s"),
    }
    for name, (value, unit) in figures.items():
        print(f"{name:40s} {value:.4g} {unit}".rstrip())
    draw(sim, press, history, options)
    return figures


if __name__ == "__main__":
    main()
