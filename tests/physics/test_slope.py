"""Block on a slope: it sticks when mu >= tan a, else slides with g (sin a - mu cos a); no creep, no flight.

The block is a disk or sphere whose rotation is blocked. Slip to roll: a sphere reaches 5/7 v0 at 2 v0 / (7 mu g), a disk
2/3 v0 at v0 / (3 mu g).
"""

import cairn as cn
import numpy as np
import pytest
from report import judge

GRAVITY = 9.81


def block(tangent, mu, dim, dt=1e-3, turned=True, **strategy):
    """A body with blocked rotation on a plane; either the plane is turned or gravity is."""
    angle = np.arctan(tangent)
    rock = cn.Material("rock", density=1000.0)
    down, up = np.zeros(dim), np.zeros(dim)
    down[[0, -1]] = GRAVITY * np.sin(angle), -GRAVITY * np.cos(angle)
    up[-1] = 1
    along = np.eye(dim)[0]
    if turned:
        turn = np.eye(dim)
        turn[0, 0] = turn[-1, -1] = np.cos(angle)
        turn[0, -1], turn[-1, 0] = np.sin(angle), -np.sin(angle)
        down, up, along = turn @ down, turn @ up, turn @ along
    scene = cn.Scene(dim, gravity=down)
    shape, spins = (cn.disks, ("w",)) if dim == 2 else (cn.spheres, ("wx", "wy", "wz"))
    scene.add(shape([0.1 * up], 0.1, rock, driven=spins), cn.wall(np.zeros(dim), up, rock))
    scene.interact(rock, rock, cn.Coulomb(mu=mu))
    sim = cn.Simulation(scene, dt, cn.NSCD(solver=cn.NLGS(tol=1e-12), **strategy), overlap="ignore")
    return sim, along, up


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("turned", [False, True])
def test_sticks_below_the_angle_of_friction(dim, turned):
    sim, along, up = block(0.49, 0.5, dim, turned=turned)
    start = sim.bodies.position[0]
    for _ in range(5000):
        sim.step()
    moved = np.linalg.norm(sim.bodies.position[0] - start)
    judge("moved", moved, 0.0, 1e-12, scale=0.1)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("turned", [False, True])
def test_slides_above_it_and_does_not_fly(dim, turned):
    sim, along, up = block(0.51, 0.5, dim, turned=turned)
    start = sim.bodies.position[0]
    for _ in range(5000):
        sim.step()
    moved = sim.bodies.position[0] - start
    judge("distance", moved @ along, 1.0924, 1e-3)
    judge("gap", moved @ up, 0.0, 1e-12, scale=0.1)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("mu", [0.0, 0.3, 1e3])
@pytest.mark.parametrize("tangent", [0.05, 1.0, 50.0])
def test_acceleration(dim, mu, tangent):
    sim, along, up = block(tangent, mu, dim, turned=False)
    for _ in range(100):
        sim.step()
    angle = np.arctan(tangent)
    expected = max(0.0, GRAVITY * (np.sin(angle) - mu * np.cos(angle))) * sim.time
    judge("speed", sim.bodies.velocity[0, 0], expected, 1e-9, scale=GRAVITY * sim.time)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("mu", [0.01, 0.1, 0.5])
def test_slip_to_roll(dim, mu):
    speed, dt = 1.0, 1e-4
    rock = cn.Material("rock", density=1000.0)
    place, up = np.zeros(dim), np.zeros(dim)
    place[-1], up[-1] = 0.1, 1
    scene = cn.Scene(dim, gravity=-GRAVITY * up)
    shape = cn.disks if dim == 2 else cn.spheres
    scene.add(shape([place], 0.1, rock, velocity=np.eye(dim)[0] * speed), cn.wall(np.zeros(dim), up, rock))
    scene.interact(rock, rock, cn.Coulomb(mu=mu))
    sim = cn.Simulation(scene, dt, cn.NSCD(solver=cn.NLGS(tol=1e-12)), overlap="ignore")
    rolling, instant = (2 / 3, speed / (3 * mu * GRAVITY)) if dim == 2 else (5 / 7, 2 * speed / (7 * mu * GRAVITY))
    track = []
    while sim.time < 1.2 * instant:
        sim.step()
        track.append((sim.time, sim.bodies.velocity[0, 0]))
    track = np.array(track)
    judge("rolling speed", track[-1, 1], rolling * speed, 1e-3)
    slip = np.flatnonzero(track[:, 1] > rolling * speed * (1 + 1e-9))[-1]
    judge("instant", track[slip, 0], instant, 1e-3, scale=instant + 1e3 * dt)
    assert abs(sim.energy["closure"]) <= 1e-12 * sim.energy["in_play"]
