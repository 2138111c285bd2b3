"""Sweeps plain and extrapolated, and the accuracy that a user names: one step from a common state each.

    python benchmarks/sweeps.py families [--seeds 3]    kinds of contacts, frictions, mass ratios, at rest and in motion
    python benchmarks/sweeps.py dense [--count 20000]   deposits at rest, from nothing and from the last step's impulses
        [--cases disks spheres]                         those of other counts or cases stay; above 20,000 to 1e-6 alone
    python benchmarks/sweeps.py accuracy                NSCD(accuracy=...) against the same step solved at least 100 times tighter
        [--scenes NAME...]                              these alone: rows of others stay
    python benchmarks/sweeps.py motion [--count 20000]  a hopper and a drum that move: how many steps come to 1e-4 and 1e-6

Writes benchmarks/results/sweeps_PART.csv. CPU seconds are those of the whole step, on one thread.
"""

import argparse
import csv
import tempfile
import time
from pathlib import Path

import cairn as cn
import numpy as np
import reference_scenes
import reference_wall
from dense import at_rest
from meshes import blocks
from study import flow, wall

HERE = Path(__file__).resolve().parent
ROCK = cn.Material("rock", density=2500.0)


def grains(dim, count, seed, mu=0.4, ratio=1.0, law=None, shape="round"):
    """A deposit of grains in a box; every other one ratio times as heavy."""
    rng = np.random.default_rng(seed)
    radii = rng.uniform(0.005, 0.01, count)
    heavy = rng.random(count) < 0.5
    light, dense = ROCK, cn.Material("dense", density=2500.0 * ratio)
    scene = cn.Scene(dim, gravity=-9.81 * np.eye(dim)[-1])
    if dim == 2:
        width = np.sqrt(np.sum(np.pi * radii**2) / 0.8)
        x = cn.pre.deposit_disks(radii, width)
    else:
        width = np.cbrt(np.sum(4 / 3 * np.pi * radii**3) / 0.55)
        x = cn.pre.deposit_spheres(radii, (width, width))
    for material, which in ((light, ~heavy), (dense, heavy)) if ratio > 1 else ((light, np.ones(count, bool)),):
        if shape == "round":
            scene.add((cn.disks if dim == 2 else cn.spheres)(x[which], radii[which], material))
        elif dim == 3:
            scene.add(cn.boxes(x[which], 1.1 * radii[which, None] * np.ones(3), material))
        else:
            angle = np.arange(5) * 2 * np.pi / 5
            corners = np.column_stack((np.cos(angle), np.sin(angle)))
            scene.add(cn.polygons([r * corners for r in radii[which]], material, position=x[which]))
    scene.add(cn.box(np.zeros(dim), np.r_[[width] * (dim - 1), 2 * width], ROCK, lid=False))
    scene.interact("*", "*", law or cn.Coulomb(mu=mu))
    return scene


def families(seed):
    """(name, simulation, steps that move it)."""

    def sim(scene, dt=5e-4):
        return cn.Simulation(scene, dt, cn.NSCD(solver=cn.NLGS(tol=1e-4, max_iter=500), threads=1), overlap="ignore")

    for dim, count in ((2, 1000), (3, 1000)):
        for mu in (0.0, 0.1, 0.4, 1.0, 2.0):
            yield f"{dim}D mu {mu}", sim(grains(dim, count, seed, mu)), (10, 200)
        for ratio in (1e2, 1e4, 1e6, 1e12):
            yield f"{dim}D mass ratio {ratio:g}", sim(grains(dim, count, seed, ratio=ratio)), (10, 100)
        yield f"{dim}D polyhedra", sim(grains(dim, 300, seed, shape="faced"), 1e-3), (60, 200)
    yield "2D bonds", sim(grains(2, 1000, seed, law=cn.Bonded(mu=0.4))), (10, 100)
    yield "2D periodic shear", sim(flow.build(disks=500, seed=seed)), (20, 200)
    for case in ("Q4 on another", "H8 on another"):
        elastic = blocks(case, 64)
        elastic.strategy = cn.NSCD(solver=cn.NLGS(tol=1e-4, max_iter=500), threads=1)
        yield f"elastic {case}", elastic, (10, 50)


def one_step(sim, path, acceleration, tol, warm, most=5000):
    """Columns of a step from the state in path. acceleration: none, nesterov, or associated: that from an associated start."""
    sim.restore(path)
    start = acceleration == "associated"
    how = {"acceleration": "nesterov" if start else acceleration, "associated_start": start}
    sim.strategy = cn.NSCD(solver=cn.NLGS(tol=tol, max_iter=most, **how), threads=1, warm_start=warm)
    before = time.process_time()
    info = sim.step()
    return {
        "tol": tol, "warm_start": warm, "acceleration": acceleration, "contacts": info["contacts"], "status": info["status"],
        "sweeps": info["iterations"], "error": f"{info['error']:.3g}", "cpu_seconds": f"{time.process_time() - before:.4g}",
    }  # fmt: skip


def rows_of_families(folder, options):
    path = folder / "state.h5"
    for seed in range(1, options.seeds + 1):
        for name, sim, moments in families(seed):
            done = 0
            for steps in moments:
                for _ in range(steps - done):
                    sim.step()
                done = steps
                sim.checkpoint(path)
                strategy = sim.strategy
                for tol in (1e-4, 1e-6):
                    for acceleration in ("none", "nesterov"):
                        yield {
                            "family": name,
                            "seed": seed,
                            "after_steps": steps,
                            **one_step(sim, path, acceleration, tol, False),
                        }
                sim.restore(path)
                sim.strategy = strategy


def rows_of_dense(folder, options):
    """Rows of dense deposits; the rms speed of grains is given over g h, the speed gained in a step of free fall."""
    large = options.count > 20000
    for case in options.cases:
        sim = at_rest(case, options.count)
        free, dim = np.isfinite(sim.bodies.mass), sim.scene.dim
        speed = np.sqrt(np.mean(np.sum(sim.bodies.velocity[free, :dim] ** 2, axis=1))) / (9.81 * sim.dt)
        path = folder / f"{case}.h5"
        sim.checkpoint(path)
        for warm in (True, False):
            for tol in (1e-6,) if large else (1e-4, 1e-6, 1e-8):
                for acceleration in ("none", "nesterov", "associated")[large or tol < 1e-6 : 2 if warm else 3]:
                    row = one_step(sim, path, acceleration, tol, warm, 12000)
                    yield {"scene": case, "grains": options.count, "speed": f"{speed:.2g}", **row}


def hopper_and_drum(count):
    """(name, simulation, steps that move it): 1,000 grains in 0.4 m and in a drum of 1 m, more in larger ones."""
    size = np.sqrt(count / 1000)
    for name, dt, steps in (("hopper", 5e-4, 300), ("drum", 1e-3, 400)):
        scene = cn.Scene(2, gravity=(0, -9.81))
        radii = np.random.default_rng(1).uniform(0.005, 0.01, count)
        if name == "hopper":
            x = cn.pre.deposit_disks(radii, 0.4 * size) + (0, 0.25 * size)
            ends = size * np.array([[(-0.1, 0.25), (0.17, 0.1)], [(0.5, 0.25), (0.23, 0.1)]])
            sides = [cn.segment(*pair, ROCK, radius=0.005) for pair in ends]
            scene.add(*sides, cn.wall((0, 0), (1, 0), ROCK), cn.wall((0.4 * size, 0), (-1, 0), ROCK))
        else:
            x = cn.pre.deposit_disks(radii, 0.5 * size) - size * np.array([0.25, 0.42])
            scene.add(cn.ring((0, 0), 0.5 * size, ROCK, velocity=(0, 0, 2.0)))
        scene.add(cn.disks(x, radii, ROCK))
        scene.interact("*", "*", cn.Coulomb(mu=0.4))
        yield name, cn.Simulation(scene, dt, cn.NSCD(threads=1), overlap="ignore"), steps


def scenes_to_judge():
    """(name, simulation, numbers of steps after which one is judged)."""
    for name in ("disks2d_5000", "spheres3d_5000"):
        yield name, reference_scenes.build(name, 1e-4)[0], (30, 100)
    yield "disks2d_20000", reference_scenes.build("disks2d_20000", 1e-4)[0], (30,)
    # between faces sweeps alone take minutes to 1e-10
    yield reference_wall.NAME, reference_wall.build(cn.Auto(tol=1e-4, max_iter=2000)), (3,)
    for name, sim, steps in hopper_and_drum(1000):
        yield name, sim, (steps // 2, steps, 3 * steps // 2)
    yield "wall", cn.Simulation(wall.build(), wall.DT, cn.NSCD(threads=1)), (330, 400)
    yield "two elastic blocks", blocks("Q4 on another", 64), (30,)
    yield "two elastic blocks in space", blocks("H8 on another", 64), (30,)


def exact_step(sim, path, tol, accuracy, most=100000, impulses=None):
    """Velocities, report, CPU seconds and impulses of a step from the state in path, or from impulses."""
    sim.restore(path)
    if impulses is not None:
        state = sim.get_state()
        state["memory"] = impulses
        sim.set_state(state)
    solver = type(sim.strategy.solver)(tol=tol, max_iter=most)
    sim.strategy = cn.NSCD(solver=solver, threads=1, accuracy=accuracy)
    before = time.process_time()
    info = sim.step()
    seconds = time.process_time() - before
    return velocities(sim), info, seconds, sim.get_state()["memory"]


def velocities(sim):
    """Velocities of rigid bodies and of nodes of meshes (n, dim)."""
    return np.concatenate([sim.bodies.velocity[:, : sim.scene.dim], sim.nodes.velocity])


def error_of_velocities(sim, v, exact):
    """|v - exact|_M / max(|exact|_M, |h g|_M)"""
    mass = np.concatenate([np.where(np.isfinite(sim.bodies.mass), sim.bodies.mass, 0.0), sim.nodes.mass])[:, None]
    gravity = np.linalg.norm(sim.scene.gravity)
    size = max(np.sqrt(np.sum(mass * exact**2)), np.sqrt(mass.sum()) * gravity * sim.dt)
    return np.sqrt(np.sum(mass * (v - exact) ** 2)) / size


def rows_of_accuracy(folder, options):
    """A step has several exact solutions where bodies wedge: velocities are held against that from the common state, and
    against that which is found from the impulses of the answer itself."""
    path = folder / "state.h5"
    for name, sim, moments in scenes_to_judge():
        if options.scenes and name not in options.scenes:
            continue
        done, strategy = 0, sim.strategy
        for steps in moments:
            for _ in range(steps - done):
                sim.step()
            done = steps
            sim.checkpoint(path)
            exact, tight, _, _ = exact_step(sim, path, 1e-10, None)
            for tol, accuracy in ((1e-4, None), (1e-6, None), (1e-4, 1e-3), (1e-4, 1e-5)):
                v, info, seconds, impulses = exact_step(sim, path, tol, accuracy, 20000)
                nearest, nearest_info, _, _ = exact_step(sim, path, 1e-10, None, impulses=impulses)
                yield {
                    "scene": name, "after_steps": steps, "contacts": info["contacts"], "tol": tol, "accuracy": accuracy,
                    "velocity_error": f"{error_of_velocities(sim, v, exact):.3g}",
                    "velocity_error_to_its_own_solution": f"{error_of_velocities(sim, v, nearest):.3g}",
                    "estimate": f"{info.get('velocity_error', np.nan):.3g}", "status": info["status"],
                    "sweeps": info["iterations"], "error": f"{info['error']:.3g}", "cpu_seconds": f"{seconds:.4g}",
                    "error_of_reference": f"{tight['error']:.3g}", "status_of_reference": tight["status"],
                    "error_of_own_solution": f"{nearest_info['error']:.3g}",
                }  # fmt: skip
            sim.restore(path)
            sim.strategy = strategy


def rows_of_motion(folder, options):
    for name, sim, _ in hopper_and_drum(options.count):
        sim.strategy = cn.NSCD(solver=cn.NLGS(tol=1e-4, max_iter=500), threads=1)
        for _ in range(options.ahead):
            sim.step()
        for tol in (1e-4, 1e-6):
            sim.checkpoint(folder / "state.h5")
            sim.strategy = cn.NSCD(solver=cn.NLGS(tol=tol, max_iter=20000), threads=1)
            before, infos = time.process_time(), []
            while len(infos) < options.steps and time.process_time() - before < options.seconds:
                infos.append(sim.step())
            yield {
                "scene": name, "bodies": len(sim.bodies), "contacts": infos[-1]["contacts"], "steps_before": options.ahead,
                "tol": tol, "steps": len(infos), "converged": sum(i["status"] == "converged" for i in infos),
                "sweeps_a_step": round(np.mean([i["iterations"] for i in infos])),
                "largest_error": f"{max(i['error'] for i in infos):.3g}",
                "cpu_seconds_a_step": f"{(time.process_time() - before) / len(infos):.4g}",
            }  # fmt: skip
            sim.restore(folder / "state.h5")


def stays(row, options):
    """True if a row of an earlier run is not measured by this one."""
    if options.part == "dense":
        return int(row["grains"]) != options.count or row["scene"] not in options.cases
    return row["scene"] not in options.scenes


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", choices=("families", "dense", "accuracy", "motion"))
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--count", type=int, default=20000)
    parser.add_argument("--steps", type=int, default=20, help="of motion, at each tolerance")
    parser.add_argument("--ahead", type=int, default=200, help="steps before these")
    parser.add_argument("--seconds", type=float, default=120.0, help="no further steps of a row of motion after so many")
    parser.add_argument("--scenes", nargs="+", help="of accuracy: these alone")
    parser.add_argument("--cases", nargs="+", default=["disks", "spheres"], help="of dense")
    options = parser.parse_args()
    target, kept = HERE / "results" / f"sweeps_{options.part}.csv", []
    if options.part == "dense" or (options.part == "accuracy" and options.scenes):
        with open(target, newline="", encoding="utf-8") as file:
            kept = [row for row in csv.DictReader(file) if stays(row, options)]
    parts = {
        "families": rows_of_families, "dense": rows_of_dense, "accuracy": rows_of_accuracy, "motion": rows_of_motion,
    }  # fmt: skip
    with (
        tempfile.TemporaryDirectory() as folder,
        open(target, "w", newline="", encoding="utf-8") as file,
    ):
        writer = csv.DictWriter(file, kept[0], lineterminator="\n") if kept else None
        if kept:
            writer.writeheader()
            writer.writerows(kept)
            file.flush()  # a run that is stopped loses none of them
        for row in parts[options.part](Path(folder), options):
            writer = writer or csv.DictWriter(file, row, lineterminator="\n")
            if file.tell() == 0:
                writer.writeheader()
            writer.writerow(row)
            file.flush()
            print(*row.values(), flush=True)


if __name__ == "__main__":
    main()
