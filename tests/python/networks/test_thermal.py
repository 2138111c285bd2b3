"""Heat between rigid grains: chains against closed forms, friction heat, shares, balances, order in time."""

import cairn as cn
import numpy as np
import pytest

N = cn.networks
R = 1e-3
STEEL = cn.Material("steel", density=7850.0, young=210e9, poisson=0.3, conductivity=50.0, capacity=460.0)
G = 3.19125e-3  # of two spheres of 1 mm pressed by 10 N [W/K]


def chain(n, push=10.0, material=STEEL, **thermal):
    """n spheres in a row, the first held, the last pressed."""
    scene = cn.Scene(3)
    all_held = ("vx", "vy", "vz", "wx", "wy", "wz")
    for k in range(n):
        force = (push * -1.0, 0, 0) if k == n - 1 and n > 1 else None
        s = cn.spheres([[2 * R * k, 0, 0]], R, material, group=f"grain {k}", force=force)
        scene.add(s.with_(driven=all_held if k == 0 else all_held[1:]))  # along the row alone
    scene.interact("*", "*", cn.Coulomb(mu=0.0))
    scene.thermal(**thermal)
    return scene


def march(scene, dt, steps, tol=1e-13):
    sim = cn.Simulation(scene, dt, cn.NSCD(solver=cn.NLGS(tol=tol, max_iter=100000), margin=1e-6))
    for _ in range(steps):
        sim.step()
    return sim


TAU = 4.739745  # C / G of that chain [s]


def test_a_pulse_in_an_adiabatic_chain():
    """Temperatures after 10 tau, from an implicit midpoint with fine steps; conductances are given, C / tau."""
    start = {f"grain {k}": 300.0 + (k == 0) for k in range(10)}
    heat = 4 / 3 * np.pi * R**3 * 7850 * 460
    wires = [(k, k + 1, heat / TAU) for k in range(9)]
    sim = march(chain(10, 0.0, initial=start, theta=0.5, friction="none", wires=wires), TAU / 20, 200)
    expected = [0.177318, 0.168592, 0.152450, 0.131197, 0.107622, 0.084442, 0.063898, 0.047550, 0.036313, 0.030618]
    assert sim.bodies.temperature - 300 == pytest.approx(expected, abs=3e-5)
    assert np.sum(sim.bodies.temperature - 300) == pytest.approx(1, rel=1e-11)
    balance = sim.info["thermal"]["balance"]
    assert abs(balance["closure"]) <= 1e-12 * balance["in_play"] and abs(balance["stored"]) <= 1e-12 * balance["in_play"]


@pytest.mark.parametrize(("theta", "order"), [(1.0, 1), (0.5, 2)])
def test_order_in_time(theta, order):
    ends = []
    for steps in (20, 40, 80):
        start = {"grain 0": 310.0, "grain 1": 300.0, "grain 2": 300.0}
        wires = [(k, k + 1, 4 / 3 * np.pi * R**3 * 7850 * 460 / TAU) for k in range(2)]
        sim = march(chain(3, 0.0, initial=start, theta=theta, friction="none", wires=wires), TAU / steps, steps)
        rates = 4 / TAU * np.sin(np.arange(3) * np.pi / 6) ** 2
        modes = np.cos(np.pi / 3 * np.outer(np.arange(3) + 0.5, np.arange(3)))
        modes /= np.linalg.norm(modes, axis=0)
        exact = 300 + 10 * modes @ (np.exp(-rates * TAU) * modes[0])
        ends.append(sim.bodies.temperature[0] - exact[0])
    found = np.log2(np.abs(np.diff(ends)))
    assert found[0] - found[1] == pytest.approx(order, abs=0.1)


@pytest.mark.parametrize("method", ["direct", "multigrid"])
def test_steady_between_two_temperatures_is_linear(method):
    sim = march(chain(6, temperature={"grain 0": 400.0, "grain 5": 300.0}, steady=True, method=method), 1e-3, 1)
    assert sim.bodies.temperature == pytest.approx(np.linspace(400, 300, 6), rel=1e-10)
    assert np.abs(sim.contacts.heat_flux) == pytest.approx(G * 20, rel=1e-5)
    assert sim.info["thermal"]["closure"] <= 1e-12


def slide(dt=0.01, **thermal):
    """A block of 1 kg that begins at 2 m/s on a plane, mu 0.3; it does not turn."""
    iron = cn.Material("iron", density=1.0, conductivity=60.0, capacity=450.0, young=2e11, poisson=0.3)
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    disk = cn.disks([[0.0, 1.0]], 1.0, iron, density=1 / np.pi, velocity=(2.0, 0.0, 0.0)).with_(driven=("w",))
    scene.add(disk)
    scene.add(cn.wall((0, 0), (0, 1), iron))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    scene.thermal(conductance=N.Constant(conductance=0.0), **thermal)
    return march(scene, dt, round(0.8 / dt))


def test_heat_of_a_sliding_block():
    """All of m v^2 / 2 becomes heat, half of it in the block."""
    sim = slide(initial=300.0)
    balance = sim.info["thermal"]["balance"]
    assert balance["friction"] == pytest.approx(2.0, rel=1e-10)
    assert balance["stored"] == pytest.approx(1.0, rel=1e-10)
    assert balance["held"] == pytest.approx(-1.0, rel=1e-10)  # into the wall, which has no end
    assert sim.bodies.temperature[0] - 300 == pytest.approx(1 / 450, rel=1e-9)
    assert abs(balance["closure"]) <= 1e-12 * balance["in_play"]


def test_heat_is_shared_by_effusivity():
    """Steel takes 0.358939 of it beside aluminium."""
    steel = cn.Material("steel", density=7850.0, conductivity=50.0, capacity=460.0, young=2e11, poisson=0.3)
    aluminium = cn.Material("aluminium", density=2700.0, conductivity=237.0, capacity=900.0, young=7e10, poisson=0.3)
    scene = cn.Scene(2, gravity=(0.0, -9.81))
    scene.add(cn.disks([[0.0, 1.0]], 1.0, steel, velocity=(2.0, 0.0, 0.0)).with_(driven=("w",)))
    scene.add(cn.wall((0, 0), (0, 1), aluminium))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    scene.thermal(conductance=N.Constant(conductance=0.0), friction="effusivity")
    sim = march(scene, 0.01, 20)
    balance = sim.info["thermal"]["balance"]
    effusivities = np.sqrt([50.0 * 7850 * 460, 237.0 * 2700 * 900])
    assert balance["stored"] / balance["friction"] == pytest.approx(effusivities[0] / effusivities.sum(), rel=1e-12)
    assert effusivities[0] / effusivities.sum() == pytest.approx(0.358939, abs=1e-6)


def test_joule_heat_goes_to_both_sides():
    wire = cn.Material("wire", density=7850.0, capacity=460.0, resistivity=1.7e-7, young=2e11, poisson=0.3, conductivity=50.0)
    scene = chain(2, material=wire, friction="none", conductance=N.Constant(conductance=0.0), initial=300.0)
    scene.electrical(current={"grain 0": 5.0, "grain 1": -5.0})
    sim = march(scene, 0.1, 10)
    power = sim.info["electrical"]["power"]
    assert power == pytest.approx(25 / (1 / 1.7e-7 * 2 * 31.9125e-6), rel=0.05)
    mass = sim.bodies.mass[0]
    assert sim.bodies.temperature - 300 == pytest.approx(power * 1.0 / 2 / (mass * 460), rel=1e-9)
    assert sim.info["thermal"]["balance"]["joule"] == pytest.approx(power, rel=1e-12)


def test_power_convection_and_radiation_come_to_rest():
    area = 4 * np.pi * R**2
    scene = chain(1, power={"grain 0": 0.01}, convection=[("grain 0", 20.0, None, 300.0)], steady=True)
    assert march(scene, 1.0, 1).bodies.temperature[0] == pytest.approx(300 + 0.01 / (20 * area), rel=1e-13)
    scene = chain(1, power={"grain 0": 0.01}, radiation=[("grain 0", 0.8, None, 300.0)], steady=True)
    sim = march(scene, 1.0, 1)
    hot = (300.0**4 + 0.01 / (0.8 * area * 5.670374419e-8)) ** 0.25
    assert sim.bodies.temperature[0] == pytest.approx(hot, rel=1e-12)
    assert abs(sim.info["thermal"]["closure"]) <= 1e-12
    scene = chain(1, convection=[("grain 0", 20.0, None, 300.0)], initial=400.0)
    scene.networks["thermal"].theta = 0.5
    sim = march(scene, 0.1, 100)
    heat = 4 / 3 * np.pi * R**3 * 7850 * 460
    assert sim.bodies.temperature[0] - 300 == pytest.approx(100 * np.exp(-20 * area / heat * 10), rel=1e-6)


def test_capacities_by_table_and_latent_heat():
    """Heat given is the enthalpy gained, whatever the path."""
    capacity = N.OfTemperature((300.0, 400.0), (400.0, 800.0))
    melts = cn.Material("tin", density=7300.0, young=5e10, poisson=0.3, conductivity=60.0, capacity=capacity,
                        latent=(6e4, 350.0, 360.0))  # fmt: skip
    scene = chain(1, material=melts, power={"grain 0": 1.0}, initial=300.0)
    sim = march(scene, 0.05, 40)
    mass = sim.bodies.mass[0]
    t = sim.bodies.temperature[0]
    enthalpy = 400 * (t - 300) + 2 * (t - 300) ** 2 if t < 400 else 400 * 100 + 2 * 100**2 + 800 * (t - 400)
    taken = 6e4 * np.clip((t - 350) / 10, 0, 1)
    assert mass * (enthalpy + taken) == pytest.approx(2.0, rel=1e-9)
    balance = sim.info["thermal"]["balance"]
    assert abs(balance["closure"]) <= 1e-11 * balance["in_play"]


def test_conductivity_by_table():
    """Steady flow between two grains is by the mean of their conductivities, here in series."""
    table = N.OfTemperature((300.0, 400.0), (40.0, 80.0))
    material = cn.Material("alloy", density=7850.0, young=210e9, poisson=0.3, conductivity=table)
    sim = march(chain(2, material=material, temperature={"grain 0": 400.0, "grain 1": 300.0}, steady=True), 1.0, 1)
    series = 2 / (1 / 80 + 1 / 40)
    assert np.abs(sim.contacts.heat_flux[0]) == pytest.approx(G * series / 50 * 100, rel=1e-5)


def test_walls_keep_their_temperature_and_give_what_they_must():
    scene = cn.Scene(3, gravity=(0.0, 0.0, -9.81))
    scene.add(cn.spheres([[0, 0, R]], R, STEEL, group="grain"), cn.wall((0, 0, 0), (0, 0, 1), STEEL, group="floor"))
    scene.interact("*", "*", cn.Coulomb(mu=0.5))
    scene.thermal(initial={"grain": 300.0, "floor": 400.0}, friction="none")
    sim = march(scene, 0.5, 400)
    assert sim.bodies.temperature[1] == 400.0
    balance = sim.info["thermal"]["balance"]
    assert balance["held"] == pytest.approx(balance["stored"], rel=1e-11) and balance["stored"] > 0


def test_a_source_of_time_and_a_restart_of_the_same_bits(tmp_path):
    def make():
        return cn.Simulation(chain(4, power={"grain 3": cn.Harmonic(0.01, 0.2)}, theta=0.5, initial=300.0), 0.3)

    one, other = make(), make()
    for _ in range(5):
        one.step()
    one.checkpoint(tmp_path / "c.h5")
    other.restore(tmp_path / "c.h5")
    for sim in (one, other):
        for _ in range(5):
            sim.step()
    assert one.bodies.temperature.tobytes() == other.bodies.temperature.tobytes()
    assert one.info["thermal"]["balance"] == other.info["thermal"]["balance"]


def test_bodies_that_come_in_have_a_temperature():
    sim = cn.Simulation(chain(2, initial=300.0), 0.1)
    sim.step()
    before = sim.bodies.temperature.copy()
    sim.add(cn.spheres([[1, 0, 0]], R, STEEL))
    assert sim.bodies.temperature[:2].tobytes() == before.tobytes() and sim.bodies.temperature[2] == 300.0
    sim.step()


def test_what_is_refused():
    with pytest.raises(ValueError, match="theta"):
        cn.Scene(2).thermal(theta=0.3)
    with pytest.raises(ValueError, match="capacity|conductivity"):
        cn.Simulation(chain(2, material=cn.Material("x", density=1.0, young=1e9)), 0.1)
    with pytest.raises(ValueError, match="initial temperature"):
        cn.Simulation(chain(2, initial={"grain 0": 300.0}), 0.1)


def cooling(depth, own, steps=500, **settings):
    """A disk of 0.1 m cools by convection from 400 to 300 K around it: rho c R/(2h) = 500 s whatever its depth."""
    clay = cn.Material("clay", density=1000.0, capacity=100.0, conductivity=10.0, young=1e9, poisson=0.3)
    scene = cn.Scene(2, depth=depth)
    scene.add(cn.disks([[0, 0]], 0.1, clay, group="grain", **({} if own is None else {"depth": own})))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    scene.thermal(initial=400.0, convection=[("grain", 10.0, None, 300.0)], theta=0.5, **settings)
    return march(scene, 1.0, steps).bodies.temperature[0]


@pytest.mark.parametrize("depth", [1.0, 0.5, 0.1])
def test_bodies_as_deep_as_their_scene_cool_at_any_depth_alike(depth, tmp_path):
    assert cooling(depth, depth) == pytest.approx(300 + 100 * np.exp(-1), abs=1e-4)
    if depth < 1:  # the heat of a metre flowed through the surface of half of one: 1000 s
        with pytest.raises(ValueError, match=f"the scene is {depth} m deep, and body 0 has the mass of 1 m.*depth={depth}"):
            cooling(depth, None)
        assert cooling(depth, None, 1, steady=True) == pytest.approx(300.0)
    clay = cn.Material("clay", density=1000.0)
    scene = cn.Scene(2, depth=depth)
    scene.add(cn.polygons([[[0, 0], [1, 0], [0, 1]]], clay, depth=depth), cn.disks([[3, 3]], 0.1, clay))
    scene.save(tmp_path / "a.scene.h5")
    assert [s.depth for s in cn.Scene.load(tmp_path / "a.scene.h5").sets] == [depth, 1.0]


def test_heat_goes_through_a_strip_at_any_depth_alike():
    """Two disks that the weight of a block presses: forces, heat and the strip are those of one depth."""
    clay = cn.Material("clay", density=1000.0, capacity=100.0, conductivity=10.0, young=1e9, poisson=0.3)
    found = []
    for depth in (1.0, 0.25):
        scene = cn.Scene(2, gravity=(0, -10), depth=depth)
        scene.add(cn.disks([[0, 0.1]], 0.1, clay, group="hot", depth=depth), cn.disks([[0, 0.3]], 0.1, clay, depth=depth))
        scene.add(cn.wall((0, 0), (0, 1), clay), cn.wall((0.1, 0), (-1, 0), clay), cn.wall((-0.1, 0), (1, 0), clay))
        scene.interact("*", "*", cn.Coulomb(mu=0.0))
        scene.thermal(initial={"*": 300.0, "hot": 400.0}, conductance=N.HertzStrip(), theta=0.5)
        found.append(march(scene, 1e-2, 200).bodies.temperature[:2])
    assert found[0][1] > 300.001 and found[1] == pytest.approx(found[0], rel=1e-9)
    with pytest.raises(ValueError, match=r"mass of 1 m, and HertzStrip spreads forces along it"):
        bare = cn.Scene(2, depth=0.5)
        bare.add(cn.disks([[0, 0.1]], 0.1, clay))
        bare.thermal(initial=300.0, steady=True, conductance=N.HertzStrip())
        cn.Simulation(bare, 1e-2)


METAL = cn.Material("metal", density=1000.0, capacity=100.0, conductivity=1.0, young=1e9, poisson=0.3)
STRATEGIES = {
    "NSCD": lambda: (cn.NSCD(), cn.Restitution(normal=0.5, mu=0.3), 1e-3),
    "EventDriven": lambda: (cn.EventDriven(), cn.Restitution(normal=0.5, mu=0.3), 1e-3),
    "SmoothDEM": lambda: (cn.SmoothDEM(), cn.LinearSpring(stiffness=1e7, restitution=0.5, mu=0.3), 1e-5),
    "SmoothDEM without energy": lambda: (
        cn.SmoothDEM(energy=False, skin=1e-4),
        cn.LinearSpring(stiffness=1e7, restitution=0.5, mu=0.3),
        1e-5,
    ),
    "Gear": lambda: (
        cn.SmoothDEM(integrator=cn.Gear(values=5)),
        cn.HertzMindlin(young=1e9, restitution=0.5, mu=0.3),
        5e-6,
    ),
}


@pytest.mark.parametrize("strategy", list(STRATEGIES))
def test_heat_of_a_collision(strategy):
    """Two spinning disks collide obliquely: all that motion loses is heat in them, in equal halves."""
    made, law, dt = STRATEGIES[strategy]()
    scene = cn.Scene(2)
    scene.add(cn.disks([[-0.15, 0], [0.1, 0.08]], 0.1, METAL, velocity=[[1.0, 0, 9.0], [-1.0, 0, 3.0]]))
    scene.interact("*", "*", law)
    scene.thermal(initial=300.0)
    sim = cn.Simulation(scene, dt, strategy=made)
    mass, inertia = sim.bodies.mass[0], sim.bodies.inertia[0]

    def kinetic():
        v = sim.bodies.velocity
        return 0.5 * mass * np.sum(v[:, :2] ** 2) + 0.5 * inertia * np.sum(v[:, 2] ** 2)

    before, lost = kinetic(), 0.0
    for _ in range(round(0.1 / dt)):
        report = sim.step()
        lost += sim.contacts.dissipated.sum()
    exact = 1e-9 if strategy in ("NSCD", "EventDriven") else 1e-2
    heat = report["thermal"]["balance"]["friction"]
    assert before - kinetic() > 19 and heat == pytest.approx(before - kinetic(), rel=exact)
    assert heat == pytest.approx(lost, rel=1e-9)
    if "without" not in strategy:
        spent = sim.energy["dissipated_normal"] + sim.energy["dissipated_friction"]
        assert heat == pytest.approx(spent, rel=1e-9)
    assert (sim.bodies.temperature - 300).sum() * mass * 100 == pytest.approx(heat, rel=1e-7)
    assert np.ptp(sim.bodies.temperature) < 1e-9


@pytest.mark.parametrize("dt", [1e-3, 0.02])
def test_heat_of_events_and_of_what_rests(dt):
    """A disk is dropped and slides to rest, by flight and steps of NSCD: its energy becomes heat, and it cools in flight as at
    rest."""
    scene = cn.Scene(2, gravity=(0, -9.81))
    scene.add(cn.disks([[0, 0.15]], 0.1, METAL, velocity=[[2.0, 0, 0]], driven=["w"]), cn.wall((0, 0), (0, 1), METAL))
    scene.interact("*", "*", cn.Restitution(normal=0.5, mu=0.3))
    scene.thermal(initial=300.0)
    sim = cn.Simulation(scene, dt, strategy=cn.EventDriven())
    for _ in range(round(2 / dt)):
        report = sim.step()
    mass = sim.bodies.mass[0]
    energy = 0.5 * mass * 4 + mass * 9.81 * 0.05
    assert abs(sim.bodies.velocity[0, 0]) < 1e-9
    heat = report["thermal"]["balance"]["friction"]
    assert heat == pytest.approx(sim.energy["dissipated_normal"] + sim.energy["dissipated_friction"], rel=1e-9)
    assert heat == pytest.approx(energy, rel=2 * dt)


def test_bodies_cool_in_flight():
    """Temperatures evolve in flight under event-driven dynamics as well."""
    temperatures = []
    for strategy in (cn.NSCD(), cn.EventDriven()):
        scene = cn.Scene(2, gravity=(0, -9.81))
        scene.add(cn.disks([[0, 1.1]], 0.1, METAL), cn.wall((0, 0), (0, 1), METAL))
        scene.interact("*", "*", cn.Restitution(normal=0.5))
        scene.thermal(
            initial=300.0,
            friction="none",
            convection=[([0], 5000.0, None, 280.0)],
            conductance=N.Constant(conductance=0.0),
        )
        sim = cn.Simulation(scene, 0.01, strategy=strategy)
        for _ in range(100):
            report = sim.step()
        temperatures.append(sim.bodies.temperature[0])
        assert abs(report["thermal"]["balance"]["closure"]) < 1e-12 * report["thermal"]["balance"]["in_play"]
    assert temperatures[1] == pytest.approx(temperatures[0], rel=1e-12) and temperatures[0] < 299
