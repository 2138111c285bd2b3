"""Bodies at rest stay in place under every integrator: histories ignore contacts, and impulses cancel the motion they would
cause."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=1000.0)
ALL = [cn.Theta(), cn.Newmark(), cn.Newmark(beta=0.2, gamma=0.5), cn.Newmark(beta=0.4, gamma=0.6), cn.HHT(alpha=-0.3),
       cn.GeneralisedAlpha(spectral_radius=0.2), cn.CentralDifference(), cn.BetaScheme(beta=0.7), cn.VelocityVerlet(),
       cn.Gear(values=4), cn.Gear(values=5), cn.Gear(values=6)]  # fmt: skip


def towers(integrator, law, dim=2, dt=1e-2):
    """Three bodies on each other, on a floor."""
    scene = cn.Scene(dim, gravity=(0, -9.81, 0)[:dim])
    make = cn.disks if dim == 2 else cn.spheres
    scene.add(make([[0, 0.5 + k, 0][:dim] for k in range(3)], 0.5, ROCK), cn.wall((0,) * dim, (0, 1, 0)[:dim], ROCK))
    scene.interact(ROCK, ROCK, law)
    return cn.Simulation(scene, dt, cn.NSCD(integrator=integrator, solver=cn.NLGS(tol=1e-14, max_iter=10**5)))


@pytest.mark.parametrize("integrator", ALL, ids=repr)
@pytest.mark.parametrize("law", [cn.Coulomb(mu=0.5), cn.GapCoulomb(mu=0.5)], ids=["rigid", "gap"])
@pytest.mark.parametrize("dim", [2, 3])
def test_what_rests_stays(integrator, law, dim):
    """To rounding of the way that free fall takes in a step, g dt^2, for each of 100 steps."""
    sim = towers(integrator, law, dim)
    start = sim.bodies.position.copy()
    for _ in range(100):
        sim.step()
    assert np.abs(sim.bodies.position - start).max() < 1e-12 * 9.81e-4 * 100
    assert np.abs(sim.bodies.velocity).max() < 1e-12 * 9.81e-2


@pytest.mark.parametrize("integrator", ALL, ids=repr)
def test_loads_that_change_leave_it_within_a_bound(integrator):
    """A load that swings between 0 and 2 g: what rests swings by a part of g dt^2, and does not drift."""
    scene = cn.Scene(2)
    scene.add(cn.disks([[0, 0.5]], 0.5, ROCK, force=lambda t: (0, -1e4 * (1 + np.sin(9 * t)), 0)), cn.wall((0, 0), (0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.5))
    sim, way = cn.Simulation(scene, 1e-2, cn.NSCD(integrator=integrator)), []
    for _ in range(600):
        sim.step()
        way.append(abs(sim.bodies.position[0, 1] - 0.5) / (1e4 / sim.bodies.mass[0] * 1e-4))
    assert max(way) < 0.8 and max(way[300:]) <= 1.01 * max(way[:300]) + 1e-9


@pytest.mark.parametrize("integrator", ALL, ids=repr)
def test_what_falls_comes_to_rest(integrator):
    """From a height, without restitution: it ends on the floor, within the way of a step, and the balance closes."""
    scene = cn.Scene(2, gravity=(0, -10.0))
    scene.add(cn.disks([[0, 0.6]], 0.5, ROCK), cn.wall((0, 0), (0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.5))
    sim = cn.Simulation(scene, 3e-3, cn.NSCD(integrator=integrator))
    for _ in range(200):
        sim.step()
    speed = np.sqrt(2 * 10 * 0.1)
    assert abs(sim.bodies.position[0, 1] - 0.5) < speed * 3e-3 and abs(sim.bodies.velocity[0, 1]) < 1e-12
    assert abs(sim.energy["closure"]) < 1e-12 * sim.energy["in_play"]
    assert sim.energy["dissipated_normal"] == pytest.approx(1000 * np.pi / 4 * 10 * 0.1, rel=0.1)


@pytest.mark.parametrize("integrator", ALL, ids=repr)
def test_a_mesh_that_rests_stays(integrator):
    """A damped square of four cells, at rest on a floor: once it is, its nodes stay, and its floor carries its weight."""
    points = np.stack(np.meshgrid(range(3), range(3), indexing="ij"), -1).reshape(-1, 2) / 2
    cells = {"quad": np.array([[0, 3, 4, 1], [1, 4, 5, 2], [3, 6, 7, 4], [4, 7, 8, 5]])}
    body = cn.ElasticBody(points, cells, young=1e5, poisson=0.3, density=1000.0, rayleigh=(30.0, 0.0))
    scene = cn.Scene(2, gravity=(0.0, -10.0))
    scene.add(*cn.deformable(body, ROCK, contact=[0, 3, 6]), cn.wall((0, 0), (0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.5))
    sim = cn.Simulation(scene, 2e-3, cn.NSCD(integrator=integrator, solver=cn.NLGS(tol=1e-13, max_iter=10**5)))
    for _ in range(1500):
        sim.step()
    start = sim.meshes[0].displacement.copy()
    for _ in range(100):
        sim.step()
    assert np.abs(sim.meshes[0].displacement - start).max() < 1e-9 * 10 * 4e-6 * 100
    drag = 1 + 30 * 2e-3 if isinstance(integrator, cn.Gear) else 1  # of the velocity that it predicts, which knows no contact
    assert abs(sim.contacts.impulse[:, 1].sum()) == pytest.approx(1e4 * 2e-3 / drag, rel=1e-9)
