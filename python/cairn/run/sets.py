"""Sets of bodies that a simulation keeps: which of their bodies are there, and what a checkpoint says of later ones."""

import numpy as np

from . import time_functions


def later_to_dict(s):
    """What a checkpoint says of bodies that came in, or were driven, after the start."""
    out = {"ids": s.ids, "driven": ",".join(s.driven), "carrier": s.mass is None}
    if s.mesh is not None:
        out["mesh"] = s.mesh.name
    for name in ("drive", "force", "damping"):
        value = getattr(s, name)
        if value is not None:
            function = callable(value) and not hasattr(value, "to_dict")
            out[name] = {"kind": "python"} if function else time_functions.to_dict(name, value)
    return out


def ids_of(scene):
    """Ids of the bodies and the nodes of a scene, as its state holds them, rising, (n,)."""
    return np.sort(np.concatenate([scene[of]["id"].ravel() for of in ("bodies", "nodes") if of in scene]))


def found(ids, present):
    """Which ids are among the rising `present`, and where: 0 for those that are not."""
    rows = np.minimum(np.searchsorted(present, ids), max(len(present) - 1, 0))
    alive = present[rows] == ids if len(present) else np.zeros(len(ids), bool)
    return alive, np.where(alive, rows, 0)


def living(sets, seen, present):
    """The sets without those that came in after the first so many and have no body left among the rising `present`; of drives
    those, too, whose bodies later ones drive."""
    driven, kept = np.zeros(0, np.int64), []
    for s in reversed(sets[seen:]):
        ids = s.ids
        if s.mass is None:
            ids = np.setdiff1d(ids[found(ids, present)[0]], driven)
            driven = np.union1d(driven, ids)
        if s.mesh is not None or np.any(found(ids, present)[0]):
            kept.append(s)
    return [*sets[:seen], *reversed(kept)]
