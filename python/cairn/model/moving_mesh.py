"""A mesh that moves in a simulation: its loads, its held and displaced nodes, and its ids in the core."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ..base import checks
from .mesh_parts import group_nodes
from .meshes import is_linear


class MovingMesh:
    """A Deformable in a simulation: ids of its nodes, points and sides (edges, faces), its held dofs and loads.

    Parameters
    ----------
    d : Deformable
        The deformable body.
    node_ids : ndarray
        Ids of its nodes and points.
    side_ids : ndarray
        Ids of its edges or faces.
    """

    def __init__(self, d, node_ids, side_ids):
        n = len(d.body.points)
        self.d, self.body = d, d.body
        self.node_ids, self.point_ids, self.side_ids = node_ids[:n], node_ids[n:], side_ids
        self.dim, self.size = d.body.dim, d.body.points.size
        fixed = [(group_nodes(d.body, g), k) for g, axes in d.fixed.items() for k in checks.fixed_axes(g, axes, self.dim)]
        held = [self.dim * nodes + k for nodes, k in fixed]
        self.held = np.unique(np.concatenate(held)) if held else np.zeros(0, int)
        self.called = None  # forces of another code, as the core calls them
        self._named = {}  # nodes of groups by their names

    @property
    def all_ids(self):
        """Ids of its nodes, points, then edges or faces."""
        return np.concatenate([self.node_ids, self.point_ids, self.side_ids])

    @cached_property
    def ties(self):
        """Slave dofs and their masters, as the core takes them; None without ties and rigid parts."""
        if not self.d.rigid and getattr(self.body, "ties", None) is None:
            return None
        from .ties import rigid_parts, rows_of_ties

        return rows_of_ties(self.body, rigid_parts(self.body, self.d.rigid), self.held)

    @cached_property
    def modes(self):
        """Damped modes (dofs, n) of unit modal mass, and their damping rates (n,) [1/s]."""
        from .modal_damping import damped_modes

        if self.ties:
            raise ValueError(f"{self.d.name!r} has ties, and modal_damping is of a body without: give rayleigh")
        if self.d.opening is not None:
            raise ValueError(f"{self.d.name!r} may crack, and its modes with it: leave modal_damping out, or give rayleigh")
        return damped_modes(self.body, self.free, self.d.modal_damping, self.d.name)

    @cached_property
    def free(self):
        """Dofs that are not held."""
        return np.setdiff1d(np.arange(self.size), self.held)

    def nodes_of(self, group):
        """Numbers of the nodes of a group; those of a name are found once, since steps ask for them again."""
        if not isinstance(group, str):
            return group_nodes(self.body, group)
        if group not in self._named:
            self._named[group] = group_nodes(self.body, group)
        return self._named[group]

    # ------------------------------------------------------------------ state

    def load(self, t):
        """Gives the nodal forces of `force`, tractions and body forces.

        Parameters
        ----------
        t : float
            Time [s].

        Returns
        -------
        ndarray (n dofs,)
            Forces [N].
        """
        given = self.d.force(t) if callable(self.d.force) else self.d.force
        out = np.zeros((self.size // self.dim, self.dim))
        for group, total in (given or {}).items():
            nodes = self.nodes_of(group)
            total = total(t) if callable(total) else total
            out[nodes] += checks.real_array(f"force of {group!r}", total, (self.dim,)) / len(nodes)
        if self.d.loads:
            from .dead_loads import at_time

            at_time(self.d.loads, t, out)
        return out.ravel()

    def pressure_load(self, t, x):
        """Gives the nodal forces of the pressures.

        Parameters
        ----------
        t : float
            Time [s].
        x : ndarray (n, dim)
            Positions of the nodes [m].

        Returns
        -------
        ndarray (n dofs,)
            Forces [N].
        """
        from .pressure import forces

        out = np.zeros(x.shape)
        for sides, p in self.d.pressed:
            out += forces(self.body, sides, x) * checks.number("pressure", p(t) if callable(p) else p)
        return out.ravel()

    @property
    def follows_pressure(self):
        """True if Newton's method includes the pressures at the end of the step: for bodies that are not linear."""
        return bool(self.d.pressed) and not is_linear(self.body)

    def pressed_parts(self, origin):
        """Gives the sides under pressure as the core takes them, grouped by form, in the order of `pressures`.

        Parameters
        ----------
        origin : ndarray (dim,)
            Origin of the scene [m].

        Returns
        -------
        list of dict
            Nodes and form of each part.
        """
        ring = getattr(self.body, "plane", "") == "axisymmetric"
        common = {"ring": ring, "thickness": float(getattr(self.body, "thickness", 1.0)), "axis": -float(origin[0])}
        return [{"nodes": part.shape[1], "node": part.astype(np.int32).ravel(), **common} for part, _ in self._pressed()]

    def pressures(self, begin, end):
        """Gives the pressures on the parts of `pressed_parts` at two times.

        Parameters
        ----------
        begin : float
            One time [s].
        end : float
            The other time [s].

        Returns
        -------
        ndarray (parts, 2)
            Pressures [Pa].
        """
        return np.array(
            [[checks.number("pressure", p(t) if callable(p) else p) for t in (begin, end)] for _, p in self._pressed()]
        )

    def _pressed(self):
        for sides, p in self.d.pressed:
            for part in sides:
                wide = part[:, -1] >= 0
                for some in (part[wide], part[~wide][:, :-1]):
                    if len(some):
                        yield some, p

    def held_velocity(self, t):
        """Gives the imposed velocity of driven dofs, zero elsewhere.

        Parameters
        ----------
        t : float
            Time [s].

        Returns
        -------
        ndarray (n dofs,)
            Velocities [m/s].
        """
        out = np.zeros(self.size)
        for group, by_axis in self.d.drive.items():
            for axis, v in by_axis.items():
                out[self.dim * self.nodes_of(group) + "xyz".index(axis)] = checks.number(
                    f"drive of {group!r}", v(t) if callable(v) else v
                )
        return out

    def displaced_velocity(self, t, h, share, u, v, out):
        """Writes the velocities at the end of a step of dofs with imposed displacement.

        The step moves dofs by h ((1 - share) v + share out); the velocity is chosen so that an error in the displacement is gone
        after two steps at most.

        Parameters
        ----------
        t : float
            Beginning of the step [s].
        h : float
            Length of the step [s].
        share : float
            Weight of the end of the step [-].
        u : ndarray (n dofs,)
            Displacements at the beginning [m].
        v : ndarray (n dofs,)
            Velocities at the beginning [m/s].
        out : ndarray (n dofs,)
            Takes the velocities [m/s].
        """
        for group, by_axis in self.d.displace.items():
            for axis, given in by_axis.items():
                dofs = self.dim * self.nodes_of(group) + "xyz".index(axis)
                begin, half, end = (checks.number("displace", given(at)) for at in (t, t + h / 2, t + h))
                rate = (3 * end - 4 * half + begin) / h
                out[dofs] = (end - u[dofs]) / h + (1 - share) * (rate - v[dofs])
