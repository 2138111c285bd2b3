"""Surfaces mended: corners merged, faces turned alike, holes closed, all of it outward. Nothing is moved."""

from __future__ import annotations

import numpy as np

from . import closed_surfaces

LARGEST_HOLE = 256  # edges up to which the patch of least area is sought, in time of the third power; larger ones get a fan


def repair(vertices, faces, name: str = "mesh"):
    """A surface mended: vertices, triangles, list of repairs. Raises MeshError for remaining faults.

    Coincident corners are merged; faces with a corner that is not finite, without area or listed twice are dropped; faces are
    turned alike across their edges; each hole gets the triangles of least area between its corners (Barequet & Sharir 1995); each
    surface turns its front outward, and that of a cavity inward; surfaces that run through each other are joined (manifold3d).
    """
    vertices, done = np.asarray(vertices, float), []
    faces = closed_surfaces.triangles(vertices, faces, name)
    finite = np.isfinite(vertices).all(axis=1)
    if not np.all(finite):
        kept = finite[faces].all(axis=1)
        done.append(f"dropped {np.sum(~kept)} faces with a vertex that is not finite")
        faces, vertices = faces[kept], np.where(finite[:, None], vertices, 0.0)
    before = len(faces)
    vertices, faces = closed_surfaces.weld(vertices, faces, 1e-9)
    faces = _with_area(vertices, faces)
    faces = faces[np.sort(np.unique(np.sort(faces, axis=1), axis=0, return_index=True)[1])]
    if len(faces) != before:
        done.append(f"merged vertices and dropped {before - len(faces)} faces without area or listed twice")
    if not len(faces):
        raise closed_surfaces.MeshError("flat", f"{name} has no face with an area; give it others")
    turned = _turned_alike(vertices, faces)
    was = faces
    faces = np.where(turned[:, None], faces[:, ::-1], faces)
    patches, largest, holes = _patches(vertices, faces)
    if holes:
        faces = np.concatenate([faces, *patches])
        done.append(f"closed {holes} hole{'s' * (holes > 1)}, the largest of {largest} edges")
    used, numbers = np.unique(faces, return_inverse=True)
    vertices, faces = vertices[used], _outward(vertices[used], numbers.reshape(-1, 3))
    start = np.searchsorted(used, was[:, 0]), np.searchsorted(used, was[:, 1])
    flipped = int(np.sum(~_runs(faces[: len(was)], *start)))
    if flipped:
        done.append(f"turned {flipped} of {len(was)} faces")
    try:
        closed_surfaces.check(vertices, faces, name)
    except closed_surfaces.MeshError as error:
        if error.fault != "crossing":
            raise
        vertices, faces, count = _joined(vertices, faces, error)
        done.append(f"joined {count} surfaces that run through each other")
        closed_surfaces.check(vertices, faces, name)
    return vertices, faces, done


def _joined(vertices, faces, error):
    """Vertices and triangles of the union of closed surfaces that run through each other, and how many they were."""
    try:
        import manifold3d
    except ImportError:
        told = f"{error}; surfaces that run through each other are joined by manifold3d: pip install manifold3d"
        raise closed_surfaces.MeshError(error.fault, told, error.items) from None
    pieces = []
    for corners, own in closed_surfaces.parts(vertices, faces):
        inverted = np.linalg.det((corners - corners.mean(axis=0))[own]).sum() < 0  # it was taken for a cavity
        own = own[:, ::-1] if inverted else own
        given = manifold3d.Mesh64(np.ascontiguousarray(corners), np.ascontiguousarray(own, np.uint64))
        pieces.append(manifold3d.Manifold(given))
    if len(pieces) < 2 or any(piece.status() != manifold3d.Error.NoError for piece in pieces):
        raise error
    whole = manifold3d.Manifold.batch_boolean(pieces, manifold3d.OpType.Add).to_mesh64()
    return np.array(whole.vert_properties)[:, :3], np.array(whole.tri_verts, np.int64), len(pieces)


def turned_outward(vertices, faces):
    """Triangles (m, 3) of closed surfaces, turned alike across their edges and outward."""
    return _outward(vertices, np.where(_turned_alike(vertices, faces)[:, None], faces[:, ::-1], faces))


def _with_area(vertices, faces):
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    longest = np.max([np.sum((p - q) ** 2, axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    return faces[np.linalg.norm(np.cross(b - a, c - a), axis=1) > closed_surfaces.SLIVER * longest]


def _runs(faces, start, stop):
    """True for each face that has the edge from start to stop."""
    return ((faces == start[:, None]) & (np.roll(faces, -1, axis=1) == stop[:, None])).any(axis=1)


def _turned_alike(vertices, faces):
    """Mask (n,) of the faces to flip for a consistent orientation: two faces that share an edge must run along it in opposite
    directions. Pieces that meet the rest at corners alone are oriented like the larger piece there."""
    size = int(faces.max()) + 1
    start, stop = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    key = np.minimum(start, stop) * size + np.maximum(start, stop)
    order = np.argsort(key, kind="stable")
    first = np.flatnonzero(np.diff(key[order], prepend=-1))
    count = np.diff(np.append(first, len(order)))
    i, j = order[first[count == 2]], order[first[count == 2] + 1]
    same_way = start[i] == start[j]
    neighbours = [[] for _ in range(len(faces))]
    for a, b, wrong in zip((i // 3).tolist(), (j // 3).tolist(), same_way.tolist()):
        neighbours[a].append((b, wrong))
        neighbours[b].append((a, wrong))
    turned, pieces = np.full(len(faces), -1), []
    for seed in range(len(faces)):
        if turned[seed] >= 0:
            continue
        turned[seed], waiting, piece = 0, [seed], []
        pieces.append(piece)
        while waiting:
            a = waiting.pop()
            piece.append(a)
            for b, wrong in neighbours[a]:
                if turned[b] < 0:
                    turned[b] = turned[a] ^ wrong
                    waiting.append(b)
    turned = turned == 1
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normals = np.where(turned, -1.0, 1.0)[:, None] * np.cross(b - a, c - a)
    round_corners = np.zeros_like(vertices)
    for piece in sorted(pieces, key=len, reverse=True):
        corners, own = faces[piece].ravel(), np.repeat(normals[piece], 3, axis=0)
        if np.einsum("ij,ij->", round_corners[corners], own) < 0:
            turned[piece], own = ~turned[piece], -own
        np.add.at(round_corners, corners, own)
    return turned


def _patches(vertices, faces):
    """Triangles for each hole, the edges of the largest hole, and how many holes there are."""
    patches, largest = [], 0
    loops = _holes(vertices, faces)
    there = {tuple(pair) for k in range(3) for pair in np.sort(faces[:, [k, k - 1]], axis=1).tolist()} if loops else set()
    for loop in sorted(loops, key=len):
        largest = max(largest, len(loop))
        patches.append(_least_area(vertices, loop, there) if len(loop) <= LARGEST_HOLE else _fan(loop))
        there |= {tuple(pair) for k in range(3) for pair in np.sort(patches[-1][:, [k, k - 1]], axis=1).tolist()}
    return patches, largest, len(loops)


def _holes(vertices, faces):
    """Loops of corners, each closed against the run of the edges that have one face alone."""
    size = int(faces.max()) + 1
    start, stop = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    forward, backward = start * size + stop, stop * size + start
    alone = forward[~np.isin(forward, backward)]
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normals = np.zeros_like(vertices)
    np.add.at(normals, faces.ravel(), np.repeat(np.cross(b - a, c - a), 3, axis=0))
    following = {}
    for a, b in zip(*(part.tolist() for part in np.divmod(np.sort(alone), size))):
        following.setdefault(b, []).append(a)  # the other way round: the patch lies on the other side of the edge
    loops = []
    while following:
        path, place = [next(iter(following))], {}
        place[path[0]] = 0
        while path:
            ways = following.get(path[-1])
            if not ways:  # an end: edges of more than two faces, which no patch closes
                following.pop(path[-1], None)
                place.pop(path.pop())
                continue
            corner = ways[-1]
            if len(ways) > 1 and len(path) > 1:  # holes that meet at a corner
                corner = _clockwise(vertices, normals, path[-1], path[-2], ways)
            ways.remove(corner)
            if not ways:
                del following[path[-1]]
            if corner in place:  # closed; the path before it may belong to another loop
                first = place[corner]
                if len(path) - first >= 3:
                    loops.append(path[first:])
                for left in path[first + 1 :]:
                    del place[left]
                del path[first + 1 :]
                if path[-1] not in following:
                    place.pop(path.pop())
                continue
            place[corner] = len(path)
            path.append(corner)
    return loops


def _clockwise(vertices, normals, corner, came, ways):
    """The way out of a corner that is the next clockwise, seen from outside, from the edge to where one came: across the gap."""
    out = vertices[[came, *ways]] - vertices[corner]
    across = np.cross(normals[corner], out[0])
    angle = np.arctan2(out @ across, out @ np.cross(across, normals[corner]))
    return ways[int(np.argmax((angle[1:] - angle[0]) % (2 * np.pi)))]


def _least_area(vertices, loop, there):
    """Triangles of least area between the corners of a loop; none without area, and no side that is an edge already (pairs in
    there), if that can be."""
    p, n = vertices[loop], len(loop)
    cost, best = np.full((n, n), np.inf), np.zeros((n, n), int)
    cost[np.arange(n - 1), np.arange(1, n)] = 0.0
    worst = 1e3 * float(np.max(np.ptp(p, axis=0))) ** 2  # dearer than any patch of real triangles
    for gap in range(2, n):
        for i in range(n - gap):
            k = i + gap
            m = np.arange(i + 1, k)
            area = np.linalg.norm(np.cross(p[m] - p[i], p[k] - p[i]), axis=1)
            longest = np.maximum(np.sum((p[m] - p[i]) ** 2, axis=1), np.sum((p[m] - p[k]) ** 2, axis=1))
            longest = np.maximum(longest, np.sum((p[k] - p[i]) ** 2))
            total = cost[i, m] + cost[m, k] + np.where(area > closed_surfaces.SLIVER * longest, area, worst)
            at = int(np.argmin(total))
            taken = gap < n - 1 and (min(loop[i], loop[k]), max(loop[i], loop[k])) in there
            cost[i, k], best[i, k] = total[at] + worst * taken, m[at]
    triangles, waiting = [], [(0, n - 1)]
    while waiting:
        i, k = waiting.pop()
        if k - i >= 2:
            m = best[i, k]
            triangles.append((loop[i], loop[m], loop[k]))
            waiting += [(i, m), (m, k)]
    return np.array(triangles)


def _fan(loop):
    return np.array([(loop[0], loop[k], loop[k + 1]) for k in range(1, len(loop) - 1)])


def _outward(vertices, faces):
    """Faces with the fronts of outer surfaces outward, of surfaces within another one inward."""
    label = np.arange(len(vertices))
    while True:
        new = label.copy()
        np.minimum.at(new, faces.ravel(), np.repeat(label[faces].min(axis=1), 3))
        new = new[new]
        if np.array_equal(new, label):
            break
        label = new
    of_face = label[faces[:, 0]]
    groups = [np.flatnonzero(of_face == k) for k in np.unique(of_face)]
    for mine in groups:
        a, b, c = (vertices[faces[mine, k]] for k in range(3))
        origin = a[0]
        outward = np.einsum("ij,ij->", a - origin, np.cross(b - origin, c - origin)) > 0
        within = sum(_encloses(vertices, faces[other], origin) for other in groups if other is not mine) % 2 == 1
        if outward == within:
            faces[mine] = faces[mine][:, ::-1]
    return faces


def _encloses(vertices, faces, point):
    """True if a surface encloses a point off it, by its solid angle (van Oosterom & Strackee 1983)."""
    a, b, c = (vertices[faces[:, k]] - point for k in range(3))
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    dots = [np.einsum("ij,ij->i", x, y) for x, y in ((a, b), (b, c), (c, a))]
    triple = np.einsum("ij,ij->i", a, np.cross(b, c))
    angle = 2 * np.arctan2(triple, la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb)
    return abs(angle.sum()) > 2 * np.pi
