"""Imposed velocities of rigid bodies in a simulation; each dof of a body is driven by the last set that names it."""

import numpy as np

from ..base.expressions import texts_of
from ..model.bodies import DOFS, rows
from .sets import dofs_named, found


class Drives:
    """Driven dofs and velocities of the present bodies, from the sets of a simulation in their order; see `apply`. Functions of
    time that the core can evaluate are handed to it."""

    def __init__(self, sets, core, dim):
        scene, self._core, self._dim = core.scene, core, dim
        present, dofs = scene.body("id"), len(DOFS[dim])
        left = np.full(len(present), 2**dofs - 1, np.uint8)  # dofs not named by a later set
        mask, told = np.zeros(len(present), np.uint8), np.zeros(len(present), bool)
        velocity, self._functions, compiled = np.zeros((len(present), dofs)), [], []
        before = scene.body("driven_velocity") if any(callable(s.imposed) for s in sets) else np.empty(0)
        for s in reversed(sets):
            if s.mass is not None and not s.mask:
                continue
            alive, at = found(s.own_ids, present)
            at = at[alive]
            gets = left[at] & s.mask
            left[at] &= ~np.uint8(dofs_named(s))
            mask[at] |= gets
            drive = s.imposed
            told[at] |= drive is not None or s.mass is None
            bits = (gets[:, None] >> np.arange(dofs) & 1).astype(bool)
            if callable(drive) and bits.any():
                texts = _compiled(s, dofs)
                if texts is None:
                    self._functions.append((drive, alive, at, bits))
                else:
                    compiled.append((texts, at, bits))
                if before.size:
                    velocity[at] = np.where(bits, before.reshape(len(present), -1)[at], velocity[at])
            elif drive is not None and not callable(drive):
                velocity[at] = np.where(bits, drive[alive], velocity[at])
        self._ids, self._velocity = present, velocity
        moving = np.zeros(len(present), bool)
        for _, _, at, bits in self._functions:
            moving[at[bits.any(axis=1)]] = True
        self._groups = [(np.flatnonzero(moving & (mask == m)), int(m)) for m in np.unique(mask[moving])]
        for m in np.unique(mask[told]):
            self._write(np.flatnonzero(told & (mask == m)), int(m))
        if not self._functions:
            self._ids = self._velocity = None  # arrays of all bodies are kept only while a function needs them
        for texts, at, bits in compiled:
            for dof in np.flatnonzero(bits.any(axis=0)):
                core.drive_by(present[at[bits[:, dof]]], int(dof), texts[dof])

    def _write(self, chosen, mask):
        self._core.drive(self._ids[chosen], mask, np.ascontiguousarray(self._velocity[chosen]))

    def apply(self, time):
        """Writes the velocities given by functions of time at an instant [s]; constant ones were written once."""
        for drive, alive, at, bits in self._functions:
            given = rows("drive", drive(time), len(alive), self._dim)[alive]
            self._velocity[at] = np.where(bits, given, self._velocity[at])
        for chosen, mask in self._groups:
            self._write(chosen, mask)


def _compiled(s, dofs):
    """Text of the velocity of each dof of a set; None where Python has to call its function."""
    texts = texts_of(s.drive)
    if texts is None:
        return None
    if len(texts) == s.dim:
        texts = texts + ["0"] * (dofs - s.dim)
    return texts if len(texts) == dofs else None
