"""Impulses of static equilibrium, solved for all bodies at once, to start large structures under load.

Sweeps over contacts need thousands of iterations to carry the weight of a large structure to its supports. Here the velocities of
all bodies are the unknowns: the problem of the step, u = H'v, M (v - v_free) = H r, r in Coulomb's cone and u in its dual, is
solved by the augmented Lagrangian method (Hestenes 1969, Powell 1969; Alart & Curnier 1991 for friction),

    r <- P_K(r - c (u + b + mu |u_T| n)),   v minimising  1/2 |v - v_free|_M^2 + sum |P_K(r - c (u + b + s n))|^2 / 2c,

with s = mu |u_T| of the previous round (De Saxce & Feng 1998; Acary et al. 2011), by Newton's method with a line search. Its
linear systems are sparse and definite; they are solved by conjugate gradients, preconditioned by the diagonal blocks of bodies
and a coarse space of rigid motions of groups of bodies (Nicolaides 1987).
"""

from __future__ import annotations

import numpy as np

from .. import _core
from ..base import checks
from .contact_problem import inverse_mass, jacobians
from .equilibrium_contacts import determined, refuse_springs, slack_of
from .simulation import Simulation


def find_equilibrium(simulation, tol=1e-6, unbalanced=1e-4, rounds=30, stiffness=None, report=None):
    """Finds impulses of static equilibrium, from which the next step starts; positions do not change.

    With deformable bodies the deformed equilibrium shape is found too: bodies are moved to it and velocities set to zero; without
    convergence nothing is changed.

    Parameters
    ----------
    simulation : Simulation
        Bodies of any shape at rest under gravity or forces, some of their dofs held or driven, with Coulomb's law or another cone
        without a spring at all contacts.
    tol : float, default 1e-6
        Largest true error [-].
    unbalanced : float, default 1e-4
        Largest velocity of a body after a step over that without contacts [-]; both must hold, within `rounds` rounds.
    rounds : int, default 30
        Most rounds.
    stiffness : float, optional
        Penalty c over the effective mass of a contact [-]; None: 1e8, with deformable bodies 1e6. It is lowered if Newton's
        method fails.
    report : callable, optional
        Function that is called with a dict after each round.

    Returns
    -------
    dict
        The last such dict: round, newton and cg (total iterations), error, unbalanced, converged. A structure without equilibrium
        does not converge; the next step then starts from the last impulses.

    Raises
    ------
    ValueError
        If another law rules contacts, there are none, or nothing can move.
    """
    if not isinstance(simulation, Simulation):
        raise ValueError(f"simulation is {simulation!r}: give a cairn.Simulation")
    checks.positive("tol", tol), checks.positive("unbalanced", unbalanced)
    checks.count("rounds", rounds, 1)
    if stiffness is None:
        stiffness = 1e6 if simulation.meshes else 1e8
    checks.positive("stiffness", stiffness)
    if simulation.meshes:
        from .mesh_equilibrium import find

        return find(simulation, tol, unbalanced, rounds, stiffness, report)
    state = simulation.get_state()
    simulation.step()
    try:
        if not len(simulation.contacts):
            raise ValueError("no bodies touch, so no contact could carry a load: place them in contact, or run a few steps first")
        system = System(simulation)
        keys = np.array(simulation.contacts.key)[system.chosen]
        memory = simulation.get_state()["memory"]
    finally:
        simulation.set_state(state)
    result = system.solve(tol, unbalanced, rounds, stiffness, report)
    impulses = system.r if system.dim == 2 else np.einsum("mk,mki->mi", system.r, system.axes)
    state["memory"] = with_impulses(memory, state["memory"], keys, impulses)
    simulation.set_state(state)
    return result


def with_impulses(memory, before, keys, impulses):
    """Contact memory after the trial step, with impulses (m, dim) [N s] of the contacts of these keys (m, 4) alone. If laws keep
    states all contacts are kept, with the states from before that step where known."""
    act = np.any(impulses != 0, axis=1)
    keys, impulses = keys[act], impulses[act]
    if np.size(memory["states"]) == 0:
        return {**memory, "keys": keys, "impulses": np.ascontiguousarray(impulses)}
    there = np.asarray(memory["keys"]).reshape(-1, 4)
    states = np.array(memory["states"]).reshape(len(there), -1)
    row = {tuple(key): k for k, key in enumerate(there)}
    all_impulses = np.zeros((len(there), np.size(memory["impulses"]) // len(there)))
    for key, impulse in zip(keys, impulses, strict=True):
        if (k := row.get(tuple(key))) is not None:
            all_impulses[k, : len(impulse)] = impulse
    old = np.asarray(before["keys"]).reshape(-1, 4)
    if len(old) and np.size(before["states"]) == len(old) * states.shape[1]:
        for key, was in zip(old, np.reshape(before["states"], (len(old), -1)), strict=True):
            if (k := row.get(tuple(key))) is not None:
                states[k] = was
    shape_of = lambda name, values: values.reshape(np.shape(memory[name]))
    return {**memory, "impulses": shape_of("impulses", all_impulses), "states": shape_of("states", states)}


class System:
    """Equilibrium problem of the current step: free bodies (n), contacts (m)."""

    def __init__(self, simulation):
        rows = simulation.stages.contacts
        self.dim = rows.dim
        self.chosen = rows.cones()
        self.chosen = self.chosen[determined(simulation, rows)[self.chosen]]
        refuse_springs(rows, self.chosen)
        self.dofs = 3 * self.dim - 3
        self.mu, self.bias, self.axes = rows.mu[self.chosen], rows.bias[self.chosen], rows.axes[self.chosen]
        inverse = inverse_mass(simulation).tobsr(blocksize=(self.dofs, self.dofs))
        inverse.sum_duplicates()
        free = np.flatnonzero(np.diff(inverse.indptr))
        inverse = inverse.data[inverse.indptr[free]]
        given = ~(np.diagonal(inverse, axis1=1, axis2=2) > 0)  # held or driven dofs
        moves = ~given.all(axis=1)
        if not np.any(moves):
            raise ValueError("no body is free to move: give at least one without driven dofs")
        free, given, self.inverse = free[moves], given[moves], inverse[moves]
        # held and driven dofs drop out of the sums below, so that any mass will do
        self.mass = np.linalg.inv(self.inverse + np.eye(self.dofs) * given[:, :, None])
        raw = simulation.raw
        velocity, self.position = np.array(raw.velocity_free), np.array(raw.position)[free]
        self.v_free = np.where(given, 0.0, velocity[free])
        velocity[free] -= self.v_free
        if not np.any(self.v_free[:, : self.dim]):
            raise ValueError("nothing moves the bodies when they are let go: give gravity or a force that they are to bear")
        number = np.full(rows.bodies.max() + 1, -1, np.int32)
        number[free[free < len(number)]] = np.arange(np.sum(free < len(number)))
        self.bodies = number[rows.bodies[self.chosen]]  # -1: cannot move
        h = jacobians(rows, self.chosen)
        self.bias = self.bias + np.einsum("mksi,msi->mk", h, velocity[rows.bodies[self.chosen]])
        moving = np.concatenate((~given, np.zeros((1, self.dofs), bool)))
        self.rows = np.ascontiguousarray(h.transpose(0, 2, 3, 1) * moving[self.bodies][..., None])  # (m, 2, dofs, dim)
        self.r = np.zeros((len(self.chosen), self.dim))
        self.none = np.zeros_like(self.r)
        self.graph = Graph(self.bodies, len(free))
        still = np.concatenate((self.inverse, np.zeros((1, self.dofs, self.dofs))))
        w = sum(np.einsum("mi,mij,mj->m", n, still[b], n) for n, b in zip(self.rows[..., 0].swapaxes(0, 1), self.bodies.T))
        movable = w > 0  # other contacts have no dof that moves along their normal
        self.rho = 1 / np.where(movable, w, np.mean(w[movable]) if movable.any() else 1)
        self.modes = rigid_motions(self.position[:, : self.dim], self.dofs)
        self.matrix = Matrix(self.graph, self.mass, self.rows)

    def relative(self, v, u=None):
        """H'v + u, (m, dim)."""
        return _core.rows_velocities(self.bodies, self.rows, v, self.none if u is None else u)

    def gathered(self, r):
        """H r, (n, dofs)."""
        return _core.rows_impulses(self.bodies, self.rows, r, len(self.mass))

    def momentum(self, v):
        return np.einsum("nij,nj->ni", self.mass, v)

    def errors(self):
        """(true error, largest velocity over the largest free velocity), for the current impulses."""
        v = self.v_free + np.einsum("nij,nj->ni", self.inverse, self.gathered(self.r))
        u = self.relative(v, self.bias)

        def map_of(r, u):
            return r - _core.project_on_cones(r - self.rho[:, None] * slack_of(u, self.mu), self.mu)

        def energy(x):
            return np.sum(np.sum(x * x, axis=1) / self.rho)

        nothing = map_of(self.none, self.relative(self.v_free, self.bias))
        error = np.sqrt(energy(map_of(self.r, u)) / max(energy(self.r), energy(nothing)))
        speed, scale = (np.linalg.norm(x[:, : self.dim], axis=1) for x in (v, self.v_free))
        return float(error), float(np.max(speed / np.max(scale)))

    def solve(self, tol, unbalanced, rounds, stiffness, report, most=100):
        v, newton, cg = np.zeros_like(self.v_free), 0, 0
        slack = np.zeros(len(self.r))
        for k in range(1, rounds + 1):
            c = stiffness * self.rho
            begin, before = v, self.r
            v, steps, products = self.minimise(v, c, slack, 0.1 * unbalanced, most)
            newton, cg = newton + steps, cg + products
            u = self.relative(v, self.bias)
            u[:, 0] += slack
            self.r = _core.project_on_cones(self.r - c[:, None] * u, self.mu)
            error, left = self.errors()
            if steps == most and error > 0.1 and stiffness > 1e3:  # Newton's method failed: softer contacts open less
                stiffness, v, self.r = 1e-2 * stiffness, begin, before
            else:
                slack = self.mu * np.linalg.norm(u[:, 1:], axis=1)
            done = error <= tol and left <= unbalanced
            result = dict(round=k, newton=newton, cg=cg, error=error, unbalanced=left, converged=done)
            if report:
                report(result)
            if done:
                break
        return result

    def minimise(self, v, c, slack, tol, most=100, patience=12):
        """(velocities of a round by Newton's method, number of steps, number of matrix products). The round ends early if
        energies differ by rounding alone and `patience` steps have not halved the gradient."""
        weight = np.sqrt(np.sum(self.v_free * self.momentum(self.v_free)))
        used = steps = least_step = 0
        least, best, flat = np.inf, v, False
        self.matrix.begin()

        def value(v, u):
            asked = self.r - c[:, None] * u
            p = _core.project_on_cones(asked, self.mu)
            gap = v - self.v_free
            return 0.5 * np.sum(gap * self.momentum(gap)) + 0.5 * np.sum(np.sum(p * p, axis=1) / c), p, asked

        def descent(v, p):
            return self.momentum(v - self.v_free) - self.gathered(p)

        u = self.relative(v, self.bias)
        u[:, 0] += slack
        energy, p, asked = value(v, u)
        while True:
            gradient = descent(v, p)
            left = np.sqrt(np.sum(gradient * np.einsum("nij,nj->ni", self.inverse, gradient))) / weight
            if not flat or left < 0.5 * least:
                least, best, least_step = left, v, steps
            if left <= tol or steps == most or steps - least_step >= patience:
                return best if left > tol else v, steps, used
            steps += 1
            matrix, precondition = self.newton_matrix(_core.cone_derivatives(asked, self.mu, c))
            enough = max(min(0.1, np.sqrt(left)), min(0.1, 0.3 * tol / left))  # the last step need not exceed tol
            way, products = conjugate_gradients(matrix, -gradient, precondition, enough)
            used += products
            slope, along, t = np.sum(gradient * way), self.relative(way), 1.0
            while True:
                trial = value(v + t * way, u + t * along)
                flat = abs(t * slope) <= 1e-14 * abs(energy)
                if not flat:
                    fell = trial[0] <= energy + 1e-4 * t * slope
                else:  # energies differ by rounding alone: the slope bounds the step beyond the minimum
                    fell = np.sum(descent(v + t * way, trial[1]) * way) <= 0.5 * abs(slope)
                if fell or t < 1e-6:
                    break
                t /= 2
            v, u, (energy, p, asked) = v + t * way, u + t * along, trial

    def newton_matrix(self, d):
        """M + H D H', and its preconditioner."""
        matrix = self.matrix.of(d)
        return matrix, Preconditioner(matrix, self.modes)


class Matrix:
    """M + H D H', updated when D changes: between steps of Newton's method few contacts change their status, and only their
    contributions are added."""

    def __init__(self, graph, mass, rows):
        self.graph, self.mass, self.rows = graph, mass, rows

    def begin(self):
        """Discards the matrix, so that the next one is assembled anew, without accumulated rounding."""
        self.d = self.matrix = None

    def of(self, d):
        if self.matrix is not None:
            changes = d - self.d
            if 2 * np.count_nonzero(changes.any(axis=(1, 2))) > len(d):
                self.begin()
        if self.matrix is None:
            self.matrix, changes = self.graph.matrix(self.mass), d
        graph = self.graph
        _core.rows_add_stiffness(graph.bodies, self.rows, changes, graph.on_diagonal, graph.place, self.matrix.data)
        self.d = d
        return self.matrix


class Graph:
    """Contact graph: pattern of the blocks of a symmetric matrix on and below its diagonal, with a block for each touching pair.
    bodies (m, 2): numbers of the bodies of each contact, below n, -1 for a body that does not move."""

    def __init__(self, bodies, n):
        both = np.flatnonzero((bodies >= 0).all(axis=1))
        low, high = bodies[both].min(axis=1).astype(np.int64), bodies[both].max(axis=1)
        pair, which = np.unique(high * np.int64(n) + low, return_inverse=True)
        row, column = np.concatenate((np.arange(n), pair // n)), np.concatenate((np.arange(n), pair % n))
        order = np.lexsort((column, row))  # the block of a body is the last of its row
        self.row_start = np.concatenate(([0], np.cumsum(np.bincount(row, minlength=n))))
        self.column = column[order].astype(np.int32)
        place = np.argsort(order)  # index of the block of a body or pair
        self.bodies, self.on_diagonal = bodies, place[:n]
        self.place = np.full(bodies.shape, -1)  # index of block (B, A) or (A, B) of a contact; only the lower is stored
        rises = bodies[both, 0] < bodies[both, 1]
        self.place[both, np.where(rises, 0, 1)] = place[n + which.ravel()]

    def matrix(self, mass):
        """HalfMatrix with diagonal blocks (n, dofs, dofs) and zero blocks for pairs."""
        return HalfMatrix(self, mass)


class HalfMatrix:
    """A symmetric matrix stored by its blocks (k, dofs, dofs) on and below the diagonal."""

    def __init__(self, graph, mass):
        self.graph = graph
        self.data = np.zeros((len(graph.column), *mass.shape[1:]))
        self.data[graph.on_diagonal] = mass

    def diagonal(self):
        return self.data[self.graph.on_diagonal]

    def __matmul__(self, x):
        graph = self.graph
        return _core.half_product(graph.row_start, graph.column, self.data, x)

    def projected(self, modes):
        """Returns Z'A Z (k, k), A projected onto the columns of a sparse coarse basis Z (dofs n, k)."""
        from scipy import sparse

        half, graph = self.data.copy(), self.graph
        half[graph.on_diagonal] *= 0.5
        size = self.data.shape[1] * (len(graph.row_start) - 1)
        lower = sparse.bsr_array((half, graph.column, graph.row_start), shape=(size, size))
        product = modes.T @ (lower @ modes)
        return product + product.T


def rigid_motions(position, dofs, bodies_each=48):
    """Coarse basis Z, sparse (dofs n, dofs groups), of the two-level preconditioner: rigid motions of groups of neighbours."""
    from scipy import sparse

    n, dim = position.shape
    group = groups(position, bodies_each)
    count = group.max() + 1
    center = np.stack([np.bincount(group, x, count) for x in position.T], axis=1) / np.bincount(group, minlength=count)[:, None]
    arm = position - center[group]
    z = np.broadcast_to(np.eye(dofs), (n, dofs, dofs)).copy()
    if dim == 2:
        z[:, 0, 2], z[:, 1, 2] = -arm[:, 1], arm[:, 0]
    else:
        for axis in range(3):
            z[:, :3, 3 + axis] = np.cross(np.eye(3)[axis], arm)
    return sparse.bsr_array((z, group, np.arange(n + 1)), shape=(dofs * n, dofs * count))


def groups(position, bodies_each):
    """Group of each body (n,), by recursive bisection along the longest extent."""
    group = np.zeros(len(position), int)
    todo, count = [np.arange(len(position))], 0
    while todo:
        these = todo.pop()
        if len(these) <= bodies_each:
            group[these] = count
            count += 1
            continue
        axis = np.argmax(np.ptp(position[these], axis=0))
        order = these[np.argsort(position[these, axis], kind="stable")]
        todo += [order[: len(order) // 2], order[len(order) // 2 :]]
    return group


class Preconditioner:
    """Two-level preconditioner: inverse diagonal blocks of bodies plus a direct solution in the coarse space of rigid motions."""

    def __init__(self, matrix, modes):
        from scipy.sparse.linalg import splu

        self.inverse = np.linalg.inv(matrix.diagonal())
        self.number = np.arange(len(self.inverse) + 1)
        self.column = self.number[:-1].astype(np.int32)
        coarse = matrix.projected(modes).tocsc()
        self.coarse = splu(coarse, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
        self.modes_transposed = modes.T.tocsr()
        self.modes = modes.tocsr()

    def __call__(self, x):
        own = _core.half_product(self.number, self.column, self.inverse, x)
        return own + (self.modes @ self.coarse.solve(self.modes_transposed @ x.ravel())).reshape(x.shape)


def dot(a, b):
    """Scalar product summed on a single thread: in a threaded BLAS the result depends on the number of threads, and thousands of
    short sums would wait for all threads."""
    return np.einsum("i,i->", a.ravel(), b.ravel())


def conjugate_gradients(matrix, b, precondition, tol, most=2000):
    """(solution of a definite system to a relative tolerance, in the shape of b; number of products with the matrix)."""
    x, r = np.zeros_like(b), b.copy()
    z = precondition(r)
    p, rz = z.copy(), dot(r, z)
    first, products = rz, 0
    while products < most:
        products += 1
        ap = matrix @ p
        alpha = rz / dot(p, ap)
        x += alpha * p
        r -= alpha * ap
        z = precondition(r)
        last, rz = rz, dot(r, z)
        if rz <= tol * tol * first:
            break
        p *= rz / last
        p += z
    return x, products
