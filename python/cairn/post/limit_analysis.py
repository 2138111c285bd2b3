"""Limit analysis of rigid blocks by linear programming: an independent check of stability and of the collapse load.

Static theorem (Livesley 1978): blocks stand if some set of joint forces, compressive and inside Coulomb's cone, balances
their loads. A joint carries forces at its corners, which spans all resultants whose thrust lies in the joint; the cone is
replaced by a pyramid inside it in 3D, so that loads are on the safe side by at most 1 - cos(pi / facets). Sliding is
associated (it dilates): where sliding rules, the multiplier is an upper bound of Coulomb's (Drucker 1954); where hinges rule,
both agree. Solved with HiGHS (Huangfu & Hall 2018) through scipy.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base import checks
from ..names import teach
from ..pre.blocks import Blocks, Joints
from ..pre.mesh import library

TIME_LIMIT = 600.0  # s


@dataclass(frozen=True)
class Limit:
    """Result of a linear programme, true where the load is carried. status: "optimal", "infeasible" (nothing stands),
    "unbounded" (it never falls) or HiGHS's message where it gives up, after 10 minutes say; multiplier: of the live load;
    forces: (p, dim) [N] at corners, on the first block of their joint; joint: (p,) their joints; points (p, dim) [m];
    mechanism: (n, 3 | 6) velocities of the blocks at collapse, of which the live load's power is 1 (None without a live
    load), translation of the centre then rotation."""

    status: str
    multiplier: float
    forces: np.ndarray | None = None
    joint: np.ndarray | None = None
    points: np.ndarray | None = None
    mechanism: np.ndarray | None = None

    def __bool__(self):
        """True if the structure can carry its load; False if the programme is infeasible or was given up."""
        return self.status in ("optimal", "unbounded")


class Assembly:
    """Blocks, their joints and dead load, ready for linear programmes.

    mu: Coulomb's coefficient; density [kg/m3]; gravity (dim,) [m/s2]; joints: those found by geometry unless given;
    facets: of the friction pyramid in 3D; measure (n,), center (n, dim): area or volume and centre of the blocks where these
    are not their polygons' (curved voussoirs); depth [m] in 2D. Blocks of the part "support" are held.
    """

    def __init__(
        self,
        blocks: Blocks,
        mu,
        density=1.0,
        gravity=None,
        *,
        joints: Joints | None = None,
        facets=8,
        measure=None,
        center=None,
        depth=1.0,
    ):
        if not isinstance(blocks, Blocks):
            raise ValueError(f"blocks is {blocks!r}: give Blocks, as cairn.pre.masonry.arch(...) and the like make them")
        self.blocks, self.dim = blocks, blocks.dim
        self.mu = checks.positive("mu", mu)
        self.facets = checks.count("facets", facets, 3)
        properties = blocks.properties()
        self.center = properties.center if center is None else np.asarray(center, float)
        volume = properties.measure if measure is None else np.asarray(measure, float)
        self.mass = checks.positive("density", density) * volume * (depth if self.dim == 2 else 1.0)
        down = np.eye(self.dim)[-1] * -9.81 if gravity is None else checks.real_array("gravity", gravity, (self.dim,))
        self.joints = blocks.joints() if joints is None else joints
        self.held = blocks.mask("support")
        self.load = self.loads(self.mass[:, None] * down)
        low, high = blocks.bounds()
        self.size = float(np.max(high - low))
        self.weight = float(np.sum(np.abs(self.load[~self.held]))) or 1.0
        self.points, self.joint, self.rays, self.ray_point = self._rays()
        self.matrix = self._equilibrium()

    @property
    def rotations(self):
        return 1 if self.dim == 2 else 3

    def loads(self, forces, points=None):
        """Resultants (n, 3 | 6) about the centres of the blocks, of forces (n, dim) [N] at points (n, dim) [m] or centres."""
        forces = np.asarray(forces, float)
        arm = np.zeros_like(forces) if points is None else np.asarray(points, float) - self.center
        return np.concatenate([forces, moment(arm, forces)], axis=1)

    def _rays(self):
        """Corners of all joints, and the extreme forces of the cone at each: points (p, dim), joint (p,), rays (r, dim),
        corner of each ray (r,)."""
        joint = np.repeat(np.arange(len(self.joints.area)), [len(p) for p in self.joints.polygon])
        points = np.concatenate([*self.joints.polygon, np.empty((0, self.dim))])
        n = self.joints.normal[joint]
        if self.dim == 2:
            t = np.column_stack((-n[:, 1], n[:, 0]))
            rays = np.stack((n + self.mu * t, n - self.mu * t), axis=1)
        else:
            least = np.eye(3)[np.argmin(np.abs(n), axis=1)]
            t = np.cross(n, least)
            t /= np.linalg.norm(t, axis=1, keepdims=True)
            s = np.cross(n, t)
            angle = 2 * np.pi * np.arange(self.facets) / self.facets
            turn = np.cos(angle)[None, :, None] * t[:, None] + np.sin(angle)[None, :, None] * s[:, None]
            rays = n[:, None] + self.mu * turn
        count = rays.shape[1]
        return points, joint, rays.reshape(-1, self.dim), np.repeat(np.arange(len(points)), count)

    def _equilibrium(self):
        """Resultants on the free blocks of unit rays: sparse (dofs of free blocks, rays)."""
        sparse = library("scipy.sparse", "for limit analysis")
        dofs = self.dim + self.rotations
        number = np.full(len(self.blocks), -1)
        number[~self.held] = np.arange(np.sum(~self.held))
        rows, columns, values = [], [], []
        for side, sign in ((0, 1.0), (1, -1.0)):
            body = self.joints.blocks[self.joint[self.ray_point], side]
            arm = (self.points[self.ray_point] - self.center[body]) / self.size
            wrench = sign * np.concatenate([self.rays, moment(arm, self.rays)], axis=1)
            free = np.flatnonzero(number[body] >= 0)
            rows.append((number[body[free]][:, None] * dofs + np.arange(dofs)).ravel())
            columns.append(np.repeat(free, dofs))
            values.append(wrench[free].ravel())
        shape = (int(np.sum(~self.held)) * dofs, len(self.rays))
        return sparse.csr_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=shape)

    def _scaled(self, load):
        """Loads on free blocks in units of the weight and the size, as one vector."""
        load = np.array(load[~self.held], float)
        load[:, self.dim :] /= self.size
        return load.ravel() / self.weight

    # ------------------------------------------------------------------ questions

    def collapse(self, live) -> Limit:
        """Largest multiplier of the live load (n, dim) forces at centres [N], or (n, 3 | 6) resultants, beside the dead load."""
        live = np.asarray(live, float)
        live = self.loads(live) if live.shape == (len(self.blocks), self.dim) else live
        live = checks.real_array("live", live, (len(self.blocks), self.dim + self.rotations))
        sparse = library("scipy.sparse", "for limit analysis")
        column = sparse.csr_array(self._scaled(live)[:, None])
        matrix = sparse.hstack([self.matrix, column], format="csr")
        cost = np.zeros(matrix.shape[1])
        cost[-1] = -1.0
        result = solve(cost, matrix, -self._scaled(self.load), free=1)
        return self._limit(result, result.x[-1] if result.x is not None else np.nan, live)

    def stands(self) -> Limit:
        """Checks whether the dead load alone can be carried: true and of status "optimal" if so, false and "infeasible" if
        not."""
        result = solve(np.zeros(len(self.rays)), self.matrix, -self._scaled(self.load))
        return self._limit(result, np.nan)

    def force_bounds(self, block, direction) -> tuple[Limit, Limit]:
        """Least and largest total force [N] along a direction on one block, a support say: multiplier holds it."""
        direction = checks.real_array("direction", direction, (self.dim,))
        sides = self.joints.blocks[self.joint[self.ray_point]]
        sign = (sides[:, 0] == block) * 1.0 - (sides[:, 1] == block)
        cost = sign * (self.rays @ direction)
        found = []
        for way in (1.0, -1.0):
            result = solve(way * cost, self.matrix, -self._scaled(self.load))
            value = way * result.fun * self.weight if result.x is not None else np.nan
            found.append(self._limit(result, value))
        return tuple(found)

    def _limit(self, result, value, live=None):
        status = {0: "optimal", 2: "infeasible", 3: "unbounded"}.get(result.status, result.message)
        if result.x is None or result.status != 0:
            return Limit(status, np.inf if status == "unbounded" else np.nan)
        forces = np.zeros((len(self.points), self.dim))
        np.add.at(forces, self.ray_point, self.rays * result.x[: len(self.rays), None] * self.weight)
        moves = None
        if live is not None:
            moves = np.zeros((len(self.blocks), self.dim + self.rotations))
            moves[~self.held] = result.eqlin.marginals.reshape(-1, self.dim + self.rotations)
            moves[:, self.dim :] /= self.size
            moves /= np.sum(moves * live)
        return Limit(status, float(value), forces, self.joint, self.points, moves)


def moment(arm, force):
    """(n, 1 | 3) moments of forces at arms (n, dim)."""
    if arm.shape[1] == 2:
        return (arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0])[:, None]
    return np.cross(arm, force)


def solve(cost, matrix, right, free=0):
    """min cost . x, matrix x = right, x >= 0 but for the last `free` ones."""
    linprog = library("scipy.optimize", "for limit analysis").linprog
    bounds = [(0, None)] * (len(cost) - free) + [(None, None)] * free
    for method in ("highs", "highs-ipm"):  # interior points may solve where the simplex gives up, as among splinters
        options = {"time_limit": TIME_LIMIT}
        result = linprog(cost, A_eq=matrix, b_eq=right, bounds=bounds, method=method, options=options)
        if result.status in (0, 2, 3):
            break
    return result


def bisect(stands, low, high, tol=1e-4):
    """The number between low and high at which `stands(x)` (a bool) changes, to a width tol * |high - low|.

    Raises ValueError when it is the same at both ends.
    """
    low, high = checks.number("low", low), checks.number("high", high)
    at_low, at_high = bool(stands(low)), bool(stands(high))
    if at_low == at_high:
        raise ValueError(f"the structure {'stands' if at_low else 'falls'} both at {low:g} and at {high:g}: widen the interval")
    width = abs(high - low) * checks.positive("tol", tol)
    while abs(high - low) > width:
        middle = (low + high) / 2
        low, high = (middle, high) if bool(stands(middle)) == at_low else (low, middle)
    return (low + high) / 2


def arch_sectors(radius, thickness, voussoirs, half_angle=np.pi / 2):
    """Area (n,) and centre (n, 2) of the voussoirs of a circular arch whose faces are curved, for Assembly's measure and
    center: blocks made by cairn.pre.masonry.arch are polygons inscribed in them."""
    inner, outer = radius - thickness / 2, radius + thickness / 2
    half = half_angle / voussoirs
    middle = half * (2 * np.arange(voussoirs) + 1 - voussoirs)
    area = half * (outer**2 - inner**2)
    reach = 2 * (outer**3 - inner**3) * np.sin(half) / (3 * (outer**2 - inner**2) * half)
    return np.full(voussoirs, area), reach * np.column_stack((np.sin(middle), np.cos(middle)))


teach(globals())
