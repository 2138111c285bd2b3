"""Pressure that follows bodies whose forces another code finds, or whose matrices it gave, beside those of Cairn's own cells."""

import cairn as cn
import numpy as np
import pytest
from scipy import sparse
from second_order import box
from test_callbacks import by_python, full

ROCK = cn.Material("rock", density=2500.0)
CASES = {
    "plane": ("quad", {"thickness": 0.3}),
    "round an axis": ("triangle", {"plane": "axisymmetric"}),
    "hexahedra": ("hexahedron", {}),
    "tetrahedra": ("tetra", {}),
}


def block(kind, size=1.0, origin=0.0, **options):
    dim = 3 if kind in ("hexahedron", "tetra") else 2
    points, cells = box(kind, (3, 2, 2)[:dim], (size, 0.75 * size, 0.75 * size)[:dim])
    points[:, 0] += 0.2 * size
    points += origin
    body = cn.SolidBody(points, cells, cn.NeoHookean(young=2e4, poisson=0.3), density=1000.0, **options)
    low, high = points.min(axis=0), points.max(axis=0)
    body.groups.update(all=np.arange(len(points)), foot=np.flatnonzero(points[:, 1] < low[1] + 0.01 * size),
                       top=np.flatnonzero(points[:, 1] > high[1] - 0.01 * size),
                       side=np.flatnonzero(points[:, 0] > high[0] - 0.01 * size))  # fmt: skip
    return body


def pressed(body, pressure, dt=0.02, steps=12, tol=1e-12, **options):
    dim = body.dim
    scene = cn.Scene(dim=dim)
    scene.add(cn.deformable(body, ROCK, pressure=pressure, fixed={"foot": "xyz"[:dim]}, **options))
    sim = cn.Simulation(scene, dt=dt, strategy=cn.NSCD(theta=1.0, newton_tol=tol))
    way, passes = [], []
    for _ in range(steps):
        report = sim.step()
        assert report["status"] == "converged"
        way.append(sim.meshes[0].displacement)
        passes.append(report["newton_passes"])
    return np.array(way), passes, sim


@pytest.mark.parametrize("case", CASES)
def test_pressure_follows_a_called_body_as_it_follows_cells(case):
    """Two sets of sides, one under a pressure that changes with time, up to a third of Young's modulus."""
    kind, options = CASES[case]
    solid = block(kind, **options)
    loads = {"top": lambda t: 6e3 * np.sin(6 * t), "side": 2e3}
    ways = [pressed(body, loads) for body in (solid, by_python(solid, **options))]
    (one, passes, sim), (two, others, called) = ways
    size = np.abs(one).max()
    assert size > 0.05 and np.abs(one - two).max() < 1e-9 * size
    assert passes == others  # one tangent
    terms = [s.info["energy"] for s in (sim, called)]
    for name, value in terms[0].items():
        assert value == pytest.approx(terms[1][name], rel=1e-7, abs=1e-8 * terms[0]["in_play"]), name


def test_the_tangent_knows_the_pressure_where_forces_couple_no_neighbours():
    """Points on springs to the ground of their own, with a closed skin between them: its pattern holds what the pressure couples,
    and Newton's method ends in as many passes as its square says."""
    turn = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    points = np.column_stack([np.cos(turn), np.sin(turn)])
    springs = sparse.diags_array(np.full(24, 1e3)).tocsc()
    ring = np.stack([np.arange(12), (np.arange(12) + 1) % 12], -1)
    body = cn.CallbackBody(points, np.full(12, 1e-3), lambda at: (springs @ at.displacement.ravel(), springs),
                           edges=ring, groups={"all": np.arange(12)})  # fmt: skip
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(body, ROCK, pressure={"all": 500.0}))
    sim = cn.Simulation(scene, dt=1.0, strategy=cn.NSCD(theta=1.0, newton_tol=1e-12))
    passes = [sim.step()["newton_passes"] for _ in range(3)]
    # of a polygon with corners at radius r a corner is pushed out by p 2 sin(a/2) r cos(a/2)
    push = 500.0 * np.sin(2 * np.pi / 12)
    inwards = sim.meshes[0].displacement
    radius = np.hypot(*(points + inwards).T)
    assert radius == pytest.approx(1 / (1 + push / 1e3), rel=1e-5)
    assert max(passes) <= 3


def test_pressure_on_a_linear_body_of_given_matrices():
    points, cells = box("quad", (3, 2), (1.0, 0.75))
    own = cn.ElasticBody(points, cells, young=2e4, poisson=0.3, density=1000.0)
    own.groups.update(top=np.flatnonzero(points[:, 1] > 0.74), foot=np.flatnonzero(points[:, 1] < 0.01))
    given = cn.LinearBody(points, full(own, own.lower[2]), full(own, own.lower[3]), groups=own.groups, edges=own.boundary_edges())
    one, two = (pressed(body, {"top": 200.0})[0] for body in (own, given))
    assert np.abs(one).max() > 1e-3 and np.abs(one - two).max() < 1e-9 * np.abs(one).max()


@pytest.mark.parametrize("size, origin", [(1e-9, 0.0), (1e6, 0.0), (1.0, 1e6)])
def test_sizes_and_places(size, origin):
    solid = block("quad", size, origin)
    loads = {"top": 3e3}
    options = {"dt": 0.02 * size, "steps": 6, "tol": 1e-9}
    one, two = (pressed(body, loads, **options)[0] for body in (solid, by_python(solid)))
    assert np.abs(one).max() > 0.01 * size and np.abs(one - two).max() < 1e-7 * np.abs(one).max()


def test_what_cannot_be_pressed_is_told():
    solid = block("quad")
    unknown = by_python(solid, edges=None)
    with pytest.raises(ValueError, match=r"the edges of this body are not known: give edges=\(m, 2\) to CallbackBody"):
        cn.deformable(unknown, ROCK, pressure={"top": 1.0})
    with pytest.raises(ValueError, match="pressure on 'one': no edge of the boundary has all its nodes in it"):
        cn.deformable(by_python(solid, groups={"one": [0]}), ROCK, pressure={"one": 1.0})
    mass = full(solid, solid.lower[2])
    given = {"points": solid.points, "mass": mass, "stiffness": mass}
    for edges, told in (
        ([[0, 99]], r"edges\[0, 1\] is 99: give numbers of the 12 nodes, from 0"),
        ([[0, 1], [-1, 2]], r"edges\[1, 0\] is -1"),
        ([[0, 1.5]], r"edges\[0, 1\] is 1.5"),
        ([[0, np.nan]], r"edges\[0, 1\] is nan"),
        ([[0, 1, 2]], r"edges have shape \(1, 3\): give nodes \(m, 2\)"),
    ):
        with pytest.raises(ValueError, match=told):
            by_python(solid, edges=edges)
        with pytest.raises(ValueError, match=told):
            cn.LinearBody(**given, edges=edges)
    with pytest.raises(ValueError, match=r"faces\[0, 3\] is -2"):
        cn.LinearBody(**given, faces=[[0, 1, 2, -2]])
    for wrong in (0.0, -1.0, np.nan):
        with pytest.raises(ValueError, match="thickness"):
            by_python(solid, thickness=wrong)
    with pytest.raises(ValueError, match="plane is 'flat': give 'strain', 'stress' or 'axisymmetric'"):
        by_python(solid, plane="flat")
    with pytest.raises(ValueError, match="pressure is nan"):
        pressed(by_python(solid), {"top": np.nan}, steps=1)
