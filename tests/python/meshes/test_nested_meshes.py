"""Meshes that begin wholly within each other, and rigid bodies within meshes: told once, where no side is near."""

import warnings

import cairn as cn
import numpy as np
import pytest
from second_order import box

ROCK, OTHER = cn.Material("rock", density=2500.0), cn.Material("other", density=2500.0)
NEO = cn.NeoHookean(young=1e8, poisson=0.3)
KINDS = ["triangle", "quad", "quad8", "tetra", "hexahedron", "hexahedron20"]


def dim_of(kind):
    return 3 if kind.startswith(("tetra", "hexa")) else 2


def body(kind, counts, size, corner, turn=0.0, solid=False):
    dim = dim_of(kind)
    points, cells = box(kind, (counts,) * dim, (size,) * dim)
    if turn:
        frame = np.eye(dim)
        frame[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
        points = (points - size / 2) @ frame.T + size / 2
    made = cn.SolidBody if solid else cn.ElasticBody
    law = {"material": NEO} if solid else {"young": 1e8, "poisson": 0.3}
    return made(points + corner, cells, density=1000.0, groups={"all": np.arange(len(points))}, **law)


def touching(mesh, name, material=ROCK, **options):
    sides = {"edges" if mesh.dim == 2 else "faces": "all"}
    return cn.deformable(mesh, material, contact="all", name=name, **(sides | options))


def placed(*sets, dim=2, law=True, between=(ROCK, ROCK), **options):
    scene = cn.Scene(dim=dim, gravity=(0.0,) * dim)
    for s in sets:
        scene.add(*s) if isinstance(s, (list, tuple)) else scene.add(s)
    if law:
        scene.interact(*between, cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, dt=1e-6, overlap="ignore", **options)


def nested(kind, *, shift=0.35, size=0.2, scale=1.0, origin=0.0, turn=0.0, solid=False, law=True, inner=None, outer=None):
    """A block of a fifth within one of a metre, whose cells are a quarter."""
    dim = dim_of(kind)
    where = np.full(dim, origin)
    large = body(kind, 4, scale, where, turn, solid)
    small = body(kind, 2, size * scale, where + shift * scale, turn, solid)
    return placed(touching(large, "outer", **(outer or {})), touching(small, "inner", **(inner or {})), dim=dim, law=law)


def told(sim, words):
    with pytest.warns(cn.OverlapWarning, match=words) as seen:
        info = sim.step()
    assert len(seen) == 1 and info["hint"] == info["mesh_within"] == str(seen[0].message)
    return info


def quiet(sim, steps=1):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for _ in range(steps):
            info = sim.step()
    assert "mesh_within" not in info
    return info


@pytest.mark.parametrize("turn", [0.0, 0.3])
@pytest.mark.parametrize("kind", KINDS)
def test_a_mesh_wholly_within_another_is_told_of_once(kind, turn):
    sim = nested(kind, turn=turn)
    info = told(sim, r"node \d+ of the mesh 'inner', which lies wholly within the mesh 'outer' at the begin of step 1: no side")
    assert info["status"] == "converged"
    quiet(sim, 3)


def test_a_solid_names_its_cell():
    told(nested("quad", solid=True), r"node \d+, quad cell \d+, of the mesh 'inner', which lies wholly within the mesh 'outer'")


@pytest.mark.parametrize("scale, origin", [(1e-9, 0.0), (1e9, 0.0), (1.0, 1e9), (1e3, -1e9), (1e-3, 0.0)])
@pytest.mark.parametrize("kind", ["quad", "hexahedron"])
def test_at_any_size_and_place(kind, scale, origin):
    sim = nested(kind, scale=scale, origin=origin)
    sim.dt = 1e-6 * scale
    told(sim, "of the mesh 'inner', which lies wholly within the mesh 'outer'")
    sim = nested(kind, scale=scale, origin=origin, shift=1.5)
    sim.dt = 1e-6 * scale
    quiet(sim)


@pytest.mark.parametrize("kind", KINDS)
def test_the_same_mesh_twice_is_told_of(kind):
    """All nodes and sides of one are those of the other."""
    info = nested(kind, size=1.0, shift=0.0).step()
    assert "wholly within" in info["mesh_within"]


@pytest.mark.parametrize("kind", KINDS)
def test_what_touches_from_outside_is_not_told_of(kind):
    """At a face, along a line, and at a corner."""
    dim = dim_of(kind)
    for shift in ([1.0, 0.4, 0.4], [1.0, 1.0, 0.4], [1.0, 1.0, 1.0], [-0.2, 0.4, 0.4]):
        quiet(nested(kind, shift=np.array(shift[:dim])))


def ring(inner, outer, cells=24, thick=2):
    """A ring of quadrilaterals about the origin."""
    angle = 2 * np.pi * np.arange(cells) / cells
    radius = np.linspace(inner, outer, thick + 1)
    points = np.stack([np.outer(np.cos(angle), radius), np.outer(np.sin(angle), radius)], -1).reshape(-1, 2)
    k = np.arange(len(points)).reshape(cells, thick + 1)
    after = np.roll(k, -1, axis=0)
    quads = np.stack([k[:, :-1], k[:, 1:], after[:, 1:], after[:, :-1]], -1).reshape(-1, 4)
    groups = {"all": np.arange(len(points))}
    return cn.ElasticBody(points, {"quad": quads}, young=1e8, poisson=0.3, density=1000.0, groups=groups)


def shell(turn=0.0):
    """A cube of 3 by 3 by 3 cells without the middle one."""
    points, cells = box("hexahedron", (3, 3, 3), (3.0, 3.0, 3.0))
    middle = np.abs(points[cells["hexahedron"]].mean(axis=1) - 1.5).max(axis=1) < 0.1
    cells = {"hexahedron": cells["hexahedron"][~middle]}
    return cn.ElasticBody(points - 1.5, cells, young=1e8, poisson=0.3, density=1000.0, groups={"all": np.arange(len(points))})


def test_what_lies_in_a_hollow_is_not_told_of():
    quiet(placed(touching(ring(1.0, 1.5), "ring"), touching(ring(0.2, 0.6), "within")))
    quiet(placed(touching(ring(1.0, 1.5), "ring"), cn.disks([[0.1, 0.2], [0.5, 0.0]], 0.2, ROCK)))
    quiet(placed(touching(ring(1.0, 1.5), "ring"), touching(body("quad", 2, 0.5, (-0.2, -0.3)), "block")))
    quiet(placed(touching(shell(), "shell"), touching(body("hexahedron", 2, 0.9, -0.45), "block"), dim=3))
    quiet(placed(touching(shell(), "shell"), cn.spheres([[0.0, 0.1, 0.0]], 0.3, ROCK), dim=3))
    quiet(placed(touching(shell(), "shell"), touching(body("hexahedron", 2, 1.0, -0.5), "fits"), dim=3))


def test_what_lies_in_the_wall_of_a_hollow_is():
    small = body("quad", 2, 0.1, (1.2, -0.05))
    told(placed(touching(ring(1.0, 1.5), "ring"), touching(small, "block")), "'block', which lies wholly within the mesh 'ring'")
    small = body("hexahedron", 2, 0.1, (0.95, -0.05, -0.05))
    told(placed(touching(shell(), "shell"), touching(small, "block"), dim=3), "'block', which lies wholly within .* 'shell'")


def test_a_rigid_body_within_a_mesh_is_told_of():
    square = [(-0.05, -0.05), (0.05, -0.05), (0.05, 0.05), (-0.05, 0.05)]
    for sets in (cn.disks([[0.37, 0.63]], 0.05, ROCK), cn.polygons([square], ROCK, position=[[0.37, 0.63]])):
        sim = placed(touching(body("quad", 1, 1.0, (0.0, 0.0)), "outer"), sets)
        told(sim, r"body \d+, which lies wholly within the mesh 'outer' at the begin of step 1")
        quiet(sim)
    ball = cn.spheres([[0.37, 0.63, 0.5]], 0.05, ROCK)
    told(placed(touching(body("hexahedron", 1, 1.0, 0.0), "outer"), ball, dim=3), "body .* wholly within the mesh 'outer'")
    quiet(placed(touching(body("quad", 1, 1.0, (0.0, 0.0)), "outer"), cn.disks([[1.06, 0.5]], 0.05, ROCK)))


def test_a_mesh_within_a_rigid_surface_is_told_of():
    """A closed surface of triangles is solid behind them; a mesh in the hollow of a surface, or in one with a hole, is
    accepted."""
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    small = touching(body("hexahedron", 2, 0.3, (0.2, -0.4, 0.1)), "block")
    outside = touching(body("hexahedron", 2, 0.3, (1.0, -0.4, 0.1)), "block")
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    for x in (corners, corners @ turn.T):
        sim = placed(cn.surface(x, faces, ROCK), small, dim=3)
        told(sim, r"node \d+ of the mesh 'block', which lies wholly within body \d+ at the begin of step 1: no side")
        quiet(sim)
        quiet(placed(cn.surface(x, [face[::-1] for face in faces], ROCK), small, dim=3))
        quiet(placed(cn.surface(x, faces[1:], ROCK), small, dim=3))
    quiet(placed(cn.surface(corners, faces, ROCK), outside, dim=3))


def test_many_are_told_of_by_their_number():
    grid = 0.1 * np.stack(np.meshgrid(*[np.arange(1, 10)] * 2), -1).reshape(-1, 2) + 0.003
    sim = placed(touching(body("quad", 1, 1.0, (0.0, 0.0)), "outer"), cn.disks(grid, 0.02, ROCK))
    told(sim, "which lies wholly within .*, as 80 more do: no side is near")


def test_a_mesh_of_two_parts_is_looked_at_part_by_part():
    one, other = body("quad", 2, 0.2, (0.35, 0.35)), body("quad", 2, 0.2, (3.0, 0.3))
    points = np.concatenate([one.points, other.points])
    cells = {"quad": np.concatenate([one.cells["quad"], other.cells["quad"] + len(one.points)])}
    both = cn.ElasticBody(points, cells, young=1e8, poisson=0.3, density=1000.0, groups={"all": np.arange(len(points))})
    told(placed(touching(body("quad", 4, 1.0, (0.0, 0.0)), "outer"), touching(both, "parts")), "'parts', which lies wholly")
    quiet(placed(touching(body("quad", 4, 1.0, (1.5, 0.0)), "outer"), touching(both, "parts")))


def test_what_nothing_acts_between_is_not_told_of():
    quiet(nested("quad", law=False))
    sets = [touching(body("quad", 4, 1.0, (0.0, 0.0)), "outer"), touching(body("quad", 2, 0.2, (0.35, 0.35)), "inner", OTHER)]
    quiet(placed(*sets, between=(ROCK, ROCK)))
    told(placed(*sets, between=(ROCK, OTHER)), "wholly within")


def test_sides_of_a_part_of_a_mesh_are_closed_by_its_cells():
    """The outer block touches with its upper side alone."""
    outer = body("quad", 4, 1.0, (0.0, 0.0))
    outer.groups["top"] = np.flatnonzero(outer.points[:, 1] == 1.0)
    sets = [cn.deformable(outer, ROCK, edges="top", name="outer"), touching(body("quad", 2, 0.2, (0.35, 0.35)), "inner")]
    told(placed(*sets), "wholly within the mesh 'outer'")


def test_matrices_have_their_sides_alone():
    made = body("quad", 4, 1.0, (0.0, 0.0))
    small = touching(body("quad", 2, 0.2, (0.35, 0.35)), "inner")
    for edges, seen in ((made.boundary_edges(), True), (made.boundary_edges()[1:], False)):
        outer = cn.LinearBody(made.points, made.M, made.K)
        sim = placed(cn.deformable(outer, ROCK, contact=np.arange(len(made.points)), edges=edges, name="outer"), small)
        told(sim, "wholly within the mesh 'outer'") if seen else quiet(sim)


def test_a_mesh_that_comes_in_later_is_told_of_then():
    """A disk within a mesh is told of where it comes in, and again no more."""
    sim = placed(touching(body("quad", 1, 1.0, (0.0, 0.0)), "outer"), cn.disks([[2.0, 0.5]], 0.05, ROCK))
    quiet(sim, 3)
    sim.add(cn.disks([[0.4, 0.6]], 0.05, ROCK))
    told(sim, "body .* wholly within the mesh 'outer' at the begin of step 4")
    quiet(sim)


def test_a_step_is_as_it_would_be_without():
    """Bits of a scene with something within a mesh are those of one whose mesh has no boundary that is known."""
    made, ways = body("quad", 4, 1.0, (0.0, 0.0)), []
    for edges in (made.boundary_edges(), made.boundary_edges()[1:]):
        outer = cn.LinearBody(made.points, made.M, made.K)
        sets = [cn.deformable(outer, ROCK, contact=[0], edges=edges, name="outer", velocity=(0.3, 0.1))]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            sim = placed(*sets, touching(body("quad", 2, 0.2, (0.35, 0.35)), "inner"))
            for _ in range(3):
                sim.step()
        ways.append(sim.nodes.position.copy())
    assert np.array_equal(*ways)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("solid", [False, True])
@pytest.mark.parametrize("scale, origin", [(1.0, 0.0), (1e-6, 0.0), (1.0, 1e6)])
def test_meshes_that_reach_into_each_other_are_told(kind, solid, scale, origin):
    dim = dim_of(kind)

    def pair(shift):
        two = [body(kind, 4, scale, np.full(dim, origin) + scale * np.array(of), 0.0, solid) for of in ((0.0,) * dim, shift)]
        return placed(touching(two[0], "one"), touching(two[1], "two"), dim=dim)

    told(pair((0.3, 0.4, 0.2)[:dim]), "reaches into the mesh '(one|two)' by over an eighth of a cell at the begin of step 1")
    told(pair((0.03, 0.9, 0.0)[:dim]), "reaches into")
    for shift in ((0.0, 1.0, 0.0), (0.25, 0.99, 0.1), (1.0, 1.0, 1.0)):  # they touch, or overlap by a twentieth of a cell
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert "mesh_within" not in pair(shift[:dim]).step()


def test_meshes_without_a_law_may_reach_into_each_other():
    two = [body("quad", 4, 1.0, np.array(of)) for of in ((0.0, 0.0), (0.3, 0.4))]
    assert "mesh_within" not in placed(touching(two[0], "one"), touching(two[1], "two"), law=False).step()
