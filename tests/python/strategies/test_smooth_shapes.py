"""Shapes of smooth scenes: boundaries that stand for the same plane, springs over seams, bodies that turn about unequal axes."""

import cairn as cn
import numpy as np
import pytest

STONE = cn.Material("stone", density=2500.0)
R = 0.01
HELD = ("vx", "vy", "vz", "wx", "wy", "wz")


def sheet(n, half=0.05, bend=0.0):
    """A surface of 2 n^2 triangles over the plane z = 0, with folds along y if it is bent."""
    at = np.linspace(-half, half, n + 1)
    x, y = np.meshgrid(at, at, indexing="ij")
    points = np.stack([x, y, bend * np.abs(x)], -1).reshape(-1, 3)
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    cells = np.concatenate(
        [np.stack([corner, corner + n + 1, corner + n + 2], 1), np.stack([corner, corner + n + 2, corner + 1], 1)]
    )
    return cn.surface(points, cells, STONE)


FLOORS = {
    "plane": lambda: cn.wall((0, 0, 0), (0, 0, 1), STONE),
    "two triangles": lambda: sheet(1),
    "small triangles": lambda: sheet(40),
    "huge sphere": lambda: cn.spheres([[0, 0, -1e6 * R]], 1e6 * R, STONE, driven=HELD),
    "box": lambda: cn.boxes([[0, 0, -0.5]], 1.0, STONE, fixed=True),
}
FLAT = {
    "plane": lambda: cn.wall((0, 0), (0, 1), STONE),
    "segment": lambda: cn.segment((-1, 0), (1, 0), STONE),
    "polygon": lambda: cn.polygons([[[-1, -1], [1, -1], [1, 0], [-1, 0]]], STONE, fixed=True),
}


def impact(floor, dim, law, steps, dt=1e-6, speed=(0.3, -1.0)):
    scene = cn.Scene(dim)
    height = 1.00001 * R
    if dim == 3:
        scene.add(cn.spheres([[0, 0, height]], R, STONE, velocity=[[speed[0], 0, speed[1], 0, 0, 0]]))
    else:
        scene.add(cn.disks([[0, height]], R, STONE, velocity=[[*speed, 0]]))
    scene.add(floor())
    scene.interact("*", "*", law)
    sim = cn.Simulation(scene, dt, cn.SmoothDEM(), overlap="ignore")
    most = 0
    for _ in range(steps):
        sim.step()
        most = max(most, sim.info["contacts"])
    return sim, most


@pytest.mark.parametrize("name", list(FLOORS)[1:])
def test_boundaries_that_are_a_plane_give_its_rebound(name):
    law = cn.HertzMindlin(young=1e8, poisson=0.3, restitution=0.6, mu=0.4)
    (plane, _), (other, most) = (impact(FLOORS[k], 3, law, 800) for k in ("plane", name))
    size = np.abs(plane.bodies.velocity[0]) + [1, 1, 1, 1 / R, 1 / R, 1 / R]
    assert plane.bodies.velocity[0, 2] > 0.5  # it has left
    assert most == 1
    assert np.all(np.abs(other.bodies.velocity[0] - plane.bodies.velocity[0]) <= 1e-6 * size)


@pytest.mark.parametrize("name", list(FLAT)[1:])
def test_boundaries_that_are_a_line_give_its_rebound(name):
    law = cn.LinearSpring(stiffness=1e5, restitution=0.6, mu=0.4)
    (plane, _), (other, most) = (impact(FLAT[k], 2, law, 1000, dt=2e-5) for k in ("plane", name))
    assert plane.bodies.velocity[0, 1] > 0.5 and most == 1
    assert np.allclose(other.bodies.velocity[0], plane.bodies.velocity[0], rtol=1e-9)


@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_a_sphere_that_slides_over_seams_does_so_as_on_a_plane(mu):
    """Its tangential spring goes on from triangle to triangle, over edges and vertices."""
    law = cn.LinearSpring(stiffness=2e4, restitution=0.5, mu=mu)
    ends = []
    for floor in (FLOORS["plane"], lambda: sheet(40)):
        scene = cn.Scene(3, gravity=(0, 0, -9.81))
        weight = 9.81 * 2500 * 4 / 3 * np.pi * R**3
        scene.add(cn.spheres([[-0.03, -0.011, R - weight / 2e4]], R, STONE, velocity=[[1.0, 0.35, 0, 0, 0, 0]]))
        scene.add(floor())
        scene.interact("*", "*", law)
        sim = cn.Simulation(scene, 1e-4, cn.SmoothDEM())
        for _ in range(400):  # 16 rows of triangles
            sim.step()
        ends.append(np.concatenate([sim.bodies.position[0], sim.bodies.velocity[0]]))
    assert ends[0][0] > 0.0
    assert np.allclose(ends[1], ends[0], rtol=1e-9, atol=1e-9 * R)


def test_a_sphere_goes_round_an_edge_of_a_box_with_one_force():
    """Driven across the edge at constant speed it meets a face, the edge and the other face, one at a time, without a jump."""
    law = cn.LinearSpring(stiffness=1e4)
    scene = cn.Scene(3)
    depth = 0.05 * R
    scene.add(
        cn.spheres([[-R, 0.0013, R - depth]], R, STONE, velocity=[[1, 0, 0, 0, 0, 0]], driven=HELD, drive=[(1.0, 0, 0, 0, 0, 0)])
    )
    scene.add(cn.boxes([[-0.1, 0, -0.1]], 0.2, STONE, density=1e12))
    scene.interact("*", "*", law)
    sim = cn.Simulation(scene, 2e-5, cn.SmoothDEM())
    forces = []
    for _ in range(1000):
        sim.step()
        assert sim.info["contacts"] <= 1
        forces.append(sim.bodies.contact_force[0, :3].copy())
    sizes = np.linalg.norm(forces, axis=1)
    assert np.allclose(sizes[:400], 1e4 * depth, rtol=1e-9) and sizes[-1] == 0
    assert np.abs(np.diff(sizes)).max() < 0.02 * sizes[0]
    x = sim.bodies.position[0, 0] - (1000 - np.arange(1, 1001)) * 2e-5
    near = (x > 0) & (sizes > 0)
    expected = 1e4 * (R - np.hypot(x[near], R - depth))
    assert near.sum() > 100 and np.allclose(sizes[near], expected, rtol=1e-3, atol=1e-4 * sizes[0])


def advance(sim, steps):
    for _ in range(steps):
        sim.step()


def twirl(dt, steps, **options):
    scene = cn.Scene(3)
    scene.add(
        cn.clumps(
            [[0, 0, 0]],
            [[-0.05, 0, 0], [0.05, 0, 0]],
            [0.1, 0.1],
            1.0,
            (0.1, 0.25, 0.2),
            STONE,
            velocity=[[0, 0, 0, 1, 2, 3]],
            **options,
        )
    )
    scene.interact(STONE, STONE, cn.LinearSpring(stiffness=1e3))
    sim = cn.Simulation(scene, dt, cn.SmoothDEM())
    for _ in range(steps):
        sim.step()
    return sim


def test_free_rotation_of_unequal_moments_keeps_energy_and_momentum():
    sim = twirl(1e-3, 5000)
    momentum = sim.raw.angular_momentum[0]
    assert np.allclose(momentum, [0.1, 0.5, 0.6], rtol=1e-12)  # of the start: the axes were those of space
    energy = 0.5 * momentum @ sim.bodies.velocity[0, 3:]
    assert abs(energy / (0.5 * (0.1 + 0.25 * 4 + 0.2 * 9)) - 1) < 1e-11
    assert abs(sim.energy["closure"]) < 1e-11 * energy


def test_free_rotation_is_of_second_order():
    orientation = [twirl(dt, round(0.4 / dt)).bodies.rotation[0] for dt in (4e-3, 2e-3, 2.5e-4)]
    errors = [np.abs(q - orientation[2]).max() for q in orientation[:2]]
    assert 3.5 < errors[0] / errors[1] < 4.7, errors


def mixed(strategy=None, count=3, dt=2e-5, seed=3, boxes=True, bend=0.6):
    """Boxes, capsules, superquadrics, clumps and spheres fall into a bowl of triangles."""
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(*[np.arange(count)] * 3, indexing="ij"), -1).reshape(-1, 3)
    x = (grid - (count - 1) / 2) * 0.024 * [1, 1, 1] + [0.001, 0.002, 0.028 + 0.024 * (count - 1) / 2]
    x = x + 1e-3 * rng.random(x.shape)
    q = rng.normal(size=(len(x), 4))
    q /= np.linalg.norm(q, axis=1)[:, None]
    v = np.concatenate([0.5 * (rng.random((len(x), 3)) - [0.5, 0.5, 4.0]), 20 * (rng.random((len(x), 3)) - 0.5)], 1)
    k = np.arange(len(x)) % 5
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    scene.add(
        cn.boxes(x[k == 0], (0.008, 0.01, 0.012), STONE, rotation=q[k == 0], velocity=v[k == 0])
        if boxes
        else cn.capsules(x[k == 0], 0.005, 0.003, STONE, rotation=q[k == 0], velocity=v[k == 0]),
        cn.capsules(x[k == 1], 0.004, 0.008, STONE, rotation=q[k == 1], velocity=v[k == 1]),
        cn.superquadrics(x[k == 2], (0.004, 0.005, 0.007), (0.7, 0.9), STONE, rotation=q[k == 2], velocity=v[k == 2]),
        cn.spheres(x[k == 3], 0.005, STONE, velocity=v[k == 3]),
        cn.clumps(
            x[k == 4],
            [[-0.003, 0, 0], [0.003, 0, 0]],
            [0.004, 0.004],
            1e-3,
            (1e-8, 2e-8, 2e-8),
            STONE,
            rotation=q[k == 4],
            velocity=v[k == 4],
        ),
        sheet(8, half=0.1, bend=bend),
    )
    scene.interact("*", "*", cn.LinearSpring(stiffness=3e3, mu=0.4, restitution=0.6))
    return cn.Simulation(scene, dt, strategy or cn.SmoothDEM(), overlap="ignore")


def state(sim):
    return [sim.bodies.position, sim.bodies.rotation, sim.bodies.velocity, sim.bodies.contact_force, sim.contacts.force]


def same(a, b):
    return all(np.array_equal(x, y) for x, y in zip(state(a), state(b)))


def test_bits_of_shapes_do_not_depend_on_the_age_of_the_list():
    runs = [mixed(cn.SmoothDEM(skin=skin)) for skin in (5e-4, 5e-3)]
    for sim in runs:
        advance(sim, 2000)
    assert runs[0].info["contacts"] > 5
    assert runs[0].info["neighbour_lists"] > 3 * runs[1].info["neighbour_lists"]
    assert same(*runs)


def test_bits_of_shapes_do_not_depend_on_threads():
    runs = [mixed(cn.SmoothDEM(threads=threads), count=13) for threads in (1, 2, 3)]
    for sim in runs:
        advance(sim, 25)
    assert len(runs[0].bodies) > 2048
    assert same(runs[0], runs[1]) and same(runs[0], runs[2]) and runs[0].energy == runs[1].energy == runs[2].energy


def test_shapes_go_on_from_a_checkpoint_to_the_same_bits(tmp_path):
    half, whole, second = (mixed(cn.SmoothDEM(renumber_every=130)) for _ in range(3))
    advance(half, 1900)
    half.checkpoint(tmp_path / "half.h5")
    advance(whole, 2050)
    second.restore(tmp_path / "half.h5")
    advance(second, 150)
    assert whole.info["contacts"] > 5 and same(whole, second) and whole.energy == second.energy


def test_the_balance_of_round_shapes_closes_with_the_step():
    ends = []
    for dt in (4e-5, 1e-5):
        sim = mixed(dt=dt, boxes=False, bend=0.0)
        advance(sim, round(0.04 / dt))
        ends.append(abs(sim.energy["dissipated_integrator"]) / sim.energy["in_play"])
        assert abs(sim.energy["closure"]) < 1e-12 * sim.energy["in_play"]
    assert ends[0] < 2e-2 and ends[1] < 0.3 * ends[0], ends


def test_a_box_comes_to_rest_on_its_four_corners():
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    scene.add(cn.boxes([[0, 0, 0.5]], 1.0, STONE), sheet(7, half=3.0))
    scene.interact("*", "*", cn.LinearSpring(stiffness=1e8, restitution=0.2, mu=0.5))
    sim = cn.Simulation(scene, 1e-4, cn.SmoothDEM())
    advance(sim, 3000)
    assert len(sim.contacts.gap) == 4
    assert sim.contacts.force[:, 2].sum() == pytest.approx(2500 * 9.81, rel=1e-4)
    assert np.allclose(sim.contacts.gap, -2500 * 9.81 / 4e8, rtol=0.02)
    assert np.abs(sim.bodies.velocity).max() < 1e-6


def test_what_cannot_turn_is_refused_by_name():
    with pytest.raises(ValueError, match="body 0 is driven about some axes"):
        twirl(1e-3, 1, driven=("wx",))
    scene = cn.Scene(3)
    scene.add(cn.boxes([[0, 0, 0.5]], (1.0, 2.0, 3.0), STONE))
    scene.interact("*", "*", cn.LinearSpring(stiffness=1e6))
    with pytest.raises(ValueError, match="inertia of body 0 .* Gear"):
        cn.Simulation(scene, 1e-4, cn.SmoothDEM(integrator=cn.Gear())).step()


def test_polygons_in_a_periodic_cell_that_moves_along():
    """Images change as bodies are wrapped; springs, and with them the motion, do not."""
    ends = []
    for shift, skin in ((0.0, None), (8.0, None), (0.0, 0.002)):
        rng = np.random.default_rng(1)
        place = np.stack(np.meshgrid(np.arange(4), np.arange(4), indexing="ij"), -1).reshape(-1, 2) * 0.1 + 0.05
        corner = 0.042 * np.stack([np.cos(np.pi / 3 * np.arange(6)), np.sin(np.pi / 3 * np.arange(6))], -1)
        velocity = np.c_[rng.standard_normal((16, 2)) + [shift, shift / 2], 5 * rng.standard_normal(16)]
        scene = cn.Scene(2, periodic=cn.Periodic((0.4, 0.4)))
        scene.add(cn.polygons([corner + x for x in place], STONE, velocity=velocity))
        scene.interact("*", "*", cn.LinearSpring(stiffness=1e6, mu=0.3, restitution=0.9))
        sim = cn.Simulation(scene, 2e-5, cn.SmoothDEM(skin=skin), overlap="ignore")
        touched = 0
        for _ in range(1500):
            sim.step()
            touched += sim.info["contacts"]
        assert touched > 1000
        ends.append(sim.bodies.velocity[:, :2] - [shift, shift / 2])
    assert np.array_equal(ends[0], ends[2])
    assert np.allclose(ends[0], ends[1], atol=1e-8)
