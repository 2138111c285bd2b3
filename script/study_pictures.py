"""Draws the pictures of docs/study.md and docs/cohesion.md anew from the tables in benchmarks/results, without measuring."""

import csv
from pathlib import Path

from cairn.study import plots

ROOT = Path(__file__).resolve().parents[1]
PICTURES = [  # table, figure, accuracy asked for
    ("arch", "crown", 3e-3),
    ("wall", "displacement", 0.1),
    ("flow", "solid_fraction", 1e-3),
    ("one_step", "step_velocity", 1e-3),
    ("wheel", "bonds", None),
    ("cantilever", "force", None),
    ("brake", "surface", None),
    ("mesh_impact", "rebound", None),
    ("mesh_forming", "force", None),
]
WORDS = ("target", "kind", "figure", "setting", "solver", "integrator", "acceleration", "coupling")


def table(name):
    """Rows of a table, numbers as numbers."""
    with open(ROOT / f"benchmarks/results/study_{name}.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return [{key: value if key in WORDS or value == "" else float(value) for key, value in row.items()} for row in rows]


for name, figure, accuracy in PICTURES:
    plots.work_precision(table(name), figure, accuracy).savefig(
        ROOT
        / f"docs/images/study_{name}_{figure}.png".replace("study_mesh_impact_rebound", "study_mesh_impact").replace(
            "study_mesh_forming_force", "study_mesh_forming"
        ),
        dpi=110,
    )
    print(name, figure)
