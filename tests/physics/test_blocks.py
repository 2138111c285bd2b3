"""Blocks with flat faces: at rest on many contacts, on slopes, in stacks."""

import cairn as cn
import numpy as np
import pytest
from report import judge

ROCK = cn.Material("rock", density=1.0)
G = 9.81


def simulation(scene, dt, solver, **options):
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.5))
    solver = solver if isinstance(solver, cn.strategies.ContactSolver) else cn.NLGS(tol=solver, max_iter=20000)
    return cn.Simulation(scene, dt=dt, strategy=cn.NSCD(solver=solver, **options))


@pytest.mark.parametrize("tiles", [1, 2, 8])
def test_box_on_coplanar_contacts(tiles):
    """On one plane's 4 corners, or on tiles x tiles blocks: only the resultant and its moment are unique."""
    scene = cn.Scene(3, gravity=(0, 0, -G))
    box = scene.add(cn.boxes([[0.1, 0.05, 0.5]], 1.0, ROCK))
    if tiles == 1:
        scene.add(cn.wall((0, 0, 0), (0, 0, 1), ROCK))
    else:
        middle = (np.arange(tiles) - (tiles - 1) / 2) * 2 / tiles
        places = [[x, y, -0.5] for x in middle for y in middle]
        scene.add(cn.boxes(places, (2 / tiles, 2 / tiles, 1.0), ROCK, fixed=True))
    dt = 1e-3
    sim = simulation(scene, dt, 1e-12)
    sim.run(steps=20)
    c = sim.contacts
    sign = np.where(c.bodies[:, 0] == box[0], 1.0, -1.0)[:, None]
    impulse = sign * c.impulse
    moment = np.cross(c.point - sim.bodies.position[0], impulse)
    weight = G * dt
    errors = np.abs(impulse.sum(axis=0) - [0, 0, weight]).max() / weight, np.abs(moment.sum(axis=0)).max() / weight
    judge(f"box on {len(c.gap)} coplanar contacts", max(errors), 0.0, 1e-10, 1.0)
    assert len(c.gap) >= {1: 4, 2: 16, 8: 64}[tiles]
    assert np.abs(sim.bodies.velocity[0]).max() < 1e-9


@pytest.mark.parametrize("tangent, expected", [(0.49, 0.0), (0.51, 1.0924)])
def test_cube_on_a_slope(tangent, expected):
    angle = np.arctan(tangent)
    scene = cn.Scene(3, gravity=(G * np.sin(angle), 0, -G * np.cos(angle)))
    scene.add(cn.boxes([[0, 0, 0.4]], 0.8, ROCK), cn.wall((0, 0, 0), (0, 0, 1), ROCK))
    sim = simulation(scene, 1e-2, 1e-10)
    sim.run(steps=500)
    way = sim.bodies.position[0, 0]
    judge(f"cube on a slope of {tangent}", way, expected, 1e-10 if expected == 0 else 1e-3, max(expected, 0.8))


@pytest.mark.parametrize("ratio, gate", [(1.0, 1e-6), (1e3, 1e-6), (1e6, 1e-6), (1e12, 1e-3)])
def test_stack_of_cubes_keeps_its_height(ratio, gate):
    """20 unit cubes, the top one `ratio` times as heavy. Of 1e12, roundings of the impulses alone are 1e-5 m/s of the others;
    benchmarks/blocks_at_rest.py has it for 10 s."""
    scene = cn.Scene(3, gravity=(0, 0, -G))
    places = np.array([[0, 0, k + 0.5] for k in range(20)])
    scene.add(cn.boxes(places[:19], 1.0, ROCK), cn.boxes(places[19:], 1.0, ROCK, density=ratio))
    scene.add(cn.wall((0, 0, 0), (0, 0, 1), ROCK))
    sim = simulation(scene, 1 / 240, cn.PPANewton(tol=max(1e-15, 1e-8 / ratio), max_iter=100))
    sim.run(steps=600 if ratio < 1e6 else 240)
    moved = np.abs(sim.bodies.position[:20] - places).max()
    judge(f"stack of 20 cubes under {ratio:g}", moved, 0.0, gate, 1.0)


@pytest.mark.parametrize("project", [False, True])
def test_wall_does_not_creep(project):
    """Bricks in running bond keep their places to rounding; longer in benchmarks/blocks_at_rest.py."""
    scene = cn.Scene(3, gravity=(0, 0, -G))
    for course in range(3):
        edges = np.array([[0, 1, 2], [0, 0.5, 1.5, 2]][course % 2])
        length = np.diff(edges)
        centres = np.column_stack((edges[:-1] + length / 2, 0 * length, 0 * length + 0.4 * course + 0.2))
        scene.add(cn.boxes(centres, np.column_stack((length, 0 * length + 0.5, 0 * length + 0.4)), ROCK))
    scene.add(cn.wall((0, 0, 0), (0, 0, 1), ROCK))
    sim = simulation(scene, 1e-3, cn.PPANewton(tol=1e-10, max_iter=100), project_positions=project)
    start = sim.bodies.position
    sim.run(steps=500)
    judge(f"wall after 500 steps, project_positions={project}", np.abs(sim.bodies.position - start).max(), 0.0, 1e-10, 0.4)


def test_random_pile_comes_to_rest():
    """Tetrahedra dropped into a corner: after the last impacts nothing moves but by rounding, and kinetic energy is gone."""
    rng = np.random.default_rng(1)
    corners, faces = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
    turns = rng.normal(size=(8, 4))
    places = [[0.7 * (k % 2) - 0.2, 0.7 * (k // 2 % 2) - 0.2, 0.8 + 1.3 * (k // 4)] for k in range(8)]
    scene = cn.Scene(3, gravity=(0, 0, -G))
    scene.add(cn.polyhedra((np.array(corners) - 0.25, faces), ROCK, position=places, rotation=turns))
    for normal in np.vstack([np.eye(3), -np.eye(3)[:2]]):
        scene.add(cn.wall(-1.2 * normal * [1, 1, 0], normal, ROCK))
    sim = simulation(scene, 4e-3, cn.Auto(tol=1e-9))
    sim.run(steps=1000)
    start = sim.bodies.position
    sim.run(steps=300)
    judge("creep of a pile in 300 steps", np.abs(sim.bodies.position - start).max(), 0.0, 1e-9, 1.0)
    energy = 0.5 * sim.bodies.mass[:8] @ np.sum(sim.bodies.velocity[:8, :3] ** 2, axis=1)
    judge("kinetic energy of a pile", energy, 0.0, 1e-16, sim.bodies.mass[:8].sum() * G)


def test_polygons_rest_and_slide():
    """A square on a bar and a triangle on a half plane, 2D: exact weights; the square slides as a block does."""
    angle = np.arctan(0.51)
    scene = cn.Scene(2, gravity=(G * np.sin(angle), -G * np.cos(angle)))
    scene.add(cn.polygons([[[0, 0], [0.8, 0], [0.8, 0.8], [0, 0.8]]], ROCK))
    scene.add(cn.segment((-5, -0.1), (8, -0.1), ROCK, radius=0.1))
    sim = simulation(scene, 1e-2, 1e-10)
    sim.run(steps=500)
    judge("square on a slope", sim.bodies.position[0, 0] - 0.4, 1.0924, 1e-3)
    scene = cn.Scene(2, gravity=(0, -G))
    scene.add(cn.polygons([[[0, 0], [3, 0], [1, 2]]], ROCK), cn.wall((0, 0), (0, 1), ROCK))
    sim = simulation(scene, 1e-3, 1e-12)
    sim.run(steps=5)
    share = sim.contacts.impulse[:, 1] / (3 * G * 1e-3)  # centre of mass at x = 4/3
    np.testing.assert_allclose(np.sort(share), [4 / 9, 5 / 9], atol=1e-11)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("parts", [True, False])
@pytest.mark.parametrize("begin", [0.3, 0.5])
def test_a_block_slides_over_the_seams_of_flush_blocks(dim, parts, begin):
    """Without friction it keeps its speed: the sides of the next block, or part, begin where those before it end. Begun at 0.5
    its edge stands on the first seam."""
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])
    cube = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1.0)])
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    up, along = np.eye(dim)[-1], np.eye(dim)[0]

    def shape(size, at):
        return square * size + at if dim == 2 else (cube * size + at, faces)

    make = cn.polygons if dim == 2 else cn.polyhedra
    scene = cn.Scene(dim, gravity=-9.81 * up)
    flush = [shape(1.0, k * along - up) for k in range(6)]
    scene.add(make([flush] if parts else flush, ROCK, fixed=True))
    scene.add(make([shape(0.5, begin * along)], ROCK, velocity=[[*along, *np.zeros(1 if dim == 2 else 3)]]))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.0))
    sim = cn.Simulation(scene, 1e-3)
    x = sim.bodies.position[-1].copy()
    for _ in range(2000):
        sim.step()
    np.testing.assert_allclose(sim.bodies.position[-1], x + 2 * along, atol=1e-5)
    np.testing.assert_allclose(sim.bodies.velocity[-1, :dim], along, atol=1e-5)
