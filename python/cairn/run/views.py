"""Views of a simulation: its arrays by name, as numpy copies."""

from __future__ import annotations

import numpy as np

from .. import _core
from ..base import checks
from ..names import listed, meant
from .present_joints import rows_of_joints
from .shown import shown

# arrays of bodies and of nodes that can be set
SETTABLE = ("position", "velocity", "rotation")
FORCES_BY_SET = "; forces are those of the sets, force= of cn.disks and the like: give a function of time, which changes them"
SETTABLE_OF_NODES = ("position", "velocity")
# what gives an array that a scene does not store, by its name
INSTEAD = {
    "contact_force": "SmoothDEM alone keeps it; cn.Probe('contact_force.x', of=ids) records it under every strategy, and "
    "sim.contacts.force [N] acts on the first of the two sim.contacts.bodies, its opposite on the second",
    "reaction": "only driven dofs have one; cn.Probe('contact_force.x', of=ids) records the force of contacts on any body",
    "temperature": "scene.thermal(...) gives bodies a temperature",
    "potential": "scene.electrical(...) gives bodies a potential",
}


class _View:
    """Base of views: attributes are read from a simulation and cannot be assigned."""

    def __setattr__(self, name, value):
        if name.startswith("_"):
            object.__setattr__(self, name, value)
            return
        raise AttributeError(f"{name} cannot be assigned: {self._remedy(name)}")

    def __getitem__(self, name):
        """The array of that name, as the attribute."""
        if not isinstance(name, str):
            raise TypeError(f"{name!r} is no name of an array: give one, and rows of that array, as in position[{name!r}]")
        return getattr(self, name)


class BodyView(_View):
    """Rigid bodies in the order of insertion: position (n, dim), rotation, velocity (n, 3 | 6), mass, inertia, ... and id (n,).

    Every stored array can be read by its name (`names`); `set` writes position, velocity, rotation.
    """

    def __init__(self, simulation, core):
        self._simulation, self._core = simulation, core

    def __len__(self):
        return self._core.body_count

    @property
    def names(self):
        """Arrays that exist in this scene."""
        return [f["name"] for f in self.fields if f["active"]]

    @property
    def fields(self):
        """All possible arrays of bodies, a dict each: name, components, unit, meaning, stage that computes it, bytes, active."""
        return self._core.scene.body_fields()

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        simulation = self._simulation
        if name == "radius":
            return shown(simulation.radii(), self._remedy(name))
        try:
            apart = simulation.ranks is not None and simulation.ranks.kind == "mpi"
            values = self._core.scene.body(name) if apart else self._core.body(name)
        except KeyError:
            raise AttributeError(f"bodies have no array {name!r}; they have {listed(self.names, name)}") from None
        if name == "position" and np.any(simulation.scene.origin):
            values += simulation.scene.origin
        if len(values) == 0 and len(self):
            why = f"ranks keep {name} for their own bodies" if apart else f"this scene needs no {name}, so it is not stored"
            instead = f": {INSTEAD[name]}" if name in INSTEAD and not apart else ""
            raise AttributeError(f"{why}{instead}; it stores {', '.join(self.names)}")
        return shown(values, self._remedy(name))

    def _remedy(self, name):
        if name in SETTABLE:
            return f"sim.bodies.set({name}=x) sets it, x = sim.bodies.{name}.copy() is yours to change"
        if name in ("force", "driven_velocity"):
            return "forces and driven velocities come from the sets of bodies (force=, drive=) and Simulation.drive"
        return f"sim.bodies.set(...) sets {', '.join(SETTABLE[:-1])} and {SETTABLE[-1]}, and nothing else of a body is set"

    def set(self, **arrays):
        """Replaces whole arrays: set(velocity=v). Only position, velocity and rotation can be set."""
        simulation, ready = self._simulation, {}
        simulation._stage.at_rest("bodies.set")
        for name, values in arrays.items():
            if name not in SETTABLE:
                can = f"{', '.join(SETTABLE[:-1])} and {SETTABLE[-1]} can"
                instead = FORCES_BY_SET if name == "force" else meant(name, SETTABLE)
                raise ValueError(f"{name} of bodies cannot be set: {can}{instead}")
            values = checks.real_array(name, values, getattr(self, name).shape)
            if name == "velocity":
                checks.speeds(name, values)
            if name == "position":
                values = values - simulation.scene.origin
            if name == "rotation" and values.ndim == 2:
                size = np.linalg.norm(values, axis=1, keepdims=True)
                if not np.all(size > 0):
                    raise ValueError(f"rotation[{np.argmin(size)}] is zero: give quaternions (w, x, y, z) of unit length")
                values = values / np.where(np.abs(size - 1) <= 4 * np.finfo(float).eps, 1, size)
            ready[name] = np.ascontiguousarray(values)
        simulation._check_same("bodies.set", **ready)
        if simulation._fluid and ("position" in ready or "rotation" in ready):
            simulation._fluid.refuse_moved(ready.get("position"), ready.get("rotation"))
        for name, values in ready.items():
            self._core.assign_body(name, values)


class NodeView(_View):
    """Nodes of all deformable bodies in the order of insertion: position (n, dim), velocity (n, dim), mass, mesh (n,): number of
    the body, from 1 and never reused, id (n,): unique among rigid bodies and parts of meshes, temperature, ...

    The rows of a single body are `simulation.meshes[k].place`. Every stored array can be read by its name (`names`); `set`
    writes position and velocity.
    """

    def __init__(self, simulation, core):
        self._simulation, self._core = simulation, core

    def __len__(self):
        return self._core.node_count

    @property
    def names(self):
        """Arrays that exist in this scene."""
        return [f["name"] for f in self.fields if f["active"]]

    @property
    def fields(self):
        """All possible arrays of nodes, a dict each, as BodyView.fields."""
        return self._core.scene.node_fields()

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            values = self._core.scene.node(name)
        except KeyError:
            raise AttributeError(f"nodes have no array {name!r}; they have {listed(self.names, name)}") from None
        if name == "position":
            values += self._simulation.scene.origin[: self._simulation.scene.dim]
        if len(values) == 0 and len(self):
            raise AttributeError(f"this scene needs no {name}, so it is not stored; it stores {', '.join(self.names)}")
        return shown(values, self._remedy(name))

    def _remedy(self, name):
        return f"sim.nodes.set(position=x, velocity=v) sets nodes, x = sim.nodes.{name}.copy() is yours to change"

    def set(self, **arrays):
        """Replaces whole arrays: set(velocity=v). Only position and velocity can be set."""
        self._simulation._stage.at_rest("nodes.set", **arrays)
        ready = {}
        for name, values in arrays.items():
            if name not in SETTABLE_OF_NODES:
                can = f"{' and '.join(SETTABLE_OF_NODES)} can"
                raise ValueError(f"{name} of nodes cannot be set: {can}{meant(name, SETTABLE_OF_NODES)}")
            values = checks.real_array(name, values, getattr(self, name).shape)
            if name == "velocity":
                checks.speeds(name, values)
            ready[name] = values - self._simulation.scene.origin if name == "position" else values
        for name, values in ready.items():
            self._core.assign_node(name, np.ascontiguousarray(values))


class ContactView(_View):
    """Contacts of the last step: gap (n,) [m], normal (n, dim), point (n, dim) [m], impulse (n, dim) on the first body [N s],
    moment (angular impulse on it, for joints and laws with moments), (n,) in 2D, (n, 3) in 3D [N m s], impulse_local,
    relative_velocity [m/s], status, dissipated [J], bodies (n, 2): ids of rigid bodies (simulation.bodies.id) or, on a mesh, of
    the node with the largest weight (simulation.nodes.id), key (n, 4): identifies a contact from step to step.
    For cohesive laws: beta (1 sound, 0 broken or never bonded), stored and released energy [J]."""

    _names = (
        "bodies",
        "key",
        "gap",
        "normal",
        "point",
        "impulse",
        "impulse_local",
        "moment",
        "relative_velocity",
        "dissipated",
        "beta",
        "stored",
        "released",
        "status",
    )
    _of_networks = ("electrical_conductance", "current", "joule_heat", "thermal_conductance", "heat_flux")

    def __init__(self, simulation, core):
        self._simulation, self._core = simulation, core

    def __len__(self):
        return self._core.contact_count

    def __getattr__(self, name):
        if name not in self._names and not (name in self._of_networks and self._core.has_contact(name)):
            raise AttributeError(f"contacts have no array {name!r}; they have {listed(self.names, name)}")
        return shown(self._core.contact(name), self._remedy(name))

    def _remedy(self, name):
        return "contacts are what the last step found, and are not set; sim.bodies.set(...) sets position, velocity and rotation"

    @property
    def names(self):
        """Names of the arrays that there are."""
        return [*self._names, *(name for name in self._of_networks if self._core.has_contact(name)), "force"]

    def of_laws(self):
        """Arrays of laws that keep their pairs, {name: (n,)}: beta, stored and released [J]; {} in scenes without such laws."""
        return {name: getattr(self, name) for name in ("beta", "stored", "released")} if self._core.laws_keep else {}

    def of_joints(self):
        """Finds the contacts of joints, whose order follows bodies and changes as contacts come and go.

        Returns
        -------
        dict
            {name of a joint, as `join` gave it: its row in these arrays}, in the order in which they were joined; without those
            that were removed; empty before the first step.
        """
        return rows_of_joints(self._simulation, self._core.scene, self.key)

    def releases(self):
        """Energy released by each contact since it began, (n,) [J]; (0,) for smooth contacts, which do not have it."""
        return self.released if self._core.has_contact("released") else np.zeros(0)

    def of_networks(self):
        """Conductances, currents and heat of the contacts by name, {name: (n,)}; {} in scenes without networks."""
        return {name: getattr(self, name) for name in self._of_networks if self._core.has_contact(name)}

    @property
    def force(self):
        """Mean force over the last step, impulse / dt, (n, dim) [N]; none before the first step."""
        impulse, info = self.impulse, self._simulation.info
        return impulse / info["dt"] if "dt" in info else impulse


class ContactorView(_View):
    """Contactors in the order of insertion: shape (m,): names, body (m,): ids of the bodies, or of the nodes, points, edges and
    faces of meshes that carry them, radius (m,) [m], material (m,): numbers of (material, group), id (m,); if needed, offset
    (m, dim) from the centre of the body [m], direction and hull."""

    def __init__(self, core):
        self._core = core

    def __len__(self):
        return self._core.scene.contactor_count

    @property
    def fields(self):
        """All possible arrays of contactors, a dict each, as BodyView.fields."""
        return self._core.scene.contactor_fields()

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        scene = self._core.scene
        try:
            values = scene.carriers() if name == "body" else scene.contactor(name)
        except KeyError:
            known = [f["name"] for f in self.fields if f["active"]]
            raise AttributeError(f"contactors have no array {name!r}; they have {listed(known, name)}") from None
        return shown(values, self._remedy(name))

    def nodes(self):
        """Ids of the nodes of meshes that each contactor follows, (m, 4), padded by -1; stored in run files."""
        return self._core.nodes_of_contactors()

    @property
    def shape(self):
        """Names of the shapes, (m,)."""
        return np.array(_core.shapes())[self.shape_number]

    @property
    def shape_number(self):
        """Numbers of the shapes, (m,), in the list of shapes."""
        return shown(self._core.scene.contactor("shape"), self._remedy("shape"))

    @property
    def hulls(self):
        """Arrays of the hulls that `hull` numbers, by name: vertices, faces, planes, and their first rows for each hull."""
        return self._core.scene.hulls

    def _remedy(self, name):
        return "contactors come with their bodies: Scene.add, Simulation.add"


class RawView(_View):
    """Live arrays of rigid bodies in internal order, and of nodes of meshes in `nodes`. The order changes at a renumbering; a
    view kept across it raises RuntimeError."""

    def __init__(self, core, of="body"):
        self._core, self._of = core, of
        self._order = core.order_version

    @property
    def nodes(self):
        """Live arrays of the nodes of meshes; those of a mesh are e.g. sim.raw.nodes.velocity[sim.meshes[0].rows]."""
        return RawView(self._core, "node")

    def _remedy(self, name):
        return f"write into the array, sim.raw.{name}[:] = x, or give sim.bodies.set(...) arrays in the order of insertion"

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        if self._core.order_version != self._order:
            raise RuntimeError("bodies were renumbered since this view was taken: take sim.raw again after each step")
        _core.hold_whole(self._core)
        try:
            return getattr(self._core.scene, f"raw_{self._of}")(name)
        except KeyError:
            known = [f["name"] for f in getattr(self._core.scene, f"{self._of}_fields")() if f["active"]]
            raise AttributeError(f"there is no live array {name!r}; there are {listed(known, name)}") from None


def core_of(simulation):
    """The core object of a simulation, for code that changes its bodies outside of steps."""
    return simulation.raw._core


SHOWN_STATES = ("accumulated_plastic_strain", "damage")  # states of materials of solids in run files


class MeshView(_View):
    """A deformable body: arrays of its nodes in the order of the mesh. ids (n,): of the nodes, in simulation.nodes.id; all_ids:
    with those of points, edges and faces; held (k,): dofs with imposed velocity; ties: slave dofs and their masters, or None;
    contact_nodes (m,): nodes that may touch."""

    def __init__(self, simulation, core, mesh):
        self._simulation, self._core, self._mesh = simulation, core, mesh

    name = property(lambda self: self._mesh.d.name)
    body = property(lambda self: self._mesh.body)
    ids = property(lambda self: self._mesh.node_ids)
    held = property(lambda self: self._mesh.held)
    ties = property(lambda self: self._mesh.ties)
    contact_nodes = property(lambda self: self._mesh.d.contact_nodes)

    @property
    def modal_damping(self):
        """Matrix of modal damping (n dofs, n dofs), scipy.sparse [N s/m]; None without."""
        from scipy import sparse

        if self._mesh.d.modal_damping is None:
            return None
        shape, rate = self._mesh.modes
        momentum = self.body.M @ shape
        momentum[self.held] = 0
        return sparse.csc_array((momentum * rate) @ momentum.T)

    @property
    def all_ids(self):
        """Ids of its nodes, points between them, edges or faces, (n,)."""
        return self._mesh.all_ids

    def _remedy(self, name):
        return "sim.nodes.set(position=x, velocity=v) sets the nodes of all meshes, x[mesh.place] those of this one"

    def _of_nodes(self, name):
        first = self._core.scene.node_row(self.ids[0])
        return self._core.scene.raw_node(name)[first : first + len(self.ids)].copy()

    @property
    def rows(self):
        """Rows of the nodes, (n,), in the arrays of simulation.raw.nodes until the next renumbering."""
        return self._core.scene.node_row(self.ids[0]) + np.arange(len(self.ids))

    @property
    def place(self):
        """Rows of the nodes in the arrays of simulation.nodes, a slice; changes if an earlier mesh is removed."""
        first = self._core.scene.node_place(self.ids[0])
        return slice(first, first + len(self.ids))

    def load(self, t):
        """External nodal forces at time t [s], (n, dim) [N]."""
        return self._mesh.load(t).reshape(-1, self._mesh.dim)

    def held_velocity(self, t):
        """Imposed velocities of held dofs at time t [s], zero elsewhere, (n, dim) [m/s]."""
        return self._mesh.held_velocity(t).reshape(-1, self._mesh.dim)

    @property
    def position(self):
        """(n, dim) [m]."""
        return self._of_nodes("position") + self._simulation.scene.origin

    @property
    def displacement(self):
        """(n, dim) [m]."""
        origin = self._simulation.scene.origin  # the core's positions are relative to it
        return self._of_nodes("position") - (self.body.points - origin)

    @property
    def velocity(self):
        """(n, dim) [m/s]."""
        return self._of_nodes("velocity")

    @property
    def rotation(self):
        """Rotations of the nodes of corotational beams since the start: angles (n,) in 2D, modulo a turn [rad]; unit quaternions
        (n, 4), w first, in 3D. Raises AttributeError for other bodies."""
        if not hasattr(self.body, "rotations"):
            raise AttributeError(f"the nodes of {self._mesh.d.name!r} have no rotations: those of cairn.beams(..., "
                                 "kinematics='corotational') do")  # fmt: skip
        return self.body.rotations(self._mesh.called)

    @property
    def section_forces(self):
        """Section forces of cairn.bars and cairn.beams after the last step, {name: values}.

        "axial_force" (m,) [N]: tension positive. Beams also have: "shear_force" [N]: transverse force on the second end, (m,) in
        2D, (m, 2) in 3D along the second and the third axis of the section. "bending_moment" [N m]: EI times the curvature of the
        deflection, (m, 2) in 2D at the first and the second end; (m, 4) in 3D: for the deflections along the second and the third
        axis at the first end, then at the second. "torsion_moment" (m,) [N m], in 3D: about the axis, on the second end.
        Raises AttributeError for other bodies.
        """
        if not hasattr(self.body, "section_forces"):
            raise AttributeError(f"{self._mesh.d.name!r} has no sections: cairn.bars and cairn.beams have")
        return self.body.section_forces(self.displacement, getattr(self._mesh, "called", None))

    @property
    def stress(self):
        """Stress in the middle of each cell, {kind: (m, 3 | 6)} [Pa], see cairn.elastic.ElasticBody.stress; for a SolidBody the
        mean Cauchy stress of each cell in the last step, (m, 6)."""
        if hasattr(self.body, "blocks"):
            from ..model.solid import by_kinds

            return by_kinds(self.body, (stress for stress, _ in self._bulk()))
        found, warmth = self.body.stress(self.displacement), self._warmth()
        if warmth is None:
            return found
        from ..networks.meshes import stress

        return stress(self._mesh, found, *warmth)

    @property
    def stress_zz(self):
        """Out-of-plane stress in the middle of each cell of a body in 2D, {kind: (m,)} [Pa]: in plane strain the reaction to the
        zero strain, for axisymmetric bodies the hoop stress, in plane stress zero."""
        if self._mesh.dim != 2:
            raise AttributeError(f"{self._mesh.d.name!r} is in 3D: `stress` has zz, its third component")
        return self._across(self.stress)

    def _across(self, stress):
        if hasattr(self.body, "blocks"):
            return {kind: found[:, 2] for kind, found in stress.items()}
        warmth = self._warmth()
        if warmth is None:
            return self.body.stress_across(stress)
        from ..networks.meshes import stress_across

        return stress_across(self._mesh, stress, *warmth)

    def _warmth(self):
        """(temperatures of the nodes [K], expansion [1/K], reference temperature [K]); None without thermal expansion."""
        thermal = self._simulation.scene.networks.get("thermal")
        expansion = 0.0 if thermal is None else self._mesh.d.material.expansion
        return (self._of_nodes("temperature"), expansion, thermal.reference) if expansion else None

    @property
    def material_state(self):
        """Mean material states of the cells of a SolidBody, {kind: {name: (m,)}}; zero in cells of materials without them."""
        if not hasattr(self.body, "blocks"):
            return {}
        out = {kind: {} for kind in self.body.cells}
        for (kind, rows, material), (_, state) in zip(self.body.layout(), self._bulk()):
            for name, values in zip(material.state if material else (), state.T):
                out[kind].setdefault(name, np.zeros(len(self.body.cells[kind])))[rows] = values
        return out

    def _bulk(self):
        return self._core.mesh_bulk(self._mesh.number)

    def reaction(self, group=None):
        """Reactions on held dofs, mean over the last step, (n, dim) [N], zero elsewhere; with a group their sum (dim,):
        probes={"pull": lambda s: s.meshes[0].reaction("top")[1]}."""
        found = np.zeros(self._mesh.size)
        found[self.held] = self._core.mesh_forces(self._mesh.number)[1][self.held]
        found = found.reshape(-1, self._mesh.dim)
        return found if group is None else found[self.body_nodes(group)].sum(axis=0)

    def body_nodes(self, group):
        """Nodes of a group of the mesh, or the numbers themselves."""
        from ..model.mesh_parts import group_nodes

        return group_nodes(self.body, group)

    @property
    def contact_force(self):
        """Contact forces on the nodes, mean over the last step, (n, dim) [N]; forces on edges, faces and points between nodes are
        distributed by the weights of the nodes."""
        impulses = self._core.mesh_forces(self._mesh.number)[0].reshape(-1, self._mesh.dim)
        h = self._simulation.info.get("dt", 0.0)
        return impulses / h if h > 0 else np.zeros_like(impulses)

    @property
    def contact_pressure(self):
        """Contact pressure at the nodes, over their tributary areas of the deformed surface, (n,) [Pa]."""
        from ..model.mesh_measures import pressure_of

        return pressure_of(self.body, self.displacement, self.contact_force)

    @property
    def strain(self):
        """Strain in the middle of each cell, {kind: (m, 3 | 6)} in the order xx yy [zz] xy [yz zx], tensor shear: small strain
        for a linear body and small kinematics, else Hencky's ln V in the axes of space."""
        from ..model.mesh_measures import mean_strain

        large = getattr(self.body, "kinematics", "small") != "small"
        return mean_strain(self.body, self.displacement, large)

    def nodal_fields(self):
        """Fields of the nodes in a run file by name, (n,) or (n, 3 | 6): stress, in 2D stress_zz, strain, contact_pressure, and
        accumulated_plastic_strain and damage if the material has them; for corotational beams only beam_rotation, see
        `rotation`."""
        if hasattr(self.body, "section_forces"):
            beams = hasattr(self.body, "rotations") and "inertia" in self.body.sections
            return {"beam_rotation": self.rotation} if beams else {}
        stress = self.stress
        out = {"stress": self._mean_stress(stress), "strain": self.body.nodal_mean(self.strain)}
        if self._mesh.dim == 2:
            across = {kind: of_cells[:, None] for kind, of_cells in self._across(stress).items()}
            out["stress_zz"] = self.body.nodal_mean(across)[:, 0]
        states = self.material_state
        for name in SHOWN_STATES:
            if any(name in of_kind for of_kind in states.values()):
                of_cells = {
                    kind: of_kind.get(name, np.zeros(len(self.body.cells[kind])))[:, None] for kind, of_kind in states.items()
                }
                out[name] = self.body.nodal_mean(of_cells)[:, 0]
        return out | {"contact_pressure": self.contact_pressure}

    def cell_fields(self):
        """Fields of the cells in a run file by name, (m,) or (m, 3 | 6), concatenated over the kinds of cells: stress and strain
        in the order xx yy [zz] xy [yz zx], in 2D stress_zz, accumulated_plastic_strain and damage if the material has them; for
        bars and beams those of section_forces."""
        if hasattr(self.body, "section_forces"):
            return self.section_forces

        def joined(of_kinds):
            return np.concatenate([of_kinds[kind] for kind in self.body.cells])

        of_kinds, states = self.stress, self.material_state
        stress = joined(of_kinds)
        narrow = self._mesh.dim == 2 and stress.shape[1] == 6
        out = {"stress": stress[:, [0, 1, 3]] if narrow else stress, "strain": joined(self.strain)}
        if self._mesh.dim == 2:
            out["stress_zz"] = joined(self._across(of_kinds))
        for name in SHOWN_STATES:
            if any(name in of_kind for of_kind in states.values()):
                out[name] = joined({k: of.get(name, np.zeros(len(self.body.cells[k]))) for k, of in states.items()})
        return out

    def nodal_stress(self):
        """Mean stress of the cells round each node, (n, 3 | 6) in the order xx yy [zz] xy [yz zx] [Pa]."""
        return self._mean_stress(self.stress)

    def _mean_stress(self, stress):
        means = self.body.nodal_mean(stress)
        return means[:, [0, 1, 3]] if self._mesh.dim == 2 and means.shape[1] == 6 else means
