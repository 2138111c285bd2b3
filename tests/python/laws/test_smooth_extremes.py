"""Smooth laws at their extremes: sizes of 1e-9 and 1e6 m, masses a factor of 1e12 apart, no friction and very much, steps a
thousand times too long. Each ends in a motion that is possible, or in an error that names the fault."""

import cairn as cn
import numpy as np
import pytest

LAWS = ["linear", "hertz", "jkr", "dmt", "adhesive", "rolling", "torque", "wet", "plastic", "yield", "bond"]


def law_of(name, size, mu=0.5):
    """Laws whose forces on spheres of this radius, of 2500 kg/m3, are those on spheres of 5 mm, scaled with their weight."""
    s = size / 0.005
    young = 1e8 * s  # Pa as density times g times length
    k = 1e4 * s**2 * s  # N/m = Pa m
    work = 0.1 * s**3  # J/m2
    return {
        "linear": lambda: cn.LinearSpring(stiffness=k / s, restitution=0.5, mu=mu),
        "hertz": lambda: cn.HertzMindlin(young=young, poisson=0.3, restitution=0.5, mu=mu),
        "jkr": lambda: cn.JKR(young=young, poisson=0.3, work=work / s, restitution=0.5, mu=mu),
        "dmt": lambda: cn.granular("dmt", young=young, work=work / s, restitution=0.5, mu=mu),
        "adhesive": lambda: cn.AdhesiveSpring(stiffness=k / s, adhesion=1.0 * s**2, damping=0.2, viscosity=0.1 * s**2.5, mu=mu),
        "rolling": lambda: cn.granular(young=young, restitution=0.5, mu=mu, rolling="spring_dashpot", rolling_mu=0.1),
        "torque": lambda: cn.granular(young=young, restitution=0.5, mu=mu, rolling="constant_torque", rolling_mu=0.1),
        "wet": lambda: cn.LiquidBridge(
            young=young, poisson=0.3, tension=0.07 * s**2, volume=1e-11 * s**3, angle=0.2, restitution=0.5, mu=mu
        ),
        "plastic": lambda: cn.PlasticContact(loading=k / s, unloading=2 * k / s, cohesion=0.1 * k / s, plastic=0.05, mu=mu),
        "yield": lambda: cn.YieldContact(young=young, yield_pressure=1e5 * s, poisson=0.3, restitution=0.5, mu=mu),
        "bond": lambda: cn.SmoothBond(
            normal_stiffness=1e10 * 1.0, tangential_stiffness=5e9 * 1.0, tension=1e4 * s, shear=1e4 * s, within=0.1 * size, mu=mu
        ),
    }[name]()


def pair(law, size, ratio=1.0, speed=1.0, share=0.05, factor=1.0, **options):
    """A sphere that falls at an angle, spinning, on another one."""
    light, heavy = cn.Material("light", density=2500.0), cn.Material("heavy", density=2500.0 * ratio)
    fast = speed * (size / 0.005) ** 0.5
    scene = cn.Scene(3)
    scene.add(cn.spheres([[0, 0, 2.02 * size]], size, light, velocity=[(0.3 * fast, 0, -fast, 0, 0.4 * fast / size, 0)]))
    scene.add(cn.spheres([[0, 0, 0.0]], size, heavy))
    scene.interact("*", "*", law)
    sim = cn.Simulation(scene, 1e-30, cn.SmoothDEM(**options), overlap="ignore")
    sim.dt = factor * share * sim.stable_step
    return sim, fast


def is_possible(sim, fast, mass):
    e, v = sim.energy, sim.bodies.velocity
    assert np.isfinite(v).all() and np.isfinite(sim.bodies.position).all()
    assert all(np.isfinite(x) for x in e.values())
    assert e["kinetic"] <= 1.02 * (0.5 + 0.2 * 0.16 + 0.045) * mass * fast**2 + abs(e["stored"])
    assert abs(e["closure"]) <= 1e-9 * e["in_play"]


@pytest.mark.parametrize("law", [name for name in LAWS if name != "bond"])
@pytest.mark.parametrize("size", [1e-9, 1e6])
def test_sizes(law, size):
    """The motion in units of the size is that of spheres of 5 mm."""
    ends = []
    for r in (0.005, size):
        sim, fast = pair(law_of(law, r), r)
        mass = sim.bodies.mass[0]
        for _ in range(400):
            sim.step()
        is_possible(sim, fast, mass)
        ends.append(sim.bodies.velocity[:, :3] / fast)
    assert np.allclose(ends[0], ends[1], atol=0.05), ends


@pytest.mark.parametrize("law", LAWS)
def test_masses_far_apart(law):
    for ratio in (1e-12, 1e12):
        sim, fast = pair(law_of(law, 0.005), 0.005, ratio)
        masses, before = sim.bodies.mass.copy(), sim.bodies.velocity[:, :3].copy()
        for _ in range(400):
            sim.step()
        v = sim.bodies.velocity
        assert np.isfinite(v).all()
        momentum = masses @ v[:, :3] - masses @ before
        assert np.abs(momentum).max() < 1e-9 * masses[0] * fast


@pytest.mark.parametrize("law", [name for name in LAWS if name != "bond"])
def test_friction_from_none_to_very_much(law):
    sim, fast = pair(law_of(law, 0.005, mu=0.0), 0.005)
    mass = sim.bodies.mass[0]
    for _ in range(400):
        sim.step()
    is_possible(sim, fast, mass)
    if law not in ("rolling", "torque"):
        assert abs(sim.bodies.velocity[1, 4]) < 1e-12 * fast / 0.005  # nothing turned the other sphere
    sim, fast = pair(law_of(law, 0.005, mu=1e3), 0.005)
    for _ in range(400):
        sim.step()
    is_possible(sim, fast, mass)


@pytest.mark.parametrize("law", LAWS)
def test_steps_a_thousand_times_too_long(law):
    sim, _ = pair(law_of(law, 0.005), 0.005, factor=1e3)
    with pytest.raises(ValueError, match="beyond the stable step"):
        sim.step()
    sim, _ = pair(law_of(law, 0.005), 0.005, factor=1e3, unstable="ignore")
    try:
        for _ in range(30):
            sim.step()
    except ValueError as error:
        assert "no finite number" in str(error) or "stands nowhere" in str(error) or "turns too fast" in str(error)
    else:
        assert np.isfinite(sim.bodies.velocity).all()
