"""Detection of growing overlap (drift): errors within the tolerance accumulate, since overlap is not pushed back."""

from __future__ import annotations

import numpy as np

from ..model.extents import Placed
from .sets import found
from .views import core_of

WINDOW = 16  # converged steps in a window; its smallest overlap counts, which excludes momentary overlaps of impacts
SINKS = 0.05  # least overlap for a warning, over the size of the smaller body
RISES = 3  # number of windows with a larger overlap than all windows before
MORE = 1.02  # ratio of overlaps above which one counts as larger
LEAPS = 0.1  # overlap within a step for a warning, beside the ways of bodies, over the size of the smaller body
SINKS_BY_EDGES = 0.01  # overlap for a warning of superquadrics, over the least half axis


class Sinking:
    """Smallest overlaps of the steps of a run in windows of WINDOW steps."""

    def __init__(self):
        self._count, self._least, self._levels, self._rises = 0, np.inf, [0.0], 0

    def look(self, overlap, first):
        """Adds the overlap of a converged step; overlap and first, the initial one, are relative to the size of the smaller body.

        Returns None as long as bodies do not sink. Once the overlap has grown over RISES windows and exceeds SINKS, returns
        (overlap before it grew, number of steps since then)."""
        self._count += 1
        self._least = min(self._least, overlap)
        if self._count % WINDOW:
            return None
        least, self._least = self._least, np.inf
        rises = least > MORE * max(self._levels)
        self._rises = self._rises + 1 if rises else max(self._rises - 1, 0)
        self._levels = [*self._levels[-RISES:], least]
        if self._rises < RISES or least <= max(SINKS, 2 * first):
            return None
        return self._levels[0], WINDOW * (len(self._levels) - 1)


class Leaps:
    """Detects overlap that grows within one step by more than bodies moved: a thin part was crossed, or bodies were displaced."""

    def __init__(self):
        self._before, self._last = 0.0, None

    def look(self, simulation, overlap, h):
        """Ids of two bodies whose overlap grew by more than their relative motion in a step of h [s]; None if there are none.
        overlap: the deepest, relative to the size of the smaller body."""
        core = core_of(simulation)
        before, last, now = self._before, self._last, (simulation.steps, core.body_count)
        self._before, self._last = overlap, now
        if last != (now[0] - 1, now[1]) or not overlap > before + LEAPS:
            return None
        pair = deepest_pair(simulation)
        if pair is None:
            return None
        there, rows = found(np.array(pair), core.scene.body("id"))
        if not np.all(there):
            return None
        placed, dim = Placed(core.scene), simulation.scene.dim
        size = np.maximum(simulation.radii(), placed.sizes(rows))[rows]
        offset, reach = placed.field("offset"), placed.field("radius")
        reach = reach + np.linalg.norm(np.reshape(offset, (len(reach), dim)), axis=1) if len(offset) else reach
        velocity = np.abs(core.scene.body("velocity")[rows])
        if simulation.ranks is None:  # ranks keep that of the begin for themselves
            velocity = np.maximum(velocity, np.abs(core.scene.body("velocity_begin")[rows]))
        ways = [
            np.linalg.norm(v[:dim]) + np.linalg.norm(v[dim:]) * np.max(reach[placed.owner == row], initial=0.0)
            for v, row in zip(velocity, rows)
        ]
        way = 2 * h * sum(ways) / np.min(size[size > 0], initial=np.inf)
        return pair if overlap > before + LEAPS + way else None


class RoundEdges:
    """Superquadrics with flat faces, which sink where they roll over their edges: there contacts hold at detection, to the first
    order of the step."""

    def __init__(self):
        self._of, self._bodies = None, frozenset()

    def look(self, simulation, overlap):
        """Id of such a body with the largest overlap of the step, above SINKS_BY_EDGES; None without one. overlap: over the size
        of the smaller body."""
        if not overlap > SINKS_BY_EDGES:
            return None
        core = core_of(simulation)
        key = (core.body_count, core.order_version)
        if self._of != key:
            self._of, self._bodies = key, self._found(Placed(core.scene))
        if not self._bodies:
            return None
        pair = deepest_pair(simulation)
        return next((i for i in pair or () if i in self._bodies), None)

    @staticmethod
    def _found(placed):
        of = np.flatnonzero(placed.shape == "superquadric")
        flat = [k for k in of if np.min(placed.planes(placed.hull[k])[1][3:5]) < 1]
        return frozenset(int(i) for i in placed.ids[placed.owner[flat]])


def deepest_pair(simulation):
    """Ids of the bodies with the largest overlap in the last step, over the size of the smaller body; None without overlap."""
    return deepest(simulation)[0]


def deepest(simulation):
    """(deepest_pair, its overlap over the size of the smaller body)."""
    core = core_of(simulation)
    gap, pairs = core.contact("gap"), core.contact("bodies")
    deep = np.flatnonzero(gap < 0)
    if not len(deep):
        return None, 0.0
    relative = overlaps_of(simulation, gap[deep], pairs[deep])
    worst = int(np.argmax(relative))
    return tuple(int(i) for i in pairs[deep[worst]]), float(relative[worst])


def overlaps_of(simulation, gap, pairs):
    """Overlaps (n,) of contacts over the size of the smaller body: its radius, or half of its least width. gap (n,) [m]; pairs
    (n, 2) ids; nodes of meshes have no size."""
    scene = core_of(simulation).scene
    there, rows = found(pairs, scene.body("id"))
    radius = np.maximum(simulation.radii(), Placed(scene).sizes(np.unique(rows[there])))
    radius = np.append(np.where(radius > 0, radius, np.inf), np.inf)[np.where(there, rows, len(radius))]
    return -gap / np.min(radius, axis=1)
