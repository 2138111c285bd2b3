"""A zone between two meshes all of whose dofs are given, the usual test of one element: springs and strengths answer."""

import warnings

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=1000.0)
WORK, STRENGTH, STIFFNESS, OPEN = 20.0, 1e6, 1e12, 1e-4


def block(low, high):
    """Three cells between two heights, all of whose nodes are in one group."""
    x = np.linspace(0.0, 0.2, 4)
    points = np.concatenate([np.stack([x, np.full(4, y)], -1) for y in (low, high)])
    cells = np.array([[k, k + 1, k + 5, k + 4] for k in range(3)])
    groups = {"all": np.arange(8), "bottom": np.arange(4), "top": np.arange(4, 8)}
    return cn.ElasticBody(points, {"quad": cells}, young=1e9, poisson=0.0, density=1.0, groups=groups)


@pytest.mark.parametrize("angle", [0.0, 0.5 * np.pi])
def test_a_zone_between_given_meshes_opens_by_its_law(angle):
    law = cn.MAL(normal_stiffness=STIFFNESS, tangential_stiffness=STIFFNESS, normal_strength=STRENGTH,
                 tangential_strength=STRENGTH, normal_work=WORK, tangential_work=WORK, within=1e-6)  # fmt: skip
    scene = cn.Scene(2)
    scene.add(cn.deformable(block(-0.1, 0.0), ROCK, edges="top", fixed={"all": "xy"}))
    way = np.array([np.sin(angle), np.cos(angle)]) * OPEN / 0.4
    given = {"x": lambda t: way[0] * t, "y": lambda t: way[1] * t}
    scene.add(cn.deformable(block(0.0, 0.1), ROCK, contact="bottom", edges="bottom", displace={"all": given}))
    scene.interact(ROCK, ROCK, law)
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(theta=1.0))
    largest, spent, gone = 0.0, 0.0, 0.0
    axis = 1 if angle == 0 else 0
    while sim.time < 0.4 - 1e-9:
        with warnings.catch_warnings():  # the step that breaks it spends what springs held: nothing is made of it
            warnings.simplefilter("error", cn.EnergyCreatedWarning)
            info = sim.step()
        assert info["status"] == "converged"
        force = abs(sim.contacts.impulse[:, axis].sum()) / sim.dt
        largest = max(largest, force)
        spent, gone = spent + force * OPEN * sim.dt / 0.4, gone + OPEN * sim.dt / 0.4
    assert largest == pytest.approx(0.2 * STRENGTH, rel=0.01)
    assert spent == pytest.approx(0.2 * WORK, rel=0.02)
    assert np.all(sim.contacts.beta < 1e-3)
    terms = sim.energy
    assert terms["work_external"] + terms["work_driven"] == pytest.approx(0.2 * WORK, rel=0.02)
    assert abs(terms["closure"]) < 1e-9 * terms["in_play"]
