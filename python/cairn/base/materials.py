"""Materials: a name that laws refer to, and a density."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from . import checks


@dataclass(frozen=True)
class OfTemperature:
    """A property that depends on temperature: piecewise linear, constant beyond its ends.

    temperatures: (n,) rising [K]. values: (n,).

    >>> OfTemperature((300.0, 600.0), (50.0, 40.0))(450.0)
    45.0
    """

    temperatures: tuple
    values: tuple

    def __post_init__(self):
        temperatures = checks.real_array("temperatures", self.temperatures, (None,))
        values = checks.real_array("values", self.values, (None,))
        if len(temperatures) < 2 or len(values) != len(temperatures) or np.any(np.diff(temperatures) <= 0):
            raise ValueError(f"temperatures {self.temperatures} and values {self.values}: give two rising temperatures or more, "
                             "and a value for each")  # fmt: skip
        object.__setattr__(self, "temperatures", tuple(map(float, temperatures)))
        object.__setattr__(self, "values", tuple(map(float, values)))

    def __call__(self, temperature):
        return float(np.interp(temperature, self.temperatures, self.values))

    def to_dict(self):
        """Content of a scene file for this curve."""
        return {"kind": "of_temperature", "temperatures": np.array(self.temperatures), "values": np.array(self.values)}


@dataclass(frozen=True)
class Material:
    """The material of a body.

    name: referred to by contact laws. density: mass per volume [kg/m3]; only needed by bodies whose mass is not given.
    The others are used by networks of heat and current alone, see cairn.networks. conductivity [W/(m K)], capacity [J/(kg K)],
    resistivity [ohm m]: each a number or an OfTemperature; latent: (heat [J/kg], from, to [K]) absorbed between two temperatures;
    young [Pa], poisson and hardness [Pa]: of the contact spots; expansion: thermal [1/K].

    >>> Material("rock", density=2800.0).name
    'rock'
    """

    name: str
    density: float | None = None
    conductivity: float | OfTemperature | None = None
    capacity: float | OfTemperature | None = None
    resistivity: float | OfTemperature | None = None
    latent: tuple | None = None
    young: float | None = None
    poisson: float | None = None
    hardness: float | None = None
    expansion: float | None = None

    def __post_init__(self):
        if not isinstance(self.name, str) or not self.name or self.name == "*":
            raise ValueError(f"name of a material is {self.name!r}: give a non-empty string other than '*'")
        for name in ("density", "young", "hardness"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, checks.positive(name, getattr(self, name)))
        for name in ("conductivity", "capacity", "resistivity"):
            object.__setattr__(self, name, _property(name, getattr(self, name)))
        for name in ("poisson", "expansion"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, checks.number(name, getattr(self, name)))
        if self.poisson is not None and not -1 < self.poisson <= 0.5:
            raise ValueError(f"poisson is {self.poisson}: give a value above -1, up to 0.5")
        if self.latent is not None:
            heat, begin, end = checks.real_array("latent", self.latent, (3,))
            if not (heat >= 0 and end > begin):
                raise ValueError(f"latent is {self.latent}: give the heat [J/kg], and two rising temperatures [K]")
            object.__setattr__(self, "latent", (float(heat), float(begin), float(end)))

    def beside_density(self):
        """{field: value} of the given properties for networks; None without any."""
        told = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in ("name", "density")}
        return {name: value for name, value in told.items() if value is not None} or None

    def with_(self, other):
        """This material completed by the properties of another of the same name; None if they contradict each other."""
        told = {}
        for field in fields(self):
            mine, theirs = getattr(self, field.name), getattr(other, field.name)
            if mine is None:
                told[field.name] = theirs
            elif theirs is not None and theirs != mine:
                return None
        return replace(self, **told)


def _property(name, value):
    if value is None:
        return None
    if isinstance(value, OfTemperature):
        if min(value.values) < 0:
            raise ValueError(f"{name} has the value {min(value.values)}: give values >= 0")
        return value
    value = checks.number(name, value, finite=False)
    if value < 0:
        raise ValueError(f"{name} is {value}: give a value >= 0")
    return value
