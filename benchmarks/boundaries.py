"""Bodies a second that detection finds on a surface of triangles and near the wall of a tube, lists included.

    python benchmarks/boundaries.py

Writes benchmarks/results/boundaries.csv, a row for each shape and boundary: 1,600 bodies turned at random, of size 0.6 to
0.8, on rough ground of 7,200 triangles of side 1, or within 0.1 of the wall of a tube of radius 31; the contacts of a body.
"""

import csv
from pathlib import Path

import cairn as cn
import numpy as np

ROCK, GROUND = cn.Material("rock", density=1000.0), cn.Material("ground")
SIDE = 60


def boundaries(rng):
    """Boundaries by name, each with centres (1600, 3) of bodies near it."""
    x, y = np.meshgrid(np.arange(SIDE + 1.0), np.arange(SIDE + 1.0), indexing="ij")
    height = 0.15 * np.sin(1.3 * x) * np.cos(1.1 * y) + 0.03 * rng.normal(size=x.shape)
    corner = np.ravel([[i * (SIDE + 1) + j for j in range(SIDE)] for i in range(SIDE)])
    right = corner + SIDE + 1
    halves = [np.column_stack((corner, right, corner + 1)), np.column_stack((right, right + 1, corner + 1))]
    ground = cn.surface(np.column_stack((x.ravel(), y.ravel(), height.ravel())), np.concatenate(halves), GROUND)
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(2, 58, 40), np.linspace(2, 58, 40)))
    on_ground = np.column_stack((x, y, 0.15 * np.sin(1.3 * x) * np.cos(1.1 * y) + 0.42))
    angle = rng.uniform(0, 2 * np.pi, len(x))
    in_tube = np.column_stack((x, 30.6 * np.cos(angle), 30.6 * np.sin(angle)))
    return {"surface": (ground, on_ground), "tube": (cn.tube((0, 0, 0), (1, 0, 0), 31.0, GROUND), in_tube)}


def bodies(places, turns):
    where = {"rotation": turns}
    return {
        "sphere": cn.spheres(places, 0.4, ROCK),
        "capsule": cn.capsules(places, 0.3, 0.4, ROCK, **where),
        "box": cn.boxes(places, (0.6, 0.5, 0.5), ROCK, **where),
        "cylinder": cn.cylinders(places, 0.35, 0.6, ROCK, **where),
        "ellipsoid": cn.superquadrics(places, (0.4, 0.3, 0.35), (1, 1), ROCK, **where),
        "superquadric": cn.superquadrics(places, (0.4, 0.3, 0.35), (0.5, 1.4), ROCK, **where),
    }


def main():
    rng = np.random.default_rng(3)
    rows = []
    for boundary, (wall, places) in boundaries(rng).items():
        turns = rng.normal(size=(len(places), 4))
        for shape, body in bodies(places, turns / np.linalg.norm(turns, axis=1, keepdims=True)).items():
            scene = cn.Scene(3)
            scene.add(body, wall)
            scene.interact(ROCK, ROCK, None)
            scene.interact(ROCK, GROUND, cn.Coulomb(mu=0.0))
            sim = cn.Simulation(scene, 1e-12, cn.NSCD(margin=0.1, threads=1), overlap="ignore")
            best = np.inf
            for _ in range(10):
                sim.step()
                best = min(best, sim.info["seconds"]["detect_contacts"])
            rows.append([shape, boundary, round(len(places) / best), round(len(sim.contacts.gap) / len(places), 2)])
            print(*rows[-1], flush=True)
    output = Path(__file__).resolve().parent / "results" / "boundaries.csv"
    with open(output, "w", newline="") as file:
        csv.writer(file).writerows([["shape", "boundary", "bodies_a_second", "contacts_of_a_body"], *rows])


if __name__ == "__main__":
    main()
