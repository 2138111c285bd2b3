"""Vaults and domes: barrel, groin, cross; hemispherical domes with or without an eye.

A groin vault is two barrels of one profile whose webs meet in the diagonal planes; a cross vault is the same with pointed
arches. Blocks are cut by those planes, so that the webs meet flush.
"""

from __future__ import annotations

import numpy as np

from ..base import checks
from . import mass_properties
from .arches import profile, skewback, symmetric
from .blocks import Blocks, cut

SPLINTER = 0.1  # of a whole block's volume: smaller pieces are no blocks of their own

def barrel_vault(length, courses, *, bonded=True, supports=True, **arch) -> Blocks:
    """A barrel vault along y, `courses` blocks long, every other voussoir's joints shifted by half a block when bonded.

    arch: options of cairn.pre.masonry.arch (kind, radius or span, thickness, voussoirs, ...). Parts: "voussoir", "support".
    """
    length, courses = checks.positive("length", length), checks.count("courses", courses, 1)
    outlines, beds = arch_profile(arch)
    cuts = symmetric(length / 2, courses)
    shifted = np.concatenate([cuts[:1], (cuts[1:] + cuts[:-1]) / 2, cuts[-1:]])
    blocks = Blocks(3)
    for k, outline in enumerate(outlines):
        rows = shifted if bonded and k % 2 and courses > 1 else cuts
        for low, high in zip(rows[:-1], rows[1:]):
            blocks.add_prism(outline, low, high, "voussoir")
    if supports:
        for inner, outer in beds:
            blocks.add_prism(skewback(inner, outer, arch["thickness"]), cuts[0], cuts[-1], "support")
    return blocks


def arch_profile(options):
    given = {"kind": "semicircular", "radius": None, "span": None, "rise": None, "joints": "radial"} | options
    unknown = set(given) - {"kind", "radius", "span", "rise", "joints", "thickness", "voussoirs"}
    if unknown or not {"thickness", "voussoirs"} <= set(given):
        raise ValueError(f"a vault needs thickness and voussoirs of its arch; it knows no {', '.join(sorted(unknown)) or 'less'}")
    return profile(**given)


def groin_vault(courses=4, *, supports=True, **arch) -> Blocks:
    """A groin vault over a square bay: two barrels along x and y, each kept where it is the higher, |x| < |y| for the
    barrel along y. courses: blocks along half a barrel; splinters left by the diagonal are merged with the next block.
    Parts: "web", "support" under the four corners."""
    courses = checks.count("courses", courses, 1)
    outlines, beds = arch_profile(arch)
    reach = float(max(np.max(o[:, 0]) for o in outlines))
    cuts = reach * np.arange(courses + 1) / courses
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    web = Blocks(3)
    for outline in outlines:
        low = cuts[0]
        for high in cuts[1:]:
            left, share = behind_diagonals(outline, low, high)
            least = 0.0 if high == cuts[-1] else SPLINTER * cuts[1] / (high - low)
            if share > least:
                corners, faces = left
                web.add(corners, faces, "web")
            if left is None or share > least:
                low = high
    blocks, one = Blocks(3), web
    for _ in range(4):
        blocks = blocks + one
        one = one.moved(rotation=turn)
    if supports:
        inner, deep = float(min(abs(b[0][0]) for b in beds)), arch["thickness"]
        level = float(beds[0][0][1])
        for sx in (-1, 1):
            for sy in (-1, 1):
                x, y = sorted((sx * (inner - deep), sx * reach)), sorted((sy * (inner - deep), sy * reach))
                blocks.add_box((x[0], y[0], level - deep), (x[1], y[1], level), "support")
    return blocks


def behind_diagonals(outline, low, high):
    """Part within |x| < y of the prism over an outline from low to high along y, None if empty; its share of the volume."""
    whole = Blocks(3)
    whole.add_prism(outline, low, high)
    left = whole.vertices[0], whole.faces[0]
    for normal in ((1.0, -1.0, 0.0), (-1.0, -1.0, 0.0)):
        left = cut(*left, (0.0, 0.0, 0.0), normal) if left is not None else None
    if left is None:
        return None, 0.0
    if np.min(np.ptp(left[0], axis=0)) <= 1e-9 * (high - low):  # rounding's, of which no volume can be said
        return left, 0.0
    volume = mass_properties.polyhedra([left[0]], [left[1]]).measure[0]
    return left, float(volume / whole.properties().measure[0])


def cross_vault(span, radius, thickness, voussoirs, courses=4, *, supports=True) -> Blocks:
    """A groin vault of pointed arches: options of a pointed arch and of groin_vault."""
    return groin_vault(
        courses, supports=supports, kind="pointed", span=span, radius=radius, thickness=thickness, voussoirs=voussoirs
    )


def dome(radius, thickness, rings, sectors, *, eye=0.0, supports=True) -> Blocks:
    """A hemispherical dome: `rings` of `sectors` blocks each, joints on cones and meridians; a keystone, or an eye.

    radius: of the middle surface [m]; eye: angle from the crown of the open eye [rad], 0 for a keystone. Parts: "block",
    "keystone", "support".
    """
    radius, thickness = checks.positive("radius", radius), checks.positive("thickness", thickness)
    rings, sectors = checks.count("rings", rings, 1), checks.count("sectors", sectors, 3)
    eye = checks.number("eye", eye)
    if not 0 <= eye < np.pi / 2 or thickness >= 2 * radius:
        raise ValueError(f"eye is {eye} and thickness {thickness}: give an angle below pi/2, a thickness below 2 radius")
    top = eye if eye else np.pi / 2 / (rings + 1)
    polar = np.pi / 2 + (top - np.pi / 2) * np.arange(rings + 1) / rings
    around = 2 * np.pi * np.arange(sectors) / sectors
    flat = np.column_stack((np.cos(around), np.sin(around)))
    shells = []
    for r in (radius - thickness / 2, radius + thickness / 2):
        sine, cosine = np.sin(polar), np.cos(polar)
        cosine[0] = 0.0
        ground = r * sine[:, None, None] * flat
        shells.append(np.concatenate([ground, np.broadcast_to(r * cosine[:, None, None], (*ground.shape[:2], 1))], axis=2))
    inner, outer = shells
    blocks = Blocks(3)
    for k in range(rings):
        for m in range(sectors):
            n = (m + 1) % sectors
            corners = [s[i, j] for i in (k, k + 1) for j in (m, n) for s in (inner, outer)]
            blocks.add(corners, part="block")
    if not eye:
        loop = list(range(sectors))
        faces = [loop[::-1], [q + sectors for q in loop]]
        faces += [[q, (q + 1) % sectors, sectors + (q + 1) % sectors, sectors + q] for q in loop]
        blocks.add(np.concatenate([inner[-1], outer[-1]]), faces, "keystone")
    if supports:
        wide = 2 * outer[0]
        drop = np.array([0.0, 0, thickness])
        for m in range(sectors):
            n = (m + 1) % sectors
            low = [0.8 * inner[0][m] - drop, wide[m] - drop, 0.8 * inner[0][n] - drop, wide[n] - drop]
            blocks.add([*low, 0.8 * inner[0][m], wide[m], 0.8 * inner[0][n], wide[n]], part="support")
    return blocks
