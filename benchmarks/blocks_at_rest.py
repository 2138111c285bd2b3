"""Blocks that should stay where they are: stacks under a heavy cube, a cube on a slope, a wall and a random pile for long.

    python benchmarks/blocks_at_rest.py [stack] [slope] [wall] [pile] [--steps 100000]

Writes benchmarks/results/blocks_at_rest.csv, a row for each case: drift (largest move across gravity) and sinking (largest move
along it) over the height of a block, the largest speed at the end [m/s], the largest error, steps not converged, CPU seconds.
"""

import argparse
import csv
import time
from pathlib import Path

import cairn as cn
import numpy as np

HERE = Path(__file__).resolve().parent
ROCK = cn.Material("rock", density=1.0)
G = 9.81


def stack(ratio):
    """20 unit cubes, the top one `ratio` times as heavy, 10 s."""
    scene = cn.Scene(3, gravity=(0, 0, -G))
    places = np.array([[0, 0, k + 0.5] for k in range(20)])
    scene.add(cn.boxes(places[:19], 1.0, ROCK), cn.boxes(places[19:], 1.0, ROCK, density=ratio), floor())
    return simulation(scene, 1 / 240, cn.PPANewton(tol=max(1e-15, 1e-8 / ratio), max_iter=100))


def slope(tangent):
    """A cube of 0.8 m, mu 0.5, on a slope: 5 s."""
    angle = np.arctan(tangent)
    scene = cn.Scene(3, gravity=(G * np.sin(angle), 0, -G * np.cos(angle)))
    scene.add(cn.boxes([[0, 0, 0.4]], 0.8, ROCK), floor())
    return simulation(scene, 1e-2, cn.NLGS(tol=1e-10, max_iter=10000))


def wall(project):
    """Four courses of bricks in running bond, on a floor."""
    scene = cn.Scene(3, gravity=(0, 0, -G))
    for course in range(4):
        edges = np.unique(np.clip(np.arange(-course % 2 * 0.5, 4.0, 1.0), 0, 3))
        length = np.diff(edges)
        centres = np.column_stack((edges[:-1] + length / 2, 0 * length, 0 * length + 0.4 * course + 0.2))
        scene.add(cn.boxes(centres, np.column_stack((length, 0 * length + 0.5, 0 * length + 0.4)), ROCK))
    scene.add(floor())
    return simulation(scene, 1e-3, cn.PPANewton(tol=1e-10, max_iter=100), project_positions=project)


def pile(steps=2000, n=24):
    """Random polyhedra dropped into a box, once they have come to rest."""
    from scipy.spatial import ConvexHull

    rng = np.random.default_rng(3)
    meshes = []
    for k in range(n):
        v = rng.normal(size=(10, 3))
        v = 0.3 * v / np.linalg.norm(v, axis=1, keepdims=True)
        hull = ConvexHull(v)
        faces = hull.simplices.copy()
        inward = np.einsum("ij,ij->i", np.cross(v[faces[:, 1]] - v[faces[:, 0]], v[faces[:, 2]] - v[faces[:, 0]]),
                           hull.equations[:, :3]) < 0
        faces[inward] = faces[inward][:, ::-1]
        used = np.unique(faces)
        meshes.append((v[used] + [0.6 * (k % 2), 0.6 * (k // 2 % 2), 0.4 + 0.65 * (k // 4)], np.searchsorted(used, faces)))
    scene = cn.Scene(3, gravity=(0, 0, -G))
    scene.add(cn.polyhedra(meshes, ROCK), floor())
    for axis in (0, 1):
        for sign in (1, -1):
            normal = np.eye(3)[axis] * sign
            scene.add(cn.wall(0.3 - 0.7 * normal * [1, 1, 0], normal, ROCK))
    sim = simulation(scene, 2e-3, cn.Auto(tol=1e-9))
    sim.run(steps=steps, progress=False)
    return sim


def floor():
    return cn.wall((0, 0, 0), (0, 0, 1), ROCK)


def simulation(scene, dt, solver, **options):
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.5))
    return cn.Simulation(scene, dt, cn.NSCD(solver=solver, threads=1, **options))


def watch(name, sim, steps, height=1.0):
    """A row: drift, sinking and speed of the free bodies over the steps."""
    start = sim.bodies.position
    begin, worst, failed = time.process_time(), 0.0, 0
    for _ in range(steps):
        info = sim.step()
        worst = max(worst, info["error"])
        failed += info["status"] != "converged"
    moved = sim.bodies.position - start
    return {
        "case": name, "steps": steps, "contacts": len(sim.contacts.gap),
        "drift": f"{np.abs(moved[:, :2]).max() / height:.3g}", "sinking": f"{max(0.0, -moved[:, 2].min()) / height:.3g}",
        "rise": f"{max(0.0, moved[:, 2].max()) / height:.3g}", "speed": f"{np.abs(sim.bodies.velocity).max():.3g}",
        "largest_error": f"{worst:.2g}", "not_converged": failed, "cpu_s": f"{time.process_time() - begin:.4g}",
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", nargs="*", default=["stack", "slope", "wall", "pile"])
    parser.add_argument("--steps", type=int, default=100000)
    options = parser.parse_args()
    runs = {
        "stack": [(f"stack of 20, top {m:g}", lambda m=m: stack(m), 2400, 1.0) for m in (1.0, 1e3, 1e6, 1e12)],
        "slope": [(f"cube on a slope of {t}", lambda t=t: slope(t), 500, 1.0) for t in (0.49, 0.51)],
        "wall": [(f"wall, project_positions={p}", lambda p=p: wall(p), options.steps, 0.4) for p in (False, True)],
        "pile": [("random pile at rest", pile, options.steps, 0.6)],
    }
    out = HERE / "results" / "blocks_at_rest.csv"
    rows = {r["case"]: r for r in csv.DictReader(out.open())} if out.exists() else {}
    for case in options.cases:
        for name, build, steps, height in runs[case]:
            rows[name] = watch(name, build(), steps, height)
            print(rows[name], flush=True)
    with out.open("w", newline="") as file:
        writer = csv.DictWriter(file, next(iter(rows.values())), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows.values())


if __name__ == "__main__":
    main()
