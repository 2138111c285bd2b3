"""Bodies that grow over ranks: the same bits for every number of them, and the sizes, masses and works of a run without."""


import cairn as cn
import numpy as np
import pytest
from over_mpi import digest_of

ROCK = cn.Material("rock", density=2600.0)
SWEEPS = cn.NSCD(solver=cn.NLGS(tol=1e-6, max_iter=300))
RANKS = (1, 2, 3, 4, 7)


def places(dim, n, pitch, seed=3, shift=0.02):
    rng = np.random.default_rng(seed)
    x = np.stack(np.meshgrid(*[np.arange(n)] * dim, indexing="ij"), -1).reshape(-1, dim) + 0.5
    return x * pitch + rng.uniform(-shift, shift, x.shape) * pitch, rng


def balls(dim, law=None, periodic=True):
    n = 7 if dim == 2 else 4
    x, rng = places(dim, n, 1.0)
    scene = cn.Scene(dim, periodic=cn.Periodic((float(n),) * dim) if periodic else None)
    velocity = np.zeros((len(x), 3 * dim - 3))
    velocity[:, :dim] = rng.normal(0, 0.3, x.shape)
    ids = scene.add((cn.disks if dim == 2 else cn.spheres)(x, rng.uniform(0.36, 0.4, len(x)), ROCK, velocity=velocity))
    scene.interact("*", "*", law or cn.Coulomb(mu=0.3))
    return scene, ids


def disks():
    return balls(2)


def spheres():
    return balls(3)


def shapes(dim):
    """Clumps, capsules, and bodies of one hull, in a corner: every third body keeps its size."""
    x, rng = places(dim, 5 if dim == 2 else 3, 1.0, shift=0.03)
    scene = cn.Scene(dim, gravity=(-2.0,) + (0.0,) * (dim - 2) + (-5.0,))
    kind = np.arange(len(x)) % 2
    if dim == 2:
        square = np.array([(-0.4, -0.4), (0.4, -0.4), (0.4, 0.4), (-0.4, 0.4)])
        ids = [*scene.add(cn.polygons(square + x[kind == 0][:, None], ROCK))]
        rows = [[-0.2, 0.0], [0.2, 0.0]]
        ids += [*scene.add(cn.clumps(x[kind == 1], rows, [0.25, 0.22], 900.0, 60.0, ROCK))]
    else:
        ids = [*scene.add(cn.boxes(x[kind == 0], [0.8, 0.7, 0.75], ROCK))]
        rows = [[-0.2, 0.0, 0.0], [0.2, 0.0, 0.0]]
        ids += [*scene.add(cn.clumps(x[kind == 1], rows, [0.25, 0.22], 500.0, [20.0, 30.0, 31.0], ROCK))]
    for axis in range(dim):
        scene.add(cn.wall(np.zeros(dim), np.eye(dim)[axis], ROCK))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    return scene, [i for k, i in enumerate(ids) if k % 3]


def polygons():
    return shapes(2)


def boxes():
    return shapes(3)


def sticky():
    return balls(2, cn.Wet(force=2e3, reach=0.02, mu=0.3))


def springs():
    return balls(3, cn.LinearSpring(stiffness=1e5, restitution=0.3, mu=0.2))


def springs_in_plane():
    return balls(2, cn.LinearSpring(stiffness=1e6, restitution=0.3, mu=0.2), periodic=False)


def smooth(scene):
    return scene in (springs, springs_in_plane)


def start(scene, ranks):
    made, ids = scene()
    strategy = cn.SmoothDEM(energy=False) if smooth(scene) else SWEEPS
    return cn.Simulation(made, 2e-4 if smooth(scene) else 4e-3, strategy, overlap="ignore", ranks=ranks), ids


def grown(sim, ids, rate="4 + 10*t"):
    """Steps before growth, with it, at another rate, shrinking, and after."""
    quick = 30 if sim.dt < 1e-3 else 1
    sim.run(3, progress=False)
    sim.grow(ids, cn.Expression(f"{quick}*({rate})"))
    sim.run(12, progress=False)
    sim.grow(ids[: len(ids) // 2], -2.0 * quick)
    for _ in range(6):
        sim.step()
    sim.grow(ids, None)
    sim.run(4, progress=False)
    return sim


def digest(sim):
    fields = [getattr(sim.bodies, name) for name in ("position", "velocity", "mass", "inertia")]
    fields += [sim.contactors.radius, sim.contacts.key, sim.contacts.impulse]
    energy = np.array(list(sim.energy.values()))
    return digest_of([*fields, energy])


@pytest.mark.parametrize("scene", [disks, spheres, polygons, boxes, sticky, springs, springs_in_plane])
def test_the_same_bits_for_every_number_of_ranks(scene):
    sims = [grown(*start(scene, ranks)) for ranks in RANKS]
    assert len({digest(sim) for sim in sims}) == 1
    assert len(sims[0].contacts) > 3 and sims[-1].ranks.figures()["ghosts"] > 0


@pytest.mark.parametrize("scene", [polygons, boxes, springs])
def test_sizes_and_works_are_those_of_a_run_without_ranks(scene):
    alone, three = (grown(*start(scene, ranks)) for ranks in (None, 3))
    for name in ("mass", "inertia"):
        assert np.array_equal(getattr(alone.bodies, name), getattr(three.bodies, name))
    assert np.array_equal(alone.contactors.radius, three.contactors.radius)
    assert np.array_equal(alone.contactors.offset, three.contactors.offset)
    if smooth(scene):
        assert np.allclose(alone.bodies.position, three.bodies.position, rtol=0, atol=1e-9)
        return
    one, other = alone.energy, three.energy
    scale = abs(one["work_growth"])
    assert scale > 0 and other["work_growth"] == pytest.approx(one["work_growth"], rel=2e-2)
    assert abs(other["closure"]) < 1e-12 * other["in_play"]


@pytest.mark.parametrize("dim", [2, 3])
def test_a_row_of_balls_expands_as_without_ranks(dim):
    sims = []
    for ranks in (None, 1, 3):
        x = np.zeros((8, dim))
        x[:, 0] = np.arange(8) * 1.0
        scene = cn.Scene(dim)
        ids = scene.add((cn.disks if dim == 2 else cn.spheres)(x, 0.5, ROCK))
        scene.interact("*", "*", cn.Coulomb(mu=0.0))
        sim = cn.Simulation(scene, 1e-3, cn.NSCD(solver=cn.NLGS(tol=1e-11, max_iter=5000)), overlap="ignore", ranks=ranks)
        sim.step()
        sim.grow(ids, 2.0)
        sim.run(6, progress=False)
        sim.grow(ids, None)
        sim.run(2, progress=False)
        sims.append(sim)
    alone, one, three = sims
    assert digest(one) == digest(three) and len(alone.contacts) == 7
    scale = np.abs(alone.bodies.velocity).max()
    assert scale > 1.0 and np.allclose(alone.bodies.velocity, three.bodies.velocity, rtol=0, atol=1e-6 * scale)
    for term in ("work_growth", "kinetic", "dissipated_normal"):
        assert three.energy[term] == pytest.approx(alone.energy[term], rel=1e-5, abs=1e-6 * alone.energy["in_play"]), term
    assert alone.energy["work_growth"] > 0 and abs(three.energy["closure"]) < 1e-12 * three.energy["in_play"]


def test_grains_that_grow_to_many_times_their_size_find_each_other():
    """Ghosts were sought for the sizes at the last cut."""
    def far():
        x, _ = places(2, 6, 1.0, shift=0.01)
        scene = cn.Scene(2, periodic=cn.Periodic((6.0, 6.0)))
        ids = scene.add(cn.disks(x, 0.05, ROCK))
        scene.interact("*", "*", cn.Coulomb(mu=0.0))
        return scene, ids

    sims = []
    for ranks in (1, 2, 4, 7):
        sim, ids = start(far, ranks)
        sim.grow(ids, 100.0)
        sim.run(6, progress=False)
        sim.grow(ids, 20.0)
        sim.run(4, progress=False)
        sims.append(sim)
    assert sims[0].radii().max() > 0.45
    assert len({digest(sim) for sim in sims}) == 1 and np.linalg.norm(sims[0].contacts.impulse, axis=1).max() > 0


@pytest.mark.parametrize("scene", [disks, boxes, springs])
def test_a_restart_goes_on_growing_on_any_number_of_ranks(scene, tmp_path):
    whole, ids = start(scene, 3)
    rate = 40.0 if smooth(scene) else 6.0
    whole.grow(ids, rate)
    whole.run(6, progress=False)
    whole.checkpoint(tmp_path / "grown.checkpoint.h5")
    whole.run(6, progress=False)
    for ranks in (1, 5):
        again, _ = start(scene, ranks)
        again.restore(tmp_path / "grown.checkpoint.h5")
        again.grow(ids, rate)
        again.run(6, progress=False)
        assert digest(again) == digest(whole)


def test_bodies_that_come_go_or_are_set_while_others_grow():
    sims = []
    for ranks in (1, 4):
        sim, ids = start(disks, ranks)
        sim.grow(ids, 5.0)
        sim.run(4, progress=False)
        sim.remove(ids[[3, 11]])
        new = sim.add(cn.disks([(0.02, 0.03)], 0.1, ROCK))
        sim.run(4, progress=False)
        sim.grow(new, 9.0)
        sim.bodies.set(velocity=0.5 * sim.bodies.velocity)
        sim.run(4, progress=False)
        sims.append(sim)
    assert digest(sims[0]) == digest(sims[1])


def test_a_step_that_fails_while_bodies_grow_leaves_their_sizes():
    sim, ids = start(disks, 3)
    sim.grow(ids, 5.0)
    sim.run(3, progress=False)
    mass, before = sim.bodies.mass.copy(), digest(sim)
    force = np.zeros((len(mass), 3))
    force[5] = 1e308
    sim._core.assign_body("force", force)
    with pytest.raises(cn.Error, match="rank "):
        sim.step()
    assert np.array_equal(mass, sim.bodies.mass)
    sim._core.assign_body("force", np.zeros_like(force))
    sim.run(2, progress=False)
    other, _ = start(disks, 2)
    other.grow(ids, 5.0)
    other.run(5, progress=False)
    assert before != digest(other) and np.array_equal(sim.bodies.mass, other.bodies.mass)


@pytest.mark.parametrize("ranks", [1, 3])
def test_a_checkpoint_keeps_what_was_set_or_grew_after_the_step(ranks, tmp_path):
    """Workspace of the step is gathered with it."""
    sim, ids = start(boxes, ranks)
    sim.grow(ids, 6.0)
    sim.run(3, progress=False)
    momentum = sim.bodies.angular_momentum.copy()
    velocity = 0.5 * sim.bodies.velocity
    sim.bodies.set(velocity=velocity)
    sim.checkpoint(tmp_path / "set.checkpoint.h5")
    assert np.array_equal(sim.bodies.velocity, velocity)
    if ranks == 1:
        alone, _ = start(boxes, None)
        alone.grow(ids, 6.0)
        alone.run(3, progress=False)
        assert np.allclose(alone.bodies.angular_momentum, momentum, rtol=1e-4, atol=1e-4 * np.abs(momentum).max())
    again, _ = start(boxes, 2)
    again.restore(tmp_path / "set.checkpoint.h5")
    assert np.array_equal(again.bodies.velocity, velocity)
    assert np.array_equal(again.bodies.angular_momentum, sim.bodies.angular_momentum)


def test_reports_and_sizes_of_smooth_grains_that_grow_are_the_same_for_every_number_of_ranks():
    """Each rank makes its lists at times of its own; what contacts have of the sizes of bodies does not depend on them."""
    told, states = [], []
    for ranks in (None, 1, 2, 3, 7):
        made, ids = balls(3, cn.HertzMindlin(young=1e6, restitution=0.5, mu=0.3))
        sim = cn.Simulation(made, 2e-4, cn.SmoothDEM(energy=False, skin=0.01), overlap="ignore", ranks=ranks)
        sim.grow(ids, cn.Expression("3 + 10*t"))
        rows = []
        for _ in range(400):
            sim.step()
            rows.append([sim.info["way"], sim.info["penetration"]])
        told.append(np.array(rows))
        states.append(digest(sim))
    assert told[0][:, 1].max() > 0
    assert all(np.array_equal(rows, told[1]) for rows in told[2:])
    assert len(set(states[1:])) == 1
    np.testing.assert_allclose(told[0], told[1], rtol=1e-9)
