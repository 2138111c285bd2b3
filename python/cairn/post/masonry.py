"""Results of masonry simulations: joint resultants, thrust line, hinges, sliding, moving parts, cracks, balance; and the collapse
load, by bisection.

Everything is computed from plain arrays of the contacts; forces are impulses over the step and act on a joint's first block.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base import checks
from ..names import teach
from ..pre.blocks import Blocks
from ..run.sets import found


@dataclass(frozen=True)
class Resultants:
    """k joints that touch. blocks (k, 2) numbers; normal (k, dim) from the second to the first; force (k, dim) [N] on the
    first; pressure (k,) [N], its normal part; shear (k,) [N]; center (k, dim) [m], the middle of the contact points; thrust
    (k, dim) [m], where the resultant passes through the joint; eccentricity (k,), distance of the thrust from the middle over
    that of the contact points' border that way: 1 at the edge, and where a corner or an edge alone touches; points (k,), how
    many contact points."""

    blocks: np.ndarray
    normal: np.ndarray
    force: np.ndarray
    pressure: np.ndarray
    shear: np.ndarray
    center: np.ndarray
    thrust: np.ndarray
    eccentricity: np.ndarray
    points: np.ndarray

    def hinges(self, near=0.98):
        """Joints that carry load within (1 - near) of their edge: rotation is about to begin or under way."""
        return np.flatnonzero((self.pressure > 0) & (self.eccentricity >= near))

    def sliding(self, mu, near=0.999):
        """Joints that carry load with their friction used up."""
        return np.flatnonzero((self.pressure > 0) & (self.shear >= near * mu * self.pressure))


def joint_resultants(blocks, normal, point, force) -> Resultants:
    """Resultants of all contact points between each two bodies.

    blocks (m, 2) numbers of the bodies of each contact; normal (m, dim); point (m, dim) [m]; force (m, dim) [N] on the first.
    """
    blocks, normal, point, force = (np.asarray(x) for x in (blocks, normal, point, force))
    dim = normal.shape[1]
    swap = blocks[:, 0] > blocks[:, 1]
    sign = np.where(swap, -1.0, 1.0)[:, None]
    ordered = np.where(swap[:, None], blocks[:, ::-1], blocks)
    pairs, joint = np.unique(ordered, axis=0, return_inverse=True)
    joint, k = joint.ravel(), len(pairs)

    def total(x):
        return np.stack([np.bincount(joint, c, k) for c in x.T], axis=1) if k else np.zeros((0, x.shape[1]))

    count = np.bincount(joint, minlength=k)
    n = total(normal * sign)
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    center, f = total(point) / count[:, None], total(force * sign)
    pressure = np.einsum("ij,ij->i", f, n)
    shear = np.linalg.norm(f - pressure[:, None] * n, axis=1)
    # the axis of the resultant meets the joint's plane where the forces along n have their middle
    along = np.einsum("ij,ij->i", force * sign, n[joint])
    safe = np.where(pressure > 0, pressure, 1.0)
    thrust = np.where((pressure > 0)[:, None], total(point * along[:, None]) / safe[:, None], center)
    offset = thrust - center
    reach = np.linalg.norm(offset, axis=1)
    way = offset / np.where(reach > 0, reach, 1.0)[:, None]
    border = np.zeros(k)
    np.maximum.at(border, joint, np.einsum("ij,ij->i", point - center[joint], way[joint]))
    eccentricity = np.where(border > 0, reach / np.where(border > 0, border, 1.0), 0.0)
    eccentricity[count < dim] = 1.0  # a corner, or in 3D an edge, is all that touches
    return Resultants(pairs, n, f, pressure, shear, center, thrust, eccentricity, count)


class Structure:
    """Blocks in a simulation. blocks: cairn.pre.blocks.Blocks at the start; ids (n,): their bodies (Blocks.add_to gives both).

    The state is read when it is asked for: every question is about the last step. The start, from which openings and
    displacements count, is how the blocks stand in the scene, before or after steps were made.
    """

    def __init__(self, blocks: Blocks, simulation, ids):
        if not isinstance(blocks, Blocks):
            raise ValueError(f"blocks is {blocks!r}: give Blocks, then the simulation, then the ids that blocks.add_to returned")
        if not hasattr(simulation, "step"):
            raise ValueError(f"simulation is {simulation!r}: give the cairn.Simulation that the blocks are in")
        self.blocks, self.simulation = blocks, simulation
        self.ids = np.asarray(ids)
        if self.ids.shape != (len(blocks),):
            raise ValueError(f"ids has shape {self.ids.shape}: give one for each of the {len(blocks)} blocks")
        self.dim = blocks.dim
        self.held = blocks.mask("support")
        self.start = self._places_in_scene()
        self._joints = None

    def places(self):
        """Position (n, dim) and rotation, (n,) or (n, 4), of the blocks."""
        rows = self.rows()
        bodies = self.simulation.bodies
        return bodies.position[rows], bodies.rotation[rows]

    def _places_in_scene(self):
        """Position and rotation of the blocks in the scene, in the form of `places`."""
        position, rotation = (np.array(x) for x in self.places())
        order = np.argsort(self.ids)
        for s in self.simulation._sets:
            if s.mesh is not None or s.mass is None:  # nodes, and drives of bodies of other sets
                continue
            at, here = found(s.own_ids, self.ids[order])
            own, origin = order[here[at]], self.simulation.scene.origin
            position[own] = (s.position[at] - origin) + origin  # with the digits that positions have about the origin
            rotation[own] = s.rotation[at] if s.rotation is not None else [0.0] if self.dim == 2 else [1.0, 0.0, 0.0, 0.0]
        return position, rotation

    def rows(self):
        """Rows of the blocks among the bodies."""
        known = np.asarray(self.simulation.bodies.id)
        order = np.argsort(known)
        rows = order[np.minimum(np.searchsorted(known[order], self.ids), len(order) - 1)]
        if not np.array_equal(known[rows], self.ids):
            k = int(np.argmax(known[rows] != self.ids))
            raise ValueError(f"ids[{k}] is {self.ids[k]}: the simulation has no such body; give what Blocks.add_to returned")
        return rows

    # ------------------------------------------------------------------ forces

    def contacts(self):
        """Contacts between blocks: numbers (m, 2), normal, point, force on the first."""
        c = self.simulation.contacts
        bodies = np.asarray(c.bodies).reshape(-1, 2)
        order = np.argsort(self.ids)
        at = np.minimum(np.searchsorted(self.ids[order], bodies), len(order) - 1)
        numbers = order[at]
        known = (self.ids[numbers] == bodies).all(axis=1)
        point = c.point + self.simulation.scene.origin
        return numbers[known], c.normal[known], point[known], c.force[known]

    def resultants(self) -> Resultants:
        """Resultants of each joint that has contact points."""
        return joint_resultants(*self.contacts())

    def thrust_line(self, chain):
        """Points (m, dim) where the resultants cross the joints of a chain of blocks, a list of numbers from support to
        support; joints that carry nothing give NaN."""
        chain = checks.reals("chain", chain, "give numbers of blocks, from support to support")
        n = len(self.blocks)
        if chain.ndim != 1 or len(chain) < 2 or np.any(chain != np.round(chain)):
            raise ValueError(f"chain is {chain}: give the numbers of two blocks and more, from support to support")
        if np.any((chain < 0) | (chain >= n)):
            raise ValueError(f"chain names block {int(chain[(chain < 0) | (chain >= n)][0])}: there are blocks 0 to {n - 1}")
        chain, r = chain.astype(int).tolist(), self.resultants()
        found = {tuple(pair): k for k, pair in enumerate(r.blocks.tolist())}
        keys = [found.get((min(a, b), max(a, b))) for a, b in zip(chain[:-1], chain[1:])]
        return np.array([np.full(self.dim, np.nan) if k is None or r.pressure[k] <= 0 else r.thrust[k] for k in keys])

    def weight(self):
        """Weights of the blocks (n, dim) [N]; zero for held ones."""
        gravity = self.simulation.scene.gravity
        gravity = gravity(self.simulation.time) if callable(gravity) else gravity
        mass = self.simulation.bodies.mass[self.rows()]
        return np.where(self.held[:, None], 0.0, np.where(self.held, 0.0, mass)[:, None] * gravity)

    def applied(self):
        """Forces (n, dim) [N] of the last step that were given to free blocks beside their weight (`force` of their sets)."""
        given = getattr(self.simulation.bodies, "force", None)
        if given is None:
            return np.zeros((len(self.ids), self.dim))
        return np.where(self.held[:, None], 0.0, given[self.rows()][:, : self.dim])

    def balance(self):
        """Residual of static equilibrium: a dict. reaction (dim,) [N] of the supports on blocks; weight, applied (dim,) [N];
        reaction_error, |reaction + weight + applied| over the load carried; unbalanced, the largest residual force of a free
        block over its weight and applied load; speed [m/s]."""
        numbers, _, _, force = self.contacts()
        weight, applied = self.weight(), self.applied()
        left = weight + applied
        reaction = np.zeros(self.dim)
        for side, sign in ((0, 1.0), (1, -1.0)):
            for axis in range(self.dim):
                left[:, axis] += sign * np.bincount(numbers[:, side], force[:, axis], len(left))
            other = numbers[:, 1 - side]
            by_support = self.held[other] & ~self.held[numbers[:, side]]
            reaction += sign * force[by_support].sum(axis=0)
        size = np.linalg.norm(weight[~self.held], axis=1) + np.linalg.norm(applied[~self.held], axis=1)
        total, more = weight.sum(axis=0), applied.sum(axis=0)
        velocity = self.simulation.bodies.velocity[self.rows()][~self.held, : self.dim]
        return {
            "reaction": reaction,
            "weight": total,
            "applied": more,
            "reaction_error": share(np.linalg.norm(reaction + total + more), np.linalg.norm(total) + np.linalg.norm(more)),
            "unbalanced": share(np.linalg.norm(left[~self.held], axis=1), size),
            "speed": float(np.max(np.linalg.norm(velocity, axis=1), initial=0.0)),
        }

    def stress(self):
        """Mean stress (n, dim, dim) [Pa] in each block, tension positive: -1/V sum f x (Love 1927, Weber 1966)."""
        from .measures import body_moments

        numbers, _, point, force = self.contacts()
        position = self.places()[0]
        a, b = numbers.T
        moments = body_moments(len(self.ids), a, b, force, point - position[a], point - position[b])
        volume = self.blocks.properties().measure * (self.depth() if self.dim == 2 else 1.0)
        return (moments + np.swapaxes(moments, 1, 2)) / 2 / volume[:, None, None]

    def depth(self):
        """How deep each block is in 2D, (n,) [m]: as its mass, and so the forces on it, are; of one whose mass was given, the
        scene's depth."""
        depth = np.full(len(self.ids), float(self.simulation.scene.depth))
        for bodies in self.simulation._sets:
            if bodies.depth is not None:
                depth[np.isin(self.ids, bodies.ids)] = bodies.depth
        return depth

    # ------------------------------------------------------------------ motion

    def moved(self, points, block):
        """Present positions of points (m, dim) given at the start on blocks (m,)."""
        (p0, r0), (p1, r1) = self.start, self.places()
        local = points - p0[block]
        if self.dim == 2:
            angle = (r1 - r0)[block] if np.ndim(r1) else np.zeros(len(block))
            c, s = np.cos(angle), np.sin(angle)
            turned = np.column_stack((c * local[:, 0] - s * local[:, 1], s * local[:, 0] + c * local[:, 1]))
        else:
            turned = rotate(r1[block], rotate(conjugate(r0[block]), local))
        return p1[block] + turned

    def joints(self):
        """Joints of the blocks at the start, found once."""
        if self._joints is None:
            self._joints = self.blocks.joints()
        return self._joints

    def openings(self):
        """How the joints of the start have opened: a dict of arrays. blocks (k, 2); opening (k,) [m], the largest normal
        separation of two corners that were one; slip (k,) [m], the largest along the joint."""
        j = self.joints()
        joint = np.repeat(np.arange(len(j.area)), [len(p) for p in j.polygon])
        points = np.concatenate([*j.polygon, np.empty((0, self.dim))])
        a, b = j.blocks[joint].T
        apart = self.moved(points, a) - self.moved(points, b)
        n = self.moved(points + j.normal[joint], b) - self.moved(points, b)
        across = np.einsum("ij,ij->i", apart, n)
        slide = np.linalg.norm(apart - across[:, None] * n, axis=1)
        opening, slip = np.full(len(j.area), -np.inf), np.zeros(len(j.area))
        np.maximum.at(opening, joint, across)
        np.maximum.at(slip, joint, slide)
        return {"blocks": j.blocks, "opening": opening, "slip": slip}

    def moving_sets(self, tolerance=1e-3):
        """Sets of blocks that move as one: lists of numbers, largest first, the set of the supports first of all.

        Blocks belong together when their joint has opened and slipped by less than the tolerance times the size of the
        smaller of both.
        """
        o = self.openings()
        size = np.array([np.max(np.ptp(v, axis=0)) for v in self.blocks.vertices])
        least = np.minimum(*size[o["blocks"].T])
        together = (np.maximum(o["opening"], o["slip"]) <= tolerance * least) | self.held[o["blocks"]].all(axis=1)
        label = np.arange(len(self.ids))
        label[self.held] = np.flatnonzero(self.held)[0] if np.any(self.held) else label[self.held]
        links = o["blocks"][together]
        while True:
            new = label.copy()
            smallest = np.minimum(label[links[:, 0]], label[links[:, 1]])
            np.minimum.at(new, links[:, 0], smallest)
            np.minimum.at(new, links[:, 1], smallest)
            new = np.minimum(new, new[new])
            if np.array_equal(new, label):
                break
            label = new
        sets = [np.flatnonzero(label == k).tolist() for k in np.unique(label)]
        return sorted(sets, key=lambda s: (not np.any(self.held[s]), -len(s)))

    def displacement(self):
        """How far the centre of each block has moved, (n,) [m]."""
        return np.linalg.norm(self.places()[0] - self.start[0], axis=1)


def share(part, whole):
    """Largest ratio part / whole; 0 where both vanish, as without gravity."""
    part, whole = np.atleast_1d(part), np.atleast_1d(whole)
    return float(np.max(np.divide(part, whole, out=np.where(part > 0, np.inf, 0.0), where=whole > 0), initial=0.0))


def conjugate(q):
    return q * np.array([1.0, -1, -1, -1])


def rotate(q, v):
    """Vectors (n, 3) turned by unit quaternions (n, 4)."""
    u, w = q[:, 1:], q[:, :1]
    t = 2 * np.cross(u, v)
    return v + w * t + np.cross(u, t)


# ---------------------------------------------------------------------- collapse


def tilted_gravity(angle, dim, towards=None, g=9.81):
    """Gravity (dim,) [m/s2] of a table tilted by an angle [rad] so that things slide along `towards`, +x unless told."""
    if dim == 2:
        return g * np.array([np.sin(angle), -np.cos(angle)])
    way = np.array([1.0, 0.0, 0.0]) if towards is None else np.asarray(towards, float)
    way = way / np.linalg.norm(way)
    return g * (np.sin(angle) * way - np.cos(angle) * np.array([0.0, 0.0, 1.0]))


def stands(structure: Structure, steps, every=50, fall=0.02, quiet=1e-3):
    """Tests stability by simulation: True once all is at rest, False once a block has moved by `fall` times the structure's size.

    Runs at most `steps` steps. Rest: kinetic energy below quiet^2 times that of a fall by `fall`. If neither occurs, a structure
    that moves faster than at half time is taken to fall.
    """
    sim = structure.simulation
    low, high = structure.blocks.bounds()
    size = float(np.max(high - low))
    gravity = np.linalg.norm(structure.weight().sum(axis=0)) / np.sum(sim.bodies.mass[structure.rows()][~structure.held])
    speed = np.sqrt(2 * gravity * fall * size)
    checks.count("steps", steps, 1)
    rows = structure.rows()[~structure.held]
    mass = sim.bodies.mass[rows]
    history, done = [], 0
    while done < steps:
        for _ in range(min(every, steps - done)):
            sim.step()
        done += every
        if structure.displacement()[~structure.held].max() > fall * size:
            return False
        v = sim.bodies.velocity[rows][:, : sim.scene.dim]
        history.append(np.sqrt(np.sum(mass * np.sum(v * v, axis=1)) / np.sum(mass)))
        if history[-1] < quiet * speed and len(history) > 1:
            return True
    return history[-1] <= history[len(history) // 2]


teach(globals())
