"""Brazilian test of bonded disks: a round specimen between two plates splits along the loaded diameter.

python benchmarks/brazilian.py [--seeds 4] [--across 20] [--plot FILE]: disks grow in a periodic cell until they jam, a circle of
them is bonded (SmoothBond, strength of tension and shear alike), and two plates press it until it bears less than half of its
peak. Writes benchmarks/results/brazilian.csv, a row for each specimen: disks, bonds, peak load [N/m], strength 2 P/(pi D t) over
that of a bond, shortening at the peak, broken bonds, and the share of them in the middle third of the width. Potyondy & Cundall
(2004, Int. J. Rock Mech. Min. Sci. 41:1329) have 44.7 MPa of bonds of 157 MPa in 2D and 27.8 of 175 MPa in 3D, ratios of 0.28 and
0.16; their grains have springs in compression beside the bonds, which relieve these.
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
    ids = scene.add(
        cn.disks((grid + 0.5) * length / side, small * final, grain, velocity=0.5 * rng.normal(size=(count, 3)) * [1, 1, 0])
    )
    scene.interact(grain, grain, cn.LinearSpring(stiffness=YOUNG / 100, restitution=0.3))
    sim = cn.Simulation(scene, "stable", cn.SmoothDEM(), overlap="ignore")
    steps = 3000
    sim.grow(ids, -np.log(small) / (steps * sim.dt))
    sim.run(steps=steps, progress=False)
    sim.grow(ids, None)
    sim.run(steps=1000, progress=False)
    return sim.bodies.position % length - length / 2, sim.radii(), length


def press(across=20, seed=1, speed=0.06, strength=STRENGTH, most=0.04):
    """Loads a specimen until it bears less than half of its peak: (row, curve of shortening and load, places, bonds, broken)."""
    x, r, length = packed(across, seed)
    inside = np.linalg.norm(x, axis=1) + r < 0.45 * length
    x, r = x[inside], r[inside]
    low, high = (x[:, 1] - r).min(), (x[:, 1] + r).max()
    size = high - low
    grain, plate = cn.Material("grain", density=DENSITY), cn.Material("plate", density=DENSITY)
    scene = cn.Scene(2)
    scene.add(cn.disks(x, r, grain))
    foot = scene.add(cn.wall((0, low), (0, 1), plate, velocity=(0, speed, 0)))[0]
    head = scene.add(cn.wall((0, high), (0, -1), plate, velocity=(0, -speed, 0)))[0]
    stiffness = YOUNG / (2 * RADIUS)
    bond = cn.SmoothBond(
        normal_stiffness=stiffness, tangential_stiffness=0.4 * stiffness, tension=strength, shear=strength, mu=0.5, radius=1.0,
        within=0.15 * RADIUS, damping=0.05,
    )  # fmt: skip
    scene.interact(grain, grain, bond)
    scene.interact(grain, plate, cn.LinearSpring(stiffness=YOUNG, mu=0.3, restitution=0.5))
    sim = cn.Simulation(scene, "stable", cn.SmoothDEM(local_damping=0.3), overlap="ignore")
    sim.step()
    bonds = sim.contacts.bodies[np.all(sim.contacts.bodies < foot, axis=1)]
    curve, peak = [], 0.0
    while 2 * speed * sim.time < most * size:
        sim.run(steps=50, progress=False)
        load = 0.5 * (sim.bodies.contact_force[head, 1] - sim.bodies.contact_force[foot, 1])
        curve.append((2 * speed * sim.time / size, load))
        peak = max(peak, load)
        if load < 0.5 * peak and peak > 0.05 * strength * size:
            break
    curve = np.array(curve)
    held = np.abs(np.reshape(sim.contacts.moment, len(sim.contacts.gap))) > 0
    whole = set(map(tuple, np.sort(sim.contacts.bodies[held], axis=1).tolist()))
    broken = np.array([tuple(pair) not in whole for pair in np.sort(bonds, axis=1).tolist()])
    middle = np.abs(x[bonds].mean(axis=1)[broken, 0]) < size / 6
    ratio = 2 * peak / np.pi / size / strength
    row = {
        "seed": seed, "disks": len(x), "bonds": len(bonds), "peak": f"{peak:.0f}", "ratio": f"{ratio:.3f}",
        "shortening": f"{curve[np.argmax(curve[:, 1]), 0]:.4f}", "broken": int(broken.sum()), "middle": f"{middle.mean():.2f}",
    }  # fmt: skip
    return row, curve, (sim.bodies.position[: len(x)], r), bonds, broken


def main():
    """Writes the table, row by row."""
    given = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    given.add_argument("--seeds", type=int, default=4)
    given.add_argument("--across", type=int, default=20)
    given.add_argument("--output", type=Path, default=HERE / "results" / "brazilian.csv")
    given.add_argument("--plot", type=Path)
    given = given.parse_args()
    made = [press(given.across, seed) for seed in range(1, given.seeds + 1)]
    with given.output.open("w", newline="") as file:
        writer = csv.DictWriter(file, list(made[0][0]))
        writer.writeheader()
        writer.writerows(row for row, *_ in made)
    for row, *_ in made:
        print(*row.values())
    if given.plot:
        draw(made, given.plot)


def draw(made, path):
    """A specimen after its peak, with broken bonds in red, and the loads of all over their shortening."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.collections import EllipseCollection, LineCollection

    figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3.6), constrained_layout=True)
    _, _, (x, r), bonds, broken = made[0]
    look = dict(units="xy", transOffset=left.transData, fc="0.85", ec="0.6", lw=0.4)
    left.add_collection(EllipseCollection(2e3 * r, 2e3 * r, 0 * r, offsets=1e3 * x, **look))
    left.add_collection(LineCollection(1e3 * x[bonds[~broken]], colors="C0", lw=0.7))
    left.add_collection(LineCollection(1e3 * x[bonds[broken]], colors="C3", lw=1.6))
    left.set(aspect="equal", xlabel="x [mm]", ylabel="y [mm]")
    left.autoscale_view()
    for row, curve, *_ in made:
        right.plot(100 * curve[:, 0], float(row["ratio"]) * curve[:, 1] / curve[:, 1].max(), lw=1)
    right.set(xlabel="shortening [%]", ylabel="2 P/(pi D t) over the strength of a bond")
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main()
