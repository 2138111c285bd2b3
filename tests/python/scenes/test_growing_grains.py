"""Bodies that grow at a rate: sizes and masses, the pressure of a packing without gravity, the balance of energy."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=2600.0)
R = 2.0**-7
SPRING = cn.LinearSpring(stiffness=1e5, restitution=0.3, mu=0.2)


def loose(dim, count, law, strategy=None, dt=1e-4, share=0.7, seed=2):
    """Balls in a periodic cell that they fill by a share of a half once they are of radius R."""
    rng = np.random.default_rng(seed)
    place = np.stack(np.meshgrid(*[np.arange(count)] * dim, indexing="ij"), -1).reshape(-1, dim)
    radii = share * R * rng.uniform(0.75, 1.0, len(place))
    length = count * 2.0 * R
    scene = cn.Scene(dim, periodic=cn.Periodic((length,) * dim))
    velocity = np.zeros((len(place), 3 * dim - 3))
    velocity[:, :dim] = 0.05 * rng.normal(size=(len(place), dim))
    ids = scene.add((cn.disks if dim == 2 else cn.spheres)((place + 0.5) * 2.0 * R, radii, ROCK, velocity=velocity))
    scene.interact("*", "*", law)
    return cn.Simulation(scene, dt, strategy, overlap="ignore"), ids


def filled(sim):
    dim, r = sim.scene.dim, sim.radii()
    return np.sum(np.pi * r**2 if dim == 2 else 4 / 3 * np.pi * r**3) / np.prod(sim.cell["lengths"])


@pytest.mark.parametrize("strategy", [cn.NSCD(), cn.SmoothDEM()])
@pytest.mark.parametrize("dim", [2, 3])
def test_sizes_masses_and_inertia_grow_alike(dim, strategy):
    scene = cn.Scene(dim)
    rows = [[0.0] * dim, [R] + [0.0] * (dim - 1)]
    one = (cn.disks if dim == 2 else cn.spheres)([[1.0] * dim], R, ROCK)
    two = cn.clumps([[3.0] * dim], rows, [R, R / 2], 2.0, 0.5 if dim == 2 else [0.4, 0.5, 0.5], ROCK)
    corners, places = [[[5, 5], [5.1, 5], [5, 5.2]]], [[5.0] * 3] * 2
    three = cn.polygons(corners, ROCK) if dim == 2 else cn.boxes(places, [[0.1, 0.2, 0.3]] * 2, ROCK)
    ids = [*scene.add(one), *scene.add(two), *scene.add(three)]
    scene.interact("*", "*", SPRING if isinstance(strategy, cn.SmoothDEM) else cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 1e-5, strategy, overlap="ignore")
    mass, inertia, offset = sim.bodies.mass, sim.bodies.inertia, sim.contactors.offset
    radius = sim.contactors.radius
    sim.grow(ids[:-1] if dim == 3 else ids, cn.Expression("1e3 + 0*t"))
    for _ in range(50):
        sim.step()
    grown = np.full(len(mass), np.exp(50 * 1e-5 * 1e3))
    if dim == 3:
        grown[-1] = 1  # of two boxes of one shape, one alone
    assert np.allclose(sim.bodies.mass, mass * grown**dim, rtol=1e-12)
    now, before = (np.reshape(values, (len(mass), -1)).T for values in (sim.bodies.inertia, inertia))
    assert np.allclose(now, before * grown ** (dim + 2), rtol=1e-12)
    assert np.allclose(sim.contactors.offset[1:3], offset[1:3] * grown[0], rtol=1e-12)
    assert np.allclose(sim.contactors.radius[:3], radius[:3] * grown[0], rtol=1e-12)
    sim.grow(ids, None)
    kept = sim.bodies.mass
    sim.step()
    assert np.array_equal(sim.bodies.mass, kept)


@pytest.mark.parametrize(("dim", "jammed"), [(2, (0.8, 0.87)), (3, (0.58, 0.67))])
def test_grains_jam_without_gravity(dim, jammed):
    """Frictionless grains jam near random close packing, by both strategies."""
    for smooth in (False, True):
        law = cn.LinearSpring(stiffness=1e7 if dim == 2 else 1e5, restitution=0.3) if smooth else cn.Coulomb(mu=0.0)
        sim, ids = loose(dim, 8 if dim == 2 else 4, law, cn.SmoothDEM() if smooth else None, share=0.9)
        if smooth:
            sim.dt = 0.2 * sim.stable_step
        rate = 5.0
        sim.grow(ids, rate)
        contacts = 0
        for _ in range(200):
            sim.run(steps=max(1, round(0.002 / rate / sim.dt)), progress=False)
            contacts = len(sim.contacts.gap) and np.sum(np.linalg.norm(sim.contacts.force, axis=1) > 0)
            if contacts > 0.8 * dim * len(ids):
                break
        assert jammed[0] < filled(sim) < jammed[1], (smooth, filled(sim))
        assert contacts > 0.6 * dim * len(ids)
        assert sim.info["penetration"] < (0.2 if smooth else 0.01)  # springs are soft
        assert abs(sim.energy["closure"]) < 1e-12 * sim.energy["in_play"]
        assert sim.energy["work_growth"] > 0


def test_growth_against_springs_is_their_energy():
    """A disk that grows by d between two walls stores k d^2, which is the work of its growth."""
    scene = cn.Scene(2)
    scene.add(cn.disks([(0, R)], R, ROCK))
    scene.add(cn.wall((0, 0), (0, 1), ROCK), cn.wall((0, 2 * R), (0, -1), ROCK))
    scene.interact("*", "*", cn.LinearSpring(stiffness=1e5))
    sim = cn.Simulation(scene, "stable", cn.SmoothDEM())
    sim.dt /= 10
    sim.grow([0], 0.02 / (4000 * sim.dt))
    for _ in range(4000):
        sim.step()
    sim.grow([0], None)
    sim.step()
    sim.step()
    d = sim.radii()[0] - R
    assert d / R == pytest.approx(np.exp(0.02) - 1, rel=1e-9)
    assert sim.energy["stored"] == pytest.approx(1e5 * d**2, rel=1e-6)
    assert sim.energy["work_growth"] == pytest.approx(sim.energy["stored"], rel=0.03)
    assert abs(sim.energy["closure"]) < 1e-12 * sim.energy["in_play"]


def test_bits_of_growth_do_not_depend_on_list_threads_or_a_restart(tmp_path):
    def made(**options):
        sim, ids = loose(3, 4, SPRING, cn.SmoothDEM(**options))
        sim.dt = 0.2 * sim.stable_step
        sim.grow(ids, 150.0)
        return sim, ids

    runs = [made(skin=2e-5)[0], made(skin=1e-3)[0], made(threads=3)[0]]
    for sim in runs:
        sim.run(steps=200, progress=False)
    assert runs[0].info["neighbour_lists"] > runs[1].info["neighbour_lists"]
    for sim in runs[1:]:
        assert np.array_equal(sim.bodies.position, runs[0].bodies.position)
    half, ids = made()
    half.run(steps=100, progress=False)
    half.checkpoint(tmp_path / "half.h5")
    again, ids = made()
    again.restore(tmp_path / "half.h5")
    again.grow(ids, 150.0)
    again.run(steps=100, progress=False)
    assert np.array_equal(again.bodies.position, runs[0].bodies.position) and len(again.contacts.gap) > 10
    assert np.array_equal(again.bodies.mass, runs[0].bodies.mass)


def test_what_cannot_grow_is_told():
    sim, ids = loose(2, 3, cn.Coulomb(mu=0.3))
    wall = sim.add(cn.segment((0, 0), (R, 0), ROCK))
    with pytest.raises(ValueError, match="no finite mass"):
        sim.grow(wall, 1.0)
    with pytest.raises(ValueError, match="rate of growth is"):
        sim.grow(ids, lambda t: t)
    with pytest.raises(ValueError, match="no body"):
        sim.grow([99], 1.0)
    sim.grow(ids, cn.Expression("1/t"))
    sim.strategy = cn.strategy("event_driven")
    with pytest.raises(ValueError, match="lets none do so"):
        sim.step()
    bonded, ids = loose(2, 3, cn.ParallelBond(normal_stiffness=1e9, tangential_stiffness=1e9))
    with pytest.raises(ValueError, match="ParallelBond holds bodies"):
        bonded.grow(ids, 1.0)
    sim, ids = loose(2, 3, cn.Coulomb(mu=0.3))
    sim.grow(ids, cn.Expression("1e9"))
    with pytest.raises(ValueError, match="no more than a share of a size"):
        sim.step()
