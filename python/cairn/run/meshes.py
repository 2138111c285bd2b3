"""Deformable bodies of a simulation: passes their matrices to the core once, and loads and held velocities before each step."""

from __future__ import annotations

import numpy as np

from ..model.mesh_faces import whole_sides
from ..model.moving_mesh import MovingMesh
from ..model.triangles_of_matrices import lower_triangles


class Meshes:
    """Deformable bodies of a simulation in the order of insertion: `meshes`, a list of MovingMesh.

    before: the previous Meshes; bodies that remain keep their data in the core and the results of the last step. anew: True:
    matrices and factors are made again, and only the history needed by the next step is kept.
    state: state of a simulation, from which the materials of bodies are restored.
    """

    def __init__(self, simulation, core, before=None, state=None, anew=False):
        self._core, self.meshes, self._loaded = core, [], set()
        were = {int(m.node_ids[0]): m for m in before.meshes} if before else {}
        kept = {id(m.d): core.mesh_memory(m.number) for m in were.values()} if anew else {}
        self._call = simulation._call
        self._share = lambda: _end_share(simulation.strategy.moved_by().scheme(1.0))
        self._origin = origin = np.asarray(simulation.scene.origin, float)[: simulation.scene.dim]
        given = []
        for d, ids in sets_of_meshes(simulation):
            mesh = MovingMesh(d, ids[0], ids[1] if len(ids) > 1 else np.zeros(0, np.int64))
            mesh.number = len(self.meshes)
            self.meshes.append(mesh)
            was = were.get(int(mesh.node_ids[0]))
            stays = was is not None and was.d is d
            if hasattr(d.body, "model_of"):
                mesh.called = (was.called if stays else None) or d.body.model_of(simulation, d.name)
            if stays and not anew:
                given.append(was.number)
            else:
                given.append(_model(mesh, origin) | ({} if was is None or state is not None else _forces(core, was, mesh)))
        self._core.set_meshes(given)
        for mesh, of in zip(self.meshes, given):
            if isinstance(of, dict) and mesh.follows_pressure:
                self._core.press_mesh(mesh.number, mesh.pressed_parts(origin))
            if id(mesh.d) in kept:
                self._core.restore_mesh(mesh.number, *kept[id(mesh.d)])
        self._core.check_scene()
        self._core.follow_meshes()
        if state is not None:
            self.restore(state)

    def restore(self, state):
        """Restores from the state of a simulation the states of materials of bodies that are not linear, and for linear bodies
        the order in which nodes came into contact, since rounding depends on it. Bodies not in the state are reset."""
        kept = state.get("meshes", {})
        for k in range(len(self.meshes)):
            of = kept.get(f"{k:06d}")
            if of is None:
                self._core.forget_mesh(k)
            elif "touched" in of:
                self._core.restore_touched(k, of["touched"])
            else:
                self._core.restore_mesh(k, of["state"], of["memory"])

    def removed(self, ids):
        """Renumbers the meshes after bodies of these ids were removed; a mesh is removed as a whole."""
        loaded = [k in self._loaded for k in range(len(self.meshes))]
        kept = [k for k, mesh in enumerate(self.meshes) if mesh.node_ids[0] not in ids]
        self.meshes = [self.meshes[k] for k in kept]
        for k, mesh in enumerate(self.meshes):
            mesh.number = k
        self._loaded = {new for new, k in enumerate(kept) if loaded[k]}

    def load(self, h):
        """Passes forces and held velocities of a step of h [s] to the core; constant ones are written once."""
        t = self._core.time
        for k, mesh in enumerate(self.meshes):
            if k in self._loaded:
                continue
            d = mesh.d
            moved = d.drive or d.displace or d.carried is not None
            if d.force is None and not moved and not d.pressed and not d.loads:
                self._loaded.add(k)
                continue
            begin, end = mesh.load(t), mesh.load(t + h)
            held = mesh.held_velocity(t + h)
            if d.pressed or d.displace or d.carried:
                scene = self._core.scene
                rows = slice(*(scene.node_row(mesh.node_ids[0]) + np.array([0, len(mesh.node_ids)])))
                x, v = scene.raw_node("position")[rows] + self._origin, scene.raw_node("velocity")[rows]
                if d.carried:
                    begin = begin + d.carried.of_nodes(mesh.body, x, t, self._call)
                    end = end + d.carried.of_nodes(mesh.body, x + h * v, t + h, self._call)
                if d.pressed and not mesh.follows_pressure:
                    begin, end = begin + mesh.pressure_load(t, x), end + mesh.pressure_load(t + h, x + h * v)
                mesh.displaced_velocity(t, h, self._share(), (x - mesh.body.points).ravel(), v.ravel(), held)
                self._core.load_mesh(k, begin, end, held)
                if mesh.follows_pressure:
                    self._core.set_pressures(k, mesh.pressures(t, t + h))
                continue
            self._core.load_mesh(k, begin, end, held)
            forces = d.force.values() if isinstance(d.force, dict) else [d.force]
            functions = [*forces, *(load for *_, load in d.loads), *(v for of in d.drive.values() for v in of.values())]
            if not any(callable(f) for f in functions):
                self._loaded.add(k)


def _end_share(scheme):
    """Weight of the end velocity in the displacement of held dofs over a step: `share`, plus the impulse term of the position
    update, since a drive acts as an impulse."""
    return scheme["share"] + sum(scheme["position"][:1])


def sets_of_meshes(simulation):
    """[(Deformable, [ids of each of its sets])] for the present sets of a simulation."""
    seen, sets = {}, [s for s in simulation._sets if s.mesh is not None]
    there = np.isin(np.concatenate([np.zeros(0, np.int64), *(s.own_ids for s in sets)]), simulation.nodes.id)
    end = np.cumsum([len(s.own_ids) for s in sets])
    for s, last in zip(sets, end):
        if there[last - len(s.own_ids) : last].all() if len(s) else id(s.mesh) in seen:
            seen.setdefault(id(s.mesh), (s.mesh, []))[1].append(s.ids)
    return seen.values()


def _forces(core, was, mesh):
    """Contact impulses and reactions of the last step, which a changed mesh inherits; duplicated nodes share those of their
    former node in proportion to mass."""
    force = [of.reshape(-1, mesh.dim) for of in core.mesh_forces(was.number)]
    if mesh.d.opening is not None and was.d.opening is not None:
        parent, mass = np.empty(mesh.size // mesh.dim, int), mesh.body.nodal_mass()
        parent[mesh.d.opening.node] = was.d.opening.node
        one = np.bincount(parent)[parent] == 1
        mass = np.where(one | (np.bincount(parent, mass)[parent] == 0), 1.0, mass)
        force = [of[parent] * (mass / np.bincount(parent, mass)[parent])[:, None] for of in force]
    return {name: of.ravel() for name, of in zip(("impulse", "reaction"), force) if of.size == mesh.size}


def _model(mesh, origin):
    """Data of a mesh for the core, a dict of arrays; matrices as lower triangles on a common pattern."""
    d, body, dim = mesh.d, mesh.body, mesh.dim
    own = getattr(body, "solver", None) is not None
    if own or not hasattr(body, "lower"):
        start, row, values = lower_triangles([body.M] if own else [body.M, body.K, body.C], mesh.size)
    else:
        start, row, *values = body.lower
    held = np.zeros(mesh.size, np.uint8)
    held[mesh.held] = 1
    followed, weights = d.points
    if followed.shape[1] > MOST_NODES:
        raise ValueError(f"points of {d.name!r} have {followed.shape[1]} nodes each: give at most {MOST_NODES}")
    sides = d.faces.nodes if d.faces else d.edges
    around = d.faces.around if d.faces else []
    out = {
        "dim": dim,
        "name": d.name,
        "reference": (body.points - origin).ravel(),
        "start": start,
        "row": row,
        "mass": values[0],
        "held": held,
        "storage": d.storage or "automatic",
        "node_ids": mesh.node_ids,
        "point_ids": mesh.point_ids,
        "side_ids": mesh.side_ids,
        "contact_nodes": d.contact_nodes,
        "self_contact": d.self_contact,
        "mortar": d.mortar,
        "point_nodes": _wide(followed, -1),
        "point_weights": _wide(weights, 0.0),
        "side_nodes": _wide(sides, -1),
        "face_nodes": d.faces.faces if d.faces else np.zeros((0, MOST_NODES), int),
        "whole_nodes": whole_sides(body, d.faces.faces if d.faces else d.edges).ravel(),
        "around": np.concatenate(around) if len(around) else np.zeros(0, int),
        "around_start": np.concatenate([[0], np.cumsum([len(part) for part in around])]),
    }
    if dim == 2:
        out["ring"], out["axis"] = getattr(body, "plane", None) == "axisymmetric", -float(np.ravel(origin)[0])
        out["thickness"] = 1.0 if out["ring"] else float(getattr(body, "thickness", 1.0))
    if getattr(body, "second_order", False):
        out["node_mass"] = body.nodal_mass()
    if hasattr(body, "blocks"):
        ring = getattr(body, "plane", None) == "axisymmetric"
        out["bulk"], out["bulk_place"] = body.blocks(), (body.points if ring else body.points - origin).ravel()
    elif getattr(body, "initial_force", None) is not None:
        out["initial_force"], out["initial_energy"] = body.initial_force, float(body.initial_energy)
    if mesh.called is not None:
        out["called"] = mesh.called
    if hasattr(body, "elasticity") and hasattr(body, "lower"):
        of = body.elasticity * body.thickness
        out["cells"] = [(kind, nodes.astype(np.int32).ravel(), of.ravel()) for kind, nodes in body.cells.items()]
    if d.modal_damping is not None:
        out["modes"], out["mode_rates"] = mesh.modes[0].T.ravel(), mesh.modes[1]
    if mesh.ties and own:
        raise ValueError(f"{d.name!r} has a solver of its own, which knows no rigid parts: leave `rigid` out")
    if mesh.ties:
        out["ties"] = mesh.ties
    if not own:
        return {**out, "stiffness": values[1], "damping": values[2]}
    calls = {"times_stiffness": lambda x: body.K @ x, "times_damping": lambda x: body.C @ x}
    return {**out, **calls, "free": mesh.free, "solver": lambda h, theta: body.solver(h, theta, mesh.held)}


MOST_NODES = 4  # most nodes that a contact point on a deformable body is interpolated from


def _wide(rows, filled):
    """Rows (n, k) padded to (n, 4)."""
    out = np.full((len(rows), MOST_NODES), filled)
    out[:, : rows.shape[1]] = rows
    return out
