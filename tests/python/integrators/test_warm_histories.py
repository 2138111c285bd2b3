"""Integrators that keep derivatives know the heat that stretches a mesh: from the start, over a restart, as others come in."""

import cairn as cn
import numpy as np
import pytest

KEEPING = {
    "Newmark": lambda: cn.Newmark(),
    "HHT": lambda: cn.HHT(alpha=-0.1),
    "GeneralisedAlpha": lambda: cn.GeneralisedAlpha(spectral_radius=0.8),
    "VelocityVerlet": lambda: cn.VelocityVerlet(),
    "Gear": lambda: cn.Gear(values=5),
}
METAL = cn.Material("metal", density=1000.0, young=1e9, poisson=0.3, conductivity=0.0, capacity=400.0, expansion=1e-4)


def bar(integrator, dt, solid=False, beside=False):
    """Ten cells, 100 K warmer than their reference, let go at the start."""
    x, y = (v.ravel() for v in np.meshgrid(np.linspace(0, 1, 11), np.linspace(0, 0.1, 2), indexing="ij"))
    n = np.arange(22).reshape(11, 2)
    cells = {"quad": np.stack([n[:-1, :-1], n[1:, :-1], n[1:, 1:], n[:-1, 1:]], -1).reshape(-1, 4)}
    points, more = np.column_stack([x, y]), dict(density=1000.0, groups={"left": n[0]})
    elastic = dict(young=1e6, poisson=0.3)
    if solid:
        body = cn.SolidBody(points, cells, cn.IsotropicElastic(**elastic), kinematics="small", **more)
    else:
        body = cn.ElasticBody(points, cells, **elastic, **more)
    scene = cn.Scene(2)
    scene.add(cn.deformable(body, METAL, fixed={"left": "xy"}, contact="left", name="bar"))
    if beside:
        scene.add(cn.disks([[500.0, 500.0]], 0.1, METAL))
    scene.interact(METAL, METAL, None)
    scene.thermal(initial=400.0, reference=300.0)
    return cn.Simulation(scene, dt, cn.NSCD(integrator=KEEPING[integrator]()))


@pytest.mark.parametrize("solid", [False, True])
@pytest.mark.parametrize("integrator", ["Newmark", "HHT", "GeneralisedAlpha", "VelocityVerlet"])
def test_heat_from_the_start_is_of_second_order(integrator, solid):
    """Regression: the initial history ignored heat, with errors of 0.26, 0.10, 0.045 at each half of the step."""
    ends = []
    for steps in (64, 128, 256):
        sim = bar(integrator, 8e-3 / steps, solid)
        for _ in range(steps):
            sim.step()
        ends.append(sim.nodes.velocity.copy())
    first, second = np.abs(ends[0] - ends[1]).max(), np.abs(ends[1] - ends[2]).max()
    assert 0 < second < first / 3


@pytest.mark.parametrize("solid", [False, True])
@pytest.mark.parametrize("integrator", KEEPING)
def test_a_warm_bar_restarts_to_the_same_bits(integrator, solid, tmp_path):
    """The temperatures that a restart gave anew were taken for another motion: velocities came out 1 to 12 % off."""
    sim, again = (bar(integrator, 1e-4, solid) for _ in range(2))
    for _ in range(7):
        sim.step()
    sim.checkpoint(tmp_path / "warm.h5")
    again.restore(tmp_path / "warm.h5")
    for _ in range(8):
        sim.step()
        again.step()
    assert np.array_equal(sim.nodes.velocity, again.nodes.velocity)
    assert np.array_equal(sim.nodes.position, again.nodes.position)


@pytest.mark.parametrize("integrator", KEEPING)
def test_who_comes_in_far_away_changes_nothing(integrator):
    """A disk that came in 500 m away changed velocities of the bar by up to 18 %."""
    alone, other = (bar(integrator, 1e-4, beside=True) for _ in range(2))
    for k in range(15):
        if k == 7:
            other.add(cn.disks([[-500.0, 500.0]], 0.1, METAL))
        alone.step()
        other.step()
    assert np.array_equal(alone.nodes.velocity, other.nodes.velocity)
