"""Texts of functions of time, which the core compiles once: steps evaluate them without Python."""

from __future__ import annotations

import numpy as np

from .time_functions import Components, Expression, Harmonic, Ramp, Table


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
    if isinstance(value, Table):
        columns = np.reshape(value.values, (len(value.times), -1)).T
        return [f"table(t, {', '.join(f'{t!r}, {x!r}' for t, x in zip(value.times.tolist(), c))})" for c in columns.tolist()]
    if isinstance(value, Harmonic):
        wave = f"cos(2*pi*{_number(value.frequency)}*t + {_number(value.phase)})"
        amplitude, mean = np.broadcast_arrays(np.asarray(value.amplitude, float), np.asarray(value.mean, float))
        return [f"{_number(m)} + {_number(a)}*{wave}" for a, m in zip(amplitude.ravel(), mean.ravel())]
    if isinstance(value, Ramp):
        share = f"clip({_number(value.begin)} + {_number(value.slope)}*t, -1, 1)"
        parts = texts_of(value.value)
        return parts and [f"({part})*{share}" for part in parts]
    if isinstance(value, Components):
        parts = [texts_of(part) for part in value.parts]
        return [part[0] for part in parts] if all(part and len(part) == 1 for part in parts) else None
    if callable(value):
        return None
    numbers = np.asarray(value, float)
    return [_number(x) for x in numbers.ravel()] if np.all(np.isfinite(numbers)) else None


def _number(x):
    return f"({float(x)!r})"
