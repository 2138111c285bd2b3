"""Shapes of a scene that pass through each other: what a simulation warns of, once a pair."""

from __future__ import annotations

import warnings

import numpy as np

from .. import _core


class ShapesWarning(UserWarning):
    """Bodies of the scene have shapes between which there is no contact, or nothing that could hold."""


def warn(scene, told, above, meshes_are_free=False):
    """Warns of shapes of which one at least is of a body that moves and is no wall. told: what was warned of, and is from now on;
    above: how many callers the one who is told is above this one; meshes_are_free: some mesh moves as a whole."""
    known = {frozenset(pair) for pair in _core.pairs()}
    names, own = np.array(_core.shapes())[scene.contactor("shape")], scene.contactor("body")
    thin = (names == "segment") & (own >= 0) & (scene.contactor("radius") == 0)
    if np.any(thin) and np.any((names == "disk") & (own < 0)) and "thin" not in told:
        told.add("thin")
        text = "segments of radius 0 have no sides for nodes of meshes, which have no size: these pass through them"
        warnings.warn(f"{text}; give cairn.segment(..., radius=...), or a wall", ShapesWarning, stacklevel=above + 1)
    if meshes_are_free:
        _warn_of_sides_alone(names, own, known, told, above + 1)
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


def _warn_of_sides_alone(names, own, known, told, above):
    """Warns of meshes whose sides touch and none of whose nodes do, beside what has contacts with nodes alone."""
    of_meshes, rigid = set(names[own < 0]), set(names[own >= 0])
    sides, points = of_meshes & {"segment", "facet"}, of_meshes & {"disk", "sphere"}
    if points or "sides" in told:
        return
    unmet = sorted({b for side in sides for b in rigid if frozenset((side, b)) not in known})
    if unmet:
        told.add("sides")
        text = f"sides of meshes have no contact with shapes {', '.join(unmet)}, which meet nodes of meshes alone"
        warnings.warn(f"{text}, and pass through each other: name nodes by contact=, too", ShapesWarning, stacklevel=above + 1)
