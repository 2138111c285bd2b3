"""Contacts found among kept pairs, and impulses found by the order of the last step: a run that is told its own state before
every step, so that impulses are found by their keys, ends in the same bits."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=2500.0)


def pile(dim, drum=False):
    rng = np.random.default_rng(dim)
    count = 300
    radii = rng.uniform(0.005, 0.01, count)
    scene = cn.Scene(dim, gravity=-9.81 * np.eye(dim)[-1])
    if dim == 3:
        x = cn.pre.deposit_spheres(radii, (0.1, 0.1))
        scene.add(cn.spheres(x, radii, ROCK), cn.box(np.zeros(3), (0.1, 0.1, 0.5), ROCK, lid=False))
    elif drum:
        x = cn.pre.deposit_disks(radii, 0.28) - (0.14, 0.2)
        scene.add(cn.disks(x, radii, ROCK), cn.ring((0, 0), 0.3, ROCK, velocity=(0, 0, 2.0)))
    else:
        x = cn.pre.deposit_disks(radii, 0.3)
        scene.add(cn.disks(x, radii, ROCK), cn.box((0, 0), (0.3, 1.0), ROCK, lid=False))
    scene.interact("*", "*", cn.Coulomb(mu=0.4))
    strategy = cn.NSCD(solver=cn.NLGS(tol=1e-4, max_iter=300), renumber_every=25)
    return cn.Simulation(scene, 1e-3, strategy, overlap="ignore")


def disturb(sim, step):
    """Things that lists do not live through."""
    dim, bodies = sim.scene.dim, sim.bodies
    if step == 12:  # grains jump
        noise = np.random.default_rng(step).standard_normal(bodies.position.shape)
        bodies.set(position=bodies.position + 4e-4 * noise * (bodies.mass < 1)[:, None])
    if step == 20:  # one is shot through the others
        velocity = bodies.velocity.copy()
        velocity[5, :dim] = 3.0
        bodies.set(velocity=velocity)
    if step == 30:
        shape = cn.disks if dim == 2 else cn.spheres
        sim.add(shape([[0.05] * (dim - 1) + [0.28 if sim.bodies.position[:, -1].max() < 0.27 else 0.45]], 0.004, ROCK))
    if step == 40:
        sim.remove(bodies.id[[3, 17]])


@pytest.mark.parametrize("dim, drum", [(2, False), (3, False), (2, True)])
def test_impulses_found_by_order_are_those_found_by_keys(dim, drum):
    sims = [pile(dim, drum), pile(dim, drum)]
    for step in range(60):
        for told, sim in enumerate(sims):
            disturb(sim, step)
            if told:
                sim.set_state(sim.get_state())
            sim.step()
        one, other = sims
        assert one.info["contacts"] == other.info["contacts"], step
        assert one.info["iterations"] == other.info["iterations"], step
        np.testing.assert_array_equal(one.bodies.velocity, other.bodies.velocity, str(step))
    assert one.info["contacts"] > 200
    np.testing.assert_array_equal(one.contacts.impulse, other.contacts.impulse)


def test_a_restart_amid_kept_pairs_goes_on_to_the_same_bits(tmp_path):
    sim = pile(2)
    for _ in range(33):
        sim.step()
    sim.checkpoint(tmp_path / "state.h5")
    for _ in range(10):
        sim.step()
    again = pile(2)
    again.restore(tmp_path / "state.h5")
    for _ in range(10):
        again.step()
    np.testing.assert_array_equal(sim.bodies.velocity, again.bodies.velocity)


@pytest.mark.parametrize("dim, drum", [(2, False), (3, False), (2, True)])
def test_contacts_among_kept_pairs_are_those_of_a_search_made_anew(dim, drum, tmp_path):
    """The other simulation is a new one in each step: it has no pairs to keep."""
    sim, path = pile(dim, drum), tmp_path / "state.h5"
    for step in range(29):
        sim.checkpoint(path)
        new = pile(dim, drum)
        new.restore(path)
        for each in (sim, new):
            disturb(each, step)
            each.step()
        for name in ("key", "gap", "normal", "impulse"):
            np.testing.assert_array_equal(getattr(sim.contacts, name), getattr(new.contacts, name), f"{name}, step {step}")
        np.testing.assert_array_equal(sim.bodies.velocity, new.bodies.velocity, str(step))
    assert len(sim.contacts.gap) > 100
