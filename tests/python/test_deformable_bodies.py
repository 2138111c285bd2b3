"""Deformable bodies in the step: where impulses act on them, sizes from small to large, what is wrong and named."""

import cairn as cn
import numpy as np
import pytest
from cairn.build.elastic import ElasticBody

ROCK = cn.Material("rock", density=2000.0)


def plate(cells=(4, 2), size=(1.0, 0.5), corner=(0.0, 0.0), young=1e7, poisson=0.2, density=2000.0, **more):
    """Quadrilaterals on a lattice; groups top and bottom."""
    x, y = (np.linspace(c, c + s, n + 1) for c, s, n in zip(corner, size, cells))
    points = np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2)
    number = np.arange(len(points)).reshape(cells[0] + 1, cells[1] + 1)
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], -1).reshape(-1, 4)
    groups = {"top": number[:, -1], "bottom": number[:, 0]}
    return ElasticBody(points, {"quad": quads}, young=young, poisson=poisson, density=density, groups=groups, **more)


@pytest.mark.parametrize("contact_point, share", [("surface", 1.0), ("middle", 0.5)])
def test_where_impulses_of_a_disk_on_an_edge_act(contact_point, share):
    """A spinning disk that a step brings down from a gap and friction stops: the point that stands still is on the edge, or in
    the middle of the gap."""
    radius, gap, h = 0.01, 2e-4, 1e-4
    scene = cn.Scene(dim=2)
    body = plate()
    scene.add(cn.deformable(body, ROCK, edges="top", fixed={"top": "xy", "bottom": "xy"}))
    scene.add(cn.disks([[0.4, 0.5 + radius + gap]], radius, ROCK, velocity=(0.0, -10.0, 100.0)))
    scene.interact(ROCK, ROCK, cn.GapCoulomb(mu=5.0))
    sim = cn.Simulation(scene, h, cn.NSCD(1.0, cn.NLGS(tol=1e-12), 1e-3, contact_point=contact_point))
    sim.step()
    x, y, spin = sim.bodies.velocity[np.argmin(np.abs(sim.bodies.position[:, 1] - 0.51))]
    assert y == pytest.approx(-gap / h, rel=1e-12) and spin > 10.0
    assert x + spin * (radius + share * gap) == pytest.approx(0.0, abs=1e-12)
