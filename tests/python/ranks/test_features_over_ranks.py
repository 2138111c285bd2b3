"""Cohesion, bonds, networks and moving surfaces over ranks: the same bits for every number of them."""

import math

import cairn as cn
import numpy as np
import pytest
from over_mpi import digest_of

ROCK = cn.Material("rock", density=2600.0)
NLGS = cn.NSCD(solver=cn.NLGS(tol=1e-4, max_iter=60))
ZONE = {"normal_stiffness": 1e9, "tangential_stiffness": 1e9, "mu": 0.4}


def grid(n, dim, pitch, seed, shift=0.0):
    rng = np.random.default_rng(seed)
    places = np.stack(np.meshgrid(*[np.arange(n)] * dim, indexing="ij"), -1).reshape(-1, dim)
    return (places + 0.7) * pitch + rng.uniform(-shift, shift, places.shape), rng


def new(dim, law, **options):
    scene = cn.Scene(dim=dim, gravity=(-6.0,) + (0.0,) * (dim - 2) + (-9.81,), **options)
    scene.interact(ROCK, ROCK, law)
    return scene


def grains(dim, law, n=None, velocity=-3.0, radius=0.5, pitch=1.0, shift=0.0):
    """A block of balls that touch and fall into a corner."""
    scene = new(dim, law)
    x, rng = grid(n or {2: 7, 3: 4}[dim], dim, pitch, 1, shift)
    v = np.zeros_like(x)
    v[:, 0], v[:, -1] = velocity, velocity
    v += rng.normal(0, 0.3, x.shape)
    scene.add((cn.disks if dim == 2 else cn.spheres)(x, radius, ROCK, velocity=v))
    for axis in range(dim):
        scene.add(cn.wall(np.zeros(dim), np.eye(dim)[axis], ROCK))
    return scene


def bricks(law):
    """A wall of blocks, mortared, that a moving bar breaks."""
    scene = new(2, law)
    for row in range(5):
        for k in range(5):
            x, y = k + 0.5 * (row % 2), 0.5 * row
            scene.add(cn.polygons(np.array([(x, y), (x + 1, y), (x + 1, y + 0.5), (x, y + 0.5)]), ROCK))
    scene.add(cn.wall((0, 0), (0, 1), ROCK))
    scene.add(cn.disks([(-0.61, 1.7)], 0.6, ROCK, velocity=[(6.0, 0.0)]))
    return scene


def bonded():
    return grains(2, cn.Bonded(mu=0.3), n=6)


def zones():
    return grains(2, cn.MAC(work=2e2, **ZONE), velocity=-12.0)


def zones_in_space():
    law = cn.EXPO(normal_strength=2e5, tangential_strength=2e5, normal_work=1e2, tangential_work=1e2, **ZONE)
    return grains(3, law, velocity=-9.0)


def mortar():
    return bricks(cn.MohrCoulomb(tension=4e4, cohesion=5e4, friction=0.5, mu=0.4))


def mortar_zones():
    return bricks(cn.MAC(work=20.0, **ZONE))


def beams():
    law = cn.ParallelBond(normal_stiffness=1e9, tangential_stiffness=5e8, tension=2e6, shear=2e6, mu=0.4)
    return grains(2, law, velocity=-8.0)


def rods():
    """Bodies whose bonds span gaps that no ghost is sought across."""
    return grains(2, cn.Wire(stiffness=1e7, strength=4e4, mu=0.3, within=0.9), n=6, radius=0.2, pitch=0.9, velocity=-5.0)


def wet():
    return grains(2, cn.Wet(force=2e4, reach=0.05, mu=0.4), velocity=-1.0, shift=0.02, pitch=1.03)


def bridges():
    return grains(3, cn.Capillary(tension=500.0, volume=1e-4, angle=0.2, mu=0.3), pitch=1.02, velocity=-1.0)


def worn():
    return grains(2, cn.LimitedSlip(mu=0.3, limit=0.01), velocity=-2.0, pitch=0.98, shift=0.01)


def conveyed():
    scene = grains(2, cn.Coulomb(mu=0.5), n=6, velocity=0.0, pitch=0.98, shift=0.01)
    scene.add(cn.wall((0, 0), (0, 1), ROCK, surface_velocity=(2.0, 0.0)))
    return scene


def sheared():
    scene = cn.Scene(dim=2, periodic=cn.Periodic((6.9, 6.9), shear_rate=1.5))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.4))
    x, rng = grid(7, 2, 6.9 / 7, 3, 0.02)
    scene.add(cn.disks(x % 6.9, rng.uniform(0.47, 0.52, len(x)), ROCK, velocity=rng.normal(0, 1, x.shape)))
    return scene


BREAKING = [bonded, zones, zones_in_space, mortar]  # which bond goes first is up to the sweeps
SCENES = [bonded, zones, zones_in_space, mortar, mortar_zones, beams, rods, wet, bridges, worn, conveyed, sheared]


def digest(sim, *more):
    c = sim.contacts
    fields = [sim.bodies.position, sim.bodies.velocity, c.key, c.impulse, c.status, c.beta, c.stored]
    state = [*fields, np.array(list(sim.energy.values())), *more]
    return digest_of(state)


def start(scene, ranks, strategy=NLGS, dt=2e-3):
    return cn.Simulation(scene(), dt=dt, strategy=strategy, overlap="ignore", ranks=ranks)


def run(scene, ranks, steps, **options):
    sim = start(scene, ranks, **options)
    for _ in range(steps):
        sim.step()
    return sim


@pytest.mark.parametrize("scene", SCENES)
def test_the_same_bits_for_every_number_of_ranks(scene):
    sims = [run(scene, ranks, 40) for ranks in (1, 2, 3, 4, 7)]
    assert len(sims[0].contacts) > 20 and np.isfinite(sims[0].bodies.velocity).all()
    assert len({digest(sim) for sim in sims}) == 1
    assert set(sims[-1].ranks.owner) == set(range(7))


@pytest.mark.parametrize("scene", SCENES)
def test_the_balance_closes_as_without_ranks(scene):
    sharp = cn.NSCD(solver=cn.NLGS(tol=1e-8, max_iter=2000))
    alone, over = (run(scene, ranks, 5, strategy=sharp) for ranks in (None, 3))
    for sim in (alone, over):
        assert abs(sim.energy["closure"]) < 1e-9 * sim.energy["in_play"]
    if scene in BREAKING:
        return
    scale = np.abs(alone.bodies.velocity).max()
    assert np.abs(alone.bodies.velocity - over.bodies.velocity).max() < 2e-3 * scale
    for term in ("kinetic", "stored", "released", "work_driven", "dissipated_normal", "dissipated_friction"):
        assert over.energy[term] == pytest.approx(alone.energy[term], rel=1e-2, abs=1e-3 * alone.energy["in_play"])


@pytest.mark.parametrize("scene", [zones, mortar])
def test_damage_travels(scene, tmp_path):
    """Bonds that are damaged move with their bodies to other ranks, through files to other numbers of ranks, on two threads."""
    whole = run(scene, 2, 60, strategy=cn.NSCD(solver=cn.NLGS(tol=1e-4, max_iter=60), threads=2))
    beta = whole.contacts.beta
    assert (beta > 0).any() and (beta < 1).any()
    sim, path = run(scene, 3, 20), tmp_path / "bonds.checkpoint.h5"
    owner = sim.ranks.owner.copy()
    for ranks, steps in ((5, 20), (1, 20)):
        sim.checkpoint(path)
        sim = start(scene, ranks)
        sim.restore(path)
        for _ in range(steps):
            sim.step()
        assert ranks == 1 or (sim.ranks.owner != owner).any()
    assert digest(sim) == digest(whole)


def test_bodies_that_come_bond():
    found = []
    for ranks in (1, 4):
        sim = run(bonded, ranks, 10)
        sim.add(cn.disks([(20.0, 5.0), (21.0, 5.0), (22.0, 5.0)], 0.5, ROCK))
        for _ in range(30):
            sim.step()
        found.append(digest(sim))
        new_ones = np.abs(np.diff(sim.bodies.position[-3:], axis=0))
        assert np.linalg.norm(new_ones, axis=1) == pytest.approx(1.0, rel=1e-6)
    assert found[0] == found[1]


def warm(law, column=False, **thermal):
    own = {"young": 1e9, "poisson": 0.3, "conductivity": 30.0, "capacity": 1.0, "resistivity": 1e-6}
    metal = cn.Material("rock", density=2600.0, **own)
    scene = cn.Scene(dim=2, gravity=(-6.0, -9.81))
    scene.interact("*", "*", law)
    x, rng = grid(6, 2, 0.94, 4, 0.01)
    x -= 0.2
    if column:  # whose forces friction does not share
        scene.gravity = (0.0, -9.81)
        x = np.stack([np.full(12, 5.0), 0.45 + 0.94 * np.arange(12)], 1)
    scene.add(cn.disks(x, rng.uniform(0.46, 0.49, len(x)), metal, velocity=np.tile((-1.0, -2.0), (len(x), 1))))
    scene.add(cn.wall((0, 0), (0, 1), metal, group="floor"), cn.wall((0, 0), (1, 0), metal, group="side"))
    scene.thermal(initial=300.0, temperature={"floor": 400.0}, **thermal)
    scene.electrical(current=[([0], 5.0), ([11], -5.0)] if column else {"floor": 5.0, "side": -5.0})
    return scene


def flows(sim):
    of_contacts = [sim.contacts.thermal_conductance, sim.contacts.heat_flux, sim.contacts.current]
    return [sim.bodies.temperature, sim.bodies.potential, *of_contacts]


@pytest.mark.parametrize("law", [cn.Coulomb(mu=0.4), cn.MAC(work=2e2, **ZONE)], ids=lambda law: law.name)
def test_heat_and_current_flow_through_all_ranks(law):
    sims = [run(lambda: warm(law), ranks, 40) for ranks in (1, 2, 4, 7)]
    one, sharp = sims[0], cn.NSCD(solver=cn.NLGS(tol=1e-9, max_iter=5000))
    assert one.bodies.temperature.max() > 300.5 and np.abs(one.contacts.current).max() > 0
    assert len({digest(sim, *flows(sim)) for sim in sims}) == 1
    alone, over = (run(lambda: warm(law, column=True), ranks, 20, strategy=sharp) for ranks in (None, 3))
    assert over.bodies.temperature[0] > 300.01
    assert over.bodies.temperature == pytest.approx(alone.bodies.temperature, rel=1e-8)
    assert over.bodies.potential[:12] == pytest.approx(alone.bodies.potential[:12], rel=1e-5)
    balance = one.info["thermal"]["balance"]
    assert abs(balance["closure"]) < 1e-9 * balance["in_play"]


def test_heat_goes_on_from_files(tmp_path):
    def scene():
        return warm(cn.Coulomb(mu=0.4))

    whole, sim, path = run(scene, 2, 40), run(scene, 3, 20), tmp_path / "warm.checkpoint.h5"
    sim.checkpoint(path)
    sim = start(scene, 5)
    sim.restore(path)
    for _ in range(20):
        sim.step()
    assert digest(sim, sim.bodies.temperature) == digest(whole, whole.bodies.temperature)


def test_servo_walls_and_drives_by_formulas_act_over_ranks():
    def pressed():
        scene = grains(2, cn.Coulomb(mu=0.4), n=6, velocity=0.0, pitch=0.98, shift=0.01)
        scene.add(cn.wall((6.2, 0), (-1, 0), ROCK, mass=4e3, free="vx", force=cn.Servo(1e5, (-1, 0))))
        scene.add(cn.wall((0, -0.1), (0, 1), ROCK, velocity=lambda t: (0.0, 0.4 * math.cos(9 * t))))
        return scene

    sims = [run(pressed, ranks, 40) for ranks in (None, 1, 3)]
    assert digest(sims[1]) == digest(sims[2])
    assert np.abs(sims[1].bodies.velocity[-2, 0]) > 0
    assert sims[1].bodies.position[-2:] == pytest.approx(sims[0].bodies.position[-2:], rel=1e-3)


def test_probes_read_all_ranks(tmp_path):
    probes = {"push": cn.Probe("contact_force.y", take="max"), "kinetic": cn.Probe("energy.kinetic")}
    found = []
    for ranks in (1, 4):
        start(wet, ranks).run(10, output=tmp_path / f"{ranks}.vtkhdf", every=10, probes=probes, progress=False)
        history = cn.load(tmp_path / f"{ranks}.vtkhdf").history
        found.append(np.array([history["push"], history["kinetic"]]))
    assert np.array_equal(*found) and (found[0][0] > 0).all()


def test_scaling_by_powers_of_two_changes_no_digit():
    def scaled(length, time):
        rock = cn.Material("rock", density=2048.0)
        scene = cn.Scene(dim=2, gravity=(0.0, -8.0 * length / time**2))
        scene.interact(rock, rock, cn.Bonded(mu=0.5))
        x, _ = grid(5, 2, 1.0, 1)
        scene.add(cn.disks(x * length, 0.5 * length, rock), cn.wall((0, 0), (0, 1), rock))
        return scene

    small, large = run(lambda: scaled(1.0, 1.0), 3, 40, dt=2.0**-8), run(lambda: scaled(4.0, 2.0), 3, 40, dt=2.0**-7)
    assert np.array_equal(4 * small.bodies.position, large.bodies.position)
    assert np.array_equal(2 * small.bodies.velocity[:, :2], large.bodies.velocity[:, :2])


def test_one_exchange_a_sweep():
    """Fewer messages, and the answer to the solver's tolerance."""

    def pile():
        return grains(2, cn.Coulomb(mu=0.4), velocity=-2.0, pitch=0.97, shift=0.01)

    strategy = cn.NSCD(solver=cn.NLGS(tol=1e-7, max_iter=5000))
    colour = start(pile, 4, strategy=strategy)
    sweep = cn.Simulation(pile(), dt=2e-3, strategy=strategy, overlap="ignore", ranks=4, exchange="sweep")
    for sim in (colour, sweep):
        for _ in range(60):
            sim.step()
        assert sim.info["status"] == "converged"
    scale = np.abs(colour.bodies.velocity).max()
    assert colour.info["iterations"] > 20 and np.abs(colour.bodies.velocity - sweep.bodies.velocity).max() < 1e-2 * scale
    a_sweep = [sim.ranks.figures()["messages"] / sim.info["iterations"] for sim in (colour, sweep)]
    assert a_sweep[1] < 0.6 * a_sweep[0]
    assert "once a sweep" in sweep.explain() and "colour by colour" in colour.explain()
    with pytest.raises(ValueError, match="exchange"):
        cn.Simulation(pile(), dt=2e-3, ranks=2, exchange="often")


def held_beam(dim):
    """A beam of parallel bonds on driven supports, on which some contacts press beside bonds that are drawn."""
    scene = cn.Scene(dim=dim, gravity=(0.0,) * (dim - 1) + (-9.81,))
    at = [(0.1 * i, *(0.0,) * (dim - 2), 1 + 0.1 * j) for i in range(10) for j in range(3)]
    below = [(0.0, *(0.0,) * (dim - 2), 0.9), (0.9, *(0.0,) * (dim - 2), 0.9)]
    balls, driven = (cn.disks, ("vx", "vy", "w")) if dim == 2 else (cn.spheres, ("vx", "vy", "vz", "wx", "wy", "wz"))
    scene.add(balls(at, 0.05, ROCK), balls(below, 0.05, ROCK, driven=driven, group="supports"))
    scene.interact(ROCK, ROCK, cn.ParallelBond(normal_stiffness=1e10, tangential_stiffness=4e9, tension=2e6, shear=4e6, mu=0.5))
    scene.interact("supports", "*", cn.Coulomb(mu=0.3))
    return scene


@pytest.mark.parametrize("dim", [2, 3])
def test_parallel_bonds_beside_ones_that_press(dim):
    """The last digits of a bond do not depend on those in its strip of lanes, which other ranks have otherwise."""
    ends = []
    for ranks in (1, 2, 3, 5):
        sim = cn.Simulation(held_beam(dim), 1e-4, ranks=ranks)
        for _ in range(20):
            sim.step()
        ends.append(sim.bodies.velocity)
    assert all(np.array_equal(ends[0], end) for end in ends[1:])
