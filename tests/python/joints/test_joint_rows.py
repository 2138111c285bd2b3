"""Rows of joints among the contacts: found by name whatever their order, after insertion, removal and a restart."""

import cairn as cn
import numpy as np
import pytest

STEEL = cn.Material("steel", density=2000.0)
G, SIDE = 9.81, 0.2


def chain(order=(3, 1, 0, 2), n=4):
    """Squares that hang below each other, joined in an order; pivot k bears squares k and below."""
    corner = np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) * SIDE
    scene = cn.Scene(dim=2, gravity=(0.0, -G))
    squares = scene.add(cn.polygons([corner - (SIDE / 2, (k + 1) * SIDE) for k in range(n)], STEEL))
    scene.interact("*", "*", None)
    names = {}
    for k in order:
        other = None if k == 0 else squares[k - 1]
        names[k] = scene.join(squares[k], other, cn.Pivot(point=(0.0, -k * SIDE)))
    return scene, squares, [names[k] for k in order], [names[k] for k in range(n)]


def due(k, n=4):
    return 2000.0 * SIDE**2 * G * (n - k)


def test_each_joint_bears_what_hangs_below_it():
    scene, squares, joined, names = chain()
    sim = cn.Simulation(scene, dt=1e-3)
    assert sim.contacts.of_joints() == {}
    sim.step()
    rows = sim.contacts.of_joints()
    assert list(rows) == joined
    assert [rows[name] for name in names] != list(range(4))  # contacts stand in another order
    for k, name in enumerate(names):
        assert squares[k] in sim.contacts.bodies[rows[name]]
        assert abs(sim.contacts.force[rows[name], 1]) == pytest.approx(due(k), rel=1e-9)


def test_rows_follow_contacts_that_come_and_joints_that_go(tmp_path):
    scene, squares, _, names = chain()
    sim = cn.Simulation(scene, dt=1e-3)
    sim.step()
    later = sim.join(squares[3], None, cn.Distance(points=[(0.0, -4 * SIDE), (0.0, -5 * SIDE)]))
    sim.step()
    assert list(sim.contacts.of_joints())[-1] == later
    sim.unjoin(names[3])
    sim.step()
    rows = sim.contacts.of_joints()
    assert set(rows) == {*names[:3], later}
    for k, name in enumerate(names[:3]):
        assert squares[k] in sim.contacts.bodies[rows[name]]
    sim.checkpoint(tmp_path / "a.ckpt")
    sim.step()
    assert list(sim.contacts.of_joints()) == list(rows)


def test_rows_of_joints_beside_contacts():
    """Disks on a floor, two of them held together by a rod against a pull."""
    scene = cn.Scene(dim=2, gravity=(0.0, -G))
    pulls = np.array([(0, 0, 0), (-10.0, 0, 0), (10.0, 0, 0), (0, 0, 0)])
    ids = scene.add(cn.disks([(0.3 * k, 0.1) for k in range(4)], 0.1, STEEL, force=pulls))
    scene.add(cn.wall((0, 0), (0, 1), STEEL))
    scene.interact("*", "*", cn.Coulomb(mu=0.0))
    name = scene.join(ids[1], ids[2], cn.Distance(points=[(0.3, 0.1), (0.6, 0.1)]))
    sim = cn.Simulation(scene, dt=1e-3)
    sim.run(steps=5, progress=False)
    rows = sim.contacts.of_joints()
    assert len(sim.contacts) == 5 and list(rows) == [name]
    assert abs(sim.contacts.force[rows[name], 0]) == pytest.approx(10.0, rel=1e-9)


@pytest.mark.parametrize("ranks", [1, 3])
def test_rows_are_found_over_ranks(ranks):
    scene, squares, joined, names = chain()
    sim = cn.Simulation(scene, dt=1e-3, ranks=ranks)
    sim.step()
    rows = sim.contacts.of_joints()
    assert list(rows) == joined
    for k, name in enumerate(names):
        assert squares[k] in sim.contacts.bodies[rows[name]]


def test_a_removed_body_takes_its_joints_along():
    scene, squares, _, names = chain()
    sim = cn.Simulation(scene, dt=1e-3)
    sim.step()
    sim.remove([squares[3]])
    assert len(sim.contacts) == 0 and sim.contacts.of_joints() == {}  # contacts are found in the next step
    sim.step()
    assert set(sim.contacts.of_joints()) == set(names[:3])
