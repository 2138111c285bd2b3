"""A bond between points that nothing moves leaves the error of other contacts as it is."""

import cairn as cn
import numpy as np

ROCK = cn.Material("rock", density=2000.0)


def pressed(least):
    """A ball that falls on an elastic block, a held corner of which touches a wall from the start."""
    x, y = np.meshgrid(np.linspace(0, 2, 5), np.linspace(0, 1, 3), indexing="ij")
    points, k = np.stack([x, y], -1).reshape(-1, 2), np.arange(15).reshape(5, 3)
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], -1).reshape(-1, 4)
    groups = {"bottom": k[:, 0], "touches": np.append(k[:, 2], k[0, 0])}
    body = cn.ElasticBody(points, {"quad": quads}, young=1e6, poisson=0.3, density=1000.0, groups=groups)
    scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
    scene.add(cn.deformable(body, ROCK, contact="touches", edges=np.append(k[:, 2], k[0]), fixed={"bottom": "xy"}))
    scene.add(
        cn.disks([(0.9, 1.26), (1.45, 1.27)], 0.25, ROCK, velocity=[(0.5, -1.0), (-0.5, -1.0)]), cn.wall((0, 0), (1, 0), ROCK)
    )
    scene.interact("*", "*", cn.Bonded(mu=0.3))
    return cn.Simulation(scene, 2e-3, cn.NSCD(solver=cn.NLGS(tol=1e-10, min_iter=least, max_iter=5000)), overlap="ignore")


def test_contacts_beside_it_are_solved_to_the_tolerance():
    once, long = pressed(1), pressed(200)
    most = 0
    for _ in range(40):
        most = max(most, once.step()["iterations"])
        long.step()
        assert once.info["status"] == "converged"
        assert np.abs(once.bodies.velocity - long.bodies.velocity).max() < 1e-7 * np.abs(long.bodies.velocity).max()
    assert once.contacts.beta.max() == 1 and most > 3
