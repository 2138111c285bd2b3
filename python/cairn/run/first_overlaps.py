"""Checks before the first step of bodies: initial overlaps, and walls whose normals point away from all bodies."""

import warnings

import numpy as np

from .. import _core
from ..base.geometry import turn
from ..model.extents import Placed
from .sinking import overlaps_of
from .step_warnings import OverlapWarning
from .views import core_of

REMEDY = "or shrink the radii, or set overlap='ignore'"
TAKEN_BACK = {  # by the exchange of ranks, None without them: what removes overlap in a run
    None: " (NSCD(overlap=...) takes back what is beyond it, slowly, and project_positions removes all)",
    "colour": " (NSCD(overlap=...) takes back what is beyond it, slowly)",
    "sweep": "",
}
CHUNK = 64  # bodies compared with all facets of a surface at a time


def _first_gaps(simulation):
    core = core_of(simulation)
    if not simulation.strategy.stages:
        return core.contact("gap"), core.contact("bodies")
    core.begin_step(simulation._dt)
    try:
        core.compute_free_velocity()
        core.detect_contacts()
        return core.contact("gap"), core.contact("bodies")
    finally:
        core.undo_step()


def check(simulation, action, share, exchange=None):
    """Checks overlaps of the initial configuration, relative to the smaller radius. Warns or raises ValueError, naming the worst
    pairs, above `share`; returns the deepest [-]. exchange: of ranks, None without them."""
    turned = look_at_walls(simulation, action)
    gap, pairs = _first_gaps(simulation)
    listed, deepest = _listed(simulation, gap, pairs, share, ~np.isin(pairs, list(turned)).any(axis=1))
    if listed:
        text = f"{listed}: move them apart, {REMEDY}{TAKEN_BACK[exchange]}"
        if action == "error":
            raise ValueError(text)
        warnings.warn(text, OverlapWarning, stacklevel=4)
    return deepest


def look_at_added(simulation, ids, share):
    """Warns of bodies, added since the last step, that overlap others in this one by more than `share`. Returns the deepest
    overlap of theirs [-]."""
    core = core_of(simulation)
    gap, pairs = core.contact("gap"), core.contact("bodies")
    theirs = np.isin(pairs, ids).any(axis=1)
    listed, deepest = _listed(simulation, gap[theirs], pairs[theirs], share)
    if listed:
        exchange = None if simulation.ranks is None else simulation.ranks.exchange
        remedy = f"add them where there is room, {REMEDY}{TAKEN_BACK[exchange]}"
        text = f"of the bodies added before step {simulation.steps}, {listed}: {remedy}"
        warnings.warn(text, OverlapWarning, stacklevel=5)
    return deepest


def _listed(simulation, gap, pairs, share, counts=None):
    """(text on the pairs that overlap by more than `share` of the smaller radius, "" without any; the deepest overlap of all).
    counts (n,): mask of the pairs that the text may name."""
    deep = np.flatnonzero(gap < 0)
    if not len(deep):
        return "", 0.0
    relative = overlaps_of(simulation, gap[deep], pairs[deep])
    beyond = relative > share
    if counts is not None:
        beyond &= counts[deep]
    found, first = np.unique(np.sort(pairs[deep[beyond]], axis=1), axis=0, return_inverse=True)
    most = np.zeros(len(found))  # deepest overlap of each pair
    np.maximum.at(most, first.ravel(), relative[beyond])
    pair = "bodies {} and {} by {:.3g} of a radius"
    worst = "; ".join(pair.format(*found[k], most[k]) for k in np.argsort(-most, kind="stable")[:3])
    text = f"{len(found)} pairs overlap by more than {share:g} of the smaller radius, the worst are {worst}" if worst else ""
    return text, float(np.max(relative))


def look_at_walls(simulation, action="warn", above=5):
    """Warns once for each wall and surface that has all bodies behind it, or raises ValueError. Returns the ids found so far.
    above: stack level of the warning."""
    core, told = core_of(simulation), simulation._turned
    p = Placed(core.scene)
    normals = Normals(p)
    for body in np.unique(p.owner[p.of_kind(*WALLS)]):
        own = int(p.ids[body])
        if own not in told and normals.look_away(body, core.scene, simulation._table):
            told.add(own)
            if np.any(p.of_kind("facet") & (p.owner == body)):
                text = f"all bodies lie behind surface {own}: turn its triangles round, their normals point out of the solid"
            else:
                along = ", ".join(f"{x:.3g}" for x in normals.of(body)[0][0] + 0.0)
                text = (
                    f"all bodies lie behind wall {own}: turn its normal ({along}), which points out of the solid to where is room"
                )
            if action == "error":
                raise ValueError(text)
            warnings.warn(text, OverlapWarning, stacklevel=above)
    return told


WALLS = "half_plane", "plane", "facet"


class Normals:
    """Normals and points of planes and facets of bodies, in space."""

    def __init__(self, placed):
        self.p, core = placed, placed.core
        dim = placed.dim
        self.walls = np.flatnonzero(placed.of_kind(*WALLS))  # others have none, and may be many
        rotation, owners = core.body("rotation"), np.unique(placed.owner[self.walls])
        turned = len(rotation) == len(placed.ids)
        self.rotation = dict(zip(owners.tolist(), rotation[owners])) if turned else None
        del rotation  # as large as the scene, as the arrays that follow
        offset, direction = (core.contactor(name) for name in ("offset", "direction"))
        at, m = placed.kept[self.walls], len(self.walls)
        self.offset = np.reshape(offset, (-1, dim))[at] if len(offset) else np.zeros((m, dim))
        self.direction = np.reshape(direction, (-1, dim + 1))[at, :dim] if len(direction) else np.zeros((m, dim))
        self.position = core.body("position")
        mass, driven = core.body("mass").ravel(), core.body("driven").ravel()
        held = driven == 2 ** (3 * dim - 3) - 1 if len(driven) else np.zeros(len(mass), bool)
        self.free = np.isfinite(mass) & ~held

    def of(self, body):
        """Normals (k, dim) and points (k, dim) [m] of the planes and facets of a body."""
        p, dim = self.p, self.p.dim
        own = np.flatnonzero(p.owner[self.walls] == body)
        mine, normal, point = self.walls[own], self.direction[own], self.offset[own]
        facets = np.flatnonzero(p.of_kind("facet")[mine])
        if len(facets):
            first = p.hulls["first_face"][p.hull[mine[facets]]]
            normal[facets] = np.reshape(p.hulls["normal"], (-1, dim))[first]
            point[facets] += normal[facets] * p.hulls["offset"][first, None]
        if self.rotation is not None:
            angle = self.rotation[int(body)]
            turned = np.broadcast_to(angle, (len(mine), *np.shape(angle)))
            normal, point = turn(turned, normal, dim), turn(turned, point, dim)
        return normal, self.position[body] + point

    def look_away(self, body, scene, table):
        """True if all bodies and nodes that could touch a body are behind its planes and facets."""
        p, dim = self.p, self.p.dim
        species = p.field("material")
        own = np.unique(species[p.owner == body])
        met = [s for s in np.unique(species) if any(table.meet(int(a), int(s)) for a in own)]
        other = np.unique(p.owner[p.of_kind(*_core.shapes("mover")) & np.isin(species, met)])
        other = other[(other != body) & (self.free[other] | self.free[body])]
        places, of_meshes = self.position[other], scene.contactor("material")[scene.contactor("body") < 0]
        if any(table.meet(int(a), int(s)) for a in own for s in np.unique(of_meshes)):
            places = np.concatenate([places, scene.node("position").reshape(-1, dim)])
        if not len(places):
            return False
        normal, point = self.of(body)
        level = np.sum(normal * point, axis=1)
        return all(np.all(places[k : k + CHUNK] @ normal.T < level) for k in range(0, len(places), CHUNK))
