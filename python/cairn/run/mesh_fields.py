"""Fields of deformable bodies for an output: of their nodes and cells. Many small elastic bodies of the same elasticity are
evaluated together, since the overhead of a call for each would exceed the evaluation."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from ..files.mesh_cells import VTK_CELLS, cells_of
from ..model.elastic import ElasticBody
from .views import MeshView, core_of


class MeshFields:
    """Fields of the deformable bodies of a simulation; the constant part is kept while these bodies do not change."""

    def __init__(self, simulation):
        self._simulation, self._seen = simulation, None

    def nodes(self):
        """Fields of the nodes of all bodies by name, in the order of simulation.nodes: displacement (n, dim) [m], and those of
        MeshView.nodal_fields, zero for bodies without them. If faces of a mesh may open, also `mesh` (n,): number of the mesh
        among those with cells in the output, -1 for others; a reader needs it to find the corners of cells."""
        self._follow()
        n = len(self._simulation.nodes)
        out = {"displacement": np.zeros((n, self._simulation.scene.dim))}
        for part, _ in self._parts:
            place = part.place
            out["displacement"][place] = part.displacement
            if cells_of(part.body) or hasattr(part.body, "nodal_stress"):
                for name, values in part.nodal_fields().items():
                    if name not in out:
                        out[name] = np.zeros((n, *values.shape[1:]))
                        if name == "beam_rotation" and values.ndim == 2:
                            out[name][:, 0] = 1.0  # identity for nodes without rotation
                    out[name][place] = values
        if any(mesh.d.opening is not None for mesh in self._seen):
            out["mesh"] = np.full(n, -1)
            ids = core_of(self._simulation).scene.node("id")
            for mesh, number in zip(self._seen, self._numbers):
                out["mesh"][np.searchsorted(ids, mesh.node_ids)] = number
        return out

    def cells(self):
        """Cells in their current positions, for RunWriter.write_step; None without cells. Fields of cells: number of their mesh,
        stress [Pa], strain, and states of materials in SHOWN_STATES."""
        self._follow()
        if self._cells is None:
            return None
        n = len(self._cells["types"])
        points, fields = np.zeros((self._points, 3)), {}
        for part, rows in self._parts:
            if rows is None:
                continue
            x = part.displacement + part.body.points
            points[rows.points, : x.shape[1]] = x
            for name, values in part.cell_fields().items():
                fields.setdefault(name, np.zeros((n, *values.shape[1:]), values.dtype))[rows.cells] = values
        return {"points": points, **self._cells, "fields": fields | {"mesh": self._mesh}}

    def _follow(self):
        """Rebuilds the constant part if bodies were added or removed."""
        views = self._simulation.meshes
        seen = [view._mesh for view in views]
        if self._seen is not None and len(seen) == len(self._seen) and all(a is b for a, b in zip(seen, self._seen)):
            return
        self._seen = seen
        shown = [bool(cells_of(v.body)) for v in views]
        begins, first = self._place_cells(views, shown)
        self._parts = []
        for members in self._alike(views):
            part = views[members[0]] if len(members) == 1 else _Joined(self._simulation, [views[k] for k in members])
            rows = None
            if shown[members[0]]:
                kinds = list(cells_of(views[members[0]].body))
                cells = [_ranges(begins[members, j], begins[members, j + 1]) for j in range(len(kinds))]
                rows = SimpleNamespace(points=_ranges(first[members], first[np.add(members, 1)]), cells=np.concatenate(cells))
            self._parts.append((part, rows))

    def _place_cells(self, views, shown):
        """Stores corners, kinds and meshes of all cells; returns the first rows of the kinds of each body, and of its points."""
        most = max((len(cells_of(v.body)) for v, s in zip(views, shown) if s), default=0)
        begins, first = np.zeros((len(views), most + 1), int), np.zeros(len(views) + 1, int)
        corners, sizes, types, meshes, row = [], [], [], [], 0
        number = np.cumsum(shown) - 1
        self._numbers = np.where(shown, number, -1)  # of each body
        for k, (view, is_shown) in enumerate(zip(views, shown)):
            first[k + 1] = first[k] + (len(view.body.points) if is_shown else 0)
            begins[k] = row
            for j, (kind, cells) in enumerate(cells_of(view.body).items() if is_shown else ()):
                corners.append((np.asarray(cells, np.int64) + first[k]).ravel())
                sizes.append(np.full(len(cells), cells.shape[1], np.int64))
                types.append(np.full(len(cells), VTK_CELLS[kind], np.uint8))
                meshes.append(np.full(len(cells), number[k]))
                row += len(cells)
                begins[k, j + 1 :] = row
        self._points, self._cells = first[-1], None
        if corners:
            offsets = np.cumsum([0, *np.concatenate(sizes)])
            self._cells = {"connectivity": np.concatenate(corners), "offsets": offsets, "types": np.concatenate(types)}
            self._mesh = np.concatenate(meshes)
        return begins, first

    def _alike(self, views):
        """Lists of numbers of bodies that can be evaluated together."""
        alone, together = [], {}
        warm = "thermal" in self._simulation.scene.networks  # thermal stresses are evaluated body by body
        for k, view in enumerate(views):
            body = view.body
            if warm or type(body) is not ElasticBody or body.initial_stress is not None:
                alone.append([k])
            else:
                key = (tuple(body.cells), body.plane, body.thickness, body.elasticity.tobytes())
                together.setdefault(key, []).append(k)
        return alone + list(together.values())


class _Joined(MeshView):
    """View of several elastic bodies as a single one with all their nodes and cells."""

    def __init__(self, simulation, views):
        body = _JoinedBody([view.body for view in views])
        super().__init__(simulation, core_of(simulation), SimpleNamespace(body=body, dim=body.dim))
        self._numbers = [view._mesh.number for view in views]
        self._first = np.array([view.ids[0] for view in views])
        self._counts = np.array([len(view.ids) for view in views])

    @property
    def rows(self):
        """Rows of the nodes in the core's arrays until the next renumbering."""
        begin = np.array([self._core.scene.node_row(node) for node in self._first])
        return _ranges(begin, begin + self._counts)

    @property
    def place(self):
        """Rows of the nodes in the arrays of simulation.nodes."""
        begin = np.searchsorted(self._core.scene.node("id"), self._first)
        return _ranges(begin, begin + self._counts)

    def _of_nodes(self, name):
        return self._core.scene.raw_node(name)[self.rows]

    @property
    def contact_force(self):
        """Contact forces on the nodes, mean over the last step, (n, dim) [N]."""
        h = self._simulation.info.get("dt", 0.0)
        impulses = np.concatenate([self._core.mesh_forces(k)[0] for k in self._numbers]).reshape(-1, self._mesh.dim)
        return impulses / h if h > 0 else np.zeros_like(impulses)


class _JoinedBody(ElasticBody):
    """Nodes and cells of elastic bodies of the same elasticity, without matrices, for the evaluation of stresses and strains."""

    def __init__(self, bodies):
        one = bodies[0]
        self.dim, self.plane, self.thickness, self.elasticity = one.dim, one.plane, one.thickness, one.elasticity
        first = np.cumsum([0, *[len(body.points) for body in bodies]])
        self.points = np.concatenate([body.points for body in bodies])
        self.cells = {kind: np.concatenate([b.cells[kind] + k for b, k in zip(bodies, first)]) for kind in one.cells}
        sides = [body.boundary_edges() if self.dim == 2 else body.boundary_faces() for body in bodies]
        self._sides = np.concatenate([np.where(of < 0, -1, of + k) for of, k in zip(sides, first)])

    def boundary_edges(self):
        """Boundary edges or faces of all bodies."""
        return self._sides

    boundary_faces = boundary_edges


def _ranges(begin, end):
    """Concatenated ranges of numbers from each begin to its end."""
    size = end - begin
    return np.arange(size.sum()) + np.repeat(begin - np.cumsum(size) + size, size)
