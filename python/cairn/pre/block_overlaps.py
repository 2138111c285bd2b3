"""How deep convex blocks stand in each other before a scene begins, by separating axes (Gottschalk, Lin & Manocha 1996)."""

from __future__ import annotations

import numpy as np

from .blocks import FLUSH, Blocks, face_table
from .box_pairs import overlapping_pairs


def overlaps(blocks: Blocks, flush=FLUSH, chunk=1 << 14):
    """Pairs (k, 2) of blocks that overlap by more than `flush` of the smaller's size, and by how much (k,) [m]."""
    low = np.array([v.min(axis=0) for v in blocks.vertices])
    high = np.array([v.max(axis=0) for v in blocks.vertices])
    size = np.max(high - low, axis=1)
    pairs = overlapping_pairs(low, high)
    most = max(len(v) for v in blocks.vertices)
    points = np.array([np.concatenate([v, np.repeat(v[-1:], most - len(v), axis=0)]) for v in blocks.vertices])
    normal, offset = padded_planes(blocks)
    found, depths = [], []
    for k in range(0, len(pairs), chunk):
        i, j = pairs[k : k + chunk].T
        apart = np.maximum(separation(normal, offset, points, i, j), separation(normal, offset, points, j, i))
        deep = np.flatnonzero(apart < -flush * np.minimum(size[i], size[j]))
        for m in deep:
            depth = -apart[m] if blocks.dim == 2 else min(-apart[m], -edge_separation(blocks, i[m], j[m]))
            if depth > flush * min(size[i[m]], size[j[m]]):
                found.append((i[m], j[m]))
                depths.append(depth)
    return np.array(found, int).reshape(-1, 2), np.array(depths)


def padded_planes(blocks: Blocks):
    """Outward normals (n, f, dim) and offsets (n, f) of the faces of each block, the last repeated."""
    corners, owner, normal, _ = face_table(blocks)
    offset = np.einsum("ij,ij->i", corners[:, 0], normal)
    count = np.bincount(owner, minlength=len(blocks))
    first = np.concatenate([[0], np.cumsum(count)[:-1]])
    at = first[:, None] + np.minimum(np.arange(count.max()), count[:, None] - 1)
    return normal[at], offset[at]


def separation(normal, offset, points, i, j):
    """Largest distance (k,) of all of block j from the plane of a face of block i."""
    heights = np.einsum("kfd,kvd->kfv", normal[i], points[j]) - offset[i][:, :, None]
    return heights.min(axis=2).max(axis=1)


def edge_separation(blocks: Blocks, i, j):
    """Largest distance of two polyhedra along the common normal of two of their edges."""
    (a, fa), (b, fb) = ((blocks.vertices[k], blocks.faces[k]) for k in (i, j))
    ea, eb = directions(a, fa), directions(b, fb)
    axis = np.cross(ea[:, None], eb[None]).reshape(-1, 3)
    length = np.linalg.norm(axis, axis=1)
    axis = axis[length > 1e-9] / length[length > 1e-9, None]
    if not len(axis):
        return -np.inf
    pa, pb = a @ axis.T, b @ axis.T
    return max(np.max(pb.min(axis=0) - pa.max(axis=0)), np.max(pa.min(axis=0) - pb.max(axis=0)))


def directions(vertices, faces):
    """Unit vectors along the edges, each once."""
    edges = {(min(p, q), max(p, q)) for f in faces for p, q in zip(f, [*f[1:], f[0]])}
    e = np.array([vertices[q] - vertices[p] for p, q in edges])
    return e / np.linalg.norm(e, axis=1, keepdims=True)
