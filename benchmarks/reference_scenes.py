"""The reference scenes with LMGC90's settings: CPU time, iterations and true error of each run beside its figures.

    python benchmarks/reference_scenes.py [SCENE...] [--tol 1e-4] [--steps N] [--threads 1]
    python benchmarks/reference_scenes.py disks2d_5000 --statistics 8     perturbed runs at tol and at tol / 100
    python benchmarks/reference_scenes.py disks2d_5000 --one-step         one step from a common state against 1e-10

The scenes are read from the folder named by CAIRN_REFERENCE_DATA. CSV on standard output.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import sys
import time
from pathlib import Path

import cairn as cn
import h5py
import numpy as np
from cairn.run.views import core_of

DATA = Path(os.environ.get("CAIRN_REFERENCE_DATA", Path(__file__).resolve().parents[2] / "shared")) / "scenes"
SCENES = ("disks2d_5000", "disks2d_20000", "spheres3d_5000")


def build(name, tol, max_iter=20000, perturbation=0.0, seed=0, threads=1, **strategy):
    """A simulation of a reference scene; positions moved at random by at most perturbation radii."""
    with h5py.File(DATA / f"{name}.h5") as file:
        positions, radii = file["positions"][:], file["radii"][:]
        meta = json.loads(file.attrs["meta_json"])
    dim = meta["dim"]
    rock = cn.Material("rock", density=meta["density"])
    shift = np.random.default_rng(seed).uniform(-1, 1, positions.shape) * perturbation * radii[:, None]
    scene = cn.Scene(dim, gravity=meta["gravity"][:dim])
    shape = cn.disks if dim == 2 else cn.spheres
    low, high = np.array(meta["box"], float).reshape(dim, 2).T
    scene.add(shape(positions + shift, radii, rock), cn.box(low, high, rock))
    scene.interact(rock, rock, cn.Coulomb(mu=meta["mu"]))
    solver = cn.NLGS(tol=tol, max_iter=max_iter)
    nscd = cn.NSCD(theta=meta["theta"], solver=solver, margin=meta["alert"], threads=threads, **strategy)
    sim = cn.Simulation(scene, meta["dt"], nscd)
    return sim, meta, (low, high)


def reference(name):
    """Rows of LMGC90's run."""
    with open(DATA / f"{name}.lmgc90.csv") as file:
        return list(csv.DictReader(file))


def run(name, tol, steps, threads):
    """One row: our run beside LMGC90's over the same steps."""
    theirs = reference(name)[:steps]
    sim, _, _ = build(name, tol, threads=threads)
    iterations, work, errors, worst, failed = 0, 0, [], 0.0, 0
    start = time.process_time()
    for _ in theirs:
        info = sim.step()
        iterations += info["iterations"]
        work += info["iterations"] * info["contacts"]
        errors.append(info["error"])
        worst = max(worst, info["worst_error"])
        failed += info["status"] != "converged"
    cpu = time.process_time() - start
    seconds = sim.info["seconds"]
    their_cpu = sum(float(r["c_total"]) for r in theirs)
    return {
        "scene": name, "tol": tol, "threads": threads, "steps": len(theirs),
        "cpu_s": round(cpu, 3), "lmgc90_cpu_s": round(their_cpu, 2),
        "ratio": round(their_cpu / cpu, 2), "iterations_mean": round(iterations / len(theirs), 1),
        "lmgc90_iterations_mean": round(np.mean([int(r["iterations"]) for r in theirs]), 1), "contacts": info["contacts"],
        "contact_iterations_per_second": f"{work / max(seconds['solve_contacts'], 1e-9):.4g}",
        "solver_share": round(seconds["solve_contacts"] / sum(seconds.values()), 3), "error_max": f"{max(errors):.3g}",
        "error_last": f"{errors[-1]:.3g}", "worst_contact_error": f"{worst:.3g}", "not_converged": failed,
        "closure": f"{sim.energy['closure'] / sim.energy['in_play']:.2g}",
    }


def figures(sim, box):
    """Solid fraction below nine tenths of the height of the packing, active contacts."""
    low, high = box
    x, r = sim.bodies.position, sim.bodies.radius
    grains = r > 0
    x, r = x[grains], r[grains]
    top = low[-1] + 0.9 * (np.quantile(x[:, -1], 0.99) - low[-1])
    sliced = np.clip((top - x[:, -1]) / r, -1, 1)
    if len(low) == 2:
        volume = np.sum(r**2 * (np.pi / 2 + sliced * np.sqrt(1 - sliced**2) + np.arcsin(sliced)))
    else:
        volume = np.sum(np.pi * r**3 * (2 / 3 + sliced - sliced**3 / 3))
    room = np.prod(high[:-1] - low[:-1]) * (top - low[-1])
    impulse = np.linalg.norm(sim.contacts.impulse, axis=1)
    return volume / room, int(np.count_nonzero(impulse))


def statistics(name, tol, steps, runs):
    """Rows of perturbed runs at tol and tol / 100."""
    for accuracy in (tol, tol / 100):
        for seed in range(runs):
            sim, _, box = build(name, accuracy, perturbation=1e-3, seed=seed)
            start = time.process_time()
            failed = sum(sim.step()["status"] != "converged" for _ in range(steps))
            fraction, active = figures(sim, box)
            yield {"scene": name, "tol": accuracy, "seed": seed, "steps": steps,
                   "solid_fraction": fraction, "active_contacts": active,
                   "not_converged": failed, "cpu_s": round(time.process_time() - start, 2)}


def one_step(name, tol, steps):
    """Rows: velocities after one step from a common state, by several solvers and tolerances against NLGS at 1e-10."""
    sim, meta, _ = build(name, tol)
    for _ in range(steps):
        sim.step()
    state = core_of(sim).get_state()

    def step(solver):
        other = cn.Simulation(sim.scene, sim.dt, cn.NSCD(theta=meta["theta"], solver=solver, margin=meta["alert"], threads=1))
        core_of(other).set_state(state)
        start = time.process_time()
        info = other.step()
        return other.bodies.velocity[:, : sim.scene.dim], info, time.process_time() - start

    exact, tight, _ = step(cn.NLGS(tol=1e-10, max_iter=2_000_000))
    scale = np.sqrt(np.mean(np.sum(exact**2, axis=1)))
    solvers = [cn.NLGS(tol=tol / 10**k, max_iter=200_000) for k in range(3)]
    solvers += [cn.AcceleratedGradient(tol=tol, max_iter=2000), cn.ADMM(tol=tol, max_iter=500)]
    if sim.scene.dim == 2:  # of dense spheres its factors fill up
        solvers.append(cn.PPANewton(tol=tol))
    for solver in solvers:
        velocity, info, seconds = step(solver)
        difference = velocity - exact
        rms = np.sqrt(np.mean(np.sum(difference**2, axis=1)))
        yield {"scene": name, "after_steps": steps, "solver": type(solver).__name__, "tol": solver.tol,
               "iterations": info["iterations"], "error": f"{info['error']:.3g}", "error_tight": f"{tight['error']:.3g}",
               "rms_velocity": f"{scale:.4g}", "relative_to_rms_velocity": f"{rms / scale:.3g}",
               "relative_to_dt_g": f"{rms / (sim.dt * 9.81):.3g}",
               "largest_difference": f"{np.abs(difference).max():.3g}", "cpu_s": round(seconds, 2)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=SCENES)
    parser.add_argument("--tol", type=float, default=1e-4)
    parser.add_argument("--steps", type=int, help="at most; as many as LMGC90 ran when not given")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--statistics", type=int, metavar="RUNS")
    parser.add_argument("--one-step", action="store_true")
    options = parser.parse_args()
    writer = None
    for name in options.scenes or SCENES:
        steps = options.steps or len(reference(name))
        if options.statistics:
            rows = statistics(name, options.tol, steps, options.statistics)
        elif options.one_step:
            rows = one_step(name, options.tol, options.steps or 50)
        else:
            rows = [run(name, options.tol, options.steps, options.threads)]
        for row in rows:
            if writer is None:
                writer = csv.DictWriter(sys.stdout, row)
                writer.writeheader()
            writer.writerow(row)
            sys.stdout.flush()


if __name__ == "__main__":
    main()
