"""Mortar contact of meshes in space and of sides of second order: uniform pressure, friction, Hertz, what stays."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=1000.0)
CORNERS = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])
TETRAHEDRA = [[0, 1, 3, 7], [0, 1, 7, 5], [0, 5, 7, 4], [1, 2, 3, 7], [1, 2, 7, 6], [1, 6, 7, 5]]
EDGES = {
    "tetra10": [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)],
    "hexahedron": [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)],
}
MIDDLES = [(0, 1, 1), (2, 1, 1), (1, 0, 1), (1, 2, 1), (1, 1, 0), (1, 1, 2), (1, 1, 1)]


def corners_of(kind):
    """Places of the nodes of the cells that a cube of 2 by 2 by 2 is cut into."""
    cube = [tuple(2 * c) for c in CORNERS]

    def middle(one, two):
        return tuple((np.array(one) + two) // 2)

    if kind.startswith("tetra"):
        cells = [[cube[k] for k in cell] for cell in TETRAHEDRA]
        return [c + [middle(c[i], c[j]) for i, j in EDGES["tetra10"]] for c in cells] if kind == "tetra10" else cells
    if kind == "hexahedron":
        return [cube]
    return [cube + [middle(cube[i], cube[j]) for i, j in EDGES["hexahedron"]] + (MIDDLES if kind == "hexahedron27" else [])]


def mesh(kind, cells, size=(1.0, 1.0, 0.5), skew=0.0):
    """Points, cells and groups of a block; skew moves its nodes along its faces."""
    axes = [np.linspace(0.0, s, 2 * n + 1) for s, n in zip(size, cells)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    number = np.arange(points[..., 0].size).reshape(points.shape[:3])
    cube = [slice(2 * i, 2 * i + 3) for i in range(max(cells))]
    blocks = [number[cube[i], cube[j], cube[k]] for i, j, k in np.ndindex(*cells)]
    made = np.array([[block[place] for place in cell] for block in blocks for cell in corners_of(kind)])
    used, made = np.unique(made, return_inverse=True)
    points, made = points.reshape(-1, 3)[used], made.reshape(-1, len(corners_of(kind)[0]))
    x, y = points[:, 0] / size[0], points[:, 1] / size[1]
    points[:, 0] += skew * np.sin(np.pi * x) * np.sin(np.pi * y)
    points[:, 1] -= skew * np.sin(2 * np.pi * x) * np.sin(np.pi * y)
    at = {"left": (0, 0.0), "right": (0, size[0]), "front": (1, 0.0), "bottom": (2, 0.0), "top": (2, size[2])}
    return points, {kind: made}, {name: np.flatnonzero(np.abs(points[:, k] - v) < 1e-9) for name, (k, v) in at.items()}


def block(kind, cells, corner, skew=0.0, size=(1.0, 1.0, 0.5), **more):
    points, cells, groups = mesh(kind, cells, size, skew)
    given = {"young": 1e6, "poisson": 0.3, "density": 1000.0} | more
    return cn.ElasticBody(points + corner, cells, groups=groups, **given)


def spread(body, pressure):
    """Forces of nodes, {group: force}, of a pressure on the top: those of a uniform stress along z."""
    strain = np.array([-0.3, -0.3, 1.0])[-body.dim :] * body.points
    force = (body.K @ strain.ravel()).reshape(-1, body.dim)[:, -1] / 1e6
    body.groups |= {f"load {k}": [k] for k in body.groups["top"]}
    return {f"load {k}": (*[0.0] * (body.dim - 1), -pressure * force[k]) for k in body.groups["top"]}


def patch(above, below, skew=(0.0, 0.0), steps=40):
    """A block on another under a pressure of 1 kPa, brought to rest by long implicit steps."""
    over, under = block(*above, (0.0, 0.0, 0.5), skew[0]), block(*below, (0.0, 0.0, 0.0), skew[1])
    scene, hold = cn.Scene(dim=3), {"left": "x", "front": "y"}
    scene.add(cn.deformable(over, ROCK, contact="bottom", faces="bottom", mortar=True, force=spread(over, 1e3), fixed=hold))
    scene.add(cn.deformable(under, ROCK, faces="top", fixed=hold | {"bottom": "z"}, name="under"))
    scene.interact(ROCK, ROCK, cn.GapCoulomb(mu=0.0))
    sim = cn.Simulation(scene, 1.0, cn.NSCD(1.0, cn.Default(tol=1e-14)), overlap="ignore")
    for _ in range(steps):
        report = sim.step()
    assert report["contacts"] == len(over.groups["bottom"])
    stress = np.concatenate([part.reshape(-1, 6) for m in sim.meshes for part in m.stress.values()])
    return sim, np.abs(stress - [0.0, 0.0, -1e3, 0.0, 0.0, 0.0]).max() / 1e3


CASES = [
    (("hexahedron", (2, 2, 1)), ("hexahedron", (3, 3, 1))),
    (("tetra", (3, 2, 1)), ("tetra", (2, 3, 1))),
    (("tetra", (2, 3, 1)), ("hexahedron", (3, 1, 1))),
    (("tetra10", (2, 2, 1)), ("tetra10", (3, 2, 1))),
    (("hexahedron20", (2, 1, 1)), ("hexahedron20", (3, 2, 1))),
    (("hexahedron27", (1, 2, 1)), ("hexahedron27", (2, 3, 1))),
    (("hexahedron20", (2, 2, 1)), ("tetra", (3, 3, 1))),
    (("hexahedron", (4, 4, 1)), ("hexahedron20", (3, 3, 1))),
]


@pytest.mark.parametrize(("above", "below"), CASES)
def test_a_uniform_pressure_goes_through_exactly(above, below):
    """The patch test between cells that do not match, of first and second order: stresses to rounding, momentum, too."""
    sim, error = patch(above, below)
    assert error < 1e-10
    assert np.abs(sim.meshes[0].contact_force.sum(axis=0) + sim.meshes[1].contact_force.sum(axis=0)).max() < 1e-9


def test_distorted_quadrilaterals_pass_it_as_their_rule_does():
    """Sides that are no parallelograms have shape functions that are no polynomials: the error is that of the rule."""
    _, error = patch(("hexahedron", (4, 4, 1)), ("hexahedron", (3, 3, 1)), skew=(0.06, 0.05))
    assert error < 1e-9


def flat(kind, cells, corner, size=(1.0, 0.5)):
    axes = [np.linspace(0.0, s, 2 * n + 1) for s, n in zip(size, cells)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    number = np.arange(points[..., 0].size).reshape(points.shape[:2])
    square = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1), (1, 1)][: int(kind[4:])]
    made = np.array([[number[2 * i + a, 2 * j + b] for a, b in square] for i, j in np.ndindex(*cells)])
    used, made = np.unique(made, return_inverse=True)
    points = points.reshape(-1, 2)[used]
    at = {"left": (0, 0.0), "bottom": (1, 0.0), "top": (1, size[1])}
    groups = {name: np.flatnonzero(np.abs(points[:, k] - v) < 1e-9) for name, (k, v) in at.items()}
    cells = {kind: made.reshape(-1, len(square))}
    return cn.ElasticBody(points + corner, cells, young=1e6, poisson=0.3, density=1000.0, groups=groups, plane="stress")


@pytest.mark.parametrize(("above", "below"), [("quad8", "quad8"), ("quad9", "quad8")])
def test_parabolic_edges_pass_it_in_the_plane(above, below):
    over, under = flat(above, (2, 1), (0.0, 0.5)), flat(below, (3, 1), (0.0, 0.0))
    scene = cn.Scene(dim=2)
    scene.add(
        cn.deformable(
            over, ROCK, contact="bottom", edges="bottom", mortar=True, force=spread(over, 1e3), fixed={"left": "x"}, name="over"
        )
    )
    scene.add(cn.deformable(under, ROCK, edges="top", fixed={"bottom": "y", "left": "x"}, name="under"))
    scene.interact(ROCK, ROCK, cn.GapCoulomb(mu=0.0))
    sim = cn.Simulation(scene, 1.0, cn.NSCD(1.0, cn.Default(tol=1e-14)), overlap="ignore")
    for _ in range(40):
        sim.step()
    stress = np.concatenate([part.reshape(-1, 3) for m in sim.meshes for part in m.stress.values()])
    assert np.abs(stress - [0.0, -1e3, 0.0]).max() < 1e-10 * 1e3


def sliding(mu, push, steps=300, h=2e-3, kind="hexahedron", solid=False, strategy=None):
    """A block that is pushed over a longer one; the simulation, and the impulse of its contacts on the block above."""
    sizes = ((1.0, 1.0, 0.5), (2.0, 1.4, 0.5))
    parts = []
    for cells, size, corner in (((2, 2, 1), sizes[0], (0.2, 0.2, 0.5)), ((5, 3, 1), sizes[1], (0.0, 0.0, 0.0))):
        points, made, groups = mesh(kind, cells, size)
        if solid:
            material = cn.NeoHookean(young=1e6, poisson=0.3)
            parts.append(cn.SolidBody(points + corner, made, material, density=1000.0, groups=groups))
        else:
            body = cn.ElasticBody(
                points + corner, made, young=1e6, poisson=0.3, density=1000.0, groups=groups, rayleigh=(0.0, 2e-3)
            )
            parts.append(body)
    over, under = parts
    scene = cn.Scene(dim=3, gravity=(0.0, 0.0, -10.0))
    force = {"top": tuple(push)}
    scene.add(cn.deformable(over, ROCK, contact="bottom", faces="bottom", mortar=True, force=force, name="over"))
    scene.add(cn.deformable(under, ROCK, faces="top", fixed={"bottom": "xyz"}, name="under"))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=mu))
    sim = cn.Simulation(scene, h, strategy or cn.NSCD(0.5, cn.Default(tol=1e-12)))
    total = np.zeros(3)
    for _ in range(steps):
        sim.step()
        total += sim.meshes[0].contact_force.sum(axis=0) * h
        assert np.abs(sim.meshes[0].contact_force.sum(axis=0) + sim.meshes[1].contact_force.sum(axis=0)).max() < 1e-8
    return sim, total


def test_a_block_slides_over_faces_by_coulombs_law():
    """Friction is mu times the normal impulse, along the slip; momentum passes whole, energy closes."""
    push = np.array([1600.0, 800.0, 0.0])
    sim, total = sliding(0.3, push)
    over = sim.meshes[0]
    p = (over.body.M @ over.velocity.ravel()).reshape(-1, 3).sum(axis=0)
    loads = (push + [0.0, 0.0, -5000.0]) * sim.time
    assert np.abs(p - total - loads).max() < 1e-8 * 5000
    assert np.linalg.norm(total[:2]) == pytest.approx(0.3 * total[2], rel=0.06)
    assert total[1] / total[0] == pytest.approx(0.5, rel=0.02) and total[0] < 0
    energy = sim.info["energy"]
    assert abs(energy["closure"]) < 1e-11 * energy["in_play"] and energy["dissipated_friction"] > 0


def test_it_sticks_below_the_cone():
    sim, total = sliding(1.0, np.array([1600.0, 800.0, 0.0]))
    slid, _ = sliding(0.3, np.array([1600.0, 800.0, 0.0]))
    bottom = sim.meshes[0].body.groups["bottom"]
    held, moved = (np.abs(s.meshes[0].displacement[bottom, 0]).max() for s in (sim, slid))
    assert held < 0.1 * moved and np.linalg.norm(total[:2]) < total[2]


def test_solids_of_large_strain_meet_by_it():
    """Newton's method round contacts of means: one body of twenty-noded cells on another slides, and its energy closes."""
    strategy = cn.NSCD(0.5, cn.Default(tol=1e-10))
    sim, total = sliding(0.3, np.array([2500.0, 0.0, 0.0]), steps=20, kind="hexahedron20", solid=True, strategy=strategy)
    energy = sim.info["energy"]
    assert total[2] > 0 and -total[0] <= 0.3 * total[2] * (1 + 1e-6)
    assert abs(energy["closure"]) < 1e-9 * energy["in_play"]


def test_two_runs_and_a_restart_give_the_same_bits(tmp_path):
    def begin():
        return sliding(0.3, np.array([1600.0, 800.0, 0.0]), steps=20)[0]

    one, two = begin(), begin()
    one.checkpoint(tmp_path / "state.h5")
    three = sliding(0.3, np.array([1600.0, 800.0, 0.0]), steps=0)[0]
    three.restore(tmp_path / "state.h5")
    for sim in (one, two, three):
        sim.run(steps=20, progress=False)
    for sim in (two, three):
        for k in range(2):
            assert np.array_equal(one.meshes[k].velocity, sim.meshes[k].velocity)


def graded(half, fine, n):
    x = list(np.linspace(0.0, fine, n + 1))
    while x[-1] < half:
        x.append(x[-1] + 1.6 * (x[-1] - x[-2]))
    x = np.array(x)
    x[x > fine] = fine + (x[x > fine] - fine) * (half - fine) / (x[-1] - fine)
    return x


def quarter(n, a, radius, turned):
    """A quarter of a block of 8 a, n cells over a, whose face is round unless it is turned; and tributary areas of its nodes."""
    half = 8 * a
    x, z = graded(half, 1.2 * a, int(1.2 * n)), graded(half, 0.6 * a, int(0.6 * n))
    points = np.stack(np.meshgrid(x, x, z, indexing="ij"), -1)
    k = np.arange(points[..., 0].size).reshape(points.shape[:3])
    ends = [slice(None, -1), slice(1, None)]
    cells = np.stack([k[ends[i], ends[j], ends[l]] for i, j, l in CORNERS], -1).reshape(-1, 8)
    points = points.reshape(-1, 3)
    if turned:
        points, cells = points * (1, 1, -1), cells[:, [4, 5, 6, 7, 0, 1, 2, 3]]
    else:
        points[:, 2] += (points[:, 0] ** 2 + points[:, 1] ** 2) / (2 * radius) * (1 - points[:, 2] / half)
    groups = {"face": k[:, :, 0].ravel(), "base": k[:, :, -1].ravel(), "left": k[0].ravel(), "front": k[:, 0].ravel()}
    share = np.convolve(np.diff(x), [0.5, 0.5])
    body = cn.ElasticBody(points, {"hexahedron": cells}, young=1e9, poisson=0.3, density=1000.0, groups=groups)
    return body, np.outer(share, share).ravel()


def test_hertz_at_a_point_between_cells_of_other_sizes():
    """A round face on a flat one of the same material: pressure p0 sqrt(1 - (r / a)^2), within 2 %."""
    a, radius, stiffness = 0.01, 1.0, 1e9 / (2 * (1 - 0.3**2))
    load = 4 * stiffness * a**3 / (3 * radius)
    (over, share), (under, _) = quarter(7, a, radius, False), quarter(5, a, radius, True)
    near = np.flatnonzero(np.hypot(over.points[:, 0], over.points[:, 1]) < 1.5 * a)
    over.groups |= {f"load {k}": [node] for k, node in enumerate(over.groups["base"])}
    force = {f"load {k}": (0.0, 0.0, -load / 4 * s) for k, s in enumerate(share / share.sum())}
    scene, hold = cn.Scene(dim=3), {"left": "x", "front": "y"}
    contact = np.intersect1d(over.groups["face"], near)
    scene.add(cn.deformable(over, ROCK, contact=contact, faces="face", mortar=True, fixed=hold, force=force, name="over"))
    scene.add(cn.deformable(under, ROCK, faces="face", fixed=hold | {"base": "xyz"}, name="under"))
    scene.interact(ROCK, ROCK, cn.GapCoulomb(mu=0.0))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(1.0, cn.Default(tol=1e-7)), overlap="ignore")
    for _ in range(12):
        sim.step()
    face, p0 = over.groups["face"], 3 * load / (2 * np.pi * a * a)
    found, r = sim.meshes[0].contact_force[face, 2] / share, np.hypot(*over.points[face, :2].T)
    exact = p0 * np.sqrt(np.maximum(0.0, 1 - (r / a) ** 2))
    assert np.abs(found - exact)[r < 0.8 * a].max() < 0.02 * p0 and found[0] == pytest.approx(p0, rel=0.01)


def test_what_it_asks_for_is_told():
    with pytest.raises(ValueError, match="the faces between them: give contact and faces of that side"):
        cn.deformable(block("tetra", (1, 1, 1), (0.0, 0.0, 0.0)), ROCK, contact="bottom", mortar=True)
    sim, _ = sliding(0.3, np.array([0.0, 0.0, 0.0]), steps=1)
    with pytest.raises(cn.Error, match="'under' is a mortar over more than four nodes"):
        sim.problem()


def seen_from(over, under):
    """Contacts of a block above another at the start: their points along x, gaps and normals."""
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(over, ROCK, contact="bottom", edges="bottom", mortar=True, name="over"))
    scene.add(cn.deformable(under, ROCK, edges="top", fixed={"bottom": "xy"}, name="under"))
    scene.interact(ROCK, ROCK, cn.GapCoulomb(mu=0.0))
    sim = cn.Simulation(scene, 1e-9, cn.NSCD(1.0, margin=0.3), overlap="ignore")
    sim.step()
    return sim.contacts.point[:, 0], sim.contacts.gap, sim.contacts.normal


def moved(body, change):
    """The body with its nodes elsewhere."""
    return cn.ElasticBody(
        body.points + change, body.cells, young=1e6, poisson=0.3, density=1000.0, groups=body.groups, plane="stress"
    )


@pytest.mark.parametrize("above", ["quad8", "quad9"])
@pytest.mark.parametrize("below", ["quad8", "quad9"])
def test_gaps_over_a_slope_are_exact(above, below):
    """A flat side over one that falls by a tenth, other cells: the gap of each node is that where it is."""
    over, under = flat(above, (2, 1), (0.0, 0.52)), flat(below, (3, 1), (-0.5, 0.0), (2.0, 0.5))
    under = moved(under, np.stack([0 * under.points[:, 0], -0.1 * under.points[:, 0] * under.points[:, 1] / 0.5], 1))
    x, gap, _ = seen_from(over, under)
    assert len(x) == 5 and np.abs(gap - (0.02 + 0.1 * x)).max() < 1e-12


def test_gaps_of_a_curved_side_count_its_middle_nodes_twice():
    """Middle nodes lowered by d: of the functions that are positive on a side, theirs is 2 d lower than those of the corners."""
    over, under = flat("quad8", (2, 1), (0.0, 0.52)), flat("quad8", (3, 1), (-0.5, 0.0), (2.0, 0.5))
    middle = [n for n in over.groups["bottom"] if round(4 * over.points[n, 0]) % 2]
    change = np.zeros_like(over.points)
    change[middle, 1] = -1e-5
    x, gap, _ = seen_from(moved(over, change), under)
    assert np.abs(gap - np.where(np.round(4 * x) % 2 == 1, 0.02 - 2e-5, 0.02)).max() < 1e-8
