"""Features of scenes and simulations, each against a closed form or an identity."""

import cairn as cn
import numpy as np
import pytest
from small_scenes import ROCK, SAND, differing, grid, heap, state

EXACT = cn.NLGS(tol=1e-12, max_iter=2000)
G = 9.81


def simulate(scene, dt, **options):
    options.setdefault("solver", EXACT)
    return cn.Simulation(scene, dt, cn.NSCD(**options), overlap="ignore")


def advance(sim, steps):
    for _ in range(steps):
        sim.step()
    return sim


def close(figure, reference, gate, scale=None):
    scale = np.max(np.abs(reference)) if scale is None else scale
    error = np.max(np.abs(np.asarray(figure) - reference)) / scale
    assert error <= gate, f"{figure} instead of {reference}: error {error:.3g}, gate {gate:g}"


def closes(sim, gate=1e-12):
    """The balance of energy, and the kinetic energy anew from the velocities."""
    e, b = sim.energy, sim.bodies
    assert abs(e["closure"]) <= gate * e["in_play"], f"closure {e['closure']:.3g} of {e['in_play']:.3g} J"
    free = np.isfinite(b.mass)
    v, dim = b.velocity[free], sim.scene.dim
    kinetic = np.sum(b.mass[free] * np.sum(v[:, :dim] ** 2, 1)) / 2
    if dim == 2:
        kinetic += np.sum(b.inertia[free] * v[:, 2] ** 2) / 2
    elif "angular_momentum" not in b.names:
        kinetic += np.sum(b.inertia[free] * v[:, 3:] ** 2) / 2
    return kinetic


# ---------------------------------------------------------------------- laws


@pytest.mark.parametrize("dim", [2, 3])
def test_bonded_bodies_move_as_one(dim):
    """Two bonded grains, one of them pushed: the pair turns with L / I of the pair; grains in mere contact would not."""
    scene = cn.Scene(dim)
    x = np.zeros((2, dim))
    x[1, 0] = 0.5
    shape = cn.disks if dim == 2 else cn.spheres
    scene.add(shape(x, 0.25, ROCK, velocity=np.eye(dim)[[1, 1]] * [[0.0], [1.0]]))
    scene.interact(ROCK, ROCK, cn.Bonded())
    sim = simulate(scene, 1e-3)
    sim.step()
    spin = sim.bodies.velocity[:, -1]
    close(spin, [1 / (3 * 0.25)] * 2 if dim == 2 else [1 / (2.8 * 0.25)] * 2, 1e-5)
    advance(sim, 500)
    turned = sim.bodies.velocity[:, -1]
    close(turned, spin, 1e-5)
    close(np.linalg.norm(sim.bodies.position[1] - sim.bodies.position[0]), 0.5, 1e-6)
    assert sim.contacts.status[0] == 3
    closes(sim)


@pytest.mark.parametrize("dim", [2, 3])
def test_chain_of_bonds_is_a_cantilever(dim):
    """The chain carries its weight by the moment at its root, without creep."""
    n, radius = 6, 0.1
    scene = cn.Scene(dim, gravity=-G * np.eye(dim)[-1])
    x = np.zeros((n, dim))
    x[:, 0] = 2 * radius * np.arange(n)
    shape, names = (cn.disks, ("vx", "vy", "w")) if dim == 2 else (cn.spheres, ("vx", "vy", "vz", "wx", "wy", "wz"))
    scene.add(shape(x[:1], radius, ROCK, driven=names), shape(x[1:], radius, ROCK))
    scene.interact(ROCK, ROCK, cn.Bonded())
    sim = simulate(scene, 1e-3, solver=cn.NLGS(tol=1e-9, max_iter=4000))
    advance(sim, 60)
    assert sim.info["status"] == "converged"
    close(sim.bodies.position, x, 1e-7)
    weight = sim.bodies.mass[1:] * G
    root = np.flatnonzero((np.sort(sim.contacts.bodies, 1) == (0, 1)).all(1))[0]
    side = 1 if sim.contacts.bodies[root, 0] == 1 else -1  # the force on body 1
    close(side * sim.contacts.force[root, -1], weight.sum(), 1e-6)
    moment = np.sum(weight * (x[1:, 0] - radius))  # about the root
    found = np.atleast_1d(sim.contacts.moment[root])[-1 if dim == 2 else 1] / sim.dt
    close(side * found, moment if dim == 2 else -moment, 1e-6)


def test_bonds_survive_the_crossing_of_a_periodic_cell():
    scene = cn.Scene(2, periodic=cn.Periodic((2.0, 2.0)))
    scene.add(cn.disks([[0.5 + 0.4 * k, 1.0] for k in range(3)], 0.2, ROCK, velocity=(3.0, 1.1, 0.0)))
    scene.add(cn.disks([[0.9, 1.4]], 0.2, ROCK, velocity=(3.0, 1.1, 0.5)))
    scene.interact(ROCK, ROCK, cn.Bonded())
    sim = simulate(scene, 1e-2, solver=cn.NLGS(tol=1e-9))
    advance(sim, 300)
    assert np.count_nonzero(sim.contacts.status == 3) == 3
    spins = sim.bodies.velocity[:, 2]
    close(spins, spins[0], 1e-8)
    assert np.all((sim.bodies.position >= 0) & (sim.bodies.position <= 2))
    closes(sim)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("tangential", [-1.0, 0.0, 0.5, 1.0])
def test_tangential_restitution(dim, tangential):
    """u_n+ = -e u_n-, u_t+ = -e_t u_t- where friction can do it."""
    scene = cn.Scene(dim)
    place, velocity = np.zeros(dim), np.zeros(3 * dim - 3)
    place[-1], velocity[0], velocity[dim - 1] = 0.25, 0.3, -2.0
    scene.add((cn.disks if dim == 2 else cn.spheres)([place], 0.25, ROCK, velocity=velocity))
    scene.add(cn.wall(np.zeros(dim), np.eye(dim)[-1], ROCK))
    scene.interact(ROCK, ROCK, cn.Restitution(mu=5.0, normal=0.5, tangential=tangential))
    sim = simulate(scene, 2.0**-40)
    sim.step()
    v = sim.bodies.velocity[0]
    slip = v[0] + 0.25 * v[2] if dim == 2 else v[0] - 0.25 * v[4]
    close(v[dim - 1], 1.0, 1e-9)
    close(slip, -tangential * 0.3, 1e-9, scale=0.3)


def test_laws_by_group_material_and_default():
    """Groups before materials before the default, both orders of a pair, later rules before earlier ones; None: no contact."""
    scene = cn.Scene(2)
    names = ["a", "b", None, None]
    for k, group in enumerate(names):
        material = SAND if k == 3 else ROCK
        scene.add(cn.disks([[3.0 * k, 0.5]], 0.5, material, group=group, velocity=(0, -1.0)))
    scene.add(cn.wall((0, 0), (0, 1), ROCK, group="floor"))
    scene.interact("*", "*", cn.Restitution(normal=0.1))
    scene.interact(ROCK, ROCK, cn.Restitution(normal=0.2))
    scene.interact("floor", "a", cn.Restitution(normal=0.9))
    scene.interact("a", "floor", cn.Restitution(normal=0.3))
    scene.interact("b", "rock", None)
    sim = simulate(scene, 1e-3)
    sim.step()
    close(sim.bodies.velocity[:4, 1], [0.3, -1.0, 0.2, 0.1], 1e-9)


# ---------------------------------------------------------------------- what moves walls and grains


DRIVES = {
    "number": ((0.5, 0.0, 0.0), lambda t: t / 2),
    "function": (lambda t: (2 * t, 0.0), lambda t: t**2),
    "table": (
        cn.Table([0.0, 0.25, 0.5], [[0, 0], [1, 0], [0, 0]]),
        lambda t: 2 * t**2 if t < 0.25 else 0.25 - 2 * (0.5 - t) ** 2,
    ),
}


@pytest.mark.parametrize("name", DRIVES)
@pytest.mark.parametrize("dim", [2, 3])
def test_driven_wall_is_where_it_should_be(name, dim):
    drive, place = DRIVES[name]
    if dim == 3:
        old = drive
        if name == "number":
            drive = (0.5, 0.0, 0.0)
        elif name == "table":
            drive = cn.Table(old.times, np.pad(old.values, ((0, 0), (0, 1))))
        else:
            drive = lambda t: (2 * t, 0.0, 0.0)
    scene = cn.Scene(dim)
    scene.add(cn.wall(np.zeros(dim), np.eye(dim)[0], ROCK, velocity=drive))
    sim = simulate(scene, 1 / 64)
    for _ in range(28):
        sim.step()
        close(sim.bodies.position[0, 0], place(sim.time), 1e-13, scale=1.0)


def test_harmonic_wall():
    """Velocity a cos(w t): place a sin(w t) / w, to O(dt^2)."""
    errors = []
    for dt in (2e-3, 1e-3):
        scene = cn.Scene(2)
        scene.add(cn.wall((0, 0), (0, 1), ROCK, velocity=cn.Harmonic((0.0, 0.3), 2.0)))
        sim = advance(simulate(scene, dt), round(0.4 / dt))
        w = 4 * np.pi
        errors.append(abs(sim.bodies.position[0, 1] - 0.3 * np.sin(w * sim.time) / w))
    assert errors[1] < 1e-5
    assert 3.9 < errors[0] / errors[1] < 4.1


def test_wall_pushes_what_touches_it():
    """A driven wall does the work that the grain before it gains."""
    scene = cn.Scene(2)
    scene.add(cn.disks([[0.25, 0.0]], 0.25, ROCK), cn.wall((0, 0), (1, 0), ROCK, velocity=lambda t: (3 * t, 0.0)))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.0))
    sim = advance(simulate(scene, 1e-2), 50)
    kinetic = closes(sim)
    close(sim.bodies.velocity[0, 0], 3 * 0.5, 1e-9)
    close(sim.energy["work_driven"], kinetic, 1e-9)


def test_force_as_number_and_function():
    scene = cn.Scene(2)
    m = 2.0
    scene.add(cn.clumps([[0, 0]], [[0.0, 0.0]], [0.1], m, 1.0, ROCK, force=(3.0, 0.0, 0.5), group="constant"))
    scene.add(cn.clumps([[9, 0]], [[0.0, 0.0]], [0.1], m, 1.0, ROCK, force=lambda t: (6 * t, 0.0, -2 * t)))
    scene.add(cn.clumps([[19, 0]], [[0.0, 0.0]], [0.1], m, 1.0, ROCK, force=cn.Table([0, 1], [[0, 0, 0], [6, 0, -2]])))
    sim = advance(simulate(scene, 1e-2), 100)
    close(sim.bodies.velocity, [[1.5, 0, 0.5], [1.5, 0, -1.0], [1.5, 0, -1.0]], 1e-12)
    kinetic = closes(sim)
    close(sim.energy["work_external"], kinetic, 1e-12)


def test_gravity_as_a_function_of_time():
    scene = cn.Scene(2, gravity=lambda t: (0.0, -2 * t))
    scene.add(cn.disks([[0, 0]], 0.1, ROCK))
    sim = advance(simulate(scene, 1e-2), 100)
    close(sim.bodies.velocity[0], [0, -1.0, 0], 1e-12)


@pytest.mark.parametrize("theta", [0.5, 0.75, 1.0])
def test_damping_decays_exponentially(theta):
    c, errors = 2.0, []
    for dt in (0.02, 0.01):
        scene = cn.Scene(2)
        scene.add(cn.disks([[0, 0]], 0.1, ROCK, velocity=(1.0, -2.0, 3.0), damping=c))
        sim = advance(simulate(scene, dt, theta=theta), round(1 / dt))
        factor = ((1 - (1 - theta) * dt * c) / (1 + theta * dt * c)) ** round(1 / dt)
        close(sim.bodies.velocity[0], factor * np.array([1.0, -2.0, 3.0]), 1e-13)
        errors.append(abs(sim.bodies.velocity[0, 0] - np.exp(-c)))
        closes(sim)
    order = np.log2(errors[0] / errors[1])
    assert abs(order - (2 if theta == 0.5 else 1)) < 0.1


@pytest.mark.parametrize("area", [None, lambda sim: 4.0])
def test_servo_wall_reaches_its_stress(area):
    """A lid of 4 m over grains, without gravity: its contacts carry the stress that was asked for."""
    scene = cn.Scene(2)
    scene.add(cn.disks(grid(2, (4, 5)), 0.47, ROCK))
    walls = cn.box((0, 0), (4, 5), ROCK, lid=False)
    servo = cn.Servo(2e4, (0, -1), area)
    lid = cn.wall((2, 5), (0, -1), ROCK, mass=2000.0, free="vy", force=servo)
    scene.add(walls, lid)
    scene.interact("*", "*", cn.Coulomb(mu=0.2))
    sim = simulate(scene, 5e-3, solver=cn.NLGS(tol=1e-6, max_iter=1000))
    advance(sim, 400)
    ids = sim.bodies.id[-1]
    on = (sim.contacts.bodies == ids).any(1)
    sign = np.where(sim.contacts.bodies[on, 0] == ids, 1, -1)
    wanted = 4.0 if area is not None else servo.extent(sim)
    assert 3.5 < wanted < 4.1
    assert abs(sim.bodies.velocity[-1, 1]) < 1e-5
    close(np.sum(sign * sim.contacts.force[on, 1]) / wanted, 2e4, 1e-3)


# ---------------------------------------------------------------------- changes between steps


def test_bodies_come_and_go():
    sim = simulate(heap(2), 4e-3, solver=cn.NLGS(tol=1e-6))
    advance(sim, 10)
    ids, x = sim.bodies.id, sim.bodies.position
    new = sim.add(cn.disks([[2.0, 8.0], [4.0, 8.0]], 0.3, ROCK), cn.disks([[6.0, 8.0]], 0.3, cn.Material("new", density=1.0)))
    assert list(new) == [51, 52, 53]
    assert np.array_equal(sim.bodies.position[: len(ids)], x)
    sim.remove([0, 7, 52])
    assert len(sim.contacts) == 0
    left = np.setdiff1d(np.r_[ids, new], [0, 7, 52])
    assert np.array_equal(sim.bodies.id, left)
    assert np.array_equal(sim.bodies.position[:-2], x[np.isin(ids, left)])
    advance(sim, 300)
    assert sim.info["status"] == "converged"
    assert not np.isin(sim.contacts.bodies, [0, 7, 52]).any()
    assert np.isin(51, sim.contacts.bodies)
    assert list(sim.add(cn.disks([[2.0, 9.0]], 0.3, ROCK))) == [54]  # ids are never used twice
    with pytest.raises(cn.Error, match="there is no body 7; it was never added, or was removed"):
        sim.remove([1, 7])
    assert 1 in sim.bodies.id


def test_step_may_change():
    """Free flight is exact for any sequence of steps; a rest stays at rest when the step jumps."""
    scene = cn.Scene(2, gravity=(0, -G))
    scene.add(cn.disks([[0, 10.0], [5.0, 0.25]], 0.25, ROCK, velocity=[[1.0, 2.0], [0, 0]]))
    scene.add(cn.wall((0, 0), (0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.5))
    sim = simulate(scene, 1e-2)
    rng = np.random.default_rng(1)
    for dt in rng.choice([1e-2, 1e-3, 1e-4, 3e-2], 50):
        sim.step(dt)
    t = sim.time
    close(sim.bodies.position[0], [t, 10 + 2 * t - G * t * t / 2], 1e-13)
    close(sim.bodies.position[1], [5.0, 0.25], 1e-13)
    sim.dt = 5e-3
    sim.step()
    assert sim.info["dt"] == 5e-3
    closes(sim)


def test_drive_from_now_on():
    scene = cn.Scene(2, gravity=(0, -1.0))
    scene.add(cn.disks([[0, 0], [5, 0], [9, 0]], 0.25, ROCK, driven="vy", drive=lambda t: (0, 3.0)))
    sim = advance(simulate(scene, 0.1), 5)
    close(sim.bodies.velocity[:, 1], [3.0] * 3, 0)
    sim.drive([1], ("vx", "vy"), (1.0, 0.0))
    sim.drive([2], (), None)
    advance(sim, 5)
    close(sim.bodies.velocity, [[0, 3, 0], [1, 0, 0], [0, 2.5, 0]], 1e-13)


# ---------------------------------------------------------------------- shapes and cells


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("theta", [0.5, 0.8])
def test_clumps_keep_momentum_and_close_their_energy(dim, theta):
    """Clumps that collide in free space: momentum, angular momentum (at theta = 1/2) and energy to 1e-12."""
    rng = np.random.default_rng(4)
    x = grid(dim, (3,) * dim, spacing=0.9)
    offsets = np.zeros((3, dim))
    offsets[:, 0], offsets[2, 1] = [-0.25, 0.25, 0.0], 0.2
    inertia = 0.1 if dim == 2 else [0.07, 0.11, 0.12]
    v = rng.standard_normal((len(x), 3 * dim - 3))
    v[:, :dim] -= 3 * (x - x.mean(0))
    scene = cn.Scene(dim)
    scene.add(cn.clumps(x, offsets, [0.2, 0.25, 0.15], 2.0, inertia, ROCK, velocity=v))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.6))
    sim = simulate(scene, 1e-2, theta=theta)

    def momenta():
        b = sim.bodies
        p = b.mass[:, None] * b.velocity[:, :dim]
        if dim == 2:
            spin = np.sum(b.inertia * b.velocity[:, 2])
            return np.r_[p.sum(0), spin + np.sum(b.position[:, 0] * p[:, 1] - b.position[:, 1] * p[:, 0])]
        return np.r_[p.sum(0), (b.angular_momentum + np.cross(b.position, p)).sum(0)]

    before, impulses = momenta(), 0
    for _ in range(60):
        sim.step()
        impulses += np.count_nonzero(sim.contacts.impulse[:, 0])
    assert impulses > 50
    components = slice(None) if theta == 0.5 else slice(0, dim)
    close(momenta()[components], before[components], 1e-12, scale=np.abs(before).max() + 2.0 * len(x))
    closes(sim)


def test_disk_on_a_segment():
    """Disks rest on the bar, and beyond its end on the round cap, where the normal is inclined."""
    scene = cn.Scene(2, gravity=(0, -G))
    x = 1.0 + 0.15 * np.sin(0.5)
    scene.add(cn.disks([[0.0, 0.15], [5.0, 0.15]], 0.1, ROCK, driven="w"))
    scene.add(cn.disks([[x, 0.15 * np.cos(0.5)]], 0.1, ROCK))
    scene.add(cn.segment((-1, 0), (1, 0), ROCK, radius=0.05))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.1))
    sim = simulate(scene, 1e-4)
    sim.step()
    pairs, normals = sim.contacts.bodies, sim.contacts.normal
    at = {int(p.min()): n * (1 if p[0] == p.min() else -1) for p, n in zip(pairs, normals)}
    close(at[0], [0, 1], 1e-12)
    close(at[2], [np.sin(0.5), np.cos(0.5)], 1e-6)
    assert 1 not in at
    advance(sim, 100)
    close(sim.bodies.position[0], [0, 0.15], 1e-12)
    close(sim.bodies.velocity[1, 1], -G * sim.time, 1e-12)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("rate", [0.0, 0.7])
def test_periodic_cell(dim, rate):
    """Momentum stays, but for what bodies gain by crossing a moving side; the work of the cell closes the balance."""
    counts = (5, 4) if dim == 2 else (4, 3, 3)
    scene = cn.Scene(dim, periodic=cn.Periodic(tuple(map(float, counts)), shear_rate=rate))
    x = grid(dim, counts)
    v = np.random.default_rng(8).standard_normal((len(x), 3 * dim - 3))
    scene.add((cn.disks if dim == 2 else cn.spheres)(x, 0.48, ROCK, velocity=v))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    sim = simulate(scene, 5e-3)
    b, height = sim.bodies, counts[-1]
    mass = b.mass[:, None]
    start = np.sum(mass * v[:, :dim] ** 2) / 2 + np.sum(b.inertia.reshape(len(x), -1)[:, 0] * np.sum(v[:, dim:] ** 2, 1)) / 2
    touched = crossed = 0
    for _ in range(300):
        before, place = np.sum(mass * b.velocity[:, :dim], 0), b.position[:, -1]
        sim.step()
        touched += np.count_nonzero(sim.contacts.impulse[:, 0])
        jumps = np.round((b.position[:, -1] - place) / height)  # up by a cell: the velocity of the side comes with it
        crossed += np.count_nonzero(jumps)
        expected = before + np.sum(mass[:, 0] * jumps) * height * rate * np.eye(dim)[0]
        close(np.sum(mass * b.velocity[:, :dim], 0), expected, 1e-12, scale=np.sum(mass))
    assert touched > 200
    assert crossed > 1
    kinetic = closes(sim)
    e = sim.energy
    gained = e["work_driven"] - e["dissipated_friction"] - e["dissipated_normal"]
    close(kinetic - start, gained, 1e-11, scale=e["in_play"])
    assert (e["work_driven"] != 0) == (rate != 0)


# ---------------------------------------------------------------------- numbers


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("theta", [0.5, 0.6, 1.0])
def test_energy_closes(dim, theta):
    """Every term; D_theta makes up for theta, and is (theta - 1/2) m g^2 h^2 a step in free fall."""
    sim = simulate(heap(dim, push=lambda t: np.eye(dim)[0] * np.sin(30 * t)), 4e-3, theta=theta, solver=cn.NLGS(tol=1e-6))
    advance(sim, 150)
    closes(sim)
    assert sim.energy["dissipated_normal"] > 0
    assert sim.energy["dissipated_friction"] > 0
    scene = cn.Scene(dim, gravity=-G * np.eye(dim)[-1])
    scene.add((cn.disks if dim == 2 else cn.spheres)([np.zeros(dim)], 0.5, ROCK))
    free = advance(simulate(scene, 1e-2, theta=theta), 50)
    mass, e = free.bodies.mass[0], free.energy
    close(e["dissipated_integrator"], (theta - 0.5) * mass * G**2 * 1e-4 * 50, 1e-11, scale=e["in_play"])
    fallen = -mass * G * -free.bodies.position[0, -1]
    close(e["potential"], fallen, 1e-12)


@pytest.mark.parametrize("dim", [2, 3])
def test_projection_removes_overlap_and_touches_no_velocity(dim):
    def compressed(project):
        centers = grid(dim, (4,) * dim, spacing=0.9)
        scene = cn.Scene(dim)
        v = np.random.default_rng(1).standard_normal((len(centers), 3 * dim - 3)) * 0.01
        scene.add((cn.disks if dim == 2 else cn.spheres)(centers, 0.47, ROCK, velocity=v))
        scene.add(cn.wall(np.zeros(dim), np.eye(dim)[-1], ROCK))
        scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
        return simulate(scene, 1e-3, project_positions=project, solver=cn.NLGS(tol=1e-8, max_iter=20000))

    plain, projected = compressed(False), compressed(True)
    plain.step()
    projected.step()
    assert np.array_equal(plain.bodies.velocity, projected.bodies.velocity)
    assert plain.contacts.gap.min() < -0.05
    for _ in range(3):
        projected.step()
    assert projected.contacts.gap.min() > -1e-4
    closes(projected)


@pytest.mark.parametrize("dim", [2, 3])
def test_detection_margin_changes_nothing(dim):
    """Three times the margin: more candidates, the same step within the tolerance, the same error within 10 %."""
    steps = []
    for margin in (0.05, 0.15):
        solver = cn.NLGS(tol=1e-6, max_iter=5000)
        sim = simulate(heap(dim), 4e-3, solver=solver, margin=margin)
        advance(sim, 40)
        steps.append((len(sim.contacts), sim.bodies.velocity, sim.bodies.position))
    assert steps[1][0] > 1.05 * steps[0][0]
    close(steps[1][1], steps[0][1], 1e-3)  # 40 steps of a flow, each to 1e-6

    errors = []
    for margin in (0.05, 0.15):
        sim = simulate(heap(dim), 4e-3, margin=0.05, solver=cn.NLGS(tol=1e-6, max_iter=500))
        advance(sim, 120)
        sim.strategy = cn.NSCD(margin=margin, warm_start=False, solver=cn.NLGS(tol=1e-15, min_iter=5, max_iter=5))
        sim.step()
        errors.append(sim.info["error"])
        assert sim.info["status"] == "iteration_limit"
    print(f"error of five iterations: {errors[0]:.4g}, with three times the margin {errors[1]:.4g}")
    assert errors[0] > 1e-8
    close(errors[1], errors[0], 0.1)


# ---------------------------------------------------------------------- scenes in files, views, runs


def every_feature():
    scene = heap(2, push=cn.Table([0, 0.1], [[0, 0], [1, 0]]))
    scene.gravity = cn.Harmonic((0.5, 0.0), 3.0, (0.0, -G))
    turned = {"rotation": [0.1, 0.5], "damping": 0.3}
    scene.add(cn.clumps([[1, 8], [3, 8]], [[-0.1, 0], [0.2, 0.0]], [0.3, 0.2], 100.0, 3.0, SAND, **turned))
    scene.add(cn.disks([[5.0, 8.0]], 0.3, ROCK, force=cn.Harmonic((10.0, 0.0), 5.0), driven="w", group="odd"))
    scene.add(cn.segment((6, 9), (8, 9.5), SAND, radius=0.1))
    scene.add(cn.wall((0, 12), (0, -1), ROCK, mass=500.0, free="vy", force=cn.Servo(1e3, (0, -1))))
    scene.interact("odd", "*", cn.Restitution(mu=0.2, normal=0.4))
    scene.interact("odd", SAND, None)
    return scene


def test_saved_scene_gives_the_same_run(tmp_path):
    scene = every_feature()
    scene.save(tmp_path / "scene.h5")
    again = cn.Scene.load(tmp_path / "scene.h5")
    a, b = (advance(simulate(s, 4e-3, solver=cn.NLGS(tol=1e-5)), 40) for s in (scene, again))
    assert not differing(state(a), state(b))
    cell = cn.Scene(3, origin=(1e6, 0, 0), periodic=cn.Periodic((4.0, np.inf, 3.0), corner=(1e6, 0, 0), lean=0.5, shear_rate=1.0))
    cell.add(cn.spheres(grid(3, (4, 1, 3)) + (1e6, 0, 0), 0.48, ROCK))
    cell.interact("*", "*", cn.Coulomb(mu=0.5))
    cell.save(tmp_path / "cell.h5")
    a, b = (advance(simulate(s, 4e-3, solver=cn.NLGS(tol=1e-5)), 40) for s in (cell, cn.Scene.load(tmp_path / "cell.h5")))
    assert not differing(state(a), state(b))


def test_python_functions_cannot_be_saved(tmp_path):
    scene = cn.Scene(2)
    scene.add(cn.wall((0, 0), (0, 1), ROCK, velocity=lambda t: (t, 0)))
    with pytest.raises(ValueError, match="drive is a Python function, which a file cannot hold: use cairn.Table or"):
        scene.save(tmp_path / "a.h5")
    assert not list(tmp_path.iterdir())


def test_raw_view_is_refused_after_a_renumbering():
    sim = simulate(heap(2), 4e-3, renumber_every=5)
    raw = sim.raw
    order = np.argsort(raw.id)
    assert np.array_equal(raw.position[order], sim.bodies.position)
    advance(sim, 5)
    raw.velocity[order[0], 0] = 3.0  # it is live
    assert sim.bodies.velocity[0, 0] == 3.0
    sim.step()
    with pytest.raises(RuntimeError, match="renumbered since this view was taken: take sim.raw again"):
        raw.position  # noqa: B018
    assert len(sim.raw.position) == 51


def test_run_until_while_and_callbacks(tmp_path):
    sim = simulate(heap(2), 1e-3, solver=cn.NLGS())
    assert sim.run(steps=7, progress=False) == 7
    assert sim.run(until=0.02, progress=False) == 13
    assert abs(sim.time - 0.02) < 1e-12
    assert sim.run(until=0.02, progress=False) == 0
    assert sim.run(while_=lambda s: s.steps < 25, progress=False) == 5
    seen = []
    assert sim.run(steps=10, callback=lambda s: seen.append(s.steps), progress=False) == 10
    assert seen == list(range(26, 36))
    assert sim.run(steps=10, callback=lambda s: s.steps < 38, progress=False) == 3
    path = tmp_path / "run.vtkhdf"
    probes = {"height": lambda s: s.bodies.position[:48, 1].max(), "seven": lambda s: 7}
    heights = []
    sim.run(steps=6, output=path, every=4, probes=probes, callback=lambda s: heights.append(probes["height"](s)), progress=False)
    with cn.load(path) as run:
        assert np.array_equal(run.history["height"], heights)
        assert np.array_equal(run.history["seven"], [7] * 6)
        assert [run[k].step for k in range(len(run))] == [38, 40, 44]
    with pytest.raises(ValueError, match="run needs an end: give steps=, until= or while_="):
        sim.run()
    with pytest.raises(ValueError, match="checkpoint_every needs output="):
        sim.run(steps=1, checkpoint_every=1)


def test_explain_tells_what_runs():
    sim = simulate(heap(3), 2e-3, theta=0.6, margin=0.1, project_positions=True, solver=cn.NLGS(tol=1e-5, max_iter=77))
    text = advance(sim, 2).explain()
    for words in (
        "53 bodies", "3D", "project_positions", "Theta 0.6", "step 0.002 s", "0.1 m for a pair", "1e-05", "77",
        "warm start", "bytes a body", "bytes a contact", "angular_momentum", "mass", "radius 0.45",
    ):
        assert words in text, words
    assert "not stored, since nothing needs them: " in text
    assert "angular_momentum" in text.split("not stored")[1].splitlines()[0]


def test_a_boundary_begins_with_the_velocity_of_its_free_dofs():
    """A velocity drives held dofs and is the initial velocity of free ones; a function drives held dofs alone."""
    for dim, free, velocity in ((2, "vy", (0.2, -1.0)), (3, ("vz", "wx"), (0.1, 0, -1.0, 0.3, 0, 0))):
        up = np.eye(dim)[-1]
        scene = cn.Scene(dim)
        scene.add(cn.wall(0 * up, up, ROCK, mass=5.0, inertia=1.0, free=free, velocity=velocity))
        scene.add(cn.wall(0 * up - up, up, ROCK, mass=5.0, free=free if dim == 2 else "vz", velocity=lambda t, v=velocity: v))
        sim = cn.Simulation(scene, 0.1)
        given = np.zeros(3 * dim - 3)
        given[: len(velocity)] = velocity
        for _ in range(3):
            sim.step()
            assert np.array_equal(sim.bodies.velocity[0], given)
            assert sim.bodies.velocity[1, dim - 1] == 0 and sim.bodies.velocity[1, 0] == given[0]
        assert np.allclose(sim.bodies.position[0], 0.3 * given[:dim])
