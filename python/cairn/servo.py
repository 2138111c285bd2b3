"""Walls that hold a wanted stress."""

from __future__ import annotations

import numpy as np

from .pre import checks


class Servo:
    """Force of a wall that carries a wanted normal stress, for `wall(..., force=Servo(...))`.

    stress: pressure [Pa] or a function of time giving it. normal: (dim,) of the wall, out of the solid: the force acts along it,
    on the bodies in front. area: loaded area [m2] (length times depth in 2D), or a function(sim) that measures it each step.

    >>> Servo(1e4, (0, -1), area=2.0)(0.0, None)
    array([    0., -20000.])
    """

    needs_simulation = True

    def __init__(self, stress, normal, area):
        self.stress = stress if callable(stress) else checks.number("stress", stress)
        normal = checks.real_array("normal", np.asarray(normal, float), (None,))
        self.normal = normal / np.linalg.norm(normal)
        self.area = area if callable(area) else checks.positive("area", area)

    def __call__(self, t, simulation):
        stress = self.stress(t) if callable(self.stress) else self.stress
        area = self.area(simulation) if callable(self.area) else self.area
        return stress * area * self.normal
