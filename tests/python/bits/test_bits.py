"""The same bits from any number of threads, from a run in one piece and a run stopped and restarted, and from a run repeated."""

import os
import subprocess
import sys

import cairn as cn
import numpy as np
import pytest
from small_scenes import ROCK, SAND, differing, grid, heap, state

SLOW = cn.NLGS(tol=1e-5, max_iter=100)


def simulate(scene, dt=4e-3, **options):
    return cn.Simulation(scene, dt, cn.NSCD(solver=SLOW, **options), overlap="ignore")


def advance(sim, steps):
    for _ in range(steps):
        sim.step()
    return sim


# ---------------------------------------------------------------------- threads


@pytest.mark.parametrize("dim", [2, 3])
def test_threads(dim):
    """A scene of several tiles of contacts, detected, assembled and swept by 1, 2 and 4 threads."""
    scene = heap(dim, (64, 48) if dim == 2 else (13, 13, 12))
    results = []
    for threads in (1, 2, 4):
        sim = cn.Simulation(scene, 2e-2, cn.NSCD(solver=cn.NLGS(tol=1e-4, max_iter=20), threads=threads), overlap="ignore")
        advance(sim, 4)
        assert sim.info["contacts"] > 3000
        results.append((state(sim), sim.info["error"], sim.contacts.impulse.tobytes()))
    for other in results[1:]:
        assert not differing(results[0][0], other[0])
        assert results[0][1:] == other[1:]


# ---------------------------------------------------------------------- repeated and restarted


def bonded():
    scene = heap(2, (6, 4))
    ids = scene.add(cn.disks([[1.0 + 0.5 * k, 5.0] for k in range(6)], 0.25, SAND, group="chain"))
    scene.interact("chain", "chain", cn.Bonded(mu=0.3))
    assert len(ids) == 6
    return scene


def clumped():
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    centers = grid(3, (3, 3, 3))
    offsets = [[-0.1, 0.0, 0.0], [0.2, 0.05, 0.0]]
    rng = np.random.default_rng(2)
    scene.add(cn.clumps(centers, offsets, [0.3, 0.2], 1.0, [0.02, 0.05, 0.06], ROCK, velocity=rng.standard_normal((27, 6))))
    scene.add(cn.box((0, 0, 0), (3, 3, 3), ROCK, lid=False))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.5))
    return scene


def sheared():
    scene = cn.Scene(2, periodic=cn.Periodic((6.0, 4.0), shear_rate=2.0))
    scene.add(cn.disks(grid(2, (6, 4)), 0.48, ROCK, velocity=np.random.default_rng(3).standard_normal((24, 2))))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.4))
    return scene


def driven():
    return heap(2, push=cn.Table([0.0, 0.05, 0.2], [[0, 0], [1, 0], [-1, 0]]))


SCENES = {
    "disks": lambda: heap(2),
    "spheres": lambda: heap(3),
    "bonds": bonded,
    "clumps": clumped,
    "sheared cell": sheared,
    "driven by a table": driven,
}
OPTIONS = [{}, {"renumber_every": 7}, {"project_positions": True}, {"theta": 0.7}]


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("options", OPTIONS, ids=str)
def test_restarted(tmp_path, name, options):
    """Stopped after 25 of 50 steps, between renumberings, in a fresh simulation and in the old one gone on."""
    whole = advance(simulate(SCENES[name](), **options), 25)
    whole.checkpoint(tmp_path / "middle.h5")
    middle = state(whole)
    advance(whole, 25)
    assert whole.info["contacts"] > 10
    fresh = simulate(SCENES[name](), **options)
    fresh.restore(tmp_path / "middle.h5")
    assert not differing(middle, state(fresh))
    assert not differing(state(whole), state(advance(fresh, 25)))
    end = state(whole)
    whole.restore(tmp_path / "middle.h5")
    assert not differing(end, state(advance(whole, 25)))


@pytest.mark.parametrize("name", SCENES)
def test_repeated(name):
    assert not differing(*(state(advance(simulate(SCENES[name]()), 30)) for _ in range(2)))


def test_states_can_differ():
    a, b = (advance(simulate(heap(2)), 30) for _ in range(2))
    velocity = b.bodies.velocity.copy()
    velocity[3, 0] = np.nextafter(velocity[3, 0], 1)
    b.bodies.set(velocity=velocity)
    assert differing(state(a), state(b)) == ["/scene/bodies/velocity"]


# ---------------------------------------------------------------------- changes between steps


def change(sim, at):
    """Changes made in the run after step `at`."""
    if at == 8:
        sim.add(cn.disks([[2.0, 8.0], [5.0, 8.0]], 0.4, cn.Material("late", density=500.0), group="late", force=(3.0, -1.0)))
        sim.add(cn.wall((4.0, 20.0), (0, -1), SAND, velocity=cn.Table([0, 1], [[0, -10], [0, -10]])))
    if at == 12:
        sim.remove([3, 17, 18])
        sim.dt = 2e-3
    if at == 16:
        sim.drive([5], "w", (0, 0, 4.0))
        sim.interact("late", "*", cn.Restitution(mu=0.2, normal=0.5))
    if at == 22:
        sim.add(cn.disks([[3.0, 9.5]], 0.3, ROCK, damping=0.5))


@pytest.mark.parametrize("stop", [5, 10, 14, 19, 25])
@pytest.mark.parametrize("renumber_every", [6, 200])
def test_restarted_with_insertion_removal_and_changing_step(tmp_path, stop, renumber_every):
    whole = simulate(heap(2), renumber_every=renumber_every)
    for k in range(30):
        change(whole, k)
        whole.step(None if k % 5 else 3e-3)
        if k == stop:
            whole.checkpoint(tmp_path / "middle.h5")
    fresh = simulate(heap(2), renumber_every=renumber_every)
    fresh.restore(tmp_path / "middle.h5")
    for k in range(stop + 1, 30):
        change(fresh, k)
        fresh.step(None if k % 5 else 3e-3)
    assert not differing(state(whole), state(fresh))
    assert np.array_equal(whole.bodies.id, fresh.bodies.id)
    assert np.array_equal(whole.contacts.impulse, fresh.contacts.impulse)


def test_python_functions_of_later_bodies_are_asked_for(tmp_path):
    sim = simulate(heap(2))
    late = cn.disks([[2.0, 8.0]], 0.4, ROCK, force=lambda t: (t, 0.0))
    sim.add(late)
    advance(sim, 5).checkpoint(tmp_path / "a.h5")
    fresh = simulate(heap(2))
    with pytest.raises(cn.FileError, match="force of bodies that came in later is a Python function.*Simulation.add before"):
        fresh.restore(tmp_path / "a.h5")
    assert fresh.steps == 0
    fresh.add(late)
    fresh.restore(tmp_path / "a.h5")
    assert not differing(state(advance(sim, 5)), state(advance(fresh, 5)))


def test_a_checkpoint_of_another_scene_is_refused(tmp_path):
    advance(simulate(heap(2)), 3).checkpoint(tmp_path / "a.h5")
    for scene in (heap(3), heap(2, (8, 5))):
        sim = simulate(scene)
        before = state(sim)
        with pytest.raises(cn.FileError, match="the checkpoint belongs to another scene; build the simulation from the same"):
            sim.restore(tmp_path / "a.h5")
        assert not differing(before, state(sim))


# ---------------------------------------------------------------------- another process

PROCESS = """
import sys
import numpy as np
sys.path[:0] = [sys.argv[1]]
from test_bits import SCENES, advance, simulate
sim = simulate(SCENES[sys.argv[2]](), renumber_every=9)
if sys.argv[3] != "-":
    sim.restore(sys.argv[3])
advance(sim, int(sys.argv[4]))
sim.checkpoint(sys.argv[5])
"""


@pytest.mark.parametrize("name", ["disks", "bonds", "clumps"])
def test_restarted_in_another_process(tmp_path, name):
    from cairn.files import checkpoint

    def run(start, steps, end):
        arguments = [os.path.dirname(__file__), name, start, str(steps), tmp_path / end]
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
        subprocess.run([sys.executable, "-c", PROCESS, *map(str, arguments)], check=True, env=environment)

    run("-", 40, "whole.h5")
    run("-", 17, "middle.h5")
    run(tmp_path / "middle.h5", 23, "parts.h5")
    whole, parts = (checkpoint.load(tmp_path / end) for end in ("whole.h5", "parts.h5"))
    assert not differing(*(flat(content["state"]) for content in (whole, parts)))


def flat(content, name=""):
    if not isinstance(content, dict):
        return {name: np.asarray(content).tobytes()}
    return {k: v for key, inner in content.items() for k, v in flat(inner, f"{name}/{key}").items()}
