"""Tuned on one scene, tried on another: does the setting that a study recommends attain the accuracy where it was not tuned?

    python benchmarks/study_holdout.py [--folder FOLDER] [--cases wall flow ...] > benchmarks/results/study_holdout.csv

For each case a study sweeps settings over the scene (or scenes) of benchmarks/study that it is tuned on and recommends one for an
accuracy of a figure. That setting alone is then measured on the held-out scene, against that scene's own reference: other sizes,
numbers, friction, seeds, geometry. CSV on standard output; a study that was stopped goes on from its folder. The tables of the
tuned studies and their plots are written to benchmarks/results and docs/images with --keep.
"""

from __future__ import annotations

import argparse
import csv
import sys
from pathlib import Path

from cairn import study

HERE = Path(__file__).resolve().parent
SCENES = HERE / "study"
SWEEP = {
    "solvers": ["NLGS"], "tolerances": (0.3, 0.1, 0.03, 0.01), "dt_factors": (1.0, 2.0), "warm_start": (True,), "max_iter": 2000,
}
STATISTICS = {
    "one_step": False, "prepare_tol": 1e-2, "runs": 8, "max_seconds": 60.0, "reference_tol": 1e-3, "reference_dt_factor": 0.5,
}
STEP = {"states": 4, "duration": 0.0, "prepare_tol": 1e-2}
# name: (tuned on [(scene, options)], held out (scene, options), figures, [(figure, accuracy)], sweep, protocol)
CASES = {
    "arch": (
        [("arch", {}), ("arch", {"voussoirs": 11, "friction": 0.8, "span": 150.0}), ("arch", {"voussoirs": 19, "speed": 0.08}),
         ("arch", {"radius": 2.0, "thickness": 0.25})],
        ("arch", {"voussoirs": 21, "friction": 0.6, "thickness": 0.25, "speed": 0.07, "span": 155.0, "radius": 1.5}),
        ["boundary_force:left support", "crown", "displacement"],
        [("crown", 3e-3), ("displacement", 0.1), ("boundary_force:left support", 0.1)],
        {"dt_factors": (1.0, 2.0, 4.0)},
        {**STATISTICS, "samples": 100},
    ),
    "wall": (
        [("wall", {}), ("wall", {"courses": 5, "columns": 4, "friction": 0.5}), ("wall", {"frequency": 5.0, "acceleration": 4.5}),
         ("wall", {"brick": (0.15, 0.1), "columns": 4})],
        ("wall", {"courses": 7, "columns": 4, "brick": (0.22, 0.09), "friction": 0.55, "acceleration": 4.3, "frequency": 4.5}),
        ["displacement", "mean_height", "boundary_force"],
        [("displacement", 0.1), ("mean_height", 5e-3), ("boundary_force", 5e-2)],
        {},
        STATISTICS,
    ),
    "heap": (
        [("heap", {}), ("heap", {"disks": 60, "seed": 2, "width": 10}), ("heap", {"seed": 3, "friction": 0.6, "spread": 0.4})],
        ("heap", {"disks": 110, "seed": 7, "friction": 0.5, "spread": 0.35, "width": 14}),
        ["boundary_force:wall", "solid_fraction", "mean_height"],
        [("solid_fraction", 2e-2), ("mean_height", 2e-2), ("boundary_force:wall", 0.5)],
        {"tolerances": (0.3, 0.1, 0.03, 0.01, 3e-3)},
        {**STATISTICS, "reference_tol": 3e-4},
    ),
    "flow": (
        [("flow", {}), ("flow", {"seed": 2, "friction": 0.5, "inertial": 0.15}),
         ("flow", {"disks": 45, "seed": 3, "spread": 0.3})],
        ("flow", {"disks": 80, "seed": 5, "friction": 0.3, "spread": 0.25, "inertial": 0.12}),
        ["solid_fraction", "shear_stress", "kinetic_energy"],
        [("solid_fraction", 5e-2), ("solid_fraction", 1e-3), ("shear_stress", 0.5)],
        {},
        {**STATISTICS, "samples": 200},
    ),
    "one step": (
        [("wall", {}), ("heap", {}), ("flow", {}), ("arch", {})],
        ("spheres", {}),
        [],
        [("step_velocity", 0.5), ("step_velocity", 0.1), ("step_velocity", 1e-3), ("step_boundary_force", 0.1)],
        {"tolerances": (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6), "dt_factors": (1.0,), "warm_start": (False,), "max_iter": 50_000},
        STEP,
    ),
}
COLUMNS = (
    "case", "figure", "accuracy", "tuned_on", "setting", "dt_factor", "tuned_error", "tuned_upper", "tuned_floor", "tuned_cpu_s",
    "saved", "held_out", "held_out_error", "held_out_upper", "held_out_floor", "held_out_cpu_s", "attained", "said",
)


def tune(name, folder, workers):
    """The study of a case on the scenes that it may see."""
    tuned, _, figures, _, sweep, protocol = CASES[name]
    scenes = [(SCENES / f"{scene}.py", options) for scene, options in tuned]
    s = study.run(
        scenes, folder / f"{name} tuned", figures=figures, sweep={**SWEEP, **sweep}, workers=workers, say=_say, **protocol
    )
    if not s.whole:
        raise KeyboardInterrupt
    return s


def try_out(name, folder, workers, recommended):
    """The study of the recommended settings alone, on the held-out scene."""
    _, (scene, options), figures, _, sweep, protocol = CASES[name]
    rows = []
    for setting in dict.fromkeys(recommended):
        only = {
            "solvers": [setting.solver], "tolerances": (setting.tol,), "dt_factors": (setting.dt_factor,),
            "warm_start": (setting.warm_start,), "min_iter": (setting.min_iter,), "max_iter": setting.max_iter,
        }
        found = study.run(
            SCENES / f"{scene}.py", folder / f"{name} held out", options=options, figures=figures, sweep=only, workers=workers,
            say=_say, **protocol,
        )
        if not found.whole:
            raise KeyboardInterrupt
        rows += found.table
    return rows


def _name(scene, options):
    return " ".join([scene, *(f"{key}={value}" for key, value in options.items())])


def _say(text):
    print(text, file=sys.stderr)


def case(name, folder, workers):
    """Rows of a case, and its tuned study."""
    tuned, (scene, options), _, asked, _, _ = CASES[name]
    s = tune(name, folder, workers)
    found = [s.recommend(accuracy, of) for of, accuracy in asked]
    held = try_out(name, folder, workers, [f.setting for f in found if f])
    on = ", ".join(_name(*target) for target in tuned)
    out = []
    for f in found:
        row = {"case": name, "figure": f.of, "accuracy": f.accuracy, "tuned_on": on, "said": f.reason}
        row["tuned_floor"] = f"{f.floor:.2g}"
        row["held_out"] = _name(scene, options)
        if f:
            there = next(r for r in held if r["figure"] == f.of and r["setting"] == f.setting.key())
            dearest = max(r["cpu_seconds"] for r in s.table if r["figure"] == f.of)
            row |= {
                "setting": f.line, "dt_factor": f.setting.dt_factor, "tuned_error": f"{f.error:.2g}",
                "tuned_upper": f"{f.upper:.2g}", "tuned_cpu_s": f"{f.cpu_seconds:.3g}",
                "saved": f"{dearest / f.cpu_seconds:.3g}", "held_out_error": f"{there['error']:.2g}",
                "held_out_upper": f"{there['upper']:.2g}", "held_out_floor": f"{there['floor']:.2g}",
                "held_out_cpu_s": f"{there['cpu_seconds']:.3g}", "attained": verdict(there, f.accuracy),
            }
        out.append(row)
    return out, s


def verdict(row, accuracy):
    """yes: surely; measured: the error is within, its interval not wholly; no."""
    if row["upper"] <= accuracy:
        return "yes"
    return "measured" if row["error"] <= accuracy else "no"


def keep(name, s):
    """Table and plots of a tuned study, for the documentation."""
    from cairn.study.store import write_csv

    stem = f"study_{name.replace(' ', '_')}"
    write_csv(HERE / "results" / f"{stem}.csv", s.table)
    for of, accuracy in CASES[name][3][:3]:
        s.plot(of, HERE.parent / "docs" / "images" / f"{stem}_{of.partition(':')[0]}.png", accuracy)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", nargs="+", default=list(CASES), choices=list(CASES))
    parser.add_argument("--folder", type=Path, default=Path("study_holdout"))
    parser.add_argument("--workers", "-j", type=int)
    parser.add_argument("--keep", action="store_true")
    options = parser.parse_args()
    writer = csv.DictWriter(sys.stdout, COLUMNS, lineterminator="\n")
    writer.writeheader()
    for name in options.cases:
        rows, s = case(name, options.folder, options.workers)
        writer.writerows(rows)
        sys.stdout.flush()
        if options.keep:
            keep(name, s)


if __name__ == "__main__":
    main()
