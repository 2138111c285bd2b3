"""Joints of C and Fortran programs against the same scene made in Python: to the bit."""

import cairn as cn
import numpy as np
import pytest
from cairn.model import bodies
from programs import told_by


@pytest.fixture(scope="module")
def swung():
    """The pendulum of tests/consumers/c/pendulum.c."""
    rock = cn.Material("rock")
    ball = bodies.ContactorSet("sphere", rock, np.array([0]), np.array([0.02]))
    place, inertia = np.array([[0.0995, 0.0, -0.01]]), np.array([[4e-4, 5e-4, 6e-4]])
    scene = cn.Scene(3, gravity=(9.81, 0.0, 0.0))
    scene.add(bodies.checked(bodies.BodySet(3, place, np.array([0.5]), inertia, [ball])))
    scene.join(0, None, cn.Ball(point=(0.0, 0.0, 0.0), strength=100.0))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(solver=cn.NLGS(tol=1e-11, max_iter=50000)))
    for _ in range(3000):
        sim.step()
    return {"position": sim.bodies.position[0], "velocity": sim.bodies.velocity[0], "impulse": sim.contacts.impulse[0]}


@pytest.mark.parametrize("program", ["pendulum_c", "pendulum_fortran"])
def test_a_pendulum_of_a_program_swings_as_that_of_python(program, swung, tmp_path):
    told = told_by(program, tmp_path)
    assert told.keys() == swung.keys()
    for name, values in swung.items():
        assert np.array_equal(told[name], values), name


def test_balls_that_a_program_joins_in_flight_fly_as_those_of_python(tmp_path):
    """tests/consumers/fortran/coupled.f90: joined as they stand after 20 steps, let go after 50 more."""
    told, rock = told_by("coupled", tmp_path), cn.Material("rock")
    for dim in (2, 3):
        speed = np.array([0.1 * (k + 1) * (-1) ** k for k in range(1, 3 * dim - 2)])
        balls = bodies.ContactorSet("disk" if dim == 2 else "sphere", rock, np.array([0, 1]), np.array([0.02, 0.03]))
        place, turn = np.zeros((2, dim)), np.full((2, 1 if dim == 2 else 3), 4e-4)
        place[1, 0] = 0.25
        scene = cn.Scene(dim)
        scene.add(bodies.checked(bodies.BodySet(dim, place, np.array([0.5, 0.75]), turn, [balls],
                                                velocity=np.array([speed, -0.5 * speed]))))  # fmt: skip
        scene.interact("*", "*", None)
        sim = cn.Simulation(scene, 1e-3, cn.NSCD(solver=cn.NLGS(tol=1e-11, max_iter=50000)))
        for steps in (20, 50, 20):
            for _ in range(steps):
                sim.step()
            if steps == 20 and sim.steps == 20:
                name = sim.join(0, 1, cn.Fixed(point=sim.bodies.position.sum(axis=0) / 2, strength=1e3))
            elif steps == 50:
                sim.unjoin(name)
        assert np.array_equal(told[f"position{dim}"], sim.bodies.position.ravel())
        assert np.array_equal(told[f"velocity{dim}"], sim.bodies.velocity.ravel())
