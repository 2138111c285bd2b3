"""Points below the sides of deformable bodies, by which a liquid meets them, and the depth of places in such bodies.

Nodes carry the points by the shape functions of their side. Layers go as deep as the kernel reaches. Where a body is thinner than
twice that, the deeper layers lie beyond the middle of the body, some of them outside, and stand for it towards the liquid before
their own side alone.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from .pressure import UnknownCellsError, boundary_sides
from .side_shapes import places_of_nodes

OPPOSITE, ALIKE = -0.5, 0.9  # cosines between normals of sides that face away from each other, and of a smooth surface
UNBOUNDED = np.finfo(float).max
_POWERS = [(0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (0, 2), (2, 1), (1, 2), (2, 2)]
_SPANNED = {3: (0, 1, 2), 4: (0, 1, 2, 3), 6: (0, 1, 2, 3, 4, 5), 8: range(8), 9: range(9)}


def shapes_and_slopes(dim, count, at):
    """Gives shape functions of a side and their derivatives along its parent coordinates.

    Parameters
    ----------
    dim : int
        2 or 3.
    count : int
        Nodes of the side, in the order of `side_shapes`.
    at : ndarray (m, dim - 1)
        Parent coordinates [-].

    Returns
    -------
    list of ndarray (m, count)
        Shape functions and derivatives; those along the second coordinate are 0 in 2D.
    """
    at = np.asarray(at, float)
    if dim == 2:
        s = at[:, 0]
        if count == 2:
            half = np.full(len(s), 0.5)
            found = [np.stack([(1 - s) / 2, (1 + s) / 2], 1), np.stack([-half, half], 1)]
        else:
            found = [
                np.stack([s * (s - 1) / 2, s * (s + 1) / 2, 1 - s * s], 1),
                np.stack([s - 0.5, s + 0.5, -2 * s], 1),
            ]
        return [*found, np.zeros_like(found[0])]
    p, q = np.array([_POWERS[k] for k in _SPANNED[count]]).T
    r, s = places_of_nodes(3, count).T[:, :, None]
    of_monomials = np.linalg.inv(r**p * s**q)
    r, s = at.T[:, :, None]
    wide = [r**p * s**q, p * r ** np.maximum(p - 1, 0) * s**q, q * r**p * s ** np.maximum(q - 1, 0)]
    return [of @ of_monomials for of in wide]


class Surface:
    """Flat pieces of the boundary of a deformable body, for distances and thicknesses.

    Parameters
    ----------
    pieces : ndarray (m, dim)
        Nodes of edges or triangles, in the order in which the body lies to their left, or they are seen anticlockwise.
    x : ndarray (n, dim)
        Places of the nodes [m].
    """

    def __init__(self, pieces, x):
        self.corner = x[pieces]
        self.dim = x.shape[1]
        along = self.corner[:, 1] - self.corner[:, 0]
        if self.dim == 2:
            normal = np.stack([along[:, 1], -along[:, 0]], axis=1)
        else:
            normal = np.cross(along, self.corner[:, 2] - self.corner[:, 0])
        size = np.linalg.norm(normal, axis=1)
        self.corner, normal, size = self.corner[size > 0], normal[size > 0], size[size > 0]
        self.normal = normal / size[:, None]
        self.middle = self.corner.mean(axis=1)
        self.radius = float(np.linalg.norm(self.corner - self.middle[:, None], axis=2).max())
        self.tree = cKDTree(self.middle)

    def near(self, x, within):
        """Gives pairs of places and pieces that may be nearer than a distance.

        Parameters
        ----------
        x : ndarray (n, dim)
            Places [m].
        within : float
            The distance [m].

        Returns
        -------
        tuple of ndarray (p,)
            Numbers of places, and of pieces.
        """
        found = self.tree.query_ball_point(x, within + self.radius)
        counts = np.array([len(of) for of in found], int)
        pieces = np.concatenate([np.zeros(0, int), *(np.asarray(of, int) for of in found)])
        return np.repeat(np.arange(len(x)), counts), pieces

    def distance(self, x, piece):
        """Gives distances of places from pieces.

        Parameters
        ----------
        x : ndarray (p, dim)
            Places [m].
        piece : ndarray (p,)
            A piece for each.

        Returns
        -------
        ndarray (p,)
            Distances [m].
        """
        corner, n = self.corner[piece], self.dim
        ends = [(k, (k + 1) % n) for k in range(n)] if n == 3 else [(0, 1)]
        best = np.full(len(x), np.inf)
        inside = np.ones(len(x), bool)
        for a, b in ends:
            along, away = corner[:, b] - corner[:, a], x - corner[:, a]
            share = np.clip(np.sum(away * along, axis=1) / np.sum(along**2, axis=1), 0, 1)
            best = np.minimum(best, np.linalg.norm(away - share[:, None] * along, axis=1))
            if n == 3:
                inside &= np.sum(np.cross(along, away) * self.normal[piece], axis=1) >= 0
        if n == 3 and len(x):
            height = np.abs(np.sum((x - corner[:, 0]) * self.normal[piece], axis=1))
            best = np.where(inside, np.minimum(best, height), best)
        return best

    def thickness(self, x, normal, most):
        """Gives how thick the body is behind places of its surface.

        Parameters
        ----------
        x : ndarray (n, dim)
            Places on the surface [m].
        normal : ndarray (n, dim)
            Normals out of the body there.
        most : float
            Greatest thickness that matters [m].

        Returns
        -------
        ndarray (n,)
            Thicknesses [m], infinite above `most`.
        """
        place, piece = self.near(x, most)
        slope = np.sum(-normal[place] * self.normal[piece], axis=1)
        out = slope > 0.1  # pieces by which a ray leaves the body
        place, piece, slope = place[out], piece[out], slope[out]
        corner = self.corner[piece]
        far = np.sum((corner[:, 0] - x[place]) * self.normal[piece], axis=1) / slope
        met = x[place] - far[:, None] * normal[place]
        tiny = 1e-9 * self.radius
        hit = (far > tiny) & (far <= most) & (self._in_plane(met, piece) >= -1e-6 * self.radius)
        found = np.full(len(x), np.inf)
        np.minimum.at(found, place[hit], far[hit])
        return found

    def _in_plane(self, x, piece):
        """Least distance of places of the planes of pieces from their rims, < 0 outside."""
        corner, n = self.corner[piece], self.dim
        least = np.full(len(x), np.inf)
        if n == 2:
            along = corner[:, 1] - corner[:, 0]
            length = np.linalg.norm(along, axis=1)
            at = np.sum((x - corner[:, 0]) * along, axis=1) / length
            return np.minimum(at, length - at)
        for k in range(3):
            along = corner[:, (k + 1) % 3] - corner[:, k]
            within = np.cross(self.normal[piece], along)
            within /= np.linalg.norm(within, axis=1)[:, None]
            least = np.minimum(least, np.sum((x - corner[:, k]) * within, axis=1))
        return least

    def depth(self, x, within):
        """Gives the depth of places in the body.

        Parameters
        ----------
        x : ndarray (n, dim)
            Places [m].
        within : float
            Distance outside up to which it is found [m].

        Returns
        -------
        ndarray (n,)
            Depths [m], < 0 outside, - infinity farther than `within`.
        """
        low, high = self.corner.min(axis=(0, 1)), self.corner.max(axis=(0, 1))
        out = np.full(len(x), -np.inf)
        about = np.flatnonzero(np.all((x > low - within) & (x < high + within), axis=1))
        if not len(about):
            return out
        x = x[about]
        inside = self._inside(x)
        far = self.tree.query(x)[0]  # from a piece, by its radius at most more
        best = np.full(len(x), np.inf)
        for radius in np.unique(np.ceil(far / self.radius)):
            some = np.flatnonzero(np.ceil(far / self.radius) == radius)
            some = some[inside[some] | (far[some] < within + self.radius)]
            place, piece = self.near(x[some], radius * self.radius)
            np.minimum.at(best, some[place], self.distance(x[some][place], piece))
        out[about] = np.where(inside, best, -best)
        return np.where(out < -within, -np.inf, out)

    def _inside(self, x):
        """True for places about which the boundary winds."""
        turns = np.zeros(len(x))
        for first in range(0, len(x), 4096):
            some = slice(first, first + 4096)
            for k in range(0, len(self.corner), 512):
                r = self.corner[None, k : k + 512] - x[some][:, None, None]
                if self.dim == 2:
                    a, b = r[:, :, 0], r[:, :, 1]
                    angle = np.arctan2(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0], np.sum(a * b, axis=-1))
                    turns[some] += angle.sum(axis=1) / (2 * np.pi)
                    continue
                a, b, c = r[:, :, 0], r[:, :, 1], r[:, :, 2]  # Van Oosterom & Strackee (1983)
                la, lb, lc = (np.linalg.norm(v, axis=-1) for v in (a, b, c))
                top = np.sum(a * np.cross(b, c), axis=-1)
                below = la * lb * lc + np.sum(a * b, -1) * lc + np.sum(b * c, -1) * la + np.sum(c * a, -1) * lb
                turns[some] += 2 * np.arctan2(top, below).sum(axis=1) / (4 * np.pi)
        return turns > 0.5


def flat_pieces(body):
    """Gives the boundary of a body as edges or triangles.

    Parameters
    ----------
    body : object
        A deformable body.

    Returns
    -------
    ndarray (m, dim)
        Nodes of each.
    """
    if body.dim == 2:
        return body.boundary_edges()
    faces = body.boundary_faces()
    if faces.shape[1] == 3:
        return faces
    wide = faces[:, 3] >= 0
    return np.concatenate([faces[:, :3], faces[wide][:, [0, 2, 3]]])


def skin_of(body, name, spacing, reach):
    """Points in layers below the sides of a deformable body at its start.

    Parameters
    ----------
    body : object
        A deformable body.
    name : str
        Its name, for messages.
    spacing : float
        Distance of the points [m].
    reach : float
        Depth up to which there are points [m].

    Returns
    -------
    dict
        "node" (n, k), "weight", "along", "across" (n, k), "depth", "volume", "behind", "size" (n,); "thickness", the least of
        the body, infinite beyond twice the reach [m].

    Raises
    ------
    ValueError
        If the sides of the body are not known.
    """
    try:
        sides = boundary_sides(body)
    except UnknownCellsError as wrong:
        raise ValueError(
            f"the fluid meets the sides of {name!r}: {wrong}; or Scene.interact(fluid, {name!r}, None), and it flows through"
        ) from None
    x, dim = body.points, body.dim
    feet = _thinned([_feet(of, x, dim, spacing) for of in _by_nodes(sides)], spacing, dim)
    surface = Surface(flat_pieces(body), x)
    thick = surface.thickness(feet["place"], feet["normal"], 2 * reach)
    rows, depths = [], []
    for k in range(int(np.ceil(reach / spacing))):
        depth = (k + 0.5) * spacing
        place = feet["place"] - depth * feet["normal"]
        near, piece = surface.near(place, depth)
        angle = np.sum(feet["normal"][near] * surface.normal[piece], axis=1)
        beside = (angle > OPPOSITE) & (angle < ALIKE)  # at an edge a point belongs to the nearest side
        far = surface.distance(place[near[beside]], piece[beside])
        nearest = np.full(len(place), np.inf)
        np.minimum.at(nearest, near[beside], far)
        kept = nearest >= 0.999 * np.minimum(depth, np.maximum(thick - depth, 0))
        rows.append(np.flatnonzero(kept))
        depths.append(np.full(kept.sum(), depth))
    rows, depth = np.concatenate(rows), np.concatenate(depths)
    normal, thick = feet["normal"][rows], thick[rows]
    place = feet["place"][rows] - depth[:, None] * normal
    crowd = np.ones(len(rows))  # points of two sides in one place share its volume
    pairs = cKDTree(place).query_pairs(0.5 * spacing, output_type="ndarray").reshape(-1, 2)
    pairs = pairs[np.sum(normal[pairs[:, 0]] * normal[pairs[:, 1]], axis=1) > OPPOSITE]
    share = 1 - np.linalg.norm(place[pairs[:, 0]] - place[pairs[:, 1]], axis=1) / (0.5 * spacing)
    across = np.sum(normal[pairs[:, 0]] * normal[pairs[:, 1]], axis=1) < ALIKE
    for column in pairs[across].T:
        np.add.at(crowd, column, share[across])
    behind = np.where(np.isfinite(thick), np.where(depth <= 0.5 * thick, 0.75, 0.25) * np.where(np.isfinite(thick), thick, 0), 0)
    out = {name: feet[name][rows] for name in ("node", "weight", "along", "across", "size")}
    out |= {"depth": depth, "volume": feet["area"][rows] * spacing / crowd}
    out["behind"] = np.where(np.isfinite(thick), behind, UNBOUNDED)
    out["thickness"] = np.min(thick, initial=np.inf)
    return out


def _by_nodes(sides):
    """Arrays (m, k) of sides without places that are empty."""
    for part in sides:
        part = np.asarray(part, int)
        wide = part[:, -1] >= 0
        for some in (part[wide], part[~wide][:, :-1]):
            if len(some):
                yield some


def _feet(sides, x, dim, spacing):
    """Feet of points on sides (m, k) of one form: a lattice of a spacing on each."""
    count = sides.shape[1]
    triangles = dim == 3 and count in (3, 6)
    centre = np.full((1, dim - 1), 1 / 3 if triangles else 0.0)
    _, along, across = shapes_and_slopes(dim, count, centre)
    g, f = (np.einsum("a,nak->nk", of[0], x[sides]) for of in (along, across))
    if dim == 2:
        many = np.stack([np.linalg.norm(2 * g, axis=1) / spacing], axis=1)
    elif triangles:
        many = np.stack([np.sqrt(0.5 * np.linalg.norm(np.cross(g, f), axis=1)) / spacing], axis=1)
    else:
        many = np.stack([np.linalg.norm(2 * v, axis=1) / spacing for v in (g, f)], axis=1)
    many = np.maximum(1, np.round(many).astype(int))
    parts = []
    for pattern in np.unique(many, axis=0):
        some = sides[np.all(many == pattern, axis=1)]
        at = _triangle_parts(pattern[0]) if triangles else _lattice(pattern)
        share = (0.5 if triangles else 2.0 ** (dim - 1)) / len(at)
        shape, along, across = shapes_and_slopes(dim, count, at)
        place, g, f = (np.einsum("pa,nak->npk", of, x[some]).reshape(-1, dim) for of in (shape, along, across))
        base = np.stack([g[:, 1], -g[:, 0]], axis=1) if dim == 2 else np.cross(g, f)
        size = np.linalg.norm(base, axis=1)
        many_sides = len(some)
        rows = {"node": np.repeat(some, len(at), axis=0), "place": place, "size": size, "area": size * share}
        rows["normal"] = base / np.maximum(size, 1e-300)[:, None]
        rows |= {name: np.tile(of, (many_sides, 1)) for name, of in zip(("weight", "along", "across"), (shape, along, across))}
        parts.append({name: of[size > 0] for name, of in rows.items()})
    return _joined(parts)


def _joined(parts):
    """Feet of several forms in one table, padded to the most nodes."""
    most = max(part["node"].shape[1] for part in parts)
    wide = ("node", "weight", "along", "across")
    return {
        name: np.concatenate(
            [np.pad(p[name], ((0, 0), (0, most - p[name].shape[1]))) if name in wide else p[name] for p in parts]
        )
        for name in parts[0]
    }


def _lattice(many):
    axes = [2 * (np.arange(n) + 0.5) / n - 1 for n in many]
    return np.stack([a.ravel() for a in np.meshgrid(*axes, indexing="ij")], axis=1)


def _triangle_parts(n):
    """Centroids of the n * n equal parts of the parent triangle."""
    i, j = (a.ravel() for a in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    up, down = i + j < n, i + j < n - 1
    of_up, of_down = np.stack([i[up], j[up]], 1) + 1 / 3, np.stack([i[down], j[down]], 1) + 2 / 3
    return np.concatenate([of_up, of_down]) / n


def _thinned(parts, spacing, dim):
    """Feet of which one stands for its neighbours, where cells are much finer than the spacing."""
    feet = _joined(parts)
    if np.median(feet["area"]) > (0.6 * spacing) ** (dim - 1):
        return feet
    main = np.argmax(np.abs(feet["normal"]), axis=1)
    side = 2 * main + (np.take_along_axis(feet["normal"], main[:, None], 1)[:, 0] > 0)
    cell = np.floor(feet["place"] / (0.9 * spacing)).astype(np.int64)
    _, which = np.unique(np.column_stack([cell, side]), axis=0, return_inverse=True)
    which = which.ravel()
    area = np.bincount(which, feet["area"])
    centre = np.stack([np.bincount(which, feet["area"] * of) for of in feet["place"].T], axis=1) / area[:, None]
    off = np.linalg.norm(feet["place"] - centre[which], axis=1)
    order = np.lexsort((off, which))
    first = order[np.searchsorted(which[order], np.arange(len(area)))]
    return {name: of[first] for name, of in feet.items()} | {"area": area}
