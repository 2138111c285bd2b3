"""Joints added and removed between the steps of a run."""

from __future__ import annotations

import numpy as np

from ..base.materials import Material
from ..model import bodies as sets
from ..model.joints import ROWS, Cable, JointKind, joined
from ..model.rules import rule
from .changes import account
from .present_joints import joints_present
from .views import core_of


class _Present:
    """Stand-in for the scene in `joined`: each body of the joint in a set of its own, in its current position."""

    def __init__(self, sim, numbers):
        self.dim, self.rules = sim.scene.dim, list(sim._rules)
        self.sets, self.world = [_as_it_stands(sim, number) for number in numbers], []

    def add(self, s):
        self.world.append(s)

    def interact(self, a, b, law):
        self.rules.append(rule(a, b, law))


def _as_it_stands(sim, number):
    """A set of a single body in its current position, with a round contactor of its size."""
    scene, dim = core_of(sim).scene, sim.scene.dim
    present = scene.body("id")
    row = int(np.searchsorted(present, number))
    if row == len(present) or present[row] != number:
        told = "a node of a mesh, which is joined by Scene.join, before the run" if number in scene.node("id") else "not there"
        raise ValueError(f"body {number} of a joint is {told}: give the number of a rigid body")
    names = {f["name"] for f in scene.body_fields() if f["active"]}
    rotation = np.atleast_1d(scene.body("rotation")[row]) if "rotation" in names else None
    if rotation is not None:
        rotation = rotation.reshape(1) if dim == 2 else rotation[None]
    radius = np.ravel(scene.contactor("radius"))[np.ravel(scene.contactor("body")) == number]
    mark = sets.ContactorSet("disk" if dim == 2 else "sphere", Material("body"), np.zeros(1, int), np.array([radius.max()]))
    position = scene.body("position")[row] + np.asarray(sim.scene.origin, float)[:dim]
    ones = np.ones((1, 1 if dim == 2 else 3))
    driven = _driven(scene, names, row, dim)
    return sets.BodySet(dim, position[None], np.ones(1), ones, [mark] if radius.size else [], rotation=rotation, driven=driven,
                        ids=np.array([number], np.int64))  # fmt: skip


def _driven(scene, names, row, dim):
    mask = int(np.ravel(scene.body("driven"))[row]) if "driven" in names else 0
    return tuple(name for k, name in enumerate(sets.DOFS[dim]) if mask >> k & 1)


def join(sim, a, b, kind):
    """See Simulation.join."""
    if not isinstance(kind, JointKind):
        raise ValueError(f"joint is {kind!r}: give cairn.Hinge(...) or another of {', '.join(sorted(ROWS))}")
    numbers = [a, *([kind.pulley] if isinstance(kind, Cable) else []), b]
    for number in numbers:
        if number is not None and (isinstance(number, bool) or not isinstance(number, (int, np.integer))):
            raise ValueError(f"{number!r} of a joint is no number of a body: give one that Scene.add or Simulation.add returned")
    if a is None:
        raise ValueError("a of a joint is None: give a body, and b=None for the world")
    if ROWS[type(kind).__name__]["turns"]:
        sim.follow_rotations()
    present = _Present(sim, dict.fromkeys(int(number) for number in numbers if number is not None))
    name = joined(present, a, b, kind)
    species = dict(sim._species)
    species.setdefault((name, name), len(species))
    sim._use_laws(species, present.rules)
    scene = core_of(sim).scene
    for s in present.sets:
        for c in s.contactors:
            if c.joint:
                number = np.array([species[name, name]], np.int32)
                scene.add_contactors(c.shape, s.own_ids, number, c.radius, c.offset, c.direction, None)
    sim.add(*present.world)  # added last, so that the first body of the joint is the first of its contact
    return name


def unjoin(sim, name):
    """See Simulation.unjoin."""
    there = joints_present(sim)
    if name not in there:
        raise ValueError(f"there is no joint {name!r}: there {'is ' if len(there) == 1 else 'are '}{', '.join(there) or 'none'}")
    stored = core_of(sim).stored_between(sim._species[name, name])
    sim.interact(name, name, None)
    account(sim, 0.0, -stored)
