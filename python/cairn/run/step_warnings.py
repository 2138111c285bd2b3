"""Warnings after steps, once in a run each: a converged step may still be physically wrong."""

from __future__ import annotations

import math
import warnings

import numpy as np

from .. import _core
from ..options.solvers import Auto
from ..options.strategies import NSCD
from .passing import Flights
from .sets import free_masses
from .sinking import Leaps, RoundEdges, Sinking, deepest, deepest_pair
from .views import core_of


class OverlapWarning(UserWarning):
    """Bodies initially overlap by more than the allowed share, all lie behind a wall, or sink into each other in steps that
    converge; or a body begins deep or wholly inside a mesh."""


class StableStepWarning(UserWarning):
    """The step is longer than the stable step of smooth contacts, or too long for damped bodies under Gear's method."""


class EnergyCreatedWarning(UserWarning):
    """Contacts created energy in a step that converged: an error within the tolerance, or one that its measure does not show."""


class JointWarning(UserWarning):
    """The drift of a joint exceeds the tolerance over its length: its bodies rotate or swing too fast for the step."""


class TunnellingWarning(UserWarning):
    """A step moved a body through another body, or moved a mesh against other bodies by more than the width of a cell."""


class TurnedWarning(UserWarning):
    """A mesh with small-displacement kinematics rotated: its size grows by half the square of the rotation [rad]."""


class UnjoinedWarning(UserWarning):
    """Bodies touch along a line or at a corner under a cohesive law, which bonds by contact area and so does not bond them."""


class RunawayWarning(UserWarning):
    """A step gave a body a velocity that moves it a million times the extent of the scene: later results are invalid."""


# displacement in a step over the extent of the scene
FAR = 1e6
# created energy over the energy of a step; a bounce that ends within a step may show a sixth
MOST_CREATED = 0.25
# mass ratio above which the error may not show the effect of heavy bodies on light ones
MASSES_DIFFER = 100
# damping times the step, for a warning under Gear's method
DAMPED = 0.01
REBOUND = "newton_restitution"
TOO_LONG = "the step is too long for what moves, or masses differ by more than numbers of 16 digits hold"
# overlap over the size of the smaller body, or over that of a cell of a mesh
DEEP = 0.5
# the same ratio for a body wholly within another body, up to rounding
WITHIN = 2 * (1 - 1e-6)


ENDED = {"iteration_limit": "ended at the limit of its iterations", "diverged": "diverged",
         "newton_limit": "ended at the limit of Newton's method"}  # fmt: skip


def _reach_of(simulation, h):
    """(extent of bodies and nodes with their radii before a step [m], least finite mass [kg]); inf, inf without an extent."""
    low, high, lightest = np.inf, -np.inf, np.inf
    for view in (simulation.bodies, simulation.nodes):
        if len(view):
            mass = np.ravel(view.mass)
            x = view.position - h * view.velocity[:, : simulation.scene.dim]
            low, high = np.minimum(low, x.min(axis=0)), np.maximum(high, x.max(axis=0))
            lightest = min(lightest, mass[mass > 0].min(initial=np.inf))
    if not lightest < np.inf or not np.any(high > low):  # nothing moves, or no extent
        return np.inf, np.inf
    return float(np.linalg.norm(high - low)) + 2 * float(np.max(simulation.radii(), initial=0.0)), lightest


def _reach_of_sets(simulation):
    """The same of all sets as they came in, for ranks, which would gather the state of all bodies for the present one."""
    low, high, lightest, radius = np.inf, -np.inf, np.inf, 0.0
    for s in simulation._sets:
        if s.mass is None or not len(s):  # a drive, of no body of its own
            continue
        low, high = np.minimum(low, s.position.min(axis=0)), np.maximum(high, s.position.max(axis=0))
        lightest = min(lightest, float(np.min(s.mass, where=s.mass > 0, initial=np.inf)))
        for c in s.contactors:
            if c.shape in _core.shapes("ball") and len(c.body):
                offset = 0.0 if c.offset is None else np.linalg.norm(c.offset, axis=1)
                radius = max(radius, float(np.max(c.radius + offset)))
    if not lightest < np.inf or not np.any(high > low):
        return np.inf, np.inf
    return float(np.linalg.norm(high - low)) + 2 * radius, lightest


def _creators(simulation):
    """Text on causes in the scene that create energy at a small error, and on remedies."""
    mass = np.ravel(simulation.bodies.mass)
    mass = np.concatenate([mass[np.isfinite(mass) & (mass > 0)], [whole for whole, _ in free_masses(simulation._sets)]])
    laws, ratio = [law for *_, law in simulation._rules if law is not None], mass.max() / mass.min() if len(mass) else 1.0
    unseen = [f"a heavy body that light ones carry (masses differ by {ratio:.0e})"] if ratio > MASSES_DIFFER else []
    unseen += ["how far a long row of bonds falls that each miss little"] if any(law.bonds for law in laws) else []
    text = f"the error does not see {', nor '.join(unseen)}" if unseen else "that is what the tolerance leaves"
    auto = "" if isinstance(simulation.strategy.solver, Auto) or not unseen else "solver=cn.Auto(), "
    text += f"; give {auto}a smaller tol or accuracy=1e-3 of NSCD"
    own = any(type(law).__name__ == "Restitution" and law.mu > 0 for law in laws)
    return text + (" (Restitution with friction may do so by its law)" if own else "")


def _named(simulation):
    """Text naming the two bodies with the largest overlap."""
    pair = deepest_pair(simulation)
    return "two bodies" if pair is None else f"bodies {pair[0]} and {pair[1]}"


def _percent(share):
    return f"{share:.0%}" if share < 1e4 else f"{100 * share:.3g}%"


def _rebounds(simulation):
    """Cause and remedy of an overlap where a rule has a rebound, else None."""
    laws = [law for _, _, law in simulation._rules if law is not None and law.name == REBOUND]
    if not any(law.values[1] > 0 for law in laws):
        return None
    return (
        "Restitution with a rebound acts once bodies touch, after they overlapped by up to their speed times dt, and gives none "
        f"of it back; give {_for(simulation, 'a smaller dt', 'project_positions=True of NSCD')}"
    )


def _for(simulation, remedy, more):
    """A remedy, and one more for runs without ranks: these refuse project_positions."""
    if simulation.ranks is None:
        return f"{remedy}, or {more}"
    return f"{remedy}; without ranks= also {more}"


class StepWarnings:
    """Checks each step, and warns once of each kind."""

    def __init__(self):
        self._told, self._first_overlap, self._reach = set(), None, (0, 0, 0.0, math.inf)
        self._flights, self._sinking, self._edges, self._leaps = Flights(), Sinking(), RoundEdges(), Leaps()

    def begins_with(self, overlap):
        """Sets the deepest overlap of bodies that come in, over the size of the smaller body; the first step may add its own."""
        self._first_overlap = max(overlap, self._first_overlap or 0.0)

    def look(self, simulation, info, h):
        """Checks the report of a step of h [s]."""
        if info.get("stable_step", h) < h and simulation.strategy.unstable != "ignore":
            self._tell(
                StableStepWarning,
                f"dt is {h:g} s and the stable step of the contacts {info['stable_step']:.3g} s at time {simulation.time:g} s: "
                "give a smaller dt, softer laws or heavier bodies",
            )
        scale = getattr(simulation.strategy, "mass_scale", 1.0)
        if scale > 1:
            self._tell(
                StableStepWarning,
                f"mass_scale is {scale:g}: bodies have {scale:g} times the inertia of their mass, so that impacts, waves and "
                f"flows are {math.sqrt(scale):.3g} times slower; forces are right where loading is slow, and kinetic energy "
                "small beside the work of the loads",
                "mass_scale",
            )
        if type(getattr(simulation.strategy, "integrator", None)).__name__ == "Gear":
            self._look_at_damping(simulation, info, h)
        if RunawayWarning not in self._told:
            self._look_for_runaways(simulation, info, h)
        if "unjoined" in info:
            self._tell(UnjoinedWarning, info["unjoined"])
        if "joint_hint" in info:
            self._tell(JointWarning, f"step {simulation.steps}: {info['joint_hint']}")
        if "mesh_turned" in info:
            self._tell(TurnedWarning, f"step {simulation.steps}: {info['mesh_turned']}")
        if "mesh_within" in info:
            self._tell(OverlapWarning, info["mesh_within"])
        if "mesh_hint" in info:
            self._tell(OverlapWarning if info["mesh_depth"] > DEEP else TunnellingWarning, info["mesh_hint"])
        if "passed" not in self._told:
            self._look_for_passages(simulation, info, h)
        # only NSCD itself: springs of other strategies return stored energy, and overlap by design. Steps that miss convergence
        # by light bodies alone are checked as well
        if type(simulation.strategy) is not NSCD:
            self._look_at_springs(simulation, info)
            return
        if info["status"] == "diverged":
            return
        if info["status"] != "converged" and info["error"] > simulation.strategy.solver.tol:
            return
        if info.get("energy_created", 0.0) > MOST_CREATED:
            self._tell(
                EnergyCreatedWarning,
                f"contacts made {info['energy_created']:.0%} of the energy of step {simulation.steps} from nothing, at an error "
                f"of {info['error']:.1e}: {_creators(simulation)}",
            )
        self._look_at_overlaps(simulation, info, h)

    def _look_at_damping(self, simulation, info, h):
        """Warns of damped bodies in contact under Gear's method, which damps the fall that it predicts for bodies at rest."""
        if "gear" in self._told or not info["contacts"] or "damping" not in simulation.bodies.names:
            return
        most = h * float(np.max(simulation.bodies.damping, initial=0.0))
        if most > DAMPED:
            self._tell(
                StableStepWarning,
                f"damping times the step is {most:.2g}: under Gear's method contacts and joints of damped bodies bear "
                f"1/(1 + {most:.2g}) of the load; give a smaller dt, or another integrator",
                "gear",
            )

    def _look_at_springs(self, simulation, info):
        """Warns of an overlap that no strategy means, in a step of one that is not NSCD."""
        overlap = info.get("penetration", 0.0)
        if OverlapWarning not in self._told and overlap > DEEP:
            overlap = deepest(simulation)[1]  # springs have it over the radius of the contact
        if self._first_overlap is None:
            self._first_overlap = overlap
            if overlap >= 1:
                self._tell(
                    OverlapWarning,
                    f"{_named(simulation)} overlap by {_percent(overlap)} of the smaller one's size in step {simulation.steps}: "
                    "one lies within the other, or behind it; move it",
                )
        if overlap > max(DEEP, 2 * self._first_overlap):
            self._tell(
                OverlapWarning,
                f"{_named(simulation)} overlap by {_percent(overlap)} of the smaller one's size in step {simulation.steps}: "
                "springs are too soft for what they carry, or the step is too long for what moves; see sim.contacts.gap",
            )

    def _look_at_overlaps(self, simulation, info, h):
        """Warns of a deep or growing overlap in a step of h [s] that converged."""
        overlap = info.get("penetration", 0.0)
        leapt = None if "leaps" in self._told else self._leaps.look(simulation, overlap, h)
        if leapt is not None and self._first_overlap is not None and not core_of(simulation).overlaps_by_law():
            self._tell(
                OverlapWarning,
                f"bodies {leapt[0]} and {leapt[1]} overlap by {overlap:.2g} of the smaller one's size at once in step "
                f"{simulation.steps}, by more than they moved: a contact found across a thin part, as at the border of a sheet "
                "that a body hooks over, or one body was put into the other; give plates as boxes, or thicker surfaces",
                "leaps",
            )
        if self._first_overlap is None:
            self._first_overlap = overlap
            if overlap >= WITHIN:
                self._tell(
                    OverlapWarning,
                    f"{_named(simulation)} overlap by {_percent(overlap)} of the smaller one's size in step {simulation.steps}: "
                    "one lies within the other, or behind it, and contacts do not push it out; move it",
                )
        if overlap > max(DEEP, 2 * self._first_overlap):
            self._tell(
                OverlapWarning,
                f"{_named(simulation)} overlap by {_percent(overlap)} of the smaller one's size in step {simulation.steps}, "
                f"which converged: {_rebounds(simulation) or TOO_LONG}; see sim.contacts.gap",
            )
        known = "edges" in self._told or overlap <= 2 * self._first_overlap
        rolls = None if known else self._edges.look(simulation, overlap)
        if rolls is not None and not core_of(simulation).overlaps_by_law():
            self._tell(
                OverlapWarning,
                f"superquadric {rolls} overlaps by {overlap:.2g} of the smaller size in step {simulation.steps}: flat faces of "
                "superquadrics roll over their edges to first order of the step; give "
                + _for(simulation, "a smaller dt", "project_positions=True of NSCD"),
                "edges",
            )
        grown = None if "sinks" in self._told else self._sinking.look(overlap, self._first_overlap)
        if grown is None or len(simulation.nodes) or core_of(simulation).overlaps_by_law():
            return
        before, steps = grown
        adds_up = f"what a tolerance of {simulation.strategy.solver.tol:g} leaves adds up; give " + _for(
            simulation, "a smaller tol or dt", "project_positions=True of NSCD"
        )
        self._tell(
            OverlapWarning,
            f"{_named(simulation)} overlap by {overlap:.2g} of the smaller one's size in step {simulation.steps}, up from "
            f"{before:.2g} within {steps} steps of errors within tol: {_rebounds(simulation) or adds_up}",
            "sinks",
        )

    def _look_for_passages(self, simulation, info, h):
        """Warns of the first body that passed through another body in a step of h [s]."""
        found = self._flights.look(simulation, info, h)
        if found is not None:
            self._tell(
                TunnellingWarning,
                f"body {found.body} passed through body {found.other} in step {simulation.steps}: at {found.speed:.3g} m/s it "
                f"moves {found.speed * h / found.size:.3g} times its size of {found.size:.3g} m in a step of {h:.3g} s; give "
                f"a dt of at most {found.size / found.speed:.2g} s, or thicker bodies",
                "passed",
            )

    def _look_for_runaways(self, simulation, info, h):
        """Warns of a runaway body. A bound from kinetic energy and least mass avoids the loop over bodies in nearly all steps."""
        core = core_of(simulation)
        count = (core.body_count, core.node_count)
        if self._reach[:2] != count:
            self._reach = (*count, *(_reach_of(simulation, h) if simulation.ranks is None else _reach_of_sets(simulation)))
        reach, lightest = self._reach[2:]
        kinetic = core.energy().get("kinetic", 0.0)
        if not kinetic > 0 or h * math.sqrt(2 * kinetic / lightest) <= FAR * reach:
            return
        dim = simulation.scene.dim
        for what, view in (("body", simulation.bodies), ("node", simulation.nodes)):
            if len(view):
                way = h * np.linalg.norm(view.velocity[:, :dim], axis=1)
                k = int(np.argmax(way))
                if way[k] > FAR * reach:
                    return self._tell(
                        RunawayWarning,
                        f"{what} {view.id[k]} moves {way[k]:.1e} m in step {simulation.steps}, and all bodies reach over "
                        f"{reach:.1e} m: this step, which {ENDED.get(info['status'], 'converged')}, or one before it went wrong, "
                        "and what follows has no meaning, though it may converge; give "
                        + "a smaller dt, solver=cn.Auto() or softer laws"
                        + ", and look at the status of the steps before",
                    )

    def _tell(self, kind, text, key=None):
        """Warns once of each kind, or of each key within a kind."""
        if (key or kind) not in self._told:
            self._told.add(key or kind)
            warnings.warn(text, kind, stacklevel=5)
