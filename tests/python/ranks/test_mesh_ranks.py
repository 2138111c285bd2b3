"""Deformable bodies over ranks: the same bits for every number of ranks, the motion of a run without."""


import cairn as cn
import numpy as np
import pytest
from over_mpi import digest_of
from second_order import box

N = cn.networks
ROCK = cn.Material("rock", density=2600.0, conductivity=2000.0, capacity=10.0)
SKIN = cn.Material("skin", density=1200.0, conductivity=2000.0, capacity=50.0, expansion=1e-3)
NLGS = cn.NSCD(solver=cn.NLGS(tol=1e-5, max_iter=300))
RUBBER = cn.NeoHookean(young=3e6, poisson=0.3)


def new(dim, law=None, **options):
    scene = cn.Scene(dim=dim, gravity=(-3.0,) + (0.0,) * (dim - 2) + (-9.81,), **options)
    scene.interact("*", "*", law or cn.Coulomb(mu=0.4))
    return scene


def grains(scene, counts, low, radius=0.48, seed=1, **more):
    rng = np.random.default_rng(seed)
    x = np.stack(np.meshgrid(*[np.arange(k) for k in counts], indexing="ij"), -1).reshape(-1, scene.dim)
    x = (x * 2.04 + rng.uniform(-0.04, 0.04, x.shape)) * radius + low
    return scene.add((cn.disks if scene.dim == 2 else cn.spheres)(x, rng.uniform(0.9, 1.0, len(x)) * radius, ROCK, **more))


def block(counts, low, size, material=None, kind=None, nodes=True, **more):
    """A body of cells that touches with all nodes and sides, or sides alone; "base" is its lowest nodes."""
    dim = len(counts)
    points, cells = box(kind or ("quad" if dim == 2 else "hexahedron"), counts, size)
    groups = {"base": np.flatnonzero(np.isclose(points[:, -1], 0.0))}
    points = points + np.asarray(low, float)
    if material is None:
        body = cn.ElasticBody(points, cells, young=3e6, poisson=0.3, density=1200.0, groups=groups)
    else:
        body = cn.SolidBody(points, cells, material, density=1200.0, groups=groups)
    all_nodes = np.arange(len(points))
    sides = {"edges" if dim == 2 else "faces": all_nodes}
    return cn.deformable(body, SKIN, contact=all_nodes if nodes else (), **sides, **more)


def walled(scene, *axes):
    for axis in axes:
        scene.add(cn.wall(np.zeros(scene.dim), np.eye(scene.dim)[axis], ROCK))
    return scene


def on_a_plate(dim, material=None, kind=None, law=None, **more):
    """Grains that slide on a body whose base is held."""
    scene = new(dim, law)
    counts, size = ((8, 2), (8.0, 1.0)) if dim == 2 else ((3, 3, 1), (4.0, 4.0, 0.7))
    scene.add(block(counts, (0.0,) * dim, size, material, kind, fixed={"base": "xyz"[:dim]}, name="plate", **more))
    grains(scene, (8, 3) if dim == 2 else (4, 4, 2), (0.6,) * (dim - 1) + (size[-1] + 0.5,))
    return walled(scene, *range(dim - 1))


def falling_blocks():
    """A linear body and one of rubber fall on grains, and on each other."""
    scene = new(2)
    grains(scene, (7, 2), (0.6, 0.5))
    scene.add(block((4, 2), (1.0, 2.0), (2.0, 0.9), name="lower", velocity=(0.0, -3.0)))
    scene.add(block((3, 2), (1.4, 2.95), (2.0, 0.9), RUBBER, name="upper", velocity=(0.0, -4.0)))
    return walled(scene, 0, 1)


def many_nodes():
    """A slab whose contact nodes are so many that its compliance is taken by rows of reaches or whole."""
    scene = new(3)
    scene.add(block((8, 8, 2), (0.0, 0.0, 0.0), (4.0, 4.0, 0.7), name="slab"))
    grains(scene, (8, 8, 1), (0.25, 0.25, 0.95), radius=0.24)
    return walled(scene, 2)


def stones():
    """Faces of blocks on a body that lies on a wall."""
    scene = new(2)
    scene.add(block((8, 2), (0.0, 0.0), (8.0, 1.0), name="beam"))
    stone = np.array([(0, 0), (0.95, 0), (0.95, 0.75), (0, 0.75)])
    for k in range(12):
        scene.add(cn.polygons(stone + (0.5 + k % 6 + 0.1 * (k // 6), 1.02 + 0.78 * (k // 6)), ROCK))
    return walled(scene, 1)


def across_a_cell(**driven):
    scene = new(2, periodic=cn.Periodic((7.9, 0.0), **driven))
    scene.add(block((3, 2), (6.5, 2.1), (2.0, 1.0), velocity=(4.0, -2.0)))
    grains(scene, (8, 2), (0.4, 0.6), velocity=np.tile((4.0, 0.0), (16, 1)))
    return walled(scene, 1)


def in_a_cell(**driven):
    """A body among grains in a cell that is periodic along both axes."""
    scene = cn.Scene(dim=2, periodic=cn.Periodic((8.2, 8.2), **driven))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    scene.add(block((3, 3), (6.9, 3.0), (2.2, 2.0)))
    rng = np.random.default_rng(1)
    x = np.stack(np.meshgrid(np.arange(8), np.arange(8), indexing="ij"), -1).reshape(-1, 2) * 8.2 / 8
    apart = (np.abs((x[:, 0] - 8.0 + 4.1) % 8.2 - 4.1) > 1.6) | (np.abs(x[:, 1] - 4.0) > 1.5)
    x = x[apart]
    scene.add(cn.disks(x, rng.uniform(0.47, 0.5, len(x)), ROCK, velocity=rng.normal(0, 1, x.shape)))
    return scene


def joined():
    """Bodies that a joint holds, one of them at a node."""
    scene = falling_blocks()
    ids = scene.add(block((2, 2), (4.0, 2.4), (1.0, 1.0), name="hung"))
    arm = scene.add(cn.polygons(np.array([(5.2, 2.9), (6.2, 2.9), (6.2, 3.7), (5.2, 3.7)]), ROCK))[0]
    scene.join(ids[8], arm, cn.Pivot(point=(5.0, 3.4)))
    return scene


def warm():
    scene = on_a_plate(2)
    scene.thermal(conductance=N.Constant(conductance=1e4), friction="halves", initial=300.0, temperature={"plate.base": 350.0})
    return scene


def pressed():
    scene = on_a_plate(2, cn.NeoHookean(young=1e6, poisson=0.3))
    scene.add(cn.wall((0, 4.6), (0, -1), ROCK, mass=4e3, free="vy", force=(0.0, -3e4)))
    return scene


SCENES = {
    "plane": lambda: on_a_plate(2),
    "space": lambda: on_a_plate(3),
    "second order": lambda: on_a_plate(2, kind="quad8"),
    "rubber": lambda: on_a_plate(3, RUBBER),
    "bonded": lambda: on_a_plate(2, law=cn.Bonded(mu=0.3)),
    "rolling": lambda: on_a_plate(2, law=cn.Rolling(mu=0.5, rolling=0.05), nodes=False),
    "falling": falling_blocks,
    "many nodes": many_nodes,
    "stones": stones,
    "periodic": across_a_cell,
    "sheared": lambda: in_a_cell(shear_rate=1.0),
    "squeezed": lambda: in_a_cell(stress=3e5),
    "joined": joined,
    "warm": warm,
    "pressed": pressed,
}


def start(scene, ranks, strategy=NLGS, **more):
    return cn.Simulation(scene(), dt=3e-3, strategy=strategy, overlap="ignore", ranks=ranks, **more)


def run(scene, ranks, steps, **more):
    sim = start(scene, ranks, **more)
    for _ in range(steps):
        sim.step()
    return sim


def digest(sim):
    state = [sim.bodies.position, sim.bodies.velocity, sim.contacts.key, sim.contacts.impulse, sim.contacts.status]
    state += [sim.nodes.position, sim.nodes.velocity, np.array(list(sim.energy.values()))]
    state += [part for mesh in sim.meshes for part in (*mesh.stress.values(), mesh.reaction())]
    return digest_of(state)


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_the_same_bits_for_every_number_of_ranks(scene, tmp_path):
    sims = [run(scene, ranks, 45) for ranks in (1, 2, 3, 7)]
    assert len({digest(sim) for sim in sims}) == 1
    assert sims[3].ranks.figures()["messages"] > 0 and len(set(sims[3].ranks.owner)) > 2
    sim, path = run(scene, 3, 15), tmp_path / "meshes.checkpoint.h5"
    for ranks in (5, 1):
        sim.checkpoint(path)
        sim = start(scene, ranks)
        sim.restore(path)
        for _ in range(15):
            sim.step()
    assert digest(sim) == digest(sims[0])


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_the_motion_is_that_without_ranks(scene):
    alone, over = run(scene, None, 45), run(scene, 3, 45)
    assert over.info["status"] == "converged" and len(over.contacts) > 10
    scale = np.abs(alone.bodies.velocity).max()
    assert np.abs(alone.bodies.velocity - over.bodies.velocity).max() < 1e-2 * scale
    assert np.abs(alone.nodes.position - over.nodes.position).max() < 1e-3 * 3e-3 * 45 * scale
    assert abs(over.energy["closure"]) < 1e-9 * over.energy["in_play"]
    for name in ("kinetic", "stored"):
        assert over.energy[name] == pytest.approx(alone.energy[name], rel=1e-2, abs=1e-4 * alone.energy["in_play"])


def test_meshes_come_and_go():
    found = []
    for ranks in (1, 4):
        sim = run(lambda: on_a_plate(2), ranks, 10)
        sim.add(block((3, 2), (2.0, 5.0), (2.0, 0.8), name="late", velocity=(0.0, -3.0)))
        for _ in range(20):
            sim.step()
        found.append(digest(sim))
        sim.remove(sim.meshes[0].all_ids)
        assert len(sim.contacts) == 0
        for _ in range(10):
            sim.step()
        found.append(digest(sim))
    assert found[:2] == found[2:] and len(sim.meshes) == 1


def test_a_step_that_fails_leaves_meshes_as_they_were():
    sim = run(lambda: on_a_plate(2, RUBBER), 3, 10)
    other = run(lambda: on_a_plate(2, RUBBER), 3, 10)
    force = np.zeros((len(sim.bodies), 3))
    force[20, 0] = 1e308
    sim._core.assign_body("force", force)
    with pytest.raises(cn.Error, match="rank . of 3: velocity"):
        sim.step()
    sim._core.assign_body("force", 0 * force)
    other._core.assign_body("force", 0 * force)
    for of in (sim, other):
        assert np.isfinite(of.nodes.position).all() and of.steps == 10
        for _ in range(10):
            of.step()
    assert digest(sim) == digest(other)


def test_one_exchange_a_sweep():
    once, whole = (run(lambda: on_a_plate(2), 3, 45, exchange=exchange) for exchange in ("sweep", "colour"))
    assert once.info["status"] == "converged"
    assert np.abs(once.nodes.position - whole.nodes.position).max() < 1e-5


def test_threads_change_no_bit():
    strategies = [cn.NSCD(solver=cn.NLGS(tol=1e-5), threads=n) for n in (1, 2)]
    scene = SCENES["falling"]
    assert len({digest(run(scene, ranks, 20, strategy=of)) for ranks in (1, 3) for of in strategies}) == 1


def test_scaling_by_powers_of_two_changes_no_digit():
    def scaled(length, dt):
        points, cells = box("quad", (8, 2), (8.0, 1.0))
        body = cn.ElasticBody(length * points, cells, young=2e6 * length, poisson=0.3, density=1024.0)
        scene = cn.Scene(dim=2, gravity=(0.0, -8.0))
        scene.interact("*", "*", cn.Coulomb(mu=0.4))
        scene.add(cn.deformable(body, ROCK, contact=np.arange(len(points)), edges=np.arange(len(points))))
        x = np.stack(np.meshgrid(np.arange(8), np.arange(2), indexing="ij"), -1).reshape(-1, 2) * 0.98 + (0.6, 1.5)
        scene.add(cn.disks(x * length, 0.48 * length, ROCK), cn.wall((0, 0), (0, 1), ROCK))
        sim = cn.Simulation(scene, dt=dt, strategy=NLGS, overlap="ignore", ranks=3)
        for _ in range(30):
            sim.step()
        return sim

    small, large = scaled(1.0, 2.0**-8), scaled(4.0, 2.0**-7)
    assert len(small.contacts) > 15
    assert np.array_equal(4 * small.nodes.position, large.nodes.position)
    assert np.array_equal(4 * small.bodies.position, large.bodies.position)
