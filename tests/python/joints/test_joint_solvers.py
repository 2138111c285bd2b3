"""Joints in every contact solver: the motion found by sweeps to a small error, and properties of the solution."""

import cairn as cn
import numpy as np
import pytest
from cairn import problems, strategies

STEEL = cn.Material("steel", density=1000.0)
G, DT = 9.81, 1e-3
SHARP = cn.Auto(tol=1e-10, max_iter=100000)
SOLVERS = [name for name in strategies.SOLVERS if name not in ("NLGS", "Auto", "Default")]


def at(dim, x, z):
    return (x, z) if dim == 2 else (x, 0.0, z)


def bars(dim, centres, half=(0.1, 0.02), **options):
    """Bars along x, half of a length and a height."""
    a, b = half
    if dim == 2:
        corners = np.array([[-a, -b], [a, -b], [a, b], [-a, b]])
        return cn.polygons([corners + c for c in centres], STEEL, **options)
    return cn.boxes([at(3, *c) for c in centres], [(2 * a, 0.06, 2 * b)] * len(centres), STEEL, **options)


def empty(dim, gravity=True):
    scene = cn.Scene(dim, gravity=at(dim, 0.0, -G if gravity else 0.0))
    scene.interact("*", "*", None)
    return scene


def hinge(dim, x, z, **options):
    point = at(dim, x, z)
    return cn.Pivot(point=point, **options) if dim == 2 else cn.Hinge(point=point, axis=(0, -1, 0), **options)


def floor(scene, dim):
    ground = cn.Material("ground", density=1000.0)
    scene.add(cn.wall(at(dim, 0.0, 0.0), at(dim, 0.0, 1.0), ground))
    scene.interact("steel", "ground", cn.Coulomb(mu=0.4))


def chain(dim):
    """Four bars that hang on hinges from a wall and fall."""
    scene = empty(dim)
    ids = scene.add(bars(dim, [(0.1 + 0.2 * k, 0.0) for k in range(4)]))
    scene.join(ids[0], None, hinge(dim, 0.0, 0.0))
    for k in range(3):
        scene.join(ids[k], ids[k + 1], hinge(dim, 0.2 * (k + 1), 0.0))
    return scene


def about(dim):
    """Moment of inertia of a bar about its end [kg m2]."""
    mass = 1000.0 * 0.2 * 0.04 * (1.0 if dim == 2 else 0.06)
    return mass * ((0.2**2 + 0.04**2) / 12 + 0.1**2)


def motor(dim):
    """A bar without weight that a motor turns, first with all its effort, then at 4 rad/s, up to a limit."""
    scene = empty(dim, gravity=False)
    ids = scene.add(bars(dim, [(0.1, 0.0)]))
    drives = cn.Motor(speed=4.0, effort=400 * about(dim))
    scene.join(ids[0], None, hinge(dim, 0.0, 0.0, motor=drives, limits=(-0.2, 0.15)))
    return scene


def sprung(dim):
    """A bar on a hinge with a spring and a dashpot, another on a slider with a brake, a third on a spring between points."""
    scene = empty(dim)
    ids = scene.add(bars(dim, [(0.1, 0.0), (0.5, 0.0), (1.0, 0.0)]))
    scene.join(ids[0], None, hinge(dim, 0.0, 0.0, spring=cn.Spring(2.0, damping=0.1)))
    down = at(dim, 0.0, 1.0)
    scene.join(ids[1], None, cn.Slider(point=at(dim, 0.5, 0.0), axis=down, motor=cn.Motor(speed=0.0, effort=1.0)))
    points = [at(dim, 1.0, 0.0), at(dim, 1.0, 0.3)]
    scene.join(ids[2], None, cn.Distance(points=points, limits=(0.29, 0.3005), spring=cn.Spring(200.0, damping=1.0)))
    return scene


def rope(dim):
    """Two weights on a rope that comes taut, over a pulley that hangs on a rope of its own."""
    scene = empty(dim)
    ball = cn.disks if dim == 2 else cn.spheres
    ids = scene.add(ball([at(dim, -0.3, -0.5), at(dim, 0.3, -0.6), at(dim, 0.0, 0.0)], [0.05, 0.06, 0.04], STEEL))
    points = [at(dim, -0.3, -0.5), at(dim, 0.0, 0.0), at(dim, 0.3, -0.6)]
    span = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    scene.join(ids[0], ids[1], cn.Cable(points=points, length=span + 1e-3, pulley=ids[2]))
    scene.join(ids[2], None, cn.Distance(points=[at(dim, 0.0, 0.0), at(dim, 0.1, 0.4)]))
    return scene


def table(dim):
    """A beam on two legs that are fixed to it, which falls on the floor, slides and carries a bar on a hinge."""
    scene, slides = empty(dim), {"velocity": at(dim, 0.3, 0.0) + (0.0,) * (2 * dim - 3)}
    ids = scene.add(bars(dim, [(0.0, 0.22)], (0.3, 0.02), **slides))
    legs = scene.add(bars(dim, [(-0.25, 0.1005), (0.25, 0.1005)], (0.03, 0.1), **slides))
    for leg, x in zip(legs, (-0.25, 0.25)):
        scene.join(ids[0], leg, cn.Fixed(point=at(dim, x, 0.2)))
    arm = scene.add(bars(dim, [(0.4, 0.22)], **slides))
    scene.join(arm[0], ids[0], hinge(dim, 0.3, 0.22))
    floor(scene, dim)
    return scene


def ring(dim):
    """Four bars in a square of hinges, whose axes are the same in space: their constraints are linearly dependent; it falls on
    the floor beside a piston on a slider, which has no tangent to slip along."""
    scene = empty(dim)
    upright = (0.02, 0.1)
    ids = [*scene.add(bars(dim, [(0.1, 0.03), (0.1, 0.23)])), *scene.add(bars(dim, [(0.0, 0.13), (0.2, 0.13)], upright))]
    for k, side in ((0, 2), (0, 3), (1, 2), (1, 3)):
        scene.join(ids[k], ids[side], hinge(dim, 0.0 if side == 2 else 0.2, 0.03 if k == 0 else 0.23))
    piston = scene.add(bars(dim, [(0.6, 0.105)], upright))
    scene.join(piston[0], None, cn.Slider(point=at(dim, 0.6, 0.1), axis=at(dim, 0.0, 1.0)))
    floor(scene, dim)
    return scene


SCENES = {"chain": (chain, 20), "motor": (motor, 60), "sprung": (sprung, 30), "rope": (rope, 30), "table": (table, 30),
          "ring": (ring, 40)}  # fmt: skip


def run(scene, solver, steps):
    """Velocities after each step (steps, bodies, ...), and the simulation."""
    sim = cn.Simulation(scene, DT, cn.NSCD(solver=solver), overlap="ignore")
    found = []
    for _ in range(steps):
        info = sim.step()
        assert info["status"] == "converged", info["hint"]
        assert info["error"] <= solver.tol
        found.append(np.column_stack([sim.bodies.velocity, sim.bodies.position]))
    return np.array(found), sim


@pytest.fixture(scope="module")
def sharp():
    """Solutions by sweeps to a small error, each scene once."""
    known = {}

    def of(name, dim):
        if (name, dim) not in known:
            make, steps = SCENES[name]
            known[name, dim] = run(make(dim), SHARP, steps)[0]
        return known[name, dim]

    return of


# those that end sooner, on contacts without joints as well (see the page on problems)
LEAST = {"ConjugateGradient": 1e-6, "PreconditionedConjugateGradient": 1e-6, "InteriorPoint": 1e-7}


def solver_of(name):
    return strategies.SOLVERS[name](tol=LEAST.get(name, 1e-9), max_iter=20000)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("name", SOLVERS)
def test_it_moves_joints_as_sweeps_do(name, scene, dim, sharp):
    if (name, scene, dim) == ("Enumeration", "table", 3):
        pytest.skip("eight contacts have 6,561 states in space: time")
    make, steps = SCENES[scene]
    found, sim = run(make(dim), solver_of(name), steps)
    assert sim.info["solver"] == strategies.SOLVERS[name].name
    wanted = sharp(scene, dim)
    assert np.abs(found - wanted).max() <= 100 * solver_of(name).tol * np.abs(wanted).max()


def spin(sim, dim):
    return sim.bodies.velocity[0, 2] if dim == 2 else -sim.bodies.velocity[0, 4]


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("name", SOLVERS)
def test_a_motor_gives_its_effort_then_its_speed_and_stops_at_the_limit(name, dim):
    """400 rad/s2 by the effort up to 4 rad/s; the limit of 0.15 rad stands against the effort."""
    solver = solver_of(name)
    _, sim = run(motor(dim), solver, 5)
    assert spin(sim, dim) == pytest.approx(400 * 5 * DT, rel=1e-6)
    for _ in range(15):
        sim.step()
    assert spin(sim, dim) == pytest.approx(4.0, rel=1e-7)
    for _ in range(40):
        assert sim.step()["status"] == "converged"
    assert abs(spin(sim, dim)) < 1e-6 * 4.0
    turned = sim.bodies.rotation[0] if dim == 2 else 2 * np.arctan2(-sim.bodies.rotation[0][2], sim.bodies.rotation[0][0])
    assert float(np.ravel(turned)[0]) == pytest.approx(0.15, rel=1e-6)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("name", SOLVERS)
def test_a_joint_breaks_at_its_strength_and_no_sooner(name, dim):
    """A bar hangs on a rod of 1.1 times its weight; a second one on it has that much with it, and both fall."""
    weight = 1000.0 * 0.2 * 0.04 * (1.0 if dim == 2 else 0.06) * G
    solver = solver_of(name)
    for load, stands in ((0.0, True), (1.0, False)):
        scene = empty(dim)
        ids = scene.add(bars(dim, [(0.0, 0.0), (0.0, -0.2)]))
        points = [at(dim, 0.0, 0.0), at(dim, 0.0, 0.3)]
        scene.join(ids[0], None, cn.Distance(points=points, strength=1.1 * weight))
        if load:
            scene.join(ids[0], ids[1], cn.Distance(points=[at(dim, 0.0, 0.0), at(dim, 0.0, -0.2)]))
        sim = cn.Simulation(scene, DT, cn.NSCD(solver=solver), overlap="ignore")
        for _ in range(5):
            assert sim.step()["status"] == "converged"
        assert (sim.bodies.velocity[0, dim - 1] > -1e-9 * G) == stands


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("name", SOLVERS)
def test_a_node_of_a_mesh_is_joined(name, dim):
    """A strip of cells on a joint at a node, a rigid bar on its other end, against sweeps."""
    found = []
    for solver in (SHARP, solver_of(name)):
        scene = empty(dim)
        x = [np.linspace(0.0, 0.2, 5), *[np.array([-0.02, 0.0, 0.02])] * (dim - 1)]
        points = np.stack(np.meshgrid(*x, indexing="ij"), axis=-1).reshape(-1, dim)
        of = np.arange(len(points)).reshape((5,) + (3,) * (dim - 1))
        if dim == 2:
            cells = {"quad": np.stack([of[:-1, :-1], of[1:, :-1], of[1:, 1:], of[:-1, 1:]], axis=-1).reshape(-1, 4)}
        else:
            part = [of[i : i + 4, j : j + 2, k : k + 2] for k in (0, 1) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))]
            cells = {"hexahedron": np.stack([p.ravel() for p in part], axis=1)}
        strip = cn.ElasticBody(points, cells, young=1e7, poisson=0.3, density=1000.0)
        nodes = scene.add(cn.deformable(strip, cn.Material("rubber", density=1000.0)))
        ends = [int(np.argmin(np.linalg.norm(points - at(dim, x, 0.0), axis=1))) for x in (0.0, 0.2)]
        bar = scene.add(bars(dim, [(0.3, 0.0)]))
        kind = cn.Pivot if dim == 2 else cn.Ball
        scene.join(nodes[ends[0]], None, kind(point=at(dim, 0.0, 0.0)))
        scene.join(bar[0], nodes[ends[1]], kind(point=at(dim, 0.2, 0.0)))
        sim = cn.Simulation(scene, DT, cn.NSCD(solver=solver), overlap="ignore")
        for _ in range(10):
            info = sim.step()
            assert info["status"] == "converged" and info["error"] <= solver.tol
        found.append(np.concatenate([np.ravel(sim.bodies.velocity), np.ravel(sim.nodes.velocity)]))
    assert np.abs(found[1] - found[0]).max() <= 1e-6 * np.abs(found[0]).max()


def test_the_problem_of_a_step_has_its_joints_in_it(tmp_path):
    sim = run(table(3), SHARP, 12)[1]
    p = sim.problem()
    rows, cones = sim.stages.contacts, np.flatnonzero(sim.stages.contacts.kind == 1)
    assert p.contacts == len(cones)  # hinges without limits or motors have no contact of their own
    w = p.W.toarray()
    assert np.abs(w - w.T).max() <= 1e-9 * np.abs(w).max()
    assert np.linalg.eigvalsh((w + w.T) / 2).min() >= -1e-9 * np.abs(w).max()
    impulse = sim.contacts.impulse[cones]
    r = np.einsum("mij,mj->mi", rows.axes[cones], impulse)
    assert np.abs(impulse).max() > 0 and p.error(r) <= 1e-8
    sim.dump_problem(tmp_path / "step.hdf5")
    again = problems.read(tmp_path / "step.hdf5")
    assert np.array_equal(again.q, p.q) and np.array_equal(again.W.toarray(), w)
    assert again.solve(tol=1e-8).status == "converged"


@pytest.mark.parametrize("dim", [2, 3])
def test_w_of_two_balls_that_are_one_is_that_of_the_one_body(dim):
    """A ball on the floor and a heavier one fixed beside and above it: W and q of the rigid body that both are."""
    scene = empty(dim)
    ball = cn.disks if dim == 2 else cn.spheres
    centres, radii = np.array([at(dim, 0.0, 0.05), at(dim, 0.06, 0.2)]), np.array([0.05, 0.08])
    ids = scene.add(ball(centres, radii, STEEL))
    scene.join(ids[0], ids[1], cn.Fixed(point=at(dim, 0.03, 0.1)))
    floor(scene, dim)
    sim = run(scene, SHARP, 1)[1]
    mass, inertia = np.array(sim.bodies.mass)[:2], np.array([np.ravel(i)[0] for i in sim.bodies.inertia])[:2]
    middle = mass @ centres / mass.sum()
    arm = at(dim, 0.0, 0.0) - middle  # from the centre of mass to the contact
    apart = centres - middle
    whole = sum(m * (a @ a * np.eye(dim) - np.outer(a, a)) + i * np.eye(dim) for m, a, i in zip(mass, apart, inertia))
    axes = np.array(sim.stages.contacts.axes[sim.stages.contacts.kind == 1][0])
    wanted = np.eye(dim) / mass.sum()
    if dim == 2:
        about = sum(m * (a @ a) + i for m, a, i in zip(mass, apart, inertia))
        turn = axes @ np.array([-arm[1], arm[0]])
        wanted = wanted + np.outer(turn, turn) / about
    else:
        turn = np.cross(arm, axes)
        wanted = wanted + turn @ np.linalg.solve(whole, turn.T)
    w = sim.problem().W.toarray()
    assert np.abs(w - wanted).max() <= 1e-8 * np.abs(wanted).max()


def test_the_problem_of_a_step_has_limits_and_motors_as_contacts():
    sim = run(motor(2), SHARP, 60)[1]
    p = sim.problem()
    assert p.contacts == 3 and list(p.mu) == [0.0, 0.0, 1.0]
    result = p.solve(tol=1e-10)
    assert result.status == "converged"
    effort = 400 * about(2) * DT
    # a motor at its limit gives all its effort, which the upper limit takes
    assert result.r[2, 1] == pytest.approx(effort, rel=1e-8) and result.r[1, 0] == pytest.approx(effort, rel=1e-6)


def test_what_cannot_be_a_problem_beside_joints_is_refused():
    scene = table(2)
    scene.interact("steel", "ground", cn.Bonded(mu=0.4))
    sim = cn.Simulation(scene, DT, cn.NSCD(solver=cn.PPANewton()), overlap="ignore")
    with pytest.raises(cn.Error, match="law Bonded have a local solution of their own.*take cairn.NLGS or cairn.Auto"):
        for _ in range(20):
            sim.step()


def test_what_w_does_not_fit_into_ends_with_a_status():
    sim = cn.Simulation(table(2), DT, cn.NSCD(solver=cn.ADMM(tol=1e-8, memory=100.0)), overlap="ignore")
    info = sim.step()
    while info["status"] == "converged" and info["step"] < 40:
        info = sim.step()
    assert info["status"] != "converged" and "memory" in info["hint"]


@pytest.mark.parametrize("strategy", [cn.GranularElement(stiffness=1e6), cn.Carpenter(penalty=1e6)])
def test_strategies_with_springs_for_contacts_refuse_what_they_do_not_hold(strategy):
    """A disk that hung on a bar sank by 147 mm in 0.3 s, and pendulums went off, in steps that converged."""
    rock = cn.Material("rock", density=2000.0)
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    (disk,) = scene.add(cn.disks([[0.0, -0.5]], 0.1, rock))
    scene.interact("*", "*", None)
    scene.join(disk, None, cn.Distance(points=[(0.0, -0.5), (0.0, 0.0)]))
    with pytest.raises(ValueError, match="knows no joints: take NSCD"):
        cn.Simulation(scene, 1e-3, strategy=strategy)
    bonded = cn.Scene(2)
    bonded.add(cn.disks([[0.0, 0.0], [0.2, 0.0]], 0.1, rock))
    bonded.interact(rock, rock, cn.Bonded())
    with pytest.raises(ValueError, match="law Bonded holds bodies together: take NSCD"):
        cn.Simulation(bonded, 1e-3, strategy=strategy)


def test_bonds_are_made_far_from_an_origin_as_without_one():
    """Places that were given 1e9 m away have the rounding of that, wherever the origin is."""
    rock = cn.Material("rock", density=2000.0)
    for far in (0.0, 1e6, 1e9):
        for origin in (None, (far, 0.0)):
            scene = cn.Scene(2, origin=origin)
            x = far + 0.2 * np.arange(6)
            scene.add(cn.disks(np.c_[x, 0 * x], 0.1, rock))
            scene.interact(rock, rock, cn.Bonded())
            sim = cn.Simulation(scene, 1e-4)
            sim.step()
            assert np.count_nonzero(sim.contacts.beta) == 5, (far, origin)
