"""Results do not depend on the units, the place, the direction or the numbering of a scene.

To the bit when mass, length or time are counted in units 2^k times as large; to 1e-9 over one step when the scene is shifted,
turned or its bodies are added in another order.
"""

import itertools

import cairn as cn
import numpy as np
import pytest
from report import judge

GRAVITY = 9.81


def turned_about(dim, angle):
    """A rotation matrix: about z in 2D, about (1, 2, 3) in 3D (Rodrigues)."""
    if dim == 2:
        return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    x, y, z = np.array([1.0, 2.0, 3.0]) / np.sqrt(14)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def quaternion_of(angle):
    axis = np.array([1.0, 2.0, 3.0]) / np.sqrt(14)
    return np.r_[np.cos(angle / 2), np.sin(angle / 2) * axis]


class Heap:
    """Numbers of a scene of grains and clumps that fall between walls, and the scene they make in given units."""

    def __init__(self, dim, clumped=False, seed=7):
        rng = np.random.default_rng(seed)
        side = 7 if dim == 2 else 4
        grid = np.stack(np.meshgrid(*[np.arange(side)] * dim, indexing="ij"), -1).reshape(-1, dim)
        self.dim, self.n, self.clumped = dim, len(grid), clumped
        self.centers = 0.5 + grid + 0.01 * rng.standard_normal(grid.shape)
        self.radii = rng.uniform(0.45, 0.49, self.n)
        self.velocity = 0.5 * rng.standard_normal((self.n, 3 * dim - 3))
        self.size, self.order = side, np.arange(self.n)

    def scene(self, mass=1.0, length=1.0, time=1.0, shift=0.0, angle=0.0, origin=None):
        dim, turn = self.dim, turned_about(self.dim, angle) if angle else np.eye(self.dim)
        rock = cn.Material("rock", density=2000.0 * mass / length**dim)
        down = -np.eye(dim)[-1] * GRAVITY * length / time**2
        scene = cn.Scene(dim, gravity=turn @ down, origin=origin)
        o = self.order
        x = (self.centers[o] * length) @ turn.T + shift
        v = self.velocity[o] / time
        v[:, :dim] = v[:, :dim] * length @ turn.T
        if dim == 3 and angle:
            v[:, 3:] = v[:, 3:] @ turn.T
        if self.clumped:
            part = 0.4 * length
            turned = np.full(self.n, angle) if dim == 2 else np.tile(quaternion_of(angle), (self.n, 1))
            options = {"rotation": turned} if angle else {}
            offsets = np.zeros((2, dim))
            offsets[:, 0] = -0.25 * part, 0.5 * part
            m = 900.0 * mass
            inertia = 0.1 * m * length**2 if dim == 2 else np.array([0.05, 0.1, 0.11]) * m * length**2
            scene.add(cn.clumps(x, offsets, np.array([part, 0.6 * part]), m, inertia, rock, velocity=v, **options))
        else:
            scene.add((cn.disks if dim == 2 else cn.spheres)(x, self.radii[o] * length, rock, velocity=v))
        for axis, sign in itertools.product(range(dim), (1, -1)):
            normal = np.zeros(dim)
            normal[axis] = sign
            place = np.full(dim, 0.0 if sign > 0 else self.size * length)
            push = np.eye(dim)[0] * 0.3 * length / time if axis == 0 and sign > 0 else np.zeros(dim)
            scene.add(cn.wall(turn @ place + shift, turn @ normal, rock, velocity=turn @ push))
        scene.interact(rock, rock, cn.Coulomb(mu=0.4))
        return scene

    def run(self, steps, dt=8e-3, solver=None, **units):
        solver = solver or cn.NLGS(tol=1e-4, max_iter=200)
        sim = cn.Simulation(self.scene(**units), dt * units.get("time", 1.0), cn.NSCD(solver=solver, threads=1), overlap="ignore")
        for _ in range(steps):
            sim.step()
        return sim


def figures(sim, mass=1.0, length=1.0, time=1.0):
    """Everything a run says, in its own units."""
    dim, bodies, contacts = sim.scene.dim, sim.bodies, sim.contacts
    velocity = bodies.velocity * time
    velocity[:, :dim] /= length
    out = {
        "position": bodies.position / length,
        "velocity": velocity,
        "pairs": contacts.bodies,
        "gap": contacts.gap / length,
        "normal": contacts.normal,
        "impulse": contacts.impulse * time / (mass * length),
        "status": contacts.status,
        "numbers": [sim.info["iterations"], sim.info["error"], sim.info["worst_error"], sim.info["penetration"]],
        "energy": np.array(list(sim.energy.values())) * time**2 / (mass * length**2),
    }
    if "rotation" in bodies.names:
        out["rotation"] = bodies.rotation
    return out


SCENES = [(2, False), (3, False), (2, True), (3, True)]
SOLVERS = ["Auto", "PPANewton", "NewtonAlartCurnier", "ADMM", "InteriorPoint", "AndersonNLGS"]
UNITS = [("mass",), ("length",), ("time",), ("mass", "length", "time")]


@pytest.mark.parametrize("dim, clumped", SCENES)
def test_units_that_are_powers_of_two_change_no_bit(dim, clumped):
    heap, steps = Heap(dim, clumped), 40
    plain = heap.run(steps)
    reference = figures(plain)
    assert np.count_nonzero(reference["impulse"][:, 0]) > 20  # there is something to compare
    for names, exponent in itertools.product(UNITS, (-100, -3, 1, 60)):
        if len(names) == 3 and abs(exponent) > 60:
            exponent = -60
        units = dict(zip(names, 2.0 ** (exponent * np.array([1, -1, 1]))))
        found = figures(heap.run(steps, **units), **units)
        for name, value in reference.items():
            assert np.array_equal(value, found[name]), f"{name} differs in units {units}"


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("dim, clumped", [(2, False), (3, True)])
def test_units_change_no_bit_with_any_solver(dim, clumped, solver):
    """Factorising solvers as well: pivots of bodies are forces and moments, each in its own unit."""
    from cairn.options.solvers import SOLVERS as known

    heap, names = Heap(dim, clumped), ("position", "velocity", "gap", "impulse")
    reference = figures(heap.run(6, solver=known[solver](tol=1e-6)))
    for unit, exponent in itertools.product(UNITS, (-60, 30)):
        units = dict(zip(unit, 2.0 ** (exponent * np.array([1, -1, 1]))))
        found = figures(heap.run(6, solver=known[solver](tol=1e-6), **units), **units)
        for name in names:
            assert np.array_equal(reference[name], found[name]), f"{name} differs in units {units}"


@pytest.mark.parametrize("dim, clumped", SCENES)
def test_a_unit_that_is_no_power_of_two_does_change_bits(dim, clumped):
    """So the comparison above can fail."""
    heap = Heap(dim, clumped)
    a, b = figures(heap.run(5)), figures(heap.run(5, length=3.0), length=3.0)
    assert not np.array_equal(a["position"], b["position"])
    judge("position", b["position"], a["position"], 1e-6)


def one_step(heap, **options):
    """Positions and velocities after one step solved to 1e-13, by body in the order of `heap.centers`."""
    sim = heap.run(1, dt=5e-2, solver=cn.NLGS(tol=1e-13, max_iter=100000), **options)
    assert sim.info["status"] == "converged"
    assert np.count_nonzero(sim.contacts.impulse[:, 0]) > 10
    place = np.empty(heap.n, int)
    place[heap.order] = np.arange(heap.n)
    x, v = sim.bodies.position[: heap.n][place], sim.bodies.velocity[: heap.n][place]
    return x, v


@pytest.mark.parametrize("dim, clumped", SCENES)
def test_shift(dim, clumped):
    heap = Heap(dim, clumped)
    x, v = one_step(heap)
    shift = np.array([1e3, -2e3, 5e2])[:dim]
    xs, vs = one_step(heap, shift=shift)
    judge("position", xs - shift, x, 1e-9)
    judge("velocity", vs, v, 1e-9)


@pytest.mark.parametrize("dim, clumped", SCENES)
def test_turn(dim, clumped):
    heap, angle = Heap(dim, clumped), 0.7
    x, v = one_step(heap)
    xt, vt = one_step(heap, angle=angle)
    turn = turned_about(dim, angle)
    judge("position", xt, x @ turn.T, 1e-9)
    judge("velocity", vt[:, :dim], v[:, :dim] @ turn.T, 1e-9, scale=np.abs(v).max())
    spin = v[:, 2] if dim == 2 else v[:, 3:] @ turn.T
    judge("spin", vt[:, 2] if dim == 2 else vt[:, 3:], spin, 1e-9, scale=np.abs(v).max())


@pytest.mark.parametrize("dim, clumped", SCENES)
def test_order_of_insertion(dim, clumped):
    heap = Heap(dim, clumped)
    x, v = one_step(heap)
    heap.order = np.random.default_rng(3).permutation(heap.n)
    xp, vp = one_step(heap)
    judge("position", xp, x, 1e-9)
    judge("velocity", vp, v, 1e-9)


@pytest.mark.parametrize("dim, clumped", SCENES)
def test_a_scene_a_billion_metres_away_keeps_its_digits(dim, clumped):
    """Through scene.origin; the inputs are numbers that doubles hold there: multiples of 2^-20."""
    heap, far = Heap(dim, clumped), np.array([1e9, -1e9, 5e8])[:dim]
    heap.centers = np.round(heap.centers * 2**20) / 2**20
    near = heap.run(40)
    away = heap.run(40, shift=far, origin=far)
    for name in ("velocity", "mass"):
        assert np.array_equal(getattr(near.bodies, name), getattr(away.bodies, name)), name
    for name in ("gap", "normal", "impulse", "status", "bodies"):
        assert np.array_equal(getattr(near.contacts, name), getattr(away.contacts, name)), name
    assert near.energy == away.energy
    assert np.array_equal(near._core.scene.body("position"), away._core.scene.body("position"))
    judge("position", away.bodies.position - far, near.bodies.position, 2.0**-22, scale=1.0)
