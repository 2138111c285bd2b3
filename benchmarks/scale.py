"""A million disks and 200,000 spheres, settled by gravity for 100 steps: CPU and wall seconds, memory, error, energy.

    script/bench scale [--disks 1000000] [--spheres 200000] [--steps 100] [--threads 2]
"""

import argparse
import csv
import resource
import sys
import time

import cairn as cn
import numpy as np
from cairn.run.views import core_of


def lattice(case, count, threads):
    """Bodies a little apart on a jittered lattice in a box: they fall, meet and settle."""
    rng = np.random.default_rng(1)
    dim = 2 if case == "disks" else 3
    side = int(np.ceil(count ** (1 / dim)))
    radii = rng.uniform(0.004, 0.005, count)
    grid = np.stack(np.meshgrid(*[np.arange(side)] * dim, indexing="ij"), -1).reshape(-1, dim)
    grid = grid[np.argsort(grid[:, -1], kind="stable")][:count]
    centers = (grid + 0.5 + rng.uniform(-0.01, 0.01, grid.shape)) * 0.0103
    rock = cn.Material("rock", density=2600.0)
    down = np.zeros(dim)
    down[-1] = -9.81
    scene = cn.Scene(dim, gravity=down)
    shape = cn.disks if dim == 2 else cn.spheres
    scene.add(shape(centers, radii, rock), cn.box(np.zeros(dim), np.full(dim, side * 0.0103), rock, lid=False))
    scene.interact(rock, rock, cn.Coulomb(mu=0.4))
    return cn.Simulation(scene, 1e-3, cn.NSCD(solver=cn.NLGS(tol=1e-3, max_iter=200), threads=threads))


def measure(case, count, steps, threads):
    """A row for one scene."""
    start, wall = time.process_time(), time.perf_counter()
    sim = lattice(case, count, threads)
    made = time.process_time() - start
    iterations, worst = 0, 0.0
    for _ in range(steps):
        info = sim.step()
        iterations += info["iterations"]
        worst = max(worst, info["error"])
    bodies, contacts = core_of(sim).bytes()
    return {"case": case, "bodies": count, "threads": threads, "steps": steps, "contacts": info["contacts"],
            "status": info["status"], "iterations_mean": round(iterations / steps, 1), "error_max": f"{worst:.3g}",
            "penetration": f"{info['penetration']:.3g}",
            "closure": f"{sim.energy['closure'] / sim.energy['in_play']:.2g}", "setup_cpu_s": round(made, 1),
            "cpu_s": round(time.process_time() - start, 1), "wall_s": round(time.perf_counter() - wall, 1),
            "counted_mb": round((bodies + contacts) / 1e6),
            "peak_mb": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--disks", type=int, default=1_000_000)
    parser.add_argument("--spheres", type=int, default=200_000)
    parser.add_argument("--steps", type=int, default=100)
    parser.add_argument("--threads", type=int, default=2)
    options = parser.parse_args()
    writer = None
    for case, count in (("spheres", options.spheres), ("disks", options.disks)):
        row = measure(case, count, options.steps, options.threads)
        if writer is None:
            writer = csv.DictWriter(sys.stdout, row)
            writer.writeheader()
        writer.writerow(row)
        sys.stdout.flush()


if __name__ == "__main__":
    main()
