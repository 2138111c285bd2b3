"""Bodies with a stress before they move: rest under gravity, bars, strings and beams that are pulled, yield, files."""

import cairn as cn
import numpy as np
import pytest
from cairn import DruckerPrager, FiniteJ2, IsotropicElastic, J2Plasticity, NeoHookean, SolidBody
from second_order import box

ROCK = cn.Material("rock", density=2000.0)
G, DENSITY, K0, HEIGHT = 10.0, 2000.0, 0.5, 4.0
LAWS = {
    "elastic": (IsotropicElastic(young=2e7, poisson=0.3), "small"),
    "orthotropic": (
        cn.OrthotropicElastic(young1=2e7, young2=1e7, young3=3e7, poisson12=0.2, poisson13=0.1, poisson23=0.15, shear12=8e6,
                              shear23=7e6, shear13=9e6),
        "small",
    ),
    "kelvin_voigt": (cn.KelvinVoigt(young=2e7, poisson=0.3, viscous_young=1e5), "small"),
    "corotational": (IsotropicElastic(young=2e6, poisson=0.3), "corotational"),
    "green": (IsotropicElastic(young=2e6, poisson=0.3), "total_lagrangian"),
    "hencky": (IsotropicElastic(young=2e6, poisson=0.3), "logarithmic"),
    "neo_hookean": (NeoHookean(young=1e6, poisson=0.3), None),
    "kirchhoff": (cn.SaintVenantKirchhoff(young=1e6, poisson=0.3), None),
    "ogden": (cn.Ogden(bulk=2e6, shear1=4e5, power1=2.0), None),
    "j2": (J2Plasticity(young=2e7, poisson=0.3, yield_stress=1e5), "small"),
    "finite_j2": (FiniteJ2(young=2e6, poisson=0.3, yield_stress=1e5), None),
    "drucker_prager": (DruckerPrager(young=2e7, poisson=0.3, cohesion=1e4, friction_angle=0.5), "small"),
    "damage": (cn.IsotropicDamage(young=2e7, poisson=0.3, strength=1e6, fracture_energy=1e6), "small"),
}  # fmt: skip


def at_rest(x):
    """Stress under gravity, pressed by K0 of it sideways."""
    down = DENSITY * G * (x[:, -1] - HEIGHT)
    out = np.zeros((len(x), 6))
    out[:, :3] = K0 * down[:, None]
    out[:, 1 if x.shape[1] == 2 else 2] = down
    return out


def column(kind, law, kinematics, **options):
    dim = 2 if kind in ("triangle", "quad", "quad8", "quad9", "triangle6") else 3
    points, cells = box(kind, (2,) * (dim - 1) + (3,), (1.0,) * (dim - 1) + (HEIGHT,))
    groups = {"foot": np.flatnonzero(points[:, -1] < 1e-9)}
    fixed = {"foot": "xyz"[:dim]}
    for axis in range(dim - 1):
        groups["side " + "xy"[axis]] = np.flatnonzero(np.isin(points[:, axis], (0.0, 1.0)))
        fixed["side " + "xy"[axis]] = "xy"[axis]
    body = SolidBody(points, cells, law, density=DENSITY, kinematics=kinematics, groups=groups, **options)
    scene = cn.Scene(dim=dim, gravity=(0.0,) * (dim - 1) + (-G,))
    scene.add(cn.deformable(body, ROCK, fixed=fixed, initial_stress=at_rest))
    return scene


def stays(sim, steps=5):
    start = sim.meshes[0].position
    for _ in range(steps):
        assert sim.step()["status"] == "converged"
    moved = np.abs(sim.meshes[0].position - start).max() / HEIGHT
    speed = np.abs(sim.meshes[0].velocity).max() / (G * sim.dt)
    found = sim.meshes[0].stress
    for kind, cells in sim.meshes[0].body.cells.items():
        wanted = at_rest(sim.meshes[0].body.points).T[:, cells].mean(axis=2).T[:, [0, 1, 2, 3, 5, 4]]
        if sim.meshes[0].body.points.shape[1] == 2 and found[kind].shape[1] == 3:
            wanted = wanted[:, [0, 1, 3]]
        assert np.allclose(found[kind], wanted, rtol=0, atol=1e-11 * DENSITY * G * HEIGHT)
    return moved, speed


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("kind", ["quad", "tetra"])
def test_a_column_under_gravity_stays(law, kind):
    sim = cn.Simulation(column(kind, *LAWS[law]), dt=1e-2)
    assert np.any(next(iter(sim.meshes[0].stress.values())))  # before the first step
    moved, speed = stays(sim)
    assert moved < 1e-13 and speed < 1e-10
    energy = sim.info["energy"]
    assert abs(energy["closure"]) <= 1e-12 * max(energy["in_play"], 1.0)


@pytest.mark.parametrize(
    "kind", ["triangle", "quad8", "quad9", "triangle6", "hexahedron", "tetra10", "hexahedron20", "hexahedron27"]
)
@pytest.mark.parametrize("law", ["elastic", "neo_hookean"])
def test_every_element_carries_it(kind, law):
    moved, speed = stays(cn.Simulation(column(kind, *LAWS[law]), dt=1e-2), steps=2)
    assert moved < 1e-13 and speed < 1e-10


@pytest.mark.parametrize("plane", ["strain", "stress", "axisymmetric"])
@pytest.mark.parametrize("kinematics", ["small", "total_lagrangian"])
@pytest.mark.parametrize("mean", [False, True])
def test_every_plane(plane, kinematics, mean):
    """A uniform stress, balanced by its own forces at all boundary nodes, stays and is displayed."""
    if plane == "stress" and mean:
        pytest.skip("mean dilatation has no use in plane stress")
    points, cells = box("quad", (3, 3), (1.0, 1.0))
    points[:, 0] += 1.0
    stress = np.array([3e4, -2e4, 0.0 if plane == "stress" else 1e4, 1.5e4, 0.0, 0.0])
    law = IsotropicElastic(young=1e6, poisson=0.3)
    body = SolidBody(points, cells, law, density=1000.0, plane=plane, kinematics=kinematics, mean_dilatation=mean,
                     initial_stress=stress, thickness=0.5)  # fmt: skip
    force, k, energy, _ = body.tangent(np.zeros_like(points))
    model = body.model()
    assert np.allclose(body.stress(np.zeros_like(points), model)["quad"], stress[[0, 1, 2, 3, 5, 4]], rtol=0, atol=1e-9)
    # the tangent is the difference of the forces, these that of the energy
    rng = np.random.default_rng(0)
    u, e = 0.02 * rng.random(points.size), 1e-6 * (rng.random(points.size) - 0.5)
    ahead, behind = body.tangent(u + e), body.tangent(u - e)
    here = body.tangent(u)
    start, row = body.lower[:2]
    from scipy import sparse

    below = sparse.csc_array((here[1], row, start), (len(u), len(u)))
    full = below + sparse.tril(below, -1).T
    assert (ahead[2] - behind[2]) / 2 == pytest.approx(here[0] @ e, rel=1e-6)
    change = (ahead[0] - behind[0]) / 2
    assert np.allclose(change, full @ e, rtol=0, atol=1e-6 * np.abs(change).max())


def test_linear_bodies_carry_it_as_their_law_does():
    """An ElasticBody that is released from a stress, and the SolidBody of the same law: the same way, stress and energy; the
    balance closes at theta 1/2."""
    ways = []
    points, cells = box("quad", (3, 2), (1.5, 1.0))
    left = np.flatnonzero(points[:, 0] < 1e-9)
    for solid in (False, True):
        options = {"density": 1000.0, "groups": {"left": left}, "plane": "stress", "thickness": 0.3}
        if solid:
            body = SolidBody(points, cells, IsotropicElastic(young=1e6, poisson=0.3), **options)
        else:
            body = cn.ElasticBody(points, cells, young=1e6, poisson=0.3, **options)
        scene = cn.Scene(dim=2, gravity=(0.0, -1.0))
        scene.add(cn.deformable(body, ROCK, fixed={"left": "xy"}, initial_stress=(2e4, -1e4, 0, 5e3, 0, 0)))
        sim = cn.Simulation(scene, dt=1e-3, strategy=cn.NSCD(theta=0.5))
        start = sim.info["energy"]["stored"]
        for _ in range(40):
            sim.step()
        energy = sim.info["energy"]
        assert abs(energy["closure"]) < 1e-10 * energy["in_play"]
        ways.append((sim.meshes[0].displacement, energy["stored"], energy["kinetic"], sim.meshes[0].reaction("left"), start))
        if not solid:
            shown = sim.meshes[0].stress["quad"]
            assert np.allclose(shown, (sim.meshes[0].body.stress(sim.meshes[0].displacement))["quad"])
        assert np.abs(ways[-1][0]).max() > 1e-3
    for one, two in zip(*ways):
        assert np.allclose(one, two, rtol=1e-7, atol=1e-12)


@pytest.mark.parametrize("solid", [False, True])
def test_a_bar_that_is_released_swings_by_the_closed_form(solid):
    """A bar, clamped at one end and pulled by s0 before it is let go: it shortens by s0 L/E at most twice, first mode
    8/pi^2 s0 L/E and period 4 L/c."""
    n, young, density, stress = 40, 1e7, 1000.0, 1e4
    points, cells = box("quad", (n, 1), (1.0, 1.0 / n))
    groups = {"left": np.flatnonzero(points[:, 0] < 1e-9), "all": np.arange(len(points))}
    law = {"young": young, "poisson": 0.0}
    if solid:
        body = SolidBody(points, cells, IsotropicElastic(**law), density=density, groups=groups, lumped=True)
    else:
        body = cn.ElasticBody(points, cells, density=density, groups=groups, lumped=True, **law)
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(body, ROCK, fixed={"left": "x", "all": "y"}, initial_stress={"all": (stress, 0, 0, 0, 0, 0)}))
    c = np.sqrt(young / density)
    sim = cn.Simulation(scene, dt=0.25 / n / c, strategy=cn.NSCD(theta=0.5))
    right, tip, steps = points[:, 0] > 1 - 1e-9, [], round(4.0 / (c * sim.dt))
    for _ in range(steps):
        sim.step()
        tip.append(sim.meshes[0].displacement[right, 0].mean())
    whole = stress / young
    assert -min(tip) == pytest.approx(2 * whole, rel=0.02)
    time = c * sim.dt * np.arange(1, steps + 1)
    exact = -whole * np.minimum(time, 4 - time)  # the wave goes there and back
    assert np.sqrt(np.mean((np.array(tip) - exact) ** 2)) < 0.01 * whole


def frequency(body, fixed, shape, expected):
    """Frequency of small oscillations of a body in its first shape, by the times at which its middle passes the rest position."""
    scene = cn.Scene(dim=2)
    velocity = np.zeros_like(body.points)
    velocity[:, 1] = 1e-4 * shape(body.points[:, 0])
    scene.add(cn.deformable(body, ROCK, fixed=fixed, velocity=velocity))
    sim = cn.Simulation(scene, dt=1 / (200 * expected), strategy=cn.NSCD(theta=0.5))
    way = [0.0]
    for _ in range(450):
        sim.step()
        way.append(velocity[:, 1] @ sim.meshes[0].displacement[:, 1])
    way = np.array(way)
    turns = np.flatnonzero(way[1:-1] * way[2:] < 0) + 1
    turns = turns - way[turns] / (way[turns + 1] - way[turns])
    return 1 / (2 * sim.dt * np.diff(turns).mean())


def test_a_string_sounds_by_its_pull():
    """f = 1/(2 L) sqrt(N / mu) of bars that alone could not swing."""
    n, area, density, stress = 32, 1e-6, 8000.0, 2e8
    points = np.c_[np.linspace(0, 1, n + 1), np.zeros(n + 1)]
    body = cn.bars(
        points, np.c_[:n, 1 : n + 1], young=2e11, area=area, density=density, initial_stress=stress, groups={"ends": [0, n]}
    )
    exact = 0.5 * np.sqrt(stress / density)
    found = frequency(body, {"ends": "xy"}, lambda x: np.sin(np.pi * x), exact)
    assert found == pytest.approx(exact, rel=1e-3)


@pytest.mark.parametrize("pull", [0.0, 1.0, 4.0, -0.5])
def test_a_beam_is_stiffer_by_its_pull(pull):
    """omega = (pi/L)^2 sqrt(E I/mu) sqrt(1 + N L^2/(pi^2 E I)), pinned; it is nought where it buckles."""
    n, side, young, density = 16, 0.02, 2e11, 8000.0
    area, inertia = side**2, side**4 / 12
    points = np.c_[np.linspace(0, 1, n + 1), np.zeros(n + 1)]
    stress = pull * np.pi**2 * young * inertia / area
    body = cn.beams(points, np.c_[:n, 1 : n + 1], young=young, area=area, inertia=inertia, density=density,
                    initial_stress=stress, groups={"ends": [0, n]})  # fmt: skip
    exact = np.pi / 2 * np.sqrt(young * inertia / (density * area)) * np.sqrt(1 + pull)
    found = frequency(body, {"ends": "xy"}, lambda x: np.sin(np.pi * x), exact)
    assert found == pytest.approx(exact, rel=2e-3)


def test_beams_in_space_are_pulled_as_in_the_plane():
    """Along any direction, deflected along either axis of their sections."""
    rng = np.random.default_rng(3)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0].T
    along = np.linspace(0, 1, 5)
    made = {"young": 2e11, "area": 4e-4, "inertia": 1e-8, "density": 8000.0, "initial_stress": -3e7, "clamped": [0]}
    cells = np.c_[:4, 1:5]
    flat = np.asarray(cn.beams(np.c_[along, 0 * along], cells, **made).K.todense())
    body = cn.beams(along[:, None] * axes[0], cells, up=axes[1], **made)
    k = np.asarray(body.K.todense()).reshape(5, 3, 5, 3)
    turned = np.einsum("mi,aibj,nj->ambn", axes, k, axes)
    for axis in (1, 2):
        assert np.allclose(turned[:, axis, :, axis], flat.reshape(5, 2, 5, 2)[:, 1, :, 1], rtol=0, atol=1e-9 * np.abs(flat).max())
    force = body.initial_force.reshape(5, 3) @ axes.T
    assert np.allclose(force[[0, -1], 0], [3e7 * 4e-4, -3e7 * 4e-4]) and np.abs(force[:, 1:]).max() < 1e-9 * 3e7 * 4e-4


def test_a_beam_of_cells_is_stiffer_where_its_kinematics_know_it():
    """Initial stress changes the frequency of a slender strip of Q8 cells at large strains, pinned at its middle line; not at
    small strains."""
    from scipy.linalg import eigvalsh

    n, thin, young, density = 20, 0.02, 1e9, 1000.0
    points, cells = box("quad8", (n, 1), (1.0, thin))
    middle = np.abs(points[:, 1] - thin / 2) < 1e-9
    ends = np.flatnonzero(middle & ((points[:, 0] < 1e-9) | (points[:, 0] > 1 - 1e-9)))
    buckles = np.pi**2 * young * thin**2 / 12  # mean stress
    exact = np.pi / 2 * np.sqrt(young * thin**2 / 12 / density)
    for kinematics, pull, stiffer in (("small", 1.0, 1.0), ("corotational", 1.0, 2.0), ("total_lagrangian", 0.0, 1.0),
                                      ("total_lagrangian", 1.0, 2.0), ("logarithmic", -0.5, 0.5)):  # fmt: skip
        body = SolidBody(points, cells, IsotropicElastic(young=young, poisson=0.0), density=density, plane="stress",
                         kinematics=kinematics, groups={"ends": ends}, initial_stress=pull * buckles * np.eye(6)[0])  # fmt: skip
        free = np.setdiff1d(np.arange(points.size), body.dofs({"ends": "xy"}))
        k, m = (a[free][:, free].todense() for a in (body.K, body.M))
        first = np.sqrt(eigvalsh(k, m, subset_by_index=[0, 0])[0]) / (2 * np.pi)
        assert first == pytest.approx(exact * np.sqrt(stiffer), rel=1e-3)


@pytest.mark.parametrize("kinematics", ["small", "total_lagrangian"])
def test_the_law_is_asked_at_its_stretch(kinematics):
    """The stretch at which a neo-Hookean law (or Hooke's) has a stress, and its response from there on, by plain loops."""
    from scipy.optimize import root

    young, poisson = 1e6, 0.3
    shear, lame = young / 2.6, young * 0.3 / (1.3 * 0.4)
    given = np.array([2e5, -1e5, 5e4, 8e4, -6e4, 3e4])
    before = given[[[0, 3, 4], [3, 1, 5], [4, 5, 2]]]
    one = np.eye(3)

    def law(f):
        if kinematics == "small":
            strain = (f + f.T) / 2 - one
            return 2 * shear * strain + lame * np.trace(strain) * one
        back = np.linalg.inv(f).T
        return shear * (f - back) + lame * np.log(np.linalg.det(f)) * back

    def stretch(x):
        return one + x[[[0, 3, 4], [3, 1, 5], [4, 5, 2]]]

    def left(x):
        u = stretch(x)
        true = law(u) if kinematics == "small" else law(u) @ u / np.linalg.det(u)
        return ((true - before) / young)[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]

    start = stretch(root(left, np.zeros(6), tol=1e-14).x)
    turned = one + 0.2 * (np.random.default_rng(1).random((3, 3)) - 0.5)
    if kinematics == "small":
        wanted = law(turned + start - one)
    else:
        wanted = law(turned @ start) @ start / np.linalg.det(start)
    points, cells = box("hexahedron", (1, 1, 1), (1.0, 1.0, 1.0))
    material = (
        IsotropicElastic(young=young, poisson=poisson) if kinematics == "small" else NeoHookean(young=young, poisson=poisson)
    )
    body = SolidBody(points, cells, material, kinematics=kinematics, initial_stress=given)
    force = body.tangent(points @ (turned - one).T)[0].reshape(-1, 3)
    for k in range(3):
        face = points[:, k] > 0.5
        assert np.allclose(force[face].sum(axis=0), wanted[:, k], rtol=0, atol=1e-11 * young)


@pytest.mark.parametrize("law", [J2Plasticity, FiniteJ2])
def test_metal_yields_at_what_is_left_of_its_strength(law):
    """Uniaxial stress by displacements, from s0 on: the first plastic strain at (yield - s0)/E."""
    young, strength, before = 2e5, 100.0, 60.0
    points, cells = box("hexahedron", (1, 1, 1), (1.0, 1.0, 1.0))
    body = SolidBody(points, cells, law(young=young, poisson=0.3, yield_stress=strength), initial_stress=(before, 0, 0, 0, 0, 0))
    fixed = {tuple(np.flatnonzero(points[:, k] < 0.5)): "xyz"[k] for k in range(3)}
    body.groups = {f"low {a}": np.array(nodes) for nodes, a in fixed.items()} | {"high": np.flatnonzero(points[:, 0] > 0.5)}
    held = {"low x": "x", "low y": "y", "low z": "z", "high": "x"}
    pull = body.load({"high": (before, 0.0, 0.0)})
    for stretch, yields in ((0.9, False), (1.1, True)):
        model, to = body.model(), np.zeros_like(points)
        to[body.groups["high"], 0] = stretch * (strength - before) / young
        u = body.solve(held, force=pull, displacement=to, model=model, increments=2)
        stress = body.stress(u, model)["hexahedron"][0]
        plastic = model.states()[0][0, -1]
        assert (plastic > 0) == yields
        assert stress[0] == pytest.approx(min(strength, before + stretch * (strength - before)), rel=2e-4)
        assert np.abs(stress[1:]).max() < 1e-6


def test_soil_yields_at_what_is_left_of_its_strength():
    """Drucker and Prager's cone under hydrostatic pressure p: shear by sqrt(J2) = xi c + eta p, for any initial stress."""
    young, poisson, cohesion, angle = 1e6, 0.25, 100.0, 0.5
    law = DruckerPrager(young=young, poisson=poisson, cohesion=cohesion, friction_angle=angle)
    points, cells = box("quad", (1, 1), (1.0, 1.0))
    root = np.sqrt(3.0) * (3 - np.sin(angle))
    eta, xi = 6 * np.sin(angle) / root, 6 * np.cos(angle) / root
    for pressure in (0.0, 200.0):
        before = 0.5 * (xi * cohesion + eta * pressure)  # half of the shear is there
        body = SolidBody(points, cells, law, initial_stress=(-pressure, -pressure, -pressure, before, 0, 0))
        for share, yields in ((0.95, False), (1.05, True)):
            u = np.zeros_like(points)
            u[:, 0] = share * before * 2 * (1 + poisson) / young * points[:, 1]
            model = body.model()
            stress = body.stress(u, model)["quad"][0]
            model.commit()
            assert (model.states()[0][0, -1] > 0) == yields
            assert stress[3] == pytest.approx(before * (1 + min(share, 1.0)), rel=1e-9)


def test_restart_goes_on_to_the_same_bits(tmp_path):
    law, kinematics = LAWS["kelvin_voigt"]

    def made():
        scene = column("quad", law, kinematics)
        return cn.Simulation(scene, dt=1e-3)

    def push(sim):
        sim.nodes.set(velocity=np.where(sim.nodes.position[:, 1:] > 1, 0.1, 0.0) * [[0.0, 1.0]])

    sim = made()
    push(sim)
    for _ in range(4):
        sim.step()
    sim.checkpoint(tmp_path / "half.h5")
    for _ in range(4):
        sim.step()
    other = made()
    other.restore(tmp_path / "half.h5")
    for _ in range(4):
        other.step()
    assert np.array_equal(sim.meshes[0].position, other.meshes[0].position)
    assert np.array_equal(sim.meshes[0].stress["quad"], other.meshes[0].stress["quad"])
    assert sim.info["energy"] == other.info["energy"]


@pytest.mark.parametrize("solid", [False, True])
def test_scene_files_and_run_files_hold_it(tmp_path, solid):
    points, cells = box("quad", (2, 2), (1.0, 1.0))
    body = (
        SolidBody(points, cells, NeoHookean(young=1e6, poisson=0.3), density=1000.0)
        if solid
        else cn.ElasticBody(points, cells, young=1e6, poisson=0.3, density=1000.0)
    )
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(body, ROCK, initial_stress=lambda x: np.c_[x[:, 0], np.zeros((len(x), 5))] * 1e4))
    scene.save(tmp_path / "scene.h5")
    again = cn.Scene.load(tmp_path / "scene.h5")
    ways = []
    for s in (scene, again):
        sim = cn.Simulation(s, dt=1e-3)
        sim.run(steps=3, output=tmp_path / f"{len(ways)}.vtkhdf", every=1)
        ways.append(sim.meshes[0].position)
    assert np.array_equal(*ways)
    run = cn.load(tmp_path / "0.vtkhdf")
    first = run[0].cells["stress"]
    assert np.abs(first).max() > 5e3


def test_what_is_wrong_is_told():
    points, cells = box("quad", (2, 2), (1.0, 1.0))
    groups = {
        "left": np.flatnonzero(points[:, 0] < 0.6),
        "edge": np.flatnonzero(points[:, 0] < 0.1),
        "all": np.arange(len(points)),
    }
    body = SolidBody(points, cells, J2Plasticity(young=1e6, poisson=0.3, yield_stress=1e3), density=1.0, groups=groups)

    def told(stress, match, of=body, error=ValueError):
        with pytest.raises(error, match=match):
            scene = cn.Scene(dim=2)
            scene.add(cn.deformable(of, ROCK, initial_stress=stress))
            cn.Simulation(scene, dt=1e-3)

    told((1, 2, 3), r"initial_stress has shape \(3,\): give \(6,\) \[Pa\], 11 22 33 12 13 23")
    told((np.nan, 0, 0, 0, 0, 0), r"initial_stress\[0\] is nan: give finite numbers")
    told({"lef": (1, 0, 0, 0, 0, 0)}, "initial_stress of 'lef': there is no such group.*left")
    told({"edge": (1, 0, 0, 0, 0, 0)}, "initial_stress of 'edge': no cell has all its nodes in this group: give a group of cells")
    told({"left": (1,) * 6, "all": (1,) * 6}, "'all' and of 'left' are both of quad cell 0: give groups that share no cell")
    told(lambda x: np.ones((len(x), 3)), r"initial_stress gave shape \(16, 3\) at 16 places: give a function of places")
    told(lambda x: np.full((len(x), 6), np.inf), "initial_stress is .*inf.*: give finite numbers")
    told((0, 0, 0, 0, 1, 0), "initial_stress of quad cell 0 is .0, 0, 0, 0, 1, 0. Pa.*: in the plane give 0 for 13 and 23")
    told((2e3, 0, 0, 0, 0, 0), "quad cell 0 .*which J2Plasticity does not bear as it is, .*: give a smaller stress or a stronger")
    flat = SolidBody(points, cells, IsotropicElastic(young=1e6, poisson=0.3), density=1.0, plane="stress")
    told((0, 0, 1, 0, 0, 0), "in plane stress give 0 for 33", flat)
    n = len(points) * 2
    told((0,) * 6, "LinearBody does not tell: give an ElasticBody or a SolidBody", cn.LinearBody(points, np.eye(n), np.eye(n)))
    soft = SolidBody(points, cells, NeoHookean(young=1e3, poisson=0.3), density=1.0)
    told((1e9, 1e9, 1e9, 0, 0, 0), "NeoHookean does not bear as it is", soft)


STEEL = {
    "small": (IsotropicElastic(young=2e11, poisson=0.3), "small", 1e-3),
    "hencky": (IsotropicElastic(young=2e11, poisson=0.3), "logarithmic", 1e-3),
    "neo_hookean": (NeoHookean(young=2e11, poisson=0.3), None, 10.0),
    "ogden": (cn.Ogden(bulk=2e11, shear1=7e10, power1=2.0), None, 10.0),
    "finite_j2": (FiniteJ2(young=2e11, poisson=0.3, yield_stress=3e8), None, 10.0),
    "neo_hookean .4999": (NeoHookean(young=2e11, poisson=0.4999), None, 1e5),
    "small .499999": (IsotropicElastic(young=2e11, poisson=0.499999), "small", 1e-3),
    "neo_hookean .499999": (NeoHookean(young=2e11, poisson=0.499999), None, 1e7),
}


@pytest.mark.parametrize("law", STEEL)
def test_stiff_laws_take_what_they_can_tell_from_none(law):
    """Steel and nearly incompressible materials take stresses of every size to the rounding of their law; where rounding is a
    thousandth of the stress or more, the error names it as the cause."""
    points, cells = box("quad", (2, 2), (1.0, 1.0))
    law, kinematics, sure = STEEL[law]
    stress = np.array([1.0, -0.5, 0.2, 0.3, 0.0, 0.0])
    for size in (1e-3, 1.0, 1e3, 1e5, 1e6, 1e7, 1e8):
        try:
            body = SolidBody(points, cells, law, density=8000.0, kinematics=kinematics, initial_stress=size * stress)
            found = body.stress(np.zeros_like(points), body.model())["quad"]
        except ValueError as wrong:
            assert size < sure and "cannot tell from none" in str(wrong) and "rounds its stresses" in str(wrong)
            continue
        assert np.abs(found / size - stress).max() < 2e-3


@pytest.mark.parametrize("solid", [False, True])
def test_what_it_stores_passes_over_when_bodies_are_reshaped(solid):
    """Stored before the first step, given up where the body becomes rigid, brought in where a rigid one is made deformable."""
    points, cells = box("quad", (3, 3), (1.0, 1.0))
    stress, square = np.array([2e4, -1e4, 0, 5e3, 0, 0]), [np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])]
    if solid:
        body = SolidBody(points, cells, IsotropicElastic(young=1e6, poisson=0.3), density=1000.0)
    else:
        body = cn.ElasticBody(points, cells, young=1e6, poisson=0.3, density=1000.0)
    trace = stress[:3].sum()
    whole = (1.3 * (stress[:3] @ stress[:3] + 2 * stress[3] ** 2) - 0.3 * trace**2) / 2e6  # of a volume of 1
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(body, ROCK, initial_stress=stress))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(theta=0.5))
    assert sim.energy["stored"] == pytest.approx(whole, rel=1e-11)
    for _ in range(20):
        sim.step()
    assert sim.energy["kinetic"] + sim.energy["stored"] == pytest.approx(whole, rel=1e-10)
    at = sim.meshes[0].position.mean(axis=0)
    sim.rigidify(0, cn.polygons(square, ROCK, position=[at]))
    told = sim.energy
    turns = told["kinetic"]  # a little, since it moved by its linear shape
    assert abs(told["stored"]) < 1e-10 * whole and turns < 1e-5 * whole
    assert told["dissipated_reshaping"] == pytest.approx(whole - turns, rel=1e-10)
    sim.deform(int(sim.bodies.id[0]), body, initial_stress=stress)
    told = sim.energy
    assert told["stored"] == pytest.approx(whole, rel=1e-10)
    assert told["kinetic"] + told["dissipated_reshaping"] == pytest.approx(0.0, abs=1e-10 * whole)
    for _ in range(5):
        sim.step()
    told = sim.energy
    kept = sum(told[name] for name in ("kinetic", "stored", "dissipated_reshaping", "dissipated_integrator"))
    assert kept == pytest.approx(whole, rel=1e-10)
    assert abs(told["closure"]) < 1e-10 * told["in_play"]


@pytest.mark.parametrize("solid", [False, True])
def test_a_shadow_of_velocities_is_told_of_it(solid, tmp_path):
    points, cells = box("quad", (3, 3), (1.0, 1.0))
    given = {"density": 1000.0, "groups": {"foot": np.flatnonzero(points[:, 1] < 1e-9)}}
    if solid:
        body = SolidBody(points, cells, IsotropicElastic(young=1e6, poisson=0.3), kinematics="small", **given)
    else:
        body = cn.ElasticBody(points, cells, young=1e6, poisson=0.3, **given)
    scene = cn.Scene(dim=2, gravity=(0, -9.0))
    scene.add(cn.deformable(body, ROCK, fixed={"foot": "xy"}, initial_stress=(2e4, -1e4, 0, 5e3, 0, 0)))
    sim = cn.Simulation(scene, 1e-3, cn.NSCD(theta=0.5))
    shadow = sim.shadow("compute_free_velocity", tol=1e-9, folder=tmp_path)
    for _ in range(5):
        sim.step()
    assert shadow.beyond is None and len(shadow.records) == 5


@pytest.mark.parametrize("make", [cn.bars, cn.beams])
def test_stresses_of_too_few_bars_are_told(make):
    points = np.c_[np.linspace(0, 1, 9), np.zeros(9)]
    more = {} if make is cn.bars else {"inertia": 1e-9}
    for wrong in (np.ones(3), np.ones((8, 6))):
        with pytest.raises(ValueError, match=r"initial_stress has shape .*: give a number, or one for each of the 8 cells"):
            make(points, np.c_[:8, 1:9], young=2e11, area=1e-6, density=8e3, initial_stress=wrong, **more)
