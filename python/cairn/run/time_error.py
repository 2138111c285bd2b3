"""The error in time of a step, by doubling it: one step of dt against two of dt/2 from the same state."""

from __future__ import annotations

import math

import numpy as np

from .._core import Error
from ..pre import checks
from .views import core_of

# integrators of second order whatever their parameters, and the parameter at which others are
SECOND_ORDER = ("discrete_gradient", "hht", "generalised_alpha", "central_difference", "velocity_verlet")
STAGGERED = ("central_difference", "beta_scheme")  # velocities stand in the middle of steps
KEEPS_FORCES = ("velocity_verlet", "gear")  # of the last step, where impulses of contacts are of this one; joints take the middle
LARGEST_CHANGE, SHARE = 0.5, 0.05  # of an impulse between two halves of a step; of the momentum of a body
SECOND_AT_HALF = {"theta": "theta", "beta_scheme": "beta", "newmark": "gamma"}


def _moved_by(strategy):
    """The integrator of a strategy; None of velocity Verlet, where no other was given, and of parabolas."""
    return strategy.moved_by() if hasattr(strategy, "moved_by") else getattr(strategy, "integrator", None)


def order_of(moved_by):
    """Order of an integrator in smooth motion, of which one step errs by the next power; 1 of what is not known."""
    if moved_by is None:
        return 2
    row, values = moved_by.row, moved_by.values
    if row == "gear":
        return int(values["values"]) - 1
    return 2 if row in SECOND_ORDER or values.get(SECOND_AT_HALF.get(row)) == 0.5 else 1


class End:
    """Where bodies and nodes are at the end of a step and how fast."""

    def __init__(self, simulation):
        bodies, nodes, dim = simulation.bodies, simulation.nodes, simulation.scene.dim
        self.position = [np.array(bodies.position), np.array(nodes.position)]
        self.velocity = [np.array(bodies.velocity), np.array(nodes.velocity)[:, :dim]]
        self.rotation = np.array(bodies.rotation) if "rotation" in bodies.names else None

    @classmethod
    def of_arrays(cls, arrays):
        """What as_arrays gave."""
        end = cls.__new__(cls)
        end.position, end.velocity = ([arrays[f"end_{name}_{k}"] for k in range(2)] for name in ("position", "velocity"))
        end.rotation = arrays.get("end_rotation")
        return end

    def as_arrays(self):
        """By name, for a file."""
        out = {f"end_{name}_{k}": getattr(self, name)[k] for name in ("position", "velocity") for k in range(2)}
        return out if self.rotation is None else {**out, "end_rotation": self.rotation}

    def way_from(self, other):
        """Displacements of bodies with their rotations, and of nodes, from another end of a step."""
        bodies, nodes = (a - b for a, b in zip(self.position, other.position))
        if self.rotation is None or other.rotation is None:
            return [bodies, nodes]
        return [np.column_stack([bodies, _turn(other.rotation, self.rotation)]), nodes]


def _turn(begin, end):
    """Rotations from orientations to others, about the axes of the bodies, (n, 1 | 3) [rad]."""
    if begin.ndim == 1:
        return (end - begin)[:, None]
    w, v = begin[:, :1], begin[:, 1:]
    scalar = w * end[:, :1] + np.sum(v * end[:, 1:], axis=1, keepdims=True)
    return 2 * np.sign(scalar) * (w * end[:, 1:] - end[:, :1] * v - np.cross(v, end[:, 1:]))


class EnergyNorm:
    """The energy norm over the dofs that are free: sqrt(sum m |v|^2 + I |w|^2)."""

    def __init__(self, simulation):
        bodies, nodes, dim = simulation.bodies, simulation.nodes, simulation.scene.dim
        mass, inertia = np.ravel(bodies.mass), np.reshape(bodies.inertia, (len(bodies), 1 if dim == 2 else 3))
        moves = np.repeat(np.isfinite(mass)[:, None], dim + inertia.shape[1], axis=1)
        if "driven" in bodies.names:
            moves &= ~(np.ravel(bodies.driven)[:, None] >> np.arange(moves.shape[1]) & 1).astype(bool)
        rigid = np.column_stack([np.repeat(mass[:, None], dim, axis=1), inertia])
        self._weights = [np.where(moves, rigid, 0.0), np.reshape(nodes.mass, (len(nodes), 1))]

    def __call__(self, parts):
        """Of velocities or displacements of bodies (n, dim or all dofs) and of nodes (m, dim)."""
        total = 0.0
        for w, x in zip(self._weights, parts):
            w = w[:, : x.shape[1]] if w.shape[1] > 1 else w
            total += float(np.sum(w * x**2)) if len(x) else 0.0
        return math.sqrt(total)

    def of_loads(self, simulation, h):
        """What gravity alone makes of the velocities in h [s]."""
        g, dim = np.linalg.norm(simulation.stages.gravity), simulation.scene.dim
        return h * g * math.sqrt(sum(float(np.sum(np.max(w[:, :dim], axis=1))) for w in self._weights if len(w)))


class _Impulses:
    """What contacts bore in a step, by their keys: ids of the bodies, {key: (2,)}, and sizes, {key: [N s]}."""

    def __init__(self, simulation):
        contacts = simulation.contacts
        impulse = np.array(contacts.impulse)
        bears = np.any(impulse, axis=1)
        keys = list(map(tuple, np.array(contacts.key)[bears].tolist()))
        self.bodies = dict(zip(keys, np.array(contacts.bodies)[bears].tolist()))
        self.sizes = dict(zip(keys, np.linalg.norm(impulse[bears], axis=1).tolist()))
        self.of_contacts = any(key[2] >= 0 for key in keys)  # those of joints are below

    def jump_from(self, before, momenta):
        """Whether a contact bears otherwise than in a step as long, of which the sizes are known: an impact, which is no smooth
        motion. Forces that change by less than half, or by little beside the momentum of what they move, do not count."""
        for key, bodies in self.bodies.items():
            size, was = self.sizes[key], before.get(key, 0.0)
            change, least = abs(size - was), min(momenta.get(i, math.inf) for i in bodies)
            if change > LARGEST_CHANGE * max(size, was) and change > SHARE * least:
                return True
        return False


def _sizes_before(state, h):
    """Of the impulses that the last step left, for a step of h [s], {key: [N s]}."""
    memory = state["memory"]
    of, keys = int(memory["impulse_components"]), np.asarray(memory["keys"])
    if not of or not len(keys):
        return {}
    impulses = np.asarray(memory["impulses"]).reshape(len(keys), of)
    scale = h / memory["h"] if memory["h"] > 0 else 0.0
    return dict(zip(map(tuple, keys.tolist()), (scale * np.linalg.norm(impulses, axis=1)).tolist()))


def _momenta(simulation, begin, end):
    """The larger momentum of each body and node that has one, at both ends of a step, {id: [kg m/s]}."""
    out, dim = {}, simulation.scene.dim
    for k, view in enumerate((simulation.bodies, simulation.nodes)):
        if len(view):
            speed = np.maximum(*(np.linalg.norm(x.velocity[k][:, :dim], axis=1) for x in (begin, end)))
            mass = np.ravel(view.mass)
            moves = np.isfinite(mass) & (mass > 0)
            out |= dict(zip(view.id[moves].tolist(), (mass[moves] * speed[moves]).tolist()))
    return out


def staggered(strategy):
    """Whether velocities stand in the middle of steps."""
    return strategy.row != "smooth_dem" and getattr(_moved_by(strategy), "row", "") in STAGGERED


def apart(simulation, norm, begin, end, exact, h):
    """How far the end of a step of h [s] is from the exact one, (of velocities, of positions): over the largest speed or what
    gravity makes, and over the way. Speeds are those of the way where velocities stand in the middle of steps."""
    loads, way = norm.of_loads(simulation, h), norm(exact.way_from(begin))
    differs = norm(end.way_from(exact))
    velocity = norm([a - b for a, b in zip(end.velocity, exact.velocity)])
    speed = max(norm(exact.velocity), norm(begin.velocity))
    if staggered(simulation.strategy):
        velocity, speed = differs / h, way / h
    return _over(velocity, max(speed, loads)), _over(differs, max(way, h * loads))


class Doubling:
    """A step in two halves, made and undone, to be set against the whole one from the same state: see `against`."""

    def __init__(self, simulation, dt=None):
        self._simulation, self._h = simulation, simulation.dt if dt is None else checks.positive("dt", dt)
        self._moved_by = _moved_by(simulation.strategy)
        self._staggered = staggered(simulation.strategy)
        self._state, self._norm = simulation.get_state(), EnergyNorm(simulation)
        self._begin = begin = End(simulation)
        if self._staggered:  # velocities are those of dt / 2 before the step, and of halves of it are to be those of dt / 4
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
        """The end of the step made in parts, and what contacts bore in each, undone again."""
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
        """Whether the bodies are those that there were."""
        return len(simulation.bodies) == len(self._begin.position[0]) and len(simulation.nodes) == len(self._begin.position[1])

    def against(self, coarse):
        """The estimate, from the end of the whole step."""
        fine, h = self._fine, self._h
        order = order_of(self._moved_by)
        if not self._smooth or (self._bears and getattr(self._moved_by, "row", "") in KEEPS_FORCES):
            order = 1
        left = 1 / (1 - 0.5**order)  # what the whole step errs by, over what it differs by
        velocity, position = apart(self._simulation, self._norm, self._begin, coarse, fine, h)
        return {"velocity": left * velocity, "position": left * position, "order": order}


def _over(difference, scale):
    return difference / scale if scale > 0 else 0.0


def halved(simulation):
    """The coming step in halves; None if it cannot be made so."""
    try:
        return Doubling(simulation)
    except Error:
        return None


def of_step(simulation, doubling):
    """The estimate for the step that was made since; None without one, and where bodies came in or went."""
    if doubling is None or not doubling.fits(simulation):
        return None
    return doubling.against(End(simulation))


def time_error(simulation, dt=None):
    """See Simulation.time_error."""
    doubling = Doubling(simulation, dt)
    return doubling.against(doubling.undone(1)[0])
