"""A liquid in programs of Fortran and C ends in the numbers of the same scene in Python; gauges read what is known."""

import cairn as cn
import numpy as np
import pytest
from programs import near, told_by

WOOD = cn.Material("wood", density=500.0)
CENTRE, SPACING = np.array([0.5, 0.4]), 0.05


def basin(body, outside, **options):
    """Scene of a basin of 20 x 8 particles, in which a body floats, and the ids of both."""
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    floor = scene.add(*(cn.wall(p, n, WOOD) for p, n in (((0, 0), (0, 1)), ((0, 0), (1, 0)), ((1, 0), (-1, 0)))))[0]
    body = scene.add(body)[0]
    x, y = ((np.arange(1, n + 1) - 0.5) * SPACING for n in (20, 8))  # as the programs: other last digits grow to 1e-7
    places = np.stack([a.ravel() for a in np.meshgrid(x, y, indexing="ij")], axis=1)
    scene.add(cn.fluid(places[outside(places)], SPACING, **options))
    scene.interact("*", "*", cn.Coulomb(mu=0.4))
    scene.interact("fluid", "*", cn.FreeSlip())
    return scene, floor, body


def test_a_program_in_fortran_floats_a_disk_as_python_does(tmp_path):
    away = lambda x: np.linalg.norm(x - CENTRE, axis=1) > 0.12 + SPACING / 4  # noqa: E731
    scene, floor, disk = basin(cn.disks([CENTRE], 0.12, WOOD), away, viscosity=1e-3)
    sim = cn.Simulation(scene, dt=2e-3, strategy=cn.NSCD(solver=cn.NLGS(tol=1e-4)))
    for _ in range(100):
        sim.step()
    told = told_by("basin", tmp_path)
    near(told["height"], sim.bodies.position[sim.bodies.id == disk][0, 1], 1e-9)
    near(told["disk"], sim.fluid.force_on(disk), 1e-7)
    near(told["floor"], sim.fluid.force_on(floor), 1e-7)
    near(told["pressure"], sim.fluid.pressure_at([(0.1, 0.1)]), 1e-7)
    near(told["level"], sim.fluid.level_at([(0.1, 0.0)]), 1e-7)
    near(told["volume"], sim.fluid.info["volume"], 1e-7)


def test_a_program_in_c_gives_the_points_of_a_block(tmp_path):
    """Points by hand are those of Python's polygons, so that the incompressible form finds the same forces."""
    away = lambda x: np.any(np.abs(x - CENTRE) >= 0.15, axis=1)  # noqa: E731
    square = 0.15 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    scene, floor, block = basin(cn.polygons(square, WOOD, position=[CENTRE]), away, incompressible=True)
    sim = cn.Simulation(scene, dt=4e-3, strategy=cn.NSCD(solver=cn.NLGS(tol=1e-4)))
    for _ in range(100):
        sim.step()
    told = told_by("basin_c", tmp_path)
    near(told["floor"], sim.fluid.force_on(floor), 3e-3)  # the solver ends at 1e-3 of the divergence in each step
    near(told["block"][:2], sim.fluid.force_on(block)[:2], 3e-3)
    near(told["pressure"], sim.fluid.pressure_at([(0.1, 0.1)]), 3e-3)
    near(told["level"], sim.fluid.level_at([(0.1, 0.1)]), 1e-3)


def test_a_program_in_fortran_has_open_ends_as_python_does(tmp_path):
    """Poiseuille's flow; rows of the inflow stand in another order, so that sums round otherwise."""
    dx, buffer = 0.1, 0.4
    parabola = lambda x: np.stack([6 * x[:, 1] * (1 - x[:, 1]), 0 * x[:, 1]], axis=1)  # noqa: E731
    x, y = (np.arange(n) * dx + dx / 2 for n in (20, 10))
    places = np.stack([a.ravel() for a in np.meshgrid(x, y, indexing="ij")], axis=1)
    scene = cn.Scene(dim=2)
    scene.add(cn.wall((0, 0), (0, 1), WOOD), cn.wall((0, 1), (0, -1), WOOD))
    scene.add(cn.fluid(places, dx, 1.0, 0.1, 20.0, velocity=parabola(places), pressure=1.2 * (2.0 - places[:, 0])))
    scene.add(cn.Inflow([(-buffer, 0), (0, 1)], parabola), cn.Outflow([(2, 0), (2 + buffer, 1)], pressure=0.0))
    sim = cn.Simulation(scene, dt=0.02)
    for _ in range(50):
        sim.step()
    told, end = told_by("channel", tmp_path), np.asarray(sim.fluid.end)
    assert [told[name] for name in ("particles", "inflow", "outflow")] == [len(end), np.sum(end > 0), np.sum(end < 0)]
    for name in ("came_in", "left"):
        near(told[name], sim.fluid.info[name], 1e-12)
    assert told["left"] > 0.5
    near(told["pressure"], sim.fluid.pressure_at([(0.5, 0.5), (1.5, 0.5)]), 1e-6)


@pytest.mark.parametrize("origin", [(0.0, 0.0), (3e5, -2e5)])
def test_gauges_read_water_at_rest(origin):
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81), origin=origin)
    walls = ((0, 0), (0, 1)), ((0, 0), (1, 0)), ((1, 0), (-1, 0))
    scene.add(*(cn.wall(np.add(p, origin), n, WOOD) for p, n in walls))
    scene.add(cn.fluid(np.add([(0, 0), (1, 0.5)], origin), 0.05))
    sim = cn.Simulation(scene, dt=2e-3)
    for _ in range(100):
        sim.step()
    places = np.add([(0.5, 0.02), (0.3, 0.25), (0.5, 2.0)], origin)
    found = sim.fluid.pressure_at(places)
    assert found[:2] == pytest.approx([9810 * 0.48, 9810 * 0.25], abs=0.03 * 9810 * 0.5)
    assert found[2] == 0
    level = sim.fluid.level_at(np.add([(0.5, 0.02), (0.3, 2.0), (3.0, 0.0)], origin))
    assert level[:2] - origin[1] == pytest.approx(0.5, abs=0.005)
    assert np.isnan(level[2])
    for wrong in ([(0.0, 0.0, 0.0)], (0.0, 0.0), [(np.nan, 0.0)]):
        with pytest.raises(ValueError, match="places have shape"):
            sim.fluid.pressure_at(wrong)
