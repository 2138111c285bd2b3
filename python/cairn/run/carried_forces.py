"""Forces and damping given to a rigid body, which go with it when it is made deformable and come back when it is rigid again."""

from __future__ import annotations

import numpy as np

from ..model.bodies import _spread


class CarriedForce:
    """Force and torque (dofs,) that a set gives one of its bodies, as forces of the nodes of a mesh in its place: with which
    a rigid motion sets in, so that force and torque about the centre of mass are the given ones wherever the nodes are."""

    def __init__(self, given, row, count):
        self.given, self.row, self.count = given, row, count

    def wrench(self, t, dim, call):
        """Force and torque at a time, (dofs,) [N, N m]; call(function, t) asks a function."""
        value = call(self.given, t) if callable(self.given) else self.given
        return _spread("force", value, self.count, 3 * dim - 3, dim)[self.row]

    def of_nodes(self, body, x, t, call):
        """Forces of nodes at x (n, dim) at a time, (n dofs) [N]."""
        rates = rates_of(x - weights_of(body)[:, 0] @ x / weights_of(body)[:, 0].sum())
        moving = body.M @ rates
        return moving @ np.linalg.solve(rates.T @ moving, self.wrench(t, body.dim, call))


class OfOneBody:
    """The row of one body of a function of time that gives those of many."""

    def __init__(self, given, row, count, dim):
        self.given, self.row, self.count, self.dim = given, row, count, dim
        self.needs_simulation = getattr(given, "needs_simulation", False)

    def __call__(self, *at):
        return _spread("force", self.given(*at), self.count, 3 * self.dim - 3, self.dim)[self.row]


def force_of(s, row):
    """What a set gives one of its bodies, as a set of that body alone takes it."""
    if s.force is None:
        return None
    if not callable(s.force):
        return np.asarray(s.force)[row : row + 1]
    return s.force if len(s) == 1 else OfOneBody(s.force, row, len(s), s.dim)


def damping_of(s, row):
    """Of one body of a set [1/s]."""
    return 0.0 if s.damping is None else float(np.ravel(s.damping)[row])


def carry(d, s, row):
    """Lets a Deformable have the force that a set gives a body; none if there is none."""
    if s.force is not None:
        d.carried = CarriedForce(s.force, row, len(s))


def weights_of(body):
    """What each node counts for in the momentum along each axis, (n, dim) [kg]."""
    ones = np.tile(np.eye(body.dim), (len(body.points), 1))
    full = body.M @ ones
    return np.stack([full[axis :: body.dim, axis] for axis in range(body.dim)], axis=1)


def rates_of(arm):
    """Velocities (n dofs, 3 | 6) of nodes by those of a rigid body: along the axes, then spins."""
    n, dim = arm.shape
    out = np.zeros((n, dim, 3 * dim - 3))
    out[:, range(dim), range(dim)] = 1
    if dim == 2:
        out[:, 0, 2], out[:, 1, 2] = -arm[:, 1], arm[:, 0]
    else:
        for k in range(3):
            out[:, :, 3 + k] = np.cross(np.eye(3)[k], arm)
    return out.reshape(n * dim, -1)
