"""SmoothDEM as a strategy: bits do not depend on list, threads or restart; refusals; state kept in a run."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=2500.0)


def heap(dim=3, count=6, law=None, strategy=None, dt=2e-5, speed=0.5, seed=1, **options):
    """Grains let fall into a corner of walls, turning."""
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(*[np.arange(count)] * dim, indexing="ij"), -1).reshape(-1, dim)
    r = 0.005 * (1 - 0.2 * rng.random(len(grid)))
    x = (grid + 0.5) * 0.0101 + 1e-4 * rng.random(grid.shape)
    v = speed * (rng.random((len(grid), 3 * dim - 3)) - 0.5)
    v[:, dim:] *= 100
    scene = cn.Scene(dim, gravity=-9.81 * np.eye(dim)[-1], **options)
    scene.add((cn.disks if dim == 2 else cn.spheres)(x, r, ROCK, velocity=v))
    for k in range(dim):
        scene.add(cn.wall(np.zeros(dim), np.eye(dim)[k], ROCK))
    scene.interact(ROCK, ROCK, law or cn.HertzMindlin(young=1e7, mu=0.5, restitution=0.5))
    return cn.Simulation(scene, dt, strategy or cn.SmoothDEM(), overlap="ignore")


def state(sim):
    names = ("position", "velocity", "contact_force")
    return [getattr(sim.bodies, name) for name in names] + [sim.contacts.impulse, sim.contacts.gap]


def same(a, b):
    return all(np.array_equal(x, y) for x, y in zip(state(a), state(b)))


@pytest.mark.parametrize("dim", [2, 3])
def test_bits_do_not_depend_on_the_age_of_the_list(dim):
    runs = [heap(dim, strategy=cn.SmoothDEM(skin=skin)) for skin in (2e-5, 1e-3, 8e-3)]
    for sim in runs:
        for _ in range(800):
            sim.step()
    made = [sim.info["neighbour_lists"] for sim in runs]
    assert made[0] > 3 * made[1] > 3 * made[2], made
    assert runs[0].info["contacts"] > 20
    assert same(runs[0], runs[1]) and same(runs[0], runs[2])


def test_bits_do_not_depend_on_threads():
    runs = [heap(count=18, strategy=cn.SmoothDEM(threads=threads)) for threads in (1, 2, 5)]
    for sim in runs:
        for _ in range(60):
            sim.step()
    assert len(runs[0].bodies) > 2 * 2048
    assert same(runs[0], runs[1]) and same(runs[0], runs[2])
    assert runs[0].energy == runs[1].energy == runs[2].energy


@pytest.mark.parametrize(
    "law", [None, cn.LinearSpring(stiffness=2e3, mu=0.4, restitution=0.6), cn.JKR(young=1e7, work=1.0, mu=0.3)]
)
def test_restart_goes_on_to_the_same_bits(tmp_path, law):
    half = heap(law=law, strategy=cn.SmoothDEM(renumber_every=70))
    whole = heap(law=law, strategy=cn.SmoothDEM(renumber_every=70))
    for _ in range(150):
        half.step()
    half.checkpoint(tmp_path / "half.h5")
    for _ in range(300):
        whole.step()
    second = heap(law=law, strategy=cn.SmoothDEM(renumber_every=70))
    second.restore(tmp_path / "half.h5")
    for _ in range(150):
        second.step()
    assert same(whole, second) and whole.energy == second.energy


def test_units_rescaled_by_powers_of_two():
    """Lengths by 2^-5, times by 2^3, masses by 2^7: the same motion to rounding."""
    one = heap(count=4, speed=3.0)
    length, time, mass = 2.0**-5, 2.0**3, 2.0**7
    scene = cn.Scene(3, gravity=(0, 0, -9.81 * length / time**2))
    rock = cn.Material("rock", density=2500.0 * mass / length**3)
    rate = np.repeat([length / time, 1 / time], 3)
    grains = len(one.bodies) - 3
    x, v = one.bodies.position[:grains], one.bodies.velocity[:grains]
    scene.add(cn.spheres(x * length, one.radii()[:grains] * length, rock, velocity=v * rate))
    for k in range(3):
        scene.add(cn.wall(np.zeros(3), np.eye(3)[k], rock))
    scene.interact(rock, rock, cn.HertzMindlin(young=1e7 * mass / length / time**2, mu=0.5, restitution=0.5))
    two = cn.Simulation(scene, one.dt * time, cn.SmoothDEM(), overlap="ignore")
    for _ in range(100):
        one.step()
        two.step()
    assert one.info["contacts"] > 10
    moved = two.bodies.position[:grains] / length - one.bodies.position[:grains]
    assert np.max(np.abs(moved)) < 1e-12 * 0.06


def test_step_beyond_the_stable_one_is_refused_or_warned_of():
    with pytest.raises(ValueError, match=r"dt is 0.01 s, beyond the stable step of .* give dt below it"):
        heap(dt=1e-2).step()
    sim = heap(dt=1e-2, strategy=cn.SmoothDEM(unstable="warn"))
    with pytest.warns(cn.StableStepWarning, match="stable step of the contacts"):
        sim.step()
    assert "Stable step" in heap().explain()


@pytest.mark.parametrize("share, stable", [(0.98, True), (1.02, False)])
def test_stable_step_is_where_a_pair_stops_being_stable(share, stable):
    """Two spheres on a linear spring, pressed together by a force: they ring below the limit 2/omega and part above it."""
    scene = cn.Scene(3)
    x = np.array([[0.0, 0, 0], [0.0099, 0, 0]])
    push = np.array([[0.5, 0, 0, 0, 0, 0], [-0.5, 0, 0, 0, 0, 0]])
    scene.add(cn.spheres(x, 0.005, ROCK, force=push))
    scene.interact(ROCK, ROCK, cn.LinearSpring(stiffness=1e4, ratio=0.0))
    sim = cn.Simulation(scene, 1e-9, cn.SmoothDEM(unstable="ignore"), overlap="ignore")
    sim.step()
    limit = sim.info["stable_step"]
    assert np.isclose(limit, 2 / np.sqrt(1e4 / (sim.bodies.mass[0] / 2)), rtol=1e-12)
    sim.dt = share * limit
    gaps = []
    for _ in range(400):
        sim.step()
        gaps.append(np.diff(sim.bodies.position[:, 0])[0] - 0.01)
    rest = -0.5 / 1e4  # where the spring holds the force
    assert bool(max(np.abs(np.array(gaps) - rest)) < 0.51e-4) is stable


@pytest.mark.parametrize(
    "law, strategy, words",
    [
        (cn.Coulomb(mu=0.3), cn.SmoothDEM(), "law Coulomb has no force .* give LinearSpring"),
        (cn.HertzMindlin(young=1e7), cn.NSCD(), "law HertzMindlin gives a force .* use SmoothDEM"),
    ],
)
def test_laws_of_the_other_strategy_are_refused(law, strategy, words):
    with pytest.raises(ValueError, match=words):
        heap(law=law, strategy=strategy)
    sim = heap(law=cn.Coulomb(mu=0.3), strategy=cn.NSCD()) if isinstance(strategy, cn.SmoothDEM) else heap()
    with pytest.raises(ValueError, match=words):
        sim.strategy = strategy


def test_run_writes_a_file_like_any_other(tmp_path):
    sim = heap(count=3)
    sim.run(steps=200, output=tmp_path / "heap.vtkhdf", every=50, checkpoint_every=100, progress=False)
    run = cn.load(tmp_path / "heap.vtkhdf")
    assert len(run) == 5
    whole = heap(count=3)
    whole.run(steps=250, progress=False)
    again = heap(count=3)
    again.restore(tmp_path / "heap.checkpoint.h5")
    again.run(steps=50, progress=False)
    assert same(whole, again)


def test_a_grain_in_a_sheared_periodic_cell_keeps_its_contacts():
    """The bits of a dense periodic cell do not depend on when its lists are made, shear or not."""
    for rate in (0.0, 2.0):
        runs = []
        for skin in (1e-4, 2e-3):
            rng = np.random.default_rng(3)
            grid = np.stack(np.meshgrid(*[np.arange(6)] * 2, indexing="ij"), -1).reshape(-1, 2)
            scene = cn.Scene(2, periodic=cn.Periodic(lengths=(0.06, 0.06), shear_rate=rate))
            v = np.c_[rng.random((36, 2)) - 0.5, np.zeros(36)]
            scene.add(cn.disks((grid + 0.5) * 0.01, 0.0049 + 2e-4 * rng.random(36), ROCK, velocity=v))
            scene.interact(ROCK, ROCK, cn.LinearSpring(stiffness=1e5, mu=0.5, restitution=0.7))
            sim = cn.Simulation(scene, 2e-5, cn.SmoothDEM(skin=skin), overlap="ignore")
            for _ in range(1500):
                sim.step()
            runs.append(sim)
        assert runs[0].info["neighbour_lists"] > 2 * runs[1].info["neighbour_lists"]
        assert runs[0].info["contacts"] > 5 and same(*runs)


def test_the_fast_way_of_spheres_is_the_general_one():
    """Spheres off the centre of massless reach: an offset of zero length elsewhere sends all pairs the general way."""
    runs = []
    for general in (False, True):
        sim = heap(count=5, dt=2e-5, speed=2.0)
        if general:  # a body of two spheres far away: contactors are no longer bodies
            inertia = 1e-8
            pair = cn.clumps([[9.0, 9.0, 9.0]], [[0, 0, 0], [0.01, 0, 0]], [0.002, 0.002], 1e-3, [inertia] * 3, ROCK)
            sim.add(pair)
        for _ in range(200):
            sim.step()
        runs.append(sim)
    grains = 125
    assert runs[0].info["contacts"] == runs[1].info["contacts"] > 30
    for name, scale in (("position", 0.05), ("velocity", 100.0), ("contact_force", 1.0)):
        one, two = (getattr(sim.bodies, name)[:grains] for sim in runs)
        assert np.max(np.abs(one - two)) < 1e-9 * scale, name
    assert np.isclose(runs[0].energy["kinetic"], runs[1].energy["kinetic"], rtol=1e-3)


@pytest.mark.parametrize("dim", [2, 3])
def test_energy_closes_with_the_step(dim):
    """What steps lose falls with them, and faster without dissipation; the balance closes to rounding."""
    closures = []
    for dt in (2e-5, 1e-5):
        sim = heap(dim, count=4, dt=dt, law=cn.HertzMindlin(young=1e7), speed=1.0)
        for _ in range(int(0.02 / dt)):
            sim.step()
        closures.append(abs(sim.energy["dissipated_integrator"]) / sim.energy["in_play"])
        assert abs(sim.energy["closure"]) < 1e-12 * sim.energy["in_play"]
    assert closures[1] < 0.5 * closures[0] < 1e-3
    closures, law = [], cn.LinearSpring(stiffness=5e3, mu=0.5, restitution=0.5)
    for dt in (2e-5, 5e-6):
        sim = heap(dim, count=4, dt=dt, speed=1.0, law=law)
        for _ in range(int(0.03 / dt)):
            sim.step()
        assert sim.energy["dissipated_normal"] > 0 and sim.energy["dissipated_friction"] > 0
        closures.append(abs(sim.energy["dissipated_integrator"]) / sim.energy["in_play"])
        assert abs(sim.energy["closure"]) < 1e-12 * sim.energy["in_play"]
    assert closures[1] < 0.4 * closures[0] and closures[1] < 1e-2


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("later", [0, 3])
def test_energy_closes_from_the_first_step_on(dim, later):
    """A moving grain inserted in compression on a wall: its kinetic energy and its spring count before the first step of the
    balance, also when this is requested later. A twentieth of the energy in play changes form in a step."""
    up = np.eye(dim)[-1]
    scene = cn.Scene(dim)
    scene.add((cn.disks if dim == 2 else cn.spheres)([0.0049 * up], 0.005, ROCK, velocity=-0.1 * up), cn.wall(0 * up, up, ROCK))
    scene.interact(ROCK, ROCK, cn.LinearSpring(stiffness=1e3))
    mass = ROCK.density * (np.pi * 0.005**2 if dim == 2 else 4 / 3 * np.pi * 0.005**3)
    sim = cn.Simulation(scene, 0.05 * np.sqrt(mass / 1e3), cn.SmoothDEM(energy=later == 0), overlap="ignore")
    for _ in range(later):
        sim.step()
    sim.strategy = cn.SmoothDEM()
    for _ in range(2):
        sim.step()
        energy = sim.energy
        assert energy["kinetic"] > 0 and energy["stored"] > 0 and energy["in_play"] > 0
        assert abs(energy["closure"]) < 1e-3 * energy["in_play"]


def test_orientation_follows_the_spin():
    """Half a turn a thousand steps long, and one of eight radians a step, end where the spin says."""
    for dt, steps in ((1e-3, 1000), (4.0, 1)):
        scene = cn.Scene(3)
        spin = np.array([0.0, 1.2, 1.6]) * (np.pi / 2 if steps > 1 else 1.0)
        scene.add(cn.spheres([[0, 0, 0.0]], 0.1, ROCK, velocity=[0, 0, 0, *spin], rotation=[[1.0, 0, 0, 0]]))
        sim = cn.Simulation(scene, dt, cn.SmoothDEM())
        for _ in range(steps):
            sim.step()
        half = np.linalg.norm(spin) * sim.time / 2
        expected = np.r_[np.cos(half), np.sin(half) * spin / np.linalg.norm(spin)]
        assert np.allclose(sim.bodies.rotation[0], expected, atol=1e-12)


def test_a_driven_wall_feels_the_weight():
    """A box of grains comes to rest; the floor carries their weight, and its drive gives that impulse."""
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    scene.add(cn.spheres([[0, 0, 0.005 - 1e-6]], 0.005, ROCK), cn.wall((0, 0, 0), (0, 0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.LinearSpring(stiffness=1e4, restitution=0.1))
    sim = cn.Simulation(scene, 1e-5, cn.SmoothDEM())
    for _ in range(5000):
        sim.step()
    weight = sim.bodies.mass[0] * 9.81
    assert np.isclose(sim.bodies.contact_force[1, 2], -weight, rtol=1e-6)
    assert np.isclose(sim.bodies.reaction[1, 2], weight * sim.dt, rtol=1e-6)
    assert np.isclose(sim.contacts.force[0, 2], weight, rtol=1e-6)
    assert sim.contacts.status[0] == 1 or sim.contacts.status[0] == 2


@pytest.mark.parametrize("share", [0.1, 0.4])
@pytest.mark.parametrize("restitution", [0.05, 0.5])
def test_overlap_at_rest_by_the_step(share, restitution):
    """Damping at the end of the step sees the contact's own force alone, see docs/smooth_dem.md: overlaps at rest are larger by
    the share h c/(2 m) = zeta omega h, m the effective mass of each contact, and forces still carry the weight."""
    radius, stiffness, count = 0.005, 1e4, 3
    grain = cn.Material("grain", density=2500.0)
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    scene.add(cn.spheres([[0, 0, radius * (1 + 2 * k)] for k in range(count)], radius, grain))
    scene.add(cn.wall((0, 0, 0), (0, 0, 1), grain))
    scene.interact("*", "*", cn.LinearSpring(stiffness=stiffness, restitution=restitution, mu=0.0))
    dt = share * cn.Simulation(scene, 1e-6, cn.SmoothDEM()).stable_step
    sim = cn.Simulation(scene, dt, cn.SmoothDEM(unstable="ignore"))
    for _ in range(int(0.3 / dt)):
        sim.step()
    mass, height = sim.bodies.mass[0], sim.bodies.position[:count, 2]
    overlap = -np.diff(np.concatenate([[-radius], height])) + 2 * radius
    zeta = -np.log(restitution) / np.hypot(np.pi, np.log(restitution))
    omega = np.sqrt(stiffness / np.array([mass, mass / 2, mass / 2]))
    weight = 9.81 * mass * np.arange(count, 0, -1)
    assert overlap == pytest.approx(weight / stiffness * (1 + zeta * omega * dt), rel=1e-5)
    assert np.sort(np.abs(sim.contacts.force[:, 2]))[::-1] == pytest.approx(weight, rel=1e-5)


@pytest.mark.parametrize("law", ["LinearSpring", "HertzMindlin"])
@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("share", [0.1, 1.0, 10.0])
def test_restitution_against_a_grain_that_is_held(dim, law, share):
    """Against a base of grains that are held, of any density, as against a wall: the mass that moves is the ball's alone. Held
    by a later drive, too; let go, the pair is one of two free balls again."""
    make = cn.disks if dim == 2 else cn.spheres
    stiffness = {"stiffness": 1e6} if law == "LinearSpring" else {"young": 1e8}
    dofs = ["vx", "vy", "w"] if dim == 2 else ["vx", "vy", "vz", "wx", "wy", "wz"]

    def impact(driven=(), later=None, density=share * 1000.0):
        scene, up = cn.Scene(dim), np.eye(dim)[-1:]
        base = scene.add(make(0 * up, 0.1, cn.Material("base", density=density), driven=driven))
        ball = cn.Material("ball", density=1000.0)
        velocity = np.pad(-up, ((0, 0), (0, 2 * dim - 3)))
        scene.add(make(0.21 * up, 0.1, ball, velocity=velocity))
        scene.interact("*", "*", getattr(cn, law)(restitution=0.5, **stiffness))
        sim = cn.Simulation(scene, 2e-5, cn.SmoothDEM())
        sim.step()
        if later is not None:
            sim.drive(base, later, np.zeros(len(dofs)) if later else None)
        for _ in range(2000):
            sim.step()
        v = sim.bodies.velocity[:, dim - 1]
        assert abs(sim.energy["closure"]) < 5e-3 * sim.energy["in_play"]
        return v[1] - v[0]

    assert impact(dofs) == pytest.approx(0.5, rel=5e-3)
    assert impact(later=dofs) == pytest.approx(0.5, rel=5e-3)
    assert impact(["w"] if dim == 2 else ["wx", "wy", "wz"]) == pytest.approx(0.5, rel=5e-3)
    assert impact(dofs, later=()) == pytest.approx(0.5, rel=5e-3)


def test_grains_that_are_held_do_not_shorten_the_stable_step():
    """Light grains glued to a floor do not move; of two driven against each other the springs act, no dashpot."""
    scene = cn.Scene(3)
    light = cn.Material("light", density=25.0)
    dofs = ["vx", "vy", "vz", "wx", "wy", "wz"]
    scene.add(cn.spheres([[0, 0, 0]], 0.005, light, driven=dofs), cn.spheres([[0, 0, 0.011]], 0.005, ROCK))
    toward = [[0, 0, 0.01, 0, 0, 0]]
    scene.add(cn.spheres([[1, 0, -0.00999]], 0.005, light, driven=dofs, velocity=toward))
    scene.add(cn.spheres([[1, 0, 0]], 0.005, light, driven=dofs))
    scene.interact("*", "*", cn.LinearSpring(stiffness=1e4, restitution=0.05))
    sim = cn.Simulation(scene, 1e-6, cn.SmoothDEM())
    free = cn.Scene(3)
    free.add(cn.spheres([[0, 0, 0.011]], 0.005, ROCK))
    free.interact("*", "*", cn.LinearSpring(stiffness=1e4, restitution=0.05))
    assert sim.stable_step == cn.Simulation(free, 1e-6, cn.SmoothDEM()).stable_step
    sim.step()
    force, gap = sim.contacts.force[:, 2], sim.contacts.gap
    assert np.abs(force) == pytest.approx(-1e4 * gap, rel=1e-12) and len(gap) == 1
    sim.drive([0], (), None)
    assert sim.stable_step < 0.2 * cn.Simulation(free, 1e-6, cn.SmoothDEM()).stable_step


def test_local_damping_takes_a_share_of_the_force_along_the_motion():
    """Cundall (1987): a ball that falls speeds up by (1 - share) g, one that rises slows down by (1 + share) g."""
    share, g, h, steps = 0.3, 9.81, 1e-4, 1000
    rock = cn.Material("rock", density=2500.0)
    scene = cn.Scene(dim=3, gravity=(0.0, 0.0, -g))
    scene.add(cn.spheres([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]], 0.1, rock, velocity=[[0.0] * 6, [0.0, 0.0, 2.0, 0.0, 0.0, 0.0]]))
    scene.interact(rock, rock, cn.LinearSpring(stiffness=1e4))
    sim = cn.Simulation(scene, dt=h, strategy=cn.SmoothDEM(local_damping=share))
    sim.run(steps=steps, progress=False)
    fallen, risen = sim.bodies.velocity[:, 2]
    assert fallen == pytest.approx(-(1 - share) * g * h * steps, rel=2 * share / steps)  # the first half step begins at rest
    assert risen == pytest.approx(2 - (1 + share) * g * h * steps, rel=2 * share / steps)
    assert sim.energy["dissipated_bulk"] > 0


def test_steps_are_no_warnings_in_the_log(caplog):
    """An explicit step has nothing to converge."""
    rock = cn.Material("rock", density=2500.0)
    scene = cn.Scene(3, gravity=(0, 0, -9.81))
    scene.add(cn.spheres([[0, 0, 1]], 1.0, rock), cn.wall((0, 0, 0), (0, 0, 1), rock))
    scene.interact(rock, rock, cn.HertzMindlin(young=1e7))
    cn.Simulation(scene, 1e-5, cn.SmoothDEM()).run(steps=3, progress=False)
    assert not [record for record in caplog.records if record.name.startswith("cairn")]


def test_a_restored_run_without_contacts_makes_explicit_steps(tmp_path):
    """Forces are in the file, so that nothing asks for the stable step before the list is old."""
    runs = [heap(2, speed=0.0), heap(2, speed=0.0)]
    runs[0].step()
    runs[0].checkpoint(tmp_path / "heap.checkpoint.h5")
    runs[1].restore(tmp_path / "heap.checkpoint.h5")
    for sim in runs:
        sim.step()
    assert [sim.info["status"] for sim in runs] == ["explicit"] * 2
    assert runs[1].info["stable_step"] > 0
