"""Measures against closed forms."""

import cairn as cn
import numpy as np
import pytest
from cairn.post import RunWriter, load
from cairn.post import measures as me
from cairn.post.overlap import box_vertices, disk_polygon_area, sphere_box_volume


def test_disk_in_rectangle():
    box = box_vertices((0, 0), (4, 3))
    centers = np.array([[2, 1.5], [0, 1.5], [0, 0], [-1, 1.5], [-3, 1], [2, 1.5], [2, 0.25]])
    radii = np.array([1, 1, 1, 1, 1, 10, 0.5])
    half = 0.5**2
    segment = half * np.arccos(-0.5) - (-0.25) * np.sqrt(half - 0.0625)  # a chord 0.25 below the centre
    expected = [np.pi, np.pi / 2, np.pi / 4, 0, 0, 12, segment]
    assert np.allclose(disk_polygon_area(centers, radii, box), expected, rtol=1e-14, atol=1e-14)
    assert np.allclose(disk_polygon_area(centers, radii, box[::-1]), expected, rtol=1e-14, atol=1e-14)


def test_disk_in_polygon_against_the_whole():
    """Pieces of a tiling add up to the disk; a polygon that is not convex too."""
    rng = np.random.default_rng(1)
    centers, radii = rng.uniform(-1, 1, (200, 2)), rng.uniform(0.01, 1.5, 200)
    xs = np.array([-5, -0.7, 0.1, 0.4, 5])
    total = sum(
        disk_polygon_area(centers, radii, box_vertices((a, c), (b, d)))
        for a, b in zip(xs[:-1], xs[1:])
        for c, d in zip(xs[:-1], xs[1:])
    )
    assert np.allclose(total, np.pi * radii**2, rtol=1e-13)
    arrow = np.array([[-2, -2], [0, 2], [2, -2], [0, -1]])
    left, right = arrow[[0, 1, 3]], arrow[[1, 2, 3]]
    assert np.allclose(
        disk_polygon_area(centers, radii, arrow),
        disk_polygon_area(centers, radii, left) + disk_polygon_area(centers, radii, right),
        atol=1e-13,
    )


def test_sphere_in_box():
    low, high = np.zeros(3), np.full(3, 4.0)
    sphere = 4 / 3 * np.pi
    centers = np.array([[2, 2, 2], [0, 2, 2], [0, 0, 2], [0, 0, 0], [-1, 2, 2], [2, 2, 2], [0.5, 2, 2]])
    radii = np.array([1, 1, 1, 1, 1, 10, 1])
    cap = np.pi * 1.5**2 * (3 - 1.5) / 3
    expected = [sphere, sphere / 2, sphere / 4, sphere / 8, 0, 64, cap]
    assert np.allclose(sphere_box_volume(centers, radii, low, high), expected, rtol=1e-12, atol=1e-13)


def test_spheres_in_a_tiling_of_boxes():
    rng = np.random.default_rng(2)
    centers, radii = rng.uniform(-1, 1, (20, 3)), rng.uniform(0.1, 1.5, 20)
    cuts = np.array([-5, -0.3, 0.2, 5])
    cells = [(a, b) for a, b in zip(cuts[:-1], cuts[1:])]
    total = sum(
        sphere_box_volume(centers, radii, (x[0], y[0], z[0]), (x[1], y[1], z[1])) for x in cells for y in cells for z in cells
    )
    assert np.allclose(total, 4 / 3 * np.pi * radii**3, rtol=1e-11)


def test_solid_fraction_of_lattices():
    square = np.stack(np.meshgrid(np.arange(-2, 7), np.arange(-2, 7)), -1).reshape(-1, 2).astype(float)
    assert me.solid_fraction(square, np.full(81, 0.5), (0.3, 0.1), (4.3, 3.1)) == pytest.approx(np.pi / 4, rel=1e-14)
    hexagonal = square * [1, np.sqrt(3) / 2] + [[0.5, 0]] * (np.round(square[:, 1:]) % 2)
    cell = (0.2, 0.1), (3.2, 0.1 + 2 * np.sqrt(3))
    assert me.solid_fraction(hexagonal, np.full(81, 0.5), *cell) == pytest.approx(np.pi / np.sqrt(12), rel=1e-14)
    assert me.solid_fraction(hexagonal, np.full(81, 0.5), polygon=box_vertices(*cell)) == pytest.approx(
        np.pi / np.sqrt(12), rel=1e-14
    )
    cubic = np.stack(np.meshgrid(*[np.arange(-1, 4)] * 3), -1).reshape(-1, 3).astype(float)
    assert me.solid_fraction(cubic, np.full(125, 0.5), (0.3, 0.2, 0.6), (2.3, 1.2, 2.6)) == pytest.approx(np.pi / 6, rel=1e-12)
    with pytest.raises(ValueError, match="empty"):
        me.solid_fraction(square, np.full(81, 0.5), (1, 1), (0, 2))
    with pytest.raises(ValueError, match="region is needed"):
        me.solid_fraction(square, np.full(81, 0.5))


def test_coordination():
    # a triangle of three bodies, a chain 3-4-5 that hangs on body 2, a body 6 alone, a wall 7 under 0
    a, b = np.array([0, 1, 2, 2, 3, 4, 0]), np.array([1, 2, 0, 3, 4, 5, 7])
    counted = np.arange(8) < 7
    assert me.coordination_number(8, a, b, counted=counted) == pytest.approx((3 + 2 + 3 + 2 + 2 + 1 + 0) / 7)
    assert list(np.flatnonzero(me.rattlers(8, a, b, 2, counted))) == [3, 4, 5, 6]  # the chain goes from its end
    assert me.coordination_number(8, a, b, True, counted=counted) == pytest.approx((3 + 2 + 2) / 3)
    none = np.empty(0, int)
    assert me.coordination_number(3, none, none) == 0.0
    assert np.isnan(me.coordination_number(3, none, none, without_rattlers=True))


def test_fabric():
    angle = np.arange(6) * np.pi / 3
    hexagon = np.stack([np.cos(angle), np.sin(angle)], 1)
    assert np.allclose(me.fabric_tensor(hexagon), np.eye(2) / 2)
    assert np.allclose(me.fabric_tensor(np.tile([[0.6, 0.8]], (5, 1))), [[0.36, 0.48], [0.48, 0.64]])
    assert np.allclose(me.fabric_tensor(np.eye(3), [1, 2, 1]), np.diag([0.25, 0.5, 0.25]))
    assert np.isnan(me.fabric_tensor(np.empty((0, 2)))).all()


def test_stress_of_a_column():
    """A lattice under p: each contact along y carries p d, so that the stress is -p along y."""
    p, d = 3.0, 0.5
    count = 4 * 6
    forces, branches = np.tile([0, p * d], (count, 1)), np.tile([0, d], (count, 1))
    stress = me.stress_tensor(forces, branches, volume=count * d * d)
    assert np.allclose(stress, [[0, 0], [0, -p]])
    pressure, deviator = me.pressure_and_deviator(stress)
    assert pressure == pytest.approx(p / 2) and deviator == pytest.approx(p / 2)
    assert me.pressure_and_deviator(-np.eye(3) * 2)[0] == pytest.approx(2)
    assert me.pressure_and_deviator(np.diag([0, 0, -6.0]))[1] == pytest.approx(6)


def test_stress_by_bodies_is_stress_by_branches():
    rng = np.random.default_rng(0)
    x, n, m = rng.random((10, 3)), 10, 40
    a, b = rng.integers(0, 5, m), rng.integers(5, 10, m)
    point, forces = rng.random((m, 3)), rng.standard_normal((m, 3))
    moments = me.body_moments(n, a, b, forces, point - x[a], point - x[b])
    assert np.allclose(moments.sum(0), me.stress_tensor(forces, x[a] - x[b], 1.0))


def test_force_distribution():
    forces = np.random.default_rng(0).exponential(7.0, 400_000)
    x, density = me.force_distribution(np.concatenate([forces, np.zeros(1000)]))
    assert np.allclose(density, np.exp(-x), atol=0.01)
    assert me.force_distribution(np.zeros(3))[1].sum() == 0


@pytest.mark.parametrize("periodic", [False, True])
def test_measure_of_an_output(tmp_path, periodic):
    """Disks on a square lattice pressed along y between two walls, or round a periodic boundary."""
    nx, ny, d, force, dt = 4, 5, 1.0, 2.0, 0.1
    centers = np.stack(np.meshgrid(np.arange(nx) + 0.5, np.arange(ny) + 0.5), -1).reshape(-1, 2)
    n = len(centers)
    below = np.arange(n - nx)
    a, b, point = [below + nx], [below], [centers[below] + [0, d / 2]]
    first, last = np.arange(nx), np.arange(n - nx, n)
    if periodic:
        a, b, point = [*a, first], [*b, last], [*point, centers[first] - [0, d / 2]]
    else:
        a, b, point = (
            [*a, first, last],
            [*b, np.full(nx, n), np.full(nx, n + 1)],
            [*point, centers[first] - [0, 0.5], centers[last] + [0, 0.5]],
        )
    a, b, point = np.concatenate(a), np.concatenate(b), np.concatenate(point)
    normal = np.tile([0.0, 1.0], (len(a), 1))
    if not periodic:
        normal[-nx:] = [0, -1]
    position = np.concatenate([centers, [[0, 0], [0, ny]]])
    writer = RunWriter(
        tmp_path / "a.vtkhdf",
        {
            "dt": dt,
            "contactors": {
                "shape": ["disk"] * n + ["half_plane"] * 2,
                "body": np.arange(n + 2),
                "radius": np.append(np.full(n, d / 2), [0, 0]),
            },
        },
        dim=2,
    )
    writer.write_step(
        0.0,
        0.0,
        0,
        {"position": position, "radius": np.append(np.full(n, d / 2), [0, 0]), "id": np.arange(n + 2)},
        {
            "point": point,
            "normal": normal,
            "gap": np.zeros(len(a)),
            "impulse": force * dt * normal,
            "status": np.ones(len(a), int),
            "body_a": a,
            "body_b": b,
        },
    )
    writer.close()
    with load(writer.path) as run:
        result = run.measure(0)
    assert result["coordination"] == pytest.approx(2.0)
    assert result["rattlers"] == 0 and result["contacts"] == len(a)
    assert result["solid_fraction"] == pytest.approx(np.pi / 4, rel=1e-13)
    assert np.allclose(result["stress"], [[0, 0], [0, -force / d]], atol=1e-14)
    assert np.allclose(result["fabric"], [[0, 0], [0, 1]])
    assert result["pressure"] == pytest.approx(force / 2)


def output_of(scene, tmp_path, steps=50, dt=1e-3):
    sim = cn.Simulation(scene, dt, cn.NSCD(solver=cn.Default(tol=1e-8, max_iter=10000)), overlap="ignore")
    sim.run(steps=steps, output=tmp_path / "a.vtkhdf", every=steps, progress=False)
    return sim, load(tmp_path / "a.vtkhdf")[-1]


def test_bodies_of_all_shapes_count(tmp_path):
    """A block on two disks: the block was no part of the stress, nor of the mean of contacts, since it is not round."""
    rock = cn.Material("rock", density=1000.0)
    scene = cn.Scene(2, gravity=(0, -10))
    scene.add(cn.disks([[0, 0.1], [0.5, 0.1]], 0.1, rock))
    scene.add(cn.polygons([[[-0.2, 0.2], [0.7, 0.2], [0.7, 0.4], [-0.2, 0.4]]], rock))
    scene.add(cn.wall((0, 0), (0, 1), rock), cn.wall((0, 5), (0, -1), rock, mass=1.0, free="vy"))
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    sim, step = output_of(scene, tmp_path)
    region = {"low": (-0.2, 0.0), "high": (0.7, 0.4)}
    disk, block = 10 * sim.bodies.mass[0], 10 * sim.bodies.mass[2]
    by_disks = (2 * disk + block) * 0.1 + block * 0.1  # moments of their weights above the floor, by the upper and lower half
    found = me.measure(step, **region)
    assert found["stress"][1, 1] * 0.36 == pytest.approx(-(by_disks + block * 0.1), rel=1e-6)
    assert found["coordination"] == 2.0 and found["contacts"] == 4 and np.isnan(found["solid_fraction"])
    alone = me.measure(step, **region, bodies=sim.bodies.id[:2])
    assert alone["stress"][1, 1] * 0.36 == pytest.approx(-by_disks, rel=1e-6)
    assert alone["solid_fraction"] == pytest.approx(2 * np.pi * 0.01 / 0.36)


@pytest.mark.parametrize("other", ["capsule", "cylinder", "box"])
def test_spheres_among_bodies_of_other_shapes(tmp_path, other):
    rock = cn.Material("rock", density=1000.0)
    scene = cn.Scene(3, gravity=(0, 0, -10))
    make = {
        "capsule": lambda: cn.capsules([[0, 0, 0.1]], 0.1, 0.4, rock, axis=(1, 0, 0)),
        "cylinder": lambda: cn.cylinders([[0, 0, 0.2]], 0.1, 0.4, rock),
        "box": lambda: cn.boxes([[0, 0, 0.1]], (0.2, 0.2, 0.2), rock),
    }
    scene.add(make[other](), cn.spheres([[1, 0, 0.1]], 0.1, rock), cn.wall((0, 0, 0), (0, 0, 1), rock))
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    sim, step = output_of(scene, tmp_path, 20)
    found = me.measure(step, low=(-0.5, -0.5, 0), high=(1.5, 0.5, 0.5))
    weights = 10 * sim.bodies.mass[:2] * sim.bodies.position[:2, 2]
    assert found["stress"][2, 2] == pytest.approx(-weights.sum(), rel=1e-6)


def test_a_region_has_its_own_contacts(tmp_path):
    rng = np.random.default_rng(3)
    radii = rng.uniform(0.04, 0.06, 150)
    sand = cn.Material("sand", density=2600.0)
    scene = cn.Scene(2, gravity=(0, -9.81))
    scene.add(cn.disks(cn.pre.deposit_disks(radii, 1.2), radii, sand))
    for point, normal in (((0, 0), (0, 1)), ((0, 0), (1, 0)), ((1.2, 0), (-1, 0))):
        scene.add(cn.wall(point, normal, sand))
    scene.interact(sand, sand, cn.Coulomb(mu=0.5))
    sim, step = output_of(scene, tmp_path, 300, 2e-3)
    low, high = (0.2, 0.1), (1.0, 0.4)
    found, position = me.measure(step, low=low, high=high), sim.bodies.position[:150]
    inside = np.append(np.all((position >= low) & (position <= high), axis=1), [False] * 3)
    loaded = np.any(sim.contacts.impulse != 0, axis=1)
    pairs = np.searchsorted(sim.bodies.id, sim.contacts.bodies[loaded])
    own = inside[pairs].any(axis=1)
    counts = np.bincount(pairs.ravel(), minlength=153)
    assert found["contacts"] == own.sum() < len(own) == me.measure(step)["contacts"]
    assert found["coordination"] == pytest.approx(counts[inside].mean())
    assert np.allclose(found["fabric"], me.fabric_tensor(sim.contacts.normal[loaded][own]))
    loose = me.rattlers(153, *pairs.T, counted=np.arange(153) < 150)
    assert found["rattlers"] == pytest.approx(loose[inside].mean())
    bears = ~loose[pairs].any(axis=1)
    steady = np.bincount(pairs[bears].ravel(), minlength=153)[inside & ~loose]
    assert found["coordination_without_rattlers"] == pytest.approx(steady.mean())


@pytest.mark.parametrize("lean", [0.0, 0.3])
@pytest.mark.parametrize("offset", [0.0, 0.02, 0.05])
@pytest.mark.parametrize("dim", [2, 3])
def test_a_periodic_cell_is_measured_whole(tmp_path, dim, offset, lean):
    """A lattice pressed by springs, with any part across the border: without a region the whole cell, or any region of its size;
    half of it by the images within."""
    overlap, stiffness, per, d = 0.001, 1e6, 5, 0.1
    pitch = d - overlap
    size = per * pitch
    rock = cn.Material("rock", density=1000.0)
    lattice = np.stack(np.meshgrid(*[np.arange(per)] * dim, indexing="ij"), -1).reshape(-1, dim) * pitch + offset
    if lean:
        lattice[:, 0] += lean * pitch * np.round((lattice[:, -1] - offset) / pitch)
    scene = cn.Scene(dim, periodic=cn.Periodic((size,) * dim, lean=lean * size))
    scene.add((cn.disks if dim == 2 else cn.spheres)(lattice, d / 2, rock))
    scene.interact("*", "*", cn.LinearSpring(stiffness=stiffness))
    sim = cn.Simulation(scene, 1e-7, strategy=cn.SmoothDEM(unstable="ignore"), overlap="ignore")
    sim.run(steps=1, output=tmp_path / "a.vtkhdf", progress=False)
    step = load(tmp_path / "a.vtkhdf")[-1]
    fill = (np.pi * d**2 / 4 if dim == 2 else np.pi * d**3 / 6) / pitch**dim
    everything = me.measure(step)
    assert everything["solid_fraction"] == pytest.approx(fill, rel=1e-12)
    low = np.full(dim, -0.013)
    shifted = me.measure(step, low=low, high=low + size)
    assert shifted["solid_fraction"] == pytest.approx(fill, rel=1e-9)
    for found in (everything, shifted):
        assert found["coordination"] == pytest.approx(2 * everything["contacts"] / per**dim) and found["rattlers"] == 0
        assert np.allclose(found["stress"], everything["stress"], rtol=1e-9)
        if not lean:  # a force of k overlap in each row, of one for the area of a cell
            pressed = -stiffness * overlap / pitch ** (dim - 1) * np.eye(dim)
            assert np.allclose(found["stress"], pressed, rtol=1e-4, atol=1e-4 * abs(pressed).max())
    if not lean and offset == 0:  # planes of centres at its ends
        half = me.measure(step, low=np.zeros(dim), high=np.r_[2 * pitch, np.full(dim - 1, size)])
        assert half["solid_fraction"] == pytest.approx(fill, rel=1e-9)
    with pytest.raises(ValueError, match="along y, and the periodic cell .*: give one that is no longer"):
        me.measure(step, low=np.zeros(dim), high=np.r_[size, 1.1 * size, np.full(dim - 2, size)])


def test_blocks_across_the_border_of_a_cell(tmp_path):
    """A row of blocks that presses itself across the border: levers are those of the images that touch."""
    rock = cn.Material("rock", density=1000.0)
    scene = cn.Scene(2, periodic=cn.Periodic((3.0, np.inf)))
    square = np.array([[-0.5, 0], [0.5, 0], [0.5, 1], [-0.5, 1]])
    scene.add(cn.polygons([square + [k + 0.1, 0] for k in range(3)], rock, velocity=[[0, 0, 0], [1, 0, 0], [-1, 0, 0]]))
    scene.interact("*", "*", cn.Coulomb(mu=0.0))
    _, step = output_of(scene, tmp_path, steps=1)
    force = np.abs(step.contacts["impulse"][:, 0]).sum() / 1e-3
    assert force > 0
    assert me.measure(step, low=(0, 0), high=(3, 1))["stress"][0, 0] == pytest.approx(-force / 3.0, rel=2e-3)
