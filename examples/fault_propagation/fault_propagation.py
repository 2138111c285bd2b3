"""Fault propagation: a layered deposit over a basement that is cut by a fault, whose upper block moves up or down along it.

Earthquakes move rock under sand and clay; where and how steeply the rupture comes to the surface decides which buildings are
damaged. The deposit is that of the forced fold (rigid disks of 0.42 to 0.56 m, 2800 kg/m3, dry friction 0.4, steps of 0.025 s,
section 5.1 of Dubois & Renouf 2007); below it lie two blocks, joined along a plane of a given dip. The upper block slides down
along that plane (normal fault) or up (reverse), at 0.4 m/s, together with the wall at its end.

In boxes of sand a reverse fault rises less steeply than in the basement, a normal fault more steeply (Cole & Lade 1984; Bray,
Seed, Cluff & Seed 1994). Measured here: the strain of the deposit since the start round each disk, and the line through the disks
in which a half of all shear is, fitted by moments above the tip of the fault.

Run it:  python fault_propagation.py                 3,000 disks, normal and reverse, a quarter of a minute
         python fault_propagation.py --dip 45        of the block [degrees]
         python fault_propagation.py --full          12,000 disks
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cairn as cn
import matplotlib.pyplot as plt
import numpy as np
from cairn.base import checks
from matplotlib.collections import EllipseCollection
from scipy.spatial import Delaunay

NAME = "fault_propagation"
SMALLEST, LARGEST, DENSITY, FRICTION, STEP, GRAVITY = 0.42, 0.56, 2800.0, 0.4, 2.5e-2, 9.81
LAYERS, LENGTH_TO_HEIGHT, SOLID = 8, 4.0, 0.82
SETTLING, SPEED = 2.0, 0.4  # [s], [m/s]


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--disks", type=int, help="(3,000; full 12,000)")
    parser.add_argument("--dip", type=float, default=60.0, help="of the fault in the basement [degrees]")
    parser.add_argument("--slip", type=float, default=0.25, help="along it, over the height of the deposit")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--full", action="store_true", help="12,000 disks")
    parser.add_argument("--output", type=Path, default=Path("."))
    options = parser.parse_args(arguments)
    options.disks = options.disks or (12_000 if options.full else 3_000)
    checks.count("disks", options.disks, 50)
    checks.positive("slip", options.slip)
    if not 20 <= options.dip <= 90:
        raise ValueError(f"dip is {options.dip}: give degrees from 20 to 90")
    return options


class Deposit:
    """The scene over a block that slides along its fault: way +1 down (normal), -1 up (reverse)."""

    def __init__(self, options, way):
        self.radii = cn.pre.grains.uniform(options.disks, SMALLEST, LARGEST, rng=options.seed)
        self.length = length = float(np.sqrt(LENGTH_TO_HEIGHT * np.sum(np.pi * self.radii**2) / SOLID))
        centers = cn.pre.deposit_disks(self.radii, length)
        self.layer = cn.pre.layers(centers, LAYERS)
        self.height = height = length / LENGTH_TO_HEIGHT
        self.tip, deep, dip = 0.45 * length, 2 * options.slip * height + 2 * LARGEST, np.radians(options.dip)
        foot = self.tip + deep / np.tan(dip)
        rock = cn.Material("rock", density=DENSITY)
        end = cn.Material("end", density=DENSITY)
        self.scene = scene = cn.Scene(dim=2, gravity=(0.0, -GRAVITY))
        scene.add(cn.disks(centers, self.radii, rock))
        along = way * SPEED * np.array([np.cos(dip), -np.sin(dip)])
        move = cn.Table([0.0, SETTLING, SETTLING + 1.0], [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [*along, 0.0]])
        still = np.array([[-length, -deep], [foot, -deep], [self.tip, 0.0], [-length, 0.0]])
        moved = np.array([[foot, -deep], [2 * length, -deep], [2 * length, 0.0], [self.tip, 0.0]])
        self.shapes, self.begin = (still, moved), np.zeros(2)
        held = {"driven": ("vx", "vy", "w")}
        base = cn.Material("base", density=DENSITY)
        scene.add(cn.polygons([still], base, **held), cn.polygons([moved], base, drive=move, **held))
        aside = cn.Table([0.0, SETTLING, SETTLING + 1.0], [[0.0, 0.0], [0.0, 0.0], [along[0], 0.0]])
        scene.add(cn.wall((0.0, 0.0), (1.0, 0.0), end), cn.wall((length, 0.0), (-1.0, 0.0), end, velocity=aside))
        for other in (rock, base, end):
            scene.interact(rock, other, cn.Coulomb(mu=FRICTION))
        scene.interact(base, base, None)
        scene.interact(base, end, None)
        self.steps = int(np.ceil((SETTLING + 0.5 + options.slip * height / SPEED) / STEP))

    def blocks(self, moved):
        """Outlines of the basement's blocks, the second moved by a way (2,)."""
        return self.shapes[0], self.shapes[1] + moved


def sheared(start, end):
    """Strain sqrt(2 e:e) of the deviator of each disk since the start: least squares over its neighbours then, (n,)."""
    n = len(start)
    triangles = Delaunay(start).simplices
    pairs = np.unique(np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1), axis=0)
    pairs = pairs[np.linalg.norm(start[pairs[:, 0]] - start[pairs[:, 1]], axis=1) < 3 * LARGEST]
    one = np.concatenate([pairs, pairs[:, ::-1]])
    x, u = start[one[:, 1]] - start[one[:, 0]], (end - start)[one[:, 1]] - (end - start)[one[:, 0]]
    xx, ux = np.zeros((n, 2, 2)), np.zeros((n, 2, 2))
    np.add.at(xx, one[:, 0], x[:, :, None] * x[:, None])
    np.add.at(ux, one[:, 0], u[:, :, None] * x[:, None])
    known = np.linalg.cond(xx) < 1e3
    gradient = ux[known] @ np.linalg.inv(xx[known])
    strain = 0.5 * (gradient + np.swapaxes(gradient, 1, 2))
    deviator = strain - 0.5 * np.trace(strain, axis1=1, axis2=2)[:, None, None] * np.eye(2)
    out = np.zeros(n)
    out[known] = np.sqrt(2 * np.sum(deviator**2, axis=(1, 2)))
    return out


def line_of(place, strain, tip, height):
    """Dip [degrees] of the line through the tip of the fault and the disks that hold a half of all shear near it."""
    near = (np.abs(place[:, 0] - tip) < 1.5 * height) & (place[:, 1] > 0.1 * height) & (place[:, 1] < 0.9 * height)
    order = np.argsort(strain[near])[::-1]
    held = np.cumsum(strain[near][order])
    chosen = order[: np.searchsorted(held, 0.5 * held[-1]) + 1]
    arm, weight = place[near][chosen] - (tip, 0.0), strain[near][chosen]
    moment = np.einsum("k,ki,kj->ij", weight, arm, arm)
    direction = np.linalg.eigh(moment)[1][:, -1]
    return float(np.degrees(np.arctan2(*(direction * np.sign(direction[1]) * (-1.0, 1.0))[::-1])))


def simulated(options, way, name):
    """Scene, simulation, places at the begin, errors."""
    deposit = Deposit(options, way)
    sim = cn.Simulation(deposit.scene, STEP, cn.NSCD(theta=0.5, solver=cn.NLGS(tol=1e-4, min_iter=20, max_iter=100)))
    n, errors = len(deposit.radii), []
    deposit.begin = sim.bodies.position[n + 1].copy()
    settled = round(SETTLING / STEP)
    sim.run(settled, progress=False)
    start = sim.bodies.position[:n].copy()
    sim.run(deposit.steps - settled, output=options.output / name, every=max(1, deposit.steps // 20), overwrite=True,
            callback=lambda s: errors.append(s.info["error"]), progress=options.full)  # fmt: skip
    return deposit, sim, start, np.array(errors)


def draw(results, options):
    """Layers and shear of both, with the fault of the block and the line that was fitted."""
    figure, axes = plt.subplots(2, 2, figsize=(11, 6.6), layout="constrained")
    for (name, (deposit, place, strain, dip, place_of_block)), (layers, shear) in zip(results.items(), axes.T):
        across = 2 * deposit.radii
        for axis, array, cmap, limits in (
            (layers, deposit.layer % 2 + 0.2 * (deposit.layer % 3), "copper", (-0.3, 1.6)),
            (shear, strain, "inferno", (0.0, 1.0)),
        ):
            drawn = EllipseCollection(across, across, 0, units="xy", offsets=place, offset_transform=axis.transData, array=array)
            drawn.set(cmap=cmap, clim=limits)
            axis.add_collection(drawn)
            for block in deposit.blocks(place_of_block):
                axis.fill(*block.T, color="0.6")
            axis.set(aspect="equal", xlim=(0.1 * deposit.length, 0.9 * deposit.length),
                     ylim=(-0.45 * deposit.height, 1.4 * deposit.height))  # fmt: skip
        shear.set_facecolor("0.85")
        shear.set(xlabel="x [m]")
        layers.label_outer()
        for angle, style, label in ((options.dip, "c-", "block"), (dip, "w--", "deposit")):
            t = np.radians(angle)
            size = np.array([-0.45 if label == "block" else 0.0, 0.0 if label == "block" else 1.3]) * deposit.height
            x = deposit.tip - size / np.tan(t)
            shear.plot(x, size, style, lw=1.5, label=f"{label}: {angle:.0f} degrees")
        shear.legend(loc="upper right")
        layers.set_title(f"{name} fault")
    for axis in axes[:, 0]:
        axis.set_ylabel("y [m]")
    shown = plt.cm.ScalarMappable(plt.Normalize(0.0, 1.0), "inferno")
    figure.colorbar(shown, ax=list(axes[1]), label="shear strain around a disk [-]", shrink=0.9)
    figure.savefig(options.output / f"{NAME}.png", dpi=110)
    plt.close(figure)


def main(arguments=None):
    """Runs, prints the figures, draws; returns the figures."""
    options = options_from(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    results, figures = {}, {}
    for name, way in (("normal", 1), ("reverse", -1)):
        deposit, sim, start, errors = simulated(options, way, f"{NAME}.vtkhdf" if way < 0 else f"{NAME}_{name}.vtkhdf")
        place = sim.bodies.position[: len(start)]
        strain = sheared(start, place)
        dip = line_of(start, strain, deposit.tip, deposit.height)
        results[name] = deposit, place, strain, dip, sim.bodies.position[len(start) + 1] - deposit.begin
        terms = sim.info["energy"]
        figures |= {
            f"{name}: dip of the fault in the deposit": (dip, "degrees"),
            f"{name}: over that of the block": (dip - options.dip, "degrees"),
            f"{name}: steps": (sim.steps, ""),
            f"{name}: error, median": (np.median(errors), ""),
            f"{name}: closure of the balance": (abs(terms["closure"]) / terms["in_play"], "of the energy in play"),
        }
    for name, (value, unit) in figures.items():
        print(f"{name:44s} {value:.4g} {unit}".rstrip())
    draw(results, options)
    return figures


if __name__ == "__main__":
    main()
