"""Motions that are given, by every integrator: where nodes and bodies are, and what drives them, against M a + K u."""

import cairn as cn
import numpy as np
import pytest
from second_order import box

ROCK = cn.Material("rock", density=1000.0)
EACH = [
    cn.Theta(), cn.Theta(theta=1.0), cn.DiscreteGradient(), cn.CentralDifference(), cn.BetaScheme(beta=0.6),
    cn.BetaScheme(beta=1.0), cn.VelocityVerlet(), cn.Newmark(), cn.Newmark(beta=0.3025, gamma=0.6),
    cn.Newmark(beta=0.3, gamma=0.5), cn.Newmark(beta=0.0, gamma=0.5), cn.Newmark(beta=0.5, gamma=1.0), cn.HHT(alpha=-0.3),
    cn.GeneralisedAlpha(spectral_radius=0.0), cn.GeneralisedAlpha(spectral_radius=0.8), cn.Gear(values=4),
    cn.Gear(values=5), cn.Gear(values=6),
]  # fmt: skip
CORNERS = [[0, 0], [1, 0], [1, 1], [0, 1]]


def square(integrator, dt=1e-3, solid=False, lumped=True, **given):
    """A square of 1000 kg, a single cell with a stable step of 0.03 s."""
    more = {"density": 1000.0, "lumped": lumped, "groups": {"all": [0, 1, 2, 3], "left": [0, 3], "right": [1, 2]}}
    if solid:
        body = cn.SolidBody(CORNERS, {"quad": [[0, 1, 2, 3]]}, cn.NeoHookean(young=1e6, poisson=0.3), **more)
    else:
        body = cn.ElasticBody(CORNERS, {"quad": [[0, 1, 2, 3]]}, young=1e6, poisson=0.3, **more)
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(body, ROCK, **given))
    scene.interact("*", "*", None)
    return cn.Simulation(scene, dt=dt, strategy=cn.NSCD(integrator=integrator))


@pytest.mark.parametrize("solid", [False, True])
@pytest.mark.parametrize("integrator", EACH, ids=repr)
def test_what_is_displaced_is_where_it_is_asked_to_be(integrator, solid):
    def asked(t):
        return 1e-2 * (1 - np.cos(20 * t))

    sim = square(integrator, solid=solid, fixed={"left": "xy"}, displace={"right": {"x": asked}})
    reactions = []
    for k in range(300):
        sim.step()
        if k > 10:
            assert sim.meshes[0].displacement[1, 0] == pytest.approx(asked(sim.time), abs=1e-7 * 1e-2)
            reactions.append(sim.meshes[0].reaction("right")[0])
    # M a + K u moves by less than a hundredth of its most in a step of a fiftieth of a radian, and does not ring
    assert np.abs(np.diff(reactions)).max() < 0.015 * np.abs(reactions).max()
    e = sim.energy
    assert abs(e["closure"]) < 1e-8 * e["in_play"]


@pytest.mark.parametrize("lumped", [True, False])
@pytest.mark.parametrize("how", ["drive", "displace"])
@pytest.mark.parametrize("integrator", EACH, ids=repr)
def test_what_drives_a_mass_is_its_mass_times_its_acceleration(integrator, how, lumped):
    """1000 kg at 2 m/s2: 2000 N in every step, and the work is the kinetic energy, but for methods that advance by velocities of
    one end of the step."""
    given = {"x": lambda t: 2 * t, "y": 0.0} if how == "drive" else {"x": lambda t: t * t, "y": lambda t: 0.0}
    sim = square(integrator, lumped=lumped, **{how: {"all": given}})
    for k in range(50):
        sim.step()
        if how == "drive" or k > 30:
            assert sim.meshes[0].reaction("all")[0] == pytest.approx(2000, rel=1e-6)
    e = sim.energy
    whole = integrator.scheme(1.0)["share"] + sum(integrator.scheme(1.0)["position"][:1])
    if whole == pytest.approx(0.5):
        assert e["work_driven"] == pytest.approx(e["kinetic"], rel=1e-9) == pytest.approx(5.0, rel=1e-4)
        assert abs(e["dissipated_integrator"]) < 1e-9 * e["kinetic"]
    assert abs(e["closure"]) < 1e-12 * e["in_play"]


@pytest.mark.parametrize("integrator", EACH, ids=repr)
def test_what_drives_a_disk_works_its_kinetic_energy(integrator):
    """m v^2/2 of a disk with a drag c, and what the drag takes, m c v^2 h summed: the force is m (a + c v)."""
    mass, c = 1000 * np.pi * 0.01, 5.0
    scene = cn.Scene(dim=2, gravity=(-3.0, 0.0))
    drive = {"driven": ("vx", "vy", "w"), "drive": lambda t: (2 * t, 0.0, 0.0), "damping": c}
    scene.add(cn.disks([[0.0, 0.0]], 0.1, ROCK, **drive))
    scene.interact("*", "*", None)
    sim = cn.Simulation(scene, dt=1e-3, strategy=cn.NSCD(integrator=integrator))
    sim.run(steps=50, progress=False)
    e, way = sim.energy, 0.05**2
    assert e["kinetic"] == pytest.approx(0.5 * mass * 0.1**2, rel=1e-12)
    taken = mass * c * 4 * 0.05**3 / 3
    assert e["work_driven"] == pytest.approx(e["kinetic"] + taken + mass * 3 * way, rel=0.03)
    assert abs(e["closure"]) < 1e-12 * e["in_play"]
    mid = integrator.scheme(1.0)["share"] + sum(integrator.scheme(1.0)["position"][:1]) == pytest.approx(0.5)
    if mid:
        assert abs(e["dissipated_integrator"]) < 1e-12 * e["in_play"]


@pytest.mark.parametrize("integrator", EACH, ids=repr)
def test_a_held_end_that_stops_bears_its_momentum_once(integrator):
    """A bar that was given a velocity as a whole, and one end of it held: that end stops in the first step, which takes m v/h;
    then the support bears the force of its cell."""
    n = 10
    points = np.c_[np.linspace(0, 1, n + 1), np.zeros(n + 1)]
    groups = {"left": [0], "all": np.arange(n + 1)}
    cells = np.c_[np.arange(n), np.arange(1, n + 1)]
    body = cn.bars(points, cells, young=1e6, area=1e-2, density=1000.0, groups=groups)
    scene = cn.Scene(dim=2)
    scene.add(cn.deformable(body, ROCK, fixed={"left": "x", "all": "y"}, velocity=(1.0, 0.0)))
    scene.interact("*", "*", None)
    sim = cn.Simulation(scene, dt=1e-4, strategy=cn.NSCD(integrator=integrator))
    at_rest = body.M.toarray()[0, 0] / 1e-4  # at least of the momentum of the end itself
    for k in range(100):
        sim.step()
        reaction, pull = sim.meshes[0].reaction("left")[0], 1e5 * sim.meshes[0].displacement[1, 0]
        if k == 0:
            assert -1.6 * at_rest < reaction < -0.9 * at_rest
        elif k > 1:
            assert reaction == pytest.approx(-pull, rel=0.1, abs=0.01 * at_rest)


@pytest.mark.parametrize("integrator", [cn.Newmark(), cn.VelocityVerlet(), cn.HHT(alpha=-0.1), cn.Gear(values=5)], ids=repr)
def test_a_bar_that_is_shaken_at_its_foot_converges_to_second_order(integrator):
    """With a consistent mass, by which the given motion acts on free nodes; reference by the theta-method with a fine step."""

    def tip(method, h):
        points, cells = box("quad", (4, 1), (1.0, 0.1))
        groups = {"foot": np.flatnonzero(points[:, 0] == 0), "all": np.arange(len(points))}
        body = cn.ElasticBody(points, cells, young=1e6, poisson=0.0, density=1000.0, lumped=False, groups=groups)
        scene = cn.Scene(dim=2)
        shaken = {"foot": {"x": lambda t: 0.1 * np.sin(40 * t)}}
        scene.add(cn.deformable(body, ROCK, fixed={"all": "y"}, drive=shaken))
        scene.interact("*", "*", None)
        sim = cn.Simulation(scene, dt=h, strategy=cn.NSCD(integrator=method))
        sim.run(steps=round(0.1 / h), progress=False)
        return sim.meshes[0].displacement[-1, 0]

    exact = tip(cn.Theta(), 1e-5)
    errors = [abs(tip(integrator, h) - exact) for h in (8e-4, 4e-4)]
    assert np.log2(errors[0] / errors[1]) > 1.7


@pytest.mark.parametrize("integrator", EACH, ids=repr)
def test_held_nodes_bear_what_rests_on_them(integrator):
    """A disk on a plate that is held: contacts give the weight of a whole step, whatever the impulse of a force of the method."""
    cells, groups = {"quad": [[0, 1, 2, 3]]}, {"all": [0, 1, 2, 3]}
    body = cn.ElasticBody(CORNERS, cells, young=1e6, poisson=0.3, density=1000.0, lumped=True, groups=groups)
    scene = cn.Scene(dim=2, gravity=(0.0, -10.0))
    scene.add(cn.deformable(body, ROCK, edges=[[1, 2], [2, 3], [3, 0]], fixed={"all": "xy"}))
    scene.add(cn.disks([[0.5, 1.1]], 0.1, ROCK))
    scene.interact("*", "*", cn.Coulomb(mu=0.3))
    sim = cn.Simulation(scene, dt=1e-3, strategy=cn.NSCD(integrator=integrator))
    for _ in range(3):
        sim.step()
        assert sim.meshes[0].reaction("all")[1] == pytest.approx(1e4 * (1 + np.pi * 0.01), rel=1e-9)


@pytest.mark.parametrize("lumped", [True, False])
@pytest.mark.parametrize("solid", [False, True])
@pytest.mark.parametrize(
    "integrator", [cn.Theta(), cn.Newmark(), cn.HHT(alpha=-0.1), cn.GeneralisedAlpha(spectral_radius=0.8)], ids=repr
)
def test_reactions_give_the_momentum_of_all_that_hangs_on_them(integrator, solid, lumped):
    """A plate drawn by its left side, its right one a rigid part: the reaction is the rate of its momentum, but for half a step
    where forces are those of the end."""
    points, cells = box("quad", (2, 2), (1.0, 1.0))
    left, right = (np.flatnonzero(points[:, 0] == x) for x in (0.0, 1.0))
    more = {"density": 1000.0, "lumped": lumped, "groups": {"left": left, "right": right}}
    if solid:
        body = cn.SolidBody(points, cells, cn.NeoHookean(young=1e6, poisson=0.0), **more)
    else:
        body = cn.ElasticBody(points, cells, young=1e6, poisson=0.0, **more)
    scene = cn.Scene(dim=2)
    drawn = {"left": {"x": lambda t: 2 * t, "y": lambda t: 0.0}}
    scene.add(cn.deformable(body, ROCK, rigid=["right"], drive=drawn))
    scene.interact("*", "*", None)
    sim = cn.Simulation(scene, dt=1e-3, strategy=cn.NSCD(integrator=integrator))
    reactions, rates, before = [], [], 0.0
    for _ in range(200):
        sim.step()
        momentum = (body.M @ sim.meshes[0].velocity.ravel())[::2].sum()
        reactions.append(sim.meshes[0].reaction("left")[0])
        rates.append((momentum - before) / 1e-3)
        before = momentum
    assert np.abs(np.subtract(reactions, rates))[2:].max() < 0.015 * np.abs(rates).max()
    assert sum(reactions) == pytest.approx(sum(rates), rel=5e-3)
    assert abs(sim.energy["closure"]) < 1e-8 * sim.energy["in_play"]


@pytest.mark.parametrize("between", [0, 3])
@pytest.mark.parametrize("kinds", ["cc", "cf", "fc", "ff"])
@pytest.mark.parametrize("dim", [2, 3])
def test_dofs_of_a_body_are_driven_one_after_the_other(dim, kinds, between):
    """Gravity would reveal a released dof. Regression: of two calls before a step the first was lost, and a function was
    frozen."""
    gravity = (-7.0, -9.81, -3.0)[:dim]
    names = ("vx", "vy", "w") if dim == 2 else ("vx", "vy", "vz", "wx", "wy", "wz")
    for first, second in [(0, 1), (1, 0), (0, len(names) - 1), (dim, 1)]:
        scene = cn.Scene(dim, gravity=gravity)
        make = cn.disks if dim == 2 else cn.spheres
        ids = scene.add(make(np.eye(dim)[:1], 0.1, ROCK))
        scene.interact("*", "*", cn.Coulomb(mu=0.3))
        sim = cn.Simulation(scene, 1e-2)
        for k, (dof, size) in enumerate(((first, 3.0), (second, 2.0))):
            along = size * np.eye(len(names))[dof]
            sim.drive(ids, names[dof], along if kinds[k] == "c" else lambda t, along=along: along * (1 + t))
            for _ in range(between):
                sim.step()
        for _ in range(5):
            sim.step()
        grown = [1 if kind == "c" else 1 + sim.time for kind in kinds]
        assert sim.bodies.velocity[0, [first, second]] == pytest.approx([3.0 * grown[0], 2.0 * grown[1]], rel=1e-14)
        sim.drive(ids, (), None)
        before = sim.bodies.velocity.copy()
        sim.step()
        assert sim.bodies.velocity[0, :dim] - before[0, :dim] == pytest.approx(np.multiply(gravity, 1e-2))


def test_what_holds_the_other_dofs_goes_on(tmp_path):
    """A guided plate, driven along a free dof, keeps its guides, also after a restart."""

    def made():
        scene = cn.Scene(2, gravity=(-7.0, -9.81))
        (plate,) = scene.add(cn.disks([[0.0, 0.0]], 0.1, ROCK, driven=("vx", "w")))
        scene.interact("*", "*", cn.Coulomb(mu=0.3))
        return cn.Simulation(scene, 1e-2), plate

    (sim, plate), (again, _) = made(), made()
    sim.drive([plate], "vy", cn.Harmonic((0.0, 1.0, 0.0), 3.0))
    sim.step(), sim.checkpoint(tmp_path / "a.h5"), sim.step()
    assert list(sim.bodies.velocity[0]) == [0.0, pytest.approx(np.cos(6 * np.pi * sim.time)), 0.0]
    again.restore(tmp_path / "a.h5")
    again.step()
    assert again.bodies.velocity.tobytes() == sim.bodies.velocity.tobytes()
    assert again.bodies.position.tobytes() == sim.bodies.position.tobytes()


def test_velocities_that_drive_are_those_of_the_call():
    """Later changes of the array that was given reach no body."""
    given = np.array([0.0, 1.0, 0.0])
    stone = cn.Material("stone", density=1000.0)
    scene = cn.Scene(2)
    bodies = scene.add(cn.disks([[0.0, 0.0], [1.0, 0.0]], 0.1, stone, driven=("vx", "vy"), drive=given))
    given[:] = 7.0
    sim = cn.Simulation(scene, 1e-3)
    sim.step()
    assert np.array_equal(sim.bodies.velocity[:, 1], [1.0, 1.0])
    given[:] = (0.0, 2.0, 0.0)
    sim.drive(bodies[:1], ("vx", "vy"), given)
    given[:] = 9.0
    sim.drive(bodies[1:], ("vx", "vy"), (0.0, 3.0, 0.0))
    sim.step()
    assert np.array_equal(sim.bodies.velocity[:, 1], [2.0, 3.0])
