"""Arrays of a running simulation, as numpy copies, under the names of the field."""

from __future__ import annotations

import numpy as np

from .pre import checks


class BodyView:
    """Bodies in the order of insertion: position (n, dim), rotation, velocity (n, 3 | 6), mass, inertia, ... and id (n,).

    Every stored array can be read by its name (`names`); `set` writes position, velocity, rotation.
    """

    def __init__(self, simulation):
        self._simulation = simulation

    def __len__(self):
        return self._simulation._core.scene.body_count

    @property
    def names(self):
        """Arrays that exist in this scene."""
        return [f["name"] for f in self._simulation._core.scene.body_fields() if f["active"]]

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        simulation = self._simulation
        if name == "radius":
            return simulation.radii()
        try:
            values = simulation._core.scene.body(name)
        except KeyError:
            raise AttributeError(f"bodies have no array {name!r}; they have {', '.join(self.names)}") from None
        if name == "position" and np.any(simulation.scene.origin):
            values += simulation.scene.origin
        if len(values) == 0 and len(self):
            raise AttributeError(f"this scene needs no {name}, so it is not stored; it stores {', '.join(self.names)}")
        return values

    def set(self, **arrays):
        """Replaces whole arrays: set(velocity=v). Only position, velocity and rotation can be set."""
        simulation, ready = self._simulation, {}
        for name, values in arrays.items():
            if name not in ("position", "velocity", "rotation"):
                raise ValueError(f"{name} of bodies cannot be set: position, velocity and rotation can")
            values = checks.real_array(name, values, getattr(self, name).shape)
            if name == "position":
                values = values - simulation.scene.origin
            if name == "rotation" and values.ndim == 2:
                size = np.linalg.norm(values, axis=1, keepdims=True)
                if not np.all(size > 0):
                    raise ValueError(f"rotation[{np.argmin(size)}] is zero: give quaternions (w, x, y, z) of unit length")
                values = values / np.where(np.abs(size - 1) <= 4 * np.finfo(float).eps, 1, size)
            ready[name] = np.ascontiguousarray(values)
        for name, values in ready.items():
            simulation._core.assign_body(name, values)


class ContactView:
    """Contacts of the last step: gap (n,), normal (n, dim), point (n, dim), impulse (n, dim) on the first body [N s],
    impulse_local, relative_velocity, status, dissipated [J], bodies (n, 2) ids, key (n, 4), by which a contact is found again."""

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
        "status",
    )

    def __init__(self, simulation):
        self._simulation = simulation

    def __len__(self):
        return self._simulation._core.contact_count

    def __getattr__(self, name):
        if name not in self._names:
            raise AttributeError(f"contacts have no array {name!r}; they have {', '.join(self._names)}, force")
        return self._simulation._core.contact(name)

    @property
    def force(self):
        """Mean force over the last step, impulse / dt, (n, dim) [N]; none before the first step."""
        impulse, info = self.impulse, self._simulation.info
        return impulse / info["dt"] if "dt" in info else impulse


class RawView:
    """The live arrays in internal order. Order changes at a renumbering: a view kept across one is refused."""

    def __init__(self, simulation):
        self._simulation = simulation
        self._order = simulation._core.order_version

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        if self._simulation._core.order_version != self._order:
            raise RuntimeError("bodies were renumbered since this view was taken: take sim.raw again after each step")
        return self._simulation._core.scene.raw_body(name)


class MeshView:
    """A deformable body: arrays of its nodes in the order of the mesh."""

    def __init__(self, simulation, mesh):
        self._simulation, self._mesh = simulation, mesh
        self.name, self.body, self.ids = mesh.d.name, mesh.body, mesh.node_ids

    def _of_nodes(self, name):
        core = self._simulation._core.scene
        return core.body(name)[np.searchsorted(core.body("id"), self.ids)]

    @property
    def displacement(self):
        """(n, dim) [m]."""
        return self._of_nodes("position") - self.body.points

    @property
    def velocity(self):
        """(n, dim) [m/s]."""
        return self._of_nodes("velocity")[:, : self._mesh.dim]

    @property
    def stress(self):
        """Stress in the middle of each cell, {kind: (m, 3 | 6)}, see cairn.elastic.ElasticBody.stress [Pa]."""
        return self.body.stress(self.displacement)
