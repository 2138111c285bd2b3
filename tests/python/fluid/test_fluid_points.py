"""Points below the surfaces of bodies: they lie in layers, within the shape, and have its volume where they fill it."""

import cairn as cn
import numpy as np
import pytest
from cairn.model.fluid_points import depth_in, points_of

CUBE = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
FACES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
SHAPES = {
    "disk": (2, {"radius": 1.0}, np.pi),
    "sphere": (3, {"radius": 1.0}, 4 / 3 * np.pi),
    "polygon": (2, {"radius": 0.0, "vertex": np.array([(-1, -1), (2, -1), (1, 1), (-1, 1.0)])}, 5.0),
    "polyhedron": (3, {"radius": 0.0, "vertex": CUBE, "faces": [np.array(f) for f in FACES]}, 8.0),
    "capsule": (3, {"radius": 0.8, "half": 1.0, "direction": np.array([0, 0.6, 0.8])}, np.pi * 0.64 * (2 + 3.2 / 3)),
    "cylinder": (3, {"radius": 0.8, "half": 1.0, "direction": np.array([1.0, 0, 0])}, np.pi * 0.64 * 2),
    "segment": (2, {"radius": 0.5, "half": 1.0, "direction": np.array([0.6, 0.8])}, 2.0 + np.pi * 0.25),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_points_lie_in_the_shape_and_take_its_volume(shape):
    dim, form, volume = SHAPES[shape]
    form = {"offset": np.full(dim, 0.25), **form}
    spacing = 0.1
    shell = points_of(shape, dim, form, spacing, 0.3)
    depth = depth_in(shape, dim, form, shell.place)
    assert np.all(depth > 0) and np.all(shell.depth < 0.3 + 1e-12) and np.allclose(depth, shell.depth, atol=0.51 * spacing)
    outside = depth_in(shape, dim, form, shell.place + 1.01 * (shell.depth[:, None]) * shell.normal)
    assert np.mean(outside < 1e-9) > 0.97  # the normals lead out
    assert abs(shell.depth.min() - 0.5 * spacing) < 0.5 * spacing
    whole = points_of(shape, dim, form, spacing, 2.0)
    assert abs(whole.volume.sum() / volume - 1) < 0.06
    place = shell.place[:1200]
    apart = np.linalg.norm(place[:, None] - place[None], axis=2) + 9 * np.eye(len(place))
    assert apart.min() > 0.3 * spacing


def test_parts_of_a_body_do_not_count_twice():
    wood = cn.Material("wood", density=500.0)
    scene = cn.Scene(dim=2)
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 1.0)])
    scene.add(cn.polygons([[square, square + (1, 0), square + (0, 1)]], wood))
    scene.add(cn.fluid([(5, 5), (6, 6)], 0.1, sound_speed=10.0))
    from cairn.run.fluid import _bodies_of

    sim = cn.Simulation(scene, dt=1e-3)
    parts = _bodies_of(scene, sim._sets, 0.1)
    place = np.concatenate([p.points.place for p in parts])
    apart = np.linalg.norm(place[:, None] - place[None], axis=2) + 9 * np.eye(len(place))
    assert len(parts) == 3 and apart.min() > 0.03


def test_a_ball_and_a_block_rise_in_space():
    scene = cn.Scene(dim=3, gravity=(0, 0, -9.81))
    wood, rock = cn.Material("wood", density=200.0), cn.Material("rock", density=2600.0)
    scene.add(cn.wall((0, 0, 0), (0, 0, 1), rock))
    for k in range(2):
        way = np.eye(3)[k]
        scene.add(cn.wall(np.zeros(3), way, rock), cn.wall((1 + (k == 0)) * way, -way, rock))
    ball = scene.add(cn.spheres([[0.5, 0.5, 0.5]], 0.25, wood))[0]
    block = scene.add(cn.boxes([[1.5, 0.5, 0.5]], [[0.4, 0.4, 0.4]], wood))[0]
    scene.add(cn.fluid([(0, 0, 0), (2, 1, 1)], 0.1))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, dt=4e-3)
    for _ in range(5):
        sim.step()
    for k in (ball, block):
        velocity = sim.bodies.velocity[sim.bodies.id == k][0]
        assert velocity[2] > 0.02 and np.abs(velocity[:2]).max() < 0.5 * velocity[2]
