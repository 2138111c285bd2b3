"""Scenes from files that ranks share: their arrays stay in the file, and runs have the bits of a scene in memory."""

import cairn as cn
import numpy as np
import pytest
import test_ranks as scenes
from over_mpi import needs_mpi, started

SWEEPS = cn.NSCD(solver=cn.NLGS(tol=1e-4, max_iter=100))


def many_disks(n=92):
    """So many that their arrays are large enough to stay in the file."""
    rng = np.random.default_rng(5)
    x = np.stack(np.meshgrid(np.arange(n), np.arange(n)), -1).reshape(-1, 2) * 0.97 + 0.6
    scene = cn.Scene(dim=2, gravity=(-2.0, -9.81))
    scene.interact(scenes.ROCK, scenes.ROCK, cn.Coulomb(mu=0.4))
    velocity = rng.normal(0, 0.1, (n * n, 3))
    scene.add(cn.disks(x, rng.uniform(0.44, 0.48, n * n), scenes.ROCK, velocity=velocity, damping=rng.uniform(0, 1, n * n)))
    scene.add(cn.wall((0, 0), (0, 1), scenes.ROCK), cn.wall((0, 0), (1, 0), scenes.ROCK))
    return scene


def stepped(scene, ranks, steps=3):
    sim = cn.Simulation(scene, 4e-3, SWEEPS, overlap="ignore", ranks=ranks)
    sim.run(steps, progress=False)
    return sim


def in_file(array):
    while isinstance(array, np.ndarray):
        array = array.base
    return type(array).__name__ == "PyCapsule"


@pytest.mark.parametrize("ranks", [1, 3])
def test_large_arrays_stay_in_the_file(tmp_path, ranks):
    path, given = tmp_path / "pile.scene.h5", many_disks()
    given.save(path)
    whole, scene = cn.Scene.load(path), cn.Scene.load(path, ranks=ranks)
    s = scene.sets[0]
    assert all(in_file(a) for a in (s.position, s.velocity, s.mass, s.inertia, s.contactors[0].radius))
    assert in_file(s.with_(ids=s.ids).velocity) and not in_file(whole.sets[0].velocity)
    with pytest.raises(ValueError, match="read-only"):
        s.velocity[0] = 0.0
    cn.Scene(dim=2).save(path)  # another file of that name changes nothing
    assert np.array_equal(s.position, whole.sets[0].position) and np.array_equal(s.velocity, given.sets[0].velocity)
    sims = [stepped(whole, ranks), stepped(scene, None), stepped(given, ranks)]
    assert sims[1].ranks.count == ranks  # of the scene
    for sim in sims[1:]:
        assert np.array_equal(sim.bodies.position, sims[0].bodies.position)
        assert np.array_equal(sim.bodies.velocity, sims[0].bodies.velocity)


def test_a_run_leaves_the_state_with_its_ranks_until_it_is_read(tmp_path):
    path, given = tmp_path / "pile.scene.h5", many_disks()
    given.save(path)
    here, there = stepped(given, 3), stepped(cn.Scene.load(path, ranks=3), None)
    gathers = there.ranks.figures()["gathers"]
    assert here.ranks.figures()["gathers"] == gathers + 1
    assert np.array_equal(here.bodies.position, there.bodies.position)
    assert there.ranks.figures()["gathers"] == gathers + 1
    here.step(), there.step()
    assert np.array_equal(here.bodies.velocity, there.bodies.velocity)


@pytest.mark.parametrize("scene", [s for s in scenes.SCENES if s is not scenes.pushed])  # pushed by a Python function
def test_scenes_of_all_shapes_have_the_same_bits(tmp_path, scene):
    path, given = tmp_path / "any.scene.h5", scene()
    given.save(path)
    here, there = stepped(given, 3), stepped(cn.Scene.load(path, ranks=3), None)
    assert np.array_equal(here.bodies.position, there.bodies.position)
    assert np.array_equal(here.contacts.impulse, there.contacts.impulse)


def test_a_file_that_is_damaged_or_no_ranks_are_refused(tmp_path):
    path = tmp_path / "pile.scene.h5"
    many_disks().save(path)
    with pytest.raises(ValueError, match="ranks is 'some': give a number"):
        cn.Scene.load(path, ranks="some")
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1  # within an array that stays in the file
    path.write_bytes(bytes(content))
    with pytest.raises(cn.FileError, match="checksum"):
        cn.Scene.load(path, ranks=2)


@needs_mpi
def test_processes_share_a_file(tmp_path):
    many_disks().save(tmp_path / "pile.scene.h5")
    script = """
import cairn as cn, numpy as np
scene = cn.Scene.load("pile.scene.h5", ranks="mpi")
sim = cn.Simulation(scene, 4e-3, cn.NSCD(solver=cn.NLGS(tol=1e-4, max_iter=100)), overlap="ignore")
sim.run(3, progress=False)
np.savez(f"{sim.ranks.rank}.npz", x=sim.bodies.position, count=sim.ranks.count)
"""
    started(tmp_path, script)
    here = stepped(many_disks(), 1)
    for rank in (0, 1):
        end = np.load(tmp_path / f"{rank}.npz")
        assert end["count"] == 2 and np.array_equal(end["x"], here.bodies.position)


@needs_mpi
def test_one_process_alone_reads_the_end_of_a_run(tmp_path):
    many_disks().save(tmp_path / "pile.scene.h5")
    script = """
import cairn as cn, numpy as np
scene = cn.Scene.load("pile.scene.h5", ranks="mpi")
sim = cn.Simulation(scene, 4e-3, cn.NSCD(solver=cn.NLGS(tol=1e-4, max_iter=100)), overlap="ignore")
sim.run(3, progress=False)
if sim.ranks.rank == 1:
    np.save("alone.npy", sim.bodies.position)
"""
    started(tmp_path, script)
    assert np.array_equal(np.load(tmp_path / "alone.npy"), stepped(many_disks(), 1).bodies.position)


def test_restored_sets_that_came_later_leave_the_file(tmp_path):
    """Rank 0 replaces it by the next checkpoint."""
    path, sim = tmp_path / "late.checkpoint.h5", stepped(scenes.SCENES[0](), 2)
    late = [s for s in many_disks().sets if len(s) > 1][0]
    sim.add(cn.disks(late.position + (0.0, 100.0), 0.4, scenes.ROCK, damping=np.linspace(0, 1, len(late))))
    sim.checkpoint(path)
    other = stepped(scenes.SCENES[0](), 2, steps=0)
    other.restore(path)
    made = other._sets[-1]
    arrays = [made.ids, made.position, made.velocity, made.mass, made.inertia, made.damping, made.contactors[0].radius]
    assert len(made) == len(late) and not any(in_file(a) for a in arrays)
    for of in (sim, other):
        of.run(2, progress=False)
    assert np.array_equal(sim.bodies.position, other.bodies.position)
