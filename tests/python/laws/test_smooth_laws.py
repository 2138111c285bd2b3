"""Laws of smooth contacts against their closed forms."""

import cairn as cn
import numpy as np
import pytest

STONE = cn.Material("stone", density=2500.0)
R = 0.01
MASS = 2500 * 4 / 3 * np.pi * R**3
HELD = ("vx", "vy", "vz", "wx", "wy", "wz")
G = 9.81


def rebound(law, speed=1.0, dt=2e-6, steps=600, size=R):
    """A sphere meets a wall; where it is at the end."""
    scene = cn.Scene(3)
    scene.add(
        cn.spheres([[0, 0, 1.00001 * size]], size, STONE, velocity=[[0, 0, -speed, 0, 0, 0]]),
        cn.wall((0, 0, 0), (0, 0, 1), STONE),
    )
    scene.interact("*", "*", law)
    sim = cn.Simulation(scene, dt, cn.SmoothDEM(unstable="ignore"), overlap="ignore")
    least = 0.0
    for _ in range(steps):
        sim.step()
        if sim.bodies.position[0, 2] < size:
            least = min(least, -sim.bodies.contact_force[0, 2] * -1)
    return sim, sim.bodies.velocity[0, 2] / speed, least


def apart(law, speed=0.004, steps=1000, dt=1e-6):
    """Two spheres drawn apart: (gap, force on the one that moves) of each step."""
    scene = cn.Scene(3)
    scene.add(cn.spheres([[0, 0, 0]], R, STONE, driven=HELD))
    scene.add(cn.spheres([[0, 0, 2 * R - 1e-6]], R, STONE, driven=HELD, drive=[(0, 0, speed, 0, 0, 0)]))
    scene.interact("*", "*", law)
    sim = cn.Simulation(scene, dt, cn.SmoothDEM(unstable="ignore"), overlap="ignore")
    rows = []
    for _ in range(steps):
        sim.step()
        rows.append((sim.bodies.position[1, 2] - 2 * R, sim.bodies.contact_force[1, 2]))
    return np.array(rows).T


def test_parts_of_a_contact_are_those_of_hertz_mindlin():
    one = rebound(cn.granular("hertz", young=1e8, restitution=0.6, mu=0.3))[1]
    assert one == rebound(cn.HertzMindlin(young=1e8, restitution=0.6, mu=0.3))[1]
    assert one == pytest.approx(0.6, rel=2e-3)
    assert rebound(cn.granular("hooke", stiffness=1e5, restitution=0.6), steps=1500)[1] == pytest.approx(0.6, rel=2e-3)


def test_limited_damping_never_pulls():
    free, limited = (rebound(cn.granular(young=1e8, restitution=0.2, limit_damping=on)) for on in (False, True))
    assert free[2] < -1.0 and limited[2] == 0.0
    assert limited[1] > free[1] > 0.15


@pytest.mark.parametrize(
    ("damping", "value", "expected"),
    [("tsuji", 0.9, 0.935), ("mass_velocity", 100.0, 0.94), ("velocity", 1.0, 0.94), ("viscoelastic", 1e5, 0.9)],
)
def test_other_dashpots_take_energy(damping, value, expected):
    given = {"restitution": value} if damping == "tsuji" else {"coefficient": value}
    sim, e, _ = rebound(cn.granular(young=1e8, damping=damping, **given))
    assert expected - 0.1 < e < 0.99
    assert abs(sim.energy["closure"]) < 1e-4 * sim.energy["in_play"]


@pytest.mark.parametrize(("normal", "share"), [("dmt", 2.0), ("jkr", 1.5)])
def test_pull_off_forces(normal, share):
    _, force = apart(cn.granular(normal, young=1e7, work=0.1))
    assert force.min() == pytest.approx(-share * np.pi * 0.1 * R / 2, rel=1e-4)


@pytest.mark.parametrize("fit", [0, 1])
def test_bridges_pull_as_lambert_and_willett_say_until_they_rupture(fit):
    tension, volume, angle = 0.07, 1e-9, 0.3
    gap, force = apart(cn.LiquidBridge(young=1e8, tension=tension, volume=volume, angle=angle, fit=fit), speed=4.0, steps=500)
    end = (1 + angle / 2) * volume ** (1 / 3)
    open_, gone = (gap > 0) & (gap < end), gap > end
    d = gap[open_]
    x = d * np.sqrt(R / volume)
    shape = 1 / (1 + 1.05 * x + 2.5 * x**2) if fit else 1 - 1 / np.sqrt(1 + 2 * volume / (np.pi * R * d**2))
    assert open_.sum() > 100 and gone.sum() > 50
    assert np.allclose(-force[open_], 2 * np.pi * R * tension * np.cos(angle) * shape, rtol=1e-10)
    assert np.all(force[gone] == 0)


def test_a_bridge_gives_back_its_energy_up_to_rupture():
    law = cn.LiquidBridge(young=1e8, tension=0.07, volume=1e-9, restitution=1.0)
    sim, e, _ = rebound(law, speed=0.2, steps=5000)
    taken = 4 * np.pi * R * 0.07 * (1e-3 - np.sqrt(1e-6 + 1e-9 / np.pi / R) + np.sqrt(1e-9 / np.pi / R))
    assert 0.5 * MASS * 0.2**2 * (1 - e**2) == pytest.approx(taken, rel=1e-3)
    assert abs(sim.energy["closure"]) < 1e-4 * sim.energy["in_play"]


def test_a_plastic_spring_rebounds_by_the_ratio_of_its_stiffnesses():
    """Luding (2008): e^2 = k1/k2 of the largest overlap v sqrt(m/k1)."""
    k1, k2, share = 1e5, 3e5, 0.05
    limit = k2 / (k2 - k1) * share * 2 * R
    deepest = np.sqrt(MASS / k1)
    sim, e, _ = rebound(cn.PlasticContact(loading=k1, unloading=k2, plastic=share), steps=800)
    assert e == pytest.approx(np.sqrt(k1 / (k1 + (k2 - k1) * deepest / limit)), rel=1e-4)
    assert abs(sim.energy["closure"]) < 1e-5 * sim.energy["in_play"]


def test_a_cohesive_plastic_spring_pulls_by_its_cohesion():
    sim, e, pull = rebound(cn.PlasticContact(loading=1e5, unloading=5e5, cohesion=1e5, plastic=0.2), speed=0.2, steps=2000)
    assert pull < 0 and 0.5 < e < 0.98


@pytest.mark.parametrize("speed", [0.01, 0.1, 1.0])
def test_yielding_spheres_rebound_as_thornton_and_ning_say(speed):
    young, nu, pressure = 7e10, 0.3, 1e8
    plane = young / 2 / (1 - nu**2)
    depth = R * (np.pi * pressure / 2 / plane) ** 2
    ratio = np.sqrt(2 * 8 / 15 * plane * np.sqrt(R) * depth**2.5 / MASS) / speed
    expected = (
        np.sqrt(6 * np.sqrt(3) / 5) * np.sqrt(1 - ratio**2 / 6) * (ratio / (ratio + 2 * np.sqrt(1.2 - 0.2 * ratio**2))) ** 0.25
    )
    _, e, _ = rebound(cn.YieldContact(young=young, yield_pressure=pressure, poisson=nu), speed=speed, dt=2e-7, steps=1500)
    assert e == pytest.approx(expected, rel=1e-4)


def rolling(law, speed=0.0, slope=0.0, steps=2000, dt=2e-5, dim=3):
    """A round body on a slope: (velocity, spin forwards) of each step."""
    scene = cn.Scene(
        dim,
        gravity=(*(np.array([np.sin(slope), 0, -np.cos(slope)]) * G)[:: 3 - dim or 1],)
        if dim == 3
        else (np.sin(slope) * G, -np.cos(slope) * G),
    )
    mass = MASS if dim == 3 else 2500 * np.pi * R**2
    height = R - mass * G * np.cos(slope) / law.young
    if dim == 3:
        scene.add(
            cn.spheres([[0, 0, height]], R, STONE, velocity=[[speed, 0, 0, 0, speed / R, 0]]),
            cn.wall((0, 0, 0), (0, 0, 1), STONE),
        )
    else:
        scene.add(cn.disks([[0, height]], R, STONE, velocity=[[speed, 0, -speed / R]]), cn.wall((0, 0), (0, 1), STONE))
    scene.interact("*", "*", law)
    sim = cn.Simulation(scene, dt, cn.SmoothDEM())
    rows = []
    for _ in range(steps):
        sim.step()
        rows.append((sim.bodies.velocity[0, 0], sim.bodies.velocity[0, 4] if dim == 3 else -sim.bodies.velocity[0, 2]))
    return sim, np.array(rows).T


MODELS = [dict(rolling="constant_torque"), dict(rolling="spring_dashpot", rolling_damping=0.3)]


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("model", MODELS)
def test_a_rolling_body_slows_down_by_its_coefficient(model, dim):
    """Ai et al. (2011), case 1: mu_r g/(1 + I/(m R^2)), then rest."""
    law = cn.granular("hooke", stiffness=1e5 if dim == 3 else 1e6, restitution=0.5, mu=0.8, rolling_mu=0.2, **model)
    sim, (v, w) = rolling(law, 0.2, steps=2500 if dim == 3 else 2500, dt=4e-5, dim=dim)
    inertia = 0.4 if dim == 3 else 0.5
    slows = 0.2 * G / (1 + inertia)
    t = 4e-5 * np.arange(1, len(v) + 1)
    there = (t > 0.02) & (t < 0.1)
    assert np.allclose(np.diff(v[there][[0, -1]]) / np.diff(t[there][[0, -1]]), -slows, rtol=5e-3)
    assert np.allclose(v[there], w[there] * R, atol=3e-3)
    assert abs(sim.energy["closure"]) < 5e-4 * sim.energy["in_play"]


@pytest.mark.parametrize("model", MODELS)
def test_a_rolling_body_comes_to_rest(model):
    """Ai et al. (2011), case 1: with a spring it stays; a constant torque keeps turning it to and fro, by a step's worth."""
    law = cn.granular("hooke", stiffness=1e5, restitution=0.5, mu=0.8, rolling_mu=0.4, **model)
    _, (v, w) = rolling(law, 0.05, steps=3000, dt=4e-5)
    assert np.abs(v[-300:]).max() < (2e-4 if "damping" in str(model) else 5e-3)


def test_a_sphere_on_a_slope_stays_below_the_coefficient_and_rolls_above():
    """Ai et al. (2011), case 2: rolling resistance holds up to tan(slope) = mu_r, and then gives 5/7 (sin - mu_r cos) g."""
    law = cn.granular(
        "hooke", stiffness=1e5, restitution=0.5, mu=0.8, rolling_mu=0.2, rolling="spring_dashpot", rolling_damping=0.3
    )
    _, (held, _) = rolling(law, slope=0.18, steps=3000, dt=4e-5)
    _, (rolls, _) = rolling(law, slope=0.3, steps=3000, dt=4e-5)
    assert np.abs(held[-100:]).max() < 5e-3
    assert rolls[-1] == pytest.approx(5 / 7 * G * (np.sin(0.3) - 0.2 * np.cos(0.3)) * 0.12, rel=0.05)


def test_twisting_stops_a_top_as_the_limit_says():
    law = cn.granular("hooke", stiffness=1e5, restitution=0.5, mu=0.5, twisting=0.1)
    scene = cn.Scene(3, gravity=(0, 0, -G))
    scene.add(
        cn.spheres([[0, 0, R - MASS * G / 1e5]], R, STONE, velocity=[[0, 0, 0, 0, 0, 100.0]]),
        cn.wall((0, 0, 0), (0, 0, 1), STONE),
    )
    scene.interact("*", "*", law)
    sim = cn.Simulation(scene, 4e-5, cn.SmoothDEM())
    spins = []
    for _ in range(1500):
        sim.step()
        spins.append(sim.bodies.velocity[0, 5])
    slows = 0.1 * R * MASS * G / (0.4 * MASS * R**2)
    assert spins[500] - spins[1499] == pytest.approx(slows * 999 * 4e-5, rel=1e-3)
    assert sim.contacts.moment[0, 2] == pytest.approx(-0.1 * R * MASS * G * 4e-5, rel=1e-3)


def beam(count=9, normal=1e9, ratio=0.4, load=0.01, steps=4000, drag=0.0, **options):
    x = np.zeros((count, 3))
    x[:, 0] = 2 * R * np.arange(count)
    force = np.zeros((count, 6))
    force[-1, 2] = load
    scene = cn.Scene(3)
    scene.add(cn.spheres(x[:1], R, STONE, driven=HELD), cn.spheres(x[1:], R, STONE, force=force[1:], damping=drag))
    scene.interact(
        "*",
        "*",
        cn.SmoothBond(normal_stiffness=normal, tangential_stiffness=ratio * normal, radius=1.0, within=1e-6 * R, **options),
    )
    sim = cn.Simulation(scene, "stable", cn.SmoothDEM())
    sim.dt *= 3
    for _ in range(steps):
        sim.step()
    return sim


def test_a_cantilever_of_bonded_balls_bends_as_a_beam():
    count, normal, load = 9, 1e9, 0.01
    sim = beam(count, normal, load=load, steps=18000, drag=150.0)
    length, inertia, area = 2 * R * (count - 1), np.pi * R**4 / 4, np.pi * R**2
    euler = load * length**3 / (3 * normal * 2 * R * inertia)
    tip = sim.bodies.position[-1, 2]
    assert tip == pytest.approx(euler + load * (count - 1) / (0.4 * normal * area), rel=0.01)
    assert sim.contacts.moment[:, 1].shape == (count - 1,)
    assert np.abs(sim.energy["closure"]) < 1e-3 * sim.energy["in_play"]


def test_bonds_break_where_bending_is_largest():
    """Stress M b/I at the root of the beam; a load that comes at once bends it twice as far."""
    count, load = 6, 0.01
    stress = load * 2 * R * (count - 1.5) * R / (np.pi * R**4 / 4)
    assert len(beam(count, steps=4500, load=load, tension=2.5 * stress).contacts.gap) == count - 1
    sim = beam(count, steps=4500, load=load, tension=1.5 * stress)
    root = np.any(sim.contacts.bodies == 0, axis=1)
    assert np.all(sim.contacts.moment[root] == 0) and np.all(np.abs(sim.contacts.moment[~root]).max(axis=1) > 0)
    assert sim.energy["dissipated_friction"] > 0


def test_bonds_are_made_at_the_start_alone(tmp_path):
    runs = [beam(steps=n) for n in (200, 400)]
    runs[0].checkpoint(tmp_path / "beam.h5")
    second = beam(steps=1)
    second.restore(tmp_path / "beam.h5")
    for _ in range(200):
        second.step()
    assert np.array_equal(second.bodies.position, runs[1].bodies.position)
    scene = cn.Scene(3)
    scene.add(cn.spheres([[0, 0, 0], [2.1 * R, 0, 0]], R, STONE, velocity=[[0] * 6, [-1.0, 0, 0, 0, 0, 0]]))
    scene.interact("*", "*", cn.SmoothBond(normal_stiffness=1e8, tangential_stiffness=1e8))
    sim = cn.Simulation(scene, "stable", cn.SmoothDEM())
    sim.dt /= 3
    for _ in range(4000):
        sim.step()
    assert sim.bodies.velocity[0, 0] == pytest.approx(-1.0, rel=1e-3)  # they met, and parted


def test_mixing_gives_the_effective_moduli():
    steel, glass = cn.HertzMindlin(young=2e11, poisson=0.3, mu=0.2), cn.HertzMindlin(young=6e10, poisson=0.24, mu=0.8)
    both = cn.mix(steel, glass)
    plane = 1 / ((1 - 0.09) / 2e11 + (1 - 0.24**2) / 6e10)
    shear = 1 / (2 * 1.7 * 1.3 / 2e11 + 2 * 1.76 * 1.24 / 6e10)
    assert both.young / 2 / (1 - both.poisson**2) == pytest.approx(plane, rel=1e-12)
    assert both.young / 4 / (2 - both.poisson) / (1 + both.poisson) == pytest.approx(shear, rel=1e-12)
    assert both.mu == pytest.approx(0.4)
    same = cn.mix(steel, steel)
    assert same == steel
    metal = cn.Material("metal", density=7800.0)
    scene = cn.Scene(3)
    cn.interact_by_mixing(scene, {STONE: glass, metal: steel}, pairs={(metal, STONE): {"mu": 0.1}})
    scene.add(cn.spheres([[0, 0, R]], R, STONE), cn.wall((0, 0, 0), (0, 0, 1), metal))
    assert cn.Simulation(scene, 1e-7, cn.SmoothDEM()).stable_step > 0
    with pytest.raises(ValueError, match="same choices"):
        cn.mix(cn.granular(young=1e8), cn.granular("dmt", young=1e8, work=0.1))
    with pytest.raises(ValueError, match="same class"):
        cn.mix(steel, cn.LinearSpring(stiffness=1e5))


def test_words_that_do_not_belong_together_are_refused():
    for match, given in {
        "give stiffness": dict(normal="hooke", young=1e7),
        "give young": dict(normal="hertz", stiffness=1e5),
        "give its coefficient": dict(young=1e7, damping="velocity"),
        "and no coefficient": dict(young=1e7, coefficient=3.0),
        "no moduli": dict(normal="hooke", stiffness=1e5, tangential="mindlin"),
        "rolling is": dict(young=1e7, rolling="epsd"),
        "rolling is None": dict(young=1e7, rolling_mu=0.1),
        "rolling_mu > 0": dict(young=1e7, rolling="constant_torque"),
    }.items():
        with pytest.raises(ValueError, match=match):
            cn.granular(**given)
    with pytest.raises(ValueError, match="'stable'"):
        scene = cn.Scene(3)
        scene.add(cn.spheres([[0, 0, R]], R, STONE))
        cn.Simulation(scene, "stable")


@pytest.mark.parametrize(
    "law",
    [
        cn.granular("jkr", young=1e7, work=0.5, mu=0.3, rolling="spring_dashpot", rolling_mu=0.1, twisting="marshall"),
        cn.LiquidBridge(young=1e7, tension=0.07, volume=1e-10, mu=0.3),
        cn.PlasticContact(loading=2e3, unloading=6e3, cohesion=1e3, mu=0.3),
        cn.YieldContact(young=1e8, yield_pressure=1e5, mu=0.3),
    ],
)
def test_heaps_of_each_law_close_their_balance_and_go_on_from_files(tmp_path, law):
    def heap(dt=2e-5):
        rng = np.random.default_rng(2)
        grid = np.stack(np.meshgrid(*[np.arange(3)] * 3, indexing="ij"), -1).reshape(-1, 3)
        v = np.concatenate([rng.random((27, 3)) - [0.5, 0.5, 1.5], 50 * (rng.random((27, 3)) - 0.5)], 1)
        scene = cn.Scene(3, gravity=(0, 0, -G))
        scene.add(
            cn.spheres(0.0101 * grid + [0, 0, 0.0052], 0.005 * (1 - 0.1 * rng.random(27)), STONE, velocity=v),
            cn.wall((0, 0, 0), (0, 0, 1), STONE),
        )
        scene.interact("*", "*", law)
        return cn.Simulation(scene, dt, cn.SmoothDEM(), overlap="ignore")

    whole, half, second = (heap() for _ in range(3))
    for _ in range(300):
        half.step()
    half.checkpoint(tmp_path / "half.h5")
    second.restore(tmp_path / "half.h5")
    for sim, steps in ((whole, 600), (second, 300)):
        for _ in range(steps):
            sim.step()
    assert abs(whole.energy["dissipated_normal"]) + whole.energy["dissipated_friction"] > 1e-6
    assert np.array_equal(whole.bodies.position, second.bodies.position) and whole.energy == second.energy
    fine = heap(5e-6)
    for _ in range(2400):
        fine.step()
    for sim, gate in ((whole, 2e-2), (fine, 4e-3)):
        assert abs(sim.energy["closure"]) < gate * sim.energy["in_play"]
