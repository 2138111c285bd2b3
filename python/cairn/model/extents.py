"""Sizes of bodies in their current position, for checks of initial overlaps and of the width of a periodic cell."""

import functools

import numpy as np

from .. import _core
from ..base.geometry import turn

HULLS = _core.shapes("hull", "mover")
THINNEST = 2.0**-10  # half width of a hull over its reach below which it counts as a sliver, whose width is rounding
PLAIN = sorted(set(_core.shapes("bounded")) - set(_core.shapes("hull")))


class Placed:
    """Contactors of rigid bodies in a core scene: `shape` (m,) names, `owner` (m,) row of the body in the order of insertion.

    Names take more memory than all else that a scene has of a body: they are made for those who ask."""

    def __init__(self, core):
        self.core, self.dim = core, core.dim
        self.ids = core.body("id")
        carriers = core.carriers()
        self.kept = np.flatnonzero(np.isin(carriers, self.ids))
        self._code = self.field("shape")
        self.owner = np.searchsorted(self.ids, carriers[self.kept])
        self.hulls = core.hulls
        hull = self.field("hull")
        self.hull = hull if len(hull) == len(self.owner) else np.full(len(self.owner), -1)

    @functools.cached_property
    def shape(self):
        """Names of shapes (m,)."""
        return np.array(_core.shapes())[self._code]

    def of_kind(self, *names):
        """Mask (m,) of contactors of these shapes."""
        return np.isin(self._code, [code for code, name in enumerate(_core.shapes()) if name in names])

    def field(self, name):
        """A field of the contactors; empty if the scene has no such field."""
        values = self.core.contactor(name)
        return values[self.kept] if len(values) else values

    def vertices(self, hull):
        first = self.hulls["first_vertex"]
        return np.reshape(self.hulls["vertex"], (-1, self.dim))[first[hull] : first[hull + 1]]

    def planes(self, hull):
        """Normals (f, dim) and offsets (f,) [m] of the faces of a hull; for a round shape its axes, radii and exponents."""
        first = self.hulls["first_face"]
        mine = slice(first[hull], first[hull + 1])
        return np.reshape(self.hulls["normal"], (-1, self.dim))[mine], self.hulls["offset"][mine]

    def half_width(self, shape, hull):
        """Half of the least width of a hull, across its faces or along its axes [m]."""
        normal, offset = self.planes(hull)
        if shape in ("polygon", "polyhedron"):
            x = self.vertices(hull)
            return max(np.min(offset - (x @ normal.T).min(axis=0)) / 2, THINNEST * np.linalg.norm(x, axis=1).max())
        if shape == "superquadric":
            return offset[:3].min()
        return offset[0] if shape == "capsule" else min(offset[0], np.linalg.norm(self.vertices(hull), axis=1).max())

    def sizes(self, bodies):
        """Half the least width [m] of the largest hull of the given bodies, (n,) over all bodies; zero for the others."""
        out = np.zeros(len(self.ids))
        wanted = np.zeros(len(self.ids), bool)
        wanted[bodies] = True
        mine = np.flatnonzero(self.of_kind(*HULLS) & wanted[self.owner])
        kinds, which = np.unique(self.hull[mine], return_inverse=True)
        name = dict(zip(self.hull[mine], np.array(_core.shapes())[self._code[mine]]))
        widths = np.array([self.half_width(name[h], h) for h in kinds])
        np.maximum.at(out, self.owner[mine], widths[which] if len(mine) else [])
        return out

    def bounds(self):
        """Lowest and highest coordinates (n, dim) [m] of each body from its centre of mass, without walls; inf, -inf for a body
        without a bounded contactor.

        Superquadrics count by the ends of their half axes, which underestimates them if they are rotated or box-like.
        """
        m, dim, core = len(self.owner), self.dim, self.core
        rotation = core.body("rotation")
        turned = len(rotation) == len(self.ids)

        def in_space(rows, x):
            return turn(rotation[self.owner[rows]], x, dim) if turned else x

        offset = self.field("offset")
        centre = in_space(np.arange(m), np.reshape(offset, (m, dim))) if len(offset) else np.zeros((m, dim))
        half = np.zeros((m, dim))
        round_ = np.isin(self.shape, PLAIN)
        half[round_] = self.field("radius")[round_, None]
        bars = np.flatnonzero(self.of_kind("segment"))
        if len(bars):
            along = np.reshape(self.field("direction"), (m, dim + 1))[bars]
            half[bars] += np.abs(in_space(bars, along[:, :dim])) * along[:, dim:]
        low, high = centre - half, centre + half
        for k in np.flatnonzero(np.isin(self.shape, HULLS)):
            x = self._points(self.shape[k], self.hull[k])
            x = in_space(np.full(len(x), k), x)
            more = self._around(self.shape[k], self.hull[k], x)
            low[k], high[k] = centre[k] + x.min(axis=0) - more, centre[k] + x.max(axis=0) + more
        lowest, highest = np.full((len(self.ids), dim), np.inf), np.full((len(self.ids), dim), -np.inf)
        bounded = round_ | np.isin(self.shape, HULLS)
        np.minimum.at(lowest, self.owner[bounded], low[bounded])
        np.maximum.at(highest, self.owner[bounded], high[bounded])
        return lowest, highest

    def _points(self, shape, hull):
        if shape != "superquadric":
            return self.vertices(hull)
        axes = np.diag(self.planes(hull)[1][:3])
        return np.concatenate([axes, -axes])

    def _around(self, shape, hull, ends):
        """Extent of a round shape beyond its axis along the coordinates, (dim,) [m]."""
        if shape not in ("capsule", "cylinder"):
            return 0.0
        radius, axis = self.planes(hull)[1][0], ends[1] - ends[0]
        if shape == "capsule":
            return radius
        return radius * np.sqrt(np.maximum(0.0, 1 - (axis / np.linalg.norm(axis)) ** 2))


def refuse_narrow_cell(core, periodic, vectors, meshes=()):
    """Raises ValueError if a body is wider than the periodic cell and so overlaps its own image. meshes: (name, places of the
    nodes (n, dim) [m]) of deformable bodies."""
    axes = [k for k in range(core.dim) if periodic[k]]
    if not axes:
        return
    placed = Placed(core)
    low, high = placed.bounds()
    names = [f"body {i}" for i in placed.ids]
    for name, nodes in meshes:
        if len(nodes):
            names.append(f"the mesh {name!r}")
            low, high = np.vstack([low, np.min(nodes, axis=0)]), np.vstack([high, np.max(nodes, axis=0)])
    for k in axes:
        width = high[:, k] - low[:, k]
        rounding = 16 * np.finfo(float).eps * np.maximum(np.abs(high[:, k]), np.abs(low[:, k]))
        wide = np.flatnonzero(width - vectors[k][k] > rounding)
        if len(wide):
            i = wide[np.argmax(width[wide])]
            raise ValueError(
                f"lengths[{k}] of the periodic cell is {vectors[k][k]:g} m and {names[i]} is {width[i]:g} m wide "
                f"along {'xyz'[k]}, so that it lies in its own image: give a cell at least as wide as every body"
            )
