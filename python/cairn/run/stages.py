"""The stages of a step of NSCD as individual calls, to inspect arrays between them or to replace a stage.

stages = simulation.stages
stages.begin_step()
stages.predict_configuration()
stages.compute_free_velocity()
stages.detect_contacts()
stages.prepare_contacts()
stages.solve_contacts()          # or stages.give_impulses(r)
stages.update_velocity()
stages.commit_contacts()
stages.update_configuration()
report = stages.end_step()       # the same bits as simulation.step()
"""

from __future__ import annotations

import math
from contextlib import contextmanager
from threading import get_ident

import numpy as np

from ..base import checks
from .compared import call_of
from .contact_rows import ContactRows

ORDER = (
    "predict_configuration",
    "compute_free_velocity",
    "detect_contacts",
    "prepare_contacts",
    "solve_contacts",
    "update_velocity",
    "commit_contacts",
    "update_configuration",
)


class Place:
    """Progress within a step, used to refuse calls in the middle of it. due: number of the next stage, None between steps; h:
    length of the step [s]; begin: begin time of a whole step, which may be made in parts [s], else None; asks: True while loads
    of a part are evaluated; works: threads in which the core is at work, so that users' functions called there see a half-made
    step; loads: threads in which the loads of a step are evaluated; ranks: exchange of the ranks that make each call together,
    None without."""

    def __init__(self):
        self.due = self.h = self.begin = None
        self.asks, self.works, self.loads, self.ranks = False, set(), set(), None

    def at_rest(self, what, **given):
        """Raises ValueError if the core is in the middle of a step, or another rank does something else, or the same with other
        arguments. what: name of the refused operation; given: its arguments."""
        if self.asks:
            raise ValueError(f"{what} stands between steps, and one is being made in parts: finish its stages first")
        if get_ident() in self.works:
            text = f"{what} stands between steps, and one is being made, which called this function"
            raise ValueError(f"{text}: wait for its end, or do it in `callback` of run")
        if self.ranks is not None and what not in ("step", "run"):  # these compare more than their name
            self.ranks.meet(call_of(what, given) if given else what)

    @contextmanager
    def of_loads(self):
        """Context while users' functions give the loads of a step: they may do anything but step."""
        if get_ident() in self.loads:
            text = "a function of time of the scene makes a step, within a step that needs its value"
            raise ValueError(f"{text}: step in `callback` of run, or between calls of step")
        self.loads.add(get_ident())
        try:
            yield
        finally:
            self.loads.discard(get_ident())

    @contextmanager
    def of_core(self):
        """Context while the core is at work on a step or a stage."""
        self.works.add(get_ident())
        try:
            yield
        finally:
            self.works.discard(get_ident())

    @contextmanager
    def of_step(self, simulation):
        """Context while the core makes a whole step; restores the report, which parts may have changed, if it fails."""
        info, self.begin = simulation._info, simulation.time
        try:
            with self.of_core():
                yield
        except BaseException:
            simulation._info = info
            raise
        finally:
            self.begin = None


class Stages:
    """The stages of a simulation's step, in their order. They read and write arrays of simulation.raw, with bodies (n) in
    internal order; velocities (n, 3 | 6) are vx vy w in 2D, vx vy vz and three spins about the body's axes in 3D.

    begin_step: keeps the state for undo_step. predict_configuration: position, rotation of q + h (1 - theta) v.
    compute_free_velocity: velocity_free, inverse_mass, in 3D inverse_inertia. detect_contacts: simulation.contacts' gap, normal,
    point, bodies, key. prepare_contacts: `contacts`. solve_contacts: impulses, from velocity_free. update_velocity: velocity,
    reaction. commit_contacts: states of laws, memory for the next step, energy. update_configuration: position, rotation, time.

    Values written into arrays of simulation.raw between two stages are used by the next ones. A stage that fails undoes the step
    and raises ValueError (cairn.Error), as simulation.step does. A stage that is not due raises ValueError.
    """

    def __init__(self, simulation, core, place):
        self._simulation, self._core, self._place = simulation, core, place

    @property
    def due(self):
        """Name of the next stage; None between steps."""
        if self._place.due is None:
            return None
        return ORDER[self._place.due] if self._place.due < len(ORDER) else "end_step"

    @property
    def h(self):
        """Length of the current step [s]; None between steps."""
        return self._place.h

    @property
    def gravity(self):
        """Gravity of the current or the last step, (3,) [m/s2]; for a function of time its mean over the step."""
        return np.array(self._core.scene.gravity)

    def begin_step(self, dt=None):
        """Begins a step of dt [s], simulation.dt if None: sets its loads, driven velocities and gravity."""
        simulation = self._simulation
        simulation.between_steps("begin_step")
        if not simulation.strategy.stages:
            raise ValueError(
                f"{type(simulation.strategy).__name__} has no stages to be called: give NSCD, or what poses another condition in "
                "its stages as Carpenter and GranularElement do, or call step()"
            )
        if simulation._fluid:
            raise ValueError("the fluid moves in a whole step: call step(), or leave out the fluid")
        h = simulation.ready(dt)
        with self._place.of_core():
            self._core.begin_step(h)
        self._place.due, self._place.h = 0, h

    def predict_configuration(self):
        """Computes position, rotation: the configuration q + h (1 - theta) v of contact detection."""
        self._make("predict_configuration")

    def compute_free_velocity(self):
        """Computes velocity_free: end velocity of the step without contacts; inverse_mass (n, 3 | 6), 0 for driven dofs."""
        self._make("compute_free_velocity")

    def detect_contacts(self):
        """Finds simulation.contacts: pairs that may touch within the step, with gap, normal, point, bodies, key."""
        self._make("detect_contacts")

    def prepare_contacts(self):
        """Computes `contacts`: conditions of laws on velocities, and impulses of the last step as warm start."""
        self._make("prepare_contacts")

    def solve_contacts(self):
        """Solves for the impulses of all contacts by the solver of the strategy; with nonlinear bodies within all iterations of
        Newton's method."""
        self._make("solve_contacts")
        if self._passes():
            with self._place.of_core():
                self._core.newton_passes()

    def _passes(self):
        meshes = self._simulation.meshes
        if not meshes:
            return False
        from ..model.meshes import is_linear

        return not all(is_linear(mesh.body) for mesh in meshes)

    def give_impulses(self, impulses, *, converged=True, iterations=0, error=0.0, hint=""):
        """Sets the impulses instead of solve_contacts: (m, dim) along normal and tangents of `contacts`, on the first body [N s].

        converged, iterations, error, hint: for the report.
        """
        self._is_due("solve_contacts")
        if self._passes():
            raise ValueError("stresses of a mesh are not linear, and impulses are found in several passes: call solve_contacts")
        shape = (len(self._simulation.contacts), self._simulation.scene.dim)
        given = np.ascontiguousarray(checks.real_array("impulses", impulses, shape))
        found = {"status": "converged" if converged else "iteration_limit", "iterations": iterations, "error": error}
        found |= {"worst_error": error, "worst_contact": -1, "cone_distance": 0.0, "hint": hint}
        self._core.give_impulses(given, found)
        self._place.due += 1

    def update_velocity(self):
        """Computes velocity = velocity_free + A^-1 H r, and reaction (n, 3 | 6) [N s] on driven bodies."""
        self._make("update_velocity")

    def commit_contacts(self):
        """Commits states of laws, memory of impulses and terms of energy."""
        self._make("commit_contacts")

    def update_configuration(self):
        """Computes position, rotation at the end of the step, by h theta v; advances time and number of steps."""
        self._make("update_configuration")

    def end_step(self):
        """Takes back overlap beyond the limit of the strategy, projects positions if it has project_positions; returns the report
        of the step, as simulation.step."""
        self._is_due("end_step")
        simulation, h = self._simulation, self._place.h
        with self._place.of_core():
            if math.isfinite(simulation.strategy.overlap):
                self._core.part_overlaps()
            if simulation.strategy.project_positions:
                self._core.project_positions()
        self._place.due = self._place.h = None
        return simulation.stepped(self._core.report(), h)

    def undo_step(self):
        """Restores bodies and time of begin_step; refused after update_configuration."""
        self._place.at_rest("undo_step")
        if self._place.due is not None and self._place.due == len(ORDER):
            raise ValueError("the step is made: call end_step()")
        with self._place.of_core():
            self._core.undo_step()
        self._place.due = self._place.h = None

    @property
    def contacts(self):
        """Prepared contacts, a ContactRows. Raises ValueError before the first step."""
        return ContactRows(self._core.contact_rows(), self._simulation.scene.dim)

    def _is_due(self, stage):
        self._place.at_rest(stage)
        if self.due != stage:
            due = "begin_step" if self.due is None else self.due
            raise ValueError(f"{stage} is not due: the next stage is {due}")

    def _make(self, stage):
        self._is_due(stage)
        try:
            with self._place.of_core():
                getattr(self._core, stage)()
        except BaseException:
            self.undo_step()
            raise
        self._place.due += 1
