"""Suggestion for the next try where no setting can be recommended: a single change supported by the measurements, as an option to
type."""

from __future__ import annotations

import math

MOST_RUNS = 10_000  # larger numbers of runs are not suggested
LEAST_TOL = 1e-13  # of true errors: doubles hold no more


def below_the_floor(table, rows, accuracy, floor):
    """Advice where the noise floor of a figure (its rows of the table) is above the accuracy."""
    kind, of = rows[0]["kind"], rows[0]["figure"]
    others = {row["figure"]: row["floor"] for row in sorted(table, key=lambda row: row["floor"]) if row["figure"] != of}
    known = [name for name, other in others.items() if other <= accuracy]
    if not math.isfinite(floor):
        return f"another figure, {' or '.join(others) or '--figure list lists them'}: this one has no scale to be measured by"
    ask = f"ask for {1.05 * floor:.2g} or more"
    if kind == "statistics":
        runs = min(row["runs"] for row in rows)
        needed = math.ceil(runs * (floor / accuracy) ** 2)
        if needed < MOST_RUNS:
            return f"about {needed} runs instead of {runs}: --runs {needed}; or {ask}"
        return f"{ask}, for no number of runs would do"
    if any(row.get("reference_not_converged") for row in rows):
        return f"a reference by another solver, cairn.study.run(..., reference_solver=\"ADMM\"); or {ask}"
    if known:
        return f"a figure that is known so well here, --of {known[0]}; or {ask}"
    if kind == "step":
        return f"a mean over runs, which is known where one step is not: --duration SECONDS --of boundary_force; or {ask}"
    return ask


def none_attains(settings, rows, accuracy, here):
    """Advice where no setting attains the accuracy. settings: as recommend makes them from the figure's rows of the table."""
    kind = rows[0]["kind"]
    if not settings:
        return _nothing_measured(rows)
    lucky = [s for s in settings if s["upper"] <= accuracy]
    if lucky:
        return _luck(min(lucky, key=lambda s: s["upper"]), settings, accuracy)
    inside = [s for s in settings if s["measured_upper"] <= accuracy]
    if not here and inside:
        scenes = len({row["target"] for row in rows})
        return (
            f"more scenes of the kind than {scenes}, of which the margin for others is taken (pile.py:seed=1 pile.py:seed=2); "
            f"or --here, for these alone: {_named(min(inside, key=lambda s: s['cpu_seconds']))} attains it on them"
        )
    best = min(settings, key=lambda s: s["upper"])
    if best["error"] <= accuracy and (more := _more_runs(best, kind, accuracy)):
        return more
    family = sorted((s for s in settings if _family(s) == _family(best)), key=lambda s: s["tol"])
    tightest = family[0]
    if tightest["not_converged"]:
        return (
            f"more iterations, --max-iter {10 * tightest['max_iter']}, or another of --solvers: {tightest['not_converged']} of "
            f"{tightest['steps']} solves of {_named(tightest)} ended before their tolerance"
        )
    return _along_tolerance(family, accuracy) or _beside_tolerance(settings, kind)


def _nothing_measured(rows):
    stopped = sum(bool(row.get("stopped")) for row in rows)
    if stopped:
        return (
            f"more CPU seconds for a run, --max-seconds, or a shorter --duration: runs of {stopped} settings were stopped, or "
            "went where no step can be made"
        )
    return "one call with all targets and the same --tolerances, --solvers and --dt-factors for them"


def _luck(best, settings, accuracy):
    """A setting attains it, and a tighter one of its kind does not."""
    failing = [s for s in settings if _family(s) == _family(best) and s["tol"] < best["tol"] and s["upper"] > accuracy]
    worst = min(failing, key=lambda s: s["tol"])
    text = f"{_named(best)} attains it, but {_named(worst)} may err by {worst['upper']:.2g}, so that the former is luck"
    if worst["not_converged"]:
        return f"more iterations, --max-iter {10 * worst['max_iter']}: {text}"
    if worst["runs"] > 1:
        return f"twice the runs (--runs) or states (--states), {2 * worst['runs']}: {text}"
    return f"another of --solvers: {text}"


def _more_runs(best, kind, accuracy):
    """The mean is within the accuracy, but its confidence interval is not: more runs or a longer average narrow the interval."""
    runs = best["runs"]
    if kind == "statistics" and best["error"] < accuracy:
        needed = math.ceil(runs * ((best["measured_upper"] - best["error"]) / (accuracy - best["error"])) ** 2)
        if runs < needed < MOST_RUNS:
            return f"more runs for a smaller interval, --runs {needed}: {_named(best)} errs by {best['error']:.2g} with {runs}"
    if kind == "step":
        return f"more states for a smaller interval, --states {2 * runs}: {_named(best)} errs by {best['error']:.2g} on {runs}"
    return ""


def _along_tolerance(family, accuracy):
    """Tolerances at which the errors of a family (the tightest first) come down to the accuracy, if they fall with it."""
    if len(family) == 1:
        tol = family[0]["tol"]
    else:
        low, high = family[:2]
        falls = math.log(max(high["upper"], 1e-300) / max(low["upper"], 1e-300)) / math.log(high["tol"] / low["tol"])
        if falls < 0.2:  # a hundred times the cost for a third of the error: something else holds it up
            return ""
        tol = low["tol"] * (accuracy / low["upper"]) ** (1 / falls)
    wanted = 10.0 ** math.floor(math.log10(tol) - 1e-9)
    if wanted < LEAST_TOL:
        return ""
    return f"tighter tolerances, --tolerances {wanted:.0e} {wanted / 10:.0e}"


def _beside_tolerance(settings, kind):
    """Advice where tighter tolerances gain nothing."""
    factor, solvers = min(s["dt_factor"] for s in settings), {s["solver"] for s in settings}
    other = next((name for name in ("Auto", "PPANewton") if name not in solvers), None)
    if kind == "statistics":
        return f"a smaller time step, --dt-factors {factor / 2:g} {factor / 4:g}: the error does not fall with the tolerance"
    if kind == "problem":
        other = next((name for name in ("auto", "ppa_newton") if name not in solvers), None)
    if other:
        return f"another solver, --solvers {other}: the error of {', '.join(sorted(solvers))} does not fall with the tolerance"
    return "another figure (--of), for this one does not get better with the tolerance"


def _family(s):
    return (s["solver"], s["dt_factor"], s["warm_start"], s["min_iter"], s["max_iter"], s.get("integrator", ""),
            s.get("network_tol", 0.0), s.get("coupling", ""), s.get("mesh", 0.0), s.get("accuracy", 0.0),
            s.get("acceleration", ""))  # fmt: skip


def _named(s):
    return f"{s['solver']} at tol = {s['tol']:g}"
