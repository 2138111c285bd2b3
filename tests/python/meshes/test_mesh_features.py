"""Features of scenes with rigid bodies in scenes with deformable ones: removal, projection, scene files, rest under load,
bonds."""

import cairn as cn
import numpy as np
import pytest
from cairn.model.elastic import ElasticBody
from cairn.post.measures import measure
from scipy import linalg
from second_order import box
from small_scenes import ROCK, differing, state

SHARP = cn.NSCD(theta=1.0, solver=cn.NLGS(tol=1e-10, max_iter=20000))


def block(at, counts, lengths, name="mesh", young=1e6, **options):
    """A block of quads or hexahedra with its lowest corner at a place; its bottom touches, its top is made of sides."""
    dim = len(counts)
    lines = [np.linspace(0, size, n + 1) + x for n, size, x in zip(counts, lengths, at)]
    points = np.stack(np.meshgrid(*lines, indexing="ij"), -1).reshape(-1, dim)
    number = np.arange(len(points)).reshape([n + 1 for n in counts])
    low, high = slice(None, -1), slice(1, None)
    if dim == 2:
        parts = [number[low, low], number[high, low], number[high, high], number[low, high]]
    else:
        turn = [(low, low), (high, low), (high, high), (low, high)]
        parts = [number[(*xy, z)] for z in (low, high) for xy in turn]
    cells = {"quad" if dim == 2 else "hexahedron": np.stack(parts, -1).reshape(-1, 2**dim)}
    bottom, top = (np.flatnonzero(np.isclose(points[:, -1], lines[-1][k])) for k in (0, -1))
    body = ElasticBody(points, cells, young=young, poisson=0.3, density=1000.0, groups={"bottom": bottom, "top": top},
                       rayleigh=options.pop("rayleigh", (0.0, 0.0)))  # fmt: skip
    return cn.deformable(body, ROCK, contact="bottom", **{"edges" if dim == 2 else "faces": "top"}, name=name, **options)


def ball(center, radius=0.1):
    return (cn.disks if len(center) == 2 else cn.spheres)([center], radius, ROCK)


def scene_of(dim, *sets, mu=0.3, gravity=None, wall=True):
    scene = cn.Scene(dim, gravity=-9.81 * np.eye(dim)[-1] if gravity is None else gravity)
    scene.add(*sets)
    if wall:
        scene.add(cn.wall(np.zeros(dim), np.eye(dim)[-1], ROCK))
    scene.interact("*", "*", cn.Coulomb(mu=mu))
    return scene


SIZE = {2: ((4, 2), (1.0, 0.5)), 3: ((2, 2, 2), (1.0, 1.0, 0.5))}


def low(dim):
    return np.zeros(dim)


def above(dim, x=0.45, height=0.601):
    return [x] * (dim - 1) + [height]


# ---------------------------------------------------------------------- removal


@pytest.mark.parametrize("dim", [2, 3])
def test_a_mesh_goes_with_all_of_its_bodies(dim, tmp_path):
    far = low(dim) + 3 * np.eye(dim)[0]

    def made():
        return cn.Simulation(scene_of(dim, block(low(dim), *SIZE[dim], name="a"), ball(above(dim)),
                                      block(far, *SIZE[dim], name="b")), 1e-3, SHARP)  # fmt: skip

    sim = made()
    for _ in range(5):
        sim.step()
    first = sim.meshes[0].all_ids
    with pytest.raises(ValueError, match="of the mesh 'a' would stay of"):
        sim.remove(first[:3])
    assert len(sim.meshes) == 2
    moved = sim.meshes[1].displacement
    gone = sim.meshes[0]
    sim.remove(first)
    with pytest.raises(cn.Error, match="there is no node"):
        _ = gone.place  # not that of the mesh that is left
    assert [mesh.name for mesh in sim.meshes] == ["b"] and not np.isin(first, sim.bodies.id).any()
    assert np.array_equal(sim.meshes[0].displacement, moved)
    sim.checkpoint(tmp_path / "without.h5")
    for _ in range(60):
        sim.step()
    assert sim.bodies.position[np.searchsorted(sim.bodies.id, len(first)), -1] < 0.6  # the ball falls where the mesh was
    again = made()
    again.remove(first)
    again.restore(tmp_path / "without.h5")
    for _ in range(60):
        again.step()
    assert differing(state(sim), state(again)) == []


@pytest.mark.parametrize("dim", [2, 3])
def test_a_ball_goes_from_a_mesh(dim):
    sim = cn.Simulation(scene_of(dim, block(low(dim), *SIZE[dim]), ball(above(dim)), ball(above(dim, 0.8, 2.0))), 1e-3, SHARP)
    ids = np.setdiff1d(sim.bodies.id, sim.meshes[0].all_ids)
    for _ in range(20):
        sim.step()
    before = sim.meshes[0].displacement
    sim.remove(ids[:1])
    assert np.array_equal(sim.meshes[0].displacement, before)
    for _ in range(5):
        assert sim.step()["status"] == "converged"
    sim.add(ball(above(dim)))
    sim.step()
    assert len(sim.meshes) == 1 and abs(sim.meshes[0].displacement).max() < 0.01


# ---------------------------------------------------------------------- projection


@pytest.mark.parametrize("dim", [2, 3])
def test_overlap_with_a_mesh_is_pushed_out(dim):
    deep = 0.01
    scene = scene_of(dim, block(low(dim), *SIZE[dim], young=1e7), ball(above(dim, height=0.6 - deep)), gravity=np.zeros(dim))
    left, freed = (cn.Simulation(scene, 1e-3, cn.NSCD(solver=SHARP.solver, project_positions=on), overlap="ignore")
                   for on in (False, True))  # fmt: skip
    for sim in (left, freed):
        sim.step()
    assert left.contacts.gap.min() < -0.9 * deep
    shown = freed.contacts.relative_velocity
    assert freed.step()["projection_error"] < 1e-9
    assert freed.contacts.gap.min() > -2e-2 * deep
    assert np.all(np.isfinite(shown)) and freed.contacts.relative_velocity.shape[1] == dim
    energy = freed.energy
    assert energy["work_projection"] > 0 and abs(energy["closure"]) < 1e-10 * energy["in_play"]
    moved = freed.meshes[0].displacement
    assert abs(moved).max() > 0.01 * deep


# ---------------------------------------------------------------------- files


@pytest.mark.parametrize("dim", [2, 3])
def test_a_scene_with_meshes_is_saved(dim, tmp_path):
    wave = cn.Harmonic(0.01, 5.0)
    scene = scene_of(dim, ball(above(dim)), block(low(dim), *SIZE[dim], fixed={0: "x"}, rayleigh=(1.0, 1e-4)),
                     block(low(dim) + 3 * np.eye(dim)[0], *SIZE[dim], name="b", drive={"bottom": {"x": wave}},
                           force={"top": np.ones(dim)}, velocity=0.1 * np.eye(dim)[0]))  # fmt: skip
    scene.save(tmp_path / "meshes.scene.h5")
    again = cn.Scene.load(tmp_path / "meshes.scene.h5")
    sims = [cn.Simulation(s, 1e-3, SHARP) for s in (scene, again)]
    for sim in sims:
        for _ in range(5):
            sim.step()
    assert differing(*map(state, sims)) == []
    assert sims[1].meshes[1].name == "b" and abs(sims[1].meshes[1].velocity).max() > 0


def test_matrices_of_ones_own_are_saved(tmp_path):
    x = block(low(2), *SIZE[2])[0].mesh.body
    matrices = cn.LinearBody(x.points, x.M, x.K, groups=x.groups, edges=x.boundary_edges())
    scene = scene_of(2, cn.deformable(matrices, ROCK, contact="bottom", edges="top"))
    scene.save(tmp_path / "own.scene.h5")
    sims = [cn.Simulation(s, 1e-3) for s in (scene, cn.Scene.load(tmp_path / "own.scene.h5"))]
    for sim in sims:
        sim.step()
    assert differing(*map(state, sims)) == []
    scene.add(cn.deformable(matrices, ROCK, name="pushed", force=lambda t: {"top": (t, 0.0)}))
    with pytest.raises(ValueError, match="force is a Python function, which a file cannot hold"):
        scene.save(tmp_path / "own.scene.h5")


# ---------------------------------------------------------------------- rest


def weight(sim):
    mass = sum(mesh.body.nodal_mass().sum() for mesh in sim.meshes)
    balls = np.setdiff1d(sim.bodies.id, np.concatenate([mesh.all_ids for mesh in sim.meshes]))
    of_balls = sim.bodies.mass[np.searchsorted(sim.bodies.id, balls)]
    return 9.81 * (mass + of_balls[np.isfinite(of_balls)].sum())


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("loaded", [False, True])
def test_rest_of_a_block_is_the_end_of_a_long_damped_run(dim, loaded):
    sets = [block(low(dim), *SIZE[dim], young=2e5, rayleigh=(5.0, 2e-3)), *([ball(above(dim, 0.5, 0.6))] if loaded else [])]
    found, run = (cn.Simulation(scene_of(dim, *sets, mu=0.0), 2e-3, SHARP) for _ in range(2))
    for sim in (found, run):  # nothing else keeps it from sliding
        assert sim.meshes
    rounds = []
    result = cn.find_equilibrium(found, tol=1e-8, unbalanced=1e-8, report=rounds.append)
    assert result["converged"] and result == rounds[-1], rounds
    assert not np.any(found.bodies.velocity)
    held = found.meshes[0].displacement
    found.step()
    reaction = found.contacts.impulse[(found.contacts.bodies == found.bodies.id[-1]).any(axis=1), -1].sum() / found.dt
    assert abs(abs(reaction) / weight(found) - 1) < 1e-7
    assert abs(found.bodies.velocity).max() < 1e-7 * 9.81 * found.dt
    for _ in range(1500):
        run.step()
    sag = abs(held).max()
    assert sag > 1e-3 and abs(run.meshes[0].displacement - held).max() < 1e-3 * sag
    assert abs(run.bodies.position - found.bodies.position).max() < 1e-3 * sag


def test_a_beam_at_rest_is_that_of_its_own_solution():
    """Held at both ends, under its weight: displacements at rest of the finite elements alone."""
    beam = block(low(2), (8, 2), (4.0, 0.4), fixed={0: "xy", 24: "xy"})
    body = beam[0].mesh.body
    sim = cn.Simulation(scene_of(2, beam, wall=False), 1e-3, SHARP)
    assert cn.find_equilibrium(sim, tol=1e-9, unbalanced=1e-9)["converged"]
    load = body.M @ np.tile([0.0, -9.81], len(body.points))
    expected = body.solve({0: "xy", 24: "xy"}, load)
    assert abs(sim.meshes[0].displacement - expected).max() < 1e-8 * abs(expected).max()


@pytest.mark.parametrize("theta", [0.5, 1.0])
@pytest.mark.parametrize("kinematics", ["small", "corotational"])
def test_a_solid_at_rest_is_that_of_its_own_solution(kinematics, theta):
    """Whatever the share of the stresses at the begin of a step that find_equilibrium asks of and undoes."""
    x, y = np.meshgrid(np.linspace(0, 1, 21), [0, 0.05, 0.1])
    points, first = np.c_[x.ravel(), y.ravel()], np.r_[:20, 21:41]
    material = cn.IsotropicElastic(young=2e7, poisson=0.3)
    quads = np.c_[first, first + 1, first + 22, first + 21]
    body = cn.SolidBody(points, {"quad": quads}, material, density=1e3, groups={"foot": [0, 21, 42]}, kinematics=kinematics)
    scene = cn.Scene(dim=2, gravity=(0.0, -0.981))
    scene.add(cn.deformable(body, cn.Material("clay"), fixed={"foot": "xy"}))
    sim = cn.Simulation(scene, 1e-2, cn.NSCD(theta=theta))
    assert cn.find_equilibrium(sim, tol=1e-9, unbalanced=1e-9)["converged"]
    expected = body.solve({"foot": "xy"}, body.M @ np.tile([0.0, -0.981], len(points)))
    assert abs(expected).max() > 0.005
    assert abs(sim.meshes[0].displacement - expected).max() < 1e-5 * abs(expected).max()


def test_what_nothing_holds_finds_no_rest_and_stays():
    sim = cn.Simulation(scene_of(2, block(low(2) + [0, 0.5], *SIZE[2])), 1e-3, SHARP)
    before = state(sim)
    with pytest.raises(ValueError, match="no bodies touch"):
        cn.find_equilibrium(sim)
    slope = cn.Simulation(scene_of(2, block(low(2), *SIZE[2]), mu=0.0, gravity=(1.0, -9.81)), 1e-3, SHARP)
    still = state(slope)
    assert not cn.find_equilibrium(slope, rounds=6)["converged"]
    assert differing(before, state(sim)) == [] and differing(still, state(slope)) == []


# ---------------------------------------------------------------------- problems and shadows


@pytest.mark.parametrize("dim", [2, 3])
def test_the_problem_of_a_step_with_meshes_is_solved_by_its_impulses(dim):
    sim = cn.Simulation(scene_of(dim, block(low(dim), *SIZE[dim]), ball(above(dim, height=0.6))), 1e-3, SHARP)
    for _ in range(10):
        sim.step()
    problem = sim.problem()
    assert problem.contacts == len(sim.contacts) > 3
    impulses = sim.contacts.impulse_local
    assert problem.error(impulses) < 1e-8
    bias = problem.q.reshape(-1, dim) + (problem.W @ impulses.ravel()).reshape(-1, dim) - sim.contacts.relative_velocity
    assert abs(bias[:, 1:]).max() < 1e-12  # of Coulomb's cone: along the normal alone


@pytest.mark.parametrize("dim", [2, 3])
def test_shadows_stand_beside_the_stages_of_meshes(dim, tmp_path):
    shake = cn.Harmonic(0.05, 20.0)

    def made():
        held = block(low(dim), *SIZE[dim], drive={"bottom": {"x": shake}}, force={"top": -np.ones(dim)}, rayleigh=(1.0, 1e-4))
        return cn.Simulation(scene_of(dim, held, ball(above(dim, height=0.6))), 1e-3, cn.NSCD(theta=0.6, solver=SHARP.solver))

    plain, watched = made(), made()
    stages = ("predict_configuration", "compute_free_velocity", "update_configuration")
    shadows = [watched.shadow(stage, tol=1e-9, folder=tmp_path) for stage in stages]
    shadows.append(watched.shadow("solve_contacts", "nlgs", 1e-6, folder=tmp_path))
    for _ in range(8):
        plain.step()
        watched.step()
    assert differing(state(plain), state(watched)) == []
    assert [s for s in shadows if s.beyond is not None or len(s.records) != 8] == []
    assert any(record[2] > 0 for record in shadows[1].records) and not list(tmp_path.iterdir())


# ---------------------------------------------------------------------- measures


def test_measures_are_of_grains_and_not_of_nodes(tmp_path):
    sim = cn.Simulation(scene_of(2, block(low(2), *SIZE[2]), ball(above(2, 0.3, 0.6)), ball(above(2, 0.7, 0.6))), 1e-3, SHARP)
    path = tmp_path / "grains.vtkhdf"
    sim.run(5, output=path, progress=False)
    with cn.load(path) as run:
        found = measure(run[-1])
    loaded = np.any(sim.contacts.impulse != 0, axis=1)
    grains = np.setdiff1d(sim.bodies.id[:-1], sim.meshes[0].all_ids)
    ends = np.isin(sim.contacts.bodies[loaded], grains)
    assert found["contacts"] == ends.any(axis=1).sum() and found["coordination"] == ends.sum() / len(grains)
    assert abs(found["solid_fraction"] - 2 * np.pi * 0.1**2 / (0.6 * 0.2)) < 1e-3
    assert np.all(np.isfinite(found["stress"]))


def test_displacements_of_many_meshes_are_read_in_the_time_of_their_nodes():
    """A view asks for its own nodes: no array of the length of the scene is copied."""
    corners = np.array([[0, 0], [1, 0], [0, 1]], float)
    scene = cn.Scene(2)
    for k in range(40):
        body = ElasticBody(corners + [2 * k, 0], {"triangle": [[0, 1, 2]]}, young=1e5, poisson=0.3, density=1.0)
        scene.add(cn.deformable(body, ROCK, name=f"body {k}", displacement=(0.0, 0.01 * k), velocity=(0.0, 1.0 * k)))
    sim = cn.Simulation(scene, 1e-3)
    sim.add(cn.disks([[-5.0, 0.0]], 0.1, ROCK))
    asked = []

    class Asked:
        def __init__(self, core):
            self.core = core

        @property
        def scene(self):
            return self

        def __getattr__(self, name):
            asked.append(name)
            return getattr(self.core.scene, name)

    for k, mesh in enumerate(sim.meshes):
        mesh._core = Asked(sim._core)
        np.testing.assert_allclose(mesh.displacement, [[0.0, 0.01 * k]] * 3, atol=1e-12)
        np.testing.assert_allclose(mesh.velocity, [[0.0, 1.0 * k]] * 3, atol=1e-12)
    assert set(asked) == {"node_row", "raw_node"}  # "node" is a copy of all
    with pytest.raises(ValueError, match="there is no node 999999"):
        sim._core.scene.node_row(999999)


def test_a_mesh_that_comes_in_after_the_first_output_is_in_the_file(tmp_path):
    """Its blocks are empty in the outputs before; runs that are taken up again go on in them."""
    steel, path = cn.Material("steel", density=7800.0), tmp_path / "late.vtkhdf"
    corners = np.array([[0.0, 0.0], [0.1, 0.0], [0.1, 0.1], [0.0, 0.1]])
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.disks([[0.0, 0.0]], 0.05, steel))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, dt=1e-3)
    sim.run(steps=3, output=path, progress=False)
    for k in range(2):
        block = cn.ElasticBody(corners + 1.0 + k, {"quad": np.array([[0, 1, 2, 3]])}, young=1e9, poisson=0.3, density=7800.0)
        sim.add(cn.deformable(block, steel, name=f"late {k}"))
        sim.run(steps=2, output=path, progress=False, append=True)
    with cn.load(path) as run:
        assert [len(run[k].bodies) for k in range(len(run))] == [1] * 8
        assert [len(run[k].nodes) for k in range(len(run))] == [0, 0, 0, 0, 4, 4, 8, 8]
        assert np.array_equal(run[-1].nodes.position, sim.nodes.position)
        assert [len(run[k].cells["mesh"]) for k in (0, 4, 7)] == [0, 1, 2]
        run.plot(-1)


def test_modal_damping_damps_each_mode_by_its_own_share():
    """C = M F diag(2 xi w) F' M of the modes F of a held bar, by the decay of maxima of two modes."""
    points, cells = box("quad", (6, 1), (3.0, 0.7))
    left = np.flatnonzero(points[:, 0] == 0)
    bar = cn.ElasticBody(points, cells, young=3e6, poisson=0.3, density=1200.0, groups={"left": left})
    mass, stiffness = bar.M.toarray(), bar.K.toarray()
    free = np.setdiff1d(np.arange(points.size), bar.dofs({"left": "xy"}))
    square, shape = linalg.eigh(stiffness[np.ix_(free, free)], mass[np.ix_(free, free)])
    omega, share, modes = np.sqrt(square), np.full(len(square), 0.02), np.zeros((points.size, len(square)))
    modes[free], share[1] = shape, 0.1
    damping = mass @ modes @ np.diag(2 * share * omega) @ modes.T @ mass
    for k in (0, 1):
        scene = cn.Scene(dim=2)
        body = cn.LinearBody(points, mass, stiffness, damping=damping, groups={"left": left})
        start = 1e-3 * modes[:, k].reshape(-1, 2)
        scene.add(cn.deformable(body, cn.Material("steel", density=1.0), fixed={"left": "xy"}, displacement=start))
        sim = cn.Simulation(scene, 2 * np.pi / omega[k] / 200)
        way = []
        for _ in range(700):
            sim.step()
            way.append(modes[:, k] @ mass @ sim.meshes[0].displacement.ravel())
        way = np.array(way)
        top = np.flatnonzero((way[1:-1] > way[:-2]) & (way[1:-1] > way[2:])) + 1
        decay = np.log(way[top[0]] / way[top[-1]]) / (len(top) - 1) / (2 * np.pi)
        assert decay / np.hypot(1, decay) == pytest.approx(share[k], rel=1e-3)


def test_groups_without_nodes_and_drives_that_differ_are_told():
    """A group that lost its nodes is an error and no body that falls; a corner that two groups drive has one velocity."""
    points, cells = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]]), {"quad": np.array([[0, 1, 2, 3]])}
    groups = {"none": [], "low": [0, 1], "left": [0, 3]}
    body = ElasticBody(points, cells, young=1e6, poisson=0.3, density=1e3, groups=groups)
    for named in ({"fixed": {"none": "xy"}}, {"drive": {"none": {"x": 1.0}}}, {"displace": {"none": {"x": np.sin}}},
                  {"force": {"none": (0.0, 1.0)}}, {"rigid": "none"}):  # fmt: skip
        with pytest.raises(ValueError, match=f"{next(iter(named))} names the group 'none', which has no node"):
            cn.deformable(body, ROCK, **named)
    with pytest.raises(ValueError, match="drive of 'left' drives node 0 along x at 2.0, which another group drives at 1.0"):
        cn.deformable(body, ROCK, drive={"low": {"x": 1.0}, "left": {"x": 2.0}})
    cn.deformable(body, ROCK, drive={"low": {"x": 1.0}, "left": {"x": 1.0, "y": 0.0}})


def disk_of_rings(cells=6, poisson=0.0, density=1e3):
    """A flat disk of radius 1 m round the axis x = 0, of quadrilaterals."""
    x, y = np.meshgrid(np.linspace(0.0, 1.0, cells + 1), [0.0, 0.25, 0.5], indexing="ij")
    number = np.arange(x.size).reshape(x.shape)
    corners = [number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]]
    quads = {"quad": np.stack(corners, -1).reshape(-1, 4)}
    groups = {"low": number[:, 0], "high": number[:, -1], "axis": number[0]}
    elastic = cn.IsotropicElastic(young=1e9, poisson=poisson)
    points = np.c_[x.ravel(), y.ravel()]
    return cn.SolidBody(points, quads, elastic, density=density, groups=groups, plane="axisymmetric", kinematics="small")


@pytest.mark.parametrize("far", [0.0, 1e3])
def test_a_disk_of_rings_presses_evenly_and_tears_off_for_its_area(far):
    """Tributary areas of nodes are rings: a uniform pressure holds at each node, also on the axis; a zone under the disk
    dissipates its work times pi r^2, for any origin along the axis."""
    body, wall = disk_of_rings(), cn.wall((0.0, far), (0.0, 1.0), ROCK)
    body.points[:, 1] += far
    scene = cn.Scene(2)
    scene.add(wall, cn.deformable(body, ROCK, contact="low", edges="low", fixed={"axis": "x"}, pressure={"high": 1e3}))
    scene.interact(ROCK, ROCK, cn.GapCoulomb(mu=0.0))
    sim = cn.Simulation(scene, 1.0, cn.NSCD(theta=1.0, solver=cn.NLGS(tol=1e-12, max_iter=10000)), overlap="ignore")
    for _ in range(30):
        sim.step()
    assert sim.meshes[0].contact_pressure[body.groups["low"]] == pytest.approx(1e3, rel=1e-4)  # small at the axis
    zone = cn.MP3(normal_stiffness=1e11, tangential_stiffness=1e11, strength=2e4, work=0.2)
    scene = cn.Scene(2)
    scene.add(wall, cn.deformable(body, ROCK, contact="low", edges="low", drive={"high": {"y": 1e-2}}, velocity=(0.0, 1e-2)))
    scene.interact(ROCK, ROCK, zone)
    sim = cn.Simulation(scene, 2e-5, cn.NSCD(theta=1.0, solver=cn.NLGS(tol=1e-8, max_iter=5000)), overlap="ignore")
    for _ in range(300):
        sim.step()
    assert sim.energy["released"] == pytest.approx(0.2 * np.pi, rel=1e-9)
