"""Lengths of steps, gravity, drives, belts, forces and damping of rigid bodies: constants are written once, functions of time
before each step."""

import numpy as np

from ..base import checks
from ..base.expressions import texts_of
from ..base.time_functions import Servo
from ..model.body_values import spread
from ..names import meant
from .belts import Belts
from .drives import Drives
from .sets import found
from .views import core_of


def three(values):
    """(3,) from (2,) or (3,)."""
    out = np.zeros(3)
    out[: len(values)] = values
    return out


def step_length(value, *words):
    """The length of a step [s]. words: texts that stand for one where it is given. Raises ValueError for anything else."""
    if isinstance(value, str):
        told = "".join(f', or "{word}" under SmoothDEM' for word in words)
        raise ValueError(f"dt is {value!r}: give a finite number > 0 [s]{told}{meant(value, words)}")
    return checks.positive("dt", value)


class GivenValues:
    """What the sets of a simulation give for its present bodies; made anew when bodies come, go or are driven otherwise."""

    def __init__(self, simulation):
        self._core, self._dim = core_of(simulation), simulation.scene.dim
        sets, present = simulation._sets, self._core.scene.body("id")
        self._core.release_bodies()
        self._drives, self._forced = Drives(sets, self._core, self._dim), []
        self._belts = Belts(sets, self._core, self._dim)
        damping = None
        for s in sets:
            if s.force is None and s.damping is None:
                continue
            alive, rows = found(s.own_ids, present)
            if not np.any(alive):
                continue
            if s.force is not None and not self._is_servo_of_core(present[rows[alive]], s.force, simulation.scene.depth):
                self._forced.append((rows[alive], alive, s.force))
            if s.damping is not None:
                damping = self._damping(len(present)) if damping is None else damping
                damping[rows[alive]] = s.damping[alive]
        if damping is not None:
            self._core.assign_body("damping", damping)
        self.forces_are_due = True  # constant forces are written before the next step

    def _damping(self, count):
        values = self._core.scene.body("damping")
        return values if values.shape == (count,) else np.zeros(count)

    def _is_servo_of_core(self, ids, force, depth):
        """Hands a Servo of bodies to the core; False where Python has to evaluate it."""
        if not isinstance(force, Servo) or not (force.area is None or isinstance(force.area, (float, int, str))):
            return False
        texts = texts_of(force.stress)
        if texts is None or len(texts) != 1 or len(force.normal) != self._dim:
            return False
        area = "grains" if force.area is None else force.area if isinstance(force.area, str) else repr(float(force.area))
        for body in ids:
            self._core.set_servo(int(body), three(force.normal), texts[0], area, depth)
        return True

    def apply(self, simulation, h):
        """Writes the values for the next step of the simulation, of h seconds."""
        t, end = simulation.time, simulation.time + h
        late_share = simulation.strategy.end_share
        gravity = simulation.scene.gravity
        if callable(gravity):
            late, early = (checks.real_array("gravity", gravity(at), (self._dim,)) for at in (end, t))
            gravity = late_share * late + (1 - late_share) * early
        self._core.set_gravity(three(gravity))
        self._drives.apply(end)
        self._belts.apply(end)
        if self._forced and (self.forces_are_due or any(callable(force) for _, _, force in self._forced)):
            self._write_forces(simulation, t, end, late_share)

    def _write_forces(self, simulation, t, end, late_share):
        forces = np.zeros((len(simulation.bodies), 3 * self._dim - 3))
        for rows, alive, force in self._forced:
            if callable(force):
                late, early = (self._rows(simulation._call(force, at), alive) for at in (end, t))
                forces[rows] += late_share * late + (1 - late_share) * early
            else:
                forces[rows] += force[alive]
        self._core.assign_body("force", forces)
        self.forces_are_due = False

    def _rows(self, value, alive):
        return np.ascontiguousarray(spread("force", value, len(alive), 3 * self._dim - 3, self._dim)[alive])
