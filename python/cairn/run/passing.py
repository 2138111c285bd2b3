"""Detection of tunnelling: bodies that pass through each other on their path to the configuration of contact detection."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .. import _core
from ..base.geometry import turn
from ..model.extents import Placed
from .views import core_of

MOST = 16  # number of the fastest bodies looked at in a step, and of contactors near the path of each
BEYOND = 0.25  # share of the mover's size by which it is on its way out again at detection
FINE = 8192  # largest number of samples of a path
WITHIN = 0.9  # share of the mover's size below which a sample lies within a body; above it the two touch
FEW = 1000  # number of bodies up to which speeds are read in every step, for strategies that do not report displacements
SHEETS = ("segment", "facet")  # shapes that may have no size
SELDOM = 32  # steps between two readings of more bodies


class Passage(NamedTuple):
    """Ids of the mover and of the body it passed through; speed [m/s] and size [m] of the mover; ways: its path over its size."""

    body: int
    other: int
    speed: float
    size: float
    ways: float


class Flights:
    """Search for passages; shapes are cached until bodies are added or removed."""

    def __init__(self):
        self._of, self._placed, self._thin = None, None, [0]

    def look(self, simulation, info, h):
        """First Passage found in a step of h [s], or None; only bodies that moved by more than their size are checked."""
        core = core_of(simulation)
        if "events" in info or info.get("sub_steps", 1) > 1:  # event-driven, or the report covers the last part alone
            return None
        flight = info["time_detection"] - (info["time"] - info["dt"]) if simulation.strategy.stages else h
        if not flight > 0 or not self._may_pass(simulation, info, flight, h):
            return None
        key = (core.body_count, core.order_version)
        if self._of != key or self._placed is None:
            self._of, self._placed = key, _Shapes(simulation, core)
            self._thin = self._placed.thin
        found = self._passage(simulation, core, flight, h)
        if simulation.ranks is not None and core.body_count > FEW:
            self._placed = None  # as large as the scene, which ranks share
        return found

    def _passage(self, simulation, core, flight, h):
        shapes, dim = self._placed, simulation.scene.dim
        if simulation.strategy.stages:
            start, velocity = core.body("position_begin"), core.body("velocity_begin")[:, :dim]
        else:
            velocity = core.scene.body("velocity")[:, :dim]
            start = core.scene.body("position") - h * velocity
        speed = np.linalg.norm(velocity, axis=1)
        ways = np.divide(flight * speed, shapes.thickness, out=np.zeros(len(speed)), where=shapes.thickness > 0)
        for i in np.argsort(-ways)[:MOST]:
            if not ways[i] > 1:
                return None
            pair = shapes.passed(i, start, flight * velocity, simulation._table)
            if pair is not None:
                ids = core.scene.body("id")
                first, second = pair
                apart = float(np.linalg.norm(velocity[first] - velocity[second]))
                size = float(shapes.size[first])
                return Passage(int(ids[first]), int(ids[second]), apart, size, flight * apart / size)
        return None

    def _may_pass(self, simulation, info, flight, h):
        """Cheap bound: False if no body moves by more than its size during `flight` [s], and none without a size moves."""
        if info.get("way", 0.0) > 0:
            return info["way"] * flight > h or self._thin_may_pass(simulation, flight)
        if not len(simulation.bodies):
            return False
        few = len(simulation.bodies) <= FEW
        return few or simulation.steps % SELDOM == 0

    def _thin_may_pass(self, simulation, flight):
        """True if a body without a size moves by more than the size of the smallest body; one that turns on the spot does not."""
        core = core_of(simulation)
        known = self._of == (core.body_count, core.order_version)
        sets = [s for s in simulation._sets if s.mesh is None]
        if not known and not any(c.shape in SHEETS for s in sets for c in s.contactors):
            return False  # ranks would gather all velocities for it
        thin = self._thin if known else [0]
        if not len(thin):
            return False
        ways = flight * np.linalg.norm(core.scene.body("velocity")[thin][:, : simulation.scene.dim], axis=1)
        return bool(np.any(ways > (self._placed.thickness[thin] if known and self._placed is not None else 0)))


class _Shapes:
    """Contactors of rigid bodies, with the distance of a point from each."""

    def __init__(self, simulation, core):
        self.core, self.placed = core, Placed(core.scene)
        p = self.placed
        self.dim, m = p.dim, len(p.owner)
        self.size = np.maximum(simulation.radii(), p.sizes(np.arange(len(p.ids))))
        self._of_thin_ones(p)
        self.radius, self.material = p.field("radius"), p.field("material")
        offset, direction = p.field("offset"), p.field("direction")
        self.offset = np.reshape(offset, (m, self.dim)) if len(offset) else np.zeros((m, self.dim))
        self.direction = np.reshape(direction, (m, self.dim + 1)) if len(direction) else np.zeros((m, self.dim + 1))
        self.bound = self.radius + np.where(p.shape == "segment", np.abs(self.direction[:, -1]), 0.0)
        hulls = np.flatnonzero(p.hull >= 0)
        self.bound[hulls] = p.hulls["radius"][p.hull[hulls]] if len(hulls) else 0.0
        known = {frozenset(pair) for pair in _core.pairs()}
        seen = set(_core.shapes("bounded")) - {"ring"}  # shapes with a far side
        self.seen = np.isin(p.shape, list(seen))
        names = sorted(set(p.shape))
        self.meets = {a: np.isin(p.shape, [b for b in names if frozenset((a, b)) in known]) for a in names}
        self.own = {}

    def _of_thin_ones(self, p):
        """Sizes of bars, half their widths; `thickness` (bodies,) [m], that of a surface or a line is the size of the smallest
        body; `thin`: rows of these."""
        bars = np.flatnonzero(p.shape == "segment")
        np.maximum.at(self.size, p.owner[bars], p.field("radius")[bars] if len(bars) else [])
        sheets = np.unique(p.owner[np.isin(p.shape, SHEETS)])
        self.thin = sheets[self.size[sheets] == 0]
        self.thickness = self.size.copy()
        self.thickness[self.thin] = np.min(self.size[self.size > 0], initial=np.inf)

    def passed(self, i, start, way, table):
        """Rows of two bodies, one of them i, of which the first passed through the second. start, way (bodies, dim) [m] of all
        bodies; None without such bodies."""
        p = self.placed
        rotation = self.core.body("rotation_begin") if len(p.core.body("rotation")) == len(p.ids) else np.zeros(0)
        own = np.flatnonzero(p.owner == i)
        if not len(own):
            return None
        centre = start[p.owner] + (turn(rotation[p.owner], self.offset, self.dim) if len(rotation) else self.offset)
        other = self._through(i, own, start, way, centre, rotation, table) if self.size[i] > 0 else None
        if other is not None:
            return i, other
        for j in self._beside(i, own, start, way, centre):  # small bodies, on their way through a part of a large one
            theirs = np.flatnonzero(p.owner == j)
            if len(theirs) and self._through(j, theirs, start, way, centre, rotation, table, among=own) is not None:
                return j, i
        return None

    def _beside(self, i, own, start, way, centre):
        """Rows of the bodies (at most MOST, the nearest first) near whose path body i comes by more than their size."""
        reach = np.max(np.linalg.norm(centre[own] - start[i], axis=1) + self.bound[own])
        nearest, distance, square = _nearest(start[i] - start, way[i] - way)
        near = (self.size > 0) & (square > self.size**2) & (distance < reach + self.size)
        near[i] = False
        found = np.flatnonzero(near)
        return found[np.argsort(distance[found])][:MOST]

    def _through(self, i, own, start, way, centre, rotation, table, among=None):
        """Row of the body, of the contactors `among` or of all, that body i of contactors `own` passed through; or None."""
        p, size = self.placed, self.size[i]
        apart, w = start[i] - centre, way[i] - way[p.owner]
        nearest, distance, square = _nearest(apart, w)
        near = self.seen & self.meets[p.shape[own[0]]] & (p.owner != i) & (square > size**2) & (distance < self.bound + size)
        found = np.flatnonzero(near) if among is None else among[near[among]]
        for k in found[np.argsort(distance[found])][:MOST]:
            if not table.meet(int(self.material[own[0]]), int(self.material[k])):
                continue
            reach = 2 * (self.bound[k] + size) / np.sqrt(square[k])
            count = int(np.clip(16 * (self.bound[k] + size) / size, 65, FINE))
            t = np.clip(nearest[k] + np.linspace(-reach, reach, count), 0, 1)
            x = apart[k] + np.concatenate([[0.0], t, [1.0]])[:, None] * w[k]
            if len(rotation):
                x = _into_body(rotation[p.owner[k]], x, self.dim)
            depth = self._depth(k, x)
            deepest = np.min(depth)
            if deepest < WITHIN * size <= depth[0] and depth[-1] > min(WITHIN * size, deepest + BEYOND * size):
                return int(p.owner[k])
        return None

    def _depth(self, k, x):
        """Distance (n,) [m] of points (n, dim) in the axes of contactor k from its surface, negative inside, or a lower bound."""
        p = self.placed
        shape, hull = p.shape[k], p.hull[k]
        if shape == "segment":
            along = np.clip(x @ self.direction[k, :2], -self.direction[k, 2], self.direction[k, 2])
            return np.linalg.norm(x - along[:, None] * self.direction[k, :2], axis=1) - self.radius[k]
        if hull < 0:
            return np.linalg.norm(x, axis=1) - self.radius[k]
        normal, offset = p.planes(hull)
        if shape in ("capsule", "cylinder"):
            half, along = np.linalg.norm(p.vertices(hull), axis=1).max(), x @ normal[0]
            across, beyond = np.linalg.norm(x - along[:, None] * normal[0], axis=1), np.abs(along) - half
            if shape == "cylinder":
                return np.maximum(across - offset[0], beyond)
            return np.hypot(across, np.maximum(beyond, 0)) - offset[0]
        if shape == "superquadric":
            return (np.linalg.norm(x / offset[:3], axis=1) - 1) * offset[:3].min()
        depth = np.max(x @ normal.T - offset, axis=1)
        if shape == "facet":
            a, b, c = p.vertices(hull)[:3]
            inner = [np.cross(normal[0], q - r) @ (x - r).T for q, r in ((b, a), (c, b), (a, c))]
            depth = np.where(np.min(inner, axis=0) >= 0, np.abs(x @ normal[0] - offset[0]), np.inf)
        return depth


def _nearest(apart, way):
    """Paths apart + t way, t from 0 to 1, (n, dim): t nearest to 0 (n,), distance there (n,) [m], square of way (n,) [m2]."""
    square = np.sum(way * way, axis=1)
    t = np.clip(np.divide(-np.sum(apart * way, axis=1), square, out=np.zeros(len(way)), where=square > 0), 0, 1)
    return t, np.linalg.norm(apart + t[:, None] * way, axis=1), square


def _into_body(rotation, x, dim):
    """Vectors (n, dim) from space into the axes of a body."""
    back = -rotation if dim == 2 else rotation * np.array([1.0, -1.0, -1.0, -1.0])
    return turn(np.broadcast_to(back, (len(x), *np.shape(back))), x, dim)
