"""The scenes of the table: each is built at an Extreme, runs a few steps, and returns Figures beside their references.

Lengths scale with `size` and the step with sqrt(size / g), so that an extreme is one of numbers, not another motion.
"""

from __future__ import annotations

from dataclasses import dataclass

import cairn as cn
import numpy as np

GRAVITY = 9.81
EPSILON = np.finfo(float).eps


@dataclass(frozen=True)
class Extreme:
    """Extreme parameters of a scene. size: radius [m]; ratio: of masses; step: times the usual one; shift: of all places [m];
    origin: of the scene put there; overlap: share of a radius; tangent: of the slope; tol, max_iter: of the solver."""

    size: float = 0.125
    ratio: float = 1.0
    mu: float = 0.5
    step: float = 1.0
    shift: float = 0.0
    origin: bool = False
    overlap: float = 0.0
    tangent: float = 1.0
    other: float | None = None  # radius of the second body where sizes mix [m]
    count: int = 24
    steps: int = 10
    tol: float = 1e-10
    max_iter: int = 20000
    limit_told: bool = False  # status iteration_limit with its residual is an answer too

    @property
    def dt(self):
        return 1e-2 * self.step * np.sqrt(self.size / GRAVITY)


@dataclass(frozen=True)
class Figure:
    """A number beside its reference. error = |figure - reference| / scale."""

    name: str
    figure: float
    reference: float
    scale: float
    gate: float

    @property
    def error(self):
        return abs(self.figure - self.reference) / self.scale if self.scale > 0 else abs(self.figure - self.reference)


def near(name, figure, reference, gate, scale=None):
    """The component that is furthest from its reference."""
    figure, reference = np.broadcast_arrays(np.asarray(figure, float), np.asarray(reference, float))
    scale = float(np.max(np.abs(reference))) if scale is None else float(scale)
    if figure.size == 0:
        return Figure(name, np.nan, 0.0, 1.0, gate)
    away = np.abs(figure - reference).ravel()
    k = int(np.argmax(np.where(np.isfinite(away), away, np.inf)))
    return Figure(name, float(figure.ravel()[k]), float(reference.ravel()[k]), scale, gate)


class Watched:
    """A simulation whose every step is looked at: no number that is none, a closed balance of energy, an end that is told."""

    def __init__(self, scene, x, law, status="converged", closure=1e-12, solver=None, **strategy):
        if law is not None:
            scene.interact("*", "*", law)
        solver = solver or cn.NLGS(tol=x.tol, max_iter=x.max_iter)
        self.sim = cn.Simulation(scene, x.dt, cn.NSCD(solver=solver, threads=1, **strategy), overlap="ignore")
        self.allowed = (status,) if isinstance(status, str) else status
        self.tol, self.closure, self.seen, self.residual, self.mistold = x.tol, closure, set(), 0.0, 0

    def run(self, steps):
        sim = self.sim
        for _ in range(steps):
            info = sim.step()
            self.seen.add(info["status"])
            self.residual = max(self.residual, info["error"])
            self.mistold += (info["status"] == "converged") != (info["error"] <= self.tol)
            for name in {"position", "velocity", "rotation"} & set(sim.bodies.names):
                values = getattr(sim.bodies, name)
                assert np.all(np.isfinite(values)), f"{name} holds a number that is none at step {sim.steps}"
            for name in ("gap", "normal", "impulse", "relative_velocity"):
                values = getattr(sim.contacts, name)
                assert np.all(np.isfinite(values)), f"{name} of contacts holds a number that is none at step {sim.steps}"
            assert np.isfinite(info["error"]), f"the error is {info['error']}"
        return sim

    def usual(self):
        """Figures that every cell must show."""
        energy = self.sim.energy
        in_play = energy["in_play"]
        wrong = sorted(self.seen - set(self.allowed))
        return [
            Figure(f"status {'/'.join(wrong or sorted(self.seen))}", float(len(wrong)), 0.0, 1.0, 0.0),
            Figure("steps whose status belies their residual", float(self.mistold), 0.0, 1.0, 0.0),
            near("energy closure", energy["closure"], 0.0, self.closure, scale=in_play or 1.0),
        ]


def frame(dim, x):
    """Scene with gravity downwards, unit vector upwards, the place that stands for zero."""
    up, place = np.eye(dim)[-1], np.full(dim, x.shift)
    scene = cn.Scene(dim, gravity=-GRAVITY * up, origin=place if x.origin else None)
    return scene, up, place


def balls(dim):
    return cn.disks if dim == 2 else cn.spheres


def spins(dim):
    return ("w",) if dim == 2 else ("wx", "wy", "wz")


def force_along(sim, direction):
    return sim.contacts.force @ direction


def ulps(x):
    """Spacing of doubles at the place, in sizes of the body."""
    return 0.0 if x.origin or not x.shift else 2 * np.spacing(x.shift) / x.size


# ---------------------------------------------------------------------- scenes


def ball_on_floor(dim, x):
    """A ball at rest: reaction = weight, nothing moves."""
    scene, up, place = frame(dim, x)
    rock = cn.Material("rock", density=1000.0)
    scene.add(balls(dim)([place + (1 - x.overlap) * x.size * up], x.size, rock), cn.wall(place, up, rock))
    watched = Watched(scene, x, cn.Coulomb(mu=x.mu))
    start = watched.sim.bodies.position[0]
    sim = watched.run(x.steps)
    weight = sim.bodies.mass[0] * GRAVITY
    return watched.usual() + [
        near("reaction", force_along(sim, up)[0] / weight, 1.0, 1e-9),
        near("moved", (sim.bodies.position[0] - start) / x.size, 0.0, 1e-12 + ulps(x), scale=1.0),
    ]


def block_on_slope(dim, x):
    """A body that cannot turn slides with g (sin a - mu cos a), or sticks."""
    angle = np.arctan(x.tangent)
    scene, up, place = frame(dim, x)
    down = np.zeros(dim)
    down[[0, -1]] = GRAVITY * np.sin(angle), -GRAVITY * np.cos(angle)
    scene.gravity = down
    rock = cn.Material("rock", density=1000.0)
    scene.add(balls(dim)([place + (1 - x.overlap) * x.size * up], x.size, rock, driven=spins(dim)), cn.wall(place, up, rock))
    watched = Watched(scene, x, cn.Coulomb(mu=x.mu))
    sim = watched.run(x.steps)
    fall = GRAVITY * np.sin(angle) * sim.time
    slides = 0.0 if x.mu >= x.tangent else fall - GRAVITY * np.cos(angle) * x.mu * sim.time
    return watched.usual() + [
        near("speed", sim.bodies.velocity[0, 0] / fall, slides / fall, 1e-9, scale=1.0),
        near("lift", sim.bodies.velocity[0, dim - 1] / fall, 0.0, 1e-9, scale=1.0),
    ]


def collision(dim, x):
    """Two balls head on, e = 1/2: v = V + e (V - v-), V the speed of their centre of mass."""
    scene, up, place = frame(dim, x)
    scene.gravity = np.zeros(dim)
    one, two = x.size, x.size if x.other is None else x.other
    places, speeds = np.tile(place, (2, 1)), np.zeros((2, dim))
    places[1, 0] += one + two - x.overlap * min(one, two)
    unit = min(one, two) / x.dt * 1e-3
    speeds[0, 0], speeds[1, 0] = unit, -unit / 2
    first, second = cn.Material("first", density=1000.0), cn.Material("second", density=1000.0 * x.ratio)
    scene.add(balls(dim)(places[:1], one, first, velocity=speeds[0]), balls(dim)(places[1:], two, second, velocity=speeds[1]))
    watched = Watched(scene, x, cn.Restitution(mu=x.mu, normal=0.5))
    before = watched.sim.bodies.velocity[:, 0]
    sim = watched.run(1)
    mass = sim.bodies.mass
    share = mass / mass.max()
    centre = share @ before / share.sum()
    after = sim.bodies.velocity[:, 0]
    return watched.usual() + [
        near("speeds", after / unit, (centre + 0.5 * (centre - before)) / unit, 1e-12, scale=1.0),
        near("momentum", share @ (after - before) / unit, 0.0, 1e-12, scale=1.0),
    ]


def coincident(dim, x):
    """Balls at one and the same place: which way they part is not given, but they part along one unit normal, or not at all, with
    their momentum."""
    scene, up, place = frame(dim, x)
    rock = cn.Material("rock", density=1000.0)
    scene.add(balls(dim)(np.tile(place + x.size * up, (x.count, 1)), x.size, rock), cn.wall(place, up, rock))
    watched = Watched(scene, x, cn.Coulomb(mu=x.mu))
    sim = watched.run(x.steps)
    pairs, wall = sim.contacts.bodies, x.count
    on_floor = np.any(pairs == wall, axis=1)
    weight = sim.bodies.mass[:wall].sum() * GRAVITY
    lengths = np.linalg.norm(sim.contacts.normal, axis=1)
    return watched.usual() + [
        near("normals", lengths, 1.0, 4 * EPSILON, scale=1.0),
        near("floor", np.sum(force_along(sim, up)[on_floor]) / weight, 1.0, 1e-8),
    ]


def for_ratio(x):
    """Default solver where masses differ: sweeps leave light bodies with rounding errors of heavy ones, and report it."""
    return cn.Auto(tol=x.tol, max_iter=x.max_iter) if x.ratio > 1000 else None


def stack(dim, x, n=5):
    """Guided balls: each reaction is the weight above it. `ratio`: of the top ball to the others."""
    scene, up, place = frame(dim, x)
    places = place + x.size * (1 + (2 - x.overlap) * np.arange(n)[:, None]) * up
    light, top = cn.Material("light", density=1000.0), cn.Material("top", density=1000.0 * x.ratio)
    fixed = ("vx", "w") if dim == 2 else ("vx", "vy", "wx", "wy", "wz")
    scene.add(balls(dim)(places[:-1], x.size, light, driven=fixed), balls(dim)(places[-1:], x.size, top, driven=fixed))
    scene.add(cn.wall(place, up, light))
    # a light ball under a heavy one: its velocity is a difference of impulses `ratio` times its own, rounded
    watched = Watched(scene, x, cn.Coulomb(mu=x.mu), closure=max(1e-12, 4 * EPSILON * x.ratio), solver=for_ratio(x))
    sim = watched.run(x.steps)
    weight = sim.bodies.mass[:n] * GRAVITY
    above = np.cumsum(weight[::-1])[::-1]
    force, pairs = np.abs(force_along(sim, up)), sim.contacts.bodies
    figures = watched.usual()
    for k in range(n):
        mine = np.flatnonzero(np.isin(pairs, [k]).any(1) & np.isin(pairs, [k - 1 if k else n]).any(1))
        figures.append(near(f"reaction {k}", force[mine] / above[k], 1.0, 1e-6))
    return figures


def pile(dim, x):
    """Grains that fall into a box: what walls give and gravity takes is the change of momentum; nobody leaves; no friction beyond
    the cone."""
    scene, up, place = frame(dim, x)
    rng = np.random.default_rng(7)
    rows = int(np.ceil(x.count ** (1 / dim)))
    spots = np.stack(np.meshgrid(*[np.arange(rows)] * dim, indexing="ij"), -1).reshape(-1, dim)[: x.count]
    small = x.size if x.other is None else x.other
    radii = x.size * (1 - 0.4 * rng.random(x.count))
    radii[::2] *= small / x.size
    density = np.where(np.arange(x.count) % 3 == 0, x.ratio, 1.0) * 1000.0
    centres = place + x.size * (2.05 * spots + 1.02)
    centres[spots[:, -1] == 0, -1] = place[-1] + radii[spots[:, -1] == 0]
    sets = [
        balls(dim)(centres[mine], radii[mine], cn.Material(f"grain {d:g}", density=d))
        for d in np.unique(density)
        for mine in [density == d]
    ]
    wall = cn.Material("wall")
    ids = scene.add(*sets)
    scene.add(*cn.box(place, place + 2.2 * x.size * rows, wall, lid=False))
    statuses = ("converged", "iteration_limit") if x.limit_told else "converged"
    watched = Watched(scene, x, cn.Coulomb(mu=x.mu), status=statuses)
    sim = watched.run(x.steps - 1)
    mass = sim.bodies.mass[ids]
    before = mass @ sim.bodies.velocity[ids, :dim]
    sim = watched.run(1)
    pairs, impulse = sim.contacts.bodies, sim.contacts.impulse
    walls = np.sum(
        np.where((pairs[:, 1] >= len(ids))[:, None], impulse, 0) - np.where((pairs[:, 0] >= len(ids))[:, None], impulse, 0), 0
    )
    change = mass @ sim.bodies.velocity[ids, :dim] - before
    size = np.abs(change).sum() + np.abs(impulse).sum() + mass.sum() * GRAVITY * sim.dt
    local = sim.contacts.impulse_local
    slip = np.linalg.norm(local[:, 1:], axis=1) - min(x.mu, 1e300) * np.maximum(local[:, 0], 0)
    lowest = np.min((sim.bodies.position[ids] - place)[:, :-1]) / x.size
    scale = max(np.abs(local).max(), 1e-300)
    figures = watched.usual()
    if x.limit_told:
        told = "/".join(sorted(watched.seen))
        figures.append(near(f"residual in units of tol, status {told}:", watched.residual / x.tol, 0.0, 100.0, scale=1.0))
    return figures + [
        near("momentum", (change - walls + mass.sum() * GRAVITY * sim.dt * up) / size, 0.0, 1e-11, scale=1.0),
        near("outside the cone", max(0.0, slip.max(initial=0.0)) / scale, 0.0, 1e-8, scale=1.0),
        near("pulls", max(0.0, -local[:, 0].min(initial=0.0)) / scale, 0.0, 1e-8, scale=1.0),
        near("behind a wall", max(0.0, -lowest), 0.0, 1e-6, scale=1.0),
    ]


def sphere_in_tube(dim, x):
    """At rest at the bottom of a level tube."""
    scene, up, place = frame(3, x)
    rock = cn.Material("rock", density=1000.0)
    scene.add(cn.spheres([place - (3 + x.overlap) * x.size * up], x.size, rock), cn.tube(place, (0, 1, 0), 4 * x.size, rock))
    watched = Watched(scene, x, cn.Coulomb(mu=x.mu))
    start = watched.sim.bodies.position[0]
    sim = watched.run(x.steps)
    return watched.usual() + [
        near("reaction", force_along(sim, up)[0] / (sim.bodies.mass[0] * GRAVITY), 1.0, 1e-9),
        near("moved", (sim.bodies.position[0] - start) / x.size, 0.0, 1e-12 + ulps(x), scale=1.0),
    ]


def disk_on_segment(dim, x):
    """At rest on a bar, and on the round corner at its end."""
    scene, up, place = frame(2, x)
    rock = cn.Material("rock", density=1000.0)
    ends = place + x.size * np.array([[-4.0, -0.5], [4.0, -0.5]])
    lift = (1 - x.overlap) * x.size * up
    scene.add(cn.disks([place + lift, place + lift + 4 * x.size * np.array([1.0, 0])], x.size, rock, driven=("vx", "w")))
    scene.add(cn.segment(*ends, rock, radius=0.5 * x.size))
    watched = Watched(scene, x, cn.Coulomb(mu=x.mu))
    sim = watched.run(x.steps)
    pairs = sim.contacts.bodies
    order = np.argsort(np.where(np.any(pairs == 2, axis=1), pairs.min(axis=1), 3))[:2]
    return watched.usual() + [
        near("reactions", force_along(sim, up)[order] / (sim.bodies.mass[:2] * GRAVITY), 1.0, 1e-9),
        near("speeds", sim.bodies.velocity[:2, 1] / (GRAVITY * sim.dt), 0.0, 1e-9 + ulps(x) * x.size / sim.dt**2, scale=1.0),
    ]


def matrix_of(q):
    """Rotation matrix of a unit quaternion, body to space."""
    axis = np.array([[0, -q[3], q[2]], [q[3], 0, -q[1]], [-q[2], q[1], 0]])
    return np.eye(3) + 2 * q[0] * axis + 2 * axis @ axis


def top(dim, x):
    """A free clump, `ratio` of its least to its greatest moment: angular momentum and energy stay."""
    scene = cn.Scene(3, origin=np.full(3, x.shift) if x.origin else None)
    rock = cn.Material("rock", density=1000.0)
    moments = np.array([x.ratio, 1.0, 1.0 + 0.5 * x.ratio]) * x.size**5 * 1000
    unit = np.sqrt(GRAVITY / x.size)
    spin = unit * np.array([0.3, 1.0, 0.2])
    scene.add(
        cn.clumps(
            [np.full(3, x.shift)],
            x.size * np.array([[1.0, 0, 0], [-1.0, 0, 0]]),
            x.size * np.ones(2),
            1000 * x.size**3,
            moments,
            rock,
            velocity=np.r_[0, 0, 0, spin],
        )
    )
    watched = Watched(scene, x, cn.Coulomb(mu=x.mu))
    core = watched.sim._core.scene
    start = core.body("angular_momentum")[0]
    sim = watched.run(x.steps)
    energy = float(np.sum(moments * spin**2) / 2)
    momentum = core.body("angular_momentum")[0]
    in_body = matrix_of(sim.bodies.rotation[0]).T @ momentum
    return watched.usual() + [
        near("angular momentum", momentum / np.linalg.norm(start), start / np.linalg.norm(start), 1e-14, 1),
        # what the rule of motion keeps: momentum and rotation are its state
        near("energy of the motion", np.sum(in_body**2 / moments) / 2 / energy, 1.0, 1e-12),
        # the step reports the spin by the inverse inertia in space axes, whose entries grow with 1/least moment
        near("energy told", sim.energy["kinetic"] / energy, 1.0, max(1e-12, EPSILON / x.ratio)),
        near("unit quaternion", np.linalg.norm(sim.bodies.rotation[0]), 1.0, 1e-13),
    ]


def pushing_wall(dim, x):
    """A wall that moves into a ball gives it its own speed; the reaction of the drive is the ball's momentum."""
    scene, up, place = frame(dim, x)
    scene.gravity = np.zeros(dim)
    rock = cn.Material("rock", density=1000.0)
    speed = 0.1 * x.size / x.dt
    along = np.eye(dim)[0]
    scene.add(
        balls(dim)([place + (1 - x.overlap) * x.size * along], x.size, rock), cn.wall(place, along, rock, velocity=speed * along)
    )
    watched = Watched(scene, x, cn.Coulomb(mu=x.mu))
    sim = watched.run(1)
    impulse = sim.contacts.impulse @ along
    first = near("impulse", impulse[0] / (sim.bodies.mass[0] * speed), 1.0, 1e-12)
    sim = watched.run(x.steps - 1)
    return watched.usual() + [first, near("speed", sim.bodies.velocity[0, :dim] / speed, along, 1e-11 + ulps(x) * 10, scale=1.0)]


def drum(dim, x):
    """A tube that turns carries a sphere at its bottom: after a step the two do not slip, unless mu g h is too little."""
    scene, up, place = frame(3, x)
    rock = cn.Material("rock", density=1000.0)
    spin = 0.01 * GRAVITY * x.dt / (4 * x.size)
    scene.add(
        cn.spheres([place - (3 + x.overlap) * x.size * up], x.size, rock),
        cn.tube(place, (0, 1, 0), 4 * x.size, rock, velocity=(0, 0, 0, 0, spin, 0)),
    )
    watched = Watched(scene, x, cn.Coulomb(mu=x.mu))
    sim = watched.run(1)
    slip = np.linalg.norm(sim.contacts.relative_velocity[0, 1:])  # (n, t, s)
    wall_speed = spin * 4 * x.size
    return watched.usual() + [
        near("slip", slip / wall_speed, 1.0 if x.mu == 0 else 0.0, 1e-8, scale=1.0),
        near("reaction", force_along(sim, up)[0] / (sim.bodies.mass[0] * GRAVITY), 1.0, 1e-9),
    ]


def lid(dim, x, n=9):
    """A lid of mass `ratio` times a ball, pressed on n balls by a force of n weights: sums of reactions above and below."""
    scene, up, place = frame(dim, x)
    rock = cn.Material("rock", density=1000.0)
    along = np.eye(dim)[0]
    scene.add(balls(dim)(place + x.size * up + 2.5 * x.size * np.arange(n)[:, None] * along, x.size, rock))
    mass = scene.sets[0].mass[0]
    load = n * mass * GRAVITY
    scene.add(cn.wall(place, up, rock))
    scene.add(cn.wall(place + 2 * x.size * up, -up, rock, mass=mass * x.ratio, free="vy" if dim == 2 else "vz", force=-load * up))
    watched = Watched(scene, x, cn.Coulomb(mu=x.mu), closure=max(1e-12, 4 * EPSILON * x.ratio), solver=for_ratio(x))
    sim = watched.run(x.steps)
    pairs = sim.contacts.bodies
    below, above = np.any(pairs == n, axis=1), np.any(pairs == n + 1, axis=1)
    force = np.abs(force_along(sim, up))
    pressed = load + mass * x.ratio * GRAVITY
    return watched.usual() + [
        near("above", force[above].sum() / pressed, 1.0, 1e-6),
        near("below", force[below].sum() / (pressed + n * mass * GRAVITY), 1.0, 1e-6),
    ]


def periodic_cell(dim, x):
    """Two balls that meet through the boundary of the cell."""
    lengths = np.full(dim, 16 * x.size)
    place = np.full(dim, x.shift)
    scene = cn.Scene(
        dim, periodic=cn.Periodic(tuple(lengths), tuple(place - (place if x.origin else 0))), origin=place if x.origin else None
    )
    places, speeds = np.tile(place + 8 * x.size, (2, 1)), np.zeros((2, dim))
    places[0, 0], places[1, 0] = place[0] + x.size * (1 - x.overlap), place[0] + 15 * x.size
    unit = 1e-3 * x.size / x.dt
    speeds[0, 0], speeds[1, 0] = -unit, unit / 2
    first, second = cn.Material("first", density=1000.0), cn.Material("second", density=1000.0 * x.ratio)
    scene.add(
        balls(dim)(places[:1], x.size, first, velocity=speeds[0]), balls(dim)(places[1:], x.size, second, velocity=speeds[1])
    )
    watched = Watched(scene, x, cn.Restitution(mu=x.mu, normal=0.5))
    before = watched.sim.bodies.velocity[:, 0]
    sim = watched.run(1)
    share = sim.bodies.mass / sim.bodies.mass.max()
    centre = share @ before / share.sum()
    return watched.usual() + [
        near("speeds", sim.bodies.velocity[:, 0] / unit, (centre + 0.5 * (centre - before)) / unit, 1e-12, scale=1.0)
    ]


def turning_bond(watched, x, moment, start, length, touching):
    """Speed along the bond and spin at the last of x.steps, by mechanics alone.

    Between steps the pair flies freely, so that its angular momentum about its centre of mass stays; at a step the bond leaves no
    sliding and no rolling, so that both turn with w = L / (m d^2 + I1 + I2), m the reduced mass, d the distance. It takes back
    what the distance at detection is off its length, and beforehand what flying on along the chord would lengthen it by, at the
    speed across that the step begins with: u = -(d - length)/h - (D - sqrt(D^2 - (h u_t)^2))/h. D is d or, if they are apart, the
    distance of centres that touch. start: distance and velocity of the second body from the first, along and across [m, m/s].
    """
    h, mass = watched.sim.dt, watched.sim.bodies.mass
    reduced = mass.min() / (1 + mass.min() / mass.max())
    angular = reduced * start[0] * start[2]
    way, speed = np.array([start[0] + h / 2 * start[1], h / 2 * start[2]]), np.array(start[1:])
    for _ in range(x.steps):
        away = np.hypot(*way)
        normal = way / away
        begin = abs(normal[0] * speed[1] - normal[1] * speed[0])
        distance = min(away, touching)
        turn = min(1.0, (h * begin / distance) ** 2)
        u = -(away - length) / h - distance * turn / (h * (1 + np.sqrt(1 - turn)))
        spin = angular / (reduced * away**2 + moment)
        speed = np.array([u, spin * away])  # in the axes of this contact, which the next ones turn from
        way = np.array([away, 0.0]) + h * speed
    return u, spin


def bonded_pair(dim, x):
    """Two balls held fast, thrown apart: they turn as one body, momentum and angular momentum stay."""
    scene, up, place = frame(dim, x)
    scene.gravity = np.zeros(dim)
    first, second = cn.Material("first", density=1000.0), cn.Material("second", density=1000.0 * x.ratio)
    along = np.eye(dim)[0]
    unit = 0.01 * x.size / x.dt
    two = x.size if x.other is None else x.other
    length = x.size + two - x.overlap * min(x.size, two)
    far = place + length * along
    scene.add(
        balls(dim)([place], x.size, first, velocity=-unit * along), balls(dim)([far], two, second, velocity=unit * (along + up))
    )
    watched = Watched(scene, x, cn.Bonded(mu=x.mu))
    mass = watched.sim.bodies.mass
    share = mass / mass.max()
    before = share @ watched.sim.bodies.velocity[:, :dim]
    moment = (0.5 if dim == 2 else 0.4) * (mass @ np.square([x.size, two]))
    sim = watched.run(x.steps)
    speed, spin = turning_bond(watched, x, moment, (length, 2 * unit, unit), length, x.size + two)
    spins = sim.bodies.velocity[:2, dim:]
    wanted = np.array([spin]) if dim == 2 else np.array([0, -spin, 0])  # across is y in 2D, z in 3D
    u = sim.contacts.relative_velocity[0]  # (n, t[, s])
    gate = 1e-8 + ulps(x) * 100  # places of step 0.01 size: a rounding of the place is 100 of the speed
    return watched.usual() + [
        near("momentum", (share @ sim.bodies.velocity[:, :dim] - before) / unit, 0.0, 1e-12, scale=1.0),
        near("speed along the bond", u[0] / unit, speed / unit, gate, scale=1.0),
        near("slip", u[1:] / unit, 0.0, gate, scale=1.0),
        near("spin", spins * length / unit, np.tile(wanted, (2, 1)) * length / unit, gate, scale=1.0),
    ]


def crushed(dim, x):
    """A wall driven against another, a ball between: no motion obeys both, and the status must say so."""
    scene, up, place = frame(dim, x)
    rock = cn.Material("rock", density=1000.0)
    scene.add(balls(dim)([place + x.size * up], x.size, rock), cn.wall(place, up, rock))
    scene.add(cn.wall(place + 2 * x.size * up, -up, rock, velocity=-1e-3 * x.size / x.dt * up))
    watched = Watched(scene, x, cn.Coulomb(mu=x.mu), status="iteration_limit")
    watched.run(x.steps)
    return watched.usual()[:1]


def blocked(dim, x):
    """A body none of whose dofs is free along the normal, driven into the floor: no impulse could act, none does."""
    scene, up, place = frame(dim, x)
    rock = cn.Material("rock", density=1000.0)
    held = ("vy", "w") if dim == 2 else ("vz", "wx", "wy", "wz")
    drive = -1e-3 * x.size / x.dt * np.append(up, np.zeros(1 if dim == 2 else 3))
    scene.add(balls(dim)([place + x.size * up], x.size, rock, driven=held, drive=drive, velocity=drive), cn.wall(place, up, rock))
    watched = Watched(scene, x, cn.Coulomb(mu=x.mu))
    sim = watched.run(x.steps)
    return watched.usual() + [
        near("impulse", sim.contacts.impulse, 0.0, 0.0, scale=1.0),
        near("sunk", sim.bodies.position[0, -1] - place[-1] - x.size, -1e-3 * x.steps * x.size, 1e-9),
    ]


def guided_drag(dim, x):
    """A ball pressed on the floor by its weight and driven along it: friction mu m g against the drive, which does the work."""
    scene, up, place = frame(dim, x)
    rock = cn.Material("rock", density=1000.0)
    held = ("vx", "w") if dim == 2 else ("vx", "vy", "wx", "wy", "wz")
    drive = 0.01 * x.size / x.dt * np.eye(dim)[0]
    scene.add(balls(dim)([place + x.size * up], x.size, rock, driven=held, drive=drive), cn.wall(place, up, rock))
    watched = Watched(scene, x, cn.Coulomb(mu=x.mu))
    sim = watched.run(x.steps)
    weight = sim.bodies.mass[0] * GRAVITY
    return watched.usual() + [
        near("reaction", sim.contacts.force[0, -1] / weight, 1.0, 1e-8),
        near("friction", sim.contacts.force[0, 0] / weight, -x.mu, 1e-7, scale=max(1.0, x.mu)),
    ]


def no_contact(dim, x):
    """count balls far from each other fall freely."""
    scene, up, place = frame(dim, x)
    rock = cn.Material("rock", density=1000.0)
    if x.count:
        scene.add(balls(dim)(place + 10 * x.size * np.arange(x.count)[:, None] * np.eye(dim)[0], x.size, rock))
    watched = Watched(scene, x, cn.Coulomb(mu=x.mu))
    sim = watched.run(x.steps)
    fall = GRAVITY * sim.time
    if not x.count:
        return watched.usual() + [near("steps", sim.steps, x.steps, 0.0)]
    return watched.usual() + [
        near("speeds", sim.bodies.velocity[:, dim - 1] / fall, -1.0, 1e-12),
        near("impulses", np.append(sim.contacts.impulse, 0.0), 0.0, 0.0, scale=1.0),
    ]
