"""What a step warns of, once a run: a converged step may still be far from what was meant."""

from __future__ import annotations

import math
import warnings

import numpy as np

from .passing import Flights
from .sets import free_masses
from .sinking import Sinking, deepest_pair
from .strategies import NSCD, Auto
from .views import core_of


class OverlapWarning(UserWarning):
    """Bodies overlap at the start by more than the share that was allowed, lie all behind a wall, or sink into each other in
    steps that converge; or one begins deep in a mesh, or wholly within it."""


class StableStepWarning(UserWarning):
    """The step is longer than the contacts of a smooth scene keep stable."""


class EnergyCreatedWarning(UserWarning):
    """Contacts made energy from nothing in a step that converged: what its tolerance leaves, or what its error does not see."""


class JointWarning(UserWarning):
    """A joint stands off by more of its length than the tolerance: its bodies turn or swing faster than the step follows."""


class TunnellingWarning(UserWarning):
    """A step moved a body through another one, or moved a mesh against other bodies by more than the width of a cell."""


class TurnedWarning(UserWarning):
    """A mesh turned whose displacements count as small: it grows by half the square of its turn."""


class UnjoinedWarning(UserWarning):
    """Bodies came in touching under a law that joins by the area of a contact, along a line or at a corner, which has none."""


class RunawayWarning(UserWarning):
    """A step gave a body a velocity that moves it a million times as far as all bodies reach: what follows has no meaning."""


# a step's way over the reach of all bodies
FAR = 1e6
# of the energy of a step; a bounce that ends within a step may show a sixth
MOST_CREATED = 0.25
# beyond which the error may not see what heavy bodies do to light ones
MASSES_DIFFER = 100
# overlap over the size of the smaller body, or over that of a cell of a mesh
DEEP = 0.5
# the same ratio for a body wholly within another one, up to rounding
WITHIN = 2 * (1 - 1e-6)


ENDED = {"iteration_limit": "ended at the limit of its iterations", "diverged": "diverged",
         "newton_limit": "ended at the limit of Newton's method"}  # fmt: skip


def _reach_of(simulation, h):
    """How far apart bodies and nodes were before a step, with their radii [m], and the least mass that is finite [kg]."""
    low, high, lightest = np.inf, -np.inf, np.inf
    for view in (simulation.bodies, simulation.nodes):
        if len(view):
            mass = np.ravel(view.mass)
            x = view.position - h * view.velocity[:, : simulation.scene.dim]
            low, high = np.minimum(low, x.min(axis=0)), np.maximum(high, x.max(axis=0))
            lightest = min(lightest, mass[mass > 0].min(initial=np.inf))
    if not lightest < np.inf or not np.any(high > low):  # nothing that moves, or one place alone: no scene to leave
        return np.inf, np.inf
    return float(np.linalg.norm(high - low)) + 2 * float(np.max(simulation.radii(), initial=0.0)), lightest


def _creators(simulation):
    """What in the scene may make energy at a small error, and what helps, in words."""
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
    """The two bodies that overlap most, in words."""
    pair = deepest_pair(simulation)
    return "two bodies" if pair is None else f"bodies {pair[0]} and {pair[1]}"


class StepWarnings:
    """Warns of each kind once."""

    def __init__(self):
        self._told, self._first_overlap, self._reach = set(), None, (0, 0, 0.0, math.inf)
        self._flights, self._sinking = Flights(), Sinking()

    def begins_with(self, overlap):
        """The deepest overlap before the first step, of the smaller body's size: that of the first step may be its own doing."""
        self._first_overlap = overlap

    def look(self, simulation, info, h):
        """Looks at the report of a step of h [s]."""
        if info.get("stable_step", h) < h and simulation.strategy.unstable != "ignore":
            self._tell(
                StableStepWarning,
                f"dt is {h:g} s and the stable step of the contacts {info['stable_step']:.3g} s at time {simulation.time:g} s: "
                "give a smaller dt, softer laws or heavier bodies",
            )
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
        # the springs of GranularElement give back what they stored, and overlap; steps that only light bodies keep from having
        # converged are told of, too
        if type(simulation.strategy) is not NSCD or info["status"] == "diverged":
            return
        if info["status"] != "converged" and info["error"] > simulation.strategy.solver.tol:
            return
        if info.get("energy_created", 0.0) > MOST_CREATED:
            self._tell(
                EnergyCreatedWarning,
                f"contacts made {info['energy_created']:.0%} of the energy of step {simulation.steps} from nothing, at an error "
                f"of {info['error']:.1e}: {_creators(simulation)}",
            )
        self._look_at_overlaps(simulation, info)

    def _look_at_overlaps(self, simulation, info):
        """Warns of a deep or growing overlap in a step that converged."""
        overlap = info.get("penetration", 0.0)
        if self._first_overlap is None:
            self._first_overlap = overlap
            if overlap >= WITHIN:
                self._tell(
                    OverlapWarning,
                    f"{_named(simulation)} overlap by {overlap:.0%} of the smaller one's size in step {simulation.steps}: one "
                    "lies within the other, or behind it, and contacts do not push it out; move it",
                )
        if overlap > max(DEEP, 2 * self._first_overlap):
            self._tell(
                OverlapWarning,
                f"{_named(simulation)} overlap by {overlap:.0%} of the smaller one's size in step {simulation.steps}, which "
                "converged: the step is too long for what moves, or masses differ by more than numbers of 16 digits hold; see "
                "sim.contacts.gap",
            )
        grown = None if "sinks" in self._told else self._sinking.look(overlap, self._first_overlap)
        if grown is None or len(simulation.nodes) or core_of(simulation).overlaps_by_law():
            return
        before, steps = grown
        self._tell(
            OverlapWarning,
            f"{_named(simulation)} overlap by {overlap:.2g} of the smaller one's size in step {simulation.steps}, up from "
            f"{before:.2g} within {steps} steps of errors within tol: what a tolerance of {simulation.strategy.solver.tol:g} "
            "leaves adds up; give a smaller tol, a smaller dt, or project_positions=True of NSCD",
            "sinks",
        )

    def _look_for_passages(self, simulation, info, h):
        """Warns of the first body that passed through another one in a step of h [s]."""
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
        """Of all bodies by their energy and the lightest one, so that nearly all steps are done with one root."""
        core = core_of(simulation)
        count = (core.scene.body_count, core.scene.node_count)
        if self._reach[:2] != count:
            self._reach = (*count, *_reach_of(simulation, h))
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
                        "and what follows has no meaning, though it may converge; give a smaller dt, solver=cn.Auto() or softer "
                        "laws, and look at the status of the steps before",
                    )

    def _tell(self, kind, text, key=None):
        """Warns once of each kind, or of each key within a kind."""
        if (key or kind) not in self._told:
            self._told.add(key or kind)
            warnings.warn(text, kind, stacklevel=5)
