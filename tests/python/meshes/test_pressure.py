"""Pressure that follows the surface: its resultant, an inflated tube, its work, refusals."""

import cairn as cn
import numpy as np
import pytest
from cairn.model.pressure import forces, pressed_sides
from second_order import CELLS, box

SOLID = CELLS[3]


def tube(kind, around, across, inner=1.0, outer=1.5, turn=0.5 * np.pi):
    """Points, cells, groups of a part of a ring in 2D, from the axis y = 0 on."""

    def place(x):
        radius, angle = inner + (outer - inner) * x[:, 1], turn * (1 - x[:, 0])
        return np.stack([radius * np.cos(angle), radius * np.sin(angle)], 1)

    points, cells = box(kind, (around, across), (1.0, 1.0), place)
    radius = np.hypot(*points.T)
    groups = {"inside": np.flatnonzero(radius < inner * (1 + 1e-3)), "outside": np.flatnonzero(radius > outer * (1 - 1e-3))}
    groups |= {"x": np.flatnonzero(np.abs(points[:, 0]) < 1e-9), "y": np.flatnonzero(np.abs(points[:, 1]) < 1e-9)}
    return points, cells, groups


@pytest.mark.parametrize("kind", ["triangle", "quad", "triangle6", "quad8", "quad9", *SOLID])
def test_forces_on_a_closed_surface_have_no_sum_and_work_as_the_volume_changes(kind):
    dim = 3 if kind in SOLID else 2
    rng = np.random.default_rng(3)
    points, cells = box(kind, (2,) * dim, (1.0,) * dim)
    body = cn.ElasticBody(points, cells, young=1.0, poisson=0.3, density=1.0, thickness=0.7 if dim == 2 else 1.0)
    sides = pressed_sides(body, np.arange(len(points)), "all")
    x = points + 0.02 * rng.standard_normal(points.shape)
    force = forces(body, sides, x)
    assert np.abs(force.sum(axis=0)).max() < 1e-14
    turning = x[:, 0] * force[:, 1] - x[:, 1] * force[:, 0]
    assert abs(turning.sum()) < 1e-14

    def volume(x):  # of all cells: the forces are its gradient
        found = cn.ElasticBody(x, cells, young=1.0, poisson=0.3, density=1.0, thickness=body.thickness)
        return found.nodal_mass().sum()

    way = rng.standard_normal(points.shape)
    step = 3e-6
    change = (volume(x + step * way) - volume(x - step * way)) / (2 * step)
    assert (force * way).sum() == pytest.approx(-change, rel=1e-8)


@pytest.mark.parametrize("kind, cells", [("quad", 6), ("quad9", 3)])
def test_a_rubber_tube_is_blown_up(kind, cells):
    """A thick tube that nearly keeps its volume: p = mu (ln(a/b) + (b^-2 - a^-2)/2), a and b the stretches inside and outside."""
    points, kinds, groups = tube(kind, 2 * cells, cells)
    mu = 1e5
    rubber = cn.NeoHookean(young=2 * mu * 1.4995, poisson=0.4995)
    body = cn.SolidBody(points, kinds, rubber, density=1.0, groups=groups, mean_dilatation=True)
    inside = 1.2
    a, b = inside, np.sqrt(1.5**2 + inside**2 - 1) / 1.5
    pressure = mu * (np.log(a / b) + (b**-2 - a**-2) / 2)
    skin = cn.Material("skin", density=1.0)
    scene = cn.Scene(dim=2)
    blown = cn.Table([0.0, 0.5, 10.0], [0.0, pressure, pressure])
    scene.add(cn.deformable(body, skin, pressure={"inside": blown}, fixed={"x": "x", "y": "y"}))
    sim = cn.Simulation(scene, dt=0.01, strategy=cn.NSCD(theta=1.0))
    for _ in range(120):
        assert sim.step()["status"] == "converged"
    x = points + sim.meshes[0].displacement
    reached = np.hypot(*x[groups["inside"]].T)
    print(kind, reached.mean(), np.ptp(reached))
    assert reached.mean() == pytest.approx(inside, rel=2e-3) and np.ptp(reached) < 1e-3


def area_of(points):
    x, y = points.T
    return (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2


def test_the_work_is_pressure_times_volume():
    """A free ring under a constant pressure inside: it does not move as a whole, and its energy is p dV, whose trapezoid is exact
    of an area."""
    wrong = []
    for n in (1, 2):
        points, kinds, groups = tube("quad", 16, 1, turn=2 * np.pi)
        merged = {}
        number = np.array([merged.setdefault(tuple(np.round(p, 9) + 0.0), len(merged)) for p in points])
        first = np.unique(number, return_index=True)[1]
        rubber = cn.NeoHookean(young=1e5, poisson=0.3)
        body = cn.SolidBody(
            points[first], {"quad": number[kinds["quad"]]}, rubber, density=1000.0,
            groups={name: np.unique(number[nodes]) for name, nodes in groups.items()},
        )  # fmt: skip
        skin = cn.Material("skin", density=1.0)
        scene = cn.Scene(dim=2)
        scene.add(cn.deformable(body, skin, pressure={"inside": 1e4}))
        strategy = cn.NSCD(integrator=cn.DiscreteGradient(), newton_tol=1e-11)
        sim = cn.Simulation(scene, dt=4e-3 / n, strategy=strategy)
        inside = np.argsort(np.arctan2(*body.points[body.groups["inside"]].T[::-1]))
        inside = body.groups["inside"][inside]

        start = area_of(body.points[inside])
        for _ in range(25 * n):
            sim.step()
        terms = sim.info["energy"]
        grown = area_of((body.points + sim.meshes[0].displacement)[inside]) - start
        wrong.append(abs(terms["kinetic"] + terms["stored"] - 1e4 * grown))
        mean = body.M @ sim.meshes[0].velocity.ravel()
        assert np.abs(mean.reshape(-1, 2).sum(axis=0)).max() < 1e-9 * np.abs(mean).sum()
    assert max(wrong) < 1e-9 * 1e4 * grown and terms["kinetic"] > 0.01 * 1e4 * grown


def soft_ring(dt, pressure, steps, theta=1.0, cells=(32, 1), inner=1.0, outer=1.02):
    """A thin ring of rubber under a pressure inside that stands at once; its mean radius inside after so many steps."""
    points, kinds, groups = tube("quad", *cells, inner, outer)
    body = cn.SolidBody(points, kinds, cn.NeoHookean(young=1e5, poisson=0.3), density=1000.0, groups=groups)
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(body, cn.Material("skin", density=1.0), pressure={"inside": pressure}, fixed={"x": "x", "y": "y"}))
    sim = cn.Simulation(scene, dt=dt, strategy=cn.NSCD(theta=theta, newton_tol=1e-10))
    passes = [sim.step()["newton_passes"] for _ in range(steps)]
    assert sim.info["status"] == "converged"
    x = points + sim.meshes[0].displacement
    return np.hypot(*x[groups["inside"]].T).mean(), max(passes), sim


def test_pressure_is_part_of_newtons_method():
    """A soft ring in steps of a hundred times what its waves take round it comes to rest where short steps bring it, in few
    passes: the tangent knows what the pressure changes."""
    short, _, _ = soft_ring(0.5, 300.0, 60)
    long_, passes, sim = soft_ring(20.0, 300.0, 6)
    assert long_ == pytest.approx(short, rel=1e-5) and short > 1.1
    assert passes <= 7
    assert abs(sim.info["energy"]["closure"]) < 1e-8 * sim.info["energy"]["in_play"]


@pytest.mark.parametrize("kind", ["triangle", "quad9", *SOLID])
def test_a_closed_surface_under_pressure_is_at_rest_as_a_whole(kind):
    """Any body under uniform pressure all round, in a long step: it shrinks evenly by p (1 - 2 nu) / E, in three passes."""
    dim = 3 if kind in SOLID else 2
    points, cells = box(kind, (2,) * dim, (1.0,) * dim)
    law = cn.SaintVenantKirchhoff(young=1e5, poisson=0.3)
    body = cn.SolidBody(points, cells, law, density=1.0, groups={"all": np.arange(len(points))})
    scene = cn.Scene(dim=dim)
    scene.add(cn.deformable(body, cn.Material("skin", density=1.0), pressure={"all": 10.0}))
    sim = cn.Simulation(scene, dt=1.0, strategy=cn.NSCD(theta=1.0, newton_tol=1e-9))
    for _ in range(5):
        report = sim.step()
    assert report["status"] == "converged" and report["newton_passes"] <= 4
    shrunk = (np.ptp(points + sim.meshes[0].displacement, axis=0) - 1) * -1
    lateral = (1 - 2 * 0.3) if dim == 3 else (1 + 0.3) * (1 - 2 * 0.3)
    assert shrunk == pytest.approx(10.0 / 1e5 * lateral, rel=1e-3)
    assert np.abs((body.M @ sim.meshes[0].velocity.ravel()).reshape(-1, dim).sum(axis=0)).max() < 1e-9


def test_what_cannot_be_pressed_is_told():
    skin = cn.Material("skin", density=1.0)
    points, kinds, groups = tube("quad", 2, 2)
    body = cn.ElasticBody(points, kinds, young=1.0, poisson=0.3, density=1.0, groups=groups | {"one": [0]})
    with pytest.raises(ValueError, match="pressure on 'one': no edge of the boundary has all its nodes in it"):
        cn.deformable(body, skin, pressure={"one": 1.0})
    with pytest.raises(ValueError, match="there is no group 'nowhere'"):
        cn.deformable(body, skin, pressure={"nowhere": 1.0})
