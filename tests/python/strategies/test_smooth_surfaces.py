"""Grains on surfaces of triangles in smooth scenes, each with an answer in closed form or with another scene's to the digit."""

import cairn as cn
import numpy as np
import pytest

STONE = cn.Material("stone", density=2500.0)
R, G = 0.01, 9.81
ALL = ("vx", "vy", "vz", "wx", "wy", "wz")
WEIGHT = 2500 * 4 / 3 * np.pi * R**3 * G


def sheet(n, half=0.05, height=lambda x, y: 0 * x, centre=(0.0, 0.0, 0.0), **options):
    """A surface of 2 n^2 triangles over a square."""
    at = np.linspace(-half, half, n + 1)
    x, y = np.meshgrid(at, at, indexing="ij")
    points = np.stack([x, y, height(x, y)], -1).reshape(-1, 3) + centre
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    cells = [np.stack([corner, corner + n + 1, corner + n + 2], 1), np.stack([corner, corner + n + 2, corner + 1], 1)]
    return cn.surface(points, np.concatenate(cells), STONE, **options)


def simulation(bodies, law, dt=1e-4, gravity=(0, 0, -G), **options):
    scene = cn.Scene(3, gravity=gravity, **options)
    scene.add(*bodies)
    scene.interact("*", "*", law)
    return cn.Simulation(scene, dt, cn.SmoothDEM(), overlap="ignore")


def advance(sim, steps):
    for _ in range(steps):
        sim.step()
    return sim


def state(sim):
    return np.concatenate([sim.bodies.position[0], sim.bodies.velocity[0]])


@pytest.mark.parametrize("form", ["constant_torque", "spring_dashpot"])
@pytest.mark.parametrize("n", [1, 40])
def test_rolling_resistance_over_seams(form, n):
    """A rolling sphere loses 5/7 mu_r g, on two triangles and over sixteen rows of them."""
    law = cn.granular("hooke", stiffness=1e5, restitution=0.5, mu=0.8, rolling=form, rolling_mu=0.05)
    v = 0.5
    ball = cn.spheres([[-0.04, -0.013, R - WEIGHT / 1e5]], R, STONE, velocity=[[v, 0, 0, 0, v / R, 0]])
    sim = advance(simulation([ball, sheet(n)], law, dt=2e-5), 500)
    start = sim.bodies.velocity[0, 0]
    advance(sim, 4000)
    assert (start - sim.bodies.velocity[0, 0]) / 0.08 == pytest.approx(5 / 7 * 0.05 * G, rel=1e-3)
    assert sim.bodies.velocity[0, 4] * R == pytest.approx(sim.bodies.velocity[0, 0], rel=1e-3)


@pytest.mark.parametrize("n", [1, 3, 30])
def test_adhesion_pulls_from_triangles_as_from_a_plane(n):
    """Pull-off of JKR, 1.5 pi w R, over a face, an edge and many triangles that the neck covers."""
    work = 0.2
    law = cn.JKR(young=1e7, poisson=0.3, work=work, restitution=0.9, mu=0.5)
    x = {1: 0.011, 3: 0.05 / 3, 30: 0.0123}[n]
    pull, dt = 2e-3, 2e-5
    most = []
    for floor in (cn.wall((0, 0, 0), (0, 0, 1), STONE), sheet(n)):
        ball = cn.spheres([[x, 0.004, 0.999 * R]], R, STONE, driven=ALL, drive=[(0, 0, pull, 0, 0, 0)])
        sim = simulation([ball, floor], law, dt=dt, gravity=(0, 0, 0))
        forces = []
        for _ in range(2500):
            sim.step()
            forces.append(sim.bodies.contact_force[0, 2])
        most.append(-min(forces))
        assert forces[-1] == 0
    assert most[0] == pytest.approx(1.5 * np.pi * work * R, rel=2e-3)
    assert most[1] == pytest.approx(most[0], rel=1e-9)


def test_a_clump_slides_over_seams_as_on_a_plane():
    """A clump of three spheres slows down at mu g, the same over forty rows of triangles as on a plane."""
    law = cn.LinearSpring(stiffness=1e5, restitution=0.3, mu=0.2)
    ends = []
    for floor in (cn.wall((0, 0, 0), (0, 0, 1), STONE), sheet(40)):
        corner = 2 * R * np.array([[np.cos(a), np.sin(a), 0] for a in 2 * np.pi / 3 * np.arange(3)])
        clump = cn.clumps(
            [[-0.02, 0.003, R - 0.1 * G / 3e5]], corner, [R] * 3, 0.1, (2e-5, 2e-5, 4e-5), STONE, velocity=[[0.5, 0, 0, 0, 0, 0]]
        )
        sim = advance(simulation([clump, floor], law, dt=2e-5), 2000)
        ends.append(state(sim))
    assert ends[0][3] == pytest.approx(0.5 - 0.2 * G * 0.04, rel=5e-3)
    assert np.allclose(ends[1], ends[0], rtol=1e-8, atol=1e-9)


def body_on(make):
    return {
        "capsule": lambda z: cn.capsules([[0.001, 0.002, z]], R, R, STONE, rotation=[[np.sqrt(0.5), 0, np.sqrt(0.5), 0]]),
        "box": lambda z: cn.boxes([[0.001, 0.002, z]], 2 * R, STONE),
        "ball": lambda z: cn.superquadrics([[0.001, 0.002, z]], (R, R, R), (1.0, 1.0), STONE),
    }[make]


@pytest.mark.parametrize("make", ["capsule", "box", "ball"])
@pytest.mark.parametrize("n", [1, 8])
def test_bodies_of_other_shapes_rest_with_their_weight(make, n):
    law = cn.LinearSpring(stiffness=1e4, restitution=0.1)
    sim = advance(simulation([body_on(make)(1.0001 * R), sheet(n)], law, dt=5e-5), 6000)
    weight = sim.bodies.mass[0] * G
    assert sim.bodies.contact_force[0, 2] == pytest.approx(weight, rel=1e-3)
    assert np.abs(sim.bodies.contact_force[0, :2]).max() < 1e-3 * weight
    assert np.abs(sim.bodies.velocity[0]).max() < 1e-3


def test_a_ball_in_a_valley_of_triangles_rests_on_both_sides():
    """Two faces at 45 degrees bear weight/sqrt(2) each."""
    ball = cn.spheres([[0, 0.0017, np.sqrt(2) * R]], R, STONE)
    sim = simulation([ball, sheet(8, height=lambda x, y: np.abs(x))], cn.LinearSpring(stiffness=1e5, restitution=0.2), dt=2e-5)
    advance(sim, 10000)
    assert len(sim.contacts) == 2
    assert np.allclose(sim.contacts.force[:, 2], WEIGHT / 2, rtol=1e-3)
    assert np.allclose(np.linalg.norm(sim.contacts.force, axis=1), WEIGHT / np.sqrt(2), rtol=1e-3)


def test_a_surface_that_turns_far_away_is_one_at_the_origin():
    """Triangles are sought in the axes of their body: where it is, and how it is turned, changes a rebound by rounding."""
    ends = []
    for centre, spin in (((0.0, 0.0, 0.0), 0.0), ((700.0, -300.0, 200.0), 0.0), ((0.0, 0.0, 0.0), 3.0)):
        floor = sheet(40, centre=centre, velocity=(0, 0, 0, 0, 0, spin))
        x = np.array([[0.0123, 0.007, 1.001 * R]]) + centre
        sim = simulation([cn.spheres(x, R, STONE, velocity=[[0.3, 0.1, -1, 0, 0, 0]]), floor], cn.LinearSpring(stiffness=1e5))
        advance(sim, 200)
        ends.append(state(sim) - np.r_[centre, np.zeros(6)])
        assert sim.bodies.velocity[0, 2] > 0.5
    assert np.allclose(ends[1], ends[0], rtol=0, atol=1e-9)
    assert np.allclose(ends[2], ends[0], rtol=0, atol=1e-9)  # without friction


def turning_drum(skin=None, threads=1):
    """Grains in a closed drum of triangles that turns, with rolling resistance and adhesion."""
    angle = 2 * np.pi * np.arange(24) / 24
    ring = 0.05 * np.stack([np.cos(angle), np.zeros(24), np.sin(angle)], -1)
    points = np.concatenate([ring - [0, 0.03, 0], ring + [0, 0.03, 0], [[0, -0.03, 0], [0, 0.03, 0]]])
    k, after = np.arange(24), (np.arange(24) + 1) % 24
    cells = [np.stack(c, 1) for c in ([k, after, k + 24], [after, after + 24, k + 24])]
    cells += [np.stack([np.full(24, 48), k, after], 1)[:, ::-1], np.stack([np.full(24, 49), k + 24, after + 24], 1)]
    drum = cn.surface(points, np.concatenate(cells), STONE, velocity=(0, 0, 0, 0, 6.0, 0))
    grid = np.stack(np.meshgrid(np.arange(5), np.arange(4), np.arange(5), indexing="ij"), -1).reshape(-1, 3)
    x = (grid - [2, 1.5, 2]) * 0.0125 + 1e-4 * np.random.default_rng(2).random(grid.shape)
    scene = cn.Scene(3, gravity=(0, 0, -G))
    scene.add(cn.spheres(x, 0.006, STONE), drum)
    law = cn.granular("jkr", young=1e7, poisson=0.3, work=0.05, restitution=0.5, mu=0.5, rolling="spring_dashpot", rolling_mu=0.1)
    scene.interact("*", "*", law)
    return cn.Simulation(scene, 2e-5, cn.SmoothDEM(skin=skin, threads=threads), overlap="ignore")


def same(one, other, of=("position", "rotation", "velocity", "contact_force")):
    return all(np.array_equal(getattr(one.bodies, name), getattr(other.bodies, name)) for name in of)


def test_a_turning_drum_goes_on_from_a_checkpoint_with_any_list(tmp_path):
    """The same bits for other skins, and after a restart; grains stay inside."""
    whole, narrow, second = turning_drum(), turning_drum(skin=3e-4), turning_drum()
    advance(whole, 1500)
    whole.checkpoint(tmp_path / "half.h5")
    second.restore(tmp_path / "half.h5")
    for sim, steps in ((whole, 1500), (second, 1500), (narrow, 3000)):
        advance(sim, steps)
    assert whole.info["contacts"] > 50
    assert narrow.info["neighbour_lists"] > 1.5 * whole.info["neighbour_lists"]
    assert same(whole, second) and same(whole, narrow)
    x = whole.bodies.position[:100]
    assert np.hypot(x[:, 0], x[:, 2]).max() < 0.05 and np.abs(x[:, 1]).max() < 0.03


def test_a_surface_that_grows_is_found_where_it_is():
    """Its triangles move away from its centre; the ball rises with them."""
    half = 0.05
    points = half * np.array([[-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1], [-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1]])
    cells = [[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6], [0, 5, 1], [0, 4, 5], [1, 6, 2], [1, 5, 6], [2, 7, 3], [2, 6, 7]]
    block = cn.surface(points, [*cells, [3, 4, 0], [3, 7, 4]], STONE, mass=1.0, inertia=(1.0, 1.0, 1.0))
    ball = cn.spheres([[0.003, 0.011, half + R]], R, STONE)
    sim = simulation([ball, block], cn.LinearSpring(stiffness=1e4, restitution=0.2), dt=1e-4)
    sim.grow([1], 1.0)
    advance(sim, 3000)
    assert sim.bodies.position[0, 2] == pytest.approx(half * np.exp(0.3) + R, abs=0.05 * R)


def test_grains_that_come_in_meet_triangles_that_were_there():
    """Bodies added, taken out and numbered anew during a run: each rests on the surface with its weight."""
    law = cn.LinearSpring(stiffness=1e4, restitution=0.1)
    sim = simulation([cn.spheres([[0.02, 0.02, R]], R, STONE), sheet(12)], law, dt=5e-5)
    advance(sim, 500)
    for x in (-0.03, 0.0, 0.03):
        sim.add(cn.spheres([[x, -0.02, 1.01 * R]], R, STONE))
        advance(sim, 500)
    sim.remove([0])
    advance(sim, 4000)
    ball = sim.bodies.mass < 1
    assert np.count_nonzero(ball) == 3
    assert np.allclose(sim.bodies.contact_force[ball, 2], WEIGHT, rtol=1e-3)


@pytest.mark.parametrize("rolling", [False, True])
@pytest.mark.parametrize("dim", [2, 3])
def test_sums_of_forces_do_not_depend_on_the_age_of_the_list(dim, rolling):
    """Grains that touch many others: their pairs lie in other batches of another list, and add up in the same order."""
    n = {2: 16, 3: 7}[dim]
    place = np.stack(np.meshgrid(*[np.arange(n)] * dim, indexing="ij"), -1).reshape(-1, dim)
    x = 1.9 * R * place + 0.05 * R * np.random.default_rng(dim).random(place.shape)
    make = cn.disks if dim == 2 else cn.spheres
    more = {"rolling": "spring_dashpot", "rolling_mu": 0.1} if rolling else {}
    law = cn.granular("hooke", stiffness=1e4, restitution=0.5, mu=0.5, **more)
    runs = []
    for skin in (1e-4, 3e-3):
        scene = cn.Scene(dim)
        scene.add(make(x, R, STONE))
        scene.interact("*", "*", law)
        runs.append(advance(cn.Simulation(scene, 5e-5, cn.SmoothDEM(skin=skin), overlap="ignore"), 300))
    assert runs[0].info["neighbour_lists"] > runs[1].info["neighbour_lists"]
    assert same(*runs, of=("position", "velocity", "contact_force"))


@pytest.mark.parametrize("tip", ["ridge", "apex"])
def test_a_ball_over_a_convex_edge_and_a_tip_is_borne_by_the_nearest_point(tip):
    """Driven across, over faces at 45 degrees, at a depth of a hundredth of its radius over the edge or the tip."""
    stiffness, depth, speed, dt = 1e4, 0.01 * R, 1.0, 2e-6
    height = (lambda x, y: -np.abs(x)) if tip == "ridge" else (lambda x, y: -np.maximum(np.abs(x), np.abs(y)))
    start = np.array([-0.004, 0.0011 if tip == "ridge" else 0.0, R - depth])
    drive = [(speed, 0, 0, 0, 0, 0)]
    ball = cn.spheres([start], R, STONE, driven=ALL, drive=drive)
    sim = simulation([ball, sheet(8, height=height)], cn.LinearSpring(stiffness=stiffness), dt=dt, gravity=(0, 0, 0))
    seen = []
    for _ in range(4000):
        sim.step()
        seen.append((sim.bodies.position[0, 0], np.linalg.norm(sim.bodies.contact_force[0, :3])))
        assert sim.info["contacts"] <= 1
    x, force = np.array(seen).T
    expected = stiffness * np.maximum(R - np.hypot(x, R - depth), 0)  # the nearest point stays on the edge or the tip
    assert np.count_nonzero(expected) > 1000
    assert np.allclose(force, expected, rtol=1e-2, atol=1e-3 * stiffness * depth)
