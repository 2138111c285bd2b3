"""Conductances of contacts, a class for each row of the kernels' list (core_f90/networks): Holm(), Sharvin(free_path=4e-8)."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np

from .. import _core
from ..base import checks
from ..names import by_name, listed, parameters_section


class Conductance:
    """A kernel and its parameters. reads: properties of a contact that it needs. row: in the list of kernels, None if plugged."""

    reads: tuple = ()
    row: int | None = None
    parameter_names: tuple = ()

    def __init__(self, values):
        self.values = tuple(values)

    @classmethod
    def from_values(cls, values):
        """Makes a conductance from the `values` of another one, as read from a file."""
        made = cls.__new__(cls)
        Conductance.__init__(made, map(float, values))
        return made

    def __repr__(self):
        words = ", ".join(f"{n}={v:g}" for n, v in zip(self.parameter_names, self.values))
        return f"{type(self).__name__}({words})"


def _checked(own, parameters, given):
    names = [p[0] for p in parameters]
    unknown = sorted(set(given) - set(names))
    if unknown:
        raise TypeError(f"{own} has no parameter {unknown[0]!r}; it has {listed(names, unknown[0])}")
    values = []
    for name, standard, smallest, largest in parameters:
        value = given.get(name, standard)
        if value is None:
            raise TypeError(f"{own} needs {name}, from {smallest:g} to {largest:g}")
        value = checks.number(f"{name} of {own}", value, finite=False)
        if not smallest <= value <= largest:
            raise ValueError(f"{name} of {own} is {value:g}: give a value from {smallest:g} to {largest:g}")
        values.append(value)
    return values


def _class_of(row, described):
    own, parameters = described["python_name"], described["parameters"]
    names = tuple(p[0] for p in parameters)

    def __init__(self, *values, **given):
        if values:
            told = ", ".join(f"{name}=..." for name in names)
            raise TypeError(f"{own} takes its parameters by name, and {values[0]!r} has none: give {own}({told})")
        Conductance.__init__(self, _checked(own, parameters, given))

    rows = [
        (name, "float" if default is None else f"float, default {default:g}", f"from {low:g} to {high:g}")
        for name, default, low, high in parameters
    ]
    doc = "\n".join([f"Conductance of contacts: {described['meaning']}.", *parameters_section(rows)])
    members = {"row": row, "reads": tuple(described["reads"].split()), "parameter_names": names, "__doc__": doc}
    members["__signature__"] = by_name(parameters)
    return type(own, (Conductance,), {**members, "__init__": __init__})


class _Given(Conductance):
    """Conductance h(p, gap) times an area, by a table: bilinear, constant beyond its ends.

    pressures: (n,) rising [Pa]; gaps: (m,) rising [m]; h: (n, m) [W/(m2 K) | S/m2]; area: of each contact [m2].
    """

    def __init__(self, *, pressures, gaps, h, area):
        p, g = checks.real_array("pressures", pressures, (None,)), checks.real_array("gaps", gaps, (None,))
        for name, nodes in (("pressures", p), ("gaps", g)):
            if len(nodes) == 0 or np.any(np.diff(nodes) <= 0):
                raise ValueError(f"{name} is {nodes}: give rising values")
        table = checks.real_array("h", h, (len(p), len(g)))
        if np.any(table < 0):
            raise ValueError(f"h holds {table.min():g}: give values >= 0")
        head = [len(p), len(g), checks.positive("area", area)]
        Conductance.__init__(self, np.concatenate([head, p, g, table.T.ravel()]))

    def __repr__(self):
        return f"Given({int(self.values[0])} pressures, {int(self.values[1])} gaps, area={self.values[2]:g})"


def _classes():
    out = {}
    for row, described in enumerate(_core.conductances()):
        found = _class_of(row, described)
        if described["name"] == "given_table":
            found = type("Given", (_Given,), {"row": row, "reads": found.reads, "__doc__": _Given.__doc__})
        out[described["python_name"]] = found
    return out


CONDUCTANCES = _classes()


READABLE = ("conductivity", "modulus", "hardness", "radius", "area", "intact")


def plug(library, name, params=(), reads=()):
    """A conductance from a user's shared library, a routine as `cairn_conductance` in cairn/core.h (Fortran: bind(c)).

    library: path. name: of its symbol. params: (p,) its parameters. reads: properties of materials and contacts that it needs,
    words of "conductivity", "modulus", "hardness", "radius", "area", "intact"; only these are checked to be given. Raises
    ValueError when library or symbol are missing, or reads holds another word.
    """
    import ctypes

    for word in reads:
        if word not in READABLE:
            raise ValueError(f"reads names {word!r}: give words of {listed(READABLE, word)}")
    path = os.path.abspath(os.fspath(library))
    if not os.path.exists(path):
        raise ValueError(f"{path}: there is no such file; build the library first")
    try:
        loaded = ctypes.CDLL(path)
        routine = getattr(loaded, name)
    except (OSError, AttributeError) as error:
        raise ValueError(f"{path}: {error}; give a shared library that exports {name} (Fortran: bind(c))") from None
    out = Conductance(np.asarray(params, float).ravel())
    out.reads, out.library, out.parameter_names = tuple(reads), loaded, tuple(f"p{k}" for k in range(len(out.values)))
    out.address = ctypes.cast(routine, ctypes.c_void_p).value
    return out


@dataclass(frozen=True)
class OxideFilm:
    """An oxide film in series with the spots of a new contact, until it breaks down; it forms again when the contact opens.

    conductance [S]. power: electrical power of breakdown [W]; volume_power [1/s]: adds 3/4 volume_power R F to that power, with
    effective radius R and force F. sliding: speed above which it is rubbed away [m/s].
    """

    conductance: float
    power: float = np.inf
    volume_power: float = 0.0
    sliding: float = np.inf

    def __post_init__(self):
        for name in ("conductance", "power", "volume_power", "sliding"):
            value = checks.number(name, getattr(self, name), finite=False)
            if value < 0:
                raise ValueError(f"{name} of a film is {value}: give a value >= 0")
            object.__setattr__(self, name, value)

    def numbers(self):
        return [self.conductance, self.power, 0.75 * self.volume_power, self.sliding]
