"""Triaxial test of 2,000 spheres in a periodic cell under stress control, by NSCD and by smooth DEM from the same pack.

python benchmarks/triaxial_cells.py [--spheres 2000] [--plot FILE]: spheres packed without friction under a pressure, then
shortened along z at a constant inertial number while the cell keeps that pressure along x and y. Smooth DEM has linear springs of
`kappa` = k/(P d). Writes benchmarks/results/triaxial_cells.csv, a row for each strategy: peak of sigma_1/sigma_3 (the mean over
0.5 % of strain), the strain there, the ratio from 12 % to 15 %, gain of volume, lateral stress over what is asked, steps, CPU
seconds; and triaxial_cells_curves.csv.
"""

import argparse
import csv
import time
from pathlib import Path

import cairn as cn
import numpy as np

HERE = Path(__file__).resolve().parent
DENSITY, DIAMETER, PRESSURE, INERTIAL, FRICTION, KAPPA = 2650.0, 4e-3, 5e4, 2e-3, 0.5, 1000.0


def cell(centers, radii, lengths, law, **driven):
    """A periodic cell of spheres."""
    sand = cn.Material("sand", density=DENSITY)
    scene = cn.Scene(3, gravity=(0, 0, 0), periodic=cn.Periodic(tuple(float(x) for x in lengths), **driven))
    scene.add(cn.spheres(centers, radii, sand))
    scene.interact(sand, sand, law)
    return scene


def packed(count, seed=1):
    """Centres, radii and lengths of a dense pack under the pressure."""
    rng = np.random.default_rng(seed)
    radii = DIAMETER / 2 * rng.uniform(0.8, 1.2, count)
    edge = int(np.ceil(count ** (1 / 3)))
    pitch = 2.1 * radii.max()
    grid = np.stack(np.meshgrid(*[np.arange(edge)] * 3, indexing="ij"), -1).reshape(-1, 3)[:count]
    centers = (grid + 0.5 + rng.uniform(-0.04, 0.04, grid.shape)) * pitch
    sim = cn.Simulation(cell(centers, radii, [edge * pitch] * 3, cn.Coulomb(mu=0.0), stress=PRESSURE), 1e-4)
    sim.run(steps=800, progress=False)
    return sim.bodies.position, radii, np.diag(sim.cell["vectors"])


def shear(pack, smooth, strain=0.15, samples=300, kappa=KAPPA):
    """Strain, stress ratio, volume and lateral stress in the course of a test, its steps and CPU seconds."""
    centers, radii, lengths = pack
    rate = INERTIAL / (DIAMETER * np.sqrt(DENSITY / PRESSURE))
    spring = cn.LinearSpring(stiffness=kappa * PRESSURE * DIAMETER, restitution=0.3, mu=FRICTION)
    law = spring if smooth else cn.Coulomb(mu=FRICTION)
    driven = dict(rate={"zz": -rate}, stress={"xx": PRESSURE, "yy": PRESSURE})
    scene = cell(centers, radii, lengths, law, **driven)
    sim = cn.Simulation(scene, "stable" if smooth else 1e-4, cn.SmoothDEM() if smooth else None, overlap="ignore")
    every = max(1, round(strain / samples / rate / sim.dt))
    begin, rows = time.process_time(), []
    for _ in range(samples):
        stress = np.zeros(3)
        for _ in range(every):
            sim.step()
            stress += np.diag(sim.cell["stress"]) / every
        now = np.diag(sim.cell["vectors"])
        lateral = stress[:2].mean()
        rows.append((1 - now[2] / lengths[2], stress[2] / lateral, np.prod(now / lengths) - 1, lateral / PRESSURE))
    return np.array(rows), sim.steps, time.process_time() - begin


def figures(rows):
    """Peak, its strain, late ratio, gain of volume and mean lateral stress of a curve."""
    width = max(1, round(0.005 / (rows[-1, 0] / len(rows))))
    smooth = np.convolve(rows[:, 1], np.ones(width) / width, "same")[width // 2 : -width // 2]
    peak = int(np.argmax(smooth))
    late = rows[rows[:, 0] > 0.8 * rows[-1, 0], 1].mean()
    return smooth[peak], rows[peak + width // 2, 0], late, rows[-1, 2], rows[:, 3].mean()


def main():
    """Writes both tables."""
    given = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    given.add_argument("--spheres", type=int, default=2000)
    given.add_argument("--samples", type=int, default=300)
    given.add_argument("--output", type=Path, default=HERE / "results")
    given.add_argument("--plot", type=Path)
    given = given.parse_args()
    pack = packed(given.spheres)
    names = ("strategy", "spheres", "peak", "peak_strain", "late", "volume", "lateral", "steps", "cpu_s")
    table, curves = [], {}
    for name, smooth in (("NSCD", False), ("SmoothDEM", True)):
        rows, steps, cpu = shear(pack, smooth, samples=given.samples)
        curves[name] = rows
        told = [f"{x:.4f}" for x in figures(rows)]
        table.append((name, given.spheres, *told, steps, f"{cpu:.1f}"))
        print(*table[-1], flush=True)
    with (given.output / "triaxial_cells.csv").open("w", newline="") as file:
        csv.writer(file).writerows([names, *table])
    with (given.output / "triaxial_cells_curves.csv").open("w", newline="") as file:
        csv.writer(file).writerow(("strategy", "strain", "ratio", "volume", "lateral"))
        csv.writer(file).writerows((name, *(f"{x:.5f}" for x in row)) for name, rows in curves.items() for row in rows[::3])
    if given.plot:
        draw(curves, given.plot)


def draw(curves, path):
    """Stress ratio and volume over the strain."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(8, 3.2), constrained_layout=True)
    for name, rows in curves.items():
        axes[0].plot(rows[:, 0], rows[:, 1], label=name, lw=1)
        axes[1].plot(rows[:, 0], 100 * rows[:, 2], lw=1)
    axes[0].set(xlabel="strain", ylabel="axial over lateral stress")
    axes[1].set(xlabel="strain", ylabel="gain of volume [%]")
    axes[0].legend()
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main()
