"""Bars and beams that move far: exact derivatives, closed forms, motions of any size, contact."""

import cairn as cn
import numpy as np
import pytest

SECTION = {"young": 2e7, "area": 3e-2, "density": 1e3}
BEAM = SECTION | {"inertia": 4e-5, "poisson": 0.3}


def line(n, dim, length=1.0):
    points = np.zeros((n + 1, dim))
    points[:, 0] = np.linspace(0, length, n + 1)
    return points, np.c_[:n, 1 : n + 1]


def kinds():
    out = []
    for dim in (2, 3):
        for kinematics in ("corotational", "total_lagrangian"):
            out.append(pytest.param("bars", dim, kinematics, {}, id=f"bars {dim} {kinematics}"))
        given = {"thin": {}, "stout": {"inertia": 5e-3}, "shears": {"shear_area": 2e-2}, "pulled": {"initial_stress": 3e4}}
        for name, more in given.items():
            out.append(pytest.param("beams", dim, "corotational", more, id=f"beams {dim} {name}"))
    return out


def truss(kind, dim, kinematics, more, seed=0):
    """A few cells that meet, in any directions."""
    rng = np.random.default_rng(seed)
    points = np.array([[0, 0, 0], [1, 0.2, 0.1], [1.9, -0.2, 0.4], [0.8, 1.1, -0.3], [0.5, 0.4, 1.2]])[:, :dim]
    cells = [[0, 1], [1, 2], [1, 3], [3, 2], [0, 4], [4, 3], [4, 1]][: 4 if dim == 2 else 7]
    points = points[: 4 if dim == 2 else 5]
    given = dict(SECTION)
    if kind == "beams":
        two = np.array([4e-5, 1e-5])
        given = BEAM | {"inertia": two if dim == 3 else 4e-5, "clamped": [0], "up": (0.1, 0.3, 1.0)}
    return getattr(cn, kind)(points, cells, kinematics=kinematics, **given | more), rng


@pytest.mark.parametrize("kind, dim, kinematics, more", kinds())
def test_forces_are_the_gradient_of_the_energy_and_the_tangent_that_of_forces(kind, dim, kinematics, more):
    body, rng = truss(kind, dim, kinematics, more)
    u = 0.15 * rng.standard_normal(body.points.shape)
    model = body.model()
    force, tangent, _ = body.tangent(u, model)
    way, h = rng.standard_normal(u.shape), 1e-4
    ends = [body.tangent(u + s * h * way) for s in (-2, -1, 1, 2)]

    def rate(values):  # of the fourth order
        return (values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * h)

    assert force @ way.ravel() == pytest.approx(rate([end[2] for end in ends]), rel=1e-8)
    change = rate([end[0] for end in ends])
    assert np.abs(tangent @ way.ravel() - change).max() < 1e-8 * np.abs(change).max()


@pytest.mark.parametrize("kind, dim, kinematics, more", kinds())
def test_at_rest_they_are_the_linear_ones(kind, dim, kinematics, more):
    body, rng = truss(kind, dim, kinematics, more)
    small, _ = truss(kind, dim, "small", more)
    force, tangent, energy = body.tangent(np.zeros_like(body.points))
    assert np.abs(tangent - small.K).max() < 1e-9 * np.abs(small.K).max()
    given = np.zeros_like(force) if small.initial_force is None else small.initial_force
    assert np.abs(force - given).max() <= 1e-12 * max(np.abs(given).max(), np.abs(small.K).max())
    assert energy == pytest.approx(small.initial_energy, rel=1e-12)


def rotation(vector):
    angle = np.linalg.norm(vector)
    x, y, z = vector / angle
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


@pytest.mark.parametrize("kind, dim, kinematics, more", kinds())
def test_a_rigid_motion_of_any_size_is_none_to_them(kind, dim, kinematics, more):
    body, rng = truss(kind, dim, kinematics, more | ({"clamped": None} if kind == "beams" else {}))
    rest, _, stored = body.tangent(np.zeros_like(body.points))
    for angle in (1e-8, 0.7, np.pi / 2, 3.1, np.pi):
        about = np.array([0, 0, 1.0]) if dim == 2 else rng.standard_normal(3)
        turn = rotation(angle * about / np.linalg.norm(about))[:dim, :dim]
        force, _, energy = body.tangent(body.points @ turn.T + 10 - body.points)
        pulled = rest.reshape(-1, dim) @ turn.T  # by a stress from the start, which turns with them
        assert np.abs(force - pulled.ravel()).max() < 1e-13 * np.abs(body.K).max() * 10, angle
        assert abs(energy - stored) < (1e-13 * 10) ** 2 * np.abs(body.K).max() + 1e-12 * stored


@pytest.mark.parametrize("dim", [2, 3])
def test_elastica(dim):
    """A clamped beam under a dead load P across its end, to P L^2/EI = 10, against elliptic integrals."""
    from scipy.optimize import brentq
    from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

    points, cells = line(40, dim)
    bend = SECTION["young"] * 4e-5
    beam = BEAM | {"area": 4e-5 * 12 * 1e4}
    body = cn.beams(points, cells, **beam, clamped=[0], groups={"foot": [0]}, kinematics="corotational")
    u, model = np.zeros_like(points), body.model()
    for load in (0.5, 1.0, 3.0, 5.0, 10.0):

        def misses(k, load=load):
            return ellipk(k * k) - ellipkinc(np.arcsin(1 / (k * np.sqrt(2))), k * k) - np.sqrt(load)

        k = brentq(misses, np.sqrt(0.5) * (1 + 1e-12), 1 - 1e-14)
        start = np.arcsin(1 / (k * np.sqrt(2)))
        across = 1 - 2 / np.sqrt(load) * (ellipe(k * k) - ellipeinc(start, k * k))
        along = np.sqrt(2 / load * (2 * k * k - 1))
        force = np.zeros_like(points)
        force[-1, 1] = load * bend
        u = body.solve({"foot": "xyz"[:dim]}, force.ravel(), start=u, model=model)
        assert u[-1, 1] == pytest.approx(across, rel=3e-4), load
        assert 1 + u[-1, 0] == pytest.approx(along, rel=1e-4), load
        if dim == 3:
            assert np.abs(u[:, 2]).max() < 1e-10 * np.abs(u).max()


def curved_rod(load):
    """Where the end of an elastic rod along an eighth of a circle (below) is under a force across its plane, to ten digits: the
    equations of Kirchhoff and Love, which stretches too, x' = (1 + N/EA) t, Q' = Q [kappa], moment (x(L) - x) x F in space, by
    shooting from the foot for the place of the end.
    """
    from scipy.integrate import solve_ivp
    from scipy.optimize import root

    axial, bend, twist, radius, force = 1e7, 1e7 / 12, 1e7 / 2 / 6, 100.0, np.array([0, 0, load])

    def rates(_, y, end):
        x, q = y[:3], y[3:].reshape(3, 3)  # columns: tangent, towards the centre, along z
        m = q.T @ np.cross(end - x, force)
        k = np.array([m[0] / twist, m[1] / bend, m[2] / bend - 1 / radius])  # a curve that turns about -z
        spin = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
        return np.r_[(1 + q[:, 0] @ force / axial) * q[:, 0], (q @ spin).ravel()]

    # along y at the foot, the centre at (100, 0, 0)
    foot = np.r_[np.zeros(3), np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]], float).ravel()]

    def misses(end):
        return solve_ivp(rates, (0, radius * np.pi / 4), foot, args=(end,), rtol=1e-10, atol=1e-10).y[:3, -1] - end

    found = root(misses, (20.0, 55.0, 45.0), tol=1e-9)
    assert found.success
    return found.x


def test_a_bend_of_45_degrees():
    """Bathe & Bolourchi 1979: a cantilever along an eighth of a circle of radius 100, a force across its plane at the end;
    against the equations of the rod, and these against Simo & Vu-Quoc 1986, whose rod shears.
    """
    off, rod = {}, {load: curved_rod(load) for load in (300, 450, 600)}
    for n in (16, 32):
        angle = np.linspace(0, np.pi / 4, n + 1)
        points = np.c_[100 * (1 - np.cos(angle)), 100 * np.sin(angle), 0 * angle]
        section = {"young": 1e7, "area": 1.0, "inertia": 1 / 12, "torsion": 1 / 6, "poisson": 0.0, "density": 1.0}
        held = {"clamped": [0], "groups": {"foot": [0]}}
        body = cn.beams(points, np.c_[:n, 1 : n + 1], **section, **held, kinematics="corotational")
        u, model = np.zeros_like(points), body.model()
        for load, end in rod.items():
            force = np.zeros_like(points)
            force[-1, 2] = load
            u = body.solve({"foot": "xyz"}, force.ravel(), start=u, model=model, increments=4)
            off[n, load] = np.abs(points[-1] + u[-1] - end).max() / 80
    for load in rod:
        assert off[32, load] < 1e-4 and off[32, load] < 0.3 * off[16, load], off
    for load, place in {300: (22.33, 58.84, 40.08), 450: (18.62, 52.32, 48.39), 600: (15.79, 47.23, 53.37)}.items():
        assert rod[load] == pytest.approx(place, rel=0.01)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("turns", [1, 2])
def test_a_strip_that_is_rolled_up_needs_its_moment_alone(dim, turns):
    """Nodes on a circle, once or twice round, both ends as before: curvature 2 pi turns/L all along, E I/2 of its square is
    stored, and no force remains at any node, since the couple on the ends alone bends the strip.
    """
    points, cells = line(30, dim)
    body = cn.beams(points, cells, **BEAM, clamped=[0, 30], kinematics="corotational")
    way = 2 * np.pi * turns * (np.arange(30) + 0.5) / 30
    rolled = np.zeros_like(points)
    rolled[1:, :2] = np.cumsum(np.c_[np.cos(way), np.sin(way)] / 30, axis=0)
    model = body.model()
    force, _, energy = body.tangent(rolled - points, model)
    bend = BEAM["young"] * BEAM["inertia"]
    assert energy == pytest.approx(bend * (2 * np.pi * turns) ** 2 / 2, rel=1e-12)
    assert np.abs(force).max() < 1e-10 * bend * (2 * np.pi * turns) * 30
    turned = 2 * np.pi * turns * np.arange(31) / 30
    if dim == 2:
        assert np.abs(np.exp(1j * body.rotations(model)) - np.exp(1j * turned)).max() < 1e-10
    else:
        found = body.rotations(model)
        assert np.abs(found[:, 0] ** 2 - np.cos(turned / 2) ** 2).max() < 1e-10
        assert np.abs(found[:, 3] ** 2 - np.sin(turned / 2) ** 2).max() < 1e-10


@pytest.mark.parametrize("kind, dim", [("beams", 2), ("beams", 3), ("bars", 3)])
def test_what_is_tried_between_changes_no_bit(kind, dim):
    body, rng = truss(kind, dim, "corotational", {})
    u, other = 0.2 * rng.standard_normal((2, *body.points.shape))
    model = body.model()
    first = model.evaluate(u.ravel(), len(body.lower[1]))
    for tried in (other, -3 * other, 1e-9 * u):
        model.evaluate(tried.ravel(), len(body.lower[1]))
    again = model.evaluate(u.ravel(), len(body.lower[1]))
    assert np.array_equal(first[0], again[0]) and np.array_equal(first[1], again[1]) and first[3] == again[3]


@pytest.mark.parametrize("kinematics", ["corotational", "total_lagrangian"])
def test_von_mises_truss_snaps_through(kinematics):
    """Two bars from (-1, 0), (1, 0) to (0, 0.3): the force that holds the middle at any height, in closed form."""
    points, size = np.array([[-1.0, 0], [1, 0], [0, 0.3]]), np.hypot(1, 0.3)
    body = cn.bars(points, [[0, 2], [1, 2]], young=3e5, area=1e-3, density=1.0, kinematics=kinematics)
    for height in (0.3, 0.2, 0.1, 0.0, -0.1, -0.3, -0.5):
        long = np.hypot(1, height)
        of = (long - size) / size / long if kinematics == "corotational" else (long**2 - size**2) / (2 * size**3)
        u = np.zeros_like(points)
        u[2, 1] = height - 0.3
        force = body.tangent(u)[0]
        assert force[5] == pytest.approx(2 * 300.0 * of * height, rel=1e-12, abs=1e-13 * 300)
        assert abs(force[4]) <= 1e-13 * 300


def tumbling(kind, dim, strategy, dt, kinematics="corotational", seed=1):
    body, rng = truss(kind, dim, kinematics, {"clamped": None} if kind == "beams" else {})
    about = np.array([0, 0, 9.0]) if dim == 2 else np.array([3.0, -6.0, 5.0])
    full = np.c_[body.points, np.zeros((len(body.points), 3 - dim))]
    mass = body.nodal_mass()
    centre = mass @ full / mass.sum()
    velocity = (np.cross(about, full - centre) + [0.4, -0.2, 0.0])[:, :dim]
    velocity = velocity + 0.2 * rng.standard_normal(velocity.shape)
    scene = cn.Scene(dim=dim, gravity=np.zeros(dim))
    scene.add(cn.deformable(body, cn.Material("steel", density=1.0), velocity=velocity))
    return cn.Simulation(scene, dt, strategy), mass


def momenta(sim, mass):
    view = sim.meshes[0]
    x, v = (np.c_[a, np.zeros((len(a), 3 - a.shape[1]))] for a in (view._mesh.d.body.points + view.displacement, view.velocity))
    return mass @ v, (mass[:, None] * np.cross(x, v)).sum(axis=0)


@pytest.mark.parametrize("kind, dim", [("bars", 2), ("bars", 3), ("beams", 2), ("beams", 3)])
def test_a_free_frame_tumbles_through_many_turns(kind, dim):
    """The theta-method keeps momentum, and angular momentum and energy to its order, the second."""
    drift = []
    for dt in (4e-3, 2e-3):
        sim, mass = tumbling(kind, dim, cn.NSCD(theta=0.5, newton_tol=1e-12), dt)
        linear, angular = momenta(sim, mass)
        energies, turns = [], []
        for _ in range(int(round(4.0 / dt))):
            info = sim.step()
            assert info["status"] == "converged"
            energies.append(sim.energy["kinetic"] + sim.energy["stored"])
            turns.append(np.linalg.norm(momenta(sim, mass)[1] - angular))
        assert np.abs(momenta(sim, mass)[0] - linear).max() < 1e-11 * mass.sum() * 9
        drift.append([np.ptp(energies[len(energies) // 8 :]) / np.mean(energies), np.max(turns) / np.linalg.norm(angular)])
    (energy, turn), (finer_energy, finer_turn) = drift
    assert finer_energy < 0.4 * energy < 0.01 and finer_turn < 0.4 * turn < 0.01


@pytest.mark.parametrize("kinematics", ["corotational", "total_lagrangian"])
@pytest.mark.parametrize("dim", [2, 3])
def test_discrete_gradients_keep_energy_and_both_momenta_of_bars(dim, kinematics):
    """Invariants hold to the tolerance of Newton's method; beams are refused."""
    strategy = cn.NSCD(integrator=cn.DiscreteGradient(), newton_tol=1e-12)
    sim, mass = tumbling("bars", dim, strategy, 4e-3, kinematics)
    linear, angular = momenta(sim, mass)
    energies = []
    for _ in range(200):
        assert sim.step()["status"] == "converged"
        energies.append(sim.energy["kinetic"] + sim.energy["stored"])
    now = momenta(sim, mass)
    assert np.abs(now[0] - linear).max() < 1e-11 * mass.sum() * 9
    assert np.abs(now[1] - angular).max() < 1e-9 * np.linalg.norm(angular)
    assert np.ptp(energies) < 1e-9 * energies[0]
    sim, _ = tumbling("beams", dim, strategy, 2e-2)
    with pytest.raises(ValueError, match="rotations of the beams of the mesh 'mesh'.*Theta"):
        sim.step()


@pytest.mark.parametrize("kind, dim", [("bars", 3), ("beams", 2), ("beams", 3)])
def test_explicit_steps_and_a_restart_in_the_middle_have_the_same_bits(kind, dim, tmp_path):
    for strategy, dt in ((cn.NSCD(theta=0.5), 4e-3), (cn.NSCD(integrator=cn.CentralDifference()), 2e-4)):
        sim, _ = tumbling(kind, dim, strategy, dt)
        for _ in range(20):
            sim.step()
        sim.checkpoint(tmp_path / "middle.h5")
        other, _ = tumbling(kind, dim, strategy, dt)
        other.restore(tmp_path / "middle.h5")
        for each in (sim, other):
            for _ in range(20):
                each.step()
        assert np.array_equal(sim.meshes[0].displacement, other.meshes[0].displacement)
        assert np.array_equal(sim.meshes[0].velocity, other.meshes[0].velocity)


def swinging(kind, dim, strategy, dt):
    """A rope of bars, or a soft beam, held at both ends, and a ball that falls on it."""
    points, cells = line(16, dim, 2.0)
    groups = {"ends": [0, 16]}
    if dim == 3:
        groups["all"] = np.arange(17)
    if kind == "bars":
        body = cn.bars(points, cells, young=2e7, area=1e-3, density=2e3, groups=groups, kinematics="corotational")
    else:
        body = cn.beams(points, cells, young=2e7, area=1e-3, inertia=1e-8, density=2e3, groups=groups, kinematics="corotational")
    rock = cn.Material("rock", density=500.0)
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.deformable(body, rock, edges=cells[:, ::-1], fixed={"ends": "xy"}), cn.disks([[0.97, 0.25]], 0.1, rock))
    scene.interact(rock, rock, cn.Coulomb(mu=0.2))
    return cn.Simulation(scene, dt, strategy)


@pytest.mark.parametrize("kind", ["bars", "beams"])
def test_a_ball_falls_on_what_sags(kind):
    """The balance of energy is closed, in contact, to what the tolerances leave, and the ball is held far below the ends."""
    sim = swinging(kind, 2, cn.NSCD(theta=0.5, newton_tol=1e-10, cut_back=4), 5e-4)
    lowest, touched = 0.0, 0
    for _ in range(1200):
        info = sim.step()
        assert info["status"] == "converged"
        lowest = min(lowest, sim.meshes[0].displacement[:, 1].min())
        told = sim.energy
        assert abs(told["closure"]) < 1e-12 * told["in_play"]
        touched += info["contacts"] > 0
        ball, nodes = sim.bodies.position[-1], sim.meshes[0].position
        assert np.abs(ball - nodes).max() < 2.0 and np.linalg.norm(ball - nodes, axis=1).min() > 0.099
    assert lowest < -0.1 and touched > 300 and told["dissipated_normal"] > 1.0


def test_a_soft_hoop_falls_flat():
    """On its rim in space, thrown: it lies down, bent out of all proportion on its way, with the balance of energy closed."""
    n = 16
    angle = 2 * np.pi * np.arange(n) / n
    points = np.c_[np.cos(angle), 0.05 * np.sin(3 * angle), 1.05 + np.sin(angle)]
    cells = np.c_[np.arange(n), (np.arange(n) + 1) % n]
    section = {"young": 1e7, "area": 1e-3, "inertia": 1e-7, "density": 1e3, "up": (0, 1, 0.02), "rayleigh": (0, 1e-4)}
    body = cn.beams(points, cells, **section, groups={"all": np.arange(n)}, kinematics="corotational")
    rock, scene = cn.Material("rock", density=1e3), cn.Scene(dim=3, gravity=(0, 0, -9.81))
    thrown = cn.deformable(body, rock, contact="all", velocity=(0.3, 0.5, -1))
    scene.add(thrown, cn.wall((0, 0, 0), (0, 0, 1), rock))
    scene.interact(rock, rock, cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 2e-3, cn.NSCD(theta=0.5, newton_tol=1e-10, cut_back=4))
    for _ in range(1000):
        assert sim.step()["status"] == "converged"
        told = sim.energy
        assert abs(told["closure"]) < 1e-11 * told["in_play"]
    height = sim.meshes[0].position[:, 2]
    assert np.ptp(height) < 0.2 and height.min() > -1e-6 * np.ptp(points) and told["dissipated_friction"] > 1.0


@pytest.mark.parametrize("dim", [2, 3])
def test_half_a_turn_in_a_step_and_far_origins(dim):
    """A beam that is driven round its end, by half a turn at once, far from the origin, has the forces of the one at rest."""
    points, cells = line(4, dim)
    bent = np.zeros_like(points)
    bent[:, 1] = 0.1 * points[:, 0] ** 2
    forces = []
    for far in (0.0, 1e6):
        body = cn.beams(points + far, cells, **BEAM, kinematics="corotational")
        model = body.model()
        force, _, _ = body.tangent(bent, model)
        back = -(points + bent) - points
        if dim == 3:
            back[:, 2] *= -1
        again, _, _ = body.tangent(back, model)
        way = np.ones(dim)
        way[:2] = -1
        assert np.abs(again.reshape(-1, dim) * way - force.reshape(-1, dim)).max() < 1e-9 * np.abs(force).max()
        forces.append(force)
    assert np.abs(forces[1] - forces[0]).max() < 1e-5 * np.abs(forces[0]).max()  # places are rounded at 1e-10 of the length


def test_extremes_have_an_answer_or_an_error():
    points, cells = line(3, 2)
    for size in (1e-9, 1e-6, 1e6):
        body = cn.beams(size * points, cells, **BEAM | {"area": 1e-9, "inertia": 1e-20}, clamped=[0], kinematics="corotational")
        force, tangent, energy = body.tangent(size * np.c_[0 * points[:, 0], 0.2 * points[:, 0] ** 2])
        assert np.all(np.isfinite(force)) and np.all(np.isfinite(tangent.data)) and energy > 0
    for given in (np.nan, np.inf):
        u = np.zeros_like(points)
        u[1, 0] = given
        for made in (body, cn.bars(points, cells, **SECTION, kinematics="total_lagrangian")):
            with pytest.raises(ValueError, match="(beam|bar) 0 with nodes 0 1: it has no length, or its ends are not at finite"):
                made.tangent(u)
    u = np.zeros_like(points)
    u[2] = points[1] - points[2]
    with pytest.raises(ValueError, match="bar 1 with nodes 1 2: it has no length"):
        cn.bars(points, cells, **SECTION, kinematics="corotational").tangent(u)
    rope = cn.bars(points, cells, **SECTION, groups={"ends": [0, 3]}, kinematics="corotational")
    down = np.c_[np.zeros(4), -np.ones(4)].ravel()
    with pytest.raises(ValueError, match="the tangent is singular, as of bars that nothing pulls across"):
        rope.solve({"ends": "xy"}, down)
    taut = cn.bars(points, cells, **SECTION, groups={"ends": [0, 3]}, initial_stress=1e4, kinematics="corotational")
    u = taut.solve({"ends": "xy"}, down)
    inner, size = taut.tangent(u)[0].reshape(-1, 2), np.abs(u).max()
    assert np.abs(inner[1:3] - [0.0, -1.0]).max() < 1e-10 * np.abs(inner).max() and 1e-5 < size < 1e-2
    with pytest.raises(ValueError, match="give more increments"):
        taut.solve({"ends": "xy"}, down, most=1)
    for made in (cn.bars, cn.beams):
        with pytest.raises(ValueError, match="kinematics"):
            made(points, cells, **BEAM if made is cn.beams else SECTION, kinematics="large")
    with pytest.raises(ValueError, match="kinematics"):
        cn.beams(points, cells, **BEAM, kinematics="total_lagrangian")


def test_a_step_that_no_rotations_fit_is_told_and_undone():
    """A beam folded back on itself in one step, both ends clamped: the cell is named, the state is that before the step."""
    points, cells = line(1, 2)
    body = cn.beams(points, cells, **BEAM, clamped=[0, 1], groups={"foot": [0], "tip": [1]}, kinematics="corotational")
    scene = cn.Scene(dim=2, gravity=(0.0, 0.0))
    driven = {"tip": {"x": -200.0, "y": 1e-3}}
    scene.add(cn.deformable(body, cn.Material("steel", density=1.0), fixed={"foot": "xy"}, drive=driven))
    sim = cn.Simulation(scene, 1e-2, cn.NSCD(theta=1.0))
    with pytest.raises(ValueError, match="'mesh': beam 0 with nodes 0 1: an end is turned by nearly half a turn against it"):
        sim.step()
    assert sim.time == 0 and not sim.meshes[0].displacement.any()


@pytest.mark.parametrize("kinematics", ["corotational", "total_lagrangian"])
def test_a_stiff_bar_swings_as_a_pendulum(kinematics):
    """From 2 rad at rest: its period is 4 sqrt(L/g) K(sin(1)), and a bar so stiff stays within 1e-6 of its length."""
    from scipy.special import ellipk

    points = np.array([[0.0, 0.0], [2 * np.sin(2.0), -2 * np.cos(2.0)]])
    body = cn.bars(points, [[0, 1]], young=2e9, area=1e-2, density=1.0, groups={"pivot": [0]}, kinematics=kinematics)
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.deformable(body, cn.Material("steel"), fixed={"pivot": "xy"}))
    period = 4 * np.sqrt(2 / 9.81) * ellipk(np.sin(1.0) ** 2)
    sim = cn.Simulation(scene, period / 2000, cn.NSCD(theta=0.5, newton_tol=1e-12))
    for _ in range(500):
        assert sim.step()["status"] == "converged"
    end, speed = sim.meshes[0].position[1], np.linalg.norm(sim.meshes[0].velocity[1])
    assert abs(end[0]) < 2e-6 * speed * period and end[1] < 0  # by the step's second order
    for _ in range(1500):
        sim.step()
    assert np.abs(sim.meshes[0].displacement).max() < 1e-4 * 2
    assert np.linalg.norm(sim.meshes[0].position[1]) == pytest.approx(2, rel=1e-6)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_scene_comes_to_rest_where_it_is_solved(dim):
    """A strip under a load that bends it far, by steps so long that inertia is nothing beside it, as `solve` finds it."""
    points, cells = line(10, dim)
    groups = {"foot": [0], "tip": [10]}
    body = cn.beams(points, cells, **BEAM, clamped=[0], groups=groups, kinematics="corotational")
    load = np.zeros(dim)
    load[:2] = -200.0, 5 * BEAM["young"] * BEAM["inertia"]
    force = np.zeros_like(points)
    force[10] = load
    model = body.model()
    u = body.solve({"foot": "xyz"[:dim]}, force.ravel(), increments=10, model=model)
    scene = cn.Scene(dim=dim, gravity=np.zeros(dim))
    held = {"foot": "xyz"[:dim]}
    scene.add(cn.deformable(body, cn.Material("rubber"), fixed=held, force=lambda t: {"tip": min(t / 1e4, 1.0) * load}))
    sim = cn.Simulation(scene, 1e3, cn.NSCD(theta=1.0, newton_tol=1e-12, newton_passes=60))
    for _ in range(40):
        assert sim.step()["status"] == "converged"
    assert u[10, 1] > 0.5
    assert np.abs(sim.meshes[0].displacement - u).max() < 1e-7 * np.abs(u).max()
    turned = body.rotations(model)
    assert np.abs(sim.meshes[0].rotation - turned).max() < 1e-7 * np.abs(turned).max()
    last = points[10] + u[10] - points[9] - u[9]
    angle = turned[10] if dim == 2 else 2 * np.arctan2(turned[10, 3], turned[10, 0])
    assert angle == pytest.approx(np.arctan2(last[1], last[0]), rel=0.02)  # what the last cell still bends


def test_rest_of_a_strip_that_bears_a_ball():
    """Equilibrium by find_equilibrium of a ball on the middle of a strip between hinges, against `solve` under half its weight
    each."""
    points, cells = line(9, 2)
    body = cn.beams(points, cells, **BEAM, groups={"ends": [0, 9]}, kinematics="corotational")
    rock, scene = cn.Material("rock", density=500.0), cn.Scene(dim=2, gravity=(0.0, -9.81))
    ball = cn.disks([[0.5, 0.1]], 0.1, rock)
    scene.add(cn.deformable(body, rock, edges=cells[:, ::-1], fixed={"ends": "xy"}), ball)
    scene.interact(rock, rock, cn.Coulomb(mu=0.2))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(theta=0.5))
    assert cn.find_equilibrium(sim)["converged"]
    force = np.c_[np.zeros(10), -9.81 * body.nodal_mass()]
    force[4:6, 1] -= 9.81 * 500 * np.pi * 0.01 / 2
    expected = body.solve({"ends": "xy"}, force.ravel())
    assert np.abs(sim.meshes[0].displacement - expected).max() < 1e-4 * np.abs(expected).max()


@pytest.mark.parametrize("kind, dim", [("bars", 2), ("bars", 3), ("beams", 2), ("beams", 3)])
def test_central_differences_are_stable_at_their_limit_wherever_frames_turn(kind, dim):
    """Energy stays over many turns at 0.95 of the step that is told, and at three of it the step is refused."""
    sim, _ = tumbling(kind, dim, cn.NSCD(integrator=cn.CentralDifference()), 1e-6)
    limit = sim.stable_step
    sim, _ = tumbling(kind, dim, cn.NSCD(integrator=cn.CentralDifference()), 0.95 * limit)
    energies = []
    for _ in range(int(2.0 / limit)):
        sim.step()
        energies.append(sim.energy["kinetic"] + sim.energy["stored"])
    half = len(energies) // 2
    assert np.mean(energies[half:]) == pytest.approx(np.mean(energies[:half]), rel=0.02)
    sim, _ = tumbling(kind, dim, cn.NSCD(integrator=cn.CentralDifference()), 3 * limit)
    with pytest.raises(Exception, match="beyond the stable step"):
        sim.step()


@pytest.mark.parametrize("dim", [2, 3])
def test_the_stable_step_of_a_stair_of_bars_is_that_of_the_straight_chain(dim):
    """At rest no wave goes along a stair, and its highest frequency is 1/sqrt(2) of that of the chain that it can become."""
    n = 40
    stair, straight = np.zeros((n + 1, dim)), np.zeros((n + 1, dim))
    stair[:, 0], stair[:, 1], straight[:, 1] = (np.arange(n + 1) + 1) // 2, np.arange(n + 1) // 2, np.arange(n + 1)
    body = cn.bars(stair, np.c_[:n, 1 : n + 1], **SECTION, kinematics="corotational")
    scene, rng = cn.Scene(dim=dim, gravity=np.zeros(dim)), np.random.default_rng(1)
    velocity = 1e-3 * rng.standard_normal(stair.shape)
    scene.add(cn.deformable(body, cn.Material("steel"), displacement=straight - stair, velocity=velocity))
    limit = cn.Simulation(scene, 1e-6, cn.NSCD(integrator=cn.CentralDifference())).stable_step
    chain = 2 / np.sqrt(4 * SECTION["young"] / SECTION["density"])  # nodes of mass rho A l between springs E A/l
    assert limit == pytest.approx(chain, rel=0.02)
    sim = cn.Simulation(scene, 0.98 * limit, cn.NSCD(integrator=cn.CentralDifference()))
    energies = []
    for _ in range(1000):
        sim.step()
        energies.append(sim.energy["kinetic"] + sim.energy["stored"])
    assert np.mean(energies[500:]) < 1.5 * np.mean(energies[:500])


def test_rotations_are_of_beams():
    sim, _ = tumbling("beams", 3, cn.NSCD(theta=0.5), 1e-3)
    for _ in range(5):
        sim.step()
    q = sim.meshes[0].rotation
    assert q.shape == (5, 4) and np.abs(np.linalg.norm(q, axis=1) - 1).max() < 1e-12
    turn = 5e-3 * np.linalg.norm([3.0, -6.0, 5.0])  # by the initial velocity, up to bending
    assert 2 * np.arccos(np.mean(q[:, 0])) == pytest.approx(turn, rel=0.1)
    sim, _ = tumbling("bars", 2, cn.NSCD(theta=0.5), 1e-3)
    with pytest.raises(AttributeError, match="bars turn freely"):
        _ = sim.meshes[0].rotation
    small = cn.beams(*line(2, 2), **BEAM)
    scene = cn.Scene(dim=2, gravity=(0.0, 0.0))
    scene.add(cn.deformable(small, cn.Material("steel")))
    with pytest.raises(AttributeError, match="kinematics='corotational'"):
        _ = cn.Simulation(scene, 1e-3).meshes[0].rotation


@pytest.mark.parametrize("kind", ["bars", "beams"])
def test_a_rigid_hub_swings_with_them_and_states_are_taken_back(kind):
    """A pendulum of cells with a rigid end: distances there stay to rounding; a state that is set again goes on as it did."""
    points = np.array([[0, 0], [1, 0], [2, 0], [2, 1], [3, 0]], float)
    cells = [[0, 1], [1, 2], [2, 3], [1, 3], [3, 4], [2, 4]]
    given = BEAM if kind == "beams" else SECTION
    body = getattr(cn, kind)(points, cells, **given, groups={"foot": [0], "hub": [2, 3, 4]}, kinematics="corotational")
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.deformable(body, cn.Material("steel"), fixed={"foot": "xy"}, rigid=["hub"]))
    sim = cn.Simulation(scene, 5e-3, cn.NSCD(theta=0.5))
    for k in range(200):
        if k == 100:
            state = sim.get_state()
        sim.step()
    x = sim.meshes[0].position
    for a, b in ((2, 3), (3, 4), (2, 4)):
        assert np.linalg.norm(x[a] - x[b]) == pytest.approx(np.linalg.norm(points[a] - points[b]), rel=1e-13)
    assert x[4, 1] < -1.5 and abs(sim.energy["closure"]) < 1e-7 * sim.energy["in_play"]
    found = sim.meshes[0].displacement, sim.meshes[0].velocity
    sim.set_state(state)
    for _ in range(100):
        sim.step()
    assert np.array_equal(sim.meshes[0].displacement, found[0]) and np.array_equal(sim.meshes[0].velocity, found[1])


def test_a_scene_file_holds_them(tmp_path):
    for kind in ("bars", "beams"):
        sim, _ = tumbling(kind, 3, cn.NSCD(), 2e-3)
        sim.scene.save(tmp_path / "scene.h5")
        other = cn.Simulation(cn.Scene.load(tmp_path / "scene.h5"), 2e-3)
        for _ in range(10):
            sim.step()
            other.step()
        assert np.array_equal(sim.meshes[0].displacement, other.meshes[0].displacement)
