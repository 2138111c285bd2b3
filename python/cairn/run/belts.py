"""Surface velocities of rigid bodies in a simulation: belts, rollers and drums whose surface moves while they stay in place."""

import numpy as np

from ..base import checks
from ..model.bodies import DOFS, rows
from .sets import found


class Belts:
    """Surface velocities of the present bodies, from the sets of a simulation. Constant ones are written once; see `apply`."""

    def __init__(self, sets, core, dim):
        present = core.scene.body("id")
        self._core, self._dim, self._values, self._functions = core, dim, None, []
        for s in sets:
            if s.surface_velocity is None:
                continue
            alive, at = found(s.own_ids, present)
            if not alive.any():
                continue
            if self._values is None:
                before, shape = core.scene.body("surface_velocity"), (len(present), len(DOFS[dim]))
                self._values = before if before.shape == shape else np.zeros(shape)
            if callable(s.surface_velocity):
                self._functions.append((s, alive, at[alive]))
            else:
                self._values[at[alive]] = in_body_axes(s, s.surface_velocity)[alive]
        if self._values is not None:
            self._write()

    def _write(self):
        self._core.assign_body("surface_velocity", self._values)

    def apply(self, time):
        """Writes the velocities given by functions of time at an instant [s]."""
        for s, alive, at in self._functions:
            given = rows("surface_velocity", s.surface_velocity(time), len(s), self._dim)
            self._values[at] = in_body_axes(s, checks.speeds("surface_velocity", given))[alive]
        if self._functions:
            self._write()


def in_body_axes(s, given):
    """Velocities and spins (n, dofs) about the centres of mass in axes of the bodies, from those of a set in axes of space."""
    v, w = np.array(given[:, : s.dim]), np.array(given[:, s.dim :])
    if s.surface_origin is not None:
        arm = s.position - s.surface_origin
        v += np.cross(w, arm) if s.dim == 3 else w * np.column_stack((-arm[:, 1], arm[:, 0]))
    if s.rotation is None:
        return np.concatenate((v, w), axis=1)
    if s.dim == 3:
        axis = -s.rotation[:, 1:] / np.linalg.norm(s.rotation, axis=1)[:, None]
        real = s.rotation[:, :1] / np.linalg.norm(s.rotation, axis=1)[:, None]
        v, w = (a + 2 * np.cross(axis, np.cross(axis, a) + real * a) for a in (v, w))
    else:
        c, sine = np.cos(s.rotation), np.sin(s.rotation)
        v = np.column_stack((c * v[:, 0] + sine * v[:, 1], c * v[:, 1] - sine * v[:, 0]))
    return np.concatenate((v, w), axis=1)
