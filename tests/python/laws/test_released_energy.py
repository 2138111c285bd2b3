"""Released energy of each contact, for all laws that release: the balance has its sum, and so have acoustic events."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=1000.0)
ZONE = {"normal_stiffness": 1e10, "tangential_stiffness": 1e10, "work": 20.0}
LAWS = {
    "ParallelBond": (cn.ParallelBond(normal_stiffness=1e9, tangential_stiffness=1e9, tension=1e5, shear=1e5), 0.0),
    "Rod": (cn.Rod(stiffness=1e5, strength=300.0, within=0.02), 0.01),
    "Rod with a dashpot": (cn.Rod(stiffness=1e5, strength=300.0, viscosity=50.0, within=0.02), 0.01),
    "Wire": (cn.Wire(stiffness=1e5, strength=300.0, within=0.02), 0.01),
    "BrittleCoating": (cn.BrittleCoating(stiffness=1e5, strength=5.0, rest=1e-5, reach=1e-3), 0.0),
    "MACContact": (cn.MACContact(**ZONE, force=5.0, reach=1e-4, loss=1e-5), 0.0),
    "ElasticContact": (cn.ElasticContact(stiffness=1e6, viscosity=50.0, mu=0.3), 0.0),
    "AdhesiveContact": (cn.AdhesiveContact(force=5.0, reach=1e-3, stiffness=1e6, viscosity=10.0, mu=0.3), 0.0),
    "MAC": (cn.MAC(**ZONE, viscosity=1.0), 0.0),
}


def row(law, dim, apart):
    """Three bodies in a row, the middle one thrown."""
    scene, make, along = cn.Scene(dim), cn.disks if dim == 2 else cn.spheres, np.eye(dim)[0]
    speed = np.zeros(3 * dim - 3)
    speed[:2] = 1.0, 0.3
    for k in range(3):
        scene.add(make([k * (0.1 + apart) * along], 0.05, ROCK, velocity=[speed if k == 1 else 0 * speed]))
    scene.interact(ROCK, ROCK, law)
    return cn.Simulation(scene, 1e-5)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("name", LAWS)
def test_events_and_contacts_have_what_the_balance_has(name, dim):
    law, apart = LAWS[name]
    sim = row(law, dim, apart)
    events, of_contacts, last = cn.post.AcousticEvents(sim), 0.0, {}
    for _ in range(400):
        sim.step()
        events(sim)
        now = dict(zip(map(bytes, np.ascontiguousarray(sim.contacts.key)), sim.contacts.released))
        of_contacts += sum(value - last.get(key, 0.0) for key, value in now.items())
        last = now
    released = sim.info["energy"]["released"]
    assert abs(released) > 1e-6
    assert events.table["energy"].sum() == pytest.approx(released, rel=1e-9)
    assert of_contacts == pytest.approx(released, rel=1e-9)


def test_a_liquid_bridge_that_begins_is_an_event():
    scene = cn.Scene(3)
    scene.add(cn.spheres([[0, 0, 0]], 1e-3, ROCK))
    scene.add(cn.spheres([[2.01e-3, 0, 0]], 1e-3, ROCK, velocity=[[-0.5, 0, 0, 0, 0, 0]]))
    scene.interact(ROCK, ROCK, cn.Capillary(tension=0.07, volume=1e-11))
    sim = cn.Simulation(scene, 1e-6)
    events = cn.post.AcousticEvents(sim)
    sim.run(steps=300, progress=False, callback=events)
    released = sim.info["energy"]["released"]
    assert released > 0 and events.table["energy"].sum() == pytest.approx(released, rel=1e-9)


def test_scenes_of_smooth_contacts_have_no_events():
    scene = cn.Scene(2)
    scene.add(cn.disks([[0, 0], [0.0999, 0]], 0.05, ROCK))
    scene.interact(ROCK, ROCK, cn.LinearSpring(stiffness=1e5))
    sim = cn.Simulation(scene, 1e-5, cn.SmoothDEM())
    events = cn.post.AcousticEvents(sim)
    sim.run(steps=5, progress=False, callback=events)
    assert not len(events.table)
