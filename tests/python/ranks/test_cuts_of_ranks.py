"""New cuts and new orders of bodies within runs that nobody reads: rows go from rank to rank, to the bits of one rank."""

import json

import cairn as cn
import numpy as np
import pytest
import test_ranks as scenes
from cairn.run.views import core_of
from over_mpi import needs_mpi, started, text

OFTEN = cn.NSCD(solver=cn.NLGS(tol=1e-4, max_iter=60), renumber_every=7)
SMOOTH = cn.SmoothDEM(energy=False, renumber_every=5)


def stirred(dim=2, law=None):
    """Balls that fly through each other's places, so that ghosts are sought anew every few steps."""
    rng = np.random.default_rng(4)
    side = 9 if dim == 2 else 5
    x = np.stack(np.meshgrid(*[np.arange(side)] * dim, indexing="ij"), -1).reshape(-1, dim) * 1.3 + 0.7
    scene = cn.Scene(dim=dim, gravity=(0.0,) * (dim - 1) + (-9.81,))
    scene.interact(scenes.ROCK, scenes.ROCK, law or cn.Coulomb(mu=0.4))
    velocity = np.zeros((len(x), 3 * dim - 3))
    velocity[:, :dim] = rng.normal(0, 12.0, (len(x), dim))
    velocity[:, dim:] = rng.normal(0, 3.0, (len(x), 2 * dim - 3))
    scene.add((cn.disks if dim == 2 else cn.spheres)(x, rng.uniform(0.3, 0.5, len(x)), scenes.ROCK, velocity=velocity))
    for axis in range(dim):
        normal = np.eye(dim)[axis]
        scene.add(cn.wall(np.zeros(dim), normal, scenes.ROCK), cn.wall((1.3 * side + 0.2) * normal, -normal, scenes.ROCK))
    return scene


def boxes():
    """Turning boxes and driven plates, with forces and angular momenta of their own."""
    scene = cn.Scene(dim=3, gravity=(0.0, 0.0, -9.81))
    scene.interact(scenes.ROCK, scenes.ROCK, cn.Coulomb(mu=0.3))
    x = np.stack(np.meshgrid(np.arange(4), np.arange(4), np.arange(3), indexing="ij"), -1).reshape(-1, 3) * 1.5 + 1.0
    rng = np.random.default_rng(6)
    velocity = np.concatenate([rng.normal(0, 4.0, (len(x), 3)), rng.normal(0, 2.0, (len(x), 3))], axis=1)
    scene.add(cn.boxes(x, [1.0, 0.6, 0.8], scenes.ROCK, velocity=velocity, force=np.tile([3e3, 0, 0, 0, 0, 50.0], (len(x), 1))))
    scene.add(cn.wall((0, 0, 0), (0, 0, 1), scenes.ROCK))
    return scene


CASES = {
    "disks": (stirred, OFTEN, 4e-3, 60),
    "spheres": (lambda: stirred(3), OFTEN, 4e-3, 60),
    "boxes": (boxes, OFTEN, 4e-3, 40),
    "bonds": (lambda: stirred(2, cn.Bonded(mu=0.4)), OFTEN, 4e-3, 40),
    "smooth": (lambda: stirred(3, cn.LinearSpring(stiffness=1e7, restitution=0.5, mu=0.4)), SMOOTH, 1e-4, 60),
}


def made(name, ranks):
    scene, strategy, dt, _ = CASES[name]
    return cn.Simulation(scene(), dt, strategy, overlap="ignore", ranks=ranks)


def state_of(sim):
    names = ("position", "rotation", "velocity", "mass", "inertia", "angular_momentum", "force", "contact_force")
    return {name: np.array(getattr(sim.bodies, name)) for name in names if name in sim.bodies.names}


def unread(sim, steps):
    """Makes steps of which nobody reads the state."""
    with sim.ranks.leaving_state():
        for _ in range(steps):
            core_of(sim).step(sim.ready())


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("ranks", [2, 5])
def test_new_cuts_that_nobody_reads_have_the_bits_of_one_rank(name, ranks):
    steps = CASES[name][3]
    one, some = made(name, 1), made(name, ranks)
    for _ in range(steps):
        one.step()
    unread(some, steps)
    figures = some.ranks.figures()
    assert figures["partitions"] >= 5 and figures["gathers"] <= 1  # that of the end: no cut gathered the state of all
    first, second = state_of(one), state_of(some)
    assert first.keys() == second.keys()
    for key, values in first.items():
        assert np.array_equal(values, second[key]), key
    assert np.array_equal(one.contacts.impulse, some.contacts.impulse) and np.array_equal(one.contacts.key, some.contacts.key)
    one.step()
    some.step()
    assert np.array_equal(one.bodies.velocity, some.bodies.velocity)


def test_changes_between_unread_steps_reach_new_cuts():
    """Bodies that come, go, are set or driven between cuts that gather nothing."""
    sims = [made("disks", 1), made("disks", 4)]
    for sim in sims:
        unread(sim, 9)
        sim.remove([3, 17])
        unread(sim, 9)
        sim.add(cn.disks([(5.0, 20.0)], 0.4, scenes.ROCK, velocity=(0.0, -30.0)))
        unread(sim, 9)
        sim.drive([5], "vx", 2.0)
        unread(sim, 9)
        sim.bodies.set(velocity=0.9 * sim.bodies.velocity)
        unread(sim, 9)
    first, second = map(state_of, sims)
    assert all(np.array_equal(first[name], second[name]) for name in first)


def test_memory_of_a_run_is_that_of_the_share_from_its_first_step():
    scene = cn.Scene(dim=3, gravity=(0.0, 0.0, -9.81))
    scene.interact(scenes.ROCK, scenes.ROCK, cn.Coulomb(mu=0.4))
    x = np.stack(np.meshgrid(*[np.arange(16)] * 3, indexing="ij"), -1).reshape(-1, 3) * 0.98
    scene.add(cn.spheres(x, 0.48, scenes.ROCK), cn.wall((0, 0, -0.6), (0, 0, 1), scenes.ROCK))
    sim, held = cn.Simulation(scene, 1e-3, OFTEN, overlap="ignore", ranks=8), []

    def look(sim):
        held.append((sum(core_of(sim).bytes()) - sim.ranks.held_bytes.sum()) / len(x))

    sim.run(16, callback=look, progress=False)
    assert max(held) < 60  # bytes of the whole for each body, over two new orders
    assert sim.ranks.figures()["gathers"] <= 1


@needs_mpi
@pytest.mark.parametrize("processes", [2, 3])
def test_processes_cut_as_ranks_in_turns_do(tmp_path, processes):
    more = """
import json
from cairn.run.views import core_of
sim.strategy = cn.NSCD(solver=cn.NLGS(tol=1e-3, max_iter=20), renumber_every=4)
sim.bodies.set(velocity=np.random.default_rng(7).normal(0, 9.0, (66, 3)) * (sim.bodies.mass < np.inf)[:, None])
with sim.ranks.leaving_state():
    for _ in range(16):
        core_of(sim).step(sim.ready())
gathers = sim.ranks.figures()["gathers"]
np.savez(f"{sim.ranks.rank}.npz", x=sim.bodies.position, v=sim.bodies.velocity)
json.dump({**sim.ranks.figures(), "before": gathers}, open(f"{sim.ranks.rank}.json", "w"))
"""
    started(tmp_path, text("mpi", more), processes)
    names = {}
    exec(text(1, more.split("np.savez")[0]), names)
    here = names["sim"]
    for rank in range(processes):
        end, figures = np.load(tmp_path / f"{rank}.npz"), json.loads((tmp_path / f"{rank}.json").read_text())
        assert np.array_equal(end["x"], here.bodies.position) and np.array_equal(end["v"], here.bodies.velocity)
        assert figures["partitions"] > 3 and figures["before"] <= 3  # of what was set and of the end, and of no cut
