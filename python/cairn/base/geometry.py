"""Positions of the contactors of a step, from those of the bodies that carry them."""

import numpy as np

from .errors import told_as_damage


class Contactors:
    """Contactors of a step in space.

    `body` rows of the bodies in the arrays of the step (m,), `center` (m, dim) [m], `radius` (m,) [m], `shape` (m,)
    names, `direction` (m, dim) unit vectors in space and `half` half lengths (m,) [m], zero where there are none; `joint` (m,)
    the joint that each is an end of, -1 for none, None where the file does not tell.
    """

    def __init__(self, body, shape, center, radius, direction, half, joint=None):
        self.body, self.shape, self.center, self.radius = body, shape, center, radius
        self.direction, self.half, self.joint = direction, half, joint

    def __len__(self):
        return len(self.body)

    def select(self, *shapes):
        """Contactors of the given shapes."""
        return self.where(np.isin(self.shape, shapes))

    def where(self, keep):
        """Contactors whose keep (m,) is true."""
        columns = (self.body, self.shape, self.center, self.radius, self.direction, self.half)
        return Contactors(*(a[keep] for a in columns), None if self.joint is None else self.joint[keep])


def turn(rotation, vectors, dim):
    """Vectors (m, dim) turned by angles (m,) in 2D, by quaternions (w, x, y, z), body to space, (m, 4) in 3D."""
    if dim == 2:
        c, s = np.cos(rotation), np.sin(rotation)
        return np.stack([c * vectors[:, 0] - s * vectors[:, 1], s * vectors[:, 0] + c * vectors[:, 1]], axis=1)
    w, axis = rotation[:, :1], rotation[:, 1:]
    t = 2.0 * np.cross(axis, vectors)
    return vectors + w * t + np.cross(axis, t)


def contactors_of(step):
    """The contactors of a step: those of /cairn/scene whose body is still there, and for bodies that came later a disk
    or sphere of their radius, if they have one."""
    with told_as_damage(step.run.path):
        return _contactors_of(step)


def _contactors_of(step):
    table, dim = step.run.scene.get("contactors") or {}, step.dim
    bodies, position = step.drawn, step.drawn["position"]
    n = len(bodies)
    ids = np.asarray(bodies["id"]) if "id" in bodies else np.arange(n)
    owner = np.atleast_1d(np.asarray(table.get("body", []), dtype=np.int64))
    names = _shape_names(table, step.run.scene, len(owner))
    order = np.argsort(ids, kind="stable")
    at = np.minimum(np.searchsorted(ids, owner, sorter=order), max(n - 1, 0))
    there = ids[order[at]] == owner if n else np.zeros(len(owner), bool)
    row = order[at[there]] if n else np.empty(0, np.int64)

    def column(name, width):
        value = np.asarray(table.get(name, ()), dtype=float)
        return value[there] if len(value) == len(owner) and len(owner) else np.zeros((len(row), width))

    offset, direction = column("offset", dim), column("direction", dim + 1)
    if "rotation" in bodies:
        rotation = bodies["rotation"][row]
        offset = turn(rotation, offset, dim)
        direction = np.concatenate([turn(rotation, direction[:, :dim], dim), direction[:, dim:]], axis=1)
    length = np.linalg.norm(direction[:, :dim], axis=1, keepdims=True)
    direction[:, :dim] /= np.where(length > 0, length, 1.0)
    radius = np.asarray(table.get("radius", np.zeros(len(owner))), dtype=float)
    made = [row, names[there], position[row] + offset, radius[there], direction[:, :dim], direction[:, dim]]
    made = [np.concatenate([a, b]) for a, b in zip(made, _edges_of_meshes(table, names, radius, ids, position, dim), strict=True)]
    new = np.setdiff1d(np.arange(n), row)
    if len(new) and "radius" in bodies:
        new = new[bodies["radius"][new] > 0]
        extra = [
            new,
            np.full(len(new), "disk" if dim == 2 else "sphere"),
            position[new],
            bodies["radius"][new],
            np.zeros((len(new), dim)),
            np.zeros(len(new)),
        ]
        made = [np.concatenate([a, b]) for a, b in zip(made, extra, strict=True)]
    joint = None
    if len(stated := np.atleast_1d(np.asarray(table.get("joint", []), dtype=np.int64))) == len(owner) > 0:
        joint = np.concatenate([stated[there], np.full(len(made[0]) - len(row), -1)])
    return Contactors(*made, joint)


def rows_of_nodes(table, ids):
    """Mask (m,) of the contactors mapped from several present nodes of a mesh, and the rows of these nodes, (m, 4), filled with
    -1."""
    nodes = np.asarray(table.get("nodes", np.zeros((0, 4))), np.int64).reshape(-1, 4)[: None if len(ids) else 0]
    order = np.argsort(ids, kind="stable")
    rows = order[np.minimum(np.searchsorted(ids, nodes, sorter=order), len(ids) - 1)]
    there = (nodes < 0) | (np.asarray(ids)[rows] == nodes)
    kept = np.flatnonzero((nodes[:, 1] >= 0) & there.all(axis=1))
    return kept, np.where(nodes[kept] < 0, -1, rows[kept])


def _edges_of_meshes(table, names, radius, ids, position, dim):
    """Edges in 2D, where their nodes are; inside their body by their radius."""
    which, rows = rows_of_nodes(table, ids)
    edges = names[which] == "segment"
    which, (one, two) = which[edges], rows[edges][:, :2].T
    along = position[two] - position[one]
    length = np.linalg.norm(along, axis=1)
    along = along / length[:, None]
    inward = np.stack([-along[:, 1], along[:, 0]], axis=1) if dim == 2 else np.zeros_like(along)
    center = (position[one] + position[two]) / 2 + radius[which][:, None] * inward
    return one, names[which], center, radius[which], along, length / 2


def _shape_names(table, scene, count):
    if "shape_number" in table and "shapes" in scene:
        return np.asarray(scene["shapes"])[np.asarray(table["shape_number"], dtype=np.int64)]
    shape = np.asarray(table.get("shape", []))
    return shape if len(np.atleast_1d(shape)) == count and shape.ndim else np.full(count, "disk")


def lever_arms(step):
    """From the centres of both bodies to each contact point: rows (m,) of A and B, arms (m, dim) [m] of A and B.

    Across a periodic boundary, where the centre is not near the point, the arm of a round body is its radius and half the
    gap along the normal, which is exact; that of another body is the shortest of its images.
    """
    cell = cell_of(step)
    contacts, position = step.contacts, step.drawn["position"]
    radius = step.drawn["radius"] if "radius" in step.drawn else np.zeros(len(position))
    rows, arms = [], []
    for name, sign in (("body_a", -1.0), ("body_b", 1.0)):
        row = step.rows_of(contacts[name])
        arm = contacts["point"] - position[row]
        reach = radius[row] + contacts["gap"] / 2
        far = (radius[row] > 0) & (np.linalg.norm(arm, axis=1) > 1.5 * radius[row] + np.abs(contacts["gap"]))
        arm[far] = sign * reach[far, None] * contacts["normal"][far]
        if cell is not None:
            arm[radius[row] == 0] = nearest_image(arm[radius[row] == 0], cell)
        rows.append(row)
        arms.append(arm)
    return (*rows, *arms)


class Cell:
    """A periodic cell at the time of an output: corner (dim,) [m], vectors (dim, dim) by rows [m], of which the last may lean
    along the first, and periodic (dim,) of bool."""

    def __init__(self, corner, vectors, periodic):
        self.corner, self.vectors, self.periodic = corner, vectors, periodic
        self.axes = np.flatnonzero(periodic)[::-1]  # that which leans first
        self.lengths = np.where(periodic, np.diagonal(vectors), np.inf)


def cell_of(step):
    """The Cell of an output; None where the scene has none."""
    stated = step.run.periodic
    if stated is None:
        return None
    dim = step.dim
    vectors, periodic = np.array(stated["vectors"])[:dim, :dim], np.array(stated["periodic"], bool)[:dim]
    vectors = vectors + step.time * vectors @ np.array(stated["velocity_gradient"])[:dim, :dim].T
    if not periodic.any():
        return None
    return Cell(np.array(stated["corner"])[:dim], vectors, periodic)


def nearest_image(x, cell):
    """Periodic image of each x (n, dim) [m] nearest to zero along every periodic axis."""
    for k in cell.axes:
        x = nearest_along(x, cell, k)
    return x


def images_about(x, middle, cell):
    """Images of x (n, dim) [m] within one cell and a half of `middle` (dim,) along each axis that repeats: arrays as x."""
    some = [np.asarray(x, dtype=float) - middle]
    for k in cell.axes:
        some = [nearest_along(y, cell, k) + turn * cell.vectors[k] for y in some for turn in (-1, 0, 1)]
    return [middle + y for y in some]


def nearest_along(x, cell, k):
    return x - np.round(x[:, k] / cell.lengths[k])[:, None] * cell.vectors[k]
