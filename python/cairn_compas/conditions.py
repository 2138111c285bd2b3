"""Boundary conditions of a problem, for each block: loads over time about its centre of mass, and displacements."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

HOLD = 0.98  # share of the duration at which ramps end and loads at once begin to be released, as in compas_dem's other back-ends


@dataclass
class Conditions:
    """Conditions of one block.

    Parameters
    ----------
    ramp, at_once : ndarray (6,)
        Force and moment about the centre of mass [N, N m], of ramped loads and of those applied at once.
    points : list of tuple
        (point (3,) [m], force (3,) [N], whether ramped) of each load at a point.
    faces : list of tuple
        (number of the face, traction (3,) [Pa], whether ramped) of each surface load.
    moment : ndarray (2, 3)
        Sum of given moments [N m], ramped and at once.
    acceleration : ndarray (2, 3)
        Sum of body forces over the mass [m/s2], ramped and at once.
    translation, rotation : list of 3
        Displacement [m] and rotation [rad] over the duration; None where the dof is free.
    """

    ramp: np.ndarray = field(default_factory=lambda: np.zeros(6))
    at_once: np.ndarray = field(default_factory=lambda: np.zeros(6))
    points: list = field(default_factory=list)
    faces: list = field(default_factory=list)
    moment: np.ndarray = field(default_factory=lambda: np.zeros((2, 3)))
    acceleration: np.ndarray = field(default_factory=lambda: np.zeros((2, 3)))
    translation: list = field(default_factory=lambda: [None] * 3)
    rotation: list = field(default_factory=lambda: [None] * 3)

    @property
    def loaded(self):
        """True if a load acts on the block."""
        return bool(np.any(self.ramp) or np.any(self.at_once))

    @property
    def ramped(self):
        """True if a load on the block grows over time."""
        return bool(np.any(self.ramp))

    @property
    def moved(self):
        """True if a displacement or rotation is prescribed, also one of 0."""
        return any(x is not None for x in (*self.translation, *self.rotation))

    def add(self, force, moment, ramped):
        """Adds a force and a moment about the centre of mass.

        Parameters
        ----------
        force, moment : array_like (3,)
            [N], [N m].
        ramped : bool
            Whether the load grows over time.
        """
        (self.ramp if ramped else self.at_once)[:] += np.r_[force, moment]


def history(t, duration):
    """Factors of loads at a time.

    Ramps grow from 0 to 1 over 0.98 of the duration and stay; loads at once are 1 for so long and fall to 0 at its end.

    Parameters
    ----------
    t : float
        Time [s].
    duration : float
        Duration of the analysis [s].

    Returns
    -------
    tuple of float
        Factor of ramped loads, and of loads at once.
    """
    s = t / duration
    return min(max(s / HOLD, 0.0), 1.0), min(max((1.0 - s) / (1.0 - HOLD), 0.0), 1.0)


def conditions_of(problem, blocks):
    """Gives the conditions of each block.

    Parameters
    ----------
    problem : compas_dem.problem.Problem
        The problem; all its boundary conditions act together.
    blocks : dict
        {node of the graph: Block of `cairn_compas.scene`}.

    Returns
    -------
    dict
        {node of the graph: Conditions}.

    Raises
    ------
    ValueError
        If a condition names a block or a face that is not there, or its numbers are not finite.
    """
    found = {node: Conditions() for node in blocks}

    def at(entry, what):
        if entry.block_index not in found:
            raise ValueError(f"{what} names block_index={entry.block_index!r}: the model has {_listed(found)}")
        return found[entry.block_index], blocks[entry.block_index]

    for group in problem.boundary_conditions:
        for entry in group.body_forces:
            a, ramped = _vector("a body force", entry.acceleration), _ramped(entry)
            for node, block in blocks.items():
                found[node].acceleration[0 if ramped else 1] += a
                found[node].add(block.mass * a, np.zeros(3), ramped)
        for entry in group.point_loads:
            _point_load(*at(entry, "a point load"), entry)
        for entry in group.surface_loads:
            _surface_load(*at(entry, "a surface load"), entry)
        for entry in group.displacements:
            mine, _ = at(entry, "a displacement")
            for name in ("translation", "rotation"):
                for k, value in enumerate(getattr(entry, name, None) or ()):
                    if value is not None:
                        if not np.isfinite(value):
                            raise ValueError(f"{name} of block {entry.block_index} is {value}: give finite numbers, or None")
                        getattr(mine, name)[k] = float(value)
    return found


def _listed(found):
    nodes = sorted(found)
    return f"blocks {nodes[0]} to {nodes[-1]}" if nodes == list(range(nodes[0], nodes[-1] + 1)) else f"blocks {nodes}"


def _vector(what, given):
    out = np.asarray(list(given), float)
    if out.shape != (3,) or not np.all(np.isfinite(out)):
        raise ValueError(f"{what} is {given!r}: give three finite numbers")
    return out


def _ramped(entry):
    if entry.loading_type not in ("ramp", "instantaneous"):
        raise ValueError(f"loading_type is {entry.loading_type!r}: give 'ramp' or 'instantaneous'")
    return entry.loading_type == "ramp"


def _point_load(mine, block, entry):
    """Adds a force at a point, at the centre of mass without one, and a moment."""
    force, ramped = _vector("a point load", entry.force or (0.0, 0.0, 0.0)), _ramped(entry)
    point = block.center if entry.point is None else _vector("the point of a load", entry.point)
    moment = np.zeros(3) if entry.moment is None else _vector("a moment", entry.moment)
    mine.points.append((point, force, ramped))
    mine.moment[0 if ramped else 1] += moment
    mine.add(force, np.cross(point - block.center, force) + moment, ramped)


def _surface_load(mine, block, entry):
    """Adds a traction on a face; face_index is that of the block's mesh."""
    mesh, face = block.mesh, entry.face_index
    if face not in set(mesh.faces()):
        raise ValueError(f"a surface load names face {face!r} of block {entry.block_index}: it has {sorted(mesh.faces())}")
    load, ramped = _vector("a surface load", entry.load), _ramped(entry)
    corners = np.array(mesh.face_coordinates(face), float)
    area, middle = _area_and_middle(corners)
    mine.faces.append((face, load, ramped))
    mine.add(area * load, np.cross(middle - block.center, area * load), ramped)


def _area_and_middle(corners):
    """Area [m2] and centre of area (3,) [m] of a face."""
    local = corners - corners[0]
    parts = 0.5 * np.cross(local[1:-1], local[2:])
    normal = parts.sum(axis=0)
    area = float(np.linalg.norm(normal))
    share = parts @ normal / area**2
    return area, corners[0] + share @ (local[1:-1] + local[2:]) / 3
