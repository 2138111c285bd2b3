"""An elastic bar struck by a block of its own outline: nodes at the corners of both lie on the side that faces them."""

import cairn as cn
import numpy as np
import pytest
from second_order import box

YOUNG, DENSITY, WIDTH = 1e8, 1000.0, 0.1
SPEED = np.sqrt(YOUNG / DENSITY)
STEEL = cn.Material("steel", density=DENSITY)
CORNERS = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


def turned(dim, angle):
    """A rotation, in space about no axis of it; its quaternion."""
    if dim == 2:
        return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]), None
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_rotvec(angle * np.array([0.3, 0.5, 0.8]))
    return turn.as_matrix(), [np.roll(turn.as_quat(), 1)]


def struck(block, kind, high, sides=False, angle=0.0, gap=0.0, across=1):
    """Speed at which a block leaves a clamped bar of an eighth of its density that it struck at 1 m/s."""
    dim = 2 if kind in ("quad", "triangle") else 3
    turn, quaternion = turned(dim, angle)
    points, cells = box(kind, (20,) + (across,) * (dim - 1), (1.0,) + (WIDTH,) * (dim - 1))
    groups = {
        "left": np.flatnonzero(points[:, 0] == 0),
        "right": np.flatnonzero(points[:, 0] == 1.0),
        "all": np.arange(len(points)),
    }
    bar = cn.ElasticBody(points @ turn.T, cells, young=YOUNG, poisson=0.0, density=DENSITY, groups=groups, lumped=True,
                         **({"plane": "stress"} if dim == 2 else {}))  # fmt: skip
    own = {"edges" if dim == 2 else "faces": "left"} if sides else {}
    scene = cn.Scene(dim)
    scene.add(cn.deformable(bar, STEEL, contact="left", fixed={"right": "xyz"[:dim]}, **own))
    low, top = WIDTH / 2 - high / 2, WIDTH / 2 + high / 2
    heavy = cn.Material("heavy", density=2 * DENSITY * WIDTH ** (dim - 1) / (0.1 * high ** (dim - 1)))
    speed = turn[:, 0]
    if block == "polygon":
        outline = np.array([[-0.1 - gap, low], [-gap, low], [-gap, top], [-0.1 - gap, top]])
        scene.add(cn.polygons([outline @ turn.T], heavy, velocity=speed).with_(driven=("w",)))
    elif block == "surface":
        x = np.array([[a, b, c] for a in (-0.1 - gap, -gap) for b in (low, top) for c in (low, top)])
        body = cn.surface(x @ turn.T, CORNERS, STEEL, mass=2 * DENSITY * WIDTH**2, inertia=np.ones(3), free=("vx", "vy", "vz"))
        body.velocity[:, :3] = speed
        scene.add(body)
    else:  # a box, or a stack of two
        pieces = 1 if block == "box" else 2
        centres = [(-0.05 - gap, WIDTH / 2, low + (k + 0.5) * high / pieces) for k in range(pieces)]
        scene.add(cn.boxes(np.array(centres) @ turn.T, (0.1, high, high / pieces), heavy, velocity=speed,
                           rotation=quaternion * pieces).with_(driven=("wx", "wy", "wz")))  # fmt: skip
    scene.interact("*", "*", cn.Frictionless())
    sim = cn.Simulation(scene, 1.0 / 40 / SPEED, overlap="ignore")
    while sim.time < 4.0 / SPEED + gap:
        sim.step()
    return (sim.bodies.velocity[:, :dim] @ speed).mean()


EVEN = [WIDTH, WIDTH + 2e-8, WIDTH - 2e-8]


@pytest.mark.parametrize("block, kind", [("polygon", "quad"), ("polygon", "triangle"), ("box", "hexahedron"), ("box", "tetra"),
                                         ("surface", "hexahedron"), ("two", "hexahedron")])  # fmt: skip
@pytest.mark.parametrize("sides", [False, True])
@pytest.mark.parametrize("angle", [0.0, 0.3])
def test_it_is_thrown_back_as_a_larger_one(block, kind, sides, angle):
    """With nodes alone, and in space with sides, blocks of about the same outline passed through the bar."""
    larger = struck(block, kind, WIDTH * 1.02, sides, angle)
    assert larger == pytest.approx(-0.634, abs=1e-3)
    for high in EVEN[1:2] if angle else EVEN:
        assert struck(block, kind, high, sides, angle) == pytest.approx(larger, abs=1e-4)


@pytest.mark.parametrize("block, kind, across", [("polygon", "quad", 1), ("polygon", "quad", 3), ("box", "hexahedron", 1)])
def test_so_is_one_that_comes_from_afar(block, kind, across):
    expected = struck(block, kind, WIDTH * 1.02, gap=1e-3, across=across)
    for high in (WIDTH, WIDTH - 1e-5, WIDTH + 1e-5):
        assert struck(block, kind, high, gap=1e-3, across=across) == pytest.approx(expected, abs=1e-4)
