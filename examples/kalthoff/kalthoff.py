"""A notched steel plate struck on its edge: a crack leaves the notch some 70 degrees aside (Kalthoff & Winkler 1988).

The upper half of the plate (100 mm by 100 mm, a notch of 50 mm at 25 mm above the line of symmetry) is cut into crossed
triangles, each a body of its own, joined to its neighbours on both points of every side by a cohesive zone. The edge below the
notch is struck at 16.5 m/s. Waves reach the end of the notch after 8.8 microseconds; loaded in shear, it cracks where the
hoop stress is largest, 53 to 70.5 degrees from its line (Erdogan & Sih 1963); in experiments, 70 degrees. Strength and work of
the zone are of maraging steel (Song, Areias & Belytschko 2006).

Where several sides soften together, sweeps with whole changes go round between two states, held or broken: sides that soften take
half of their change (softening_relaxation). Of 40 x 40 squares every step then meets its tolerance, on the turned mesh most do.

Run it:  python kalthoff.py                     40 x 40 squares of four triangles
         python kalthoff.py --full              100 x 100, to 80 microseconds
         python kalthoff.py --cells 60          another mesh
         python kalthoff.py --turn 20           the mesh turned by 20 degrees about the end of the notch
         python kalthoff.py --speed 39          struck harder
         python kalthoff.py --speed 39 --ductile  one mesh of steel that yields and softens, and no zone
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cairn as cn
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection, PolyCollection

NAME = "kalthoff"
SIDE, NOTCH, LEVEL = 0.1, 0.05, 0.025
YOUNG, POISSON, DENSITY = 190e9, 0.3, 8000.0
STRENGTH, WORK = 844e6, 22.13e3
STEP = 0.15e-6  # largest step [s]; in longer ones sides soften so fast that a step of a coarse mesh has several solutions
SHEAR = YOUNG / (2 * (1 + POISSON))
YIELD, SOFTENING = 2e9, 2e9  # of the ductile plate; chosen by us
LONGITUDINAL = np.sqrt(YOUNG * (1 - POISSON) / ((1 + POISSON) * (1 - 2 * POISSON)) / DENSITY)
RAYLEIGH = np.sqrt(SHEAR / DENSITY) * (0.862 + 1.14 * POISSON) / (1 + POISSON)


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--cells", type=int, default=40, help="squares on a side, a multiple of 4")
    parser.add_argument("--turn", type=float, default=0.0, help="of the mesh [degrees]")
    parser.add_argument("--speed", type=float, default=16.5, help="of the struck edge [m/s]")
    parser.add_argument("--time", type=float, help="[microseconds], 45 or, with --ductile, 60 when not given")
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--ductile", action="store_true", help="no zones: steel that yields at 2 GPa and softens")
    parser.add_argument("--output", type=Path, default=Path("."))
    options = parser.parse_args(arguments)
    if options.full:
        options.cells, options.time = 100, 80.0
    elif options.time is None:
        options.time = 60.0 if options.ductile else 45.0
    if options.cells < 4 or options.cells % 4:
        raise ValueError(f"cells is {options.cells}: give a multiple of 4, so that the notch lies along sides")
    return options


def crossed(cells):
    """Points and triangles of squares cut by both diagonals."""
    size = SIDE / cells
    x = np.arange(cells + 1) * size
    corners = np.stack(np.meshgrid(x, x, indexing="ij"), -1).reshape(-1, 2)
    middles = np.stack(np.meshgrid(x[:-1] + size / 2, x[:-1] + size / 2, indexing="ij"), -1).reshape(-1, 2)
    i, j = (v.ravel() for v in np.meshgrid(np.arange(cells), np.arange(cells), indexing="ij"))
    ring = [i * (cells + 1) + j, (i + 1) * (cells + 1) + j, (i + 1) * (cells + 1) + j + 1, i * (cells + 1) + j + 1]
    middle = len(corners) + np.arange(cells * cells)
    return np.concatenate([corners, middles]), np.concatenate(
        [np.stack([ring[k], ring[(k + 1) % 4], middle], 1) for k in range(4)]
    )


def turned(cells, angle):
    """The same lattice of points turned about the end of the notch, triangulated with points on the border and the notch."""
    from scipy.spatial import Delaunay

    size = SIDE / cells
    along = np.arange(cells + 1) * size
    zero, one = np.zeros_like(along), np.full_like(along, SIDE)
    on_notch = np.column_stack([along[along < NOTCH + size / 2], np.full((along < NOTCH + size / 2).sum(), LEVEL)])
    border = np.concatenate([np.column_stack(c) for c in ((along, zero), (along, one), (zero, along), (one, along))])
    fixed = np.unique(np.round(np.concatenate([border, on_notch]) / size * 64) * size / 64, axis=0)
    k = np.arange(-3 * cells, 3 * cells + 1) * size
    lattice = np.stack(np.meshgrid(k, k, indexing="ij"), -1).reshape(-1, 2)
    lattice = np.concatenate([lattice, lattice + size / 2])
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    lattice = lattice @ np.array([[c, s], [-s, c]]) + (NOTCH, LEVEL)
    clear = 0.45 * size
    inside = (lattice > clear).all(1) & (lattice < SIDE - clear).all(1)
    inside &= ~((np.abs(lattice[:, 1] - LEVEL) < clear) & (lattice[:, 0] < NOTCH + clear))
    points = np.concatenate([fixed, lattice[inside]])
    triangles = Delaunay(points).simplices
    a, b, d = (points[triangles[:, k]] for k in range(3))
    area = 0.5 * ((b - a)[:, 0] * (d - a)[:, 1] - (b - a)[:, 1] * (d - a)[:, 0])
    triangles[area < 0] = triangles[area < 0][:, ::-1]
    return points, triangles[np.abs(area) > 1e-3 * size * size]


def plate(options):
    """The plate as a body: the points of the notch stand twice, once for each of its sides."""
    points, triangles, groups = notched(options)
    return cn.ElasticBody(points, {"triangle": triangles}, young=YOUNG, poisson=POISSON, density=DENSITY, groups=groups)


def notched(options):
    """Points, triangles and groups of the plate."""
    points, triangles = crossed(options.cells) if options.turn == 0 else turned(options.cells, options.turn)
    size = SIDE / options.cells
    line = np.flatnonzero((np.abs(points[:, 1] - LEVEL) < 1e-6 * size) & (points[:, 0] < NOTCH - 1e-6 * size))
    below = points[triangles].mean(axis=1)[:, 1] < LEVEL
    twin = np.arange(len(points))
    twin[line] = len(points) + np.arange(len(line))
    triangles[below] = twin[triangles[below]]
    points = np.concatenate([points, points[line]])
    used = np.unique(triangles)
    points, triangles = points[used], np.searchsorted(used, triangles)
    lower = np.zeros(len(points), bool)
    lower[triangles[points[triangles].mean(axis=1)[:, 1] < LEVEL].ravel()] = True
    groups = {
        "struck": np.flatnonzero((points[:, 0] < 1e-6 * size) & lower & (points[:, 1] < LEVEL + 1e-6 * size)),
        "symmetry": np.flatnonzero(points[:, 1] < 1e-6 * size),
    }
    return points, triangles, groups


def sheared(options):
    """The plate as one mesh that yields and softens in place of cracking: prints and draws where it does; returns the figures."""
    points, triangles, groups = notched(options)
    steel = cn.J2Plasticity(young=YOUNG, poisson=POISSON, yield_stress=YIELD, isotropic=-SOFTENING)
    body = cn.SolidBody(points, {"triangle": triangles}, steel, density=DENSITY, groups=groups)
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(body, cn.Material("steel", density=DENSITY), fixed={"symmetry": "y"},
                            drive={"struck": {"x": options.speed}}, name="plate"))  # fmt: skip
    size = SIDE / options.cells
    dt = 0.5 * size / LONGITUDINAL
    sim = cn.Simulation(scene, dt=dt, strategy=cn.NSCD(theta=0.52))
    steps, held = int(np.ceil(options.time * 1e-6 / dt)), []
    sim.run(steps, output=options.output / f"{NAME}_ductile.vtkhdf", every=max(1, steps // 20), overwrite=True,
            callback=lambda s: held.append(s.info["status"] == "converged"), progress=False)  # fmt: skip
    strain = sim.meshes[0].material_state["triangle"]["accumulated_plastic_strain"]
    band = ahead_of(strain, points[triangles].mean(axis=1) - (NOTCH, LEVEL), size)
    line = np.linalg.svd(band)[2][0] if len(band) > 1 else np.full(2, np.nan)
    terms = sim.info["energy"]
    figures = {
        "triangles": (len(triangles), ""),
        "steps": (sim.steps, ""),
        "steps not converged": (held.count(False), ""),
        "angle of the band ahead": (np.degrees(np.arctan(line[1] / line[0])), "degrees"),
        "length of the band": (1e3 * np.linalg.norm(band, axis=1).max() if len(band) else 0.0, "mm"),
        "triangles beyond a plastic strain of 0.001": (int((strain > 1e-3).sum()), ""),
        "largest plastic strain": (strain.max(), ""),
        "work of the blow": (terms["work_driven"], "J/m"),
        "closure of the balance": (abs(terms["closure"]) / terms["in_play"], "of the energy in play"),
    }
    for name, (value, unit) in figures.items():
        print(f"{name:42s} {value:.4g} {unit}".rstrip())
    figure, axis = plt.subplots(figsize=(6.4, 5.4), layout="constrained")
    shape = 1e3 * (points + sim.meshes[0].displacement)[triangles]
    drawn = axis.add_collection(PolyCollection(list(shape), array=strain, cmap="magma_r", edgecolors="face", linewidths=0.2))
    drawn.set_clim(0, 0.05)
    axis.plot([0, 1e3 * NOTCH], [1e3 * LEVEL] * 2, "k", lw=1.2)
    axis.set(xlim=(-1, 104), ylim=(-1, 103), aspect="equal", xlabel="mm", title=f"after {1e6 * sim.time:.0f} microseconds")
    figure.colorbar(drawn, label="plastic strain", shrink=0.8, extend="max")
    figure.savefig(options.output / f"{NAME}_ductile.png", dpi=110)
    plt.close(figure)
    return figures


def ahead_of(strain, away, size):
    """Place of largest plastic strain ahead of the notch in each ring round its end, two cells wide, if any yielded."""
    distance = np.linalg.norm(away, axis=1)
    out = []
    for begin in 2 * size * np.arange(1, int(0.4 * SIDE / (2 * size))):
        ring = np.flatnonzero((distance >= begin) & (distance < begin + 2 * size) & (away[:, 0] > 0) & (strain > 1e-3))
        if not len(ring):
            break
        out.append(away[ring[np.argmax(strain[ring])]])
    return np.array(out).reshape(-1, 2)


def cracked(options):
    """The simulation at its end, its pieces, joints and the reports of its steps."""
    body, steel = plate(options), cn.Material("steel", density=DENSITY)
    size = SIDE / options.cells
    stiff = max(50 * YOUNG / size, 1e16)  # [Pa/m]; waves are slower by a hundredth at most
    law = cn.MAL(normal_stiffness=stiff, tangential_stiffness=stiff, mu=0.0, normal_strength=STRENGTH,
                 tangential_strength=np.sqrt(2 * np.e) * STRENGTH, normal_work=WORK, tangential_work=WORK)  # fmt: skip
    pieces = cn.fracture.split(body, law, steel, fixed={"symmetry": "y"}, drive={"struck": {"x": options.speed}})
    scene = cn.Scene(dim=2)
    pieces.add_to(scene)
    dt = min(0.5 * size / LONGITUDINAL, STEP)
    sim = cn.Simulation(scene, dt=dt, strategy=cn.NSCD(theta=0.52, solver=cn.NLGS(tol=1e-4, softening_relaxation=0.5)))
    joints, sound = None, -1
    errors = []

    def watch(sim):
        nonlocal joints, sound
        errors.append(sim.report["error"])
        beta = sim.contacts.beta
        before, sound = sound, int(np.count_nonzero(beta > 0))
        if sound == before:  # no new break, and broken joints stay broken
            return
        point, side = sim.contacts.key[:, 0], sim.contacts.key[:, 1]
        key = point.astype(np.int64) << 32 | side
        if joints is None:
            whole = np.flatnonzero(beta > 0)  # other contacts are no joints
            order = whole[np.lexsort((point[whole], side[whole]))]
            first, count = np.unique(side[order], return_index=True, return_counts=True)[1:]
            joints = {"key": key[order], "point": sim.contacts.point[order, :2].copy(), "at": np.full(len(order), np.inf),
                      "pairs": first[count == 2][:, None] + [0, 1]}  # fmt: skip
        held = np.isin(joints["key"], key[beta > 0])
        joints["at"][np.isinf(joints["at"]) & ~held] = sim.time

    steps = int(np.ceil(options.time * 1e-6 / dt))
    sim.run(steps, output=options.output / f"{NAME}.vtkhdf", every=max(1, steps // 20), callback=watch, overwrite=True,
            progress=options.full)  # fmt: skip
    return sim, body, pieces, joints, np.array(errors)


def measured(joints, size):
    """Onset [s], angle from the line of the notch [degrees] and mean speed [m/s] of the crack that leaves the notch."""
    away = joints["point"] - (NOTCH, LEVEL)
    broken = np.isfinite(joints["at"]) & (away[:, 1] > 0) & (away[:, 0] > -2 * size) & (away[:, 0] < 0.035)
    if broken.sum() < 4:
        return np.nan, np.nan, np.nan
    points, times = away[broken], joints["at"][broken]
    direction = np.linalg.svd(points)[2][0]  # of a line through the end of the notch
    direction = direction * np.sign(direction[1])
    order = np.argsort(times)
    front = np.maximum.accumulate((points @ direction)[order])
    speed = np.polyfit(times[order], front, 1)[0]
    return times.min(), np.degrees(np.arctan2(direction[1], direction[0])), speed


def draw(sim, body, pieces, joints, angle, options):
    """The plate, coloured by its speed, and the sides that broke."""
    triangles = body.cells["triangle"]
    shape = np.empty((len(triangles), 3, 2))
    speed = np.empty(len(triangles))
    for mesh, (_, number) in zip(sim.meshes, pieces.cell):
        shape[number] = body.points[triangles[number]] + mesh.displacement
        speed[number] = np.linalg.norm(mesh.velocity, axis=1).mean()
    figure, axis = plt.subplots(figsize=(6.4, 5.4), layout="constrained")
    drawn = PolyCollection(list(1e3 * shape), array=speed, cmap="viridis", edgecolors="face", linewidths=0.2)
    axis.add_collection(drawn)
    pairs = joints["point"][joints["pairs"]]  # both points of a side
    middle, half = pairs.mean(axis=1), (pairs[:, 1] - pairs[:, 0]) * np.sqrt(3) / 2
    broken = np.isfinite(joints["at"])[joints["pairs"]].all(axis=1)
    axis.add_collection(LineCollection(1e3 * np.stack([middle - half, middle + half], 1)[broken], colors="red", linewidths=1.6))
    axis.plot([0, 1e3 * NOTCH], [1e3 * LEVEL] * 2, "k", lw=1.2)
    if np.isfinite(angle):
        way = 0.06 * np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
        axis.plot([1e3 * NOTCH, 1e3 * (NOTCH + way[0])], [1e3 * LEVEL, 1e3 * (LEVEL + way[1])], "w--", lw=1,
                  label=f"{angle:.0f} degrees")  # fmt: skip
        axis.legend(loc="upper left")
    axis.set(xlim=(-1, 104), ylim=(-1, 103), aspect="equal", xlabel="mm", title=f"after {1e6 * sim.time:.0f} microseconds")
    figure.colorbar(drawn, label="speed [m/s]", shrink=0.8)
    figure.savefig(options.output / f"{NAME}.png", dpi=110)
    plt.close(figure)


def main(arguments=None):
    """Runs, prints the figures, draws; returns the figures."""
    options = options_from(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    if options.ductile:
        return sheared(options)
    sim, body, pieces, joints, errors = cracked(options)
    onset, angle, speed = measured(joints, SIDE / options.cells)
    terms = sim.info["energy"]
    figures = {
        "bodies": (len(pieces.cell), ""),
        "steps": (sim.steps, ""),
        "first side broken after": (1e6 * onset, "microseconds"),
        "angle of the crack": (angle, "degrees"),
        "speed of the crack": (speed, "m/s"),
        "over Rayleigh's": (speed / RAYLEIGH, ""),
        "sides broken": (int(np.isfinite(joints["at"])[joints["pairs"]].all(axis=1).sum()), ""),
        "work of the blow": (terms["work_driven"], "J/m"),
        "spent by cracks": (terms["released"], "J/m"),
        "closure of the balance": (abs(terms["closure"]) / terms["in_play"], "of the energy in play"),
        "steps beyond 1e-4": (int((errors > 1e-4).sum()), ""),
        "error, median": (np.median(errors), ""),
        "error, worst": (errors.max(), ""),
    }
    for name, (value, unit) in figures.items():
        print(f"{name:32s} {value:.4g} {unit}".rstrip())
    draw(sim, body, pieces, joints, angle, options)
    return figures


if __name__ == "__main__":
    main()
