"""Contacts that sinter: pressure over time makes bonds, which hold as those that bodies come in with."""

import cairn as cn
import numpy as np
import pytest

R, DT, PRESS = 0.05, 1e-4, 400.0  # of each column [N]
ROCK = cn.Material("rock", density=1000.0)
AREA = {2: R / 2, 3: np.pi * (R / 2) ** 2}
PRESSED = 40  # steps


def compact(dim, pull, law=None, dose=0.5):
    """Three columns of four grains on grains that do not move; a force on the upper ones presses them, then pulls."""
    x = 2 * R * np.stack(np.meshgrid(1.01 * np.arange(3), np.arange(4), indexing="ij"), -1).reshape(-1, 2)
    top, foot = x[:, 1] > 5.9 * R, x[:, 1] < 0.1 * R
    if dim == 3:
        x = np.column_stack([x[:, 0], np.zeros(12), x[:, 1]])
    grains = cn.disks if dim == 2 else cn.spheres
    still = ("vx", "vy", "w") if dim == 2 else ("vx", "vy", "vz", "wx", "wy", "wz")
    begin, end = PRESSED * DT, (PRESSED + 1) * DT
    loads = np.zeros((4, 3 * dim - 3))
    loads[:, dim - 1] = [-PRESS, -PRESS, pull, pull]
    scene = cn.Scene(dim)
    scene.add(grains(x[foot], R, ROCK, driven=still), grains(x[~foot & ~top], R, ROCK))
    scene.add(grains(x[top], R, ROCK, force=cn.Table([0.0, begin, end, 1.0], loads)))
    strength = dict(tension=1e5, cohesion=3e5, friction=0.5, mu=0.4)
    beyond = PRESS / AREA[dim] - 1000.0  # of its threshold
    scene.interact(ROCK, ROCK, law or cn.Sintering(**strength, pressure=1000.0, dose=dose * beyond * PRESSED * DT))
    return cn.Simulation(scene, DT, cn.NSCD(solver=cn.NLGS(tol=1e-10, max_iter=20000)), overlap="ignore")


@pytest.mark.parametrize("dim", [2, 3])
def test_a_compact_that_was_pressed_is_as_strong_as_its_bonds(dim):
    """Before, grains are loose; half the time of pressing makes a bond of each contact that was pressed; columns then have the
    strength of initial bonds."""
    made = cn.MohrCoulomb(tension=1e5, cohesion=3e5, friction=0.5, mu=0.4)
    for share, holds in ((0.97, True), (1.03, False)):
        ends = []
        for law in (None, made):
            sim = compact(dim, share * 1e5 * AREA[dim], law)
            for k in range(PRESSED + 30):
                assert sim.step()["status"] == "converged"
                if law is None and k in (PRESSED // 2 - 2, PRESSED - 1):
                    bonds = int((sim.contacts.beta > 0).sum())
                    assert bonds == (0 if k < PRESSED // 2 else 9)
                    assert len(cn.post.fragments(sim)) == (12 if bonds == 0 else 3)
            ends.append(sim.bodies.position[-1, dim - 1] - 6 * R)
            assert abs(sim.info["energy"]["closure"]) <= 1e-10 * sim.info["energy"]["in_play"]
            assert sim.info["energy"]["released"] == 0 and sim.info["energy"]["stored"] == 0
        for end in ends:
            assert (abs(end) < 1e-9 * R) == holds
        assert ends[0] == pytest.approx(ends[1], rel=1e-6, abs=1e-9 * R)


def test_less_than_its_dose_makes_no_bond():
    sim = compact(2, 10.0, dose=1.1)
    for _ in range(PRESSED + 20):
        sim.step()
    assert not (sim.contacts.beta > 0).any() and sim.bodies.position[-1, 1] > 6 * R + 1e-6


def test_a_restart_goes_on_with_the_dose(tmp_path):
    once, half, again = (compact(3, 0.5e5 * AREA[3]) for _ in range(3))
    for k in range(PRESSED + 10):
        once.step()
        if k < PRESSED // 2 - 3:
            half.step()
    half.checkpoint(tmp_path / "half.h5")
    again.restore(tmp_path / "half.h5")
    for _ in range(PRESSED + 10 - (PRESSED // 2 - 3)):
        again.step()
    assert np.array_equal(again.bodies.position, once.bodies.position)
    assert np.array_equal(again.contacts.beta, once.contacts.beta) and (once.contacts.beta > 0).sum() == 9
