"""Deformable bodies in a scene: set-up, first step, step, memory, on one core.

    script/bench meshes [PART ...] [--most 100000] [--most-solid 100000] [--steps 5]

Parts: blocks (Q4, HEX8, TET4 of 1e3, 1e4, 1e5 nodes on a plane, and one on another), sheets (a layer of HEX8 on a plane, half of
its nodes in contact), many (bodies of one T3 each that touch on
every side; each has a name of its own), plates (3,000 disks between elastic plates against rigid ones), beside (2,400 disks with
a mesh of 15 nodes that touches nothing, and without), legacy (folders written for LMGC90, `--folders`, at the error of its runs).
A line a case, each in a process of its own: CPU seconds of set-up, first step and mean of those after; solves (forward and back)
a step and mesh after the first, and factorisations in all; bytes that the meshes count, and the peak of the process less that
before set-up.
"""

import argparse
import csv
import json
import os
import resource
import subprocess
import sys
import time
import warnings
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = "1"

import cairn as cn
import numpy as np
from cairn.model.elastic import ElasticBody

ROCK = cn.Material("rock", density=2000.0)
YOUNG = 1e7
COLUMNS = (
    "part", "case", "size", "bodies", "nodes", "contacts", "set_up_s", "first_step_s", "step_s", "iterations", "status", "error",
    "solves_a_step", "factorisations", "contact_dofs", "counted_mb", "peak_mb", "velocity_difference",
)  # fmt: skip


def grid(kind, cells, size, corner):
    """Points and cells {kind: nodes} of a box of so many cells along each axis."""
    axes = [np.linspace(c, c + s, n + 1) for c, s, n in zip(corner, size, cells)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, len(cells))
    number = np.arange(len(points)).reshape([n + 1 for n in cells])
    if len(cells) == 2:
        quads = [number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]]
        return points, {"quad": np.stack(quads, -1).reshape(-1, 4)}
    low, high = slice(None, -1), slice(1, None)
    corners = [(low, low), (high, low), (high, high), (low, high)]
    hexa = np.stack([number[(*c, z)] for z in (low, high) for c in corners], -1).reshape(-1, 8)
    if kind == "HEX8":
        return points, {"hexahedron": hexa}
    six = [[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]]
    return points, {"tetra": hexa[:, six].reshape(-1, 4)}


def block(kind, nodes, level, name):
    """Nodes of a square or cube of side 1 m that stands at a height."""
    dim = 2 if kind == "Q4" else 3
    n = max(int(round(nodes ** (1 / dim))) - 1, 1)
    corner = np.array([*[0.0] * (dim - 1), level])
    points, cells = grid(kind, [n] * dim, [1.0] * dim, corner)
    body = ElasticBody(points, cells, young=YOUNG, poisson=0.3, density=2000.0, rayleigh=(0.0, 1e-3))
    bottom, top = (np.flatnonzero(np.isclose(points[:, -1], level + z)) for z in (0.0, 1.0))
    faces = body.boundary_edges() if dim == 2 else body.boundary_faces()
    upper = faces[(np.isin(faces, top) | (faces < 0)).all(axis=1)]
    sides = {"edges": upper} if dim == 2 else {"faces": upper}
    return cn.deformable(body, ROCK, contact=bottom, name=name, **sides)


def blocks(case, size):
    """A block on a plane, or one on another on it."""
    kind, on = case.split(" on ")
    dim = 2 if kind == "Q4" else 3
    down = np.eye(dim)[-1]
    scene = cn.Scene(dim, gravity=-9.81 * down)
    sets = [block(kind, size, 0.0, "lower")] + ([block(kind, size, 1.0, "upper")] if on == "another" else [])
    if dim == 2:
        scene.add(*sets, cn.wall((0, 0), (0, 1), ROCK))
    else:
        scene.add(*sets, cn.wall((0, 0, 0), (0, 0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, 1e-3, cn.NSCD(solver=cn.Default(tol=1e-6, max_iter=2000)), overlap="ignore")


def sheets(case, size):
    """A layer of cells on a plane."""
    n = int(round((size / 2) ** 0.5)) - 1
    points, cells = grid("HEX8", (n, n, 1), (0.01 * n, 0.01 * n, 0.01), np.zeros(3))
    body = ElasticBody(points, cells, young=YOUNG, poisson=0.3, density=2000.0)
    scene = cn.Scene(3, gravity=(0.0, 0.0, -9.81))
    low = np.flatnonzero(points[:, 2] == 0)
    scene.add(cn.deformable(body, ROCK, contact=low, name="sheet"), cn.wall((0, 0, 0), (0, 0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, 1e-3, cn.NSCD(solver=cn.Default(tol=1e-4)), overlap="ignore")


def many(case, size):
    """Squares cut in two triangles that share no node: points of one lie on the edges of the other, all round."""
    side = int(round((size / 2) ** 0.5))
    quarter = (np.array([[0, 1], [0, 1], [1, 2], [1, 2], [2, 0], [2, 0]]), np.array([[0.75, 0.25], [0.25, 0.75]] * 3))
    edges = np.array([[0, 1], [1, 2], [2, 0]])
    sets = []
    for j in range(side):
        for i in range(side):
            square = np.array([[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]], float)
            for half, how in (([0, 1, 2], {"points": quarter}), ([0, 2, 3], {"edges": edges})):
                cells = {"triangle": np.array([[0, 1, 2]])}
                body = ElasticBody(square[half], cells, young=YOUNG, poisson=0.2, density=2000.0)
                sets.append(cn.deformable(body, ROCK, name=f"triangle {len(sets)}", **how))
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    scene.add(*sets, cn.wall((0, 0), (0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.5))
    through = 0.5**0.5 / np.sqrt(YOUNG / 2000.0)  # the least height of a triangle by about the speed of waves
    return cn.Simulation(scene, through / 2, cn.NSCD(solver=cn.Default(tol=1e-6, max_iter=2000)), overlap="ignore")


def plates(case, size):
    """Disks on a lattice between two plates that close; the plates of Q4, or rigid polygons."""
    rng = np.random.default_rng(1)
    columns, radius = 100, 0.005
    rows_ = size // columns
    at = np.stack(np.meshgrid(np.arange(columns), np.arange(rows_), indexing="ij"), -1).reshape(-1, 2)
    centers = (at + 0.5 + 0.2 * (at[:, 1:] % 2) * [1, 0]) * [0.0104, 0.0101] + rng.uniform(-5e-5, 5e-5, at.shape)
    width, height, thick = 0.0104 * columns + 0.01, 0.0101 * rows_, 0.02
    scene = cn.Scene(2)
    sets = [cn.disks(centers, rng.uniform(0.9, 1.0, len(centers)) * radius, ROCK)]
    for name, low, face, drive in (("lower", -thick, 0.0, 0.0), ("upper", height, height, -0.05)):
        if case == "elastic":
            points, cells = grid("Q4", (200, 4), (width, thick), (0.0, low))
            body = ElasticBody(points, cells, young=1e8, poisson=0.3, density=2000.0)
            y = points[:, 1]
            inner, outer = np.isclose(y, face), np.isclose(y, low if name == "lower" else low + thick)
            edges = body.boundary_edges()
            edges = edges[np.isin(edges, np.flatnonzero(inner)).all(axis=1)]
            body.groups["held"] = np.flatnonzero(outer)
            sets.append(cn.deformable(body, ROCK, edges=edges, name=name, fixed={"held": "xy"}, drive={"held": {"y": drive}}))
        else:
            corners = np.array([[0, low], [width, low], [width, low + thick], [0, low + thick]])
            sets.append(cn.polygons([corners], ROCK, driven=("vx", "vy", "w"), drive=(0.0, drive, 0.0)))
    scene.add(*sets, cn.wall((0, 0), (1, 0), ROCK), cn.wall((width, 0), (-1, 0), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, 1e-3, cn.NSCD(solver=cn.Default(tol=1e-4, max_iter=5000)), overlap="ignore")


def beside(case, size):
    """Disks in a box, and far from it a mesh of 15 nodes, or none."""
    rng = np.random.default_rng(1)
    columns = 60
    at = np.stack(np.meshgrid(np.arange(columns), np.arange(size // columns), indexing="ij"), -1).reshape(-1, 2)
    centers = (at + 0.5) * 0.0103 + rng.uniform(-1e-4, 1e-4, at.shape)
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    scene.add(cn.disks(centers, rng.uniform(0.0045, 0.005, len(centers)), ROCK))
    scene.add(*cn.box((0, 0), (columns * 0.0103, 1.0), ROCK, lid=False))
    if case == "with a mesh":
        points, cells = grid("Q4", (4, 2), (0.4, 0.2), (0.1, 50.0))
        body = ElasticBody(points, cells, young=YOUNG, poisson=0.3, density=2000.0)
        scene.add(*cn.deformable(body, ROCK, contact=np.arange(15)))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.4))
    return cn.Simulation(scene, 1e-3, cn.NSCD(solver=cn.Default(tol=1e-3, max_iter=200)), overlap="ignore")


def legacy(case, size):
    """A folder of LMGC90."""
    from cairn.legacy import read_datbox

    folder = Path(case)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        scene = read_datbox(folder / "DATBOX", "skip")
    told = json.loads((folder / "case.json").read_text())
    solver = cn.Default(tol=float(os.environ["CAIRN_TOL"]), max_iter=100_000)
    strategy = cn.NSCD(told["theta"], solver, scene.legacy.alert or None, contact_point="surface")
    return cn.Simulation(scene, told["dt"], strategy, overlap="ignore")


PARTS = {"blocks": blocks, "sheets": sheets, "many": many, "plates": plates, "beside": beside, "legacy": legacy}


def difference_from(folder, sim):
    """Largest difference of velocities from a tight run of LMGC90, of the largest velocity."""
    found = sorted(Path(folder).glob("lmgc_*.npz"))
    if not found:
        return np.nan
    theirs, ours, wrong, scale = np.load(found[0]), sim.meshes, 0.0, 0.0
    for k, mesh in enumerate(ours):
        if f"v{k}" not in theirs:
            break
        v = theirs[f"v{k}"][:, : sim.scene.dim]
        wrong, scale = max(wrong, np.abs(mesh.velocity - v).max()), max(scale, np.abs(v).max())
    return wrong / scale


def measure(part, case, size, steps):
    """A row of COLUMNS."""
    from cairn.run.views import core_of  # not in every commit that `pays_nothing` gives blocks to

    before, start = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time()
    sim = PARTS[part](case, size)
    made, cpu, infos, work, wrong = time.process_time(), [], [], [], []
    if part == "legacy":
        told = json.loads((Path(case) / "case.json").read_text())
        steps = told["steps"]
    elif part in ("plates", "beside"):
        steps = max(steps, 100)  # until most grains touch
    for _ in range(steps):
        begin = time.process_time()
        infos.append(sim.step())
        cpu.append(time.process_time() - begin)
        work.append(core_of(sim).mesh_work())
        if part == "legacy":  # folders hold the state after 5, 10 or all steps: the step that is nearest counts
            wrong.append(difference_from(case, sim))
    nodes = sum(len(mesh.ids) for mesh in sim.meshes)
    later = max(len(cpu) - 1, 1)
    return {
        "part": part, "case": Path(case).name, "size": size, "bodies": len(sim.meshes), "nodes": nodes,
        "contacts": infos[-1]["contacts"], "set_up_s": f"{made - start:.3g}", "first_step_s": f"{cpu[0]:.3g}",
        "step_s": f"{sum(cpu[1:]) / later:.3g}", "iterations": round(np.mean([i["iterations"] for i in infos]), 1),
        "status": infos[-1]["status"], "error": f"{max(i['error'] for i in infos):.2g}",
        "solves_a_step": round((work[-1]["solves"] - work[0]["solves"]) / later / max(len(sim.meshes), 1), 2),
        "factorisations": work[-1]["factorisations"], "contact_dofs": work[-1]["contact_dofs"],
        "counted_mb": round(work[-1]["bytes"] / 1e6, 1),
        "peak_mb": round((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1e3),
        "velocity_difference": f"{min(wrong):.2g}" if wrong else "",
    }  # fmt: skip


def cases(part, most, most_solid, folders):
    """(case, size) of a part."""
    if part == "blocks":
        sizes = [n for n in (1000, 10_000, 100_000) if n <= most]
        kinds = [(kind, on, n) for kind in ("Q4", "HEX8", "TET4") for on in ("a plane", "another") for n in sizes]
        return [(f"{kind} on {on}", n) for kind, on, n in kinds if kind == "Q4" or n <= most_solid]
    if part == "sheets":
        return [("HEX8", n) for n in (882, 7442, 20_402, 45_602) if n <= most]
    if part == "many":
        return [("T3", n) for n in (1600, 10_000, 40_000) if n <= most]
    if part == "plates":
        return [("rigid", 3000), ("elastic", 3000)]
    if part == "beside":
        return [("without", 2400), ("with a mesh", 2400)]
    return [(str(f), 0) for f in sorted(Path(folders).iterdir()) if (f / "case.json").exists()]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []])
    parser.add_argument("--most", type=int, default=100_000, help="nodes of a block, bodies of many")
    parser.add_argument("--most-solid", type=int, default=100_000, help="nodes of a block in 3D, whose factors fill most")
    parser.add_argument("--steps", type=int, default=5)
    parser.add_argument("--tol", default="1e-6", help="of the folders")
    parser.add_argument("--folders", default="", help="where the folders of LMGC90 are")
    parser.add_argument("--against", metavar="FOLDER", help="with the package of another build: each case by both, in turns")
    parser.add_argument("--case", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    os.environ["CAIRN_TOL"] = options.tol
    writer = csv.DictWriter(sys.stdout, COLUMNS)
    if options.case:
        case, mark, _ = options.case[0].partition(" (against)")
        row = measure(options.parts[0], case, int(options.case[1]), options.steps)
        writer.writerow({**row, "case": row["case"] + mark})
        return
    writer.writeheader()
    for part in options.parts or [p for p in PARTS if p != "legacy" or options.folders]:
        for case, size in cases(part, options.most, options.most_solid, options.folders):
            sys.stdout.flush()
            command = [sys.executable, __file__, part, "--steps", str(options.steps), "--tol", options.tol]
            subprocess.run([*command, "--case", case, str(size)], check=False)
            if options.against:
                other = {**os.environ, "PYTHONPATH": options.against}
                subprocess.run([*command, "--case", f"{case} (against)", str(size)], check=False, env=other)


if __name__ == "__main__":
    main()
