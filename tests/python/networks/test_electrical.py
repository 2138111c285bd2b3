"""Currents through contacts: conductances of spots, films, electrodes, what nothing reaches."""

import cairn as cn
import numpy as np
import pytest

N = cn.networks
STEEL = cn.Material("steel", density=7800.0, young=210e9, poisson=0.3, resistivity=1 / 5.9e6, hardness=2e9)
R = 1e-3


def column(n=2, push=1.0, counts=(1, 1), **electrical):
    """Columns of spheres on fixed spheres, each pressed by a force on its upper sphere; no gravity."""
    scene = cn.Scene(3)
    x, y = (g.ravel() for g in np.meshgrid(*[2 * R * np.arange(k) for k in counts], indexing="ij"))
    place = np.stack([x, y, np.zeros_like(x)], axis=1)
    held = cn.spheres(place, R, STEEL, group="floor").with_(driven=("vx", "vy", "vz", "wx", "wy", "wz"))
    scene.add(held)
    for k in range(1, n):
        top = k == n - 1
        force = (0, 0, -push) if top else None
        scene.add(cn.spheres(place + [0, 0, 2 * R * k], R, STEEL, group="lid" if top else "middle", force=force))
    scene.interact("*", "*", cn.Coulomb(mu=0.0))
    if electrical:
        scene.electrical(**electrical)
    return scene


def run(scene, steps=1, dt=1e-6, tol=1e-13, **options):
    sim = cn.Simulation(scene, dt, cn.NSCD(solver=cn.NLGS(tol=tol, max_iter=20000)), **options)
    for _ in range(steps):
        sim.step()
    return sim


@pytest.mark.parametrize(
    ("kernel", "ohm"),
    [
        (N.Holm(), 5.7212e-3),
        (N.PlasticSpot(hardness=2e9), 1 / (2 * 5.9e6 * np.sqrt(1 / (np.pi * 2e9)))),
        (N.Sharvin(free_path=4e-8), 4 * 4e-8 / 5.9e6 / (3 * np.pi * 14.8125e-6**2)),
        (N.Constant(conductance=250.0), 4e-3),
        ([N.Constant(conductance=100.0), N.Constant(conductance=150.0)], 4e-3),
        (N.Given(pressures=[0.0, 2e6], gaps=[0.0, 1e-6], h=[[0.0, 0.0], [4e8, 0.0]], area=1e-6), 1 / (2e8 * 1e-6)),
        (N.Yovanovich(slope=0.1, roughness=1e-6, area=1e-6),
         1 / (1.25 * 5.9e6 * 1e5 * (1e6 / 2e9) ** 0.95 * 1e-6)),
    ],
    ids=lambda k: repr(k)[:20],
)  # fmt: skip
def test_conductances_of_two_spheres(kernel, ohm):
    sim = run(column(2, conductance=kernel, current={"lid": 0.1, "floor": -0.1}))
    v = sim.bodies.potential
    assert (v[1] - v[0]) / 0.1 == pytest.approx(ohm, rel=2e-5)
    assert sim.contacts.current == pytest.approx([0.1 * np.sign(sim.contacts.bodies[0, 0] - 0.5)], rel=1e-12)
    assert sim.info["electrical"]["status"] == "converged"
    assert sim.info["electrical"]["closure"] <= 1e-12


def test_wexler_has_its_ends():
    ohms = []
    for kernel in (N.Holm(), N.Wexler(free_path=1e-15), N.Sharvin(free_path=1.0), N.Wexler(free_path=1.0)):
        v = run(column(2, conductance=kernel, current={"lid": 1.0, "floor": -1.0})).bodies.potential
        ohms.append(v[1] - v[0])
    assert ohms[1] == pytest.approx(ohms[0], rel=1e-8)
    assert ohms[3] == pytest.approx(ohms[2], rel=1e-4)


def test_a_simple_cubic_array_conducts_a_over_r():
    """k_eff / k = a / R: an identity."""
    sim = run(column(4, 10.0, (2, 2), potential={"lid": 1.0, "floor": 0.0}))
    a = (3 * 10.0 * (R / 2) / (4 * 210e9 / (2 * (1 - 0.09)))) ** (1 / 3)
    length, area = 3 * 2 * R, 4 * (2 * R) ** 2
    assert sim.info["electrical"]["current"] * length / area / 5.9e6 == pytest.approx(a / R, rel=1e-10)
    flow = sim.info["electrical"]
    assert flow["power"] == pytest.approx(flow["current"] * 1.0, rel=1e-12)
    assert flow["balance"]["closure"] <= 1e-12 * flow["balance"]["in_play"]


def test_both_methods_and_electrodes_of_many_bodies():
    ohms = []
    for method in ("direct", "multigrid"):
        sim = run(column(3, 1.0, (3, 2), current={"lid": 0.3, "floor": -0.3}, method=method))
        v = sim.bodies.potential
        assert np.ptp(v[:6]) == 0 and np.ptp(v[-6:]) == 0  # an electrode is one conductor
        ohms.append((v[-1] - v[0]) / 0.3)
    assert ohms == pytest.approx([2 * 5.72121e-3 / 6] * 2, rel=1e-5)


def test_a_film_breaks_down_and_stays_broken():
    """Branly: a film of 1 mS breaks at 1 mA, 1 V; then the spot alone is left while the contact lives."""
    film = N.OxideFilm(conductance=1e-3, power=1e-3)
    times = [0, 1e-6, 2e-6, 3e-6, 4e-6]
    ramp = cn.Table(times, [0, 0.9e-3, 1.1e-3, 0.5e-3, 0.1e-3])
    current = {"lid": ramp, "floor": cn.Table(times, -ramp.values)}
    sim = cn.Simulation(column(2, conductance=N.Constant(conductance=100.0), film=film, current=current), 1e-6)
    seen = []
    for _ in range(4):
        sim.step()
        v = sim.bodies.potential
        seen.append(v[1] - v[0])
    assert seen[0] == pytest.approx(0.9e-3 / 9.9999e-4, rel=1e-6)
    assert np.array(seen[1:]) == pytest.approx(np.array([1.1e-3, 0.5e-3, 0.1e-3]) / 100, rel=1e-9)
    assert sim.info["electrical"]["broken"] == 1 and sim.info["electrical"]["rounds"] == 1


def test_sliding_takes_the_film_off():
    ohms = []
    for sliding in (1.0, 0.01):
        scene = column(2, conductance=N.Constant(conductance=100.0), film=N.OxideFilm(conductance=1e-3, sliding=sliding),
                       current={"lid": 1e-6, "floor": -1e-6})  # fmt: skip
        scene.sets[1].velocity = np.array([[0.1, 0, 0, 0, 0, 0]])
        v = run(scene).bodies.potential
        ohms.append((v[1] - v[0]) / 1e-6)
    assert ohms == pytest.approx([1e3 + 0.01, 0.01], rel=1e-8)


def test_nothing_flows_where_nothing_touches():
    scene = column(2, current={"lid": 1.0, "floor": -1.0})
    scene.sets[1].position = scene.sets[1].position + [0, 0, R]
    with pytest.warns(N.NetworkWarning, match="nowhere to go"):
        sim = run(scene)
    assert sim.info["electrical"]["status"] == "open" and sim.info["electrical"]["open"] == 2
    assert np.isnan(sim.bodies.potential).all()


def test_one_grain_alone():
    scene = cn.Scene(3)
    scene.add(cn.spheres([[0, 0, 0]], R, STEEL))
    scene.electrical(potential={"steel": 2.0})
    sim = run(scene)
    assert sim.bodies.potential == [2.0] and sim.info["electrical"]["status"] == "converged"


def test_isolated_grains_are_told():
    scene = column(2, current={"lid": 1.0, "floor": -1.0})
    scene.add(cn.spheres([[1, 1, 1]], R, STEEL, group="far"))
    sim = run(scene)
    assert sim.info["electrical"]["floating"] == 1 and np.isnan(sim.bodies.potential[-1])


def test_wires_and_materials_without_and_with_any_resistance():
    insulator = cn.Material("glass", density=2500.0, young=70e9, poisson=0.2, resistivity=np.inf)
    scene = column(2, current={"lid": 1.0, "floor": -1.0}, wires=[(0, 1, 4.0)])
    scene.sets[0].contactors[0].material = insulator
    scene._materials["glass"] = insulator
    v = run(scene).bodies.potential
    assert v[1] - v[0] == pytest.approx(0.25, rel=1e-12)
    perfect = cn.Material("steel", density=7800.0, young=210e9, poisson=0.3, resistivity=0.0)
    scene = column(3, current={"lid": 1.0, "floor": -1.0})
    for s in scene.sets:
        s.contactors[0].material = perfect
    scene._materials["steel"] = perfect
    sim = run(scene)
    assert np.ptp(sim.bodies.potential) == 0 and np.abs(sim.contacts.current) == pytest.approx([1.0, 1.0])


def test_a_material_that_says_too_little_is_refused():
    scene = cn.Scene(3)
    scene.add(cn.spheres([[0, 0, 0]], R, cn.Material("tin", density=7300.0)))
    scene.electrical(current={"tin": 1.0})
    with pytest.raises(ValueError, match="resistivity of material 'tin'"):
        cn.Simulation(scene, 1e-3)
    with pytest.raises(ValueError, match="no group and no material 'lead'"):
        cn.Simulation(column(2, current={"lead": 1.0}), 1e-3)


def test_smooth_contacts_conduct_too():
    scene = column(2, conductance=N.Holm(), current={"lid": 0.1, "floor": -0.1})
    scene.rules.clear()
    scene.interact("*", "*", cn.LinearSpring(stiffness=1e6))
    scene.sets[1].position = scene.sets[1].position - [0, 0, 1e-6]
    sim = cn.Simulation(scene, 1e-8, cn.SmoothDEM(), overlap="ignore")
    sim.step()
    v = sim.bodies.potential
    force = np.linalg.norm(sim.contacts.force)
    a = (3 * force * (R / 2) / (4 * 210e9 / (2 * (1 - 0.09)))) ** (1 / 3)
    assert 0.1 / (v[1] - v[0]) == pytest.approx(2 * 5.9e6 * a, rel=1e-9)


def test_a_run_file_has_potentials_and_currents(tmp_path):
    scene = column(3, current={"lid": 0.1, "floor": -0.1})
    sim = cn.Simulation(scene, 1e-6)
    sim.run(3, output=tmp_path / "column.vtkhdf", progress=False)
    with cn.load(tmp_path / "column.vtkhdf") as run_file:
        assert np.array_equal(run_file[-1].bodies.potential, sim.bodies.potential)
        assert np.array_equal(run_file[-1].contacts.current, sim.contacts.current)
        assert run_file.history["electrical_closure"][-1] <= 1e-12


def test_a_restart_has_the_same_bits(tmp_path):
    def make():
        film = N.OxideFilm(conductance=1e-3, power=1e-4)
        wave = cn.Harmonic(1e-3, 1e5)
        scene = column(4, 1.0, (2, 2), film=film, current={"lid": wave, "floor": cn.Harmonic(-1e-3, 1e5)})
        return cn.Simulation(scene, 1e-6)

    one, other = make(), make()
    for _ in range(4):
        one.step()
    one.checkpoint(tmp_path / "c.h5")
    other.restore(tmp_path / "c.h5")
    for sim in (one, other):
        for _ in range(4):
            sim.step()
    assert one.bodies.potential.tobytes() == other.bodies.potential.tobytes()
    assert one.info["electrical"]["balance"] == other.info["electrical"]["balance"]


def test_scenes_without_networks_have_neither_arrays_nor_reports():
    sim = run(column(2))
    assert "electrical" not in sim.info and "potential" not in sim.bodies.names
    with pytest.raises(AttributeError):
        print(sim.contacts.current)
