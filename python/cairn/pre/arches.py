"""Arches of voussoirs: semicircular, segmental, pointed; radial or vertical joints; in 2D or with a depth.

An arch springs from the level z = 0 (y in 2D) or from inclined skewbacks, is symmetric about x = 0, and stands between
two supports. Faces between joints are plane: intrados and extrados are polygons inscribed in their circles.
"""

from __future__ import annotations

import numpy as np

from ..base import checks
from .blocks import Blocks


def ring(radius, thickness, voussoirs, half_angle=np.pi / 2, joints="radial"):
    """Corners of the joints of a circular ring, left to right: intrados and extrados, each (voussoirs + 1, 2) [m].

    radius: of the middle line [m]; half_angle: from the crown to a springing joint [rad]; joints: "radial" or "vertical"
    (both corners of a joint above each other).
    """
    radius, thickness = checks.positive("radius", radius), checks.positive("thickness", thickness)
    n = checks.count("voussoirs", voussoirs, 1)
    half_angle = checks.positive("half_angle", half_angle)
    if thickness >= 2 * radius:
        raise ValueError(f"thickness is {thickness}, not below twice the radius {radius}: the intrados would vanish")
    if half_angle > np.pi / 2 + 1e-12:
        raise ValueError(f"half_angle is {half_angle}: give at most pi/2")
    inner, outer = radius - thickness / 2, radius + thickness / 2
    # corners mirror each other to the bit
    angle = symmetric(half_angle, n)
    sine, cosine = np.sin(angle), np.cos(angle)
    cosine[np.abs(cosine) < 1e-15] = 0.0
    intrados = inner * np.column_stack((sine, cosine))
    if joints == "radial":
        return intrados, outer * np.column_stack((sine, cosine))
    if joints != "vertical":
        raise ValueError(f'joints is {joints!r}: give "radial" or "vertical"')
    x = intrados[:, 0]
    return intrados, np.column_stack((x, np.sqrt(outer * outer - x * x)))


def symmetric(half, n):
    """n + 1 equally spaced numbers from -half to half, exact mirrors of each other."""
    right = half * (2 * np.arange(n + 1) - n) / n
    return np.where(np.arange(n + 1) * 2 < n, -right[::-1], right)


def arch(
    kind="semicircular",
    *,
    radius=None,
    span=None,
    rise=None,
    thickness,
    voussoirs,
    joints="radial",
    depth=None,
    supports=True,
) -> Blocks:
    """An arch between two supports.

    kind: "semicircular", "segmental" (span and rise of the middle line) or "pointed" (two arcs of the given radius, which
    is above span / 2, meet at the crown, where a vertical joint stands). radius, span, rise of the middle line [m]; joints:
    "radial" or "vertical", the beds of the first and last voussoir being radial still; depth: along y [m], None for polygons
    in 2D. Parts: "voussoir", numbered from the left, then "support".
    """
    outlines, beds = profile(kind, radius, span, rise, thickness, voussoirs, joints)
    depth = None if depth is None else checks.positive("depth", depth)
    blocks = Blocks(2 if depth is None else 3)
    for outline in outlines:
        put(blocks, outline, depth, "voussoir")
    if supports:
        for inner, outer in beds:
            put(blocks, skewback(inner, outer, thickness), depth, "support")
    return blocks


def profile(kind, radius, span, rise, thickness, voussoirs, joints="radial"):
    """Outlines of the voussoirs of an arch, from the left, and its two beds, each (inner, outer corner); see `arch`."""
    thickness = checks.positive("thickness", thickness)
    if kind == "semicircular":
        if (radius is None) == (span is None):
            raise ValueError("a semicircular arch needs radius or span, one of them")
        radius, low, half = (radius if span is None else checks.positive("span", span) / 2), 0.0, np.pi / 2
        sides = ring(radius, thickness, voussoirs, joints=joints)
    elif kind == "segmental":
        span, rise = checks.positive("span", span), checks.positive("rise", rise)
        if rise > span / 2:
            raise ValueError(f"rise is {rise}, above half the span {span}: give at most {span / 2}")
        radius = (span * span / 4 + rise * rise) / (2 * rise)
        low, half = radius - rise, np.arctan2(span / 2, radius - rise)
        sides = [side - (0, low) for side in ring(radius, thickness, voussoirs, half, joints)]
    elif kind == "pointed":
        sides = pointed(radius, span, thickness, voussoirs, joints)
        low, half = 0.0, np.pi / 2
    else:
        raise ValueError(f'kind is {kind!r}: give "semicircular", "segmental" or "pointed"')
    intrados, extrados = sides
    outlines = [np.array([a, b, d, c]) for a, b, c, d in zip(intrados[:-1], intrados[1:], extrados[:-1], extrados[1:])]
    outer = extrados[[0, -1]]
    if joints == "vertical":  # springers stand on a radial bed: between upright joints alone an arch would fall as one
        across = span / 2 + thickness / 2 if kind == "pointed" else (radius + thickness / 2) * np.sin(half)
        height = (radius + thickness / 2) * np.cos(half) - low if half < np.pi / 2 else 0.0
        outer = np.array([(-across, height), (across, height)])
        if len(outlines) == 1:
            outlines = [np.concatenate([outlines[0][:2], outer[1:], outlines[0][2:], outer[:1]])]
        else:
            outlines[0] = np.concatenate([outlines[0], outer[:1]])
            outlines[-1] = np.concatenate([outlines[-1][:2], outer[1:], outlines[-1][2:]])
    return outlines, list(zip(intrados[[0, -1]], outer))


def pointed(radius, span, thickness, voussoirs, joints):
    """Two arcs of a radius above span / 2; an even number of voussoirs; the crown's joint is vertical."""
    span, radius = checks.positive("span", span), checks.positive("radius", radius)
    n = checks.count("voussoirs", voussoirs, 2)
    if radius <= span / 2:
        raise ValueError(f"radius is {radius}: a pointed arch has one above half its span {span}")
    if n % 2:
        raise ValueError(f"voussoirs is {n}: a pointed arch has an even number")
    inner, outer, shift = radius - thickness / 2, radius + thickness / 2, radius - span / 2
    sides = []
    for r in (inner, outer):  # the left arc has its centre at x = +shift
        crown = np.arccos(shift / r)
        if joints == "vertical":
            angle = np.arccos(shift / inner) * np.arange(n // 2 + 1) / (n // 2)
            x = shift - inner * np.cos(angle)
            height = np.sqrt(np.maximum(r * r - (shift - x) ** 2, 0.0))
            sides.append(np.column_stack((x, height)))
        else:
            angle = crown * np.arange(n // 2 + 1) / (n // 2)
            sides.append(np.column_stack((shift - r * np.cos(angle), r * np.sin(angle))))
        sides[-1][-1, 0] = 0.0
    return tuple(np.concatenate([side, side[-2::-1] * (-1, 1)]) for side in sides)


def put(blocks: Blocks, outline, depth, part, low=None):
    """An outline as a polygon, or as a prism along y, centred unless `low` is given."""
    if depth is None:
        blocks.add(outline, part=part)
    else:
        low = -depth / 2 if low is None else low
        blocks.add_prism(outline, low, low + depth, part)


def skewback(inner, outer, thickness):
    """A support behind a springing joint, whose face is longer than the joint so that sliding voussoirs stay on it."""
    along = (outer - inner) / np.linalg.norm(outer - inner)
    away = np.array([along[1], -along[0]])
    away = away if away[1] < 0 or (away[1] == 0 and away[0] * inner[0] > 0) else -away
    a, b = inner - along * thickness / 2, outer + along * thickness / 2
    return np.array([a, b, b + away * thickness, a + away * thickness])
