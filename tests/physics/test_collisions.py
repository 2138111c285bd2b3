"""Binary collisions with mass ratios to 1e12, oblique impacts, three touching balls, a stack."""

import cairn as cn
import numpy as np
import pytest
from report import judge

SOLVER = cn.NLGS(tol=1e-14, max_iter=20000)


def collide(dim, positions, radii, densities, velocities, law, steps=1, dt=1e-3):
    """Bodies that touch at the start of the step; returns the simulation after it."""
    scene = cn.Scene(dim)
    shape = cn.disks if dim == 2 else cn.spheres
    materials = [cn.Material(f"ball {k}", density=d) for k, d in enumerate(densities)]
    for x, r, m, v in zip(positions, radii, materials, velocities):
        scene.add(shape([x], r, m, velocity=v))
    scene.interact("*", "*", law)
    sim = cn.Simulation(scene, dt, cn.NSCD(solver=SOLVER), overlap="ignore")
    for _ in range(steps):
        sim.step()
    return sim


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("ratio", [1.0, 1e-12, 1e-6, 1e6, 1e12])
def test_momentum_and_restitution(dim, e, ratio):
    x, v = np.zeros((2, dim)), np.zeros((2, dim))
    x[1, 0], v[0, 0], v[1, 0] = 0.2, 1.0, -0.5
    sim = collide(dim, x, [0.1, 0.1], [1000.0, 1000.0 * ratio], v, cn.Restitution(mu=0.3, normal=e))
    m, after = sim.bodies.mass, sim.bodies.velocity[:, 0]
    before = v[:, 0]
    centre = m @ before / m.sum()
    expected = centre + e * (m @ before / m.sum() - before)
    judge("velocities", after, expected, 1e-12, scale=1.5)
    judge("momentum", m @ after, m @ before, 1e-12, scale=np.sum(m * np.abs(before)))
    judge("restitution", after[1] - after[0], -e * (before[1] - before[0]), 1e-12, scale=1.5)


@pytest.mark.parametrize("mu", [0.1, 0.3, 10.0])
@pytest.mark.parametrize("angle", [10.0, 40.0, 80.0])
@pytest.mark.parametrize("e", [0.3, 1.0])
def test_oblique_impact_of_a_sphere(mu, angle, e):
    """It leaves rolling iff mu (1 + e) >= (2/7) tan of the angle of incidence (Walton 1993)."""
    g = np.radians(angle)
    rock = cn.Material("rock", density=1000.0)
    scene = cn.Scene(3)
    scene.add(cn.spheres([[0, 0, 0.1]], 0.1, rock, velocity=(np.sin(g), 0, -np.cos(g))), cn.wall((0, 0, 0), (0, 0, 1), rock))
    scene.interact(rock, rock, cn.Restitution(mu=mu, normal=e))
    # a step so short that the contact point does not move: it stands in the middle of the gap
    sim = cn.Simulation(scene, 1e-15, cn.NSCD(solver=SOLVER), overlap="ignore")
    sim.step()
    v = sim.bodies.velocity[0]
    slip = v[0] - 0.1 * v[4]
    normal = (1 + e) * np.cos(g)
    rolls = mu * (1 + e) >= 2 / 7 * np.tan(g)
    judge("normal velocity", v[2], e * np.cos(g), 1e-12)
    judge("tangential velocity", v[0], 5 / 7 * np.sin(g) if rolls else np.sin(g) - mu * normal, 1e-11, scale=1.0)
    judge("slip", slip, 0.0 if rolls else np.sin(g) - 3.5 * mu * normal, 1e-11, scale=1.0)


@pytest.mark.parametrize("dim", [2, 3])
def test_three_touching_balls(dim):
    """Newton's law on all contacts at once gives (-1/3, 2/3, 2/3) when both touch (Moreau 1988)."""
    x, v = np.zeros((3, dim)), np.zeros((3, dim))
    x[:, 0], v[0, 0] = [0.0, 0.25, 0.5], 1.0
    sim = collide(dim, x, [0.125] * 3, [1000.0] * 3, v, cn.Restitution(mu=0.0, normal=1.0), dt=2.0**-20)
    judge("velocities", sim.bodies.velocity[:, 0], [-1 / 3, 2 / 3, 2 / 3], 1e-10)


def test_three_balls_a_gap_apart_answer_in_sequence():
    """A gap however small between the second and the third makes it two collisions: (0, 0, 1)."""
    x, v = np.zeros((3, 3)), np.zeros((3, 3))
    x[:, 0], v[0, 0] = [0.0, 0.25, 0.5 + 1e-9], 1.0
    sim = collide(3, x, [0.125] * 3, [1000.0] * 3, v, cn.Restitution(mu=0.0, normal=1.0), dt=1e-12, steps=3000)
    judge("velocities", sim.bodies.velocity[:, 0], [0, 0, 1], 1e-10)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("ratio", [1.0, 1e3, 1e6])
def test_stack(dim, ratio):
    """The reaction of each contact is the weight above it, the heaviest ball on top."""
    n, g = 10, 9.81
    x, up = np.zeros((n, dim)), np.eye(dim)[-1]
    x[:, -1] = 0.125 + 0.25 * np.arange(n)
    scene = cn.Scene(dim, gravity=-g * up)
    light, heavy = cn.Material("light", density=1000.0), cn.Material("heavy", density=1000.0 * ratio)
    shape, fixed = (cn.disks, ("vx", "w")) if dim == 2 else (cn.spheres, ("vx", "vy", "wx", "wy", "wz"))
    scene.add(shape(x[:-1], 0.125, light, driven=fixed), shape(x[-1:], 0.125, heavy, driven=fixed))
    scene.add(cn.wall(np.zeros(dim), up, light))
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(solver=cn.NLGS(tol=1e-8, max_iter=200000)), overlap="ignore")
    for _ in range(5):
        sim.step()
    assert sim.info["status"] == "converged"
    weight = sim.bodies.mass[:n] * g
    above = np.cumsum(weight[::-1])[::-1]
    force, pairs = sim.contacts.force[:, -1], sim.contacts.bodies
    for k in range(n):
        contact = np.flatnonzero(np.isin(pairs, [k]).any(1) & np.isin(pairs, [k - 1 if k else n]).any(1))[0]
        judge(f"reaction {k}", abs(force[contact]), above[k], 1e-6)
