"""Warnings for pairs of shapes without contact detection, which pass through each other."""

from __future__ import annotations

import warnings

import numpy as np

from .. import _core


class ShapesWarning(UserWarning):
    """Bodies of the scene have shapes without contact detection between them, or too thin to hold nodes."""


def warn(scene, told, above, meshes_are_free=False, meet=None):
    """Warns of pairs of shapes without contact detection, if two such bodies can move relative to each other (a dof is free) and
    no rule lets them pass. told: set of the warnings so far, extended here; above: stack level of the warning; meshes_are_free:
    True if a mesh can move as a whole; meet(a, b): True if a law exists between two species."""
    known, code, own = {frozenset(pair) for pair in _core.pairs()}, scene.contactor("shape"), scene.contactor("body")
    present = {_core.shapes()[k] for k in np.unique(code)}
    all_known = all(frozenset((a, b)) in known | told for a in present for b in present)
    if all_known and not meshes_are_free and "segment" not in present:
        return
    of = {name: k for k, name in enumerate(_core.shapes())}  # names of all contactors would take much memory
    if "thin" not in told and np.any((code == of["disk"]) & (own < 0)) and _has_thin_segments(scene, code == of["segment"], own):
        told.add("thin")
        text = "segments of radius 0 have no sides for nodes of meshes, which have no size: these pass through them"
        warnings.warn(f"{text}; give cairn.segment(..., radius=...), or a wall", ShapesWarning, stacklevel=above + 1)
    if meshes_are_free:
        _warn_of_sides_alone(code, own, known, told, above + 1)
    rigid = np.flatnonzero(own >= 0)
    code, own, species = code[rigid], own[rigid], scene.contactor("material")[rigid]
    free, found = _free(scene), sorted(_names(code))
    for k, a in enumerate(found):
        for b in found[k:]:
            pair = frozenset((a, b))
            if pair in known or pair in told:
                continue
            unmet = _unmet(code == of[a], code == of[b], own, species, free, meet)
            if unmet is None or _both_are_endless(a, b) and _something_between(unmet, own, code, free, known):
                continue
            told.add(pair)
            first, second = np.sort(scene.raw_body("id").ravel()[list(unmet)])
            text = f"there is no contact between shapes {a} and {b}: bodies such as {first} and {second} pass through each other"
            warnings.warn(text, ShapesWarning, stacklevel=above + 1)


def _names(code):
    """Names of the shapes among numbers of shapes."""
    return {_core.shapes()[k] for k in np.unique(code)}


def _has_thin_segments(scene, segments, own):
    """True if a segment of a rigid body has radius 0. segments: mask of the segments."""
    return bool(np.any(segments & (own >= 0) & (scene.contactor("radius") == 0)))


def _free(scene):
    """Mask (bodies,) of the bodies with a free dof, in internal order."""
    mass, inertia = scene.raw_body("mass").ravel(), scene.raw_body("inertia")
    inertia = np.reshape(inertia, (len(mass), 1 if scene.dim == 2 else 3))
    finite = np.concatenate([np.repeat(np.isfinite(mass)[:, None], scene.dim, axis=1), np.isfinite(inertia)], axis=1)
    driven = scene.raw_body("driven").ravel()
    if len(driven):
        finite &= (driven[:, None] >> np.arange(finite.shape[1], dtype=driven.dtype) & 1) == 0
    return np.any(finite, axis=1)


def _unmet(of_a, of_b, own, species, free, meet):
    """Internal numbers of two bodies with contactors of a and of b whose species can touch, a free body first; None without."""
    kinds = [{s: np.unique(own[of & (species == s)]) for s in np.unique(species[of])} for of in (of_a, of_b)]
    for i, first in kinds[0].items():
        for j, second in kinds[1].items():
            if meet is not None and not meet(int(i), int(j)):
                continue
            for mover, other in ((first, second), (second, first)):
                moving = mover[free[mover]]
                if len(moving):
                    others = other[other != moving[0]]
                    if len(others):
                        return moving[0], others[0]
                    if len(moving) > 1:  # the only other body is the first that moves
                        return moving[1], other[0]
    return None


def _both_are_endless(a, b):
    """True for two unbounded shapes (planes, tubes), which always intersect; bodies between them keep them apart."""
    return not {a, b} & set(_core.shapes("bounded"))


def _something_between(pair, own, code, free, known):
    """True if contact detection exists between a free body and both walls of a pair."""
    shapes = [_names(code[own == body]) for body in pair]
    apart = free[own] & ~np.isin(own, pair)
    return any(all(any(frozenset((name, s)) in known for s in of) for of in shapes) for name in _names(code[apart]))


def _warn_of_sides_alone(code, own, known, told, above):
    """Warns of meshes with contactors on sides and none on nodes, beside shapes that have contact with nodes alone."""
    of_meshes, rigid = _names(code[own < 0]), _names(code[own >= 0])
    sides, points = of_meshes & {"segment", "facet"}, of_meshes & {"disk", "sphere"}
    if points or "sides" in told:
        return
    if len(np.unique(own[own < 0])) > 1:
        rigid |= sides
    unmet = sorted({b for side in sides for b in rigid if frozenset((side, b)) not in known})
    if unmet:
        told.add("sides")
        text = f"sides of meshes have no contact with shapes {', '.join(unmet)}, which meet nodes of meshes alone"
        warnings.warn(f"{text}, and pass through each other: name nodes by contact=, too", ShapesWarning, stacklevel=above + 1)
