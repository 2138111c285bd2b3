"""A mesh that lands on a corner, rocks and slides: a new simulation goes on to the same bits, whatever was touched before."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=1000.0)


def landing(angle, columns):
    x, y = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 0.6, 9), indexing="ij")
    n = np.arange(x.size).reshape(x.shape)
    cells = np.stack([n[:-1, :-1], n[1:, :-1], n[1:, 1:], n[:-1, 1:]], -1).reshape(-1, 4)
    c, s = np.cos(angle), np.sin(angle)
    points = np.c_[x.ravel(), y.ravel()] @ np.array([[c, s], [-s, c]])
    points[:, 1] -= points[:, 1].min() - 1e-3
    body = cn.ElasticBody(points, {"quad": cells}, young=1e6, poisson=0.3, density=1000.0, groups={"all": n.ravel()})
    scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
    scene.add(cn.deformable(body, ROCK, contact="all", velocity=(0.3, -1.5)), cn.wall((0, 0), (0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.4))
    return cn.Simulation(scene, 0.004)


@pytest.mark.parametrize(("angle", "columns"), [(0.05, 12), (0.2, 12), (0.1, 40)])
def test_a_restart_knows_no_nodes_that_were_touched_before(angle, columns, tmp_path):
    """Fewer nodes touch at the cuts than did: contacts on few keep what they do to the body, and did not where it had many."""
    one, cuts = landing(angle, columns), (17, 26, 35, 44)
    for k in range(60):
        if k in cuts:
            one.checkpoint(tmp_path / str(k))
        one.step()
    for cut in cuts:
        two = landing(angle, columns)
        two.restore(tmp_path / str(cut))
        for _ in range(60 - cut):
            two.step()
        assert np.array_equal(one.meshes[0].displacement, two.meshes[0].displacement)
        assert np.array_equal(one.meshes[0].velocity, two.meshes[0].velocity)
