"""Materials: a name that laws refer to, and a density."""

from __future__ import annotations

from dataclasses import dataclass

from ..pre import checks


@dataclass(frozen=True)
class Material:
    """What a body is made of.

    name: what laws refer to. density: mass per volume [kg/m3]; only needed by bodies whose mass is not given.

    >>> Material("rock", density=2800.0).name
    'rock'
    """

    name: str
    density: float | None = None

    def __post_init__(self):
        if not isinstance(self.name, str) or not self.name or self.name == "*":
            raise ValueError(f"name of a material is {self.name!r}: give a non-empty string other than '*'")
        if self.density is not None:
            object.__setattr__(self, "density", checks.positive("density", self.density))
