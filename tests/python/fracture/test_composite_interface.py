"""Joints of masonry that crack, slide and crush (Lourenco & Rots 1997), against their closed forms and against an integration of
the plasticity by small increments; parameters that no joint has are refused by name."""

import importlib.util
from pathlib import Path

import cairn as cn
import numpy as np
import pytest

WIDTH = 0.2
BRICK, BED = cn.Material("brick", density=2000.0), cn.Material("bed", density=1e18)  # driven bodies alone have no contact
JOINT = dict(normal_stiffness=8.2e10, tangential_stiffness=3.6e10, tension=0.25e6, cohesion=0.35e6, normal_work=18.0,
             tangential_work=125.0, friction=0.75, mu=0.6, cap=10.5e6, cap_work=5000.0, cap_shear=9.0, peak=9e-5)  # fmt: skip
LEAST = dict(normal_stiffness=1e10, tangential_stiffness=1e10, tension=1e5, cohesion=2e5, normal_work=10.0, tangential_work=50.0,
             friction=0.7, mu=0.7)  # fmt: skip


class Rig:
    """A brick on a bed, in 2D or 3D (a square), moved by increments (opening, slip): mean stress, tension positive."""

    def __init__(self, driven=("vx", "vy", "w"), dim=2, dt=1e-3, force=0.0, along=(1.0, 0.0), **given):
        self.dim, self.dt, self.along = dim, dt, np.asarray(along[: dim - 1])
        scene = cn.Scene(dim)
        held = driven if dim == 2 else ("vx", "vy", "vz", "wx", "wy", "wz")
        load = force if callable(force) else (0.0,) * (dim - 1) + (force, *[0.0] * (1 if dim == 2 else 3))
        for low, high, of in ((-0.05, 0.0, dict(material=BED, fixed=len(driven) < 3)),
                              (0.0, 0.05, dict(material=BRICK, driven=held, force=load))):  # fmt: skip
            if dim == 2:
                self.brick = scene.add(cn.polygons([np.array([[0, low], [WIDTH, low], [WIDTH, high], [0, high]])], **of))[0]
            else:
                self.brick = scene.add(cn.boxes([(0, 0, (low + high) / 2)], (WIDTH, WIDTH, high - low), **of))[0]
        scene.interact("*", "*", cn.CompositeInterface(**JOINT | given))
        self.sim = cn.Simulation(scene, dt, cn.NSCD(theta=1.0, solver=cn.Auto(tol=1e-10)))
        self.driven = driven

    def go(self, opening, slip):
        names = ("vx", "vy", "vz")[: self.dim]
        for name, way in zip(names, (*(slip * self.along), opening), strict=True):
            if name in self.driven or self.dim == 3:
                self.sim.drive([self.brick], name, way / self.dt)
        assert self.sim.step()["status"] == "converged"
        force = np.asarray(self.sim.contacts.force).sum(axis=0)  # on the brick or on the bed
        on = np.asarray(self.sim.contacts.bodies)[0, 0] == self.brick
        force = (force if on else -force) / WIDTH ** (self.dim - 1)
        return np.array([-force[-1], -force[:-1] @ self.along])


def strength(k, p):
    """Of the cap after a plastic displacement k [Pa]."""
    f, half = p["cap"], 75 / 67 * p["cap_work"] / p["cap"]
    if k < p["peak"]:
        return f / 3 + 2 * f / 3 * np.sqrt(2 * k / p["peak"] - (k / p["peak"]) ** 2)
    a = (k - p["peak"]) / half
    return f * (1 - a * a / 2) if a < 1 else f / 10 + 0.4 * f * np.exp(-2.5 * (a - 1))


class Increments:
    """Forward Euler: after each small increment surfaces that are exceeded flow by their value over their slope."""

    def __init__(self, **given):
        self.p = JOINT | given
        self.s, self.x, self.k, self.plastic = np.zeros(2), 0.0, 0.0, np.zeros(2)

    def surfaces(self):
        p, (n, t), intact = self.p, self.s, np.exp(-self.x)
        phi = p["mu"] + (p["friction"] - p["mu"]) * intact
        psi, sign = p.get("dilatancy", 0.0) * intact, np.sign(t)
        yield n - p["tension"] * intact, (1.0, 0.0), (1.0, 0.0), "open"
        yield abs(t) + phi * n - p["cohesion"] * intact, (phi, sign), (psi, sign), "slide"
        size = np.sqrt(min(n, 0) ** 2 + p["cap_shear"] * t**2)
        way = np.array([min(n, 0), p["cap_shear"] * t]) / max(size, 1e-300)
        yield size - strength(self.k, p), way, way, "crush"

    def go(self, opening, slip, parts):
        p, stiff = self.p, np.array([self.p["normal_stiffness"], self.p["tangential_stiffness"]])
        for _ in range(parts):
            self.s = self.s + stiff * np.array([opening, slip]) / parts
            for _ in range(60):
                worst = max(self.surfaces(), key=lambda f: f[0])
                if worst[0] < 1.0:  # Pa
                    break
                f, slope, flow, kind = worst
                step = f / np.dot(slope, stiff * np.array(flow))
                self.s, self.plastic = self.s - stiff * step * np.array(flow), self.plastic + step * np.array(flow)
                if kind == "open":
                    self.x += p["tension"] / p["normal_work"] * step
                elif kind == "slide":
                    self.x += p["cohesion"] / p["tangential_work"] * step
                else:
                    self.k += step * np.hypot(*flow)
        return self.s


@pytest.mark.parametrize("dim", [2, 3])
def test_pure_tension_takes_the_work_of_the_crack(dim):
    """s = f e^-x, x = f w/G of the width w, d = w + s/k; elastic up to f."""
    rig, d = Rig(dim=dim), 0.0
    for k in range(40):
        s, _ = rig.go(1e-5 if k else 2e-6, 0)
        d += 1e-5 if k else 2e-6
        w = d - s / 8.2e10
        assert np.isclose(s, min(8.2e10 * d, 0.25e6 * np.exp(-0.25e6 * w / 18.0)), rtol=1e-6)
    beta = rig.sim.contacts.of_laws()["beta"]
    assert np.allclose(beta, np.exp(-0.25e6 * w / 18.0), rtol=1e-6)
    released = rig.sim.info["energy"]["released"] / WIDTH ** (dim - 1)
    assert np.isclose(released, 18.0 * (1 - beta[0]), rtol=0.08)  # stresses at ends of steps


@pytest.mark.parametrize("dim, along", [(2, (1.0,)), (2, (-1.0,)), (3, (0.6, 0.8))])
def test_shear_under_constant_pressure_softens_to_friction(dim, along):
    """t = c e^-x - s tan(phi), x = c/G of the plastic slip, d = slip + t/k."""
    pressure, d = 1e6, 0.0
    if dim == 2:
        rig = Rig(("vx", "w"), force=-pressure * WIDTH, along=along)
        rig.go(0, 0)
    else:
        rig = Rig(dim=3, along=along)
        rig.go(-pressure / 8.2e10, 0)
    for _ in range(40):
        s, t = rig.go(0, 4e-5)
        d += 4e-5
        assert np.isclose(s, -pressure, rtol=2e-3)
        intact = np.exp(-0.35e6 / 125.0 * max(0.0, d - t / 3.6e10))
        phi = 0.6 + 0.15 * intact
        assert np.isclose(t, min(3.6e10 * d, 0.35e6 * intact - s * phi), rtol=1e-6)
    assert intact < 0.02


@pytest.mark.parametrize("dim", [2, 3])
def test_compression_to_crushing(dim):
    """s = -f(k), d = -k - f/stiffness: hardens to the cap, falls to a tenth."""
    rig, d, largest = Rig(dim=dim), 0.0, 0.0
    for _ in range(60):
        s, t = rig.go(-4e-5, 0)
        d += 4e-5
        crushed = d + s / 8.2e10
        assert np.isclose(-s, min(8.2e10 * d, strength(crushed, JOINT)), rtol=1e-6) and abs(t) < 1.0
        largest = max(largest, -s)
    assert 10.4e6 < largest <= 10.5e6 and 1.05e6 < -s < 1.3e6
    area = WIDTH ** (dim - 1)
    hardens = 10.5e6 * 9e-5 * (1 / 3 + 2 / 3 * np.pi / 4)
    whole = 5000.0 + hardens + 1.05e6 * (crushed - 9e-5)
    assert np.isclose(rig.sim.info["energy"]["released"] / area, whole, rtol=0.03)


def test_unloading_is_elastic_and_a_crack_closes_freely():
    rig = Rig()
    for _ in range(20):
        s, _ = rig.go(2e-6, 0)
    assert np.isclose(rig.go(-s / 8.2e10 / 2, 0)[0], s / 2, rtol=1e-6)
    assert np.isclose(rig.go(s / 8.2e10 / 4, 0)[0], 3 * s / 4, rtol=1e-6)
    width = 40e-6 - s / 8.2e10
    rig.go(-3 * s / 4 / 8.2e10, 0)
    for _ in range(9):
        assert abs(rig.go(-width / 10, 0)[0]) < 1e-9 * 0.25e6
    assert np.isclose(rig.go(-width / 10 - 1e-5, 0)[0], -8.2e5, rtol=1e-6)
    assert np.isclose(rig.go(1e-5 + 1e-6, 0)[0], 8.2e4, rtol=1e-6)  # and bears the tension that is left
    stays = Rig(closes=0)
    for _ in range(20):
        s, _ = stays.go(2e-6, 0)
    assert np.isclose(stays.go(-s / 8.2e10 - 1e-6, 0)[0], -8.2e4, rtol=1e-6)
    crushed = Rig()
    for _ in range(30):
        s, _ = crushed.go(-1e-5, 0)
    assert np.isclose(crushed.go(2e-5, 0)[0], s + 8.2e10 * 2e-5, rtol=1e-6)
    assert np.isclose(crushed.go(-1e-5, 0)[0], s + 8.2e10 * 1e-5, rtol=1e-6)


def test_passes_over_bodies_know_what_a_joint_gives_way_by():
    """Regression: they took its compliance for none, and sweeps went on to their limit."""
    rig = Rig(("vx", "w"), force=-1e6 * WIDTH)
    rig.go(0, 0)
    for _ in range(5):
        rig.go(0, 2e-5)
        assert rig.sim.info["iterations"] < 50


PATHS = {
    "opens and slides": [(1e-6, 2e-6)] * 20,
    "presses, then slides into the cap": [(-8e-6, 0)] * 10 + [(-4e-6, 1e-5)] * 20,
    "slides under the cap as it softens": [(-1e-5, 2e-6)] * 40 + [(0, -1e-5)] * 10,
    "shears, turns back, opens": [(-2e-7, 4e-6)] * 10 + [(0, -6e-6)] * 8 + [(2e-6, 0)] * 8,
}


@pytest.mark.parametrize("given", [{}, {"dilatancy": 0.2}, {"cap_shear": 0.0}])
@pytest.mark.parametrize("path", PATHS)
def test_combined_paths_are_those_of_small_increments(path, given):
    """Within 2 % of the largest stress until then, the first-order error of increments of this size."""
    rig, hand, largest = Rig(closes=0, **given), Increments(**given), 0.25e6
    for opening, slip in PATHS[path]:
        for _ in range(2):
            s, expected = rig.go(opening / 2, slip / 2), hand.go(opening / 2, slip / 2, parts=16)
            largest = max(largest, np.abs(expected).max())
            assert np.allclose(s, expected, rtol=0, atol=0.02 * largest), (s, expected)


@pytest.mark.parametrize("given, name", [
    ({"tension": 3e5}, "tension.*cohesion/friction = 2857"),
    ({"dilatancy": 0.8}, "dilatancy.*friction = 0.7"),
    ({"normal_work": 0.9}, "normal_work.*more than 1 J/m2"),
    ({"tangential_work": 0.0}, "tangential_work.*more than 4 J/m2"),
    ({"cap": 1e7, "cap_work": 8000.0}, "cap_work.*more than 893"),
    ({"cap": 0.0}, "cap of CompositeInterface is 0"),
    ({"normal_stiffness": 0.0}, "normal_stiffness"),
    ({"closes": 2}, "closes"),
    ({"peak": np.nan}, "peak"),
])  # fmt: skip
def test_what_is_no_joint_is_refused_by_name(given, name):
    cn.CompositeInterface(**LEAST)
    with pytest.raises(ValueError, match=name):
        cn.CompositeInterface(**LEAST | given)


@pytest.mark.parametrize("given", [
    {"tension": 0.0, "cohesion": 0.0, "friction": 0.0, "mu": 0.0},
    {"normal_stiffness": np.inf, "tangential_stiffness": np.inf},
    {"cap": np.inf}, {"cap_work": np.inf, "peak": 0.0}, {"normal_work": np.inf, "tangential_work": np.inf}, {"cap_shear": 1e30},
])  # fmt: skip
def test_extremes_stay_finite(given):
    """Forces press, tear and press the brick again, beyond the strengths of the joint."""
    def force(t):
        load = (-1e4, -1e7, 1e5, -1e5)[min(3, int(t / 0.02))]
        return (load / 3, load, 0.0)

    rig = Rig(("w",), force=force, **given)
    for _ in range(80):
        rig.sim.step()
        assert np.all(np.isfinite(rig.sim.bodies.position)) and np.all(np.isfinite(rig.sim.contacts.force))
    energy = rig.sim.info["energy"]
    assert np.all(np.isfinite([energy["stored"], energy["released"]])) and energy["released"] >= 0


def shear_wall():
    """The module benchmarks/shear_wall.py."""
    spec = importlib.util.spec_from_file_location("shear_wall", Path(__file__).parents[3] / "benchmarks" / "shear_wall.py")
    wall = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(wall)
    return wall


def test_squat_wall_cracks_slides_and_crushes():
    """Four courses of the shear wall of benchmarks/shear_wall.py, whose top slides at last; with a cap of 2 MPa it bears less."""
    wall = shear_wall()
    peaks = []
    for joint in (wall.JOINT, wall.JOINT | dict(cap=2e6, cap_work=500.0)):
        sim, top = wall.build(1e-4, courses=4, halves=5, joint=joint)
        wall.press(sim, 1e-4)
        rows = np.array(list(wall.shear(sim, top, 0.03, 0.9e-3, outputs=12)))
        assert np.all(rows[:, 3] == 0)
        peaks.append(rows[:, 1].max())
    area = 5 / 9 * 0.99 * 0.1
    assert peaks[0] < 1e-3 * area * (0.35e6 + 0.75 * 1e3 * rows[:, 2].max() / area) * 1.2
    assert peaks[1] < 0.85 * peaks[0]
    assert np.isclose(rows[-1, 1], 0.75 * rows[-1, 2], rtol=0.6)


def test_wall_of_meshes_is_as_stiff_as_joints_and_bricks_in_series():
    """Pressed by p, a wall of meshes of height H with five joints shortens by p (H/E + 5/k), and joints alone bear the load."""
    wall = shear_wall()
    sim, top = wall.build(1e-3, courses=4, halves=5, joint=wall.BARE_JOINT, crack=wall.STIFF_CRACK, cells=2)
    before = sim.bodies.position[top][1]
    wall.press(sim, 1e-4, cells=2)
    contacts, height = sim.contacts, 4 * wall.COURSE
    pressed = (contacts.force * contacts.normal).sum(axis=1)
    assert pressed[contacts.beta == 0].sum() < 1e-3 * pressed.sum()
    joints = (4 + 1) / wall.BARE_JOINT["normal_stiffness"]
    assert np.isclose(before - sim.bodies.position[top][1], wall.PRESSURE * (height / wall.YOUNG + joints), rtol=5e-3)
