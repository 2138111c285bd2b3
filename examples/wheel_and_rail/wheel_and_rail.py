"""A wheel slides to and fro on a rail of bonded grains: bonds break, grains come loose, a third body forms and wears the rail.

The rail is a deposit of disks of 0.05 to 0.1 mm joined by a cohesive zone, the wheel a row of the same disks on an arc, a rigid
body under a constant load that is moved to and fro over ten diameters of a grain: section 5.2 of Dubois & Renouf (2007; Renouf,
Saulot & Berthier 2006), who had 73,000 disks, a wheel of 450 and 100 cycles in 30 days. Load, stroke, speed, friction and
strength are not told there. They are chosen here, for outcomes without units alone: friction of the wheel, share of loose grains,
shape of the velocity profile. Nothing else is to be compared with a rail.

- The load is 2 GPa times the chord of an arc that has sunk by the mean radius. As the wheel beds in, more grains touch it: the
  mean pressure over them is printed for each cycle, 1 GPa or more in the first ones.
- Rigid grains have one time, d sqrt(density / pressure): 0.3 microseconds, in which the pressure pushes a loose grain across its
  own diameter d. A step is 0.15 of it; overlaps are about error x (pressure / density d) x step^2. With much longer steps the
  wheel drives through the rail.
- The wheel goes 140 m/s in the mean. Over a layer of ten grains that is an inertial number of 0.03, at which grains still flow
  densely, and a cycle takes 480 steps. Inertia thus contributes to the results; 14 m/s would take ten times as many.
- The wheel has the mass of its disks: with a heavy one on light grains errors of the contacts vanish beside those of the wheel.
- Bonds: E/2r = 1.4e15 Pa/m, 4 GPa over the effective radius r1 r2/(r1 + r2), which is 1 GPa over the diameter of a grain and
  twice the nominal pressure. Of a rail of 1,000 disks 73, 42, 5 and 0.7 % are loose after 3 cycles with bonds of 1, 2, 8 and
  16 GPa. The zone is MP3, which ends: Raous' MAC, of endless tail, would keep each pair for ever. It takes ten times s^2/c, so
  that softening is slower than the inertia of a grain in a step; with four times s^2/c most steps of a rail of 600 disks were not
  solved in 200 sweeps (errors of 5e-3).
- Bonds that soften take half of their change in a sweep: 200 sweeps leave 19 steps of the default run above an error of 1e-3.
- Friction 0.3 at broken bonds and under the wheel. Bottom and sides of the rail are held.

The pressure is the load over the width of an even pressure whose forces spread as widely, sqrt(12) standard deviations.

Loose grains have no path of bonds to a held grain of the rail.

Run it:  python wheel_and_rail.py                 3,000 disks, 3 cycles, under a minute
         python wheel_and_rail.py --full          73,000 disks, 100 cycles
         python wheel_and_rail.py --full --restart      goes on from the last checkpoint in the output folder, to the
                                                        same bits; begins if there is none; draws if all cycles are done
"""

from __future__ import annotations

import argparse
import csv
import os
import time
from pathlib import Path

import cairn as cn
import matplotlib.pyplot as plt
import numpy as np
from cairn.base import checks
from matplotlib.collections import EllipseCollection, LineCollection

NAME = "wheel_and_rail"
SMALLEST, LARGEST = 0.05e-3, 0.1e-3  # radii [m]
MEAN = 0.5 * (SMALLEST + LARGEST)
DENSITY, FRICTION = 7800.0, 0.3
STIFFNESS, STRENGTH, TOUGH = 1.4e15, 4e9, 10.0  # [Pa/m], [Pa], work over strength^2 / stiffness
PRESSURE = 2e9  # over the chord of an arc that has sunk by the mean radius [Pa]
SPEED = 140.0  # mean of the wheel [m/s]
STROKE = 20 * MEAN  # ten diameters [m]
STEP = 0.15  # of the time in which the pressure pushes a grain across its diameter
RELAXATION = 0.5  # share of its change that a bond which softens takes in a sweep
PRESSED = 0.25  # of a period, in which the load comes on
LENGTH_TO_HEIGHT, SOLID = 4.0, 0.84
PAPER, PAPER_WHEEL = 73_000, 450  # disks
LEVELS = 12  # of the velocity profile, a diameter each
OF_STEP = ("along", "across", "error", "iterations", "width", "overlap", "unbalanced", "cpu_s")  # before those of the levels


def options_from(arguments):
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--disks", type=int, help="of the rail (3,000; full 73,000)")
    parser.add_argument("--cycles", type=int, help="(3; full 100)")
    parser.add_argument("--step", type=float, default=STEP, help="over d sqrt(density / pressure) (0.15)")
    parser.add_argument("--strength", type=float, default=STRENGTH, help="of the bonds [Pa] (4e9)")
    parser.add_argument("--stiffness", type=float, default=STIFFNESS, help="of the bonds [Pa/m] (1.4e15)")
    parser.add_argument("--tolerance", type=float, default=1e-3, help="of the solver's true error (1e-3)")
    parser.add_argument("--iterations", type=int, default=200, help="most of a step (200)")
    parser.add_argument("--relaxation", type=float, default=RELAXATION, help="of bonds that soften (0.5; 1: none)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=0, help="0: as many as OpenMP decides; results do not depend on it")
    parser.add_argument("--full", action="store_true", help="73,000 disks, 100 cycles")
    parser.add_argument("--restart", action="store_true", help="go on from the checkpoint in the output folder, if one is there")
    parser.add_argument("--save", type=int, default=40, metavar="STEPS", help="between checkpoints (40), and after each cycle")
    parser.add_argument("--output", type=Path, default=Path("."))
    options = parser.parse_args(arguments)
    options.disks = options.disks or (PAPER if options.full else 3000)
    options.cycles = options.cycles or (100 if options.full else 3)
    for name in ("disks", "cycles", "iterations", "save"):
        checks.count(name, getattr(options, name), 1)
    for name in ("step", "strength", "stiffness", "relaxation"):
        checks.positive(name, getattr(options, name))
    return options


class Pair:
    """Rail and wheel: the scene, the step and the load."""

    def __init__(self, options):
        radii = cn.pre.grains.uniform(options.disks, SMALLEST, LARGEST, rng=options.seed)
        self.length = length = float(np.sqrt(LENGTH_TO_HEIGHT * np.sum(np.pi * radii**2) / SOLID))
        centers = cn.pre.deposit_disks(radii, length)
        self.top = top = 0.97 * (centers[:, 1] + radii).max()  # the last ones lie on an uneven surface
        kept = centers[:, 1] + radii < top
        centers, radii = centers[kept], radii[kept]
        side = 2 * LARGEST
        held = (centers[:, 1] < side) | (centers[:, 0] < side) | (centers[:, 0] > length - side)
        order = np.argsort(held, kind="stable")  # free ones first
        centers, self.radii = centers[order], radii[order]
        self.free, self.count = int((~held).sum()), len(radii)
        rail, rim = cn.Material("rail", density=DENSITY), cn.Material("wheel", density=DENSITY)
        self.scene = scene = cn.Scene(dim=2)
        scene.add(cn.disks(centers[: self.free], self.radii[: self.free], rail))
        scene.add(cn.disks(centers[self.free :], self.radii[self.free :], rail, driven=("vx", "vy", "w")))
        round_ = 1.2 * length  # radius of the arc
        self.chord = 2 * np.sqrt(2 * round_ * MEAN)
        self.load = PRESSURE * self.chord
        self.period = 2 * STROKE / SPEED
        self.steps = round(self.period / (options.step * 2 * MEAN * np.sqrt(DENSITY / PRESSURE)))  # of a cycle
        self.dt = self.period / self.steps
        self.press = round(PRESSED * self.steps)
        self.add_wheel(rim, round_, options)
        zone = cn.MP3(normal_stiffness=options.stiffness, tangential_stiffness=options.stiffness, mu=FRICTION,
                      strength=options.strength, work=TOUGH * options.strength**2 / options.stiffness,
                      within=0.02 * SMALLEST)  # fmt: skip
        scene.interact(rail, rail, zone)
        scene.interact(rail, rim, cn.Coulomb(mu=FRICTION))

    def add_wheel(self, rim, round_, options):
        """Disks that touch along an arc, one body; it starts at the left end of its stroke, above the rail."""
        own = cn.pre.grains.uniform(max(9, round(PAPER_WHEEL * np.sqrt(options.disks / PAPER))), SMALLEST, LARGEST,
                                    rng=options.seed + 1)  # fmt: skip
        way = np.cumsum(own) + np.concatenate([[0.0], np.cumsum(own[:-1])])
        angle = (way - way[-1] / 2) / round_
        offsets = np.column_stack([round_ * np.sin(angle), -round_ * np.cos(angle)])
        self.low = float((offsets[:, 1] - own).min())
        mass = DENSITY * np.pi * float((own**2).sum())
        begin, pulse = self.press * self.dt, 2 * np.pi / self.period
        self.scene.add(cn.clumps([(self.length / 2 - STROKE / 2, self.top - self.low)], offsets, own, mass, mass * round_**2, rim,
                                 driven=("vx", "w"),
                                 drive=lambda t: (0.5 * STROKE * pulse * np.sin(pulse * max(0.0, t - begin)), 0.0, 0.0),
                                 force=cn.Table([0.0, begin], [[0.0, 0.0, 0.0], [0.0, -self.load, 0.0]])))  # fmt: skip


def loose(sim, pair):
    """Disks of the rail that bonds join to none that is held, (n,) of bool."""
    out = np.arange(pair.count) < pair.free
    for piece in cn.post.fragments(sim):
        rows = np.searchsorted(sim.bodies.id, piece)
        if ((rows >= pair.free) & (rows < pair.count)).any():
            out[rows] = False
    return out


class Watch:
    """Records a row for each step of a cycle: forces on the wheel, errors, and speeds of grains by their depth under the
    wheel."""

    def __init__(self, sim, pair):
        self.pair = pair
        self.forget(sim)

    def momentum(self, sim):
        n = self.pair.free
        return (sim.bodies.mass[:n, None] * sim.bodies.velocity[:n, :2]).sum(axis=0)

    def forget(self, sim, rows=()):
        """Begins a cycle, or goes on in it after the steps whose rows are given."""
        self.rows = list(rows)
        self.before, self.begun = self.momentum(sim), time.process_time()

    def __call__(self, sim):
        pair, contacts, wheel = self.pair, sim.contacts, self.pair.count
        bodies, impulse, point = contacts.bodies, contacts.impulse, contacts.point
        of_rail = bodies < pair.free
        given = (of_rail[:, 0].astype(float) - of_rail[:, 1]) @ impulse
        now = self.momentum(sim)
        unbalanced = float(np.abs(now - self.before - given).max()) / (pair.load * sim.dt)
        self.before = now
        on = np.flatnonzero((bodies[:, 0] == wheel) | (bodies[:, 1] == wheel))
        along, across = np.where(bodies[on, 0] == wheel, 1.0, -1.0) @ impulse[on] / sim.dt
        share, place, width = np.linalg.norm(impulse[on], axis=1), point[on, 0], np.nan
        if share.sum() > 0:
            middle = np.average(place, weights=share)
            width = np.sqrt(12 * np.average((place - middle) ** 2, weights=share))
        overlap = max(0.0, -float(contacts.gap.min()) / (2 * MEAN))
        speed, grains = np.zeros(LEVELS), np.zeros(LEVELS)
        v = sim.bodies.velocity[wheel, 0]
        if abs(v) > SPEED:
            x, y = sim.bodies.position[: pair.free].T
            under = np.abs(x - sim.bodies.position[wheel, 0]) < pair.chord / 4
            level = np.floor((sim.bodies.position[wheel, 1] + pair.low - y[under]) / (2 * MEAN)).astype(int)
            inside = (level >= 0) & (level < LEVELS)
            np.add.at(speed, level[inside], sim.bodies.velocity[: pair.free][under][inside, 0] / v)
            np.add.at(grains, level[inside], 1)
        spent, self.begun = time.process_time() - self.begun, time.process_time()
        error = float(np.fmax(sim.info["error"], sim.info["light_error"]))
        own = (along, across, error, sim.info["iterations"], width, overlap, unbalanced, spent)
        self.rows.append(np.concatenate([own, speed, grains]))

    def cycle(self, sim, number, bonds):
        """A row of the table."""
        pair, rows = self.pair, np.array(self.rows)
        step = dict(zip(OF_STEP, rows.T, strict=False))
        speed, grains = rows[:, len(OF_STEP) :].sum(axis=0).reshape(2, LEVELS)
        free, terms, errors = loose(sim, pair), sim.info["energy"], step["error"]
        out = sim.bodies.position[: pair.count, 1] > pair.top + LARGEST
        profile = np.divide(speed, grains, out=np.zeros(LEVELS), where=grains > 0)
        row = {
            "cycle": number,
            "steps": len(rows),
            "friction": float(np.abs(step["along"]).mean() / step["across"].mean()),
            "pressure_GPa": float(pair.load / np.nanmean(step["width"]) / 1e9),
            "broken": int(bonds - (sim.contacts.beta > 0).sum()),
            "loose": int(free.sum()),
            "thrown_up": int((out & free).sum()),
            "sunk_diameters": float(pair.top - pair.low - sim.bodies.position[pair.count, 1]) / (2 * MEAN),
            "released": terms["released"],
            "dissipated_friction": terms["dissipated_friction"],
            "dissipated_normal": terms["dissipated_normal"],
            "closure": abs(terms["closure"]) / terms["in_play"],
            "momentum": step["unbalanced"].max(),
            "overlap_diameters": step["overlap"].max(),
            "error_median": float(np.median(errors)),
            "error_worst": float(errors.max()),
            "beyond": int((errors > sim.strategy.solver.tol).sum()),
            "iterations": step["iterations"].mean(),
            "cpu_s": step["cpu_s"].sum(),
        }
        return row | {f"speed_{k + 1}": float(value) for k, value in enumerate(profile)}


class Record:
    """The files a run goes on from: a row for each cycle, the steps of the cycle under way, the checkpoint. Each is replaced
    as a whole. A run that is killed between two of them goes on to the same rows: entries later than the checkpoint are left
    out."""

    def __init__(self, options):
        self.listed, self.rows, self.checkpoint = (
            options.output / f"{NAME}{ending}" for ending in (".csv", ".steps.npz", ".checkpoint.h5")
        )

    def save(self, sim, watch, cycle, bonds):
        part = self.rows.with_suffix(".part")
        with part.open("wb") as file:
            np.savez(file, bonds=bonds, cycle=cycle, rows=np.array(watch.rows).reshape(-1, len(OF_STEP) + 2 * LEVELS))
        os.replace(part, self.rows)
        sim.checkpoint(self.checkpoint)

    def write(self, table):
        part = self.listed.with_suffix(".part")
        with part.open("w", newline="") as file:
            writer = csv.DictWriter(file, list(table[0]))
            writer.writeheader()
            writer.writerows({name: f"{value:.7g}" for name, value in row.items()} for row in table)
        os.replace(part, self.listed)

    def restore(self, sim, pair):
        """Bonds at the start, table of whole cycles, rows of the steps taken in the next one."""
        sim.restore(self.checkpoint)
        done, taken = divmod(sim.steps - pair.press, pair.steps)
        table = []
        if done > 0:
            with self.listed.open() as file:
                table = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)][:done]
        with np.load(self.rows) as file:
            bonds, cycle, rows = int(file["bonds"]), int(file["cycle"]), file["rows"][:taken]
        if taken > 0 and (cycle != done + 1 or len(rows) < taken):
            raise ValueError(f"{self.rows} is not of the run of {self.checkpoint}: put back both")
        return bonds, table, rows


def draw(sim, pair, table, options):
    """Bonds, compressive contacts without bonds, loose grains and wheel; wear and friction against cycles; the velocity
    profile."""
    n, contacts = pair.count, sim.contacts
    figure = plt.figure(figsize=(13, 8), layout="constrained")
    axes = figure.subplot_mosaic([["scene"] * 3, ["wear", "friction", "profile"]], height_ratios=(1.6, 1))
    scene, place, free = axes["scene"], 1e3 * sim.bodies.position, loose(sim, pair)
    across = 2e3 * pair.radii
    for which, color in ((~free, "0.85"), (free, "tab:orange")):
        scene.add_collection(EllipseCollection(across[which], across[which], 0, units="xy", offsets=place[:n][which],
                                               offset_transform=scene.transData, facecolors=color))  # fmt: skip
    rail = (contacts.bodies < n).all(axis=1)
    pressed = np.any(contacts.impulse != 0, axis=1)
    for which, color in ((rail & (contacts.beta > 0), "tab:blue"), (rail & (contacts.beta == 0) & pressed, "red")):
        scene.add_collection(LineCollection(list(place[contacts.bodies[which]]), colors=color, linewidths=0.6))
    mine = sim.contactors.body == n
    at, size = place[n] + 1e3 * sim.contactors.offset[mine], 2e3 * sim.contactors.radius[mine]
    scene.add_collection(EllipseCollection(size, size, 0, units="xy", offsets=at, offset_transform=scene.transData,
                                           facecolors="0.4"))  # fmt: skip
    scene.set(xlim=(0, 1e3 * pair.length), ylim=(0, 1e3 * (pair.top + 12 * LARGEST)), aspect="equal", xlabel="mm",
              title="bonds (blue), contacts without a bond that press (red), loose grains (orange)")  # fmt: skip
    cycles = [row["cycle"] for row in table]
    axes["wear"].plot(cycles, [100 * row["loose"] / n for row in table], "o-")
    axes["wear"].set(xlabel="cycle", ylabel="loose grains [% of the rail]", ylim=(0, 110 * table[-1]["loose"] / n + 0.1))
    axes["friction"].plot(cycles, [row["friction"] for row in table], "o-")
    axes["friction"].set(xlabel="cycle", ylabel="friction of the wheel", ylim=(0, 1.1 * max(row["friction"] for row in table)))
    for row in (table[0], table[-1]):
        speeds = [row[f"speed_{k + 1}"] for k in range(LEVELS)]
        axes["profile"].plot(speeds, -np.arange(LEVELS) - 0.5, "o-", label=f"cycle {row['cycle']:.0f}")
    axes["profile"].set(xlabel="speed over that of the wheel", ylabel="height over the wheel's lowest\n[diameters]")
    axes["profile"].legend()
    figure.savefig(options.output / f"{NAME}.png", dpi=110)
    plt.close(figure)


def ride(sim, pair, watch, record, number, bonds, options):
    """To the end of a cycle; the file of the last one is gone on in if a part of it was made before."""
    until = pair.press + number * pair.steps

    def each(sim):
        watch(sim)
        if sim.steps < until and (until - sim.steps) % options.save == 0:
            record.save(sim, watch, number, bonds)

    path = options.output / f"{NAME}.vtkhdf" if number == options.cycles else None
    begun = path is not None and len(watch.rows) > 0 and path.exists()
    sim.run(until - sim.steps, output=path, every=max(1, pair.steps // 10), callback=each, progress=options.full,
            overwrite=not begun, append=begun)  # fmt: skip
    if sim.steps < until:
        record.save(sim, watch, number, bonds)
        raise SystemExit(f"stopped in cycle {number}: --restart goes on from there")


def main(arguments=None):
    """Runs, prints the figures, draws; returns the figures."""
    options = options_from(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    pair, table = Pair(options), []
    solver = cn.NLGS(tol=options.tolerance, max_iter=options.iterations, softening_relaxation=options.relaxation)
    sim = cn.Simulation(pair.scene, pair.dt, cn.NSCD(theta=0.6, solver=solver, threads=options.threads))
    record, watch, rows = Record(options), Watch(sim, pair), []
    if options.restart and record.checkpoint.exists():
        bonds, table, rows = record.restore(sim, pair)
        if len(table) > options.cycles:
            raise ValueError(f"cycles is {options.cycles}, and {record.checkpoint} was taken after {len(table)}: ask for more")
        if len(table) == options.cycles:
            sim.step()  # the picture needs contacts, which a step makes
    else:
        sim.step()
        bonds = int((sim.contacts.beta > 0).sum())
        sim.run(pair.press - 1, progress=False)
        record.save(sim, watch, 1, bonds)
    for number in range(len(table) + 1, options.cycles + 1):
        watch.forget(sim, rows)
        ride(sim, pair, watch, record, number, bonds, options)
        table.append({"bonds": bonds} | watch.cycle(sim, number, bonds))
        record.write(table)
        record.save(sim, watch, number, bonds)
        rows = []
        print("  ".join(f"{name} {value:.4g}" for name, value in table[-1].items() if "speed" not in name), flush=True)
    draw(sim, pair, table, options)
    end = table[-1]
    spent = sum(end[name] for name in ("released", "dissipated_friction", "dissipated_normal"))
    figures = {
        "disks of the rail": (pair.count, ""),
        "bonds at the start": (bonds, ""),
        "cycles": (len(table), ""),
        "steps": (sim.steps, ""),
        "pressure over what touches": (end["pressure_GPa"], "GPa"),
        "friction of the wheel": (end["friction"], ""),
        "broken bonds": (end["broken"], ""),
        "third body": (100 * end["loose"] / pair.count, "% of the disks of the rail"),
        "thrown up": (end["thrown_up"], "disks"),
        "wheel sunk by": (end["sunk_diameters"], "diameters"),
        "speed under the wheel": (end["speed_1"], "of its own"),
        "speed ten diameters below": (end["speed_11"], "of its own"),
        "spent by bonds": (100 * end["released"] / spent, "%"),
        "spent by friction": (100 * end["dissipated_friction"] / spent, "%"),
        "closure of the balance": (end["closure"], "of the energy in play"),
        "momentum of the grains": (max(row["momentum"] for row in table), "of what the load gives in a step"),
        "overlap, worst": (max(row["overlap_diameters"] for row in table), "diameters"),
        "error, median of the last cycle": (end["error_median"], ""),
        "error, worst": (max(row["error_worst"] for row in table), ""),
        "CPU time of the cycles": (sum(row["cpu_s"] for row in table), "s"),
    }
    for name, (value, unit) in figures.items():
        print(f"{name:32s} {value:.4g} {unit}".rstrip())
    return figures


if __name__ == "__main__":
    main()
