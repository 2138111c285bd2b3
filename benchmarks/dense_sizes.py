"""Dense packs of 2,000, 20,000 and 200,000 spheres at default settings: how CPU time, sweeps and memory grow with their number.

python benchmarks/dense_sizes.py [--full] [--copies 1 2 5] [--spheres 2000] [--output FILE]: the pack of triaxial_cells.py,
sheared along x under a constant pressure along z in a periodic cell, by Coulomb's friction and wet. Copies of it beside each
other along x and y make the larger packs (10, with --full 100 too, or --copies); centres are moved at random by 1e-3 of a
radius, so that no copy repeats another. The height of the cell, and with it the shear, is the same for all. Writes
benchmarks/results/dense_sizes.csv, a row for each law and size: cpu_ratio is the CPU time a step and body over that of the
smallest pack in the same steps (the mean of two measures, whose relative difference is noise), sweeps_ratio the same of sweeps,
pressure the mean one over what is asked. The first steps, whose contacts have no impulses of a step before, are told apart in
columns of their own.
"""

import argparse
import csv
import math
import time
from pathlib import Path

import cairn as cn
import numpy as np
from cairn.run.views import core_of
from triaxial_cells import DENSITY, DIAMETER, FRICTION, INERTIAL, PRESSURE, cell, packed

HERE = Path(__file__).resolve().parent
STEPS = {1: 60, 10: 30, 100: 12}  # counted steps, by copies; 10 for other numbers
FIRST, BEFORE, DT, MOVED = 5, 100, 1e-4, 1e-3  # steps not counted; steps before the pack is copied; step [s]; share of a radius
LAWS = {
    "Coulomb": cn.Coulomb(mu=FRICTION),
    "wet": cn.Wet(force=0.1 * PRESSURE * DIAMETER**2, reach=0.02 * DIAMETER, mu=FRICTION),
}
RATE = INERTIAL / (DIAMETER * math.sqrt(DENSITY / PRESSURE))
DRIVEN = {"rate": {"xz": RATE}, "stress": {"zz": PRESSURE}}


def sheared(pack, law, steps=BEFORE):
    """Simulation of a pack after some steps of shear."""
    centers, radii, lengths = pack
    sim = cn.Simulation(cell(centers, radii, lengths, law, **DRIVEN), DT, overlap="ignore")
    sim.run(steps=steps, progress=False)
    return sim


def tiled(pack, law, copies, moved=MOVED):
    """Simulation of copies of a sheared pack, at most ten along x, the rest along y: such images have one velocity."""
    vectors = pack.cell["vectors"]
    along_x = min(copies, 10)
    counts = np.array((along_x, copies // along_x, 1))
    shifts = np.indices(counts).reshape(3, -1).T @ vectors
    places = (shifts[:, None, :] + pack.bodies.position).reshape(-1, 3)
    size = np.tile(pack.bodies.radius, len(shifts))
    places += moved * size[:, None] * np.random.default_rng(copies).uniform(-1, 1, places.shape)
    scene = cell(places, size, counts * np.diag(vectors), law, lean=float(vectors[2, 0]), **DRIVEN)
    sim = cn.Simulation(scene, DT, cn.NSCD(threads=1), overlap="ignore")
    sim.bodies.set(velocity=np.tile(pack.bodies.velocity, (len(shifts), 1)))
    return sim


def measured(sim, steps, first=FIRST):
    """(figures by column, CPU seconds a step and body, sweeps a step) of some steps after the first ones."""
    begun = [sim.step() for _ in range(first)]
    infos, stress, seconds, count = [], [], 0.0, len(sim.bodies)
    for _ in range(steps):
        begin = time.process_time()
        infos.append(sim.step())
        seconds += time.process_time() - begin
        stress.append(sim.cell["stress"][[0, 2], 2])
    stress = np.mean(stress, axis=0)
    bodies, contacts = core_of(sim).bytes()
    sweeps = np.mean([info["iterations"] for info in infos])
    figures = {
        "bodies": count,
        "contacts": infos[-1]["contacts"],
        "steps": steps,
        "converged": f"{sum(info['status'] == 'converged' for info in infos) / steps:.3f}",
        "sweeps": f"{sweeps:.1f}",
        "largest_error": f"{max(info['error'] for info in infos):.1e}",
        "overlap": f"{max(info['penetration'] for info in infos):.4f}",
        "bytes_a_body": f"{(bodies + contacts) / count:.0f}",
        "pressure": f"{stress[1] / PRESSURE:.3f}",
        "shear_over_pressure": f"{abs(stress[0]) / stress[1]:.3f}",
        "first_steps": first,
        "first_converged": sum(info["status"] == "converged" for info in begun),
        "first_sweeps": sum(info["iterations"] for info in begun),
        "first_error": f"{max(info['error'] for info in begun):.1e}",
    }
    return figures, seconds / (steps * count), sweeps


def rows(pack, sizes, before=BEFORE):
    """A row for each law and size, {copies: steps}. The smallest pack is measured before and after each, in the same steps."""
    for name, law in LAWS.items():
        ready = sheared(pack, law, before)
        for copies, steps in sizes.items():
            one, this, other = (measured(tiled(ready, law, n), steps) for n in (min(sizes), copies, min(sizes)))
            ratios = {
                "cpu_ratio": f"{2 * this[1] / (one[1] + other[1]):.2f}",
                "sweeps_ratio": f"{this[2] / one[2]:.2f}",
                "pressure_of_smallest": one[0]["pressure"],
                "noise": f"{max(one[1], other[1]) / min(one[1], other[1]) - 1:.2f}",
            }
            yield {"law": name, "copies": copies, **this[0], **ratios}


def main():
    """Writes the table, row by row."""
    given = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    given.add_argument("--full", action="store_true", help="100 copies too")
    given.add_argument("--copies", type=int, nargs="+", help="instead; above 10 in tens")
    given.add_argument("--spheres", type=int, default=2000, help="of one copy")
    given.add_argument("--output", type=Path, default=HERE / "results" / "dense_sizes.csv")
    options = given.parse_args()
    copies = options.copies or [n for n in STEPS if n < 100 or options.full]
    if any(n < 1 or n > 10 and n % 10 for n in copies):
        given.error(f"--copies {copies}: give 1 to 10, or tens")
    writer = None
    with options.output.open("w", newline="") as file:
        for row in rows(packed(options.spheres), {n: STEPS.get(n, 10) for n in copies}):
            if writer is None:
                writer = csv.DictWriter(file, list(row), lineterminator="\n")
                writer.writeheader()
            writer.writerow(row)
            file.flush()
            print(*row.values(), flush=True)


if __name__ == "__main__":
    main()
