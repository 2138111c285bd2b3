"""Pairs of shapes without a kernel: bodies of them that can move against each other are told of, and no others."""

import itertools
import warnings

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=2000.0)
SHEET = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0.0]])
FREE = {2: {"mass": 1.0, "inertia": 0.1, "free": ("vx", "vy", "w")}, 3: {"mass": 1.0, "inertia": (1.0, 1.0, 1.0), "free": "vz"}}
PLANE = {
    "disk": lambda p, **o: cn.disks([p], 0.1, ROCK),
    "polygon": lambda p, **o: cn.polygons([[-0.1, -0.1], [0.1, -0.1], [0, 0.1]], ROCK, position=[p]),
    "segment": lambda p, **o: cn.segment(np.subtract(p, (0.5, 0)), np.add(p, (0.5, 0)), ROCK, radius=0.05, **o),
    "ring": lambda p, **o: cn.ring(p, 1.0, ROCK, **o),
    "half_plane": lambda p, **o: cn.wall(p, (0, 1), ROCK, **o),
}
SPACE = {
    "sphere": lambda p, **o: cn.spheres([p], 0.1, ROCK),
    "polyhedron": lambda p, **o: cn.boxes([p], (0.2, 0.2, 0.2), ROCK),
    "capsule": lambda p, **o: cn.capsules([p], 0.2, 0.1, ROCK),
    "cylinder": lambda p, **o: cn.cylinders([p], 0.2, 0.1, ROCK),
    "superquadric": lambda p, **o: cn.superquadrics([p], (0.1, 0.2, 0.3), (0.5, 0.5), ROCK),
    "facet": lambda p, **o: cn.surface(SHEET + p, [[0, 1, 2], [0, 2, 3]], ROCK, **o),
    "plane": lambda p, **o: cn.wall(p, (0, 0, 1), ROCK, **o),
    "tube": lambda p, **o: cn.tube(p, (0, 0, 1), 1.0, ROCK, **o),
}
STRATEGIES = {"nscd": cn.NSCD, "smooth": cn.SmoothDEM, "events": cn.EventDriven}


def scene_of(dim, *sets, law=None):
    scene = cn.Scene(dim)
    scene.add(*sets)
    if law is not False:
        scene.interact("*", "*", law or cn.Coulomb(mu=0.3))
    return scene


def told(scene, strategy=None):
    """Texts of the warnings of a new simulation, and the simulation."""
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        sim = cn.Simulation(scene, 1e-3, strategy, overlap="ignore")
    return [str(w.message) for w in found if w.category is cn.ShapesWarning], sim


PAIRS = [(2, PLANE, pair) for pair in itertools.combinations_with_replacement(PLANE, 2)]
PAIRS += [(3, SPACE, pair) for pair in itertools.combinations_with_replacement(SPACE, 2)]


@pytest.mark.parametrize("dim, made, pair", PAIRS, ids=lambda x: "-".join(x) if isinstance(x, tuple) else "")
def test_every_pair_of_shapes_that_has_no_kernel_is_told(dim, made, pair):
    """With the first body free, with the second, with none."""
    known = frozenset(pair) in {frozenset(p) for p in cn._core.pairs()}
    at, away = np.zeros(dim), np.full(dim, 3.0)
    movers = [name in cn._core.shapes("mover") for name in pair]
    for first, second in ((True, False), (False, True), (False, False)):
        a = made[pair[0]](at, **(FREE[dim] if first else {}))
        b = made[pair[1]](away, **(FREE[dim] if second else {}))
        words, _ = told(scene_of(dim, a, b))
        moves = first or second or any(movers)
        assert len(words) == (moves and not known), (pair, first, second, words)
        for word in words:
            assert "no contact between shapes {} and {}: bodies such as 0 and 1".format(*sorted(pair)) in word


@pytest.mark.parametrize("name", STRATEGIES)
def test_every_strategy_tells_of_bars_that_fall_through_a_wall(name):
    law = cn.LinearSpring(stiffness=1e4) if name == "smooth" else cn.Restitution(normal=0.5, mu=0.0)
    sets = [PLANE["segment"]((0, 1.0), **FREE[2]), PLANE["half_plane"]((0, 0))]
    words, _ = told(scene_of(2, *sets, law=law), STRATEGIES[name]())
    assert len(words) == 1 and "half_plane and segment" in words[0]


def test_what_may_pass_or_is_held_is_not_told():
    ring, bar = PLANE["ring"]((0, 0)), PLANE["segment"]((0, 0), **FREE[2])
    scene = scene_of(2, ring.with_(group="drum"), bar.with_(group="bar"))
    scene.interact("drum", "bar", None)  # on purpose
    words, sim = told(scene)
    assert not words
    with pytest.warns(cn.ShapesWarning, match="ring and segment"):
        sim.interact("drum", "bar", cn.Coulomb(mu=0.3))
    held = scene_of(2, cn.polygons([[-0.1, -0.1], [0.1, -0.1], [0, 0.1]], ROCK, position=[[0, 0]], fixed=True), ring)
    words, sim = told(held)
    assert not words
    with pytest.warns(cn.ShapesWarning, match="polygon and ring"):
        sim.drive([0], (), None)  # let go
    one = cn.surface(SHEET, [[0, 1, 2], [0, 2, 3]], ROCK, **FREE[3])  # triangles of one body
    assert not told(scene_of(3, one))[0]


def test_walls_are_told_of_unless_bodies_lie_between():
    """A lid on grains meets the other walls nowhere else than they keep it; one on nothing falls through the floor."""
    lid, floor = cn.wall((0, 2), (0, -1), ROCK, mass=1.0, free="vy"), cn.wall((0, 0), (0, 1), ROCK)
    assert not told(scene_of(2, lid, floor, cn.disks([[0, 0.5]], 0.5, ROCK)))[0]
    words, sim = told(scene_of(2, lid, floor))
    assert len(words) == 1 and "half_plane and half_plane" in words[0]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sim.add(cn.disks([[0, 0.5]], 0.5, ROCK))


def test_meshes_that_touch_by_sides_alone_are_told():
    points, cells = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]]), {"quad": [[0, 1, 2, 3]]}
    block = lambda high: cn.ElasticBody(
        points + [0, high], cells, young=1e7, poisson=0.3, density=1000.0, groups={"all": [0, 1, 2, 3]}
    )
    words, _ = told(scene_of(2, *(cn.deformable(block(h), ROCK, edges="all", name=f"at {h}") for h in (0.0, 1.5))))
    assert len(words) == 1 and "sides of meshes have no contact with shapes segment" in words[0]


def test_a_rule_that_the_scene_gets_in_a_run_is_looked_at():
    pieces = SPACE["facet"]((0, 0, 0), **FREE[3]), SPACE["plane"]((0, 0, -1))
    scene = scene_of(3, *pieces, law=False)
    scene.interact("*", "*", None)
    words, sim = told(scene)
    assert not words
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    with pytest.warns(cn.ShapesWarning, match="no contact between shapes facet and plane"):
        sim.step()
