"""Contactors that are mapped from nodes of meshes: no body stands for them, and files in which one did stay readable."""

import cairn as cn
import numpy as np
import pytest
from cairn.base.geometry import contactors_of
from cairn.post.shape_meshes import meshes_of
from test_mesh_features import SIZE, above, ball, block, low, scene_of


def resting(dim):
    """A ball on a block on a plane; in 2D another block under the block, with points between nodes."""
    sets = [block(low(dim), *SIZE[dim]), ball(above(dim))]
    if dim == 2:
        points = (np.array([[0, 3], [3, 6]]), np.array([[0.5, 0.5], [0.25, 0.75]]))
        sets.append(block((0.2, -0.3), (4, 2), (1.0, 0.3), name="lower", points=points))
    scene = scene_of(dim, *sets, wall=dim == 3)
    if dim == 2:
        scene.add(cn.wall((0, -0.3), (0, 1), sets[1].contactors[0].material))
    return cn.Simulation(scene, 1e-3, overlap="ignore")


@pytest.mark.parametrize("dim", [2, 3])
def test_no_body_stands_for_points_edges_and_faces(dim):
    sim = resting(dim)
    assert len(sim.bodies) == 2  # ball and wall
    assert len(sim.nodes) == sum(len(mesh.ids) for mesh in sim.meshes) and not np.isin(sim.nodes.id, sim.bodies.id).any()
    assert sim.nodes.mass.min() > 0.01 * np.median(sim.nodes.mass)
    parts = np.concatenate([np.setdiff1d(mesh.all_ids, mesh.ids) for mesh in sim.meshes])
    assert len(parts) and np.isin(parts, sim.contactors.body).all()
    assert not np.isin(parts, np.concatenate([sim.bodies.id, sim.nodes.id])).any()


def test_nodes_have_rows_of_their_own_and_rigid_bodies_theirs():
    sim = resting(2)
    sim.step()
    later = sim.add(ball((0.6, 0.9)))
    sim.step()
    assert sorted(np.concatenate([mesh.rows for mesh in sim.meshes])) == list(range(len(sim.nodes)))
    seen = sim.bodies.velocity[np.searchsorted(sim.bodies.id, later)]
    assert seen[0, 1] == pytest.approx(-9.81e-3, rel=1e-12)  # it falls as if no mesh were there
    for mesh in sim.meshes:
        assert np.array_equal(sim.nodes.id[mesh.place], mesh.ids) and len(set(sim.nodes.mesh[mesh.place])) == 1
        for name in ("position", "velocity"):
            assert np.array_equal(getattr(sim.nodes, name)[mesh.place], getattr(mesh, name))
        assert np.array_equal(sim.raw.nodes.velocity[mesh.rows], mesh.velocity)
    with pytest.raises(AttributeError, match="nodes have no array 'rotation'; they have"):
        _ = sim.nodes.rotation
    with pytest.raises(ValueError, match="mass of nodes cannot be set: position and velocity can"):
        sim.nodes.set(mass=sim.nodes.mass)
    with pytest.raises(ValueError, match="is a node of a mesh, and no rigid body"):
        sim.drive(sim.nodes.id[:1], ("vx",), (1.0, 0.0, 0.0))


def test_velocities_that_nodes_are_given_count():
    sim = resting(2)
    speed = np.array(sim.nodes.velocity)
    speed[sim.meshes[1].place] -= (0.0, 0.5)
    sim.nodes.set(velocity=speed)
    place = sim.nodes.position.copy() + (0.0, 1.0)
    sim.nodes.set(position=place)
    sim.step()
    lower = sim.meshes[1].place
    moved = np.average((sim.nodes.position - place)[lower], axis=0, weights=sim.nodes.mass[lower])
    assert moved == pytest.approx((0.0, -0.5e-3), rel=0.02, abs=1e-6)  # away from the other; weight and damping act, too


def test_a_mesh_that_goes_leaves_the_others_their_forces_and_numbers():
    """Arrays are those of the remaining meshes, not of meshes with the same index before."""
    sim, alone = resting(2), resting(2)
    for _ in range(3):
        sim.step(), alone.step()
    lower, pushed = sim.meshes[1], np.array(sim.meshes[1].contact_force)
    assert np.abs(pushed).max() > 0
    sim.remove(sim.meshes[0].all_ids)
    (left,) = sim.meshes
    assert left.name == lower.name and np.array_equal(left.contact_force, pushed)
    assert len(sim.nodes) == len(left.ids) and left.place == slice(0, len(left.ids))
    sim.step()
    assert np.isfinite(left.stress["quad"]).all() and len(left.contact_force) == len(left.ids)


@pytest.mark.parametrize("dim", [2, 3])
def test_contacts_name_the_node_that_bears_most(dim):
    sim = resting(dim)
    for _ in range(3):
        sim.step()
    known, places = np.concatenate([sim.bodies.id, sim.nodes.id]), np.concatenate([sim.bodies.position, sim.nodes.position])
    order = np.argsort(known)
    at = places[order[np.searchsorted(known[order], sim.contacts.bodies)]]
    meshed = np.isin(sim.contacts.bodies, np.concatenate([mesh.ids for mesh in sim.meshes]))
    apart = np.linalg.norm(at - sim.contacts.point[:, None], axis=2)
    assert meshed.any() and apart[meshed].max() < 0.5  # of cells 0.25 to 0.5 m wide
    for mesh in sim.meshes:
        nodes = sim.nodes.position[mesh.place]
        for row, side in np.argwhere(np.isin(sim.contacts.bodies, mesh.ids)):
            nearest = np.linalg.norm(nodes - sim.contacts.point[row], axis=1).min()
            assert apart[row, side] <= nearest + 1e-3


@pytest.mark.parametrize("dim", [2, 3])
def test_sides_are_drawn_where_their_nodes_are(tmp_path, dim):
    sim = resting(dim)
    sim.run(3, output=tmp_path / "run.h5", every=1)
    step = cn.load(tmp_path / "run.h5")[-1]
    position = np.asarray(step.nodes["position"])
    assert len(step.bodies) == 2 and np.array_equal(step.drawn["id"], np.concatenate([step.bodies["id"], step.nodes["id"]]))
    if dim == 3:
        points, triangles, rows = meshes_of(step)
        assert len(triangles) == 8 and np.abs(points[:, 2] - 0.5).max() < 0.01  # two for each of four faces
        assert np.isin(np.round(points, 12), np.round(position, 12)).all() and len(rows) == 8
        return
    bars = contactors_of(step).select("segment")
    assert len(bars.center) == 8 and np.allclose(bars.half, [0.125] * 8, atol=1e-3)
    ends = np.concatenate([bars.center - bars.half[:, None] * bars.direction, bars.center + bars.half[:, None] * bars.direction])
    off = np.linalg.norm(ends[:, None] - position[None], axis=2).min(axis=1)
    assert np.allclose(off, np.tile(bars.radius, 2), rtol=1e-9)  # inside by their radius


def with_nodes_among_bodies(content):
    """Content of earlier files: nodes are rows behind rigid bodies, in an order of their own, without rotation."""
    scene = content["state"]["scene"]
    bodies, nodes = scene["bodies"], scene.pop("nodes")
    n, m = len(bodies["id"]), len(nodes["id"])
    order = np.random.default_rng(1).permutation(m)
    for name in {*bodies, *(name for name in nodes if name != "mesh")}:
        like = nodes[name] if name in nodes else bodies[name]
        wide = 3 * like.shape[1] - 3 if name == "force" else like.shape[-1]
        values = bodies.get(name, np.zeros((n, wide) if like.ndim > 1 else n, like.dtype))
        rows = np.ones((m, *values.shape[1:]), values.dtype)
        if name in nodes:
            rows.reshape(m, -1)[:, nodes[name].reshape(m, -1).shape[1] :] = 0
            rows.reshape(m, -1)[:, : nodes[name].reshape(m, -1).shape[1]] = nodes[name].reshape(m, -1)[order]
        bodies[name] = np.concatenate([values, rows])
    bodies["whole"] = np.concatenate([np.zeros(n, np.int64), nodes["mesh"].ravel()[order]])
    return content


def as_files_of_before_had_it(content, sim):
    """Points, edges and faces as bodies of 1e-20 of a node's mass; contactors on the rows of these and of nodes."""
    scene = content["state"]["scene"]
    bodies, contactors = scene["bodies"], scene["contactors"]
    n, ids = len(bodies["id"]), bodies["id"].ravel()
    more = np.concatenate([np.setdiff1d(mesh.all_ids, ids) for mesh in sim.meshes])
    for name, values in bodies.items():
        rows = np.repeat(values[:1], len(more), axis=0)
        bodies[name] = np.concatenate([values, 1e-20 * rows if name in ("mass", "inertia") else rows])
    bodies["id"] = np.concatenate([ids, more])
    part = contactors.pop("part").ravel()
    order = np.argsort(bodies["id"])
    rows = order[np.searchsorted(bodies["id"][order], np.where(part < 0, 0, part))]
    contactors["body"] = np.where(part < 0, contactors["body"].ravel(), rows).astype(np.int32)
    assert len(more) and len(bodies["id"]) == n + len(more)
    del scene["parts"]
    return content


@pytest.mark.parametrize("parts", [False, True])
@pytest.mark.parametrize("dim", [2, 3])
def test_files_in_which_nodes_or_all_parts_of_meshes_were_bodies_go_on(tmp_path, dim, parts):
    from cairn.files.checkpoint import load, save

    sim, other = resting(dim), resting(dim)
    for _ in range(3):
        sim.step()
    sim.checkpoint(tmp_path / "now.h5")
    content = with_nodes_among_bodies(load(tmp_path / "now.h5"))
    if parts:
        content = as_files_of_before_had_it(content, sim)
    content["scene"] = content["core_scene"] = "of the bodies that there were"
    save(tmp_path / "before.h5", content)
    other.restore(tmp_path / "before.h5")
    for _ in range(3):
        sim.step(), other.step()
    assert len(other.bodies) == len(sim.bodies)
    for one, two in zip(sim.meshes, other.meshes):
        assert np.array_equal(one.velocity, two.velocity) and np.array_equal(one.displacement, two.displacement)
    assert np.array_equal(sim.nodes.velocity, other.nodes.velocity)
    content["state"]["scene"]["bodies"]["mass"] *= 2
    save(tmp_path / "another.h5", content)
    with pytest.raises(cn.FileError, match="another scene"):
        other.restore(tmp_path / "another.h5")
