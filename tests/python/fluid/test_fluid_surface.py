"""The free surface of a liquid: the volume that it takes, and surface tension."""

import warnings

import cairn as cn
import numpy as np
import pytest

rock = cn.Material("rock", density=2600.0)
SIGMA, RHO = 1.0, 1000.0


def lattice(n, dim, at=1.0):
    """Places of n cells along each axis of a block whose sides are 1 m, about the origin, times `at`."""
    x = (np.arange(n) + 0.5) / n - 0.5
    return at * np.stack([a.ravel() for a in np.meshgrid(*[x] * dim, indexing="ij")], axis=1)


@pytest.mark.parametrize("dim, incompressible, smoothing", [(2, False, 1.5), (2, True, 1.5), (3, False, 1.3), (2, False, 2.0)])
def test_the_volume_is_that_of_the_mass_of_a_lattice(dim, incompressible, smoothing):
    scene = cn.Scene(dim=dim, gravity=(*(0.0,) * (dim - 1), -9.81))
    scene.add(cn.wall((0.0,) * dim, np.eye(dim)[-1], rock))
    for way in np.eye(dim)[:-1]:
        scene.add(cn.wall(0 * way, way, rock), cn.wall(way, -way, rock))
    dx = 0.05 if dim == 2 else 0.1
    scene.add(cn.fluid([(0.0,) * dim, (*(1.0,) * (dim - 1), 0.6)], dx, smoothing=smoothing, incompressible=incompressible))
    sim = cn.Simulation(scene, dt=1e-3)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        report = sim.step()
    assert abs(sim.fluid.info["volume"] - 1) < 0.04
    assert report["fluid_volume"] == sim.fluid.info["volume"]


@pytest.mark.parametrize("incompressible", [False, True])
def test_particles_that_lie_apart_are_told(incompressible):
    scene = cn.Scene(dim=2)
    scene.add(cn.fluid(lattice(20, 2, 1.1), 0.05, pressure=0.0, sound_speed=None if incompressible else 10.0,
                       incompressible=incompressible))  # fmt: skip
    sim = cn.Simulation(scene, dt=1e-3)
    with pytest.warns(UserWarning, match="the liquid takes 1[12].* of the volume of its mass after step 1"):
        sim.step()
    assert abs(sim.fluid.info["volume"] / 1.21 - 1) < 0.05
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sim.step()  # once in a run


def in_drop(sim, radius):
    """Mean pressure within 0.7 radii of the middle of mass."""
    way = sim.fluid.position - np.mean(sim.fluid.position, axis=0)
    return np.mean(sim.fluid.pressure[np.linalg.norm(way, axis=1) < 0.7 * radius])


@pytest.mark.parametrize("dim, n", [(2, 20), (3, 10)])
def test_a_square_becomes_a_drop_with_the_pressure_of_laplace(dim, n):
    scene = cn.Scene(dim=dim)
    scene.add(cn.fluid(lattice(n, dim), 1.0 / n, RHO, 4.0, pressure=0.0, surface_tension=SIGMA))
    radius = np.pi**-0.5 if dim == 2 else (0.75 / np.pi) ** (1 / 3)
    time = np.sqrt(RHO * radius**3 / SIGMA)
    sim = cn.Simulation(scene, dt=time / 100)
    sim.step()
    square = sim.fluid.energy()["surface"]
    sim.run(steps=400 if dim == 2 else 250, progress=False)
    pressure = []
    for _ in range(60):
        sim.step()
        pressure.append(in_drop(sim, radius))
    coarse = 1.0 / n / radius  # the surface is somewhere between the outer row and half a spacing beyond
    assert abs(np.mean(pressure) * radius / ((dim - 1) * SIGMA) - 1) < 1.3 * coarse
    edge = np.linalg.norm(sim.fluid.position[np.asarray(sim.fluid.open) == 2], axis=1)
    assert np.std(edge) < (0.02 if dim == 2 else 0.05) * radius  # of a square 0.11, of a cube 0.13
    round_ = SIGMA * (2 * np.pi * radius if dim == 2 else 4 * np.pi * radius**2)
    found = sim.fluid.energy()["surface"]
    assert abs(found / round_ - 1) < coarse and square > 1.05 * found
    momentum = np.abs(np.sum(sim.fluid.velocity, axis=0)).max()
    assert momentum < 1e-3 * len(sim.fluid) * np.sqrt(SIGMA / RHO / radius)


def test_a_drop_oscillates_with_the_period_of_rayleigh():
    # w^2 = n (n^2 - 1) sigma / (rho R^3) of a cylinder, n = 2 (Rayleigh 1879)
    rows, high = 10, 0.1
    rings = [(j + 0.5) / rows * 0.5 for j in range(rows)]
    many = [round(2 * np.pi * r * rows / 0.5) for r in rings]
    turn = [2 * np.pi * (np.arange(m) + 0.5 * (j % 2)) / m for j, m in enumerate(many)]
    place = np.concatenate([r * np.stack([np.cos(a), np.sin(a)], axis=1) for r, a in zip(rings, turn)])
    dx = 0.5 / rows
    radius = dx * np.sqrt(len(place) / np.pi)
    scene = cn.Scene(dim=2)
    place = place * [1 + high, 1 / (1 + high)]
    scene.add(cn.fluid(place, dx, RHO, 1.0, pressure=SIGMA / radius, surface_tension=SIGMA))
    period = 2 * np.pi / np.sqrt(6 * SIGMA / (RHO * radius**3))
    sim = cn.Simulation(scene, dt=period / 100)
    long = []
    for _ in range(220):
        sim.step()
        square = np.mean(np.square(sim.fluid.position), axis=0)
        long.append((square[0] - square[1]) / square.sum())
    long = np.array(long)
    turns = np.flatnonzero((long[:-1] > 0) != (long[1:] > 0))
    at = turns + long[turns] / (long[turns] - long[turns + 1])
    assert len(at) >= 4 and abs(2 * np.mean(np.diff(at)) / 100 - 1) < 0.02
    assert 0.5 * high < np.abs(long[150:]).max() < 2 * high


def test_tension_costs_nothing_where_there_is_none():
    def end(**options):
        scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
        scene.add(cn.wall((0, 0), (0, 1), rock), cn.fluid([(0, 0), (0.5, 0.5)], 0.05, sound_speed=30.0, **options))
        sim = cn.Simulation(scene, dt=2e-3)
        sim.run(steps=10, progress=False)
        return np.array(sim.fluid.position), sim.fluid.info["surface_energy"]

    (plain, none), (given, zero), (wet, some) = end(), end(surface_tension=0.0), end(surface_tension=0.07, viscosity=1.0)
    assert np.array_equal(plain, given) and none == zero == 0.0 and some > 0 and not np.array_equal(plain, wet)


def test_wrong_tensions_are_told():
    box = [(0, 0), (1, 1)]
    with pytest.raises(ValueError, match="surface_tension is -1"):
        cn.fluid(box, 0.1, surface_tension=-1.0)
    with pytest.raises(ValueError, match="leave out incompressible, or it"):
        cn.fluid(box, 0.1, surface_tension=1.0, incompressible=True)
    scene = cn.Scene(dim=2)
    scene.add(cn.fluid(box, 0.1, surface_tension=1.0), cn.disks([[0.5, 0.5]], 0.02, rock))
    scene.interact("fluid", rock, cn.GrainDrag())
    with pytest.raises(ValueError, match="leave out surface_tension, or GrainDrag"):
        cn.Simulation(scene, dt=1e-3)
    scene.interact("fluid", rock, None)
    with pytest.warns(UserWarning, match="give viscosity=1, or artificial=0.1"):
        cn.Simulation(scene, dt=1e-3)


def test_an_incompressible_column_that_fell_has_its_volume_again():
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.wall((0, 0), (0, 1), rock), cn.wall((0, 0), (1, 0), rock), cn.wall((1, 0), (-1, 0), rock))
    scene.add(cn.fluid([(0, 0), (0.5, 1.0)], 0.05, incompressible=True))
    scene.interact("fluid", rock, cn.FreeSlip())
    sim = cn.Simulation(scene, dt=4e-3)
    sim.run(steps=1000, progress=False)
    x, y = np.array(sim.fluid.position).T
    level = np.mean([np.sort(y[(x > a) & (x <= a + 0.1)])[-2:].mean() for a in np.arange(0, 1, 0.1)]) + 0.025
    assert abs(level / 0.5 - 1) < 0.08 and abs(sim.fluid.info["volume"] - 1) < 0.04


def test_bodies_are_not_put_into_the_liquid():
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.wall((0, 0), (0, 1), rock), cn.wall((0, 0), (1, 0), rock), cn.wall((1, 0), (-1, 0), rock))
    ids = scene.add(cn.disks([[0.5, 0.9], [0.2, 1.2]], 0.15, rock))
    scene.add(cn.fluid([(0, 0), (1, 0.6)], 0.05))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, dt=1e-3)
    sim.step()
    place = sim.bodies.position.copy()
    row = int(np.flatnonzero(sim.bodies.id == ids[0])[0])
    place[row] = (0.5, 0.3)
    before = np.array(sim.bodies.position)
    with pytest.raises(ValueError, match=f"particles of the liquid lie in body {ids[0]} where it is put"):
        sim.bodies.set(position=place)
    assert np.array_equal(sim.bodies.position, before)
    place[row] = (0.6, 1.0)
    sim.bodies.set(position=place)
    sim.step()
    scene.interact("fluid", rock, None)
    other = cn.Simulation(scene, dt=1e-3)
    place[row] = (0.5, 0.3)
    other.bodies.set(position=place)  # the liquid flows through it


@pytest.mark.parametrize("radius", [0.055, 0.06, 0.065, 0.08])
def test_small_bodies_are_not_added_or_put_into_the_liquid(radius):
    scene, log = cn.Scene(dim=2, gravity=(0.0, -9.81)), cn.Material("log", density=500.0)
    scene.add(cn.wall((0, 0), (0, 1), rock), cn.wall((0, 0), (1, 0), rock), cn.wall((1, 0), (-1, 0), rock))
    ids = scene.add(cn.disks([[0.5, 0.8]], radius, log))
    scene.add(cn.fluid([(0, 0), (1, 0.4)], 0.05, 1000.0))
    sim = cn.Simulation(scene, dt=1e-3)
    sim.step()
    for place in ((0.5, 0.2), (0.525, 0.2), (0.51, 0.215)):
        with pytest.raises(ValueError, match="particles of the liquid lie in the bodies that are added"):
            sim.add(cn.disks([place], radius, log))
        with pytest.raises(ValueError, match="particles of the liquid lie in body .* where it is put"):
            sim.bodies.set(position=np.where((sim.bodies.id == ids[0])[:, None], place, sim.bodies.position))
    sim.add(cn.disks([[0.3, 0.4 + radius]], radius, log))  # on the surface
    sim.step()


def test_fixed_bodies_that_touch_leave_no_gap_in_the_liquid():
    for fixed in (True, False):
        scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
        for a, b, c, d in ((-0.2, -0.2, 1.2, 0), (-0.2, 0, 0, 1), (1, 0, 1.2, 1)):
            scene.add(cn.polygons([(a, b), (c, b), (c, d), (a, d)], rock, fixed=fixed or b < 0))
        scene.add(cn.fluid([(0, 0), (1, 0.5)], 0.05, 1000.0))
        scene.interact("*", "*", cn.Coulomb(mu=0.4))
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            cn.Simulation(scene, dt=4e-3)
        assert any("leave gaps" in str(w.message) for w in told) == (not fixed)


def test_grains_are_not_put_into_the_liquid():
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    sand = cn.Material("sand", density=2600.0)
    scene.add(cn.wall((0, 0), (0, 1), rock), cn.disks([[0.5, 1.0]], 0.02, sand), cn.fluid([(0, 0), (1, 0.6)], 0.05))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    scene.interact("fluid", sand, cn.GrainDrag())
    sim = cn.Simulation(scene, dt=1e-3)
    place = sim.bodies.position.copy()
    place[-1] = (0.5, 0.3)
    with pytest.raises(ValueError, match="would compress it"):
        sim.bodies.set(position=place)


def test_a_block_that_sinks_to_the_bed_is_told():
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.wall((0, 0), (0, 1), rock), cn.wall((0, 0), (1, 0), rock), cn.wall((1.2, 0), (-1, 0), rock))
    square = 0.15 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    scene.add(cn.polygons(square, rock, position=[[0.6, 0.25]]), cn.fluid([(0, 0), (1.2, 0.6)], 0.05))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sim = cn.Simulation(scene, dt=4e-3)
        sim.step()
    with pytest.warns(UserWarning, match="step .*: 1 pairs of bodies in the liquid leave gaps"):
        sim.run(steps=160, progress=False)


def test_a_light_bed_of_grains_is_told():
    def start(deep, **options):
        scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
        sand = cn.Material("sand", density=2600.0)
        at = np.stack([a.ravel() for a in np.meshgrid(np.arange(0.02, 0.6, 0.04), np.arange(0.02, 0.2, 0.04))], axis=1)
        scene.add(cn.wall((0, 0), (0, 1), rock), cn.wall((0, 0), (1, 0), rock), cn.wall((0.6, 0), (-1, 0), rock))
        scene.add(cn.disks(at, 0.017, sand, **options), cn.fluid([(0, 0), (0.6, deep)], 0.05, smoothing=2))
        scene.interact("*", "*", cn.Coulomb(mu=0.3))
        scene.interact("fluid", sand, cn.GrainDrag())
        cn.Simulation(scene, dt=1e-3)

    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", ".*pairs of bodies")
        warnings.filterwarnings("error", "a bed of free grains")
        start(0.3)
        start(2.0, driven=("vx", "vy", "w"))
        with pytest.raises(UserWarning, match="0.4 of that by Ergun's law"):
            start(2.0)
