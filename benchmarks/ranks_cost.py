"""Cost of ranks: processor time of a step over ranks in one process beside that of a run without, in turns.

    script/bench ranks_cost [--bodies 20000] [--steps 4] [--ranks 1 2]

A line for each scene: ratio of processor times a sweep (a step, of smooth balls), the least over the turns, since all else that
runs on the machine adds to it, and bytes that the largest rank holds over those of one.
"""

import argparse
import os
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")

import cairn as cn
import numpy as np

ROCK = cn.Material("rock", density=2600.0)


def box(dim, n, law):
    """Balls that lie densely in a box, about n of them."""
    side = round(n ** (1 / dim))
    rng = np.random.default_rng(1)
    x = np.stack(np.meshgrid(*[np.arange(side)] * dim, indexing="ij"), -1).reshape(-1, dim) * 0.97 + 0.5
    x += rng.uniform(-0.02, 0.02, x.shape)
    scene = cn.Scene(dim=dim, gravity=(0.0,) * (dim - 1) + (-9.81,))
    scene.interact(ROCK, ROCK, law)
    scene.add((cn.disks if dim == 2 else cn.spheres)(x, rng.uniform(0.46, 0.49, len(x)), ROCK))
    for axis in range(dim):
        scene.add(cn.wall(np.zeros(dim), np.eye(dim)[axis], ROCK))
        if axis < dim - 1:
            scene.add(cn.wall((0.97 * side + 0.1) * np.eye(dim)[axis], -np.eye(dim)[axis], ROCK))
    return scene


def scenes(n):
    sweeps = cn.NSCD(solver=cn.NLGS(tol=1e-12, max_iter=60), threads=1)
    smooth = cn.SmoothDEM(energy=False)
    yield "disks", box(2, n, cn.Coulomb(mu=0.4)), sweeps, 1e-3
    yield "spheres", box(3, n, cn.Coulomb(mu=0.4)), sweeps, 1e-3
    yield "smooth spheres", box(3, n, cn.LinearSpring(stiffness=1e7, restitution=0.5, mu=0.4)), smooth, 1e-4


def timed(sim, steps):
    """Least processor time of a step, over its sweeps [s]."""
    least = np.inf
    for _ in range(steps):
        start = time.process_time()
        sim.step()
        least = min(least, (time.process_time() - start) / max(sim.info.get("iterations") or 1, 1))
    return least


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bodies", type=int, default=20_000)
    parser.add_argument("--steps", type=int, default=4)
    parser.add_argument("--ranks", type=int, nargs="+", default=[1, 2])
    options = parser.parse_args()
    for name, scene, strategy, dt in scenes(options.bodies):
        runs = {ranks: cn.Simulation(scene, dt, strategy, overlap="ignore", ranks=ranks) for ranks in [None, *options.ranks]}
        least = {ranks: timed(sim, 1) for ranks, sim in runs.items()}
        for _ in range(options.steps):
            least = {ranks: min(least[ranks], timed(sim, 1)) for ranks, sim in runs.items()}
        held = {ranks: runs[ranks].ranks.held_bytes.max() for ranks in options.ranks}
        for ranks in options.ranks:
            print(
                f"{name}: {len(runs[None].bodies)} bodies, {ranks} ranks: {least[ranks] / least[None]:.2f} of the time without, "
                f"held {held[ranks] / held[options.ranks[0]]:.3f}"
            )


if __name__ == "__main__":
    main()
