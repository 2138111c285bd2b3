"""Closed bodies in a heap of triangles: blocks that touch share edges and corners once equal corners are one."""

from __future__ import annotations

import numpy as np

COINCIDE = 1e-6  # rad: faces round an edge nearer than this lie on each other


def solids(vertices, faces, rounding=0.0, in_order=False) -> list[tuple[np.ndarray, np.ndarray]]:
    """The bodies that triangles (k, 3) bound, each (vertices, faces) with corners of its own.

    Files mostly list body after body: runs of closed faces are taken first. Among the remaining faces, those round an edge of
    several bodies are sorted by angle: a body lies between a face that opens it and the next that closes it (Weiler 1986). This
    separates blocks that lie flush on each other, also where a file gives equal corners once. Where faces do not pair, since a
    face is missing or reversed, faces adjacent in the file are paired. rounding [m]: of the corners; faces nearer than that, and
    than 1e-6 rad, lie on each other. in_order: faces pair by their places in the file alone, for surfaces with faults.
    """
    vertices, faces = np.asarray(vertices, float), np.asarray(faces, np.int64)
    ends = [0, *closed_after(faces)]
    if ends[-1] < len(faces):  # from the first fault on; closed bodies at the end of the file are taken as well
        ends += [len(faces) - end for end in closed_after(faces[ends[-1] :][::-1])[::-1]]
        ends.append(len(faces))
    runs = [faces[a:b] for a, b in zip(ends[:-1], ends[1:]) if b > a]
    return [body for run in runs for body in parted(vertices, run, rounding, in_order)]


def closed_after(faces):
    """Numbers of triangles after which those since the number before make closed surfaces."""
    waiting, ends = {}, []
    for k, (i, j, m) in enumerate(faces.tolist(), 1):
        for a, b in ((i, j), (j, m), (m, i)):
            if waiting.get((b, a), 0):
                if waiting[b, a] == 1:
                    del waiting[b, a]
                else:
                    waiting[b, a] -= 1
            else:
                waiting[a, b] = waiting.get((a, b), 0) + 1
        if not waiting:
            ends.append(k)
    return ends


def parted(vertices, faces, rounding, in_order=False):
    """The bodies of triangles in any order; see `solids`."""
    start, stop, apex = (np.roll(faces, -k, axis=1).ravel() for k in range(3))
    owner = np.repeat(np.arange(len(faces)), 3)
    key = np.minimum(start, stop) * len(vertices) + np.maximum(start, stop)
    order = np.argsort(key, kind="stable")
    bounds = np.flatnonzero(np.diff(key[order], prepend=-1, append=-1))
    count = np.diff(bounds)
    pairs = [np.column_stack([owner[order[bounds[:-1][count == 2] + k]] for k in (0, 1)])]
    turned = signed_volume(vertices, faces) < 0  # all inside out: bodies lie on the other side
    for first, number in zip(bounds[:-1][count > 2], count[count > 2]):
        at = order[first : first + number]
        forward = (start[at] < stop[at]) != turned
        i, j = sorted((start[at[0]], stop[at[0]]))
        paired = None if in_order else round_an_edge(vertices[i], vertices[j], vertices[apex[at]], forward, rounding)
        pairs.append(owner[at[neighbours_in_file(owner[at]) if paired is None else paired]])
    label = joined_labels(len(faces), np.concatenate(pairs))
    found = []
    for k in np.unique(label):
        used, renumbered = np.unique(faces[label == k], return_inverse=True)
        found.append((vertices[used], renumbered.reshape(-1, 3)))
    return found


def signed_volume(vertices, faces):
    a, b, c = (vertices[faces[:, k]] - vertices[faces[0, 0]] for k in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c))


def round_an_edge(i, j, apex, forward, rounding):
    """Which of the faces round the edge from i to j bound a body together: (p, 2). apex (n, 3): corners off the edge; forward
    (n,): whether a face runs from i to j, its body then lies clockwise of it seen from j; rounding [m] of corners. None where
    they do not pair: a face is missing there, or turned the wrong way."""
    n = len(apex)
    if 2 * np.sum(forward) != n:
        return None
    along = (j - i) / np.linalg.norm(j - i)
    x = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
    y = np.cross(along, x)
    across, up = (apex - i) @ x, (apex - i) @ y
    angle, reach = np.arctan2(up, across), np.hypot(across, up) / np.linalg.norm(x)
    ranks = np.argsort(angle)
    step = np.diff(angle[ranks], prepend=angle[ranks[-1]] - 2 * np.pi)
    new = (step > COINCIDE) & (step * np.minimum(reach[ranks], reach[np.roll(ranks, 1)]) > rounding)
    if not np.any(new):
        return None
    shift = -int(np.argmax(new))
    ranks, new = np.roll(ranks, shift), np.roll(new, shift)
    # at one angle a body ends before the next begins
    ranks = ranks[np.lexsort((~forward[ranks], np.cumsum(new)))]
    ranks = np.roll(ranks, -int(np.argmin(forward[ranks])))
    if np.any(forward[ranks[::2]]) or not np.all(forward[ranks[1::2]]):
        return None
    return ranks.reshape(-1, 2)


def neighbours_in_file(face):
    """Pairs (p, 2) of faces, given by their numbers (n,), that are nearest to each other in the file: those of one body mostly
    stand together. All in a chain where more than one is left without a partner."""
    order = np.argsort(face)
    gap = np.concatenate([[np.inf], np.diff(face[order]), [np.inf]])
    pairs = [(k, k + 1) for k in range(len(face) - 1) if gap[k + 1] < min(gap[k], gap[k + 2])]
    if len(face) - 2 * len(pairs) > 1:
        pairs = [(k, k + 1) for k in range(len(face) - 1)]
    return order[np.array(pairs)]


def joined_labels(count, links):
    """The smallest number among those that links (k, 2) join each to."""
    label = np.arange(count)
    while True:
        smallest = np.minimum(label[links[:, 0]], label[links[:, 1]])
        new = label.copy()
        for side in (0, 1):
            np.minimum.at(new, links[:, side], smallest)
            np.minimum.at(new, label[links[:, side]], smallest)
        new = new[new]
        if np.array_equal(new, label):
            return label
        label = new

