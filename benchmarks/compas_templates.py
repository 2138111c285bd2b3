"""Templates of compas_dem solved by Cairn and by LMGC90, whose wheel is compas_lmgc90, side by side.

    python benchmarks/compas_templates.py [--steps N] [--dt DT] [NAME...]      all take about two minutes of one core

Writes benchmarks/results/compas.csv. Every structure stands on its supports under its weight, mu 0.6. The reaction is the
vertical force on the supports over the weight of the blocks. ms a step is CPU time of one thread in the core of each code, the
median of three blocks of steps, which alternate between both; s to solve is CPU time of Problem.solve, from the model to its
results. compas_dem has no blocks in its WallTemplate: the wall is made by Cairn's.
"""

from __future__ import annotations

import argparse
import contextlib
import csv
import io
import os
import time
import warnings
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import cairn as cn  # noqa: E402
import numpy as np  # noqa: E402
from cairn.pre import masonry  # noqa: E402
from cairn_compas import Solver, build  # noqa: E402
from cairn_compas.results import Contacts, unbalanced_force_ratio  # noqa: E402
from compas.datastructures import Mesh  # noqa: E402
from compas_dem.material import Stone  # noqa: E402
from compas_dem.models import BlockModel  # noqa: E402
from compas_dem.problem import Problem  # noqa: E402
from compas_dem.templates import ArchTemplate, BarrelVaultTemplate, DomeTemplate  # noqa: E402
from compas_dem.templates.barrel_staggered import BarrelVaultStaggeredTemplate  # noqa: E402
from compas_lmgc90.solver import Solver as LMGC90  # noqa: E402

MU, DENSITY, PARTS = 0.6, 2000.0, 3


def arch(thickness, n):
    meshes = ArchTemplate(rise=3.0, span=6.0, thickness=thickness, depth=0.5, n=n).blocks()
    return meshes, {0, n - 1}


def dome(meridians, hoops):
    meshes = DomeTemplate(meridians=meridians, hoops=hoops).blocks()
    return meshes, {k for k in range(len(meshes)) if k % hoops == hoops - 1}


def vault(template):
    meshes = template.blocks()
    return meshes, {k for k, m in enumerate(meshes) if m.attributes["is_support"]}


def wall():
    blocks = masonry.wall(1.98, 8)
    meshes = [Mesh.from_vertices_and_faces(v.tolist(), [list(map(int, f)) for f in faces])
              for v, faces in zip(blocks.vertices, blocks.faces)]  # fmt: skip
    lowest = min(v[:, 2].max() for v in blocks.vertices)
    return meshes, {k for k, v in enumerate(blocks.vertices) if v[:, 2].max() <= lowest * (1 + 1e-9)}


CASES = {
    "arch of 40": lambda: arch(0.5, 40),
    "thin arch of 30": lambda: arch(0.36, 30),
    "dome of 240": lambda: dome(20, 12),
    "barrel vault, the default": lambda: vault(BarrelVaultTemplate()),
    "staggered vault, the default": lambda: vault(BarrelVaultStaggeredTemplate()),
    "staggered vault, beam rows": lambda: vault(BarrelVaultStaggeredTemplate(stagger=0.3, add_beam_row=True)),
    "wall of 8 courses": wall,
}


def problem_of(meshes, supports):
    model = BlockModel()
    for mesh in meshes:
        model.add_block_from_mesh(mesh)
    model.add_supports(sorted(supports))
    stone = Stone(density=DENSITY)
    model.add_material(stone)
    model.assign_material(stone, elements=list(model.elements()))
    problem = Problem(model)
    problem.set_contact_model("MohrCoulomb", mu=MU)
    return problem


class OfCairn:
    def __init__(self, problem, supports, dt, duration):
        self.built = build(problem, duration=duration, dt=dt, threads=1)
        self.start, self.supports = self.places(), supports
        self.above = 0

    def places(self):
        return np.array(self.built.simulation.bodies.position)

    def step(self):
        self.above += self.built.simulation.step()["status"] != "converged"

    def figures(self):
        contacts = Contacts(self.built)
        net = contacts.net(len(self.built.blocks))[sorted(self.supports)]
        moved = np.linalg.norm(self.places() - self.start, axis=1).max()
        return -net[:, 2].sum(), moved, len(contacts.gap), unbalanced_force_ratio(self.built, contacts)


class OfLMGC90:
    def __init__(self, problem, supports, dt, duration):
        self.solver = LMGC90(density=DENSITY, dt=dt, theta=0.5)
        self.solver.geometry_from_model(problem.model)
        self.solver.set_supports_from_model()
        self.solver.contact_law("IQS_CLB", MU)
        self.solver.preprocess()
        self.supports, self.start = supports, np.array(self.solver.init_coor)

    def step(self):
        self.result = self.solver.lmgc90.compute_one_step()

    def figures(self):
        bodies = np.array(self.result.interaction_bodies).reshape(-1, 2) - 1
        force = np.array(self.result.interaction_force_global).reshape(-1, 3)
        held = np.isin(bodies, sorted(self.supports))
        up = np.sum(np.where(held[:, 0] & ~held[:, 1], force[:, 2], 0.0)) - np.sum(
            np.where(held[:, 1] & ~held[:, 0], force[:, 2], 0.0)
        )
        moved = np.linalg.norm(np.array(self.result.bodies) - self.start, axis=1).max()
        return -up, moved, len(bodies), float("nan")


def run(name, steps, dt):
    """Row of the table."""
    meshes, supports = CASES[name]()
    problem = problem_of(meshes, supports)
    both = [kind(problem, supports, dt, steps * dt) for kind in (OfCairn, OfLMGC90)]
    weight = 9.81 * DENSITY * sum(abs(m.volume()) for k, m in enumerate(meshes) if k not in supports)
    cost = [[], []]
    for _ in range(PARTS):
        for which, code in enumerate(both):
            start = time.process_time()
            for _ in range(steps // PARTS):
                code.step()
            cost[which].append(1e3 * (time.process_time() - start) / (steps // PARTS))
    ours, theirs = (code.figures() for code in both)
    times = [float(np.median(c)) for c in cost]
    solvers = Solver.Cairn(dt=dt, n_steps=steps, threads=1), Solver.LMGC90(dt=dt, n_steps=steps, verbose=steps)
    whole = [solve_time(problem, solver) for solver in solvers]
    return [name, len(meshes), ours[2], theirs[2], f"{ours[0] / weight:.5f}", f"{theirs[0] / weight:.5f}", f"{ours[1]:.1e}",
            f"{theirs[1]:.1e}", f"{ours[3]:.0e}", both[0].above, steps, f"{times[0]:.2f}", f"{times[1]:.2f}",
            f"{times[1] / times[0]:.1f}", f"{whole[0]:.2f}", f"{whole[1]:.2f}"]  # fmt: skip


def solve_time(problem, solver):
    """CPU time of Problem.solve [s]."""
    problem.set_solver(solver)
    start = time.process_time()
    with contextlib.redirect_stdout(io.StringIO()):
        problem.solve()
    return time.process_time() - start


HEADER = ["structure", "blocks", "points_cairn", "points_lmgc90", "reaction_cairn", "reaction_lmgc90", "moved_cairn_m",
          "moved_lmgc90_m", "unbalanced_cairn", "unconverged_cairn", "steps", "ms_a_step_cairn", "ms_a_step_lmgc90", "ratio",
          "s_to_solve_cairn", "s_to_solve_lmgc90"]  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", default=list(CASES), metavar="NAME")
    parser.add_argument("--steps", type=int, default=201)
    parser.add_argument("--dt", type=float, default=2e-3)
    asked = parser.parse_args()
    warnings.simplefilter("ignore", cn.OverlapWarning)  # rings of the dome overlap in the template
    path = Path(__file__).parent / "results" / "compas.csv"
    with open(path, "w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(HEADER)
        for name in asked.names:
            row = run(name, asked.steps, asked.dt)
            table.writerow(row)
            file.flush()
            print(*row, flush=True)


if __name__ == "__main__":
    main()
