"""One scene over ranks that take turns in this process: the same bits for every number of ranks and threads."""

import math

import cairn as cn
import numpy as np
import pytest
from cairn import _core
from over_mpi import digest_of

ROCK = cn.Material("rock", density=2600.0)
NLGS = cn.NSCD(solver=cn.NLGS(tol=1e-6))


def grid(n, dim, pitch, seed, shift=0.02):
    rng = np.random.default_rng(seed)
    places = np.stack(np.meshgrid(*[np.arange(n)] * dim, indexing="ij"), -1).reshape(-1, dim)
    return (places + 0.7) * pitch + rng.uniform(-shift, shift, places.shape), rng


def new(dim, law=None, **options):
    scene = cn.Scene(dim=dim, gravity=(-6.0,) + (0.0,) * (dim - 2) + (-9.81,), **options)
    scene.interact(ROCK, ROCK, law or cn.Coulomb(mu=0.4))
    return scene


def closed(scene, length):
    """Walls below and beside."""
    for axis in range(scene.dim):
        normal = np.eye(scene.dim)[axis]
        scene.add(cn.wall(np.zeros(scene.dim), normal, ROCK))
        if axis < scene.dim - 1:
            scene.add(cn.wall(length * normal, -normal, ROCK))
    return scene


def disks():
    scene = new(2)
    x, rng = grid(9, 2, 0.97, 1)
    scene.add(cn.disks(x, rng.uniform(0.42, 0.48, len(x)), ROCK))
    return closed(scene, 9.8)


def spheres():
    scene = new(3)
    x, rng = grid(5, 3, 0.98, 2)
    scene.add(cn.spheres(x, rng.uniform(0.4, 0.48, len(x)), ROCK))
    return closed(scene, 5.4)


def polygons():
    scene = new(2)
    x, rng = grid(8, 2, 0.82, 3)
    for k, place in enumerate(x):
        corners = 3 + k % 4
        angle = rng.uniform(0, 6) + np.arange(corners) * 2 * math.pi / corners
        scene.add(cn.polygons(place + 0.4 * np.stack([np.cos(angle), np.sin(angle)], 1), ROCK, velocity=(-2.0, -4.0)))
    return closed(scene, 7.4)


def polyhedra():
    scene = new(3)
    x, rng = grid(4, 3, 0.8, 4)
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    corner = np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)], float)
    for place in x:
        scene.add(cn.polyhedra((place + corner * rng.uniform(0.28, 0.35, 3), faces), ROCK, velocity=(-1.0, 0.0, -2.0)))
    return closed(scene, 4.2)


def clumps():
    scene = new(2)
    x, rng = grid(7, 2, 0.98, 5)
    scene.add(cn.clumps(x, [(-0.2, 0.0), (0.25, 0.05)], [0.3, 0.25], 1000.0, 100.0, ROCK, rotation=rng.uniform(0, 6, len(x)),
                       velocity=np.tile((-1.0, -2.0), (len(x), 1))))  # fmt: skip
    return closed(scene, 7.8)


def under_a_lid():
    """A plate that moves and touches most of a layer."""
    scene = new(2)
    x, rng = grid(10, 2, 0.97, 6)
    x = x[x[:, 1] < 4]
    scene.add(cn.disks(x, rng.uniform(0.44, 0.48, len(x)), ROCK))
    scene.add(cn.polygons(np.array([(-5.0, -0.3), (5.0, -0.3), (5.0, 0.3), (-5.0, 0.3)]) + (5.3, 4.5), ROCK))
    return closed(scene, 10.6)


def rolling():
    scene = new(2, cn.Rolling(mu=0.5, rolling=0.05))
    x, rng = grid(8, 2, 0.97, 7)
    scene.add(cn.disks(x, rng.uniform(0.42, 0.48, len(x)), ROCK))
    return closed(scene, 8.8)


def impacts():
    scene = new(3, cn.Restitution(mu=0.3, normal=0.6))
    x, rng = grid(4, 3, 1.05, 8)
    scene.add(cn.spheres(x, rng.uniform(0.4, 0.5, len(x)), ROCK, velocity=rng.normal(0, 3, (len(x), 3))))
    return closed(scene, 5.0)


def periodic():
    scene = new(2, periodic=cn.Periodic((7.9, 0.0)))
    x, rng = grid(8, 2, 0.98, 9)
    scene.add(cn.disks(x, rng.uniform(0.44, 0.49, len(x)), ROCK, velocity=np.tile((4.0, 0.0), (len(x), 1))))
    scene.add(cn.wall((0, 0), (0, 1), ROCK))
    return scene


def pushed():
    """A wall that is driven, and one that a force pushes."""
    scene = new(2)
    x, rng = grid(7, 2, 0.97, 10)
    scene.add(cn.disks(x, rng.uniform(0.42, 0.48, len(x)), ROCK))
    scene.add(cn.wall((0, 0), (0, 1), ROCK), cn.wall((0.1, 0), (1, 0), ROCK, velocity=lambda t: (0.5 * math.cos(9 * t), 0.0)))
    scene.add(cn.wall((7.4, 0), (-1, 0), ROCK, mass=4e4, free="vx", force=(-2e5, 0.0)))
    return scene


SCENES = [disks, spheres, polygons, polyhedra, clumps, under_a_lid, rolling, impacts, periodic, pushed]


def digest(sim):
    state = [sim.bodies.position, sim.bodies.velocity, sim.contacts.key, sim.contacts.impulse, sim.contacts.status]
    state += [np.array(list(sim.energy.values()))]
    return digest_of(state)


def run(scene, ranks, steps, strategy=NLGS, dt=4e-3):
    sim = cn.Simulation(scene(), dt=dt, strategy=strategy, overlap="ignore", ranks=ranks)
    for _ in range(steps):
        sim.step()
    return sim


@pytest.mark.parametrize("scene", SCENES)
def test_the_same_bits_for_every_number_of_ranks(scene):
    on_faces = scene in (polygons, polyhedra)  # sweeps alone take long there
    strategy = cn.NSCD(solver=cn.NLGS(tol=1e-3, max_iter=60)) if on_faces else NLGS
    sims = [run(scene, ranks, 50 if on_faces else 90, strategy) for ranks in (1, 2, 3, 4, 7)]
    assert len(sims[0].contacts) > 20
    assert len({digest(sim) for sim in sims}) == 1
    assert sims[-1].ranks.figures()["partitions"] > 1 and sims[-1].ranks.figures()["messages"] > 0
    assert set(sims[-1].ranks.owner) == set(range(7))


@pytest.mark.parametrize("scene", [disks, spheres])
def test_threads_change_no_bit(scene):
    strategies = [cn.NSCD(solver=cn.NLGS(tol=1e-6), threads=n) for n in (1, 2)]
    assert len({digest(run(scene, ranks, 30, s)) for ranks in (1, 3) for s in strategies}) == 1


def test_a_run_over_ranks_is_that_without():
    alone, over = run(disks, None, 40), run(disks, 3, 40)
    scale = np.abs(alone.bodies.velocity).max()
    assert np.abs(alone.bodies.velocity - over.bodies.velocity).max() < 1e-2 * scale
    assert over.energy["kinetic"] == pytest.approx(alone.energy["kinetic"], rel=1e-3)
    assert abs(over.energy["closure"]) < 1e-9 * over.energy["in_play"]


def test_scaling_by_powers_of_two_changes_no_digit():
    def scaled(length):
        scene = cn.Scene(dim=2, gravity=(0.0, -8.0))
        scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.4))
        x, rng = grid(7, 2, 0.93, 1)
        scene.add(cn.disks(x * length, rng.uniform(0.42, 0.48, len(x)) * length, ROCK), cn.wall((0, 0), (0, 1), ROCK))
        return scene

    small, large = run(lambda: scaled(1.0), 3, 40, dt=2.0**-9), run(lambda: scaled(4.0), 3, 40, dt=2.0**-8)
    assert len(small.contacts) > 20
    assert np.array_equal(4 * small.bodies.position, large.bodies.position)
    assert np.array_equal(2 * small.bodies.velocity[:, :2], large.bodies.velocity[:, :2])
    assert large.energy["kinetic"] == 64 * small.energy["kinetic"]


def test_a_column_of_balls_stands_through_all_ranks():
    n, radius, dt = 28, 0.5, 1e-3
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.4))
    scene.add(cn.disks(np.stack([np.zeros(n), radius * (1 + 2 * np.arange(n))], 1), radius, ROCK))
    scene.add(cn.wall((0, 0), (0, 1), ROCK))
    sim = cn.Simulation(scene, dt=dt, strategy=cn.NSCD(solver=cn.NLGS(tol=1e-12, max_iter=20000)), ranks=7)
    sim.step()
    assert sim.info["status"] == "converged" and set(sim.ranks.owner[:n]) == set(range(7))
    weight = sim.bodies.mass[0] * 9.81 * dt
    borne = np.sort(np.linalg.norm(sim.contacts.impulse, axis=1))
    assert borne == pytest.approx(weight * np.arange(1, n + 1), rel=1e-9)
    assert sim.bodies.reaction[n, 1] == pytest.approx(n * weight, rel=1e-9)


@pytest.mark.parametrize("dim", [2, 3])
def test_momentum_passes_cuts(dim):
    """Without loads, of bodies that collide in space: momentum and angular momentum stay."""
    x, rng = grid(6 if dim == 2 else 4, dim, 1.0, 11)
    v = -2 * (x - x.mean(0)) + rng.normal(0, 1, x.shape)
    scene = cn.Scene(dim=dim)
    scene.interact(ROCK, ROCK, cn.Restitution(mu=0.5, normal=0.3))
    scene.add((cn.disks if dim == 2 else cn.spheres)(x, rng.uniform(0.4, 0.5, len(x)), ROCK, velocity=v))
    sim = cn.Simulation(scene, dt=1e-3, strategy=NLGS, overlap="ignore", ranks=5)
    mass, before = sim.bodies.mass[:, None], sim.bodies.velocity[:, :dim]
    for _ in range(60):
        sim.step()
    after = sim.bodies.velocity[:, :dim]
    assert np.abs(mass * (after - before)).sum() > 0.1 * np.abs(mass * before).sum()
    assert np.abs((mass * (after - before)).sum(0)).max() < 1e-12 * np.abs(mass * before).sum()


def test_restart_on_other_numbers_of_ranks(tmp_path):
    whole = run(disks, 2, 60)
    path = tmp_path / "pile.checkpoint.h5"
    sim = run(disks, 3, 20)
    for ranks in (5, 1, 4):
        sim.checkpoint(path)
        sim = cn.Simulation(disks(), dt=4e-3, strategy=NLGS, overlap="ignore", ranks=ranks)
        sim.restore(path)
        for _ in range({5: 20, 1: 10, 4: 10}[ranks]):
            sim.step()
    assert sim.steps == whole.steps and digest(sim) == digest(whole)


def test_files_do_not_know_the_number_of_ranks(tmp_path):
    for ranks in (1, 4):
        sim = cn.Simulation(disks(), dt=2e-3, strategy=NLGS, overlap="ignore", ranks=ranks)
        sim.run(20, output=tmp_path / f"{ranks}.vtkhdf", every=5, progress=False)
    one, four = (cn.load(tmp_path / f"{ranks}.vtkhdf") for ranks in (1, 4))
    assert len(one) == len(four) == 5
    for a, b in zip(one, four, strict=True):
        assert np.array_equal(a.bodies.position, b.bodies.position)
        assert np.array_equal(a.contacts.impulse, b.contacts.impulse)


def test_bodies_come_and_go():
    found = []
    for ranks in (1, 4):
        sim = run(disks, ranks, 20)
        sim.remove(sim.bodies.id[[3, 40, 41]])
        assert len(sim.contacts) == 0  # as without ranks
        sim.add(cn.disks([(2.0, 10.0), (5.0, 10.5)], 0.45, ROCK, velocity=[(0, -3), (0, -5)]))
        for _ in range(40):
            sim.step()
        sim.bodies.set(velocity=0.5 * sim.bodies.velocity)
        for _ in range(10):
            sim.step()
        found.append(digest(sim))
    assert found[0] == found[1]


def test_costs_are_shared_anew():
    """A pile whose contacts are all on one side is cut by them."""
    scene = new(2)
    x, _ = grid(10, 2, 0.9, 12, 0.0)
    scene.add(cn.disks(x, 0.45, ROCK), cn.disks([(30.0 + 2 * k, 5.0) for k in range(60)], 0.45, ROCK))
    scene.add(cn.wall((0, 0), (0, 1), ROCK))
    sim = cn.Simulation(scene, dt=1e-3, strategy=NLGS, overlap="ignore", ranks=4)
    sim.step()
    first = sim.ranks.figures()["imbalance"]
    for _ in range(55):
        sim.step()
    assert first > 1.2 > sim.ranks.figures()["imbalance"]


def test_an_error_of_a_rank_ends_the_step_and_names_it():
    sim = run(disks, 4, 5)
    before = digest(sim)
    owner, force = sim.ranks.owner[60], np.zeros((len(sim.bodies), 3))
    force[60, 0] = 1e308
    sim._core.assign_body("force", force)
    with pytest.raises(cn.Error, match=rf"rank {owner} of 4: velocity.*body {sim.bodies.id[60]} "):
        sim.step()
    sim._core.assign_body("force", 0 * force)
    assert np.isfinite(sim.bodies.position).all() and sim.steps == 5
    sim.step()
    assert sim.info["status"] == "converged" and before != digest(sim)


def test_memory_of_a_rank_is_that_of_its_share():
    scene = new(3)
    x, rng = grid(16, 3, 0.98, 13)
    scene.add(cn.spheres(x, rng.uniform(0.46, 0.49, len(x)), ROCK))
    sims = [cn.Simulation(scene, dt=1e-3, strategy=NLGS, overlap="ignore", ranks=ranks) for ranks in (1, 8)]
    for sim in sims:
        sim.step()
    assert sims[1].ranks.held_bytes.max() < 0.4 * sims[0].ranks.held_bytes[0]  # a third of a cube of 8 is its faces


def refused():
    scene = new(2)
    scene.add(cn.disks([(0.0, 0.5), (0.0, 1.5)], 0.5, ROCK), cn.wall((0, 0), (0, 1), ROCK))
    return scene


@pytest.mark.parametrize(
    ("strategy", "told"),
    [
        (cn.NSCD(project_positions=True), "project_positions"),
        (cn.Carpenter(), "over ranks"),
        (cn.EventDriven(), "event_driven"),
    ],
)
def test_strategies_that_do_not_run_over_ranks_say_so(strategy, told):
    with pytest.raises(ValueError, match=told) as refusal:
        cn.Simulation(refused(), dt=1e-3, strategy=strategy, ranks=2)
    assert "which does not run over ranks: leave that out, or leave out ranks" in str(refusal.value)


def test_the_integrator_that_runs_over_ranks_is_named():
    told = r"integrator is velocity_verlet, .* give integrator=cn.Theta\(.*, or leave out ranks$"
    with pytest.raises(ValueError, match=told):
        cn.Simulation(refused(), dt=1e-3, strategy=cn.NSCD(integrator=cn.VelocityVerlet()), ranks=2)


def test_the_contact_problem_of_a_step_over_ranks_is_refused():
    with pytest.raises(ValueError, match="needs the stages of NSCD, and the strategy is nscd over ranks: give the scene"):
        run(disks, 2, 1).problem()


def test_smooth_contacts_have_no_sweeps():
    with pytest.raises(ValueError, match="exchange is 'sweep', and the strategy is smooth_dem"):
        smooth = cn.Scene(dim=2)
        smooth.interact(ROCK, ROCK, cn.LinearSpring(stiffness=1e6))
        smooth.add(cn.disks([(0.0, 0.0)], 0.5, ROCK))
        cn.Simulation(smooth, dt=1e-4, strategy=cn.SmoothDEM(energy=False), ranks=2, exchange="sweep")


@pytest.mark.parametrize("ranks", ["many", 0, -1, 1.5, True])
def test_a_wrong_number_of_ranks_is_refused(ranks):
    with pytest.raises(ValueError, match="ranks"):
        cn.Simulation(refused(), dt=1e-3, ranks=ranks)


def test_explain_tells_of_ranks():
    text = run(disks, 3, 2).explain()
    assert "Ranks: 3, in turns in this process" in text and "Solver NLGS" in text


def test_exact_sums_know_no_order():
    rng = np.random.default_rng(0)
    x = rng.normal(0, 1, 2000) * 10.0 ** rng.uniform(-40, 40, 2000)
    x = np.concatenate([x, -x[:1900], [5e-324, 1e308, -1e308, 0.0, -0.0]])
    wanted = math.fsum(x)
    for _ in range(5):
        assert _core.exact_sum(rng.permutation(x)) == wanted
    assert _core.exact_sum(x[:2000] * 2.0**40) == 2.0**40 * math.fsum(x[:2000])
    for ties in ([1.0, 2.0**-53], [1.0, 2.0**-53, 2.0**-200], [1.0 + 2.0**-52, 2.0**-53], [-1.0, -(2.0**-53), -(2.0**-200)]):
        assert _core.exact_sum(np.array(ties)) == math.fsum(ties)
    assert math.isnan(_core.exact_sum(np.array([1.0, math.inf])))
