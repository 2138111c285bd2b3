"""Refusals of cn.fracture.split by name, for cells as separate bodies and for sides that open by threshold."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=2500.0)
ZONE = cn.MAL(normal_stiffness=1e12, tangential_stiffness=1e12, mu=0.3, normal_strength=1e6, tangential_strength=1e6,
              normal_work=100.0, tangential_work=100.0)  # fmt: skip


def mesh():
    points = np.array([[x, y] for x in (0.0, 1.0, 2.0) for y in (0.0, 1.0)])
    return points, {"quad": [[0, 2, 3, 1], [2, 4, 5, 3]]}, {"left": [0, 1], "right": [4, 5], "none": []}


def body():
    points, cells, groups = mesh()
    return cn.ElasticBody(points, cells, young=1e9, poisson=0.2, density=2500.0, groups=groups)


@pytest.mark.parametrize("opens", [None, "threshold"])
@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"fixed": {"lft": "xy"}}, "no group 'lft'.*did you mean 'left'"),
        ({"drive": {"rigt": {"x": 1.0}}}, "no group 'rigt'.*did you mean 'right'"),
        ({"fixed": {"none": "xy"}}, "fixed names the group 'none', which has no node"),
        ({"fixed": {0: "xy"}}, "fixed names 0: give names of groups of the body"),
        ({"law": cn.Coulomb(mu=0.3)}, "law is Coulomb.*joins nothing.*give a law that holds what touches"),
        ({"law": cn.Rolling(mu=0.3, rolling=0.1)}, "law is Rolling.*joins nothing"),
    ],
)
def test_groups_and_laws_that_do_nothing_are_told(given, told, opens):
    law = given.get("law", ZONE)
    with pytest.raises(ValueError, match=told):
        cn.fracture.split(body(), law, ROCK, opens=opens, **{k: v for k, v in given.items() if k != "law"})


@pytest.mark.parametrize("opens", [None, "threshold"])
def test_a_body_that_is_not_linear_is_told(opens):
    points, cells, groups = mesh()
    solid = cn.SolidBody(points, cells, cn.NeoHookean(young=1e9, poisson=0.2), density=2500.0, groups=groups)
    with pytest.raises(ValueError, match="body is a SolidBody, whose cells cannot be parted: give a cairn.ElasticBody"):
        cn.fracture.split(solid, ZONE, ROCK, opens=opens)
    other = cn.ElasticBody(points + [2.0, 0.0], cells, young=1e9, poisson=0.2, density=2500.0, groups=groups)
    both = cn.tied({"a": body(), "b": other}, [("a.right", "b.left")])
    with pytest.raises(ValueError, match="body is a TiedBody"):
        cn.fracture.split(both, ZONE, ROCK, opens=opens)


def test_groups_that_are_there_hold_each_cell_that_has_their_nodes():
    scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
    cn.fracture.split(body(), ZONE, ROCK, fixed={"left": "xy", "right": "y"}).add_to(scene)
    sim = cn.Simulation(scene, 1e-5)
    sim.run(steps=5, progress=False)
    left, right = (np.isclose(sim.nodes.position[:, 0], x) for x in (0.0, 2.0))
    assert not sim.nodes.velocity[left].any() and not sim.nodes.velocity[right, 1].any()
