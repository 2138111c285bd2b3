"""Ropes over a pulley: Atwood's machines, slack, strength, energy, restart."""

import cairn as cn
import numpy as np
import pytest

STEEL = cn.Material("steel", density=7800.0)
G = 9.81
HELD = ("vx", "vy", "w")
SOLVERS = [cn.NLGS(tol=1e-12, max_iter=20000), cn.Auto(tol=1e-12)]


def axis(dim, k):
    return np.eye(dim)[k]


def up(dim):
    return axis(dim, dim - 1)


def balls(dim, centres, radii, **options):
    return (cn.disks if dim == 2 else cn.spheres)(np.asarray(centres, float), np.asarray(radii, float), STEEL, **options)


def scene_of(dim):
    scene = cn.Scene(dim, gravity=-G * up(dim))
    scene.interact("*", "*", None)
    return scene


def simulate(scene, dt, solver=SOLVERS[0]):
    return cn.Simulation(scene, dt, cn.NSCD(solver=solver), overlap="ignore")


def stretched(sim, dim, pulley, k=(0, 1)):
    return sum(np.linalg.norm(sim.bodies.position[b] - pulley) for b in k)


def closes(sim, mistake=1e-12):
    e = sim.info["energy"]
    return abs(e["closure"]) <= mistake * e["in_play"]


def whole(sim):
    e = sim.info["energy"]
    return e["kinetic"] + e["potential"]


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("dim", [2, 3])
def test_atwoods_machine(dim, solver):
    """(m2 - m1) g/(m1 + m2), a tension of 2 m1 m2 g/(m1 + m2), twice of it on the world; all constant, so to rounding."""
    scene = scene_of(dim)
    ids = scene.add(balls(dim, [-1.0 * up(dim), -1.3 * up(dim)], [0.05, 0.06]))
    scene.join(ids[0], ids[1], cn.Cable(points=[-1.0 * up(dim), 0 * up(dim), -1.3 * up(dim)]))
    sim = simulate(scene, 1e-3, solver)
    assert sim.step()["iterations"] <= 2  # the block of one rope alone
    for _ in range(299):
        assert sim.step()["status"] == "converged"
    m = sim.bodies.mass[:2]
    a, tension = G * (m[1] - m[0]) / m.sum(), 2 * m[0] * m[1] * G / m.sum()
    assert sim.bodies.velocity[:2, dim - 1] == pytest.approx([0.3 * a, -0.3 * a], rel=1e-10)
    assert sim.bodies.position[:2, dim - 1] == pytest.approx([-1 + 0.045 * a, -1.3 - 0.045 * a], rel=1e-10)
    assert np.linalg.norm(sim.contacts.impulse) == pytest.approx(tension * sim.dt, rel=1e-10)
    world = 2 * tension + sim.bodies.mass[2] * G  # holds both sides of the rope, and what carries the pulley
    assert sim.bodies.reaction[2, dim - 1] == pytest.approx(world * sim.dt, rel=1e-10)
    assert closes(sim)


def swinging(lengths, angle, m, t):
    """A swinging machine: m[0] hangs straight, m[1] swings. Its rope on that side, and the angle, by Runge-Kutta."""
    def rate(y):
        r, speed, th, spin = y
        return np.array([speed, (m[1] * r * spin**2 + m[1] * G * np.cos(th) - m[0] * G) / m.sum(), spin,
                         -(2 * speed * spin + G * np.sin(th)) / r])  # fmt: skip

    y, n = np.array([lengths[1], 0.0, angle, 0.0]), 4000
    for _ in range(n):
        k1 = rate(y)
        k2 = rate(y + t / n / 2 * k1)
        k3 = rate(y + t / n / 2 * k2)
        y = y + t / n / 6 * (k1 + 2 * k2 + 2 * k3 + rate(y + t / n * k3))
    return y[0], y[2]


def test_a_swinging_machine_is_of_second_order():
    missed, lost = [], []
    for dt in (4e-3, 2e-3):
        scene, start = scene_of(2), 0.5 * np.array([np.sin(1.0), -np.cos(1.0)])
        ids = scene.add(balls(2, [(0, -0.6), start], [0.05, 0.045]))
        scene.join(ids[0], ids[1], cn.Cable(points=[(0, -0.6), (0, 0), start]))
        sim = simulate(scene, dt)
        first, seen = None, []
        for _ in range(round(1.0 / dt)):
            sim.step()
            first = whole(sim) if first is None else first
            seen.append(abs(whole(sim) - first))
        x = sim.bodies.position[1]
        r, angle = swinging([0.6, 0.5], 1.0, sim.bodies.mass[:2], 1.0)
        missed.append(np.linalg.norm(x - r * np.array([np.sin(angle), -np.cos(angle)])))
        lost.append(max(seen) / sim.info["energy"]["kinetic"])
        assert abs(stretched(sim, 2, np.zeros(2)) - 1.1) < 30 * dt**2
        assert closes(sim)
    assert missed[0] < 1e-3 and missed[1] < 0.3 * missed[0]
    assert lost[0] < 2e-3 and lost[1] < 0.35 * lost[0]


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("dim", [2, 3])
def test_a_pulley_on_a_body(dim, solver):
    """A load hangs on a pulley whose rope is tied to the world and drawn up: T (1/m + 4/M) = F/m + g."""
    scene, draw = scene_of(dim), 200.0
    load = scene.add(balls(dim, [-1.0 * up(dim)], [0.06]))
    end = scene.add(balls(dim, [0.2 * up(dim)], [0.03], force=np.pad(draw * up(dim), (0, dim * (dim - 1) // 2))))
    scene.join(end[0], None, cn.Cable(points=[0.2 * up(dim), -1.0 * up(dim), 0.5 * up(dim)], pulley=load[0]))
    sim = simulate(scene, 1e-3, solver)
    assert sim.step()["iterations"] <= 2
    for _ in range(99):
        assert sim.step()["status"] == "converged"
    big, small = sim.bodies.mass[:2]
    tension = (draw / small + G) / (1 / small + 4 / big)
    speeds = 0.1 * np.array([2 * tension / big - G, (draw - tension) / small - G])
    assert sim.bodies.velocity[:2, dim - 1] == pytest.approx(speeds, rel=1e-10)
    assert speeds[1] == pytest.approx(2 * speeds[0], rel=1e-10)
    assert closes(sim)


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (3, 2, 1, 0), (1, 3, 0, 2)])
@pytest.mark.parametrize("dim", [2, 3])
def test_a_machine_on_a_machine(dim, order):
    """Body 0 against a pulley, 1, over which 2 and 3 hang, in any order of insertion: two ropes, one with three bodies."""
    m = np.array([0.05, 0.03, 0.045, 0.035])
    height = np.array([-1.0, -0.8, -1.5, -1.7])
    scene, ids = scene_of(dim), [0] * 4
    for k in order:
        ids[k] = scene.add(balls(dim, [height[k] * up(dim)], [m[k]]))[0]
    scene.join(ids[0], ids[1], cn.Cable(points=[height[0] * up(dim), 0 * up(dim), height[1] * up(dim)]))
    scene.join(ids[2], ids[3], cn.Cable(points=[height[2] * up(dim), height[1] * up(dim), height[3] * up(dim)], pulley=ids[1]))
    sims = [simulate(scene, 1e-3, solver) for solver in SOLVERS]
    for sim in sims:
        for _ in range(100):
            assert sim.step()["status"] == "converged"
        m = sim.bodies.mass[ids]
        # effect of both tensions on the length of each rope
        w = np.array([[1 / m[0] + 1 / m[1], -2 / m[1]], [-2 / m[1], 1 / m[2] + 1 / m[3] + 4 / m[1]]])
        t = np.linalg.solve(w, [2 * G, 0.0])
        speeds = 0.1 * (np.array([t[0] / m[0], (t[0] - 2 * t[1]) / m[1], t[1] / m[2], t[1] / m[3]]) - G)
        assert sim.bodies.velocity[ids, dim - 1] == pytest.approx(speeds, rel=1e-9)
        assert closes(sim)


def test_a_slack_rope_lets_fall_and_tautens_without_a_bounce():
    """Both fall by half of the slack; then equal weights stop, and the balance counts the loss."""
    scene = scene_of(2)
    ids = scene.add(balls(2, [(0.0, -1.0), (0.0, -1.0)], [0.05, 0.05]))
    scene.join(ids[0], ids[1], cn.Cable(points=[(0, -1), (0, 0), (0, -1)], length=2.1))
    sim = simulate(scene, 1e-3)
    for _ in range(90):
        sim.step()
    assert sim.bodies.velocity[:2, 1] == pytest.approx([-G * 0.09] * 2, rel=1e-10)
    assert np.abs(sim.contacts.impulse).max() == 0
    for _ in range(30):
        sim.step()
    assert stretched(sim, 2, np.zeros(2)) == pytest.approx(2.1, rel=1e-9)
    assert np.abs(sim.bodies.velocity[:2, 1]).max() < 1e-9
    e = sim.info["energy"]
    mass = sim.bodies.mass[0]
    assert e["dissipated_normal"] == pytest.approx(2 * mass * G * 0.05, rel=2e-2)
    assert closes(sim)


def test_it_breaks_at_its_tension():
    for share, holds in ((1.01, True), (0.99, False)):
        scene = scene_of(2)
        ids = scene.add(balls(2, [(0, -1.0), (0, -1.3)], [0.05, 0.06]))
        m = 7800.0 * np.pi * np.array([0.05, 0.06]) ** 2
        tension = 2 * m[0] * m[1] * G / m.sum()
        scene.join(ids[0], ids[1], cn.Cable(points=[(0, -1), (0, 0), (0, -1.3)], strength=share * tension))
        sim = simulate(scene, 1e-3)
        for _ in range(100):
            sim.step()
        assert (sim.contacts.beta.max(initial=0.0) == 1) == holds
        a = G * (m[1] - m[0]) / m.sum() if holds else -G
        assert sim.bodies.velocity[0, 1] == pytest.approx(0.1 * a, rel=2e-2)


def spinning(dim):
    """Bars on a rope at their ends, over a pulley on a third; one end is held by the world in the second rope."""
    scene = scene_of(dim)
    spin = [0.3, 0.2, 2.0] if dim == 2 else [0.3, 0.1, 0.2, 2.0, -1.0, 3.0]
    corners = np.array([[-0.1, -0.02], [0.1, -0.02], [0.1, 0.02], [-0.1, 0.02]])

    def make(x, **options):
        return cn.polygons([corners + x], STEEL, **options) if dim == 2 else cn.boxes([x], [[0.2, 0.04, 0.06]], STEEL, **options)

    centres = [-0.8 * up(dim) - 0.3 * axis(dim, 0), 0.3 * up(dim), -0.9 * up(dim) + 0.3 * axis(dim, 0)]
    ids = [scene.add(make(c, velocity=[v]))[0]
           for c, v in zip(centres, (np.array(spin), np.zeros(3 * dim - 3), -np.array(spin)))]  # fmt: skip
    corner = [0.1 * axis(dim, 0), -0.02 * up(dim), -0.1 * axis(dim, 0)]
    points = [c + e for c, e in zip(centres, corner)]
    scene.join(ids[0], ids[2], cn.Cable(points=points, pulley=ids[1]))
    scene.join(ids[1], None, cn.Cable(points=[centres[1], 0.9 * up(dim), 0.5 * axis(dim, 0)]))
    return scene


@pytest.mark.parametrize("dim", [2, 3])
def test_levers_turn_and_the_energy_is_kept(dim):
    """Ropes at the ends of bars that spin: energy to the square of the step, and solvers agree."""
    changes = []
    for dt in (1e-3, 5e-4):
        sim = simulate(spinning(dim), dt)
        for _ in range(2):  # velocities that ropes do not allow are an impact
            sim.step()
        first, seen, slack = whole(sim), [], 0
        for _ in range(round(0.2 / dt)):
            assert sim.step()["status"] == "converged"
            slack += (np.abs(sim.contacts.impulse).max(axis=1) == 0).sum()
            seen.append(abs(whole(sim) - first) / sim.info["energy"]["kinetic"])
        assert closes(sim, 1e-11)
        if slack == 0:
            changes.append(max(seen))
    assert len(changes) < 2 or (changes[0] < 1e-2 and changes[1] < 0.4 * changes[0])
    auto = simulate(spinning(dim), dt, SOLVERS[1])
    for _ in range(2 + round(0.2 / dt)):
        auto.step()
    assert auto.bodies.position == pytest.approx(sim.bodies.position, abs=1e-8)


def test_restart_and_scene_file_go_on_to_the_same_bits(tmp_path):
    once, half = simulate(spinning(3), 1e-3), simulate(spinning(3), 1e-3)
    for _ in range(60):
        once.step()
    for _ in range(20):
        half.step()
    half.checkpoint(tmp_path / "half.h5")
    spinning(3).save(tmp_path / "roped.scene.h5")
    again = simulate(cn.Scene.load(tmp_path / "roped.scene.h5"), 1e-3)
    again.restore(tmp_path / "half.h5")
    for _ in range(40):
        again.step()
    assert np.array_equal(again.bodies.position, once.bodies.position)
    assert np.array_equal(again.bodies.rotation, once.bodies.rotation)


def test_a_rope_from_what_is_held_over_a_pulley_that_is_held_is_a_pendulum():
    scene = scene_of(2)
    held = scene.add(balls(2, [(-0.5, 0.0)], [0.05], driven=HELD))
    ball = scene.add(balls(2, [(0.3, -0.4)], [0.05]))
    scene.join(held[0], ball[0], cn.Cable(points=[(-0.5, 0), (0, 0), (0.3, -0.4)]))
    sim = simulate(scene, 1e-3)
    for _ in range(600):
        sim.step()
    assert np.linalg.norm(sim.bodies.position[1]) == pytest.approx(0.5, rel=1e-5)
    assert sim.bodies.position[1, 0] < -0.2 and closes(sim)


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda s: s.join(0, 1, cn.Cable(points=[(0, -1), (0, 0)])), "points of Cable"),
        (lambda s: s.join(0, 1, cn.Cable(points=[(0, 0), (0, 0), (0, -1)])), r"points\[0\] and points\[1\] of Cable are both"),
        (lambda s: s.join(0, 1, cn.Cable(points=[(0, -1), (0, 0), (0, -1)], length=1.9)), "length of Cable is 1.9"),
        (lambda s: s.join(0, 1, cn.Cable(points=[(0, -1), (0, 0), (0, -1)], pulley=1)), "on a body of one of its ends"),
        (lambda s: s.join(0, 1, cn.Cable(points=[(0, -1), (0, 0), (0, -1)], pulley=9)), "pulley of a joint is 9"),
        (lambda s: s.join(2, None, cn.Cable(points=[(0, -1), (0, 0), (0, -1)])), "do not move"),
    ],
)
def test_wrong_ropes_are_told(make, told):
    scene = scene_of(2)
    scene.add(balls(2, [(0, -1.0), (0.5, -1.0)], [0.05, 0.05]))
    scene.add(balls(2, [(1.0, 0.0)], [0.05], driven=HELD))
    with pytest.raises(ValueError, match=told):
        make(scene)
