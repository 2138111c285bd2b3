"""Hints and warnings of a step name their cause: the end of the solver, and sources of energy in the scene."""

import warnings

import cairn as cn
import numpy as np
import pytest
from cairn.run.step_warnings import MOST_CREATED

ROCK = cn.Material("rock", density=2500.0)


def pack(dim, n, law=None, heavy=False, density=2500.0e4):
    rng = np.random.default_rng(7)
    radii = rng.uniform(0.005, 0.01, n) if heavy else np.full(n, 0.01)
    scene = cn.Scene(dim, gravity=-9.81 * np.eye(dim)[-1])
    dense = (rng.random(n) < 0.5) & heavy
    width = 0.02 * np.sqrt(n) if dim == 2 else np.cbrt((4 / 3 * np.pi * radii**3).sum() / 0.55)
    places = cn.pre.deposit_disks(radii, width) if dim == 2 else cn.pre.deposit_spheres(radii, (width, width))
    shape = cn.disks if dim == 2 else cn.spheres
    iron = cn.Material("iron", density=density)
    for material, those in ((ROCK, ~dense), (iron, dense)):
        if those.any():
            scene.add(shape(places[those], radii[those], material))
    scene.add(cn.box(np.zeros(dim), np.r_[[width] * (dim - 1), 2 * width], ROCK, lid=False))
    scene.interact("*", "*", law or cn.Coulomb(mu=0.4))
    return scene


def hint(sim, state, solver, **options):
    sim.set_state(state)
    sim.strategy = cn.NSCD(solver=solver, threads=1, **options)
    info = sim.step()
    assert info["status"] == "iteration_limit"
    return info


@pytest.mark.skipif(cn._core.suitesparse == "off", reason="a build without factors")
def test_a_solver_that_ended_by_itself_is_not_given_more_iterations():
    start = cn.NSCD(solver=cn.NLGS(tol=1e-4, max_iter=100), threads=1)
    sim = cn.Simulation(pack(3, 150, heavy=True), 5e-4, start, overlap="ignore")
    for _ in range(3):
        sim.step()
    state = sim.get_state()
    info = hint(sim, state, cn.PPANewton(tol=1e-4, max_iter=400))
    assert info["iterations"] < 400 and info["light_error"] > 1e-4 >= info["error"]
    assert "more iterations" not in info["hint"]
    assert "ppa_newton ended by itself, before its limit of 400" in info["hint"] and "cairn.Auto" in info["hint"]
    info = hint(sim, state, cn.NLGS(tol=1e-4, max_iter=20))
    assert info["iterations"] == 20 and "allow more iterations" in info["hint"]
    info = hint(sim, state, cn.Auto(tol=1e-4, max_iter=20))
    assert info["iterations"] == 20 and "allow more iterations" in info["hint"] and "cairn.Auto" not in info["hint"]


def test_an_estimate_of_velocities_is_always_a_number():
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    scene.add(cn.disks([(i + 0.5 * (j % 2), 0.5 + 0.87 * j) for j in range(6) for i in range(6)], 0.5, ROCK))
    scene.add(cn.wall((0, 0), (0, 1), ROCK), cn.wall((-0.5, 0), (1, 0), ROCK), cn.wall((6, 0), (-1, 0), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.5))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(accuracy=1e-4))
    infos = [sim.step() for _ in range(50)]
    assert all(np.isfinite(info["velocity_error"]) and "nan" not in info["hint"] for info in infos)
    assert all(info["velocity_error"] <= 1e-4 for info in infos if info["status"] == "converged")


def told(scene, solver, steps):
    with warnings.catch_warnings(record=True) as kept:
        warnings.simplefilter("always")
        sim = cn.Simulation(scene, 5e-4, cn.NSCD(solver=solver), overlap="ignore")
        for _ in range(steps):
            sim.step()
    (text,) = [str(each.message) for each in kept if each.category is cn.EnergyCreatedWarning]
    return text


def test_energy_from_nothing_is_not_laid_to_what_is_not_there():
    text = told(pack(2, 100), cn.NLGS(tol=1e-2), 60)
    assert "what the tolerance leaves" in text and "smaller tol" in text
    assert not any(word in text for word in ("heavy", "bond", "Restitution", "Auto"))


@pytest.mark.parametrize(
    "law, heavy, named, others",
    [(None, True, "masses differ by 3e+04", ("bond", "Restitution")),
     (cn.Bonded(mu=0.4), False, "row of bonds", ("heavy", "Restitution")),
     (cn.Restitution(normal=0.5, mu=0.4), False, "Restitution with friction", ("heavy", "bond"))],
)  # fmt: skip
def test_energy_from_nothing_is_laid_to_what_is_there(law, heavy, named, others):
    sim = cn.Simulation(pack(2, 30, law, heavy), 5e-4, cn.NSCD(solver=cn.NLGS(tol=1e-2)), overlap="ignore")
    made = {**sim.step(), "status": "converged", "energy_created": 0.3}
    with pytest.warns(cn.EnergyCreatedWarning, match="made 30%") as kept:
        sim._warnings.look(sim, made, 5e-4)
    text = next(str(each.message) for each in kept if each.category is cn.EnergyCreatedWarning)
    assert named in text and not any(word in text for word in others)


def test_where_only_rounding_is_left_no_smaller_tolerance_is_advised():
    """Sweeps of masses that differ by 1e12 leave light bodies to rounding, and were told to iterate on. The impulse on a light
    body has a rounding of 1e12 eps = 2e-4 of its momentum, which may vanish by chance in one column, but not in eight that
    differ."""
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    for k in range(8):
        light = cn.Material(f"light {k}", density=1.0 + 0.1 * k)
        scene.add(cn.disks([(1.5 * k, 0.5 + i) for i in range(3)], 0.5, light))
        scene.add(cn.disks([(1.5 * k, 3.5)], 0.5, cn.Material(f"heavy {k}", density=1e12)))
    scene.add(cn.wall((0, 0), (0, 1), ROCK))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(solver=cn.NLGS(tol=1e-6, max_iter=500)), overlap="ignore")
    info = sim.step()
    assert info["status"] == "iteration_limit" and info["error"] < 1e-15 and info["light_error"] > 1e-6
    assert "only rounding is left" in info["hint"] and "cairn.Auto" in info["hint"]
    assert "allow more iterations" not in info["hint"]


def test_a_sample_at_rest_between_servo_walls_is_not_told_of_energy():
    """Hexagons of 0.1 kg under walls of 20 kg: at rest a step has next to no energy, and any error is a large share of it."""
    grain = cn.Material("grain", density=2600.0)
    rng, scene = np.random.default_rng(3), cn.Scene(2)
    rng.uniform(size=100)  # the sample after these draws creates more than is told while it packs, which not all do
    corner = np.linspace(0, 2 * np.pi, 6, endpoint=False)
    places = (np.indices((10, 10)).reshape(2, -1).T + 0.5) * 0.012
    outline = np.column_stack((np.cos(corner), np.sin(corner)))
    scene.add(cn.polygons([outline * rng.uniform(0.004, 0.0058) + place for place in places], grain))
    scene.add(cn.wall((0, 0), (0, 1), grain), cn.wall((0, 0), (1, 0), grain))
    for point, normal, free in (((0.12, 0), (-1, 0), "vx"), ((0, 0.12), (0, -1), "vy")):
        scene.add(cn.wall(point, normal, grain, mass=20.0, free=free, force=cn.Servo(1e4, normal, area="walls")))
    scene.interact(grain, grain, cn.Coulomb(mu=0.5))
    sim = cn.Simulation(scene, 5e-4, cn.NSCD(solver=cn.NLGS(tol=1e-2)))
    rest, motion = [], []
    for _ in range(200):
        created = sim.step()["energy_created"]
        (rest if sim.energy["kinetic"] < 1e-3 * sim.energy["in_play"] else motion).append(created)
    assert len(rest) > 50 and max(rest) < MOST_CREATED < max(motion)  # what matters is told as before
