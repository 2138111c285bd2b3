"""A study from start to end: plans the tasks, skips finished ones, runs the rest in parallel, then writes tables and a
summary."""

from __future__ import annotations

import os
from collections import Counter
from pathlib import Path

from ..names import listed
from . import claims, measures, store
from . import figures as builtin
from .plan import Plan, Protocol
from .pool import Pool
from .settings import TOLERANCES
from .targets import Target

FIGURES = ("solid_fraction", "boundary_force", "kinetic_energy")


def run(what, folder=None, *, figures=None, options=None, dt=None, sweep=None, workers=None, progress=True, say=None, **protocol):
    """Sweeps settings over scenes or problems and returns a Study. Tasks finished by an earlier run in the folder are not
    repeated.

    what: paths (or one) of scenes of Scene.save, of .py files that define build(**options) -> Scene or Simulation, or of
    frictional contact problems; or a Scene. A pair (path, options) is a .py with options of its own.
    folder: for rows and tables (default: <first name>.study beside the first).
    figures: names of figures.SUMMARY or of functions figure_<name>(sim) in the .py file. options: of build. dt: time step of
    the scenes [s]; a .py may set DT, or return a Simulation, which has one.
    sweep: dict of solvers, tolerances, dt_factors, warm_start, min_iter, max_iter, integrators, accuracies of NSCD, accelerations
    of NLGS ("nesterov", "none"), and meshes, numbers that build(mesh=...) of a .py file gets.
    workers: processes (default: cores).
    say: function that receives messages on the progress (default: print). progress: as Progress.

    Options of the protocol: prepare: time [s] to the last of the common states (default: PREPARE of the .py file, or 0); states:
    their number; one_step: compare a single step from these; in_time: compare its error in time, as by Simulation.time_error,
    with eight steps of an eighth; duration [s] of the perturbed runs (DURATION; none without it);
    runs: how many, at least 8; perturbation: share of the radius; averaged: share of a run; samples: in it; step_tol,
    reference_tol, reference_dt_factor, reference_solver, reference_mesh (default: the largest of meshes): of the reference;
    prepare_tol; max_seconds: CPU seconds of a run at most.
    """
    folder, targets, plan = _planned(what, folder, figures, options, dt, sweep, protocol)
    names, say = plan.protocol.figures, print if say is None else say
    (Path(folder) / "states").mkdir(parents=True, exist_ok=True)
    with store.Store(folder) as rows:
        _say_changed(rows, targets, say)
        rows.declare(_columns(targets, names))
        whole = _do(plan, rows, workers, progress, say)
        wanted = {task["row"]["key"] for task in plan.tasks()}
        study = Study(folder, [row for key, row in rows.rows.items() if key in wanted], names, whole)
    study.write()
    return study


def planned(what, folder=None, *, figures=None, options=None, dt=None, sweep=None, **protocol):
    """Tasks of run(): {kind of task: (all, unfinished)}. Computes nothing."""
    folder, _, plan = _planned(what, folder, figures, options, dt, sweep, protocol)
    known = store.read_rows(folder)
    missing = Counter(task["kind"] for stage in _waiting(plan, known) for task in stage)
    return {kind: (total, missing[kind]) for kind, total in Counter(task["kind"] for task in plan.tasks()).items()}


def _planned(what, folder, figures, options, dt, sweep, protocol):
    folder, targets = _targets(what, folder, options, dt)
    protocol = Protocol(figures=tuple(_figures(targets, figures)), **protocol)
    sweep = {"solvers": None, "tolerances": TOLERANCES, **(sweep or {})}
    return folder, targets, Plan(targets, sweep, protocol, folder)


def _targets(what, folder, options, dt):
    from ..model.scene import Scene

    if isinstance(what, Scene):
        if folder is None:
            raise ValueError("folder is missing: a scene from memory needs one for its rows")
        os.makedirs(folder, exist_ok=True)
        path = Path(folder) / "scene.h5"
        what.save(path)
        what = [path]
    items = [what] if isinstance(what, (str, os.PathLike)) else list(what)
    if not items:
        raise ValueError("say what to study: a scene, a .py file that defines build(), or problems")
    pairs = [item if isinstance(item, tuple) else (item, None) for item in items]
    folder = Path(pairs[0][0]).with_suffix(".study") if folder is None else folder
    common = dict(options or {})
    targets = [Target(path, common if str(path).endswith(".py") else None, dt, own) for path, own in pairs]
    names = [target.name for target in targets]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"two targets are named {name}: rows are kept by name, so give other files or options")
    kinds = {target.kind == "problem" for target in targets}
    if len(kinds) > 1:
        raise ValueError("scenes and contact problems have different errors: study them apart")
    return folder, targets


def _figures(targets, given):
    own = set.intersection(*(set(target.own_figures()) for target in targets))
    if targets[0].kind == "problem":
        return []
    names = list(FIGURES) + sorted(own) if given is None else list(given)
    for name in names:
        if name.partition(":")[0] not in builtin.SUMMARY and name not in own:
            known = listed([*builtin.SUMMARY, *sorted(own)], name)
            raise ValueError(f"there is no figure {name!r}: define figure_{name}(sim) in the .py file, or give one of {known}")
    return names


def _columns(targets, names):
    """Columns of errors and figures for these targets."""
    if targets[0].kind == "problem":
        return measures.PROBLEM_FIGURES
    return [*measures.STEP_FIGURES, *names, *(f"scale_{name}" for name in names)]


def _say_changed(rows, targets, say):
    for target in targets:
        old = [r for r in rows.rows.values() if r["target"] == target.name and r["fingerprint"] != target.fingerprint]
        if old and not any(r["fingerprint"] == target.fingerprint for r in rows.rows.values()):
            say(f"{target.name} has changed since it was studied: its {len(old)} rows are set aside, it starts anew")


def _waiting(plan, rows):
    """Stages of unfinished tasks. States and references that these need are recomputed if their files are missing."""
    needed, stages = set(), []
    for stage in reversed(plan.stages):
        missing = [task for task in stage if not _is_done(task, rows, needed)]
        needed |= {task[name] for task in missing for name in ("state", "file") if name in task}
        stages.insert(0, missing)
    return stages


def _is_done(task, rows, needed):
    made = task.get("files") or ([task["file"]] if task["kind"].endswith("_reference") else [])
    if any(file in needed and not os.path.exists(file) for file in made):
        return False
    row = rows.get(task["row"]["key"])
    return row is not None and all(name in row for name in task.get("figures", ()))


def _do(plan, rows, workers, progress, say):
    """Runs unfinished tasks; False if it was stopped."""
    from .. import __version__
    from ..run.progress import Progress, StopAtSignal
    from .tasks import prepared

    waiting = _waiting(plan, rows.rows)
    count, total = sum(map(len, waiting)), len(plan.tasks())
    if count == 0:
        say(f"all {total} measurements are there already: nothing is computed")
        return True
    say(f"{count} of {total} measurements are to be made")
    for task in waiting[0]:
        kept = prepared(task)
        if kept is not None:
            say(f"the preparation of {task['row']['target']} goes on from step {kept['step']}")
    whole = True
    with StopAtSignal() as stop, Progress(count, enabled=progress, unit="run") as bar, Pool(workers) as pool:

        def done(task, row):
            known = rows.rows.get(task["row"]["key"], {})
            rows.add({**known, **task["row"], **row, "version": __version__})
            bar.update(contacts=row.get("contacts"), residual=row.get("error"))

        for stage in waiting:
            whole = whole and pool.run(stage, done, stop=lambda: bool(stop))
    if not whole:
        say(f"stopped; the same call goes on from here. What is done is in {rows.path}")
    return whole


class Study:
    """Results of a study. rows: as measured. table: errors and costs of each setting, a list of dicts (measures.table).
    claims: estimated errors of steps against true ones, for each setting (claims.table).

    whole: False if it was stopped before its end.
    """

    def __init__(self, folder, rows, figures, whole=True):
        self.folder, self.rows, self.figures, self.whole = Path(folder), rows, list(figures), whole
        self.table, self.claims = measures.table(rows, self.figures), claims.table(rows)

    @property
    def measured(self):
        """Names of the figures that have errors."""
        return list(dict.fromkeys(row["figure"] for row in self.table))

    def recommend(self, accuracy, of, here=False):
        """The cheapest setting whose error of the figure `of` surely stays within accuracy: a Recommendation.

        here: on the scenes of the study alone; otherwise with a margin for others like them.
        """
        from .recommend import recommend

        self._check_known(of)
        return recommend(self.table, accuracy, of, here)

    def _check_known(self, of):
        """Refuses a figure that was measured and has no errors: it is no number, or nothing to relate them to."""
        if of in self.figures and of not in self.measured:
            values = [row[of] for row in self.rows if row.get("role") == "reference" and of in row]
            if values:
                told = ", ".join(f"{value:g}" for value in values[:3])
                raise ValueError(
                    f"figure {of!r} has no relative errors, since the reference runs found {told}: give a figure that is finite "
                    "and not zero"
                )

    def profile(self, accuracy, of):
        """Performance profile of the solvers over the targets, {solver: (tau, share)}, at an accuracy of a figure."""
        from .profiles import cheapest_costs, performance_profile

        costs, known = cheapest_costs(self.table, of, accuracy)
        if not known:
            raise ValueError(f"the noise floor of {of} is above {accuracy:g} on every target: there is nothing to compare")
        return performance_profile(costs)

    def plot(self, of, path=None, accuracy=None):
        """Work-precision plot of a figure: error against CPU seconds, one curve a solver. Returns the matplotlib figure."""
        from .plots import work_precision

        self._check_known(of)
        return _kept(work_precision(self.table, of, accuracy), path)

    def plot_profile(self, accuracy, of, path=None):
        """Plot of profile(). Returns the matplotlib figure."""
        from .plots import profile

        return _kept(profile(self.profile(accuracy, of), of, accuracy), path)

    def write(self):
        """Writes table.csv and study.h5 (groups rows and table) into the folder."""
        store.write_csv(self.folder / "table.csv", self.table)
        if self.claims:
            store.write_csv(self.folder / "claims.csv", self.claims)
        store.write_hdf5(self.folder / "study.h5", {"rows": self.rows, "table": self.table, "claims": self.claims})

    def __str__(self):
        lines = []
        for figure in self.measured:
            rows = [row for row in self.table if row["figure"] == figure]
            lines.append(f"{figure}: {len(rows)} settings; noise floor {max(row['floor'] for row in rows):.2g}")
            loose = measures.loose_reference(rows)
            lines += [f"  {loose}"] if loose else []
        if any("accuracy" in row or "time_told_velocity_median" in row for row in self.claims):
            lines += claims.said(self.claims)
        return "\n".join(lines) or "nothing is measured yet"


def _kept(figure, path):
    if path is not None:
        figure.savefig(path, dpi=120)
    return figure
