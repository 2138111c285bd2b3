"""Bonded disks in compression: bonds break, cracks join into shear bands, the curve of stress and strain falls.

A deposit of disks, each a little smaller than its place, is glued by parallel bonds (Potyondy & Cundall 2004) where gaps are
small, each with a strength in tension and one in shear. Disks are rigid and a bond does not shorten: the sample gives where bonds
open, shear and bend. The disks of the lowest and of the highest rows are grips that do not turn; the upper ones come down. Walls
without friction press the sides. Broken bonds leave contacts with friction.

Steps are longer than what the springs of a disk take to swing; `Auto` solves them, by Newton's method over the bodies where
sweeps take too long. All sizes and strengths are chosen here: grains of 1 to 1.5 mm, bonds of 10 GPa, 10 MPa in tension and 20 in
shear, 1 MPa on the sides, a strain rate of 2/s, at which a wave goes 20 times from end to end until the peak (5 times with
--full).

Run it:  python bonded_disks.py                 1,200 disks, half a minute
         python bonded_disks.py --full          20,000 disks
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import cairn as cn
import matplotlib.pyplot as plt
import numpy as np
from cairn.base import checks
from matplotlib.collections import EllipseCollection, LineCollection

NAME = "bonded_disks"
SMALLEST, LARGEST = 0.5e-3, 0.75e-3  # radii of their places [m]
SHARE = 0.995  # of them that the disks fill
DENSITY, YOUNG, TENSION, SHEAR, FRICTION = 2500.0, 10e9, 10e6, 20e6, 0.5
WITHIN = 0.1 * SMALLEST  # gap that a bond bridges
RATE = 2.0  # [1/s]
PRESSED = 5e-5  # time in which the pressure on the sides comes on [s]


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--disks", type=int, help="number of places (1,200; full 20,000)")
    parser.add_argument("--strain", type=float, default=0.015, help="of the sample at the end")
    parser.add_argument("--pressure", type=float, default=1e6, help="on the sides [Pa]")
    parser.add_argument("--dt", type=float, default=1e-5, help="step [s]")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--full", action="store_true", help="20,000 disks")
    parser.add_argument("--output", type=Path, default=Path("."))
    options = parser.parse_args(arguments)
    if options.disks is None:
        options.disks = 20_000 if options.full else 1_200
    checks.count("disks", options.disks, 50)
    checks.positive("strain", options.strain)
    checks.positive("dt", options.dt)
    return options


class Sample:
    """The scene: disks between grips and pressed walls."""

    def __init__(self, options):
        radii = cn.pre.grains.uniform(options.disks, SMALLEST, LARGEST, rng=options.seed)
        self.width = width = float(np.sqrt(np.sum(np.pi * radii**2) / 0.82 / 2))
        centers = cn.pre.deposit_disks(radii, width)
        level = 0.97 * (centers[:, 1] + radii).max()  # the last ones lie on an uneven surface
        kept = centers[:, 1] + radii < level
        centers, self.radii = centers[kept], SHARE * radii[kept]
        low, high = centers[:, 1] < 3 * LARGEST, centers[:, 1] > level - 4 * LARGEST
        self.height = float(centers[high, 1].min() - centers[low, 1].max())
        order = np.argsort(2 * high + low, kind="stable")  # free disks first, then the lower grip, then the upper
        self.radii, centers = self.radii[order], centers[order]
        self.grips = low[order], high[order]
        self.free = int(np.sum(~low & ~high))
        steel = cn.Material("steel", density=DENSITY)
        self.rock = rock = cn.Material("rock", density=DENSITY)
        self.scene = scene = cn.Scene(dim=2)
        share = np.clip((centers[:, 1] - centers[low[order], 1].max()) / self.height, 0.0, 1.0)
        share[high[order]] = 1.0
        sinking = np.zeros((len(order), 3))
        sinking[:, 1] = -RATE * self.height * share  # all sink at once: no wave starts from the grips
        for which in (slice(0, self.free), slice(self.free, None)):
            held = {"driven": ("vx", "vy", "w"), "drive": sinking[which]} if which.start else {}
            scene.add(cn.disks(centers[which], self.radii[which], rock, velocity=sinking[which], **held))
        force = options.pressure * level
        light = {"mass": 80 * np.pi * SMALLEST**2 * DENSITY, "free": "vx"}  # as light as some disks: they follow the sample
        for x, to in ((0.0, 1.0), (width, -1.0)):
            push = cn.Table([0.0, PRESSED], [[0.0, 0.0], [to * force, 0.0]])
            scene.add(cn.wall((x, 0.0), (to, 0.0), steel, force=push, **light))
        stiffness = YOUNG / (SMALLEST + LARGEST)
        bond = cn.ParallelBond(normal_stiffness=stiffness, tangential_stiffness=0.4 * stiffness,
                               tension=TENSION, shear=SHEAR, mu=FRICTION, radius=0.7, within=WITHIN)  # fmt: skip
        scene.interact(rock, rock, bond)
        scene.interact(rock, steel, cn.Frictionless())


class Watch:
    """Strain, stress, swelling and broken bonds of each step."""

    def __init__(self, sample):
        self.sample, self.bonds = sample, 0
        self.rows: list[tuple[float, ...]] = []
        self.errors: list[float] = []

    def __call__(self, sim):
        sample, contacts, n = self.sample, sim.contacts, len(self.sample.radii)
        pair, whole = contacts.bodies, contacts.beta > 0
        between = (pair < n).all(axis=1)
        if not self.rows:
            self.bonds = int(whole.sum())
            self.first = pair[whole & between].copy()
        upper = np.append(sample.grips[1], [False, False])[pair]
        force = contacts.force[:, 1]
        push = force[upper[:, 0] & ~upper[:, 1]].sum() - force[upper[:, 1] & ~upper[:, 0]].sum()
        y = sim.bodies.position[:n, 1]
        if not self.rows:
            self.begin = y[sample.grips[1]].mean()
        sides = sim.bodies.position[n:, 0]
        self.rows.append(((self.begin - y[sample.grips[1]].mean()) / sample.height, push / sample.width,
                          (sides[1] - sides[0]) / sample.width - 1, self.bonds - int(whole.sum())))  # fmt: skip
        self.errors.append(sim.info["error"])


def sheared(sim, sample, start, pairs):
    """Strain sqrt(2 e:e) of the deviator round each disk, by least squares over those that it was bonded to, (n,)."""
    n = len(sample.radii)
    moved = sim.bodies.position[:n] - start
    one = np.concatenate([pairs, pairs[:, ::-1]])
    x, u = start[one[:, 1]] - start[one[:, 0]], moved[one[:, 1]] - moved[one[:, 0]]
    xx, ux = np.zeros((n, 2, 2)), np.zeros((n, 2, 2))
    np.add.at(xx, one[:, 0], x[:, :, None] * x[:, None])
    np.add.at(ux, one[:, 0], u[:, :, None] * x[:, None])
    known = np.linalg.cond(xx) < 1e4
    out = np.zeros(n)
    gradient = ux[known] @ np.linalg.inv(xx[known])
    strain = 0.5 * (gradient + np.swapaxes(gradient, 1, 2))
    deviator = strain - 0.5 * np.trace(strain, axis1=1, axis2=2)[:, None, None] * np.eye(2)
    out[known] = np.sqrt(2 * np.sum(deviator**2, axis=(1, 2)))
    return out


def draw(sim, sample, start, watch, options):
    """Sheared disks, broken and whole bonds, and the curve."""
    n, rows = len(sample.radii), np.array(watch.rows)
    place, across = 1e3 * sim.bodies.position[:n], 2e3 * sample.radii
    figure, (shear, bonds, curve) = plt.subplots(1, 3, figsize=(13, 6), width_ratios=(1, 1, 1.2), layout="constrained")
    strain = sheared(sim, sample, start, watch.first)
    drawn = EllipseCollection(across, across, 0, units="xy", offsets=place, offset_transform=shear.transData, array=strain)
    drawn.set(cmap="inferno", clim=(0.0, 6 * options.strain))
    shear.add_collection(drawn)
    figure.colorbar(drawn, label="shear strain round a disk [-]", orientation="horizontal", extend="max")
    whole = {(a, b) for (a, b), held in zip(sim.contacts.bodies.tolist(), sim.contacts.beta) if held > 0}
    held = np.array([(a, b) in whole or (b, a) in whole for a, b in watch.first.tolist()])
    for some, color, wide, word in ((held, "0.75", 0.5, "hold"), (~held, "red", 0.8, "broken")):
        bonds.add_collection(LineCollection(list(place[watch.first[some]]), colors=color, linewidths=wide, label=word))
    bonds.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=2, fontsize=9, frameon=False)
    for axis, title in ((shear, "shear"), (bonds, "bonds of the start")):
        axis.autoscale_view()
        axis.set(aspect="equal", xlabel="x [mm]", ylabel="y [mm]", title=title)
    curve.plot(100 * rows[:, 0], rows[:, 1] / 1e6, lw=1)
    curve.set(xlabel="strain [%]", ylabel="stress [MPa]")
    other = curve.twinx()
    other.plot(100 * rows[:, 0], rows[:, 3], "r", lw=1)
    other.set_ylabel("broken bonds [-]", color="r")
    figure.savefig(options.output / f"{NAME}.png", dpi=110)
    plt.close(figure)
    return strain


def main(arguments=None):
    """Runs, prints the figures, draws; returns the figures."""
    options = options_from(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    sample = Sample(options)
    sim = cn.Simulation(sample.scene, options.dt, cn.NSCD(theta=0.6, solver=cn.Auto(tol=1e-3, max_iter=2000)))
    watch, start = Watch(sample), sim.bodies.position[: len(sample.radii)].copy()
    steps = int(np.ceil(options.strain / RATE / options.dt))
    begun = time.process_time()
    sim.run(steps, output=options.output / f"{NAME}.vtkhdf", every=max(1, steps // 20), callback=watch, overwrite=True,
            progress=options.full)  # fmt: skip
    spent = time.process_time() - begun
    rows, errors, terms = np.array(watch.rows), np.array(watch.errors), sim.info["energy"]
    strain = draw(sim, sample, start, watch, options)
    peak = int(np.argmax(rows[:, 1]))
    elastic = (rows[:, 1] > 0.2 * rows[peak, 1]) & (rows[:, 1] < 0.5 * rows[peak, 1]) & (np.arange(len(rows)) < peak)
    pieces = cn.post.fragments(sim)
    ordered = np.cumsum(np.sort(strain)[::-1])
    share = 100 * np.searchsorted(ordered, 0.5 * ordered[-1]) / len(ordered)
    figures = {
        "disks": (len(sample.radii), ""),
        "bonds": (watch.bonds, ""),
        "bonds of a disk": (2 * watch.bonds / len(sample.radii), ""),
        "steps": (sim.steps, ""),
        "stiffness": (np.polyfit(rows[elastic, 0], rows[elastic, 1], 1)[0] / 1e9 if elastic.sum() > 1 else np.nan, "GPa"),
        "strength": (rows[peak, 1] / 1e6, "MPa"),
        "strain at the peak": (100 * rows[peak, 0], "%"),
        "stress at the end": (rows[-len(rows) // 20 :, 1].mean() / 1e6, "MPa"),
        "broken at the peak": (rows[peak, 3], ""),
        "broken at the end": (rows[-1, 3], ""),
        "strain across, at the end": (100 * rows[-1, 2], "%"),
        "largest piece": (len(pieces[0]), "disks"),
        "half of the shear is in": (share, "% of the disks"),
        "spent by bonds": (terms["released"], "J/m"),
        "spent by friction": (terms["dissipated_friction"], "J/m"),
        "closure of the balance": (abs(terms["closure"]) / terms["in_play"], "of the energy in play"),
        "steps beyond 1e-3": (int((errors > 1e-3).sum()), ""),
        "error, worst": (errors.max(), ""),
        "CPU time of the run": (spent, "s"),
    }
    for name, (value, unit) in figures.items():
        print(f"{name:32s} {value:.4g} {unit}".rstrip())
    return figures


if __name__ == "__main__":
    main()
