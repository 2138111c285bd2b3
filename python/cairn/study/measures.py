"""From rows to errors: paired differences with Student's intervals, noise floors, costs."""

from __future__ import annotations

import math
from collections import defaultdict

import numpy as np

CONFIDENCE = 0.95
STEP_FIGURES = ("step_velocity", "step_boundary_force")
PROBLEM_FIGURES = ("true_error", "velocity")


def student(confidence, degrees, two_sided=True):
    """Quantile of Student's t."""
    from scipy import special

    share = 0.5 + confidence / 2 if two_sided else confidence
    return float(special.stdtrit(degrees, share))


def interval(values, confidence=CONFIDENCE):
    """Mean of values (n,) and half width of its confidence interval (Student)."""
    values = np.asarray(values, float)
    n = len(values)
    if n < 2:
        return float(values.mean()) if n else math.nan, math.inf
    return float(values.mean()), student(confidence, n - 1) * float(values.std(ddof=1)) / math.sqrt(n)


def noise_floor(reference, scale, confidence=CONFIDENCE):
    """Half width of the interval for the difference of two sets of n runs that do the same, relative to scale.

    Below it two settings cannot be told apart by n runs that are as scattered as the reference's own.
    """
    n = len(reference)
    return student(confidence, n - 1) * float(np.std(reference, ddof=1)) * math.sqrt(2 / n) / scale


def paired_error(values, reference, scale, confidence=CONFIDENCE):
    """(error, largest it may be) of a mean: the runs are paired by their perturbation. values, reference: {seed: number}."""
    seeds = sorted(values.keys() & reference.keys())
    mean, half = interval([values[s] - reference[s] for s in seeds], confidence)
    return abs(mean) / scale, (abs(mean) + half) / scale


def upper_bound(errors, floor, confidence=CONFIDENCE):
    """Upper bound of a further error of the same kind: one-sided prediction interval of log-normally distributed errors.

    Errors are raised to the floor and to a tenth of the largest, since an answer that is exact by chance tells nothing of the
    others. A single error has no known spread: the bound is three times its value.
    """
    errors = np.asarray(errors, float)
    logs = np.log(np.maximum(errors, max(floor, errors.max() / 10, np.finfo(float).tiny)))
    n = len(logs)
    if n == 1:
        return 3 * float(np.exp(logs[0]))
    width = student(confidence, n - 1, two_sided=False) * logs.std(ddof=1) * math.sqrt(1 + 1 / n)
    with np.errstate(over="ignore"):
        return float(np.exp(logs.mean() + width))


SETTING = ("setting", "solver", "tol", "dt", "dt_factor", "warm_start", "min_iter", "max_iter", "integrator",
           "network_tol", "coupling", "mesh", "accuracy", "acceleration")  # fmt: skip


def table(rows, figures, confidence=CONFIDENCE):
    """One row for each target, setting and figure: error, upper (its upper bound), floor, cpu_seconds, runs, not_converged, and
    for the reference reference_tol, reference_error (the largest true error) and reference_not_converged (solves).

    rows: of the store. figures: names of the statistics' figures. cpu_seconds: of a run, of a step, or of a solve.
    """
    groups = defaultdict(list)
    for row in rows:
        groups[row["target"], row["kind"]].append(row)
    out = []
    for (_, kind), some in groups.items():
        if kind == "statistics":
            out += _statistics(some, figures, confidence)
        elif kind in ("step", "problem"):
            out += _direct(some, STEP_FIGURES if kind == "step" else PROBLEM_FIGURES, confidence)
    return out


def loose_reference(rows):
    """Says that references of a figure (rows of the table) ended above their tolerance, and how far; '' if none did."""
    kind = rows[0]["kind"]
    failed = [row for row in rows if row.get("reference_not_converged")]
    if not failed:
        return ""
    # comparisons of steps have a reference for each time step; runs share a single reference
    some = {(row["target"], row["dt_factor"] if kind == "step" else None): row for row in failed}.values()
    failed, all_of_them = (sum(row[f"reference_{name}"] for row in some) for name in ("not_converged", "steps"))
    unit = "steps" if kind == "statistics" else "solves"
    return (
        f"{failed} of {all_of_them} {unit} of the reference ended above its tolerance of "
        f"{min(row['reference_tol'] for row in some):g}, the worst at {max(row['reference_error'] for row in some):.2g}"
    )


def _by_setting(rows):
    out = defaultdict(list)
    for row in rows:
        out[row["setting"]].append(row)
    return out


def _common(rows, figure):
    first = rows[0]
    steps = sum(row["steps"] for row in rows)
    return {
        "target": first["target"], "kind": first["kind"], "figure": figure,
        **{name: first[name] for name in SETTING if name in first},
        "cpu_seconds": float(np.mean([row["cpu_seconds"] for row in rows])), "runs": len(rows),
        "iterations": sum(row.get("iterations", 0) for row in rows) / max(steps, 1),
        "not_converged": sum(row["not_converged"] for row in rows), "steps": steps,
        "true_error": max(row["error"] for row in rows), "stopped": sum(row.get("stopped", 0) for row in rows),
    }


def _reference(rows):
    """How well the references themselves were solved."""
    return {
        "reference_tol": min(row["tol"] for row in rows), "reference_error": max(row["error"] for row in rows),
        "reference_not_converged": sum(row["not_converged"] for row in rows),
        "reference_steps": sum(row["steps"] for row in rows),
    }


def _statistics(rows, figures, confidence):
    reference = [row for row in rows if row["role"] == "reference"]
    out = []
    for figure in figures:
        # not all seeds may be there yet, and a figure may be new
        base = {row["seed"]: row[figure] for row in reference if np.isfinite(row.get(figure, np.nan))}
        if len(base) < 2:
            continue
        mean = float(np.mean(list(base.values())))
        given = [row[f"scale_{figure}"] for row in reference if f"scale_{figure}" in row]
        scale = float(np.mean(given)) if given else abs(mean)
        floor = noise_floor(list(base.values()), scale, confidence) if scale > 0 else math.inf
        for some in _by_setting(row for row in rows if row["role"] == "trial").values():
            values = {row["seed"]: row[figure] for row in some if figure in row}
            if len(values.keys() & base.keys()) < 2 or not scale > 0:
                continue
            error, upper = paired_error(values, base, scale, confidence)
            out.append({
                **_common(some, figure), **_reference(reference), "error": error, "upper": upper, "floor": floor,
                "value": float(np.mean(list(values.values()))), "reference": mean, "scale": scale,
            })
    return out


def _direct(rows, figures, confidence):
    """Errors that each row holds already: of one step from common states, of problems."""
    out = []
    for figure in figures:
        references = defaultdict(list)
        for row in rows:
            if row["role"] == "reference" and np.isfinite(row.get(figure, np.nan)):
                references[row["dt_factor"]].append(row)
        for some in _by_setting(row for row in rows if row["role"] == "trial").values():
            errors = [row[figure] for row in some if np.isfinite(row.get(figure, np.nan))]
            reference = references.get(some[0]["dt_factor"])
            if not errors or reference is None:
                continue
            floor = max(row[figure] for row in reference)
            single = some[0]["kind"] == "problem"  # a solve gives the same answer each time
            out.append({
                **_common(some, figure), **_reference(reference), "error": float(np.sqrt(np.mean(np.square(errors)))),
                "upper": float(errors[0]) if single else upper_bound(errors, floor, confidence), "floor": floor,
            })
    return out
