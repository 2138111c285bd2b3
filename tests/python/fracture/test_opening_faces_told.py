"""Output of a mesh whose faces open by threshold: forces and stresses of a step, states, run files."""

import cairn as cn
import numpy as np
import pytest
from test_opening_faces import HIGH, ROCK, WIDE, YOUNG, body_of, copies, crossed, face, notched, pulled, zone


def solid_beside():
    """A block of a material beside the plate, that falls on its foot."""
    corners = np.array([[1.0, 0.0], [1.1, 0.0], [1.1, 0.1], [1.0, 0.1]])
    body = cn.SolidBody(corners, {"quad": [[0, 1, 2, 3]]}, cn.IsotropicElastic(young=1e6, poisson=0.3), density=1000.0,
                        groups={"foot": [0, 1]})  # fmt: skip
    return cn.deformable(body, ROCK, fixed={"foot": "xy"}, velocity=(0.0, -10.0), name="block")


def test_forces_and_stresses_of_a_step_are_told_when_faces_opened_after_it():
    """Values are those before the faces opened: reactions and contact forces in sum, and individually away from the crack; those
    of other meshes to the bit."""
    sim = pulled(notched(4), HIGH / 4, opens="threshold", also=[solid_beside()])
    plate, block = (next(k for k, m in enumerate(sim.meshes) if (m.name == "block") == is_block) for is_block in (False, True))
    before, opened = [], 0

    def told():
        mesh = sim.meshes[plate]
        return (mesh.reaction("right"), mesh.contact_force.sum(axis=0), np.abs(mesh.contact_force).sum(),
                sim.meshes[block].stress["quad"], sim.meshes[block].reaction(), mesh.reaction())  # fmt: skip

    class BeforeItOpens:
        def look(self, sim):
            before[:] = told()

    sim._watches.insert(0, BeforeItOpens())
    while opened < 3:
        nodes = len(sim.nodes.id)
        sim.step()
        if len(sim.nodes.id) == nodes:
            continue
        opened += 1
        pull, contacts, sizes, stress, foot, every = told()
        assert abs(pull[0]) > 5e3 and pull == pytest.approx(before[0], rel=1e-13)
        assert contacts == pytest.approx(before[1], abs=1e-13 * before[2]) and sizes == pytest.approx(before[2], rel=1e-13)
        assert np.array_equal(stress, before[3]) and np.abs(stress).max() > 100
        assert np.array_equal(foot, before[4]) and np.abs(foot).max() > 0
        assert np.array_equal(every[: len(before[5])], before[5])
    assert before[2] > 1e3  # of the zones that hold faces open before


def test_forces_and_stresses_stay_when_bodies_come_in_or_the_strategy_changes():
    sim = pulled(notched(4), HIGH / 4, opens="threshold", threshold=np.inf, also=[solid_beside()])
    for _ in range(4):
        sim.step()

    def told():
        return [array for m in sim.meshes for array in (m.reaction(), m.contact_force)]

    stress = next(m for m in sim.meshes if m.name == "block").stress["quad"]
    before = told()
    sim.add(cn.disks([[5.0, 5.0]], 0.1, ROCK))
    assert all(map(np.array_equal, told(), before)) and max(np.abs(of).max() for of in before) > 1e3
    assert np.array_equal(next(m for m in sim.meshes if m.name == "block").stress["quad"], stress) and np.abs(stress).max() > 100
    sim.strategy = cn.NSCD(theta=0.6)
    assert all(map(np.array_equal, told(), before))


def test_a_node_on_the_crack_that_is_held_shares_its_reaction():
    points, _, quads = crossed(2, 2)
    sim = pulled(body_of(points[:9], quads), HIGH / 2, speed=0.05, opens="threshold", threshold=np.inf)
    sim.step()
    before = sim.meshes[0].reaction("right")
    opening = sim.meshes[0]._mesh.d.opening
    cn.run.cracks.open_faces(sim, sim.meshes[0]._mesh, np.concatenate([face(opening, 4, 7), face(opening, 4, 1)]))
    opening = sim.meshes[0]._mesh.d.opening
    assert copies(opening, 7) == 2
    after = sim.meshes[0].reaction()
    twins = np.flatnonzero(opening.former == 7)
    assert sim.meshes[0].reaction("right") == pytest.approx(before, rel=1e-13) and abs(before[0]) > 0
    assert np.all(after[twins, 0] == after[twins[0], 0])  # of equal masses


def test_a_state_in_memory_holds_what_is_open_where_no_node_parted(tmp_path):
    points, _, quads = crossed(4, 4)

    def plate():
        return pulled(body_of(points[:25], quads), HIGH / 4, opens="threshold", speed=0.05, threshold=np.inf)

    def is_open():
        return np.flatnonzero(sim.meshes[0]._mesh.d.opening.is_open)

    sim = plate()
    sim.step()
    opening, whole = sim.meshes[0]._mesh.d.opening, sim.get_state()
    inner, next_to_it = (face(opening, *ends)[0] for ends in ((12, 17), (12, 7)))
    cn.run.cracks.open_faces(sim, sim.meshes[0]._mesh, np.array([inner]))
    assert len(sim.nodes.id) == 25 and is_open().tolist() == [inner]
    opened = sim.get_state()
    sim.set_state(whole)
    assert not len(is_open())
    sim.set_state(opened)
    assert is_open().tolist() == [inner]
    sim.step()
    after = sim.nodes.position.copy()
    sim.set_state(opened)
    sim.step()
    assert np.array_equal(sim.nodes.position, after)
    # the next opening splits the middle node, and a split state does not fit the intact plate
    sim.set_state(opened)
    cn.run.cracks.open_faces(sim, sim.meshes[0]._mesh, np.array([next_to_it]))
    parted = sim.get_state()
    sim.step()
    after = sim.nodes.position.copy()
    sim.checkpoint(tmp_path / "parted.checkpoint.h5")
    sim.set_state(parted)
    sim.step()
    assert np.array_equal(sim.nodes.position, after) and np.array_equal(is_open(), np.sort([inner, next_to_it]))
    with pytest.raises(ValueError, match="other bodies"):
        sim.set_state(whole)
    sim = plate()
    sim.restore(tmp_path / "parted.checkpoint.h5")
    sim.set_state(parted)
    assert np.array_equal(is_open(), np.sort([inner, next_to_it]))
    broken = {**parted, "cracks": {"000000": {**parted["cracks"]["000000"], "open": np.zeros(3, bool)}}}
    with pytest.raises(ValueError, match="of another mesh"):
        sim.set_state(broken)


def areas_drawn(step):
    """Areas of the triangles of the plate as drawn in pictures of an output [m2], and its number of nodes."""
    mesh, rows = next((mesh, rows) for mesh, rows in cn.files.mesh_cells.meshes_at(step) if mesh["name"] == "pieces")
    a, b, c = (step.drawn["position"][rows, :2][mesh["cells"]["triangle"][:, k]] for k in range(3))
    (x, y), (u, v) = (b - a).T, (c - a).T
    return (x * v - y * u) / 2, len(mesh["nodes"])


def test_outputs_draw_the_cells_of_a_mesh_by_the_nodes_that_it_has_then(tmp_path):
    """Beside a mesh that came before it; also in a file that a run goes on in."""
    block = cn.ElasticBody(np.array([[0.2, 0.0], [0.3, 0.0], [0.3, 0.1], [0.2, 0.1]]), {"quad": [[0, 1, 2, 3]]}, young=YOUNG,
                           poisson=0.2, density=2500.0)  # fmt: skip
    body = notched(4)
    sim = pulled(body, HIGH / 4, opens="threshold", also=[cn.deformable(block, ROCK, name="block")])
    path, kept = tmp_path / "crack.vtkhdf", tmp_path / "crack.checkpoint.h5"
    sim.run(steps=8, output=path, every=4, progress=False)
    sim.checkpoint(kept)
    sim.run(steps=16, output=path, every=8, progress=False, append=True)
    last = len(sim.nodes.id) - 4
    sim.restore(kept)
    sim.run(steps=8, output=path, every=8, progress=False, append=True)
    assert len(sim.nodes.id) - 4 < last
    counts = []
    for step in cn.load(path):
        found, count = areas_drawn(step)
        assert found == pytest.approx(WIDE * HIGH / len(found), rel=1e-3)
        counts.append(count)
    assert len(counts) == 4 and counts[0] == len(body.points) and counts[-1] == len(sim.nodes.id) - 4 > counts[1]
    other = next(mesh for mesh, _ in cn.files.mesh_cells.meshes_at(cn.load(path)[-1]) if mesh["name"] == "block")
    assert other["cells"]["quad"].tolist() == [[0, 1, 2, 3]]
    cn.load(path).plot(-1)


def test_a_run_goes_on_in_a_file_of_before_faces_could_open(tmp_path):
    block = cn.ElasticBody(np.array([[0.2, 0.0], [0.3, 0.0], [0.3, 0.1], [0.2, 0.1]]), {"quad": [[0, 1, 2, 3]]}, young=YOUNG,
                           poisson=0.2, density=2500.0)  # fmt: skip
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(block, ROCK, name="block"), cn.disks([[9.0, 9.0]], 0.1, ROCK))
    sim = cn.Simulation(scene, 1e-6, cn.NSCD())
    sim.run(steps=1, output=tmp_path / "a.vtkhdf", progress=False)
    pieces = cn.fracture.split(notched(2), zone(HIGH / 2), ROCK, opens="threshold", threshold=np.inf)
    sim.add(*pieces.sets)
    sim.run(steps=1, output=tmp_path / "a.vtkhdf", progress=False, append=True)
    assert "mesh" not in cn.load(tmp_path / "a.vtkhdf")[-1].nodes.names
