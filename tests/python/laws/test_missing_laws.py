"""Pairs of materials without a law are told when a simulation is made, of bodies that can meet, each once."""

import warnings

import cairn as cn
import numpy as np
import pytest
from cairn.model.missing_laws import missing_laws
from small_scenes import ROCK, SAND

STEEL = cn.Material("steel", density=7800.0)


def scene(*rules, sets=()):
    s = cn.Scene(2, gravity=(0, -9.81))
    s.add(cn.disks([[0, 0.5], [1, 0.5]], 0.5, ROCK), cn.disks([[3, 0.5]], 0.5, SAND, group="upper"))
    s.add(cn.wall((0, 0), (0, 1), STEEL), cn.wall((-5, 0), (1, 0), STEEL), *sets)
    for rule in rules:
        s.interact(*rule)
    return s


LAW = cn.Coulomb(mu=0.4)


@pytest.mark.parametrize(
    ("rules", "pairs"),
    [
        ([("*", "*", LAW)], ()),
        ([("rock", "*", LAW), ("sand", "*", None)], ()),
        ([("rock", "rock", LAW), ("upper", "rock", LAW), ("steel", "rock", LAW)], ["'steel' and 'sand (upper)'"]),
        ([("rock", "steel", LAW), ("upper", "steel", LAW)], ["'rock' and 'rock'", "'sand (upper)' and 'rock'"]),
        ([], ["'rock' and 'rock'", "'sand (upper)' and 'rock'", "'steel' and 'rock'", "'steel' and 'sand (upper)'"]),
    ],
)
def test_what_is_told(rules, pairs):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        cn.Simulation(scene(*rules), 1e-3)
    assert len(caught) == (len(pairs) > 0)
    if pairs:
        assert caught[0].category is cn.MissingLawWarning and caught[0].filename == __file__
        text = str(caught[0].message)
        assert text.startswith(f"no law is declared between {'; between '.join(pairs)}: the first contact of such bodies is an")
        assert "Give scene.interact(" in text


def test_bodies_that_come_in_are_told_once():
    with pytest.warns(cn.MissingLawWarning, match="'steel' and 'rock'"):
        sim = cn.Simulation(scene(("rock", "sand", LAW), ("rock", "rock", LAW), ("sand", "steel", LAW)), 1e-3)
    with pytest.warns(cn.MissingLawWarning) as caught:
        sim.add(cn.disks([[7, 3]], 0.5, cn.Material("ice", density=900.0)))
    assert len(caught) == 1 and "'steel' and 'rock'" not in str(caught[0].message)
    assert "'ice' and 'rock'; between 'ice' and 'sand (upper)'; between 'ice' and 'steel':" in str(caught[0].message)


def test_many_groups():
    sets = [cn.disks([[2.0 * k, 5.0]], 0.5, ROCK, group=f"g{k}") for k in range(3000)]
    rules = [(f"g{k}", f"g{k + 1}", LAW) for k in range(2999)]
    assert not missing_laws(sets, [*rules, ("rock", "rock", LAW)])
    found = missing_laws(sets, rules)
    assert found[0] == (("rock", "g2"), ("rock", "g0")) and len(found) == 5
    assert np.all([s.group for s in sets])
