"""What is told of a liquid before its first step: depths, pressures, names, gravity of the start, and many sub-steps."""

import warnings

import cairn as cn
import numpy as np
import pytest
from cairn.run.fluid_gaps import FluidWarning

G = 9.81
stone = cn.Material("stone", density=2600.0)
wood = cn.Material("wood", density=500.0)


def tank(*sets, gravity=(0.0, -G), depth=1.0, dt=2e-3, region=((0, 0), (1, 0.5)), spacing=0.1, **options):
    scene = cn.Scene(dim=2, gravity=gravity, depth=depth)
    scene.add(cn.wall((0, 0), (0, 1), stone), cn.wall((0, 0), (1, 0), stone), cn.wall((1, 0), (-1, 0), stone))
    scene.add(*sets, cn.fluid(region, spacing, **options))
    scene.interact("*", "*", None)
    return cn.Simulation(scene, dt=dt)


def block(depth, **options):
    corners = np.array([(0.3, 0.45), (0.7, 0.45), (0.7, 0.65), (0.3, 0.65)])
    return cn.polygons([corners], wood, depth=depth, **options)


def told(make):
    """Texts of the warnings of the liquid."""
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        make()
    return [str(w.message) for w in found if issubclass(w.category, FluidWarning)]


def test_another_depth_of_a_float_is_told():
    texts = told(lambda: tank(block(2.0)))
    assert len(texts) == 1
    assert "depth of body 3 is 2 m" in texts[0] and "that of the scene, over which the liquid presses, 1 m" in texts[0]
    assert "cn.Scene(depth=2) or depth=1" in texts[0]
    for silent in (
        lambda: tank(block(2.0), depth=2.0),
        lambda: tank(block(1.0)),
        lambda: tank(block(2.0, fixed=True)),  # its mass moves nothing
        lambda: tank(cn.disks([[0.5, 0.6]], 0.12, wood)),
    ):
        assert not [text for text in told(silent) if "depth" in text]


def test_another_depth_of_a_body_that_comes_later_is_told():
    sim = tank(block(1.0))

    def later():
        sim.add(cn.polygons([np.array([(0.3, 1.0), (0.7, 1.0), (0.7, 1.2), (0.3, 1.2)])], wood, depth=0.5))
        sim.step()

    assert ["depth of body 4 is 0.5 m" in text for text in told(later)] == [True]


def test_a_float_of_the_liquids_depth_floats():
    """The warning's reason: a body of twice the depth sinks as one of twice the density."""
    sims = [tank(block(d), depth=s, spacing=0.05) for d, s in ((1.0, 1.0), (2.0, 2.0))]
    for sim in sims:
        sim.run(steps=100, progress=False)
    assert sims[0].bodies.position[3] == pytest.approx(sims[1].bodies.position[3], abs=1e-9)


def first_step(sim):
    """Text of the warning of sub-steps before a step, which is then not made."""
    with warnings.catch_warnings():
        warnings.filterwarnings("error", category=FluidWarning)
        with pytest.raises(FluidWarning) as wrong:
            sim.step()
    assert sim.time == 0 and sim.steps == 0
    return str(wrong.value)


def test_many_sub_steps_are_told_before_the_first_step():
    text = first_step(tank(sound_speed=1e5))
    number = int(text.split(" takes ")[1].split()[0])
    assert number == pytest.approx(2e-3 * 1e5 / (0.25 * 0.15), rel=1e-3)
    assert "a sound_speed below 100000 m/s, or a larger spacing than 0.1 m" in text
    assert "a viscosity below 10000 Pa s" in first_step(tank(sound_speed=20.0, viscosity=1e4, dt=1.0))


def test_sub_steps_are_told_from_two_thousand_on_and_once():
    limit = 0.25 * 0.15 / 1e3
    assert not told(lambda: tank(sound_speed=1e3, dt=100 * limit).step())
    sim = tank(sound_speed=1e3, dt=100 * limit)
    assert [" sub-steps" in text for text in told(lambda: sim.step(2100 * limit))] == [True]
    assert not told(lambda: sim.step(2200 * limit))


def test_a_pressure_of_the_start_is_blamed_itself():
    with pytest.raises(ValueError, match=r"pressure of the fluid is 1e\+09 Pa at the start.*give a smaller pressure, or"):
        tank(pressure=1e9)
    with pytest.raises(ValueError, match="pressure of the fluid is -1e"):
        tank(pressure=-1e9)
    with pytest.raises(ValueError, match="sound speed of 0.5 m/s is too low"):  # with the pressure of rest
        tank(sound_speed=0.5).run(steps=40, progress=False)
    speed = 10 * np.sqrt(1e9 / 1000)
    assert tank(pressure=1e9, sound_speed=speed).fluid.pressure.max() == pytest.approx(1e9)


def test_gravity_of_the_start_is_named():
    with pytest.raises(ValueError, match="neither gravity across the liquid nor a velocity at t = 0"):
        tank(gravity=lambda t: (0.0, -G * min(t, 1.0)))


@pytest.mark.parametrize("name, group", [("stone", None), ("heavy", "heavy")])
def test_a_fluid_with_the_name_of_bodies_is_refused(name, group):
    with pytest.raises(ValueError, match=f"name of a fluid is '{name}', and a material or group"):
        tank(cn.disks([[0.5, 0.8]], 0.12, stone, group=group), name=name)


def test_particles_that_stand_alone_on_a_floor_are_spray():
    """Their walls fill the space about them, and their volume is none of a liquid."""
    sim = tank(region=[(0.3, 0.05), (0.5, 0.05), (0.7, 0.05)])
    assert not told(sim.step)
    assert sim.fluid.info["volume"] == 1.0
    row = tank(region=[(0.05 + 0.1 * k, 0.05) for k in range(10)])
    row.step()
    assert row.fluid.info["volume"] != 1.0 and row.fluid.info["volume"] == pytest.approx(1.0, abs=0.1)


def test_viscosity_of_the_incompressible_form_names_its_sub_steps():
    sim = tank(incompressible=True, viscosity=1e7)
    with pytest.raises(ValueError, match=r"sub-steps of the viscosity of the incompressible fluid, at most 1000 .*give a dt of"):
        sim.step()
    assert sim.time == 0


def test_gauges_outside_the_liquid():
    sim = tank()
    sim.step()
    assert sim.fluid.pressure_at([(5.0, 5.0)])[0] == 0.0 and np.isnan(sim.fluid.level_at([(5.0, 5.0)])[0])


def grains(**options):
    places = np.stack(np.meshgrid(np.arange(8), np.arange(8), indexing="ij"), -1).reshape(-1, 2) * 0.02 + (0.2, 0.011)
    scene = cn.Scene(dim=2, gravity=(0.0, -G))
    scene.add(cn.wall((0, 0), (0, 1), stone), cn.wall((0, 0), (1, 0), stone), cn.wall((1, 0), (-1, 0), stone))
    scene.add(cn.disks(places, 0.0095, cn.Material("sand", **options)), cn.fluid([(0, 0), (1, 0.5)], 0.05))
    scene.interact("*", "*", None)
    scene.interact("fluid", "sand", cn.GrainDrag())
    return cn.Simulation(scene, dt=2e-3)


def thin(name="sheet"):
    points = [(x, y) for x in (0.2, 0.4, 0.6) for y in (0.7, 0.71)]
    quads = [[0, 2, 3, 1], [2, 4, 5, 3]]
    body = cn.ElasticBody(points, {"quad": quads}, young=1e6, poisson=0.3, density=1000.0)
    return cn.deformable(body, wood, name=name)


def add_and_step(what):
    sim = tank()
    sim.add(what)
    sim.step()


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: tank(surface_tension=0.07), "surface_tension of the fluid"),
        (lambda: tank(block(2.0)), "depth of body 3"),
        (lambda: grains(density=2600.0), "grains take"),
        (lambda: grains(density=1050.0), "a bed of free grains weighs"),
        (lambda: tank(cn.disks([[0.5, 0.21]], 0.2, wood)), "leave gaps"),
        (lambda: tank(thin()), "deformable body 'sheet' is"),
        (lambda: add_and_step(block(2.0)), "depth of body 3"),
        (lambda: add_and_step(thin("late")), "deformable body 'late' is"),
        (lambda: tank(sound_speed=1e5).step(), "sub-steps of the liquid"),
        (lambda: tank(cn.disks([[0.5, 0.3]], 0.12, cn.Material("foam", density=1.0))).step(), "so much lighter than"),
    ],
)
def test_warnings_point_to_the_line_of_the_script(make, text):
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        make()
    found = [w for w in found if issubclass(w.category, FluidWarning) and text in str(w.message)]
    assert len(found) == 1
    assert found[0].filename == __file__


def block_in_tank(density, theta=0.5, **options):
    """A block of rubber in the tank, and the simulation."""
    points = [(x, y) for y in (0.1, 0.4) for x in (0.3, 0.7)]
    form = {"incompressible": options.pop("incompressible", False)}
    body = cn.SolidBody(points, {"quad": [[0, 1, 3, 2]]}, cn.NeoHookean(young=1e6, poisson=0.3), density=density, **options)
    scene = cn.Scene(dim=2, gravity=(0.0, -G))
    scene.add(cn.wall((0, 0), (0, 1), stone), cn.deformable(body, wood, name="block"))
    scene.add(cn.fluid([(0, 0), (1, 0.5)], 0.1, **form))
    scene.interact("*", "*", None)
    return cn.Simulation(scene, dt=2e-3, strategy=cn.NSCD(theta=theta))


def test_a_light_mesh_without_damping_is_told_by_name():
    texts = told(lambda: block_in_tank(100.0))
    assert len(texts) == 1
    assert "deformable body 'block' has 100 kg/m3 in a liquid of 1000, no damping, and theta=0.5" in texts[0]
    assert "give NSCD(theta=0.6), the body rayleigh=(a, b), or the liquid incompressible=True" in texts[0]
    assert len(told(lambda: block_in_tank(1.0, incompressible=True))) == 1
    for silent in (
        lambda: block_in_tank(1200.0),
        lambda: block_in_tank(100.0, theta=0.6),
        lambda: block_in_tank(100.0, rayleigh=(0.0, 1e-3)),
        lambda: block_in_tank(100.0, incompressible=True),
    ):
        assert not told(silent)


def rubber(density=100.0):
    points = [(x, y) for y in (0.1, 0.4) for x in (0.3, 0.7)]
    groups = {"all": range(4), "one": [0]}
    return cn.SolidBody(points, {"quad": [[0, 1, 3, 2]]}, cn.NeoHookean(young=1e6, poisson=0.3), density=density, groups=groups)


def in_tank(body, **options):
    scene = cn.Scene(dim=2, gravity=(0.0, -G))
    scene.add(cn.wall((0, 0), (0, 1), stone), cn.deformable(body, wood, name="block", **options))
    scene.add(cn.fluid([(0, 0), (1, 0.5)], 0.1))
    scene.interact("*", "*", None)
    return cn.Simulation(scene, dt=2e-3)


def called(density):
    """The same block by a function of its own."""
    made = rubber(density)
    full = [made.M.toarray(), made.K.toarray()]

    def forces(at):
        return (full[1] @ np.ravel(at.displacement)).reshape(-1, 2), full[1]

    return cn.CallbackBody(made.points, full[0], forces, groups=made.groups, edges=made.boundary_edges())


def tied(density):
    """Two blocks joined at y = .25, of which the lower one has the density of rock."""
    parts = {}
    for name, low, of in (("low", 0.1, 2600.0), ("high", 0.25, density)):
        points = [(x, y) for y in (low, low + 0.15) for x in (0.3, 0.7)]
        groups = {"bottom": [0, 1], "top": [2, 3]}
        parts[name] = cn.ElasticBody(points, {"quad": [[0, 1, 3, 2]]}, young=1e6, poisson=0.3, density=of, groups=groups)
    return cn.tied(parts, [("low.top", "high.bottom")])


@pytest.mark.parametrize("make", [rubber, called, tied])
def test_light_meshes_of_every_kind_are_told(make):
    def light(density):
        return [text for text in told(lambda: in_tank(make(density))) if "no damping" in text]

    assert ["'block' has 100 kg/m3 in a liquid of 1000" in text for text in light(100.0)] == [True]
    assert not light(1200.0)


@pytest.mark.parametrize("held", [{"fixed": {"all": "xy"}}, {"rigid": "all"}])
def test_a_light_mesh_without_a_free_node_is_not_told(held):
    assert not told(lambda: in_tank(rubber(), **held))
    assert len(told(lambda: in_tank(rubber(), fixed={"all": "x"}))) == 1
    assert len(told(lambda: in_tank(rubber(), fixed={"one": "xy"}))) == 1


def test_a_mesh_is_told_once():
    sim = in_tank(rubber())

    def later():
        sim.add(cn.disks([[0.5, 1.5]], 0.12, wood))
        sim.step()
        sim.add(cn.disks([[0.5, 2.5]], 0.12, wood))
        sim.step()

    assert not told(later)
