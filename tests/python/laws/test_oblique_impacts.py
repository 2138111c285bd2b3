"""Impacts of spheres as Chung & Ooi (2011, Granular Matter 13) pose them: along the normal and at an angle, on a plane and
between spheres, like and unlike, that spin; against closed forms where they slide or roll throughout, and else against an
integration of the two springs with steps a hundred times as short."""

import math

import cairn as cn
import numpy as np
import pytest

ALUMINA = {"young": 3.8e11, "poisson": 0.23, "density": 4000.0, "mu": 0.092, "restitution": 0.98}
ALLOY = {"young": 7.0e10, "poisson": 0.33, "density": 2700.0, "mu": 0.4, "restitution": 0.5}
NYLON = {"young": 2.48e9, "poisson": 0.4, "density": 1000.0, "mu": 0.4, "restitution": 0.5}


def law_of(m):
    return cn.HertzMindlin(young=m["young"], poisson=m["poisson"], restitution=m["restitution"], mu=m["mu"])


def collide(m, radii, velocities, share=2e-3):
    """Returns velocities after the impact of spheres along z, or of one sphere and a floor where there is one radius."""
    stone = cn.Material("stone", density=m["density"])
    scene = cn.Scene(3)
    high = [radii[0] * 1.0000001, -(radii[-1]) * 0.9999999]
    for r, v, z in zip(radii, velocities, high):
        scene.add(cn.spheres([[0, 0, z]], r, stone, velocity=[v]))
    if len(radii) == 1:
        scene.add(cn.wall((0, 0, 0), (0, 0, 1), stone))
    scene.interact("*", "*", law_of(m))
    mass = [m["density"] * 4 / 3 * math.pi * r**3 for r in radii]
    heavy = mass[0] if len(radii) == 1 else mass[0] * mass[1] / (mass[0] + mass[1])
    radius = radii[0] if len(radii) == 1 else radii[0] * radii[1] / (radii[0] + radii[1])
    modulus = m["young"] / (2 * (1 - m["poisson"] ** 2))
    speed = abs(velocities[0][2] - (velocities[1][2] if len(radii) == 2 else 0))
    lasts = 2.87 * (heavy**2 / (radius * modulus**2 * speed)) ** 0.2
    sim = cn.Simulation(scene, share * lasts, cn.SmoothDEM(unstable="ignore"), overlap="ignore")
    for _ in range(int(1.6 / share)):
        sim.step()
    assert sim.info["contacts"] == 0
    return sim.bodies.velocity[: len(radii)], (mass, heavy, radius, modulus, lasts)


def two_springs(m, scales, u, steps=60_000):
    """Relative velocity (normal, tangential) of the surfaces after an impact, by the Hertz-Mindlin springs and dashpots."""
    mass, heavy, radius, modulus, lasts = scales
    gives = 3.5 / heavy  # 1/m + R^2/I of solid spheres, summed
    shear = m["young"] / (4 * (2 - m["poisson"]) * (1 + m["poisson"]))
    beta = -math.log(m["restitution"]) / math.hypot(math.pi, math.log(m["restitution"]))
    h, depth, slip, un, ut = 1.6 * lasts / steps, 0.0, 0.0, u[0], u[1]
    for _ in range(steps):
        depth -= h / 2 * un
        slip += h / 2 * ut
        a = math.sqrt(radius * max(depth, 0.0))
        fn = 4 / 3 * modulus * a * depth - 2 * math.sqrt(5 / 6) * beta * math.sqrt(2 * modulus * a * heavy) * un
        k = 8 * shear * a
        ft = -k * slip - 2 * math.sqrt(5 / 6) * beta * math.sqrt(k * heavy) * ut
        limit = m["mu"] * max(fn, 0.0)
        if depth > 0 and abs(ft) > limit:
            ft = math.copysign(limit, ft)
            slip = -ft / k
        if depth <= 0:
            if un > 0:
                break
            fn = ft = 0.0
        un += h * fn / heavy
        ut += h * gives * ft
        depth -= h / 2 * un
        slip += h / 2 * ut
    return un, ut


@pytest.mark.parametrize("m", [ALUMINA, NYLON])
def test_normal_impacts(m):
    """Tests 1 to 3: like spheres exchange their velocities, a plane gives them back, times the restitution."""
    after, _ = collide(m, [0.01, 0.01], [(0, 0, -1.0), (0, 0, 1.0)])
    assert after[0][2] == pytest.approx(m["restitution"], rel=3e-3) and after[1][2] == pytest.approx(-after[0][2], rel=1e-12)
    for restitution in (0.2, 0.6, 1.0):
        after, _ = collide(m | {"restitution": restitution}, [0.1], [(0, 0, -0.2)])
        assert after[0][2] == pytest.approx(0.2 * restitution, rel=1e-2)


@pytest.mark.parametrize("angle", [5, 15, 30, 45, 60, 80])
def test_oblique_impacts_on_a_plane(angle):
    """Test 4: the speed is 3.9 m/s whatever the angle to the normal."""
    m, r, t = ALUMINA, 0.0025, math.radians(angle)
    before = (3.9 * math.sin(t), 0, -3.9 * math.cos(t))
    after, scales = collide(m, [r], [before])
    un, ut = two_springs(m, scales, (before[2], before[0]))
    surface = after[0][0] - r * after[0][4]  # of the lowest point
    assert after[0][2] == pytest.approx(un, rel=2e-3)
    assert abs(surface - ut) < 3e-3 * 3.9
    assert after[0][0] + 0.4 * r * after[0][4] == pytest.approx(before[0], rel=2e-3)  # moment about the point of contact
    if math.tan(t) > 3.5 * m["mu"] * (1 + m["restitution"]) * 1.05:  # slides throughout
        assert before[0] - after[0][0] == pytest.approx(m["mu"] * (after[0][2] - before[2]), rel=3e-3)


@pytest.mark.parametrize("m", [ALLOY, NYLON])
@pytest.mark.parametrize("spin", [0.5, 4.0, 40.0])
@pytest.mark.parametrize("radii", [(0.1,), (0.1, 0.1), (0.1, 0.4)])
def test_spheres_that_spin(m, spin, radii):
    """Tests 5 to 8: the normal velocity is 0.2 m/s whatever the spin; on a plane, on a like sphere that spins the same way, on
    one of four times the radius."""
    before = [(0, 0, -0.2, 0, spin, 0), (0, 0, 0.2, 0, spin, 0)][: len(radii)]
    after, scales = collide(m, list(radii), before)
    closing = -0.2 * len(radii)
    un, ut = two_springs(m, scales, (closing, -sum(r * spin for r in radii)))
    v = after
    normal = v[0][2] - (v[1][2] if len(radii) == 2 else 0)
    surface = v[0][0] - radii[0] * v[0][4] - ((v[1][0] + radii[1] * v[1][4]) if len(radii) == 2 else 0)
    assert normal == pytest.approx(un, rel=1e-2)
    assert abs(surface - ut) < 1e-2 * max(abs(closing), spin * sum(radii))
    if len(radii) == 2:
        momentum = scales[0][0] * v[0][:3] + scales[0][1] * v[1][:3]
        assert np.allclose(momentum, [0, 0, -0.2 * (scales[0][0] - scales[0][1])], atol=1e-9 * scales[0][1])
    if spin * sum(radii) > 3.5 * m["mu"] * (1 + m["restitution"]) * abs(closing) * 1.1:  # slides throughout
        push = m["mu"] * scales[1] * (un - closing)
        assert push * 0.999 < scales[0][0] * v[0][0] < 1.05 * push  # the dashpot pulls at the end, without friction
