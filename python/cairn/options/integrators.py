"""Time integrators of rigid bodies and meshes, one class for each row of the core's list of integrators."""

from __future__ import annotations

from .. import _core
from ..base import checks
from ..names import by_name, one_of, parameters_section


class Integrator:
    """Base of one-step methods for NSCD(integrator=...): a row of the core's list and its parameters.

    Parameters
    ----------
    **given : float
        Parameters by name; those that are not given have the default of the list.

    Raises
    ------
    ValueError
        If a parameter is unknown or out of its range.
    """

    row = ""  # its name in the core
    parameters = ()  # (name, default, smallest, largest) of each

    def __init__(self, **given):
        self.values = {name: default for name, default, _, _ in self.parameters}
        for name, value in given.items():
            one_of(f"parameter of {type(self).__name__}", name, tuple(self.values))
            _, default, low, high = next(p for p in self.parameters if p[0] == name)
            value = checks.number(name, value)
            if not low <= value <= high:
                raise ValueError(f"{name} is {value}: give a value in [{low:g}, {high:g}]")
            if all(float(x).is_integer() for x in (default, low, high)) and not value.is_integer():
                raise ValueError(f"{name} is {value}: give a whole number from {low:g} to {high:g}")
            self.values[name] = value

    def __eq__(self, other):
        return isinstance(other, Integrator) and (self.row, self.values) == (other.row, other.values)

    def __hash__(self):
        return hash((self.row, tuple(self.values.items())))

    def __repr__(self):
        return f"{type(self).__name__}({', '.join(f'{name}={value:g}' for name, value in self.values.items())})"

    def settings(self):
        """Gives the settings for the core.

        Returns
        -------
        dict
            The row under `integrator`, and the parameters by name.
        """
        return {"integrator": self.row, **self.values}

    @property
    def end_share(self):
        """Weight of the end of the step in forces that change with time; the rest is that of its start."""
        return self.scheme(1.0)["end_share"]

    def scheme(self, dt):
        """Gives the coefficients of a step as a linear map.

        Parameters
        ----------
        dt : float
            Step [s].

        Returns
        -------
        dict
            Coefficients by the names of core_f90/integrators/linear_scheme.f90.
        """
        return _core.integrator_scheme(self.row, list(self.values.values()), checks.positive("dt", dt))


def _class_of(row, python_name, meaning, parameters):
    rows = [(name, f"float, default {default:g}", f"from {low:g} to {high:g}") for name, default, low, high in parameters]
    lines = [f"{meaning[0].upper()}{meaning[1:]}.", *parameters_section(rows)]
    body = {"__doc__": "\n".join(lines), "__module__": __name__, "row": row, "parameters": tuple(parameters)}
    body["__signature__"] = by_name(parameters)
    return type(python_name, (Integrator,), {**body, "__qualname__": python_name})


INTEGRATORS = {row[1]: _class_of(*row) for row in _core.integrators()}
globals().update(INTEGRATORS)
