"""A grain on a base, a lid and a shaker, by smooth DEM and by NSCD, against closed forms: the kinds of tests of Asmar, Langston,
Matchett & Walters (2002, Comput. Chem. Eng. 26:785), on fall and bounce, friction, cohesion and a base that vibrates."""

import cairn as cn
import numpy as np
import pytest

STONE = cn.Material("stone", density=2500.0)
R, G = 0.01, 9.81
MASS = 2500 * 4 / 3 * np.pi * R**3
WEIGHT = MASS * G


def grain(law, height=R, speed=(0, 0, 0), gravity=-G, smooth=True, dt=None, base=0.0, **options):
    """A sphere above a base."""
    scene = cn.Scene(3, gravity=(0, 0, gravity))
    scene.add(cn.spheres([[0, 0, height]], R, STONE, velocity=[[*speed, 0, 0, 0]], **options))
    scene.add(cn.wall((0, 0, 0), (0, 0, 1), STONE, velocity=(0, 0, base, 0, 0, 0)))
    scene.interact("*", "*", law)
    return cn.Simulation(scene, dt or 2e-5, cn.SmoothDEM() if smooth else None, overlap="ignore")


@pytest.mark.parametrize("smooth", [True, False])
def test_heights_of_bounces_fall_by_the_square_of_the_restitution(smooth):
    e, drop = 0.8, 0.05
    law = cn.LinearSpring(stiffness=1e4, restitution=e) if smooth else cn.Restitution(normal=e)
    sim = grain(law, R + drop, smooth=smooth, dt=3e-5 if smooth else 1e-4)
    every, rows = 100 if smooth else 20, []
    while sim.time < 0.45:
        sim.run(steps=every, progress=False)
        rows.append(sim.bodies.position[0, 2] - R)
    z = np.array(rows)
    tops = z[1:-1][(z[1:-1] > z[:-2]) & (z[1:-1] >= z[2:])]
    assert len(tops) >= 2
    assert np.allclose(tops[:2], drop * e ** (2 * np.arange(1, 3)), rtol=0.02)


@pytest.mark.parametrize("smooth", [True, False])
def test_a_grain_that_does_not_turn_slides_to_a_stop(smooth):
    mu, speed = 0.3, 0.5
    law = cn.LinearSpring(stiffness=1e5, restitution=0.2, mu=mu) if smooth else cn.Coulomb(mu=mu)
    held = dict(driven=("wx", "wy", "wz"))
    sim = grain(law, R - WEIGHT / 1e5 if smooth else R, (speed, 0, 0), smooth=smooth, dt=2e-5 if smooth else 2e-4, **held)
    sim.run(until=0.25, progress=False)
    assert sim.bodies.position[0, 0] == pytest.approx(speed**2 / (2 * mu * G), rel=5e-3)
    assert abs(sim.bodies.velocity[0, 0]) < 1e-3 * speed


@pytest.mark.parametrize(("share", "hangs"), [(0.9, True), (1.1, False)])
@pytest.mark.parametrize("normal", ["dmt", "jkr"])
def test_a_sticky_grain_hangs_from_a_lid_up_to_its_pull_off_force(normal, share, hangs):
    """2 pi w R or 1.5 pi w R on a plane: gravity pulls it away, in the place of a lid above it."""
    work = WEIGHT / share / ((2 if normal == "dmt" else 1.5) * np.pi * R)
    sim = grain(cn.granular(normal, young=1e6, work=work, restitution=0.1), R - 1e-6, gravity=0.0)
    sim.run(steps=1000, progress=False)  # drawn onto the plane
    assert sim.bodies.position[0, 2] < R
    for pull in np.linspace(0, G, 100):
        sim.scene.gravity = (0, 0, pull)
        sim.run(steps=10, progress=False)
    sim.run(steps=2500, progress=False)
    assert bool(sim.bodies.position[0, 2] < 1.01 * R) is hangs


@pytest.mark.parametrize("smooth", [True, False])
@pytest.mark.parametrize("strength", [0.9, 2.0])
def test_a_grain_leaves_a_shaker_where_its_acceleration_exceeds_gravity(strength, smooth):
    """Base z = a sin(w t), strength a w^2/g: contact is lost at w t = asin(1/strength), and never below 1."""
    frequency = 10.0
    w = 2 * np.pi * frequency
    speed = strength * G / w
    wave = cn.Expression(f"{speed!r}*cos({w!r}*t)")
    law = cn.LinearSpring(stiffness=1e6, restitution=0.1) if smooth else cn.Coulomb(mu=0.0)
    sim = grain(law, R - WEIGHT / 1e6 if smooth else R, (0, 0, speed), smooth=smooth, dt=2e-5 if smooth else 2e-4, base=speed)
    sim.drive([1], "vz", wave)
    left = None
    while sim.time < 0.7 / frequency:
        sim.run(steps=20 if smooth else 2, progress=False)
        if sim.bodies.position[0, 2] - sim.bodies.position[1, 2] > R * (1 + 1e-4) and sim.time > 0.01 / frequency:
            left = sim.time
            break
    if strength < 1:
        assert left is None
    else:
        phase = np.arcsin(1 / strength)
        seen = (6 * 1e-4 * R / (strength * G * w * np.cos(phase))) ** (1 / 3)  # the gap grows as the cube of the time since
        assert left * w == pytest.approx(phase + seen * w, rel=0.05)
