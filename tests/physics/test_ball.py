"""Bouncing ball: it comes to rest after sqrt(2h/g)(1+e)/(1-e), having travelled h(1+e^2)/(1-e^2)."""

import cairn as cn
import numpy as np
import pytest
from report import judge

HEIGHT, GRAVITY = 1.0, 9.81


def drop(e, dt, duration, dim=2):
    """Heights and speeds at every step of a ball dropped from HEIGHT above the floor."""
    rock = cn.Material("rock", density=1000.0)
    down = np.zeros(dim)
    down[-1] = -GRAVITY
    up, place = -down / GRAVITY, np.zeros(dim)
    place[-1] = HEIGHT + 0.1
    scene = cn.Scene(dim, gravity=down)
    shape = cn.disks if dim == 2 else cn.spheres
    scene.add(shape([place], 0.1, rock), cn.wall(np.zeros(dim), up, rock))
    scene.interact(rock, rock, cn.Restitution(mu=0.0, normal=e))
    sim = cn.Simulation(scene, dt, cn.NSCD(solver=cn.NLGS(tol=1e-10)))
    track = []
    while sim.time < duration:
        sim.step()
        track.append((sim.time, sim.bodies.position[0, dim - 1] - 0.1, sim.bodies.velocity[0, dim - 1]))
    return np.array(track), sim


def rest(track):
    """Instant after which the ball stays within 1e-6 of the height: the remaining bounces take a thousandth of the time."""
    return track[np.flatnonzero(np.abs(track[:, 1] - track[-1, 1]) > 1e-6 * HEIGHT)[-1], 0]


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("e", [0.0, 0.5, 0.8])
def test_path_and_time_converge_with_the_step(e, dim):
    fall = np.sqrt(2 * HEIGHT / GRAVITY)
    time = fall * (1 + e) / (1 - e)
    path = HEIGHT * (1 + e**2) / (1 - e**2)
    errors = []
    for dt in (4e-4, 1e-4):
        track, sim = drop(e, dt, 1.05 * time, dim)
        travelled = np.sum(np.abs(track[:, 2])) * dt
        errors.append(abs(travelled - path) / path)
        assert track[:, 1].min() > -2 * dt * np.sqrt(2 * GRAVITY * HEIGHT)
        assert abs(sim.energy["closure"]) <= 1e-12 * sim.energy["in_play"]
    print(f"bouncing ball e {e}: error of the path {errors[0]:.3g} at 4 dt, {errors[1]:.3g} at dt")
    judge("path", travelled, path, 5e-3)
    judge("time", rest(track), time, 5e-3)
    assert errors[1] <= max(0.5 * errors[0], 1e-3)


def test_e_of_one_keeps_its_energy():
    track, sim = drop(1.0, 1e-4, 5.0)
    energy = sim.energy["kinetic"] + sim.energy["potential"]
    judge("energy left", energy, 0.0, 1e-11, scale=sim.energy["in_play"])


def test_many_bounces_in_a_step_are_no_trouble():
    track, sim = drop(0.9, 0.05, 20.0)
    assert sim.info["status"] == "converged"
    assert abs(sim.energy["closure"]) <= 1e-12 * sim.energy["in_play"]
    judge("speed at rest", track[-1, 2], 0.0, 0.05 * GRAVITY, scale=1.0)
