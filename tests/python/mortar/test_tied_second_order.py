"""Tied sides of cells of second order: a uniform stress through non-matching cells, their mass, refusals."""

import cairn as cn
import numpy as np
import pytest
from test_mortar_faces import flat, mesh

ROCK = cn.Material("rock", density=1000.0)


def part(kind, cells, low, **more):
    """A block of one metre and a half, 1 m wide, from a height on; kind: of 2D or 3D."""
    dim = 2 if kind.startswith(("tri", "quad")) else 3
    base = "quad9" if kind.startswith("tri") else kind
    points, made, groups = plane(base, kind, cells) if dim == 2 else mesh(kind, cells)
    points = points + np.array([0.0, 0.0, low])[-dim:]
    given = {"young": 1e5, "poisson": 0.0, "density": 1.0} | more
    height = points[:, -1]
    groups |= {"bottom": np.flatnonzero(height == height.min()), "top": np.flatnonzero(height == height.max())}
    return cn.ElasticBody(points, made, groups=groups, **given)


def plane(base, kind, cells):
    """Points, cells and no groups of a rectangle of quadrilaterals, or of each cut into two triangles of six nodes."""
    body = flat(base, cells, (0.0, 0.0))
    points, made = body.points, next(iter(body.cells.values()))
    if kind == "triangle6":
        made = np.concatenate([made[:, [0, 1, 2, 4, 5, 8]], made[:, [0, 2, 3, 8, 6, 7]]])
    return points, {kind: made}, {}


def stretched(kinds, cells):
    """The largest error of the stresses of two tied parts under a uniform strain, over the stress, and the body."""
    below, above = part(kinds[0], cells[0], 0.0), part(kinds[1], cells[1], 0.5)
    body = cn.tied({"below": below, "above": above}, [("above.bottom", "below.top")])
    axes, given = "xyz"[: body.dim], np.zeros_like(body.points)
    given[body.nodes("above.top"), -1] = -1e-3
    u = body.solve({"below.bottom": axes, "above.top": axes}, displacement=given)
    exact = np.zeros(3 * body.dim - 3)
    exact[body.dim - 1] = -100.0
    return max(np.abs(stress - exact).max() for stress in body.stress(u).values()) / 100, body


PLANE = ["triangle6", "quad8", "quad9"]
SPACE = ["tetra", "tetra10", "hexahedron", "hexahedron20", "hexahedron27"]


@pytest.mark.parametrize("below", PLANE)
@pytest.mark.parametrize("above", PLANE)
@pytest.mark.parametrize("cells", [((2, 2), (3, 2)), ((3, 2), (2, 1)), ((2, 2), (2, 2))])
def test_a_uniform_stress_goes_through_parabolic_edges(below, above, cells):
    """Ties use the shape functions of whole sides; with linear ones between nodes errors were 3 to 12 % of the stress."""
    assert stretched((below, above), cells)[0] < 1e-12


@pytest.mark.parametrize("below", SPACE)
@pytest.mark.parametrize("above", SPACE[1:])
def test_a_uniform_stress_goes_through_faces_of_second_order(below, above):
    """Ties of flat pieces with linear functions between nodes erred by 1 to 6 %."""
    error, body = stretched((below, above), ((2, 2, 1), (3, 2, 1)))
    assert error < 1e-12
    _, start, leaders, weight = body.ties
    assert np.abs(np.add.reduceat(weight, start[:-1]) - 1).max() < 1e-13


@pytest.mark.parametrize("kinds", [("quad8", "triangle6"), ("hexahedron20", "tetra10")])
def test_linear_motion_passes_and_momentum_is_kept(kinds):
    """Nodes that follow are where a turn and a strain of what leads put them; a step in flight changes no momentum."""
    cells = ((2, 2), (3, 2)) if kinds[0] == "quad8" else ((2, 2, 1), (3, 2, 1))
    _, body = stretched(kinds, cells)
    nodes, start, leaders, weight = body.ties
    moved = body.points @ np.random.default_rng(3).normal(size=(body.dim, body.dim))
    found = np.add.reduceat(weight[:, None] * moved[leaders], start[:-1], axis=0)
    assert np.abs(found - moved[nodes]).max() < 1e-12
    scene = cn.Scene(dim=body.dim)
    scene.add(cn.deformable(body, ROCK, velocity=(1.0, *[0.0] * (body.dim - 1))))
    sim = cn.Simulation(scene, 1e-3)
    for _ in range(20):
        sim.step()
    assert np.abs(sim.meshes[0].velocity[:, 0] - 1.0).max() < 1e-9


def test_groups_have_all_nodes_of_their_sides():
    below, above = part("quad8", (2, 2), 0.0), part("quad8", (3, 2), 0.5)
    bottom = above.groups["bottom"]
    above.groups["bottom"] = bottom[above.points[bottom, 0] < 0.6]
    with pytest.raises(ValueError, match="is of second order, and its node .* is not in 'above.bottom', which is to follow"):
        cn.tied({"below": below, "above": above}, [("above.bottom", "below.top")])
