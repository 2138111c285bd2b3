"""Overlap does not add up: displacements take it back beyond a share of a body's size, and leave it alone within."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=2000.0)
LAWS = [cn.Coulomb(mu=0.5), cn.Frictionless(), cn.Restitution(mu=0.3), cn.Rolling(mu=0.5, rolling=0.1),
        cn.LimitedSlip(mu=0.5, limit=1.0), cn.Wet(force=1.0, reach=1e-3, mu=0.5)]  # fmt: skip


def pair(depth, law=LAWS[0], dim=3, make=None, strategy=None, unit=1.0, dt=2.0**-10):
    """A body of 1 m on a floor that it overlaps by `depth` of its radius, without gravity."""
    scene = cn.Scene(dim, gravity=(0,) * dim)
    center = [[0.0] * (dim - 1) + [unit * 0.5 * (1 - depth)]]
    make = make or (cn.disks if dim == 2 else cn.spheres)
    scene.add(make(np.array(center), 0.5 * unit, ROCK))
    scene.add(cn.wall((0,) * dim, (0,) * (dim - 1) + (1,), ROCK))
    scene.interact("*", "*", law)
    return cn.Simulation(scene, dt, strategy or cn.NSCD(overlap=0.005), overlap="ignore")


def column(dim, overlap, count=12):
    """Column of balls, solved from zero impulses in each step: residuals at an error of 0.01 have the same sign in all steps."""
    scene = cn.Scene(dim, gravity=(0,) * (dim - 1) + (-9.81,))
    centers = np.zeros((count, dim))
    centers[:, -1] = np.arange(count) + 0.5
    scene.add((cn.disks if dim == 2 else cn.spheres)(centers, 0.5, ROCK))
    scene.add(cn.wall((0,) * dim, (0,) * (dim - 1) + (1,), ROCK))
    scene.interact("*", "*", cn.Coulomb(mu=0.4))
    return cn.Simulation(scene, 5e-3, cn.NSCD(solver=cn.NLGS(tol=1e-2), warm_start=False, overlap=overlap))


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_what_came_in_deep_parts_slowly(law):
    """By the limit in a step, down to the limit: 0.03 of a radius in 5 steps. No velocity comes of it."""
    sim, steps = pair(0.03, law), 0
    while sim.step()["drift"] > 1e-12 and steps < 50:
        steps += 1
        assert not sim.bodies.velocity.any()
    assert steps == 5
    assert sim.bodies.position[0, 2] == pytest.approx(0.5 * (1 - 0.005), abs=1e-9)


@pytest.mark.parametrize("dim", [2, 3])
def test_centre_of_mass_stays(dim):
    """Two bodies in flight keep the bits of their velocities."""
    scene = cn.Scene(dim, gravity=(0,) * dim)
    centers, radii = np.zeros((2, dim)), np.array([0.5, 0.3])
    centers[1, :2] = 0.45, 0.6
    velocity = np.zeros((2, 3 if dim == 2 else 6))
    velocity[:, :2] = 0.7, -0.3
    scene.add((cn.disks if dim == 2 else cn.spheres)(centers, radii, ROCK, velocity=velocity))
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    sim = cn.Simulation(scene, 2.0**-10, cn.NSCD(overlap=0.005), overlap="ignore")
    mass, middle = radii**dim, lambda: mass @ sim.bodies.position / mass.sum()
    start, begin = middle(), sim.step()["drift"]
    for _ in range(40):
        end = sim.step()["drift"]
    way = 41 * sim.dt * velocity[0, :dim]
    assert begin > 0.1 and end < 1e-9
    assert np.abs(middle() - start - way).max() < 1e-14
    assert np.array_equal(sim.bodies.velocity, velocity)


@pytest.mark.parametrize("dim", [2, 3])
def test_pairs_part_in_the_metric_of_mass(dim):
    """Forty pairs of unlike balls far from each other: each ball goes along the line of centres by the mass of the other over
    both, and both by as much as a step may take back."""
    random = np.random.default_rng(5)
    count, limit = 40, 0.005
    radius = random.uniform(0.2, 1.0, (count, 2))
    depth = random.uniform(0.002, 0.03, count)
    normal = random.normal(size=(count, dim))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    smaller = radius.min(axis=1)
    first = np.zeros((count, dim))
    first[:, 0] = 10.0 * np.arange(count)
    second = first + (radius.sum(axis=1) - depth * smaller)[:, None] * normal
    scene = cn.Scene(dim, gravity=(0,) * dim)
    centers = np.stack([first, second], axis=1).reshape(-1, dim)
    scene.add((cn.disks if dim == 2 else cn.spheres)(centers, radius.ravel(), ROCK))
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    sim = cn.Simulation(scene, 2.0**-10, cn.NSCD(overlap=limit), overlap="ignore")
    sim.step()
    parts = np.clip(depth - limit, 0.0, limit) * smaller
    mass = radius**dim
    way = parts[:, None] * mass[:, ::-1] / mass.sum(axis=1, keepdims=True)
    expected = np.stack([first - way[:, :1] * normal, second + way[:, 1:] * normal], axis=1).reshape(-1, dim)
    assert np.abs(sim.bodies.position - expected).max() < 1e-12


def test_a_square_that_is_struck_aside_turns():
    """A disk in the side of a free square, off its centre: displacements are those of one impulse, rotation included."""
    radius, side, aside, depth, limit = 0.3, 1.0, 0.37, 0.02, 0.005
    scene = cn.Scene(2, gravity=(0, 0))
    corners = 0.5 * side * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    scene.add(cn.polygons([corners], ROCK), cn.disks([[aside, 0.5 * side + (1 - depth) * radius]], radius, ROCK))
    scene.interact("*", "*", cn.Frictionless())
    sim = cn.Simulation(scene, 2.0**-10, cn.NSCD(overlap=limit), overlap="ignore")
    start = sim.bodies.position.copy()
    sim.step()
    square, disk = side**2, np.pi * radius**2  # masses over the density
    turns = square * side**2 / 6
    asked = limit * radius
    impulse = asked / (1 / square + 1 / disk + aside**2 / turns)
    moved = sim.bodies.position - start
    assert moved[1] == pytest.approx([0, impulse / disk], abs=1e-12)
    assert moved[0] == pytest.approx([0, -impulse / square], abs=1e-12)
    assert sim.bodies.rotation[0] == pytest.approx(-impulse * aside / turns, rel=1e-9)


@pytest.mark.parametrize("dim", [2, 3])
def test_what_is_within_the_limit_stays_to_the_bit(dim):
    """An overlap of 0.004 of a radius, and none at all."""
    for depth in (0.004, 0.0):
        sim = pair(depth, dim=dim)
        start = sim.bodies.position.copy()
        for _ in range(20):
            assert sim.step()["drift"] == 0
        assert np.array_equal(sim.bodies.position, start)


def test_polygons_and_boxes_part_as_well():
    """Flat faces in the plane and in space, at the rate of round bodies."""
    square = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    shapes = [(2, lambda x, r, m: cn.polygons(x[0] + square, m)), (3, lambda x, r, m: cn.boxes(x, [1.0] * 3, m))]
    for dim, make in shapes:
        sim = pair(0.2, dim=dim, make=make)
        first = sim.step()["drift"]
        for _ in range(10):
            last = sim.step()["drift"]
        assert first > 0.1 and last == pytest.approx(first - 10 * 0.005, abs=1e-3)


def test_overlap_stays_without_a_limit():
    """And who asks for a limit has it."""
    named = [cn.NSCD(solver=cn.NLGS(tol=1e-4)), cn.NSCD(), cn.NSCD(overlap=np.inf)]
    for strategy, moves in [(each, False) for each in named] + [(cn.NSCD(solver=cn.NLGS(tol=1e-8), overlap=0.01), True)]:
        sim = pair(0.2, strategy=strategy)
        for _ in range(3):
            sim.step()
        assert (sim.bodies.position[0, 2] > 0.4) == moves


def test_units_leave_its_bits():
    """Lengths times 2^7."""
    one, other = pair(0.2), pair(0.2, unit=128.0)
    for _ in range(30):
        one.step(), other.step()
    assert np.array_equal(128 * one.bodies.position, other.bodies.position)


@pytest.mark.parametrize("dim", [2, 3])
def test_what_steps_leave_does_not_add_up(dim):
    """Without the limit balls sink into each other, with it they stay above it; the balance of energy closes."""
    deep = []
    for overlap in (np.inf, 1e-3):
        sim, worst = column(dim, overlap), 0.0
        for _ in range(1000):
            worst = max(worst, sim.step()["penetration"])
        deep.append(worst)
        assert abs(sim.energy["closure"]) < 1e-11 * sim.energy["in_play"]
        assert (sim.energy["work_projection"] > 0) == np.isfinite(overlap)
    assert deep[0] > 4 * deep[1] and deep[1] < 4e-3


def pressed(count=5, strategy=None, speed=0.02, seed=3):
    """count^3 spheres of 1 m between walls, pressed by a lid that a force of 20 times their weight moves."""
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(*[np.arange(count)] * 3, indexing="ij"), -1).reshape(-1, 3)
    radii = rng.uniform(0.38, 0.45, len(grid))
    scene = cn.Scene(3, gravity=(0, 0, 0), periodic=cn.Periodic(lengths=(count, count, np.inf)))
    scene.add(cn.spheres((grid + 0.5 + rng.uniform(-0.05, 0.05, grid.shape)) * [1, 1, 1.05], radii, ROCK))
    weight = 9.81 * 2000 * 4 / 3 * np.pi * np.sum(radii**3)
    scene.add(cn.wall((0, 0, 0), (0, 0, 1), ROCK))
    lid = scene.add(cn.wall((0, 0, 1.1 * count), (0, 0, -1), ROCK, mass=weight / 5, free="vz", force=(0, 0, -20 * weight)))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    return cn.Simulation(scene, 1e-3, strategy, overlap="ignore"), int(lid[0])


def test_dense_packs_end_their_steps_early(tmp_path):
    """Balls that a lid presses together: steps whose contacts press as in the last step end after 50 sweeps, all converge, and
    overlap stays small. Without the impulses of the last step all contacts are new, as in an impact, and the tolerance counts. A
    checkpoint goes on to the same bits."""
    sim, _ = pressed()
    told = [dict(sim.step()) for _ in range(380)]
    early = [info for info in told if info["error"] > 1e-4]
    assert all(info["status"] == "converged" for info in told)
    assert early and max(info["error"] for info in early) <= 1e-3
    assert all(info["iterations"] >= 50 for info in early)
    assert max(info["penetration"] for info in told) < 0.02
    assert abs(sim.energy["closure"]) < 1e-11 * sim.energy["in_play"]
    sim.checkpoint(tmp_path / "pack.h5")
    for warm in (True, False):
        solver = cn.NLGS(tol=1e-7, enough=0.01, patience=1, max_iter=400)
        other, _ = pressed(strategy=cn.NSCD(solver=solver, overlap=0.005, warm_start=warm))
        other.restore(tmp_path / "pack.h5")
        info = other.step()
        assert (info["error"] > 1e-7 and info["status"] == "converged") == warm
    again, _ = pressed()
    again.restore(tmp_path / "pack.h5")
    for _ in range(10):
        sim.step(), again.step()
    assert again.strategy == sim.strategy and np.array_equal(sim.bodies.position, again.bodies.position)


def test_overlap_that_a_pack_begins_with_is_taken_back():
    """Overlap of a twentieth in a pack under load: steps are solved to 1e-4 as long as it is that deep, and it is taken back."""
    packed, lid = pressed()
    packed.run(steps=380, progress=False)
    centers, radii = packed.bodies.position[:-2].copy(), 1.03 * packed.radii()[:-2]
    scene = cn.Scene(3, gravity=(0, 0, 0), periodic=cn.Periodic(lengths=(5, 5, np.inf)))
    scene.add(cn.spheres(centers, radii, ROCK))
    scene.add(cn.wall((0, 0, 0), (0, 0, 1), ROCK))
    height, weight = packed.bodies.position[lid, 2], 9.81 * 2000 * 4 / 3 * np.pi * np.sum(radii**3)
    scene.add(cn.wall((0, 0, height), (0, 0, -1), ROCK, mass=weight / 5, free="vz", force=(0, 0, -20 * weight)))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, 1e-3, overlap="ignore")
    told = [dict(sim.step()) for _ in range(320)]
    deep = [info for info in told if info["drift"] > 0.02]
    assert len(deep) > 5 and all(info["error"] <= 1e-4 for info in deep if info["status"] == "converged")
    # what is more than four times the limit of 0.005 beyond it is taken back from packs at rest too, less after early ends alone
    assert told[-1]["drift"] < 0.02 and abs(sim.energy["closure"]) < 1e-11 * sim.energy["in_play"]


def test_a_tolerance_that_is_named_counts_alone():
    """Default without a tolerance has early ends, and a limit of overlap."""
    named, _ = pressed(count=2, strategy=cn.NSCD(solver=cn.Default(tol=1e-4)))
    free, _ = pressed(count=2)
    assert named.strategy.solver.enough is None and named.strategy.overlap == np.inf
    assert free.strategy.solver.enough == 1e-3 and free.strategy.overlap == 0.005


@pytest.mark.parametrize("change", [
    {"project_positions": True}, {"contact_point": "surface"}, {"accuracy": 1e-3}, {"integrator": cn.Newmark()}, {"cut_back": 2},
], ids=repr)  # fmt: skip
def test_who_asks_for_more_than_the_default_has_no_early_ends(change):
    """Projection, surfaces, accuracy, other integrators and cuts have their own conditions."""
    sim, _ = pressed(count=2, strategy=cn.NSCD(**change))
    assert sim.strategy.solver.enough is None and sim.strategy.overlap == np.inf


def test_packs_are_grains_under_laws_without_gaps():
    """Balls, boxes and capsules; laws that ask for a gap or an overlap keep the tolerance."""
    def ends(law=LAWS[0], shape="balls"):
        scene = cn.Scene(3, gravity=(0, 0, 0))
        x = np.array([[0.0, 0, 0], [2, 0, 0]]) if shape == "balls" else 2.0 * np.indices((3, 3, 3)).reshape(3, -1).T
        made = {"balls": (cn.spheres, 0.5), "boxes": (cn.boxes, (1, 1, 1)), "capsules": (cn.capsules, 0.3, 1.0)}[shape]
        scene.add(made[0](x, *made[1:], ROCK))
        scene.interact("*", "*", law)
        return cn.Simulation(scene, 1e-3).strategy.solver.enough
    assert all(ends(law) == 1e-3 for law in LAWS)
    assert ends(shape="boxes") == ends(shape="capsules") == 1e-3
    assert ends(cn.ElasticContact(stiffness=1e6, mu=0.1)) is None


def test_overlap_is_checked():
    """A share above 0."""
    for wrong in (0.0, -1.0, "much"):
        with pytest.raises(ValueError, match="overlap is"):
            cn.NSCD(overlap=wrong)
