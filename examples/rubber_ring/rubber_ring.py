"""A ring of rubber crushed between two plates: large strains, sliding contact, energy stored and given back.

The ring is neo-Hookean, in plane strain, of quadrilaterals of eight nodes. The upper plate comes down until
the inside of the ring lies on itself, and goes back; the force on it against its way is the stiffness of the ring, soft at
first (the bending of a ring), stiff when it is flat. Points of the inside see its edges, but those next to them
(self_contact). At small strain the stiffness is that of a thin ring under two opposite forces, F = E' I / (R^3 (pi/4 - 2/pi))
times the way, with E' = E / (1 - nu^2) (Timoshenko 1956), a little less for a ring that is not thin: the figure is of the ring
at rest under a small force, since the run begins with waves, and the ring is softer by a tenth after a tenth of its height.

Run it:  python rubber_ring.py              flattened to 14 % of its height, less than twice its thickness
         python rubber_ring.py --full       a finer mesh, slower
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cairn as cn
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection

NAME = "rubber_ring"
OUTER, INNER, YOUNG, POISSON, DENSITY = 0.05, 0.042, 2e6, 0.45, 1100.0


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--round", type=int, default=48, help="cells round the ring")
    parser.add_argument("--across", type=int, default=2, help="cells across it")
    parser.add_argument("--crush", type=float, default=0.86, help="of the height")
    parser.add_argument("--seconds", type=float, default=0.4, help="down and up")
    parser.add_argument("--steps", type=int, default=400)
    parser.add_argument("--mu", type=float, default=0.2)
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--output", type=Path, default=Path("."))
    options = parser.parse_args(arguments)
    if options.full:
        options.round, options.across, options.steps, options.seconds = 96, 4, 1600, 1.6
    if not 0 < options.crush < 0.9:
        raise ValueError(f"crush is {options.crush}: give a share of the height between 0 and 0.9")
    return options


def ring(around, across):
    """Points and cells of eight nodes, corners counter-clockwise."""
    number, points, cells = {}, [], []

    def node(a, b):  # half cells round and across
        a %= 2 * around
        if (a, b) not in number:
            angle, radius = np.pi * a / around, INNER + (OUTER - INNER) * b / (2 * across)
            number[a, b] = len(points)
            points.append((radius * np.cos(angle), OUTER + radius * np.sin(angle)))
        return number[a, b]

    corner = [(0, 0), (0, 2), (2, 2), (2, 0), (0, 1), (1, 2), (2, 1), (1, 0)]
    for a in range(around):
        for b in range(across):
            cells.append([node(2 * a + x, 2 * b + y) for x, y in corner])
    return np.array(points), {"quad8": np.array(cells)}


def crushed(options):
    """A simulation, run down and up; plate's way, force on it, and frames of the ring."""
    points, cells = ring(options.round, options.across)
    radius = np.hypot(points[:, 0], points[:, 1] - OUTER)
    groups = {"outside": np.flatnonzero(radius > OUTER * (1 - 1e-9)), "inside": np.flatnonzero(radius < INNER * (1 + 1e-9))}
    rubber = cn.NeoHookean(young=YOUNG, poisson=POISSON)
    body = cn.SolidBody(points, cells, rubber, density=DENSITY, groups=groups, rayleigh=(0.0, 2e-4))
    plate = cn.Material("plate", density=7800.0)
    skin = cn.Material("skin", density=DENSITY)
    depth, half = 2 * OUTER * options.crush, options.seconds / 2

    def speed(t):  # starts and ends at rest, so that the ring is not struck
        return (0.0, -depth / half * np.pi / 2 * np.sin(np.pi * t / half), 0.0)

    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(body, skin, contact=["outside", "inside"], edges="inside", self_contact=True, name="ring"))
    scene.add(cn.wall((0, 0), (0, 1), plate), cn.wall((0, 2 * OUTER), (0, -1), plate, velocity=speed))
    scene.interact(skin, plate, cn.Coulomb(mu=options.mu))
    scene.interact(skin, skin, cn.GapCoulomb(mu=options.mu))
    sim = cn.Simulation(scene, dt=options.seconds / options.steps, strategy=cn.NSCD(theta=0.6, solver=cn.NLGS(tol=1e-6)))
    way, force, frames, worst, passes, own = [], [], [], [], [], []

    def watch(sim):
        worst.append(sim.info["error"])
        up = sim.contacts.point[:, 1] > OUTER * (1 - options.crush)
        way.append(2 * OUTER - sim.bodies.position[-1, 1])
        force.append(np.abs(sim.contacts.force[up, 1].sum()) if len(up) else 0.0)
        passes.append(sim.info["newton_passes"])
        inside = np.isin(sim.contacts.bodies, sim.meshes[0].ids).all(axis=1)
        pressed = inside & (sim.contacts.impulse_local[:, 0] > 0)
        own.append((pressed.sum(), max(0.0, -sim.contacts.gap[inside].min(initial=0.0)), sim.contacts.force[pressed, 1].sum()))
        if sim.steps in {1, options.steps // 4, options.steps // 2}:
            frames.append((sim.meshes[0].displacement.copy(), next(iter(sim.meshes[0].stress.values())).copy()))

    path = options.output / f"{NAME}.vtkhdf"
    sim.run(options.steps, output=path, every=max(1, options.steps // 40), callback=watch, overwrite=True)
    return sim, body, np.array(way), np.array(force), frames, max(worst), np.array(passes), np.array(own)


def stiffness(body):
    """Stiffness of the ring at rest under two opposite forces, at a displacement of 1e-3 of its width [N/m2]."""
    top, bottom = np.argmax(body.points[:, 1]), np.argmin(body.points[:, 1])
    body.groups |= {"highest": np.array([top]), "lowest": np.array([bottom])}
    push = np.zeros_like(body.points)
    push[top, 1] = -1.0
    way = -body.solve({"lowest": "xy", "highest": "x"}, push.ravel())[top, 1]
    push[top, 1] = -1e-3 * 2 * OUTER / way
    return push[top, 1] / body.solve({"lowest": "xy", "highest": "x"}, push.ravel())[top, 1]


def draw(body, way, force, thin, frames, output):
    """The ring at three instants, coloured by Mises' stress, and the force of the plate."""
    figure, axes = plt.subplots(1, 4, figsize=(13, 3.1), width_ratios=(1, 1, 1, 1.1), layout="constrained")
    outline = body.cells["quad8"][:, [0, 4, 1, 5, 2, 6, 3, 7]]
    mises = [np.sqrt(((s[:, 0] - s[:, 1]) ** 2 + (s[:, 1] - s[:, 2]) ** 2 + (s[:, 2] - s[:, 0]) ** 2) / 2 + 3 * s[:, 3] ** 2)
             for _, s in frames]  # fmt: skip
    top = max(m.max() for m in mises) / 1e6
    for axis, (u, _), m in zip(axes, frames, mises):
        cells = PolyCollection((body.points + u)[outline] * 1e3, array=m / 1e6, cmap="viridis", clim=(0, top))
        axis.add_collection(cells)
        axis.axhline(0, color="0.3")
        axis.set(xlim=(-80, 80), ylim=(-5, 105), aspect="equal", xlabel="x [mm]", ylabel="y [mm]" if axis is axes[0] else "")
    figure.colorbar(cells, ax=axes[:3], shrink=0.7, pad=0.01, label="Mises' stress [MPa]")
    axes[3].plot(way * 1e3, force, label="plate")
    soft = way < 0.2 * way.max()
    axes[3].plot(way[soft] * 1e3, thin * way[soft], "k--", label="thin ring, small strain")
    axes[3].set(xlabel="way of the plate [mm]", ylabel="force [N/m]")
    axes[3].legend()
    figure.savefig(output / f"{NAME}.png", dpi=110)
    plt.close(figure)


def main(arguments=None):
    """Runs, prints the figures, draws; returns the figures."""
    options = options_from(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    sim, body, way, force, frames, worst, passes, own = crushed(options)
    middle, thick = (OUTER + INNER) / 2, OUTER - INNER
    thin = YOUNG / (1 - POISSON**2) * thick**3 / 12 / middle**3 / (np.pi / 4 - 2 / np.pi)
    energy = sim.info["energy"]
    figures = {
        "steps": (options.steps, ""),
        "way of the plate": (1e3 * way.max(), "mm"),
        "largest force": (force.max(), "N/m"),
        "contacts of the ring with itself": (own[:, 0].max(), ""),
        "deepest overlap of these": (own[:, 1].max() / thick, "of the thickness"),
        "stiffness at the start": (stiffness(body) / thin, "of a thin ring's"),
        "passes of Newton's method, mean": (passes.mean(), ""),
        "error, worst": (worst, ""),
        "closure of the balance": (abs(energy["closure"]) / energy["in_play"], "of the energy in play"),
        "lost in friction": (energy["dissipated_friction"], "J/m"),
    }
    for name, (value, unit) in figures.items():
        print(f"{name:32s} {value:.4g} {unit}".rstrip())
    draw(body, way, force, thin, frames, options.output)
    return figures


if __name__ == "__main__":
    main()
