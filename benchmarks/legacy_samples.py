"""The sample cases of LMGC90, read, run, and compared with what LMGC90 stored.

Each case that maps runs its stored steps from its DATBOX. Beside it run copies whose grains were shifted at random by 1e-8 of
their radius, the digits that the files hold: beyond their divergence no comparison is meaningful. `horizon` is the last stored
step to which tracked bodies stay within 1e-4 of a body size of the stored positions, `horizon_of_copies` the same of the copies
among each other (least and greatest of them against the run as it is read), `horizon_of_last_digit` that of a copy shifted by
1e-12. Statistics are compared with the mean of the copies; `inside` is true if the stored value lies in the 95 % prediction
interval of the copies (mean +- t(n - 1) sqrt(1 + 1/n) standard deviations). Copies that share most steps with the run, of which
LMGC90's shares few, scatter too little; `as_early` holds statistics of copies shifted by tenfold more until they diverge no later
than LMGC90's run. Writes benchmarks/results/legacy_samples.csv, and the table that docs/legacy.md shows.
"""

import argparse
import csv
import json
import os
import warnings
from pathlib import Path

import cairn as cn
import numpy as np
from cairn import legacy
from cairn.legacy.mesh import read_mesh_states

GATE = 1e-4
# Sweeps a step, copies: of a wall whose hyperstatic joints stall the residual, in LMGC90 too.
FEWER = {"bricks3d_wall": (400, 2)}


def simulation(scene, case, tol):
    """The scene under the settings of the case."""
    sweeps = FEWER.get(case["name"], (5000, 0))[0]
    strategy = cn.NSCD(case["theta"], cn.NLGS(tol=tol, max_iter=sweeps), scene.legacy.alert or None, contact_point="surface")
    return cn.Simulation(scene, case["dt"], strategy, overlap="ignore")


def run(folder, case, tol, shift=0.0, seed=0):
    """(tracked positions at the stored steps, statistics of the last tenth of the steps, last state)."""
    scene = legacy.read_datbox(folder, "skip")
    sizes = np.array([b.radius for b in scene.legacy.datbox.bodies])
    if shift:
        rng, at = np.random.default_rng(seed), 0
        for s in scene.sets:
            if not s.driven:
                s.position += shift * sizes[at : at + len(s), None] * rng.standard_normal(s.position.shape)
            at += len(s)
    sim = simulation(scene, case, tol)
    with open(folder / "history.csv") as file:
        stored = {int(row["step"]): row for row in csv.DictReader(file)}
    axes = "xyz"[: scene.dim]
    differences, tracked, statistics, theirs = [], [], [], []
    free = ~np.array([bool(scene.legacy.datbox.drives.get((b.type, b.number))) for b in scene.legacy.datbox.bodies])
    mass = np.concatenate([s.mass for s in scene.sets])
    for k in range(1, case["steps"] + 1):
        sim.step()
        row = stored.get(k)
        if row is None:
            continue
        x = np.array([[float(row[f"body{b}_{a}"]) for a in axes] for b in case["tracked_bodies"]])
        tracked.append((k, np.array(sim.bodies.position)[[b - 1 for b in case["tracked_bodies"]]]))
        differences.append((k, float(np.max(np.abs(tracked[-1][1] - x)))))
        if k > 0.9 * case["steps"]:
            impulse = sim.contacts.impulse
            active = int(np.sum(np.any(impulse != 0, axis=1)))
            statistics.append((active, len(impulse)))
            theirs.append((int(row["n_active"]), int(row["n_interactions"])))
    position = np.array(sim.bodies.position)
    height = float(np.sum(mass[free] * position[free, -1]) / np.sum(mass[free]))
    return {
        "differences": differences,
        "tracked": tracked,
        "counts": np.mean(statistics, axis=0),
        "stored_counts": np.mean(theirs, axis=0),
        "height": height,
        "position": position,
        "free": free,
        "mass": mass,
        "size": float(np.median(sizes[free])) if np.any(free) else float(np.median(sizes)),
        "datbox": scene.legacy.datbox,
        "unmapped": scene.legacy.unmapped,
    }


def horizon_of(differences, size):
    """Last of the steps before the first difference beyond the gate."""
    horizon = 0
    for k, d in differences:
        if d > GATE * size:
            break
        horizon = k
    return horizon


def between(one, two, size):
    """The horizon of two runs of ours."""
    return horizon_of([(k, float(np.max(np.abs(a - b)))) for (k, a), (_, b) in zip(one["tracked"], two["tracked"])], size)


def inside(values, stored):
    """True if the stored figure lies in the 95 % prediction interval of the copies."""
    from scipy.stats import t

    n = len(values)
    room = t.ppf(0.975, n - 1) * np.sqrt(1 + 1 / n) * np.std(values, ddof=1)
    return bool(abs(np.mean(values) - stored) <= room)


def as_early(folder, case, exact, horizon, copies, stored, span):
    """Statistics against copies that diverge from our run no later than the stored one does."""
    shift, late = 1e-8, np.inf
    while late > horizon and shift < 0.1:
        shift *= 10
        others = [run(folder, case, 1e-8, shift, seed) for seed in range(1, 4)]
        late = np.median([between(exact, o, exact["size"]) for o in others])
    others += [run(folder, case, 1e-8, shift, seed) for seed in range(4, copies + 1)]
    heights, counts = np.array([o["height"] for o in others]), np.array([o["counts"] for o in others])
    return {
        "shift_as_early": shift,
        "height_as_early": abs(np.mean(heights) - stored["height"]) / span,
        "height_spread_as_early": np.std(heights, ddof=1) / span,
        "active_as_early": abs(np.mean(counts[:, 0]) / stored["active"] - 1),
        "active_spread_as_early": np.std(counts[:, 0], ddof=1) / stored["active"],
        "inside_as_early": " ".join(
            name
            for name, values in (("height", heights), ("active", counts[:, 0]), ("interactions", counts[:, 1]))
            if inside(values, stored[name])
        ),
    }


def compare(folder, case, copies):
    """One row of the table."""
    exact = run(folder, case, 1e-10)
    others = [run(folder, case, 1e-8, 1e-8, seed) for seed in range(1, copies + 1)]
    stored = legacy.read_outbox(folder)[-1]
    size, free = exact["size"], exact["free"]
    start = np.array([b.position for b in exact["datbox"].bodies])[:, : stored.displacement.shape[1]]
    final = start + stored.displacement
    last_digit = run(folder, case, 1e-10, 1e-12, 99)
    horizons = [between(exact, o, size) for o in others]
    spread = max(float(np.max(np.abs(o["position"][free] - exact["position"][free]))) for o in others) if np.any(free) else 0.0
    mass = exact["mass"][free]
    height = float(np.sum(mass * final[free, -1]) / np.sum(mass))
    span = float(np.ptp(final[free, -1])) or size
    ours = {name: np.mean([o[name] for o in others], axis=0) for name in ("height", "counts")}
    error = np.std([o["counts"] for o in others], axis=0, ddof=1) / exact["stored_counts"]
    horizon, counts = horizon_of(exact["differences"], size), exact["stored_counts"]
    figures = {"height": height, "active": counts[0], "interactions": counts[1]}
    parts = copies > 2 and horizon < min(horizons)
    early = as_early(folder, case, exact, horizon, copies, figures, span) if parts else {}
    return {
        "steps": case["steps"],
        "horizon": horizon,
        "horizon_of_copies": f"{min(horizons)} to {max(horizons)}",
        "horizon_of_last_digit": between(exact, last_digit, size),
        "largest_tracked": max(d for _, d in exact["differences"]) / size,
        "largest_at_end": float(np.max(np.abs(exact["position"] - final))) / size,
        "spread_of_copies": spread / size,
        "mean_height": abs(ours["height"] - height) / span,
        "active_contacts": abs(ours["counts"][0] / exact["stored_counts"][0] - 1),
        "active_of_one_copy": error[0],
        "interactions": abs(ours["counts"][1] / exact["stored_counts"][1] - 1),
        "interactions_of_one_copy": error[1],
        "inside": " ".join(
            name
            for name, values, figure in (
                ("height", [o["height"] for o in others], height),
                ("active", [o["counts"][0] for o in others], counts[0]),
                ("interactions", [o["counts"][1] for o in others], counts[1]),
            )
            if inside(values, figure)
        ),
        **early,
        "unmapped": "; ".join(exact["unmapped"]),
    }


def compare_meshes(folder, case):
    """One row of the table for a case of deformable bodies: its tracked nodes at the stored steps, all nodes at the end."""
    scene = legacy.read_datbox(folder, "skip")
    sim = simulation(scene, case, 1e-10)
    with open(folder / "history.csv") as file:
        stored = {int(row["step"]): row for row in csv.DictReader(file)}
    meshes, axes = scene.legacy.datbox.meshes, "xyz"[: scene.dim]
    size = float(np.ptp(meshes[0].points, axis=0).max())
    horizon, within, largest = 0, True, 0.0
    for k in range(1, case["steps"] + 1):
        sim.step()
        if k not in stored:
            continue
        for m, n in case["tracked_nodes"]:
            x = np.array([float(stored[k][f"mesh{m}_node{n}_{a}"]) for a in axes])
            mine = sim.meshes[m - 1]
            largest = max(largest, float(np.max(np.abs(mine.body.points[n - 1] + mine.displacement[n - 1] - x))) / size)
        within = within and largest <= GATE
        horizon = k if within else horizon
    final = read_mesh_states(folder / "OUTBOX" / "DOF.OUT.1", meshes)
    at_end = max(np.max(np.abs(v.displacement - final[m.number][0])) for v, m in zip(sim.meshes, meshes))
    return {"steps": case["steps"], "horizon": horizon, "largest_tracked": largest, "largest_at_end": float(at_end) / size}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--copies", type=int, default=8)
    parser.add_argument("--only", nargs="*")
    parser.add_argument("--output", default=Path(__file__).parent / "results" / "legacy_samples.csv")
    options = parser.parse_args()
    default = Path(__file__).resolve().parents[1].parent / "shared"
    data = Path(os.environ.get("CAIRN_REFERENCE_DATA", default)) / "legacy"
    if not data.is_dir():
        raise SystemExit(f"{data}: the sample data are not here; say where by CAIRN_REFERENCE_DATA")
    warnings.simplefilter("ignore", legacy.UnmappedWarning)
    rows = []
    for folder in sorted(p for p in data.iterdir() if p.is_dir()):
        if options.only and folder.name not in options.only:
            continue
        case = json.loads((folder / "case.json").read_text())
        row = {"case": folder.name, "mapped": "yes"}
        try:
            legacy.read_datbox(folder)
        except legacy.LegacyError as error:
            row["unmapped"] = str(error).split("map this to: ")[-1].split(". Say")[0]
            row["mapped"] = "mechanics" if row["unmapped"].startswith("MP_DEM") else "no"
        if row["mapped"] != "no":
            meshed = compare_meshes(folder, case) if case["meshes"] else None
            row |= meshed or compare(folder, case, FEWER.get(folder.name, (0, options.copies))[1])
        rows.append(row)
        print({k: f"{v:.2e}" if isinstance(v, float) else v for k, v in row.items()}, flush=True)
    names = list(dict.fromkeys(name for row in rows for name in row))
    with open(options.output, "w", newline="") as file:
        writer = csv.DictWriter(file, names)
        writer.writeheader()
        writer.writerows({k: f"{v:.3g}" if isinstance(v, float) else v for k, v in row.items()} for row in rows)


if __name__ == "__main__":
    main()
