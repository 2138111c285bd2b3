"""A metal plate bent round a drum, and let go: it springs back, less than an elastic one would.

The plate (elastic and plastic, finite strains, plane strain) is clamped at one end beside the top of a rigid drum. The other
end is pulled down until the plate lies on the drum, then let go. Bent to a curvature k under a moment M(k), which follows from
the law across the thickness, a plate gives back M / (E' I), E' = E / (1 - nu^2), when it is let go (Hill 1950). The figures are
judged in the middle of what lay on the drum.

Run it:  python bent_plate.py              4 cells across the plate
         python bent_plate.py --full       6 cells across it
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cairn as cn
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection

NAME = "bent_plate"
DRUM, THICK, LENGTH, CLAMPED = 0.05, 2e-3, 0.08, 0.01
YOUNG, POISSON, YIELD, HARDENING = 70e9, 0.3, 250e6, 1e9


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--across", type=int, default=4, help="cells across the plate")
    # the free end snaps down as the plate yields: in fewer steps by more than a cell in one of them
    parser.add_argument("--steps", type=int, default=240, help="two thirds down, one third back")
    parser.add_argument("--force", type=float, default=14e3, help="on the free end [N/m]")
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--output", type=Path, default=Path("."))
    options = parser.parse_args(arguments)
    if options.full:
        options.across, options.steps = 6, 480
    if not options.force > 0:
        raise ValueError(f"force is {options.force}: give a force above 0 [N/m]")
    return options


def plate(across):
    """A body of quadrilaterals; its clamped part, free end, lower side and middle as groups."""
    along = int(round((LENGTH + CLAMPED) / THICK * across / 2.5))
    x, y = np.meshgrid(np.linspace(-CLAMPED, LENGTH, along + 1), DRUM + np.linspace(0, THICK, across + 1), indexing="ij")
    number = np.arange(x.size).reshape(x.shape)
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], -1).reshape(-1, 4)
    metal = cn.FiniteJ2(young=YOUNG, poisson=POISSON, yield_stress=YIELD, isotropic=HARDENING)
    points = np.c_[x.ravel(), y.ravel()]
    groups = {"clamped": np.flatnonzero(points[:, 0] < 1e-9), "end": number[-1]}
    groups |= {"below": number[:, 0], "middle": number[:, across // 2]}
    return cn.SolidBody(points, {"quad": quads}, metal, density=2700.0, groups=groups, mean_dilatation=True)


def bent(options):
    """The simulation at its end, displacements when the load is largest and at the end, largest error of the solver."""
    body, metal = plate(options.across), cn.Material("metal", density=2700.0)
    top = 2 * options.steps // 3

    def load(t):
        step = t * options.steps
        return {"end": (0.0, -options.force * max(0.0, min(step / top, (options.steps - step) / (options.steps - top))))}

    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(body, metal, contact="below", fixed={"clamped": "xy"}, force=load, name="plate"))
    scene.add(cn.disks([[0.0, 0.0]], DRUM, metal, driven=("vx", "vy", "w")))
    scene.interact(metal, metal, cn.Coulomb(mu=0.1))
    sim = cn.Simulation(scene, dt=1.0 / options.steps, strategy=cn.NSCD(theta=1.0, solver=cn.PPANewton(tol=1e-8)))
    frames, errors = [], []

    def watch(sim):
        errors.append(sim.info["error"])
        if sim.steps in (top, options.steps):
            mesh = sim.meshes[0]
            frames.append((mesh.displacement.copy(), mesh.material_state["quad"]["accumulated_plastic_strain"].copy()))

    sim.run(options.steps, output=options.output / f"{NAME}.vtkhdf", every=max(1, options.steps // 30), callback=watch,
            overwrite=True, progress=False)  # fmt: skip
    return sim, frames, max(errors)


def curvature(points):
    """Curvature of a circle through points, by least squares [1/m]."""
    a = np.c_[2 * points, np.ones(len(points))]
    x, y, c = np.linalg.lstsq(a, (points**2).sum(axis=1), rcond=None)[0]
    return 1 / np.sqrt(c + x * x + y * y)


def moment(k, layers=200):
    """Bending moment of a plate at a curvature [N m/m], by layers in plane strain without stress across the thickness."""
    height = (np.arange(layers) + 0.5) / layers * THICK / 2
    shear, bulk = YOUNG / (2 * (1 + POISSON)), YOUNG / (3 * (1 - 2 * POISSON))
    steps, total = 200, 0.0
    for y in height:
        plastic, accumulated = np.zeros(3), 0.0
        for i in range(1, steps + 1):
            x, across = k * y * i / steps, 0.0
            for _ in range(60):  # Newton's method on the strain across, by differences
                stress, new, sum_ = _returned(np.array([x, across, 0.0]), plastic, accumulated, shear, bulk)
                nudge = 1e-8
                by = (_returned(np.array([x, across + nudge, 0.0]), plastic, accumulated, shear, bulk)[0][1] - stress[1]) / nudge
                across -= stress[1] / by
                if abs(stress[1]) < 1e-9 * YIELD:
                    break
            plastic, accumulated = new, sum_
        total += 2 * stress[0] * y * THICK / 2 / layers
    return total


def _returned(strain, plastic, accumulated, shear, bulk):
    """Principal stresses of J2's law by radial return, plastic strains, their accumulated sum."""
    elastic = strain - plastic
    mean = elastic.sum() / 3
    away = 2 * shear * (elastic - mean)
    size = np.linalg.norm(away)
    beyond = size - np.sqrt(2 / 3) * (YIELD + HARDENING * accumulated)
    if beyond > 0:
        flow = beyond / (2 * shear + 2 / 3 * HARDENING)
        plastic, accumulated = plastic + flow * away / size, accumulated + np.sqrt(2 / 3) * flow
        away = away * (1 - 2 * shear * flow / size)
    return away + 3 * bulk * mean, plastic, accumulated


def draw(body, frames, options):
    """The plate under its load and let go, coloured by plastic strain, and the drum."""
    figure, axes = plt.subplots(1, 2, figsize=(10, 4.4), layout="constrained")
    top = max(strain.max() for _, strain in frames)
    for axis, (u, strain), title in zip(axes, frames, ("under its load", "let go")):
        axis.add_patch(plt.Circle((0, 0), 1e3 * DRUM, color="0.85"))
        drawn = PolyCollection((body.points + u)[body.cells["quad"]] * 1e3, array=strain, cmap="viridis", clim=(0, top))
        axis.add_collection(drawn)
        axis.set(xlim=(-14, 80), ylim=(-5, 60), aspect="equal", xlabel="mm", title=title)
    figure.colorbar(drawn, ax=axes, label="accumulated plastic strain", shrink=0.7)
    figure.savefig(options.output / f"{NAME}.png", dpi=110)
    plt.close(figure)


def main(arguments=None):
    """Runs, prints the figures, draws; returns the figures."""
    options = options_from(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    sim, frames, worst = bent(options)
    body = sim.meshes[0].body
    middle = body.groups["middle"]
    inside = middle[(body.points[middle, 0] > 0.2 * DRUM) & (body.points[middle, 0] < 0.5 * DRUM)]
    under, free = (curvature((body.points + u)[inside]) for u, _ in frames)
    modulus = YOUNG / (1 - POISSON**2)
    back = moment(under) / (modulus * THICK**3 / 12)
    terms = sim.info["energy"]
    figures = {
        "radius of its middle on the drum": (1e3 / under, "mm"),
        "radius let go": (1e3 / free, "mm"),
        "curvature given back": (under - free, "1/m"),
        "over that of plastic bending": ((under - free) / back, ""),
        "largest plastic strain": (frames[-1][1].max(), ""),
        "dissipated by the material": (terms["dissipated_material"], "J/m"),
        "closure of the balance": (abs(terms["closure"]) / terms["in_play"], "of the energy in play"),
        "error, worst": (worst, ""),
    }
    for name, (value, unit) in figures.items():
        print(f"{name:34s} {value:.4g} {unit}".rstrip())
    draw(body, frames, options)
    return figures


if __name__ == "__main__":
    main()
