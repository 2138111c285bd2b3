"""Methods whose accelerations know no contact: what rests sinks as fast as is told, and the run warns."""

import warnings

import cairn as cn
import pytest


def sunk(integrator, dt=1e-2, steps=100, gravity=9.81):
    rock = cn.Material("rock", density=1000.0)
    scene = cn.Scene(2, gravity=(0, -gravity))
    scene.add(cn.disks([[0, 0.5]], 0.5, rock), cn.wall((0, 0), (0, 1), rock))
    scene.interact(rock, rock, cn.Coulomb(mu=0.5))
    sim = cn.Simulation(scene, dt, cn.NSCD(integrator=integrator))
    for _ in range(steps):
        sim.step()
    return (0.5 - sim.bodies.position[0, 1]) / (gravity * dt**2 * steps)


@pytest.mark.parametrize("integrator", [cn.VelocityVerlet(), cn.Gear(values=5), cn.Newmark(beta=0.2, gamma=0.5)], ids=repr)
def test_what_rests_sinks_as_told(integrator):
    with pytest.warns(cn.SinkingWarning, match="what rests sinks"):
        found = sunk(integrator)
    assert integrator.sinks > 0.05
    assert found == pytest.approx(integrator.sinks, rel=0.02)


@pytest.mark.parametrize("integrator", [cn.Theta(), cn.Newmark(), cn.CentralDifference(), cn.BetaScheme()], ids=repr)
def test_others_stand(integrator):
    with warnings.catch_warnings():
        warnings.simplefilter("error", cn.SinkingWarning)
        assert abs(sunk(integrator)) < 1e-12
