"""Sweeps in which bonds that soften take a share of their change: where whole changes go round in circles, the answer is found,
and it is the one of whole changes where these find it."""

import dataclasses

import cairn as cn
import numpy as np
import pytest


def scratched(seed, solver, threads=1):
    """A tool is pushed into bonded grains, and along them: each steps of 44 ns, in which bonds soften and break."""
    radii = cn.pre.grains.uniform(60, 0.05e-3, 0.1e-3, rng=seed)
    length = float(np.sqrt(3 * np.sum(np.pi * radii**2) / 0.84))
    centers = cn.pre.deposit_disks(radii, length)
    rail, tool = cn.Material("rail", density=7800.0), cn.Material("tool", density=7800.0)
    held, every = centers[:, 1] < 2e-4, ("vx", "vy", "w")
    scene = cn.Scene(dim=2)
    scene.add(cn.disks(centers[held], radii[held], rail, driven=every), cn.disks(centers[~held], radii[~held], rail))
    above = (length / 2, (centers[:, 1] + radii).max() + 5e-4)
    scene.add(cn.disks([above], 5e-4, tool, driven=every, drive=lambda t: (50.0, -50.0, 0.0)))
    strength, stiffness = 4e9, 1.4e15
    scene.interact(rail, rail, cn.MP3(normal_stiffness=stiffness, tangential_stiffness=stiffness, mu=0.3, strength=strength,
                                      work=10 * strength**2 / stiffness, within=1e-6))  # fmt: skip
    scene.interact(rail, tool, cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, 4.4e-8, cn.NSCD(theta=0.6, solver=solver, threads=threads))


def took(seed, relaxation, steps, threads=1):
    """Steps that did not converge, largest error, and the simulation."""
    sim = scratched(seed, cn.NLGS(tol=1e-3, max_iter=200, softening_relaxation=relaxation), threads)
    failed, largest = 0, 0.0
    for _ in range(steps):
        sim.step()
        failed += sim.info["status"] != "converged"
        largest = max(largest, sim.info["error"])
    return failed, largest, sim


def test_a_share_of_the_change_is_solved_where_whole_changes_go_round_in_circles():
    """Which steps go round in circles hangs on rounding: steps of all seeds are counted."""
    circles = {1.0: 0, 0.5: 0}
    for seed in range(1, 9):
        for relaxation in circles:
            failed, largest, sim = took(seed, relaxation, 100)
            circles[relaxation] += failed
            assert (failed == 0) == (largest <= 1e-3)
            beta = sim.contacts.beta
            assert np.any((beta > 0) & (beta < 1)) and np.any(beta == 0)
    assert circles[1.0] >= 20 and 2 * circles[0.5] <= circles[1.0]


def test_the_answer_is_that_of_whole_changes():
    """Step by step, from the same state."""
    sharp = cn.NLGS(tol=1e-10, max_iter=20000)
    whole, softened = scratched(2, sharp), 0
    share = scratched(2, dataclasses.replace(sharp, softening_relaxation=0.5))
    for _ in range(28):
        whole.step()
        share.step()
        assert whole.info["status"] == share.info["status"] == "converged"
        beta = whole.contacts.beta
        softened = np.count_nonzero((beta > 0) & (beta < 1))
        largest = np.abs(whole.bodies.velocity).max()
        np.testing.assert_allclose(share.bodies.velocity, whole.bodies.velocity, rtol=0, atol=1e-6 * largest)
        np.testing.assert_allclose(share.contacts.beta, beta, rtol=0, atol=1e-6)
    assert softened > 3 and share.info["iterations"] != whole.info["iterations"]


def test_threads_do_not_matter_and_1_is_what_was():
    ends = [took(1, 0.5, 60, threads)[2].bodies.velocity for threads in (1, 3)]
    assert np.array_equal(*ends)
    plain = scratched(1, cn.NLGS(tol=1e-3, max_iter=200))
    for _ in range(60):
        plain.step()
    assert np.array_equal(plain.bodies.velocity, took(1, 1.0, 60)[2].bodies.velocity)


def test_a_share_that_is_none_is_refused():
    for wrong in (0.0, -0.5, 1.5, np.nan, np.inf):
        with pytest.raises(ValueError, match="softening_relaxation"):
            cn.NLGS(softening_relaxation=wrong)
    assert "take 0.5 of their change" in str(scratched(1, cn.NLGS(softening_relaxation=0.5)).explain())
