"""Integrators as rows of a list: spectral radii and orders of oscillators, meshes and rigid bodies, energy, contacts, restart."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=1.0)
ALL = [
    cn.Theta(),
    cn.Theta(theta=0.6),
    cn.Newmark(),
    cn.Newmark(beta=0.3025, gamma=0.6),
    cn.HHT(alpha=-0.1),
    cn.GeneralisedAlpha(spectral_radius=0.8),
    cn.CentralDifference(),
    cn.BetaScheme(beta=0.6),
    cn.VelocityVerlet(),
    cn.Gear(values=4),
    cn.Gear(values=5),
    cn.Gear(values=6),
]
IDS = [repr(i) for i in ALL]


def step_of(integrator, h, state, stiffness, damping=0.0):
    """One step of q'' = -stiffness q - damping q' by the scheme of an integrator; state q, v and its history."""
    s = integrator.scheme(h)
    q, v, history = state[0], state[1], state[2:]
    elastic = q + s["elastic_velocity"] * v + s["elastic"] @ history
    drag = v + s["damping_history"] @ history
    known = s["velocity"] @ history
    change = known - s["impulse"] * (stiffness * elastic + damping * drag)
    change /= 1 + s["damping"] * damping + s["stiffness"] * stiffness
    end = v + change
    place = q + h * (1 - s["share"]) * v + s["position"] @ history + h * s["share"] * end
    return np.concatenate([[place, end], s["update"] @ history + s["gain"] * (change - known)])


def radius(integrator, omega):
    n = 2 + integrator.scheme(1.0)["histories"]
    return np.abs(np.linalg.eigvals(np.array([step_of(integrator, 1.0, e, omega**2) for e in np.eye(n)]).T)).max()


@pytest.mark.parametrize(
    "integrator, radii",
    [
        (cn.Newmark(beta=0.25, gamma=0.5), (1, 1, 1, 1)),
        (cn.Theta(theta=0.5), (1, 1, 1, 1)),
        (cn.Newmark(beta=0.3025, gamma=0.6), (0.999501, 0.960846, 0.824621, 0.818182)),
        (cn.HHT(alpha=-0.05), (0.999999, 0.996490, 0.913168, 0.904762)),
        (cn.HHT(alpha=-0.1), (0.999999, 0.993847, 0.837803, 0.818182)),
        (cn.HHT(alpha=-0.3), (0.999998, 0.989384, 0.684611, 0.538463)),
        (cn.GeneralisedAlpha(spectral_radius=0.9), (1.000000, 0.999942, 0.983763, 0.901451)),
        (cn.GeneralisedAlpha(spectral_radius=0.8), (1.000000, 0.999475, 0.929792, 0.801675)),
        (cn.GeneralisedAlpha(spectral_radius=0), (0.999952, 0.906563, 0.242536, 0.002158)),
        (cn.Theta(theta=0.51), (0.999900, 0.992032, 0.962265, 0.960784)),
        (cn.Theta(theta=0.55), (0.999501, 0.960846, 0.824621, 0.818182)),
        (cn.Theta(theta=0.6), (0.999003, 0.923548, 0.677834, 0.666667)),
        (cn.Theta(theta=1.0), (0.995037, 0.707107, 0.099504, 0.0001)),
        (cn.CentralDifference(), (1, 1)),
        (cn.VelocityVerlet(), (1, 1)),
        (cn.BetaScheme(beta=0.5), (1, 1)),
    ],
    ids=repr,
)
def test_spectral_radii(integrator, radii):
    """Eigenvalues of the amplification matrices at omega h = 0.1, 1, 10, 1e4, to six digits."""
    for omega, known in zip((0.1, 1, 10, 1e4), radii):
        assert radius(integrator, omega) == pytest.approx(known, abs=6e-7)


@pytest.mark.parametrize(
    "integrator, limit",
    [
        (cn.CentralDifference(), 2.0),
        (cn.VelocityVerlet(), 2.0),
        (cn.BetaScheme(beta=0.5), 2.0),
        (cn.BetaScheme(beta=0.6), 2 / np.sqrt(1.2)),
        (cn.BetaScheme(beta=1.0), np.sqrt(2)),
        (cn.Newmark(beta=0.1, gamma=0.5), 1 / np.sqrt(0.15)),
        (cn.Gear(values=4), np.sqrt(2)),
    ],
    ids=repr,
)
def test_limits_of_explicit_integrators(integrator, limit):
    assert integrator.scheme(1.0)["largest"] == pytest.approx(limit, rel=1e-14)
    assert radius(integrator, 0.999 * limit) < 1 + 1e-7 < radius(integrator, 1.01 * limit)


@pytest.mark.parametrize("integrator", [i for i in ALL if np.isfinite(i.scheme(1.0)["largest"])], ids=repr)
def test_drag_that_explicit_integrators_bear(integrator):
    """An oscillator of mass 1 by its spectral radius: with drag no step that the bound allows grows more than without, and one
    beyond it by 2 % does."""
    largest, n = integrator.scheme(1.0)["largest"], 2 + integrator.scheme(1.0)["histories"]

    def grows(h, omega, c):
        steps = np.array([step_of(integrator, h, e, omega**2, c) for e in np.eye(n)]).T
        return np.abs(np.linalg.eigvals(steps)).max()

    for c in (1e-3, 0.1, 1.0, 10.0, 1e3):
        points = np.array([[0.0, 0.0], [1.0, 0.0]])
        body = cn.LinearBody(points, np.eye(4), np.eye(4), damping=c * np.eye(4))
        scene = cn.Scene(dim=2)
        scene.add(cn.deformable(body, ROCK))
        h = cn.Simulation(scene, 1e-9, cn.NSCD(integrator=integrator)).stable_step
        free = max(1.0, *(grows(share * largest, 1.0, 0.0) for share in np.linspace(0.02, 1.0, 50)))
        assert grows(h, 1.0, c) <= free * (1 + 1e-9)
        if integrator.scheme(1.0)["damping"] == 0 and c >= 1:
            assert grows(1.02 * h, 1.0, c) > 1 + 1e-3


def test_the_beta_scheme_takes_the_old_acceleration():
    """With the new acceleration beta would cancel, and the radius at omega h = 1 would be 0.70711 for any beta."""
    assert radius(cn.BetaScheme(beta=0.5), 1.0) == pytest.approx(1.0, abs=1e-12)
    assert radius(cn.BetaScheme(beta=0.6), 1.0) == pytest.approx(0.94868, abs=6e-6)
    assert radius(cn.BetaScheme(beta=1.0), 1.0) == pytest.approx(0.70711, abs=6e-6)


@pytest.mark.parametrize(
    "integrator, elongation",
    [
        (cn.Theta(), 0.020497),
        (cn.Newmark(), 0.020497),
        (cn.GeneralisedAlpha(spectral_radius=1.0), 0.020497),
        (cn.CentralDifference(), -0.010607),
        (cn.VelocityVerlet(), -0.010607),
        (cn.BetaScheme(beta=0.5), -0.010607),
    ],
    ids=repr,
)
def test_elongation_of_the_period(integrator, elongation):
    """At omega h = 1/2: (x/2)/atan(x/2) - 1 of the trapezoid's rule, (x/2)/asin(x/2) - 1 of central differences."""
    trapezoid = 0.25 / np.arctan(0.25) - 1
    assert elongation == pytest.approx(trapezoid if elongation > 0 else 0.25 / np.arcsin(0.25) - 1, abs=6e-7)
    n = 2 + integrator.scheme(1.0)["histories"]
    roots = np.linalg.eigvals(np.array([step_of(integrator, 1.0, e, 0.25) for e in np.eye(n)]).T)
    turning = roots[np.argmax(roots.imag)]  # by this angle a step
    assert 0.5 / np.angle(turning) - 1 == pytest.approx(elongation, abs=6e-7)


@pytest.mark.parametrize(
    "integrator, error, order",
    [
        (cn.Theta(), 1.521e-4, 2),
        (cn.Newmark(), 1.521e-4, 2),
        (cn.VelocityVerlet(), 6.340e-5, 2),
        (cn.HHT(alpha=-0.1), 1.871e-4, 2),
        (cn.GeneralisedAlpha(spectral_radius=0.8), 1.600e-4, 2),
        (cn.Theta(theta=0.51), 2.350e-3, 1),
        (cn.Theta(theta=1.0), 1.172e-1, 1),
        (cn.CentralDifference(), 6.340e-5, 2),
        (cn.BetaScheme(beta=0.5), 6.340e-5, 2),
        (cn.BetaScheme(beta=0.6), None, 1),
        (cn.BetaScheme(beta=1.0), None, 1),
        (cn.Newmark(beta=0.3025, gamma=0.6), None, 1),
        (cn.HHT(alpha=-0.05), None, 2),
        (cn.HHT(alpha=-0.3), None, 2),
        (cn.GeneralisedAlpha(spectral_radius=0.9), None, 2),
        (cn.GeneralisedAlpha(spectral_radius=0.0), None, 2),
        (cn.Theta(theta=0.55), None, 1),
        (cn.Theta(theta=0.6), None, 1),
        (cn.Gear(values=4), None, 4),
        (cn.Gear(values=5), None, 4),
        (cn.Gear(values=6), None, 5),
    ],
    ids=repr,
)
def test_errors_and_orders_of_an_oscillator(integrator, error, order):
    """q'' = -q from 1, v = 0.3, to t = 10 by steps of 0.025, then half of them."""

    def error_of(h):
        state = np.array([1, 0.3, -1, -0.3, 1, 0.3][: 2 + integrator.scheme(h)["histories"]])
        if integrator.row in ("central_difference", "beta_scheme"):  # velocities in the middle of steps
            state[1] += h / 2
        errors = []
        for k in range(1, round(10 / h) + 1):
            state = step_of(integrator, h, state, 1.0)
            errors.append(abs(state[0] - np.cos(k * h) - 0.3 * np.sin(k * h)))
        return max(errors) if error is None else errors[-1]

    coarse, fine = error_of(0.025), error_of(0.0125)
    assert error is None or coarse == pytest.approx(error, rel=1e-3)
    assert np.log2(coarse / fine) == pytest.approx(order, abs=0.1)


def chain(n=6, stiffness=36.0, damping=0.0):
    """A bar: masses of 1/n along x, springs between them and to the wall at the left; it moves along x alone."""
    mass = np.diag(np.full(2 * n, 1 / n))
    k = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    k[-1, -1] = 1
    full = np.zeros((2 * n, 2 * n))
    full[::2, ::2] = stiffness / n * k * n
    full[1::2, 1::2] = np.eye(n)
    points = np.stack([np.arange(1, n + 1) / n, np.zeros(n)], -1)
    return cn.LinearBody(points, mass, full, damping=damping * full, groups={"all": np.arange(n), "tip": [n - 1]})


def bar(body, integrator, dt, *, gravity=(0, 0), strategy=cn.NSCD, contact=(), **options):
    scene = cn.Scene(dim=2, gravity=gravity)
    scene.add(*cn.deformable(body, ROCK, fixed={"all": "y"}, contact=contact, **options))
    if len(contact):
        scene.add(cn.wall((1.02, 0), (-1, 0), ROCK))
        scene.interact(ROCK, ROCK, cn.Coulomb(mu=0))
    return cn.Simulation(scene, dt=dt, strategy=strategy(integrator=integrator, solver=cn.NLGS(tol=1e-12, max_iter=10**5)))


@pytest.mark.parametrize("integrator", ALL, ids=IDS)
def test_a_bar_moves_as_its_modes_do(integrator):
    """Nodes of a mesh follow the same scheme as each of the body's modes, damping and start of the history included."""
    body = chain(damping=1e-2)
    square, modes = np.linalg.eigh(6 * body.K.toarray()[::2, ::2])
    start, h, steps = 1e-2 * modes[:, 0] + 3e-3 * modes[:, 3], 0.012, 40
    sim = bar(body, integrator, h, displacement=np.stack([start, 0 * start], -1), velocity=(0.02, 0))
    for _ in range(steps):
        assert sim.step()["status"] == "converged"
    known = np.zeros((2, len(square)))
    for i, k in enumerate(square):
        state = [modes[:, i] @ start, modes[:, i].sum() * 0.02]
        for _ in range(4):
            state.append(-k * state[-2] - 1e-2 * k * state[-1])
        state = np.array(state[: 2 + integrator.scheme(h)["histories"]])
        for _ in range(steps):
            state = step_of(integrator, h, state, k, 1e-2 * k)
        known[:, i] = state[:2]
    assert np.allclose(sim.meshes[0].displacement[:, 0], modes @ known[0], rtol=0, atol=1e-12)
    assert np.allclose(sim.meshes[0].velocity[:, 0], modes @ known[1], rtol=0, atol=1e-11)
    assert abs(sim.energy["closure"]) < 1e-12 * sim.energy["in_play"]


def energy_lost(integrator, body=None, steps=400):
    start = 1e-2 * np.linalg.eigh(6 * chain().K.toarray()[::2, ::2])[1] @ np.ones(6)
    sim = bar(chain() if body is None else body, integrator, 0.05, displacement=np.stack([start, 0 * start], -1))
    begin = 0.5 * start @ chain().K.toarray()[::2, ::2] @ start
    for _ in range(steps):
        sim.step()
    energy = sim.energy
    assert energy["kinetic"] + energy["stored"] + energy["dissipated_integrator"] == pytest.approx(begin, rel=1e-12)
    return energy["dissipated_integrator"] / begin


def test_what_an_integrator_dissipates_is_told_apart():
    """Without damping and contacts all that is lost is the integrator's: nothing at 1/2, more for more of its parameter."""
    assert abs(energy_lost(cn.Theta())) < 1e-12
    assert abs(energy_lost(cn.Newmark())) < 1e-12
    assert 0.05 < energy_lost(cn.HHT(alpha=-0.05)) < energy_lost(cn.HHT(alpha=-0.3)) < 1
    least, most = (energy_lost(cn.GeneralisedAlpha(spectral_radius=r)) for r in (0.8, 0.2))
    assert 0.05 < least < most < 1


@pytest.mark.parametrize("integrator", ALL, ids=IDS)
@pytest.mark.parametrize("dim", [2, 3])
def test_rigid_bodies_fly_on_parabolas(integrator, dim):
    """Constant forces, no damping: exact but for velocities that stand in the middle of steps, and theta above 1/2."""
    scene = cn.Scene(dim=dim, gravity=(0, -10.0, 0)[:dim])
    make = cn.disks if dim == 2 else cn.spheres
    speed = (1.0, 2.0, 0.0)[:dim] + ((3.0,) if dim == 2 else (0.0, 0.0, 3.0))
    scene.add(make([np.zeros(dim)], 0.1, ROCK, velocity=speed))
    h, steps = 0.01, 100
    sim = cn.Simulation(scene, dt=h, strategy=cn.NSCD(integrator=integrator))
    for _ in range(steps):
        sim.step()
    t, share = h * steps, integrator.scheme(h)["share"]
    place, velocity = sim.bodies.position[0], sim.bodies.velocity[0]
    drift = 0.0
    if integrator.row in ("theta", "central_difference", "beta_scheme"):
        drift = -10 * h * t * (share - 0.5)
    if integrator.row == "newmark":  # gamma above 1/2 changes nothing where accelerations are constant
        assert share == integrator.values["beta"] / integrator.values["gamma"]
    assert place[:2] == pytest.approx([t, 2 * t - 5 * t * t + drift], abs=1e-12)
    assert velocity[:2] == pytest.approx([1, 2 - 10 * t], abs=1e-12)
    assert velocity[-1] == pytest.approx(3, abs=1e-12)
    assert abs(sim.energy["closure"]) < 1e-13 * sim.energy["in_play"]


@pytest.mark.parametrize("integrator", ALL[2:], ids=IDS[2:])
def test_a_damped_body_under_a_force_in_time_converges(integrator):
    """m (v' + c v) = F cos(w t): of second order and above where the integrator is, also in the forces."""

    def error(h):
        scene = cn.Scene(dim=2)
        scene.add(cn.disks([[0, 0]], 1 / np.sqrt(np.pi), ROCK, damping=0.7, force=lambda t: (np.cos(2 * t), 0, 0)))
        sim = cn.Simulation(scene, dt=h, strategy=cn.NSCD(integrator=integrator))
        for _ in range(round(1 / h)):
            sim.step()
        c, w, at = 0.7, 2.0, sim.time
        homogeneous = -c / (c * c + w * w)  # v = A exp(-c t) + (c cos + w sin)/(c^2 + w^2)
        place = homogeneous * (1 - np.exp(-c * at)) / c + (c * np.sin(w * at) / w + 1 - np.cos(w * at)) / (c * c + w * w)
        return abs(sim.bodies.position[0, 0] - place)

    coarse, fine = error(0.02), error(0.01)
    first = {cn.Newmark(beta=0.3025, gamma=0.6), cn.CentralDifference(), cn.BetaScheme(beta=0.6)}
    assert np.log2(coarse / fine) > (0.8 if integrator in first else 1.7)


@pytest.mark.parametrize("integrator", ALL, ids=IDS)
def test_what_is_driven_follows_its_velocity(integrator):
    """A disk, and a bar whose nodes are all driven: the integral of the velocity by the step, and nothing that grows."""
    scene = cn.Scene(dim=2)
    scene.add(cn.disks([[0, 2]], 0.1, ROCK, driven="vx", drive=lambda t: (np.cos(3 * t), 0, 0)))
    along = {"all": {"x": lambda t: np.cos(3 * t)}}
    scene.add(*cn.deformable(chain(), ROCK, fixed={"all": "y"}, drive=along, velocity=(1.0, 0.0)))
    h, steps = 0.01, 300
    sim = cn.Simulation(scene, dt=h, strategy=cn.NSCD(integrator=integrator))
    start = sim.bodies.position[0, 0]
    worst = 0.0
    for k in range(1, steps + 1):
        assert sim.step()["status"] == "converged"
        ways = np.array([sim.bodies.position[0, 0] - start, *sim.meshes[0].displacement[:, 0]])
        worst = max(worst, np.abs(ways - np.sin(3 * k * h) / 3).max())
    assert worst < (2 * h if integrator.scheme(h)["share"] > 0.5 or integrator.row == "newmark" else 20 * h * h)
    assert abs(sim.energy["closure"]) < 1e-11 * sim.energy["in_play"]


def test_newmarks_average_acceleration_is_the_theta_method_also_through_impacts():
    """beta = 1/4, gamma = 1/2 and theta = 1/2 give the same motion: impulses are jumps of velocity, and no accelerations."""
    runs = []
    for integrator in (cn.Theta(), cn.Newmark()):
        sim = bar(chain(), integrator, 0.01, velocity=(0.5, 0), contact=[5])
        rows = []
        for _ in range(150):
            sim.step()
            rows.append([*sim.meshes[0].displacement[:, 0], *sim.meshes[0].velocity[:, 0], sim.contacts.impulse.sum()])
        runs.append(np.array(rows))
    assert np.any(runs[0][:, -1] < 0)  # it struck
    assert np.allclose(runs[0], runs[1], rtol=0, atol=1e-10)


@pytest.mark.parametrize("integrator", ALL, ids=IDS)
def test_a_bar_that_strikes_a_wall_keeps_its_balance(integrator):
    """The balance closes through impacts, and accelerations do not grow as the step shrinks."""
    largest = []
    for h in (0.01, 0.0025):
        sim = bar(chain(), integrator, h, velocity=(0.5, 0), contact=[5])
        most = 0.0
        while sim.time < 1.0:
            assert sim.step()["status"] == "converged"
            if integrator.scheme(h)["histories"]:
                most = max(most, np.abs(sim.bodies.acceleration).max())
        assert sim.energy["dissipated_normal"] > 0
        assert abs(sim.energy["closure"]) < 1e-11 * sim.energy["in_play"]
        largest.append(most)
    assert largest[1] <= 1.5 * largest[0]


@pytest.mark.parametrize("integrator", ALL, ids=IDS)
def test_restart_to_the_same_bits(integrator, tmp_path):
    """A mesh and a rigid body, in contact and with forces: the state of the integrator is restored."""

    def made():
        scene = cn.Scene(dim=2, gravity=(1.0, -2.0))
        scene.add(*cn.deformable(chain(damping=1e-3), ROCK, fixed={"all": "y"}, contact=[5], velocity=(0.5, 0)))
        scene.add(cn.disks([[0.5, 2], [0.7, 3]], 0.1, ROCK, velocity=(0.1, 0, 1), damping=0.2))
        scene.add(cn.wall((1.02, 0), (-1, 0), ROCK), cn.wall((0, 1.8), (0, 1), ROCK))
        scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
        return cn.Simulation(scene, dt=0.005, strategy=cn.NSCD(integrator=integrator), overlap="ignore")

    one, other = made(), made()
    for _ in range(40):
        one.step()
    one.checkpoint(tmp_path / "half.h5")
    other.restore(tmp_path / "half.h5")
    for sim in (one, other):
        for _ in range(40):
            sim.step()
    for name in ("position", "velocity"):
        assert np.array_equal(getattr(one.bodies, name), getattr(other.bodies, name))
    assert one.energy == other.energy


def test_what_is_no_integrator_is_refused():
    with pytest.raises(ValueError, match="beta is 0.7"):
        cn.Newmark(beta=0.7)
    with pytest.raises(ValueError, match="whole number from 4 to 6"):
        cn.Gear(values=4.5)
    with pytest.raises(ValueError, match="integrator is 'newmark'"):
        cn.NSCD(integrator="newmark")
    with pytest.raises(ValueError, match="leave it out"):
        cn.NSCD(theta=0.6, integrator=cn.Newmark())
    scene = cn.Scene(dim=2)
    with pytest.raises(ValueError, match="no integrator 'newmark'; there are central_difference"):
        cn.Simulation(scene, dt=1e-3, strategy=cn.Carpenter(integrator=cn.Newmark()))
    with pytest.raises(ValueError, match="stable step"):
        bar(chain(stiffness=1e4), cn.Gear(values=4), 0.05).step()
    sim = bar(chain(), cn.Newmark(), 0.05)
    assert "Newmark(beta=0.25, gamma=0.5)" in sim.explain()
