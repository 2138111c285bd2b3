"""Faces made plane again: files round corners, to 7 digits in an STL, and then four of them lie in no plane.

Nearly plane faces disturb contact detection: two triangles at an angle of 1e-6 are two faces, and a block would rest on one of
them.
"""

from __future__ import annotations

import numpy as np

from . import mesh

ENOUGH = 1e-13  # share of the size: corners nearer to their planes stay
SLOW = 0.5  # a step that gains less is the last


def plane_groups(vertices, fans, tolerance):
    """Triangles of one plane: a list of their numbers for each face. From the largest on, those next to one another whose
    corners lie within the tolerance [m] of the first one's plane and that look the same way."""
    a, b, c = (vertices[fans[:, k]] for k in range(3))
    area = np.cross(b - a, c - a)
    length = np.linalg.norm(area, axis=1)
    normal = area / np.where(length > 0, length, 1.0)[:, None]
    across = {}
    for k, (i, j, m) in enumerate(fans.tolist()):
        across[i, j] = across[j, m] = across[m, i] = k
    taken, groups = np.zeros(len(fans), bool), []
    for seed in np.argsort(-length, kind="stable"):
        if taken[seed]:
            continue
        taken[seed] = True
        group = [int(seed)]
        for k in group:
            i, j, m = fans[k].tolist()
            for edge in ((j, i), (m, j), (i, m)):
                other = across.get(edge)
                if other is None or taken[other]:
                    continue
                height = (vertices[fans[other]] - a[seed]) @ normal[seed]
                if np.max(np.abs(height)) <= tolerance and (normal[other] @ normal[seed] > 0 or length[other] == 0):
                    taken[other] = True
                    group.append(other)
        groups.append(np.array(group))
    return groups


def rim(fans):
    """Boundary loop (edges of a single triangle) of triangles (k, 3) that form a face without holes."""
    edges = {(a, b) for f in fans.tolist() for a, b in zip(f, [*f[1:], f[0]])}
    follow = {a: b for a, b in edges if (b, a) not in edges}
    start = next(iter(follow))
    loop, at = [start], follow[start]
    while at != start and len(loop) < len(follow):
        loop.append(at)
        at = follow[at]
    return loop


def plane_faces(vertices, faces, tolerance=1e-9):
    """The faces of a convex body, triangles or polygons, joined where they lie in one plane, so that joints and contacts see
    whole faces: a list of loops. tolerance: of the size of the body."""
    vertices = np.asarray(vertices, float)
    fans = mesh.triangles(vertices, faces)
    return [rim(fans[g]) for g in plane_groups(vertices, fans, tolerance * np.max(np.ptp(vertices, axis=0)))]


def flattened(bodies, limit):
    """Vertices of bodies with plane faces, and how far a corner was moved [m]. bodies: (vertices (n, 3), triangles (k, 3),
    list of the triangles of each face).

    Corners that are equal move together, so that blocks stay flush, the shortest way that makes faces plane, by Newton's method.
    limit [m]: bodies with a corner that would go farther stay as they are.
    """
    first = np.concatenate([[0], np.cumsum([len(v) for v, _, _ in bodies])])
    given = np.concatenate([v for v, _, _ in bodies])
    points, which = unique_rows(given)
    origin = points.mean(axis=0)
    points = points - origin
    fans = np.concatenate([which[first[k] + f] for k, (_, f, _) in enumerate(bodies)])
    face = np.empty(len(fans), np.int64)
    done = faces = 0
    for _, f, groups in bodies:
        for g in groups:
            face[done + g] = faces
            faces += 1
        done += len(f)
    scale = float(np.max(np.abs(points))) or 1.0
    x, best, least = points, points, np.inf
    for _ in range(20):
        fit = planes(x, fans, face, faces)
        worst = float(np.max(np.abs(fit[-1]), initial=0.0))
        if worst < least:
            best = x
        if worst <= ENOUGH * scale or worst > SLOW * least:
            break
        least = worst
        x = x + steps(x, *fit)
    moved = np.linalg.norm(best - points, axis=1)
    result, farthest = [], 0.0
    for k, (vertices, _, _) in enumerate(bodies):
        mine = which[first[k] : first[k + 1]]
        if moved[mine].max() <= limit:
            farthest = max(farthest, float(moved[mine].max()))
            vertices = np.where(moved[mine, None] > 0, best[mine] + origin, vertices)
        result.append(vertices)
    return result, farthest


def unique_rows(points):
    """Different rows, -0 and 0 being one, and the number of each."""
    rows, number = np.unique(points + 0.0, axis=0, return_inverse=True)
    return rows, number.ravel()


def planes(x, fans, face, faces):
    """Mean planes of the faces with more than three corners, given as triangles fans (t, 3) of face (t,): normal (f, 3) and
    middle (f, 3); for each corner its number (c,), face (c,) and distance out of the mean plane (c,)."""
    a, b, c = (x[fans[:, k]] for k in range(3))
    area = np.cross(b - a, c - a)
    normal = np.stack([np.bincount(face, area[:, k], faces) for k in range(3)], axis=1)
    owner, corner = np.divmod(np.unique(np.repeat(face, 3) * len(x) + fans.ravel()), len(x))
    count = np.bincount(owner, minlength=faces)
    more = np.flatnonzero(count > 3)
    number = np.full(faces, -1)
    number[more] = np.arange(len(more))
    kept = number[owner] >= 0
    corner, owner, count = corner[kept], number[owner[kept]], count[more]
    normal = normal[more] / np.linalg.norm(normal[more], axis=1, keepdims=True)
    middle = np.stack([np.bincount(owner, x[corner, k], len(more)) for k in range(3)], axis=1) / np.maximum(count, 1)[:, None]
    return normal, middle, corner, owner, np.einsum("ij,ij->i", x[corner] - middle[owner], normal[owner])


def steps(x, normal, middle, corner, owner, height):
    """Newton's step (n, 3), the shortest, of the corners to planes that move and tilt with them: of
    n . dx + a . s + b = -height for each corner of each face, a tilt and b shift of the plane, s the place in it."""
    sparse = mesh.library("scipy.sparse", "to make faces plane")
    linalg = mesh.library("scipy.sparse.linalg", "to make faces plane")
    n = normal[owner]
    arm = x[corner] - middle[owner]
    reach = np.zeros(len(normal))
    np.maximum.at(reach, owner, np.linalg.norm(arm, axis=1))
    t = np.cross(n, np.eye(3)[np.argmin(np.abs(normal), axis=1)][owner])
    t /= np.linalg.norm(t, axis=1, keepdims=True)
    place = [np.einsum("ij,ij->i", arm, w) / reach[owner] for w in (t, np.cross(n, t))]
    rows, first = np.arange(len(corner)), 3 * len(x) + 3 * owner
    values = np.concatenate([*n.T, *place, np.ones(len(corner))])
    columns = np.concatenate([3 * corner, 3 * corner + 1, 3 * corner + 2, first, first + 1, first + 2])
    matrix = sparse.csr_array((values, (np.tile(rows, 6), columns)), shape=(len(rows), 3 * len(x) + 3 * len(normal)))
    found = linalg.lsmr(matrix, -height, atol=1e-14, btol=1e-14, conlim=0, maxiter=2000)[0]
    return found[: 3 * len(x)].reshape(-1, 3)
