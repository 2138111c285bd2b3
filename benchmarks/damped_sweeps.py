"""Sweeps of packs whose extrapolated sweeps cycle: how the factor of the plain sweeps that follow them changes what converges.

python benchmarks/damped_sweeps.py [--factors 1 0.9 0.75 0.6]: wet spheres that fall into a tube, and slump as it is lifted
(1,000 spheres, 3,000 steps), and a drum of clumps of three (500 steps), at default settings but for the number
relaxation_damped of docs/policy.md. Writes benchmarks/results/sweeps_damped.csv, a row for each scene and factor: steps, those
that converged, the largest error, sweeps a step, and CPU time over that of factor 1.
"""

import argparse
import csv
import os
import subprocess
import sys
import time
from pathlib import Path

import cairn as cn
import numpy as np

HERE = Path(__file__).resolve().parent


def wet():
    """Simulation, its steps, and a function to call after half of them: spheres with liquid bridges in a tube, which it lifts."""
    powder, plate, glass = (cn.Material(name, density=1500.0) for name in ("powder", "plate", "glass"))
    rng, tube = np.random.default_rng(1), 0.012
    radii = cn.pre.grains.uniform(1000, 0.8e-3, 1.2e-3, rng=rng)
    grid = np.array([(i, j, k) for k in range(60) for i in range(-5, 6) for j in range(-5, 6)], float) * 2.5e-3
    grid = grid[np.hypot(grid[:, 0], grid[:, 1]) < tube - 1.4e-3][: len(radii)]
    scene = cn.Scene(dim=3, gravity=(0, 0, -9.81))
    scene.add(cn.spheres(grid + rng.uniform(-3e-5, 3e-5, grid.shape) + [0, 0, 1.5e-3], radii, powder))
    scene.add(cn.wall((0, 0, 0), (0, 0, 1), plate))
    ids = scene.add(cn.tube((0, 0, 0.1), (0, 0, 1), tube, glass, half_length=0.1))
    scene.interact(powder, powder, cn.Wet(force=5e-5, reach=1e-4, mu=0.5))
    scene.interact(powder, plate, cn.Coulomb(mu=0.9))
    scene.interact(powder, glass, cn.Coulomb(mu=0.1))
    return cn.Simulation(scene, 2e-4), 3000, lambda sim: sim.drive(ids, "vz", 0.1)


def drum():
    """The same of a drum, half full of clumps."""
    r, radius, width = 0.004, 0.1, 0.04
    sand, steel = cn.Material("sand", density=2500.0), cn.Material("steel", density=7800.0)
    scene = cn.Scene(dim=3, gravity=(0, 0, -9.81), periodic=cn.Periodic(lengths=(0, width, 0)))
    one = cn.pre.clump([[-0.7 * r, 0, 0], [0.7 * r, 0, 0], [0, 0, 0.6 * r]], [r, r, 0.8 * r], sand.density)
    rng = np.random.default_rng(0)
    places = range(-5, 6)
    x = np.array([(4.2 * r * i, (j + 0.5) * width / 2, 4.2 * r * k) for k in places for j in range(2) for i in places])
    x += rng.uniform(-1e-4, 1e-4, x.shape)
    x = x[np.hypot(x[:, 0], x[:, 2]) < radius - 2.2 * r]
    half = rng.uniform(0, np.pi, len(x))
    turned = np.column_stack((np.cos(half), 0 * half, np.sin(half), 0 * half))
    scene.add(cn.clumps(x, one.offsets, one.radii, one.mass, one.inertia, sand, rotation=turned))
    scene.add(cn.tube((0, 0, 0), (0, 1, 0), radius, steel, velocity=(0, 0, 0, 0, np.pi, 0)))
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    return cn.Simulation(scene, 5e-4), 500, lambda sim: None


SCENES = {"wet": wet, "drum": drum}


def run(name):
    """Figures of a scene, by name."""
    sim, steps, halfway = SCENES[name]()
    converged, sweeps, error, begin = 0, 0, 0.0, time.process_time()
    for k in range(steps):
        if k == steps // 2:
            halfway(sim)
        info = sim.step()
        converged += info["status"] == "converged"
        sweeps += info["iterations"]
        error = max(error, info["error"])
    return steps, converged, f"{error:.1e}", f"{sweeps / steps:.1f}", time.process_time() - begin


def main():
    given = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    given.add_argument("--factors", nargs="+", default=["1", "0.9", "0.75", "0.6"])
    given.add_argument("--output", type=Path, default=HERE / "results" / "sweeps_damped.csv")
    given.add_argument("--one", choices=SCENES, help="prints the figures of one scene")
    given = given.parse_args()
    if given.one:
        print(*run(given.one), flush=True)
        return
    with given.output.open("w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(("scene", "factor", "steps", "converged", "largest_error", "sweeps_a_step", "cpu_over_that_of_the_first"))
        for name in SCENES:
            first = None
            for factor in given.factors:
                environment = {**os.environ, "CAIRN_POLICY": f"relaxation_damped={factor}"}
                command = [sys.executable, __file__, "--one", name]
                out = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True).stdout.split()
                first = first or float(out[-1])
                table.writerow([name, factor, *out[:-1], f"{float(out[-1]) / first:.2f}"])
                file.flush()
                print(name, factor, *out, flush=True)


if __name__ == "__main__":
    main()
