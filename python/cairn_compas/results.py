"""Results of a simulation as compas_dem keeps them: moved blocks, contact points with forces, unbalanced force ratio."""

from __future__ import annotations

import numpy as np
from compas.geometry import Frame, Line, Point, Polygon, Transformation
from compas_dem.interactions import EdgeContact, FrictionContact, VertexContact
from compas_dem.problem import Results

STATUS = ("noctc", "stick", "slide", "bonded", "softening")  # of the kernels' numbers: open, stick, slip, bonded, softening


class Contacts:
    """Contacts between blocks at the last step, the first block of each being that of the smaller number.

    Parameters
    ----------
    built : Built
        The problem as a simulation.
    """

    def __init__(self, built):
        c = built.simulation.contacts
        bodies = np.asarray(c.bodies).reshape(-1, 2)
        rows = built.owner[bodies]
        swap = rows[:, 0] > rows[:, 1]
        sign = np.where(swap, -1.0, 1.0)[:, None]
        self.rows = np.where(swap[:, None], rows[:, ::-1], rows)
        self.force = np.asarray(c.force) * sign  # on the first block [N]
        self.normal = np.asarray(c.normal) * sign  # towards the first block
        self.point = np.asarray(c.point) + built.simulation.scene.origin
        self.gap, self.status = np.asarray(c.gap), np.asarray(c.status)
        self.beta = c.of_laws().get("beta") if built.law.bonds else None

    def net(self, count):
        """Sums of forces on each block.

        Parameters
        ----------
        count : int
            Number of blocks.

        Returns
        -------
        ndarray (count, 3)
            Forces [N].
        """
        out = np.zeros((count, 3))
        np.add.at(out, self.rows[:, 0], self.force)
        np.subtract.at(out, self.rows[:, 1], self.force)
        return out


def unbalanced_force_ratio(built, contacts=None):
    """Unbalanced force ratio: sum of net forces of blocks over the sum of loads and contact forces.

    Loads are those of this time, weights included. Directions in which a block is held or driven count in no sum of net forces,
    since the reaction there is no contact force.

    Parameters
    ----------
    built : Built
        The problem as a simulation after a step.
    contacts : Contacts, optional
        Its contacts.

    Returns
    -------
    float
        The ratio [-]: 0 at rest, 1 where blocks fall freely.
    """
    contacts = contacts or Contacts(built)
    loads = built.loads(built.simulation.time)
    held = built.held()
    net = np.where(held, 0.0, loads + contacts.net(len(loads)))
    loads = np.where(held, 0.0, loads)
    total = np.linalg.norm(loads, axis=1).sum() + np.linalg.norm(contacts.force, axis=1).sum()
    return float(np.linalg.norm(net, axis=1).sum() / total) if total > 0 else 0.0


class Motion:
    """Motion of the blocks since it was made.

    Parameters
    ----------
    built : Built
        The problem as a simulation before its first step.
    """

    def __init__(self, built):
        self.built = built
        self.start = self._frames()

    def _frames(self):
        bodies = self.built.simulation.bodies
        row = dict(zip(np.asarray(bodies.id).tolist(), range(len(bodies))))
        out = {}
        for node, number in self.built.bodies.items():
            out[node] = (_matrix(bodies.rotation[row[number]]), np.array(bodies.position[row[number]]))
        return out

    def of_blocks(self):
        """Rigid motions from the start; of deformable blocks those that fit the nodes best (Kabsch 1976).

        Returns
        -------
        dict
            {node of the graph: (rotation (3, 3), shift (3,))}, which take x to rotation x + shift.
        """
        out = {}
        for node, (turn, place) in self._frames().items():
            first, origin = self.start[node]
            rotation = turn @ first.T
            out[node] = rotation, place - rotation @ origin
        for node, k in self.built.meshes.items():
            mesh = self.built.simulation.meshes[k]
            out[node] = _best_fit(mesh.body.points, mesh.body.points + mesh.displacement)
        return out

    def displacement(self, node):
        """Displacement of the centre of mass of a block.

        Parameters
        ----------
        node : int
            Its node of the graph.

        Returns
        -------
        ndarray (3,)
            Displacement [m].
        """
        rotation, shift = self.of_blocks()[node]
        center = next(b.center for b in self.built.blocks if b.node == node)
        return rotation @ center + shift - center


def _matrix(q):
    """Rotation matrix of a quaternion (w, x, y, z)."""
    w, x, y, z = q / np.linalg.norm(q)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])  # fmt: skip


def _best_fit(before, after):
    a, b = before.mean(axis=0), after.mean(axis=0)
    u, _, v = np.linalg.svd((after - b).T @ (before - a))
    rotation = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ v))]) @ v
    return rotation, b - rotation @ a


def results_of(problem, built, motion):
    """Makes the results of the last step.

    Every edge holds the attributes of compas_dem's other back-ends: contact points and their polygon or line, frames whose z is
    the normal towards the first block of the edge, forces along x, y and z (compression positive), gap, status, resultants.
    Coincident contacts, as those of two meshes whose nodes lie on each other, are one point. Cohesive joints add `beta`, 1 sound
    and 0 broken; deformable blocks add `points` [m] and `stress` (cells, 6) [Pa] to their node.

    Parameters
    ----------
    problem : compas_dem.problem.Problem
        The problem.
    built : Built
        It as a simulation.
    motion : Motion
        The motion since before the first step.

    Returns
    -------
    compas_dem.problem.Results
        The results; the model stays as it was.
    """
    model = problem.model
    results = Results(model_id=str(model.guid), problem_id=str(problem.guid))
    for node, (rotation, shift) in motion.of_blocks().items():
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = rotation, shift
        results.set_node(node, "transformation", Transformation.from_matrix(matrix.tolist()))
    for node, k in built.meshes.items():
        mesh = built.simulation.meshes[k]
        results.set_node(node, "points", (mesh.body.points + mesh.displacement).tolist())
        results.set_node(node, "stress", np.concatenate([np.asarray(s) for s in mesh.stress.values()]).tolist())
    contacts = Contacts(built)
    nodes = [b.node for b in built.blocks]
    pairs, joint = np.unique(contacts.rows, axis=0, return_inverse=True)
    joint = joint.ravel()
    for k, (a, b) in enumerate(pairs.tolist()):
        edge, at = (nodes[a], nodes[b]), np.flatnonzero(joint == k)
        reverse = not model.graph.has_edge(edge) and model.graph.has_edge(edge[::-1])
        if not reverse and not model.graph.has_edge(edge):
            results.metadata.setdefault("added_edges", []).append(list(edge))
        _write_edge(results, edge[::-1] if reverse else edge, contacts, at, -1.0 if reverse else 1.0)
    return results


def _write_edge(results, edge, contacts, at, sign):
    """Attributes of one edge from the contacts `at` between its blocks."""
    normal, force = sign * contacts.normal[at], sign * contacts.force[at]
    point = contacts.point[at]
    first, owner = _merged(point, np.linalg.norm(force, axis=1))
    force = np.stack([np.bincount(owner, f, len(first)) for f in force.T], axis=1)
    order = _around(point[first], normal[first])
    at, normal, force, point = at[first][order], normal[first][order], force[order], point[first][order]
    frames = [Frame(Point(*p), *_tangents(n)) for p, n in zip(point.tolist(), normal)]
    axes = np.array([[list(f.xaxis), list(f.yaxis), list(f.zaxis)] for f in frames])
    local = np.einsum("nij,nj->ni", axes, force)  # along t1, t2, n
    resultant = force.sum(axis=0)

    def put(name, value):
        results.set_edge(edge, name, value)

    put("contact_points", point.tolist())
    put("gap", contacts.gap[at].tolist())
    put("status", [STATUS[s] for s in contacts.status[at]])
    put("force_tangent1", local[:, 0].tolist())
    put("force_tangent2", local[:, 1].tolist())
    put("force_normal", local[:, 2].tolist())
    put("force_vector", force.tolist())
    put("nodal_force_magnitudes", np.linalg.norm(force, axis=1).tolist())
    put("resultant_global", resultant.tolist())
    put("resultant_local", local.sum(axis=0).tolist())
    put("force_magnitude", float(np.linalg.norm(resultant)))
    put("contact_frames", frames)
    put("contact_frame", frames[0])
    if contacts.beta is not None:
        put("beta", np.asarray(contacts.beta)[at].tolist())
    points = [Point(*p) for p in point.tolist()]
    forces = [{"c_np": max(n, 0.0), "c_nn": max(-n, 0.0), "c_u": u, "c_v": v} for u, v, n in local.tolist()]
    put("face_contact", len(points) >= 3)
    put("edge_contact", len(points) == 2)
    put("point_contact", len(points) == 1)
    if len(points) >= 3:
        put("contact_polygon", Polygon(points))
        contact = FrictionContact(points=points, frame=frames[0])
        contact.forces = forces
    elif len(points) == 2:
        line = Line(*points)
        put("contact_geometry", line)
        contact = EdgeContact(points=points, frame=Frame(line.midpoint, frames[0].xaxis, frames[0].yaxis), forces=forces)
    else:
        put("contact_geometry", points[0])
        contact = VertexContact(point=points[0], frame=frames[0], forces=forces)
    put("contact_data", contact)


def _merged(point, force):
    """Rows of contacts at distinct points, the one of the largest force at each, and the place of every contact among these."""
    near = 1e-6 * np.max(np.ptp(point, axis=0), initial=0.0)
    first, owner = [], np.empty(len(point), int)
    for k in np.argsort(-force, kind="stable"):
        same = [j for j, i in enumerate(first) if np.max(np.abs(point[i] - point[k])) <= near]
        owner[k] = same[0] if same else len(first)
        if not same:
            first.append(k)
    return np.array(first), owner


def _tangents(normal):
    """Two tangents of a frame whose z axis is the normal; they depend on it alone."""
    other = np.eye(3)[np.argmin(np.abs(normal))]
    first = np.cross(other, normal)
    first /= np.linalg.norm(first)
    return first.tolist(), np.cross(normal, first).tolist()


def _around(point, normal):
    """Order of contact points about their middle, anticlockwise seen from the first block."""
    if len(point) < 3:
        return np.arange(len(point))
    x, y = (np.array(t) for t in _tangents(normal.sum(axis=0) / np.linalg.norm(normal.sum(axis=0))))
    away = point - point.mean(axis=0)
    return np.argsort(np.arctan2(away @ y, away @ x), kind="stable")
