"""Extraction of the contact problem of a step, u = W r + q with Coulomb's cone, from a simulation."""

from __future__ import annotations

import numpy as np


def jacobians(rows, chosen):
    """Blocks of H' (m, dim, 2, dofs): relative velocity of each contact from the velocities of its two bodies."""
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


def stacked(simulation, name):
    """Copy of a live array of rigid bodies with that of the nodes of meshes below it. Columns that nodes do not have are zero;
    their inertia is infinite, since nodes do not rotate."""
    raw = simulation.raw
    of_bodies = np.array(getattr(raw, name))
    n = len(simulation.nodes)
    if n == 0 or (len(of_bodies) == 0 and len(simulation.bodies)):
        return of_bodies
    out = np.full((n, *of_bodies.shape[1:]), np.inf if name == "inertia" else 0, of_bodies.dtype)
    if any(f["name"] == name and f["active"] for f in simulation.nodes.fields):
        values = np.array(getattr(raw.nodes, name)).reshape(n, -1)
        out.reshape(n, -1)[:, : values.shape[1]] = values
    return np.concatenate([of_bodies, out])


def operator(rows, chosen, bodies, meshes=None):
    """H' of u = H'v as a scipy.sparse matrix (dim contacts, dofs of bodies and nodes). bodies: number of rigid bodies; nodes of
    meshes follow, padded to the same number of dofs."""
    from scipy import sparse

    dim, dofs, m = rows.dim, 3 * rows.dim - 3, len(chosen)
    values = jacobians(rows, chosen)
    place = np.repeat(np.arange(dim * m), 2 * dofs)
    body = rows.bodies[chosen]
    values = np.where((body >= 0)[:, None, :, None], values, 0.0)
    column = np.broadcast_to(dofs * np.maximum(body, 0)[:, None, :, None] + np.arange(dofs), (m, dim, 2, dofs))
    shape = (dim * m, dofs * (bodies + sum(len(mesh.ids) for mesh in meshes or ())))
    out = sparse.csr_array((values.ravel(), (place, column.ravel())), shape=shape)
    return out if meshes is None or not meshes else out + _of_nodes(rows, chosen, bodies, meshes, shape)


def _of_nodes(rows, chosen, bodies, meshes, shape):
    """Part of H' for contact sides on meshes, interpolated from their nodes."""
    from scipy import sparse

    dim, dofs, m = rows.dim, 3 * rows.dim - 3, len(chosen)
    mesh, node = rows.mesh[chosen], rows.node[chosen]
    number = np.zeros(node.shape, int)
    for k, view in enumerate(meshes):
        of = bodies + view.rows
        number[mesh == k] = of[node[mesh == k]]
    sign = np.where(mesh >= 0, [1.0, -1.0], 0.0)
    values = np.einsum("ms,msj,mck->mcsjk", sign, rows.weight[chosen], rows.axes[chosen])
    column = np.broadcast_to(dofs * number[:, None, :, :, None] + np.arange(dim), values.shape)
    place = np.broadcast_to(np.arange(dim * m).reshape(m, dim, 1, 1, 1), values.shape)
    return sparse.csr_array((values.ravel(), (place.ravel(), column.ravel())), shape=shape)


def step_matrix(simulation, mesh, h):
    """Step matrix A of a mesh for a step h [s], scipy.sparse (n dofs, n dofs): M + a C + b K, with a, b of the integrator."""
    if mesh.ties:
        raise ValueError(f"{mesh.name!r} has ties or rigid parts: contact problems are made of bodies without")
    body, step = mesh.body, simulation.strategy.moved_by().scheme(h)
    if getattr(body, "solver", None) is not None:
        raise ValueError(f"{mesh.name!r} has a solver of its own: contact problems are made of bodies that give their matrices")
    if simulation.strategy.explicit:
        return body.M
    a = body.M + step["damping"] * body.C + step["stiffness"] * body.K
    return a if mesh.modal_damping is None else a + step["damping"] * mesh.modal_damping


def with_meshes(simulation, inverse, rows, chosen, h):
    """A^-1 of rigid bodies, extended by the columns for nodes with contacts: the response of all nodes of their mesh."""
    from scipy import sparse
    from scipy.sparse.linalg import splu

    dim, dofs = rows.dim, 3 * rows.dim - 3
    nodes = len(simulation.nodes)
    out = sparse.block_diag([inverse, sparse.csr_array((dofs * nodes, dofs * nodes))], format="csr")
    rigid = len(simulation.bodies)
    for k, mesh in enumerate(simulation.meshes):
        size = mesh.body.points.size
        free = np.setdiff1d(np.arange(size), mesh.held)
        touched = np.unique(rows.node[chosen][rows.mesh[chosen] == k])
        wanted = np.intersect1d((dim * touched[:, None] + np.arange(dim)).ravel(), free)
        if not len(wanted):
            continue
        right = np.zeros((size, len(wanted)))
        right[wanted, np.arange(len(wanted))] = 1
        columns = splu(step_matrix(simulation, mesh, h)[free][:, free].tocsc()).solve(right[free])
        place = (dofs * (rigid + mesh.rows[:, None]) + np.arange(dim)).ravel()
        i, j = np.meshgrid(place[free], place[wanted], indexing="ij")
        out = out + sparse.csr_array((columns.ravel(), (i.ravel(), j.ravel())), shape=out.shape)
    return out


def inverse_mass(simulation):
    """A^-1 of all rigid bodies in internal order, scipy.sparse (dofs bodies, dofs bodies)."""
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


def jointed_problem_of(simulation):
    """Problem of the current step with joints, whose equality constraints are eliminated from W and q (Schur complement):
    contacts that can move, then a row block for each limit and motor. None if the step has no joint."""
    from scipy import sparse

    from ..problems import Problem

    core = simulation.stages._core
    p = core.jointed_problem()
    if p is None:
        return None
    dim, size = simulation.scene.dim, simulation.scene.dim * len(p["mu"])
    w = sparse.bsr_array((p["data"].reshape(-1, dim, dim), p["column"], p["row_start"]), shape=(size, size))
    return Problem(dim, w, p["q"], p["mu"])


def problem_of(simulation):
    """Contact problem of the current step, a dict: problem; rows (ContactRows) and the numbers `chosen` of those in it; operator
    H' and inverse A^-1 (sparse), for rigid bodies in internal order, then nodes of meshes."""
    from scipy import sparse

    from ..problems import Problem

    rows = simulation.stages.contacts
    chosen = rows.cones()
    free = stacked(simulation, "velocity_free")
    h = operator(rows, chosen, len(simulation.bodies), simulation.meshes)
    inverse = inverse_mass(simulation)
    if simulation.meshes:
        inverse = with_meshes(simulation, inverse, rows, chosen, simulation.stages.h or simulation.report["dt"])
    q = h @ free.ravel() + rows.bias[chosen].ravel()
    w = h @ inverse @ h.T
    if rows.compliance[chosen].any():
        w = w + sparse.diags_array(rows.compliance[chosen].ravel())
    w = w.tobsr(blocksize=(rows.dim, rows.dim))
    problem = Problem(rows.dim, w, q, rows.mu[chosen])
    return {"problem": problem, "rows": rows, "chosen": chosen, "operator": h, "inverse": inverse}


class Dump:
    """A callback of Simulation.run that writes the contact problem of a step. when: "step=N", or "worst" for the step with the
    largest error. written: number of that step; error: its true error."""

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
