"""Which law rules which pair, and what a scene asks of materials, groups, overlaps and its cell before it moves."""


import cairn as cn
import numpy as np
import pytest
from cairn import _core
from cairn.model.rules import chosen_rule

STONE = cn.Material("stone", 2500.0)
WORDS = ["stone", "sand", "glass", "left", "right", "top", "*"]


def test_the_table_chooses_as_the_rules_say(seed=1):
    rng = np.random.default_rng(seed)
    scene = cn.Scene(2)
    for _ in range(200):
        pairs = {(m, g) for m, g in zip(rng.choice(WORDS[:3], 8), rng.choice(["", *WORDS[2:6]], 8))}
        species = {pair: k for k, pair in enumerate(sorted(pairs))}
        laws = [None, *(cn.Coulomb(mu=0.1 * k) for k in range(4)), cn.Frictionless()]
        rules = [(*rng.choice(WORDS, 2), laws[rng.integers(6)]) for _ in range(rng.integers(12))]
        table = scene.law_table(species, rules)
        numbers, order = {}, []
        for i, first in enumerate(species):
            for j, second in enumerate(species):
                ruled, law = chosen_rule(first, second, rules)
                assert table.meet(i, j) == (not ruled or law is not None)
                assert (table.find(i, j) >= 0) == (law is not None)
                if law is not None:
                    assert numbers.setdefault(law, table.find(i, j)) == table.find(i, j)
                    if j <= i and law not in order:
                        order.append(law)
        assert [numbers[law] for law in order] == list(range(len(order)))  # laws are numbered by the first pair of each


def test_forty_thousand_groups():
    """None of the 800 million pairs is stored: they would take minutes."""
    n = 40_000
    species = {("stone", f"group {k}"): k for k in range(n)}
    table = cn.Scene(2).law_table(species, [("*", "*", cn.Coulomb(mu=0.3)), ("group 7", f"group {n - 1}", None)])
    assert table.find(0, n - 1) == table.find(n - 1, n - 1) == 0
    assert not table.meet(7, n - 1) and table.meet(8, n - 1)
    sets = [cn.disks([[3.0 * k, 1.0]], 1.0, STONE, group=f"group {k}") for k in range(400)]
    scene = cn.Scene(2)
    for s in sets:
        scene.add(s)
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    cn.Simulation(scene, 1e-3).step()


def test_a_material_keeps_its_number():
    core = _core.Scene(2)
    core.add_bodies(1, [[0.0, 0.0]], None, None, [1.0], [[1.0]])
    body = np.zeros(1, np.int64)
    core.add_contactors("disk", body, np.array([40_000], np.int32), np.ones(1), None, None, None)
    assert core.contactor("material").tolist() == [40_000]  # it was -25536
    with pytest.raises(ValueError, match=r"material\[0\] is -3; materials are numbered from 0"):
        core.add_contactors("disk", body, np.array([-3], np.int32), np.ones(1), None, None, None)


def overlapping(shape):
    """Two bodies of half width 0.5 and more that overlap by 0.1."""
    square = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    place = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.9]])
    if shape == "polygon":
        return 2, cn.polygons(square, STONE, position=[[0.0, 0.0], [0.0, 0.9]])
    if shape == "box":
        return 3, cn.boxes(place, (3.0, 2.0, 1.0), STONE)
    if shape == "capsule":
        return 3, cn.capsules(place[:, [2, 0, 1]], 0.5, 3.0, STONE)
    if shape == "cylinder":
        return 3, cn.cylinders(place, 0.8, 1.0, STONE)
    return 3, cn.superquadrics(place, (1.0, 1.0, 0.5), (1.0, 1.0), STONE)


@pytest.mark.parametrize("shape", ["polygon", "box", "capsule", "cylinder", "superquadric"])
def test_overlaps_of_every_shape_are_told(shape):
    dim, bodies = overlapping(shape)
    scene = cn.Scene(dim)
    scene.add(bodies)
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    with pytest.raises(ValueError, match=r"bodies 0 and 1 by 0\.2 of a radius"):
        cn.Simulation(scene, 1e-3, overlap="error")
    cn.Simulation(scene, 1e-3, overlap="error", overlap_share=0.21)


def wide(shape, width):
    """A body that is so wide along x."""
    if shape == "disk":
        return cn.disks([[0.3, 0.0]], width / 2, STONE)
    if shape == "clump":
        return cn.clumps([[0.3, 0.0]], [[-width / 2 + 0.1, 0], [width / 2 - 0.1, 0]], [0.1, 0.1], 1.0, 1.0, STONE)
    if shape == "polygon":
        return cn.polygons(np.array([[0, 0], [0.5, 0], [0.5, width], [0, width]]), STONE, position=[[1, 0]], rotation=[np.pi / 2])
    turned = [[np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0]]
    if shape == "cylinder":
        return cn.cylinders([[0.0, 0.0, 0.0]], 0.2, width, STONE, rotation=turned)
    if shape == "capsule":
        return cn.capsules([[0.0, 0.0, 0.0]], 0.2, width - 0.4, STONE, rotation=turned)
    return cn.superquadrics([[0.0, 0.0, 0.0]], (0.2, 0.2, width / 2), (0.5, 0.5), STONE, rotation=turned)


@pytest.mark.parametrize("shape", ["disk", "clump", "polygon", "cylinder", "capsule", "superquadric"])
def test_no_body_is_wider_than_the_cell(shape):
    body = wide(shape, 1.0)
    lengths = (0.99, 5.0) if body.dim == 2 else (0.99, 5.0, np.inf)
    scene = cn.Scene(body.dim, periodic=cn.Periodic(lengths))
    with pytest.raises(ValueError, match=r"lengths\[0\] of the periodic cell is 0\.99 m and body 0 is 1 m wide along x"):
        scene.add(body)
    assert scene.count == 0
    scene.add(wide(shape, 0.99))
    scene.interact("*", "*", cn.Frictionless())
    simulation = cn.Simulation(scene, 1e-3)
    with pytest.raises(ValueError, match="at least as wide as every body"):
        simulation.add(body)
    assert len(simulation.bodies) == 1
