"""Every integrator on materials of solids: linear ones beside meshes of matrices, orders, energy, contact, restart, faults."""

import cairn as cn
import numpy as np
import pytest
from cell_blocks import dropped
from second_order import box
from test_discrete_gradient import thrown

NEO = cn.NeoHookean(young=2e4, poisson=0.3)
IMPLICIT = [
    cn.Newmark(),
    cn.Newmark(beta=0.3025, gamma=0.6),
    cn.HHT(alpha=-0.1),
    cn.GeneralisedAlpha(spectral_radius=0.8),
    cn.GeneralisedAlpha(spectral_radius=0.0),
]
EXPLICIT = [cn.CentralDifference(), cn.BetaScheme(beta=0.6), cn.VelocityVerlet(), cn.Newmark(beta=0.0, gamma=0.5),
            cn.Gear(values=4), cn.Gear(values=5), cn.Gear(values=6)]  # fmt: skip
ALL = [cn.Theta(), *IMPLICIT, *EXPLICIT]


def falling(integrator, dt, *, solid=True, speed=3.0, lumped=True):
    """A block of Hooke's law at small strains, by its stresses or by its matrices, that falls on a plane and sticks there."""
    points, cells = box("quad", (3, 2), (1.0, 0.75))
    points[:, 1] += 0.02
    law = {"density": 1000.0, "rayleigh": (1.0, 1e-4), "lumped": lumped}
    if solid:
        body = cn.SolidBody(points, cells, cn.IsotropicElastic(young=2e5, poisson=0.3), kinematics="small", **law)
    else:
        body = cn.ElasticBody(points, cells, young=2e5, poisson=0.3, **law)
    rock = cn.Material("rock", density=2500.0)
    scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
    scene.add(cn.deformable(body, rock, contact=np.arange(len(points)), velocity=(0.4, -speed)))
    scene.add(cn.wall((0, 0), (0, 1), rock))
    scene.interact(rock, rock, cn.Coulomb(mu=0.3))
    solver = cn.NLGS(tol=1e-13, max_iter=10**5)
    return cn.Simulation(scene, dt=dt, strategy=cn.NSCD(integrator=integrator, newton_tol=1e-13, solver=solver))


@pytest.mark.parametrize("integrator", ALL, ids=repr)
def test_linear_solids_move_as_meshes_of_their_matrices(integrator):
    """Stresses of Hooke's law at small strains give the way, the reactions and each term of the energy of K and C."""
    dt = 1e-3 if integrator in [cn.Theta(), *IMPLICIT] else 2e-4
    ways, terms = [], []
    for solid in (True, False):
        sim = falling(integrator, dt, solid=solid, lumped=integrator in EXPLICIT)
        rows = []
        for _ in range(40):
            assert sim.step()["status"] == "converged"
            rows.append([*sim.meshes[0].displacement.ravel(), *(dt * sim.meshes[0].velocity.ravel())])
        ways.append(np.array(rows))
        terms.append(sim.info["energy"])
        assert terms[-1]["dissipated_normal"] > 0
        assert abs(terms[-1]["closure"]) < 1e-11 * terms[-1]["in_play"]
    assert np.abs(ways[0] - ways[1]).max() < 1e-10 * np.abs(ways[0]).max()
    for name in ("kinetic", "stored", "dissipated_integrator", "dissipated_bulk", "dissipated_normal", "dissipated_friction"):
        assert terms[0][name] == pytest.approx(terms[1][name], rel=1e-8, abs=1e-9 * terms[0]["in_play"]), name


@pytest.mark.parametrize("integrator, radii", [
    (cn.Newmark(), (1, 1, 1)),
    (cn.Newmark(beta=0.3025, gamma=0.6), (0.999501, 0.960846, 0.824621)),
    (cn.HHT(alpha=-0.1), (0.999999, 0.993847, 0.837803)),
    (cn.HHT(alpha=-0.3), (0.999998, 0.989384, 0.684611)),
    (cn.GeneralisedAlpha(spectral_radius=0.8), (1.000000, 0.999475, 0.929792)),
    (cn.GeneralisedAlpha(spectral_radius=0.0), (0.999952, 0.906563, 0.242536)),
], ids=repr)  # fmt: skip
def test_spectral_radii_of_a_linear_solid(integrator, radii):
    """The lowest mode of a body of stresses, at omega h = 0.1, 1, 10: roots of the recurrence that its amplitudes obey."""
    points, cells = box("quad", (2, 1), (2.0, 1.0))
    left = np.flatnonzero(points[:, 0] == 0)
    law = cn.IsotropicElastic(young=2e5, poisson=0.3)
    body = cn.SolidBody(points, cells, law, kinematics="small", density=1000.0, groups={"left": left})
    free = np.setdiff1d(np.arange(points.size), [2 * left, 2 * left + 1])
    mass, stiffness = body.M.toarray()[np.ix_(free, free)], body.K.toarray()[np.ix_(free, free)]
    root = np.linalg.inv(np.linalg.cholesky(mass))
    square, modes = np.linalg.eigh(root @ stiffness @ root.T)
    mode = np.zeros(points.size)
    mode[free] = 1e-3 * root.T @ modes[:, 0]
    rock = cn.Material("rock", density=2500.0)
    for omega_h, radius in zip((0.1, 1.0, 10.0), radii):
        scene = cn.Scene(dim=2)
        scene.add(cn.deformable(body, rock, fixed={"left": "xy"}, displacement=mode.reshape(-1, 2)))
        dt = omega_h / np.sqrt(square[0])
        sim = cn.Simulation(scene, dt=dt, strategy=cn.NSCD(integrator=integrator, newton_tol=1e-14))
        amplitude = []
        for _ in range(9):
            sim.step()
            shape = sim.meshes[0].displacement.ravel()[free]
            amplitude.append(mode[free] @ mass @ shape / (mode[free] @ mass @ mode[free]))
        x = np.array(amplitude)
        rows = np.stack([x[2:-1], x[1:-2], x[:-3]], -1)
        law = np.linalg.lstsq(rows, x[3:], rcond=1e-9)[0]
        assert np.abs(np.roots([1, *-law])).max() == pytest.approx(radius, abs=2e-6)


def turning(place, momentum):
    """Angular momentum about the origin [kg m2/s]."""
    return np.sum(place[:, 0] * momentum[:, 1] - place[:, 1] * momentum[:, 0])


def way_of(integrator, dt, time, material=NEO, **options):
    """Displacements of a block that turns and stretches, after a time."""
    sim = thrown(2, material, integrator, dt, **options)
    for _ in range(round(time / dt)):
        assert sim.step()["status"] == "converged"
    return sim.meshes[0].displacement


@pytest.mark.parametrize("integrator, order", [
    (cn.Newmark(), 2), (cn.Newmark(beta=0.3025, gamma=0.6), 1), (cn.HHT(alpha=-0.1), 2),
    (cn.GeneralisedAlpha(spectral_radius=0.8), 2), (cn.VelocityVerlet(), 2), (cn.Newmark(beta=0.0, gamma=0.5), 2),
    (cn.Gear(values=4), 4), (cn.Gear(values=5), 4), (cn.Gear(values=6), 5),
], ids=repr)  # fmt: skip
def test_orders_where_forces_are_not_linear(integrator, order):
    """By three steps and their halves, of a neo-Hookean block that turns by a radian."""
    base = 4e-3 if integrator in (cn.Newmark(), *IMPLICIT) else 2e-3
    ways = [way_of(integrator, base / n, 0.24, lumped=integrator in EXPLICIT) for n in (1, 2, 4)]
    found = np.log2(np.abs(ways[0] - ways[1]).max() / np.abs(ways[1] - ways[2]).max())
    assert found == pytest.approx(order, abs=0.25)


@pytest.mark.parametrize("integrator, order", [(cn.Newmark(), 2), (cn.HHT(alpha=-0.1), 2), (cn.VelocityVerlet(), 1)], ids=repr)
def test_orders_of_a_law_that_sees_rates(integrator, order):
    """Kelvin and Voigt's: the rate at the end of an implicit step follows from its mean; explicit ones take the mean itself."""
    law = cn.KelvinVoigt(young=2e4, poisson=0.3, viscous_young=100.0, viscous_poisson=0.3)
    base = 4e-3 if order == 2 else 1e-3
    options = {"kinematics": "total_lagrangian", "lumped": order == 1}
    start = way_of(integrator, base / 64, 0.0, law, **options)
    ways = [way_of(integrator, base / n, 0.2, law, **options) - start for n in (1, 2, 4)]
    found = np.log2(np.abs(ways[0] - ways[1]).max() / np.abs(ways[1] - ways[2]).max())
    assert found == pytest.approx(order, abs=0.3)


@pytest.mark.parametrize("integrator", ALL, ids=repr)
def test_what_the_integrator_takes_is_told_apart(integrator):
    """In flight the energy that is gone is that which the integrator is said to take, of the second order or by its damping."""
    spent = []
    for n in (1, 2):
        sim = thrown(2, NEO, integrator, 2e-3 / n, lumped=integrator in EXPLICIT)
        sim.step()
        first = sim.info["energy"]
        begin = first["kinetic"] + first["stored"] + first["dissipated_integrator"]
        for _ in range(100 * n - 1):
            assert sim.step()["status"] == "converged"
        e = sim.info["energy"]
        assert e["kinetic"] + e["stored"] + e["dissipated_integrator"] == pytest.approx(begin, rel=1e-11)
        assert abs(e["closure"]) < 1e-11 * e["in_play"]
        assert e["dissipated_material"] == 0 and e["dissipated_normal"] == 0
        spent.append(e["dissipated_integrator"] / begin)
    middles = integrator in (cn.CentralDifference(), cn.BetaScheme(beta=0.6))  # velocities stand in the middle of steps
    assert abs(spent[0]) < (0.05 if middles or integrator in EXPLICIT else 5e-3)
    if integrator in (cn.Newmark(beta=0.3025, gamma=0.6), *IMPLICIT[3:]):
        assert spent[0] > 1.5 * spent[1] > 0


@pytest.mark.parametrize("integrator", [cn.Newmark(), cn.HHT(alpha=-0.1), cn.GeneralisedAlpha(spectral_radius=0.8)], ids=repr)
def test_a_block_tumbles_many_times(integrator):
    """Eight turns of a stiff block: size and momentum stay, angular momentum by the square of the step, energy bounded."""
    sim = thrown(2, cn.NeoHookean(young=2e7, poisson=0.3), integrator, 4e-3)
    sim.strategy = cn.NSCD(integrator=integrator, newton_tol=1e-10)
    mesh, mass = sim.meshes[0], sim.meshes[0].body.M
    first = (mass @ mesh.velocity.ravel()).reshape(-1, 2)
    spin = turning(mesh.body.points, first)
    for _ in range(round(8 * 2 * np.pi / 4.0 / 4e-3)):
        assert sim.step()["status"] == "converged"
    last = (mass @ mesh.velocity.ravel()).reshape(-1, 2)
    assert np.abs(last.sum(axis=0) - first.sum(axis=0)).max() < 1e-9 * np.abs(first).sum()
    place = mesh.body.points + mesh.displacement
    assert turning(place, last) == pytest.approx(spin, rel=2e-3)
    long = [np.linalg.norm(x[0] - x[-1]) for x in (mesh.body.points, place)]
    assert long[1] == pytest.approx(long[0], rel=5e-3)
    terms = sim.info["energy"]
    assert abs(terms["closure"]) < 1e-10 * terms["in_play"]
    assert terms["kinetic"] + terms["stored"] < 1.001 * terms["largest_kinetic"] + 1e-9


@pytest.mark.parametrize("integrator", ALL, ids=repr)
def test_the_balance_closes_through_contact_and_restart_keeps_bits(integrator, tmp_path):
    dt = 2.0**-9 if integrator in (cn.Theta(), *IMPLICIT) else 2.0**-11
    steps = round(0.5 / dt)
    sim, again = (thrown(2, NEO, integrator, dt, wall=True, lumped=integrator in EXPLICIT) for _ in range(2))
    touched = 0
    for k in range(steps):
        assert sim.step()["status"] == "converged"
        touched += len(sim.contacts) > 0 and np.abs(sim.contacts.force).max() > 0
        if k == steps // 2:
            assert touched > 5
            sim.checkpoint(tmp_path / "half.checkpoint.h5")
    terms = sim.info["energy"]
    assert terms["dissipated_normal"] > 0
    assert abs(terms["closure"]) < 1e-10 * terms["in_play"]
    again.restore(tmp_path / "half.checkpoint.h5")
    for _ in range(steps - steps // 2 - 1):
        again.step()
    assert np.array_equal(sim.meshes[0].displacement, again.meshes[0].displacement)
    assert np.array_equal(sim.meshes[0].velocity, again.meshes[0].velocity)
    assert sim.info["energy"] == again.info["energy"]


@pytest.mark.parametrize("integrator", [cn.HHT(alpha=-0.1), cn.Gear(values=5)], ids=repr)
def test_plastic_states_stay_with_the_step(integrator, tmp_path):
    """A metal that strikes a wall: its dissipation is a separate term, the balance closes, a restart goes on to the same bits."""
    metal = cn.FiniteJ2(young=2e5, poisson=0.3, yield_stress=300.0, isotropic=1e3)
    dt = 2.0**-10 if integrator in IMPLICIT else 2.0**-13
    sim, again = (thrown(2, metal, integrator, dt, wall=True, lumped=integrator in EXPLICIT) for _ in range(2))
    steps = round(0.12 / dt)
    for k in range(steps):
        assert sim.step()["status"] == "converged"
        if k == steps // 2:
            sim.checkpoint(tmp_path / "half.checkpoint.h5")
    terms = sim.info["energy"]
    assert terms["dissipated_material"] > 0.02 * terms["largest_kinetic"]
    assert abs(terms["closure"]) < 1e-10 * terms["in_play"]
    again.restore(tmp_path / "half.checkpoint.h5")
    for _ in range(steps - steps // 2 - 1):
        again.step()
    assert np.array_equal(sim.meshes[0].displacement, again.meshes[0].displacement)
    assert sim.info["energy"] == again.info["energy"]


@pytest.mark.parametrize("integrator", IMPLICIT[:4], ids=repr)
def test_a_balance_that_is_not_found_is_told(integrator):
    sim = thrown(2, NEO, integrator, 2e-2)
    limited = cn.NSCD(integrator=integrator, newton_passes=1, newton_tol=1e-13)
    sim = cn.Simulation(sim.scene, dt=2e-2, strategy=limited)
    report = sim.step()
    assert report["status"] == "newton_limit" and report["newton_passes"] == 1
    assert 1e-13 < report["newton_error"] < 1 and "of the balance of the mesh" in report["hint"]


def crushed(integrator):
    """A block whose top is driven towards its bottom, which is held."""
    points, cells = box("quad", (3, 3), (1.0, 1.0))
    groups = {"bottom": np.flatnonzero(points[:, 1] == 0), "top": np.flatnonzero(points[:, 1] == 1)}
    body = cn.SolidBody(points, cells, NEO, density=1000.0, groups=groups, lumped=True)
    scene = cn.Scene(dim=2)
    drive = {"bottom": {"x": 0.0, "y": 0.0}, "top": {"x": 0.0, "y": -1.0}}
    velocity = np.stack([0 * points[:, 0], -points[:, 1]], -1)
    scene.add(cn.deformable(body, cn.Material("rock", density=2500.0), drive=drive, velocity=velocity))
    return cn.Simulation(scene, dt=2.0**-8, strategy=cn.NSCD(integrator=integrator))


@pytest.mark.parametrize("integrator", [*IMPLICIT, cn.VelocityVerlet(), cn.Gear(values=5)], ids=repr)
def test_a_step_that_fails_leaves_the_state_as_it_was(integrator):
    """A step in which the top would go through the bottom is an error that names mesh and cell, or the stable step; a shorter one
    then goes on as if it had not been tried."""
    tried, spared = crushed(integrator), crushed(integrator)
    for _ in range(8):
        tried.step(), spared.step()
    nodes = tried.nodes
    before = [np.array(x) for x in (nodes.position, nodes.velocity, nodes.acceleration, tried.time)]
    tried.dt = 4.0
    with pytest.raises(ValueError, match="mesh 'mesh'.*(quad cell|stable step)|stable step .* mesh 'mesh'"):
        tried.step()
    after = [np.array(x) for x in (nodes.position, nodes.velocity, nodes.acceleration, tried.time)]
    assert all(np.array_equal(a, b) for a, b in zip(before, after))
    tried.dt = spared.dt
    for _ in range(8):
        assert tried.step() and spared.step()
    assert np.array_equal(tried.meshes[0].displacement, spared.meshes[0].displacement)
    assert tried.info["energy"] == spared.info["energy"]


def upset(integrator):
    """A light block between a floor and a plate that comes down: contact forces are large for its mass."""
    points, cells = box("quad", (4, 4), (1.0, 1.0))
    groups = {"top": np.flatnonzero(points[:, 1] == 1), "bottom": np.flatnonzero(points[:, 1] == 0)}
    body = cn.SolidBody(points, cells, cn.NeoHookean(young=1e3, poisson=0.3), density=1e-3, groups=groups)
    skin, plate = cn.Material("skin", density=1.0), cn.Material("plate", density=1.0)
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(body, skin, contact="top", fixed={"bottom": "xy"}))
    scene.add(cn.wall((0, 1), (0, -1), plate, velocity=(0.0, -0.2, 0.0)))
    scene.interact(skin, plate, cn.Coulomb(mu=0.2))
    return cn.Simulation(scene, 0.05, cn.NSCD(integrator=integrator, solver=cn.PPANewton(tol=1e-8)))


def test_light_bodies_that_contacts_hold():
    """Accelerations know no contact: methods that move bodies by them are told of, those that do not go on."""
    with pytest.raises(ValueError, match="give a smaller dt.* Newmark with beta = gamma/2"):
        upset(cn.HHT(alpha=-0.3)).run(steps=5, progress=False)
    ends = []
    for integrator in (cn.Newmark(beta=0.5, gamma=1.0), cn.Theta(theta=1.0)):
        sim = upset(integrator)
        for _ in range(10):
            assert sim.step()["status"] == "converged"
        ends.append(np.abs(sim.contacts.force[:, 1]).sum())
    assert ends[0] == pytest.approx(0.95 * ends[1], rel=0.01)  # its first step, from rest, goes half of the way: 5 % of it


@pytest.mark.parametrize("integrator", [cn.Newmark(), cn.HHT(alpha=-0.1), cn.GeneralisedAlpha(spectral_radius=0.5)], ids=repr)
def test_rigid_parts_turn_and_pressure_follows(integrator):
    """A bar with a rigid end that spins under pressure: the end keeps its shape, the balance closes."""
    points, cells = box("quad", (4, 2), (2.0, 0.5))
    groups = {"end": np.flatnonzero(points[:, 0] > 1.4), "left": np.flatnonzero(points[:, 0] == 0)}
    body = cn.SolidBody(points, cells, NEO, density=1000.0, groups=groups)
    rock = cn.Material("rock", density=2500.0)
    x = points - points.mean(axis=0)
    scene = cn.Scene(dim=2)
    spin = np.stack([-4 * x[:, 1], 4 * x[:, 0]], -1)
    scene.add(cn.deformable(body, rock, rigid=("end",), pressure={"left": 50.0}, velocity=spin))
    sim = cn.Simulation(scene, dt=5e-3, strategy=cn.NSCD(integrator=integrator, newton_tol=1e-11))
    for _ in range(160):
        assert sim.step()["status"] == "converged"
    place = points + sim.meshes[0].displacement
    turned = [np.arctan2(*(x[groups["end"][-1]] - x[groups["end"][0]])) for x in (points, place)]
    assert abs(turned[1] - turned[0]) > 0.1
    for a in groups["end"]:
        for b in groups["end"]:
            assert np.linalg.norm(place[a] - place[b]) == pytest.approx(np.linalg.norm(points[a] - points[b]), rel=1e-6)
    terms = sim.info["energy"]
    assert abs(terms["closure"]) < 1e-9 * terms["in_play"]


def test_stages_of_a_pass_are_timed():
    """Assembly, factorisation, contacts and balance are parts of the passes: their sum is nearly all of them."""
    sim = dropped(3, cn.NeoHookean(young=2e5, poisson=0.3), counts=6, height=0.0, strategy=cn.NSCD(integrator=cn.HHT(alpha=-0.1)))
    for _ in range(4):
        sim.step()
    spent = dict(sim.info["newton_seconds"])
    whole = spent.pop("all")
    assert set(spent) == {"assembly", "factorisation", "contacts", "balance"} and min(spent.values()) > 0
    assert 0.9 * whole < sum(spent.values()) <= whole
    assert falling(cn.Theta(), 1e-3, solid=False).info["newton_seconds"]["all"] == 0
