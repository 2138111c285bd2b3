"""Time of a step of smooth DEM on surfaces of triangles over that on ideal ones.

Grains (d 10 mm, E 1e7) rest in a lattice on a floor of 392 to 20,000 triangles that they all but cover, or fall and roll in a
drum of 1e5, at rest or turning at 2 rad/s. The scenes of a group take turns, a few steps at a time, on one thread. Times are
those of a step between two lists, ratios those of the rounds; times_with_lists counts the steps that make a list too, and core_
leaves out what Python does in a step.

    python benchmarks/smooth_triangles.py [--rounds 5] [--steps 40] [--output benchmarks/results/smooth_triangles.csv]
"""

import argparse
import csv
import time
from pathlib import Path

import cairn as cn
import numpy as np

D, DT = 0.01, 2e-5
ROCK, WALL = cn.Material("rock", density=2500.0), cn.Material("wall", density=2500.0)


def sheet(n, width):
    """A square of 2 n^2 triangles in the plane z = 0."""
    x, y = np.meshgrid(np.linspace(0, width, n + 1), np.linspace(0, width, n + 1), indexing="ij")
    corner = np.ravel([[i * (n + 1) + j for j in range(n)] for i in range(n)])
    right = corner + n + 1
    halves = [np.c_[corner, right, corner + 1], np.c_[right, right + 1, corner + 1]]
    return cn.surface(np.c_[x.ravel(), y.ravel(), 0 * x.ravel()], np.concatenate(halves), WALL)


def drum(radius, length, around, along):
    """A cylinder about y of 2 around x along triangles that face inwards."""
    angle, y = np.meshgrid(2 * np.pi * np.arange(around) / around, np.linspace(0, length, along + 1), indexing="ij")
    points = np.c_[radius * np.cos(angle).ravel(), y.ravel(), radius * np.sin(angle).ravel()]
    i, j = (a.ravel() for a in np.meshgrid(np.arange(around), np.arange(along), indexing="ij"))
    at = lambda i, j: (i % around) * (along + 1) + j  # noqa: E731
    one, two, three, four = at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)
    return cn.surface(points, np.concatenate([np.c_[one, two, three], np.c_[two, four, three]]), WALL)


def simulation(centers, boundary, spin=0.0):
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    scene.add(cn.spheres(centers, D / 2, ROCK), boundary)
    law = cn.HertzMindlin(young=1e7, poisson=0.3, restitution=0.5, mu=0.5)
    scene.interact(ROCK, ROCK, law)
    scene.interact(ROCK, WALL, law)
    sim = cn.Simulation(scene, DT, cn.SmoothDEM(threads=1, energy=False), overlap="ignore")
    if spin:
        sim.drive([len(centers)], "wy", spin)  # the boundary, which follows the grains
    return sim


def lattice(nx, nz):
    grid = np.array([(i, j, k) for k in range(nz) for j in range(nx) for i in range(nx)], float) + 0.5
    return grid * D * (1 - 1e-3)


def bed(radius, length):
    """A lattice in the lower half of a drum."""
    n = int(2 * radius / D)
    grid = np.array([(i, j, k) for i in range(n) for j in range(int(length / D) - 1) for k in range(n)], float)
    grid = (grid + [0.5 - n / 2, 1.0, 0.5 - n / 2]) * 0.999 * D
    return grid[(np.hypot(grid[:, 0], grid[:, 2]) < radius - 0.499 * D) & (grid[:, 2] < -0.2 * radius)]


def groups():
    """Scenes of each group by name, the ideal one first."""
    width = 14 * D
    plane = lambda: cn.wall((0, 0, 0), (0, 0, 1), WALL)  # noqa: E731
    floor = {f"{2 * n * n} triangles": simulation(lattice(14, 14), sheet(n, width)) for n in (14, 40)}
    yield "2744 grains", {"plane": simulation(lattice(14, 14), plane()), **floor}
    grains = lattice(17, 3)
    yield "867 grains", {"plane": simulation(grains, plane()), "20000 triangles": simulation(grains, sheet(100, 17 * D))}
    radius, length = 0.12, 0.12
    bedded = bed(radius, length)
    for name, spin in (("drum", 0.0), ("turning drum", 2.0)):
        yield (
            f"{name}, {len(bedded)} grains",
            {
                "tube": simulation(bedded, cn.tube((0, 0, 0), (0, 1, 0), radius, WALL), spin),
                "100000 triangles": simulation(bedded, drum(radius, length, 500, 100), spin),
            },
        )


def timed(step, steps):
    """CPU time of each of so many steps [s]."""
    spent = []
    for _ in range(steps):
        start = time.process_time()
        step()
        spent.append(time.process_time() - start)
    return spent


def compare(sims, rounds, steps):
    """Times of a step of each scene [s], between lists by rounds and of all steps: of Simulation.step, then of the core."""
    times = {name: ([], []) for name in sims}
    sums = {name: [0.0, 0.0] for name in sims}
    for sim in sims.values():
        timed(sim.step, steps)
    for _ in range(rounds):
        for name, sim in sims.items():
            for k, step in enumerate((sim.step, lambda sim=sim: sim._core.step(DT))):
                spent = timed(step, steps)
                times[name][k].append(np.median(spent))
                sums[name][k] += sum(spent)
    return times, sums


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--steps", type=int, default=40)
    parser.add_argument("--output", type=Path)
    given = parser.parse_args()
    rows = []
    for group, sims in groups():
        times, sums = compare(sims, given.rounds, given.steps)
        ideal = next(iter(sims))
        for name in sims:
            shares = [np.array(own) / np.array(first) for own, first in zip(times[name], times[ideal], strict=True)]
            lists = [own / first for own, first in zip(sums[name], sums[ideal], strict=True)]
            figures = [1e6 * min(times[name][0])]
            for share, all_steps in zip(shares, lists, strict=True):
                figures += [np.median(share), share.min(), share.max(), all_steps]
            rows.append([group, name, *(f"{x:.2f}" for x in figures)])
            print(*rows[-1], sims[name].info["contacts"], sep=", ", flush=True)
    if given.output:
        with open(given.output, "w", newline="", encoding="utf-8") as file:
            of = ["times_ideal", "least_ratio", "most_ratio", "times_with_lists"]
            head = ["grains", "boundary", "us_a_step", *of, *(f"core_{name}" for name in of)]
            csv.writer(file, lineterminator="\n").writerows([head, *rows])


if __name__ == "__main__":
    main()
