"""Bodies on sheets thinner than themselves: the far side of a sheet does not hold them."""

import cairn as cn
import numpy as np
import pytest
from second_order import box
from shape_pairs import CUBE_FACES, triangles

# steps of 6 mm through sheets of 1 mm and cells of 5 are warned of
pytestmark = pytest.mark.filterwarnings("ignore::cairn.TunnellingWarning", "ignore::cairn.OverlapWarning")

STEEL = cn.Material("steel", density=2600.0)
R, FALL, BACK = 0.08, 0.5, 0.8
UPSIDE = {
    "sphere": lambda at: cn.spheres([at], R, STEEL),
    "capsule": lambda at: cn.capsules([at], R, R, STEEL, axis=(1, 0, 0)),
    "ellipsoid": lambda at: cn.superquadrics([at], (R, R, R), (1.0, 1.0), STEEL),
    "cylinder": lambda at: cn.cylinders([at], R, 2 * R, STEEL),
    "box": lambda at: cn.boxes([at], 2 * R, STEEL),
    "clump": lambda at: cn.clumps([at], [[-R, 0, 0], [R, 0, 0]], [R, R], 11.0, (0.03, 0.1, 0.1), STEEL),
}


def sheet(thickness, turned=False):
    """A closed box, 2 x 2 m, whose top is at 0; turned: lying on its other side, whose triangles are cut the other way."""
    x = np.array([[x, y, z] for z in (-thickness, 0.0) for y in (-1, 1) for x in (-1, 1)])
    faces = triangles([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])
    if turned:
        x = x * (1, -1, -1) - (0, 0, thickness)
    return cn.surface(x, faces, STEEL)


def rise(floor, body, dt=2e-3):
    """How high a body rises that fell on a floor [m], and the deepest gap on the way."""
    scene = cn.Scene(body.dim, gravity=(0.0,) * (body.dim - 1) + (-9.81,))
    scene.add(floor, body)
    scene.interact("*", "*", cn.Restitution(normal=BACK))
    sim = cn.Simulation(scene, dt, overlap="ignore")
    heights, deepest = [], 0.0
    while sim.time < 0.9:
        sim.step()
        heights.append(sim.bodies.position[:, -1].max() - R)
        deepest = min(deepest, sim.contacts.gap.min(initial=0.0))
    return np.max(heights[np.argmin(heights) :]), deepest


@pytest.mark.parametrize("shape", UPSIDE)
@pytest.mark.parametrize("thickness", [0.005, 0.001])
@pytest.mark.parametrize("place", [(0.03, 0.07), (1.0, 0.3)], ids=["inside", "rim"])
def test_a_body_rises_from_a_thin_surface(shape, thickness, place):
    """To e² of its height, above the middle and over the border: spheres and capsules stayed on it."""
    if shape == "clump":
        place = (place[0] - 2 * R, place[1])  # all of it over the sheet, or it turns
    highest, deepest = rise(sheet(thickness, turned=place[0] < 0.5), UPSIDE[shape]((*place, R + FALL)))
    assert highest == pytest.approx(BACK**2 * FALL, rel=0.01)
    assert deepest > -0.007 or shape == "cylinder"  # no more than a step takes it


@pytest.mark.parametrize("radius, thickness, dt", [(0.01, 0.001, 2e-3), (0.05, 0.005, 2e-3), (0.005, 0.001, 5e-4)])
def test_small_balls_too(radius, thickness, dt):
    body = cn.spheres([[0.03, 0.07, R + FALL]], radius, STEEL, velocity=[[0, 0, -3.0, 0, 0, 0]])
    scene = cn.Scene(3)
    scene.add(sheet(thickness), body)
    scene.interact("*", "*", cn.Restitution(normal=BACK))
    sim = cn.Simulation(scene, dt, overlap="ignore")
    while sim.time < 0.25:
        sim.step()
    assert sim.bodies.velocity[1, 2] == pytest.approx(3.0 * BACK, rel=1e-6)


@pytest.mark.parametrize("shape", ["sphere", "capsule"])
def test_a_ball_rests_on_a_thin_surface_and_may_leave_it(shape):
    """It bears the weight by the near side alone, and goes where it is thrown."""
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    scene.add(sheet(0.001), UPSIDE[shape]((0.03, 0.07, R)))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 1e-3)
    for _ in range(50):
        sim.step()
        normal = sim.contacts.normal[:, 2] * np.where(sim.contacts.bodies[:, 0] == 1, 1, -1)
        assert len(normal) > 0 and np.all(normal > 0)
    assert sim.bodies.position[1, 2] == pytest.approx(R, abs=1e-5)
    sim.bodies.set(velocity=sim.bodies.velocity + [[0] * 6, [0, 0, 1.0, 0, 0, 0]])
    for _ in range(50):
        sim.step()
    assert sim.bodies.position[1, 2] == pytest.approx(R + 0.05 - 9.81 / 2 * 0.05**2, abs=1e-3)


def plate(kind, dim, thickness, sides):
    """A mesh of one layer of cells, all of its nodes held."""
    points, cells = box(kind, (4,) * (dim - 1) + (1,), (1.0,) * (dim - 1) + (thickness,))
    points = points - np.array((0.5,) * (dim - 1) + (thickness,))
    groups = {"all": np.arange(len(points)), "top": np.flatnonzero(points[:, -1] > -thickness / 2)}
    body = cn.ElasticBody(points, cells, young=1e9, poisson=0.3, density=1000.0, groups=groups)
    if sides == "rows":
        edges = body.boundary_edges()
        sides = edges[np.isclose(points[edges[:, 0], 1], points[edges[:, 1], 1])]
    return cn.deformable(body, STEEL, fixed={"all": "xyz"[:dim]}, **{"edges" if dim == 2 else "faces": sides})


@pytest.mark.parametrize(
    "kind, shape, sides",
    [("hexahedron", "sphere", "all"), ("tetra", "capsule", "all"), ("quad", "disk", "all"), ("quad", "disk", "rows")],
)
@pytest.mark.parametrize("thickness", [0.02, 0.005])
def test_a_body_rises_from_a_thin_mesh(kind, shape, sides, thickness):
    """Rows of long edges above and below lay with their bars on the other side of it: a disk rose to 0.15 m."""
    dim = 2 if kind == "quad" else 3
    at = (0.03, 0.07)[: dim - 1] + (R + FALL,)
    square = R * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    flat = {"disk": lambda at: cn.disks([at], R, STEEL), "square": lambda at: cn.polygons([square], STEEL, position=[at])}
    assert rise(plate(kind, dim, thickness, sides), (UPSIDE | flat)[shape](at))[0] == pytest.approx(BACK**2 * FALL, rel=0.01)


def test_nodes_rest_on_a_thin_surface():
    """The far side is within the margin of its nodes, which was a pull of their weight."""
    points, cells = box("hexahedron", (1, 1, 1), (0.1, 0.1, 0.1))
    body = cn.ElasticBody(points, cells, young=1e7, poisson=0.3, density=1000.0, groups={"all": np.arange(8)}, rayleigh=(0, 1e-3))
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    scene.add(sheet(1e-3), cn.deformable(body, STEEL, contact="all", velocity=(0, 0, 0.0)))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(margin=5e-3))
    for _ in range(100):
        sim.step()
        assert len(sim.contacts) == 4
    assert np.abs(sim.contacts.impulse[:, 2]).sum() == pytest.approx(9.81e-3, rel=1e-3)


@pytest.mark.parametrize("scale", [2.0**-20, 2.0**20])
def test_units_of_length_leave_the_bits(scale):
    def heights(scale):
        x = scale * np.array([[x, y, z] for z in (-0.001, 0.0) for y in (-1, 1) for x in (-1, 1)])
        scene = cn.Scene(3, gravity=(0, 0, -9.75 * scale))
        scene.add(cn.surface(x, triangles(CUBE_FACES), STEEL))
        scene.add(cn.spheres([[0.03 * scale, 0.07 * scale, 0.1 * scale]], R * scale, STEEL))
        scene.interact("*", "*", cn.Restitution(normal=BACK))
        sim = cn.Simulation(scene, 2.0**-9)
        out = []
        for _ in range(100):
            sim.step()
            out.append(sim.bodies.position[1, 2])
        return np.array(out)

    assert np.array_equal(heights(scale), scale * heights(1.0))
