"""Edges of a mesh in the plane that follow each other: what slides over a straight row meets one of them at a time."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=1000.0)


def block(cells, corner, size, young=1e9):
    x, y = (np.linspace(0.0, s, n + 1) for s, n in zip(size, cells))
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2) + corner
    k = np.arange(len(points)).reshape(cells[0] + 1, cells[1] + 1)
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], axis=-1).reshape(-1, 4)
    groups = {"top": k[:, -1], "bottom": k[:, 0], "left": k[0], "right": k[-1], "all": k.ravel()}
    return cn.ElasticBody(points, {"quad": quads}, young=young, poisson=0.0, density=1000.0, groups=groups)


@pytest.mark.parametrize("edges", [1, 16, 32])
def test_a_block_slides_over_any_number_of_edges_without_a_jolt(edges):
    """Pressed by 10 kPa, without friction: nodes stay where they are pressed to, nothing drags."""
    press = 1e4 * 0.4
    slider, floor = block((4, 2), (0.0, 0.0), (0.4, 0.2)), block((edges, 1), (-0.5, -0.2), (2.5, 0.2), young=1e11)
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(slider, ROCK, contact="bottom", edges="bottom", name="slider", drive={"top": {"x": 1.0}},
                            velocity=(1.0, 0.0), force={"top": (0.0, -press)}))  # fmt: skip
    scene.add(cn.deformable(floor, ROCK, edges="top", fixed={"bottom": "xy"}, name="floor"))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.0))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(theta=1.0, solver=cn.NLGS(tol=1e-9, max_iter=20000)))
    for step in range(400):
        assert sim.step()["status"] == "converged"
        if step <= 20:
            continue
        assert len(sim.contacts.force) == 5
        force = sim.contacts.force.sum(axis=0)
        assert abs(force[0]) < 1e-6 * press and force[1] == pytest.approx(press, rel=1e-4)
        assert sim.meshes[0].displacement[slider.groups["bottom"], 1].max() < 1e-7


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_disk_rolls_over_a_row_and_keeps_its_height(way):
    """The disk leaves the row at its end, where the last edge is a corner."""
    scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
    scene.add(cn.deformable(block((8, 1), (0.0, -0.1), (0.8, 0.1)), ROCK, edges="top", fixed={"all": "xy"}, name="floor"))
    scene.add(cn.disks([[0.4, 0.02]], 0.02, ROCK, velocity=[[0.5 * way, 0.0, 0.0]]))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.0))
    sim = cn.Simulation(scene, 1e-3)
    for _ in range(700):
        sim.step()
        assert np.allclose(sim.bodies.velocity[0], [0.5 * way, 0.0, 0.0], atol=1e-9)
    for _ in range(300):
        sim.step()
    assert sim.bodies.velocity[0, 1] < -0.5


def test_a_side_round_the_corner_does_not_reach_over_the_top():
    """The round end of its bar lies within five hundredths of an edge of the corner, under a point that is on the top."""
    scene = cn.Scene(dim=2)
    whole = block((1, 1), (0.0, -1.0), (1.0, 1.0))
    scene.add(cn.deformable(whole, ROCK, edges="all", fixed={"all": "xy"}, name="block"))
    scene.add(cn.disks([[0.98, 0.001]], 0.001, ROCK, velocity=[[0.0, -0.1, 0.0]]))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.0))
    sim = cn.Simulation(scene, 1e-3)
    sim.step()
    assert np.allclose(sim.contacts.normal, [[0.0, 1.0]], atol=1e-12) and np.allclose(sim.bodies.velocity, 0.0, atol=1e-12)
