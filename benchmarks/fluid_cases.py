"""Cases of a meshless liquid with known numbers, at two or three spacings: errors, orders and costs as CSV.

    python benchmarks/fluid_cases.py [case ...] [--full]

Rows of cases that were not run stay in the file, benchmarks/results/fluid_cases.csv.
"""

import argparse
import csv
import time
from pathlib import Path

import cairn as cn
import fluid_cases_bodies as bodies
import fluid_cases_meshes as meshes
import numpy as np
from fluid_scenes import ROCK, advanced, images_of_walls, tank


def hydrostatics(dx, **form):
    scene, bed = tank((0, 0), (2, 0.9), 2.0, dx, 1.0, **form)
    sim, force, cpu, work = advanced(scene, 0.02, 3.0, lambda sim: sim.fluid.force_on(bed)[1])
    depth = 0.9 - sim.fluid.position[:, 1]
    pressure = np.sqrt(np.mean((sim.fluid.pressure - 1000.0 * depth) ** 2)) / 900.0
    weight = abs(np.mean(force[len(force) // 2 :]) / -1800.0 - 1)
    return {"weight": weight, "pressure": pressure}, cpu, work


def _channel(dx, gravity, lid, at, **form):
    scene = cn.Scene(dim=2, gravity=(gravity, 0.0), periodic=cn.Periodic((12 * dx, np.inf)))
    scene.add(cn.wall((0, 0), (0, 1), ROCK), cn.wall((0, 1), (0, -1), ROCK, velocity=(lid, 0.0, 0.0)))
    scene.add(cn.fluid([(0, 0), (12 * dx, 1)], dx, density=1.0, viscosity=0.1, **(form or {"sound_speed": 10.0})))
    middle = lambda sim: np.mean(sim.fluid.velocity[np.abs(sim.fluid.position[:, 1] - 0.5) < 0.6 * dx, 0])  # noqa: E731
    _, speed, cpu, work = advanced(scene, 0.05, 5.0, middle)
    return {f"nu t/L2 = {t:g}": abs(speed[int(round(t * 10 / 0.05)) - 1] / value - 1) for t, value in at.items()}, cpu, work


def poiseuille(dx, **form):
    return _channel(dx, 0.8, 0.0, {0.05: 0.370386, 0.1: 0.615353, 0.2: 0.856637, 0.5: 0.992578}, **form)


def couette(dx, **form):
    return _channel(dx, 0.0, 1.0, {0.05: 0.113844, 0.1: 0.262756, 0.2: 0.411566, 0.5: 0.495422}, **form)


def taylor_green(dx, reynolds=100.0, **form):
    n = int(round(1 / dx))
    x = (np.arange(n) + 0.5) / n
    x, y = (a.ravel() for a in np.meshgrid(x, x, indexing="ij"))
    a, b = 2 * np.pi * x, 2 * np.pi * y
    velocity = np.stack([-np.cos(a) * np.sin(b), np.sin(a) * np.cos(b)], axis=1)
    scene = cn.Scene(dim=2, periodic=cn.Periodic((1.0, 1.0)))
    options = {"velocity": velocity, "pressure": -0.25 * (np.cos(2 * a) + np.cos(2 * b)), **(form or {"sound_speed": 10.0})}
    scene.add(cn.fluid(np.stack([x, y], axis=1), 1 / n, density=1.0, viscosity=1 / reynolds, **options))
    size = lambda sim: np.sqrt(np.sum(sim.fluid.velocity**2) / np.sum(velocity**2))  # noqa: E731
    _, sizes, cpu, work = advanced(scene, 0.2 * dx if form else 0.01, 1.0, size)
    return {f"Re {reynolds:g}, t = 1": abs(sizes[-1] / np.exp(-8 * np.pi**2 / reynolds) - 1)}, cpu, work


def taylor_green_1000(dx, **form):
    return taylor_green(dx, 1000.0, **form)


def standing_wave(dx, **form):
    """Period of a wave of 2 m in 1 m of water: 1.13392 s by linear theory, at a fiftieth of the depth."""
    high = 0.02
    x = np.arange(0.5 * dx, 2, dx)
    x, y = (a.ravel() for a in np.meshgrid(x, np.arange(0.5 * dx, 1, dx), indexing="ij"))
    places = np.stack([x, y], axis=1)
    places[:, 1] *= 1 + high * np.cos(np.pi * places[:, 0])
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.wall((0, 0), (0, 1), ROCK), cn.wall((0, 0), (1, 0), ROCK), cn.wall((2, 0), (-1, 0), ROCK))
    pressure = 1000 * 9.81 * (1 + high * np.cos(np.pi * places[:, 0]) - places[:, 1])
    scene.add(cn.fluid(places, dx, pressure=pressure, **form))
    mode = lambda sim: np.sum(np.cos(np.pi * sim.fluid.position[:, 0]) * sim.fluid.position[:, 1])  # noqa: E731
    _, seen, cpu, work = advanced(scene, 0.01, 2.0, mode)
    seen = np.array(seen) - np.mean(seen[:113])
    falls = np.flatnonzero((seen[:-1] > 0) & (seen[1:] <= 0))
    turns = [k + seen[k] / (seen[k] - seen[k + 1]) for k in falls]
    period = 0.01 * np.mean(np.diff(turns)) if len(turns) > 1 else np.nan
    return {"period": abs(period / 1.13392 - 1)}, cpu, work


KOSHIZUKA = ((0.769, 1.252), (1.153, 1.505), (1.537, 1.892), (1.935, 2.241), (2.323, 2.615), (2.719, 3.003))
MARTIN = ((0.83, 1.22), (1.22, 1.47), (2.00, 2.29), (2.55, 3.00))


def dam_break(dx, **form):
    """Front x/a against t sqrt(2 g / a) of a column twice as high as wide; the mean difference from experiments."""
    scene, _ = tank((0, 0), (1, 2), 4.0, dx, 1.0, **form)
    scene.interact("fluid", "*", cn.FreeSlip())
    front = lambda sim: np.quantile(sim.fluid.position[:, 0], 0.999) + 0.5 * dx  # noqa: E731
    step = 0.4 * dx if form else 0.02
    sim, seen, cpu, work = advanced(scene, step, 1.95, front)
    time_of = step * np.sqrt(2.0) * np.arange(1, len(seen) + 1)
    out = {}
    for name, table in (("Koshizuka & Oka", KOSHIZUKA), ("Martin & Moyce", MARTIN)):
        at, x = np.array(table).T
        out[name] = float(np.mean(np.interp(at, time_of, seen) / x - 1))
    return out, cpu, work


def release(dx, share=0.1, **form):
    """Acceleration of a cylinder of radius 0.5 m, held for 0.4 s, then let go in a tank of eight radii: over 0.1 s, against
    that in endless liquid and that with images of the walls, and that of the first step of the incompressible form."""
    radius, side, step = 0.5, 4.0, 4e-3
    scene, _ = tank((0, 0), (side, side), side, dx, 9.81, **form)
    wood = cn.Material("wood", density=1000.0 * share)
    ball = scene.add(cn.disks([[side / 2, side / 2]], radius, wood, driven=("vx", "vy", "w")))[0]
    scene.interact("fluid", "*", cn.FreeSlip())
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    rise = lambda sim: sim.bodies.velocity[sim.bodies.id == ball][0, 1]  # noqa: E731
    sim, _, cpu, work = advanced(scene, step, 0.4)
    sim.drive([ball], (), (0.0, 0.0, 0.0))
    speed, start = [], time.process_time()
    for _ in range(25):
        sim.step()
        speed.append(rise(sim))
        work += len(sim.fluid) * max(1, sim.fluid.info["sub_steps"])
    cpu += time.process_time() - start
    at = step * np.arange(1, 26)
    slope = np.sum(at * speed) / np.sum(at * at)
    endless, walled = ((1 - share) / (added + share) * 9.81 for added in (1.0, images_of_walls()))
    out = {f"s = {share:g}": slope / endless - 1, f"s = {share:g}, images of the walls": slope / walled - 1}
    if form:
        out[f"s = {share:g}, images of the walls, first step"] = speed[0] / step / walled - 1
    return out, cpu, work


def release_half(dx, **form):
    return release(dx, 0.5, **form)


def release_light(dx, **form):
    return release(dx, 0.001, **form)


def floating_block(dx, share=0.5, **form):
    scene, _ = tank((0, 0), (1.2, 0.6), 1.2, dx, 9.81, **form)
    square = 0.15 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    block = scene.add(cn.polygons(square, cn.Material("wood", density=1000.0 * share), position=[[0.6, 0.6]]))[0]
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    place = lambda sim: sim.bodies.position[sim.bodies.id == block][0, 1]  # noqa: E731
    sim, seen, cpu, work = advanced(scene, 2e-3, 3.0, place)
    level = (len(sim.fluid) * dx**2 + share * 0.09) / 1.2
    return {"draft": abs((level - np.mean(seen[len(seen) // 2 :]) + 0.15) / 0.3 - share) / share}, cpu, work


def patch(dx, **form):
    """A disk of liquid in the velocity field A0 (x, -y), A0 = 100/s, without gravity: its long axis over the first. Steps of the
    incompressible form are a fifth of a spacing over the greatest speed."""
    x = np.arange(-1 + 0.5 * dx, 1, dx)
    places = np.stack([a.ravel() for a in np.meshgrid(x, x)], axis=1)
    places = places[np.sum(places**2, axis=1) <= 1]
    scene = cn.Scene(dim=2)
    pressure = 0.5 * 1000 * 100.0**2 * (1 - np.sum(places**2, axis=1))
    options = {"velocity": 100 * places * [-1, 1], "pressure": pressure, **(form or {"sound_speed": 1400.0})}
    scene.add(cn.fluid(places, dx, **options))
    wide = lambda sim: 2 * np.sqrt(np.mean(sim.fluid.position[:, 0] ** 2))  # noqa: E731
    step = 2e-3 * dx if form else 2e-4
    sim, seen, cpu, work = advanced(scene, step, 0.0076, wide)
    first = 2 * np.sqrt(np.mean(places[:, 0] ** 2))
    at = {0.002: 0.820826, 0.0038: 0.694821, 0.0076: 0.514266}
    return {f"axis at {t:g} s": abs(seen[int(round(t / step)) - 1] / first / a - 1) for t, a in at.items()}, cpu, work


def incompressible(case):
    """The same case by the incompressible form, in the step of the bodies."""
    return lambda dx: case(dx, incompressible=True)


CASES = {
    "hydrostatics": (hydrostatics, (0.1, 0.05, 0.025)),
    "Poiseuille": (poiseuille, (0.1, 0.05, 0.025)),
    "Couette": (couette, (0.1, 0.05, 0.025)),
    "Taylor-Green": (taylor_green, (0.05, 0.025, 0.0125)),
    "Taylor-Green, Re 1000": (taylor_green_1000, (0.05, 0.025, 0.0125)),
    "standing wave": (standing_wave, (0.1, 0.05, 0.025)),
    "dam break": (dam_break, (0.1, 0.05, 0.025)),
    "release, s = .1": (release, (0.125, 0.0625, 0.03125)),
    "release, s = .5": (release_half, (0.125, 0.0625, 0.03125)),
    "release, s = .001": (release_light, (0.125, 0.0625, 0.03125)),
    "floating block": (floating_block, (0.06, 0.05, 0.03)),
    "circular patch": (patch, (0.1, 0.05, 0.025)),
    "hydrostatics, incompressible": (incompressible(hydrostatics), (0.1, 0.05, 0.025)),
    "Poiseuille, incompressible": (incompressible(poiseuille), (0.1, 0.05, 0.025)),
    "Couette, incompressible": (incompressible(couette), (0.1, 0.05, 0.025)),
    "Taylor-Green, incompressible": (incompressible(taylor_green), (0.05, 0.025, 0.0125)),
    "Taylor-Green, Re 1000, incompressible": (incompressible(taylor_green_1000), (0.05, 0.025, 0.0125)),
    "standing wave, incompressible": (incompressible(standing_wave), (0.1, 0.05, 0.025)),
    "release, s = .1, incompressible": (incompressible(release), (0.125, 0.0625, 0.03125)),
    "release, s = .5, incompressible": (incompressible(release_half), (0.125, 0.0625, 0.03125)),
    "release, s = .001, incompressible": (incompressible(release_light), (0.125, 0.0625, 0.03125)),
    "floating block, incompressible": (incompressible(floating_block), (0.06, 0.05, 0.03)),
    "circular patch, incompressible": (incompressible(patch), (0.1, 0.05, 0.025)),
    "dam break, incompressible": (incompressible(dam_break), (0.1, 0.05, 0.025)),
    "elastic plate": (meshes.elastic_plate, (0.1, 0.05, 0.025)),
    "elastic plate, incompressible": (incompressible(meshes.elastic_plate), (0.1, 0.05, 0.025)),
    "release of an elastic cylinder, s = .001, incompressible": (meshes.released(0.001), (0.125, 0.0625, 0.03125)),
    "release of an elastic cylinder, s = .1, incompressible": (meshes.released(0.1), (0.125, 0.0625, 0.03125)),
    "release of an elastic cylinder, s = 10, incompressible": (meshes.released(10.0), (0.125, 0.0625, 0.03125)),
    "hydrostatics in space": (bodies.hydrostatics_in_space, (0.1, 0.05, 0.025)),
    "hydrostatics in space, incompressible": (incompressible(bodies.hydrostatics_in_space), (0.1, 0.05, 0.025)),
    "array of spheres": (bodies.hasimoto, (1 / 12, 1 / 16, 1 / 24)),
    "array of spheres, incompressible": (incompressible(bodies.hasimoto), (1 / 12, 1 / 16, 1 / 24)),
    "wedge": (bodies.wedge, (0.05, 0.025, 0.0125)),
    "wedge, incompressible": (incompressible(bodies.wedge), (0.05, 0.025, 0.0125)),
    "gate": (bodies.gate, (0.005, 0.0025, 0.00125)),
    "gate, incompressible": (incompressible(bodies.gate), (0.005, 0.0025, 0.00125)),
    "collapse in water": (bodies.collapse, (0.0432, 0.0216, 0.0108)),
    "SPHERIC 2": (bodies.spheric_2, (0.55 / 10, 0.55 / 15, 0.55 / 20)),
    **{f"settling sphere, {which}": (bodies.ten_cate(which), (0.005, 0.004, 0.0025)) for which in bodies.TEN_CATE},
}


RESULTS = Path(__file__).resolve().parent / "results" / "fluid_cases.csv"
COLUMNS = ["case", "what", "spacing [m]", "relative error", "order", "CPU [s]", "us a particle and sub-step"]


def ran(name, full):
    """Rows of a case."""
    case, spacings = CASES[name]
    before, rows = {}, []
    for dx in spacings[: 3 if full else 2]:
        errors, cpu, work = case(dx)
        for what, error in errors.items():
            last = before.get(what)
            order = np.log(abs(last[1] / error)) / np.log(last[0] / dx) if last and error else np.nan
            rows.append([name, what, f"{dx:.4g}", f"{error:.3e}", f"{order:.2f}", f"{cpu:.1f}", f"{1e6 * cpu / work:.2f}"])
            print(*rows[-1], sep=", ", flush=True)
            before[what] = (dx, error)
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("cases", nargs="*", help=", ".join(CASES))
    parser.add_argument("--output", type=Path, default=RESULTS)
    parser.add_argument("--full", action="store_true", help="the third spacing too")
    given = parser.parse_args()
    names = given.cases or list(CASES)
    if unknown := [name for name in names if name not in CASES]:
        parser.error(f"there is no case {unknown[0]!r}: give some of {', '.join(CASES)}")
    for name in names:
        rows = ran(name, given.full)
        held = []
        if given.output.exists():
            held = list(csv.reader(given.output.open(encoding="utf-8")))[1:]
        held = [row for row in held if row[0] != name] + rows
        held.sort(key=lambda row: list(CASES).index(row[0]) if row[0] in CASES else len(CASES))
        with open(given.output, "w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows([COLUMNS, *held])


if __name__ == "__main__":
    main()
