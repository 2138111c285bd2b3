"""Solution of a problem: steps until its duration ends, the blocks are at rest, or they fall."""

from __future__ import annotations

import inspect
import time
import warnings

import numpy as np

from .conditions import HOLD
from .results import Contacts, Motion, results_of, unbalanced_force_ratio
from .scene import build

EVERY = 10  # steps between unbalanced force ratios


def solve(problem, *, duration=None, n_steps=None, dt=None, theta=None, urf_threshold=None, track_block=None, verbose=0,
          density=None, gravity=9.81, joint=None, deformable=False, size=None, rayleigh=None, tol=None, max_iter=1000, threads=0,
          output=None, every=1, callback=None):  # fmt: skip
    """Solves a problem of compas_dem.

    All boundary conditions act together. Ramped loads grow over 0.98 of the duration, loads at once act from the start and are
    released in the last 0.02. Displacements and rotations are reached at the end, at velocities that start and end at 0.

    Parameters
    ----------
    problem : compas_dem.problem.Problem
        Model, boundary conditions and contact model.
    duration : float, optional
        Duration [s]. Give two of duration, n_steps and dt; 0.5 s and 50 steps when none is given.
    n_steps : int, optional
        Number of steps.
    dt : float, optional
        Step [s].
    theta : float, optional
        Parameter of the theta-method, from 1/2 (of second order, keeps energy) to 1 (damps waves). When not given 1 where blocks
        are deformable or joints are other than Coulomb's, else 1/2.
    urf_threshold : float, optional
        The analysis ends once the unbalanced force ratio is below it, all ramps being complete and nothing driven, and where it
        reaches 1: blocks fall.
    track_block : int, optional
        Node of a block whose displacements are kept.
    verbose : int, default 0
        Steps between kept contact forces and printed lines; 0: none.
    density : float, optional
        Density of all blocks [kg/m3], in the place of those of their materials.
    gravity : float, default 9.81
        Gravity along -z [m/s2].
    joint : cairn.Law or dict, optional
        Law of all joints in the place of the contact model, as cairn.MAL(...) or {"law": "MAL", "mu": 0.6, ...}.
    deformable : bool or sequence of int, default False
        All blocks, or nodes of those, that are elastic with Ecm [MPa] and poisson of their material.
    size : float, optional
        Largest edge of a cell of these [m].
    rayleigh : tuple of float, optional
        Factors of mass [1/s] and stiffness [s] in their damping.
    tol : float, optional
        Largest error of the contact solver [-].
    max_iter : int, default 1000
        Most iterations of a step.
    threads : int, default 0
        Number of threads; 0: as OpenMP decides.
    output : path-like, optional
        A .vtkhdf file for ParaView, `cairn view` and cairn.load.
    every : int, default 1
        Steps between its outputs.
    callback : callable, optional
        Function of the cairn.Simulation after each step; returning False ends the analysis.

    Returns
    -------
    compas_dem.problem.Results
        The results of the last step. Their `built` is the simulation (Built), as long as they are not saved. Their metadata
        have mu, n_steps, status ("completed", "converged", "falling", "stopped"), ufr, urf_history, force_time,
        displacement_history, unconverged_steps, worst_error and cpu_ms_a_step.

    Raises
    ------
    ValueError
        If the problem is not complete, or a value is wrong; the message names field, value and remedy.
    """
    duration, n_steps, dt = times(duration, n_steps, dt)
    if urf_threshold is not None and not 0 < urf_threshold < 1:
        raise ValueError(f"urf_threshold is {urf_threshold}: give a ratio between 0 and 1, such as 1e-3, or None")
    built = build(problem, duration=duration, dt=dt, theta=theta, density=density, gravity=gravity, joint=joint,
                  deformable=deformable, size=size, rayleigh=rayleigh, tol=tol, max_iter=max_iter, threads=threads)  # fmt: skip
    if track_block is not None and track_block not in built.conditions:
        raise ValueError(f"track_block is {track_block!r}: the model has blocks {sorted(built.conditions)}")
    watch = _Watch(built, Motion(built), n_steps, urf_threshold, track_block, verbose, callback)
    start = time.process_time()
    built.simulation.run(steps=n_steps, callback=watch, progress=False, output=output, every=every)
    cpu = 1e3 * (time.process_time() - start) / watch.count
    if watch.unconverged:
        told = f"{watch.unconverged} of {watch.count} steps ended above the tolerance, the worst at an error of {watch.worst:.2g}"
        remedy = "give a larger max_iter or a shorter dt; cairn_compas.build(problem, ...).simulation.explain() tells the solver"
        warnings.warn(f"{told}: {remedy}", stacklevel=2)
    results = results_of(problem, built, watch.motion)
    results.built = built
    friction = problem.contact_properties.contact_model
    results.metadata |= {
        "solver": "Cairn",
        "mu": built.law.mu if "mu" in built.law.parameter_names else getattr(friction, "mu", None),
        "n_steps": watch.count,
        "status": watch.status,
        "ufr": unbalanced_force_ratio(built),
        "urf_history": watch.ratios,
        "force_time": watch.forces,
        "displacement_history": watch.tracked,
        "unconverged_steps": watch.unconverged,
        "worst_error": watch.worst,
        "cpu_ms_a_step": cpu,
    }
    return results


def times(duration=None, n_steps=None, dt=None):
    """Completes duration, number of steps and step.

    Parameters
    ----------
    duration : float, optional
        [s].
    n_steps : int, optional
        Number of steps.
    dt : float, optional
        [s].

    Returns
    -------
    tuple
        Duration [s], number of steps, step [s].

    Raises
    ------
    ValueError
        If one or all three are given, or one is not above 0.
    """
    given = {k: v for k, v in {"duration": duration, "n_steps": n_steps, "dt": dt}.items() if v is not None}
    for name, value in given.items():
        if not (np.isreal(value) and np.isfinite(value) and value > 0 and (name != "n_steps" or value == int(value))):
            raise ValueError(f"{name} is {value!r}: give {'a whole number' if name == 'n_steps' else 'a time'} above 0")
    if len(given) not in (0, 2):
        raise ValueError(f"given is {', '.join(given)}: give two of duration, n_steps and dt")
    if not given:
        duration, n_steps = 0.5, 50
    if duration is None:
        duration = dt * n_steps
    elif n_steps is None:
        n_steps = max(1, round(duration / dt))
    return float(duration), int(n_steps), float(duration / n_steps)


def checked_options(options):
    """Refuses options that `solve` does not have.

    Parameters
    ----------
    options : dict
        Options by name.

    Raises
    ------
    ValueError
        If there is no such option.
    """
    known = [name for name, p in inspect.signature(solve).parameters.items() if p.kind is p.KEYWORD_ONLY]
    for name in options:
        if name not in known:
            raise ValueError(f"Solver.Cairn has no option {name!r}; it has {', '.join(known)}")


class _Watch:
    """Callback of a run: it keeps histories and ends the analysis at rest or where blocks fall."""

    def __init__(self, built, motion, n_steps, threshold, tracked, verbose, callback):
        self.built, self.motion, self.n_steps, self.threshold = built, motion, n_steps, threshold
        self.block, self.verbose, self.callback = tracked, verbose, callback
        self.count, self.unconverged, self.worst, self.status = 0, 0, 0.0, "completed"
        self.ratios, self.forces, self.tracked = [], [], []
        conditions = built.conditions.values()
        self.ramped = any(c.ramped for c in conditions)
        self.driven = any(any((*c.translation, *c.rotation)) for c in conditions)

    def __call__(self, simulation):
        step = self.count
        self.count += 1
        info = simulation.info
        self.worst = max(self.worst, float(info["error"]))
        self.unconverged += info["status"] != "converged"
        if self.block is not None:
            self.tracked.append(self.motion.displacement(self.block).tolist())
        if self.verbose and step % self.verbose == 0:
            self.forces.append(np.linalg.norm(Contacts(self.built).force, axis=1).tolist())
            print(f"step {step} of {self.n_steps}: error {info['error']:.1e}, {len(simulation.contacts)} contacts")
        if self.callback is not None and self.callback(simulation) is False:
            self.status = "stopped"
            return False
        return self.threshold is None or step % EVERY != 0 or self._goes_on(simulation)

    def _goes_on(self, simulation):
        ratio = unbalanced_force_ratio(self.built)
        self.ratios.append(ratio)
        full = not self.driven and (not self.ramped or simulation.time >= HOLD * self.built.duration)
        if ratio >= 1:
            self.status = "falling"
        elif ratio < self.threshold and full:
            self.status = "converged"
        return self.status == "completed"
