"""Elastic blocks that slide over the seams of a floor of rigid ones: inner edges do not stop them, real steps do."""

import cairn as cn
import numpy as np
import pytest
from second_order import box

# blocks that a step stops turn over it
pytestmark = pytest.mark.filterwarnings("ignore::cairn.TurnedWarning")

STONE = cn.Material("stone", density=1000.0)
SIZE = 0.5
MU, GRAVITY = 0.1, 9.81


def slid(kind, given, seams, yaw=0.0, mu=0.0, step=0.0, slope=0.0, time=0.8):
    """Speed and way along x of a block of 0.5 m that slides at 1 m/s over so many seams, the last of them at `step` [m]."""
    dim = 2 if kind in ("quad", "triangle") else 3
    points, cells = box(kind, (4 if dim == 2 else 2,) * dim, (SIZE,) * dim)
    points = points - np.array([SIZE / 2] * (dim - 1) + [0.0])
    outside = np.isclose(points, points.min(axis=0)).any(axis=1) | np.isclose(points, points.max(axis=0)).any(axis=1)
    groups = {"bottom": np.flatnonzero(points[:, -1] == 0), "all": np.flatnonzero(outside)}
    if dim == 3:
        points = points @ np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]]).T + (0, 0.1, 0)
    points[:, 0] -= 0.6
    body = cn.ElasticBody(points, cells, young=1e7, poisson=0.3, density=1000.0, groups=groups, rayleigh=(0.0, 1e-3))
    scene = cn.Scene(dim, gravity=(0.0,) * (dim - 1) + (-GRAVITY,))
    sides = {} if given == "nodes" else {"edges" if dim == 2 else "faces": given}
    scene.add(
        cn.deformable(body, STONE, contact="all" if given == "all" else "bottom", velocity=(1.0,) + (0.0,) * (dim - 1), **sides)
    )
    ends = [-2.0, *np.linspace(-0.3, 0.6, max(seams, 1))[:seams], 2.0]
    for k, (start, end) in enumerate(zip(ends[:-1], ends[1:])):
        top = step if 0 < k == seams else 0.0
        drop = slope * max(end + 0.3, 0.0) if k else 0.0  # beyond a kink
        if dim == 2:
            scene.add(cn.polygons([[[start, -1], [end, -1], [end, top - drop], [start, top]]], STONE, fixed=True))
        else:
            scene.add(cn.boxes([[(start + end) / 2, 0, (top - 1) / 2]], (end - start, 4, 1 + top), STONE, fixed=True))
    scene.interact("*", "*", cn.Coulomb(mu=mu) if mu else cn.Frictionless())
    sim = cn.Simulation(scene, 1e-3, overlap="ignore")
    mass = body.nodal_mass() / body.nodal_mass().sum()
    while sim.time < time:
        sim.step()
    return mass @ sim.meshes[0].velocity[:, 0], mass @ sim.meshes[0].displacement[:, 0]


KINDS = [("quad", 0.0), ("triangle", 0.0), ("hexahedron", 0.0), ("hexahedron", 0.3), ("tetra", 0.0), ("tetra", 0.3)]


@pytest.mark.parametrize("kind, yaw", KINDS)
@pytest.mark.parametrize("given", ["nodes", "bottom", "all"])
def test_it_keeps_its_speed(kind, yaw, given):
    """Nodes alone, the sides below as well, or the whole outside: it ran back at 0.04 to 0.58 m/s over one seam."""
    speed, way = slid(kind, given, 4, yaw)
    assert speed == pytest.approx(1.0, abs=5e-6) and way == pytest.approx(0.8, abs=1e-4)  # sweeps end at 1e-4


@pytest.mark.parametrize("kind", ["quad", "hexahedron", "tetra"])
@pytest.mark.parametrize("given", ["nodes", "bottom", "all"])
def test_friction_takes_what_it_takes_on_one_block(kind, given):
    _, one = slid(kind, given, 0, mu=MU)
    _, several = slid(kind, given, 4, mu=MU)
    assert several == pytest.approx(one, rel=1e-3)


@pytest.mark.parametrize("kind", ["quad", "hexahedron"])
@pytest.mark.parametrize("given", ["nodes", "bottom", "all"])
def test_a_step_of_a_thousandth_stops_it(kind, given):
    speed, way = slid(kind, given, 1, step=1e-3 * SIZE, time=0.3)
    assert speed < 0.0 and way < 0.1


@pytest.mark.parametrize("given", ["nodes", "bottom"])
def test_a_convex_kink_does_not(given):
    """It gains the speed of its fall down a slope of 1/100 behind an upright inner side."""
    speed, way = slid("quad", given, 1, slope=0.01)
    assert speed == pytest.approx(1.0 + GRAVITY * 0.01 * 0.6, abs=0.02) and way > 0.8


def square_under_a_block(right):
    """An elastic block on a fixed square of its width, with edges below it, and beside it where wanted."""
    points, cells = box("quad", (2, 2), (1.0, 1.0))
    groups = {"bottom": np.flatnonzero(points[:, 1] == 0), "right": np.flatnonzero(points[:, 0] == 1.0)}
    body = cn.ElasticBody(points, cells, young=1e9, poisson=0.2, density=2000.0, groups=groups)
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    scene.add(cn.polygons([[[0, -1], [1, -1], [1, 0], [0, 0]]], STONE, fixed=True))
    scene.add(cn.deformable(body, STONE, edges=["bottom", "right"] if right else "bottom"))
    scene.interact("*", "*", cn.Coulomb(mu=0.8))
    return cn.Simulation(scene, 1e-3, overlap="ignore")


def test_edges_round_a_corner_meet_what_is_under_the_corner_below_alone():
    """The end of the upright edge reached 25 mm into the square, which threw it up at 25 m/s."""
    below, round_it = square_under_a_block(False), square_under_a_block(True)
    for _ in range(50):
        below.step()
        round_it.step()
        assert len(round_it.contacts) == len(below.contacts) == 4
        assert np.abs(round_it.contacts.gap).max() < 1e-4
        np.testing.assert_allclose(round_it.nodes.velocity, below.nodes.velocity, atol=1e-9)
