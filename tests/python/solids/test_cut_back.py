"""Steps in which Newton's method fails are cut back into parts: agreement with small steps; state unchanged where no part
succeeds; functions of time; every integrator; files."""

import cairn as cn
import numpy as np
import pytest
from cairn import NeoHookean, SolidBody, networks
from cairn.run import views
from second_order import box

ROCK = cn.Material("rock", density=1000.0)


def thrown(dt, *, speed=20.0, cuts=8, tol=1e-10, integrator=None, watch=None, **options):
    """A rubber block and a disk above it, thrown at a plane: too fast for Newton's method over a long step. watch: a function of
    the simulation, which is called wherever the force on the disk is asked for."""
    points, cells = box("quad", (4, 4), (1.0, 1.0))
    points[:, 1] += 0.01
    body = SolidBody(points, cells, NeoHookean(young=1e5, poisson=0.3), density=1000.0)
    scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
    scene.add(cn.deformable(body, ROCK, contact=np.arange(len(points)), velocity=(0.0, -speed)))
    scene.add(cn.wall((0, 0), (0, 1), ROCK))
    scene.add(cn.disks(np.array([[0.5, 1.5]]), np.array([0.3]), ROCK, velocity=np.array([[0.0, -speed, 0.0]]),
                       force=watch and Watched(watch)))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    strategy = cn.NSCD(solver=cn.NLGS(tol=tol, max_iter=20000), cut_back=cuts, integrator=integrator, **options)
    return cn.Simulation(scene, dt=dt, strategy=strategy)


class Watched:
    """No force, by a function of time and the simulation."""

    needs_simulation = True

    def __init__(self, watch):
        self.watch = watch

    def __call__(self, t, sim=None):
        if sim is not None:
            self.watch(sim)
        return 0.0, 0.0, 0.0


def shown(sim):
    """Arrays of views for the last step."""
    mesh, contacts = sim.meshes[0], sim.contacts
    fields = ("key", "bodies", "gap", "point", "impulse", "force", "relative_velocity", "dissipated", "status")
    of_contacts = {name: np.array(getattr(contacts, name)) for name in fields}
    return {
        "contact_force": mesh.contact_force, "reaction": mesh.reaction(), "stress": mesh.stress["quad"], **of_contacts,
        "dt": sim.report.get("dt"),
    }  # fmt: skip


def same(one, other):
    """Two states of simulations, to the bit, but for what a step writes before it reads it."""
    if isinstance(one, dict):
        kept = [key for key in one if not key.endswith(("_begin", "velocity_free"))]
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in kept)
    return np.array_equal(one, other)


def test_a_step_that_fails_is_made_in_parts():
    """Without parts it is an error; with them the way is that of steps as short, nearer than a long step is to a body's size."""
    sim = thrown(0.02, cuts=0)
    sim.step()
    with pytest.raises(ValueError, match="finds no balance in step 2"):
        sim.step()
    sim, parts, time = thrown(0.02), [], 0.0
    for k in range(8):
        report = sim.step()
        time += 0.02
        assert report["status"] == "converged" and report["newton_error"] <= 1e-8
        assert sim.time == time and report["time"] == time and sim.steps == k + 1 == report["step"]
        parts.append(report["sub_steps"])
        assert report["dt"] == (0.02 if parts[-1] == 1 else pytest.approx(0.01))
    assert 1 < max(parts) <= 4 and parts[0] == 1 == parts[-1]
    energy = sim.info["energy"]
    assert abs(energy["closure"]) < 1e-8 * energy["in_play"]  # as Newton's method closes the balance
    ends = {}
    for short in (8, 32):
        other = thrown(0.02 / short)
        for _ in range(8 * short):
            assert other.step()["sub_steps"] == 1
        ends[short] = np.vstack([other.meshes[0].position, other.bodies.position[1]])
    # the integrator errs by its step: no more in parts of dt / 4 than in steps of dt / 8 all the way, 0.17 m of a way of 3 m
    own = np.vstack([sim.meshes[0].position, sim.bodies.position[1]])
    apart, of_steps = (np.abs(end - ends[32]).mean() for end in (own, ends[8]))
    assert apart < of_steps
    assert np.abs(own - ends[32])[-1].max() < np.abs(ends[8] - ends[32])[-1].max()  # the disk


def test_what_is_whole_keeps_its_bits():
    ways = []
    for cuts in (0, 6):
        sim = thrown(0.01, speed=5.0, cuts=cuts)
        for _ in range(6):
            assert sim.step()["sub_steps"] == 1
        ways.append(sim.get_state())
    assert same(*ways)


def test_what_no_part_makes_leaves_all_as_it_was():
    """Failure of the smallest part restores the state before the whole step, whichever halves succeeded."""
    sim, other = thrown(0.02, cuts=3), thrown(0.02, cuts=3)
    for s in (sim, other):
        s.step()
        s.step()
    assert sim.report["sub_steps"] > 1
    before, report, stress = sim.get_state(), dict(sim.report), sim.meshes[0].material_state
    with pytest.raises(ValueError, match="cut_back=3 halved the step as often"):
        sim.step(4.0)
    assert same(before, sim.get_state()) and sim.time == before["time"] and same(stress, sim.meshes[0].material_state)
    assert sim.report["step"] == report["step"] and sim.report["time"] == report["time"]
    for _ in range(3):
        assert sim.step()["energy_created"] == other.step()["energy_created"]
    assert same(sim.get_state(), other.get_state())


def test_a_restart_goes_on_to_the_same_bits(tmp_path):
    sim = thrown(0.02)
    sim.step()
    sim.checkpoint(tmp_path / "first.h5")
    assert sim.step()["sub_steps"] > 1
    sim.step()
    other = thrown(0.02)
    other.restore(tmp_path / "first.h5")
    other.step()
    other.step()
    assert same(sim.get_state(), other.get_state())


@pytest.mark.parametrize(
    "integrator",
    [
        cn.Theta(theta=0.7), cn.Newmark(beta=0.5, gamma=1.0), cn.HHT(alpha=-0.1), cn.GeneralisedAlpha(spectral_radius=0.8),
        cn.DiscreteGradient(), cn.Gear(values=5), cn.VelocityVerlet(), cn.CentralDifference(),
    ],
    ids=lambda i: type(i).__name__,
)  # fmt: skip
def test_every_integrator_goes_on_with_what_it_keeps(integrator):
    """A block squeezed so fast that a whole step fails; explicit steps fail by inverted cells or the stability limit. Integrators
    keep derivatives, which do not depend on the step."""
    points, cells = box("quad", (2, 2), (1.0, 1.0))
    groups = {"foot": np.flatnonzero(points[:, 1] < 0.1)}

    def made(dt, cuts, passes):
        body = SolidBody(points, cells, NeoHookean(young=1e4, poisson=0.3), density=1000.0, groups=groups, lumped=True)
        scene = cn.Scene(dim=2)
        velocity = np.c_[0 * points[:, 1], -14.0 * points[:, 1]]
        scene.add(cn.deformable(body, ROCK, fixed={"foot": "xy"}, velocity=velocity))
        strategy = cn.NSCD(integrator=integrator, cut_back=cuts, newton_passes=passes)
        return cn.Simulation(scene, dt=dt, strategy=strategy)

    dt, few = 0.08, 5
    whole = made(dt, 0, few)
    try:
        assert whole.step()["status"] == "newton_limit"
    except ValueError as error:
        assert any(told in str(error) for told in ("inside out", "no balance", "limit"))
    sim, fine = made(dt, 9, few), made(dt / 512, 0, 30)
    report = sim.step()
    assert report["status"] == "converged" and report["sub_steps"] > 1 and sim.time == dt
    for _ in range(512):
        fine.step()
    assert np.abs(sim.meshes[0].position - fine.meshes[0].position).max() < 0.1


def test_functions_of_time_are_asked_for_the_parts():
    """A force, gravity and a prescribed displacement are evaluated at both ends of each part; the step ends on their values."""
    points, cells = box("quad", (3, 3), (1.0, 1.0))
    groups = {"foot": np.flatnonzero(points[:, 1] < 0.1), "top": np.flatnonzero(points[:, 1] > 0.9)}
    body = SolidBody(points, cells, NeoHookean(young=1e5, poisson=0.45), density=1000.0, groups=groups)
    asked = {"displace": set(), "force": set(), "gravity": set()}

    def of(name, value):
        def function(t):
            asked[name].add(t)
            return value(t)

        return function

    scene = cn.Scene(dim=2, gravity=of("gravity", lambda t: (0.0, -10.0 * t)))
    scene.add(cn.deformable(
        body, ROCK, fixed={"foot": "xy", "top": "x"}, displace={"top": {"y": of("displace", lambda t: -6.0 * t)}},
        force=of("force", lambda t: {"top": (0.0, 10.0 * t)}),
    ))  # fmt: skip
    sim = cn.Simulation(scene, dt=0.1, strategy=cn.NSCD(cut_back=6, newton_passes=3))
    report = sim.step()
    assert report["status"] == "converged" and report["sub_steps"] > 1
    top = sim.meshes[0].displacement[groups["top"], 1]
    assert np.allclose(top, -0.6, rtol=1e-12)
    for name in ("displace", "force", "gravity"):
        assert {0.0, 0.05, 0.1} <= asked[name]


def test_runs_tell_the_parts(tmp_path):
    sim = thrown(0.02)
    sim.run(steps=3, output=tmp_path / "run.vtkhdf", progress=False)
    history = cn.load(tmp_path / "run.vtkhdf").history
    assert history["sub_steps"][0] == 1 and max(history["sub_steps"]) > 1


@pytest.mark.parametrize("cuts", [-1, 31, 1.5])
def test_a_depth_that_is_none_is_told(cuts):
    with pytest.raises((ValueError, TypeError), match="cut_back"):
        cn.NSCD(cut_back=cuts)


def test_steps_that_a_network_repeats_are_not_made_in_parts():
    scene = cn.Scene(dim=2)
    hot = cn.Material("hot", density=1000.0, conductivity=1.0, capacity=1.0)
    scene.add(cn.disks(np.zeros((1, 2)), np.array([0.3]), hot))
    scene.thermal(conductance=networks.Constant(conductance=0.0), friction="none", coupling=1e-6)
    with pytest.raises(ValueError, match="cut_back is 2, and the network of heat repeats whole steps: leave out cut_back"):
        cn.Simulation(scene, dt=0.01, strategy=cn.NSCD(cut_back=2)).step()


def test_functions_see_the_part_before():
    """Functions see the same states as in a simulation whose steps are these parts: never the discarded attempts."""
    seen = []
    sim = thrown(0.02, watch=lambda sim: seen.append((sim.time, shown(sim))))
    sim.step()
    seen.clear()
    before = shown(sim)
    assert len(before["key"]) > 0 and np.abs(before["contact_force"]).max() > 0
    assert sim.step()["sub_steps"] == 3
    begins = sorted({time for time, _ in seen})
    assert begins == pytest.approx([0.02, 0.025, 0.03]) and len(seen) == 10  # at both ends of the whole, a half that fails, parts
    assert all(same(now, before) for time, now in seen if time == begins[0])
    other = thrown(0.02, cuts=0)
    other.step()
    for begin in begins[1:]:
        other.step(0.005)
        alone = shown(other)
        for now in (now for time, now in seen if time == begin):
            assert now["dt"] == 0.005 and np.array_equal(now["key"], alone["key"])
            for name in ("contact_force", "stress", "impulse", "force", "gap"):
                assert np.abs(now[name] - alone[name]).max() < 1e-7 * np.abs(alone[name]).max(), name


@pytest.mark.parametrize("cuts", [0, 3])
def test_views_show_the_last_step_after_one_that_is_refused(cuts):
    sim = thrown(0.02, cuts=cuts)
    sim.step()
    before = shown(sim)
    assert len(before["key"]) > 0
    for _ in range(2):
        with pytest.raises(ValueError, match="step 2"):
            sim.step(4.0)
        assert same(before, shown(sim)) and len(sim.contacts) == len(before["key"])
    with pytest.raises(ValueError, match="before the first|make a step first|no contact problem"):
        sim.problem()
    sim.remove(sim.bodies.id[-1:])
    assert len(sim.contacts) == 0


@pytest.mark.parametrize("what", ["step", "run", "remove", "add", "set_state", "get_state", "strategy", "begin_step"])
def test_a_simulation_is_left_alone_while_parts_are_asked_for(what):
    told, kept = [], []
    disk = cn.disks(np.array([[5.0, 5.0]]), np.array([0.1]), ROCK)
    calls = {
        "step": lambda sim: sim.step(), "run": lambda sim: sim.run(steps=1, progress=False),
        "remove": lambda sim: sim.remove(sim.meshes[0].all_ids), "add": lambda sim: sim.add(disk),
        "set_state": lambda sim: sim.set_state(kept[0]), "get_state": lambda sim: sim.get_state(),
        "strategy": lambda sim: setattr(sim, "strategy", cn.NSCD(theta=0.6)),
        "begin_step": lambda sim: sim.stages.begin_step(),
    }  # fmt: skip

    def meddle(sim):
        if kept and sim.steps == 1 and sim.time > 0.021:
            try:
                calls[what](sim)
            except ValueError as error:
                told.append(str(error))
            else:
                told.append("was done")

    sim, other = thrown(0.02, watch=meddle), thrown(0.02, watch=lambda sim: None)
    for s in (sim, other):
        s.step()
    kept.append(sim.get_state())
    for s in (sim, other):
        assert s.step()["sub_steps"] > 1
    assert told and all("one is being made in parts" in text for text in told)
    assert same(sim.get_state(), other.get_state())
    sim.step()


def test_an_error_that_no_part_can_mend_is_told_as_it_is():
    """Not as one of halves that were of no avail: a force beyond all numbers, in a part alone."""
    points, cells = box("quad", (4, 4), (1.0, 1.0))
    points[:, 1] += 0.01
    scene = cn.Scene(dim=2)
    body = SolidBody(points, cells, NeoHookean(young=1e5, poisson=0.3), density=1000.0)
    scene.add(cn.deformable(body, ROCK, contact=np.arange(len(points)), velocity=(0.0, -20.0)))
    scene.add(cn.wall((0, 0), (0, 1), ROCK))
    far = np.array([[50.0, 50.0]])
    scene.add(cn.disks(far, np.array([1e-3]), ROCK, force=lambda t: (1.7e308 * (0.0 < t % 0.02 < 0.019), 0.0, 0.0)))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, dt=0.02, strategy=cn.NSCD(solver=cn.NLGS(max_iter=20000), cut_back=8))
    with pytest.raises(ValueError, match="velocity of body .* would not be finite") as caught:
        for _ in range(3):
            sim.step()
    assert "cut_back" not in str(caught.value)


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_rigid_bodies_alone_are_asked_for_their_parts():
    """A jerk at the begin that makes squares of speeds overflow over a whole step, and not over its first half; it would over the
    second half."""
    asked = []

    def gravity(t):
        asked.append(t)
        return 0.0, -(2.0**505) * (t < 0.1)  # a power of two: impulses take all of it, without rounding

    scene = cn.Scene(dim=2, gravity=gravity)
    scene.add(cn.disks(np.array([[0.0, 0.3]]), np.array([0.3]), ROCK))
    scene.add(cn.wall((0, 0), (0, 1), ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, dt=1.0, strategy=cn.NSCD(cut_back=4))
    report = sim.step()
    assert report["sub_steps"] > 1 and report["status"] == "converged" and sim.time == 1.0
    assert {0.0, 0.5, 1.0} <= set(asked)


def test_loads_go_along_a_line_where_nothing_else_gives_them():
    """Forces and pressures that are linear in time: as where functions of it are asked."""
    points, cells = box("quad", (3, 3), (1.0, 1.0))
    groups = {
        "foot": np.flatnonzero(points[:, 1] < 0.1), "top": np.flatnonzero(points[:, 1] > 0.9),
        "side": np.flatnonzero(points[:, 0] > 0.9),
    }  # fmt: skip
    sims = []
    for _ in range(2):
        body = SolidBody(points, cells, NeoHookean(young=1e5, poisson=0.45), density=1000.0, groups=groups)
        scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
        scene.add(cn.deformable(
            body, ROCK, fixed={"foot": "xy"}, force=lambda t: {"top": (3e5 * t, -6e5 * t)}, pressure={"side": lambda t: 2e5 * t}
        ))  # fmt: skip
        sims.append(cn.Simulation(scene, dt=0.1, strategy=cn.NSCD(cut_back=8, newton_passes=6)))
    views.core_of(sims[1]).before_parts(None)
    parts = [[sim.step()["sub_steps"] for _ in range(2)] for sim in sims]
    assert parts[0] == parts[1] and max(parts[0]) > 1
    moved = [sim.meshes[0].displacement for sim in sims]
    assert np.abs(moved[0] - moved[1]).max() < 1e-9 * np.abs(moved[0]).max()
    work = [sim.energy["work_external"] for sim in sims]
    assert work[0] == pytest.approx(work[1], rel=1e-9)


def test_driven_bodies_and_following_pressures_in_parts():
    """A plate that comes down ever faster on a block whose side is pressed: the plate goes as its function says over each part,
    and the block ends near where short steps bring it."""
    points, cells = box("quad", (3, 3), (1.0, 1.0))
    groups = {"foot": np.flatnonzero(points[:, 1] < 0.1), "side": np.flatnonzero(points[:, 0] > 0.9)}

    def made(dt, cuts):
        body = SolidBody(points, cells, NeoHookean(young=1e5, poisson=0.3), density=1000.0, groups=groups)
        scene = cn.Scene(dim=2)
        top = np.flatnonzero(points[:, 1] > 0.9)
        scene.add(cn.deformable(body, ROCK, contact=top, fixed={"foot": "xy"}, pressure={"side": lambda t: 3e5 * t}))
        scene.add(cn.wall((0, 1.01), (0, -1), ROCK, velocity=lambda t: (0.0, -120.0 * t)))
        scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.0))
        return cn.Simulation(scene, dt=dt, strategy=cn.NSCD(solver=cn.NLGS(tol=1e-10, max_iter=20000), cut_back=cuts))

    sim, dt = made(0.1, 8), 0.1
    report = sim.step()
    assert report["status"] == "converged" and report["sub_steps"] > 1 and sim.bodies.velocity[0, 1] == -120.0 * 0.1
    ends = {}
    for parts in (4, 8, 64):
        short = made(dt / parts, 0)
        for _ in range(parts):
            short.step()
        ends[parts] = short.meshes[0].position
    of_parts, of_short, of_half = (np.abs(end - ends[64]).max() for end in (sim.meshes[0].position, ends[4], ends[8]))
    # of the first order: the longest part is twice as long as the steps of dt / 4
    assert of_half < 0.6 * of_short and of_parts < 2 * of_short
