"""Impulses of rest found for all bodies at once: against closed forms, numerical derivatives, and the step that follows."""

from types import SimpleNamespace

import cairn as cn
import numpy as np
import pytest
from cairn import _core
from cairn.post.masonry import Structure
from cairn.pre import masonry
from cairn.run.equilibrium import System
from cairn.run.equilibrium_contacts import on_faces
from report import judge

G = 9.81


def structure(blocks, mu=0.6, dt=2e-3, iterations=1):
    """Blocks under gravity with a solver that has no time to find anything itself."""
    scene = cn.Scene(dim=blocks.dim, gravity=(0.0,) * (blocks.dim - 1) + (-G,))
    ids = blocks.add_to(scene, cn.Material("stone", density=2500.0))
    scene.interact("*", "*", cn.Coulomb(mu=mu))
    solver = cn.NLGS(tol=1e-5, max_iter=iterations)
    return Structure(blocks, cn.Simulation(scene, dt, cn.NSCD(theta=1.0, solver=solver, threads=1)), ids)


@pytest.mark.parametrize("dim", [2, 3])
def test_projection_and_its_derivative(dim):
    """p - P is in the polar cone and orthogonal to P, which is in the cone; the derivative against differences."""
    generator = np.random.default_rng(4)
    p, mu = generator.normal(size=(300, dim)), generator.uniform(0, 2, 300)
    mu[:10], mu[10:20] = 0, 1e3
    project = _core.project_on_cones
    r, d = project(p, mu), _core.cone_derivatives(p, mu, np.ones(300))
    away = p - r
    size = np.linalg.norm
    assert np.all(size(r[:, 1:], axis=1) <= mu * r[:, 0] * (1 + 1e-12) + 1e-15)
    assert np.all(away[:, 0] <= -mu * size(away[:, 1:], axis=1) + 1e-12)
    assert np.max(np.abs(np.sum(r * away, axis=1))) < 1e-12
    assert not project(-np.eye(dim)[:1], np.zeros(1)).any()  # what pulls without friction and slip
    step = 1e-6
    for k in range(dim):
        by = step * np.eye(dim)[k]
        difference = (project(p + by, mu) - project(p - by, mu)) / (2 * step)
        assert np.quantile(np.abs(difference - d[:, :, k]), 0.999) < 1e-5  # except at corners of the cone
    weight = generator.uniform(1, 2, 300)
    np.testing.assert_allclose(_core.cone_derivatives(p, mu, weight), weight[:, None, None] * d, rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize(
    "blocks",
    [
        masonry.arch(radius=1.0, thickness=0.2, voussoirs=21),
        masonry.arch(radius=1.0, thickness=0.2, voussoirs=9, depth=0.5),
        masonry.wall(1.1, 5, (0.22, 0.11, 0.055)),
        masonry.panel(4, 30, brick=(0.4, 0.2)),
    ],
    ids=["arch", "arch with a depth", "wall", "high panel"],
)
def test_a_step_from_impulses_of_rest_is_at_rest(blocks):
    """One iteration finds nothing to do, in the first step and in those that follow."""
    s = structure(blocks)
    found = cn.find_equilibrium(s.simulation, tol=1e-8, unbalanced=1e-7)
    assert found["converged"] and s.simulation.steps == 0 and s.displacement().max() == 0
    for _ in range(5):
        s.simulation.step()
        info, balance = s.simulation.info, s.balance()
        print(found, info["error"], balance["unbalanced"], balance["reaction_error"])
        assert info["status"] == "converged" and info["iterations"] == 1
        assert balance["unbalanced"] < 1e-5 and balance["reaction_error"] < 1e-6
    assert s.displacement().max() < 1e-7


def test_without_them_one_iteration_is_far_from_rest():
    s = structure(masonry.panel(4, 30, brick=(0.4, 0.2)))
    s.simulation.step()
    assert s.simulation.info["status"] == "iteration_limit" and s.balance()["unbalanced"] > 0.1


def test_stack_carries_what_is_above():
    n = 20
    s = structure(masonry.panel(1, n, brick=(1.0, 1.0), bond="stack"))
    cn.find_equilibrium(s.simulation, tol=1e-10, unbalanced=1e-9)
    s.simulation.step()
    r = s.resultants()
    judge("joint forces of a stack", np.sort(r.pressure), 2500.0 * G * np.arange(1, n + 1), 1e-8)


def test_what_cannot_stand_does_not_converge():
    """An arch thinner than any that stands: the step's own problem is solved, and bodies move."""
    s = structure(masonry.arch(radius=1.0, thickness=0.08, voussoirs=21))
    found = cn.find_equilibrium(s.simulation, rounds=40)
    assert not found["converged"] and found["unbalanced"] > 1e-2


def test_edges_and_corners_are_no_faces():
    """Blocks that touch along a line or at a corner: the normal there is not determined, so they are given nothing."""
    face = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]
    line = [[5, 5, 5], [6, 6, 6], [5.5, 5.5, 5.5]]
    corner = [[9, 9, 9]]
    bodies = [[1, 0], [0, 1], [0, 1], [1, 0]] + 3 * [[1, 2]] + [[2, 3]]
    touch = SimpleNamespace(point=np.array(face + line + corner, float), bodies=np.array(bodies))
    assert on_faces(touch).tolist() == 4 * [True] + 4 * [False]
    touch = SimpleNamespace(point=np.array([[0.0, 0], [1, 0], [3, 3]]), bodies=np.array([[0, 1], [0, 1], [1, 2]]))
    assert on_faces(touch).tolist() == [True, True, False]


def test_bridge_stays_at_rest():
    """A tier of two arches, where many blocks touch along edges: impulses there would be lost as soon as normals turn."""
    s = structure(masonry.bridge([masonry.Tier(2, 6.0, 3.0, 3.0, 3.0, 0.9, 0.4, voussoirs=9, across=2)]), mu=0.5, dt=1e-3)
    assert cn.find_equilibrium(s.simulation, tol=1e-6, unbalanced=2e-5)["converged"]
    for _ in range(4):
        s.simulation.step()
    balance = s.balance()
    assert s.simulation.info["iterations"] == 1 and s.simulation.info["error"] < 1e-5
    assert balance["unbalanced"] < 1e-3 and balance["reaction_error"] < 1e-5


def test_wrong_inputs_are_refused():
    s = structure(masonry.panel(1, 2, brick=(1.0, 1.0), bond="stack"))
    for wrong in ({"tol": 0}, {"tol": np.nan}, {"unbalanced": -1}, {"rounds": 0}, {"stiffness": np.inf}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            cn.find_equilibrium(s.simulation, **wrong)
    scene = cn.Scene(dim=2, gravity=(0, -G))
    scene.add(cn.disks([[0.0, 5.0]], [1.0], cn.Material("stone", density=1.0)))
    with pytest.raises(ValueError, match="touch"):
        cn.find_equilibrium(cn.Simulation(scene, 1e-3))


def test_forces_on_bodies_count():
    """A block pushed by 0.3 of its weight: the equilibrium balances the push, and the next step keeps it."""
    scene = cn.Scene(dim=2, gravity=(0.0, -G))
    stone = cn.Material("stone", density=1000.0)
    corners = [[-0.5, 0], [0.5, 0], [0.5, 0.5], [-0.5, 0.5]]
    scene.add(cn.polygons([corners], stone, force=(0.3 * 500.0 * G, 0.0)))
    scene.add(cn.wall(point=(0, 0), normal=(0, 1), material=stone))
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    simulation = cn.Simulation(scene, 1e-3, cn.NSCD(theta=1.0, solver=cn.NLGS(tol=1e-5, max_iter=1)))
    assert cn.find_equilibrium(simulation, tol=1e-9, unbalanced=1e-8)["converged"]
    simulation.step()
    c = simulation.contacts
    up = np.where(c.normal[:, 1] > 0, 1.0, -1.0)[:, None]
    np.testing.assert_allclose((up * c.force).sum(axis=0) / (500.0 * G), [-0.3, 1.0], atol=1e-6)
    assert np.abs(simulation.bodies.velocity).max() < 1e-6 * G * 1e-3


def bridge_of_three():
    tier = masonry.Tier(3, 6.0, 3.0, 3.0, 3.0, 0.9, 0.4, voussoirs=11, across=2)
    return structure(masonry.bridge([tier]), mu=0.5, dt=1e-3).simulation


def test_where_energies_differ_by_rounding_newtons_method_does_not_turn_in_circles():
    found = cn.find_equilibrium(bridge_of_three(), 1e-6, 1e-5)
    assert found["converged"] and found["newton"] <= 40  # it was at the limit of 100 a round, in three steps again and again


def test_a_matrix_to_which_changes_are_added_is_that_which_is_summed_anew():
    sim = bridge_of_three()
    sim.step()
    system = System(sim)
    rng = np.random.default_rng(1)
    even = lambda d: d + d.swapaxes(-1, -2)  # noqa: E731
    d = even(rng.random((len(system.r), 3, 3)))
    system.matrix.begin()
    system.matrix.of(d)
    for _ in range(3):
        d = d.copy()
        d[rng.random(len(d)) < 0.2] = even(rng.random((3, 3)))
        added = system.matrix.of(d).data.copy()
    system.matrix.begin()
    matrix = system.matrix.of(d)
    assert np.abs(added - matrix.data).max() < 1e-12 * np.abs(matrix.data).max()
    v = rng.random(system.v_free.shape)  # M v + H D H'v, by the rows of contacts
    product = system.momentum(v) + system.gathered(np.einsum("mij,mj->mi", d, system.relative(v)))
    assert np.abs(matrix @ v - product).max() < 1e-12 * np.abs(product).max()
    z = system.modes.toarray()
    whole = np.stack([(matrix @ column.reshape(v.shape)).ravel() for column in z.T], axis=1)
    assert np.abs(matrix.projected(system.modes).toarray() - z.T @ whole).max() < 1e-12 * np.abs(z.T @ whole).max()


def heap(kind, **of_bodies):
    scene = cn.Scene(2, gravity=(0, -G))
    rock = cn.Material("rock", density=1000.0)
    if kind == "lid":
        scene.add(cn.disks([[0, 0.1], [0, 0.3]], 0.1, rock, **of_bodies))
        scene.add(cn.wall((0, 0.4), (0, -1), rock, mass=5.0, free="vy", force=(0, -10.0)))
        weight = 2 * np.pi * 10 * G + 5 * G + 10
    else:
        row = np.array([[0.2 * i + 0.1 * j, 0.1 + 0.1 * np.sqrt(3) * j] for j in range(5) for i in range(6 - j)])
        scene.add(cn.disks(row, 0.1, rock, **of_bodies))
        for x, n in ((-0.1, 1), (1.1, -1)):
            scene.add(cn.wall((x, 0), (n, 0), rock))
        weight = len(row) * np.pi * 10 * G
    scene.add(cn.wall((0, 0), (0, 1), rock))
    return scene, weight


@pytest.mark.parametrize("law", [cn.Coulomb(mu=0.5), cn.UnilateralContact(mu=0.5)])
@pytest.mark.parametrize(
    ("kind", "driven"), [("column", ()), ("column", ("w",)), ("lid", ("vx",)), ("lid", ()), ("lid", ("w",)), ("column", ("vx",))]
)
def test_round_and_guided_bodies_at_rest(kind, driven, law):
    """Disks and a lid that moves along y alone, under laws with and without a state: held bodies carry their weight."""
    scene, weight = heap(kind, driven=driven)
    scene.interact("*", "*", law)
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(theta=1.0, solver=cn.NLGS(tol=1e-5, max_iter=1)), overlap="ignore")
    found = cn.find_equilibrium(sim, tol=1e-7, unbalanced=1e-7)
    assert found["converged"] and sim.steps == 0
    place = sim.bodies.position.copy()
    for _ in range(3):
        assert sim.step()["status"] == "converged"
    assert np.abs(sim.bodies.position - place).max() < 1e-9
    held = sim.bodies.id[np.isinf(sim.bodies.mass)]
    on_b, on_a = np.isin(sim.contacts.bodies, held).T[::-1].astype(float)
    judge("reaction of walls and floor", np.sum((on_b - on_a) * sim.contacts.force[:, 1]), weight, 1e-5)


def test_a_state_of_contacts_stays():
    """The state of a law survives: a slip that has begun, a gap that counts from the start."""
    scene, _ = heap("lid")
    scene.interact("*", "*", cn.UnilateralContact(mu=0.5, from_start=1))
    sim = cn.Simulation(scene, 1e-3, overlap="ignore")
    for _ in range(5):
        sim.step()
    before = sim.get_state()["memory"]
    assert cn.find_equilibrium(sim, rounds=3)["error"] < 1e-3
    after = sim.get_state()["memory"]
    kept = [
        {tuple(key): tuple(state) for key, state in zip(m["keys"], np.reshape(m["states"], (len(m["keys"]), -1)), strict=True)}
        for m in (before, after)
    ]
    assert len(kept[0]) > 0 and kept[0] == kept[1]


def test_a_settled_heap_of_disks():
    """Gaps of many sizes: where Newton's method is lost among stiff contacts, softer ones find the way."""
    generator = np.random.default_rng(3)
    scene = cn.Scene(2, gravity=(0, -G))
    rock = cn.Material("rock", density=1000.0)
    places = np.array([[0.12 * i, 0.1 + 0.12 * j] for j in range(6) for i in range(8)]) + generator.uniform(0, 0.01, (48, 2))
    scene.add(cn.disks(places, generator.uniform(0.04, 0.055, 48), rock))
    for x, n in (((0, 0), (0, 1)), ((-0.07, 0), (1, 0)), ((0.95, 0), (-1, 0))):
        scene.add(cn.wall(x, n, rock))
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    sim = cn.Simulation(scene, 2e-3)
    for _ in range(1500):
        sim.step()
    sim.bodies.set(velocity=np.zeros_like(sim.bodies.velocity))
    assert cn.find_equilibrium(sim)["converged"]


def test_what_cannot_be_asked_for_rest_is_told():
    scene, _ = heap("column")
    scene.interact("*", "*", cn.ElasticContact(stiffness=1e7, mu=0.5))
    with pytest.raises(ValueError, match="contacts give way as springs do .* let the scene settle, or give UnilateralContact"):
        cn.find_equilibrium(cn.Simulation(scene, 1e-3, overlap="ignore"))
    scene, _ = heap("column")
    scene.gravity = (0, 0)
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    with pytest.raises(ValueError, match="nothing moves the bodies when they are let go: give gravity or a force"):
        cn.find_equilibrium(cn.Simulation(scene, 1e-3, overlap="ignore"))


def test_the_problem_of_a_step_has_the_compliance_of_its_laws():
    """A disk on a spring: W is 1/m + 1/(k h^2), and its impulse that of the step."""
    scene = cn.Scene(2, gravity=(0, -G))
    rock = cn.Material("rock", density=1000.0)
    scene.add(cn.disks([[0, 0.0999]], 0.1, rock), cn.wall((0, 0), (0, 1), rock))
    scene.interact("*", "*", cn.ElasticContact(stiffness=1e6, mu=0.3))
    h = 1e-3
    sim = cn.Simulation(scene, h, cn.NSCD(theta=1.0), overlap="ignore")
    sim.step()
    p = sim.problem()
    assert p.W.toarray()[0, 0] == pytest.approx(1 / sim.bodies.mass[0] + 1 / (1e6 * h * h), rel=1e-12)
    assert p.solve(tol=1e-12).r[0, 0] == pytest.approx(sim.contacts.impulse_local[0, 0], rel=1e-6)
