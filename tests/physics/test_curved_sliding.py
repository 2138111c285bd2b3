"""Contacts on curved surfaces that stay closed: of second order in the step, in gap, speed and phase."""

from math import atan2, cos, hypot, sin

import cairn as cn
import numpy as np
import pytest
from scipy.integrate import solve_ivp

STONE = cn.Material("stone", density=2800.0)
G = 9.81
HELD = {2: ("vx", "vy", "w"), 3: ("vx", "vy", "vz", "wx", "wy", "wz")}


def slopes(steps, errors):
    """How errors fall with the step, on logarithmic scales, from each to the next."""
    return np.diff(np.log(errors)) / np.diff(np.log(steps))


def advance(scene, h, time, mu=0.0, law=None, **options):
    scene.interact(STONE, STONE, law or cn.Coulomb(mu=mu))
    sim = cn.Simulation(scene, h, cn.NSCD(solver=cn.NLGS(tol=1e-13), **options), overlap="ignore")
    for _ in range(round(time / h)):
        sim.step()
    return sim


# ---------------------------------------------------------------------- in a ring


def in_a_ring(h, time, r=0.05, gravity=0.0, **options):
    """A disk on a path of radius 1 m in a ring, from its lowest place, at 1 m/s."""
    scene = cn.Scene(2, gravity=(0, -gravity))
    scene.add(cn.disks([[0, -1]], r, STONE, velocity=[[1, 0, 0]]), cn.ring((0, 0), 1 + r, STONE))
    return advance(scene, h, time, **options)


@pytest.mark.parametrize("law", [cn.Frictionless(), cn.Restitution(), cn.Restitution(normal=0.4), cn.GapCoulomb(mu=0)])
@pytest.mark.parametrize("theta", [0.5, 1.0])
def test_a_disk_circles_in_a_ring(law, theta):
    """Without friction and weight it keeps its speed and its path to h^2, of which it lost h/2 each second."""
    steps, wrong = [4e-3, 2e-3], []
    for h in steps:
        sim = in_a_ring(h, 3.0, law=law, theta=theta)
        (x, y), v = sim.bodies.position[0], sim.bodies.velocity[0]
        wrong.append([abs(hypot(v[0], v[1]) - 1), abs(hypot(x, y) - 1), abs(atan2(y, x) + np.pi / 2 - 3.0)])
    for fine, coarse in zip(wrong[1], wrong[0]):
        assert coarse < 2 * steps[0] ** 2 and (coarse < 1e-13 or abs(np.log2(coarse / fine) - 2) < 0.02)


def test_a_disk_swings_in_a_ring():
    """A pendulum of 1 m: place and energy after 2 s are wrong by h^2."""
    steps, place, energy = [8e-3, 4e-3, 2e-3], [], []
    angle = solve_ivp(lambda t, y: [y[1], -G * sin(y[0])], (0, 2), [0, 1], rtol=1e-12, atol=1e-12).y[0, -1]
    for h in steps:
        sim = in_a_ring(h, 2.0, gravity=G)
        (x, y), v = sim.bodies.position[0], sim.bodies.velocity[0]
        place.append(hypot(x - sin(angle), y + cos(angle)))
        energy.append(abs((v[0] ** 2 + v[1] ** 2 - 1) / 2 + G * (y + 1)))
    assert np.all(slopes(steps, place) > 1.9) and place[-1] < 1e-5
    assert np.all(slopes(steps, energy) > 1.8) and energy[-1] < 2e-5


def test_a_sphere_winds_through_a_tube():
    """Curved across its axis, flat along it: a helix, at a constant speed."""
    scene = cn.Scene(3, gravity=(0, 0, 0))
    axis = np.array([0.6, 0.0, 0.8])
    scene.add(cn.spheres([[0.0, 1.0, 0.0]], 0.1, STONE, velocity=[np.r_[np.cross(axis, [0, 1.0, 0]) + axis, 0, 0, 0]]))
    scene.add(cn.tube((0, 0, 0), axis, 1.1, STONE))
    sim = advance(scene, 2e-3, 5.0)
    x, v = sim.bodies.position[0], sim.bodies.velocity[0]
    assert abs(np.linalg.norm(x - (x @ axis) * axis) - 1) < 1e-6
    assert abs(x @ axis - 5) < 1e-9 and abs(v @ v - 2) < 1e-9


# ---------------------------------------------------------------------- on a disk


@pytest.mark.parametrize("heavy", [False, True])
@pytest.mark.parametrize("mu", [0.0, 1e3])
def test_a_disk_slides_or_rolls_over_a_disk(mu, heavy):
    """From 0.1 rad beside the top; the lower one is held, or too heavy to be moved: l a'' = g sin(a), over 1.5 if it rolls."""
    r, R = 0.25, 1.0
    length, time, slowed = R + r, 0.8, 1.5 if mu else 1.0
    angle = solve_ivp(lambda t, y: [y[1], G / length / slowed * sin(y[0])], (0, time), [0.1, 0], rtol=1e-12, atol=1e-12).y[0, -1]
    steps, place, gap = [8e-3, 4e-3, 2e-3], [], []
    for h in steps:
        scene = cn.Scene(2, gravity=(0, 0) if heavy else (0, -G))
        weight = (0, -G * 2800 * np.pi * r * r, 0) if heavy else None
        scene.add(cn.disks([[length * sin(0.1), length * cos(0.1)]], r, STONE, force=weight))
        scene.add(cn.disks([[0, 0]], R, STONE, density=1e18) if heavy else cn.disks([[0, 0]], R, STONE, driven=HELD[2]))
        sim = advance(scene, h, time, mu)
        x, y = sim.bodies.position[0]
        place.append(hypot(x - length * sin(angle), y - length * cos(angle)))
        gap.append(abs(hypot(x, y) - length))
    assert np.all(slopes(steps, place) > 1.8) and place[-1] < 3e-6
    assert np.all(slopes(steps, gap) > 1.8) and gap[-1] < 2e-6


def test_a_disk_leaves_a_disk_where_its_weight_no_longer_holds_it():
    """At cos(a) = 2/3 (1 - a0^2...): from rest at a0, where 3 cos(a) = 2 cos(a0)."""
    scene = cn.Scene(2, gravity=(0, -G))
    scene.add(cn.disks([[sin(0.2), cos(0.2)]], 0.25, STONE), cn.disks([[0, 0]], 0.75, STONE, driven=HELD[2]))
    scene.interact(STONE, STONE, cn.Frictionless())
    sim = cn.Simulation(scene, 1e-3)
    angle = 0.0
    while sim.time < 1.5:
        sim.step()
        if len(sim.contacts.gap) and np.any(sim.contacts.impulse[0]):
            angle = atan2(*sim.bodies.position[0])
    assert abs(cos(angle) - 2 / 3 * cos(0.2)) < 3e-3


# ---------------------------------------------------------------------- a top


MASS, REACH, ACROSS, ALONG, SPIN = 0.1, 0.04, 1e-4, 4e-5, 150.0
LEANING = np.array([cos(0.15), 0, sin(0.15), 0])


def turned(q):
    w, x, y, z = q / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def axes_of_a_top(times):
    """Lagrange's top with its tip at rest, by its angular momentum."""
    inertia = np.array([ACROSS + MASS * REACH**2, ACROSS + MASS * REACH**2, ALONG])

    def rates(t, y):
        r = turned(y[:4])
        spin = r @ (r.T @ y[4:] / inertia)
        return np.r_[-spin @ y[1:4] / 2, (y[0] * spin + np.cross(spin, y[1:4])) / 2, np.cross(REACH * r[:, 2], [0, 0, -MASS * G])]

    begin = np.r_[LEANING, turned(LEANING) @ [0, 0, ALONG * SPIN]]
    states = solve_ivp(rates, (0, times[-1]), begin, t_eval=times, rtol=1e-10, atol=1e-12).y
    return [turned(q)[:, 2] for q in states[:4].T]


@pytest.mark.parametrize("tip", ["sphere", "corner"])
def test_a_top_precesses_on_its_tip(tip):
    """150 rad/s, the tip held by friction: axis and tip are wrong by h^2; at 1e-3 s the axis was wrong by 0.07 rad."""
    times, steps, wrong, moved = np.arange(1, 9) * 0.05, [1e-3, 5e-4, 2.5e-4], [], []
    exact = axes_of_a_top(times)
    axis = turned(LEANING)[:, 2]
    small = 1e-7 if tip == "sphere" else 0.0
    motion = {"rotation": [LEANING], "velocity": [np.r_[np.cross(SPIN * axis, REACH * axis), SPIN * axis]]}
    for h in steps:
        place = REACH * axis + [0, 0, small]
        if tip == "sphere":
            top = cn.clumps([place], [[0, 0, -REACH]], [small], MASS, [ACROSS, ACROSS, ALONG], STONE, **motion)
        else:
            top = pyramid(place, **motion)
        scene = cn.Scene(3, gravity=(0, 0, -G))
        scene.add(top, cn.wall((0, 0, 0), (0, 0, 1), STONE))
        sim = advance(scene, h, 0.0, mu=1e6)
        off = []
        for now, wanted in zip(times, exact):
            while sim.time < now - h / 2:
                sim.step()
            held = turned(sim.bodies.rotation[0])[:, 2]
            off.append([np.linalg.norm(held - wanted), np.linalg.norm(sim.bodies.position[0] - REACH * held - [0, 0, small])])
        wrong.append(np.max(off, axis=0)[0])
        moved.append(np.max(off, axis=0)[1])
    assert np.all(slopes(steps, wrong) > 1.8) and wrong[0] < 5e-3
    assert np.all(slopes(steps, moved) > 1.8) and moved[0] < 1e-4


def pyramid(place, **motion):
    """Upside down, its corner below the centre of mass; the mass and the moments of the top."""
    a = 0.02
    top = REACH / 3  # of a pyramid whose centre of mass is REACH above its corner
    corners = np.array([[a, a, top], [-a, a, top], [-a, -a, top], [a, -a, top], [0, 0, -REACH]])
    body = cn.polyhedra([(corners, [[0, 1, 2, 3], [4, 1, 0], [4, 2, 1], [4, 3, 2], [4, 0, 3]])], STONE)
    return body.with_(position=np.array([place]), mass=np.array([MASS]), inertia=np.array([[ACROSS, ACROSS, ALONG]]), **motion)


# ---------------------------------------------------------------------- what has no curvature, and impacts


def test_flat_contacts_know_nothing_of_it():
    """Disks that slide and roll on lines, boxes that slide: to the bit what conditions at detection give."""
    found = []
    for where in ("middle", "surface"):
        scene = cn.Scene(2, gravity=(0.3, -G))
        scene.add(cn.disks([[0, 0.5], [3, 0.25]], [0.5, 0.25], STONE, velocity=[[1, 0, 2], [2, 0, 0]]))
        scene.add(cn.wall((0, 0), (0, 1), STONE))
        scene.interact(STONE, STONE, cn.Coulomb(mu=0.3))
        sim = cn.Simulation(scene, 1e-2, cn.NSCD(contact_point=where))
        for _ in range(40):
            sim.step()
        found.append(np.c_[sim.bodies.position, sim.bodies.velocity].tobytes())
    assert found[0] == found[1]


@pytest.mark.parametrize("normal", [0.0, 0.5, 1.0])
def test_restitution_of_impacts_stays(normal):
    """Normal velocities after an impact of disks in flight: exact head on, to first order in h off-centre."""
    for aside, near in ((0.0, 1e-12), (0.3, 2e-3)):
        scene = cn.Scene(2, gravity=(0, 0))
        scene.add(cn.disks([[0, 0], [2.0, aside]], [0.5, 0.5], STONE, velocity=[[1, 0, 0], [-1, 0, 0]]))
        scene.interact(STONE, STONE, cn.Restitution(normal=normal))
        sim = cn.Simulation(scene, 1e-3)
        while sim.time < 1.0:
            before = sim.bodies.velocity[:, :2].copy()
            sim.step()
            if len(sim.contacts.gap) and np.any(sim.contacts.impulse[0]):
                break
        after = sim.bodies.velocity[:, :2]
        n = sim.contacts.normal[0]
        a = 0 if n[0] < 0 else 1
        approach, rebound = ((v[a] - v[1 - a]) @ n for v in (before, after))
        wanted = -normal * approach if normal else -max(sim.contacts.gap[0], 0) / 1e-3
        assert abs(rebound - wanted) < near


def test_nothing_sinks_without_restitution():
    """A ball that does not rebound ends on the wall as Coulomb's law has it, and no deeper; it sank by up to v h."""
    for law in (cn.Restitution(), cn.Restitution(mu=0.3), cn.Coulomb(mu=0.3)):
        scene = cn.Scene(2, gravity=(0, -G))
        scene.add(cn.disks([[0, 0.6]], 0.1, STONE, velocity=[[0.5, -1, 0]]), cn.wall((0, 0), (0, 1), STONE))
        scene.interact(STONE, STONE, law)
        sim = cn.Simulation(scene, 1e-3)
        for _ in range(600):
            sim.step()
        assert abs(sim.bodies.position[0, 1] - 0.1) < 1e-15
