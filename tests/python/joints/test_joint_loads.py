"""Loads of joints: the first pull, heavy loads on light links, reactions at the root of a beam."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=1000.0)
HELD = [("Cable", 2), ("Cable", 3), ("Limit", 2), ("Limit", 3)]  # by an end of a coordinate, in place of a blocked component


def put(dim, x, z):
    return (x, z) if dim == 2 else (x, 0.0, z)


def swinging(kind, dim, dt, speed=3.0):
    """A ball swings a metre below its joint."""
    scene = cn.Scene(dim, gravity=put(dim, 0.0, -9.81))
    turns = kind not in ("Distance", "Cable", "Limit")
    velocity = [speed, 0.0, speed * turns] if dim == 2 else [speed, 0, 0, 0, -speed * turns, 0]
    make = cn.disks if dim == 2 else cn.spheres
    body = scene.add(make([put(dim, 0.0, -1.0)], 0.05, ROCK, velocity=[velocity]))[0]
    scene.interact("*", "*", None)
    above = put(dim, 0.0, 0.0)
    joint = {
        "Distance": lambda: cn.Distance(points=[put(dim, 0.0, -1.0), above]),
        "Pivot": lambda: cn.Pivot(point=above),
        "Ball": lambda: cn.Ball(point=above),
        "Hinge": lambda: cn.Hinge(point=above, axis=(0, 1, 0)),
        "Limit": lambda: cn.Distance(points=[put(dim, 0.0, -1.0), above], limits=(0.1, 1.0)),
        "Cable": lambda: cn.Cable(points=[put(dim, 0.0, -1.0), above, put(dim, 0.5, 0.0)]),
    }[kind]()
    scene.join(body, None, joint)
    return cn.Simulation(scene, dt)


def pulls(sim, steps):
    out = []
    for _ in range(steps):
        sim.step()
        out.append(np.linalg.norm(sim.contacts.impulse[0]) / sim.dt / sim.bodies.mass[0])
    return np.array(out)


@pytest.mark.parametrize("dt", [1e-2, 1e-3, 1e-4])
@pytest.mark.parametrize("kind, dim", [("Distance", 2), ("Pivot", 2), ("Distance", 3), ("Ball", 3), ("Hinge", 3), *HELD])
def test_the_first_pull_is_that_of_the_motion(kind, dim, dt):
    """It is v^2/l + g, less 3 g (1 - cos) of the angle that the body has risen by."""
    found = pulls(swinging(kind, dim, dt), 4) / (9.0 + 9.81)
    angle = 3.0 * dt * (np.arange(4) + 0.5)
    assert found == pytest.approx(1 - 1.5 * 9.81 / 18.81 * angle**2, abs=2e-3 if dt > 1e-3 else 2e-4)


@pytest.mark.parametrize("kind, dim", [("Distance", 2), ("Ball", 3), *HELD])
def test_a_change_of_the_step_pulls_at_nothing(kind, dim):
    sim = swinging(kind, dim, 1e-3)
    before = pulls(sim, 5)
    sim.dt = 5e-3
    after = pulls(sim, 4)
    sim.dt = 1e-3
    assert np.concatenate((before, after, pulls(sim, 3))) == pytest.approx(18.81, rel=1e-2)


@pytest.mark.parametrize("kind, dim", [("Distance", 2), ("Ball", 3)])
def test_a_restart_goes_on_to_the_same_bits(kind, dim, tmp_path):
    """Before the first step, and where bodies are seated already."""
    for steps in (0, 5):
        sim, again = swinging(kind, dim, 1e-2), swinging(kind, dim, 1e-2)
        for _ in range(steps):
            sim.step()
        sim.checkpoint(tmp_path / f"{steps}.h5")
        again.restore(tmp_path / f"{steps}.h5")
        assert np.array_equal(pulls(again, 5), pulls(sim, 5))
        assert np.array_equal(again.bodies.position, sim.bodies.position)


@pytest.mark.parametrize("dim", [2, 3])
def test_what_is_joined_in_a_run_is_pulled_at_once(dim):
    scene = cn.Scene(dim, gravity=put(dim, 0.0, 0.0))
    make = cn.disks if dim == 2 else cn.spheres
    velocity = [put(dim, v, 0.0) + (0.0,) * (2 * dim - 3) for v in (1.0, -1.0)]
    ids = scene.add(make([put(dim, 0.0, -0.5), put(dim, 0.0, 0.5)], 0.05, ROCK, velocity=velocity))
    scene.interact("*", "*", None)
    sim = cn.Simulation(scene, 1e-2)
    sim.step()
    sim.bodies.set(position=[put(dim, 0.0, -0.5), put(dim, 0.0, 0.5)])
    sim.join(ids[0], ids[1], cn.Distance(points=[put(dim, 0.0, -0.5), put(dim, 0.0, 0.5)]))
    assert pulls(sim, 4) == pytest.approx(2.0, rel=1e-3)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_rope_between_two_that_swing_pulls_at_once(dim):
    """Two equal weights swing at either end of a rope over a pulley: both balance, at any step."""
    scene = cn.Scene(dim, gravity=put(dim, 0.0, -9.81))
    make = cn.disks if dim == 2 else cn.spheres
    cosine = 1.01**-0.5  # of the rope against the vertical
    velocity = [put(dim, 3.0 * v * cosine, -0.3 * cosine) + (0.0,) * (2 * dim - 3) for v in (1.0, -1.0)]
    ids = scene.add(make([put(dim, 0.0, -1.0), put(dim, 0.2, -1.0)], 0.05, ROCK, velocity=velocity))
    scene.interact("*", "*", None)
    scene.join(*ids, cn.Cable(points=[put(dim, 0.0, -1.0), put(dim, 0.1, 0.0), put(dim, 0.2, -1.0)]))
    sim = cn.Simulation(scene, 1e-3)
    assert pulls(sim, 5) == pytest.approx(9.0 * cosine + 9.81 * cosine, rel=2e-3)


def test_what_rests_is_left_where_it_is():
    """Joints that hold as they come in are moved by nothing."""
    sim = swinging("Pivot", 2, 1e-2, speed=0.0)
    sim.step()
    assert sim.energy["work_projection"] == 0
    assert abs(sim.bodies.position[0] - (0.0, -1.0)).max() < 1e-15


def hanging(dim, weight, joint, n=10, density=1000.0):
    """Links between two fixed points, a load of so many times a link's weight in the middle, as they hang in a V."""
    length, width, rock = 0.11, 0.02, cn.Material("rock", density=density)
    drop = np.sqrt((n * length / 2) ** 2 - (n / 20) ** 2)
    knots = [(0.1 * k, -drop * (1 - abs(k - n / 2) / (n / 2))) for k in range(n + 1)]
    scene = cn.Scene(dim, gravity=put(dim, 0.0, -9.81))
    link = density * length * width * (1 if dim == 2 else width)
    make, r = (cn.disks if dim == 2 else cn.spheres), 0.02
    ball = np.pi * r**2 if dim == 2 else 4 / 3 * np.pi * r**3
    scene.interact("*", "*", None)

    def load(k, times=weight):
        return scene.add(make([put(dim, *knots[k])], r, rock, density=times * link / ball, damping=20.0))[0]

    if joint is cn.Distance:  # knots of the mass of links, on bars without any
        ids = [load(k, weight if k == n // 2 else 1.0) for k in range(1, n)]
        for a, b, k in zip([ids[0], *ids[1:], ids[-1]], [None, *ids[:-1], None], [0, *range(1, n - 1), n - 1]):
            ends = (k + 1, k) if k < n - 1 or b is not None else (n - 1, n)
            scene.join(a, b, cn.Distance(points=[put(dim, *knots[e]) for e in ends]))
        return scene
    ids = []
    for (xa, za), (xb, zb) in zip(knots[:-1], knots[1:]):
        turn = np.arctan2(zb - za, xb - xa)
        middle = put(dim, (xa + xb) / 2, (za + zb) / 2)
        if dim == 2:
            box = np.array([[-length, -width], [length, -width], [length, width], [-length, width]]) / 2
            ids.append(scene.add(cn.polygons([box], rock, position=[middle], rotation=[turn], damping=20.0))[0])
        else:
            q = [np.cos(turn / 2), 0, -np.sin(turn / 2), 0]
            ids.append(scene.add(cn.boxes([middle], (length, width, width), rock, rotation=[q], damping=20.0))[0])
    about = {"axis": (0, 1, 0)} if joint is cn.Hinge else {}

    def made(k):
        return joint(point=put(dim, *knots[k]), **about)

    for k, (a, b) in enumerate(zip([ids[0], *ids[:-1], ids[-1]], [None, *ids[1:], None])):
        scene.join(a, b, made(k))
    scene.join(load(n // 2), ids[n // 2 - 1], made(n // 2))
    return scene


@pytest.mark.parametrize("dim, joint", [(2, cn.Pivot), (3, cn.Ball), (2, cn.Distance)])
def test_units_leave_the_bits_of_heavy_loads(dim, joint):
    ends = []
    for density in (1000.0, 2000.0):
        sim = cn.Simulation(hanging(dim, 1e6, joint, density=density), 2e-3)
        for _ in range(10):
            sim.step()
        ends.append((sim.bodies.position, sim.bodies.velocity))
    for one, other in zip(*ends):
        assert np.array_equal(one, other)


@pytest.mark.parametrize("weight", [1e6, 1e9])
@pytest.mark.parametrize("dim, joint", [(2, cn.Pivot), (3, cn.Ball), (3, cn.Hinge), (2, cn.Distance), (3, cn.Distance)])
def test_light_links_carry_a_heavy_load(dim, joint, weight):
    sim = cn.Simulation(hanging(dim, weight, joint), 2e-3)
    start = sim.bodies.position.copy()
    bad = sum(sim.step()["status"] != "converged" for _ in range(150))
    assert np.abs(sim.bodies.position - start).max() < 2e-3 * 1.1
    assert np.abs(sim.bodies.velocity[:, :dim]).max() < 0.01
    assert bad <= 4  # what light_error tells of: masses differ by 9 digits


@pytest.mark.parametrize("mass", [1.0, 100.0, 1e4])
def test_the_root_of_a_beam_bears_its_moment(mass, n=8, dt=1 / 60):
    light, heavy = cn.Material("light", density=1.0), cn.Material("heavy", density=mass)
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    at = [[k, 0, 0] for k in range(n)]
    ids = [*scene.add(cn.boxes(at[:-1], 1.0, light)), *scene.add(cn.boxes(at[-1:], 1.0, heavy))]
    scene.interact("*", "*", None)
    scene.join(ids[0], None, cn.Fixed(point=(-0.5, 0, 0)))
    for k in range(1, n):
        scene.join(ids[k], ids[k - 1], cn.Fixed(point=(k - 0.5, 0, 0)))
    sim = cn.Simulation(scene, dt)
    force, moment = 9.81 * (n - 1 + mass), 9.81 * (sum(range(n - 1)) + (n - 1) / 2 + mass * (n - 0.5))
    for _ in range(60):
        assert sim.step()["status"] == "converged"
        root = [i for i, pair in enumerate(sim.contacts.bodies) if ids[0] in pair and ids[1] not in pair][0]
        assert abs(sim.contacts.impulse[root][2]) / dt == pytest.approx(force, rel=1e-2)
        assert np.abs(sim.contacts.moment[root]).max() / dt == pytest.approx(moment, rel=1e-2)


def test_carpenter_bears_a_beam(n=6, dt=1 / 60):
    """Moments of the last step are no loads of the next."""
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    square = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    ids = [scene.add(cn.polygons([square], ROCK, position=[(k, 0.0)]))[0] for k in range(n)]
    scene.interact("*", "*", None)
    scene.join(ids[0], None, cn.Fixed(point=(-0.5, 0.0)))
    for k in range(1, n):
        scene.join(ids[k], ids[k - 1], cn.Fixed(point=(k - 0.5, 0.0)))
    sim = cn.Simulation(scene, dt, cn.Carpenter())
    for _ in range(8):
        sim.step()
        root = [k for k, pair in enumerate(sim.contacts.bodies) if ids[0] in pair and ids[1] not in pair][0]
        force, moment = sim.contacts.impulse[root] / dt, sim.contacts.moment[root] / dt
        assert np.linalg.norm(force) == pytest.approx(n * 9810.0, rel=1e-3)
        assert abs(moment[-1] if np.ndim(moment) else moment) == pytest.approx(n * n / 2 * 9810.0, rel=1e-3)
    assert np.abs(sim.bodies.velocity).max() < 1e-4


@pytest.mark.parametrize("kind, dim", [("Distance", 2), ("Pivot", 2), ("Distance", 3), ("Ball", 3), ("Hinge", 3), *HELD])
def test_carpenter_holds_what_swings(kind, dim):
    """The distance of the marks of a joint is no gap."""
    scene, dt = swinging(kind, dim, 1e-3).scene, 1e-3
    sim = cn.Simulation(scene, dt, cn.Carpenter())
    for _ in range(300):
        sim.step()
        assert abs(np.linalg.norm(sim.bodies.position[0]) - 1) < 2e-5
