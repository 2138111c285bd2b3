"""Materials: a name that laws refer to, and a density."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from . import checks


@dataclass(frozen=True)
class OfTemperature:
    """A property that depends on temperature: piecewise linear, constant beyond its ends.

    Parameters
    ----------
    temperatures : array_like (n,)
        Rising temperatures [K], two or more.
    values : array_like (n,)
        Value of the property at each temperature, in its unit.

    Raises
    ------
    ValueError
        If temperatures do not rise or values are of another number.

    Examples
    --------
    >>> cn.networks.OfTemperature((300.0, 600.0), (50.0, 40.0))(450.0)
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
        """Gives the content of a scene file for this curve.

        Returns
        -------
        dict
            Kind, temperatures [K] and values.
        """
        return {"kind": "of_temperature", "temperatures": np.array(self.temperatures), "values": np.array(self.values)}


@dataclass(frozen=True)
class Material:
    """The material of a body.

    Contact laws refer to it by its name. All properties but the density are used by networks of heat and current alone; see
    cairn.networks.

    Parameters
    ----------
    name : str
        Name, other than "*"; a scene has one material of a name.
    density : float, optional
        Mass per volume [kg/m3]; needed by bodies whose mass is not given.
    conductivity : float or OfTemperature, optional
        Thermal conductivity [W/(m K)].
    capacity : float or OfTemperature, optional
        Heat capacity [J/(kg K)].
    resistivity : float or OfTemperature, optional
        Electrical resistivity [ohm m].
    latent : tuple (3,), optional
        Heat [J/kg] absorbed between two temperatures [K]: heat, from, to.
    young : float, optional
        Young's modulus of the contact spots [Pa].
    poisson : float, optional
        Poisson's ratio of the contact spots [-], above -1 and up to 0.5.
    hardness : float, optional
        Hardness of the contact spots [Pa].
    expansion : float, optional
        Thermal expansion [1/K].

    Raises
    ------
    ValueError
        If a value is out of range; the message names it.

    Examples
    --------
    >>> cn.Material("rock", density=2800.0).name
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
        """Gives the properties for networks.

        Returns
        -------
        dict or None
            {field: value} of the given properties; None without any.
        """
        told = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in ("name", "density")}
        return {name: value for name, value in told.items() if value is not None} or None

    def with_(self, other):
        """Completes this material by the properties of another of the same name.

        Parameters
        ----------
        other : Material
            A material of the same name.

        Returns
        -------
        Material or None
            The completed material; None if both contradict each other.
        """
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
