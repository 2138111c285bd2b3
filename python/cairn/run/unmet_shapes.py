"""Shapes of a scene that pass through each other: what a simulation warns of, once a pair."""

from __future__ import annotations

import warnings

import numpy as np

from .. import _core


class ShapesWarning(UserWarning):
    """Bodies of the scene have shapes between which there is no contact, or nothing that could hold."""


def warn(scene, told, above):
    """Warns of shapes of which one at least is of a body that moves and is no wall. told: what was warned of, and is from now on;
    above: how many callers the one who is told is above this one."""
    known = {frozenset(pair) for pair in _core.pairs()}
    names, own = np.array(_core.shapes())[scene.contactor("shape")], scene.contactor("body")
    thin = (names == "segment") & (own >= 0) & (scene.contactor("radius") == 0)
    if np.any(thin) and np.any((names == "disk") & (own < 0)) and "thin" not in told:
        told.add("thin")
        text = "segments of radius 0 have no sides for nodes of meshes, which have no size: these pass through them"
        warnings.warn(f"{text}; give cairn.segment(..., radius=...), or a wall", ShapesWarning, stacklevel=above + 1)
    moves = np.append(np.isfinite(scene.raw_body("mass")).ravel(), True)[np.maximum(own, -1)]
    for a in set(_core.shapes("mover")) & set(names[moves]):
        for b in set(names) - {a}:
            pair = frozenset((a, b))
            if pair in known or pair in told:
                continue
            told.add(pair)
            first, second = sorted(pair)
            text = f"there is no contact between shapes {first} and {second}: these bodies pass through each other"
            warnings.warn(text, ShapesWarning, stacklevel=above + 1)
