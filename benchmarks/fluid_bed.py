"""Lift of held grains by a flow from below, beside Ergun's law: a piston presses water through a bed.

    python benchmarks/fluid_bed.py

A bed of held grains, 0.4 m high, stands 0.5 m above a floor that rises, in 1.4 m of water of a plane scene that is periodic
across. The force of the liquid on all grains less Archimedes' buoyancy, and that on the grains of the interior, of which rows at
both faces of the bed are left out, stand over what the law gives. Writes benchmarks/results/fluid_bed.csv.
"""

import csv
from pathlib import Path

import cairn as cn
import numpy as np

LOW, HIGH, DEEP, WIDE, SPACING, SOLID = 0.5, 0.9, 1.4, 0.6, 0.05, 0.4
DENSITY, GRAVITY, ACROSS, ROWS, EDGE = 1000.0, 1.0, 18, 12, 2
CASES = [(0.02, 1.0, 60), (0.005, 1.0, 60), (0.002, 1.0, 60), (0.02, 0.1, 60), (0.02, 0.1, 200), (0.005, 0.1, 200)]
COLUMNS = ["speed [m/s]", "viscosity [Pa s]", "way of the piston [spacings]", "drop over weight of the water at the foot"]
COLUMNS += ["lift over the law", "lift of the interior over the law", "drop over the law", "least row", "greatest row"]


def gradient(speed, viscosity, diameter):
    """Drop of pressure over length by Ergun (1952), with the porosity of spheres that are packed as the disks are [Pa/m]."""
    spheres = 2 / np.sqrt(np.pi * np.sqrt(3)) * SOLID**1.5
    flow = speed / (1 - SOLID)  # between the grains
    drag = 150 * spheres * viscosity / ((1 - spheres) * diameter**2) + 1.75 * DENSITY * flow / diameter
    return drag * flow * SOLID / (1 - SOLID)


def column(speed):
    """Scene, materials of floor and grains, ids of the grains, their diameter [m]."""
    rock, sand = cn.Material("rock", density=2600.0), cn.Material("sand", density=2600.0)
    scene = cn.Scene(dim=2, gravity=(0.0, -GRAVITY), periodic=cn.Periodic((WIDE, np.inf)))
    scene.add(cn.wall((0, 0), (0, 1), rock, velocity=(0.0, speed, 0.0)))
    x, y = (low + (np.arange(n) + 0.5) * size / n for low, n, size in ((0.0, ACROSS, WIDE), (LOW, ROWS, HIGH - LOW)))
    places = np.stack([a.ravel() for a in np.meshgrid(x, y)], axis=1)  # row by row
    radius = np.sqrt(SOLID * WIDE * (HIGH - LOW) / len(places) / np.pi)
    ids = scene.add(cn.disks(places, radius, sand, driven=("vx", "vy", "w")))
    scene.interact("*", "*", None)
    return scene, rock, sand, ids, 2 * radius


def lifted(speed, viscosity, steps):
    """Lift over the law of all grains and of the interior, drop over the law, lifts of rows over the law."""
    scene, rock, sand, ids, diameter = column(speed)
    scene.add(cn.fluid([(0, 0), (WIDE, DEEP)], SPACING, DENSITY, viscosity, sound_speed=15.0))
    scene.interact("fluid", rock, cn.FreeSlip())
    scene.interact("fluid", sand, cn.GrainDrag("ergun"))
    sim = cn.Simulation(scene, dt=0.02)
    forces, drops = [], []
    for k in range(steps):
        sim.step()
        if k < steps // 2:
            continue
        forces.append([sim.fluid.force_on(i)[1] for i in ids])
        y = sim.fluid.position[:, 1]
        head = sim.fluid.pressure + DENSITY * GRAVITY * y
        below, above = (y > LOW - 0.25) & (y < LOW - 0.08), (y > HIGH + 0.1) & (y < HIGH + 0.3)
        drops.append(head[below].mean() - head[above].mean())
    law = gradient(speed, viscosity, diameter)
    volume = np.pi * diameter**2 / 4
    rows = (np.mean(forces, axis=0).reshape(ROWS, ACROSS).mean(axis=1) / volume - DENSITY * GRAVITY) * SOLID / law
    return rows.mean(), rows[EDGE:-EDGE].mean(), np.mean(drops) / (law * (HIGH - LOW)), rows


def main():
    table = []
    for speed, viscosity, steps in CASES:
        lift, interior, drop, rows = lifted(speed, viscosity, steps)
        radius = np.sqrt(SOLID * WIDE * (HIGH - LOW) / (ACROSS * ROWS) / np.pi)
        weight = gradient(speed, viscosity, 2 * radius) * (HIGH - LOW) / (DENSITY * GRAVITY * (DEEP - LOW))
        numbers = speed, viscosity, speed * steps * 0.02 / SPACING, weight, lift, interior, drop, rows.min(), rows.max()
        table.append([f"{x:.3g}" for x in numbers])
        print(*table[-1], sep=", ", flush=True)
    path = Path(__file__).resolve().parent / "results" / "fluid_bed.csv"
    with open(path, "w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([COLUMNS, *table])


if __name__ == "__main__":
    main()
