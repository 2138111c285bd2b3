"""Groups of nodes, sides with their materials, and bodies whose matrices or forces come from another code."""

from __future__ import annotations

import numpy as np

from ..base import checks
from ..base.materials import Material
from ..names import listed
from . import bodies


class GivenBody:
    """Base of bodies with matrices or forces from another code: M (n dim, n dim) [kg], boundary edges and faces as given."""

    def nodal_mass(self):
        """Sum of the row of each node along the first axis, (n,) [kg]."""
        return np.asarray(self.M.sum(axis=1)).reshape(-1, self.dim)[:, 0]

    def _sides(self, name, given, widths):
        """Checked edges or faces (m, k), k in widths, -1 for the fourth node of a triangle; None if not given."""
        if given is None:
            return None
        sides = np.asarray(given)
        if sides.ndim == 1 and sides.size % 2 == 0:
            sides = sides.reshape(-1, 2)
        if sides.size == 0:
            return np.zeros((0, widths[0]), int)
        if sides.ndim != 2 or sides.shape[1] not in widths:
            raise ValueError(f"{name} have shape {sides.shape}: give nodes (m, {' | '.join(str(w) for w in widths)})")
        lowest = np.where(np.arange(sides.shape[1]) < 3, 0, -1)
        wrong = ~((sides >= lowest) & (sides < len(self.points)) & (sides == np.floor(sides)))
        if np.any(wrong):
            m, k = np.argwhere(wrong)[0]
            raise ValueError(f"{name}[{m}, {k}] is {sides[m, k]}: give numbers of the {len(self.points)} nodes, from 0")
        return sides.astype(int)

    def boundary_edges(self):
        """Edges (m, 2) of the boundary, the body on their left."""
        if self.edges is None:
            raise ValueError(f"the edges of this body are not known: give edges=(m, 2) to {type(self).__name__}")
        return self.edges

    def boundary_faces(self):
        """Faces (m, 3 | 4) of the boundary, anticlockwise from outside."""
        if self.faces is None:
            raise ValueError(f"the faces of this body are not known: give faces=(m, 3 | 4) to {type(self).__name__}")
        return self.faces


BOUNDARY = "boundary"  # the group of all nodes on the boundary, unless a mesh has another one of that name


def boundary_nodes(body):
    """Numbers of the nodes on the boundary of a body, ascending."""
    sides = np.ravel(body.boundary_edges() if body.dim == 2 else body.boundary_faces())
    return np.unique(sides[sides >= 0])


def group_nodes(body, group, field="a group of nodes"):
    """Numbers of the nodes of a group, by its name or as given. field: that gives it, in errors. Raises ValueError for an unknown
    name, and for a node that the mesh has not."""
    if not isinstance(group, str):
        return checks.node_numbers(field, group, len(body.points))
    has_sides = hasattr(body, "boundary_edges")
    if group == BOUNDARY and group not in body.groups and has_sides:
        return boundary_nodes(body)
    if group not in body.groups:
        more = "" if len(body.groups) else ": give the body groups={name: numbers of nodes}"
        names = [*body.groups, *([BOUNDARY] if has_sides else [])]
        raise ValueError(f"there is no group {group!r} in the mesh; there are {listed(names, group)}{more}")
    return body.groups[group]


def rows_by_material(field, material, count):
    """[(material, rows (k,))] of points or sides. material: a Material for all of them, or a list of `count`."""
    if not isinstance(material, (list, tuple)):
        return [(material, np.arange(count))] if count else []
    if len(material) != count:
        raise ValueError(f"{field} lists {len(material)} materials: give one for all, or one for each of the {count}")
    found = {}
    for row, of in enumerate(material):
        if not isinstance(of, Material):
            raise ValueError(f"{field} of {row} is {of!r}: give a cairn.Material")
        found.setdefault(of.name, (of, []))[1].append(row)
    return [(of, np.array(rows)) for of, rows in found.values()]


def part_set(dim, contactors, what, d):
    """A set without bodies, of contactors on points, edges or faces of a mesh."""
    none = np.zeros((0, dim))
    return bodies.checked(
        bodies.BodySet(
            dim, none, none[:, 0], np.zeros((0, 2 * dim - 3)), contactors, group=f"{d.name} {what}", mesh=d,
            parts=sum(len(c.body) for c in contactors),
        )
    )  # fmt: skip
