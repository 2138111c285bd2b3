"""Joints over ranks: the same bits for every number of ranks, the motion and the energy of a run without."""


import cairn as cn
import numpy as np
import pytest
from over_mpi import digest_of

ROCK = cn.Material("rock", density=2600.0)
SHARP = cn.NSCD(solver=cn.NLGS(tol=1e-8, max_iter=5000))
LOOSE = cn.NSCD(solver=cn.NLGS(tol=1e-5, max_iter=400))


def box(dim, centre, half):
    if dim == 2:
        signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
        return cn.polygons(centre + half * signs, ROCK)
    corner = np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)], float)
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return cn.polyhedra((centre + corner * half, faces), ROCK)


def grains_and_a_chain(dim, *, limits=None):
    """A chain of boxes that hangs at one end swings through grains on a floor."""
    scene = cn.Scene(dim=dim, gravity=(0.0,) * (dim - 1) + (-9.81,))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.4))
    n = {2: 7, 3: 4}[dim]
    rng = np.random.default_rng(1)
    x = np.stack(np.meshgrid(*[np.arange(n)] * (dim - 1), np.arange(2), indexing="ij"), -1).reshape(-1, dim) * 0.5
    x = x + 0.26 + rng.uniform(-0.01, 0.01, x.shape)
    scene.add((cn.disks if dim == 2 else cn.spheres)(x, rng.uniform(0.2, 0.24, len(x)), ROCK))
    scene.add(cn.wall(np.zeros(dim), np.eye(dim)[-1], ROCK))
    up = np.eye(dim)[-1]
    along, start = np.eye(dim)[0], 0.5 * np.eye(dim)[1] * (dim - 2) + 1.4 * up
    bars = [scene.add(box(dim, (0.3 + 0.55 * k) * along + start, 0.2))[0] for k in range(4)]
    ends = [(0.55 * k + 0.025) * along + start for k in range(4)]
    joint = (lambda at: cn.Pivot(point=at, limits=limits)) if dim == 2 else (lambda at: cn.Ball(point=at))
    scene.join(bars[0], None, joint(ends[0]))
    for k in range(3):
        scene.join(bars[k], bars[k + 1], joint(ends[k + 1]))
    return scene


def run(scene, ranks, steps, strategy=LOOSE, dt=2e-3, sim=None):
    sim = sim or cn.Simulation(scene(), dt=dt, strategy=strategy, overlap="ignore", ranks=ranks)
    for _ in range(steps):
        sim.step()
    return sim


def digest(sim):
    state = [sim.bodies.position, sim.bodies.rotation, sim.bodies.velocity, sim.contacts.key, sim.contacts.impulse]
    state.append(np.array(list(sim.energy.values())))
    return digest_of(state)


SCENES = [lambda: grains_and_a_chain(2), lambda: grains_and_a_chain(3), lambda: grains_and_a_chain(2, limits=(-0.3, 0.3))]


@pytest.mark.parametrize("scene", SCENES, ids=["plane", "space", "limits"])
def test_the_same_bits_for_every_number_of_ranks(scene, tmp_path):
    whole = run(scene, 1, 120)
    assert {digest(run(scene, ranks, 120)) for ranks in (2, 4, 7)} == {digest(whole)}
    sim, path = run(scene, 3, 40), tmp_path / "chain.checkpoint.h5"
    for ranks in (5, 2):
        sim.checkpoint(path)
        sim = run(scene, ranks, 0)
        sim.restore(path)
        run(scene, ranks, 40, sim=sim)
    assert digest(sim) == digest(whole)


@pytest.mark.parametrize("scene", SCENES, ids=["plane", "space", "limits"])
def test_the_motion_is_that_without_ranks(scene):
    alone, over = run(scene, None, 60, SHARP), run(scene, 3, 60, SHARP)
    scale = np.abs(alone.bodies.velocity).max()
    assert np.abs(alone.bodies.position - over.bodies.position).max() < 1e-4 * 0.2
    assert np.abs(alone.bodies.velocity - over.bodies.velocity).max() < 1e-2 * scale
    assert abs(over.energy["closure"]) < 1e-9 * over.energy["in_play"]


@pytest.mark.filterwarnings("ignore::cairn.JointWarning", "ignore::cairn.EnergyCreatedWarning")
def test_the_drift_of_joints_is_told_over_ranks():
    def pendulum():
        scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
        ball = scene.add(cn.disks([(1.0, 0.0)], 0.1, ROCK, velocity=[(0.0, 30.0)]))[0]
        scene.join(ball, None, cn.Pivot(point=(0.0, 0.0)))
        return scene

    alone, *over = [run(pendulum, ranks, 3, SHARP, 5e-2).info for ranks in (None, 1, 3)]
    assert alone["joint_gap"] > 1e-6 and alone["joint_contact"] == 0
    for info in over:
        assert info["joint_gap"] == over[0]["joint_gap"] == pytest.approx(alone["joint_gap"], rel=1e-6)
        assert info["joint_error"] == over[0]["joint_error"] == pytest.approx(alone["joint_error"], rel=1e-6)
        assert info["joint_contact"] == -1  # the rank that has the joints counts them in an order of its own


def test_bodies_of_joints_are_on_one_rank():
    sim = run(SCENES[0], 4, 1)
    assert len(set(sim.ranks.owner[15:19])) == 1 and len(set(sim.ranks.owner)) == 4


def test_ropes_over_pulleys_say_that_they_do_not_run():
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.interact("*", "*", None)
    ids = scene.add(cn.disks([(-0.5, 0.0), (0.0, 1.0), (0.5, 0.0)], 0.1, ROCK))
    scene.join(ids[0], ids[2], cn.Cable(points=[(-0.5, 0.0), (0.0, 1.0), (0.5, 0.0)], pulley=ids[1]))
    with pytest.raises(ValueError, match="pulleys, which does not run over ranks"):
        cn.Simulation(scene, dt=1e-3, ranks=2)
