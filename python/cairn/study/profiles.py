"""Performance profiles (Dolan & More 2002): for each solver, the share of problems it solves within tau times the best."""

from __future__ import annotations

import math

import numpy as np


def performance_profile(costs):
    """costs: {solver: (problems,) cost, inf or nan where it failed}. Returns {solver: (tau (k,), share (k,))}, both rising.

    share[i] = problems with cost <= tau[i] times the least cost of any solver for it, over all problems, also those that
    none solved. tau begins at 1.
    """
    names = list(costs)
    table = np.array([np.asarray(costs[name], float) for name in names])
    if table.ndim != 2 or table.shape[1] == 0:
        raise ValueError("a profile needs costs of each solver on the same problems: give arrays of one length, not empty")
    table = np.where(np.isnan(table), np.inf, table)
    if np.any(table <= 0):
        raise ValueError("a cost is zero or negative: a profile divides by the least cost")
    best = table.min(axis=0)
    with np.errstate(invalid="ignore"):
        ratios = np.where(np.isfinite(table), table / best, np.inf)
    out = {}
    for name, ratio in zip(names, ratios):
        tau = np.unique(np.append(ratio[np.isfinite(ratio)], 1.0))
        out[name] = tau, np.array([np.count_nonzero(ratio <= t) for t in tau]) / len(ratio)
    return out


def cheapest_costs(table, figure, accuracy):
    """{solver: (targets,) CPU seconds of its cheapest setting with an error of at most accuracy, inf if none}, names of targets.

    Targets whose noise floor is above the accuracy are left out: there nothing can be said.
    """
    rows = [row for row in table if row["figure"] == figure]
    targets = list(dict.fromkeys(row["target"] for row in rows))
    known = [t for t in targets if max(row["floor"] for row in rows if row["target"] == t) <= accuracy]
    out = {solver: np.full(len(known), math.inf) for solver in dict.fromkeys(row["solver"] for row in rows)}
    for row in rows:
        if row["target"] in known and row["error"] <= accuracy:
            k = known.index(row["target"])
            out[row["solver"]][k] = min(out[row["solver"]][k], row["cpu_seconds"])
    return out, known
