"""Heavy rigid bodies on light free elastic bodies, and heavy elastic bodies on light rigid bodies: a sum of energies does not
reveal a light support that is squeezed out, or a load that sinks into it."""

import cairn as cn
import numpy as np
import pytest

G = 9.81


def grid(low, high, cells):
    """Nodes and cells of a box of HEX8 or Q4 between its corners."""
    axes = [np.linspace(a, b, n + 1) for a, b, n in zip(low, high, cells, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, len(cells))
    number = np.arange(len(points)).reshape([n + 1 for n in cells])
    if len(cells) == 2:
        corners = [number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]]
    else:
        a, b = number[:, :, :-1], number[:, :, 1:]
        corners = [x[i, j] for x in (a, b) for i, j in RING]
    return points, np.stack([c.ravel() for c in corners], -1)


LOW, HIGH = slice(None, -1), slice(1, None)
RING = ((LOW, LOW), (HIGH, LOW), (HIGH, HIGH), (LOW, HIGH))


def elastic(low, high, cells, young, density, dt):
    """An elastic block whose nodes below and above may touch, damped within some steps."""
    points, cell = grid(low, high, cells)
    up = len(cells) - 1
    groups = {name: np.flatnonzero(np.isclose(points[:, up], z)) for name, z in (("bottom", low[up]), ("top", high[up]))}
    kind = "hexahedron" if up == 2 else "quad"
    return cn.ElasticBody(points, {kind: cell}, young=young, poisson=0.0, density=density, groups=groups, rayleigh=(0, 2 * dt))


def step_on(sim, steps, tol=1e-4):
    """Largest light error; steps that say they converged are right to it."""
    largest = 0.0
    for _ in range(steps):
        info = sim.step()
        assert info["status"] != "converged" or info["light_error"] <= tol
        largest = max(largest, info["light_error"])
    return largest


@pytest.mark.parametrize("ratio, strain", [(7.85, 1e-4), (7.85, 1e-2), (1e3, 1e-4), (1e5, 1e-2)])
def test_a_plate_rests_on_four_elastic_pads(ratio, strain):
    dt, weight = 1e-3, 1000 * ratio * 0.1 * G
    young = weight / 4 / 0.01 / strain
    soft, stiff = cn.Material("soft", density=1000.0), cn.Material("stiff", density=1000.0 * ratio)
    scene = cn.Scene(3, gravity=(0, 0, -G))
    scene.add(cn.wall((0, 0, 0), (0, 0, 1), soft))
    for x in (-0.4, 0.4):
        for y in (-0.4, 0.4):
            pad = elastic((x - 0.05, y - 0.05, 0), (x + 0.05, y + 0.05, 0.05), (2, 2, 1), young, 1000.0, dt)
            scene.add(cn.deformable(pad, soft, contact=["bottom", "top"], faces="top"))
    scene.add(cn.boxes([[0, 0, 0.1]], [[1.0, 1.0, 0.1]], stiff))
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    sim = cn.Simulation(scene, dt, cn.NSCD(theta=1.0))
    assert step_on(sim, 200) > 0  # it is measured
    sag = 0.05 * strain
    x = sim.bodies.position[-1]
    assert (0.1 - x[2]) / sag == pytest.approx(1, abs=0.015)
    assert np.hypot(x[0], x[1]) < 0.01 * sag


@pytest.mark.parametrize("mu", [0.0, 0.4])
@pytest.mark.parametrize("ratio", [1e2, 1e3])
def test_an_elastic_block_bears_a_heavy_one(ratio, mu):
    dt, weight = 1e-3, 1000.0 * ratio * G * 0.04
    soft, stiff = cn.Material("soft", density=1000.0), cn.Material("stiff", density=1000.0 * ratio)
    scene = cn.Scene(2, gravity=(0, -G))
    block = elastic((0, 0), (0.2, 0.2), (4, 4), 1e4 * weight, 1000.0, dt)
    scene.add(cn.deformable(block, soft, contact=["bottom", "top"], edges="top"))
    scene.add(cn.wall((0, 0), (0, 1), soft))
    scene.add(cn.polygons([np.array([[0, 0.2], [0.2, 0.2], [0.2, 0.4], [0, 0.4]])], stiff))
    scene.interact("*", "*", cn.Coulomb(mu=mu))
    sim = cn.Simulation(scene, dt, cn.NSCD(theta=1.0))
    step_on(sim, 200)
    x = sim.bodies.position[-1]
    assert (0.3 - x[1]) / 1e-4 == pytest.approx(1 + 0.5 / ratio, abs=2e-3)
    assert abs(x[0] - 0.1) < 1e-3 * 1e-4


@pytest.mark.parametrize("ratio", [1e1, 1e4, 1e6])
def test_light_disks_bear_a_heavy_elastic_block(ratio):
    dt, weight = 1e-3, 1000 * ratio * 0.03 * G
    light, heavy = cn.Material("light", density=1000.0), cn.Material("heavy", density=1000.0 * ratio)
    scene = cn.Scene(2, gravity=(0, -G))
    scene.add(cn.wall((0, 0), (0, 1), light))
    scene.add(cn.disks([[0.05, 0.02], [0.15, 0.02], [0.25, 0.02]], 0.02, light))
    block = elastic((0, 0.04), (0.3, 0.14), (6, 2), 1e3 * weight, 1000.0 * ratio, dt)
    scene.add(cn.deformable(block, heavy, contact="bottom", edges="bottom"))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, dt)
    assert type(sim.strategy.solver).__name__ == ("Auto" if ratio > 1e2 else "NLGS")
    step_on(sim, 200)
    impulse = sim.contacts.impulse[sim.contacts.point[:, 1] < 0.005, 1]
    assert abs(impulse.sum()) / dt == pytest.approx(weight, rel=0.02)
    assert np.abs(sim.bodies.position[-3:, 1] - 0.02).max() < 1e-4 * 0.02


def test_held_meshes_are_not_heavy():
    """A clamped block weighs on nothing: grains beside it keep the solver of grains."""
    stone = cn.Material("stone", density=1e9)
    scene = cn.Scene(2, gravity=(0, -G))
    block = elastic((0, 0), (1, 1), (2, 2), 1e9, 1e9, 1e-3)
    scene.add(cn.deformable(block, stone, contact="top", edges="top", fixed={"bottom": "xy"}))
    scene.add(cn.disks([[0.5, 1.1]], 0.1, cn.Material("dust", density=1.0)))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 1e-3)
    assert type(sim.strategy.solver).__name__ == "NLGS"
    assert sim.step()["light_error"] == 0
