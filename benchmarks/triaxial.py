"""Peak stress and dilation of a triaxial test for several tolerances of the solver, beside their cost.

python benchmarks/triaxial.py [--spheres 2000] [--steps 500] [--only TEXT] [--plot FILE]: 2,000 spheres between walls, periodic
across, packed without friction at 1 kPa, then sheared in plane strain at constant pressure and inertial number (below). Writes
benchmarks/results/triaxial.csv, a row for each setting: CPU milliseconds and sweeps of a step, steps that converged,
largest error, peak of the axial stress and the strain where it is, gain of volume, overlap at the end and the deepest on the way.
"""

import argparse
import csv
import math
import time
from pathlib import Path

import cairn as cn
import numpy as np

HERE = Path(__file__).resolve().parent
DENSITY, DIAMETER, PRESSURE, INERTIAL, DT = 2650.0, 4e-3, 5e4, 1e-3, 2e-4
TOLERANCES = (1e-2, 3e-3, 1e-3, 3e-4)
PATIENCE = (10, 20, 50, 100, 200)


def box(centers, radii, width, sides, friction, pressure, inertia):
    """Grains between two fixed walls, of x and of z, and two that a pressure pushes; `inertia`: their mass over the grains'."""
    sand, plate = cn.Material("sand", density=DENSITY), cn.Material("plate", density=DENSITY)
    scene = cn.Scene(3, gravity=(0, 0, 0), periodic=cn.Periodic(lengths=(np.inf, width, np.inf)))
    scene.add(cn.spheres(centers, radii, sand))
    scene.add(cn.wall((0, 0, 0), (1, 0, 0), plate), cn.wall((0, 0, 0), (0, 0, 1), plate))
    mass, place = inertia * DENSITY * np.sum(4 / 3 * np.pi * radii**3), {}
    for free, other, axis in (("vx", "vz", 0), ("vz", "vx", 2)):
        normal = -np.eye(3)[axis]
        across = lambda sim, other=other: width * sim.bodies.position[sim.bodies.id == place[other], 2 if other == "vz" else 0][0]
        push = cn.Servo(pressure, normal, area=across)
        wall = cn.wall(-normal * sides[axis // 2], normal, plate, mass=mass, free=free, force=push)
        place[free] = int(scene.add(wall)[0])
    scene.interact(sand, sand, cn.Coulomb(mu=friction))
    scene.interact(sand, plate, cn.Frictionless())
    return scene, place


def packed(count, seed=1):
    """Centres, radii, width and sides of a dense pack."""
    rng = np.random.default_rng(seed)
    radii = cn.pre.grains.lognormal(count, DIAMETER / 2, 0.25, rng=rng, smallest=0.3 * DIAMETER, largest=0.8 * DIAMETER)
    width = (np.sum(4 / 3 * np.pi * radii**3) / 0.45) ** (1 / 3)
    pitch, edge = 2.3 * radii.max(), math.ceil(count ** (1 / 3))
    grid = np.array([(i, j, k) for k in range(3 * edge) for j in range(int(width // pitch)) for i in range(edge)], float)[:count]
    centers = (grid + 0.5 + rng.uniform(-0.07, 0.07, grid.shape)) * pitch
    scene, place = box(centers, radii, width, (edge * pitch, (grid[:, 2].max() + 1) * pitch), 0.0, 1e3, 1.0)
    sim = cn.Simulation(scene, DT)
    sides = lambda s: (s.bodies.position[place["vx"], 0], s.bodies.position[place["vz"], 2])
    moves = lambda s: s.time < 0.2 or s.energy["kinetic"] > 1e-3 * width * np.prod(sides(s))
    sim.run(while_=moves, until=3.0, progress=False)
    return sim.bodies.position[:count].copy(), radii, width, sides(sim)


def tested(pack, strategy, steps, dt=DT):
    """Rows of (strain, gain of volume, axial stress [Pa]) of a test with this strategy, and what its steps cost, by name."""
    centers, radii, width, sides = pack
    scene, place = box(centers, radii, width, sides, 0.5, PRESSURE, 0.05)
    sim = cn.Simulation(scene, dt, strategy, overlap="ignore")
    sim.drive([place["vz"]], "vz", -INERTIAL / (DIAMETER * math.sqrt(DENSITY / PRESSURE)) * sides[1])
    rows, converged, sweeps, error, cpu, deepest = [], 0, 0, 0.0, 0.0, 0.0
    for _ in range(steps):
        begin = time.process_time()
        info = sim.step()
        cpu += time.process_time() - begin
        converged += info["status"] == "converged"
        sweeps += info["iterations"]
        error = max(error, info["error"])
        deepest = max(deepest, info["penetration"])
        x, z = sim.bodies.position[place["vx"], 0], sim.bodies.position[place["vz"], 2]
        on_top = np.any(sim.contacts.bodies == place["vz"], axis=1)
        rows.append((1 - z / sides[1], x * z / np.prod(sides) - 1, np.abs(sim.contacts.force[on_top, 2]).sum() / (x * width)))
    cost = {
        "cpu_ms": f"{1e3 * cpu / steps:.1f}",
        "sweeps": f"{sweeps / steps:.0f}",
        "converged": f"{converged / steps:.3f}",
        "largest_error": f"{error:.1e}",
    }
    overlap = {"overlap": f"{info['penetration']:.4f}", "deepest": f"{deepest:.4f}"}
    return np.array(rows), cost, overlap


def smoothed(rows, window=15):
    """Strain and axial stress [Pa], the mean of so many steps."""
    half = window // 2
    return rows[half : len(rows) - half, 0], np.convolve(rows[:, 2], np.ones(window) / window, "valid")


def shear(pack, strategy, steps):
    """A row: what a test with this strategy found and cost."""
    rows, cost, overlap = tested(pack, strategy, steps)
    strain, stress = smoothed(rows)
    peak = int(np.argmax(stress))
    return {
        **cost,
        "peak_kPa": f"{stress[peak] / 1e3:.0f}",
        "peak_strain": f"{strain[peak]:.4f}",
        "volume": f"{rows[-1, 1]:+.4f}",
        "strain": f"{rows[-1, 0]:.3f}",
        **overlap,
    }


def settings():
    """(overlap, tolerance, patience, strategy) of each row."""
    yield "default", "default", "default", None
    for tol in TOLERANCES:
        solver = cn.NLGS(tol=tol)
        yield "stays", f"{tol:g}", "0", cn.NSCD(solver=solver)
        yield "taken back beyond 0.005", f"{tol:g}", "0", cn.NSCD(solver=solver, overlap=5e-3)
    for patience in PATIENCE:
        solver = cn.NLGS(enough=1e-3, patience=patience)
        yield "taken back beyond 0.005", "0.001", f"{patience}", cn.NSCD(solver=solver, overlap=5e-3)
    yield "stays", "0.001", "50", cn.NSCD(solver=cn.NLGS(enough=1e-3, patience=50))
    yield "projected", "0.001", "0", cn.NSCD(solver=cn.NLGS(tol=1e-3), project_positions=True)
    yield "stays", "0.0001", "0", cn.NSCD(solver=cn.NLGS(tol=1e-4))


def draw(rows, path):
    """Peak and gain of volume against CPU milliseconds of a step, by what becomes of overlap."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), constrained_layout=True)
    marks = {"stays": "o", "taken back beyond 0.005": "s", "projected": "^", "default": "*"}
    for axis, key, right, name in zip(axes, ("peak_kPa", "volume"), ((150, 185), (4, 7)), ("peak [kPa]", "gain of volume [%]")):
        axis.axhspan(*right, color="0.9")
        for kind, mark in marks.items():
            own = [r for r in rows if r["overlap_of"] == kind]
            late = [key == "peak_kPa" and float(r["peak_strain"]) > 0.035 for r in own]
            value = [float(r[key]) * (100 if key == "volume" else 1) for r in own]
            colors = ["none" if hollow else f"C{list(marks).index(kind)}" for hollow in late]
            axis.scatter([float(r["cpu_ms"]) for r in own], value, marker=mark, s=70 if kind == "default" else 30,
                         facecolors=colors, edgecolors=f"C{list(marks).index(kind)}", label=kind)  # fmt: skip
        axis.set(xscale="log", xlabel="CPU ms a step", ylabel=name)
    axes[0].legend(fontsize=8)
    figure.savefig(path, dpi=110)


def main():
    """Writes the table, row by row."""
    given = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    given.add_argument("--spheres", type=int, default=2000)
    given.add_argument("--steps", type=int, default=500)
    given.add_argument("--only", default="", help="settings whose overlap and tolerance have this text")
    given.add_argument("--output", type=Path, default=HERE / "results" / "triaxial.csv")
    given.add_argument("--plot", type=Path, help="picture of the table, such as docs/images/study_triaxial.png")
    given = given.parse_args()
    pack, writer, rows = packed(given.spheres), None, []
    with given.output.open("w", newline="") as file:
        for overlap, tol, patience, strategy in settings():
            if given.only not in f"{overlap} {tol} {patience}":
                continue
            row = {"overlap_of": overlap, "tol": tol, "patience": patience, **shear(pack, strategy, given.steps)}
            rows.append(row)
            if writer is None:
                writer = csv.DictWriter(file, list(row))
                writer.writeheader()
            writer.writerow(row)
            file.flush()
            print(*row.values(), flush=True)
    if given.plot:
        draw(rows, given.plot)


if __name__ == "__main__":
    main()
