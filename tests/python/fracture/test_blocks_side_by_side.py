"""Cohesive joints between meshed blocks that lie flush beside, behind and above each other: each node of the joint is
bonded to the face opposite, also where a node lies on the edge between two faces or where several blocks meet."""

import itertools

import cairn as cn
import numpy as np
import pytest

STONE = cn.Material("stone", density=2000.0)
STRENGTH = 2.5e5  # [Pa]
LAW = cn.MAL(normal_stiffness=8.2e10, tangential_stiffness=3.6e10, mu=0.75, normal_strength=STRENGTH, tangential_strength=3.5e5,
             normal_work=18.0, tangential_work=125.0)  # fmt: skip
TETRAHEDRA = np.array([[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]])


def block(origin, cells, size, tetrahedra=False):
    dim = len(origin)
    axes = [o + np.linspace(0, s, c + 1) for o, s, c in zip(origin, size, cells)]
    grid = np.meshgrid(*axes, indexing="ij")
    nodes = np.stack([x.ravel() for x in grid], -1)
    number = np.arange(len(nodes)).reshape(grid[0].shape)
    ends = list(itertools.product((slice(None, -1), slice(1, None)), repeat=dim))
    cubes = np.stack([number[end].ravel() for end in ends], -1)  # corner i has the bits of i as (x, y, z), x first
    if dim == 2:
        elements = {"quad": cubes[:, [0, 2, 3, 1]]}
    elif tetrahedra:
        elements = {"tetra": np.concatenate([cubes[:, [t[0], t[2], t[1], t[3]]] for t in TETRAHEDRA])}
    else:
        elements = {"hexahedron": cubes[:, [0, 4, 6, 2, 1, 5, 7, 3]]}
    rim = np.flatnonzero(np.any([(nodes[:, k] == axes[k][end]) for k in range(dim) for end in (0, -1)], axis=0))
    faces = {f"{k}{end}": np.flatnonzero(nodes[:, k] == axes[k][end]) for k in range(dim) for end in (0, -1)}
    return cn.ElasticBody(nodes, elements, young=1e10, poisson=0.2, density=2000.0, groups={"rim": rim} | faces)


def sides(dim):
    return {"contact": "rim", ("edges" if dim == 2 else "faces"): "rim"}


def with_blocks(origins, cells, size=(1.0, 1.0, 1.0), tetrahedra=False, drive=None, origin=0.0):
    """A simulation of the blocks, and the ids of each."""
    dim = len(origins[0])
    scene, ids = cn.Scene(dim), []
    for k, at in enumerate(origins):
        body = block(np.asarray(at) + origin, cells, size[:dim], tetrahedra)
        ids.append(scene.add(cn.deformable(body, STONE, **sides(dim), **(drive[k] if drive else {}))))
    scene.interact("*", "*", LAW)
    return scene, ids


def bonds(sim, ids):
    """How many bonds join each pair of blocks: {(i, j): bonds}."""
    block_of = np.full(ids[-1].max() + 1, -1)
    for k, own in enumerate(ids):
        block_of[own] = k
    pairs = np.sort(block_of[np.asarray(sim.contacts.bodies)], axis=1)[np.ravel(sim.contacts.beta) > 0]
    return {(int(i), int(j)): int((pairs == (i, j)).all(axis=1).sum()) for i, j in np.unique(pairs, axis=0)}


def expected(origins, cells):
    """Unit blocks that share a face have a bond at each node of it."""
    pairs = itertools.combinations(range(len(origins)), 2)
    apart = {(i, j): np.abs(np.subtract(origins[i], origins[j])) for i, j in pairs}
    return {pair: int(np.prod([c + 1 for c, x in zip(cells, d) if x == 0])) for pair, d in apart.items() if d.sum() == 1}


ALL = {dim: list(itertools.product((0.0, 1.0), repeat=dim)) for dim in (2, 3)}


@pytest.mark.parametrize("tetrahedra", [False, True], ids=["hexahedra", "tetrahedra"])
@pytest.mark.parametrize("cells", [(1, 1, 1), (2, 1, 3)], ids=["one cell", "six cells"])
@pytest.mark.parametrize("axis", range(3), ids="xyz")
def test_two_blocks_are_bonded_at_each_node_of_their_joint(axis, cells, tetrahedra):
    beside = np.eye(3)[axis]
    for origins in ([np.zeros(3), beside], [beside, np.zeros(3)]):
        scene, ids = with_blocks(origins, cells, tetrahedra=tetrahedra)
        sim = cn.Simulation(scene, 1e-4)
        sim.step()
        assert bonds(sim, ids) == expected(origins, cells)


@pytest.mark.parametrize("cells", [1, 2])
@pytest.mark.parametrize("dim", [2, 3])
def test_each_joint_of_blocks_that_meet_in_a_point_is_bonded(dim, cells):
    scene, ids = with_blocks(ALL[dim], (cells,) * dim)
    sim = cn.Simulation(scene, 1e-4)
    sim.step()
    assert bonds(sim, ids) == expected(ALL[dim], (cells,) * dim)


@pytest.mark.parametrize("origin", [-1e3, 1e6])
def test_so_they_are_far_from_the_origin(origin):
    scene, ids = with_blocks(ALL[3], (1, 1, 1), origin=origin)
    sim = cn.Simulation(scene, 1e-4)
    sim.step()
    assert bonds(sim, ids) == expected(ALL[3], (1, 1, 1))


@pytest.mark.filterwarnings("ignore::cairn.UnjoinedWarning")  # of blocks that touch along an edge alone
@pytest.mark.parametrize("count", [3, 4, 7])
def test_so_is_each_joint_where_some_of_these_blocks_lack(count):
    chosen = np.random.default_rng(1)
    for _ in range(4):
        origins = [ALL[3][k] for k in sorted(chosen.choice(8, count, replace=False))]
        scene, ids = with_blocks(origins, (1, 1, 1))
        sim = cn.Simulation(scene, 1e-4)
        sim.step()
        assert bonds(sim, ids) == expected(origins, (1, 1, 1))


@pytest.mark.parametrize("axis", range(3), ids="xyz")
def test_their_joint_bears_its_strength(axis):
    """A block drawn off another that is fixed: the largest force is strength times face."""
    unit, speed = np.eye(3)[axis], 2e-2
    others = "".join(a for k, a in enumerate("xyz") if k != axis)
    drive = [dict(fixed={f"{axis}0": "xyz"}), dict(drive={f"{axis}-1": {"xyz"[axis]: speed}}, fixed={f"{axis}-1": others})]
    scene, ids = with_blocks([np.zeros(3), unit], (2, 2, 2), drive=drive)
    sim = cn.Simulation(scene, 5e-5)
    pull = []
    for _ in range(150):
        sim.step()
        assert sim.info["status"] == "converged"
        pull.append(np.abs(np.asarray(sim.contacts.force)[:, axis].sum()))
    assert max(pull) == pytest.approx(STRENGTH, rel=0.03)
