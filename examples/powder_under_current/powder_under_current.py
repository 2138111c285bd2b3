"""Current through a powder of oxidised spheres: its resistance falls as the current rises, and does not come back (Branly 1890).

Steel spheres of 2 mm, give or take 0.2, are poured into a cylinder and pressed between two plates. A current goes from the
lower plate to the upper one, up to 0.2 A for the bed of 90 mm (less for a smaller one, by area) and back, twice. Every new
contact carries a film of oxide in series with the constriction of its spot. Where a film dissipates more than it can bear it
breaks down, its neighbours carry more, and paths of clean contacts grow from plate to plate. The first cycle has a large
hysteresis; the second, below the same maximum, has hardly any (Renouf & Fillot 2008; Dubois & Renouf 2007, 5.4).

Conductance of the film, its power and the pressure are chosen here: the paper does not tell them. The comparison is one of
shapes: the drop of resistance, the loop, the broad distribution of currents.

Run it:  python powder_under_current.py            1,500 spheres, under a minute
         python powder_under_current.py --full     15,000 spheres in a cylinder of 90 mm
         python powder_under_current.py --help
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import cairn as cn
import numpy as np
from cairn.post import plots

NAME = "powder_under_current"
RADIUS, SPREAD = 1e-3, 0.1  # mean [m], share of it
FULL, FULL_DIAMETER, FULL_CURRENT = 15000, 0.09, 0.2  # spheres, [m], [A]
PRESSURE = 2e4  # on the upper plate [Pa]
FILM = 1e-3  # conductance of a film [S]
POWER = 4e-5  # at which a film breaks down [W]
COHESION, REACH = 1e-2, 2e-5  # force between spheres, up to a gap [N], [m]: some thirty times the weight of one
STEEL = cn.Material("steel", density=7800.0, young=210e9, poisson=0.3, resistivity=1 / 5.9e6)
GLASS = cn.Material("glass", young=70e9, poisson=0.2, resistivity=np.inf)


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--spheres", type=int, default=1500)
    parser.add_argument("--full", action="store_true", help="15,000 spheres in a cylinder of 90 mm")
    parser.add_argument("--currents", type=int, default=50, help="values of the current on each way, up or down (50)")
    parser.add_argument("--power", type=float, default=POWER, help="at which a film breaks down [W] (4e-5)")
    parser.add_argument("--cohesion", type=float, default=COHESION, help="force between spheres [N] (1e-2)")
    parser.add_argument("--tol", type=float, default=1e-12, help="of the network (1e-12)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--output", type=Path, default=Path("."))
    options = parser.parse_args(arguments)
    options.spheres = FULL if options.full else options.spheres
    return options


def poured(options):
    """Centres (n, 3) and radii of spheres in a cylinder about z, cut from a packing in a box, and its diameter [m]."""
    diameter = FULL_DIAMETER * np.sqrt(options.spheres / FULL)
    count = int(1.5 * options.spheres)
    radii = cn.pre.grains.uniform(count, RADIUS * (1 - SPREAD), RADIUS * (1 + SPREAD), rng=options.seed)
    centers = cn.pre.deposit_spheres(radii, (diameter, diameter)) - (diameter / 2, diameter / 2, 0.0)
    inside = np.hypot(centers[:, 0], centers[:, 1]) + radii < diameter / 2
    kept = np.flatnonzero(inside)[np.argsort(centers[inside, 2])][: options.spheres]
    return centers[kept], radii[kept], diameter


def build(options, current=None, film=True):
    """The simulation, and the largest current [A]. current: a function of time [A]."""
    centers, radii, diameter = poured(options)
    area = np.pi * diameter**2 / 4
    top = float(np.max(centers[:, 2] + radii))
    scene = cn.Scene(dim=3, gravity=(0.0, 0.0, -9.81))
    scene.add(cn.spheres(centers, radii, STEEL, group="powder"))
    scene.add(cn.tube((0, 0, 0), (0, 0, 1), diameter / 2, GLASS, group="cylinder"))
    scene.add(cn.wall((0, 0, 0), (0, 0, 1), STEEL, group="lower plate"))
    lid = cn.wall((0, 0, top), (0, 0, -1), STEEL, mass=0.2 * len(radii) * 4 / 3 * np.pi * RADIUS**3 * 7800, free="vz",
                  force=(0, 0, -PRESSURE * area), group="upper plate")  # fmt: skip
    scene.add(lid)
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    scene.interact("powder", "powder", cn.Wet(force=options.cohesion, reach=REACH, mu=0.3))
    if current is not None:
        scene.electrical(
            conductance=cn.networks.Holm(),
            tol=options.tol,
            film=cn.networks.OxideFilm(conductance=FILM, power=options.power) if film else None,
            current={"lower plate": current, "upper plate": lambda t: -current(t)},
        )
    strategy = cn.NSCD(solver=cn.NLGS(tol=1e-4, max_iter=500), threads=options.threads)
    return cn.Simulation(scene, 1e-4, strategy, overlap="ignore"), FULL_CURRENT * options.spheres / FULL


def compact(options, path):
    """Presses the bed until it rests, and keeps it in a checkpoint; the height of the upper plate [m], steps, how they went."""
    simulation, _ = build(options)
    error, met = 0.0, 0
    while simulation.steps < 600:
        report = simulation.step()
        error, met = max(error, report["error"]), met + (report["status"] == "converged")
        speed = np.abs(simulation.bodies.velocity[:, :3]).max()
        if simulation.steps > 100 and speed < 2e-3:
            break
    simulation.checkpoint(path)
    balance = simulation.info["energy"]
    closure = abs(balance["closure"]) / balance["in_play"]
    return float(simulation.bodies.position[-1, 2]), simulation.steps, {"error": error, "met": met, "closure": closure}


def cycle(options, checkpoint, film):
    """Two cycles of current: (time, current, potential between the plates, broken films), solutions made, the simulation."""
    peak = FULL_CURRENT * options.spheres / FULL
    n, dt = options.currents, 1e-5
    ramp = np.concatenate([np.arange(1, n + 1), np.arange(n - 1, 0, -1)] * 2) / n * peak
    begin = {}

    def current(t):
        return float(np.interp(t - begin.get("time", 0.0), dt * np.arange(1, len(ramp) + 1), ramp))

    simulation, _ = build(options, current, film)
    simulation.restore(checkpoint)
    begin["time"] = simulation.time
    simulation.dt = dt
    rows, work = [], {"factorisations": 0, "iterations": 0, "rounds": 0, "met": 0, "solved": 0, "residual": 0.0, "joule": 0.0}
    for value in ramp:
        step = simulation.step()
        report = step["electrical"]
        work["met"] += step["status"] == "converged"
        work["solved"] += report["status"] == "converged"
        work["residual"] = max(work["residual"], report["residual"])
        balance = report["balance"]
        work["joule"] = balance["closure"] / balance["in_play"]
        potential = simulation.bodies.potential
        rows.append((value, potential[-2] - potential[-1], report.get("broken", 0), report["closure"]))
        for name in ("factorisations", "iterations", "rounds"):
            work[name] += report[name]
    return np.array(rows), work, simulation


def draw(loops, simulation, peak, folder):
    """Resistance against current with and without films; potentials of the spheres; currents of contacts; clean paths."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 2, figsize=(11.0, 8.0), layout="constrained")
    axes = axes.ravel()
    for name, rows in loops.items():
        half = len(rows) // 2
        for part, style, which in ((slice(0, half + 1), "-", "first"), (slice(half, None), "--", "second")):
            ohm = np.abs(rows[part, 1] / rows[part, 0])
            colour = "C1" if name == "clean" else "C0"
            axes[0].semilogy(1e3 * rows[part, 0], ohm, style, lw=1.2, color=colour, label=f"{name}, {which} cycle")
    axes[0].set(xlabel="current [mA]", ylabel="resistance [ohm]")
    axes[0].legend(fontsize=9, loc="center left")
    bodies, contacts = simulation.bodies, simulation.contacts
    position, radius = bodies.position, simulation.radii()
    near = (radius > 0) & (np.abs(position[:, 1]) < 1.2 * RADIUS)
    order = np.flatnonzero(near)[np.argsort(-position[near, 1])]
    disks = plots.draw_disks(axes[1], position[order][:, [0, 2]], radius[order], edgecolor="white")
    disks.set_array(bodies.potential[order])
    figure.colorbar(disks, ax=axes[1], label="potential [V]", shrink=0.8)
    width, height = np.max(np.abs(position[radius > 0, 0])) + RADIUS, np.max(position[radius > 0, 2]) + RADIUS
    axes[1].set(xlim=(-width, width), ylim=(0, height), aspect="equal", xlabel="x [m]", ylabel="z [m]")
    carried = np.abs(contacts.current)
    carried = carried[carried > 1e-12 * peak]  # the rest are dead ends
    axes[2].hist(np.log10(carried / peak), bins=40)
    axes[2].set(xlabel="log10 of the current of a contact over that of the bed [-]", ylabel="number of contacts")
    clean = contacts.electrical_conductance > 10 * FILM
    ids = bodies.id
    ends = position[np.searchsorted(ids, contacts.bodies[clean])]
    for k in (0, 1):  # plates have no place of their own across
        plate = radius[np.searchsorted(ids, contacts.bodies[clean][:, k])] == 0
        ends[plate, k, :2] = ends[plate, 1 - k, :2]
    from matplotlib.collections import LineCollection

    lines = LineCollection(ends[:, :, [0, 2]], linewidths=0.3 + 3 * np.abs(contacts.current[clean]) / carried.max(), colors="C3")
    axes[3].add_collection(lines)
    axes[3].set(xlim=(-width, width), ylim=(0, height), aspect="equal", xlabel="x [m]", ylabel="z [m]")
    axes[3].set_title("contacts without film, as thick as their current", fontsize=11)
    figure.savefig(folder / f"{NAME}.png", dpi=110)
    plt.close(figure)


def write(loops, path):
    """Current, resistance and broken films of both loops, a row a step."""
    with open(path, "w", encoding="utf-8") as file:
        file.write("contacts,current [A],resistance [ohm],broken films,closure of charge\n")
        for name, rows in loops.items():
            for current, potential, broken, closure in rows:
                file.write(f"{name},{current:.6g},{abs(potential / current):.6g},{int(broken)},{closure:.2e}\n")


def main(arguments=None):
    """Runs, prints the figures, draws; returns the figures."""
    options = options_from(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    checkpoint = options.output / f"{NAME}.pressed.h5"
    start = time.perf_counter()
    height, pressed, pressing = compact(options, checkpoint)
    loops, works = {}, {}
    for name in ("clean", "oxidised"):
        loops[name], works[name], simulation = cycle(options, checkpoint, name == "oxidised")
    simulation.run(1, output=options.output / f"{NAME}.vtkhdf", overwrite=True, progress=False)
    write(loops, options.output / f"{NAME}.csv")
    peak = FULL_CURRENT * options.spheres / FULL
    rows, n = loops["oxidised"], options.currents
    ohm = np.abs(rows[:, 1] / rows[:, 0])
    at = max(n // 4, 1)
    figures = {
        "spheres": (options.spheres, ""),
        "height of the bed": (height * 1e3, "mm"),
        "steps to press it": (pressed, ""),
        "contacts that conduct": (simulation.report["electrical"]["branches"], ""),
        "resistance, clean": (abs(loops["clean"][n - 1, 1] / peak), "ohm"),
        "resistance at the start": (ohm[0], "ohm"),
        "resistance at the peak": (ohm[n - 1], "ohm"),
        "first cycle, up over down": (ohm[at] / ohm[2 * n - 2 - at], ""),
        "second cycle, up over down": (ohm[2 * n - 1 + at] / ohm[4 * n - 4 - at], ""),
        "films broken": (rows[-1, 2], ""),
        "closure of the charge": (float(rows[:, 3].max()), ""),
        "heat against what is supplied": (works["oxidised"]["joule"], ""),
        "residual of the network": (works["oxidised"]["residual"], ""),
        "steps solved for potentials": (works["oxidised"]["solved"], f"of {len(rows)}"),
        "steps solved for contacts": (works["oxidised"]["met"], f"of {len(rows)}"),
        "pressing: steps solved": (pressing["met"], f"of {pressed}"),
        "pressing: largest error": (pressing["error"], ""),
        "pressing: closure of energy": (pressing["closure"], ""),
        "currents": (len(rows), ""),
        "solutions": (works["oxidised"]["rounds"], ""),
        "factorisations": (works["oxidised"]["factorisations"], ""),
        "multigrid iterations": (works["oxidised"]["iterations"], ""),
        "time": (time.perf_counter() - start, "s"),
    }
    for name, (value, unit) in figures.items():
        print(f"{name:28s} {value:.4g} {unit}".rstrip())
    draw(loops, simulation, peak, options.output)
    return figures


if __name__ == "__main__":
    main()
