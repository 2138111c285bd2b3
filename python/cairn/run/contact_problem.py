"""The contact problem of a step, u = W r + q with Coulomb's cone, taken out of a simulation."""

from __future__ import annotations

import numpy as np


def jacobians(rows, chosen):
    """Relative velocity of each contact from the velocities of its two bodies, (m, dim, 2, dofs)."""
    dim, dofs, m = rows.dim, 3 * rows.dim - 3, len(chosen)
    axes, lever = rows.axes[chosen], rows.lever[chosen]
    values = np.zeros((m, dim, 2, dofs))
    for side, sign in ((0, 1.0), (1, -1.0)):
        values[:, :, side, :dim] = sign * axes
        arm = lever[:, side]
        if dim == 2:
            values[:, :, side, 2] = sign * (arm[:, None, 0] * axes[:, :, 1] - arm[:, None, 1] * axes[:, :, 0])
        else:
            values[:, :, side, 3:] = sign * np.cross(arm[:, None, :], axes)
    return values


def operator(rows, chosen, bodies):
    """H' as a scipy.sparse matrix (dim contacts, dofs bodies): relative velocities u = H'v."""
    from scipy import sparse

    dim, dofs, m = rows.dim, 3 * rows.dim - 3, len(chosen)
    values = jacobians(rows, chosen)
    place = np.repeat(np.arange(dim * m), 2 * dofs)
    column = dofs * rows.bodies[chosen][:, None, :, None] + np.arange(dofs)
    column = np.broadcast_to(column, (m, dim, 2, dofs))
    return sparse.csr_array((values.ravel(), (place, column.ravel())), shape=(dim * m, dofs * bodies))


def inverse_mass(simulation):
    """A^-1 of all bodies, internal order, scipy.sparse (dofs bodies, dofs bodies)."""
    from scipy import sparse

    raw = simulation.raw
    mass = np.array(raw.inverse_mass)
    if simulation.scene.dim == 2:
        return sparse.diags_array(mass.ravel())
    blocks = np.zeros((len(mass), 6, 6))
    blocks[:, range(6), range(6)] = mass
    turning = np.array(raw.inverse_inertia)
    if len(turning):
        for k, (i, j) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))):
            blocks[:, 3 + i, 3 + j] = blocks[:, 3 + j, 3 + i] = turning[:, k]
    n = len(mass)
    return sparse.bsr_array((blocks, np.arange(n), np.arange(n + 1)), shape=(6 * n, 6 * n))


def problem_of(simulation):
    """The step at hand as a dict: problem; rows, and which of them it holds; operator H' and inverse A^-1 (sparse)."""
    from ..problems import Problem

    rows = simulation.stages.contacts
    chosen = rows.cones()
    free = np.array(simulation.raw.velocity_free)
    h = operator(rows, chosen, len(free))
    inverse = inverse_mass(simulation)
    q = h @ free.ravel() + rows.bias[chosen].ravel()
    w = (h @ inverse @ h.T).tobsr(blocksize=(rows.dim, rows.dim))
    problem = Problem(rows.dim, w, q, rows.mu[chosen])
    return {"problem": problem, "rows": rows, "chosen": chosen, "operator": h, "inverse": inverse}


class Dump:
    """A callback of Simulation.run that writes the contact problem of one step: when is "step=N", or "worst", the step that ended
    with the largest error. written: that step; error: its true error."""

    def __init__(self, when, path):
        self.path, self.written, self.error = path, None, -1.0
        self.step = None
        if when != "worst":
            name, _, number = when.partition("=")
            if name != "step" or not number.isdecimal():
                raise ValueError(f"the step of the problem is {when!r}: give step=120, say, or worst")
            self.step = int(number)

    def __call__(self, simulation):
        info = simulation.report
        wanted = info["error"] > self.error if self.step is None else info["step"] == self.step
        if wanted and info["contacts"]:
            self.written, self.error = info["step"], info["error"]
            simulation.dump_problem(self.path)
