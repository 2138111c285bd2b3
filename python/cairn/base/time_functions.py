"""Values that change with time: numbers, callables, or the functions below, which can be saved in files.

A scene file holds no Python code, so a plain callable is refused there; use a Table instead.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .. import _core
from . import checks


@dataclass(frozen=True, eq=False)
class Table:
    """A function of time that is piecewise linear, constant before the first and after the last instant.

    Parameters
    ----------
    times : array_like (n,)
        Rising instants [s].
    values : array_like (n,) or (n, components)
        Value at each instant.

    Raises
    ------
    ValueError
        If times do not rise or values have another number of rows.

    Examples
    --------
    >>> cn.Table([0.0, 2.0], [0.0, 10.0])(0.5)
    2.5
    """

    times: Any  # converted to an array
    values: Any

    def __post_init__(self):
        times = checks.real_array("times", self.times, (None,))
        values = checks.real_array("values", self.values, (None,) * max(1, min(2, np.ndim(self.values))))
        if len(times) == 0 or values.shape[:1] != times.shape:
            raise ValueError(f"values has shape {values.shape}: give one row for each of the {len(times)} times")
        if np.any(np.diff(times) <= 0):
            at = int(np.argmax(np.diff(times) <= 0)) + 1
            raise ValueError(f"times[{at}] is {times[at]:g}, not after {times[at - 1]:g}: give rising times")
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "values", values)

    def __call__(self, t):
        if self.values.ndim == 1:
            return float(np.interp(t, self.times, self.values))
        return np.array([np.interp(t, self.times, column) for column in self.values.T])

    def to_dict(self):
        """Gives the content of a scene file.

        Returns
        -------
        dict
            Kind, times and values.
        """
        return {"kind": "table", "times": self.times, "values": self.values}


@dataclass(frozen=True, eq=False)
class Harmonic:
    """A cosine of time: mean + amplitude * cos(2 pi frequency t + phase).

    Parameters
    ----------
    amplitude : float or tuple
        Amplitude, of a number or of each component.
    frequency : float
        Frequency [Hz].
    mean : float or tuple, default 0
        Mean, of a number or of each component.
    phase : float, default 0
        Phase [rad].

    Raises
    ------
    ValueError
        If a value is no finite number.

    Examples
    --------
    >>> cn.Harmonic(2.0, 1.0, mean=1.0)(0.5)
    -1.0
    """

    amplitude: float | tuple
    frequency: float
    mean: float | tuple = 0.0
    phase: float = 0.0

    def __post_init__(self):
        for name in ("amplitude", "mean"):
            given = getattr(self, name)
            if np.ndim(given):
                checks.real_array(name, given, (None,))
            else:
                checks.number(name, given)
        checks.number("frequency", self.frequency)
        checks.number("phase", self.phase)

    def __call__(self, t):
        wave = np.cos(2 * np.pi * self.frequency * t + self.phase)
        value = np.asarray(self.mean, float) + np.asarray(self.amplitude, float) * wave
        return float(value) if value.ndim == 0 else value

    def to_dict(self):
        """Gives the content of a scene file.

        Returns
        -------
        dict
            Kind, amplitude, frequency [Hz], mean and phase [rad].
        """
        return {
            "kind": "harmonic",
            "amplitude": np.asarray(self.amplitude, float),
            "frequency": float(self.frequency),
            "mean": np.asarray(self.mean, float),
            "phase": float(self.phase),
        }


@dataclass(frozen=True, eq=False)
class Ramp:
    """A value that is ramped up or down: value(t) * clip(begin + slope t, -1, 1).

    Parameters
    ----------
    value : float or callable
        A number or a function of time.
    begin : float
        Share of the value at t = 0 [-].
    slope : float
        Change of the share in time [1/s].
    """

    value: object
    begin: float
    slope: float

    def __call__(self, t):
        return value_at(self.value, t) * float(np.clip(self.begin + self.slope * t, -1.0, 1.0))

    def to_dict(self):
        """Gives the content of a scene file.

        Returns
        -------
        dict
            Kind, value, begin and slope.
        """
        return {"kind": "ramp", "value": to_dict("value", self.value), "begin": self.begin, "slope": self.slope}


@dataclass(frozen=True, eq=False)
class Components:
    """An array (components,) from a number or a function of time for each component.

    Parameters
    ----------
    parts : sequence
        A number or a function of time for each component.
    """

    parts: tuple

    def __post_init__(self):
        object.__setattr__(self, "parts", tuple(self.parts))

    def __call__(self, t):
        return np.array([value_at(p, t) for p in self.parts], float)

    def to_dict(self):
        """Gives the content of a scene file.

        Returns
        -------
        dict
            Kind, and each component by its number.
        """
        return {"kind": "components", **{f"{k:03d}": to_dict("component", p) for k, p in enumerate(self.parts)}}


@dataclass(frozen=True, eq=False)
class Expression:
    """A function of time that is given as text and compiled once.

    It holds numbers, ``+ - * / ^`` (or ``**``), brackets, the time ``t`` [s], ``pi``, ``e``, and the functions sin, cos, tan,
    asin, acos, atan, sinh, cosh, tanh, exp, log, sqrt, abs, sign, floor of x; min, max, pow, atan2, mod of x, y;
    ``clip(x, lowest, highest)``; ``where(x, a, b)``, which is a for x > 0; and ``table(x, x1, y1, x2, y2, ...)``, piecewise
    linear between rising x and constant beyond.

    Parameters
    ----------
    text : str or sequence of str
        The expression, or one for each component.

    Raises
    ------
    ValueError
        If a text is no expression; the message names the place and what is due there.

    Examples
    --------
    >>> cn.Expression("1e4*min(t/0.1, 1)")(0.05)
    5000.0
    >>> cn.Expression(["0.1*sin(2*pi*t)", "0", "0"])(0.25).tolist()
    [0.1, 0.0, 0.0]
    """

    text: str | tuple
    _compiled: tuple = field(init=False, repr=False)

    def __post_init__(self):
        single = isinstance(self.text, str)
        if not single and not (isinstance(self.text, (list, tuple)) and all(isinstance(part, str) for part in self.text)):
            raise ValueError(f"text is {self.text!r}: give an expression as a string, or one for each component")
        parts = (self.text,) if single else tuple(self.text)
        object.__setattr__(self, "text", self.text if single else parts)
        object.__setattr__(self, "_compiled", tuple(_core.Expression(part) for part in parts))

    def __call__(self, t):
        if isinstance(self.text, str):
            return self._compiled[0](t)
        return np.array([part(t) for part in self._compiled])

    def to_dict(self):
        """Gives the content of a scene file.

        Returns
        -------
        dict
            Kind, and each text by its number.
        """
        parts = (self.text,) if isinstance(self.text, str) else self.text
        content = {"kind": "expression", "single": isinstance(self.text, str)}
        return content | {f"{k:03d}": part for k, part in enumerate(parts)}


class Servo:
    """Force of a wall that keeps a given normal stress, for `wall(..., force=Servo(...))`.

    The force acts along the normal, on the bodies in front of the wall.

    Parameters
    ----------
    stress : float or callable
        Pressure [Pa], or a function of time that gives it; compression positive. Below 0 it pulls the wall off the bodies.
    normal : array_like (dim,)
        Normal of the wall, out of the solid; its length does not matter.
    area : float, "walls" or callable, optional
        Loaded area [m2], length times depth in 2D. "walls": the distance of the planes that face each other across the normal,
        as they stand. Not given: the extent of the grains across the normal. Along the axes of a periodic cell both are its
        length, and in 2D both are times the depth of the scene. Or a function of the simulation that measures it in each step,
        as Python alone can; all else is evaluated by the core.

    Raises
    ------
    ValueError
        If the normal has no length or another number of components than 2 or 3, or the area is not positive.

    Examples
    --------
    >>> cn.Servo(1e4, (0, -1), area=2.0)(0.0, None).tolist()
    [0.0, -20000.0]
    """

    needs_simulation = True

    def __init__(self, stress, normal, area=None):
        self.stress = stress if callable(stress) else checks.number("stress", stress)
        normal = checks.real_array("normal", normal, (None,))
        if len(normal) not in (2, 3) or not np.any(normal):
            raise ValueError(f"normal is {normal}: give a vector (2,) or (3,) of non-zero length, out of the solid")
        self.normal = normal / np.linalg.norm(normal)
        if isinstance(area, str) and area != "walls":
            raise ValueError(f"area is {area!r}: give a number [m2], 'walls', a function of the simulation, or nothing")
        self.area = area if area is None or area == "walls" or callable(area) else checks.positive("area", area)

    def __call__(self, t, simulation):
        stress = self.stress(t) if callable(self.stress) else self.stress
        if self.area is None:
            area = self.extent(simulation)
        elif self.area == "walls":
            area = simulation.loaded_area(self.normal)
        else:
            area = self.area(simulation) if callable(self.area) else self.area
        return stress * area * self.normal

    def extent(self, simulation):
        """Measures the extent of the grains across the normal, times the depth in 2D.

        Parameters
        ----------
        simulation : Simulation
            The simulation whose grains, bodies with a radius, are measured.

        Returns
        -------
        float
            Area [m2]; 0 without grains.
        """
        radii, position = simulation.radii(), simulation.bodies.position
        grains = radii > 0
        if not np.any(grains):
            return 0.0
        # directions across the normal: further columns of an orthogonal matrix whose first column is the normal
        across = np.linalg.qr(np.column_stack([self.normal, np.eye(len(self.normal))]))[0][:, 1:].T
        periodic = simulation.scene.periodic
        lengths = None if periodic is None else np.asarray(periodic.lengths, float)
        area = simulation.scene.depth if simulation.scene.dim == 2 else 1.0
        for direction in across:
            axis = int(np.argmax(np.abs(direction)))
            if lengths is not None and abs(direction[axis]) > 1 - 1e-12 and 0 < lengths[axis] < np.inf:
                area *= lengths[axis]
                continue
            places = position[grains] @ direction
            area *= np.max(places + radii[grains]) - np.min(places - radii[grains])
        return area

    def to_dict(self):
        """Gives the content of a scene file.

        Returns
        -------
        dict
            Kind, stress, normal and area [m2], nan for the extent of the grains, -1 for that between walls.

        Raises
        ------
        ValueError
            If the area is a Python function, which a file cannot hold.
        """
        if callable(self.area):
            raise ValueError("area of a Servo is a Python function, which a file cannot hold: give a number or None")
        return {
            "kind": "servo",
            "stress": to_dict("stress", self.stress),
            "normal": self.normal,
            "area": np.nan if self.area is None else -1.0 if self.area == "walls" else self.area,
        }


def value_at(given, t):
    """Gives the value of a number, an array or a function of time at an instant.

    Parameters
    ----------
    given : float, array_like or callable
        A value, or a function of time that gives it.
    t : float
        Time [s].

    Returns
    -------
    float or array_like
        The value, as it was given or as the function gives it.
    """
    return given(t) if callable(given) else given


def to_dict(name, given):
    """Gives the content of a file for a value that may change with time.

    Parameters
    ----------
    name : str
        Name of the value in the message of an error.
    given : float, array_like or callable
        A value, or a Table, Harmonic and the like.

    Returns
    -------
    dict
        The content, with its kind.

    Raises
    ------
    ValueError
        If the value is a plain Python function.
    """
    if hasattr(given, "to_dict"):
        return given.to_dict()
    if callable(given):
        raise ValueError(f"{name} is a Python function, which a file cannot hold: use cairn.Table or cairn.Harmonic")
    return {"kind": "constant", "value": np.asarray(given, float)}


def from_dict(d):
    """Makes a value that may change with time from the content of a file: the inverse of to_dict.

    Parameters
    ----------
    d : dict
        The content, with its kind.

    Returns
    -------
    ndarray, Table, Harmonic, Ramp, Components, Servo, Expression or OfTemperature
        The value.

    Raises
    ------
    ValueError
        If the kind is unknown or a number is not finite.
    """
    if d["kind"] == "table":
        return Table(d["times"], d["values"])
    if d["kind"] == "harmonic":
        return Harmonic(d["amplitude"], float(d["frequency"]), d["mean"], float(d["phase"]))
    if d["kind"] == "of_temperature":
        from .materials import OfTemperature

        return OfTemperature(tuple(d["temperatures"]), tuple(d["values"]))
    if d["kind"] == "expression":
        parts = [str(d[k]) for k in sorted(d) if k not in ("kind", "single")]
        return Expression(parts[0] if d["single"] else parts)
    if d["kind"] == "ramp":
        return Ramp(_part(d["value"]), float(d["begin"]), float(d["slope"]))
    if d["kind"] == "components":
        return Components(_part(d[k]) for k in sorted(d) if k != "kind")
    if d["kind"] == "servo":
        area = None if np.isnan(d["area"]) else "walls" if d["area"] == -1 else float(d["area"])
        stress = from_dict(d["stress"])
        return Servo(stress if callable(stress) else float(stress), d["normal"], area)
    if d["kind"] != "constant":
        kinds = "table, harmonic, ramp, components, servo, expression, of_temperature or constant"
        raise ValueError(f"kind is {d['kind']!r}: {kinds} is due")
    value = np.asarray(d["value"], float)
    if not np.all(np.isfinite(value)):
        raise ValueError(f"value is {value}: give finite numbers")
    return value


def _part(d):
    part = from_dict(d)
    return part if callable(part) else float(part)
