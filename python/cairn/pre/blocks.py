"""Assemblies of convex blocks: polygons in 2D, polyhedra in 3D, with a part name each, and the joints between them.

Generators compute each corner once and hand the same numbers to all blocks that meet there, so that joints are flush to
rounding. `joints` finds faces that lie on each other, from geometry alone: the same list for limit analysis, for an
import's report and for drawings.
"""

from __future__ import annotations

import difflib
import warnings
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..base import checks
from . import mass_properties
from .box_pairs import overlapping_pairs
from .import_report import BlocksWarning

# a box's corners are numbered x + 2 y + 4 z; its faces run anticlockwise seen from outside
BOX_FACES = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
# {"polygons" | "polyhedra": function that makes a set of bodies}, from the layer above: cairn.model.shapes
MAKERS: dict = {}
FLUSH = 1e-9  # share of the size of an assembly: faces closer than this lie on each other

HUGE = 100.0  # length of the median block [m]: no stone is so long


class Joints(NamedTuple):
    """k joints of flush faces. blocks (k, 2); normal (k, dim), from the second block to the first; polygon: list of the
    corners (m, dim) [m] of the common part, m = 2 in 2D; area (k,) [m2], length [m] in 2D."""

    blocks: np.ndarray
    normal: np.ndarray
    polygon: list
    area: np.ndarray


@dataclass
class Blocks:
    """n convex blocks. vertices: list of (m, dim) [m]; faces: list of lists of polygons, [] in 2D; part: list of n names; flush:
    of the size of two blocks, faces closer than this lie on each other (files round their corners: an import sets more)."""

    dim: int
    vertices: list = field(default_factory=list)
    faces: list = field(default_factory=list)
    part: list = field(default_factory=list)
    flush: float = FLUSH

    def __len__(self):
        return len(self.vertices)

    def __repr__(self):
        parts = ", ".join(f"{self.part.count(name)} {name}" for name in dict.fromkeys(self.part))
        return f"<{len(self)} blocks in {self.dim}D: {parts or 'none'}>"

    def add(self, vertices, faces=None, part="block"):
        """One block more. A polygon is turned anticlockwise, a box (8 corners, no faces) right-handed."""
        vertices = checks.real_array("vertices", np.asarray(vertices), (None, self.dim))
        if self.dim == 2:
            a, b = vertices, np.roll(vertices, -1, axis=0)
            if np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) < 0:
                vertices = vertices[::-1].copy()
        elif faces is None:
            faces = BOX_FACES
            if np.linalg.det(vertices[[1, 2, 4]] - vertices[0]) < 0:
                vertices = vertices[[1, 0, 3, 2, 5, 4, 7, 6]]
        self.vertices.append(vertices)
        self.faces.append(faces)
        self.part.append(part)

    def add_box(self, low, high, part="block"):
        """A block with sides along the axes."""
        low, high = np.asarray(low, float), np.asarray(high, float)
        if self.dim == 2:
            self.add([low, [high[0], low[1]], high, [low[0], high[1]]], part=part)
        else:
            corner = np.array([[k & 1, k >> 1 & 1, k >> 2] for k in range(8)], bool)
            self.add(np.where(corner, high, low), part=part)

    def add_prism(self, outline, low, high, part="block", axis=1):
        """The prism over an outline (m, 2) in the other two axes, from `low` to `high` along the axis (y unless told)."""
        outline = np.asarray(outline, float)
        m = len(outline)
        points = np.empty((2 * m, 3))
        points[:, [k for k in range(3) if k != axis]] = np.concatenate([outline, outline])
        points[:m, axis], points[m:, axis] = low, high
        faces = [list(range(m))[::-1], list(range(m, 2 * m))]
        faces += [[k, (k + 1) % m, m + (k + 1) % m, m + k] for k in range(m)]
        a, b = outline, np.roll(outline, -1, axis=0)
        turn = np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
        if (turn < 0) != (axis == 1):  # x and z with y between them make a left-handed frame
            faces = [f[::-1] for f in faces]
        self.add(points, faces, part)

    def __add__(self, other):
        if self.dim != other.dim:
            raise ValueError(f"blocks of {self.dim} and {other.dim} dimensions do not add up")
        return Blocks(
            self.dim,
            self.vertices + other.vertices,
            self.faces + other.faces,
            self.part + other.part,
            max(self.flush, other.flush),
        )

    def select(self, choice):
        """The blocks whose part is named (a word or several), or whose numbers or mask are given."""
        words = (choice,) if isinstance(choice, str) else choice
        if len(words) and isinstance(words[0], str):
            at = [k for k, p in enumerate(self.part) if p in words]
        else:
            at = np.arange(len(self))[np.asarray(choice)]
        return Blocks(self.dim, *([x[k] for k in at] for x in (self.vertices, self.faces, self.part)), self.flush)

    def mask(self, *parts):
        """Mask (n,) of the blocks whose part is one of the names."""
        return np.array([p in parts for p in self.part], bool)

    def moved(self, shift=None, rotation=None, about=None):
        """A copy turned by a matrix (dim, dim) about a point, then shifted."""
        turn = np.eye(self.dim) if rotation is None else np.asarray(rotation, float)
        center = np.zeros(self.dim) if about is None else np.asarray(about, float)
        shift = center if shift is None else center + np.asarray(shift, float)
        vertices = [(v - center) @ turn.T + shift for v in self.vertices]
        return Blocks(self.dim, vertices, list(self.faces), list(self.part), self.flush)

    def properties(self):
        """cairn.pre.mass_properties.Properties of the blocks."""
        if self.dim == 2:
            return mass_properties.polygons(self.vertices)
        return mass_properties.polyhedra(self.vertices, self.faces)

    def bounds(self):
        """Lowest and highest corner of the assembly."""
        return (
            np.min([v.min(axis=0) for v in self.vertices], axis=0),
            np.max([v.max(axis=0) for v in self.vertices], axis=0),
        )

    def sets(self, material, **options):
        """One set of bodies for each part, in the order of their first block, and the row of each block among the ids that
        Scene.add returns for them: sets, rows. Blocks of the part "support" are fixed."""
        sets, order = [], []
        for name in dict.fromkeys(self.part):
            at = [k for k, p in enumerate(self.part) if p == name]
            fixed = {"fixed": True} if name == "support" else {}
            if self.dim == 2:
                made = MAKERS["polygons"]([self.vertices[k] for k in at], material, **fixed, **options)
            else:
                made = MAKERS["polyhedra"]([(self.vertices[k], self.faces[k]) for k in at], material, **fixed, **options)
            sets.append(made.with_(group=name))
            order += at
        rows = np.empty(len(self), int)
        rows[order] = np.arange(len(self))
        return sets, rows

    def add_to(self, scene, material, **options) -> np.ndarray:
        """Adds the blocks to a scene: the ids (n,) of their bodies, in the order of the blocks. Options: those of `sets`; in 2D
        blocks are as deep as the scene unless depth says otherwise."""
        size = float(np.median([np.max(np.ptp(v, axis=0)) for v in self.vertices])) if len(self) else 0.0
        if size >= HUGE:
            told = f"blocks are {size:.4g} m long (the median): give all lengths in metres, {1e-3 * size:.4g} for {size:.4g} mm"
            warnings.warn(told, BlocksWarning, stacklevel=2)
        like = [] if "support" in self.part else difflib.get_close_matches("support", set(self.part), 1, 0.7)
        if like:
            told = f'no block is held: the part that is held is "support", and there is {like[0]!r}'
            warnings.warn(told, BlocksWarning, stacklevel=2)
        if self.dim == 2:
            options = {"depth": scene.depth, **options}
        sets, rows = self.sets(material, **options)
        return scene.add(*sets)[rows]

    def joints(self, flush=None) -> Joints:
        """Parts of faces that lie on each other, within `flush` (their own unless told) of the larger block's size."""
        return joints(self, self.flush if flush is None else flush)


def face_table(blocks: Blocks):
    """All faces: corners (f, m, dim) padded with the last one, owner (f,), outward unit normal (f, dim), list of corners."""
    if blocks.dim == 2:
        loops = [(k, v[[i, (i + 1) % len(v)]]) for k, v in enumerate(blocks.vertices) for i in range(len(v))]
    else:
        loops = [(k, v[f]) for k, (v, faces) in enumerate(zip(blocks.vertices, blocks.faces)) for f in faces]
    owner = np.array([k for k, _ in loops])
    longest = max(len(c) for _, c in loops)
    corners = np.array([np.concatenate([c, np.repeat(c[-1:], longest - len(c), axis=0)]) for _, c in loops])
    if blocks.dim == 2:
        edge = corners[:, 1] - corners[:, 0]
        normal = np.column_stack((edge[:, 1], -edge[:, 0]))
    else:
        local = corners - corners[:, :1]
        normal = np.cross(local, np.roll(local, -1, axis=1)).sum(axis=1)  # Newell's, for corners not quite in a plane
    length = np.linalg.norm(normal, axis=1)
    keep = length > 0
    kept = [c for (_, c), there in zip(loops, keep) if there]
    return corners[keep], owner[keep], normal[keep] / length[keep, None], kept


def joints(blocks: Blocks, flush=FLUSH) -> Joints:
    """See Blocks.joints."""
    corners, owner, normal, loops = face_table(blocks)
    size = np.array([np.max(np.ptp(v, axis=0)) for v in blocks.vertices])[owner]
    low, high = corners.min(axis=1) - flush * size[:, None], corners.max(axis=1) + flush * size[:, None]
    i, j = overlapping_pairs(low, high).T
    near = (owner[i] != owner[j]) & (np.einsum("ij,ij->i", normal[i], normal[j]) < -1 + max(1e-9, 8 * flush * flush))
    i, j = i[near], j[near]
    larger = np.maximum(size[i], size[j])
    step = np.einsum("ijk,ik->ij", corners[j] - corners[i][:, :1], normal[i])
    close = np.abs(step).max(axis=1) <= flush * larger
    found = []
    for a, b in zip(i[close], j[close]):
        polygon, area = common(loops[a], loops[b], normal[a])
        if area > flush * min(size[a], size[b]) ** (blocks.dim - 1):
            found.append((owner[a], owner[b], -normal[a], polygon, area))
    if not found:
        return Joints(np.empty((0, 2), int), np.empty((0, blocks.dim)), [], np.empty(0))
    first, second, n, polygon, area = zip(*found)
    return Joints(np.column_stack((first, second)), np.array(n), list(polygon), np.array(area))


def common(one, other, normal):
    """The common part of two flush faces: corners and area, length in 2D."""
    if len(normal) == 2:
        along = np.array([-normal[1], normal[0]])
        s, t = one @ along, other @ along
        inside = [max(s.min(), t.min()), min(s.max(), t.max())]
        start = one[np.argmin(s)]
        return np.array([start + (x - s.min()) * along for x in inside]), inside[1] - inside[0]
    e1 = one[1] - one[0]
    e1 = e1 / np.linalg.norm(e1)
    e2 = np.cross(normal, e1)
    frame, origin = np.column_stack((e1, e2)), one[0]
    flat = clip((one - origin) @ frame, ((other - origin) @ frame)[::-1])
    if len(flat) < 3:
        return flat, 0.0
    x, y = flat.T
    area = 0.5 * (np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))
    return origin + flat @ frame.T, area


def clip(polygon, window):
    """A convex polygon cut by another, both anticlockwise (m, 2) (Sutherland & Hodgman 1974)."""
    kept = [tuple(p) for p in polygon]
    for k in range(len(window)):
        (ax, ay), (bx, by) = window[k - 1], window[k]
        if not kept:
            break
        height = [(bx - ax) * (y - ay) - (by - ay) * (x - ax) for x, y in kept]
        new = []
        for m in range(len(kept)):
            h0, h1, p, q = height[m - 1], height[m], kept[m - 1], kept[m]
            if h0 * h1 < 0:
                s = h0 / (h0 - h1)
                new.append((p[0] + s * (q[0] - p[0]), p[1] + s * (q[1] - p[1])))
            if h1 >= 0:
                new.append(q)
        kept = new
    return np.array(kept).reshape(-1, 2)


def cut(vertices, faces, point, normal):
    """The part of a convex polyhedron behind a plane (where normal points away): vertices, faces; None when nothing is left.

    Corners within rounding of the plane lie on it, so that blocks cut by the same plane meet flush.
    """
    vertices = np.asarray(vertices, float)
    height = (vertices - point) @ (np.asarray(normal, float) / np.linalg.norm(normal))
    height[np.abs(height) <= 1e-12 * np.max(np.ptp(vertices, axis=0))] = 0.0
    if np.all(height >= 0):
        return None
    if np.all(height <= 0):
        return vertices, faces
    points, number, crossing, new_faces, rim = [], {}, {}, [], {}

    def kept(k):
        if k not in number:
            number[k] = len(points)
            points.append(vertices[k])
        return number[k]

    def on_edge(i, j):
        i, j = min(i, j), max(i, j)
        if (i, j) not in crossing:
            crossing[i, j] = len(points)
            points.append(vertices[i] + height[i] / (height[i] - height[j]) * (vertices[j] - vertices[i]))
        return crossing[i, j]

    for face in faces:
        loop, border = [], []
        for a, b in zip(face, [*face[1:], face[0]]):
            if height[a] <= 0:
                loop.append(kept(a))
                if height[a] == 0:
                    border.append(loop[-1])
            if height[a] * height[b] < 0:
                loop.append(on_edge(a, b))
                border.append(loop[-1])
        if len(loop) >= 3 and min(height[k] for k in face) < 0:
            new_faces.append(loop)
            if len(border) == 2 and loop.index(border[1]) == (loop.index(border[0]) + 1) % len(loop):
                rim[border[1]] = border[0]
            elif len(border) == 2:
                rim[border[0]] = border[1]
    if rim:
        start = next(iter(rim))
        loop = [start]
        while rim[loop[-1]] != start:
            loop.append(rim[loop[-1]])
        new_faces.append(loop)
    used, renumbered = np.unique([k for f in new_faces for k in f], return_inverse=True)
    stops = np.cumsum([len(f) for f in new_faces])[:-1]
    return np.array(points)[used], [list(f) for f in np.split(renumbered, stops)]
