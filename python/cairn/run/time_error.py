"""Time error of a step by step doubling: a step of dt against two of dt/2 from the same state."""

from __future__ import annotations

import math

import numpy as np

from .._core import Error
from ..base import checks
from .views import core_of

# integrators of second order for all parameters; SECOND_AT_HALF: parameter of others that must be 1/2 for second order
SECOND_ORDER = ("discrete_gradient", "hht", "generalised_alpha", "central_difference", "velocity_verlet")
STAGGERED = ("central_difference", "beta_scheme")  # velocities are those in the middle of steps
KEEPS_FORCES = ("velocity_verlet", "gear")  # first order with contacts: forces are of the last step, contact impulses of this
LARGEST_CHANGE, SHARE = 0.5, 0.05  # changes of impulse beyond both are impacts: over the impulse, over the momentum of a body
SECOND_AT_HALF = {"theta": "theta", "beta_scheme": "beta", "newmark": "gamma"}


def _moved_by(strategy):
    """Integrator of a strategy; None for the default of SmoothDEM (velocity Verlet), and for parabolic flight."""
    return strategy.moved_by() if hasattr(strategy, "moved_by") else getattr(strategy, "integrator", None)


def order_of(moved_by):
    """Order of convergence of an integrator in smooth motion; 1 if unknown."""
    if moved_by is None:
        return 2
    row, values = moved_by.row, moved_by.values
    if row == "gear":
        return int(values["values"]) - 1
    return 2 if row in SECOND_ORDER or values.get(SECOND_AT_HALF.get(row)) == 0.5 else 1


class End:
    """Positions, velocities and rotations of bodies and nodes at the end of a step."""

    def __init__(self, simulation):
        bodies, nodes, dim = simulation.bodies, simulation.nodes, simulation.scene.dim
        self.position = [np.array(bodies.position), np.array(nodes.position)]
        self.velocity = [np.array(bodies.velocity), np.array(nodes.velocity)[:, :dim]]
        self.rotation = np.array(bodies.rotation) if "rotation" in bodies.names else None

    @classmethod
    def of_arrays(cls, arrays):
        """Inverse of as_arrays."""
        end = cls.__new__(cls)
        end.position, end.velocity = ([arrays[f"end_{name}_{k}"] for k in range(2)] for name in ("position", "velocity"))
        end.rotation = arrays.get("end_rotation")
        return end

    def as_arrays(self):
        """Arrays by name, for a file."""
        out = {f"end_{name}_{k}": getattr(self, name)[k] for name in ("position", "velocity") for k in range(2)}
        return out if self.rotation is None else {**out, "end_rotation": self.rotation}

    def way_from(self, other):
        """[displacements and rotations of bodies, displacements of nodes] from another state."""
        bodies, nodes = (a - b for a, b in zip(self.position, other.position))
        if self.rotation is None or other.rotation is None:
            return [bodies, nodes]
        return [np.column_stack([bodies, _turn(other.rotation, self.rotation)]), nodes]


def _turn(begin, end):
    """Rotations from orientations `begin` to `end`, about the axes of the bodies, (n, 1 | 3) [rad]."""
    if begin.ndim == 1:
        return (end - begin)[:, None]
    w, v = begin[:, :1], begin[:, 1:]
    scalar = w * end[:, :1] + np.sum(v * end[:, 1:], axis=1, keepdims=True)
    return 2 * np.sign(scalar) * (w * end[:, 1:] - end[:, :1] * v - np.cross(v, end[:, 1:]))


class EnergyNorm:
    """Energy norm over the free dofs: sqrt(sum m |v|^2 + I |w|^2)."""

    def __init__(self, simulation):
        bodies, nodes, dim = simulation.bodies, simulation.nodes, simulation.scene.dim
        mass, inertia = np.ravel(bodies.mass), np.reshape(bodies.inertia, (len(bodies), 1 if dim == 2 else 3))
        moves = np.repeat(np.isfinite(mass)[:, None], dim + inertia.shape[1], axis=1)
        if "driven" in bodies.names:
            moves &= ~(np.ravel(bodies.driven)[:, None] >> np.arange(moves.shape[1]) & 1).astype(bool)
        rigid = np.column_stack([np.repeat(mass[:, None], dim, axis=1), inertia])
        self._weights = [np.where(moves, rigid, 0.0), np.reshape(nodes.mass, (len(nodes), 1))]

    def __call__(self, parts):
        """Norm of velocities or displacements: [of bodies (n, dim or all dofs), of nodes (m, dim)]."""
        total = 0.0
        for w, x in zip(self._weights, parts):
            w = w[:, : x.shape[1]] if w.shape[1] > 1 else w
            total += float(np.sum(w * x**2)) if len(x) else 0.0
        return math.sqrt(total)

    def of_loads(self, simulation, h):
        """Norm of the velocities that gravity alone gives in h [s]."""
        g, dim = np.linalg.norm(simulation.stages.gravity), simulation.scene.dim
        return h * g * math.sqrt(sum(float(np.sum(np.max(w[:, :dim], axis=1))) for w in self._weights if len(w)))


class _Impulses:
    """Contact impulses of a step by contact keys: ids of the bodies {key: (2,)}, and magnitudes {key: [N s]}."""

    def __init__(self, simulation):
        contacts = simulation.contacts
        impulse = np.array(contacts.impulse)
        bears = np.any(impulse, axis=1)
        keys = list(map(tuple, np.array(contacts.key)[bears].tolist()))
        self.bodies = dict(zip(keys, np.array(contacts.bodies)[bears].tolist()))
        self.sizes = dict(zip(keys, np.linalg.norm(impulse[bears], axis=1).tolist()))
        self.of_contacts = any(key[2] >= 0 for key in keys)  # keys of joints are negative

    def jump_from(self, before, momenta):
        """True if an impulse changed by an impact since the step before, of the same length. before: magnitudes of impulses then
        {key: [N s]}; momenta {id: [kg m/s]}. Changes by less than LARGEST_CHANGE of the impulse, or by less than SHARE of the
        smaller momentum of its bodies, count as smooth."""
        for key, bodies in self.bodies.items():
            size, was = self.sizes[key], before.get(key, 0.0)
            change, least = abs(size - was), min(momenta.get(i, math.inf) for i in bodies)
            if change > LARGEST_CHANGE * max(size, was) and change > SHARE * least:
                return True
        return False


def _sizes_before(state, h):
    """Magnitudes of the impulses of the last step, scaled to a step of h [s], {key: [N s]}."""
    memory = state["memory"]
    of, keys = int(memory["impulse_components"]), np.asarray(memory["keys"])
    if not of or not len(keys):
        return {}
    impulses = np.asarray(memory["impulses"]).reshape(len(keys), of)
    scale = h / memory["h"] if memory["h"] > 0 else 0.0
    return dict(zip(map(tuple, keys.tolist()), (scale * np.linalg.norm(impulses, axis=1)).tolist()))


def _momenta(simulation, begin, end):
    """Larger of the momenta at both ends of a step, for bodies and nodes with finite mass, {id: [kg m/s]}."""
    out, dim = {}, simulation.scene.dim
    for k, view in enumerate((simulation.bodies, simulation.nodes)):
        if len(view):
            speed = np.maximum(*(np.linalg.norm(x.velocity[k][:, :dim], axis=1) for x in (begin, end)))
            mass = np.ravel(view.mass)
            moves = np.isfinite(mass) & (mass > 0)
            out |= dict(zip(view.id[moves].tolist(), (mass[moves] * speed[moves]).tolist()))
    return out


def staggered(strategy):
    """True if velocities are those in the middle of steps."""
    return strategy.row != "smooth_dem" and getattr(_moved_by(strategy), "row", "") in STAGGERED


def apart(simulation, norm, begin, end, exact, h):
    """Relative differences (of velocities, of positions) between the end of a step of h [s] and the exact end. Scales: the
    largest speed or that by gravity; the displacement. With staggered velocities the mean velocity of the step is compared."""
    loads, way = norm.of_loads(simulation, h), norm(exact.way_from(begin))
    differs = norm(end.way_from(exact))
    velocity = norm([a - b for a, b in zip(end.velocity, exact.velocity)])
    speed = max(norm(exact.velocity), norm(begin.velocity))
    if staggered(simulation.strategy):
        velocity, speed = differs / h, way / h
    return _over(velocity, max(speed, loads)), _over(differs, max(way, h * loads))


class Doubling:
    """A step made in two halves and undone, for comparison with the whole step from the same state: see `against`."""

    def __init__(self, simulation, dt=None):
        self._simulation, self._h = simulation, simulation.dt if dt is None else checks.positive("dt", dt)
        self._moved_by = _moved_by(simulation.strategy)
        self._staggered = staggered(simulation.strategy)
        self._state, self._norm = simulation.get_state(), EnergyNorm(simulation)
        self._begin = begin = End(simulation)
        if self._staggered:  # given at dt / 2 before the step; half steps need those of dt / 4
            change = [0.25 * (v - before) for v, before in zip(self.undone(1)[0].velocity, begin.velocity)]
            self._shift = [before + of for before, of in zip(begin.velocity, change)]
        self._fine, halves = self.undone(2)
        momenta = _momenta(simulation, begin, self._fine)
        first, second = halves
        before = _sizes_before(self._state, 0.5 * self._h) if simulation.strategy.stages else first.sizes
        self._smooth = not (
            first.jump_from(before, momenta)
            or second.jump_from(first.sizes, momenta)
            or first.jump_from(second.sizes, momenta)
        )
        self._bears = first.of_contacts or second.of_contacts

    def undone(self, parts):
        """(end of the step made in parts, _Impulses of each part); the step is undone again."""
        simulation, bore = self._simulation, []
        try:
            if self._staggered and parts > 1:
                simulation.bodies.set(velocity=self._shift[0])
                simulation.nodes.set(velocity=self._shift[1])
            for _ in range(parts):
                length = simulation.ready(self._h / parts)
                with simulation._stage.of_step(simulation):
                    core_of(simulation).step(length)
                bore.append(_Impulses(simulation))
            return End(simulation), bore
        finally:
            simulation.set_state(self._state)

    def fits(self, simulation):
        """True if the number of bodies and nodes is unchanged."""
        return len(simulation.bodies) == len(self._begin.position[0]) and len(simulation.nodes) == len(self._begin.position[1])

    def against(self, coarse):
        """Error estimate from the end of the whole step, a dict as of Simulation.time_error."""
        fine, h = self._fine, self._h
        order = order_of(self._moved_by)
        if not self._smooth or (self._bears and getattr(self._moved_by, "row", "") in KEEPS_FORCES):
            order = 1
        left = 1 / (1 - 0.5**order)  # error of the whole step over its difference from the halves
        velocity, position = apart(self._simulation, self._norm, self._begin, coarse, fine, h)
        return {"velocity": left * velocity, "position": left * position, "order": order}


def _over(difference, scale):
    return difference / scale if scale > 0 else 0.0


def halved(simulation):
    """Doubling of the coming step; None if its halves fail."""
    try:
        return Doubling(simulation)
    except Error:
        return None


def of_step(simulation, doubling):
    """Error estimate of the step made since; None without a doubling, or if bodies were added or removed."""
    if doubling is None or not doubling.fits(simulation):
        return None
    return doubling.against(End(simulation))


def time_error(simulation, dt=None):
    """See Simulation.time_error."""
    doubling = Doubling(simulation, dt)
    return doubling.against(doubling.undone(1)[0])
