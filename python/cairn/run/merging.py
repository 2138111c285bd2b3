"""Grains merged to a single body in a run, which inherits mass, momentum, angular momentum, the lowest id, contacts and impulses.
The kinetic energy of their relative motion, and the energy stored in contacts between them, go to "dissipated_reshaping"."""

from __future__ import annotations

import itertools

import numpy as np

from .. import _core
from ..model import bodies as sets
from ..model.bodies import replace
from .carried_forces import damping_of, force_of
from .changes import account
from .reshape import PassedContacts, _set_of
from .views import core_of

ROUND = ("disk", "sphere")


def merge(sim, ids):
    """See Simulation.merge."""
    ids = np.unique(ids)
    if len(ids) < 2:
        raise ValueError(f"ids are {ids.tolist()}: give two bodies or more to merge")
    dim, found = sim.scene.dim, [_set_of(sim, int(i)) for i in ids]
    poses = [_core.motion_of(core_of(sim).scene, int(i)) for i in ids]
    first = found[0][0]
    for i, (s, row) in zip(ids, found):
        _check(i, s, row, first)
    mass = np.array([p["mass"] for p in poses])
    x, v = (np.array([p[name] for p in poses]) for name in ("position", "velocity"))
    kinetic = sum(p["kinetic"] for p in poses)
    x, v = _one_image(core_of(sim).scene.get_cell(), x, v)
    total, centre, mean = mass.sum(), mass @ x / mass.sum(), mass @ v / mass.sum()
    arm = x - centre
    crossed = _cross(arm, mass[:, None] * (v - mean))
    spin = np.array([p["spin"] for p in poses]).reshape(len(ids), -1).sum(axis=0) + crossed.sum(axis=0)
    inertia = [np.atleast_1d(s.inertia[row]) * (p["mass"] / s.mass[row]) for (s, row), p in zip(found, poses)]
    if dim == 2:
        moments, axes = np.array([sum(j[0] for j in inertia) + mass @ (arm**2).sum(axis=1)]), np.eye(2)
        turning = spin / moments
    else:
        tensor = sum(p["rotation"] @ np.diag(j) @ p["rotation"].T for p, j in zip(poses, inertia))
        tensor = tensor + (mass @ (arm**2).sum(axis=1)) * np.eye(3) - (arm * mass[:, None]).T @ arm
        moments, axes = np.linalg.eigh((tensor + tensor.T) / 2)
        axes[:, 0] *= np.sign(np.linalg.det(axes))
        turning = axes @ ((axes.T @ spin) / moments)
    contactors, low, high = [], np.full(dim, np.inf), np.full(dim, -np.inf)
    for (s, row), p, at in zip(found, poses, arm):
        for c in s.contactors:
            mine = np.flatnonzero(c.body == row)
            own = np.zeros((len(mine), dim)) if c.offset is None else c.offset[mine]
            if len(mine):
                place, radius = at + own @ p["rotation"].T, c.radius[mine][:, None]
                low, high = np.minimum(low, (place - radius).min(axis=0)), np.maximum(high, (place + radius).max(axis=0))
                offset = place @ axes
                contactors.append(sets.ContactorSet(c.shape, c.material, np.zeros(len(mine), int), c.radius[mine], offset))
    _check_width(core_of(sim).scene.get_cell(), high - low, np.maximum(np.abs(centre + low), np.abs(centre + high)))
    one = sets.BodySet(dim, centre[None], np.array([total]), moments[None], contactors, group=first.group)
    one = replace(one, velocity=np.concatenate([mean, turning])[None], rotation=_core.stored_rotation(dim, axes))
    lost = kinetic - 0.5 * (total * mean @ mean + turning @ spin)
    stored = _stored_between(sim, ids)
    contacts = PassedContacts(sim, ids)
    sim.remove(ids)
    new = sim.add(sets.checked(one))
    core_of(sim).scene.give_id(int(new[0]), int(ids[0]))
    sim._sets[-1] = replace(sim._sets[-1], ids=ids[:1].astype(np.int64))
    sim._start_functions()
    account(sim, -lost, -stored)
    contacts.pass_to(ids[:1])
    return int(ids[0])


def _check_width(cell, width, reach):
    """Raises ValueError, before the grains are removed, for a body wider than the periodic cell. reach (dim,): largest absolute
    coordinates [m]."""
    for k in np.flatnonzero(cell["periodic"][: len(width)]):
        if width[k] - cell["vectors"][k, k] > 16 * np.finfo(float).eps * reach[k]:
            wide = f"the grains to merge are {width[k]:g} m wide along {'xyz'[k]} and the periodic cell is "
            raise ValueError(
                f"{wide}{cell['vectors'][k, k]:g} m, so that the merged body would overlap its own image: give fewer grains"
            )


def _one_image(cell, x, v):
    """Positions and velocities (n, dim) of neighbouring images of the grains in a periodic cell, along a minimum spanning tree
    from the first grain, so that a chain longer than half the cell stays connected. Images move with the cell."""
    dim, n = x.shape[1], len(x)
    along = np.flatnonzero(cell["periodic"][:dim])
    if not len(along):
        return x, v
    vectors, gradient = cell["vectors"][:, :dim], cell["velocity_gradient"][:dim, :dim]
    around = np.zeros((3 ** len(along), 3))
    around[:, along] = np.array(list(itertools.product((0, -1, 1), repeat=len(along))))  # no shift first: taken in a tie
    shift, away, to = np.zeros_like(x), np.full(n, np.inf), np.zeros_like(x)
    left, at = np.ones(n, bool), 0
    for _ in range(n - 1):
        left[at] = False
        rest = np.flatnonzero(left)
        apart, turns = x[rest] - x[at] - shift[at], np.zeros((len(rest), 3))
        for k in along[::-1]:  # a vector leans along those before it
            turns[:, k] = -np.rint((apart + turns @ vectors)[:, k] / vectors[k, k])
        tried = (turns[:, None] + around) @ vectors
        distance = np.linalg.norm(apart[:, None] + tried, axis=2)
        best = distance.argmin(axis=1)
        distance, tried = (a[np.arange(len(rest)), best] for a in (distance, tried))
        nearer = distance < away[rest]
        away[rest[nearer]], to[rest[nearer]] = distance[nearer], tried[nearer]
        at = rest[away[rest].argmin()]
        shift[at] = to[at]
    return x + shift, v + shift @ gradient.T


def _cross(x, y):
    """Cross products of rows: (n, 3), or (n, 1) in 2D."""
    return np.cross(x, y) if x.shape[1] == 3 else (x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0])[:, None]


def _check(i, s, row, first):
    """Raises ValueError for a body that cannot be merged."""
    for c in s.contactors:
        if not np.any(c.body == row):
            continue
        if c.joint:
            raise ValueError(f"body {i} is an end of a joint, which another body would not have: merge bodies without joints")
        if c.shape not in ROUND:
            raise ValueError(f"body {i} is a {c.shape}: only disks, spheres and clumps of them merge, leave it out")
    if s.group != first.group:
        raise ValueError(f"bodies to merge are of groups {first.group!r} and {s.group!r}: give bodies of one group")
    if force_of(s, row) is not None or damping_of(s, row) or s.surface_velocity is not None:
        raise ValueError(f"body {i} has a force, damping or surface velocity of its own, which others have not: leave them out")


def _stored_between(sim, ids):
    """Energy stored in contacts between these bodies [J]."""
    core = core_of(sim)
    if not core.contact_count or not getattr(sim.strategy, "energy", True):
        return 0.0
    inside = np.isin(core.contact("bodies"), ids).all(axis=1)
    return float(np.ravel(core.contact("stored"))[inside].sum())
