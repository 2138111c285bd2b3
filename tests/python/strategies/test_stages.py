"""A step made stage by stage: the bits of step(), reading and writing between stages, and refusals."""

import re
from pathlib import Path

import cairn as cn
import numpy as np
import pytest
from cairn import _core
from cairn.model.elastic import ElasticBody
from cairn.options import strategies
from small_scenes import ROCK, differing, heap, state


def by_hand(sim, dt=None, look=lambda stage: None):
    stages = sim.stages
    stages.begin_step(dt)
    while stages.due != "end_step":
        stage = stages.due
        getattr(stages, stage)()
        look(stage)
    return stages.end_step()


def push(t):
    return (0.1 * np.sin(20 * t), *[0.0] * 2)


def meshed(**options):
    """Disks on an elastic block on a wall."""
    x, y = np.meshgrid(np.linspace(0, 1, 4), np.linspace(0, 0.5, 3))
    points = np.stack([x.ravel(), y.ravel()], axis=1)
    cells = np.array([[4 * j + i + k for k in (0, 1, 5, 4)] for j in range(2) for i in range(3)])
    body = ElasticBody(points, {"quad": cells}, young=1e6, poisson=0.3, density=2000.0)
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    scene.add(cn.deformable(body, ROCK, contact=np.flatnonzero(y.ravel() == 0), edges=(np.flatnonzero(y.ravel() == 0.5),)))
    scene.add(cn.disks([[0.3, 0.6], [0.7, 0.6]], 0.1, ROCK), cn.wall((0, 0), (0, 1), ROCK))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, 1e-3, cn.NSCD(**options), overlap="ignore")


MADE = {
    "disks": lambda: cn.Simulation(heap(2, push=push), 2e-2, cn.NSCD(theta=0.6)),
    "spheres": lambda: cn.Simulation(heap(3), 2e-2, cn.NSCD(solver=cn.Auto(tol=1e-6))),
    "pushed apart": lambda: cn.Simulation(heap(2), 2e-2, cn.NSCD(project_positions=True)),
    "springs": lambda: cn.Simulation(heap(2), 2e-2, cn.GranularElement(stiffness=1e6)),
    "mesh": meshed,
}


@pytest.mark.parametrize("name", MADE)
def test_a_step_by_hand_has_the_bits_of_step(name):
    whole, parts = MADE[name](), MADE[name]()
    for k in range(12):
        dt = whole.dt / 2 if k == 5 else None
        told, shown = whole.step(dt), by_hand(parts, dt)
        assert told == shown
        assert parts.report == shown and parts.steps == k + 1
    assert differing(state(whole), state(parts)) == []
    assert np.any(whole.contacts.impulse != 0)
    assert set(parts.info["seconds"]) == set(whole.info["seconds"])


def test_strategies_that_are_rows_alone_have_their_stages():
    """A row without a class in Python, under a force of time: the steps of the class, whole and by hand."""
    rows = {row[0]: row for row in _core.strategies()}
    row = strategies._listed_class(*rows["granular_element"])
    assert row().stages and row(theta=0.7).end_share == 0.7 and not row().explicit
    one = cn.Simulation(heap(2, push=push), 2e-2, cn.GranularElement(stiffness=1e6, solver=cn.NLGS(tol=1e-6)))
    same = [cn.Simulation(heap(2, push=push), 2e-2, row(stiffness=1e6, tol=1e-6)) for _ in range(2)]
    for _ in range(8):
        one.step()
        same[0].step()
        by_hand(same[1])
    assert np.any(one.contacts.impulse != 0)
    assert differing(state(one), state(same[0])) == [] and differing(state(one), state(same[1])) == []
    assert not cn.strategy("EventDriven").stages


def test_impulses_of_ones_own_take_the_place_of_the_solver():
    whole, parts = MADE["disks"](), MADE["disks"]()
    for _ in range(10):
        whole.step()
        stages = parts.stages
        stages.begin_step()
        for stage in ("predict_configuration", "compute_free_velocity", "detect_contacts", "prepare_contacts"):
            getattr(stages, stage)()
        rows = stages.contacts
        assert rows.axes.shape == (len(parts.contacts), 2, 2) and rows.mesh is None
        assert np.array_equal(rows.axes[:, 0], parts.contacts.normal)
        stages.give_impulses(whole.contacts.impulse_local, iterations=3)
        for stage in ("update_velocity", "commit_contacts", "update_configuration"):
            getattr(stages, stage)()
        assert stages.end_step()["iterations"] == 3
    assert np.any(whole.contacts.impulse != 0)
    np.testing.assert_allclose(parts.bodies.velocity, whole.bodies.velocity, rtol=0, atol=1e-12)


def test_rows_name_the_nodes_of_a_mesh():
    sim = meshed()
    for _ in range(60):
        sim.step()
    rows, mesh = sim.stages.contacts, sim.meshes[0]
    carried = rows.mesh == 0
    assert carried.any(axis=1).all() and np.all(rows.bodies[carried] == -1)
    carried &= np.abs(sim.contacts.gap)[:, None] < 1e-3  # an open one has its point in the middle of its gap
    place = mesh.body.points[rows.node[carried]] + mesh.displacement[rows.node[carried]]
    point = np.broadcast_to(sim.contacts.point[:, None], (*carried.shape, 2))[carried]
    np.testing.assert_allclose(np.einsum("mk,mki->mi", rows.weight[carried], place), point, atol=2e-3)
    np.testing.assert_allclose(rows.weight[carried].sum(axis=1), 1.0)


def test_what_is_written_between_stages_counts():
    plain, blown = MADE["spheres"](), MADE["spheres"]()

    def wind(stage):
        if stage == "compute_free_velocity":
            free = np.isfinite(blown.raw.mass).ravel()
            blown.raw.velocity_free[free, 0] += 1e-3

    for _ in range(3):
        plain.step()
        by_hand(blown, look=wind)
    assert (blown.bodies.velocity - plain.bodies.velocity)[:, 0].max() > 1e-3


def test_an_undone_step_leaves_no_trace():
    sim, plain = MADE["disks"](), MADE["disks"]()
    for s in (sim, plain):
        by_hand(s)
    sim.stages.begin_step()
    sim.stages.predict_configuration()
    sim.stages.compute_free_velocity()
    assert sim.stages.due == "detect_contacts"
    sim.stages.undo_step()
    assert sim.stages.due is None and sim.stages.h is None
    for s in (sim, plain):
        s.step()
    assert differing(state(sim), state(plain)) == []


def test_stages_out_of_turn_are_refused(tmp_path):
    sim = MADE["disks"]()
    with pytest.raises(ValueError, match="detect_contacts is not due: the next stage is begin_step"):
        sim.stages.detect_contacts()
    sim.stages.begin_step()
    with pytest.raises(ValueError, match="solve_contacts is not due: the next stage is predict_configuration"):
        sim.stages.give_impulses(np.zeros((0, 2)))
    for call in (sim.step, sim.stages.begin_step, sim.get_state, lambda: sim.remove([0]), lambda: sim.add(),
                 lambda: sim.checkpoint(tmp_path / "c.h5"), lambda: sim.restore(tmp_path / "c.h5")):  # fmt: skip
        with pytest.raises(ValueError, match="one is being made: its stage predict_configuration is due"):
            call()
    sim.stages.undo_step()
    smooth = cn.Simulation(heap(2, law=cn.LinearSpring(stiffness=1e5)), 1e-4, cn.SmoothDEM())
    with pytest.raises(ValueError, match="SmoothDEM has no stages"):
        smooth.stages.begin_step()


def test_a_state_of_other_bodies_is_refused():
    sim, other = MADE["disks"](), MADE["spheres"]()
    before = sim.get_state()
    sim.step()
    sim.set_state(before)
    assert sim.steps == 0
    with pytest.raises(ValueError, match="the state is of other bodies"):
        sim.set_state(other.get_state())
    sim.remove([3])
    with pytest.raises(ValueError, match="the state is of other bodies"):
        sim.set_state(before)


def test_displacements_are_those_from_the_start_wherever_the_origin_is():
    points = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) + [100.0, 50.0]
    body = ElasticBody(points, {"quad": [[0, 1, 2, 3]]}, young=1e6, poisson=0.3, density=2000.0)
    scene = cn.Scene(2, gravity=(0.0, -9.81), origin=(100.0, 50.0))
    scene.add(cn.deformable(body, ROCK, displacement=(0.5, 0.0)))
    sim = cn.Simulation(scene, 1e-3)
    assert np.array_equal(sim.meshes[0].displacement, np.tile([0.5, 0.0], (4, 1)))


def test_no_module_reaches_into_a_simulation():
    folder = Path(cn.__file__).resolve().parent  # of a build, too, whose folders are links
    reaches = re.compile(r"\b(?:sim|simulation|_simulation)\._core\b")
    pages = {path: path.read_text(encoding="utf-8") for path in folder.rglob("*.py") if path.exists()}
    assert len(pages) > 100
    assert [str(path) for path, page in pages.items() if reaches.search(page)] == []
