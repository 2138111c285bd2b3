"""Rigid bodies made deformable in a run, and back: momentum, angular momentum, ids, contacts and impulses are kept. The loss of
kinetic and stored energy is the term "dissipated_reshaping" of the balance."""

from __future__ import annotations

import numpy as np

from .. import _core
from ..base import checks
from ..model import bodies as sets
from ..model.bodies import replace
from ..model.elastic import ElasticBody
from ..model.meshes import deformable
from ..model.shapes import Hulls
from ..model.solid import SolidBody
from .carried_forces import carry, damping_of, force_of
from .changes import account, joint_of
from .sets import place_of
from .views import core_of


def deform(sim, id, body, *, material=None, **options):
    """See Simulation.deform."""
    s, row = _set_of(sim, id)
    if (joint := joint_of(sim, id)) is not None:
        told = f"body {id} is an end of the joint {joint!r}, which a mesh in its place would not have"
        raise ValueError(f"{told}: let it go first, sim.unjoin({joint!r})")
    if s.surface_velocity is not None:
        told = f"body {id} has a surface velocity, which a deformable body cannot have"
        raise ValueError(f"{told}: make it without, or leave it rigid")
    _core.check_unbonded(core_of(sim), np.array([id], np.int64), f"body {id}")
    if type(body) not in (ElasticBody, SolidBody):
        raise ValueError(f"body is a {type(body).__name__}: give an ElasticBody or a SolidBody, of the shape of body {id}")
    if body.dim != sim.scene.dim or getattr(body, "plane", "") == "axisymmetric":
        raise ValueError(f"body is of {body.dim} dimensions, plane {body.plane!r}: give a mesh of the scene's {sim.scene.dim}")
    large = getattr(body, "kinematics", "small") != "small"
    core = core_of(sim)
    place = _core.place_of_mesh(core.scene, int(id), *body.lower[:3], body.points, _start(s, row, body.dim), large)
    given = {**body.given, "points": place["reference"], "density": _times(body.given["density"], place["factor"])}
    if damping := damping_of(s, row):
        a, b = given.get("rayleigh", (0.0, 0.0))
        given["rayleigh"] = (a + damping, b)
    made = type(body)(**given)
    kinetic = _core.motion_of(core.scene, int(id))["kinetic"]
    contactor = next(c for c in s.contactors if np.any(c.body == row))
    name = options.pop("name", s.group or f"body {id}")
    sides = {"edges": made.boundary_edges()} if made.dim == 2 else {"faces": made.boundary_faces()}
    around = np.unique(next(iter(sides.values())))
    given = {"contact": around[around >= 0], **sides, **options}
    shown = deformable(
        made, material or contactor.material, name=name, velocity=place["velocity"], displacement=place["displacement"], **given
    )
    d = shown[0].mesh
    carry(d, s, row)
    d.former = {"id": int(id), "set": s, "row": row, "base": place["base"], "own": place["own"]}
    if hasattr(made, "blocks"):
        made.tangent(place["displacement"])  # raises for a material without a stress there, before the body is removed
    contacts = PassedContacts(sim, [id])
    sim.remove([id])
    made = sim.add(shown)
    view = next(m for m in sim.meshes if m._mesh.d is d)
    account(sim, place["kinetic"] - kinetic, _stored(sim, view) if _stressed(view.body) else 0.0)
    contacts.pass_to(made)
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
    dim, core = body.dim, core_of(sim)
    _core.check_unbonded(core, np.asarray(view.all_ids, np.int64), f"the mesh {d.name!r}")
    at = _core.motion_of_mesh(core, view._mesh.number)
    centre, mass = at["centre"], at["mass"]
    if shape is None:
        s, row = former["set"], former["row"]
        axes = _core.turn_of_mesh(core, view._mesh.number, former["own"], former["base"]) @ _start(s, row, dim)
        one = replace(_one_of(s, row), position=centre[None], rotation=_core.stored_rotation(dim, axes), group=s.group)
    else:
        one = shape
        if not isinstance(one, sets.BodySet) or len(one) != 1 or one.mesh is not None or not np.isfinite(one.mass[0]):
            raise ValueError(
                "shape is no set of one free rigid body: give cn.polygons([...]), cn.polyhedra([...]), cn.disks(...)"
            )
        axes = _start(one, 0, dim)
        one = replace(one, position=centre[None])
    factor = mass / one.mass[0]
    one = replace(one, mass=one.mass * factor, inertia=one.inertia * factor)
    if former is not None and shape is not None:  # keeps force and damping of the former body
        damping = damping_of(former["set"], former["row"])
        one = replace(one, force=force_of(former["set"], former["row"]), damping=damping or None)
    velocity, kinetic = _core.velocity_of(dim, mass, at["momentum"], axes, np.atleast_1d(one.inertia[0]))
    one = replace(one, velocity=velocity[None], driven=(), drive=None)
    contacts = PassedContacts(sim, view.all_ids)
    sim.remove(view.all_ids)
    new = sim.add(sets.checked(one))
    if shape is None and former["id"] not in sim.bodies.id:
        core.scene.give_id(int(new[0]), former["id"])
        sim._sets.pop()  # it belongs to its former set again, which has its initial rotation, force and damping
        if place_of(former["set"], sim._sets) is None:
            sim._sets.append(former["set"])
        new = np.array([former["id"]])
        sim._start_functions()
    account(sim, kinetic - at["kinetic"], -at["stored"])
    contacts.pass_to(new)
    return int(new[0])


class Watch:
    """Makes bodies deformable when a contact force or a mean stress is above a threshold, and rigid again when all contact forces
    are below another; see Simulation.reshape_when."""

    def __init__(self, ids, body, force, stress, back, options):
        if force is None and stress is None:
            raise ValueError("reshape_when has no threshold: give force [N], stress [Pa], or both")
        for name, value in (("force", force), ("stress", stress), ("back", back)):
            if value is not None:
                checks.positive(name, value)
        self.ids, self.body, self.force, self.stress, self.back, self.options = list(ids), body, force, stress, back, options
        self.meshes = {}  # {id of the former rigid body: Deformable}, also after a restored checkpoint

    def look(self, sim):
        """After a step: a function that reshapes the bodies beyond their thresholds, or None without any. All watches look before
        any of these functions is called."""
        formers = [(getattr(m._mesh.d, "former", None) or {}).get("id") for m in sim.meshes]
        self.meshes = {i: m._mesh.d for i, m in zip(formers, sim.meshes) if i in self.ids}
        there = set(sim.bodies.id.tolist())
        rigid = [i for i in self.ids if i not in self.meshes and i in there]
        shown = [m for m in sim.meshes if any(m._mesh.d is d for d in self.meshes.values())] if self.back is not None else []
        force, stress, of_meshes = _core.contact_loads(
            core_of(sim),
            np.array(rigid, np.int64),
            np.array([self._volume(sim, i) for i in rigid], float),
            np.array([m._mesh.number for m in shown], np.int64),
        )
        above = np.zeros(len(rigid), bool)
        if self.force is not None:
            above |= force > self.force
        if self.stress is not None:
            above |= stress > self.stress
        above = [i for i, is_above in zip(rigid, above) if is_above]
        back = [m._mesh.d for m, f in zip(shown, of_meshes) if f < self.back]
        return (lambda: self._reshape(sim, above, back)) if above or back else None

    def _reshape(self, sim, above, back):
        for i in above:
            if np.isin(i, sim.bodies.id):  # another watch may have reshaped it
                body = self.body[i] if isinstance(self.body, dict) else self.body
                self.meshes[i] = deform(sim, i, body, **self.options)._mesh.d
        for d in back:
            for view in [m for m in sim.meshes if m._mesh.d is d]:
                self.meshes.pop(d.former["id"], None)
                rigidify(sim, view)

    def _volume(self, sim, i):
        """Volume of a body from mass and density [m3]; in 2D mass over density."""
        if self.stress is None:
            return 1.0
        s, row = _set_of(sim, i)
        density = next(c for c in s.contactors if np.any(c.body == row)).material.density
        return _core.motion_of(core_of(sim).scene, int(i))["mass"] / density


# ---------------------------------------------------------------------- contacts


class PassedContacts:
    """Memory of the contacts of bodies, passed to the contacts of their replacement; see cxx/strategies/reshaping.hpp."""

    def __init__(self, sim, ids):
        self.sim = sim
        with sim._stage.of_core():
            self.core = _core.PassedContacts(core_of(sim), sim._dt, np.asarray(ids, np.int64))

    def pass_to(self, ids):
        with self.sim._stage.of_core():
            self.core.pass_to(core_of(self.sim), np.asarray(ids, np.int64))


# ---------------------------------------------------------------------- rigid bodies


def _set_of(sim, id):
    """(set, row in it) of a rigid body. Raises ValueError for a body that is held, driven, unknown or without shapes."""
    present = sim.bodies.id
    for s in reversed(sim._sets):
        if s.mass is None or s.mesh is not None:
            continue
        row = np.flatnonzero(s.own_ids == id)
        if len(row) and np.isin(id, present):
            if not np.isfinite(s.mass[row[0]]) or s.driven:
                raise ValueError(f"body {id} is held or driven: a deformable body in its place would fall; give it free dofs")
            if not s.contactors:
                told = f"body {id} came in later, by a checkpoint of before these held shapes"
                raise ValueError(f"{told}: restart from one of before it came in, or write that one anew")
            return s, int(row[0])
    raise ValueError(f"there is no rigid body {id}: give the id of one, as Scene.add and Simulation.add return them")


def _start(s, row, dim):
    """Initial rotation matrix of a body of a set, (dim, dim)."""
    return np.eye(dim) if s.rotation is None else _core.rotation_of(dim, np.atleast_1d(s.rotation[row]))


def _times(density, factor):
    return {kind: of * factor for kind, of in density.items()} if isinstance(density, dict) else density * factor


def _stressed(body):
    """True for a body with an initial stress."""
    return any(getattr(body, name, None) is not None for name in ("initial_force", "initial_stress"))


def before_first_step(sim, energy):
    """Energy terms before the first step, with the energy stored by initial stresses."""
    return {**energy, "stored": energy["stored"] + sum(_stored(sim, m) for m in sim.meshes if _stressed(m.body))}


def _stored(sim, view):
    """Energy stored in a mesh at its current displacement [J]."""
    return _core.stored_by_mesh(core_of(sim), view._mesh.number)


def _one_of(s, row):
    """A set with a single body of a set and its shapes."""
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
    one = sets.BodySet(s.dim, s.position[row : row + 1], s.mass[row : row + 1], s.inertia[row : row + 1], contactors)
    return replace(one, depth=s.depth)


def _some_hulls(hulls, which):
    """Hulls of the polygons or polyhedra with these numbers."""

    def cut(values, first, of):
        parts = [values[first[k] : first[k + 1]] for k in of]
        return np.concatenate(parts), np.cumsum([0, *(len(part) for part in parts)]).astype(first.dtype)

    vertex, first_vertex = cut(hulls.vertex, hulls.first_vertex, which)
    if len(hulls.first_face) <= 1:
        return Hulls(vertex, first_vertex, hulls.first_face, hulls.first_corner, hulls.corner)
    faces, first_face = cut(np.arange(hulls.first_face[-1]), hulls.first_face, which)
    corner, first_corner = cut(hulls.corner, hulls.first_corner, faces)
    return Hulls(vertex, first_vertex, first_face, first_corner, corner)
