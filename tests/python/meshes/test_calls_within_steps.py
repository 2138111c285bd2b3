"""Calls that another code may make to the simulation that calls it: readers alone, nothing that changes the step under way."""

import re

import cairn as cn
import numpy as np
import pytest
from test_callbacks import POINTS, ROCK, Chain, hit, moved


class Meddler(Chain):
    """A chain that acts on its simulation in one of its calls, and keeps the exception raised."""

    def __init__(self, points, at="forces"):
        super().__init__(points)
        self.at, self.meddle, self.raised = at, None, []

    def _try(self, at):
        if at != self.at or self.meddle is None:
            return
        meddle, self.meddle = self.meddle, None
        try:
            meddle()
        except ValueError as error:
            self.raised.append(str(error))

    def forces(self, at):
        self._try("forces")
        return super().forces(at)

    def commit(self):
        self._try("commit")
        super().commit()


MEDDLING = {
    "step": lambda sim, kept, path: sim.step(),
    "run": lambda sim, kept, path: sim.run(steps=1, progress=False, output=path, overwrite=True),
    "add": lambda sim, kept, path: sim.add(cn.disks(np.stack([np.arange(500.0), np.full(500, 9.0)], -1), 0.1, ROCK)),
    "remove": lambda sim, kept, path: sim.remove([int(sim.bodies.id[0])]),
    "set_state": lambda sim, kept, path: sim.set_state(kept),
    "restore": lambda sim, kept, path: sim.restore(path),
    "get_state": lambda sim, kept, path: sim.get_state(),
    "checkpoint": lambda sim, kept, path: sim.checkpoint(path),
    "dt": lambda sim, kept, path: setattr(sim, "dt", 1e-6),
    "strategy": lambda sim, kept, path: setattr(sim, "strategy", cn.NSCD()),
    "interact": lambda sim, kept, path: sim.interact(ROCK, ROCK, cn.Coulomb(mu=0.9)),
    "drive": lambda sim, kept, path: sim.drive(sim.bodies.id, "x", [[1.0]]),
    "bodies.set": lambda sim, kept, path: sim.bodies.set(velocity=2 * sim.bodies.velocity),
    "nodes.set": lambda sim, kept, path: sim.nodes.set(velocity=2 * sim.nodes.velocity),
    "follow_rotations": lambda sim, kept, path: sim.follow_rotations(),
    "join": lambda sim, kept, path: sim.join(int(sim.bodies.id[0]), None, cn.Pivot(point=(1.2, 0.0))),
    "begin_step": lambda sim, kept, path: sim.stages.begin_step(),
    "undo_step": lambda sim, kept, path: sim.stages.undo_step(),
}


@pytest.fixture(scope="module")
def way():
    return moved(hit(Chain(POINTS)), 12)


@pytest.mark.parametrize("at", ["forces", "commit"])
@pytest.mark.parametrize("what", MEDDLING)
def test_what_finds_a_step_half_done_is_refused_and_the_run_goes_on(what, at, way, tmp_path):
    chain, path = Meddler(POINTS, at), tmp_path / "kept.checkpoint.h5"
    sim = hit(chain)
    moved(sim, 6)
    sim.checkpoint(path)
    kept, there = sim.get_state(), path.read_bytes()
    chain.meddle = lambda: MEDDLING[what](sim, kept, path)
    assert np.array_equal(moved(sim, 6), way[6:])
    (text,) = chain.raised
    assert text.startswith(f"{what} stands between steps, and one is being made") and "wait for its end" in text
    assert path.read_bytes() == there and sim.steps == 12 and sim.dt == 5e-4
    MEDDLING["get_state"](sim, kept, path)  # the step is over


def test_a_step_made_of_stages_is_left_alone_by_what_its_stages_call(way):
    chain = Meddler(POINTS)
    sim = hit(chain)
    moved(sim, 6)
    stages = sim.stages
    for what in ("bodies.set", "undo_step", "step", "dt"):
        stages.begin_step()
        while stages.due != "end_step":
            if stages.due == "solve_contacts":
                chain.meddle = lambda what=what: MEDDLING[what](sim, None, None)
            getattr(stages, stages.due)()
        stages.end_step()
    assert [re.match(r"\S+", text)[0] for text in chain.raised] == ["bodies.set", "undo_step", "step", "dt"]
    assert np.array_equal(sim.meshes[0].displacement, way[9][0])


def test_what_is_raised_undoes_the_step(way):
    on = []

    def forces(at):
        if on:
            on.pop()()
        return chain.forces(at)

    chain = Chain(POINTS)
    sim = hit(chain, edit=forces)
    sim.step()
    before = sim.meshes[0].displacement.copy()
    on.append(sim.step)
    with pytest.raises(ValueError, match="the mesh 'mesh': forces of .* raised ValueError: step stands between steps"):
        sim.step()
    assert sim.steps == 1 and np.array_equal(sim.meshes[0].displacement, before)
    assert sim.step()["status"] == "converged"
    sim.remove([int(sim.bodies.id[0])])


def test_functions_at_the_beginning_of_a_step_and_after_it_do_as_they_like(tmp_path):
    seen = []

    def push(t, sim):
        seen.append(len(sim.get_state()))
        sim.dt = 1e-3
        sim.bodies.set(velocity=sim.bodies.velocity)
        return np.zeros((1, 3))

    push.needs_simulation = True
    scene = cn.Scene(dim=2)
    scene.add(cn.disks([[0.0, 0.0]], 0.1, ROCK, force=push))
    sim = cn.Simulation(scene, dt=2e-3)
    sim.run(steps=3, progress=False, callback=lambda sim: sim.checkpoint(tmp_path / "after.checkpoint.h5"))
    assert len(seen) >= 3 and sim.dt == 1e-3 and (tmp_path / "after.checkpoint.h5").exists()


def stepped_by_a_force(step):
    def push(t, sim):
        step(sim)
        return np.zeros((1, 3))

    push.needs_simulation = True
    scene = cn.Scene(dim=2)
    scene.add(cn.disks([[0.0, 0.0]], 0.1, ROCK, force=push, velocity=(1.0, 0.0, 0.0)))
    return cn.Simulation(scene, dt=1e-3)


def stepped_by_a_motion(step):
    points = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    body = cn.ElasticBody(points, {"quad": np.array([[0, 1, 2, 3]])}, young=1e5, poisson=0.3, density=1e3, groups={"low": [0, 1]})
    scene, sim = cn.Scene(dim=2), []

    def sway(t):
        if sim:
            step(sim[0])
        return 0.1 * t

    scene.add(cn.deformable(body, ROCK, fixed={"low": "y"}, displace={"low": {"x": sway}}))
    sim.append(cn.Simulation(scene, dt=1e-3))
    return sim[0]


@pytest.mark.parametrize("made", [stepped_by_a_force, stepped_by_a_motion])
@pytest.mark.parametrize("what", ["step", "run", "begin_step"])
@pytest.mark.parametrize("cut_back", [0, 2])
def test_functions_at_the_beginning_of_a_step_make_none(made, what, cut_back):
    """Not even one: the loads of the other would be those of a time that is over."""
    steps = {
        "step": lambda sim: sim.step(),
        "run": lambda sim: sim.run(steps=1, progress=False),
        "begin_step": lambda sim: sim.stages.begin_step(),
    }
    on = []
    sim = made(lambda sim: steps[what](sim) if on else None)
    sim.strategy = cn.NSCD(cut_back=cut_back)
    sim.step()
    kept = sim.nodes.position.copy(), sim.bodies.position.copy()
    on.append(True)
    with pytest.raises(ValueError, match="a function of time of the scene makes a step.*: step in `callback` of run"):
        sim.step()
    assert sim.steps == 1 and sim.time == 1e-3 and sim.stages.due is None
    assert np.array_equal(sim.nodes.position, kept[0]) and np.array_equal(sim.bodies.position, kept[1])
    on.clear()
    assert sim.step()["status"] == "converged"


# ---------------------------------------------------------------------- histories that are lost


def test_a_history_that_was_not_committed_is_not_saved(tmp_path, way):
    class Failing(Chain):
        fails = False

        def commit(self):
            if self.fails:
                raise RuntimeError("the disk is full")
            super().commit()

    chain, path = Failing(POINTS), tmp_path / "chain.checkpoint.h5"
    sim = hit(chain)
    moved(sim, 6)
    kept = sim.get_state()
    chain.fails = True
    with pytest.raises(ValueError, match="the disk is full"):
        sim.step()
    chain.fails = False
    for save in (lambda: sim.checkpoint(path), sim.get_state):
        with pytest.raises(ValueError, match="did not commit a step; what the code keeps is not known: go back to a checkpoint"):
            save()
    assert not path.exists()
    sim.set_state(kept)
    sim.checkpoint(path)
    assert np.array_equal(moved(sim, 6), way[6:])


def test_steps_in_parts_need_a_history_that_is_given():
    text = r"cut_back is 2, and the mesh 'mesh' is of a code that keeps a history and does not give it.* give the code state\(\)"
    sim = hit(Chain(POINTS, tells=False))
    moved(sim, 2)
    before = sim.strategy
    with pytest.raises(ValueError, match=text):
        sim.strategy = cn.NSCD(cut_back=2)
    assert sim.strategy == before
    assert sim.step()["status"] == "converged"
    body = cn.CallbackBody(POINTS, np.full(6, 0.5), Chain(POINTS, tells=False))
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(body, ROCK))
    with pytest.raises(ValueError, match=text) as refused:
        cn.Simulation(scene, dt=5e-4, strategy=cn.NSCD(cut_back=2))
    sim = cn.Simulation(scene, dt=5e-4)  # the refused call has not discarded the history
    assert sim.step()["status"] == "converged" and refused
    with pytest.raises(ValueError, match="is of another simulation"):
        cn.Simulation(scene, dt=5e-4)
    told = hit(Chain(POINTS))
    told.strategy = cn.NSCD(cut_back=2)
    assert told.step()["status"] == "converged"
