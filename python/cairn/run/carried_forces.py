"""Forces and damping of a rigid body that are kept when it is made deformable and when it is made rigid again."""

from __future__ import annotations

import numpy as np

from ..model.body_values import spread


class CarriedForce:
    """Force and torque (dofs,) of a rigid body, applied to the nodes of the mesh that replaced it: nodal forces M a of the rigid
    acceleration field whose resultant and moment about the centre of mass are the given ones, wherever the nodes are."""

    def __init__(self, given, row, count):
        self.given, self.row, self.count = given, row, count

    def wrench(self, t, dim, call):
        """Force and torque at time t [s], (dofs,) [N, N m]; call(function, t) evaluates a function of time."""
        value = call(self.given, t) if callable(self.given) else self.given
        return spread("force", value, self.count, 3 * dim - 3, dim)[self.row]

    def of_nodes(self, body, x, t, call):
        """Nodal forces at time t [s] for positions x (n, dim) [m], (n dofs) [N]."""
        rates = rates_of(x - weights_of(body)[:, 0] @ x / weights_of(body)[:, 0].sum())
        moving = body.M @ rates
        return moving @ np.linalg.solve(rates.T @ moving, self.wrench(t, body.dim, call))


class OfOneBody:
    """Function of time for a single body, from a function that gives the rows of a whole set."""

    def __init__(self, given, row, count, dim):
        self.given, self.row, self.count, self.dim = given, row, count, dim
        self.needs_simulation = getattr(given, "needs_simulation", False)

    def __call__(self, *at):
        return spread("force", self.given(*at), self.count, 3 * self.dim - 3, self.dim)[self.row]


def force_of(s, row):
    """Force of a body of a set, in the form for a set of that body alone; None without."""
    if s.force is None:
        return None
    if not callable(s.force):
        return np.asarray(s.force)[row : row + 1]
    return s.force if len(s) == 1 else OfOneBody(s.force, row, len(s), s.dim)


def damping_of(s, row):
    """Damping of a body of a set [1/s]."""
    return 0.0 if s.damping is None else float(np.ravel(s.damping)[row])


def carry(d, s, row):
    """Passes the force of a body of a set, if it has one, to a Deformable."""
    if s.force is not None:
        d.carried = CarriedForce(s.force, row, len(s))


def weights_of(body):
    """Mass of each node in the momentum along each axis: row sums of M, (n, dim) [kg]."""
    ones = np.tile(np.eye(body.dim), (len(body.points), 1))
    full = body.M @ ones
    return np.stack([full[axis :: body.dim, axis] for axis in range(body.dim)], axis=1)


def rates_of(arm):
    """Rigid motions as velocities of nodes (n dofs, 3 | 6): translations, then rotations. arm (n, dim): from the centre [m]."""
    n, dim = arm.shape
    out = np.zeros((n, dim, 3 * dim - 3))
    out[:, range(dim), range(dim)] = 1
    if dim == 2:
        out[:, 0, 2], out[:, 1, 2] = -arm[:, 1], arm[:, 0]
    else:
        for k in range(3):
            out[:, :, 3 + k] = np.cross(np.eye(3)[k], arm)
    return out.reshape(n * dim, -1)
