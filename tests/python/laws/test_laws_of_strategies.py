"""Strategies that set something in the place of what a law says along the normal refuse the laws that say more than they keep; of
the others bodies rest and rebound as by NSCD."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=1000.0)
RADIUS = 0.1
WEIGHT = 10 * 1000 * np.pi * RADIUS**2
POSED = [cn.Carpenter(), cn.Carpenter(penalty=1e8), cn.GranularElement(stiffness=1e8)]
SPRING = {"stiffness": 1e6}


def disk(law, strategy, height=RADIUS, speed=0.0, gravity=10.0, dt=1e-3, below=True):
    """On a wall, or under one."""
    scene = cn.Scene(2, gravity=(0, -gravity))
    scene.add(cn.disks([[0, height]], RADIUS, ROCK, velocity=[[0, speed, 0]]))
    scene.add(cn.wall((0, 0), (0, 1 if below else -1), ROCK))
    scene.interact("*", "*", law)
    return cn.Simulation(scene, dt, strategy)


@pytest.mark.parametrize("strategy", POSED, ids=["multipliers", "penalty", "granular"])
@pytest.mark.parametrize("law, what", [
    (cn.Restitution(normal=0.8), "a restitution"),
    (cn.Restitution(tangential=0.5), "a restitution"),
    (cn.CriticalVoigt(mu=0.3), "a spring and a dashpot"),
    (cn.GapRescue(mu=0.3), "a spring that takes back overlap"),
    (cn.CoupledMotion(reach=0.01), "a hold on bodies that are apart"),
    (cn.Wear(mu=0.3, wear=1e-9), "a gap of its own"),
], ids=repr)  # fmt: skip
def test_what_a_pose_would_drop_is_refused(strategy, law, what):
    """Rebounds were 0 for 0.8 by multipliers, and overlaps a thirtieth of theirs, in steps that converged."""
    with pytest.raises(ValueError, match=f"law {type(law).__name__} has {what}: take NSCD"):
        disk(law, strategy)


@pytest.mark.parametrize("law, what", [
    (cn.UnilateralContact(mu=0.3, shift=0.01), "a gap of its own"),
    (cn.UnilateralContact(mu=0.3, normal=0.5), "a restitution"),
    (cn.ElasticContact(**SPRING, viscosity=1e3), "a dashpot"),
    (cn.ElasticContact(stiffness=0.0), "no stiffness"),
    (cn.ElasticContact(**SPRING, from_start=1), "a gap of its own"),
    (cn.AdhesiveContact(force=100.0, reach=0.0, **SPRING), "an attraction that its spring bears"),
    (cn.AdhesiveContact(force=0.0, reach=0.0, **SPRING, viscosity=1.0), "a dashpot"),
    (cn.AdhesiveContact(force=100.0, reach=0.0, normal=0.5), "a restitution"),
    (cn.MAC(normal_stiffness=1e8, tangential_stiffness=1e8, work=1.0, within=0.01), "bonds across a gap"),
], ids=repr)  # fmt: skip
def test_what_multipliers_would_drop_is_refused(law, what):
    with pytest.raises(ValueError, match=f"law {type(law).__name__} has {what}.*: take NSCD"):
        disk(law, cn.Carpenter())


@pytest.mark.parametrize("law, overlap", [
    (cn.Restitution(mu=0.3), 0.0),
    (cn.UnilateralContact(mu=0.3), 0.0),
    (cn.ElasticContact(**SPRING), WEIGHT / 1e6),
    (cn.AdhesiveContact(force=100.0, reach=0.0), 0.0),
    (cn.Wet(force=100.0, reach=1e-3), 0.0),
], ids=repr)  # fmt: skip
def test_what_multipliers_keep(law, overlap):
    sim = disk(law, cn.Carpenter())
    for _ in range(2000):
        sim.step()
    assert RADIUS - sim.bodies.position[0, 1] == pytest.approx(overlap, rel=1e-6, abs=1e-12)
    assert sim.contacts.force[0, 1] == pytest.approx(WEIGHT, rel=1e-6)


@pytest.mark.parametrize("law", [cn.Wet(force=500.0, reach=0.01), cn.BrittleCoating(stiffness=1e6, strength=1e4, reach=0.01),
                                 cn.CoupledMotion(reach=0.01)], ids=repr)  # fmt: skip
def test_no_flight_where_a_law_acts_across_a_gap(law):
    """A disk that 500 N hold on a ceiling against 314 N fell from it."""
    name = type(law).__name__
    with pytest.raises(ValueError, match=f"law {name} acts across a gap, and EventDriven flies bodies freely; keep NSCD"):
        disk(law, cn.EventDriven(), height=-RADIUS, below=False)
    assert name not in cn.EventDriven.__doc__ and "Rolling" in cn.EventDriven.__doc__


@pytest.mark.parametrize("law, rest", [
    (cn.ElasticContact(**SPRING, viscosity=1e3), WEIGHT / 1e6),
    (cn.AdhesiveContact(force=100.0, reach=1e-3, **SPRING, viscosity=1e3), (WEIGHT + 100) / 1e6),
    (cn.CriticalVoigt(mu=0.3, period=100.0), 10 * (100 * 1e-3 / (2 * np.pi)) ** 2 / 2),
    (cn.UnilateralContact(mu=0.3, shift=0.01), 0.01),
], ids=repr)  # fmt: skip
def test_no_projection_of_an_overlap_that_is_a_spring(law, rest):
    """Springs were let go in each step, and rest at 0."""
    with pytest.raises(ValueError, match=f"takes back every overlap, and law {type(law).__name__} has .*: leave it out"):
        disk(law, cn.NSCD(project_positions=True))
    sim = disk(law, cn.NSCD())
    for _ in range(5000):
        sim.step()
    assert RADIUS - sim.bodies.position[0, 1] == pytest.approx(rest, rel=2e-2)


@pytest.mark.parametrize("strategy", [lambda: cn.GranularElement(stiffness=1e8, project_positions=True),
                                      lambda: cn.Carpenter(penalty=1e8, project_positions=True)])  # fmt: skip
def test_no_projection_of_the_springs_of_a_strategy(strategy):
    with pytest.raises(ValueError, match="that of the springs of .* gives their force: leave it out"):
        disk(cn.Coulomb(mu=0.3), strategy())
    disk(cn.Coulomb(mu=0.3), cn.Carpenter(project_positions=True)).step()
