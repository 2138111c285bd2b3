"""Cohesive zones over ranks: where all contacts are zones, they are solved over all bodies at once, as without ranks."""

import hashlib

import cairn as cn
import numpy as np
import pytest

BRICK = cn.Material("brick", density=1900.0)
STIFF = {"normal_stiffness": 1e10, "tangential_stiffness": 1e10}


def panel(ranks):
    """Courses of rigid bricks that zones join, under a beam that is driven along them after 20 steps."""
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    places = [((i + 0.5 * (k % 2)) * 0.2, 0, 0.05 + 0.1 * k) for k in range(4) for i in range(3)]
    scene.add(cn.boxes(places, (0.2, 0.1, 0.1), BRICK))
    scene.add(cn.boxes([(0.3, 0, -0.05)], (1.2, 0.3, 0.1), BRICK, fixed=True))
    top = scene.add(cn.boxes([(0.3, 0, 0.45)], (1.2, 0.1, 0.1), BRICK))
    scene.interact("*", "*", cn.MAC(mu=0.7, work=20.0, **STIFF))
    sim = cn.Simulation(scene, 1e-3, ranks=ranks)
    ends, sweeps = [], 0
    for step in range(60):
        if step == 20:
            sim.drive(top, "vx", 0.02)
        sim.step()
        ends.append(sim.info["status"])
        sweeps += sim.info["iterations"]
    return sim, ends, sweeps


def digest(sim):
    state = [sim.bodies.position, sim.bodies.velocity, sim.contacts.key, sim.contacts.impulse, sim.contacts.beta]
    return hashlib.sha256(b"".join(np.ascontiguousarray(a).tobytes() for a in state)).hexdigest()


@pytest.fixture(scope="module")
def panels():
    return {ranks: panel(ranks) for ranks in (None, 1, 3)}


def test_steps_of_a_sheared_panel_converge(panels):
    """Passes begin with the impulses of the last step, and zones have the damage that their neighbours hold: without either
    13 of 100 steps of such a panel end at their limit."""
    (alone, due, swept), (over, ends, sweeps) = panels[None], panels[3]
    assert ends.count("converged") == due.count("converged") == 60
    assert over.ranks.figures()["gathered_solves"] > 0 and sweeps < 3 * swept
    assert 0.05 < alone.contacts.beta.min() + 0.1 and alone.contacts.beta.min() < 0.9  # some zones are damaged
    np.testing.assert_allclose(np.sort(over.contacts.beta), np.sort(alone.contacts.beta), atol=0.02)


def test_the_same_bits_for_every_number_of_ranks(panels):
    assert digest(panels[1][0]) == digest(panels[3][0])
