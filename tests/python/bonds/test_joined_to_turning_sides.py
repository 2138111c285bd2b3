"""Meshes joined to flat sides of rigid bodies that turn: the joint neither stretches nor breaks them, whatever the turn."""

import cairn as cn
import numpy as np
import pytest

SIDE = 0.1
SPIN = 20.0
STEP = 2e-4
DENSITY = 1000.0
YOUNG = 1e10
# of the stress of the spin, rho (omega L)^2 / 2; a stretch of (omega h)^2 / 2 a step came to 2e-3
MOST_STRAIN = 2 * DENSITY * (SPIN * SIDE) ** 2 / YOUNG

ZONE = cn.MAL(
    normal_stiffness=1e11,
    tangential_stiffness=5e10,
    normal_strength=2e6,
    tangential_strength=3e6,
    normal_work=100.0,
    tangential_work=300.0,
)
CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]


def block(dim, cells):
    """A square or a cube whose group "joint" lies in the plane x = 0, and the velocities of its turn."""
    lines = [np.linspace(-SIDE, 0, cells + 1)] + [np.linspace(-SIDE / 2, SIDE / 2, cells + 1)] * (dim - 1)
    grid = np.stack(np.meshgrid(*lines, indexing="ij"), -1)
    number = np.arange(grid[..., 0].size).reshape(grid.shape[:dim])
    corners = [c[:dim] for c in CORNERS[: 2**dim]]
    cell = [number[tuple(slice(c, cells + c) for c in corner)].ravel() for corner in corners]
    points = grid.reshape(-1, dim)
    velocity = np.zeros_like(points)
    velocity[:, 0], velocity[:, 1] = -SPIN * points[:, 1], SPIN * points[:, 0]
    body = cn.SolidBody(
        points,
        {"quad" if dim == 2 else "hexahedron": np.stack(cell, -1)},
        cn.NeoHookean(young=YOUNG, poisson=0.3),
        density=DENSITY,
        groups={"joint": number[-1].ravel()},
    )
    return body, velocity


def turning(dim, law, cells=2, beyond=0.0):
    """The block joined to a rigid block that is larger or smaller by `beyond` at each edge; together they turn freely."""
    body, velocity = block(dim, cells)
    soft, hard = cn.Material("soft", density=DENSITY), cn.Material("hard", density=DENSITY)
    scene = cn.Scene(dim)
    sides = {"edges" if dim == 2 else "faces": "joint"}
    scene.add(cn.deformable(body, soft, contact="joint", velocity=velocity, **sides))
    low, high = -SIDE / 2 - beyond, SIDE / 2 + beyond
    if dim == 2:
        corners = [[0, low], [SIDE, low], [SIDE, high], [0, high]]
        scene.add(cn.polygons([np.array(corners)], hard, velocity=[[0, SPIN * SIDE / 2, SPIN]]))
    else:
        size = [SIDE, high - low, high - low]
        scene.add(cn.boxes([[SIDE / 2, 0, 0]], [size], hard, velocity=[[0, SPIN * SIDE / 2, 0, 0, 0, SPIN]]))
    scene.interact(soft, hard, law)
    solver = cn.NLGS(tol=1e-10, max_iter=5000)
    return cn.Simulation(scene, STEP, cn.NSCD(0.5, solver=solver)), body.groups["joint"]


def longest_strain(sim, nodes, start):
    """Largest strain of the distances between nodes of the joined side."""
    now = np.asarray(sim.nodes.position)[nodes]
    apart = lambda x: np.linalg.norm(x[:, None] - x[None, :], axis=2)[np.triu_indices(len(nodes), 1)]  # noqa: E731
    return np.abs(apart(now) / apart(start) - 1).max()


@pytest.mark.parametrize("law", [ZONE, cn.Bonded()], ids=["zone", "bonded"])
@pytest.mark.parametrize("beyond", [0.0, 0.02, -0.02], ids=["flush", "larger", "smaller"])
def test_a_turn_neither_stretches_nor_loads_the_joint_beyond_what_spins_do(law, beyond):
    sim, nodes = turning(2, law, beyond=beyond)
    start = np.asarray(sim.nodes.position)[nodes].copy()
    forces = []
    for _ in range(250):  # a radian
        sim.step()
        forces.append(np.linalg.norm(sim.contacts.impulse.sum(axis=0)) / STEP)
        assert sim.info["status"] == "converged"
    assert longest_strain(sim, nodes, start) < MOST_STRAIN
    assert np.count_nonzero(sim.contacts.beta == 1) == 3  # of a smaller one the node in the middle, and the corners
    if beyond >= 0:  # with corners on the side of the mesh impulses are of either body
        soft, hard = DENSITY * SIDE**2, DENSITY * SIDE * (SIDE + 2 * beyond)
        centre = SIDE / 2 * (hard - soft) / (hard + soft)
        assert np.mean(forces[125:]) == pytest.approx(soft * SPIN**2 * (SIDE / 2 + centre), rel=1e-2)


@pytest.mark.parametrize("law", [ZONE, cn.Bonded()], ids=["zone", "bonded"])
def test_a_face_of_a_cube_turns_with_the_side_of_a_box(law):
    sim, nodes = turning(3, law)
    start = np.asarray(sim.nodes.position)[nodes].copy()
    for _ in range(100):
        sim.step()
    assert longest_strain(sim, nodes, start) < MOST_STRAIN
    assert np.all(sim.contacts.beta == 1)
    assert len(sim.contacts.beta) == 9


def test_a_corner_between_two_triangles_of_a_mesh_has_one_contact():
    """Each corner of the box stands on the diagonal of a face: a second contact, with the other half, diverged against the
    bond."""
    sim, _ = turning(3, cn.Bonded(), beyond=-0.02)
    for _ in range(60):
        sim.step()
        assert sim.info["status"] == "converged"
        assert np.count_nonzero(sim.contacts.beta == 1) == 5  # the node in the middle, and the corners


def test_a_restart_goes_on_to_the_same_bits(tmp_path):
    """Corners on sides of the mesh and nodes on sides of the rigid block keep where they hold."""
    ways = []
    for stop in (False, True):
        sim, _ = turning(2, cn.Bonded(), beyond=-0.02)
        for k in range(10):
            if stop and k == 5:
                sim.checkpoint(tmp_path / "turning.checkpoint.h5")
                sim, _ = turning(2, cn.Bonded(), beyond=-0.02)
                sim.restore(tmp_path / "turning.checkpoint.h5")
            sim.step()
        ways.append((np.array(sim.nodes.position), np.array(sim.contacts.impulse)))
    assert np.array_equal(ways[0][0], ways[1][0]) and np.array_equal(ways[0][1], ways[1][1])


def test_a_block_that_sticks_to_a_turning_table_stays_where_it_is():
    """A radian of a table about an axis 0.3 m away, a tenth of the friction taken: neither a slip nor a stretch."""
    turn, step = 2.0, 2e-3
    body, _ = block(3, 2)
    points = np.asarray(body.points)[:, [1, 2, 0]] + [0.3, 0.0, SIDE]  # on its side x = -SIDE
    body = cn.SolidBody(
        points,
        {"hexahedron": body.cells["hexahedron"]},
        cn.NeoHookean(young=1e6, poisson=0.3),
        density=DENSITY,
        groups={"low": np.flatnonzero(points[:, 2] < 1e-9)},
    )
    velocity = np.zeros_like(points)
    velocity[:, 0], velocity[:, 1] = -turn * points[:, 1], turn * points[:, 0]
    rubber, steel = cn.Material("rubber", density=DENSITY), cn.Material("steel", density=DENSITY)
    scene = cn.Scene(3, gravity=[0, 0, -9.81])
    scene.add(cn.deformable(body, rubber, contact="low", faces="low", velocity=velocity))
    table = scene.add(cn.boxes([[0, 0, -0.1]], [[2.0, 2.0, 0.2]], steel))
    scene.interact(rubber, steel, cn.Coulomb(mu=1.0))
    sim = cn.Simulation(scene, step, cn.NSCD(0.5))
    sim.drive(table, ["vx", "vy", "vz", "wx", "wy", "wz"], [0, 0, 0, 0, 0, turn])
    low = body.groups["low"]
    start = np.array(sim.nodes.position)[low]
    for _ in range(250):
        sim.step()
    radius = lambda x: np.hypot(*x.mean(axis=0)[:2])  # noqa: E731
    # straight flights took it (omega h)^2 / 2 further in each step, 2e-3 of the radius in all
    assert radius(np.asarray(sim.nodes.position)[low]) == pytest.approx(radius(start), rel=2e-4)
    assert longest_strain(sim, low, start) < 5e-4
