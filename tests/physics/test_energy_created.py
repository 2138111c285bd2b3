"""Newton's restitution with friction may create energy (Kane & Levinson 1985): a step says how much."""

import warnings

import cairn as cn
import numpy as np
import pytest

HALF, RADIUS, MASS = 0.5, 0.05, 1.0
INERTIA = MASS * HALF**2 / 2


def hit(angle, slide, mu, normal):
    """A dumbbell that falls on a floor with one end: what the step says, kinetic energy before and after [J]."""
    rock = cn.Material("rock", density=1000.0)
    ends = np.array([[-HALF, 0.0], [HALF, 0.0]])
    height = max(-np.sin(angle) * end[0] for end in ends) + RADIUS
    scene = cn.Scene(2, gravity=(0, 0))
    scene.add(
        cn.clumps([[0, height]], ends, [RADIUS] * 2, MASS, INERTIA, rock, velocity=[[slide, -1.0]], rotation=[angle]),
        cn.wall(point=(0, 0), normal=(0, 1), material=rock),
    )
    scene.interact(rock, rock, cn.Restitution(mu=mu, normal=normal))
    sim = cn.Simulation(scene, 1e-6, cn.NSCD(theta=0.5, solver=cn.NLGS(tol=1e-12)))
    before = MASS * (slide**2 + 1) / 2
    info = sim.step()
    vx, vy, spin = sim.bodies.velocity[0]
    return info, before, MASS * (vx**2 + vy**2) / 2 + INERTIA * spin**2 / 2


def test_energy_that_a_contact_creates_is_told():
    made = []
    for angle in np.linspace(0.1, 1.4, 9):
        for slide in (-2.0, -0.5, 0.5, 2.0):
            for mu, normal in ((0.2, 1.0), (0.6, 1.0), (0.6, 0.7), (0.0, 1.0)):
                info, before, after = hit(angle, slide, mu, normal)
                # what a step turns over is its larger kinetic energy and the size of the work of its contacts; the run, which
                # has this step alone, counts as one of a thousand
                whole = (1 + 1e-3) * (max(before, after) + abs(after - before))
                assert info["energy_created"] * whole == pytest.approx(max(0.0, after - before), abs=1e-12)
                made.append((mu, after - before))
    gains = np.array([gain for mu, gain in made if mu > 0])
    assert (gains > 1e-3).any() and (gains < -1e-3).any()  # both kinds were seen
    assert all(abs(gain) < 1e-12 for mu, gain in made if mu == 0)  # e = 1 without friction keeps it


def test_a_pile_at_rest_makes_none():
    """Rounding errors of the work of contacts are compared with the work of gravity in a step."""
    rock = cn.Material("rock", density=1000.0)
    scene = cn.Scene(2, gravity=(0, -9.81))
    scene.add(cn.disks([(x, 0.5 + y) for y in range(5) for x in range(10)], np.full(50, 0.5), rock))
    scene.add(cn.wall(point=(0, 0), normal=(0, 1), material=rock))
    scene.interact(rock, rock, cn.Coulomb(mu=0.4))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(solver=cn.NLGS(tol=1e-12)))
    created = [sim.step()["energy_created"] for _ in range(20)]
    assert max(created) < 1e-10 and sim.energy["kinetic"] < 1e-9


def test_a_heavy_sphere_is_carried_by_a_light_box():
    """At a ratio of 1e12 the residual of sweeps is small while the sphere falls; the error of light bodies lets them go on."""

    def stand(solver):
        light, heavy = cn.Material("light", density=2400.0), cn.Material("heavy", density=2.4e15)
        scene = cn.Scene(3, gravity=(0, 0, -9.81))
        scene.add(cn.wall((0, 0, 0), (0, 0, 1), light), cn.boxes([[0, 0, 0.25]], (0.5, 0.5, 0.5), light))
        scene.add(cn.spheres([[0, 0, 0.7]], 0.2, heavy))
        scene.interact("*", "*", cn.Coulomb(mu=0.4))
        sim = cn.Simulation(scene, 1e-3, cn.NSCD(solver=solver))
        for _ in range(20):
            sim.step()
        return sim.bodies.position[2, 2]

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert stand(cn.NLGS()) == pytest.approx(0.7, abs=1e-7)
        assert stand(cn.Auto()) == pytest.approx(0.7, abs=1e-7)


def test_a_light_cube_that_sinks_under_what_doubles_cannot_carry_is_told():
    """Under a cube 1e30 times as heavy no number of 16 digits holds the impulses of the light one: each step converges."""
    rock, sizes = cn.Material("rock", density=2000.0), np.array([1e-6, 1e-4, 1e-2, 1.0, 1e2, 1e4])
    heights = np.cumsum(sizes) - sizes / 2
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    scene.add(cn.wall((0, 0, 0), (0, 0, 1), rock), *(cn.boxes([[0, 0, z]], (s, s, s), rock) for z, s in zip(heights, sizes)))
    scene.interact(rock, rock, cn.Coulomb(mu=0.5))
    sim = cn.Simulation(scene, 1e-4)
    with pytest.warns(cn.OverlapWarning, match=r"overlap by \d+% of .* in step \d+, which converged"):
        sim.run(steps=12, progress=False)
    with warnings.catch_warnings():
        warnings.simplefilter("error", cn.OverlapWarning)
        sim.run(steps=3, progress=False)  # once a run
