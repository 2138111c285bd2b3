"""The tasks of a study, in the order in which they need each other, each with the row it will give."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from .settings import Setting, check_mesh, digest, problem_settings, scene_settings, scene_solvers


@dataclasses.dataclass(frozen=True)
class Protocol:
    """How a study measures. See study.run."""

    figures: tuple
    prepare: float | None = None
    prepare_tol: float = 1e-5
    states: int = 4
    one_step: bool = True
    in_time: bool = False
    step_tol: float = 1e-11
    duration: float | None = None
    runs: int = 8
    perturbation: float = 1e-4
    averaged: float = 0.5
    samples: int = 40
    reference_tol: float | None = None
    reference_dt_factor: float | None = None
    reference_solver: str | None = None
    reference_mesh: float | None = None
    max_seconds: float | None = None

    def __post_init__(self):
        if self.runs < 8:
            raise ValueError(f"runs is {self.runs}: give at least 8, for an interval that means something")
        if self.states < 1:
            raise ValueError(f"states is {self.states}: give at least 1")
        if not 0 < self.averaged <= 1:
            raise ValueError(f"averaged is {self.averaged}: give the share of a run that is averaged, in (0, 1]")
        if not self.perturbation > 0:
            raise ValueError(f"perturbation is {self.perturbation}: give a share of the radius above 0, 1e-4 say")
        if self.reference_mesh is not None:
            check_mesh("reference_mesh", self.reference_mesh)
        for name in ("prepare", "duration", "max_seconds"):
            value = getattr(self, name)
            if value is not None and not value >= 0:
                raise ValueError(f"{name} is {value}: give seconds >= 0, or None")


class Plan:
    """Stages of tasks for the targets; tasks depend on earlier stages alone.

    sweep: solvers, tolerances, dt_factors, warm_start, min_iter, max_iter, integrators, meshes, ... folder: where states
    and references are kept.
    """

    def __init__(self, targets, sweep, protocol, folder):
        self.protocol, self.folder = protocol, Path(folder)
        self.stages = [[], [], []]
        for target in targets:
            if target.kind == "problem":
                names = {name: sweep[name] for name in ("solvers", "tolerances")}
                self._problem(target, problem_settings(**names))
            else:
                self._scene(target, scene_settings(**sweep))

    def tasks(self):
        """All tasks."""
        return [task for stage in self.stages for task in stage]

    def _task(self, target, kind, role, setting, protocol, **more):
        label = {"prepare": "prepare", "step_reference": "step", "step": "step", "statistics": "statistics"}.get(kind, "problem")
        built = target.with_mesh(setting.mesh)
        asked = {"path": str(built.path), "options": built.options, "dt": target.dt}
        row = {
            "target": target.name, "fingerprint": target.fingerprint, "protocol": digest(protocol), "kind": label, "role": role,
            "state": more.pop("number", None), "seed": more.get("seed"), "setting": setting.key(), **setting.as_row(),
            "dt": None if target.dt is None else target.dt * setting.dt_factor,
        }
        row["key"] = digest({**row, "target": None})
        return {
            "kind": kind, "target": asked, "fingerprint": built.fingerprint, "setting": dataclasses.asdict(setting),
            "max_seconds": self.protocol.max_seconds, **more, "row": row,
        }

    def _scene(self, target, settings):
        p = self.protocol
        prepare = target.default("PREPARE", 0.0) if p.prepare is None else p.prepare
        duration = target.default("DURATION", None) if p.duration is None else p.duration
        states = p.states if prepare > 0 else 1
        name = p.reference_solver or ("Auto" if "Auto" in scene_solvers() else "NLGS")
        limit = 100_000
        start = {"prepare": prepare, "states": states, "tol": p.prepare_tol, "dt": target.dt}
        finest = max(s.mesh for s in settings.values())
        if p.reference_mesh is not None:
            if p.reference_mesh < finest:
                told = f"reference_mesh is {p.reference_mesh:g}, coarser than the finest of meshes, {finest:g}"
                raise ValueError(told + ": give at least that, or None")
            finest = float(p.reference_mesh)
        files = {}  # common states of each mesh: one knows nothing of another's
        for mesh in dict.fromkeys([*(s.mesh for s in settings.values()), finest]):
            known = target.with_mesh(mesh).fingerprint
            files[mesh] = [str(self.folder / "states" / f"{digest([known, start])}_{k}.h5") for k in range(states)]
            first = Setting(name, p.prepare_tol, 1.0, True, 1, limit, mesh=mesh)
            self.stages[0].append(self._task(target, "prepare", "state", first, start, seconds=prepare, files=files[mesh]))
        if p.one_step and list(files) == [0.0]:
            self._steps(target, settings, files[0.0], start, Setting(name, p.step_tol, 1.0, True, 1, limit))
        if duration:
            if duration < 2 * target.dt:
                raise ValueError(f"{target.path}: duration is {duration:g} s, less than two steps of {target.dt:g} s")
            tightest = min(s.tol for s in settings.values())
            smallest = min(s.dt_factor for s in settings.values())
            tight = Setting(
                name, p.reference_tol or tightest / 10, p.reference_dt_factor or smallest / 2, True, 1, limit,
                coupling=_tightest(settings), mesh=finest,
            )
            last = {mesh: each[-1] for mesh, each in files.items()}
            self._statistics(target, settings, last, {**start, "duration": duration}, tight)

    def _steps(self, target, settings, files, start, tight):
        protocol = {**start, "step_tol": tight.tol, "solver": tight.solver}
        protocol |= {"in_time": True} if self.protocol.in_time else {}
        for k, state in enumerate(files):
            for factor in dict.fromkeys(s.dt_factor for s in settings.values()):
                reference = dataclasses.replace(tight, dt_factor=factor)
                file = str(self.folder / "states" / f"{digest([target.fingerprint, protocol, k, factor])}.npz")
                more = {"number": k, "state": state, "file": file, "in_time": self.protocol.in_time}
                self.stages[1].append(self._task(target, "step_reference", "reference", reference, protocol, **more))
                for setting in settings.values():
                    # steps of other methods are other ones
                    if setting.dt_factor == factor and not (setting.integrator or setting.coupling):
                        self.stages[2].append(self._task(target, "step", "trial", setting, protocol, **more))

    def _statistics(self, target, settings, states, start, tight):
        p = self.protocol
        protocol = {**start, "perturbation": p.perturbation, "averaged": p.averaged, "samples": p.samples}
        more = {
            "seconds": start["duration"], "perturbation": p.perturbation, "averaged": p.averaged,
            "samples": p.samples, "figures": list(p.figures),
        }
        for seed in range(p.runs):
            task = self._task(target, "statistics", "reference", tight, protocol, seed=seed, state=states[tight.mesh], **more)
            self.stages[2].append({**task, "max_seconds": None})
            for setting in settings.values():
                given = {"seed": seed, "state": states[setting.mesh], **more}
                self.stages[2].append(self._task(target, "statistics", "trial", setting, protocol, **given))

    def _problem(self, target, settings):
        from ..problems import solvers

        p = self.protocol
        known = [name for name in (p.reference_solver, "auto", "nlgs") if name in solvers()]
        tight = Setting(known[0], 1e-12, 1.0, False, 0, 10_000_000)
        protocol = {"solvers": known}
        file = str(self.folder / "states" / f"{digest([target.fingerprint, protocol])}.npz")
        task = self._task(target, "problem_reference", "reference", tight, protocol, file=file, solvers=known)
        self.stages[1].append({**task, "max_seconds": p.max_seconds or 60.0})
        for setting in settings.values():
            self.stages[2].append(self._task(target, "problem", "trial", setting, protocol, file=file))


def _tightest(settings):
    """Tightest of the swept couplings, in words."""
    numbers = [s.coupling for s in settings.values() if s.coupling not in ("", "staggered")]
    return min(numbers, key=float, default="")
