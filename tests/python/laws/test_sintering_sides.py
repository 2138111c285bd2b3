"""Contacts of bodies with sides that sinter: as strong as bonds that were there from the start, also of what turns."""

import cairn as cn
import numpy as np
import pytest

SIDE, DT, PRESS, PRESSED = 0.1, 1e-4, 400.0, 60  # [m], [s], [N], steps
TENSION, COHESION = 1e5, 3e5
ROCK = cn.Material("rock", density=1000.0)
AREA = {2: SIDE, 3: SIDE**2}
MADE = cn.MohrCoulomb(tension=TENSION, cohesion=COHESION, friction=0.5, mu=0.4)


def sintering(dim):
    dose = 0.3 * (PRESS / AREA[dim] - 1000.0) * PRESSED * DT
    return cn.Sintering(tension=TENSION, cohesion=COHESION, friction=0.5, mu=0.4, pressure=1000.0, dose=dose)


def block(dim, height, **options):
    at = np.array([0.0] * (dim - 1) + [height])
    if dim == 3:
        return cn.boxes([at], (SIDE, SIDE, SIDE), ROCK, **options)
    half = SIDE / 2
    return cn.polygons([np.array([(-half, -half), (half, -half), (half, half), (-half, half)]) + at], ROCK, **options)


def force(dim, pressed, later, until=1.0):
    """Along the last axis while it is pressed; then others, for a time, and none behind that."""
    t = DT * np.array([0, PRESSED, PRESSED + 1])
    loads = np.zeros((6, 3 * dim - 3))
    loads[:2, dim - 1] = pressed
    loads[2:4] = later
    return cn.Table([*t, t[2] + until, t[2] + until + DT, 10.0], loads)


def simulate(scene, law):
    scene.interact(ROCK, ROCK, law)
    return cn.Simulation(scene, DT, cn.NSCD(solver=cn.NLGS(tol=1e-10, max_iter=20000)), overlap="ignore")


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("share", [0.97, 1.03])
def test_blocks_that_were_pressed_bear_what_bonds_bear(dim, share):
    """Pulled by a share of tension times area: loose before, bonded at all points of the side, gone beyond the strength."""
    ends = []
    for law in (sintering(dim), MADE):
        scene, pull = cn.Scene(dim), np.zeros(3 * dim - 3)
        pull[dim - 1] = share * TENSION * AREA[dim]
        scene.add(block(dim, 0.0, driven=("vx", "vy", "w") if dim == 2 else ("vx", "vy", "vz", "wx", "wy", "wz")))
        scene.add(block(dim, SIDE, force=force(dim, -PRESS, pull)))
        sim = simulate(scene, law)
        for k in range(PRESSED + 40):
            assert sim.step()["status"] == "converged"
            if k == 0:
                assert (sim.contacts.beta > 0).any() == (law is MADE)
            if k == PRESSED - 1:
                assert (sim.contacts.beta > 0).sum() == 2 ** (dim - 1) and len(cn.post.fragments(sim)) == 1
        ends.append(sim.bodies.position[-1, dim - 1] - SIDE)
        assert len(cn.post.fragments(sim)) == (1 if share < 1 else 2)
        assert (abs(ends[-1]) < 1e-9 * SIDE) == (share < 1)
    assert ends[0] == pytest.approx(ends[1], rel=1e-6, abs=1e-9 * SIDE)


@pytest.mark.parametrize("dim", [2, 3])
def test_blocks_that_sintered_turn_as_one(dim):
    """Free ones, pressed on each other and then set spinning about their middle: more than half a turn on, no bond is lost."""
    mass = 1000.0 * SIDE**dim
    scene, spin = cn.Scene(dim), 500.0
    for height, sign in ((0.0, 1.0), (SIDE, -1.0)):
        later = np.zeros(3 * dim - 3)
        later[2 if dim == 2 else 4] = mass * SIDE**2 / 6 * spin
        later[0] = (sign if dim == 2 else -sign) * mass * spin * SIDE / 2
        scene.add(block(dim, height, force=force(dim, sign * PRESS, later, 200 * DT)))
    sim = simulate(scene, sintering(dim))
    for k in range(4000):
        sim.step()
        if k >= PRESSED:
            assert (sim.contacts.beta > 0).sum() == 2 ** (dim - 1)
    w = sim.bodies.velocity[:, 2 if dim == 2 else 4]
    assert w[0] == pytest.approx(10.0, rel=1e-2) and w[1] == pytest.approx(w[0], rel=1e-6)
    apart = sim.bodies.position[1] - sim.bodies.position[0]
    assert np.linalg.norm(apart) == pytest.approx(SIDE, rel=1e-5)
    turned = np.arctan2(apart[0], apart[-1]) % (2 * np.pi)
    assert (turned if dim == 3 else 2 * np.pi - turned) > np.pi
