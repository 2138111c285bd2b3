"""Heat against closed forms: chains, half spaces, slabs and spheres by their series; extremes of contacts and conductances."""

import cairn as cn
import numpy as np
import pytest

N = cn.networks
R = 1e-3
STEEL = cn.Material("steel", density=7850.0, young=210e9, poisson=0.3, conductivity=50.0, capacity=460.0)
MASS = 4 / 3 * np.pi * R**3 * 7850
HELD = ("vx", "vy", "vz", "wx", "wy", "wz")


def bar(length, fine, material, *, corner=0.0, high=None, grade=1.0):
    """A row of quads along x that nothing moves; cells grow by `grade` from the left. Its node columns have two nodes each."""
    high = length / fine if high is None else high
    x = np.cumsum(np.concatenate([[0.0], grade ** np.arange(fine)]))
    x = corner + x / x[-1] * length
    points = np.stack(np.meshgrid(x, [0.0, high], indexing="ij"), -1).reshape(-1, 2)
    k = np.arange(len(points)).reshape(-1, 2)
    quads = np.stack([k[:-1, 0], k[1:, 0], k[1:, 1], k[:-1, 1]], -1)
    groups = {"left": k[0], "right": k[-1], "all": k.ravel()}
    body = cn.ElasticBody(points, {"quad": quads}, young=1e9, poisson=0.0, density=material.density, groups=groups)
    return x, high, lambda name: cn.deformable(body, material, fixed={"all": "xy"}, name=name)


def column(sim, x, mesh=0):
    """Temperatures along a bar."""
    ids = sim.meshes[mesh].ids[: 2 * len(x) : 2]
    return sim.nodes.temperature[np.searchsorted(sim.nodes.id, ids)]


def march(scene, dt, steps):
    sim = cn.Simulation(scene, dt)
    for _ in range(steps):
        sim.step()
    return sim


# ---------------------------------------------------------------------- chains of grains


def chain(n, tau, start, wires=None, **thermal):
    scene = cn.Scene(3)
    place = np.zeros((n, 3))
    place[:, 0] = 4 * R * np.arange(n)  # no contacts: conductances are given
    scene.add(cn.spheres(place, R, STEEL).with_(driven=HELD))
    wires = [(k, k + 1, MASS * 460 / tau) for k in range(n - 1)] if wires is None else wires
    scene.thermal(initial=[(np.arange(n), start)], friction="none", wires=wires, **thermal)
    return scene


def test_modes_of_an_adiabatic_chain_decay_at_their_rates():
    """(4/tau) sin^2(k pi/2N): of ten grains .0978870 and .3819660 / tau."""
    tau, n = 4.739745, 10
    for k, rate in ((1, 0.0978870), (2, 0.3819660)):
        mode = np.cos(k * np.pi * (np.arange(n) + 0.5) / n)
        sim = march(chain(n, tau, 300 + mode, theta=0.5), tau / 100, 100)
        assert np.log(mode[0] / (sim.bodies.temperature[0] - 300)) == pytest.approx(rate, rel=2e-5)


def test_a_pulse_in_a_long_chain_follows_bessel_functions():
    """exp(-2 t/tau) I_n(2 t/tau) of an infinite chain, here far from its ends."""
    iv = pytest.importorskip("scipy.special").iv
    tau, n, t = 1.0, 41, 3.0
    start = np.full(n, 300.0)
    start[20] += 1
    sim = march(chain(n, tau, start, theta=0.5), tau / 200, 600)
    expected = np.exp(-2 * t) * iv(np.abs(np.arange(n) - 20), 2 * t)
    assert sim.bodies.temperature - 300 == pytest.approx(expected, abs=3e-6)


def test_a_chain_diffuses_as_its_grains_conduct():
    """Slow waves of a chain of steel spheres pressed by 10 N: diffusivity G d^2/C = 8.43927e-7 m2/s."""
    n, conductance = 40, 3.19125e-3
    wires = [(k, k + 1, conductance) for k in range(n - 1)]
    wave = np.pi / (n * 2 * R)
    mode = np.cos(np.pi * (np.arange(n) + 0.5) / n)
    scene = chain(n, 1.0, 300 + mode, wires=wires, theta=0.5)
    sim = march(scene, 0.5 / (8.43927e-7 * wave**2) / 100, 100)
    rate = np.log(mode[0] / (sim.bodies.temperature[0] - 300)) / 100 / sim.dt
    assert rate / wave**2 == pytest.approx(8.43927e-7, rel=1e-3)


# ---------------------------------------------------------------------- slabs, half spaces, spheres

SLAB = cn.Material("slab", density=1000.0, conductivity=1.0, capacity=1.0)  # diffusivity 1e-3
ROOTS = {0.1: 0.31105, 1.0: 0.86033, 10.0: 1.42887}


@pytest.mark.parametrize(
    ("biot", "fourier", "centre", "surface"),
    [(0.1, 1.0, 0.922389, 0.878126), (1.0, 1.0, 0.533859, 0.348177), (10.0, 0.5, 0.454641, 0.064329)],
)
def test_slabs_that_convection_cools(biot, fourier, centre, surface):
    x, high, made = bar(1.0, 60, SLAB)
    scene = cn.Scene(2)
    scene.add(made("slab"))
    scene.thermal(initial=400.0, friction="none", convection=[("slab.right", biot, high / 2, 300.0)], theta=0.5)
    t = (column(march(scene, fourier * 1000 / 400, 400), x) - 300) / 100
    assert t[0] == pytest.approx(centre, abs=1e-4)
    assert t[-1] == pytest.approx(surface, abs=1e-4)


@pytest.mark.parametrize(("biot", "fourier", "centre"), [(0.1, 0.5, 0.888986), (1.0, 0.2, 0.772312), (10.0, 0.2, 0.382664)])
def test_spheres_that_convection_cools(biot, fourier, centre):
    """A thin wedge of hexahedra from the centre out: at Bi = 1 its centre is as that of a slab whose surface jumps."""
    r, opening = np.concatenate([[0.003], np.linspace(0, 1, 61)[1:]]), 0.02
    side = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * opening / 2
    points = np.concatenate([np.column_stack([np.full(4, q), q * side]) for q in r])
    first = 4 * np.arange(len(r) - 1)
    hexes = first[:, None] + np.array([0, 1, 2, 3, 4, 5, 6, 7])
    groups = {"inner": np.arange(4), "outer": np.arange(4) + 4 * (len(r) - 1), "all": np.arange(len(points))}
    body = cn.ElasticBody(points, {"hexahedron": hexes}, young=1e9, poisson=0.0, density=1000.0, groups=groups)
    scene = cn.Scene(3)
    scene.add(cn.deformable(body, SLAB, fixed={"all": "xyz"}, name="ball"))
    scene.thermal(initial=400.0, friction="none", convection=[("ball.outer", biot, opening**2 / 4, 300.0)], theta=0.5)
    sim = march(scene, fourier * 1000 / 400, 400)
    t = sim.nodes.temperature[np.searchsorted(sim.nodes.id, sim.meshes[0].ids[:4])]
    assert (t - 300) / 100 == pytest.approx(centre, abs=5e-4)


def test_a_half_space_whose_surface_jumps_or_takes_a_flux():
    """erfc(x / 2 sqrt(a t)) is .479500 at .5; a flux q heats its surface by 2 q sqrt(a t/pi)/k."""
    x, high, made = bar(1.0, 300, SLAB)
    seconds = 10.0  # penetrates 2 sqrt(a t) = 0.2
    for given in ("jump", "flux"):
        scene = cn.Scene(2)
        scene.add(made("slab"))
        sources = (
            {"initial": {"*": 300.0, "slab.left": 400.0}, "temperature": {"slab.left": 400.0}}
            if given == "jump"
            else {"initial": 300.0, "power": {"slab.left": 1000.0 * high / 2}}
        )
        scene.thermal(friction="none", theta=0.5, **sources)
        rise = column(march(scene, seconds / 500, 500), x) - 300
        if given == "jump":
            assert np.interp(0.1, x, rise) / 100 == pytest.approx(0.479500, abs=1e-4)
        else:
            assert rise[0] == pytest.approx(2 * 1000.0 * np.sqrt(1e-3 * seconds / np.pi) / 1.0, rel=1e-3)


def test_two_half_spaces_that_touch():
    """Steel at 0 and aluminium at 100 degrees: e_s/(e_s + e_a), 35.8939 degrees from the hot side's, stay at the contact."""
    steel = cn.Material("steel", density=7850.0, conductivity=50.0, capacity=460.0)
    aluminium = cn.Material("aluminium", density=2700.0, conductivity=237.0, capacity=900.0)
    effusivity = [np.sqrt(m.conductivity * m.density * m.capacity) for m in (steel, aluminium)]
    scene, ids = cn.Scene(2), []
    for k, m in enumerate((steel, aluminium)):
        length = 0.1 * np.sqrt(m.conductivity / m.density / m.capacity / 1e-4)
        x, high, made = bar(length, 80, m, corner=0.0 if k else -length, high=1e-3, grade=1.05 if k else 1 / 1.05)
        ids.append((x, scene.add(made(m.name))))
    touching = [(ids[0][1][2 * 80 + j], ids[1][1][j], np.inf) for j in (0, 1)]
    scene.thermal(initial={"*": 300.0, "steel.all": 400.0}, friction="none", wires=touching, theta=1.0)
    sim = march(scene, 0.02, 200)
    t = sim.nodes.temperature[np.searchsorted(sim.nodes.id, ids[1][1][0])]
    assert (t - 300) / 100 == pytest.approx(effusivity[0] / sum(effusivity), abs=2e-3)
    assert effusivity[0] / sum(effusivity) == pytest.approx(0.35894, abs=1e-5)


# ---------------------------------------------------------------------- extremes


def pair(**thermal):
    """A sphere on a held sphere, pressed by 10 N, and a third far away."""
    scene = cn.Scene(3)
    scene.add(cn.spheres([[0, 0, 0]], R, STEEL, group="below").with_(driven=HELD))
    scene.add(cn.spheres([[0, 0, 2 * R]], R, STEEL, group="above", force=(0, 0, -10.0)).with_(driven=HELD[:2] + HELD[3:]))
    scene.add(cn.spheres([[1, 0, 0]], R, STEEL, group="far").with_(driven=HELD))
    scene.interact("*", "*", cn.Coulomb(mu=0.0))
    scene.thermal(**thermal)
    return scene


START = {"below": 400.0, "above": 300.0, "far": 350.0}


def test_contacts_that_conduct_nothing_or_all():
    sim = march(pair(initial=START, conductance=N.Constant(conductance=0.0), friction="none"), 1e-3, 3)
    assert sim.bodies.temperature.tolist() == [400.0, 300.0, 350.0]
    for conductance in (np.inf, 1e12):
        sim = march(pair(initial=START, conductance=N.Constant(conductance=conductance), friction="none"), 1e-3, 3)
        assert sim.info["thermal"]["status"] == "converged"
        assert sim.bodies.temperature == pytest.approx([350.0, 350.0, 350.0], rel=1e-12)
        balance = sim.info["thermal"]["balance"]
        assert abs(balance["closure"]) <= 1e-12 * balance["in_play"]


def test_ratios_of_a_million_millions():
    """Three branches of 1e-6, 1 and 1e6 W/K between held ends: the flow is that of the weakest."""
    wires = [(0, 1, 1e6), (1, 2, 1e-6), (2, 3, 1.0)]
    held = [(np.array([0]), 400.0), (np.array([3]), 300.0)]
    scene = chain(4, 1.0, np.full(4, 300.0), wires=wires, steady=True, temperature=held)
    sim = march(scene, 1.0, 1)
    flow = 100.0 / (1e-6 + 1e6 + 1.0)
    t = sim.bodies.temperature
    assert sim.info["thermal"]["status"] == "converged"
    assert sim.info["thermal"]["balance"]["in_play"] / 2 == pytest.approx(flow, rel=1e-9)
    assert t[2] == pytest.approx(300.0 + flow, rel=1e-15)


def test_a_steady_grain_that_nothing_reaches_is_told():
    sim = march(pair(initial=START, steady=True, temperature={"below": 400.0}, friction="none"), 1e-3, 1)
    assert sim.info["thermal"]["floating"] == 1
    assert sim.bodies.temperature == pytest.approx([400.0, 400.0, 350.0], rel=1e-12)  # it keeps its temperature


def test_power_into_a_steady_grain_that_nothing_reaches_has_nowhere_to_go():
    with pytest.warns(N.NetworkWarning, match="nowhere to go"):
        sim = march(pair(initial=START, steady=True, temperature={"below": 400.0}, power={"far": 1.0}), 1e-3, 1)
    assert sim.info["thermal"]["status"] == "open"
    assert np.all(np.isfinite(sim.bodies.temperature))


def test_one_grain_alone_and_a_scene_without_contacts():
    scene = cn.Scene(3)
    scene.add(cn.spheres([[0, 0, 0]], R, STEEL, group="grain"))
    scene.thermal(initial=300.0, power={"grain": 1.0})
    sim = march(scene, 1e-3, 10)
    assert sim.bodies.temperature[0] - 300 == pytest.approx(0.01 / (MASS * 460), rel=1e-12)
    assert sim.info["thermal"]["branches"] == 0 and sim.info["thermal"]["status"] == "converged"


def test_perfect_conductors_carry_what_their_ends_lack():
    """A heated grain joined by perfect conductors, through another grain, to a held one: all three take the held temperature."""
    wires = [(0, 1, np.inf), (1, 2, np.inf), (2, 3, 1e-3)]
    scene = chain(4, 1.0, np.array([400.0, 300.0, 350.0, 330.0]), wires=wires, temperature=[(np.array([0]), 400.0)],
                  power=[(np.array([2]), 0.5)], theta=0.5)  # fmt: skip
    sim = march(scene, 0.1, 5)
    assert sim.bodies.temperature[:3].tolist() == [400.0, 400.0, 400.0] and 330 < sim.bodies.temperature[3] < 400
    balance = sim.info["thermal"]["balance"]
    assert abs(balance["closure"]) <= 1e-12 * balance["in_play"]
    assert balance["held"] + balance["given"] == pytest.approx(balance["stored"], rel=1e-12)
    both = chain(2, 1.0, np.full(2, 300.0), wires=[(0, 1, np.inf)], temperature=[(np.array([0]), 400.0), (np.array([1]), 300.0)])
    with pytest.warns(N.NetworkWarning, match="no finite numbers"):
        march(both, 0.1, 1)
