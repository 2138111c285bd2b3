"""Bars and beams with displacements and rotations of any size; made by cairn.bars and cairn.beams."""

from __future__ import annotations

import numpy as np

from .. import _core
from ..base import checks
from .mesh_parts import GivenBody
from .section_forces import axes_of, told


class FrameBody(GivenBody):
    """A truss or a frame of corotational or total Lagrangian cells.

    A corotational bar or beam (Crisfield 1990; Felippa & Haugen 2005) is the linear element in axes that move with it. Rotations
    of nodes have no inertia: at each displacement they are solved for zero moments. M, K and C are those of the undeformed
    frame. Made by cairn.bars(..., kinematics=...) and cairn.beams(..., kinematics="corotational").
    """

    def __init__(self, points, cells, kinematics, sections, mass, stiffness, damping, groups=None):
        #: arguments of the constructor, which scene files store
        self.given = {name: value for name, value in locals().items() if name != "self"}
        from scipy import sparse

        from .triangles_of_matrices import lower_triangles

        self.points = np.ascontiguousarray(points, float)
        self.dim, n = self.points.shape[1], self.points.size
        self.kinematics, self.sections, self.lines = kinematics, dict(sections), np.asarray(cells, int)
        self.groups = checks.node_groups(groups, len(self.points))
        self.edges = self.faces = None
        self.M, self.K, self.C = (sparse.csc_array(a) for a in (mass, stiffness, damping))
        start, row = self._made().lower()
        marks = sparse.csc_array((np.ones(len(row)), row, start), (n, n))
        start, row, (_, *values) = lower_triangles([marks, self.M, self.K, self.C], n)
        start, row = np.ascontiguousarray(start, np.int64), np.ascontiguousarray(row, np.int32)
        self.lower = start, row, *values

    def _made(self):
        s = {name: np.ascontiguousarray(value).ravel() for name, value in self.sections.items()}
        s |= {"points": self.points.ravel(), "cells": self.lines.astype(np.int32).ravel()}
        if "clamped" in s:
            s["clamped"] = s["clamped"].astype(np.int32)
        return _core.FrameModel(self.dim, self.kinematics, s)

    def model(self):
        """A new _core.FrameModel, which evaluates the forces and keeps the rotations of the nodes."""
        made = self._made()
        made.fit(*self.lower[:2])
        return made

    def model_of(self, simulation, name):
        """The _core.FrameModel for a simulation."""
        return self.model()

    def rotations(self, model):
        """Rotations of the nodes after the last step of a simulation, or the last call with that model: angles (n,) [rad] in 2D,
        unit quaternions (n, 4), w first, in 3D. Raises AttributeError for bars, whose nodes have no rotation."""
        turned = model.rotations()
        if not len(turned):
            raise AttributeError("bars turn freely about their nodes, which have no rotations: those of corotational beams do")
        if self.dim == 2:
            return np.arctan2(turned[:, 0, 1], turned[:, 0, 0])
        from ..pre.mass_properties import quaternions

        return quaternions(np.swapaxes(turned, 1, 2))

    def section_forces(self, displacement, model=None):
        """Section forces of each cell at a displacement (n, dim) [m], {name: (m, ...)}: see MeshView.section_forces. The solution
        for rotations starts from those kept by `model`. Raises ValueError naming the cell."""
        u, dim = np.ascontiguousarray(displacement, float).ravel(), self.dim
        held, turned = (model or self.model()).borne(u)
        axes = axes_of(self.points + u.reshape(-1, dim), self.lines) if dim == 2 or held.shape[1] == 3 else None
        if held.shape[1] == 3:
            return told(axes, held[:, :dim], None, None)
        if dim == 2:
            return told(axes, held[:, :2], held[:, 5:6], held[:, 8:9])
        # axes of the section: mean of those rotated with both ends, made normal to the beam
        along = np.diff((self.points + u.reshape(-1, dim))[self.lines], axis=1)[:, 0]
        along /= np.linalg.norm(along, axis=1)[:, None]
        first = axes_of(self.points, self.lines, np.asarray(self.sections["up"], float))[:, 1]
        second = np.einsum("meck,mc->mk", turned[self.lines], first)
        second -= np.einsum("mk,mk->m", second, along)[:, None] * along
        second /= np.linalg.norm(second, axis=1)[:, None]
        axes = np.stack([along, second, np.cross(along, second)], axis=1)
        return told(axes, held[:, :3], held[:, 3:6], held[:, 6:9])

    def tangent(self, displacement, model=None):
        """Forces (n dofs) [N], their derivative (n dofs, n dofs), scipy.sparse [N/m], and the energy [J] at a displacement
        (n, dim) [m]. The solution for rotations starts from the last call with the same model. Raises ValueError naming the cell.
        """
        from scipy import sparse

        u = np.ascontiguousarray(displacement, float).ravel()
        if u.size != self.points.size:
            raise ValueError(f"displacement holds {u.size} numbers: give ({len(self.points)}, {self.dim})")
        start, row = self.lower[:2]
        own = model or self.model()
        force, values, wrong, energy = own.evaluate(u, len(row))
        if wrong is not None:
            raise ValueError(wrong)
        own.commit()
        below = sparse.csc_array((values, row, start), (u.size, u.size))
        return force, (below + sparse.tril(below, -1).T).tocsc(), energy

    def solve(self, fixed, force=None, *, displacement=None, start=None, model=None, increments=1, tolerance=1e-10, most=100):
        """Displacement in static equilibrium (n, dim) [m] under dead forces (n dofs) [N], by Newton's method.

        The load is applied in `increments` equal parts, each until the residual is `tolerance` of the largest force, or rounding.
        fixed: {group: axes}, as for `deformable`; displacement (n, dim): imposed on these dofs [m], zero when not given; start
        (n, dim): initial displacement [m]; model: gives the initial rotations; most: iterations of an increment. Raises
        ValueError without convergence: give more increments, or a nearer start.
        """
        model = model or self.model()
        u = np.zeros(self.points.size) if start is None else np.array(start, float).ravel()
        held = np.zeros(u.size, bool)
        for group, axes in fixed.items():
            for axis in axes:
                held[self.dim * self.groups[group] + "xyz".index(axis)] = True
        wanted, free = np.zeros(u.size) if displacement is None else np.array(displacement, float).ravel(), ~held
        load, was = np.zeros(u.size) if force is None else np.array(force, float).ravel(), u.copy()
        begin, tangent, _ = self.tangent(u, model)
        begin = np.where(free, begin, 0.0)
        for part in np.arange(1, increments + 1) / increments:
            aim = begin + part * (load - begin)
            way = np.where(held, was + part * (wanted - was) - u, 0.0)
            inner, tangent, _ = self.tangent(u, model)
            for passed in range(most):
                left = aim - inner
                if passed == 0:
                    left = left - tangent @ way
                step = way.copy() if passed == 0 else np.zeros(u.size)
                step[free] += _solved(tangent[free][:, free].tocsc(), left[free])
                u, inner, tangent, done = self._stepped(u, step, aim, free, model, tolerance, passed)
                if done:
                    break
            else:
                raise ValueError(f"no equilibrium is found after {most} passes at {part:g} of the load: give more increments")
        return u.reshape(self.points.shape)

    def _force_of_a_radian(self):
        """Largest end force of a beam for an end rotation of 1 rad [N]; times the rounding of axes it bounds the residual."""
        if "inertia" not in self.sections:
            return 0.0
        s, length = self.sections, np.linalg.norm(np.diff(self.points[self.lines], axis=1)[:, 0], axis=1)
        most = np.maximum(12 * s["young"] * np.max(s["inertia"], axis=1), s["shear"] * s["torsion"])
        return (most / length**2).max(initial=0.0)

    def _stepped(self, u, step, aim, free, model, tolerance, passed):
        share = min(1.0, 0.5 * np.ptp(self.points, axis=0).max() / max(np.abs(step).max(), 1e-300)) if passed else 1.0
        for _ in range(30):
            try:
                inner, tangent, _ = self.tangent(u + share * step, model)
                break
            except ValueError as error:
                failed, share = error, share / 2
        else:
            raise failed
        u, left = u + share * step, np.abs((aim - inner)[free]).max(initial=0.0)
        rounding = np.finfo(float).eps * (4 * (abs(tangent) @ np.abs(u)).max() + self._force_of_a_radian())
        return u, inner, tangent, left <= max(tolerance * max(np.abs(inner).max(), np.abs(aim).max()), rounding)


def _solved(tangent, left):
    from scipy.sparse.linalg import splu

    try:
        step = splu(tangent).solve(left)
    except RuntimeError:  # a pivot is zero
        step = np.array([np.nan])
    if not np.all(np.isfinite(step)):
        raise ValueError("the tangent is singular, as of bars that nothing pulls across them: hold more dofs, give a start under "
                         "load, or initial_stress")  # fmt: skip
    return step
