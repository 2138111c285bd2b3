"""Bodies that slide over flush pieces keep their speed; real steps stop them, and ramps turn them."""

import cairn as cn
import numpy as np
import pytest
from cairn.pre import terrain

STONE = cn.Material("stone", density=1000.0)
G = 9.81


def slider(shape, yaw, size, x, y=0.13, speed=1.0):
    turned, along = [[np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)]], [[speed, 0, 0, 0, 0, 0]]
    if shape == "box":
        return cn.boxes([[x, y, size[2] / 2]], size, STONE, rotation=turned, velocity=along)
    if shape == "cylinder":
        return cn.cylinders([[x, y, size[2] / 2]], size[0] / 2, size[2], STONE, velocity=along)
    if shape == "lying":
        axis = (np.cos(yaw), np.sin(yaw), 0)
        return cn.cylinders([[x, y, size[0] / 2]], size[0] / 2, size[2], STONE, axis=axis, velocity=along)
    if shape == "capsule":
        axis = (np.cos(yaw), np.sin(yaw), 0)
        return cn.capsules([[x, y, size[0] / 2]], size[0] / 2, size[2], STONE, axis=axis, velocity=along)
    if shape == "superquadric":
        return cn.superquadrics([[x, y, size[2] / 2]], np.array(size) / 2, (1, 1), STONE, velocity=along)
    return cn.spheres([[x, y, size[0] / 2]], size[0] / 2, STONE, velocity=along)


def floor(kind):
    if kind == "two":
        return cn.boxes([[-1, 0, -0.5], [1, 0, -0.5]], (2, 4, 1), STONE, fixed=True)
    if kind == "pavement":
        places = [[0.3 * i - 0.6, 0.3 * j - 0.45, -0.1] for i in range(5) for j in range(5)]
        return cn.boxes(places, (0.3, 0.3, 0.2), STONE, fixed=True)
    if kind == "joints":
        places = [[0.3 * i - 0.6, 0.3 * j - 0.45, -0.1] for i in range(5) for j in range(5)]
        return cn.boxes(places, (0.297, 0.297, 0.2), STONE, fixed=True)
    x = np.arange(-1.0, 1.5, 1.0)
    return cn.polyhedra(terrain.prisms(*terrain.heights(x, x, np.zeros((3, 3))), 1.0), STONE, fixed=True)


def half_of_a_floor(side, as_surface):
    """A block left (-1) or right (1) of x = 0, with its top at 0: a polyhedron or a closed surface of triangles."""
    unit = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)])
    faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    mesh = (unit * [1, 2, 0.5] + [side, 0, -0.5], faces)
    return cn.surface(*mesh, STONE) if as_surface else cn.polyhedra([mesh], STONE, fixed=True)


def slide(kind, shape, yaw, size=(0.5, 0.5, 0.5), x=-0.45, steps=450, dt=1e-3, law=None, solver=None):
    scene = cn.Scene(3, gravity=(0, 0, -G))
    scene.add(slider(shape, yaw, size, x), floor(kind))
    scene.interact("*", "*", law or cn.Frictionless())
    sim = cn.Simulation(scene, dt, cn.NSCD(solver=solver) if solver else None)
    for _ in range(steps):
        sim.step()
    return sim


@pytest.mark.parametrize("kind", ["two", "pavement", "joints", "prisms"])
@pytest.mark.parametrize("shape,yaw", [("box", 0.02), ("box", 0.3), ("box", np.pi / 4), ("cylinder", 0.0)])
def test_speed_is_kept_over_seams(kind, shape, yaw):
    sim = slide(kind, shape, yaw)
    np.testing.assert_allclose(sim.bodies.velocity[0, :3], [1, 0, 0], atol=1e-5)
    assert np.linalg.norm(sim.bodies.velocity[0, :3]) == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("shape,yaw", [("lying", 0.3), ("capsule", 0.3), ("superquadric", 0.0), ("sphere", 0.0)])
def test_round_bodies_keep_it_too(shape, yaw):
    sim = slide("pavement", shape, yaw, size=(0.2, 0.2, 0.25))
    assert np.linalg.norm(sim.bodies.velocity[0, :3]) == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("left,right", [(False, True), (True, False), (True, True)])
@pytest.mark.parametrize("shape,yaw", [("box", 0.0), ("box", 0.3), ("cylinder", 0.0), ("capsule", 0.3), ("sphere", 0.0)])
def test_surfaces_flush_with_other_bodies(left, right, shape, yaw):
    scene = cn.Scene(3, gravity=(0, 0, -G))
    scene.add(slider(shape, yaw, (0.3, 0.3, 0.3), -0.25), half_of_a_floor(-1, left), half_of_a_floor(1, right))
    scene.interact("*", "*", cn.Frictionless())
    sim = cn.Simulation(scene, 2e-3)
    for _ in range(150):
        sim.step()
    assert np.linalg.norm(sim.bodies.velocity[0, :3]) == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("solver", [cn.NLGS(tol=1e-10, max_iter=10_000), cn.PPANewton(tol=1e-10)])
def test_whichever_solver_and_size(solver):
    sim = slide("two", "box", 0.3, size=(0.3, 0.3, 0.02), x=-0.25, solver=solver)
    assert np.linalg.norm(sim.bodies.velocity[0, :3]) == pytest.approx(1, abs=1e-6)


def test_short_steps():
    sim = slide("two", "box", 0.3, x=-0.36, steps=1500, dt=1e-4)
    assert np.linalg.norm(sim.bodies.velocity[0, :3]) == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("yaw", [0.02, 0.4])
def test_friction_stops_it_where_it_stops_on_one_block(yaw):
    sim = slide("two", "box", yaw, size=(0.24, 0.115, 0.07), x=-0.2, steps=400, law=cn.Coulomb(mu=0.5))
    assert np.linalg.norm(sim.bodies.position[0, :2] - [-0.2, 0.13]) == pytest.approx(1 / (2 * 0.5 * G), rel=0.01)


@pytest.mark.parametrize("yaw", [0.0, 0.3])
@pytest.mark.parametrize("step", [1e-3, 0.1])
def test_a_real_step_stops_it(yaw, step):
    scene = cn.Scene(3, gravity=(0, 0, -G))
    high = 0.5 * step
    scene.add(slider("box", yaw, (0.5, 0.5, 0.5), -0.45, 0.0))
    scene.add(cn.boxes([[-1, 0, -0.5], [1, 0, -0.5 + high]], (2, 4, 1), STONE, fixed=True))
    scene.interact("*", "*", cn.Frictionless())
    sim = cn.Simulation(scene, 1e-3)
    for _ in range(450):
        sim.step()
    assert sim.bodies.velocity[0, 0] < 0.8


def profile(kind, kink):
    """Ground of pieces, each turned down by a kink."""
    p = [np.array([-2.0, 0.0])]
    for k in range(4):
        p.append(p[-1] + (2.0 if k == 0 else 0.5) * np.array([np.cos(kink * k), -np.sin(kink * k)]))
    low, pieces = min(q[1] for q in p) - 1, list(zip(p[:-1], p[1:], strict=True))
    if kind == "strips":
        return [cn.polygons([np.array([a, [a[0], low], [b[0], low], b]) for a, b in pieces], STONE, fixed=True)]
    if kind == "one":
        return [cn.polygons([np.array([*p, [p[-1][0], low], [p[0][0], low]])[::-1]], STONE, fixed=True)]
    r = 0.05 if kind == "round" else 0.0
    return [cn.segment(a - [0, r], b - [0, r], STONE, radius=r) for a, b in pieces]


def energy_left(kind, kink, shape="square"):
    scene = cn.Scene(2, gravity=(0, -G))
    corners = np.array([[-0.2, 0], [0.2, 0], [0.2, 0.2], [-0.2, 0.2]]) - [0.4, 0]
    scene.add(cn.polygons([corners], STONE, velocity=[[1.5, 0, 0]]))
    scene.add(*profile(kind, kink))
    scene.interact("*", "*", cn.Frictionless())
    sim = cn.Simulation(scene, 1e-3)
    for _ in range(700):
        sim.step()
    v, at = sim.bodies.velocity[0], sim.bodies.position[0]
    inertia = sim.bodies.inertia[0] / sim.bodies.mass[0]
    return (0.5 * v[:2] @ v[:2] + 0.5 * inertia * v[2] ** 2 + G * (at[1] - 0.1)) / (0.5 * 1.5**2)


@pytest.mark.parametrize("kind", ["segments", "round", "strips"])
def test_flat_rows_in_the_plane(kind):
    assert energy_left(kind, 0.0) == pytest.approx(1, abs=2e-6)


@pytest.mark.parametrize("kink", [0.01, 0.03])
@pytest.mark.parametrize("kind", ["segments", "strips"])
def test_convex_kinks_cost_what_those_of_one_body_cost(kind, kink):
    assert energy_left(kind, kink) == pytest.approx(energy_left("one", kink), abs=2e-3)


@pytest.mark.parametrize("kink", [-0.01, -0.03, -0.1, -0.2])
@pytest.mark.parametrize("kind", ["segments", "strips"])
def test_concave_kinks_are_met_by_the_face_that_rises(kind, kink):
    """The loss at a kink is of the order of the square of its angle."""
    left = energy_left(kind, kink)
    assert 1 - 8 * kink**2 - 1e-5 < left < 1 + 1e-6


def test_a_body_at_rest_on_a_seam_is_struck():
    """A second box strikes one that stands with its edge on the seam: momentum is kept."""
    scene = cn.Scene(3, gravity=(0, 0, -G))
    scene.add(cn.boxes([[-0.25, 0, 0.25], [-1.0, 0, 0.25]], 0.5, STONE, velocity=[[0] * 6, [1.0, 0, 0, 0, 0, 0]]))
    scene.add(floor("two"))
    scene.interact("*", "*", cn.Frictionless())
    sim = cn.Simulation(scene, 1e-3)
    for _ in range(300):
        sim.step()
    assert sim.bodies.velocity[:2, 0].sum() == pytest.approx(1, abs=1e-5)


@pytest.mark.parametrize("speed", [1e-6, 1e-5, 1e-4])
@pytest.mark.parametrize("shape,yaw", [("box", 0.0), ("box", 0.3), ("cylinder", 0.0), ("square", 0.0), ("segments", 0.0)])
def test_slow_bodies_keep_their_speed(speed, shape, yaw):
    """Slower than a hundredth of what gravity adds in a step, where the tolerance of a solver may leave such speeds."""
    dt, steps, a = 1e-3, 40, 0.25
    reach = a * (np.cos(yaw) + np.sin(yaw))
    x = -reach - speed * dt * steps / 3  # the seam is met after a third of the way
    dim = 2 if shape in ("square", "segments") else 3
    scene = cn.Scene(dim, gravity=(0,) * (dim - 1) + (-G,))
    if dim == 3:
        scene.add(slider(shape, yaw, (2 * a,) * 3, x, speed=speed), floor("two"))
    else:
        square = np.array([[-a, 0], [a, 0], [a, 2 * a], [-a, 2 * a]]) + [x, 0]
        scene.add(cn.polygons([square], STONE, velocity=[[speed, 0, 0]]), *profile("strips" if shape == "square" else shape, 0.0))
    scene.interact("*", "*", cn.Frictionless())
    sim = cn.Simulation(scene, dt)
    for _ in range(steps):
        sim.step()
    assert sim.bodies.velocity[0, 0] == pytest.approx(speed, rel=1e-4)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("gap", [0.0, 2e-5])
def test_a_grid_that_comes_loose_keeps_its_contacts(dim, gap):
    """Neighbours across edges and corners too: bodies that part are not flush at the end of the step."""
    n, rng = 5 if dim == 3 else 12, np.random.default_rng(3)
    at = np.stack(np.meshgrid(*[np.arange(n)] * dim, indexing="ij"), -1).reshape(-1, dim)
    velocity = 0.1 * rng.normal(size=(len(at), 3 * dim - 3))
    square = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    places = at * (1 + gap)
    scene = cn.Scene(dim)
    scene.add(cn.boxes(places, 1.0, STONE, velocity=velocity) if dim == 3 else
              cn.polygons([square + p for p in places], STONE, velocity=velocity))  # fmt: skip
    scene.interact("*", "*", cn.Frictionless())
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(margin=1e-3), overlap="ignore")
    sim.step()
    found = {tuple(sorted(pair)) for pair in np.asarray(sim.contacts.bodies).tolist()}
    near = np.abs(at[:, None] - at).max(axis=2) == 1
    # without a search for seams 0.73 of them in the plane and 0.71 in space; no others are dropped
    assert len(found) > 0.68 * np.count_nonzero(near) / 2
