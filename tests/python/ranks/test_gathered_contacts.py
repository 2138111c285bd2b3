"""Auto over ranks: contacts that sweeps do not solve are gathered, solved as without ranks, to the same bits for every number."""


import cairn as cn
import numpy as np
import pytest
from over_mpi import digest_of

ROCK = cn.Material("rock", density=2400.0)
SQUARE = np.array([(-0.5, -0.25), (0.5, -0.25), (0.5, 0.25), (-0.5, 0.25)])
AUTO = cn.NSCD(solver=cn.Auto(tol=1e-4))
G = 9.81


def on_floor(*sets, law=None):
    scene = cn.Scene(2, gravity=(0.0, -G))
    scene.add(*sets, cn.wall((0, 0), (0, 1), ROCK))
    scene.interact(ROCK, ROCK, law or cn.Coulomb(mu=0.4))
    return scene


def tower(ratio=1e6):
    """Five blocks under one of `ratio` times their mass."""
    light = cn.polygons([SQUARE + (0, 0.25 + 0.5 * k) for k in range(5)], ROCK)
    return on_floor(light, cn.polygons([SQUARE + (0, 2.75)], ROCK, density=2400.0 * ratio))


def arch():
    """Eleven voussoirs on two springers, under a block of ten times their density on the keystone."""
    n, inner, outer = 11, 4.0, 5.2
    angles = np.linspace(np.pi, 0, n + 1)
    stones = []
    for a, b in zip(angles[:-1], angles[1:]):
        corners = [(r * np.cos(t), r * np.sin(t)) for r, t in ((inner, a), (outer, a), (outer, b), (inner, b))]
        stones.append(np.array(corners)[::-1])
    scene = on_floor(cn.polygons(stones, ROCK), law=cn.Coulomb(mu=0.7))
    scene.add(cn.polygons([SQUARE * (0.6, 1) + (0, outer * np.cos(np.pi / 2 / n) + 0.25)], ROCK, density=2.4e4))
    return scene


def bonded_wall():
    """A bonded wall that stands out from its first stones."""
    scene = cn.Scene(2, gravity=(0.0, -G))
    scene.interact(ROCK, ROCK, cn.Bonded(mu=0.5))
    rows = [SQUARE + (k + 0.5 * (row % 2), 0.25 + 0.5 * row) for row in range(4) for k in range(8)]
    scene.add(cn.polygons(rows, ROCK))
    scene.add(cn.polygons([SQUARE + (-1.0 + 0.5 * (row % 2), 0.25 + 0.5 * row) for row in range(4)], ROCK, fixed=True))
    return scene


def chain():
    """Ten bars from a fixed point, with a ball of 10,000 times their mass at the end."""
    scene = cn.Scene(2, gravity=(0.0, -G))
    scene.interact("*", "*", None)
    bars = [scene.add(cn.polygons([SQUARE * (0.8, 0.2) + (k + 0.5, 0.0)], ROCK))[0] for k in range(10)]
    ball = scene.add(cn.disks([(10.5, 0.0)], 0.3, ROCK, density=2400.0 * 1e4 * 0.08 / (np.pi * 0.09)))[0]
    scene.join(bars[0], None, cn.Pivot(point=(0.0, 0.0)))
    for k, (a, b) in enumerate(zip(bars, [*bars[1:], ball])):
        scene.join(a, b, cn.Pivot(point=(k + 1.0, 0.0)))
    return scene


def lid():
    """Grains in a box under a slab of a million times their mass."""
    x = np.stack(np.meshgrid(np.arange(8), np.arange(4)), -1).reshape(-1, 2) + 0.5
    scene = on_floor(cn.disks(x, 0.5, ROCK), cn.wall((0, 0), (1, 0), ROCK), cn.wall((8, 0), (-1, 0), ROCK))
    scene.add(cn.polygons([np.array([(0.1, 4.0), (7.9, 4.0), (7.9, 4.5), (0.1, 4.5)])], ROCK, density=2400.0 * 1e6))
    return scene


def falling_bonds():
    """Grains bonded on touch, which fall into a corner: their rings do not close after a turn."""
    x = np.stack(np.meshgrid(np.arange(6), np.arange(6)), -1).reshape(-1, 2) + 0.7
    v = np.random.default_rng(1).normal(0, 0.3, x.shape) - 3.0
    scene = cn.Scene(2, gravity=(-6.0, -G))
    scene.interact(ROCK, ROCK, cn.Bonded(mu=0.3))
    scene.add(cn.disks(x, 0.5, ROCK, velocity=v), cn.wall((0, 0), (0, 1), ROCK), cn.wall((0, 0), (1, 0), ROCK))
    return scene


def joined_in_a_cell(dim):
    """Grains under a stress; some are joined in pairs, whose balls do not touch each other."""
    n, bone = {2: 6, 3: 4}[dim], cn.Material("bone", density=2600.0)
    rng = np.random.default_rng(dim)
    places = np.stack(np.meshgrid(*[np.arange(n)] * dim, indexing="ij"), -1).reshape(-1, dim)
    x = (places + 0.5) * 0.93 + rng.uniform(-0.02, 0.02, places.shape)
    scene = cn.Scene(dim, periodic=cn.Periodic((0.93 * n,) * dim, stress=2e4))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    scene.interact(bone, bone, None)
    pairs = [(n * k, n * k + 1) for k in range(n ** (dim - 1))]
    held = np.isin(np.arange(len(x)), pairs)
    radius, balls = rng.uniform(0.44, 0.48, len(x)), cn.disks if dim == 2 else cn.spheres
    ids = np.zeros(len(x), int)
    for which, material in ((~held, ROCK), (held, bone)):
        ids[which] = scene.add(balls(x[which], radius[which], material))
    for a, b in pairs:
        scene.join(int(ids[a]), int(ids[b]), (cn.Pivot if dim == 2 else cn.Ball)(point=(x[a] + x[b]) / 2))
    return scene


SCENES = [tower, arch, bonded_wall, chain, lid]


def run(scene, ranks, steps, strategy=AUTO, sim=None, dt=1e-3, **options):
    sim = sim or cn.Simulation(scene(), dt, strategy, overlap="ignore", ranks=ranks, **options)
    ends = []
    for _ in range(steps):
        sim.step()
        ends.append(sim.info["status"])
    return sim, ends


def digest(sim):
    state = [sim.bodies.position, sim.bodies.rotation, sim.bodies.velocity, sim.contacts.key, sim.contacts.impulse]
    state.append(np.array(list(sim.energy.values())))
    return digest_of(state)


@pytest.mark.parametrize("scene", SCENES, ids=lambda s: s.__name__)
def test_the_same_bits_for_every_number_of_ranks(scene):
    sims = [run(scene, ranks, 12)[0] for ranks in (1, 2, 3, 4, 7)]
    assert len({digest(sim) for sim in sims}) == 1
    assert sims[0].ranks.figures()["gathered_solves"] > 0


# how far bodies are from those without ranks after 30 steps, over the free fall in this time: ten times what was found, or more
APART = {"tower": 1e-13, "arch": 4e-11, "bonded_wall": 2e-11, "chain": 2e-7, "lid": 2e-5}


@pytest.mark.parametrize("scene", SCENES, ids=lambda s: s.__name__)
def test_steps_converge_where_those_without_ranks_do(scene):
    over, ends = run(scene, 3, 30)
    alone, due = run(scene, None, 30)
    assert ends.count("converged") >= due.count("converged")
    fall = 9.81 * alone.time**2 / 2
    assert np.abs(over.bodies.position - alone.bodies.position).max() <= APART[scene.__name__] * fall


def test_limited_biases_of_bonds_go_back_to_the_ranks():
    """Without them impulses would not fit: the error would rise with each answer."""
    over, ends = run(falling_bonds, 3, 40, dt=2e-3)
    sweeps, due = run(falling_bonds, 3, 40, cn.NSCD(solver=cn.NLGS(tol=1e-4)), dt=2e-3)
    assert over.ranks.figures()["gathered_solves"] > 0
    assert ends.count("converged") >= max(38, due.count("converged"))
    assert digest(over) == digest(run(falling_bonds, 2, 40, dt=2e-3)[0])


@pytest.mark.parametrize("dim", [2, 3])
def test_cells_under_a_stress_hold_joints(dim):
    made = lambda: joined_in_a_cell(dim)
    over, ends = run(made, 3, 30, cn.NSCD(solver=cn.Auto(tol=1e-6)))
    alone, due = run(made, None, 30, cn.NSCD(solver=cn.Auto(tol=1e-6)))
    assert ends.count("converged") >= due.count("converged") - 1 and due.count("converged") >= 28
    assert digest(over) == digest(run(made, 7, 30, cn.NSCD(solver=cn.Auto(tol=1e-6)))[0])
    size = np.abs(alone.cell["stress"]).max()
    assert size > 0 and np.abs(alone.cell["stress"] - over.cell["stress"]).max() < 1e-5 * size
    moved = np.abs(alone.bodies.position - run(made, None, 0)[0].bodies.position).max()
    assert np.abs(alone.bodies.position - over.bodies.position).max() < 2e-6 * moved
    assert abs(over.energy["closure"]) < 1e-14 * over.energy["in_play"]


@pytest.mark.parametrize("ratio", [1.0, 1e3, 1e4, 1e6, 1e9])
def test_heavy_blocks_do_not_sink_into_light_ones(ratio):
    sim, ends = run(lambda: tower(ratio), 3, 60)
    assert set(ends) == {"converged"}
    height = np.append(0.25 + 0.5 * np.arange(5), 2.75)
    assert (np.abs(sim.bodies.position[:6, 1] - height) < 1e-14 * height).all()


def test_sweeps_alone_let_it_sink():
    sim, ends = run(tower, 3, 10, cn.NSCD(solver=cn.NLGS(tol=1e-4)))
    assert "iteration_limit" in ends and sim.ranks.figures()["gathered_solves"] == 0


def test_nothing_is_gathered_where_sweeps_converge():
    rng = np.random.default_rng(0)
    x = np.stack(np.meshgrid(np.arange(20), np.arange(20)), -1).reshape(-1, 2) * 1.0 + rng.uniform(-0.02, 0.02, (400, 2)) + 0.6
    sim, ends = run(lambda: on_floor(cn.disks(x, 0.45, ROCK)), 4, 40)
    assert set(ends) == {"converged"} and sim.ranks.figures()["gathered_solves"] == 0
    sweeps = run(lambda: on_floor(cn.disks(x, 0.45, ROCK)), 2, 40, cn.NSCD(solver=cn.NLGS(tol=1e-4)))[0]
    assert digest(sweeps) == digest(sim)


def falling_grains():
    rng = np.random.default_rng(1)
    x = np.stack(np.meshgrid(np.arange(8), np.arange(8)), -1).reshape(-1, 2) * 1.02 + 0.52 + rng.uniform(-0.01, 0.01, (64, 2))
    grains = cn.disks(x, rng.uniform(0.45, 0.5, 64), ROCK)
    return on_floor(grains, cn.wall((0, 0), (1, 0), ROCK), cn.wall((8.26, 0), (-1, 0), ROCK))


@pytest.mark.parametrize("solver", [cn.NLGS, cn.Auto])
def test_velocities_are_as_exact_as_is_asked(solver):
    exact = run(falling_grains, None, 150, cn.NSCD(solver=solver(tol=1e-11, max_iter=100000)), dt=2e-3)[0].bodies.velocity
    off = {}
    for accuracy in (None, 1e-4):
        strategy = cn.NSCD(solver=solver(), accuracy=accuracy)
        sims = [run(falling_grains, ranks, 150, strategy, dt=2e-3) for ranks in (1, 3)]
        assert digest(sims[0][0]) == digest(sims[1][0]) and set(sims[0][1]) == {"converged"}
        off[accuracy] = np.linalg.norm(sims[0][0].bodies.velocity - exact) / np.linalg.norm(exact)
    assert sims[0][0].info["velocity_error"] <= 1e-4
    assert off[1e-4] < 0.01 * off[None]


@pytest.mark.parametrize("solver", [cn.PPANewton(tol=1e-8), cn.ADMM(tol=1e-6)], ids=lambda s: s.name)
def test_solvers_of_problems_take_gathered_contacts(solver):
    sims = [run(falling_grains, ranks, 100, cn.NSCD(solver=solver), dt=2e-3) for ranks in (None, 1, 3)]
    assert digest(sims[1][0]) == digest(sims[2][0]) and sims[1][0].ranks.figures()["gathered_solves"] == 100
    assert sims[1][0].info["solver"] == sims[0][0].info["solver"]
    assert sims[1][1].count("converged") >= sims[0][1].count("converged") - 1
    speed = np.abs(sims[0][0].bodies.velocity)
    assert np.abs(sims[0][0].bodies.velocity - sims[1][0].bodies.velocity).max() < 1e-4 * speed.max()


def test_what_a_solver_of_problems_tells_is_told_over_ranks():
    """More contacts than it counts states of: its own hint, and not one to allow more iterations."""
    twelve = cn.disks([(1.2 * k, 0.5) for k in range(12)], 0.5, ROCK)
    hints = []
    for ranks in (1, 3):
        sim = cn.Simulation(on_floor(twelve), 1e-3, cn.NSCD(solver=cn.Enumeration()), ranks=ranks)
        sim.step()
        assert sim.info["status"] == "iteration_limit"
        hints.append(sim.info["hint"])
    assert "more than 8 contacts have too many states" in hints[0] and "iterations, a larger tol" not in hints[0]
    assert hints[0] == hints[1]


def test_solvers_of_problems_refuse_what_they_refuse_without_ranks():
    sim = run(falling_bonds, 2, 0, cn.NSCD(solver=cn.ADMM()))[0]
    told = []
    for made in (sim, run(falling_bonds, None, 0, cn.NSCD(solver=cn.ADMM()))[0]):
        with pytest.raises(ValueError) as refusal:
            made.run(60, progress=False)
        told.append(str(refusal.value))
    assert told[1] in told[0] and "take cairn.NLGS or cairn.Auto" in told[0]
    before, steps = np.array(sim.bodies.position), sim.steps
    with pytest.raises(ValueError):
        sim.step()
    assert sim.steps == steps and np.array_equal(sim.bodies.position, before)
    sim.strategy = AUTO  # the failed step is undone, and the run goes on
    other = run(falling_bonds, 1, steps, cn.NSCD(solver=cn.ADMM()))[0]
    other.strategy = AUTO
    assert digest(run(None, 2, 20, sim=sim)[0]) == digest(run(None, 1, 20, sim=other)[0])


def test_an_accuracy_that_cannot_be_measured_is_refused():
    cell = run(lambda: joined_in_a_cell(2), 2, 0, cn.NSCD(solver=cn.Auto(), accuracy=1e-3))[0]
    with pytest.raises(ValueError, match="accuracy is .*the cell follows a stress between sweeps; leave accuracy out"):
        cell.step()


def test_restart_on_other_numbers_of_ranks(tmp_path):
    whole, path = run(tower, 1, 24)[0], tmp_path / "tower.checkpoint.h5"
    sim = run(tower, 3, 8)[0]
    for ranks in (5, 1):
        sim.checkpoint(path)
        sim = run(tower, ranks, 0)[0]
        sim.restore(path)
        run(tower, ranks, 8, sim=sim)
    assert digest(sim) == digest(whole)


def test_one_exchange_a_sweep():
    sim, ends = run(tower, 3, 30, exchange="sweep")
    assert set(ends) == {"converged"}
    assert np.abs(sim.bodies.position[5, 1] - 2.75) < 1e-14 * 2.75


def test_contacts_that_exceed_the_memory_are_not_gathered():
    sim, ends = run(tower, 2, 6, cn.NSCD(solver=cn.Auto(memory=1e3)))
    assert "iteration_limit" in ends and sim.ranks.figures()["gathered_solves"] == 0
    assert "bytes on one rank, the limit is 1e+03" in sim.info["hint"]


def test_default_takes_auto_by_the_scene_and_explain_tells_of_it():
    sim = run(tower, 2, 3, cn.NSCD())[0]
    assert isinstance(sim.strategy.solver, cn.Auto) and sim.strategy.solver.enough is None
    text = sim.explain()
    assert "contacts of all ranks were gathered on one" in text and "bytes" in text
