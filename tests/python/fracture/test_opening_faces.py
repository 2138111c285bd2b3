"""One mesh whose faces open by threshold: which nodes part, what passes over, and that the crack is that of a mesh all of whose
cells are bodies of their own."""

import cairn as cn
import numpy as np
import pytest
from cairn.model import opening_faces

ROCK = cn.Material("rock", density=2500.0)
YOUNG = 30e9
WIDE, HIGH = 0.1, 0.05


def zone(size, **more):
    given = {"normal_stiffness": 50 * YOUNG / size, "tangential_stiffness": 50 * YOUNG / size, "mu": 0.0, "normal_strength": 3e6,
             "tangential_strength": 6e6, "normal_work": 30.0, "tangential_work": 60.0}  # fmt: skip
    return cn.MAL(**(given | more))


def crossed(along, across, wide=WIDE, high=HIGH):
    """Squares cut by both diagonals."""
    x, y = np.linspace(0, wide, along + 1), np.linspace(0, high, across + 1)
    corners = np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2)
    middles = np.stack(np.meshgrid((x[:-1] + x[1:]) / 2, (y[:-1] + y[1:]) / 2, indexing="ij"), -1).reshape(-1, 2)
    i, j = (v.ravel() for v in np.meshgrid(np.arange(along), np.arange(across), indexing="ij"))
    ring = [i * (across + 1) + j, (i + 1) * (across + 1) + j, (i + 1) * (across + 1) + j + 1, i * (across + 1) + j + 1]
    middle = len(corners) + np.arange(along * across)
    triangles = np.concatenate([np.stack([ring[k], ring[(k + 1) % 4], middle], 1) for k in range(4)])
    return np.concatenate([corners, middles]), {"triangle": triangles}, {"quad": np.stack(ring, 1)}


def body_of(points, cells, **more):
    groups = {"left": np.flatnonzero(points[:, 0] < 1e-9), "right": np.flatnonzero(points[:, 0] > points[:, 0].max() - 1e-9)}
    return cn.ElasticBody(points, cells, young=YOUNG, poisson=0.2, density=2500.0, groups=groups, **more)


def notched(across, kind="triangle"):
    """A plate with a notch in the middle of its lower side, three tenths of its height long."""
    points, triangles, quads = crossed(2 * across, across)
    cells = triangles if kind == "triangle" else quads
    points = points if kind == "triangle" else points[: cells[kind].max() + 1]
    line = np.flatnonzero((np.abs(points[:, 0] - WIDE / 2) < 1e-9) & (points[:, 1] < 0.3 * HIGH - 1e-9))
    twin = np.arange(len(points))
    twin[line] = len(points) + np.arange(len(line))
    right = points[cells[kind]].mean(axis=1)[:, 0] > WIDE / 2
    cells[kind][right] = twin[cells[kind][right]]
    return body_of(np.concatenate([points, points[line]]), cells)


def pulled(body, size, strategy=None, speed=0.5, also=(), **opens):
    x = body.points[:, 0]
    velocity = np.column_stack([speed * (2 * x / WIDE - 1), 0 * x])
    drive = {"left": {"x": -speed}, "right": {"x": speed}}
    pieces = cn.fracture.split(body, zone(size), ROCK, drive=drive, velocity=velocity, **opens)
    scene = cn.Scene(dim=2)
    scene.add(*also)
    pieces.add_to(scene)
    step = 0.25 * size / np.sqrt(YOUNG / 2500.0)
    return cn.Simulation(scene, step, strategy or cn.NSCD(theta=0.52, solver=cn.NLGS(tol=1e-5)))


def opening_of(points, cells, threshold=1.0):
    return opening_faces.checked(body_of(np.asarray(points, float), cells), zone(1.0), threshold)


def copies(opening, node):
    return np.count_nonzero(opening.former == node)


# ---------------------------------------------------------------------- which nodes part


def four_squares():
    x = np.arange(3.0)
    points = np.stack(np.meshgrid(x, x, indexing="ij"), -1).reshape(-1, 2)
    n = np.arange(9).reshape(3, 3)
    return points, {"quad": np.stack([n[:-1, :-1], n[1:, :-1], n[1:, 1:], n[:-1, 1:]], -1).reshape(-1, 4)}


def face(opening, *nodes):
    """Number of the face between two nodes of the start."""
    ends = np.sort(opening.start_node[opening.corners[:, 0]], axis=1)
    return np.flatnonzero((ends == np.sort(nodes)).all(axis=1))


def test_a_node_parts_only_where_open_faces_separate_the_cells_round_it():
    opening = opening_of(*four_squares())
    assert len(opening.cells) == 4 and np.allclose(np.abs(opening.normal).sum(axis=1), 1)
    one = opening.opened(face(opening, 1, 4))  # from the side of the body to its middle
    assert copies(one, 1) == 2 and copies(one, 4) == 1 and len(one.shown) == 1
    through = one.opened(face(one, 4, 7))
    assert copies(through, 4) == 2 and copies(through, 7) == 2 and through.shown.tolist() == sorted(through.shown.tolist())
    assert len(np.unique(through.parts())) == 2
    bent = one.opened(face(one, 4, 3))  # the corner of one square
    assert copies(bent, 4) == 2 and np.bincount(bent.parts()).tolist() in ([8, 4], [4, 8])
    three = through.opened(face(through, 4, 5))
    assert copies(three, 4) == 3 and len(np.unique(three.parts())) == 3
    every = opening.opened(np.arange(4))
    assert copies(every, 4) == 4 and len(every.former) == 16 and len(np.unique(every.parts())) == 4
    # what stood there keeps its number, whatever the order
    assert np.array_equal(through.former[:9], np.arange(9)) and np.all(
        through.node[through.node < 9] == opening.node[through.node < 9]
    )


def test_a_face_inside_opens_nothing_alone_and_cells_that_touch_at_a_point_stay_together():
    points, triangles, _ = crossed(2, 1)
    opening = opening_of(points, triangles)
    inner = face(opening, *np.flatnonzero(np.abs(points[:, 0] - 0.5 * WIDE) < 1e-9))
    alone = opening.opened(face(opening, 0, 6))
    assert copies(alone, 6) == 1 and copies(alone, 0) == 2
    assert len(opening.opened(inner).former) == len(points) + 2  # it crosses the strip
    tie = opening_of([[0, 0], [1, 0], [1, 1], [0, 1], [2, 1], [2, 2], [1, 2]],
                     {"quad": np.array([[0, 1, 2, 3], [2, 4, 5, 6]]), "triangle": np.array([[1, 4, 2]])})  # fmt: skip
    split = tie.opened(face(tie, 1, 2))
    assert copies(split, 2) == 2 and copies(split, 1) == 2 and len(np.unique(split.parts())) == 2
    hourglass = opening_of([[0, 0], [1, 0], [1, 1], [0, 1], [2, 1], [2, 2], [1, 2], [0, 2]],
                           {"quad": np.array([[0, 1, 2, 3], [2, 4, 5, 6]]), "triangle": np.array([[2, 6, 7]])})  # fmt: skip
    assert copies(hourglass.opened(face(hourglass, 2, 6)), 2) == 2  # the squares go on touching at it


def at_rest(opening, u, held):
    """Tractions at rest."""
    still = np.zeros_like(u)
    return opening.forces.tractions(opening.forces.asked(u, still, still), opening.mean_traction(u), held)


def test_traction_of_a_uniform_stress_is_that_stress_on_the_normal():
    points, _, quads = crossed(2, 2, 2.0, 2.0)
    opening = opening_of(points[:9], quads, threshold=0.999)
    x = opening.body.points
    held = np.repeat(np.any((x < 0.1) | (x > 1.9), axis=1)[:, None], 2, axis=1)
    strain = np.array([[1.0, 0.0], [0.0, 0.0]]) * 3e6 * (1 + 0.2) * (1 - 0.4) / (YOUNG * 0.8)
    upright = np.flatnonzero(np.abs(opening.normal[:, 0]) > 0.5)
    pulled = at_rest(opening, x @ strain, held)
    assert pulled[upright] == pytest.approx(np.sign(opening.normal[upright])[:, None] * [3e6, 0] + 0 * pulled[upright], abs=1)
    assert np.array_equal(opening.above(pulled), upright)
    assert not len(opening.above(-pulled)) and not len(opening.above(0.99 * pulled))
    shear = np.array([[0.0, 1.0], [1.0, 0.0]]) * 6e6 * (1 + 0.2) / YOUNG
    assert len(opening.above(at_rest(opening, x @ shear, held))) == 4
    with pytest.raises(ValueError, match="traction on the face between cells"):
        opening.above(np.full_like(pulled, np.nan))


@pytest.mark.parametrize("lumped", [False, True])
def test_tractions_bring_every_corner_of_a_cell_into_balance(lumped):
    """A plate released from a random shape, partly cracked: tractions of faces balance forces of cells, inertia included."""
    points, triangles, _ = crossed(4, 3)
    given = {"density": {"triangle": np.linspace(1e3, 3e3, 48)}, "lumped": lumped, "rayleigh": (10.0, 1e-7)}
    body = cn.ElasticBody(points, triangles, young=YOUNG, poisson=0.2, **given)
    opening = opening_faces.checked(body, zone(1.0), 1.0)
    ends = points[opening.start_node[opening.corners[:, 0]]]
    opening = opening.opened(np.flatnonzero(np.abs(ends[..., 0] - WIDE / 2).max(axis=1) < 1e-9)[:2])
    assert len(opening.former) > len(points)
    u, v = np.random.default_rng(3).normal(size=(2, len(opening.former), 2)) * [[[1e-6]], [[1e-2]]]
    from scipy.sparse.linalg import spsolve

    a = spsolve(opening.body.M, -(opening.body.K @ u.ravel() + opening.body.C @ v.ravel())).reshape(-1, 2)
    asked = opening.forces.asked(u, v, a)
    found = opening.forces.tractions(asked, opening.mean_traction(u), np.zeros_like(u, dtype=bool))
    given = np.zeros_like(asked)
    for end in range(2):
        joined = opening.forces.joined[:, end]
        force = found[joined, end] * opening.share[joined, end, None]
        np.add.at(given, opening.corners[joined, 0, end], force)
        np.add.at(given, opening.corners[joined, 1, end], -force)
    assert np.abs(given - asked).max() < 1e-10 * np.abs(asked).max()


def test_initial_stress_opens_faces_and_holds_them_shut():
    """A bar held at its ends: an initial tension of 2.5 MPa opens the faces across it, a compression none."""
    points, triangles, _ = crossed(4, 2)
    for stress, opens in ((2.5e6, True), (1.9e6, False), (-5e6, False)):
        body = body_of(points, triangles, initial_stress=(stress, 0, 0, 0, 0, 0))
        opening = opening_faces.checked(body, zone(1.0), 0.7)  # of 3 MPa
        still, held = np.zeros_like(points), np.zeros(points.shape, bool)
        held[body.groups["left"]] = held[body.groups["right"]] = True
        traction = at_rest(opening, still, held)
        expected = stress * opening.normal[:, None] * [1.0, 0.0] + 0 * traction
        assert traction == pytest.approx(expected, abs=1e-9 * abs(stress))
        across = np.flatnonzero(np.abs(opening.normal[:, 0]) > 1 - 1e-9)
        found = opening.above(traction)
        assert np.array_equal(np.intersect1d(found, across), across) if opens else not len(found)
        sums = np.zeros(points.shape)
        np.add.at(sums, opening.node, opening.forces.asked(still, still, still))
        assert sums.ravel() == pytest.approx(body.initial_force, abs=1e-9 * np.abs(body.initial_force).max())


def test_a_bar_under_initial_stress_cracks_at_its_whole_stress():
    points, triangles, _ = crossed(4, 2)
    found = []
    for stress in (0.0, -2e6, 1e6):
        body = body_of(points, triangles, initial_stress=(stress, 0, 0, 0, 0, 0))
        sim = pulled(body, HIGH / 2, speed=0.1, opens="threshold")
        while not sim.meshes[0]._mesh.d.opening.is_open.any():
            sim.step()
        found.append(sim.meshes[0].stress["triangle"][:, 0].max())
    assert found == pytest.approx([found[0]] * 3, rel=0.06)  # of which a step adds so much


def test_laws_of_a_thin_plate_are_those_of_the_material_times_its_thickness():
    """Stiffnesses, strengths and works: the same faces open then in the same steps."""
    found = []
    for thickness in (1.0, 2.0**-7):
        body = notched(4)
        body = body_of(body.points, body.cells, thickness=thickness)
        law = zone(HIGH / 4)
        law = zone(HIGH / 4, **{name: thickness * getattr(law, name) for name in law.parameter_names if name != "mu"})
        opening = opening_faces.checked(body, law, 1.0)
        u = body.points * [1e-4, 0.0] + np.random.default_rng(4).normal(size=body.points.shape) * 2e-7
        found.append(opening.above(at_rest(opening, u, np.zeros(u.shape, bool))))
    assert np.array_equal(*found) and 0 < len(found[0]) < len(opening.cells)


def test_what_cells_ask_in_a_step_is_what_zones_give_them():
    """Sums over the corners of a node, of which faces that are closed bear nothing."""
    from cairn.run import cracks

    sim = pulled(notched(4), HIGH / 4, opens="threshold")
    while len(sim.nodes.id) < len(notched(4).points) + 6:
        sim.step()
    sim._watches.clear()
    sim.step()  # faces opened last have their zone now
    mesh = sim.meshes[0]._mesh
    opening, seen = mesh.d.opening, []
    opening.forces.tractions = lambda asked, mean, held: seen.append((asked, held))
    cracks.tractions(sim, sim.meshes[0])
    asked, held = seen[0]
    sums = np.zeros(held.shape)
    np.add.at(sums, opening.node, asked)
    zones = cracks._of_zones(sim._core, mesh, sim.report["dt"])
    assert np.abs(sums[~held]).max() < 1e-3 * np.abs(zones).max()
    assert np.abs(np.add.reduce(zones)).max() < 1e-12 * np.abs(zones).max()


# ---------------------------------------------------------------------- what passes over


def quantities(sim):
    """Mass, momentum and energy of a mesh."""
    mesh = sim.meshes[0]
    u, v = mesh.displacement.ravel(), mesh.velocity.ravel()
    p = (mesh.body.M @ v).reshape(-1, 2)
    return np.array([mesh.body.nodal_mass().sum(), *p.sum(axis=0), 0.5 * v @ (mesh.body.M @ v), 0.5 * u @ (mesh.body.K @ u)])


@pytest.mark.parametrize(
    "kind, lumped, integrator", [("triangle", False, None), ("triangle", True, "hht"), ("quad", False, None)]
)
def test_mass_momentum_and_energy_pass_over(kind, lumped, integrator):
    points, triangles, quads = crossed(4, 2)
    body = body_of(points if kind == "triangle" else points[: 5 * 3], triangles if kind == "triangle" else quads, lumped=lumped)
    strategy = cn.NSCD(integrator=cn.HHT(alpha=-0.1), solver=cn.NLGS(tol=1e-8)) if integrator else None
    sim = pulled(body, HIGH / 2, strategy, opens="threshold", threshold=np.inf)
    for _ in range(20):
        sim.step()
    before, faces = quantities(sim), len(sim.meshes[0]._mesh.d.opening.cells)
    x = sim.nodes.position.copy()
    cn.run.cracks.open_faces(sim, sim.meshes[0]._mesh, np.arange(faces))
    after, cells = quantities(sim), sum(len(c) for c in body.cells.values())
    assert np.abs(after - before).max() < 1e-12 * np.abs(before).max()
    assert np.all(np.abs(after - before) <= 1e-12 * np.maximum(np.abs(before), np.abs(before[3])))
    assert len(sim.nodes.id) == sum(c.size for c in body.cells.values()) and np.array_equal(sim.nodes.position[: len(x)], x)
    assert sim.nodes.mass.sum() == pytest.approx(before[0], rel=1e-13)
    assert len(cn.post.fragments(sim, beta=1.0)) == cells
    sim.step()
    assert np.all(sim.contacts.beta > 0) and len(sim.contacts.beta) == 2 * faces
    assert len(cn.post.fragments(sim)) == 1
    for _ in range(5):
        sim.step()
    terms = sim.info["energy"]
    assert abs(terms["closure"]) < 1e-12 * terms["in_play"] and terms["dissipated_reshaping"] == 0


def test_a_face_holds_from_its_first_step_where_its_sides_still_share_the_end_of_the_crack():
    points, _, quads = crossed(2, 2)
    sim = pulled(body_of(points[:9], quads), HIGH / 2, speed=0.05, opens="threshold", threshold=np.inf)
    sim.step()
    opening = sim.meshes[0]._mesh.d.opening
    cn.run.cracks.open_faces(sim, sim.meshes[0]._mesh, face(opening, 3, 4))
    for _ in range(8):
        sim.step()
        assert len(sim.contacts.beta) == 2 and np.all(sim.contacts.beta == 1) and sim.contacts.stored.sum() > 0
    assert np.all(sim.contacts.impulse_local[:, 0] < 0)  # it pulls
    share = sim.contacts.relative_velocity[:, 0]
    assert np.sort(np.abs(share))[0] / np.sort(np.abs(share))[1] == pytest.approx(0.2113 / 0.7887, rel=1e-3)  # zero at the end


def test_all_faces_open_at_a_threshold_of_nothing_and_none_at_one_without_end():
    body = notched(2)
    sim = pulled(body, HIGH / 2, opens="threshold", threshold=0.0)
    sim.step()
    assert len(sim.nodes.id) == 3 * len(body.cells["triangle"])
    assert len(cn.post.fragments(sim, beta=1.0)) == len(body.cells["triangle"])
    whole, plain = pulled(body, HIGH / 2, opens="threshold", threshold=np.inf), cn.Scene(dim=2)
    x = body.points[:, 0]
    plain.add(cn.deformable(body, ROCK, drive={"left": {"x": -0.5}, "right": {"x": 0.5}},
                            velocity=np.column_stack([x / WIDE - 0.5, 0 * x])))  # fmt: skip
    plain = cn.Simulation(plain, whole.dt, whole.strategy)
    for _ in range(60):
        whole.step()
        plain.step()
    assert np.array_equal(whole.nodes.position, plain.nodes.position) and len(whole.contacts.beta) == 0


# ---------------------------------------------------------------------- cracks


def crack(sim, until):
    """Points whose zones are damaged by more than half, and the released energy."""
    while sim.time < until:
        assert sim.step()["status"] == "converged"
    return sim.contacts.point[sim.contacts.beta < 0.5, :2], sim.info["energy"]


@pytest.mark.parametrize("kind", ["triangle", "quad"])
def test_a_notched_plate_cracks_as_one_of_single_cells(kind):
    across, time = 6, 60e-6
    size = HIGH / across
    cells, one = crack(pulled(notched(across, kind), size), time)
    sim = pulled(notched(across, kind), size, opens="threshold")
    faces, other = crack(sim, time)
    away = np.linalg.norm(cells[:, None] - faces[None], axis=2)
    assert len(cells) > across and max(away.min(axis=0).max(), away.min(axis=1).max()) < size
    assert other["released"] == pytest.approx(one["released"], rel=0.05) and one["released"] > 0.5
    assert other["work_external"] == pytest.approx(one["work_external"], rel=0.05)
    assert abs(other["closure"]) < 1e-12 * other["in_play"] and other["dissipated_reshaping"] == 0
    pieces = cn.post.fragments(sim)  # one mesh is two bodies now; in between are cells that zones hold
    assert len(pieces) == 2 and pieces[0][0] == sim.nodes.id[0] and pieces[1][0] in sim.nodes.id
    opening = sim.meshes[0]._mesh.d.opening
    assert 0 < len(opening.shown) < len(opening.cells)


def test_a_run_goes_on_from_a_checkpoint_and_back_to_one(tmp_path):
    across = 4
    size = HIGH / across
    body = notched(across)
    sim = pulled(body, size, opens="threshold")
    first = tmp_path / "whole.checkpoint.h5"
    sim.checkpoint(first)
    while len(sim.nodes.id) < len(body.points) + 3:
        sim.step()
    sim.step()
    kept = tmp_path / "cracked.checkpoint.h5"
    sim.checkpoint(kept)
    nodes = len(sim.nodes.id)
    sim.run(steps=15, output=tmp_path / "crack.vtkhdf", every=5, progress=False)
    assert len(sim.nodes.id) > nodes
    again = pulled(body, size, opens="threshold")
    again.restore(kept)
    assert len(again.nodes.id) == nodes
    for _ in range(15):
        again.step()
    for name in ("id", "position", "velocity", "mass"):
        assert np.array_equal(getattr(sim.nodes, name), getattr(again.nodes, name)), name
    assert np.array_equal(sim.contacts.beta, again.contacts.beta) and sim.energy == again.energy
    out = cn.load(tmp_path / "crack.vtkhdf")[-1]
    assert np.array_equal(np.sort(out.drawn["id"]), sim.nodes.id)
    sim.restore(kept)
    assert len(sim.nodes.id) == nodes and len(sim.meshes[0].body.points) == nodes
    sim.restore(first)
    assert len(sim.nodes.id) == len(body.points) == len(sim.meshes[0].body.points)
    sim.step()
    content = cn.post.checkpoint.load(kept)
    content["cracks"]["000000"]["node"] = content["cracks"]["000000"]["node"][::-1].copy()
    cn.post.checkpoint.save(kept, content)
    with pytest.raises(cn.FileError, match="damaged"):
        again.restore(kept)
    again.step()


def test_a_scene_file_keeps_what_may_open(tmp_path):
    size = HIGH / 2
    sim = pulled(notched(2), size, opens="threshold", threshold=0.3)
    sim.scene.save(tmp_path / "plate.scene.h5")
    scene = cn.Scene.load(tmp_path / "plate.scene.h5")
    again = cn.Simulation(scene, sim.dt, sim.strategy)
    for _ in range(40):
        sim.step()
        again.step()
    assert len(sim.nodes.id) > len(notched(2).points) and np.array_equal(sim.nodes.position, again.nodes.position)
    fresh = cn.Simulation(sim.scene, sim.dt, sim.strategy)  # the scene has the plate as it came in
    assert len(fresh.nodes.id) == len(notched(2).points)


def test_beside_other_bodies_and_meshes_contacts_keep_their_names():
    """A disk rests on a block behind which nodes and sides of a plate that cracks come in."""
    block = cn.ElasticBody(np.array([[0.2, 0.0], [0.3, 0.0], [0.3, 0.1], [0.2, 0.1]]), {"quad": [[0, 1, 2, 3]]}, young=YOUNG,
                           poisson=0.2, density=2500.0, groups={"low": [0, 1], "top": [2, 3]})  # fmt: skip

    def scene_of(cracks):
        scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
        if cracks:
            body = notched(2)
            x = body.points[:, 0]
            drive = {"left": {"x": -0.5}, "right": {"x": 0.5}}
            velocity = np.column_stack([x - 0.05, 0 * x])
            cn.fracture.split(body, zone(HIGH / 2), ROCK, opens="threshold", velocity=velocity, drive=drive).add_to(scene)
        scene.add(cn.deformable(block, ROCK, edges="top", fixed={"low": "xy"}, name="block"))
        scene.add(cn.disks([[0.25, 0.11]], 0.01, cn.Material("steel", density=7800.0)))
        scene.interact("steel", "*", cn.Coulomb(mu=0.3))
        return cn.Simulation(scene, 1e-6, cn.NSCD(theta=0.52, solver=cn.NLGS(tol=1e-10)))

    sim, alone = scene_of(True), scene_of(False)
    disk, was = sim.bodies.id[0], len(sim.nodes.id)
    for _ in range(60):
        sim.step()
        alone.step()
        rest = np.flatnonzero((sim.contacts.bodies == disk).any(axis=1))
        assert len(rest) == 1 and set(sim.contacts.bodies[rest[0]]) & set(sim.meshes[1].ids)
    assert len(sim.nodes.id) > was
    assert sim.contacts.impulse[rest[0]] == pytest.approx(alone.contacts.impulse[0], rel=1e-6, abs=1e-14)
    assert sim.meshes[1].displacement == pytest.approx(alone.meshes[0].displacement, rel=1e-6, abs=1e-20)


@pytest.mark.parametrize(
    "given, told",
    [
        ({"opens": "always"}, "opens is 'always'"),
        ({"opens": "threshold", "threshold": np.nan}, "threshold"),
        ({"opens": "threshold", "threshold": -1.0}, "threshold is -1"),
        ({"opens": "threshold", "law": cn.Bonded(mu=0.3)}, "no strength of faces"),
        ({"opens": "threshold", "law": zone(1.0, normal_strength=0.0)}, "give strengths above 0"),
        ({"opens": "threshold", "body": "second"}, "first order"),
        ({"opens": "threshold", "body": "single"}, "so none can open: give cells that share nodes"),
    ],
)
def test_what_cannot_open_is_refused(given, told):
    points, quads = four_squares()
    bodies = {
        "second": ([[0, 0], [1, 0], [0, 1], [0.5, 0], [0.5, 0.5], [0, 0.5]], {"triangle6": [[0, 1, 2, 3, 4, 5]]}),
        "single": ([[0, 0], [1, 0], [0, 1]], {"triangle": [[0, 1, 2]]}),
        None: (points, quads),
    }
    points, cells = bodies[given.pop("body", None)]
    body = cn.ElasticBody(
        np.array(points, float), {k: np.array(c) for k, c in cells.items()}, young=1.0, poisson=0.2, density=1.0
    )
    with pytest.raises(ValueError, match=told):
        cn.fracture.split(body, given.pop("law", zone(1.0)), ROCK, **given)


def test_strengths_of_laws_are_where_they_begin_to_soften():
    pair = {"normal_stiffness": 1e12, "tangential_stiffness": 1e12, "mu": 0.0}
    assert opening_faces.strengths_of(cn.MAC(**pair, work=10.0)) == pytest.approx((3.1622777e6, 3.1622777e6))
    assert opening_faces.strengths_of(cn.MP(**pair, work=10.0)) == pytest.approx((2.406036e6, 2.406036e6), rel=1e-6)
    assert opening_faces.strengths_of(cn.MP3(**pair, strength=2e6, work=10.0)) == (2e6, 2e6)
