"""Periodic cells whose shape is driven component by component: rates, stresses that the cell follows, a constant volume."""

import cairn as cn
import numpy as np
import pytest

ROCK = cn.Material("rock", density=2600.0)
SIZE = 2.0**-6


def grains(dim, per_side, seed=1, unit=1.0, mass=1.0):
    """Grains on a loose lattice, and the length of the cell that holds them."""
    rng = np.random.default_rng(seed)
    place = np.stack(np.meshgrid(*[np.arange(per_side)] * dim, indexing="ij"), -1).reshape(-1, dim)
    radii = rng.uniform(0.36, 0.45, len(place)) * SIZE * unit
    centers = (place + 0.5 + rng.uniform(-0.05, 0.05, place.shape)) * SIZE * unit
    material = cn.Material("rock", density=2600.0 * mass / unit**3)
    if dim == 2:
        return cn.disks(centers, radii, material, depth=unit), per_side * SIZE * unit
    return cn.spheres(centers, radii, material), per_side * SIZE * unit


def cell_of(dim, per_side, dt=2e-4, mu=0.4, strategy=None, unit=1.0, mass=1.0, time=1.0, seed=1, **driven):
    sets, length = grains(dim, per_side, seed, unit, mass)
    scene = cn.Scene(dim=dim, periodic=cn.Periodic((length,) * dim, **driven), depth=unit)
    scene.add(sets)
    scene.interact("*", "*", cn.Coulomb(mu=mu))
    return cn.Simulation(scene, dt=dt * time, strategy=strategy, overlap="ignore")


def mean_stress(sim, steps):
    """Mean stress and rate of the cell over steps, and how many of them converged."""
    stress, rate, converged = [], [], 0
    for _ in range(steps):
        converged += sim.step()["status"] == "converged"
        stress.append(sim.cell["stress"])
        rate.append(sim.cell["rate"])
    return np.mean(stress, axis=0), np.mean(rate, axis=0), converged


@pytest.mark.parametrize("dim", [2, 3])
def test_a_cell_without_contacts_falls_in_as_its_inertia_says(dim):
    # dL/dt = -P V/(m H^2), m: mass of the bodies
    pressure, h = {"xx": 800.0, "yy": 200.0} | ({"zz": 400.0} if dim == 3 else {}), 1e-6
    sets, length = grains(dim, 3)
    scene = cn.Scene(dim=dim, periodic=cn.Periodic((2 * length,) * dim, stress=pressure))
    scene.add(sets)
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, dt=h, overlap="ignore")
    mass = sim.bodies.mass.sum()
    for _ in range(3):
        sim.step()
    volume = (2 * length) ** dim
    for k, name in enumerate(pressure):
        due = -3 * h * pressure[name] * volume / (mass * (2 * length) ** 2)
        assert abs(sim.cell["rate"][k, k] / due - 1) < 1e-6
    assert np.abs(np.triu(sim.cell["rate"], 1)).max() == 0 and np.all(sim.cell["stress"] == 0)


def test_a_row_that_fills_its_cell_bears_the_pressure():
    # three disks in a row, in touch with each other and their images: each contact bears p times the width of the cell
    pressure, radius, width = 500.0, 0.01, 0.05
    scene = cn.Scene(dim=2, periodic=cn.Periodic((6 * radius, width), stress={"xx": pressure}))
    scene.add(cn.disks([[radius * (2 * k + 1), width / 2] for k in range(3)], radius, ROCK))
    scene.interact(ROCK, ROCK, cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, dt=1e-3, strategy=cn.NSCD(solver=cn.NLGS(tol=1e-8, max_iter=2000)))
    for _ in range(20):
        assert sim.step()["status"] == "converged"
    force = np.abs(sim.contacts.force[:, 0])
    assert len(force) == 3 and np.abs(force / (pressure * width) - 1).max() < 1e-6
    assert abs(sim.cell["stress"][0, 0] / pressure - 1) < 1e-6 and abs(sim.cell["rate"][0, 0]) < 1e-6
    assert np.abs(sim.bodies.velocity).max() < 1e-8


@pytest.mark.parametrize(("dim", "per_side", "steps"), [(2, 7, 1200), (3, 4, 1200)])
def test_an_isotropic_pressure_packs_grains_until_they_bear_it(dim, per_side, steps):
    pressure = 1e3
    sim = cell_of(dim, per_side, stress=pressure, mu=0.2)
    before = np.prod(sim.cell["lengths"])
    for _ in range(steps):
        sim.step()
    stress, rate, converged = mean_stress(sim, 100)
    assert np.abs(np.diag(stress) / pressure - 1).max() < 0.03
    assert np.abs(rate).max() < 0.05 and converged >= 98
    solid = np.sum(np.pi * sim.radii() ** 2 if dim == 2 else 4 / 3 * np.pi * sim.radii() ** 3)
    share = solid / np.prod(sim.cell["lengths"])
    assert (0.76 < share < 0.9) if dim == 2 else (0.55 < share < 0.7)
    assert np.prod(sim.cell["lengths"]) < before and sim.info["penetration"] < 0.05
    energy = sim.energy
    assert abs(energy["closure"]) < 1e-9 * energy["in_play"]
    assert energy["work_driven"] > 0 and energy["dissipated_normal"] > 0


@pytest.mark.parametrize("dim", [2, 3])
def test_simple_shear_at_constant_stress_along_the_gradient(dim):
    pressure, shear = 1e3, 2.0
    last, across = ("yy", "xy") if dim == 2 else ("zz", "xz")
    rate = cn.Expression(f"where(t - 0.2, {shear}, 0)")
    sim = cell_of(dim, 7 if dim == 2 else 4, stress={last: pressure}, rate={across: rate}, mu=0.4)
    for _ in range(1700):
        sim.step()
    stress, rate, _ = mean_stress(sim, 500)
    assert rate[0, -1] == pytest.approx(shear)
    assert abs(stress[-1, -1] / pressure - 1) < 0.1  # while it flows
    assert 0.1 < -stress[0, -1] / stress[-1, -1] < 0.6  # a friction of the bulk


def test_a_triaxial_cell_keeps_its_lateral_stress():
    pressure = 1e3
    sim = cell_of(3, 4, stress=pressure, mu=0.4)
    for _ in range(1000):
        sim.step()
    height = sim.cell["lengths"][2]
    sim.drive_cell(stress={"xx": pressure, "yy": pressure}, rate={"zz": -0.5})
    for _ in range(200):
        sim.step()
    stress, rate, _ = mean_stress(sim, 300)
    assert sim.cell["lengths"][2] == pytest.approx(height * np.exp(-0.5 * 0.1), rel=1e-3)
    assert np.abs(np.diag(stress)[:2] / pressure - 1).max() < 0.1 and rate[2, 2] == pytest.approx(-0.5)
    assert stress[2, 2] > 1.3 * pressure
    sim.drive_cell()
    before = sim.cell["vectors"]
    sim.step()
    assert np.array_equal(sim.cell["vectors"], before)  # nothing drives it any more


@pytest.mark.parametrize("dim", [2, 3])
def test_a_constant_volume_is_kept_to_rounding_of_the_step(dim):
    last = "yy" if dim == 2 else "zz"
    sim = cell_of(dim, 4, rate={last: cn.Harmonic(0.8, 5.0)}, constant_volume=True)
    begin = np.prod(sim.cell["lengths"])
    for _ in range(400):
        sim.step()
        assert abs(np.prod(sim.cell["lengths"]) / begin - 1) < 1e-6
    assert abs(sim.cell["lengths"][0] / begin ** (1 / dim) - 1) > 1e-4


@pytest.mark.parametrize("dim", [2, 3])
def test_units_by_powers_of_two_leave_all_bits(dim):
    ends = []
    for unit, mass, time in ((1.0, 1.0, 1.0), (2.0**7, 2.0**-9, 2.0**5)):
        pressure = 2.0**10 * mass / (unit * time**2)
        sim = cell_of(dim, 4, stress=pressure, unit=unit, mass=mass, time=time, dt=2.0**-12)
        for _ in range(150):
            sim.step()
        ends.append((sim.bodies.position / unit, sim.bodies.velocity[:, :dim] * time / unit, sim.cell["vectors"] / unit))
    assert all(np.array_equal(a, b) for a, b in zip(*ends, strict=True))


def test_a_run_goes_on_from_a_checkpoint_to_the_same_bits(tmp_path):
    made = [cell_of(2, 5, stress=cn.Table([0.0, 0.05], [500.0, 2000.0])) for _ in range(2)]
    for _ in range(80):
        made[0].step()
    made[0].checkpoint(tmp_path / "cell.checkpoint.h5")
    made[1].restore(tmp_path / "cell.checkpoint.h5")
    for sim in made:
        for _ in range(40):
            sim.step()
    assert np.array_equal(made[0].bodies.position, made[1].bodies.position)
    assert np.array_equal(made[0].cell["vectors"], made[1].cell["vectors"])


PHASES = [
    {"rate": {"xy": 0.5}},
    {"rate": {"xy": cn.Harmonic(0.5, 20.0), "yy": -0.3}, "constant_volume": True},
    {"stress": {"xx": 3e3, "yy": cn.Table([0.0, 0.02], [1e3, 2e3])}},
    {},
]


@pytest.mark.parametrize("phase", PHASES)
def test_a_restart_holds_the_phase_that_drove_the_cell(phase, tmp_path):
    first = {"stress": 1e3} if "stress" in phase else {"rate": {"xx": -0.5, "yy": -0.5}}
    straight = cell_of(2, 5, **first)
    straight.run(20, progress=False)
    straight.checkpoint(tmp_path / "own.h5")
    straight.drive_cell(**phase)
    straight.run(20, progress=False)
    straight.checkpoint(tmp_path / "phase.h5")
    straight.run(20, progress=False)
    again = cell_of(2, 5, **first)
    again.restore(tmp_path / "phase.h5")
    again.run(20, progress=False)
    for name in ("vectors", "rate"):
        assert np.array_equal(again.cell[name], straight.cell[name])
    assert np.array_equal(again.bodies.position, straight.bodies.position)
    # back to a time before that phase: the cell goes on as its scene tells
    again.restore(tmp_path / "own.h5")
    again.run(20, progress=False)
    other = cell_of(2, 5, **first)
    other.run(40, progress=False)
    assert np.array_equal(again.cell["vectors"], other.cell["vectors"])
    assert np.array_equal(again.bodies.velocity, other.bodies.velocity)


def test_the_mean_velocity_of_a_driven_cell_may_be_taken_out():
    """Contacts and the cell see differences of velocity alone: a common velocity of all bodies changes nothing that they feel."""
    sim = cell_of(2, 7, mu=0.3, stress=1e3)
    sim.run(1200, progress=False)
    mass, velocity = sim.bodies.mass, sim.bodies.velocity.copy()
    mean = mass @ velocity[:, :2] / mass.sum()
    kinetic, drift = sim.energy["kinetic"], 0.5 * mass.sum() * mean @ mean
    assert drift > 0.9 * kinetic
    velocity[:, :2] -= mean
    sim.bodies.set(velocity=velocity)
    sim.step()
    assert sim.energy["kinetic"] < 0.1 * kinetic
    assert np.abs(mass @ sim.bodies.velocity[:, :2]).max() < 1e-9 * mass.sum() * np.linalg.norm(mean)
    stress, _, converged = mean_stress(sim, 100)
    assert converged == 100 and np.allclose(np.diag(stress), 1e3, rtol=0.03)


@pytest.mark.parametrize("dim", [2, 3])
def test_walls_across_a_periodic_axis_are_refused(dim):
    lengths, zero = (1.0,) * (dim - 1), (0.0,) * dim
    up, aside = np.eye(dim)[-1], np.eye(dim)[0]
    open_above = cn.Scene(dim, periodic=cn.Periodic((*lengths, np.inf)))
    open_above.add(cn.wall(zero, up, ROCK))
    for normal in (aside, up + 0.1 * aside):
        with pytest.raises(ValueError, match=r"wall with normal .* periodic along x"):
            open_above.add(cn.wall(zero, normal, ROCK))
    closed = cn.Scene(dim, periodic=cn.Periodic((*lengths, 1.0)))
    with pytest.raises(ValueError, match="wall with normal"):
        closed.add(cn.wall(zero, up, ROCK))
    # the same for a turned wall, a wall that is added to a simulation, and a cell that is set after the wall
    body = cn.wall(zero, up, ROCK)
    turned = body.with_(rotation=np.array([np.pi / 2]) if dim == 2 else np.array([[np.sqrt(0.5), 0, np.sqrt(0.5), 0]]))
    with pytest.raises(ValueError, match="periodic along x"):
        open_above.add(turned)
    sim = cn.Simulation(open_above, 1e-3)
    with pytest.raises(ValueError, match="periodic along x"):
        sim.add(cn.wall(zero, aside, ROCK))
    late = cn.Scene(dim)
    late.add(cn.wall(zero, up, ROCK))
    with pytest.raises(ValueError, match="wall with normal"):
        late.periodic = cn.Periodic((*lengths, 1.0))


def test_tubes_and_rings_in_a_cell():
    pipe = cn.Scene(3, periodic=cn.Periodic((1.0, np.inf, np.inf)))
    pipe.add(cn.tube((0, 0, 0), (1, 0, 0), 3.0, ROCK))  # along the axis that repeats, however wide
    pipe.add(cn.tube((0, 0, 0), (0, 0, 1), 0.45, ROCK))
    with pytest.raises(ValueError, match="tube 1.2"):
        pipe.add(cn.tube((0, 0, 0), (0, 0, 1), 0.6, ROCK))
    flat = cn.Scene(2, periodic=cn.Periodic((1.0, np.inf)))
    flat.add(cn.ring((0, 0), 0.45, ROCK))
    with pytest.raises(ValueError, match="ring 1.2"):
        flat.add(cn.ring((0, 0), 0.6, ROCK))


def test_a_scene_file_holds_what_drives_the_cell(tmp_path):
    driven = {"rate": {"xy": cn.Harmonic(0.5, 3.0)}, "stress": {"yy": 800.0}, "inertia": 2.0}
    sim = cell_of(2, 4, **driven)
    sim.scene.save(tmp_path / "cell.scene.h5")
    other = cn.Simulation(cn.Scene.load(tmp_path / "cell.scene.h5"), dt=sim.dt, overlap="ignore")
    for one in (sim, other):
        for _ in range(30):
            one.step()
    assert np.array_equal(sim.cell["vectors"], other.cell["vectors"]) and sim.cell["vectors"][1, 0] > 0


def test_what_cannot_be_driven_is_told():
    with pytest.raises(ValueError, match="not periodic along all axes"):
        scene = cn.Scene(dim=2, periodic=cn.Periodic((1.0, 0.0), stress={"xx": 1e3}))
        scene.add(cn.disks([[0.5, 0.5]], 0.1, ROCK))
        cn.Simulation(scene, dt=1e-3)
    with pytest.raises(ValueError, match="names 'zz'"):
        cn.Scene(dim=2, periodic=cn.Periodic((1.0, 1.0), rate={"zz": 1.0}))
    with pytest.raises(ValueError, match="component xy of the periodic cell has two of rate, stress and shear_rate"):
        cn.Scene(dim=2, periodic=cn.Periodic((1.0, 1.0), shear_rate=1.0, stress={"xy": 1.0}))
    with pytest.raises(ValueError, match=r"cairn\.Table, Harmonic or Expression"):
        cn.Scene(dim=2, periodic=cn.Periodic((1.0, 1.0), stress=lambda t: 1e3))
    sim = cell_of(2, 3, stress=1e3, strategy=cn.NSCD(solver=cn.PPANewton()))
    with pytest.raises(ValueError, match=r"take cairn\.NLGS or cairn\.Auto"):
        for _ in range(50):
            sim.step()
    sim = cell_of(2, 3, rate={"xx": -0.1, "yy": -0.1}, constant_volume=True)
    with pytest.raises(ValueError, match="all its lengths are driven"):
        sim.step()
    sim = cell_of(2, 3, rate={"xx": cn.Expression("1/(t - t)")})
    with pytest.raises(ValueError, match="give a function that is finite"):
        sim.step()


def test_smooth_grains_take_rates_and_stresses():
    for driven in ({"rate": {"yy": -0.2}}, {"stress": 1e3}):
        sets, length = grains(2, 3)
        scene = cn.Scene(dim=2, periodic=cn.Periodic((length,) * 2, **driven))
        scene.add(sets)
        scene.interact(ROCK, ROCK, cn.LinearSpring(stiffness=1e6, restitution=0.5))
        sim = cn.Simulation(scene, dt=1e-6, strategy=cn.SmoothDEM(), overlap="ignore")
        if "rate" in driven:
            for _ in range(10):
                sim.step()
            assert sim.cell["lengths"][1] == pytest.approx(length * np.exp(-0.2e-5), rel=1e-9)
        else:
            sim.step()
            assert np.all(np.diag(sim.cell["rate"])[:2] < 0)  # nothing bears the pressure yet
            sim.strategy = cn.SmoothDEM(integrator=cn.Gear())
            with pytest.raises(ValueError, match="follows a stress"):
                sim.step()
