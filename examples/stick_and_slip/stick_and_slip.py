"""Two elastic blocks pressed together and dragged: where they stick and where they slip (Cattaneo 1938; Mindlin 1949).

A block with a slightly round foot stands on a flat one of the same material. It is pressed down by P (a metre across), then
dragged by Q < mu P. The pressure is Hertz's, over a half width b = sqrt(4 P R / (pi E*)). The rim of the contact slips at once,
since the pressure is nought there; the middle sticks over a half width

    c = b sqrt(1 - Q / (mu P)),

and the shear is mu p less a second profile of Hertz, of c in the place of b, which bears mu P - Q.

Run it:  python stick_and_slip.py              40 cells over b
         python stick_and_slip.py --full       80 cells over b
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cairn as cn
import matplotlib.pyplot as plt
import numpy as np

NAME = "stick_and_slip"
YOUNG, POISSON, RADIUS, HALF, MU = 200e9, 0.3, 0.1, 1e-3, 0.4  # HALF: the half width b that is aimed at [m]


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--cells", type=int, default=40, help="over the half width of the contact")
    parser.add_argument("--press", type=int, default=6, help="steps in which it is pressed")
    parser.add_argument("--drag", type=int, default=12, help="steps in which it is dragged")
    parser.add_argument("--share", type=float, default=0.6, help="of mu P that it is dragged by, about")
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--output", type=Path, default=Path("."))
    options = parser.parse_args(arguments)
    if options.full:
        options.cells = 80
    if not 0 < options.share < 0.95:
        raise ValueError(f"share is {options.share}: give a share of mu P between 0 and 0.95")
    return options


def graded(fine, uniform, end):
    """Places from 0 to end [m]: cells of a size over the first part, then each larger by 15 %."""
    places = list(np.arange(0, uniform + fine / 2, fine))
    size = fine
    while places[-1] < end:
        size *= 1.15
        places.append(places[-1] + size)
    return np.array(places)


def block(cells, foot):
    """Points, quadrilaterals and groups of a block above (foot) or below the line y = 0."""
    side = graded(HALF / cells, 1.5 * HALF, 9 * HALF)
    x, depth = np.r_[-side[:0:-1], side], graded(HALF / cells, 0.5 * HALF, 9 * HALF)
    nx, ny = len(x), len(depth)
    number = np.arange(nx * ny).reshape(nx, ny)
    places = np.stack(np.broadcast_arrays(x[:, None], depth[None] * (1 if foot else -1)), -1).reshape(-1, 2)
    if foot:  # round, and flat again above
        places[:, 1] += places[:, 0] ** 2 / (2 * RADIUS) * (1 - np.abs(places[:, 1]) / np.abs(places[:, 1]).max())
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], -1).reshape(-1, 4)
    groups = {"face": number[:, 0], "far": number[:, -1]}
    return places, {"quad": quads if foot else quads[:, [0, 3, 2, 1]]}, groups


def dragged(options):
    """The simulation at its end, and the largest error of the solver."""
    steel = cn.Material("steel", density=1.0)
    scene = cn.Scene(dim=2)
    dt, press, drag = 1.0, options.press, options.drag
    # ways of the far side of blocks nine half widths high, found by a first run
    down = 1.55 * HALF**2 / RADIUS / press
    along = options.share * MU * 2.6 * HALF**2 / RADIUS / drag

    def speed_down(t):
        return -down / dt if t <= press * dt * (1 + 1e-9) else 0.0

    def speed_along(t):
        return along / dt if t > press * dt * (1 + 1e-9) else 0.0

    bodies = []
    for foot in (False, True):
        points, cells, groups = block(options.cells, foot)
        bodies.append(cn.ElasticBody(points, cells, young=YOUNG, poisson=POISSON, density=1.0, groups=groups))
    scene.add(cn.deformable(bodies[0], steel, edges="face", fixed={"far": "xy"}, name="below"))
    drive = {"far": {"x": speed_along, "y": speed_down}}
    scene.add(cn.deformable(bodies[1], steel, contact="face", drive=drive, name="above"))
    scene.interact("above", "below edges", cn.Coulomb(mu=MU))
    # so slow that inertia counts for nothing: each step ends at rest
    sim = cn.Simulation(scene, dt=dt, strategy=cn.NSCD(theta=1.0, solver=cn.PPANewton(tol=1e-9)))
    errors = []
    probes = {"P": lambda s: -s.meshes[1].reaction("far")[1], "Q": lambda s: s.meshes[1].reaction("far")[0]}
    path = options.output / f"{NAME}.vtkhdf"
    sim.run(press + drag, output=path, every=1, probes=probes, callback=lambda s: errors.append(s.info["error"]),
            overwrite=True, progress=False)  # fmt: skip
    return sim, max(errors)


def tractions(sim):
    """Places of the nodes of the foot [m], pressure and shear on them [Pa]."""
    from cairn.model.mesh_measures import surface_vectors

    mesh = sim.meshes[1]
    nodes = mesh.body.groups["face"][1:-1]
    side = surface_vectors(mesh.body, mesh.displacement)[nodes]
    force, size = mesh.contact_force[nodes], np.linalg.norm(side, axis=1)
    normal = side / size[:, None]
    pressure = -np.einsum("nk,nk->n", force, normal) / size
    shear = (force[:, 0] * -normal[:, 1] + force[:, 1] * normal[:, 0]) / size
    return (mesh.body.points + mesh.displacement)[nodes, 0], pressure, shear


def half_widths(x, pressure, shear):
    """Half widths of the contact and of where it sticks [m]. The ends of the latter are between the last node whose shear is
    below mu p and the next, where the remainder of mu p would vanish."""
    touching = pressure > 1e-9 * pressure.max()
    share = np.where(touching, np.abs(shear) / np.where(touching, MU * pressure, 1.0), 1.0)
    middle = int(np.argmin(share))
    ends = []
    for way in (-1, 1):
        k = middle
        while share[k + way] < 1 - 1e-6:
            k += way
        # near its end the rest goes as the root of the distance: its square is straight
        rest, before = (1 - share[k]) ** 2, (1 - share[k - way]) ** 2
        ends.append(x[k] + (x[k] - x[k - way]) * min(1.0, rest / max(before - rest, 1e-300)))
    edge = x[touching]
    cell = np.diff(x).min()
    return (edge.max() - edge.min() + cell) / 2, (ends[1] - ends[0]) / 2


def draw(x, pressure, shear, wide, narrow, hertz, options):
    """Pressure and shear along the foot beside Hertz's and Cattaneo's."""
    figure, axis = plt.subplots(figsize=(7, 4), layout="constrained")
    fine = np.linspace(-1.3 * wide, 1.3 * wide, 400)
    ball = lambda b: np.sqrt(np.maximum(0, 1 - (fine / b) ** 2))  # noqa: E731
    axis.plot(fine * 1e3, hertz * ball(wide) / 1e6, "k", lw=0.8, label="Hertz")
    both = MU * hertz * (ball(wide) - narrow / wide * ball(narrow))
    axis.plot(fine * 1e3, both / 1e6, "k--", lw=0.8, label="Cattaneo and Mindlin")
    axis.plot(x * 1e3, pressure / 1e6, ".", label="pressure")
    axis.plot(x * 1e3, np.abs(shear) / 1e6, ".", label="shear")
    axis.set(xlabel="x [mm]", ylabel="[MPa]", xlim=(-1.3e3 * wide, 1.3e3 * wide))
    axis.legend(loc="upper right", fontsize=8)
    figure.savefig(options.output / f"{NAME}.png", dpi=110)
    plt.close(figure)


def main(arguments=None):
    """Runs, prints the figures, draws; returns the figures."""
    options = options_from(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    sim, worst = dragged(options)
    x, pressure, shear = tractions(sim)
    wide, narrow = half_widths(x, pressure, shear)
    q, p = (abs(v) for v in sim.meshes[1].reaction("far"))
    modulus = YOUNG / (2 * (1 - POISSON**2))
    hertz = np.sqrt(4 * p * RADIUS / (np.pi * modulus))
    sticks = hertz * np.sqrt(1 - q / (MU * p))
    terms = sim.info["energy"]
    figures = {
        "P": (p, "N/m"),
        "Q over mu P": (q / (MU * p), ""),
        "half width over Hertz's": (wide / hertz, ""),
        "largest pressure over Hertz's": (pressure.max() / (2 * p / (np.pi * hertz)), ""),
        "stick over contact": (narrow / wide, ""),
        "stick over Cattaneo's": (narrow / sticks, ""),
        "lost in friction": (terms["dissipated_friction"], "J/m"),
        "closure of the balance": (abs(terms["closure"]) / terms["in_play"], "of the energy in play"),
        "error, worst": (worst, ""),
    }
    for name, (value, unit) in figures.items():
        print(f"{name:32s} {value:.4g} {unit}".rstrip())
    draw(x, pressure, shear, hertz, sticks, 2 * p / (np.pi * hertz), options)
    return figures


if __name__ == "__main__":
    main()
