"""Cohesive grains with friction against rolling: RollingWet, RollingCapillary and RollingBonded."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=2600.0)
G, R = 9.81, 0.01
EXACT = {"solver": cn.NLGS(tol=1e-10, max_iter=20000)}


def grain(dim, **options):
    return (cn.disks if dim == 2 else cn.spheres)([[0.0] * (dim - 1) + [R]], R, ROCK, **options)


def tilted(dim, angle, law, steps=60):
    """A grain on a plane under gravity that is tilted by an angle; its velocity after the steps."""
    scene = cn.Scene(dim=dim, gravity=(G * np.sin(angle),) + (0.0,) * (dim - 2) + (-G * np.cos(angle),))
    scene.add(grain(dim), cn.wall((0.0,) * dim, (0.0,) * (dim - 1) + (1.0,), ROCK))
    scene.interact(ROCK, ROCK, law)
    sim = cn.Simulation(scene, dt=1e-3, strategy=cn.NSCD(**EXACT))
    for _ in range(steps):
        sim.step()
    return sim


def weight(dim):
    s = grain(dim)
    return float(s.mass[0]) * G


def laws(dim, rho, pull):
    given = {"RollingWet": cn.RollingWet(force=pull, reach=1e-4, mu=5.0, rolling=rho)}
    if dim == 3:
        given["RollingCapillary"] = cn.RollingCapillary(
            tension=pull / (4 * np.pi * R * np.cos(0.3)), volume=1e-10, angle=0.3, mu=5.0, rolling=rho
        )
    return given


@pytest.mark.parametrize("pulled", [0.0, 0.5, 4.0])
@pytest.mark.parametrize(("dim", "name"), [(2, "RollingWet"), (3, "RollingWet"), (3, "RollingCapillary")])
def test_a_wet_grain_begins_to_roll_where_attraction_adds_to_its_weight(dim, name, pulled):
    # moment about the contact: m g sin = rho (m g cos + F)
    rho, pull = 0.1, pulled * weight(dim)
    slope = 0.0
    for _ in range(60):
        slope = np.arctan(rho * (1 + pulled / np.cos(slope)))
    for factor, rolls in ((0.99, False), (1.01, True)):
        sim = tilted(dim, factor * slope, laws(dim, rho, pull)[name])
        v = sim.bodies.velocity[0]
        speed = 0.5 * G * sim.time * np.sin(slope) * 0.01  # a part of what the surplus makes of it
        assert (v[0] > speed) == rolls
        if not rolls:
            assert np.abs(v).max() < 1e-9
        else:  # by 1/(1 + I/(m R^2)) of the surplus, and without sliding
            share = 1 / (1 + (0.5 if dim == 2 else 0.4))
            excess = G * (np.sin(factor * slope) - rho * (np.cos(factor * slope) + pulled))
            assert abs(v[0] / (share * excess * sim.time) - 1) < (0.05 if name == "RollingCapillary" else 1e-6)
            assert abs(abs(v[2 if dim == 2 else 4]) * R - v[0]) < 1e-9
        assert abs(sim.info["energy"]["closure"]) < 1e-9 * sim.info["energy"]["in_play"] + 1e-300


@pytest.mark.parametrize(("dim", "plain"), [(2, "Wet"), (3, "Wet"), (3, "Capillary")])
def test_without_rolling_they_are_the_plain_laws(dim, plain):
    pull = 2.0 * weight(dim)
    if plain == "Wet":
        law, rolling = cn.Wet(force=pull, reach=1e-4, mu=0.3), cn.RollingWet(force=pull, reach=1e-4, mu=0.3)
    else:
        given = {"tension": 0.07, "volume": 1e-10, "mu": 0.3}
        law, rolling = cn.Capillary(**given), cn.RollingCapillary(**given)
    a, b = (tilted(dim, 1.2, one).bodies.velocity for one in (law, rolling))
    assert np.abs(a - b).max() < 1e-8 * np.abs(a).max() and a[0, 0] > 0


def test_without_attraction_it_is_rolling():
    for dim in (2, 3):
        dry = cn.RollingWet(force=0.0, reach=0.0, mu=0.3, rolling=0.1)
        a, b = (tilted(dim, 0.4, one).bodies.velocity for one in (cn.Rolling(mu=0.3, rolling=0.1), dry))
        assert np.abs(a - b).max() < 1e-9 * np.abs(a).max()


def test_twisting_of_a_wet_sphere_stops_it():
    # a sphere that spins about the normal: d(omega)/dt = -twisting R (m g + F)/I
    pull, twisting, spin = 3.0 * weight(3), 0.02, 30.0
    scene = cn.Scene(dim=3, gravity=(0.0, 0.0, -G))
    scene.add(grain(3, velocity=[[0, 0, 0, 0, 0, spin]]), cn.wall((0, 0, 0), (0, 0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.RollingWet(force=pull, reach=1e-4, mu=0.5, twisting=twisting))
    sim = cn.Simulation(scene, dt=1e-3, strategy=cn.NSCD(**EXACT))
    for _ in range(20):
        sim.step()
    rate = twisting * R * 4 * weight(3) / (0.4 * weight(3) / G * R**2)
    assert abs(sim.bodies.velocity[0, 5] - (spin - rate * sim.time)) < 1e-6 * spin


@pytest.mark.parametrize("scale", [2.0**-20, 2.0**15])
def test_units_leave_all_bits(scale):
    ends = []
    for k in (1.0, scale):
        scene = cn.Scene(dim=2, gravity=(3.0 * k, -8.0 * k))
        scene.add(cn.disks([[0.0, 0.125 * k]], 0.125 * k, ROCK), cn.wall((0, 0), (0, 1), ROCK))
        mass = np.pi * 2600.0 * (0.125 * k) ** 2
        scene.interact(ROCK, ROCK, cn.RollingWet(force=2.0 * mass * 8.0 * k, reach=1e-3 * k, mu=0.5, rolling=0.03))
        sim = cn.Simulation(scene, dt=1e-3)
        for _ in range(20):
            sim.step()
        ends.append(sim.bodies.velocity[0] / [k, k, 1.0])
    assert np.array_equal(*ends) and ends[0][0] > 0


def bonded_pair(dim, law, solver=None, angle=0.3):
    """Two grains that came in touching, on a plane that is tilted by an angle: their bond, and contacts with the plane, of one
    law. The plane comes in apart and meets them in the first steps."""
    scene = cn.Scene(dim=dim, gravity=(G * np.sin(angle),) + (0.0,) * (dim - 2) + (-G * np.cos(angle),))
    places = np.zeros((2, dim))
    places[:, 0], places[:, -1] = (-R, R), R + 1e-6
    scene.add((cn.disks if dim == 2 else cn.spheres)(places, R, ROCK))
    scene.add(cn.wall((0.0,) * dim, (0.0,) * (dim - 1) + (1.0,), ROCK))
    scene.interact(ROCK, ROCK, law)
    return cn.Simulation(scene, dt=1e-3, strategy=cn.NSCD(solver=solver or EXACT["solver"]))


@pytest.mark.parametrize("solver", [cn.NLGS(tol=1e-8, max_iter=5000), cn.Auto(tol=1e-8, max_iter=5000)])
@pytest.mark.parametrize("dim", [2, 3])
def test_bonds_beside_rolling_hold_as_bonds_do(dim, solver):
    a, b = (bonded_pair(dim, law, solver) for law in (cn.Bonded(mu=0.9), cn.RollingBonded(mu=0.9, rolling=0.2, twisting=0.1)))
    for sim in (a, b):
        for _ in range(60):
            sim.step()
        assert sim.info["status"] == "converged"
        distance = np.linalg.norm(np.diff(sim.bodies.position[:2], axis=0))
        assert abs(distance - 2 * R) < 1e-9 and np.abs(sim.bodies.velocity[:2]).max() < 1e-6  # a pair does not roll
    assert np.abs(a.bodies.position - b.bodies.position)[:2].max() < 1e-8


@pytest.mark.parametrize("dim", [2, 3])
def test_grains_that_no_bond_holds_roll_by_the_cones(dim):
    # a grain that falls onto the plane makes no bond with it
    for rolling in (0.0, 0.1):
        ends = []
        for law in (cn.Rolling(mu=0.9, rolling=rolling), cn.RollingBonded(mu=0.9, rolling=rolling)):
            sim = bonded_pair(dim, law)
            sim.remove([1])
            for _ in range(80):
                sim.step()
            ends.append(sim.bodies.velocity[0])
        assert np.abs(ends[0] - ends[1]).max() < 1e-9 * np.abs(ends[0]).max() and ends[0][0] > 0


def test_a_bonded_pair_that_rolls_is_slowed_by_rolling_friction():
    # both grains of a pair across the slope roll as one cylinder: moments of both contacts add
    slope, rho = 0.3, 0.1
    scene = cn.Scene(dim=3, gravity=(G * np.sin(slope), 0.0, -G * np.cos(slope)))
    scene.add(cn.spheres([[0.0, -R, R], [0.0, R, R]], R, ROCK, group="pair"))
    scene.add(cn.wall((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), ROCK, group="slope"))
    scene.interact("pair", "pair", cn.RollingBonded(mu=0.9, rolling=rho))
    scene.interact("pair", "slope", cn.Rolling(mu=0.9, rolling=rho))
    sim = cn.Simulation(scene, dt=1e-3, strategy=cn.NSCD(**EXACT))
    for _ in range(60):
        sim.step()
    rate = G * (np.sin(slope) - rho * np.cos(slope)) / 1.4
    assert np.allclose(sim.bodies.velocity[:2, 0], rate * sim.time, rtol=1e-6)
