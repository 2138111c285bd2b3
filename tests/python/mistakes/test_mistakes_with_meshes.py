"""Mistakes in what deformable bodies are given: errors name field, value and remedy before a step is made."""

import cairn as cn
import numpy as np
import pytest
from cairn.post.collapse import collapse_multiplier
from cairn.pre import masonry

PLACES, CELLS = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float), {"quad": np.array([[0, 1, 2, 3]])}
RUBBER = cn.Material("rubber", density=1000.0)


def body(**given):
    return cn.ElasticBody(PLACES, CELLS, **{"young": 1e8, "poisson": 0.3, "density": 1000.0, "groups": {"b": [0, 1]}, **given})


@pytest.mark.parametrize(
    "given, words",
    [
        ({"drive": {"b": (0.0, 1.0)}}, r"drive of 'b' is \(0.0, 1.0\): give \{axis: velocity\}"),
        ({"drive": {"b": "y"}}, r"drive of 'b' is 'y': give \{axis: velocity\}"),
        ({"displace": {"b": (0.0, 1.0)}}, r"displace of 'b' is \(0.0, 1.0\): give \{axis: function of time\}"),
        ({"force": (0.0, 1.0)}, r"force is \(0.0, 1.0\): give \{group: \(2,\)\}"),
        ({"force": {"b": 1.0}}, "force of 'b'"),
        ({"force": {"b": (0.0, np.nan)}}, "force of 'b'"),
        ({"force": {"b": lambda: 0}}, r"force\['b'\] takes \(\)"),
        ({"modal_damping": "a"}, "modal_damping.*give a damping ratio"),
        ({"modal_damping": True}, "modal_damping.*give a damping ratio"),
    ],
)
def test_loads_and_motions(given, words):
    with pytest.raises(ValueError, match=words):
        cn.deformable(body(), RUBBER, **given)


@pytest.mark.parametrize(
    "given, words",
    [
        ({"groups": [0, 1]}, r"groups is \[0, 1\]: give \{name: numbers of nodes\}"),
        ({"groups": {"a": [99]}}, "the group 'a' names node 99: the mesh has 4 nodes, from 0"),
        ({"groups": {"a": [-1]}}, "the group 'a' names node -1"),
        ({"groups": {"a": [1.0, 4.0]}}, "the group 'a' names node 4"),
        ({"lumped": "no"}, "lumped is 'no': give True or False"),
    ],
)
def test_bodies(given, words):
    with pytest.raises(ValueError, match=words):
        body(**given)


def test_solids_take_true_or_false():
    law = cn.NeoHookean(young=1e6, poisson=0.3)
    for name in ("lumped", "mean_dilatation"):
        with pytest.raises(ValueError, match=f"{name} is 'no': give True or False"):
            cn.SolidBody(PLACES, CELLS, law, density=1.0, **{name: "no"})


def test_a_force_of_a_group_may_be_a_function_of_time():
    def fallen(force):
        scene = cn.Scene(2)
        scene.add(cn.deformable(body(), RUBBER, force=force))
        sim = cn.Simulation(scene, dt=1e-3)
        sim.run(5, progress=False)
        return np.array(sim.nodes.velocity)

    at_once = fallen(lambda t: {"b": (0.0, 1e5 * t)})
    assert np.array_equal(fallen({"b": lambda t: (0.0, 1e5 * t)}), at_once) and np.any(at_once != 0)


def test_conductances_are_given_by_name():
    with pytest.raises(TypeError, match=r"by name.*give Constant\(conductance=...\)"):
        cn.networks.Constant(1e9)


@pytest.mark.parametrize("given", [{}, {"low": 1.5}, {"high": 1.0}, {"high": 1.0, "low": -1.0}])
def test_an_arch_too_thin_to_stand_is_told_so(given):
    thin = masonry.arch(radius=5.0, thickness=0.4, voussoirs=9)
    with pytest.raises(ValueError, match="falls under its own weight.*needs supports, thickness or friction"):
        collapse_multiplier(thin, mu=0.7, progress=False, **given)
