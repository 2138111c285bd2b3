"""Polygons, polyhedra and boxes as sets of bodies: mass and axes, shared hulls, refusals, files."""

import warnings

import cairn as cn
import numpy as np
import pytest
from shape_pairs import CUBE, CUBE_FACES, ROCK, random_polyhedron, random_rotation, triangles


def resting(sets, gravity=(0, 0, -9.81)):
    scene = cn.Scene(3, gravity=gravity)
    scene.add(*sets, cn.wall((0, 0, 0), (0, 0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.5))
    return scene


def pentagram():
    """Two pyramids on a star that crosses itself: closed, its volumes all positive."""
    angle = 4 * np.pi * np.arange(5) / 5
    points = np.vstack([np.column_stack((np.cos(angle), np.sin(angle), np.zeros(5))), [0, 0, 1], [0, 0, -1]])
    return points, [[k, (k + 1) % 5, 5] for k in range(5)] + [[(k + 1) % 5, k, 6] for k in range(5)]


def test_box_as_polyhedron_of_triangles_is_the_box():
    rng = np.random.default_rng(1)
    sizes, turn = np.array([1.0, 2.0, 3.0]), random_rotation(rng)
    meshes = [((CUBE * sizes) @ turn.T + [5, 6, 7], triangles(CUBE_FACES))]
    a, b = cn.polyhedra(meshes, ROCK), cn.boxes([[5, 6, 7]], sizes, ROCK)
    np.testing.assert_allclose(a.mass, b.mass, rtol=1e-14)
    np.testing.assert_allclose(np.sort(a.inertia), np.sort(b.inertia), rtol=1e-13)
    np.testing.assert_allclose(a.position, b.position, rtol=1e-14)
    core = cn._core.Scene(3)
    core.add_hulls(*a.contactors[0].hulls)
    assert len(core.hulls["offset"]) == 6 and len(core.hulls["edge"]) == 4 * 12


def test_bodies_share_a_shape_and_stand_where_told():
    places = np.array([[0, 0, 0.5], [3, 0, 0.5], [6, 0, 0.5]])
    tall = cn.polyhedra((CUBE + [0, 0, 0.0], CUBE_FACES), ROCK, position=places)
    assert len(tall.contactors[0].hulls) == 1 and len(tall) == 3
    np.testing.assert_array_equal(tall.position, places)
    sim = cn.Simulation(resting([tall]), dt=1e-3, strategy=cn.NSCD(solver=cn.NLGS(tol=1e-12)))
    sim.run(steps=3)
    assert len(sim.contacts.gap) == 12
    weight = 3 * 1000 * 9.81 * 1e-3
    np.testing.assert_allclose(sim.contacts.impulse.sum(axis=0), [0, 0, weight], atol=1e-10 * weight)


def test_needless_triangles_do_no_harm():
    """A triangle without area in an edge, and vertices in edges and faces, leave a cube of 8 vertices and 12 edges."""
    vertices = np.vstack([CUBE, [0, -0.5, -0.5], [0, 0, 0.5], [0.25, 0.25, 0.5]])
    top = [[4, 5, 9], [5, 7, 10], [7, 6, 9], [7, 9, 10], [9, 5, 10], [6, 4, 9]]
    faces = [[0, 2, 3, 1], [0, 1, 8], *top, [0, 8, 5, 4], [8, 1, 5], *CUBE_FACES[3:]]
    core = cn._core.Scene(3)
    core.add_hulls(*cn.polyhedra([(vertices, faces)], ROCK).contactors[0].hulls)
    assert len(core.hulls["offset"]) == 6 and len(core.hulls["edge"]) == 4 * 12


def test_polygons_of_any_number_of_corners_in_one_set():
    three, four = [[0, 0], [1, 0], [0, 1]], [[2, 0], [4, 0], [4, 1], [2, 1]]
    np.testing.assert_allclose(cn.polygons([three, np.array(four)], ROCK).mass, [500, 2000])
    np.testing.assert_allclose(cn.polygons([[three, four], four], ROCK).mass, [2500, 2000])
    corners = [[(np.cos(2 * np.pi * k / n), np.sin(2 * np.pi * k / n)) for k in range(n)] for n in (3, 10, 100, 1000)]
    scene = cn.Scene(2)
    scene.add(cn.polygons(corners, ROCK, position=3 * np.arange(4)[:, None] * [1, 0]))
    areas = [n / 2 * np.sin(2 * np.pi / n) for n in (3, 10, 100, 1000)]
    np.testing.assert_allclose(cn.polygons(corners, ROCK).mass, 1000 * np.array(areas), rtol=1e-12)


@pytest.mark.parametrize(
    "corners",
    [
        [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]],
        [(np.cos(4 * np.pi * k / 5), np.sin(4 * np.pi * k / 5)) for k in range(5)],  # its area counts the middle twice
        [[0, 0], [2, 0], [0, 1], [2, 1.5]],
    ],
)
def test_outlines_that_are_not_convex_are_refused(corners):
    with pytest.raises((ValueError, cn.Error), match="not convex.*convex_parts"):
        cn.Scene(2).add(cn.polygons([corners], ROCK))


def test_planes_that_hardly_differ_are_one_face_to_both():
    """Corners of a roof so flat that the tolerance of planes lies between the heights seen from its two halves."""
    for height in np.geomspace(1e-9, 1e-5, 60):
        vertices = np.vstack([CUBE, [0.3, 0.1, 0.5 + height]])
        faces = [*(f for f in CUBE_FACES if f != [4, 5, 7, 6]), [4, 5, 8], [5, 7, 8], [7, 6, 8], [6, 4, 8]]
        core = cn._core.Scene(3)
        core.add_hulls(*cn.polyhedra([(vertices, faces)], ROCK).contactors[0].hulls)
        assert 6 <= len(core.hulls["offset"]) <= 9


def test_body_of_several_parts():
    """An L of two boxes: mass and centre of the whole, six or more corners on the floor."""
    parts = [(CUBE * [3, 1, 1] + [1.5, 0, 0.5], CUBE_FACES), (CUBE + [0.5, 0, 1.5], CUBE_FACES)]
    body = cn.polyhedra([parts], ROCK)
    assert body.mass[0] == pytest.approx(4000)
    np.testing.assert_allclose(body.position[0], [(3 * 1.5 + 0.5) / 4, 0, (3 * 0.5 + 1.5) / 4])
    sim = cn.Simulation(resting([body]), dt=1e-3)
    sim.run(steps=5)
    assert np.abs(sim.bodies.velocity[0]).max() < 1e-4


@pytest.mark.parametrize(
    "mesh, words",
    [
        ((CUBE, CUBE_FACES[:-1]), "open"),
        ((CUBE, triangles(CUBE_FACES)[:-1]), "open"),
        ((np.where(np.arange(8)[:, None] == 3, np.nan, CUBE), CUBE_FACES), "meshes\\[0\\].* nan"),
        ((CUBE, [t for k, t in enumerate(triangles(CUBE_FACES)) if k not in (0, 2)]), "open"),
        ((CUBE * [1, 1, 0], CUBE_FACES), "volume"),
        ((CUBE, [f[::-1] for f in CUBE_FACES]), "inside out"),
        ((np.vstack([CUBE, [0, 0, 0]]), [*CUBE_FACES[:-1], [1, 3, 8], [3, 7, 8], [7, 5, 8], [5, 1, 8]]), "convex"),
        ((CUBE, [*CUBE_FACES[:-1], [1, 3, 9, 5]]), r"faces\[5\]"),
        (pentagram(), "convex"),
    ],
)
def test_bad_meshes_are_refused(mesh, words):
    with pytest.raises((ValueError, cn.Error), match=words):
        scene = cn.Scene(3)
        scene.add(cn.polyhedra([mesh], ROCK))


def test_scene_file_and_checkpoint_keep_shapes(tmp_path):
    scene = resting([cn.boxes([[0, 0, 0.5], [0, 0, 1.5]], 1.0, ROCK)])
    scene.save(tmp_path / "scene.h5")
    sims = [cn.Simulation(s, dt=1e-3) for s in (scene, cn.Scene.load(tmp_path / "scene.h5"))]
    for sim in sims:
        sim.run(steps=4)
    assert np.array_equal(sims[0].bodies.position, sims[1].bodies.position)
    sims[0].checkpoint(tmp_path / "state.h5")
    other = cn.Simulation(scene, dt=1e-3)
    other.restore(tmp_path / "state.h5")
    for sim in (sims[1], other):
        sim.run(steps=4)
    assert np.array_equal(sims[1].bodies.velocity, other.bodies.velocity)
    assert np.array_equal(sims[1].contacts.impulse, other.contacts.impulse)


def test_what_detection_remembers_changes_no_bit(tmp_path):
    """A falling heap of stones: a whole run, a run restarted every few steps, without remembered features, and a run with two
    threads."""
    rng = np.random.default_rng(3)
    place = np.array([[x, y, z] for z in range(5) for y in range(3) for x in range(3)]) * 1.5 + rng.uniform(-0.2, 0.2, (45, 3))
    stones = [random_polyhedron(rng) for _ in place]
    scene = resting([cn.polyhedra([(v + p + [0, 0, 1], f) for (v, f), p in zip(stones, place)], ROCK)], (0, 0, -100))

    def simulation(threads):
        strategy = cn.NSCD(solver=cn.NLGS(tol=1e-4, max_iter=50), threads=threads)
        return cn.Simulation(scene, dt=2e-3, strategy=strategy, overlap="ignore")

    whole, two, parts = simulation(1), simulation(2), simulation(1)
    for k in range(12):
        whole.run(steps=5, progress=False)
        two.run(steps=5, progress=False)
        parts.run(steps=5, progress=False)
        parts.checkpoint(tmp_path / f"{k}.h5")
        parts = simulation(1)
        parts.restore(tmp_path / f"{k}.h5")
    assert len(whole.contacts) > 40
    for other in (two, parts):
        assert np.array_equal(whole.bodies.position, other.bodies.position)
        assert np.array_equal(whole.bodies.velocity, other.bodies.velocity)


def test_shapes_that_do_not_meet_are_told_once():
    rock = cn.Material("rock", density=2000.0)
    scene = cn.Scene(2, gravity=(0, -9.81))
    scene.add(cn.ring((0, 0), 5.0, rock), cn.polygons([[[0, 0], [1, 0], [0, 1]]], rock))
    scene.interact(rock, rock, cn.Coulomb(mu=0.3))
    with pytest.warns(cn.ShapesWarning, match="polygon and ring"):
        sim = cn.Simulation(scene, 1e-3, cn.NSCD())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sim.add(cn.disks([[-2.0, 0.0]], 0.5, rock))  # meets both


def test_what_shapes_are_is_asked_of_their_list():
    core = cn._core
    assert core.shapes("ball", "mover") == ["disk", "sphere"]
    assert set(core.shapes("faced")) <= set(core.shapes("mover", "hull")) < set(core.shapes("hull", "bounded"))
    known = {frozenset(pair) for pair in core.pairs()}
    for shape in core.shapes("mover"):  # bodies that move meet their own like and an endless wall
        assert frozenset((shape,)) in known
        assert any(frozenset((shape, wall)) in known for wall in ("half_plane", "plane"))
    with pytest.raises(ValueError, match="which shapes are wooden"):
        core.shapes("mover", "wooden")
