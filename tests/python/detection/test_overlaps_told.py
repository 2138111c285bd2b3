"""Overlaps that grow, bodies in one place, walls that look away, bodies that pass through each other, told with figures."""

import functools
import re
import warnings

import cairn as cn
import numpy as np
import pytest
from cairn.run.sinking import WINDOW, Sinking

ROCK = cn.Material("rock", density=1000.0)
SHEET = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0.0]])


def caught(run, kind=cn.OverlapWarning):
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        run()
    return [str(w.message) for w in found if w.category is kind]


def column(tol, scale=1.0, count=60):
    """Disks of radius .5 m times scale that settle on each other between two walls, each beside the one below."""
    places = np.stack([0.1 * (-1.0) ** np.arange(count), 0.5 + np.arange(count) * 0.96**0.5], axis=1)
    scene = cn.Scene(2, gravity=(0, -10.0 * scale))
    scene.add(cn.disks(scale * places, 0.5 * scale, ROCK), cn.wall((0, 0), (0, 1), ROCK))
    scene.add(cn.wall((-0.6 * scale, 0), (1, 0), ROCK), cn.wall((0.6 * scale, 0), (-1, 0), ROCK))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, 5e-3, cn.NSCD(solver=cn.NLGS(tol=tol)), overlap="ignore")


def test_overlap_that_a_tolerance_lets_grow_is_told():
    sim, large, tight = column(0.1), column(0.1, 2.0**20), column(1e-6)
    words = caught(lambda: [sim.step() for _ in range(110)])
    assert len(words) == 1
    found = re.search(r"bodies (\d+) and (\d+) overlap by ([\d.]+) of the smaller one's size .* up from ([\d.]+)", words[0])
    assert float(found[3]) > 0.05 > float(found[4]) and "give a smaller tol or dt, or project_positions=True" in words[0]
    assert caught(lambda: [large.step() for _ in range(110)]) == words  # no length is built in
    assert not caught(lambda: [tight.step() for _ in range(110)])
    assert tight.info["largest_penetration"] < 1e-6 < 0.05 < sim.info["largest_penetration"]


def test_overlap_that_a_law_asks_for_is_not_told():
    """A spring under a growing weight."""
    scene = cn.Scene(2, gravity=cn.Table([0, 1], [[0, 0], [0, -500.0]]))
    scene.add(cn.disks([[0, 0.5]], 0.5, ROCK), cn.wall((0, 0), (0, 1), ROCK))
    scene.interact("*", "*", cn.ElasticContact(stiffness=2e6, mu=0.0))
    sim = cn.Simulation(scene, 5e-3)
    assert not caught(lambda: [sim.step() for _ in range(200)])
    assert sim.info["largest_penetration"] > 0.3


SHAPES = {
    "disk": lambda p: cn.disks([p[:2]], 0.1, ROCK),
    "polygon": lambda p: cn.polygons([[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]], ROCK, position=[p[:2]]),
    "sphere": lambda p: cn.spheres([p], 0.1, ROCK),
    "box": lambda p: cn.boxes([p], (1, 1, 0.1), ROCK),
    "capsule": lambda p: cn.capsules([p], 0.2, 0.1, ROCK),
    "cylinder": lambda p: cn.cylinders([p], 0.2, 0.1, ROCK),
    "superquadric": lambda p: cn.superquadrics([p], (0.1, 0.2, 0.3), (0.5, 0.5), ROCK),
}


@pytest.mark.parametrize("name", SHAPES)
def test_bodies_in_one_place_are_told_by_their_ids(name):
    """There at the start, there at the start of who did not want to hear of overlaps, put there, come in there."""
    dim, made, there, away = (2 if name in ("disk", "polygon") else 3), SHAPES[name], np.zeros(3), np.full(3, 9.0)

    def scene(*sets):
        out = cn.Scene(dim)
        out.add(*sets)
        out.interact("*", "*", cn.Coulomb(mu=0.3))
        return out

    assert "bodies 0 and 1 by 2" in caught(lambda: cn.Simulation(scene(made(there), made(there)), 1e-3))[0]
    sim = cn.Simulation(scene(made(there), made(there)), 1e-3, overlap="ignore")
    assert re.search(r"bodies 0 and 1 overlap by 2\d\d% .* in step 1: one lies within", caught(sim.step)[0])
    sim = cn.Simulation(scene(made(there), made(away)), 1e-3)
    sim.bodies.set(position=np.zeros((2, dim)))
    assert re.search(r"bodies 0 and 1 overlap by 2\d\d% .* in step 1", caught(sim.step)[0])
    sim = cn.Simulation(scene(made(there)), 1e-3)
    sim.step()
    sim.add(made(there))
    assert re.search(r"of the bodies added before step 2, 1 pairs overlap.* bodies 0 and 1 by 2", caught(sim.step)[0])


def walled(*walls, dim=2, at=((0.0, 1.0), (1.0, 2.0)), **options):
    scene = cn.Scene(dim)
    shape = cn.disks if dim == 2 else cn.spheres
    scene.add(shape(np.reshape(at, (-1, dim)), 0.1, ROCK), *walls)
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    return lambda: cn.Simulation(scene, 1e-3, **options)


def test_a_wall_that_looks_away_is_told_by_its_id():
    away, right = cn.wall((0, 0), (0, -1), ROCK), cn.wall((-1, 0), (1, 0), ROCK)
    words = "all bodies lie behind wall 2: turn its normal (0, -1), which points out of the solid"
    for options in ({}, {"overlap": "ignore"}):
        found = caught(walled(away, right, **options))
        assert len(found) == 1 and words in found[0]
    with pytest.raises(ValueError, match="all bodies lie behind wall 2"):
        walled(away, right, overlap="error")()
    assert not caught(walled(cn.wall((0, 0), (0, 1), ROCK), right))
    assert not caught(walled(cn.wall((0, 1.5), (0, 1), ROCK), overlap_share=9.0))  # one lies in front
    sheet = [[0, 1, 2], [0, 2, 3]]
    above = ((0.0, 0.0, 0.3), (0.5, 0.2, 0.4))
    assert "all bodies lie behind wall 2" in caught(walled(cn.wall((0, 0, 0), (0, 0, -1), ROCK), dim=3, at=above))[0]
    turned = cn.surface(SHEET, [t[::-1] for t in sheet], ROCK)
    assert "all bodies lie behind surface 2: turn its triangles round" in caught(walled(turned, dim=3, at=above))[0]
    assert not caught(walled(cn.surface(SHEET, sheet, ROCK), dim=3, at=above))


def test_a_wall_that_looks_away_from_bodies_that_come_in_is_told():
    scene = cn.Scene(2)
    scene.add(cn.wall((0, 0), (0, -1), ROCK))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 1e-3)
    assert "all bodies lie behind wall 0" in caught(lambda: sim.add(cn.disks([[0, 1.0]], 0.1, ROCK)))[0]
    apart = cn.Scene(2)
    apart.add(cn.wall((0, 0), (0, -1), ROCK, group="lid"), cn.disks([[0, 1.0]], 0.1, ROCK, group="grains"))
    apart.interact("lid", "grains", None)
    assert not caught(lambda: cn.Simulation(apart, 1e-3))


THIN = {
    "box": (3, lambda: cn.boxes([[0, 0, 0]], (1, 1, 0.02), ROCK, fixed=True)),
    "turned box": (3, lambda: cn.boxes([[0, 0, 0]], (1, 0.02, 1), ROCK, fixed=True, rotation=[[0.5**0.5, 0.5**0.5, 0, 0]])),
    "sphere": (3, lambda: cn.spheres([[0.08, 0, 0]], 0.1, ROCK)),
    "capsule": (3, lambda: cn.capsules([[0, 0, 0]], 0.05, 1.0, ROCK, rotation=[[0.5**0.5, 0, 0.5**0.5, 0]])),
    "cylinder": (3, lambda: cn.cylinders([[0.3, 0, 0]], 0.5, 0.02, ROCK)),
    "superquadric": (3, lambda: cn.superquadrics([[0, 0, 0]], (0.5, 0.5, 0.05), (0.5, 0.5), ROCK)),
    "disk": (2, lambda: cn.disks([[0.05, 0]], 0.1, ROCK)),
    "bar": (2, lambda: cn.segment((-1, 0), (1, 0), ROCK, radius=0.01)),
    "polygon": (2, lambda: cn.polygons([[[-1, -0.01], [1, -0.01], [1, 0.01], [-1, 0.01]]], ROCK, fixed=True)),
}


def thrown(dim, target, across=0.0, scale=1.0, dt=1e-2):
    """A ball of radius .1 m at 100 m/s, .2 m above its target."""
    scene, velocity, start = cn.Scene(dim), np.zeros(3 * dim - 3), np.zeros(dim)
    velocity[dim - 1], start[dim - 1], start[0] = -100.0 * scale, 0.2 * scale, across
    ball = (cn.spheres if dim == 3 else cn.disks)([start], 0.1 * scale, ROCK, velocity=[velocity])
    scene.add(ball, target)
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, dt)


@pytest.mark.parametrize("name", THIN)
def test_a_ball_that_passes_through_a_body_within_a_step_is_told(name):
    dim, made = THIN[name]
    sim = thrown(dim, made())
    found = caught(sim.step, cn.TunnellingWarning)
    words = (
        "body 0 passed through body 1 in step 1: at 100 m/s it moves 10 times its size of 0.1 m in a step of 0.01 s; give a dt"
    )
    assert len(found) == 1 and words in found[0] and "of at most 0.001 s" in found[0]
    assert sim.bodies.position[0, dim - 1] < -0.5
    assert not caught(thrown(dim, made(), across=2.5).step, cn.TunnellingWarning)  # past it
    slow = thrown(dim, made(), dt=1e-3)
    assert not caught(lambda: [slow.step() for _ in range(20)], cn.TunnellingWarning)
    assert slow.bodies.position[0, dim - 1] > -0.3 or name in ("sphere", "disk", "capsule", "cylinder", "superquadric")


@pytest.mark.parametrize("name", ["bar", "polygon", "disk"])
@pytest.mark.parametrize("start", [0.25, 0.3, 0.35, 0.4, 0.43])
def test_a_body_found_behind_the_middle_of_another_one_is_told(name, start):
    """The body overlaps on the far side, slightly for some starts, and moves on."""
    scene = cn.Scene(2)
    scene.add(cn.disks([[0, start]], 0.1, ROCK, velocity=[[0, -100.0, 0]]), THIN[name][1]())
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 1e-2)
    assert "body 0 passed through body 1 in step 1" in caught(sim.step, cn.TunnellingWarning)[0]
    assert sim.bodies.position[0, 1] < 0


def test_fast_bodies_that_are_stopped_or_meet_nothing_are_not_told():
    steps = lambda sim: [sim.step() for _ in range(12)]
    for start in (5.0, 5.3, 5.77):
        scene = cn.Scene(3)
        scene.add(cn.spheres([[0, 0, start]], 0.1, ROCK, velocity=[[0, 0, -100.0, 0, 0, 0]]), THIN["box"][1]())
        scene.interact("*", "*", cn.Coulomb(mu=0.3))
        stopped = cn.Simulation(scene, 1e-2)
        assert not caught(functools.partial(steps, stopped), cn.TunnellingWarning)
        assert stopped.bodies.position[0, 2] == pytest.approx(0.11, abs=1e-9)
    scene.interact("*", "*", None)
    assert not caught(functools.partial(steps, cn.Simulation(scene, 1e-2)), cn.TunnellingWarning)


def test_the_largest_overlap_stands_beside_the_error(tmp_path, capsys):
    from cairn import cli

    sim = column(0.1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        sim.run(steps=60, output=tmp_path / "a.vtkhdf", progress="always")
    line = capsys.readouterr().err
    largest = max(cn.load(tmp_path / "a.vtkhdf").history["penetration"])
    assert sim.info["largest_penetration"] == largest >= sim.info["penetration"] > 0
    assert re.search(r"residual [\d.e-]+ · overlap [\d.]+ %", line)
    assert (
        f"error {sim.info['error']:.2g}; deepest overlap" in sim.explain()
        and f"{largest:.2g} in the steps so far" in sim.explain()
    )
    assert cli.main(["info", str(tmp_path / "a.vtkhdf")]) == 0
    assert re.search(rf"error, largest .*\n +overlap, largest +{largest:.3g} of the smaller body's size", capsys.readouterr().out)


BALL = {
    2: {
        "disk": lambda: cn.disks([[0, 0]], 0.05, ROCK),
        "polygon": lambda: cn.polygons([[[-0.05, -0.05], [0.05, -0.05], [0, 0.05]]], ROCK, fixed=True),
    },
    3: {
        "sphere": lambda: cn.spheres([[0, 0, 0]], 0.05, ROCK),
        "box": lambda: cn.boxes([[0, 0, 0]], 0.1, ROCK, fixed=True),
        "capsule": lambda: cn.capsules([[0, 0, 0]], 0.05, 0.1, ROCK),
        "superquadric": lambda: cn.superquadrics([[0, 0, 0]], 0.05, (0.5, 0.5), ROCK),
    },
}
LARGE = {
    2: {
        "bar": lambda v: cn.segment((-0.6, 0.3), (1.4, 0.3), ROCK, radius=0.02, velocity=(0, -v)),
        "line": lambda v: cn.segment((-0.6, 0.3), (1.4, 0.3), ROCK, velocity=(0, -v)),
        "free line": lambda v: cn.segment((-0.6, 0.3), (1.4, 0.3), ROCK, velocity=(0, -v), **FREE_LINE),
        "plate": lambda v: cn.polygons([[[-0.6, 0.3], [1.4, 0.3], [1.4, 0.34], [-0.6, 0.34]]], ROCK, velocity=[[0, -v, 0]]),
    },
    3: {
        "plate": lambda v: cn.boxes([[0.4, 0, 0.3]], (2, 2, 0.02), ROCK, velocity=[[0, 0, -v, 0, 0, 0]]),
        "sheet": lambda v: cn.surface(SHEET + [0.4, 0.1, 0.3], [[0, 2, 1], [0, 3, 2]], ROCK, velocity=(0, 0, -v)),
        "rod": lambda v: cn.capsules([[0.4, 0, 0.3]], 0.02, 2.0, ROCK, axis=(1, 0, 0), velocity=[[0, 0, -v, 0, 0, 0]]),
        "coin": lambda v: cn.cylinders([[0.4, 0, 0.3]], 1.0, 0.02, ROCK, velocity=[[0, 0, -v, 0, 0, 0]]),
    },
}
FREE_LINE = {"mass": 1.0, "inertia": 1.0, "free": ("vx", "vy", "w")}


@pytest.mark.parametrize("dim, what, small", [(d, a, b) for d in BALL for a in LARGE[d] for b in BALL[d]])
def test_a_large_body_that_passes_through_a_small_one_is_told(dim, what, small):
    """The middle of the large one passes beside the small one, and its end goes through it."""

    def made(speed):
        scene = cn.Scene(dim)
        scene.add(LARGE[dim][what](speed), BALL[dim][small]())
        scene.interact("*", "*", cn.Coulomb(mu=0.3))
        return cn.Simulation(scene, 1e-2)

    found = caught(made(100.0).step, cn.TunnellingWarning)
    assert len(found) == 1 and re.search(r"body 1 passed through body 0 in step 1: at 100 m/s", found[0])
    assert not caught(made(1.0).step, cn.TunnellingWarning)


@pytest.mark.parametrize("mover", ["line", "disk"])
def test_what_slides_fast_along_a_line_has_not_passed_through_it(mover):
    scene = cn.Scene(2)
    speed = (100.0, 0.0)
    scene.add(cn.disks([[-3, 0.05]], 0.05, ROCK, velocity=[[100.0, 0, 0]] if mover == "disk" else None))
    scene.add(cn.segment((-9, 0), (9, 0), ROCK, velocity=speed if mover == "line" else None))
    scene.interact("*", "*", cn.Frictionless())
    sim = cn.Simulation(scene, 1e-2)
    assert not caught(lambda: [sim.step() for _ in range(5)], cn.TunnellingWarning)


def test_an_overlap_that_comes_at_once_is_told():
    """A box tips over the border of a sheet of 1 mm, which its corner meets from below; one that is put into another."""
    corners = np.array([[x, y, z] for z in (-0.001, 0.0) for y in (-1, 1) for x in (-1, 1)], dtype=float)
    faces = [[0, 2, 3], [0, 3, 1], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4], [2, 6, 7], [2, 7, 3], [0, 4, 6], [0, 6, 2]]
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    scene.add(cn.surface(corners, [*faces, [1, 3, 7], [1, 7, 5]], ROCK))
    turned = np.array([0.208, -0.326, -0.225, -0.894])
    scene.add(cn.boxes([[0.03, 1.0243, 0.17]], 0.16, ROCK, rotation=[turned / np.linalg.norm(turned)]))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 1e-3, overlap="ignore")
    words = caught(lambda: [sim.step() for _ in range(600)])
    assert len(words) == (sim.info["largest_penetration"] > 0.1)  # none where the contact is right
    assert all("of the smaller one's size at once in step" in text for text in words)

    apart = cn.Scene(3)
    apart.add(cn.spheres([[0, 0, 0], [1, 0, 0]], 0.1, ROCK))
    apart.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = cn.Simulation(apart, 1e-3)
    sim.step()
    sim.bodies.set(position=[[0, 0, 0], [0.15, 0, 0]])
    assert "bodies 0 and 1 overlap by 0.5 of the smaller one's size at once in step 2" in caught(sim.step)[0]
    assert not caught(sim.step)


@pytest.mark.parametrize("speed", [10.0, 60.0])
def test_a_fast_impact_is_no_leap(speed):
    """Its overlap is at most its displacement in a step."""
    scene = cn.Scene(3)
    velocity = [[0, 0, -speed, 0, 9.0, 0]]
    scene.add(cn.cylinders([[0, 0, 0.5]], 0.1, 0.4, ROCK, axis=(1, 0, 1), velocity=velocity), cn.wall((0, 0, 0), (0, 0, 1), ROCK))
    scene.interact("*", "*", cn.Restitution(normal=0.5, mu=0.3))
    sim = cn.Simulation(scene, 1e-3)
    assert not any("at once" in text for text in caught(lambda: [sim.step() for _ in range(60)]))


SPRING = cn.LinearSpring(stiffness=1e4, restitution=0.5, mu=0.3)
OTHERS = {
    "carpenter": (cn.Carpenter(), cn.Coulomb(mu=0.3), 1e-3),
    "granular element": (cn.GranularElement(stiffness=1e6), cn.Coulomb(mu=0.3), 1e-3),
    "smooth": (cn.SmoothDEM(), SPRING, 1e-4),
}


@pytest.mark.parametrize("name", OTHERS)
def test_bodies_in_one_place_are_told_by_every_strategy(name):
    strategy, law, dt = OTHERS[name]
    scene = cn.Scene(2)
    scene.add(cn.disks([[0, 0], [0, 0]], 0.1, ROCK))
    scene.interact("*", "*", law)
    sim = cn.Simulation(scene, dt, strategy, overlap="ignore")
    assert re.search(r"bodies 0 and 1 overlap by (200|1\d\d)% .* in step 1: one lies within", caught(sim.step)[0])


def test_springs_too_soft_for_their_load_are_told():
    scene = cn.Scene(2, gravity=(0, -9.81))
    scene.add(cn.disks([[0, 0.1]], 0.1, ROCK), cn.wall((0, 0), (0, 1), ROCK))
    scene.interact("*", "*", cn.LinearSpring(stiffness=1e3, restitution=0.5, mu=0.3))
    sim = cn.Simulation(scene, 1e-4, cn.SmoothDEM())
    words = caught(lambda: [sim.step() for _ in range(1500)])
    assert len(words) == 1 and "springs are too soft for what they carry" in words[0]


def test_only_overlap_that_keeps_growing_is_told():
    """A window whose overlap falls takes back a rise: overlap that swings is no sinking, overlap that grows three times is."""
    swings = [0.1 + 0.01 * (k // 2) + 0.02 * (k % 2) for k in range(24)]

    def told(levels):
        sinking = Sinking()
        return [sinking.look(level, 0.0) for level in levels for _ in range(WINDOW)]

    assert not any(told(swings))
    grown = told([0.1, 0.11, 0.12])
    assert grown[-1] == (0.0, 3 * WINDOW) and not any(grown[:-1])


def test_a_rebound_that_comes_late_is_named():
    """A disk at .6 of its diameter a step: Restitution acts once it has touched."""
    rock = cn.Material("rock", density=2600.0)
    scene = cn.Scene(2)
    scene.add(cn.disks([(0.0, 0.0101)], 0.01, rock, velocity=[(0.0, -12.0)]), cn.wall((0, 0), (0, 1), rock))
    scene.interact(rock, rock, cn.Restitution(normal=0.5, mu=0.3))
    sim = cn.Simulation(scene, 1e-3)
    with pytest.warns(cn.OverlapWarning, match="rebound acts once bodies touch.*project_positions=True"):
        for _ in range(3):
            sim.step()
