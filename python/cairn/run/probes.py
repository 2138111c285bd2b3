"""Probes: numbers of a run that its history keeps, read by the core or by functions of the simulation."""

from __future__ import annotations

import math

import numpy as np

from ..base import checks
from .views import core_of

#: quantities of the liquid, which Python reads
OF_FLUID = {"report.fluid_volume": lambda simulation: simulation.fluid.info["volume"]}


class Probe:
    """A number that a run records, every so many steps, for `run(probes={name: Probe(...)})`.

    Parameters
    ----------
    quantity : str or callable
        What the core reads: a field of bodies and its component, "position.z", "velocity.wy" (x, y, w in 2D, x, y, z, wx, wy, wz
        in 3D), "temperature"; "contact_force.x", the force of contacts on a body [N]; "energy.TERM", "report.NUMBER", of a liquid
        "report.fluid_volume"; of a periodic cell "cell.xx", a component of its vectors [m], and "stress.xx", of its contacts,
        compression positive [Pa].
        Or a function of the simulation that gives a number, called in Python.
    of : array_like of int, optional
        Ids of bodies; all of them when not given.
    take : {"mean", "sum", "min", "max"}
        What is taken of the bodies.
    every : int, default 1
        Steps between two numbers; the history has NaN in other steps.

    Raises
    ------
    ValueError
        If a value is wrong; what the scene has not is told when the run begins.

    Examples
    --------
    >>> lid = cn.Probe("position.z", of=[7])
    >>> load = cn.Probe("contact_force.z", of=[7], every=20)
    """

    def __init__(self, quantity, of=None, take="mean", every=1):
        if not callable(quantity) and not isinstance(quantity, str):
            raise ValueError(f"quantity is {quantity!r}: give the name of a quantity, or a function of the simulation")
        if callable(quantity) and of is not None:
            raise ValueError("of is given beside a function of the simulation, which chooses itself: leave it out")
        self.quantity, self.take = quantity, take
        self.of = np.zeros(0, np.int64) if of is None else checks.body_ids(np.atleast_1d(of))
        self.every = checks.count("every", every, 1)

    def __repr__(self):
        return f"Probe({self.quantity!r}, every={self.every})"


class Recorded:
    """Values of the probes of a run in each step.

    Parameters
    ----------
    simulation : Simulation
        The simulation.
    probes : dict or None
        Probe or function by name.
    """

    def __init__(self, simulation, probes):
        self._simulation, self._core = simulation, core_of(simulation)
        self._called, self._read = [], []
        self._core.clear_probes()
        for name, probe in (probes or {}).items():
            if not isinstance(probe, Probe):
                probe = Probe(probe)
            if callable(probe.quantity):
                self._called.append((name, probe, probe.quantity))
            elif probe.quantity in OF_FLUID:
                OF_FLUID[probe.quantity](simulation)  # a scene without a liquid is refused before the first step
                self._called.append((name, probe, OF_FLUID[probe.quantity]))
            else:
                self._core.add_probe(probe.quantity, probe.of, probe.take, probe.every)
                self._read.append(name)

    def values(self):
        """Gives the values after a step.

        Returns
        -------
        dict of float
            By name; NaN of a probe that is not due.

        Raises
        ------
        ValueError
            If a function gives anything but a real number.
        """
        out = dict(zip(self._read, self._core.probe_values())) if self._read else {}
        steps = self._simulation.steps
        for name, probe, read in self._called:
            out[name] = math.nan if steps % probe.every else one_number(name, read(self._simulation))
        return out

    def close(self):
        """Ends the reading."""
        self._core.clear_probes()


def one_number(name, value):
    """Checks the value of a probe.

    Parameters
    ----------
    name : str
        Name of the probe.
    value : object
        Its value.

    Returns
    -------
    float
        The value as a double.

    Raises
    ------
    ValueError
        If it is anything but a real number.
    """
    array = np.asarray(value)
    if array.ndim or array.dtype.kind not in "fiub":
        what = f"an array of shape {array.shape}" if array.ndim else repr(value)
        raise ValueError(f"probe {name!r} gave {what}: a probe gives one real number; give a probe for each number to record")
    return float(array)
