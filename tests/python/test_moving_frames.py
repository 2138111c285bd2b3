"""Bars and beams that move far: exact derivatives, closed forms, motions of any size, contact."""

import cairn as cn
import numpy as np
import pytest

SECTION = {"young": 2e7, "area": 3e-2, "density": 1e3}
BEAM = SECTION | {"inertia": 4e-5, "poisson": 0.3}


def line(n, dim, length=1.0):
    points = np.zeros((n + 1, dim))
    points[:, 0] = np.linspace(0, length, n + 1)
    return points, np.c_[:n, 1 : n + 1]


def kinds():
    out = []
    for dim in (2, 3):
        for kinematics in ("corotational", "total_lagrangian"):
            out.append(pytest.param("bars", dim, kinematics, {}, id=f"bars {dim} {kinematics}"))
        for name, more in {"thin": {}, "shears": {"shear_area": 2e-2}, "pulled": {"initial_stress": 3e4}}.items():
            out.append(pytest.param("beams", dim, "corotational", more, id=f"beams {dim} {name}"))
    return out


def truss(kind, dim, kinematics, more, seed=0):
    """A few cells that meet, in any directions."""
    rng = np.random.default_rng(seed)
    points = np.array([[0, 0, 0], [1, 0.2, 0.1], [1.9, -0.2, 0.4], [0.8, 1.1, -0.3], [0.5, 0.4, 1.2]])[:, :dim]
    cells = [[0, 1], [1, 2], [1, 3], [3, 2], [0, 4], [4, 3], [4, 1]][: 4 if dim == 2 else 7]
    points = points[: 4 if dim == 2 else 5]
    given = dict(SECTION)
    if kind == "beams":
        two = np.array([4e-5, 1e-5])
        given = BEAM | {"inertia": two if dim == 3 else 4e-5, "clamped": [0], "up": (0.1, 0.3, 1.0)}
    return getattr(cn, kind)(points, cells, kinematics=kinematics, **given | more), rng


@pytest.mark.parametrize("kind, dim, kinematics, more", kinds())
def test_forces_are_the_gradient_of_the_energy_and_the_tangent_that_of_forces(kind, dim, kinematics, more):
    body, rng = truss(kind, dim, kinematics, more)
    u = 0.15 * rng.standard_normal(body.points.shape)
    model = body.model()
    force, tangent, _ = body.tangent(u, model)
    way, h = rng.standard_normal(u.shape), 1e-4
    ends = [body.tangent(u + s * h * way) for s in (-2, -1, 1, 2)]

    def rate(values):  # of the fourth order
        return (values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * h)

    assert force @ way.ravel() == pytest.approx(rate([end[2] for end in ends]), rel=1e-8)
    change = rate([end[0] for end in ends])
    assert np.abs(tangent @ way.ravel() - change).max() < 1e-8 * np.abs(change).max()


@pytest.mark.parametrize("kind, dim, kinematics, more", kinds())
def test_at_rest_they_are_the_linear_ones(kind, dim, kinematics, more):
    body, rng = truss(kind, dim, kinematics, more)
    small, _ = truss(kind, dim, "small", more)
    force, tangent, energy = body.tangent(np.zeros_like(body.points))
    assert np.abs(tangent - small.K).max() < 1e-9 * np.abs(small.K).max()
    given = np.zeros_like(force) if small.initial_force is None else small.initial_force
    assert np.abs(force - given).max() <= 1e-12 * max(np.abs(given).max(), np.abs(small.K).max())
    assert energy == pytest.approx(small.initial_energy, rel=1e-12)


def rotation(vector):
    angle = np.linalg.norm(vector)
    x, y, z = vector / angle
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


@pytest.mark.parametrize("kind, dim, kinematics, more", kinds())
def test_a_rigid_motion_of_any_size_is_none_to_them(kind, dim, kinematics, more):
    if more.get("initial_stress"):
        pytest.skip("what is pulled turns its forces with it: below")
    body, rng = truss(kind, dim, kinematics, more | ({"clamped": None} if kind == "beams" else {}))
    for angle in (1e-8, 0.7, np.pi / 2, 3.1, np.pi):
        about = np.array([0, 0, 1.0]) if dim == 2 else rng.standard_normal(3)
        turned = body.points @ rotation(angle * about / np.linalg.norm(about))[:dim, :dim].T
        force, _, energy = body.tangent(turned + 10 - body.points)
        assert np.abs(force).max() < 1e-13 * np.abs(body.K).max() * 10, angle
        assert 0 <= energy < (1e-13 * 10) ** 2 * np.abs(body.K).max()


@pytest.mark.parametrize("dim", [2, 3])
def test_elastica(dim):
    """A clamped beam under a dead load P across its end, to P L^2/EI = 10, against elliptic integrals."""
    from scipy.optimize import brentq
    from scipy.special import ellipk, ellipkinc, ellipeinc, ellipe

    points, cells = line(40, dim)
    bend = SECTION["young"] * 4e-5
    body = cn.beams(points, cells, **BEAM | {"area": 4e-5 * 12 * 1e4}, clamped=[0], groups={"foot": [0]}, kinematics="corotational")
    u, model = np.zeros_like(points), body.model()
    for load in (0.5, 1.0, 3.0, 5.0, 10.0):

        def misses(k, load=load):
            return ellipk(k * k) - ellipkinc(np.arcsin(1 / (k * np.sqrt(2))), k * k) - np.sqrt(load)

        k = brentq(misses, np.sqrt(0.5) * (1 + 1e-12), 1 - 1e-14)
        start = np.arcsin(1 / (k * np.sqrt(2)))
        across = 1 - 2 / np.sqrt(load) * (ellipe(k * k) - ellipeinc(start, k * k))
        along = np.sqrt(2 / load * (2 * k * k - 1))
        force = np.zeros_like(points)
        force[-1, 1] = load * bend
        u = body.solve({"foot": "xyz"[:dim]}, force.ravel(), start=u, model=model)
        assert u[-1, 1] == pytest.approx(across, rel=1e-3), load
        assert 1 + u[-1, 0] == pytest.approx(along, rel=1e-3), load
        if dim == 3:
            assert np.abs(u[:, 2]).max() < 1e-10


def test_a_bend_of_45_degrees():
    """Bathe & Bolourchi 1979: a cantilever along an eighth of a circle of radius 100, a force across its plane at the end. Its
    place there under 300, 450 and 600: Simo & Vu-Quoc 1986 (22.33 58.84 40.08; 18.62 52.32 48.39; 15.79 47.23 53.37)."""
    angle = np.linspace(0, np.pi / 4, 17)
    points = np.c_[100 * (1 - np.cos(angle)), 100 * np.sin(angle), 0 * angle]
    body = cn.beams(points, np.c_[:16, 1:17], young=1e7, area=1.0, inertia=1 / 12, torsion=1 / 6, poisson=0.0, density=1.0,
                    clamped=[0], groups={"foot": [0]}, kinematics="corotational")  # fmt: skip
    u, model = np.zeros_like(points), body.model()
    for load, place in {300: (22.33, 58.84, 40.08), 450: (18.62, 52.32, 48.39), 600: (15.79, 47.23, 53.37)}.items():
        force = np.zeros_like(points)
        force[-1, 2] = load
        u = body.solve({"foot": "xyz"}, force.ravel(), start=u, model=model, increments=4)
        assert points[-1] + u[-1] == pytest.approx(place, abs=0.01 * 80), load
        print(load, points[-1] + u[-1])


@pytest.mark.parametrize("kinematics", ["corotational", "total_lagrangian"])
def test_von_mises_truss_snaps_through(kinematics):
    """Two bars from (-1, 0), (1, 0) to (0, 0.3): the force that holds the middle at any height, in closed form."""
    points, size = np.array([[-1.0, 0], [1, 0], [0, 0.3]]), np.hypot(1, 0.3)
    body = cn.bars(points, [[0, 2], [1, 2]], young=3e5, area=1e-3, density=1.0, kinematics=kinematics)
    for height in (0.3, 0.2, 0.1, 0.0, -0.1, -0.3, -0.5):
        long = np.hypot(1, height)
        of = (long - size) / size / long if kinematics == "corotational" else (long**2 - size**2) / (2 * size**3)
        u = np.zeros_like(points)
        u[2, 1] = height - 0.3
        force = body.tangent(u)[0]
        assert force[5] == pytest.approx(2 * 300.0 * of * height, rel=1e-12, abs=1e-13 * 300)
        assert abs(force[4]) <= 1e-13 * 300


def tumbling(kind, dim, strategy, dt, kinematics="corotational", seed=1):
    body, rng = truss(kind, dim, kinematics, {"clamped": None} if kind == "beams" else {})
    about = np.array([0, 0, 9.0]) if dim == 2 else np.array([3.0, -6.0, 5.0])
    full = np.c_[body.points, np.zeros((len(body.points), 3 - dim))]
    mass = body.nodal_mass()
    centre = mass @ full / mass.sum()
    velocity = (np.cross(about, full - centre) + [0.4, -0.2, 0.0])[:, :dim]
    velocity = velocity + 0.2 * rng.standard_normal(velocity.shape)
    scene = cn.Scene(dim=dim, gravity=np.zeros(dim))
    scene.add(cn.deformable(body, cn.Material("steel", density=1.0), velocity=velocity))
    return cn.Simulation(scene, dt, strategy), mass


def momenta(sim, mass):
    view = sim.meshes[0]
    x, v = (np.c_[a, np.zeros((len(a), 3 - a.shape[1]))] for a in (view._mesh.d.body.points + view.displacement, view.velocity))
    return mass @ v, (mass[:, None] * np.cross(x, v)).sum(axis=0)


@pytest.mark.parametrize("kind, dim", [("bars", 2), ("bars", 3), ("beams", 2), ("beams", 3)])
def test_a_free_frame_tumbles_through_many_turns(kind, dim):
    """The midpoint rule keeps both momenta, of quadratic invariants, and energy to its order."""
    drift = []
    for dt in (4e-3, 2e-3):
        sim, mass = tumbling(kind, dim, cn.NSCD(cn.Theta(0.5), newton_tolerance=1e-12), dt)
        linear, angular = momenta(sim, mass)
        energies = []
        for _ in range(int(round(4.0 / dt))):
            sim.step()
            energy = sim.energy
            energies.append(energy["kinetic"] + energy["stored"])
        now = momenta(sim, mass)
        assert np.abs(now[0] - linear).max() < 1e-9 * np.abs(linear).max()
        assert np.abs(now[1] - angular).max() < 1e-9 * np.abs(angular).max()
        drift.append(np.ptp(energies[len(energies) // 8 :]) / np.mean(energies))
    print(kind, dim, drift)
    assert drift[1] < 0.4 * drift[0] < 0.02
