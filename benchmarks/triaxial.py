"""What a tolerance is worth to a user: the peak of the stress and the dilation of a triaxial test, against what they cost.

python benchmarks/triaxial.py [--spheres 2000] [--steps 500] [--only TEXT]: 2,000 spheres between walls, periodic across, packed
without friction at 1 kPa, then sheared in plane strain at 50 kPa and an inertial number of 1e-3, with friction .5. Writes
benchmarks/results/triaxial.csv, a row for each setting: CPU milliseconds and sweeps of a step, steps that converged, largest
error, peak of the axial stress and the strain where it is, gain of volume and overlap at the end.
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
    sim = cn.Simulation(scene, DT, cn.NSCD(solver=cn.NLGS(tol=1e-4)))
    sides = lambda s: (s.bodies.position[place["vx"], 0], s.bodies.position[place["vz"], 2])
    moves = lambda s: s.time < 0.2 or s.energy["kinetic"] > 1e-3 * width * np.prod(sides(s))
    sim.run(while_=moves, until=3.0, progress=False)
    return sim.bodies.position[:count].copy(), radii, width, sides(sim)


def shear(pack, strategy, steps):
    """A row: what a test with this strategy found and cost."""
    centers, radii, width, sides = pack
    scene, place = box(centers, radii, width, sides, 0.5, PRESSURE, 0.05)
    sim = cn.Simulation(scene, DT, strategy, overlap="ignore")
    sim.drive([place["vz"]], "vz", -INERTIAL / (DIAMETER * math.sqrt(DENSITY / PRESSURE)) * sides[1])
    rows, converged, sweeps, error, cpu = [], 0, 0, 0.0, 0.0
    for _ in range(steps):
        begin = time.process_time()
        info = sim.step()
        cpu += time.process_time() - begin
        converged += info["status"] == "converged"
        sweeps += info["iterations"]
        error = max(error, info["error"])
        x, z = sim.bodies.position[place["vx"], 0], sim.bodies.position[place["vz"], 2]
        on_top = np.any(sim.contacts.bodies == place["vz"], axis=1)
        rows.append((1 - z / sides[1], x * z / np.prod(sides) - 1, np.abs(sim.contacts.force[on_top, 2]).sum() / (x * width)))
    strain, volume, stress = np.array(rows).T
    smooth = np.convolve(stress, np.ones(15) / 15, "valid")
    peak = int(np.argmax(smooth))
    return {
        "cpu_ms": f"{1e3 * cpu / steps:.1f}",
        "sweeps": f"{sweeps / steps:.0f}",
        "converged": f"{converged / steps:.3f}",
        "largest_error": f"{error:.1e}",
        "peak_kPa": f"{smooth[peak] / 1e3:.0f}",
        "peak_strain": f"{strain[peak + 7]:.4f}",
        "volume": f"{volume[-1]:+.4f}",
        "strain": f"{strain[-1]:.3f}",
        "overlap": f"{info['penetration']:.4f}",
    }


def settings():
    """(overlap, tolerance, strategy) of each row."""
    yield "default", "default", None
    for tol in TOLERANCES:
        solver = cn.NLGS(tol=tol)
        yield "stays", f"{tol:g}", cn.NSCD(solver=solver)
        yield "taken back beyond 0.005", f"{tol:g}", cn.NSCD(solver=solver, overlap=5e-3)
    solver = cn.NLGS(tol=1e-3)
    yield "projected", "0.001", cn.NSCD(solver=solver, project_positions=True)
    for limit in (1e-3, 2e-2):
        yield f"taken back beyond {limit:g}", "0.001", cn.NSCD(solver=solver, overlap=limit)


def main():
    """Writes the table, row by row."""
    given = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    given.add_argument("--spheres", type=int, default=2000)
    given.add_argument("--steps", type=int, default=500)
    given.add_argument("--only", default="", help="settings whose overlap and tolerance have this text")
    given.add_argument("--output", type=Path, default=HERE / "results" / "triaxial.csv")
    given = given.parse_args()
    pack, writer = packed(given.spheres), None
    with given.output.open("w", newline="") as file:
        for overlap, tol, strategy in settings():
            if given.only not in f"{overlap} {tol}":
                continue
            row = {"overlap_of": overlap, "tol": tol, **shear(pack, strategy, given.steps)}
            if writer is None:
                writer = csv.DictWriter(file, list(row))
                writer.writeheader()
            writer.writerow(row)
            file.flush()
            print(*row.values(), flush=True)


if __name__ == "__main__":
    main()
