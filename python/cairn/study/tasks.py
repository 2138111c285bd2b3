"""The pieces of a study that run in processes of their own: each takes plain data and gives one row."""

from __future__ import annotations

import dataclasses
import io
import json
import os
import time
from pathlib import Path

import numpy as np

from .. import _core
from ..base.errors import FileError
from . import claims
from .figures import Recorder, boundary_impulses, boundary_parts, contact_momentum, movers
from .settings import Setting
from .targets import Target

SECOND, SECOND_ITERATIONS = "PPANewton", 2000  # where sweeps do not bring a reference to its tolerance; each is a factorisation
KEPT_EVERY = 30.0  # [s] between two checkpoints of a preparation,
RUN_OVER_KEEPING = 20  # or, where these are large, so many times as long as it takes to write one
REPEATS = 3  # of a step that is timed: the least counts, the first finds cold caches
_targets = {}  # of this process: a scene is built once


def _store(path, **arrays):
    data = io.BytesIO()
    np.savez(data, **arrays)
    _core.write_whole(path, data.getvalue(), beside=True)


def run(task):
    """Does a task {kind, target, ...} and returns its row, a dict of numbers and texts."""
    return {
        "prepare": prepare,
        "step_reference": step_reference,
        "step": step,
        "statistics": statistics,
        "problem_reference": problem_reference,
        "problem": problem,
    }[task["kind"]](task)


def _target(task):
    given, setting = task["target"], Setting(**task["setting"])
    name = repr((given, setting.network_tol, setting.coupling))
    if name not in _targets:
        _targets.clear()
        target = Target(given["path"], given["options"], given["dt"])
        if target.fingerprint != task["fingerprint"]:
            raise ValueError(f"{target.path}: changed while the study ran, or builds another scene each time: give its seeds")
        if target.kind == "problem":
            _targets[name] = (target, target.problem(), None)
        else:
            sim = target.simulation(setting)
            _targets[name] = (target, sim, sim.strategy)
    return _targets[name]


def _restored(task, state):
    target, sim, base = _target(task)
    sim.restore(state)
    return target, sim, base


def _use(sim, target, base, setting):
    sim.strategy = setting.strategy(base)
    sim.dt = target.dt * setting.dt_factor


# ------------------------------------------------------------------ scenes


def prepare(task):
    """Runs a scene to its common states and writes them as checkpoints: at equal times over the second half.

    Its progress is saved on the disk as it goes, so that a stopped study resumes from there.
    """
    (target, sim, _), (first, cpu, failed) = _begun(task)
    after, files = target.after_step(), task["files"]
    steps = int(round(task["seconds"] / sim.dt))
    due = [int(round(steps * (0.5 + 0.5 * (k + 1) / len(files)))) for k in range(len(files))]
    kept, pause = time.monotonic(), KEPT_EVERY
    for n in range(first, steps + 1):
        for k, file in enumerate(files):
            if due[k] == n:
                sim.checkpoint(file)
        if n == steps:
            break
        if time.monotonic() - kept >= pause:
            start = time.monotonic()
            _keep(sim, task, {"step": n, "cpu_seconds": cpu, "not_converged": failed})
            kept = time.monotonic()
            pause = max(KEPT_EVERY, RUN_OVER_KEEPING * (kept - start))
        info, spent = _timed(sim)
        if info is None:
            raise ValueError(f"step {n} of the preparation cannot be made: take a smaller time step, or a tighter prepare_tol")
        cpu += spent
        failed += info["status"] != "converged"
        if after is not None:
            after(sim)
    _targets.clear()  # the simulation has gone on
    _forget(task)
    return {"cpu_seconds": cpu, "steps": steps, "not_converged": failed}


def _begun(task):
    """The target and its simulation at the step where an earlier study was stopped, or at the start: (target, sim, strategy) and
    (steps done, CPU seconds, solves that did not converge)."""
    kept = prepared(task)
    if kept is not None:
        try:
            target, sim, base = _restored(task, kept["file"])
            _use(sim, target, base, Setting(**task["setting"]))
            return (target, sim, base), (kept["step"], kept["cpu_seconds"], kept["not_converged"])
        except FileError:  # written by another version, or damaged: the start is always there
            _targets.clear()
    target, sim, base = _target(task)
    _use(sim, target, base, Setting(**task["setting"]))
    return (target, sim, base), (0, 0.0, 0)


def _note(task):
    return Path(task["files"][0]).parent / f"{task['row']['key']}.json"


def prepared(task):
    """How far a preparation that was stopped had come, {step, cpu_seconds, not_converged, file}, or None."""
    try:
        kept = json.loads(_note(task).read_text())
    except (OSError, ValueError):
        return None
    return kept if os.path.exists(kept["file"]) else None


def _keep(sim, task, done):
    """Writes the state, then the note that names it, then takes the state before away: at each instant one of them is whole."""
    before, note = prepared(task), _note(task)
    file = note.with_name(f"{note.stem}_step{done['step']}.h5")
    sim.checkpoint(file)
    _core.write_whole(note, json.dumps({**done, "file": str(file)}).encode(), beside=True)
    if before is not None and before["file"] != str(file):
        Path(before["file"]).unlink(missing_ok=True)


def _forget(task):
    kept = prepared(task)
    _note(task).unlink(missing_ok=True)
    if kept is not None:
        Path(kept["file"]).unlink(missing_ok=True)


def _timed(sim):
    """One step: (its report, CPU seconds); the report is None if the scene has gone where no step can be made."""
    from .. import Error

    start = time.process_time()
    try:
        info = sim.step()
    except Error:  # a setting that lets the scene blow up is an outcome, not an end of the study
        info = None
    return info, time.process_time() - start


def _one_step(sim):
    """State after one step: velocities, momentum that contacts gave, forces on the boundaries, and where all is."""
    parts, free = boundary_parts(sim)
    info, cpu = _timed(sim)
    if info is None:
        raise ValueError("no step can be made from this state: run the scene on its own to see the error")
    return info, cpu, {
        "velocity": movers(sim).velocity[free],
        "momentum": contact_momentum(sim)[free],
        "mass": movers(sim).mass[free],
        "force": boundary_impulses(sim, parts) / info["dt"], **claims.End(sim).as_arrays(),
    }


def step_errors(state, reference):
    """Errors of one step relative to the action of contacts: velocities in the energy norm, forces on the boundaries.

    step_velocity = sqrt(sum m |v - v_ref|^2 / sum |p_ref|^2 / m), p the momentum that contacts gave to a body;
    step_boundary_force = |F - F_ref| / |F_ref| over all boundaries.
    """
    m = reference["mass"]
    difference = np.sum(m[:, None] * (state["velocity"] - reference["velocity"]) ** 2)
    scale = np.sum(reference["momentum"] ** 2 / m[:, None])
    force, change = np.linalg.norm(reference["force"]), np.linalg.norm(state["force"] - reference["force"])
    return {
        "step_velocity": float(np.sqrt(difference / scale)) if scale > 0 else float("nan"),
        "step_boundary_force": float(change / force) if force > 0 else float("nan"),
    }


def step_reference(task):
    """A far tighter solve of one step, kept in a file; its row holds its noise floor, and its own true error.

    Floor: the largest difference from an even tighter solve and from one that begins with other impulses (none): where the
    impulses are not unique, a figure that differs between them has no better answer. Nor has it one within the true error of the
    reference. Of the three the one with the least true error is the reference.
    """
    asked = Setting(**task["setting"])
    tighter, cold = dataclasses.replace(asked, tol=asked.tol / 10), dataclasses.replace(asked, warm_start=False)
    solves = [_tight_step(task, each) for each in (asked, tighter, cold)]
    solves.sort(key=lambda solve: solve[0]["error"])
    (info, _, reference), others = solves[0], solves[1:]
    row = {
        "cpu_seconds": sum(cpu for _, cpu, _ in solves), "steps": 3, "error": info["error"], "contacts": info["contacts"],
        "not_converged": sum(each["error"] > asked.tol for each, _, _ in solves),
    }
    floors = [step_errors(state, reference) for _, _, state in others]
    row.update({name: float(np.max([info["error"], *(floor[name] for floor in floors)])) for name in floors[0]})
    if task["in_time"]:
        target, sim, base = _restored(task, task["state"])
        _use(sim, target, base, asked)
        reference |= claims.exact_in_time(sim)
    _store(task["file"], **reference)
    return row


def _tight_step(task, setting):
    """One step as _one_step gives it. Where the solver that is asked for stops above its tolerance, SECOND tries as well, and the
    lesser true error counts."""
    best, total = None, 0.0
    second = dataclasses.replace(setting, solver=SECOND, min_iter=0, max_iter=min(setting.max_iter, SECOND_ITERATIONS))
    for each in (setting, second):
        target, sim, base = _restored(task, task["state"])
        _use(sim, target, base, each)
        info, cpu, state = _one_step(sim)
        total += cpu
        if best is None or info["error"] < best[0]["error"]:
            best = info, state
        if info["status"] == "converged" or setting.solver == SECOND:
            break
    return best[0], total, best[1]


def step(task):
    """One step from a common state against the tight solve."""
    with np.load(task["file"]) as file:
        reference = dict(file)
    least, told = np.inf, {}
    for _ in range(REPEATS):
        target, sim, base = _restored(task, task["state"])
        _use(sim, target, base, Setting(**task["setting"]))
        told, begin = claims.told_in_time(sim, reference) if np.isinf(least) else told, claims.Begin(sim)
        if told:  # contacts and settings as they were before it
            target, sim, base = _restored(task, task["state"])
            _use(sim, target, base, Setting(**task["setting"]))
        info, cpu, state = _one_step(sim)
        true = begin.against(reference, info)
        least = min(least, cpu)
        if cpu > 0.5:
            break
    return {
        "cpu_seconds": least, "steps": 1, "not_converged": int(info["status"] != "converged"), "error": info["error"],
        "iterations": info["iterations"], "contacts": info["contacts"], **step_errors(state, reference), **told, **true,
    }


def perturb(sim, amount, seed):
    """Moves each free body at random by at most `amount` of its radius (of the mean radius where it has none) per axis; a mesh as
    a whole, unless it is held somewhere."""
    both, free = movers(sim), boundary_parts(sim)[1]
    position, radii = both.position, both.radius[free]
    known = radii[radii > 0]
    size = np.where(radii > 0, radii, known.mean() if len(known) else _spacing(position[free]))
    shift = np.random.default_rng(seed).uniform(-1, 1, (int(free.sum()), sim.scene.dim))
    move = np.zeros_like(position)
    move[free] = amount * size[:, None] * shift
    for mesh in sim.meshes:
        rows = np.searchsorted(both.id, mesh.ids)
        move[rows] = 0.0 if len(mesh.held) else move[rows].mean(axis=0) * np.sqrt(len(rows))
    rigid = np.isin(both.id, sim.bodies.id)
    sim.bodies.set(position=(position + move)[rigid])
    sim.nodes.set(position=(position + move)[~rigid])


def _spacing(position):
    """Half the mean distance of bodies that have no radius, from the room they fill."""
    extent = np.ptp(position, axis=0)
    extent = extent[extent > 0]
    return 0.5 * float(np.prod(extent) / len(position)) ** (1 / len(extent)) if len(extent) else 1.0


def statistics(task):
    """One perturbed run: averages of the figures over its later part."""
    setting = Setting(**task["setting"])
    target, sim, base = _restored(task, task["state"])
    _use(sim, target, base, setting)
    if task["perturbation"] > 0:
        perturb(sim, task["perturbation"], task["seed"])
    recorder = Recorder(sim, task["figures"], target.own_figures())
    after = target.after_step()
    steps = max(2, int(round(task["seconds"] / sim.dt)))
    first = steps - max(1, int(round(steps * task["averaged"])))
    every = max(1, (steps - first) // task["samples"])
    cpu, failed, iterations, worst, taken, contacts = 0.0, 0, 0, 0.0, 0, None
    for n in range(1, steps + 1):
        info, spent = _timed(sim)
        cpu += spent
        if info is None:
            break
        contacts = info["contacts"]
        taken, iterations, worst = n, iterations + info["iterations"], max(worst, info["error"])
        failed += info["status"] != "converged"
        if after is not None:
            after(sim)
        if n > first:
            recorder.after_step(info["dt"])
            if (steps - n) % every == 0:
                recorder.sample()
        if task["max_seconds"] and cpu > task["max_seconds"]:
            break
    whole = taken == steps
    return {
        "cpu_seconds": cpu, "steps": taken, "not_converged": failed, "error": worst, "contacts": contacts,
        "iterations": iterations, "stopped": int(not whole),
        **(recorder.values() if whole else dict.fromkeys(task["figures"], float("nan"))),
        **{f"scale_{name}": value for name, value in recorder.scales().items()},
    }


# ------------------------------------------------------------------ problems


def _solved(task):
    _, problem_, _ = _target(task)
    setting = Setting(**task["setting"])
    limit = task["max_seconds"] or float("inf")
    result = problem_.solve(setting.solver, setting.tol, max_iter=setting.max_iter, max_seconds=limit)
    row = {
        "cpu_seconds": result.cpu_seconds, "steps": 1, "not_converged": int(not result.converged), "error": result.error,
        "iterations": result.iterations, "contacts": problem_.contacts, "true_error": result.error,
    }
    return problem_, result, row


def velocity_error(problem_, u, u_ref):
    """Error of relative velocities over their change by contacts: sqrt(sum |u - u_ref|^2 / W_NN  /  sum |u_ref - q|^2 / W_NN)."""
    rho = 1 / problem_.W.diagonal()[:: problem_.dim, None]
    scale = np.sum(rho * (u_ref - problem_.q) ** 2)
    return float(np.sqrt(np.sum(rho * (u - u_ref) ** 2) / scale)) if scale > 0 else float("nan")


def problem_reference(task):
    """The tightest solve of the solvers given, kept in a file; floor: its own true error, and the next best one's velocities."""
    results = []
    for name in task["solvers"]:
        problem_, result, row = _solved({**task, "setting": {**task["setting"], "solver": name}})
        results.append((result.error, result.u, row))
    results.sort(key=lambda item: item[0])
    error, best, row = results[0]
    # the next best tells how well velocities are known, if it was as tight as that
    twins = [u for other, u, _ in results[1:] if other <= 10 * max(error, task["setting"]["tol"])]
    row["cpu_seconds"] = sum(r["cpu_seconds"] for _, _, r in results)
    row["velocity"] = max([error, *(velocity_error(problem_, u, best) for u in twins)])
    _store(task["file"], u=best)
    return row


def problem(task):
    """Solves a problem and compares it with the reference solution."""
    with np.load(task["file"]) as file:
        u = file["u"]
    least, spent = None, 0.0
    for _ in range(REPEATS):
        problem_, result, row = _solved(task)
        spent += row["cpu_seconds"]
        if least is None or row["cpu_seconds"] < least["cpu_seconds"]:
            least = row
        if spent > 0.2:
            break
    return {**least, "velocity": velocity_error(problem_, result.u, u)}
