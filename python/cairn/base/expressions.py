"""Functions of time as text, which the core compiles once: steps evaluate them without Python."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .. import _core
from . import time_functions


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


def from_dict(d):
    """Makes an Expression from the content of a file.

    Parameters
    ----------
    d : dict
        As Expression.to_dict gave it.

    Returns
    -------
    Expression
        The function.
    """
    parts = [str(d[k]) for k in sorted(d) if k not in ("kind", "single")]
    return Expression(parts[0] if d["single"] else parts)


def texts_of(value):
    """Gives the text of each component of a value or function of time.

    Parameters
    ----------
    value : float, array_like or callable
        A number, an array (components,), an Expression, Table, Harmonic, Ramp or Components.

    Returns
    -------
    list of str or None
        A text for each component, one for a number; None for other functions, which Python alone can call.
    """
    if isinstance(value, Expression):
        return [value.text] if isinstance(value.text, str) else list(value.text)
    if isinstance(value, time_functions.Table):
        columns = np.reshape(value.values, (len(value.times), -1)).T
        return [f"table(t, {', '.join(f'{t!r}, {x!r}' for t, x in zip(value.times.tolist(), c))})" for c in columns.tolist()]
    if isinstance(value, time_functions.Harmonic):
        wave = f"cos(2*pi*{_number(value.frequency)}*t + {_number(value.phase)})"
        amplitude, mean = np.broadcast_arrays(np.asarray(value.amplitude, float), np.asarray(value.mean, float))
        return [f"{_number(m)} + {_number(a)}*{wave}" for a, m in zip(amplitude.ravel(), mean.ravel())]
    if isinstance(value, time_functions.Ramp):
        share = f"clip({_number(value.begin)} + {_number(value.slope)}*t, -1, 1)"
        parts = texts_of(value.value)
        return parts and [f"({part})*{share}" for part in parts]
    if isinstance(value, time_functions.Components):
        parts = [texts_of(part) for part in value.parts]
        return [part[0] for part in parts] if all(part and len(part) == 1 for part in parts) else None
    if callable(value):
        return None
    numbers = np.asarray(value, float)
    return [_number(x) for x in numbers.ravel()] if np.all(np.isfinite(numbers)) else None


def _number(x):
    return f"({float(x)!r})"
