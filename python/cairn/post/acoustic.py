"""Acoustic events of a run: when and where contacts break, are damaged or damp, and the energy that each sets free."""

from __future__ import annotations

import numpy as np

from ..base import checks


class AcousticEvents:
    """Collects the energy released by each contact as acoustic events: `events = cn.post.AcousticEvents(sim)`, `sim.run(...,
    callback=events)`, then `events.table`.

    An event is the energy that a contact releases in consecutive steps; it ends after `quiet` steps (1) without release. Energy
    released before the object was made does not count. The energies of all events sum, to rounding, to the released energy of the
    balance since then (`sim.energy["released"]`) less that of joints; the energy stored by a spring that begins to act counts as
    negative. Raises ValueError if simulation is
    no Simulation, or quiet no whole number >= 1.
    """

    def __init__(self, simulation, quiet=1):
        from ..run.simulation import Simulation

        if not isinstance(simulation, Simulation):
            raise ValueError(f"simulation is {simulation!r}: give a cairn.Simulation")
        self._quiet, self._rows, self._open = checks.count("quiet", quiet, 1), [], {}
        self._dim = simulation.scene.dim
        self._key, self._released = self._found(simulation)[:2]

    @staticmethod
    def _found(simulation):
        """Keys of the contacts that released energy, the energy of each [J], and their numbers."""
        contacts = simulation.contacts
        released = np.asarray(contacts.releases())
        number = np.flatnonzero(released != 0)
        return np.asarray(contacts.key)[number], released[number], number

    def __call__(self, simulation):
        """After a step."""
        key, released, number = self._found(simulation)
        _, same = np.unique(np.concatenate([self._key, key]), axis=0, return_inverse=True)
        same = same.ravel()
        before = np.zeros(len(same))
        before[same[: len(self._key)]] = self._released
        energy = released - before[same[len(self._key) :]]
        self._key, self._released = key, released
        contacts, step = simulation.contacts, simulation.steps
        grew = np.flatnonzero(energy != 0)
        if not len(grew):
            return
        pairs, places = np.asarray(contacts.bodies), np.asarray(contacts.point)
        for k in grew:
            name = key[k].tobytes()
            at, last = self._open.get(name, (-1, -1))
            if at < 0 or step - last > self._quiet:
                at = len(self._rows)
                begin = simulation.time - simulation.dt
                self._rows.append([begin, begin, *pairs[number[k]], places[number[k]].copy(), 0.0])
            row = self._rows[at]
            row[1] = simulation.time
            row[5] += energy[k]
            self._open[name] = (at, step)

    @property
    def table(self):
        """One row an event, in the order in which they began: `begin`, `end` [s], `body_a`, `body_b` (ids), `point` (dim) at the
        first release [m], `energy` [J]; a structured array."""
        numbers = [(name, float) for name in ("begin", "end")] + [(name, np.int64) for name in ("body_a", "body_b")]
        kinds = [*numbers, ("point", float, (self._dim,)), ("energy", float)]
        return np.array([tuple(row) for row in self._rows], dtype=kinds)
