"""Checkpoints of simulations whose bodies changed: made deformable and rigid again, removed, added. A new simulation of the scene
goes on from them to the same bits, and changes its bodies further as the one that wrote them does."""

import itertools

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=1000.0)
X, Y = np.meshgrid(np.linspace(-0.3, 0.3, 4), np.linspace(-0.2, 0.2, 3), indexing="ij")
POINTS = np.c_[X.ravel(), Y.ravel()]
N = np.arange(12).reshape(4, 3)
CELLS = {"quad": np.stack([N[:-1, :-1], N[1:, :-1], N[1:, 1:], N[:-1, 1:]], -1).reshape(-1, 4)}
CORNERS = np.array([(-0.3, -0.2), (0.3, -0.2), (0.3, 0.2), (-0.3, 0.2)])
BLOCK = 13  # id of the rigid block, after the nodes of the mesh and the wall


def solid(at=(0.0, 0.0), law=None):
    law = law or cn.NeoHookean(young=1e6, poisson=0.3)
    return cn.SolidBody(POINTS + at, CELLS, law, density=1000.0, groups={"all": N.ravel()})


def metal(at=(0.0, 0.0)):
    return solid(at, cn.FiniteJ2(young=1e5, poisson=0.3, yield_stress=1e4))


def linear(at=(0.0, 0.0)):
    return cn.ElasticBody(POINTS + at, CELLS, young=1e6, poisson=0.3, density=1000.0, groups={"all": N.ravel()})


def shown(body, name):
    return cn.deformable(body, ROCK, contact="all", name=name)


def made(body=solid, force=None):
    """A mesh on a wall, a rigid block on the mesh."""
    scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
    scene.add(shown(body((0.3, 0.2)), "a"), cn.wall((0, 0), (0, 1), ROCK))
    scene.add(cn.polygons([CORNERS], ROCK, position=[[0.3, 0.6]], force=force))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, 1e-3)


def number_of_block(sim):
    return next(k for k, m in enumerate(sim.meshes) if (getattr(m._mesh.d, "former", None) or {}).get("id") == BLOCK)


CHANGES = {
    "remove a mesh": lambda sim: sim.remove(sim.meshes[0].all_ids),
    "add rubber": lambda sim: sim.add(shown(solid((5.0, 0.2)), "b")),
    "add metal": lambda sim: sim.add(shown(metal((9.0, 0.2)), "c")),
    "deform": lambda sim: sim.deform(BLOCK, metal()),
    "rigidify": lambda sim: sim.rigidify(number_of_block(sim)),
}


def state(sim):
    of_meshes = [part.ravel() for m in sim.meshes for part in (m.displacement + m.body.points, m.velocity)]
    return np.concatenate([*of_meshes, sim.bodies.position.ravel(), sim.bodies.velocity.ravel()])


def changed(sim, names):
    for name in names:
        for _ in range(2):
            sim.step()
        CHANGES[name](sim)
    for _ in range(2):
        sim.step()
    return sim


def restarted(one, path, make=made):
    one.checkpoint(path)
    two = make()
    two.restore(path)
    for sim in (one, two):
        for _ in range(4):
            sim.step()
    assert np.array_equal(state(one), state(two))
    return two


REMOVED = [*itertools.permutations(["remove a mesh", "add metal", "deform"], 3), ["remove a mesh"], ["remove a mesh", "deform"]]
REMOVED += [["add metal", "remove a mesh"], ["remove a mesh", "add metal"], ["remove a mesh", "add rubber", "deform"]]


@pytest.mark.parametrize("body", [solid, linear])
@pytest.mark.parametrize("names", REMOVED, ids=", ".join)
def test_meshes_that_went_and_came_in(names, body, tmp_path):
    """State of meshes in a file goes to the same meshes, not to those with the same index in a new simulation."""
    restarted(changed(made(body), names), tmp_path / "half", lambda: made(body))


@pytest.mark.parametrize("force", [None, (3.0, 2.0, 0.1), cn.Table([0.0, 0.02], [[0.0] * 3, [100.0, 20.0, 3.0]])])
@pytest.mark.parametrize("turns", [2, 3, 4, 5])
def test_there_and_back_and_there_again(turns, force, tmp_path):
    """The rigid body that came back, and went again, is in the file with its shape and its force."""
    names = (["deform", "rigidify"] * 3)[:turns]
    one = changed(made(force=force), names)
    two = restarted(one, tmp_path / "half", lambda: made(force=force))
    rest = ["rigidify", "deform"] if turns % 2 else ["deform", "rigidify"]
    assert np.array_equal(state(changed(one, rest)), state(changed(two, rest)))


def test_a_function_of_the_scene_is_that_of_the_body_again(tmp_path):
    """A force by a function in Python, of a body that the scene has: after each change, and in a new simulation."""

    def make():
        return made(force=lambda t: (100.0 * t, 0.0, 0.0))

    two = restarted(changed(make(), ["deform", "rigidify", "deform"]), tmp_path / "half", make)
    assert two.meshes[1]._mesh.d.carried is not None
    changed(two, ["rigidify"])
    assert two.bodies.force[two.bodies.id == BLOCK][0, 0] > 1


def test_a_function_that_no_file_holds_is_asked_for(tmp_path):
    """A function of a body inserted later and removed with its mesh: the mesh must exist before the file is read."""

    def make(names):
        sim = made()
        at = int(sim.add(cn.polygons([CORNERS], ROCK, position=[[3.0, 0.2]], force=lambda t: (100.0 * t, 0.0, 0.0)))[0])
        for name in names:
            sim.step()
            sim.deform(at, metal()) if name == "deform" else sim.rigidify(1)
        sim.step()
        return sim

    names = ["deform", "rigidify", "deform"]
    one = make(names)
    one.checkpoint(tmp_path / "half")
    with pytest.raises(cn.FileError, match="came in later, with a function in Python"):
        made().restore(tmp_path / "half")
    two = restarted(one, tmp_path / "half", lambda: make(names))
    two.rigidify(1)
    two.step()
    assert two.bodies.force[-1, 0] > 0.5


def test_a_turned_body_is_as_it_turned_when_it_is_deformed_again():
    """The mesh stands as the body did when it first came in, and not as it did when it was made rigid again."""
    scene = cn.Scene(dim=2)
    scene.add(cn.polygons([CORNERS], ROCK, position=[[0.0, 0.0]], velocity=(0.0, 0.0, 3.0)))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 1e-3)
    for _ in range(3):
        for _ in range(100):
            sim.step()
        before = sim.bodies.rotation[0]
        x = sim.deform(0, solid()).displacement + POINTS
        assert abs(np.arctan2(*(x[9] - x[0])[::-1]) - before) < 1e-4
        sim.rigidify(0)
        assert abs(sim.bodies.rotation[0] - before) < 1e-4


def test_criteria_go_there_and_back_with_a_checkpoint_after_each_step(tmp_path):
    """A block on the ground alone, which is deformable in each second step."""

    def make():
        scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
        scene.add(cn.wall((0, 0), (0, 1), ROCK), cn.polygons([CORNERS], ROCK, position=[[0.0, 0.2]]))
        scene.interact("*", "*", cn.Coulomb(mu=0.3))
        sim = cn.Simulation(scene, 1e-3)
        sim.reshape_when([1], metal(), force=1.0, back=1e12)
        return sim

    one, meshes = make(), []
    for _ in range(8):
        one.step()
        meshes.append(len(one.meshes))
        one.checkpoint(tmp_path / "half")
    assert meshes == [1, 0] * 4
    restarted(one, tmp_path / "half", make)


def test_bodies_added_before_a_checkpoint_are_made_deformable_after_it(tmp_path):
    one = made()
    ids = one.add(cn.polygons([CORNERS, CORNERS], ROCK, position=[[3.0, 0.2], [5.0, 0.2]], damping=0.5, velocity=(0.1, 0.0, 0.0)))
    for _ in range(2):
        one.step()
    two = restarted(one, tmp_path / "half")
    for sim in (one, two):
        sim.deform(int(ids[1]), metal())
        sim.step()
        assert sim.rigidify(1) == ids[1]
        sim.step()
    assert np.array_equal(state(one), state(two))


def test_a_body_of_a_file_without_shapes_is_told(tmp_path):
    """Older checkpoints lack shapes of bodies inserted later: they are read, and missing operations are reported."""
    from cairn.files import checkpoint

    one = made()
    at = int(one.add(cn.polygons([CORNERS], ROCK, position=[[3.0, 0.2]]))[0])
    one.step()
    one.checkpoint(tmp_path / "half")
    content = checkpoint.load(tmp_path / "half")
    for of in content["later"].values():
        del of["body"]
    checkpoint.save(tmp_path / "older", content)
    two = made()
    two.restore(tmp_path / "older")
    for sim in (one, two):
        sim.step()
    assert np.array_equal(state(one), state(two))
    with pytest.raises(ValueError, match=f"body {at} came in later, by a checkpoint of before these held shapes"):
        two.deform(at, metal())


def test_sets_of_meshes_that_went_are_let_go():
    sim = changed(made(), ["deform", "rigidify"])
    first = len(sim._sets)
    assert len(changed(sim, ["deform", "rigidify"] * 3)._sets) == first


def of_disks():
    scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
    scene.add(cn.wall((0, 0), (0, 1), ROCK), cn.disks([[0.0, 0.1], [0.2, 0.1], [0.1, 0.28]], 0.1, ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, 1e-3, cn.NSCD(solver=cn.Default(tol=1e-3)))


def test_the_solver_that_was_chosen_is_chosen_again(tmp_path):
    """The choice depends on bodies inserted, also on those removed since, and velocities within the tolerance depend on it."""
    one = of_disks()
    heavy = one.add(cn.disks([[0.1, 1.5]], 1.0, ROCK, density=1e6))
    one.step()
    one.remove(heavy)
    one.step()
    assert type(one.strategy.solver) is cn.Auto and type(of_disks().strategy.solver) is cn.NLGS
    two = restarted(one, tmp_path / "half", of_disks)
    assert two.strategy == one.strategy
    first = of_disks()
    first.checkpoint(tmp_path / "first")
    two.restore(tmp_path / "first")
    assert two.strategy == first.strategy
