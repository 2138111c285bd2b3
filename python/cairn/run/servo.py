"""Servo-controlled walls, which keep a given stress."""

from __future__ import annotations

import numpy as np

from ..pre import checks
from . import time_functions


class Servo:
    """Force of a wall that keeps a given normal stress, for `wall(..., force=Servo(...))`.

    stress: pressure [Pa] or a function of time giving it. normal: (dim,) of the wall, out of the solid: the force acts along it,
    on the bodies in front. area: loaded area [m2] (length times depth in 2D), a function(sim) that measures it each step, or
    None: the extent of the grains across the normal, or of the periodic cell, times the depth in 2D.

    >>> Servo(1e4, (0, -1), area=2.0)(0.0, None)
    array([    0., -20000.])
    """

    needs_simulation = True

    def __init__(self, stress, normal, area=None):
        self.stress = stress if callable(stress) else checks.number("stress", stress)
        normal = checks.real_array("normal", normal, (None,))
        if len(normal) not in (2, 3) or not np.any(normal):
            raise ValueError(f"normal is {normal}: give a vector (2,) or (3,) of non-zero length, out of the solid")
        self.normal = normal / np.linalg.norm(normal)
        self.area = area if area is None or callable(area) else checks.positive("area", area)

    def __call__(self, t, simulation):
        stress = self.stress(t) if callable(self.stress) else self.stress
        if self.area is None:
            area = self.extent(simulation)
        else:
            area = self.area(simulation) if callable(self.area) else self.area
        return stress * area * self.normal

    def extent(self, simulation):
        """Extent of the grains across the normal, times the depth in 2D [m2]."""
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
        """Content of a scene file. Raises ValueError if area is a Python function."""
        if callable(self.area):
            raise ValueError("area of a Servo is a Python function, which a file cannot hold: give a number or None")
        return {
            "kind": "servo",
            "stress": time_functions.to_dict("stress", self.stress),
            "normal": self.normal,
            "area": np.nan if self.area is None else self.area,
        }
