"""The state of bodies over ranks: within a run it stays with its ranks until somebody reads it."""

import cairn as cn
import numpy as np
import pytest
import test_ranks as scenes
import test_smooth_ranks as smooth
from cairn.run.views import core_of
from test_mpi import here, started, text
from test_mpi import pytestmark as needs_mpi

SWEEPS = cn.NSCD(solver=cn.NLGS(tol=1e-4, max_iter=100))
STATE = ("position", "velocity", "rotation", "mass", "inertia", "reaction", "angular_momentum", "driven_velocity")


def made(scene, ranks, strategy=SWEEPS, dt=4e-3):
    return cn.Simulation(scene(), dt=dt, strategy=strategy, overlap="ignore", ranks=ranks)


def all_of(sim):
    return {name: np.array(getattr(sim.bodies, name)) for name in STATE if name in sim.bodies.names}


def same(one, other):
    first, second = all_of(one), all_of(other)
    return first.keys() == second.keys() and all(np.array_equal(first[k], second[k]) for k in first)


@pytest.mark.parametrize("scene", scenes.SCENES)
@pytest.mark.parametrize("ranks", [1, 2, 3, 7])
def test_a_run_ends_where_single_steps_do(scene, ranks):
    by_steps, in_one = made(scene, ranks), made(scene, ranks)
    for _ in range(24):
        by_steps.step()
    before = in_one.ranks.figures()["gathers"]
    in_one.run(24, progress=False)
    assert same(by_steps, in_one) and np.array_equal(by_steps.contacts.impulse, in_one.contacts.impulse)
    assert by_steps.energy == in_one.energy
    figures = in_one.ranks.figures()
    assert figures["gathers"] - before < 8 + figures["partitions"]  # the look for fast bodies reads it too
    assert by_steps.ranks.figures()["gathers"] >= 24
    by_steps.step()
    in_one.step()
    assert same(by_steps, in_one)


@pytest.mark.parametrize("ranks", [1, 3])
def test_what_reads_the_state_within_a_run_finds_it(ranks, tmp_path):
    """Callbacks, conditions, probes of both kinds, outputs and checkpoints."""
    by_steps, in_one, seen, heights = made(scenes.pushed, ranks), made(scenes.pushed, ranks), [], []

    def look(sim):
        if sim.steps % 5 == 0:
            seen.append(np.array(sim.bodies.position))

    probes = {"top": cn.Probe("position.y", take="max"), "mean": lambda sim: float(np.mean(sim.bodies.velocity[:, 1]))}
    in_one.run(20, output=tmp_path / "run.vtkhdf", every=10, checkpoint_every=15, callback=look, probes=probes, progress=False,
               while_=lambda sim: sim.bodies.position[0, 1] > -1.0)  # fmt: skip
    run = cn.load(tmp_path / "run.vtkhdf")
    for k in range(1, 21):
        by_steps.step()
        heights.append(by_steps.bodies.position[:, 1].max())
        if k % 5 == 0:
            assert np.array_equal(seen[k // 5 - 1], by_steps.bodies.position)
        if k % 10 == 0:
            assert np.array_equal(run[k // 10].bodies.position, by_steps.bodies.position)
        if k == 15:
            state = all_of(by_steps)
    assert np.array_equal(np.asarray(run.history["top"])[-20:], heights)
    again = made(scenes.pushed, 2)
    again.restore(tmp_path / "run.checkpoint.h5")
    assert all(np.array_equal(values, getattr(again.bodies, name)) for name, values in state.items())
    again.run(5, progress=False)
    assert same(again, by_steps)


def test_bodies_come_go_and_are_set_within_a_run():
    def change(sim):
        if sim.steps == 4:
            sim.add(cn.disks([(4.0, 12.0)], 0.4, scenes.ROCK))
        if sim.steps == 8:
            sim.remove([3])
        if sim.steps == 12:
            sim.bodies.set(velocity=0.5 * sim.bodies.velocity)

    sims = [made(scenes.disks, ranks) for ranks in (1, 4, 4)]
    for sim in sims[:2]:
        sim.run(16, callback=change, progress=False)
    for _ in range(16):
        sims[2].step()
        change(sims[2])
    assert same(sims[0], sims[1]) and same(sims[0], sims[2])


@pytest.mark.parametrize("ranks", [1, 4])
def test_smooth_runs_leave_the_state_too(ranks):
    strategy, dt = cn.SmoothDEM(energy=False), 1e-4
    by_steps, in_one = (made(lambda: smooth.scene(3), ranks, strategy, dt) for _ in range(2))
    for _ in range(30):
        by_steps.step()
    with in_one.ranks.leaving_state():  # without the look for fast bodies, which reads that of few bodies in each step
        for _ in range(30):
            core_of(in_one).step(in_one.ready())
    assert same(by_steps, in_one) and np.array_equal(by_steps.bodies.contact_force, in_one.bodies.contact_force)
    assert in_one.ranks.figures()["gathers"] < 10
    in_one.run(5, progress=False)
    by_steps.run(5, progress=False)
    assert same(by_steps, in_one)


@pytest.mark.parametrize("strategy", [SWEEPS, cn.SmoothDEM(energy=False)])
@pytest.mark.filterwarnings("ignore:no law is declared")
def test_a_step_that_fails_within_a_run_is_undone(strategy):
    """No law is between the materials of two bodies that meet after some steps."""
    other = cn.Material("other", density=1000.0)

    def scene():
        made = cn.Scene(dim=2, gravity=(0.0, -9.81))
        law = cn.Coulomb(mu=0.4) if strategy is SWEEPS else cn.LinearSpring(stiffness=1e7, restitution=0.5, mu=0.4)
        for pair in ((scenes.ROCK, scenes.ROCK), (other, other)):
            made.interact(*pair, law)
        x = np.stack(np.meshgrid(np.arange(6), np.arange(5)), -1).reshape(-1, 2) * 1.0
        made.add(cn.disks(x, 0.45, scenes.ROCK))
        made.add(cn.disks([(2.05, 5.2), (4.0, 8.0)], 0.45, other, velocity=(0.0, -20.0)))
        return made

    sims = [made(scene, ranks, strategy, 1e-3) for ranks in (1, 3)]
    steps = []
    for sim in sims:
        with pytest.raises(cn.Error, match="no law"), sim.ranks.leaving_state():
            for _ in range(200):
                core_of(sim).step(sim.ready())
        steps.append(sim.steps)
    assert steps[0] == steps[1] > 2 and same(*sims)
    by_steps = made(scene, 3, strategy, 1e-3)
    for _ in range(steps[0]):
        by_steps.step()
    assert same(by_steps, sims[1])


def test_memory_of_a_rank_follows_its_share_within_a_run():
    rng = np.random.default_rng(2)
    x = np.stack(np.meshgrid(*[np.arange(13)] * 3, indexing="ij"), -1).reshape(-1, 3) * 0.98
    x += rng.uniform(-0.01, 0.01, x.shape)

    def scene():
        made = scenes.new(3)
        made.add(cn.spheres(x, 0.48, scenes.ROCK))
        return scenes.closed(made, 13.5)

    sim, held = made(scene, 8), []

    def look(sim):
        core = core_of(sim)
        held.append((sum(core.bytes()) - sim.ranks.held_bytes.sum()) / len(x))

    for _ in range(2):  # the first one looks at shapes
        sim.step()
    look(sim)
    sim.run(4, callback=look, progress=False)
    assert held[0] < 320  # bytes of the whole for each body
    assert held[-1] < 60
    assert sim.bodies.position.shape == (len(x) + 5, 3) and np.isfinite(sim.bodies.velocity).all()


def test_what_a_step_works_with_is_read_from_the_ranks():
    one, three = made(scenes.spheres, 1), made(scenes.spheres, 3)
    for sim in (one, three):
        sim.run(3, progress=False)
    assert np.array_equal(one.bodies.velocity_free, three.bodies.velocity_free)
    assert np.abs(one.bodies.velocity_free).max() > 0
    assert np.array_equal(one.bodies.velocity_begin, three.bodies.velocity_begin)


@needs_mpi
def test_one_process_reads_the_state_alone(tmp_path):
    more = """
seen = []
def look(sim):
    if sim.ranks.rank == 1 and sim.steps in (3, 7):
        seen.append(sim.bodies.position.copy())
mean = {"mean": lambda sim: float(sim.bodies.position.mean())}  # which rank 0 alone calls
sim.run(10, callback=look, probes=mean, output="seen.vtkhdf", every=4, checkpoint_every=5, progress=False)
if sim.ranks.rank == 1:
    np.savez("seen.npz", third=seen[0], seventh=seen[1], end=sim.bodies.position, gathers=sim.ranks.figures()["gathers"])
"""
    started(tmp_path, text("mpi", more))
    seen, sim = np.load(tmp_path / "seen.npz"), here(0)
    for name, steps in (("third", 3), ("seventh", 4), ("end", 3)):
        sim.run(steps, progress=False)
        assert np.array_equal(seen[name], sim.bodies.position)
    means = np.asarray(cn.load(tmp_path / "seen.vtkhdf").history["mean"])
    assert len(means) == 10 and means[-1] == sim.bodies.position.mean()


@pytest.mark.parametrize("ranks", [None, 1, 3])
def test_bodies_that_pass_each_other_are_told_over_ranks(ranks):
    def scene():
        made = scenes.new(2)
        x = np.array([(0.0, 0.0), (0.25, 0.0), (30.0, 30.0), (40.0, 40.0), (50.0, 30.0)])
        made.add(cn.disks(x, 0.05, scenes.ROCK, velocity=np.array([(100.0, 0.0)] + 4 * [(0.0, 0.0)])))
        return made

    sim = made(scene, ranks, dt=1e-2)
    with pytest.warns(cn.TunnellingWarning, match="body 0 passed through body 1"):
        sim.step()
