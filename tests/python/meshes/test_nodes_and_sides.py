"""Bodies with corners, and meshes, that slide over meshes: nodes and the next side in front of them do not stop them."""

import warnings

import cairn as cn
import numpy as np
import pytest

STONE = cn.Material("stone", density=100.0)
SQUARE = np.array([[-0.05, -0.05], [0.05, -0.05], [0.05, 0.05], [-0.05, 0.05]])
CUT = 0.01 * np.array([[-5, -3], [-3, -5], [3, -5], [5, -3], [5, 3], [3, 5], [-3, 5], [-5, 3]])


def block(cells, size, corner=(0.0, 0.0), young=1e9):
    """A block of cells in the plane, with its sides as groups."""
    x, y = (np.linspace(0.0, s, n + 1) for s, n in zip(size, cells))
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2) + corner
    k = np.arange(len(points)).reshape(cells[0] + 1, cells[1] + 1)
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], axis=-1).reshape(-1, 4)
    groups = {"top": k[:, -1], "bottom": k[:, 0], "all": k.ravel()}
    groups["rim"] = np.unique(np.r_[k[0], k[-1], k[:, 0], k[:, -1]])
    return cn.ElasticBody(points, {"quad": quads}, young=young, poisson=0.3, density=100.0, groups=groups)


@pytest.mark.parametrize("contact", [(), "top"])
@pytest.mark.parametrize("corners", [SQUARE, CUT], ids=["square", "cut"])
@pytest.mark.parametrize("cells", [5, 37, 200])
def test_a_polygon_slides_over_a_row_of_edges(cells, corners, contact):
    """Without friction it keeps its speed of 1 m/s, which fell to 0.14 on 200 edges, and to 0.02 where nodes are there, too."""
    scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
    floor = block((cells, 1), (2.0, 0.2))
    scene.add(cn.polygons([corners], STONE, position=[[0.3, 0.25]], velocity=[[1.0, 0.0, 0.0]]))
    scene.add(cn.deformable(floor, STONE, contact=contact, edges="top", fixed={"all": "xy"}))
    scene.interact(STONE, STONE, cn.Coulomb(mu=0.0))
    sim = cn.Simulation(scene, dt=1e-3)
    for _ in range(600):
        sim.step()
        assert np.abs(sim.bodies.velocity[0] - (1.0, 0.0, 0.0)).max() < 1e-3
    assert sim.bodies.velocity[0, 0] == pytest.approx(1.0, abs=2e-6)  # by the default solver, to 1e-4
    assert sim.bodies.position[0, 1] == pytest.approx(0.25, abs=1e-7)


@pytest.mark.parametrize("cells", [15, 150])
def test_a_block_on_a_slope_of_cells_has_the_acceleration_of_one_on_a_wall(cells):
    """g (sin 30 - mu cos 30): 2.402 m/s2 for mu 0.3; 1.24 on 150 edges."""
    scene = cn.Scene(dim=2, gravity=(9.81 * 0.5, -9.81 * np.sqrt(0.75)))
    scene.add(cn.polygons([SQUARE], STONE, position=[[0.3, 0.25]]))
    scene.add(cn.deformable(block((cells, 1), (2.0, 0.2)), STONE, contact="top", edges="top", fixed={"all": "xy"}))
    scene.interact(STONE, STONE, cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, dt=1e-3)
    for _ in range(500):
        sim.step()
    assert sim.bodies.velocity[0, 0] / sim.time == pytest.approx(9.81 * (0.5 - 0.3 * np.sqrt(0.75)), rel=2e-3)


def test_a_side_still_stops_at_the_end_of_a_row():
    """A square that slides into the end of a block below its top is stopped by the last node, whose side looks at it."""
    scene = cn.Scene(dim=2)
    scene.add(cn.polygons([SQUARE], STONE, position=[[-0.2, 0.18]], velocity=[[1.0, 0.0, 0.0]]))
    scene.add(cn.deformable(block((10, 2), (1.0, 0.2)), STONE, contact="rim", edges="rim", fixed={"all": "xy"}))
    scene.interact(STONE, STONE, cn.Coulomb(mu=0.0))
    sim = cn.Simulation(scene, dt=1e-3)
    for _ in range(300):
        sim.step()
    assert sim.bodies.velocity[0, 0] < 1e-6 and sim.bodies.position[0, 0] < -0.05 + 2e-3


@pytest.mark.parametrize("faces", ["top", ()])
def test_a_box_slides_over_faces_and_their_nodes(faces):
    """In space: with nodes beside the faces it went from 1 to 0.37 m/s, and spun."""
    n = 11
    k = np.arange(2 * (n + 1) ** 2).reshape(n + 1, n + 1, 2)
    points = np.stack(np.meshgrid(*(np.linspace(0, 1, n + 1),) * 2, [0.0, 0.2], indexing="ij"), axis=-1).reshape(-1, 3)
    low = [k[:-1, :-1, 0], k[1:, :-1, 0], k[1:, 1:, 0], k[:-1, 1:, 0]]
    cells = np.stack([*low, *(c + 1 for c in low)], axis=-1).reshape(-1, 8)
    groups = {"top": k[..., 1].ravel(), "all": k.ravel()}
    floor = cn.ElasticBody(points, {"hexahedron": cells}, young=1e9, poisson=0.3, density=100.0, groups=groups)
    scene = cn.Scene(dim=3, gravity=(0.0, 0.0, -10.0))
    scene.add(cn.boxes([[0.2, 0.5, 0.25]], [[0.1, 0.1, 0.1]], STONE, velocity=[[1.0, 0.3, 0, 0, 0, 0]]))
    scene.add(cn.deformable(floor, STONE, contact="top" if faces else (), faces="top", fixed={"all": "xyz"}))
    scene.interact(STONE, STONE, cn.Coulomb(mu=0.0))
    sim = cn.Simulation(scene, dt=2e-3)
    for _ in range(250):
        sim.step()
    assert np.abs(sim.bodies.velocity[0, :3] - (1.0, 0.3, 0.0)).max() < 2e-6
    assert np.abs(sim.bodies.velocity[0, 3:]).max() < 1e-3


def test_a_mesh_slides_over_another_with_nodes_and_edges_of_both():
    """Nodes of the floor in front of the side of the block pushed it back to -0.2 m/s."""
    scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
    slider, floor = block((4, 4), (0.2, 0.2), (0.3, 0.2), young=1e6), block((10, 1), (2.0, 0.2), young=1e6)
    scene.add(cn.deformable(slider, STONE, contact="rim", edges="rim", velocity=(1.0, 0.0), name="slider"))
    scene.add(cn.deformable(floor, STONE, contact="rim", edges="rim", fixed={"all": "xy"}, name="floor"))
    scene.interact(STONE, STONE, cn.Coulomb(mu=0.0))
    sim = cn.Simulation(scene, dt=1e-3)
    for _ in range(400):
        sim.step()
    mass = slider.nodal_mass()
    assert mass @ sim.meshes[0].velocity[:, 0] / mass.sum() == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("cells", [10, 40])
def test_a_disk_rests_in_a_soft_row_that_it_bends_round_itself(cells):
    """On edges alone as on nodes: all of the edges under it bear it. Where one alone did it sank by 0.17 m, and not 0.016."""
    deepest = []
    for given in ({"edges": "top"}, {"contact": "top", "edges": "top"}):
        layer = block((cells, 8), (1.0, 0.3), young=1e6)
        body = cn.SolidBody(layer.points, layer.cells, cn.NeoHookean(young=1e6, poisson=0.3), density=1000.0, groups=layer.groups,
                            rayleigh=(20.0, 1e-3))  # fmt: skip
        scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
        scene.add(cn.disks([[0.5, 0.5]], 0.2, cn.Material("ball", density=5000.0)))
        scene.add(cn.deformable(body, STONE, fixed={"bottom": "xy"}, **given))
        scene.interact("*", "*", cn.Coulomb(mu=0.3))
        sim = cn.Simulation(scene, dt=1e-3)
        depth = []
        for _ in range(600):
            sim.step()
            depth.append(0.5 - sim.bodies.position[0, 1])
        deepest.append(max(depth))
    assert 0.01 < deepest[0] < 0.02 and deepest[0] == pytest.approx(deepest[1], rel=0.15)


def test_a_joint_on_a_node_takes_nothing_from_bonds_beside_it():
    """Neither the area of the points around it nor the material of faces that open later."""
    rock = cn.Material("rock", density=2500.0)
    told = []
    for joint in (False, True):
        plate = block((4, 2), (0.1, 0.05), young=30e9)
        groups = {"left": np.flatnonzero(plate.points[:, 0] < 1e-9), "right": np.flatnonzero(plate.points[:, 0] > 0.1 - 1e-9)}
        body = cn.ElasticBody(plate.points, plate.cells, young=30e9, poisson=0.2, density=2500.0, groups=groups)
        law = cn.MAL(normal_stiffness=1e13, tangential_stiffness=1e13, normal_strength=3e6, tangential_strength=6e6,
                     normal_work=30.0, tangential_work=60.0)  # fmt: skip
        scene = cn.Scene(2)
        pieces = cn.fracture.split(body, law, rock, opens="threshold", fixed={"left": "xy"}, drive={"right": {"x": 0.5}})
        pieces.add_to(scene)
        if joint:
            scene.join(7, None, cn.Distance(points=[plate.points[7], plate.points[7] + (0, 0.3)], spring=cn.Spring(1e-9)))
        sim = cn.Simulation(scene, 1e-6, strategy=cn.NSCD(theta=0.52, solver=cn.NLGS(tol=1e-8)))
        for _ in range(100):
            sim.step()
        told.append(sim.energy["released"])
    assert told[0] > 0.5 and told[1] == pytest.approx(told[0], rel=1e-6)


def test_segments_without_thickness_are_told_of_beside_meshes():
    """Nodes fall through them in steps that converge: neither has a side."""
    for radius in (0.0, 0.01):
        scene = cn.Scene(dim=2)
        scene.add(cn.deformable(block((2, 2), (0.2, 0.2), (0.0, 0.1)), STONE, contact="bottom"))
        scene.add(cn.segment((-1, 0), (1, 0), STONE, radius=radius))
        scene.interact(STONE, STONE, cn.Coulomb(mu=0.3))
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            cn.Simulation(scene, dt=1e-3)
        assert [w.category for w in told] == ([cn.ShapesWarning] if radius == 0 else [])


def test_sides_alone_are_told_that_they_meet_no_wall():
    from second_order import box

    points, cells = box("quad", (2, 2), (1.0, 1.0))
    groups = {"out": np.flatnonzero(((points == 0) | (points == 1)).any(axis=1)), "foot": np.flatnonzero(points[:, 1] == 0)}
    rock = cn.Material("rock", density=1000.0)

    def made(**options):
        scene = cn.Scene(2, gravity=(0, -9.81))
        body = cn.ElasticBody(points, cells, young=1e7, poisson=0.3, density=1000.0, groups=groups)
        scene.add(cn.deformable(body, rock, edges="out", **options))
        scene.add(cn.wall((0, 0), (0, 1), rock))
        scene.interact("*", "*", cn.Coulomb(mu=0.3))
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            cn.Simulation(scene, 1e-3)
        return [str(w.message) for w in told if w.category is cn.ShapesWarning]

    assert len(made()) == 1 and "sides of meshes have no contact with shapes half_plane" in made()[0]
    assert not made(contact="out") and not made(fixed={"foot": "xy"})
