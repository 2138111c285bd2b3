"""Faces of meshes in 3D as antagonists: a patch test through the contact of two blocks, a ball and the corners of a cube
carried by a face, the balance of energy, restart."""

import cairn as cn
import numpy as np
import pytest
from cairn.model.elastic import ElasticBody
from report import judge
from test_deformable import STEEL, at, scene_of
from test_elastic import grid

SHARP = cn.NLGS(tol=1e-12, max_iter=100000)
# Two facets touched at one point ask for forces along them that nearly cancel: sweeps alone come near them too slowly.
AT_NODES = cn.Auto(tol=1e-12)


def block(cells, low, high, *, simplices=False, plan=1.0, **options):
    """An elastic block with the groups low, high, and two sides."""
    points, elements = grid(3, cells, (plan, plan, high - low), simplices)
    points[:, 2] += low
    body = ElasticBody(points, elements, density=100.0, lumped=True, **options)
    body.groups |= {"low": at(points, 2, low), "high": at(points, 2, high)}
    body.groups |= {"left": at(points, 0, 0.0), "front": at(points, 1, 0.0)}
    return body


@pytest.mark.parametrize("simplices", [False, True], ids=["HEX8", "TET4"])
@pytest.mark.parametrize("upper, gate", [(3, 1e-11), (4, 0.2)])
def test_patch_across_contact(upper, gate, simplices):
    """Two blocks pressed on each other: exact where nodes face nodes; nodes on faces are known to fail else, by how much."""
    young, squeeze = 1e7, 1e-4
    made = [((3, 3, 2), 0.0, 0.5), ((upper, upper, 2), 0.5, 1.0)]
    parts = [block(*how, simplices=simplices, young=young, poisson=0.0) for how in made]
    press = {"high": {"z": lambda t: -squeeze / 0.3 if t < 0.35 else 0.0}}
    scene = scene_of(
        cn.deformable(parts[0], STEEL, faces="high", fixed={"low": "z", "left": "x", "front": "y"}, name="lower"),
        cn.deformable(parts[1], STEEL, contact="low", fixed={"left": "x", "front": "y"}, drive=press, name="upper"),
        dim=3,
    )
    sim = cn.Simulation(scene, dt=0.1, strategy=cn.NSCD(theta=1.0, solver=SHARP))
    for _ in range(8):
        sim.step()
    assert len(sim.contacts) == (upper + 1) ** 2  # each node once
    for mesh in sim.meshes:
        (stress,) = mesh.stress.values()
        judge("stress", stress[:, 2], np.full(len(stress), -young * squeeze), gate)
        judge("mean stress", stress[:, 2].mean(), -young * squeeze, 0.2 * gate)


def floor(simplices=False, **options):
    """A slab held below, its top an antagonist."""
    return cn.deformable(block((3, 3, 1), -0.3, 0.0, simplices=simplices, young=1e6, poisson=0.3, rayleigh=(0, 5e-3)), STEEL,
                         faces="high", fixed={"low": "xyz"}, **options)  # fmt: skip


@pytest.mark.parametrize("simplices", [False, True], ids=["HEX8", "TET4"])
@pytest.mark.parametrize("place", [(0.5, 0.5), (0.41, 0.63), (1 / 3, 0.5), (1 / 3, 1 / 3)])
def test_ball_rests_on_a_face(place, simplices):
    """Far smaller than a cell: between the nodes, on an edge, on a node, it is carried with its weight."""
    ball = cn.spheres([[*place, 0.0305]], 0.03, STEEL, driven=("wx", "wy", "wz"))
    scene = scene_of(floor(simplices), ball, dim=3, gravity=(0, 0, -10.0), mu=0.5)
    sim = cn.Simulation(scene, dt=5e-3, strategy=cn.NSCD(theta=1.0, solver=AT_NODES))
    for _ in range(60):
        assert sim.step()["status"] == "converged"
    force = sim.contacts.impulse / sim.dt
    assert 1 <= np.sum(np.any(force != 0, axis=1)) <= 2  # a dent across an edge is touched on both of its sides
    judge("weight", np.abs(force[:, 2]).sum(), 10 * 1000 * 4 / 3 * np.pi * 0.03**3, 1e-3)


@pytest.mark.parametrize("corners", [True, False])
def test_corners_of_a_cube_rest_on_a_face(corners):
    """A rigid cube on four corners, between the nodes: its weight, and no moment about its centre. As points, or as it is."""
    size, place, corner = 0.25, np.array([0.45, 0.52, 0.125 + 1e-4]), cn.Material("corner", density=1000.0)
    block = cn.Material("block", density=1000.0)
    cube = cn.boxes(place[None], size, block)
    if corners:
        cube = cn.with_corners(cube, corner)
    scene = cn.Scene(dim=3, gravity=(0, 0, -10.0))
    scene.add(cube, floor())
    scene.interact(STEEL, STEEL, cn.Coulomb(mu=0.5))
    if corners:
        scene.interact(block, "*", None)
    scene.interact(corner if corners else block, STEEL, cn.Coulomb(mu=0.5))
    sim = cn.Simulation(scene, dt=5e-3, strategy=cn.NSCD(theta=1.0, solver=SHARP))
    for _ in range(60):
        status = sim.step()["status"]
        assert status == "converged" or not corners  # a dent has crests, which a block may touch besides: slow once or twice
    assert status == "converged"
    force, point = sim.contacts.impulse / sim.dt, sim.contacts.point
    weight = 10 * 1000 * size**3
    judge("weight", np.abs(force[:, 2]).sum(), weight, 1e-3)
    moment = (np.abs(force[:, 2:]) * (point - place)[:, :2]).sum(axis=0)
    judge("moment", moment, np.zeros(2), 1e-3, scale=weight * size)
    with pytest.raises(ValueError, match="a contactor is a sphere: give a set of polyhedra"):
        cn.with_corners(cn.spheres([[0, 0, 0]], 1.0, STEEL), corner)


def test_energy_closes_on_faces():
    """A ball hops over a slab without damping, theta = 1/2."""
    body = block((3, 3, 1), -0.3, 0.0, young=1e5, poisson=0.3)
    slab = cn.deformable(body, STEEL, faces="high", fixed={"low": "xyz"})
    ball = cn.spheres([[0.45, 0.36, 0.06]], 0.05, STEEL, velocity=[[0.2, 0.3, -1.0, 0, 0, 0]])
    sim = cn.Simulation(scene_of(slab, ball, dim=3, gravity=(0, 0, -10.0), mu=0.3), dt=1e-3, strategy=cn.NSCD(solver=SHARP))
    touched = 0
    for _ in range(150):
        sim.step()
        touched += np.any(sim.contacts.impulse != 0)
    assert touched > 3
    energy = sim.energy
    assert abs(energy["closure"]) < 1e-11 * energy["in_play"]


def test_faces_after_a_restart(tmp_path):
    def made():
        ball = cn.spheres([[0.41, 0.63, 0.0305]], 0.03, STEEL, velocity=[[0.5, 0.1, -0.5, 0, 0, 0]])
        scene = scene_of(floor(), ball, dim=3, gravity=(0, 0, -10.0), mu=0.5)
        return cn.Simulation(scene, dt=5e-3, strategy=cn.NSCD(theta=1.0, solver=SHARP))

    whole, first, second = made(), made(), made()
    for _ in range(20):
        whole.step()
    for _ in range(10):
        first.step()
    first.checkpoint(tmp_path / "half.h5")
    second.restore(tmp_path / "half.h5")
    for _ in range(10):
        second.step()
    assert np.array_equal(whole.bodies.position, second.bodies.position)
    assert np.array_equal(whole.nodes.position, second.nodes.position)


def test_what_is_wrong_with_faces_is_named():
    flat = ElasticBody(*grid(2, (1, 1), (1.0, 1.0)), young=1.0, poisson=0.0, density=1.0, groups={"all": np.arange(4)})
    with pytest.raises(ValueError, match="faces are antagonists in 3D alone: in 2D give edges"):
        cn.deformable(flat, STEEL, faces="all")
    body = block((1, 1, 1), 0.0, 1.0, young=1.0, poisson=0.0)
    body.groups["one"] = np.array([0])
    with pytest.raises(ValueError, match="no face of the boundary has all its nodes in 'one'"):
        cn.deformable(body, STEEL, faces="one")
    other = cn.LinearBody(body.points, body.M, body.K, groups=body.groups)
    with pytest.raises(ValueError, match="faces of this body are not known"):
        cn.deformable(other, STEEL, faces="high")
