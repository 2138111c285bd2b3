"""Event-driven dynamics: a ball that bounces and comes to rest, a gas of hard disks, three balls that collapse, refusals."""

import warnings

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=1.0)


def moved(scene, dt, law, **options):
    scene.interact(ROCK, ROCK, law)
    return cn.Simulation(scene, dt=dt, strategy=cn.EventDriven(**options))


def ball(restitution, dt, dim=2, **options):
    """A ball whose lowest point is 1 m above a floor."""
    scene = cn.Scene(dim=dim, gravity=(0, -9.81, 0)[:dim])
    up = (0, 1, 0)[:dim]
    scene.add((cn.disks if dim == 2 else cn.spheres)([1.1 * np.array(up)], 0.1, ROCK))
    scene.add(cn.wall(np.zeros(dim), up, ROCK))
    return moved(scene, dt, cn.Restitution(normal=restitution), **options)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("dt", [0.02, 0.3])
def test_a_ball_bounces_at_the_times_of_its_parabolas(dim, dt):
    """Place and speed after the eleventh impact to 1e-11, whatever the step; each impact leaves e of the speed."""
    sim = ball(0.8, dt, dim)
    fall, speed = np.sqrt(2 / 9.81), np.sqrt(2 * 9.81)
    known = fall + 2 * fall * np.cumsum([0, *0.8 ** np.arange(1, 41)])
    assert known[[0, 1, 2, 5, 10]] == pytest.approx([0.451524, 1.173961, 1.751912, 2.880071, 3.675857], abs=6e-7)
    count = 0
    while count < 11:
        count += sim.step()["events"]
    flown = sim.time - known[count - 1]
    left = 0.8**count * speed
    assert sim.bodies.velocity[0, 1] == pytest.approx(left - 9.81 * flown, abs=1e-11)
    assert sim.bodies.position[0, 1] == pytest.approx(0.1 + left * flown - 0.5 * 9.81 * flown**2, abs=1e-11)
    mass = sim.bodies.mass[0]
    assert sim.energy["dissipated_normal"] == pytest.approx(mass * 9.81 * (1 - 0.8 ** (2 * count)), rel=1e-11)
    assert abs(sim.energy["closure"]) < 1e-12 * sim.energy["in_play"]


def test_impacts_that_accumulate_end_in_rest():
    """The last of infinitely many is at sqrt(2 H/g) (1 + e)/(1 - e) = 4.0637 s; then NSCD makes the steps, and says so."""
    sim, dt, last = ball(0.8, 0.05), 0.05, 4.063713
    while sim.time < 5:
        info = sim.step()
        assert (info["persistent"] > 0) == (sim.time > last)
        if sim.time > last:
            assert sim.bodies.position[0, 1] == pytest.approx(0.1, abs=1e-9)
    assert info["persistent"] == pytest.approx(dt)
    assert sim.contacts.impulse[0, 1] == pytest.approx(sim.bodies.mass[0] * 9.81 * dt, rel=1e-6)
    assert abs(sim.energy["closure"]) < 1e-9 * sim.energy["in_play"]


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("restitution", [0.1, 0.3, 0.5, 0.6, 0.7])
@pytest.mark.parametrize("dt", [0.05, 0.17, 0.31])
def test_the_height_between_outputs_is_that_of_the_parabolas(dim, restitution, dt):
    """Also of steps in which the last of all impacts lies: what rests falls no further."""
    sim = ball(restitution, dt, dim)
    while sim.time < 2.5:
        sim.step()
        left, speed, height = sim.time - np.sqrt(2 / 9.81), restitution * np.sqrt(2 * 9.81), 0.0
        if left < 0:
            height = 1 - 9.81 * sim.time**2 / 2
        while left >= 2 * speed / 9.81 > 1e-9:
            left, speed = left - 2 * speed / 9.81, restitution * speed
        if left >= 0 and 2 * speed / 9.81 > 1e-9:
            height = speed * left - 9.81 * left**2 / 2
        assert sim.bodies.position[0, 1] - 0.1 == pytest.approx(height, abs=1e-8)
    assert np.abs(sim.bodies.velocity).max() < 1e-6 or restitution == 0.7


@pytest.mark.parametrize("law", [cn.Coulomb(mu=0.5), cn.Restitution(mu=0.5, normal=0)])
def test_what_rests_is_moved_by_nscd(law):
    """A disk on a slope rolls as it does under NSCD."""
    places = []
    for strategy in (cn.EventDriven(), cn.NSCD(solver=cn.NLGS(tol=1e-10))):
        scene = cn.Scene(dim=2, gravity=(2.0, -9.81))
        scene.add(cn.disks([[0, 0.1]], 0.1, ROCK), cn.wall((0, 0), (0, 1), ROCK))
        scene.interact(ROCK, ROCK, law)
        sim = cn.Simulation(scene, dt=0.01, strategy=strategy)
        for _ in range(50):
            sim.step()
        places.append(sim.bodies.position[0, 0])
    assert places[0] == pytest.approx(places[1], rel=1e-9) and places[0] == pytest.approx(2.0 * 0.25 / 3, rel=0.03)


def gas(n, share, seed=1):
    """n x n disks of diameter 1 that fill `share` of a periodic cell, velocities of mean square 2."""
    random = np.random.default_rng(seed)
    side = n * np.sqrt(np.pi / 4 / share)
    at = np.stack(np.meshgrid(*[(np.arange(n) + 0.5) * side / n] * 2), -1).reshape(-1, 2)
    v = random.normal(size=at.shape)
    v -= v.mean(axis=0)
    v *= np.sqrt(2 / np.mean(np.sum(v**2, axis=1)))
    scene = cn.Scene(dim=2, periodic=cn.Periodic((side, side)))
    heavy = cn.Material("rock", density=4 / np.pi)
    scene.add(cn.disks(at, 0.5, heavy, velocity=np.concatenate([v, 0 * v[:, :1]], 1)))
    scene.interact(heavy, heavy, cn.Restitution(normal=1.0))
    return cn.Simulation(scene, dt=0.05, strategy=cn.EventDriven())


@pytest.mark.parametrize("share, known", [(0.1, 1.2347), (0.3, 2.0645)])
def test_pressure_of_a_gas_of_hard_disks(share, known):
    """p/(n T) = 1 + sum(r sigma)/(N m <v^2> t) within 1 % of the measured one (Enskog: 1 + 2 phi chi)."""
    sim, n = gas(12, share), 144
    energy = 0.5 * np.sum(sim.bodies.velocity**2)
    for _ in range(40):
        sim.step()
    virial, start, events = 0.0, sim.time, 0
    while events < 12000:
        events += sim.step()["events"]
        virial += np.sum(sim.contacts.impulse_local[:, 0])
    chi = (1 - 7 * share / 16) / (1 - share) ** 2
    pressure = 1 + virial / (2 * n * (sim.time - start))
    assert pressure == pytest.approx(known, rel=0.01) and known == pytest.approx(1 + 2 * share * chi, rel=2e-3)
    rate = 2 * events / n / (sim.time - start)
    assert rate == pytest.approx(2 * share * 4 / np.pi * chi * np.sqrt(np.pi), rel=0.03)
    assert 0.5 * np.sum(sim.bodies.velocity**2) == pytest.approx(energy, rel=1e-11)
    assert np.abs(sim.bodies.velocity.sum(axis=0)).max() < 1e-10


def three(restitution):
    scene = cn.Scene(dim=2)
    scene.add(cn.disks([[0, 0], [1.5, 0], [3.0, 0]], 0.5, ROCK, velocity=[[1, 0, 0], [0, 0, 0], [-1, 0, 0]]))
    return moved(scene, 10.0, cn.Restitution(normal=restitution), tol=1e-13)


@pytest.mark.parametrize("restitution, collapses", [(1.0, False), (0.3, False), (0.12, False), (0.06, True)])
def test_three_balls_collapse_below_the_known_restitution(restitution, collapses):
    """Equal balls on a line meet infinitely often in a finite time below e = 7 - 4 sqrt(3) = 0.0718 (Bernu & Mazighi 1990)."""
    scene = cn.Scene(dim=2)
    scene.add(cn.disks([[0, 0], [1.5, 0], [3.1, 0]], 0.5, ROCK, velocity=[[1, 0, 0], [0, 0, 0], [-1, 0, 0]]))
    sim = moved(scene, 100.0, cn.Restitution(normal=restitution))
    momentum = (sim.bodies.mass[:, None] * sim.bodies.velocity).sum(axis=0)
    info = sim.step()
    assert (info["events"] >= 12) == collapses
    assert np.allclose((sim.bodies.mass[:, None] * sim.bodies.velocity).sum(axis=0), momentum, rtol=0, atol=1e-12)
    spread = np.ptp(sim.bodies.velocity[:, 0])
    assert spread < 1e-6 if collapses else spread > 1e-3
    if restitution == 1.0:  # equal balls exchange velocities
        assert sim.bodies.velocity[:, 0] == pytest.approx([-1, 0, 1], abs=1e-12)


def test_impacts_of_one_instant_are_one_problem():
    """Two balls that strike a third from both sides at once leave it where it is; one after the other would not."""
    sim = three(0.5)
    info = sim.step()
    assert info["events"] == 2 and sim.bodies.velocity[:, 0] == pytest.approx([-0.5, 0, 0.5], abs=1e-10)


def test_a_driven_wall_works_and_the_balance_closes():
    scene = cn.Scene(dim=2, gravity=(0, -1.0))
    scene.add(cn.disks([[0, 1.0]], 0.1, ROCK, force=(0.01, 0, 0)))
    scene.add(cn.wall((0, 0), (0, 1), ROCK, velocity=(0, 0.3)))
    sim = moved(scene, 0.05, cn.Restitution(mu=0.2, normal=0.9))
    for _ in range(60):
        info = sim.step()
    assert sim.energy["work_driven"] > 0 and info["persistent"] == 0
    assert abs(sim.energy["closure"]) < 1e-11 * sim.energy["in_play"]


@pytest.mark.parametrize("speed", [1e8, 1e20, 1e100])
def test_a_body_faster_than_all_lengths_ends_its_step(speed):
    """It leaves its surroundings 1e6 and more times in a step where these do not grow."""
    scene = cn.Scene(2)
    rock = cn.Material("rock", density=1000.0)
    scene.add(cn.disks([[0, 0.5]], 0.1, rock, velocity=[[0, -speed, 0]]), cn.wall((0, 0), (0, 1), rock))
    scene.interact("*", "*", cn.Restitution(normal=0.5, mu=0.0))
    sim = cn.Simulation(scene, 1e-3, cn.EventDriven())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that it flies out of the scene is told
        assert sim.step()["events"] == 1
    assert sim.bodies.velocity[0, 1] == pytest.approx(speed / 2)
    assert sim.bodies.position[0, 1] == pytest.approx(speed / 2 * 1e-3, rel=1e-5)


def test_restart_to_the_same_bits(tmp_path):
    one, other = gas(5, 0.3), gas(5, 0.3)
    for _ in range(10):
        one.step()
    one.checkpoint(tmp_path / "half.h5")
    other.restore(tmp_path / "half.h5")
    for sim in (one, other):
        for _ in range(10):
            sim.step()
    assert np.array_equal(one.bodies.position, other.bodies.position) and one.energy == other.energy


def test_what_cannot_fly_is_refused():
    scene = cn.Scene(dim=2)
    scene.add(cn.polygons([[[-1, -1], [1, -1], [0, 1]]], ROCK))
    with pytest.raises(ValueError, match="body 0 is a polygon"):
        moved(scene, 0.1, cn.Restitution()).step()
    scene = cn.Scene(dim=2)
    scene.add(cn.disks([[0, 0]], 0.1, ROCK, damping=1.0))
    with pytest.raises(ValueError, match="body 0 is damped"):
        moved(scene, 0.1, cn.Restitution()).step()
    with pytest.raises(ValueError, match="law LinearSpring is no law of impacts"):
        scene = cn.Scene(dim=2)
        scene.add(cn.disks([[0, 0]], 0.1, ROCK))
        moved(scene, 0.1, cn.LinearSpring(stiffness=1e3))
    with pytest.raises(ValueError, match="did you mean 'impacts'"):
        cn.EventDriven(impact=3)
    with pytest.raises(ValueError, match="impacts is 0"):
        cn.EventDriven(impacts=0)
    sim = ball(0.5, 0.1)
    assert "impacts 100" in sim.explain() and "fly, persist" in sim.explain()
