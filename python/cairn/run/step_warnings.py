"""What a step warns of, once a run: a converged step may still be far from what was meant."""

from __future__ import annotations

import warnings

from .strategies import NSCD


class OverlapWarning(UserWarning):
    """Bodies overlap at the start by more than the share that was allowed, or sink into each other in steps that converge."""


class StableStepWarning(UserWarning):
    """The step is longer than the contacts of a smooth scene keep stable."""


class EnergyCreatedWarning(UserWarning):
    """Contacts made energy from nothing in a step that converged: the residual does not see a heavy body on light ones."""


# of the energy of a step; a bounce that ends within a step may show a sixth
MOST_CREATED = 0.25
# overlap over the size of the smaller body
DEEP = 0.5


class StepWarnings:
    """Warns of each kind once."""

    def __init__(self):
        self._told, self._first_overlap = set(), None

    def look(self, simulation, info, h):
        """Looks at the report of a step of h [s]."""
        if info.get("stable_step", h) < h and simulation.strategy.unstable != "ignore":
            self._tell(
                StableStepWarning,
                f"dt is {h:g} s and the stable step of the contacts {info['stable_step']:.3g} s at time {simulation.time:g} s: "
                "give a smaller dt, softer laws or heavier bodies",
            )
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
                f"of {info['error']:.1e}: the error does not see a heavy body that light ones carry; give solver=cn.Auto() or a "
                "smaller tol (Restitution with friction may do so by its law)",
            )
        overlap = info.get("penetration", 0.0)
        if self._first_overlap is None:
            self._first_overlap = overlap
        if overlap > max(DEEP, 2 * self._first_overlap):
            self._tell(
                OverlapWarning,
                f"a body overlaps another by {overlap:.0%} of the smaller one's size in step {simulation.steps}, which "
                "converged: the step is too long for what moves, or masses differ by more than numbers of 16 digits hold; see "
                "sim.contacts.gap",
            )

    def _tell(self, kind, text):
        if kind not in self._told:
            self._told.add(kind)
            warnings.warn(text, kind, stacklevel=5)
