"""Ropes over a pulley that begin at a node of a mesh: against a rigid end, tension, momentum, slack, strength, restart."""

import cairn as cn
import numpy as np
import pytest
from test_cables import SOLVERS, G, axis, balls, closes, scene_of, simulate, up
from test_mesh_joints import bar, node_at

BAR, H = cn.Material("bar", density=1000.0), 1e-3


def mass_of_bar(dim):
    return 1000.0 * 0.2 * 0.04 ** (dim - 1)


def ball(dim, mass, at, **options):
    """A ball of a mass [kg]."""
    volume = mass / 7800.0
    return balls(dim, [at], [(volume / np.pi) ** 0.5 if dim == 2 else (0.75 * volume / np.pi) ** (1 / 3)], **options)


def stick(dim, **options):
    """A rigid bar of the size of the one of cells."""
    if dim == 2:
        return cn.polygons([np.array([[0, -0.02], [0.2, -0.02], [0.2, 0.02], [0, 0.02]])], BAR, **options)
    return cn.boxes([[0.1, 0.0, 0.0]], [[0.2, 0.04, 0.04]], BAR, **options)


def roped(dim, share, *, rigid=False, first=True, pulley=None, others=0, speeds=(0.0, 0.0), gravity=True, body=None, **cable):
    """A bar along x, hung at its end at the origin from a rope over a pulley above and aside, and beyond that a ball of `share`
    of the bar's mass; first: the bar is a of the joint, and comes in first; pulley: a body carries it, which comes in
    "before" both or "between" them; others: meshes that come in before all and stay away."""
    scene = scene_of(dim)
    if not gravity:
        scene.gravity = np.zeros(dim)
    body = bar(dim) if body is None else body
    at = node_at(body, np.zeros(dim))
    points = [np.zeros(dim), 0.3 * up(dim) - 0.1 * axis(dim, 0), -0.1 * up(dim) - 0.25 * axis(dim, 0)]
    velocity = [speed * up(dim) + 0.5 * speed * axis(dim, 0) for speed in speeds]
    for k in range(others):
        scene.add(cn.deformable(bar(dim, begin=5.0 + k), BAR))
    carrier = ball(dim, mass_of_bar(dim), points[1])
    held = scene.add(carrier) if pulley == "before" else [None]
    turning = np.zeros(dim * (dim - 1) // 2)
    if rigid:
        hangs = stick(dim, velocity=[np.append(velocity[0], turning)])
    else:
        hangs = cn.deformable(body, BAR, velocity=np.tile(velocity[0], (len(body.points), 1)))
    weight = ball(dim, share * mass_of_bar(dim), points[2], velocity=[np.append(velocity[1], turning)])
    parts = [scene.add(hangs if first else weight)]
    held = scene.add(carrier) if pulley == "between" else held
    parts.append(scene.add(weight if first else hangs))
    ends = [parts[0 if first else 1][0 if rigid else at], parts[1 if first else 0][0]]
    if not first:
        ends, points = ends[::-1], points[::-1]
    scene.join(*ends, cn.Cable(points=points, pulley=held[0], **cable))
    return scene


def momentum(sim, dim):
    """Momentum of the mesh and of moving bodies, (dim,)."""
    mesh = sim.meshes[-1]
    v = mesh.velocity
    free = [k for k in range(len(sim.bodies)) if sim.bodies.velocity[k].any()]
    return (mesh.body.M @ v.ravel()).reshape(v.shape).sum(axis=0), sum(
        (sim.bodies.mass[k] * sim.bodies.velocity[k, :dim] for k in free), np.zeros(dim)
    )


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("first", [True, False])
@pytest.mark.parametrize("dim", [2, 3])
def test_a_stiff_bar_of_cells_swings_on_a_rope_as_a_rigid_one(dim, first, solver):
    """Both sides: the bar's middle and the ball beyond the pulley, which hangs on the far part alone."""
    ends = []
    for rigid in (False, True):
        sim = simulate(roped(dim, 1.3, rigid=rigid, first=first), H, solver)
        for _ in range(60):
            assert sim.step()["status"] == "converged"
        assert closes(sim, 1e-9)
        beyond = int(np.argmin(np.abs(sim.bodies.mass - 1.3 * mass_of_bar(dim))))
        middle = sim.bodies.position[np.argmin(np.abs(sim.bodies.mass - mass_of_bar(dim)))]
        if not rigid:
            middle = sim.nodes.position[node_at(bar(dim), 0.1 * axis(dim, 0))]
        ends.append([middle, sim.bodies.position[beyond]])
    ends = np.array(ends)
    moved = ends[1] - [0.1 * axis(dim, 0), -0.1 * up(dim) - 0.25 * axis(dim, 0)]
    assert np.linalg.norm(moved, axis=1).min() > 0.003
    assert np.abs(ends[0] - ends[1]).max() < 1e-4 * 0.2


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("first", [True, False])
@pytest.mark.parametrize("dim", [2, 3])
def test_a_rope_pulls_both_ends_and_its_pulley_by_one_tension(dim, first, solver):
    """Along both sides of it, step by step: what bar, ball and world gain."""
    sim = simulate(roped(dim, 0.8, first=first), H, solver)
    world = int(np.argmax(sim.bodies.id))
    beyond = 1 - world if len(sim.bodies) == 2 else None
    pulley = 0.3 * up(dim) - 0.1 * axis(dim, 0)
    pulled = 0
    for _ in range(20):
        mesh, ball_before = sim.meshes[0], sim.bodies.velocity[beyond, :dim].copy()
        begin, weight = momentum(sim, dim)[0], sim.bodies.mass[beyond]
        assert sim.step()["status"] == "converged"
        by_rope = momentum(sim, dim)[0] + mass_of_bar(dim) * G * H * up(dim) - begin
        on_ball = weight * (sim.bodies.velocity[beyond, :dim] - ball_before + G * H * up(dim))
        tension = np.linalg.norm(by_rope)
        assert np.linalg.norm(on_ball) == pytest.approx(tension, rel=1e-8)
        assert np.linalg.norm(sim.contacts.impulse[0]) == pytest.approx(tension, rel=1e-8)
        on_world = sim.bodies.reaction[world, :dim] - sim.bodies.mass[world] * G * H * up(dim)
        assert np.abs(on_world - (by_rope + on_ball)).max() < 1e-8 * tension
        toward = pulley - mesh.position[node_at(bar(dim), np.zeros(dim))]
        assert by_rope @ toward == pytest.approx(tension * np.linalg.norm(toward), rel=1e-4)
        pulled += tension > 0
    assert pulled > 10


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("dim", [2, 3])
def test_in_balance_the_tension_is_the_weight_on_both_sides(dim, solver):
    """A bar that is damped and hangs straight down: its waves die away, and the rope bears its weight, which is the ball's."""
    made, low = bar(dim, young=1e6, cells=2), -0.2 * up(dim)
    x = made.points[:, [*range(1, dim), 0]]  # upright
    x[:, dim - 1] -= 0.2
    x[:, 0] *= -1 if dim == 2 else 1
    body = cn.ElasticBody(x, made.cells, young=1e6, poisson=0.3, density=1000.0, rayleigh=(0.0, 2e-3))
    at = node_at(body, np.zeros(dim))
    scene = scene_of(dim)
    nodes, weight = scene.add(cn.deformable(body, BAR)), scene.add(ball(dim, mass_of_bar(dim), low))
    scene.join(nodes[at], weight[0], cn.Cable(points=[0 * low, 0.3 * up(dim), low]))
    sim = simulate(scene, 2e-3, solver)
    for _ in range(250):
        assert sim.step()["status"] == "converged"
    hangs = mass_of_bar(dim) * G * 2e-3
    assert np.linalg.norm(sim.contacts.impulse[0]) == pytest.approx(hangs, rel=1e-6)
    world = int(np.argmax(sim.bodies.id))
    held = sim.bodies.reaction[world, :dim] - sim.bodies.mass[world] * G * 2e-3 * up(dim)
    assert held == pytest.approx(2 * hangs * up(dim), rel=1e-6, abs=1e-6 * hangs)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize(("pulley", "others"), [("before", 0), ("between", 0), ("between", 1)])
@pytest.mark.parametrize("first", [True, False])
@pytest.mark.parametrize("dim", [2, 3])
def test_what_flies_on_a_rope_keeps_its_momentum(dim, first, pulley, others, solver):
    """A bar of cells, a ball and the body of the pulley: all three are pulled, nothing comes from outside."""
    sim = simulate(roped(dim, 0.7, first=first, pulley=pulley, others=others, speeds=(-1.0, -0.5), gravity=False), H, solver)
    before, carried = sum(momentum(sim, dim)), int(np.argmin(np.abs(sim.bodies.mass - mass_of_bar(dim))))
    for _ in range(60):
        assert sim.step()["status"] == "converged"
        assert sim.info["iterations"] <= 2  # the block of one rope alone
        assert np.abs(sum(momentum(sim, dim)) - before).max() < 1e-9 * np.abs(before).max()
    assert np.linalg.norm(sim.bodies.velocity[carried, :dim]) > 0.05  # the pulley was drawn along
    assert closes(sim, 1e-9)


def chained(dim, links=15):
    """A bar of cells on a rope; beyond the pulley a chain of rods, more of them at the bar's other end, each on a joint."""
    scene = roped(dim, 0.5)
    middle, size = -0.1 * up(dim) - 0.25 * axis(dim, 0), 0.04
    weight = scene.sets[1].own_ids[0]
    for start, last in ((middle, weight), (0.2 * axis(dim, 0), scene.sets[0].own_ids[node_at(bar(dim), 0.2 * axis(dim, 0))])):
        for k in range(links):
            at = start - (k * size) * up(dim)
            rod = scene.add(ball(dim, 0.02 * mass_of_bar(dim), at - 0.5 * size * up(dim)))[0]
            scene.join(last, rod, cn.Pivot(point=at) if dim == 2 else cn.Ball(point=at))
            last = rod
    return scene


@pytest.mark.parametrize("dim", [2, 3])
def test_newtons_method_over_bodies_knows_the_node_and_the_far_end(dim):
    """Chains hang on both ends: `Auto` factorises over bodies and the dofs of the mesh, with the result of sweeps alone."""
    ends, solvers = [], set()
    for solver in (cn.NLGS(tol=1e-11, max_iter=200000), cn.Auto(tol=1e-11)):
        sim = simulate(chained(dim), H, solver)
        for _ in range(8):
            assert sim.step()["status"] == "converged"
            if not isinstance(solver, cn.NLGS):
                solvers.add(sim.info["solver"])
        ends.append(np.concatenate([sim.bodies.position, sim.nodes.position]))
    assert "newton_over_bodies" in solvers
    assert np.abs(ends[0] - ends[1]).max() < 1e-8 * 0.2
    assert np.linalg.norm(sim.contacts.impulse, axis=1).min() > 0


@pytest.mark.parametrize("dim", [2, 3])
def test_a_bar_that_rests_on_a_floor_is_drawn_by_its_rope(dim):
    """Rope at a node of a mesh whose contacts are swept in sequence: solvers agree, and the floor bears the rest of the
    weight."""
    ends = []
    for solver in (cn.NLGS(tol=1e-12, max_iter=100000), cn.Auto(tol=1e-12)):
        scene, body = scene_of(dim), bar(dim, cells=12, solid=False)
        at, top = node_at(body, np.zeros(dim)), 0.3 * up(dim)
        below = np.flatnonzero(body.points[:, dim - 1] < -0.019)
        nodes = scene.add(cn.deformable(body, BAR, contact=below))
        weight = scene.add(ball(dim, 0.3 * mass_of_bar(dim), 0.1 * up(dim) - 0.3 * axis(dim, 0)))
        floor = cn.Material("floor", density=1000.0)
        scene.add(cn.wall(-0.02 * up(dim), up(dim), floor))
        scene.interact(BAR, floor, cn.Coulomb(mu=0.5))
        scene.join(nodes[at], weight[0], cn.Cable(points=[0 * top, top, 0.1 * up(dim) - 0.3 * axis(dim, 0)]))
        sim = simulate(scene, H, solver)
        for _ in range(20):
            assert sim.step()["status"] == "converged"
        assert len(sim.contacts) > 8 * (dim - 1)
        ends.append(sim.nodes.position.copy())
    assert np.abs(ends[0] - ends[1]).max() < 1e-9 * 0.2


@pytest.mark.parametrize("what", ["bar", "weight"])
def test_a_rope_whose_end_is_gone_holds_nothing(what):
    sim = simulate(roped(2, 1.3), H)
    for _ in range(5):
        sim.step()
    weight = int(sim.bodies.id[np.argmin(np.abs(sim.bodies.mass - 1.3 * mass_of_bar(2)))])
    sim.remove(sim.meshes[0].all_ids if what == "bar" else [weight])
    before = [sim.bodies.velocity[:, 1].copy(), sim.nodes.velocity[:, 1].mean() if what == "weight" else 0.0]
    for _ in range(5):
        sim.step()
    assert len(sim.contacts) == 0
    if what == "bar":
        k = int(np.flatnonzero(sim.bodies.id == weight)[0])
        assert sim.bodies.velocity[k, 1] - before[0][k] == pytest.approx(-5 * G * H, rel=1e-9)
    else:
        mesh = sim.meshes[0]
        v = (mesh.body.M @ mesh.velocity.ravel()).reshape(-1, 2)[:, 1].sum() / mass_of_bar(2)
        assert v < before[1] - 2 * G * H


@pytest.mark.parametrize("dim", [2, 3])
def test_its_energy_changes_by_the_square_of_the_step(dim):
    """And the rope is no longer than it may be, where the next step detects it."""
    changes, span = [], np.linalg.norm([0.1, 0.3]) + np.linalg.norm([0.15, 0.4])
    for dt in (1e-3, 5e-4):
        sim, seen, top = simulate(roped(dim, 1.3), dt), [], 0.3 * up(dim) - 0.1 * axis(dim, 0)
        for _ in range(round(0.06 / dt)):
            sim.step()
            energy = sim.info["energy"]
            seen.append(sum(energy[name] for name in ("kinetic", "potential", "stored")))
            ball_at = sim.bodies.position[np.argmin(np.abs(sim.bodies.mass - 1.3 * mass_of_bar(dim)))]
            long = np.linalg.norm(sim.nodes.position[node_at(bar(dim), 0 * top)] - top) + np.linalg.norm(ball_at - top)
            assert long < span * (1 + 1e-8)
        changes.append(np.ptp(seen[2:]) / sim.info["energy"]["kinetic"])
    assert changes[0] < 1e-2 and changes[1] < 0.35 * changes[0]


@pytest.mark.parametrize("dim", [2, 3])
def test_a_slack_rope_gives_nothing_until_it_is_taut(dim):
    span = np.linalg.norm(0.3 * up(dim) - 0.1 * axis(dim, 0)) + np.linalg.norm(0.4 * up(dim) + 0.15 * axis(dim, 0))
    sim = simulate(roped(dim, 1.0, length=span + 0.02), H)
    for _ in range(30):
        sim.step()
    assert np.abs(sim.contacts.impulse).max() == 0
    assert sim.nodes.velocity[:, dim - 1] == pytest.approx(np.full(len(sim.nodes), -G * 30 * H), rel=1e-9)
    pulled = 0.0
    for _ in range(60):
        sim.step()
        pulled = max(pulled, np.abs(sim.contacts.impulse).max())
    assert pulled > mass_of_bar(dim) * G * H
    assert sim.bodies.velocity[0, dim - 1] > -0.9 * G * 90 * H
    assert closes(sim, 1e-9)


@pytest.mark.parametrize("dim", [2, 3])
def test_it_breaks_at_its_tension(dim):
    weight = mass_of_bar(dim) * G
    for strength, holds in ((2.5 * weight, True), (0.02 * weight, False)):
        sim = simulate(roped(dim, 1.0, strength=strength), H)
        for _ in range(20):
            sim.step()
        assert (sim.contacts.beta.max(initial=0.0) == 1) == holds
    before = sim.bodies.velocity[0].copy()
    sim.step()
    assert sim.bodies.velocity[0, dim - 1] == pytest.approx(before[dim - 1] - G * H, rel=1e-12)


@pytest.mark.parametrize("first", [True, False])
def test_restart_and_scene_file_go_on_to_the_same_bits(tmp_path, first):
    once, half = (simulate(roped(3, 1.3, first=first), H) for _ in range(2))
    for _ in range(30):
        once.step()
    for _ in range(10):
        half.step()
    half.checkpoint(tmp_path / "half.h5")
    roped(3, 1.3, first=first).save(tmp_path / "roped.scene.h5")
    again = simulate(cn.Scene.load(tmp_path / "roped.scene.h5"), H)
    again.restore(tmp_path / "half.h5")
    for _ in range(20):
        again.step()
    assert np.array_equal(again.nodes.position, once.nodes.position)
    assert np.array_equal(again.bodies.position, once.bodies.position)


def test_a_bar_whose_stresses_are_linear_hangs_as_well():
    """An ElasticBody, by its condensed compliance, against the same with the material's stresses, at small strains."""
    found = []
    for solid in (True, False):
        sim = simulate(roped(2, 1.3, body=bar(2, solid=solid)), 2e-4)
        for _ in range(20):
            assert sim.step()["status"] == "converged"
        found.append(sim.nodes.position.copy())
    assert np.abs(found[0] - found[1]).max() < 1e-5 * 0.2


def test_what_a_rope_cannot_hold_is_told():
    scene = scene_of(2)
    one, two = (bar(2, begin=begin) for begin in (0.0, 0.5))
    nodes, others = (scene.add(cn.deformable(body, BAR)) for body in (one, two))
    ball_id = scene.add(ball(2, 1.0, (0.0, -1.0)))[0]
    at, other = nodes[node_at(one, [0, 0])], others[node_at(two, [0.5, 0])]
    for make, told in (
        (lambda: scene.join(at, other, cn.Cable(points=[(0, 0), (0.2, 1), (0.5, 0)])), "nodes of meshes: give one end a rigid"),
        (lambda: scene.join(ball_id, None, cn.Cable(points=[(0, -1), (0, 0), (1, 0)], pulley=at)), "pulley of Cable is .* node"),
        (lambda: scene.join(at, ball_id, cn.Cable(points=[(0, 0.1), (0, 1), (0, -1)])), "give the place of the node"),
    ):
        before = len(scene.rules), len(scene.sets)
        with pytest.raises(ValueError, match=told):
            make()
        assert (len(scene.rules), len(scene.sets)) == before
