"""Static equilibrium of scenes with deformable bodies: deformed shapes, positions of rigid bodies on them, and contact impulses.

Displacements d of all bodies are the unknowns: (K + e M) d = f + H r with gap + H'd >= 0, r in Coulomb's cone, by the augmented
Lagrangian method of equilibrium.py with factors of the sparse matrix. The regularisation e M is needed for rigid bodies and for
bodies held by contacts alone. It does not affect the result: bodies are moved by d and the problem is solved again until the
residual of the step vanishes.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from .. import _core
from .contact_problem import inverse_mass, jacobians
from .equilibrium_contacts import determined, refuse_springs, slack_of


def find(simulation, tol, unbalanced, rounds, stiffness, report):
    """See find_equilibrium. With convergence bodies are moved and velocities set to zero; else the state is restored."""
    start = simulation.get_state()
    known, softness, newton, result, let_go = {}, 1e-4, 0, None, np.finfo(float).tiny
    try:
        for name in ("velocity", "angular_momentum"):
            getattr(simulation.raw, name)[:] = 0
        simulation.raw.nodes.velocity[:] = 0
        for k in range(1, rounds + 1):
            rest = Rest(simulation, known)
            let_go = max(let_go, np.abs(rest.v_free).max())
            error, left = rest.errors(let_go)
            done = error <= tol and left <= unbalanced
            result = dict(round=k, newton=newton, cg=0, error=error, unbalanced=left, converged=done)
            if report:
                report(result)
            if done:
                start = remembered(simulation, rest)
                break
            d, steps = rest.displacement(softness, stiffness, 0.1 * min(tol, unbalanced), rounds)
            newton += steps
            if not np.abs(d).max() < rest.extent:  # a body is not held
                break
            if rest.held_back(d, softness) > 0.1:
                softness *= 1e-2
            move(simulation, rest, d)
            known = rest.known()
    finally:
        simulation.set_state(start)
    return result


def remembered(simulation, rest):
    """Current state with the impulses of equilibrium, for the warm start of the next step."""
    state = simulation.get_state()
    simulation.step()
    memory = simulation.get_state()["memory"]
    impulses = rest.h * (rest.r if rest.dim == 2 else np.einsum("mk,mki->mi", rest.r, rest.axes))
    act = np.any(impulses != 0, axis=1)
    memory["keys"], memory["impulses"] = rest.keys[act], np.ascontiguousarray(impulses[act])
    return {**state, "memory": memory}


def move(simulation, rest, d):
    """Moves free bodies and nodes by the displacement d."""
    raw, dim, n = simulation.raw, rest.dim, len(rest.bodies)
    dofs = 3 * dim - 3
    rigid = d[: n * dofs].reshape(n, dofs)
    raw.position[rest.bodies] += rigid[:, :dim]
    if len(raw.rotation):
        if dim == 2:
            raw.rotation.reshape(-1)[rest.bodies] += rigid[:, 2]
        else:
            raw.rotation[rest.bodies] = _turned(raw.rotation[rest.bodies], rigid[:, 3:])
    for rows, at in rest.parts:
        raw.nodes.position[rows] += np.where(at >= 0, d[at], 0.0).reshape(-1, dim)


def _turned(rotation, turn):
    """Quaternions (n, 4) after a rotation by vectors (n, 3) in space [rad]."""
    angle = np.linalg.norm(turn, axis=1)
    w, v = np.cos(angle / 2), turn * (0.5 * np.sinc(angle / (2 * np.pi)))[:, None]
    a, b = rotation[:, 0], rotation[:, 1:]
    scalar = w * a - np.sum(v * b, axis=1)
    return np.concatenate([scalar[:, None], w[:, None] * b + a[:, None] * v + np.cross(v, b)], axis=1)


class Rest:
    """Equilibrium problem of the current scene: dofs of free bodies, then of nodes; contacts (m) with Coulomb's cone."""

    def __init__(self, simulation, known):
        stages, self.dim = simulation.stages, simulation.scene.dim
        stages.begin_step()
        try:
            while stages.due != "solve_contacts":
                getattr(stages, stages.due)()
            self.h, theta = stages.h, simulation.strategy.theta
            rows, raw = stages.contacts, simulation.raw
            chosen = rows.cones()
            chosen = chosen[determined(simulation, rows)[chosen]]
            refuse_springs(rows, chosen)
            self.mu, self.axes = rows.mu[chosen], rows.axes[chosen]
            self.bias = self.h * rows.bias[chosen]  # velocity bias times h: gaps [m]
            self.keys = np.array(simulation.contacts.key)[chosen]
            self.rigid = len(simulation.bodies)
            self.extent = float(np.ptp(np.concatenate([raw.position, raw.nodes.position]), axis=0).max())
            mass = self._free_bodies(simulation)
            self._assemble(simulation, theta, mass, np.array(raw.velocity_free), np.array(raw.nodes.velocity_free))
            self._jacobians(rows, chosen)
        finally:
            stages.undo_step()
        if not len(chosen) and not any(len(mesh.held) for mesh in simulation.meshes):
            raise ValueError("no bodies touch and none is held, so nothing carries a load: let them touch, or hold a group")
        self.r = np.zeros((len(chosen), self.dim))
        for row, key in enumerate(map(tuple, self.keys)):
            if key in known:
                self.r[row] = self.axes[row] @ known[key]

    def _free_bodies(self, simulation):
        """Sets internal numbers `bodies` of movable rigid bodies and the mask `free` of their dofs; returns their masses."""
        dofs = 3 * self.dim - 3
        blocks = inverse_mass(simulation).tobsr(blocksize=(dofs, dofs))
        blocks.sum_duplicates()
        there = np.flatnonzero(np.diff(blocks.indptr))
        found = blocks.data[blocks.indptr[there]]
        self.free = np.diagonal(found, axis1=1, axis2=2) > 0
        moves = self.free.any(axis=1)
        self.bodies, self.free, found = there[moves], self.free[moves], found[moves]
        still = np.eye(dofs) * ~self.free[:, :, None]
        return np.linalg.inv(found + still)

    def _assemble(self, simulation, theta, mass, free, of_nodes):
        """Assembles mass, stiffness and step matrix on free dofs of bodies and meshes, and the loads."""
        explicit = simulation.strategy.explicit
        size, self.parts = mass.shape[0] * mass.shape[1], []
        lump, bulk, step = [_blocks(mass)], [sparse.csc_array((size, size))], [_blocks(mass)]
        v_free = [np.where(self.free, free[self.bodies], 0.0).ravel()]
        for mesh in simulation.meshes:
            if getattr(mesh.body, "solver", None) is not None:
                raise ValueError(f"{mesh.name!r} has a solver of its own: rest is found of bodies that give their matrices")
            if mesh.ties:
                raise ValueError(f"{mesh.name!r} has ties or rigid parts: rest is found of bodies whose dofs are all their own")
            dofs = np.setdiff1d(np.arange(mesh.body.points.size), mesh.held)
            rows = mesh.rows
            at = np.full(mesh.body.points.size, -1)
            at[dofs] = size + np.arange(len(dofs))
            self.parts.append((rows, at))
            m, k, c = (a[dofs][:, dofs] for a in (mesh.body.M, mesh.body.K, mesh.body.C))
            lump, bulk = [*lump, m], [*bulk, k]
            step.append(m if explicit else m + self.h * theta * c + (self.h * theta) ** 2 * k)
            v_free.append(of_nodes[rows].ravel()[dofs])
            size += len(dofs)
        self.mass, self.bulk, self.step = (sparse.block_diag(a, format="csc") for a in (lump, bulk, step))
        self.v_free = np.concatenate(v_free)
        self.force = self.step @ self.v_free / self.h
        self.step_factors = splu(self.step)

    def _jacobians(self, rows, chosen):
        """Assembles H', sparse (dim m, dofs)."""
        dim, m = self.dim, len(chosen)
        dofs = 3 * dim - 3
        number = np.full(self.rigid + 1, -1)
        number[self.bodies] = np.arange(len(self.bodies))
        of_body = jacobians(rows, chosen)
        entries = []  # values (m, dim, k), columns (m, k)
        for side, sign in ((0, 1.0), (1, -1.0)):
            body = rows.bodies[chosen][:, side]
            columns = dofs * number[body][:, None] + np.arange(dofs)
            columns[number[body] < 0] = -1
            if len(self.bodies):
                columns[~self.free[number[body]]] = -1
            entries.append((of_body[:, :, side], columns))
            mesh = rows.mesh[chosen][:, side]
            for which, (_, at) in enumerate(self.parts):
                mine = np.flatnonzero(mesh == which)
                for j in range(4):
                    node, weight = rows.node[chosen][mine, side, j], rows.weight[chosen][mine, side, j]
                    columns = np.full((m, dim), -1)
                    columns[mine] = at[dim * node[:, None] + np.arange(dim)]
                    values = np.zeros((m, dim, dim))
                    values[mine] = sign * weight[:, None, None] * self.axes[mine]
                    entries.append((values, columns))
        place = np.arange(dim * m).reshape(m, dim, 1)
        value, row, column = [], [], []
        for values, columns in entries:
            wide = np.broadcast_to(columns[:, None, :], values.shape)
            known = (wide >= 0) & (values != 0)
            value.append(values[known])
            row.append(np.broadcast_to(place, values.shape)[known])
            column.append(wide[known])
        shape = (dim * m, len(self.v_free))
        self.H = sparse.csr_array((np.concatenate(value), (np.concatenate(row), np.concatenate(column))), shape=shape)

    def known(self):
        """{contact key: force in space (dim,) [N]}."""
        force = np.einsum("mk,mki->mi", self.r, self.axes)
        return dict(zip(map(tuple, self.keys), force))

    def gathered(self, r):
        return self.H.T @ r.ravel()

    def along(self, d):
        return (self.H @ d).reshape(-1, self.dim)

    def errors(self, let_go):
        """(true error, largest velocity over `let_go`) of a step with the current forces."""
        v = self.v_free + self.h * self.step_factors.solve(self.gathered(self.r)) if len(self.r) else self.v_free
        speed = np.abs(v).max() / let_go
        if not len(self.r):
            return 0.0, float(speed)
        rho = 1 / self._normals(self.step_factors)
        bias, impulse = self.bias / self.h, self.h * self.r

        def map_of(r, u):
            return r - _core.project_on_cones(r - rho[:, None] * slack_of(u, self.mu), self.mu)

        def energy(x):
            return np.sum(np.sum(x * x, axis=1) / rho)

        nothing = map_of(np.zeros_like(impulse), self.along(self.v_free) + bias)
        scale = max(energy(impulse), energy(nothing))
        error = np.sqrt(energy(map_of(impulse, self.along(v) + bias)) / scale) if scale > 0 else 0.0
        return float(error), float(speed)

    def _normals(self, factors):
        """Diagonal of H'A^-1 H along the normals, (m,)."""
        normal = self.H[:: self.dim]
        out = np.zeros(normal.shape[0])
        for first in range(0, len(out), 64):
            rows = normal[first : first + 64].toarray()
            out[first : first + 64] = np.sum(rows * factors.solve(np.ascontiguousarray(rows.T)).T, axis=1)
        return np.where(out > 0, out, 1.0)

    def held_back(self, d, softness):
        """Share of the load carried by the regularisation e M instead of stiffness and contacts."""
        share = softness / self.h**2 * (self.mass @ d)
        return np.linalg.norm(share) / max(np.linalg.norm(self.force), np.finfo(float).tiny)

    def displacement(self, softness, stiffness, tol, rounds):
        """(displacement d, number of Newton steps); sets the contact forces `r`."""
        matrix = (self.bulk + softness / self.h**2 * self.mass).tocsc()
        factors = splu(matrix)
        d = factors.solve(self.force)
        if not len(self.r):
            return d, 0
        rho, steps, slack = 1 / self._normals(factors), 0, np.zeros(len(self.r))
        c, last = stiffness * rho, np.inf
        for _ in range(rounds):
            d, more = self._minimised(d, matrix, c, slack, 0.1 * tol)
            steps += more
            u = self.along(d) + self.bias
            u[:, 0] += slack
            before, self.r = self.r, _core.project_on_cones(self.r - c[:, None] * u, self.mu)
            slack = self.mu * np.linalg.norm(u[:, 1:], axis=1)
            change, size = np.linalg.norm(self.r - before), np.linalg.norm(self.r)
            slow = change > 0.1 * last  # contacts are softer than the bodies: small changes may leave much to do
            if change <= (1e-4 if slow else 1.0) * tol * size:
                break
            if slow:
                c = 10 * c
            last = change
        return d, steps

    def _minimised(self, d, matrix, c, slack, tol, most=60):
        scale = max(np.linalg.norm(self.force), np.finfo(float).tiny)

        def value(d):
            u = self.along(d) + self.bias
            u[:, 0] += slack
            asked = self.r - c[:, None] * u
            p = _core.project_on_cones(asked, self.mu)
            ad = matrix @ d
            return 0.5 * d @ ad - self.force @ d + 0.5 * np.sum(np.sum(p * p, axis=1) / c), p, asked, ad

        energy, p, asked, ad = value(d)
        for step in range(most):
            gradient = ad - self.force - self.gathered(p)
            if np.linalg.norm(gradient) <= tol * scale:
                return d, step
            blocks = _core.cone_derivatives(asked, self.mu, c)
            n = len(blocks)
            middle = sparse.bsr_array((blocks, np.arange(n), np.arange(n + 1)), shape=(self.dim * n, self.dim * n))
            way = splu((matrix + self.H.T @ middle @ self.H).tocsc()).solve(-gradient)
            slope, t = gradient @ way, 1.0
            while True:
                trial = value(d + t * way)
                fell = trial[0] <= energy + 1e-4 * t * slope or abs(t * slope) <= 1e-14 * abs(energy)
                if fell or t < 1e-6:
                    break
                t /= 2
            d, (energy, p, asked, ad) = d + t * way, trial
        return d, most


def _blocks(mass):
    n, k = mass.shape[:2]
    shape = (n * k, n * k)
    return sparse.bsr_array((mass, np.arange(n), np.arange(n + 1)), shape=shape).tocsc() if n else sparse.csc_array(shape)
