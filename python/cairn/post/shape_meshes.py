"""Surfaces of all shapes but disks and spheres, in their position at a step: polygons, polyhedra, facets, capsules, cylinders,
superquadrics."""

import numpy as np

from ..base.geometry import rows_of_nodes, turn

AROUND, ALONG = 24, 12  # faces around an axis, and from pole to pole


def meshes_of(step):
    """Points (n, 3) [m], triangles (m, 3) and the rows (m,) of the bodies they are of, polygons in 2D at z = 0; None where the
    step has no such shape."""
    found, faces = _carried(step), _faces_of_meshes(step)
    if found is None:
        return faces
    if step.dim == 2:
        outlines, rows = outlines_of(step)
        size = np.array([len(o) for o in outlines])
        first = np.repeat(np.cumsum(size) - size, size - 2)
        turn_of = np.arange(len(first)) - np.repeat(np.cumsum(size - 2) - (size - 2), size - 2)
        points = np.column_stack((np.concatenate(outlines), np.zeros(size.sum())))
        return points, np.stack([first, first + turn_of + 1, first + turn_of + 2], axis=1), np.repeat(rows, size - 2)
    names, which, row, offset, hulls = found
    points, triangles, rows = [[part] for part in faces] if faces else ([], [], [])
    count = len(points[0]) if faces else 0
    for (name, hull), k in _groups(names, which):
        x, t = _local_mesh(name, hulls, hull)
        points.append(_placed(step, x, row[k], offset[k]).reshape(-1, 3))
        triangles.append((t[None] + count + len(x) * np.arange(len(k))[:, None, None]).reshape(-1, 3))
        rows.append(np.repeat(row[k], len(t)))
        count += len(points[-1])
    return np.concatenate(points), np.concatenate(triangles), np.concatenate(rows)


def surfaces_of(step, around=AROUND):
    """Surfaces as by meshes_of, with disks and spheres among them, as polygons of `around` corners and as globes."""
    from .. import _core
    from ..base.geometry import contactors_of

    balls = contactors_of(step).select(*_core.shapes("ball"))
    balls = balls.where(balls.radius > 0)
    parts = [part for part in (meshes_of(step),) if part is not None]
    if len(balls):
        if step.dim == 2:
            angle = 2 * np.pi * np.arange(around) / around
            x = np.stack([np.cos(angle), np.sin(angle), np.zeros(around)], axis=1)
            k = np.arange(1, around - 1)
            t = np.stack([np.zeros_like(k), k, k + 1], axis=1)
        else:
            x, t = _globe(around)
        center = np.zeros((len(balls), 1, 3))
        center[:, 0, : step.dim] = balls.center
        points = (center + balls.radius[:, None, None] * x).reshape(-1, 3)
        triangles = (t[None] + len(x) * np.arange(len(balls))[:, None, None]).reshape(-1, 3)
        parts.append((points, triangles, np.repeat(balls.body, len(t))))
    if not parts:
        return None
    first = np.cumsum([0, *(len(p) for p, _, _ in parts[:-1])])
    points, triangles, rows = zip(*parts)
    return np.concatenate(points), np.concatenate([t + f for t, f in zip(triangles, first)]), np.concatenate(rows)


def _globe(around):
    """Points and triangles of a sphere of radius 1, with one point at each pole and one ring at its middle."""
    if around == AROUND:
        return _grid(*_turned_outline("capsule", 1.0, 0.0))
    up = np.pi * np.arange(1, max(around // 2, 2)) / max(around // 2, 2)
    turn_of = 2 * np.pi * np.arange(around) / around
    rings = np.stack([np.outer(np.sin(up), np.cos(turn_of)), np.outer(np.sin(up), np.sin(turn_of)),
                      np.repeat(-np.cos(up)[:, None], around, axis=1)], axis=2).reshape(-1, 3)  # fmt: skip
    points = np.concatenate([[[0, 0, -1.0]], rings, [[0, 0, 1.0]]])
    j, n, last = np.arange(around), (np.arange(around) + 1) % around, len(points) - 1
    triangles = [np.stack([np.zeros_like(j), 1 + n, 1 + j], axis=1)]
    for k in range(len(up) - 1):
        a, b = 1 + k * around, 1 + (k + 1) * around
        triangles += [np.stack([a + j, a + n, b + n], axis=1), np.stack([a + j, b + n, b + j], axis=1)]
    top = last - around
    return points, np.concatenate([*triangles, np.stack([top + j, top + n, np.full_like(j, last)], axis=1)])


def _faces_of_meshes(step):
    """Facets that are mapped from nodes, where these are, each of the body of its first node; as meshes_of gives them."""
    table = step.run.scene.get("contactors") or {}
    if step.dim == 2 or "nodes" not in table:
        return None
    which, nodes = rows_of_nodes(table, np.asarray(step.drawn["id"]))
    facet = np.asarray(step.run.scene["shapes"])[np.asarray(table["shape_number"], np.int64)] == "facet"
    nodes = nodes[facet[which]][:, :3]
    if not len(nodes):
        return None
    points = step.drawn["position"][nodes.ravel()]
    return points, np.arange(len(points)).reshape(-1, 3), nodes[:, 0]


def outlines_of(step):
    """Corners of the polygons of a step in 2D, a list of (m, 2) [m], and the rows of the bodies they are of."""
    found = _carried(step) if step.dim == 2 else None
    if found is None:
        return [], np.zeros(0, np.int64)
    names, which, row, offset, hulls = found
    first, vertex = np.asarray(hulls["first_vertex"]), np.asarray(hulls["vertex"], float).reshape(-1, 2)
    outlines, rows = [], []
    for (_, hull), k in _groups(names, which):
        outlines += list(_placed(step, vertex[first[hull] : first[hull + 1]], row[k], offset[k]))
        rows.append(row[k])
    return outlines, np.concatenate(rows)


def _carried(step):
    """Hulls whose body is present: names, hulls, rows of bodies, offsets; the table of hulls."""
    table = step.run.scene.get("contactors") or {}
    hulls, which = table.get("hulls"), table.get("hull")
    if hulls is None or which is None or not len(step.drawn):
        return None
    which, owner = np.asarray(which, np.int64), np.asarray(table["body"], np.int64)
    names = np.asarray(step.run.scene["shapes"])[np.asarray(table["shape_number"], np.int64)]
    ids = np.asarray(step.drawn["id"]) if "id" in step.drawn else np.arange(len(step.drawn))
    order = np.argsort(ids, kind="stable")
    row = order[np.minimum(np.searchsorted(ids, owner, sorter=order), len(ids) - 1)]
    shown = np.flatnonzero((which >= 0) & (ids[row] == owner))
    if not len(shown):
        return None
    offset = np.asarray(table["offset"], float) if "offset" in table else np.zeros((len(owner), step.dim))
    return names[shown], which[shown], row[shown], offset[shown], hulls


def _placed(step, local, rows, offset):
    """Points (m, dim) of a shape where each of its bodies is, (k, m, dim)."""
    k, m, dim = len(rows), len(local), step.dim
    points = (local[None] + offset[:, None]).reshape(-1, dim)
    at = np.repeat(rows, m)
    if "rotation" in step.drawn:
        points = turn(step.drawn["rotation"][at], points, dim)
    return (points + step.drawn["position"][at]).reshape(k, m, dim)


def _groups(names, which):
    """Contactors of the same name and hull: ((name, hull), their places)."""
    kinds, name = np.unique(names, return_inverse=True)
    pairs, group = np.unique(np.stack([name, which], axis=1), axis=0, return_inverse=True)
    places = np.split(np.argsort(group.ravel(), kind="stable"), np.cumsum(np.bincount(group.ravel()))[:-1])
    return [((str(kinds[n]), int(h)), p) for (n, h), p in zip(pairs, places, strict=True)] if len(names) else []


def _local_mesh(name, hulls, h):
    """Points and triangles of one hull from its centre, in the axes of the body."""
    first, last = (int(v) for v in np.asarray(hulls["first_vertex"])[h : h + 2])
    face, end = (int(v) for v in np.asarray(hulls["first_face"])[h : h + 2])
    x = np.asarray(hulls["vertex"], float).reshape(-1, 3)[first:last]
    sizes = np.asarray(hulls["offset"], float)[face:end]
    if name in ("capsule", "cylinder"):
        half = np.linalg.norm(x[1])
        points, triangles = _grid(*_turned_outline(name, sizes[0], half))
        return _along(points, x[1] / half) if half > 0 else points, triangles
    if name == "superquadric":
        return _grid(*_superquadric(*sizes))
    corner = np.asarray(hulls["first_corner"], np.int64)
    loops = [np.asarray(hulls["corner_vertex"], np.int64)[corner[f] : corner[f + 1]] - 1 for f in range(face, end)]
    return x, np.array([[c[0], c[i], c[i + 1]] for c in loops for i in range(1, len(c) - 1)], np.int64)


def _along(points, axis):
    """Points (n, 3) turned so that z becomes a unit vector."""
    if axis[2] == 1:
        return points
    across = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    across /= np.linalg.norm(across)
    return points @ np.stack([across, np.cross(axis, across), axis])


def _turned_outline(name, radius, half):
    """Radius and height from pole to pole of a capsule or cylinder along z, and cosine and sine around it."""
    if name == "cylinder":
        r, z = np.array([0, radius, radius, 0]), np.array([-half, -half, half, half])
    else:
        angle = np.linspace(0, np.pi / 2, ALONG // 2 + 1)
        r = radius * np.concatenate([np.sin(angle), np.sin(angle[::-1])])
        z = np.concatenate([-half - radius * np.cos(angle), half + radius * np.cos(angle[::-1])])
    around = 2 * np.pi * np.arange(AROUND) / AROUND
    return r, r, z, np.cos(around), np.sin(around)


def _superquadric(a, b, c, e1, e2):
    def power(x, e):
        return np.sign(x) * np.abs(x) ** e

    up = np.linspace(-np.pi / 2, np.pi / 2, 2 * ALONG + 1)
    around = 2 * np.pi * np.arange(2 * AROUND) / (2 * AROUND)
    r = power(np.maximum(np.cos(up), 0), e1)
    return a * r, b * r, c * power(np.sin(up), e1), power(np.cos(around), e2), power(np.sin(around), e2)


def _grid(a, b, z, x, y):
    """Points a_i x_j, b_i y_j, z_i and the triangles between them, closed around."""
    n, m = len(z), len(x)
    points = np.stack([np.outer(a, x), np.outer(b, y), np.repeat(z[:, None], m, axis=1)], axis=2).reshape(-1, 3)
    i, j = (k.ravel() for k in np.meshgrid(np.arange(n - 1), np.arange(m), indexing="ij"))
    p, q, r, s = i * m + j, i * m + (j + 1) % m, (i + 1) * m + (j + 1) % m, (i + 1) * m + j
    return points, np.concatenate([np.stack([p, q, r], axis=1), np.stack([p, r, s], axis=1)])
