"""Contact laws, one class for each row of the kernel's list: `Coulomb(mu=0.4)`, `Restitution(mu=0.3, normal=0.8)`, ...

A law holds parameters only; the mechanics are in the kernels (core_f90/contact_laws, one file each).
"""

from __future__ import annotations

import math

import numpy as np

from .. import _core
from ..base import checks
from ..base.materials import OfTemperature
from ..names import by_name, listed, parameters_section
from .law_parameters import told


class Law:
    """Base of contact laws: a law holds its parameters, the kernels the mechanics.

    `name` is that of the kernel, `row` its row in the list of laws. A parameter may be a cairn.networks.OfTemperature, evaluated
    at the mean temperature of both sides at the beginning of the step: `values` then holds its largest value, and
    `of_temperature` its index and the curve.

    Parameters
    ----------
    values : sequence of float
        Parameters in the order of `parameter_names`.
    of_temperature : sequence, optional
        (index, OfTemperature) of each parameter that depends on temperature.
    """

    name: str
    row: int
    parameter_names: tuple[str, ...] = ()
    bonds: bool = False  # True for cohesive laws, whose contact points are fixed to the bodies

    def __init__(self, values, of_temperature=()):
        object.__setattr__(self, "values", tuple(values))
        object.__setattr__(self, "of_temperature", tuple(of_temperature))

    def __setattr__(self, name, value):
        own = type(self).__name__
        if name in self.parameter_names:
            raise AttributeError(f"{name} of {own} is {getattr(self, name)}, and stays so: make another, {own}({name}=...)")
        raise AttributeError(f"{own} has no parameter {name!r}; it has {listed(self.parameter_names, name)}")

    def __getattr__(self, name):
        if name not in self.parameter_names:
            raise AttributeError(f"{type(self).__name__} has no parameter {name!r}; it has {listed(self.parameter_names, name)}")
        place = self.parameter_names.index(name)
        return dict(self.of_temperature).get(place, self.values[place])

    def __repr__(self):
        curves = dict(self.of_temperature)
        words = ", ".join(f"{n}={curves[k] if k in curves else format(v, 'g')}"
                          for k, (n, v) in enumerate(zip(self.parameter_names, self.values)))  # fmt: skip
        return f"{type(self).__name__}({words})"

    def __eq__(self, other):
        return type(self) is type(other) and self.values == other.values and self.of_temperature == other.of_temperature

    def __hash__(self):
        return hash((type(self).__name__, self.values, self.of_temperature))


def _row(own, name, default, low, high):
    """Row of help() on a parameter: type and default; meaning and unit (of built-in laws only) and range."""
    unit, meaning = own and told(own, name) or ("", "")
    about = f"{meaning} [{unit}], " if meaning else ""
    kind = "float or OfTemperature" + ("" if default is None else f", default {default:g}")
    return name, kind, f"{about}from {low:.12g} to {high:.12g}"


def _unit(own, name):
    """Unit of a parameter after its range in errors, " [rad]"; "" of plain numbers."""
    unit = (told(own, name) or ("-",))[0]
    return "" if unit == "-" else f" [{unit}]"


def _law_class(row, description, plugged=False):
    parameters = description["parameters"]
    names = tuple(p[0] for p in parameters)

    def __init__(self, *unnamed, **given):
        own = type(self).__name__
        if unnamed:
            call = ", ".join(f"{n}={v!r}" for n, v in zip(names, unnamed)) if len(unnamed) <= len(names) else "".join(names[:1])
            raise TypeError(f"{own} takes its parameters by name, {', '.join(names) or 'and has none'}: give {own}({call})")
        unknown = sorted(set(given) - set(names))
        if unknown:
            raise TypeError(f"{own} has no parameter {unknown[0]!r}; it has {listed(names, unknown[0])}")
        values, curves = [], []
        for name, default, smallest, largest in parameters:
            value, to = given.get(name, default), f"to {largest:g}" + ("" if plugged else _unit(own, name))
            if isinstance(value, OfTemperature):
                for v in value.values:
                    if not smallest <= v <= largest:
                        raise ValueError(f"{name} of {own} is {v:g} at some temperature: give values from {smallest:g} {to}")
                curves.append((len(values), value))
                value = max(value.values)
            if value is None:
                raise TypeError(f"{own} needs {name}, from {smallest:g} {to}")
            if isinstance(value, (float, np.floating)) and math.isnan(value):
                raise ValueError(f"{name} of {own} is nan: give a value from {smallest:g} {to}")
            value = checks.number(f"{name} of {own}", value, finite=False)
            if not smallest <= value <= largest:
                raise ValueError(f"{name} of {own} is {value:g}: give a value from {smallest:g} {to}")
            values.append(value)
        Law.__init__(self, values, curves)
        # lets the kernel check conditions on several parameters together
        of_temperature = [(k, list(of.temperatures), list(of.values)) for k, of in curves]
        _core.LawTable([], []).rule("*", "*", row, list(self.values), of_temperature)

    rows = [_row(None if plugged else description["python_name"], *parameter) for parameter in parameters]
    doc = "\n".join([f"Contact law {description['name'].replace('_', ' ')}.", *parameters_section(rows)])
    members = {"name": description["name"], "row": row, "parameter_names": names, "__init__": __init__, "__doc__": doc}
    members["bonds"] = description["bonds"]
    members["__signature__"] = by_name(parameters)  # for help(), notebooks, documentation
    return type(description["python_name"], (Law,), members)


def plugged_class(row, description):
    """Makes and registers the class of a law from a library, so that files can name it.

    Parameters
    ----------
    row : int
        Row of the law in the list of laws.
    description : dict
        Name, parameters and kind of the law, as the core tells them.

    Returns
    -------
    type
        The class, a Law.
    """
    made = _law_class(row, description, plugged=True)
    BY_NAME[made.name] = made
    return made


LAWS = {d["python_name"]: _law_class(row, d) for row, d in enumerate(_core.laws())}
BY_NAME = {law.name: law for law in LAWS.values()}
del LAWS["Joint"]  # made by Scene.join
globals().update(LAWS)
__all__ = ["Law", *LAWS]


def law_from(name, values, of_temperature=None):
    """Makes a law that a file holds.

    Parameters
    ----------
    name : str
        Name of its kernel.
    values : sequence of float
        Parameters in their order.
    of_temperature : dict, optional
        {index: OfTemperature} of parameters that depend on temperature.

    Returns
    -------
    Law
        The law.

    Raises
    ------
    ValueError
        If there is no law of this name; a law of a library is known after cairn.plug alone.
    """
    if name not in BY_NAME:
        raise ValueError(
            f"there is no contact law {name!r}; there are {listed(BY_NAME, name)}; "
            "a law of your own is known after cairn.plug(library, law=...)"
        )
    law = BY_NAME[name]
    given = list(values)
    for place, curve in (of_temperature or {}).items():
        given[place] = curve
    return law(**dict(zip(law.parameter_names, given)))
