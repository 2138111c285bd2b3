"""Overlaps that a scene begins with: told before the first step."""

import warnings

import numpy as np

from ..build.extents import Placed
from .sets import found
from .step_warnings import OverlapWarning
from .views import core_of


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


def check(simulation, action, share):
    """Deepest overlaps of the first configuration against the smaller radius; warns or raises with the worst pairs, else
    returns the deepest."""
    core = core_of(simulation)
    gap, pairs = _first_gaps(simulation)
    deep = np.flatnonzero(gap < 0)
    if not len(deep):
        return 0.0
    there, rows = found(pairs[deep], core.scene.body("id"))
    radius = np.maximum(simulation.radii(), Placed(core.scene).sizes(np.unique(rows[there])))
    radius = np.append(np.where(radius > 0, radius, np.inf), np.inf)[np.where(there, rows, len(radius))]  # nodes have no size
    size = np.min(radius, axis=1)
    relative = -gap[deep] / size
    bad = np.flatnonzero(relative > share)
    if not len(bad):
        return float(np.max(relative))
    worst = bad[np.argsort(-relative[bad])][:3]
    pair = "bodies {} and {} by {:.3g} of a radius"
    listed = "; ".join(pair.format(*pairs[deep[k]], relative[k]) for k in worst)
    text = (
        f"{len(bad)} pairs overlap by more than {share:g} of the smaller radius, the worst are {listed}: move them apart, "
        "or shrink the radii, or set overlap='ignore' (contacts take back what is beyond NSCD(overlap=...), slowly, and "
        "project_positions removes all)"
    )
    if action == "error":
        raise ValueError(text)
    warnings.warn(text, OverlapWarning, stacklevel=4)
    return float(np.max(relative))
