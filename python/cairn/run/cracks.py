"""Faces of a mesh that open in a run: between two steps nodes are duplicated, and both sides of the crack get contactors.
A new node inherits position, velocity and the history of integrators; masses are those of the cells on each side. Mass, momentum
and energy are conserved."""

from __future__ import annotations

from copy import copy

import numpy as np

from ..model.bodies import replace
from .views import core_of

OWN = ("id", "mesh", "mass")  # fields that a new node does not inherit


class Watch:
    """Opens, after each step, the faces whose traction is above their threshold."""

    def look(self, sim):
        """After a step: a function that opens the faces above their threshold, or None without any."""
        found = []
        for view in sim.meshes:
            opening = view._mesh.d.opening
            if opening is None or opening.is_open.all() or opening.threshold == np.inf:
                continue
            faces = opening.above(tractions(sim, view))
            if len(faces):
                found.append((view._mesh, faces))
        return (lambda: [open_faces(sim, mesh, faces) for mesh, faces in found]) if found else None


def tractions(sim, view):
    """Tractions at the corners of each face of a mesh over the last step, (m, k, dim) [Pa, in 2D times the thickness]."""
    mesh, core, h = view._mesh, core_of(sim), sim.report["dt"]
    opening, share = mesh.d.opening, sim.strategy.moved_by().scheme(1.0)["share"]
    begin = {name: np.array(core.scene.raw_node(name)[view.rows]) for name in ("position_begin", "velocity_begin")}
    origin = np.asarray(sim.scene.origin, float)[: mesh.dim]
    u, v = view.displacement, view.velocity
    acceleration = (v - begin["velocity_begin"]) / h - np.asarray(core.scene.gravity)[: mesh.dim]
    before = begin["position_begin"] + origin - mesh.body.points
    along = share * u + (1 - share) * before, share * v + (1 - share) * begin["velocity_begin"]
    held = np.zeros(mesh.size, bool)
    held[mesh.held] = True
    asked = opening.forces.asked(*along, acceleration) - _of_zones(core, mesh, h)
    return opening.forces.tractions(asked, opening.mean_traction(along[0]), held.reshape(-1, mesh.dim))


def _of_zones(core, mesh, h):
    """Forces (corners, dim) [N] on the corners of cells, from the contacts between points and sides of open faces."""
    opening = mesh.d.opening
    out = np.zeros((len(opening.node), mesh.dim))
    if not len(opening.shown) or not core.contact_count:
        return out
    carrier, contactor = core.scene.carriers(), np.ravel(core.scene.contactor("id"))
    key, force = core.contact("key"), core.contact("impulse") / h

    def among(parts, column):
        """Index in `parts` of the contactor in a column of the contact keys; -1 if it is on another part."""
        part = carrier[np.searchsorted(contactor, key[:, column])]
        place = np.minimum(np.searchsorted(parts, part), len(parts) - 1)
        return np.where(parts[place] == part, place, -1)

    point, side = among(mesh.point_ids, 0), among(mesh.side_ids, 1)
    kept = (point >= 0) & (side >= 0)
    point, side, force = point[kept], side[kept], force[kept]
    points, ends = opening.rule.shape
    sides = len(mesh.side_ids) // len(opening.shown)
    of, across = opening.shown[point // points], opening.shown[side // sides]
    weight = opening.rule[point % points]
    facing = np.where((of == across)[:, None], weight, 1 / ends)
    for end in range(ends):
        np.add.at(out, opening.corners[of, 0, end], weight[:, end, None] * force)
        np.add.at(out, opening.corners[across, side % sides // (sides // 2), end], -facing[:, end, None] * force)
    return out


def watch(sim):
    """Adds a Watch to a simulation, unless it has one."""
    if not any(isinstance(w, Watch) for w in sim._watches):
        sim._watches.append(Watch())


def open_faces(sim, mesh, faces):
    """Opens faces (numbers) of a MovingMesh in a simulation."""
    before, scene = mesh.d, core_of(sim).scene
    after = before.opening.opened(faces)
    new, ids = _with(before, after), {"nodes": mesh.node_ids, "points": mesh.point_ids, "sides": mesh.side_ids}
    more = len(after.former) - len(before.opening.former), len(after.shown) - len(before.opening.shown)
    if more[0]:
        ids["nodes"] = np.concatenate([ids["nodes"], _add_nodes(scene, mesh, after)])
    if more[1]:
        point, side = _add_sides(sim, mesh, after, more[1])
        ids["points"], ids["sides"] = np.concatenate([ids["points"], point]), np.concatenate([ids["sides"], side])
    sim._sets = [_of(s, before, new, ids) for s in sim._sets]
    if any(more):
        sim._start_meshes()
    else:
        mesh.d = new


def _with(d, opening):
    """Copy of a Deformable with the open faces of `opening`."""
    out = copy(d)
    out.opening, out.body, out.whole = opening, opening.body, d.whole or d
    out.points, sides = opening.points(), opening.sides()
    if out.body.dim == 2:
        out.edges = sides
    else:
        out.faces = opening.facets()
    out.contact_nodes = np.unique(sides)
    return out


def _of(s, before, after, ids):
    """A set of a simulation, updated if it shows the mesh that was `before`."""
    if s.mesh is not before:
        return s
    return replace(s, mesh=after, ids=np.concatenate([ids["nodes"], ids["points"]]) if len(s) else ids["sides"])


def _rows(scene, ids):
    """Rows of nodes in the arrays of the scene, from their ids."""
    return np.array([scene.node_row(i) for i in ids.tolist()], int)


def _add_nodes(scene, mesh, after):
    """Adds duplicated nodes, which inherit the fields of their former nodes; returns their ids."""
    old = len(mesh.node_ids)
    added = len(after.former) - old
    is_new = after.node >= old
    parents = np.empty(added, int)
    parents[after.node[is_new] - old] = mesh.d.opening.node[is_new]
    first = scene.add_nodes(_number(scene, mesh), np.zeros((added, mesh.dim)), None, np.ones(added))
    ids = first + np.arange(added)
    to, of = _rows(scene, ids), _rows(scene, mesh.node_ids[parents])
    for field in scene.node_fields():
        if field["active"] and field["name"] not in OWN:
            values = scene.raw_node(field["name"])
            values[to] = values[of]
    mass = scene.raw_node("mass").reshape(-1)
    found = after.body.nodal_mass()
    mass[to], mass[of] = found[old:], found[parents]
    return ids


def _number(scene, mesh):
    """Number of a mesh in the core scene."""
    return int(np.ravel(scene.raw_node("mesh"))[scene.node_row(int(mesh.node_ids[0]))])


def _add_sides(sim, mesh, after, faces):
    """Adds contactors on points and sides of the last `faces` opened faces; returns the ids of both."""
    scene = core_of(sim).scene
    sets = [s for s in sim._sets if s.mesh is mesh.d]
    own = [[c for c in s.contactors if not c.joint][-1].species(s.group) for s in sets]  # without the contactors of joints
    species = [np.array([sim._species[which]], np.int32) for which in own]
    n, number = len(after.rule) * faces, _number(scene, mesh)
    point = scene.add_parts(number, n) + np.arange(n)
    scene.add_contactors("disk" if mesh.dim == 2 else "sphere", point, species[0], np.zeros(n))
    if mesh.dim == 2:
        along = after.normal[after.shown[-faces:]] @ np.array([[0.0, 1.0], [-1.0, 0.0]])
        length = after.share[after.shown[-faces:]].sum(axis=1)
        direction = np.stack([np.column_stack([s * along, length / 2]) for s in (1.0, -1.0)], 1).reshape(-1, 3)
        side = scene.add_parts(number, 2 * faces) + np.arange(2 * faces)
        scene.add_contactors("segment", side, species[1], np.full(2 * faces, after.thickness()), None, direction)
        return point, side
    hulls = after.facets(faces).hulls(after.body.points)
    side = scene.add_parts(number, len(hulls)) + np.arange(len(hulls))
    hull = (scene.add_hulls(*hulls[:5], True, hulls.plane.reshape(-1), hulls.ball) + np.arange(len(hulls))).astype(np.int32)
    scene.add_contactors("facet", side, species[1], np.zeros(len(hulls)), None, None, hull)
    return point, side


# ---------------------------------------------------------------------- checkpoints


def to_dict(sets):
    """Content of a checkpoint for meshes with open faces, by the index of the set of their nodes."""
    out = {}
    for k, s in enumerate(sets):
        if s.mesh is not None and s.mesh.whole is not None and len(s):
            sides = next(other.ids for other in sets if other.mesh is s.mesh and other is not s)
            out[f"{k:06d}"] = {**s.mesh.opening.to_dict(), "ids": s.ids, "sides": sides}
    return out


def in_state(sets, state):
    """State of the core, with the open faces of meshes added if there are any."""
    opened = to_dict(sets)
    return {**state, "cracks": opened} if opened else state


def of_state(sets, state):
    """Sets with the open faces of a state that has the present nodes; None if the same faces are open already."""
    now, then = to_dict(sets), state.get("cracks", {})
    same = now.keys() == then.keys() and all(
        of.keys() == then[k].keys() and all(np.array_equal(of[name], then[k][name]) for name in of) for k, of in now.items()
    )
    return None if same else restored(sets, then)


def restored(sets, content):
    """Sets with exactly the open faces of a checkpoint."""
    out = list(sets)
    for k, s in enumerate(sets):
        if s.mesh is None or s.mesh.opening is None or not len(s):
            continue
        d, of = s.mesh.whole or s.mesh, content.get(f"{k:06d}")
        ids = {"nodes": s.ids[: len(s)], "points": np.zeros(0, np.int64), "sides": np.zeros(0, np.int64)}
        if of is not None:
            d = _with(d, d.opening.from_dict(of))
            given, n = np.asarray(of["ids"], np.int64), len(d.body.points)
            ids = {"nodes": given[:n], "points": given[n:], "sides": np.asarray(of["sides"], np.int64)}
            if [len(part) for part in ids.values()] != [n, len(d.points[0]), len(d.faces if d.faces else d.edges)]:
                raise ValueError(f"ids of {len(given)} nodes and points of the mesh {d.name!r} are not those of its open faces")
        out = [_of(other, s.mesh, d, ids) for other in out]
    return out
