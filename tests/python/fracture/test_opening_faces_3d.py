"""One mesh in space whose faces open by threshold: tractions, what passes over when faces open, and that the crack is that of a
mesh all of whose cells are bodies of their own."""

import itertools

import cairn as cn
import numpy as np
import pytest
from cairn.model import opening_faces
from test_opening_faces import HIGH, ROCK, WIDE, YOUNG, at_rest, body_of, copies, crack, quantities, zone


def blocks(along, across, deep, size, kind):
    """Cubes, of tetrahedra six each."""
    n = (along + 1, across + 1, deep + 1)
    number = np.arange(np.prod(n)).reshape(n)
    points = np.stack(np.meshgrid(*[size * np.arange(k) for k in n], indexing="ij"), -1).reshape(-1, 3)

    def corner(i, j, k):
        return number[i : along + i, j : across + j, k : deep + k].ravel()

    if kind == "hexahedron":
        order = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
        return points, {kind: np.stack([corner(*at) for at in order], 1)}
    cells = []
    for axes in itertools.permutations(range(3)):
        at = np.vstack([np.zeros(3, int), np.cumsum(np.eye(3, dtype=int)[list(axes)], axis=0)])
        if np.linalg.det(np.diff(at, axis=0)) < 0:
            at[[1, 2]] = at[[2, 1]]
        cells.append(np.stack([corner(*c) for c in at], 1))
    return points, {kind: np.concatenate(cells)}


def notched(across, kind):
    """A plate one cube thick with a notch in the middle of its lower side, three tenths of its height long."""
    points, cells = blocks(2 * across, across, 1, HIGH / across, kind)
    line = np.flatnonzero((np.abs(points[:, 0] - WIDE / 2) < 1e-9) & (points[:, 1] < 0.3 * HIGH - 1e-9))
    twin = np.arange(len(points))
    twin[line] = len(points) + np.arange(len(line))
    right = points[cells[kind]].mean(axis=1)[:, 0] > WIDE / 2
    cells[kind][right] = twin[cells[kind][right]]
    return body_of(np.concatenate([points, points[line]]), cells)


def pulled(body, size, speed=0.5, **opens):
    x = body.points[:, 0]
    velocity = np.column_stack([speed * (2 * x / x.max() - 1), 0 * x, 0 * x])
    drive = {"left": {"x": -speed}, "right": {"x": speed}}
    scene = cn.Scene(dim=3)
    cn.fracture.split(body, zone(size), ROCK, drive=drive, velocity=velocity, **opens).add_to(scene)
    step = 0.25 * size / np.sqrt(YOUNG / 2500.0)
    return cn.Simulation(scene, step, cn.NSCD(theta=0.52, solver=cn.NLGS(tol=1e-5)))


def tilted(points, by=(0.2, -0.1, 0.3)):
    """Cubes made parallelepipeds whose sides look everywhere."""
    return points @ (np.eye(3) + np.outer(by, (0.3, 0.5, -0.2)))


KINDS = pytest.mark.parametrize("kind", ["tetra", "hexahedron"])


@KINDS
def test_traction_of_a_uniform_stress_is_that_stress_on_the_normal(kind):
    points, cells = blocks(2, 2, 2, 1.0, kind)
    body = body_of(tilted(points), cells)
    opening = opening_faces.checked(body, zone(1.0), 0.999)
    border = np.any((points < 0.1) | (points > 1.9), axis=1)
    strain = np.array([[1.0, 0.3, -0.2], [0.3, 0.4, 0.1], [-0.2, 0.1, -0.6]]) * 1e-4
    lame, shear = YOUNG * 0.2 / (1.2 * 0.6), YOUNG / 2.4
    stress = lame * np.trace(strain) * np.eye(3) + 2 * shear * strain
    found = at_rest(opening, body.points @ strain, np.repeat(border[:, None], 3, axis=1))
    expected = opening.normal @ stress
    assert found == pytest.approx(np.repeat(expected[:, None], opening.corners.shape[2], axis=1), abs=1e-9 * np.abs(stress).max())
    normal = np.einsum("fc,fc->f", expected, opening.normal)
    along = np.linalg.norm(expected - normal[:, None] * opening.normal, axis=1)
    size = np.hypot(np.maximum(normal, 0) / 3e6, along / 6e6)
    least = np.sort(size)[len(size) // 2] * (1 + 1e-6)
    opening.threshold = least
    assert np.array_equal(opening.above(found), np.flatnonzero(size >= least)) and 0 < np.count_nonzero(size >= least) < len(size)


def test_areas_of_corners_are_integrals_of_their_functions():
    x = np.array([[[0.0, 0, 0], [3, 0, 0], [1, 2, 0], [0, 2, 0]]])  # a trapezium
    normal, share = opening_faces._normals(x)
    assert normal == pytest.approx(np.array([[0, 0, 1.0]])) and share.sum() == pytest.approx(4, rel=1e-14)
    s, w = np.polynomial.legendre.leggauss(4)
    s, w = (s + 1) / 2, w / 2
    a, b = np.meshgrid(s, s, indexing="ij")
    width, area = 3 - 2 * b, 2 * (3 - 2 * b) * np.outer(w, w)  # of a point, by the map of the unit square
    functions = [(1 - a) * (1 - b), a * (1 - b), a * b, (1 - a) * b]
    assert width.min() > 0 and share[0] == pytest.approx([np.sum(f * area) for f in functions], rel=1e-12)
    triangle = opening_faces._normals(x[:, :3])[1]
    assert triangle == pytest.approx(np.ones((1, 3)), rel=1e-14)


@KINDS
def test_tractions_bring_every_corner_of_a_cell_into_balance(kind):
    """A block released from a random shape, partly cracked: tractions of faces balance forces of cells, inertia included."""
    points, cells = blocks(3, 2, 2, 1.0, kind)
    points = points + 0.1 * np.random.default_rng(5).uniform(-1, 1, points.shape)
    body = cn.ElasticBody(points, cells, young=YOUNG, poisson=0.2, density=2500.0, rayleigh=(10.0, 1e-7))
    opening = opening_faces.checked(body, zone(1.0), 1.0)
    start = blocks(3, 2, 2, 1.0, kind)[0][opening.start_node[opening.corners[:, 0]]]
    opening = opening.opened(np.flatnonzero((np.abs(start[..., 0] - 1) < 1e-9).all(axis=1) & (start[..., 1] < 1.1).all(axis=1)))
    assert len(opening.former) == len(points) + 3  # along the edge of the lower side; the others are the front of the crack
    u, v = np.random.default_rng(3).normal(size=(2, len(opening.former), 3)) * [[[1e-6]], [[1e-2]]]
    from scipy.sparse.linalg import spsolve

    a = spsolve(opening.body.M, -(opening.body.K @ u.ravel() + opening.body.C @ v.ravel())).reshape(-1, 3)
    asked = opening.forces.asked(u, v, a)
    found = opening.forces.tractions(asked, opening.mean_traction(u), np.zeros_like(u, dtype=bool))
    given = np.zeros_like(asked)
    for end in range(opening.corners.shape[2]):
        joined = opening.forces.joined[:, end]
        force = found[joined, end] * opening.share[joined, end, None]
        np.add.at(given, opening.corners[joined, 0, end], force)
        np.add.at(given, opening.corners[joined, 1, end], -force)
    assert np.abs(given - asked).max() < 1e-10 * np.abs(asked).max()


@KINDS
def test_mass_momentum_and_energy_pass_over(kind):
    points, cells = blocks(3, 2, 2, HIGH / 2, kind)
    sim = pulled(body_of(points, cells), HIGH / 2, opens="threshold", threshold=np.inf)
    for _ in range(10):
        sim.step()
    mesh = sim.meshes[0]

    def told():
        v = sim.meshes[0].velocity
        return np.array([*quantities(sim)[[0, -2, -1]], *(sim.meshes[0].body.M @ v.ravel()).reshape(-1, 3).sum(axis=0)])

    before, opening = told(), mesh._mesh.d.opening
    cn.run.cracks.open_faces(sim, mesh._mesh, np.arange(len(opening.cells)))
    after = told()
    assert after[:3] == pytest.approx(before[:3], rel=1e-12)
    assert np.abs(after[3:] - before[3:]).max() < 1e-12 * np.abs(sim.meshes[0].body.M @ sim.meshes[0].velocity.ravel()).sum()
    assert len(sim.nodes.id) == cells[kind].size and len(cn.post.fragments(sim, beta=1.0)) == len(cells[kind])
    sim.step()
    faces = len(opening.cells)
    assert np.all(sim.contacts.beta > 0) and len(sim.contacts.beta) == len(opening.rule) * faces
    assert len(cn.post.fragments(sim)) == 1
    for _ in range(5):
        sim.step()
    terms = sim.info["energy"]
    assert abs(terms["closure"]) < 1e-12 * terms["in_play"] and terms["dissipated_reshaping"] == 0


@KINDS
def test_what_cells_ask_in_a_step_is_what_zones_give_them(kind):
    """Sums over the corners of a node, of which faces that are closed bear nothing."""
    from cairn.run import cracks

    body = notched(3, kind)
    sim = pulled(body, HIGH / 3, opens="threshold")
    while len(sim.nodes.id) < len(body.points) + 3:
        sim.step()
    sim._watches.clear()
    sim.strategy = cn.NSCD(theta=0.52, solver=cn.NLGS(tol=1e-9))
    sim.step()  # faces opened last have their zone now
    mesh = sim.meshes[0]._mesh
    opening, seen = mesh.d.opening, []
    opening.forces.tractions = lambda asked, mean, held: seen.append((asked, held))
    cracks.tractions(sim, sim.meshes[0])
    asked, held = seen[0]
    sums = np.zeros(held.shape)
    np.add.at(sums, opening.node, asked)
    zones = cracks._of_zones(sim._core, mesh, sim.report["dt"])
    assert np.abs(sums[~held]).max() < 1e-4 * np.abs(zones).max()  # sides that slid meet elsewhere
    assert np.abs(np.add.reduce(zones)).max() < 1e-12 * np.abs(zones).max()


@pytest.mark.parametrize("kind, across", [("tetra", 3), ("hexahedron", 4)])
def test_a_notched_plate_cracks_as_one_of_single_cells(kind, across):
    size, time = HIGH / across, 60e-6
    cells, one = crack3(pulled(notched(across, kind), size), time)
    sim = pulled(notched(across, kind), size, opens="threshold")
    faces, other = crack3(sim, time)
    away = np.linalg.norm(cells[:, None] - faces[None], axis=2)
    assert len(cells) > 2 * across and max(away.min(axis=0).max(), away.min(axis=1).max()) < size
    assert other["released"] == pytest.approx(one["released"], rel=0.05) and one["released"] > 0.3 * one["work_external"]
    assert other["work_external"] == pytest.approx(one["work_external"], rel=0.05)
    assert abs(other["closure"]) < 1e-12 * other["in_play"] and other["dissipated_reshaping"] == 0
    assert len(cn.post.fragments(sim)) == 2


def crack3(sim, until):
    """Points whose zones are damaged by more than half, (k, 3), and the energies."""
    _, energy = crack(sim, until)
    return sim.contacts.point[sim.contacts.beta < 0.5], energy


@KINDS
def test_a_run_goes_on_from_a_checkpoint_and_a_scene_file_keeps_what_may_open(kind, tmp_path):
    across = 2
    size, body = HIGH / across, notched(across, kind)
    sim = pulled(body, size, opens="threshold", threshold=0.3)
    sim.scene.save(tmp_path / "plate.scene.h5")
    other = cn.Simulation(cn.Scene.load(tmp_path / "plate.scene.h5"), sim.dt, sim.strategy)
    while len(sim.nodes.id) == len(body.points):
        sim.step()
        other.step()
    sim.step()
    other.step()
    assert np.array_equal(sim.nodes.position, other.nodes.position)
    sim.checkpoint(tmp_path / "cracked.checkpoint.h5")
    again = pulled(body, size, opens="threshold", threshold=0.3)
    again.restore(tmp_path / "cracked.checkpoint.h5")
    sim.run(steps=12, output=tmp_path / "crack.vtkhdf", every=6, progress=False)
    again.run(steps=12, progress=False)
    for name in ("id", "position", "velocity", "mass"):
        assert np.array_equal(getattr(sim.nodes, name), getattr(again.nodes, name)), name
    assert np.array_equal(sim.contacts.beta, again.contacts.beta) and sim.energy == again.energy
    assert np.array_equal(np.sort(cn.load(tmp_path / "crack.vtkhdf")[-1].drawn["id"]), sim.nodes.id)


def test_an_edge_where_no_face_is_in_common_stays_together():
    points, cells = blocks(2, 2, 1, 1.0, "hexahedron")
    cells["hexahedron"] = cells["hexahedron"][[0, 1, 3]]  # the first and the last of these touch at an edge beside the middle one
    opening = opening_faces.checked(body_of(points[np.unique(cells["hexahedron"])],
                                            {"hexahedron": np.searchsorted(np.unique(cells["hexahedron"]), cells["hexahedron"])}),
                                    zone(1.0), 1.0)  # fmt: skip
    assert len(opening.cells) == 2
    every = opening.opened(np.arange(2))
    middle = np.flatnonzero(np.bincount(opening.node, minlength=len(opening.former)) == 3)
    assert len(middle) == 2 and all(copies(every, m) == 3 for m in middle) and len(np.unique(every.parts())) == 3


def test_cells_of_two_kinds_are_refused():
    points, cells = blocks(2, 1, 1, 1.0, "hexahedron")
    tetra = np.array([[len(points), len(points) + 1, len(points) + 2, len(points) + 3]])
    points = np.concatenate([points, 10 + np.vstack([np.zeros(3), np.eye(3)])])
    with pytest.raises(ValueError, match="cells of one kind"):
        cn.fracture.split(body_of(points, cells | {"tetra": tetra}), zone(1.0), ROCK, opens="threshold")


@pytest.mark.parametrize("opens", [{}, {"opens": "threshold", "threshold": np.inf}])
@pytest.mark.parametrize("warp", [0.0, 1e-6, 0.01, 0.1])
def test_points_of_warped_faces_are_bonded_whatever_the_warp(warp, opens):
    """Each point is bonded once, to the opposite face, in a plate at rest, a cube thick, whose nodes are displaced by a share
    `warp` of the cube."""
    size = HIGH / 3
    points, cells = blocks(3, 3, 1, size, "hexahedron")
    body = body_of(points + warp * size * np.random.default_rng(5).uniform(-1, 1, points.shape), cells)
    sim = pulled(body, size, speed=0.0, **opens)
    if opens:
        mesh = sim.meshes[0]._mesh
        cn.run.cracks.open_faces(sim, mesh, np.arange(len(mesh.d.opening.cells)))
    sim.step()
    assert np.count_nonzero(sim.contacts.beta == 1) == len(sim.contacts.beta) == 4 * 12
    assert np.abs(sim.contacts.gap).max() < 0.11 * 4 * warp * size + 1e-12 * size


def test_a_law_that_joins_what_touches_alone_is_refused_where_faces_are_warped():
    points, cells = blocks(2, 1, 1, 1.0, "hexahedron")
    points[5] += 0.1
    with pytest.raises(ValueError, match="sides of cells are warped by up to .* m: give a law with a parameter within"):
        cn.fracture.split(body_of(points, cells), cn.Bonded(mu=0.3), ROCK)


@pytest.mark.parametrize("opens", [{}, {"opens": "threshold"}])
def test_sides_too_warped_for_points_to_meet_once_are_refused(opens):
    points, cells = blocks(2, 1, 1, 1.0, "hexahedron")
    points[5, 0] += 0.5
    with pytest.raises(ValueError, match="a side of two cells is warped by 0.3.* of its size: give cells whose sides are plane"):
        cn.fracture.split(body_of(points, cells), zone(1.0), ROCK, **opens)


def test_tetra_beside_hexahedra_share_no_whole_sides():
    points, hexahedra = blocks(2, 1, 1, 0.01, "hexahedron")
    _, tetra = blocks(2, 1, 1, 0.01, "tetra")
    right = points[tetra["tetra"]].mean(axis=1)[:, 0] > 0.01
    cells = {"hexahedron": hexahedra["hexahedron"][:1], "tetra": tetra["tetra"][right]}
    both = cn.ElasticBody(points, cells, young=1e9, poisson=0.2, density=1000.0)
    with pytest.raises(ValueError, match=r"half of the side of nodes \d+, \d+, \d+, \d+ of another"):
        cn.fracture.split(both, zone(0.01), ROCK)
