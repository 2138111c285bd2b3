"""Springs of joints that are stiffer than numbers hold beside masses: as rigid joints hold, without end."""

import cairn as cn
import numpy as np
import pytest

STEEL = cn.Material("steel", density=2000.0)
KINDS = {
    "hinge": (3, lambda spring: cn.Hinge(point=(0, 0, 0), axis=(0, 1, 0), spring=spring)),
    "pivot": (2, lambda spring: cn.Pivot(point=(0, 0), spring=spring)),
    "slider": (2, lambda spring: cn.Slider(point=(0, 0), axis=(0, 1), spring=spring)),
    "distance": (2, lambda spring: cn.Distance(points=[(0.5, 0), (0.5, 1.0)], spring=spring)),
    "distance in space": (3, lambda spring: cn.Distance(points=[(0.5, 0, 0), (0.5, 0, 1.0)], spring=spring)),
}


def hung(kind, stiffness, **options):
    dim, joint = KINDS[kind]
    scene = cn.Scene(dim, gravity=(*np.zeros(dim - 1), -9.81))
    scene.interact("*", "*", None)
    ball = scene.add((cn.spheres if dim == 3 else cn.disks)([[0.5, *np.zeros(dim - 1)]], 0.1, STEEL, **options))[0]
    scene.join(ball, None, joint(cn.Spring(stiffness)))
    return cn.Simulation(scene, dt=1e-3)


@pytest.mark.parametrize("stiffness", [1e18, 1e21, 1e24, 1e30, 1e60])
@pytest.mark.parametrize("kind", KINDS)
def test_a_stiff_spring_holds_what_hangs_on_it(kind, stiffness):
    sim = hung(kind, stiffness)
    begin = sim.bodies.position.copy()
    for _ in range(300):
        sim.step()
        assert sim.info["status"] == "converged"
    assert np.abs(sim.bodies.velocity).max() < 1e-7 and np.abs(sim.bodies.position - begin).max() < 1e-9


@pytest.mark.parametrize("stiffness", [1e21, 1e30])
def test_a_stiff_spring_beside_a_motor_and_limits_goes_to_neither(stiffness):
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    scene.interact("*", "*", None)
    ball = scene.add(cn.disks([[0.5, 0.0]], 0.1, STEEL))[0]
    spring = cn.Spring(stiffness)
    scene.join(ball, None, cn.Slider(point=(0, 0), axis=(0, 1), spring=spring, limits=(-0.1, 0.1), motor=cn.Motor(1.0, 50.0)))
    sim = cn.Simulation(scene, dt=1e-3)
    for _ in range(200):
        sim.step()
    assert np.abs(sim.bodies.velocity).max() < 1e-9
