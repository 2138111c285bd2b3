"""Smooth DEM over ranks in one process: the same bits for every number of them, and the motion without."""


import cairn as cn
import numpy as np
import pytest
from cairn.run.views import core_of
from over_mpi import digest_of

ROCK = cn.Material("rock", density=2600.0)
SPRING = cn.LinearSpring(stiffness=1e7, restitution=0.5, mu=0.4)


def scene(dim, law=SPRING, n=None):
    n = n or {2: 7, 3: 5}[dim]
    rng = np.random.default_rng(dim)
    places = np.stack(np.meshgrid(*[np.arange(n)] * dim, indexing="ij"), -1).reshape(-1, dim)
    x = (places + 0.6) * 0.93 + rng.uniform(-0.02, 0.02, places.shape)
    made = cn.Scene(dim=dim, gravity=(-6.0,) + (0.0,) * (dim - 2) + (-9.81,))
    made.interact(ROCK, ROCK, law)
    made.add((cn.disks if dim == 2 else cn.spheres)(x, rng.uniform(0.42, 0.48, len(x)), ROCK,
             velocity=np.tile((-2.0,) + (0.0,) * (dim - 2) + (-3.0,), (len(x), 1))))  # fmt: skip
    for axis in range(dim):
        made.add(cn.wall(np.zeros(dim), np.eye(dim)[axis], ROCK))
    return made


def run(made, ranks, steps, energy=False):
    sim = cn.Simulation(made, dt=4e-4, strategy=cn.SmoothDEM(energy=energy), overlap="ignore", ranks=ranks)
    for _ in range(steps):
        sim.step()
    return sim


def digest(sim):
    state = [sim.bodies.position, sim.bodies.velocity, sim.contacts.key, sim.contacts.impulse, sim.bodies.contact_force]
    return digest_of(state)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("law", [SPRING, cn.HertzMindlin(young=1e7, restitution=0.6, mu=0.3)], ids=lambda law: law.name)
def test_the_same_bits_for_every_number_of_ranks(dim, law):
    sims = [run(scene(dim, law), ranks, 250) for ranks in (1, 2, 3, 7)]
    assert len(sims[0].contacts) > 20 and sims[-1].ranks.figures()["partitions"] > 2
    assert len({digest(sim) for sim in sims}) == 1
    assert {sim.info["contacts"] for sim in sims} == {len(sims[0].contacts)}


TURNING = {"roll": 2, "rolling": 0.1, "rolling_ratio": 0.5, "twist": 2, "twisting": 0.1}
ROLLING = cn.GranularContact(model=1, young=1e7, mu=0.4, damping=0.3, **TURNING)
BONDS = cn.SmoothBond(normal_stiffness=2e7, tangential_stiffness=1e7, tension=3e5, shear=3e5, mu=0.4, damping=0.1, within=0.1)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("law", [ROLLING, BONDS], ids=lambda law: law.name)
def test_laws_with_moments(dim, law, tmp_path):
    """Moments of rolling and of bonds that break: bits for every number of ranks, and through files to other numbers."""
    whole = run(scene(dim, law), 2, 150)
    assert np.abs(whole.contacts.moment).max() > 0
    sims = [run(scene(dim, law), ranks, 150) for ranks in (1, 3, 7)]
    assert len({digest(sim) for sim in [whole, *sims]}) == 1
    alone = run(scene(dim, law), None, 60)
    over, path = run(scene(dim, law), 3, 60), tmp_path / "smooth.checkpoint.h5"
    assert np.abs(alone.bodies.velocity - over.bodies.velocity).max() < 1e-8 * np.abs(alone.bodies.velocity).max()
    over.checkpoint(path)
    other = run(scene(dim, law), 5, 0)
    other.restore(path)
    for _ in range(90):
        other.step()
    assert digest(other) == digest(whole)


def in_a_cell(shear_rate=0.0):
    made = cn.Scene(dim=2, periodic=cn.Periodic((6.6, 6.6), shear_rate=shear_rate))
    made.interact(ROCK, ROCK, SPRING)
    rng = np.random.default_rng(2)
    x = np.stack(np.meshgrid(np.arange(7), np.arange(7)), -1).reshape(-1, 2) * 6.6 / 7 + 0.1
    made.add(cn.disks(x, rng.uniform(0.44, 0.49, len(x)), ROCK, velocity=rng.normal(0, 1, x.shape) + (4.0, 0.0)))
    return made


@pytest.mark.parametrize("rate", [0.0, 2.0])
def test_periodic_cells_that_stand_or_shear(rate):
    sims = [run(in_a_cell(rate), ranks, 300) for ranks in (1, 2, 4, 7)]
    assert len(sims[0].contacts) > 20 and len({digest(sim) for sim in sims}) == 1
    alone, over = run(in_a_cell(rate), None, 100), run(in_a_cell(rate), 3, 100)
    assert np.abs(alone.bodies.velocity - over.bodies.velocity).max() < 1e-8 * np.abs(alone.bodies.velocity).max()


@pytest.mark.parametrize("dim", [2, 3])
def test_motion_is_that_without_ranks(dim):
    alone, over = run(scene(dim), None, 150), run(scene(dim), 3, 150)
    assert np.abs(alone.bodies.velocity - over.bodies.velocity).max() < 1e-9 * np.abs(alone.bodies.velocity).max()
    assert over.info["stable_step"] == pytest.approx(alone.info["stable_step"], rel=0.3)  # of other instants
    walls = np.isinf(alone.bodies.mass)
    assert over.bodies.contact_force[walls] == pytest.approx(alone.bodies.contact_force[walls], rel=1e-6, abs=1e-3)


def test_local_damping_acts_over_ranks():
    def damped(ranks, share):
        strategy = cn.SmoothDEM(energy=False, local_damping=share)
        sim = cn.Simulation(scene(2), dt=4e-4, strategy=strategy, overlap="ignore", ranks=ranks)
        for _ in range(100):
            sim.step()
        return sim

    alone, free = damped(None, 0.5), damped(None, 0.0)
    sims = [damped(ranks, 0.5) for ranks in (1, 3)]
    assert digest(sims[0]) == digest(sims[1])
    size = np.abs(alone.bodies.velocity).max()
    assert np.abs(alone.bodies.velocity - free.bodies.velocity).max() > 0.01 * size
    assert np.abs(alone.bodies.velocity - sims[0].bodies.velocity).max() < 1e-9 * size


@pytest.mark.parametrize("dim", [2, 3])
def test_the_state_is_left_with_the_ranks_while_bodies_are_cut_anew(dim):
    """Nobody reads for hundreds of steps, in which bodies go from rank to rank; forces on walls are there for who reads then."""

    def left(ranks):
        sim = run(scene(dim), ranks, 0)
        with sim.ranks.leaving_state():
            for _ in range(250):
                core_of(sim).step(sim.ready())
        return sim

    one, *others = (left(ranks) for ranks in (1, 3, 7))
    assert others[-1].ranks.figures()["partitions"] > 2
    read = run(scene(dim), 3, 250)
    assert len({digest(sim) for sim in (one, read, *others)}) == 1
    walls = np.isinf(one.bodies.mass)
    assert np.abs(one.bodies.contact_force[walls]).max() > 0


def test_forces_on_walls_outlast_a_change_of_laws():
    """Lists are given up with the laws of a scene, and forces on fixed bodies of the last step can be read all the same."""
    sims = [run(scene(2), ranks, 200) for ranks in (1, 3)]
    forces = [sim.bodies.contact_force.copy() for sim in sims]
    for sim in sims:
        with sim.ranks.leaving_state():
            for _ in range(3):
                core_of(sim).step(sim.ready())
            sim.interact(ROCK, ROCK, cn.LinearSpring(stiffness=2e7, restitution=0.5, mu=0.4))
            assert len(sim.contacts) > 5
    walls = np.isinf(sims[0].bodies.mass)
    first, second = (sim.bodies.contact_force for sim in sims)
    assert np.array_equal(first, second) and not np.array_equal(first[walls], forces[0][walls])
    assert np.abs(first[walls]).max() > 0


def test_clumps():
    """Balls beside the centres of bodies of unequal moments of inertia."""

    def pile():
        places = np.stack(np.meshgrid(*[np.arange(4)] * 3, indexing="ij"), -1).reshape(-1, 3)
        made = cn.Scene(dim=3, gravity=(-3.0, 0.0, -9.81))
        made.interact(ROCK, ROCK, SPRING)
        x = (places + 0.6) * (1.05, 0.7, 0.7) + np.random.default_rng(3).uniform(-0.02, 0.02, places.shape)
        two = [[-0.2, 0, 0], [0.2, 0, 0]], [0.3, 0.3], 600.0, (20.0, 40.0, 45.0)
        made.add(cn.clumps(x, *two, ROCK, velocity=np.tile((-2.0, 0.0, -6.0), (len(x), 1))))
        made.add(cn.wall((0, 0, 0), (0, 0, 1), ROCK))
        return made

    sims = [run(pile(), ranks, 200) for ranks in (1, 2, 5)]
    assert len(sims[0].contacts) > 60 and sims[-1].ranks.figures()["partitions"] > 2
    assert len({digest(sim) for sim in sims}) == 1


def test_restart_on_other_numbers_of_ranks(tmp_path):
    whole, path = run(scene(2), 2, 300), tmp_path / "smooth.checkpoint.h5"
    sim = run(scene(2), 3, 100)
    for ranks in (5, 1):
        sim.checkpoint(path)
        sim = cn.Simulation(scene(2), dt=4e-4, strategy=cn.SmoothDEM(energy=False), overlap="ignore", ranks=ranks)
        sim.restore(path)
        for _ in range(100):
            sim.step()
    assert digest(sim) == digest(whole)


def test_momentum_passes_cuts():
    made = cn.Scene(dim=2)
    made.interact(ROCK, ROCK, SPRING)
    rng = np.random.default_rng(5)
    x = np.stack(np.meshgrid(np.arange(6), np.arange(6)), -1).reshape(-1, 2) * 1.0
    v = -2 * (x - x.mean(0)) + rng.normal(0, 1, x.shape)
    made.add(cn.disks(x, rng.uniform(0.4, 0.5, len(x)), ROCK, velocity=v))
    sim = cn.Simulation(made, dt=2e-4, strategy=cn.SmoothDEM(energy=False), ranks=5)
    mass = sim.bodies.mass[:, None]
    for _ in range(400):
        sim.step()
    change = mass * (sim.bodies.velocity[:, :2] - v)
    assert np.abs(change).sum() > 0.1 * np.abs(mass * v).sum()
    assert np.abs(change.sum(0)).max() < 1e-12 * np.abs(mass * v).sum()


def test_what_does_not_run_over_ranks_says_so():
    with pytest.raises(ValueError, match="energy=False.*does not run over ranks"):
        run(scene(2), 2, 1, energy=True)
    with pytest.raises(ValueError, match="gear, which does not run over ranks"):
        cn.Simulation(scene(2), dt=1e-4, strategy=cn.SmoothDEM(energy=False, integrator=cn.Gear()), ranks=2, overlap="ignore")
