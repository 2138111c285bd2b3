"""Triangles and other shapes under smooth DEM over ranks: the same bits for every number of them, and the motion without."""

import cairn as cn
import numpy as np
import pytest
from test_smooth_ranks import ROCK, SPRING, digest

ROUGH = cn.HertzMindlin(young=2e7, poisson=0.3, restitution=0.5, mu=0.4)


def grid(dim, n, gap, seed=3):
    places = np.stack(np.meshgrid(*[np.arange(n)] * dim, indexing="ij"), -1).reshape(-1, dim)
    return (places + 0.6) * gap + np.random.default_rng(seed).uniform(-0.02, 0.02, places.shape)


def sheet(n, side, height, **options):
    """A surface of 2 n^2 triangles over a square."""
    at = np.linspace(0, side, n + 1)
    x, y = np.meshgrid(at, at, indexing="ij")
    points = np.stack([x, y, height(x, y)], -1).reshape(-1, 3)
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    cells = [np.stack([corner, corner + n + 1, corner + n + 2], 1), np.stack([corner, corner + n + 2, corner + 1], 1)]
    return cn.surface(points, np.concatenate(cells), ROCK, **options)


def new(dim, law=SPRING):
    made = cn.Scene(dim=dim, gravity=(-3.0,) + (0.0,) * (dim - 2) + (-9.81,))
    made.interact(ROCK, ROCK, law)
    return made


def falling(dim, count):
    return np.tile((-2.0,) + (0.0,) * (dim - 2) + (-6.0,), (count, 1))


def on_hills(law=SPRING):
    """Spheres on a bumpy floor of triangles, between planes."""
    made, x = new(3, law), grid(3, 5, 1.0)
    made.add(sheet(12, 5.6, lambda x, y: 0.15 * np.sin(1.3 * x) * np.cos(1.1 * y)))
    made.add(cn.spheres(x + (0, 0, 0.1), np.random.default_rng(1).uniform(0.42, 0.48, len(x)), ROCK, velocity=falling(3, len(x))))
    for axis in (0, 1):
        made.add(cn.wall(np.zeros(3), np.eye(3)[axis], ROCK), cn.wall(5.6 * np.eye(3)[axis], -np.eye(3)[axis], ROCK))
    return made


def adhesive():
    return on_hills(cn.JKR(young=2e7, poisson=0.3, work=20.0, restitution=0.5, mu=0.4))


def clumps_on_hills():
    """Clumps of two balls, of unequal moments of inertia, on triangles."""
    made, x = new(3), grid(3, 4, 1.0) * (1.05, 0.7, 0.7)
    made.add(sheet(12, 5.6, lambda x, y: 0.15 * np.sin(1.3 * x) * np.cos(1.1 * y)))
    made.add(cn.clumps(x + (0, 0, 0.1), [[-0.2, 0, 0], [0.2, 0, 0]], [0.3, 0.3], 600.0, (20.0, 40.0, 45.0), ROCK,
             velocity=falling(3, len(x))))  # fmt: skip
    return made


def in_a_driven_bowl():
    """Spheres on triangles that turn and rise."""
    made, x = new(3), grid(3, 4, 1.0) + (0, 0, 0.3)
    made.add(sheet(10, 4.4, lambda x, y: 0.05 * ((x - 2.2) ** 2 + (y - 2.2) ** 2)))
    made.add(cn.spheres(x, 0.45, ROCK, velocity=falling(3, len(x))))
    return made


def polygons():
    made, x = new(2), grid(2, 6, 0.95)
    corners = 0.45 * np.array([(np.cos(a), np.sin(a)) for a in 2 * np.pi / 5 * np.arange(5)])
    made.add(cn.polygons([corners + c for c in x], ROCK, velocity=falling(2, len(x))))
    made.add(cn.wall((0, 0), (0, 1), ROCK), cn.wall((0, 0), (1, 0), ROCK))
    return made


def boxes():
    made, x = new(3, ROUGH), grid(3, 4, 1.0)
    made.add(cn.boxes(x, [0.85, 0.8, 0.75], ROCK, velocity=falling(3, len(x))))
    for axis in range(3):
        made.add(cn.wall(np.zeros(3), np.eye(3)[axis], ROCK))
    return made


def capsules():
    made, x = new(3), grid(3, 4, 1.1)
    made.add(cn.capsules(x, 0.5, 0.25, ROCK, velocity=falling(3, len(x))))
    made.add(cn.spheres(grid(3, 3, 1.0, 5) + (0, 0, 4.5), 0.4, ROCK, velocity=falling(3, 27)))
    for axis in range(3):
        made.add(cn.wall(np.zeros(3), np.eye(3)[axis], ROCK))
    return made


def superquadrics():
    made, x = new(3), grid(3, 4, 1.05)
    made.add(cn.superquadrics(x, [0.45, 0.4, 0.4], [0.6, 0.8], ROCK, velocity=falling(3, len(x))))
    for axis in range(3):
        made.add(cn.wall(np.zeros(3), np.eye(3)[axis], ROCK))
    return made


def in_a_sheared_cell():
    """Boxes and balls in a cell that shears."""
    made, x = cn.Scene(dim=3, periodic=cn.Periodic((4.4, 4.4, 4.4), shear_rate=2.0)), grid(3, 4, 1.1)
    made.interact(ROCK, ROCK, SPRING)
    speed = np.random.default_rng(7).normal(0, 3.0, (len(x), 3))
    made.add(cn.boxes(x[::2], [0.8, 0.8, 0.8], ROCK, velocity=speed[::2]))
    made.add(cn.spheres(x[1::2], 0.5, ROCK, velocity=speed[1::2]))
    return made


def run(scene, ranks, steps, dt=2e-4):
    sim = cn.Simulation(scene(), dt, cn.SmoothDEM(energy=False), overlap="ignore", ranks=ranks)
    if scene is in_a_driven_bowl:
        surface = int(np.flatnonzero(np.isinf(sim.bodies.mass))[0])
        sim.drive(surface, "vz", 0.5)
        sim.drive(surface, "wz", 1.0)
    for _ in range(steps):
        sim.step()
    return sim


SCENES = [on_hills, adhesive, clumps_on_hills, in_a_driven_bowl, polygons, boxes, capsules, superquadrics, in_a_sheared_cell]


@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.__name__)
def test_the_same_bits_for_every_number_of_ranks(scene):
    sims = [run(scene, ranks, 500) for ranks in (1, 2, 5)]
    assert len(sims[0].contacts) > 20 and sims[-1].ranks.figures()["ghosts"] > 0
    assert len({digest(sim) for sim in sims}) == 1
    assert {sim.info["contacts"] for sim in sims} == {len(sims[0].contacts)}


@pytest.mark.parametrize("scene", [clumps_on_hills, boxes], ids=lambda scene: scene.__name__)
@pytest.mark.parametrize("ranks", [1, 3])
def test_a_run_that_nobody_reads_has_the_bits_of_steps(scene, ranks):
    """The whole has no numbers of bodies from the first cut of a run on."""
    ran = run(scene, ranks, 0)
    ran.run(5, progress=False)
    assert digest(ran) == digest(run(scene, 1, 5))


@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.__name__)
def test_motion_is_that_without_ranks(scene):
    alone, over = run(scene, None, 250), run(scene, 3, 250)
    assert np.abs(alone.bodies.velocity - over.bodies.velocity).max() < 1e-8 * np.abs(alone.bodies.velocity).max()
    fixed = np.isinf(alone.bodies.mass)
    if not fixed.any():
        return
    assert np.abs(alone.bodies.contact_force[fixed]).max() > 0
    size = np.abs(alone.bodies.contact_force).max()
    assert np.abs(alone.bodies.contact_force - over.bodies.contact_force)[fixed].max() < 1e-6 * size


@pytest.mark.parametrize("scene", [on_hills, boxes], ids=lambda scene: scene.__name__)
def test_restart_on_other_numbers_of_ranks(scene, tmp_path):
    whole, path = run(scene, 2, 350), tmp_path / "shapes.checkpoint.h5"
    run(scene, 3, 250).checkpoint(path)
    other = run(scene, 5, 0)
    other.restore(path)
    for _ in range(100):
        other.step()
    assert digest(other) == digest(whole)


WARM = {"conductivity": 3.0, "capacity": 800.0}


def test_heat_by_friction_over_ranks():
    def heated(ranks, steps=400):
        made, stone = cn.Scene(dim=3, gravity=(-3.0, 0.0, -9.81)), cn.Material("stone", density=2600.0, **WARM)
        x = grid(3, 4, 1.0)
        made.add(cn.spheres(x, 0.46, stone, velocity=falling(3, len(x))))
        for axis in range(3):
            made.add(cn.wall(np.zeros(3), np.eye(3)[axis], stone))
        made.interact(stone, stone, SPRING)
        made.thermal(conductance=cn.networks.Constant(conductance=20.0), initial=300.0)
        sim = cn.Simulation(made, 2e-4, cn.SmoothDEM(energy=False), overlap="ignore", ranks=ranks)
        sim.run(steps, progress=False)
        return sim

    alone, *over = (heated(ranks, 250) for ranks in (None, 1, 3, 5))
    heat = [sim.info["thermal"]["balance"]["friction"] for sim in (alone, *over)]
    assert heat[0] > 1.0 and heat[1:] == pytest.approx(3 * heat[:1], rel=1e-8)
    assert len({digest(sim) for sim in over}) == 1
    for sim in over[1:]:
        assert np.array_equal(sim.bodies.temperature, over[0].bodies.temperature)
    rise = np.nanmax(alone.bodies.temperature - 300)
    assert rise > 0 and np.nanmax(np.abs(over[0].bodies.temperature - alone.bodies.temperature)) < 1e-6 * rise


def test_springs_of_contacts_that_a_rank_only_heard_of_do_not_come_back():
    """Boxes that slide on a surface: rank 0, which owns the surface, has contacts on it of boxes of others for a while. What it
    remembered of them went into later cuts as if it were of today."""

    def slid(ranks):
        scene = cn.Scene(3, gravity=(0, 0, -9.81))
        x, y = np.meshgrid(np.linspace(-0.2, 1.2, 8), np.linspace(-0.2, 1.2, 8), indexing="ij")
        corner = np.array([8 * i + j for i in range(7) for j in range(7)])
        two = (np.column_stack((corner, corner + 8, corner + 1)), np.column_stack((corner + 8, corner + 9, corner + 1)))
        rock = cn.Material("rock", density=2000.0)
        scene.add(cn.surface(np.column_stack((x.ravel(), y.ravel(), 0.05 * np.sin(3 * x.ravel()))), np.concatenate(two), rock))
        rng = np.random.default_rng(5)
        for k in range(2):
            box = cn.boxes([(0.2 + 0.3 * k, 0.2, 0.11)], (0.12, 0.1, 0.09), rock)
            scene.add(box.with_(velocity=rng.uniform(-1, 1, (1, 6))))
        scene.interact("*", "*", cn.LinearSpring(stiffness=1e5, ratio=0.5, restitution=0.4, mu=0.4))
        sim = cn.Simulation(scene, dt=2e-4, strategy=cn.SmoothDEM(energy=False), ranks=ranks)
        for _ in range(400):
            sim.step()
        return sim.bodies.position, sim.bodies.velocity

    one = slid(1)
    assert all(np.array_equal(a, b) for a, b in zip(slid(2), one))
