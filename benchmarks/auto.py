"""Auto beside the solvers that it chooses among: CPU seconds on problems, and of steps.

    python benchmarks/auto.py problems                  those of $CAIRN_REFERENCE_DATA/problems, of piles of cubes, rods,
                                                        cylinders and tetrahedra, of vaults and stairs
    python benchmarks/auto.py problems --scenes unseen  grains of two sizes, arches and other vaults, half of them kept aside
    python benchmarks/auto.py problems --scenes packs   packs of cubes, tetrahedra, rods and cylinders that took no part in
                                                        any choice, beside ADMM as well
    python benchmarks/auto.py problems --scenes masses  packs whose grains differ in mass, in fall
    python benchmarks/auto.py steps [--scenes WORD...]  walls, arches, towers, piles: some steps from one state by each

Problems of piles are those that `cairn run --dump-problem` would write. A solver that has not converged has no seconds. Writes
benchmarks/results/auto_PART.csv; `ratio` is Auto's time over that of the fastest other one.
"""

import argparse
import csv
import tempfile
import time
import warnings
from itertools import chain
from pathlib import Path

import cairn as cn
import numpy as np
import reference_wall
from cairn import problems
from cairn.pre import masonry
from problems import DATA
from stacks import stack
from study import arch, wall
from sweeps import grains

HERE = Path(__file__).resolve().parent
MEMBERS = {"problems": ("nlgs_anderson", "ppa_newton"), "steps": ("NLGS", "PPANewton")}
LONGEST = 5.0  # CPU seconds of a row: a solver that takes longer is stopped


def sim_of(scene, dt, theta=0.5):
    return cn.Simulation(scene, dt, cn.NSCD(theta=theta, threads=1), overlap="ignore")


def scene_of(blocks, mu, gravity):
    scene = cn.Scene(dim=len(gravity), gravity=gravity)
    blocks.add_to(scene, cn.Material("stone", density=2300.0))
    scene.interact("*", "*", cn.Coulomb(mu=mu))
    return scene


def panel(columns, courses, angle):
    """A dry wall of blocks on a table tilted by an angle [rad]."""
    blocks = masonry.panel(columns, courses, brick=(0.4, 0.2))
    return sim_of(scene_of(blocks, 0.65, (9.81 * np.sin(angle), -9.81 * np.cos(angle))), 5e-3, 1.0)


def cubes(count, seed, ratio=1.0):
    return sim_of(grains(3, count, seed, ratio=ratio, shape="faced"), 1e-3)


def step_scenes():
    """name -> (a simulation, steps that bring it there, steps to measure)."""
    return {
        "wall of 1,013 blocks": lambda: (reference_wall.build(cn.Auto(tol=1e-6)), 0, 20),
        "the same, standing": lambda: (reference_wall.build(cn.PPANewton(tol=1e-6)), 10, 20),
        "wall that shakes": lambda: (sim_of(wall.build(), wall.DT), 330, 20),
        "arch that spreads": lambda: (sim_of(arch.build(), arch.DT), 220, 20),
        "arch of 101 that spreads": lambda: (sim_of(arch.build(voussoirs=101), 3e-3), 30, 20),
        "panel of 240, tilted": lambda: (panel(12, 20, 0.35), 0, 20),
        "panel of 60, falling": lambda: (panel(6, 10, 0.5), 20, 20),
        "Pont du Gard of 758": lambda: (sim_of(scene_of(masonry.pont_du_gard(0.3), 0.5, (0, 0, -9.81)), 1e-3, 1.0), 0, 5),
        "tower of 100 spheres": lambda: (stack("spheres", 100, 1.0, cn.Auto())[0], 0, 10),
        "tower of 100 boxes": lambda: (stack("boxes", 100, 1.0, cn.Auto())[0], 0, 10),
        "tower of 100 boxes, 1e6": lambda: (stack("boxes", 100, 1e6, cn.Auto())[0], 0, 10),
        "300 cubes, falling": lambda: (cubes(300, 1), 60, 20),
        "300 cubes, at rest": lambda: (cubes(300, 1), 400, 20),
        "300 pentagons, at rest": lambda: (sim_of(grains(2, 300, 1, shape="faced"), 1e-3), 400, 20),
        "2,000 disks, at rest": lambda: (sim_of(grains(2, 2000, 1), 5e-4), 300, 20),
        "2,000 spheres, at rest": lambda: (sim_of(grains(3, 2000, 1), 5e-4), 300, 10),
        "1,000 disks, 1e4": lambda: (sim_of(grains(2, 1000, 1, ratio=1e4), 5e-4), 100, 20),
        "1,000 spheres, 1e4": lambda: (sim_of(grains(3, 1000, 1, ratio=1e4), 5e-4), 100, 20),
    }  # fmt: skip


def seconds_of_steps(sim, path, solver, warm, steps):
    """(CPU seconds of a step in the mean, true if all steps converged, iterations in all, largest error)."""
    sim.restore(path)
    sim.strategy = cn.NSCD(theta=sim.strategy.theta, solver=solver, threads=1, warm_start=warm)
    before, infos = time.process_time(), []
    while len(infos) < (steps if warm else 1) and time.process_time() - before < LONGEST:
        infos.append(sim.step())
    spent = time.process_time() - before
    complete = len(infos) == (steps if warm else 1) and all(i["status"] == "converged" for i in infos)
    return spent / len(infos), complete, sum(i["iterations"] for i in infos), max(i["error"] for i in infos)


def rows_of_steps(options, folder):
    for name, build in step_scenes().items():
        if options.scenes and not any(word in name for word in options.scenes):
            continue
        sim, ahead, steps = build()
        for _ in range(ahead):
            sim.step()
        path = folder / "state.h5"
        sim.checkpoint(path)
        for warm in (False, True) if ahead else (True,):
            for tol in options.tol:
                row = {"scene": name, "steps": steps if warm else 1, "warm_start": warm, "tol": tol, "contacts": None}
                least = np.inf
                for solver in (*MEMBERS["steps"], "Auto"):
                    best = None
                    for _ in range(options.repeats):
                        found = seconds_of_steps(sim, path, getattr(cn, solver)(tol=tol, max_iter=20000), warm, steps)
                        best = found if best is None or found[0] < best[0] else best
                        if best[0] > 0.5:
                            break
                    row["contacts"] = len(sim.contacts.gap)
                    row[f"{solver} [ms]"] = f"{1e3 * best[0]:.4g}" if best[1] else f"not in {1e3 * best[0]:.4g}"
                    row[f"{solver} iterations"] = best[2]
                    row[f"{solver} error"] = f"{best[3]:.2g}"
                    if best[1] and solver != "Auto":
                        least = min(least, best[0])
                row["ratio"] = f"{best[0] / least:.3g}" if best[1] and np.isfinite(least) else ""
                yield row


def pile_problems():
    """(name, problem): piles of cubes as --dump-problem writes them, in fall and later."""
    for count, seed, moments in ((300, 2, (60, 120)), (600, 3, (60, 120)), (1000, 4, (60, 90))):
        sim, done = cubes(count, seed), 0
        for steps in moments:
            for _ in range(steps - done):
                sim.step()
            done = steps
            yield f"{count} cubes, step {steps}", sim.problem()


def thrown(shape, seed, mu=0.4, count=400):
    """A deposit of rods, cylinders or tetrahedra in a box, turned any way."""
    rng = np.random.default_rng(seed)
    radii = rng.uniform(0.005, 0.01, count)
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    width = np.cbrt(np.sum(4 / 3 * np.pi * radii**3) / 0.55)
    x, axis = cn.pre.deposit_spheres(radii, (width, width)), rng.normal(size=(count, 3))
    rock = cn.Material("rock", density=2500.0)
    if shape == "rods":
        scene.add(cn.capsules(x, 0.35 * radii, 1.3 * radii, rock, axis=axis))
    elif shape == "cylinders":
        scene.add(cn.cylinders(x, 0.5 * radii, 1.5 * radii, rock, axis=axis))
    else:
        corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / np.sqrt(3)
        faces = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
        scene.add(cn.polyhedra([(a * corners, faces) for a in radii], rock, position=x))
    scene.add(cn.box(np.zeros(3), (width, width, 3 * width), rock, lid=False))
    scene.interact("*", "*", cn.Coulomb(mu=mu))
    return sim_of(scene, 1e-3)


def vault(blocks, mu=0.6):
    return sim_of(scene_of(blocks, mu, (0, 0, -9.81)), 2e-3, 1.0)


def other_problems():
    """(name, problem) of rods, cylinders, tetrahedra, vaults and stairs."""
    yield from problems_of(
        ("400 rods", lambda: thrown("rods", 7), (60, 150)),
        ("300 cylinders", lambda: thrown("cylinders", 8, count=300), (60, 120)),
        ("400 tetrahedra", lambda: thrown("tetrahedra", 9), (60, 120)),
        ("400 tetrahedra, mu 1", lambda: thrown("tetrahedra", 9, 1.0), (100,)),
        ("400 tetrahedra, mu .05", lambda: thrown("tetrahedra", 9, 0.05), (100,)),
        ("dome", lambda: vault(masonry.dome(2.0, 0.3, 8, 24)), (1, 20)),
        ("barrel vault", lambda: vault(masonry.barrel_vault(2.0, 5, span=4.0, thickness=0.3, voussoirs=21)), (1, 20)),
        ("cross vault", lambda: vault(masonry.cross_vault(4.0, 2.2, 0.3, 12, 4)), (1, 20)),
        ("stairs", lambda: vault(masonry.stairs(20, 0.3, 0.17, 1.0), 0.5), (1, 20)),
    )


def problems_of(*kinds):
    """(name, problem) of (name, what builds a simulation, steps after which one is taken)."""
    for name, build, moments in kinds:
        sim, done = build(), 0
        for steps in moments:
            for _ in range(steps - done):
                sim.step()
            done = steps
            yield f"{name}, step {steps}", sim.problem()


def mixture(dim, count, seed, faced=False):
    """A deposit in which every tenth grain is five times as large as the others."""
    rng = np.random.default_rng(seed)
    radii = np.where(rng.random(count) < 0.1, 0.02, 0.004) * rng.uniform(0.9, 1.1, count)
    scene, rock = cn.Scene(dim, gravity=-9.81 * np.eye(dim)[-1]), cn.Material("rock", density=2500.0)
    if dim == 2:
        width = np.sqrt(np.sum(np.pi * radii**2) / 0.8)
        x = cn.pre.deposit_disks(radii, width)
        angle = np.arange(6) * np.pi / 3
        corners = np.column_stack((np.cos(angle), np.sin(angle)))
    else:
        width = np.cbrt(np.sum(4 / 3 * np.pi * radii**3) / 0.55)
        x = cn.pre.deposit_spheres(radii, (width, width))
    if not faced:
        scene.add((cn.disks if dim == 2 else cn.spheres)(x, radii, rock))
    elif dim == 2:
        scene.add(cn.polygons([r * corners for r in radii], rock, position=x))
    else:
        scene.add(cn.boxes(x, 1.1 * radii[:, None] * np.ones(3), rock))
    scene.add(cn.box(np.zeros(dim), np.r_[[width] * (dim - 1), 2 * width], rock, lid=False))
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    return sim_of(scene, 1e-3)


def unseen_problems():
    """(name, problem) of kinds of which half took no part in the choice of constants of Auto, see docs/problems.md."""
    yield from problems_of(
        ("800 disks, 1:5", lambda: mixture(2, 800, 21), (60, 200)),
        ("300 spheres, 1:5", lambda: mixture(3, 300, 22), (60, 200)),
        ("400 hexagons, 1:5", lambda: mixture(2, 400, 23, True), (60, 200)),
        ("300 cubes, 1:5", lambda: mixture(3, 300, 24, True), (60,)),
        ("arch of 41", lambda: sim_of(arch.build(voussoirs=41), 2e-3), (1, 80)),
        ("arch of 151", lambda: sim_of(arch.build(voussoirs=151), 2e-3), (1, 40)),
        ("small cross vault", lambda: vault(masonry.cross_vault(3.0, 1.7, 0.2, 8, 3), 0.5), (1, 10)),
        (
            "long barrel vault",
            lambda: vault(masonry.barrel_vault(3.0, 9, span=3.0, thickness=0.25, voussoirs=15), 0.7),
            (1, 10),
        ),
        ("flat dome", lambda: vault(masonry.dome(3.0, 0.25, 6, 18), 0.7), (1, 15)),
    )


def packs():
    """(name, problem) of packs of faces and rods that fall or have come to rest."""
    cubes_of = ((200, 31, (80, 150)), (350, 32, (70, 110, 160)), (450, 33, (90, 140)), (550, 34, (80, 130)))
    for count, seed, moments in (*cubes_of, (700, 35, (70, 120)), (900, 36, (80, 110)), (700, 40, (140,))):
        yield from problems_of((f"{count} cubes, {seed}", lambda c=count, s=seed: cubes(c, s), moments))
    yield from problems_of(
        ("300 tetrahedra", lambda: thrown("tetrahedra", 39, count=300), (80, 150)),
        ("500 tetrahedra, mu .8", lambda: thrown("tetrahedra", 38, 0.8, count=500), (90,)),
        ("500 rods", lambda: thrown("rods", 37, count=500), (100,)),
        ("400 cylinders", lambda: thrown("cylinders", 36, count=400), (90, 150)),
    )


def masses():
    """(name, problem) of packs in fall, half of whose grains are so many times as heavy as the others."""

    def pack(dim, count, shape, ratio):
        sim = sim_of(grains(dim, count, 1, ratio=ratio, shape=shape), 1e-3)
        sim.strategy = cn.NSCD(solver=cn.NLGS(tol=1e-4, max_iter=200), threads=1)
        return sim

    for dim, count, shape, name in ((2, 400, "round", "disks"), (3, 400, "round", "spheres"), (3, 200, "faced", "cubes")):
        for ratio in (3e2, 1e3, 1e4):
            build = lambda d=dim, c=count, s=shape, r=ratio: pack(d, c, s, r)  # noqa: E731
            yield from problems_of((f"{count} {name}, {ratio:g}", build, (60 if shape == "faced" else 4,)))


def seconds_of_problem(problem, solver, tol, repeats):
    result = problem.solve(solver, tol, max_iter=10**8, max_seconds=LONGEST)
    if not result.converged:
        return None, result
    seconds = result.cpu_seconds
    for _ in range(repeats * (1 if seconds > 0.2 else 3)):
        seconds = min(seconds, problem.solve(solver, tol, max_iter=10**8).cpu_seconds)
    return seconds, result


def rows_of_problems(options, folder):
    files = [(path.stem, problems.read(path)) for path in sorted(DATA.glob("*.hdf5"))]
    apart = {"unseen": unseen_problems, "packs": packs, "masses": masses}.get(" ".join(options.scenes or ()))
    rivals = (*MEMBERS["problems"], *(["admm"] if apart is packs else []), "auto")
    for name, problem in apart() if apart else chain(files, pile_problems(), other_problems()):
        if options.scenes and not apart and not any(word in name for word in options.scenes):
            continue
        for tol in options.tol:
            row, least = {"problem": name, "contacts": len(problem.mu), "tol": tol}, np.inf
            for solver in rivals:
                seconds, result = seconds_of_problem(problem, solver, tol, options.repeats)
                row[f"{solver} [ms]"] = f"{1e3 * seconds:.4g}" if seconds else "none"
                row[f"{solver} iterations"] = result.iterations
                if seconds and solver != "auto":
                    least = min(least, seconds)
            row["answered by"] = result.solver
            row["ratio"] = f"{seconds / least:.3g}" if seconds and np.isfinite(least) else ""
            yield row


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("part", choices=("problems", "steps"))
    parser.add_argument("--scenes", nargs="+", help="words of their names")
    parser.add_argument("--tol", type=float, nargs="+")
    parser.add_argument("--repeats", type=int, default=2)
    parser.add_argument("--output", type=Path)
    options = parser.parse_args()
    options.tol = options.tol or ((1e-4, 1e-8) if options.part == "problems" else (1e-4, 1e-6))
    warnings.simplefilter("ignore")
    apart = f"_{options.scenes[0]}" if options.scenes in (["unseen"], ["packs"], ["masses"]) else ""
    out = options.output or HERE / "results" / f"auto_{options.part}{apart}.csv"
    with open(out, "w", newline="") as file, tempfile.TemporaryDirectory() as folder:
        writer, ratios = None, []
        rows = rows_of_problems if options.part == "problems" else rows_of_steps
        for row in rows(options, Path(folder)):
            writer = writer or csv.DictWriter(file, row, lineterminator="\n")
            if not ratios and file.tell() == 0:
                writer.writeheader()
            writer.writerow(row)
            file.flush()
            print(*row.values(), sep=",", flush=True)
            others = [t for key, t in row.items() if key.endswith("[ms]") and key.lower() != "auto [ms]" and t[0].isdigit()]
            if row["ratio"] and min(map(float, others)) > 1:
                ratios.append(float(row["ratio"]))
    mean = np.exp(np.mean(np.log(ratios)))
    print(f"{len(ratios)} ratios where the fastest takes more than 1 ms: geometric mean {mean:.3g}, largest {max(ratios):.3g}")


if __name__ == "__main__":
    main()
