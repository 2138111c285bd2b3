"""Figures of a running simulation that users name, as scalars for statistics."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from ..names import listed

SUMMARY = {
    "solid_fraction": "share of the middle (5% to 95% quantiles of centres) that disks or spheres fill",
    "boundary_force": "sum over the boundaries of the resultant on each, averaged over time [N]; boundary_force:GROUP of one",
    "kinetic_energy": "of all bodies [J]",
    "energy": "what was lost or gained of kinetic and potential energy since the start of the run [J]",
    "mean_height": "of the free bodies, against gravity or along the last axis [m]",
    "displacement": "root of the mean square displacement of the free bodies since the start of the run [m]",
    "coordination": "mean number of loaded contacts of a free body",
}


def free_bodies(sim):
    """Rows of the bodies that are wholly free to move, (n,) of bool."""
    return boundary_parts(sim)[1]


def movers(sim):
    """Rigid bodies and nodes of meshes by rising id: id (n,), position (n, dim) [m], velocity (n, dim) [m/s], mass (n,) [kg],
    radius (n,) [m], 0 of nodes."""
    bodies, nodes, dim = sim.bodies, sim.nodes, sim.scene.dim
    ids = np.concatenate([bodies.id, nodes.id])
    order = np.argsort(ids)
    both = {name: np.concatenate([getattr(bodies, name), getattr(nodes, name)])[order] for name in ("position", "mass")}
    velocity = np.concatenate([bodies.velocity[:, :dim], nodes.velocity])[order]
    radius = np.concatenate([sim.radii(), np.zeros(len(nodes))])[order]
    return SimpleNamespace(id=ids[order], velocity=velocity, radius=radius, **both)


def boundary_parts(sim):
    """Boundaries and free bodies: ({name: ids of the bodies}, (n,) of bool).

    A boundary is a set of bodies that are held, driven in some dof or of infinite mass; its name is its group's or its number.
    Nodes of a mesh are held where all of their displacements are: one that is guided along an axis moves.
    """
    both = movers(sim)
    ids, free = both.id, np.isfinite(both.mass)
    for s in sim._sets:
        if s.driven and s.mesh is None:
            free &= ~np.isin(ids, s.ids)
    for mesh in sim.meshes:
        whole = np.bincount(mesh.held // sim.scene.dim, minlength=len(mesh.ids)) == sim.scene.dim
        free &= ~np.isin(ids, mesh.ids[whole])
    parts = {}
    for k, s in enumerate(sim._sets):
        rows = np.isin(ids, s.ids)
        if np.any(rows) and not np.any(free & rows):
            name = s.group or f"set {k}"
            parts[name] = np.union1d(parts.get(name, np.zeros(0, np.int64)), ids[rows])
    return parts, free


def boundary_impulses(sim, parts):
    """Sum of the contact impulses of the last step on each boundary, (parts, dim) [N s]."""
    pairs, impulse = sim.contacts.bodies, sim.contacts.impulse
    out = np.zeros((len(parts), sim.scene.dim))
    for k, ids in enumerate(parts.values()):
        sign = np.isin(pairs[:, 0], ids).astype(float) - np.isin(pairs[:, 1], ids)
        out[k] = sign @ impulse
    return out


def contact_momentum(sim):
    """Linear momentum that contacts gave to each body or node in the last step, (n, dim) [N s]."""
    ids, pairs, impulse = movers(sim).id, sim.contacts.bodies, sim.contacts.impulse
    out = np.zeros((len(ids), sim.scene.dim))
    np.add.at(out, np.searchsorted(ids, pairs[:, 0]), impulse)
    np.subtract.at(out, np.searchsorted(ids, pairs[:, 1]), impulse)
    return out


class Recorder:
    """Gathers figures over a run and averages them over its later part.

    names: built-in figures (see SUMMARY), or keys of own, {name: function(sim) -> number}. scale: reference value of each figure
    whose error is not relative to the figure itself (energy: the energy in play; mean_height: the extent of the free bodies), set
    at the end.
    """

    def __init__(self, sim, names, own=None):
        self.sim, self.names, self.own = sim, list(names), own or {}
        self.parts, self.free = boundary_parts(sim)
        for name in self.names:
            if name not in self.own:
                self._chosen(name)
            if name.partition(":")[0] not in SUMMARY and name not in self.own:
                raise ValueError(f"there is no figure {name!r}: give one of {listed([*SUMMARY, *self.own], name)}")
        if not np.any(self.free):
            raise ValueError("the scene has no body that is free to move: there is nothing to measure")
        self.start = movers(sim).position[self.free]
        self.start_energy = self._mechanical()
        self.axis = self._upward()
        self.extent = float(np.ptp(self.start @ self.axis))
        self.forces = [name for name in self.names if _is_force(name) and name not in self.own]
        self.sums = {name: 0.0 for name in self.names}
        self.samples, self.impulses, self.time = 0, 0.0, 0.0

    def _upward(self):
        gravity = self.sim.scene.gravity
        gravity = np.asarray(gravity(self.sim.time) if callable(gravity) else gravity, float)
        size = np.linalg.norm(gravity)
        return -gravity / size if size > 0 else np.eye(self.sim.scene.dim)[-1]

    def _mechanical(self):
        energy = self.sim.energy
        return energy["kinetic"] + energy["potential"]

    def after_step(self, dt):
        """To be called after each step of the averaged part: impulses come in knocks, so that each step counts."""
        if self.forces:
            self.impulses = self.impulses + boundary_impulses(self.sim, self.parts)
            self.time += dt

    def sample(self):
        """Adds the figures of the state at hand to the averages."""
        self.samples += 1
        for name in self.names:
            if name in self.own:
                value = self.own[name](self.sim)
            elif name in self.forces:
                continue
            else:
                value = getattr(self, f"_{name}")()
            self.sums[name] += float(value)

    def values(self):
        """Averages, {name: number}."""
        out = {name: total / self.samples if self.samples else float("nan") for name, total in self.sums.items()}
        for name in self.forces:
            force = np.linalg.norm(self.impulses / self.time, axis=1)
            out[name] = float(np.sum(force[self._chosen(name)]))
        return out

    def scales(self):
        """Reference scales for the relative errors of some figures, {name: number}; others are relative to their own mean."""
        known = {"energy": self.sim.energy["in_play"], "mean_height": self.extent}
        return {name: float(known[name]) for name in self.names if name in known and name not in self.own}

    def _chosen(self, name):
        """Which boundaries a boundary_force means, (parts,) of bool."""
        if not _is_force(name):
            return None
        if not self.parts:
            raise ValueError("boundary_force needs a boundary: a wall, or a set of bodies that are held or driven")
        wanted = name.partition(":")[2]
        if wanted and wanted not in self.parts:
            raise ValueError(f"{name}: there is no boundary {wanted!r}: the scene has {', '.join(self.parts)}")
        return np.array([wanted in ("", part) for part in self.parts])

    def _solid_fraction(self):
        from ..pre import solid_fraction

        sim = self.sim
        radii = movers(sim).radius[self.free]
        if not np.all(radii > 0) or _compound(sim, self.free):
            raise ValueError("solid_fraction knows disks and spheres: name another figure, or define figure_... of your own")
        centers = movers(sim).position[self.free]
        low, high = np.quantile(centers, (0.05, 0.95), axis=0)
        share = 1.0
        periodic = sim.scene.periodic
        if periodic is not None:
            for axis, length in enumerate(periodic.lengths):
                if 0 < length < np.inf:  # bodies across the cell's border count whole, once
                    low[axis], high[axis] = (centers[:, axis] - radii).min(), (centers[:, axis] + radii).max()
                    share *= (high[axis] - low[axis]) / length
        return share * solid_fraction(centers, radii, low, high)

    def _kinetic_energy(self):
        return self.sim.energy["kinetic"]

    def _energy(self):
        return self._mechanical() - self.start_energy

    def _mean_height(self):
        return np.mean(movers(self.sim).position[self.free] @ self.axis)

    def _displacement(self):
        moved = movers(self.sim).position[self.free] - self.start
        if self.sim.scene.periodic is not None:
            lengths = np.asarray(self.sim.scene.periodic.lengths, float)
            round_ = np.isfinite(lengths) & (lengths > 0)
            moved[:, round_] -= lengths[round_] * np.rint(moved[:, round_] / lengths[round_])
        return np.sqrt(np.mean(np.sum(moved**2, axis=1)))

    def _coordination(self):
        from ..post.measures import coordination_number

        sim = self.sim
        loaded = np.any(sim.contacts.impulse != 0, axis=1)
        rows = np.searchsorted(movers(sim).id, sim.contacts.bodies[loaded])
        return coordination_number(len(self.free), rows[:, 0], rows[:, 1], counted=self.free)


def _is_force(name):
    return name.partition(":")[0] == "boundary_force"


def _compound(sim, free):
    """True if a free body has more than one contactor."""
    owners = sim.contactors.body
    owners = owners[np.isin(owners, movers(sim).id[free])]
    return len(np.unique(owners)) != len(owners)
