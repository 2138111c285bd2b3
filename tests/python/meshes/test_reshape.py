"""Rigid bodies made deformable in a run, and back: transferred state, and reports."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=1000.0)
SQUARE = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])


def grid(n=4, corner=(-0.5, -0.5)):
    x = np.linspace(0.0, 1.0, n + 1)
    points = np.stack(np.meshgrid(x, x, indexing="ij"), -1).reshape(-1, 2) + corner
    k = np.arange(len(points)).reshape(n + 1, n + 1)
    return points, {"quad": np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], -1).reshape(-1, 4)}


def mesh(material=None, corner=(-0.5, -0.5), **more):
    points, cells = grid(corner=corner)
    if material is None:
        return cn.ElasticBody(points, cells, young=1e7, poisson=0.3, density=900.0, **more)
    return cn.SolidBody(points, cells, material, density=900.0, **more)


def rubber():
    return cn.NeoHookean(young=1e7, poisson=0.3)


def flying(turn=0.7, velocity=(1.0, -2.0, 3.0)):
    scene = cn.Scene(dim=2)
    scene.add(cn.polygons([SQUARE], ROCK, position=[[2.0, 1.0]], rotation=[turn], velocity=velocity))
    return cn.Simulation(scene, 1e-3)


def momentum(sim):
    """Momentum of rigid bodies and meshes: along x, y, and about the origin."""
    out, b = np.zeros(3), sim.bodies
    for m in sim.meshes:
        x, p = m.displacement + m.body.points, (m.body.M @ m.velocity.ravel()).reshape(-1, 2)
        out += [*p.sum(axis=0), np.sum(x[:, 0] * p[:, 1] - x[:, 1] * p[:, 0])]
    for x, v, m, j in zip(b.position, b.velocity, b.mass, np.ravel(b.inertia)):
        if np.isfinite(m):
            out += [m * v[0], m * v[1], m * (x[0] * v[1] - x[1] * v[0]) + j * v[2]]
    return out


@pytest.mark.parametrize("kind", ["linear", "rubber"])
def test_momentum_and_angular_momentum_pass_over_and_back(kind):
    sim = flying()
    for _ in range(20):
        sim.step()
    before, energy = momentum(sim), sim.info["energy"]["kinetic"]
    shown = sim.deform(0, mesh(None if kind == "linear" else rubber()))
    assert np.abs(momentum(sim) - before).max() < 1e-12 * np.abs(before).max()
    assert sim.info["energy"]["dissipated_reshaping"] == pytest.approx(energy - sim.info["energy"]["kinetic"], abs=1e-9)
    assert np.abs(np.hypot(*(shown.displacement + shown.body.points - [2.02, 0.96]).T)).max() == pytest.approx(np.sqrt(0.5))
    assert not np.isin(0, sim.bodies.id)
    for _ in range(10):
        sim.step()
    later = momentum(sim)
    assert np.abs(later[:2] - before[:2]).max() < 1e-11 * np.abs(before).max()
    assert sim.rigidify(sim.meshes[0]) == 0 and not sim.meshes and sim.bodies.id.tolist() == [0]
    assert np.abs(momentum(sim) - later).max() < 1e-12 * np.abs(before).max()
    assert sim.bodies.mass[0] == pytest.approx(1000.0, rel=1e-13) and np.ravel(sim.bodies.inertia)[0] == pytest.approx(
        1e3 / 6, rel=1e-12
    )
    sim.step()
    told = sim.info["energy"]
    assert abs(told["closure"]) < 1e-12 * told["in_play"]
    kept = told["kinetic"] + told["dissipated_reshaping"] + told["dissipated_integrator"]
    assert kept == pytest.approx(energy, rel=1e-12)


def test_at_once_there_and_back_a_body_is_as_it_was():
    sim = flying()
    sim.step()
    x, v, a = sim.bodies.position.copy(), sim.bodies.velocity.copy(), sim.bodies.rotation.copy()
    sim.deform(0, mesh(rubber()))
    sim.rigidify(0)
    assert np.abs(sim.bodies.position - x).max() < 1e-13 and np.abs(sim.bodies.velocity - v).max() < 1e-12
    assert np.abs(sim.bodies.rotation - a).max() < 1e-13
    assert abs(sim.info["energy"]["dissipated_reshaping"]) < 1e-9


def test_in_space_momentum_and_pose_pass_over():
    n = np.arange(27).reshape(3, 3, 3)
    points = np.stack(np.meshgrid(*(np.linspace(0, s, 3) for s in (1.0, 2.0, 0.5)), indexing="ij"), -1).reshape(-1, 3)
    low = n[:-1, :-1, :-1], n[1:, :-1, :-1], n[1:, 1:, :-1], n[:-1, 1:, :-1]
    high = n[:-1, :-1, 1:], n[1:, :-1, 1:], n[1:, 1:, 1:], n[:-1, 1:, 1:]
    cells = {"hexahedron": np.stack([*low, *high], -1).reshape(-1, 8)}
    body = cn.SolidBody(points, cells, cn.NeoHookean(young=1e7, poisson=0.3), density=7.0)
    scene = cn.Scene(dim=3)
    scene.add(cn.boxes([[0.5, 1.0, 0.25]], (1.0, 2.0, 0.5), ROCK, velocity=(1.0, 2.0, 3.0, 0.4, -1.2, 2.0)))
    sim = cn.Simulation(scene, 1e-2)
    for _ in range(30):
        sim.step()
    j, r0 = sim.raw.angular_momentum[0].copy(), sim.bodies.rotation.copy()
    x, v = sim.bodies.position[0].copy(), sim.bodies.velocity[0].copy()
    shown = sim.deform(0, body)
    place = shown.displacement + shown.body.points
    p = (shown.body.M @ shown.velocity.ravel()).reshape(-1, 3)
    assert np.abs(p.sum(axis=0) - 1000.0 * v[:3]).max() < 1e-9
    assert np.abs(np.cross(place - x, p).sum(axis=0) - j).max() < 1e-11 * np.abs(j).max()
    assert sim.rigidify(shown) == 0
    assert np.abs(sim.bodies.velocity[0] - v).max() < 1e-12
    assert min(np.abs(sim.bodies.rotation - r0).max(), np.abs(sim.bodies.rotation + r0).max()) < 1e-12


def resting(**more):
    """A square on the ground, a disk on it."""
    scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
    scene.add(cn.wall((0, 0), (0, 1), ROCK))
    scene.add(cn.polygons([SQUARE + (0.0, 0.5)], ROCK))
    scene.add(cn.disks([[0.1, 1.2]], 0.2, ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, 1e-3, cn.NSCD(0.5, cn.Default(tol=1e-12)), **more)


def remembered(sim):
    """Sum of the impulses along y, and of their moments about z, that act on the block."""
    memory = sim.get_state()["memory"]
    return memory["impulses"].reshape(-1, 2)[:, 0].sum(), len(memory["keys"])


def test_impulses_of_contacts_pass_over():
    sim = resting()
    for _ in range(20):
        sim.step()
    before, _ = remembered(sim)
    shown = sim.deform(1, mesh(corner=(-0.5, 0.0)))
    after, contacts = remembered(sim)
    assert after == pytest.approx(before, rel=1e-12) and contacts >= 3
    report = sim.step()
    assert report["status"] == "converged" and report["contacts"] >= 3
    for _ in range(50):
        sim.step()
    before, _ = remembered(sim)
    assert sim.rigidify(shown) == 1
    after, contacts = remembered(sim)
    assert after == pytest.approx(before, rel=1e-12) and contacts == 3
    for _ in range(20):
        report = sim.step()
    assert report["status"] == "converged"
    assert abs(sim.info["energy"]["closure"]) < 1e-11 * sim.info["energy"]["in_play"]
    assert np.abs(sim.bodies.velocity).max() < 1e-2


GLUE = cn.Material("glue", density=1000.0)
BONDED = 3  # as contacts.status has it


def pair():
    """Two disks that touch, one of them pushed: bonded they move together."""
    return cn.disks([[0.0, 0.0], [0.5, 0.0]], 0.25, GLUE, velocity=[[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def glued(*sets):
    """Bodies without weight, a square and a disk of glue at first; bodies of glue bond at the contacts they are inserted with."""
    scene = cn.Scene(dim=2)
    scene.add(cn.polygons([SQUARE], ROCK, position=[[5.0, 0.0]]), cn.disks([[0.0, 20.0]], 0.25, GLUE), *sets)
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    scene.interact(ROCK, GLUE, cn.Coulomb(mu=0.3))
    scene.interact(GLUE, GLUE, cn.Bonded())
    return cn.Simulation(scene, 1e-3, cn.NSCD(0.5, cn.NLGS(tol=1e-9)))


@pytest.mark.parametrize("change", ["deform", "rigidify", "merge"])
@pytest.mark.parametrize("begun", [False, True])
def test_others_that_come_in_meanwhile_bond_all_the_same(change, begun, tmp_path):
    """A body that takes the place of another leaves the bonds of the next step to those that came in, by a checkpoint, too."""
    grains = cn.disks([[9.0, 0.0], [9.5, 0.0]], 0.25, ROCK)

    def made(rest):
        sim = glued(*([grains] if begun else [pair(), grains]))
        if begun:
            sim.step()
            ids = sim.add(pair())
        else:
            ids = [2, 3]
        others = [i for i in sim.bodies.id if i > 1 and i not in ids]
        if change == "merge":
            sim.merge(others)
        else:
            sim.deform(0, mesh())
        if change == "rigidify":
            sim.rigidify(0)
        return sim, ids

    sim, ids = made(True)
    sim.checkpoint(tmp_path / "kept")
    again, _ = made(True)
    again.restore(tmp_path / "kept")
    for one in (sim, again):
        one.step()
        mine = np.isin(one.contacts.bodies, ids).all(axis=1)
        assert one.contacts.status[mine].tolist() == [BONDED]
        rows = np.isin(one.bodies.id, ids)
        assert one.bodies.velocity[rows, 2] == pytest.approx([1 / 0.75] * 2, rel=1e-6)
        for _ in range(20):
            one.step()
    assert np.array_equal(sim.bodies.velocity, again.bodies.velocity)


def test_what_was_not_bonded_is_not_as_it_is_deformed():
    """Squares of glue that came together: their contact counts as old, whichever bodies are inserted."""
    for more in (False, True):
        sim = glued(
            cn.polygons([SQUARE, SQUARE], GLUE, position=[[0.0, -5.0], [1.01, -5.0]], velocity=[[5.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
        )
        for _ in range(10):
            sim.step()
        assert len(sim.contacts.status) and BONDED not in sim.contacts.status
        if more:
            sim.add(pair())
        sim.deform(2, mesh(rubber()))
        sim.step()
        touching = ~np.isin(sim.contacts.bodies, sim.bodies.id).all(axis=1)
        assert touching.any() and BONDED not in sim.contacts.status[touching]
        assert (BONDED in sim.contacts.status) == more


def test_a_criterion_makes_bodies_deformable_where_they_are_struck():
    """Two squares fall: the one watched by a threshold of force becomes deformable as it strikes the ground, and rigid again in
    flight; the other stays rigid."""
    scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
    scene.add(cn.wall((0, 0), (0, 1), ROCK))
    scene.add(cn.polygons([SQUARE + (0.0, 0.52), SQUARE + (3.0, 0.52)], ROCK, velocity=(0.0, -2.0, 0.0)))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 5e-4, cn.NSCD(0.5, cn.Default(tol=1e-10)))
    sim.reshape_when([1], mesh(corner=(-0.5, 0.02)), force=1e5, back=1e2)
    kinds = []
    for _ in range(120):
        sim.step()
        kinds.append(len(sim.meshes))
        assert 2 in sim.bodies.id
    assert kinds[0] == 0 and max(kinds) == 1 and kinds[-1] == 0
    assert 1 in sim.bodies.id and sim.info["energy"]["dissipated_reshaping"] > 0
    assert abs(sim.info["energy"]["closure"]) < 1e-11 * sim.info["energy"]["in_play"]


def test_stress_as_a_criterion():
    """A square under a load of 10 kN on its top: mean stress 10 kPa."""
    for threshold, deforms in ((0.8e4, True), (3e4, False)):
        scene = cn.Scene(dim=2)
        scene.add(cn.wall((0, 0), (0, 1), ROCK))
        scene.add(cn.polygons([SQUARE + (0.0, 0.5)], ROCK))
        scene.add(cn.polygons([SQUARE + (0.0, 1.5)], ROCK, force=(0.0, -1e4, 0.0)))
        scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
        sim = cn.Simulation(scene, 1e-3, cn.NSCD(0.5, cn.Default(tol=1e-10)))
        sim.reshape_when([1], {1: mesh(corner=(-0.5, 0.0))}, stress=threshold)
        sim.run(steps=5, progress=False)
        assert bool(sim.meshes) == deforms


@pytest.mark.parametrize("first", [True, False])
def test_the_stress_of_what_touches_an_image_is_that_of_where_it_touches(first):
    """A square is pressed by 10 kN on a held one through the end of a periodic cell: half of that, 5 kPa, in the mean."""
    for threshold, deforms in ((4.9e3, True), (5.1e3, False)):
        scene = cn.Scene(dim=2, periodic=cn.Periodic((10.0, np.inf)))
        held = cn.polygons([SQUARE + (9.0, 0.0)], ROCK, driven=("vx", "vy", "w"))
        free = cn.polygons([SQUARE], ROCK, force=(-1e4, 0.0, 0.0))
        scene.add(*((held, free) if first else (free, held)))
        scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
        sim = cn.Simulation(scene, 1e-3, cn.NSCD(0.5, cn.Default(tol=1e-10)))
        sim.reshape_when([1 if first else 0], mesh(), stress=threshold)
        sim.run(steps=2, progress=False)
        assert bool(sim.meshes) == deforms


def test_criteria_look_before_any_of_them_changes_a_body():
    """Two criteria on a body, and a criterion on the body above, evaluate the same step; making a body deformable turns no other
    mesh rigid while the contacts of that mesh bear load."""
    scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
    scene.add(cn.wall((0, 0), (0, 1), ROCK))
    scene.add(cn.polygons([SQUARE + (0.0, 0.5), SQUARE + (3.0, 0.5), SQUARE + (3.0, 1.5)], ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(0.5, cn.Default(tol=1e-10)))
    sim.deform(1, mesh(rubber(), corner=(-0.5, 0.0)))
    for _ in range(30):  # its contacts bear its weight
        sim.step()
    sim.reshape_when([2, 3], mesh(corner=(-0.5, 0.0)), force=1.0)
    sim.reshape_when([2], mesh(corner=(-0.5, 0.0)), force=2.0)
    sim.reshape_when([1], mesh(corner=(-0.5, 0.0)), force=1e9, back=1.0)
    sim.step()
    assert len(sim.meshes) == 3 and sim.bodies.id.tolist() == [0]


def test_a_mesh_that_was_no_rigid_body_takes_the_shape_that_is_given():
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(mesh(), ROCK, contact=[0], velocity=(1.0, 0.0)))
    sim = cn.Simulation(scene, 1e-3)
    sim.step()
    with pytest.raises(ValueError, match="give shape"):
        sim.rigidify(0)
    new = sim.rigidify(0, cn.polygons([SQUARE], ROCK))
    assert sim.bodies.id.tolist() == [new]
    assert sim.bodies.velocity[0, 0] == pytest.approx(1.0, rel=1e-12) and sim.bodies.mass[0] == pytest.approx(900.0)


@pytest.mark.parametrize("late", [False, True])
def test_a_body_that_is_joined_stays_rigid_until_its_joint_is_let_go(late):
    scene = cn.Scene(2)
    ids = scene.add(cn.polygons([SQUARE, SQUARE, SQUARE], ROCK, position=[[0, 0], [2, 0], [5, 0]]))
    scene.interact("*", "*", None)
    name = None if late else scene.join(ids[0], ids[1], cn.Pivot(point=(1, 0)))
    sim = cn.Simulation(scene, 1e-3)
    sim.step()
    if late:
        name = sim.join(0, 1, cn.Pivot(point=(1, 0)))
        sim.step()
    for k in (0, 1):
        with pytest.raises(ValueError, match=f"body {k} is an end of the joint '{name}', .* sim.unjoin"):
            sim.deform(k, mesh())
    assert sim.bodies.id.tolist() == [0, 1, 2]
    sim.deform(2, mesh())
    sim.unjoin(name)
    sim.deform(1, mesh())
    sim.step()


def test_what_cannot_be_reshaped_is_told():
    sim = resting()
    with pytest.raises(ValueError, match="no rigid body 7"):
        sim.deform(7, mesh())
    with pytest.raises(ValueError, match="held or driven"):
        sim.deform(0, mesh())
    with pytest.raises(ValueError, match="no threshold"):
        sim.reshape_when([1], mesh())
    held = cn.ElasticBody(*grid(), young=1.0, poisson=0.0, density=1.0, groups={"a": [0]})
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(held, ROCK, fixed={"a": "x"}))
    with pytest.raises(ValueError, match="held dofs"):
        cn.Simulation(scene, 1e-3).rigidify(0)


def test_a_checkpoint_of_what_was_reshaped_goes_on_to_the_same_bits(tmp_path):
    """The file holds the mesh and its former body; a simulation that has the mesh already keeps its own."""
    first = resting()
    for k in range(60):
        if k == 10:
            first.deform(1, mesh(rubber(), corner=(-0.5, 0.0)))
        if k == 30:
            first.checkpoint(tmp_path / "half")
        first.step()
    again, has = resting(), resting()
    for _ in range(10):
        has.step()
    has.deform(1, mesh(rubber(), corner=(-0.5, 0.0)))
    for sim in (has, again):
        sim.restore(tmp_path / "half")
        for _ in range(30):
            sim.step()
    assert np.array_equal(has.meshes[0].displacement, first.meshes[0].displacement)
    assert np.array_equal(again.meshes[0].displacement, first.meshes[0].displacement)
    assert again.rigidify(0) == 1 and first.rigidify(0) == 1
    assert np.allclose(again.bodies.velocity, first.bodies.velocity, rtol=0, atol=1e-12)


def pushed(force, damping=0.3):
    scene = cn.Scene(dim=2)
    scene.add(cn.polygons([SQUARE], ROCK, position=[[2.0, 1.0]], velocity=(1.0, -2.0, 3.0), force=force, damping=damping))
    return cn.Simulation(scene, 1e-3)


@pytest.mark.parametrize(
    "force",
    [(300.0, 200.0, 50.0), lambda t: (300.0 * np.cos(5 * t), 200.0, 50.0), cn.Table([0.0, 1.0], [[0.0] * 3, [1e3, -2e3, 3e2]])],
)
def test_forces_and_damping_go_with_the_body_and_come_back(force):
    """Force, torque about the centre of mass and damping act on the nodes as they did on the body, and on it again."""
    rigid, other = pushed(force), pushed(force)
    for k in range(250):
        if k == 50:
            other.deform(0, mesh(rubber()))
        if k == 200:
            other.rigidify(0)
        rigid.step()
        other.step()
    before, after = momentum(rigid), momentum(other)
    assert np.abs(before - momentum(pushed(force))).max() > 10
    assert np.abs(after - before)[:2].max() < 1e-9 and abs(after[2] - before[2]) < 1e-4 * abs(before[2])
    energy = other.info["energy"]
    assert abs(energy["closure"]) < 1e-12 * energy["in_play"]


def test_a_checkpoint_holds_what_a_deformed_body_was_given(tmp_path):
    force = cn.Table([0.0, 1.0], [[0.0] * 3, [1e3, -2e3, 3e2]])
    one = pushed(force)
    one.step()
    one.deform(0, mesh(rubber()))
    for _ in range(5):
        one.step()
    one.checkpoint(tmp_path / "half")
    two = pushed(force)
    two.restore(tmp_path / "half")
    for sim in (one, two):
        for _ in range(5):
            sim.step()
    assert np.array_equal(one.meshes[0].velocity, two.meshes[0].velocity)
    assert one.rigidify(0) == two.rigidify(0) == 0
    for sim in (one, two):
        for _ in range(5):
            sim.step()
    assert np.array_equal(one.bodies.velocity, two.bodies.velocity)


def test_a_mesh_that_no_file_holds_is_asked_for(tmp_path):
    one = pushed((1.0, 0.0, 0.0))
    one.deform(0, mesh(rubber()), force=lambda t: {})
    one.checkpoint(tmp_path / "half")
    with pytest.raises(cn.FileError, match="the mesh 'body 0' came in later, with a function in Python"):
        pushed((1.0, 0.0, 0.0)).restore(tmp_path / "half")


ZONE = {"normal_stiffness": 1e10, "tangential_stiffness": 7e9, "mu": 0.3}
BONDS = [
    cn.Bonded(),
    cn.MAL(normal_strength=2e6, tangential_strength=3e6, normal_work=1e3, tangential_work=3e3, **ZONE),
    cn.ParallelBond(normal_stiffness=1e10, tangential_stiffness=1e10, tension=1e8, shear=1e8, radius=1.0),
    cn.MohrCoulomb(tension=1e8, cohesion=1e8, mu=0.3),
    cn.Rod(stiffness=1e8, within=0.02),
]


def bonded(law, *sets):
    """Bodies that touch, or all but so for a rod, in even flight at 1 m/s."""
    scene = cn.Scene(dim=2)
    scene.add(*sets)
    scene.interact(GLUE, GLUE, law)
    solver = cn.NLGS(tol=1e-12, max_iter=20000)
    return cn.Simulation(scene, 2e-6, cn.NSCD(solver=solver), overlap="ignore")


def state(sim):
    nodes = [sim.nodes.position, sim.nodes.velocity] if len(sim.meshes) else []
    return [np.array(x) for x in (sim.bodies.id, sim.bodies.position, sim.bodies.velocity, *nodes, *sim.energy.values())]


@pytest.mark.parametrize("law", BONDS, ids=lambda law: type(law).__name__)
def test_what_a_bond_holds_is_not_deformed(law):
    """The error names the bond, the state is unchanged, and the flight goes on; once its partner is removed the body may be
    deformed, at the same energy."""
    x = [[0.0, 0.0], [1.01 if isinstance(law, cn.Rod) else 1.0, 0.0]]
    sim = bonded(law, cn.disks(x, 0.5, GLUE, velocity=[[1.0, 0.0, 0.0]] * 2))
    for _ in range(5):
        sim.step()
    before = state(sim)
    with pytest.raises(ValueError, match=f"body 1 is held to body 0 by {type(law).__name__}"):
        sim.deform(1, mesh())
    for was, is_now in zip(before, state(sim), strict=True):
        assert np.array_equal(was, is_now)
    for _ in range(5):
        sim.step()
    assert np.allclose(sim.bodies.velocity, [[1.0, 0.0, 0.0]] * 2, rtol=0, atol=1e-9)
    kinetic = sim.energy["kinetic"] / 2
    sim.remove([0])
    sim.deform(1, mesh())
    sim.step()
    assert sim.energy["kinetic"] == pytest.approx(kinetic, rel=1e-9)
    assert np.abs(sim.nodes.velocity - [1.0, 0.0]).max() < 1e-9


@pytest.mark.parametrize("law", BONDS[1:3], ids=lambda law: type(law).__name__)
def test_a_mesh_that_a_bond_holds_is_not_made_rigid(law):
    """A block on another, bonded from the start, in even flight, pulled: what its bonds store stays in the balance."""
    body = mesh(corner=(-0.5, 0.5))
    body.groups["bottom"] = np.flatnonzero(np.abs(body.points[:, 1] - 0.5) < 1e-9)
    block = cn.polygons([SQUARE], GLUE, velocity=[[1.0, 0.0, 0.0]])
    sim = bonded(law, block, cn.deformable(body, GLUE, contact="bottom", edges="bottom", velocity=(1.0, 0.01)))
    for _ in range(10):
        sim.step()
    assert sim.energy["stored"] > 0 and (sim.contacts.beta > 0).any()
    before = state(sim)
    shape = cn.polygons([SQUARE], GLUE)
    with pytest.raises(ValueError, match=f"the mesh .* is held to body 0 by {type(law).__name__} .and by [0-9]+ more contacts.:"):
        sim.rigidify(sim.meshes[0], shape=shape)
    for was, is_now in zip(before, state(sim), strict=True):
        assert np.array_equal(was, is_now)
    sim.step()
    assert abs(sim.energy["closure"]) < 1e-9 * sim.energy["in_play"]


def test_a_criterion_tells_of_a_bond():
    law = BONDS[1]
    sim = bonded(law, cn.disks([[0.0, 0.0], [1.0, 0.0]], 0.5, GLUE, velocity=[[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))
    sim.reshape_when([1], mesh(), force=1.0)
    with pytest.raises(ValueError, match="body 1 is held to body 0 by MAL"):
        for _ in range(5):
            sim.step()
    assert len(sim.meshes) == 0


def test_a_zone_that_broke_is_in_no_ones_way():
    law = cn.MAL(normal_strength=2e3, tangential_strength=3e3, normal_work=1e-3, tangential_work=3e-3, **ZONE)
    sim = bonded(law, cn.disks([[0.0, 0.0], [1.0, 0.0]], 0.5, GLUE, velocity=[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))
    for _ in range(20):
        sim.step()
    assert not (sim.contacts.beta > 0).any()
    kinetic = sim.energy["kinetic"]
    sim.deform(1, mesh())
    sim.step()
    assert sim.energy["kinetic"] == pytest.approx(kinetic, rel=1e-9)
