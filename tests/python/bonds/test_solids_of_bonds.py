"""Where bonds make a solid of many bodies Auto solves a step by factors over the bodies: the answer is that of sweeps."""

import warnings

import cairn as cn
import numpy as np
import pytest

SPRINGS = dict(normal_stiffness=1e12, tangential_stiffness=5e11, within=1e-6)
STRONG = dict(normal_strength=1e9, tangential_strength=1e9, normal_work=1e7, tangential_work=1e7)
LAWS = [cn.Bonded(mu=0.3), cn.ParallelBond(**SPRINGS), cn.MAL(**SPRINGS, **STRONG)]


def beam(dim, law, solver, h=1e-3):
    """A clamped beam of disks or spheres, three or four across, under its weight, and a loose ball on it."""
    stone, r = cn.Material("stone", density=2500.0), 0.01
    if dim == 2:
        places = np.array([[2 * r * (i + 0.5 * (j % 2)), np.sqrt(3) * r * j] for j in range(4) for i in range(20)])
    else:
        places = 2 * r * np.array([[i, j, k] for k in range(3) for j in range(3) for i in range(12)], float)
    scene = cn.Scene(dim=dim, gravity=(0.0, -9.81) if dim == 2 else (0.0, 0.0, -9.81))
    make, dofs = (cn.disks, ("vx", "vy", "w")) if dim == 2 else (cn.spheres, ("vx", "vy", "vz", "wx", "wy", "wz"))
    left = places[:, 0] < 1.5 * r
    scene.add(make(places[left], r, stone, driven=dofs), make(places[~left], r, stone))
    scene.interact(stone, stone, law)
    loose = cn.Material("loose", density=2500.0)
    top = places[~left].max(axis=0) * [1] * dim
    top[0] = places[:, 0].max() / 2
    top[-1] = places[:, -1].max() + 2.2 * r
    scene.add(make([top], r, loose))
    scene.interact(stone, loose, cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, dt=h, strategy=cn.NSCD(theta=0.6, solver=solver))


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_factors_give_the_answer_of_sweeps(dim, law):
    sim = beam(dim, law, cn.Auto(tol=1e-9))
    sweeps = beam(dim, law, cn.NLGS(tol=1e-9, max_iter=200000))
    taken = []
    for of in (sim, sweeps):
        taken.append(0)
        for _ in range(3):
            of.step()
            assert of.info["status"] == "converged" and of.info["error"] <= 1e-9
            taken[-1] += of.info["iterations"]
    assert taken[0] < 900 and taken[0] < taken[1]  # sweeps take thousands
    speed = np.abs(sweeps.bodies.velocity).max()
    np.testing.assert_allclose(
        sim.bodies.velocity, sweeps.bodies.velocity, rtol=0, atol=1e-4 * speed
    )  # of sweeps, 1e5 times their error
    terms = sim.info["energy"]
    assert abs(terms["closure"]) <= 1e-10 * terms["in_play"]


def test_the_solver_that_did_it_is_told_and_threads_do_not_matter():
    ends = []
    for threads in (1, 3):
        sim = beam(2, LAWS[1], cn.Auto(tol=1e-9))
        sim.threads = threads
        sim.step()
        assert sim.info["solver"] == "newton_over_bodies"
        ends.append(sim.bodies.velocity.copy())
    np.testing.assert_array_equal(*ends)


@pytest.mark.parametrize("h", [1e-6, 1e-5])
def test_short_steps_converge_too(h):
    """Where inertia exceeds the stiffness of bonds, Newton passes may fail: they are abandoned, and sweeps go on."""
    sim = beam(2, LAWS[1], cn.Auto(tol=1e-6), h=h)
    sim.step()
    assert sim.info["status"] == "converged"


def test_a_chain_of_a_hundred_hinges_keeps_its_energy():
    """Sweeps alone need 46,000 a step here, `Auto` fewer than 1,000 iterations. The energy error falls with the square of the
    step."""
    steel, lost = cn.Material("steel", density=7800.0), []
    corners = np.array([[-0.1, -0.02], [0.1, -0.02], [0.1, 0.02], [-0.1, 0.02]])
    for dt in (4e-4, 2e-4):
        scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
        bars = scene.add(cn.polygons([corners + (0.1 + 0.2 * k, 0.0) for k in range(100)], steel))
        scene.interact("*", "*", None)
        for k in range(100):
            scene.join(bars[k], bars[k - 1] if k else None, cn.Pivot(point=(0.2 * k, 0.0)))
        sim = cn.Simulation(scene, dt=dt, strategy=cn.NSCD(solver=cn.Auto(tol=1e-10)))
        sim.step()
        seen = []
        for _ in range(round(0.1 / dt)):
            info = sim.step()
            assert info["status"] == "converged" and info["iterations"] < 1000
            terms = sim.info["energy"]
            seen.append(terms["kinetic"] + terms["potential"])
        lost.append(np.abs(np.array(seen) - seen[0]).max() / terms["kinetic"])
    assert lost[0] < 1e-4 and lost[1] < 0.4 * lost[0]


def test_cells_of_a_mesh_that_may_crack():
    """Sides of one-element bodies, whose masses are full matrices."""
    steel = cn.Material("steel", density=8000.0)
    x, y = np.meshgrid(np.linspace(0, 1, 9), np.linspace(0, 0.25, 3), indexing="ij")
    number = np.arange(x.size).reshape(x.shape)
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], -1).reshape(-1, 4)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    body = cn.ElasticBody(np.c_[x.ravel(), y.ravel()], {"triangle": triangles}, young=1e9, poisson=0.3, density=8000.0,
                          groups={"left": number[0]})  # fmt: skip
    law = cn.MAL(normal_stiffness=1e12, tangential_stiffness=1e12, mu=0.0, **STRONG)
    speeds = []
    for solver in (cn.Auto(tol=1e-8), cn.NLGS(tol=1e-8, max_iter=200000)):
        scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
        cn.fracture.split(body, law, steel, fixed={"left": "xy"}).add_to(scene)
        sim = cn.Simulation(scene, dt=1e-3, strategy=cn.NSCD(theta=0.6, solver=solver))
        sim.step()
        assert sim.info["status"] == "converged"
        speeds.append(np.concatenate([mesh.velocity for mesh in sim.meshes]))
    np.testing.assert_allclose(*speeds, rtol=0, atol=1e-4 * np.abs(speeds[1]).max())


def test_bonds_and_joints_are_given_to_auto_unless_said():
    def chosen(law):
        scene = cn.Scene(dim=2)
        stone = cn.Material("stone", density=2500.0)
        scene.add(cn.disks([[0.0, 0.0], [0.0205, 0.0]], 0.01, stone))
        scene.interact(stone, stone, law)
        return type(cn.Simulation(scene, dt=1e-3).strategy.solver)

    for law in (*LAWS, cn.Rod(within=1e-3)):
        assert chosen(law) is cn.Auto
    for law in (cn.Coulomb(mu=0.3), cn.Wet(force=1.0, reach=1e-3), cn.Rolling(mu=0.3)):
        assert chosen(law) is cn.NLGS
    scene = cn.Scene(dim=2)
    bars = scene.add(cn.disks([[0.0, 0.0], [0.02, 0.0]], 0.005, cn.Material("stone", density=2500.0)))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    scene.join(bars[0], bars[1], cn.Pivot(point=(0.01, 0.0)))
    assert type(cn.Simulation(scene, dt=1e-3).strategy.solver) is cn.Auto


@pytest.mark.parametrize("length", [50, 80])
def test_bonds_that_do_not_soften_are_asked_for_the_whole_of_what_they_answer(length):
    """A free bar of two rows, hit at its end: half of the way would leave other impulses after as many sweeps."""
    places = 0.02 * np.array([[i, j] for i in range(length) for j in range(2)], float)
    velocity = np.zeros((len(places), 3))
    velocity[:2, 1] = 1.0
    ends = []
    for share in (1.0, 0.5):
        scene = cn.Scene(dim=2)
        scene.add(cn.disks(places, 0.01, cn.Material("stone", density=2500.0), velocity=velocity))
        scene.interact("*", "*", cn.Bonded())
        solver = cn.NLGS(tol=1e-4, max_iter=200, softening_relaxation=share)
        sim = cn.Simulation(scene, dt=1e-3, strategy=cn.NSCD(solver=solver), overlap="ignore")
        sim.step()
        ends.append(sim.contacts.impulse.copy())
    np.testing.assert_array_equal(*ends)


@pytest.mark.parametrize("length", [50, 80])
def test_velocities_are_right_where_bonds_converged(length):
    """Impulses of a solid of bonds are in balance with each other: sweeps ended at 1e-4 of these while the end of a bar that
    was hit moved at 1.7 times its speed, and each step of a solid at rest was called converged while it fell."""
    places = 0.02 * np.array([[i, j] for i in range(length) for j in range(2)], float)
    velocity = np.zeros((len(places), 3))
    velocity[:2, 1] = 1.0
    ends = []
    for tol in (1e-4, 1e-12):
        scene = cn.Scene(dim=2)
        scene.add(cn.disks(places, 0.01, cn.Material("stone", density=2500.0), velocity=velocity))
        scene.interact("*", "*", cn.Bonded())
        sim = cn.Simulation(scene, dt=1e-3, strategy=cn.NSCD(solver=cn.Auto(tol=tol, max_iter=5000)), overlap="ignore")
        assert sim.step()["status"] == "converged"
        ends.append(sim.bodies.velocity[:, :2].copy())
    assert np.linalg.norm(ends[0] - ends[1]) < 0.05 * np.linalg.norm(ends[1])


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
@pytest.mark.parametrize("h", [1e-3, 1e-4])
def test_a_solid_under_its_weight_does_not_run_away_by_default(law, h):
    """A clamped wall by default settings, beside the same at 1e-9: speeds are alike, or a hundredth of a step of free fall."""
    fast = []
    for solver in (cn.Default(), cn.Auto(tol=1e-9, max_iter=20000)):
        sim = wall(law, h, solver)
        speeds = []
        with warnings.catch_warnings():
            warnings.simplefilter("error", cn.EnergyCreatedWarning)
            for _ in range(20):
                assert sim.step()["status"] == "converged"
                speeds.append(np.linalg.norm(sim.bodies.velocity[:, :2]))
        fast.append(max(speeds))
    assert fast[0] < 1.001 * fast[1] + 0.01 * 9.81 * h * np.sqrt(len(sim.bodies))


def wall(law, h, solver):
    """800 disks, held on the left."""
    r, stone = 0.01, cn.Material("stone", density=2500.0)
    places = np.array([[2 * r * (i + 0.5 * (j % 2)), np.sqrt(3) * r * j] for j in range(20) for i in range(40)])
    left = places[:, 0] < 1.5 * r
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.disks(places[left], r, stone, driven=("vx", "vy", "w")), cn.disks(places[~left], r, stone))
    scene.interact(stone, stone, law)
    return cn.Simulation(scene, dt=h, strategy=cn.NSCD(theta=0.6, solver=solver))


@pytest.mark.parametrize("ratio", [1e3, 1e6, 1e9, 1e12])
@pytest.mark.parametrize("solver", [cn.Auto(), cn.NLGS()], ids=["auto", "nlgs"])
def test_a_heavy_end_of_a_bonded_bar_stands_or_its_steps_are_not_called_converged(ratio, solver):
    """The global error is a sum of energies, to which light disks that fall under a heavy one do not contribute."""
    r = 0.01
    places = 2 * r * np.array([[i, j] for i in range(8) for j in range(4)], float)
    stone, heavy = cn.Material("stone", density=2500.0), cn.Material("heavy", density=2500.0 * ratio)
    left, last = places[:, 0] < r, (places[:, 0] > 13 * r) & (places[:, 1] < r)
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.disks(places[left], r, stone, driven=("vx", "vy", "w")), cn.disks(places[~left & ~last], r, stone),
              cn.disks(places[last], r, heavy))  # fmt: skip
    scene.interact("*", "*", cn.Bonded(mu=0.3))
    sim = cn.Simulation(scene, dt=1e-3, strategy=cn.NSCD(solver=solver), overlap="ignore")
    free, converged = 9.81 * 1e-3, []
    for _ in range(10):
        info = sim.step()
        converged.append(info["status"] == "converged")
        if converged[-1] and all(converged):  # the error of one step is the start of the next
            assert np.abs(sim.bodies.velocity[-1, :2]).max() < 0.01 * free
            assert np.abs(sim.bodies.velocity[:, :2]).max() < 0.1 * free
        assert not converged[-1] or info["light_error"] <= 1e-4
    if isinstance(solver, cn.Auto):
        assert sum(converged) == (10 if ratio <= 1e9 else 0)


@pytest.mark.parametrize("origin", [0.0, 1e6, 1e9])
def test_disks_that_touch_bond_wherever_they_are(origin):
    """Far from the origin gaps of disks that touch are as large as the rounding of places."""
    r = 0.01
    places = 2 * r * np.array([[i, j] for i in range(8) for j in range(4)], float)
    stone, left = cn.Material("stone", density=2500.0), places[:, 0] < r
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.disks(places[left] + origin, r, stone, driven=("vx", "vy", "w")), cn.disks(places[~left] + origin, r, stone))
    scene.interact("*", "*", cn.Bonded(mu=0.3))
    sim = cn.Simulation(scene, dt=1e-3)
    for _ in range(10):
        assert sim.step()["status"] == "converged"
    assert (sim.contacts.status == 3).all() and len(sim.contacts) == 49
    assert np.abs(sim.bodies.velocity).max() < 0.1 * 9.81 * 1e-3


def test_the_error_of_light_bodies_under_bonds_is_that_by_hand():
    """After three sweeps: by how fast each bond breaks its law, in the norm of its block, over the change of its lighter body."""
    r, g, h = 0.01, 9.81, 1e-3
    places = 2 * r * np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]])
    rho = np.array([2500.0, 2500.0, 2500.0, 2.5e6])
    scene = cn.Scene(dim=2, gravity=(0.0, -g))
    for k, driven in enumerate([("vx", "vy", "w"), (), (), ()]):
        scene.add(cn.disks(places[k : k + 1], r, cn.Material(f"m{k}", density=rho[k]), driven=driven))
    scene.interact("*", "*", cn.Bonded())
    sim = cn.Simulation(scene, dt=h, strategy=cn.NSCD(solver=cn.NLGS(tol=1e-12, max_iter=3)))
    info = sim.step()
    assert info["status"] == "iteration_limit" and info["contacts"] == 3
    v, mass = sim.bodies.velocity, rho * np.pi * r**2
    inertia = mass * r**2 / 2
    inverse, inverse_inertia = np.r_[0, 1 / mass[1:]], np.r_[0, 1 / inertia[1:]]
    change = np.hypot(v[1:, 0], v[1:, 1] + g * h)
    mean = np.sqrt((mass[1:] * change**2).sum() / mass[1:].sum())
    found = 0.0
    for a, b in ((0, 1), (1, 2), (2, 3)):
        u = np.array([v[b, 0] - v[a, 0], v[b, 1] - v[a, 1] - r * (v[a, 2] + v[b, 2]), v[b, 2] - v[a, 2]])
        arms = inverse[a] + inverse[b]
        w = np.array([arms, arms + r**2 * (inverse_inertia[a] + inverse_inertia[b]), inverse_inertia[a] + inverse_inertia[b]])
        lighter = max((inverse[k], -k) for k in (a, b))
        found = max(found, np.sqrt(w[0] * (u**2 / w).sum()) / max(change[-lighter[1] - 1], mean))
    assert found > 1e-3
    assert info["light_error"] == pytest.approx(found, rel=1e-9)


def lattice(law, disks, solver):
    """A step of .1 ms of a lattice under its weight, clamped on its left."""
    r, rows = 0.01, round(np.sqrt(disks / 2))
    places = np.array([[2 * r * (i + 0.5 * (j % 2)), np.sqrt(3) * r * j] for j in range(rows) for i in range(2 * rows)])
    held, stone = places[:, 0] < 1.5 * r, cn.Material("stone", density=2500.0)
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.disks(places[held], r, stone, driven=("vx", "vy", "w")), cn.disks(places[~held], r, stone))
    scene.interact(stone, stone, law)
    sim = cn.Simulation(scene, 1e-4, cn.NSCD(theta=0.6, solver=solver, threads=1), overlap="ignore")
    info = sim.step()
    assert info["status"] == "converged"
    terms = sim.info["energy"]
    assert abs(terms["closure"]) <= 1e-10 * terms["in_play"]
    return info, sim.bodies.velocity.copy()


@pytest.mark.parametrize("law, disks", [(LAWS[2], 1500), (LAWS[1], 3000)], ids=["MAL", "ParallelBond"])
def test_short_steps_from_nothing_find_what_is_pressed_and_what_is_drawn(law, disks):
    """Whole steps of Newton's method stray there; sweeps take thousands at 1e-4, ten thousands below: proximal points lead on."""
    loose, _ = lattice(law, disks, cn.Auto(tol=1e-4, max_iter=20000))
    tight, velocity = lattice(law, disks, cn.Auto(tol=1e-8, max_iter=20000))
    for info in (loose, tight):
        assert info["solver"] == "newton_over_bodies" and info["iterations"] < 400
    if disks < 2000:
        _, by_sweeps = lattice(law, disks, cn.NLGS(tol=1e-6, max_iter=200000))
        np.testing.assert_allclose(velocity[:, :2], by_sweeps[:, :2], rtol=0, atol=1e-3 * np.abs(by_sweeps[:, :2]).max())


def test_a_slender_bar_stands_at_the_accuracy_of_velocities():
    """Errors of contacts say little of 200 disks in a row: a row of bonds that each miss little has a tip that falls."""
    count, h, g = 200, 1e-3, 9.81
    material, place = cn.Material("disk", density=2000.0), np.column_stack([0.1 * np.arange(count), np.zeros(count)])
    scene = cn.Scene(dim=2, gravity=(0.0, -g))
    scene.add(cn.disks(place[:1], 0.05, material, driven=("vx", "vy", "w")))
    scene.add(cn.disks(place[1:], 0.05, material))
    scene.interact(material, material, cn.Bonded(mu=0.3))
    sim = cn.Simulation(scene, h, cn.NSCD(accuracy=1e-3, solver=cn.Auto()))
    for _ in range(40):
        report = sim.step()
        assert report["status"] == "converged" and report["velocity_error"] <= 1e-3
        assert np.abs(sim.bodies.velocity[:, :2]).max() < 1e-3 * h * g
