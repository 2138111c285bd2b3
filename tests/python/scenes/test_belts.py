"""Surface velocities: belts, rollers and drums that move grains by friction while their bodies stay where they are."""

import cairn as cn
import numpy as np
import pytest

G, MU, SPEED = 9.81, 0.4, 1.5
ROCK = cn.Material("rock", density=2600.0)
SMOOTH = cn.LinearSpring(stiffness=1e6, restitution=0.2, mu=MU)


def rectangles(centers, sizes, **options):
    half = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * np.array(sizes) / 2
    return cn.polygons(half, ROCK, position=np.array(centers, float), **options)


def brick(dim, size=0.1, at=0.0, **options):
    """A cube (a square in 2D) of a half edge that stands on the plane y = 0, z = 0 in 3D."""
    if dim == 2:
        return rectangles([[at, size]], (2 * size, 2 * size), **options)
    return cn.boxes([[at, 0.0, size]], (2 * size,) * 3, ROCK, **options)


def ground(dim, at=0.0, **options):
    point = (at, 0.0) if dim == 2 else (at, 0.0, 0.0)
    return cn.wall(point, (0, 1) if dim == 2 else (0, 0, 1), ROCK, **options)


def scene_of(dim, *sets, law=None, gravity=G):
    scene = cn.Scene(dim=dim, gravity=(0.0,) * (dim - 1) + (-gravity,))
    for s in sets:
        scene.add(s)
    scene.interact(ROCK, ROCK, law or cn.Coulomb(mu=MU))
    return scene


def along(dim, speed):
    return (speed, 0.0) if dim == 2 else (speed, 0.0, 0.0)


def balance(sim):
    """Error of the energy balance over the energy in play."""
    e = sim.info["energy"]
    return abs(e["closure"]) / max(e["in_play"], 1e-300)


EXACT = cn.NSCD(solver=cn.NLGS(tol=1e-10, max_iter=20000))
LAWS = {
    "Coulomb": cn.Coulomb(mu=MU), "Restitution": cn.Restitution(mu=MU), "GapCoulomb": cn.GapCoulomb(mu=MU),
    "UnilateralContact": cn.UnilateralContact(mu=MU), "Rolling": cn.Rolling(mu=MU, rolling=0.1),
    "Bonded": cn.Bonded(mu=MU), "MohrCoulomb": cn.MohrCoulomb(tension=0.0, cohesion=0.0, mu=MU),
    "ElasticContact": cn.ElasticContact(stiffness=1e8, mu=MU), "LimitedSlip": cn.LimitedSlip(mu=MU, limit=1e9),
    "MAC": cn.MAC(normal_stiffness=1e12, tangential_stiffness=1e12, work=0.1, mu=MU), "GapRescue": cn.GapRescue(mu=MU),
    "Wear": cn.Wear(mu=MU, wear=0.0), "Wet": cn.Wet(force=0.0, reach=0.0, mu=MU),
}  # fmt: skip


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("name", LAWS)
def test_a_box_reaches_the_speed_of_its_belt(dim, name):
    # apart from the belt when the run begins, since laws with bonds hold bodies that touch then
    h, apart = 1e-3, 1e-6 if name in ("Bonded", "MohrCoulomb", "MAC") else 0.0
    box = brick(dim)
    box.position[:, dim - 1] += apart
    sim = cn.Simulation(scene_of(dim, box, ground(dim, surface_velocity=along(dim, SPEED)), law=LAWS[name]), dt=h, strategy=EXACT)
    until = SPEED / (MU * G)
    for _ in range(round(0.5 * until / h)):
        sim.step()
    assert abs(sim.bodies.velocity[0, 0] - MU * G * sim.time) < 0.01 * SPEED
    for _ in range(round(0.6 * until / h)):
        sim.step()
    assert abs(sim.bodies.velocity[0, 0] - SPEED) < 1e-6 * SPEED
    assert np.abs(sim.bodies.velocity[0, 1:]).max() < 1e-6 * SPEED
    assert np.array_equal(sim.bodies.velocity[1], np.zeros(3 * dim - 3))
    # the belt gives m v^2: half of it is the box's, half is lost to friction
    energy = sim.info["energy"]
    assert abs(energy["work_driven"] - sim.bodies.mass[0] * SPEED**2) < 0.01 * sim.bodies.mass[0] * SPEED**2
    assert abs(energy["dissipated_friction"] - 0.5 * sim.bodies.mass[0] * SPEED**2) < 0.01 * sim.bodies.mass[0] * SPEED**2
    assert balance(sim) < 1e-9


@pytest.mark.parametrize("dim", [2, 3])
def test_without_friction_a_belt_does_nothing(dim):
    ends = []
    for given in ({}, {"surface_velocity": along(dim, SPEED)}):
        sim = cn.Simulation(scene_of(dim, brick(dim), ground(dim, **given), law=cn.Coulomb(mu=0.0)), dt=1e-3)
        for _ in range(20):
            sim.step()
        ends.append(np.concatenate([sim.bodies.position.ravel(), sim.bodies.velocity.ravel()]))
    assert np.array_equal(*ends)


@pytest.mark.parametrize("dim", [2, 3])
def test_smooth_spheres_ride_on_belts(dim):
    make = cn.disks if dim == 2 else cn.spheres
    place = [[0.0, 0.1]] if dim == 2 else [[0.0, 0.0, 0.1]]
    grain = make(place, 0.1, ROCK, driven=("w",) if dim == 2 else ("wx", "wy", "wz"))  # it slides and does not roll
    scene = scene_of(dim, grain, ground(dim, surface_velocity=along(dim, SPEED)), law=SMOOTH)
    sim = cn.Simulation(scene, dt=1e-4, strategy=cn.SmoothDEM())
    until, mass = SPEED / (MU * G), sim.bodies.mass[0]
    for _ in range(round(0.5 * until / 1e-4)):
        sim.step()
    assert abs(sim.bodies.velocity[0, 0] - MU * G * sim.time) < 0.02 * SPEED
    for _ in range(round(0.7 * until / 1e-4)):
        sim.step()
    assert abs(sim.bodies.velocity[0, 0] - SPEED) < 0.01 * SPEED
    energy = sim.info["energy"]
    assert abs(energy["work_driven"] - mass * SPEED**2) < 0.03 * mass * SPEED**2
    assert abs(energy["closure"]) < 0.01 * energy["in_play"]


def drum(dim, turning, surface, law, strategy, h, steps, threads=1):
    """Grains in a round drum that turns, or whose surface turns."""
    rng = np.random.default_rng(3)
    grid = np.array([(i, k) for i in range(-3, 4) for k in range(-3, 4)]) * 0.13
    places = grid if dim == 2 else np.column_stack((grid[:, 0], np.zeros(len(grid)), grid[:, 1]))
    places = places + rng.uniform(-0.005, 0.005, places.shape)
    spin = (0.0, 0.0, 2.0) if dim == 2 else (0.0, 0.0, 0.0, 0.0, -2.0, 0.0)
    given = {"velocity": spin} if turning else {}
    given |= {"surface_velocity": spin} if surface else {}
    shell = cn.ring((0, 0), 0.62, ROCK, **given) if dim == 2 else cn.tube((0, 0, 0), (0, 1, 0), 0.62, ROCK, **given)
    scene = scene_of(dim, (cn.disks if dim == 2 else cn.spheres)(places, 0.06, ROCK), shell, law=law)
    sim = cn.Simulation(scene, dt=h, strategy=strategy)
    for _ in range(steps):
        sim.step()
    return sim


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("law", [cn.Coulomb(mu=0.6), cn.Rolling(mu=0.6, rolling=0.1, twisting=0.05)], ids=["Coulomb", "Rolling"])
def test_a_drum_whose_surface_turns_moves_grains_as_one_that_turns(dim, law):
    turns, belt, rests = (drum(dim, *how, law, EXACT, 2e-3, 80) for how in ((True, False), (False, True), (False, False)))
    grains = slice(0, 49)
    scale = np.abs(turns.bodies.velocity[grains, 0] - rests.bodies.velocity[grains, 0]).max()
    assert scale > 0.1
    assert np.abs(turns.bodies.velocity[grains] - belt.bodies.velocity[grains])[:, :dim].max() < 1e-4 * scale
    for one, other in (("work_driven", "work_driven"), ("dissipated_friction", "dissipated_friction")):
        a, b = turns.info["energy"][one], belt.info["energy"][other]
        assert abs(a - b) < 1e-4 * abs(a) and abs(a) > 0
    assert balance(belt) < 1e-9


@pytest.mark.parametrize("dim", [2, 3])
def test_a_smooth_drum_whose_surface_turns_moves_grains_as_one_that_turns(dim):
    ways = ((True, False), (False, True), (False, False))
    turns, belt, rests = (drum(dim, *how, SMOOTH, cn.SmoothDEM(), 1e-4, 1500) for how in ways)
    grains = slice(0, 49)
    scale = np.abs(turns.bodies.velocity[grains, 0] - rests.bodies.velocity[grains, 0]).max()
    assert scale > 0.01
    assert np.abs(turns.bodies.velocity[grains] - belt.bodies.velocity[grains])[:, :dim].max() < 1e-4 * scale


def on_roller(dim, smooth, surface, periodic):
    """A grain dropped beside the top of a roller that turns, or whose surface turns; across a periodic boundary or not."""
    spin = (0, 0, -4.0) if dim == 2 else (0, 0, 0, 0, 4.0, 0)
    given = {"surface_velocity": spin, "driven": cn.model.bodies.DOFS[dim]}
    if not surface:
        given = {"driven": cn.model.bodies.DOFS[dim], "drive": spin, "velocity": [spin]}
    flat = np.array([[0.05 if periodic else 2.05, 0.0], [1.93, 0.205]])
    places = flat if dim == 2 else np.column_stack((flat[:, 0], [0.0, 0.03], flat[:, 1]))
    make = cn.disks if dim == 2 else cn.spheres
    cell = {"periodic": cn.Periodic((2.0,) + (np.inf,) * (dim - 1))} if periodic else {}
    scene = cn.Scene(dim=dim, gravity=(0.0,) * (dim - 1) + (-G,), **cell)
    scene.add(make(places[:1], 0.13, ROCK, **given), make(places[1:], 0.1, ROCK))
    scene.interact(ROCK, ROCK, SMOOTH if smooth else cn.Coulomb(mu=MU))
    sim = cn.Simulation(scene, dt=1e-4 if smooth else 1e-3, strategy=cn.SmoothDEM() if smooth else EXACT, overlap="ignore")
    for _ in range(600 if smooth else 60):
        sim.step()
    return sim


@pytest.mark.parametrize("smooth", [False, True], ids=["NSCD", "SmoothDEM"])
@pytest.mark.parametrize("dim", [2, 3])
def test_a_roller_of_balls_and_across_a_periodic_boundary(dim, smooth):
    turns, belt, around = (on_roller(dim, smooth, *how) for how in ((False, False), (True, False), (True, True)))
    v = turns.bodies.velocity[1]
    assert abs(v[2 if dim == 2 else 4]) > 0.1  # it is spun
    for sim in (belt, around):
        assert np.abs(sim.bodies.velocity[1] - v).max() < 1e-6 * np.abs(v).max()
        work, given = (s.info["energy"]["work_driven"] for s in (sim, turns))
        assert abs(work - given) < (1e-2 if smooth else 1e-6) * abs(given)  # in SmoothDEM quadratures of first and second order


def test_an_axis_away_from_the_centre():
    # a shell of eight flat boxes, all turning about the origin: each pushes along its own tangent
    angles = np.arange(8) * np.pi / 4
    centres = np.column_stack((np.cos(angles), np.sin(angles)))
    shell = rectangles(
        centres, (0.1, 0.9), rotation=angles, fixed=True, surface_velocity=(0.0, 0.0, 3.0), surface_origin=(0.0, 0.0)
    )
    sim = cn.Simulation(scene_of(2, shell), dt=1e-3)
    sim.step()
    assert np.allclose(sim.bodies.surface_velocity, [[0.0, 3.0, 3.0]] * 8, atol=1e-14)  # in the axes of each body
    plate = cn.boxes([[2.0, 1.0, -0.5]], (9.0, 9.0, 1.0), ROCK, fixed=True,
                     surface_velocity=(0, 0, 0, 0, 0, 2.0), surface_origin=(0.0, 0.0, 7.0))  # fmt: skip
    boxes = [brick(3, 0.05, at) for at in (0.0, 1.0, 2.0)]
    sim = cn.Simulation(scene_of(3, *boxes, plate), dt=1e-3)
    for _ in range(10):
        sim.step()
    v = sim.bodies.velocity[:3, :2]
    assert np.abs(v[0]).max() < 1e-3 * MU * G * sim.time
    assert np.allclose(v[1:], [[0.0, MU * G * sim.time]] * 2, atol=0.03 * MU * G * sim.time)


def test_the_vector_turns_with_the_body_and_comes_in_axes_of_space():
    # an inclined belt, and a belt on a table that has turned by a quarter
    turn = 0.3
    along_it = np.array([np.cos(turn), np.sin(turn)]) * SPEED
    belt = rectangles([[0.0, 0.0]], (4.0, 0.2), rotation=[turn], fixed=True, surface_velocity=along_it)
    sim = cn.Simulation(scene_of(2, belt), dt=1e-3)
    sim.step()
    assert np.allclose(sim.bodies.surface_velocity[0], [SPEED, 0.0, 0.0], atol=1e-15)
    axis = np.array([1.0, 2.0, -0.5]) / np.linalg.norm([1.0, 2.0, -0.5])
    q = np.append(np.cos(0.4), np.sin(0.4) * axis)
    given = np.array([0.3, -0.2, 0.7, 1.1, 0.4, -0.6])
    body = cn.boxes([[0, 0, 0]], (1, 2, 3), ROCK, rotation=[q], fixed=True, surface_velocity=given)
    sim = cn.Simulation(scene_of(3, body), dt=1e-3)
    sim.step()
    own, v = sim.bodies.surface_velocity[0], sim.bodies.rotation[0]
    turned = [a + 2 * np.cross(v[1:], np.cross(v[1:], a) + v[0] * a) for a in (own[:3], own[3:])]
    assert np.allclose(np.concatenate(turned), given, atol=1e-14)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_free_body_with_a_belt_is_pushed_back(dim):
    # a tracked vehicle on ice: the block on its belt goes forward, it goes backward, momentum and energy are kept
    size = (4.0, 0.4) if dim == 2 else (4.0, 1.0, 0.4)
    middle = [[0.0, -0.2]] if dim == 2 else [[0.0, 0.0, -0.2]]
    given = {"group": "belt", "surface_velocity": along(dim, SPEED)}
    belt = rectangles(middle, size, **given) if dim == 2 else cn.boxes(middle, size, ROCK, **given)
    ice = cn.wall((0, -0.4) if dim == 2 else (0, 0, -0.4), (0, 1) if dim == 2 else (0, 0, 1), ROCK, group="ice")
    scene = scene_of(dim, brick(dim), belt, ice)
    scene.interact("belt", "ice", cn.Coulomb(mu=0.0))
    sim = cn.Simulation(scene, dt=1e-3)
    for _ in range(450):
        sim.step()
    m, v = sim.bodies.mass[:2], sim.bodies.velocity[:2, 0]
    assert abs(v[0] - v[1] - SPEED) < 1e-6 * SPEED and v[1] < 0
    assert abs(m @ v) < 1e-9 * m[0] * SPEED
    given = m[0] * m[1] / m.sum() * SPEED**2  # reduced mass times the square of the relative speed
    assert abs(sim.info["energy"]["work_driven"] - given) < 0.01 * given
    assert balance(sim) < 1e-9


def test_a_driven_body_adds_its_own_velocity():
    sim = cn.Simulation(scene_of(2, brick(2), ground(2, velocity=(0.5, 0.0), surface_velocity=(SPEED, 0.0))), dt=1e-3)
    for _ in range(600):
        sim.step()
    assert abs(sim.bodies.velocity[0, 0] - SPEED - 0.5) < 1e-6


def test_the_normal_part_does_not_act():
    sim = cn.Simulation(scene_of(2, brick(2), ground(2, surface_velocity=(0.0, 50.0))), dt=1e-3)
    for _ in range(20):
        sim.step()
    assert np.abs(sim.bodies.velocity).max() < 1e-9


def test_a_function_of_time():
    scene = scene_of(2, brick(2), ground(2, surface_velocity=cn.Table([0.0, 1.0], [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])))
    sim = cn.Simulation(scene, dt=1e-3)
    for _ in range(500):
        sim.step()
    assert abs(sim.bodies.velocity[0, 0] - 0.5) < 1e-6


@pytest.mark.parametrize("strategy", [cn.NSCD(), cn.SmoothDEM()], ids=["NSCD", "SmoothDEM"])
def test_restart_and_scene_files_keep_belts(tmp_path, strategy):
    smooth = isinstance(strategy, cn.SmoothDEM)
    law, h = (SMOOTH, 2e-5) if smooth else (None, 1e-3)

    def scene():
        later = cn.Table([0.0, 1.0], [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
        grains = cn.disks([[0.0, 0.1], [5.0, 0.1]], 0.1, ROCK)
        belts = [
            cn.segment((x - 1, 0), (x + 1, 0), ROCK, surface_velocity=v, surface_origin=(x, -3.0))
            for x, v in ((0.0, (0, 0, -0.4)), (5.0, later))
        ]
        return scene_of(2, grains, *belts, law=law)

    whole = cn.Simulation(scene(), dt=h, strategy=strategy)
    whole.add(cn.segment((9, 0), (11, 0), ROCK, surface_velocity=(1.0, 0.0)), cn.disks([[10.0, 0.1]], 0.1, ROCK))
    for _ in range(40):
        whole.step()
    whole.checkpoint(tmp_path / "half.h5")
    for _ in range(40):
        whole.step()
    part = cn.Simulation(scene(), dt=h, strategy=strategy)
    part.restore(tmp_path / "half.h5")
    for _ in range(40):
        part.step()
    assert np.array_equal(whole.bodies.velocity, part.bodies.velocity) and np.abs(whole.bodies.velocity[:2, 0]).min() > 0
    assert whole.bodies.velocity[-1, 0] > 0
    scene().save(tmp_path / "scene.h5")
    again, first = (cn.Simulation(s, dt=h, strategy=strategy) for s in (cn.Scene.load(tmp_path / "scene.h5"), scene()))
    for _ in range(20):
        again.step()
        first.step()
    assert np.array_equal(again.bodies.velocity, first.bodies.velocity)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("size, speed, at", [(0.1, 1e6, 0.0), (1e-9, 1e-3, 0.0), (0.125, 1.5, 2.0**30), (1e6, 1e3, 0.0)])
def test_extremes(dim, size, speed, at):
    h = np.sqrt(size / G) * 0.02
    sim = cn.Simulation(scene_of(dim, brick(dim, size, at), ground(dim, at, surface_velocity=along(dim, speed))), dt=h)
    for _ in range(20):
        sim.step()
    expected = min(speed, MU * G * sim.time)
    assert np.isfinite(sim.bodies.velocity).all()
    assert abs(sim.bodies.velocity[0, 0] - expected) < 0.05 * expected
    assert balance(sim) < 1e-6


def test_bits_do_not_depend_on_threads_or_units():
    one, two = (drum(3, False, True, cn.Coulomb(mu=0.6), cn.NSCD(solver=cn.NLGS(), threads=k), 2e-3, 30) for k in (1, 2))
    assert np.array_equal(one.bodies.velocity, two.bodies.velocity)
    ends = []
    for scale in (1.0, 2.0**20):
        box, plane = brick(2, 0.125 * scale), ground(2, surface_velocity=(1.5 * scale, 0.0))
        sim = cn.Simulation(scene_of(2, box, plane, gravity=8.0 * scale), dt=1e-3)
        for _ in range(30):
            sim.step()
        ends.append(sim.bodies.velocity[0] / [scale, scale, 1.0])
    assert np.array_equal(*ends)


STIFF = {"normal_stiffness": 1e10, "tangential_stiffness": 1e10, "mu": MU}


@pytest.mark.parametrize("shape", ["box", "disk"])
@pytest.mark.parametrize(
    "law",
    [cn.Bonded(mu=MU), cn.MohrCoulomb(tension=1e6, cohesion=1e6, mu=MU), cn.MAC(work=10.0, **STIFF), cn.ParallelBond(**STIFF)],
    ids=lambda law: type(law).__name__,
)
def test_sound_bonds_hold_bodies_and_not_surfaces(law, shape):
    belt = rectangles([[0.0, -0.1]], (4.0, 0.2), fixed=True, surface_velocity=(SPEED, 0.0))
    stone = brick(2) if shape == "box" else cn.disks([[0.0, 0.1]], 0.1, ROCK)
    sim = cn.Simulation(scene_of(2, stone, belt, law=law), dt=1e-3)
    for _ in range(50):
        sim.step()
    assert np.abs(sim.bodies.velocity[0]).max() < 1e-6
    assert abs(sim.bodies.position[0, 0]) < 1e-7 and sim.info["energy"]["work_driven"] == 0


def test_meshes_ride_on_belts():
    points = np.array([[x, y] for y in (0.0, 0.2) for x in (0.0, 0.2)])
    body = cn.ElasticBody(points, {"quad": [[0, 1, 3, 2]]}, young=1e8, poisson=0.3, density=2600.0)
    scene = scene_of(2, ground(2, surface_velocity=(SPEED, 0.0)))
    scene.add(cn.deformable(body, ROCK, contact=np.arange(4)))
    sim = cn.Simulation(scene, dt=1e-3)
    speeds = []
    for _ in range(450):
        sim.step()
        speeds.append(sim.nodes.velocity[:, 0].mean())
    # nothing damps the block: it vibrates by 2e-3 of the speed about that of the belt
    assert abs(np.mean(speeds[-50:]) - SPEED) < 2e-4 * SPEED


def test_what_cannot_be_is_refused():
    with pytest.raises(ValueError, match="surface_origin is given without surface_velocity"):
        ground(2, surface_origin=(0, 0))
    with pytest.raises(ValueError, match=r"surface_velocity has shape \(4,\)"):
        ground(2, surface_velocity=(0, 0, 0, 0))
    with pytest.raises(ValueError, match=r"surface_origin has shape \(3,\): give \(2,\) or \(1, 2\)"):
        ground(2, surface_velocity=(0, 0, 1), surface_origin=(0, 0, 0))
    with pytest.raises(ValueError, match="surface_velocity.*finite"):
        ground(2, surface_velocity=(np.inf, 0))
    with pytest.raises(ValueError, match="surface_velocity.*too large"):
        ground(2, surface_velocity=(1e200, 0))
    sim = cn.Simulation(scene_of(2, brick(2, surface_velocity=(1, 0))), dt=1e-3)
    corners = [[-0.1, 0.0], [0.1, 0.0], [0.1, 0.2], [-0.1, 0.2]]
    with pytest.raises(ValueError, match="body 0 has a surface velocity, which a deformable body cannot have"):
        sim.deform(0, cn.ElasticBody(corners, {"quad": [[0, 1, 2, 3]]}, young=1e6, poisson=0.3, density=2600.0))
    scene = scene_of(2, cn.disks([[0, 0.1]], 0.1, ROCK), ground(2, surface_velocity=(1, 0)), law=cn.Restitution(mu=0.3))
    with pytest.raises(ValueError, match="has a surface velocity, which EventDriven does not know"):
        cn.Simulation(scene, dt=1e-3, strategy=cn.strategy("EventDriven")).step()


def test_explain_tells_belts_and_scenes_without_store_none():
    sim = cn.Simulation(scene_of(2, brick(2), ground(2)), dt=1e-3)
    sim.step()
    assert "surface_velocity" not in sim.bodies.names and "Surfaces that move" not in sim.explain()
    sim = cn.Simulation(scene_of(2, brick(2), ground(2, surface_velocity=(-1.5, 0.0))), dt=1e-3)
    assert "Surfaces that move along their bodies: 1, by up to 1.5 m/s and 0 rad/s" in sim.explain()
