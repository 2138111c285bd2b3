"""Beds of grains smaller than a particle of the liquid on floors and beside walls: at rest, and a column that collapses."""

import cairn as cn
import numpy as np
import pytest

pytestmark = pytest.mark.filterwarnings("ignore:grains take", "ignore:.*pairs of bodies in the liquid")

sand = cn.Material("sand", density=2600.0)
rock = cn.Material("rock", density=2600.0)


def lattice(low, high, n):
    axes = [a + (np.arange(k) + 0.5) * (b - a) / k for a, b, k in zip(low, high, n)]
    return np.stack([x.ravel() for x in np.meshgrid(*axes, indexing="ij")], axis=1)


def walls(dim, wide, kind):
    """Floor and side walls of a tank that is open above, of half-spaces or of blocks."""
    if kind == "half-spaces":
        floor = [cn.wall((0.0,) * dim, np.eye(dim)[-1], rock)]
        for way in np.eye(dim)[:-1]:
            floor += [cn.wall(0 * way, way, rock), cn.wall(wide * way, -way, rock)]
        return floor
    block = lambda x, y: [(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1])]  # noqa: E731
    outlines = block((0, wide), (-0.2, 0)), block((-0.2, 0), (-0.2, 0.8)), block((wide, wide + 0.2), (-0.2, 0.8))
    return [cn.polygons(np.subtract(o, np.mean(o, axis=0)), rock, position=[np.mean(o, axis=0)], fixed=True) for o in outlines]


@pytest.mark.parametrize("dim, kind, share, slip, viscosity, rests", [
    (2, "half-spaces", 0.45, cn.FreeSlip(), 0.01, False), (2, "half-spaces", 0.3, cn.NoSlip(), 0.01, False),
    (2, "blocks", 0.3, cn.FreeSlip(), 0.01, False), (2, "half-spaces", 0.78, cn.FreeSlip(), 0.1, True),
    (2, "half-spaces", 0.78, cn.FreeSlip(), 1.0, True), (3, "half-spaces", 0.4, cn.FreeSlip(), 0.01, False)])  # fmt: skip
def test_a_bed_on_the_floor_of_a_tank_stays(dim, kind, share, slip, viscosity, rests):
    dx, wide, deep, bed, g = 0.05, 0.6 if dim == 2 else 0.3, 0.4, 0.28 if dim == 2 else 0.12, 1.0
    many = (*(round(wide / 0.04),) * (dim - 1), round(bed / 0.04))
    space = wide ** (dim - 1) * bed
    volume = share * space / np.prod(many)
    radius = np.sqrt(volume / np.pi) if dim == 2 else (0.75 * volume / np.pi) ** (1 / 3)
    scene = cn.Scene(dim=dim, gravity=(*(0.0,) * (dim - 1), -g))
    scene.add(*walls(dim, wide, kind))
    still = ("vx", "vy", "w") if dim == 2 else ("vx", "vy", "vz", "wx", "wy", "wz")
    at = lattice((0.0,) * dim, (*(wide,) * (dim - 1), bed), many)
    ids = scene.add((cn.disks if dim == 2 else cn.spheres)(at, radius, sand, **({} if rests else {"driven": still})))
    scene.add(cn.fluid([(0.0,) * dim, (*(wide,) * (dim - 1), deep)], dx, viscosity=viscosity))
    scene.interact("*", "*", cn.Coulomb(mu=0.3) if rests else None)
    scene.interact("fluid", rock, slip)
    scene.interact("fluid", sand, cn.GrainDrag())
    sim = cn.Simulation(scene, dt=5e-3)
    wrong, lifts = [], []
    # free grains settle onto their contacts through their own drag, the longer the more viscous: that is an excess pressure
    begin = 300 if rests and viscosity == 1.0 else 100
    for k in range(begin + (140 if dim == 2 else 60)):
        sim.step()
        if k >= begin and k % 10 == 0:
            y = sim.fluid.position[:, -1]
            wrong.append(np.sqrt(np.mean((sim.fluid.pressure / 1000.0 - (deep - y)) ** 2)) / deep)
            lifts.append(sum(sim.fluid.force_on(k)[dim - 1] for k in ids) / (1000.0 * volume * len(ids)))
    assert np.abs(sim.fluid.velocity).max() < 0.03 * np.sqrt(g * deep) and y.min() > 0.4 * dx
    assert np.abs(sim.bodies.velocity[:, :dim]).max() < 0.01 * np.sqrt(g * deep)
    assert np.mean(wrong) < 0.03
    assert abs(np.mean(lifts) - 1) < 0.05  # Archimedes


def column(wet, seed=2):
    """Place of the front over the width of the column 0.3 and 0.6 s after a board before it is taken away."""
    wide, high, r, dx = 0.2, 0.2, 0.011, 0.03
    board = cn.Material("board", density=2600.0)
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(*walls(2, 0.84, "half-spaces"))
    outline = [(-0.01, -0.3), (0.01, -0.3), (0.01, 0.3), (-0.01, 0.3)]
    gate = scene.add(cn.polygons(outline, board, position=[(wide + 0.01, 0.3)], driven=("vx", "vy", "w")))
    rows = [(np.arange(r * (1 + k % 2), wide - r, 2.04 * r), r * (1.02 + 1.77 * k)) for k in range(int(high / r / 1.77))]
    at = np.array([(x, y) for xs, y in rows for x in xs])
    ids = scene.add(cn.disks(at, r * np.random.default_rng(seed).uniform(0.8, 1.0, len(at)), sand))
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    if wet:
        scene.add(cn.fluid([(0, 0), (0.84, 0.3)], dx, 1000.0, 1e-3))
        for which, law in ((rock, cn.FreeSlip()), (board, None), (sand, cn.GrainDrag())):
            scene.interact("fluid", which, law)
    sim = cn.Simulation(scene, dt=4e-3)
    front = []
    for k in range(200):
        if k == 50:
            sim.remove(gate)
        sim.step()
        if k in (124, 199):
            front.append(np.quantile(sim.bodies.position[np.isin(sim.bodies.id, ids), 0], 0.95) / wide)
    if wet:
        inside = sim.fluid.position
        assert inside[:, 1].min() > 0 and inside[:, 0].min() > 0 and inside[:, 0].max() < 0.84
        assert sim.fluid.info["compression"] < 0.02
    return np.array(front)


def test_a_column_collapses_slower_in_water_than_in_air():
    """Fronts of single packs differ by a tenth, at last as much as those in water from those in air: the mean of four counts."""
    dry, wet = (np.mean([column(beside, seed) for seed in (2, 3, 4, 5)], axis=0) for beside in (False, True))
    assert wet[0] < 0.9 * dry[0] and 1.3 < wet[1] < 0.95 * dry[1]
