"""Rigid bodies made deformable in a run, and back: momentum, angular momentum, ids, contacts and impulses pass over; what the
kinetic and the stored energy lose is a term of the balance, "dissipated_reshaping"."""

from __future__ import annotations

import numpy as np

from ..build import bodies as sets
from ..build.bodies import replace
from ..build.elastic import ElasticBody
from ..build.meshes import deformable
from ..build.shapes import Hulls
from ..build.solid import SolidBody
from ..pre import checks
from .carried_forces import carry, damping_of, force_of, rates_of, weights_of
from .views import core_of


def deform(sim, id, body, *, material=None, **options):
    """See Simulation.deform."""
    s, row = _set_of(sim, id)
    if type(body) not in (ElasticBody, SolidBody):
        raise ValueError(f"body is a {type(body).__name__}: give an ElasticBody or a SolidBody, of the shape of body {id}")
    if body.dim != sim.scene.dim or getattr(body, "plane", "") == "axisymmetric":
        raise ValueError(f"body is of {body.dim} dimensions, plane {body.plane!r}: give a mesh of the scene's {sim.scene.dim}")
    at = _pose(sim, id)
    base = _turned_since(s, row, at["rotation"], body.dim)
    large = getattr(body, "kinematics", "small") != "small"
    weight = weights_of(body)
    mass = weight[:, 0].sum()
    own = body.points - weight[:, 0] @ body.points / mass
    turned = own @ base.T
    reference = at["position"] + (own if large else turned)
    factor = at["mass"] / mass
    given = {**body.given, "points": reference, "density": _times(body.given["density"], factor)}
    if damping := damping_of(s, row):
        a, b = given.get("rayleigh", (0.0, 0.0))
        given["rayleigh"] = (a + damping, b)
    made = type(body)(**given)
    x = at["position"] + turned
    rates = rates_of(turned)
    velocity = _with_momentum(made, rates, np.concatenate([at["mass"] * at["velocity"], at["spin"]]))
    moving = 0.5 * np.sum(velocity.ravel() * (made.M @ velocity.ravel()))
    contactor = next(c for c in s.contactors if np.any(c.body == row))
    name = options.pop("name", s.group or f"body {id}")
    sides = {"edges": made.boundary_edges()} if made.dim == 2 else {"faces": made.boundary_faces()}
    around = np.unique(next(iter(sides.values())))
    given = {"contact": around[around >= 0], **sides, **options}
    shown = deformable(made, material or contactor.material, name=name, velocity=velocity, displacement=x - reference, **given)
    d = shown[0].mesh
    carry(d, s, row)
    d.former = {"id": int(id), "set": s, "row": row, "base": np.eye(made.dim) if large else base, "own": own}
    with _Impulses(sim, [id]) as impulses:
        sim.remove([id])
        impulses.of = sim.add(shown)
        view = next(m for m in sim.meshes if m._mesh.d is d)
        _account(sim, moving - at["kinetic"], _stored(sim, view) if _stressed(view.body) else 0.0)
    return view


def rigidify(sim, mesh, shape=None):
    """See Simulation.rigidify."""
    view = sim.meshes[mesh] if isinstance(mesh, (int, np.integer)) else mesh
    d, body = view._mesh.d, view.body
    former = getattr(d, "former", None)
    if view.held.size:
        raise ValueError(f"the mesh {d.name!r} has held dofs: a rigid body in its place would not; remove the mesh, add a wall")
    if shape is None and former is None:
        raise ValueError(f"the mesh {d.name!r} was no rigid body before: give shape, a set of one body that stands where it is")
    dim = body.dim
    x, v = view.displacement + body.points, view.velocity
    weight = weights_of(body)[:, 0]
    mass = weight.sum()
    centre = weight @ x / mass
    rates = rates_of(x - centre)
    momentum = rates.T @ (body.M @ v.ravel())
    before = 0.5 * np.sum(v.ravel() * (body.M @ v.ravel()))
    stored = _stored(sim, view)
    if shape is None:
        s, row = former["set"], former["row"]
        turn = _nearest_turn(former["own"] @ former["base"].T, x - centre, weight) @ former["base"]
        one = _one_of(s, row)
        start = np.eye(dim) if s.rotation is None else _matrix(s.rotation[row], dim)
        one = replace(one, position=centre[None], rotation=_stored_rotation(turn @ start, dim), group=s.group)
        axes = turn @ start
    else:
        one = shape
        if not isinstance(one, sets.BodySet) or len(one) != 1 or one.mesh is not None or not np.isfinite(one.mass[0]):
            raise ValueError(
                "shape is no set of one free rigid body: give cn.polygons([...]), cn.polyhedra([...]), cn.disks(...)"
            )
        axes = np.eye(dim) if one.rotation is None else _matrix(one.rotation[0], dim)
        one = replace(one, position=centre[None])
    factor = mass / one.mass[0]
    one = replace(one, mass=one.mass * factor, inertia=one.inertia * factor)
    if former is not None and shape is not None:  # under its id again, it has what the set that it came in with gives it
        damping = damping_of(former["set"], former["row"])
        one = replace(one, force=force_of(former["set"], former["row"]), damping=damping or None)
    inertia = one.inertia[0]
    spin = momentum[dim:] / inertia[0] if dim == 2 else axes @ ((axes.T @ momentum[dim:]) / inertia)
    one = replace(one, velocity=np.concatenate([momentum[:dim] / mass, spin])[None], driven=(), drive=None)
    after = 0.5 * (momentum[:dim] @ momentum[:dim] / mass + spin @ momentum[dim:])
    with _Impulses(sim, view.all_ids) as impulses:
        sim.remove(view.all_ids)
        new = sim.add(sets.checked(one))
        if shape is None and former["id"] not in sim.bodies.id:
            core_of(sim).scene.give_id(int(new[0]), former["id"])
            sim._sets[-1] = replace(sim._sets[-1], ids=np.array([former["id"]]))
            new = sim._sets[-1].ids
            sim._start_functions()
        impulses.of = new
        _account(sim, after - before, -stored)
    return int(new[0])


def _account(sim, kinetic, stored):
    """What came to the kinetic and to the stored energy [J]. The balance begins with the first step, from the bodies as they are
    then, and of a strategy that keeps none it stays empty."""
    if sim.steps and getattr(sim.strategy, "energy", True):
        core_of(sim).account_for_reshaping(kinetic, stored)


class Watch:
    """Bodies that become deformable when a contact force or a mean stress is above a threshold, and rigid again when no contact
    force is above another; see Simulation.reshape_when."""

    def __init__(self, ids, body, force, stress, back, options):
        if force is None and stress is None:
            raise ValueError("reshape_when has no threshold: give force [N], stress [Pa], or both")
        for name, value in (("force", force), ("stress", stress), ("back", back)):
            if value is not None:
                checks.positive(name, value)
        self.ids, self.body, self.force, self.stress, self.back, self.options = list(ids), body, force, stress, back, options
        self.meshes = {}  # Deformable by the id of the body that it was, those of a restored checkpoint too

    def look(self, sim):
        """After a step: what is above its threshold."""
        h = sim.report.get("dt", 0.0)
        formers = [(getattr(m._mesh.d, "former", None) or {}).get("id") for m in sim.meshes]
        self.meshes = {i: m._mesh.d for i, m in zip(formers, sim.meshes) if i in self.ids}
        if not h or not core_of(sim).contact_count and not self.meshes:
            return
        contacts = core_of(sim).contact("bodies"), core_of(sim).contact("impulse") / h, core_of(sim).contact("point")
        size = np.linalg.norm(contacts[1], axis=1)
        views = {id(m._mesh.d): m for m in sim.meshes}
        rigid = [i for i in self.ids if i not in self.meshes]
        above = [i for i in rigid if self._above(sim, i, contacts, size)]
        back = []
        for i, d in self.meshes.items():
            ids = views[id(d)].ids if id(d) in views else None
            if ids is not None and self.back is not None:
                mine = size[np.isin(contacts[0], ids).any(axis=1)]
                if not len(mine) or mine.max() < self.back:
                    back.append(i)
        for i in above:
            body = self.body[i] if isinstance(self.body, dict) else self.body
            self.meshes[i] = deform(sim, i, body, **self.options)._mesh.d
        for i in back:
            d = self.meshes.pop(i)
            rigidify(sim, next(m for m in sim.meshes if m._mesh.d is d))

    def _above(self, sim, i, contacts, size):
        bodies, force, point = contacts
        sides = bodies == i
        mine = sides.any(axis=1)
        if not mine.any():
            return False
        if self.force is not None and size[mine].max() > self.force:
            return True
        if self.stress is None:
            return False
        s, row = _set_of(sim, i)
        at = _pose(sim, i)
        arm = point[mine] - at["position"]
        sign = np.where(sides[mine][:, 0], 1.0, -1.0)  # impulses are those on the candidate
        density = next(c for c in s.contactors if np.any(c.body == row)).material.density
        tensor = np.einsum("ck,cl->kl", sign[:, None] * force[mine], arm) * density / at["mass"]
        return np.abs(np.linalg.eigvalsh((tensor + tensor.T) / 2)).max() > self.stress


# ---------------------------------------------------------------------- contacts


class _Impulses:
    """What contacts of bodies remember passes to those, of what comes in their place, that are nearest among the contacts with
    the same others: a contact between two new ones is shared by its distances from them, so that sum and moment stay."""

    def __init__(self, sim, ids):
        self.sim, self.ids, self.of = sim, np.asarray(ids), None

    def __enter__(self):
        self.before = self._look()
        self.memory = core_of(self.sim).get_state()["memory"]
        return self

    def _look(self):
        core = core_of(self.sim)
        if not self.sim.strategy.stages or self.sim.strategy.pose != "moreau":
            return None
        core.begin_step(self.sim._dt)
        try:
            core.compute_free_velocity()
            core.detect_contacts()
            return {name: core.contact(name).copy() for name in ("key", "point", "normal", "bodies")}
        finally:
            core.undo_step()

    def _contactors(self, ids):
        """Ids of the contactors on bodies, or on parts of meshes."""
        scene = core_of(self.sim).scene
        return scene.contactor("id").ravel()[np.isin(scene.carriers(), ids)]

    def __exit__(self, kind, *_):
        if kind is not None or self.before is None:
            return
        old = self.memory
        keys, columns = old["keys"], old["impulse_components"]
        gone = ~np.isin(keys[:, :2], core_of(self.sim).scene.contactor("id").ravel())
        kept = ~gone.any(axis=1)
        impulses, states = old["impulses"].reshape(len(keys), columns), old["states"].reshape(len(keys), old["state_components"])
        rows = [(keys[k], impulses[k], states[k]) for k in np.flatnonzero(kept)]
        now = self._look()
        mine = self._contactors(self.of)
        touches = np.isin(now["key"][:, :2], mine)
        seen = {tuple(key): k for k, key in enumerate(self.before["key"].tolist())}
        passed = {}
        for k in np.flatnonzero(~kept):
            here = seen.get(tuple(keys[k].tolist()))
            other = keys[k, :2][~gone[k]]
            if here is None or len(other) != 1:
                continue
            found = np.flatnonzero(touches.any(axis=1) & (now["key"][:, :2] == other[0]).any(axis=1))
            if not len(found):
                continue
            impulse = self._in_space(impulses[k], self.before["normal"][here])
            impulse *= self._side(self.before, here, self.ids)
            for to, share in self._shares(self.before["point"][here], now["point"][found], found):
                total, state = passed.get(to, (0.0, states[k]))
                part = impulse * share * self._side(now, to, self.of)
                passed[to] = total + part, state
        anchors = old["anchors"].reshape(len(keys), -1)[kept] if "anchors" in old else None
        for to, (impulse, state) in passed.items():
            rows.append((now["key"][to], self._of_contact(impulse, now["normal"][to]), state))
        # contacts are found again by the order of their keys
        state = core_of(self.sim).get_state()
        memory = dict(old)
        memory["keys"] = np.array([r[0] for r in rows], np.int64).reshape(-1, 4)
        memory["impulses"] = np.array([r[1] for r in rows], float).ravel()
        memory["states"] = np.array([r[2] for r in rows], float).ravel()
        if anchors is not None:  # the others hold nothing
            fresh = np.zeros((len(rows) - len(anchors), anchors.shape[1]))
            fresh[:, -1] = -1
            memory["anchors"] = np.concatenate([anchors, fresh])
        memory["contactors_seen"] = state["scene"]["next_contactor_id"]
        state["memory"] = memory
        core_of(self.sim).set_state(state)
        self.sim._constant_force_set = False

    def _side(self, contacts, row, mine):
        """+1 where one of these is the candidate, on which impulses act, else -1."""
        return 1.0 if np.isin(contacts["bodies"][row][0], mine) else -1.0

    def _in_space(self, impulse, normal):
        """In 2D what is remembered stands along the normal and the tangent, in 3D in space."""
        if len(normal) == 3:
            return impulse.copy()
        out = impulse.copy()
        out[:2] = impulse[0] * normal + impulse[1] * np.array([-normal[1], normal[0]])
        return out

    def _of_contact(self, impulse, normal):
        if len(normal) == 3:
            return impulse
        out = impulse.copy()
        out[:2] = impulse[:2] @ normal, impulse[:2] @ np.array([-normal[1], normal[0]])
        return out

    def _shares(self, point, points, found):
        order = np.argsort(np.linalg.norm(points - point, axis=1), kind="stable")
        first = points[order[0]]
        for k in order[1:]:
            along = points[k] - first
            t = (point - first) @ along / (along @ along) if np.any(along) else -1.0
            if 0 < t <= 0.5 + 1e-9:
                return [(int(found[order[0]]), 1 - t), (int(found[k]), t)]
        return [(int(found[order[0]]), 1.0)]


# ---------------------------------------------------------------------- of bodies


def _set_of(sim, id):
    """The set that a rigid body came in with, and its row there."""
    present = sim.bodies.id
    for s in reversed(sim._sets):
        if s.mass is None or s.mesh is not None:
            continue
        row = np.flatnonzero(s.own_ids == id)
        if len(row) and np.isin(id, present):
            if not np.isfinite(s.mass[row[0]]) or s.driven:
                raise ValueError(f"body {id} is held or driven: a deformable body in its place would fall; give it free dofs")
            return s, int(row[0])
    raise ValueError(f"there is no rigid body {id}: give the id of one, as Scene.add and Simulation.add return them")


def _pose(sim, id):
    """Where a rigid body is and how it moves: spin is its angular momentum about its centre of mass."""
    scene, dim = core_of(sim).scene, sim.scene.dim
    row = int(np.searchsorted(scene.body("id"), id))
    names = {f["name"] for f in scene.body_fields() if f["active"]}
    velocity = scene.body("velocity")[row]
    rotation = _matrix(scene.body("rotation")[row], dim) if "rotation" in names else np.eye(dim)
    inertia = np.atleast_1d(scene.body("inertia")[row])
    mass = float(np.ravel(scene.body("mass")[row])[0])
    spin = inertia[:1] * velocity[2:] if dim == 2 else rotation @ (inertia * (rotation.T @ velocity[3:]))
    return {
        "position": scene.body("position")[row] + np.asarray(sim.scene.origin, float)[:dim],
        "rotation": rotation, "velocity": velocity[:dim], "mass": mass, "spin": spin,
        "kinetic": 0.5 * (mass * velocity[:dim] @ velocity[:dim] + velocity[dim:] @ spin),
    }  # fmt: skip


def _turned_since(s, row, rotation, dim):
    start = np.eye(dim) if s.rotation is None else _matrix(s.rotation[row], dim)
    return rotation @ start.T


def _matrix(rotation, dim):
    if dim == 2:
        c, s = np.cos(np.ravel(rotation)[0]), np.sin(np.ravel(rotation)[0])
        return np.array([[c, -s], [s, c]])
    w, x, y, z = np.asarray(rotation, float) / np.linalg.norm(rotation)
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def _stored_rotation(matrix, dim):
    """An angle (1,), or a quaternion (1, 4)."""
    if dim == 2:
        return np.array([np.arctan2(matrix[1, 0], matrix[0, 0])])
    values, vectors = np.linalg.eigh(
        np.array([
            [matrix.trace(), *(_skew(matrix))],
            *([_skew(matrix)[k], *((matrix + matrix.T - matrix.trace() * np.eye(3))[k])] for k in range(3)),
        ])
    )  # fmt: skip
    return vectors[:, -1:].T


def _skew(m):
    return m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]


def _times(density, factor):
    return {kind: of * factor for kind, of in density.items()} if isinstance(density, dict) else density * factor


def _nearest_turn(own, x, weight):
    """The rotation that brings `own` nearest to x, by weights (Kabsch 1976)."""
    u, _, v = np.linalg.svd((own * weight[:, None]).T @ x)
    flip = np.eye(own.shape[1])
    flip[-1, -1] = np.sign(np.linalg.det(u @ v))
    return (u @ flip @ v).T


def _with_momentum(body, rates, momentum):
    """Velocities (n, dim) of a rigid motion of the nodes with a momentum and an angular momentum."""
    return (rates @ np.linalg.solve(rates.T @ (body.M @ rates), momentum)).reshape(-1, body.dim)


def _stressed(body):
    """Whether it has a stress before it moves."""
    return any(getattr(body, name, None) is not None for name in ("initial_force", "initial_stress"))


def before_first_step(sim, energy):
    """Terms of the balance before there is one, with what initial stresses of bodies store."""
    return {**energy, "stored": energy["stored"] + sum(_stored(sim, m) for m in sim.meshes if _stressed(m.body))}


def _stored(sim, view):
    """Energy that the displacements at hand store [J]."""
    body = view.body
    if not hasattr(body, "blocks"):
        u = view.displacement.ravel()
        twice = float(u @ (body.K @ u))
        if body.initial_force is not None:
            return 0.5 * twice + float(u @ np.ravel(body.initial_force)) + body.initial_energy
        return 0.5 * twice
    memory = core_of(sim).mesh_memory(view._mesh.number)[1]
    return float(memory[-1]) if len(memory) else float(body.tangent(view.displacement)[2])


def _one_of(s, row):
    """A set of the one body of a set, its shapes with it."""
    contactors = []
    for c in s.contactors:
        mine = np.flatnonzero(c.body == row)
        if not len(mine):
            continue
        given = {n: None if getattr(c, n) is None else getattr(c, n)[mine] for n in ("offset", "direction", "hull")}
        hulls = c.hulls
        if hulls is not None and not len(hulls.ball) and not hulls.facets:
            hulls, given["hull"] = _some_hulls(hulls, given["hull"]), np.arange(len(mine))
        contactors.append(sets.ContactorSet(c.shape, c.material, np.zeros(len(mine), int), c.radius[mine], hulls=hulls, **given))
    return sets.BodySet(s.dim, s.position[row : row + 1], s.mass[row : row + 1], s.inertia[row : row + 1], contactors)


def _some_hulls(hulls, which):
    """Those of some polygons or polyhedra."""

    def cut(values, first, of):
        parts = [values[first[k] : first[k + 1]] for k in of]
        return np.concatenate(parts), np.cumsum([0, *(len(part) for part in parts)]).astype(first.dtype)

    vertex, first_vertex = cut(hulls.vertex, hulls.first_vertex, which)
    if len(hulls.first_face) <= 1:
        return Hulls(vertex, first_vertex, hulls.first_face, hulls.first_corner, hulls.corner)
    faces, first_face = cut(np.arange(hulls.first_face[-1]), hulls.first_face, which)
    corner, first_corner = cut(hulls.corner, hulls.first_corner, faces)
    return Hulls(vertex, first_vertex, first_face, first_corner, corner)
