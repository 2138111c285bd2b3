"""Geometry of one output of a run: round bodies, surfaces, walls and forces, as plain arrays for any renderer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ... import _core
from ...base.geometry import contactors_of
from ..drawing import CATEGORIES, CLASSES, chain_lines, field_values, step_size, value_limits
from ..shape_meshes import meshes_of

_NOT_SHOWN = ("id", "position", "spin")


@dataclass
class Frame:
    """Arrays of one output; lengths in metres, in 2D z is 0.

    center (n, 3), radius (n,), row (n,): round contactors and the rows of their bodies; points (m, 3), triangles (k, 3),
    rows (k,): surfaces of all others; walls (w, 2, 3): ends of lines; forces (c, 2, 3): ends of the lines of loaded contacts, and
    force (c,): their normal forces [N].
    """

    center: np.ndarray
    radius: np.ndarray
    row: np.ndarray
    points: np.ndarray
    triangles: np.ndarray
    rows: np.ndarray
    walls: np.ndarray
    forces: np.ndarray
    force: np.ndarray


def frame_of(step):
    """The Frame of an output."""
    contactors = contactors_of(step)
    round_ones = contactors.select(*_core.shapes("ball"))
    mesh = meshes_of(step)
    if mesh is None:
        mesh = np.zeros((0, 3)), np.zeros((0, 3), np.int64), np.zeros(0, np.int64)
    lines, force = _loaded(step)
    walls = _segments(contactors) if step.dim == 2 else np.zeros((0, 2, 3))
    return Frame(_in_space(round_ones.center), round_ones.radius, round_ones.body, *mesh, walls, lines, force)


def fields_of(run):
    """Names of the fields of bodies that can colour a picture, the speed first."""
    names = [name for name in run[-1].drawn.names if name not in _NOT_SHOWN]
    return sorted(names, key=lambda name: (name != "velocity", names.index(name)))


def limits_of(run, what, samples=5):
    """Smallest and largest value that the colours of a field show, over a few outputs; of categories the number of colours."""
    if is_category(what):
        return -0.5, len(CLASSES) - 0.5
    few = {round(k) for k in np.linspace(0, len(run) - 1, min(samples, len(run)))}
    values = [field_values(run[k], what)[0] for k in few]
    values = np.concatenate([np.asarray(v, float).ravel() for v in values])
    return value_limits(values, None if what == "rotation" else what, run[-1])


def is_category(what):
    """True if a field numbers classes, which get distinct colours."""
    return what in CATEGORIES


def _in_space(points):
    """Points (n, 2 or 3) with z = 0 where there is none."""
    space = np.zeros((*points.shape[:-1], 3))
    space[..., : points.shape[-1]] = points
    return space


def _segments(contactors):
    """Ends of the straight walls of a scene in 2D."""
    walls = contactors.select("segment")
    reach = walls.direction * walls.half[:, None]
    return _in_space(np.stack([walls.center - reach, walls.center + reach], axis=1))


def _loaded(step):
    """Lines (c, 2, 3) of the contacts that carry an impulse, and their normal forces (c,) [N]."""
    if not len(step.contacts) or "impulse" not in step.contacts:
        return np.zeros((0, 2, 3)), np.zeros(0)
    force = np.sum(step.contacts["impulse"] * step.contacts["normal"], axis=1) / step_size(step)
    loaded = force != 0
    return _in_space(chain_lines(step)[loaded]), force[loaded]
