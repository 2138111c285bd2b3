"""A mesh that lands on a corner, rocks and slides: a new simulation goes on to the same bits, for any earlier contacts."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=1000.0)


def landing(angle, columns, integrator=None, law=None, **more):
    x, y = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 0.6, 9), indexing="ij")
    n = np.arange(x.size).reshape(x.shape)
    cells = np.stack([n[:-1, :-1], n[1:, :-1], n[1:, 1:], n[:-1, 1:]], -1).reshape(-1, 4)
    c, s = np.cos(angle), np.sin(angle)
    points = np.c_[x.ravel(), y.ravel()] @ np.array([[c, s], [-s, c]])
    points[:, 1] -= points[:, 1].min() - 1e-3
    groups = {"all": n.ravel(), "grip": n[columns // 2 :, -1]}
    if law:
        body = cn.SolidBody(points, {"quad": cells}, law, density=1000.0, groups=groups)
    else:
        body = cn.ElasticBody(points, {"quad": cells}, young=1e6, poisson=0.3, density=1000.0, groups=groups)
    scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
    scene.add(cn.deformable(body, ROCK, contact="all", velocity=(0.3, -1.5), **more), cn.wall((0, 0), (0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.4))
    return cn.Simulation(scene, 0.004, cn.NSCD(integrator=integrator))


def assert_goes_on(simulation, cuts, steps, folder):
    """New simulations that go on from the cuts of one end at its bits."""
    one = simulation()
    for k in range(steps):
        if k in cuts:
            one.checkpoint(folder / str(k))
        one.step()
    for cut in cuts:
        two = simulation()
        two.restore(folder / str(cut))
        for _ in range(steps - cut):
            two.step()
        assert np.array_equal(one.meshes[0].displacement, two.meshes[0].displacement)
        assert np.array_equal(one.meshes[0].velocity, two.meshes[0].velocity)
    return one


@pytest.mark.parametrize(("angle", "columns"), [(0.05, 12), (0.2, 12), (0.1, 40)])
def test_a_restart_knows_no_nodes_that_were_touched_before(angle, columns, tmp_path):
    """Fewer nodes touch at the restarts than before. Contacts on few nodes store their compliance, and did not where the body had
    many."""
    assert_goes_on(lambda: landing(angle, columns), (17, 26, 35, 44), 60, tmp_path)


@pytest.mark.parametrize("what", ["HHT", "GeneralisedAlpha", "rigid", "modal", "beta", "stresses"])
def test_nodes_touch_again_one_after_the_other(what, tmp_path):
    """Compliance between two nodes is found from the later one, where it is no entry of an inverse."""
    integrators = {"HHT": cn.HHT(alpha=-0.1), "GeneralisedAlpha": cn.GeneralisedAlpha(spectral_radius=0.6),
                   "beta": cn.Newmark(beta=0.3025, gamma=0.6), "stresses": cn.HHT(alpha=-0.1)}  # fmt: skip
    more = {"rigid": {"rigid": "grip"}, "modal": {"modal_damping": 0.02},
            "stresses": {"law": cn.J2Plasticity(young=1e6, poisson=0.3, yield_stress=1e9)}}.get(what, {})  # fmt: skip
    one = assert_goes_on(lambda: landing(0.05, 12, integrators.get(what), **more), (17, 26, 35, 44), 60, tmp_path)
    assert one.meshes[0].displacement.shape == (117, 2)


def test_a_step_of_another_length_has_its_own_order(tmp_path):
    """Steps of three lengths by turns, in factors of their own: each knows which nodes touched in it, and in which order."""

    def simulation():
        sim = landing(0.05, 12, cn.HHT(alpha=-0.1))
        step = sim.step
        sim.step = lambda: (setattr(sim, "dt", (0.004, 0.002, 0.001)[sim.steps % 3]), step())
        return sim

    assert_goes_on(simulation, (20, 41, 70), 100, tmp_path)
