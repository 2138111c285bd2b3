"""Rods and wires by their closed forms: elastic, Voigt's, brittle; a rod pushes, a wire does not."""

import cairn as cn
import numpy as np
import pytest

R, GAP, STIFFNESS = 0.1, 0.05, 1e4  # [m], [m], E A [N]
SHARP = cn.NLGS(tol=1e-12, max_iter=5000)


def hung(dim, law, force=0.0, density=1000.0, theta=1.0, dt=1e-3, speed=0.0):
    """A grain at a gap from a wall, drawn away by a force, or moving away."""
    up = np.eye(dim)[-1]
    grain, wall = cn.Material("grain", density=density), cn.Material("wall", density=1000.0)
    scene = cn.Scene(dim)
    scene.add(cn.wall(np.zeros(dim), up, wall))
    still = np.zeros(2 * dim - 3)
    make = cn.disks if dim == 2 else cn.spheres
    scene.add(make([(R + GAP) * up], R, grain, force=(*(force * up), *still), velocity=[[*(speed * up), *still]]))
    scene.interact(grain, wall, law)
    return cn.Simulation(scene, dt, cn.NSCD(theta=theta, solver=SHARP))


def drawn(sim):
    return sim.bodies.position[-1, -1] - R - GAP


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("prestrain", [0.0, 0.1])
def test_a_rod_is_drawn_and_pressed_by_its_stiffness_a_wire_is_drawn_alone(dim, prestrain):
    """At rest its length is L (1 + prestrain + F/(E A)), L the gap at which it was made."""
    for kind in (cn.Rod, cn.Wire):
        for force in (200.0, -200.0):
            sim = hung(dim, kind(stiffness=STIFFNESS, prestrain=prestrain, viscosity=200.0, within=0.1), force)
            for _ in range(3000):
                assert sim.step()["status"] == "converged"
            if kind is cn.Rod or force > 0:
                assert drawn(sim) == pytest.approx(GAP * (prestrain + force / STIFFNESS), rel=1e-9)
                assert sim.contacts.impulse[0, -1] / sim.dt == pytest.approx(-force, rel=1e-9)
            else:  # nothing holds it off the wall
                assert drawn(sim) == pytest.approx(-GAP, rel=1e-9)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("kind", [cn.Rod, cn.Wire])
def test_voigts_rod_creeps_by_its_retardation_time(kind, dim):
    """Without inertia F L/(E A) (1 - exp(-t E A/eta)): half of the work of F is stored, the dashpot has the other half."""
    force, time = 200.0, 0.1
    law = kind(stiffness=STIFFNESS, viscosity=time * STIFFNESS, within=0.1)
    sim, last = hung(dim, law, force, density=1.0, dt=1e-3 * time), force * GAP / STIFFNESS
    for k in range(1, 10001):
        assert sim.step()["status"] == "converged"
        if k % 200 == 0:
            assert drawn(sim) == pytest.approx(last * -np.expm1(-sim.time / time), abs=4e-4 * last)  # of first order in the step
    energy = sim.info["energy"]
    assert energy["stored"] == pytest.approx(0.5 * force * last, rel=1e-3)
    assert energy["released"] == pytest.approx(0.5 * force * last, rel=2e-3)
    assert abs(energy["closure"]) < 1e-10 * energy["in_play"]


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("kind", [cn.Rod, cn.Wire])
def test_a_brittle_one_has_its_stiffness_its_strength_and_its_energy(kind, dim):
    """Elongation by a driven end: N = E A u/L up to the strength; the stored energy, S^2 L/(2 E A), is released."""
    strength = 50.0
    end = strength * GAP / STIFFNESS
    speed, dt = 1e-3, 1e-3 * end / 1e-3
    sim = hung(dim, kind(stiffness=STIFFNESS, strength=strength, within=0.1), density=1e12, dt=dt, speed=speed)
    most = 0.0
    for k in range(1, 1200):
        sim.step()
        there = len(sim.contacts) and sim.contacts.beta[0] > 0
        pull = -sim.contacts.impulse[0, -1] / dt if len(sim.contacts) else 0.0
        if k < 998:
            assert there and pull == pytest.approx(STIFFNESS * speed * k * dt / GAP, rel=1e-6)
        elif k > 1002:
            assert not there and pull == 0
        most = max(most, pull)
    assert most == pytest.approx(strength, rel=2e-3)
    energy = sim.info["energy"]
    assert energy["released"] == pytest.approx(0.5 * strength * end, rel=4e-3) and energy["stored"] == 0
