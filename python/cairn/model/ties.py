"""Mortar ties between meshes, and rigid parts of a mesh: slave dofs that follow master dofs.

both = cn.tied({"hub": steel, "tread": rubber}, [("tread.inside", "hub.outside")])
scene.add(cn.deformable(both, material, rigid="hub.all", contact="tread.outside"))
"""

from __future__ import annotations

import numpy as np

from ..base import checks
from . import side_shapes
from .elastic import ElasticBody
from .initial_stress import linear_blocks
from .mesh_parts import group_nodes
from .solid import SolidBody
from .tied_faces import check_covered, dual_weights

GAUSS = np.array([-np.sqrt(0.6), 0.0, np.sqrt(0.6)]), np.array([5.0, 8.0, 5.0]) / 18


class TiedBody(ElasticBody):
    """Several finite element bodies (ElasticBody, SolidBody) joined to a single body by ties of their sides; see `tied`.

    Nodes, and cells of each kind, are those of the parts in their order; groups are "part.group" and "part.all". first: {part:
    number of its first node}.
    """

    def __init__(self, parts, ties, within=1e-6):
        #: arguments of the constructor, which scene files store
        self.given = {name: value for name, value in locals().items() if name not in ("self", "__class__")}
        if checks.number("within of tied", within) < 0:
            raise ValueError(f"within of tied is {within!r}: give a finite number from 0 on")
        if not isinstance(parts, dict) or len(parts) < 2:
            raise ValueError("parts is no dict of two bodies or more: give {name: body}")
        for name, part in parts.items():
            if not isinstance(part, ElasticBody) or isinstance(part, TiedBody):
                raise ValueError(f"part {name!r} is a {type(part).__name__}: give an ElasticBody or a SolidBody")
        bodies = list(parts.values())
        for what in ("dim", "plane", "thickness"):
            found = {name: getattr(part, what) for name, part in parts.items()}
            if len(set(found.values())) > 1:
                raise ValueError(f"parts differ in {what}, {found}: make them of one")
        self.parts, first = dict(parts), bodies[0]
        self.dim, self.plane, self.thickness = first.dim, first.plane, first.thickness
        count = np.cumsum([0, *(len(part.points) for part in bodies)])
        self.first = dict(zip(parts, count[:-1].tolist()))
        self.points = np.concatenate([part.points for part in bodies])
        self.groups = {
            f"{name}.{group}": nodes + self.first[name]
            for name, part in parts.items()
            for group, nodes in {**part.groups, "all": np.arange(len(part.points))}.items()
        }
        self.cells, self._rows = {}, []  # rows of each part among the cells of a kind
        for part, start in zip(bodies, count):
            rows = {}
            for kind, nodes in part.cells.items():
                known = self.cells.get(kind, np.zeros((0, nodes.shape[1]), int))
                rows[kind] = np.arange(len(known), len(known) + len(nodes))
                self.cells[kind] = np.concatenate([known, nodes + start])
            self._rows.append(rows)
        self._mass = np.concatenate([part._mass for part in bodies])
        self.second_order = any(part.second_order for part in bodies)
        starts = [part.lower[0] for part in bodies]
        entries = np.cumsum([0, *(s[-1] for s in starts)])
        start = np.concatenate([np.zeros(1, int), *(s[1:] + e for s, e in zip(starts, entries))])
        row = np.concatenate([part.lower[1] + self.dim * n for part, n in zip(bodies, count)])
        self.lower = start, row, *(np.concatenate([part.lower[k] for part in bodies]) for k in (2, 3, 4))
        if any(isinstance(part, SolidBody) for part in bodies):
            self.blocks, self.layout, self.kinematics = self._blocks, self._layout, _kinematics(bodies)
        elif any(part.initial_force is not None for part in bodies):
            none = [np.zeros(part.points.size) for part in bodies]
            forces = [zero if part.initial_force is None else part.initial_force for part, zero in zip(bodies, none)]
            self.initial_force, self.initial_energy = np.concatenate(forces), sum(part.initial_energy for part in bodies)
        self.ties = node_ties(self, ties, within)

    def _blocks(self):
        return [
            {**block, "nodes": (block["nodes"] + start).astype(np.int32)}
            for part, start in zip(self.parts.values(), self.first.values())
            for block in (part.blocks() if isinstance(part, SolidBody) else linear_blocks(part))
        ]

    def _layout(self):
        """[(kind of cells, rows in that kind, material)] of the blocks."""
        out = []
        for part, rows in zip(self.parts.values(), self._rows):
            own = part.layout() if isinstance(part, SolidBody) else [(kind, np.arange(len(rows[kind])), None) for kind in rows]
            out += [(kind, rows[kind][of], material) for kind, of, material in own]
        return out

    def stress(self, displacement):
        """Stress in the middle of each cell by kinds of cells [Pa], in the order of ElasticBody.stress if all parts are linear,
        else of SolidBody.stress."""
        u = np.asarray(displacement, float).reshape(self.points.shape)
        wide = hasattr(self, "blocks")
        out = {kind: np.zeros((len(nodes), 6 if wide else 3 * self.dim - 3)) for kind, nodes in self.cells.items()}
        for part, start, rows in zip(self.parts.values(), self.first.values(), self._rows):
            for kind, found in part.stress(u[start : start + len(part.points)]).items():
                columns = [0, 1, 3] if found.shape[1] < out[kind].shape[1] else range(out[kind].shape[1])
                out[kind][np.ix_(rows[kind], columns)] = found
        return out

    def stress_across(self, stress):
        """Out-of-plane stress zz by kinds of cells [Pa], for linear parts; as ElasticBody.stress_across."""
        out = {kind: np.zeros(len(nodes)) for kind, nodes in self.cells.items()}
        for part, rows in zip(self.parts.values(), self._rows):
            for kind, found in part.stress_across({kind: stress[kind][of] for kind, of in rows.items()}).items():
                out[kind][rows[kind]] = found
        return out

    def free_motion(self):
        """Matrix (n dofs, independent dofs) of the displacements that ties allow, and the numbers of the independent dofs."""
        from scipy import sparse

        nodes, start, leaders, weight = self.ties
        n, dim = len(self.points), self.dim
        free = np.setdiff1d(np.arange(n), nodes)
        place = np.full(n, -1)
        place[free] = np.arange(len(free))
        row = np.concatenate([free, np.repeat(nodes, np.diff(start))])
        column = np.concatenate([place[free], place[leaders]])
        t = sparse.coo_array((np.concatenate([np.ones(len(free)), weight]), (row, column)), (n, len(free)))
        return sparse.kron(t, sparse.eye_array(dim)).tocsc(), (dim * free[:, None] + np.arange(dim)).ravel()

    def solve(self, fixed, force=None, displacement=None):
        """Displacement in static equilibrium (n, dim) [m], as ElasticBody.solve. Raises ValueError if a part is not linear."""
        from scipy.sparse.linalg import spsolve

        if hasattr(self, "blocks"):
            raise ValueError("a tied body with a part of a material of solids has no solve: put it in a scene")
        t, own = self.free_motion()
        held = np.isin(own, self.dofs(fixed))
        u = np.zeros(len(own))
        if displacement is not None:
            u[held] = np.asarray(displacement, float).ravel()[own[held]]
        f = (
            np.zeros(self.points.size)
            if force is None
            else self.load(force)
            if isinstance(force, dict)
            else np.asarray(force, float)
        )
        if self.initial_force is not None:
            f = f.ravel() - self.initial_force
        k = (t.T @ self.K @ t).tocsc()
        u[~held] = spsolve(k[~held][:, ~held], (t.T @ f.ravel() - k @ u)[~held])
        return (t @ u).reshape(-1, self.dim)


def tied(parts, ties, *, within=1e-6):
    """Ties sides of several bodies, which become a single body. parts: {name: ElasticBody or SolidBody}; ties: list of (slave
    group, master group), named "part.group".

    The slave side has the velocity of the master side in a weak sense, by dual mortar multipliers on the common segments, in 3D
    polygons (Wohlmuth 2000). With flat sides and mid-side nodes in the middle, uniform stress passes between cells of first and
    second order of any sizes to rounding. Take the finer side as slave; its group needs all nodes of its sides, those of second
    order too.
    within: largest gap between the sides over the length of the slave edge or the root of the area of the slave face, and width
    of the strip, at most half of the edge or face, by which the slave may extend beyond the end of the master. Uniform stress
    then passes with an error of the order of that strip.
    Raises ValueError naming an edge or face that is not covered by the master, and the share that is missing.
    """
    return TiedBody(parts, ties, within)


def _kinematics(bodies):
    """Kinematics of the parts: "small" if all are small, else the first other."""
    large = [part.kinematics for part in bodies if getattr(part, "kinematics", "small") != "small"]
    return large[0] if large else "small"


def node_ties(body, ties, within):
    """Slave nodes (m,), starts of their rows (m + 1,), master nodes, and weights, whose sum is 1 for each slave."""
    nodes, leaders, weights, counts = [], [], [], []
    for follower, leader in ties:
        made = (_on_edges if body.dim == 2 else _on_faces)(body, follower, leader, within)
        for node, (of, weight) in made.items():
            kept = np.abs(weight) > 1e-14
            nodes.append(node)
            leaders.append(np.asarray(of)[kept])
            weights.append(weight[kept])
            counts.append(int(kept.sum()))
    nodes = np.array(nodes, int)
    leaders, weights = (np.concatenate(part) if part else np.zeros(0, kind) for part, kind in ((leaders, int), (weights, float)))
    if len(np.unique(nodes)) < len(nodes):
        twice = np.sort(nodes)[np.flatnonzero(np.diff(np.sort(nodes)) == 0)[0]]
        raise ValueError(f"ties: node {twice} follows in two of them: leave it out of one of the groups")
    both = np.intersect1d(nodes, leaders)
    if len(both):
        raise ValueError(f"ties: node {both[0]} follows and is followed: let its group lead in all ties, or follow in all")
    return nodes, np.concatenate([[0], np.cumsum(counts)]).astype(int), leaders, weights


def _sides(body, group, what):
    nodes = body.nodes(group)
    sides = body.boundary_edges() if body.dim == 2 else body.boundary_faces()
    kept = sides[(np.isin(sides, nodes) | (sides < 0)).all(axis=1)]
    if not len(kept):
        raise ValueError(f"ties: no side of the boundary has all its nodes in {group!r}, which is to {what}: give whole sides")
    return kept


def _on_edges(body, follower, leader, within):
    """{slave node: (master nodes, weights)} from integrals of dual shape functions over the common segments of edges."""
    x, own, other = body.points, _sides(body, follower, "follow"), _sides(body, leader, "lead")
    own_wholes, other_wholes = side_shapes.wholes(body, own), side_shapes.wholes(body, other)
    side_shapes.check_nodes(own_wholes, body.nodes(follower), follower)
    from_, to = x[other[:, 0]], x[other[:, 1]]
    sides, common = [], {}
    for (a, b), (whole, place) in zip(own, own_wholes):
        along = x[b] - x[a]
        length = np.linalg.norm(along)
        along /= length
        normal = np.array([along[1], -along[0]])
        ends = np.stack([(from_ - x[a]) @ along, (to - x[a]) @ along], 1) / length  # of master edges, along the slave edge
        gap = np.stack([(from_ - x[a]) @ normal, (to - x[a]) @ normal], 1) / length
        low, high = np.maximum(ends.min(axis=1), 0.0), np.minimum(ends.max(axis=1), 1.0)
        covered, opposite, far = 0.0, 0.0, 0.0
        for k in np.flatnonzero(high - low > 1e-14):
            at = low[k] + (high[k] - low[k]) * (GAUSS[0] + 1) / 2
            eta = (at - ends[k, 0]) / (ends[k, 1] - ends[k, 0])
            off = np.abs(gap[k, 0] + (gap[k, 1] - gap[k, 0]) * eta).max()
            opposite, far = opposite + high[k] - low[k], max(far, off)
            if off > within:
                continue
            covered += high[k] - low[k]
            wide = GAUSS[1] * (high[k] - low[k]) * length
            leaders, there = other_wholes[k]
            lead = side_shapes.shape(2, len(leaders), np.stack([1 - eta, eta], 1) @ there)
            samples = common.setdefault(tuple(whole.tolist()), [])
            samples.append((leaders, lead, np.stack([1 - at, at], 1) @ place, wide))
        sides.append((f"edge of nodes {a}, {b}", covered, opposite, far, 2.0))
    check_covered(sides, within, (follower, leader))
    return side_shapes.dual_rows(2, common)


def _on_faces(body, follower, leader, within):
    """{slave node: (master nodes, weights)} from integrals of dual shape functions over the overlap of faces."""
    sides = []
    for group, what in ((follower, "follow"), (leader, "lead")):
        faces = _sides(body, group, what)
        faces = faces if faces.shape[1] == 4 else np.pad(faces, ((0, 0), (0, 1)), constant_values=-1)
        sides.append((faces, side_shapes.wholes(body, faces)))
    side_shapes.check_nodes(sides[0][1], body.nodes(follower), follower)
    return dual_weights(body.points, *sides, within, (follower, leader))


def rows_of_ties(body, rigid, held):
    """Slave dofs of ties and rigid parts for the core, a dict; None without any. rigid: nodes of each rigid part."""
    nodes, start, leaders, weight = getattr(body, "ties", None) or (
        np.zeros(0, int),
        np.zeros(1, int),
        np.zeros(0, int),
        np.zeros(0),
    )
    if not len(nodes) and not rigid:
        return None
    dim = body.dim
    dof = (dim * nodes[:, None] + np.arange(dim)).ravel()
    counts = np.repeat(np.diff(start), dim)
    master = [dim * leaders[start[k] : start[k + 1]] + axis for k in range(len(nodes)) for axis in range(dim)]
    of = [weight[start[k] : start[k + 1]] for k in range(len(nodes)) for _ in range(dim)]
    for what, dofs in (("tied", dof), *(("of a rigid part", dim * part[:, None] + np.arange(dim)) for part in rigid)):
        wrong = np.intersect1d(held, dofs)
        if len(wrong):
            raise ValueError(
                f"node {wrong[0] // dim} is {what} and held: hold what it follows, or leave it out of one of the groups"
            )
    return {
        "dof": dof,
        "first": np.concatenate([[0], np.cumsum(counts)]),
        "master": np.concatenate(master) if master else np.zeros(0, int),
        "weight": np.concatenate(of) if of else np.zeros(0),
        "rigid_node": np.concatenate(rigid) if rigid else np.zeros(0, int),
        "rigid_first": np.cumsum([0, *(len(part) for part in rigid)]),
        "turns": getattr(body, "kinematics", "small") != "small",
    }


def rigid_parts(body, groups):
    """Nodes of each rigid group. Raises ValueError for groups whose nodes leave a rotation free, or for a node in two groups."""
    out = []
    for group in groups:
        nodes = np.unique(group_nodes(body, group))
        arms = body.points[nodes] - body.points[nodes].mean(axis=0)
        size = np.linalg.norm(arms)
        if np.linalg.matrix_rank(arms, tol=1e-9 * size) < body.dim - 1:
            raise ValueError(
                f"rigid: the {len(nodes)} nodes of {group!r} leave a spin free: give two apart, in 3D three off a line"
            )
        out.append(nodes)
    named = np.concatenate(out) if out else np.zeros(0, int)
    found, count = np.unique(named, return_counts=True)
    if np.any(count > 1):
        raise ValueError(f"rigid: node {found[np.argmax(count > 1)]} is in two rigid parts: make one of them")
    return out
