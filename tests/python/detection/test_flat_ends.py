"""The end of a cylinder that stands on a flat side touches at persistent points, so that laws keep their state."""

import cairn as cn
import numpy as np
import pytest

STONE = cn.Material("stone", density=2000.0)
G, RADIUS, HEIGHT = 9.81, 0.1, 0.02
UP = {"z": (0.0, 0.0, 1.0), "x": (1.0, 0.0, 0.0), "oblique": (0.48, 0.6, 0.64)}


def standing(up, law, ground, side=0.0, **motion):
    """On a half space or a block, gravity along the axis and `side` of it across."""
    up = np.array(up)
    across = np.cross(up, [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    scene = cn.Scene(3, gravity=G * (side * across - up))
    scene.add(cn.cylinders([HEIGHT / 2 * up], RADIUS, HEIGHT, STONE, axis=[up], **motion))
    if ground == "wall":
        scene.add(cn.wall((0, 0, 0), up, STONE))
    else:
        scene.add(cn.boxes([[0, 0, -0.1]], [[1.0, 1.0, 0.2]], STONE, fixed=True))
    scene.interact(STONE, STONE, law)
    return cn.Simulation(scene, 1e-3), up, across


@pytest.mark.parametrize("ground, name", [("block", "z"), *(("wall", name) for name in UP)])
def test_a_slip_limit_holds_where_a_cylinder_stands(ground, name):
    sim, up, across = standing(UP[name], cn.LimitedSlip(mu=0.3, limit=0.002), ground, side=0.4)
    keys = set()
    for _ in range(150):
        assert sim.step()["status"] == "converged"
        keys |= set(map(tuple, sim.contacts.key))
    assert (sim.bodies.position[0] - HEIGHT / 2 * up) @ across == pytest.approx(0.002, rel=1e-3)
    assert len(keys) == 4


@pytest.mark.parametrize("ground", ["wall", "block"])
@pytest.mark.parametrize("motion", ["slides", "spins"])
def test_wear_under_the_end_of_a_cylinder_is_archards(motion, ground):
    """Depth k p s; where it spins, s is that of the points that it stands on, at the rim."""
    wear, steps, speed = 1e-8, 200, 1.0
    drive = [speed, 0, 0, 0, 0, 0] if motion == "slides" else [0, 0, 0, 0, 0, speed / RADIUS]
    driven = ("vx",) if motion == "slides" else ("wz",)
    law = cn.Wear(mu=0.3, wear=wear)
    sim, _, _ = standing(UP["z"], law, ground, driven=driven, drive=drive)
    for _ in range(steps):
        sim.step()
    depth = wear * 2000.0 * G * HEIGHT * speed * 1e-3 * steps
    assert HEIGHT / 2 - sim.bodies.position[0, 2] == pytest.approx(depth, rel=0.02)
