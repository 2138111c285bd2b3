"""Periodic cells whose shape is driven, over ranks: the same bits for every number of them, and the stress without."""


import cairn as cn
import numpy as np
import pytest
from over_mpi import digest_of

ROCK = cn.Material("rock", density=2600.0)
SWEEPS = cn.NSCD(solver=cn.NLGS(tol=1e-6, max_iter=400))


def scene(dim, law=None, **driven):
    n = {2: 7, 3: 4}[dim]
    rng = np.random.default_rng(dim)
    places = np.stack(np.meshgrid(*[np.arange(n)] * dim, indexing="ij"), -1).reshape(-1, dim)
    x = (places + 0.5) * 0.95 + rng.uniform(-0.02, 0.02, places.shape)
    made = cn.Scene(dim=dim, periodic=cn.Periodic((0.95 * n,) * dim, **driven))
    made.interact(ROCK, ROCK, law or cn.Coulomb(mu=0.3))
    made.add((cn.disks if dim == 2 else cn.spheres)(x, rng.uniform(0.44, 0.48, len(x)), ROCK))
    return made


def run(made, ranks, steps, strategy=SWEEPS, dt=2e-3, **options):
    sim = cn.Simulation(made, dt=dt, strategy=strategy, overlap="ignore", ranks=ranks, **options)
    for _ in range(steps):
        sim.step()
    return sim


def digest(sim):
    state = [sim.bodies.position, sim.bodies.velocity, sim.contacts.key, sim.contacts.impulse]
    state += [sim.cell["vectors"], sim.cell["rate"], sim.cell["stress"], np.array(list(sim.energy.values()))]
    return digest_of(state)


DRIVEN = [
    (2, {"rate": {"xx": -0.3, "yy": -0.2}}),
    (2, {"rate": {"yy": -0.5}, "constant_volume": True}),
    (2, {"stress": 2e4}),
    (2, {"rate": {"xy": 0.5}, "stress": {"yy": 2e4}}),
    (3, {"rate": {"zz": -0.3}, "stress": {"xx": 3e4, "yy": 2e4}}),
]


@pytest.mark.parametrize(("dim", "driven"), DRIVEN)
def test_the_same_bits_for_every_number_of_ranks(dim, driven):
    sims = [run(scene(dim, **driven), ranks, 60) for ranks in (1, 2, 4, 7)]
    assert len({digest(sim) for sim in sims}) == 1
    assert len(sims[0].contacts) > 20


@pytest.mark.parametrize(("dim", "driven"), DRIVEN)
def test_the_stress_is_that_without_ranks(dim, driven):
    """Over few steps: grains that collide amplify what solvers leave."""
    exact = cn.NSCD(solver=cn.NLGS(tol=1e-9, max_iter=4000))
    alone, over = [run(scene(dim, **driven), ranks, 0, exact) for ranks in (None, 3)]
    size = 0.0
    for _ in range(12):
        alone.step()
        over.step()
        size = max(size, np.abs(alone.cell["stress"]).max())
        assert np.abs(alone.cell["stress"] - over.cell["stress"]).max() <= 1e-6 * size
    assert size > 0 and alone.cell["lengths"] == pytest.approx(over.cell["lengths"], rel=1e-9)


def test_rates_that_are_given_later_and_one_exchange_a_sweep():
    whole = run(scene(2, rate={"xx": -0.3}), 3, 30)
    later = run(scene(2), 3, 0)
    later.drive_cell(rate={"xx": -0.3})
    for _ in range(30):
        later.step()
    assert digest(later) == digest(whole)
    once = run(scene(2, stress=2e4), 3, 60, exchange="sweep")
    alone = run(scene(2, stress=2e4), None, 60)
    assert once.cell["lengths"] == pytest.approx(alone.cell["lengths"], rel=1e-3)


SPRING = cn.LinearSpring(stiffness=1e7, restitution=0.5, mu=0.4)
SMOOTH = [{"rate": {"xx": -0.5}}, {"stress": 2e5}, {"rate": {"xy": 0.5}, "stress": {"xx": 2e5, "yy": 2e5}}]


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("driven", SMOOTH, ids=str)
def test_smooth_contacts(dim, driven):
    strategy = cn.SmoothDEM(energy=False)
    over = [run(scene(dim, SPRING, **driven), ranks, 300, strategy, 4e-4) for ranks in (1, 2, 5)]
    state = {b"".join(sim.cell[name].tobytes() for name in ("stress", "rate", "vectors")) for sim in over}
    assert len(state) == 1 and len({sim.bodies.velocity.tobytes() for sim in over}) == 1
    alone = run(scene(dim, SPRING, **driven), None, 300, strategy, 4e-4)
    size = np.abs(alone.cell["stress"]).max()
    assert size > 0 and len(alone.contacts) > 10
    assert over[1].cell["stress"] == pytest.approx(alone.cell["stress"], rel=1e-6, abs=1e-7 * size)
    assert over[1].cell["vectors"] == pytest.approx(alone.cell["vectors"], rel=1e-9, abs=1e-9)
    assert over[1].bodies.position == pytest.approx(alone.bodies.position, rel=1e-8)
