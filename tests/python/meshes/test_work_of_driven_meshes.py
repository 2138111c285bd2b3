"""Work of prescribed nodes of a mesh counts like that of driven rigid bodies: in work_driven, that of forces alone in
work_external."""

import cairn as cn
import numpy as np
import pytest

STEEL = cn.Material("steel", density=1000.0)


def bar(kind):
    """A bar of four cells, held at one end and drawn at the other."""
    x, y = np.meshgrid(np.linspace(0, 0.4, 5), [0.0, 0.1], indexing="ij")
    n = np.arange(10).reshape(5, 2)
    quads = np.stack([n[:-1, 0], n[1:, 0], n[1:, 1], n[:-1, 1]], -1)
    groups = {"left": n[0], "right": n[-1]}
    points = np.c_[x.ravel(), y.ravel()]
    if kind == "elastic":
        return cn.ElasticBody(points, {"quad": quads}, young=1e7, poisson=0.0, density=1000.0, groups=groups)
    return cn.SolidBody(points, {"quad": quads}, cn.NeoHookean(young=1e7, poisson=0.0), density=1000.0, groups=groups)


@pytest.mark.parametrize("kind", ["elastic", "solid"])
@pytest.mark.parametrize("integrator", [None, cn.Newmark(), cn.HHT()], ids=str)
def test_a_drawn_bar(kind, integrator):
    scene = cn.Scene(2)
    scene.add(cn.deformable(bar(kind), STEEL, fixed={"left": "xy"}, drive={"right": {"x": 0.1}}))
    sim = cn.Simulation(scene, 1e-4, cn.NSCD(integrator=integrator))
    work = 0.0
    for _ in range(200):
        sim.step()
        work += 1e-4 * 0.1 * sim.meshes[0].reaction("right")[0]
    energy = sim.energy
    assert abs(energy["work_external"]) < 1e-9 * energy["work_driven"]
    assert energy["work_driven"] == pytest.approx(work, rel=0.02)
    taken = energy["stored"] + energy["kinetic"] + energy["dissipated_integrator"]
    assert energy["work_driven"] == pytest.approx(taken, rel=1e-9)
    assert abs(energy["closure"]) < 1e-9 * energy["in_play"]


def test_forces_stay_external():
    scene = cn.Scene(2)
    scene.add(cn.deformable(bar("elastic"), STEEL, fixed={"left": "xy"}, force={"right": (1e3, 0.0)}))
    sim = cn.Simulation(scene, 1e-4, cn.NSCD(theta=0.5))
    sim.run(steps=100, progress=False)
    assert abs(sim.energy["work_driven"]) < 1e-12 * sim.energy["work_external"]
