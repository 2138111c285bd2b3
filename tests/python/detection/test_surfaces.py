"""Surfaces of triangles against spheres: the nearest points by plain loops, no edge counted twice, no jolt on a plane."""

import cairn as cn
import numpy as np
import pytest
from shape_pairs import CUBE, CUBE_FACES, ROCK, random_rotation, triangles

GROUND = cn.Material("ground")


def grid(n, height):
    """Two triangles on each of n x n unit squares, seen from above; height(x, y)."""
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0), indexing="ij")
    vertices = np.column_stack((x.ravel(), y.ravel(), height(x, y).ravel()))
    i, j = (a.ravel() for a in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    a, b = i * (n + 1) + j, (i + 1) * (n + 1) + j
    return vertices, np.concatenate([np.column_stack((a, b, a + 1)), np.column_stack((b, b + 1, a + 1))])


def nearest(vertices, faces, x):
    """Least distance of a point from triangles, each looked at by its corners, edges and inside."""
    best = np.inf
    for t in vertices[faces]:
        for k in range(3):
            e = t[(k + 1) % 3] - t[k]
            along = np.clip((x - t[k]) @ e / (e @ e), 0, 1)
            best = min(best, np.linalg.norm(x - t[k] - along * e))
        share = np.linalg.lstsq(np.column_stack((t[1] - t[0], t[2] - t[0])), x - t[0], rcond=None)[0]
        if share.min() >= 0 and share.sum() <= 1:
            best = min(best, np.linalg.norm(x - t[0] - share @ (t[1:] - t[0])))
    return best


def touch(surface, centres, radius, margin):
    """Contacts of spheres, which do not see each other, with a surface: (gap, normal, point) of each."""
    scene = cn.Scene(3)
    scene.add(cn.spheres(centres, radius, ROCK), cn.surface(*surface, GROUND))
    scene.interact(ROCK, ROCK, None)
    scene.interact(ROCK, GROUND, cn.Coulomb(mu=0.0))
    sim = cn.Simulation(scene, dt=1e-12, strategy=cn.NSCD(margin=margin), overlap="ignore")
    sim.step()
    c = sim.contacts
    sign = np.where(c.bodies[:, 0] < len(centres), 1.0, -1.0)[:, None]
    ball = np.min(c.bodies, axis=1)
    return [(c.gap[ball == k], (sign * c.normal)[ball == k], c.point[ball == k]) for k in range(len(centres))]


@pytest.mark.parametrize("turned", [False, True])
def test_on_a_plane_every_sphere_has_one_contact(turned):
    """Above insides, edges and vertices, to the bit and beside them: one contact, with the normal of the plane."""
    rng = np.random.default_rng(1)
    vertices, faces = grid(8, lambda x, y: 0 * x)
    spots = [rng.uniform(1, 7, (100, 2)), rng.integers(1, 7, (50, 2)), rng.integers(1, 7, (50, 2)) + [0.5, 0.0]]
    spots += [rng.integers(1, 7, (50, 2)) + [0.25, 0.75], rng.integers(1, 7, (50, 2)) + rng.normal(size=(50, 2)) * 1e-12]
    spots = np.concatenate(spots)
    height = rng.uniform(-0.1, 0.1, len(spots)) + 0.25
    turn = random_rotation(rng) if turned else np.eye(3)
    centres = np.column_stack((spots, height)) @ turn.T
    for (gap, normal, _), h in zip(touch((vertices @ turn.T, faces), centres, 0.25, 1.0), height):
        assert len(gap) == 1
        assert abs(gap[0] - (h - 0.25)) < 1e-14
        np.testing.assert_allclose(normal[0], turn[:, 2], atol=1e-8)


@pytest.mark.parametrize("kind", ["waves", "cube", "pit"])
def test_the_least_gap_is_that_of_plain_loops(kind):
    rng = np.random.default_rng(2)
    if kind == "waves":
        surface = grid(6, lambda x, y: 0.6 * np.sin(2.0 * x) * np.cos(1.7 * y))
        centres = np.column_stack((rng.uniform(1.5, 4.5, (200, 2)), rng.uniform(0.8, 1.2, 200)))
    else:
        faces = triangles(CUBE_FACES)
        surface = (CUBE * 4, faces if kind == "cube" else faces[:, ::-1])
        centres = rng.uniform(-2.6, 2.6, (1000, 3)) if kind == "cube" else rng.uniform(-1.9, 1.9, (300, 3))
        if kind == "cube":
            centres = centres[np.max(np.abs(centres), axis=1) > 2.01]
    expected = np.array([nearest(*surface, x) for x in centres])
    if kind == "waves":  # in front of the surface, all of it
        assert expected.min() > 0.05
    found = touch(surface, centres, 0.1, 2.0)
    for (gap, normal, point), e, x in zip(found, expected, centres):
        assert abs(gap.min() - (e - 0.1)) < 1e-12
        np.testing.assert_allclose(point - x, -(0.1 + gap / 2)[:, None] * normal, atol=1e-12)
        for k in range(len(gap)):  # none twice
            assert np.all(np.linalg.norm(np.delete(point, k, axis=0) - point[k], axis=1) > 1e-9)
        assert len(gap) == 1 if kind == "cube" else True


def test_a_sphere_slides_over_the_edges_of_a_plane():
    """Without friction its speed along the plane is the same at every step, and it neither rises nor sinks."""
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    scene.add(cn.spheres([[0.5, 0.3, 0.25]], 0.25, ROCK, velocity=[[3.0, 1.0, 0, 0, 0, 0]]))
    scene.add(cn.surface(*grid(8, lambda x, y: 0 * x), GROUND))
    scene.interact(ROCK, GROUND, cn.Coulomb(mu=0.0))
    sim = cn.Simulation(scene, dt=2e-3, strategy=cn.NSCD(solver=cn.NLGS(tol=1e-12)))
    for _ in range(1000):
        sim.step()
        np.testing.assert_allclose(sim.bodies.velocity[0, :3], [3, 1, 0], atol=1e-9)
        assert len(sim.contacts.gap) == 1
    assert abs(sim.bodies.position[0, 2] - 0.25) < 1e-9


def hopper(**options):
    """Four slopes to a pit, ten spheres above."""
    rim, pit = 2.0, 0.4
    vertices = [[s * x, t * x, z] for x, z in ((rim, 1.5), (pit, 0)) for s, t in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
    faces = [[k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k] for k in range(4)] + [[4, 5, 6, 7]]
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    rng = np.random.default_rng(4)
    places = np.array([[0.45 * (k % 3 - 1), 0.45 * (k // 3 % 3 - 1), 1.0 + 0.45 * (k // 9)] for k in range(10)])
    scene.add(cn.spheres(places + rng.uniform(-0.02, 0.02, (10, 3)), 0.2, ROCK))
    scene.add(cn.surface(vertices, faces, GROUND, **options))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    scene.interact(ROCK, GROUND, cn.Coulomb(mu=0.3))
    return scene


def test_a_hopper_holds_its_spheres(tmp_path):
    """Impulses of the hopper equal the momentum gained beside gravity; the same bits from a file; a rising hopper lifts them."""
    scene = hopper()
    scene.save(tmp_path / "hopper.h5")
    dt, solver = 5e-3, cn.NLGS(tol=1e-6)
    sims = [cn.Simulation(s, dt, cn.NSCD(solver=solver)) for s in (scene, cn.Scene.load(tmp_path / "hopper.h5"))]
    for sim in sims:
        sim.run(steps=120, progress=False)
        before = sim.bodies.velocity[:10, 2]
        sim.step()
    assert np.array_equal(sims[0].bodies.position, sims[1].bodies.position)
    c, mass = sims[0].contacts, sims[0].bodies.mass[:10]
    carried = np.abs(c.impulse[np.any(c.bodies == 10, axis=1), 2]).sum()
    gained = mass @ (sims[0].bodies.velocity[:10, 2] - before + 9.81 * dt)
    assert carried == pytest.approx(gained, rel=1e-9) and carried > 0.3 * mass.sum() * 9.81 * dt
    assert sims[0].bodies.position[:10, 2].min() > 0.19
    sim = cn.Simulation(hopper(velocity=lambda t: (0, 0, 0.5)), dt, cn.NSCD(solver=solver))
    sim.run(steps=120, progress=False)
    assert sim.bodies.position[:10, 2].min() > 0.19 + 0.5 * sim.time


@pytest.mark.parametrize(
    "vertices, faces, words",
    [
        ([[0, 0, 0], [1, 0, 0], [0, 1, np.nan]], [[0, 1, 2]], "vertices.* nan"),
        ([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]], "no area"),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 3]], "vertex 3"),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, -1]], [[0, 1, 2], [1, 0, 3], [1, 0, 4]], "more than two triangles"),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 2], [1, 2, 3]], "looks the other way"),
    ],
)
def test_bad_surfaces_are_refused(vertices, faces, words):
    with pytest.raises((ValueError, cn.Error), match=words):
        scene = cn.Scene(3)
        scene.add(cn.surface(vertices, faces, GROUND))
