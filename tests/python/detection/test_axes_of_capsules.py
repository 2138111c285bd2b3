"""Capsules along any axis of their body: the same motion as with the body turned into that axis."""

import cairn as cn
import numpy as np
import pytest
from cairn.model import bodies
from cairn.model.round_shapes import _axial

ROCK = cn.Material("rock", density=2600.0)
AXIS = np.array([1.0, 0.2, 0.05]) / np.linalg.norm([1.0, 0.2, 0.05])
BOX = np.array([[x, y, z] for x in (-0.1, 0.2) for y in (-0.1, 0.2) for z in (0.6, 0.9)])


def motion(other, own):
    """Position and velocity of a capsule after it has fallen on a boundary, with something on top of it."""
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    scene.add(cn.tube((0, 0, 0.6), (1, 0, 0), 0.6, ROCK) if other == "tube" else cn.wall((0, 0, 0), (0, 0, 1), ROCK))
    capsule = cn.capsules([[0, 0, 0.3]], [0.1], [0.6], ROCK, axis=[AXIS])
    if own:
        hulls, which = _axial(np.array([0.1]), np.array([0.6]), np.array([0.4]), AXIS)
        contactors = [bodies.replace(capsule.contactors[0], hulls=hulls, hull=which)]
        capsule = capsule.with_(contactors=contactors, rotation=np.array([[1.0, 0, 0, 0]]))
    scene.add(capsule.with_(inertia=np.full((1, 3), 2.0)))  # alike about all axes
    if other == "sphere":
        scene.add(cn.spheres([[0.1, 0.05, 0.7]], 0.2, ROCK))
    elif other == "capsule":
        scene.add(cn.capsules([[0.1, 0.05, 0.6]], [0.1], [0.4], ROCK, axis=[[0, 1, 0]]))
    elif other == "polyhedron":
        faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
        scene.add(cn.polyhedra([(BOX - (0, 0, 0.15), faces)], ROCK))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 2e-3, cn.NSCD(solver=cn.NLGS(tol=1e-12, max_iter=5000)))
    sim.run(steps=100, progress=False)
    return np.concatenate([sim.bodies.position[1], sim.bodies.velocity[1]])


@pytest.mark.parametrize("other", ["wall", "sphere", "capsule", "polyhedron", "tube"])
def test_a_capsule_along_an_axis_of_its_body(other):
    turned, own = motion(other, False), motion(other, True)
    assert np.abs(turned - own).max() < 1e-7 * np.abs(turned).max() and turned[2] < 0.25
