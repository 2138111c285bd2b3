"""Bodies at rest stay at rest: residuals of the same sign do not add up to a drift over many steps."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=2000.0)


def tower(count=20, top=1.0, size=1.0):
    """Cubes on each other, the uppermost `top` times as heavy, on a floor."""
    heavy = cn.Material("heavy", density=2000.0 * top)
    scene = cn.Scene(3, gravity=(0, 0, -9.81 * size))
    centers = size * np.stack([np.zeros(count), np.zeros(count), np.arange(count) + 0.5], -1)
    scene.add(cn.boxes(centers[:-1], [size] * 3, ROCK), cn.boxes(centers[-1:], [size] * 3, heavy))
    scene.add(cn.wall((0, 0, 0), (0, 0, 1), ROCK))
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    return scene


def wall(columns=8, rows=8):
    """Bricks in a running bond, in the plane."""
    scene = cn.Scene(2, gravity=(0, -9.81))
    brick = np.array([[-0.5, -0.25], [0.5, -0.25], [0.5, 0.25], [-0.5, 0.25]])
    for k in range(rows):
        scene.add(*[cn.polygons(brick + [i + 0.5 * (k % 2), 0.5 * k + 0.25], ROCK) for i in range(columns)])
    scene.add(cn.wall((0, 0), (0, 1), ROCK))
    scene.interact("*", "*", cn.Coulomb(mu=0.6))
    return scene


def arch(stones=31):
    """Half a ring of wedges between radii of 4 and 5 m."""
    scene, angle = cn.Scene(2, gravity=(0, -9.81)), np.linspace(0, np.pi, stones + 1)
    rim = np.stack([np.cos(angle), np.sin(angle)], -1)
    scene.add(*[cn.polygons([4 * a, 5 * a, 5 * b, 4 * b], ROCK) for a, b in zip(rim[:-1], rim[1:], strict=True)])
    scene.add(cn.wall((0, 0), (0, 1), ROCK))
    scene.interact("*", "*", cn.Coulomb(mu=0.8))
    return scene


def moved(sim, steps):
    """The largest way of a body, each step converged [m]."""
    start = sim.bodies.position.copy()
    for _ in range(steps):
        assert sim.step()["status"] == "converged"
    return np.abs(sim.bodies.position - start).max()


@pytest.mark.parametrize("top", [1.0, 10.0, 1e3])
def test_a_tower_of_cubes_stands(top):
    """By 2e-6 of a cube in each second, where it swayed by 4e-4."""
    assert moved(cn.Simulation(tower(top=top), 1 / 240), 480) < 1e-7


@pytest.mark.parametrize("scene", [lambda: tower(60), wall, arch], ids=["60 cubes", "wall", "arch"])
def test_walls_and_arches_stand(scene):
    """By nothing that shows, however many contacts there are."""
    assert moved(cn.Simulation(scene(), 1 / 200), 400) < 1e-7


def test_a_push_is_answered():
    """A tower at rest is pushed from the side: it stands under a hundredth of its friction limit, and slides under 1.1 of it."""
    for share, slides in ((0.01, False), (1.1, True)):
        push = share * 0.5 * 2000.0 * 4 * 9.81
        scene = cn.Scene(3, gravity=(0, 0, -9.81))
        later = lambda t, push=push: (push if t > 0.1 else 0.0, 0, 0, 0, 0, 0)
        scene.add(cn.boxes([[0, 0, 0.5]], [1.0] * 3, ROCK, force=later))
        scene.add(cn.boxes([[0, 0, 1.5 + k] for k in range(3)], [1.0] * 3, ROCK), cn.wall((0, 0, 0), (0, 0, 1), ROCK))
        scene.interact("*", "*", cn.Coulomb(mu=0.5))
        way = moved(cn.Simulation(scene, 1 / 240, cn.NSCD(solver=cn.Default(max_iter=5000))), 120)
        assert way > 0.01 if slides else way < 1e-7


def test_what_begins_to_move_slowly_moves():
    """A cube on a slope, steeper than friction by a thousandth of gravity, beside a tower: it slides by a t^2 / 2."""
    steep, mu, time = np.deg2rad(20.0), np.tan(np.deg2rad(20.0)) - 1e-3 / np.cos(np.deg2rad(20.0)), 0.5
    scene = cn.Scene(3, gravity=9.81 * np.array([np.sin(steep), 0, -np.cos(steep)]))
    scene.add(cn.boxes([[0, 0, 0.5]], [1.0] * 3, ROCK), cn.wall((0, 0, 0), (0, 0, 1), ROCK))
    scene.interact("*", "*", cn.Coulomb(mu=mu))
    sim = cn.Simulation(scene, 1 / 240)
    way = moved(sim, int(240 * time))
    assert way == pytest.approx(0.5 * 1e-3 * 9.81 * time**2, rel=0.05)


def test_units_leave_its_bits():
    """Lengths and gravity times 2^10 keep every digit."""
    one, other = (cn.Simulation(tower(size=size), 1 / 256) for size in (1.0, 1024.0))
    for sim in (one, other):
        moved(sim, 20)
    assert np.array_equal(1024 * one.bodies.position, other.bodies.position)
    assert np.array_equal(1024 * one.bodies.velocity[:, :3], other.bodies.velocity[:, :3])


def test_it_goes_on_from_a_file(tmp_path):
    """Checkpoints hold the count of solutions to rounding: restarted runs have the same bits."""
    sim, path = cn.Simulation(tower(30), 1 / 240), tmp_path / "tower.h5"
    moved(sim, 3)
    velocity = sim.bodies.velocity.copy()
    velocity[29] += 1e-6
    sim.bodies.set(velocity=velocity)
    for _ in range(3):
        sim.step()
    sim.checkpoint(path)
    again = cn.Simulation(tower(30), 1 / 240)
    again.restore(path)
    for one in (sim, again):
        for _ in range(30):
            one.step()
    assert np.array_equal(sim.bodies.position, again.bodies.position)
