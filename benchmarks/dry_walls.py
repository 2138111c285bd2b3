"""Dry walls tilted out of their plane: the slope at which a facade between two side walls falls, by limit analysis and in motion.

    python benchmarks/dry_walls.py [--walls N...] [--picture FILE]      all 42 take about 15 minutes of one core

Writes benchmarks/results/dry_walls.csv. The walls are of the kind that Restrepo Velez, Magenes & Griffith (2014) tilted, a fifth
of nature's size: marble, laid dry, of several lengths and heights, with tied, loosely tied and untied corners, openings, and
a load on top. Their measured slopes are not in here: the judge is the linear programme of cairn.post.limit_analysis. Its sliding
dilates, so that it is an upper bound where blocks rub (Drucker 1954).
"""

import argparse
import csv
import itertools
import time
from pathlib import Path

import cairn as cn
import numpy as np
from cairn.post import limit_analysis
from cairn.post.masonry import Structure, tilted_gravity
from cairn.pre import masonry

G, MU, DENSITY = 9.81, 0.7, 2700.0
BRICK = (0.08, 0.04, 0.03)
L, W, H = BRICK
DT = 2e-3
FALLING = 1e-3 * G * DT  # speed [m/s]


def walls():
    """The cases: length and side [bricks], courses, tie, opening, load on top [of the weight of the top course]."""
    for length, courses, tie in itertools.product((5, 8), (8, 12, 16), (2, 4, 0)):
        yield length, 3.0, courses, tie, "none", 0.0
    for side, tie in itertools.product((1.0, 1.5, 2.0, 4.0), (2, 0)):
        yield 6, side, 12, tie, "none", 0.0
    for opening, tie in itertools.product(("window", "door", "windows"), (2, 4, 0)):
        yield 7, 3.0, 12, tie, opening, 0.0
    for load, tie in itertools.product((2.0, 6.0), (2, 4, 0)):
        yield 6, 3.0, 12, tie, "none", load
    yield 6, 3.0, 12, 2, "window", 4.0


def openings(name, length, courses):
    """Holes of the facade, on courses and half bricks."""
    middle, top = round(length) * W, (courses - 3) * H
    if name == "window":
        return [(middle - L, 4 * H, middle + L, top)]
    if name == "door":
        return [(middle - L, 0.0, middle + L, top)]
    if name == "windows":
        return [(L, 4 * H, 2.5 * L, top), ((length - 2.5) * L, 4 * H, (length - 1) * L, top)]
    return []


def blocks_of(case):
    """Blocks, and their weights with the load on them (n,) [N]."""
    length, side, courses, tie, opening, load = case
    b = masonry.facade(length * L, side * L, courses, BRICK, tie=tie, openings=openings(opening, length, courses))
    mass = DENSITY * b.properties().measure
    top = b.mask("facade", "lintel") & (np.array([v[:, 2].max() for v in b.vertices]) > (courses - 0.5) * H)
    return b, G * mass * (1 + load * top), G * mass * load * top


def by_limit_analysis(b, weight):
    a = limit_analysis.Assembly(b, MU, density=DENSITY)
    live = np.zeros((len(b), 3))
    live[:, 2] = -weight
    a.load = a.loads(live)
    tilt = np.zeros_like(live)
    tilt[:, 1] = -weight
    return a.collapse(tilt).multiplier


def by_overturning(b, weight):
    """Slope at which the facade alone turns about its foot: what untied corners leave, since nothing presses them together."""
    front = b.mask("facade", "lintel")
    return weight[front].sum() * W / 2 / (weight[front] @ b.properties().center[front, 2])


def structure(b, load, down, tol=1e-7):
    """The wall under gravity `down`, a function of time, with the load on top, which gravity moves too."""
    scene = cn.Scene(3, gravity=down)
    made, rows = b.sets(cn.Material("stone", density=DENSITY))
    mass = np.empty(len(b))
    mass[rows] = load / G  # in the order of the sets
    parts = np.split(mass[:, None], np.cumsum([len(s) for s in made])[:-1])
    made = [s.with_(force=lambda t, m=m: m * down(t)) if m.any() else s for s, m in zip(made, parts)]
    ids = scene.add(*made)[rows]
    scene.interact("*", "*", cn.Coulomb(mu=MU))
    strategy = cn.NSCD(theta=1.0, solver=cn.Auto(tol=tol, max_iter=20_000), threads=1)
    return Structure(b, cn.Simulation(scene, DT, strategy), ids)


def tilted_slowly(b, load, limit):
    """Slope at which the wall falls on a table that tilts by 1/400 of the limit a step, steps, those not converged.

    Forces follow from step to step, as on the table; a wall put on a tilted one at once may find others, and fall earlier.
    """
    s = structure(b, load, lambda t: tilted_gravity(np.arctan(limit * (0.5 + t / DT / 400)), 3, (0, -1, 0)))
    failed = 0
    while not s.simulation.steps or s.balance()["speed"] < FALLING:
        failed += s.simulation.step()["status"] != "converged"
        if s.simulation.steps > 400:
            raise RuntimeError("the wall still stands at 1.5 of limit analysis' slope")
    return limit * (0.5 + s.simulation.steps / 400), s.simulation.steps, failed


def draw(path, shown=((26, 0.39), (27, 0.33))):
    """Walls as they fall on a table of these slopes."""
    import pyvista

    plotter = pyvista.Plotter(off_screen=True, shape=(1, 2), window_size=(1500, 620))
    bar = {"position_x": 0.47, "position_y": 0.02, "width": 0.5, "height": 0.09, "color": "black"}
    for column, (k, slope) in enumerate(shown):
        b, _, load = blocks_of(list(walls())[k])
        s = structure(b, load, lambda t, slope=slope: tilted_gravity(np.arctan(slope), 3, (0, -1, 0)), tol=1e-4)
        for _ in range(150):
            s.simulation.step()
        plotter.subplot(0, column)
        for block, (vertices, faces, gone) in enumerate(zip(b.vertices, b.faces, s.displacement() * 1e3)):
            moved = s.moved(np.asarray(vertices), np.full(len(vertices), block))
            surface = pyvista.PolyData(moved, np.concatenate([[len(f), *f] for f in faces]))
            surface.cell_data["displacement [mm]"] = np.full(surface.n_cells, gone)
            plotter.add_mesh(
                surface, clim=(0, 25), cmap="YlOrRd", show_edges=True, show_scalar_bar=column == 1, scalar_bar_args=bar
            )
        plotter.add_text(f"{'corners loosely tied' if column else 'corners tied'}, slope {slope:g}", font_size=12, color="black")
        plotter.camera_position = [(-0.35, -1.0, 0.55), (0.28, 0.06, 0.14), (0, 0, 1)]
    plotter.screenshot(path)


def row_of(case):
    b, weight, load = blocks_of(case)
    begin = time.process_time()
    limit = by_limit_analysis(b, weight)
    programmed = time.process_time()
    slope, steps, failed = tilted_slowly(b, load, limit)
    names = ("length", "side", "courses", "tie", "opening", "load")
    return dict(zip(names, case)) | {
        "blocks": len(b), "overturning": "" if case[3] else f"{by_overturning(b, weight):.4f}",
        "limit_analysis": f"{limit:.4f}", "simulation": f"{slope:.4f}", "ratio": f"{slope / limit:.3f}",
        "steps": steps, "not_converged": failed,
        "programme_cpu_s": f"{programmed - begin:.2f}", "simulation_cpu_s": f"{time.process_time() - programmed:.1f}",
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--walls", type=int, nargs="+", metavar="N", help="these alone, from 0; nothing is written")
    parser.add_argument("--picture", metavar="FILE", help="draw two of them as they fall; nothing is written")
    options = parser.parse_args()
    if options.picture:
        return draw(options.picture)
    cases, rows = list(walls()), []
    for k in options.walls or range(len(cases)):
        rows.append(row_of(cases[k]))
        print(k, *rows[-1].values(), flush=True)
    if options.walls:
        return
    path = Path(__file__).resolve().parent / "results" / "dry_walls.csv"
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
