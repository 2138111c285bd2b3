"""Displacements given as functions of time, rigid parts of a mesh, meshes tied to each other: motion and conserved quantities."""

import cairn as cn
import numpy as np
import pytest
from test_mortar_faces import block, spread

ROCK = cn.Material("rock", density=1000.0)


def grid(cells, size, corner=(0.0, 0.0)):
    """Points, quadrilaterals and groups of a rectangle."""
    x, y = (np.linspace(c, c + s, n + 1) for c, s, n in zip(corner, size, cells))
    points = np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2)
    number = np.arange(len(points)).reshape(cells[0] + 1, cells[1] + 1)
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], -1).reshape(-1, 4)
    return points, {"quad": quads}, {"top": number[:, -1], "bottom": number[:, 0], "left": number[0], "right": number[-1]}


def elastic(cells=(2, 4), size=(1.0, 2.0), corner=(0.0, 0.0), **more):
    points, quads, groups = grid(cells, size, corner)
    given = {"young": 1e6, "poisson": 0.0, "density": 1000.0, "plane": "stress"} | more
    return cn.ElasticBody(points, quads, groups=groups, **given)


def simulation(body, h=1e-3, theta=0.5, gravity=(0.0, 0.0), newton_tol=1e-8, **more):
    scene = cn.Scene(dim=2, gravity=gravity)
    scene.add(cn.deformable(body, ROCK, **more))
    return cn.Simulation(scene, h, cn.NSCD(theta, cn.Default(tol=1e-12), newton_tol=newton_tol))


# ---------------------------------------------------------------------- displacements


@pytest.mark.parametrize("theta", [0.5, 0.6, 1.0])
def test_a_group_is_where_its_displacement_says(theta):
    """A ramp that a body at rest takes by surprise: two steps on it is there, whatever theta, and does not ring."""
    body = elastic()
    sim = simulation(body, theta=theta, fixed={"bottom": "xy"}, displace={"top": {"y": lambda t: -0.3 * t}})
    for step in range(1, 21):
        sim.step()
        if step >= 2:
            top = sim.meshes[0].displacement[body.groups["top"], 1]
            assert np.abs(top + 0.3 * sim.time).max() < 1e-14
            assert np.abs(sim.meshes[0].velocity[body.groups["top"], 1] + 0.3).max() < 1e-11


def test_a_displacement_that_bends_is_met_to_the_cube_of_the_step():
    errors = []
    for h in (2e-3, 1e-3):
        body = elastic()
        sim = simulation(body, h, displace={"top": {"y": lambda t: 0.01 * np.sin(20 * t)}}, fixed={"bottom": "xy"})
        worst = 0.0
        while sim.time < 0.1:
            sim.step()
            top = sim.meshes[0].displacement[body.groups["top"], 1]
            if sim.steps > 2:  # it came from rest
                worst = max(worst, np.abs(top - 0.01 * np.sin(20 * sim.time)).max())
        errors.append(worst)
    assert errors[0] / errors[1] > 6 and errors[1] < 1e-8


def test_reactions_of_what_is_displaced():
    """A bar pulled out and held: F = E A u / L at both ends, told by the reactions of the groups."""
    ramp = cn.Table([0.0, 0.5], [0.0, 1e-3])
    body = elastic(rayleigh=(20.0, 0.0))
    sim = simulation(body, 1e-2, 1.0, fixed={"bottom": "xy"}, displace={"top": {"y": ramp}})
    sim.run(steps=400, progress=False)
    pull = 1e6 * 1.0 * 1e-3 / 2.0
    assert sim.meshes[0].reaction("top")[1] == pytest.approx(pull, rel=1e-9)
    assert sim.meshes[0].reaction("bottom")[1] == pytest.approx(-pull, rel=1e-9)
    assert sim.info["energy"]["closure"] < 1e-10 * sim.info["energy"]["in_play"]


def test_displacements_that_are_none_are_told():
    with pytest.raises(ValueError, match="function of time"):
        cn.deformable(elastic(), ROCK, displace={"top": {"y": 0.1}})
    with pytest.raises(ValueError, match="moved already"):
        cn.deformable(elastic(), ROCK, drive={"top": {"y": 1.0}}, displace={"top": {"y": lambda t: t}})


# ---------------------------------------------------------------------- rigid parts


def angular_momentum(sim):
    mesh = sim.meshes[0]
    x, v = mesh.displacement + mesh.body.points, mesh.velocity
    p = (mesh.body.M @ v.ravel()).reshape(-1, 2)
    return np.sum(x[:, 0] * p[:, 1] - x[:, 1] * p[:, 0]), p.sum(axis=0)


def test_a_rigid_part_turns_whole_and_keeps_energy_and_angular_momentum():
    """Half of a rubber block that spins and shears is rigid: its distances stay over half a turn."""
    points, quads, groups = grid((4, 2), (2.0, 1.0))
    groups["hub"] = np.flatnonzero(points[:, 0] < 1.1)
    rubber = cn.SaintVenantKirchhoff(young=1e6, poisson=0.3)
    body = cn.SolidBody(points, quads, rubber, density=1000.0, groups=groups)
    start = np.array([[0, -8.0], [8.0, 0]]) @ (points - points.mean(axis=0)).T
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(body, ROCK, velocity=start.T, rigid="hub"))
    sim = cn.Simulation(scene, 4e-3, cn.NSCD(integrator=cn.DiscreteGradient(), newton_tol=1e-10))

    def apart():
        x = (sim.meshes[0].displacement + points)[groups["hub"]]
        return np.linalg.norm(x[:, None] - x[None], axis=2)

    first, (spin, push), at_start = apart(), angular_momentum(sim), 0.5 * np.sum(start.T.ravel() * (body.M @ start.T.ravel()))
    for _ in range(110):
        sim.step()
        assert sim.info["status"] == "converged"
    assert np.abs(apart() - first).max() < 1e-11
    later, pushed = angular_momentum(sim)
    assert later == pytest.approx(spin, rel=1e-9) and np.abs(pushed - push).max() < 1e-9 * spin
    energy = sim.info["energy"]
    kept = energy["kinetic"] + energy["stored"]
    assert abs(energy["closure"]) < 1e-12 * energy["in_play"] and kept == pytest.approx(at_start, rel=1e-8)
    turned = (sim.meshes[0].displacement + points)[groups["hub"]] - points[groups["hub"]]
    assert np.abs(turned).max() > 0.5


def test_a_rigid_end_of_a_linear_body_stays_straight():
    """A cantilever with a rigid head: sections beyond the load turn by one angle, small as linear bodies turn."""
    points, quads, groups = grid((8, 2), (4.0, 1.0))
    groups["head"] = np.flatnonzero(points[:, 0] > 2.9)
    body = cn.ElasticBody(points, quads, young=1e6, poisson=0.2, density=100.0, groups=groups, rayleigh=(0.0, 0.01))
    sim = simulation(body, 1.0, 1.0, fixed={"left": "xy"}, rigid="head", force={"right": (0.0, -10.0)})
    sim.run(steps=60, progress=False)
    u = sim.meshes[0].displacement
    head, r = u[groups["head"]], points[groups["head"]]
    angle = (head[-1, 1] - head[0, 1]) / (r[-1, 0] - r[0, 0])
    expected = head[0] + angle * np.stack([-(r[:, 1] - r[0, 1]), r[:, 0] - r[0, 0]], 1)
    assert angle < -1e-5 and np.abs(head - expected).max() < 1e-14
    assert sim.meshes[0].reaction("left")[1] == pytest.approx(10.0, rel=1e-6)


def test_rigid_parts_in_space_keep_their_distances():
    n = np.arange(3 * 3 * 5).reshape(3, 3, 5)
    points = np.stack(np.meshgrid(np.arange(3.0), np.arange(3.0), np.arange(5.0), indexing="ij"), -1).reshape(-1, 3) / 4
    low = n[:-1, :-1, :-1], n[1:, :-1, :-1], n[1:, 1:, :-1], n[:-1, 1:, :-1]
    high = n[:-1, :-1, 1:], n[1:, :-1, 1:], n[1:, 1:, 1:], n[:-1, 1:, 1:]
    cells = {"hexahedron": np.stack([*low, *high], -1).reshape(-1, 8)}
    groups = {"foot": np.flatnonzero(points[:, 2] < 0.3)}
    body = cn.SolidBody(points, cells, cn.NeoHookean(young=1e5, poisson=0.3), density=1000.0, groups=groups)
    spin = np.array([3.0, -5.0, 8.0])
    scene = cn.Scene(dim=3)
    scene.add(cn.deformable(body, ROCK, velocity=np.cross(spin, points - points.mean(axis=0)), rigid=["foot"]))
    sim = cn.Simulation(scene, 2e-3, cn.NSCD(0.5, newton_tol=1e-10))

    def apart():
        x = (sim.meshes[0].displacement + points)[groups["foot"]]
        return np.linalg.norm(x[:, None] - x[None], axis=2)

    first = apart()
    for _ in range(40):
        sim.step()
    assert np.abs(apart() - first).max() < 1e-12
    assert abs(sim.info["energy"]["closure"]) < 1e-10 * sim.info["energy"]["in_play"]


def test_what_cannot_be_rigid_is_told():
    with pytest.raises(ValueError, match="leave a spin free"):
        simulation(elastic(), rigid=[[3]])
    with pytest.raises(ValueError, match="rigid part and held"):
        simulation(elastic(), rigid="top", fixed={"right": "x"})
    with pytest.raises(ValueError, match="two rigid parts"):
        simulation(elastic(), rigid=["top", "right"])


# ---------------------------------------------------------------------- tied meshes


def halves(below=3, above=2, **more):
    """A square cut along its middle, with other numbers of cells on the two sides."""
    under = elastic((below, 2), (1.0, 0.5), **more)
    over = elastic((above, 3), (1.0, 0.5), (0.0, 0.5), **more)
    return cn.tied({"under": under, "over": over}, [("over.bottom", "under.top")])


@pytest.mark.parametrize("cells", [(3, 2), (2, 3), (4, 7), (5, 5)])
def test_a_uniform_stress_goes_through_a_tie_of_any_cells(cells):
    body = halves(*cells, poisson=0.3)
    load = np.zeros_like(body.points)
    top = np.sort(body.groups["over.top"])
    share = np.full(len(top), 1.0 / (len(top) - 1))
    share[[0, -1]] /= 2
    load[top, 1] = -1e3 * share
    corner = body.groups["under.bottom"][:1]
    body.groups["corner"] = corner
    u = body.solve({"under.bottom": "y", "corner": "x"}, load.ravel())
    stress = np.concatenate([s for s in body.stress(u).values()])
    assert np.abs(stress - [0.0, -1e3, 0.0]).max() < 1e-8


def test_tied_bodies_in_the_step_rest_as_at_rest():
    """The same load in a scene, damped to rest: the displacement of `solve`; momentum through the tie, and the energy closes."""
    body = halves(rayleigh=(0.0, 2e-3), poisson=0.3)
    sim = simulation(body, 0.5, 1.0, fixed={"under.bottom": "xy"}, force={"over.top": (50.0, -100.0)})
    sim.run(steps=60, progress=False)
    rest = body.solve({"under.bottom": "xy"}, {"over.top": (50.0, -100.0)})
    assert np.abs(sim.meshes[0].displacement - rest).max() < 1e-9 * np.abs(rest).max()
    assert np.allclose(sim.meshes[0].reaction("under.bottom"), (-50.0, 100.0), rtol=1e-8)
    energy = sim.info["energy"]
    assert abs(energy["closure"]) < 1e-11 * energy["in_play"]


@pytest.mark.parametrize("solid", [False, True])
def test_what_leads_bears_the_forces_of_what_follows(solid):
    """The side that leads is held: its reaction is the load on the other part, at rest."""
    body = halves(rayleigh=(0.0, 2e-3), poisson=0.3)
    if solid:
        both = [cn.SolidBody(p.points, p.cells, cn.IsotropicElastic(young=1e6, poisson=0.3), density=1000.0, groups=p.groups)
                for p in body.parts.values()]  # fmt: skip
        body = cn.tied(dict(zip(body.parts, both)), [("over.bottom", "under.top")])
    sim = simulation(body, 0.5, 1.0, fixed={"under.all": "xy"}, force={"over.top": (50.0, -100.0)})
    sim.run(steps=60, progress=False)
    assert np.allclose(sim.meshes[0].reaction("under.all"), (-50.0, 100.0), rtol=1e-6)
    assert np.allclose(sim.meshes[0].reaction().sum(axis=0), (-50.0, 100.0), rtol=1e-6)


def test_tied_bodies_in_flight_keep_their_momentum_and_meet_what_they_fall_on():
    body = halves()
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(body, ROCK, velocity=(0.5, -1.0), contact="under.bottom"))
    scene.add(cn.wall((0, -0.01), (0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(0.5, cn.Default(tol=1e-12)))
    mesh = sim.meshes[0]
    p = (body.M @ mesh.velocity.ravel()).reshape(-1, 2).sum(axis=0)
    for _ in range(120):
        sim.step()
        impulse = mesh.contact_force.sum(axis=0) * sim.dt
        now = (body.M @ mesh.velocity.ravel()).reshape(-1, 2).sum(axis=0)
        assert np.abs(now - p - impulse).max() < 1e-10 * np.abs(p).max()
        p = now
    assert p[1] > 0
    t, _ = body.free_motion()
    assert np.abs(t @ mesh.displacement[np.setdiff1d(np.arange(len(body.points)), body.ties[0])].ravel()
                  - mesh.displacement.ravel()).max() < 1e-13  # fmt: skip
    assert abs(sim.info["energy"]["closure"]) < 1e-11 * sim.info["energy"]["in_play"]


@pytest.mark.parametrize("bound", ["tied", "rigid"])
@pytest.mark.parametrize("values", [4, 5, 6])
def test_derivatives_of_what_follows_follow(values, bound):
    """Derivatives computed from velocities given by ties would grow in each step: rounding dominated the energy in some hundred
    steps."""
    body = halves() if bound == "tied" else elastic((4, 2))
    scene = cn.Scene(dim=2)
    velocity = 0.1 * np.stack([body.points[:, 1] ** 2, body.points[:, 0]], 1)
    scene.add(cn.deformable(body, ROCK, velocity=velocity, **({} if bound == "tied" else {"rigid": "top"})))
    dt = 0.5 * cn.Simulation(scene, 1e-9, cn.NSCD(integrator=cn.Gear(values=values))).stable_step
    sim = cn.Simulation(scene, dt, cn.NSCD(integrator=cn.Gear(values=values)))
    sim.run(steps=150, progress=False)
    energy = sim.info["energy"]
    assert abs(energy["closure"]) < 1e-12 * energy["in_play"]
    assert energy["kinetic"] + energy["stored"] < 1.2 * energy["largest_kinetic"]


@pytest.mark.parametrize(("above", "below"), [
    (("hexahedron", (2, 3, 1)), ("hexahedron", (3, 2, 1))), (("hexahedron", (4, 4, 1)), ("hexahedron", (2, 2, 2))),
    (("hexahedron", (2, 1, 1)), ("hexahedron", (3, 5, 1))), (("tetra", (3, 2, 1)), ("tetra", (2, 3, 1))),
    (("tetra", (2, 3, 1)), ("hexahedron", (3, 1, 1))), (("hexahedron", (3, 2, 1)), ("tetra", (2, 2, 1))),
])  # fmt: skip
def test_a_uniform_stress_goes_through_a_tie_in_space(above, below):
    """The patch test between faces that do not match: stress, linear displacement, and momentum through the tie."""
    over, under = block(*above, (0.0, 0.0, 0.5)), block(*below, (0.0, 0.0, 0.0))
    load = spread(over, 1e3)
    over.groups = {name: np.asarray(nodes) for name, nodes in over.groups.items()}
    body = cn.tied({"over": over, "under": under}, [("over.bottom", "under.top")])
    hold = {"over.left": "x", "under.left": "x", "over.front": "y", "under.front": "y", "under.bottom": "z"}
    held = {}  # slave nodes are left out: their masters are held
    for group, axis in hold.items():
        held[group] = axis
        body.groups[group] = np.setdiff1d(body.groups[group], body.ties[0])
    u = body.solve(held, {f"over.{group}": force for group, force in load.items()})
    stress = np.concatenate([s for s in body.stress(u).values()])
    assert np.abs(stress - [0.0, 0.0, -1e3, 0.0, 0.0, 0.0]).max() < 1e-10 * 1e3
    wanted = body.points * [0.3e-3, 0.3e-3, -1e-3]
    assert np.abs(u - wanted).max() < 1e-13
    _, start, _, weight = body.ties
    assert np.abs(np.add.reduceat(weight, start[:-1]) - 1).max() < 1e-13


def test_nodes_follow_all_that_their_faces_meet():
    """Nodes follow more than the face that they lie on: of 2 by 3 cells on 3 by 2 those within follow the nodes of several."""
    over, under = block("hexahedron", (2, 3, 1), (0.0, 0.0, 0.5)), block("hexahedron", (3, 2, 1), (0.0, 0.0, 0.0))
    body = cn.tied({"over": over, "under": under}, [("over.bottom", "under.top")])
    nodes, start, leaders, _ = body.ties
    inner = np.flatnonzero(np.all(np.abs(body.points[nodes, :2] - 0.5) < 0.4, axis=1))
    assert len(inner) and all(start[k + 1] - start[k] > 4 for k in inner)  # the nodes of more than one face


def test_faces_that_do_not_lie_on_others_are_told():
    over, under = block("hexahedron", (2, 2, 1), (0.3, 0.0, 0.5)), block("hexahedron", (3, 2, 1), (0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match=r"0\.4 of the face of nodes .* of 'over.bottom' lies on 'under.top'"):
        cn.tied({"over": over, "under": under}, [("over.bottom", "under.top")])
    apart = block("hexahedron", (2, 2, 1), (0.0, 0.0, 0.51))
    with pytest.raises(ValueError, match="0 of the face of nodes .* give a larger within"):
        cn.tied({"over": apart, "under": under}, [("over.bottom", "under.top")])
    assert len(cn.tied({"over": apart, "under": under}, [("over.bottom", "under.top")], within=0.05).ties[0]) == 9


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("shift", [1e-8, 1e-4])
def test_a_strip_beyond_the_other_side_is_within(dim, shift):
    """Moved sideways the side reaches beyond the other's end: linear fields pass to rounding, a uniform stress to that order."""
    if dim == 2:
        under, over = elastic((3, 2), (1.0, 0.5)), elastic((4, 3), (1.0, 0.5), (shift, 0.5))
    else:
        under = block("hexahedron", (2, 3, 1), (0.0, 0.0, 0.0))
        over = block("hexahedron", (3, 2, 1), (shift, -shift / 2, 0.5))
    load = spread(over, 1e3)
    over.groups = {name: np.asarray(nodes) for name, nodes in over.groups.items()}
    made = {"over": over, "under": under}, [("over.bottom", "under.top")]
    body = cn.tied(*made, within=1e-3)
    nodes, start, leaders, weight = body.ties
    for k, node in enumerate(nodes):
        own = slice(start[k], start[k + 1])
        assert np.abs(weight[own] @ body.points[leaders[own]] - body.points[node]).max() < 1e-12 * np.ptp(body.points)
        assert weight[own].sum() == pytest.approx(1.0, rel=1e-12)
    body.groups["corner"] = body.groups["under.bottom"][:1]
    u = body.solve({"under.bottom": "xyz"[dim - 1], "corner": "xy"[: dim - 1], "under.left": "x"},
                   {f"over.{group}": force for group, force in load.items()})  # fmt: skip
    stress = np.concatenate([s for s in body.stress(u).values()])
    wanted = np.zeros(stress.shape[1])
    wanted[dim - 1] = -1e3
    assert np.abs(stress - wanted).max() < 20 * shift * 1e3
    small = shift / 100
    with pytest.raises(ValueError, match=r"is missing: move it over the other, .* or give a larger within, \S+ or more") as told:
        cn.tied(*made, within=small)
    needed = float(str(told.value).split("larger within, ")[1].split()[0])
    assert shift / 8 < needed < 8 * shift
    assert len(cn.tied(*made, within=needed).ties[0]) == len(nodes)


@pytest.mark.parametrize("within", [np.nan, np.inf, -1, "a"])
def test_a_within_that_is_no_distance_is_told(within):
    parts = {"under": elastic((3, 2), (1.0, 0.5)), "over": elastic((2, 3), (1.0, 0.5), (0.0, 0.5))}
    with pytest.raises(ValueError, match=f"within of tied is {within!r}: give a finite number"):
        cn.tied(parts, [("over.bottom", "under.top")], within=within)


def test_a_rubber_part_on_an_elastic_one_and_several_materials_of_one_kind(tmp_path):
    """Cells of two materials, and a stiff body tied under a soft one: states by kinds of cells, and a restart."""
    points, quads, groups = grid((4, 4), (1.0, 1.0), (0.0, 0.5))
    which = (np.arange(16) >= 8).astype(int)
    soft, steel = cn.NeoHookean(young=1e4, poisson=0.4), cn.FiniteJ2(young=1e5, poisson=0.3, yield_stress=1e2)
    over = cn.SolidBody(points, quads, {"quad": ([soft, steel], which)}, density=1000.0, groups=groups)
    both = cn.tied(
        {"under": elastic((3, 2), (1.0, 0.5), young=1e5, plane="strain"), "over": over}, [("over.bottom", "under.top")]
    )
    sim = simulation(both, 5e-3, 1.0, gravity=(0.0, -9.81), fixed={"under.bottom": "xy"})
    sim.run(steps=20, progress=False)
    mesh = sim.meshes[0]
    assert mesh.stress["quad"].shape == (22, 6)
    plastic = mesh.material_state["quad"]["accumulated_plastic_strain"]
    assert not plastic[:14].any() and plastic[14:].max() > 0
    before = simulation(both, 5e-3, 1.0, gravity=(0.0, -9.81), fixed={"under.bottom": "xy"})
    before.run(steps=10, progress=False)
    again = simulation(both, 5e-3, 1.0, gravity=(0.0, -9.81), fixed={"under.bottom": "xy"})
    before.checkpoint(tmp_path / "half")
    again.restore(tmp_path / "half")
    again.run(steps=10, progress=False)
    assert np.array_equal(again.meshes[0].displacement, mesh.displacement)


def test_scene_files_hold_ties_and_rigid_parts(tmp_path):
    body = halves()
    more = {"rigid": "over.top", "displace": {"under.bottom": {"y": cn.Table([0.0, 1.0], [0.0, 0.1])}}}
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.deformable(body, ROCK, fixed={"under.left": "x"}, **more))
    path = str(tmp_path / "tied.scene")
    scene.save(path)
    found = []
    for one in (scene, cn.Scene.load(path)):
        sim = cn.Simulation(one, 1e-3)
        sim.run(steps=5, progress=False)
        found.append(sim.meshes[0].displacement)
    assert np.array_equal(*found) and np.abs(found[0]).max() > 0


def test_ties_that_do_not_meet_are_told():
    under, over = elastic((3, 2), (1.0, 0.5)), elastic((2, 3), (1.2, 0.5), (0.0, 0.5))
    with pytest.raises(ValueError, match=r"0\.666667 of the edge of nodes"):
        cn.tied({"under": under, "over": over}, [("over.bottom", "under.top")])
    with pytest.raises(ValueError, match="follows and is followed"):
        cn.tied({"under": under, "over": elastic((2, 3), (1.0, 0.5), (0.0, 0.5))},
                [("over.bottom", "under.top"), ("under.top", "over.bottom")])  # fmt: skip


@pytest.mark.parametrize("of", ["tied", "rigid"])
def test_shapes_at_rest_and_problems_of_what_follows_are_refused(of):
    """Both need bodies whose dofs are all independent; the simulation stays unchanged."""
    body, more = (halves(), {}) if of == "tied" else (elastic(), {"rigid": "top"})
    bottom = "under.bottom" if of == "tied" else "bottom"
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.wall((0, 0), (0, 1), ROCK), cn.deformable(body, ROCK, contact=bottom, **more))
    scene.interact(ROCK, ROCK, cn.GapCoulomb(mu=0.3))
    sim = cn.Simulation(scene, 1e-3)
    sim.run(steps=3, progress=False)
    before = sim.meshes[0].displacement.copy(), sim.meshes[0].velocity.copy()
    with pytest.raises(ValueError, match="has ties or rigid parts"):
        sim.problem()
    with pytest.raises(ValueError, match="has ties or rigid parts: rest is found"):
        cn.find_equilibrium(sim)
    assert np.array_equal(before[0], sim.meshes[0].displacement) and np.array_equal(before[1], sim.meshes[0].velocity)
    assert sim.step()["status"] == "converged"
