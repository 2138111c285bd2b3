"""Grains that become one body in a run."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=1000.0)
SHARP = cn.NLGS(tol=1e-12, max_iter=20000)


def cloud(dim, n=5, seed=3):
    """Grains that fly and spin, some of them clumps."""
    rng = np.random.default_rng(seed)
    x = np.column_stack([0.11 * np.arange(n), *(0.02 * rng.standard_normal((dim - 1, n)))])
    v = rng.standard_normal((n, 3 * dim - 3))
    scene = cn.Scene(dim, gravity=(0.0,) * (dim - 1) + (-9.81,))
    scene.add((cn.disks if dim == 2 else cn.spheres)(x, 0.05, ROCK, velocity=v, group="grains"))
    parts = np.zeros((2, dim))
    parts[:, 0] = -0.02, 0.03
    inertia = 2e-3 if dim == 2 else (1e-3, 2e-3, 2.5e-3)
    turned = {"rotation": [0.4] if dim == 2 else [[0.9, 0.1, -0.3, 0.2]]}
    place = [[0.3] + [0.4] * (dim - 1)]
    scene.add(cn.clumps(place, parts, 0.05, 3.0, inertia, ROCK, velocity=v[:1] + 0.5, group="grains", **turned))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, 1e-4, cn.NSCD(solver=SHARP), overlap="ignore")


def matrix(q):
    w, x, y, z = q / np.linalg.norm(q)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])  # fmt: skip


def totals(sim):
    """Mass, its middle, momentum, angular momentum about the origin, kinetic energy."""
    b, dim = sim.bodies, sim.scene.dim
    m, x, v = np.ravel(b.mass), b.position, b.velocity
    spin, energy = np.zeros((len(m), 2 * dim - 3)), 0.5 * m @ (v[:, :dim] ** 2).sum(axis=1)
    for k in range(len(m)):
        axes = np.eye(1) if dim == 2 else matrix(b.rotation[k])
        tensor = axes @ np.diag(np.ravel(b.inertia[k])) @ axes.T
        spin[k] = tensor @ v[k, dim:]
        energy += 0.5 * v[k, dim:] @ spin[k]
    p = m[:, None] * v[:, :dim]
    crossed = np.cross(x, p) if dim == 3 else (x[:, 0] * p[:, 1] - x[:, 1] * p[:, 0])[:, None]
    about = crossed.sum(axis=0) + spin.sum(axis=0)
    return m.sum(), m @ x / m.sum(), m @ v[:, :dim], about, energy


def grains(sim):
    """Where they are, sorted."""
    at = np.searchsorted(sim.bodies.id, sim.contactors.body)
    out = []
    for k, own in zip(at, sim.contactors.offset):
        r = sim.bodies.rotation[k]
        c, s = np.cos(np.ravel(r)[0]), np.sin(np.ravel(r)[0])
        turn = matrix(r) if sim.scene.dim == 3 else np.array([[c, -s], [s, c]])
        out.append(sim.bodies.position[k] + turn @ own)
    out = np.array(out)
    return out[np.argsort(np.round(out[:, 0], 9) + 10 * np.round(out[:, 1], 9))]


@pytest.mark.parametrize("dim", [2, 3])
def test_mass_momenta_and_places_pass_over(dim):
    sim = cloud(dim)
    for _ in range(3):
        sim.step()
    before, parts = totals(sim), grains(sim)
    assert sim.merge([5, 1, 2]) == 1
    after = totals(sim)
    for one, other in zip(before[:4], after[:4]):
        assert np.abs(one - other).max() <= 1e-12 * max(1.0, np.abs(one).max())
    assert np.abs(grains(sim) - parts).max() < 1e-12 * np.abs(parts).max()
    assert sim.bodies.id.tolist() == [0, 1, 3, 4]
    lost = sim.info["energy"]["dissipated_reshaping"]
    assert lost > 0 and lost == pytest.approx(before[4] - after[4], rel=1e-12)
    for _ in range(20):
        assert sim.step()["status"] == "converged"
    e = sim.info["energy"]
    assert abs(e["closure"]) <= 1e-12 * e["in_play"]
    later = totals(sim)
    assert np.abs(later[2][: dim - 1] - after[2][: dim - 1]).max() < 1e-12 * np.abs(after[2]).max()


@pytest.mark.parametrize("dim", [2, 3])
def test_contacts_and_impulses_pass_over(dim):
    """A pile at rest goes on at rest when two of its grains are one: the next step begins from the impulses that there were."""
    scene = cn.Scene(dim, gravity=(0.0,) * (dim - 1) + (-9.81,))
    x = np.zeros((4, dim))
    x[:, -1] = 0.05 + 0.1 * np.arange(4)
    scene.add((cn.disks if dim == 2 else cn.spheres)(x, 0.05, ROCK))
    scene.add(cn.wall(np.zeros(dim), np.eye(dim)[-1], cn.Material("floor")))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(solver=SHARP))
    for _ in range(5):
        sim.step()
    before = np.sort(np.abs(sim.contacts.impulse[:, -1]))
    assert sim.merge([1, 2]) == 1
    report = sim.step()
    after = np.sort(np.abs(sim.contacts.impulse[:, -1]))
    assert report["status"] == "converged" and report["iterations"] <= 2
    assert len(before) == 4 and np.abs(np.delete(before, 1) - after).max() < 1e-10 * before.max()
    assert np.abs(sim.bodies.velocity).max() < 1e-9 * 9.81 * sim.dt  # of what a step of free fall gives


def test_a_checkpoint_after_a_merge_goes_on_to_the_same_bits(tmp_path):
    once = cloud(3)
    once.step()
    once.merge([0, 1])
    once.checkpoint(tmp_path / "merged.h5")
    for _ in range(5):
        once.step()
    again = cloud(3)
    again.restore(tmp_path / "merged.h5")
    for _ in range(5):
        again.step()
    assert np.array_equal(again.bodies.position, once.bodies.position)


def in_cell(x, v, cell, steps=0, strategy=None):
    scene = cn.Scene(2, periodic=cell)
    scene.add(cn.disks(x, 0.05, ROCK, velocity=v))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3) if strategy is None else cn.LinearSpring(stiffness=2e3, mu=0.4))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(solver=SHARP) if strategy is None else strategy, overlap="ignore")
    for _ in range(steps):
        sim.step()
    return sim


@pytest.mark.parametrize("steps", [0, 1])
def test_grains_on_both_sides_of_a_periodic_boundary_are_one_beside_each_other(steps):
    """A pair at 0.1 of each other, and a chain longer than half of the cell, of which no grain is taken to its other end."""
    sim = in_cell([[0.05, 0.0], [0.15, 0.0], [0.95, 0.0]], np.zeros((3, 3)), cn.Periodic((1.0, np.inf)), steps)
    mass = 1000 * np.pi * 0.05**2
    sim.merge([0, 2])
    assert sim.bodies.position[0, 0] % 1.0 in (pytest.approx(0.0, abs=1e-12), pytest.approx(1.0, abs=1e-12))
    assert np.ravel(sim.bodies.inertia)[0] == pytest.approx(mass * (0.05**2 + 2 * 0.05**2), rel=1e-12)
    places = [0.85, 0.55, 0.95, 0.05, 0.65, 0.75, 0.15]
    sim = in_cell([[x, 0.0] for x in places], np.zeros((7, 3)), cn.Periodic((1.0, np.inf)), steps)
    sim.merge(range(7))
    assert sim.bodies.position[0, 0] == pytest.approx(0.85, rel=1e-12)
    of_chain = 7 * mass * 0.05**2 / 2 + mass * 0.01 * 2 * (1 + 4 + 9)
    assert np.ravel(sim.bodies.inertia)[0] == pytest.approx(of_chain, rel=1e-12)


def test_an_image_in_a_cell_that_shears_has_the_velocity_of_the_image():
    """Grains that move with the cell, on both sides of the moving boundary: merged, they move with the mean flow between them,
    and rotate."""
    cell = cn.Periodic((1.0, 1.0), lean=0.3, shear_rate=2.0)
    sim = in_cell([[0.1, 0.06], [0.4, 0.96]], [[0.12, 0.0, 0.0], [1.92, 0.0, 0.0]], cell)
    sim.merge([0, 1])
    assert np.abs(sim.bodies.position[0] - [0.1, 0.01]).max() < 1e-12
    assert np.abs(sim.bodies.velocity[0] - [0.02, 0.0, -0.01 / (0.05**2 + 2 * 0.05**2)]).max() < 1e-12


@pytest.mark.parametrize("strategy", [None, cn.SmoothDEM(energy=False)])
def test_a_merge_before_the_balance_has_begun_is_no_part_of_it(strategy):
    """The kinetic energy was below zero; that of the first step is of the one body."""
    sim = in_cell([[0.0, 0.0], [0.1, 0.0]], [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]], None, 0 if strategy is None else 1, strategy)
    sim.merge([0, 1])
    assert not any(sim.info["energy"].values())
    sim.bodies.set(velocity=[[2.0, 0.0, 0.0]])
    sim.step()
    kinetic = 4 * 1000 * np.pi * 0.05**2 if strategy is None else 0.0
    assert sim.info["energy"]["kinetic"] == pytest.approx(kinetic) and sim.info["energy"]["dissipated_reshaping"] == 0


@pytest.mark.parametrize(
    ("ids", "told"),
    [([1], "give two bodies or more"), ([1, 99], "no rigid body 99"), ([0, 6], "is a polygon"), ([0, 7], "of groups"),
     ([0, 8], "held or driven"), ([0, 9], "a force, damping or surface velocity"), ([0, 10], "an end of a joint")],
)  # fmt: skip
def test_what_cannot_merge_is_told(ids, told):
    scene = cn.Scene(2)
    scene.add(cn.disks([[0.2 * k, 0.0] for k in range(6)], 0.05, ROCK))
    scene.add(cn.polygons([np.array([[0.0, 1.0], [0.1, 1.0], [0.0, 1.1]])], ROCK))
    scene.add(cn.disks([[0.0, 2.0]], 0.05, ROCK, group="others"), cn.disks([[1.0, 2.0]], 0.05, ROCK, driven=("vx",)))
    scene.add(cn.disks([[2.0, 2.0]], 0.05, ROCK, force=(1.0, 0.0, 0.0)), cn.disks([[3.0, 2.0]], 0.05, ROCK))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    scene.join(10, None, cn.Pivot(point=(3.0, 2.0)))
    sim = cn.Simulation(scene, 1e-3)
    with pytest.raises(ValueError, match=told):
        sim.merge(ids)


def test_grains_that_reach_round_the_cell_are_refused_and_stay():
    rock = cn.Material("rock", density=1000.0)
    scene = cn.Scene(2, periodic=cn.Periodic((1.0, np.inf)))
    scene.add(cn.disks([[0.1 + 0.15 * i, 0.01 * i * i] for i in range(9)], 0.08, rock))
    scene.interact(rock, rock, cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(), overlap="ignore")
    sim.step()
    with pytest.raises(ValueError, match="1.36 m wide along x and the periodic cell is 1 m.*give fewer grains"):
        sim.merge(range(9))
    assert sim.bodies.id.tolist() == list(range(9))
    assert sim.merge([0, 1, 2]) == 0 and sim.step()["status"] == "converged"
