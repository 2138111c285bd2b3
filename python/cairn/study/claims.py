"""Error estimates of a step compared with true errors: info["velocity_error"], which NSCD(accuracy=...) controls, and the time
discretisation error by step doubling, Simulation.time_error."""

from __future__ import annotations

import math
from collections import defaultdict

import numpy as np

from .._core import Error
from ..run.time_error import End, EnergyNorm, apart

PARTS = 8  # of a step, whose end is taken for the exact one in time
COLUMNS = (
    "velocity_told", "velocity_true", "time_told_velocity", "time_true_velocity", "time_told_position", "time_true_position",
    "time_order",
)  # fmt: skip


def exact_in_time(sim):
    """The end of the coming step made in PARTS, by name, for the file of a reference; steps are not undone."""
    for _ in range(PARTS):
        sim.step(sim.dt / PARTS)
    return {f"in_time_{name}": value for name, value in End(sim).as_arrays().items()}


def told_in_time(sim, reference):
    """Estimated error in time of the simulation's next step; empty if the reference has no exact end."""
    if "in_time_end_velocity_0" not in reference:
        return {}
    try:
        told = sim.time_error()
    except Error:  # the step cannot be made in halves
        return {}
    return {"time_told_velocity": told["velocity"], "time_told_position": told["position"], "time_order": told["order"]}


class Begin:
    """A simulation at the begin of a step that is set against the truth."""

    def __init__(self, sim):
        self._sim, self._end, self._norm = sim, End(sim), EnergyNorm(sim)

    def against(self, reference, info):
        """Errors of the last step: estimated and true error of its velocities, and of its time discretisation."""
        out = {}
        arrays = {name: reference[name] for name in reference if name.startswith("end_")}
        if arrays:
            told = info.get("velocity_error", math.nan)
            out |= {"velocity_told": told, "velocity_true": self._apart(arrays, info["dt"], of_step=True)}
        in_time = {name[len("in_time_") :]: reference[name] for name in reference if name.startswith("in_time_")}
        if in_time:
            velocity, position = self._apart(in_time, info["dt"])
            out |= {"time_true_velocity": velocity, "time_true_position": position}
        return out

    def _apart(self, arrays, h, of_step=False):
        """(velocity, position); for the step as posed the velocity alone, over its own speeds, the error bounded by accuracy=."""
        exact, now = End.of_arrays(arrays), End(self._sim)
        if not of_step:
            return apart(self._sim, self._norm, self._end, now, exact, h)
        scale = max(self._norm(exact.velocity), self._norm.of_loads(self._sim, h))
        error = self._norm([a - b for a, b in zip(now.velocity, exact.velocity)])
        return error / scale if scale > 0 else 0.0


def table(rows):
    """One row for each target and setting of steps: number of converged steps, number of these whose velocity error is within the
    requested accuracy (held), medians and largest values of estimated and true errors, and the same in time."""
    groups = defaultdict(list)
    for row in rows:
        if row["kind"] == "step" and row["role"] == "trial" and any(name in row for name in COLUMNS):
            groups[row["target"], row["setting"]].append(row)
    return [_of_setting(some) for some in groups.values()]


def _of_setting(rows):
    first = rows[0]
    names = ("target", "solver", "acceleration", "accuracy", "tol", "dt", "dt_factor", "warm_start", "integrator")
    out = {name: first[name] for name in names if name in first}
    converged = [row for row in rows if not row["not_converged"]]
    out |= {"steps": len(rows), "converged": len(converged)}
    out["iterations"] = float(np.median([row.get("iterations", 0) for row in rows]))
    if "accuracy" in first:
        out["held"] = sum(row.get("velocity_true", math.inf) <= row["accuracy"] for row in converged)
    for name in COLUMNS[:-1]:
        values = [row[name] for row in rows if np.isfinite(row.get(name, math.nan))]
        if values:
            out |= {f"{name}_median": float(np.median(values)), f"{name}_largest": max(values)}
    pairs_of = {"velocity": "velocity_told", "time_velocity": "time_told_velocity", "time_position": "time_told_position"}
    for what, told in pairs_of.items():
        true = told.replace("told", "true")
        pairs = [(row[told], row[true]) for row in rows if row.get(told, math.nan) > 0 and row.get(true, 0) > 0]
        if pairs:
            out[f"{what}_told_over_true"] = float(np.exp(np.median([math.log(a / b) for a, b in pairs])))
    return out


def said(table):
    """The table in words, a line for each setting."""
    lines, several = [], len({row["target"] for row in table}) > 1
    for row in table:
        name = " ".join(str(word) for word in (row["solver"], row.get("acceleration", "")) if word)
        asked = f"accuracy {row['accuracy']:g}" if "accuracy" in row else f"tol {row['tol']:g}"
        text = f"  {row['target']}: " if several else "  "
        text += f"{name}, {asked}: {row['converged']} of {row['steps']} steps converged"
        if "held" in row:
            text += f", of which {row['held']} held it"
        if "velocity_told_median" in row:
            text += f"; velocities told {row['velocity_told_median']:.1e}, true {row['velocity_true_median']:.1e}"
            text += f" (largest {row['velocity_told_largest']:.1e}, {row['velocity_true_largest']:.1e})"
        if "time_told_velocity_median" in row:
            text += f"; in time told {row['time_told_velocity_median']:.1e}, true {row['time_true_velocity_median']:.1e}"
            text += f", of the way {row['time_told_position_median']:.1e} and {row['time_true_position_median']:.1e}"
        lines.append(text)
    return ["what steps tell of their own errors, medians:", *lines] if lines else []
