"""Cost and accuracy by mesh, step, integrator and tolerance, for an elastic impact and a plastic forming: sweeps of
benchmarks/study/impact.py and forming.py, tables in benchmarks/results, a picture in docs/images.

python benchmarks/meshes_study.py [--results FOLDER] [--picture FILE]
"""

from __future__ import annotations

import argparse
import csv
import shutil
import tempfile
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from cairn.study.sweep import sweep

HERE = Path(__file__).resolve().parent
PLANS = {
    "impact": {
        "cells": [25, 50, 100, 200], "courant": [0.25, 0.5, 1.0, 2.0], "tol": [1e-2, 1e-8],
        "integrator": ["theta 1/2", "theta 1", "HHT -0.1", "generalised alpha 0.8", "central differences"],
    },
    "forming": {"cells": [2, 4, 8, 16], "steps": [5, 10, 20, 40, 80], "theta": [0.6, 1.0], "tol": [1e-2, 1e-6]},
    "forming_reference": {"cells": [32], "steps": [320], "theta": [1.0], "tol": [1e-8]},
}  # fmt: skip


def rows_of(name, results):
    """Rows of a sweep that did not fail, numbers where they are numbers; its table goes to `results`."""
    plan = "".join(f"{key} = {values!r}\n".replace("'", '"') for key, values in PLANS[name].items())
    script = HERE / "study" / f"{name.partition('_')[0]}.py"
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "plan.toml"
        path.write_text(f'script = "{script}"\n\n[parameters]\n{plan}')
        table = sweep(path, processes=1)
        shutil.copy(table, results / f"study_{name}.csv")
    with open(results / f"study_{name}.csv", newline="") as file:
        rows = [row for row in csv.DictReader(file) if not row["failed"]]
    return [{key: _number(value) for key, value in row.items()} for row in rows]


def _number(text):
    try:
        return float(text)
    except ValueError:
        return text


def best(rows):
    """The rows that no other one beats in both error and CPU time, the cheapest first."""
    kept, least = [], np.inf
    for row in sorted(rows, key=lambda row: row["cpu_seconds"]):
        if row["error"] < least:
            kept.append(row)
            least = row["error"]
    return kept


def draw(axis, rows, by, label):
    """CPU time over error, a colour for each value of a parameter, and the Pareto front. Exact results are left out: central
    differences at Courant's step itself."""
    rows = [row for row in rows if row["error"] > 1e-10]
    for value in dict.fromkeys(row[by] for row in rows):
        some = [row for row in rows if row[by] == value]
        name = value if isinstance(value, str) else f"{by} {value:g}"
        axis.loglog([r["error"] for r in some], [r["cpu_seconds"] for r in some], ".", ms=5, label=name)
    front = best(rows)
    axis.loglog([r["error"] for r in front], [r["cpu_seconds"] for r in front], "k-", lw=0.8, label="the best")
    axis.set(xlabel=label, ylabel="CPU time [s]")
    axis.legend(fontsize=8)


def main():
    """Runs the sweeps, writes tables and picture, prints the best of each."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--results", type=Path, default=HERE / "results")
    parser.add_argument("--picture", type=Path, default=HERE.parent / "docs/images/study_meshes.png")
    options = parser.parse_args()
    options.results.mkdir(parents=True, exist_ok=True)
    impact, forming = (rows_of(name, options.results) for name in ("impact", "forming"))
    (reference,) = rows_of("forming_reference", options.results)
    for row in forming:
        row["error"] = float(np.hypot(*(row[name] / reference[name] - 1 for name in ("work", "bulge"))))
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.2), layout="constrained")
    draw(axes[0], impact, "integrator", "bar on a wall: error of the way of its end, over v L/c")
    draw(axes[1], forming, "cells", "upset block: error of work and bulge, relative")
    figure.savefig(options.picture, dpi=110)
    for name, rows, shown in (
        ("impact", impact, ("integrator", "cells", "courant", "tol")),
        ("forming", forming, ("cells", "steps", "theta", "tol")),
    ):
        for row in best(rows):
            words = ", ".join(f"{key} {row[key]}" for key in shown)
            print(f"{name}: error {row['error']:.2g} in {row['cpu_seconds']:.2g} s: {words}")


if __name__ == "__main__":
    main()
