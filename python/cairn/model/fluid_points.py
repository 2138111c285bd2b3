"""Points below the surfaces of rigid bodies, by which a liquid meets them, and the depth of places in bodies."""

from __future__ import annotations

import numpy as np

from .. import _core

LAYERED = ("disk", "sphere", "polygon", "polyhedron", "ring", "capsule", "cylinder", "segment")
PLANES = ("half_plane", "plane")


class Points:
    """Points of a body below its surface.

    Parameters
    ----------
    place : ndarray (n, dim)
        In the axes of the body, from its centre of mass [m].
    normal : ndarray (n, dim)
        Out of the body at the nearest point of its surface.
    depth : ndarray (n,)
        Below its surface [m].
    volume : ndarray (n,)
        Volume, in 2D area, of each [m3 or m2].
    centre : ndarray (n,), optional
        How far below each, along its normal, the centre of curvature of the surface lies, at which pressure acts on the body
        [m]; 0, as when not given, of flat sides.
    """

    def __init__(self, place, normal, depth, volume, centre=None):
        self.place, self.normal, self.depth, self.volume = place, normal, depth, volume
        self.centre = np.zeros(len(place)) if centre is None else centre

    def __len__(self):
        return len(self.place)

    def where(self, kept):
        """Gives some of the points.

        Parameters
        ----------
        kept : ndarray (n,) of bool
            Which.

        Returns
        -------
        Points
            These.
        """
        return Points(self.place[kept], self.normal[kept], self.depth[kept], self.volume[kept], self.centre[kept])


def points_of(shape, dim, form, spacing, reach):
    """Points in layers below the surface of a shape, one spacing apart and half of one below it.

    Parameters
    ----------
    shape : str
        Name of the shape.
    dim : int
        2 or 3.
    form : dict
        "offset" (dim,), "radius", "direction" (dim,), "half", "vertex" (v, dim) from the offset, "faces" lists of corners.
    spacing : float
        Distance of the points [m].
    reach : float
        Depth up to which there are points [m].

    Returns
    -------
    Points
        The points.
    """
    layers = int(np.ceil(reach / spacing))
    if shape in ("disk", "sphere"):
        made = Points(*_core.fluid_points_in_ball(dim, form["radius"], spacing, layers, False))
    elif shape == "ring":
        made = Points(*_core.fluid_points_in_ball(dim, form["radius"], spacing, layers, True))
    elif shape == "polygon":
        made = _polygon(form["vertex"], spacing, layers)
    elif shape == "polyhedron":
        made = _polyhedron(form, spacing, layers)
    elif shape == "cylinder":
        made = _cylinder(form, spacing, layers)
    else:
        made = _by_distance(shape, dim, form, spacing, reach)
    made.place = made.place + form["offset"]
    return made


def depth_in(shape, dim, form, x):
    """Depth of places below the surface of a shape, < 0 outside; a bound of it outside edges.

    Parameters
    ----------
    shape : str
        Name of the shape.
    dim : int
        2 or 3.
    form : dict
        As in `points_of`.
    x : ndarray (n, dim)
        Places in the axes of the body [m].

    Returns
    -------
    ndarray (n,)
        Depths [m].
    """
    r = x - form["offset"]
    if shape in PLANES:
        return -(r @ form["direction"])
    if shape in ("disk", "sphere"):
        return form["radius"] - np.linalg.norm(r, axis=1)
    if shape == "ring":
        return np.linalg.norm(r, axis=1) - form["radius"]
    if shape in ("polygon", "polyhedron"):
        normal, height = planes_of(dim, form)
        return (height - r @ normal.T).min(axis=1)
    return _depth_and_normal(shape, form, r)[0]


def planes_of(dim, form):
    """Normals (f, dim) out of a convex hull and their distances (f,) from its offset."""
    v = form["vertex"]
    if dim == 2:
        v = _anticlockwise(v)
        edge = np.roll(v, -1, axis=0) - v
        normal = np.stack([edge[:, 1], -edge[:, 0]], axis=1)
    else:
        normal = []
        for face in form["faces"]:  # Newell's normal
            a, b = v[face], v[np.roll(face, -1)]
            normal.append(np.cross(a, b).sum(axis=0))
        normal = np.array(normal)
    normal = normal / np.linalg.norm(normal, axis=1)[:, None]
    first = v if dim == 2 else v[[face[0] for face in form["faces"]]]
    return normal, np.sum(normal * first, axis=1)


def _anticlockwise(v):
    after = np.roll(v, -1, axis=0)
    return v if np.sum(v[:, 0] * after[:, 1] - v[:, 1] * after[:, 0]) > 0 else v[::-1]


def _cut(corners, normal, height):
    """Corners of a convex polygon on the inner side of a line."""
    out, above = [], corners @ normal - height
    for k in range(len(corners)):
        j = (k + 1) % len(corners)
        if above[k] <= 0:
            out.append(corners[k])
        if (above[k] < 0 < above[j]) or (above[j] < 0 < above[k]):
            out.append(corners[k] + above[k] / (above[k] - above[j]) * (corners[j] - corners[k]))
    return np.array(out).reshape(-1, corners.shape[1])


def _inset(v, normal, height, depth):
    for n, d in zip(normal, height):
        v = _cut(v, n, d - depth) if len(v) else v
    return v


def _area(v):
    after = np.roll(v, -1, axis=0)
    return 0.5 * np.sum(v[:, 0] * after[:, 1] - v[:, 1] * after[:, 0]) if len(v) > 2 else 0.0


def _polygon(v, spacing, layers):
    """Rows along the edges of a convex polygon moved inwards; its area is theirs."""
    v = _anticlockwise(v)
    normal, height = planes_of(2, {"vertex": v})
    tiny, places, depths, volumes = 1e-9 * spacing, [], [], []
    for k in range(layers):
        outer, inner = (_area(_inset(v, normal, height, (k + s) * spacing)) for s in (0, 1))
        if outer <= 0:
            break
        ring = _inset(v, normal, height, (k + 0.5) * spacing)
        if len(ring) < 3:  # thinner than a spacing: its middle
            ring = _inset(v, normal, height, k * spacing)
            along = ring - ring.mean(axis=0)
            axis = np.linalg.svd(along)[2][0]
            span = along @ axis
            many = max(1, int(round(np.ptp(span) / spacing)))
            row = ring.mean(axis=0) + np.outer(span.min() + (np.arange(many) + 0.5) * np.ptp(span) / many, axis)
        else:
            row = []
            for a, b in zip(ring, np.roll(ring, -1, axis=0)):
                length = np.linalg.norm(b - a)
                if length > tiny:
                    many = max(1, int(round(length / spacing)))
                    row.append(a + np.arange(many)[:, None] / many * (b - a))
            row = np.concatenate(row)
        places.append(row)
        volumes.append(np.full(len(row), (outer - inner) / len(row)))
    place = np.concatenate(places)
    below = height - place @ normal.T
    depths = below.min(axis=1)
    return Points(place, normal[below.argmin(axis=1)], np.maximum(depths, 0.25 * spacing), np.concatenate(volumes))


def _polyhedron(form, spacing, layers):
    """Lattices on the faces of a convex polyhedron moved inwards; where faces meet, the first one's points stand."""
    normal, height = planes_of(3, form)
    places, volumes = [], []
    for k in range(layers):
        depth = (k + 0.5) * spacing
        found, sizes = [], []
        for f, n in enumerate(normal):
            corners = form["vertex"][form["faces"][f]] - depth * n
            for g, m in enumerate(normal):
                if g != f and len(corners):
                    corners = _cut(corners, m, height[g] - depth + 1e-9 * spacing)
            if not len(corners):
                continue
            sides = np.roll(corners, -1, axis=0) - corners
            u = sides[np.argmax(np.sum(sides**2, axis=1))]
            u = u / max(np.linalg.norm(u), 1e-300)
            w = np.cross(n, u)
            at = [corners @ axis for axis in (u, w)]
            rows = []
            for span in at:
                many = max(1, int(round(np.ptp(span) / spacing)))
                rows.append(span.min() + np.arange(many + 1) * np.ptp(span) / many)
            a, b = (x.ravel() for x in np.meshgrid(*rows, indexing="ij"))
            lattice = a[:, None] * u + b[:, None] * w + (corners[0] @ n) * n
            within = np.all(height - depth - lattice @ normal.T >= -1e-6 * spacing, axis=1)
            size = spacing * np.prod([np.ptp(span) / max(1, int(round(np.ptp(span) / spacing))) or spacing for span in at])
            found.append(lattice[within])
            sizes.append(np.full(within.sum(), size))
        if not found:
            break
        place, size = np.concatenate(found), np.concatenate(sizes)
        _, first = np.unique(np.floor(place / (0.5 * spacing) + 0.25).astype(np.int64), axis=0, return_index=True)
        first.sort()
        places.append(place[first])
        volumes.append(size[first])
    if not places:  # thinner than a spacing
        return _by_distance("polyhedron", 3, form, spacing, layers * spacing)
    place = np.concatenate(places)
    below = height - place @ normal.T
    return Points(place, normal[below.argmin(axis=1)], below.min(axis=1), np.concatenate(volumes))


def _cylinder(form, spacing, layers):
    """Rows round the mantle and rings on the ends of a cylinder moved inwards; the volume of each layer is theirs, by the
    share of each in its surface. Points of mantle and ends both stand on the rim."""
    axis, across = form["direction"], np.linalg.svd(form["direction"][None])[2][1:]
    parts = []
    for k in range(layers):
        outer, inner = (
            2 * np.pi * max(0.0, form["radius"] - s * spacing) ** 2 * max(0.0, form["half"] - s * spacing) for s in (k, k + 1)
        )
        if outer <= 0:
            break
        depth = (k + 0.5) * spacing
        radius, half = max(0.0, form["radius"] - depth), max(0.0, form["half"] - depth)
        mantle, ends = _mantle(radius, half, spacing), _ends(radius, half, spacing)
        volume = (outer - inner) / (mantle[:, 3].sum() + ends[:, 3].sum())
        for of_mantle, (angle, far, high, area) in ((True, mantle.T), (False, ends.T)):
            round_ = np.stack([np.cos(angle), np.sin(angle)], axis=1) @ across
            normal = round_ if of_mantle else np.where(np.signbit(high), -1.0, 1.0)[:, None] * axis
            below = form["radius"] - radius if of_mantle else form["half"] - half
            depths, centre = np.full(len(far), max(below, 0.25 * spacing)), np.full(len(far), radius if of_mantle else 0.0)
            parts.append((far[:, None] * round_ + high[:, None] * axis, normal, depths, volume * area, centre))
    return Points(*(np.concatenate(column) for column in zip(*parts)))


def _mantle(radius, half, spacing):
    """Points of the mantle of a cylinder: angle, distance from the axis, height and area of each (n, 4)."""
    round_, rows = max(3, int(round(2 * np.pi * radius / spacing))), max(1, int(round(2 * half / spacing)))
    angle, row = (x.ravel() for x in np.meshgrid(np.arange(round_) * 2 * np.pi / round_, np.arange(rows + 1), indexing="ij"))
    area = np.where((row == 0) | (row == rows), 0.5, 1.0) * 4 * np.pi * radius * max(half, 1e-9 * spacing) / (round_ * rows)
    return np.stack([angle, np.full(len(row), radius), half * (2 * row / rows - 1), area], axis=1)


def _ends(radius, half, spacing):
    """Points of both ends of a cylinder in rings, as `_mantle` gives them."""
    rings, rows = max(1, int(round(radius / spacing))), []
    for j in range(rings + 1):
        far = radius * j / rings
        many = max(1, int(round(2 * np.pi * far / spacing)))
        inside, outside = max(0.0, j - 0.5), min(float(rings), j + 0.5)
        area = np.pi * max(radius / rings, 1e-9 * spacing) ** 2 * (outside**2 - inside**2) / many
        angle = (np.arange(many) + 0.5 * (j % 2)) * 2 * np.pi / many
        rows += [np.stack([angle, *np.broadcast_arrays(far, high, area, angle)[:3]], axis=1) for high in (-half, half)]
    return np.concatenate(rows)


def _by_distance(shape, dim, form, spacing, reach):
    """A lattice within a shape, in its axes, up to a depth."""
    axis = form.get("direction")
    frame = np.eye(dim)
    if axis is not None and np.linalg.norm(axis) > 0:
        frame = np.linalg.svd(axis[None])[2]
    if shape == "polyhedron":
        normal, height = planes_of(dim, form)
        corners = form["vertex"] @ frame.T
        low, high = corners.min(axis=0), corners.max(axis=0)
    else:
        size = np.full(dim, form["radius"])
        size[0] += form.get("half", 0.0)
        low, high = -size, size
    rows = []
    for a, b in zip(low, high):
        many = max(1, int(round((b - a) / spacing)))
        rows.append(a + (np.arange(many) + 0.5) * (b - a) / many)
    volume = np.prod([(b - a) / max(1, int(round((b - a) / spacing))) for a, b in zip(low, high)])
    place = np.stack([x.ravel() for x in np.meshgrid(*rows, indexing="ij")], axis=1) @ frame
    if shape == "polyhedron":
        below = height - place @ normal.T
        depth, out, centre = below.min(axis=1), normal[below.argmin(axis=1)], np.zeros(len(place))
    else:
        depth, out = _depth_and_normal(shape, form, place)
        centre = form["radius"] - depth
    kept = (depth > 0) & (depth < reach)
    return Points(place[kept], out[kept], depth[kept], np.full(kept.sum(), volume), centre[kept])


def _depth_and_normal(shape, form, r):
    """Depths and normals of capsules, segments with round ends and cylinders."""
    axis, half, radius = form["direction"], form["half"], form["radius"]
    along = r @ axis
    across = r - along[:, None] * axis
    far = np.linalg.norm(across, axis=1)
    if shape == "cylinder":
        side, end = radius - far, half - np.abs(along)
        out = across / np.maximum(far, 1e-300)[:, None]
        out = np.where((end < side)[:, None], np.sign(along)[:, None] * axis, out)
        return np.minimum(side, end), out
    away = r - np.clip(along, -half, half)[:, None] * axis
    far = np.linalg.norm(away, axis=1)
    return radius - far, away / np.maximum(far, 1e-300)[:, None]
