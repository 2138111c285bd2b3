"""Consistent orientation of the faces of closed triangulated surfaces."""

from __future__ import annotations

import numpy as np


def turned_alike(vertices, faces):
    """Orients faces (m, 3) in place so that all normals point outward. Returns a text if that is impossible, else ""."""
    if np.any((faces[:, 0] == faces[:, 1]) | (faces[:, 1] == faces[:, 2]) | (faces[:, 2] == faces[:, 0])):
        return "a face has one vertex twice"
    size = len(vertices)
    start, stop = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    edge = np.minimum(start, stop) * size + np.maximum(start, stop)
    order = np.argsort(edge, kind="stable")
    first, second = order[0::2], order[1::2]
    names, count = np.unique(edge, return_counts=True)
    if np.any(count != 2):
        k = int(np.argmax(count != 2))
        a, b = divmod(int(names[k]), size)
        return f"its surface is not closed: the edge of vertices {a + 1} and {b + 1} has {count[k]} faces, not 2"
    same = start[first] == start[second]  # both faces have the same sense along their edge: one of them points inward
    if np.any(same):
        flip, pieces = _flips(len(faces), first // 3, second // 3, same)
        if pieces != 1:
            return "its surface has one side only" if flip is None else f"its faces turn both ways, on {pieces} surfaces"
        faces[flip] = faces[flip, ::-1]
    x = vertices - vertices.mean(axis=0)
    a, b, c = (x[faces[:, k]] for k in range(3))
    if np.sum(np.einsum("ij,ij->i", a, np.cross(b, c))) < 0:
        faces[:] = faces[:, ::-1]
    return ""


def _flips(count, one, other, same):
    """(mask of faces to flip so that all neighbours agree, or None if that is impossible; number of separate surfaces)."""
    neighbours = [[] for _ in range(count)]
    for a, b, s in zip(one.tolist(), other.tolist(), same.tolist()):
        neighbours[a].append((b, s))
        neighbours[b].append((a, s))
    flip, pieces = [None] * count, 0
    for root in range(count):
        if flip[root] is not None:
            continue
        flip[root], front = False, [root]
        pieces += 1
        while front:
            a = front.pop()
            for b, s in neighbours[a]:
                if flip[b] is None:
                    flip[b] = flip[a] != s
                    front.append(b)
                elif flip[b] != (flip[a] != s):
                    return None, 0
    return np.array(flip), pieces
