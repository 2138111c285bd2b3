"""Deformable bodies beside a liquid: points below their sides, weight, momentum, thin bodies, restart, errors."""

import warnings

import cairn as cn
import numpy as np
import pytest
from cairn.model.fluid_skins import Surface, flat_pieces, shapes_and_slopes, skin_of
from cairn.run.fluid_gaps import FluidWarning

rock = cn.Material("rock", density=2600.0)
rubber = cn.Material("rubber", density=1200.0)


def grid(low, size, many):
    """Points and cells of a block of quad or hexahedron cells."""
    dim = len(low)
    axes = [a + np.linspace(0, s, n + 1) for a, s, n in zip(low, size, many)]
    points = np.stack([x.ravel() for x in np.meshgrid(*axes, indexing="ij")], axis=1)
    number = np.arange(len(points)).reshape([n + 1 for n in many])
    corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
    if dim == 3:
        corners = [(*c, z) for z in (0, 1) for c in corners]
    ends = [slice(k, n + k if k else n) for n in many for k in (0, 1)]
    cells = np.stack([number[tuple(ends[2 * axis + k] for axis, k in enumerate(c))].ravel() for c in corners], axis=1)
    return points, {"quad" if dim == 2 else "hexahedron": cells}


def block(low, size, many, kind="linear", young=1e5, name="block", fixed=None, **options):
    """Deformable body of a grid; kind: linear, or of Neo-Hookean material."""
    points, cells = grid(low, size, many)
    common = {"density": 1200.0, "groups": {"all": np.arange(len(points))}, **options}
    if fixed is not None:
        common["groups"]["held"] = np.flatnonzero(fixed(points))
    if kind == "linear":
        body = cn.ElasticBody(points, cells, young=young, poisson=0.3, **common)
    else:
        body = cn.SolidBody(points, cells, cn.NeoHookean(young=young, poisson=0.3), **common)
    return cn.deformable(body, rubber, name=name, fixed=None if fixed is None else {"held": "xyz"[: len(low)]})


def foot_and_normal(skin, x):
    """Places of the points of a skin for nodes at x, and normals."""
    foot, g, f = (np.einsum("na,nak->nk", skin[name], x[skin["node"]]) for name in ("weight", "along", "across"))
    normal = np.stack([g[:, 1], -g[:, 0]], axis=1) if x.shape[1] == 2 else np.cross(g, f)
    size = np.linalg.norm(normal, axis=1)
    assert np.allclose(size, skin["size"])
    normal /= size[:, None]
    return foot - skin["depth"][:, None] * normal, normal


@pytest.mark.parametrize(("dim", "nodes"), [(2, 2), (2, 3), (3, 3), (3, 4), (3, 6), (3, 8), (3, 9)])
def test_slopes_of_shape_functions_are_their_derivatives(dim, nodes):
    at = np.random.default_rng(nodes).uniform(0.1, 0.5, (5, dim - 1))
    shape, *slopes = shapes_and_slopes(dim, nodes, at)
    assert np.allclose(shape.sum(axis=1), 1)
    for axis, slope in zip(np.eye(dim - 1), slopes):
        above, below = (shapes_and_slopes(dim, nodes, at + s * 1e-4 * axis)[0] for s in (1, -1))
        assert np.allclose((above - below) / 2e-4, slope, atol=1e-6)


@pytest.mark.parametrize("dim", [2, 3])
def test_points_fill_the_layers_of_a_block(dim):
    points, cells = grid((0.0,) * dim, (0.3,) * dim, (6,) * dim)
    body = cn.ElasticBody(points, cells, young=1e5, poisson=0.3, density=1.0)
    skin = skin_of(body, "block", 0.025, 0.075)
    place, _ = foot_and_normal(skin, points)
    assert np.all((place > 0) & (place < 0.3))
    assert abs(skin["volume"].sum() / (0.3**dim - 0.15**dim) - 1) < 1e-6
    assert skin["behind"].min() > 1.0  # nothing is behind a thick body
    if dim == 3:
        return
    # cells much finer than the spacing have no more points
    points, cells = grid((0.0, 0.0), (0.3, 0.3), (96, 96))
    fine = skin_of(cn.ElasticBody(points, cells, young=1e5, poisson=0.3, density=1.0), "block", 0.025, 0.075)
    assert len(fine["depth"]) < 1.3 * len(skin["depth"])
    assert abs(fine["volume"].sum() / skin["volume"].sum() - 1) < 0.05


def test_a_thin_plate_has_full_layers_that_its_far_side_hides():
    points, cells = grid((0.0, 0.0), (0.005, 0.1), (2, 40))
    body = cn.ElasticBody(points, cells, young=1e5, poisson=0.3, density=1.0)
    skin = skin_of(body, "plate", 0.0025, 0.0075)
    _, normal = foot_and_normal(skin, points)
    for way in (1, -1):
        of = skin["depth"][normal[:, 0] * way > 0.9]
        assert len(np.unique(of)) == 3  # as deep as the kernel reaches, 1.5 thicknesses
    assert np.all(skin["behind"][np.abs(normal[:, 0]) > 0.9] < 0.005)


@pytest.mark.parametrize("dim", [2, 3])
def test_depths_in_a_body(dim):
    points, cells = grid((0.0,) * dim, (0.3,) * dim, (4,) * dim)
    body = cn.ElasticBody(points, cells, young=1e5, poisson=0.3, density=1.0)
    x = np.random.default_rng(1).uniform(-0.1, 0.4, (1000, dim))
    depth = Surface(flat_pieces(body), points).depth(x, 0.05)
    inner = np.minimum(x, 0.3 - x).min(axis=1)
    outer = np.linalg.norm(np.maximum(np.maximum(-x, x - 0.3), 0), axis=1)
    assert np.allclose(depth[inner > 0], inner[inner > 0])
    near = (inner < 0) & (outer < 0.05)
    assert np.allclose(depth[near], -outer[near])
    assert np.all(np.isneginf(depth[outer > 0.051]))


def struck(dim, kind, theta=0.5, threads=None):
    """A block that a cube of viscous liquid strikes, without gravity and walls."""
    scene = cn.Scene(dim=dim)
    deep = (0.2,) * (dim - 2)
    scene.add(block((0.0, 0.0) + (0.0,) * (dim - 2), (0.2, 0.4, *deep), (4, 8, *(4,) * (dim - 2)), kind))
    region = [(-0.2, 0.1, *(0.0,) * (dim - 2)), (0.0, 0.3, *deep)]
    velocity = (1.0, 0.3, 0.1)[:dim]
    scene.add(cn.fluid(region, 0.05, viscosity=0.5, velocity=velocity, sound_speed=15.0, pressure=0.0))
    scene.interact("*", "*", None)
    return cn.Simulation(scene, dt=2e-3, strategy=cn.NSCD(theta=theta, **({"threads": threads} if threads else {})))


def momentum(sim):
    body, mass = sim.meshes[0].body, np.asarray(sim.fluid.mass)
    velocity = np.asarray(sim.nodes.velocity)
    of_nodes = (body.M @ velocity.ravel()).reshape(velocity.shape)
    return np.sum(mass[:, None] * sim.fluid.velocity, axis=0) + of_nodes.sum(axis=0)


@pytest.mark.parametrize(
    ("dim", "kind", "theta"), [(2, "linear", 0.5), (2, "linear", 1.0), (2, "large", 0.5), (3, "linear", 0.5)]
)
def test_momentum_is_kept_to_rounding(dim, kind, theta):
    sim = struck(dim, kind, theta)
    before = momentum(sim)
    for _ in range(15):
        sim.step()
    assert np.abs(sim.nodes.velocity).max() > 0.01
    assert np.abs(momentum(sim) - before).max() < (1e-11 if kind == "linear" else 1e-7) * np.linalg.norm(before)


def test_forces_of_points_are_the_transpose_of_their_motion():
    # forces on nodes have the force and the moment of the liquid
    sim = struck(2, "linear")
    for _ in range(8):
        sim.step()
    mass = np.asarray(sim.fluid.mass)

    def spin():
        x, v = np.asarray(sim.fluid.position), np.asarray(sim.fluid.velocity)
        return np.sum(mass * (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0]))

    before = spin()
    sim.step(1e-4)
    x, f = np.asarray(sim.nodes.position), sim.fluid.forces_on_mesh("block")
    moment = np.sum(x[:, 0] * f[:, 1] - x[:, 1] * f[:, 0])
    assert abs(1e-4 * moment + spin() - before) < 1e-3 * abs(1e-4 * moment)


def test_vibrations_above_the_step_do_not_grow():
    # a nearly incompressible gate that water bends, without damping, at theta = 1/2
    points, cells = grid((0.1, 0.0), (0.005, 0.08), (2, 16))
    law = cn.NeoHookean(young=7.8e6, poisson=0.47)
    body = cn.SolidBody(points, cells, law, density=1100.0, groups={"top": np.flatnonzero(points[:, 1] > 0.079)})
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.deformable(body, rubber, name="gate", fixed={"top": "xy"}))
    scene.add(cn.wall((0, 0), (0, 1), rock), cn.wall((0, 0), (1, 0), rock))
    scene.add(cn.fluid([(0, 0), (0.1, 0.08)], 0.005))
    scene.interact("*", "*", None)
    scene.interact("fluid", "*", cn.FreeSlip())
    sim = cn.Simulation(scene, dt=2e-3)
    speed = []
    for _ in range(120):
        sim.step()
        speed.append(np.abs(sim.nodes.velocity).max())
    assert max(speed[60:]) < 1.5 and sim.fluid.info["compression"] < 0.1


def plated(both=False, dt=2e-3, young=1e7, **options):
    """Water on a plate clamped at both ends, or on both of its sides."""
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(block((0.0, -0.05), (1.0, 0.05), (20, 2), young=young, name="plate", rayleigh=(200.0, 0.0),
                    fixed=lambda x: (x[:, 0] < 1e-9) | (x[:, 0] > 1 - 1e-9)))  # fmt: skip
    scene.add(cn.wall((0, -0.55), (0, 1), rock), cn.wall((0, 0), (1, 0), rock), cn.wall((1, 0), (-1, 0), rock))
    scene.add(cn.fluid([(0, 0), (1, 0.5)], 0.05, artificial=0.2))
    if both:
        scene.add(cn.fluid([(0, -0.55), (1, -0.05)], 0.05, artificial=0.2, pressure=0.0))
    scene.interact("*", "*", None)
    scene.interact("fluid", "*", cn.FreeSlip())
    return cn.Simulation(scene, dt=dt, **options)


def test_a_plate_carries_the_weight_of_the_water():
    sim = plated(young=1e9)
    points = sim.meshes[0].body.points
    middle = int(np.argmin(np.abs(points - [0.5, 0.0]).sum(axis=1)))
    force, sag = [], []
    for _ in range(250):
        sim.step()
        force.append(sim.fluid.forces_on_mesh("plate")[:, 1].sum())
        sag.append(sim.nodes.position[middle, 1])
    weight = 1000 * 9.81 * 0.5
    # walls beside the plate reach below it, and bear a share of a third of a spacing at each end
    assert abs(np.mean(force[125:]) / -weight - 1) < 0.04
    # the same load on the nodes, at rest
    body, held = sim.meshes[0].body, sim.meshes[0].held
    free = np.setdiff1d(np.arange(points.size), held)
    load = (body.M @ np.tile([0.0, -9.81], len(points))).reshape(-1, 2)
    top = np.flatnonzero(points[:, 1] > -1e-9)
    load[top, 1] -= weight * np.where((points[top, 0] < 1e-9) | (points[top, 0] > 1 - 1e-9), 0.5, 1.0) / 20
    rest = np.zeros(points.size)
    rest[free] = np.linalg.solve(body.K.toarray()[np.ix_(free, free)], load.ravel()[free])
    assert abs(np.mean(sag[125:]) / rest[2 * middle + 1] - 1) < 0.03


def test_liquid_on_both_sides_of_a_thin_plate_stays_there():
    sim = plated(both=True, young=1e8)
    above = sim.fluid.position[:, 1] > 0
    for _ in range(60):
        sim.step()
    x = np.asarray(sim.fluid.position)
    sag = sim.nodes.position[:, 1] - sim.meshes[0].body.points[:, 1]
    assert x[above, 1].min() > sag.min() - 0.01
    assert x[~above, 1].max() < -0.05 + sag.max() + 0.01


def test_a_light_soft_body_is_stable_and_floats():
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.wall((0, 0), (0, 1), rock), cn.wall((0, 0), (1, 0), rock), cn.wall((1, 0), (-1, 0), rock))
    scene.add(block((0.35, 0.35), (0.3, 0.2), (3, 2), young=2e4, density=100.0))
    scene.add(cn.fluid([(0, 0), (1, 0.4)], 0.05, artificial=0.2))
    scene.interact("*", "*", None)
    sim = cn.Simulation(scene, dt=4e-3)
    high = []
    for _ in range(100):
        sim.step()
        high.append(sim.nodes.position[:, 1].mean())
    assert np.abs(sim.nodes.velocity).max() < 1.0
    level = len(sim.fluid) * 0.05**2 + 0.1 * 0.06
    assert abs(np.mean(high[50:]) - (level - 0.1 * 0.2 + 0.1)) < 0.04


def test_a_body_with_contacts_lies_on_the_bed():
    points, cells = grid((0.35, 0.01), (0.3, 0.2), (6, 4))
    groups = {"bottom": np.flatnonzero(points[:, 1] < 0.011)}
    body = cn.ElasticBody(points, cells, young=1e7, poisson=0.3, density=2000.0, groups=groups, rayleigh=(20.0, 0.0))
    scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
    scene.add(cn.deformable(body, rubber, name="block", contact="bottom", edges="bottom"))
    scene.add(cn.wall((0, 0), (0, 1), rock), cn.wall((0, 0), (1, 0), rock), cn.wall((1, 0), (-1, 0), rock))
    scene.add(cn.fluid([(0, 0), (1, 0.4)], 0.05, artificial=0.2))
    scene.interact("*", "*", cn.Coulomb(mu=0.4))
    sim = cn.Simulation(scene, dt=4e-3)
    for _ in range(60):
        report = sim.step()
    assert report["contacts"] >= 7 and report["status"] == "converged"
    low = sim.nodes.position[:, 1].min()
    assert abs(low) < 1e-3 and np.abs(sim.nodes.velocity.mean(axis=0)).max() < 0.05


@pytest.mark.parametrize("kind", ["linear", "large"])
def test_restart_and_threads_keep_bits(kind, tmp_path):
    def state(sim):
        return np.concatenate([np.asarray(a).ravel() for a in (sim.fluid.position, sim.fluid.velocity, sim.nodes.position)])

    sim = struck(2, kind)
    for _ in range(5):
        sim.step()
    sim.checkpoint(tmp_path / "half.cairn")
    for _ in range(5):
        sim.step()
    other = struck(2, kind, threads=2)
    for _ in range(10):
        other.step()
    assert np.array_equal(state(sim), state(other))
    again = struck(2, kind)
    again.restore(tmp_path / "half.cairn")
    for _ in range(5):
        again.step()
    assert np.array_equal(state(sim), state(again))


def test_units_leave_all_bits():
    def run(length, mass, time):
        points, cells = grid((0.0, 0.0), (0.2 * length, 0.4 * length), (4, 8))
        stress, density = mass / length / time**2, mass / length**3
        body = cn.ElasticBody(points, cells, young=1e5 * stress, poisson=0.3, density=1200.0 * density, thickness=length)
        scene = cn.Scene(dim=2, depth=length)
        scene.add(cn.deformable(body, rubber, name="block"))
        region = np.array([(-0.2, 0.1), (0.0, 0.3)]) * length
        liquid = {"density": 1000.0 * density, "viscosity": 0.5 * stress * time, "sound_speed": 15.0 * length / time}
        velocity = np.array([1.0, 0.3]) * length / time
        scene.add(cn.fluid(region, 0.05 * length, velocity=velocity, pressure=0.0, **liquid))
        scene.interact("*", "*", None)
        sim = cn.Simulation(scene, dt=2e-3 * time)
        for _ in range(6):
            sim.step()
        return np.asarray(sim.fluid.position) / length, np.asarray(sim.nodes.velocity) * time / length

    one, two = run(1.0, 1.0, 1.0), run(4.0, 0.5, 2.0)
    assert all(np.array_equal(a, b) for a, b in zip(one, two))


def test_bodies_that_come_and_go():
    sim = plated(young=1e8)
    for _ in range(3):
        sim.step()
    with pytest.raises(ValueError, match="particles of the liquid lie in the bodies"):
        sim.add(*block((0.4, 0.2), (0.2, 0.2), (2, 2), name="raft"))
    sim.add(*block((0.4, 0.56), (0.2, 0.2), (2, 2), name="raft"))
    for _ in range(3):
        sim.step()
    assert sim.fluid.forces_on_mesh("raft").shape == (9, 2)
    raft = next(mesh for mesh in sim.meshes if mesh.name == "raft")
    sim.remove(raft.all_ids)
    sim.step()
    assert np.isfinite(sim.fluid.velocity).all()


def test_errors_name_the_body_and_the_remedy():
    def scene_with(sets, rule=True, **options):
        scene = cn.Scene(dim=2, gravity=(0.0, -1.0))
        scene.add(sets)
        scene.add(cn.fluid([(-0.3, 0.0), (0.0, 0.3)], 0.05, **{"sound_speed": 10.0, **options}))
        scene.interact("*", "*", None)
        if rule is not True:
            scene.interact("fluid", "block", rule)
        return scene

    def sets(**options):
        return block((0.0, 0.0), (0.2, 0.2), (2, 2), **options)

    with pytest.raises(ValueError, match="theta-method of NSCD, and Newmark"):
        cn.Simulation(scene_with(sets()), dt=1e-3, strategy=cn.NSCD(integrator=cn.Newmark()))
    with pytest.raises(ValueError, match="2 m thick"):
        cn.Simulation(scene_with(sets(thickness=2.0)), dt=1e-3)
    with pytest.raises(ValueError, match="drag by porosity is that of rigid grains"):
        cn.Simulation(scene_with(sets(), cn.GrainDrag()), dt=1e-3)
    bare = cn.LinearBody([(0.0, 0.0), (0.1, 0.0)], np.eye(4), np.eye(4))
    with pytest.raises(ValueError, match="sides of 'block'.*flows through"):
        cn.Simulation(scene_with(cn.deformable(bare, rubber, name="block")), dt=1e-3)
    sim = cn.Simulation(scene_with(sets()), dt=1e-3)
    with pytest.raises(ValueError, match="theta-method"):
        sim.strategy = cn.NSCD(integrator=cn.Newmark())
        sim.step()
    sim = cn.Simulation(scene_with(sets(), None), dt=1e-3, strategy=cn.NSCD(integrator=cn.Newmark()))
    sim.step()  # flows through
    assert not sim.fluid.forces_on_mesh("block").any()
    with pytest.raises(ValueError, match="no deformable body 'gate'; there is 'block'"):
        sim.fluid.forces_on_mesh("gate")


def test_thin_bodies_with_edges_in_the_liquid_are_told():
    def simulation(thick, **options):
        scene = cn.Scene(dim=2, gravity=(0.0, -9.81))
        scene.add(block((0.0, 0.2), (0.5, thick), (10, 1), fixed=lambda x: x[:, 0] < 1e-9))
        scene.add(*(cn.wall(at, normal, rock) for at, normal in (((0, 0), (0, 1)), ((0, 0), (1, 0)), ((1, 0), (-1, 0)))))
        scene.add(cn.fluid([(0, 0), (1, 0.6)], 0.05, 1000.0, **options))
        return cn.Simulation(scene, dt=1e-3)

    with pytest.warns(FluidWarning, match="is 0.1 m thick, under 3 spacings"):
        simulation(0.1)
    with warnings.catch_warnings():
        warnings.simplefilter("error", FluidWarning)
        simulation(0.1, artificial=0.1)
        simulation(0.2)
