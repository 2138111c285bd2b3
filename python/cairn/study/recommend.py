"""The cheapest setting for an asked accuracy, or why there is none."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from .measures import loose_reference, upper_bound
from .next_try import below_the_floor, none_attains
from .settings import Setting


@dataclasses.dataclass(frozen=True)
class Recommendation:
    """Recommended setting for an accuracy of a figure; false if there is none.

    setting: the Setting or None. error: the largest measured over the targets. upper: the largest that the error may be.
    floor: noise floor, below which errors are not resolved. cpu_seconds: geometric mean over the targets. dt: {target: step [s]}.
    reason: why nothing is recommended. next: suggestion for the next try, '' if a setting is recommended. words: the whole in
    words.
    """

    accuracy: float
    of: str
    setting: Setting | None
    error: float
    upper: float
    floor: float
    cpu_seconds: float
    dt: dict
    reason: str
    words: str
    next: str = ""

    def __bool__(self):
        return self.setting is not None

    def __str__(self):
        return self.words

    @property
    def line(self):
        """The strategy as a script says it; '' if nothing is recommended."""
        return self.setting.line() if self.setting and self.dt else ""


def recommend(table, accuracy, of, here=False):
    """The Recommendation from a table (see measures.table) for an accuracy of the figure `of`.

    A setting qualifies if the upper bound of its error (upper) is within the accuracy on every target, and if the same holds
    for all tighter tolerances of its family, which excludes settings that are accurate by coincidence. None qualifies for an
    accuracy below the noise floor. With `here` the upper bound holds for the scenes studied. Without, it also covers other
    scenes: it is the one-sided 95 % prediction bound of the logarithm of the error over the scenes, or three times the
    largest error if there is only one scene. Problems always count by themselves alone.
    """
    if not 0 < accuracy < math.inf:
        raise ValueError(f"accuracy is {accuracy}: give a positive number, 1e-3 say")
    rows = [row for row in table if row["figure"] == of]
    if not rows:
        known = ", ".join(dict.fromkeys(row["figure"] for row in table)) or "none yet"
        raise ValueError(f"the study has no figure {of!r}: it has {known}")
    targets = list(dict.fromkeys(row["target"] for row in rows))
    floor = max(row["floor"] for row in rows)
    empty = dict(accuracy=accuracy, of=of, setting=None, error=math.nan, upper=math.nan, floor=floor, cpu_seconds=math.nan, dt={})
    loose = loose_reference(rows)
    notes = f"\n  {loose}" if loose else ""
    if not floor <= accuracy:
        reason, next = _below_the_floor(rows, accuracy, of, floor), below_the_floor(table, rows, accuracy, floor)
        return Recommendation(**empty, reason=reason, words=f"{reason}{notes}\n  Next: {next}", next=next)
    here = here or rows[0]["kind"] == "problem"
    settings = _over_targets(rows, targets, here, floor)
    good = [s for s in settings if s["upper"] <= accuracy and _tighter_too(s, settings, accuracy)]
    if rows[0]["kind"] == "step":  # one step cannot judge the time step: the scene's own, or the nearest that was tried
        nearest = min((abs(math.log(s["dt_factor"])) for s in settings), default=0.0)
        good = [s for s in good if abs(math.log(s["dt_factor"])) <= nearest + 1e-9]
    if not good:
        reason, next = _none_attains(settings, accuracy, of), none_attains(settings, rows, accuracy, here)
        return Recommendation(**empty, reason=reason, words=f"{reason}{notes}\n  Next: {next}", next=next)
    best = min(good, key=lambda s: s["cpu_seconds"])
    setting = Setting(*(best[f.name] for f in dataclasses.fields(Setting)))
    words = _said(setting, best, rows[0]["kind"], accuracy, of, floor, settings)
    words += ("" if here else _elsewhere(len(targets))) + notes
    return Recommendation(
        accuracy, of, setting, best["error"], best["upper"], floor, best["cpu_seconds"], best["dt"], "", words
    )


def _over_targets(rows, targets, here, floor):
    """Each setting that was measured on every target: largest error, its upper bound, geometric mean of the cost."""
    settings = {}
    for row in rows:
        settings.setdefault(row["setting"], {})[row["target"]] = row
    out = []
    for each in settings.values():
        if len(each) < len(targets) or not all(math.isfinite(row["upper"]) for row in each.values()):
            continue
        first = next(iter(each.values()))
        uppers = [row["upper"] for row in each.values()]
        bound = max(uppers) if here else max([*uppers, upper_bound(uppers, floor)])
        out.append({
            **{f.name: _typed(f.name, first.get(f.name, "")) for f in dataclasses.fields(Setting)},
            "error": max(row["error"] for row in each.values()), "upper": bound, "measured_upper": max(uppers),
            "runs": min(row["runs"] for row in each.values()),
            "cpu_seconds": float(np.exp(np.mean([math.log(row["cpu_seconds"]) for row in each.values()]))),
            "dt": {name: row["dt"] for name, row in each.items() if row.get("dt") is not None},
            "not_converged": sum(row["not_converged"] for row in each.values()), "steps": sum(r["steps"] for r in each.values()),
        })
    return out


def _typed(name, value):
    if name == "warm_start":
        return bool(value)
    return int(value) if name in ("min_iter", "max_iter") else value


def _family(s):
    return (s["solver"], s["dt_factor"], s["warm_start"], s["min_iter"], s["max_iter"], s.get("integrator", ""),
            s.get("network_tol", 0.0), s.get("coupling", ""), s.get("mesh", 0.0), s.get("accuracy", 0.0),
            s.get("acceleration", ""))  # fmt: skip


def _tighter_too(s, settings, accuracy):
    return all(t["upper"] <= accuracy for t in settings if _family(t) == _family(s) and t["tol"] < s["tol"])


def _below_the_floor(rows, accuracy, of, floor):
    text = f"no setting is recommended: the noise floor of {of} is {floor:.2g}, above the accuracy asked for, {accuracy:g}"
    if not math.isfinite(floor):
        return text + "; the figure has no scale here (its reference is zero)"
    if rows[0]["kind"] == "statistics":
        return text
    return text + ". The answer is not known better: impulses are not unique there, or the reference is not tight"


def _none_attains(settings, accuracy, of):
    text = f"no setting that was tried surely attains {accuracy:g} for {of}"
    if not settings:
        return text + ": none was measured on every target"
    best = min(settings, key=lambda s: s["upper"])
    return text + (
        f": the best, {best['solver']} at tol = {best['tol']:g}, may err by {best['upper']:.2g} (measured: {best['error']:.2g})"
    )


def _elsewhere(targets):
    if targets == 1:
        return "\n  the margin for scenes that were not studied is a factor of 3: study several scenes of the kind to know it"
    return f"\n  the margin is for a scene that was not studied, from how {targets} scenes differ"


def _said(setting, best, kind, accuracy, of, floor, settings):
    lines = [f"For {of} to {accuracy:g}: solver {setting.solver}, tol = {setting.tol:g}"]
    if kind == "problem":
        lines.append(f"  cairn solve PROBLEM --solver {setting.solver} --tol {setting.tol:g}")
    else:
        steps = ", ".join(f"dt = {dt:g} s for {name}" for name, dt in best["dt"].items())
        lines.append(f"  strategy = {setting.line()}")
        if setting.of_networks:
            given = [f"tol={setting.network_tol:g}"] if setting.network_tol else []
            given += [f"coupling={setting.coupling}"] if setting.coupling else []
            lines.append(f"  networks of the scene: {', '.join(given)}")
        lines += [f"  build(mesh={setting.mesh:g})"] if setting.mesh else []
        lines.append(f"  {steps} ({setting.dt_factor:g} times the scene's own step)")
    lines.append(
        f"  measured error {best['error']:.2g}, with its margin at most {best['upper']:.2g}; noise floor {floor:.2g}; "
        f"{best['cpu_seconds']:.3g} CPU s a {'run' if kind == 'statistics' else 'step' if kind == 'step' else 'solve'}"
    )
    dearest = max(s["cpu_seconds"] for s in settings)
    if dearest > 1.5 * best["cpu_seconds"]:
        lines.append(f"  the most expensive setting that was tried costs {dearest / best['cpu_seconds']:.2g} times as much")
    if best["not_converged"]:
        lines.append(f"  {best['not_converged']} of {best['steps']} solves ended before their tolerance; the errors hold that")
    if kind == "step":
        lines.append("  one step says nothing on the time step: ask for a statistic to choose it")
    return "\n".join(lines)
