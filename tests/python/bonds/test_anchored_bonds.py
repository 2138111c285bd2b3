"""Bonds of bodies with sides hold at material points: they outlive what detection calls the points of a face."""

import warnings

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=2000.0)
CLAY = cn.Material("clay", density=2000.0, expansion=1e-5, conductivity=1.0, capacity=1000.0, young=1e10, poisson=0.2)
FACES = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
SHARP = cn.NLGS(tol=1e-12, max_iter=20000)
BRICK = np.array([[-0.1, -0.03], [0.1, -0.03], [0.1, 0.03], [-0.1, 0.03]])
BOX = np.array([[x, y, z] for z in (-0.03, 0.03) for x, y in ((-0.1, -0.05), (0.1, -0.05), (0.1, 0.05), (-0.1, 0.05))])


def mortar(**changes):
    values = dict(normal_stiffness=1e10, tangential_stiffness=1e10, mu=0.5, normal_strength=3e5, tangential_strength=3e5,
                  normal_work=50.0, tangential_work=50.0)  # fmt: skip
    return cn.MAL(**{**values, **changes})


def pair(dim, law, *, material=ROCK, velocity=None, shift=0.0):
    """A brick on a brick, half a brick apart along x."""
    scene = cn.Scene(dim)
    centres = np.array([[0.0, 0.0], [0.1 + shift, 0.06]])
    if dim == 2:
        scene.add(cn.polygons([x + BRICK for x in centres], material, velocity=velocity, group="bricks"))
    else:
        hulls = [(np.array([x[0], 0.0, x[1]]) + BOX, FACES) for x in centres]
        scene.add(cn.polyhedra(hulls, material, velocity=velocity, group="bricks"))
    scene.interact("*", "*", law)
    return scene


def simulate(scene, dt):
    return cn.Simulation(scene, dt, cn.NSCD(solver=SHARP), overlap="ignore")


def spinning(dim, rate):
    """Velocities of two bricks that turn as one body about their common centre."""
    spin = np.array([0.0, 0.0, rate]) if dim == 2 else np.array([0.4, 1.0, 0.7]) * rate
    arm = np.array([[-0.05, -0.03, 0.0], [0.05, 0.03, 0.0]]) if dim == 2 else np.array([[-0.05, 0.0, -0.03], [0.05, 0.0, 0.03]])
    linear = np.cross(spin, arm)
    return np.c_[linear[:, :2], [spin[2]] * 2] if dim == 2 else np.c_[linear, np.tile(spin, (2, 1))]


@pytest.mark.parametrize("dim", [2, 3])
def test_a_bonded_pair_that_tumbles_keeps_its_bonds_and_its_energy(dim):
    """Several turns in free flight: no bond is lost, stored energy stays what the spin asks for, nothing is released."""
    sim = simulate(pair(dim, mortar(), velocity=spinning(dim, 12.0)), 2e-4)
    sim.step()
    points = len(sim.contacts.beta)
    assert points == (2 if dim == 2 else 4) and np.all(sim.contacts.beta == 1)
    names, energy = sorted(map(tuple, sim.contacts.key.tolist())), []
    for _ in range(3000):
        report = sim.step()
        assert report["status"] == "converged"
        energy.append(sim.info["energy"]["kinetic"] + sim.info["energy"]["stored"])
    assert sorted(map(tuple, sim.contacts.key.tolist())) == names
    assert np.all(sim.contacts.beta == 1) and sim.info["energy"]["released"] == 0
    assert np.ptp(energy) < 2e-3 * energy[0]
    assert abs(sim.info["energy"]["closure"]) < 1e-10 * sim.info["energy"]["in_play"]
    apart = np.abs(sim.contacts.gap).max()
    assert apart < 3e5 / 1e10  # less than at the strength


def test_a_bond_outlives_the_slip_that_takes_its_corner_off_the_face():
    """A brick flush with the other: as it slides outwards detection names other corners, the bond stays."""
    law = mortar(tangential_stiffness=1e7, tangential_strength=1e5, tangential_work=2000.0, normal_stiffness=1e9)
    sim = simulate(pair(2, law, velocity=[[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]], shift=-0.1), 2e-5)
    sim.step()
    assert sorted(sim.contacts.beta) == [1, 1]
    slipped = 0.0
    for _ in range(1250):
        sim.step()
        assert len(sim.contacts.beta) == 2 and np.all(sim.contacts.beta > 0)
        slipped = max(slipped, np.abs(sim.bodies.position[1, 0] - sim.bodies.position[0, 0]))
    assert slipped > 4e-3
    energy = sim.info["energy"]
    held = energy["kinetic"] + energy["stored"] + energy["released"] + energy["dissipated_normal"]
    assert held + energy["dissipated_friction"] == pytest.approx(0.5 * 24.0 * 4.0, rel=1e-10)
    assert abs(energy["dissipated_normal"]) + abs(energy["dissipated_friction"]) < 0.05 * held


@pytest.mark.parametrize("dim", [2, 3])
def test_bricks_that_bend_alike_strain_no_joint(dim):
    """A gradient of temperature that is the same in both bends the pair as one body: the joint feels nothing, all the time."""
    scene = pair(dim, mortar(), material=CLAY)
    along = (0.0, 1.0) if dim == 2 else (0.0, 0.0, 1.0)
    period = 0.1
    names = {"bricks": lambda t: 3000.0 * np.array(along) * np.sin(2 * np.pi * t / period)}
    # the upper one is warmer by the gradient over the distance between them
    warm = [((0, 1), lambda t: 300.0 + 3000.0 * np.array([0.0, 0.06]) * np.sin(2 * np.pi * t / period))]
    scene.thermal(
        conductance=cn.networks.Constant(conductance=0.0), initial=300.0, reference=300.0, gradient=names, temperature=warm
    )
    sim = simulate(scene, 5e-4)
    points = None
    for _ in range(400):
        sim.step()
        points = points or len(sim.contacts.beta)
        assert len(sim.contacts.beta) == points and np.all(sim.contacts.beta == 1)
    assert points == (2 if dim == 2 else 4) and sim.info["energy"]["released"] == 0


def test_a_brick_that_bends_against_another_keeps_what_is_sound():
    """Bent by 0.2 mm over its length against a straight one, through a soft joint: opened, closed, and nothing is lost."""
    law = mortar(normal_stiffness=2e8, tangential_stiffness=2e8, normal_strength=1e6, tangential_strength=1e6, normal_work=1e4,
                 tangential_work=1e4)  # fmt: skip
    scene = pair(2, law, material=CLAY, shift=-0.1)
    scene.thermal(
        conductance=cn.networks.Constant(conductance=0.0),
        initial=300.0,
        reference=300.0,
        gradient={(1,): lambda t: (0.0, 20000.0 * np.sin(20 * np.pi * t) ** 2)},
    )
    sim = simulate(scene, 1e-4)
    opened = 0.0
    for _ in range(1000):
        sim.step()
        assert len(sim.contacts.beta) == 2 and np.all(sim.contacts.beta == 1)
        opened = max(opened, sim.info["energy"]["stored"])
    assert opened > 0 and sim.info["energy"]["released"] == 0


def test_what_breaks_is_a_contact_again_and_keeps_what_it_released():
    """A brick tilts off another: the bond breaks at the far end and holds at the near end; the broken bond is a contact."""
    law = mortar(normal_work=5.0, tangential_work=5.0)
    sim = simulate(pair(2, law, velocity=[[0.0, 0.0, 0.0], [0.0, 0.0, 8.0]]), 2e-6)
    before, spent = {}, 0.0
    for _ in range(600):
        sim.step()
        for key, beta in zip(map(tuple, sim.contacts.key.tolist()), sim.contacts.beta):
            assert beta <= before.get(key, 1.0)
            before[key] = beta
        spent = sim.info["energy"]["released"]
        if sim.contacts.beta.min() == 0:
            break
    assert 0 < spent
    assert sim.contacts.released.sum() == pytest.approx(spent, rel=1e-9)
    sim.step()
    assert sim.contacts.released.sum() == pytest.approx(sim.info["energy"]["released"], rel=1e-9)


@pytest.mark.parametrize("dim", [2, 3])
def test_restart_of_anchored_bonds_goes_on_to_the_same_bits(dim, tmp_path):
    def begun():
        return simulate(pair(dim, mortar(), velocity=spinning(dim, 80.0) * [[1.0], [0.97]]), 2e-5)

    once, half, again = begun(), begun(), begun()
    for _ in range(60):
        once.step()
    for _ in range(23):
        half.step()
    half.checkpoint(tmp_path / "half.h5")
    again.restore(tmp_path / "half.h5")
    for _ in range(37):
        again.step()
    assert np.array_equal(again.bodies.position, once.bodies.position)
    assert np.array_equal(again.bodies.velocity, once.bodies.velocity)
    assert np.array_equal(again.contacts.beta, once.contacts.beta)
    assert np.array_equal(again.contacts.key, once.contacts.key)


def test_a_rod_between_bricks_holds_its_two_points():
    """A rigid rod between a brick and a wall: its end keeps the distance though the brick swings and turns."""
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    scene.add(cn.polygons([BRICK + [0.0, -0.08]], ROCK, velocity=[[0.3, 0.0, 0.0]]))
    scene.add(cn.polygons([BRICK + [0.15, 0.0]], ROCK, fixed=True))
    scene.interact(ROCK, ROCK, cn.Rod(within=0.05))
    sim = simulate(scene, 1e-3)
    sim.step()
    first = sim.contacts.gap[sim.contacts.beta > 0]
    for _ in range(500):
        sim.step()
        gap = sim.contacts.gap[sim.contacts.beta > 0]
        assert len(gap) == len(first) and np.allclose(gap, first, rtol=1e-4)


def test_a_rod_without_a_length_is_an_error():
    with pytest.raises(ValueError, match="law Rod joins body 0 and body 1 at a gap of .* leave a gap"):
        simulate(pair(2, cn.Rod(within=0.05)), 1e-3).step()


@pytest.mark.parametrize(
    ("law", "told"),
    [
        (lambda: mortar(normal_work=4.0), "normal_work = 4 J/m2 is no more than the 4.5 J/m2 .* normal_strength = 300000"),
        (lambda: mortar(tangential_work=4.5), "tangential_work = 4.5"),
        (lambda: cn.MP3(normal_stiffness=1e10, tangential_stiffness=1e10, strength=3e5, work=1.0), "MP3: work = 1 J/m2"),
        (lambda: mortar(normal_work=cn.networks.OfTemperature((300.0, 900.0), (50.0, 2.0))), "normal_work = 2 J/m2"),
    ],
)
def test_a_work_less_than_what_is_stored_at_the_strength_is_an_error(law, told):
    with pytest.raises(ValueError, match=told):
        law()


def test_a_work_of_little_more_than_what_is_stored_is_spent_at_once():
    sim = simulate(pair(2, mortar(normal_work=4.51, tangential_work=4.51), velocity=[[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), 1e-6)
    for _ in range(60):
        sim.step()
    assert sim.contacts.beta.max(initial=0.0) == 0
    assert sim.info["energy"]["released"] == pytest.approx(4.51 * 0.1, rel=1e-3)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_brick_that_grows_on_another_shears_their_joint(dim):
    """Ends slip by a dT L/2 against each other, and across by a dT W/2: what the springs of the corners store."""
    law = mortar(normal_stiffness=2e8, tangential_stiffness=2e8, normal_strength=1e6, tangential_strength=1e6, normal_work=1e5,
                 tangential_work=1e5)  # fmt: skip
    scene = pair(dim, law, material=CLAY, shift=-0.1)
    warm = [((1,), lambda t: 300.0 + 100.0 * min(1.0, t / 0.05))]
    scene.thermal(conductance=cn.networks.Constant(conductance=0.0), initial=300.0, reference=300.0, temperature=warm)
    sim = cn.Simulation(scene, 5e-4, cn.NSCD(theta=1.0, solver=SHARP), overlap="ignore")
    for _ in range(150):
        assert sim.step()["status"] == "converged"
    slip = np.array([1e-3 * 0.1] if dim == 2 else [1e-3 * 0.1, 1e-3 * 0.05])
    area = 0.2 if dim == 2 else 0.2 * 0.1
    assert sim.info["energy"]["stored"] == pytest.approx(0.5 * 2e8 * area * slip @ slip, rel=0.02)


@pytest.mark.parametrize("dim, n", [(2, 3), (2, 4), (3, 3)])
def test_a_block_of_bricks_bonded_to_each_other_lies_still(dim, n):
    """Faces have several bonds and bricks form closed loops: the correction of drift in normal bonds alone grew without bound."""
    side, rock = 0.1, cn.Material("rock", density=2500.0)
    places = side * np.stack(np.meshgrid(*[np.arange(n)] * dim, indexing="ij"), axis=-1).reshape(-1, dim)
    scene, up = cn.Scene(dim=dim, gravity=(0.0,) * (dim - 1) + (-9.81,)), np.eye(dim)[-1]
    if dim == 2:
        square = side * np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
        scene.add(cn.polygons([square + x for x in places], rock, group="bricks"))
    else:
        scene.add(cn.boxes(places + [0, 0, side / 2], np.full((n**3, 3), side), rock, group="bricks"))
    scene.add(cn.wall((0.0,) * dim, up, cn.Material("floor")))
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    scene.interact("bricks", "bricks", cn.Bonded())
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(solver=cn.NLGS(tol=1e-4)))
    weight = sim.bodies.mass[:-1].sum() * 9.81 * sim.dt
    with warnings.catch_warnings():
        warnings.simplefilter("error", cn.EnergyCreatedWarning)
        for _ in range(150 if dim == 2 else 60):
            assert sim.step()["status"] == "converged"
    assert np.abs(sim.contacts.impulse).max() < 2 * weight
    assert np.abs(sim.bodies.velocity).max() < 1e-2 * 9.81 * sim.dt
    begin = places + (side / 2 if dim == 2 else [0, 0, side / 2])
    assert np.abs(sim.bodies.position[:-1] - begin).max() < 1e-5 * side


def cantilever(solver):
    """Ten squares, glued in a row, the first held to the world, under their weight."""
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    square = 0.05 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    squares = scene.add(cn.polygons([square + (0.1 * k, 0.0) for k in range(10)], ROCK))
    scene.interact(ROCK, ROCK, cn.Bonded())
    scene.join(squares[0], None, cn.Fixed(point=(0.0, 0.0)))
    return cn.Simulation(scene, 1e-3, cn.NSCD(solver=solver))


def test_places_are_not_swung_by_sweeps_that_end_early(tmp_path):
    """A correction of places that comes late is amplified: behind a step that did not converge there is none. A restart goes on
    to the same bits."""
    sim = cantilever(cn.NLGS(tol=1e-6, max_iter=300))
    early = 0
    for k in range(120):
        early += sim.step()["status"] != "converged"
        if k == 60:
            sim.checkpoint(tmp_path / "half.h5")
    assert early > 30
    assert np.abs(sim.bodies.position[:, 1]).max() < 0.05 and np.abs(sim.bodies.rotation).max() < 0.1
    again = cantilever(cn.NLGS(tol=1e-6, max_iter=300))
    again.restore(tmp_path / "half.h5")
    for _ in range(59):
        again.step()
    assert np.array_equal(again.bodies.position, sim.bodies.position)
    assert np.array_equal(again.contacts.impulse, sim.contacts.impulse)
    whole = cantilever(cn.Auto(tol=1e-6))
    for _ in range(120):
        assert whole.step()["status"] == "converged"
    assert np.abs(whole.bodies.position[:, 1]).max() < 1e-8
