"""Contacts with more than Signorini and Coulomb say, in scenes of the plane and of space, against closed forms: friction that
drops, springs, attraction, gaps that count from elsewhere, stops, couplings, coatings."""

import cairn as cn
import numpy as np
import pytest

STONE, BASE = cn.Material("stone", density=1000.0), cn.Material("base", density=1000.0)
R = 0.1
SOLVERS = (cn.NLGS(tol=1e-12, max_iter=5000), cn.Auto(tol=1e-12))
DIMENSIONS = pytest.mark.parametrize("dim", [2, 3])
EACH_SOLVER = pytest.mark.parametrize("solver", SOLVERS, ids=["NLGS", "Auto"])


def grain(dim, law, gap=0.0, force=None, velocity=None, turns=False, dt=1e-3, theta=0.5, solver=SOLVERS[0], gravity=None, **more):
    """A grain on a wall, its mass and the simulation."""
    up, held = np.eye(dim)[-1], ("w",) if dim == 2 else ("wx", "wy", "wz")
    still = [0.0] * (2 * dim - 3)
    scene = cn.Scene(dim, gravity=(0.0,) * dim if gravity is None else tuple(gravity))
    own = {"driven": () if turns else held}
    if force is not None:
        own["force"] = force if callable(force) else (*force, *still)
    if velocity is not None:
        own["velocity"] = [[*velocity, *still]]
    scene.add(cn.wall(np.zeros(dim), up, BASE), (cn.disks if dim == 2 else cn.spheres)([(R + gap) * up], R, STONE, **own))
    scene.interact(STONE, BASE, law)
    sim = cn.Simulation(scene, dt, cn.NSCD(solver=solver, theta=theta, **{"margin": 0.02, **more}), overlap="ignore")
    return sim, sim.bodies.mass[-1]


def run(sim, steps):
    for _ in range(steps):
        assert sim.step()["status"] == "converged"
        energy = sim.info["energy"]
        assert abs(energy["closure"]) <= 1e-9 * energy["in_play"]
    return sim.bodies.position[-1], sim.bodies.velocity[-1]


@EACH_SOLVER
@DIMENSIONS
def test_what_began_to_slide_slides_by_less(dim, solver):
    """Held up to mu m g; pushed by more for a moment, it goes on with the push less the kinetic friction."""
    g, mu, kinetic, push = 10.0, 0.5, 0.3, 0.4
    weight = 1000.0 * volume_of(dim) * g * np.eye(dim)[0]
    for moment, slides in ((0.48, False), (0.52, True)):

        def force(t, moment=moment):
            return (*((moment if 0.02 < t < 0.03 else push) * weight), *[0.0] * (2 * dim - 3))

        law = cn.UnilateralContact(mu=mu, kinetic=kinetic)
        sim, mass = grain(dim, law, force=force, solver=solver, gravity=-g * np.eye(dim)[-1])
        run(sim, 40)
        first = sim.bodies.velocity[-1, 0]
        _, velocity = run(sim, 100)
        assert velocity[0] - first == pytest.approx((push - kinetic) * g * 0.1 if slides else 0.0, rel=1e-9, abs=1e-12 * g)


@EACH_SOLVER
@DIMENSIONS
def test_a_grain_rests_on_its_spring(dim, solver):
    """At a depth m g/k, the energy that is stored k x^2/2; it rubs by mu m g."""
    g, k, force = 10.0, 1e5, 3.0
    up, along = np.eye(dim)[-1], np.eye(dim)[0]
    law = cn.ElasticContact(stiffness=k, viscosity=2e3, mu=0.2)
    push = tuple((0.2 * g * volume_of(dim) * 1000 + force) * along)
    sim, mass = grain(dim, law, theta=1.0, solver=solver, gravity=-g * up, force=push)
    run(sim, 1000)
    before = sim.bodies.velocity[-1, 0]
    position, velocity = run(sim, 100)
    assert R - position[-1] == pytest.approx(mass * g / k, rel=1e-9)
    assert sim.info["energy"]["stored"] == pytest.approx((mass * g) ** 2 / k / 2, rel=1e-8)
    assert velocity[0] - before == pytest.approx(force / mass * 0.1, rel=1e-8)


def volume_of(dim):
    return np.pi * R**2 if dim == 2 else 4 / 3 * np.pi * R**3


@DIMENSIONS
def test_a_grain_bounces_off_its_spring(dim):
    """Half a period pi sqrt(m/k) in touch, and leaves as fast as it came, with theta = 1/2; the exact balance of energy."""
    k, speed, up = 1e6, 0.1, np.eye(dim)[-1]
    sim, mass = grain(dim, cn.ElasticContact(stiffness=k), gap=1e-6, velocity=-speed * up, dt=1e-5)
    begin, end = 1e-6 / speed, 1e-6 / speed + np.pi * np.sqrt(mass / k)
    deepest = 0.0
    while sim.time < 1.2 * end:
        position, velocity = run(sim, 1)
        deepest = max(deepest, R - position[-1])
        if sim.time < begin + 0.9 * (end - begin):
            assert velocity[-1] < speed
    assert velocity[dim - 1] == pytest.approx(speed, rel=0.01)
    assert deepest == pytest.approx(speed * np.sqrt(mass / k), rel=0.01)


@EACH_SOLVER
@DIMENSIONS
def test_attraction_on_a_spring(dim, solver):
    """At rest (F + m g)/k deep; it takes F and the weight to part them, and the cone is that of both."""
    force, k, up, along = 40.0, 1e5, np.eye(dim)[-1], np.eye(dim)[0]
    law = cn.AdhesiveContact(force=force, reach=2e-3, mu=0.5, stiffness=k, viscosity=3e3)
    given = dict(theta=1.0, solver=solver, gravity=-up)
    sim, mass = grain(dim, law, **given)
    position, _ = run(sim, 800)
    assert R - position[-1] == pytest.approx((force + mass) / k, rel=1e-9)
    for pull, stays in ((0.9, True), (1.1, False)):
        sim, mass = grain(dim, law, force=tuple((mass + pull * force) * up), **given)
        position, _ = run(sim, 2000)
        assert (position[-1] - R < 1e-4) == stays
    bound = 0.5 * (force + mass)
    for push, stays in ((0.98, True), (1.02, False)):
        sim, mass = grain(dim, law, force=tuple(push * bound * along), **given)
        run(sim, 800)
        begun = sim.bodies.velocity[-1, 0]
        _, velocity = run(sim, 100)
        gained = 0.0 if stays else 0.02 * bound / mass * 0.1
        assert velocity[0] - begun == pytest.approx(gained, rel=1e-7, abs=1e-9 * bound / mass)


@DIMENSIONS
def test_attraction_of_the_start_alone(dim):
    """Torn off, pressed back and pulled by less than the attraction: it holds unless it is made once, or has lost too much."""

    def force(t):
        return (*((60.0 if t < 0.02 else -60.0 if t < 0.15 else 30.0) * np.eye(dim)[-1]), *[0.0] * (2 * dim - 3))

    once, strong, weak = dict(once=1, within=1e-3), dict(torn_force=31.0), dict(torn_force=29.0)
    for more, stays in ((dict(), True), (once, False), (strong, True), (weak, False)):
        sim, mass = grain(dim, cn.AdhesiveContact(force=40.0, reach=1e-4, **more), force=force)
        position, _ = run(sim, 19)
        assert position[-1] - R > 1e-4
        position, _ = run(sim, 131)
        assert position[-1] - R == pytest.approx(0.0, abs=1e-9 * R)
        position, _ = run(sim, 100)
        assert (position[-1] - R < 1e-9 * R) == stays, more


@DIMENSIONS
def test_a_gap_of_the_start_counts_as_touch(dim):
    """A grain that hangs 1 mm above the wall stays there; one that comes later falls to the wall."""
    up = np.eye(dim)[-1]
    law = cn.UnilateralContact(mu=0.3, from_start=1, within=2e-3)
    sim, mass = grain(dim, law, gap=1e-3, gravity=-10.0 * up)
    position, _ = run(sim, 100)
    assert position[-1] - R == pytest.approx(1e-3, rel=1e-9)
    sim, mass = grain(dim, law, gap=3e-3, gravity=-10.0 * up)
    position, _ = run(sim, 100)
    assert position[-1] - R == pytest.approx(0.0, abs=1e-9 * R)
    shifted = cn.UnilateralContact(mu=0.3, shift=-2e-3, recovers=1)
    sim, mass = grain(dim, shifted, gap=3e-3, gravity=-10.0 * up)
    position, _ = run(sim, 100)
    assert position[-1] - R == pytest.approx(2e-3, rel=1e-9)


@EACH_SOLVER
@DIMENSIONS
def test_coupled_motion_moves_two_as_one(dim, solver):
    """A push on one moves both, by F/(m1 + m2); along the normal alone it lets them slide past each other."""
    for normal, tangential in ((1, 1), (1, 0), (0, 1)):
        scene = cn.Scene(dim)
        along, up = np.eye(dim)[0], np.eye(dim)[-1]
        turning = dict(driven=("w",) if dim == 2 else ("wx", "wy", "wz"))
        make = cn.disks if dim == 2 else cn.spheres
        scene.add(make([0 * up], R, BASE, **turning))
        scene.add(make([(2 * R + 5e-4) * up], R, STONE, force=(*(3.0 * along + 7.0 * up), *[0.0] * (2 * dim - 3)), **turning))
        scene.interact(STONE, BASE, cn.CoupledMotion(normal=normal, tangential=tangential, reach=1e-3))
        sim = cn.Simulation(scene, 1e-4, cn.NSCD(solver=solver))
        run(sim, 10)
        one, other = sim.bodies.velocity[:, [0, dim - 1]]
        mass, time = sim.bodies.mass[0], sim.time
        slides, pulls = 3.0 * time / mass, 7.0 * time / mass
        assert other[0] == pytest.approx(slides / (2 if tangential else 1), rel=1e-3)
        assert other[1] == pytest.approx(pulls / (2 if normal else 1), rel=1e-3)
        assert (one == pytest.approx(other, rel=1e-3)) == bool(normal and tangential)


@EACH_SOLVER
@DIMENSIONS
def test_a_stop_ends_a_slide(dim, solver):
    up, along = np.eye(dim)[-1], np.eye(dim)[0]
    sim, mass = grain(dim, cn.LimitedSlip(mu=0.2, limit=1e-3), gravity=-10.0 * up, velocity=0.2 * along, theta=1.0, solver=solver)
    position, velocity = run(sim, 30)
    step = 0.2 * 1e-3
    assert 1e-3 - step < position[0] < 1e-3
    assert abs(velocity[0]) < 1e-12


@DIMENSIONS
def test_what_flies_past_slides_on_nothing(dim):
    """A grain 2 mm above a floor that detection sees lost a third of its speed, and more where all moved along."""
    along = np.eye(dim)[0]
    for margin in (None, 5e-3):
        sim, _ = grain(dim, cn.LimitedSlip(mu=0.2, limit=1e-3), gap=2e-3, velocity=0.5 * along, margin=margin)
        position, velocity = run(sim, 30)
        assert velocity[0] == 0.5
        assert position[0] == pytest.approx(0.5 * 30 * sim.dt, rel=1e-12)


@DIMENSIONS
@pytest.mark.parametrize("law", [cn.UnilateralContact(mu=0.3, shift=-2e-2), cn.UnilateralContact(mu=0.3, shift=-2e-2, recovers=1),
                                 cn.GapRescue(mu=0.3, tolerance=2e-2)])  # fmt: skip
def test_a_law_that_begins_before_the_touch_is_seen_in_time(law, dim):
    """Half of the way was gone before detection saw the pair, which was thrown up then at 25 m/s or stayed below."""
    up = np.eye(dim)[-1]
    sim, _ = grain(dim, law, gap=2.05e-2, gravity=-10.0 * up, dt=1e-4, margin=None)
    fastest = 0.0
    for _ in range(400):
        sim.step()
        fastest = max(fastest, np.abs(sim.bodies.velocity).max())
    assert sim.bodies.position[-1][-1] == pytest.approx(R + 2e-2, abs=1e-3 * R)
    assert fastest < 0.12


@pytest.mark.parametrize("turns", [0.0, 1.0, -0.5])
def test_a_slide_turns_about_the_normal_with_its_bodies(turns):
    """Who spins with both spheres sees one go by v t whatever the spin: a slide that stayed in space stopped after 0.73 of it."""
    v, limit, h = 1e-3, 4e-5, 1e-4
    w = 20 * np.pi * turns
    scene = cn.Scene(3)
    pressed = [[1e-3, 0, 0, 0, 0, 0], [-1e-3, 0, 0, 0, 0, 0]]
    scene.add(cn.spheres([[0, 0, 0], [0.1, 0, 0]], 0.05, STONE, velocity=[[0, 0, 0, w, 0, 0], [0, v, 0, w, 0, 0]], force=pressed))
    scene.interact(STONE, STONE, cn.LimitedSlip(mu=0.0, limit=limit))
    sim, steps = cn.Simulation(scene, h, cn.NSCD(solver=cn.NLGS(tol=1e-10))), 0
    while sim.bodies.velocity[1, 1] > 0.999 * v:
        sim.step()
        steps += 1
    assert abs(steps - limit / (v * h)) < 3


@EACH_SOLVER
@DIMENSIONS
def test_a_coating_holds_to_its_strength(dim, solver):
    """At rest F/k beyond its rest gap; torn off by more than its strength."""
    k, strength, rest, up = 1e5, 50.0, 1e-4, np.eye(dim)[-1]
    law = cn.BrittleCoating(mu=0.3, stiffness=k, strength=strength, rest=rest, reach=5e-3)
    for share in (0.9, 1.1):

        def force(t, share=share):
            return (*(share * strength * min(1.0, t / 2.0) * up), *[0.0] * (2 * dim - 3))

        sim, mass = grain(dim, law, gap=rest, force=force, theta=1.0, solver=solver, dt=1e-2)
        position, velocity = run(sim, 450)
        if share < 1:
            assert position[-1] - R == pytest.approx(rest + share * strength / k, rel=1e-6)
        else:
            assert position[-1] - R > 5e-3


@DIMENSIONS
def test_gap_rescue_lifts_what_is_sunk(dim):
    """One of T steps' spring at its bound brings an overlap to the tolerance in one step; three times slower, bit by bit."""
    bound, depth = 2 * np.sqrt(2) * np.pi, 1e-3
    sim, _ = grain(dim, cn.GapRescue(mu=0.3, period=bound), gap=-depth, theta=1.0)
    position, _ = run(sim, 1)
    assert R - position[-1] == pytest.approx(0.0, abs=1e-12 * R)
    sim, _ = grain(dim, cn.GapRescue(mu=0.3, period=3 * bound), gap=-depth, theta=1.0)
    position, _ = run(sim, 1)
    assert R - position[-1] == pytest.approx(depth * (1 - 1 / 9), rel=1e-9)
